// OBJ: "v x y z", "f" with corners as 7, 7/1, 7/1/3 or 7//3, numbered from 1 or backwards as -1, and the names of "g" and "o"; every
// other statement is passed over.
//
// Our own reader, because what a shell needs of the format is these statements, and a loader that takes a malformed one for
// something else shifts every index behind it. tinyobjloader reads "1x" as 1 and a malformed coordinate as 0, lets integers
// overflow, and does not know '\' at the end of a line.
#include "mesh.hpp"
#include "text_lines.hpp"

#include <cstdio>

namespace cli {

namespace {

bool ends_in_comment(std::string_view line) { return line.find('#') != std::string_view::npos; }

// Lines that a '\' at their end continues made one, with as many empty lines behind: places in messages stay as they are.
std::string with_whole_statements(const std::string &contents) {
  if (contents.find('\\') == std::string::npos) return contents;
  std::string whole;
  std::size_t owed = 0;
  for (std::string_view rest = contents; !rest.empty();) {
    const std::string_view line = rest.substr(0, line_length(rest));
    rest.remove_prefix(line.size());
    const std::string_view text = line.substr(0, line.find_first_of("\r\n"));
    if (!text.empty() && text.back() == '\\' && text.size() < line.size() && !ends_in_comment(text)) {
      whole.append(text.substr(0, text.size() - 1)).append(" ");
      ++owed;
    } else {
      whole.append(line).append(owed, '\n');
      owed = 0;
    }
  }
  return whole;
}

struct ObjBuilder {
  TextLines &lines;
  Mesh mesh;
  uint64_t largest = 0;  // largest vertex number used (from 1), and the line that used it
  std::size_t largest_line = 0;
  std::vector<std::string> object{}, groups{};  // that the next faces belong to

  void add_vertex() {
    const std::string name = "vertex " + std::to_string(mesh.n_vertices() + 1);
    mesh.add_vertex(lines.point(name));
    lines.pass_numbers(5, name);  // a weight, and a colour as some programs write it
  }

  // A corner's numbers are of a vertex, its texture coordinates and its normal; only the first is needed.
  int64_t vertex_number(std::string_view word) {
    int64_t first = 0;
    std::string_view rest = word;
    for (int k = 0; k < 3; ++k) {
      const std::string_view part = rest.substr(0, rest.find('/'));
      int64_t number = 0;
      if (!parse_whole(part, number) && !(k > 0 && part.empty())) break;
      if (k == 0) first = number;
      if (part.size() == rest.size()) return first;
      rest.remove_prefix(part.size() + 1);
    }
    lines.fail("a corner of a face must be a whole number, or up to three with '/' between; " + found(word));
  }

  // Numbers count from 1, and backwards from the vertices read so far where negative.
  uint32_t corner() {
    const int64_t number = vertex_number(lines.word());
    if (number == 0) lines.fail("vertex numbers start at 1 (or at -1, counting backwards); found 0");
    const int64_t resolved = number > 0 ? number : int64_t{mesh.n_vertices()} + number + 1;
    if (resolved < 1)
      lines.fail("face names vertex " + std::to_string(number) + ", but only " + std::to_string(mesh.n_vertices()) +
                 " vertices stand before it");
    if (static_cast<uint64_t>(resolved) > largest) {
      largest = static_cast<uint64_t>(resolved);
      largest_line = lines.line();
    }
    return static_cast<uint32_t>(resolved - 1);
  }

  void add_face() {
    std::vector<uint32_t> corners;
    while (lines.has_word()) corners.push_back(corner());
    if (corners.size() < 3) lines.fail("a face needs at least three corners; found " + std::to_string(corners.size()));
    mesh.add_polygon(corners);
    for (const std::vector<std::string> *names : {&object, &groups})
      for (const std::string &name : *names) mesh.groups[name].insert(corners.begin(), corners.end());
  }

  std::vector<std::string> names() {
    std::vector<std::string> all;
    while (lines.has_word()) all.emplace_back(lines.word());
    return all;
  }
};

// "7/1/3" as "7/1", "7//3" as "7".
std::string without_normal(std::string_view corner) {
  const std::size_t first = corner.find('/'), second = first == corner.npos ? first : corner.find('/', first + 1);
  std::string kept(corner.substr(0, second));
  while (!kept.empty() && kept.back() == '/') kept.pop_back();
  return kept;
}

}  // namespace

std::string obj_with_positions(const std::string &raw_contents, const std::vector<float> &positions) {
  const std::string contents = with_whole_statements(raw_contents), path;
  TextLines lines(path, contents);
  std::string out;
  std::size_t vertex = 0;
  while (lines.next_line()) {
    const std::string_view statement = lines.word();
    if (statement == "vn") continue;
    out.append(statement);
    if (statement == "v") {
      char numbers[64];
      const float *x = &positions.at(3 * vertex++);
      std::snprintf(numbers, sizeof numbers, " %.9g %.9g %.9g", x[0], x[1], x[2]);
      out.append(numbers);
    } else {
      while (lines.has_word()) {
        const std::string_view word = lines.word();
        out.append(" ").append(statement == "f" ? without_normal(word) : std::string(word));
      }
    }
    out.append("\n");
  }
  return out;
}

Mesh read_obj(const std::string &path, const std::string &raw_contents) {
  const std::string contents = with_whole_statements(raw_contents);
  TextLines lines(path, contents);
  ObjBuilder obj{lines, {}};
  while (lines.next_line()) {
    const std::string_view statement = lines.word();
    if (statement == "v") obj.add_vertex();
    if (statement == "f") obj.add_face();
    if (statement == "g") obj.groups = obj.names();
    if (statement == "o") obj.object = obj.names();
  }
  if (obj.largest > obj.mesh.n_vertices())
    throw FileError(path, obj.largest_line,
                    "face names vertex " + std::to_string(obj.largest) + ", but the file holds only " +
                        std::to_string(obj.mesh.n_vertices()) + " vertices");
  obj.mesh.cut_polygons();
  return std::move(obj.mesh);
}

}  // namespace cli

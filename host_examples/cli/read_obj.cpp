// OBJ: "v x y z", "vt u v", "f" with corners as 7, 7/1, 7/1/3 or 7//3, numbered from 1 or backwards as -1, and the names of "g" and
// "o"; every other statement is passed over.
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
  bool uvs_whole = true;                        // every corner so far has texture coordinates

  void add_vertex() {
    const std::string name = "vertex " + std::to_string(mesh.n_vertices() + 1);
    mesh.add_vertex(lines.point(name));
    lines.pass_numbers(5, name);  // a weight, and a colour as some programs write it
  }

  // A corner's numbers are of a vertex, its texture coordinates and its normal; the first two are needed.
  std::array<int64_t, 3> corner_numbers(std::string_view word) {
    std::array<int64_t, 3> numbers{};
    std::string_view rest = word;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string_view part = rest.substr(0, rest.find('/'));
      if (!parse_whole(part, numbers[k]) && !(k > 0 && part.empty())) break;
      if (part.size() == rest.size()) return numbers;
      rest.remove_prefix(part.size() + 1);
    }
    lines.fail("a corner of a face must be a whole number, or up to three with '/' between; " + found(word));
  }

  // Numbers count from 1, and backwards from the vertices read so far where negative.
  uint32_t corner() {
    const std::array<int64_t, 3> numbers = corner_numbers(lines.word());
    const int64_t number = numbers[0];
    add_uv(numbers[1]);
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

  // What is drawn with a wrong texture coordinate is drawn without any: no shell needs them.
  void add_uv(int64_t number) {
    const int64_t resolved = number < 0 ? static_cast<int64_t>(mesh.uvs.size() / 2) + number + 1 : number;
    uvs_whole &= resolved > 0 && resolved <= UINT32_MAX;
    if (uvs_whole) mesh.corner_uvs.push_back(static_cast<uint32_t>(resolved - 1));
  }

  void add_texture_coordinates() {
    for (int k = 0; k < 2; ++k) {
      double value = 0;
      uvs_whole &= parse_number(lines.word(), value);
      mesh.uvs.push_back(static_cast<float>(value));
    }
  }

  void leave_broken_uvs() {
    const std::size_t n = mesh.uvs.size() / 2;
    for (const uint32_t uv : mesh.corner_uvs) uvs_whole &= uv < n;
    if (uvs_whole) return;
    mesh.uvs.clear();
    mesh.corner_uvs.clear();
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
    if (statement == "vt") obj.add_texture_coordinates();
    if (statement == "f") obj.add_face();
    if (statement == "g") obj.groups = obj.names();
    if (statement == "o") obj.object = obj.names();
  }
  if (obj.largest > obj.mesh.n_vertices())
    throw FileError(path, obj.largest_line,
                    "face names vertex " + std::to_string(obj.largest) + ", but the file holds only " +
                        std::to_string(obj.mesh.n_vertices()) + " vertices");
  obj.leave_broken_uvs();
  obj.mesh.cut_polygons();
  return std::move(obj.mesh);
}

}  // namespace cli

// OBJ by tinyobjloader's callbacks: it knows the many forms of a face line, this file keeps vertex order and strictness.
// The loader reads a malformed coordinate as 0, so coordinates are read again from the line itself; and its integers
// overflow silently, so numbers that are too long for them are refused before it sees any.
#include "mesh.hpp"
#include "text_lines.hpp"

#include <istream>
#include <streambuf>

#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#include "tiny_obj_loader.h"

namespace cli {

namespace {

// Hands out one line at a time, so that a callback knows on which line it is.
class LineBuffer : public std::streambuf {
public:
  explicit LineBuffer(const std::string &contents) : rest_(contents) {}

  std::size_t line() const { return line_; }
  std::string_view text() const { return text_; }

protected:
  int_type underflow() override {
    if (rest_.empty()) return traits_type::eof();
    text_ = rest_.substr(0, line_length(rest_));
    rest_.remove_prefix(text_.size());
    ++line_;
    char *begin = const_cast<char *>(text_.data());  // a get area is never written to
    setg(begin, begin, begin + text_.size());
    return traits_type::to_int_type(*begin);
  }

private:
  std::string_view rest_, text_;
  std::size_t line_ = 0;
};

struct ObjBuilder {
  const std::string &path;
  LineBuffer &lines;
  Mesh mesh;
  uint64_t largest = 0;  // largest vertex number used (from 1), and the line that used it
  std::size_t largest_line = 0;

  [[noreturn]] void fail(const std::string &what) const { throw FileError(path, lines.line(), what); }

  void add_vertex() {
    const std::string line(lines.text());
    TextLines words(path, line, 0, lines.line());
    words.next_line();
    words.word();  // "v"
    mesh.add_vertex(words.point("vertex " + std::to_string(mesh.n_vertices() + 1)));
  }

  // OBJ counts from 1, and backwards from the vertices read so far where negative.
  uint32_t corner(int index) {
    if (index == 0)
      fail("vertex numbers start at 1 (or at -1, counting backwards); found 0 or a word that is no number");
    const int64_t resolved = index > 0 ? index : int64_t{mesh.n_vertices()} + index + 1;
    if (resolved < 1)
      fail("face names vertex " + std::to_string(index) + ", but only " + std::to_string(mesh.n_vertices()) +
           " vertices stand before it");
    if (static_cast<uint64_t>(resolved) > largest) {
      largest = static_cast<uint64_t>(resolved);
      largest_line = lines.line();
    }
    return static_cast<uint32_t>(resolved - 1);
  }

  void add_face(const tinyobj::index_t *indices, int count) {
    if (count < 3) fail("a face needs at least three corners; found " + std::to_string(count));
    std::vector<uint32_t> corners;
    for (int k = 0; k < count; ++k) corners.push_back(corner(indices[k].vertex_index));
    mesh.add_polygon(corners);
  }
};

// Indices and exponents of more than nine digits do not fit the loader's integers; digits of a mantissa may be as many as
// there are.
bool has_overlong_number(std::string_view line) {
  const bool face = line[0] == 'f';
  std::size_t digits = 0;
  bool exponent = false;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const bool digit = line[k] >= '0' && line[k] <= '9';
    if (!digit && line[k] != '+' && line[k] != '-') exponent = line[k] == 'e' || line[k] == 'E';
    digits = digit ? digits + 1 : 0;
    if (digits > 9 && (face || exponent)) return true;
  }
  return false;
}

void refuse_overlong_numbers(const std::string &path, const std::string &contents) {
  TextLines lines(path, contents);
  while (lines.next_line()) {
    const std::string_view line = lines.rest();
    if ((line[0] == 'f' || line[0] == 'v') && has_overlong_number(line))
      lines.fail("an index or exponent has more than 9 digits; is the file damaged?");
  }
}

// A lone "\r" made "\n": the loader looks past a "\r" for its "\n", and LineBuffer would be a line ahead of it.
std::string with_plain_line_ends(std::string contents) {
  for (std::size_t k = 0; k < contents.size(); ++k)
    if (contents[k] == '\r' && (k + 1 == contents.size() || contents[k + 1] != '\n')) contents[k] = '\n';
  return contents;
}

ObjBuilder &builder(void *user) { return *static_cast<ObjBuilder *>(user); }

tinyobj::callback_t callbacks() {
  tinyobj::callback_t callback;
  callback.vertex_cb = [](void *user, double, double, double, double) { builder(user).add_vertex(); };
  callback.index_cb = [](void *user, tinyobj::index_t *indices, int count) { builder(user).add_face(indices, count); };
  return callback;
}

}  // namespace

Mesh read_obj(const std::string &path, const std::string &raw_contents) {
  const std::string contents = with_plain_line_ends(raw_contents);
  refuse_overlong_numbers(path, contents);
  LineBuffer lines(contents);
  std::istream stream(&lines);
  ObjBuilder obj{path, lines, {}, 0, 0};
  std::string warning, error;
  if (!tinyobj::LoadObjWithCallback(stream, callbacks(), &obj, nullptr, &warning, &error))
    throw FileError(path, 0, error);
  if (obj.largest > obj.mesh.n_vertices())
    throw FileError(path, obj.largest_line,
                    "face names vertex " + std::to_string(obj.largest) + ", but the file holds only " +
                        std::to_string(obj.mesh.n_vertices()) + " vertices");
  return std::move(obj.mesh);
}

}  // namespace cli

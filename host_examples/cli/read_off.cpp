// OFF: the word OFF (or COFF, NOFF, CNOFF), three counts, a line for each vertex and each face, indices from 0.
// What follows the coordinates of a vertex or the corners of a face on its line is passed over: at most eight numbers, a normal,
// a colour, texture coordinates.
#include "mesh.hpp"
#include "text_lines.hpp"

namespace cli {

namespace {

constexpr std::size_t kBeside = 8;

void next_line_for(TextLines &lines, const std::string &what) {
  if (!lines.next_line()) lines.fail("the file ends before " + what + "; is it cut off?");
}

void read_header_word(TextLines &lines) {
  next_line_for(lines, "its first word");
  const std::string_view kind = lines.word();
  if (kind != "OFF" && kind != "COFF" && kind != "NOFF" && kind != "CNOFF")
    lines.fail("an OFF file begins with the word OFF (COFF, NOFF, CNOFF)");
}

std::vector<uint32_t> read_corners(TextLines &lines, uint64_t face, uint64_t n_vertices) {
  const std::string name = "face " + std::to_string(face);
  const uint64_t count = lines.index("the corner count of " + name);
  if (count < 3) lines.fail(name + " has " + std::to_string(count) + " corners; at least three are needed");
  std::vector<uint32_t> corners;
  for (uint64_t k = 0; k < count; ++k) {  // a wild count ends at the end of the line
    const uint64_t vertex = lines.index("corner " + std::to_string(k) + " of " + name);
    if (vertex >= n_vertices)
      lines.fail(name + " names vertex " + std::to_string(vertex) + ", but there are only " +
                 std::to_string(n_vertices) + " (numbered from 0)");
    corners.push_back(static_cast<uint32_t>(vertex));
  }
  return corners;
}

}  // namespace

Mesh read_off(const std::string &path, const std::string &contents) {
  TextLines lines(path, contents);
  read_header_word(lines);
  if (!lines.has_word()) next_line_for(lines, "the counts of vertices, faces and edges");
  const uint64_t n_vertices = lines.index("the number of vertices");
  const uint64_t n_faces = lines.index("the number of faces");

  Mesh mesh;
  for (uint64_t i = 0; i < n_vertices; ++i) {
    next_line_for(lines, "vertex " + std::to_string(i) + " of " + std::to_string(n_vertices));
    const std::string name = "vertex " + std::to_string(i);
    mesh.add_vertex(lines.point(name));
    lines.pass_numbers(kBeside, name);
  }
  for (uint64_t i = 0; i < n_faces; ++i) {
    next_line_for(lines, "face " + std::to_string(i) + " of " + std::to_string(n_faces));
    mesh.add_polygon(read_corners(lines, i, n_vertices));
    lines.pass_numbers(kBeside, "face " + std::to_string(i));
  }
  mesh.cut_polygons();
  if (lines.next_line()) lines.fail("the file goes on after its " + std::to_string(n_faces) + " faces");
  return mesh;
}

}  // namespace cli

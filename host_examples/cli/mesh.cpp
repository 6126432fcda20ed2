#include "mesh.hpp"

#include "text_lines.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace cli {

namespace {

std::string extension(const std::string &path) {
  const std::size_t dot = path.find_last_of("./\\");
  std::string ending = dot == std::string::npos || path[dot] != '.' ? "" : path.substr(dot + 1);
  for (char &c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

Mesh parse(const std::string &path, const std::string &contents) {
  const std::string ending = extension(path);
  if (ending == "obj") return read_obj(path, contents);
  if (ending == "off") return read_off(path, contents);
  if (ending == "ply") return read_ply(path, contents);
  throw FileError(path, 0, "cannot tell the format from the name; end it in .obj, .off or .ply");
}

}  // namespace

void Mesh::add_vertex(const std::array<double, 3> &x) {
  if (n_vertices() == UINT32_MAX) throw std::length_error("more than 4294967295 vertices");
  positions.insert(positions.end(), x.begin(), x.end());
}

void Mesh::add_polygon(const std::vector<uint32_t> &corners) {
  if (triangles.size() / 3 + corners.size() > UINT32_MAX) throw std::length_error("more than 4294967295 triangles");
  for (std::size_t k = 2; k < corners.size(); ++k)
    triangles.insert(triangles.end(), {corners[0], corners[k - 1], corners[k]});
}

Bounds bounds(const Mesh &mesh) {
  Bounds box{mesh.vertex(0), mesh.vertex(0)};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    box.low[i % 3] = std::min(box.low[i % 3], mesh.positions[i]);
    box.high[i % 3] = std::max(box.high[i % 3], mesh.positions[i]);
  }
  return box;
}

Mesh read_mesh(const std::string &path) {
  Mesh mesh;
  try {
    mesh = parse(path, read_file(path));
  } catch (const std::length_error &) {
    throw FileError(path, 0, "more than 2^32 - 1 vertices or triangles; split the mesh");
  }
  if (mesh.positions.empty()) throw FileError(path, 0, "holds no vertices; is it really a mesh of this format?");
  if (mesh.triangles.empty()) throw FileError(path, 0, "holds no faces; a shell needs triangles or polygons");
  return mesh;
}

}  // namespace cli

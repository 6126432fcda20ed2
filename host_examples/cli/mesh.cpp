#include "mesh.hpp"

#include "output_file.hpp"
#include "polygon.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <cstdio>
#include <cctype>
#include <cmath>
#include <limits>
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

template <class Real>
void write_positions(OutputFolder &folder, const std::string &name, const std::vector<Real> &positions,
                     const Mesh &mesh) {
  OutputFile file(folder, name);
  for (std::size_t i = 0; i < positions.size(); i += 3)  // nine digits bring a float back exactly
    file.print("v %.9g %.9g %.9g\n", double{positions[i]}, double{positions[i + 1]}, double{positions[i + 2]});
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3)
    file.print("f %u %u %u\n", mesh.triangles[k] + 1, mesh.triangles[k + 1] + 1, mesh.triangles[k + 2] + 1);
  file.close();
}

}  // namespace

void Mesh::add_vertex(const std::array<double, 3> &x) {
  if (n_vertices() == UINT32_MAX) throw std::length_error("more than 4294967295 vertices");
  positions.insert(positions.end(), x.begin(), x.end());
}

void Mesh::add_polygon(const std::vector<uint32_t> &corners) {
  if (triangles.size() / 3 + corners.size() > UINT32_MAX) throw std::length_error("more than 4294967295 triangles");
  if (corners.size() > 3) polygons.push_back({triangles.size(), corners});
  for (std::size_t k = 2; k < corners.size(); ++k)
    triangles.insert(triangles.end(), {corners[0], corners[k - 1], corners[k]});
}

void Mesh::cut_polygons() {
  for (const Polygon &polygon : polygons) {
    const std::vector<uint32_t> cut = host::cut_polygon(polygon.corners, positions.data());
    std::copy(cut.begin(), cut.end(), triangles.begin() + static_cast<std::ptrdiff_t>(polygon.first));
  }
}

std::vector<double> Mesh::carried(const std::vector<double> &values, std::size_t columns) const {
  std::vector<double> here(columns * n_vertices());
  for (std::size_t v = of_file.size(); !proxy && v-- > 0;)
    for (std::size_t c = 0; c < columns; ++c) here[columns * of_file[v] + c] = values[columns * v + c];
  if (!proxy) return here;
  for (std::size_t v = 0; v < n_vertices(); ++v)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < columns; ++c)
        here[columns * v + c] += proxy->weights[3 * v + k] * values[columns * proxy->sources[3 * v + k] + c];
  return here;
}

std::vector<double> Mesh::carried_by_triangles(const std::vector<double> &values, std::size_t columns) const {
  std::vector<double> here;
  for (const uint32_t triangle : file_triangles) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(columns * triangle);
    here.insert(here.end(), first, first + static_cast<std::ptrdiff_t>(columns));
  }
  return here;
}

uint32_t Mesh::of(uint32_t file_vertex) const {
  return file_vertex < of_file.size() ? of_file[file_vertex] : file_vertex;
}

Bounds bounds(const Mesh &mesh) {
  Bounds box{mesh.vertex(0), mesh.vertex(0)};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    box.low[i % 3] = std::min(box.low[i % 3], mesh.positions[i]);
    box.high[i % 3] = std::max(box.high[i % 3], mesh.positions[i]);
  }
  return box;
}

double longest_side(const Mesh &mesh) {
  const Bounds box = bounds(mesh);
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, box.high[k] - box.low[k]);
  return longest;
}

void print_doubt_of_unit(const std::string &path, const Mesh &mesh) {
  if (const double longest = longest_side(mesh); longest > kLongestInMetres)
    std::printf("%s: %.4g across: lengths are metres, so --scale 0.01 (scale) if these are centimetres, --scale 0.001 if millimetres\n", path.c_str(), longest);
  else if (longest > 0 && longest < kShortestInMetres)
    std::printf("%s: %.4g across: that is %.2g mm, as lengths are metres; a larger --scale (scale) if it is not so small\n", path.c_str(), longest, 1000 * longest);
}

uint32_t nearest_vertex(const std::array<double, 3> &point, const Mesh &mesh) {
  uint32_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < mesh.n_vertices(); ++i) {
    const std::array<double, 3> x = mesh.vertex(i);
    const double distance = std::hypot(x[0] - point[0], x[1] - point[1], x[2] - point[2]);
    if (distance < least) {
      least = distance;
      nearest = i;
    }
  }
  return nearest;
}

double triangle_area(const std::vector<double> &positions, const uint32_t *corners) {
  const double *a = &positions[3 * std::size_t{corners[0]}];
  const double *b = &positions[3 * std::size_t{corners[1]}];
  const double *c = &positions[3 * std::size_t{corners[2]}];
  const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

double surface_area(const std::vector<double> &positions, const std::vector<uint32_t> &triangles) {
  double area = 0;
  for (std::size_t k = 0; k < triangles.size(); k += 3) area += triangle_area(positions, &triangles[k]);
  return area;
}

void write_obj(OutputFolder &folder, const std::string &name, const std::vector<float> &positions, const Mesh &mesh) {
  write_positions(folder, name, positions, mesh);
}

void write_obj(OutputFolder &folder, const std::string &name, const std::vector<double> &positions, const Mesh &mesh) {
  write_positions(folder, name, positions, mesh);
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

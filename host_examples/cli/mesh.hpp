// A triangle mesh as it came from a file: vertices keep the file's order, polygons are cut as polygon.hpp has it.
#pragma once

#include "shellwarp.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace shellwarp {
class Proxy;
}

namespace cli {

class OutputFolder;

// Where the vertices of a proxy lie on the file's mesh.
struct ProxySource {
  std::vector<uint32_t> sources;  // three vertices of the file for each
  std::vector<double> weights;   // and theirs
  std::vector<double> file_positions;
  SwProxyInfo info;
  std::shared_ptr<const shellwarp::Proxy> made{};
  bool calibrates = true;            // models of it
  std::vector<uint32_t> clamped{};   // by the paper's constants: of the proxy, what stands for the file's clamped vertices and their neighbours, which is what holds the file
  mutable std::string calibrated{};  // what came of the last one's
  mutable std::optional<double> difference{};  // left by it, a share: under gravity, at rest, to first order
};

struct Mesh {
  std::vector<double> positions;    // n_vertices() x 3
  std::vector<uint32_t> triangles;  // n_triangles() x 3
  std::map<std::string, std::set<uint32_t>> groups{};  // vertices of the faces below an OBJ file's "g NAME" or "o NAME"

  struct Polygon {
    std::size_t first;  // of its triangles' corners
    std::vector<uint32_t> corners;
  };
  std::vector<Polygon> polygons{};  // of more than three corners
  std::vector<float> uvs{};              // texture coordinates of an OBJ file, two each
  std::vector<uint32_t> corner_uvs{};    // which of them, of each corner of each face; empty where one has none
  std::vector<uint32_t> of_file{};  // of welded vertices and of a proxy, the number here of each in the file; else empty
  std::vector<uint32_t> file_triangles{};  // of these, the triangle of the file that each stands for: of a proxy the one whose middle is nearest
  uint32_t n_file_triangles = 0;            // and how many the file has
  std::shared_ptr<const ProxySource> proxy{};

  // Of the file, other than here where vertices were welded or a proxy stands for them.
  uint32_t vertices_of_file() const { return of_file.empty() ? n_vertices() : static_cast<uint32_t>(of_file.size()); }
  uint32_t triangles_of_file() const { return of_file.empty() ? n_triangles() : n_file_triangles; }

  uint32_t n_vertices() const { return static_cast<uint32_t>(positions.size() / 3); }
  uint32_t n_triangles() const { return static_cast<uint32_t>(triangles.size() / 3); }
  std::array<double, 3> vertex(uint32_t i) const {
    return {positions[3 * std::size_t{i}], positions[3 * std::size_t{i} + 1], positions[3 * std::size_t{i} + 2]};
  }

  // Throws std::length_error at the 2^32nd vertex: the library counts them in 32 bits.
  void add_vertex(const std::array<double, 3> &x);
  // The triangles of a polygon with at least three corners: in its place now, cut by cut_polygons.
  void add_polygon(const std::vector<uint32_t> &corners);
  // Once all vertices are there.
  void cut_polygons();
  // Values at the file's vertices, `columns` each, at those of the proxy; of welded vertices the first one's.
  std::vector<double> carried(const std::vector<double> &values, std::size_t columns = 1) const;
  // Values of the file's triangles, `columns` each, at those here.
  std::vector<double> carried_by_triangles(const std::vector<double> &values, std::size_t columns = 1) const;
  // The number here of a vertex of the file; of one that is not there, the same.
  uint32_t of(uint32_t file_vertex) const;
};

// The corners of a box that holds every vertex.
struct Bounds {
  std::array<double, 3> low, high;
};
Bounds bounds(const Mesh &mesh);

// Of that box. A mesh that is longer is taken for one in centimetres.
double longest_side(const Mesh &mesh);
constexpr double kLongestInMetres = 10, kShortestInMetres = 0.01;
// Says so, and what to do.
void print_doubt_of_unit(const std::string &path, const Mesh &mesh);

// An end of the mesh along an axis.
struct Side {
  uint32_t axis = 0;
  bool high = false;
};

// The vertex next to a point; the first of several.
uint32_t nearest_vertex(const std::array<double, 3> &point, const Mesh &mesh);

// Of one triangle, and of all, with the vertices at `positions` (n_vertices x 3).
double triangle_area(const std::vector<double> &positions, const uint32_t *corners);
double surface_area(const std::vector<double> &positions, const std::vector<uint32_t> &triangles);

// Positions are n_vertices x 3.
void write_obj(OutputFolder &folder, const std::string &name, const std::vector<float> &positions, const Mesh &mesh);
void write_obj(OutputFolder &folder, const std::string &name, const std::vector<double> &positions, const Mesh &mesh);

// An OBJ file's contents with other positions (n_vertices x 3), and without normals, which would be the old shape's.
std::string obj_with_positions(const std::string &contents, const std::vector<float> &positions);

// Reads an OBJ, OFF or PLY file, told apart by its extension. Throws FileError (see text_lines.hpp) for anything that is not
// a whole, well-formed mesh with at least one triangle; a file is never read past its end, whatever it claims to hold.
Mesh read_mesh(const std::string &path);

// The three readers, on a file's whole contents; `path` is for messages only.
Mesh read_obj(const std::string &path, const std::string &contents);
Mesh read_off(const std::string &path, const std::string &contents);
Mesh read_ply(const std::string &path, const std::string &contents);

}  // namespace cli

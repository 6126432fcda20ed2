#include "creases.hpp"

#include "section.hpp"
#include "shell.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

namespace cli {

namespace {

using Edge = std::array<uint32_t, 2>;

constexpr double kHalfTurn = 3.141592653589793;
constexpr double kRadians = kHalfTurn / 180;

Edge ordered(uint32_t a, uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

std::vector<Edge> read_edges(Section &section) {
  const toml::node *node = section.find("edges");
  const toml::array *list = node ? node->as_array() : nullptr;
  std::vector<Edge> edges;
  for (std::size_t i = 0; list && i < list->size(); ++i) {
    const toml::array *pair = (*list)[i].as_array();
    const bool two = pair && pair->size() == 2;
    const auto a = two ? (*pair)[0].value<uint32_t>() : std::nullopt, b = two ? (*pair)[1].value<uint32_t>() : std::nullopt;
    if (!a || !b) section.fail((*list)[i], "edge " + std::to_string(i) + " of edges must be two vertices, counted from 0");
    edges.push_back({*a, *b});
  }
  if (node && edges.empty()) section.fail(*node, "edges must be a list of pairs of vertices, such as [[3, 4], [4, 5]]");
  return edges;
}

// Two vertices a line.
std::vector<Edge> read_edge_list(const std::string &path) {
  const std::string contents = read_file(path);
  TextLines lines(path, contents);
  std::vector<Edge> edges;
  while (lines.next_line()) {
    Edge edge{};
    for (uint32_t &end : edge) {
      const uint64_t index = lines.index("a vertex of edge " + std::to_string(edges.size()));
      if (index > UINT32_MAX) lines.fail("vertex index " + std::to_string(index) + " is too large");
      end = static_cast<uint32_t>(index);
    }
    if (lines.has_word()) lines.fail("an edge has two vertices, one edge a line; found more");
    edges.push_back(edge);
  }
  if (edges.empty()) throw FileError(path, 0, "names no edge");
  return edges;
}

MaterialCrease read_crease(Section section, std::vector<std::string> &inputs) {
  MaterialCrease crease;
  crease.place = section.place();
  if (const std::vector<double> b = section.numbers("box", 6); !b.empty()) crease.box = Bounds{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
  crease.edges = read_edges(section);
  if (const auto file = section.file("list")) {
    inputs.push_back(*file);
    const std::vector<Edge> more = read_edge_list(*file);
    crease.edges.insert(crease.edges.end(), more.begin(), more.end());
  }
  if (!crease.box && crease.edges.empty()) section.fail("name the edges by box, edges or list");
  crease.factor = section.not_negative("factor", 1);
  if (const auto degrees = section.number("angle_degrees")) {
    if (*degrees < -180 || *degrees > 180)
      section.fail(*section.find("angle_degrees"), "angle_degrees is " + std::to_string(*degrees) + "; it must be from -180 to 180");
    crease.angle = *degrees * kRadians;
  }
  if (const auto degrees = section.number("yield_degrees")) {
    if (!(*degrees > 0)) section.fail(*section.find("yield_degrees"), "yield_degrees is " + std::to_string(*degrees) + "; it must be above 0");
    crease.yield = *degrees * kRadians;
  }
  section.reject_unknown_keys();
  if (crease.factor == 1 && !crease.angle && !crease.yield) section.fail("give a factor other than 1, angle_degrees or yield_degrees");
  return crease;
}

// Edges of a mesh, and how many triangles each has.
std::map<Edge, uint32_t> edges_of(const Mesh &mesh) {
  std::map<Edge, uint32_t> count;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3)
    for (std::size_t c = 0; c < 3; ++c) ++count[ordered(mesh.triangles[k + c], mesh.triangles[k + (c + 1) % 3])];
  return count;
}

// The named edge, if there is one that can fold.
Edge checked(const std::string &place, const Edge &named, const std::map<Edge, uint32_t> &edges, const Mesh &mesh) {
  const std::string name = place + " edge " + std::to_string(named[0]) + "-" + std::to_string(named[1]);
  const uint32_t n = mesh.vertices_of_file();
  if (named[0] >= n || named[1] >= n) throw std::runtime_error(name + ": the mesh has " + std::to_string(n) + " vertices");
  const auto found = edges.find(ordered(mesh.of(named[0]), mesh.of(named[1])));
  if (found == edges.end()) throw std::runtime_error(name + " is none of the mesh: no triangle has both vertices");
  if (found->second < 2) throw std::runtime_error(name + " has only one triangle: nothing folds there");
  return found->first;
}

std::vector<Edge> edges_at(const MaterialCrease &crease, const std::map<Edge, uint32_t> &edges, const Mesh &mesh) {
  std::vector<Edge> found;
  for (const Edge &named : crease.edges) found.push_back(checked(crease.place, named, edges, mesh));
  if (!crease.box) return found;
  const std::size_t named = found.size();
  Support where;
  where.box = crease.box;
  const std::vector<uint32_t> list = find_vertices(where, mesh, crease.place);
  const std::set<uint32_t> inside(list.begin(), list.end());
  for (const auto &[edge, triangles] : edges)
    if (triangles >= 2 && inside.count(edge[0]) && inside.count(edge[1])) found.push_back(edge);
  if (found.size() == named)
    throw std::runtime_error(crease.place + " the box holds " + std::to_string(inside.size()) + " vertices, but no edge between two triangles");
  return found;
}

}  // namespace

void read_creases(Section &section, Material &material, std::vector<std::string> &inputs) {
  for (Section &crease : section.sections("crease")) material.creases.push_back(read_crease(std::move(crease), inputs));
  if (const auto path = section.file("rest_shape")) {
    material.rest_shape = *path;
    inputs.push_back(*path);
  }
}

CreaseLists find_creases(const Material &material, const Mesh &mesh) {
  CreaseLists lists;
  if (material.creases.empty()) return lists;
  const std::map<Edge, uint32_t> edges = edges_of(mesh);
  std::map<Edge, const MaterialCrease *> last;
  for (const MaterialCrease &crease : material.creases)
    for (const Edge &edge : edges_at(crease, edges, mesh)) last[edge] = &crease;
  for (const auto &[edge, crease] : last) {
    lists.edges.push_back(edge);
    lists.factors.push_back(crease->factor);
    lists.angles.push_back(crease->angle.value_or(SW_CREASE_ANGLE_OF_MESH));
    lists.yields.push_back(crease->yield.value_or(std::numeric_limits<double>::infinity()));
  }
  return lists;
}

std::vector<double> rest_positions(const Scene &scene, const Mesh &mesh) {
  const std::string &path = scene.material.rest_shape;
  if (path.empty()) return {};
  Mesh shape = read_mesh(path);
  const uint32_t n = mesh.vertices_of_file();
  if (shape.n_vertices() != n)
    throw std::runtime_error(path + ": rest_shape has " + std::to_string(shape.n_vertices()) + " vertices; the mesh has " + std::to_string(n));
  for (double &x : shape.positions) x *= scene.scale;
  if (mesh.of_file.empty()) return shape.positions;
  if (mesh.proxy) {  // as far from the proxy as the file's rest shape is from the file's mesh
    for (std::size_t k = 0; k < shape.positions.size(); ++k) shape.positions[k] -= mesh.proxy->file_positions[k];
    std::vector<double> positions = mesh.carried(shape.positions, 3);
    for (std::size_t k = 0; k < positions.size(); ++k) positions[k] += mesh.positions[k];
    return positions;
  }
  return mesh.carried(shape.positions, 3);
}

}  // namespace cli

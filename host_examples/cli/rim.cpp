#include "rim.hpp"

#include "judge.hpp"
#include "scene.hpp"
#include "selection.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

using Edge = std::pair<uint32_t, uint32_t>;

std::map<Edge, uint32_t> triangles_of_edges(const Mesh &mesh) {
  std::map<Edge, uint32_t> counts;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k) ++counts[std::minmax(mesh.triangles[t + k], mesh.triangles[t + (k + 1) % 3])];
  return counts;
}

uint32_t root_of(std::vector<uint32_t> &parent, uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

std::vector<uint32_t> rim_at(const Side &side, const Mesh &mesh) {
  std::vector<uint32_t> parent(mesh.n_vertices());
  std::iota(parent.begin(), parent.end(), 0u);
  std::vector<uint32_t> open;
  for (const auto &[edge, count] : triangles_of_edges(mesh)) {
    if (count != 1) continue;
    open.insert(open.end(), {edge.first, edge.second});
    parent[root_of(parent, edge.first)] = root_of(parent, edge.second);
  }
  if (open.empty()) throw std::runtime_error("the mesh has no open edge, as a rim is");
  const auto nearer = [&](uint32_t a, uint32_t b) { return side.high ? mesh.vertex(a)[side.axis] < mesh.vertex(b)[side.axis] : mesh.vertex(a)[side.axis] > mesh.vertex(b)[side.axis]; };
  const uint32_t rim = root_of(parent, *std::max_element(open.begin(), open.end(), nearer));
  open.erase(std::remove_if(open.begin(), open.end(), [&](uint32_t v) { return root_of(parent, v) != rim; }), open.end());
  std::sort(open.begin(), open.end());
  open.erase(std::unique(open.begin(), open.end()), open.end());
  return open;
}

std::vector<std::string> notes_of_rims(const Scene &scene, const Mesh &mesh) {
  constexpr double kAlong = 0.25, kMostOf = 0.9;  // of the mesh's extent, so that the outline of a sheet is none; of the rim's vertices
  std::vector<std::string> notes;
  const Bounds box = bounds(mesh);
  for (const Support &support : scene.supports) {
    if (!support.side || support.rim || mesh.proxy) continue;
    const std::vector<uint32_t> held = vertices_at(*support.side, mesh);
    std::vector<uint32_t> rim;
    try {
      rim = rim_at(*support.side, mesh);
    } catch (const std::runtime_error &) {
      continue;
    }
    const uint32_t axis = support.side->axis;
    double low = box.high[axis], high = box.low[axis];
    for (const uint32_t v : rim) low = std::min(low, mesh.vertex(v)[axis]), high = std::max(high, mesh.vertex(v)[axis]);
    const auto n = static_cast<std::size_t>(std::count_if(rim.begin(), rim.end(), [&](uint32_t v) { return std::binary_search(held.begin(), held.end(), v); }));
    if (high - low > kAlong * (box.high[axis] - box.low[axis]) || static_cast<double>(n) >= kMostOf * static_cast<double>(rim.size())) continue;
    const std::string name = side_names()[axis + (support.side->high ? 3 : 0)];
    notes.push_back(format("note: %s holds %zu of the %zu vertices of the open edge there, which is not level: --pin rim:%s holds all", name.c_str(), n, rim.size(), name.c_str()));
  }
  return notes;
}

std::vector<double> faded_growth(const Mesh &mesh, const std::vector<uint32_t> &vertices, double factor) {
  constexpr uint32_t kRings = 6;
  std::vector<uint32_t> ring(mesh.n_vertices(), kRings);
  for (const uint32_t v : vertices) ring.at(v) = 0;
  for (uint32_t r = 0; r + 1 < kRings; ++r)
    for (const uint32_t *t = mesh.triangles.data(), *end = t + mesh.triangles.size(); t < end; t += 3)
      if (ring[t[0]] == r || ring[t[1]] == r || ring[t[2]] == r)
        for (std::size_t k = 0; k < 3; ++k) ring[t[k]] = std::min(ring[t[k]], r + 1);
  std::vector<double> growth;
  for (const uint32_t r : ring) growth.push_back(1 + (factor - 1) * (1 - static_cast<double>(r) / kRings));
  return growth;
}

}  // namespace cli

#include "weld.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <unordered_map>

namespace cli {

namespace {

using Cell = std::array<int64_t, 3>;

struct HashOfCell {
  std::size_t operator()(const Cell &cell) const {
    uint64_t hash = 0xcbf29ce484222325u;
    for (const int64_t c : cell) hash = (hash ^ static_cast<uint64_t>(c)) * 0x100000001b3u;
    return hash;
  }
};

// Cells as wide as the distance: what is within it is in the same cell or the next. Without a distance only the same numbers are together.
class Grid {
public:
  Grid(const Mesh &mesh, double distance) : mesh_(mesh), distance_(distance) {
    const Bounds box = bounds(mesh);
    low_ = box.low;
    double size = 0;
    for (std::size_t c = 0; c < 3; ++c) size = std::max(size, box.high[c] - box.low[c]);
    width_ = std::max(distance, size * 1e-9);
    if (distance < 0 || !(distance <= size)) throw std::runtime_error("weld: the distance must be from 0 to the mesh's size");
  }

  // The first vertex that `v` is together with, itself if none is.
  uint32_t together(uint32_t v) {
    const std::array<double, 3> x = mesh_.vertex(v);
    const Cell own = cell(x);
    for (int64_t i = -1; i <= 1; ++i)
      for (int64_t j = -1; j <= 1; ++j)
        for (int64_t k = -1; k <= 1; ++k) {
          const auto found = cells_.find({own[0] + i, own[1] + j, own[2] + k});
          if (found == cells_.end()) continue;
          for (const uint32_t w : found->second) {
            const std::array<double, 3> y = mesh_.vertex(w);
            if (std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]) <= distance_) return w;
          }
        }
    cells_[own].push_back(v);
    return v;
  }

private:
  Cell cell(const std::array<double, 3> &x) const {
    Cell cell{};
    for (std::size_t c = 0; c < 3; ++c) cell[c] = width_ > 0 ? static_cast<int64_t>(std::floor((x[c] - low_[c]) / width_)) : 0;
    return cell;
  }

  const Mesh &mesh_;
  double distance_, width_ = 0;
  std::array<double, 3> low_{};
  std::unordered_map<Cell, std::vector<uint32_t>, HashOfCell> cells_;
};

}  // namespace

Mesh weld(const Mesh &mesh, double distance) {
  Mesh welded;
  welded.of_file.resize(mesh.n_vertices());
  Grid grid(mesh, distance);
  for (uint32_t v = 0; v < mesh.n_vertices(); ++v) {
    const uint32_t w = grid.together(v);
    welded.of_file[v] = w == v ? welded.n_vertices() : welded.of_file[w];
    if (w == v) welded.add_vertex(mesh.vertex(v));
  }
  std::set<std::array<uint32_t, 3>> known;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    const std::array<uint32_t, 3> t = {welded.of_file[mesh.triangles[k]], welded.of_file[mesh.triangles[k + 1]],
                                       welded.of_file[mesh.triangles[k + 2]]};
    std::array<uint32_t, 3> sorted = t;
    std::sort(sorted.begin(), sorted.end());
    const bool flat = sorted[0] == sorted[1] || sorted[1] == sorted[2];
    if (flat || !known.insert(sorted).second) continue;
    welded.triangles.insert(welded.triangles.end(), t.begin(), t.end());
    welded.file_triangles.push_back(static_cast<uint32_t>(k / 3));
  }
  welded.n_file_triangles = mesh.n_triangles();
  if (welded.triangles.empty()) throw std::runtime_error("weld: no triangle is left at this distance");
  for (const auto &[name, vertices] : mesh.groups)
    for (const uint32_t v : vertices) welded.groups[name].insert(welded.of_file[v]);
  return welded;
}

}  // namespace cli

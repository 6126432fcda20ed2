#include "surface.hpp"

#include <cmath>

namespace cli {

Surface surface_of(const Mesh &mesh) {
  Surface surface;
  auto polygon = mesh.polygons.begin();  // they stand in the order of their triangles
  for (std::size_t k = 0; k < mesh.triangles.size();) {
    const bool cut = polygon != mesh.polygons.end() && polygon->first == k;
    const std::size_t count = cut ? polygon->corners.size() : 3;
    const uint32_t *corners = cut ? polygon->corners.data() : &mesh.triangles[k];
    surface.counts.push_back(static_cast<uint32_t>(count));
    surface.corners.insert(surface.corners.end(), corners, corners + count);
    surface.triangles.push_back(k / 3);
    k += 3 * (count - 2);
    if (cut) ++polygon;
  }
  surface.corner_uvs = mesh.corner_uvs;
  return surface;
}

std::vector<float> vertex_normals(const std::vector<float> &positions, const std::vector<uint32_t> &triangles) {
  std::vector<double> sums(positions.size());
  for (std::size_t k = 0; k < triangles.size(); k += 3) {
    const std::size_t at[3] = {3 * std::size_t{triangles[k]}, 3 * std::size_t{triangles[k + 1]}, 3 * std::size_t{triangles[k + 2]}};
    double u[3], v[3];
    for (std::size_t c = 0; c < 3; ++c) {
      u[c] = static_cast<double>(positions[at[1] + c]) - positions[at[0] + c];
      v[c] = static_cast<double>(positions[at[2] + c]) - positions[at[0] + c];
    }
    for (const std::size_t corner : at)
      for (std::size_t c = 0; c < 3; ++c)
        sums[corner + c] += u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3];
  }
  std::vector<float> normals(positions.size());
  for (std::size_t i = 0; i < sums.size(); i += 3) {
    const double length = std::hypot(sums[i], sums[i + 1], sums[i + 2]);
    for (std::size_t c = 0; c < 3; ++c) normals[i + c] = static_cast<float>(length > 0 ? sums[i + c] / length : c == 2);
  }
  return normals;
}

}  // namespace cli

// What a model has beside its mesh and constants, as the library's arrays: creases, directions, another rest shape, ties, supports along
// axes.
#pragma once

#include "request.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace host {

class ShellParts {
public:
  // Of a mesh that is cut. Throws HostError naming what is wrong.
  ShellParts(const Mesh &mesh, const Build &build);

  // Into descriptors that are used no longer than this stands.
  void put(SwMaterialDesc &material, SwSupportDesc &supports) const;

private:
  void add_creases(const Mesh &mesh, const std::vector<Crease> &creases);
  void add_directions(const Mesh &mesh, const Stiffness &stiffness);
  void add_ties(const Mesh &mesh, const Build &build);
  void add_axes(const Mesh &mesh, const std::vector<AxisSupport> &supports);

  std::vector<uint32_t> creases_;  // n x 2
  std::vector<double> factors_, angles_, yields_, directions_;
  std::vector<uint32_t> ties_, axis_vertices_;  // ties n x 2
  std::vector<uint8_t> on_triangles_, axes_, symmetric_;
  std::vector<double> tie_stiffness_;
  double tie_within_;
  const std::vector<double> &rest_shape_;
};

// Where a map of the surface grows along u (3 for each polygon), by the coordinates u and v of each corner. Throws HostError naming a
// polygon that has none.
std::vector<double> directions_of_uvs(const Mesh &mesh, const std::vector<double> &uvs);

// The mean of each polygon's corners (n x 3).
std::vector<double> middles_of(const Mesh &mesh);

}  // namespace host

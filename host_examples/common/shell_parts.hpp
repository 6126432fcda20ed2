// What a model has beside its mesh and constants, as the library's arrays: creases, directions, another rest shape.
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
  void put(SwMaterialDesc &material) const;

private:
  void add_creases(const Mesh &mesh, const std::vector<Crease> &creases);
  void add_directions(const Mesh &mesh, const Stiffness &stiffness);

  std::vector<uint32_t> creases_;  // n x 2
  std::vector<double> factors_, angles_, directions_;
  const std::vector<double> &rest_shape_;
};

// Where a map of the surface grows along u (3 for each polygon), by the coordinates u and v of each corner. Throws HostError naming a
// polygon that has none.
std::vector<double> directions_of_uvs(const Mesh &mesh, const std::vector<double> &uvs);

}  // namespace host

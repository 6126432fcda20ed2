// Polygons as triangles.
#pragma once

#include <cstdint>
#include <vector>

namespace host {

// The triangles of a polygon with at least three corners, as corners (3 for each of n - 2), turned as it is: of a quad by the diagonal
// whose triangles have the larger least angle, else ear by ear, the best one first. A square's is the one from its corner of least x, then y, then z. Concave polygons are cut inside. The same for whichever
// corner comes first. A polygon without an inside, as all its corners lie on a line or its sides cross, becomes a fan. `positions` is x y z of
// every vertex.
std::vector<uint32_t> cut_polygon(const std::vector<uint32_t> &corners, const double *positions);

// Of many polygons, one after the other: how many corners each has, and all corners.
std::vector<uint32_t> cut_polygons(const std::vector<uint32_t> &sizes, const std::vector<uint32_t> &corners, const double *positions);

}  // namespace host

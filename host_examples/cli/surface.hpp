// What is drawn of a mesh: its faces as the file has them, their texture coordinates, and normals of a shape that it takes.
#pragma once

#include "mesh.hpp"

#include <cstdint>
#include <vector>

namespace cli {

struct Surface {
  std::vector<uint32_t> counts, corners;  // of each face; its vertices, one face after the other
  std::vector<uint32_t> corner_uvs;       // into the mesh's uvs, one a corner; empty where the file has none of a corner
  std::vector<std::size_t> triangles;     // the first of a face's triangles among the mesh's
};

Surface surface_of(const Mesh &mesh);

// Unit normals of vertices at `positions` (n_vertices x 3), by the areas of the triangles around; (0, 0, 1) where there is none.
std::vector<float> vertex_normals(const std::vector<float> &positions, const std::vector<uint32_t> &triangles);

}  // namespace cli

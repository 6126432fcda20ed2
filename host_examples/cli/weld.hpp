// Vertices that lie together made one, so that pieces which touch are one shell.
#pragma once

#include "mesh.hpp"

namespace cli {

// The mesh with vertices within `distance` of each other made one, the first of them, and what is then no triangle or there twice left out: of
// a sheet with two sides at the same place one is left. Vertices are numbered anew in their order; `mesh.of_file` tells the new number of each.
Mesh weld(const Mesh &mesh, double distance);

}  // namespace cli

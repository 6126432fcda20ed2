// Open edges of a mesh: a waist, a hem, the outline of a leaf.
#pragma once

#include "mesh.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

struct Scene;

// All vertices of the open edge that reaches furthest to a side, however level it is. Throws where the mesh has none.
std::vector<uint32_t> rim_at(const Side &side, const Mesh &mesh);

// Of supports by a side that hold a part of an open edge that runs along it, such as a waist that is not level: what would hold all of it.
std::vector<std::string> notes_of_rims(const Scene &scene, const Mesh &mesh);

// At every vertex: `factor` at those named, falling to 1 over the rings of edges around them, so that no triangle has lengths that close nowhere.
std::vector<double> faded_growth(const Mesh &mesh, const std::vector<uint32_t> &vertices, double factor);

}  // namespace cli

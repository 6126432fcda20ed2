// Edges of a shell that bend or rest otherwise than its sheet, and a shape without stress that is not the mesh.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cli {

class Section;

// [[material.crease]] and `rest_shape`. Files are added to `inputs`.
void read_creases(Section &section, Material &material, std::vector<std::string> &inputs);

// As SwMaterialDesc has them.
struct CreaseLists {
  std::vector<std::array<uint32_t, 2>> edges;
  std::vector<double> factors, angles, yields;
};

// Each edge once: later tables go over earlier ones. Throws std::runtime_error where they do not fit the mesh.
CreaseLists find_creases(const Material &material, const Mesh &mesh);

// n_vertices x 3, in the mesh's unit; empty where it is the mesh. Throws std::runtime_error where it does not fit the mesh.
std::vector<double> rest_positions(const Scene &scene, const Mesh &mesh);

}  // namespace cli

// Sheets that are stiffer along a direction than across it.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"

#include <string>
#include <vector>

namespace cli {

class Section;

// `young_across`, `shear`, `direction` and `directions` of [material]. Files are added to `inputs`.
void read_fibres(Section &section, Material &material, std::vector<std::string> &inputs);

// 3 numbers each, one for the shell or one a triangle, of a proxy that of the file's nearest; empty where it is isotropic. Throws std::runtime_error where they
// do not fit the mesh.
std::vector<double> find_directions(const Material &material, const Mesh &mesh);

}  // namespace cli

// Where constants of a material vary over the shell: by files, and by regions.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"

#include <string>
#include <vector>

namespace cli {

class Section;

// [material.map] and [[material.region]]; the rest of the material must be read already. Files are added to `inputs`.
void read_maps(Section &section, Material &material, std::vector<std::string> &inputs);

// All numbers of a file, above 0 or from 0 on.
std::vector<double> read_numbers(const std::string &path, const std::string &key, bool or_zero);

// The constants that vary, by vertices or by triangles. Throws std::runtime_error where they do not fit the mesh.
std::vector<MaterialFile> material_maps(const Material &material, const Mesh &mesh);

// Of each triangle.
std::vector<double> masses_per_area(const Material &material, const Mesh &mesh);

// All that resists bending, times a factor.
void stiffen_bending(Material &material, double factor);

}  // namespace cli

// What a shell is made of: by constants, by frequency, by sag, as a sheet or by the name of one.
#pragma once

#include "scene.hpp"

#include <string>
#include <vector>

namespace cli {

class Section;

// [material] of a scene, whose unit of length is so many metres long. Files are added to `inputs`.
Material read_material(Section section, double metres_per_unit, std::vector<std::string> &inputs);

// Says that all three constants are 0, which only a user can ask for; empty where they are not.
std::string resists_nothing(const Material &material);

// Makes a material the known sheet of that name, in that unit. Throws std::runtime_error where the library has none.
void set_preset(const std::string &name, double metres_per_unit, Material &material);

// The names of all known sheets, and the same for a message.
std::vector<std::string> preset_list();
std::string preset_names();

}  // namespace cli

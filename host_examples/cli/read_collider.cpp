#include "collider.hpp"
#include "section.hpp"

#include <algorithm>

namespace cli {

namespace {

constexpr double kRadians = 0.017453292519943295;
constexpr uint32_t kFewestCells = 4, kMostCells = 2000;  // of SwColliderDesc

// What a kind needs, and what it may have besides.
struct Keys {
  std::vector<std::string> needed, more;
};

Keys keys_of(uint32_t kind) {
  switch (kind) {
    case SW_COLLIDER_SPHERE: return {{"radius"}, {}};
    case SW_COLLIDER_CAPSULE: return {{"radius", "half_length"}, {}};
    case SW_COLLIDER_BOX: return {{"half_extents"}, {}};
    case SW_COLLIDER_HULL: return {{"mesh"}, {}};
    case SW_COLLIDER_MESH: return {{"mesh"}, {"cells", "one_sided", "depth"}};
    case SW_COLLIDER_DEFORMING_MESH: return {{"mesh", "motion"}, {"one_sided", "depth"}};
    default: return {{}, {"normal"}};
  }
}

void judge_keys(Section &section, const std::string &name, const Keys &keys) {
  for (const std::string &key : keys.needed)
    if (!section.find(key.c_str())) section.fail("a " + name + " needs " + key);
  for (const char *key : {"normal", "radius", "half_length", "half_extents", "mesh", "motion", "cells", "one_sided", "depth"}) {
    const bool takes = std::count(keys.needed.begin(), keys.needed.end(), key) || std::count(keys.more.begin(), keys.more.end(), key);
    if (section.find(key) && !takes) section.fail(*section.find(key), "a " + name + " has no " + std::string(key));
  }
}

std::array<double, 3> read_half_extents(Section &section) {
  const std::array<double, 3> half = section.vector("half_extents", {1, 1, 1});
  for (const double h : half)
    if (!(h > 0)) section.fail(*section.find("half_extents"), "half_extents must be greater than 0");
  return half;
}

uint32_t read_cells(Section &section) {
  const uint32_t cells = section.count("cells").value_or(0);
  if (section.find("cells") && (cells < kFewestCells || cells > kMostCells))
    section.fail(*section.find("cells"), "cells must be from 4 to 2000");
  return cells;
}

// By a rotation vector, or of a plane by where it looks.
std::array<double, 3> read_rotation(Section &section) {
  std::array<double, 3> rotation = section.vector("rotate_degrees");
  for (double &r : rotation) r *= kRadians;
  const std::array<double, 3> normal = section.vector("normal");
  if (!section.find("normal")) return rotation;
  if (section.find("rotate_degrees")) section.fail(*section.find("normal"), "normal does not go with rotate_degrees");
  if (normal == std::array<double, 3>{}) section.fail(*section.find("normal"), "normal must not be 0");
  return rotation_to(normal);
}

}  // namespace

Collider read_collider(Section &section, std::vector<std::string> &inputs) {
  const std::vector<std::string> names = collider_kinds();
  Collider collider;
  if (!section.find("kind")) section.fail("kind is missing: plane, sphere, capsule, box, hull, mesh or deforming");
  const std::string name = section.choice("kind", names);
  collider.kind = 1 + static_cast<uint32_t>(std::find(names.begin(), names.end(), name) - names.begin());
  collider.radius = section.positive("radius", 1);
  collider.half_length = section.not_negative("half_length", 0);
  collider.half_extents = read_half_extents(section);
  collider.cells = read_cells(section);
  collider.one_sided = section.flag("one_sided").value_or(false);
  collider.depth = section.find("depth") ? section.positive("depth", 1) : 0;
  if (section.find("depth") && !collider.one_sided) section.fail(*section.find("depth"), "depth goes with one_sided = true");
  collider.mesh_path = section.file("mesh").value_or("");
  collider.motion_path = section.file("motion").value_or("");
  collider.friction = section.not_negative("friction", 0);
  collider.thickness = section.not_negative("thickness", 0);
  collider.position = section.vector("position");
  collider.rotation = read_rotation(section);
  judge_keys(section, name, keys_of(collider.kind));
  if (!collider.mesh_path.empty()) inputs.push_back(collider.mesh_path);
  const std::vector<std::string> files = collider.deforms() ? files_of_motion(collider.motion_path) : std::vector<std::string>();
  inputs.insert(inputs.end(), files.begin(), files.end());
  return collider;
}

}  // namespace cli

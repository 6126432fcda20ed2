// Vertices held together with others: seams, straps, buttons.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "section.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cli {

SceneTie read_tie(Section section);

// All of a scene, as a SwMaterialDesc has them.
struct TieLists {
  std::vector<std::array<uint32_t, 2>> ends;
  std::vector<uint8_t> on_triangles;
  std::vector<double> stiffness;
  double distance = 0;
};
TieLists find_ties(const Scene &scene, const Mesh &mesh);

// The lists must outlive the descriptor.
void set_ties(const TieLists &ties, SwMaterialDesc &desc);

}  // namespace cli

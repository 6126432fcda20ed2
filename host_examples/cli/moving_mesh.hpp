// A mesh in motion, as files of other programs have it: USD and glTF.
#pragma once

#include "mesh.hpp"
#include "output_file.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

struct MovingMesh {
  struct Frame {
    uint32_t number;
    double seconds;
    std::vector<float> positions, velocities;  // n_vertices x 3, in the world; without velocities empty
  };

  const Mesh &mesh;
  double frame_rate = 30;
  double metres_per_unit = 1;
  uint32_t up = 2;  // axis
  std::vector<Frame> frames{};
};

// NAME.usda: one mesh whose points, normals, velocities and extent have a sample for each frame. Time codes are numbers of frames.
// With `prim`, such as "/World/leaf", these alone are written there, to lie over an asset's mesh of the same vertices; its transforms
// are left out, as the points stand in the world.
void write_usd(OutputFolder &folder, const std::string &name, const std::string &prim, const MovingMesh &moving);

// What is wrong with a path of a prim; empty if nothing is.
std::string wrong_prim(const std::string &prim);

// NAME.glb: glTF 2.0 in one file. The first frame is the mesh, every other one a morph target that an animation puts in its turn.
void write_gltf(OutputFolder &folder, const std::string &name, const MovingMesh &moving);

}  // namespace cli

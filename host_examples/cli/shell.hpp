// From a scene to a precomputed model and a state ready to step.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <vector>

namespace cli {

class ProgressBar;

// The vertices that the scene's supports name, in the order of the supports; fixed and clamped ones without repetition.
struct SupportVertices {
  std::vector<uint32_t> fixed, clamped;
  std::vector<uint32_t> along;  // held along axes
  std::vector<uint8_t> axes;    // SW_AXIS_... of each of these
  std::vector<uint8_t> symmetric;  // and which of them are normals of planes of symmetry
};
SupportVertices find_supports(const Scene &scene, const Mesh &mesh);
// Those that are held in any way.
std::vector<uint32_t> all_of(const SupportVertices &held);

// Those of one support, or of a region of the material. Errors begin with `owner`.
std::vector<uint32_t> find_vertices(const Support &support, const Mesh &mesh, const std::string &owner);

// The scene's mesh, scaled.
Mesh scene_mesh(const Scene &scene);

// The scene's material in constants: of a frequency by a search for the slowest mode, of a sag by the full shell under the scene's gravity.
Material find_material(const Scene &scene, const Mesh &mesh, ProgressBar &progress);

shellwarp::Model make_model(const Scene &scene, const Mesh &mesh, ProgressBar &progress);
// The same with a bar of its own.
shellwarp::Model make_model(const Scene &scene, const Mesh &mesh, bool quiet);
shellwarp::State make_state(const Scene &scene, const Mesh &mesh, const shellwarp::Model &model);

}  // namespace cli

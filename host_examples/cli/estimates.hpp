// How far off a run is, estimated after it: by certificates of a few frames. And what a run has to keep for that.
#pragma once

#include "mesh.hpp"
#include "run.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <cstdint>
#include <string>

namespace cli {

// What menus call its method; of the automatic choice, with what that took.
std::string label_of(const Scene &scene, const SwModelInfo &info);

// What a run keeps that is read later, of the model's method.
Keep keep_of(const Scene &scene, const RunOptions &options, const Mesh &mesh, const shellwarp::Model &model, bool states);

// The errors of the last frame and of some before, estimated. The run is whole without: where there is no estimate, the table says why.
void certify(const Scene &scene, const RunOptions &options, shellwarp::State &state, uint32_t n_vertices, Run &run);

}  // namespace cli

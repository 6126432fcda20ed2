// A run from the start to its end or where it was stopped, and how many steps a frame it settles on.
#pragma once

#include "film.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "point_cache.hpp"
#include "run.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cli {

class RenderMesh;

struct Attempt {
  shellwarp::State state;
  Film film;
  Run run;
};

// Runs the scene once; says so where it begins inside a collider.
Attempt attempt(const Scene &scene, const RunOptions &options, uint32_t n_frames, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const shellwarp::Model &model,
                PointCache *cache, bool on_page, const Keep &keep, const RenderMesh *render);

// As many steps a frame as the motion needs, where nobody said how many; of the tries the one whose steps cost least. Long steps calm a swing, and may be nearer to
// their twin than shorter ones that begin to follow it: so it goes on.
void settle_by_steps(const Mesh &mesh, uint32_t n_frames, uint32_t method, Scene &scene, std::optional<Attempt> &made, const std::function<void(const std::string &)> &again);

}  // namespace cli

#include "attempt.hpp"

#include "choice.hpp"
#include "judge.hpp"
#include "progress.hpp"
#include "shell.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cli {

namespace {

constexpr double kSeen = 1e-3;  // of its size

// How far what moves of the shell is inside a collider before the first step.
double depth_inside(const Scene &scene, const Mesh &mesh, const shellwarp::State &state) {
  if (scene.colliders.empty()) return 0;
  std::vector<double> at(mesh.positions.size()), outside(at.size());
  state.positions(at.data(), mesh.n_vertices());
  state.positions_outside(outside.data(), mesh.n_vertices());
  double deepest = 0;
  for (std::size_t k = 0; k < at.size(); k += 3)
    deepest = std::max(deepest, std::hypot(outside[k] - at[k], outside[k + 1] - at[k + 1], outside[k + 2] - at[k + 2]));
  return deepest;
}

}  // namespace

Attempt attempt(const Scene &scene, const RunOptions &options, uint32_t n_frames, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const shellwarp::Model &model,
                PointCache *cache, bool on_page, const Keep &keep, const RenderMesh *render) {
  Attempt made{make_state(scene, mesh, model), Film(mesh, on_page ? n_frames : 0, options.compare.size() + 1), {}};
  const double deep = depth_inside(scene, mesh, made.state);
  if (deep > kSeen * model.info().size)
    say(format("note: the shell begins inside a collider, %.3g deep: it is pushed out at once, which may throw it; move the collider or the mesh apart", deep), options.quiet);
  made.run = simulate(scene, n_frames, mesh, handles, made.state, cache, on_page ? &made.film : nullptr, options.quiet, keep, render);
  made.run.begins_inside = deep > kSeen * model.info().size;
  return made;
}

void settle_by_steps(const Mesh &mesh, uint32_t n_frames, uint32_t method, Scene &scene, std::optional<Attempt> &made, const std::function<void(const std::string &)> &again) {
  const auto error = [&] { return made->run.step_estimate && made->run.step_estimate->failed.empty() ? made->run.step_estimate->error : 1e300; };
  uint32_t best = scene.steps_per_frame;
  double least = error();
  for (std::string note; !(note = settle_steps(mesh, n_frames, method, made->run, scene)).empty();) {
    again(note);
    if (made->run.interrupted || error() < least) best = scene.steps_per_frame, least = error();
  }
  if (best == scene.steps_per_frame) return;
  const uint32_t tried = std::exchange(scene.steps_per_frame, best);
  const double of_tried = error();
  again(format("%u steps a frame are no nearer; back to %u", tried, best));
  made->run.steps_tried = tried;
  made->run.error_of_tried = of_tried;
}

}  // namespace cli

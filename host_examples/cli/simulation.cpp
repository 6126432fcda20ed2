#include "simulation.hpp"

#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace cli {

namespace {

// Adds the time from its birth to its death to a sum.
class Stopwatch {
public:
  explicit Stopwatch(double &seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch &) = delete;
  Stopwatch &operator=(const Stopwatch &) = delete;

private:
  using Clock = std::chrono::steady_clock;
  double &seconds_;
  Clock::time_point start_;
};

// The frame's pose is given for the end of each step; the library takes velocities from the differences.
void step_to_next_frame(const Scene &scene, shellwarp::State &state, Run &run) {
  for (uint32_t k = 0; k < scene.steps_per_frame; ++k) {
    const double end_time = static_cast<double>(run.steps + 1) * scene.step();
    Stopwatch stopwatch(run.step_seconds);
    if (scene.motion.moves()) state.set_frame(scene.motion.pose(end_time));
    state.step(scene.step());
    ++run.steps;
  }
}

void record(uint32_t frame, const shellwarp::State &state, std::vector<float> &positions, Run &run, PointCache *cache) {
  {
    Stopwatch stopwatch(run.position_seconds);
    state.positions(positions.data(), static_cast<uint32_t>(positions.size() / 3));
  }
  run.all_finite &= std::all_of(positions.begin(), positions.end(), [](float x) { return std::isfinite(x); });
  run.frames.push_back({frame, state.report(), cache ? state.save() : std::vector<unsigned char>()});
  if (cache) cache->append(positions.data());
}

}  // namespace

uint32_t frame_count(const Scene &scene) {
  return static_cast<uint32_t>(std::clamp(std::round(scene.duration * scene.frame_rate), 1.0, 1e9));
}

Run simulate(const Scene &scene, uint32_t n_frames, uint32_t n_vertices, shellwarp::State &state, PointCache *cache) {
  Run run;
  std::vector<float> positions(std::size_t{3} * n_vertices);
  record(0, state, positions, run, cache);
  run.position_seconds = 0;  // the start is not a frame that was stepped to
  for (uint32_t frame = 1; frame <= n_frames && !run.interrupted; ++frame) {
    step_to_next_frame(scene, state, run);
    record(frame, state, positions, run, cache);
    run.interrupted = interrupted();
  }
  return run;
}

}  // namespace cli

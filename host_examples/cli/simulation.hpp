// Stepping a scene through its frames, with the clock on the library alone: steps and positions are timed, files are not.
#pragma once

#include "point_cache.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace cli {

// One frame as it was after its last step. `saved` brings the state back (sw_state_load); kept only where files are written.
struct FrameRecord {
  uint32_t frame;
  SwStateReport report;
  std::vector<unsigned char> saved;
};

struct Run {
  std::vector<FrameRecord> frames;  // frame 0 is the start
  uint64_t steps = 0;
  double step_seconds = 0, position_seconds = 0;
  bool all_finite = true;
  bool interrupted = false;
};

// Writes one sample a frame into `cache` unless it is null.
Run simulate(const Scene &scene, uint32_t n_frames, uint32_t n_vertices, shellwarp::State &state, PointCache *cache);

// The duration in frames, at least one.
uint32_t frame_count(const Scene &scene);

}  // namespace cli

// Where in the run a request's time is.
#pragma once

#include "shell_runner.hpp"

#include <cstdint>

namespace host {

// Whole frames to within this: hosts round times (Maya to 1/141120000 s, Houdini to double precision).
inline constexpr double kWholeFrame = 1e-4;

// The last whole frame, and how much of one has gone by since.
struct ShellRunner::At {
  uint64_t frame = 0;
  double fraction = 0;
  bool before = false;  // the start

  explicit At(const Request &request) {
    const double frames = (request.time - request.motion.start_time) * request.motion.frame_rate;
    before = frames < -kWholeFrame;
    if (frames <= kWholeFrame) return;
    if (!(frames < static_cast<double>(StateCache::limit)))
      throw HostError("this is " + number(frames) + " frames after the start, too far: the most is " + number(StateCache::limit - 1) +
                      "; is the start frame right?");
    frame = static_cast<uint64_t>(frames + kWholeFrame);
    fraction = frames - static_cast<double>(frame);
    if (fraction < kWholeFrame) fraction = 0;
  }

  bool rest() const { return frame == 0 && fraction == 0; }  // up to the start
  bool start() const { return rest() && !before; }
};

}  // namespace host

// What a user is to be told of a frame.
#pragma once

#include <cstdint>
#include <string>

namespace host {

struct Notes {
  bool turn_in_range = true;  // SwStateReport.turn_in_range: of turns alone, no measure of the error
  double max_rotation = 0;  // rad
  double turned_too_far = 0;  // share of the vertices, SwStateReport.fraction_turned_too_far
  uint32_t handles_missed = 0;
  std::string certified;           // what the estimate of the error says, where it was asked for
  bool jumped = false;             // the frames before this one were not all seen with their own inputs
  bool floats = false;             // nothing is held
  bool stored_of_others = false;   // the frames on disk are of another mesh, or of other settings
  double supports_missed = 0;      // SwStateReport.support_miss over the mesh's size
  double rest_stretched = 0;       // SwStateReport.rest_stretch
  std::string maps_unused;         // those that the kind of stiffness does not take
  std::string uncalibrated;        // why a proxy is as stiff as its own mesh, and not as the mesh that it stands for
  double inside = 0;               // SwStateReport.deepest_penetration over the mesh's size; of what is pushed out, what is left of it
  uint64_t builds = 0, steps = 0;  // so far; a sub-frame's part of a step is not counted

  static constexpr double kMissed = 0.01;   // a kink beside the supports that is seen
  static constexpr double kStretched = 0.2;  // beyond what a sheet's own stretch makes of its stiffness
  static constexpr double kInside = 1e-3;   // fifty times what a step leaves where modes can follow

  // What a user should be told, one sentence a line; empty where all is well.
  std::string warning() const;
  // Which of the sentences there are, as bits: a host that tells of a change once goes by this, as the numbers in them change
  // from frame to frame.
  uint32_t warnings() const {
    return 1u * !turn_in_range | 2u * (handles_missed > 0) | 4u * jumped | 8u * floats | 16u * !certified.empty() |
           32u * (supports_missed > kMissed) | 64u * stored_of_others | 128u * (inside > kInside) | 256u * (rest_stretched > kStretched) |
           512u * !maps_unused.empty() | 1024u * !uncalibrated.empty();
  }
};

}  // namespace host

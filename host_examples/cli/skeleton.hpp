// A skeleton: bones that move as a support frame does, each carried by its parent, and so by all of its ancestors. At time 0
// every bone is in its rest pose, in which the meshes of the shells that hang on it are given.
#pragma once

#include "frame_motion.hpp"
#include "output_file.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cli {

struct Bone {
  std::string name, parent;  // parent is empty for a root
  std::shared_ptr<const FrameMotion> motion;
};

using Skeleton = std::vector<Bone>;  // parents before their children

// The bone of that name, null where there is none.
const Bone *find_bone(const Skeleton &skeleton, const std::string &name);

// A row for each frame from 0 to n_frames and bone: frame, time, bone, parent, the place of its joint (x, y, z), and the world
// axes of its frame (xx, xy, xz is what x has become, and so on to zz).
void write_bones(OutputFolder &folder, const std::string &name, const Skeleton &skeleton, uint32_t n_frames,
                 double frame_rate);

}  // namespace cli

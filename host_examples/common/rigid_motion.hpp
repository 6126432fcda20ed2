// The rigid motion that points have made.
#pragma once

#include "pose.hpp"

#include <cstdint>
#include <vector>

namespace host {

// The one that brings vertices nearest to where they are, from `rest`. What vertices on a line leave open does not turn.
Pose rigid_motion(const std::vector<uint32_t> &vertices, const std::vector<double> &points, const std::vector<double> &rest);

}  // namespace host

// Which of many points is nearest to each of others.
#pragma once

#include <cstdint>
#include <vector>

namespace host {

// For each of `wanted` (n x 3) the index of the nearest of `points` (m x 3, at least one), the first of those equally near.
std::vector<uint32_t> nearest_of(const std::vector<double> &points, const std::vector<double> &wanted);

}  // namespace host

#include "nearest.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace host {

namespace {

std::size_t longest_axis(const std::vector<double> &points) {
  double low[3], high[3];
  for (std::size_t c = 0; c < 3; ++c) low[c] = high[c] = points[c];
  for (std::size_t i = 0; i < points.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], points[i]);
    high[i % 3] = std::max(high[i % 3], points[i]);
  }
  std::size_t longest = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if (high[c] - low[c] > high[longest] - low[longest]) longest = c;
  return longest;
}

}  // namespace

// Along the longest axis, outwards from each point on both sides, until that way alone is longer than what was found.
std::vector<uint32_t> nearest_of(const std::vector<double> &points, const std::vector<double> &wanted) {
  const std::size_t axis = longest_axis(points);
  std::vector<std::pair<double, uint32_t>> sorted;
  for (uint32_t i = 0; i < points.size() / 3; ++i) sorted.emplace_back(points[3 * std::size_t{i} + axis], i);
  std::sort(sorted.begin(), sorted.end());
  std::vector<uint32_t> found;
  for (std::size_t w = 0; w < wanted.size(); w += 3) {
    const double *x = &wanted[w];
    std::pair<double, uint32_t> best = {std::numeric_limits<double>::infinity(), sorted.front().second};
    const auto better = [&](const std::pair<double, uint32_t> &candidate) {
      const double along = candidate.first - x[axis];
      if (along * along > best.first) return false;
      const double *y = &points[3 * std::size_t{candidate.second}];
      const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
      best = std::min(best, {d[0] * d[0] + d[1] * d[1] + d[2] * d[2], candidate.second});
      return true;
    };
    const auto middle = std::lower_bound(sorted.begin(), sorted.end(), std::make_pair(x[axis], uint32_t{0}));
    for (auto up = middle; up != sorted.end() && better(*up);) ++up;
    for (auto down = middle; down != sorted.begin() && better(*(down - 1));) --down;
    found.push_back(best.second);
  }
  return found;
}

}  // namespace host

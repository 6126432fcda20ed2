#include "film.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

namespace {

constexpr double kMostBytes = 30e6;      // of a page before base64: 40 MB on the disk, which browsers still open at once
constexpr double kBytesOfAVertex = 6;    // three steps of 16 bits
constexpr double kLargestStep = 32767;

}  // namespace

Film::Film(const Mesh &mesh, uint32_t n_frames, std::size_t shares) : rest_(mesh.positions), last_(n_frames) {
  const double bytes = kBytesOfAVertex * mesh.n_vertices() * (n_frames + 1.0) * static_cast<double>(shares);
  every_ = static_cast<uint32_t>(std::clamp(std::ceil(bytes / kMostBytes), 1.0, static_cast<double>(std::max(n_frames, 1u))));
}

void Film::append(uint32_t frame, double seconds, double displacement, const float *positions) {
  if (frame % every_ != 0 && frame != last_) return;
  frames_.push_back(frame);
  times_.push_back(seconds);
  displacements_.push_back(displacement);
  for (std::size_t i = 0; i < rest_.size(); ++i) moved_.push_back(static_cast<float>(positions[i] - rest_[i]));
}

double Film::largest() const {
  double largest = 0;
  for (const float x : moved_) largest = std::max(largest, std::fabs(static_cast<double>(x)));
  return largest;
}

std::vector<double> Film::positions(std::size_t k) const {
  std::vector<double> at = rest_;
  for (std::size_t i = 0; i < at.size(); ++i) at[i] += moved_.at(k * at.size() + i);
  return at;
}

Film::Difference Film::from(const Film &other) const {
  const std::size_t n = rest_.size(), frames = std::min(frames_.size(), other.frames_.size());
  double most = 0;
  std::vector<double> off(frames);
  for (std::size_t f = 0; f < frames; ++f) {
    double moved = 0;
    for (std::size_t i = f * n; i < (f + 1) * n; ++i) {
      const double a = moved_[i], b = other.moved_[i];
      moved += b * b;
      off[f] += (a - b) * (a - b);
    }
    most = std::max(most, moved);
  }
  if (!(most > 0)) return {};
  const auto worst = std::max_element(off.begin(), off.end());
  return {std::sqrt(*worst / most), times_[static_cast<std::size_t>(worst - off.begin())], std::sqrt(off.back() / most)};
}

std::vector<int16_t> Film::steps() const {
  const double most = largest(), scale = most > 0 ? kLargestStep / most : 0;
  std::vector<int16_t> steps(moved_.size());
  for (std::size_t i = 0; i < moved_.size(); ++i) steps[i] = static_cast<int16_t>(std::lround(scale * moved_[i]));
  return steps;
}

}  // namespace cli

#include "point_cache.hpp"

#include <cstring>
#include <stdexcept>
#include <vector>

namespace cli {

namespace {

constexpr long kSamplesOffset = 28, kFirstSample = 32;
constexpr float kStartFrame = 0, kFramesPerSample = 1;

uint32_t bits(float value) {
  uint32_t word;
  std::memcpy(&word, &value, sizeof word);
  return word;
}

void store(unsigned char *bytes, uint32_t word) {
  for (int k = 0; k < 4; ++k) bytes[k] = static_cast<unsigned char>(word >> (8 * k));
}

}  // namespace

PointCache::PointCache(OutputFolder &folder, const std::string &name, uint32_t n_points)
    : file_(folder, name), n_points_(n_points) {
  if (n_points > INT32_MAX) throw std::runtime_error("a PC2 file holds at most 2147483647 points");
  file_.write(kPointCacheMagic, sizeof kPointCacheMagic);
  put(1);
  put(n_points);
  put(bits(kStartFrame));
  put(bits(kFramesPerSample));
  put(0);
}

void PointCache::append(const float *positions) {
  std::vector<unsigned char> bytes(std::size_t{12} * n_points_);
  for (std::size_t i = 0; i < std::size_t{3} * n_points_; ++i) store(&bytes[4 * i], bits(positions[i]));
  file_.write(bytes.data(), bytes.size());
  ++n_samples_;
}

void PointCache::restart() {
  file_.seek(kFirstSample);
  n_samples_ = 0;
}

void PointCache::close() {
  file_.seek(kSamplesOffset);
  put(n_samples_);
  file_.close();
}

void PointCache::put(uint32_t word) {
  unsigned char bytes[4];
  store(bytes, word);
  file_.write(bytes, sizeof bytes);
}

}  // namespace cli

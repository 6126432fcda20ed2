// Point cache in the PC2 format, which Blender's Mesh Cache modifier and 3ds Max read:
//
//   char[12] "POINTCACHE2\0", int32 version = 1, int32 points, float32 start frame, float32 frames a sample, int32 samples,
//   then for each sample points x 3 float32. All little-endian.
#pragma once

#include "output_file.hpp"

#include <cstdint>
#include <string>

namespace cli {

constexpr char kPointCacheMagic[12] = "POINTCACHE2";

class PointCache {
public:
  PointCache(OutputFolder &folder, const std::string &name, uint32_t n_points);

  // n_points x 3.
  void append(const float *positions);
  // Begins again at the first sample.
  void restart();
  // Writes the number of samples into the header. A cache that is not closed counts as empty.
  void close();

private:
  void put(uint32_t word);

  OutputFile file_;
  uint32_t n_points_;
  uint32_t n_samples_ = 0;
};

}  // namespace cli

// A still picture for those without a browser: the shell at rest, where it moved furthest, and at the end, side by side, as a PNG file.
// Seen from where the motion shows most; behind what moved it lies at rest, in grey.
#pragma once

#include "film.hpp"
#include "mesh.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cli {

class Picture {
public:
  // A shell; all are drawn at the frames of the first. `held` vertices are marked, `wind` is an arrow unless it is 0, `up` points upward in the picture.
  void add(const Mesh &mesh, const Film &film, const std::vector<uint32_t> &held, const std::array<double, 3> &wind, uint32_t up);
  bool empty() const { return triangles_.empty(); }
  // How many times as large as it is motion is drawn, so that it is seen.
  double times_larger() const { return larger_; }
  // Seconds of the second and the third.
  std::array<double, 2> moments() const { return moments_; }
  bool has_wind() const { return wind_ != std::array<double, 3>{}; }
  // The bytes of the file.
  std::string png() const;

private:
  static constexpr std::size_t kPanels = 3;

  std::vector<uint32_t> triangles_, held_;
  std::array<std::vector<double>, kPanels> positions_;
  std::array<std::size_t, kPanels> frames_{};
  std::array<double, 3> wind_{};
  std::array<double, 2> moments_{};
  uint32_t up_ = 2;
  double larger_ = 1;
};

// Whole or not at all; `inputs` are never replaced.
void write_picture(const Picture &picture, const std::string &path, const std::vector<std::string> &inputs);

}  // namespace cli

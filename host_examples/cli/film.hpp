// The frames of one shell by one method, as a page plays them: thinned out where all of them would make it too large.
#pragma once

#include "mesh.hpp"

#include <cstdint>
#include <vector>

namespace cli {

class Film {
public:
  // `shares`: how many films the page is to hold.
  Film(const Mesh &mesh, uint32_t n_frames, std::size_t shares);

  // All frames from 0 on are offered in turn; some are kept, the first and the last always.
  void append(uint32_t frame, double seconds, double displacement, const float *positions);

  std::size_t n_frames() const { return frames_.size(); }
  const std::vector<uint32_t> &frames() const { return frames_; }
  const std::vector<double> &times() const { return times_; }
  const std::vector<double> &displacements() const { return displacements_; }
  // The largest displacement of a coordinate, and all of them, frame by frame, as shares of 32767 of that.
  double largest() const;
  std::vector<int16_t> steps() const;

  // Where the vertices were in the k-th of the frames that are kept.
  std::vector<double> positions(std::size_t k) const;

  // How far this one is off another of the same frames, root mean squares over the vertices as shares of the other's largest displacement.
  struct Difference {
    double worst = 0, seconds = 0, at_end = 0;
  };
  Difference from(const Film &other) const;

private:
  const std::vector<double> &rest_;
  uint32_t last_, every_;
  std::vector<uint32_t> frames_;
  std::vector<double> times_, displacements_;
  std::vector<float> moved_;  // displacements from the rest positions
};

}  // namespace cli

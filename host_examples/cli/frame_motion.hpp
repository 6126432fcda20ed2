// How the frame that carries the supports is shaken: sums of sinusoids under an envelope that begins and ends at rest.
//
//   t(s) = e(s) Σ axis · amplitude · sin(2π f s + φ)      translation of the pivot
//   r(s) = e(s) Σ axis · angle     · sin(2π f s + φ)      rotation vector; R = exp[r]×, about the pivot
//   world = pivot + t + R (local − pivot)              and then as the parent moves, where there is one
//
// e rises from 0 to 1 and falls back with two continuous derivatives, so that no jolt comes from the envelope.
#pragma once

#include "shellwarp.hpp"

#include <array>
#include <memory>
#include <vector>

namespace cli {

struct Oscillation {
  std::array<double, 3> axis{};
  double amplitude = 0;  // length units, or radians
  double frequency = 0;  // Hz
  double phase = 0;      // radians
};

struct FrameMotion {
  std::array<double, 3> pivot{};
  double rise = 1, end = 0, fall = 1;  // s: time to swell, time at which all is still again, time to die away
  std::vector<Oscillation> translations, rotations;
  std::shared_ptr<const FrameMotion> parent;  // carries all of the above; null = the world

  bool moves() const { return !translations.empty() || !rotations.empty() || (parent && parent->moves()); }
  // Pose at a time in seconds.
  SwFrameDesc pose(double seconds) const;
};

// exp[r]× of a rotation vector, row-major.
std::array<double, 9> rotation_matrix(const std::array<double, 3> &r);

// Where a pose takes a point.
std::array<double, 3> transform(const SwFrameDesc &pose, const std::array<double, 3> &x);

// The row-major product of two 3 x 3 matrices.
std::array<double, 9> product(const double *a, const double *b);

}  // namespace cli

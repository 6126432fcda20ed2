#include "frame_motion.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

namespace {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<double, 9>;  // row-major

constexpr double kTwoPi = 6.283185307179586;

// 0 to 1 over 0 ≤ x ≤ 1, first and second derivative 0 at both ends.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 + x * (6 * x - 15));
}

Vec3 sum(const std::vector<Oscillation> &oscillations, double seconds, double envelope) {
  Vec3 total{};
  for (const Oscillation &o : oscillations)
    for (std::size_t k = 0; k < 3; ++k)
      total[k] += envelope * o.axis[k] * o.amplitude * std::sin(kTwoPi * o.frequency * seconds + o.phase);
  return total;
}

SwFrameDesc carried(const SwFrameDesc &parent, const SwFrameDesc &own) {
  SwFrameDesc frame = own;
  const Vec3 origin = transform(parent, {own.origin[0], own.origin[1], own.origin[2]});
  const Mat3 rotation = product(parent.rotation, own.rotation);
  std::copy(origin.begin(), origin.end(), frame.origin);
  std::copy(rotation.begin(), rotation.end(), frame.rotation);
  return frame;
}

}  // namespace

Mat3 rotation_matrix(const Vec3 &r) {
  // I + a [r]× + b [r]×², by Rodrigues
  const double angle = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
  const double half = angle / 2;
  const double a = angle > 0 ? std::sin(angle) / angle : 1;
  const double b = half > 0 ? 0.5 * std::pow(std::sin(half) / half, 2) : 0.5;
  const Mat3 cross = {0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0};
  Mat3 m = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      m[3 * i + j] += a * cross[3 * i + j];
      for (std::size_t k = 0; k < 3; ++k) m[3 * i + j] += b * cross[3 * i + k] * cross[3 * k + j];
    }
  return m;
}

Vec3 transform(const SwFrameDesc &pose, const Vec3 &x) {
  Vec3 y{};
  for (std::size_t i = 0; i < 3; ++i) {
    y[i] = pose.origin[i];
    for (std::size_t j = 0; j < 3; ++j) y[i] += pose.rotation[3 * i + j] * x[j];
  }
  return y;
}

Mat3 product(const double *a, const double *b) {
  Mat3 c{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return c;
}

SwFrameDesc FrameMotion::pose(double seconds) const {
  const double envelope = smooth_step(seconds / rise) * smooth_step((end - seconds) / fall);
  const Vec3 shift = sum(translations, seconds, envelope);
  const Mat3 m = rotation_matrix(sum(rotations, seconds, envelope));

  SwFrameDesc frame = shellwarp::frame_desc();
  for (std::size_t i = 0; i < 3; ++i) {
    frame.origin[i] = pivot[i] + shift[i];
    for (std::size_t j = 0; j < 3; ++j) {
      frame.rotation[3 * i + j] = m[3 * i + j];
      frame.origin[i] -= m[3 * i + j] * pivot[j];
    }
  }
  return parent ? carried(parent->pose(seconds), frame) : frame;
}

}  // namespace cli

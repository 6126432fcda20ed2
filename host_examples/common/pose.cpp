#include "pose.hpp"

#include "message.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace host {

namespace {

// As near to rigid as the library asks of a frame (SwFrameDesc.rotation).
constexpr double kTolerance = 1e-4;

double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double determinant(const std::array<Vec3, 3> &rows) {
  const auto &[a, b, c] = rows;
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

Vec3 turn(const Matrix3 &m, const Vec3 &x) {
  Vec3 y{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) y[i] += m[3 * i + j] * x[j];
  return y;
}

Matrix3 product(const Matrix3 &a, const Matrix3 &b) {
  Matrix3 m{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) m[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return m;
}

Matrix3 transpose(const Matrix3 &m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }

[[noreturn]] void refuse(const char *what, const std::string &why) { throw HostError(std::string(what) + " " + why); }

std::array<Vec3, 3> axes_of(const Matrix4 &m, const char *what) {
  for (const double x : m)
    if (!std::isfinite(x)) refuse(what, "holds a number that is not finite");
  return {{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}}};
}

void require_even(const Vec3 &lengths, const char *what) {
  const auto [least, most] = std::minmax_element(lengths.begin(), lengths.end());
  if (*most - *least > kTolerance * *most)
    refuse(what, "is scaled unevenly (" + number(lengths[0]) + ", " + number(lengths[1]) + ", " + number(lengths[2]) +
                     "): freeze its scale, or use one factor for all axes");
}

// The axes are unit vectors by now.
void require_square(const std::array<Vec3, 3> &axes, const char *what) {
  const double shear =
      std::max({std::abs(dot(axes[0], axes[1])), std::abs(dot(axes[1], axes[2])), std::abs(dot(axes[2], axes[0]))});
  if (shear > kTolerance) refuse(what, "is sheared (by " + number(shear) + "): freeze its shear");
  if (determinant(axes) < 0) refuse(what, "is mirrored: freeze its negative scale");
}

}  // namespace

Pose pose_of(const Matrix4 &matrix, const char *what, Scale rule) {
  std::array<Vec3, 3> axes = axes_of(matrix, what);
  Vec3 lengths{};
  for (std::size_t k = 0; k < 3; ++k) lengths[k] = std::sqrt(dot(axes[k], axes[k]));
  if (*std::min_element(lengths.begin(), lengths.end()) <= 0) refuse(what, "has an axis of length 0");
  if (rule == Scale::even) require_even(lengths, what);
  for (std::size_t k = 0; k < 3; ++k)
    for (double &x : axes[k]) x /= lengths[k];
  require_square(axes, what);

  Pose pose;
  pose.origin = {matrix[12], matrix[13], matrix[14]};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) pose.rotation[3 * i + j] = axes[j][i];
  // A scale that is only rounding is none: then frames at rest stay bit for bit where they are.
  const double scale = std::cbrt(lengths[0] * lengths[1] * lengths[2]);
  pose.scale = rule == Scale::ignored || std::abs(scale - 1) < 1e-12 ? 1 : scale;
  return pose;
}

Vec3 scale_of(const Matrix4 &matrix) {
  Vec3 lengths{};
  for (std::size_t k = 0; k < 3; ++k)
    lengths[k] =
        static_cast<double>(static_cast<float>(std::hypot(matrix[4 * k], matrix[4 * k + 1], matrix[4 * k + 2])));
  return lengths;
}

Pose pose_of_angles(const Vec3 &origin, const Vec3 &degrees) {
  Vec3 c{}, s{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double angle = degrees[k] * 0.017453292519943295;
    c[k] = std::cos(angle);
    s[k] = std::sin(angle);
  }
  const Matrix3 x = {1, 0, 0, 0, c[0], -s[0], 0, s[0], c[0]};
  const Matrix3 y = {c[1], 0, s[1], 0, 1, 0, -s[1], 0, c[1]};
  const Matrix3 z = {c[2], -s[2], 0, s[2], c[2], 0, 0, 0, 1};
  Pose pose;
  pose.origin = origin;
  pose.rotation = product(z, product(y, x));
  return pose;
}

Matrix3 rotation_of_quaternion(const std::array<double, 4> &q) {
  const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(std::abs(square - 1) < 0.01))
    throw HostError("an orientation has length " + number(std::sqrt(square)) + ", not 1");
  const double n = 2 / square, x = q[0], y = q[1], z = q[2], w = q[3];
  return {1 - n * (y * y + z * z), n * (x * y - w * z),     n * (x * z + w * y),
          n * (x * y + w * z),     1 - n * (x * x + z * z), n * (y * z - w * x),
          n * (x * z - w * y),     n * (y * z + w * x),     1 - n * (x * x + y * y)};
}

Vec3 turn_of(const Matrix3 &m) {
  Vec3 turn = {(m[7] - m[5]) / 2, (m[2] - m[6]) / 2, (m[3] - m[1]) / 2};
  const double s = std::hypot(turn[0], turn[1], turn[2]), c = (m[0] + m[4] + m[8] - 1) / 2;
  for (double &x : turn) x *= s > 0 ? std::atan2(s, c) / s : 1;
  return turn;
}

Vec3 apply(const Pose &pose, const Vec3 &x) {
  Vec3 y = turn(pose.rotation, x);
  for (std::size_t k = 0; k < 3; ++k) y[k] = pose.origin[k] + pose.scale * y[k];
  return y;
}

Pose inverse(const Pose &pose) {
  Pose out;
  out.rotation = transpose(pose.rotation);
  out.scale = 1 / pose.scale;
  out.origin = turn(out.rotation, pose.origin);
  for (double &x : out.origin) x *= -out.scale;
  return out;
}

Pose product(const Pose &outer, const Pose &inner) {
  Pose out;
  out.origin = apply(outer, inner.origin);
  out.rotation = product(outer.rotation, inner.rotation);
  out.scale = outer.scale * inner.scale;
  return out;
}

}  // namespace host

#include "rigid_motion.hpp"

#include <cmath>

namespace host {

namespace {

Vec3 point(const std::vector<double> &points, uint32_t v) {
  const double *x = &points[3 * std::size_t{v}];
  return {x[0], x[1], x[2]};
}

Vec3 plus(const Vec3 &a, const Vec3 &b, double factor) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

Vec3 middle(const std::vector<double> &points, const std::vector<uint32_t> &of) {
  Vec3 sum{};
  for (const uint32_t v : of) sum = plus(sum, point(points, v), 1 / static_cast<double>(of.size()));
  return sum;
}

double inner(const Matrix3 &a, const Matrix3 &b) {
  double sum = 0;
  for (std::size_t i = 0; i < 9; ++i) sum += a[i] * b[i];
  return sum;
}

Matrix3 rotation_about(const Vec3 &turn) {
  const double angle = std::hypot(turn[0], turn[1], turn[2]);
  const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  return rotation_of_quaternion({s * turn[0], s * turn[1], s * turn[2], std::cos(angle / 2)});
}

// The rotation nearest to a matrix, from a first guess: turned on until the columns pull evenly (Müller and others 2016).
Matrix3 nearest_rotation(const Matrix3 &m, Matrix3 r) {
  for (int k = 0; k < 100; ++k) {
    Vec3 pull{};
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = 3 * ((i + 1) % 3) + column, l = 3 * ((i + 2) % 3) + column;
        pull[i] += r[j] * m[l] - r[l] * m[j];
      }
    const double size = std::abs(inner(r, m));
    if (!(size > 0)) return r;
    for (double &x : pull) x /= size;
    Pose turn, before;
    turn.rotation = rotation_about(pull);
    before.rotation = r;
    r = product(turn, before).rotation;
    if (std::hypot(pull[0], pull[1], pull[2]) < 1e-13) break;
  }
  return r;
}

}  // namespace

Pose rigid_motion(const std::vector<uint32_t> &vertices, const std::vector<double> &points, const std::vector<double> &rest) {
  const Vec3 from = middle(rest, vertices), to = middle(points, vertices);
  Matrix3 moments{};
  for (const uint32_t v : vertices) {
    const Vec3 a = plus(point(rest, v), from, -1), b = plus(point(points, v), to, -1);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) moments[3 * i + j] += b[i] * a[j];
  }
  Pose best;
  best.rotation = nearest_rotation(moments, best.rotation);
  // Half a turn pulls evenly as well.
  for (const Matrix3 &half : {Matrix3{1, 0, 0, 0, -1, 0, 0, 0, -1}, Matrix3{-1, 0, 0, 0, 1, 0, 0, 0, -1}, Matrix3{-1, 0, 0, 0, -1, 0, 0, 0, 1}}) {
    const Matrix3 other = nearest_rotation(moments, half);
    if (inner(other, moments) > inner(best.rotation, moments) + 1e-9 * std::sqrt(inner(moments, moments))) best.rotation = other;
  }
  best.origin = plus(to, host::apply({{}, best.rotation, 1}, from), -1);
  return best;
}

}  // namespace host

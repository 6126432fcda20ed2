// Placements of things in a host's world, out of the 4 x 4 matrices that hosts keep.
//
//   x_world = origin + scale rotation x_local
//
// The library knows rigid frames. One scale for all axes is taken along beside it; a mirrored, sheared or unevenly scaled
// matrix is refused, since a shell that hangs in it has no rest shape of its own.
#pragma once

#include <array>

namespace host {

using Vec3 = std::array<double, 3>;
using Matrix3 = std::array<double, 9>;   // row-major, its columns the axes
using Matrix4 = std::array<double, 16>;  // as hosts store it: row-major, x_world = x_local M, so rows are the axes

struct Pose {
  Vec3 origin{};
  Matrix3 rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
  double scale = 1;
};

enum class Scale {
  even,    // one factor for all axes
  ignored  // each axis its own; only origin and axes are used, scale is 1
};

// Throws HostError, the message beginning with `what`.
Pose pose_of(const Matrix4 &matrix, const char *what, Scale rule);

// Lengths of a matrix's three axes, rounded to floats: a matrix that turns keeps them to the bit.
Vec3 scale_of(const Matrix4 &matrix);

// Rotation about the fixed x, then y, then z axis, in degrees: Houdini's default order.
Pose pose_of_angles(const Vec3 &origin, const Vec3 &degrees);

// Of a unit quaternion x y z w; one that is far from unit length is refused.
Matrix3 rotation_of_quaternion(const std::array<double, 4> &q);

// The angle times the axis of a rotation of less than half a turn.
Vec3 turn_of(const Matrix3 &rotation);

Vec3 apply(const Pose &pose, const Vec3 &x);
Pose inverse(const Pose &pose);
Pose product(const Pose &outer, const Pose &inner);  // apply(product(a, b), x) = apply(a, apply(b, x))

}  // namespace host

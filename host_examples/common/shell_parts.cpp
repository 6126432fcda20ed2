#include "shell_parts.hpp"

#include "message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

namespace host {

namespace {

constexpr double kHalfTurn = 3.141592653589793;

bool is_finite(const std::vector<double> &values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

std::size_t n_polygons(const Mesh &mesh) { return mesh.sizes.empty() ? mesh.n_triangles() : mesh.sizes.size(); }

}  // namespace

ShellParts::ShellParts(const Mesh &mesh, const Build &build) : rest_shape_(build.rest_shape) {
  add_creases(mesh, build.creases);
  const Stiffness &s = build.stiffness;
  if ((s.by == Stiffness::By::preset || s.by == Stiffness::By::sheet) && s.young_across > 0) add_directions(mesh, s);
  if (!rest_shape_.empty() && rest_shape_.size() != mesh.points.size())
    throw HostError("the rest shape has " + number(uint64_t(rest_shape_.size() / 3)) + " points, the simulated mesh " + number(uint64_t(mesh.n_points())) +
                    ": they must be the same, in the same order");
  if (!is_finite(rest_shape_)) throw HostError("a point of the rest shape is not finite");
}

// Of an edge that is named twice the later one.
void ShellParts::add_creases(const Mesh &mesh, const std::vector<Crease> &creases) {
  std::map<std::array<uint32_t, 2>, const Crease *> last;
  for (const Crease &crease : creases) {
    const std::string name = "the crease from point " + number(uint64_t(crease.a)) + " to " + number(uint64_t(crease.b));
    if (std::max(crease.a, crease.b) >= mesh.n_points()) throw HostError(name + ": there are " + number(uint64_t(mesh.n_points())) + " points");
    if (!(crease.factor >= 0) || !std::isfinite(crease.factor)) throw HostError(name + " has the factor " + number(crease.factor) + "; it must be 0 or above");
    if (crease.angle && !(std::abs(*crease.angle) <= kHalfTurn))
      throw HostError(name + " rests at " + number(*crease.angle * 180 / kHalfTurn) + " degrees; it must be from -180 to 180");
    last[{std::min(crease.a, crease.b), std::max(crease.a, crease.b)}] = &crease;
  }
  for (const auto &[edge, crease] : last) {
    creases_.insert(creases_.end(), edge.begin(), edge.end());
    factors_.push_back(crease->factor);
    angles_.push_back(crease->angle.value_or(SW_CREASE_ANGLE_OF_MESH));
  }
}

// Of a polygon to each of the triangles that it was cut into.
void ShellParts::add_directions(const Mesh &mesh, const Stiffness &s) {
  const std::size_t n = n_polygons(mesh), given = s.directions.size() / 3;
  if (given != 1 && given != n)
    throw HostError("there are " + number(uint64_t(given)) + " directions of Young's modulus, and " + number(uint64_t(n)) + " polygons");
  if (given == 1 || mesh.sizes.empty()) {
    directions_ = s.directions;
    return;
  }
  for (std::size_t k = 0; k < n; ++k)
    for (uint32_t t = 2; t < mesh.sizes[k]; ++t)
      for (std::size_t c = 0; c < 3; ++c) directions_.push_back(s.directions[3 * k + c]);
}

void ShellParts::put(SwMaterialDesc &material) const {
  material.creases = creases_.data(), material.n_creases = static_cast<uint32_t>(creases_.size() / 2);
  material.crease_factors = factors_.data(), material.crease_angles = angles_.data();
  if (!directions_.empty()) {
    material.directions = directions_.data(), material.n_directions = static_cast<uint32_t>(directions_.size() / 3);
    material.direction_format = SW_FORMAT_F64;
  }
  if (!rest_shape_.empty()) material.rest_positions = rest_shape_.data(), material.rest_format = SW_FORMAT_F64;
}

// By least squares over the corners: x = x0 + a u + b v, and a is the direction.
std::vector<double> directions_of_uvs(const Mesh &mesh, const std::vector<double> &uvs) {
  if (uvs.size() != 2 * mesh.corners.size())
    throw HostError("there are " + number(uint64_t(uvs.size() / 2)) + " texture coordinates for " + number(uint64_t(mesh.corners.size())) + " corners");
  std::vector<double> directions;
  std::size_t from = 0;
  for (std::size_t k = 0; k < mesh.sizes.size(); from += mesh.sizes[k++]) {
    const std::size_t n = mesh.sizes[k];
    double middle[5] = {}, uu = 0, uv = 0, vv = 0;
    Vec3 ux{}, vx{};
    const auto at = [&](std::size_t corner, std::size_t c) {
      return c < 2 ? uvs[2 * (from + corner) + c] : mesh.points[3 * std::size_t{mesh.corners[from + corner]} + c - 2];
    };
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < 5; ++c) middle[c] += at(i, c) / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double u = at(i, 0) - middle[0], v = at(i, 1) - middle[1];
      uu += u * u, uv += u * v, vv += v * v;
      for (std::size_t c = 0; c < 3; ++c) ux[c] += u * (at(i, c + 2) - middle[c + 2]), vx[c] += v * (at(i, c + 2) - middle[c + 2]);
    }
    if (!(uu * vv - uv * uv > 1e-12 * uu * vv))
      throw HostError("the texture coordinates of polygon " + number(uint64_t(k)) + " are on a line, so that no direction follows");
    for (std::size_t c = 0; c < 3; ++c) directions.push_back(vv * ux[c] - uv * vx[c]);
  }
  return directions;
}

}  // namespace host

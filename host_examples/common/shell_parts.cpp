#include "shell_parts.hpp"

#include "message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>

namespace host {

namespace {

constexpr double kHalfTurn = 3.141592653589793;

bool is_finite(const std::vector<double> &values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

std::size_t n_polygons(const Mesh &mesh) { return mesh.sizes.empty() ? mesh.n_triangles() : mesh.sizes.size(); }

Vec3 point(const Mesh &mesh, uint32_t i) {
  const double *x = &mesh.points[3 * std::size_t{i}];
  return {x[0], x[1], x[2]};
}
Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double distance_to_edge(const Vec3 &x, const Vec3 &a, const Vec3 &b) {
  const Vec3 along = minus(b, a), from = minus(x, a);
  const double square = dot(along, along), share = square > 0 ? std::clamp(dot(from, along) / square, 0.0, 1.0) : 0;
  const Vec3 off = {from[0] - share * along[0], from[1] - share * along[1], from[2] - share * along[2]};
  return std::sqrt(dot(off, off));
}

double distance_to_triangle(const Mesh &mesh, const Vec3 &x, uint32_t triangle) {
  const uint32_t *corner = &mesh.triangles[3 * std::size_t{triangle}];
  const Vec3 a = point(mesh, corner[0]), b = point(mesh, corner[1]), c = point(mesh, corner[2]);
  const double least = std::min({distance_to_edge(x, a, b), distance_to_edge(x, b, c), distance_to_edge(x, c, a)});
  const Vec3 u = minus(b, a), v = minus(c, a), w = minus(x, a);
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w), det = uu * vv - uv * uv;
  const double s = (vv * uw - uv * vw) / det, t = (uu * vw - uv * uw) / det;
  if (!(det > 0) || s < 0 || t < 0 || s + t > 1) return least;  // beside it
  const Vec3 off = {w[0] - s * u[0] - t * v[0], w[1] - s * u[1] - t * v[1], w[2] - s * u[2] - t * v[2]};
  return std::min(least, std::sqrt(dot(off, off)));
}

// Of those that a polygon was cut into.
uint32_t nearest_triangle(const Mesh &mesh, const Vec3 &x, uint32_t polygon) {
  if (mesh.sizes.empty()) return polygon;
  uint32_t first = 0;
  for (uint32_t k = 0; k < polygon; ++k) first += mesh.sizes[k] - 2;
  uint32_t best = first;
  for (uint32_t t = first + 1; t < first + mesh.sizes[polygon] - 2; ++t)
    if (distance_to_triangle(mesh, x, t) < distance_to_triangle(mesh, x, best)) best = t;
  return best;
}

}  // namespace

ShellParts::ShellParts(const Mesh &mesh, const Build &build) : tie_within_(build.tie_within), rest_shape_(build.rest_shape) {
  add_ties(mesh, build);
  add_axes(mesh, build.axis_supports);
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
    if (!(crease.yield >= 0)) throw HostError(name + " yields at " + number(crease.yield * 180 / kHalfTurn) + " degrees; it must be 0 or above");
    last[{std::min(crease.a, crease.b), std::max(crease.a, crease.b)}] = &crease;
  }
  for (const auto &[edge, crease] : last) {
    creases_.insert(creases_.end(), edge.begin(), edge.end());
    factors_.push_back(crease->factor);
    angles_.push_back(crease->angle.value_or(SW_CREASE_ANGLE_OF_MESH));
    yields_.push_back(crease->yield > 0 ? crease->yield : std::numeric_limits<double>::infinity());
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

void ShellParts::add_ties(const Mesh &mesh, const Build &build) {
  if (!(tie_within_ >= 0) || !std::isfinite(tie_within_)) throw HostError("pieces are tied within " + number(tie_within_) + "; it must be 0 or above");
  const uint64_t n = mesh.n_points();
  for (const Tie &tie : build.ties) {
    const std::string name = "the tie of point " + number(uint64_t(tie.vertex)) + " to " + (tie.to_face ? "polygon " : "point ") + number(uint64_t(tie.to));
    if (tie.vertex >= n || (!tie.to_face && tie.to >= n)) throw HostError(name + ": there are " + number(n) + " points");
    if (tie.to_face && tie.to >= n_polygons(mesh)) throw HostError(name + ": there are " + number(uint64_t(n_polygons(mesh))) + " polygons");
    if (!(tie.stiffness >= 0) || !std::isfinite(tie.stiffness)) throw HostError(name + " has the stiffness " + number(tie.stiffness) + "; it must be 0 or above");
    const uint32_t to = tie.to_face ? nearest_triangle(mesh, point(mesh, tie.vertex), tie.to) : tie.to;
    ties_.insert(ties_.end(), {tie.vertex, to});
    on_triangles_.push_back(tie.to_face ? 1 : 0);
    tie_stiffness_.push_back(tie.stiffness);
  }
}

void ShellParts::add_axes(const Mesh &mesh, const std::vector<AxisSupport> &supports) {
  for (const AxisSupport &support : supports) {
    const std::string name = "the support along axes at point " + number(uint64_t(support.vertex));
    if (support.vertex >= mesh.n_points()) throw HostError(name + ": there are " + number(uint64_t(mesh.n_points())) + " points");
    const uint32_t all = SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z;
    if (((support.axes | support.symmetric) & all) == 0) throw HostError(name + " holds along no axis");
    axis_vertices_.push_back(support.vertex);
    axes_.push_back(static_cast<uint8_t>(support.axes & all));
    symmetric_.push_back(static_cast<uint8_t>(support.symmetric & all));
  }
}

void ShellParts::put(SwMaterialDesc &material, SwSupportDesc &supports) const {
  material.ties = ties_.data(), material.n_ties = static_cast<uint32_t>(ties_.size() / 2);
  material.tie_on_triangles = on_triangles_.data(), material.tie_stiffness = tie_stiffness_.data(), material.tie_distance = tie_within_;
  supports.axis_vertices = axis_vertices_.data(), supports.axes = axes_.data(), supports.symmetric_axes = symmetric_.data(), supports.n_axis_vertices = static_cast<uint32_t>(axis_vertices_.size());
  material.creases = creases_.data(), material.n_creases = static_cast<uint32_t>(creases_.size() / 2);
  material.crease_factors = factors_.data(), material.crease_angles = angles_.data(), material.crease_yields = yields_.data();
  if (!directions_.empty()) {
    material.directions = directions_.data(), material.n_directions = static_cast<uint32_t>(directions_.size() / 3);
    material.direction_format = SW_FORMAT_F64;
  }
  if (!rest_shape_.empty()) material.rest_positions = rest_shape_.data(), material.rest_format = SW_FORMAT_F64;
}

std::vector<double> middles_of(const Mesh &mesh) {
  std::vector<double> middles;
  const std::vector<uint32_t> &corners = mesh.faces();
  for (std::size_t k = 0, from = 0; k < n_polygons(mesh); ++k) {
    const std::size_t n = mesh.sizes.empty() ? 3 : mesh.sizes[k];
    double middle[3] = {};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < 3; ++c) middle[c] += mesh.points[3 * std::size_t{corners[from + i]} + c] / static_cast<double>(n);
    middles.insert(middles.end(), middle, middle + 3);
    from += n;
  }
  return middles;
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

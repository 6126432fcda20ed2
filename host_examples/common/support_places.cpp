#include "support_places.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

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

// The rigid motion that brings vertices nearest to where they are, from `rest`. What vertices on a line leave open does not turn.
Pose motion_of(const std::vector<uint32_t> &vertices, const std::vector<double> &points, const std::vector<double> &rest) {
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

}  // namespace

void SupportPlaces::prepare(const Mesh &mesh, const Build &build) {
  *this = {};
  const std::set<uint32_t> held(build.held.begin(), build.held.end());
  std::map<uint32_t, std::set<uint32_t>> joined;  // to supports, by an edge
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k)
      for (const std::size_t other : {(k + 1) % 3, (k + 2) % 3})
        if (held.count(mesh.triangles[t + other])) joined[mesh.triangles[t + k]].insert(mesh.triangles[t + other]);
  std::map<uint32_t, std::size_t> group;
  for (const uint32_t first : held) {
    if (group.count(first)) continue;
    std::vector<uint32_t> members = {first};
    group[first] = groups_.size();
    for (std::size_t k = 0; k < members.size(); ++k)
      for (const uint32_t next : joined[members[k]])
        if (group.emplace(next, groups_.size()).second) members.push_back(next);
    groups_.push_back(std::move(members));
  }
  std::set<uint32_t> all = held;
  for (const auto &[v, supports] : joined)
    if (build.clamped) all.insert(v);
  vertices_.assign(all.begin(), all.end());
  for (std::size_t at = 0; at < vertices_.size(); ++at) {
    if (held.count(vertices_[at])) continue;
    const std::set<uint32_t> &supports = joined[vertices_[at]];
    neighbours_.push_back({at, {supports.begin(), supports.end()}, group[*supports.begin()]});
  }
}

std::vector<double> SupportPlaces::read(const std::vector<double> &points, const std::vector<double> &rest) const {
  const auto at_rest = [&](uint32_t v) { return point(points, v) == point(rest, v); };
  if (std::all_of(vertices_.begin(), vertices_.end(), at_rest)) return {};
  std::vector<double> places;
  for (const uint32_t v : vertices_) {
    const Vec3 x = point(points, v);
    places.insert(places.end(), x.begin(), x.end());
  }
  std::map<std::size_t, Pose> motions;
  for (const Neighbour &n : neighbours_) {
    const uint32_t v = vertices_[n.at];
    if (!at_rest(v) || std::all_of(n.supports.begin(), n.supports.end(), at_rest)) continue;
    auto motion = motions.find(n.group);
    if (motion == motions.end()) motion = motions.emplace(n.group, motion_of(groups_[n.group], points, rest)).first;
    Vec3 x = host::apply(motion->second, point(rest, v));
    for (const uint32_t s : n.supports)
      x = plus(x, plus(point(points, s), host::apply(motion->second, point(rest, s)), -1), 1 / static_cast<double>(n.supports.size()));
    std::copy(x.begin(), x.end(), &places[3 * n.at]);
  }
  return places;
}

}  // namespace host

#include "support_places.hpp"

#include "rigid_motion.hpp"

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

}  // namespace

std::vector<uint32_t> with_neighbours(const std::vector<uint32_t> &triangles, const std::vector<uint32_t> &vertices) {
  const std::set<uint32_t> named(vertices.begin(), vertices.end());
  std::set<uint32_t> all = named;
  for (std::size_t t = 0; t < triangles.size(); t += 3)
    if (std::any_of(&triangles[t], &triangles[t] + 3, [&](uint32_t v) { return named.count(v) > 0; })) all.insert(&triangles[t], &triangles[t] + 3);
  return {all.begin(), all.end()};
}

std::vector<uint32_t> alone_of(const std::vector<uint32_t> &triangles, const std::vector<uint32_t> &held) {
  const std::set<uint32_t> all(held.begin(), held.end());
  std::set<uint32_t> alone = all;
  for (std::size_t t = 0; t < triangles.size(); t += 3)
    if (std::all_of(&triangles[t], &triangles[t] + 3, [&](uint32_t v) { return all.count(v) > 0; }))
      for (std::size_t k = 0; k < 3; ++k) alone.erase(triangles[t + k]);
  return {alone.begin(), alone.end()};
}

std::vector<uint32_t> held_with_neighbours(const Mesh &mesh, const Build &build) {
  if (!build.clamped) return {};
  return build.proxy && !build.stiffness.by_sheet() ? alone_of(mesh.triangles, build.held) : build.held;
}

void SupportPlaces::prepare(const Mesh &mesh, const Build &build) {
  *this = {};
  const std::set<uint32_t> held(build.held.begin(), build.held.end());
  const std::vector<uint32_t> with = held_with_neighbours(mesh, build);
  const std::set<uint32_t> clamped(with.begin(), with.end());
  std::map<uint32_t, std::set<uint32_t>> joined;  // to supports, by an edge
  std::set<uint32_t> all = held;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k)
      for (const std::size_t other : {(k + 1) % 3, (k + 2) % 3}) {
        if (held.count(mesh.triangles[t + other])) joined[mesh.triangles[t + k]].insert(mesh.triangles[t + other]);
        if (clamped.count(mesh.triangles[t + other])) all.insert(mesh.triangles[t + k]);
      }
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
    if (motion == motions.end()) motion = motions.emplace(n.group, rigid_motion(groups_[n.group], points, rest)).first;
    Vec3 x = host::apply(motion->second, point(rest, v));
    for (const uint32_t s : n.supports)
      x = plus(x, plus(point(points, s), host::apply(motion->second, point(rest, s)), -1), 1 / static_cast<double>(n.supports.size()));
    std::copy(x.begin(), x.end(), &places[3 * n.at]);
  }
  return places;
}

}  // namespace host

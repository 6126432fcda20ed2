#include "follower.hpp"

#include "message.hpp"
#include "nearest.hpp"
#include "shell_parts.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace host {

namespace {

Vec3 point_of(const std::vector<double> &points, uint32_t i) {
  const double *x = &points[3 * std::size_t(i)];
  return {x[0], x[1], x[2]};
}

Vec3 difference(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

}  // namespace

uint32_t Follower::nearest(const Request &request, uint32_t drawn) {
  const auto known = nearest_.find(drawn);
  if (known != nearest_.end()) return known->second;
  const Vec3 x = point_of(request.drawn, drawn);
  uint32_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < request.mesh.n_points(); ++i) {
    const Vec3 d = difference(point_of(request.mesh.points, i), x);
    const double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (squared < least) least = squared, best = i;
  }
  nearest_[drawn] = best;
  return best;
}

// A handle's target is that of the drawn vertex, beside which the simulated one stands: by as much as at rest, turned as the handle
// turns it, or the object.
void Follower::lead(Request &request, bool anew) {
  if (anew) nearest_.clear();
  const uint64_t n = request.drawn.size() / 3;
  const auto check = [n](const std::string &what, uint32_t vertex) {
    if (vertex >= n)
      throw HostError(what + " vertex " + number(uint64_t(vertex)) + ", but there are " + number(n));
  };
  if (request.mesh.points.empty()) return;  // the caller says so
  const auto lead_all = [&](const char *what, std::vector<uint32_t> &vertices) {
    for (uint32_t &vertex : vertices) {
      check(what, vertex);
      vertex = nearest(request, vertex);
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  };
  lead_all("the supports have", request.build.held);
  lead_all("the contact patches have", request.build.contact_patches);
  for (AxisSupport &support : request.build.axis_supports) {
    check("the supports along axes have", support.vertex);
    support.vertex = nearest(request, support.vertex);
  }
  lead_ties(request);
  lead_forces(request);
  lead_maps(request, anew);
  for (std::size_t k = 0; k < request.inputs.handles.size(); ++k) {
    Handle &handle = request.inputs.handles[k];
    check("handle " + number(uint64_t(k)) + " holds", handle.vertex);
    const uint32_t vertex = nearest(request, handle.vertex);
    Pose turn = handle.orientation ? handle.target : request.inputs.object;
    turn.origin = handle.target.origin;
    turn.scale = request.inputs.object.scale;
    handle.target.origin =
        host::apply(turn, difference(point_of(request.mesh.points, vertex), point_of(request.drawn, handle.vertex)));
    handle.vertex = vertex;
  }
}

// On each vertex of the mesh all that pulls at those that it is nearest to.
void Follower::lead_forces(Request &request) {
  const std::vector<double> pulled = std::move(request.inputs.forces);
  request.inputs.forces.clear();
  if (pulled.size() != request.drawn.size() || pulled.empty()) {
    if (!pulled.empty())
      throw HostError("there are forces on " + number(uint64_t(pulled.size() / 3)) + " points, but " + number(uint64_t(request.drawn.size() / 3)) + " points");
    return;
  }
  request.inputs.forces.assign(request.mesh.points.size(), 0);
  for (std::size_t i = 0; i < pulled.size(); i += 3) {
    if (pulled[i] == 0 && pulled[i + 1] == 0 && pulled[i + 2] == 0) continue;
    const std::size_t at = 3 * std::size_t{nearest(request, static_cast<uint32_t>(i / 3))};
    for (std::size_t c = 0; c < 3; ++c) request.inputs.forces[at + c] += pulled[i + c];
  }
}

void Follower::lead_maps(Request &request, bool anew) {
  if (anew) point_at_.clear(), polygon_at_.clear();
  const std::size_t n = request.drawn.size() / 3;
  Stiffness &s = request.build.stiffness;
  const std::pair<const char *, std::vector<double> *> maps[] = {
      {"thickness", &s.thickness_map}, {"Young's modulus", &s.young_map}, {"density", &s.density_map}, {"growth", &s.growth_map},
      {"bending", &s.bend_map}, {"stretching", &s.stretch_map}, {"damping", &request.motion.damping_map}};
  for (const auto &[what, map] : maps) {
    if (map->empty()) continue;
    if (map->size() != n)
      throw HostError(std::string("the map of the ") + what + " has " + number(uint64_t(map->size())) + " values, what is drawn " + number(uint64_t(n)) + " points");
    if (point_at_.size() != request.mesh.n_points()) point_at_ = nearest_of(request.drawn, request.mesh.points);
    std::vector<double> led;
    for (const uint32_t point : point_at_) led.push_back((*map)[point]);
    *map = std::move(led);
  }
  if (std::vector<double> &air = request.inputs.wind.local; !air.empty()) {
    if (air.size() != request.drawn.size())
      throw HostError("there is wind at " + number(uint64_t(air.size() / 3)) + " points, but " + number(uint64_t(n)) + " points are drawn");
    if (point_at_.size() != request.mesh.n_points()) point_at_ = nearest_of(request.drawn, request.mesh.points);
    std::vector<double> led;
    for (const uint32_t point : point_at_) led.insert(led.end(), &air[3 * std::size_t{point}], &air[3 * std::size_t{point}] + 3);
    air = std::move(led);
  }
  if (s.directions.size() <= 3) return;  // one, everywhere
  if (s.directions.size() != s.middles.size())
    throw HostError("there are " + number(uint64_t(s.directions.size() / 3)) + " directions of Young's modulus, and " + number(uint64_t(s.middles.size() / 3)) + " polygons are drawn");
  const std::vector<double> middles = middles_of(request.mesh);
  if (polygon_at_.size() != middles.size() / 3) polygon_at_ = nearest_of(s.middles, middles);
  std::vector<double> led;
  for (const uint32_t polygon : polygon_at_) led.insert(led.end(), &s.directions[3 * std::size_t{polygon}], &s.directions[3 * std::size_t{polygon}] + 3);
  s.directions = std::move(led);
}

// Two that are one vertex of the mesh are together already.
void Follower::lead_ties(Request &request) {
  const uint64_t n = request.drawn.size() / 3;
  std::vector<Tie> ties;
  for (Tie tie : request.build.ties) {
    if (tie.vertex >= n || tie.to >= n)
      throw HostError("a tie has point " + number(uint64_t(std::max(tie.vertex, tie.to))) + ", but there are " + number(n));
    tie.vertex = nearest(request, tie.vertex), tie.to = nearest(request, tie.to);
    if (tie.vertex != tie.to) ties.push_back(tie);
  }
  request.build.ties = std::move(ties);
}

void Follower::carry(const Request &request, const std::vector<double> &rest, std::vector<double> &points) const {
  if (rest_.size() != request.drawn.size()) return;
  for (const auto &[drawn, vertex] : nearest_) {
    if (point_of(points, vertex) != point_of(rest, vertex)) continue;
    const Vec3 way = difference(point_of(request.drawn, drawn), point_of(rest_, drawn));
    for (std::size_t k = 0; k < 3; ++k) points[3 * std::size_t{vertex} + k] += way[k];
  }
}

void Follower::bind(const shellwarp::Model &model, const std::vector<double> &points) {
  SwBindingDesc desc = shellwarp::binding_desc();
  desc.format = SW_FORMAT_F64;
  desc.points = points.data();
  desc.n_points = static_cast<uint32_t>(points.size() / 3);
  binding_ = shellwarp::Binding(model, desc);
  rest_ = points;
}

void Follower::release() {
  binding_.reset();
  rest_.clear();
}

uint64_t Follower::bytes() const { return binding_ ? binding_->info().bytes + rest_.capacity() * sizeof(double) : 0; }

std::vector<double> Follower::read(const shellwarp::State &state, uint32_t space, const Moved &moved, std::vector<double> *velocities) const {
  std::vector<double> points(rest_.size());
  if (velocities) velocities->resize(rest_.size());
  SwBoundPointsDesc desc = shellwarp::bound_points_desc();
  desc.space = space;
  desc.format = SW_FORMAT_F64;
  desc.positions = points.data();
  desc.velocities = velocities ? velocities->data() : nullptr;
  desc.correction_steps = moved.correction_steps;
  desc.flags = moved.outside ? SW_BOUND_OUTSIDE : 0;
  desc.deepest = moved.deepest;
  state.bound_points(*binding_, desc);
  return points;
}

}  // namespace host

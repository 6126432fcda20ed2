#include "handle_motion.hpp"

#include "judge.hpp"
#include "selection.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace cli {

namespace {

using Vec3 = std::array<double, 3>;

constexpr double kSameTime = 1e-9;  // s: sums of steps are compared with times that someone wrote

double sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

// Steffen's slope at a key with the slopes before and after it, over h0 and h1 seconds.
double slope_at_key(double before, double after, double h0, double h1) {
  const double parabola = (before * h1 + after * h0) / (h0 + h1);
  return (sign(before) + sign(after)) * std::min({std::fabs(before), std::fabs(after), std::fabs(parabola) / 2});
}

// One component of the keys at a time that lies between keys k and k + 1.
template <class Component>
double interpolate(const std::vector<HandleKey> &keys, std::size_t k, double seconds, Component component) {
  const auto value = [&](std::size_t i) { return component(keys[i]); };
  const auto length = [&](std::size_t i) { return keys[i + 1].time - keys[i].time; };
  const auto slope = [&](std::size_t i) { return (value(i + 1) - value(i)) / length(i); };
  const auto velocity = [&](std::size_t i) {
    if (i == 0 || i + 1 == keys.size()) return 0.0;
    return slope_at_key(slope(i - 1), slope(i), length(i - 1), length(i));
  };
  const double h = length(k), s = (seconds - keys[k].time) / h;
  const double v0 = velocity(k), v1 = velocity(k + 1), mean = slope(k);
  return value(k) + h * s * (v0 + s * (3 * mean - 2 * v0 - v1 + s * (v0 + v1 - 2 * mean)));
}

// From here the handle is at rest at time 0.
std::vector<HandleKey> with_start(const std::vector<HandleKey> &keys) {
  std::vector<HandleKey> all = keys;
  if (all.empty() || all.front().time > 0) all.insert(all.begin(), HandleKey{});
  return all;
}

void set_constraints(const PlacedHandle &placed, uint32_t first_id, double seconds, shellwarp::State &state) {
  const Handle &handle = placed.handle;
  SwConstraintDesc desc = shellwarp::constraint_desc();
  desc.vertex = placed.vertex;
  desc.axes = handle.axes;
  desc.compliance = handle.compliance;
  const Vec3 position = placed.position(seconds);
  const std::array<double, 9> rotation = placed.rotation(seconds);
  std::copy(position.begin(), position.end(), desc.position);
  std::copy(rotation.begin(), rotation.end(), desc.rotation);
  const std::pair<bool, uint32_t> kinds[] = {{handle.holds_position, SW_CONSTRAINT_POSITION},
                                             {handle.holds_orientation, SW_CONSTRAINT_ORIENTATION}};
  for (uint32_t k = 0; k < 2; ++k) {
    desc.id = first_id + k;
    desc.kind = kinds[k].second;
    if (kinds[k].first) state.set_constraint(desc);
  }
}

void clear_constraints(const Handle &handle, uint32_t first_id, shellwarp::State &state) {
  if (handle.holds_position) state.clear_constraint(first_id);
  if (handle.holds_orientation) state.clear_constraint(first_id + 1);
}

}  // namespace

bool Handle::held(double seconds) const { return !release || seconds <= *release + kSameTime; }

HandleKey key_at(const std::vector<HandleKey> &keys, double seconds) {
  const std::vector<HandleKey> all = with_start(keys);
  if (seconds <= all.front().time) return all.front();
  if (seconds >= all.back().time) return all.back();
  std::size_t k = 0;
  while (seconds >= all[k + 1].time) ++k;
  HandleKey target{seconds, {}, {}};
  for (std::size_t i = 0; i < 3; ++i) {
    target.offset[i] = interpolate(all, k, seconds, [i](const HandleKey &key) { return key.offset[i]; });
    target.rotation[i] = interpolate(all, k, seconds, [i](const HandleKey &key) { return key.rotation[i]; });
  }
  return target;
}

std::array<double, 3> PlacedHandle::position(double seconds) const {
  const Vec3 offset = handle.target(seconds).offset;
  const Vec3 place = {rest[0] + offset[0], rest[1] + offset[1], rest[2] + offset[2]};
  return handle.bone ? transform(handle.bone->pose(seconds), place) : place;
}

std::array<double, 9> PlacedHandle::rotation(double seconds) const {
  const std::array<double, 9> own = rotation_matrix(handle.target(seconds).rotation);
  return handle.bone ? product(handle.bone->pose(seconds).rotation, own.data()) : own;
}

namespace {

// A place that is so many times the mesh's width from it is in another unit.
constexpr double kElsewhere = 10;

// Whether it is named by a place.
bool by_place(const Handle &handle) { return !handle.vertex && !handle.side && handle.group.empty(); }

double distance(const Vec3 &a, const Vec3 &b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

uint32_t vertex_of(const Handle &handle, const Mesh &mesh) {
  if (handle.vertex) return mesh.of(*handle.vertex);
  if (handle.side) return middle_vertex(vertices_at(*handle.side, mesh), mesh);
  return handle.group.empty() ? nearest_vertex(handle.nearest, mesh)
                              : middle_vertex(vertices_of_group(handle.group, mesh), mesh);
}

}  // namespace

std::vector<PlacedHandle> place_handles(const std::vector<Handle> &handles, const Mesh &mesh) {
  std::vector<PlacedHandle> placed;
  for (const Handle &handle : handles) {
    const uint32_t vertex = vertex_of(handle, mesh);
    if (vertex >= mesh.n_vertices())
      throw std::runtime_error("handle " + std::to_string(placed.size() + 1) + " is at vertex " +
                               std::to_string(vertex) + ", but the mesh has " + std::to_string(mesh.n_vertices()) +
                               " vertices, counted from 0");
    placed.push_back({handle, vertex, mesh.vertex(vertex)});
    const double off = by_place(handle) ? distance(handle.nearest, placed.back().rest) : 0;
    if (off > kElsewhere * longest_side(mesh))
      throw std::runtime_error(format("handle %zu: its place is %.3g from the mesh, which is %.3g wide; places and offsets are in scaled units, not the file's",
                                      placed.size(), off, longest_side(mesh)));
  }
  return placed;
}

std::vector<std::string> found_vertices(const std::vector<PlacedHandle> &placed) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < placed.size(); ++k)
    if (placed[k].handle.side || !placed[k].handle.group.empty())
      words.push_back(format("handle %zu leads one vertex, %u, in the middle of what is named", k + 1, placed[k].vertex));
    else if (by_place(placed[k].handle))
      words.push_back(format("handle %zu leads vertex %u, %.3g from the place that was named", k + 1, placed[k].vertex, distance(placed[k].handle.nearest, placed[k].rest)));
  return words;
}

void move_handles(std::vector<PlacedHandle> &handles, double seconds, shellwarp::State &state) {
  for (std::size_t k = 0; k < handles.size(); ++k) {
    const uint32_t first_id = static_cast<uint32_t>(2 * k);
    const bool held = handles[k].handle.held(seconds);
    if (held) set_constraints(handles[k], first_id, seconds, state);
    if (handles[k].in_hand && !held) clear_constraints(handles[k].handle, first_id, state);
    handles[k].in_hand = held;
  }
}

}  // namespace cli

// A handle: a vertex that is led by the hand along keyframes, and later perhaps let go.
//
//   target position     = rest position + offset(t)      world axes
//   target orientation  = exp[r(t)]×                     world axes, the identity at rest
//
// and then as a bone moves, where the handle is attached to one: it takes both the position and the orientation with it.
//
// offset and r go through the keys with a continuous velocity, and never beyond the keys on either side: where a number turns
// back, stays or ends, its velocity is 0 (M. Steffen, A simple method for monotonic interpolation in one dimension, 1990).
#pragma once

#include "frame_motion.hpp"
#include "mesh.hpp"
#include "shellwarp.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cli {

// Of a handle's or a collider's way.
struct HandleKey {
  double time = 0;  // s
  std::array<double, 3> offset{};
  std::array<double, 3> rotation{};  // rotation vector, radians
};

// Offset and rotation at a time; before the first key and after the last as there. At rest at time 0 unless there is a key.
HandleKey key_at(const std::vector<HandleKey> &keys, double seconds);

struct Handle {
  std::optional<uint32_t> vertex;   // or else
  std::array<double, 3> nearest{};  // the vertex next to this point, unless there is
  std::optional<Side> side;         // the middle of a side, or
  std::string group;                // of a group
  bool holds_position = true, holds_orientation = false;
  uint32_t axes = SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z;
  double compliance = 0;                    // length/force, rad/torque
  std::optional<double> release;            // s; never where missing
  std::vector<HandleKey> keys;              // by ascending time
  std::shared_ptr<const FrameMotion> bone;  // carries the targets; null = the world

  bool held(double seconds) const;
  HandleKey target(double seconds) const { return key_at(keys, seconds); }
};

// A handle on a mesh.
struct PlacedHandle {
  Handle handle;
  uint32_t vertex = 0;
  std::array<double, 3> rest{};
  bool in_hand = false;  // its constraints are set

  std::array<double, 3> position(double seconds) const;
  std::array<double, 9> rotation(double seconds) const;  // row-major matrix
};

// Throws where a vertex is not in the mesh.
std::vector<PlacedHandle> place_handles(const std::vector<Handle> &handles, const Mesh &mesh);

// Of handles that are named by a place: which vertex that is, a line each.
std::vector<std::string> found_vertices(const std::vector<PlacedHandle> &placed);

// Puts every handle where it is to be at the end of the next step, and lets go of those whose time is over. Handle k has the
// constraints 2 k (position) and 2 k + 1 (orientation).
void move_handles(std::vector<PlacedHandle> &handles, double seconds, shellwarp::State &state);

}  // namespace cli

// A collider: a solid that shells touch, where it stands, and how it moves along keys, as a handle does.
//
//   rotation = exp[r(t)]× exp[rotation]×      from the collider's axes to the world's
//   origin   = position + offset(t)           world axes
//
// and then as a bone moves, where one carries it. offset and r go through the keys as in handle_motion.hpp.
#pragma once

#include "frame_motion.hpp"
#include "handle_motion.hpp"
#include "moving_points.hpp"
#include "shellwarp.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cli {

class Section;

// See SwColliderDesc.
struct Collider {
  uint32_t kind = SW_COLLIDER_PLANE;
  double radius = 0, half_length = 0;
  std::array<double, 3> half_extents{};
  std::string mesh_path;  // of a hull or mesh
  std::string motion_path;  // of one that deforms: see moving_points.hpp
  uint32_t cells = 0;
  bool one_sided = false;  // of a mesh or one that deforms: it may be open, and is solid behind its triangles by the depth
  double depth = 0;        // 0 = the library's default
  double friction = 0, thickness = 0;
  std::array<double, 3> position{};
  std::array<double, 3> rotation{};  // rotation vector, radians
  std::vector<HandleKey> keys;       // by ascending time
  std::shared_ptr<const FrameMotion> bone;                // carries it; null = the world
  std::shared_ptr<const shellwarp::Collider> solid = {};  // what states share, once prepare_colliders has made it
  std::shared_ptr<const MovingPoints> points = {};        // of one that deforms, once it has

  bool deforms() const { return !motion_path.empty(); }
  bool moves() const { return deforms() || !keys.empty() || (bone && bone->moves()); }
  SwColliderPoseDesc pose(double seconds) const;
};

// "plane", "sphere" … in the order of SW_COLLIDER_…, which count from 1.
std::vector<std::string> collider_kinds();

// The rotation vector that turns the z axis to a direction, which must not be 0.
std::array<double, 3> rotation_to(const std::array<double, 3> &direction);

// All of a [[collider]] but what moves it. A file that is named is added to `inputs`.
Collider read_collider(Section &section, std::vector<std::string> &inputs);

bool any_moves(const std::vector<Collider> &colliders);

// Makes the solids, reading the files of hulls and meshes; `scale` is the factor on their coordinates. Up to seconds a mesh. Throws
// where one cannot be made, with its number from 1 and its file.
void prepare_colliders(std::vector<Collider> &colliders, double scale);

// Gives a state the prepared colliders, placed as at time 0.
void set_colliders(const std::vector<Collider> &colliders, double frame_rate, shellwarp::State &state);

// Puts those that move where they are to be at the end of the next step, and gives those that deform their shapes.
void move_colliders(const std::vector<Collider> &colliders, double seconds, double frame_rate, shellwarp::State &state);

// The shapes alone. `teleport`: they are so at once.
void deform_colliders(const std::vector<Collider> &colliders, double seconds, double frame_rate, shellwarp::State &state, bool teleport);

}  // namespace cli

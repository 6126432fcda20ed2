// The solids that a shell touches: one object of the library each, made anew only where its shape changes. Points that move as one are
// the pose's, and those of a mesh that deforms are sent every step.
#pragma once

#include "request.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace host {

// From the scene's world to the library's: into the object's space, where the shell is seen, and on with the frame that shakes it.
Pose to_library(const Inputs &inputs, double unit);

// Equal for equal points and settings, wherever the solid is.
uint64_t shape_key(const Collider &collider);

class ColliderSet {
public:
  // Makes what is not there yet. `unit` is the scene's lengths in one of the object's. True where a state needs the solids again.
  // Of colliders whose points have moved as one, the points become those that the solid was made of, and the motion goes to the pose.
  // Throws HostError naming the collider.
  bool prepare(std::vector<Collider> &colliders, double unit);

  std::vector<const SwCollider *> solids() const;
  // An origin and a rotation matrix (12 numbers) of each, in a space that the scene's world has this pose in.
  std::vector<double> poses(const Inputs &inputs, const Pose &world) const;
  void place(shellwarp::State &state, const Inputs &inputs, double unit, bool teleport) const;
  // The shapes alone, at once, of what deforms.
  void deform(shellwarp::State &state, const Inputs &inputs, double unit, bool teleport) const;
  static bool deforms(const std::vector<Collider> &colliders);
  uint64_t made() const { return made_; }  // so far

private:
  struct Solid {
    uint64_t key, look;  // of the shape; and of all but its points
    std::vector<double> points;  // that it was made of
    shellwarp::Collider solid;
    Pose local;  // from the library's axes of the shape to those of the host's mesh, in lengths of the scene
  };

  Pose pose_of(const Inputs &inputs, const Pose &world, std::size_t k) const;

  std::vector<Solid> solids_;
  uint64_t made_ = 0;
};

}  // namespace host

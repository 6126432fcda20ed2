// Supports that move along keys, each about a centre of its own, and then as the frame moves.
//
//   x = motion( c + offset(t) + exp[r(t)]× (X − c) )      offset and r go through the keys as in handle_motion.hpp
//
// A vertex of several supports goes with the last of them. Supports without keys go with the frame. Or files say where all vertices of the
// mesh are: that of its supports, or of all as a rest shape that moves.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace cli {

// Whether some have keys, so that they move against each other or the frame.
bool any_moves(const std::vector<Support> &supports);
// That, or files move the mesh.
bool any_moves(const Scene &scene);

class SupportMotion {
public:
  // Costs nothing where nothing moves against the frame. Throws as find_supports does.
  SupportMotion(const Scene &scene, const Mesh &mesh);

  // Puts the supports, or the frame where none has keys and it moves, where they are to be at the end of the next step.
  void move(double seconds, shellwarp::State &state, bool teleport = false);
  // Where they are before the first step.
  void begin(shellwarp::State &state);
  // Puts a rest shape that moves where it is at a time, at rest: a saved state has it not.
  void bring_rest(double seconds, shellwarp::State &state);

  // Where the scene's files have each vertex, n x 3.
  std::vector<double> animated(double seconds) const;

private:
  struct Led {
    std::vector<uint32_t> vertices;  // with the neighbours that a clamp holds
    std::array<double, 3> about;
    const std::vector<HandleKey> *keys;
  };

  const Scene &scene_;
  const Mesh &mesh_;
  std::vector<Led> led_;
  std::vector<double> positions_;
};

}  // namespace cli

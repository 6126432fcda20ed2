// Supports that move along keys, each about a centre of its own, and then as the frame moves.
//
//   x = motion( c + offset(t) + exp[r(t)]× (X − c) )      offset and r go through the keys as in handle_motion.hpp
//
// A vertex of several supports goes with the last of them. Supports without keys go with the frame.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace cli {

// Whether some have keys, so that they move against each other or the frame.
bool any_moves(const std::vector<Support> &supports);

class SupportMotion {
public:
  // Costs nothing where no support has keys. Throws as find_supports does.
  SupportMotion(const Scene &scene, const Mesh &mesh);

  // Puts the supports, or the frame where none has keys and it moves, where they are to be at the end of the next step.
  void move(double seconds, shellwarp::State &state);

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

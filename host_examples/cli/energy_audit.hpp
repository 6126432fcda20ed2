// Whether a shell's energy grows by itself. Under loads that do not change, the sum of kinetic and elastic energy less the
// work of the loads,
//
//   E = E_kinetic + E_elastic − Σ (m g + F) · u,
//
// can only fall: damping takes of it, and so does backward Euler. m is the mass as the library lumps it, a third of each
// triangle's on each corner.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <vector>

namespace cli {

class EnergyAudit {
public:
  EnergyAudit(const Scene &scene, const Mesh &mesh);

  // False where something else does work on the shell: wind, handles, a moving frame or collider.
  bool applies() const { return applies_; }
  // Notes the energy of a frame.
  void note(uint32_t frame, const shellwarp::State &state, const SwStateReport &report);
  // The most gained from one frame to the next, as a fraction of the most work done by the loads or the first energy.
  double largest_gain() const;
  uint32_t frame_of_gain() const { return frame_; }

private:
  bool applies_;
  const Mesh &mesh_;
  std::vector<double> load_;  // n_vertices x 3
  std::vector<double> positions_;
  bool begun_ = false;
  double last_ = 0, gain_ = 0, scale_ = 0;
  uint32_t frame_ = 0;
};

}  // namespace cli

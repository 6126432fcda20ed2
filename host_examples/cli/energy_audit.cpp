#include "energy_audit.hpp"

#include "creases.hpp"
#include "material_maps.hpp"
#include "support_motion.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

EnergyAudit::EnergyAudit(const Scene &scene, const Mesh &mesh)
    : applies_(!scene.loads.wind && scene.handles.empty() && !scene.motion.moves() && !any_moves(scene.colliders) && !any_moves(scene)),
      mesh_(mesh),
      load_(mesh.positions.size()),
      positions_(mesh.positions.size()) {
  if (!applies_) return;
  const std::vector<double> masses = masses_per_area(scene.material, mesh);
  const std::vector<double> rest = rest_positions(scene, mesh);  // whose areas give the masses
  const std::vector<uint32_t> &t = mesh.triangles;
  for (std::size_t k = 0; k < t.size(); k += 3) {
    const double area = triangle_area(rest.empty() ? mesh.positions : rest, &t[k]);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 3; ++i) load_[3 * std::size_t{t[k + c]} + i] += masses[k / 3] * area / 3 * scene.gravity[i];
  }
  for (const PlacedForce &force : place_forces(scene.loads.forces, mesh))
    for (std::size_t i = 0; i < 3; ++i) load_[3 * std::size_t{force.vertex} + i] += force.vector[i];
}

void EnergyAudit::note(uint32_t frame, const shellwarp::State &state, const SwStateReport &report) {
  if (!applies_) return;
  state.positions(positions_.data(), mesh_.n_vertices());
  double work = 0;
  for (std::size_t i = 0; i < load_.size(); ++i) work += load_[i] * (positions_[i] - mesh_.positions[i]);
  const double energy = report.kinetic_energy + report.elastic_energy - work;
  scale_ = std::max({scale_, std::fabs(work), std::fabs(energy)});
  if (begun_ && energy - last_ > gain_) {
    gain_ = energy - last_;
    frame_ = frame;
  }
  last_ = energy;
  begun_ = true;
}

double EnergyAudit::largest_gain() const { return scale_ > 0 ? gain_ / scale_ : 0; }

}  // namespace cli

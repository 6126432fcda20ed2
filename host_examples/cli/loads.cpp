#include "loads.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace cli {

std::vector<PlacedForce> place_forces(const std::vector<Force> &forces, const Mesh &mesh) {
  std::vector<PlacedForce> placed;
  for (const Force &force : forces) {
    const uint32_t vertex = force.vertex ? mesh.of(*force.vertex) : nearest_vertex(force.nearest, mesh);
    if (vertex >= mesh.n_vertices())
      throw std::runtime_error("force " + std::to_string(placed.size() + 1) + " is on vertex " +
                               std::to_string(vertex) + ", but the mesh has " + std::to_string(mesh.n_vertices()) +
                               " vertices, counted from 0");
    placed.push_back({vertex, force.vector});
  }
  return placed;
}

void set_loads(const Loads &loads, const Mesh &mesh, shellwarp::State &state) {
  std::vector<uint32_t> vertices;
  std::vector<double> vectors;
  for (const PlacedForce &force : place_forces(loads.forces, mesh)) {
    vertices.push_back(force.vertex);
    vectors.insert(vectors.end(), force.vector.begin(), force.vector.end());
  }
  const uint32_t count = static_cast<uint32_t>(vertices.size());
  if (count) state.set_forces(shellwarp::force_desc(vectors.data(), count, vertices.data()));
  if (!loads.wind) return;
  SwWindDesc wind = shellwarp::wind_desc();
  std::copy(loads.wind->velocity.begin(), loads.wind->velocity.end(), wind.velocity);
  wind.density = loads.wind->density;
  wind.normal_drag = loads.wind->normal_drag;
  wind.tangential_drag = loads.wind->tangential_drag;
  state.set_wind(wind);
}

}  // namespace cli

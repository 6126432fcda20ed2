#include "loads.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace cli {

namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kGusts = 4;
constexpr double kSpacing = 1.618;  // of their frequencies, and phases: not a whole number, so that they do not repeat together

}  // namespace

double strength(const Wind &wind, double seconds) {
  double sum = 0;
  for (int k = 0; k < kGusts; ++k) sum += std::sin(kTurn * (wind.gust_frequency * (1 + k * kSpacing) * seconds + k * kSpacing));
  return 1 + wind.gust * sum / std::sqrt(kGusts / 2.0);
}

void blow(const Wind &wind, double seconds, shellwarp::State &state) {
  SwWindDesc desc = shellwarp::wind_desc();
  for (int axis = 0; axis < 3; ++axis) desc.velocity[axis] = strength(wind, seconds) * wind.velocity[axis];
  desc.density = wind.density;
  desc.normal_drag = wind.normal_drag;
  desc.tangential_drag = wind.tangential_drag;
  state.set_wind(desc);
}

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
  if (loads.wind) blow(*loads.wind, 0, state);
}

}  // namespace cli

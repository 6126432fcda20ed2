// Loads beside gravity: forces on vertices, constant in time, and wind, steady or in gusts.
#pragma once

#include "mesh.hpp"
#include "shellwarp.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace cli {

struct Force {
  std::optional<uint32_t> vertex;   // or else
  std::array<double, 3> nearest{};  // the vertex next to this point
  std::array<double, 3> vector{};   // world axes
};

// See SwWindDesc.
struct Wind {
  std::array<double, 3> velocity{};
  double density = 1.2;  // kg/m3: see air_density
  double normal_drag = 1, tangential_drag = 0;
  double gust = 0, gust_frequency = 0.5;  // see strength
};

// Factor on the velocity at a time: 1 + gust × four sinusoids, the slowest of gust_frequency Hz, as in the farm.
double strength(const Wind &wind, double seconds);

// The wind of a time.
void blow(const Wind &wind, double seconds, shellwarp::State &state);

struct Loads {
  std::vector<Force> forces;
  std::optional<Wind> wind;
};

// A force on a vertex of a mesh.
struct PlacedForce {
  uint32_t vertex;
  std::array<double, 3> vector;
};

// Throws where a vertex is not in the mesh.
std::vector<PlacedForce> place_forces(const std::vector<Force> &forces, const Mesh &mesh);

// As they are at the start.
void set_loads(const Loads &loads, const Mesh &mesh, shellwarp::State &state);

}  // namespace cli

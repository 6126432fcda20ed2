// See README.md here.
#include "shellwarp.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <vector>

namespace {

constexpr uint32_t kRows = 31, kColumns = 4, kVertices = kRows * kColumns;
constexpr int kFrames = 60;

std::vector<float> strip_points() {
  std::vector<float> points;
  for (uint32_t i = 0; i < kRows; ++i)
    for (uint32_t j = 0; j < kColumns; ++j) points.insert(points.end(), {i / 64.0f, j / 64.0f, 0.0f});
  return points;
}

std::vector<uint32_t> strip_triangles() {
  std::vector<uint32_t> triangles;
  for (uint32_t i = 0; i + 1 < kRows; ++i)
    for (uint32_t a = kColumns * i; a < kColumns * i + kColumns - 1; ++a)
      triangles.insert(triangles.end(), {a, a + 4, a + 5, a, a + 5, a + 1});
  return triangles;
}

shellwarp::Model make_model(const std::vector<float> &points, const std::vector<uint32_t> &triangles) {
  SwMaterialDesc card = shellwarp::material_desc();
  card.area_density = 0.25;
  card.k_bend = 1.0 / 256;
  card.k_area = card.k_length = 4096;
  const std::array<uint32_t, 8> held{0, 1, 2, 3, 4, 5, 6, 7};
  SwSupportDesc supports = shellwarp::support_desc();
  supports.fixed = held.data();
  supports.n_fixed = held.size();
  const auto n_triangles = static_cast<uint32_t>(triangles.size() / 3);
  shellwarp::Model model(shellwarp::mesh_desc(points.data(), kVertices, triangles.data(), n_triangles), card, supports);
  SwPrecomputeDesc precompute = shellwarp::precompute_desc();
  precompute.modes = 12;
  model.precompute(precompute);
  return model;
}

void run(shellwarp::State &state) {
  state.set_gravity(0, 1, -8);
  const double ratio = 0.125;
  SwDampingDesc damping = shellwarp::damping_desc();
  damping.ratios = &ratio;
  damping.n_ratios = 1;
  state.set_damping(damping);
  SwConstraintDesc handle = shellwarp::constraint_desc();
  handle.id = 7;
  handle.kind = SW_CONSTRAINT_POSITION;
  handle.vertex = kVertices - 1;
  handle.axes = SW_AXIS_Z;
  for (int frame = 1; frame <= kFrames; ++frame) {
    handle.position[2] = frame / 1024.0;
    state.set_constraint(handle);
    state.step(1.0 / 32);
  }
}

}  // namespace

int main(int argc, char **argv) try {
  if (argc != 2) return 2;
  std::vector<float> points = strip_points();
  const shellwarp::Model model = make_model(points, strip_triangles());
  shellwarp::State state(model);
  run(state);
  state.positions(points.data(), kVertices);
  std::ofstream file(argv[1], std::ios::binary);
  file.write(reinterpret_cast<const char *>(points.data()), static_cast<std::streamsize>(4 * points.size()));
  std::printf("shellwarp %s: the led corner is %.6f high\n", sw_version_string(), points.back());
  return file.flush() ? 0 : 1;
} catch (const std::exception &error) {
  std::cerr << error.what() << '\n';
  return 1;
}

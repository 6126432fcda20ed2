// Equilibria of several methods side by side over a sweep of gravity and of bending stiffness (the paper's figures 4 to 6),
// each against the equilibrium of the nonlinear shell:
//
//   error       = |u − u_shell| / |u_shell|     over the displacements u of all vertices
//   area change = sum of areas / sum of rest areas − 1
//
// For a scene called NAME, files are written beside NAME_rest.obj:
//
//   NAME_comparison.csv    a row for each equilibrium: bending, gravity, method, error, area_change, residual, turn_in_range,
//                          max_displacement, obj
//   NAME_2_warp.obj        the shape, of the case counted from 0 and the method, as the column obj says
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"

#include <string>
#include <vector>

namespace cli {

struct ComparisonRow {
  std::size_t case_number;  // counts pairs of bending and gravity, gravity fastest
  double bending, gravity;  // factor on the scene's stiffness; length unit/s^2
  uint32_t method;
  bool found = false;  // all below is 0 where there is no equilibrium
  double error = 0, area_change = 0, residual = 0, max_displacement = 0;
  bool turn_in_range = false;
  std::vector<double> positions;
};

struct ComparisonRun {
  SwModelInfo info;                 // of the first bending stiffness
  std::vector<double> frequencies;  // the same
  std::vector<ComparisonRow> rows;  // the nonlinear shell first in each case
};

ComparisonRun compare(const Scene &scene, const Mesh &mesh, bool quiet);

void write_comparison(OutputFolder &folder, const Scene &scene, const Mesh &mesh, const ComparisonRun &run);
void print_comparison(const Scene &scene, const ComparisonRun &run);

// A sentence for each expectation that does not hold.
std::vector<std::string> violations(const Scene &scene, const ComparisonRun &run);

}  // namespace cli

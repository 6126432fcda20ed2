// The plain table at the end of a run, and the judgement of what the scene expects.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <string>
#include <vector>

namespace cli {

struct Summary {
  const Scene &scene;
  SwModelInfo info;
  std::vector<double> frequencies;
  const Run &run;
  std::vector<SwFrontPoint> front;  // of a method that was chosen for the scene
};

// The figures to stdout; a third column holds another's figures where the scene states them.
void print_summary(const Summary &summary);

// What the estimate of the last frame's error means, a sentence; empty where there is nothing to say.
std::string verdict(const Run &run);

// A sentence for each expectation that does not hold. What depends on the length of the run is judged only if `whole`.
std::vector<std::string> violations(const Summary &summary, bool whole);

}  // namespace cli

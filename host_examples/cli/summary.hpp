// The plain table at the end of a run, and the judgement of what the scene expects.
#pragma once

#include "creases.hpp"
#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <string>
#include <vector>

namespace cli {

// SwCertificate.remaining: the search for the better pose was cut short.
constexpr double kRoughAbove = 0.01;

struct Summary {
  const Scene &scene;
  SwModelInfo info;
  std::vector<double> frequencies;
  const Run &run;
  std::vector<SwFrontPoint> front;  // of a method that was chosen for the scene
  CreaseLists creases{};
  std::vector<std::string> warnings{};  // of the library, while it made the model
  const ProxySource *proxy = nullptr;  // what is simulated in the file's place
  bool compared = false;  // beside another method, whose reader needs no other one
};

// The figures to stdout; a third column holds another's figures where the scene states them.
void print_summary(const Summary &summary);

// A sentence for each expectation that does not hold. What depends on the length of the run is judged only if `whole`.
std::vector<std::string> violations(const Summary &summary, bool whole);

}  // namespace cli

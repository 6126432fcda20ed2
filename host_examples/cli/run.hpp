// Running what a scene file or a mesh with options says: precompute, step, write, tell.
#pragma once

#include "scene.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cli {

// Exit statuses.
constexpr int kFailure = 1, kInterrupted = 130;

struct RunOptions {
  std::string out;                 // directory; empty = write nothing
  std::optional<uint32_t> frames;  // in place of the scene's duration
  std::optional<uint32_t> steps_per_frame;  // in place of the scene's
  std::optional<uint32_t> correction_steps;  // the same
  std::string method;              // in place of the scene's; empty = that
  std::vector<std::string> formats;  // in place of the scene's; empty = those
  std::string html;                // page to write; empty = none
  std::string png;                 // picture to write; empty = none
  bool view = false;               // write the page, wherever, and open it
  std::vector<std::string> compare;  // further methods on the page
  bool linear = false;
  bool plan = false;
  bool certify = false, no_certify = false;  // neither: unless the mesh is large
  bool yes = false;  // to long runs
  bool quiet = false;
};

// Runs all shells of a file. The exit status.
int run_shells(const SceneFile &file, const RunOptions &options);

}  // namespace cli

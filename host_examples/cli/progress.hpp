// A progress bar on stderr while a model is precomputed, and Ctrl-C and SIGTERM as polite requests to stop.
#pragma once

#include "phase.hpp"
#include "shellwarp.hpp"

#include <chrono>
#include <cstdint>
#include <string>

namespace cli {

// From here on the first Ctrl-C or SIGTERM only sets a flag; a second one ends the process the usual way. A file that grows past
// the system's limit becomes a failed write.
void catch_signals();
bool interrupted();
// That, by Ctrl-C: whoever did wants to see what there is.
bool stopped_by_user();
// The watch of a search: it goes on until then.
struct UntilInterrupted {
  bool operator()(double) const { return !interrupted(); }
};

bool stderr_is_terminal();

// A line on stdout at once, unless quiet or empty.
void say(const std::string &sentence, bool quiet);

// Draws on stderr: one line that is redrawn on a terminal; in a log, from two seconds on, a line for each fifth of a phase; nothing when quiet.
class ProgressBar {
public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar &) = delete;
  ProgressBar &operator=(const ProgressBar &) = delete;

  // Fills in the callback; the bar must outlive the precompute.
  void attach(SwPrecomputeDesc &desc);
  void show(uint32_t phase, double fraction);

private:
  bool quiet_, terminal_, drawn_ = false;
  uint32_t phase_ = SW_PHASE_COUNT, part_ = 1;  // some phases go through their work several times
  int percent_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

using host::phase_name;

}  // namespace cli

// Maya's Esc key and the bar in its help line, from when there is something long to stop: a computation that has begun shows in Maya's
// window. Maya is to be asked on its main thread alone; on a thread of the evaluation manager nothing can be stopped or shown.
#pragma once

#include "notice.hpp"
#include "phase.hpp"

#include <maya/MComputation.h>
#include <maya/MString.h>

#include <cstdint>
#include <string>

class HostInterrupt {
public:
  // `work`: what the bar says where no phase is told.
  explicit HostInterrupt(const char *work) : work_(work) {}
  HostInterrupt(const HostInterrupt &) = delete;
  HostInterrupt &operator=(const HostInterrupt &) = delete;
  ~HostInterrupt() {
    if (begun_) computation_.endComputation();
  }

  bool requested() {
    if (!begin()) return false;
    stopped_ = stopped_ || computation_.isInterruptRequested();
    return stopped_;
  }

  // A phase of a precompute, SW_PHASE_..., and how far it is, 0 to 1.
  void show(uint32_t phase, double fraction) {
    if (!begin()) return;
    if (phase != phase_) say(host::phase_name(phase));
    phase_ = phase;
    computation_.setProgress(static_cast<int>(kWhole * fraction));
  }

private:
  static constexpr int kWhole = 100;
  static constexpr uint32_t kNone = ~uint32_t{0};

  bool begin() {
    if (!notice::on_main_thread()) return false;
    if (begun_) return true;
    begun_ = true;
    computation_.beginComputation(true);  // with the bar
    computation_.setProgressRange(0, kWhole);
    say(work_);
    return true;
  }

  void say(const char *what) { computation_.setProgressStatus((std::string("Shell Warp: ") + what).c_str()); }

  MComputation computation_;
  const char *work_;
  uint32_t phase_ = kNone;
  bool begun_ = false, stopped_ = false;
};

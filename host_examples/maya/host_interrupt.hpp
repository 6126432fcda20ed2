// Maya's Esc key, asked for only when there is something long to stop: a computation that has begun shows in Maya's window. Maya is to
// be asked on its main thread alone; on a thread of the evaluation manager nothing can be stopped.
#pragma once

#include "notice.hpp"

#include <maya/MComputation.h>

class HostInterrupt {
public:
  HostInterrupt() = default;
  HostInterrupt(const HostInterrupt &) = delete;
  HostInterrupt &operator=(const HostInterrupt &) = delete;
  ~HostInterrupt() {
    if (begun_) computation_.endComputation();
  }

  bool requested() {
    if (!notice::on_main_thread()) return false;
    if (!begun_) computation_.beginComputation();
    begun_ = true;
    stopped_ = stopped_ || computation_.isInterruptRequested();
    return stopped_;
  }

private:
  MComputation computation_;
  bool begun_ = false, stopped_ = false;
};

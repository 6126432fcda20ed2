// The phases of a precompute in words.
#pragma once

#include "shellwarp.h"

#include <cstdint>

namespace host {

inline const char *phase_name(uint32_t phase) {
  static const char *const kNames[SW_PHASE_COUNT] = {"assembly",    "ordering",       "factorization", "modes",
                                                     "certificate", "modal rotation", "training"};
  return phase < SW_PHASE_COUNT ? kNames[phase] : "work";
}

}  // namespace host

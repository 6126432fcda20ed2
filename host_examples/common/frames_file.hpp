// The frames of a run on disk, with the model that they are of: a scene that is opened again shows any of them at once, without a precompute
// and without being played.
#pragma once

#include "state_cache.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace host {

struct Frames {
  uint64_t build_key = 0, motion_key = 0;  // what model and run depend on
  uint32_t method = 0;
  bool support_fields = false;  // the model has them
  double unit = 1;
  uint64_t near_key = 0;         // for what the next were looked for
  std::vector<uint32_t> near{};  // contact patches that were found near colliders
  std::vector<double> rest;           // n x 3
  std::vector<unsigned char> model;   // saved
  std::vector<StateCache::Entry> entries;  // without what led there
};

// A whole file. Throws HostError that names it.
void write_frames(const std::string &path, const Frames &frames);
Frames read_frames(const std::string &path);

}  // namespace host

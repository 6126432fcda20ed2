// The saved states of every frame that was stepped to, so that scrubbing repeats what playing gave, bit for bit.
//
// A frame costs bytes_per_frame: the library's 952 bytes at 50 modes and 40 of ours, so under a kilobyte.
#pragma once

#include "request.hpp"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace host {

class StateCache {
public:
  struct Entry {
    std::vector<unsigned char> state;  // sw_state_save; empty = none
    uint64_t inputs = 0;               // fingerprint of the inputs that led here
    uint32_t missed = 0;               // handles that could not be met
    float deepest = 0;                 // SwStateReport.deepest_penetration
    float stiffness = 1;               // Inputs.stiffness_factor
    bool exact = false;                // stepped frame by frame from the start, each with its own inputs
    bool led = false;                  // supports were moved
    std::shared_ptr<const Inputs> seen{};  // what led here, where supports may be moved or solids deform; of solids' meshes the points of those
  };

  // Frames 0 to limit - 1.
  static constexpr uint64_t limit = 1 << 16;

  const Entry *find(uint64_t frame) const;  // nullptr where there is none
  const Entry *last_before(uint64_t frame, uint64_t &found) const;
  void store(uint64_t frame, Entry entry);  // throws HostError from `limit` on
  void drop_from(uint64_t frame);           // this frame and all after it
  std::vector<Entry> take();  // leaves none
  const std::vector<Entry> &all() const { return entries_; }
  void put(std::vector<Entry> entries) { entries_ = std::move(entries); }
  void forget_inputs();       // Entry::seen of all
  uint64_t size() const;                    // frames stored
  uint64_t bytes_per_frame() const;         // of the largest, bookkeeping included
  uint64_t bytes_of_shapes() const;         // of solids that deform, rest shapes that move, and forces, in all frames

private:
  std::vector<Entry> entries_;
};

}  // namespace host

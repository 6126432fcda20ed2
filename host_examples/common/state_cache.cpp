#include "state_cache.hpp"

#include "message.hpp"

#include <algorithm>
#include <utility>

namespace host {

const StateCache::Entry *StateCache::find(uint64_t frame) const {
  return frame < entries_.size() && !entries_[frame].state.empty() ? &entries_[frame] : nullptr;
}

const StateCache::Entry *StateCache::last_before(uint64_t frame, uint64_t &found) const {
  for (found = std::min<uint64_t>(frame, entries_.size()); found-- > 0;)
    if (const Entry *entry = find(found)) return entry;
  return nullptr;
}

void StateCache::store(uint64_t frame, Entry entry) {
  if (frame >= limit)
    throw HostError("frame " + number(frame) + " after the start is too far: the most is " + number(limit - 1) +
                    "; is the start frame right?");
  if (frame >= entries_.size()) entries_.resize(frame + 1);
  entries_[frame] = std::move(entry);
}

void StateCache::drop_from(uint64_t frame) {
  if (frame < entries_.size()) entries_.resize(frame);
}

std::vector<StateCache::Entry> StateCache::take() {
  std::vector<Entry> all = std::move(entries_);
  entries_.clear();
  return all;
}

void StateCache::forget_inputs() {
  for (Entry &entry : entries_) entry.seen.reset();
}

uint64_t StateCache::size() const {
  return static_cast<uint64_t>(
      std::count_if(entries_.begin(), entries_.end(), [](const Entry &entry) { return !entry.state.empty(); }));
}

uint64_t StateCache::bytes_per_frame() const {
  std::size_t most = 0;
  for (const Entry &entry : entries_) {
    const bool own = entry.seen.use_count() == 1;  // else it is that of the frame before
    const std::size_t seen = own ? sizeof(Inputs) + entry.seen->supports.capacity() * sizeof(double) : 0;
    most = std::max(most, entry.state.capacity() + seen);
  }
  return most + sizeof(Entry);
}

uint64_t StateCache::bytes_of_shapes() const {
  uint64_t sum = 0;
  const Inputs *before = nullptr;  // frames with the same inputs share them
  for (const Entry &entry : entries_) {
    if (!entry.seen || entry.seen.get() == before) continue;
    before = entry.seen.get();
    sum += (before->forces.capacity() + before->rest.capacity()) * sizeof(double);
    for (const Collider &collider : before->colliders) sum += collider.mesh.points.capacity() * sizeof(double);
  }
  return sum;
}

}  // namespace host

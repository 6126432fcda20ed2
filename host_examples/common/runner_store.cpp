#include "runner_store.hpp"

#include "hash.hpp"

#include <algorithm>

namespace host {

uint64_t identity(const Request &request, int64_t node) {
  return Hash()
      .add(node)
      .add(build_key(request.mesh, request.build))
      .add_all(request.mesh.points)
      .add_all(request.drawn)
      .value();
}

void RunnerStore::keep(uint64_t key, std::unique_ptr<ShellRunner> runner) {
  std::unique_ptr<ShellRunner> oldest;  // ends outside of the lock
  const std::lock_guard<std::mutex> lock(mutex_);
  runners_.emplace_back(key, std::move(runner));
  if (runners_.size() <= limit) return;
  oldest = std::move(runners_.front().second);
  runners_.pop_front();
}

std::unique_ptr<ShellRunner> RunnerStore::take(uint64_t key) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = std::find_if(runners_.begin(), runners_.end(), [key](const auto &entry) { return entry.first == key; });
  if (found == runners_.end()) return nullptr;
  std::unique_ptr<ShellRunner> runner = std::move(found->second);
  runners_.erase(found);
  return runner;
}

std::size_t RunnerStore::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return runners_.size();
}

}  // namespace host

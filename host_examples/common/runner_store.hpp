// Shells that no node holds now: a host may drop a node's cache, and cook many pieces by one node in turn.
#pragma once

#include "shell_runner.hpp"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

namespace host {

// The same for the same node, mesh, model and drawn points: what a shell goes on from.
uint64_t identity(const Request &request, int64_t node);

// For any thread. Those that were put back first go first.
class RunnerStore {
public:
  static constexpr std::size_t limit = 64;

  void keep(uint64_t key, std::unique_ptr<ShellRunner> runner);
  std::unique_ptr<ShellRunner> take(uint64_t key);  // null where there is none
  std::size_t size() const;

private:
  mutable std::mutex mutex_;
  std::list<std::pair<uint64_t, std::unique_ptr<ShellRunner>>> runners_;
};

}  // namespace host

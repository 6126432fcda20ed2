// Tells on stderr that long work goes on, also where the work itself says nothing: after two seconds, and from then on.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

namespace cli {

class Watch {
public:
  // `what` is in the form "stepping"; `total` is what `at` counts up to, 0 where nothing is counted.
  Watch(std::string what, bool quiet, uint32_t total = 0, std::chrono::duration<double> patience = std::chrono::seconds(2));
  ~Watch();
  Watch(const Watch &) = delete;
  Watch &operator=(const Watch &) = delete;

  void at(uint32_t done) { done_ = done; }
  uint64_t times_told() const { return told_; }

private:
  void wait();
  void tell(double seconds);

  const std::string what_;
  const uint32_t total_;
  const std::chrono::duration<double> patience_;
  const bool terminal_;
  std::atomic<uint32_t> done_{0};
  std::atomic<uint64_t> told_{0};
  bool over_ = false;  // under mutex_
  std::mutex mutex_;
  std::condition_variable wake_;
  std::thread thread_;
};

// "stepping: frame 30 of 120, 12 s so far, about 36 s to go".
std::string progress_words(const std::string &what, double seconds, uint32_t done, uint32_t total);

}  // namespace cli

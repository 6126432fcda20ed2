#include "watch.hpp"

#include "judge.hpp"
#include "progress.hpp"

#include <algorithm>
#include <cstdio>

namespace cli {

std::string progress_words(const std::string &what, double seconds, uint32_t done, uint32_t total) {
  std::string words = what + ": ";
  if (total) words += format("frame %u of %u, ", done, total);
  words += format("%.0f s so far", seconds);
  // The next frame is taken for half done. Fewer frames tell little of the rest.
  constexpr uint32_t kTelling = 3;
  if (done >= kTelling && done < total) words += format(", about %.0f s to go", seconds * (total - done - 0.5) / (done + 0.5));
  return words;
}

Watch::Watch(std::string what, bool quiet, uint32_t total, std::chrono::duration<double> patience)
    : what_(std::move(what)), total_(total), patience_(patience), terminal_(stderr_is_terminal()) {
  if (!quiet) thread_ = std::thread(&Watch::wait, this);
}

Watch::~Watch() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    over_ = true;
  }
  wake_.notify_one();
  thread_.join();
  if (terminal_ && told_) std::fputc('\n', stderr);
}

// On a terminal one line that is redrawn; elsewhere a line after twice the time of the last, so that logs stay short, but one a minute.
void Watch::wait() {
  constexpr std::chrono::duration<double> kLongest = std::chrono::minutes(1);
  const auto start = std::chrono::steady_clock::now();
  std::chrono::duration<double> next = patience_;
  std::unique_lock<std::mutex> lock(mutex_);
  while (!wake_.wait_until(lock, start + std::chrono::duration_cast<std::chrono::nanoseconds>(next), [this] { return over_; })) {
    tell(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    next += terminal_ ? std::chrono::duration<double>(0.25) : std::min(next, kLongest);
  }
}

void Watch::tell(double seconds) {
  const std::string words = progress_words(what_, seconds, done_, total_);
  std::fprintf(stderr, terminal_ ? "\r%-70s" : "%s\n", words.c_str());
  std::fflush(stderr);
  ++told_;
}

}  // namespace cli

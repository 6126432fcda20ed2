#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace cli {

namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

// Percent that are told of: each on a terminal, a fifth of a phase in a log.
constexpr int step_of(bool terminal) { return terminal ? 1 : 20; }

}  // namespace

bool stderr_is_terminal() {
#ifdef _WIN32
  return _isatty(_fileno(stderr)) != 0;
#else
  return isatty(STDERR_FILENO) != 0;
#endif
}

extern "C" {

static void on_interrupt(int signal) {
  interrupt_flag = signal;
  std::signal(signal, SIG_DFL);
}

static uint32_t on_progress(void *user, uint32_t phase, double fraction) {
  static_cast<ProgressBar *>(user)->show(phase, fraction);
  return interrupted() ? SW_PROGRESS_CANCEL : SW_PROGRESS_CONTINUE;
}

}  // extern "C"

void catch_signals() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, SIG_IGN);
#endif
}

bool interrupted() { return interrupt_flag != 0; }

bool stopped_by_user() { return interrupt_flag == SIGINT; }

ProgressBar::ProgressBar(bool quiet) : quiet_(quiet), terminal_(stderr_is_terminal()) {}

ProgressBar::~ProgressBar() {
  if (drawn_ && terminal_) std::fputc('\n', stderr);
}

void ProgressBar::attach(SwPrecomputeDesc &desc) {
  desc.progress = on_progress;
  desc.progress_user = this;
}

void ProgressBar::show(uint32_t phase, double fraction) {
  const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
  const bool same = phase == phase_ && percent / step_of(terminal_) == percent_ / step_of(terminal_);
  if (quiet_ || same) return;
  if (!terminal_ && std::chrono::steady_clock::now() - start_ < std::chrono::seconds(2)) return;  // a log hears of long work alone
  part_ = phase != phase_ ? 1 : percent < percent_ ? part_ + 1 : part_;
  phase_ = phase;
  percent_ = percent;
  const std::string name = std::string(phase_name(phase)) + (part_ > 1 ? ", part " + std::to_string(part_) : "");
  drawn_ = true;
  if (!terminal_) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    std::fprintf(stderr, "precompute: %s, %d %%, %.0f s so far\n", name.c_str(), percent, seconds);
    return;
  }
  const std::string bar(static_cast<std::size_t>(percent) * 30 / 100, '#');
  std::fprintf(stderr, "\rprecompute: %-22s [%-30s] %3d %%", name.c_str(), bar.c_str(), percent);
  std::fflush(stderr);
}

void say(const std::string &sentence, bool quiet) {
  if (quiet || sentence.empty()) return;
  std::printf("%s\n", sentence.c_str());
  std::fflush(stdout);
}

}  // namespace cli

#include "notice.hpp"

#include <maya/MGlobal.h>

#include <iostream>
#include <thread>

namespace notice {

namespace {

std::thread::id main_thread;
bool has_window = false;

// A string of MEL: quotes and ends of lines are written out.
std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

// executeCommandOnIdle is the one call that Maya takes from threads of its own.
void tell(const char *command, const char *batch, const std::string &text) {
  if (has_window)
    MGlobal::executeCommandOnIdle((std::string(command) + " " + quoted(text)).c_str());
  else
    std::cerr << (std::string(batch) + ": " + text + "\n") << std::flush;
}

}  // namespace

void start() {
  main_thread = std::this_thread::get_id();
  has_window = MGlobal::mayaState() == MGlobal::kInteractive;
}

bool on_main_thread() { return std::this_thread::get_id() == main_thread; }

void warning(const std::string &text) { tell("warning", "Warning", text); }
void error(const std::string &text) { tell("error", "Error", text); }

}  // namespace notice

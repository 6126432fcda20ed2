#include "warnings.hpp"

#include "shellwarp.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace cli {

Warnings::Warnings() { sw_set_log_callback(add, this); }

Warnings::~Warnings() { sw_set_log_callback(nullptr, nullptr); }

std::vector<std::string> Warnings::taken() {
  sw_set_log_callback(nullptr, nullptr);
  return std::move(warnings_);
}

// Each once: a model that is made of pieces may say the same of several.
void Warnings::add(void *self, uint32_t level, const char *message) {
  std::vector<std::string> &all = static_cast<Warnings *>(self)->warnings_;
  if (level != SW_LOG_WARNING) return;
  try {
    if (std::find(all.begin(), all.end(), message) == all.end()) all.emplace_back(message);
  } catch (const std::exception &) {  // no memory: nothing may be thrown through the library
  }
}

}  // namespace cli

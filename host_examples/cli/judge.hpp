// Words and verdicts: printf into a string, and a sentence for each expectation that does not hold.
#pragma once

#include "scene.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cli {

std::string format(const char *pattern, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;

struct Judge {
  std::vector<std::string> sentences;

  void equal(const char *what, uint32_t value, const std::optional<uint32_t> &expected);
  void within(const char *what, double value, const std::optional<Range> &range);
};

}  // namespace cli

#include "judge.hpp"

#include <cstdarg>
#include <cstdio>

namespace cli {

std::string format(const char *pattern, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

void Judge::equal(const char *what, uint32_t value, const std::optional<uint32_t> &expected) {
  if (expected && value != *expected) sentences.push_back(format("%s: expected %u, got %u", what, *expected, value));
}

void Judge::within(const char *what, double value, const std::optional<Range> &range) {
  if (range && !(value >= range->first && value <= range->second))
    sentences.push_back(format("%s: expected %g to %g, got %g", what, range->first, range->second, value));
}

}  // namespace cli

#include "judge.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace cli {

std::string format(const char *pattern, ...) {
  std::va_list arguments, again;
  va_start(arguments, pattern);
  va_copy(again, arguments);
  std::string text(static_cast<std::size_t>(std::max(std::vsnprintf(nullptr, 0, pattern, arguments), 0)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
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

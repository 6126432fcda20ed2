// What goes wrong in a host, in words for its user. Numbers are written with a point whatever the host's locale is.
#pragma once

#include <cstdint>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

namespace host {

class HostError : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

// Hosts run plug-ins under the user's locale, in C and in C++ streams alike; printf and a plain stream would follow it.
inline std::string number(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(6);
  text << value;
  return text.str();
}

inline std::string number(uint64_t value) {
  std::string digits;
  do digits.insert(digits.begin(), static_cast<char>('0' + value % 10));
  while (value /= 10);
  return digits;
}

}  // namespace host

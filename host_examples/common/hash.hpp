// Fingerprints of inputs (FNV-1a, 64 bits), to notice a change without keeping what was there before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace host {

class Hash {
public:
  // A number, by its bits; -0 and 0 count as one.
  template <class T>
  Hash &add(T value) {
    static_assert(std::is_arithmetic<T>::value || std::is_enum<T>::value, "only numbers have no padding");
    if constexpr (std::is_floating_point<T>::value) value += T(0);
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * 1099511628211u;
    return *this;
  }

  // A list, with its length, so that two lists in a row are told apart.
  template <class List>
  Hash &add_all(const List &values) {
    add(static_cast<uint64_t>(values.size()));
    for (const auto &value : values) add(value);
    return *this;
  }

  uint64_t value() const { return value_; }

private:
  uint64_t value_ = 14695981039346656037u;
};

}  // namespace host

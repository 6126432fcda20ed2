#include "json.hpp"

#include "judge.hpp"

#include <cmath>
#include <cstring>

namespace cli {

namespace {

template <class Value>
void put(std::string &bytes, Value value) {
  for (std::size_t k = 0; k < sizeof value; ++k) bytes.push_back(static_cast<char>(value >> 8 * k & 255));
}

std::string base64(const std::string &bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "\"";
  text.reserve(bytes.size() / 3 * 4 + 8);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63];
  }
  return text + "\"";
}

}  // namespace

std::string json_text(const std::string &text) {
  std::string quoted = "\"";
  for (const char c : text)
    if (c == '"' || c == '\\')
      quoted += std::string("\\") + c;
    else if (c == '<' || static_cast<unsigned char>(c) < 32)  // no </script> inside
      quoted += format("\\u%04x", static_cast<unsigned>(c));
    else
      quoted += c;
  return quoted + "\"";
}

std::string json_number(double value) { return std::isfinite(value) ? format("%.9g", value) : "null"; }

std::string json_numbers(const std::vector<double> &values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) text += (i ? "," : "") + json_number(values[i]);
  return text + "]";
}

std::string json_bytes(const std::vector<float> &values) {
  std::string bytes;
  for (const float value : values) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    put(bytes, bits);
  }
  return base64(bytes);
}

std::string json_bytes(const std::vector<uint32_t> &values) {
  std::string bytes;
  for (const uint32_t value : values) put(bytes, value);
  return base64(bytes);
}

std::string json_bytes(const std::vector<int16_t> &values) {
  std::string bytes;
  for (const int16_t value : values) put(bytes, static_cast<uint16_t>(value));
  return base64(bytes);
}

}  // namespace cli

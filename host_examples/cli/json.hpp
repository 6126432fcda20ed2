// Writing JSON that may stand in a page's <script>.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

std::string json_text(const std::string &text);
std::string json_number(double value);  // null where it is not finite
std::string json_numbers(const std::vector<double> &values);

// Little-endian bytes, as a text in base64.
std::string json_bytes(const std::vector<float> &values);
std::string json_bytes(const std::vector<uint32_t> &values);
std::string json_bytes(const std::vector<int16_t> &values);

}  // namespace cli

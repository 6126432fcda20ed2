// The names that scenes, options and files have for SW_METHOD_....
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cli {

// "warp", "lma", "implicit", "explicit", "virtual-work", "rotation-strain", "reduced-shell", "auto": the first is the default.
const std::vector<std::string> &method_names();
const char *method_name(uint32_t method);
std::optional<uint32_t> find_method(const std::string &name);

// By modes alone.
bool is_modal(uint32_t method);

// The full shell, vertex by vertex: no modes, so no damping by mode.
bool is_nonlinear(uint32_t method);

}  // namespace cli

#include "method.hpp"

#include "shellwarp.h"

namespace cli {

namespace {

constexpr uint32_t kMethods[] = {SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_SHELL_IMPLICIT, SW_METHOD_SHELL_EXPLICIT,
                                 SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_ROTATION_STRAIN, SW_METHOD_REDUCED_SHELL,
                                 SW_METHOD_AUTO};

}  // namespace

const std::vector<std::string> &method_names() {
  static const std::vector<std::string> names = {"warp", "lma", "implicit", "explicit",
                                                 "virtual-work", "rotation-strain", "reduced-shell",
                                                 "auto"};  // in the order of kMethods
  return names;
}

const char *method_name(uint32_t method) {
  for (std::size_t k = 0; k < method_names().size(); ++k)
    if (kMethods[k] == method) return method_names()[k].c_str();
  return "unknown";
}

std::optional<uint32_t> find_method(const std::string &name) {
  for (std::size_t k = 0; k < method_names().size(); ++k)
    if (method_names()[k] == name) return kMethods[k];
  return std::nullopt;
}

bool is_modal(uint32_t method) {
  return method == SW_METHOD_WARP || method == SW_METHOD_LMA || method == SW_METHOD_WARP_VIRTUAL_WORK ||
         method == SW_METHOD_ROTATION_STRAIN;
}

bool is_nonlinear(uint32_t method) { return method == SW_METHOD_SHELL_IMPLICIT || method == SW_METHOD_SHELL_EXPLICIT; }

}  // namespace cli

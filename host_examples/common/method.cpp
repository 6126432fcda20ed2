#include "method.hpp"

#include <algorithm>
#include <cstring>

namespace host {

namespace {


std::vector<uint32_t> read_table() {
  std::vector<uint32_t> all(sw_method_count());
  for (uint32_t k = 0; k < all.size(); ++k) all[k] = sw_method_at(k);
  return all;
}

}  // namespace

const std::vector<uint32_t> &methods() {
  static const std::vector<uint32_t> all = read_table();
  return all;
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const uint32_t method : methods()) names.emplace_back(sw_method_name(method));
  return names;
}

std::optional<uint32_t> find_method(const std::string &name) {
  for (const uint32_t method : methods())
    if (name == sw_method_name(method)) return method;
  return std::nullopt;
}

const char *method_name(uint32_t method) {
  const char *name = sw_method_name(method);
  return *name ? name : "unknown";
}

int widest_method_name() {
  std::size_t widest = 0;
  for (const uint32_t method : methods()) widest = std::max(widest, std::strlen(sw_method_name(method)));
  return static_cast<int>(widest);
}

bool needs_fields(uint32_t method) { return sw_method_needs(method) == SW_NEEDS_REDUCED_FIELDS; }

bool needs_choice(uint32_t method) { return sw_method_needs(method) == SW_NEEDS_CHOICE; }

uint32_t method_taken(uint32_t method, const SwModelInfo &info) { return needs_choice(method) ? info.auto_method : method; }

bool moves_by_modes(uint32_t method) {
  return method == SW_METHOD_LMA || sw_method_needs(method) == SW_NEEDS_ROTATIONS;
}

bool is_full_shell(uint32_t method) { return method != SW_METHOD_LMA && sw_method_needs(method) == SW_NEEDS_MODES; }

bool follows_by_fields(uint32_t method) {
  return needs_choice(method) || (moves_by_modes(method) && method != SW_METHOD_ROTATION_STRAIN);
}

SwDampingDesc damping(const double &ratio, double mass, double stiffness) {
  SwDampingDesc desc = shellwarp::damping_desc();
  desc.mass_coefficient = mass;
  desc.stiffness_coefficient = stiffness;
  desc.ratios = &ratio;
  desc.n_ratios = 1;
  return desc;
}

}  // namespace host

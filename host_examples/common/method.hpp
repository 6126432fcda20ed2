// The library's table of methods, for every host written in C++: no host has names of its own.
#pragma once

#include "shellwarp.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace host {

// All of the library's methods, in its order for menus. SW_METHOD_AUTO is the last.
const std::vector<uint32_t> &methods();
std::vector<std::string> method_names();
std::optional<uint32_t> find_method(const std::string &name);

// "reduced-shell", and "unknown" for a number that the library does not know.
const char *method_name(uint32_t method);

// How wide a column must be that shows any of the names.
int widest_method_name();

// What a precompute must be told for a method: SwPrecomputeDesc.
bool needs_fields(uint32_t method);
bool needs_choice(uint32_t method);
// What states move by: of the automatic choice, what the model took.
uint32_t method_taken(uint32_t method, const SwModelInfo &info);

// What hosts take unless told otherwise, Houdini and Blender too, which cannot read it here.
constexpr uint32_t kDefaultMethod = SW_METHOD_AUTO;

// reduced_fields where a host says none, as SwPrecomputeDesc suggests.
constexpr uint32_t kFields = 40;
constexpr uint32_t kFieldsWithHandles = 64;  // where the precompute of a shell that is held is told of handles

// The table does not say how a method moves. Two facts follow from what it needs, with one exception. A method that
// needs no more than modes is the full shell, vertex by vertex, except linear modal analysis. That one, and those that
// need rotations, move by modes.
bool moves_by_modes(uint32_t method);
bool is_full_shell(uint32_t method);
// Supports that move against each other, by SwPrecomputeDesc.support_fields; the automatic choice is the warp then.
bool follows_by_fields(uint32_t method);

// Damping by a share of the critical, beside that by mass and stiffness. `ratio` must outlive the descriptor.
SwDampingDesc damping(const double &ratio, double mass, double stiffness);

}  // namespace host

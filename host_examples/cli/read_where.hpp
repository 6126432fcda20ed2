// Vertices that a table of a scene names.
#pragma once

#include "scene.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cli {

class Section;

// Numbers of vertices; none where the key is missing.
std::vector<uint32_t> read_indices(Section &section, const char *key);

// `side` of a table, where it is there.
std::optional<Side> read_side(Section &section);

// By side, box, vertices, list or group. Files are added to `inputs`.
Support read_where(Section &section, std::vector<std::string> &inputs);

}  // namespace cli

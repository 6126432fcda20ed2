// A scene to begin with: a TOML file with a comment at every key, which runs as it is.
#pragma once

#include <string>

namespace cli {

// Writes `path`, and beside it a leaf as NAME.obj unless `mesh` names a mesh of the user's own. Nothing that is there is replaced.
void write_new_scene(const std::string &path, const std::string &mesh);

}  // namespace cli

// A scene to begin with: a TOML file with a comment at every key, which runs as it is.
#pragma once

#include <string>

namespace cli {

// Of scene files, for editors: docs/reference/scene.schema.json.
extern const char kSceneSchema[];

// Writes `path`, beside it that schema as scene.schema.json, and a leaf as NAME.obj unless `mesh` names a mesh of the user's own.
// Nothing that is there is replaced but an older schema. Returns what was assumed: what is held, and the axis 'x', 'y' or 'z' that is up.
std::string write_new_scene(const std::string &path, const std::string &mesh, char up);

}  // namespace cli

// Vertices named in words, on the command line and in scenes; and the way of a handle, and a collider, in one word.
#pragma once

#include "collider.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "scene.hpp"

#include <array>
#include <string>
#include <vector>

namespace cli {

// "low-x" … "high-z".
std::optional<Side> find_side(const std::string &word);
std::vector<std::string> side_names();

// Those within a hundredth of the mesh's extent along the axis.
std::vector<uint32_t> vertices_at(const Side &side, const Mesh &mesh);

// The vertices of a group of an OBJ file; throws where there is no such group, naming those that there are.
std::vector<uint32_t> vertices_of_group(const std::string &name, const Mesh &mesh);

// The vertex nearest to the middle of the listed ones.
uint32_t middle_vertex(const std::vector<uint32_t> &vertices, const Mesh &mesh);

// What --pin takes: a side, vertices as 0,4,10-20, X0,Y0,Z0,X1,Y1,Z1 behind "box:", the vertex nearest to X,Y,Z behind "nearest:", a file of vertices, or the
// name of a group.
// A file that is read is added to `inputs`.
Support read_pin(const std::string &word, std::vector<std::string> &inputs);

// What --handle takes: V:PATH, where V is a vertex, a side (its middle), a group, or nearest:X,Y,Z, and PATH is a file of lines "time x y z" or offsets
// DX,DY,DZ@SECONDS with ':' between; seconds count 1, 2, 3 … where left out, and free@SECONDS lets go.
Handle read_path(const std::string &word, std::vector<std::string> &inputs);

// What --collider takes: plane:AXIS=HEIGHT or KIND:SIZES@X,Y,Z, and behind ':' friction=F, thickness=T, of a mesh one-sided or depth=D, or offsets as of a handle.
Collider read_collider(const std::string &word, std::vector<std::string> &inputs);

}  // namespace cli

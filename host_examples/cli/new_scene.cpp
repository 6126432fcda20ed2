#include "new_scene.hpp"

#include "judge.hpp"
#include "mesh.hpp"
#include "selection.hpp"
#include "output_file.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace cli {

namespace {

namespace fs = std::filesystem;

constexpr double kPi = 3.141592653589793;

// A leaf of 10 cm along x, curved along and across, in metres.
Mesh leaf() {
  constexpr uint32_t kAlong = 32, kAcross = 10;
  constexpr double kLength = 0.1, kHalfWidth = 0.024;
  Mesh mesh;
  for (uint32_t i = 0; i <= kAlong; ++i)
    for (uint32_t j = 0; j <= kAcross; ++j) {
      const double s = static_cast<double>(i) / kAlong, t = 2.0 * j / kAcross - 1;
      const double width = kHalfWidth * (0.06 + 0.94 * std::pow(std::sin(kPi * (0.05 + 0.94 * std::pow(s, 0.8))), 0.9));
      mesh.add_vertex({kLength * s, width * t, 0.003 * std::fabs(t) * std::sin(kPi * s) + 0.012 * s * (1 - s)});
    }
  for (uint32_t i = 0; i < kAlong; ++i)
    for (uint32_t j = 0; j < kAcross; ++j) {
      const uint32_t a = i * (kAcross + 1) + j, b = a + kAcross + 1;
      mesh.add_polygon({a, b, b + 1});
      mesh.add_polygon({a, b + 1, a + 1});
    }
  return mesh;
}

// The upper end of a mesh that stands, from which it hangs; of one that lies, the lower end of its longest axis.
std::string end_to_hold(const Mesh &mesh, char up) {
  const Bounds box = bounds(mesh);
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (box.high[k] - box.low[k] > box.high[longest] - box.low[longest]) longest = k;
  constexpr double kStands = 0.25;  // of the longest axis, upward
  const std::size_t upward = static_cast<std::size_t>(up - 'x');
  if (box.high[upward] - box.low[upward] >= kStands * (box.high[longest] - box.low[longest])) return std::string("high-") + up;
  return std::string("low-") + "xyz"[longest];
}

constexpr char kSchemaName[] = "scene.schema.json";

constexpr char kScene[] = R"(#:schema ./scene.schema.json
# By the first line, editors with taplo complete and check the keys.
# A scene of shellwarp. Run it, and look at it:  shellwarp run %s --view
# Every key: docs/reference/scene.md. A line that begins with # is a comment; take the # away from what you want.

title = "%s"
mesh = "%s"             # OBJ, OFF or PLY, relative to this file
scale = %s%s# 0.01 makes metres of a mesh in centimetres; all lengths below are in the new unit
up = "%c"                # axis that points upward, for the page; gravity below is along it
length_unit = "m"       # for the reader's eye only

[material]
frequency = 5.0         # Hz of the slowest swing: a leaf 2 to 5, a sheet of paper 1 to 3, sheet metal 20 and more
# thickness = 0.0005    # how much rather it bends than stretches; a 200th of its size unless told
density = 0.2           # kg/m^2: what wind and forces work against; paper 0.08, a leaf 0.2, cloth 0.15 to 0.5
# sag = 0.03            # in place of the frequency: how far it hangs at rest under gravity
# In place of frequency and density, a known sheet in metres, or its numbers: docs/reference/materials.md
# preset = "card"
# thickness = 0.0004
# In place of the frequency, the constants themselves:
# k_bend = 1e-4
# k_length = 50
# k_area = 1e4

# [[material.region]]   # where a constant is another: thickness, young …, or growth, by which lengths without stress are longer
# box = [0.08, -1, -1, 1, 1, 1]
# growth = 1.1

# [[material.crease]]   # a fold, a vein or a seam; as many as you like
# box = [0.049, -1, -1, 0.051, 1, 1]  # all edges with both ends inside; or edges = [[3, 4], [4, 5]], or a list
# factor = 0.2          # of the sheet's stiffness against bending there; above 1 a vein
# angle_degrees = 30    # where it rests; without it as in the mesh
# yield_degrees = 10    # how far it springs back; beyond, folds stay: by the methods reduced-shell and shell-implicit

[[support]]             # what is held; as many as you like
side = "%s"          # low-x, high-x, low-y …; or one of the next four
# box = [-1, -1, -1, 0.003, 1, 1]
# vertices = [0, 1, 2]
# list = "held.txt"
# group = "%s"%s# of lines "g NAME" in an OBJ file
kind = "clamped"        # or "fixed": the slope is free

[simulation]
duration = 4.0          # seconds
frame_rate = 30
steps_per_frame = 4     # more steps are more accurate; the run's last lines tell what the time step costs
gravity = %s  # m/s^2
modes = 16
method = "auto"         # a reduced shell where one holds the shape, else the full shell or the warp; the others: docs/guide/methods.md

[damping]
ratio = 0.05            # of critical: 0 swings for ever, 1 creeps

# [wind]
# velocity = %s  # m/s
# gust = 0.5            # swells and falls by half

# [[handle]]            # a vertex that is led by the hand
# side = "%s"         # its middle; or vertex = 12, or nearest = [x, y, z]
# release = 2.0         # seconds, when it is let go
# [[handle.key]]
# time = 1.0
# offset = [0, 0, 0.03]

# [[collider]]          # a solid that the shell touches; as many as you like
# kind = "sphere"       # or plane, capsule, box, hull, mesh
# radius = 0.02         # m
# position = [0.08, 0, -0.045]
# friction = 0.4
)";

// Spaces up to the comments' column, after words of that length.
std::string gap(std::size_t used) {
  constexpr std::size_t kComments = 24;
  return std::string(used < kComments ? kComments - used : 1, ' ');
}

void refuse_existing(const fs::path &path) {
  if (fs::exists(path)) throw std::runtime_error("cannot write " + path.string() + ": it is there already");
}

// An older version's schema is replaced, a file that is none of ours is not.
bool writes_schema(const fs::path &path) {
  if (!fs::exists(path)) return true;
  const std::string text = read_file(path.string());
  if (text.find("\"title\": \"Scene of shellwarp\"") == std::string::npos) refuse_existing(path);
  return text != kSceneSchema;
}

}  // namespace

std::string write_new_scene(const std::string &path, const std::string &mesh_path, char up) {
  fs::path place(path), mesh_name = place.filename().replace_extension(".obj");
  if (place.extension() != ".toml") throw std::runtime_error(path + ": the name of a scene ends in .toml");
  const fs::path folder_path = place.has_parent_path() ? place.parent_path() : fs::path(".");
  const bool own = !mesh_path.empty();
  const Mesh mesh = own ? read_mesh(mesh_path) : leaf();
  if (own) mesh_name = fs::proximate(fs::absolute(mesh_path), fs::absolute(folder_path));
  refuse_existing(place);
  if (!own) refuse_existing(folder_path / mesh_name);
  const bool schema = writes_schema(folder_path / kSchemaName);
  OutputFolder folder(folder_path.string());
  const std::string name = place.stem().string(), held = end_to_hold(mesh, up);
  const std::string scale = longest_side(mesh) > kLongestInMetres ? "0.01" : "1.0";
  const std::string group = mesh.groups.empty() ? "stem" : mesh.groups.begin()->first;
  const std::string led = (held[0] == 'l' ? "high-" : "low-") + held.substr(held.size() - 1);
  OutputFile file(folder, place.filename().string());
  const char *gravity = up == 'x' ? "[-9.8, 0, 0]" : up == 'y' ? "[0, -9.8, 0]" : "[0, 0, -9.8]";
  file.print(kScene, path.c_str(), name.c_str(), mesh_name.generic_string().c_str(), scale.c_str(), gap(8 + scale.size()).c_str(), up,
             held.c_str(), group.c_str(), gap(12 + group.size()).c_str(), gravity, up == 'y' ? "[0, 0, 3]" : "[0, 3, 0]", led.c_str());
  file.close();
  if (schema) {
    OutputFile for_editors(folder, kSchemaName);
    for_editors.write(kSceneSchema, std::strlen(kSceneSchema));
    for_editors.close();
  }
  if (!own) write_obj(folder, mesh_name.string(), mesh.positions, mesh);
  folder.put_in_place();
  const std::size_t n = vertices_at(*find_side(held), mesh).size();
  const std::string beside = own ? "" : "; its leaf is " + (folder_path / mesh_name).string();
  const std::string editors = schema ? std::string("; editors complete its keys by ") + kSchemaName : "";
  return format("%s is held, %zu of the vertices, and %c is up", held.c_str(), n, up) + beside + editors;
}

}  // namespace cli

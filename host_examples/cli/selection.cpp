#include "selection.hpp"

#include "closest.hpp"
#include "judge.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <stdexcept>

namespace cli {

namespace {

constexpr double kSkin = 0.01;  // of the extent: a row of vertices that is not quite straight counts as one side

[[noreturn]] void refuse(const std::string &option, const std::string &word, const std::string &why) {
  throw std::runtime_error(option + " " + word + ": " + why);
}

std::vector<std::string> split(const std::string &text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == at)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

// As many numbers as asked for, with commas between; none if it is not that.
std::vector<double> numbers(const std::string &text, std::size_t count) {
  std::vector<double> values;
  for (const std::string &part : split(text, ','))
    if (double value; parse_number(part, value)) values.push_back(value);
  if (values.size() != count || split(text, ',').size() != count) values.clear();
  return values;
}

// "0,4,10-20"; empty if it is not a list.
std::vector<uint32_t> list(const std::string &text) {
  std::vector<uint32_t> vertices;
  for (const std::string &part : split(text, ',')) {
    const std::vector<std::string> ends = split(part, '-');
    uint32_t first = 0, last = 0;
    if (ends.size() > 2 || !parse_whole(ends.front(), first) || !parse_whole(ends.back(), last) || last < first) return {};
    for (uint32_t v = first; v <= last && v - first < 1000000; ++v) vertices.push_back(v);
  }
  return vertices;
}

bool is_file(const std::string &word) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(word, ignored);
}

std::vector<HandleKey> read_keys(const std::string &path) {
  const std::string contents = read_file(path);
  TextLines lines(path, contents);
  std::vector<HandleKey> keys;
  while (lines.next_line()) {
    HandleKey key;
    key.time = lines.number("a time");
    key.offset = lines.point("the offset");
    lines.pass_numbers(0, "a line of the path");
    if (key.time < 0 || (!keys.empty() && key.time <= keys.back().time)) lines.fail("times must ascend from 0");
    keys.push_back(key);
  }
  return keys;
}

// A part DX,DY,DZ@SECONDS of a way; or free@SECONDS where there is a time of release to set. `forms`: what else it may be.
void add_key(const std::string &option, const std::string &part, const std::string &word, const std::string &forms,
             std::vector<HandleKey> &keys, std::optional<double> *release) {
  const std::vector<std::string> halves = split(part, '@');
  double time = keys.empty() ? 1 : keys.back().time + 1;
  if (halves.size() > 2 || (halves.size() == 2 && (!parse_number(halves[1], time) || time < 0)))
    refuse(option, word, "'" + part + "' is not DX,DY,DZ@SECONDS");
  if (release && halves[0] == "free") {
    *release = time;
    return;
  }
  const std::vector<double> offset = numbers(halves[0], 3);
  if (offset.empty()) refuse(option, word, "'" + part + "' is not DX,DY,DZ@SECONDS, " + forms);
  if (!keys.empty() && time <= keys.back().time) refuse(option, word, "times must ascend");
  keys.push_back({time, {offset[0], offset[1], offset[2]}, {}});
}

// X,Y,Z behind "nearest", which is taken off the parts.
std::array<double, 3> read_nearest(const std::string &word, std::vector<std::string> &parts) {
  const std::vector<double> place = numbers(parts[1], 3);
  if (place.empty() || parts.size() < 3) refuse("--handle", word, "write nearest:X,Y,Z:PATH, such as nearest:0.1,0,0:0,0,0.1@1");
  parts.erase(parts.begin());
  return {place[0], place[1], place[2]};
}

// How --collider writes each kind, in their order.
constexpr const char *kForms[] = {"plane:z=HEIGHT", "sphere:R@X,Y,Z", "capsule:R,HALF_LENGTH@X,Y,Z", "box:HX,HY,HZ@X,Y,Z",
                                  "hull:FILE@X,Y,Z", "mesh:FILE@X,Y,Z"};

// "z=-0.2": what lies below, along that axis. False if it is not that.
bool read_plane(const std::string &shape, Collider &collider) {
  const std::size_t axis = shape.empty() ? std::string::npos : std::string("xyz").find(shape[0]);
  double height = 0;
  if (axis == std::string::npos || shape.size() < 3 || shape[1] != '=' || !parse_number(shape.substr(2), height)) return false;
  std::array<double, 3> normal{};
  normal[axis] = 1;
  collider.rotation = rotation_to(normal);
  collider.position[axis] = height;
  return true;
}

// Sizes, or a file, and behind '@' the place; at the origin without. False if it is not that.
bool read_shape(const std::string &shape, Collider &collider) {
  if (collider.kind == SW_COLLIDER_PLANE) return read_plane(shape, collider);
  const std::size_t at = shape.rfind('@');
  const std::vector<double> place = at == std::string::npos ? std::vector<double>(3) : numbers(shape.substr(at + 1), 3);
  if (place.empty()) return false;
  std::copy(place.begin(), place.end(), collider.position.begin());
  const std::string what = shape.substr(0, at);
  if (collider.kind == SW_COLLIDER_HULL || collider.kind == SW_COLLIDER_MESH) {
    collider.mesh_path = what;
    return !what.empty();
  }
  const std::size_t count = collider.kind == SW_COLLIDER_SPHERE ? 1 : collider.kind == SW_COLLIDER_CAPSULE ? 2 : 3;
  const std::vector<double> sizes = numbers(what, count);
  if (sizes.empty() || std::any_of(sizes.begin(), sizes.end(), [](double x) { return !(x > 0); })) return false;
  collider.radius = count < 3 ? sizes[0] : 0;
  collider.half_length = count == 2 ? sizes[1] : 0;
  if (count == 3) std::copy(sizes.begin(), sizes.end(), collider.half_extents.begin());
  return true;
}

// "friction=0.4" or "thickness=0.001", of a mesh "one-sided" or "depth=0.01", which is one-sided, too. False if it is none.
bool read_property(const std::string &part, const std::string &word, Collider &collider) {
  const std::size_t equals = part.find('=');
  const bool sheet = part == "one-sided" || part.substr(0, equals) == "depth";
  if (sheet && collider.kind != SW_COLLIDER_MESH) refuse("--collider", word, "'" + part + "' goes with mesh:FILE@X,Y,Z");
  collider.one_sided |= sheet;
  if (part == "one-sided") return true;
  if (equals == std::string::npos) return false;
  const std::string key = part.substr(0, equals);
  double *value = key == "friction" ? &collider.friction : key == "thickness" ? &collider.thickness : sheet ? &collider.depth : nullptr;
  if (!value)
    refuse("--collider", word, "'" + key + "' is none of friction, thickness and depth" + did_you_mean(key, {"friction", "thickness", "depth"}));
  if (!parse_number(part.substr(equals + 1), *value) || *value < 0 || (sheet && *value == 0))
    refuse("--collider", word, "'" + part + "': " + key + (sheet ? " is a number greater than 0" : " is a number from 0 on"));
  return true;
}

}  // namespace

std::vector<std::string> side_names() { return {"low-x", "low-y", "low-z", "high-x", "high-y", "high-z"}; }

std::optional<Side> find_side(const std::string &word) {
  const std::vector<std::string> names = side_names();
  const auto found = static_cast<uint32_t>(std::find(names.begin(), names.end(), word) - names.begin());
  return found < 6 ? std::optional<Side>(Side{found % 3, found >= 3}) : std::nullopt;
}

std::vector<uint32_t> vertices_at(const Side &side, const Mesh &mesh) {
  const Bounds box = bounds(mesh);
  const double end = side.high ? box.high[side.axis] : box.low[side.axis];
  const double skin = kSkin * (box.high[side.axis] - box.low[side.axis]);
  std::vector<uint32_t> vertices;
  for (uint32_t i = 0; i < mesh.n_vertices(); ++i)
    if (std::abs(mesh.vertex(i)[side.axis] - end) <= skin) vertices.push_back(i);
  return vertices;
}

std::vector<uint32_t> vertices_of_group(const std::string &name, const Mesh &mesh) {
  std::vector<std::string> names;
  for (const auto &[group, vertices] : mesh.groups) {
    if (group == name) return {vertices.begin(), vertices.end()};
    names.push_back(group);
  }
  std::string there = names.empty() ? "none (lines 'g NAME' of an OBJ file make them)" : "";
  for (std::size_t k = 0; k < std::min<std::size_t>(names.size(), 8); ++k) there += (k ? ", " : "") + names[k];
  std::vector<std::string> known = side_names();
  known.insert(known.end(), names.begin(), names.end());
  throw std::runtime_error("the mesh has no group '" + name + "'; it has " + there + ", and sides, low-x to high-z" + did_you_mean(name, known));
}

uint32_t middle_vertex(const std::vector<uint32_t> &vertices, const Mesh &mesh) {
  std::array<double, 3> middle{};
  for (const uint32_t v : vertices)
    for (std::size_t k = 0; k < 3; ++k) middle[k] += mesh.vertex(v)[k] / static_cast<double>(vertices.size());
  return nearest_vertex(middle, mesh);
}

Support read_pin(const std::string &word, std::vector<std::string> &inputs) {
  Support support;
  support.clamped = true;
  support.side = find_side(word);
  if (support.side) return support;
  if (word.compare(0, 4, "rim:") == 0) {
    support.side = find_side(word.substr(4));
    support.rim = true;
    if (!support.side) refuse("--pin", word, "a rim is rim:SIDE, low-x to high-z" + did_you_mean(word.substr(4), side_names()));
  } else if (word.compare(0, 4, "box:") == 0) {
    const std::vector<double> b = numbers(word.substr(4), 6);
    if (b.empty()) refuse("--pin", word, "a box is box:X0,Y0,Z0,X1,Y1,Z1");
    support.box = Bounds{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
  } else if (word.compare(0, 8, "nearest:") == 0) {
    const std::vector<double> p = numbers(word.substr(8), 3);
    if (p.empty()) refuse("--pin", word, "a place is nearest:X,Y,Z");
    support.nearest = {p[0], p[1], p[2]};
  } else if (is_file(word)) {
    support.vertices = read_vertex_list(word);
    inputs.push_back(word);
  } else if (support.vertices = list(word); support.vertices.empty()) {
    support.group = word;
  }
  return support;
}

Handle read_path(const std::string &word, std::vector<std::string> &inputs) {
  std::vector<std::string> parts = split(word, ':');
  if (parts.size() < 2) refuse("--handle", word, "write V:PATH, such as 12:0,0,0.1@1 or high-x:0,0,0.1@1:free@2");
  Handle handle;
  uint32_t vertex = 0;
  if (parse_whole(parts[0], vertex)) handle.vertex = vertex;
  else if (parts[0] == "nearest") handle.nearest = read_nearest(word, parts);
  else if (handle.side = find_side(parts[0]); !handle.side) handle.group = parts[0];
  parts.erase(parts.begin());
  if (parts.size() == 1 && is_file(parts[0])) {
    handle.keys = read_keys(parts[0]);
    inputs.push_back(parts[0]);
  } else {
    for (const std::string &part : parts)
      add_key("--handle", part, word, "free@SECONDS or a file of lines 'time x y z'", handle.keys, &handle.release);
  }
  return handle;
}

Collider read_collider(const std::string &word, std::vector<std::string> &inputs) {
  const std::vector<std::string> parts = split(word, ':'), names = collider_kinds();
  const auto kind = static_cast<uint32_t>(std::find(names.begin(), names.end(), parts[0]) - names.begin());
  if (kind == names.size())
    refuse("--collider", word, "'" + parts[0] + "' is none of plane, sphere, capsule, box, hull, mesh" + did_you_mean(parts[0], names));
  Collider collider;
  collider.kind = 1 + kind;
  if (parts.size() < 2 || !read_shape(parts[1], collider))
    refuse("--collider", word, "'" + (parts.size() < 2 ? word : parts[1]) + "' is not as in " + kForms[kind]);
  if (!collider.mesh_path.empty()) inputs.push_back(collider.mesh_path);
  for (std::size_t k = 2; k < parts.size(); ++k)
    if (!read_property(parts[k], word, collider))
      add_key("--collider", parts[k], word, "friction=F, thickness=T, or of a mesh one-sided", collider.keys, nullptr);
  return collider;
}

}  // namespace cli

#include "scene.hpp"

#include "material.hpp"
#include "material_maps.hpp"
#include "method.hpp"
#include "moving_files.hpp"
#include "moving_points.hpp"
#include "read_where.hpp"
#include "section.hpp"
#include "selection.hpp"
#include "text_lines.hpp"
#include "ties.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace cli {

namespace {

constexpr double kRadians = 0.017453292519943295;

Oscillation read_oscillation(Section section, double unit) {
  Oscillation o;
  o.axis = section.vector("axis");
  o.amplitude = section.number("amplitude").value_or(0) * unit;
  o.frequency = section.number("frequency").value_or(0);
  o.phase = section.number("phase_degrees").value_or(0) * kRadians;
  section.reject_unknown_keys();
  return o;
}

FrameMotion read_motion(Section &section, const char *pivot, double duration) {
  FrameMotion motion;
  motion.pivot = section.vector(pivot);
  motion.rise = section.positive("rise", 1);
  motion.fall = section.positive("fall", 1);
  motion.end = section.positive("end", duration);
  for (Section &s : section.sections("translate")) motion.translations.push_back(read_oscillation(std::move(s), 1));
  for (Section &s : section.sections("rotate_degrees"))
    motion.rotations.push_back(read_oscillation(std::move(s), kRadians));
  return motion;
}

const Bone &named_bone(Section &section, const char *key, const Skeleton &skeleton) {
  const std::optional<std::string> name = section.text(key);
  if (!name) section.fail(std::string(key) + " is missing: name a bone");
  const Bone *bone = find_bone(skeleton, *name);
  if (!bone) section.fail(*section.find(key), "no bone is called '" + *name + "' up to here");
  return *bone;
}

Bone read_bone(Section section, const Skeleton &skeleton, double duration) {
  Bone bone;
  bone.name = section.text("name").value_or("");
  if (bone.name.empty()) section.fail("a bone needs a name");
  if (find_bone(skeleton, bone.name)) section.fail(*section.find("name"), "two bones are called '" + bone.name + "'");
  FrameMotion motion = read_motion(section, "joint", duration);
  if (section.find("parent")) {
    const Bone &parent = named_bone(section, "parent", skeleton);
    bone.parent = parent.name;
    motion.parent = parent.motion;
  }
  section.reject_unknown_keys();
  bone.motion = std::make_shared<const FrameMotion>(std::move(motion));
  return bone;
}

// The way of a handle, collider or support: what it leads is the position, the orientation or both.
std::vector<HandleKey> read_keys(Section &led, bool position, bool orientation) {
  std::vector<HandleKey> keys;
  for (Section &section : led.sections("key")) {
    HandleKey key;
    const std::optional<double> time = section.number("time");
    if (!time || *time < 0) section.fail("time must be 0 or more");
    key.time = *time;
    if (!keys.empty() && key.time <= keys.back().time) section.fail("the times of keys must ascend");
    if (position) key.offset = section.vector("offset");
    if (orientation) key.rotation = section.vector("rotate_degrees");
    for (double &r : key.rotation) r *= kRadians;
    section.reject_unknown_keys();  // an offset of what does not hold a position, too
    keys.push_back(key);
  }
  return keys;
}

uint32_t read_axes(Section &section) {
  const std::string letters = section.text("axes").value_or("xyz");
  const std::string known = "xyz";
  uint32_t axes = 0;
  for (char letter : letters) {
    const std::size_t axis = known.find(letter);
    if (axis == std::string::npos) section.fail(*section.find("axes"), "axes must be some of the letters xyz");
    axes |= uint32_t{1} << axis;  // SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z
  }
  if (axes == 0) section.fail(*section.find("axes"), "axes must be some of the letters xyz");
  return axes;
}

Support read_support(Section section, std::vector<std::string> &inputs) {
  Support support = read_where(section, inputs);
  support.clamped = section.choice("kind", {"fixed", "clamped"}) == "clamped";
  if (section.find("axes")) {
    if (support.clamped) section.fail(*section.find("axes"), "axes is for a fixed support: a clamped one is held in place");
    support.axes = read_axes(section);
  }
  support.symmetric = section.flag("symmetric").value_or(false);
  if (support.symmetric && !support.axes) section.fail(*section.find("symmetric"), "symmetric goes with axes, the normals of the planes of symmetry");
  support.keys = read_keys(section, true, true);
  if (section.find("about")) support.about = section.vector("about");
  if (support.axes && !support.keys.empty())
    section.fail(*section.find("axes"), "a support with a key is held in place: it has no axes");
  if (support.about && support.keys.empty()) section.fail(*section.find("about"), "about is for a support with a key");
  section.reject_unknown_keys();
  return support;
}

// All of a handle but what moves it.
Handle read_grip(Section &section) {
  Handle handle;
  const std::string kind = section.choice("kind", {"position", "orientation", "both"});
  handle.holds_position = kind != "orientation";
  handle.holds_orientation = kind != "position";
  handle.vertex = section.count("vertex");
  handle.nearest = section.vector("nearest");
  handle.side = read_side(section);
  handle.group = section.text("group").value_or("");
  if (handle.vertex.has_value() + (section.find("nearest") != nullptr) + handle.side.has_value() + !handle.group.empty() != 1)
    section.fail("name the vertex by vertex, nearest, side or group, one of them");
  handle.axes = read_axes(section);
  handle.compliance = section.number("compliance").value_or(0);
  if (handle.compliance < 0) section.fail(*section.find("compliance"), "compliance must not be negative");
  handle.release = section.number("release");
  return handle;
}

Handle read_handle(Section section) {
  Handle handle = read_grip(section);
  handle.keys = read_keys(section, handle.holds_position, handle.holds_orientation);
  section.reject_unknown_keys();
  return handle;
}

Handle read_attachment(Section section, const Skeleton &skeleton) {
  Handle handle = read_grip(section);
  handle.bone = named_bone(section, "bone", skeleton).motion;
  section.reject_unknown_keys();
  return handle;
}

Collider read_moving_collider(Section section, const Skeleton &skeleton, std::vector<std::string> &inputs) {
  Collider collider = read_collider(section, inputs);
  if (section.find("bone")) collider.bone = named_bone(section, "bone", skeleton).motion;
  collider.keys = read_keys(section, true, true);
  section.reject_unknown_keys();
  return collider;
}

Force read_force(Section section) {
  Force force;
  force.vertex = section.count("vertex");
  const std::vector<double> nearest = section.numbers("nearest", 3);
  if (force.vertex.has_value() != nearest.empty()) section.fail("name the vertex by vertex or nearest");
  force.nearest = section.vector("nearest");
  if (!section.find("vector")) section.fail("vector is missing: the force, in world axes");
  force.vector = section.vector("vector");
  section.reject_unknown_keys();
  return force;
}

Wind read_wind(Section section, const Scene &scene) {
  Wind wind;
  wind.density = air_density(scene);
  if (!section.find("velocity")) section.fail("velocity is missing: that of the air, in world axes");
  wind.velocity = section.vector("velocity");
  wind.density = section.not_negative("density", wind.density);
  wind.normal_drag = section.not_negative("normal_drag", wind.normal_drag);
  wind.tangential_drag = section.not_negative("tangential_drag", wind.tangential_drag);
  wind.gust = section.not_negative("gust", wind.gust);
  wind.gust_frequency = section.positive("gust_frequency", wind.gust_frequency);
  section.reject_unknown_keys();
  return wind;
}

Damping read_damping(Section section, std::vector<std::string> &inputs) {
  Damping d;
  d.ratio = section.number("ratio").value_or(0);
  d.mass = section.number("mass").value_or(0);
  d.stiffness = section.number("stiffness").value_or(0);
  if (const std::optional<std::string> path = section.file("factors")) {
    inputs.push_back(*path);
    d.path = *path;
    d.factors = read_numbers(*path, "factors", true);
  }
  section.reject_unknown_keys();
  return d;
}

void read_reduced(Section &section, Scene &scene) {
  scene.reduced.fields = section.count("reduced_fields").value_or(0);
  scene.reduced.elements = section.count("reduced_elements").value_or(0);
  scene.reduced.poses = section.count("reduced_poses").value_or(0);
  scene.reduced.trained = section.flag("reduced_trained").value_or(true);
  scene.reduced.gravity = section.not_negative("reduced_gravity", 0);
  scene.auto_error = section.not_negative("auto_error", 0);
  scene.auto_operations = section.not_negative("auto_operations", 0);
}

void read_simulation(Section section, Scene &scene) {
  scene.modes = section.count("modes").value_or(0);
  scene.support_fields = section.count("support_fields");
  scene.double_precision = section.choice("precision", {"f32", "f64"}) == "f64";
  if (section.find("method")) scene.method = *host::find_method(section.choice("method", host::method_names()));
  read_reduced(section, scene);
  scene.sagged = section.flag("sagged").value_or(false);
  scene.is_static = section.flag("static").value_or(false);
  if (section.find("integrator")) {
    const std::string name = section.choice("integrator", {"implicit-euler", "exact", "second-order"});
    scene.integrator = name == "exact" ? SW_INTEGRATOR_EXACT : name == "second-order" ? SW_INTEGRATOR_SECOND_ORDER : SW_INTEGRATOR_IMPLICIT_EULER;
  }
  if (scene.integrator == SW_INTEGRATOR_EXACT && !host::moves_by_modes(scene.method) && !host::needs_choice(scene.method))
    section.fail(*section.find("integrator"), "integrator exact is one of modes; a nonlinear shell takes \"second-order\"");
  scene.deterministic = section.flag("deterministic").value_or(false);
  scene.frame_rate = section.positive("frame_rate", scene.frame_rate);
  scene.steps_per_frame = section.count("steps_per_frame").value_or(1);
  if (scene.steps_per_frame == 0) section.fail("steps_per_frame must be at least 1");
  scene.duration = section.positive("duration", scene.duration);
  scene.gravity = section.vector("gravity");
  scene.stiffness_factor = section.positive("stiffness_factor", 1);
  if (const std::optional<uint32_t> steps = section.count("correction_steps")) {
    if (*steps > 100) section.fail("correction_steps must be at most 100");
    scene.correction_steps = *steps;
  }
  const bool corrects = scene.correction_steps && scene.correction_steps != SW_STEPS_AUTO;
  scene.push_out = section.flag("push_out").value_or(false);
  if (scene.push_out && corrects) section.fail(*section.find("push_out"), "push_out and correction_steps both move what is shown: choose one");
  scene.contact_patches = read_indices(section, "contact_patches");
  if (section.find("contact_patches_near")) scene.patches_near = section.positive("contact_patches_near", 0);
  if (const auto most = section.count("contact_patches_most")) {
    if (!scene.patches_near) section.fail("contact_patches_most goes with contact_patches_near");
    if (*most < 1 || *most > 128) section.fail("contact_patches_most must be 1 to 128");
    scene.n_patches_near = *most;
  }
  section.reject_unknown_keys();
}

Expectations read_expectations(Section section) {
  Expectations e;
  e.modes = section.count("modes");
  e.zero_modes = section.count("zero_modes");
  e.max_displacement = section.range("max_displacement");
  e.final_displacement = section.range("final_displacement");
  e.lowest_frequency = section.range("lowest_frequency");
  e.handle_residual = section.number("handle_residual");
  e.handles_met = section.flag("handles_met").value_or(false);
  e.turn_in_range = section.flag("turn_in_range").value_or(false);
  e.energy_never_grows = section.flag("energy_never_grows").value_or(false);
  e.settled = section.number("settled");
  section.reject_unknown_keys();
  return e;
}

// The keys of a method are its name with underscores and what is meant, such as warp_error = [low, high]; in [expect.reference]
// a number for each equilibrium.
std::vector<ComparisonNumbers> read_numbers(Section &expect, std::optional<Section> &reference, const char *what) {
  std::vector<ComparisonNumbers> all;
  for (const uint32_t method : host::methods()) {
    if (host::needs_choice(method)) continue;
    std::string key = host::method_name(method) + std::string("_") + what;
    std::replace(key.begin(), key.end(), '-', '_');
    ComparisonNumbers numbers;
    numbers.method = method;
    numbers.range = expect.range(key.c_str());
    if (reference) numbers.reference = reference->list(key.c_str());
    if (numbers.range || !numbers.reference.empty()) all.push_back(numbers);
  }
  return all;
}

ComparisonExpectations read_comparison_expectations(Section section) {
  ComparisonExpectations e;
  e.modes = section.count("modes");
  e.lowest_frequency = section.range("lowest_frequency");
  e.turn_in_range = section.flag("turn_in_range").value_or(false);
  e.warp_below_lma = section.flag("warp_below_lma").value_or(false);
  e.errors_grow = section.flag("errors_grow").value_or(false);
  e.stiffer_differs_less = section.flag("stiffer_differs_less").value_or(false);
  std::optional<Section> reference = section.section("reference");
  if (reference) e.tolerance = reference->positive("tolerance", 0);
  e.errors = read_numbers(section, reference, "error");
  e.area_changes = read_numbers(section, reference, "area_change");
  if (reference) reference->reject_unknown_keys();
  section.reject_unknown_keys();
  return e;
}

// The full shell is in every comparison, and a model that was made for a choice has one method alone.
bool can_be_compared(uint32_t method) { return !host::is_full_shell(method) && !host::needs_choice(method); }

std::string names_to_compare() {
  std::string names;
  for (const uint32_t method : host::methods())
    if (can_be_compared(method)) names += (names.empty() ? "" : ", ") + std::string(host::method_name(method));
  return names;
}

Comparison read_comparison(Section section, const Scene &scene) {
  Comparison c;
  const toml::node *node = section.find("methods");
  const toml::array *array = node ? node->as_array() : nullptr;
  for (std::size_t i = 0; array && i < array->size(); ++i)
    if (const auto method = host::find_method((*array)[i].value<std::string>().value_or(""));
        method && can_be_compared(*method))
      c.methods.push_back(*method);
  if (!array || c.methods.empty() || c.methods.size() != array->size())
    section.fail(node ? *node : section.table(), "methods must be a list, in quotes, of some of " + names_to_compare());
  c.gravities = section.list("gravities");
  if (c.gravities.empty()) section.fail("gravities is missing: the lengths that gravity is to have, ascending");
  if (const std::vector<double> factors = section.list("bending"); !factors.empty()) c.bending = factors;
  for (const char *key : {"gravities", "bending"}) {
    const std::vector<double> &values = std::string(key) == "bending" ? c.bending : c.gravities;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!(values[i] > 0) || (i > 0 && values[i] <= values[i - 1]))
        section.fail(*section.find(key), std::string(key) + " must be above 0 and ascend");
  }
  if (scene.gravity == std::array<double, 3>{}) section.fail("gravity in [simulation] must give the direction");
  section.reject_unknown_keys();
  return c;
}

PaperFigures read_paper(Section section) {
  PaperFigures p;
  p.source = section.text("source").value_or("paper");
  p.note = section.text("note").value_or("");
  p.vertices = section.number("vertices");
  p.edges = section.number("edges");
  p.triangles = section.number("triangles");
  p.modes = section.number("modes");
  p.precompute_seconds = section.number("precompute_seconds");
  p.steps_per_second = section.number("steps_per_second");
  section.reject_unknown_keys();
  return p;
}

toml::table parse(const std::string &path, const std::string &contents) {
  try {
    return toml::parse(contents);
  } catch (const toml::parse_error &error) {
    throw FileError(path, error.source().begin.line, std::string(error.description()));
  }
}

void read_proxy(Section &section, Scene &scene) {
  scene.proxy.vertices = section.count("proxy").value_or(0);
  if (const auto thickness = section.number("proxy_thickness")) {
    if (!(*thickness >= 0)) section.fail(*section.find("proxy_thickness"), "proxy_thickness must not be negative");
    scene.proxy.thickness = *thickness;
  }
  scene.proxy.cut = section.flag("proxy_cut").value_or(false);
  scene.proxy.calibrated = section.flag("proxy_calibrated").value_or(true);
  for (const char *key : {"proxy_thickness", "proxy_cut", "proxy_calibrated"})
    if (section.find(key) && !scene.proxy.vertices) section.fail(*section.find(key), std::string(key) + " goes with proxy");
  if (scene.proxy.vertices && scene.render_path.empty()) scene.render_path = scene.mesh_path;
}

// Of a mesh that is animated by files.
void read_animation(Section &section, Scene &scene) {
  if (const auto path = section.file("motion")) {
    scene.motion_path = *path;
    const std::vector<std::string> files = files_of_motion(*path);
    scene.inputs.insert(scene.inputs.end(), files.begin(), files.end());
    for (const Support &support : scene.supports)
      if (!support.keys.empty()) section.fail(*section.find("motion"), "motion says where all supports are: none may have a key");
  }
  scene.follow_rest = section.flag("follow_rest").value_or(false);
  if (!scene.motion_path.empty() && !scene.follow_rest && scene.supports.empty())
    section.fail(*section.find("motion"), "motion leads supports, and there are none: give a support, or follow_rest = true");
  if (!section.find("follow_rest")) return;
  const toml::node &at = *section.find("follow_rest");
  if (scene.motion_path.empty()) section.fail(at, "follow_rest goes with motion");
  if (scene.follow_rest && scene.is_static) section.fail(at, "a rest shape that follows moves, and static finds an equilibrium");
}

// What a file says of its one shell at the top, and of several in a table each.
void read_substance(Section &section, const std::string &path, Scene &scene) {
  const auto mesh = section.file("mesh");
  if (!mesh) section.fail("mesh is missing: name the OBJ, OFF or PLY file, relative to the scene");
  scene.mesh_path = *mesh;
  scene.inputs.insert(scene.inputs.end(), {path, scene.mesh_path});
  if (const auto render = section.file("render")) {
    scene.render_path = *render;
    scene.inputs.push_back(*render);
  }
  scene.usd_prim = section.text("usd_prim").value_or("");
  if (const auto distance = section.number("weld")) {
    if (!(*distance >= 0)) section.fail(*section.find("weld"), "weld must not be negative");
    scene.weld = *distance;
    if (scene.render_path.empty()) scene.render_path = scene.mesh_path;
  }
  read_proxy(section, scene);
  if (auto s = section.section("material")) scene.material = read_material(*s, scene.metres_per_unit, scene.inputs);
  if (auto s = section.section("damping")) scene.damping = read_damping(*s, scene.inputs);
  for (Section &s : section.sections("support"))
    scene.supports.push_back(read_support(std::move(s), scene.inputs));
  for (Section &s : section.sections("tie")) scene.ties.push_back(read_tie(std::move(s)));
  for (Section &s : section.sections("force")) scene.loads.forces.push_back(read_force(std::move(s)));
  if (auto s = section.section("wind")) scene.loads.wind = read_wind(*s, scene);
  read_animation(section, scene);
  if (auto s = section.section("expect")) {
    if (scene.comparison)
      scene.comparison->expect = read_comparison_expectations(*s);
    else
      scene.expect = read_expectations(*s);
  }
}

// A frame does not go with a mesh that is animated.
void check_animated(Section &section, const Scene &scene) {
  const toml::node *at = section.find("frame");
  if (at && !scene.motion_path.empty()) section.fail(*at, "frame does not go with motion, which says where the supports are");
}

void read_single(Section &top, const std::string &path, Scene &scene) {
  if (auto s = top.section("comparison")) scene.comparison = read_comparison(*s, scene);
  read_substance(top, path, scene);
  for (const char *key : {"frame", "handle", "motion", "render"})
    if (scene.comparison && top.find(key)) top.fail(*top.find(key), std::string(key) + " has no part in a [comparison], whose equilibria nothing leads and nobody draws");
  if (auto s = top.section("frame")) {
    scene.motion = read_motion(*s, "pivot", scene.duration);
    s->reject_unknown_keys();
    check_animated(top, scene);
  }
  for (Section &s : top.sections("handle")) scene.handles.push_back(read_handle(std::move(s)));
  if (auto s = top.section("paper")) scene.paper = read_paper(*s);
}

// One of several shells; `scene` has what they share.
Scene read_shell(Section section, const std::string &path, const SceneFile &file, Scene scene) {
  const std::string name = section.text("name").value_or("");
  if (name.empty()) section.fail("a shell needs a name");
  scene.name = file.name + "_" + name;
  scene.title += ": " + name;
  for (const Scene &other : file.shells)
    if (other.name == scene.name) section.fail(*section.find("name"), "two shells are called '" + name + "'");
  scene.modes = section.count("modes").value_or(scene.modes);
  read_substance(section, path, scene);
  if (section.find("frame")) scene.motion = *named_bone(section, "frame", file.skeleton).motion;
  for (Section &s : section.sections("attach")) scene.handles.push_back(read_attachment(std::move(s), file.skeleton));
  check_animated(section, scene);
  section.reject_unknown_keys();
  return scene;
}

std::vector<double> read_times(Section &section, const char *key) {
  const toml::node *node = section.find(key);
  if (node && !node->as_array()) section.fail(*node, std::string(key) + " must be a list of numbers");
  return section.numbers(key, node ? node->as_array()->size() : 0);
}

std::vector<std::string> read_formats(Section &section) {
  const toml::node *node = section.find("formats");
  std::vector<std::string> formats;
  const std::vector<std::string> &known = file_formats();
  if (const toml::array *array = node->as_array())
    for (const toml::node &word : *array) {
      formats.push_back(word.value<std::string>().value_or(""));
      if (std::find(known.begin(), known.end(), formats.back()) == known.end()) formats.clear();
      if (formats.empty()) break;
    }
  if (formats.empty()) section.fail(*node, "formats must be a list, in quotes, of some of pc2, usd, gltf");
  return formats;
}

}  // namespace

double air_density(const Scene &scene) {
  const double metres = scene.material.sheet ? scene.metres_per_unit : 1;
  return Wind().density * metres * metres * metres;
}

SceneFile read_scene_file(const std::string &path) {
  const std::string contents = read_file(path);
  const toml::table table = parse(path, contents);
  Section top(path, "", table);
  SceneFile file;
  Scene scene;
  file.name = scene.name = std::filesystem::path(path).stem().string();
  file.title = scene.title = top.text("title").value_or(scene.name);
  if (top.find("up")) {
    const std::string axis = top.choice("up", {"x", "y", "z"});
    scene.up = static_cast<uint32_t>(axis[0] - 'x');
  }
  scene.scale = top.positive("scale", 1);
  scene.length_unit = top.text("length_unit").value_or("");
  scene.obj_frames = top.count("obj_frames").value_or(scene.obj_frames);
  scene.obj_times = read_times(top, "obj_times");
  if ((scene.obj_every = top.count("obj_every")) == 0u) top.fail(*top.find("obj_every"), "obj_every must be above 0");
  if (top.find("formats")) scene.formats = read_formats(top);
  scene.metres_per_unit = top.positive("metres_per_unit", 1);
  if (auto s = top.section("simulation")) read_simulation(*s, scene);
  for (Section &s : top.sections("bone"))
    file.skeleton.push_back(read_bone(std::move(s), file.skeleton, scene.duration));
  for (Section &s : top.sections("collider"))
    scene.colliders.push_back(read_moving_collider(std::move(s), file.skeleton, scene.inputs));
  for (Section &s : top.sections("shell")) file.shells.push_back(read_shell(std::move(s), path, file, scene));
  if (file.shells.empty()) {
    if (!file.skeleton.empty()) top.fail("bones are for [[shell]] tables, of which there are none");
    read_single(top, path, scene);
    file.shells.push_back(scene);
  }
  top.reject_unknown_keys();
  return file;
}

Scene read_scene(const std::string &path) {
  SceneFile file = read_scene_file(path);
  if (file.shells.size() != 1) throw FileError(path, 0, "holds several shells where one is asked for");
  return file.shells.front();
}

std::vector<uint32_t> read_vertex_list(const std::string &path) {
  const std::string contents = read_file(path);
  TextLines lines(path, contents);
  std::vector<uint32_t> vertices;
  while (lines.next_line())
    while (lines.has_word()) {
      const uint64_t index = lines.index("a vertex index");
      if (index > UINT32_MAX) lines.fail("vertex index " + std::to_string(index) + " is too large");
      vertices.push_back(static_cast<uint32_t>(index));
    }
  return vertices;
}

}  // namespace cli

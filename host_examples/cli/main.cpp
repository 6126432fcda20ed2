// shellwarp: simulates thin shells from the command line, and shows how a host uses the library from start to end.
//
// Exit status: 0 all is well; 1 bad input, a failed call, or an expectation of the scene that does not hold; 2 wrong usage;
// 130 stopped by Ctrl-C or SIGTERM.
#include "closest.hpp"
#include "material.hpp"
#include "mesh.hpp"
#include "method.hpp"
#include "moving_files.hpp"
#include "new_scene.hpp"
#include "progress.hpp"
#include "proxy.hpp"
#include "rim.hpp"
#include "run.hpp"
#include "selection.hpp"
#include "scene.hpp"
#include "shell.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "CLI11.hpp"

namespace cli {

namespace {

constexpr int kWrongUsage = 2;
constexpr double kGravity = 9.8;  // m/s^2

std::string counted(std::size_t n, const char *noun) { return std::to_string(n) + " " + noun + (n == 1 ? "" : "s"); }

// All of one kind: each on its line if they are few, else the first and how many more.
void print_diagnostics(const std::string &path, const char *severity, const SwDiagnostic *diagnostics,
                       std::size_t count) {
  constexpr std::size_t kFew = 3;
  for (std::size_t k = 0; k < (count > kFew ? 1 : count); ++k)
    std::printf("%s: %s: %s%s\n", path.c_str(), severity, reinterpret_cast<const char *>(diagnostics[k].message),
                count > kFew ? (" (and " + std::to_string(count - 1) + " more like it)").c_str() : "");
}

// Where it lies, and what may be named to hold it.
void print_extent(const std::string &path, const Mesh &mesh) {
  const Bounds box = bounds(mesh);
  std::printf("%s: x %.4g to %.4g, y %.4g to %.4g, z %.4g to %.4g", path.c_str(), box.low[0], box.high[0], box.low[1],
              box.high[1], box.low[2], box.high[2]);
  const char *before = "; groups: ";
  for (const auto &[name, vertices] : mesh.groups) {
    std::printf("%s%s", before, name.c_str());
    before = ", ";
  }
  std::printf("\n");
}

int check_mesh(const std::string &path, double scale) {
  Mesh mesh = read_mesh(path);
  for (double &x : mesh.positions) x *= scale;
  const std::vector<SwDiagnostic> diagnostics = shellwarp::check_mesh(
      shellwarp::mesh_desc(mesh.positions.data(), mesh.n_vertices(), mesh.triangles.data(), mesh.n_triangles()));
  std::size_t errors = 0;
  for (std::size_t first = 0, last; first < diagnostics.size(); first = last) {  // they come sorted by kind
    const SwDiagnostic &d = diagnostics[first];
    for (last = first; last < diagnostics.size() && diagnostics[last].kind == d.kind;) ++last;
    const bool error = d.severity == SW_SEVERITY_ERROR;
    errors += error ? last - first : 0;
    print_diagnostics(path, error ? "error" : "warning", &diagnostics[first], last - first);
  }
  std::printf("%s: %u vertices, %u triangles, %s, %s%s\n", path.c_str(), mesh.n_vertices(), mesh.n_triangles(),
              counted(errors, "error").c_str(), counted(diagnostics.size() - errors, "warning").c_str(),
              diagnostics.empty() ? "" : "; vertices and triangles are numbered from 0");
  const bool touching = std::any_of(diagnostics.begin(), diagnostics.end(),
                                    [](const SwDiagnostic &d) { return d.kind == SW_DIAGNOSTIC_COINCIDENT_VERTICES; });
  if (touching) std::printf("%s: try: --weld 0 (weld) makes vertices at the same place one\n", path.c_str());
  if (errors) std::printf("%s: try: --proxy 1000 (proxy) simulates a mesh of so many vertices that is made of this one; where it is refused, --proxy-cut (proxy_cut) cuts it\n", path.c_str());
  print_extent(path, mesh);
  print_doubt_of_unit(path, mesh);
  return errors ? kFailure : 0;
}

// ----------------------------------------------------------------------------------------------------------- options

// CLI11's own words for these name neither the number that is wrong nor what would be right.
CLI::Validator words_for(const char *what, bool (*good)(double)) {
  const auto complaint = [=](const std::string &text) {
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool number = *end == 0 && end != text.c_str() && std::isfinite(value);
    return number && good(value) ? std::string() : "'" + text + "' is not " + what;
  };
  return CLI::Validator(complaint, "");
}

CLI::Validator number() {
  return words_for("a number", [](double) { return true; });
}
CLI::Validator positive() {
  return words_for("a number above 0", [](double x) { return x > 0; });
}
CLI::Validator not_negative() {
  return words_for("a number from 0", [](double x) { return x >= 0; });
}
CLI::Validator whole() {
  return words_for("a whole number above 0", [](double x) { return x >= 1 && x <= UINT32_MAX && x == std::floor(x); });
}

// The names, each with what menus call it.
std::string methods_in_words() {
  std::string words;
  for (const uint32_t method : host::methods())
    words +=
        (words.empty() ? "" : "; ") + std::string(host::method_name(method)) + " (" + sw_method_label(method) + ")";
  return words;
}

void add_run_options(CLI::App &app, Scene &overrides, RunOptions &options) {
  app.add_option("--out", options.out, "Directory for the point cache, OBJ frames and the table of frames");
  app.add_option("--formats", options.formats, "Files of the motion, with commas between: pc2, usd, gltf (pc2)")
      ->delimiter(',')
      ->check(CLI::IsMember(file_formats()));
  app.add_option("--every", overrides.obj_every, "Write every so many frames as OBJ files, in place of those of largest displacement: 1 for all")
      ->check(whole());
  app.add_option("--frames", options.frames, "Number of frames, in place of the duration")->check(whole());
  app.add_option("--steps-per-frame", options.steps_per_frame, "Steps between frames: more are more accurate")->check(whole());
  app.add_option("--modes", overrides.modes, "Number of vibration modes")->check(whole());
  app.add_option("--method", options.method, "How the shell moves: " + methods_in_words())
      ->check(CLI::IsMember(host::method_names()));
  app.add_flag("--linear", options.linear, "The same as --method lma");
  app.add_flag("--static", overrides.is_static, "The equilibrium in place of the motion");
  app.add_flag_callback("--exact", [&overrides] { overrides.integrator = SW_INTEGRATOR_EXACT; }, "Exact propagator in place of implicit Euler");
  app.add_flag_callback("--second-order", [&overrides] { overrides.integrator = SW_INTEGRATOR_SECOND_ORDER; }, "Steps of second order of the full shell; --exact of modes");
  app.add_flag("--double", overrides.double_precision, "Run-time basis in double precision");
  app.add_option("--correction-steps", options.correction_steps, "Newton steps of the full shell in each frame that is shown, 0 to 100; by default none, and with --static as many as fields need")
      ->check(words_for("a whole number from 0 to 100", [](double x) { return x >= 0 && x <= 100 && x == std::floor(x); }));
  app.add_flag("--plan", options.plan, "After the last frame, what a step uses and leaves out, and at what cost");
  CLI::Option *certify = app.add_flag("--certify", options.certify,
                                      "Estimate the error of the last frame also above 50,000 vertices");
  app.add_flag("--no-certify", options.no_certify,
               "Leave out the estimate of the last frame's error against the nonlinear shell")
      ->excludes(certify);
  app.add_option("--html", options.html, "Page to write, with a player of the motion: one file that any browser opens");
  app.add_option("--png", options.png, "Still picture to write: at rest, where it moved furthest, and at the end");
  app.add_flag("--view", options.view, "Write the page (beside --out, or among temporary files) and open it");
  app.add_option("--compare", options.compare, "Further methods on the page, with commas between")
      ->delimiter(',')
      ->check(CLI::IsMember(host::method_names()));
  app.add_flag("--yes", options.yes, "Run although it takes very many frames, or more room than is free");
  app.add_flag("-q,--quiet", options.quiet, "No progress and no table; failures are still told");
}

void apply_overrides(const Scene &overrides, Scene &scene) {
  if (overrides.modes) scene.modes = overrides.modes;
  if (overrides.obj_every) scene.obj_every = overrides.obj_every;
  scene.is_static |= overrides.is_static;
  if (overrides.integrator) scene.integrator = overrides.integrator;
  scene.double_precision |= overrides.double_precision;
}

void apply_options(const RunOptions &options, Scene &scene) {
  if (!options.method.empty()) scene.method = *host::find_method(options.method);
  if (options.linear) scene.method = SW_METHOD_LMA;
  if (options.correction_steps) scene.correction_steps = *options.correction_steps;
  if (scene.push_out && options.correction_steps.value_or(0))
    throw std::runtime_error("push_out and --correction-steps (correction_steps) both move what is shown: choose one");
  if (options.steps_per_frame) {
    scene.steps_per_frame = *options.steps_per_frame;
    scene.steps_open = false;
  }
  if (!options.formats.empty()) scene.formats = options.formats;
  if (scene.is_static && scene.loads.wind && scene.loads.wind->gust > 0)
    throw std::runtime_error("gusts (--gust, gust of [wind]) take time, and --static (static) finds an equilibrium");
}

struct SupportOptions {
  std::vector<std::array<double, 6>> boxes;
  std::vector<std::string> lists;
};

void add_support_options(CLI::App &app, const std::string &verb, const std::string &meaning, SupportOptions &options) {
  const auto add_box = [&options](const std::array<double, 6> &box) { options.boxes.push_back(box); };
  app.add_option_function<std::array<double, 6>>("--" + verb + "-box", add_box, meaning + " the vertices in this box")
      ->type_name("X0 Y0 Z0 X1 Y1 Z1")
      ->check(number())
      ->trigger_on_parse();
  app.add_option("--" + verb + "-list", options.lists, meaning + " the vertices whose indices (from 0) this file lists")
      ->type_name("FILE");
}

void add_supports(const SupportOptions &options, bool clamped, Scene &scene) {
  for (const std::array<double, 6> &b : options.boxes)
    scene.supports.push_back({clamped, Bounds{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}}, {}});
  for (const std::string &path : options.lists) {
    scene.supports.push_back({clamped, std::nullopt, read_vertex_list(path)});
    scene.inputs.push_back(path);
  }
}

struct SimulateOptions {
  Scene scene;
  std::vector<std::string> pins, handles, colliders, growths;
  std::optional<std::array<double, 3>> gravity, wind;
  double gust = 0;
  std::string up, preset;
  std::optional<double> young, poisson, thickness, volume_density;
  SupportOptions fixed, clamped;
  double tie = 0;
  std::optional<double> step;
  RunOptions run;
};

// All but how many vertices it has, with and without dashes.
void add_proxy_details(CLI::App &app, ProxyOptions &o) {
  const CLI::Validator at_least_0 = words_for("a number from 0 on", [](double x) { return x >= 0; });
  app.add_option("--proxy-thickness", o.thickness, "Two sides no further apart become the sheet in their middle; 0 keeps both (found)")->check(at_least_0);
  app.add_flag_callback("--proxy-uncalibrated", [&o] { o.calibrated = false; }, "Do not fit the proxy's stiffness to the mesh's");
  app.add_flag("--proxy-cut", o.cut, "Cut the mesh where it is no manifold, in place of an error");
}

void add_proxy_options(CLI::App &app, ProxyOptions &o) {
  app.add_option("--proxy", o.vertices, "Simulate a mesh of about so many vertices made of the file, whatever that is made of; the file's own vertices follow as by --render")
      ->check(whole());
  add_proxy_details(app, o);
}

void add_proxy_command(CLI::App &app, ProxyCommand &o) {
  app.add_option("mesh", o.mesh_path, "OBJ, OFF or PLY file")->required();
  app.add_option("vertices", o.options.vertices, "How many")->required()->check(whole());
  app.add_option("--out", o.out, "OBJ file to write");
  app.add_option("--scale", o.scale, "Factor on the mesh's coordinates (1)")->check(positive());
  app.add_option("--weld", o.weld, "Make vertices within this distance one (those at the same place are)")
      ->check(words_for("a number from 0 on", [](double x) { return x >= 0; }));
  add_proxy_details(app, o.options);
  app.add_option("--pin", o.pins, "What is clamped where frequencies are compared, as of simulate")->type_name("WHAT");
  app.add_flag("--no-frequencies{false}", o.frequencies, "Leave out the comparison of frequencies");
}

// A sheet in engineering units: a known one, by its numbers, or by both.
void add_sheet_options(CLI::App &app, SimulateOptions &o) {
  app.add_option("--material", o.preset, "A known sheet: " + preset_names() + "; lengths are in metres, or as --metres-per-unit says");
  app.add_option("--young", o.young, "Young's modulus, Pa: with --poisson, --thickness and --volume-density a sheet that is the same on every mesh")
      ->check(number());
  app.add_option("--poisson", o.poisson, "Poisson's ratio, above -1 and at most 0.5")->check(number());
  app.add_option("--volume-density", o.volume_density, "Mass a volume, kg/m^3")->check(number());
  for (const char *constant : {"--k-area", "--k-length", "--k-bend", "--frequency", "--sag", "--density"})
    for (const char *sheet : {"--material", "--young", "--poisson", "--volume-density"})
      app.get_option(sheet)->excludes(app.get_option(constant));
}

void add_simulate_options(CLI::App &app, SimulateOptions &o) {
  app.add_option("mesh", o.scene.mesh_path, "OBJ, OFF or PLY file")->required();
  add_support_options(app, "fix", "Hold", o.fixed);
  add_support_options(app, "clamp", "Hold, and the slope there,", o.clamped);
  app.add_option("--pin", o.pins, "Clamp, place and slope, a side (low-x … high-z), vertices (0,4,10-20), box:X0,Y0,Z0,X1,Y1,Z1, "
                                  "nearest:X,Y,Z, rim:SIDE for the whole open edge there, a file of vertices, or a group of the OBJ file; several times for several")
      ->type_name("WHAT");
  app.add_option("--scale", o.scene.scale, "Factor on the mesh's coordinates: 0.01 makes metres of centimetres (1)")->check(positive());
  app.add_option("--up", o.up, "Axis that points upward; gravity is then 9.8 m/s^2 downward unless --gravity says otherwise")
      ->transform(CLI::IsMember({"x", "y", "z"}, CLI::ignore_case));
  app.add_option("--gravity", o.gravity, "Acceleration, length unit/s^2 (0 0 0, or by --up)")->type_name("X Y Z")->check(number());
  CLI::Option *wind = app.add_option("--wind", o.wind, "Velocity of the air, of 1.2 kg/m^3; steady, so that a shell that is damped leans and comes to rest, unless it has --gust")
      ->type_name("X Y Z")
      ->check(number());
  app.add_option("--gust", o.gust, "Gusts: the wind's velocity swells and falls by this part of it, 0.5 by half")
      ->check(not_negative())
      ->needs(wind);
  app.add_option("--growth", o.growths, "Lengths without stress grow by this factor at what --pin could name, and fade to 1 over the six rings of edges around: 1.3@rim:high-x ruffles an edge")
      ->type_name("FACTOR@WHAT");
  app.add_option("--handle", o.handles, "Lead a vertex: V:DX,DY,DZ@SECONDS with further offsets behind ':' and free@SECONDS to let go; V is "
                                        "a vertex, nearest:X,Y,Z, or a side or a group, of which it is the vertex in the middle, and a file of lines 'time x y z' may stand for the offsets")
      ->type_name("V:PATH");
  app.add_option("--collider", o.colliders, "A solid that the shell touches: plane:z=HEIGHT, sphere:R@X,Y,Z, capsule:R,HALF_LENGTH@X,Y,Z (along z), "
                                            "box:HX,HY,HZ@X,Y,Z, hull:FILE@X,Y,Z or mesh:FILE@X,Y,Z; behind ':' friction=F, thickness=T, of an open mesh "
                                            "one-sided and depth=D (solid behind its triangles by that), and offsets that move it, as of a handle; several times for several")
      ->type_name("SPEC");
  app.add_option("--render", o.scene.render_path, "OBJ, OFF or PLY file of the mesh that is drawn: its vertices follow, and are written beside the "
                                                  "simulated ones (with --out)")
      ->type_name("FILE");
  app.add_option("--tie", o.tie, "Tie pieces within this distance of each other stiffly, so that they move as one; vertices stay as they are");
  app.add_option("--weld", o.scene.weld, "Make vertices within this distance one, so that pieces that touch are one shell; the file's own vertices follow as by --render")
      ->check(words_for("a number from 0 on", [](double x) { return x >= 0; }));
  add_proxy_options(app, o.scene.proxy);
  app.add_option("--duration", o.scene.duration, "Seconds (5)")->check(positive());
  app.add_option("--step", o.step, "Seconds a frame, of one step or of --steps-per-frame (1/30, and as many steps as the motion needs where they are quick)")->check(positive());
  app.add_option("--k-area", o.scene.material.k_area, "Stiffness against change of area (1e4)")
      ->check(number());
  app.add_option("--k-length", o.scene.material.k_length,
                 "Stiffness against change of length (1e4)")
      ->check(number());
  app.add_option("--k-bend", o.scene.material.k_bend, "Bending stiffness (1)")->check(number());
  app.add_option("--frequency", o.scene.material.frequency, "Hz of the slowest swing, in place of the three stiffnesses")
      ->check(positive())
      ->excludes("--k-area")
      ->excludes("--k-length")
      ->excludes("--k-bend");
  app.add_option("--sag", o.scene.material.sag, "How far the shell hangs down at rest under gravity, the vertex that moves furthest; in place of the three stiffnesses")
      ->check(positive())
      ->excludes("--k-area")
      ->excludes("--k-length")
      ->excludes("--k-bend")
      ->excludes("--frequency");
  app.add_option("--thickness", o.thickness, "Of the sheet; with --frequency or --sag: how much rather it bends than stretches (a 200th of the size)")
      ->check(positive());
  app.add_option("--density", o.scene.material.density, "Mass an area (1)")->check(positive());
  add_sheet_options(app, o);
  app.add_option("--damping-ratio", o.scene.damping.ratio, "Of critical, the same for every mode (0)")->check(number());
  app.add_option("--obj-frames", o.scene.obj_frames, "How many frames of largest displacement become OBJ files (3)");
  app.add_option("--usd-prim", o.scene.usd_prim, "The prim of a USD asset that the file is to lie over, as /World/leaf")->type_name("PATH");
  app.add_option("--metres-per-unit", o.scene.metres_per_unit, "Of all lengths (1), in place of --scale: for --material, gravity by --up, air, the warning on units, USD and glTF")->check(positive());
  add_run_options(app, o.scene, o.run);
}

void apply_sheet(const SimulateOptions &o, Material &m) {
  m.sheet = !o.preset.empty() || o.young || o.poisson || o.volume_density;
  if (!o.preset.empty()) set_preset(o.preset, o.scene.metres_per_unit, m);
  if (m.sheet && o.preset.empty() && !(o.young && o.poisson && o.thickness && o.volume_density))
    throw std::runtime_error("a sheet needs --young, --poisson, --thickness and --volume-density, or --material");
  if (!m.sheet && o.thickness && !m.by_look())
    throw std::runtime_error("--thickness goes with --frequency or --sag, or with --young or --material");
  m.young = o.young.value_or(m.young);
  m.poisson = o.poisson.value_or(m.poisson);
  m.thickness = o.thickness.value_or(m.thickness);
  m.volume_density = o.volume_density.value_or(m.volume_density);
  if (const std::string none = resists_nothing(m); !none.empty()) throw std::runtime_error("--k-area, --k-length, --k-bend: " + none);
}

// What people call a unit of so many metres.
std::string unit_name(double metres) {
  const std::pair<double, const char *> known[] = {{1, "m"}, {0.1, "dm"}, {0.01, "cm"}, {0.001, "mm"}, {0.0254, "in"}, {0.3048, "ft"}};
  for (const auto &[size, name] : known)
    if (std::fabs(metres - size) < 1e-9 * size) return name;
  return "";
}

void add_growth(const std::string &word, Scene &scene) {
  const std::size_t at = word.find('@');
  char *end = nullptr;
  const double factor = std::strtod(word.c_str(), &end);
  if (at == std::string::npos || end != word.c_str() + at || !(factor > 0) || !std::isfinite(factor))
    throw std::runtime_error("--growth " + word + ": write FACTOR@WHAT, such as 1.3@high-x");
  const Support where = read_pin(word.substr(at + 1), scene.inputs);
  Mesh mesh = read_mesh(scene.mesh_path);
  for (double &x : mesh.positions) x *= scene.scale;  // as places of WHAT are
  scene.material.files.push_back({SW_MAP_GROWTH, "--growth", faded_growth(mesh, find_vertices(where, mesh, "--growth"), factor)});
}

int simulate_mesh(SimulateOptions &o) {
  if (o.scene.scale != 1 && o.scene.metres_per_unit != 1)
    throw std::runtime_error("--scale brings the mesh to metres, and --metres-per-unit says what unit it has, unscaled: give one of the two");
  apply_sheet(o, o.scene.material);
  add_supports(o.fixed, false, o.scene);
  add_supports(o.clamped, true, o.scene);
  for (const std::string &word : o.pins) o.scene.supports.push_back(read_pin(word, o.scene.inputs));
  for (const std::string &word : o.handles) o.scene.handles.push_back(read_path(word, o.scene.inputs));
  for (const std::string &word : o.colliders) o.scene.colliders.push_back(read_collider(word, o.scene.inputs));
  if (o.growths.size() > 1) throw std::runtime_error("--growth may stand once; a scene has regions for several (growth of [[material.region]])");
  for (const std::string &word : o.growths) add_growth(word, o.scene);
  if (!o.up.empty()) {
    o.scene.up = static_cast<uint32_t>(o.up[0] - 'x');
    o.scene.gravity[*o.scene.up] = -kGravity / o.scene.metres_per_unit;
  }
  if (o.gravity) o.scene.gravity = *o.gravity;
  if (o.wind) {
    o.scene.loads.wind.emplace();
    o.scene.loads.wind->velocity = *o.wind;
    o.scene.loads.wind->density = air_density(o.scene);
    o.scene.loads.wind->gust = o.gust;
  }
  o.scene.inputs.push_back(o.scene.mesh_path);
  if (o.tie > 0) o.scene.ties.push_back({{}, {}, 0, o.tie});
  if ((o.scene.weld || o.scene.proxy.vertices) && o.scene.render_path.empty()) o.scene.render_path = o.scene.mesh_path;
  if (!o.scene.render_path.empty()) o.scene.inputs.push_back(o.scene.render_path);
  o.scene.name = std::filesystem::path(o.scene.mesh_path).stem().string();
  o.scene.title = o.scene.name;
  o.scene.frame_rate = o.step ? 1 / *o.step : 30;
  o.scene.steps_open = !o.step;
  o.scene.length_unit = unit_name(o.scene.metres_per_unit);
  apply_options(o.run, o.scene);
  return run_shells({o.scene.name, o.scene.title, {o.scene}, {}}, o.run);
}

// -------------------------------------------------------------------------------------------------------------- main

// The first word that a command does not know, and what may have been meant.
int tell_unknown(const CLI::App &command, int argc, char **argv) {
  std::vector<std::string> known;
  for (const CLI::Option *option : command.get_options())
    for (const std::string &name : option->get_lnames()) known.push_back("--" + name);
  const std::vector<std::string> words(argv + 2, argv + argc);
  for (const std::string &word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (name.compare(0, 2, "--") != 0 || std::count(known.begin(), known.end(), name)) continue;
    std::fprintf(stderr, "shellwarp: %s has no option '%s'%s\n", command.get_name().c_str(), name.c_str(),
                 did_you_mean(name, known).c_str());
    return kWrongUsage;
  }
  std::string left;
  for (const std::string &word : command.remaining()) left += " '" + word + "'";
  std::fprintf(stderr, "shellwarp: %s was given words that belong to no option:%s\n", command.get_name().c_str(), left.c_str());
  return kWrongUsage;
}

// CLI11's own words, "--wind: 3 required X Y Z missing", read as if 3 of something were wanted. They begin with the option's name.
int tell_missing(const CLI::App &command, const std::string &words) {
  const std::string name = words.substr(0, words.find(':'));
  const CLI::Option *option = command.get_option_no_throw(name);
  if (option)
    std::fprintf(stderr, "shellwarp: %s takes %s, and some of it is missing\n", name.c_str(), option->get_type_name().c_str());
  else
    std::fprintf(stderr, "shellwarp: %s\n", words.c_str());
  return kWrongUsage;
}

int run_command_line(int argc, char **argv) {
  CLI::App app{"Thin shells in real time by modal warping"};
  app.set_version_flag("--version", std::string("shellwarp ") + sw_version_string());
  app.require_subcommand(1);
  app.allow_windows_style_options(false);  // on Windows, too, "/x" is a place

  std::string scene_path, mesh_path;
  Scene overrides;
  RunOptions run_options;
  CLI::App *run = app.add_subcommand("run", "Run a scene");
  run->add_option("scene", scene_path, "TOML file")->required();
  add_run_options(*run, overrides, run_options);

  SimulateOptions simulate_options;
  CLI::App *simulate = app.add_subcommand("simulate", "Simulate a mesh held at some vertices under gravity");
  add_simulate_options(*simulate, simulate_options);

  CLI::App *check = app.add_subcommand("check", "Say what is wrong with a mesh");
  double check_scale = 1;
  check->add_option("mesh", mesh_path, "OBJ, OFF or PLY file")->required();
  check->add_option("--scale", check_scale, "Factor on the mesh's coordinates, as of simulate (1)")->check(positive());

  ProxyCommand proxy_command;
  CLI::App *proxy = app.add_subcommand("proxy", "Make a mesh to simulate in a file's place, and tell how near it comes");
  add_proxy_command(*proxy, proxy_command);

  std::string new_path, new_mesh, new_up = "z";
  CLI::App *new_scene = app.add_subcommand("new-scene", "Write a scene with a comment at every key, which runs as it is");
  new_scene->add_option("scene", new_path, "TOML file to write")->required();
  new_scene->add_option("--mesh", new_mesh, "OBJ, OFF or PLY file; a leaf is written beside the scene unless there is one");
  new_scene->add_option("--up", new_up, "Axis that points upward (z); gravity is against it")->check(CLI::IsMember({"x", "y", "z"}));

  const auto named = [&](const CLI::App *command) { return argc > 1 && command->get_name() == argv[1]; };
  if (argc > 1 && argv[1][0] != '-' && !named(run) && !named(simulate) && !named(check) && !named(proxy) && !named(new_scene)) {
    std::fprintf(stderr, "shellwarp: there is no command '%s'; it must be run, simulate, check, proxy or new-scene%s (see --help)\n",
                 argv[1], did_you_mean(argv[1], {"run", "simulate", "check", "proxy", "new-scene"}).c_str());
    return kWrongUsage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError &) {
    return tell_unknown(*app.get_subcommands().front(), argc, argv);
  } catch (const CLI::ArgumentMismatch &error) {
    return tell_missing(*app.get_subcommands().front(), error.what());
  } catch (const CLI::ValidationError &error) {
    const std::string words = error.what();  // "--wind 3 --gust 0.5": the next option is taken for a number
    if (words.find("'--") != std::string::npos && !app.get_subcommands().empty()) return tell_missing(*app.get_subcommands().front(), words);
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  } catch (const CLI::ParseError &error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  }

  if (new_scene->parsed()) {
    const std::string assumed = write_new_scene(new_path, new_mesh, new_up[0]);
    std::printf("scene: %s: %s\nrun it: %s run %s --view\n", new_path.c_str(), assumed.c_str(), argv[0], new_path.c_str());
    return 0;
  }
  if (check->parsed()) return check_mesh(mesh_path, check_scale);
  if (proxy->parsed()) return run_proxy_command(proxy_command);
  if (simulate->parsed()) return simulate_mesh(simulate_options);
  SceneFile file = read_scene_file(scene_path);
  for (Scene &scene : file.shells) {
    apply_overrides(overrides, scene);
    apply_options(run_options, scene);
  }
  return run_shells(file, run_options);
}

}  // namespace

}  // namespace cli

int main(int argc, char **argv) {
  cli::catch_signals();
  try {
    const int status = cli::run_command_line(argc, argv);
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
    std::fprintf(stderr, "shellwarp: cannot write the standard output: %s\n", std::strerror(errno));
  } catch (const shellwarp::Error &error) {
    const bool stopped = error.status() == SW_ERROR_CANCELLED;
    std::fprintf(stderr, "shellwarp: %s\n",
                 stopped ? "stopped in the precompute; its files are as they were" : error.what());
    return stopped ? cli::kInterrupted : cli::kFailure;
  } catch (const std::bad_alloc &) {
    std::fprintf(stderr, "shellwarp: out of memory\n");
  } catch (const std::exception &error) {
    std::fprintf(stderr, "shellwarp: %s\n", error.what());
  }
  return cli::kFailure;
}

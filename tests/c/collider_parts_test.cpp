// Colliders of the command line host: how they are read, placed, moved and touched.
// Writes its files into the directory given as the first argument.
#include "advice.hpp"
#include "collider.hpp"
#include "energy_audit.hpp"
#include "progress.hpp"
#include "scene.hpp"
#include "selection.hpp"
#include "shell.hpp"
#include "simulation.hpp"
#include "summary.hpp"
#include "text_lines.hpp"

#include "test_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Vec3 = std::array<double, 3>;

constexpr double kPi = 3.141592653589793;
constexpr double kRounding = 1e-15;  // of sines and products of numbers near 1
// Of a gap or penetration after a step, in model sizes: sw_state_set_colliders.
constexpr double kGap = 2e-5;

std::string directory;

std::string write_file(const std::string &name, const std::string &contents) {
  const std::string path = (std::filesystem::path(directory) / name).string();
  std::ofstream(path, std::ios::binary) << contents;
  return path;
}

// The strip of the C tests, 4 x 0.2 about y = 0 at z = 0.
std::string strip_file() {
  const Strip strip = make_strip();
  std::string text;
  char line[128];
  for (int i = 0; i < STRIP_VERTICES; ++i) {
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", strip.positions[3 * i], strip.positions[3 * i + 1], strip.positions[3 * i + 2]);
    text += line;
  }
  for (int k = 0; k < STRIP_TRIANGLES; ++k) {
    std::snprintf(line, sizeof line, "f %u %u %u\n", strip.triangles[3 * k] + 1, strip.triangles[3 * k + 1] + 1, strip.triangles[3 * k + 2] + 1);
    text += line;
  }
  return write_file("strip.obj", text);
}

// A cube from -3 to 3, faces outward.
const char kCube[] = "v -3 -3 -3\nv 3 -3 -3\nv 3 3 -3\nv -3 3 -3\nv -3 -3 3\nv 3 -3 3\nv 3 3 3\nv -3 3 3\n"
                     "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

Vec3 placed(const SwColliderPoseDesc &pose, const Vec3 &x) {
  Vec3 y{};
  for (std::size_t i = 0; i < 3; ++i) {
    y[i] = pose.origin[i];
    for (std::size_t j = 0; j < 3; ++j) y[i] += pose.rotation[3 * i + j] * x[j];
  }
  return y;
}

void check_near(const Vec3 &found, const Vec3 &expected, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) CHECK_NEAR(found[k], expected[k], tolerance);
}

std::string refusal(const std::string &scene) {
  try {
    cli::read_scene_file(write_file("bad.toml", scene));
  } catch (const cli::FileError &error) {
    return error.what();
  }
  return "read without complaint";
}

// ------------------------------------------------------------------------------------------------------------ reading

void colliders_of_a_scene_are_read_in_full() {
  const cli::Scene scene = cli::read_scene(write_file(
      "full.toml", "mesh = 'strip.obj'\n[[collider]]\nkind = 'plane'\nnormal = [0, 2, 0]\nfriction = 0.5\nthickness = 0.01\n"
                   "[[collider]]\nkind = 'sphere'\nradius = 0.3\nposition = [1, 2, 3]\nrotate_degrees = [0, 90, 0]\n"
                   "key = [{ time = 1, offset = [0, 0, 1], rotate_degrees = [180, 0, 0] }]\n"
                   "[[collider]]\nkind = 'capsule'\nradius = 1\nhalf_length = 2\n[[collider]]\nkind = 'box'\nhalf_extents = [1, 2, 3]\n"
                   "[[collider]]\nkind = 'hull'\nmesh = 'rock.obj'\n[[collider]]\nkind = 'mesh'\nmesh = 'body.obj'\ncells = 100\none_sided = true\ndepth = 0.02\n"));
  const std::vector<cli::Collider> &c = scene.colliders;
  CHECK(c.size() == 6);
  if (c.size() != 6) return;
  for (uint32_t k = 0; k < 6; ++k) CHECK(c[k].kind == SW_COLLIDER_PLANE + k);
  CHECK(c[0].friction == 0.5 && c[0].thickness == 0.01 && !c[0].moves() && c[1].friction == 0);
  CHECK(c[1].radius == 0.3 && c[1].position[2] == 3 && c[1].keys.size() == 1 && c[1].moves());
  CHECK_NEAR(c[1].rotation[1], kPi / 2, kRounding);
  CHECK_NEAR(c[1].keys[0].rotation[0], kPi, kRounding);
  CHECK(c[2].radius == 1 && c[2].half_length == 2 && c[3].half_extents[1] == 2);
  // Relative to the scene, and known as files that no output may replace.
  const std::string body = (std::filesystem::path(directory) / "body.obj").lexically_normal().string();
  CHECK(c[4].mesh_path != body && c[5].mesh_path == body && c[5].cells == 100 && c[5].one_sided && c[5].depth == 0.02);
  CHECK(std::count(scene.inputs.begin(), scene.inputs.end(), body) == 1);
}

void all_shells_of_a_file_touch_its_colliders_which_bones_may_carry() {
  const cli::SceneFile file = cli::read_scene_file(write_file(
      "shells.toml", "[[bone]]\nname = 'arm'\n[[bone.translate]]\naxis = [0, 0, 1]\namplitude = 1\n"
                     "[[collider]]\nkind = 'sphere'\nradius = 1\nbone = 'arm'\n[[collider]]\nkind = 'mesh'\nmesh = 'body.obj'\n"
                     "[[shell]]\nname = 'a'\nmesh = 'strip.obj'\n[[shell]]\nname = 'b'\nmesh = 'strip.obj'\n"));
  CHECK(file.shells.size() == 2);
  for (const cli::Scene &shell : file.shells) {
    CHECK(shell.colliders.size() == 2 && shell.colliders[0].moves() && !shell.colliders[1].moves());
    CHECK(shell.colliders[0].bone == file.skeleton[0].motion && cli::any_moves(shell.colliders));
    CHECK(std::count(shell.inputs.begin(), shell.inputs.end(), shell.colliders[1].mesh_path) == 1);
  }
}

void mistakes_in_colliders_are_located() {
  const struct {
    const char *text, *place, *words;
  } mistakes[] = {
      {"radius = 1\n", "bad.toml:2:", "kind is missing: plane, sphere"},
      {"kind = 'ball'\n", "bad.toml:3:", "it must be one of plane, sphere, capsule, box, hull, mesh"},
      {"kind = 'sphere'\n", "bad.toml:2:", "a sphere needs radius"},
      {"kind = 'sphere'\nradius = 0\n", "bad.toml:4:", "radius must be greater than 0"},
      {"kind = 'sphere'\nradius = 1\nhalf_length = 1\n", "bad.toml:5:", "a sphere has no half_length"},
      {"kind = 'sphere'\nradius = 1\nraduis = 1\n", "bad.toml:5:", "unknown key 'raduis'; did you mean 'radius'?"},
      {"kind = 'capsule'\nradius = 1\n", "bad.toml:2:", "a capsule needs half_length"},
      {"kind = 'capsule'\nradius = 1\nhalf_length = -1\n", "bad.toml:5:", "half_length must not be negative"},
      {"kind = 'box'\nhalf_extents = [1, 1]\n", "bad.toml:4:", "half_extents must be a list of 3 numbers"},
      {"kind = 'box'\nhalf_extents = [1, 1, 0]\n", "bad.toml:4:", "half_extents must be greater than 0"},
      {"kind = 'mesh'\n", "bad.toml:2:", "a mesh needs mesh"},
      {"kind = 'mesh'\nmesh = 3\n", "bad.toml:4:", "mesh must be a text in quotes"},
      {"kind = 'mesh'\nmesh = 'b.obj'\ncells = 3\n", "bad.toml:5:", "cells must be from 4 to 2000"},
      {"kind = 'hull'\nmesh = 'b.obj'\ncells = 64\n", "bad.toml:5:", "a hull has no cells"},
      {"kind = 'plane'\nnormal = [0, 0, 0]\n", "bad.toml:4:", "normal must not be 0"},
      {"kind = 'plane'\nnormal = [0, 0, 1]\nrotate_degrees = [1, 0, 0]\n", "bad.toml:4:", "normal does not go with rotate_degrees"},
      {"kind = 'plane'\nfriction = -0.1\n", "bad.toml:4:", "friction must not be negative"},
      {"kind = 'plane'\nfriction = nan\n", "bad.toml:4:", "friction must be finite"},
      {"kind = 'plane'\nthickness = -1\n", "bad.toml:4:", "thickness must not be negative"},
      {"kind = 'plane'\nposition = 1\n", "bad.toml:4:", "position must be a list of 3 numbers"},
      {"kind = 'plane'\nbone = 'arm'\n", "bad.toml:4:", "no bone is called 'arm'"},
      {"kind = 'plane'\nkey = [\n{ offset = [0, 0, 1] }]\n", "bad.toml:5:", "time must be 0 or more"},
      {"kind = 'plane'\nkey = [\n{ time = 1 },\n{ time = 1 }]\n", "bad.toml:6:", "times of keys must ascend"},
  };
  for (const auto &mistake : mistakes) {
    const std::string message = refusal(std::string("mesh = 'strip.obj'\n[[collider]]\n") + mistake.text);
    const bool good = message.find(mistake.place) != std::string::npos && message.find(mistake.words) != std::string::npos;
    if (!good) printf("%s%s\n", mistake.text, message.c_str());
    CHECK(good);
  }
  CHECK(refusal("mesh = 'a.obj'\n[collider]\nkind = 'plane'\n").find("must be written as [[collider]]") != std::string::npos);
}

void a_collider_in_a_word_is_read() {
  std::vector<std::string> inputs;
  const cli::Collider plane = cli::read_collider("plane:y=-0.25:friction=0.4:thickness=0.001", inputs);
  CHECK(plane.kind == SW_COLLIDER_PLANE && plane.friction == 0.4 && plane.thickness == 0.001);
  check_near(placed(plane.pose(0), {0, 0, 1}), {0, 0.75, 0}, kRounding);
  const cli::Collider sphere = cli::read_collider("sphere:0.3@0,1,-0.5:0,0,0.4@2:friction=1:0,0,0.2", inputs);
  CHECK(sphere.radius == 0.3 && sphere.position[1] == 1 && sphere.friction == 1 && sphere.keys.size() == 2);
  CHECK(sphere.keys[0].time == 2 && sphere.keys[0].offset[2] == 0.4 && sphere.keys[1].time == 3);
  const cli::Collider capsule = cli::read_collider("capsule:1,2", inputs), box = cli::read_collider("box:1,2,3@4,5,6", inputs);
  CHECK(capsule.radius == 1 && capsule.half_length == 2 && capsule.position == Vec3{} && box.half_extents[2] == 3 && box.position[0] == 4);
  CHECK(inputs.empty() && cli::read_collider("mesh:a.obj@1,2,3", inputs).mesh_path == "a.obj");
  CHECK(cli::read_collider("hull:b.ply", inputs).kind == SW_COLLIDER_HULL && inputs == (std::vector<std::string>{"a.obj", "b.ply"}));
  const cli::Collider sheet = cli::read_collider("mesh:a.obj:one-sided", inputs), deep = cli::read_collider("mesh:a.obj:depth=0.5", inputs);
  CHECK(sheet.one_sided && sheet.depth == 0 && deep.one_sided && deep.depth == 0.5);
  const struct {
    const char *word, *wrong;
  } bad[] = {
      {"plan:z=1", "'plan' is none of plane, sphere, capsule, box, hull, mesh; did you mean 'plane'"},
      {"plane", "'plane' is not as in plane:z=HEIGHT"},
      {"plane:w=1", "'w=1' is not as in"},
      {"plane:z=", "'z=' is not as in"},
      {"sphere:0", "'0' is not as in sphere:R@X,Y,Z"},
      {"sphere:1@1,2", "'1@1,2' is not as in"},
      {"box:1,1@0,0,0", "'1,1@0,0,0' is not as in box:HX,HY,HZ@X,Y,Z"},
      {"mesh:", "'' is not as in mesh:FILE@X,Y,Z"},
      {"sphere:1:fricton=1", "'fricton' is none of friction, thickness and depth; did you mean 'friction'"},
      {"sphere:1:depth=1", "'depth=1' goes with mesh:FILE@X,Y,Z"},
      {"mesh:a.obj:one-side", "'one-side' is not DX,DY,DZ@SECONDS, friction=F, thickness=T, or of a mesh one-sided"},
      {"sphere:1:friction=-1", "'friction=-1': friction is a number from 0 on"},
      {"sphere:1:0,0", "'0,0' is not DX,DY,DZ@SECONDS"},
      {"sphere:1:free@2", "'free@2' is not DX,DY,DZ@SECONDS"},
      {"sphere:1:0,0,1@2:0,0,2@1", "times must ascend"},
  };
  for (const auto &word : bad) {
    std::string message = "read without complaint";
    try {
      cli::read_collider(word.word, inputs);
    } catch (const std::runtime_error &error) {
      message = error.what();
    }
    const bool good = message.find(std::string("--collider ") + word.word + ": " + word.wrong) == 0;
    if (!good) printf("%s\n", message.c_str());
    CHECK(good);
  }
}

// ------------------------------------------------------------------------------------------------------------ placing

void a_plane_looks_along_its_normal() {
  const double third = std::sqrt(1.0 / 3);
  for (const Vec3 &n : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{third, -third, third}}) {
    cli::Collider plane;
    plane.rotation = cli::rotation_to({3 * n[0], 3 * n[1], 3 * n[2]});  // of any length
    check_near(placed(plane.pose(0), {0, 0, 1}), n, kRounding);
  }
}

// A turn by its keys comes after its own, both about its origin; and then the bone takes all of it along.
void colliders_go_through_their_keys_and_with_their_bone() {
  cli::Collider collider;
  collider.position = {1, 0, 0};
  collider.rotation = {0, 0, kPi / 2};
  collider.keys = {{2, {0, 0, 4}, {kPi / 2, 0, 0}}};
  check_near(placed(collider.pose(0), {1, 0, 0}), {1, 1, 0}, kRounding);
  check_near(placed(collider.pose(9), {1, 0, 0}), {1, 0, 5}, kRounding * 8);
  CHECK_NEAR(collider.pose(1).origin[2], 2, kRounding * 8);  // halfway between two keys that rest
  cli::FrameMotion shoulder;
  shoulder.end = 1000;
  shoulder.translations = {{{0, 1, 0}, 3, 0, kPi / 2}};  // a wave of frequency 0 at a quarter of a period is a constant
  shoulder.rotations = {{{0, 0, 1}, kPi / 2, 0, kPi / 2}};
  collider.bone = std::make_shared<const cli::FrameMotion>(shoulder);
  collider.keys.clear();
  CHECK(collider.moves());
  check_near(placed(collider.pose(5), {1, 0, 0}), {-1, 4, 0}, kRounding * 8);
}

// ----------------------------------------------------------------------------------------------------------- touching

struct Moved {
  cli::Scene scene;
  cli::Run run;
  std::vector<double> positions;
  std::string words;
};

// The scene of a strip with these lines, run for so many frames.
Moved run_of(const std::string &lines, uint32_t frames) {
  strip_file();
  Moved moved;
  moved.scene = cli::read_scene(write_file("run.toml", "mesh = 'strip.obj'\n" + lines));
  cli::Scene &scene = moved.scene;
  const cli::Mesh mesh = cli::scene_mesh(scene);
  cli::prepare_colliders(scene.colliders, scene.scale);
  cli::ProgressBar progress(true);
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  shellwarp::State state = cli::make_state(scene, mesh, model);
  moved.run = cli::simulate(scene, frames, mesh, {}, state, nullptr);
  moved.positions.resize(mesh.positions.size());
  state.positions(moved.positions.data(), mesh.n_vertices());
  for (const std::string &sentence : cli::closing_words({scene, model.info(), model.frequencies(), moved.run, {}}))
    moved.words += sentence + "\n";
  return moved;
}

const std::string kFalling = "[simulation]\nmethod = 'warp'\nmodes = 12\nprecision = 'f64'\ngravity = [0, 0, -9.8]\n[damping]\nratio = 0.1\n";

// Of all vertices.
void check_heights(const Moved &moved, double height) {
  for (std::size_t i = 2; i < moved.positions.size(); i += 3) CHECK_NEAR(moved.positions[i], height, kGap * STRIP_LENGTH);
}

// A flat strip that falls flat does not bend: all of it lies at the plane's height and the thickness above.
void a_strip_that_falls_on_a_plane_rests_at_its_height() {
  const Moved bare = run_of(kFalling + "[[collider]]\nkind = 'plane'\nposition = [0, 0, -0.2]\nfriction = 0.4\n", 40);
  check_heights(bare, -0.2);
  const Moved thick = run_of(kFalling + "[[collider]]\nkind = 'plane'\nposition = [0, 0, -0.2]\nthickness = 0.05\n", 40);
  check_heights(thick, -0.15);
  CHECK(thick.words.find("touched: ") != std::string::npos && thick.words.find("note: the shell went") == std::string::npos);
  CHECK(thick.run.frames.back().report.contact_count > 0);
}

void a_strip_lies_on_a_mesh_and_its_hull_as_on_the_box_that_they_are() {
  write_file("cube.obj", kCube);
  const std::string place = "position = [2, 0, -3.1]\n";
  for (const char *shape : {"kind = 'box'\nhalf_extents = [3, 3, 3]\n", "kind = 'mesh'\nmesh = 'cube.obj'\n", "kind = 'hull'\nmesh = 'cube.obj'\n"})
    check_heights(run_of(kFalling + "[[collider]]\n" + shape + place, 150), -0.1);  // until it swings no more
}

// `scale` is of all coordinates that are read from files: the cube's top is 0.3 above its middle.
void meshes_of_colliders_are_scaled_as_the_shells_are() {
  write_file("cube.obj", kCube);
  const Moved moved = run_of("scale = 0.1\n" + kFalling + "[[collider]]\nkind = 'mesh'\nmesh = 'cube.obj'\nposition = [0.2, 0, -0.4]\n", 40);
  check_heights(moved, -0.1);
}

// It rises by 0.7 under the free end of a clamped strip that nothing else loads: no vertex is inside, and one touches it.
void a_moving_sphere_lifts_the_strip() {
  const Moved moved = run_of(
      "[material]\nk_bend = 1000\n[[support]]\nkind = 'clamped'\nside = 'low-x'\n[simulation]\nmethod = 'polynomial-shell'\n[damping]\nratio = 0.5\n"
      "[[collider]]\nkind = 'sphere'\nradius = 0.5\nposition = [3, 0, -0.7]\nkey = [{ time = 1, offset = [0, 0, 0.7] }]\n", 60);
  double least = 9;
  for (std::size_t i = 0; i < moved.positions.size(); i += 3)
    least = std::min(least, std::hypot(moved.positions[i] - 3, moved.positions[i + 1], moved.positions[i + 2]) - 0.5);
  CHECK_NEAR(least, 0, kGap * STRIP_LENGTH);
  CHECK(moved.run.frames.back().report.max_displacement > 0.5);
  CHECK(moved.words.find("try") == std::string::npos);  // the sphere alone moved it: no word on units or loads
  const cli::Mesh mesh = cli::scene_mesh(moved.scene);
  CHECK(!cli::EnergyAudit(moved.scene, mesh).applies());  // it does work on the strip
}

// Two of the numbers that reports give, in words; and a note only above 0.1 % of the size.
void the_closing_words_tell_contacts_and_penetration() {
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.gravity = {0, 0, -1};
  scene.length_unit = "cm";
  SwModelInfo info{};
  info.size = 2;
  info.n_unknowns = 9;
  cli::Run run;
  for (uint32_t frame = 0; frame < 3; ++frame) {
    cli::FrameRecord record{frame, {}, {}};
    record.report.turn_in_range = 1;
    record.report.max_displacement = 0.5;
    run.frames.push_back(record);
  }
  const auto words = [&] {
    std::string all;
    for (const std::string &sentence : cli::closing_words({scene, info, {45}, run, {}})) all += sentence + "\n";
    return all;
  };
  CHECK(words().find("touched") == std::string::npos);
  scene.colliders.emplace_back();
  CHECK(words().find("touched: no collider\n") != std::string::npos);
  run.frames[1].report.contact_count = 1;
  run.frames[2].report.deepest_penetration = 0.002;
  CHECK(words().find("touched: 1 contact at most, deepest penetration 0.002 cm (0.1 % of its size)\n") != std::string::npos);
  CHECK(words().find("note") == std::string::npos);
  run.frames[0].report.contact_count = 12;
  run.frames[2].report.deepest_penetration = 0.003;
  CHECK(words().find("touched: 12 contacts at most, deepest penetration 0.003 cm (0.15 % of its size)\n") != std::string::npos);
  CHECK(words().find("by more than 0.1 % of its size: more modes help") != std::string::npos);
  scene.method = SW_METHOD_SHELL_IMPLICIT;
  CHECK(words().find("by more than 0.1 % of its size: shorter steps help") != std::string::npos);
}

void a_collider_that_cannot_be_made_is_named() {
  const std::string open = write_file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  std::vector<std::string> inputs;
  std::vector<cli::Collider> colliders = {cli::read_collider("plane:z=0", inputs), cli::read_collider("mesh:" + open, inputs)};
  std::string message;
  try {
    cli::prepare_colliders(colliders, 1);
  } catch (const std::runtime_error &error) {
    message = error.what();
  }
  CHECK(message.find("collider 2, ") == 0 && message.find("open.obj: invalid mesh: ") != std::string::npos);
}

}  // namespace

int main(int argc, char **argv) {
  if (argc != 2) return EXIT_FAILURE;
  directory = argv[1];
  std::filesystem::create_directories(directory);
  RUN(colliders_of_a_scene_are_read_in_full);
  RUN(all_shells_of_a_file_touch_its_colliders_which_bones_may_carry);
  RUN(mistakes_in_colliders_are_located);
  RUN(a_collider_in_a_word_is_read);
  RUN(a_plane_looks_along_its_normal);
  RUN(colliders_go_through_their_keys_and_with_their_bone);
  RUN(a_strip_that_falls_on_a_plane_rests_at_its_height);
  RUN(a_strip_lies_on_a_mesh_and_its_hull_as_on_the_box_that_they_are);
  RUN(meshes_of_colliders_are_scaled_as_the_shells_are);
  RUN(a_moving_sphere_lifts_the_strip);
  RUN(the_closing_words_tell_contacts_and_penetration);
  RUN(a_collider_that_cannot_be_made_is_named);
  return report_failures();
}

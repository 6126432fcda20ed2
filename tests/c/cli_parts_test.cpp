// The parts of the command line host that stand alone: mesh readers, above all on files that are broken, writers, scenes.
// Writes its files into the directory given as the first argument.
#include "choice.hpp"
#include "comparison.hpp"
#include "fibres.hpp"
#include "material.hpp"
#include "energy_audit.hpp"
#include "frame_files.hpp"
#include "frame_motion.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "method.hpp"
#include "output_file.hpp"
#include "point_cache.hpp"
#include "polygon.hpp"
#include "progress.hpp"
#include "scene.hpp"
#include "shell.hpp"
#include "simulation.hpp"
#include "step_twin.hpp"
#include "creases.hpp"
#include "material_maps.hpp"
#include "advice.hpp"
#include "closest.hpp"
#include "rim.hpp"
#include "selection.hpp"
#include "watch.hpp"
#include "warnings.hpp"
#include "weld.hpp"
#include "summary.hpp"
#include "text_lines.hpp"

#include "test_support.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace {

std::string directory;

std::string in_directory(const std::string &name) { return (std::filesystem::path(directory) / name).string(); }

std::string write_file(const std::string &name, const std::string &contents) {
  const std::string path = in_directory(name);
  std::ofstream(path, std::ios::binary) << contents;
  return path;
}

// ---------------------------------------------------------------------------------------------------- the same mesh

// Two quads and a triangle beside them. Coordinates have few binary digits, so that text and floats hold them exactly.
const double kPoints[7][3] = {{0, 0, 0},        {0.5, 0, 0.25}, {1, 0, -0.125},  {0, 0.75, 0},
                              {0.5, 0.75, 1e3}, {1, 0.75, 0},   {1.5, 0.375, -2}};
const std::vector<std::vector<uint32_t>> kFaces = {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 6, 5}};
// By the diagonals whose triangles are less thin: 1-3 and 1-5.
const std::vector<uint32_t> kTriangles = {3, 0, 1, 1, 4, 3, 1, 2, 5, 1, 5, 4, 2, 6, 5};

std::string coordinates(const double *x) {
  char text[96];
  std::snprintf(text, sizeof text, "%.17g %.17g %.17g", x[0], x[1], x[2]);
  return text;
}

// `corner` writes a vertex of a face; `before` is written at the start of the file.
template <class Corner>
std::string obj_text(const std::string &before, Corner corner) {
  std::string text = before;
  for (const auto &x : kPoints) text += "v " + coordinates(x) + "\n";
  for (const auto &face : kFaces) {
    text += "f";
    for (uint32_t v : face) text += " " + corner(v);
    text += "\n";
  }
  return text;
}

std::string number(int64_t n) { return std::to_string(n); }

std::string off_text() {
  std::string text = "OFF\n# a comment\n7 3 0\n\n";
  for (const auto &x : kPoints) text += coordinates(x) + "  0.1 0.2 0.3 # colour\n";
  for (const auto &face : kFaces) {
    text += number(static_cast<int64_t>(face.size()));
    for (uint32_t v : face) text += " " + number(v);
    text += " 255 0 0\n";
  }
  return text;
}

std::string ply_header(const std::string &format) {
  return "ply\nformat " + format +
         " 1.0\ncomment made by hand\nelement vertex 7\nproperty float x\nproperty double y\n"
         "property float z\nproperty uchar red\nelement face 3\nproperty list uchar int vertex_indices\n"
         "property short group\nelement edge 1\nproperty int vertex1\nend_header\n";
}

std::string ply_ascii() {
  std::string text = ply_header("ascii");
  for (const auto &x : kPoints) text += coordinates(x) + " nan\n";  // a property that is passed over may hold anything
  for (const auto &face : kFaces) {
    text += number(static_cast<int64_t>(face.size()));
    for (uint32_t v : face) text += " " + number(v);
    text += " -7\n";
  }
  return text + "3\n";
}

template <class T>
void append(std::string &bytes, T value, bool big_endian) {
  unsigned char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  const uint16_t one = 1;
  unsigned char low;
  std::memcpy(&low, &one, 1);
  if (big_endian == (low == 1)) std::reverse(raw, raw + sizeof value);
  bytes.append(reinterpret_cast<const char *>(raw), sizeof value);
}

std::string ply_binary(bool big_endian) {
  std::string bytes = ply_header(big_endian ? "binary_big_endian" : "binary_little_endian");
  for (const auto &x : kPoints) {
    append(bytes, static_cast<float>(x[0]), big_endian);
    append(bytes, x[1], big_endian);
    append(bytes, static_cast<float>(x[2]), big_endian);
    append(bytes, uint8_t{200}, big_endian);
  }
  for (const auto &face : kFaces) {
    append(bytes, static_cast<uint8_t>(face.size()), big_endian);
    for (uint32_t v : face) append(bytes, static_cast<int32_t>(v), big_endian);
    append(bytes, int16_t{-7}, big_endian);
  }
  append(bytes, int32_t{3}, big_endian);
  return bytes;
}

struct Sample {
  const char *name;
  std::string contents;
};

std::vector<Sample> samples() {
  return {
      {"plain.obj", obj_text("", [](uint32_t v) { return number(v + 1); })},
      {"negative.obj", obj_text("", [](uint32_t v) { return number(int64_t{v} - 7); })},
      {"textured.obj",
       obj_text("mtllib none.mtl\no thing\nvt 0 0\nvn 0 0 1\n", [](uint32_t v) { return number(v + 1) + "/1/1"; })},
      {"normals.obj",
       obj_text("# comment\r\n\nvn 0 0 1\ng group\nusemtl m\ns 1\n", [](uint32_t v) { return number(v + 1) + "//1"; })},
      {"plain.off", off_text()},
      {"ascii.ply", ply_ascii()},
      {"little.ply", ply_binary(false)},
      {"big.ply", ply_binary(true)},
  };
}

bool is_the_mesh(const cli::Mesh &mesh) {
  if (mesh.n_vertices() != 7 || mesh.triangles != kTriangles) return false;
  return std::memcmp(mesh.positions.data(), kPoints, sizeof kPoints) == 0;
}

void every_format_gives_the_same_vertices_and_triangles() {
  for (const Sample &sample : samples()) {
    const bool same = is_the_mesh(cli::read_mesh(write_file(sample.name, sample.contents)));
    if (!same) printf("differs: %s\n", sample.name);
    CHECK(same);
  }
}

double signed_area(const std::vector<double> &x, const uint32_t *t) {
  const double *a = &x[3 * t[0]], *b = &x[3 * t[1]], *c = &x[3 * t[2]];
  return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

// Which undirected edges the triangles have.
std::set<std::pair<uint32_t, uint32_t>> edges_of(const std::vector<uint32_t> &triangles) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const uint32_t a = triangles[k], b = triangles[k % 3 == 2 ? k - 2 : k + 1];
    edges.insert({std::min(a, b), std::max(a, b)});
  }
  return edges;
}

void concave_polygons_are_cut_inside_whichever_corner_is_first() {
  // An arrow head, an L, a comb with three teeth, a square, and a star of ten corners; counterclockwise.
  const std::vector<std::vector<double>> shapes = {
      {0, 0, 2, 1, 0, 2, 0.6, 1},
      {0, 0, 3, 0, 3, 1, 1, 1, 1, 3, 0, 3},
      {0, 0, 5, 0, 5, 3, 4, 3, 4, 1, 3, 1, 3, 3, 2, 3, 2, 1, 1, 1, 1, 3, 0, 3},
      {0, 0, 1, 0, 1, 1, 0, 1},
      {1, 0, 0.32, 0.24, 0.31, 0.95, -0.12, 0.38, -0.81, 0.59, -0.4, 0, -0.81, -0.59, -0.12, -0.38, 0.31, -0.95, 0.32, -0.24}};
  for (const std::vector<double> &shape : shapes) {
    const uint32_t n = static_cast<uint32_t>(shape.size() / 2);
    std::vector<double> x;
    std::vector<uint32_t> corners;
    double area = 0;
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t j = (i + 1) % n;
      x.insert(x.end(), {shape[2 * i], shape[2 * i + 1], 0});
      corners.push_back(i);
      area += 0.5 * (shape[2 * i] * shape[2 * j + 1] - shape[2 * j] * shape[2 * i + 1]);
    }
    const auto first = edges_of(host::cut_polygon(corners, x.data()));
    for (uint32_t turn = 0; turn < n; ++turn) {
      const std::vector<uint32_t> triangles = host::cut_polygon(corners, x.data());
      CHECK(triangles.size() == 3 * (n - 2) && edges_of(triangles) == first);
      double sum = 0;
      for (std::size_t k = 0; k < triangles.size(); k += 3) {
        CHECK(signed_area(x, &triangles[k]) > 0);
        sum += signed_area(x, &triangles[k]);
      }
      CHECK(std::fabs(sum - area) < 1e-12);  // they cover it once: none is turned over
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
  }
  // The shorter diagonal of a kite; and what has no inside is a fan, for the library to judge.
  const double kite[12] = {0, 0, 0, 4, -1, 0, 9, 0, 0, 4, 1, 0}, line[12] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0};
  CHECK(edges_of(host::cut_polygon({0, 1, 2, 3}, kite)).count({1, 3}) == 1);
  CHECK((host::cut_polygon({0, 1, 2, 3}, line) == std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
}

void welded_pieces_are_one_shell_and_the_file_is_drawn() {
  // Two squares that touch along an edge, each with corners of its own, and the second once more from behind.
  const std::string path = write_file("pieces.obj",
                                      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1.001 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\n"
                                      "g left\nf 1 2 3 4\ng right\nf 5 6 7 8\ng back\nf 8 7 6 5\n");
  const cli::Mesh mesh = cli::read_mesh(path);
  const cli::Mesh exact = cli::weld(mesh, 0), near = cli::weld(mesh, 0.01);
  CHECK(mesh.n_vertices() == 8 && exact.n_vertices() == 7 && near.n_vertices() == 6);
  CHECK(near.n_triangles() == 4 && near.groups.at("back") == near.groups.at("right"));
  CHECK(near.of(4) == 1 && near.of(7) == 2 && near.of(99) == 99 && mesh.of(4) == 4);
  for (uint32_t v = 0; v < 8; ++v)
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::fabs(near.vertex(near.of(v))[i] - mesh.vertex(v)[i]) <= 0.01);
  const auto diagnostics = shellwarp::check_mesh(
      shellwarp::mesh_desc(near.positions.data(), near.n_vertices(), near.triangles.data(), near.n_triangles()));
  CHECK(diagnostics.empty());
  for (const double bad : {-1.0, 100.0}) {
    bool refused = false;
    try {
      cli::weld(mesh, bad);
    } catch (const std::runtime_error &error) {
      refused = std::strstr(error.what(), "weld: the distance") != nullptr;
    }
    CHECK(refused);
  }
  const std::string scene_path = write_file(
      "pieces.toml", "mesh = 'pieces.obj'\nscale = 2\nweld = 0.01\n[[support]]\nvertices = [0, 3]\n[[force]]\nvertex = 7\nvector = [0, 0, 1]\n");
  const cli::Scene scene = cli::read_scene(scene_path);
  CHECK(scene.weld == 0.01 && scene.render_path == scene.mesh_path);
  const cli::Mesh scaled = cli::scene_mesh(scene);
  CHECK(scaled.n_vertices() == 6 && cli::place_forces(scene.loads.forces, scaled).at(0).vertex == 2);
  CHECK((cli::find_supports(scene, scaled).fixed == std::vector<uint32_t>{0, 3}));

  // Maps have a number for each vertex of the file: of those welded the first one's.
  write_file("pieces.txt", "1 2 3 4 5 6 7 8\n");
  cli::Scene mapped = cli::read_scene(write_file(
      "mapped.toml", "mesh = 'pieces.obj'\nweld = 0.01\n[material]\nmap = { density = 'pieces.txt' }\n[damping]\nratio = 0.1\nfactors = 'pieces.txt'\n"));
  CHECK((cli::material_maps(mapped.material, near).at(0).values == std::vector<double>{1, 2, 3, 4, 6, 7}));
  mapped.damping.factors.pop_back();
  mapped.material.files[0].values.pop_back();
  cli::Scene by_triangles = mapped;
  by_triangles.material.files[0].values = {1, 2, 3, 4, 5, 6};  // the last two lie on others
  CHECK((cli::material_maps(by_triangles.material, near).at(0).values == std::vector<double>{1, 2, 3, 4}));
  bool counted = false;
  try {
    cli::material_maps(mapped.material, near);
  } catch (const std::runtime_error &error) {
    counted = std::strstr(error.what(), "7 values of density; the mesh has 8 vertices and 6 triangles") != nullptr;
  }
  CHECK(counted);
}

// A slab of quads with two sides, its low end a group: a sheet in its middle is simulated, held where the file says, with the file's map.
void a_scene_may_simulate_a_proxy_of_its_file() {
  constexpr int columns = 41, rows = 9, side = columns * rows;
  std::string text, map;
  for (const double z : {0.01, -0.01})
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < rows; ++j) {
        text += "v " + std::to_string(0.1 * i) + " " + std::to_string(0.1 * j) + " " + std::to_string(z) + "\n";
        map += std::to_string(1 + i) + "\n";
      }
  for (const bool above : {true, false})
    for (int i = 0; i + 1 < columns; ++i) {
      text += i < 4 ? "g held\n" : "g rest\n";
      for (int j = 0; j + 1 < rows; ++j) {
        const int a = (above ? 1 : 1 + side) + i * rows + j;
        const int quad[4] = {a, a + rows, a + rows + 1, a + 1};
        text += "f";
        for (int k = 0; k < 4; ++k) text += " " + std::to_string(quad[above ? k : 3 - k]);
        text += "\n";
      }
    }
  write_file("slab.obj", text);
  write_file("slab.txt", map);
  const cli::Mesh file = cli::read_mesh(in_directory("slab.obj"));
  std::string grain, by_triangles;  // of the file's triangles: across the far half, and there twice as heavy
  for (std::size_t t = 0; t < file.triangles.size(); t += 3) {
    const bool far = file.vertex(file.triangles[t])[0] + file.vertex(file.triangles[t + 1])[0] + file.vertex(file.triangles[t + 2])[0] > 6;
    grain += far ? "0 1 0\n" : "1 0 0\n";
    by_triangles += far ? "2000\n" : "1000\n";
  }
  write_file("slab_grain.txt", grain);
  write_file("slab_triangles.txt", by_triangles);
  const cli::Scene scene = cli::read_scene(write_file(
      "slab.toml", "mesh = 'slab.obj'\nscale = 2\nproxy = 120\n[material]\nmap = { density = 'slab.txt' }\n[[support]]\ngroup = 'held'\n[[force]]\nvertex = 368\nvector = [0, 0, 1]\n"));
  CHECK(scene.proxy.vertices == 120 && !scene.proxy.cut && !scene.proxy.thickness && scene.render_path == scene.mesh_path);
  const cli::Mesh mesh = cli::scene_mesh(scene);
  CHECK(mesh.proxy && mesh.n_vertices() > 105 && mesh.n_vertices() < 135 && mesh.of_file.size() == 2 * side);
  const std::vector<cli::MaterialFile> maps = cli::material_maps(scene.material, mesh);
  for (uint32_t v = 0; v < mesh.n_vertices(); ++v) {
    CHECK(std::fabs(mesh.vertex(v)[2]) < 1e-9);
    CHECK(std::fabs(maps.at(0).values.at(v) - (1 + 5 * mesh.vertex(v)[0])) < 1e-6);  // linear along it
  }
  const std::vector<uint32_t> held = cli::find_supports(scene, mesh).fixed;
  CHECK(!held.empty());
  for (const uint32_t v : held) CHECK(mesh.vertex(v)[0] < 1.0);
  CHECK(std::fabs(mesh.vertex(cli::place_forces(scene.loads.forces, mesh).at(0).vertex)[0] - 8) < 0.5);
  const cli::Scene fibrous = cli::read_scene(write_file(
      "fibrous.toml", "mesh = 'slab.obj'\nscale = 2\nproxy = 120\n[material]\npreset = 'card'\nyoung_across = 1e9\ndirections = 'slab_grain.txt'\n"
                      "map = { volume_density = 'slab_triangles.txt' }\n"));
  const std::vector<double> directions = cli::find_directions(fibrous.material, mesh);
  const std::vector<cli::MaterialFile> heavy = cli::material_maps(fibrous.material, mesh);
  CHECK(directions.size() == mesh.triangles.size() && heavy.at(0).values.size() == mesh.n_triangles());
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    double x = 0;
    for (std::size_t k = 0; k < 3; ++k) x += mesh.vertex(mesh.triangles[t + k])[0] / 3;
    if (std::fabs(x - 4) < 0.4) continue;  // a triangle of the file beside the border, 0.2 wide at this scale
    CHECK(directions[t] == (x > 4 ? 0 : 1) && directions[t + 1] == (x > 4 ? 1 : 0) && heavy.at(0).values[t / 3] == (x > 4 ? 2000 : 1000));
  }
  for (const char *wrong : {"proxy_cut = true\n", "proxy_calibrated = false\n", "proxy_thickness = 0.1\n", "proxy = 100\nproxy_thickness = -1\n"}) {
    bool refused = false;
    try {
      cli::read_scene(write_file("slab_wrong.toml", std::string("mesh = 'slab.obj'\n") + wrong));
    } catch (const std::runtime_error &error) {
      refused = std::strstr(error.what(), "proxy_") != nullptr;
    }
    CHECK(refused);
  }
  cli::ProxyOptions both;
  both.vertices = 240;
  both.thickness = 0;
  CHECK(cli::make_proxy(cli::read_mesh(scene.mesh_path), both, std::nullopt, {}).proxy->info.n_sides_joined == 0);
}

std::string with_line_ends(const std::string &contents, const char *line_end) {
  std::string changed;
  for (char c : contents)
    if (c == '\n')
      changed += line_end;
    else
      changed += c;
  return changed;
}

void byte_order_marks_do_not_matter() {
  for (const Sample &sample : samples())
    if (sample.contents.find("binary") == std::string::npos)
      CHECK(is_the_mesh(
          cli::read_mesh(write_file(std::string("marked_") + sample.name, "\xef\xbb\xbf" + sample.contents))));
}

void statements_of_obj_go_on_after_a_backslash() {
  std::string text = obj_text("# a path C:\\\n", [](uint32_t v) { return "\\\n" + number(v + 1); });
  CHECK(is_the_mesh(cli::read_mesh(write_file("continued.obj", text))));
  CHECK(is_the_mesh(cli::read_mesh(write_file("continued.obj", with_line_ends(text, "\r\n")))));
}

void off_counts_may_stand_behind_the_first_word() {
  std::string text = off_text();
  text.replace(0, text.find('7'), "OFF ");
  CHECK(is_the_mesh(cli::read_mesh(write_file("one_line.off", text))));
}

void line_ends_of_other_systems_do_not_matter() {
  for (const Sample &sample : samples()) {
    if (sample.contents.find("binary") != std::string::npos) continue;
    for (const char *line_end : {"\r\n", "\r"})
      CHECK(is_the_mesh(
          cli::read_mesh(write_file(std::string("lines_") + sample.name, with_line_ends(sample.contents, line_end)))));
  }
}

// ------------------------------------------------------------------------------------------------------ broken files

// A damaged file may still be a mesh, then a sound one; otherwise it is refused with a message that names it.
enum class Outcome { mesh, refused, unsound };

Outcome read_damaged(const std::string &path, const std::string &contents) {
  try {
    const std::string name = path;
    const cli::Mesh mesh = path.find(".obj") != std::string::npos   ? cli::read_obj(name, contents)
                           : path.find(".off") != std::string::npos ? cli::read_off(name, contents)
                                                                    : cli::read_ply(name, contents);
    for (uint32_t v : mesh.triangles)
      if (v >= mesh.n_vertices()) return Outcome::unsound;
    for (double x : mesh.positions)
      if (!std::isfinite(x)) return Outcome::unsound;
    return Outcome::mesh;
  } catch (const cli::FileError &error) {
    return std::strstr(error.what(), path.c_str()) ? Outcome::refused : Outcome::unsound;
  }
}

void files_cut_anywhere_are_refused_or_sound() {
  for (const Sample &sample : samples())
    for (std::size_t size = 0; size < sample.contents.size(); ++size) {
      const Outcome outcome = read_damaged(sample.name, sample.contents.substr(0, size));
      if (outcome == Outcome::unsound) printf("%s cut to %zu bytes\n", sample.name, size);
      CHECK(outcome != Outcome::unsound);
    }
}

// Where the file announces how much it holds, a cut is always noticed, up to the digits of its last word.
void cut_off_and_ply_files_are_always_refused() {
  for (const Sample &sample : samples()) {
    if (std::strstr(sample.name, ".obj")) continue;
    const bool binary = sample.contents.find("binary") != std::string::npos;
    const std::size_t last_needed = binary ? sample.contents.size() : sample.contents.rfind(' ') - 20;
    for (std::size_t size = 0; size < last_needed; ++size)
      CHECK(read_damaged(sample.name, sample.contents.substr(0, size)) == Outcome::refused);
  }
}

void files_with_any_flipped_bit_are_refused_or_sound() {
  for (const Sample &sample : samples())
    for (std::size_t k = 0; k < 8 * sample.contents.size(); ++k) {
      std::string contents = sample.contents;
      contents[k / 8] = static_cast<char>(contents[k / 8] ^ (1 << k % 8));
      const Outcome outcome = read_damaged(sample.name, contents);
      if (outcome == Outcome::unsound) printf("%s with bit %zu flipped\n", sample.name, k);
      CHECK(outcome != Outcome::unsound);
    }
}

struct BadFile {
  const char *name;
  std::string contents;
  const char *place;  // "NAME:LINE:" or "NAME:"
  const char *words;
};

std::vector<BadFile> bad_files() {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  return {
      {"word.obj", "v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n",
       "word.obj:2:", "y of vertex 2 must be a finite number; found 'zero'"},
      {"short.obj", "v 0 0 0\nv 1 0\n", "short.obj:2:", "the line ends"},
      {"nan.obj", "v 0 0 nan\n", "nan.obj:1:", "finite"},
      {"large.obj", "v 0 0 1e999\n", "large.obj:1:", "finite"},
      {"zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "zero.obj:4:", "start at 1"},
      {"beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n",
       "beyond.obj:5:", "names vertex 4, but the file holds only 3"},
      {"before.obj", "v 0 0 0\nf -1 -2 -3\n", "before.obj:2:", "names vertex -2"},
      {"two.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "two.obj:3:", "at least three corners; found 2"},
      {"overflow.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4294967299\n",
       "overflow.obj:4:", "names vertex 4294967299, but the file holds only 3"},
      {"wide.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n", "wide.obj:4:", "must be a whole number"},
      {"half.obj", three + "f 1.5 2 3\n", "half.obj:4:", "must be a whole number, or up to three with '/' between"},
      {"letter.obj", three + "f 1x 2 3\n", "letter.obj:4:", "found '1x'"},
      {"plus.obj", three + "f +1 2 3\n", "plus.obj:4:", "found '+1'"},
      {"four.obj", three + "f 1/1/1/1 2 3\n", "four.obj:4:", "found '1/1/1/1'"},
      {"texture.obj", three + "f 1/x 2 3\n", "texture.obj:4:", "found '1/x'"},
      {"hex.obj", "v 0x10 0 0\n" + three + "f 1 2 3\n", "hex.obj:1:", "must be a finite number; found '0x10'"},
      {"joined.obj", "v 0 0 0 v 1 0 0\nf 1 2 3\n", "joined.obj:1:", "what follows vertex 1 must be a finite number"},
      {"numbers.obj", "v 0 0 0 1 0 0 0 1 0\nf 1 2 3\n", "numbers.obj:1:", "is a line end missing?"},
      {"continued.obj", three + "f 1 2 \\\n\\\n9\nf 1 2 x\n", "continued.obj:7:", "found 'x'"},
      {"utf16.obj", std::string("\xff\xfev\0 \0", 6), "utf16.obj:", "UTF-16"},
      {"hex.off", "OFF\n3 1 0\n0x0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "hex.off:3:", "found '0x0'"},
      {"more.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n", "more.off:7:", "goes on after its 1 faces"},
      {"joined.off", "OFF\n3 1 0\n0 0 0 OFF\n1 0 0\n0 1 0\n3 0 1 2\n", "joined.off:3:", "what follows vertex 0"},
      {"hex.ply", ply + faces + "3 0x0 1 2\n", "hex.ply:13:", "must be a whole number; found '0x0'"},
      {"float.ply", ply + faces + "3 0 1e0 2\n", "float.ply:13:", "must be a whole number; found '1e0'"},
      {"minus.ply", ply + faces + "3 0 -1 2\n", "minus.ply:13:", "0 or more; found -1"},
      {"wide.ply", ply + faces + "3 0 1 2 3\n", "wide.ply:13:", "more stands on the line"},
      {"more.ply", ply + faces + "3 0 1 2\n3 2 1 0\n", "more.ply:14:", "the file goes on after"},
      {"list_of_floats.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
       "element face 1\nproperty list uchar double vertex_indices\nend_header\n" +
           std::string(12, '\0') + "\1" + std::string(6, '\0') + "\x37\x7e",
       "list_of_floats.ply:", "found 9.62683514e+299"},
      {"empty.obj", "", "empty.obj:", "holds no vertices"},
      {"cloud.obj", "v 0 0 0\n", "cloud.obj:", "holds no faces"},
      {"junk.obj",
       std::string("\x7f"
                   "ELF\0\x01\xff\xfe v\0\n\n\xc3(",
                   16),
       "junk.obj:", "holds no vertices"},
      {"word.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 x\n",
       "word.off:6:", "corner 2 of face 0 must be a whole number"},
      {"magic.off", "OOF\n3 1 0\n", "magic.off:1:", "begins with the word OFF"},
      {"negative.off", "OFF\n-3 1 0\n", "negative.off:2:", "whole number"},
      {"beyond.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
       "beyond.off:6:", "names vertex 3, but there are only 3"},
      {"huge.off", "OFF\n4294967295 4294967295 0\n0 0 0\n", "huge.off:3:", "ends before vertex 1 of 4294967295"},
      {"polygon.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "polygon.off:6:", "the line ends"},
      {"magic.ply", "plx\n", "magic.ply:1:", "begins with the word ply"},
      {"type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n",
       "type.ply:4:", "unknown property type 'real'"},
      {"version.ply", "ply\nformat ascii 2.0\n", "version.ply:2:", "version 1.0"},
      {"cloud.ply", ply + "end_header\n0 0 0\n1 0 0\n0 1 0\n", "cloud.ply:", "point cloud"},
      {"hole.ply", "ply\nformat ascii 1.0\nelement nothing 4000000000000\nend_header\n", "hole.ply:", "no properties"},
      {"beyond.ply", ply + faces + "3 0 1 3\n", "beyond.ply:", "names vertex 3, but there are only 3"},
      {"fraction.ply", ply + faces + "3 0 1 1.5\n", "fraction.ply:13:", "whole number"},
      {"list.ply", ply + faces + "4000000000 0 1 2\n", "list.ply:13:", "the line ends"},
      {"huge.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
       "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n0123456789ab",
       "huge.ply:", "ends before x of vertex 1"},
      {"mesh.stl", "solid\n", "mesh.stl:", ".obj, .off or .ply"},
  };
}

void bad_files_are_refused_with_place_and_reason() {
  for (const BadFile &bad : bad_files()) {
    std::string message = "read without complaint";
    try {
      cli::read_mesh(write_file(bad.name, bad.contents));
    } catch (const cli::FileError &error) {
      message = error.what();
    }
    const bool good = message.find(bad.place) != std::string::npos && message.find(bad.words) != std::string::npos;
    if (!good) printf("%s: %s\n", bad.name, message.c_str());
    CHECK(good);
  }
}

void missing_files_and_directories_are_refused() {
  for (const std::string &path : {in_directory("does_not_exist.obj"), directory}) {
    bool refused = false;
    try {
      cli::read_file(path);
    } catch (const cli::FileError &error) {
      refused = std::strstr(error.what(), "cannot read") != nullptr;
    }
    CHECK(refused);
  }
}

// ---------------------------------------------------------------------------------------------------------- writing

void a_point_cache_has_the_bytes_of_the_format() {
  const float first[6] = {0, 1, 2, 3, 4, 5}, second[6] = {-1, -2, -3, -4, -5, 0.5f};
  cli::OutputFolder folder(directory);
  cli::PointCache cache(folder, "two_points.pc2", 2);
  cache.append(first);
  cache.append(second);
  cache.close();
  folder.put_in_place();

  std::string expected("POINTCACHE2\0", 12);
  append(expected, int32_t{1}, false);
  append(expected, int32_t{2}, false);
  append(expected, 0.0f, false);
  append(expected, 1.0f, false);
  append(expected, int32_t{2}, false);
  for (float x : first) append(expected, x, false);
  for (float x : second) append(expected, x, false);
  CHECK(cli::read_file(in_directory("two_points.pc2")) == expected);
}

void an_unwritable_file_is_an_error_that_names_it() {
  bool refused = false;
  try {
    cli::OutputFolder folder(directory);
    cli::PointCache cache(folder, "no_such_directory/x.pc2", 2);
  } catch (const std::runtime_error &error) {
    refused = std::strstr(error.what(), "x.pc2") != nullptr;
  }
  CHECK(refused);
}

// What the folder's files hold, by name, a partial one by its ending.
std::vector<std::string> names_in(const std::string &folder) {
  std::vector<std::string> names;
  for (const auto &entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

void print_file(cli::OutputFolder &folder, const std::string &name, const char *text) {
  cli::OutputFile file(folder, name);
  file.print("%s", text);
  file.close();
}

void files_are_there_whole_or_as_they_were() {
  const std::string path = in_directory("whole");
  std::filesystem::remove_all(path);
  {
    cli::OutputFolder folder(path);
    print_file(folder, "a.csv", "old");
    CHECK(names_in(path).size() == 1 && names_in(path)[0] != "a.csv");
    folder.put_in_place();
    CHECK(names_in(path) == std::vector<std::string>{"a.csv"});
    print_file(folder, "a.csv", "new");
    print_file(folder, "b.csv", "new");
    CHECK(cli::read_file(path + "/a.csv") == "old");
  }  // neither was put in place
  CHECK(names_in(path) == std::vector<std::string>{"a.csv"} && cli::read_file(path + "/a.csv") == "old");
}

std::string refusal(cli::OutputFolder &folder, const std::string &name) {
  try {
    print_file(folder, name, "output");
  } catch (const std::runtime_error &error) {
    return error.what();
  }
  return "written without complaint";
}

// False where the system makes no symbolic links for everybody, as Windows and Wine do not.
bool make_link(const std::filesystem::path &target, const std::string &link) {
  std::error_code error;
  std::filesystem::create_symlink(target, link, error);
  if (error) printf("skipped: the symbolic link %s: %s\n", link.c_str(), error.message().c_str());
#ifdef __unix__
  CHECK(!error);
#endif
  return !error;
}

// By its own name, a hard link and a symbolic link; the early check finds the same before anything is written.
void an_input_is_never_replaced() {
  const std::string path = in_directory("inputs"), mesh = path + "/a_rest.obj";
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  std::ofstream(mesh) << "input";
  std::filesystem::create_hard_link(mesh, path + "/hard.obj");
  std::vector<std::string> names = {"a_rest.obj", "hard.obj"};
  if (make_link("a_rest.obj", path + "/soft.obj")) names.push_back("soft.obj");
  cli::OutputFolder folder(path, {mesh});
  for (const std::string &name : names) {
    CHECK(refusal(folder, name).find("a_rest.obj; choose another folder") != std::string::npos);
    bool refused = false;
    try {
      folder.refuse_inputs([&](const std::string &written) { return written == name; });
    } catch (const std::runtime_error &) {
      refused = true;
    }
    CHECK(refused);
  }
  folder.refuse_inputs([](const std::string &name) { return cli::is_output("b", name); });
  CHECK(refusal(folder, "b_rest.obj") == "written without complaint");
  folder.put_in_place();
  CHECK(cli::read_file(mesh) == "input" && cli::read_file(path + "/hard.obj") == "input");
}

// A link to another file is written through; a device or a folder of that name is left alone.
void links_are_followed_and_devices_refused() {
  const std::string path = in_directory("links"), elsewhere = in_directory("elsewhere.csv");
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path + "/folder.csv");
  std::ofstream(elsewhere) << "old";
  if (!make_link(std::filesystem::absolute(elsewhere), path + "/link.csv")) return;
  cli::OutputFolder folder(path);
  print_file(folder, "link.csv", "new");
  folder.put_in_place();
  CHECK(cli::read_file(elsewhere) == "new" && std::filesystem::is_symlink(path + "/link.csv"));
  CHECK(refusal(folder, "folder.csv").find("folder.csv: something that is no file has this name") != std::string::npos);
#ifdef __linux__
  make_link("/dev/full", path + "/device.csv");
  CHECK(refusal(folder, "device.csv").find("device.csv: something that is no file") != std::string::npos);
#endif
}

void names_of_outputs_are_known() {
  for (const char *name : {"a.pc2", "a_rest.obj", "a_frames.csv", "a_comparison.csv", "a_bones.csv", "a_frame_0042.obj",
                           "a_frame_123456_handles.csv", "a_12_warp-virtual-work.obj"})
    CHECK(cli::is_output("a", name));
  for (const char *name : {"a.obj", "a_body.obj", "b_rest.obj", "a_frame_.obj", "a", "", "a_rest.objx"})
    CHECK(!cli::is_output("a", name));
}

void runs_of_too_many_frames_are_refused() {
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  CHECK(cli::frame_count(scene) == 150);
  scene.duration = 1e300;
  std::string message;
  try {
    cli::frame_count(scene);
  } catch (const std::runtime_error &error) {
    message = error.what();
  }
  CHECK(message == "1e+300 s at 30 frames a second are 3e+301 frames; at most 2147483646 can be numbered");
}

cli::FrameRecord frame_of_height(uint32_t frame, double height) {
  cli::FrameRecord record{};
  record.frame = frame;
  record.report.max_displacement = height;
  return record;
}

void extreme_frames_are_the_largest_local_maxima_in_order() {
  const double heights[] = {0, 3, 1, 5, 5, 2, 4, 1, 1, 2};
  std::vector<cli::FrameRecord> frames;
  for (uint32_t k = 0; k < 10; ++k) frames.push_back(frame_of_height(k, heights[k]));
  CHECK((cli::extreme_frames(frames, 2) == std::vector<std::size_t>{3, 6}));
  CHECK((cli::extreme_frames(frames, 10) == std::vector<std::size_t>{1, 3, 6, 9}));
  CHECK(cli::extreme_frames(frames, 0).empty());
}

// ---------------------------------------------------------------------------------------------------- frame motion

cli::FrameMotion shaking() {
  cli::FrameMotion motion;
  motion.pivot = {1, 2, 3};
  motion.rise = 1;
  motion.fall = 1;
  motion.end = 4;
  motion.translations = {{{1, 0, 0}, 0.5, 0.7, 1.0}, {{0, 0, 1}, 0.3, 1.1, 0.0}};
  motion.rotations = {{{0, 1, 0}, 0.4, 0.6, 0.5}, {{0, 0, 1}, 0.2, 0.9, 0.0}};
  return motion;
}

double largest_difference(const SwFrameDesc &a, const SwFrameDesc &b) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) largest = std::fmax(largest, std::fabs(a.origin[i] - b.origin[i]));
  for (int i = 0; i < 9; ++i) largest = std::fmax(largest, std::fabs(a.rotation[i] - b.rotation[i]));
  return largest;
}

void shaking_begins_and_ends_at_rest_in_the_world_frame() {
  SwFrameDesc world = shellwarp::frame_desc();
  world.rotation[0] = world.rotation[4] = world.rotation[8] = 1;
  const cli::FrameMotion motion = shaking();
  CHECK(largest_difference(motion.pose(0), world) == 0);
  CHECK(largest_difference(motion.pose(4), world) == 0);
  CHECK(largest_difference(motion.pose(9), world) == 0);
  CHECK(largest_difference(motion.pose(2), world) > 0.1);
  // The envelope starts as 10 t^3, its slope and curvature zero: at t = 1e-3 that is 1e-8, times amplitudes below 5.
  CHECK(largest_difference(motion.pose(1e-3), world) < 5e-8);
}

void poses_are_rotations_about_the_pivot() {
  cli::FrameMotion motion = shaking();
  motion.translations.clear();
  for (double t = 0; t < 5; t += 0.37) {
    const SwFrameDesc pose = motion.pose(t);
    for (int i = 0; i < 3; ++i) {
      double moved = pose.origin[i];
      for (int j = 0; j < 3; ++j) moved += pose.rotation[3 * i + j] * motion.pivot[static_cast<std::size_t>(j)];
      CHECK_NEAR(moved, motion.pivot[static_cast<std::size_t>(i)], 1e-14);  // rounding
      for (int k = 0; k < 3; ++k) {
        double product = 0;
        for (int j = 0; j < 3; ++j) product += pose.rotation[3 * i + j] * pose.rotation[3 * k + j];
        CHECK_NEAR(product, i == k, 1e-14);  // rounding
      }
    }
  }
}

// ----------------------------------------------------------------------------------------------------------- handles

cli::Handle led_handle() {
  cli::Handle handle;
  handle.vertex = strip_vertex(STRIP_COLUMNS - 1, 1);
  handle.holds_orientation = true;
  handle.release = 3;
  // Rises, stays from 1 to 2, comes halfway back.
  handle.keys = {{1, {-0.5, 0, 1}, {0, 0, 0}}, {2, {-0.5, 0, 1}, {0, -0.5, 0}}, {4, {0, 0, 0.5}, {0, -8, 0}}};
  return handle;
}

void handles_go_through_their_keys_and_never_beyond_them() {
  const cli::Handle handle = led_handle();
  CHECK(handle.target(0).offset[2] == 0 && handle.target(0).rotation[1] == 0);  // no key at 0: at rest there
  for (const cli::HandleKey &key : handle.keys)
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK_NEAR(handle.target(key.time).offset[i], key.offset[i], 1e-15);  // rounding
      CHECK_NEAR(handle.target(key.time).rotation[i], key.rotation[i], 1e-15);
    }
  CHECK(handle.target(9).offset[2] == 0.5 && handle.target(9).rotation[1] == -8);
  CHECK(handle.target(1.5).offset[0] == -0.5 && handle.target(1.5).offset[2] == 1);  // stays between equal keys
  double last = 0;
  for (double t = 0; t <= 4; t += 0.01) {
    const double z = handle.target(t).offset[2], turn = handle.target(t).rotation[1];
    CHECK(z >= 0 && z <= 1);
    CHECK(turn <= last);  // its keys only descend
    last = turn;
  }
}

void handles_move_without_jolts() {
  const cli::Handle handle = led_handle();
  const double h = 1e-4;
  const auto speed = [&](double t) {
    return (handle.target(t + h).rotation[1] - handle.target(t - h).rotation[1]) / (2 * h);
  };
  // Speeds of at most 8 a second change within 1e-3 s by accelerations of some 20: 0.02.
  for (double t = 0; t <= 5; t += 1e-3) CHECK_NEAR(speed(t + 1e-3), speed(t), 0.05);
  CHECK(std::fabs(speed(2)) > 0.1);                                 // passes through a key on its way
  CHECK(std::fabs(speed(0)) < 0.01 && std::fabs(speed(4)) < 0.01);  // 20 times h
}

cli::Mesh strip_as_mesh() {
  const Strip strip = make_strip();
  return {std::vector<double>(strip.positions, strip.positions + 3 * STRIP_VERTICES),
          std::vector<uint32_t>(strip.triangles, strip.triangles + 3 * STRIP_TRIANGLES)};
}

void handles_are_placed_on_the_nearest_vertex() {
  const cli::Mesh mesh = strip_as_mesh();
  cli::Handle handle;
  handle.nearest = {3.96, 0.02, 7};
  const std::vector<cli::PlacedHandle> placed = cli::place_handles({handle, led_handle()}, mesh);
  CHECK(placed.size() == 2 && placed[0].vertex == strip_vertex(STRIP_COLUMNS - 1, 1) && placed[0].rest[0] == 4);
  CHECK(placed[1].vertex == placed[0].vertex);
  handle.vertex = STRIP_VERTICES;
  std::string message;
  try {
    cli::place_handles({led_handle(), handle}, mesh);
  } catch (const std::runtime_error &error) {
    message = error.what();
  }
  CHECK(message == "handle 2 is at vertex 123, but the mesh has 123 vertices, counted from 0");
}

cli::Scene led_scene() {
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.name = "led";
  scene.supports.push_back({true, std::nullopt, {0, 1, 2}});
  scene.modes = 8;
  scene.damping.ratio = 0.3;
  scene.obj_frames = 1;
  cli::Handle height, slope;
  height.vertex = slope.vertex = strip_vertex(STRIP_COLUMNS - 1, 1);
  height.axes = SW_AXIS_Z;
  slope.axes = SW_AXIS_Y;
  slope.holds_position = false;
  slope.holds_orientation = true;
  height.release = slope.release = 2;
  height.keys = {{1, {0, 0, 1}, {}}};
  slope.keys = {{1, {}, {0, -0.6, 0}}};
  scene.handles = {height, slope};
  return scene;
}

std::vector<double> numbers_after(const std::string &text, const std::string &row_start) {
  std::vector<double> numbers;
  const std::size_t at = text.find("\n" + row_start);
  if (at == std::string::npos) return numbers;
  const char *next = text.c_str() + at + 1 + row_start.size();
  char *end = nullptr;
  for (; *next != '\n' && *next != '\0'; next = *end == ',' ? end + 1 : end) {
    numbers.push_back(std::strtod(next, &end));
    if (end == next && *end != ',') break;
  }
  return numbers;
}

// The whole way: led, met at every step, let go, and what a renderer gets of it.
void a_led_strip_is_where_its_handles_are_and_is_let_go() {
  const cli::Scene scene = led_scene();
  const cli::Mesh mesh = strip_as_mesh();
  const std::vector<cli::PlacedHandle> handles = cli::place_handles(scene.handles, mesh);
  cli::ProgressBar progress(true);
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  shellwarp::State state = cli::make_state(scene, mesh, model);
  cli::OutputFolder folder(directory);
  cli::PointCache cache(folder, "led.pc2", mesh.n_vertices());
  const cli::Run run = cli::simulate(scene, 75, mesh, handles, state, &cache);
  CHECK(run.handles.steps == 60 && run.handles.steps_missed == 0);  // the step that ends at 2 s is the last one held
  CHECK(run.handles.iterations >= 1 && run.handles.position_residual < 4e-6);
  CHECK(state.constraint_report().empty());

  // The largest displacement before the release, at a frame that this picks.
  cli::Run held = run;
  held.frames.resize(61);
  cache.close();
  cli::write_frame_files(folder, scene, mesh, handles, held, state);
  folder.put_in_place();
  const std::string table = cli::read_file(in_directory("led_frames.csv"));
  CHECK(table.find("elastic_energy,obj,displacement,handles\n0,0,") != std::string::npos);
  const std::vector<std::size_t> chosen = cli::extreme_frames(held.frames, 1);
  char name[64];
  std::snprintf(name, sizeof name, "led_frame_%04u", held.frames[chosen.at(0)].frame);
  CHECK(table.find(std::string(name) + ".obj," + name + "_displacement.txt," + name + "_handles.csv\n") !=
        std::string::npos);
  const double seconds = held.frames[chosen[0]].report.time;
  const std::string marks = cli::read_file(in_directory(std::string(name) + "_handles.csv"));
  const std::vector<double> height = numbers_after(marks, "121,position,");
  const std::vector<double> slope = numbers_after(marks, "121,orientation,");
  CHECK(height.size() >= 3 && slope.size() == 12);
  if (height.size() < 3 || slope.size() < 12) return;
  CHECK_NEAR(height[2], handles[0].position(seconds)[2], 1e-8);               // nine digits
  CHECK(height[0] < 4 && height[0] > 3);                                      // not held along x: where the vertex is
  for (std::size_t i = 0; i < 3; ++i) CHECK_NEAR(slope[i], height[i], 4e-6);  // the vertex itself: met
  const double angle = -handles[1].handle.target(seconds).rotation[1];
  CHECK_NEAR(slope[3], std::cos(angle), 1e-6);  // a turn about y: x goes to (cos, 0, sin)
  CHECK_NEAR(slope[5], std::sin(angle), 1e-6);
  CHECK_NEAR(slope[7], 1, 1e-6);
}

// ------------------------------------------------------------------------------------------------------------ scenes

void a_scene_is_read_in_full() {
  write_file("strip.off", off_text());
  const std::string path =
      write_file("full.toml",
                 "title = 'full'\nmesh = 'strip.off'\nobj_frames = 7\n[material]\nk_area = 1\nk_length = 2\n"
                 "k_bend = 3\ndensity = 4\n[[support]]\nkind = 'clamped'\nbox = [0, 0, 0, 1, 1, 1]\n"
                 "[[support]]\nvertices = [4, 5]\n[simulation]\nmodes = 5\nprecision = 'f64'\n"
                 "method = 'lma'\nintegrator = 'exact'\nframe_rate = 25\nsteps_per_frame = 4\n"
                 "duration = 2\ngravity = [0, -9.8, 0]\n[damping]\nratio = 0.1\nmass = 0.2\n"
                 "stiffness = 0.3\n[frame]\nrise = 0.5\n[[frame.translate]]\naxis = [1, 0, 0]\n"
                 "amplitude = 2\nfrequency = 3\n[[frame.rotate_degrees]]\naxis = [0, 1, 0]\n"
                 "amplitude = 180\nfrequency = 1\nphase_degrees = 90\n[expect]\nmodes = 5\n"
                 "turn_in_range = true\nmax_displacement = [1, 2]\nhandles_met = true\nhandle_residual = 0.01\n"
                 "[[handle]]\nnearest = [1, 2, 3]\nkind = 'both'\naxes = 'zx'\ncompliance = 0.5\nrelease = 2\n"
                 "key = [{ time = 1, offset = [1, 2, 3], rotate_degrees = [0, 180, 0] }, { time = 2 }]\n"
                 "[[handle]]\nvertex = 3\n[paper]\nsource = 'x'\nmodes = 4\n");
  const cli::Scene s = cli::read_scene(path);
  CHECK(s.name == "full" && s.title == "full" && s.obj_frames == 7);
  CHECK(cli::read_mesh(s.mesh_path).n_vertices() == 7);
  CHECK(s.material.k_area == 1 && s.material.k_length == 2 && s.material.k_bend == 3 && s.material.density == 4);
  CHECK(s.supports.size() == 2 && s.supports[0].clamped && s.supports[0].box && !s.supports[1].clamped);
  CHECK((s.supports[1].vertices == std::vector<uint32_t>{4, 5}));
  CHECK(s.modes == 5 && s.double_precision && s.method == SW_METHOD_LMA && s.integrator == SW_INTEGRATOR_EXACT && s.duration == 2 &&
        s.gravity[1] == -9.8);
  CHECK(s.frame_rate == 25 && s.steps_per_frame == 4 && s.step() == 0.01);
  CHECK(s.damping.ratio == 0.1 && s.damping.mass == 0.2 && s.damping.stiffness == 0.3);
  CHECK(s.motion.moves() && s.motion.rise == 0.5 && s.motion.end == 2 && s.motion.translations[0].frequency == 3);
  CHECK_NEAR(s.motion.rotations[0].amplitude, 3.141592653589793, 1e-15);  // rounding of degrees
  CHECK(s.expect.handles_met && s.expect.handle_residual == 0.01 && s.handles.size() == 2);
  const cli::Handle &led = s.handles[0], &held = s.handles[1];
  CHECK(!led.vertex && led.nearest[2] == 3 && led.holds_position && led.holds_orientation);
  CHECK(led.axes == (SW_AXIS_X | SW_AXIS_Z) && led.compliance == 0.5 && led.release == 2.0 && led.keys.size() == 2);
  CHECK(led.keys[0].offset[1] == 2 && led.keys[1].time == 2 && led.keys[1].offset[1] == 0);
  CHECK_NEAR(led.keys[0].rotation[1], 3.141592653589793, 1e-15);
  CHECK(held.vertex == 3u && held.holds_position && !held.holds_orientation && held.keys.empty() && !held.release);
  CHECK(held.axes == (SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z) && held.held(1e9));
  CHECK(s.expect.modes == 5u && s.expect.turn_in_range && s.expect.max_displacement->second == 2 && s.paper->modes == 4.0);
}

void loads_and_comparisons_are_read() {
  const std::string start = "mesh = 'strip.off'\nlength_unit = 'cm'\n[simulation]\ngravity = [0, 0, -2]\n";
  const cli::Scene loaded = cli::read_scene(write_file(
      "loads.toml", start + "method = 'shell-explicit'\nstatic = true\n[[force]]\nvertex = 7\nvector = [1, 2, 3]\n"
                            "[[force]]\nnearest = [1, 0, 0]\nvector = [0, 0, 1]\n[wind]\nvelocity = [0, 5, 0]\n"
                            "normal_drag = 1.5\n[expect]\nenergy_never_grows = true\nsettled = 0.1\n"));
  CHECK(loaded.method == SW_METHOD_SHELL_EXPLICIT && loaded.is_static && loaded.length_unit == "cm");
  CHECK(loaded.loads.forces.size() == 2 && loaded.loads.forces[0].vertex == 7u && !loaded.loads.forces[1].vertex);
  CHECK(loaded.loads.forces[0].vector[2] == 3 && loaded.loads.wind->velocity[1] == 5 &&
        loaded.loads.wind->density == 1.2);
  CHECK(loaded.expect.energy_never_grows && loaded.expect.settled == 0.1 && !loaded.comparison);

  const cli::Scene compared = cli::read_scene(
      write_file("compared.toml", start + "[comparison]\nmethods = ['lma', 'warp-virtual-work']\ngravities = [1, 2.5]\n"
                                          "bending = [1, 10]\n[expect]\nwarp_below_lma = true\nlma_error = [0, 1]\n"
                                          "[expect.reference]\ntolerance = 0.1\nlma_error = [1, 2, 3, 4]\n"));
  const cli::Comparison &c = *compared.comparison;
  CHECK(c.methods.size() == 2 && c.methods[1] == SW_METHOD_WARP_VIRTUAL_WORK && c.gravities[1] == 2.5);
  CHECK(c.bending.size() == 2 && c.expect.warp_below_lma && !c.expect.errors_grow && c.expect.tolerance == 0.1);
  CHECK(c.expect.errors.size() == 1 && c.expect.errors[0].method == SW_METHOD_LMA);
  CHECK(c.expect.errors[0].reference.size() == 4 && c.expect.errors[0].range->second == 1);
}

// Richardson's extrapolation where the motion converges: of a second-order error e by h it is 4 e by 2 h, 3 e apart. Nothing is known beyond, and the difference itself is told.
void what_doubling_the_steps_changes_tells_their_error() {
  CHECK(std::fabs(cli::step_error_of(3e-4, 2) - 1e-4) < 1e-6 && cli::step_error_of(0.3, 2) == 0.3 && cli::step_error_of(0.9, 2) == 0.9);
  CHECK(cli::step_error_of(0.01, 1) == 0.01 && cli::step_error_of(0, 2) == 0);
  cli::Scene scene;
  scene.integrator = SW_INTEGRATOR_SECOND_ORDER;
  CHECK(cli::order_of_steps(scene, SW_METHOD_SHELL_IMPLICIT) == 2 && cli::order_of_steps(scene, SW_METHOD_WARP) == 1 && cli::order_of_steps(scene, SW_METHOD_POLYNOMIAL_SHELL) == 2);
  scene.colliders.emplace_back();
  CHECK(cli::order_of_steps(scene, SW_METHOD_SHELL_IMPLICIT) == 1);
  CHECK(cli::StepTwin::applies(scene, 2) && !cli::StepTwin::applies(scene, 1));
  scene.is_static = true;
  CHECK(!cli::StepTwin::applies(scene, 2));
}

// A metre of cotton of 120 g/m2 bends by itself at (6.1e-6 / 1.17)^(1/3) m = 17 mm; a wind of 3 m/s, 5.4 Pa, bends it at 10.
void what_is_limp_takes_the_full_shell() {
  cli::Mesh mesh;
  for (const auto &x : {std::array<double, 3>{0, 0, 0}, {0.8, 0, 0}, {0, 0.6, 0}}) mesh.add_vertex(x);
  cli::Scene scene;
  scene.gravity = {0, -9.8, 0};
  cli::set_preset("cotton", 1, scene.material);
  scene.material.sheet = true;
  CHECK(std::fabs(cli::limpness(scene, mesh) - 57.5) < 1);
  scene.loads.wind.emplace();
  scene.loads.wind->velocity = {0, 0, 3};
  scene.loads.wind->density = 1.2;
  CHECK(std::fabs(cli::limpness(scene, mesh) - 96.1) < 2);
  const cli::Scene limp = scene;
  CHECK(cli::settle_early(mesh, 150, true, scene).find("auto is the full shell") == 0);
  CHECK(scene.method == SW_METHOD_SHELL_IMPLICIT && scene.by_auto && scene.integrator == SW_INTEGRATOR_SECOND_ORDER && scene.proxy.vertices == 0);
  scene = limp;
  scene.auto_error = 0.1;  // a budget is the user's word
  CHECK(cli::settle_early(mesh, 150, true, scene).empty() && scene.method == SW_METHOD_AUTO);
  scene = limp;
  scene.material.thickness *= 10;
  CHECK(cli::settle_early(mesh, 150, true, scene).empty() && scene.method == SW_METHOD_AUTO);
  cli::Mesh large = mesh;
  while (large.n_vertices() < 4000) large.add_vertex({0, 0, 0});
  scene = limp;  // files are of the mesh itself
  CHECK(cli::settle_early(large, 150, false, scene).find("--proxy 2000 (proxy) about ") != std::string::npos && scene.proxy.vertices == 0);
  scene = limp;
  CHECK(cli::settle_early(large, 150, true, scene).find("it takes a proxy of about ") != std::string::npos);
  CHECK(scene.proxy.vertices >= 800 && scene.proxy.vertices <= 1400);
  scene = limp;
  scene.method = SW_METHOD_SHELL_IMPLICIT;
  CHECK(cli::settle_early(large, 150, true, scene).find("the full shell takes long on 4000 vertices") == 0 && scene.proxy.vertices == 0);
}

// A tube whose waist slants by more than a side's skin, and a sheet, whose outline runs all around.
void a_rim_is_held_level_or_not() {
  cli::Mesh tube;
  constexpr uint32_t kAround = 12, kRows = 9;
  for (uint32_t r = 0; r < kRows; ++r)
    for (uint32_t c = 0; c < kAround; ++c) {
      const double angle = 2 * 3.14159265358979 * c / kAround;
      tube.add_vertex({std::cos(angle), -1.0 * r + 0.2 * std::cos(angle), std::sin(angle)});
    }
  for (uint32_t r = 0; r + 1 < kRows; ++r)
    for (uint32_t c = 0; c < kAround; ++c) {
      const uint32_t a = r * kAround + c, b = r * kAround + (c + 1) % kAround;
      tube.add_polygon({a, b, b + kAround, a + kAround});
    }
  tube.cut_polygons();
  const std::vector<uint32_t> waist = cli::rim_at({1, true}, tube), hem = cli::rim_at({1, false}, tube);
  CHECK(waist.size() == kAround && waist.front() == 0 && waist.back() == kAround - 1);
  CHECK(hem.size() == kAround && hem.front() == (kRows - 1) * kAround);
  cli::Scene scene;
  scene.supports.emplace_back();
  scene.supports[0].side = cli::Side{1, true};
  const std::vector<std::string> notes = cli::notes_of_rims(scene, tube);
  CHECK(notes.size() == 1 && notes[0].find("high-y holds 3 of the 12 vertices of the open edge there, which is not level: --pin rim:high-y") != std::string::npos);
  scene.supports[0].rim = true;
  CHECK(cli::notes_of_rims(scene, tube).empty());
  // Growth is whole at the waist, 1 from the sixth ring on, and a sixth less a ring between.
  const std::vector<double> growth = cli::faded_growth(tube, waist, 1.6);
  for (uint32_t r = 0; r < kRows; ++r) CHECK(std::fabs(growth[r * kAround] - std::max(1.0, 1.6 - 0.1 * r)) < 1e-12);
  std::vector<std::string> inputs;
  CHECK(cli::read_pin("rim:low-z", inputs).rim && cli::read_pin("rim:low-z", inputs).side->axis == 2);
}

// In words, whatever turns tell: how far off, how surely, and what to do about it.
void the_verdict_says_how_far_off_the_run_is() {
  cli::Run run;
  CHECK(cli::verdict(run).empty());
  run.certificate.emplace();
  SwCertificate &found = *run.certificate;
  found.method = SW_METHOD_WARP;
  found.error = 0.0123;
  CHECK(cli::verdict(run) == "certified: the last frame is about 1.2 % off the full nonlinear shell");
  found.error = 0.45;
  found.out_of_range = 1;
  CHECK(cli::verdict(run).find("about 45 % off the full nonlinear shell; use --method") != std::string::npos);
  found.remaining = 0.5;
  CHECK(cli::verdict(run).find("roughly") != std::string::npos);
  CHECK(cli::verdict(run).find("use --method auto or shell-implicit") != std::string::npos);
  CHECK(cli::verdict(run, true).find("use --method shell-implicit") != std::string::npos);  // of what auto chose
  CHECK(cli::verdict(run, false, true).find("use --method") == std::string::npos);
  found.method = SW_METHOD_REDUCED_SHELL;
  CHECK(cli::verdict(run).find("use --method shell-implicit") != std::string::npos);
  // The worst of several frames by length: the first one hardly moves.
  found.error = 0.028;
  found.out_of_range = 0;
  found.remaining = 0;
  run.estimates = {{0.1, 5, 0.001}, {1, 0.99, 0.05}, {4, 0.028, 0.02}};
  CHECK(cli::verdict(run) == "certified: about 99 % of the largest displacement off the full nonlinear shell at 1 s, the worst of 3 frames judged; "
                             "about 1.1 % in the last one; do not trust the picture; use --method shell-implicit --second-order");
  found.max_error = 0.1;
  CHECK(cli::verdict(run).find("; the full shell is 2 times as far from the last frame as anything has moved; do not trust") != std::string::npos);
  found.max_error = 0.04;  // less than what has moved
  run.estimates[1].error = 0.01;  // 5 off by 0.001 is a tenth of what 0.05 makes
  CHECK(cli::verdict(run).find("about 10 % of the largest displacement") != std::string::npos && cli::verdict(run).find("at 0.1 s") != std::string::npos);
  CHECK(cli::verdict(run).find("use --method") == std::string::npos);
  run.estimates[2].error = found.error = 0.3;  // the last is the worst
  CHECK(cli::verdict(run).find("certified: about 12 % of the largest displacement off the full nonlinear shell in the last frame, the worst of 3 judged") == 0);
  found.method = SW_METHOD_SHELL_IMPLICIT;
  CHECK(cli::verdict(run).empty());
  run.uncertified = "nothing to go by";
  CHECK(cli::verdict(run) == "not certified: the error could not be estimated: nothing to go by");
}

// The names that scenes and options have are the library's own, all of them, whatever methods it has.
void methods_have_the_names_of_the_library() {
  const std::vector<std::string> names = host::method_names();
  CHECK(names.size() == sw_method_count());
  for (uint32_t k = 0; k < names.size(); ++k) {
    CHECK(names[k] == sw_method_name(sw_method_at(k)) && host::find_method(names[k]) == sw_method_at(k));
    CHECK(static_cast<int>(names[k].size()) <= host::widest_method_name());
    const cli::Scene scene =
        cli::read_scene(write_file("method.toml", "mesh = 'a.obj'\n[simulation]\nmethod = '" + names[k] + "'\n"));
    CHECK(scene.method == sw_method_at(k));
  }
  CHECK(!host::find_method("virtual-work") && !host::find_method(""));
  CHECK(cli::read_scene(write_file("method.toml", "mesh = 'a.obj'\n")).method == SW_METHOD_AUTO);
}

// A comparison takes every method but the full shell, its measure, and the choice; each has keys of its name.
void a_comparison_takes_the_methods_of_the_library() {
  std::string list, keys;
  for (const std::string &name : host::method_names()) {
    if (name == "auto" || name.find("shell-") == 0) continue;
    list += (list.empty() ? "'" : ", '") + name + "'";
    std::string word = name;
    std::replace(word.begin(), word.end(), '-', '_');
    keys += word + "_error = [0, 1]\n";
  }
  const cli::Scene scene = cli::read_scene(
      write_file("compared.toml", "mesh = 'a.obj'\n[simulation]\ngravity = [0, 0, -1]\n[comparison]\nmethods = [" +
                                      list + "]\ngravities = [1]\n[expect]\n" + keys));
  CHECK(scene.comparison->methods.size() == sw_method_count() - 3);
  CHECK(scene.comparison->expect.errors.size() == sw_method_count() - 3);
}

// What the hosts conclude from a method's needs holds for states of it.
void a_method_moves_as_its_needs_tell() {
  const cli::Mesh mesh = strip_as_mesh();
  cli::ProgressBar progress(true);
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  scene.reduced.fields = 4;
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  uint32_t offered = 0;
  for (const uint32_t method : host::methods()) {
    if (sw_model_offers(model.get(), method) != SW_OK) continue;
    ++offered;
    SwStateDesc desc = shellwarp::state_desc();
    desc.method = method;
    const shellwarp::State state(model, desc);
    uint32_t count = 0;
    CHECK(host::moves_by_modes(method) == (sw_state_amplitudes(state.get(), nullptr, nullptr, 0, &count) == SW_OK));
    SwDampingDesc damping = shellwarp::damping_desc();
    std::vector<double> ratios(model.info().modes, 0.1);  // the full shell has no modes to damp one by one
    ratios[0] = 0.2;
    damping.ratios = ratios.data();
    damping.n_ratios = model.info().modes;
    CHECK(host::is_full_shell(method) == (sw_state_set_damping(state.get(), &damping) == SW_ERROR_UNSUPPORTED));
    CHECK(sw_state_set_damping(state.get(), &(damping = host::damping(ratios[0], 0, 0))) == SW_OK);
  }
  CHECK(offered >= 7);
}

// A run of three frames of a shell 2 long, to be described.
cli::Run run_that_moved(double most) {
  cli::Run run;
  for (uint32_t frame = 0; frame < 3; ++frame) {
    cli::FrameRecord record{frame, {}, {}};
    record.report.time = 0.1 * frame;
    record.report.turn_in_range = 1;
    record.report.max_displacement = frame == 1 ? most : frame == 2 ? most / 2 : 0;
    record.report.max_rotation = 0.5;
    run.frames.push_back(record);
  }
  return run;
}

std::string words_of(const cli::Scene &scene, const cli::Run &run, uint32_t unknowns = 9, const std::vector<SwFrontPoint> &front = {},
                     const std::vector<std::string> &warnings = {}, uint32_t zero_modes = 0) {
  SwModelInfo info{};
  info.size = 2;
  info.auto_method = SW_METHOD_WARP;
  info.zero_modes = zero_modes;
  info.n_unknowns = unknowns;
  std::string all;
  for (const std::string &sentence : cli::closing_words({scene, info, {0, 45}, run, front, {}, warnings})) all += sentence + "\n";
  return all;
}

// What moved how far, in lengths and sizes; and what to change only where something is to be changed.
void the_closing_words_say_what_moved_and_what_to_change() {
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.gravity = {0, 0, -1};
  scene.length_unit = "cm";
  CHECK(words_of(scene, run_that_moved(0.5)) ==
        "moved: up to 0.5 cm, 25 % of its size of 2 cm, at 0.1 s; turned up to 29 degrees; at the end by 0.25 cm; by the method warp\n");
  scene.method = SW_METHOD_AUTO;
  CHECK(words_of(scene, run_that_moved(0.5)).find("; by the method warp, that auto took\n") != std::string::npos);
  scene.method = SW_METHOD_WARP;
  const std::string tiny = words_of(scene, run_that_moved(2e-5));
  CHECK(tiny.find("1.0e-05 of its size") != std::string::npos && tiny.find("cannot be seen") != std::string::npos);
  CHECK(tiny.find("its slowest swing has 45 Hz") != std::string::npos && tiny.find("--scale 0.01") != std::string::npos);
  const std::string little = words_of(scene, run_that_moved(2.1e-3));
  CHECK(little.find(" of its size is hardly seen: a stronger wind or force moves it more") != std::string::npos);
  CHECK(words_of(scene, run_that_moved(2.1e-2)).find("try") == std::string::npos);
  CHECK(words_of(scene, run_that_moved(5)).find("no held shell moves by 2.5 times its size") != std::string::npos);
  CHECK(words_of(scene, run_that_moved(0)).find("note: nothing has moved") != std::string::npos);
  CHECK(words_of(scene, run_that_moved(0), 0).find("every vertex is held") != std::string::npos);
  const std::string falls = words_of(scene, run_that_moved(0), 9, {}, {}, 6);  // a free shell at rest under gravity alone
  CHECK(falls.find("nothing holds the shell, so its inertia balances the load") != std::string::npos && falls.find("no gravity") == std::string::npos);
  SwFrontPoint hanging{};  // a curtain that the choice lets hang before it begins
  hanging.method = SW_METHOD_ROTATION_STRAIN;
  hanging.chosen = hanging.sagged = 1;
  const std::string hangs = words_of(scene, run_that_moved(0), 9, {hanging});
  CHECK(hangs.find("rotation-strain, which was chosen, begins there") != std::string::npos && hangs.find("no gravity") == std::string::npos);
  cli::Run missed = run_that_moved(0.5);
  missed.handles.steps = 60;
  missed.handles.steps_missed = 12;
  CHECK(words_of(scene, missed).find("try: handles were missed in 12 of 60 steps") != std::string::npos);
  // What was chosen already is not advised.
  scene.material.frequency = 3;
  scene.scale = 0.01;
  const std::string again = words_of(scene, run_that_moved(2e-5));
  CHECK(again.find("a lower --frequency (frequency) softens it\n") != std::string::npos && again.find("--scale") == std::string::npos);
  std::swap(scene.material.frequency, scene.material.sag);
  CHECK(words_of(scene, run_that_moved(2e-5)).find("a larger --sag (sag) softens it\n") != std::string::npos);
  scene.material.sheet = true;
  CHECK(words_of(scene, run_that_moved(2e-5)).find("a smaller --thickness (thickness) softens it, and so does a softer --material (preset)\n") != std::string::npos);
  const std::string fallen = words_of(scene, run_that_moved(50), 9, {}, {}, 6);
  CHECK(fallen.find("s; turned") != std::string::npos && fallen.find("\ntry: nothing is held, so that the shell falls: --pin low-x") != std::string::npos);
  CHECK(fallen.find("its error") == std::string::npos);  // of what falls, small as it is
  cli::Run coarse = run_that_moved(0.5);
  coarse.frames[1].report.step_error = 0.01;
  CHECK(words_of(scene, coarse).find("try: a step is off by up to 2 % of the motion") != std::string::npos);
  coarse.frames[1].report.step_error = 0.004;
  CHECK(words_of(scene, coarse).find("try:") == std::string::npos);
  scene.handles.emplace_back();  // a hand may lead a shell by less than can be seen, and as far as it likes
  scene.handles[0].keys.push_back({1, {0, 0.3, 0.4}, {}});
  CHECK(words_of(scene, run_that_moved(1)).find(", 2 times as far as its handles; turned") != std::string::npos);
  CHECK(words_of(scene, run_that_moved(0.49)).find(", as far as its handles; turned") != std::string::npos);
  CHECK(words_of(scene, run_that_moved(2e-5)).find("try") == std::string::npos);
  CHECK(words_of(scene, run_that_moved(5)).find("try") == std::string::npos);
}

void a_misspelt_word_finds_the_one_that_was_meant() {
  const std::vector<std::string> keys = {"density", "k_area", "k_bend", "k_length"};
  CHECK(cli::closest("k_bned", keys) == "k_bend" && cli::closest("kbend", keys) == "k_bend");
  CHECK(cli::closest("bend", keys) == "k_bend" && cli::closest("--k-Bend", keys) == "k_bend");
  CHECK(cli::closest("bending", {"k_bend", "bend"}) == "bend");
  CHECK(cli::closest("gravitas", {"--density", "--gravity"}) == "--gravity");
  CHECK(cli::closest("colour", keys).empty() && cli::closest("", keys).empty() && cli::closest("x", {}).empty());
  CHECK(cli::did_you_mean("k_bned", keys) == "; did you mean 'k_bend'?" && cli::did_you_mean("colour", keys).empty());
}

// Work that says nothing of itself is told of all the same, and work that is done at once is not.
void long_work_is_told_of() {
  CHECK(cli::progress_words("stepping", 12.2, 30, 120) == "stepping: frame 30 of 120, 12 s so far, about 36 s to go");
  CHECK(cli::progress_words("stepping", 2, 2, 120) == "stepping: frame 2 of 120, 2 s so far");
  CHECK(cli::progress_words("stepping", 2, 0, 120) == "stepping: frame 0 of 120, 2 s so far");
  CHECK(cli::progress_words("finding the equilibrium", 8, 0, 0) == "finding the equilibrium: 8 s so far");
  cli::Watch impatient("waiting", false, 0, std::chrono::milliseconds(1));
  while (impatient.times_told() < 2) std::this_thread::yield();
  const cli::Watch patient("not to be seen", false), silent("not to be seen", true, 0, std::chrono::seconds(0));
  CHECK(patient.times_told() == 0 && silent.times_told() == 0);
}

// A handle's way in one word: offsets with and without times, and when it is let go.
void a_path_in_a_word_is_read() {
  std::vector<std::string> inputs;
  const cli::Handle handle = cli::read_path("high-z:0,0,0.5@0.25:1,-2,3:free@4", inputs);
  CHECK(handle.side && handle.side->axis == 2 && handle.side->high && !handle.vertex && handle.group.empty());
  CHECK(handle.keys.size() == 2 && handle.keys[0].time == 0.25 && handle.keys[0].offset[2] == 0.5);
  CHECK(handle.keys[1].time == 1.25 && handle.keys[1].offset[1] == -2 && handle.release == 4.0);
  CHECK(cli::read_path("7:0,0,1", inputs).vertex == 7u && cli::read_path("stem:0,0,1", inputs).group == "stem");
  const cli::Handle near = cli::read_path("nearest:1,2,-3:0,0,1@2", inputs);
  CHECK(!near.vertex && !near.side && near.group.empty() && near.nearest[2] == -3 && near.keys[0].time == 2);
  const std::string path = write_file("way.txt", "0 0 0 0 # at rest\n1.5 0 1 2\n");
  CHECK(cli::read_path("7:" + path, inputs).keys[1].offset[2] == 2 && inputs == std::vector<std::string>{path});
  for (const char *bad : {"nearest:1,2:0,0,1", "nearest:0,0,1"}) {
    bool refused = false;
    try {
      cli::read_path(bad, inputs);
    } catch (const std::runtime_error &error) {
      refused = std::strstr(error.what(), "nearest:X,Y,Z:PATH") != nullptr;
    }
    CHECK(refused);
  }
  for (const char *bad : {"7", "7:", "7:0,0", "7:0,0,x", "7:0,0,1@", "7:0,0,1@-1", "7:0,0,1@2@3", "7:0,0,1@2:0,0,0@2", "7:none.txt"}) {
    bool refused = false;
    try {
      cli::read_path(bad, inputs);
    } catch (const std::runtime_error &error) {
      refused = std::strstr(error.what(), "--handle 7") != nullptr;
    }
    CHECK(refused);
  }
}

// A strip of 2 x 0.5 along x; sides, their middles and the words of --pin.
void sides_and_pins_are_found() {
  const cli::Mesh mesh = strip_as_mesh();
  std::vector<std::string> inputs;
  const cli::Bounds box = cli::bounds(mesh);
  for (const std::string &name : cli::side_names()) {
    const cli::Side side = *cli::find_side(name);
    const std::vector<uint32_t> found = cli::vertices_at(side, mesh);
    CHECK(!found.empty());
    for (const uint32_t v : found)
      CHECK(std::fabs(mesh.vertex(v)[side.axis] - (side.high ? box.high : box.low)[side.axis]) <= 0.01 * 2);
    CHECK(cli::read_pin(name, inputs).side->axis == side.axis);
  }
  const std::vector<uint32_t> end = cli::vertices_at({0, true}, mesh);
  const std::array<double, 3> middle = mesh.vertex(cli::middle_vertex(end, mesh));
  CHECK(middle[0] == box.high[0] && std::fabs(middle[1] - 0.5 * (box.low[1] + box.high[1])) < 0.1);
  CHECK((cli::read_pin("0,4,7-9", inputs).vertices == std::vector<uint32_t>{0, 4, 7, 8, 9}));
  CHECK(cli::read_pin("box:0,0,0,1,1,1", inputs).box->high[2] == 1 && cli::read_pin("9-7", inputs).group == "9-7");
  CHECK(cli::read_pin("stem", inputs).group == "stem" && inputs.empty());
  const cli::Support tip = cli::read_pin("nearest:100,0,0", inputs);
  const std::vector<uint32_t> next_to = cli::find_vertices(tip, mesh, "support");
  CHECK(next_to.size() == 1 && mesh.vertex(next_to[0])[0] == box.high[0]);
  std::string why;
  try {
    (void)cli::read_pin("nearest:1,2", inputs);
  } catch (const std::runtime_error &error) {
    why = error.what();
  }
  CHECK(why.find("a place is nearest:X,Y,Z") != std::string::npos);
  const cli::Wind gusts{{1, 0, 0}, 1.2, 1, 0, 0.5, 0.5};
  double mean = 0, least = 1, most = 1;
  for (int k = 0; k < 20000; ++k) {
    const double share = cli::strength(gusts, 0.01 * k);
    mean += share / 20000, least = std::min(least, share), most = std::max(most, share);
  }
  CHECK(std::fabs(mean - 1) < 0.01 && least < 0.5 && most > 1.5);  // 100 swings of the slowest sinusoid: what is left of the mean is of one
  CHECK(cli::strength(cli::Wind{}, 3.1) == 1);
}

cli::Scene scene_of_material(const std::string &lines) {
  return cli::read_scene(write_file("material.toml", "mesh = 'strip.off'\n[material]\n" + lines));
}

// The strip, 4 long, clamped, of a sheet of no Poisson's ratio.
void a_sheet_is_read_and_swings_as_a_beam() {
  const cli::Scene numbers = scene_of_material("young = 7e10\npoisson = 0\nthickness = 1e-3\nvolume_density = 2700\n");
  const cli::Material &m = numbers.material;
  CHECK(m.sheet && m.young == 7e10 && m.poisson == 0 && m.thickness == 1e-3 && m.volume_density == 2700);
  cli::Scene scene = numbers;
  cli::ProgressBar progress(true);
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  const double beam = 1.8751 * 1.8751 / (2 * 3.14159265 * STRIP_LENGTH * STRIP_LENGTH) * std::sqrt(7e10 * 1e-6 / (12 * 2700.0));
  // 40 elements along the beam: docs/evidence/koiter.md has -0.4 % at 16.
  CHECK(std::fabs(cli::make_model(scene, strip_as_mesh(), progress).frequencies().at(0) / beam - 1) < 4e-3);
}

void a_preset_is_a_sheet_that_can_be_changed() {
  const cli::Material card = scene_of_material("preset = 'card'\n").material;
  CHECK(card.sheet && card.young == 3e9 && card.poisson == 0.29 && card.thickness == 4e-4 && card.volume_density == 750);
  const cli::Material thick = scene_of_material("preset = 'card'\nthickness = 1e-3\n").material;
  CHECK(thick.thickness == 1e-3 && thick.young == card.young && cli::masses_per_area(thick, strip_as_mesh()).at(0) == 0.75);
  CHECK(!scene_of_material("k_area = 0\n").material.sheet && scene_of_material("k_area = 0\n").material.k_area == 0);
  CHECK(cli::preset_names().find("aluminium") != std::string::npos);
}

// The strip in centimetres and the unit told: all that the sheet weighs and how fast it swings is as in metres, and so is the air.
void a_preset_is_the_same_sheet_in_any_unit() {
  const auto of = [](double metres, const std::string &preset) {
    cli::Scene scene = cli::read_scene(write_file("unit.toml", "mesh = 'strip.off'\nscale = " + std::to_string(1 / metres) + "\nmetres_per_unit = " + std::to_string(metres) +
                                                                   "\n[material]\npreset = '" + preset + "'\n[wind]\nvelocity = [0, 0, 1]\n"));
    cli::Mesh strip = strip_as_mesh();
    for (double &x : strip.positions) x /= metres;
    scene.supports.push_back({true, cli::Bounds{{0, -1 / metres, -1}, {0, 1 / metres, 1}}, {}});
    cli::ProgressBar progress(true);
    const double mass = cli::masses_per_area(scene.material, strip).at(0) / (metres * metres);
    return std::array<double, 3>{cli::make_model(scene, strip, progress).frequencies().at(0), mass, scene.loads.wind->density / std::pow(metres, 3)};
  };
  for (uint32_t k = 0; k < sw_preset_count(); ++k) {
    const auto in_metres = of(1, sw_preset_name(k)), in_centimetres = of(0.01, sw_preset_name(k));
    CHECK(in_metres[2] == 1.2);
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::fabs(in_centimetres[i] / in_metres[i] - 1) < 1e-6);  // the basis is in 32 bits
  }
}

constexpr const char *kSheetLines = "young = 7e10\npoisson = 0\nthickness = 1e-3\nvolume_density = 2700\n";

double slowest_of_material(const std::string &lines) {
  cli::Scene scene = scene_of_material(lines);
  cli::ProgressBar progress(true);
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  return cli::make_model(scene, strip_as_mesh(), progress).frequencies().at(0);
}

void a_material_varies_by_files_and_regions() {
  const cli::Mesh strip = strip_as_mesh();
  std::string values, triangles;
  for (uint32_t v = 0; v < strip.n_vertices(); ++v) values += "2e-3\n";
  for (uint32_t t = 0; t < strip.n_triangles(); ++t) triangles += "1350 ";
  write_file("thick.txt", "# metres\n" + values);
  write_file("light.txt", triangles);
  const std::string uniform = kSheetLines;
  const double slow = slowest_of_material(uniform);
  // Equal values, by file and over the whole mesh by a region, are the uniform ones.
  CHECK(slowest_of_material(uniform + "[[material.region]]\nbox = [-9, -9, -9, 9, 9, 9]\nthickness = 1e-3\n") == slow);
  // Twice as thick swings twice as fast; half as heavy by the root of two. Both are exact but for the search's residual.
  CHECK(std::fabs(slowest_of_material(uniform + "[material.map]\nthickness = 'thick.txt'\n") / slow - 2) < 1e-6);
  CHECK(std::fabs(slowest_of_material(uniform + "[material.map]\nvolume_density = 'light.txt'\n") / slow - std::sqrt(2.0)) < 1e-6);
  // A heavy end slows it, and a later region goes over an earlier one.
  const std::string heavy = "[[material.region]]\nside = 'high-x'\nvolume_density = 27000\n";
  CHECK(slowest_of_material(uniform + heavy) < 0.99 * slow);
  CHECK(slowest_of_material(uniform + heavy + "[[material.region]]\nside = 'high-x'\nvolume_density = 2700\n") == slow);
  // Growth goes with every material, and is 1 where nothing says more.
  for (const std::string &of : {std::string(kSheetLines), std::string("k_bend = 2\n")}) {
    const std::vector<cli::MaterialFile> grown = cli::material_maps(scene_of_material(of + "[[material.region]]\nside = 'high-x'\ngrowth = 1.2\n").material, strip);
    CHECK(grown.size() == 1 && grown[0].quantity == SW_MAP_GROWTH && grown[0].values.front() == 1 && grown[0].values.back() == 1.2);
  }
  // A strip that is half as long again at its free end widens there without load: it is slower, being longer.
  CHECK(slowest_of_material(uniform + "[[material.region]]\nside = 'high-x'\ngrowth = 1.2\n") < 0.999 * slow);
  cli::Material stiffer = scene_of_material("k_bend = 2\n[[material.region]]\nvertices = [0]\nk_bend = 3\n").material;
  cli::stiffen_bending(stiffer, 10);
  CHECK(stiffer.k_bend == 20 && cli::material_maps(stiffer, strip).at(0).values.at(0) == 30);
}

std::string refusal_of_material(const std::string &lines) {
  try {
    cli::material_maps(scene_of_material(kSheetLines + lines).material, strip_as_mesh());
  } catch (const std::runtime_error &error) {
    return error.what();
  }
  return "";
}

void a_bad_map_is_named() {
  const auto says = [](const std::string &lines, const char *words) {
    const std::string error = refusal_of_material(lines);
    if (error.find(words) == std::string::npos) std::fprintf(stderr, "  said '%s', not '%s'\n", error.c_str(), words);
    return error.find(words) != std::string::npos;
  };
  write_file("short.txt", "1 2\n3\n");
  write_file("bad.txt", "1\n-2\n");
  write_file("nan.txt", "1\nnan\n");
  CHECK(says("[material.map]\nthickness = 'short.txt'\n", "short.txt: 3 values of thickness; the mesh has "));
  CHECK(says("[material.map]\nthickness = 'bad.txt'\n", "bad.txt:2: thickness 1 must be greater than 0"));
  CHECK(says("[material.map]\nthickness = 'nan.txt'\n", "nan.txt:2: "));
  CHECK(says("[damping]\nfactors = 'bad.txt'\n", "bad.txt:2: factors 1 must not be negative"));
  CHECK(says("[material.map]\nthickness = 'none.txt'\n", "none.txt"));
  CHECK(says("[material.map]\nk_bend = 'bad.txt'\n", "material.toml:8: [material.map] k_bend does not go with a sheet"));
  CHECK(says("[material.map]\nthicknes = 'bad.txt'\n", "material.toml:8: [material.map] unknown key 'thicknes'"));
  CHECK(says("[[material.region]]\nthickness = 1\n", "name the vertices by"));
  CHECK(says("[[material.region]]\nside = 'low-x'\nthickness = -1\n", "material.toml:9: [material.region] thickness must be greater"));
  CHECK(says("[[material.region]]\nside = 'low-x'\n", "material.toml:7: [material.region] give a young"));
  CHECK(says("[[material.region]]\nvertices = [999999]\nyoung = 1\n", "a region of young names vertex 999999"));
}

// Where the line is told of numbers that are wrong, misspelt, missing, or need not be there; and of edges that the mesh does not have.
void bad_numbers_of_a_material_are_named_with_their_line() {
  const auto says = [](const std::string &lines, const std::string &words) {
    std::string error;
    try {
      const cli::Scene scene = scene_of_material(lines);
      cli::material_maps(scene.material, strip_as_mesh());
      cli::find_creases(scene.material, strip_as_mesh());
    } catch (const std::runtime_error &refused) {
      error = refused.what();
    }
    const bool said = words.empty() ? error.empty() : error.find(words) != std::string::npos;
    if (!said) std::fprintf(stderr, "  said '%s', not '%s'\n", error.c_str(), words.c_str());
    return said;
  };
  CHECK(says("k_area = 0\nk_length = 0\nk_bend = 0\n", "material.toml:5: [material] k_area, k_length and k_bend are all 0"));
  CHECK(says("k_area = 0\nk_length = 0\n", ""));
  CHECK(says("density = 0\n", "material.toml:3: [material] density must be greater than 0"));
  CHECK(says("young = 7e10\npoisson = 0.6\nthickness = 1e-3\nvolume_density = 2700\n", "material.toml:4: [material] poisson must be above -1"));
  CHECK(says("young = 7e10\npoisson = 0.3\nthickness = 0\nvolume_density = 2700\n", "material.toml:5: [material] thickness must be greater than 0"));
  CHECK(says("young = -1\npoisson = 0.3\nthickness = 1\nvolume_density = 2700\n", "material.toml:3: [material] young must be greater than 0"));
  CHECK(says("yong = 7e10\npoisson = 0.3\nthickness = 1e-3\nvolume_density = 2700\n", "material.toml:3: [material] unknown key 'yong'; did you mean 'young'"));
  CHECK(says("young = 7e10\npoisson = 0.3\nvolume_density = 2700\n", "[material] thickness is missing"));
  std::string values;
  for (uint32_t v = 0; v < strip_as_mesh().n_vertices(); ++v) values += "2e-3\n";
  write_file("by_map.txt", values);
  const std::string of_map = "young = 7e10\npoisson = 0\nvolume_density = 2700\n[material.map]\nthickness = 'by_map.txt'\n";
  CHECK(says(of_map, "") && slowest_of_material(of_map) == slowest_of_material("thickness = 1\n" + of_map));
  CHECK(says("k_bend = 1\n[[material.crease]]\nedges = [[0, 999999]]\nfactor = 0\n", "material.toml:4: [material.crease] edge 0-999999: the mesh has"));
  CHECK(says("k_bend = 1\n[[material.crease]]\nbox = [8, 8, 8, 9, 9, 9]\nfactor = 0\n", "material.toml:4: [material.crease] box "));
  CHECK(says("k_bend = 1\n[[material.region]]\nvertices = [999999]\nk_bend = 1\n", "material.toml:4: [material.region] a region of k_bend names"));
}

std::vector<double> rest_of(const cli::Scene &scene, const cli::Mesh &mesh) {
  cli::ProgressBar progress(true);
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  std::vector<double> x(mesh.positions.size());
  cli::make_state(scene, mesh, model).positions(x.data(), mesh.n_vertices());
  return x;
}

// The strip, clamped at x = 0 and folded by a crease at x = 2: how far its end is from where a rigid fold by `angle` has it.
double miss_of_fold(const std::string &lines, double angle) {
  cli::Scene scene = scene_of_material(kSheetLines + lines);
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  const std::vector<double> x = rest_of(scene, strip_as_mesh());
  const double *end = &x[3 * std::size_t{strip_vertex(STRIP_COLUMNS - 1, 1)}];
  return std::hypot(end[0] - 2 - 2 * std::cos(angle), end[1], end[2] + 2 * std::sin(angle));
}

void a_crease_of_a_scene_folds_the_strip_there() {
  std::string list = "# the column at x = 2\n", pairs;
  for (int row = 0; row + 1 < STRIP_ROWS; ++row) {
    const std::string a = std::to_string(strip_vertex(20, row)), b = std::to_string(strip_vertex(20, row + 1));
    list += b + " " + a + "\n";
    pairs += (row ? ", [" : "[") + a + ", " + b + "]";
  }
  write_file("fold.txt", list);
  // Nothing but the crease is under stress, so the fold is rigid: to the tolerance of the search for rest, 1e-6 of the size.
  const double quarter = 1.5707963267948966;
  for (const std::string &where : {std::string("box = [1.99, -1, -1, 2.01, 1, 1]"), "edges = [" + pairs + "]", std::string("list = 'fold.txt'")}) {
    CHECK(miss_of_fold("[[material.crease]]\n" + where + "\nangle_degrees = 90\n", quarter) < 4e-6);
    CHECK(miss_of_fold("[[material.crease]]\n" + where + "\nfactor = 0.1\nangle_degrees = -90\n", -quarter) < 4e-6);
  }
  // A later table goes over an earlier one; a hinge that turns freely has no stiffness left but that of the clamp's other side.
  const std::string box = "[[material.crease]]\nbox = [1.99, -1, -1, 2.01, 1, 1]\n";
  CHECK(miss_of_fold(box + "angle_degrees = 45\n" + box + "angle_degrees = 90\n", quarter) < 4e-6);
  // What yields at 15 degrees and rests at 60 is made so; the warp, which is the default, cannot have it yield.
  cli::Scene soft = scene_of_material(kSheetLines + box + "angle_degrees = 60\nyield_degrees = 15\n");
  const cli::CreaseLists lists = cli::find_creases(soft.material, strip_as_mesh());
  CHECK(lists.yields.size() == STRIP_ROWS - 1);
  for (const double limit : lists.yields) CHECK(std::fabs(limit - quarter / 6) < 1e-12);
  std::string refused;
  try {
    rest_of(soft, strip_as_mesh());
  } catch (const std::runtime_error &error) {
    refused = error.what();
  }
  CHECK(refused.find("creases cannot yield") != std::string::npos);
  const double slow = slowest_of_material(kSheetLines);
  CHECK(slowest_of_material(kSheetLines + box + "factor = 0\n") < 1e-3 * slow);
  // Four times as stiff over a 40th of the length, where a cantilever's curvature is 0.34 of that at the clamp and its mean square a
  // quarter: 0.34² · 3/4 / 40 / (1/4) more of ω², half of it of ω, to first order. A fifth is left to the second.
  const double gain = slowest_of_material(kSheetLines + box + "factor = 4\n") / slow - 1;
  CHECK(std::fabs(gain / 4.3e-3 - 1) < 0.2);
}

// A strip bends by the modulus along it: as one of E2 where the grain runs across, by one direction or by a file.
void a_grain_of_a_scene_makes_the_strip_softer_across() {
  std::string across;
  for (int t = 0; t < STRIP_TRIANGLES; ++t) across += "0 2 0\n";
  write_file("across.txt", across);
  write_file("few.txt", "0 1 0\n1 0 0\n");
  write_file("long.txt", "0 1 0 1\n");
  const auto sheet = [](const char *young) { return std::string("young = ") + young + "\npoisson = 0\nthickness = 1e-3\nvolume_density = 2700\n"; };
  const double stiff = slowest_of_material(sheet("7e10")), soft = slowest_of_material(sheet("7e9"));
  const std::string grain = sheet("7e10") + "young_across = 7e9\n";
  // Without Poisson's ratio only the triangles, two across, tell the softer direction: under half a percent.
  CHECK(std::fabs(slowest_of_material(grain + "direction = [1, 0, 0]\n") / stiff - 1) < 5e-3);
  CHECK(std::fabs(slowest_of_material(grain + "direction = [0, 1, 0]\n") / soft - 1) < 5e-3);
  CHECK(std::fabs(slowest_of_material(grain + "shear = 3e9\ndirections = 'across.txt'\n") / soft - 1) < 5e-3);
  const auto says = [&grain](const std::string &lines, const char *words) {
    try {
      cli::find_directions(scene_of_material(grain + lines).material, strip_as_mesh());
    } catch (const std::exception &error) {
      return std::string(error.what()).find(words) != std::string::npos;
    }
    return false;
  };
  CHECK(says("", "needs a direction"));
  CHECK(says("direction = [1, 0]\n", "direction"));
  CHECK(says("direction = [1, 0, 0]\ndirections = 'across.txt'\n", "not both"));
  CHECK(says("directions = 'few.txt'\n", "few.txt: 2 directions; the mesh has "));
  CHECK(says("directions = 'long.txt'\n", "long.txt:1: direction 0 has more than three numbers"));
  CHECK(says("direction = [1, 0, 0]\nk_bend = 1\n", "k_bend"));
}

// The strip's file with its vertices rolled about y to a radius, or as they are where it is 0. In two pieces, both have the column of
// vertices at mid length: 3 to a column, and one column more.
std::string strip_file(double radius, bool in_pieces) {
  const cli::Mesh strip = strip_as_mesh();
  const uint32_t seam = strip_vertex(STRIP_COLUMNS / 2, 0), more = in_pieces ? STRIP_ROWS : 0;
  std::string text;
  char line[128];
  for (uint32_t k = 0; k < strip.n_vertices() + more; ++k) {
    std::array<double, 3> x = strip.vertex(k < seam + more ? k : k - more);
    if (radius > 0) x = {radius * std::sin(x[0] / radius), x[1], radius * (1 - std::cos(x[0] / radius))};
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    text += line;
  }
  for (std::size_t k = 0; k < strip.triangles.size(); k += 3) {
    const uint32_t *corners = &strip.triangles[k];
    const bool second = *std::max_element(corners, corners + 3) >= seam + STRIP_ROWS;
    text += "f";
    for (std::size_t c = 0; c < 3; ++c) text += " " + std::to_string(corners[c] + (second ? more : 0) + 1);
    text += "\n";
  }
  return text;
}

constexpr double kHalfCylinder = STRIP_LENGTH / 3.141592653589793;  // the radius at which the strip is half a cylinder

// How far the strip's end is from that of the half cylinder.
double miss_of_roll(const std::vector<double> &x, uint32_t end) {
  return std::hypot(x[3 * std::size_t{end}], x[3 * std::size_t{end} + 1], x[3 * std::size_t{end} + 2] - 2 * kHalfCylinder);
}

// The strip's file, rolled to half a cylinder of its length, is where the flat strip goes.
void a_rest_shape_of_a_scene_curls_the_strip() {
  write_file("rolled.obj", strip_file(kHalfCylinder, false));
  cli::Scene scene = scene_of_material(std::string(kSheetLines) + "rest_shape = 'rolled.obj'\n");
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  // The clamp turns the rolled shape by half an edge's angle, 1/80 of half a turn, which moves its end, 2 radii off, by 0.1.
  CHECK(miss_of_roll(rest_of(scene, strip_as_mesh()), strip_vertex(STRIP_COLUMNS - 1, 1)) < 0.11);
}

// Two pieces of the strip, welded, curl as the whole strip does: by a rest shape in the same two pieces, scaled as the mesh is.
void a_rest_shape_of_welded_pieces_curls_them_as_one() {
  write_file("pieces_flat.obj", strip_file(0, true));
  write_file("pieces_rolled.obj", strip_file(kHalfCylinder, true));
  const auto scene_of = [](const char *top, const char *shape) {
    cli::Scene scene = cli::read_scene(write_file("material.toml", std::string("mesh = 'pieces_flat.obj'\n") + top + "[material]\n" + kSheetLines +
                                                                      "rest_shape = '" + shape + "'\n"));
    scene.supports.push_back({true, cli::Bounds{{0, -9, -9}, {0, 9, 9}}, {}});
    return scene;
  };
  const cli::Scene one = scene_of("weld = 0\n", "pieces_rolled.obj");
  const cli::Mesh mesh = cli::scene_mesh(one);
  CHECK(mesh.n_vertices() == STRIP_VERTICES && mesh.of_file.size() == STRIP_VERTICES + STRIP_ROWS);
  const std::vector<double> x = rest_of(one, mesh);
  const uint32_t end = mesh.of(STRIP_VERTICES + STRIP_ROWS - 2);  // the middle of the last column
  CHECK(miss_of_roll(x, end) < 0.11);
  // The same mesh, vertex by vertex, as the strip that was never cut.
  cli::Scene whole = scene_of_material(std::string(kSheetLines) + "rest_shape = 'rolled.obj'\n");
  whole.supports = one.supports;
  CHECK(mesh.positions == strip_as_mesh().positions && x == rest_of(whole, strip_as_mesh()));
  const cli::Scene twice = scene_of("scale = 2\nweld = 0.001\n", "pieces_rolled.obj");
  std::vector<double> half = cli::rest_positions(twice, cli::scene_mesh(twice));
  for (double &c : half) c /= 2;
  CHECK(half == cli::rest_positions(one, mesh));
  // Numbers are those of the file, also where they are wrong.
  std::string error;
  try {
    cli::rest_positions(scene_of("weld = 0\n", "rolled.obj"), mesh);
  } catch (const std::runtime_error &refused) {
    error = refused.what();
  }
  CHECK(error.find("rolled.obj: rest_shape has 123 vertices; the mesh has 126") != std::string::npos);
}

// A strip that rests rolled, thicker and thinner than a tenth of its radius of curvature.
void a_sheet_too_thick_for_its_curvature_is_told_of() {
  const auto warned = [](const char *thickness) {
    cli::Scene scene = scene_of_material(std::string("young = 7e10\npoisson = 0\nvolume_density = 2700\nrest_shape = 'rolled.obj'\nthickness = ") + thickness);
    scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
    cli::ProgressBar progress(true);
    cli::Warnings warnings;
    cli::make_model(scene, strip_as_mesh(), progress);
    return warnings.taken();
  };
  CHECK(warned("0.1").empty());  // of 1.27
  const std::vector<std::string> told = warned("0.2\n");
  CHECK(told.size() == 1 && told.at(0).find("thicker than a tenth of its radius of curvature") != std::string::npos);
  CHECK(words_of(cli::Scene{}, run_that_moved(0.5)).find("curvature") == std::string::npos);
  CHECK(words_of(cli::Scene{}, run_that_moved(0.5), 9, {}, told).find("note: the sheet is thicker than") != std::string::npos);
}

void a_bad_crease_is_named() {
  const auto says = [](const std::string &lines, const char *words) {
    std::string error;
    try {
      cli::Scene scene = scene_of_material(kSheetLines + lines);
      cli::find_creases(scene.material, strip_as_mesh());
      cli::rest_positions(scene, strip_as_mesh());
    } catch (const std::runtime_error &refused) {
      error = refused.what();
    }
    if (error.find(words) == std::string::npos) std::fprintf(stderr, "  said '%s', not '%s'\n", error.c_str(), words);
    return error.find(words) != std::string::npos;
  };
  const std::string crease = "[[material.crease]]\n";
  write_file("half_edge.txt", "1 2\n3\n");
  write_file("long_edge.txt", "1 2 3\n");
  write_file("no_edge.txt", "# none\n");
  write_file("small.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  CHECK(says(crease + "factor = 2\n", "material.toml:7: [material.crease] name the edges by box, edges or list"));
  CHECK(says(crease + "edges = [[1, 2], [3]]\nfactor = 2\n", "material.toml:8: [material.crease] edge 1 of edges must be two vertices"));
  CHECK(says(crease + "edges = []\nfactor = 2\n", "edges must be a list of pairs"));
  CHECK(says(crease + "edges = [[3, 4]]\n", "give a factor other than 1, angle_degrees or yield_degrees"));
  CHECK(says(crease + "edges = [[3, 4]]\nfactor = -2\n", "material.toml:9: [material.crease] factor must not be negative"));
  CHECK(says(crease + "edges = [[3, 4]]\nfactor = nan\n", "factor must be finite"));
  CHECK(says(crease + "edges = [[3, 4]]\nangle_degrees = 190\n", "angle_degrees is 190.000000; it must be from -180 to 180"));
  CHECK(says(crease + "edges = [[3, 4]]\nyield_degrees = 0\n", "yield_degrees is 0.000000; it must be above 0"));
  CHECK(says(crease + "edges = [[3, 4]]\nangle = 90\n", "unknown key 'angle'"));
  CHECK(says(crease + "edges = [[3, 999]]\nfactor = 2\n", "edge 3-999: the mesh has 123 vertices"));
  CHECK(says(crease + "edges = [[0, 99]]\nfactor = 2\n", "edge 0-99 is none of the mesh"));
  CHECK(says(crease + "edges = [[0, 1]]\nfactor = 2\n", "edge 0-1 has only one triangle"));
  CHECK(says(crease + "box = [-1, -1, -1, 0.01, 1, 1]\nfactor = 2\n", "the box holds 3 vertices, but no edge between two triangles"));
  CHECK(says(crease + "box = [7, 7, 7, 8, 8, 8]\nfactor = 2\n", "[material.crease] box (7 7 7) to (8 8 8) holds no vertex"));
  CHECK(says(crease + "list = 'half_edge.txt'\nfactor = 2\n", "half_edge.txt:2: "));
  CHECK(says(crease + "list = 'long_edge.txt'\nfactor = 2\n", "long_edge.txt:1: an edge has two vertices"));
  CHECK(says(crease + "list = 'no_edge.txt'\nfactor = 2\n", "no_edge.txt: names no edge"));
  CHECK(says("rest_shape = 'small.obj'\n", "small.obj: rest_shape has 3 vertices; the mesh has 123"));
  CHECK(says("rest_shape = 'none.obj'\n", "none.obj"));
}

// Whatever the thickness, the slowest swing has the frequency asked for; a thinner sheet bends for less stretch.
void a_material_by_frequency_has_that_frequency() {
  const cli::Mesh mesh = strip_as_mesh();
  cli::ProgressBar progress(true);
  double share = 1e300;
  for (const double thickness : {0.05, 0.005}) {
    cli::Scene scene;
    scene.method = SW_METHOD_WARP;
    scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
    scene.material.frequency = 3;
    scene.material.thickness = thickness;
    scene.material.density = 0.2;
    scene.material = cli::find_material(scene, mesh, progress);
    const double hertz = cli::make_model(scene, mesh, progress).frequencies().at(0);
    CHECK(std::fabs(hertz - 3) < 1e-9 * 3);  // two eigenvalue searches, to 1e-10 each
    CHECK(scene.material.k_bend / scene.material.k_area < share);
    share = scene.material.k_bend / scene.material.k_area;
  }
}

// Whatever the thickness, the full shell hangs as far as was asked for, to a thousandth, in any method's scene.
void a_material_by_sag_hangs_so_far() {
  const cli::Mesh mesh = strip_as_mesh();
  cli::ProgressBar progress(true);
  for (const double thickness : {0.05, 0.005}) {
    cli::Scene scene;
    scene.method = SW_METHOD_WARP;
    scene.gravity = {0, 0, -9.8};
    scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
    scene.material.sag = 0.3;
    scene.material.thickness = thickness;
    scene.material.density = 0.2;
    scene.material = cli::find_material(scene, mesh, progress);
    const shellwarp::Model model = cli::make_model(scene, mesh, progress);
    SwStateDesc desc = shellwarp::state_desc();
    desc.method = SW_METHOD_SHELL_IMPLICIT;
    shellwarp::State state(model, desc);
    state.set_gravity(0, 0, -9.8);
    state.equilibrium();
    CHECK(std::fabs(state.report().max_displacement / 0.3 - 1) < 1.1e-3);  // and what both searches for rest leave
  }
  cli::Scene scene;
  scene.supports.push_back({true, cli::Bounds{{0, -1, -1}, {0, 1, 1}}, {}});
  scene.material.sag = 0.3;
  try {
    cli::find_material(scene, mesh, progress);
    CHECK(false);
  } catch (const std::exception &error) {
    CHECK(std::strstr(error.what(), "goes with gravity"));
  }
}

// Rows of a comparison that are as expected, then spoilt one at a time.
void a_comparison_is_judged_row_by_row() {
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.comparison.emplace();
  cli::Comparison &c = *scene.comparison;
  c.methods = {SW_METHOD_LMA, SW_METHOD_WARP};
  c.gravities = {1, 2};
  c.bending = {1, 10};
  c.expect.warp_below_lma = c.expect.errors_grow = c.expect.stiffer_differs_less = c.expect.turn_in_range = true;
  c.expect.tolerance = 1e-3;
  c.expect.errors = {{SW_METHOD_LMA, cli::Range{0.05, 0.5}, {}},
                     {SW_METHOD_WARP, std::nullopt, {0.1, 0.2, 0.01, 0.02}}};
  cli::ComparisonRun good{};
  const double lma[4] = {0.2, 0.4, 0.1, 0.2}, warp[4] = {0.1, 0.2, 0.01, 0.02};
  for (std::size_t k = 0; k < 4; ++k)
    for (uint32_t method : {SW_METHOD_SHELL_IMPLICIT, SW_METHOD_LMA, SW_METHOD_WARP}) {
      cli::ComparisonRow row{};
      row.case_number = k;
      row.bending = c.bending[k / 2];
      row.gravity = c.gravities[k % 2];
      row.method = method;
      row.found = row.turn_in_range = true;
      row.error = method == SW_METHOD_LMA ? lma[k] : method == SW_METHOD_WARP ? warp[k] : 0;
      good.rows.push_back(row);
    }
  CHECK(cli::violations(scene, good).empty());
  const auto complaint = [&](std::size_t row, double error) {
    cli::ComparisonRun bad = good;
    bad.rows[row].error = error;
    const std::vector<std::string> all = cli::violations(scene, bad);
    return all.empty() ? std::string() : all[0];
  };
  CHECK(complaint(1, 0.6).find("error of lma at gravity 1, bending x 1: expected 0.05 to 0.5") == 0);
  CHECK(complaint(2, 0.102).find("error of warp at gravity 1, bending x 1: expected 0.099 to 0.101") == 0);
  CHECK(complaint(1, 0.09).find("the warp was to be nearer") != std::string::npos);
  CHECK(complaint(4, 0.201).find("stiffer") == std::string::npos && complaint(4, 0.201).empty());
  CHECK(complaint(1, 0.45).find("errors were to grow with gravity") != std::string::npos);
  CHECK(complaint(7, 0.201).find("stiffer was to differ less") != std::string::npos);
  cli::ComparisonRun none = good;
  none.rows[5].found = false;
  CHECK(cli::violations(scene, none)[0] == "no equilibrium of warp at gravity 2, bending x 1");
}

// A strip that falls freely trades work for motion: nothing is gained. Energy put in between two frames is found.
void the_energy_audit_counts_the_work_of_loads() {
  const cli::Mesh mesh = strip_as_mesh();
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.gravity = {0, 0, -2};
  scene.modes = 6;
  scene.double_precision = true;
  scene.integrator = SW_INTEGRATOR_EXACT;
  cli::ProgressBar progress(true);
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  shellwarp::State state = cli::make_state(scene, mesh, model);
  cli::EnergyAudit audit(scene, mesh);
  CHECK(audit.applies());
  for (uint32_t frame = 0; frame < 5; ++frame) {
    audit.note(frame, state, state.report());
    state.step(0.1);
  }
  CHECK(audit.largest_gain() < 1e-12);  // rounding: the propagator is exact
  std::vector<double> rate = state.amplitudes().velocity;
  for (double &v : rate) v *= 1.5;
  state.set_amplitudes(state.amplitudes().value.data(), rate.data(), 6);
  audit.note(5, state, state.report());
  CHECK(audit.largest_gain() > 0.5 && audit.frame_of_gain() == 5);
  scene.loads.wind.emplace();
  CHECK(!cli::EnergyAudit(scene, mesh).applies());
}

void mistakes_in_scenes_are_located() {
  const struct {
    const char *text, *place, *words;
  } mistakes[] = {
      {"mesh = 'a.obj'\nmush = 1\n", "bad.toml:2:", "unknown key 'mush'"},
      {"mesh = 'a.obj'\n[material]\n\nk_bent = 1\n", "bad.toml:4:", "[material] unknown key 'k_bent'"},
      {"mesh = 'a.obj'\n[material]\npreset = 'bread'\n", "bad.toml:3:", "no known material is called 'bread'; there are denim"},
      {"mesh = 'a.obj'\n[material]\nyoung = 1\nthickness = 1\nvolume_density = 1\n", "bad.toml:2:", "poisson is missing"},
      {"mesh = 'a.obj'\n[material]\npreset = 'card'\ndensity = 1\n", "bad.toml:4:", "density does not go with preset"},
      {"mesh = 'a.obj'\n[material]\nthickness = 1\n", "bad.toml:3:", "thickness goes with frequency or sag, or with young"},
      {"mesh = 'a.obj'\n[material]\nfrequency = 1\nsag = 1\n", "bad.toml:4:", "both set the stiffness"},
      {"mesh = 'a.obj'\n[material]\nsag = 1\nk_bend = 1\n", "bad.toml:3:", "sag sets the stiffness"},
      {"mesh = 'a.obj'\n[material]\nsag = -1\n", "bad.toml:3:", "sag"},
      {"mesh = 'a.obj'\n[material]\nsag = 1\npreset = 'card'\n", "bad.toml:3:", "sag does not go with preset"},
      {"mesh = 'a.obj'\n[material]\nk_bend = 'soft'\n", "bad.toml:3:", "k_bend must be a number"},
      {"mesh = 'a.obj'\n[simulation]\nmodes = -1\n", "bad.toml:3:", "modes must be a whole number"},
      {"mesh = 'a.obj'\n[simulation]\nmethod = 'magic'\n", "bad.toml:3:", "it must be one of warp, warp-virtual-work"},
      {"mesh = 'a.obj'\n[simulation]\nmethod = 'shell-implicit'\nintegrator = 'exact'\n", "bad.toml:4:", "takes \"second-order\""},
      {"mesh = 'a.obj'\n[[force]]\nvector = [0, 0, 1]\n", "bad.toml:2:", "by vertex or nearest"},
      {"mesh = 'a.obj'\n[[force]]\nvertex = 0\n", "bad.toml:2:", "vector is missing"},
      {"mesh = 'a.obj'\n[wind]\ndensity = 1\n", "bad.toml:2:", "velocity is missing"},
      {"mesh = 'a.obj'\n[wind]\nvelocity = [1, 0, 0]\ndensity = -1\n", "bad.toml:4:", "must not be negative"},
      {"mesh = 'a.obj'\n[comparison]\nmethods = ['shell-implicit']\ngravities = [1]\n",
       "bad.toml:3:", "some of warp, warp-virtual-work"},
      {"mesh = 'a.obj'\n[comparison]\nmethods = ['lma']\n", "bad.toml:2:", "gravities is missing"},
      {"mesh = 'a.obj'\n[comparison]\nmethods = ['lma']\ngravities = [2, 1]\n",
       "bad.toml:4:", "must be above 0 and ascend"},
      {"mesh = 'a.obj'\n[comparison]\nmethods = ['lma']\ngravities = [1, 2]\n",
       "bad.toml:2:", "must give the direction"},
      {"mesh = 'a.obj'\n[simulation]\nduration = 0\n", "bad.toml:3:", "must be greater than 0"},
      {"mesh = 'a.obj'\n[simulation]\ngravity = [0, 1]\n", "bad.toml:3:", "must be a list of 3 numbers"},
      {"mesh = 'a.obj'\n[simulation]\ngravity = [0, nan, 0]\n", "bad.toml:3:", "must be a list of 3 numbers"},
      {"mesh = 'a.obj'\n[support]\nbox = [0, 0, 0, 0, 0, 0]\n", "bad.toml:2:", "must be written as [[support]]"},
      {"mesh = 'a.obj'\n[[support]]\nkind = 'fixed'\n", "bad.toml:2:", "by side, box, vertices, list or group"},
      {"mesh = 'a.obj'\n[[support]]\nside = 'low-x'\nabout = [0, 0, 0]\n", "bad.toml:4:", "for a support with a key"},
      {"mesh = 'a.obj'\n[[support]]\nside = 'low-x'\nkey = [{ offset = [0, 0, 1] }]\n", "bad.toml:4:", "time must be 0 or more"},
      {"mesh = 'a.obj'\n[expect]\nmax_displacement = [2, 1]\n", "bad.toml:3:", "[low, high]"},
      {"mesh = 'a.obj'\n[[handle]]\nkind = 'both'\n", "bad.toml:2:", "by vertex, nearest, side or group"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\nnearest = [0, 0, 0]\n", "bad.toml:2:", "by vertex, nearest, side or group"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\nkind = 'torque'\n", "bad.toml:4:", "position, orientation, both"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\naxes = 'xw'\n", "bad.toml:4:", "letters xyz"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\naxes = ''\n", "bad.toml:4:", "letters xyz"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\ncompliance = -1\n", "bad.toml:4:", "not be negative"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\nkey = [\n{ offset = [0, 0, 0] }]\n", "bad.toml:5:", "time must"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\nkey = [\n{ time = 1 },\n{ time = 1 }]\n", "bad.toml:6:", "ascend"},
      {"mesh = 'a.obj'\n[[handle]]\nvertex = 1\nkey = [\n{ time = 1, rotate_degrees = [1, 0, 0] }]\n",
       "bad.toml:5:", "unknown key 'rotate_degrees'"},
      {"title = 'x'\n", "bad.toml", "mesh is missing"},
      {"mesh = 'a.obj\n", "bad.toml:1:", ""},
      {"[frame]\n[[frame.translate]]\naxe = [1, 0, 0]\n", "bad.toml", "mesh is missing"},
      {"mesh = 'a'\n[frame]\n[[frame.translate]]\naxe = [1, 0, 0]\n", "bad.toml:4:", "unknown key 'axe'"},
  };
  for (const auto &mistake : mistakes) {
    std::string message = "read without complaint";
    try {
      cli::read_scene(write_file("bad.toml", mistake.text));
    } catch (const cli::FileError &error) {
      message = error.what();
    }
    const bool good =
        message.find(mistake.place) != std::string::npos && message.find(mistake.words) != std::string::npos;
    if (!good) printf("%s%s\n", mistake.text, message.c_str());
    CHECK(good);
  }
}

void lists_of_vertices_are_read_strictly() {
  CHECK((cli::read_vertex_list(write_file("list.txt", "3 1 # two\n\n# none\n4294967295")) ==
         std::vector<uint32_t>{3, 1, UINT32_MAX}));
  bool refused = false;
  try {
    cli::read_vertex_list(write_file("list.txt", "3\n-1\n"));
  } catch (const cli::FileError &error) {
    refused = std::strstr(error.what(), "list.txt:2:") != nullptr;
  }
  CHECK(refused);
}

void supports_with_keys_move_against_each_other_and_with_the_frame() {
  const cli::Mesh mesh = strip_as_mesh();
  const double end = STRIP_LENGTH;
  write_file("strip.obj", "v 0 0 0\n");  // never read: the mesh is at hand
  const std::string path = write_file(
      "supports.toml",
      "mesh = 'strip.obj'\n[[support]]\nkind = 'clamped'\nside = 'low-x'\n[[support]]\nkind = 'clamped'\nside = 'high-x'\n"
      "about = [4, 0, 0]\nkey = [{ time = 0 }, { time = 1, offset = [0, 0, 0.1], rotate_degrees = [30, 0, 0] }]\n"
      "[simulation]\nmodes = 6\nduration = 1\nframe_rate = 10\n[frame]\nrise = 0.2\nend = 3\n"
      "[[frame.translate]]\naxis = [0, 1, 0]\namplitude = 0.5\nfrequency = 0.3\n");
  cli::Scene scene = cli::read_scene(path);
  CHECK(scene.supports.size() == 2 && scene.supports[1].keys.size() == 2 && scene.supports[1].about && !scene.support_fields);
  cli::ProgressBar progress(true);
  const shellwarp::Model model = cli::make_model(scene, mesh, progress);
  CHECK(model.info().support_fields > 6);
  shellwarp::State state = cli::make_state(scene, mesh, model);
  const cli::Run run = cli::simulate(scene, 10, mesh, {}, state, nullptr);
  CHECK(run.supports_move && run.frames.size() == 11 && run.frames.back().report.support_miss < 1e-3);
  std::vector<double> x(mesh.positions.size());
  state.positions(x.data(), mesh.n_vertices());
  const SwFrameDesc pose = scene.motion.pose(1);
  const double angle = std::acos(-1.0) / 6;
  for (uint32_t v = 0; v < mesh.n_vertices(); ++v) {
    const double *rest = &mesh.positions[3 * v], *now = &x[3 * v];
    const bool far = rest[0] > end - 0.15, near = rest[0] < 0.15;  // with the neighbours that a clamp holds
    if (!far && !near) continue;
    std::array<double, 3> place = {rest[0], rest[1], rest[2]};
    if (far) place = {rest[0], rest[1] * std::cos(angle), rest[1] * std::sin(angle) + 0.1};
    place = cli::transform(pose, place);
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::fabs(now[i] - place[i]) < 1e-12);
  }
  // Of a sheet the slope is held at edges that nothing can lead: told in the scene's own words.
  cli::Scene sheet = scene;
  sheet.material = scene_of_material(kSheetLines).material;
  std::string refused;
  try {
    cli::make_model(sheet, mesh, progress);
  } catch (const std::runtime_error &error) {
    refused = error.what();
  }
  CHECK(refused.find("needs kind = \"fixed\"") != std::string::npos);
  // Where only the full shell follows, no other method is advised.
  SwCertificate far_off{};
  far_off.method = SW_METHOD_WARP;
  far_off.error = 1;
  far_off.out_of_range = 1;
  cli::Run wrong = run;
  wrong.certificate = far_off;
  CHECK(cli::verdict(wrong).find("use --method shell-implicit") != std::string::npos);
}

void supports_are_found_by_box_and_list_without_repetition() {
  const cli::Mesh mesh = cli::read_mesh(write_file("strip.off", off_text()));
  cli::Scene scene;
  scene.method = SW_METHOD_WARP;
  scene.supports.push_back({false, cli::Bounds{{0, 0, -5}, {0.5, 0, 5}}, {1, 6}});
  scene.supports.push_back({true, cli::Bounds{{1, 0.75, 0}, {1, 0.75, 0}}, {}});  // a box of one point
  const cli::SupportVertices found = cli::find_supports(scene, mesh);
  CHECK((found.fixed == std::vector<uint32_t>{0, 1, 6}));
  CHECK((found.clamped == std::vector<uint32_t>{5}));

  scene.supports.push_back({false, cli::Bounds{{9, 9, 9}, {10, 10, 10}}, {}});
  bool refused = false;
  try {
    cli::find_supports(scene, mesh);
  } catch (const std::runtime_error &error) {
    refused = std::strstr(error.what(), "holds no vertex") != nullptr;
  }
  CHECK(refused);
}

}  // namespace

int main(int argc, char **argv) {
  if (argc != 2) return EXIT_FAILURE;
  directory = argv[1];
  std::filesystem::create_directories(directory);
  RUN(every_format_gives_the_same_vertices_and_triangles);
  RUN(concave_polygons_are_cut_inside_whichever_corner_is_first);
  RUN(welded_pieces_are_one_shell_and_the_file_is_drawn);
  RUN(a_scene_may_simulate_a_proxy_of_its_file);
  RUN(byte_order_marks_do_not_matter);
  RUN(statements_of_obj_go_on_after_a_backslash);
  RUN(off_counts_may_stand_behind_the_first_word);
  RUN(line_ends_of_other_systems_do_not_matter);
  RUN(files_cut_anywhere_are_refused_or_sound);
  RUN(cut_off_and_ply_files_are_always_refused);
  RUN(files_with_any_flipped_bit_are_refused_or_sound);
  RUN(bad_files_are_refused_with_place_and_reason);
  RUN(missing_files_and_directories_are_refused);
  RUN(a_point_cache_has_the_bytes_of_the_format);
  RUN(an_unwritable_file_is_an_error_that_names_it);
  RUN(files_are_there_whole_or_as_they_were);
  RUN(an_input_is_never_replaced);
  RUN(links_are_followed_and_devices_refused);
  RUN(names_of_outputs_are_known);
  RUN(runs_of_too_many_frames_are_refused);
  RUN(extreme_frames_are_the_largest_local_maxima_in_order);
  RUN(shaking_begins_and_ends_at_rest_in_the_world_frame);
  RUN(poses_are_rotations_about_the_pivot);
  RUN(handles_go_through_their_keys_and_never_beyond_them);
  RUN(handles_move_without_jolts);
  RUN(handles_are_placed_on_the_nearest_vertex);
  RUN(a_led_strip_is_where_its_handles_are_and_is_let_go);
  RUN(a_scene_is_read_in_full);
  RUN(loads_and_comparisons_are_read);
  RUN(methods_have_the_names_of_the_library);
  RUN(a_comparison_takes_the_methods_of_the_library);
  RUN(a_method_moves_as_its_needs_tell);
  RUN(a_rim_is_held_level_or_not);
  RUN(what_doubling_the_steps_changes_tells_their_error);
  RUN(what_is_limp_takes_the_full_shell);
  RUN(the_verdict_says_how_far_off_the_run_is);
  RUN(the_closing_words_say_what_moved_and_what_to_change);
  RUN(a_misspelt_word_finds_the_one_that_was_meant);
  RUN(long_work_is_told_of);
  RUN(a_path_in_a_word_is_read);
  RUN(sides_and_pins_are_found);
  RUN(a_sheet_is_read_and_swings_as_a_beam);
  RUN(a_preset_is_a_sheet_that_can_be_changed);
  RUN(a_preset_is_the_same_sheet_in_any_unit);
  RUN(a_material_varies_by_files_and_regions);
  RUN(a_crease_of_a_scene_folds_the_strip_there);
  RUN(a_grain_of_a_scene_makes_the_strip_softer_across);
  RUN(a_rest_shape_of_a_scene_curls_the_strip);
  RUN(a_rest_shape_of_welded_pieces_curls_them_as_one);
  RUN(a_sheet_too_thick_for_its_curvature_is_told_of);
  RUN(a_bad_crease_is_named);
  RUN(a_bad_map_is_named);
  RUN(bad_numbers_of_a_material_are_named_with_their_line);
  RUN(a_material_by_frequency_has_that_frequency);
  RUN(a_material_by_sag_hangs_so_far);
  RUN(a_comparison_is_judged_row_by_row);
  RUN(the_energy_audit_counts_the_work_of_loads);
  RUN(mistakes_in_scenes_are_located);
  RUN(lists_of_vertices_are_read_strictly);
  RUN(supports_are_found_by_box_and_list_without_repetition);
  RUN(supports_with_keys_move_against_each_other_and_with_the_frame);
  return report_failures();
}

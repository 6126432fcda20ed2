#include "page.hpp"

#include "json.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "simulation.hpp"
#include "support_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace cli {

namespace {

using Vec3 = std::array<double, 3>;

constexpr char kHole[] = "{{motion}}";
constexpr char kGravityColour[] = "#23272f", kWindColour[] = "#1f9aa8", kForceColour[] = "#d1495b",
               kHandleColour[] = "#f0b90b", kHeldColour[] = "#2a2e38", kFrameColour[] = "#8d5bc2";

double length(const Vec3 &x) { return std::hypot(x[0], x[1], x[2]); }

void append(std::string &list, const std::string &item) { list += (list.empty() ? "" : ",\n") + item; }

std::string load_item(const std::string &words, const char *colour, const char *in_short, const Vec3 *direction) {
  std::string item = "{\"words\":" + json_text(words) + ",\"colour\":\"" + colour + "\",\"short\":\"" + in_short + "\"";
  if (direction) item += ",\"direction\":" + json_numbers({(*direction)[0], (*direction)[1], (*direction)[2]});
  return item + "}";
}

std::string vector_words(const Vec3 &x) { return format("(%g, %g, %g)", x[0], x[1], x[2]); }

void add_loads(const Scene &scene, const Mesh &mesh, std::string &list) {
  if (length(scene.gravity) > 0)
    append(list, load_item(format("gravity %.3g along %s", length(scene.gravity), vector_words(scene.gravity).c_str()),
                           kGravityColour, "gravity", &scene.gravity));
  if (scene.loads.wind)
    append(list, load_item(format("wind %.3g along %s%s", length(scene.loads.wind->velocity),
                                  vector_words(scene.loads.wind->velocity).c_str(), scene.loads.wind->gust > 0 ? ", in gusts" : ""),
                           kWindColour, "wind", &scene.loads.wind->velocity));
  for (const PlacedForce &force : place_forces(scene.loads.forces, mesh))
    append(list, load_item(format("force %.3g on vertex %u", length(force.vector), force.vertex), kForceColour, "force",
                           &force.vector));
  if (scene.motion.moves() || any_moves(scene.supports)) append(list, load_item("what holds the shell moves", kFrameColour, "", nullptr));
}

std::vector<uint32_t> held_vertices(const SupportVertices &supports) {
  std::vector<uint32_t> held = supports.fixed;
  held.insert(held.end(), supports.clamped.begin(), supports.clamped.end());
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  return held;
}

double frame_seconds(const Scene &scene, uint32_t frame) {
  return scene.is_static ? scene.duration : frame / scene.frame_rate;
}

std::string handle_item(const Scene &scene, std::size_t shell, const PlacedHandle &placed, const Film &film) {
  std::vector<double> path;
  for (const uint32_t frame : film.frames()) {
    const Vec3 x = frame == 0 ? placed.rest : placed.position(frame_seconds(scene, frame));
    path.insert(path.end(), x.begin(), x.end());
  }
  const bool released = !scene.is_static && placed.handle.release;
  return format("{\"shell\":%zu,\"vertex\":%u,\"release\":%s,\"path\":", shell, placed.vertex,
                released ? json_number(*placed.handle.release).c_str() : "null") +
         json_numbers(path) + "}";
}

// A collider's shape in its own axes, and its origin and rotation, row by row, at the film's frames: once where it stands still.
std::string collider_item(const Scene &scene, const Collider &collider, const Film &film) {
  std::vector<float> poses;
  for (const uint32_t frame : film.frames()) {
    if (!poses.empty() && !collider.moves()) break;
    const SwColliderPoseDesc pose = collider.pose(frame_seconds(scene, frame));
    poses.insert(poses.end(), pose.origin, pose.origin + 3);
    poses.insert(poses.end(), pose.rotation, pose.rotation + 9);
  }
  std::string item = "{\"kind\":" + json_text(collider_kinds()[collider.kind - 1]) + ",\"radius\":" +
                     json_number(collider.radius) + ",\"half_length\":" + json_number(collider.half_length) + ",\"half_extents\":" +
                     json_numbers({collider.half_extents[0], collider.half_extents[1], collider.half_extents[2]});
  if (!collider.mesh_path.empty()) {
    Mesh mesh = read_mesh(collider.mesh_path);
    for (double &x : mesh.positions) x *= scene.scale;
    item += ",\"rest\":" + json_bytes(std::vector<float>(mesh.positions.begin(), mesh.positions.end())) + ",\"triangles\":" +
            json_bytes(mesh.triangles);
  }
  if (collider.deforms()) {
    std::vector<float> shapes;
    for (const uint32_t frame : film.frames()) {
      const std::vector<double> points = collider.points->at(frame_seconds(scene, frame) * scene.frame_rate);
      shapes.insert(shapes.end(), points.begin(), points.end());
    }
    item += ",\"shapes\":" + json_bytes(shapes);
  }
  return item + ",\"poses\":" + json_bytes(poses) + "}";
}

std::string cost_of(const Scene &scene, const Run &run) {
  if (scene.is_static || run.steps == 0) return "";
  const double seconds = (run.step_seconds + run.position_seconds) / static_cast<double>(run.frames.size() - 1);
  return seconds < 1e-3 ? format("%.3g \xc2\xb5s a frame", 1e6 * seconds) : format("%.3g ms a frame", 1e3 * seconds);
}

}  // namespace

uint32_t up_axis(const Scene &scene, const Mesh &mesh) {
  const auto larger = [](double a, double b) { return std::fabs(a) < std::fabs(b); };
  const auto &g = scene.gravity;
  if (length(g) > 0) return static_cast<uint32_t>(std::max_element(g.begin(), g.end(), larger) - g.begin());
  const Bounds box = bounds(mesh);
  Vec3 extent{};
  for (std::size_t k = 0; k < 3; ++k) extent[k] = box.high[k] - box.low[k];
  const auto thin = std::min_element(extent.begin(), extent.end());
  return *thin < 0.2 * *std::max_element(extent.begin(), extent.end()) ? static_cast<uint32_t>(thin - extent.begin()) : 1;
}

void Page::add_shell(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const Film &film) {
  const std::vector<uint32_t> held = held_vertices(find_supports(scene, mesh));
  const std::string of = n_shells_ || !loads_.empty() ? " of " + scene.name : "";
  append(shells_, "{\"name\":" + json_text(scene.name) + ",\"triangles\":" + json_bytes(mesh.triangles) + ",\"held\":" +
                      json_bytes(held) + ",\"rest\":" +
                      json_bytes(std::vector<float>(mesh.positions.begin(), mesh.positions.end())) + "}");
  for (const PlacedHandle &placed : handles) append(handles_, handle_item(scene, n_shells_, placed, film));
  if (n_shells_ == 0) {
    up_ = scene.up.value_or(up_axis(scene, mesh));
    unit_ = scene.length_unit;
    seconds_ = scene.is_static ? 0 : scene.duration;
    add_loads(scene, mesh, loads_);
    for (const Collider &collider : scene.colliders) append(colliders_, collider_item(scene, collider, film));
  }
  if (!handles.empty())
    append(loads_, load_item(format("%zu handle%s%s", handles.size(), handles.size() == 1 ? "" : "s", of.c_str()),
                             kHandleColour, "", nullptr));
  if (!held.empty())
    append(loads_, load_item(format("%zu of %u vertices held%s", held.size(), mesh.n_vertices(), of.c_str()), kHeldColour,
                             "", nullptr));
  ++n_shells_;
  n_vertices_ += mesh.n_vertices();
}

void Page::add_film(const Scene &scene, const Run &run, const Film &film, const std::vector<std::string> &words, const std::string &label) {
  std::string estimates;
  for (const ErrorEstimate &estimate : run.estimates)
    estimates += (estimates.empty() ? "" : ",") + json_numbers({estimate.seconds, 100 * estimate.error});
  append(tracks_, format("{\"shell\":%zu,\"method\":\"%s\",\"full\":%s,\"label\":", n_shells_ - 1,
                         host::method_name(scene.method), host::is_full_shell(scene.method) ? "true" : "false") +
                      json_text(label) + ",\"cost\":" + json_text(cost_of(scene, run)) +
                      ",\"unit\":" + json_number(film.largest() / 32767) + ",\"coarse\":" + json_number(100 * step_error_share(run)) + ",\"displacement\":" +
                      json_numbers(film.displacements()) + ",\"estimates\":[" + estimates + "],\"data\":" +
                      json_bytes(film.steps()) + "}");
  add_words(words);
  for (const double displacement : film.displacements()) most_ = std::max(most_, displacement);
  times_ = json_numbers(film.times());
  n_frames_ = run.frames.size() - 1;
}

void Page::add_words(const std::vector<std::string> &words) {
  for (const std::string &sentence : words) append(words_, json_text(sentence));
}

std::string Page::facts() const {
  std::string facts = n_shells_ > 1 ? format("%zu shells, ", n_shells_) : "";
  facts += format("%llu vertices, ", static_cast<unsigned long long>(n_vertices_));
  facts += seconds_ > 0 ? format("%zu frames", n_frames_) : std::string("from rest to equilibrium");
  return facts + ", shellwarp " + sw_version_string();
}

std::string Page::html() const {
  const std::string page = kPlayerPage;
  const std::size_t hole = page.find(kHole);
  const std::string data = "{\"title\":" + json_text(title_) + ",\"facts\":" + json_text(facts()) + ",\"unit\":" +
                           json_text(unit_) + format(",\"up\":%u,\"most\":", up_) + json_number(most_) + ",\"times\":" +
                           times_ + ",\n\"words\":[" + words_ + "],\n\"loads\":[" + loads_ + "],\n\"handles\":[" + handles_ +
                           "],\n\"colliders\":[" + colliders_ + "],\n\"shells\":[" + shells_ + "],\n\"tracks\":[" + tracks_ + "]}";
  return page.substr(0, hole) + data + page.substr(hole + sizeof kHole - 1);
}

OutputFolder page_folder(const std::string &path, const std::vector<std::string> &inputs) {
  const std::filesystem::path place(path);
  return OutputFolder(place.has_parent_path() ? place.parent_path().string() : ".", inputs);
}

void write_page(const Page &page, const std::string &path, const std::vector<std::string> &inputs) {
  OutputFolder folder = page_folder(path, inputs);
  OutputFile file(folder, std::filesystem::path(path).filename().string());
  const std::string html = page.html();
  file.write(html.data(), html.size());
  file.close();
  folder.put_in_place();
}

bool open_in_browser(const std::string &path) {
#ifdef _WIN32
  return std::system(("start \"\" \"" + path + "\"").c_str()) == 0;
#else
  std::string quoted = "'";
  for (const char c : path) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
#ifdef __APPLE__
  const std::string opener = "open";
#else
  const std::string opener = "xdg-open";
#endif
  return std::system((opener + " " + quoted + "' >/dev/null 2>&1").c_str()) == 0;
#endif
}

}  // namespace cli

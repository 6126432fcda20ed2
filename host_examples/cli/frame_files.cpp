#include "frame_files.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cli {

namespace {

void write_displacement(OutputFolder &folder, const std::string &name, const Scene &scene, const Mesh &mesh,
                        const Run &run, const FrameRecord &frame, const shellwarp::State &state) {
  std::vector<double> x(mesh.positions.size());
  const bool in_world = !frame.shown.empty() || scene.follow_rest;
  if (!frame.shown.empty())
    x.assign(frame.shown.begin(), frame.shown.end());
  else
    state.positions(x.data(), mesh.n_vertices(), in_world ? SW_SPACE_WORLD : SW_SPACE_FRAME);
  const std::vector<double> led = scene.follow_rest ? run.supports->animated(frame.report.time) : mesh.positions;
  const SwFrameDesc pose = scene.motion.pose(frame.report.time);
  OutputFile file(folder, name);
  for (std::size_t i = 0; i < x.size(); i += 3) {
    std::array<double, 3> rest{led[i], led[i + 1], led[i + 2]};
    if (in_world && !scene.is_static && !scene.follow_rest) rest = transform(pose, rest);
    file.print("%.9g\n", std::hypot(x[i] - rest[0], x[i + 1] - rest[1], x[i + 2] - rest[2]));
  }
  file.close();
}

bool any_held(const std::vector<PlacedHandle> &handles, const FrameRecord &frame) {
  return std::any_of(handles.begin(), handles.end(),
                     [&](const PlacedHandle &placed) { return placed.handle.held(frame.report.time); });
}

const char *kind_name(const Handle &handle) {
  return !handle.holds_orientation ? "position" : !handle.holds_position ? "orientation" : "both";
}

// The columns of a unit quaternion's rotation matrix (w, x, y, z), one after the other.
std::array<double, 9> matrix_columns(const double *q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),
          2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
          2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y)};
}

// Where the handle is to be; along axes that it does not hold, where its vertex is.
std::array<double, 3> handle_point(const PlacedHandle &placed, double seconds, const std::vector<double> &positions) {
  const std::array<double, 3> target = placed.position(seconds);
  std::array<double, 3> x{};
  for (std::size_t i = 0; i < 3; ++i) {
    const bool held = placed.handle.holds_position && (placed.handle.axes >> i & 1);
    x[i] = held ? target[i] : positions[3 * std::size_t{placed.vertex} + i];
  }
  return x;
}

void write_handles(OutputFolder &folder, const std::string &name, const std::vector<PlacedHandle> &handles,
                   double seconds, const Mesh &mesh, const shellwarp::State &state) {
  std::vector<double> positions(mesh.positions.size()), rotations(mesh.positions.size() / 3 * 4);
  state.positions(positions.data(), mesh.n_vertices());
  state.rotations(rotations.data(), mesh.n_vertices());
  OutputFile file(folder, name);
  file.print("vertex,kind,x,y,z,xx,xy,xz,yx,yy,yz,zx,zy,zz\n");
  for (const PlacedHandle &placed : handles) {
    if (!placed.handle.held(seconds)) continue;
    const std::array<double, 3> x = handle_point(placed, seconds, positions);
    file.print("%u,%s,%.9g,%.9g,%.9g", placed.vertex, kind_name(placed.handle), x[0], x[1], x[2]);
    const std::array<double, 9> columns = matrix_columns(&rotations[4 * std::size_t{placed.vertex}]);
    for (double m : columns)
      if (placed.handle.holds_orientation)
        file.print(",%.9g", m);
      else
        file.print(",");
    file.print("\n");
  }
  file.close();
}

void write_frame(OutputFolder &folder, const std::string &name, const Scene &scene, const Mesh &mesh,
                 const std::vector<PlacedHandle> &handles, const Run &run, const FrameRecord &frame, shellwarp::State &state) {
  go_to(run, frame, scene, state);
  write_obj(folder, name + ".obj", shown_positions(frame, mesh, state), mesh);
  write_displacement(folder, name + "_displacement.txt", scene, mesh, run, frame, state);
  if (any_held(handles, frame)) write_handles(folder, name + "_handles.csv", handles, frame.report.time, mesh, state);
}

void write_table_row(OutputFile &file, const FrameRecord &frame, const std::string &name, bool has_handles) {
  const SwStateReport &r = frame.report;
  file.print("%u,%.9g,%.9g,%.9g,%.9g,%.9g,", frame.frame, r.time, r.max_displacement, r.max_rotation, r.kinetic_energy,
             r.elastic_energy);
  if (name.empty())
    file.print(",,\n");
  else
    file.print("%s.obj,%s_displacement.txt,%s\n", name.c_str(), name.c_str(),
               has_handles ? (name + "_handles.csv").c_str() : "");
}

}  // namespace

std::vector<float> shown_positions(const FrameRecord &frame, const Mesh &mesh, const shellwarp::State &state) {
  if (!frame.shown.empty()) return frame.shown;
  std::vector<float> positions(mesh.positions.size());
  state.positions(positions.data(), mesh.n_vertices());
  return positions;
}

std::string frame_file_name(const std::string &name, uint32_t frame) {
  char number[16];
  std::snprintf(number, sizeof number, "%04u", frame);
  return name + "_frame_" + number;
}

bool is_output(const std::string &scene, const std::string &name) {
  if (name.compare(0, scene.size(), scene) != 0) return false;
  std::string end = name.substr(scene.size());
  if (end.compare(0, 7, "_render") == 0) end = end.substr(7);
  for (const char *whole : {".pc2", ".usda", ".glb", "_rest.obj", "_frames.csv", "_comparison.csv", "_bones.csv"})
    if (end == whole) return true;
  const std::size_t digits = end.compare(0, 7, "_frame_") == 0 ? 7 : 1;  // or "_2_warp.obj" of a comparison
  return end.size() > digits && end[0] == '_' && end[digits] >= '0' && end[digits] <= '9';
}

std::vector<std::size_t> chosen_frames(const Scene &scene, const std::vector<FrameRecord> &frames) {
  if (scene.obj_every) return regular_frames(frames, *scene.obj_every);
  return scene.obj_times.empty() ? extreme_frames(frames, scene.obj_frames) : timed_frames(frames, scene.obj_times);
}

std::vector<std::size_t> extreme_frames(const std::vector<FrameRecord> &frames, std::size_t count) {
  const auto height = [&](std::size_t i) { return frames[i].report.max_displacement; };
  std::vector<std::size_t> peaks;
  for (std::size_t i = 1; i < frames.size(); ++i)
    if (height(i) > height(i - 1) && (i + 1 == frames.size() || height(i) >= height(i + 1))) peaks.push_back(i);
  std::stable_sort(peaks.begin(), peaks.end(), [&](std::size_t a, std::size_t b) { return height(a) > height(b); });
  peaks.resize(std::min(peaks.size(), count));
  std::sort(peaks.begin(), peaks.end());
  return peaks;
}

std::vector<std::size_t> regular_frames(const std::vector<FrameRecord> &frames, uint32_t every) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].frame % every == 0) chosen.push_back(i);
  return chosen;
}

std::vector<std::size_t> timed_frames(const std::vector<FrameRecord> &frames, const std::vector<double> &times) {
  std::vector<std::size_t> nearest;
  for (double time : times) {
    const auto distance = [&](const FrameRecord &f) { return std::fabs(f.report.time - time); };
    const auto closest =
        std::min_element(frames.begin(), frames.end(),
                         [&](const FrameRecord &a, const FrameRecord &b) { return distance(a) < distance(b); });
    const double spacing = frames.size() > 1 ? frames[1].report.time - frames[0].report.time : 0;
    if (closest != frames.end() && distance(*closest) <= spacing)
      nearest.push_back(static_cast<std::size_t>(closest - frames.begin()));
  }
  std::sort(nearest.begin(), nearest.end());
  nearest.erase(std::unique(nearest.begin(), nearest.end()), nearest.end());
  return nearest;
}

void write_frame_files(OutputFolder &folder, const Scene &scene, const Mesh &mesh,
                       const std::vector<PlacedHandle> &handles, const Run &run, shellwarp::State &state) {
  write_obj(folder, scene.name + "_rest.obj", mesh.positions, mesh);
  const std::vector<std::size_t> chosen = chosen_frames(scene, run.frames);
  OutputFile table(folder, scene.name + "_frames.csv");
  table.print("frame,time,max_displacement,max_rotation,kinetic_energy,elastic_energy,obj,displacement,handles\n");
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const bool write = std::binary_search(chosen.begin(), chosen.end(), i);
    const std::string name = write ? frame_file_name(scene.name, run.frames[i].frame) : "";
    if (write) write_frame(folder, name, scene, mesh, handles, run, run.frames[i], state);
    write_table_row(table, run.frames[i], name, any_held(handles, run.frames[i]));
  }
  table.close();
}

}  // namespace cli

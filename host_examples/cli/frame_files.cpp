#include "frame_files.hpp"

#include "output_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

namespace cli {

namespace {

std::string join(const std::string &directory, const std::string &name) {
  return (std::filesystem::path(directory) / name).string();
}

std::string frame_name(const Scene &scene, uint32_t frame) {
  char number[16];
  std::snprintf(number, sizeof number, "%04u", frame);
  return scene.name + "_frame_" + number;
}

template <class Real>
void write_obj(const std::string &path, const std::vector<Real> &positions, const Mesh &mesh) {
  OutputFile file(path);
  for (std::size_t i = 0; i < positions.size(); i += 3)  // nine digits bring a float back exactly
    file.print("v %.9g %.9g %.9g\n", double{positions[i]}, double{positions[i + 1]}, double{positions[i + 2]});
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3)
    file.print("f %u %u %u\n", mesh.triangles[k] + 1, mesh.triangles[k + 1] + 1, mesh.triangles[k + 2] + 1);
  file.close();
}

void write_displacement(const std::string &path, const Mesh &mesh, const shellwarp::State &state) {
  std::vector<double> x(mesh.positions.size());
  state.positions(x.data(), mesh.n_vertices(), SW_SPACE_FRAME);
  OutputFile file(path);
  for (std::size_t i = 0; i < x.size(); i += 3)
    file.print("%.9g\n", std::hypot(x[i] - mesh.positions[i], x[i + 1] - mesh.positions[i + 1],
                                    x[i + 2] - mesh.positions[i + 2]));
  file.close();
}

void write_frame(const std::string &directory, const std::string &name, const Mesh &mesh, const FrameRecord &frame,
                 shellwarp::State &state) {
  state.load(frame.saved);
  std::vector<float> positions(mesh.positions.size());
  state.positions(positions.data(), mesh.n_vertices());
  write_obj(join(directory, name + ".obj"), positions, mesh);
  write_displacement(join(directory, name + "_displacement.txt"), mesh, state);
}

void write_table_row(OutputFile &file, const FrameRecord &frame, const std::string &name) {
  const SwStateReport &r = frame.report;
  file.print("%u,%.9g,%.9g,%.9g,%.9g,%.9g,", frame.frame, r.time, r.max_displacement, r.max_rotation, r.kinetic_energy,
             r.elastic_energy);
  if (name.empty())
    file.print(",\n");
  else
    file.print("%s.obj,%s_displacement.txt\n", name.c_str(), name.c_str());
}

}  // namespace

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

void write_frame_files(const std::string &directory, const Scene &scene, const Mesh &mesh, const Run &run,
                       shellwarp::State &state) {
  write_obj(join(directory, scene.name + "_rest.obj"), mesh.positions, mesh);
  const std::vector<std::size_t> chosen = extreme_frames(run.frames, scene.obj_frames);

  OutputFile table(join(directory, scene.name + "_frames.csv"));
  table.print("frame,time,max_displacement,max_rotation,kinetic_energy,elastic_energy,obj,displacement\n");
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const bool write = std::binary_search(chosen.begin(), chosen.end(), i);
    const std::string name = write ? frame_name(scene, run.frames[i].frame) : "";
    if (write) write_frame(directory, name, mesh, run.frames[i], state);
    write_table_row(table, run.frames[i], name);
  }
  table.close();
}

}  // namespace cli

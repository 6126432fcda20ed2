#include "render_files.hpp"

#include "frame_files.hpp"
#include "moving_files.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

Mesh scaled_mesh(const Scene &scene) {
  Mesh mesh = read_mesh(scene.render_path);
  for (double &x : mesh.positions) x *= scene.scale;
  return mesh;
}

bool is_obj(const std::string &path) {
  std::string end = std::filesystem::path(path).extension().string();
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return end == ".obj";
}

}  // namespace

RenderMesh::RenderMesh(const Scene &scene)
    : path_(scene.render_path), contents_(is_obj(path_) ? read_file(path_) : ""), mesh_(scaled_mesh(scene)) {}

SwBindingInfo RenderMesh::bind(const shellwarp::Model &model) {
  SwBindingDesc desc = shellwarp::binding_desc();
  desc.format = SW_FORMAT_F64;
  desc.points = mesh_.positions.data();
  desc.n_points = mesh_.n_vertices();
  try {
    binding_.emplace(model, desc);
  } catch (const shellwarp::Error &error) {
    throw std::runtime_error(path_ + ": " + error.what());
  }
  return binding_->info();
}

void RenderMesh::write_obj(OutputFolder &folder, const std::string &name, const std::vector<float> &positions) const {
  if (contents_.empty()) return cli::write_obj(folder, name, positions, mesh_);
  OutputFile file(folder, name);
  const std::string text = obj_with_positions(contents_, positions);
  file.write(text.data(), text.size());
  file.close();
}

std::vector<float> RenderMesh::points(const Scene &scene, const shellwarp::State &state) const {
  return read_points(state, binding_.value(), n_points(), nullptr, false, scene.correction_steps);
}

void RenderMesh::write(OutputFolder &folder, const Scene &scene, const std::vector<std::size_t> &chosen, const Run &run,
                       shellwarp::State &state) const {
  const std::string name = scene.name + "_render";
  std::optional<PointCache> cache;
  if (writes(scene, "pc2")) cache.emplace(folder, name + ".pc2", n_points());
  MotionFiles files(scene, mesh_, true);
  write_obj(folder, name + "_rest.obj", std::vector<float>(mesh_.positions.begin(), mesh_.positions.end()));
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    go_to(run, run.frames[i], scene, state);
    std::vector<float> velocities;
    std::vector<float> x = run.frames[i].drawn;
    if (x.empty() || files.wanted()) {
      std::vector<float> here = read_points(state, binding_.value(), n_points(), files.wanted() ? &velocities : nullptr, scene.push_out);
      if (x.empty()) x = std::move(here);
    }
    if (cache) cache->append(x.data());
    if (std::binary_search(chosen.begin(), chosen.end(), i)) {
      write_obj(folder, frame_file_name(name, run.frames[i].frame) + ".obj", x);
    }
    if (files.wanted()) files.append(run.frames[i], std::move(x), std::move(velocities));
  }
  if (cache) cache->close();
  if (files.wanted()) files.write(folder, name);
}

}  // namespace cli

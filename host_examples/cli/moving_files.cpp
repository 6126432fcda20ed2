#include "moving_files.hpp"

#include "frame_files.hpp"
#include "judge.hpp"
#include "page.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cli {

const std::vector<std::string> &file_formats() {
  static const std::vector<std::string> names = {"pc2", "usd", "gltf"};
  return names;
}

bool writes(const Scene &scene, const char *format) {
  return std::find(scene.formats.begin(), scene.formats.end(), format) != scene.formats.end();
}

void check_formats(const Scene &scene) {
  const bool usd = writes(scene, "usd");
  if (usd && scene.up == 0u) throw std::runtime_error("USD has y or z upward, and up is x");
  if (!scene.usd_prim.empty() && !usd) throw std::runtime_error("usd_prim is given, but usd is not among the formats");
  if (const std::string wrong = scene.usd_prim.empty() ? "" : wrong_prim(scene.usd_prim); !wrong.empty())
    throw std::runtime_error("usd_prim " + scene.usd_prim + ": " + wrong);
}

std::vector<float> read_points(const shellwarp::State &state, const shellwarp::Binding &binding, uint32_t n_points,
                               std::vector<float> *velocities, bool outside, uint32_t correction_steps) {
  std::vector<float> x(std::size_t{3} * n_points);
  SwBoundPointsDesc desc = shellwarp::bound_points_desc();
  desc.format = SW_FORMAT_F32;
  desc.positions = x.data();
  if (outside) desc.flags = SW_BOUND_OUTSIDE;
  desc.correction_steps = correction_steps;
  if (velocities) {
    velocities->resize(x.size());
    desc.velocities = velocities->data();
  }
  state.bound_points(binding, desc);
  return x;
}

MotionFiles::MotionFiles(const Scene &scene, const Mesh &mesh, bool to_asset)
    : scene_(scene), to_asset_(to_asset && !scene.usd_prim.empty()), moving_{mesh} {
  moving_.frame_rate = scene.frame_rate;
  moving_.metres_per_unit = scene.metres_per_unit;
  moving_.up = scene.up.value_or(up_axis(scene, mesh));
}

bool MotionFiles::wanted() const { return writes(scene_, "usd") || writes(scene_, "gltf"); }

void MotionFiles::append(const FrameRecord &frame, std::vector<float> positions, std::vector<float> velocities) {
  if (scene_.is_static || scene_.follow_rest) velocities.clear();  // a frame that is gone back to does not know how its rest shape moved
  const double seconds = scene_.is_static ? frame.frame : frame.report.time;  // an equilibrium takes no time: it is shown in a second
  moving_.frames.push_back({frame.frame, seconds, std::move(positions), std::move(velocities)});
}

void MotionFiles::write(OutputFolder &folder, const std::string &name) {
  if (writes(scene_, "gltf")) write_gltf(folder, name, moving_);
  if (!writes(scene_, "usd")) return;
  if (to_asset_ && scene_.scale != 1) {  // in the asset's own unit
    moving_.metres_per_unit *= scene_.scale;
    for (MovingMesh::Frame &frame : moving_.frames)
      for (std::vector<float> *values : {&frame.positions, &frame.velocities})
        for (float &x : *values) x = static_cast<float>(x / scene_.scale);
  }
  write_usd(folder, name, to_asset_ ? scene_.usd_prim : "", moving_);
}

void write_shell_motion(OutputFolder &folder, const Scene &scene, const Mesh &mesh, const shellwarp::Model &model, const Run &run,
                        shellwarp::State &state) {
  MotionFiles files(scene, mesh, scene.render_path.empty());
  if (!files.wanted()) return;
  SwBindingDesc desc = shellwarp::binding_desc();
  desc.format = SW_FORMAT_F64;
  desc.points = mesh.positions.data();
  desc.n_points = mesh.n_vertices();
  std::optional<shellwarp::Binding> binding;  // which gives velocities
  try {
    binding.emplace(model, desc);
  } catch (const shellwarp::Error &error) {  // a mesh may be too sharp for it
    if (error.status() != SW_ERROR_NUMERICAL) throw;
  }
  for (const FrameRecord &frame : run.frames) {
    go_to(run, frame, scene, state);
    std::vector<float> velocities;
    if (binding) read_points(state, *binding, mesh.n_vertices(), &velocities);
    files.append(frame, shown_positions(frame, mesh, state), std::move(velocities));
  }
  files.write(folder, scene.name);
}

}  // namespace cli

#include "support_motion.hpp"

#include "shell.hpp"
#include "support_places.hpp"

#include <algorithm>

namespace cli {

namespace {

using Vec3 = std::array<double, 3>;

Vec3 middle_of(const std::vector<uint32_t> &vertices, const Mesh &mesh) {
  Vec3 middle{};
  for (const uint32_t v : vertices)
    for (std::size_t i = 0; i < 3; ++i) middle[i] += mesh.vertex(v)[i] / static_cast<double>(vertices.size());
  return middle;
}

}  // namespace

bool any_moves(const std::vector<Support> &supports) {
  return std::any_of(supports.begin(), supports.end(), [](const Support &support) { return !support.keys.empty(); });
}

bool any_moves(const Scene &scene) { return any_moves(scene.supports) || !scene.motion_path.empty(); }

SupportMotion::SupportMotion(const Scene &scene, const Mesh &mesh) : scene_(scene), mesh_(mesh) {
  if (!any_moves(scene.supports)) return;
  for (const Support &support : scene.supports) {
    if (support.keys.empty()) continue;
    const std::vector<uint32_t> named = find_vertices(support, mesh, "support");
    const Vec3 about = support.about ? *support.about : middle_of(named, mesh);
    led_.push_back({support.clamped ? host::with_neighbours(mesh.triangles, named) : named, about, &support.keys});
  }
}

// Of a proxy as far from it as the file's vertices are from the file's mesh.
std::vector<double> SupportMotion::animated(double seconds) const {
  std::vector<double> points = scene_.points->at(seconds * scene_.frame_rate);
  if (mesh_.of_file.empty()) return points;
  if (mesh_.proxy)
    for (std::size_t k = 0; k < points.size(); ++k) points[k] -= mesh_.proxy->file_positions[k];
  std::vector<double> here = mesh_.carried(points, 3);
  for (std::size_t k = 0; mesh_.proxy && k < here.size(); ++k) here[k] += mesh_.positions[k];
  return here;
}

void SupportMotion::begin(shellwarp::State &state) {
  if (!any_moves(scene_)) return;
  move(0, state, true);
  if (scene_.follow_rest) state.reset();  // it is there, and does not jump there in the first step
}

void SupportMotion::bring_rest(double seconds, shellwarp::State &state) {
  if (scene_.follow_rest) move(seconds, state, true);
}

void SupportMotion::move(double seconds, shellwarp::State &state, bool teleport) {
  if (scene_.points) {
    const std::vector<double> places = animated(seconds);
    if (scene_.follow_rest)
      state.move_rest(places.data(), mesh_.n_vertices(), teleport ? SW_REST_TELEPORT : 0);
    else
      state.move_supports(places.data(), mesh_.n_vertices(), teleport ? SW_SUPPORTS_TELEPORT : 0);
    return;
  }
  if (led_.empty()) {
    if (scene_.motion.moves()) state.set_frame(scene_.motion.pose(seconds));
    return;
  }
  positions_ = mesh_.positions;
  for (const Led &led : led_) {
    const HandleKey key = key_at(*led.keys, seconds);
    SwFrameDesc turn = shellwarp::frame_desc();
    const std::array<double, 9> rotation = rotation_matrix(key.rotation);
    std::copy(rotation.begin(), rotation.end(), turn.rotation);
    for (const uint32_t v : led.vertices) {
      const Vec3 rest = mesh_.vertex(v), arm = {rest[0] - led.about[0], rest[1] - led.about[1], rest[2] - led.about[2]};
      const Vec3 turned = transform(turn, arm);
      for (std::size_t i = 0; i < 3; ++i) positions_[3 * std::size_t{v} + i] = led.about[i] + key.offset[i] + turned[i];
    }
  }
  if (scene_.motion.moves()) {
    const SwFrameDesc pose = scene_.motion.pose(seconds);
    for (std::size_t k = 0; k < positions_.size(); k += 3) {
      const Vec3 x = transform(pose, {positions_[k], positions_[k + 1], positions_[k + 2]});
      std::copy(x.begin(), x.end(), &positions_[k]);
    }
  }
  state.move_supports(positions_.data(), mesh_.n_vertices(), teleport ? SW_SUPPORTS_TELEPORT : 0);
}

}  // namespace cli

#include "collider.hpp"

#include "mesh.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cli {

namespace {

shellwarp::Collider make_solid(const Collider &collider, double scale) {
  SwColliderDesc desc = shellwarp::collider_desc();
  desc.kind = collider.kind;
  desc.radius = collider.radius;
  desc.half_length = collider.half_length;
  std::copy(collider.half_extents.begin(), collider.half_extents.end(), desc.half_extents);
  desc.friction = collider.friction;
  desc.thickness = collider.thickness;
  desc.cells = collider.cells;
  desc.flags = collider.one_sided ? SW_COLLIDER_ONE_SIDED : 0;
  desc.depth = collider.depth;
  if (collider.mesh_path.empty()) return shellwarp::Collider(desc);
  Mesh mesh = read_mesh(collider.mesh_path);
  for (double &x : mesh.positions) x *= scale;
  const SwMeshDesc surface =
      shellwarp::mesh_desc(mesh.positions.data(), mesh.n_vertices(), mesh.triangles.data(), mesh.n_triangles());
  desc.mesh = &surface;
  return shellwarp::Collider(desc);
}

}  // namespace

SwColliderPoseDesc Collider::pose(double seconds) const {
  const HandleKey key = key_at(keys, seconds);
  std::array<double, 9> turned = product(rotation_matrix(key.rotation).data(), rotation_matrix(rotation).data());
  std::array<double, 3> origin = {position[0] + key.offset[0], position[1] + key.offset[1], position[2] + key.offset[2]};
  if (bone) {
    const SwFrameDesc carried = bone->pose(seconds);
    turned = product(carried.rotation, turned.data());
    origin = transform(carried, origin);
  }
  SwColliderPoseDesc desc = shellwarp::collider_pose_desc();
  std::copy(origin.begin(), origin.end(), desc.origin);
  std::copy(turned.begin(), turned.end(), desc.rotation);
  return desc;
}

std::vector<std::string> collider_kinds() { return {"plane", "sphere", "capsule", "box", "hull", "mesh", "deforming"}; }

std::array<double, 3> rotation_to(const std::array<double, 3> &direction) {
  const double across = std::hypot(direction[0], direction[1]), angle = std::atan2(across, direction[2]);
  if (across == 0) return {angle, 0, 0};  // straight up or straight down
  return {-direction[1] / across * angle, direction[0] / across * angle, 0};
}

bool any_moves(const std::vector<Collider> &colliders) {
  return std::any_of(colliders.begin(), colliders.end(), [](const Collider &collider) { return collider.moves(); });
}

void prepare_colliders(std::vector<Collider> &colliders, double scale) {
  for (std::size_t k = 0; k < colliders.size(); ++k) {
    const std::string &file = colliders[k].mesh_path;
    try {
      colliders[k].solid = std::make_shared<const shellwarp::Collider>(make_solid(colliders[k], scale));
      if (colliders[k].deforms())
        colliders[k].points = std::make_shared<const MovingPoints>(colliders[k].motion_path, read_mesh(file).n_vertices(), scale);
    } catch (const shellwarp::Error &error) {
      const bool open = error.status() == SW_ERROR_INVALID_MESH && !colliders[k].one_sided;
      throw std::runtime_error("collider " + std::to_string(k + 1) + (file.empty() ? "" : ", " + file) + ": " + error.what() +
                               (open ? "; an open mesh is one-sided by :one-sided (one_sided = true)" : ""));
    }
  }
}

void set_colliders(const std::vector<Collider> &colliders, double frame_rate, shellwarp::State &state) {
  if (colliders.empty()) return;
  std::vector<const SwCollider *> solids;
  for (const Collider &collider : colliders) {
    if (!collider.solid) throw std::logic_error("a collider was not prepared");
    solids.push_back(collider.solid->get());
  }
  state.set_colliders(solids);
  for (uint32_t k = 0; k < solids.size(); ++k) state.move_collider(k, colliders[k].pose(0));
  deform_colliders(colliders, 0, frame_rate, state, true);
}

void move_colliders(const std::vector<Collider> &colliders, double seconds, double frame_rate, shellwarp::State &state) {
  for (uint32_t k = 0; k < colliders.size(); ++k)
    if (colliders[k].moves()) state.move_collider(k, colliders[k].pose(seconds));
  deform_colliders(colliders, seconds, frame_rate, state, false);
}

void deform_colliders(const std::vector<Collider> &colliders, double seconds, double frame_rate, shellwarp::State &state, bool teleport) {
  for (uint32_t k = 0; k < colliders.size(); ++k) {
    if (!colliders[k].deforms()) continue;
    const std::vector<double> points = colliders[k].points->at(seconds * frame_rate);
    state.deform_collider(k, points.data(), static_cast<uint32_t>(points.size() / 3), teleport ? SW_COLLIDER_TELEPORT : 0);
  }
}

}  // namespace cli

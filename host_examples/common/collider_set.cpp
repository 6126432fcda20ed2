#include "collider_set.hpp"

#include "hash.hpp"
#include "message.hpp"
#include "rigid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

namespace host {

namespace {

struct Fit {
  SwColliderDesc desc = shellwarp::collider_desc();
  Pose local;
};

// Its z axis is the direction; the others are any.
Matrix3 axes_along(const Vec3 &z) {
  const std::size_t least = std::abs(z[0]) < std::abs(z[1]) ? (std::abs(z[0]) < std::abs(z[2]) ? 0 : 2)
                                                            : (std::abs(z[1]) < std::abs(z[2]) ? 1 : 2);
  Vec3 x{};
  for (std::size_t k = 0; k < 3; ++k) x[k] = (k == least ? 1 : 0) - z[least] * z[k];
  const double length = std::hypot(x[0], x[1], x[2]);
  for (double &c : x) c /= length;
  const Vec3 y = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]};
  return {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
}

// Through the middle of its points, facing as its polygons do on the mean.
Pose plane_of(const Mesh &mesh) {
  Vec3 sum{};
  double area = 0;
  for (std::size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    const double *a = &mesh.points[3 * std::size_t(mesh.triangles[t])];
    const double *b = &mesh.points[3 * std::size_t(mesh.triangles[t + 1])];
    const double *c = &mesh.points[3 * std::size_t(mesh.triangles[t + 2])];
    Vec3 normal{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      normal[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
      sum[k] += normal[k];
    }
    area += std::hypot(normal[0], normal[1], normal[2]);
  }
  const double length = std::hypot(sum[0], sum[1], sum[2]);
  // Half of the area and more faces one way; a closed mesh has as much facing the other.
  if (!(length > 0.5 * area)) throw HostError("its polygons face all ways: a plane needs flat ones");
  for (double &x : sum) x /= length;
  Pose pose;
  pose.rotation = axes_along(sum);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) pose.origin[i % 3] += mesh.points[i] / mesh.n_points();
  return pose;
}

// Round its bounding box.
Fit round_box(const Collider &collider) {
  const std::vector<double> &x = collider.mesh.points;
  Vec3 low = {x[0], x[1], x[2]}, high = low, half{};
  for (std::size_t i = 0; i < x.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], x[i]);
    high[i % 3] = std::max(high[i % 3], x[i]);
  }
  Fit fit;
  for (std::size_t k = 0; k < 3; ++k) {
    half[k] = (high[k] - low[k]) / 2;
    fit.local.origin[k] = (low[k] + high[k]) / 2;
  }
  std::size_t along = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (half[k] > half[along]) along = k;
  fit.desc.radius = half[along];
  if (collider.kind == SW_COLLIDER_BOX) std::copy(half.begin(), half.end(), fit.desc.half_extents);
  if (collider.kind == SW_COLLIDER_CAPSULE) {
    Vec3 axis{};
    axis[along] = 1;
    fit.local.rotation = axes_along(axis);
    fit.desc.radius = std::max(half[(along + 1) % 3], half[(along + 2) % 3]);
    fit.desc.half_length = half[along] - fit.desc.radius;
  }
  return fit;
}

void check_mesh(const Mesh &mesh) {
  if (mesh.points.empty() || mesh.faces().empty())
    throw HostError("it has no polygons: " + number(uint64_t(mesh.n_points())) + " points, " +
                    number(uint64_t(mesh.n_triangles())) + " triangles");
  for (const double x : mesh.points)
    if (!std::isfinite(x)) throw HostError("a point is not finite");
  for (const uint32_t i : mesh.faces())
    if (i >= mesh.n_points())
      throw HostError("a polygon names vertex " + number(uint64_t(i)) + ", but there are " +
                      number(uint64_t(mesh.n_points())));
}

Fit fit_of(const Collider &collider) {
  switch (collider.kind) {
    case SW_COLLIDER_PLANE: {
      Fit fit;
      fit.local = plane_of(collider.mesh);
      return fit;
    }
    case SW_COLLIDER_SPHERE:
    case SW_COLLIDER_CAPSULE:
    case SW_COLLIDER_BOX:
      return round_box(collider);
    default:
      return Fit();
  }
}

std::pair<shellwarp::Collider, Pose> make(Collider collider, double unit) {
  check_mesh(collider.mesh);
  collider.mesh.cut();
  Fit fit = fit_of(collider);
  SwColliderDesc &desc = fit.desc;
  desc.kind = collider.kind;
  if (collider.kind != SW_COLLIDER_SPHERE && collider.kind != SW_COLLIDER_CAPSULE) desc.radius = 0;
  desc.radius /= unit;
  desc.half_length /= unit;
  for (double &x : desc.half_extents) x /= unit;
  desc.friction = collider.friction;
  desc.thickness = collider.thickness / unit;
  if (collider.kind != SW_COLLIDER_HULL && collider.kind != SW_COLLIDER_MESH && collider.kind != SW_COLLIDER_DEFORMING_MESH)
    return {shellwarp::Collider(desc), fit.local};
  std::vector<double> points = collider.mesh.points;
  for (double &x : points) x /= unit;
  const SwMeshDesc mesh = shellwarp::mesh_desc(points.data(), collider.mesh.n_points(), collider.mesh.triangles.data(),
                                               collider.mesh.n_triangles());
  desc.mesh = &mesh;
  if (collider.kind == SW_COLLIDER_MESH) desc.cells = collider.cells;
  if (collider.one_sided && collider.kind != SW_COLLIDER_HULL) {
    desc.flags = SW_COLLIDER_ONE_SIDED;
    desc.depth = collider.depth / unit;
  }
  return {shellwarp::Collider(desc), fit.local};
}

// Of everything but where its points are.
uint64_t look_of(const Collider &collider) {
  Hash hash;
  hash.add(collider.kind).add(collider.friction).add(collider.thickness).add(collider.cells).add(collider.one_sided).add(collider.depth);
  return hash.add(collider.mesh.n_points()).add_all(collider.mesh.faces()).add_all(collider.mesh.sizes).value();
}

// The motion of all points as one, where it is no other: to 1e-5 of the size, and to hosts' floats, of 6e-8 each way.
std::optional<Pose> motion_as_one(const std::vector<double> &points, const std::vector<double> &before) {
  std::vector<uint32_t> all(points.size() / 3);
  std::iota(all.begin(), all.end(), 0u);
  const Pose motion = rigid_motion(all, points, before);
  double size = 0, furthest = 0, off = 0;
  for (std::size_t i = 0; i < points.size(); i += 3) {
    const Vec3 x = host::apply(motion, {before[i], before[i + 1], before[i + 2]});
    for (std::size_t k = 0; k < 3; ++k) {
      off = std::max(off, std::abs(x[k] - points[i + k]));
      size = std::max(size, std::abs(before[i + k] - before[k]));
      furthest = std::max({furthest, std::abs(points[i + k]), std::abs(before[i + k])});
    }
  }
  if (!(off <= 1e-5 * size + 2.4e-7 * furthest)) return std::nullopt;
  return motion;
}

}  // namespace

Pose to_library(const Inputs &inputs, double unit) {
  Pose frame = inputs.frame;
  frame.scale = 1;
  for (double &x : frame.origin) x /= unit;
  return product(frame, inverse(inputs.object));
}

uint64_t shape_key(const Collider &collider) { return Hash().add(look_of(collider)).add_all(collider.mesh.points).value(); }

bool ColliderSet::prepare(std::vector<Collider> &colliders, double unit) {
  const double lengths = static_cast<double>(static_cast<float>(unit));  // a scale's rounding makes no new shape
  std::vector<Solid> next;
  bool changed = colliders.size() != solids_.size();
  for (std::size_t k = 0; k < colliders.size(); ++k) {
    Collider &collider = colliders[k];
    const uint64_t look = Hash().add(look_of(collider)).add(lengths).value();
    const uint64_t key = collider.kind == SW_COLLIDER_DEFORMING_MESH ? look : Hash().add(shape_key(collider)).add(lengths).value();
    auto known = std::find_if(solids_.begin(), solids_.end(), [key](const Solid &s) { return s.key == key && s.solid.get(); });
    if (known == solids_.end() && k < solids_.size() && solids_[k].look == look && solids_[k].solid.get()) {
      if (const std::optional<Pose> motion = motion_as_one(collider.mesh.points, solids_[k].points)) {
        collider.pose = product(collider.pose, *motion);
        collider.mesh.points = solids_[k].points;
        known = solids_.begin() + static_cast<std::ptrdiff_t>(k);
      }
    }
    changed |= k >= solids_.size() || known != solids_.begin() + static_cast<std::ptrdiff_t>(k);
    if (known != solids_.end()) {
      next.push_back(std::move(*known));
      continue;
    }
    try {
      auto [solid, local] = make(collider, lengths);
      next.push_back({key, look, collider.mesh.points, std::move(solid), local});
      ++made_;
    } catch (const std::exception &error) {
      solids_.clear();
      throw HostError(collider.name + ": " + error.what());
    }
  }
  solids_ = std::move(next);
  return changed;
}

std::vector<const SwCollider *> ColliderSet::solids() const {
  std::vector<const SwCollider *> solids;
  for (const Solid &solid : solids_) solids.push_back(solid.solid.get());
  return solids;
}

Pose ColliderSet::pose_of(const Inputs &inputs, const Pose &world, std::size_t k) const {
  Pose seen = inputs.colliders[k].pose;
  seen.scale = 1;
  return product(world, product(seen, solids_[k].local));
}

std::vector<double> ColliderSet::poses(const Inputs &inputs, const Pose &world) const {
  std::vector<double> numbers;
  for (std::size_t k = 0; k < solids_.size(); ++k) {
    const Pose pose = pose_of(inputs, world, k);
    numbers.insert(numbers.end(), pose.origin.begin(), pose.origin.end());
    numbers.insert(numbers.end(), pose.rotation.begin(), pose.rotation.end());
  }
  return numbers;
}

void ColliderSet::place(shellwarp::State &state, const Inputs &inputs, double unit, bool teleport) const {
  const Pose world = to_library(inputs, unit);
  for (std::size_t k = 0; k < solids_.size(); ++k) {
    const Pose pose = pose_of(inputs, world, k);
    SwColliderPoseDesc desc = shellwarp::collider_pose_desc();
    desc.flags = teleport ? SW_COLLIDER_TELEPORT : 0;
    std::copy(pose.origin.begin(), pose.origin.end(), desc.origin);
    std::copy(pose.rotation.begin(), pose.rotation.end(), desc.rotation);
    state.move_collider(static_cast<uint32_t>(k), desc);
  }
  deform(state, inputs, unit, teleport);
}

void ColliderSet::deform(shellwarp::State &state, const Inputs &inputs, double unit, bool teleport) const {
  for (std::size_t k = 0; k < inputs.colliders.size(); ++k) {
    if (inputs.colliders[k].kind != SW_COLLIDER_DEFORMING_MESH) continue;
    std::vector<double> points = inputs.colliders[k].mesh.points;
    for (double &x : points) x /= unit;
    state.deform_collider(static_cast<uint32_t>(k), points.data(), static_cast<uint32_t>(points.size() / 3), teleport ? SW_COLLIDER_TELEPORT : 0);
  }
}

bool ColliderSet::deforms(const std::vector<Collider> &colliders) {
  return std::any_of(colliders.begin(), colliders.end(), [](const Collider &c) { return c.kind == SW_COLLIDER_DEFORMING_MESH; });
}

}  // namespace host

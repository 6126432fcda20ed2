/* shellwarp.hpp: the C interface of shellwarp.h for C++17. Handles that destroy themselves, errors as exceptions, overloads
   that choose the buffer format. Nothing is computed here; what a call does, its shapes, units and threads are told in
   shellwarp.h under the name of the C function.

   A pointer and a count stand for a span. `stride` is the byte distance between vertices, 0 = packed. A buffer is never
   touched by a call that throws. */
#ifndef SHELLWARP_HPP
#define SHELLWARP_HPP

#include "shellwarp.h"

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace shellwarp {

/* A status other than SW_OK, with the message of sw_last_error_message(). */
class Error : public std::runtime_error {
public:
  explicit Error(SwStatus status) : std::runtime_error(message(status)), status_(status) {}

  SwStatus status() const noexcept { return status_; }

private:
  static std::string message(SwStatus status) {
    return std::string(sw_status_string(status)) + ": " + sw_last_error_message();
  }

  SwStatus status_;
};

/* Throws Error unless `status` is SW_OK. */
inline void check(SwStatus status) {
  if (status != SW_OK) throw Error(status);
}

namespace detail {

template <class Struct>
Struct initialized() {
  Struct made;
  sw_struct_init(&made, sizeof made);
  return made;
}

struct Destroy {
  void operator()(SwModel *model) const noexcept { sw_model_destroy(model); }
  void operator()(SwState *state) const noexcept { sw_state_destroy(state); }
  void operator()(SwCollider *collider) const noexcept { sw_collider_destroy(collider); }
  void operator()(SwBinding *binding) const noexcept { sw_binding_destroy(binding); }
  void operator()(SwProxy *proxy) const noexcept { sw_proxy_destroy(proxy); }
};

/* What a search asks after each iteration, given `watched` as the user: SwWatchFn. */
template <class Watch>
uint32_t asks(void *watch, double residual) noexcept {
  return (*static_cast<Watch *>(watch))(residual) ? SW_PROGRESS_CONTINUE : SW_PROGRESS_CANCEL;
}
template <class Watch>
void *watched(Watch &watch) noexcept {
  return const_cast<void *>(static_cast<const void *>(&watch));
}

}  // namespace detail

/* Descriptors with every field at its default. */
inline SwMeshDesc mesh_desc() { return detail::initialized<SwMeshDesc>(); }
inline SwMaterialDesc material_desc() { return detail::initialized<SwMaterialDesc>(); }
/* A known material by its index in the table: see sw_preset_material. */
inline SwMaterialDesc preset_material(uint32_t index, double metres_per_unit = 1) {
  SwMaterialDesc desc = material_desc();
  check(sw_preset_material(index, metres_per_unit, &desc));
  return desc;
}
inline SwMaterialMap material_map() { return detail::initialized<SwMaterialMap>(); }
inline SwSupportDesc support_desc() { return detail::initialized<SwSupportDesc>(); }
inline SwPrecomputeDesc precompute_desc() { return detail::initialized<SwPrecomputeDesc>(); }
inline SwStateDesc state_desc() { return detail::initialized<SwStateDesc>(); }
inline SwDampingDesc damping_desc() { return detail::initialized<SwDampingDesc>(); }
inline SwFrameDesc frame_desc() { return detail::initialized<SwFrameDesc>(); }
inline SwConstraintDesc constraint_desc() { return detail::initialized<SwConstraintDesc>(); }
inline SwForceDesc force_desc() { return detail::initialized<SwForceDesc>(); }
inline SwWindDesc wind_desc() { return detail::initialized<SwWindDesc>(); }
inline SwColliderDesc collider_desc() { return detail::initialized<SwColliderDesc>(); }
inline SwColliderPoseDesc collider_pose_desc() { return detail::initialized<SwColliderPoseDesc>(); }
inline SwBindingDesc binding_desc() { return detail::initialized<SwBindingDesc>(); }
inline SwProxyDesc proxy_desc() { return detail::initialized<SwProxyDesc>(); }
inline SwCalibrationDesc calibration_desc() { return detail::initialized<SwCalibrationDesc>(); }
inline SwBoundPointsDesc bound_points_desc() { return detail::initialized<SwBoundPointsDesc>(); }

/* A mesh of packed positions (n_vertices x 3) and packed triangles (n_triangles x 3). */
inline SwMeshDesc mesh_desc(const void *positions, uint32_t format, uint32_t n_vertices, const uint32_t *triangles,
                            uint32_t n_triangles) {
  SwMeshDesc desc = mesh_desc();
  desc.positions = positions;
  desc.position_format = format;
  desc.triangles = triangles;
  desc.n_vertices = n_vertices;
  desc.n_triangles = n_triangles;
  return desc;
}

inline SwMeshDesc mesh_desc(const float *positions, uint32_t n_vertices, const uint32_t *triangles,
                            uint32_t n_triangles) {
  return mesh_desc(positions, SW_FORMAT_F32, n_vertices, triangles, n_triangles);
}

inline SwMeshDesc mesh_desc(const double *positions, uint32_t n_vertices, const uint32_t *triangles,
                            uint32_t n_triangles) {
  return mesh_desc(positions, SW_FORMAT_F64, n_vertices, triangles, n_triangles);
}

/* Packed forces (count x 3) on the vertices listed (count), or, with `vertices` null, one for every vertex in order. `flags`
   is 0 or SW_FORCES_ONE_STEP. */
inline SwForceDesc force_desc(const void *forces, uint32_t format, uint32_t count, const uint32_t *vertices,
                              uint32_t flags) {
  SwForceDesc desc = force_desc();
  desc.forces = forces;
  desc.format = format;
  desc.count = count;
  desc.vertices = vertices;
  desc.flags = flags;
  return desc;
}

inline SwForceDesc force_desc(const float *forces, uint32_t count, const uint32_t *vertices = nullptr,
                              uint32_t flags = 0) {
  return force_desc(forces, SW_FORMAT_F32, count, vertices, flags);
}

inline SwForceDesc force_desc(const double *forces, uint32_t count, const uint32_t *vertices = nullptr,
                              uint32_t flags = 0) {
  return force_desc(forces, SW_FORMAT_F64, count, vertices, flags);
}

/* Where messages go that belong to no failed call; null for none. */
inline void set_log_callback(SwLogFn callback, void *user = nullptr) { check(sw_set_log_callback(callback, user)); }

/* How many threads step() of many states may use; 0 for the default, 1 for none besides the caller's. */
inline void set_threads(uint32_t count) { check(sw_set_threads(count)); }

/* Advances many states, State::get() each, in parallel. Throws the first state's error when all others have moved; `statuses`
   (count, or null) tells which failed. */
inline void step(SwState *const *states, uint32_t count, double seconds, SwStatus *statuses = nullptr) {
  check(sw_states_step(states, count, seconds, statuses));
}

/* All diagnostics of a mesh; a broken mesh is not an exception here. */
inline std::vector<SwDiagnostic> check_mesh(const SwMeshDesc &mesh) {
  uint32_t count = 0;
  check(sw_mesh_check(&mesh, nullptr, sizeof(SwDiagnostic), 0, &count));
  std::vector<SwDiagnostic> diagnostics(count);
  check(sw_mesh_check(&mesh, diagnostics.data(), sizeof(SwDiagnostic), count, &count));
  return diagnostics;
}

class Proxy;

/* Owns an SwModel. Move only. */
class Model {
public:
  explicit Model(const SwMeshDesc &mesh, const SwMaterialDesc &material = material_desc(),
                 const SwSupportDesc &supports = support_desc()) {
    SwModel *model = nullptr;
    check(sw_model_create(&mesh, &material, &supports, &model));
    handle_.reset(model);
  }

  void precompute(const SwPrecomputeDesc &desc = precompute_desc()) { check(sw_model_precompute(get(), &desc)); }

  /* Vertices for contact_patches, near colliders at these poses (12 numbers each: origin, rotation matrix), at most so many. */
  std::vector<uint32_t> patches_near(const std::vector<const SwCollider *> &colliders, const std::vector<double> &poses, double distance,
                                     uint32_t most) const {
    if (!poses.empty() && poses.size() != 12 * colliders.size()) throw std::invalid_argument("shellwarp: a pose is 12 numbers a collider");
    std::vector<uint32_t> vertices(most);
    uint32_t count = 0;
    check(sw_model_patches_near(get(), colliders.data(), poses.empty() ? nullptr : poses.data(), static_cast<uint32_t>(colliders.size()),
                                distance, vertices.data(), most, &count));
    vertices.resize(count);
    return vertices;
  }

  SwModelInfo info() const {
    SwModelInfo info = detail::initialized<SwModelInfo>();
    check(sw_model_info(get(), &info));
    return info;
  }

  /* Hertz, ascending, one for each mode. */
  std::vector<double> frequencies() const {
    uint32_t count = 0;
    check(sw_model_frequencies(get(), nullptr, 0, &count));
    std::vector<double> hertz(count);
    check(sw_model_frequencies(get(), hertz.data(), count, &count));
    return hertz;
  }

  /* The methods that were tried for SW_METHOD_AUTO. */
  std::vector<SwFrontPoint> front() const {
    uint32_t count = 0;
    check(sw_model_front(get(), nullptr, sizeof(SwFrontPoint), 0, &count));
    std::vector<SwFrontPoint> points(count);
    check(sw_model_front(get(), points.data(), sizeof(SwFrontPoint), count, &count));
    return points;
  }

  /* `shape` is SW_SHAPE_DISPLACEMENT or SW_SHAPE_ROTATION; out is n_vertices x 3. */
  void mode_shape(uint32_t mode, uint32_t shape, float *out, uint32_t n_vertices, uint64_t stride = 0) const {
    check(sw_model_mode_shape(get(), mode, shape, SW_FORMAT_F32, out, stride, n_vertices));
  }
  void mode_shape(uint32_t mode, uint32_t shape, double *out, uint32_t n_vertices, uint64_t stride = 0) const {
    check(sw_model_mode_shape(get(), mode, shape, SW_FORMAT_F64, out, stride, n_vertices));
  }

  /* Before precompute: this model is of the proxy's mesh. */
  inline SwCalibrationInfo calibrate(const Proxy &proxy, const SwCalibrationDesc &desc = calibration_desc());

  std::vector<unsigned char> save() const {
    uint64_t size = 0;
    check(sw_model_save(get(), nullptr, 0, &size));
    std::vector<unsigned char> bytes(size);
    check(sw_model_save(get(), bytes.data(), size, &size));
    return bytes;
  }
  static Model load(const std::vector<unsigned char> &bytes) {
    SwModel *model = nullptr;
    check(sw_model_load(bytes.data(), bytes.size(), &model));
    return Model(model);
  }

  SwModel *get() const noexcept { return handle_.get(); }

private:
  explicit Model(SwModel *model) noexcept : handle_(model) {}

  std::unique_ptr<SwModel, detail::Destroy> handle_;
};

/* Owns an SwCollider. Move only. States that have it go on with it when it is destroyed. */
class Collider {
public:
  explicit Collider(const SwColliderDesc &desc) {
    SwCollider *collider = nullptr;
    check(sw_collider_create(&desc, &collider));
    handle_.reset(collider);
  }

  std::vector<unsigned char> save() const {
    uint64_t size = 0;
    check(sw_collider_save(get(), nullptr, 0, &size));
    std::vector<unsigned char> bytes(size);
    check(sw_collider_save(get(), bytes.data(), size, &size));
    return bytes;
  }
  static Collider load(const std::vector<unsigned char> &bytes) {
    SwCollider *collider = nullptr;
    check(sw_collider_load(bytes.data(), bytes.size(), &collider));
    return Collider(collider);
  }

  SwCollider *get() const noexcept { return handle_.get(); }

private:
  explicit Collider(SwCollider *collider) noexcept : handle_(collider) {}

  std::unique_ptr<SwCollider, detail::Destroy> handle_;
};

/* Owns an SwBinding: points that follow the mesh of `model`, which may end before it. Move only. */
class Binding {
public:
  explicit Binding(const Model &model, const SwBindingDesc &desc) {
    SwBinding *binding = nullptr;
    check(sw_binding_create(model.get(), &desc, &binding));
    handle_.reset(binding);
  }

  SwBindingInfo info() const {
    SwBindingInfo info = detail::initialized<SwBindingInfo>();
    check(sw_binding_info(get(), &info));
    return info;
  }
  std::vector<unsigned char> save() const {
    uint64_t size = 0;
    check(sw_binding_save(get(), nullptr, 0, &size));
    std::vector<unsigned char> bytes(size);
    check(sw_binding_save(get(), bytes.data(), size, &size));
    return bytes;
  }
  static Binding load(const Model &model, const std::vector<unsigned char> &bytes) {
    SwBinding *binding = nullptr;
    check(sw_binding_load(model.get(), bytes.data(), bytes.size(), &binding));
    return Binding(binding);
  }

  SwBinding *get() const noexcept { return handle_.get(); }

private:
  explicit Binding(SwBinding *binding) noexcept : handle_(binding) {}

  std::unique_ptr<SwBinding, detail::Destroy> handle_;
};

/* Owns an SwProxy: a mesh to simulate in another's place. Move only. */
class Proxy {
public:
  Proxy(const SwMeshDesc &mesh, const SwProxyDesc &desc) {
    SwProxy *proxy = nullptr;
    check(sw_proxy_create(&mesh, &desc, &proxy));
    handle_.reset(proxy);
  }

  SwProxyInfo info() const {
    SwProxyInfo info = detail::initialized<SwProxyInfo>();
    check(sw_proxy_info(get(), &info));
    return info;
  }
  /* n_vertices x 3. */
  std::vector<double> positions() const {
    const uint32_t n = info().n_vertices;
    std::vector<double> positions(3 * std::size_t{n});
    check(sw_proxy_positions(get(), SW_FORMAT_F64, positions.data(), 0, n));
    return positions;
  }
  /* n_triangles x 3. */
  std::vector<uint32_t> triangles() const {
    const uint32_t n = info().n_triangles;
    std::vector<uint32_t> triangles(3 * std::size_t{n});
    check(sw_proxy_triangles(get(), triangles.data(), n));
    return triangles;
  }
  /* Of each vertex, three vertices of the asset and their weights (n_vertices x 3 each). */
  void sources(std::vector<uint32_t> &vertices, std::vector<double> &weights) const {
    const uint32_t n = info().n_vertices;
    vertices.resize(3 * std::size_t{n});
    weights.resize(3 * std::size_t{n});
    check(sw_proxy_sources(get(), vertices.data(), weights.data(), n));
  }
  /* Of each vertex of the asset, the nearest of the proxy. */
  std::vector<uint32_t> nearest() const {
    std::vector<uint32_t> vertices(info().n_asset_vertices);
    check(sw_proxy_nearest(get(), vertices.data(), static_cast<uint32_t>(vertices.size())));
    return vertices;
  }

  SwProxy *get() const noexcept { return handle_.get(); }

private:
  std::unique_ptr<SwProxy, detail::Destroy> handle_;
};

inline SwCalibrationInfo Model::calibrate(const Proxy &proxy, const SwCalibrationDesc &desc) {
  SwCalibrationInfo info = detail::initialized<SwCalibrationInfo>();
  check(sw_model_calibrate(get(), proxy.get(), &desc, &info));
  return info;
}

/* A small capsule about packed points (n x 3). */
inline SwCapsuleFit fit_capsule(const double *points, uint32_t n) {
  SwCapsuleFit fit = detail::initialized<SwCapsuleFit>();
  check(sw_fit_capsule(SW_FORMAT_F64, points, 0, n, &fit));
  return fit;
}

/* q and its time derivative, one entry for each mode. */
struct Amplitudes {
  std::vector<double> value, velocity;
};

/* Owns an SwState. Move only; clone() copies. May outlive the model it was made from. */
class State {
public:
  explicit State(const Model &model, const SwStateDesc &desc = state_desc()) {
    SwState *state = nullptr;
    check(sw_state_create(model.get(), &desc, &state));
    handle_.reset(state);
  }

  State clone() const {
    SwState *copy = nullptr;
    check(sw_state_clone(get(), &copy));
    return State(copy);
  }

  void reset() { check(sw_state_reset(get())); }
  void set_gravity(double x, double y, double z) {
    const double gravity[3] = {x, y, z};
    check(sw_state_set_gravity(get(), gravity));
  }
  void set_damping(const SwDampingDesc &desc) { check(sw_state_set_damping(get(), &desc)); }
  void set_frame(const SwFrameDesc &desc) { check(sw_state_set_frame(get(), &desc)); }
  /* Where supports are at the end of the next step: world positions of all vertices (n_vertices x 3), of which those of supports are read. */
  void move_supports(const float *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_move_supports(get(), SW_FORMAT_F32, positions, 0, n_vertices, flags));
  }
  void move_supports(const double *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_move_supports(get(), SW_FORMAT_F64, positions, 0, n_vertices, flags));
  }
  /* Where the rest shape is at the end of the next step: world positions of all vertices (n_vertices x 3). */
  void move_rest(const float *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_move_rest(get(), SW_FORMAT_F32, positions, 0, n_vertices, flags));
  }
  void move_rest(const double *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_move_rest(get(), SW_FORMAT_F64, positions, 0, n_vertices, flags));
  }
  /* The mesh is the rest shape again. */
  void clear_rest() { check(sw_state_move_rest(get(), SW_FORMAT_F64, nullptr, 0, 0, 0)); }
  void set_amplitudes(const double *amplitudes, const double *velocities, uint32_t count) {
    check(sw_state_set_amplitudes(get(), amplitudes, velocities, count));
  }
  /* The nearest pose to positions (n_vertices x 3) and velocities (as many, or null: at rest in the frame). Returns how far the vertices
     are from it: the root of the mean square, weighted by mass. */
  double set_pose(const float *positions, uint32_t n_vertices, const float *velocities = nullptr,
                  uint32_t space = SW_SPACE_WORLD) {
    double missed = 0;
    check(sw_state_set_pose(get(), space, SW_FORMAT_F32, positions, 0, velocities, 0, n_vertices, &missed));
    return missed;
  }
  double set_pose(const double *positions, uint32_t n_vertices, const double *velocities = nullptr,
                  uint32_t space = SW_SPACE_WORLD) {
    double missed = 0;
    check(sw_state_set_pose(get(), space, SW_FORMAT_F64, positions, 0, velocities, 0, n_vertices, &missed));
    return missed;
  }
  void set_constraint(const SwConstraintDesc &desc) { check(sw_state_set_constraint(get(), &desc)); }
  /* SW_ALL_CONSTRAINTS removes them all. */
  void clear_constraint(uint32_t id) { check(sw_state_clear_constraint(get(), id)); }
  /* All that were set before are replaced. */
  void set_forces(const SwForceDesc &desc) { check(sw_state_set_forces(get(), &desc)); }
  void clear_forces() { set_forces(force_desc()); }
  void set_wind(const SwWindDesc &desc) { check(sw_state_set_wind(get(), &desc)); }
  void clear_wind() { set_wind(wind_desc()); }
  /* All that were set before are replaced; Collider::get() each. */
  void set_colliders(const std::vector<const SwCollider *> &colliders) {
    check(sw_state_set_colliders(get(), colliders.data(), static_cast<uint32_t>(colliders.size())));
  }
  /* Where one of them is at the end of the next step. */
  void move_collider(uint32_t collider, const SwColliderPoseDesc &desc) {
    check(sw_state_move_collider(get(), collider, &desc));
  }
  /* Packed positions (n_vertices x 3) of a collider of SW_COLLIDER_DEFORMING_MESH at the end of the next step. */
  void deform_collider(uint32_t collider, const double *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_deform_collider(get(), collider, flags, SW_FORMAT_F64, positions, 0, n_vertices));
  }
  void deform_collider(uint32_t collider, const float *positions, uint32_t n_vertices, uint32_t flags = 0) {
    check(sw_state_deform_collider(get(), collider, flags, SW_FORMAT_F32, positions, 0, n_vertices));
  }
  void set_stiffness(double factor) { check(sw_state_set_stiffness(get(), factor)); }
  /* Sets the stiffness by which the slowest mode that swings has this frequency; returns the factor. */
  double set_frequency(double hertz) {
    double factor = 0;
    check(sw_state_set_frequency(get(), hertz, &factor));
    return factor;
  }
  /* Sets the stiffness by which the shell sags so far under the present loads, where the state then is; returns the factor. */
  double set_sag(double length, double tolerance = 0) {
    double factor = 0;
    check(sw_state_set_sag(get(), length, tolerance, &factor));
    return factor;
  }
  void set_rest_tolerance(double length) { check(sw_state_set_rest_tolerance(get(), length)); }
  void step(double seconds) { check(sw_state_step(get(), seconds)); }

  /* Moves to the static solution and tells how it was found. Throws, and nothing has moved, where there is none. */
  SwEquilibriumReport equilibrium() {
    SwEquilibriumReport report = detail::initialized<SwEquilibriumReport>();
    check(sw_state_equilibrium(get(), &report));
    return report;
  }
  /* The same; `watch`, called with what an iteration leaves of the force, may stop it by returning false: then nothing has moved. */
  template <class Watch>
  SwEquilibriumReport equilibrium(Watch &&watch) {
    SwEquilibriumReport report = detail::initialized<SwEquilibriumReport>();
    check(sw_state_equilibrium_watched(get(), &report, detail::asks<std::remove_reference_t<Watch>>, detail::watched(watch)));
    return report;
  }

  Amplitudes amplitudes() const {
    uint32_t count = 0;
    check(sw_state_amplitudes(get(), nullptr, nullptr, 0, &count));
    Amplitudes q{std::vector<double>(count), std::vector<double>(count)};
    check(sw_state_amplitudes(get(), q.value.data(), q.velocity.data(), count, &count));
    return q;
  }

  /* out is n_vertices x 3. */
  void positions(float *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_positions(get(), space, SW_FORMAT_F32, out, stride, n_vertices));
  }
  void positions(double *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_positions(get(), space, SW_FORMAT_F64, out, stride, n_vertices));
  }
  /* The positions of `vertices` alone, in their order; out is n x 3. */
  void positions_of(const uint32_t *vertices, uint32_t n, float *out, uint32_t space = SW_SPACE_WORLD,
                    uint64_t stride = 0) const {
    check(sw_state_positions_of(get(), space, SW_FORMAT_F32, vertices, n, out, stride));
  }
  void positions_of(const uint32_t *vertices, uint32_t n, double *out, uint32_t space = SW_SPACE_WORLD,
                    uint64_t stride = 0) const {
    check(sw_state_positions_of(get(), space, SW_FORMAT_F64, vertices, n, out, stride));
  }
  void normals(float *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_normals(get(), space, SW_FORMAT_F32, out, stride, n_vertices));
  }
  void normals(double *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_normals(get(), space, SW_FORMAT_F64, out, stride, n_vertices));
  }
  /* out is n_vertices x 4: unit quaternions w x y z. */
  void rotations(float *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_rotations(get(), space, SW_FORMAT_F32, out, stride, n_vertices));
  }
  void rotations(double *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    check(sw_state_rotations(get(), space, SW_FORMAT_F64, out, stride, n_vertices));
  }

  /* Reads points of a binding into the arrays of `desc`. */
  void bound_points(const Binding &binding, const SwBoundPointsDesc &desc) const {
    check(sw_state_bound_points(get(), binding.get(), &desc));
  }

  /* Newton steps of the full shell that go on from frame to frame, for output alone: once after a frame's steps, before positions_corrected. SW_STEPS_AUTO, for
     both, is for equilibria that fields do not hold. */
  void correct(uint32_t steps) { check(sw_state_correct(get(), steps)); }
  /* The same, with a `watch` as of `equilibrium`. */
  template <class Watch>
  void correct(uint32_t steps, Watch &&watch) {
    check(sw_state_correct_watched(get(), steps, detail::asks<std::remove_reference_t<Watch>>, detail::watched(watch)));
  }

  /* Where `correct` led, or else after `steps` Newton steps of the full shell, for output alone. */
  void positions_corrected(uint32_t steps, double *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD,
                           uint64_t stride = 0) const {
    check(sw_state_positions_corrected(get(), steps, space, SW_FORMAT_F64, out, stride, n_vertices));
  }
  void positions_corrected(uint32_t steps, float *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD,
                           uint64_t stride = 0) const {
    check(sw_state_positions_corrected(get(), steps, space, SW_FORMAT_F32, out, stride, n_vertices));
  }

  /* Where they are for the eye: out of colliders, cosmetic. Returns how deep a vertex still is. */
  double positions_outside(double *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    double deepest = 0;
    check(sw_state_positions_outside(get(), space, SW_FORMAT_F64, out, stride, n_vertices, &deepest));
    return deepest;
  }
  double positions_outside(float *out, uint32_t n_vertices, uint32_t space = SW_SPACE_WORLD, uint64_t stride = 0) const {
    double deepest = 0;
    check(sw_state_positions_outside(get(), space, SW_FORMAT_F32, out, stride, n_vertices, &deepest));
    return deepest;
  }

  SwStateReport report() const {
    SwStateReport report = detail::initialized<SwStateReport>();
    check(sw_state_report(get(), &report));
    return report;
  }

  /* How far the state is from the full nonlinear shell, by an estimate. */
  SwCertificate certify() const {
    SwCertificate certificate = detail::initialized<SwCertificate>();
    check(sw_state_certify(get(), &certificate));
    return certificate;
  }
  /* The same; `watch`, called with what an iteration leaves of the force, may stop it by returning false. */
  template <class Watch>
  SwCertificate certify(Watch &&watch) const {
    SwCertificate certificate = detail::initialized<SwCertificate>();
    check(sw_state_certify_watched(get(), &certificate, detail::asks<std::remove_reference_t<Watch>>, detail::watched(watch)));
    return certificate;
  }
  /* Goes on by the paper's warp where that is nearer to it; of the method that goes on, which it names. */
  SwCertificate fall_back() {
    SwCertificate certificate = detail::initialized<SwCertificate>();
    check(sw_state_fall_back(get(), &certificate));
    return certificate;
  }
  template <class Watch>
  SwCertificate fall_back(Watch &&watch) {
    SwCertificate certificate = detail::initialized<SwCertificate>();
    check(sw_state_fall_back_watched(get(), &certificate, detail::asks<std::remove_reference_t<Watch>>, detail::watched(watch)));
    return certificate;
  }
  /* Goes on by another SW_METHOD_... from the nearest pose. */
  void set_method(uint32_t method) { check(sw_state_set_method(get(), method)); }

  /* What a step of that length uses and leaves out, at what cost; and the same as a table. */
  std::vector<SwPlanPart> plan(double seconds) const {
    uint32_t count = 0;
    check(sw_state_plan(get(), seconds, nullptr, sizeof(SwPlanPart), 0, &count));
    std::vector<SwPlanPart> parts(count);
    check(sw_state_plan(get(), seconds, parts.data(), sizeof(SwPlanPart), count, &count));
    return parts;
  }
  std::string plan_text(double seconds) const {
    uint64_t size = 0;
    check(sw_state_plan_text(get(), seconds, nullptr, 0, &size));
    std::string text(size, '\0');
    check(sw_state_plan_text(get(), seconds, &text[0], size, &size));
    text.resize(size - 1);  // the NUL
    return text;
  }

  /* What the last step made of each constraint, by ascending id. */
  std::vector<SwConstraintReport> constraint_report() const {
    uint32_t count = 0;
    check(sw_state_constraint_report(get(), nullptr, sizeof(SwConstraintReport), 0, &count));
    std::vector<SwConstraintReport> reports(count);
    check(sw_state_constraint_report(get(), reports.data(), sizeof(SwConstraintReport), count, &count));
    return reports;
  }

  /* Where the shell touched at the end of the last step. */
  std::vector<SwContact> contacts() const {
    uint32_t count = 0;
    check(sw_state_contacts(get(), nullptr, sizeof(SwContact), 0, &count));
    std::vector<SwContact> contacts(count);
    check(sw_state_contacts(get(), contacts.data(), sizeof(SwContact), count, &count));
    return contacts;
  }

  std::vector<unsigned char> save() const {
    uint64_t size = 0;
    check(sw_state_save(get(), nullptr, 0, &size));
    std::vector<unsigned char> bytes(size);
    check(sw_state_save(get(), bytes.data(), size, &size));
    return bytes;
  }
  void load(const std::vector<unsigned char> &bytes) { check(sw_state_load(get(), bytes.data(), bytes.size())); }

  SwState *get() const noexcept { return handle_.get(); }

private:
  explicit State(SwState *state) noexcept : handle_(state) {}

  std::unique_ptr<SwState, detail::Destroy> handle_;
};

}  // namespace shellwarp

#endif

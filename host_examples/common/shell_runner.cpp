// What an evaluation does, and when a model or a run begins anew.
#include "shell_runner.hpp"

#include "hash.hpp"
#include "request_checks.hpp"
#include "runner_at.hpp"
#include "runner_keys.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace host {

Frames ShellRunner::frames() const {
  if (!model_ || !state_ || cache_.size() == 0) throw HostError("there are no frames yet: play from the start frame");
  Frames all;
  all.build_key = build_key_, all.motion_key = motion_key_, all.method = method_, all.unit = unit_;
  all.support_fields = needs_support_fields_;
  all.near_key = near_key_, all.near = near_;
  all.rest = model_->rest();
  all.model = model_->model().save();
  all.entries = cache_.all();
  for (StateCache::Entry &entry : all.entries) entry.seen.reset();
  return all;
}

void ShellRunner::adopt(Frames frames) {
  needs_support_fields_ = frames.support_fields;
  near_key_ = frames.near_key, near_ = frames.near, near_place_ = 0;
  notes_.stored_of_others = false;
  stored_ = std::make_unique<Frames>(std::move(frames));
  model_.reset();
  state_.reset();
  cache_.drop_from(0);
}

// The model of the frames on disk, where they are of this mesh: at the start frame of its very points.
bool ShellRunner::take_stored(const Mesh &mesh, const Request &request, const At &at) {
  if (!stored_ || stored_->build_key != build_key(request.mesh, request.build)) return false;
  const bool other_points = at.start() && Hash().add_all(mesh.points).value() != Hash().add_all(stored_->rest).value();
  if (other_points || stored_->rest.size() != mesh.points.size()) return false;
  model_ = std::make_shared<const ShellModel>(stored_->rest, !request.build.held.empty() || !request.build.axis_supports.empty(), stored_->model);
  return true;
}

void ShellRunner::evaluate(Request request) {
  check_motion(request);
  check_output(request);
  const At at(request);
  proxy_.take_place(request, at.start());
  check_place(request);
  if (!request.drawn.empty()) follower_.lead(request, at.start());
  run(request, at);
}

void ShellRunner::run(Request &request, const At &at) {
  const uint32_t support_fields = request.build.support_fields;
  if (!needs_support_fields_ || !request.follow) request.build.support_fields = 0;
  check_build(request.mesh, request.build);
  correction_steps_ = request.correction_steps;
  check_handles(request);
  check_wind(request);
  check_map(request.mesh, "damping", request.motion.damping_map, true);
  check_forces(request);
  for (double &f : request.inputs.forces) f *= force_scale(request.build.stiffness);
  request.inputs.stiffness_factor = static_cast<double>(static_cast<float>(request.inputs.stiffness_factor));  // as a frame keeps it
  request.inputs.wind.density = air_density(request.build.stiffness, request.inputs.wind.density);
  notes_.maps_unused = unused_maps(request.build.stiffness);
  find_patches(request, at);
  find_sag_gravity(request, at);
  const bool built = !model_serves(request, at);
  if (built) build(request, at);
  follow(request, at, built);
  prepare_state(request);
  move_supports(request, at);
  try {
    show(request, at);
  } catch (const Apart &apart) {
    request.build.support_fields = support_fields;
    build_support_fields(request, at, apart.what());
    show(request, at);
  }
}

// Contact patches near the colliders, as these are at the start frame, or where they are first seen.
void ShellRunner::find_patches(Request &request, const At &at) {
  Build &build = request.build;
  if (!(build.patches_near > 0) || request.inputs.colliders.empty()) return;
  const uint64_t key = Hash().add(build_key(request.mesh, build)).add(build.patches_near).add(build.most_patches).value();
  if (at.start() || key != near_key_) {
    const double unit = request.inputs.object.scale;
    if (colliders_.prepare(request.inputs.colliders, unit)) other_solids_ = true;
    const std::vector<double> poses = colliders_.poses(request.inputs, inverse(request.inputs.object));
    Hash place;
    place.add(key).add_all(request.mesh.points).add_all(poses).add(unit);
    for (const Collider &collider : request.inputs.colliders) place.add(shape_key(collider));
    if (place.value() != near_place_) {
      near_ = patches_near(request.mesh, build, colliders_.solids(), poses, build.patches_near / unit);
      near_key_ = key, near_place_ = place.value();
    }
  }
  if (near_.empty())
    throw HostError("contact patches: no vertex that moves is within " + number(build.patches_near) + " of a collider at the start frame");
  std::vector<uint32_t> &patches = build.contact_patches;
  for (const uint32_t v : near_)
    if (std::find(patches.begin(), patches.end(), v) == patches.end()) patches.push_back(v);
}

// By sag: the gravity that the shell hangs under is that of the start frame, or of where it is first seen.
void ShellRunner::find_sag_gravity(Request &request, const At &at) {
  if (request.build.stiffness.by != Stiffness::By::sag) {
    sag_gravity_.reset();
    return;
  }
  if (at.start() || !sag_gravity_) {
    Pose back = request.inputs.frame;
    back.origin = {}, back.scale = 1;
    sag_gravity_ = host::apply(inverse(back), request.inputs.gravity);
    for (double &g : *sag_gravity_) g /= request.inputs.object.scale;
  }
  request.build.stiffness.sag_gravity = *sag_gravity_;
}

void ShellRunner::prepare_state(Request &request) {
  std::vector<Collider> &touched = request.inputs.colliders;
  if (colliders_.prepare(touched, request.inputs.object.scale)) other_solids_ = true;
  const bool other_solids = std::exchange(other_solids_, false);
  if (other_solids) cache_.forget_inputs();  // they were for the solids of before
  const uint64_t motion_key = key_of(request);
  const bool again = !state_ || motion_key != motion_key_;
  if (again) {
    restart(request);
    motion_key_ = motion_key;
    if (stored_) {
      notes_.stored_of_others = !stored_serves_ || stored_->motion_key != motion_key;
      if (!notes_.stored_of_others) cache_.put(std::move(stored_->entries)), unit_ = stored_->unit;
      fresh_ = state_->save();
      stored_.reset();
    }
  }
  if (other_solids || (again && !touched.empty())) state_->set_colliders(colliders_.solids());
}

// The rest shape is that of what is simulated: where another mesh follows, that one's own motion would go by unseen.
void ShellRunner::check_led(const Request &request) const {
  const bool still = request.mesh.points == model_->rest();
  if (!request.drawn.empty() && request.proxy.vertices == 0 && still && follower_.bound() && request.drawn != follower_.rest())
    throw HostError("the rest shape is to follow, and is that of the proxy, which stands still while the mesh that follows it moves: deform the proxy as well");
}

void ShellRunner::move_supports(Request &request, const At &at) {
  replaces_ = request.follow && !request.build.held.empty() && !at.before;
  if (!replaces_) return;
  if (request.follow_rest) {
    check_led(request);
    request.inputs.rest = request.mesh.points;
    return;
  }
  if (request.drawn.empty()) {
    request.inputs.supports = places_.read(request.mesh.points, model_->rest());
    return;
  }
  std::vector<double> points = request.mesh.points;
  follower_.carry(request, model_->rest(), points);
  request.inputs.supports = places_.read(points, model_->rest());
}

// A model with support fields, and the frames so far by it: supports that move as one need none.
void ShellRunner::build_support_fields(Request &request, const At &at, const std::string &apart) {
  const Build &build = request.build;
  const std::string why = "held vertices move against each other (" + apart + "): ";
  if (!follows_by_fields(build.method))
    throw HostError(why + method_name(build.method) + " follows them as one only; take the warp or a full shell, or switch follow off");
  if (build.support_fields == 0) throw HostError(why + "set the support fields, 24 suit most");
  const Stiffness::By by = build.stiffness.by;
  if (build.clamped && (by == Stiffness::By::preset || by == Stiffness::By::sheet))
    throw HostError(why + "clamped supports of a real material cannot follow; hold two rows of vertices, hinged");
  try {
    this->build(request, at);
  } catch (const shellwarp::Error &error) {
    throw HostError(why + error.what());
  }
  needs_support_fields_ = true;
  const std::vector<StateCache::Entry> before = cache_.take();
  follow(request, at, true);
  prepare_state(request);
  replay(request, before);
}

// What is drawn is bound to a new model, and anew at the start frame where it has changed. Velocities of the mesh itself need a binding
// too.
void ShellRunner::follow(const Request &request, const At &at, bool built) {
  const bool other = !request.drawn.empty();
  if (!other && !request.velocities) {
    follower_.release();
    drawn_key_ = 0;
    return;
  }
  const bool as_before = built && !at.start() && other && drawn_key_ != 0 && follower_.rest().size() == request.drawn.size();
  const std::vector<double> &points = as_before ? follower_.rest() : other ? request.drawn : model_->rest();
  const bool same = !built && follower_.bound() && other == (drawn_key_ != 0) && points.size() == follower_.rest().size();
  const uint64_t key = other ? Hash().add_all(points).value() | 1 : 0;
  if (same && (!at.start() || key == drawn_key_)) return;
  follower_.bind(model_->model(), points);
  drawn_key_ = key;
}

bool ShellRunner::model_serves(const Request &request, const At &at) const {
  if (!model_ || build_key_ != build_key(request.mesh, request.build)) return false;
  return !at.start() || rest_key_ == Hash().add_all(request.mesh.points).value();
}

// The old model stays in use until the new one is there. The rest shape stays as well where the faces do, but at the start frame.
void ShellRunner::build(const Request &request, const At &at) {
  Mesh mesh = request.mesh;
  const uint64_t faces_key = Hash().add_all(mesh.faces()).add_all(mesh.sizes).value();
  if (model_ && !at.start() && faces_key == faces_key_ && mesh.n_points() == model_->n_points()) mesh.points = model_->rest();
  stored_serves_ = take_stored(mesh, request, at);
  if (stored_serves_) mesh.points = stored_->rest;
  mesh.cut();
  const Vec3 &g = request.inputs.gravity;
  const double gravity = std::hypot(g[0], g[1], g[2]) / request.inputs.object.scale;
  if (!stored_serves_) {
    auto model = std::make_shared<const ShellModel>(mesh, request.build, gravity, request.interrupted, request.progress);
    model->clock(request.build.stiffness);
    model_ = std::move(model);
    ++notes_.builds;
  }
  places_.prepare(mesh, request.build);
  build_key_ = build_key(request.mesh, request.build);
  rest_key_ = Hash().add_all(mesh.points).value();
  faces_key_ = faces_key;
  state_.reset();
  notes_.floats = model_->floats();
  notes_.uncalibrated = model_->uncalibrated();
}

void ShellRunner::restart(const Request &request) {
  const Motion &motion = request.motion;
  const double clock = model_->clock(request.build.stiffness);
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = request.build.method;
  desc.integrator = motion.implicit_euler ? SW_INTEGRATOR_IMPLICIT_EULER : SW_INTEGRATOR_SECOND_ORDER;  // of modes the exact one
  shellwarp::State state(model_->model(), desc);
  SwDampingDesc slows = damping(motion.damping_ratio, motion.damping_mass / clock, motion.damping_stiffness * clock);
  slows.factors = motion.damping_map.data(), slows.factor_format = SW_FORMAT_F64;
  slows.n_factors = static_cast<uint32_t>(motion.damping_map.size());
  state.set_damping(slows);
  state_ = std::move(state);
  live_ = kLoaded;
  fresh_.clear();
  cache_.drop_from(0);
  method_ = request.build.method;
  clock_ = clock;
  frame_time_ = 1 / motion.frame_rate;
}

}  // namespace host

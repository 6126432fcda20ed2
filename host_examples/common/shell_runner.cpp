#include "shell_runner.hpp"

#include "hash.hpp"
#include "request_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace host {

namespace {

// A sentence; the frame is whole without it.
std::string certificate_of(const shellwarp::State &state, const std::function<bool()> &interrupted) {
  try {
    const SwCertificate found = state.certify([&interrupted](double) {
      try {
        return !interrupted || !interrupted();
      } catch (...) {
        return false;  // a host that cannot even be asked is not kept waiting
      }
    });
    const double percent = 100 * found.error;
    return "certified: about " + number(percent < 10 ? std::round(100 * percent) / 100 : std::round(percent)) +
           " % off the full nonlinear shell" + (found.remaining > 0.01 ? ", roughly" : "");
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) return "not certified: stopped by the user";
    return std::string("not certified: ") + error.what();
  }
}

// Whole frames to within this: hosts round times (Maya to 1/141120000 s, Houdini to double precision).
constexpr double kWholeFrame = 1e-4;

// The number of colliders belongs to the run: a saved state has a place for each.
uint64_t key_of(const Request &request) {
  const Motion &m = request.motion;
  const Build &build = request.build;
  const Stiffness &stiffness = build.stiffness;
  return Hash()
      .add(build.method)
      .add(m.implicit_euler)
      .add(m.damping_ratio)
      .add(m.damping_mass)
      .add(m.damping_stiffness)
      .add_all(m.damping_map)
      .add(m.start_time)
      .add(m.frame_rate)
      .add(stiffness.by)
      .add(stiffness.frequency)
      .add(request.inputs.colliders.size())
      .add(request.follow && request.follow_rest)
      .value();
}

void add(Hash &hash, const Pose &pose) { hash.add_all(pose.origin).add_all(pose.rotation).add(pose.scale); }

uint64_t key_of(const Inputs &inputs) {
  Hash hash;
  hash.add_all(inputs.rest).add_all(inputs.forces).add_all(inputs.gravity).add(inputs.stiffness_factor).add_all(inputs.supports);
  const Wind &wind = inputs.wind;
  hash.add_all(wind.velocity).add(wind.density).add(wind.normal_drag).add(wind.tangential_drag);
  add(hash, inputs.object);
  add(hash, inputs.frame);
  for (const Handle &handle : inputs.handles) {
    add(hash, handle.target);
    hash.add(handle.vertex).add(handle.position).add(handle.orientation).add(handle.compliance).add(handle.axes).add(handle.held);
  }
  for (const Collider &collider : inputs.colliders) {
    add(hash, collider.pose);
    hash.add(shape_key(collider));
  }
  return hash.value();
}

}  // namespace

// The last whole frame, and how much of one has gone by since.
struct ShellRunner::At {
  uint64_t frame = 0;
  double fraction = 0;
  bool before = false;  // the start

  explicit At(const Request &request) {
    const double frames = (request.time - request.motion.start_time) * request.motion.frame_rate;
    before = frames < -kWholeFrame;
    if (frames <= kWholeFrame) return;
    if (!(frames < static_cast<double>(StateCache::limit)))
      throw HostError("this is " + number(frames) + " frames after the start, too far: the most is " + number(StateCache::limit - 1) +
                      "; is the start frame right?");
    frame = static_cast<uint64_t>(frames + kWholeFrame);
    fraction = frames - static_cast<double>(frame);
    if (fraction < kWholeFrame) fraction = 0;
  }

  bool start() const { return frame == 0 && fraction == 0 && !before; }
};

const std::vector<double> &ShellRunner::rest() const {
  static const std::vector<double> none;
  if (drawn_key_ != 0 && follower_.bound()) return follower_.rest();
  return model_ ? model_->rest() : none;
}

uint64_t ShellRunner::bytes() const {
  uint64_t sum = cache_.size() * cache_.bytes_per_frame() + cache_.bytes_of_shapes() + follower_.bytes();
  sum += (deformed_.capacity() + velocities_.capacity()) * sizeof(double);
  if (!model_) return sum;
  const SwModelInfo info = model_->model().info();
  return sum + info.bytes_model + info.bytes_state + model_->rest().capacity() * sizeof(double);
}

std::string ShellRunner::certificate(const std::function<bool()> &interrupted) const {
  if (!state_ || cache_.size() == 0) throw HostError("there are no frames yet: play from the start frame");
  return certificate_of(*state_, interrupted);
}

Frames ShellRunner::frames() const {
  if (!model_ || !state_ || cache_.size() == 0) throw HostError("there are no frames yet: play from the start frame");
  Frames all;
  all.build_key = build_key_, all.motion_key = motion_key_, all.method = method_, all.unit = unit_;
  all.support_fields = needs_support_fields_;
  all.rest = model_->rest();
  all.model = model_->model().save();
  all.entries = cache_.all();
  for (StateCache::Entry &entry : all.entries) entry.seen.reset();
  return all;
}

void ShellRunner::adopt(Frames frames) {
  needs_support_fields_ = frames.support_fields;
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
  if (!request.drawn.empty()) request.proxy.vertices = 0;  // there is one
  proxy_.take_place(request, at.start());
  check_place(request);
  check_rest(request);
  if (!request.drawn.empty()) follower_.lead(request, at.start());
  run(request, at);
}

void ShellRunner::run(Request &request, const At &at) {
  const uint32_t support_fields = request.build.support_fields;
  if (!needs_support_fields_ || !request.follow) request.build.support_fields = 0;
  check_build(request.mesh, request.build);
  check_handles(request);
  check_wind(request.inputs.wind);
  check_map(request.mesh, "damping", request.motion.damping_map, true);
  check_forces(request);
  for (double &f : request.inputs.forces) f *= force_scale(request.build.stiffness);
  request.inputs.stiffness_factor = static_cast<double>(static_cast<float>(request.inputs.stiffness_factor));  // as a frame keeps it
  request.inputs.wind.density = air_density(request.build.stiffness, request.inputs.wind.density);
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

void ShellRunner::prepare_state(Request &request) {
  std::vector<Collider> &touched = request.inputs.colliders;
  const bool other_solids = colliders_.prepare(touched, request.inputs.object.scale);
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

void ShellRunner::show(const Request &request, const At &at) {
  reach(request, at.frame, at.fraction == 0);
  if (at.fraction > 0) {
    shellwarp::State copy = state_->clone();
    const bool before = led_;
    led_ = step(copy, request.inputs, at.fraction, false);
    read(copy, request, at);
    led_ = before;
  } else {
    read(*state_, request, at);
  }
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

void ShellRunner::replay(const Request &request, const std::vector<StateCache::Entry> &before) {
  live_ = kLoaded;
  if (before.empty() || !before[0].seen || !before[0].exact) return;
  begin(*before[0].seen, before[0].inputs, true);
  for (uint64_t k = 1; k < before.size() && before[k].seen && before[k].exact; ++k) {
    if (request.interrupted && request.interrupted()) throw Interrupted();
    advance(*before[k].seen, before[k].inputs, k, true, false);
  }
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
}

void ShellRunner::restart(const Request &request) {
  const Motion &motion = request.motion;
  const double clock = model_->clock(request.build.stiffness);
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = request.build.method;
  desc.integrator = motion.implicit_euler ? SW_INTEGRATOR_IMPLICIT_EULER : SW_INTEGRATOR_EXACT;
  shellwarp::State state(model_->model(), desc);
  SwDampingDesc slows =
      damping(request.build.method, motion.damping_ratio, motion.damping_mass / clock, motion.damping_stiffness * clock, model_->slowest());
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

void ShellRunner::begin(const Inputs &inputs, uint64_t key, bool exact) {
  cache_.drop_from(0);
  unit_ = inputs.object.scale;
  led_ = false;
  state_->set_stiffness(1);
  if (fresh_.empty())
    fresh_ = state_->save();
  else
    state_->load(fresh_);  // supports that were led are where they belong
  state_->set_stiffness(inputs.stiffness_factor);
  state_->clear_constraint(SW_ALL_CONSTRAINTS);
  SwFrameDesc frame = frame_of(inputs);
  frame.flags = SW_FRAME_TELEPORT;
  state_->set_frame(frame);
  if (!inputs.rest.empty()) led_ = stand(*state_, inputs, true);  // before: a first step from there then feels its motion
  state_->reset();
  live_ = 0;
  if (inputs.supports.empty()) {
    state_->set_frame(frame);
  } else {
    led_ = stand(*state_, inputs, true);  // the first to be moved after a reset are simply placed
    if (is_full_shell(method_)) state_->equilibrium();  // it has its supports moved and nothing else
  }
  colliders_.place(*state_, inputs, unit_, true);
  cache_.store(0, {state_->save(), key, 0, 0, static_cast<float>(inputs.stiffness_factor), exact, led_, seen(inputs, 0, key)});
}

// Leaves the state at the frame. For a sub-frame the inputs are not the frame's own, so a frame that is there is taken as it is.
void ShellRunner::reach(const Request &request, uint64_t frame, bool own_inputs) {
  const uint64_t key = key_of(request.inputs);
  if (const StateCache::Entry *entry = cache_.find(frame)) {
    const StateCache::Entry *before = frame > 0 ? cache_.find(frame - 1) : nullptr;
    const bool can_be_better = !entry->exact && (frame == 0 || (before && before->exact));
    if (!own_inputs || (entry->inputs == key && !can_be_better)) {
      return_to(request, frame);
      notes_.jumped = !cache_.find(frame)->exact;
      return;
    }
    cache_.drop_from(frame);
  }
  if (!cache_.find(0)) begin(request.inputs, key, frame == 0 && own_inputs);
  if (frame > 0)
    step_to(request, frame, key);
  else
    missed_ = 0, deepest_ = 0;
  notes_.jumped = !cache_.find(frame)->exact;
}

// A state has where solids are, and not how they are deformed: what is not known of that is as it is now.
void ShellRunner::load(const StateCache::Entry &entry, const Inputs &inputs) {
  state_->set_stiffness(static_cast<double>(entry.stiffness));
  state_->load(entry.state);
  missed_ = entry.missed;
  deepest_ = entry.deepest;
  led_ = entry.led;
  colliders_.deform(*state_, entry.seen ? *entry.seen : inputs, unit_, true);
  live_ = kLoaded;
}

// The state at a frame that is there. Under a rest shape that moves it is what came there by itself, where frame by frame is known what led
// there; else the shape stands.
void ShellRunner::return_to(const Request &request, uint64_t frame) {
  const bool moves = !request.inputs.rest.empty();
  if (moves && live_ == frame) return;
  const StateCache::Entry wanted = *cache_.find(frame);
  if (moves && frame > 0 && wanted.exact && wanted.seen) {
    std::vector<StateCache::Entry> all = cache_.take(), before(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(frame) + 1);
    try {
      replay(request, before);
    } catch (...) {
      cache_.put(std::move(all));
      throw;
    }
    cache_.put(std::move(all));
    if (live_ == frame) return;
  }
  if (moves) stand(*state_, wanted.seen ? *wanted.seen : request.inputs, true);
  load(wanted, request.inputs);
  if (frame == 0) live_ = 0;  // nothing moves there
}

void ShellRunner::step_to(const Request &request, uint64_t frame, uint64_t key) {
  uint64_t from = 0;
  const StateCache::Entry base = *cache_.last_before(frame, from);
  return_to(request, from);
  if (std::abs(request.inputs.object.scale / unit_ - 1) > kWholeFrame)
    throw HostError("the object's scale is " + number(request.inputs.object.scale) + ", and was " + number(unit_) +
                    " at the start frame: a shell's size cannot be animated");
  const bool jump = frame > from + 1;
  const bool still = base.inputs == key;
  const bool shaped = base.seen || still || !ColliderSet::deforms(request.inputs.colliders);
  const bool rested = request.inputs.rest.empty() || live_ == from;
  const bool exact = base.exact && (!jump || still) && shaped && rested;
  for (uint64_t k = from + 1; k <= frame; ++k) {
    if (jump && request.interrupted && request.interrupted()) throw Interrupted();
    advance(request.inputs, key, k, exact, jump && !still && k == from + 1);
  }
}

void ShellRunner::advance(const Inputs &inputs, uint64_t key, uint64_t frame, bool exact, bool teleport) {
  led_ = step(*state_, inputs, 1, teleport);
  live_ = frame;
  ++notes_.steps;
  missed_ = 0;
  for (const SwConstraintReport &report : state_->constraint_report()) missed_ += report.met == 0;
  deepest_ = static_cast<float>(state_->report().deepest_penetration);
  cache_.store(frame, {state_->save(), key, missed_, deepest_, static_cast<float>(inputs.stiffness_factor), exact, led_, seen(inputs, frame, key)});
}

// One of its own for inputs that have changed alone.
std::shared_ptr<const Inputs> ShellRunner::seen(const Inputs &inputs, uint64_t frame, uint64_t key) const {
  if (!replaces_ && !ColliderSet::deforms(inputs.colliders)) return nullptr;
  const StateCache::Entry *before = frame > 0 ? cache_.find(frame - 1) : nullptr;
  if (before && before->seen && before->inputs == key) return before->seen;
  auto copy = std::make_shared<Inputs>(inputs);
  for (Collider &collider : copy->colliders) {
    const bool deforms = collider.kind == SW_COLLIDER_DEFORMING_MESH;
    Mesh mesh;
    if (deforms) mesh.points = std::move(collider.mesh.points);
    collider.mesh = std::move(mesh);
  }
  return copy;
}

void ShellRunner::read(const shellwarp::State &state, const Request &request, const At &at) {
  const SwStateReport report = state.report();
  const uint32_t space = led_ ? SW_SPACE_WORLD : SW_SPACE_FRAME;
  std::vector<double> points, velocities;
  double inside = at.fraction > 0 ? report.deepest_penetration : static_cast<double>(deepest_);
  if (follower_.bound()) points = follower_.read(state, space, request.velocities ? &velocities : nullptr);
  if (request.drawn.empty()) {
    points.resize(model_->rest().size());
    if (request.push_out)
      inside = state.positions_outside(points.data(), model_->n_points(), space);
    else if (request.correction_steps > 0 && !at.start())
      state.positions_corrected(request.correction_steps, points.data(), model_->n_points(), space);
    else
      state.positions(points.data(), model_->n_points(), space);
  }
  for (double &v : velocities) v *= clock_;
  if (led_) to_object(request, at, points, velocities);
  deformed_ = std::move(points);
  velocities_ = std::move(velocities);
  notes_.turn_in_range = report.turn_in_range == 1;
  notes_.max_rotation = report.max_rotation;
  notes_.turned_too_far = report.fraction_turned_too_far;
  notes_.handles_missed = missed_;
  notes_.rest_stretched = report.rest_stretch;
  notes_.inside = inside / model_->model().info().size;
  notes_.supports_missed = report.support_miss / model_->model().info().size;
  notes_.certified = request.certify ? certificate_of(state, request.interrupted) : "";
}

// The library's frame goes with supports that are led, so what is read of the world is taken to where the object stands. Its own motion
// over the last step is no velocity of the shell.
void ShellRunner::to_object(const Request &request, const At &at, std::vector<double> &points,
                            std::vector<double> &velocities) const {
  const Pose here = place_of(request.inputs), back = inverse(here);
  const auto turn_back = [&back](const Vec3 &v) { return host::apply({{}, back.rotation, 1}, v); };
  const uint64_t frame = at.fraction > 0 ? at.frame : at.frame - std::min<uint64_t>(at.frame, 1);
  const StateCache::Entry *last = cache_.find(frame);
  const Pose before = last && last->seen ? place_of(*last->seen) : here;
  const double seconds = frame_time_ * (at.fraction > 0 ? at.fraction : 1);
  const Vec3 turn = turn_of(product(here, inverse(before)).rotation);  // as the library has rates
  for (std::size_t i = 0; i < points.size(); i += 3) {
    const Vec3 world = {points[i], points[i + 1], points[i + 2]}, x = host::apply(back, world);
    std::copy(x.begin(), x.end(), &points[i]);
    if (velocities.empty()) continue;
    Vec3 v;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t p = (k + 1) % 3, q = (k + 2) % 3;
      const double turned = turn[p] * (world[q] - here.origin[q]) - turn[q] * (world[p] - here.origin[p]);
      v[k] = velocities[i + k] - (here.origin[k] - before.origin[k] + turned) / seconds;
    }
    const Vec3 turned = turn_back(v);
    std::copy(turned.begin(), turned.end(), &velocities[i]);
  }
}

}  // namespace host

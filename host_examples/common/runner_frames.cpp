// How a frame is reached: by a step, by the way there again, or from what is kept of it.
#include "runner_at.hpp"
#include "runner_keys.hpp"

#include <cmath>
#include <utility>

namespace host {

namespace {

template <class Search>
void search_unless_interrupted(const Search &search) {
  try {
    search();
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) throw Interrupted();
    throw;
  }
}

}  // namespace

void ShellRunner::begin(const Request &request, const Inputs &inputs, uint64_t key, bool exact) {
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
    if (is_full_shell(method_taken(method_, model_->model().info())))  // it has its supports moved and nothing else
      search_unless_interrupted([&] { state_->equilibrium(UntilInterrupted(request.interrupted)); });
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
  if (!cache_.find(0)) begin(request, request.inputs, key, frame == 0 && own_inputs);
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
    advance(request, request.inputs, key, k, exact, jump && !still && k == from + 1);
  }
}

void ShellRunner::advance(const Request &request, const Inputs &inputs, uint64_t key, uint64_t frame, bool exact, bool teleport) {
  live_ = kLoaded;  // should it not get there
  led_ = step(*state_, inputs, 1, teleport);
  correct(request);
  live_ = frame;
  ++notes_.steps;
  missed_ = 0;
  for (const SwConstraintReport &report : state_->constraint_report()) missed_ += report.met == 0;
  deepest_ = static_cast<float>(state_->report().deepest_penetration);
  cache_.store(frame, {state_->save(), key, missed_, deepest_, static_cast<float>(inputs.stiffness_factor), exact, led_, seen(inputs, frame, key)});
}

// What is shown goes on from frame to frame. Where that fails, the motion goes on, and reading what is shown says why.
void ShellRunner::correct(const Request &request) {
  try {
    search_unless_interrupted([&] { state_->correct(correction_steps_, UntilInterrupted(request.interrupted)); });
  } catch (const shellwarp::Error &) {
    state_->correct(0);
  }
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

void ShellRunner::replay(const Request &request, const std::vector<StateCache::Entry> &before) {
  live_ = kLoaded;
  if (before.empty() || !before[0].seen || !before[0].exact) return;
  begin(request, *before[0].seen, before[0].inputs, true);
  for (uint64_t k = 1; k < before.size() && before[k].seen && before[k].exact; ++k) {
    if (request.interrupted && request.interrupted()) throw Interrupted();
    advance(request, *before[k].seen, before[k].inputs, k, true, false);
  }
}

}  // namespace host

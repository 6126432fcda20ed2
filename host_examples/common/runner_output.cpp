// What is shown and told of the frame that was reached.
#include "runner_at.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace host {

static std::string of_full_shell(uint32_t method, const SwModelInfo &info) {
  const std::string why = info.auto_corrects ? "fields miss " + number(std::round(100 * info.training_error_median)) + " % or more in half of their training"
                                             : "no training of fields came to rest";
  return "certified: it is the full nonlinear shell" + (needs_choice(method) ? ", which auto took: " + why : "");
}

// A sentence; the frame is whole without it.
static std::string certificate_of(const shellwarp::State &state, std::pair<uint32_t, SwModelInfo> model, uint32_t steps, const std::function<bool()> &interrupted) {
  const auto &[method, info] = model;
  if (is_full_shell(method_taken(method, info))) return of_full_shell(method, info);
  const UntilInterrupted watch(interrupted);
  try {
    SwCertificate found = state.certify(watch);
    if (steps > 0 && found.corrected_error == found.error) {  // none are kept: they are taken where they are read
      shellwarp::State copy = state.clone();
      copy.correct(steps, watch);
      found = copy.certify(watch);
    }
    const double percent = 100 * (steps > 0 ? found.corrected_error : found.error);  // of what is shown
    return "certified: about " + number(percent < 10 ? std::round(100 * percent) / 100 : std::round(percent)) +
           " % off the full nonlinear shell" + (found.remaining > 0.01 ? ", roughly" : "");
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) return "not certified: stopped by the user";
    return std::string("not certified: ") + error.what();
  }
}

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
  return certificate_of(*state_, {method_, model_->model().info()}, shown_steps_, interrupted);
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

void ShellRunner::read(const shellwarp::State &state, const Request &request, const At &at) {
  const SwStateReport report = state.report();
  shown_steps_ = at.rest() ? 0 : request.correction_steps;
  const uint32_t space = led_ ? SW_SPACE_WORLD : SW_SPACE_FRAME;
  std::vector<double> points, velocities;
  double inside = at.fraction > 0 ? report.deepest_penetration : static_cast<double>(deepest_);
  if (follower_.bound()) {
    // The mesh's own positions, where they are shown, are read below to the last bit: its binding is for velocities.
    const bool drawn = !request.drawn.empty();
    const Follower::Moved moved = {drawn ? shown_steps_ : 0, drawn && request.push_out, request.push_out && drawn ? &inside : nullptr};
    points = follower_.read(state, space, moved, request.velocities ? &velocities : nullptr);
  }
  if (request.drawn.empty()) {
    points.resize(model_->rest().size());
    if (request.push_out)
      inside = state.positions_outside(points.data(), model_->n_points(), space);
    else if (shown_steps_ > 0)
      state.positions_corrected(shown_steps_, points.data(), model_->n_points(), space);
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
  notes_.certified = request.certify ? certificate_of(state, {method_, model_->model().info()}, shown_steps_, request.interrupted) : "";
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

#include "step_twin.hpp"

#include "method.hpp"
#include "progress.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

namespace cli {

void take_step(const Scene &scene, double end_time, double seconds, SupportMotion &supports, std::vector<PlacedHandle> &handles,
               shellwarp::State &state) {
  supports.move(end_time, state);
  move_handles(handles, end_time, state);
  move_colliders(scene.colliders, end_time, scene.frame_rate, state);
  if (scene.loads.wind && scene.loads.wind->gust > 0) blow(*scene.loads.wind, end_time, state);
  state.step(seconds);
}

uint32_t order_of_steps(const Scene &scene, uint32_t method) {
  if (!scene.colliders.empty()) return 1;
  return host::needs_fields(method) || (host::is_full_shell(method) && scene.integrator == SW_INTEGRATOR_SECOND_ORDER) ? 2 : 1;
}

double step_error_of(double share, uint32_t order) {
  constexpr double kUnconverged = 0.3;  // of a motion that shares no more than its outline with the other
  const double small = 1.0 / ((1u << order) - 1);
  return share * (small + (1 - small) * std::min(1.0, share / kUnconverged));
}

uint32_t times_as_many_steps(double error, uint32_t order) {
  constexpr double kAim = 0.01, kMost = 16;
  return static_cast<uint32_t>(std::min(kMost, std::ceil(std::pow(error / kAim, 1.0 / order))));
}

StepTwin::StepTwin(const Scene &scene, const Mesh &mesh, std::vector<PlacedHandle> handles, const shellwarp::State &state, uint32_t method)
    : scene_(scene), mesh_(mesh), supports_(scene, mesh), handles_(std::move(handles)), state_(state.clone()),
      order_(order_of_steps(scene, method)), beside_(host::is_full_shell(method)), own_(mesh.positions.size()), other_(mesh.positions.size()) {}

StepTwin::~StepTwin() {
  if (ahead_.valid()) ahead_.wait();
}

bool StepTwin::applies(const Scene &scene, uint32_t n_frames) {
  const auto deforms = [](const Collider &collider) { return collider.deforms(); };
  return !scene.is_static && n_frames >= 2 && scene.method != SW_METHOD_SHELL_EXPLICIT && !scene.points && scene.motion_path.empty() &&
         std::none_of(scene.colliders.begin(), scene.colliders.end(), deforms);
}

void StepTwin::step_two_frames() {
  const double seconds = 2 * scene_.step();
  for (uint32_t k = 0; k < scene_.steps_per_frame && !interrupted(); ++k)
    take_step(scene_, static_cast<double>(++steps_) * seconds, seconds, supports_, handles_, state_);
}

void StepTwin::before(uint32_t frame) {
  if (!failed_.empty() || until_ > 0 || frame % 2 == 0) return;
  ahead_ = std::async(beside_ ? std::launch::async : std::launch::deferred, &StepTwin::step_two_frames, this);
}

void StepTwin::after(uint32_t frame, const shellwarp::State &state) {
  if (frame % 2 == 1 || !ahead_.valid()) return;
  constexpr std::chrono::duration<double> kPatience(5);
  const Clock::time_point before = Clock::now();
  try {
    ahead_.get();
    if (!interrupted()) compare(frame, state);
    waited_ += Clock::now() - before;
    if (waited_ > kPatience + (Clock::now() - start_) * (beside_ ? 0.25 : 1)) until_ = frame / scene_.frame_rate;
  } catch (const shellwarp::Error &error) {
    if (error.status() != SW_ERROR_NUMERICAL) throw;
    failed_ = error.what();
  }
}

void StepTwin::compare(uint32_t frame, const shellwarp::State &state) {
  state.positions(own_.data(), mesh_.n_vertices(), SW_SPACE_FRAME);
  state_.positions(other_.data(), mesh_.n_vertices(), SW_SPACE_FRAME);
  double moved = 0, off = 0;
  for (std::size_t k = 0; k < own_.size(); ++k) {
    const double x = own_[k];
    moved += (x - mesh_.positions[k]) * (x - mesh_.positions[k]);
    off += (x - other_[k]) * (x - other_[k]);
  }
  most_moved_ = std::max(most_moved_, moved);
  compared_ = true;
  if (!(off > most_off_)) return;
  most_off_ = off;
  at_ = frame / scene_.frame_rate;
}

std::optional<StepEstimate> StepTwin::estimate() const {
  if (!failed_.empty()) return StepEstimate{0, 0, 0, failed_};
  if (!compared_) return std::nullopt;
  return StepEstimate{most_moved_ > 0 ? step_error_of(std::sqrt(most_off_ / most_moved_), order_) : 0, at_, until_, ""};
}

}  // namespace cli

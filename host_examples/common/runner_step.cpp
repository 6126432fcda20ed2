// How a frame's inputs act on a state.
#include "shell_runner.hpp"

#include <algorithm>

namespace host {

bool ShellRunner::step(shellwarp::State &state, const Inputs &inputs, double frames, bool teleport) const {
  const double g = 1 / (unit_ * clock_ * clock_);
  state.set_stiffness(inputs.stiffness_factor);
  state.set_gravity(g * inputs.gravity[0], g * inputs.gravity[1], g * inputs.gravity[2]);
  blow(state, inputs.wind);
  pull(state, inputs);
  const bool led = stand(state, inputs, teleport);
  place_handles(state, inputs);
  colliders_.place(state, inputs, unit_, teleport);
  state.step(frames * frame_time_ * clock_);
  return led;
}

// Supports stand in the frame until they have moved, and are moved from there on.
bool ShellRunner::stand(shellwarp::State &state, const Inputs &inputs, bool teleport) const {
  if (!inputs.rest.empty()) {
    SwFrameDesc frame = frame_of(inputs);
    frame.flags = SW_FRAME_TELEPORT;
    state.set_frame(frame);
    const Pose world = place_of(inputs);
    std::vector<double> positions(inputs.rest.size());
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      const Vec3 place = host::apply(world, {inputs.rest[i], inputs.rest[i + 1], inputs.rest[i + 2]});
      std::copy(place.begin(), place.end(), &positions[i]);
    }
    state.move_rest(positions.data(), model_->n_points(), teleport ? SW_REST_TELEPORT : 0);
    return true;
  }
  if (inputs.supports.empty() && !led_) {
    SwFrameDesc frame = frame_of(inputs);
    frame.flags = teleport ? SW_FRAME_TELEPORT : 0;
    state.set_frame(frame);
    return false;
  }
  const Pose world = place_of(inputs);
  std::vector<double> positions = model_->rest();
  for (std::size_t k = 0; k < places_.vertices().size(); ++k) {
    double *at = &positions[3 * std::size_t{places_.vertices()[k]}];
    const double *x = inputs.supports.empty() ? at : &inputs.supports[3 * k];
    const Vec3 place = host::apply(world, {x[0], x[1], x[2]});
    std::copy(place.begin(), place.end(), at);
  }
  try {
    state.move_supports(positions.data(), model_->n_points(), teleport ? SW_SUPPORTS_TELEPORT : 0);
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_UNSUPPORTED) throw Apart(error.what());
    throw;
  }
  return true;
}

// The library's world is the scene's, measured in the object's unit.
Pose ShellRunner::place_of(const Inputs &inputs) const {
  Pose place = inputs.frame;
  place.scale = 1;
  for (double &x : place.origin) x /= unit_;
  return place;
}

SwFrameDesc ShellRunner::frame_of(const Inputs &inputs) const {
  const Pose place = place_of(inputs);
  SwFrameDesc frame = shellwarp::frame_desc();
  std::copy(place.origin.begin(), place.origin.end(), frame.origin);
  std::copy(place.rotation.begin(), place.rotation.end(), frame.rotation);
  return frame;
}

void ShellRunner::blow(shellwarp::State &state, const Wind &wind) const {
  if (wind.density == 0) {
    state.clear_wind();
    return;
  }
  SwWindDesc desc = shellwarp::wind_desc();
  for (std::size_t k = 0; k < 3; ++k) desc.velocity[k] = wind.velocity[k] / (unit_ * clock_);
  desc.density = wind.density;
  desc.normal_drag = wind.normal_drag;
  desc.tangential_drag = wind.tangential_drag;
  std::vector<double> local = wind.local;
  for (double &v : local) v /= unit_ * clock_;
  if (!local.empty()) desc.local_velocities = local.data(), desc.local_format = SW_FORMAT_F64;
  state.set_wind(desc);
}

void ShellRunner::pull(shellwarp::State &state, const Inputs &inputs) const {
  if (inputs.forces.empty()) {
    state.clear_forces();
    return;
  }
  std::vector<double> forces = inputs.forces;
  for (double &f : forces) f /= clock_ * clock_;
  state.set_forces(shellwarp::force_desc(forces.data(), model_->n_points()));
}

void ShellRunner::place_handles(shellwarp::State &state, const Inputs &inputs) const {
  state.clear_constraint(SW_ALL_CONSTRAINTS);
  const Pose world = to_library(inputs, unit_);
  for (std::size_t i = 0; i < inputs.handles.size(); ++i) {
    const Handle &handle = inputs.handles[i];
    if (!handle.held) continue;
    const Pose target = product(world, handle.target);
    SwConstraintDesc desc = shellwarp::constraint_desc();
    desc.vertex = handle.vertex;
    if (handle.position) {
      desc.id = static_cast<uint32_t>(2 * i);
      desc.kind = SW_CONSTRAINT_POSITION;
      desc.axes = handle.axes;
      desc.compliance = handle.compliance * clock_ * clock_;
      std::copy(target.origin.begin(), target.origin.end(), desc.position);
      state.set_constraint(desc);
    }
    if (handle.orientation) {
      desc.id = static_cast<uint32_t>(2 * i + 1);
      desc.kind = SW_CONSTRAINT_ORIENTATION;
      desc.compliance = handle.compliance * clock_ * clock_ * unit_ * unit_;
      std::copy(target.rotation.begin(), target.rotation.end(), desc.rotation);
      state.set_constraint(desc);
    }
  }
}

}  // namespace host

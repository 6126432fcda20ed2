// What the length of the steps costs the whole motion: a twin takes the same scene by steps twice as long, beside it.
//
//   share = max over time |x_h − x_2h| / max over time |u_h|     over all vertices, in the support frame
//   error = share / (2^p − 1) while that is small                by Richardson's extrapolation; p is the integrator's order
//
// Where doubling the steps changes the motion by much, nothing converges yet, and the share itself is told: see step_error_of.
#pragma once

#include "handle_motion.hpp"
#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "support_motion.hpp"

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cli {

// Of the whole motion so far.
struct StepEstimate {
  double error = 0;    // a share of the largest displacement, both root mean squares over the vertices
  double seconds = 0;  // when it was largest
  double until = 0;    // the twin was given up here, as it was the slower one; 0 where it ran to the end
  std::string failed;  // why there is none: steps twice as long find no end
};

// One step that ends at `end_time`, of `seconds`: moves what moves, and steps.
void take_step(const Scene &scene, double end_time, double seconds, SupportMotion &supports, std::vector<PlacedHandle> &handles,
               shellwarp::State &state);

// The order of the method's steps: 2 of reduced shells and of the full one where it is asked for, without colliders; else 1.
uint32_t order_of_steps(const Scene &scene, uint32_t method);

// The error by a share that doubling the steps changes.
double step_error_of(double share, uint32_t order);

// An error that is seen, as a share of the motion.
constexpr double kCoarseMotion = 0.03;

// How many times as many steps bring such an error to a hundredth of the motion; at most 16, beyond which an order tells little.
uint32_t times_as_many_steps(double error, uint32_t order);

class StepTwin {
public:
  // `state` as it is before the first step, which is copied; `method` is what it moves by.
  StepTwin(const Scene &scene, const Mesh &mesh, std::vector<PlacedHandle> handles, const shellwarp::State &state, uint32_t method);
  ~StepTwin();
  StepTwin(const StepTwin &) = delete;
  StepTwin &operator=(const StepTwin &) = delete;

  // Whether there is such a motion: not of equilibria, explicit steps, or what files lead.
  static bool applies(const Scene &scene, uint32_t n_frames);

  // Before a frame is stepped to. Of the full shell the twin's steps, two frames at a time, are on a thread of their own.
  void before(uint32_t frame);
  // After it. A twin on a thread of its own that was waited for by more than a quarter of the run's time ends there.
  void after(uint32_t frame, const shellwarp::State &state);

  std::optional<StepEstimate> estimate() const;

private:
  void step_two_frames();
  void compare(uint32_t frame, const shellwarp::State &state);

  using Clock = std::chrono::steady_clock;
  const Scene &scene_;
  const Mesh &mesh_;
  SupportMotion supports_;
  std::vector<PlacedHandle> handles_;
  shellwarp::State state_;
  const uint32_t order_;
  const bool beside_;
  uint64_t steps_ = 0;
  std::future<void> ahead_;
  std::vector<float> own_, other_;
  double most_moved_ = 0, most_off_ = 0, at_ = 0;  // squares
  bool compared_ = false;
  const Clock::time_point start_ = Clock::now();
  std::chrono::duration<double> waited_{0};
  double until_ = 0;
  std::string failed_;
};

}  // namespace cli

// Stepping a scene through its frames, with the clock on the library alone: steps and positions are timed, files are not.
#pragma once

#include "film.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "point_cache.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "step_twin.hpp"
#include "support_motion.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cli {

class RenderMesh;

// One frame as it was after its last step. `saved` brings the state back (sw_state_load); kept where files are written.
struct FrameRecord {
  uint32_t frame;
  SwStateReport report;
  std::vector<unsigned char> saved;
  std::vector<float> shown{};  // positions after correction_steps, or pushed out; empty without
  std::vector<float> drawn{};  // of the render mesh, after correction_steps: a state that is gone back to has not the loads that these balance
};

// What became of the handles, over all steps in which any was held.
struct HandleFigures {
  uint64_t steps = 0, steps_missed = 0;                    // missed: not all constraints were met
  double position_residual = 0, orientation_residual = 0;  // the worst; length, radians
  uint32_t iterations = 0;                                 // the most in one step
};

// What the certificate said of a frame: the error of its displacement, of which the largest is told.
struct ErrorEstimate {
  double seconds, error, displacement;
};

// The state as it was at a frame, with handles, loads and inertia, which a save has not.
struct KeptFrame {
  std::size_t frame;
  std::shared_ptr<const shellwarp::State> state;
};

struct Run {
  std::vector<FrameRecord> frames;  // frame 0 is the start
  std::vector<KeptFrame> judged;    // between the first and the last, ascending
  uint64_t steps = 0;
  std::optional<SwCertificate> certificate;  // of the last frame
  std::string uncertified;                   // why there is none, if there should be one
  std::vector<ErrorEstimate> estimates;      // of a few frames, the last one's behind
  std::optional<StepEstimate> step_estimate;  // what the length of the steps costs the whole motion, where a twin ran
  uint32_t steps_tried = 0;                    // a frame, more than these, which were no nearer
  double error_of_tried = 0;                   // of the motion
  double step_seconds = 0, position_seconds = 0;
  HandleFigures handles;
  std::optional<SwEquilibriumReport> equilibrium;  // of a static scene
  std::optional<double> largest_gain;              // see energy_audit.hpp
  uint32_t frame_of_gain = 0;
  bool supports_move = false;                      // against each other
  bool begins_inside = false;                      // a collider, to be seen
  double deepest_left = 0;                         // inside a collider, of what is shown pushed out
  std::shared_ptr<SupportMotion> supports{};       // that moved them
  bool all_finite = true;
  bool interrupted = false;
};

// Of the largest displacement.
const FrameRecord &widest_frame(const Run &run);

// The largest that any frame's last step tells of itself, length.
double largest_step_error(const Run &run);
// The same as a share of the largest displacement; 0 where nothing moves.
double step_error_share(const Run &run);

// Brings a state to a frame: what was saved, and what a save has not, a rest shape that moves and how colliders are deformed.
void go_to(const Run &run, const FrameRecord &frame, const Scene &scene, shellwarp::State &state);

// Of a point cache, which counts them in 31 bits, the start included.
constexpr uint32_t kMostFrames = 2147483646;

// What a run keeps beside its figures.
struct Keep {
  bool states = false;     // of all frames, for whoever writes other files; with a cache they are always
  std::size_t judged = 0;  // so many frames evenly spaced, the last one too, and the most displaced; 0 = none
  bool step_error = false;  // a twin by steps twice as long runs beside; see step_twin.hpp
  uint32_t method = 0;      // that the state moves by
};

// Writes one sample a frame into `cache` and offers it to `film`, unless they are null. Tells of long runs unless quiet.
// `render`: what follows, if anything does.
Run simulate(const Scene &scene, uint32_t n_frames, const Mesh &mesh, std::vector<PlacedHandle> handles,
             shellwarp::State &state, PointCache *cache, Film *film = nullptr, bool quiet = true, const Keep &keep = {}, const RenderMesh *render = nullptr);

// The duration in frames, at least one; one if static: the equilibrium, with handles, frame and colliders as at the end of the
// duration. Throws where a point cache cannot number them.
uint32_t frame_count(const Scene &scene);

}  // namespace cli

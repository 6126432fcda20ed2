#include "simulation.hpp"

#include "render_files.hpp"
#include "energy_audit.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "progress.hpp"
#include "step_twin.hpp"
#include "watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>
#include <stdexcept>

namespace cli {

namespace {

// Adds the time from its birth to its death to a sum.
class Stopwatch {
public:
  explicit Stopwatch(double &seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch &) = delete;
  Stopwatch &operator=(const Stopwatch &) = delete;

private:
  using Clock = std::chrono::steady_clock;
  double &seconds_;
  Clock::time_point start_;
};

void note_handles(const shellwarp::State &state, HandleFigures &figures) {
  bool all_met = true;
  const std::vector<SwConstraintReport> reports = state.constraint_report();
  for (const SwConstraintReport &r : reports) {
    double &worst = r.kind == SW_CONSTRAINT_POSITION ? figures.position_residual : figures.orientation_residual;
    worst = std::max(worst, r.residual);
    figures.iterations = std::max(figures.iterations, r.iterations);
    all_met &= r.met == 1;
  }
  figures.steps += !reports.empty();
  figures.steps_missed += !all_met;
}

bool has_gusts(const Scene &scene) { return scene.loads.wind && scene.loads.wind->gust > 0; }

// A step that finds no end says when, and what helps.
void step(const Scene &scene, double end_time, SupportMotion &supports, std::vector<PlacedHandle> &handles, shellwarp::State &state) {
  try {
    take_step(scene, end_time, scene.step(), supports, handles, state);
  } catch (const shellwarp::Error &error) {
    if (error.status() != SW_ERROR_NUMERICAL) throw;
    throw std::runtime_error(format("at %.3g s: %s; try --steps-per-frame %u (steps_per_frame)", end_time, error.what(), 4 * scene.steps_per_frame));
  }
}

// The frame's pose and the places of handles and colliders are given for the end of each step; the library takes velocities
// from the differences.
void step_to_next_frame(const Scene &scene, SupportMotion &supports, std::vector<PlacedHandle> &handles, shellwarp::State &state,
                        Run &run) {
  for (uint32_t k = 0; k < scene.steps_per_frame && !interrupted(); ++k) {
    const double end_time = static_cast<double>(run.steps + 1) * scene.step();
    {
      Stopwatch stopwatch(run.step_seconds);
      step(scene, end_time, supports, handles, state);
    }
    ++run.steps;
    if (!handles.empty()) note_handles(state, run.handles);
  }
}

// Of an equilibrium that is shown after Newton steps of the full shell: in the frame, from the mesh.
double largest_displacement(const Scene &scene, const Mesh &mesh, const shellwarp::State &state) {
  std::vector<double> x(mesh.positions.size());
  state.positions_corrected(scene.correction_steps, x.data(), mesh.n_vertices(), SW_SPACE_FRAME);
  double largest = 0;
  for (std::size_t k = 0; k < x.size(); k += 3)
    largest = std::max(largest, std::hypot(x[k] - mesh.positions[k], x[k + 1] - mesh.positions[k + 1], x[k + 2] - mesh.positions[k + 2]));
  return largest;
}

void record(const Scene &scene, uint32_t frame, const Mesh &mesh, shellwarp::State &state, std::vector<float> &positions, Run &run,
            PointCache *cache, Film *film, bool keep_states, const RenderMesh *render) {
  {
    Stopwatch stopwatch(run.position_seconds);
    const uint32_t n_vertices = mesh.n_vertices();
    if (scene.push_out)
      run.deepest_left = std::max(run.deepest_left, state.positions_outside(positions.data(), n_vertices));
    else if (scene.correction_steps > 0) {
      const auto watch = [frame](double) { return frame == 0 || !interrupted(); };  // whatever is told of a run has a first frame
      if (frame > 0 || scene.correction_steps != SW_STEPS_AUTO) state.correct(scene.correction_steps, watch);
      state.positions_corrected(scene.correction_steps, positions.data(), n_vertices);
    } else
      state.positions(positions.data(), n_vertices);
  }
  run.all_finite &= std::all_of(positions.begin(), positions.end(), [](float x) { return std::isfinite(x); });
  const bool again = keep_states || cache || (film && !host::is_full_shell(scene.method));  // whoever comes back to this frame
  run.frames.push_back({frame, state.report(), again ? state.save() : std::vector<unsigned char>(),
                        again && (scene.correction_steps > 0 || scene.push_out) ? positions : std::vector<float>()});
  if (scene.is_static && scene.correction_steps == SW_STEPS_AUTO) run.frames.back().report.max_displacement = largest_displacement(scene, mesh, state);
  if (render && again && scene.correction_steps > 0) run.frames.back().drawn = render->points(scene, state);
  if (cache) cache->append(positions.data());
  const SwStateReport &report = run.frames.back().report;  // an equilibrium takes no time: a page plays it in a second
  if (film) film->append(frame, scene.is_static ? frame : report.time, report.max_displacement, positions.data());
}

// The equilibrium is the one frame after the start; no time passes.
void move_to_equilibrium(const Scene &scene, SupportMotion &supports, std::vector<PlacedHandle> &handles, shellwarp::State &state,
                         Run &run) {
  supports.move(scene.duration, state);
  move_handles(handles, scene.duration, state);
  move_colliders(scene.colliders, scene.duration, scene.frame_rate, state);
  Stopwatch stopwatch(run.step_seconds);
  run.equilibrium = state.equilibrium(UntilInterrupted());
}

// Keeps frames to be judged: some evenly spaced, and the most displaced of those between the first and the last.
class JudgedFrames {
public:
  JudgedFrames(std::size_t most, std::size_t last) {
    for (std::size_t k = 1, n = std::min(most, last); k < n; ++k) chosen_.insert(k * last / n);
    last_ = most > 0 ? last : 0;
  }

  void note(std::size_t frame, double displacement, const shellwarp::State &state) {
    if (frame >= last_) {  // judged anyway
      if (displacement > widest_displacement_) widest_.state = nullptr;
      return;
    }
    const bool is_widest = displacement > widest_displacement_, is_chosen = chosen_.count(frame) > 0;
    if (!is_widest && !is_chosen) return;
    const KeptFrame kept{frame, std::make_shared<const shellwarp::State>(state.clone())};
    if (is_chosen) kept_.push_back(kept);
    if (!is_widest) return;
    widest_displacement_ = displacement;
    widest_ = kept;
  }

  // Ascending.
  std::vector<KeptFrame> taken() {
    const auto before = [](const KeptFrame &a, std::size_t frame) { return a.frame < frame; };
    if (widest_.state && !chosen_.count(widest_.frame))
      kept_.insert(std::lower_bound(kept_.begin(), kept_.end(), widest_.frame, before), widest_);
    return std::move(kept_);
  }

private:
  std::set<std::size_t> chosen_;
  std::vector<KeptFrame> kept_;
  KeptFrame widest_{0, nullptr};
  double widest_displacement_ = 0;
  std::size_t last_ = 0;
};

}  // namespace

uint32_t frame_count(const Scene &scene) {
  if (scene.is_static) return 1;
  const double frames = std::max(std::round(scene.duration * scene.frame_rate), 1.0);
  if (!(frames <= kMostFrames))
    throw std::runtime_error(format("%g s at %g frames a second are %g frames; at most %u can be numbered",
                                    scene.duration, scene.frame_rate, frames, kMostFrames));
  return static_cast<uint32_t>(frames);
}

const FrameRecord &widest_frame(const Run &run) {
  const auto nearer = [](const FrameRecord &a, const FrameRecord &b) { return a.report.max_displacement < b.report.max_displacement; };
  return *std::max_element(run.frames.begin(), run.frames.end(), nearer);
}

double largest_step_error(const Run &run) {
  double largest = 0;
  for (const FrameRecord &f : run.frames) largest = std::max(largest, f.report.step_error);
  return largest;
}

double step_error_share(const Run &run) {
  const double most = widest_frame(run).report.max_displacement;
  return most > 0 ? largest_step_error(run) / most : 0;
}

void go_to(const Run &run, const FrameRecord &frame, const Scene &scene, shellwarp::State &state) {
  const double seconds = scene.is_static && frame.frame > 0 ? scene.duration : frame.report.time;
  run.supports->bring_rest(seconds, state);
  deform_colliders(scene.colliders, seconds, scene.frame_rate, state, true);
  if (has_gusts(scene)) blow(*scene.loads.wind, seconds, state);
  state.load(frame.saved);
}

Run simulate(const Scene &scene, uint32_t n_frames, const Mesh &mesh, std::vector<PlacedHandle> handles,
             shellwarp::State &state, PointCache *cache, Film *film, bool quiet, const Keep &keep, const RenderMesh *render) {
  Run run;
  JudgedFrames judged(keep.judged, n_frames);
  std::vector<float> positions(mesh.positions.size());
  EnergyAudit audit(scene, mesh);
  run.supports = std::make_shared<SupportMotion>(scene, mesh);
  SupportMotion &supports = *run.supports;
  run.supports_move = any_moves(scene);
  supports.begin(state);
  record(scene, 0, mesh, state, positions, run, cache, film, keep.states, render);
  audit.note(0, state, run.frames.back().report);
  run.position_seconds = 0;  // the start is not a frame that was stepped to
  std::optional<StepTwin> twin;
  if (keep.step_error && StepTwin::applies(scene, n_frames)) twin.emplace(scene, mesh, handles, state, keep.method);
  Watch watch(scene.is_static ? "finding the equilibrium" : "stepping", quiet, scene.is_static ? 0 : n_frames);
  for (uint32_t frame = 1; frame <= n_frames; ++frame) {
    if (twin) twin->before(frame);
    try {
      if (scene.is_static)
        move_to_equilibrium(scene, supports, handles, state, run);
      else
        step_to_next_frame(scene, supports, handles, state, run);
      if ((run.interrupted = interrupted())) break;  // perhaps in the middle of a frame
      record(scene, frame, mesh, state, positions, run, cache, film, keep.states, render);
    } catch (const shellwarp::Error &error) {
      if (error.status() != SW_ERROR_CANCELLED) throw;
      run.interrupted = true;
      break;
    }
    if (twin) twin->after(frame, state);
    judged.note(frame, run.frames.back().report.max_displacement, state);
    audit.note(frame, state, run.frames.back().report);
    watch.at(frame);
  }
  run.judged = judged.taken();
  if (twin) run.step_estimate = twin->estimate();
  if (audit.applies()) run.largest_gain = audit.largest_gain();
  run.frame_of_gain = audit.frame_of_gain();
  return run;
}

}  // namespace cli

#include "estimates.hpp"

#include "judge.hpp"
#include "method.hpp"
#include "progress.hpp"
#include "watch.hpp"

namespace cli {

namespace {

constexpr uint32_t kMostJudged = 5000;  // vertices of which the error of a frame takes a fraction of a second

// Whether errors are estimated: not of the full shell, nor where nobody would read them. The automatic choice goes by them.
bool is_judged(const Scene &scene, const RunOptions &options, uint32_t n_vertices) {
  const bool read = !options.quiet || !options.html.empty() || options.view || (host::needs_choice(scene.method) && n_vertices <= kMostJudged);
  return read && !options.no_certify && !host::is_full_shell(scene.method);
}

// Of so many frames beside the most displaced, the last one among them. Of large meshes each takes seconds.
std::size_t n_judged(const Scene &scene, const RunOptions &options, uint32_t n_vertices) {
  return !is_judged(scene, options, n_vertices) ? 0 : n_vertices > kMostJudged ? 1 : 8;
}

// Whether a twin by steps twice as long is to tell what the steps cost; of a quiet run, too, whose steps go by it.
bool has_twin(const Scene &scene, const RunOptions &options) {
  return (!options.quiet || !options.html.empty() || options.view || scene.steps_open) && !options.no_certify;
}

ErrorEstimate estimate_at(const FrameRecord &frame, const SwCertificate &found) {
  return {frame.report.time, found.error, frame.report.max_displacement};
}

// The estimate at a few frames before the last one, the most displaced among them.
void estimate_errors(bool quiet, Run &run) {
  if (!run.certificate) return;
  Watch watch("estimating the errors over time", quiet, static_cast<uint32_t>(run.judged.size()));
  for (const KeptFrame &kept : run.judged) {
    if (interrupted()) break;
    watch.at(static_cast<uint32_t>(&kept - run.judged.data()));
    try {
      run.estimates.push_back(estimate_at(run.frames[kept.frame], kept.state->certify(UntilInterrupted())));
    } catch (const shellwarp::Error &) {  // there is none of this shape
    }
  }
  run.judged.clear();
  run.estimates.push_back(estimate_at(run.frames.back(), *run.certificate));
}

}  // namespace

std::string label_of(const Scene &scene, const SwModelInfo &info) {
  const std::string label = sw_method_label(scene.method);
  return host::needs_choice(scene.method) ? label + ": " + sw_method_label(info.auto_method) : label;
}

Keep keep_of(const Scene &scene, const RunOptions &options, const Mesh &mesh, const shellwarp::Model &model, bool states) {
  return {states, n_judged(scene, options, mesh.n_vertices()), has_twin(scene, options), host::method_taken(scene.method, model.info())};
}

void certify(const Scene &scene, const RunOptions &options, shellwarp::State &state, uint32_t n_vertices, Run &run) {
  constexpr uint32_t kMost = 50000;  // some tens of seconds
  if (!is_judged(scene, options, n_vertices) || run.interrupted) return;
  if (!options.certify && n_vertices > kMost) {
    run.uncertified = format("of %u vertices it would take long; --certify estimates it", n_vertices);
    return;
  }
  {
    const Watch watch("estimating the error", options.quiet);
    try {
      run.certificate = state.certify(UntilInterrupted());
    } catch (const shellwarp::Error &error) {
      run.uncertified = error.what();
    }
  }
  estimate_errors(options.quiet, run);
}

}  // namespace cli

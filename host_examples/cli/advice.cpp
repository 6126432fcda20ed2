#include "advice.hpp"

#include "choice.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "support_motion.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

namespace {

constexpr double kDegrees = 57.29577951308232;

// Motion that nobody sees, as a share of the shell's size; and motion that no shell on a support makes.
constexpr double kUnseen = 1e-3, kWild = 2;

// And motion that is hardly seen.
constexpr double kHardlySeen = 0.01;

// A proxy this far off its file is worth more vertices; what a step of the full shell takes grows with them by this power.
constexpr double kFarOff = 0.1, kGrowth = 1.8;

// Errors beyond which a method is outside what it was made for, as SwCertificate has it, and beyond which most of what is seen is wrong.
constexpr double kOutOfRange = 0.2, kMisleading = 0.5;

// How many times as far as anything has moved the full shell is, where that is told.
constexpr double kMuchMore = 1.9;

// Hertz of a swing that is not stiff: what hardly moves is then of another unit.
constexpr double kSlow = 0.5;

// What a step gets wrong by its length, as a share of the motion: a swing of forty steps by the full shell, of twelve by a reduced one.
constexpr double kCoarse = 0.01;

std::string in_unit(double length, const Scene &scene) {
  return format("%.3g", length) + (scene.length_unit.empty() ? "" : " " + scene.length_unit);
}

std::string share_of_size(double share) {
  if (share >= 1.05) return format("%.2g times its size", share);
  if (share >= 0.1) return format("%.0f %% of its size", 100 * share);
  return share >= kUnseen ? format("%.2g %% of its size", 100 * share) : format("%.1e of its size", share);
}

double most_turned(const Run &run) {
  double most = 0;
  for (const FrameRecord &f : run.frames) most = std::max(most, f.report.max_rotation);
  return most;
}

std::string degrees(double radians) {
  const double angle = kDegrees * radians;
  return format(angle < 10 ? "%.2g degrees" : "%.0f degrees", angle);
}

// How far handles are led from where they begin; 0 where bones carry any.
double longest_way(const std::vector<Handle> &handles) {
  double way = 0;
  for (const Handle &handle : handles) {
    if (handle.bone) return 0;
    for (const HandleKey &key : handle.keys) way = std::max(way, std::hypot(key.offset[0], key.offset[1], key.offset[2]));
  }
  return way;
}

uint32_t method_taken(const Summary &summary) { return host::method_taken(summary.scene.method, summary.info); }

// By which method; of the automatic choice, which that took.
std::string method_words(const Summary &summary) {
  return std::string("; by the method ") + host::method_name(method_taken(summary)) + (host::needs_choice(summary.scene.method) || summary.scene.by_auto ? ", that auto took" : "");
}

std::string motion_words(const Summary &summary) {
  const FrameRecord &widest = widest_frame(summary.run), &last = summary.run.frames.back();
  const double most = widest.report.max_displacement;
  std::string words = "moved: up to " + in_unit(most, summary.scene) + ", " + share_of_size(most / summary.info.size) +
                      " of " + in_unit(summary.info.size, summary.scene);
  if (!summary.scene.is_static) words += format(", at %.3g s", widest.report.time);
  if (const double way = longest_way(summary.scene.handles); way > 0) words += std::fabs(most / way - 1) < 0.05 ? ", as far as its handles" : format(", %.2g times as far as its handles", most / way);
  words += "; turned up to " + degrees(most_turned(summary.run));
  if (&last != &widest) words += "; at the end by " + in_unit(last.report.max_displacement, summary.scene);
  return words + method_words(summary);
}

// The slowest swing's frequency; 0 where nothing swings.
double slowest_swing(const Summary &summary) {
  for (const double hertz : summary.frequencies)
    if (hertz > 0) return hertz;
  return 0;
}

std::string swing_words(const Summary &summary) {
  const double hertz = slowest_swing(summary);
  return hertz > 0 ? format("its slowest swing has %.3g Hz", hertz) : "nothing in it swings";
}

bool loaded(const Scene &scene) {
  const std::array<double, 3> none{};
  return scene.gravity != none || scene.loads.wind || !scene.loads.forces.empty();
}

// Whether it falls away under gravity, or a piece of it, because nothing holds, leads or stops it.
bool falls(const Summary &summary) {
  const Scene &scene = summary.scene;
  return summary.info.zero_modes >= 6 && loaded(scene) && scene.colliders.empty() &&
         widest_frame(summary.run).report.max_displacement > kWild * summary.info.size;
}

std::string falling_words(const Summary &summary) {
  if (summary.scene.supports.empty() && summary.scene.handles.empty()) return "try: nothing is held, so that the shell falls: --pin low-x (support) holds an end of it";
  return format("try: the mesh is of %u pieces, and those that nothing holds fall: --weld 0 (weld) makes vertices at the same place one, and --tie 0.001 (tie) ties pieces that near",
                summary.info.n_components);
}

// Why nothing has moved.
std::string stillness(const Summary &summary) {
  if (summary.info.n_unknowns == 0) return "note: every vertex is held, so nothing can move";
  const std::string at_rest = "note: nothing has moved: the sagged shape is at rest under this gravity";
  if (summary.scene.sagged) return at_rest;
  for (const SwFrontPoint &p : summary.front)
    if (p.chosen && p.sagged)
      return at_rest + ", and " + host::method_name(p.method) + ", which was chosen, begins there: --wind or --handle would move it, and "
             "--method warp lets it fall there";
  if (loaded(summary.scene) && summary.info.zero_modes)
    return "note: nothing has moved: nothing holds the shell, so its inertia balances the load all over and nothing bends: --pin (support) "
           "or --handle would hold it";
  return "note: nothing has moved: no gravity, force or wind, no moving frame, no handle, no moving collider: --up z is gravity, and --wind (wind) or --handle (handle) moves it, too";
}

// What makes the shell softer or stiffer, of what this scene has not chosen already: of a known sheet its thickness, and of a frequency that.
std::string change_of_stiffness(const Scene &scene, bool softer) {
  const char *how = softer ? "softens" : "stiffens", *which = softer ? "lower" : "higher";
  if (scene.material.sheet) return format("a %s --thickness (thickness) %s it, and so does a %s --material (preset)", softer ? "smaller" : "larger", how, softer ? "softer" : "stiffer");
  if (scene.material.sag > 0) return format("a %s --sag (sag) %s it", softer ? "larger" : "smaller", how);
  if (scene.material.frequency > 0) return format("a %s --frequency (frequency) %s it", which, how);
  return format("a %s --frequency (frequency) %s it, and --material NAME (preset) takes a known sheet", which, how);
}

// Whether the unit is right, where nobody has said yet what it is; no sheet is meant to be less than a metre of centimetres.
std::string question_of_units(const Scene &scene, double size) {
  if (scene.scale != 1 || scene.metres_per_unit != 1 || size < 1) return scene.up ? "" : "is gravity right? ";
  return "are lengths in metres, and gravity 9.8? --scale 0.01 (scale) makes metres of centimetres. ";
}

void add_size_of_motion(const Summary &summary, std::vector<std::string> &words) {
  const Scene &scene = summary.scene;
  if (scene.length_unit == "m" && summary.info.size > kLongestInMetres && scene.scale == 1)
    words.push_back("try: the mesh is " + in_unit(summary.info.size, scene) + " wide: --scale 0.01 (scale) if its lengths are centimetres");
  const double share = widest_frame(summary.run).report.max_displacement / summary.info.size;
  const bool led = scene.motion.moves() || !scene.handles.empty() || any_moves(scene.colliders) || any_moves(scene);
  if (share == 0)
    words.push_back(stillness(summary));
  else if (share < kUnseen && loaded(scene) && !led)
    words.push_back("try: " + share_of_size(share) + " cannot be seen: " + question_of_units(scene, summary.info.size) + swing_words(summary) +
                    (slowest_swing(summary) < kSlow ? "" : ": " + change_of_stiffness(scene, true)));
  else if (share < kHardlySeen && loaded(scene) && !led && !scene.is_static)
    words.push_back("try: " + share_of_size(share) + " is hardly seen: a stronger wind or force moves it more; " + change_of_stiffness(scene, true) + "; the page can draw small motion larger, and --png does");
  else if (share > kWild && !led && summary.info.zero_modes == 0)
    words.push_back("try: no held shell moves by " + share_of_size(share) + ": " + question_of_units(scene, summary.info.size) + swing_words(summary) + ": " +
                    change_of_stiffness(scene, false));
}

// How the shell touched the colliders, at the ends of frames.
void add_contact(const Summary &summary, std::vector<std::string> &words) {
  if (summary.scene.colliders.empty()) return;
  uint64_t most = 0;
  double deepest = 0;
  for (const FrameRecord &f : summary.run.frames) {
    most = std::max(most, f.report.contact_count);
    deepest = std::max(deepest, f.report.deepest_penetration);
  }
  if (most == 0 && deepest == 0) return words.push_back("touched: no collider");
  const double share = deepest / summary.info.size;
  words.push_back(format("touched: %llu contact%s at most, deepest penetration ", static_cast<unsigned long long>(most), most == 1 ? "" : "s") +
                  in_unit(deepest, summary.scene) + format(" (%.2g %% of its size)", 100 * share) +
                  (summary.scene.push_out ? "; shown pushed out, " + in_unit(summary.run.deepest_left, summary.scene) + " left" : ""));
  if (summary.run.begins_inside) return words.push_back("note: the shell began inside a collider, which throws it out: move them apart");
  if (share > kUnseen)
    words.push_back(std::string("note: the shell went into a collider by more than 0.1 % of its size: ") +
                    (host::is_full_shell(summary.scene.method) ? "shorter steps help" : "more modes help") +
                    ", and colliders that are outside it at the start");
}

void add_turns(const Summary &summary, std::vector<std::string> &words) {
  const std::vector<FrameRecord> &frames = summary.run.frames;
  const auto outside =
      std::count_if(frames.begin(), frames.end(), [](const FrameRecord &f) { return !f.report.turn_in_range; });
  if (outside)
    words.push_back(format("note: %lld of %zu frames turn a vertex further than the method's rotations are good for (a quarter "
                           "turn): stiffen the shell, lower the loads, or check that units and material fit together",
                           static_cast<long long>(outside), frames.size()));
}

// Of the full shell, where other methods have their certificate and no twin tells.
void add_full_shell(const Summary &summary, std::vector<std::string> &words) {
  if (summary.run.step_estimate && summary.run.step_estimate->failed.empty()) return;
  const double share = step_error_share(summary.run);
  if (host::is_full_shell(summary.scene.method) && share > 0)
    words.push_back(format("this is the full nonlinear shell, by which others are judged; each step is off by up to %.2g %% of the motion, which may add up: half the step tells (--steps-per-frame %u, steps_per_frame)",
                           100 * share, 2 * summary.scene.steps_per_frame));
}

// What folds over may have gone through itself.
void add_folds(const Summary &summary, std::vector<std::string> &words) {
  constexpr double kFolded = 2.1;  // rad, 120 degrees
  if (host::is_full_shell(method_taken(summary)) && !summary.info.zero_modes && most_turned(summary.run) > kFolded)
    words.push_back("note: it folds over, and passes through itself where it meets itself: shells touch colliders alone");
}

// What makes steps of this method more accurate at the same length.
std::string better_steps(const Scene &scene, uint32_t method) {
  if (host::is_full_shell(method)) return scene.integrator == SW_INTEGRATOR_SECOND_ORDER ? "" : ", or --second-order (integrator)";
  return host::needs_fields(method) || scene.integrator == SW_INTEGRATOR_EXACT ? "" : ", or --exact (integrator)";
}

// What a choice took, so that a run with other steps is by it, too.
std::string method_options(const Summary &summary) {
  const Scene &scene = summary.scene;
  if (!host::needs_choice(scene.method) && !scene.by_auto) return "";
  const uint32_t method = method_taken(summary);
  return std::string("--method ") + host::method_name(method) + (host::is_full_shell(method) && scene.integrator == SW_INTEGRATOR_SECOND_ORDER ? " --second-order " : " ");
}

// Most of what is wrong, where that is the method's; with how long the full shell would take.
void add_method(const Summary &summary, std::vector<std::string> &words) {
  const uint32_t method = method_taken(summary);
  if (method_error(summary.run) <= kOutOfRange || host::is_full_shell(method) || summary.compared || summary.run.supports_move) return;
  words.push_back("try: most of the error is the method's: --method " + std::string(host::method_name(SW_METHOD_SHELL_IMPLICIT)) + " --second-order, up to " +
                  duration_words(seconds_of_full_shell(summary.info.n_vertices, static_cast<double>(summary.run.steps))).substr(6));
}

// A proxy that is far off its file.
void add_proxy(const Summary &summary, std::vector<std::string> &words) {
  if (!summary.proxy || !summary.proxy->difference || *summary.proxy->difference <= kFarOff) return;
  const uint32_t n = summary.info.n_vertices, more = std::min(3 * n / 2, summary.proxy->info.n_asset_vertices) / 100 * 100;
  if (more <= n) return;
  words.push_back(format("try: the proxy is about %.0f %% off its file: --proxy %u (proxy), ", 100 * *summary.proxy->difference, more) +
                  duration_words(summary.run.step_seconds * std::pow(static_cast<double>(more) / n, kGrowth)) + "; a shorter --duration takes less");
}

// Steps that are too long for the motion, unless the method is further off.
void add_step_error(const Summary &summary, std::vector<std::string> &words) {
  constexpr double kUnsettled = 0.3;  // nothing converges
  const Scene &scene = summary.scene;
  const uint32_t method = method_taken(summary);
  if (widest_frame(summary.run).report.max_displacement <= kUnseen * summary.info.size) return;
  if (const std::optional<StepEstimate> &found = summary.run.step_estimate; found && found->failed.empty()) {
    if (found->error <= kCoarseMotion) return;
    if (summary.run.steps_tried) {
      words.push_back(format("note: %u steps a frame, tried too, are off by about %.0f %%: shorter steps do not settle it, as what is let go or swings undamped parts from any other run; more damping does (--damping-ratio)",
                             summary.run.steps_tried, 100 * summary.run.error_of_tried));
      return;
    }
    const uint32_t times = times_as_many_steps(found->error, order_of_steps(scene, method));
    if (found->error < method_error(summary.run)) return;
    const std::string more = format("%u times as many steps (%s--steps-per-frame %u, steps_per_frame)%s, ", times, method_options(summary).c_str(), times * scene.steps_per_frame,
                                    better_steps(scene, method).c_str()) + duration_words(times * summary.run.step_seconds);
    const std::string costs = format("try: the time step costs about %.0f %% of the motion: ", 100 * found->error);
    words.push_back(host::is_full_shell(method) && found->error > kUnsettled
                        ? costs + "folds may come otherwise with every change of a step. Less wind, a stiffer sheet or more damping (--damping-ratio 0.2) helps; " + more + ", may help"
                        : costs + more);
  } else if (const double share = step_error_share(summary.run); share > kCoarse) {
    words.push_back(format("try: a step is off by up to %.2g %% of the motion: a quarter of it is off by a sixteenth (--steps-per-frame %u, steps_per_frame)%s", 100 * share, 4 * scene.steps_per_frame, better_steps(scene, method).c_str()));
  }
}

void add_handles(const Summary &summary, std::vector<std::string> &words) {
  const HandleFigures &handles = summary.run.handles;
  if (handles.steps_missed)
    words.push_back(format("try: handles were missed in %llu of %llu steps: %s, a shorter way, or a compliance",
                           static_cast<unsigned long long>(handles.steps_missed), static_cast<unsigned long long>(handles.steps),
                           host::is_full_shell(summary.scene.method) ? "shorter steps" : "more modes"));
}

// How far supports that move were from the fields that follow them.
void add_supports(const Summary &summary, std::vector<std::string> &words) {
  double most = 0;
  for (const FrameRecord &f : summary.run.frames) most = std::max(most, f.report.support_miss);
  if (most / summary.info.size > kUnseen)
    words.push_back("try: the shell beside supports that move is up to " + in_unit(most, summary.scene) +
                    " off them: more support_fields");
}

// What to try where a method is out of its range: the choice, which trains a reduced shell, and the full shell, of second order as the judge is.
std::string better_methods(uint32_t method, bool chosen) {
  const std::string full = std::string(host::method_name(SW_METHOD_SHELL_IMPLICIT)) + " --second-order";
  return chosen || host::needs_fields(method) ? full : std::string(host::method_name(SW_METHOD_AUTO)) + " or " + full;
}

// An estimate of more than the motion itself says only that it is wrong.
std::string percent(double share) {
  if (share > 1) return "more than 100 %";
  return share < 1e-4 ? "less than 0.01 %" : format(share < 0.1 ? "%.2g %%" : "%.0f %%", 100 * share);
}

std::string about(double share) { return (share < 1e-4 || share > 1 ? "" : "about ") + percent(share); }

// The frame that is furthest off, by length: a large share of a displacement that is small itself says little.
const ErrorEstimate &worst_estimate(const Run &run) {
  const auto less = [](const ErrorEstimate &a, const ErrorEstimate &b) { return a.error * a.displacement < b.error * b.displacement; };
  return *std::max_element(run.estimates.begin(), run.estimates.end(), less);
}

double most_moved(const Run &run) {
  double most = 0;
  for (const ErrorEstimate &e : run.estimates) most = std::max(most, e.displacement);
  return most;
}

// Its error as a share of the largest displacement of the frames that were judged.
double share_of_most(const Run &run, const ErrorEstimate &estimate) {
  const double most = most_moved(run);
  return most > 0 ? estimate.error * estimate.displacement / most : estimate.error;
}

// How far off the run is at its worst and at its end, both of the largest displacement.
std::string error_words(const Run &run, const ErrorEstimate &worst, double share) {
  const std::string of = " off the full nonlinear shell";
  const std::size_t n = run.estimates.size();
  const SwCertificate &last = *run.certificate;
  if (run.equilibrium && last.corrected_error != last.error)
    return "certified: the equilibrium is " + about(last.corrected_error) + of + " after Newton steps of it, " + about(last.error) + " before";
  if (n < 2) return "certified: the last frame is " + about(last.error) + of;
  const std::string text = "certified: " + about(share) + " of the largest displacement" + of;
  if (&worst == &run.estimates.back()) return text + format(" in the last frame, the worst of %zu judged", n);
  return text + format(" at %.3g s, the worst of %zu frames judged; ", worst.seconds, n) + about(share_of_most(run, run.estimates.back())) + " in the last one";
}

// Of a share of the motion, which is known roughly or well.
bool not_to_be_trusted(double share, bool roughly) { return share > (roughly ? kOutOfRange : kMisleading); }

// What is known of the error of all that is seen, and of what nobody knows it.
struct ErrorParts {
  double sum = 0;
  bool rough = false;
  std::vector<std::string> known, unknown;

  void add(double share, const std::string &what) {
    sum += share;
    known.push_back(percent(share) + " " + what);
  }
};

void add_method_error(const Summary &summary, ErrorParts &parts) {
  const Run &run = summary.run;
  if (host::is_full_shell(method_taken(summary))) return;
  if (!run.certificate) return parts.unknown.push_back("the method");
  const std::size_t n = run.estimates.size();
  parts.add(method_error(run), "method (against the full shell" + (n > 1 ? format(" at %zu frames", n) : std::string(" in the last frame")) +
                                   (method_error(run) > 1 ? ", where no balance is near: --compare shell-implicit measures it)" : ")"));
  parts.rough = run.certificate->remaining > kRoughAbove;
}

// The one number: parts may add up, so it is their sum.
std::string total_error(const Summary &summary) {
  ErrorParts parts;
  add_method_error(summary, parts);
  if (!summary.run.step_estimate && !summary.scene.is_static) parts.unknown.push_back("the time step");
  if (const std::optional<StepEstimate> &step = summary.run.step_estimate) {
    if (step->failed.empty()) parts.add(step->error, "time step (against steps twice as long" + (step->until > 0 ? format(", up to %.3g s)", step->until) : std::string(")")));
    else parts.unknown.push_back("the time step");
  }
  if (summary.proxy) {
    if (summary.proxy->difference) parts.add(*summary.proxy->difference, "proxy (against its file at rest under gravity, to first order)");
    else parts.unknown.push_back("the proxy");
  }
  const uint32_t method = method_taken(summary);
  std::string text = std::string("method ") + host::method_name(method);
  const bool full = host::is_full_shell(method), taken = host::needs_choice(summary.scene.method) || summary.scene.by_auto;
  if (full || taken) text += std::string(" (") + (full ? "the full shell, by which others are judged" : "") + (full && taken ? "; " : "") + (taken ? "taken by auto" : "") + ")";
  if (summary.proxy) text += format(" on a proxy of %u vertices", summary.info.n_vertices);
  if (parts.known.empty()) return "";
  const bool at_least = !parts.unknown.empty() || (!full && method_error(summary.run) > kOutOfRange);  // then the motion takes another way, too
  text += "; its error " + (at_least && parts.sum <= 1 ? "at least " + percent(parts.sum) : about(parts.sum)) + " of the motion" + (parts.rough ? ", roughly" : "");
  for (std::size_t k = 0; k < parts.known.size(); ++k) text += (k ? ", " : ": ") + parts.known[k];
  const bool of_steps = full && summary.run.step_estimate && not_to_be_trusted(summary.run.step_estimate->error, false) && !not_to_be_trusted(parts.sum - summary.run.step_estimate->error, false);
  if (of_steps) text += "; trust its shapes, not when they come";
  else if (not_to_be_trusted(parts.sum, false) || not_to_be_trusted(method_error(summary.run), parts.rough)) text += "; do not trust the picture";
  for (std::size_t k = 0; k < parts.unknown.size(); ++k) text += (k ? ", " : "; not counted, as not known: ") + parts.unknown[k];
  return text;
}

}  // namespace

std::vector<std::string> closing_words(const Summary &summary) {
  std::vector<std::string> words = {motion_words(summary)};
  add_contact(summary, words);
  const bool falling = falls(summary), moved = !falling && widest_frame(summary.run).report.max_displacement > 0;
  if (const std::string total = moved ? total_error(summary) : ""; !total.empty()) words.push_back(total);
  if (const std::string error = !moved ? "" : verdict(summary.run, host::needs_choice(summary.scene.method), summary.compared); !error.empty()) words.push_back(error);
  add_full_shell(summary, words);
  add_folds(summary, words);
  add_size_of_motion(summary, words);
  add_turns(summary, words);
  add_method(summary, words);
  add_step_error(summary, words);
  add_proxy(summary, words);
  add_handles(summary, words);
  add_supports(summary, words);
  if (const uint64_t early = summary.run.frames.back().report.unconverged_steps)
    words.push_back(format("try: %llu steps ended short of their tolerance: a quarter of the step helps (--steps-per-frame %u, steps_per_frame)",
                           static_cast<unsigned long long>(early), 4 * summary.scene.steps_per_frame));
  if (summary.run.interrupted)
    words.push_back(format("note: stopped after %.3g s of %.3g", summary.run.frames.back().report.time, summary.scene.duration));
  for (const std::string &warning : summary.warnings) words.push_back("note: " + warning);
  if (falling) words.push_back(falling_words(summary));
  else if (summary.info.zero_modes)
    words.push_back(format("note: nothing resists %u of the modes: the shell floats or turns freely", summary.info.zero_modes));
  return words;
}

double method_error(const Run &run) {
  if (!run.certificate || host::is_full_shell(run.certificate->method)) return 0;
  if (run.equilibrium) return run.certificate->corrected_error;  // of what is shown
  return run.estimates.empty() ? run.certificate->error : share_of_most(run, worst_estimate(run));
}

std::string verdict(const Run &run, bool chosen, bool compared) {
  if (!run.uncertified.empty()) return "not certified: the error could not be estimated: " + run.uncertified;
  if (!run.certificate || host::is_full_shell(run.certificate->method)) return "";
  const SwCertificate &found = *run.certificate;
  const ErrorEstimate alone{0, found.error, 0};
  const ErrorEstimate &worst = run.estimates.empty() ? alone : worst_estimate(run);
  const double share = run.equilibrium ? found.corrected_error : run.estimates.empty() ? found.error : share_of_most(run, worst);
  std::string text = error_words(run, worst, share);
  const bool lost = found.remaining > kRoughAbove;
  if (lost) text += ", roughly, as no balance of the full shell is near it";
  // A share of all that moves says little where hardly anything does.
  if (const double moved = most_moved(run); moved > 0 && found.max_error > kMuchMore * moved)
    text += format("; the full shell is %.2g times as far from the last frame as anything has moved", found.max_error / moved);
  if (not_to_be_trusted(share, lost)) text += "; do not trust the picture";
  const bool full_alone = chosen || run.supports_move;  // other accurate methods do not follow such supports
  if (!compared && share > kOutOfRange) text += "; use --method " + better_methods(found.method, full_alone);
  return text;
}

}  // namespace cli

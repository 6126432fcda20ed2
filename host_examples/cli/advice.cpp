#include "advice.hpp"

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

std::string in_unit(double length, const Scene &scene) {
  return format("%.3g", length) + (scene.length_unit.empty() ? "" : " " + scene.length_unit);
}

std::string share_of_size(double share) {
  if (share >= 1) return format("%.2g times its size", share);
  if (share >= 0.1) return format("%.0f %% of its size", 100 * share);
  return share >= kUnseen ? format("%.2g %% of its size", 100 * share) : format("%.1e of its size", share);
}

const FrameRecord &widest_frame(const Run &run) {
  return *std::max_element(run.frames.begin(), run.frames.end(), [](const FrameRecord &a, const FrameRecord &b) {
    return a.report.max_displacement < b.report.max_displacement;
  });
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

std::string motion_words(const Summary &summary) {
  const FrameRecord &widest = widest_frame(summary.run), &last = summary.run.frames.back();
  const double most = widest.report.max_displacement;
  std::string words = "moved: up to " + in_unit(most, summary.scene) + ", " + share_of_size(most / summary.info.size) +
                      " of " + in_unit(summary.info.size, summary.scene);
  if (!summary.scene.is_static) words += format(", at %.3g s", widest.report.time);
  words += "; turned up to " + degrees(most_turned(summary.run));
  if (&last != &widest) words += "; at the end by " + in_unit(last.report.max_displacement, summary.scene);
  return words;
}

std::string slowest_swing(const Summary &summary) {
  for (const double hertz : summary.frequencies)
    if (hertz > 0) return format("Its slowest swing has %.3g Hz", hertz);
  return "Nothing in it swings";
}

bool loaded(const Scene &scene) {
  const std::array<double, 3> none{};
  return scene.gravity != none || scene.loads.wind || !scene.loads.forces.empty();
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
  return "note: nothing has moved: no gravity, force or wind, no moving frame, no handle, no moving collider";
}

void add_size_of_motion(const Summary &summary, std::vector<std::string> &words) {
  const double share = widest_frame(summary.run).report.max_displacement / summary.info.size;
  const bool led = summary.scene.motion.moves() || !summary.scene.handles.empty() || any_moves(summary.scene.colliders) || any_moves(summary.scene);
  if (share == 0) {
    words.push_back(stillness(summary));
  } else if (share < kUnseen && loaded(summary.scene) && !led) {
    words.push_back("try: " + share_of_size(share) + " cannot be seen: are lengths in metres, and gravity 9.8? --scale 0.01 (scale) "
                    "makes metres of centimetres. " + slowest_swing(summary) + ": a lower --frequency (frequency) or k_bend softens it, and --material NAME (preset) takes a known sheet");
  } else if (share > kWild && !led && summary.info.zero_modes == 0) {
    words.push_back("try: no held shell moves by " + share_of_size(share) + ": are lengths in metres, and gravity 9.8? " +
                    slowest_swing(summary) + ": a higher --frequency (frequency) or k_bend stiffens it, and --material NAME (preset) takes a known sheet");
  }
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

void add_handles(const Summary &summary, std::vector<std::string> &words) {
  const HandleFigures &handles = summary.run.handles;
  if (handles.steps_missed)
    words.push_back(format("try: handles were missed in %llu of %llu steps: more modes, a shorter way, or a compliance",
                           static_cast<unsigned long long>(handles.steps_missed),
                           static_cast<unsigned long long>(handles.steps)));
}

// How far supports that move were from the fields that follow them.
void add_supports(const Summary &summary, std::vector<std::string> &words) {
  double most = 0;
  for (const FrameRecord &f : summary.run.frames) most = std::max(most, f.report.support_miss);
  if (most / summary.info.size > kUnseen)
    words.push_back("try: the shell beside supports that move is up to " + in_unit(most, summary.scene) +
                    " off them: more support_fields");
}

// What to try where a method is out of its range: from the reduced shells and the choice to the full shell.
std::string better_methods(uint32_t method) {
  std::string names;
  if (!host::needs_fields(method))
    for (const uint32_t other : host::methods())
      if (host::needs_fields(other) || host::needs_choice(other)) names += std::string(host::method_name(other)) + ", ";
  if (!names.empty()) names.replace(names.size() - 2, 2, " or ");
  return names + host::method_name(SW_METHOD_SHELL_IMPLICIT);
}

}  // namespace

std::vector<std::string> closing_words(const Summary &summary) {
  std::vector<std::string> words = {motion_words(summary)};
  add_contact(summary, words);
  if (const std::string error = verdict(summary.run); !error.empty()) words.push_back(error);
  add_size_of_motion(summary, words);
  add_turns(summary, words);
  add_handles(summary, words);
  add_supports(summary, words);
  if (const uint64_t early = summary.run.frames.back().report.unconverged_steps)
    words.push_back(format("try: %llu steps ended short of their tolerance: shorter steps help",
                           static_cast<unsigned long long>(early)));
  for (const std::string &warning : summary.warnings) words.push_back("note: " + warning);
  if (summary.info.zero_modes)
    words.push_back(format("note: nothing resists %u of the modes: the shell floats or turns freely", summary.info.zero_modes));
  return words;
}

std::string verdict(const Run &run) {
  if (!run.uncertified.empty()) return "not certified: the error could not be estimated: " + run.uncertified;
  if (!run.certificate || host::is_full_shell(run.certificate->method)) return "";
  const SwCertificate &found = *run.certificate;
  const double percent = 100 * found.error;
  std::string text = "certified: the last frame is about " + format(percent < 10 ? "%.2g" : "%.0f", percent) +
                     " % off the full nonlinear shell";
  if (found.remaining > kRoughAbove) text += ", roughly";
  const std::string follows = host::method_name(SW_METHOD_SHELL_IMPLICIT);  // other accurate methods do not follow such supports
  if (found.out_of_range) text += "; use --method " + (run.supports_move ? follows : better_methods(found.method));
  return text;
}

}  // namespace cli

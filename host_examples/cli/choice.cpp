#include "choice.hpp"

#include "advice.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "support_motion.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

namespace {

constexpr double kLimp = 40;           // above it training finds few equilibria, or a reduced shell that misses nearly all of the motion: a skirt and a kite of cotton have 60 to 100
constexpr uint32_t kMost = 5000;       // vertices that the full shell is taken for by itself
constexpr uint32_t kQuick = 1000;      // and up to which nothing need be said
constexpr double kPatience = 300;      // s, of a run that is begun again, or that is not put on a proxy
constexpr double kBriefly = 60;        // s, below which no time need be told
constexpr double kWrong = 0.5;         // of the motion: most of what is seen
constexpr double kDoubtful = 0.2;      // estimates at moments say little beyond it, as the motion takes another way

// Of a step of second order by limp cloth, with its twin beside: 0.11, 0.31 and 0.64 s without with 416, 748 and 1,092 vertices (a skirt in gusts, two busy cores), 8 to 15 with 4,100.
constexpr double kSeconds = 0.9, kVertices = 1100, kPower = 1.8;
constexpr uint32_t kMostSteps = 64;  // a frame, that are taken unasked: of a reduced shell they are done before the page is written
constexpr double kAim = 130;  // s, of a run on a proxy, or by more steps, that is taken by itself

double bending_stiffness(const Material &m) {
  return m.sheet ? m.young * std::pow(m.thickness, 3) / (12 * (1 - m.poisson * m.poisson)) : 6 * m.k_bend;
}

double load_of_area(const Scene &scene) {
  const Material &m = scene.material;
  const auto &g = scene.gravity;
  double load = (m.sheet ? m.volume_density * m.thickness : m.density) * std::hypot(g[0], g[1], g[2]);
  if (const std::optional<Wind> &wind = scene.loads.wind) {
    const double fastest = (1 + wind->gust) * std::hypot(wind->velocity[0], wind->velocity[1], wind->velocity[2]);
    load = std::max(load, 0.5 * wind->density * wind->normal_drag * fastest * fastest);
  }
  return load;
}

void take_full_shell(Scene &scene) {
  scene.method = SW_METHOD_SHELL_IMPLICIT;
  scene.by_auto = true;
  if (!scene.integrator) scene.integrator = SW_INTEGRATOR_SECOND_ORDER;
}

// What a run by the full shell takes, limp or not: what is not takes fewer iterations a step.
double seconds_of_run(const Scene &scene, const Mesh &mesh, double steps) {
  constexpr double kStiff = 0.15;  // petals and leaves in gusts took 0.06 to 0.2 of it
  return seconds_of_full_shell(mesh.n_vertices(), steps) * (limpness(scene, mesh) > kLimp ? 1 : kStiff);
}

double steps_of(const Scene &scene, uint32_t n_frames) { return static_cast<double>(n_frames) * scene.steps_per_frame; }

// What fewer vertices would make of it; empty where it is quick, or a proxy already.
std::string advice_of_proxy(const Scene &scene, const Mesh &mesh, uint32_t n_frames) {
  if (mesh.proxy || mesh.n_vertices() <= kQuick || scene.is_static) return "";
  const double steps = steps_of(scene, n_frames);
  const uint32_t half = mesh.n_vertices() / 200 * 100, quick = std::min(half, vertices_for_minutes(steps));
  const auto of = [&](uint32_t n) { return "--proxy " + std::to_string(n) + " (proxy) " + duration_words(seconds_of_full_shell(n, steps)); };
  return "; here " + duration_words(seconds_of_full_shell(mesh.n_vertices(), steps)) + ", " + of(half) + (quick < half ? ", " + of(quick) : "") +
         ": it simulates fewer vertices, the file's follow, and how far off they are is told";
}

}  // namespace

bool may_be_full(const Scene &scene) {
  return host::needs_choice(scene.method) && !(scene.auto_error > 0) && !(scene.auto_operations > 0) && !scene.reduced.fields && !scene.reduced.poses && !scene.sagged &&
         !scene.comparison && !any_moves(scene);
}

double limpness(const Scene &scene, const Mesh &mesh) {
  const double stiffness = bending_stiffness(scene.material), load = load_of_area(scene);
  if (scene.material.by_look() || !(load > 0) || !(stiffness > 0)) return 0;
  const Bounds box = bounds(mesh);
  return std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]) / std::cbrt(stiffness / load);
}

double seconds_of_full_shell(uint32_t n_vertices, double steps) { return steps * kSeconds * std::pow(n_vertices / kVertices, kPower); }

std::string duration_words(double seconds) {
  return seconds < 90 ? format("about %.0f s", std::max(seconds, 1.0)) : seconds < 5400 ? format("about %.0f minutes", seconds / 60) : format("about %.0f hours", seconds / 3600);
}

uint32_t vertices_for_minutes(double steps) {
  const double n = kVertices * std::pow(kAim / (kSeconds * steps), 1 / kPower);
  return static_cast<uint32_t>(std::clamp(std::round(n / 100), 4.0, 20.0)) * 100;
}

std::string settle_early(const Mesh &mesh, uint32_t n_frames, bool on_page, Scene &scene) {
  const bool limp = limpness(scene, mesh) > kLimp;
  const double seconds = seconds_of_full_shell(mesh.n_vertices(), steps_of(scene, n_frames));
  if (scene.method == SW_METHOD_SHELL_IMPLICIT) {
    const std::string advice = limp && seconds > kBriefly ? advice_of_proxy(scene, mesh, n_frames) : "";
    return advice.empty() ? "" : "the full shell takes long on " + std::to_string(mesh.n_vertices()) + " vertices of limp cloth" + advice;
  }
  if (!limp || !may_be_full(scene) || scene.is_static) return "";
  const std::string what = "auto is the full shell, whose steps take long: the shell is limp, " + format("%.0f times as wide as the length at which it bends by itself", limpness(scene, mesh)) + ", and reduced shells miss its folds";
  const uint32_t quick = vertices_for_minutes(steps_of(scene, n_frames));
  if (on_page && seconds > kPatience && !mesh.proxy && !scene.weld && scene.render_path.empty() && quick < 2 * mesh.n_vertices() / 3) {
    scene.proxy.vertices = quick;
    take_full_shell(scene);
    return what + format(". The %u vertices would take ", mesh.n_vertices()) + duration_words(seconds) + format(": it takes a proxy of about %u, which takes ", quick) +
           duration_words(seconds_of_full_shell(quick, steps_of(scene, n_frames))) + "; --proxy says how many, and --method shell-implicit simulates all";
  }
  if (mesh.n_vertices() > kMost) return "";
  take_full_shell(scene);
  return what + (seconds > kBriefly ? advice_of_proxy(scene, mesh, n_frames) : "");
}

std::string settle_choice(const shellwarp::Model &model, const Mesh &mesh, uint32_t n_frames, Scene &scene) {
  if (!host::needs_choice(scene.method) || !model.front().empty()) return "";
  const SwModelInfo info = model.info();
  const bool has_fields = sw_model_offers(model.get(), SW_METHOD_REDUCED_SHELL) == SW_OK;
  const std::string why = has_fields ? format("fields miss %.0f %% or more in half of their training", 100 * info.training_error_median) : sw_last_error_message();
  const bool limp = !has_fields && why.find("too few to judge") != std::string::npos && mesh.n_vertices() <= kMost && !any_moves(scene) && !scene.reduced.poses;
  if (info.auto_method != SW_METHOD_SHELL_IMPLICIT && !limp)
    return has_fields ? "" : std::string("auto is the ") + host::method_name(info.auto_method) + ": " + why;
  const bool has_polynomial = has_fields && sw_model_offers(model.get(), SW_METHOD_POLYNOMIAL_SHELL) == SW_OK;
  const uint32_t fast = has_polynomial ? SW_METHOD_POLYNOMIAL_SHELL : has_fields ? SW_METHOD_REDUCED_SHELL : SW_METHOD_WARP;
  take_full_shell(scene);
  return "auto is the full shell, whose steps take long: " + why + ". --method " + host::method_name(fast) + " is fast, and told how far off" + advice_of_proxy(scene, mesh, n_frames);
}

void settle_corrections(const shellwarp::Model &model, Scene &scene) {
  if (scene.correction_steps != SW_STEPS_AUTO) return;
  const uint32_t method = host::method_taken(scene.method, model.info());
  const bool by_fields = method == SW_METHOD_POLYNOMIAL_SHELL || method == SW_METHOD_REDUCED_SHELL || method == SW_METHOD_ADAPTIVE_SHELL;
  if (!scene.is_static || !by_fields || scene.push_out || scene.deterministic) scene.correction_steps = 0;
}

std::string settle_steps(const Mesh &mesh, uint32_t n_frames, uint32_t method, const Run &run, Scene &scene) {
  const std::optional<StepEstimate> &found = run.step_estimate;
  if (!scene.steps_open || run.interrupted || !found || !found->failed.empty() || found->error <= kCoarseMotion) return "";
  const uint32_t steps = std::min(kMostSteps, times_as_many_steps(found->error, order_of_steps(scene, method)) * scene.steps_per_frame);
  if (steps <= scene.steps_per_frame) return "";
  const double seconds = seconds_of_run(scene, mesh, static_cast<double>(n_frames) * steps);
  if (host::is_full_shell(method) && seconds > kAim) return "";
  const std::string before = format("steps of %.2g s cost about %.0f %% of the motion", scene.step(), 100 * found->error);
  scene.steps_per_frame = steps;
  return before + format("; the same again, by %u steps of %.2g s a frame", steps, scene.step()) + (host::is_full_shell(method) ? ", " + duration_words(seconds) : "");
}

std::string settle_late(const shellwarp::Model &model, const Mesh &mesh, uint32_t n_frames, uint32_t wanted, const Run &run, Scene &scene) {
  if (!may_be_full(scene) || !model.front().empty() || scene.is_static || run.interrupted) return "";
  const auto seconds = [&](uint32_t steps) { return seconds_of_run(scene, mesh, static_cast<double>(n_frames) * steps); };
  const double share = method_error(run);
  const bool briefly = scene.steps_open && share > kDoubtful && seconds(scene.steps_per_frame) <= kBriefly;  // of a scene, which says its steps, the method stays
  const bool patiently = share > kWrong && seconds_of_full_shell(mesh.n_vertices(), steps_of(scene, n_frames)) <= kPatience;
  if (mesh.n_vertices() > kMost || !(briefly || patiently)) return "";
  const std::string first = host::method_name(model.info().auto_method);
  uint32_t steps = scene.steps_open ? wanted : scene.steps_per_frame;
  while (steps > scene.steps_per_frame && seconds(steps) > kAim) --steps;
  scene.steps_per_frame = steps;
  take_full_shell(scene);
  return "auto is the full shell: the " + first + ", which ran first, is about " + format("%.0f %%", 100 * share) + " of the motion off it; the same again" +
         (steps > 1 ? format(", by %u steps of %.2g s a frame", steps, scene.step()) : "") + ", " + duration_words(seconds(steps));
}

}  // namespace cli

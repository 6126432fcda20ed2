#include "summary.hpp"

#include "advice.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "progress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

namespace cli {

namespace {

// Newton's method stops at a residual of 1e-8 of the load; positions of modal methods have seven digits.
constexpr double kRoundingOfEnergy = 1e-6;

void row(const char *label, const std::string &value, const std::optional<double> &paper = std::nullopt) {
  std::printf("  %-30s %14s", label, value.c_str());
  if (paper) std::printf(" %14g", *paper);
  std::putchar('\n');
}

void heading(const char *text) { std::printf("%s\n", text); }

std::string count(uint64_t n) { return format("%llu", static_cast<unsigned long long>(n)); }

std::string seconds(double s) { return format("%.3f s", s); }

std::string bytes(uint64_t n) {
  const double size = static_cast<double>(n);
  if (size < 1024) return format("%.0f B", size);
  if (size < 1024 * 1024) return format("%.1f KiB", size / 1024);
  return format("%.1f MiB", size / (1024 * 1024));
}

void print_mesh(const SwModelInfo &info, const PaperFigures &paper) {
  heading("mesh");
  row("vertices", count(info.n_vertices), paper.vertices);
  row("edges", count(info.n_edges), paper.edges);
  row("triangles", count(info.n_triangles), paper.triangles);
  row("components", count(info.n_components));
  if (info.n_unreferenced) row("vertices of no triangle", count(info.n_unreferenced));
  if (info.n_reoriented) row("triangles turned over", count(info.n_reoriented));
  row("held vertices", count(info.n_fixed));
  row("unknowns", count(info.n_unknowns));
}

void print_creases(const Material &material, const CreaseLists &creases) {
  if (!creases.edges.empty()) {
    row("creased edges", count(creases.edges.size()));
    const auto [low, high] = std::minmax_element(creases.factors.begin(), creases.factors.end());
    const std::string most = *low == *high ? "" : format(" to %g", *high);
    row("  factor of their stiffness", format("%g", *low) + most);
    const auto of_mesh = std::count(creases.angles.begin(), creases.angles.end(), SW_CREASE_ANGLE_OF_MESH);
    row("  with a rest angle", count(creases.edges.size() - static_cast<std::size_t>(of_mesh)));
    const auto yielding = std::count_if(creases.yields.begin(), creases.yields.end(), [](double limit) { return std::isfinite(limit); });
    if (yielding) row("  that yield", count(static_cast<std::size_t>(yielding)));
  }
  if (!material.rest_shape.empty()) row("shape without stress", std::filesystem::path(material.rest_shape).filename().string());
}

void print_material(const Material &material, const CreaseLists &creases) {
  const bool other = !creases.edges.empty() || !material.rest_shape.empty();
  if (material.sheet || material.by_look() || other) heading("material");
  if (material.sheet) {
    row("Young's modulus", format("%.5g", material.young));
    if (material.young_across > 0) row("  across its direction", format("%.5g", material.young_across));
    row("Poisson's ratio", format("%.5g", material.poisson));
    row("thickness", format("%.5g", material.thickness));
    row("mass per volume", format("%.5g", material.volume_density));
  }
  if (material.by_look()) {
    if (material.sag > 0) row("for a sag of", format("%g", material.sag));
    else row("for a slowest swing of", format("%g Hz", material.frequency));
    row("k_area", format("%.5g", material.k_area));
    row("k_length", format("%.5g", material.k_length));
    row("k_bend", format("%.5g", material.k_bend));
  }
  if (other) print_creases(material, creases);
}

void print_modes(const SwModelInfo &info, const std::vector<double> &hertz, const PaperFigures &paper) {
  heading("modes");
  row("modes", count(info.modes), paper.modes);
  row("zero modes", count(info.zero_modes));
  for (std::size_t k = 0; k < std::min<std::size_t>(hertz.size(), 8); ++k)
    row(format("frequency %zu", k + 1).c_str(), format("%.5g Hz", hertz[k]));
  if (hertz.size() > 8) row(format("frequency %zu", hertz.size()).c_str(), format("%.5g Hz", hertz.back()));
  row("largest relative residual", format("%.1e", info.residual));
  row("largest orthonormality error", format("%.1e", info.orthonormality));
  row("eigenvalues counted / found", count(info.inertia_count) + " / " + count(info.inertia_found));
  row("  below", format("%.6g 1/s^2", info.inertia_shift));
}

void print_precompute(const SwModelInfo &info, const PaperFigures &paper) {
  heading("precompute");
  double total = 0;
  for (uint32_t phase = 0; phase < SW_PHASE_CAPACITY; ++phase) {
    if (phase < SW_PHASE_COUNT || info.seconds[phase] > 0) row(phase_name(phase), seconds(info.seconds[phase]));
    total += info.seconds[phase];
  }
  row("total", seconds(total), paper.precompute_seconds);
}

void print_run(const SwModelInfo &info, const Run &run, const PaperFigures &paper) {
  heading("run");
  const double steps = static_cast<double>(run.steps), frames = static_cast<double>(run.frames.size() - 1);
  if (frames < 1 || run.steps == 0) return;
  const double per_step = run.step_seconds / steps;
  const double per_frame = (run.step_seconds + run.position_seconds) / frames;
  row("steps", count(run.steps));
  row("frames", count(run.frames.size() - 1));
  row("step", format("%.3f us", 1e6 * per_step));
  row("positions of all vertices", format("%.3f us", 1e6 * run.position_seconds / frames));
  row("steps/s, positions included", format("%.0f", steps / (per_frame * frames)), paper.steps_per_second);
  row("a step with positions", format("%.2f ns/vertex", 1e9 * per_frame * frames / steps / info.n_vertices));
}

void print_memory(const SwModelInfo &info) {
  heading("memory");
  row("model", bytes(info.bytes_model));
  row("state", bytes(info.bytes_state));
  row("most during precompute", bytes(info.bytes_precompute_peak));
}

// How far the shell is from rest.
double kinetic_share(const Run &run) {
  const SwStateReport &end = run.frames.back().report;
  return end.elastic_energy > 0 ? end.kinetic_energy / end.elastic_energy : end.kinetic_energy > 0 ? 1 : 0;
}

// Behind a length; none where the scene names none.
std::string length_unit(const Scene &scene) { return scene.length_unit.empty() ? "" : " " + scene.length_unit; }

// By name, and what the automatic choice took.
std::string method_words(const Scene &scene, const SwModelInfo &info) {
  const std::string name = host::method_name(scene.method);
  return host::needs_choice(scene.method) ? name + ": " + host::method_name(info.auto_method) : name;
}

void print_motion(const Scene &scene, const SwModelInfo &info, const Run &run) {
  heading("motion");
  row("method", method_words(scene, info));
  double rotation = 0;
  for (const FrameRecord &f : run.frames) rotation = std::max(rotation, f.report.max_rotation);
  const std::string named = length_unit(scene);
  const char *unit = named.c_str();
  row("largest displacement", format("%.6g%s", widest_frame(run).report.max_displacement, unit));
  row("displacement at the end", format("%.6g%s", run.frames.back().report.max_displacement, unit));
  row("largest local rotation", format("%.3f rad", rotation));
  if (const uint64_t early = run.frames.back().report.unconverged_steps) row("steps not converged", count(early));
  if (const double step_error = largest_step_error(run); step_error > 0) row("a step is off by at most", format("%.1e%s, estimated", step_error, unit));
  row("frames turned too far",
      count(static_cast<uint64_t>(std::count_if(run.frames.begin(), run.frames.end(),
                                                [](const FrameRecord &f) { return !f.report.turn_in_range; }))));
  if (run.largest_gain) row("most energy gained in a frame", format("%.1e of work", *run.largest_gain));
  if (!scene.is_static) row("kinetic energy at the end", format("%.1e of elastic", kinetic_share(run)));
}

void print_equilibrium(const SwEquilibriumReport &equilibrium) {
  heading("equilibrium");
  row("iterations", count(equilibrium.iterations));
  row("relative residual", format("%.1e", equilibrium.residual));
  row("time", format("%.2g s", equilibrium.seconds));
}

void print_certificate(const SwCertificate &certificate, const std::string &unit) {
  heading("error against the nonlinear shell, estimated");
  row("of the displacement", format("%.2g", certificate.error));
  row("largest", format("%.3g%s", certificate.max_error, unit.c_str()));
  row("at vertex", count(certificate.vertex));
  if (certificate.corrected_error != certificate.error) {
    row("of what is shown", format("%.2g", certificate.corrected_error));
    row("largest of what is shown", format("%.3g%s", certificate.corrected_max_error, unit.c_str()));
  }
  row("factorizations", count(certificate.factorizations));
  row("time", format("%.2g s", certificate.seconds));
  if (certificate.remaining > kRoughAbove) row("rough: force left unbalanced", format("%.1e", certificate.remaining));
}

void print_choice(const std::vector<SwFrontPoint> &front) {
  heading("choice of the method: error, operations of a step");
  for (const SwFrontPoint &p : front)
    std::printf("  %c %-*s%-8s %11s %11s %12.0f\n", p.chosen ? '*' : ' ', host::widest_method_name(),
                host::method_name(p.method), p.sagged ? " sagged" : "",
                p.fields ? (count(p.fields) + " fields").c_str() : "",
                p.failed ? "failed" : format("%.4g", p.error).c_str(), p.operations);
}

// In model sizes, or radians.
double handle_residual(const Summary &summary) {
  const HandleFigures &handles = summary.run.handles;
  return std::max(handles.position_residual / summary.info.size, handles.orientation_residual);
}

void print_handles(const Summary &summary) {
  const HandleFigures &handles = summary.run.handles;
  heading("handles");
  row("steps with a handle held", count(handles.steps));
  row("steps with all met", count(handles.steps - handles.steps_missed));
  row("worst residual of a position", format("%.1e", handles.position_residual));
  row("worst residual of a rotation", format("%.1e rad", handles.orientation_residual));
  row("most iterations in a step", count(handles.iterations));
}

}  // namespace

void print_summary(const Summary &summary) {
  const PaperFigures paper = summary.scene.paper.value_or(PaperFigures{});
  std::printf("%s\n", summary.scene.title.c_str());
  if (summary.scene.paper) std::printf("  %-30s %14s %14s\n", "", "here", paper.source.c_str());
  print_mesh(summary.info, paper);
  print_material(summary.scene.material, summary.creases);
  print_modes(summary.info, summary.frequencies, paper);
  print_precompute(summary.info, paper);
  if (!summary.run.equilibrium) print_run(summary.info, summary.run, paper);
  if (summary.run.equilibrium) print_equilibrium(*summary.run.equilibrium);
  print_motion(summary.scene, summary.info, summary.run);
  if (summary.run.certificate) print_certificate(*summary.run.certificate, length_unit(summary.scene));
  if (!summary.front.empty()) print_choice(summary.front);
  if (!summary.scene.handles.empty()) print_handles(summary);
  print_memory(summary.info);
  if (!paper.note.empty()) std::printf("%s: %s\n", paper.source.c_str(), paper.note.c_str());
  for (const std::string &sentence : closing_words(summary)) std::printf("%s\n", sentence.c_str());
}

std::vector<std::string> violations(const Summary &summary, bool whole) {
  const Expectations &expect = summary.scene.expect;
  const Run &run = summary.run;
  Judge judge;
  judge.equal("modes", summary.info.modes, expect.modes);
  judge.equal("zero modes", summary.info.zero_modes, expect.zero_modes);
  judge.within("lowest frequency", summary.frequencies.empty() ? 0 : summary.frequencies[0], expect.lowest_frequency);
  if (!run.all_finite) judge.sentences.push_back("positions: some are not finite");
  for (const FrameRecord &f : run.frames)
    if (expect.turn_in_range && !f.report.turn_in_range) {
      judge.sentences.push_back(
          format("turned too far at frame %u: local rotation %.3f rad", f.frame, f.report.max_rotation));
      break;
    }
  if (expect.handle_residual)
    judge.within("worst residual of handles", handle_residual(summary), Range{0, *expect.handle_residual});
  if (expect.handles_met && (run.handles.steps == 0 || run.handles.steps_missed > 0))
    judge.sentences.push_back(format("handles: met in %s of %s steps",
                                     count(run.handles.steps - run.handles.steps_missed).c_str(),
                                     count(run.handles.steps).c_str()));
  if (expect.energy_never_grows && !run.largest_gain)
    judge.sentences.push_back("energy: wind, handles, a moving frame or collider do work on the shell, so it cannot be judged");
  if (expect.energy_never_grows && run.largest_gain.value_or(0) > kRoundingOfEnergy)
    judge.sentences.push_back(
        format("energy: grew by %.1e of the work of the loads in frame %u", *run.largest_gain, run.frame_of_gain));
  if (whole && expect.settled)
    judge.within("kinetic energy at the end, of the elastic", kinetic_share(run), Range{0, *expect.settled});
  if (whole) {
    judge.within("largest displacement", widest_frame(run).report.max_displacement, expect.max_displacement);
    judge.within("displacement at the end", run.frames.back().report.max_displacement, expect.final_displacement);
  }
  return judge.sentences;
}

}  // namespace cli

#include "comparison.hpp"

#include "material_maps.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "output_file.hpp"
#include "progress.hpp"
#include "shell.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace cli {

namespace {

double distance(const std::vector<double> &a, const std::vector<double> &b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

ComparisonRow settle(const Scene &scene, const Mesh &mesh, const shellwarp::Model &model, ComparisonRow row) {
  Scene one = scene;
  one.method = row.method;
  const double length = std::hypot(scene.gravity[0], scene.gravity[1], scene.gravity[2]);
  for (double &g : one.gravity) g *= row.gravity / length;
  shellwarp::State state = make_state(one, mesh, model);
  try {
    row.residual = state.equilibrium(UntilInterrupted()).residual;
  } catch (const shellwarp::Error &error) {
    if (error.status() != SW_ERROR_NUMERICAL && error.status() != SW_ERROR_CANCELLED) throw;
    return row;  // this method has no answer here, which is a result, or was stopped
  }
  row.found = true;
  const SwStateReport report = state.report();
  row.max_displacement = report.max_displacement;
  row.turn_in_range = report.turn_in_range == 1;
  row.positions.resize(mesh.positions.size());
  state.positions(row.positions.data(), mesh.n_vertices());
  row.area_change = surface_area(row.positions, mesh.triangles) / surface_area(mesh.positions, mesh.triangles) - 1;
  return row;
}

// The nonlinear shell, then every method against it.
void add_case(const Scene &scene, const Mesh &mesh, const shellwarp::Model &model, const ComparisonRow &blank,
              std::vector<ComparisonRow> &rows) {
  ComparisonRow truth = blank;
  truth.method = SW_METHOD_SHELL_IMPLICIT;
  truth = settle(scene, mesh, model, truth);
  const double size = truth.found ? distance(truth.positions, mesh.positions) : 0;
  rows.push_back(truth);
  for (uint32_t method : scene.comparison->methods) {
    ComparisonRow row = blank;
    row.method = method;
    row = settle(scene, mesh, model, row);
    if (row.found && size > 0) row.error = distance(row.positions, truth.positions) / size;
    rows.push_back(row);
  }
}

std::string shape_name(const Scene &scene, const ComparisonRow &row) {
  return row.found ? scene.name + "_" + std::to_string(row.case_number) + "_" + host::method_name(row.method) + ".obj"
                   : "";
}

using Column = std::function<double(const ComparisonRow &)>;

std::vector<const ComparisonRow *> rows_of(const ComparisonRun &run, uint32_t method) {
  std::vector<const ComparisonRow *> rows;
  for (const ComparisonRow &row : run.rows)
    if (row.method == method) rows.push_back(&row);
  return rows;
}

std::string place(const ComparisonRow &row) {
  return format("%s at gravity %g, bending x %g", host::method_name(row.method), row.gravity, row.bending);
}

double error_of(const ComparisonRow &row) { return row.error; }
double area_of(const ComparisonRow &row) { return row.area_change; }

void judge_numbers(const ComparisonRun &run, const ComparisonNumbers &expected, const Column &column, const char *what,
                   double tolerance, Judge &judge) {
  const std::vector<const ComparisonRow *> rows = rows_of(run, expected.method);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::string where = std::string(what) + " of " + place(*rows[k]);
    judge.within(where.c_str(), column(*rows[k]), expected.range);
    if (expected.reference.empty()) continue;
    if (expected.reference.size() != rows.size())
      return judge.sentences.push_back(format("%s: %zu reference numbers of %s for %zu equilibria", what,
                                              expected.reference.size(), host::method_name(expected.method),
                                              rows.size()));
    const double reference = expected.reference[k];
    judge.within(where.c_str(), column(*rows[k]), Range{reference - tolerance, reference + tolerance});
  }
}

// Pairs of errors that must ascend: of two rows of one method, the second must be larger.
void judge_ascent(const ComparisonRow &smaller, const ComparisonRow &larger, const char *why, Judge &judge) {
  if (!(smaller.error < larger.error))
    judge.sentences.push_back(format("error of %s is %g, not below the %g of %s: %s", place(smaller).c_str(),
                                     smaller.error, larger.error, place(larger).c_str(), why));
}

void judge_order(const Scene &scene, const ComparisonRun &run, const ComparisonExpectations &expect, Judge &judge) {
  const std::vector<const ComparisonRow *> warp = rows_of(run, SW_METHOD_WARP), lma = rows_of(run, SW_METHOD_LMA);
  for (std::size_t k = 0; expect.warp_below_lma && k < std::min(warp.size(), lma.size()); ++k)
    judge_ascent(*warp[k], *lma[k], "the warp was to be nearer", judge);
  const std::size_t per_bending = scene.comparison->gravities.size();
  for (uint32_t method : scene.comparison->methods) {
    const std::vector<const ComparisonRow *> rows = rows_of(run, method);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (expect.errors_grow && (k + 1) % per_bending != 0)
        judge_ascent(*rows[k], *rows[k + 1], "errors were to grow with gravity", judge);
      if (expect.stiffer_differs_less && k + per_bending < rows.size())
        judge_ascent(*rows[k + per_bending], *rows[k], "stiffer was to differ less", judge);
    }
  }
}

}  // namespace

ComparisonRun compare(const Scene &scene, const Mesh &mesh, bool quiet) {
  ComparisonRun run{};
  ComparisonRow blank{};
  for (double bending : scene.comparison->bending) {
    Scene stiffened = scene;
    stiffen_bending(stiffened.material, bending);
    ProgressBar progress(quiet);
    const shellwarp::Model model = make_model(stiffened, mesh, progress);
    if (run.rows.empty()) {
      run.info = model.info();
      run.frequencies = model.frequencies();
    }
    blank.bending = bending;
    for (double gravity : scene.comparison->gravities) {
      blank.gravity = gravity;
      add_case(stiffened, mesh, model, blank, run.rows);
      ++blank.case_number;
      if (interrupted()) return run;
    }
  }
  return run;
}

void write_comparison(OutputFolder &folder, const Scene &scene, const Mesh &mesh, const ComparisonRun &run) {
  write_obj(folder, scene.name + "_rest.obj", mesh.positions, mesh);
  OutputFile table(folder, scene.name + "_comparison.csv");
  table.print("bending,gravity,method,error,area_change,residual,turn_in_range,max_displacement,obj\n");
  for (const ComparisonRow &row : run.rows) {
    const std::string shape = shape_name(scene, row);
    if (row.found) write_obj(folder, shape, row.positions, mesh);
    table.print("%g,%g,%s", row.bending, row.gravity, host::method_name(row.method));
    if (row.found)
      table.print(",%.9g,%.9g,%.3g,%d,%.9g,%s\n", row.error, row.area_change, row.residual, row.turn_in_range ? 1 : 0,
                  row.max_displacement, shape.c_str());
    else
      table.print(",,,,,,\n");
  }
  table.close();
}

void print_comparison(const Scene &scene, const ComparisonRun &run) {
  std::printf("%s\n", scene.title.c_str());
  std::printf("  %u vertices, %u modes, lowest frequency %.5g Hz\n", run.info.n_vertices, run.info.modes,
              run.frequencies.empty() ? 0.0 : run.frequencies[0]);
  std::printf("equilibria; error and area change are relative, error is that to the nonlinear shell (%s)\n",
              host::method_name(SW_METHOD_SHELL_IMPLICIT));
  const int width = host::widest_method_name();
  std::printf("  %8s %8s  %-*s %11s %11s %11s %10s  %s\n", "bending", "gravity", width, "method", "moved by", "error",
              "area change", "residual", "turn in range");
  for (const ComparisonRow &row : run.rows) {
    std::printf("  %7gx %8g  %-*s ", row.bending, row.gravity, width, host::method_name(row.method));
    if (row.found)
      std::printf("%11.5g %11.5f %+11.2e %10.1e  %s\n", row.max_displacement, row.error, row.area_change, row.residual,
                  row.turn_in_range ? "yes" : "no");
    else
      std::printf("no equilibrium found\n");
  }
}

std::vector<std::string> violations(const Scene &scene, const ComparisonRun &run) {
  const ComparisonExpectations &expect = scene.comparison->expect;
  Judge judge;
  judge.equal("modes", run.info.modes, expect.modes);
  judge.within("lowest frequency", run.frequencies.empty() ? 0 : run.frequencies[0], expect.lowest_frequency);
  for (const ComparisonRow &row : run.rows) {
    if (!row.found) judge.sentences.push_back("no equilibrium of " + place(row));
    if (row.found && expect.turn_in_range && !row.turn_in_range)
      judge.sentences.push_back("turned too far: " + place(row));
  }
  for (const ComparisonNumbers &n : expect.errors) judge_numbers(run, n, error_of, "error", expect.tolerance, judge);
  for (const ComparisonNumbers &n : expect.area_changes)
    judge_numbers(run, n, area_of, "area change", expect.tolerance, judge);
  judge_order(scene, run, expect, judge);
  return judge.sentences;
}

}  // namespace cli

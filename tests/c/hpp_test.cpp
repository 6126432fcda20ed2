// The C++ wrapper: ownership, exceptions, overloads; and the threads that the C interface allows.
#include "shellwarp.hpp"

#include "test_support.h"

#include <array>
#include <functional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using shellwarp::Model;
using shellwarp::State;

static_assert(!std::is_copy_constructible<Model>::value && !std::is_copy_assignable<Model>::value,
              "a model is not copied");
static_assert(!std::is_copy_constructible<State>::value && !std::is_copy_assignable<State>::value,
              "a state is cloned instead");
static_assert(std::is_nothrow_move_constructible<Model>::value && std::is_nothrow_move_assignable<Model>::value, "");
static_assert(std::is_nothrow_move_constructible<State>::value && std::is_nothrow_move_assignable<State>::value, "");

Model make_model(uint32_t modes = 4) {
  const Strip strip = make_strip();
  SwSupportDesc supports = shellwarp::support_desc();
  supports.clamped = strip.held;
  supports.n_clamped = STRIP_ROWS;
  Model model(shellwarp::mesh_desc(strip.positions, STRIP_VERTICES, strip.triangles, STRIP_TRIANGLES),
              shellwarp::material_desc(), supports);
  SwPrecomputeDesc desc = shellwarp::precompute_desc();
  desc.modes = modes;
  model.precompute(desc);
  return model;
}

State make_state(const Model &model) {
  State state(model);
  state.set_gravity(0, 0, -0.4);
  return state;
}

using Positions = std::array<double, 3 * STRIP_VERTICES>;

Positions run(State &state, int steps) {
  Positions x;
  for (int k = 0; k < steps; ++k) state.step(1.0 / 30);
  state.positions(x.data(), STRIP_VERTICES);
  return x;
}

void moving_hands_the_object_over() {
  Model model = make_model();
  SwModel *handle = model.get();
  Model other = std::move(model);
  CHECK(other.get() == handle && model.get() == nullptr);
  State state = make_state(other);
  State next = make_state(other);
  next = std::move(state);  // the state that `next` held is destroyed
  CHECK(state.get() == nullptr && next.get() != nullptr);
  next.step(0.1);
}

void a_saved_model_is_loaded_with_the_same_bytes() {
  const Model model = make_model();
  const std::vector<unsigned char> bytes = model.save();
  const Model loaded = Model::load(bytes);
  CHECK(loaded.save() == bytes);
  State one = make_state(model), other = make_state(loaded);
  CHECK(run(one, 30) == run(other, 30));
  SwStatus status = SW_OK;
  try {
    Model::load(std::vector<unsigned char>(bytes.begin(), bytes.end() - 1));
  } catch (const shellwarp::Error &error) {
    status = error.status();
  }
  CHECK(status == SW_ERROR_INVALID_DATA);
}

void a_failed_call_throws_its_status_and_message() {
  const Model model = make_model();
  State state(model);
  bool thrown = false;
  try {
    state.step(-1);
  } catch (const shellwarp::Error &error) {
    thrown = error.status() == SW_ERROR_INVALID_ARGUMENT && strstr(error.what(), "step") != nullptr;
  }
  CHECK(thrown);
}

void a_constructor_that_fails_throws() {
  const double x[9] = {0, 0, 0, 1, 0, 0, 2, 0, 0};
  const uint32_t t[3] = {0, 1, 2};
  SwStatus status = SW_OK;
  try {
    const Model model(shellwarp::mesh_desc(x, 3, t, 1));
  } catch (const shellwarp::Error &error) {
    status = error.status();
  }
  CHECK(status == SW_ERROR_INVALID_MESH);
}

void a_moved_from_object_is_a_null_handle() {
  Model model = make_model();
  State state = make_state(model);
  const State taken = std::move(state);
  SwStatus status = SW_OK;
  try {
    state.step(0.1);
  } catch (const shellwarp::Error &error) {
    status = error.status();
  }
  CHECK(status == SW_ERROR_INVALID_ARGUMENT);
}

void overloads_choose_the_format() {
  const Model model = make_model();
  State state = make_state(model);
  const Positions x = run(state, 20);
  std::array<float, 3 * STRIP_VERTICES> single;
  state.positions(single.data(), STRIP_VERTICES);
  // Four units in the last place of the strip's length, as the header says.
  for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(single[i], x[i], 4 * STRIP_LENGTH / 8388608);

  std::array<float, 4 * STRIP_VERTICES> rotations;
  std::array<double, 4 * STRIP_VERTICES> exact;
  state.rotations(rotations.data(), STRIP_VERTICES, SW_SPACE_FRAME);
  state.rotations(exact.data(), STRIP_VERTICES, SW_SPACE_FRAME);
  for (std::size_t i = 0; i < exact.size(); ++i) CHECK(rotations[i] == static_cast<float>(exact[i]));

  state.normals(single.data(), STRIP_VERTICES, SW_SPACE_FRAME);
  Positions normals;
  state.normals(normals.data(), STRIP_VERTICES, SW_SPACE_FRAME);
  for (std::size_t i = 0; i < normals.size(); ++i) CHECK(single[i] == static_cast<float>(normals[i]));

  Positions shape;
  model.mode_shape(0, SW_SHAPE_ROTATION, shape.data(), STRIP_VERTICES);
  model.mode_shape(0, SW_SHAPE_ROTATION, single.data(), STRIP_VERTICES);
  for (std::size_t i = 0; i < shape.size(); ++i) CHECK(single[i] == static_cast<float>(shape[i]));
}

void a_pose_read_is_set_again() {
  const Model model = make_model();
  State state = make_state(model), other(model);
  const Positions x = run(state, 20);
  std::array<float, 3 * STRIP_VERTICES> single;
  for (std::size_t i = 0; i < x.size(); ++i) single[i] = static_cast<float>(x[i]);
  // A millionth of what moves, as the header says, which is less than the strip; floats have seven digits.
  const double tolerance = 1e-6 * STRIP_LENGTH;
  CHECK(other.set_pose(single.data(), STRIP_VERTICES) < tolerance);
  CHECK(other.set_pose(x.data(), STRIP_VERTICES) < tolerance);
  Positions y;
  other.positions(y.data(), STRIP_VERTICES);
  for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(y[i], x[i], tolerance);
  CHECK(other.report().kinetic_energy == 0);
  const Strip rest = make_strip();
  Positions velocity;
  for (std::size_t i = 0; i < x.size(); ++i) velocity[i] = 0.1 * (x[i] - rest.positions[i]);
  other.set_pose(x.data(), STRIP_VERTICES, velocity.data(), SW_SPACE_FRAME);
  CHECK(other.report().kinetic_energy > 0);
}

void floats_and_doubles_make_the_same_mesh() {
  const Strip strip = make_strip();
  std::array<float, 3 * STRIP_VERTICES> points;
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(strip.positions[i]);
  const Model model(shellwarp::mesh_desc(points.data(), STRIP_VERTICES, strip.triangles, STRIP_TRIANGLES));
  CHECK(model.info().n_vertices == STRIP_VERTICES);
  CHECK_NEAR(model.info().total_area, STRIP_LENGTH * STRIP_WIDTH, 1e-6);  // coordinates rounded to floats
}

void save_load_and_clone_repeat_the_run() {
  const Model model = make_model();
  State state = make_state(model);
  run(state, 10);
  const std::vector<unsigned char> saved = state.save();
  State clone = state.clone();
  const Positions first = run(state, 10), cloned = run(clone, 10);
  state.load(saved);
  const Positions loaded = run(state, 10);
  CHECK(first == cloned && first == loaded);
}

void a_constraint_is_set_met_reported_and_cleared() {
  const Model model = make_model();
  State state = make_state(model);
  CHECK(state.constraint_report().empty());
  SwConstraintDesc hold = shellwarp::constraint_desc();
  hold.id = 3;
  hold.kind = SW_CONSTRAINT_POSITION;
  hold.vertex = strip_vertex(STRIP_COLUMNS - 1, 1);
  hold.axes = SW_AXIS_Z;
  hold.position[2] = 0.5;
  state.set_constraint(hold);
  const Positions x = run(state, 1);
  const std::vector<SwConstraintReport> reports = state.constraint_report();
  CHECK(reports.size() == 1 && reports[0].id == 3 && reports[0].met == 1 && reports[0].iterations > 0);
  CHECK_NEAR(x[3 * hold.vertex + 2], 0.5, 5e-6);  // a millionth of the size, and the basis is in floats
  state.clear_constraint(SW_ALL_CONSTRAINTS);
  CHECK(state.constraint_report().empty());
}

constexpr uint32_t kTip = STRIP_VERTICES - 2;  // the middle of the free end

double height_of_tip(const State &state) {
  Positions x;
  state.positions(x.data(), STRIP_VERTICES);
  return x[3 * kTip + 2];
}

void forces_in_either_format_bend_until_they_are_cleared() {
  const Model model = make_model();
  const double push[3] = {0, 0, 0.0625};  // exact in floats
  const float single[3] = {0, 0, 0.0625F};
  State a(model), b(model), every(model);
  a.set_forces(shellwarp::force_desc(push, 1, &kTip));
  b.set_forces(shellwarp::force_desc(single, 1, &kTip));
  Positions dense{};
  dense[3 * kTip + 2] = push[2];
  every.set_forces(shellwarp::force_desc(dense.data(), STRIP_VERTICES));
  for (State *state : {&a, &b, &every}) CHECK(state->equilibrium().residual < 1e-6);
  CHECK(height_of_tip(a) > 0.01 && height_of_tip(a) == height_of_tip(b));
  CHECK_NEAR(height_of_tip(a), height_of_tip(every), 1e-5);  // one force is added in 64 bits, those on all in 32
  a.clear_forces();
  a.equilibrium();
  CHECK_NEAR(height_of_tip(a), 0, 1e-12);  // no load at all: the rest shape
}

void forces_for_one_step_are_gone_in_the_next() {
  const Model model = make_model();
  const double push[3] = {0, 0, 0.0625};
  State state(model);
  state.set_forces(shellwarp::force_desc(push, 1, &kTip, SW_FORCES_ONE_STEP));
  state.equilibrium();
  CHECK(height_of_tip(state) > 0.01);
  state.equilibrium();
  CHECK_NEAR(height_of_tip(state), 0, 1e-12);
}

void wind_lifts_until_it_is_cleared() {
  const Model model = make_model();
  State state(model);
  SwWindDesc wind = shellwarp::wind_desc();
  wind.velocity[2] = 0.5;
  wind.density = 1.2;
  wind.normal_drag = 1;
  state.set_wind(wind);
  state.step(0.1);
  const double lifted = height_of_tip(state);
  CHECK(lifted > 0);
  state.reset();
  state.clear_wind();
  state.step(0.1);
  CHECK(height_of_tip(state) == 0);
}

void an_equilibrium_that_does_not_exist_throws_and_moves_nothing() {
  const Strip strip = make_strip();
  Model model(shellwarp::mesh_desc(strip.positions, STRIP_VERTICES, strip.triangles, STRIP_TRIANGLES));  // floats free
  model.precompute();
  State state(model);
  state.set_gravity(0, 0, -1);
  SwStatus status = SW_OK;
  try {
    state.equilibrium();
  } catch (const shellwarp::Error &error) {
    status = error.status();
  }
  CHECK(status == SW_ERROR_NUMERICAL && height_of_tip(state) == 0);
}

/* The strip bends by half its length: linear analysis stretches it, and the warp is nearer to the full shell. */
void a_state_tells_its_error_falls_back_and_goes_on_by_other_methods() {
  const Model model = make_model();
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = SW_METHOD_LMA;
  State state(model, desc);
  state.set_gravity(0, 0, -2);
  state.equilibrium();
  const SwCertificate linear = state.certify();
  CHECK(linear.factorizations > 0 && linear.bytes > 0 && linear.seconds > 0);
  int heard = 0;
  const SwCertificate watched = state.certify([&](double residual) { return residual >= 0 && ++heard; });
  CHECK(watched.error == linear.error && heard > static_cast<int>(linear.factorizations) / 2);
  try {
    state.certify([](double) { return false; });
    CHECK(!"cancelled");
  } catch (const shellwarp::Error &error) {
    CHECK(error.status() == SW_ERROR_CANCELLED);
  }
  CHECK(linear.method == SW_METHOD_LMA && linear.error > 0.02);
  std::vector<double> own(3 * STRIP_VERTICES), corrected(own);
  state.positions(own.data(), STRIP_VERTICES);
  state.positions_corrected(0, corrected.data(), STRIP_VERTICES);
  CHECK(corrected == own);
  state.positions_corrected(2, corrected.data(), STRIP_VERTICES);
  CHECK(corrected != own && state.certify().error == linear.error);
  const SwCertificate found = state.fall_back();
  CHECK(found.method == SW_METHOD_WARP && found.error < linear.error && found.seconds > 0);
  CHECK(state.certify().error == found.error && state.fall_back().method == SW_METHOD_WARP);
  state.step(1.0 / 30);
  state.set_method(SW_METHOD_SHELL_IMPLICIT);
  CHECK(state.certify().error == 0 && state.certify().method == SW_METHOD_SHELL_IMPLICIT);
  SwCertificate certificate;
  sw_certificate_init(&certificate);
  CHECK(sw_state_fall_back(nullptr, &certificate) == SW_ERROR_INVALID_ARGUMENT);
  CHECK(sw_state_fall_back(state.get(), nullptr) == SW_ERROR_INVALID_ARGUMENT);
  certificate.struct_size = 0;
  CHECK(sw_state_fall_back(state.get(), &certificate) == SW_ERROR_INVALID_DESC);
}

/* Stopped, by false or by an answer that is neither, all is as it was; and what is watched comes to the same. */
void searches_are_watched_and_stopped() {
  const Model model = make_model();
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = SW_METHOD_LMA;
  const State begun(model, desc);
  const auto status_of = [](const std::function<void()> &search) {
    try {
      search();
    } catch (const shellwarp::Error &error) {
      return error.status();
    }
    return SwStatus{SW_OK};
  };
  State state = begun.clone(), silent = begun.clone();
  state.set_gravity(0, 0, -2);
  silent.set_gravity(0, 0, -2);
  const std::vector<unsigned char> before = state.save();
  const auto never = [](double) { return false; };
  CHECK(status_of([&] { state.equilibrium(never); }) == SW_ERROR_CANCELLED && state.save() == before);
  int heard = 0;
  auto hear = [&heard](double residual) { return residual >= 0 && ++heard > 0; };
  const SwEquilibriumReport report = state.equilibrium(hear);
  CHECK(report.iterations == silent.equilibrium().iterations && state.save() == silent.save());
  CHECK(heard == static_cast<int>(report.iterations) && report.seconds > 0);
  const auto shown = [](const State &of) {
    std::vector<double> x(3 * STRIP_VERTICES);
    of.positions_corrected(1, x.data(), STRIP_VERTICES);
    return x;
  };
  heard = 0;
  state.correct(1);
  const std::vector<double> kept = shown(state);
  CHECK(status_of([&] { state.correct(3, never); }) == SW_ERROR_CANCELLED && shown(state) == kept);
  state.correct(3, hear);
  CHECK(heard == 3 && shown(state) != kept);
  CHECK(status_of([&] { state.fall_back(never); }) == SW_ERROR_CANCELLED && state.report().time == 0);
  CHECK(state.certify().method == SW_METHOD_LMA);
  const SwCertificate found = state.fall_back(hear);
  CHECK(found.method == SW_METHOD_WARP && found.error == silent.fall_back().error);

  const auto neither = [](void *, double) -> uint32_t { return 7; };
  SwCertificate certificate;
  sw_certificate_init(&certificate);
  CHECK(sw_state_equilibrium_watched(state.get(), nullptr, neither, nullptr) == SW_ERROR_INVALID_ARGUMENT);
  CHECK(sw_state_correct_watched(state.get(), 1, neither, nullptr) == SW_ERROR_INVALID_ARGUMENT);
  CHECK(sw_state_fall_back_watched(state.get(), &certificate, neither, nullptr) == SW_ERROR_INVALID_ARGUMENT);
  CHECK(sw_state_equilibrium_watched(nullptr, nullptr, nullptr, nullptr) == SW_ERROR_INVALID_ARGUMENT);
  CHECK(sw_state_equilibrium_watched(state.get(), nullptr, nullptr, nullptr) == SW_OK);
  CHECK(sw_state_fall_back_watched(state.get(), &certificate, nullptr, nullptr) == SW_OK && certificate.seconds > 0);
}

/* Its own state is busy while it is asked, and is as it was afterwards. */
void a_watch_that_calls_for_its_state_is_told_that_it_is_busy() {
  const Model model = make_model();
  State state(model);
  state.set_gravity(0, 0, -1);
  const auto within = [](void *user, double) -> uint32_t {
    SwState *own = static_cast<SwState *>(user);
    SwStateReport report;
    sw_state_report_init(&report);
    const bool busy = sw_state_step(own, 0.01) == SW_ERROR_BUSY && sw_state_report(own, &report) == SW_ERROR_BUSY &&
                      sw_state_equilibrium(own, nullptr) == SW_ERROR_BUSY;
    return busy ? SW_PROGRESS_CONTINUE : SW_PROGRESS_CANCEL;
  };
  CHECK(sw_state_equilibrium_watched(state.get(), nullptr, within, state.get()) == SW_OK);
  CHECK(sw_state_correct_watched(state.get(), 1, within, state.get()) == SW_OK);
  state.step(0.01);
}

void log_messages_reach_the_callback() {
  struct Log {
    int lines = 0;
    static void note(void *user, uint32_t, const char *) { ++static_cast<Log *>(user)->lines; }
  } log;
  const double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5};  // the last vertex in no triangle: handled, and told
  const uint32_t t[3] = {0, 1, 2};
  shellwarp::set_log_callback(Log::note, &log);
  const Model model(shellwarp::mesh_desc(x, 4, t, 1));
  shellwarp::set_log_callback(nullptr);
  const int heard = log.lines;
  const Model silent(shellwarp::mesh_desc(x, 4, t, 1));
  CHECK(heard > 0 && log.lines == heard);
}

void vectors_have_the_length_of_the_modes() {
  const Model model = make_model(5);
  const State state = make_state(model);
  CHECK(model.frequencies().size() == 5 && model.frequencies()[0] > 0);
  CHECK(state.amplitudes().value.size() == 5 && state.amplitudes().velocity.size() == 5);
  CHECK(model.info().modes == 5);
}

void diagnostics_come_as_a_vector() {
  const double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5};
  const uint32_t t[6] = {0, 1, 2, 0, 1, 2};
  const std::vector<SwDiagnostic> found = shellwarp::check_mesh(shellwarp::mesh_desc(x, 4, t, 2));
  CHECK(found.size() >= 2);
  CHECK(!found.empty() && found.front().severity == SW_SEVERITY_ERROR && found.back().severity == SW_SEVERITY_WARNING);
}

// A model is shared by states on any threads, and a state that nobody changes by any number of readers.
void states_on_threads_move_as_they_do_one_by_one() {
  const Model model = make_model();
  State alone = make_state(model);
  const Positions expected = run(alone, 200);
  std::array<Positions, 4> results;
  std::vector<std::thread> threads;
  for (Positions &result : results)
    threads.emplace_back([&model, &result] {
      State state = make_state(model);
      result = run(state, 200);
    });
  for (std::thread &thread : threads) thread.join();
  for (const Positions &result : results) CHECK(result == expected);
}

void many_states_step_in_one_call_and_throw_the_first_failure() {
  const Model model = make_model();
  State a = make_state(model), b = make_state(model), alone = make_state(model);
  SwState *both[2] = {a.get(), b.get()};
  SwStatus statuses[2] = {77, 77};
  shellwarp::set_threads(2);
  shellwarp::step(both, 2, 0.01, statuses);
  alone.step(0.01);
  CHECK(statuses[0] == SW_OK && statuses[1] == SW_OK);
  CHECK(a.save() == alone.save() && b.save() == alone.save());
  both[1] = both[0];
  try {
    shellwarp::step(both, 2, 0.01, statuses);
    CHECK(!"a state that comes twice must throw");
  } catch (const shellwarp::Error &error) {
    CHECK(error.status() == SW_ERROR_BUSY && std::string(error.what()).find("states[1]") != std::string::npos);
  }
  CHECK(statuses[0] == SW_OK && statuses[1] == SW_ERROR_BUSY);
  shellwarp::set_threads(0);
}

void readers_of_one_state_do_not_disturb_each_other() {
  const Model model = make_model();
  State state = make_state(model);
  const Positions expected = run(state, 20);
  std::array<int, 4> good{};
  std::vector<std::thread> threads;
  for (int &count : good)
    threads.emplace_back([&state, &expected, &count] {
      Positions x;
      for (int k = 0; k < 200; ++k) {
        state.positions(x.data(), STRIP_VERTICES);
        count += x == expected && state.report().max_displacement > 0;
      }
    });
  for (std::thread &thread : threads) thread.join();
  for (const int count : good) CHECK(count == 200);
}

// Messages are per thread: another thread's failure does not overwrite this one's.
void messages_are_kept_by_thread() {
  CHECK(sw_state_reset(nullptr) == SW_ERROR_INVALID_ARGUMENT);
  const std::string mine = sw_last_error_message();
  std::string others_before, others_after;
  std::thread([&] {
    others_before = sw_last_error_message();
    sw_model_precompute(nullptr, nullptr);
    others_after = sw_last_error_message();
  }).join();
  CHECK(others_before.empty() && others_after.find("model") != std::string::npos);
  CHECK(mine == sw_last_error_message() && mine.find("state") != std::string::npos);
}

}  // namespace

int main() {
  RUN(moving_hands_the_object_over);
  RUN(a_saved_model_is_loaded_with_the_same_bytes);
  RUN(a_failed_call_throws_its_status_and_message);
  RUN(a_constructor_that_fails_throws);
  RUN(a_moved_from_object_is_a_null_handle);
  RUN(overloads_choose_the_format);
  RUN(a_pose_read_is_set_again);
  RUN(floats_and_doubles_make_the_same_mesh);
  RUN(save_load_and_clone_repeat_the_run);
  RUN(a_constraint_is_set_met_reported_and_cleared);
  RUN(forces_in_either_format_bend_until_they_are_cleared);
  RUN(forces_for_one_step_are_gone_in_the_next);
  RUN(wind_lifts_until_it_is_cleared);
  RUN(an_equilibrium_that_does_not_exist_throws_and_moves_nothing);
  RUN(a_state_tells_its_error_falls_back_and_goes_on_by_other_methods);
  RUN(searches_are_watched_and_stopped);
  RUN(a_watch_that_calls_for_its_state_is_told_that_it_is_busy);
  RUN(log_messages_reach_the_callback);
  RUN(vectors_have_the_length_of_the_modes);
  RUN(diagnostics_come_as_a_vector);
  RUN(states_on_threads_move_as_they_do_one_by_one);
  RUN(many_states_step_in_one_call_and_throw_the_first_failure);
  RUN(readers_of_one_state_do_not_disturb_each_other);
  RUN(messages_are_kept_by_thread);
  return report_failures();
}

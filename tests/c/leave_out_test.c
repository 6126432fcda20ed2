/* What a host leaves out and is told of: plans, positions of some vertices, rest, models for linear modal analysis alone, modes by a
   tolerance, features of a build; and what a careless host does with them. */
#include "test_support.h"

static SwModel *model_with(SwPrecomputeDesc desc) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  OK(sw_model_precompute(model, &desc));
  return model;
}

static SwPrecomputeDesc four_modes(void) {
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  return desc;
}

static SwState *falling_state(const SwModel *model) {
  const double gravity[3] = {0, 0, -0.5};
  SwState *state = new_state(model, 0, 0);
  OK(sw_state_set_gravity(state, gravity));
  for (int k = 0; k < 5; ++k) OK(sw_state_step(state, 0.01));
  return state;
}

static void a_plan_lists_every_part_once_and_says_why(void) {
  SwModel *model = model_with(four_modes());
  SwState *state = falling_state(model);
  uint32_t count = 0;
  OK(sw_state_plan(state, 0.01, NULL, sizeof(SwPlanPart), 0, &count));
  CHECK(count >= SW_PART_NONLINEAR_SHELL);
  SwPlanPart *parts = calloc(count, sizeof *parts);
  OK(sw_state_plan(state, 0.01, parts, sizeof(SwPlanPart), count, &count));
  double operations = 0;
  for (uint32_t k = 0; k < count; ++k) {
    CHECK(parts[k].part == k + 1);
    CHECK(memchr(parts[k].reason, 0, SW_PLAN_REASON_SIZE) != NULL && parts[k].reason[0] != 0);
    operations += parts[k].operations;
  }
  CHECK(operations > 0);
  CHECK(parts[SW_PART_ROTATIONS - 1].active == 1 && parts[SW_PART_WIND - 1].active == 0);

  SwWindDesc wind;
  sw_wind_desc_init(&wind);
  wind.density = 1;
  wind.normal_drag = 1;
  wind.velocity[2] = 1;
  OK(sw_state_set_wind(state, &wind));
  OK(sw_state_plan(state, 0.01, parts, sizeof(SwPlanPart), count, &count));
  CHECK(parts[SW_PART_WIND - 1].active == 1 && parts[SW_PART_WIND - 1].operations > 0);

  uint64_t size = 0;
  OK(sw_state_plan_text(state, 0.01, NULL, 0, &size));
  char *text = malloc(size);
  OK(sw_state_plan_text(state, 0.01, text, size, &size));
  CHECK(strlen(text) + 1 == size && strstr(text, "modal rotations") && strstr(text, "in all"));

  SwPlanPart untouched = parts[0];
  FAILS(sw_state_plan(NULL, 0.01, parts, sizeof(SwPlanPart), count, &count), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_plan(state, 0.01, parts, sizeof(SwPlanPart), count, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  FAILS(sw_state_plan(state, 0.01, NULL, sizeof(SwPlanPart), count, &count), SW_ERROR_INVALID_ARGUMENT, "parts");
  FAILS(sw_state_plan(state, 0.01, parts, sizeof(SwPlanPart), count - 1, &count), SW_ERROR_BUFFER_SIZE, "parts");
  FAILS(sw_state_plan(state, 0, parts, sizeof(SwPlanPart), count, &count), SW_ERROR_INVALID_ARGUMENT, "step");
  FAILS(sw_state_plan(state, NAN, parts, sizeof(SwPlanPart), count, &count), SW_ERROR_INVALID_ARGUMENT, "step");
  CHECK(memcmp(&untouched, &parts[0], sizeof untouched) == 0);
  FAILS(sw_state_plan_text(NULL, 0.01, text, size, &size), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_plan_text(state, 0.01, text, size, NULL), SW_ERROR_INVALID_ARGUMENT, "size");
  FAILS(sw_state_plan_text(state, 0.01, text, 3, &size), SW_ERROR_BUFFER_SIZE, "text");
  free(text);
  free(parts);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void positions_of_some_vertices_are_those_among_all(void) {
  SwModel *model = model_with(four_modes());
  SwState *state = falling_state(model);
  const uint32_t some[4] = {STRIP_VERTICES - 1, 0, 17, 17}, wrong[2] = {0, STRIP_VERTICES};
  double all[3 * STRIP_VERTICES], of[12] = {0}, before[12];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, all, 0, STRIP_VERTICES));
  OK(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, some, 4, of, 0));
  for (int i = 0; i < 4; ++i) CHECK(memcmp(&of[3 * i], &all[3 * some[i]], 3 * sizeof(double)) == 0);
  OK(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, NULL, 0, NULL, 0));
  memcpy(before, of, sizeof of);
  FAILS(sw_state_positions_of(NULL, SW_SPACE_WORLD, SW_FORMAT_F64, some, 4, of, 0), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_positions_of(state, 9, SW_FORMAT_F64, some, 4, of, 0), SW_ERROR_INVALID_ARGUMENT, "space");
  FAILS(sw_state_positions_of(state, SW_SPACE_WORLD, 9, some, 4, of, 0), SW_ERROR_INVALID_ARGUMENT, "format");
  FAILS(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, NULL, 4, of, 0), SW_ERROR_INVALID_ARGUMENT, "vertices");
  FAILS(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, some, 4, NULL, 0), SW_ERROR_INVALID_ARGUMENT, "out");
  FAILS(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, some, 4, of, 23), SW_ERROR_INVALID_ARGUMENT, "stride");
  FAILS(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, wrong, 2, of, 0), SW_ERROR_INVALID_ARGUMENT, "vertices[1]");
  CHECK(memcmp(before, of, sizeof of) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_state_rests_by_a_tolerance_and_a_wrong_one_is_refused(void) {
  SwModel *model = model_with(four_modes());
  SwState *state = falling_state(model);
  const double wrong[3] = {-1, NAN, HUGE_VAL};
  for (int i = 0; i < 3; ++i)
    FAILS(sw_state_set_rest_tolerance(state, wrong[i]), SW_ERROR_INVALID_ARGUMENT, "tolerance");
  FAILS(sw_state_set_rest_tolerance(NULL, 0), SW_ERROR_INVALID_ARGUMENT, "state");
  OK(sw_state_set_rest_tolerance(state, 1e6));
  OK(sw_state_step(state, 0.01));
  double x[3 * STRIP_VERTICES], y[3 * STRIP_VERTICES];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  for (int k = 0; k < 5; ++k) OK(sw_state_step(state, 0.02));
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, y, 0, STRIP_VERTICES));
  CHECK(memcmp(x, y, sizeof x) == 0);
  SwStateReport report;
  sw_state_report_init(&report);
  OK(sw_state_report(state, &report));
  CHECK_NEAR(report.time, 0.16, 1e-12); /* time passes: 6 * 0.01 + 5 * 0.02 */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_linear_model_moves_by_linear_modal_analysis_alone(void) {
  SwPrecomputeDesc desc = four_modes();
  desc.flags = SW_PRECOMPUTE_LINEAR;
  SwModel *model = model_with(desc), *whole = model_with(four_modes());
  SwModelInfo linear_info, whole_info;
  sw_model_info_init(&linear_info);
  sw_model_info_init(&whole_info);
  OK(sw_model_info(model, &linear_info));
  OK(sw_model_info(whole, &whole_info));
  CHECK(linear_info.bytes_model < whole_info.bytes_model);
  SwState *state = falling_state(model), *none = NULL;
  float quaternions[4 * STRIP_VERTICES], shape[3 * STRIP_VERTICES];
  FAILS(sw_state_rotations(state, SW_SPACE_WORLD, SW_FORMAT_F32, quaternions, 0, STRIP_VERTICES), SW_ERROR_UNSUPPORTED,
        "rotations");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, SW_FORMAT_F32, shape, 0, STRIP_VERTICES), SW_ERROR_UNSUPPORTED,
        "SW_PRECOMPUTE_LINEAR");
  SwStateDesc warp;
  sw_state_desc_init(&warp);
  warp.method = SW_METHOD_WARP;
  FAILS(sw_state_create(model, &warp, &none), SW_ERROR_UNSUPPORTED, "linear modal analysis");
  CHECK(none == NULL);
  sw_state_destroy(state);
  sw_model_destroy(whole);
  sw_model_destroy(model);
}

static void a_tolerance_leaves_out_modes_and_wrong_demands_are_refused(void) {
  SwPrecomputeDesc desc;
  const uint32_t handle = STRIP_VERTICES - 2, nowhere = STRIP_VERTICES;
  sw_precompute_desc_init(&desc);
  desc.tolerance = 1e-2;
  desc.demand_gravity[2] = -0.5;
  SwModel *model = model_with(desc);
  SwModelInfo info;
  sw_model_info_init(&info);
  OK(sw_model_info(model, &info));
  CHECK(info.modes >= 1 && info.modes <= 16);
  CHECK(info.truncation_bound > 0 && info.truncation_bound <= desc.tolerance);
  CHECK(info.effective_mass[2] > 0.5 && info.effective_mass[2] <= 1 + 1e-6);
  const uint32_t modes = info.modes;

  desc.handles = &handle;
  desc.n_handles = 1;
  desc.handle_distance = 0.01;
  OK(sw_model_precompute(model, &desc));
  OK(sw_model_info(model, &info));
  CHECK(info.modes >= modes);

  const double wrong[3] = {-1, NAN, HUGE_VAL};
  for (int i = 0; i < 3; ++i) {
    SwPrecomputeDesc bad = desc;
    bad.tolerance = wrong[i];
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "tolerance");
    bad = desc;
    bad.demand_acceleration = wrong[i];
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "acceleration");
    bad = desc;
    bad.handle_distance = wrong[i];
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "handle_distance");
    bad = desc;
    bad.handle_speed = wrong[i];
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "handle_speed");
    bad = desc;
    bad.demand_amplification = wrong[i];
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "amplification");
    bad = desc;
    bad.demand_gravity[1] = i ? wrong[i] : NAN;
    FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "gravity");
  }
  SwPrecomputeDesc bad = desc;
  bad.handles = NULL;
  FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "handles");
  bad = desc;
  bad.handles = &nowhere;
  FAILS(sw_model_precompute(model, &bad), SW_ERROR_INVALID_ARGUMENT, "vertex");
  SwModelInfo after;
  sw_model_info_init(&after);
  OK(sw_model_info(model, &after));
  CHECK(memcmp(&after, &info, sizeof info) == 0);
  sw_model_destroy(model);
}

static void the_whole_library_says_that_it_is_whole(void) {
  const uint32_t all = SW_FEATURE_NONLINEAR_SHELL | SW_FEATURE_WIND | SW_FEATURE_SAVED_MODELS | SW_FEATURE_F64_BASIS |
                       SW_FEATURE_I16_BASIS;
  CHECK((sw_features() & all) == all);
}

int main(void) {
  RUN(a_plan_lists_every_part_once_and_says_why);
  RUN(positions_of_some_vertices_are_those_among_all);
  RUN(a_state_rests_by_a_tolerance_and_a_wrong_one_is_refused);
  RUN(a_linear_model_moves_by_linear_modal_analysis_alone);
  RUN(a_tolerance_leaves_out_modes_and_wrong_demands_are_refused);
  RUN(the_whole_library_says_that_it_is_whole);
  return report_failures();
}

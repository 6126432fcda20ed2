/* Supports that move against each other, through the C interface: a strip held at both ends, of which one turns. */
#include "test_support.h"

/* Two columns of vertices at either end. */
static SwModel *strip_held_at_both_ends(uint32_t support_fields) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  uint32_t fixed[4 * STRIP_ROWS];
  for (int j = 0; j < STRIP_ROWS; ++j) {
    fixed[4 * j] = strip_vertex(0, j);
    fixed[4 * j + 1] = strip_vertex(1, j);
    fixed[4 * j + 2] = strip_vertex(STRIP_COLUMNS - 2, j);
    fixed[4 * j + 3] = strip_vertex(STRIP_COLUMNS - 1, j);
  }
  SwSupportDesc supports;
  sw_support_desc_init(&supports);
  supports.fixed = fixed;
  supports.n_fixed = 4 * STRIP_ROWS;
  SwModel *model = NULL;
  OK(sw_model_create(&mesh, NULL, &supports, &model));
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 8;
  desc.precision = SW_PRECISION_F64;
  desc.support_fields = support_fields;
  OK(sw_model_precompute(model, &desc));
  return model;
}

/* The far end turned about x by `angle`, and all of it moved along z. Rows of other vertices are never read: they hold no numbers. */
static void place_supports(double angle, double z, double (*x)[4]) {
  const Strip strip = make_strip();
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    const double *rest = &strip.positions[3 * v];
    const int column = v / STRIP_ROWS;
    const double a = column >= STRIP_COLUMNS - 2 ? angle : 0;
    x[v][0] = rest[0];
    x[v][1] = rest[1] * cos(a) - rest[2] * sin(a);
    x[v][2] = rest[1] * sin(a) + rest[2] * cos(a) + z;
    if (column > 1 && column < STRIP_COLUMNS - 2) x[v][0] = x[v][1] = x[v][2] = NAN;
  }
}

static double largest_miss(const SwState *state, double (*x)[4]) {
  static double now[STRIP_VERTICES][3];
  double most = 0;
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
  for (int v = 0; v < STRIP_VERTICES; ++v)
    for (int c = 0; c < 3; ++c)
      if (!isnan(x[v][c]) && fabs(now[v][c] - x[v][c]) > most) most = fabs(now[v][c] - x[v][c]);
  return most;
}

static double x[STRIP_VERTICES][4];

/* A strip whose rest shape is carried sideways and then turned over. */
static void the_shell_goes_with_its_rest_shape(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_held_at_both_ends(0);
  SwState *state = NULL;
  OK(sw_state_create(model, NULL, &state));
  static double shape[STRIP_VERTICES][3];
  for (int k = 0; k < 5; ++k) {
    for (int v = 0; v < STRIP_VERTICES; ++v)
      for (int c = 0; c < 3; ++c) shape[v][c] = strip.positions[3 * v + c] + (c == 1 ? 0.01 * k : 0);
    OK(sw_state_move_rest(state, SW_FORMAT_F64, shape, 0, STRIP_VERTICES, 0));
    OK(sw_state_step(state, 1.0 / 60));
  }
  static double now[STRIP_VERTICES][3];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
  CHECK(memcmp(now[0], shape[0], sizeof now[0]) == 0); /* a support */
  SwStateReport report;
  sw_state_report_init(&report);
  OK(sw_state_report(state, &report));
  CHECK(report.rest_stretch < 1e-12);
  FAILS(sw_state_move_rest(state, SW_FORMAT_F64, shape, 0, STRIP_VERTICES - 1, 0), SW_ERROR_INVALID_ARGUMENT, "n_vertices");
  FAILS(sw_state_move_rest(state, SW_FORMAT_F64, shape, 0, STRIP_VERTICES, 2), SW_ERROR_INVALID_ARGUMENT, "flags");
  FAILS(sw_state_move_rest(state, SW_FORMAT_F64, NULL, 0, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT, "positions");
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, shape, 0, STRIP_VERTICES, 0), SW_ERROR_UNSUPPORTED, "rest shape");
  OK(sw_state_move_rest(state, SW_FORMAT_F64, NULL, 0, 0, 0));
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
  CHECK(memcmp(now[0], strip.positions, sizeof now[0]) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* A vertex at the tip on a rail along z, another that slides across the direction 1 0 1. */
static void what_is_held_along_axes_stays(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  uint32_t fixed[STRIP_ROWS], along[2] = {strip_vertex(STRIP_COLUMNS - 1, 0), strip_vertex(STRIP_COLUMNS - 1, STRIP_ROWS - 1)};
  for (int j = 0; j < STRIP_ROWS; ++j) fixed[j] = strip_vertex(0, j);
  const uint8_t axes[2] = {SW_AXIS_X | SW_AXIS_Y, 0};
  const double directions[6] = {0, 0, 0, 1, 0, 1};
  SwSupportDesc supports;
  sw_support_desc_init(&supports);
  supports.fixed = fixed;
  supports.n_fixed = STRIP_ROWS;
  supports.axis_vertices = along;
  supports.axes = axes;
  supports.axis_directions = directions;
  supports.n_axis_vertices = 2;
  SwModel *model = NULL;
  OK(sw_model_create(&mesh, NULL, &supports, &model));
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.precision = SW_PRECISION_F64;
  OK(sw_model_precompute(model, &desc));
  SwModelInfo info;
  sw_model_info_init(&info);
  OK(sw_model_info(model, &info));
  CHECK(info.n_fixed == STRIP_ROWS);
  CHECK(info.n_unknowns == 3 * (STRIP_VERTICES - STRIP_ROWS) - 3);
  SwState *state = NULL;
  OK(sw_state_create(model, NULL, &state));
  const double gravity[3] = {3, 2, -9.8};
  OK(sw_state_set_gravity(state, gravity));
  for (int k = 0; k < 20; ++k) OK(sw_state_step(state, 1.0 / 60));
  static double now[STRIP_VERTICES][3];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
  const double *rail = now[along[0]], *slide = now[along[1]];
  const double *rail_rest = &strip.positions[3 * along[0]], *slide_rest = &strip.positions[3 * along[1]];
  CHECK(rail[0] == rail_rest[0] && rail[1] == rail_rest[1] && rail[2] != rail_rest[2]);
  CHECK(fabs(slide[0] - slide_rest[0] + slide[2] - slide_rest[2]) < 1e-12);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void supports_are_where_they_are_sent(void) {
  SwModel *model = strip_held_at_both_ends(24);
  SwModelInfo info;
  sw_model_info_init(&info);
  OK(sw_model_info(model, &info));
  CHECK(info.modes == 8 && info.support_fields > 6 && info.support_fields <= 24);
  const uint32_t methods[] = {SW_METHOD_WARP, SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_LMA, SW_METHOD_SHELL_IMPLICIT};
  for (int m = 0; m < 4; ++m) {
    SwState *state = new_state(model, methods[m], SW_INTEGRATOR_EXACT);
    for (int i = 1; i <= 20; ++i) {
      place_supports(0.03 * i, 0.01 * i, x);
      OK(sw_state_move_supports(state, SW_FORMAT_F64, x, sizeof x[0], STRIP_VERTICES, 0));
      OK(sw_state_step(state, 1.0 / 60));
      CHECK_NEAR(largest_miss(state, x), 0, 1e-12); /* rounding of places of the order of 4 */
    }
    SwStateReport report;
    sw_state_report_init(&report);
    OK(sw_state_report(state, &report));
    /* A turn of 0.6: a warped field bends by the rotation of its ends. */
    CHECK(methods[m] == SW_METHOD_SHELL_IMPLICIT ? report.support_miss == 0 : report.support_miss < 0.01 * STRIP_WIDTH);
    CHECK(report.elastic_energy > 0);
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

static void supports_that_move_as_one_need_no_fields(void) {
  SwModel *model = strip_held_at_both_ends(0);
  SwState *state = new_state(model, SW_METHOD_ROTATION_STRAIN, SW_INTEGRATOR_EXACT);
  for (int i = 1; i <= 10; ++i) {
    place_supports(0, 0.1 * i, x);
    OK(sw_state_move_supports(state, SW_FORMAT_F64, x, sizeof x[0], STRIP_VERTICES, i == 5 ? SW_SUPPORTS_TELEPORT : 0));
    OK(sw_state_step(state, 1.0 / 60));
    CHECK_NEAR(largest_miss(state, x), 0, 1e-12);
  }
  place_supports(0.2, 1, x);
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, sizeof x[0], STRIP_VERTICES, 0), SW_ERROR_UNSUPPORTED,
        "precompute with support_fields");
  OK(sw_state_step(state, 1.0 / 60));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void broken_input_is_refused_by_name(void) {
  SwModel *model = strip_held_at_both_ends(6);
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  const uint64_t stride = sizeof x[0];
  place_supports(0.1, 0, x);
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, NULL, stride, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT,
        "positions");
  FAILS(sw_state_move_supports(state, 7, x, stride, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT, "format");
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, 5, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT, "stride");
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, stride, STRIP_VERTICES - 1, 0), SW_ERROR_INVALID_ARGUMENT,
        "n_vertices is 122");
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, stride, STRIP_VERTICES, 2), SW_ERROR_INVALID_ARGUMENT, "flags");
  x[strip_vertex(1, 1)][2] = NAN;
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, stride, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT,
        "the support 4 is to be at");
  x[strip_vertex(1, 1)][2] = 1e200;
  FAILS(sw_state_move_supports(state, SW_FORMAT_F64, x, stride, STRIP_VERTICES, 0), SW_ERROR_INVALID_ARGUMENT,
        "sizes of the mesh");
  static double now[STRIP_VERTICES][3];
  const Strip strip = make_strip();
  OK(sw_state_step(state, 1.0 / 60));
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
  CHECK(memcmp(now, strip.positions, sizeof now) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_batch_on_threads_moves_alike(void) {
  SwModel *model = strip_held_at_both_ends(24);
  SwState *states[6];
  static double alone[STRIP_VERTICES][3], now[STRIP_VERTICES][3];
  for (int i = 0; i < 6; ++i) states[i] = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  OK(sw_set_threads(3));
  for (int step = 1; step <= 10; ++step) {
    place_supports(0.05 * step, 0, x);
    for (int i = 0; i < 6; ++i) OK(sw_state_move_supports(states[i], SW_FORMAT_F64, x, sizeof x[0], STRIP_VERTICES, 0));
    OK(sw_state_step(states[0], 1.0 / 60));
    OK(sw_states_step(states + 1, 5, 1.0 / 60, NULL));
  }
  OK(sw_state_positions(states[0], SW_SPACE_WORLD, SW_FORMAT_F64, alone, 0, STRIP_VERTICES));
  for (int i = 0; i < 6; ++i) {
    OK(sw_state_positions(states[i], SW_SPACE_WORLD, SW_FORMAT_F64, now, 0, STRIP_VERTICES));
    CHECK(memcmp(now, alone, sizeof now) == 0);
    sw_state_destroy(states[i]);
  }
  sw_model_destroy(model);
}

int main(void) {
  RUN(the_shell_goes_with_its_rest_shape);
  RUN(what_is_held_along_axes_stays);
  RUN(supports_are_where_they_are_sent);
  RUN(supports_that_move_as_one_need_no_fields);
  RUN(broken_input_is_refused_by_name);
  RUN(a_batch_on_threads_moves_alike);
  return report_failures();
}

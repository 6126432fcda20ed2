/* The whole path of a host, from a mesh to positions, with the physics that must come out. */
#include "test_support.h"

static const double kPi = 3.14159265358979323846;

typedef struct {
  double x[3 * STRIP_VERTICES];
} Positions;

static Positions positions_of(const SwState *state, uint32_t space) {
  Positions p;
  OK(sw_state_positions(state, space, SW_FORMAT_F64, p.x, 0, STRIP_VERTICES));
  return p;
}

static const double *vertex(const Positions *p, uint32_t i) { return &p->x[3 * i]; }

static double distance(const double *a, const double *b) {
  return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static void set_gravity(SwState *state, double x, double y, double z) {
  const double gravity[3] = {x, y, z};
  OK(sw_state_set_gravity(state, gravity));
}

static void set_damping_ratio(SwState *state, double ratio) {
  SwDampingDesc damping;
  sw_damping_desc_init(&damping);
  damping.ratios = &ratio;
  damping.n_ratios = 1;
  OK(sw_state_set_damping(state, &damping));
}

static void step(SwState *state, int count, double seconds) {
  for (int k = 0; k < count; ++k) OK(sw_state_step(state, seconds));
}

/* A clamped strip that sags far: its free end turns by about half a radian. */
static SwModel *sagging_model(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 6, SW_PRECISION_F64);
  return model;
}

static SwState *sagging_state(const SwModel *model, uint32_t method) {
  SwState *state = new_state(model, method, SW_INTEGRATOR_IMPLICIT_EULER);
  set_gravity(state, 0, 0, -0.4);
  set_damping_ratio(state, 0.5);
  return state;
}

/* ------------------------------------------------------------------------------------------------------------ model */

static void counts_are_those_of_the_strip(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  const SwModelInfo before = info_of(model);
  CHECK(before.n_vertices == STRIP_VERTICES && before.n_triangles == STRIP_TRIANGLES);
  CHECK(before.n_edges == STRIP_VERTICES + STRIP_TRIANGLES - 1); /* Euler: V - E + F = 1 for a disk */
  CHECK(before.n_interior_edges == before.n_edges - 2 * (STRIP_COLUMNS - 1) - 2 * (STRIP_ROWS - 1));
  CHECK(before.n_components == 1 && before.n_unreferenced == 0 && before.n_reoriented == 0);
  CHECK(before.n_fixed == 2 * STRIP_ROWS); /* the clamped column and its neighbours */
  CHECK(before.n_unknowns == 3 * (STRIP_VERTICES - 2 * STRIP_ROWS));
  CHECK(before.precomputed == 0 && before.modes == 0 && before.bytes_state == 0);
  /* Rounding of a sum of 160 terms. */
  CHECK_NEAR(before.total_area, STRIP_LENGTH * STRIP_WIDTH, 1e-13);
  CHECK_NEAR(before.total_mass, STRIP_LENGTH * STRIP_WIDTH, 1e-13);
  CHECK_NEAR(before.size, hypot(STRIP_LENGTH, STRIP_WIDTH), 1e-14);

  precompute(model, 6, 0);
  const SwModelInfo after = info_of(model);
  CHECK(after.precomputed == 1 && after.modes == 6 && after.zero_modes == 0);
  CHECK(after.precision == SW_PRECISION_F32);
  CHECK(after.inertia_count == after.inertia_found && after.inertia_found >= 6);
  CHECK(after.bytes_model > 0 && after.bytes_state > 0 && after.bytes_precompute_peak > 0);
  sw_model_destroy(model);
}

static void a_free_strip_has_six_zero_modes(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = NULL;
  double hertz[8];
  uint32_t count = 0;
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  precompute(model, 8, SW_PRECISION_F64);
  CHECK(info_of(model).zero_modes == 6);
  OK(sw_model_frequencies(model, hertz, 8, &count));
  CHECK(count == 8);
  for (int k = 0; k < 6; ++k) CHECK(hertz[k] == 0);
  CHECK(hertz[6] > 0 && hertz[7] >= hertz[6]);
  sw_model_destroy(model);
}

/* Lumped masses, a third of each triangle's area: computed here from the mesh alone, for area density 1. */
static void lumped_masses(const Strip *strip, double *mass) {
  const double share = STRIP_LENGTH * STRIP_WIDTH / STRIP_TRIANGLES / 3;
  memset(mass, 0, STRIP_VERTICES * sizeof *mass);
  for (int k = 0; k < 3 * STRIP_TRIANGLES; ++k) mass[strip->triangles[k]] += share;
}

static void mode_shapes_are_orthonormal_in_the_mass(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  double mass[STRIP_VERTICES];
  Positions shape[6];
  precompute(model, 6, SW_PRECISION_F64);
  lumped_masses(&strip, mass);
  for (uint32_t k = 0; k < 6; ++k)
    OK(sw_model_mode_shape(model, k, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F64, shape[k].x, 0, STRIP_VERTICES));
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b <= a; ++b) {
      double product = 0;
      for (int i = 0; i < 3 * STRIP_VERTICES; ++i) product += mass[i / 3] * shape[a].x[i] * shape[b].x[i];
      CHECK_NEAR(product, a == b, 1e-10); /* eigenvectors of a matrix of condition 1e6, in doubles */
    }
  sw_model_destroy(model);
}

/* The rotation of a vertex is the mean of its triangles' best rotations; under a bending mode w_y = -dz/dx. */
static void rotation_shapes_are_the_slopes_of_displacement_shapes(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  Positions phi, psi;
  precompute(model, 1, SW_PRECISION_F64);
  OK(sw_model_mode_shape(model, 0, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F64, phi.x, 0, STRIP_VERTICES));
  OK(sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, SW_FORMAT_F64, psi.x, 0, STRIP_VERTICES));
  const int column = STRIP_COLUMNS / 2;
  const double rise = vertex(&phi, strip_vertex(column + 1, 1))[2] - vertex(&phi, strip_vertex(column - 1, 1))[2];
  const double slope = rise / (2 * STRIP_LENGTH / (STRIP_COLUMNS - 1));
  /* A fiftieth: the two differences are taken over different stretches of a curved line. */
  CHECK_NEAR(vertex(&psi, strip_vertex(column, 1))[1], -slope, 0.02 * fabs(slope));
  CHECK(fabs(slope) > 0.1);
  sw_model_destroy(model);
}

static void more_modes_than_unknowns_are_clamped(void) {
  const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const uint32_t t[] = {0, 1, 2}, fixed[] = {0, 1};
  SwMeshDesc mesh;
  SwSupportDesc supports;
  SwModel *model = NULL;
  sw_mesh_desc_init(&mesh);
  sw_support_desc_init(&supports);
  mesh.positions = x;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = t;
  mesh.n_vertices = 3;
  mesh.n_triangles = 1;
  supports.fixed = fixed;
  supports.n_fixed = 2;
  OK(sw_model_create(&mesh, NULL, &supports, &model));
  precompute(model, UINT32_MAX, 0);
  CHECK(info_of(model).modes == 3);      /* one vertex moves */
  CHECK(info_of(model).zero_modes == 1); /* nothing resists a single triangle out of its plane */
  sw_model_destroy(model);
}

/* ----------------------------------------------------------------------------------------------------------- motion */

static void a_new_state_is_the_rest_shape(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 4, 0);
  SwState *state = new_state(model, 0, 0);
  const Positions world = positions_of(state, SW_SPACE_WORLD), frame = positions_of(state, SW_SPACE_FRAME);
  CHECK(memcmp(world.x, strip.positions, sizeof world.x) == 0);
  CHECK(memcmp(frame.x, strip.positions, sizeof frame.x) == 0);
  const SwStateReport report = report_of(state);
  CHECK(report.time == 0 && report.kinetic_energy == 0 && report.elastic_energy == 0);
  CHECK(report.max_rotation == 0 && report.max_displacement == 0 && report.turn_in_range == 1);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void held_vertices_stay_and_the_free_end_sinks(void) {
  const Strip strip = make_strip();
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  step(state, 600, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < STRIP_ROWS; ++j) {
      const uint32_t v = strip_vertex(i, j);
      CHECK(memcmp(vertex(&p, v), &strip.positions[3 * v], 3 * sizeof(double)) == 0);
    }
  const double *tip = vertex(&p, strip_vertex(STRIP_COLUMNS - 1, 1));
  CHECK(tip[2] < -0.2 * STRIP_LENGTH);
  CHECK(tip[0] > 0 && tip[0] < STRIP_LENGTH);
  CHECK_NEAR(tip[1], 0, 1e-8); /* symmetry; rounding of the modes, magnified by steps */
  CHECK(report_of(state).turn_in_range == 1);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* A thin strip bends and does not stretch. Linear modes move every vertex straight down and so lengthen it; warping, the
   paper's point, keeps the length of the middle line. */
static double middle_line(const SwState *state) {
  const Positions p = positions_of(state, SW_SPACE_FRAME);
  double length = 0;
  for (int i = 1; i < STRIP_COLUMNS; ++i)
    length += distance(vertex(&p, strip_vertex(i, 1)), vertex(&p, strip_vertex(i - 1, 1)));
  return length;
}

static void warping_keeps_the_length_that_linear_modes_lose(void) {
  SwModel *model = sagging_model();
  SwState *warped = sagging_state(model, SW_METHOD_WARP), *linear = sagging_state(model, SW_METHOD_LMA);
  step(warped, 600, 1.0 / 30);
  step(linear, 600, 1.0 / 30);
  const double lengthening = middle_line(linear) / STRIP_LENGTH - 1;
  CHECK(lengthening > 0.05);
  CHECK(fabs(middle_line(warped) / STRIP_LENGTH - 1) < 0.25 * lengthening);
  sw_state_destroy(warped);
  sw_state_destroy(linear);
  sw_model_destroy(model);
}

static void free_vibration_returns_after_one_period(void) {
  SwModel *model = sagging_model();
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  const double start[6] = {0.1, 0, 0, 0, 0, 0}, still[6] = {0};
  double hertz[6], q[6], rate[6];
  uint32_t count;
  OK(sw_model_frequencies(model, hertz, 6, &count));
  OK(sw_state_set_amplitudes(state, start, still, 6));
  step(state, 1000, 1 / (1000 * hertz[0]));
  OK(sw_state_amplitudes(state, q, rate, 6, &count));
  CHECK(count == 6);
  CHECK_NEAR(q[0], 0.1, 1e-12); /* rounding of 1000 steps of size 1e-16 each */
  CHECK_NEAR(rate[0], 0, 1e-12);
  step(state, 500, 1 / (1000 * hertz[0]));
  OK(sw_state_amplitudes(state, q, rate, 6, &count));
  CHECK_NEAR(q[0], -0.1, 1e-12);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void energy_is_kept_by_the_exact_propagator_and_lost_by_implicit_euler(void) {
  SwModel *model = sagging_model();
  SwState *exact = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  SwState *euler = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_IMPLICIT_EULER);
  const double q[6] = {0.3, -0.1, 0.02, 0.01, -0.005, 0.002}, rate[6] = {0, 0.1, 0, -0.2, 0, 0.05};
  OK(sw_state_set_amplitudes(exact, q, rate, 6));
  OK(sw_state_set_amplitudes(euler, q, rate, 6));
  const SwStateReport start = report_of(exact);
  const double energy = start.kinetic_energy + start.elastic_energy;
  double last = energy;
  CHECK(start.kinetic_energy > 0 && start.elastic_energy > 0);
  for (int k = 0; k < 1000; ++k) {
    step(exact, 1, 1.0 / 30);
    step(euler, 1, 1.0 / 30);
    const SwStateReport e = report_of(euler);
    CHECK(isfinite(e.kinetic_energy) && isfinite(e.elastic_energy));
    CHECK(e.kinetic_energy + e.elastic_energy <= last);
    last = e.kinetic_energy + e.elastic_energy;
  }
  const SwStateReport end = report_of(exact);
  CHECK_NEAR(end.kinetic_energy + end.elastic_energy, energy, 1e-11 * energy); /* rounding of 1000 steps */
  CHECK(last < 0.9 * energy);
  sw_state_destroy(exact);
  sw_state_destroy(euler);
  sw_model_destroy(model);
}

static void time_is_the_sum_of_the_steps(void) {
  SwModel *model = sagging_model();
  SwState *state = new_state(model, 0, 0);
  step(state, 3, 0.25);
  step(state, 1, 0.125);
  CHECK(report_of(state).time == 0.875);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void reset_returns_to_rest_and_keeps_loads_and_damping(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  step(state, 20, 1.0 / 30);
  const Positions once = positions_of(state, SW_SPACE_WORLD);
  OK(sw_state_reset(state));
  CHECK(report_of(state).time == 0 && report_of(state).max_displacement == 0);
  step(state, 20, 1.0 / 30);
  const Positions again = positions_of(state, SW_SPACE_WORLD);
  CHECK(memcmp(&once, &again, sizeof once) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------- save, load, clone */

/* A frame that moves and turns, so that what is saved of the frame matters. */
static void shake(SwState *state, int first, int count) {
  for (int k = first; k < first + count; ++k) {
    const double t = (k + 1) / 30.0, angle = 0.2 * t * t;
    const double rotation[9] = {cos(angle), -sin(angle), 0, sin(angle), cos(angle), 0, 0, 0, 1};
    SwFrameDesc frame;
    sw_frame_desc_init(&frame);
    frame.origin[0] = 0.1 * t * t;
    memcpy(frame.rotation, rotation, sizeof rotation);
    OK(sw_state_set_frame(state, &frame));
    step(state, 1, 1.0 / 30);
  }
}

static void a_run_goes_on_with_the_same_bytes_after_load_and_in_a_clone(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP), *clone = NULL;
  unsigned char saved[1024];
  uint64_t size = 0;
  shake(state, 0, 15);
  OK(sw_state_save(state, NULL, 0, &size));
  CHECK(size > 0 && size <= sizeof saved);
  OK(sw_state_save(state, saved, sizeof saved, &size));
  OK(sw_state_clone(state, &clone));

  shake(state, 15, 15);
  const Positions straight = positions_of(state, SW_SPACE_WORLD);
  shake(clone, 15, 15);
  const Positions cloned = positions_of(clone, SW_SPACE_WORLD);
  OK(sw_state_load(state, saved, size));
  CHECK_NEAR(report_of(state).time, 0.5, 1e-15); /* rounding of 15 sums */
  shake(state, 15, 15);
  const Positions loaded = positions_of(state, SW_SPACE_WORLD);

  CHECK(memcmp(&straight, &cloned, sizeof straight) == 0);
  CHECK(memcmp(&straight, &loaded, sizeof straight) == 0);
  sw_state_destroy(state);
  sw_state_destroy(clone);
  sw_model_destroy(model);
}

static void a_clone_is_independent(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP), *clone = NULL;
  step(state, 10, 1.0 / 30);
  OK(sw_state_clone(state, &clone));
  const Positions before = positions_of(clone, SW_SPACE_WORLD);
  step(state, 10, 1.0 / 30);
  const Positions after = positions_of(clone, SW_SPACE_WORLD), moved = positions_of(state, SW_SPACE_WORLD);
  CHECK(memcmp(&before, &after, sizeof before) == 0);
  CHECK(memcmp(&before, &moved, sizeof before) != 0);
  sw_state_destroy(state);
  sw_state_destroy(clone);
  sw_model_destroy(model);
}

static void a_state_outlives_its_model(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP), *other = sagging_state(model, SW_METHOD_WARP);
  step(other, 30, 1.0 / 30);
  const Positions expected = positions_of(other, SW_SPACE_WORLD);
  sw_model_destroy(model);
  step(state, 30, 1.0 / 30);
  const Positions alone = positions_of(state, SW_SPACE_WORLD);
  CHECK(memcmp(&expected, &alone, sizeof alone) == 0);
  sw_state_destroy(state);
  sw_state_destroy(other);
}

static void a_second_precompute_leaves_existing_states_alone(void) {
  SwModel *model = sagging_model();
  SwState *before = sagging_state(model, SW_METHOD_WARP);
  double q[6], rate[6];
  uint32_t count = 0;
  precompute(model, 3, 0);
  CHECK(info_of(model).modes == 3);
  step(before, 1, 1.0 / 30);
  OK(sw_state_amplitudes(before, q, rate, 6, &count));
  CHECK(count == 6);
  SwState *after = new_state(model, 0, 0);
  OK(sw_state_amplitudes(after, NULL, NULL, 0, &count));
  CHECK(count == 3);
  sw_state_destroy(before);
  sw_state_destroy(after);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------------ frames */

static SwFrameDesc turned_frame(uint32_t flags) {
  /* A third of a turn about (1 1 1): x to y, y to z, z to x; exact in floating point. */
  const double rotation[9] = {0, 0, 1, 1, 0, 0, 0, 1, 0};
  SwFrameDesc frame;
  sw_frame_desc_init(&frame);
  frame.flags = flags;
  frame.origin[0] = 3;
  frame.origin[1] = -2;
  frame.origin[2] = 0.5;
  memcpy(frame.rotation, rotation, sizeof rotation);
  return frame;
}

static void to_world(const SwFrameDesc *frame, const double *local, double *world) {
  for (int i = 0; i < 3; ++i) {
    world[i] = frame->origin[i];
    for (int j = 0; j < 3; ++j) world[i] += frame->rotation[3 * i + j] * local[j];
  }
}

static void a_teleported_shell_at_rest_moves_rigidly(void) {
  const Strip strip = make_strip();
  SwModel *model = sagging_model();
  SwState *state = new_state(model, 0, 0);
  const SwFrameDesc frame = turned_frame(SW_FRAME_TELEPORT);
  step(state, 3, 1.0 / 30);
  OK(sw_state_set_frame(state, &frame));
  step(state, 3, 1.0 / 30);
  const Positions world = positions_of(state, SW_SPACE_WORLD), local = positions_of(state, SW_SPACE_FRAME);
  CHECK(memcmp(local.x, strip.positions, sizeof local.x) == 0);
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) {
    double expected[3];
    to_world(&frame, &strip.positions[3 * v], expected);
    CHECK_NEAR(distance(vertex(&world, v), expected), 0, 1e-14); /* rounding of numbers below 8 */
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_frame_that_moves_without_teleport_stirs_the_shell(void) {
  SwModel *model = sagging_model();
  SwState *state = new_state(model, 0, 0);
  SwFrameDesc frame;
  sw_frame_desc_init(&frame);
  step(state, 1, 1.0 / 30);
  frame.origin[2] = 0.01; /* the support jerks upwards: the free end lags behind, below it */
  OK(sw_state_set_frame(state, &frame));
  step(state, 1, 1.0 / 30);
  const Positions local = positions_of(state, SW_SPACE_FRAME);
  CHECK(vertex(&local, strip_vertex(STRIP_COLUMNS - 1, 1))[2] < -0.005);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* The frame flies along evenly when the shell is reset. Had its velocity been kept, the next step, in which the frame stands,
   would feel it stop. */
static void reset_leaves_the_frame_where_it_is_and_at_rest(void) {
  const Strip strip = make_strip();
  SwModel *model = sagging_model();
  SwState *state = new_state(model, 0, 0);
  SwFrameDesc frame;
  sw_frame_desc_init(&frame);
  for (int k = 0; k < 5; ++k) {
    OK(sw_state_set_frame(state, &frame));
    step(state, 1, 0.125);
    frame.origin[2] += 0.25;
  }
  CHECK(report_of(state).max_displacement > 0.1);
  OK(sw_state_reset(state));
  step(state, 1, 0.125);
  CHECK(report_of(state).max_displacement == 0);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) CHECK(vertex(&p, v)[2] == strip.positions[3 * v + 2] + 1.0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* In a frame that falls freely nothing is felt; at constant acceleration a = g upwards twice the weight is. */
static void given_acceleration_of_the_frame_adds_to_gravity(void) {
  SwModel *model = sagging_model();
  SwState *falling = new_state(model, SW_METHOD_LMA, 0), *rising = new_state(model, SW_METHOD_LMA, 0);
  SwState *standing = new_state(model, SW_METHOD_LMA, 0);
  SwState *all[3] = {falling, rising, standing};
  const double acceleration[3] = {-0.1, 0.1, 0};
  double height[3];
  for (int s = 0; s < 3; ++s) {
    set_gravity(all[s], 0, 0, -0.1);
    for (int k = 0; k < 30; ++k) {
      SwFrameDesc frame;
      sw_frame_desc_init(&frame);
      frame.flags = SW_FRAME_MOTION_GIVEN;
      frame.acceleration[2] = acceleration[s];
      OK(sw_state_set_frame(all[s], &frame));
      step(all[s], 1, 1.0 / 30);
    }
    const Positions local = positions_of(all[s], SW_SPACE_FRAME);
    height[s] = vertex(&local, strip_vertex(STRIP_COLUMNS - 1, 1))[2];
  }
  CHECK(height[2] < -1e-3);
  CHECK_NEAR(height[0], 0, 1e-12);                              /* forces cancel to rounding */
  CHECK_NEAR(height[1], 2 * height[2], 1e-9 * fabs(height[2])); /* linear: doubled, to the rounding of 30 steps */
  for (int s = 0; s < 3; ++s) sw_state_destroy(all[s]);
  sw_model_destroy(model);
}

static void gravity_is_given_in_world_axes(void) {
  SwModel *model = sagging_model();
  SwState *upright = sagging_state(model, SW_METHOD_WARP), *turned = sagging_state(model, SW_METHOD_WARP);
  const SwFrameDesc frame = turned_frame(0);
  OK(sw_state_set_frame(turned, &frame));
  set_gravity(turned, -0.4, 0, 0); /* the frame's z is the world's x */
  step(upright, 30, 1.0 / 30);
  step(turned, 30, 1.0 / 30);
  const Positions a = positions_of(upright, SW_SPACE_FRAME), b = positions_of(turned, SW_SPACE_FRAME);
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v)
    CHECK_NEAR(distance(vertex(&a, v), vertex(&b, v)), 0, 1e-12); /* rounding of the turned gravity, over 30 steps */
  sw_state_destroy(upright);
  sw_state_destroy(turned);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------------ output */

/* The header's promise: four units in the last place of the largest coordinate, at most 2^-23 of it each. The strip is the
   largest thing here, as its frame does not move. */
static void single_precision_output_is_double_output_to_four_units_in_the_last_place(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  float single[3 * STRIP_VERTICES];
  step(state, 40, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, single, 0, STRIP_VERTICES));
  for (int i = 0; i < 3 * STRIP_VERTICES; ++i) CHECK_NEAR(single[i], p.x[i], 4 * STRIP_LENGTH / 8388608);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* Rows of floats in a wider, unaligned structure hold the bits of the packed ones; what lies between is not touched. */
static void strided_floats_are_the_packed_ones(void) {
  enum { STRIDE = 17 };
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  static unsigned char bytes[STRIDE * STRIP_VERTICES];
  float packed[3 * STRIP_VERTICES];
  memset(bytes, 0xAB, sizeof bytes);
  step(state, 40, 1.0 / 30);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, packed, 0, STRIP_VERTICES));
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, bytes, STRIDE, STRIP_VERTICES));
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) {
    CHECK(memcmp(&bytes[STRIDE * v], &packed[3 * v], 12) == 0);
    for (int k = 12; k < STRIDE; ++k) CHECK(bytes[STRIDE * v + (uint32_t)k] == 0xAB);
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* 29 bytes from vertex to vertex: more than three doubles, and never aligned twice. */
static void strided_unaligned_buffers_are_filled_without_touching_the_gaps(void) {
  enum { STRIDE = 29 };
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  static unsigned char bytes[STRIDE * STRIP_VERTICES];
  memset(bytes, 0xAB, sizeof bytes);
  step(state, 40, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, bytes, STRIDE, STRIP_VERTICES));
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) {
    CHECK(memcmp(&bytes[STRIDE * v], vertex(&p, v), 24) == 0);
    for (int k = 24; k < STRIDE; ++k) CHECK(bytes[STRIDE * v + (uint32_t)k] == 0xAB);
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* The same mesh as packed doubles, as floats in rows of four, and as padded triangles. */
static void mesh_buffers_may_be_strided_and_single(void) {
  const Strip strip = make_strip();
  float points[4 * STRIP_VERTICES];
  uint32_t corners[5 * STRIP_TRIANGLES];
  SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = NULL;
  memset(points, 0xFF, sizeof points); /* NaN, and indices out of range, where nothing may be read */
  memset(corners, 0xFF, sizeof corners);
  for (int i = 0; i < 3 * STRIP_VERTICES; ++i) points[4 * (i / 3) + i % 3] = (float)strip.positions[i];
  for (int k = 0; k < 3 * STRIP_TRIANGLES; ++k) corners[5 * (k / 3) + k % 3] = strip.triangles[k];
  mesh.positions = points;
  mesh.position_format = SW_FORMAT_F32;
  mesh.position_stride = 16;
  mesh.triangles = corners;
  mesh.triangle_stride = 20;
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  CHECK_NEAR(info_of(model).total_area, STRIP_LENGTH * STRIP_WIDTH, 1e-6); /* coordinates rounded to floats */
  sw_model_destroy(model);
}

static void normals_are_unit_and_turn_with_the_strip(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  Positions n;
  OK(sw_state_normals(state, SW_SPACE_WORLD, SW_FORMAT_F64, n.x, 0, STRIP_VERTICES));
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) {
    const double up[3] = {0, 0, 1};
    CHECK_NEAR(distance(vertex(&n, v), up), 0, 1e-15); /* all triangles lie in the xy-plane, turned to +z */
  }
  step(state, 600, 1.0 / 30);
  OK(sw_state_normals(state, SW_SPACE_WORLD, SW_FORMAT_F64, n.x, 0, STRIP_VERTICES));
  const double origin[3] = {0, 0, 0};
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) CHECK_NEAR(distance(vertex(&n, v), origin), 1, 1e-14); /* rounding */
  const double *tip = vertex(&n, strip_vertex(STRIP_COLUMNS - 1, 1));
  CHECK(tip[0] > 0.2 && tip[2] > 0); /* the end hangs down: its upper side looks outwards */

  const Positions p = positions_of(state, SW_SPACE_WORLD);
  const double *end = vertex(&p, strip_vertex(STRIP_COLUMNS - 1, 1)),
               *before = vertex(&p, strip_vertex(STRIP_COLUMNS - 2, 1));
  const double along = (end[0] - before[0]) * tip[0] + (end[1] - before[1]) * tip[1] + (end[2] - before[2]) * tip[2];
  CHECK_NEAR(along / distance(end, before), 0, 0.05); /* radians: the normal is the mean over neighbouring triangles */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void rotations_are_unit_quaternions_that_turn_the_end_downwards(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  double r[4 * STRIP_VERTICES];
  OK(sw_state_rotations(state, SW_SPACE_WORLD, SW_FORMAT_F64, r, 0, STRIP_VERTICES));
  for (int i = 0; i < 4 * STRIP_VERTICES; ++i) CHECK(r[i] == (i % 4 == 0));
  step(state, 600, 1.0 / 30);
  OK(sw_state_rotations(state, SW_SPACE_FRAME, SW_FORMAT_F64, r, 0, STRIP_VERTICES));
  double largest = 0;
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    const double *q = &r[4 * v];
    CHECK_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-14); /* rounding */
    largest = fmax(largest, 2 * acos(fmin(1, fabs(q[0]))));
  }
  CHECK_NEAR(largest, report_of(state).max_rotation, 1e-7);   /* acos near 1 halves the digits */
  CHECK(r[4 * strip_vertex(STRIP_COLUMNS - 1, 1) + 2] > 0.1); /* about +y: x towards -z */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void world_output_is_frame_output_carried_by_the_frame(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  const SwFrameDesc frame = turned_frame(0);
  Positions normal_world, normal_frame;
  OK(sw_state_set_frame(state, &frame));
  step(state, 60, 1.0 / 30);
  const Positions world = positions_of(state, SW_SPACE_WORLD), local = positions_of(state, SW_SPACE_FRAME);
  OK(sw_state_normals(state, SW_SPACE_WORLD, SW_FORMAT_F64, normal_world.x, 0, STRIP_VERTICES));
  OK(sw_state_normals(state, SW_SPACE_FRAME, SW_FORMAT_F64, normal_frame.x, 0, STRIP_VERTICES));
  SwFrameDesc turn_only = frame;
  memset(turn_only.origin, 0, sizeof turn_only.origin);
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v) {
    double expected[3];
    to_world(&frame, vertex(&local, v), expected);
    CHECK_NEAR(distance(vertex(&world, v), expected), 0, 1e-14); /* rounding of numbers below 8 */
    to_world(&turn_only, vertex(&normal_frame, v), expected);
    CHECK_NEAR(distance(vertex(&normal_world, v), expected), 0, 1e-14);
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void the_report_measures_what_positions_show(void) {
  const Strip strip = make_strip();
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  step(state, 60, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_FRAME);
  double largest = 0;
  for (uint32_t v = 0; v < STRIP_VERTICES; ++v)
    largest = fmax(largest, distance(vertex(&p, v), &strip.positions[3 * v]));
  CHECK_NEAR(report_of(state).max_displacement, largest, 1e-14); /* rounding of rest + displacement */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void leaving_the_range_is_reported(void) {
  SwModel *model = sagging_model();
  SwState *state = new_state(model, 0, 0);
  const double still[6] = {0};
  double q[6] = {0};
  for (q[0] = 0.1; report_of(state).max_rotation <= kPi / 2; q[0] *= 1.2) {
    OK(sw_state_set_amplitudes(state, q, still, 6));
    CHECK(report_of(state).turn_in_range == (report_of(state).max_rotation <= kPi / 2));
  }
  CHECK(report_of(state).turn_in_range == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------ constraints */

static const uint32_t kTip = STRIP_VERTICES - 2; /* the middle of the free end, at (4, 0, 0) */

/* A hard constraint on the tip. */
static SwConstraintDesc tip_constraint(uint32_t id, uint32_t kind, uint32_t axes) {
  SwConstraintDesc desc;
  sw_constraint_desc_init(&desc);
  desc.id = id;
  desc.kind = kind;
  desc.vertex = kTip;
  desc.axes = axes;
  desc.position[0] = STRIP_LENGTH;
  return desc;
}

static SwConstraintDesc height_of_tip(uint32_t id, double z) {
  SwConstraintDesc desc = tip_constraint(id, SW_CONSTRAINT_POSITION, SW_AXIS_Z);
  desc.position[2] = z;
  return desc;
}

static void set_turn(SwConstraintDesc *desc, const double axis[3], double angle) {
  const double c = cos(angle), s = sin(angle), *a = axis;
  const double cross[9] = {0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) desc->rotation[3 * i + j] = c * (i == j) + s * cross[3 * i + j] + (1 - c) * a[i] * a[j];
}

/* Angle between the tip's frame and a rotation about an axis. */
static double angle_from_turn(const SwState *state, const double axis[3], double angle) {
  double q[4 * STRIP_VERTICES];
  OK(sw_state_rotations(state, SW_SPACE_WORLD, SW_FORMAT_F64, q, 0, STRIP_VERTICES));
  const double *tip = &q[4 * kTip], c = cos(angle / 2), s = sin(angle / 2);
  /* The vector part of q conj(p): accurate for small angles, where the cosine is not. */
  const double p[4] = {c, s * axis[0], s * axis[1], s * axis[2]};
  const double x = -tip[0] * p[1] + tip[1] * p[0] - tip[2] * p[3] + tip[3] * p[2];
  const double y = -tip[0] * p[2] + tip[2] * p[0] - tip[3] * p[1] + tip[1] * p[3];
  const double z = -tip[0] * p[3] + tip[3] * p[0] - tip[1] * p[2] + tip[2] * p[1];
  return 2 * asin(fmin(1, sqrt(x * x + y * y + z * z)));
}

static uint32_t count_constraints(const SwState *state) {
  uint32_t count = 77;
  OK(sw_state_constraint_report(state, NULL, sizeof(SwConstraintReport), 0, &count));
  return count;
}

static SwConstraintReport only_report(const SwState *state) {
  SwConstraintReport report;
  uint32_t count = 0;
  OK(sw_state_constraint_report(state, &report, sizeof(SwConstraintReport), 1, &count));
  CHECK(count == 1);
  return report;
}

/* A millionth of the size, the header's bound for `met`. */
static double met_length(const SwModel *model) { return 1e-6 * info_of(model).size; }

static void a_position_is_met_from_the_next_step_on_and_reported(void) {
  SwModel *model = sagging_model();
  const uint32_t integrators[2] = {SW_INTEGRATOR_IMPLICIT_EULER, SW_INTEGRATOR_EXACT};
  for (int k = 0; k < 2; ++k) {
    SwState *state = new_state(model, 0, integrators[k]);
    set_gravity(state, 0, 0, -0.4);
    set_damping_ratio(state, 0.5);
    SwConstraintDesc desc = tip_constraint(4, SW_CONSTRAINT_POSITION, 0);
    desc.position[0] = STRIP_LENGTH - 0.4;
    desc.position[2] = 1;
    OK(sw_state_set_constraint(state, &desc));
    SwConstraintReport report = only_report(state);
    CHECK(report.met == 0 && report.iterations == 0 && report.residual == 0); /* nothing was asked of it yet */
    step(state, 1, 1.0 / 30);
    report = only_report(state);
    const Positions p = positions_of(state, SW_SPACE_WORLD);
    CHECK(report.id == 4 && report.kind == SW_CONSTRAINT_POSITION && report.vertex == kTip && report.reserved == 0);
    CHECK(report.met == 1 && report.iterations > 0 && report.residual <= met_length(model));
    CHECK(distance(vertex(&p, kTip), desc.position) <= met_length(model));
    CHECK(report.force[2] > 0); /* it lifts */
    step(state, 300, 1.0 / 30);
    CHECK(only_report(state).met == 1 && report_of(state).constraint_work > 0);
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

static void an_orientation_is_met_and_reported(void) {
  const double axis[3] = {0.6, -0.8, 0};
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 16, SW_PRECISION_F64); /* the strip is so narrow that fewer hold no twist */
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  for (int k = 1; k <= 60; ++k) {
    SwConstraintDesc desc = tip_constraint(0, SW_CONSTRAINT_ORIENTATION, 0);
    set_turn(&desc, axis, 0.01 * k);
    desc.position[0] = NAN; /* not read */
    OK(sw_state_set_constraint(state, &desc));
    step(state, 1, 1.0 / 30);
    CHECK(only_report(state).met == 1 && only_report(state).residual <= 1e-6);
    CHECK(angle_from_turn(state, axis, 0.01 * k) <= 1e-6); /* a microradian, the header's bound */
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_zero_rotation_matrix_means_the_identity(void) {
  const double axis[3] = {1, 0, 0};
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  const SwConstraintDesc desc = tip_constraint(0, SW_CONSTRAINT_ORIENTATION, SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z);
  OK(sw_state_set_constraint(state, &desc));
  step(state, 30, 1.0 / 30);
  CHECK(only_report(state).met == 1);
  CHECK(angle_from_turn(state, axis, 0) <= 1e-6);
  CHECK(report_of(state).max_displacement > 0.01); /* it sags, its end level */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void constraints_are_reported_by_ascending_id(void) {
  const uint32_t ids[4] = {9, 2, SW_ALL_CONSTRAINTS - 1, 0}, sorted[4] = {0, 2, 9, SW_ALL_CONSTRAINTS - 1};
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  SwConstraintReport reports[5], untouched;
  uint32_t count = 0;
  CHECK(count_constraints(state) == 0);
  for (int k = 0; k < 4; ++k) {
    const SwConstraintDesc desc = height_of_tip(ids[k], 0.5); /* four times the same: no conflict */
    OK(sw_state_set_constraint(state, &desc));
  }
  step(state, 1, 1.0 / 30);
  memset(reports, 0xAB, sizeof reports);
  memset(&untouched, 0xAB, sizeof untouched);
  OK(sw_state_constraint_report(state, reports, sizeof(SwConstraintReport), 5, &count));
  CHECK(count == 4);
  for (int k = 0; k < 4; ++k) CHECK(reports[k].id == sorted[k] && reports[k].met == 1);
  CHECK(memcmp(&reports[4], &untouched, sizeof untouched) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_cleared_constraint_lets_go(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP), *never = sagging_state(model, SW_METHOD_WARP);
  const SwConstraintDesc up = height_of_tip(1, 1), also = tip_constraint(2, SW_CONSTRAINT_ORIENTATION, SW_AXIS_X);
  OK(sw_state_set_constraint(state, &up));
  OK(sw_state_set_constraint(state, &also));
  step(state, 30, 1.0 / 30);
  OK(sw_state_clear_constraint(state, 1));
  CHECK(count_constraints(state) == 1 && only_report(state).id == 2);
  OK(sw_state_clear_constraint(state, SW_ALL_CONSTRAINTS));
  OK(sw_state_clear_constraint(state, SW_ALL_CONSTRAINTS)); /* all of none */
  CHECK(count_constraints(state) == 0);
  step(state, 3000, 1.0 / 30);
  step(never, 3000, 1.0 / 30);
  const Positions a = positions_of(state, SW_SPACE_WORLD), b = positions_of(never, SW_SPACE_WORLD);
  /* At half of critical damping and a period of 12.5 s, 100 s leave e^-25 of the motion. */
  CHECK(distance(vertex(&a, kTip), vertex(&b, kTip)) < 1e-9);
  sw_state_destroy(state);
  sw_state_destroy(never);
  sw_model_destroy(model);
}

static void a_constraint_with_a_known_id_replaces_the_old_one(void) {
  const double level[3] = {1, 0, 0};
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  for (int k = 0; k < 3; ++k) {
    const SwConstraintDesc moved = height_of_tip(7, 0.2 * k);
    OK(sw_state_set_constraint(state, &moved));
    step(state, 1, 1.0 / 30);
    const Positions p = positions_of(state, SW_SPACE_WORLD);
    CHECK(only_report(state).met == 1);
    CHECK_NEAR(vertex(&p, kTip)[2], 0.2 * k, met_length(model));
  }
  const SwConstraintDesc other = tip_constraint(7, SW_CONSTRAINT_ORIENTATION, 0);
  OK(sw_state_set_constraint(state, &other));
  step(state, 1, 1.0 / 30);
  CHECK(only_report(state).kind == SW_CONSTRAINT_ORIENTATION && only_report(state).met == 1);
  CHECK(angle_from_turn(state, level, 0) <= 1e-6);
  SwConstraintDesc elsewhere = height_of_tip(7, 0.1);
  elsewhere.vertex = strip_vertex(STRIP_COLUMNS / 2, 1);
  OK(sw_state_set_constraint(state, &elsewhere));
  step(state, 1, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  CHECK(only_report(state).vertex == elsewhere.vertex && only_report(state).met == 1);
  CHECK_NEAR(vertex(&p, elsewhere.vertex)[2], 0.1, met_length(model));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_free_strip_is_turned_through_several_revolutions(void) {
  const double axis[3] = {0.48, -0.6, 0.64};
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = NULL;
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  precompute(model, 10, SW_PRECISION_F64);
  SwState *state = new_state(model, 0, 0);
  set_damping_ratio(state, 0.1);
  for (int k = 1; k <= 200; ++k) {
    SwConstraintDesc desc = tip_constraint(0, SW_CONSTRAINT_ORIENTATION, 0);
    set_turn(&desc, axis, 0.1 * k);
    OK(sw_state_set_constraint(state, &desc));
    step(state, 1, 1.0 / 30);
    CHECK(only_report(state).met == 1);
    CHECK(angle_from_turn(state, axis, 0.1 * k) <= 1e-6);
  }
  CHECK(report_of(state).max_rotation > 6 * kPi); /* 20 rad, three whole turns, were not unwound */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void lead(SwState *state, int first, int count) {
  const double axis[3] = {0.6, -0.8, 0};
  for (int k = first; k < first + count; ++k) {
    const SwConstraintDesc up = height_of_tip(1, 0.02 * k);
    SwConstraintDesc turn = tip_constraint(2, SW_CONSTRAINT_ORIENTATION, 0);
    set_turn(&turn, axis, 0.01 * k);
    OK(sw_state_set_constraint(state, &up));
    OK(sw_state_set_constraint(state, &turn));
    step(state, 1, 1.0 / 30);
  }
}

/* The saved bytes hold no constraints: they are inputs, set again by the host. */
static void a_led_run_goes_on_with_the_same_bytes_once_its_constraints_are_set_again(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP), *fresh = sagging_state(model, SW_METHOD_WARP), *clone = NULL;
  unsigned char saved[1024];
  uint64_t size = 0;
  lead(state, 0, 15);
  OK(sw_state_save(state, saved, sizeof saved, &size));
  OK(sw_state_clone(state, &clone));
  CHECK(count_constraints(clone) == 2);
  lead(state, 15, 15);
  const Positions straight = positions_of(state, SW_SPACE_WORLD);
  lead(clone, 15, 15);
  const Positions cloned = positions_of(clone, SW_SPACE_WORLD);
  OK(sw_state_load(state, saved, size));
  CHECK(count_constraints(state) == 2); /* the host's inputs are not undone */
  lead(state, 15, 15);
  const Positions loaded = positions_of(state, SW_SPACE_WORLD);
  OK(sw_state_load(fresh, saved, size));
  CHECK(count_constraints(fresh) == 0);
  lead(fresh, 15, 15);
  const Positions elsewhere = positions_of(fresh, SW_SPACE_WORLD);
  CHECK(memcmp(&straight, &cloned, sizeof straight) == 0);
  CHECK(memcmp(&straight, &loaded, sizeof straight) == 0);
  CHECK(memcmp(&straight, &elsewhere, sizeof straight) == 0);
  sw_state_destroy(state);
  sw_state_destroy(fresh);
  sw_state_destroy(clone);
  sw_model_destroy(model);
}

static void reset_keeps_constraints_and_repeats_the_run(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  const SwConstraintDesc up = height_of_tip(1, 0.7);
  OK(sw_state_set_constraint(state, &up));
  step(state, 20, 1.0 / 30);
  const Positions once = positions_of(state, SW_SPACE_WORLD);
  OK(sw_state_reset(state));
  CHECK(count_constraints(state) == 1);
  CHECK(report_of(state).constraint_work == 0);
  step(state, 20, 1.0 / 30);
  const Positions again = positions_of(state, SW_SPACE_WORLD);
  CHECK(memcmp(&once, &again, sizeof once) == 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void compliance_gives_way_in_proportion_to_the_force(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  SwConstraintDesc desc = height_of_tip(1, 0.5);
  desc.compliance = 2;
  OK(sw_state_set_constraint(state, &desc));
  step(state, 3000, 1.0 / 30); /* to rest */
  const SwConstraintReport report = only_report(state);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  CHECK(report.met == 1 && report.residual > 0.01);
  CHECK_NEAR(0.5 - vertex(&p, kTip)[2], report.residual, met_length(model));
  CHECK_NEAR(report.force[2] * 2, report.residual, met_length(model));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void what_is_out_of_reach_is_reported_as_missing(void) {
  SwModel *model = sagging_model();
  SwState *state = sagging_state(model, SW_METHOD_WARP);
  SwConstraintDesc desc = tip_constraint(1, SW_CONSTRAINT_POSITION, 0);
  desc.position[0] = 20; /* the strip is 4 long and hardly stretches */
  OK(sw_state_set_constraint(state, &desc));
  step(state, 30, 1.0 / 30);
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  CHECK(only_report(state).met == 0);
  CHECK_NEAR(only_report(state).residual, distance(vertex(&p, kTip), desc.position), met_length(model));
  CHECK(report_of(state).max_displacement < 10 * STRIP_LENGTH);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------- methods, loads, equilibria */

static const uint32_t methods[5] = {SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_SHELL_IMPLICIT,
                                    SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_SHELL_EXPLICIT};
enum { N_METHODS = 5, N_STATIC = 4 }; /* the two nonlinear methods share one equilibrium */

/* The strip with so many modes that what they leave out of a static sag is below a thousandth. */
static SwModel *many_mode_model(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 24, SW_PRECISION_F64);
  return model;
}

static SwEquilibriumReport settle(SwState *state) {
  SwEquilibriumReport report;
  sw_equilibrium_report_init(&report);
  OK(sw_state_equilibrium(state, &report));
  return report;
}

static double tip_height(const SwState *state) {
  const Positions p = positions_of(state, SW_SPACE_WORLD);
  return vertex(&p, kTip)[2];
}

static SwForceDesc force_desc(const double *forces, uint32_t count, const uint32_t *vertices) {
  SwForceDesc desc;
  sw_force_desc_init(&desc);
  desc.format = SW_FORMAT_F64;
  desc.forces = forces;
  desc.count = count;
  desc.vertices = vertices;
  return desc;
}

static double largest_difference(const SwState *a, const SwState *b) {
  const Positions p = positions_of(a, SW_SPACE_WORLD), q = positions_of(b, SW_SPACE_WORLD);
  double largest = 0;
  for (uint32_t i = 0; i < STRIP_VERTICES; ++i) largest = fmax(largest, distance(vertex(&p, i), vertex(&q, i)));
  return largest;
}

static void a_small_load_bends_every_method_alike(void) {
  SwModel *model = many_mode_model();
  double sag[N_METHODS];
  for (int m = 0; m < N_METHODS; ++m) {
    SwState *state = new_state(model, methods[m], 0);
    set_gravity(state, 0, 0, -1e-3);
    const SwEquilibriumReport report = settle(state);
    CHECK(report.residual < 1e-5 && report.iterations > 0);
    sag[m] = tip_height(state);
    CHECK(sag[m] < 0 && sag[m] > -0.01 * STRIP_LENGTH);
    sw_state_destroy(state);
  }
  /* Static sag falls off as the fourth power of a mode's number: what 24 modes leave out is far below a thousandth, and so
     is the square of a slope of less than a hundredth. */
  for (int m = 1; m < N_METHODS; ++m) CHECK_NEAR(sag[m], sag[0], 1e-3 * fabs(sag[0]));
  sw_model_destroy(model);
}

/* Far bent, the methods part: the warp stays near the nonlinear shell, linear modes do not. */
static void a_large_load_parts_the_methods(void) {
  SwModel *model = many_mode_model();
  SwState *state[N_STATIC];
  for (int m = 0; m < N_STATIC; ++m) {
    state[m] = new_state(model, methods[m], 0);
    set_gravity(state[m], 0, 0, -0.3);
    settle(state[m]);
  }
  for (int m = 0; m < N_STATIC; m += 3)
    CHECK(largest_difference(state[m], state[2]) < 0.25 * largest_difference(state[1], state[2]));
  for (int m = 0; m < N_STATIC; ++m) sw_state_destroy(state[m]);
  sw_model_destroy(model);
}

static void a_step_of_the_explicit_shell_is_close_to_one_of_the_implicit(void) {
  SwModel *model = many_mode_model();
  SwState *implicit = new_state(model, SW_METHOD_SHELL_IMPLICIT, 0);
  SwState *explicit = new_state(model, SW_METHOD_SHELL_EXPLICIT, 0);
  set_gravity(implicit, 0, 0, -1);
  set_gravity(explicit, 0, 0, -1);
  step(implicit, 300, 1.0 / 30000); /* the paper's step */
  step(explicit, 300, 1.0 / 30000);
  /* Falling from rest for a hundredth of a second. Both are of first order: they are half a step to either side of free fall,
     g t h / 2 each, so 3.3e-7 apart, and the bending near the clamp adds less than that again. */
  const double fall = 0.5 * 0.01 * 0.01;
  CHECK_NEAR(tip_height(explicit), -fall, 0.02 * fall);
  CHECK(largest_difference(implicit, explicit) < 7e-7);
  CHECK_NEAR(report_of(explicit).time, 0.01, 1e-12);
  sw_state_destroy(implicit);
  sw_state_destroy(explicit);
  sw_model_destroy(model);
}

static void forces_of_the_weight_do_what_gravity_does(void) {
  const Strip strip = make_strip();
  SwModel *model = many_mode_model();
  double mass[STRIP_VERTICES], weight[3 * STRIP_VERTICES];
  lumped_masses(&strip, mass);
  for (int i = 0; i < STRIP_VERTICES; ++i)
    weight[3 * i] = 0, weight[3 * i + 1] = 0.05 * mass[i], weight[3 * i + 2] = -0.2 * mass[i];
  for (int m = 0; m < N_STATIC; ++m) {
    SwState *by_gravity = new_state(model, methods[m], 0), *by_force = new_state(model, methods[m], 0);
    const SwForceDesc forces = force_desc(weight, STRIP_VERTICES, NULL);
    set_gravity(by_gravity, 0, 0.05, -0.2);
    OK(sw_state_set_forces(by_force, &forces));
    step(by_gravity, 10, 1.0 / 30);
    step(by_force, 10, 1.0 / 30);
    CHECK(tip_height(by_force) < -1e-3);
    CHECK(largest_difference(by_gravity, by_force) < 1e-7); /* Newton stops at 1e-8 of the load or below */
    sw_state_destroy(by_gravity);
    sw_state_destroy(by_force);
  }
  sw_model_destroy(model);
}

static void sparse_repeated_strided_and_single_forces_are_the_dense_ones(void) {
  SwModel *model = many_mode_model();
  double dense[3 * STRIP_VERTICES] = {0};
  const uint32_t listed[3] = {kTip, 60, kTip};
  const float rows[3][4] = {{0, 0, 0.03125F, 9}, {0.25F, 0, 0, 9}, {0, 0, 0.0625F, 9}}; /* exact in floats */
  dense[3 * kTip + 2] = 0.09375;
  dense[3 * 60] = 0.25;
  SwForceDesc all = force_desc(dense, STRIP_VERTICES, NULL), some = force_desc(NULL, 3, listed);
  some.format = SW_FORMAT_F32;
  some.forces = rows;
  some.stride = sizeof rows[0];
  SwState *a = new_state(model, 0, 0), *b = new_state(model, 0, 0);
  OK(sw_state_set_forces(a, &all));
  OK(sw_state_set_forces(b, &some));
  step(a, 30, 1.0 / 30);
  step(b, 30, 1.0 / 30);
  /* Forces on few vertices are added in 64 bits, those on all in 32. */
  CHECK(tip_height(a) > 0.01 && largest_difference(a, b) < 1e-5);
  sw_state_destroy(a);
  sw_state_destroy(b);
  sw_model_destroy(model);
}

static void forces_for_one_step_act_once_and_replaced_ones_no_more(void) {
  SwModel *model = many_mode_model();
  const double push[3] = {0, 0, 0.1};
  for (int m = 0; m < N_STATIC; ++m) {
    SwForceDesc once = force_desc(push, 1, &kTip), none = force_desc(NULL, 0, NULL);
    SwState *a = new_state(model, methods[m], 0), *b = new_state(model, methods[m], 0);
    OK(sw_state_set_forces(b, &once)); /* stays until replaced */
    once.flags = SW_FORCES_ONE_STEP;
    OK(sw_state_set_forces(a, &once));
    step(a, 1, 0.01);
    step(b, 1, 0.01);
    CHECK(tip_height(a) > 0 && largest_difference(a, b) == 0);
    OK(sw_state_set_forces(b, &none));
    step(a, 5, 0.01);
    step(b, 5, 0.01);
    CHECK(largest_difference(a, b) == 0);
    sw_state_destroy(a);
    sw_state_destroy(b);
  }
  sw_model_destroy(model);
}

/* The gust of a host that keeps its buffer: what the library needs of it was copied during the call. */
static void forces_and_local_wind_are_copied(void) {
  SwModel *model = many_mode_model();
  double push[3] = {0, 0, 0.1}, gust[3 * STRIP_VERTICES] = {0};
  for (int i = 0; i < STRIP_VERTICES; ++i) gust[3 * i + 2] = 1;
  uint32_t where = kTip;
  SwState *kept = new_state(model, 0, 0), *spoilt = new_state(model, 0, 0), *states[2] = {kept, spoilt};
  SwWindDesc wind;
  sw_wind_desc_init(&wind);
  wind.density = 1.2;
  wind.normal_drag = 1;
  wind.local_format = SW_FORMAT_F64;
  wind.local_velocities = gust;
  const SwForceDesc force = force_desc(push, 1, &where);
  for (int k = 0; k < 2; ++k) {
    OK(sw_state_set_forces(states[k], &force));
    OK(sw_state_set_wind(states[k], &wind));
  }
  step(kept, 10, 0.01);
  memset(gust, 0xFF, sizeof gust); /* NaN */
  push[2] = NAN;
  where = UINT32_MAX;
  step(spoilt, 10, 0.01);
  CHECK(tip_height(kept) > 0 && largest_difference(kept, spoilt) == 0);
  sw_state_destroy(kept);
  sw_state_destroy(spoilt);
  sw_model_destroy(model);
}

static void equilibrium_is_where_damped_motion_ends(void) {
  SwModel *model = many_mode_model();
  for (int m = 0; m < N_STATIC; ++m) {
    SwState *moved = new_state(model, methods[m], 0), *placed = new_state(model, methods[m], 0);
    const double push[3] = {0, 0.02, 0.01};
    const SwForceDesc force = force_desc(push, 1, &kTip);
    SwDampingDesc damping;
    double hertz[24];
    uint32_t count;
    sw_damping_desc_init(&damping);
    OK(sw_model_frequencies(model, hertz, 24, &count));
    damping.mass_coefficient = 4 * kPi * hertz[0]; /* critical for the slowest mode */
    for (int k = 0; k < 2; ++k) {
      SwState *state = k ? placed : moved;
      OK(sw_state_set_damping(state, &damping));
      set_gravity(state, 0, 0, -0.2);
      OK(sw_state_set_forces(state, &force));
    }
    settle(placed);
    step(moved, 250, 0.1 / hertz[0]); /* 25 periods: exp(-2 pi 25) is nothing */
    CHECK(tip_height(placed) < -0.1 * STRIP_LENGTH);
    CHECK(largest_difference(placed, moved) < 1e-4 * STRIP_LENGTH); /* the residual at which the search may stop */
    CHECK(report_of(placed).time == 0 && report_of(placed).kinetic_energy == 0);
    const double before = tip_height(placed);
    step(placed, 10, 0.1);
    CHECK_NEAR(tip_height(placed), before, 1e-4 * STRIP_LENGTH);
    sw_state_destroy(moved);
    sw_state_destroy(placed);
  }
  sw_model_destroy(model);
}

/* A wall of air against a strip at rest: 1/2 rho c v^2 on every square length, as if the strip weighed that. */
static void wind_presses_like_a_weight_of_half_rho_c_v_squared(void) {
  const double density = 1.2, drag = 1.3, speed = 0.2;
  SwModel *model = many_mode_model(); /* mass per area 1: pressure is acceleration */
  SwWindDesc wind;
  sw_wind_desc_init(&wind);
  wind.velocity[2] = speed;
  wind.density = density;
  wind.normal_drag = drag;
  for (int m = 0; m < N_STATIC; ++m) {
    SwState *blown = new_state(model, methods[m], 0), *weighed = new_state(model, methods[m], 0);
    OK(sw_state_set_wind(blown, &wind));
    set_gravity(weighed, 0, 0, 0.5 * density * drag * speed * speed);
    step(blown, 1, 1e-3); /* one step from rest: the strip is still flat, and still */
    step(weighed, 1, 1e-3);
    const double rise = tip_height(weighed);
    CHECK(rise > 0);
    /* The implicit shell feels the air of the step's end, where it goes along with it: h rho c v of its velocity less. */
    const double gives_way = methods[m] == SW_METHOD_SHELL_IMPLICIT ? 1 + 1e-3 * density * drag * speed : 1;
    CHECK_NEAR(gives_way * tip_height(blown), rise, 1e-6 * rise); /* Newton's residual; rounding for the modal methods */
    sw_state_destroy(blown);
    sw_state_destroy(weighed);
  }
  sw_model_destroy(model);
}

static void still_air_takes_energy_and_no_wind_takes_none(void) {
  SwModel *model = sagging_model();
  SwWindDesc air;
  sw_wind_desc_init(&air);
  air.density = 1.2;
  air.normal_drag = 1.5;
  air.tangential_drag = 0.1;
  const double start[6] = {0.3, 0, 0, 0, 0, 0}, still[6] = {0};
  double energy[3];
  for (int k = 0; k < 3; ++k) { /* never any air; air; air, then none */
    SwState *state = new_state(model, 0, SW_INTEGRATOR_EXACT);
    OK(sw_state_set_amplitudes(state, start, still, 6));
    if (k) OK(sw_state_set_wind(state, &air));
    SwWindDesc none;
    sw_wind_desc_init(&none);
    if (k == 2) OK(sw_state_set_wind(state, &none));
    step(state, 300, 1.0 / 30);
    const SwStateReport report = report_of(state);
    energy[k] = report.kinetic_energy + report.elastic_energy;
    sw_state_destroy(state);
  }
  CHECK(energy[1] < 0.9 * energy[0] && energy[2] == energy[0]);
  sw_model_destroy(model);
}

static void the_search_starts_from_the_present_shape(void) {
  SwModel *model = many_mode_model();
  for (int m = 0; m < N_STATIC; ++m) {
    SwState *state = new_state(model, methods[m], 0);
    set_gravity(state, 0, 0, -0.2);
    const SwEquilibriumReport first = settle(state), again = settle(state);
    CHECK(again.iterations <= first.iterations && again.residual < 1e-5);
    OK(sw_state_equilibrium(state, NULL)); /* a report is not required */
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

/* Rounding of the 32-bit basis must not keep the search from ending, at any load. */
static void equilibria_are_found_with_a_basis_of_32_bits(void) {
  const Strip strip = make_strip();
  SwModel *single = strip_model(&strip), *exact = strip_model(&strip);
  precompute(single, 8, SW_PRECISION_F32);
  precompute(exact, 8, SW_PRECISION_F64);
  for (int k = 1; k <= 20; ++k) {
    SwState *a = new_state(single, SW_METHOD_WARP, 0), *b = new_state(exact, SW_METHOD_WARP, 0);
    set_gravity(a, 0, 0, -0.03 * k);
    set_gravity(b, 0, 0, -0.03 * k);
    settle(a);
    settle(b);
    CHECK(largest_difference(a, b) < 1e-5 * STRIP_LENGTH); /* accepted at 1e-6, times how slowly the search converges */
    sw_state_destroy(a);
    sw_state_destroy(b);
  }
  sw_model_destroy(single);
  sw_model_destroy(exact);
}

static void a_nonlinear_shell_is_saved_restored_and_cloned(void) {
  SwModel *model = sagging_model();
  SwState *state = new_state(model, SW_METHOD_SHELL_IMPLICIT, 0), *clone = NULL;
  set_gravity(state, 0, 0, -1);
  step(state, 5, 1.0 / 30);
  uint64_t size = 0;
  OK(sw_state_save(state, NULL, 0, &size));
  CHECK(size > sizeof(double) * 6 * STRIP_VERTICES); /* positions and velocities of every vertex */
  unsigned char *saved = malloc(size);
  OK(sw_state_save(state, saved, size, &size));
  OK(sw_state_clone(state, &clone));
  step(state, 5, 1.0 / 30);
  step(clone, 5, 1.0 / 30);
  CHECK(largest_difference(state, clone) == 0);
  OK(sw_state_load(clone, saved, size));
  step(clone, 5, 1.0 / 30);
  CHECK(largest_difference(state, clone) == 0);
  free(saved);
  sw_state_destroy(state);
  sw_state_destroy(clone);
  sw_model_destroy(model);
}

/* ----------------------------------------------------------------------------------------------------- mesh and log */

typedef struct {
  const char *name;
  uint32_t kind, severity;
  double x[7][3];
  uint32_t n_vertices;
  uint32_t t[4][3];
  uint32_t n_triangles;
} BrokenMesh;

static const BrokenMesh broken_meshes[] = {
    {"index",
     SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     3,
     {{0, 1, 3}},
     1},
    {"repeated",
     SW_DIAGNOSTIC_REPEATED_VERTEX,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     3,
     {{0, 1, 1}},
     1},
    {"infinite",
     SW_DIAGNOSTIC_NON_FINITE_COORDINATE,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, HUGE_VAL, 0}},
     3,
     {{0, 1, 2}},
     1},
    {"flat", SW_DIAGNOSTIC_ZERO_AREA, SW_SEVERITY_ERROR, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 3, {{0, 1, 2}}, 1},
    {"duplicate",
     SW_DIAGNOSTIC_DUPLICATE_TRIANGLE,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     3,
     {{0, 1, 2}, {1, 2, 0}},
     2},
    {"three on an edge",
     SW_DIAGNOSTIC_NON_MANIFOLD_EDGE,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}},
     5,
     {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}},
     3},
    {"two fans",
     SW_DIAGNOSTIC_NON_MANIFOLD_VERTEX,
     SW_SEVERITY_ERROR,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}},
     5,
     {{0, 1, 2}, {0, 3, 4}},
     2},
    {"turned",
     SW_DIAGNOSTIC_INCONSISTENT_ORIENTATION,
     SW_SEVERITY_WARNING,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0, 0}, {2, 1, 0}},
     6,
     {{0, 1, 2}, {1, 3, 2}, {1, 3, 4}},
     3},
    {"lone vertex",
     SW_DIAGNOSTIC_UNREFERENCED_VERTEX,
     SW_SEVERITY_WARNING,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}},
     4,
     {{0, 1, 2}},
     1},
    {"seam",
     SW_DIAGNOSTIC_COINCIDENT_VERTICES,
     SW_SEVERITY_WARNING,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
     6,
     {{0, 1, 2}, {3, 4, 5}},
     2},
    {"sliver", SW_DIAGNOSTIC_SLIVER, SW_SEVERITY_WARNING, {{0, 0, 0}, {1, 0, 0}, {0.5, 1e-3, 0}}, 3, {{0, 1, 2}}, 1},
};

static SwMeshDesc broken_mesh(const BrokenMesh *broken) {
  SwMeshDesc mesh;
  sw_mesh_desc_init(&mesh);
  mesh.positions = broken->x;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = broken->t[0];
  mesh.n_vertices = broken->n_vertices;
  mesh.n_triangles = broken->n_triangles;
  return mesh;
}

static void check_broken_mesh(const BrokenMesh *broken) {
  const SwMeshDesc mesh = broken_mesh(broken);
  SwDiagnostic found[8];
  SwModel *model = NULL;
  uint32_t count = 0, hits = 0;
  OK(sw_mesh_check(&mesh, found, sizeof(SwDiagnostic), 8, &count));
  CHECK(count >= 1 && count <= 8);
  for (uint32_t k = 0; k < count; ++k) {
    if (found[k].kind != broken->kind) continue;
    ++hits;
    CHECK(found[k].severity == broken->severity);
    CHECK(memchr(found[k].message, '\0', sizeof found[k].message) != NULL && found[k].message[0] != '\0');
  }
  if (hits == 0) printf("not found: %s\n", broken->name);
  CHECK(hits > 0);
  if (broken->severity == SW_SEVERITY_ERROR)
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_MESH, found[0].message);
  else
    OK(sw_model_create(&mesh, NULL, NULL, &model));
  sw_model_destroy(model);
}

static void every_fault_of_a_mesh_is_found_and_named(void) {
  for (size_t k = 0; k < sizeof broken_meshes / sizeof broken_meshes[0]; ++k) check_broken_mesh(&broken_meshes[k]);
}

static void a_moebius_strip_is_not_orientable(void) {
  enum { N = 12 };
  double x[2 * N][3];
  uint32_t t[2 * N][3], count = 0;
  SwMeshDesc mesh;
  SwDiagnostic found[4];
  for (int i = 0; i < N; ++i)
    for (int side = 0; side < 2; ++side) {
      const double turn = 2 * kPi * i / N, across = (side ? 0.3 : -0.3);
      x[2 * i + side][0] = (1 + across * cos(turn / 2)) * cos(turn);
      x[2 * i + side][1] = (1 + across * cos(turn / 2)) * sin(turn);
      x[2 * i + side][2] = across * sin(turn / 2);
    }
  for (uint32_t i = 0; i < N; ++i) {
    const uint32_t a = 2 * i, flip = i + 1 == N, c = flip ? 1 : a + 2, d = flip ? 0 : a + 3;
    const uint32_t pair[2][3] = {{a, a + 1, c}, {a + 1, d, c}};
    memcpy(t[2 * i], pair, sizeof pair);
  }
  sw_mesh_desc_init(&mesh);
  mesh.positions = x;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = t[0];
  mesh.n_vertices = mesh.n_triangles = 2 * N;
  OK(sw_mesh_check(&mesh, found, sizeof(SwDiagnostic), 4, &count));
  CHECK(count == 1 && found[0].kind == SW_DIAGNOSTIC_NOT_ORIENTABLE && found[0].severity == SW_SEVERITY_ERROR);
}

static void mesh_check_writes_no_more_than_the_capacity(void) {
  /* Two faults: a lone vertex, and a repeated one. */
  const BrokenMesh broken = {"two", 0, 0, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}}, 4, {{0, 1, 1}}, 1};
  const SwMeshDesc mesh = broken_mesh(&broken);
  SwDiagnostic found[2], untouched;
  uint32_t count = 0;
  OK(sw_mesh_check(&mesh, NULL, sizeof(SwDiagnostic), 0, &count));
  CHECK(count >= 2);
  memset(found, 0xAB, sizeof found);
  memset(&untouched, 0xAB, sizeof untouched);
  OK(sw_mesh_check(&mesh, found, sizeof(SwDiagnostic), 1, &count));
  CHECK(count >= 2);
  CHECK(found[0].severity == SW_SEVERITY_ERROR); /* errors first */
  CHECK(memcmp(&found[1], &untouched, sizeof untouched) == 0);
}

static int log_lines = 0;
static uint32_t log_level = 0;

static void on_log(void *user, uint32_t level, const char *message) {
  *(int *)user += 1;
  log_level = level;
  CHECK(strlen(message) > 0);
}

static void repairs_of_a_mesh_are_logged_while_a_callback_is_set(void) {
  const BrokenMesh lone = {"lone", 0, 0, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}}, 4, {{0, 1, 2}}, 1};
  const SwMeshDesc mesh = broken_mesh(&lone);
  SwModel *model = NULL;
  OK(sw_set_log_callback(on_log, &log_lines));
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  sw_model_destroy(model);
  CHECK(log_lines == 1 && log_level == SW_LOG_WARNING);
  OK(sw_set_log_callback(NULL, NULL));
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  sw_model_destroy(model);
  CHECK(log_lines == 1);
}

static void constants_and_strings_are_there(void) {
  CHECK(sw_abi_version() == SW_ABI_VERSION);
  CHECK(strchr(sw_version_string(), '.') != NULL);
  for (SwStatus status = SW_OK; status <= SW_ERROR_INTERNAL; ++status) {
    CHECK(strlen(sw_status_string(status)) > 0);
    CHECK(strcmp(sw_status_string(status), sw_status_string(12345)) != 0);
  }
}

int main(void) {
  RUN(constants_and_strings_are_there);
  RUN(counts_are_those_of_the_strip);
  RUN(a_free_strip_has_six_zero_modes);
  RUN(mode_shapes_are_orthonormal_in_the_mass);
  RUN(rotation_shapes_are_the_slopes_of_displacement_shapes);
  RUN(more_modes_than_unknowns_are_clamped);
  RUN(a_new_state_is_the_rest_shape);
  RUN(held_vertices_stay_and_the_free_end_sinks);
  RUN(warping_keeps_the_length_that_linear_modes_lose);
  RUN(free_vibration_returns_after_one_period);
  RUN(energy_is_kept_by_the_exact_propagator_and_lost_by_implicit_euler);
  RUN(time_is_the_sum_of_the_steps);
  RUN(reset_returns_to_rest_and_keeps_loads_and_damping);
  RUN(a_run_goes_on_with_the_same_bytes_after_load_and_in_a_clone);
  RUN(a_clone_is_independent);
  RUN(a_state_outlives_its_model);
  RUN(a_second_precompute_leaves_existing_states_alone);
  RUN(a_teleported_shell_at_rest_moves_rigidly);
  RUN(a_frame_that_moves_without_teleport_stirs_the_shell);
  RUN(reset_leaves_the_frame_where_it_is_and_at_rest);
  RUN(given_acceleration_of_the_frame_adds_to_gravity);
  RUN(gravity_is_given_in_world_axes);
  RUN(single_precision_output_is_double_output_to_four_units_in_the_last_place);
  RUN(strided_floats_are_the_packed_ones);
  RUN(strided_unaligned_buffers_are_filled_without_touching_the_gaps);
  RUN(mesh_buffers_may_be_strided_and_single);
  RUN(normals_are_unit_and_turn_with_the_strip);
  RUN(rotations_are_unit_quaternions_that_turn_the_end_downwards);
  RUN(world_output_is_frame_output_carried_by_the_frame);
  RUN(the_report_measures_what_positions_show);
  RUN(leaving_the_range_is_reported);
  RUN(a_position_is_met_from_the_next_step_on_and_reported);
  RUN(an_orientation_is_met_and_reported);
  RUN(a_zero_rotation_matrix_means_the_identity);
  RUN(constraints_are_reported_by_ascending_id);
  RUN(a_cleared_constraint_lets_go);
  RUN(a_constraint_with_a_known_id_replaces_the_old_one);
  RUN(a_free_strip_is_turned_through_several_revolutions);
  RUN(a_led_run_goes_on_with_the_same_bytes_once_its_constraints_are_set_again);
  RUN(reset_keeps_constraints_and_repeats_the_run);
  RUN(compliance_gives_way_in_proportion_to_the_force);
  RUN(what_is_out_of_reach_is_reported_as_missing);
  RUN(a_small_load_bends_every_method_alike);
  RUN(a_large_load_parts_the_methods);
  RUN(a_step_of_the_explicit_shell_is_close_to_one_of_the_implicit);
  RUN(forces_of_the_weight_do_what_gravity_does);
  RUN(sparse_repeated_strided_and_single_forces_are_the_dense_ones);
  RUN(forces_for_one_step_act_once_and_replaced_ones_no_more);
  RUN(forces_and_local_wind_are_copied);
  RUN(equilibrium_is_where_damped_motion_ends);
  RUN(wind_presses_like_a_weight_of_half_rho_c_v_squared);
  RUN(still_air_takes_energy_and_no_wind_takes_none);
  RUN(the_search_starts_from_the_present_shape);
  RUN(equilibria_are_found_with_a_basis_of_32_bits);
  RUN(a_nonlinear_shell_is_saved_restored_and_cloned);
  RUN(every_fault_of_a_mesh_is_found_and_named);
  RUN(a_moebius_strip_is_not_orientable);
  RUN(mesh_check_writes_no_more_than_the_capacity);
  RUN(repairs_of_a_mesh_are_logged_while_a_callback_is_set);
  return report_failures();
}

/* What a careless host does with forces, wind and equilibria, and with buffers that overlap. As in misuse_test.c every failed
   call must name the item, and leave its outputs and the state alone. */
#include "test_support.h"

static const double bad_numbers[] = {NAN, HUGE_VAL, -HUGE_VAL};
enum { N_BAD = 3 };

static SwModel *ready_model(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 4, 0);
  return model;
}

static const double three[9] = {0, 0, 1, 0, 0.5, 0, 0, 0, -1};
static const uint32_t at[3] = {60, 70, 122};

static SwForceDesc forces(void) {
  SwForceDesc desc;
  sw_force_desc_init(&desc);
  desc.format = SW_FORMAT_F64;
  desc.count = 3;
  desc.forces = three;
  desc.vertices = at;
  return desc;
}

static SwWindDesc wind(void) {
  SwWindDesc desc;
  sw_wind_desc_init(&desc);
  desc.velocity[2] = 1;
  desc.density = 1.2;
  desc.normal_drag = 1.5;
  desc.tangential_drag = 0.05;
  return desc;
}

/* A state under forces and wind that has moved. */
static SwState *loaded_state(const SwModel *model) {
  SwState *state = new_state(model, 0, 0);
  const SwForceDesc force = forces();
  const SwWindDesc air = wind();
  OK(sw_state_set_forces(state, &force));
  OK(sw_state_set_wind(state, &air));
  OK(sw_state_step(state, 0.01));
  return state;
}

/* The next steps, and so the loads, are those of a twin that nobody misused. */
static void check_same_as_untouched(const SwModel *model, SwState *state) {
  SwState *twin = loaded_state(model);
  double x[3 * STRIP_VERTICES], y[3 * STRIP_VERTICES];
  for (int k = 0; k < 2; ++k) {
    OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
    OK(sw_state_positions(twin, SW_SPACE_WORLD, SW_FORMAT_F64, y, 0, STRIP_VERTICES));
    CHECK(memcmp(x, y, sizeof x) == 0);
    OK(sw_state_step(state, 0.05));
    OK(sw_state_step(twin, 0.05));
  }
  sw_state_destroy(twin);
}

static void null_and_uninitialised_descriptors_are_named(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  const uint32_t sizes[2] = {0, 12345};
  SwForceDesc force = forces();
  SwWindDesc air = wind();
  sw_force_desc_init(NULL);
  sw_wind_desc_init(NULL);
  sw_equilibrium_report_init(NULL);
  FAILS(sw_state_set_forces(NULL, &force), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_forces(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_state_set_wind(NULL, &air), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_wind(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_state_equilibrium(NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "state");
  for (int k = 0; k < 2; ++k) {
    SwEquilibriumReport report = {0};
    force.struct_size = air.struct_size = report.struct_size = sizes[k];
    FAILS(sw_state_set_forces(state, &force), SW_ERROR_INVALID_DESC, "SwForceDesc");
    FAILS(sw_state_set_wind(state, &air), SW_ERROR_INVALID_DESC, "SwWindDesc");
    FAILS(sw_state_equilibrium(state, &report), SW_ERROR_INVALID_DESC, "SwEquilibriumReport");
    CHECK(report.iterations == 0);
  }
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void wrong_forces_are_refused(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  const uint32_t outside[2] = {STRIP_VERTICES, UINT32_MAX}, formats[3] = {0, 3, UINT32_MAX};
  SwForceDesc desc = forces();
  desc.flags = 2;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "flags");
  for (int k = 0; k < 3; ++k) {
    desc = forces();
    desc.format = formats[k];
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "format");
  }
  desc = forces();
  desc.forces = NULL;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "forces");
  desc = forces();
  desc.vertices = NULL; /* then there must be one for every vertex */
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "count");
  desc.count = UINT32_MAX;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "count");
  const uint64_t strides[3] = {1, 23, UINT64_MAX};
  for (int k = 0; k < 3; ++k) {
    desc = forces();
    desc.stride = strides[k];
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "forces");
  }
  for (int k = 0; k < 2; ++k) {
    const uint32_t vertices[3] = {1, 2, outside[k]};
    desc = forces();
    desc.vertices = vertices;
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "force 2");
  }
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < N_BAD; ++k) {
      double bad[9];
      memcpy(bad, three, sizeof bad);
      bad[i] = bad_numbers[k];
      desc = forces();
      desc.forces = bad;
      FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "force");
    }
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void wrong_wind_is_refused(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  static double local[3 * STRIP_VERTICES];
  const char *names[6] = {"velocity", "velocity", "velocity", "density", "normal_drag", "tangential_drag"};
  for (int field = 0; field < 6; ++field)
    for (int k = 0; k < N_BAD + 1; ++k) {
      SwWindDesc desc = wind();
      double *fields[6] = {&desc.velocity[0], &desc.velocity[1],  &desc.velocity[2],
                           &desc.density,     &desc.normal_drag, &desc.tangential_drag};
      if (k == N_BAD && field < 3) continue; /* a velocity may be negative */
      *fields[field] = k < N_BAD ? bad_numbers[k] : -1;
      FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, names[field]);
    }
  SwWindDesc desc = wind();
  desc.local_velocities = local;
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "format");
  desc.local_format = SW_FORMAT_F64;
  desc.local_stride = 23;
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "stride");
  desc.local_stride = UINT64_MAX / 2;
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "local_velocities");
  desc.local_stride = 0;
  for (int k = 0; k < N_BAD; ++k) {
    local[3 * STRIP_VERTICES - 1] = bad_numbers[k];
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "wind velocity");
  }
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void an_equilibrium_that_does_not_exist_moves_nothing(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  const double gravity[3] = {0, 0, 1e300}, none[3] = {0, 0, 0};
  SwEquilibriumReport report;
  sw_equilibrium_report_init(&report);
  OK(sw_state_set_gravity(state, gravity));
  FAILS(sw_state_equilibrium(state, &report), SW_ERROR_NUMERICAL, "without bound");
  CHECK(report.iterations == 0 && report.residual == 0);
  OK(sw_state_set_gravity(state, none));
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* Nothing is read after it was written, so one buffer may serve twice: the last rows written stand. */
static void buffers_may_overlap(void) {
  Strip strip = make_strip();
  const Strip rest = strip;
  SwModel *model = strip_model(&strip);
  precompute(model, 4, 0);
  SwState *state = loaded_state(model);
  /* Positions into the buffer that the mesh was read from. */
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, strip.positions, 0, STRIP_VERTICES));
  CHECK(memcmp(strip.positions, rest.positions, sizeof rest.positions) != 0);
  /* Positions and normals interleaved in one buffer, as Maya and Houdini may hold them. */
  static double both[6 * STRIP_VERTICES], normals[3 * STRIP_VERTICES];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, both, 48, STRIP_VERTICES));
  OK(sw_state_normals(state, SW_SPACE_WORLD, SW_FORMAT_F64, both + 3, 48, STRIP_VERTICES));
  OK(sw_state_normals(state, SW_SPACE_WORLD, SW_FORMAT_F64, normals, 0, STRIP_VERTICES));
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    CHECK(memcmp(&both[6 * v], &strip.positions[3 * v], 24) == 0);
    CHECK(memcmp(&both[6 * v + 3], &normals[3 * v], 24) == 0);
  }
  /* One array as amplitudes and as velocities, in and out. */
  double q[4] = {0.1, 0.2, -0.1, 0.05}, apart[4], rates[4];
  uint32_t count;
  OK(sw_state_set_amplitudes(state, q, q, 4));
  OK(sw_state_amplitudes(state, apart, rates, 4, &count));
  CHECK(memcmp(apart, q, sizeof q) == 0 && memcmp(rates, q, sizeof q) == 0);
  OK(sw_state_amplitudes(state, apart, apart, 4, &count));
  CHECK(memcmp(apart, rates, sizeof rates) == 0);
  /* A state loaded from the buffer that it is saved to. */
  unsigned char bytes[512];
  uint64_t size;
  OK(sw_state_save(state, bytes, sizeof bytes, &size));
  OK(sw_state_load(state, bytes, size));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void states_of_every_method_outlive_their_model(void) {
  for (uint32_t method = SW_METHOD_WARP; method <= SW_METHOD_WARP_VIRTUAL_WORK; ++method) {
    SwModel *model = ready_model();
    SwState *state = new_state(model, method, 0), *clone = NULL;
    const SwForceDesc force = forces();
    const SwWindDesc air = wind();
    OK(sw_state_set_forces(state, &force));
    OK(sw_state_set_wind(state, &air));
    sw_model_destroy(model);
    OK(sw_state_step(state, 1e-4));
    OK(sw_state_clone(state, &clone));
    sw_state_destroy(state);
    OK(sw_state_step(clone, 1e-4));
    CHECK(isfinite(report_of(clone).max_displacement));
    sw_state_destroy(clone);
  }
}

int main(void) {
  RUN(null_and_uninitialised_descriptors_are_named);
  RUN(wrong_forces_are_refused);
  RUN(wrong_wind_is_refused);
  RUN(an_equilibrium_that_does_not_exist_moves_nothing);
  RUN(buffers_may_overlap);
  RUN(states_of_every_method_outlive_their_model);
  return report_failures();
}

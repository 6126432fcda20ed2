/* Points that follow a shell, through the C interface: a fine grid of points on the coarse strip, with normals and velocities. */
#include "test_support.h"

enum { ALONG = 81, ACROSS = 5, POINTS = 2 * ALONG * ACROSS };

typedef struct {
  double x[3];
  float uv[2]; /* what a host may have between */
} Row;

/* Two sheets of points, 0.01 above and below the strip. */
static void make_points(Row *points, double (*normals)[3]) {
  for (int i = 0; i < POINTS; ++i) {
    const int column = i / 2 % ALONG, row = i / 2 / ALONG, above = i % 2;
    points[i].x[0] = STRIP_LENGTH * column / (ALONG - 1);
    points[i].x[1] = STRIP_WIDTH * row / (ACROSS - 1) - STRIP_WIDTH / 2;
    points[i].x[2] = above ? 0.01 : -0.01;
    normals[i][0] = normals[i][1] = 0;
    normals[i][2] = above ? 2 : -2; /* of any length */
  }
}

static SwBindingDesc desc_of(const Row *points, double (*normals)[3]) {
  SwBindingDesc desc;
  sw_binding_desc_init(&desc);
  desc.format = SW_FORMAT_F64;
  desc.n_points = POINTS;
  desc.points = points;
  desc.point_stride = sizeof(Row);
  desc.normals = normals;
  return desc;
}

static Row points[POINTS];
static double normals[POINTS][3];

static SwState *bent_strip(SwModel **model) {
  const Strip strip = make_strip();
  const double gravity[3] = {0, 0, -9.8};
  *model = strip_model(&strip);
  precompute(*model, 8, SW_PRECISION_F64);
  SwState *state = new_state(*model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  OK(sw_state_set_gravity(state, gravity));
  for (int i = 0; i < 40; ++i) OK(sw_state_step(state, 1.0 / 60));
  return state;
}

static SwBoundPointsDesc reading(double (*x)[3]) {
  SwBoundPointsDesc read;
  sw_bound_points_desc_init(&read);
  read.format = SW_FORMAT_F64;
  read.positions = x;
  return read;
}

static double distance(const double *a, const double *b) {
  return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void points_follow_with_normals_and_velocities(void) {
  static double x[POINTS][3], n[POINTS][3], v[POINTS][3], later[POINTS][3];
  SwModel *model;
  SwState *state = bent_strip(&model);
  SwBinding *binding = NULL;
  make_points(points, normals);
  const SwBindingDesc desc = desc_of(points, normals);
  OK(sw_binding_create(model, &desc, &binding));
  SwBindingInfo info;
  sw_binding_info_init(&info);
  OK(sw_binding_info(binding, &info));
  CHECK(info.n_points == POINTS && info.has_normals == 1 && info.has_tangents == 0 && info.bytes > POINTS * 60);
  CHECK_NEAR(info.furthest_distance, 0.01, 1e-12); /* all stand straight above or below */
  SwBoundPointsDesc read = reading(x);
  read.normals = n;
  read.velocities = v;
  OK(sw_state_bound_points(state, binding, &read));
  double lowest = 0, thickness = 0, slant = 0, fastest = 0;
  for (int i = 0; i < POINTS; i += 2) {
    const double apart = distance(x[i], x[i + 1]);
    lowest = fmin(lowest, x[i][2]);
    thickness = fmax(thickness, fabs(apart / 0.02 - 1));
    for (int k = 0; k < 3; ++k) slant = fmax(slant, fabs((x[i + 1][k] - x[i][k]) / apart - n[i + 1][k]));
    fastest = fmax(fastest, sqrt(v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]));
  }
  CHECK(lowest < -0.3); /* the strip hangs */
  CHECK(thickness < 1e-2); /* normals turn by up to 0.2 in a triangle: 1 - cos(0.1) */
  CHECK(slant < 2e-2); /* the points below stand where those above do; their normals are of another sheet */
  OK(sw_state_step(state, 1e-4));
  read = reading(later);
  OK(sw_state_bound_points(state, binding, &read));
  double off = 0;
  for (int i = 0; i < POINTS; ++i)
    for (int k = 0; k < 3; ++k) off = fmax(off, fabs((later[i][k] - x[i][k]) / 1e-4 - v[i][k]));
  CHECK(fastest > 0.5 && off < 0.02 * fastest); /* accelerations of 10 over 1e-4 s, and 32 bits over it */
  sw_binding_destroy(binding);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void ranges_formats_strides_and_saved_bindings_agree(void) {
  static double x[POINTS][3], part[100][3], again[POINTS][3];
  static float single[POINTS][4];
  SwModel *model;
  SwState *state = bent_strip(&model);
  SwBinding *binding = NULL, *loaded = NULL;
  make_points(points, normals);
  const SwBindingDesc desc = desc_of(points, NULL);
  OK(sw_binding_create(model, &desc, &binding));
  SwBoundPointsDesc read = reading(x);
  OK(sw_state_bound_points(state, binding, &read));
  read = reading(part);
  read.first = 33;
  read.count = 100;
  OK(sw_state_bound_points(state, binding, &read));
  CHECK(memcmp(part, x + 33, sizeof part) == 0);
  read = reading(NULL);
  read.format = SW_FORMAT_F32;
  read.positions = single;
  read.position_stride = sizeof single[0];
  OK(sw_state_bound_points(state, binding, &read));
  for (int i = 0; i < POINTS; ++i)
    for (int k = 0; k < 3; ++k) CHECK(single[i][k] == (float)x[i][k]);
  uint64_t size = 0;
  OK(sw_binding_save(binding, NULL, 0, &size));
  unsigned char *bytes = malloc(size);
  OK(sw_binding_save(binding, bytes, size, &size));
  FAILS(sw_binding_save(binding, bytes, size - 1, &size), SW_ERROR_BUFFER_SIZE, "needed");
  OK(sw_binding_load(model, bytes, size, &loaded));
  sw_binding_destroy(binding);
  read = reading(again);
  OK(sw_state_bound_points(state, loaded, &read));
  CHECK(memcmp(again, x, sizeof x) == 0);
  bytes[size / 2] ^= 1;
  FAILS(sw_binding_load(model, bytes, size, &binding), SW_ERROR_INVALID_DATA, "checksum");
  free(bytes);
  sw_binding_destroy(loaded);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void what_is_wrong_is_named(void) {
  static double x[POINTS][3];
  SwModel *model, *other;
  SwState *state = bent_strip(&model);
  SwBinding *binding = NULL;
  make_points(points, normals);
  SwBindingDesc desc = desc_of(points, NULL);
  FAILS(sw_binding_create(NULL, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_binding_create(model, NULL, &binding), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_binding_create(model, &desc, NULL), SW_ERROR_INVALID_ARGUMENT, "binding");
  desc.n_points = 0;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "0 points");
  desc = desc_of(NULL, NULL);
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "desc->points");
  desc = desc_of(points, NULL);
  desc.format = 9;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "format");
  desc = desc_of(points, NULL);
  desc.point_stride = 8;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "stride");
  desc = desc_of(points, NULL);
  desc.flags = 4;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "flags");
  desc = desc_of(points, NULL);
  desc.max_distance = 1e-3;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "points[0]");
  desc.max_distance = NAN;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "max_distance");
  points[11].x[1] = NAN;
  desc.max_distance = 0;
  FAILS(sw_binding_create(model, &desc, &binding), SW_ERROR_INVALID_ARGUMENT, "points[11]");
  CHECK(binding == NULL);
  make_points(points, normals);
  OK(sw_binding_create(model, &desc, &binding));
  SwBoundPointsDesc read = reading(x);
  read.normals = x;
  FAILS(sw_state_bound_points(state, binding, &read), SW_ERROR_UNSUPPORTED, "normals");
  read = reading(x);
  read.first = POINTS;
  FAILS(sw_state_bound_points(state, binding, &read), SW_ERROR_INVALID_ARGUMENT, "points from point");
  read.first = 1;
  read.count = POINTS;
  FAILS(sw_state_bound_points(state, binding, &read), SW_ERROR_INVALID_ARGUMENT, "points from point");
  read = reading(x);
  read.space = 7;
  FAILS(sw_state_bound_points(state, binding, &read), SW_ERROR_INVALID_ARGUMENT, "space");
  FAILS(sw_state_bound_points(state, NULL, &read), SW_ERROR_INVALID_ARGUMENT, "binding");
  FAILS(sw_state_bound_points(NULL, binding, &read), SW_ERROR_INVALID_ARGUMENT, "state");
  /* Another mesh of as many vertices. */
  Strip strip = make_strip();
  strip.positions[3 * STRIP_VERTICES - 1] = 0.01;
  other = strip_model(&strip);
  precompute(other, 4, SW_PRECISION_F32);
  SwState *stranger = new_state(other, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  read = reading(x);
  FAILS(sw_state_bound_points(stranger, binding, &read), SW_ERROR_INVALID_ARGUMENT, "another mesh");
  sw_binding_destroy(binding);
  sw_binding_destroy(NULL);
  sw_state_destroy(stranger);
  sw_model_destroy(other);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

int main(void) {
  RUN(points_follow_with_normals_and_velocities);
  RUN(ranges_formats_strides_and_saved_bindings_agree);
  RUN(what_is_wrong_is_named);
  return report_failures();
}

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

/* A ball below the strip, whose few modes cannot bend about it. */
static double depth_in(const double *x, const double *center, double radius) { return radius - distance(x, center); }

static void bound_points_are_pushed_out_and_corrected_as_the_shell_is(void) {
  static double plain[POINTS][3], out[POINTS][3], n[POINTS][3], v[POINTS][3], surface[STRIP_VERTICES][3];
  static double moved[POINTS][3];
  SwModel *model;
  SwState *state = bent_strip(&model);
  SwBinding *binding = NULL;
  SwCollider *ball = NULL;
  SwColliderDesc collider;
  SwColliderPoseDesc pose;
  double deepest = -1, left = -1, before = 0, after = 0, furthest = 0;
  const double radius = 0.2;
  make_points(points, normals);
  const SwBindingDesc desc = desc_of(points, normals);
  OK(sw_binding_create(model, &desc, &binding));
  SwBoundPointsDesc read = reading(plain);
  OK(sw_state_bound_points(state, binding, &read));
  /* Its middle is just below a point in the middle of the strip: the sheets above and below are both inside. */
  const int middle = 2 * (2 * ALONG + ALONG / 2);
  sw_collider_desc_init(&collider);
  collider.kind = SW_COLLIDER_SPHERE;
  collider.radius = radius;
  OK(sw_collider_create(&collider, &ball));
  const SwCollider *const only = ball;
  OK(sw_state_set_colliders(state, &only, 1));
  sw_collider_pose_desc_init(&pose);
  for (int k = 0; k < 3; ++k) pose.origin[k] = plain[middle][k] - (k == 2 ? radius - 0.05 : 0);
  OK(sw_state_move_collider(state, 0, &pose));
  read = reading(out);
  read.flags = SW_BOUND_OUTSIDE;
  read.deepest = &deepest;
  read.normals = n;
  read.velocities = v;
  OK(sw_state_bound_points(state, binding, &read));
  for (int i = 0; i < POINTS; ++i) {
    before = fmax(before, depth_in(plain[i], pose.origin, radius));
    after = fmax(after, depth_in(out[i], pose.origin, radius));
  }
  CHECK(before > 0.04);                 /* without it they are inside */
  CHECK(after <= 1e-6 * STRIP_LENGTH);  /* with it none is, off the surface neither */
  CHECK(deepest >= 0 && deepest <= 1e-6 * STRIP_LENGTH);
  /* The push fades along the sheet: near the held end, 1.5 away, nothing moves. */
  OK(sw_state_positions_outside(state, SW_SPACE_WORLD, SW_FORMAT_F64, surface, 0, STRIP_VERTICES, &left));
  for (int i = 0; i < POINTS; ++i) {
    furthest = fmax(furthest, distance(out[i], plain[i]));
    if (points[i].x[0] < 0.5) CHECK(distance(out[i], plain[i]) < 1e-9);
    CHECK(fabs(distance(n[i], (double[3]){0, 0, 0}) - 1) < 1e-6);
  }
  CHECK(furthest > 0.04 && left <= 1e-9);
  /* Ranges and threads give the same. */
  read = reading(moved);
  read.flags = SW_BOUND_OUTSIDE;
  read.first = 100;
  read.count = 200;
  OK(sw_state_bound_points(state, binding, &read));
  CHECK(memcmp(moved, out + 100, 200 * sizeof moved[0]) == 0);
  OK(sw_state_set_colliders(state, NULL, 0));
  /* Without colliders nothing is pushed. */
  read = reading(moved);
  read.flags = SW_BOUND_OUTSIDE;
  OK(sw_state_bound_points(state, binding, &read));
  CHECK(memcmp(moved, plain, sizeof plain) == 0);
  /* Corrected points follow the corrected shell: those on its vertices are at them. */
  static double corrected[STRIP_VERTICES][3], on_vertices[STRIP_VERTICES][3], on_plain[STRIP_VERTICES][3];
  const Strip strip = make_strip();
  SwBinding *at_vertices = NULL;
  SwBindingDesc on;
  sw_binding_desc_init(&on);
  on.format = SW_FORMAT_F64;
  on.n_points = STRIP_VERTICES;
  on.points = strip.positions;
  OK(sw_binding_create(model, &on, &at_vertices));
  OK(sw_state_positions_corrected(state, 2, SW_SPACE_WORLD, SW_FORMAT_F64, corrected, 0, STRIP_VERTICES));
  read = reading(on_plain);
  OK(sw_state_bound_points(state, at_vertices, &read));
  read = reading(on_vertices);
  read.correction_steps = 2;
  OK(sw_state_bound_points(state, at_vertices, &read));
  double way = 0, off = 0;
  for (int j = 0; j < STRIP_VERTICES; ++j) {
    way = fmax(way, distance(corrected[j], on_plain[j]));
    off = fmax(off, distance(corrected[j], on_vertices[j]));
  }
  CHECK(way > 1e-3 && off < 1e-5); /* displacements of a few in 32 bits */
  /* What is kept is shown, whatever is asked for, until it is forgotten. */
  static double kept[STRIP_VERTICES][3];
  OK(sw_state_correct(state, 2));
  OK(sw_state_positions_corrected(state, 1, SW_SPACE_WORLD, SW_FORMAT_F64, kept, 0, STRIP_VERTICES));
  CHECK(memcmp(kept, corrected, sizeof kept) == 0);
  FAILS(sw_state_correct(state, 101), SW_ERROR_INVALID_ARGUMENT, "steps is 101");
  OK(sw_state_positions_corrected(state, 1, SW_SPACE_WORLD, SW_FORMAT_F64, kept, 0, STRIP_VERTICES));
  CHECK(memcmp(kept, corrected, sizeof kept) == 0);
  OK(sw_state_correct(state, 0));
  OK(sw_state_positions_corrected(state, 1, SW_SPACE_WORLD, SW_FORMAT_F64, kept, 0, STRIP_VERTICES));
  CHECK(memcmp(kept, corrected, sizeof kept) != 0);
  read.flags = SW_BOUND_OUTSIDE;
  FAILS(sw_state_bound_points(state, at_vertices, &read), SW_ERROR_INVALID_ARGUMENT, "not both");
  read.flags = 0;
  read.correction_steps = 101;
  FAILS(sw_state_bound_points(state, at_vertices, &read), SW_ERROR_INVALID_ARGUMENT, "correction_steps is 101");
  read.correction_steps = 0;
  read.reserved = 1;
  FAILS(sw_state_bound_points(state, at_vertices, &read), SW_ERROR_INVALID_ARGUMENT, "reserved");
  sw_collider_destroy(ball);
  sw_binding_destroy(at_vertices);
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
  RUN(bound_points_are_pushed_out_and_corrected_as_the_shell_is);
  RUN(ranges_formats_strides_and_saved_bindings_agree);
  RUN(what_is_wrong_is_named);
  return report_failures();
}

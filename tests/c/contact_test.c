/* Colliders through the C interface: a strip that nothing holds lies on a plane and a hull, what moves, what is saved, what is refused. */
#include "test_support.h"

static const double GRAVITY[3] = {0, 0, -9.81};

static SwModel *free_strip(void) {
  Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = NULL;
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  precompute(model, 12, SW_PRECISION_F64);
  return model;
}

static SwCollider *collider_of(uint32_t kind, double friction) {
  SwColliderDesc desc;
  SwCollider *collider = NULL;
  sw_collider_desc_init(&desc);
  desc.kind = kind;
  desc.radius = 0.5;
  desc.half_length = 1;
  desc.friction = friction;
  for (int c = 0; c < 3; ++c) desc.half_extents[c] = 6;
  OK(sw_collider_create(&desc, &collider));
  return collider;
}

static void set_colliders(SwState *state, SwCollider *const *colliders, uint32_t count) {
  const SwCollider *list[4];
  for (uint32_t i = 0; i < count; ++i) list[i] = colliders[i];
  OK(sw_state_set_colliders(state, list, count));
}

static void place(SwState *state, uint32_t collider, double z) {
  SwColliderPoseDesc pose;
  sw_collider_pose_desc_init(&pose);
  pose.origin[2] = z;
  OK(sw_state_move_collider(state, collider, &pose));
}

/* Under gravity, with so much damping that it lies still after a second. */
static SwState *falling(const SwModel *model) {
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_IMPLICIT_EULER);
  SwDampingDesc damping;
  const double ratio = 0.5;
  sw_damping_desc_init(&damping);
  damping.ratios = &ratio;
  damping.n_ratios = 1;
  OK(sw_state_set_damping(state, &damping));
  OK(sw_state_set_gravity(state, GRAVITY));
  return state;
}

/* The sum of the contacts' forces along z. */
static double carried(const SwState *state) {
  uint32_t count = 0;
  SwContact contacts[512];
  double sum = 0;
  OK(sw_state_contacts(state, NULL, sizeof(SwContact), 0, &count));
  OK(sw_state_contacts(state, contacts, sizeof(SwContact), 512, &count));
  for (uint32_t i = 0; i < count; ++i) {
    sum += contacts[i].force[2];
    CHECK_NEAR(contacts[i].weights[0] + contacts[i].weights[1] + contacts[i].weights[2], 1, 1e-15);
    CHECK(contacts[i].vertices[0] < STRIP_VERTICES && contacts[i].collider == 0);
    CHECK_NEAR(contacts[i].normal[2], 1, 1e-3); /* of a grid's distances in 24 bits */
  }
  return sum;
}

static void a_strip_lies_with_its_weight_on_a_plane_and_on_a_box(void) {
  SwModel *model = free_strip();
  const uint32_t kinds[2] = {SW_COLLIDER_PLANE, SW_COLLIDER_BOX};
  for (int i = 0; i < 2; ++i) {
    SwState *state = falling(model);
    SwCollider *floor = collider_of(kinds[i], 0.5);
    set_colliders(state, &floor, 1);
    sw_collider_destroy(floor); /* the state goes on with it */
    place(state, 0, kinds[i] == SW_COLLIDER_BOX ? -6.01 : -0.01);
    for (int step = 0; step < 240; ++step) OK(sw_state_step(state, 1.0 / 60));
    const double weight = 9.81 * info_of(model).total_mass;
    CHECK_NEAR(carried(state), weight, 1e-2 * weight); /* what still swings */
    const SwStateReport report = report_of(state);
    CHECK(report.contact_count > 0);
    CHECK(report.deepest_penetration <= 1e-3 * STRIP_LENGTH);
    CHECK_NEAR(report.contact_impulse[2], carried(state) / 60, 1e-9 * weight);
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

static void a_closed_mesh_and_its_hull_carry_as_the_box_that_they_are(void) {
  const double points[24] = {-6, -6, -6, 6, -6, -6, 6, 6, -6, -6, 6, -6, -6, -6, 6, 6, -6, 6, 6, 6, 6, -6, 6, 6};
  const uint32_t corners[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
  SwMeshDesc mesh;
  SwModel *model = free_strip();
  sw_mesh_desc_init(&mesh);
  mesh.positions = points;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = corners;
  mesh.n_vertices = 8;
  mesh.n_triangles = 12;
  for (uint32_t kind = SW_COLLIDER_HULL; kind <= SW_COLLIDER_MESH; ++kind) {
    SwState *state = falling(model);
    SwColliderDesc desc;
    SwCollider *made = NULL, *box = NULL;
    uint64_t size = 0;
    sw_collider_desc_init(&desc);
    desc.kind = kind;
    desc.mesh = &mesh;
    OK(sw_collider_create(&desc, &made));
    OK(sw_collider_save(made, NULL, 0, &size));
    unsigned char *bytes = malloc(size);
    OK(sw_collider_save(made, bytes, size, &size));
    OK(sw_collider_load(bytes, size, &box));
    set_colliders(state, &box, 1);
    place(state, 0, -6.01);
    for (int step = 0; step < 240; ++step) OK(sw_state_step(state, 1.0 / 60));
    const double weight = 9.81 * info_of(model).total_mass;
    CHECK_NEAR(carried(state), weight, 1e-2 * weight);
    bytes[size / 2] ^= 1;
    SwCollider *none = NULL;
    FAILS(sw_collider_load(bytes, size, &none), SW_ERROR_INVALID_DATA, "damaged");
    FAILS(sw_collider_load(bytes, 5, &none), SW_ERROR_INVALID_DATA, "5 bytes");
    CHECK(!none);
    free(bytes);
    sw_collider_destroy(made);
    sw_collider_destroy(box);
    sw_state_destroy(state);
  }
  mesh.n_triangles = 11;
  SwColliderDesc desc;
  SwCollider *open = NULL;
  sw_collider_desc_init(&desc);
  desc.kind = SW_COLLIDER_MESH;
  desc.mesh = &mesh;
  CHECK(sw_collider_create(&desc, &open) != SW_OK && !open);
  sw_model_destroy(model);
}

/* A ground of two triangles that look up. */
static SwColliderDesc ground(SwMeshDesc *mesh, uint32_t kind) {
  static const double corners[12] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
  static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
  SwColliderDesc desc;
  sw_mesh_desc_init(mesh);
  mesh->positions = corners;
  mesh->position_format = SW_FORMAT_F64;
  mesh->triangles = triangles;
  mesh->n_vertices = 4;
  mesh->n_triangles = 2;
  sw_collider_desc_init(&desc);
  desc.kind = kind;
  desc.flags = SW_COLLIDER_ONE_SIDED;
  desc.mesh = mesh;
  return desc;
}

static void a_strip_lies_with_its_weight_on_a_ground_of_two_triangles_and_behind_it_stays_behind(void) {
  SwModel *model = free_strip();
  const double weight = 9.81 * info_of(model).total_mass;
  for (uint32_t kind = SW_COLLIDER_MESH; kind <= SW_COLLIDER_DEFORMING_MESH; ++kind) {
    SwState *state = falling(model);
    SwMeshDesc mesh;
    SwColliderDesc desc = ground(&mesh, kind);
    SwCollider *made = NULL, *loaded = NULL;
    uint64_t size = 0;
    desc.depth = 1.5;
    OK(sw_collider_create(&desc, &made));
    OK(sw_collider_save(made, NULL, 0, &size));
    unsigned char *bytes = malloc(size);
    OK(sw_collider_save(made, bytes, size, &size));
    OK(sw_collider_load(bytes, size, &loaded));
    set_colliders(state, &loaded, 1);
    place(state, 0, -0.01);
    for (int step = 0; step < 240; ++step) OK(sw_state_step(state, 1.0 / 60));
    CHECK_NEAR(carried(state), weight, 1e-2 * weight); /* what still swings */
    CHECK(report_of(state).deepest_penetration <= 1e-3 * STRIP_LENGTH);
    if (kind == SW_COLLIDER_DEFORMING_MESH) {
      double led[12], x[3 * STRIP_VERTICES], lowest = 1;
      for (int k = 0; k <= 60; ++k) {
        for (int i = 0; i < 12; ++i) led[i] = ((const double *)mesh.positions)[i] + (i % 3 == 2 ? 0.2 * k / 60 : 0);
        OK(sw_state_deform_collider(state, 0, 0, SW_FORMAT_F64, led, 0, 4));
        OK(sw_state_step(state, 1.0 / 60));
      }
      OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
      for (int v = 0; v < STRIP_VERTICES; ++v) lowest = fmin(lowest, x[3 * v + 2]);
      CHECK(lowest > 0.19 - 1e-3 * STRIP_LENGTH);
    }
    /* One that begins behind the back comes up against it. */
    SwState *under = falling(model);
    const double up[3] = {0, 0, 9.81};
    double x[3 * STRIP_VERTICES], highest = -1, force = 0;
    uint32_t count = 0;
    SwContact contacts[512];
    OK(sw_state_set_gravity(under, up));
    set_colliders(under, &made, 1);
    place(under, 0, 1.51);
    for (int step = 0; step < 240; ++step) OK(sw_state_step(under, 1.0 / 60));
    OK(sw_state_positions(under, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
    for (int v = 0; v < STRIP_VERTICES; ++v) highest = fmax(highest, x[3 * v + 2]);
    CHECK_NEAR(highest, 0.01, 1e-3 * STRIP_LENGTH);
    OK(sw_state_contacts(under, contacts, sizeof(SwContact), 512, &count));
    for (uint32_t i = 0; i < count; ++i) force += contacts[i].force[2];
    CHECK_NEAR(force, -weight, 1e-2 * weight);
    free(bytes);
    sw_collider_destroy(made);
    sw_collider_destroy(loaded);
    sw_state_destroy(state);
    sw_state_destroy(under);
  }
  sw_model_destroy(model);
}

static void a_one_sided_collider_that_is_wrong_is_refused_by_name(void) {
  SwMeshDesc mesh;
  SwCollider *none = NULL;
  for (uint32_t kind = SW_COLLIDER_PLANE; kind <= SW_COLLIDER_HULL; ++kind) {
    SwColliderDesc desc = ground(&mesh, kind);
    char text[64];
    desc.radius = desc.half_length = 1;
    for (int c = 0; c < 3; ++c) desc.half_extents[c] = 1;
    snprintf(text, sizeof text, "desc->flags has SW_COLLIDER_ONE_SIDED, and desc->kind is %u", kind);
    FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_ARGUMENT, text);
  }
  for (uint32_t kind = SW_COLLIDER_MESH; kind <= SW_COLLIDER_DEFORMING_MESH; ++kind) {
    const double bad[4] = {-1, NAN, INFINITY, 1e-9};
    SwColliderDesc desc = ground(&mesh, kind);
    for (int i = 0; i < 4; ++i) {
      desc.depth = bad[i];
      FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_ARGUMENT, "the depth of the one-sided mesh is");
    }
    desc.depth = 0;
    desc.flags = SW_COLLIDER_ONE_SIDED | 1;
    FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_ARGUMENT, "desc->flags");
    desc.flags = 0;
    FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_MESH, "the mesh is open");
    desc.depth = 0.5;
    FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_ARGUMENT, "desc->depth is 0.5");
  }
  CHECK(!none);
}

static void a_saved_state_goes_on_with_its_contacts(void) {
  SwModel *model = free_strip();
  SwCollider *floor = collider_of(SW_COLLIDER_PLANE, 0.3);
  SwState *states[2];
  double x[2][3 * STRIP_VERTICES];
  unsigned char *bytes = NULL;
  uint64_t size = 0;
  for (int i = 0; i < 2; ++i) {
    states[i] = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_IMPLICIT_EULER);
    OK(sw_state_set_gravity(states[i], GRAVITY));
    set_colliders(states[i], &floor, 1);
    place(states[i], 0, -0.02);
  }
  for (int step = 0; step < 20; ++step) OK(sw_state_step(states[0], 1.0 / 60));
  OK(sw_state_save(states[0], NULL, 0, &size));
  bytes = malloc(size);
  OK(sw_state_save(states[0], bytes, size, &size));
  OK(sw_state_load(states[1], bytes, size));
  for (int i = 0; i < 2; ++i) {
    for (int step = 0; step < 10; ++step) OK(sw_state_step(states[i], 1.0 / 60));
    OK(sw_state_positions(states[i], SW_SPACE_WORLD, SW_FORMAT_F64, x[i], 0, STRIP_VERTICES));
  }
  CHECK(memcmp(x[0], x[1], sizeof x[0]) == 0);
  OK(sw_state_set_colliders(states[1], NULL, 0));
  FAILS(sw_state_load(states[1], bytes, size), SW_ERROR_INVALID_DATA, "colliders");
  for (int i = 0; i < 2; ++i) sw_state_destroy(states[i]);
  sw_collider_destroy(floor);
  free(bytes);
  sw_model_destroy(model);
}

static void what_is_wrong_is_refused_by_name(void) {
  SwModel *model = free_strip();
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_IMPLICIT_EULER);
  SwCollider *floor = collider_of(SW_COLLIDER_PLANE, 0), *none = NULL;
  const SwCollider *list[2] = {floor, NULL};
  SwColliderPoseDesc pose;
  uint32_t count = 0;
  struct {
    uint32_t kind;
    double radius, half_length, friction, thickness;
    const char *text;
  } bad[] = {
      {0, 1, 1, 0, 0, "desc->kind is 0"},
      {SW_COLLIDER_SPHERE, 0, 0, 0, 0, "radius is 0"},
      {SW_COLLIDER_SPHERE, NAN, 0, 0, 0, "radius is NaN"},
      {SW_COLLIDER_CAPSULE, 1, -1, 0, 0, "half length is -1"},
      {SW_COLLIDER_PLANE, 0, 0, -0.5, 0, "friction is -0.5"},
      {SW_COLLIDER_PLANE, 0, 0, 0, INFINITY, "thickness is inf"},
      {SW_COLLIDER_BOX, 0, 0, 0, 0, "half extent along x"},
      {SW_COLLIDER_MESH, 0, 0, 0, 0, "mesh is NULL"},
      {SW_COLLIDER_HULL, 0, 0, 0, 0, "mesh is NULL"},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    SwColliderDesc desc;
    sw_collider_desc_init(&desc);
    desc.kind = bad[i].kind;
    desc.radius = bad[i].radius;
    desc.half_length = bad[i].half_length;
    desc.friction = bad[i].friction;
    desc.thickness = bad[i].thickness;
    FAILS(sw_collider_create(&desc, &none), SW_ERROR_INVALID_ARGUMENT, bad[i].text);
  }
  CHECK(!none);
  FAILS(sw_state_set_colliders(state, list, 2), SW_ERROR_INVALID_ARGUMENT, "colliders[1] is NULL");
  FAILS(sw_state_set_colliders(state, NULL, 2), SW_ERROR_INVALID_ARGUMENT, "colliders is NULL");
  FAILS(sw_state_set_colliders(state, list, 70000), SW_ERROR_INVALID_ARGUMENT, "70000");
  OK(sw_state_set_colliders(state, list, 1));
  sw_collider_pose_desc_init(&pose);
  FAILS(sw_state_move_collider(state, 1, &pose), SW_ERROR_INVALID_ARGUMENT, "collider 1 of 1");
  pose.origin[1] = NAN;
  FAILS(sw_state_move_collider(state, 0, &pose), SW_ERROR_INVALID_ARGUMENT, "origin[1] is NaN");
  pose.origin[1] = 0;
  pose.rotation[0] = 2;
  FAILS(sw_state_move_collider(state, 0, &pose), SW_ERROR_INVALID_ARGUMENT, "rotation");
  pose.rotation[0] = 0;
  pose.flags = 8;
  FAILS(sw_state_move_collider(state, 0, &pose), SW_ERROR_INVALID_ARGUMENT, "flags");
  FAILS(sw_state_contacts(state, NULL, sizeof(SwContact), 0, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  FAILS(sw_state_contacts(NULL, NULL, sizeof(SwContact), 0, &count), SW_ERROR_INVALID_ARGUMENT, "state");
  sw_collider_destroy(NULL);
  sw_collider_destroy(floor);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* A box whose upper side is lifted vertex by vertex, and what stays inside of a ball pushed out for the eye. */
static void a_deforming_mesh_lifts_the_strip_and_the_push_out_leaves_nothing_inside(void) {
  const double box[24] = {-9, -9, -1, 9, -9, -1, -9, 9, -1, 9, 9, -1, -9, -9, 0, 9, -9, 0, -9, 9, 0, 9, 9, 0};
  const uint32_t triangles[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  const Strip strip = make_strip();
  const double gravity[3] = {0, 0, -9.8};
  SwModel *model = strip_model(&strip);
  precompute(model, 8, SW_PRECISION_F64);
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  SwMeshDesc mesh;
  SwColliderDesc desc;
  SwColliderPoseDesc pose;
  SwCollider *collider = NULL;
  sw_mesh_desc_init(&mesh);
  mesh.positions = box;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = triangles;
  mesh.n_vertices = 8;
  mesh.n_triangles = 12;
  sw_collider_desc_init(&desc);
  desc.kind = SW_COLLIDER_DEFORMING_MESH;
  desc.mesh = &mesh;
  OK(sw_collider_create(&desc, &collider));
  OK(sw_state_set_gravity(state, gravity));
  OK(sw_state_set_colliders(state, (const SwCollider *const *)&collider, 1));
  sw_collider_pose_desc_init(&pose);
  pose.origin[2] = -0.4;
  OK(sw_state_move_collider(state, 0, &pose));
  sw_collider_destroy(collider);
  double led[24], x[3 * STRIP_VERTICES], lowest = 1, deepest = 1;
  for (int k = 0; k <= 60; ++k) {
    for (int i = 0; i < 24; ++i) led[i] = box[i] + (i % 3 == 2 ? 0.2 * k / 60 : 0);
    OK(sw_state_deform_collider(state, 0, 0, SW_FORMAT_F64, led, 0, 8));
    OK(sw_state_step(state, 1.0 / 60));
  }
  OK(sw_state_positions_outside(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES, &deepest));
  for (int v = 0; v < STRIP_VERTICES; ++v) lowest = fmin(lowest, x[3 * v + 2]);
  CHECK(deepest == 0);
  CHECK(lowest > -0.2 - 1e-9 && lowest < -0.1); /* it lies on the box, whose top is at -0.2 now */
  FAILS(sw_state_deform_collider(state, 1, 0, SW_FORMAT_F64, led, 0, 8), SW_ERROR_INVALID_ARGUMENT, "collider 1 of 1");
  FAILS(sw_state_deform_collider(state, 0, 0, SW_FORMAT_F64, led, 0, 7), SW_ERROR_INVALID_ARGUMENT, "vertices");
  FAILS(sw_state_deform_collider(state, 0, 2, SW_FORMAT_F64, led, 0, 8), SW_ERROR_INVALID_ARGUMENT, "flags");
  FAILS(sw_state_deform_collider(state, 0, 0, SW_FORMAT_F64, NULL, 0, 8), SW_ERROR_INVALID_ARGUMENT, "positions");
  led[4] = NAN;
  FAILS(sw_state_deform_collider(state, 0, 0, SW_FORMAT_F64, led, 0, 8), SW_ERROR_INVALID_ARGUMENT, "vertex 1");
  FAILS(sw_state_positions_outside(state, 9, SW_FORMAT_F64, x, 0, STRIP_VERTICES, NULL), SW_ERROR_INVALID_ARGUMENT, "space");
  SwCapsuleFit fit;
  sw_capsule_fit_init(&fit);
  OK(sw_fit_capsule(SW_FORMAT_F64, box, 0, 8, &fit));
  CHECK(fit.radius > 9 && fit.radius < 15 && fit.half_length >= 0);
  FAILS(sw_fit_capsule(SW_FORMAT_F64, box, 0, 0, &fit), SW_ERROR_INVALID_ARGUMENT, "point");

  uint32_t patches[4] = {0}, n_patches = 0;
  double pose12[12] = {0, 0, -0.4};
  OK(sw_collider_create(&desc, &collider));
  const SwCollider *const near[1] = {collider};
  OK(sw_model_patches_near(model, near, pose12, 1, 0.5, patches, 4, &n_patches));
  CHECK(n_patches == 4 && patches[0] < STRIP_VERTICES && patches[0] != patches[1]);
  pose12[2] = -100;
  OK(sw_model_patches_near(model, near, pose12, 1, 0.5, patches, 4, &n_patches));
  CHECK(n_patches == 0);
  OK(sw_model_patches_near(model, NULL, NULL, 0, 0.5, NULL, 0, &n_patches));
  FAILS(sw_model_patches_near(model, near, NULL, 1, -1, patches, 4, &n_patches), SW_ERROR_INVALID_ARGUMENT, "distance");
  pose12[3] = 2;
  FAILS(sw_model_patches_near(model, near, pose12, 1, 0.5, patches, 4, &n_patches), SW_ERROR_INVALID_ARGUMENT, "rotation");
  FAILS(sw_model_patches_near(model, NULL, NULL, 1, 0.5, patches, 4, &n_patches), SW_ERROR_INVALID_ARGUMENT, "colliders");
  FAILS(sw_model_patches_near(model, near, NULL, 1, 0.5, patches, 4, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  sw_collider_destroy(collider);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

enum { CROWD = 8, CROWD_STEPS = 60 };

typedef struct {
  SwState *states[CROWD];
} Fallen;

/* Strips over a ball each, at eight heights, with friction. */
static Fallen fallen(const SwModel *model, uint32_t method) {
  Fallen crowd;
  for (int i = 0; i < CROWD; ++i) {
    const double gravity[3] = {0, 0.3 * i, -9.8};
    SwColliderDesc desc;
    SwColliderPoseDesc pose;
    SwCollider *collider = NULL;
    crowd.states[i] = new_state(model, method, SW_INTEGRATOR_EXACT);
    OK(sw_state_set_gravity(crowd.states[i], gravity));
    sw_collider_desc_init(&desc);
    desc.kind = SW_COLLIDER_SPHERE;
    desc.radius = 0.5;
    desc.friction = 0.4;
    OK(sw_collider_create(&desc, &collider));
    OK(sw_state_set_colliders(crowd.states[i], (const SwCollider *const *)&collider, 1));
    sw_collider_destroy(collider);
    sw_collider_pose_desc_init(&pose);
    pose.origin[0] = 3;
    pose.origin[2] = -0.52 - 0.01 * i;
    OK(sw_state_move_collider(crowd.states[i], 0, &pose));
  }
  return crowd;
}

static void destroy_fallen(Fallen *crowd) {
  for (int i = 0; i < CROWD; ++i) sw_state_destroy(crowd->states[i]);
}

static int same_bits(const SwState *a, const SwState *b) {
  static double x[3 * STRIP_VERTICES], y[3 * STRIP_VERTICES];
  OK(sw_state_positions(a, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  OK(sw_state_positions(b, SW_SPACE_WORLD, SW_FORMAT_F64, y, 0, STRIP_VERTICES));
  return memcmp(x, y, sizeof x) == 0;
}

/* A strip with what every method needs. */
static SwModel *strip_of_every_method(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 8;
  desc.precision = SW_PRECISION_F64;
  desc.reduced_fields = 4;
  desc.reduced_flags = SW_REDUCED_UNTRAINED;
  OK(sw_model_precompute(model, &desc));
  return model;
}

/* Goes on from what was saved, into states that know the same colliders. */
static void resume(Fallen *crowd, const SwModel *model, uint32_t method) {
  Fallen resumed = fallen(model, method);
  for (int i = 0; i < CROWD; ++i) {
    uint64_t size = 0;
    OK(sw_state_save(crowd->states[i], NULL, 0, &size));
    void *bytes = malloc((size_t)size);
    OK(sw_state_save(crowd->states[i], bytes, size, &size));
    OK(sw_state_load(resumed.states[i], bytes, size));
    free(bytes);
  }
  destroy_fallen(crowd);
  *crowd = resumed;
}

static void many_states_among_colliders_step_to_the_same_bits_on_any_threads_and_when_resumed(void) {
  static const uint32_t methods[] = {SW_METHOD_WARP,          SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_LMA,
                                     SW_METHOD_ROTATION_STRAIN, SW_METHOD_REDUCED_SHELL,   SW_METHOD_POLYNOMIAL_SHELL};
  SwModel *model = strip_of_every_method();
  for (size_t m = 0; m < sizeof methods / sizeof *methods; ++m) {
    Fallen alone = fallen(model, methods[m]);
    uint32_t touching = 0;
    for (int k = 0; k < CROWD_STEPS; ++k)
      for (int i = 0; i < CROWD; ++i) OK(sw_state_step(alone.states[i], 1.0 / 60));
    for (int i = 0; i < CROWD; ++i) {
      uint32_t count = 0;
      OK(sw_state_contacts(alone.states[i], NULL, sizeof(SwContact), 0, &count));
      touching += count > 0;
    }
    CHECK(touching >= 4);
    for (uint32_t threads = 1; threads <= 4; threads *= 2) {
      Fallen crowd = fallen(model, methods[m]);
      OK(sw_set_threads(threads));
      for (int k = 0; k < CROWD_STEPS; ++k) {
        if (k == CROWD_STEPS / 2) resume(&crowd, model, methods[m]);
        OK(sw_states_step(crowd.states, CROWD, 1.0 / 60, NULL));
      }
      for (int i = 0; i < CROWD; ++i) CHECK(same_bits(crowd.states[i], alone.states[i]));
      destroy_fallen(&crowd);
    }
    OK(sw_set_threads(0));
    destroy_fallen(&alone);
  }
  sw_model_destroy(model);
}

enum { MANY = 5000 };

/* Balls on a grid below and in the strip, most of which stand still. */
static SwState *among_many(const SwModel *model, const SwCollider *ball) {
  static const SwCollider *list[MANY];
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  SwColliderPoseDesc pose;
  for (int i = 0; i < MANY; ++i) list[i] = ball;
  OK(sw_state_set_gravity(state, GRAVITY));
  OK(sw_state_set_colliders(state, list, MANY));
  sw_collider_pose_desc_init(&pose);
  for (int i = 0; i < MANY; ++i) {
    pose.origin[0] = 0.1 * (i % 50);
    pose.origin[1] = 0.1 * (i / 50 % 10) - 0.45;
    pose.origin[2] = -0.1 * (i / 500); /* those of the first layer are cut by the strip at rest */
    OK(sw_state_move_collider(state, (uint32_t)i, &pose));
  }
  return state;
}

static void thousands_of_colliders_step_to_the_same_bits_and_one_that_is_wrong_is_named(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 8, SW_PRECISION_F64);
  SwColliderDesc desc;
  SwColliderPoseDesc pose;
  SwCollider *ball = NULL;
  sw_collider_desc_init(&desc);
  desc.kind = SW_COLLIDER_SPHERE;
  desc.radius = 0.03;
  desc.friction = 0.4;
  OK(sw_collider_create(&desc, &ball));
  SwState *states[2] = {among_many(model, ball), among_many(model, ball)};
  static const SwCollider *list[MANY];
  static double x[3 * STRIP_VERTICES];
  uint32_t count = 0;
  for (int i = 0; i < MANY; ++i) list[i] = i == 3141 ? NULL : ball;
  FAILS(sw_state_set_colliders(states[0], list, MANY), SW_ERROR_INVALID_ARGUMENT, "colliders[3141] is NULL");
  sw_collider_pose_desc_init(&pose);
  FAILS(sw_state_move_collider(states[0], MANY, &pose), SW_ERROR_INVALID_ARGUMENT, "collider 5000 of 5000");
  pose.origin[2] = NAN;
  FAILS(sw_state_move_collider(states[0], 4999, &pose), SW_ERROR_INVALID_ARGUMENT, "origin[2] is NaN");
  /* The first goes on as if nothing had been asked of it. */
  for (int k = 0; k < 10; ++k) OK(sw_states_step(states, 2, 1.0 / 60, NULL));
  CHECK(same_bits(states[0], states[1]));
  OK(sw_state_contacts(states[0], NULL, sizeof(SwContact), 0, &count));
  CHECK(count > 0);
  OK(sw_state_positions(states[0], SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  for (int i = 0; i < 3 * STRIP_VERTICES; ++i) CHECK(fabs(x[i]) < 3 * STRIP_LENGTH); /* NaN is not */
  for (int i = 0; i < 2; ++i) sw_state_destroy(states[i]);
  sw_collider_destroy(ball);
  sw_model_destroy(model);
}

int main(void) {
  RUN(many_states_among_colliders_step_to_the_same_bits_on_any_threads_and_when_resumed);
  RUN(thousands_of_colliders_step_to_the_same_bits_and_one_that_is_wrong_is_named);
  RUN(a_deforming_mesh_lifts_the_strip_and_the_push_out_leaves_nothing_inside);
  RUN(a_strip_lies_with_its_weight_on_a_plane_and_on_a_box);
  RUN(a_closed_mesh_and_its_hull_carry_as_the_box_that_they_are);
  RUN(a_strip_lies_with_its_weight_on_a_ground_of_two_triangles_and_behind_it_stays_behind);
  RUN(a_one_sided_collider_that_is_wrong_is_refused_by_name);
  RUN(a_saved_state_goes_on_with_its_contacts);
  RUN(what_is_wrong_is_refused_by_name);
  return report_failures();
}

/* Hosts and libraries of different versions: README.md here.

   HOST_IS_NEW: the structs of shellwarp.h have a last field `appended`. LIBRARY_IS_NEW: so have the library's, which refuses one
   that is not 0 and so shows that it was read, and writes one that says "appended". */
#include "test_support.h"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#define POISON(address, size) ASAN_POISON_MEMORY_REGION(address, size)
#else
#define POISON(address, size) ((void)0)
#endif

enum { GUARD = 64 };
static const unsigned char guard_byte = 0xa5;

/* Guarded memory: all of it, and GUARD bytes behind it, are `guard_byte` at first. */
static struct {
  unsigned char *start;
  size_t size;
} guarded[32];
static int n_guarded = 0;

static void *guarded_bytes(size_t size) {
  unsigned char *start = malloc(size + GUARD);
  if (!start || n_guarded == 32) exit(EXIT_FAILURE);
  memset(start, guard_byte, size + GUARD);
  POISON(start + size, GUARD); /* neither read nor written from now on */
  guarded[n_guarded].start = start;
  guarded[n_guarded++].size = size;
  return start;
}

static void check_and_free_guarded(void) {
  while (n_guarded > 0) {
    unsigned char *start = guarded[--n_guarded].start;
#if !defined(__SANITIZE_ADDRESS__)
    for (size_t k = 0; k < GUARD; ++k) CHECK(start[guarded[n_guarded].size + k] == guard_byte);
#endif
    free(start);
  }
}

/* A guarded struct at its defaults. */
#define NEW(type, name, init)                    \
  type *name = (type *)guarded_bytes(sizeof *name); \
  init(name)

/* A host whose struct has `appended` sets it: a library that has it too reads it, one that has not refuses it by name. */
#if defined(HOST_IS_NEW) && defined(LIBRARY_IS_NEW)
#define SETS_APPENDED(type, desc, call) \
  (desc)->appended = 7;                 \
  FAILS(call, SW_ERROR_INVALID_ARGUMENT, #type "::appended is 7"); \
  (desc)->appended = 0
#elif defined(HOST_IS_NEW)
#define SETS_APPENDED(type, desc, call)                               \
  (desc)->appended = (uint64_t)7 << 32; /* not in its first byte */   \
  FAILS(call, SW_ERROR_UNSUPPORTED, #type);                           \
  CHECK(names_byte(offsetof(type, appended) + (little_endian() ? 4 : 3)) && names_sizes(sizeof(type))); \
  (desc)->appended = 0
#else
#define SETS_APPENDED(type, desc, call) ((void)0)
#endif

/* An output tells the field that it and the library have, and says 0 where the library has not. */
#if defined(HOST_IS_NEW) && defined(LIBRARY_IS_NEW)
#define CHECK_APPENDED(output) CHECK(memcmp(&(output)->appended, "appended", 8) == 0)
#elif defined(HOST_IS_NEW)
#define CHECK_APPENDED(output) CHECK((output)->appended == 0)
#else
#define CHECK_APPENDED(output) ((void)0)
#endif

#if defined(HOST_IS_NEW) && !defined(LIBRARY_IS_NEW)
static int little_endian(void) {
  const uint16_t one = 1;
  return *(const unsigned char *)&one == 1;
}

static int last_message_has(const char *format, size_t a, size_t b) {
  char text[96];
  snprintf(text, sizeof text, format, (unsigned)a, (unsigned)b);
  return strstr(sw_last_error_message(), text) != NULL;
}

static int names_byte(size_t byte) { return last_message_has("byte %u of", byte, 0); }

static int names_sizes(size_t size) {
  return last_message_has("the host has %u bytes of it, this library %u", size, size - sizeof(uint64_t));
}
#endif

/* The sizes that no host can have are refused for a struct of either side; its own is taken. */
#define CHECK_SIZES(type, desc, call)                               \
  do {                                                              \
    const uint32_t wrong_[4] = {0, 4, (uint32_t)sizeof(type) + 1, UINT32_MAX}; \
    for (int k_ = 0; k_ < 4; ++k_) {                                \
      (desc)->struct_size = wrong_[k_];                             \
      FAILS(call, SW_ERROR_INVALID_DESC, #type);                    \
    }                                                               \
    (desc)->struct_size = sizeof(type);                             \
  } while (0)

static void diagnostics_fit_the_elements_of_the_host(void) {
  const double positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 1, 9}};
  uint32_t count = 0;
  NEW(SwMeshDesc, mesh, sw_mesh_desc_init);
  mesh->position_format = SW_FORMAT_F64;
  mesh->positions = positions;
  mesh->n_vertices = 4;
  mesh->triangles = triangles[0];
  mesh->n_triangles = 2;
  CHECK_SIZES(SwMeshDesc, mesh, sw_mesh_check(mesh, NULL, sizeof(SwDiagnostic), 0, &count));
  SETS_APPENDED(SwMeshDesc, mesh, sw_mesh_check(mesh, NULL, sizeof(SwDiagnostic), 0, &count));
  OK(sw_mesh_check(mesh, NULL, sizeof(SwDiagnostic), 0, &count));
  CHECK(count >= 2);
  SwDiagnostic *found = guarded_bytes(count * sizeof *found);
  OK(sw_mesh_check(mesh, found, sizeof *found, count, &count));
  CHECK(found[0].kind == SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE && found[0].element == 1 && found[0].value[0] == 9);
  CHECK(found[count - 1].kind == SW_DIAGNOSTIC_UNREFERENCED_VERTEX && found[count - 1].element == 3);
  for (uint32_t k = 0; k < count; ++k) {
    CHECK(strlen(found[k].message) > 10);
    CHECK_APPENDED(&found[k]);
  }
  FAILS(sw_mesh_check(mesh, found, 0, 1, &count), SW_ERROR_INVALID_DESC, "SwDiagnostic");
  FAILS(sw_mesh_check(mesh, found, sizeof *found + 4, 1, &count), SW_ERROR_INVALID_DESC, "SwDiagnostic");
  check_and_free_guarded();
}

/* Clamped at x = 0, with the choice of a method, whose candidates are then told. */
static SwModel *new_model(const Strip *strip) {
  SwModel *model = NULL;
  NEW(SwMeshDesc, mesh, sw_mesh_desc_init);
  NEW(SwMaterialDesc, material, sw_material_desc_init);
  NEW(SwSupportDesc, supports, sw_support_desc_init);
  mesh->positions = strip->positions;
  mesh->position_format = SW_FORMAT_F64;
  mesh->triangles = strip->triangles;
  mesh->n_vertices = STRIP_VERTICES;
  mesh->n_triangles = STRIP_TRIANGLES;
  material->area_density = 2;
  supports->clamped = strip->held;
  supports->n_clamped = STRIP_ROWS;
  CHECK_SIZES(SwMaterialDesc, material, sw_model_create(mesh, material, supports, &model));
  CHECK_SIZES(SwSupportDesc, supports, sw_model_create(mesh, material, supports, &model));
  SETS_APPENDED(SwMaterialDesc, material, sw_model_create(mesh, material, supports, &model));
  SETS_APPENDED(SwSupportDesc, supports, sw_model_create(mesh, material, supports, &model));
  OK(sw_model_create(mesh, material, supports, &model));
  check_and_free_guarded();
  return model;
}

static void models_are_made_and_told(void) {
  const Strip strip = make_strip();
  SwModel *model = new_model(&strip);
  NEW(SwPrecomputeDesc, options, sw_precompute_desc_init);
  options->modes = 6;
  options->auto_error = 1;
  options->reduced_fields = 4;
  options->reduced_poses = 2;
  options->demand_gravity[2] = -1e-3;
  CHECK_SIZES(SwPrecomputeDesc, options, sw_model_precompute(model, options));
  SETS_APPENDED(SwPrecomputeDesc, options, sw_model_precompute(model, options));
  OK(sw_model_precompute(model, options));

  NEW(SwModelInfo, info, sw_model_info_init);
  CHECK_SIZES(SwModelInfo, info, sw_model_info(model, info));
  OK(sw_model_info(model, info));
  CHECK(info->struct_size == sizeof *info && info->n_vertices == STRIP_VERTICES && info->modes == 6);
  CHECK_NEAR(info->total_mass, 2 * STRIP_LENGTH * STRIP_WIDTH, 1e-12); /* sums of a few hundred rounded areas */
  CHECK(info->auto_method != 0 && info->auto_error > 0);               /* the last fields of the first version */
  CHECK_APPENDED(info);

  uint32_t count = 0;
  OK(sw_model_front(model, NULL, sizeof(SwFrontPoint), 0, &count));
  CHECK(count > 1);
  SwFrontPoint *points = guarded_bytes(count * sizeof *points);
  FAILS(sw_model_front(model, points, 8, count, &count), SW_ERROR_INVALID_DESC, "SwFrontPoint");
  OK(sw_model_front(model, points, sizeof *points, count, &count));
  uint32_t chosen = 0;
  for (uint32_t k = 0; k < count; ++k) {
    CHECK(points[k].method != 0 && points[k].operations > 0 && points[k].error > 0);
    chosen += points[k].chosen;
    CHECK_APPENDED(&points[k]);
  }
  CHECK(chosen == 1);
  sw_model_destroy(model);
  check_and_free_guarded();
}

static SwState *guarded_state(const SwModel *model) {
  SwState *state = NULL;
  NEW(SwStateDesc, desc, sw_state_desc_init);
  desc->method = SW_METHOD_WARP;
  CHECK_SIZES(SwStateDesc, desc, sw_state_create(model, desc, &state));
  SETS_APPENDED(SwStateDesc, desc, sw_state_create(model, desc, &state));
  OK(sw_state_create(model, desc, &state));
  check_and_free_guarded();
  return state;
}

static void give_loads(SwState *state) {
  const double gravity[3] = {0, 0, -1e-3}, ratio = 0.1;
  const double force[3] = {0, 0, 1e-4};
  const uint32_t vertex = STRIP_VERTICES / 2;
  NEW(SwDampingDesc, damping, sw_damping_desc_init);
  NEW(SwFrameDesc, frame, sw_frame_desc_init);
  NEW(SwForceDesc, forces, sw_force_desc_init);
  NEW(SwWindDesc, wind, sw_wind_desc_init);
  NEW(SwConstraintDesc, handle, sw_constraint_desc_init);
  damping->n_ratios = 1;
  damping->ratios = &ratio;
  forces->format = SW_FORMAT_F64;
  forces->count = 1;
  forces->forces = force;
  forces->vertices = &vertex;
  wind->density = 0.1;
  wind->normal_drag = 1;
  wind->velocity[2] = 0.01;
  handle->kind = SW_CONSTRAINT_POSITION;
  handle->vertex = STRIP_VERTICES - 2;
  handle->axes = SW_AXIS_Z;
  handle->position[2] = 0.01;
  OK(sw_state_set_gravity(state, gravity));
#define GIVE(type, desc, function)                     \
  CHECK_SIZES(type, desc, function(state, desc));      \
  SETS_APPENDED(type, desc, function(state, desc)); \
  OK(function(state, desc))
  GIVE(SwDampingDesc, damping, sw_state_set_damping);
  GIVE(SwFrameDesc, frame, sw_state_set_frame);
  GIVE(SwForceDesc, forces, sw_state_set_forces);
  GIVE(SwWindDesc, wind, sw_state_set_wind);
  GIVE(SwConstraintDesc, handle, sw_state_set_constraint);
  check_and_free_guarded();
}

static void states_are_moved_and_told(void) {
  const Strip strip = make_strip();
  SwModel *model = new_model(&strip);
  OK(sw_model_precompute(model, NULL));
  SwState *state = guarded_state(model);
  give_loads(state);
  for (int k = 0; k < 3; ++k) OK(sw_state_step(state, 0.25));

  uint32_t count = 0;
  SwConstraintReport *met = guarded_bytes(sizeof *met);
  OK(sw_state_constraint_report(state, met, sizeof *met, 1, &count));
  CHECK(count == 1 && met->met == 1 && met->vertex == STRIP_VERTICES - 2 && met->force[2] != 0);
  CHECK_APPENDED(met);

  OK(sw_state_plan(state, 0.25, NULL, sizeof(SwPlanPart), 0, &count));
  SwPlanPart *parts = guarded_bytes(count * sizeof *parts);
  OK(sw_state_plan(state, 0.25, parts, sizeof *parts, count, &count));
  for (uint32_t k = 0; k < count; ++k) {
    CHECK(parts[k].part == k + 1 && strlen(parts[k].reason) > 3);
    CHECK_APPENDED(&parts[k]);
  }

  NEW(SwStateReport, report, sw_state_report_init);
  CHECK_SIZES(SwStateReport, report, sw_state_report(state, report));
  OK(sw_state_report(state, report));
  CHECK(report->struct_size == sizeof *report && report->time == 0.75 && report->max_displacement > 0.009);
  CHECK_APPENDED(report);

  NEW(SwEquilibriumReport, rest, sw_equilibrium_report_init);
  CHECK_SIZES(SwEquilibriumReport, rest, sw_state_equilibrium(state, rest));
  OK(sw_state_equilibrium(state, rest));
  CHECK(rest->struct_size == sizeof *rest && rest->iterations > 0 && rest->residual < 1e-6);
  CHECK_APPENDED(rest);

  NEW(SwCertificate, certificate, sw_certificate_init);
  CHECK_SIZES(SwCertificate, certificate, sw_state_certify(state, certificate));
  OK(sw_state_certify(state, certificate));
  CHECK(certificate->struct_size == sizeof *certificate && certificate->method == SW_METHOD_WARP);
  CHECK(certificate->error > 0 && certificate->remaining >= 0);
  CHECK_APPENDED(certificate);
  sw_state_destroy(state);
  sw_model_destroy(model);
  check_and_free_guarded();
}

int main(void) {
  RUN(diagnostics_fit_the_elements_of_the_host);
  RUN(models_are_made_and_told);
  RUN(states_are_moved_and_told);
  return report_failures();
}

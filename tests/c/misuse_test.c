/* What a careless or unlucky host does: every call must fail with the stated status and a message that names the item, leave
   its outputs alone, and leave the objects usable. */
#include "test_support.h"

/* Bytes that no call may change. */
typedef struct {
  unsigned char bytes[8 * 4 * STRIP_VERTICES];
} Untouched;

static Untouched canary(void) {
  Untouched u;
  memset(&u, 0xC5, sizeof u);
  return u;
}

static int is_untouched(const Untouched *u) {
  for (size_t k = 0; k < sizeof u->bytes; ++k)
    if (u->bytes[k] != 0xC5) return 0;
  return 1;
}

static SwModel *const no_model = (SwModel *)(uintptr_t)0x10; /* never a handle; only compared, never used */
static SwState *const no_state = (SwState *)(uintptr_t)0x10;

static const double bad_numbers[] = {NAN, HUGE_VAL, -HUGE_VAL};
enum { N_BAD = 3 };

static SwModel *ready_model(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 4, 0);
  return model;
}

/* A state in motion, so that "nothing has changed" says something. */
static SwState *moving_state(const SwModel *model) {
  const double q[4] = {0.1, -0.05, 0.02, 0.01}, rate[4] = {0.3, 0, -0.1, 0.2};
  SwState *state = new_state(model, 0, 0);
  OK(sw_state_set_amplitudes(state, q, rate, 4));
  OK(sw_state_step(state, 0.01));
  return state;
}

typedef struct {
  double x[3 * STRIP_VERTICES];
  unsigned char saved[512];
} Snapshot;

static Snapshot snapshot(const SwState *state) {
  Snapshot s;
  uint64_t size;
  memset(&s, 0, sizeof s);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, s.x, 0, STRIP_VERTICES));
  OK(sw_state_save(state, s.saved, sizeof s.saved, &size));
  return s;
}

static int unchanged(const SwState *state, const Snapshot *before) {
  const Snapshot now = snapshot(state);
  return memcmp(&now, before, sizeof now) == 0;
}

/* -------------------------------------------------------------------------------------------------------------- NULL */

static void init_and_destroy_take_null(void) {
  unsigned char few[4] = {1, 2, 3, 4};
  sw_struct_init(NULL, 100);
  sw_struct_init(few, 3); /* no struct_size would fit */
  CHECK(few[0] == 1 && few[1] == 2 && few[2] == 3 && few[3] == 4);
  sw_mesh_desc_init(NULL);
  sw_material_desc_init(NULL);
  sw_support_desc_init(NULL);
  sw_precompute_desc_init(NULL);
  sw_state_desc_init(NULL);
  sw_damping_desc_init(NULL);
  sw_frame_desc_init(NULL);
  sw_constraint_desc_init(NULL);
  sw_force_desc_init(NULL);
  sw_wind_desc_init(NULL);
  sw_equilibrium_report_init(NULL);
  sw_model_info_init(NULL);
  sw_state_report_init(NULL);
  sw_certificate_init(NULL);
  sw_model_destroy(NULL);
  sw_state_destroy(NULL);
  OK(sw_set_log_callback(NULL, NULL));
}

static void null_mesh_arguments_are_named(void) {
  const Strip strip = make_strip();
  SwMeshDesc mesh = strip_mesh(&strip);
  SwDiagnostic diagnostic;
  SwModel *model = no_model;
  uint32_t count = 77;
  FAILS(sw_mesh_check(NULL, &diagnostic, sizeof(SwDiagnostic), 1, &count), SW_ERROR_INVALID_ARGUMENT, "mesh");
  FAILS(sw_mesh_check(&mesh, NULL, sizeof(SwDiagnostic), 1, &count), SW_ERROR_INVALID_ARGUMENT, "diagnostics");
  FAILS(sw_mesh_check(&mesh, &diagnostic, sizeof(SwDiagnostic), 1, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  FAILS(sw_model_create(NULL, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "mesh");
  FAILS(sw_model_create(&mesh, NULL, NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "model");

  mesh.positions = NULL;
  FAILS(sw_mesh_check(&mesh, &diagnostic, sizeof(SwDiagnostic), 1, &count), SW_ERROR_INVALID_ARGUMENT, "positions");
  FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "positions");
  mesh = strip_mesh(&strip);
  mesh.triangles = NULL;
  FAILS(sw_mesh_check(&mesh, &diagnostic, sizeof(SwDiagnostic), 1, &count), SW_ERROR_INVALID_ARGUMENT, "triangles");
  FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "triangles");
  CHECK(count == 77 && model == no_model);
}

static void null_support_lists_with_a_length_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwSupportDesc supports;
  SwModel *model = no_model;
  sw_support_desc_init(&supports);
  supports.n_fixed = 1;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "fixed");
  supports.n_fixed = 0;
  supports.n_clamped = 1;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "clamped");
  supports.n_clamped = 0;
  supports.n_axis_vertices = 1;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "axis_directions");
  const uint8_t axes[1] = {8};
  supports.axes = axes;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "axis_vertices");
  const uint32_t first[1] = {0};
  supports.axis_vertices = first;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "axes[0]");
  const double direction[3] = {0, INFINITY, 0};
  supports.axes = NULL;
  supports.axis_directions = direction;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "axes[0]");
  uint8_t symmetric[1] = {16};
  supports.axis_directions = NULL;
  supports.symmetric_axes = symmetric;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "symmetric_axes[0] is 16");
  symmetric[0] = SW_AXIS_DIRECTION;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "symmetric_axes[0]");
  symmetric[0] = SW_AXIS_X; /* a corner of the strip, whose neighbours are on no plane */
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "vertex 0 is to be on a plane of symmetry");
  supports.symmetric_axes = NULL;
  supports.axis_directions = direction;
  SwMaterialDesc tied;
  sw_material_desc_init(&tied);
  tied.n_ties = 1;
  FAILS(sw_model_create(&mesh, &tied, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->ties");
  const uint32_t itself[2] = {0, 0};
  tied.ties = itself;
  FAILS(sw_model_create(&mesh, &tied, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "tie 0");
  tied.n_ties = 0;
  tied.tie_flags = 1;
  FAILS(sw_model_create(&mesh, &tied, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "tie_flags");
  tied.tie_flags = 0;
  tied.tie_distance = -1;
  FAILS(sw_model_create(&mesh, &tied, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "tie_distance");
  supports.reserved = 1;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "reserved");
  CHECK(model == no_model);
}

static void null_model_arguments_are_named(void) {
  SwModel *model = ready_model();
  Untouched out = canary();
  SwModelInfo info;
  double hertz[4];
  uint32_t count = 77;
  sw_model_info_init(&info);
  FAILS(sw_model_precompute(NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_info(NULL, &info), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_info(model, NULL), SW_ERROR_INVALID_ARGUMENT, "info");
  FAILS(sw_model_frequencies(NULL, hertz, 4, &count), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_frequencies(model, NULL, 4, &count), SW_ERROR_INVALID_ARGUMENT, "hertz");
  FAILS(sw_model_frequencies(model, hertz, 4, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  FAILS(sw_model_mode_shape(NULL, 0, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F32, &out, 0, STRIP_VERTICES),
        SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F32, NULL, 0, STRIP_VERTICES),
        SW_ERROR_INVALID_ARGUMENT, "out");
  CHECK(count == 77 && is_untouched(&out));
  sw_model_destroy(model);
}

static void null_state_arguments_are_named(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model), *other = no_state;
  const Snapshot before = snapshot(state);
  SwDampingDesc damping;
  SwFrameDesc frame;
  SwStateReport report;
  double four[4] = {0}, rates[4] = {0};
  uint32_t count = 77;
  uint64_t size = 77;
  sw_damping_desc_init(&damping);
  sw_frame_desc_init(&frame);
  sw_state_report_init(&report);

  FAILS(sw_state_create(NULL, NULL, &other), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_state_create(model, NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_reset(NULL), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_clone(NULL, &other), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_clone(state, NULL), SW_ERROR_INVALID_ARGUMENT, "clone");
  FAILS(sw_state_set_gravity(NULL, four), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_gravity(state, NULL), SW_ERROR_INVALID_ARGUMENT, "gravity");
  FAILS(sw_state_set_damping(NULL, &damping), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_damping(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  damping.n_ratios = 1;
  FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "ratios");
  FAILS(sw_state_set_frame(NULL, &frame), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_frame(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_state_set_amplitudes(NULL, four, rates, 4), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_amplitudes(state, NULL, rates, 4), SW_ERROR_INVALID_ARGUMENT, "amplitudes");
  FAILS(sw_state_set_amplitudes(state, four, NULL, 4), SW_ERROR_INVALID_ARGUMENT, "velocities");
  FAILS(sw_state_amplitudes(NULL, four, rates, 4, &count), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_amplitudes(state, NULL, rates, 4, &count), SW_ERROR_INVALID_ARGUMENT, "amplitudes");
  FAILS(sw_state_amplitudes(state, four, NULL, 4, &count), SW_ERROR_INVALID_ARGUMENT, "velocities");
  FAILS(sw_state_amplitudes(state, four, rates, 4, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  FAILS(sw_state_step(NULL, 0.1), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_report(NULL, &report), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_report(state, NULL), SW_ERROR_INVALID_ARGUMENT, "report");
  FAILS(sw_state_save(NULL, four, sizeof four, &size), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_save(state, NULL, 1 << 20, &size), SW_ERROR_INVALID_ARGUMENT, "bytes");
  FAILS(sw_state_save(state, four, sizeof four, NULL), SW_ERROR_INVALID_ARGUMENT, "size");
  FAILS(sw_state_load(NULL, four, sizeof four), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_load(state, NULL, sizeof four), SW_ERROR_INVALID_ARGUMENT, "bytes");
  for (int k = 0; k < 4; ++k) CHECK(four[k] == 0 && rates[k] == 0);
  CHECK(count == 77 && size == 77 && other == no_state);
  CHECK(unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* The three outputs of vertices have the same arguments. */
typedef SwStatus (*VertexOutput)(const SwState *, uint32_t, uint32_t, void *, uint64_t, uint32_t);
static const VertexOutput vertex_outputs[3] = {sw_state_positions, sw_state_normals, sw_state_rotations};
static const uint64_t vertex_bytes[3] = {12, 12, 16}; /* of a row of floats */

static void wrong_vertex_buffers_are_refused_and_left_alone(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  Untouched out = canary();
  for (int k = 0; k < 3; ++k) {
    const VertexOutput output = vertex_outputs[k];
    const uint64_t row = vertex_bytes[k];
    FAILS(output(NULL, SW_SPACE_WORLD, SW_FORMAT_F32, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "state");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, NULL, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "out");
    FAILS(output(state, 2, SW_FORMAT_F32, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "space");
    FAILS(output(state, SW_SPACE_WORLD, 0, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "format");
    FAILS(output(state, SW_SPACE_WORLD, 3, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "format");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, row - 1, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT,
          "stride");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F64, &out, 2 * row - 1, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT,
          "stride");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, UINT64_MAX / 2, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT,
          "out");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, 0, STRIP_VERTICES - 1), SW_ERROR_INVALID_ARGUMENT,
          "n_vertices");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, 0, STRIP_VERTICES + 1), SW_ERROR_INVALID_ARGUMENT,
          "n_vertices");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, 0, 0), SW_ERROR_INVALID_ARGUMENT, "n_vertices");
    FAILS(output(state, SW_SPACE_WORLD, SW_FORMAT_F32, &out, 0, UINT32_MAX), SW_ERROR_INVALID_ARGUMENT, "n_vertices");
  }
  CHECK(is_untouched(&out));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void wrong_mode_shape_arguments_are_refused(void) {
  SwModel *model = ready_model();
  Untouched out = canary();
  FAILS(sw_model_mode_shape(model, 4, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F32, &out, 0, STRIP_VERTICES),
        SW_ERROR_INVALID_ARGUMENT, "mode");
  FAILS(sw_model_mode_shape(model, UINT32_MAX, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F32, &out, 0, STRIP_VERTICES),
        SW_ERROR_INVALID_ARGUMENT, "mode");
  FAILS(sw_model_mode_shape(model, 0, 0, SW_FORMAT_F32, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "shape");
  FAILS(sw_model_mode_shape(model, 0, 3, SW_FORMAT_F32, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT, "shape");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, 0, &out, 0, STRIP_VERTICES), SW_ERROR_INVALID_ARGUMENT,
        "format");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, SW_FORMAT_F32, &out, 11, STRIP_VERTICES),
        SW_ERROR_INVALID_ARGUMENT, "stride");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, SW_FORMAT_F32, &out, 0, STRIP_VERTICES + 1),
        SW_ERROR_INVALID_ARGUMENT, "n_vertices");
  CHECK(is_untouched(&out));
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------- descriptors */

static const uint32_t wrong_sizes[2] = {0, 12345};

static void uninitialised_descriptors_are_found_out(void) {
  const Strip strip = make_strip();
  SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *ready = ready_model(), *model = no_model;
  SwState *state = moving_state(ready), *other = no_state;
  const Snapshot before = snapshot(state);
  uint32_t count = 77;
  for (int k = 0; k < 2; ++k) {
    SwMaterialDesc material = {0};
    SwSupportDesc supports = {0};
    SwPrecomputeDesc options = {0};
    SwModelInfo info = {0};
    SwStateDesc desc = {0};
    SwDampingDesc damping = {0};
    SwFrameDesc frame = {0};
    SwStateReport report = {0};
    SwConstraintDesc constraint = {0};
    constraint.kind = SW_CONSTRAINT_POSITION;
    constraint.struct_size = wrong_sizes[k];
    mesh.struct_size = material.struct_size = supports.struct_size = options.struct_size = wrong_sizes[k];
    info.struct_size = desc.struct_size = damping.struct_size = frame.struct_size = report.struct_size = wrong_sizes[k];
    FAILS(sw_mesh_check(&mesh, NULL, sizeof(SwDiagnostic), 0, &count), SW_ERROR_INVALID_DESC, "SwMeshDesc");
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_DESC, "SwMeshDesc");
    mesh = strip_mesh(&strip);
    FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_DESC, "SwMaterialDesc");
    FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_DESC, "SwSupportDesc");
    FAILS(sw_model_precompute(ready, &options), SW_ERROR_INVALID_DESC, "SwPrecomputeDesc");
    FAILS(sw_model_info(ready, &info), SW_ERROR_INVALID_DESC, "SwModelInfo");
    FAILS(sw_state_create(ready, &desc, &other), SW_ERROR_INVALID_DESC, "SwStateDesc");
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_DESC, "SwDampingDesc");
    FAILS(sw_state_set_frame(state, &frame), SW_ERROR_INVALID_DESC, "SwFrameDesc");
    FAILS(sw_state_report(state, &report), SW_ERROR_INVALID_DESC, "SwStateReport");
    FAILS(sw_state_set_constraint(state, &constraint), SW_ERROR_INVALID_DESC, "SwConstraintDesc");
    CHECK(info.n_vertices == 0 && report.max_displacement == 0);
  }
  CHECK(count == 77 && model == no_model && other == no_state);
  CHECK(info_of(ready).modes == 4 && unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(ready);
}

static void unknown_enumerants_and_flags_are_refused(void) {
  const Strip strip = make_strip();
  SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *ready = ready_model(), *model = no_model;
  SwState *state = moving_state(ready), *other = no_state;
  const Snapshot before = snapshot(state);
  const uint32_t formats[3] = {0, 3, UINT32_MAX};
  for (int k = 0; k < 3; ++k) {
    mesh.position_format = formats[k];
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "format");
  }
  mesh = strip_mesh(&strip);

  SwMaterialDesc material;
  sw_material_desc_init(&material);
  material.energy = 3;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "energy");
  SwSupportDesc supports;
  sw_support_desc_init(&supports);
  supports.flags = 1;
  FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "flags");

  SwPrecomputeDesc options;
  sw_precompute_desc_init(&options);
  options.precision = 4;
  FAILS(sw_model_precompute(ready, &options), SW_ERROR_INVALID_ARGUMENT, "precision");
  options.precision = 0;
  options.flags = 0x80000000u;
  FAILS(sw_model_precompute(ready, &options), SW_ERROR_INVALID_ARGUMENT, "flags");

  SwStateDesc desc;
  sw_state_desc_init(&desc);
  const uint32_t unknown_methods[2] = {1000, UINT32_MAX};
  for (int k = 0; k < 2; ++k) {
    desc.method = unknown_methods[k];
    FAILS(sw_state_create(ready, &desc, &other), SW_ERROR_INVALID_ARGUMENT, "method");
  }
  desc.method = 0;
  desc.integrator = 4;
  FAILS(sw_state_create(ready, &desc, &other), SW_ERROR_INVALID_ARGUMENT, "integrator");
  desc.integrator = 0;
  desc.flags = 0x80000000u;
  FAILS(sw_state_create(ready, &desc, &other), SW_ERROR_INVALID_ARGUMENT, "flags");

  SwFrameDesc frame;
  sw_frame_desc_init(&frame);
  frame.flags = 4;
  FAILS(sw_state_set_frame(state, &frame), SW_ERROR_INVALID_ARGUMENT, "flags");
  CHECK(model == no_model && other == no_state && unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(ready);
}

/* ----------------------------------------------------------------------------------------------------------- numbers */

static void bad_mesh_coordinates_are_located(void) {
  Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = no_model;
  const double good = strip.positions[3 * 17 + 1];
  for (int k = 0; k < N_BAD; ++k) {
    strip.positions[3 * 17 + 1] = bad_numbers[k];
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_MESH, "17");
  }
  strip.positions[3 * 17 + 1] = good;
  CHECK(model == no_model);
}

static void bad_material_numbers_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double bad[N_BAD + 1] = {NAN, HUGE_VAL, -HUGE_VAL, -1};
  const char *names[4] = {"k_area", "k_length", "k_bend", "area_density"};
  SwModel *model = no_model;
  for (int field = 0; field < 4; ++field)
    for (int k = 0; k < N_BAD + 1; ++k) {
      SwMaterialDesc material;
      sw_material_desc_init(&material);
      double *fields[4] = {&material.k_area, &material.k_length, &material.k_bend, &material.area_density};
      *fields[field] = bad[k];
      FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, names[field]);
    }
  CHECK(model == no_model);
}

/* Each constant of an engineering sheet at each value that it cannot have. */
static void bad_sheet_numbers_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double bad[4][7] = {{NAN, HUGE_VAL, -HUGE_VAL, -1, 0, -0.0, 1e-320},
                            {NAN, HUGE_VAL, -HUGE_VAL, -1, 0.51, -1.5, 1e300},
                            {NAN, HUGE_VAL, -HUGE_VAL, -1, 0, -0.0, 1e-200},
                            {NAN, HUGE_VAL, -HUGE_VAL, -1, 0, -0.0, 1e-320}};
  const char *names[4] = {"young", "poisson", "thickness", "volume_density"};
  SwModel *model = no_model;
  for (int field = 0; field < 4; ++field)
    for (int k = 0; k < 7; ++k) {
      SwMaterialDesc material;
      sw_material_desc_init(&material);
      double *fields[4] = {&material.young, &material.poisson, &material.thickness, &material.volume_density};
      const double good[4] = {1e9, 0.3, 1e-3, 1000};
      for (int i = 0; i < 4; ++i) *fields[i] = good[i];
      *fields[field] = bad[field][k];
      material.energy = SW_ENERGY_KOITER;
      FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, names[field]);
    }
  CHECK(model == no_model);
}

/* Constants that the energy would not read. */
static void a_sheet_without_its_energy_is_refused(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const char *names[4] = {"young", "poisson", "thickness", "volume_density"};
  SwModel *model = no_model;
  SwMaterialDesc material;
  for (int field = 0; field < 4; ++field) {
    sw_material_desc_init(&material);
    double *fields[4] = {&material.young, &material.poisson, &material.thickness, &material.volume_density};
    *fields[field] = field == 1 ? -0.25 : 7e10;
    FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, names[field]);
  }
  sw_material_desc_init(&material);
  material.energy = 3;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->energy is 3");
  material.energy = SW_ENERGY_KOITER;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "young is 0");
  CHECK(model == no_model);
}

static void bad_maps_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  double values[STRIP_TRIANGLES];
  SwModel *model = no_model;
  SwMaterialMap good, map;
  SwMaterialDesc material;
  for (int t = 0; t < STRIP_TRIANGLES; ++t) values[t] = 2;
  sw_material_map_init(&good);
  good.quantity = SW_MAP_K_BEND;
  good.on = SW_MAP_ON_TRIANGLES;
  good.format = SW_FORMAT_F64;
  good.values = values;
  good.count = STRIP_TRIANGLES;
  sw_material_desc_init(&material);
  material.maps = &map;
  material.n_maps = 1;
#define REFUSED(change, text)                                                                     \
  do {                                                                                            \
    map = good;                                                                                   \
    change;                                                                                       \
    FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, text);      \
  } while (0)
  REFUSED(map.quantity = 0, "maps[0].quantity is 0");
  REFUSED(map.quantity = 9, "maps[0].quantity is 9");
  REFUSED(map.quantity = SW_MAP_YOUNG, "map of young");
  REFUSED(map.on = 0, "maps[0].on is 0");
  REFUSED(map.on = 3, "maps[0].on is 3");
  REFUSED(map.format = 0, "maps[0].values");
  REFUSED(map.values = NULL, "maps[0].values is NULL");
  REFUSED(map.stride = 7, "stride of material->maps[0].values");
  REFUSED(map.count = STRIP_TRIANGLES - 1, "k_bend has 159 values");
  REFUSED(map.on = SW_MAP_ON_VERTICES, "123 vertices");
  REFUSED(map.reserved = 1, "maps[0].reserved");
  const double bad[N_BAD + 2] = {NAN, HUGE_VAL, -HUGE_VAL, 0, -1};
  for (int k = 0; k < N_BAD + 2; ++k) REFUSED(values[9] = bad[k], "value 9 of the map of k_bend");
  values[9] = 2;
  map = good;
  map.struct_size = 3;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_DESC, "maps[0]->struct_size");
  map = good;
  material.maps = NULL;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->maps is NULL");
  material.maps = &map;
  material.n_maps = UINT32_MAX;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "n_maps");
  material.n_maps = 1;
  material.reserved = 1;
  FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "reserved");
  CHECK(model == no_model);
#undef REFUSED
}

static void supports_outside_the_mesh_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const uint32_t lists[2][3] = {{0, 1, STRIP_VERTICES}, {0, 1, UINT32_MAX}};
  SwModel *model = no_model;
  for (int k = 0; k < 2; ++k) {
    SwSupportDesc supports;
    sw_support_desc_init(&supports);
    supports.fixed = lists[k];
    supports.n_fixed = 3;
    FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "fixed[2]");
    supports.clamped = supports.fixed;
    supports.n_clamped = 3;
    supports.n_fixed = 0;
    FAILS(sw_model_create(&mesh, NULL, &supports, &model), SW_ERROR_INVALID_ARGUMENT, "clamped[2]");
  }
  CHECK(model == no_model);
}

static void bad_steps_move_nothing(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const Snapshot before = snapshot(state);
  const double bad[N_BAD + 3] = {NAN, HUGE_VAL, -HUGE_VAL, 0, -0.0, -0.1};
  for (int k = 0; k < N_BAD + 3; ++k) FAILS(sw_state_step(state, bad[k]), SW_ERROR_INVALID_ARGUMENT, "step");
  CHECK(unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_step_whose_result_would_overflow_moves_nothing(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const Snapshot before = snapshot(state);
  const double gravity[3] = {0, 0, 1e308};
  OK(sw_state_set_gravity(state, gravity));
  FAILS(sw_state_step(state, 1e10), SW_ERROR_NUMERICAL, "finite");
  CHECK(unchanged(state, &before));
  const double still[3] = {0, 0, 0};
  OK(sw_state_set_gravity(state, still));
  OK(sw_state_step(state, 1e-3));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_loads_and_amplitudes_are_named(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const Snapshot before = snapshot(state);
  for (int k = 0; k < N_BAD; ++k) {
    for (int i = 0; i < 3; ++i) {
      double gravity[3] = {1, 1, 1};
      gravity[i] = bad_numbers[k];
      FAILS(sw_state_set_gravity(state, gravity), SW_ERROR_INVALID_ARGUMENT, "gravity");
    }
    for (int i = 0; i < 4; ++i) {
      double good[4] = {9, 9, 9, 9}, bad[4] = {9, 9, 9, 9};
      bad[i] = bad_numbers[k];
      FAILS(sw_state_set_amplitudes(state, bad, good, 4), SW_ERROR_INVALID_ARGUMENT, "amplitudes");
      FAILS(sw_state_set_amplitudes(state, good, bad, 4), SW_ERROR_INVALID_ARGUMENT, "velocities");
    }
  }
  const double four[4] = {0};
  const uint32_t wrong_counts[4] = {0, 3, 5, UINT32_MAX};
  for (int k = 0; k < 4; ++k)
    FAILS(sw_state_set_amplitudes(state, four, four, wrong_counts[k]), SW_ERROR_INVALID_ARGUMENT, "count");
  CHECK(unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_damping_is_named(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const double bad[N_BAD + 1] = {NAN, HUGE_VAL, -HUGE_VAL, -1};
  for (int k = 0; k < N_BAD + 1; ++k) {
    SwDampingDesc damping;
    sw_damping_desc_init(&damping);
    damping.mass_coefficient = bad[k];
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "mass_coefficient");
    sw_damping_desc_init(&damping);
    damping.stiffness_coefficient = bad[k];
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "stiffness_coefficient");
    sw_damping_desc_init(&damping);
    double ratios[4] = {0, 0, bad[k], 0};
    damping.ratios = ratios;
    damping.n_ratios = 4;
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "ratios[2]");
    const uint32_t wrong[4] = {2, 3, 5, UINT32_MAX}; /* far more than there are: they must not be read */
    for (int i = 0; i < 4; ++i) {
      damping.n_ratios = wrong[i];
      FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "n_ratios");
    }
  }
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_frames_are_named_and_change_nothing(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model), *twin = moving_state(model);
  const char *names[6] = {"origin", "rotation", "velocity", "acceleration", "angular_velocity", "angular_acceleration"};
  const int lengths[6] = {3, 9, 3, 3, 3, 3};
  for (int field = 0; field < 6; ++field)
    for (int i = 0; i < lengths[field]; ++i)
      for (int k = 0; k < N_BAD; ++k) {
        SwFrameDesc frame;
        sw_frame_desc_init(&frame);
        frame.rotation[0] = frame.rotation[4] = frame.rotation[8] = 1;
        frame.flags = SW_FRAME_MOTION_GIVEN;
        double *fields[6] = {frame.origin,       frame.rotation,         frame.velocity,
                             frame.acceleration, frame.angular_velocity, frame.angular_acceleration};
        fields[field][i] = bad_numbers[k];
        FAILS(sw_state_set_frame(state, &frame), SW_ERROR_INVALID_ARGUMENT, names[field]);
      }
  /* A reflection, a scaling, a shear, and a single entry. */
  const double not_rotations[4][9] = {{1, 0, 0, 0, 1, 0, 0, 0, -1},
                                      {2, 0, 0, 0, 2, 0, 0, 0, 2},
                                      {1, 0.01, 0, 0, 1, 0, 0, 0, 1},
                                      {1, 0, 0, 0, 0, 0, 0, 0, 0}};
  for (int k = 0; k < 4; ++k) {
    SwFrameDesc frame;
    sw_frame_desc_init(&frame);
    memcpy(frame.rotation, not_rotations[k], sizeof frame.rotation);
    FAILS(sw_state_set_frame(state, &frame), SW_ERROR_INVALID_ARGUMENT, "rotation");
  }
  OK(sw_state_step(state, 0.1));
  OK(sw_state_step(twin, 0.1));
  const Snapshot expected = snapshot(twin);
  CHECK(unchanged(state, &expected));
  sw_state_destroy(state);
  sw_state_destroy(twin);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------ constraints */

static SwConstraintDesc constraint(uint32_t id, uint32_t kind) {
  SwConstraintDesc desc;
  sw_constraint_desc_init(&desc);
  desc.id = id;
  desc.kind = kind;
  desc.vertex = STRIP_VERTICES - 2;
  desc.axes = SW_AXIS_Z;
  desc.position[0] = STRIP_LENGTH;
  desc.position[2] = 0.3;
  desc.rotation[0] = desc.rotation[4] = desc.rotation[8] = 1;
  return desc;
}

/* Two held constraints, so that a failed call has something to spoil. */
static SwState *held_state(const SwModel *model) {
  SwState *state = moving_state(model);
  const SwConstraintDesc place = constraint(1, SW_CONSTRAINT_POSITION), turn = constraint(2, SW_CONSTRAINT_ORIENTATION);
  OK(sw_state_set_constraint(state, &place));
  OK(sw_state_set_constraint(state, &turn));
  OK(sw_state_step(state, 0.01));
  return state;
}

typedef struct {
  SwConstraintReport reports[2];
  uint32_t count;
} Reports;

static Reports reports_of(const SwState *state) {
  Reports r;
  memset(&r, 0, sizeof r);
  OK(sw_state_constraint_report(state, r.reports, sizeof(SwConstraintReport), 2, &r.count));
  return r;
}

/* The shell, the reports, and what the next step makes of the constraints are those of a twin that nobody misused. */
static void check_same_as_untouched(const SwModel *model, SwState *state) {
  SwState *twin = held_state(model);
  for (int k = 0; k < 2; ++k) {
    const Snapshot expected = snapshot(twin);
    const Reports mine = reports_of(state), its = reports_of(twin);
    CHECK(unchanged(state, &expected));
    CHECK(mine.count == 2 && memcmp(&mine, &its, sizeof mine) == 0);
    OK(sw_state_step(state, 0.1));
    OK(sw_state_step(twin, 0.1));
  }
  sw_state_destroy(twin);
}

static void null_constraint_arguments_are_named(void) {
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  const SwConstraintDesc desc = constraint(3, SW_CONSTRAINT_POSITION);
  Untouched out = canary();
  SwConstraintReport *reports = (SwConstraintReport *)(void *)&out;
  uint32_t count = 77;
  FAILS(sw_state_set_constraint(NULL, &desc), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_constraint(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_state_clear_constraint(NULL, 1), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_clear_constraint(NULL, SW_ALL_CONSTRAINTS), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_constraint_report(NULL, reports, sizeof(SwConstraintReport), 2, &count), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_constraint_report(state, NULL, sizeof(SwConstraintReport), 2, &count), SW_ERROR_INVALID_ARGUMENT, "reports");
  FAILS(sw_state_constraint_report(state, reports, sizeof(SwConstraintReport), 2, NULL), SW_ERROR_INVALID_ARGUMENT, "count");
  CHECK(count == 77 && is_untouched(&out));
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void unknown_kinds_axes_flags_ids_and_vertices_of_constraints_are_refused(void) {
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  const uint32_t kinds[3] = {0, 3, UINT32_MAX}, axes[3] = {8, 15, UINT32_MAX}, flags[2] = {1, 0x80000000u};
  const uint32_t vertices[2] = {STRIP_VERTICES, UINT32_MAX};
  for (uint32_t id = 1; id <= 3; ++id) { /* two that are there, and a new one */
    SwConstraintDesc desc;
    for (int k = 0; k < 3; ++k) {
      desc = constraint(id, kinds[k]);
      FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "kind");
      desc = constraint(id, SW_CONSTRAINT_POSITION);
      desc.axes = axes[k];
      FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "axes");
    }
    for (int k = 0; k < 2; ++k) {
      desc = constraint(id, SW_CONSTRAINT_ORIENTATION);
      desc.flags = flags[k];
      FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "flags");
      desc = constraint(id, SW_CONSTRAINT_ORIENTATION);
      desc.vertex = vertices[k];
      FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "vertex");
    }
  }
  SwConstraintDesc reserved = constraint(SW_ALL_CONSTRAINTS, SW_CONSTRAINT_POSITION);
  FAILS(sw_state_set_constraint(state, &reserved), SW_ERROR_INVALID_ARGUMENT, "id");
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_numbers_of_constraints_are_named(void) {
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  for (uint32_t id = 1; id <= 3; ++id)
    for (int k = 0; k < N_BAD; ++k) {
      for (uint32_t kind = SW_CONSTRAINT_POSITION; kind <= SW_CONSTRAINT_ORIENTATION; ++kind) {
        SwConstraintDesc desc = constraint(id, kind);
        desc.compliance = bad_numbers[k];
        FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "compliance");
        desc.compliance = -1e-300;
        FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "compliance");
      }
      for (int i = 0; i < 3; ++i) { /* on axes that it does not hold, too */
        SwConstraintDesc desc = constraint(id, SW_CONSTRAINT_POSITION);
        desc.position[i] = bad_numbers[k];
        FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "position");
      }
      for (int i = 0; i < 9; ++i) {
        SwConstraintDesc desc = constraint(id, SW_CONSTRAINT_ORIENTATION);
        desc.rotation[i] = bad_numbers[k];
        FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "rotation");
      }
    }
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void matrices_of_constraints_that_do_not_turn_are_refused(void) {
  /* A reflection, a scaling, a shear, and a single entry. */
  const double not_rotations[4][9] = {{1, 0, 0, 0, 1, 0, 0, 0, -1},
                                      {2, 0, 0, 0, 2, 0, 0, 0, 2},
                                      {1, 0.01, 0, 0, 1, 0, 0, 0, 1},
                                      {1, 0, 0, 0, 0, 0, 0, 0, 0}};
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  for (int k = 0; k < 4; ++k) {
    SwConstraintDesc desc = constraint(2, SW_CONSTRAINT_ORIENTATION);
    memcpy(desc.rotation, not_rotations[k], sizeof desc.rotation);
    FAILS(sw_state_set_constraint(state, &desc), SW_ERROR_INVALID_ARGUMENT, "rotation");
  }
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* The header says which of the two targets a kind reads. */
static void the_other_kinds_target_is_not_read(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  SwConstraintDesc place = constraint(1, SW_CONSTRAINT_POSITION), turn = constraint(2, SW_CONSTRAINT_ORIENTATION);
  for (int i = 0; i < 9; ++i) place.rotation[i] = NAN;
  for (int i = 0; i < 3; ++i) turn.position[i] = NAN;
  OK(sw_state_set_constraint(state, &place));
  OK(sw_state_set_constraint(state, &turn));
  OK(sw_state_step(state, 0.1));
  CHECK(reports_of(state).reports[0].met == 1 && reports_of(state).reports[1].met == 1);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void clearing_what_is_not_there_is_told(void) {
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  FAILS(sw_state_clear_constraint(state, 0), SW_ERROR_INVALID_ARGUMENT, "constraint 0");
  FAILS(sw_state_clear_constraint(state, 3), SW_ERROR_INVALID_ARGUMENT, "constraint 3");
  FAILS(sw_state_clear_constraint(state, SW_ALL_CONSTRAINTS - 1), SW_ERROR_INVALID_ARGUMENT, "constraint 4294967294");
  check_same_as_untouched(model, state);
  OK(sw_state_clear_constraint(state, 1));
  FAILS(sw_state_clear_constraint(state, 1), SW_ERROR_INVALID_ARGUMENT, "constraint 1");
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void report_buffers_too_small_are_refused_and_left_alone(void) {
  SwModel *model = ready_model();
  SwState *state = held_state(model);
  Untouched out = canary();
  SwConstraintReport *reports = (SwConstraintReport *)(void *)&out;
  uint32_t count = 77;
  FAILS(sw_state_constraint_report(state, reports, sizeof(SwConstraintReport), 1, &count), SW_ERROR_BUFFER_SIZE, "2");
  FAILS(sw_state_constraint_report(state, reports, sizeof(SwConstraintReport), 0, &count), SW_ERROR_BUFFER_SIZE, "2");
  CHECK(count == 77 && is_untouched(&out));
  check_same_as_untouched(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* Targets at the end of the range of numbers are not met, and do no harm. */
static void absurd_targets_leave_a_finite_and_usable_state(void) {
  const double absurd[4] = {1e12, -1e100, 1e300, -1.7e308};
  SwModel *model = ready_model();
  for (int k = 0; k < 4; ++k) {
    SwState *state = held_state(model);
    SwConstraintDesc desc = constraint(1, SW_CONSTRAINT_POSITION);
    desc.axes = 0;
    for (int i = 0; i < 3; ++i) desc.position[i] = absurd[k];
    OK(sw_state_set_constraint(state, &desc));
    const SwStatus status = sw_state_step(state, 0.1);
    CHECK(status == SW_OK || status == SW_ERROR_NUMERICAL);
    CHECK(isfinite(report_of(state).max_displacement) && isfinite(report_of(state).kinetic_energy));
    CHECK(reports_of(state).reports[0].met == (status != SW_OK)); /* a failed step leaves the last one's report */
    OK(sw_state_clear_constraint(state, SW_ALL_CONSTRAINTS));
    OK(sw_state_step(state, 0.1));
    CHECK(isfinite(report_of(state).max_displacement) && isfinite(report_of(state).kinetic_energy));
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

/* The header: velocities and accelerations are read with SW_FRAME_MOTION_GIVEN only. */
static void rates_of_the_frame_are_not_read_unless_given(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  SwFrameDesc frame;
  sw_frame_desc_init(&frame);
  frame.velocity[0] = frame.acceleration[1] = frame.angular_velocity[2] = frame.angular_acceleration[0] = NAN;
  OK(sw_state_set_frame(state, &frame));
  OK(sw_state_step(state, 0.1));
  CHECK(isfinite(report_of(state).kinetic_energy));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* -------------------------------------------------------------------------------------- methods, loads, equilibria */

static const double one_force[3] = {0.1, 0.2, 0.3};
static const uint32_t one_vertex = 70;

static SwForceDesc good_force(void) {
  SwForceDesc desc;
  sw_force_desc_init(&desc);
  desc.format = SW_FORMAT_F64;
  desc.count = 1;
  desc.forces = one_force;
  desc.vertices = &one_vertex;
  return desc;
}

static SwWindDesc good_wind(void) {
  SwWindDesc desc;
  sw_wind_desc_init(&desc);
  desc.velocity[2] = 2;
  desc.density = 1.2;
  desc.normal_drag = 1;
  return desc;
}

/* A failed call must not have touched the loads either: the next step is that of a state with the good ones. */
static void check_loads_still_act(const SwModel *model, SwState *state) {
  SwState *same = moving_state(model);
  const SwForceDesc force = good_force();
  const SwWindDesc wind = good_wind();
  OK(sw_state_set_forces(same, &force));
  OK(sw_state_set_wind(same, &wind));
  OK(sw_state_step(same, 0.02));
  OK(sw_state_step(state, 0.02));
  const Snapshot expected = snapshot(same);
  CHECK(unchanged(state, &expected));
  sw_state_destroy(same);
}

static SwState *loaded_state(const SwModel *model) {
  SwState *state = moving_state(model);
  const SwForceDesc force = good_force();
  const SwWindDesc wind = good_wind();
  OK(sw_state_set_forces(state, &force));
  OK(sw_state_set_wind(state, &wind));
  return state;
}

static void bad_forces_are_named_and_keep_the_old_ones(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  SwForceDesc desc = good_force();
  FAILS(sw_state_set_forces(NULL, &desc), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_forces(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  for (int k = 0; k < 2; ++k) {
    desc.struct_size = wrong_sizes[k];
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_DESC, "SwForceDesc");
  }
  desc = good_force();
  desc.flags = 2;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "flags");
  const uint32_t formats[3] = {0, 3, UINT32_MAX};
  for (int k = 0; k < 3; ++k) {
    desc = good_force();
    desc.format = formats[k];
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "format");
  }
  desc = good_force();
  desc.forces = NULL;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "forces");
  desc = good_force();
  desc.stride = 23; /* below three doubles */
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "stride");
  desc.stride = UINT64_MAX;
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "forces");
  desc = good_force();
  desc.vertices = NULL; /* then one for every vertex is meant */
  FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "count is 1, but the mesh has 123 vertices");
  const uint32_t outside[2] = {STRIP_VERTICES, UINT32_MAX};
  for (int k = 0; k < 2; ++k) {
    desc = good_force();
    desc.vertices = &outside[k];
    FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, k ? "vertex 4294967295" : "vertex 123");
  }
  for (int k = 0; k < N_BAD; ++k)
    for (int i = 0; i < 3; ++i) {
      double force[3] = {1, 1, 1};
      force[i] = bad_numbers[k];
      desc = good_force();
      desc.forces = force;
      FAILS(sw_state_set_forces(state, &desc), SW_ERROR_INVALID_ARGUMENT, "force 0 on vertex 70");
    }
  check_loads_still_act(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_wind_is_named_and_keeps_the_old_one(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  SwWindDesc desc = good_wind();
  FAILS(sw_state_set_wind(NULL, &desc), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_wind(state, NULL), SW_ERROR_INVALID_ARGUMENT, "desc");
  for (int k = 0; k < 2; ++k) {
    desc.struct_size = wrong_sizes[k];
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_DESC, "SwWindDesc");
  }
  const double wrong[4] = {NAN, HUGE_VAL, -HUGE_VAL, -1};
  for (int k = 0; k < 4; ++k) {
    desc = good_wind(), desc.density = wrong[k];
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "density");
    desc = good_wind(), desc.normal_drag = wrong[k];
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "normal_drag");
    desc = good_wind(), desc.tangential_drag = wrong[k];
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "tangential_drag");
  }
  double local[3 * STRIP_VERTICES] = {0};
  for (int k = 0; k < N_BAD; ++k) {
    for (int i = 0; i < 3; ++i) {
      desc = good_wind(), desc.velocity[i] = bad_numbers[k];
      FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "velocity");
    }
    local[100] = bad_numbers[k];
    desc = good_wind(), desc.local_velocities = local, desc.local_format = SW_FORMAT_F64;
    FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "velocity");
  }
  local[100] = 0;
  desc = good_wind(), desc.local_velocities = local; /* of no format */
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "format");
  desc.local_format = SW_FORMAT_F64, desc.local_stride = 16;
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "stride");
  desc.local_stride = UINT64_MAX / 2;
  FAILS(sw_state_set_wind(state, &desc), SW_ERROR_INVALID_ARGUMENT, "local_velocities");
  check_loads_still_act(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void bad_equilibrium_reports_are_refused_before_anything_moves(void) {
  SwModel *model = ready_model();
  SwState *state = loaded_state(model);
  const Snapshot before = snapshot(state);
  SwEquilibriumReport report;
  sw_equilibrium_report_init(&report);
  FAILS(sw_state_equilibrium(NULL, &report), SW_ERROR_INVALID_ARGUMENT, "state");
  for (int k = 0; k < 2; ++k) {
    report.struct_size = wrong_sizes[k];
    FAILS(sw_state_equilibrium(state, &report), SW_ERROR_INVALID_DESC, "SwEquilibriumReport");
  }
  CHECK(report.iterations == 0 && report.residual == 0 && unchanged(state, &before));
  check_loads_still_act(model, state);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static SwState *free_shell_state(const SwModel *model, uint32_t method) {
  SwState *state = new_state(model, method, 0);
  const double pull[3] = {0, 0, -1};
  OK(sw_state_set_gravity(state, pull));
  OK(sw_state_step(state, 0.02));
  return state;
}

/* Nothing holds the strip: it falls for ever. A failed search leaves it falling. */
static void an_equilibrium_that_does_not_exist_moves_nothing(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwModel *model = NULL;
  OK(sw_model_create(&mesh, NULL, NULL, &model));
  precompute(model, 8, 0);
  for (uint32_t method = SW_METHOD_WARP; method <= SW_METHOD_WARP_VIRTUAL_WORK; ++method) {
    SwState *state = free_shell_state(model, method), *same = free_shell_state(model, method);
    SwEquilibriumReport report;
    sw_equilibrium_report_init(&report);
    FAILS(sw_state_equilibrium(state, &report), SW_ERROR_NUMERICAL, "equilibrium");
    CHECK(report.iterations == 0 && report.residual == 0);
    OK(sw_state_step(state, 0.01));
    OK(sw_state_step(same, 0.01));
    double a[3 * STRIP_VERTICES], b[3 * STRIP_VERTICES];
    OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, a, 0, STRIP_VERTICES));
    OK(sw_state_positions(same, SW_SPACE_WORLD, SW_FORMAT_F64, b, 0, STRIP_VERTICES));
    CHECK(memcmp(a, b, sizeof a) == 0);
    sw_state_destroy(state);
    sw_state_destroy(same);
  }
  sw_model_destroy(model);
}

static void a_nonlinear_shell_says_what_it_does_not_offer(void) {
  SwModel *model = ready_model();
  for (uint32_t method = SW_METHOD_SHELL_IMPLICIT; method <= SW_METHOD_SHELL_EXPLICIT; ++method) {
    SwState *state = new_state(model, method, 0);
    double four[4] = {7, 7, 7, 7}, rates[4] = {7, 7, 7, 7}, differ[4] = {0.1, 0.1, 0.2, 0.1};
    uint32_t count = 77;
    SwDampingDesc damping;
    sw_damping_desc_init(&damping);
    damping.ratios = differ;
    damping.n_ratios = 4;
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_UNSUPPORTED, "damping ratios that differ");
    damping.n_ratios = 2;
    FAILS(sw_state_set_damping(state, &damping), SW_ERROR_INVALID_ARGUMENT, "desc->n_ratios is 2: give no ratios, 1 or 4");
    damping.n_ratios = 1;
    OK(sw_state_set_damping(state, &damping));
    FAILS(sw_state_set_amplitudes(state, four, rates, 4), SW_ERROR_UNSUPPORTED, "amplitudes");
    FAILS(sw_state_amplitudes(state, four, rates, 4, &count), SW_ERROR_UNSUPPORTED, "amplitudes");
    CHECK(four[0] == 7 && rates[0] == 7 && count == 77);
    OK(sw_state_step(state, 1e-5)); /* and is none the worse for it */
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

/* A step far too long for the explicit shell must end in a status, not in numbers that are none. */
static void an_explicit_step_too_long_fails_and_moves_nothing(void) {
  SwModel *model = ready_model();
  SwState *state = new_state(model, SW_METHOD_SHELL_EXPLICIT, 0);
  const double pull[3] = {0.3, 0.2, -1};
  double x[3 * STRIP_VERTICES], y[3 * STRIP_VERTICES];
  SwStatus status = SW_OK;
  OK(sw_state_set_gravity(state, pull));
  for (int k = 0; k < 2000 && status == SW_OK; ++k) {
    OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
    status = sw_state_step(state, 0.5);
  }
  CHECK(status == SW_ERROR_NUMERICAL);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, y, 0, STRIP_VERTICES));
  CHECK(memcmp(x, y, sizeof x) == 0);
  OK(sw_state_reset(state));
  OK(sw_state_step(state, 1e-5));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------ counts and buffers */

static void what_is_no_pose_is_refused(void) {
  const Strip strip = make_strip();
  SwModel *model = ready_model();
  for (uint32_t method = SW_METHOD_WARP; method <= SW_METHOD_SHELL_IMPLICIT; ++method) {
    SwState *state = new_state(model, method, 0);
    double x[3 * STRIP_VERTICES], rate[3 * STRIP_VERTICES], before[3 * STRIP_VERTICES], now[3 * STRIP_VERTICES],
        missed = 7;
    const uint32_t n = STRIP_VERTICES, f64 = SW_FORMAT_F64, world = SW_SPACE_WORLD;
    for (uint32_t i = 0; i < 3 * n; ++i) x[i] = strip.positions[i], rate[i] = 0;
    for (uint32_t i = 3; i < n; ++i) x[3 * i + 2] += 0.01 * strip.positions[3 * i] * strip.positions[3 * i];
    OK(sw_state_set_pose(state, world, f64, x, 0, rate, 0, n, &missed));
    CHECK(missed >= 0 && missed < 0.1);
    missed = 7;
    OK(sw_state_positions(state, world, f64, before, 0, n));
    FAILS(sw_state_set_pose(NULL, world, f64, x, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT, "state");
    FAILS(sw_state_set_pose(state, world, f64, NULL, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT, "positions");
    FAILS(sw_state_set_pose(state, 2, f64, x, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT, "space");
    FAILS(sw_state_set_pose(state, world, 9, x, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT, "format");
    FAILS(sw_state_set_pose(state, world, f64, x, 8, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT,
          "stride of positions");
    FAILS(sw_state_set_pose(state, world, f64, x, 0, rate, 8, n, &missed), SW_ERROR_INVALID_ARGUMENT,
          "stride of velocities");
    FAILS(sw_state_set_pose(state, world, f64, x, 0, NULL, 0, n - 1, &missed), SW_ERROR_INVALID_ARGUMENT, "n_vertices");
    for (uint32_t k = 0; k < N_BAD; ++k) {
      const double good = x[3 * 7 + 1];
      x[3 * 7 + 1] = bad_numbers[k];
      FAILS(sw_state_set_pose(state, world, f64, x, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT,
            "positions[7] is (");
      x[3 * 7 + 1] = good;
      rate[3 * 9] = bad_numbers[k];
      FAILS(sw_state_set_pose(state, world, f64, x, 0, rate, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT,
            "velocities[9] is (");
      rate[3 * 9] = 0;
    }
    x[3 * 7] = 1e300;
    FAILS(sw_state_set_pose(state, world, f64, x, 0, NULL, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT,
          "beyond 1e6 sizes");
    x[3 * 7] = strip.positions[3 * 7];
    rate[3 * 9] = -1e300;
    FAILS(sw_state_set_pose(state, world, f64, x, 0, rate, 0, n, &missed), SW_ERROR_INVALID_ARGUMENT,
          "velocities[9] is (-1e300,");
    OK(sw_state_positions(state, world, f64, now, 0, n));
    CHECK(memcmp(before, now, sizeof now) == 0 && missed == 7);
    OK(sw_state_set_pose(state, world, f64, x, 0, NULL, 0, n, NULL));
    sw_state_destroy(state);
  }
  sw_model_destroy(model);
}

static void impossible_mesh_counts_are_refused(void) {
  const Strip strip = make_strip();
  const uint32_t counts[5][2] = {{0, STRIP_TRIANGLES},
                                 {STRIP_VERTICES, 0},
                                 {UINT32_MAX, STRIP_TRIANGLES},
                                 {STRIP_VERTICES, 1u << 30},
                                 {STRIP_VERTICES, UINT32_MAX}};
  SwModel *model = no_model;
  uint32_t count = 77;
  for (int k = 0; k < 5; ++k) {
    SwMeshDesc mesh = strip_mesh(&strip);
    mesh.n_vertices = counts[k][0];
    mesh.n_triangles = counts[k][1];
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_MESH, "triangles");
    FAILS(sw_mesh_check(&mesh, NULL, sizeof(SwDiagnostic), 0, &count), SW_ERROR_INVALID_MESH, "triangles");
  }
  CHECK(model == no_model && count == 77);
}

static void impossible_mesh_strides_are_refused(void) {
  const Strip strip = make_strip();
  const uint64_t strides[3] = {1, 23, UINT64_MAX}; /* a vertex has 24 bytes */
  SwModel *model = no_model;
  for (int k = 0; k < 3; ++k) {
    SwMeshDesc mesh = strip_mesh(&strip);
    mesh.position_stride = strides[k];
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "positions");
    mesh = strip_mesh(&strip);
    mesh.triangle_stride = strides[k] == 23 ? 11 : strides[k];
    FAILS(sw_model_create(&mesh, NULL, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "triangles");
  }
  CHECK(model == no_model);
}

static void huge_mode_counts_are_clamped(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, UINT32_MAX, 0);
  CHECK(info_of(model).modes == info_of(model).n_unknowns);
  sw_model_destroy(model);
}

static void buffers_too_small_are_refused_and_left_alone(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  Untouched out = canary(), rates = canary();
  double *numbers = (double *)(void *)&out, *more = (double *)(void *)&rates;
  uint32_t count = 77;
  uint64_t size = 0, needed = 0;
  FAILS(sw_model_frequencies(model, numbers, 3, &count), SW_ERROR_BUFFER_SIZE, "4");
  FAILS(sw_model_frequencies(model, numbers, 0, &count), SW_ERROR_BUFFER_SIZE, "4");
  FAILS(sw_state_amplitudes(state, numbers, more, 3, &count), SW_ERROR_BUFFER_SIZE, "4");
  OK(sw_state_save(state, NULL, 0, &needed));
  size = 77;
  FAILS(sw_state_save(state, &out, needed - 1, &size), SW_ERROR_BUFFER_SIZE, "bytes");
  FAILS(sw_state_save(state, &out, 0, &size), SW_ERROR_BUFFER_SIZE, "bytes");
  CHECK(count == 77 && size == 77 && is_untouched(&out) && is_untouched(&rates));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* --------------------------------------------------------------------------------------------- precompute and cancel */

static void a_model_without_modes_says_so(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  SwState *state = no_state;
  Untouched out = canary();
  uint32_t count = 77;
  FAILS(sw_model_frequencies(model, NULL, 0, &count), SW_ERROR_NOT_PRECOMPUTED, "precompute");
  FAILS(sw_model_mode_shape(model, 0, SW_SHAPE_DISPLACEMENT, SW_FORMAT_F32, &out, 0, STRIP_VERTICES),
        SW_ERROR_NOT_PRECOMPUTED, "precompute");
  FAILS(sw_state_create(model, NULL, &state), SW_ERROR_NOT_PRECOMPUTED, "precompute");
  CHECK(count == 77 && state == no_state && is_untouched(&out));
  sw_model_destroy(model);
}

typedef struct {
  uint32_t polls, stop_at, answer; /* the poll at which `answer` is given; UINT32_MAX = never */
  uint32_t phases_seen;
  int bad_fraction;
  const SwModel *model;
  SwStatus inside; /* of a call on the model from inside the callback */
} Poll;

static uint32_t on_progress(void *user, uint32_t phase, double fraction) {
  Poll *poll = user;
  poll->bad_fraction |= !(fraction >= 0 && fraction <= 1) || phase >= SW_PHASE_COUNT;
  poll->phases_seen |= 1u << phase;
  if (poll->model) {
    SwModelInfo info;
    sw_model_info_init(&info);
    poll->inside = sw_model_info(poll->model, &info);
  }
  return poll->polls++ == poll->stop_at ? poll->answer : SW_PROGRESS_CONTINUE;
}

static SwStatus precompute_polling(SwModel *model, Poll *poll) {
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  desc.progress = on_progress;
  desc.progress_user = poll;
  return sw_model_precompute(model, &desc);
}

static void progress_visits_every_phase(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  Poll poll = {0, UINT32_MAX, 0, 0, 0, NULL, SW_OK};
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 4, desc.reduced_fields = 2, desc.reduced_poses = 2;
  desc.progress = on_progress, desc.progress_user = &poll;
  OK(sw_model_precompute(model, &desc));
  CHECK(poll.phases_seen == (1u << SW_PHASE_COUNT) - 1);
  CHECK(!poll.bad_fraction);
  sw_model_destroy(model);
}

static void cancelling_at_any_poll_leaves_a_usable_model(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  Poll whole = {0, UINT32_MAX, 0, 0, 0, NULL, SW_OK};
  SwModel *counted = strip_model(&strip);
  OK(precompute_polling(counted, &whole));
  sw_model_destroy(counted);
  CHECK(whole.polls >= SW_PHASE_COUNT);
  for (uint32_t k = 0; k < whole.polls; ++k) {
    Poll poll = {0, k, SW_PROGRESS_CANCEL, 0, 0, NULL, SW_OK};
    FAILS(precompute_polling(model, &poll), SW_ERROR_CANCELLED, "cancel");
    CHECK(poll.polls == k + 1); /* not asked again */
    CHECK(info_of(model).precomputed == 0);
  }
  precompute(model, 4, 0);
  for (uint32_t k = 0; k < whole.polls; ++k) {
    Poll poll = {0, k, SW_PROGRESS_CANCEL, 0, 0, NULL, SW_OK};
    FAILS(precompute_polling(model, &poll), SW_ERROR_CANCELLED, "cancel");
    CHECK(info_of(model).modes == 4); /* the modes from before */
  }
  sw_state_destroy(moving_state(model));
  sw_model_destroy(model);
}

static void a_callback_that_forgets_its_answer_is_found_out(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  const uint32_t answers[6] = {0, 1, 2, 0x101, 0x300, UINT32_MAX};
  for (int k = 0; k < 6; ++k) {
    Poll poll = {0, 0, 0, 0, 0, NULL, SW_OK};
    poll.answer = answers[k];
    FAILS(precompute_polling(model, &poll), SW_ERROR_INVALID_ARGUMENT, "callback");
    CHECK(info_of(model).precomputed == 0);
  }
  precompute(model, 4, 0);
  sw_model_destroy(model);
}

static void a_model_in_use_by_its_precompute_is_busy(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  Poll poll = {0, UINT32_MAX, 0, 0, 0, NULL, SW_OK};
  poll.model = model;
  OK(precompute_polling(model, &poll));
  CHECK(poll.inside == SW_ERROR_BUSY);
  CHECK(info_of(model).precomputed == 1);
  sw_model_destroy(model);
}

/* ------------------------------------------------------------------------------------------------------ saved states */

typedef struct {
  unsigned char bytes[512];
  uint64_t size;
} Saved;

static Saved save(const SwState *state) {
  Saved saved;
  OK(sw_state_save(state, saved.bytes, sizeof saved.bytes, &saved.size));
  return saved;
}

static void truncated_and_lengthened_states_are_refused(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const Snapshot before = snapshot(state);
  Saved saved = save(state);
  for (uint64_t size = 0; size < saved.size; ++size)
    FAILS(sw_state_load(state, saved.bytes, size), SW_ERROR_INVALID_DATA, "bytes");
  saved.bytes[saved.size] = 0;
  FAILS(sw_state_load(state, saved.bytes, saved.size + 1), SW_ERROR_INVALID_DATA, "bytes");
  FAILS(sw_state_load(state, saved.bytes, UINT64_MAX), SW_ERROR_INVALID_DATA, "bytes");
  CHECK(unchanged(state, &before));
  OK(sw_state_load(state, saved.bytes, saved.size));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void a_flipped_bit_anywhere_in_a_state_is_noticed(void) {
  SwModel *model = ready_model();
  SwState *state = moving_state(model);
  const Snapshot before = snapshot(state);
  Saved saved = save(state);
  for (uint64_t k = 0; k < 8 * saved.size; ++k) {
    saved.bytes[k / 8] ^= (unsigned char)(1u << k % 8);
    FAILS(sw_state_load(state, saved.bytes, saved.size), SW_ERROR_INVALID_DATA, "saved state");
    saved.bytes[k / 8] ^= (unsigned char)(1u << k % 8);
  }
  CHECK(unchanged(state, &before));
  OK(sw_state_load(state, saved.bytes, saved.size));
  CHECK(unchanged(state, &before));
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void states_of_another_model_are_refused(void) {
  Strip strip = make_strip();
  SwModel *model = ready_model(), *longer = NULL, *fewer = ready_model();
  for (int i = 0; i < STRIP_VERTICES; ++i) strip.positions[3 * i] *= 1.001;
  longer = strip_model(&strip);
  precompute(longer, 4, 0);
  precompute(fewer, 3, 0);
  SwState *state = moving_state(model), *foreign = new_state(longer, 0, 0), *short_one = new_state(fewer, 0, 0);
  const Snapshot before = snapshot(state);
  Saved saved = save(foreign);
  FAILS(sw_state_load(state, saved.bytes, saved.size), SW_ERROR_INVALID_DATA, "another model");
  saved = save(short_one);
  FAILS(sw_state_load(state, saved.bytes, saved.size), SW_ERROR_INVALID_DATA, "bytes");
  CHECK(unchanged(state, &before));
  sw_state_destroy(state);
  sw_state_destroy(foreign);
  sw_state_destroy(short_one);
  sw_model_destroy(model);
  sw_model_destroy(longer);
  sw_model_destroy(fewer);
}

/* ---------------------------------------------------------------------------------------------------------- messages */

static void the_message_is_empty_before_and_kept_after_a_failure(void) {
  CHECK(strcmp(sw_last_error_message(), "") == 0); /* the first test of this thread */
  FAILS(sw_state_reset(NULL), SW_ERROR_INVALID_ARGUMENT, "state");
  OK(sw_set_log_callback(NULL, NULL));
  CHECK(strstr(sw_last_error_message(), "state") != NULL); /* a success does not wipe it */
}

int main(void) {
  RUN(the_message_is_empty_before_and_kept_after_a_failure);
  RUN(init_and_destroy_take_null);
  RUN(null_mesh_arguments_are_named);
  RUN(null_support_lists_with_a_length_are_named);
  RUN(null_model_arguments_are_named);
  RUN(null_state_arguments_are_named);
  RUN(wrong_vertex_buffers_are_refused_and_left_alone);
  RUN(wrong_mode_shape_arguments_are_refused);
  RUN(uninitialised_descriptors_are_found_out);
  RUN(unknown_enumerants_and_flags_are_refused);
  RUN(bad_mesh_coordinates_are_located);
  RUN(bad_material_numbers_are_named);
  RUN(bad_sheet_numbers_are_named);
  RUN(a_sheet_without_its_energy_is_refused);
  RUN(bad_maps_are_named);
  RUN(supports_outside_the_mesh_are_named);
  RUN(bad_steps_move_nothing);
  RUN(a_step_whose_result_would_overflow_moves_nothing);
  RUN(bad_loads_and_amplitudes_are_named);
  RUN(bad_damping_is_named);
  RUN(bad_frames_are_named_and_change_nothing);
  RUN(rates_of_the_frame_are_not_read_unless_given);
  RUN(null_constraint_arguments_are_named);
  RUN(unknown_kinds_axes_flags_ids_and_vertices_of_constraints_are_refused);
  RUN(bad_numbers_of_constraints_are_named);
  RUN(matrices_of_constraints_that_do_not_turn_are_refused);
  RUN(the_other_kinds_target_is_not_read);
  RUN(clearing_what_is_not_there_is_told);
  RUN(report_buffers_too_small_are_refused_and_left_alone);
  RUN(absurd_targets_leave_a_finite_and_usable_state);
  RUN(bad_forces_are_named_and_keep_the_old_ones);
  RUN(bad_wind_is_named_and_keeps_the_old_one);
  RUN(bad_equilibrium_reports_are_refused_before_anything_moves);
  RUN(an_equilibrium_that_does_not_exist_moves_nothing);
  RUN(a_nonlinear_shell_says_what_it_does_not_offer);
  RUN(an_explicit_step_too_long_fails_and_moves_nothing);
  RUN(what_is_no_pose_is_refused);
  RUN(impossible_mesh_counts_are_refused);
  RUN(impossible_mesh_strides_are_refused);
  RUN(huge_mode_counts_are_clamped);
  RUN(buffers_too_small_are_refused_and_left_alone);
  RUN(a_model_without_modes_says_so);
  RUN(progress_visits_every_phase);
  RUN(cancelling_at_any_poll_leaves_a_usable_model);
  RUN(a_callback_that_forgets_its_answer_is_found_out);
  RUN(a_model_in_use_by_its_precompute_is_busy);
  RUN(truncated_and_lengthened_states_are_refused);
  RUN(a_flipped_bit_anywhere_in_a_state_is_noticed);
  RUN(states_of_another_model_are_refused);
  return report_failures();
}

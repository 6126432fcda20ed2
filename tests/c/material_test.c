/* Materials through the C interface: a sheet in engineering units against closed forms, in two systems of units. */
#include "test_support.h"

/* f = 1.8751^2 / (2 pi L^2) sqrt(E h^2 / (12 rho)) of a clamped beam, without Poisson's ratio. */
static double beam_hertz(const SwMaterialDesc *sheet, double length) {
  const double root = 1.8751040687;
  return root * root / (2 * 3.14159265358979323846 * length * length) *
         sqrt(sheet->young * sheet->thickness * sheet->thickness / (12 * sheet->volume_density));
}

static SwMaterialDesc aluminium(double poisson) {
  SwMaterialDesc sheet;
  sw_material_desc_init(&sheet);
  sheet.energy = SW_ENERGY_KOITER;
  sheet.young = 7e10;
  sheet.poisson = poisson;
  sheet.thickness = 1e-3;
  sheet.volume_density = 2700;
  return sheet;
}

static SwMaterialDesc stiffnesses(double area, double length, double bend) {
  SwMaterialDesc material;
  sw_material_desc_init(&material);
  material.k_area = area;
  material.k_length = length;
  material.k_bend = bend;
  return material;
}

/* The strip of test_support.h, 4 m long unless scaled, clamped at its end. */
static SwModel *strip_of(const SwMaterialDesc *material, double scale) {
  Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwSupportDesc supports;
  SwModel *model = NULL;
  for (int k = 0; k < 3 * STRIP_VERTICES; ++k) strip.positions[k] *= scale;
  sw_support_desc_init(&supports);
  supports.clamped = strip.held;
  supports.n_clamped = STRIP_ROWS;
  OK(sw_model_create(&mesh, material, &supports, &model));
  return model;
}

static double slowest(const SwModel *model) {
  double hertz[8];
  uint32_t count;
  OK(sw_model_frequencies(model, hertz, 8, &count));
  return hertz[0];
}

static void a_clamped_strip_swings_as_a_beam_does(void) {
  const SwMaterialDesc sheet = aluminium(0);
  SwModel *model = strip_of(&sheet, 1);
  precompute(model, 4, SW_PRECISION_F64);
  CHECK(info_of(model).n_fixed == STRIP_ROWS); /* the clamp is exact: no neighbour is held */
  /* 40 elements along the beam: docs/evidence/koiter.md has -0.4 % at 16. */
  CHECK_NEAR(slowest(model) / beam_hertz(&sheet, STRIP_LENGTH), 1, 4e-3);
  sw_model_destroy(model);
}

/* w = rho g A L^4 / (8 E I) of a clamped beam under its weight, which a sag of a twentieth of its length hardly leaves: it stiffens by (w/L)^2. Of much less, rounding of its stretching pulls as its bending does. */
static void a_sag_and_a_frequency_give_the_factor_that_a_beam_would(void) {
  const SwMaterialDesc sheet = aluminium(0);
  const double gravity[3] = {0, 0, -9.81}, h = sheet.thickness, length = STRIP_LENGTH;
  const double falls = 9.81 * sheet.volume_density * h * pow(length, 4) / (8 * sheet.young * h * h * h / 12), sag = length / 20;
  double factor = 0, before[2];
  SwModel *model = strip_of(&sheet, 1);
  SwStateReport report;
  precompute(model, 4, SW_PRECISION_F64);
  SwState *state = new_state(model, SW_METHOD_SHELL_IMPLICIT, 0);
  OK(sw_state_set_gravity(state, gravity));
  OK(sw_state_set_sag(state, sag, 1e-4, &factor));
  CHECK_NEAR(factor / (falls / sag), 1, 8e-3); /* twice what the frequency below has, as its square goes with the stiffness */
  sw_state_report_init(&report);
  OK(sw_state_report(state, &report));
  CHECK_NEAR(report.max_displacement / sag, 1, 1e-4);
  before[0] = factor;
  OK(sw_state_set_sag(state, sag, 0, NULL)); /* a hundredth, where it is already */
  OK(sw_state_set_frequency(state, 2 * beam_hertz(&sheet, length), &factor));
  CHECK_NEAR(factor, 4, 8e-3 * 4);
  OK(sw_state_set_frequency(state, 1, NULL));
  before[1] = factor = -7;
  FAILS(sw_state_set_sag(NULL, 1, 0, &factor), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_frequency(NULL, 1, &factor), SW_ERROR_INVALID_ARGUMENT, "state");
  FAILS(sw_state_set_sag(state, -1, 0, &factor), SW_ERROR_INVALID_ARGUMENT, "length is -1");
  FAILS(sw_state_set_sag(state, NAN, 0, &factor), SW_ERROR_INVALID_ARGUMENT, "length is NaN");
  FAILS(sw_state_set_sag(state, 1, -1, &factor), SW_ERROR_INVALID_ARGUMENT, "tolerance is -1");
  FAILS(sw_state_set_sag(state, 1e12 * length, 0, &factor), SW_ERROR_INVALID_ARGUMENT, "no stiffness was found");
  FAILS(sw_state_set_frequency(state, 0, &factor), SW_ERROR_INVALID_ARGUMENT, "hertz is 0");
  FAILS(sw_state_set_frequency(state, 1e12, &factor), SW_ERROR_INVALID_ARGUMENT, "factor is");
  CHECK(factor == before[1] && before[0] > 0);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void the_unit_of_length_does_not_matter(void) {
  const SwMaterialDesc metres = aluminium(0.3);
  SwMaterialDesc centimetres = metres; /* kg / (cm s^2), kg / cm^3 */
  centimetres.young *= 1e-2;
  centimetres.thickness *= 1e2;
  centimetres.volume_density *= 1e-6;
  SwModel *here = strip_of(&metres, 1), *there = strip_of(&centimetres, 100);
  precompute(here, 4, SW_PRECISION_F64);
  precompute(there, 4, SW_PRECISION_F64);
  CHECK_NEAR(slowest(there) / slowest(here), 1, 1e-8); /* two eigenvalue searches, to 1e-10 each */
  sw_model_destroy(here);
  sw_model_destroy(there);
}

static void a_saved_model_keeps_its_sheet(void) {
  const SwMaterialDesc sheet = aluminium(0.3);
  const double gravity[3] = {0, 0, -9.81};
  double ends[2][3];
  uint64_t size = 0;
  SwModel *models[2] = {strip_of(&sheet, 0.1), NULL};
  precompute(models[0], 4, SW_PRECISION_F64);
  OK(sw_model_save(models[0], NULL, 0, &size));
  void *bytes = malloc(size);
  OK(sw_model_save(models[0], bytes, size, &size));
  OK(sw_model_load(bytes, size, &models[1]));
  free(bytes);
  for (int k = 0; k < 2; ++k) {
    /* The full shell takes its energy from the sheet alone. */
    SwState *state = new_state(models[k], SW_METHOD_SHELL_IMPLICIT, SW_INTEGRATOR_IMPLICIT_EULER);
    const uint32_t end = STRIP_VERTICES - 2;
    OK(sw_state_set_gravity(state, gravity));
    for (int step = 0; step < 4; ++step) OK(sw_state_step(state, 0.01));
    OK(sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, &end, 1, ends[k], 0));
    sw_state_destroy(state);
    sw_model_destroy(models[k]);
  }
  CHECK(ends[0][2] < 0 && memcmp(ends[0], ends[1], sizeof ends[0]) == 0);
}

static SwModel *strip_of_grain(const double *directions, uint32_t n, double young, double young_across, double shear) {
  SwMaterialDesc sheet = aluminium(0);
  sheet.young = young;
  sheet.young_across = young_across;
  sheet.shear = shear;
  sheet.directions = directions;
  sheet.direction_format = SW_FORMAT_F64;
  sheet.n_directions = n;
  SwModel *model = strip_of(&sheet, 1);
  precompute(model, 2, SW_PRECISION_F64);
  return model;
}

/* A beam bends by the modulus along it: E1 where the grain runs along, E2 where it runs across; by one direction or one a triangle. */
static void a_strip_swings_by_the_modulus_along_it(void) {
  static double across[3 * STRIP_TRIANGLES];
  const double along[3] = {-2, 0, 0}, y[3] = {0, 1, 0};
  for (int t = 0; t < STRIP_TRIANGLES; ++t) across[3 * t + 1] = t % 2 ? 1 : -3;
  SwModel *models[3] = {strip_of_grain(along, 1, 7e10, 5e9, 0), strip_of_grain(y, 1, 5e9, 7e10, 0), strip_of_grain(across, STRIP_TRIANGLES, 5e9, 7e10, 0)};
  const SwMaterialDesc sheet = aluminium(0);
  for (int k = 0; k < 3; ++k) {
    /* As in a_clamped_strip_swings_as_a_beam_does. */
    CHECK_NEAR(slowest(models[k]) / beam_hertz(&sheet, STRIP_LENGTH), 1, 5e-3);
    sw_model_destroy(models[k]);
  }
  SwModel *equal = strip_of_grain(along, 1, 7e10, 7e10, 3.5e10), *plain = strip_of(&sheet, 1);
  precompute(plain, 2, SW_PRECISION_F64);
  CHECK(slowest(equal) == slowest(plain));
  sw_model_destroy(equal);
  sw_model_destroy(plain);
}

static void what_is_no_grain_is_refused_by_name(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double along[3] = {1, 0, 0}, upright[3] = {0, 0, 1};
  SwModel *model = NULL;
  SwMaterialDesc sheet = aluminium(0.3);
  sheet.young_across = 7e9;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "n_directions is 0");
  sheet.n_directions = 1;
  sheet.direction_format = SW_FORMAT_F64;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "directions");
  sheet.directions = upright;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "at triangle 0 is across");
  sheet.directions = along;
  sheet.direction_format = 0;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "format of material->directions");
  sheet.direction_format = SW_FORMAT_F64;
  sheet.direction_stride = 7;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "stride");
  sheet.direction_stride = 0;
  sheet.n_directions = 2;
  const double two[6] = {1, 0, 0, 1, 0, 0};
  sheet.directions = two;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "2 directions");
  sheet.n_directions = 1;
  sheet.young_across = 7e11; /* ten times young: 0.3^2 < 0.1 < 0.4^2 */
  sheet.poisson = 0.4;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "poisson is 0.4");
  sheet.young_across = -1;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "young_across is -1");
  sheet.young_across = 0;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "young_across is 0");
  sheet.young_across = 7e9;
  sheet.shear = NAN;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "shear is NaN");
  SwMaterialDesc paper = stiffnesses(1, 1, 1);
  paper.young_across = 1;
  FAILS(sw_model_create(&mesh, &paper, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "SW_ENERGY_KOITER");
  CHECK(model == NULL);
}

static void the_polynomial_shell_takes_the_energy(void) {
  const SwMaterialDesc sheet = aluminium(0.3);
  SwModel *model = strip_of(&sheet, 0.1);
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  desc.reduced_fields = 4;
  desc.reduced_flags = SW_REDUCED_UNTRAINED;
  OK(sw_model_precompute(model, &desc));
  OK(sw_model_offers(model, SW_METHOD_REDUCED_SHELL));
  OK(sw_model_offers(model, SW_METHOD_POLYNOMIAL_SHELL));
  sw_model_destroy(model);
}

static double slowest_of(SwMaterialDesc material) {
  SwModel *model = strip_of(&material, 1);
  precompute(model, 4, SW_PRECISION_F64);
  const double hertz = slowest(model);
  sw_model_destroy(model);
  return hertz;
}

static uint32_t zero_modes_of(SwMaterialDesc material) {
  SwModel *model = strip_of(&material, 1);
  precompute(model, 4, SW_PRECISION_F64);
  const uint32_t zero = info_of(model).zero_modes;
  sw_model_destroy(model);
  return zero;
}

static void none_given_are_the_defaults(void) {
  CHECK(slowest_of(stiffnesses(0, 0, 0)) == slowest_of(stiffnesses(1e4, 1e4, 1)));
}

/* The nearly free stiffness tends to the zero one, which the default is far from. */
static void a_stiffness_of_zero_beside_others_is_zero(void) {
  const double without = slowest_of(stiffnesses(0, 1e4, 1e4)), nearly = slowest_of(stiffnesses(1e-9, 1e4, 1e4));
  CHECK(without > 0);
  CHECK_NEAR(nearly / without, 1, 1e-6);
  CHECK(slowest_of(stiffnesses(1e4, 1e4, 1e4)) / without > 1.01);
  CHECK(zero_modes_of(stiffnesses(1e4, 1e4, 0)) == 4); /* out of its plane nothing holds it */
  CHECK(zero_modes_of(stiffnesses(1e4, 1e4, 1)) == 0);
}

static void presets_are_sheets_in_any_unit_of_length(void) {
  const uint32_t count = sw_preset_count();
  uint32_t found = 0;
  CHECK(count >= 7);
  for (uint32_t i = 0; i < count; ++i) {
    SwMaterialDesc metres, centimetres;
    sw_material_desc_init(&metres);
    sw_material_desc_init(&centimetres);
    CHECK(strlen(sw_preset_name(i)) > 0 && strlen(sw_preset_label(i)) > 0 && strlen(sw_preset_source(i)) > 0);
    OK(sw_preset_material(i, 1, &metres));
    OK(sw_preset_material(i, 0.01, &centimetres));
    CHECK(metres.energy == SW_ENERGY_KOITER && metres.struct_size == sizeof metres);
    SwModel *here = strip_of(&metres, 0.1), *there = strip_of(&centimetres, 10);
    precompute(here, 2, SW_PRECISION_F64);
    precompute(there, 2, SW_PRECISION_F64);
    CHECK_NEAR(slowest(there) / slowest(here), 1, 1e-8); /* two eigenvalue searches, to 1e-10 each */
    sw_model_destroy(here);
    sw_model_destroy(there);
    if (strcmp(sw_preset_name(i), "aluminium") == 0) {
      ++found;
      CHECK(metres.young == 6.9e10 && metres.poisson == 0.33 && metres.thickness == 1e-3 && metres.volume_density == 2710);
    }
  }
  CHECK(found == 1);
}

static void what_is_no_preset_is_refused(void) {
  SwMaterialDesc material, before;
  sw_material_desc_init(&material);
  before = material;
  CHECK(strcmp(sw_preset_name(sw_preset_count()), "") == 0 && strcmp(sw_preset_label(UINT32_MAX), "") == 0);
  CHECK(strcmp(sw_preset_source(UINT32_MAX), "") == 0);
  FAILS(sw_preset_material(sw_preset_count(), 1, &material), SW_ERROR_INVALID_ARGUMENT, "index");
  const double bad[5] = {0, -1, NAN, HUGE_VAL, 1e-200};
  for (int k = 0; k < 5; ++k) FAILS(sw_preset_material(0, bad[k], &material), SW_ERROR_INVALID_ARGUMENT, k < 4 ? "metres_per_unit" : "volume_density");
  FAILS(sw_preset_material(0, 1, NULL), SW_ERROR_INVALID_ARGUMENT, "material");
  CHECK(memcmp(&material, &before, sizeof material) == 0);
  material.struct_size = 7;
  FAILS(sw_preset_material(0, 1, &material), SW_ERROR_INVALID_DESC, "struct_size");
}

typedef struct { int count; char last[512]; } Heard;

static void hear(void *user, uint32_t level, const char *message) {
  Heard *heard = user;
  if (level != SW_LOG_WARNING) return;
  ++heard->count;
  snprintf(heard->last, sizeof heard->last, "%s", message);
}

/* A strip of four units, of a thickness in metres, by a unit that is told. */
static SwModelInfo weighed(SwMaterialDesc sheet, double thickness, double metres_per_unit, Heard *heard) {
  memset(heard, 0, sizeof *heard);
  sheet.thickness = thickness;
  sheet.metres_per_unit = metres_per_unit;
  OK(sw_set_log_callback(hear, heard));
  SwModel *model = strip_of(&sheet, 1);
  precompute(model, 4, SW_PRECISION_F64);
  OK(sw_set_log_callback(NULL, NULL));
  const SwModelInfo info = info_of(model);
  sw_model_destroy(model);
  return info;
}

static void a_wrong_unit_shows_in_what_the_weight_does(void) {
  const SwMaterialDesc sheet = aluminium(0);
  Heard heard;
  SwModelInfo info = weighed(sheet, 1e-2, 0, &heard); /* not told */
  CHECK(heard.count == 0 && info.metres_per_unit == 0 && info.earth_gravity == 0 && info.weight_moves == 0 && info.weight_turns == 0);
  /* A plate of 4 m and 1 cm: the end of a clamped beam sinks by w L^4/(8 D) and turns by w L^3/(6 D). Four modes miss 1 %. */
  info = weighed(sheet, 1e-2, 1, &heard);
  const double ratio = 9.80665 * sheet.volume_density * 12 / (sheet.young * 1e-4), size = sqrt(16 + info.total_area * info.total_area / 16);
  CHECK(heard.count == 0 && info.metres_per_unit == 1 && info.earth_gravity == 9.80665);
  CHECK_NEAR(info.weight_moves * size / (ratio * 256 / 8), 1, 0.02);
  CHECK_NEAR(info.weight_turns / (ratio * 64 / 6), 1, 0.02);
  /* A mesh in millimetres beside constants in metres hangs under 1000 times the gravity. */
  info = weighed(sheet, 1e-2, 1e-3, &heard);
  CHECK(heard.count == 1 && strstr(heard.last, "softer than a film"));
  CHECK_NEAR(info.earth_gravity, 9806.65, 1e-9);
  CHECK_NEAR(info.weight_moves * size / (1000 * ratio * 256 / 8), 1, 0.02);
  /* As thick as long, and stiffer than diamond, as the strip bends in its plane as well. */
  SwMaterialDesc stiff = sheet;
  stiff.young = 7e13;
  info = weighed(stiff, 4, 1, &heard);
  CHECK(heard.count == 2 && strstr(heard.last, "are lengths in metres") && strstr(heard.last, "young is in Pa") && info.weight_moves < 1e-5);
  /* (E h^2/(12 rho g))^(1/3), the length within which it bends: 1.3 mm. */
  SwMaterialDesc limp = sheet;
  limp.young = 7e6;
  info = weighed(limp, 1e-5, 1, &heard);
  CHECK(heard.count == 1 && strstr(heard.last, "softer than a film") && info.weight_turns > 6);
  /* Household foil, 16 micrometres: 4 cm. */
  info = weighed(sheet, 1.6e-5, 1, &heard);
  CHECK(heard.count == 0 && info.weight_turns > 6);
}

/* The strip rolled up to half a circle: what is beyond a tenth of its radius, 1.27, is warned of. */
static void a_sheet_too_thick_for_its_curvature_is_warned_of(void) {
  const double radius = STRIP_LENGTH / 3.14159265358979323846;
  Strip strip = make_strip();
  Heard heard;
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    const double angle = strip.positions[3 * v] / radius;
    strip.positions[3 * v] = radius * sin(angle);
    strip.positions[3 * v + 2] = radius * (1 - cos(angle));
  }
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double parts[2] = {0.09, 0.11};
  for (int k = 0; k < 2; ++k) {
    SwMaterialDesc sheet = aluminium(0);
    SwModel *model = NULL;
    sheet.thickness = parts[k] * radius;
    memset(&heard, 0, sizeof heard);
    OK(sw_set_log_callback(hear, &heard));
    OK(sw_model_create(&mesh, &sheet, NULL, &model));
    OK(sw_set_log_callback(NULL, NULL));
    CHECK(heard.count == k && (k == 0 || strstr(heard.last, "thicker than a tenth of its radius of curvature")));
    sw_model_destroy(model);
  }
}

/* Beyond a tenth of the strip's 4 m, as where thickness and Poisson's ratio change places. */
static void a_sheet_too_thick_for_its_size_is_warned_of(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double thicknesses[2] = {0.35, 0.45};
  for (int k = 0; k < 2; ++k) {
    SwMaterialDesc sheet = aluminium(0);
    SwModel *model = NULL;
    Heard heard;
    sheet.thickness = thicknesses[k];
    memset(&heard, 0, sizeof heard);
    OK(sw_set_log_callback(hear, &heard));
    OK(sw_model_create(&mesh, &sheet, NULL, &model));
    OK(sw_set_log_callback(NULL, NULL));
    CHECK(heard.count == k && (k == 0 || strstr(heard.last, "of the mesh's size")));
    sw_model_destroy(model);
  }
}

/* One entry of an array that is no number, is told by its place. */
static void entries_that_are_no_numbers_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double bad[3] = {NAN, HUGE_VAL, -HUGE_VAL};
  double along[3 * STRIP_TRIANGLES], rest[3 * STRIP_VERTICES];
  SwModel *model = NULL;
  for (int t = 0; t < STRIP_TRIANGLES; ++t) along[3 * t] = 1, along[3 * t + 1] = along[3 * t + 2] = 0;
  for (int k = 0; k < 3; ++k) {
    SwMaterialDesc sheet = aluminium(0.3);
    sheet.young_across = 7e9;
    sheet.directions = along, sheet.direction_format = SW_FORMAT_F64, sheet.n_directions = STRIP_TRIANGLES;
    along[3 * 7 + 1] = bad[k];
    FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "at triangle 7 is none");
    along[3 * 7 + 1] = 0;
    sheet = aluminium(0.3);
    memcpy(rest, strip.positions, sizeof rest);
    rest[3 * 9 + 2] = bad[k];
    sheet.rest_positions = rest, sheet.rest_format = SW_FORMAT_F64;
    FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_MESH, "the rest shape: vertex 9");
  }
  CHECK(model == NULL);
}

static void a_unit_that_is_none_is_refused(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  const double bad[5] = {-1, NAN, HUGE_VAL, 1e-320, -0.01};
  SwModel *model = NULL;
  for (int k = 0; k < 5; ++k) {
    SwMaterialDesc material = aluminium(0.3);
    material.metres_per_unit = bad[k];
    FAILS(sw_model_create(&mesh, &material, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "metres_per_unit");
  }
  CHECK(model == NULL);
}

/* A sheet by maps of its thickness on vertices and its modulus on triangles, in two formats and with strides. */
static SwModel *mapped_strip(double thin, double thick) {
  static float thickness[2 * STRIP_VERTICES];
  static double young[STRIP_TRIANGLES];
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwMaterialDesc sheet = aluminium(0);
  SwMaterialMap maps[2];
  SwSupportDesc supports;
  SwModel *model = NULL;
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    thickness[2 * v] = (float)(strip.positions[3 * v] < STRIP_LENGTH / 2 ? thick : thin);
    thickness[2 * v + 1] = NAN; /* not ours */
  }
  for (int t = 0; t < STRIP_TRIANGLES; ++t) young[t] = sheet.young;
  for (int k = 0; k < 2; ++k) sw_material_map_init(&maps[k]);
  maps[0].quantity = SW_MAP_THICKNESS;
  maps[0].on = SW_MAP_ON_VERTICES;
  maps[0].format = SW_FORMAT_F32;
  maps[0].values = thickness;
  maps[0].stride = 2 * sizeof(float);
  maps[0].count = STRIP_VERTICES;
  maps[1].quantity = SW_MAP_YOUNG;
  maps[1].on = SW_MAP_ON_TRIANGLES;
  maps[1].format = SW_FORMAT_F64;
  maps[1].values = young;
  maps[1].count = STRIP_TRIANGLES;
  sheet.young = sheet.thickness = 0; /* the maps have them */
  sheet.maps = maps;
  sheet.n_maps = 2;
  sw_support_desc_init(&supports);
  supports.clamped = strip.held;
  supports.n_clamped = STRIP_ROWS;
  OK(sw_model_create(&mesh, &sheet, &supports, &model));
  precompute(model, 4, SW_PRECISION_F64);
  return model;
}

static void maps_of_equal_values_are_the_constant(void) {
  const SwMaterialDesc sheet = aluminium(0);
  SwMaterialDesc same = sheet;
  same.thickness = (float)sheet.thickness; /* the map has 32 bits */
  SwModel *uniform = strip_of(&same, 1), *mapped = mapped_strip(sheet.thickness, sheet.thickness);
  precompute(uniform, 4, SW_PRECISION_F64);
  CHECK(slowest(uniform) == slowest(mapped));
  sw_model_destroy(uniform);
  sw_model_destroy(mapped);
}

static void a_thin_end_makes_the_beam_faster(void) {
  SwModel *uniform = mapped_strip(1e-3, 1e-3), *mapped = mapped_strip(5e-4, 1e-3);
  CHECK(slowest(mapped) > 1.1 * slowest(uniform)); /* less mass where it swings, as stiff where it bends */
  sw_model_destroy(uniform);
  sw_model_destroy(mapped);
}

static int warnings = 0;

static void count_warning(void *user, uint32_t level, const char *message) {
  (void)user;
  warnings += level == SW_LOG_WARNING && strstr(message, "k_length is 0") != NULL;
}

static void no_resistance_to_stretching_is_warned_of(void) {
  const SwMaterialDesc material = stiffnesses(1e4, 0, 1), usual = stiffnesses(1e4, 1e4, 0);
  sw_set_log_callback(count_warning, NULL);
  sw_model_destroy(strip_of(&usual, 1));
  CHECK(warnings == 0);
  sw_model_destroy(strip_of(&material, 1));
  CHECK(warnings == 1);
  sw_set_log_callback(NULL, NULL);
}

/* The strip's column of edges at mid length, in the order of the mesh's vertices. */
static void middle_edges(uint32_t (*edges)[2]) {
  for (int j = 0; j + 1 < STRIP_ROWS; ++j) {
    edges[j][0] = strip_vertex(STRIP_COLUMNS / 2, j);
    edges[j][1] = strip_vertex(STRIP_COLUMNS / 2, j + 1);
  }
}

static SwModel *folded(const uint32_t (*edges)[2], const double *factors, const double *angles, const double *rest) {
  SwMaterialDesc sheet = aluminium(0.3);
  sheet.creases = &edges[0][0];
  sheet.n_creases = edges ? STRIP_ROWS - 1 : 0;
  sheet.crease_factors = factors;
  sheet.crease_angles = angles;
  sheet.rest_positions = rest;
  sheet.rest_format = SW_FORMAT_F64;
  return strip_of(&sheet, 1);
}

/* A card whose crease rests at a right angle rests there: the free half stands across the clamped one. */
static void a_creased_strip_rests_folded(void) {
  uint32_t edges[STRIP_ROWS - 1][2];
  const double angles[STRIP_ROWS - 1] = {1.5707963267948966, 1.5707963267948966};
  double x[3 * STRIP_VERTICES];
  middle_edges(edges);
  SwModel *model = folded((const uint32_t(*)[2])edges, NULL, angles, NULL);
  precompute(model, 6, SW_PRECISION_F64);
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  const double *fold = &x[3 * strip_vertex(STRIP_COLUMNS / 2, 1)], *end = &x[3 * strip_vertex(STRIP_COLUMNS - 1, 1)];
  const double along = end[0] - fold[0], up = end[2] - fold[2], half = STRIP_LENGTH / 2;
  CHECK_NEAR(fabs(up) / half, 1, 2e-3);
  CHECK_NEAR(along / half, 0, 2e-2); /* the sheet beside the fold takes part of the angle only where it is loaded: nowhere */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* The rest shape is the strip on a cylinder: the flat strip curls to it. */
static void a_flat_strip_curls_to_its_rest_shape(void) {
  const Strip strip = make_strip();
  double rest[3 * STRIP_VERTICES], x[3 * STRIP_VERTICES], worst = 0;
  const double radius = 4;
  for (int v = 0; v < STRIP_VERTICES; ++v) {
    const double angle = strip.positions[3 * v] / radius;
    rest[3 * v] = radius * sin(angle);
    rest[3 * v + 1] = strip.positions[3 * v + 1];
    rest[3 * v + 2] = radius * (1 - cos(angle));
  }
  SwModel *model = folded(NULL, NULL, NULL, rest);
  precompute(model, 6, SW_PRECISION_F64);
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  const double *tip = &x[3 * strip_vertex(STRIP_COLUMNS - 1, 1)];
  /* Clamped flat at its root, where the rest shape has the slope of half an edge: of a length of 4, 0.05 / 4 rad. */
  worst = hypot(tip[0] - radius * sin(1), tip[2] - radius * (1 - cos(1)));
  CHECK(worst < 0.1);
  CHECK(tip[2] > 1.5); /* of 1.84 */
  sw_state_destroy(state);
  sw_model_destroy(model);
}

/* Pushed down by a force and let go, a strip whose crease yields stays folded, in a copy and after load too; another method refuses. */
static void a_crease_that_yields_stays_folded(void) {
  uint32_t edges[STRIP_ROWS - 1][2];
  const double factors[STRIP_ROWS - 1] = {0.02, 0.02}, yields[STRIP_ROWS - 1] = {0.02, 0.02};
  middle_edges(edges);
  SwMaterialDesc sheet = aluminium(0.3);
  sheet.creases = &edges[0][0];
  sheet.n_creases = STRIP_ROWS - 1;
  sheet.crease_factors = factors;
  sheet.crease_yields = yields;
  SwModel *model = strip_of(&sheet, 1);
  precompute(model, 6, SW_PRECISION_F64);
  SwState *state = NULL, *copy = NULL;
  SwStateDesc by_modes;
  sw_state_desc_init(&by_modes);
  FAILS(sw_state_create(model, &by_modes, &state), SW_ERROR_UNSUPPORTED, "creases cannot yield");
  state = new_state(model, SW_METHOD_SHELL_IMPLICIT, SW_INTEGRATOR_IMPLICIT_EULER);
  SwConstraintDesc down;
  sw_constraint_desc_init(&down);
  down.kind = SW_CONSTRAINT_POSITION;
  down.vertex = strip_vertex(STRIP_COLUMNS - 1, 1);
  down.position[0] = STRIP_LENGTH * 0.9;
  down.position[1] = make_strip().positions[3 * down.vertex + 1];
  down.position[2] = -0.2 * STRIP_LENGTH;
  OK(sw_state_set_constraint(state, &down));
  OK(sw_state_equilibrium(state, NULL));
  OK(sw_state_clear_constraint(state, SW_ALL_CONSTRAINTS));
  OK(sw_state_equilibrium(state, NULL));
  double x[3 * STRIP_VERTICES], again[3 * STRIP_VERTICES];
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  CHECK(x[3 * down.vertex + 2] < -0.05 * STRIP_LENGTH);
  uint64_t size = 0;
  OK(sw_state_save(state, NULL, 0, &size));
  char *bytes = malloc(size);
  OK(sw_state_save(state, bytes, size, &size));
  copy = new_state(model, SW_METHOD_SHELL_IMPLICIT, SW_INTEGRATOR_IMPLICIT_EULER);
  OK(sw_state_load(copy, bytes, size));
  OK(sw_state_equilibrium(copy, NULL));
  OK(sw_state_positions(copy, SW_SPACE_WORLD, SW_FORMAT_F64, again, 0, STRIP_VERTICES));
  CHECK_NEAR(again[3 * down.vertex + 2], x[3 * down.vertex + 2], 1e-9 * STRIP_LENGTH);
  OK(sw_state_reset(state));
  OK(sw_state_equilibrium(state, NULL));
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, x, 0, STRIP_VERTICES));
  CHECK_NEAR(x[3 * down.vertex + 2], 0, 1e-9 * STRIP_LENGTH);
  free(bytes);
  sw_state_destroy(copy);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void creases_of_one_are_none_and_bad_ones_are_named(void) {
  uint32_t edges[STRIP_ROWS - 1][2];
  const double ones[] = {1, 1}, none[] = {SW_CREASE_ANGLE_OF_MESH, SW_CREASE_ANGLE_OF_MESH};
  middle_edges(edges);
  SwModel *plain = folded(NULL, NULL, NULL, NULL), *creased = folded((const uint32_t(*)[2])edges, ones, none, NULL);
  precompute(plain, 4, SW_PRECISION_F64);
  precompute(creased, 4, SW_PRECISION_F64);
  CHECK(slowest(plain) == slowest(creased));
  sw_model_destroy(plain);
  sw_model_destroy(creased);

  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwMaterialDesc sheet = aluminium(0.3);
  SwModel *model = NULL;
  sheet.creases = &edges[0][0];
  sheet.n_creases = STRIP_ROWS - 1;
  double factors[] = {1, -2}, angles[] = {0.5, 4};
  sheet.crease_factors = factors;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "factor of crease 1");
  factors[1] = NAN;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "factor of crease 1");
  sheet.crease_factors = NULL;
  sheet.crease_angles = angles;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "rest angle of crease 1");
  sheet.crease_angles = NULL;
  double yields[] = {0.5, 0};
  sheet.crease_yields = yields;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "yield angle of crease 1");
  yields[1] = NAN;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "yield angle of crease 1");
  sheet.crease_yields = NULL;
  edges[1][0] = edges[0][1];
  edges[1][1] = edges[0][0];
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "same edge");
  edges[1][1] = 999;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "crease 1 is at the edge");
  edges[1][0] = 0;
  edges[1][1] = strip_vertex(5, 0);
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "does not have");
  edges[1][1] = strip_vertex(0, 1); /* on the boundary */
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "only one triangle");
  sheet.creases = NULL;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->creases");
  sheet.n_creases = 0;
  double rest[3 * STRIP_VERTICES] = {0};
  sheet.rest_positions = rest;
  sheet.rest_format = SW_FORMAT_F64;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_MESH, "rest shape");
  sheet.rest_format = 0;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "rest_positions");
  CHECK(model == NULL);
}

/* A free strip whose edges across all are 1 % longer without stress is as much wider at rest; and as a map of growth it is 1 % larger. */
static void a_strip_rests_at_its_own_lengths(void) {
  enum { N = 4 * STRIP_VERTICES };
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  uint32_t edges[N][2];
  double lengths[N], growth[STRIP_VERTICES];
  uint32_t n = 0;
  for (int t = 0; t < STRIP_TRIANGLES; ++t)
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = strip.triangles[3 * t + k], b = strip.triangles[3 * t + (k + 1) % 3];
      const double *p = &strip.positions[3 * a], *q = &strip.positions[3 * b];
      int known = 0;
      for (uint32_t e = 0; e < n; ++e) known |= edges[e][0] == (a < b ? a : b) && edges[e][1] == (a < b ? b : a);
      if (known) continue;
      edges[n][0] = a < b ? a : b, edges[n][1] = a < b ? b : a;
      lengths[n++] = hypot(hypot(p[0] - q[0], 1.01 * (p[1] - q[1])), p[2] - q[2]);
    }
  for (int v = 0; v < STRIP_VERTICES; ++v) growth[v] = 1.01;
  for (int by_map = 0; by_map < 2; ++by_map) {
    SwMaterialDesc sheet = aluminium(0.3);
    SwMaterialMap map;
    SwPrecomputeDesc options;
    SwModel *model = NULL;
    double rest[3 * STRIP_VERTICES], size[2][2] = {{0}};
    sw_material_map_init(&map);
    map.quantity = SW_MAP_GROWTH, map.on = SW_MAP_ON_VERTICES, map.format = SW_FORMAT_F64;
    map.values = growth, map.count = STRIP_VERTICES;
    if (by_map)
      sheet.maps = &map, sheet.n_maps = 1;
    else
      sheet.length_edges = &edges[0][0], sheet.rest_lengths = lengths, sheet.n_rest_lengths = n;
    OK(sw_model_create(&mesh, &sheet, NULL, &model));
    sw_precompute_desc_init(&options);
    options.modes = 8;
    OK(sw_model_precompute(model, &options));
    {
      SwState *state = NULL;
      OK(sw_state_create(model, NULL, &state));
      OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, rest, 0, STRIP_VERTICES));
      sw_state_destroy(state);
    }
    for (int c = 0; c < 2; ++c)
      for (int v = 0; v < STRIP_VERTICES; ++v) {
        const double now = rest[3 * v + c] - rest[c], before = strip.positions[3 * v + c] - strip.positions[c];
        if (fabs(now) > size[1][c]) size[1][c] = fabs(now);
        if (fabs(before) > size[0][c]) size[0][c] = fabs(before);
      }
    /* Solved to 1e-8 of the forces that 1 % makes; what is left turns into a length by the shape of the mesh. */
    CHECK(fabs(size[1][1] / size[0][1] - 1.01) < 1e-7);
    CHECK(fabs(size[1][0] / size[0][0] - (by_map ? 1.01 : 1)) < 1e-7);
    sw_model_destroy(model);
  }
}

static void bad_lengths_are_named(void) {
  const Strip strip = make_strip();
  const SwMeshDesc mesh = strip_mesh(&strip);
  uint32_t edges[2][2] = {{strip_vertex(3, 0), strip_vertex(3, 1)}, {strip_vertex(4, 0), strip_vertex(4, 1)}};
  double lengths[2] = {0.011, 0.011};
  SwMaterialDesc sheet = aluminium(0.3);
  SwModel *model = NULL;
  sheet.length_edges = &edges[0][0], sheet.n_rest_lengths = 2;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->rest_lengths");
  sheet.rest_lengths = lengths;
  lengths[1] = NAN;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "rest length 1");
  lengths[1] = -1;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "rest length 1");
  lengths[1] = 1e3;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "shorter than the other two together");
  edges[1][1] = 999;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "rest length 1");
  edges[1][0] = edges[0][1], edges[1][1] = edges[0][0];
  lengths[1] = 0.011;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "same edge");
  sheet.length_edges = NULL;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "material->length_edges");
  sheet.n_rest_lengths = 0, sheet.length_flags = 1;
  FAILS(sw_model_create(&mesh, &sheet, NULL, &model), SW_ERROR_INVALID_ARGUMENT, "length_flags");
  CHECK(model == NULL);
}

int main(void) {
  RUN(a_strip_rests_at_its_own_lengths);
  RUN(bad_lengths_are_named);
  RUN(a_creased_strip_rests_folded);
  RUN(a_flat_strip_curls_to_its_rest_shape);
  RUN(a_crease_that_yields_stays_folded);
  RUN(creases_of_one_are_none_and_bad_ones_are_named);
  RUN(a_clamped_strip_swings_as_a_beam_does);
  RUN(a_sag_and_a_frequency_give_the_factor_that_a_beam_would);
  RUN(the_unit_of_length_does_not_matter);
  RUN(a_saved_model_keeps_its_sheet);
  RUN(a_strip_swings_by_the_modulus_along_it);
  RUN(what_is_no_grain_is_refused_by_name);
  RUN(the_polynomial_shell_takes_the_energy);
  RUN(none_given_are_the_defaults);
  RUN(a_stiffness_of_zero_beside_others_is_zero);
  RUN(presets_are_sheets_in_any_unit_of_length);
  RUN(what_is_no_preset_is_refused);
  RUN(a_wrong_unit_shows_in_what_the_weight_does);
  RUN(a_sheet_too_thick_for_its_curvature_is_warned_of);
  RUN(a_sheet_too_thick_for_its_size_is_warned_of);
  RUN(entries_that_are_no_numbers_are_named);
  RUN(a_unit_that_is_none_is_refused);
  RUN(maps_of_equal_values_are_the_constant);
  RUN(a_thin_end_makes_the_beam_faster);
  RUN(no_resistance_to_stretching_is_warned_of);
  return report_failures();
}

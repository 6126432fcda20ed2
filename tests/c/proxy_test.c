/* A mesh to simulate in another's place, through the C interface: a slab with two sides becomes a sheet that carries it. */
#include "test_support.h"

enum { N = 21, SIDE = N * N, ASSET = 2 * SIDE, QUADS = (N - 1) * (N - 1), MOST = 2000 };

static double asset[ASSET][3];
static uint32_t triangles[4 * QUADS][3];

/* Two sheets, 0.01 above and below the plane, that face away from each other. */
static SwMeshDesc make_asset(void) {
  for (int i = 0; i < ASSET; ++i) {
    asset[i][0] = (double)(i % N) / (N - 1);
    asset[i][1] = (double)(i / N % N) / (N - 1);
    asset[i][2] = i < SIDE ? 0.01 : -0.01;
  }
  for (uint32_t q = 0; q < QUADS; ++q) {
    const uint32_t a = q / (N - 1) * N + q % (N - 1), quad[6] = {a, a + 1, a + N + 1, a, a + N + 1, a + N};
    for (uint32_t c = 0; c < 6; ++c) {
      triangles[2 * q + c / 3][c % 3] = quad[c];
      triangles[2 * (QUADS + q) + c / 3][2 - c % 3] = SIDE + quad[c];
    }
  }
  SwMeshDesc mesh;
  sw_mesh_desc_init(&mesh);
  mesh.position_format = SW_FORMAT_F64, mesh.positions = asset, mesh.n_vertices = ASSET;
  mesh.triangles = &triangles[0][0], mesh.n_triangles = 4 * QUADS;
  return mesh;
}

static SwProxyDesc wanted(uint32_t n) {
  SwProxyDesc desc;
  sw_proxy_desc_init(&desc);
  desc.n_vertices = n;
  return desc;
}

static double x[MOST][3];
static uint32_t t[2 * MOST][3], corners[MOST][3], nearest[ASSET];
static double weights[MOST][3], drawn[ASSET][3];

static SwProxyInfo made_of(const SwProxy *proxy) {
  SwProxyInfo info;
  sw_proxy_info_init(&info);
  OK(sw_proxy_info(proxy, &info));
  return info;
}

static void a_slab_is_carried_by_the_sheet_in_its_middle(void) {
  const SwMeshDesc mesh = make_asset();
  const SwProxyDesc desc = wanted(100);
  SwProxy *proxy = NULL;
  OK(sw_proxy_create(&mesh, &desc, &proxy));
  const SwProxyInfo info = made_of(proxy);
  CHECK(info.n_vertices > 88 && info.n_vertices < 112 && info.n_asset_vertices == ASSET && info.n_pieces == 1);
  CHECK(info.n_sides_joined == 2 * QUADS && info.n_cut == 0 && info.n_left_out == 0 && info.worst_quality > 0.4);
  CHECK_NEAR(info.thickness, 0.02, 1e-12);
  OK(sw_proxy_positions(proxy, SW_FORMAT_F64, x, 0, info.n_vertices));
  OK(sw_proxy_triangles(proxy, &t[0][0], info.n_triangles));
  OK(sw_proxy_sources(proxy, &corners[0][0], &weights[0][0], info.n_vertices));
  OK(sw_proxy_sources(proxy, NULL, NULL, info.n_vertices));
  OK(sw_proxy_nearest(proxy, nearest, ASSET));
  uint32_t fixed[MOST], n_fixed = 0;
  for (uint32_t v = 0; v < info.n_vertices; ++v) {
    CHECK_NEAR(x[v][2], 0, 1e-12);
    double across = 0;
    for (int k = 0; k < 3; ++k) across += weights[v][k] * asset[corners[v][k]][1];
    CHECK_NEAR(across, x[v][1], 1e-9);
    if (x[v][0] < 0.1) fixed[n_fixed++] = v;
  }
  SwMeshDesc coarse;
  sw_mesh_desc_init(&coarse);
  coarse.position_format = SW_FORMAT_F64, coarse.positions = x, coarse.n_vertices = info.n_vertices;
  coarse.triangles = &t[0][0], coarse.n_triangles = info.n_triangles;
  SwSupportDesc supports;
  sw_support_desc_init(&supports);
  supports.fixed = fixed, supports.n_fixed = n_fixed;
  SwModel *model = NULL;
  OK(sw_model_create(&coarse, NULL, &supports, &model));
  precompute(model, 8, SW_PRECISION_F64);
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  const double gravity[3] = {0, 0, -3};
  OK(sw_state_set_gravity(state, gravity));
  for (int i = 0; i < 10; ++i) OK(sw_state_step(state, 1.0 / 30)); /* half a swing, about */
  SwBindingDesc bound;
  sw_binding_desc_init(&bound);
  bound.format = SW_FORMAT_F64, bound.points = asset, bound.n_points = ASSET;
  SwBinding *binding = NULL;
  OK(sw_binding_create(model, &bound, &binding));
  SwBoundPointsDesc read;
  sw_bound_points_desc_init(&read);
  read.format = SW_FORMAT_F64, read.positions = drawn;
  OK(sw_state_bound_points(state, binding, &read));
  double lowest = 0;
  for (int i = 0; i < SIDE; ++i) {
    double squared = 0;
    for (int k = 0; k < 3; ++k) squared += pow(drawn[i][k] - drawn[SIDE + i][k], 2);
    CHECK_NEAR(sqrt(squared), 0.02, 2e-4); /* the sides stay as far apart */
    lowest = fmin(lowest, drawn[i][2]);
  }
  CHECK(lowest < -0.02);
  sw_binding_destroy(binding);
  sw_state_destroy(state);
  sw_model_destroy(model);
  sw_proxy_destroy(proxy);
}

static uint32_t count_and_cancel(void *user, uint32_t phase, double share) {
  int *left = user;
  CHECK(phase == 0 && share >= 0 && share <= 1);
  return (*left)-- > 0 ? SW_PROGRESS_CONTINUE : SW_PROGRESS_CANCEL;
}

static void what_is_wrong_is_named(void) {
  SwMeshDesc mesh = make_asset();
  SwProxyDesc desc = wanted(100);
  SwProxy *proxy = NULL;
  FAILS(sw_proxy_create(NULL, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "mesh");
  FAILS(sw_proxy_create(&mesh, NULL, &proxy), SW_ERROR_INVALID_ARGUMENT, "desc");
  FAILS(sw_proxy_create(&mesh, &desc, NULL), SW_ERROR_INVALID_ARGUMENT, "proxy");
  desc = wanted(3);
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "n_vertices is 3");
  desc = wanted(100);
  desc.flags = 8;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "flags");
  desc = wanted(100);
  desc.weld = NAN;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "weld");
  desc = wanted(100);
  desc.thickness = 0.03, desc.flags = SW_PROXY_KEEP_SIDES;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "SW_PROXY_KEEP_SIDES");
  const uint32_t nobody[2] = {0, ASSET};
  desc = wanted(100);
  desc.n_held = 2;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "desc->held");
  desc.held = nobody;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "held[1] is vertex");
  desc.held_flags = 1;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_ARGUMENT, "held_flags");
  desc = wanted(100);
  int left = 3;
  desc.progress = count_and_cancel, desc.progress_user = &left;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_CANCELLED, "cancelled");
  desc = wanted(100);
  asset[7][1] = INFINITY;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_MESH, "vertex 7");
  mesh = make_asset();
  triangles[5][2] = 99999;
  FAILS(sw_proxy_create(&mesh, &desc, &proxy), SW_ERROR_INVALID_MESH, "triangle 5 names vertex 99999");
  mesh = make_asset();
  CHECK(proxy == NULL);
  OK(sw_proxy_create(&mesh, &desc, &proxy));
  const SwProxyInfo info = made_of(proxy);
  const uint32_t n = info.n_vertices;
  FAILS(sw_proxy_info(proxy, NULL), SW_ERROR_INVALID_ARGUMENT, "info");
  FAILS(sw_proxy_info(NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "proxy");
  FAILS(sw_proxy_positions(proxy, SW_FORMAT_F64, x, 0, n + 1), SW_ERROR_INVALID_ARGUMENT, "n_vertices");
  FAILS(sw_proxy_positions(proxy, 9, x, 0, n), SW_ERROR_INVALID_ARGUMENT, "format");
  FAILS(sw_proxy_positions(proxy, SW_FORMAT_F64, NULL, 0, n), SW_ERROR_INVALID_ARGUMENT, "positions");
  FAILS(sw_proxy_triangles(proxy, &t[0][0], 1), SW_ERROR_INVALID_ARGUMENT, "n_triangles is 1");
  FAILS(sw_proxy_triangles(proxy, NULL, info.n_triangles), SW_ERROR_INVALID_ARGUMENT, "triangles");
  FAILS(sw_proxy_sources(proxy, &corners[0][0], NULL, 0), SW_ERROR_INVALID_ARGUMENT, "n_vertices is 0");
  FAILS(sw_proxy_nearest(proxy, nearest, ASSET - 1), SW_ERROR_INVALID_ARGUMENT, "n_asset_vertices");
  FAILS(sw_proxy_nearest(proxy, NULL, ASSET), SW_ERROR_INVALID_ARGUMENT, "vertices");
  sw_proxy_destroy(proxy);
  sw_proxy_destroy(NULL);
}

/* A model of a proxy's mesh, held where x < 0.1. */
static SwModel *model_on(const SwProxy *proxy) {
  static uint32_t fixed[MOST];
  const SwProxyInfo info = made_of(proxy);
  OK(sw_proxy_positions(proxy, SW_FORMAT_F64, x, 0, info.n_vertices));
  OK(sw_proxy_triangles(proxy, &t[0][0], info.n_triangles));
  uint32_t n_fixed = 0;
  for (uint32_t v = 0; v < info.n_vertices; ++v)
    if (x[v][0] < 0.101) fixed[n_fixed++] = v;
  SwMeshDesc coarse;
  sw_mesh_desc_init(&coarse);
  coarse.position_format = SW_FORMAT_F64, coarse.positions = x, coarse.n_vertices = info.n_vertices;
  coarse.triangles = &t[0][0], coarse.n_triangles = info.n_triangles;
  SwSupportDesc supports;
  sw_support_desc_init(&supports);
  supports.fixed = fixed, supports.n_fixed = n_fixed;
  SwMaterialDesc sheet;
  sw_material_desc_init(&sheet);
  sheet.energy = SW_ENERGY_KOITER, sheet.young = 1e9, sheet.poisson = 0.3, sheet.thickness = 0.01, sheet.volume_density = 1000;
  SwModel *model = NULL;
  OK(sw_model_create(&coarse, &sheet, &supports, &model));
  return model;
}

static void a_model_is_calibrated_by_its_proxy_once_and_before_its_precompute(void) {
  const SwMeshDesc mesh = make_asset();
  uint32_t held[ASSET], n_held = 0;
  for (uint32_t v = 0; v < ASSET; ++v)
    if (asset[v][0] < 0.101) held[n_held++] = v;
  SwProxyDesc desc = wanted(60);
  SwProxy *unheld = NULL, *proxy = NULL;
  OK(sw_proxy_create(&mesh, &desc, &unheld));
  desc.held = held, desc.n_held = n_held;
  OK(sw_proxy_create(&mesh, &desc, &proxy));
  SwModel *model = model_on(proxy);
  SwCalibrationInfo info;
  sw_calibration_info_init(&info);
  SwCalibrationDesc how;
  sw_calibration_desc_init(&how);
  FAILS(sw_model_calibrate(NULL, proxy, NULL, &info), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_calibrate(model, NULL, NULL, &info), SW_ERROR_INVALID_ARGUMENT, "proxy");
  how.flags = 1;
  FAILS(sw_model_calibrate(model, proxy, &how, &info), SW_ERROR_INVALID_ARGUMENT, "flags");
  how.flags = 0, how.n_held = 1;
  FAILS(sw_model_calibrate(model, proxy, &how, &info), SW_ERROR_INVALID_ARGUMENT, "desc->held");
  const uint32_t nobody = ASSET;
  how.held = &nobody;
  FAILS(sw_model_calibrate(model, proxy, &how, &info), SW_ERROR_INVALID_ARGUMENT, "held[0] is vertex");
  how.held = NULL, how.n_held = 0;
  int left = 2;
  how.progress = count_and_cancel, how.progress_user = &left;
  FAILS(sw_model_calibrate(model, proxy, &how, &info), SW_ERROR_CANCELLED, "cancelled");
  SwModel *other = model_on(unheld);
  FAILS(sw_model_calibrate(other, unheld, NULL, &info), SW_ERROR_UNSUPPORTED, "held");
  OK(sw_model_calibrate(model, proxy, NULL, &info));
  CHECK(info.n_compared == SIDE && info.n_patches >= 4 && info.n_loads >= 3); /* of the slab the sheet in its middle */
  CHECK(info.difference_after < 0.5 * info.difference_before);
  CHECK(info.stretching_min >= 0.25 && info.stretching_max <= 4 && info.bending_min >= 0.25 && info.bending_max <= 4);
  CHECK_NEAR(info.mass_before, 1, 1e-9); /* a flat square */
  FAILS(sw_model_calibrate(model, proxy, NULL, &info), SW_ERROR_INVALID_ARGUMENT, "calibrated before");
  precompute(model, 4, SW_PRECISION_F64);
  how.progress = NULL;
  how.held = held, how.n_held = n_held; /* what the proxy was not told */
  OK(sw_model_calibrate(other, unheld, &how, NULL));
  sw_model_destroy(other);
  other = model_on(proxy);
  precompute(other, 4, SW_PRECISION_F64);
  FAILS(sw_model_calibrate(other, proxy, NULL, NULL), SW_ERROR_INVALID_ARGUMENT, "precomputed before");
  sw_model_destroy(other);
  sw_model_destroy(model);
  sw_proxy_destroy(proxy);
  sw_proxy_destroy(unheld);
}

int main(void) {
  RUN(a_model_is_calibrated_by_its_proxy_once_and_before_its_precompute);
  RUN(a_slab_is_carried_by_the_sheet_in_its_middle);
  RUN(what_is_wrong_is_named);
  return report_failures();
}

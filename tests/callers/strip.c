/* See README.md here. */
#include "shellwarp.h"

#include <stdio.h>

#define CHECK(call) \
  do { \
    if ((call) != SW_OK) { \
      fprintf(stderr, "%s: %s\n", #call, sw_last_error_message()); \
      return 1; \
    } \
  } while (0)

enum { ROWS = 31, COLUMNS = 4, VERTICES = ROWS * COLUMNS, TRIANGLES = (ROWS - 1) * (COLUMNS - 1) * 2, HELD = 8, FRAMES = 60 };

static float points[VERTICES][3];
static uint32_t triangles[TRIANGLES][3], held[HELD];

static void make_strip(void) {
  uint32_t i, j, k, n = 0;
  for (i = 0; i < ROWS; i++)
    for (j = 0; j < COLUMNS; j++) points[COLUMNS * i + j][0] = i / 64.0f, points[COLUMNS * i + j][1] = j / 64.0f;
  for (i = 0; i < ROWS - 1; i++)
    for (j = 0; j < COLUMNS - 1; j++) {
      const uint32_t a = COLUMNS * i + j;
      const uint32_t pair[2][3] = {{a, a + 4, a + 5}, {a, a + 5, a + 1}};
      for (k = 0; k < 6; k++) triangles[n + k / 3][k % 3] = pair[k / 3][k % 3];
      n += 2;
    }
  for (k = 0; k < HELD; k++) held[k] = k;
}

static int make_model(SwModel **model) {
  SwMeshDesc mesh;
  SwMaterialDesc card;
  SwSupportDesc supports;
  SwPrecomputeDesc precompute;
  sw_mesh_desc_init(&mesh);
  mesh.position_format = SW_FORMAT_F32;
  mesh.positions = points;
  mesh.n_vertices = VERTICES;
  mesh.triangles = &triangles[0][0];
  mesh.n_triangles = TRIANGLES;
  sw_material_desc_init(&card);
  card.area_density = 0.25;
  card.k_bend = 1.0 / 256;
  card.k_area = card.k_length = 4096;
  sw_support_desc_init(&supports);
  supports.fixed = held;
  supports.n_fixed = HELD;
  CHECK(sw_model_create(&mesh, &card, &supports, model));
  sw_precompute_desc_init(&precompute);
  precompute.modes = 12;
  CHECK(sw_model_precompute(*model, &precompute));
  return 0;
}

static int run(SwModel *model) {
  const double gravity[3] = {0, 1, -8}, ratio = 0.125;
  SwDampingDesc damping;
  SwConstraintDesc handle;
  SwState *state = NULL;
  int frame;
  CHECK(sw_state_create(model, NULL, &state));
  CHECK(sw_state_set_gravity(state, gravity));
  sw_damping_desc_init(&damping);
  damping.ratios = &ratio;
  damping.n_ratios = 1;
  CHECK(sw_state_set_damping(state, &damping));
  sw_constraint_desc_init(&handle);
  handle.id = 7;
  handle.kind = SW_CONSTRAINT_POSITION;
  handle.vertex = VERTICES - 1;
  handle.axes = SW_AXIS_Z;
  for (frame = 1; frame <= FRAMES; frame++) {
    handle.position[2] = frame / 1024.0;
    CHECK(sw_state_set_constraint(state, &handle));
    CHECK(sw_state_step(state, 1.0 / 32));
  }
  CHECK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, points, 0, VERTICES));
  sw_state_destroy(state);
  return 0;
}

int main(int argc, char **argv) {
  SwModel *model = NULL;
  FILE *file;
  if (argc != 2) return 2;
  make_strip();
  if (make_model(&model) || run(model)) return 1;
  sw_model_destroy(model);
  file = fopen(argv[1], "wb");
  if (!file || fwrite(points, sizeof points, 1, file) != 1 || fclose(file)) return 1;
  printf("shellwarp %s: the led corner is %.6f high\n", sw_version_string(), points[VERTICES - 1][2]);
  return 0;
}

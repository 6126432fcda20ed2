/* What the C tests share: checks that count failures and go on, and a strip to simulate.

   A test is a function whose name is a claim; RUN runs it and prints how it went. */
#ifndef TEST_SUPPORT_H
#define TEST_SUPPORT_H

#include "shellwarp.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      ++failures;                                                           \
      printf("%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
    }                                                                       \
  } while (0)

/* A value against another, with an absolute tolerance whose reason stands at the call. */
#define CHECK_NEAR(value, expected, tolerance)                                                               \
  do {                                                                                                       \
    const double value_ = (value), expected_ = (expected), tolerance_ = (tolerance);                         \
    if (!(fabs(value_ - expected_) <= tolerance_)) {                                                         \
      ++failures;                                                                                            \
      printf("%s:%d: %s is %.17g, not within %g of %.17g\n", __FILE__, __LINE__, #value, value_, tolerance_, \
             expected_);                                                                                     \
    }                                                                                                        \
  } while (0)

#define OK(call) check_ok((call), __FILE__, __LINE__, #call)

/* The call must fail with this status and a message that holds this text. */
#define FAILS(call, status, text) check_fails((call), (status), (text), __FILE__, __LINE__, #call)

#define RUN(test)                                                    \
  do {                                                               \
    const int before_ = failures;                                    \
    test();                                                          \
    printf("%-4s %s\n", failures == before_ ? "ok" : "FAIL", #test); \
    fflush(stdout); /* what went before a crash must be seen */      \
  } while (0)

static inline int report_failures(void) {
  printf("%d failed checks\n", failures);
  return failures ? EXIT_FAILURE : EXIT_SUCCESS;
}

/* A failed call leaves a test nothing to go on with: stop at once. */
static inline void check_ok(SwStatus status, const char *file, int line, const char *call) {
  if (status == SW_OK) return;
  printf("%s:%d: %s: %s: %s\n", file, line, call, sw_status_string(status), sw_last_error_message());
  exit(EXIT_FAILURE);
}

static inline void check_fails(SwStatus status, SwStatus expected, const char *text, const char *file, int line,
                               const char *call) {
  if (status == expected && strlen(text) > 0 && strstr(sw_last_error_message(), text)) return;
  ++failures;
  printf("%s:%d: %s: expected '%s' with '%s' in its message, got '%s': '%s'\n", file, line, call,
         sw_status_string(expected), text, sw_status_string(status), status == SW_OK ? "" : sw_last_error_message());
}

/* A flat strip of 2 x 40 squares in the xy-plane, its long side along x; vertices in columns of three. The diagonals of the
   two rows mirror each other, so that the strip is symmetric about y = 0 and bends without twisting. It has enough vertices
   for the sparse eigensolver; a smaller one would be given to the dense one, which has fewer phases. */
enum {
  STRIP_COLUMNS = 41,
  STRIP_ROWS = 3,
  STRIP_VERTICES = STRIP_COLUMNS * STRIP_ROWS,
  STRIP_TRIANGLES = 4 * (STRIP_COLUMNS - 1)
};
#define STRIP_LENGTH 4.0
#define STRIP_WIDTH 0.2

typedef struct {
  double positions[3 * STRIP_VERTICES];
  uint32_t triangles[3 * STRIP_TRIANGLES];
  uint32_t held[STRIP_ROWS]; /* the column at x = 0 */
} Strip;

static inline uint32_t strip_vertex(int column, int row) { return (uint32_t)(column * STRIP_ROWS + row); }

static inline Strip make_strip(void) {
  Strip strip;
  uint32_t *t = strip.triangles;
  for (int i = 0; i < STRIP_COLUMNS; ++i)
    for (int j = 0; j < STRIP_ROWS; ++j) {
      double *x = &strip.positions[3 * strip_vertex(i, j)];
      x[0] = STRIP_LENGTH * i / (STRIP_COLUMNS - 1);
      x[1] = STRIP_WIDTH * j / (STRIP_ROWS - 1) - STRIP_WIDTH / 2;
      x[2] = 0;
    }
  for (int i = 0; i + 1 < STRIP_COLUMNS; ++i)
    for (int j = 0; j + 1 < STRIP_ROWS; ++j) {
      const uint32_t a = strip_vertex(i, j), b = strip_vertex(i + 1, j);
      const uint32_t rising[6] = {a, b, b + 1, a, b + 1, a + 1}, falling[6] = {a, b, a + 1, b, b + 1, a + 1};
      memcpy(t, j ? falling : rising, sizeof rising);
      t += 6;
    }
  for (int j = 0; j < STRIP_ROWS; ++j) strip.held[j] = strip_vertex(0, j);
  return strip;
}

static inline SwMeshDesc strip_mesh(const Strip *strip) {
  SwMeshDesc mesh;
  sw_mesh_desc_init(&mesh);
  mesh.positions = strip->positions;
  mesh.position_format = SW_FORMAT_F64;
  mesh.triangles = strip->triangles;
  mesh.n_vertices = STRIP_VERTICES;
  mesh.n_triangles = STRIP_TRIANGLES;
  return mesh;
}

/* Clamped at x = 0, free at the other end; not yet precomputed. */
static inline SwModel *strip_model(const Strip *strip) {
  const SwMeshDesc mesh = strip_mesh(strip);
  SwSupportDesc supports;
  SwModel *model = NULL;
  sw_support_desc_init(&supports);
  supports.clamped = strip->held;
  supports.n_clamped = STRIP_ROWS;
  OK(sw_model_create(&mesh, NULL, &supports, &model));
  return model;
}

static inline void precompute(SwModel *model, uint32_t modes, uint32_t precision) {
  SwPrecomputeDesc desc;
  sw_precompute_desc_init(&desc);
  desc.modes = modes;
  desc.precision = precision;
  OK(sw_model_precompute(model, &desc));
}

static inline SwState *new_state(const SwModel *model, uint32_t method, uint32_t integrator) {
  SwStateDesc desc;
  SwState *state = NULL;
  sw_state_desc_init(&desc);
  desc.method = method;
  desc.integrator = integrator;
  OK(sw_state_create(model, &desc, &state));
  return state;
}

static inline SwModelInfo info_of(const SwModel *model) {
  SwModelInfo info;
  sw_model_info_init(&info);
  OK(sw_model_info(model, &info));
  return info;
}

static inline SwStateReport report_of(const SwState *state) {
  SwStateReport report;
  sw_state_report_init(&report);
  OK(sw_state_report(state, &report));
  return report;
}

#endif

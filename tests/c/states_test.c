/* Many states in one call: they move as one by one, on any number of threads, and fail one by one. */
#define _POSIX_C_SOURCE 200809L /* fork */
#include "test_support.h"

#ifdef __unix__
#include <sys/wait.h>
#include <unistd.h>
#endif

/* Enough for the library to use several threads; of the strip, and every kind of method and precision among them. */
enum { STATES = 400, STEPS = 5 };

typedef struct {
  SwModel *models[2];
  SwState *states[STATES];
} Crowd;

static void set_gravity(SwState *state, double z) {
  const double gravity[3] = {0.1 * z, 0, z};
  OK(sw_state_set_gravity(state, gravity));
}

static Crowd make_crowd(void) {
  const uint32_t methods[5] = {SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_SHELL_EXPLICIT,
                               SW_METHOD_WARP};
  const Strip strip = make_strip();
  Crowd crowd;
  for (uint32_t m = 0; m < 2; ++m) {
    crowd.models[m] = strip_model(&strip);
    precompute(crowd.models[m], 3 + 5 * m, m ? SW_PRECISION_F32 : SW_PRECISION_F64);
  }
  for (int i = 0; i < STATES; ++i) {
    const uint32_t integrator = i % 3 ? SW_INTEGRATOR_EXACT : SW_INTEGRATOR_IMPLICIT_EULER;
    crowd.states[i] = new_state(crowd.models[i % 2], methods[i % 5], integrator);
    set_gravity(crowd.states[i], -0.001 * i);
  }
  return crowd;
}

static void destroy_crowd(Crowd *crowd) {
  for (int i = 0; i < STATES; ++i) sw_state_destroy(crowd->states[i]);
  for (int m = 0; m < 2; ++m) sw_model_destroy(crowd->models[m]);
}

/* All that a state's motion consists of; the length is *size. */
static unsigned char *saved(const SwState *state, uint64_t *size) {
  unsigned char *bytes;
  OK(sw_state_save(state, NULL, 0, size));
  bytes = malloc((size_t)*size);
  OK(sw_state_save(state, bytes, *size, size));
  return bytes;
}

static int same_motion(const SwState *a, const SwState *b) {
  uint64_t size_a, size_b;
  unsigned char *bytes_a = saved(a, &size_a), *bytes_b = saved(b, &size_b);
  const int same = size_a == size_b && memcmp(bytes_a, bytes_b, (size_t)size_a) == 0;
  free(bytes_a);
  free(bytes_b);
  return same;
}

/* Explicit shells need short steps. */
static const double kStep = 1e-4;

static void many_states_move_as_one_by_one_on_any_number_of_threads(void) {
  const uint32_t threads[4] = {1, 2, 5, 0};
  Crowd alone = make_crowd();
  for (int k = 0; k < STEPS; ++k)
    for (int i = 0; i < STATES; ++i) OK(sw_state_step(alone.states[i], kStep));
  for (int t = 0; t < 4; ++t) {
    Crowd crowd = make_crowd();
    OK(sw_set_threads(threads[t]));
    for (int k = 0; k < STEPS; ++k) OK(sw_states_step(crowd.states, STATES, kStep, NULL));
    for (int i = 0; i < STATES; ++i) CHECK(same_motion(crowd.states[i], alone.states[i]));
    CHECK(!same_motion(crowd.states[0], crowd.states[10]));
    destroy_crowd(&crowd);
  }
  destroy_crowd(&alone);
}

/* One whose result would not be finite, and one that is there twice. */
static void a_state_that_fails_is_told_and_the_others_move(void) {
  Crowd crowd = make_crowd(), alone = make_crowd();
  SwStatus statuses[STATES];
  uint64_t size;
  unsigned char *before;
  SwState *tenth = crowd.states[10];
  set_gravity(crowd.states[7], 1e300);
  before = saved(crowd.states[7], &size);
  crowd.states[10] = crowd.states[4];
  FAILS(sw_states_step(crowd.states, STATES, kStep, statuses), SW_ERROR_NUMERICAL, "states[7]");
  crowd.states[10] = tenth;
  for (int i = 0; i < STATES; ++i) {
    const SwStatus expected = i == 7 ? SW_ERROR_NUMERICAL : i == 10 ? SW_ERROR_BUSY : SW_OK;
    CHECK(statuses[i] == expected);
    if (expected == SW_OK) {
      OK(sw_state_step(alone.states[i], kStep));
      CHECK(same_motion(crowd.states[i], alone.states[i]));
    }
  }
  CHECK(same_motion(tenth, alone.states[10]));
  set_gravity(crowd.states[7], 0);
  {
    uint64_t size_after;
    unsigned char *after = saved(crowd.states[7], &size_after);
    CHECK(size_after == size && memcmp(before, after, (size_t)size) == 0);
    free(after);
  }
  /* None was harmed. */
  OK(sw_states_step(crowd.states, STATES, kStep, statuses));
  for (int i = 0; i < STATES; ++i) CHECK(statuses[i] == SW_OK);
  free(before);
  destroy_crowd(&crowd);
  destroy_crowd(&alone);
}

static void bad_arguments_move_nothing_and_touch_no_status(void) {
  Crowd crowd = make_crowd(), alone = make_crowd();
  SwStatus statuses[STATES];
  SwState *third = crowd.states[3];
  for (int i = 0; i < STATES; ++i) statuses[i] = 77;
  FAILS(sw_states_step(NULL, 2, kStep, statuses), SW_ERROR_INVALID_ARGUMENT, "states is NULL");
  crowd.states[3] = NULL;
  FAILS(sw_states_step(crowd.states, STATES, kStep, statuses), SW_ERROR_INVALID_ARGUMENT, "states[3]");
  crowd.states[3] = third;
  for (int i = 0; i < STATES; ++i) {
    CHECK(statuses[i] == 77);
    CHECK(same_motion(crowd.states[i], alone.states[i]));
  }
  OK(sw_states_step(NULL, 0, kStep, NULL));
  FAILS(sw_states_step(crowd.states, STATES, -1, statuses), SW_ERROR_INVALID_ARGUMENT, "states[0]: the step");
  for (int i = 0; i < STATES; ++i) {
    CHECK(statuses[i] == SW_ERROR_INVALID_ARGUMENT);
    CHECK(same_motion(crowd.states[i], alone.states[i]));
  }
  FAILS(sw_set_threads(1025), SW_ERROR_INVALID_ARGUMENT, "1025");
  destroy_crowd(&crowd);
  destroy_crowd(&alone);
}

/* A forked process has none of its parent's threads, and makes its own. */
static void a_forked_process_goes_on(void) {
#ifdef __unix__
  Crowd crowd = make_crowd();
  pid_t child;
  int status = -1;
  OK(sw_set_threads(3));
  OK(sw_states_step(crowd.states, STATES, kStep, NULL));
  fflush(stdout);
  child = fork();
  if (child == 0) {
    const SwStatus stepped = sw_states_step(crowd.states, STATES, kStep, NULL);
    _exit(stepped == SW_OK && sw_set_threads(1) == SW_OK ? 0 : 1);
  }
  CHECK(child > 0 && waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  OK(sw_states_step(crowd.states, STATES, kStep, NULL));
  destroy_crowd(&crowd);
#endif
}

/* "without-fork" leaves out what emulators of single programs cannot do beside threads. */
int main(int argc, char **argv) {
  RUN(many_states_move_as_one_by_one_on_any_number_of_threads);
  RUN(a_state_that_fails_is_told_and_the_others_move);
  RUN(bad_arguments_move_nothing_and_touch_no_status);
  if (argc > 1 && strcmp(argv[1], "without-fork") == 0)
    printf("skipped: a_forked_process_goes_on\n");
  else
    RUN(a_forked_process_goes_on);
  OK(sw_set_threads(1));
  return report_failures();
}

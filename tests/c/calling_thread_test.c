/* What the host's thread may be like: any floating-point modes, and little stack.

   The same calls are made in each mode and must give the same bytes; every call and callback finds and leaves the host's modes. */
#define _GNU_SOURCE /* feenableexcept, MAP_ANONYMOUS */
#include "test_support.h"

#include <fenv.h>

#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>
static unsigned modes(void) { return _mm_getcsr(); }
static void set_modes(unsigned word) { _mm_setcsr(word); }
static const struct {
  const char *name;
  unsigned word;
} MODES[] = {
    {"to nearest", 0x1f80},
    {"subnormal numbers flushed", 0x9fc0},
    {"down", 0x3f80},
    {"up", 0x5f80},
    {"towards zero", 0x7f80},
    {"invalid, division by zero and overflow trapped", 0x1f80 & ~(0x80u | 0x200u | 0x400u)},
    {"everything trapped", 0},
    {"up, flushed and everything trapped", 0xc040},
};
#else
static unsigned modes(void) { return (unsigned)fegetround(); }
static void set_modes(unsigned word) { fesetround((int)word); }
static const struct {
  const char *name;
  unsigned word;
} MODES[] = {
    {"to nearest", FE_TONEAREST},
    {"down", FE_DOWNWARD},
    {"up", FE_UPWARD},
    {"towards zero", FE_TOWARDZERO},
};
#endif

/* All that the calls gave, one after another. */
typedef struct {
  unsigned char bytes[1 << 20];
  size_t size;
} Record;

static Record expected, found;
static Record *record;
static unsigned host;
static int progress_calls, log_calls;

static void keep(const void *bytes, size_t size) {
  CHECK(record->size + size <= sizeof record->bytes);
  memcpy(record->bytes + record->size, bytes, size);
  record->size += size;
}

static void host_is_undisturbed(const char *where, int line) {
  if (modes() == host) return;
  if (++failures > 20) return;
  printf("%s:%d: the modes are %#x instead of %#x\n", where, line, modes(), host);
}

/* A call that must succeed and leave the host's modes. */
#define CALL(call)                               \
  do {                                           \
    OK(call);                                    \
    host_is_undisturbed(__FILE__, __LINE__);     \
  } while (0)

static uint32_t on_progress(void *user, uint32_t phase, double fraction) {
  (void)user, (void)phase, (void)fraction;
  ++progress_calls;
  host_is_undisturbed("in the progress callback", __LINE__);
  return SW_PROGRESS_CONTINUE;
}

static void on_log(void *user, uint32_t level, const char *message) {
  (void)user, (void)level, (void)message;
  ++log_calls;
  host_is_undisturbed("in the log callback", __LINE__);
}

/* A strip with a triangle turned over, which the log tells of. Made before the modes are set: to compute it would raise flags. */
static Strip strip;

static void make_turned_strip(void) {
  strip = make_strip();
  const uint32_t corner = strip.triangles[0];
  strip.triangles[0] = strip.triangles[1], strip.triangles[1] = corner;
}

static SwModel *make_model(void) {
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwSupportDesc supports;
  SwPrecomputeDesc desc;
  SwModel *model = NULL;
  sw_support_desc_init(&supports);
  supports.clamped = strip.held;
  supports.n_clamped = STRIP_ROWS;
  sw_precompute_desc_init(&desc);
  desc.modes = 6;
  desc.reduced_fields = 6;
  desc.reduced_poses = 3;
  desc.progress = on_progress;
  CALL(sw_model_create(&mesh, NULL, &supports, &model));
  CALL(sw_model_precompute(model, &desc));
  return model;
}

static void keep_model(const SwModel *model) {
  static double hertz[64];
  uint32_t count = 0;
  CALL(sw_model_frequencies(model, hertz, 64, &count));
  keep(hertz, count * sizeof *hertz);
  SwModelInfo info;
  sw_model_info_init(&info);
  CALL(sw_model_info(model, &info));
  memset(info.seconds, 0, sizeof info.seconds); /* a clock's */
  keep(&info, sizeof info);
}

static void keep_state(const SwState *state) {
  static double wide[3 * STRIP_VERTICES];
  static float narrow[4 * STRIP_VERTICES];
  SwStateReport report;
  SwCertificate certificate;
  CALL(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, wide, 0, STRIP_VERTICES));
  keep(wide, sizeof wide);
  CALL(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, narrow, 0, STRIP_VERTICES));
  keep(narrow, sizeof *narrow * 3 * STRIP_VERTICES);
  CALL(sw_state_normals(state, SW_SPACE_FRAME, SW_FORMAT_F32, narrow, 0, STRIP_VERTICES));
  keep(narrow, sizeof *narrow * 3 * STRIP_VERTICES);
  CALL(sw_state_rotations(state, SW_SPACE_WORLD, SW_FORMAT_F32, narrow, 0, STRIP_VERTICES));
  keep(narrow, sizeof narrow);
  sw_state_report_init(&report);
  CALL(sw_state_report(state, &report));
  keep(&report, sizeof report);
  sw_certificate_init(&certificate);
  CALL(sw_state_certify(state, &certificate));
  certificate.seconds = 0; /* a clock's */
  keep(&certificate, sizeof certificate);
}

/* A state in all that may act on it: a turned frame, gravity, damping, wind and a handle. */
static SwState *make_state(const SwModel *model, uint32_t method) {
  const double gravity[3] = {0.3, 0.1, -1.0};
  SwStateDesc desc;
  SwFrameDesc frame;
  SwDampingDesc damping;
  SwWindDesc wind;
  SwConstraintDesc handle;
  SwState *state = NULL;
  sw_state_desc_init(&desc);
  desc.method = method;
  CALL(sw_state_create(model, &desc, &state));
  CALL(sw_state_set_gravity(state, gravity));
  sw_frame_desc_init(&frame);
  frame.origin[1] = 0.7;
  frame.rotation[0] = 0.6, frame.rotation[1] = -0.8, frame.rotation[3] = 0.8, frame.rotation[4] = 0.6;
  frame.rotation[8] = 1.0;
  CALL(sw_state_set_frame(state, &frame));
  sw_damping_desc_init(&damping);
  damping.mass_coefficient = 0.7;
  CALL(sw_state_set_damping(state, &damping));
  sw_wind_desc_init(&wind);
  wind.velocity[0] = 1.3;
  wind.density = 0.3;
  wind.normal_drag = 1.1;
  CALL(sw_state_set_wind(state, &wind));
  sw_constraint_desc_init(&handle);
  handle.kind = SW_CONSTRAINT_POSITION;
  handle.vertex = strip_vertex(STRIP_COLUMNS - 1, 1);
  handle.axes = SW_AXIS_Z;
  handle.position[2] = -0.3;
  CALL(sw_state_set_constraint(state, &handle));
  return state;
}

static const uint32_t METHODS[] = {SW_METHOD_WARP,           SW_METHOD_LMA,          SW_METHOD_WARP_VIRTUAL_WORK,
                                   SW_METHOD_ROTATION_STRAIN, SW_METHOD_REDUCED_SHELL, SW_METHOD_POLYNOMIAL_SHELL,
                                   SW_METHOD_SHELL_IMPLICIT};
enum { N_METHODS = sizeof METHODS / sizeof *METHODS };

/* Every call that computes, on this thread and on the library's own. */
static void make_all_calls(void) {
  SwModel *model = make_model();
  SwState *states[N_METHODS];
  keep_model(model);
  for (int k = 0; k < N_METHODS; ++k) {
    SwState *state = states[k] = make_state(model, METHODS[k]);
    for (int step = 0; step < 5; ++step) CALL(sw_state_step(state, 0.02));
    keep_state(state);
  }
  CALL(sw_state_set_method(states[0], SW_METHOD_WARP_VIRTUAL_WORK));
  CALL(sw_states_step(states, N_METHODS, 0.02, NULL));
  for (int k = 0; k < N_METHODS; ++k) {
    CALL(sw_state_clear_constraint(states[k], SW_ALL_CONSTRAINTS));
    CALL(sw_states_step(&states[k], 1, 0.01, NULL));
    keep_state(states[k]);
    sw_state_destroy(states[k]);
  }
  SwState *resting = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  const double gravity[3] = {0, 0, -0.2};
  CALL(sw_state_set_gravity(resting, gravity));
  CALL(sw_state_equilibrium(resting, NULL));
  keep_state(resting);
  sw_state_destroy(resting);
  sw_model_destroy(model);
  host_is_undisturbed(__FILE__, __LINE__);
}

/* Handles that the host would trap on: what overflows inside is a status. */
static void make_a_call_that_overflows(void) {
  SwModel *model = strip_model(&strip);
  const double gravity[3] = {0, 0, 1e300};
  OK(sw_model_precompute(model, NULL));
  SwState *state = new_state(model, SW_METHOD_LMA, SW_INTEGRATOR_EXACT);
  CALL(sw_state_set_gravity(state, gravity));
  CHECK(sw_state_step(state, 1e200) != SW_OK);
  host_is_undisturbed(__FILE__, __LINE__);
  sw_state_destroy(state);
  sw_model_destroy(model);
}

static void in_modes(size_t k, Record *into) {
  const unsigned before = modes();
  record = into;
  record->size = 0;
  progress_calls = log_calls = 0;
  host = MODES[k].word;
  set_modes(host);
  make_all_calls();
  make_a_call_that_overflows();
  set_modes(before);
  CHECK(progress_calls > 0);
  CHECK(log_calls > 0);
}

static void the_hosts_floating_point_modes_change_no_bit_and_come_back(void) {
  sw_set_log_callback(on_log, NULL);
  OK(sw_set_threads(2));
  in_modes(0, &expected);
  for (size_t k = 1; k < sizeof MODES / sizeof *MODES; ++k) {
    in_modes(k, &found);
    if (found.size == expected.size && memcmp(found.bytes, expected.bytes, found.size) == 0) continue;
    ++failures;
    printf("other bits where the host has set: %s\n", MODES[k].name);
  }
  OK(sw_set_threads(1));
  sw_set_log_callback(NULL, NULL);
}

#if defined(__x86_64__) && defined(__GLIBC__)
/* As Blender does with --debug-fpe: the x87's traps, too. */
static void a_host_that_traps_by_the_c_library_keeps_its_traps(void) {
  feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
  host = modes();
  make_a_call_that_overflows();
  CHECK(fegetexcept() == (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW));
  fedisableexcept(FE_ALL_EXCEPT);
}

static void flags_that_the_host_has_raised_stay_and_none_comes(void) {
  feclearexcept(FE_ALL_EXCEPT);
  feraiseexcept(FE_OVERFLOW);
  host = modes();
  make_a_call_that_overflows();
  CHECK(fetestexcept(FE_ALL_EXCEPT) == fetestexcept(FE_OVERFLOW | FE_INEXACT));
  feclearexcept(FE_ALL_EXCEPT);
}
#endif

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#include <sys/mman.h>

/* What the header asks for. A stack of many times that is filled with a mark, to see how much of it the calls use. */
enum { LEAST_STACK = 128 << 10, STACK = 1 << 20, MARK = 0xa5 };

static void *on_little_stack(void *unused) {
  (void)unused;
  host = modes();
  record = &found;
  found.size = 0;
  make_all_calls();
  return NULL;
}

static void no_call_needs_more_stack_than_the_header_says(void) {
  unsigned char *stack = mmap(NULL, STACK, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  pthread_attr_t attributes;
  pthread_t thread;
  CHECK(stack != MAP_FAILED);
  memset(stack, MARK, STACK);
  OK(sw_set_threads(1));
  CHECK(pthread_attr_init(&attributes) == 0);
  CHECK(pthread_attr_setstack(&attributes, stack, STACK) == 0);
  CHECK(pthread_create(&thread, &attributes, on_little_stack, NULL) == 0);
  CHECK(pthread_join(thread, NULL) == 0);
  pthread_attr_destroy(&attributes);
  size_t unused = 0;
  while (unused < STACK && stack[unused] == MARK) ++unused;
  printf("     of the stack, %zu KiB are used\n", (STACK - unused) >> 10);
  CHECK(STACK - unused <= LEAST_STACK);
  munmap(stack, STACK);
}
#endif

int main(void) {
  make_turned_strip();
  RUN(the_hosts_floating_point_modes_change_no_bit_and_come_back);
#if defined(__x86_64__) && defined(__GLIBC__)
  RUN(a_host_that_traps_by_the_c_library_keeps_its_traps);
  RUN(flags_that_the_host_has_raised_stay_and_none_comes);
#endif
#if defined(__unix__) || defined(__APPLE__)
  RUN(no_call_needs_more_stack_than_the_header_says);
#endif
  return report_failures();
}

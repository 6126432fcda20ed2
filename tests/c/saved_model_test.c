/* Saved models through the C interface: the same bytes of motion after loading, and what a careless or hostile host does. */
#include "test_support.h"

typedef struct {
  unsigned char *bytes;
  uint64_t size;
} Saved;

static Saved save(const SwModel *model) {
  Saved saved = {NULL, 0};
  OK(sw_model_save(model, NULL, 0, &saved.size));
  saved.bytes = malloc(saved.size);
  OK(sw_model_save(model, saved.bytes, saved.size, &saved.size));
  return saved;
}

static SwModel *ready_model(uint32_t precision) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  precompute(model, 6, precision);
  return model;
}

static SwModel *load(const Saved *saved) {
  SwModel *model = NULL;
  OK(sw_model_load(saved->bytes, saved->size, &model));
  return model;
}

typedef struct {
  double x[3 * STRIP_VERTICES];
  unsigned char saved[1024];
  SwConstraintReport report;
} Seen;

/* A led and shaken run. */
static Seen run(const SwModel *model) {
  SwState *state = new_state(model, SW_METHOD_WARP, SW_INTEGRATOR_EXACT);
  const double gravity[3] = {0, 0.1, -0.4};
  Seen seen;
  uint64_t size;
  uint32_t count;
  memset(&seen, 0, sizeof seen);
  OK(sw_state_set_gravity(state, gravity));
  for (int k = 0; k < 40; ++k) {
    SwFrameDesc frame;
    sw_frame_desc_init(&frame);
    frame.origin[0] = 0.1 * sin(0.3 * k);
    OK(sw_state_set_frame(state, &frame));
    if (k >= 20) {
      SwConstraintDesc handle;
      sw_constraint_desc_init(&handle);
      handle.kind = SW_CONSTRAINT_POSITION;
      handle.vertex = STRIP_VERTICES - 2;
      handle.axes = SW_AXIS_Z;
      handle.position[2] = 0.01 * k;
      OK(sw_state_set_constraint(state, &handle));
    }
    OK(sw_state_step(state, 1.0 / 30));
  }
  OK(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, seen.x, 0, STRIP_VERTICES));
  OK(sw_state_save(state, seen.saved, sizeof seen.saved, &size));
  OK(sw_state_constraint_report(state, &seen.report, sizeof(SwConstraintReport), 1, &count));
  sw_state_destroy(state);
  return seen;
}

static void a_loaded_model_moves_with_the_same_bytes(void) {
  for (uint32_t precision = SW_PRECISION_F32; precision <= SW_PRECISION_F64; ++precision) {
    SwModel *model = ready_model(precision);
    const Saved saved = save(model);
    SwModel *loaded = load(&saved);
    const Seen expected = run(model), seen = run(loaded);
    CHECK(memcmp(&expected, &seen, sizeof seen) == 0);
    SwModelInfo info = info_of(model);
    const SwModelInfo again = info_of(loaded);
    info.eigenvalue_disagreement = 0; /* told by the precompute alone, as are seconds */
    memset(info.seconds, 0, sizeof info.seconds);
    CHECK(memcmp(&info, &again, sizeof info) == 0);
    sw_model_destroy(model);
    sw_model_destroy(loaded);
    free(saved.bytes);
  }
}

static void saved_states_go_from_a_model_to_its_loaded_twin(void) {
  SwModel *model = ready_model(0);
  const Saved saved = save(model);
  SwModel *loaded = load(&saved);
  SwState *state = new_state(loaded, 0, 0);
  Seen seen = run(model);
  OK(sw_state_load(state, seen.saved, 24 + 8 * (15 + 2 * 6) + 8));
  sw_state_destroy(state);
  sw_model_destroy(model);
  sw_model_destroy(loaded);
  free(saved.bytes);
}

static void a_loaded_model_can_be_precomputed_anew_and_saved_again(void) {
  SwModel *model = ready_model(0);
  const Saved saved = save(model);
  SwModel *loaded = load(&saved);
  Saved again = save(loaded);
  CHECK(again.size == saved.size && memcmp(again.bytes, saved.bytes, saved.size) == 0);
  free(again.bytes);
  precompute(loaded, 3, 0);
  CHECK(info_of(loaded).modes == 3);
  again = save(loaded);
  CHECK(again.size < saved.size);
  sw_model_destroy(model);
  sw_model_destroy(loaded);
  free(saved.bytes);
  free(again.bytes);
}

static void bytes_may_lie_anywhere_and_are_not_kept(void) {
  SwModel *model = ready_model(0);
  const Saved saved = save(model);
  unsigned char *odd = malloc(saved.size + 1);
  memcpy(odd + 1, saved.bytes, saved.size);
  SwModel *loaded = NULL;
  OK(sw_model_load(odd + 1, saved.size, &loaded));
  memset(odd, 0xff, saved.size + 1);
  free(odd);
  const Seen expected = run(model), seen = run(loaded);
  CHECK(memcmp(&expected, &seen, sizeof seen) == 0);
  sw_model_destroy(model);
  sw_model_destroy(loaded);
  free(saved.bytes);
}

/* ------------------------------------------------------------------------------------------------------------ misuse */

static SwModel *const no_model = (SwModel *)(uintptr_t)0x10; /* never a handle; only compared, never used */

static void null_arguments_are_named(void) {
  SwModel *model = ready_model(0), *loaded = no_model;
  const Saved saved = save(model);
  unsigned char byte = 0xC5;
  uint64_t size = 77;
  FAILS(sw_model_save(NULL, &byte, 1, &size), SW_ERROR_INVALID_ARGUMENT, "model");
  FAILS(sw_model_save(model, NULL, 1, &size), SW_ERROR_INVALID_ARGUMENT, "bytes");
  FAILS(sw_model_save(model, &byte, 1, NULL), SW_ERROR_INVALID_ARGUMENT, "size");
  FAILS(sw_model_load(NULL, saved.size, &loaded), SW_ERROR_INVALID_ARGUMENT, "bytes");
  FAILS(sw_model_load(NULL, 0, &loaded), SW_ERROR_INVALID_ARGUMENT, "bytes");
  FAILS(sw_model_load(saved.bytes, saved.size, NULL), SW_ERROR_INVALID_ARGUMENT, "model");
  CHECK(byte == 0xC5 && size == 77 && loaded == no_model);
  sw_model_destroy(model);
  free(saved.bytes);
}

static void a_model_without_modes_cannot_be_saved(void) {
  const Strip strip = make_strip();
  SwModel *model = strip_model(&strip);
  uint64_t size = 77;
  FAILS(sw_model_save(model, NULL, 0, &size), SW_ERROR_NOT_PRECOMPUTED, "precompute");
  CHECK(size == 77);
  sw_model_destroy(model);
}

static void a_buffer_too_small_is_refused_and_left_alone(void) {
  SwModel *model = ready_model(0);
  const Saved saved = save(model);
  unsigned char *out = malloc(saved.size);
  uint64_t size = 77, changed = 0;
  memset(out, 0xC5, saved.size);
  FAILS(sw_model_save(model, out, saved.size - 1, &size), SW_ERROR_BUFFER_SIZE, "bytes");
  FAILS(sw_model_save(model, out, 0, &size), SW_ERROR_BUFFER_SIZE, "bytes");
  for (uint64_t k = 0; k < saved.size; ++k) changed += out[k] != 0xC5;
  CHECK(size == 77 && changed == 0);
  sw_model_destroy(model);
  free(saved.bytes);
  free(out);
}

/* Every length, each in a block of its own, so that a memory checker sees a byte read too many. */
static void truncated_and_lengthened_models_are_refused(void) {
  SwModel *model = ready_model(0), *loaded = no_model;
  const Saved saved = save(model);
  for (uint64_t size = 0; size < saved.size; size += size < 300 ? 1 : 997) {
    unsigned char *cut = malloc(size ? size : 1);
    memcpy(cut, saved.bytes, size);
    FAILS(sw_model_load(cut, size, &loaded), SW_ERROR_INVALID_DATA, "bytes");
    free(cut);
  }
  unsigned char *longer = calloc(saved.size + 1, 1);
  memcpy(longer, saved.bytes, saved.size);
  FAILS(sw_model_load(longer, saved.size + 1, &loaded), SW_ERROR_INVALID_DATA, "bytes");
  FAILS(sw_model_load(saved.bytes, UINT64_MAX, &loaded), SW_ERROR_INVALID_DATA, "bytes");
  CHECK(loaded == no_model);
  sw_model_destroy(model);
  free(saved.bytes);
  free(longer);
}

static void a_flipped_bit_anywhere_is_noticed(void) {
  SwModel *model = ready_model(0), *loaded = no_model;
  const Saved saved = save(model);
  for (uint64_t k = 0; k < saved.size; ++k) {
    const unsigned char bit = (unsigned char)(1u << k % 8);
    saved.bytes[k] ^= bit;
    FAILS(sw_model_load(saved.bytes, saved.size, &loaded), SW_ERROR_INVALID_DATA, "saved model");
    saved.bytes[k] ^= bit;
  }
  CHECK(loaded == no_model);
  sw_model_destroy(load(&saved));
  sw_model_destroy(model);
  free(saved.bytes);
}

static void saved_states_and_saved_models_are_told_apart(void) {
  SwModel *model = ready_model(0), *loaded = no_model;
  SwState *state = new_state(model, 0, 0);
  const Saved saved = save(model);
  unsigned char bytes[1024];
  uint64_t size;
  OK(sw_state_save(state, bytes, sizeof bytes, &size));
  FAILS(sw_model_load(bytes, size, &loaded), SW_ERROR_INVALID_DATA, "not a saved model");
  FAILS(sw_state_load(state, saved.bytes, saved.size), SW_ERROR_INVALID_DATA, "not a saved state");
  CHECK(loaded == no_model);
  sw_state_destroy(state);
  sw_model_destroy(model);
  free(saved.bytes);
}

int main(void) {
  RUN(a_loaded_model_moves_with_the_same_bytes);
  RUN(saved_states_go_from_a_model_to_its_loaded_twin);
  RUN(a_loaded_model_can_be_precomputed_anew_and_saved_again);
  RUN(bytes_may_lie_anywhere_and_are_not_kept);
  RUN(null_arguments_are_named);
  RUN(a_model_without_modes_cannot_be_saved);
  RUN(a_buffer_too_small_is_refused_and_left_alone);
  RUN(truncated_and_lengthened_models_are_refused);
  RUN(a_flipped_bit_anywhere_is_noticed);
  RUN(saved_states_and_saved_models_are_told_apart);
  return report_failures();
}

/* The table of methods: what hosts show and offer without knowing any method themselves. */
#include "test_support.h"

static void every_method_has_a_name_a_label_and_a_need_of_its_own_number(void) {
  const uint32_t known[] = {SW_METHOD_WARP,           SW_METHOD_LMA,           SW_METHOD_SHELL_IMPLICIT,
                            SW_METHOD_SHELL_EXPLICIT, SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_REDUCED_SHELL,
                            SW_METHOD_ROTATION_STRAIN, SW_METHOD_POLYNOMIAL_SHELL, SW_METHOD_AUTO};
  const uint32_t count = sw_method_count();
  CHECK(count >= sizeof known / sizeof known[0]);
  for (size_t k = 0; k < sizeof known / sizeof known[0]; ++k) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < count; ++i) found += sw_method_at(i) == known[k];
    CHECK(found == 1);
  }
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t method = sw_method_at(i);
    CHECK(method != 0 && strlen(sw_method_name(method)) > 0 && strlen(sw_method_label(method)) > 0);
    CHECK(sw_method_needs(method) != 0);
    for (uint32_t j = 0; j < i; ++j) CHECK(strcmp(sw_method_name(method), sw_method_name(sw_method_at(j))) != 0);
  }
  CHECK(strcmp(sw_method_name(SW_METHOD_WARP_VIRTUAL_WORK), "warp-virtual-work") == 0);
  CHECK(sw_method_at(0) == SW_METHOD_WARP && sw_method_at(count - 1) == SW_METHOD_AUTO);
}

static void numbers_that_are_no_method_have_no_name(void) {
  const uint32_t wrong[] = {0, 999, UINT32_MAX};
  CHECK(sw_method_at(sw_method_count()) == 0 && sw_method_at(UINT32_MAX) == 0);
  for (size_t k = 0; k < sizeof wrong / sizeof wrong[0]; ++k) {
    CHECK(strcmp(sw_method_name(wrong[k]), "") == 0 && strcmp(sw_method_label(wrong[k]), "") == 0);
    CHECK(sw_method_needs(wrong[k]) == 0);
  }
}

/* What sw_model_offers says is what sw_state_create does, for every method. */
static void check_offers(SwModel *model, uint32_t offered) {
  uint32_t told = 0;
  for (uint32_t i = 0; i < sw_method_count(); ++i) {
    SwStateDesc desc;
    SwState *state = NULL;
    sw_state_desc_init(&desc);
    desc.method = sw_method_at(i);
    const SwStatus promise = sw_model_offers(model, desc.method);
    CHECK(promise == sw_state_create(model, &desc, &state));
    CHECK(promise == SW_OK || promise == SW_ERROR_UNSUPPORTED);
    told += promise == SW_OK;
    sw_state_destroy(state);
  }
  CHECK(told == offered);
  sw_model_destroy(model);
}

static void a_model_offers_what_states_can_be_made_of(void) {
  const Strip strip = make_strip();
  SwPrecomputeDesc desc;
  SwModel *model = strip_model(&strip);
  FAILS(sw_model_offers(model, SW_METHOD_WARP), SW_ERROR_NOT_PRECOMPUTED, "sw_model_precompute");
  precompute(model, 4, SW_PRECISION_F32);
  FAILS(sw_model_offers(model, 999), SW_ERROR_INVALID_ARGUMENT, "method is 999");
  FAILS(sw_model_offers(model, SW_METHOD_REDUCED_SHELL), SW_ERROR_UNSUPPORTED, "reduced_fields");
  FAILS(sw_model_offers(model, SW_METHOD_POLYNOMIAL_SHELL), SW_ERROR_UNSUPPORTED, "reduced_fields");
  FAILS(sw_model_offers(model, SW_METHOD_AUTO), SW_ERROR_UNSUPPORTED, "auto_error");
  check_offers(model, 6); /* all but the reduced shells and the choice */

  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  desc.flags = SW_PRECOMPUTE_LINEAR;
  model = strip_model(&strip);
  OK(sw_model_precompute(model, &desc));
  FAILS(sw_model_offers(model, SW_METHOD_WARP), SW_ERROR_UNSUPPORTED, "rotations");
  check_offers(model, 3); /* linear modes and the full shell by two integrators */

  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  desc.reduced_fields = 4;
  desc.reduced_flags = SW_REDUCED_UNTRAINED;
  model = strip_model(&strip);
  OK(sw_model_precompute(model, &desc));
  check_offers(model, sw_method_count()); /* the choice is the sampled form: the gate has no training to go by */
}

int main(void) {
  RUN(every_method_has_a_name_a_label_and_a_need_of_its_own_number);
  RUN(numbers_that_are_no_method_have_no_name);
  RUN(a_model_offers_what_states_can_be_made_of);
  return report_failures();
}

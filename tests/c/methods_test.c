/* The table of methods: what hosts show and offer without knowing any method themselves. */
#include "test_support.h"

static void every_method_has_a_name_a_label_and_a_need_of_its_own_number(void) {
  const uint32_t known[] = {SW_METHOD_WARP,           SW_METHOD_LMA,           SW_METHOD_SHELL_IMPLICIT,
                            SW_METHOD_SHELL_EXPLICIT, SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_REDUCED_SHELL,
                            SW_METHOD_ROTATION_STRAIN, SW_METHOD_POLYNOMIAL_SHELL, SW_METHOD_ADAPTIVE_SHELL, SW_METHOD_AUTO};
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

static uint32_t auto_method(const SwModel *model) {
  SwModelInfo info;
  sw_model_info_init(&info);
  OK(sw_model_info(model, &info));
  return info.auto_method;
}

/* Whether it is asked for when the state is made or afterwards, and whatever integrator is asked for beside it. */
static void the_choice_moves_by_steps_of_second_order(const SwModel *model) {
  const double down[3] = {0, 0, -9.8};
  const uint32_t methods[3] = {SW_METHOD_SHELL_IMPLICIT, SW_METHOD_AUTO, SW_METHOD_WARP};
  SwStateReport reports[3];
  for (int k = 0; k < 3; ++k) {
    SwStateDesc desc;
    SwState *state = NULL;
    sw_state_desc_init(&desc);
    desc.method = methods[k];
    desc.integrator = k == 0 ? SW_INTEGRATOR_SECOND_ORDER : SW_INTEGRATOR_IMPLICIT_EULER;
    OK(sw_state_create(model, &desc, &state));
    if (k == 2) OK(sw_state_set_method(state, SW_METHOD_AUTO));
    OK(sw_state_set_gravity(state, down));
    for (int step = 0; step < 3; ++step) OK(sw_state_step(state, 1.0 / 24));
    sw_state_report_init(&reports[k]);
    OK(sw_state_report(state, &reports[k]));
    sw_state_destroy(state);
  }
  CHECK(reports[0].kinetic_energy > 0 && reports[0].kinetic_energy == reports[1].kinetic_energy && reports[0].kinetic_energy == reports[2].kinetic_energy);
}

/* Of a shell that is held, one that moves freely, one whose training may find next to nothing; and with a budget beside. */
static void a_model_made_for_the_choice_has_a_reduced_shell_where_it_can(void) {
  const Strip strip = make_strip();
  SwPrecomputeDesc desc;
  const SwMeshDesc mesh = strip_mesh(&strip);
  SwMaterialDesc material;
  SwSupportDesc none;
  SwModel *model = strip_model(&strip), *floating = NULL;
  sw_precompute_desc_init(&desc);
  desc.modes = 130;
  desc.flags = SW_PRECOMPUTE_AUTO;
  OK(sw_model_precompute(model, &desc));
  FAILS(sw_model_offers(model, SW_METHOD_POLYNOMIAL_SHELL), SW_ERROR_UNSUPPORTED, "leave no room for fields");
  CHECK(auto_method(model) == SW_METHOD_WARP);
  desc.modes = 4;
  desc.reduced_fields = 4;
  OK(sw_model_precompute(model, &desc));
  OK(sw_model_offers(model, SW_METHOD_POLYNOMIAL_SHELL));
  CHECK(sw_method_needs(auto_method(model)) == SW_NEEDS_REDUCED_FIELDS);
  desc.reduced_poses = 1;
  OK(sw_model_precompute(model, &desc));
  FAILS(sw_model_offers(model, SW_METHOD_REDUCED_SHELL), SW_ERROR_UNSUPPORTED, "too few to judge");
  CHECK(auto_method(model) == SW_METHOD_WARP);
  desc.flags |= SW_PRECOMPUTE_AUTO_FULL;
  OK(sw_model_precompute(model, &desc));
  CHECK(auto_method(model) == SW_METHOD_SHELL_IMPLICIT);
  the_choice_moves_by_steps_of_second_order(model);
  desc.flags = SW_PRECOMPUTE_AUTO;
  desc.reduced_poses = 0;
  desc.support_fields = 2;
  OK(sw_model_precompute(model, &desc));
  FAILS(sw_model_offers(model, SW_METHOD_REDUCED_SHELL), SW_ERROR_UNSUPPORTED, "supports that move");
  sw_model_destroy(model);

  sw_material_desc_init(&material);
  sw_support_desc_init(&none);
  material.area_density = material.k_bend = 1;
  material.k_area = material.k_length = 1e4;
  OK(sw_model_create(&mesh, &material, &none, &floating));
  desc.support_fields = 0;
  OK(sw_model_precompute(floating, &desc));
  CHECK(sw_model_offers(floating, SW_METHOD_AUTO) == SW_OK);
  sw_model_destroy(floating);
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
  CHECK(auto_method(model) == SW_METHOD_WARP);
  check_offers(model, 7); /* all but the reduced shells */

  sw_precompute_desc_init(&desc);
  desc.modes = 4;
  desc.flags = SW_PRECOMPUTE_LINEAR;
  model = strip_model(&strip);
  OK(sw_model_precompute(model, &desc));
  FAILS(sw_model_offers(model, SW_METHOD_WARP), SW_ERROR_UNSUPPORTED, "rotations");
  CHECK(auto_method(model) == SW_METHOD_LMA);
  check_offers(model, 4); /* linear modes, for the choice too, and the full shell by two integrators */

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
  RUN(a_model_made_for_the_choice_has_a_reduced_shell_where_it_can);
  return report_failures();
}

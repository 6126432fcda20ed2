//! A panic forced inside every exported function becomes SW_ERROR_INTERNAL, prints nothing and poisons the handle.

use super::batch::*;
use super::binding::*;
use super::certify::*;
use super::collider::*;
use super::constraint::*;
use super::load::*;
use super::log::sw_set_log_callback;
use super::mesh::*;
use super::method::*;
use super::model::*;
use super::plan::*;
use super::preset::*;
use super::proxy::*;
use super::state::*;
use super::status::*;
use super::supports::*;
use std::cell::Cell;
use std::ffi::CStr;
use std::ptr::{null, null_mut};

/// Where a panic can be forced.
#[derive(Clone, Copy, PartialEq)]
pub enum Point {
    /// At the start of an exported function's body.
    Guard,
    /// While a handle is held exclusively.
    Exclusive,
    /// In the step of one of many states.
    Step,
}

thread_local! {
    static ASKED: Cell<Option<Point>> = const { Cell::new(None) };
}

pub fn panic_if_asked(point: Point) {
    if ASKED.get() == Some(point) {
        ASKED.set(None);
        panic!("forced by the test");
    }
}

fn last_message() -> String {
    // SAFETY: never NULL, NUL-terminated.
    unsafe { CStr::from_ptr(sw_last_error_message()) }.to_str().unwrap().to_owned()
}

const POSITIONS: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
const TRIANGLES: [u32; 6] = [0, 1, 2, 0, 2, 3];

fn square() -> SwMeshDesc {
    let mut mesh: SwMeshDesc = super::structs::Described::initial();
    mesh.position_format = super::pointer::SW_FORMAT_F64;
    mesh.positions = POSITIONS.as_ptr().cast();
    mesh.triangles = TRIANGLES.as_ptr();
    (mesh.n_vertices, mesh.n_triangles) = (4, 2);
    mesh
}

/// A precomputed model and a state of the square.
fn objects() -> (*mut SwModel, *mut SwState) {
    let (mut model, mut state) = (null_mut(), null_mut());
    // SAFETY: valid descriptors and outputs.
    unsafe {
        assert_eq!(sw_model_create(&square(), null(), null(), &mut model), SW_OK);
        assert_eq!(sw_model_precompute(model, null()), SW_OK);
        assert_eq!(sw_state_create(model, null(), &mut state), SW_OK);
    }
    (model, state)
}

type Call<'a> = (&'static str, Box<dyn Fn() -> SwStatus + 'a>);

/// Every exported function that returns a status, by name, with arguments that matter only to the functions' bodies.
fn status_calls<'a>(model: *mut SwModel, state: *mut SwState) -> Vec<Call<'a>> {
    macro_rules! calls {
        ($($name:ident($($argument:expr),*)),* $(,)?) => {
            // SAFETY: each call panics before it looks at its arguments.
            vec![$((stringify!($name), Box::new(move || unsafe { $name($($argument),*) }) as Box<dyn Fn() -> SwStatus>)),*]
        };
    }
    calls![
        sw_set_log_callback(None, null_mut()),
        sw_mesh_check(null(), null_mut(), 0, 0, null_mut()),
        sw_model_create(null(), null(), null(), null_mut()),
        sw_model_precompute(model, null()),
        sw_model_info(model, null_mut()),
        sw_model_frequencies(model, null_mut(), 0, null_mut()),
        sw_model_front(model, null_mut(), 0, 0, null_mut()),
        sw_model_offers(model, 1),
        sw_model_mode_shape(model, 0, 0, 0, null_mut(), 0, 0),
        sw_model_save(model, null_mut(), 0, null_mut()),
        sw_model_load(null(), 0, null_mut()),
        sw_state_create(model, null(), null_mut()),
        sw_state_reset(state),
        sw_state_clone(state, null_mut()),
        sw_state_set_gravity(state, null()),
        sw_state_set_damping(state, null()),
        sw_state_set_frame(state, null()),
        sw_state_move_supports(state, 0, null(), 0, 0, 0),
        sw_state_move_rest(state, 0, null(), 0, 0, 0),
        sw_state_set_amplitudes(state, null(), null(), 0),
        sw_state_set_pose(state, 0, 0, null(), 0, null(), 0, 0, null_mut()),
        sw_state_amplitudes(state, null_mut(), null_mut(), 0, null_mut()),
        sw_state_set_constraint(state, null()),
        sw_state_clear_constraint(state, 0),
        sw_state_constraint_report(state, null_mut(), 0, 0, null_mut()),
        sw_state_set_forces(state, null()),
        sw_state_set_wind(state, null()),
        sw_state_equilibrium(state, null_mut()),
        sw_state_equilibrium_watched(state, null_mut(), None, null_mut()),
        sw_state_step(state, 0.0),
        sw_state_positions(state, 0, 0, null_mut(), 0, 0),
        sw_state_normals(state, 0, 0, null_mut(), 0, 0),
        sw_state_rotations(state, 0, 0, null_mut(), 0, 0),
        sw_state_report(state, null_mut()),
        sw_state_save(state, null_mut(), 0, null_mut()),
        sw_state_load(state, null(), 0),
        sw_state_positions_of(state, 0, 0, null(), 0, null_mut(), 0),
        sw_state_set_rest_tolerance(state, -1.0),
        sw_state_set_stiffness(state, -1.0),
        sw_state_set_frequency(state, -1.0, null_mut()),
        sw_state_set_sag(state, -1.0, 0.0, null_mut()),
        sw_state_certify(state, null_mut()),
        sw_state_certify_watched(state, null_mut(), None, null_mut()),
        sw_state_correct(state, MOST_STEPS + 1),
        sw_state_correct_watched(state, MOST_STEPS + 1, None, null_mut()),
        sw_state_positions_corrected(state, 1, 0, 0, null_mut(), 0, 0),
        sw_state_fall_back(state, null_mut()),
        sw_state_fall_back_watched(state, null_mut(), None, null_mut()),
        sw_state_set_method(state, 1),
        sw_state_plan(state, 0.0, null_mut(), 0, 0, null_mut()),
        sw_state_plan_text(state, 0.0, null_mut(), 0, null_mut()),
        sw_binding_create(model, null(), null_mut()),
        sw_binding_info(null(), null_mut()),
        sw_binding_save(null(), null_mut(), 0, null_mut()),
        sw_binding_load(model, null(), 0, null_mut()),
        sw_proxy_create(null(), null(), null_mut()),
        sw_proxy_info(null(), null_mut()),
        sw_proxy_positions(null(), 0, null_mut(), 0, 0),
        sw_proxy_triangles(null(), null_mut(), 0),
        sw_proxy_sources(null(), null_mut(), null_mut(), 0),
        sw_proxy_nearest(null(), null_mut(), 0),
        sw_model_calibrate(null_mut(), null(), null(), null_mut()),
        sw_state_bound_points(state, null(), null()),
        sw_collider_create(null(), null_mut()),
        sw_collider_save(null(), null_mut(), 0, null_mut()),
        sw_collider_load(null(), 0, null_mut()),
        sw_state_set_colliders(state, null(), 0),
        sw_state_move_collider(state, 0, null()),
        sw_state_deform_collider(state, 0, 0, 1, null(), 0, 0),
        sw_fit_capsule(1, null(), 0, 0, null_mut()),
        sw_model_patches_near(model, null(), null(), 0, 1.0, null_mut(), 0, null_mut()),
        sw_state_positions_outside(state, 0, 0, null_mut(), 0, 0, null_mut()),
        sw_state_contacts(state, null_mut(), 0, 0, null_mut()),
        sw_states_step(null(), 0, 0.0, null_mut()),
        sw_set_threads(0),
        sw_preset_material(0, 1.0, null_mut()),
    ]
}

/// The exported functions that cannot fail and so have no status.
const WITHOUT_STATUS: [&str; 20] = [
    "sw_abi_version",
    "sw_features",
    "sw_version_string",
    "sw_status_string",
    "sw_last_error_message",
    "sw_method_at",
    "sw_method_count",
    "sw_method_label",
    "sw_method_name",
    "sw_method_needs",
    "sw_preset_count",
    "sw_preset_label",
    "sw_preset_name",
    "sw_preset_source",
    "sw_struct_init",
    "sw_binding_destroy",
    "sw_proxy_destroy",
    "sw_collider_destroy",
    "sw_model_destroy",
    "sw_state_destroy",
];

#[test]
fn every_exported_function_is_in_the_panic_test() {
    let (model, state) = (null_mut(), null_mut());
    let mut tested: Vec<&str> = status_calls(model, state).iter().map(|(name, _)| *name).collect();
    tested.extend(WITHOUT_STATUS);
    tested.sort_unstable();
    let listed = include_str!("../../tests/c/exported_symbols.txt");
    let listed: Vec<&str> = listed.lines().map(str::trim).filter(|l| l.starts_with("sw_")).collect();
    assert_eq!(tested, listed);
}

/// No host's struct is shorter, and every host's of the first version is read.
#[test]
#[cfg(target_pointer_width = "64")]
fn the_first_version_of_each_struct_is_the_frozen_one() {
    macro_rules! firsts {
        ($($type:ident),*) => {
            vec![$(format!("STRUCT({}, {})", stringify!($type), <$type as super::structs::Grows>::FIRST)),*]
        };
    }
    let mut firsts = firsts![
        SwMeshDesc,
        SwDiagnostic,
        SwMaterialDesc,
        SwMaterialMap,
        SwSupportDesc,
        SwPrecomputeDesc,
        SwModelInfo,
        SwFrontPoint,
        SwStateDesc,
        SwDampingDesc,
        SwFrameDesc,
        SwStateReport,
        SwConstraintDesc,
        SwConstraintReport,
        SwForceDesc,
        SwWindDesc,
        SwEquilibriumReport,
        SwCertificate,
        SwPlanPart,
        SwColliderDesc,
        SwColliderPoseDesc,
        SwContact,
        SwCapsuleFit,
        SwBindingDesc,
        SwBindingInfo,
        SwProxyDesc,
        SwProxyInfo,
        SwBoundPointsDesc
    ];
    let frozen = include_str!("../../tests/growth/first/struct_layout.def");
    let mut frozen: Vec<&str> = frozen.lines().filter(|line| line.starts_with("STRUCT")).collect();
    firsts.sort_unstable();
    frozen.sort_unstable();
    assert_eq!(firsts, frozen);
}

#[test]
fn a_panic_in_any_exported_function_becomes_a_status() {
    let (model, state) = objects();
    for (name, call) in status_calls(model, state) {
        ASKED.set(Some(Point::Guard));
        assert_eq!(call(), SW_ERROR_INTERNAL, "{name}");
        assert!(last_message().contains("forced by the test"), "{name}: {}", last_message());
    }
    // SAFETY: valid descriptors, NULL or live handles.
    unsafe {
        // The functions without a status: the panic must come, and stay inside. sw_abi_version, sw_struct_init and the
        // three that return strings have nothing inside that could panic.
        macro_rules! stays_inside {
            ($($call:expr),* $(,)?) => {
                $(
                    ASKED.set(Some(Point::Guard));
                    $call;
                    assert!(ASKED.get().is_none(), "{}", stringify!($call));
                )*
            };
        }
        stays_inside![
            sw_model_destroy(null_mut()),
            sw_state_destroy(null_mut()),
            sw_collider_destroy(null_mut()),
            sw_binding_destroy(null_mut()),
            sw_proxy_destroy(null_mut()),
        ];
        // The handles were not poisoned: nothing held them.
        assert_eq!(sw_state_step(state, 0.1), SW_OK);
        sw_state_destroy(state);
        sw_model_destroy(model);
    }
}

#[test]
fn a_panic_while_a_handle_is_held_poisons_it_alone() {
    let (model, state) = objects();
    // SAFETY: live handles.
    unsafe {
        ASKED.set(Some(Point::Exclusive));
        assert_eq!(sw_state_step(state, 0.1), SW_ERROR_INTERNAL);
        assert_eq!(sw_state_step(state, 0.1), SW_ERROR_INTERNAL);
        assert_eq!(last_message(), "the state is poisoned by an earlier internal error");
        assert_eq!(sw_state_positions(state, 0, 2, null_mut(), 0, 4), SW_ERROR_INTERNAL);
        let mut other = null_mut();
        assert_eq!(sw_state_create(model, null(), &mut other), SW_OK);
        assert_eq!(sw_state_step(other, 0.1), SW_OK);
        ASKED.set(Some(Point::Exclusive));
        assert_eq!(sw_model_precompute(model, null()), SW_ERROR_INTERNAL);
        assert_eq!(sw_model_precompute(model, null()), SW_ERROR_INTERNAL);
        assert_eq!(last_message(), "the model is poisoned by an earlier internal error");
        assert_eq!(sw_state_step(other, 0.1), SW_OK, "states of a poisoned model live on");
        sw_state_destroy(state);
        sw_state_destroy(other);
        sw_model_destroy(model);
    }
}

#[test]
fn a_panic_in_the_step_of_one_of_many_poisons_it_alone() {
    let (model, first) = objects();
    let mut second = null_mut();
    let mut statuses = [99; 2];
    // SAFETY: live handles.
    unsafe {
        assert_eq!(sw_state_create(model, null(), &mut second), SW_OK);
        let both = [first, second];
        ASKED.set(Some(Point::Step)); // little work: on this thread, and the first state
        assert_eq!(sw_states_step(both.as_ptr(), 2, 0.1, statuses.as_mut_ptr()), SW_ERROR_INTERNAL);
        assert_eq!(statuses, [SW_ERROR_INTERNAL, SW_OK]);
        assert!(last_message().starts_with("states[0]: internal error"), "{}", last_message());
        assert!(last_message().contains("forced by the test"), "{}", last_message());
        assert_eq!(sw_states_step(both.as_ptr(), 2, 0.1, statuses.as_mut_ptr()), SW_ERROR_INTERNAL);
        assert_eq!(statuses, [SW_ERROR_INTERNAL, SW_OK]);
        assert_eq!(last_message(), "states[0]: the state is poisoned by an earlier internal error");
        assert_eq!(sw_state_step(second, 0.1), SW_OK);
        sw_state_destroy(first);
        sw_state_destroy(second);
        sw_model_destroy(model);
    }
}

#[test]
fn a_panic_on_a_thread_of_a_training_ends_the_call_with_its_text() {
    // The caller's item ends when the other thread's has fallen.
    let caller = std::thread::current().id();
    let body = |_: &mut (), _: &mut usize, go_on: crate::threads::GoOn| {
        if std::thread::current().id() != caller {
            panic!("the training fell");
        }
        for _ in 0..10_000 {
            go_on()?;
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        panic!("the other thread never began");
    };
    assert!(crate::threads::set_threads(2));
    let status =
        super::guard::guard(|| Ok(crate::threads::for_each_long(&mut [0, 1], 2, || Ok(()), body, &mut |_| Ok(()))?));
    assert_eq!(status, SW_ERROR_INTERNAL);
    assert!(last_message().contains("the training fell"), "{}", last_message());
}

#[test]
fn a_handle_in_use_is_busy() {
    let (model, state) = objects();
    // SAFETY: live handles.
    unsafe {
        let held = (*state).state.read().unwrap();
        assert_eq!(sw_state_step(state, 0.1), SW_ERROR_BUSY);
        let mut size = 0;
        assert_eq!(sw_state_save(state, null_mut(), 0, &mut size), SW_OK, "const functions may run together");
        drop(held);
        assert_eq!(sw_state_step(state, 0.1), SW_OK);
        sw_state_destroy(state);
        sw_model_destroy(model);
    }
}

#[test]
fn long_messages_are_cut_at_a_character() {
    remember(&"ä".repeat(2000));
    let message = last_message();
    assert!(message.len() < 1024 && message.chars().all(|c| c == 'ä'));
}

//! What a host may rely on at the interface itself: no SW_OK with a number that is none, and frames that allocate nothing.

#![allow(unsafe_code)] // a host's calls across the interface: live handles, valid descriptors, buffers of the mesh's size
#![allow(clippy::undocumented_unsafe_blocks)] // the above holds in each
use crate::common::*;
use shellwarp::Vec3;
use shellwarp::ffi::certify::*;
use shellwarp::ffi::constraint::*;
use shellwarp::ffi::load::*;
use shellwarp::ffi::mesh::*;
use shellwarp::ffi::method::*;
use shellwarp::ffi::model::*;
use shellwarp::ffi::plan::*;
use shellwarp::ffi::pointer::{SW_FORMAT_F32, SW_FORMAT_F64};
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ffi::CStr;
use std::ptr::null_mut;

/// From nothing to what is no number, either side.
const VALUES: [f64; 17] = [
    0.0,
    5e-324,
    1e-300,
    1e-100,
    1e-30,
    1e30,
    1e100,
    1e300,
    f64::MAX,
    -5e-324,
    -1e-30,
    -1e30,
    -1e100,
    f64::MIN,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

fn fresh<T: Described>() -> T {
    T::initial()
}

fn message() -> String {
    // SAFETY: never NULL, NUL-terminated.
    unsafe { CStr::from_ptr(sw_last_error_message()) }.to_str().unwrap().to_owned()
}

#[track_caller]
fn all_finite(what: &str, numbers: &[f64]) {
    if let Some(k) = numbers.iter().position(|x| !x.is_finite()) {
        panic!("{what}: number {k} is {} and the call was SW_OK", numbers[k]);
    }
}

/// Whether the call was good. A refusal is one of a value or of what would come of it, and names the field if the value is none.
#[track_caller]
fn good(what: &str, field: &str, value: f64, status: SwStatus) -> bool {
    if status == SW_OK {
        return true;
    }
    let known = [SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL, SW_ERROR_UNSUPPORTED];
    assert!(known.contains(&status), "{what}: {status}: {}", message());
    if !value.is_finite() && status == SW_ERROR_INVALID_ARGUMENT {
        let named = message().contains(field) && message().contains(&format!("{value}"));
        assert!(named, "{what}: '{}' names not both {field} and {value}", message());
    }
    false
}

struct Sheet {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    held: Vec<u32>,
}

impl Sheet {
    fn new() -> Self {
        let (positions, triangles) = equilateral_sheet(4, 2, 0.25);
        let held = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.2).collect();
        Self { positions, triangles, held }
    }

    fn n(&self) -> u32 {
        self.positions.len() as u32
    }

    fn tip(&self) -> u32 {
        (0..self.n()).max_by(|a, b| self.positions[*a as usize].x.total_cmp(&self.positions[*b as usize].x)).unwrap()
    }

    fn model(&self, material: &SwMaterialDesc, what: &str, field: &str, value: f64) -> *mut SwModel {
        let mut mesh: SwMeshDesc = fresh();
        mesh.position_format = SW_FORMAT_F64;
        mesh.positions = self.positions.as_ptr().cast();
        mesh.triangles = self.triangles.as_ptr().cast();
        (mesh.n_vertices, mesh.n_triangles) = (self.n(), self.triangles.len() as u32);
        let mut supports: SwSupportDesc = fresh();
        (supports.fixed, supports.n_fixed) = (self.held.as_ptr(), self.held.len() as u32);
        let mut model = null_mut();
        // SAFETY: valid descriptors and output.
        let status = unsafe { sw_model_create(&mesh, material, &supports, &mut model) };
        if good(what, field, value, status) { model } else { null_mut() }
    }
}

/// Few of everything.
fn small() -> SwPrecomputeDesc {
    let mut desc: SwPrecomputeDesc = fresh();
    (desc.modes, desc.reduced_fields, desc.reduced_poses) = (4, 3, 2);
    desc
}

/// Every number that a model tells; it can be saved and loaded.
unsafe fn judge_model(what: &str, model: *mut SwModel, n: u32) {
    unsafe {
        let mut info: SwModelInfo = fresh();
        assert_eq!(sw_model_info(model, &mut info), SW_OK, "{what}");
        let of_modes = [info.residual, info.orthonormality, info.inertia_shift, info.eigenvalue_disagreement];
        let of_shell = [info.total_mass, info.total_area, info.size, info.basis_rounding, info.truncation_bound];
        let of_choice = [info.reduced_residual, info.auto_error];
        all_finite(what, &[&of_modes[..], &of_shell, &of_choice, &info.effective_mass, &info.seconds].concat());
        let (mut hertz, mut count) = (vec![0.0; 64], 0);
        assert_eq!(sw_model_frequencies(model, hertz.as_mut_ptr(), 64, &mut count), SW_OK);
        all_finite(what, &hertz);
        let mut shape = vec![0f32; 3 * n as usize];
        if sw_model_mode_shape(model, 0, SW_SHAPE_ROTATION, SW_FORMAT_F32, shape.as_mut_ptr().cast(), 0, n) == SW_OK {
            assert!(shape.iter().all(|x| x.is_finite()), "{what}: a mode's rotations");
        }
        let mut size = 0;
        assert_eq!(sw_model_save(model, null_mut(), 0, &mut size), SW_OK, "{what}: {}", message());
        let mut bytes = vec![0u8; size as usize];
        assert_eq!(sw_model_save(model, bytes.as_mut_ptr().cast(), size, &mut size), SW_OK);
        let mut loaded = null_mut();
        assert_eq!(sw_model_load(bytes.as_ptr().cast(), size, &mut loaded), SW_OK, "{what}: {}", message());
        sw_model_destroy(loaded);
    }
}

/// Every number that a state tells.
unsafe fn judge_state(what: &str, state: *mut SwState, n: u32, certify: bool) {
    unsafe {
        for space in [SW_SPACE_WORLD, SW_SPACE_FRAME] {
            let mut narrow = vec![0f32; 4 * n as usize];
            let mut wide = vec![0f64; 4 * n as usize];
            let (f32s, f64s) = (narrow.as_mut_ptr().cast(), wide.as_mut_ptr().cast());
            for call in [sw_state_positions, sw_state_normals, sw_state_rotations] {
                for (format, out) in [(SW_FORMAT_F32, f32s), (SW_FORMAT_F64, f64s)] {
                    let status = call(state, space, format, out, 0, n);
                    assert!([SW_OK, SW_ERROR_NUMERICAL].contains(&status), "{what}: {}", message());
                }
                all_finite(what, &wide);
                assert!(narrow.iter().all(|x| x.is_finite()), "{what}: {narrow:?}");
            }
            let vertices = [n - 1, 0];
            sw_state_positions_of(state, space, SW_FORMAT_F32, vertices.as_ptr(), 2, f32s, 0);
            assert!(narrow.iter().all(|x| x.is_finite()), "{what}: {narrow:?}");
        }
        let mut report: SwStateReport = fresh();
        if sw_state_report(state, &mut report) == SW_OK {
            let energies = [report.kinetic_energy, report.elastic_energy, report.constraint_work, report.time];
            let measures = [report.max_rotation, report.max_displacement, report.fraction_turned_too_far];
            all_finite(&format!("{what}: report"), &[&energies[..], &measures].concat());
        }
        let mut reports = [std::mem::zeroed::<SwConstraintReport>(); 4];
        let mut count = 0;
        assert_eq!(
            sw_state_constraint_report(state, reports.as_mut_ptr(), size_of_val(&reports[0]) as u32, 4, &mut count),
            SW_OK
        );
        reports.iter().for_each(|r| all_finite(what, &[&r.force[..], &[r.residual]].concat()));
        let mut certificate: SwCertificate = fresh();
        if certify && sw_state_certify(state, &mut certificate) == SW_OK {
            let SwCertificate { error, max_error, residual, remaining, .. } = certificate;
            all_finite(&format!("{what}: certificate"), &[error, max_error, residual, remaining]);
        }
        let mut parts = [std::mem::zeroed::<SwPlanPart>(); 16];
        assert_eq!(
            sw_state_plan(state, 0.01, parts.as_mut_ptr(), size_of_val(&parts[0]) as u32, 16, &mut count),
            SW_OK,
            "{what}: {}",
            message()
        );
        parts.iter().for_each(|part| all_finite(what, &[part.operations]));
        let mut saved = vec![0u8; 1 << 16];
        let mut size = 0;
        assert_eq!(sw_state_save(state, saved.as_mut_ptr().cast(), saved.len() as u64, &mut size), SW_OK);
        assert_eq!(sw_state_load(state, saved.as_ptr().cast(), size), SW_OK, "{what}: {}", message());
    }
}

unsafe fn state_of(model: *mut SwModel, method: u32) -> *mut SwState {
    let mut desc: SwStateDesc = fresh();
    desc.method = method;
    let mut state = null_mut();
    assert_eq!(unsafe { sw_state_create(model, &desc, &mut state) }, SW_OK, "method {method}: {}", message());
    state
}

#[test]
fn no_number_of_a_material_makes_a_model_that_tells_none() {
    type Field = (&'static str, fn(&mut SwMaterialDesc, f64));
    let fields: [Field; 4] = [
        ("k_area", |desc, x| desc.k_area = x),
        ("k_length", |desc, x| desc.k_length = x),
        ("k_bend", |desc, x| desc.k_bend = x),
        ("area_density", |desc, x| desc.area_density = x),
    ];
    let sheet = Sheet::new();
    for (field, set) in fields {
        for value in VALUES {
            let what = format!("{field} {value:e}");
            let mut material: SwMaterialDesc = fresh();
            set(&mut material, value);
            let model = sheet.model(&material, &what, field, value);
            if model.is_null() {
                continue;
            }
            // SAFETY: a live handle.
            unsafe {
                if good(&what, field, 0.0, sw_model_precompute(model, &small())) {
                    judge_model(&what, model, sheet.n());
                    let state = state_of(model, SW_METHOD_WARP);
                    sw_state_set_gravity(state, [0.0, 0.0, -1.0].as_ptr());
                    sw_state_step(state, 0.03);
                    judge_state(&what, state, sheet.n(), true);
                    sw_state_destroy(state);
                }
                sw_model_destroy(model);
            }
        }
    }
}

#[test]
fn no_number_of_a_precompute_makes_a_model_that_tells_none() {
    type Field = (&'static str, fn(&mut SwPrecomputeDesc, f64));
    let demand = |desc: &mut SwPrecomputeDesc| (desc.tolerance, desc.demand_gravity[2]) = (1e-3, -1.0);
    let fields: [Field; 12] = [
        ("sag_gravity[2]", |desc, x| (desc.sag_gravity[2], desc.reduced_fields, desc.reduced_poses) = (x, 0, 0)),
        ("tolerance", |desc, x| desc.tolerance = x),
        ("demand_gravity", |desc, x| desc.demand_gravity[2] = x),
        ("demand_acceleration", |desc, x| desc.demand_acceleration = x),
        ("demand_amplification", |desc, x| desc.demand_amplification = x),
        ("handle_distance", |desc, x| desc.handle_distance = x),
        ("handle_speed", |desc, x| (desc.handle_speed, desc.handle_distance) = (x, 0.1)),
        ("reduced_gravity", |desc, x| desc.reduced_gravity = x),
        ("reduced_seconds", |desc, x| desc.reduced_seconds = x),
        ("reduced_mode_searches", |desc, x| desc.reduced_mode_searches = x),
        ("auto_error", |desc, x| desc.auto_error = x),
        ("auto_operations", |desc, x| desc.auto_operations = x),
    ];
    let sheet = Sheet::new();
    let model = sheet.model(&fresh(), "", "", 0.0);
    let handles = [sheet.tip()];
    for (field, set) in fields {
        for value in VALUES {
            let what = format!("{field} {value:e}");
            let mut desc = small();
            demand(&mut desc);
            (desc.handles, desc.n_handles) = (handles.as_ptr(), 1);
            set(&mut desc, value);
            // SAFETY: a live handle and a valid descriptor.
            unsafe {
                if good(&what, field, value, sw_model_precompute(model, &desc)) {
                    judge_model(&what, model, sheet.n());
                }
            }
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

/// Sets one number of a state.
type Set = fn(*mut SwState, u32, f64) -> SwStatus;

/// Name in messages, and how to set it, with some else that lets it matter.
const INPUTS: [(&str, Set); 19] = [
    // SAFETY of all: a live handle and valid descriptors.
    ("gravity[2]", |state, _, x| unsafe { sw_state_set_gravity(state, [0.0, 0.0, x].as_ptr()) }),
    ("mass_coefficient", |state, _, x| damp(state, [x, 0.0], None)),
    ("stiffness_coefficient", |state, _, x| damp(state, [0.0, x], None)),
    ("ratios[0]", |state, _, x| damp(state, [0.0; 2], Some(x))),
    ("origin[0]", |state, _, x| frame(state, SW_FRAME_TELEPORT, |desc| desc.origin[0] = x)),
    ("origin[1]", |state, _, x| frame(state, 0, |desc| desc.origin[1] = x)),
    ("rotation[1]", |state, _, x| frame(state, 0, |desc| desc.rotation = [1.0, x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])),
    ("velocity[0]", |state, _, x| frame(state, SW_FRAME_MOTION_GIVEN, |desc| desc.velocity[0] = x)),
    ("acceleration[1]", |state, _, x| frame(state, SW_FRAME_MOTION_GIVEN, |desc| desc.acceleration[1] = x)),
    ("angular_velocity[2]", |state, _, x| frame(state, SW_FRAME_MOTION_GIVEN, |desc| desc.angular_velocity[2] = x)),
    ("angular_acceleration[0]", |state, _, x| {
        frame(state, SW_FRAME_MOTION_GIVEN, |desc| desc.angular_acceleration[0] = x)
    }),
    ("compliance", |state, tip, x| hold(state, tip, |desc| (desc.compliance, desc.position) = (x, [1.0, 0.2, 0.1]))),
    ("position[2]", |state, tip, x| hold(state, tip, |desc| (desc.position, desc.axes) = ([0.0, 0.0, x], SW_AXIS_Z))),
    ("force 0", |state, tip, x| {
        let mut desc: SwForceDesc = fresh();
        let (force, vertex) = ([0.0, 0.0, x], tip);
        (desc.format, desc.count) = (SW_FORMAT_F64, 1);
        (desc.forces, desc.vertices) = (force.as_ptr().cast(), &vertex);
        unsafe { sw_state_set_forces(state, &desc) }
    }),
    ("velocity[1]", |state, _, x| blow(state, |desc| desc.velocity[1] = x)),
    ("density", |state, _, x| blow(state, |desc| desc.density = x)),
    ("normal_drag", |state, _, x| blow(state, |desc| desc.normal_drag = x)),
    ("tangential_drag", |state, _, x| blow(state, |desc| desc.tangential_drag = x)),
    ("tolerance", |state, _, x| unsafe { sw_state_set_rest_tolerance(state, x) }),
];

fn damp(state: *mut SwState, [mass, stiffness]: [f64; 2], ratio: Option<f64>) -> SwStatus {
    let mut desc: SwDampingDesc = fresh();
    (desc.mass_coefficient, desc.stiffness_coefficient) = (mass, stiffness);
    if let Some(ratio) = &ratio {
        (desc.ratios, desc.n_ratios) = (ratio, 1);
    }
    unsafe { sw_state_set_damping(state, &desc) }
}

fn frame(state: *mut SwState, flags: u32, set: impl Fn(&mut SwFrameDesc)) -> SwStatus {
    let mut desc: SwFrameDesc = fresh();
    desc.flags = flags;
    set(&mut desc);
    unsafe { sw_state_set_frame(state, &desc) }
}

fn hold(state: *mut SwState, vertex: u32, set: impl Fn(&mut SwConstraintDesc)) -> SwStatus {
    let mut desc: SwConstraintDesc = fresh();
    (desc.kind, desc.vertex) = (SW_CONSTRAINT_POSITION, vertex);
    set(&mut desc);
    unsafe { sw_state_set_constraint(state, &desc) }
}

fn blow(state: *mut SwState, set: impl Fn(&mut SwWindDesc)) -> SwStatus {
    let mut desc: SwWindDesc = fresh();
    (desc.velocity, desc.density, desc.normal_drag, desc.tangential_drag) = ([0.0, 0.0, 1.0], 1.0, 1.0, 0.1);
    set(&mut desc);
    unsafe { sw_state_set_wind(state, &desc) }
}

const METHODS: [u32; 9] = [
    SW_METHOD_WARP,
    SW_METHOD_LMA,
    SW_METHOD_WARP_VIRTUAL_WORK,
    SW_METHOD_ROTATION_STRAIN,
    SW_METHOD_REDUCED_SHELL,
    SW_METHOD_POLYNOMIAL_SHELL,
    SW_METHOD_ADAPTIVE_SHELL,
    SW_METHOD_SHELL_IMPLICIT,
    SW_METHOD_SHELL_EXPLICIT,
];

fn precomputed(sheet: &Sheet) -> *mut SwModel {
    let model = sheet.model(&fresh(), "", "", 0.0);
    // SAFETY: a live handle.
    assert_eq!(unsafe { sw_model_precompute(model, &small()) }, SW_OK, "{}", message());
    model
}

#[test]
fn no_number_set_on_a_state_makes_it_tell_none() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    for (field, set) in INPUTS {
        for value in VALUES {
            for method in METHODS {
                let what = format!("{field} {value:e}, method {method}");
                // SAFETY: live handles.
                unsafe {
                    let state = state_of(model, method);
                    let status = set(state, sheet.tip(), value);
                    if status != SW_ERROR_UNSUPPORTED && good(&what, field, value, status) {
                        let h = if method == SW_METHOD_SHELL_EXPLICIT { 1e-5 } else { 0.03 };
                        for _ in 0..2 {
                            good(&what, field, 0.0, sw_state_step(state, h));
                        }
                        // The estimate is a search of the full shell: of two methods.
                        judge_state(
                            &what,
                            state,
                            sheet.n(),
                            [SW_METHOD_WARP, SW_METHOD_REDUCED_SHELL].contains(&method),
                        );
                    }
                    sw_state_destroy(state);
                }
            }
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

#[test]
fn no_length_of_a_step_and_no_amplitude_makes_a_state_tell_no_number() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    for value in VALUES {
        for method in METHODS {
            let what = format!("{value:e}, method {method}");
            // SAFETY: live handles.
            unsafe {
                let state = state_of(model, method);
                sw_state_set_gravity(state, [0.0, 0.1, -0.3].as_ptr());
                if good(&what, "step", value, sw_state_step(state, value)) {
                    judge_state(&what, state, sheet.n(), method == SW_METHOD_WARP);
                }
                for (field, [x, x_dot]) in [("amplitudes[0]", [value, 0.0]), ("velocities[0]", [0.0, value])] {
                    let (q, q_dot) = ([x, 0.0, 0.0, 0.0], [x_dot, 0.0, 0.0, 0.0]);
                    let status = sw_state_set_amplitudes(state, q.as_ptr(), q_dot.as_ptr(), 4);
                    if status != SW_ERROR_UNSUPPORTED && good(&what, field, value, status) {
                        judge_state(&what, state, sheet.n(), method == SW_METHOD_WARP);
                    }
                }
                sw_state_destroy(state);
            }
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

#[test]
fn positions_that_32_bits_do_not_hold_are_refused_with_the_vertex_and_64_bits_hold_them() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    for method in METHODS {
        // SAFETY: live handles, buffers of the mesh's size.
        unsafe {
            let state = state_of(model, method);
            let (mut narrow, mut wide) = (vec![7f32; 3 * sheet.n() as usize], vec![0f64; 3 * sheet.n() as usize]);
            let (f32s, f64s) = (narrow.as_mut_ptr().cast(), wide.as_mut_ptr().cast());
            assert_eq!(frame(state, SW_FRAME_TELEPORT, |desc| desc.origin[0] = 3.5e38), SW_OK);
            for space in [SW_SPACE_WORLD, SW_SPACE_FRAME] {
                let status = sw_state_positions(state, space, SW_FORMAT_F32, f32s, 0, sheet.n());
                if space == SW_SPACE_WORLD {
                    assert_eq!(status, SW_ERROR_NUMERICAL, "method {method}");
                    assert!(message().contains("vertex 0") && message().contains("3.5e38"), "{}", message());
                    assert!(narrow.iter().all(|x| *x == 7.0), "outputs are untouched");
                } else {
                    assert_eq!(status, SW_OK, "{}", message());
                }
            }
            assert_eq!(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F64, f64s, 0, sheet.n()), SW_OK);
            assert_eq!(wide[0], 3.5e38);
            sw_state_destroy(state);
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

#[test]
fn training_under_a_gravity_beyond_all_bending_is_refused_by_name() {
    let sheet = Sheet::new();
    let model = sheet.model(&fresh(), "", "", 0.0);
    for gravity in [1e30, 1e100, 1e300] {
        let desc = SwPrecomputeDesc { reduced_gravity: gravity, ..small() };
        // SAFETY: a live handle.
        assert_eq!(unsafe { sw_model_precompute(model, &desc) }, SW_ERROR_NUMERICAL);
        let told = message();
        assert!(told.contains("reduced_gravity") && told.contains(&format!("{gravity:e}")), "{told}");
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

/// What a host does in every frame, with a handle, a moving frame and forces.
unsafe fn play_a_frame(state: *mut SwState, sheet: &Sheet, out: &mut [f64], k: u32) {
    let t = f64::from(k) * 0.01;
    let vertices = [0, sheet.tip()];
    let forces = [[0.0, 0.01 * t, 0.0], [0.0, 0.0, 0.02]];
    let mut report: SwStateReport = fresh();
    let ok = |status: SwStatus| assert_eq!(status, SW_OK, "{}", message());
    unsafe {
        ok(sw_state_set_gravity(state, [0.1 * t, 0.0, -0.2].as_ptr()));
        ok(frame(state, if k.is_multiple_of(2) { SW_FRAME_MOTION_GIVEN } else { 0 }, |desc| {
            desc.origin[1] = 0.001 * t
        }));
        ok(hold(state, sheet.tip(), |desc| (desc.position, desc.axes) = ([0.0, 0.0, 0.1 * t], SW_AXIS_Z)));
        let mut desc: SwForceDesc = fresh();
        (desc.format, desc.count, desc.flags) = (SW_FORMAT_F64, 2, SW_FORCES_ONE_STEP);
        (desc.forces, desc.vertices) = (forces.as_ptr().cast(), vertices.as_ptr());
        ok(sw_state_set_forces(state, &desc));
        ok(sw_state_step(state, 0.03));
        let buffer = out.as_mut_ptr();
        for format in [SW_FORMAT_F32, SW_FORMAT_F64] {
            for space in [SW_SPACE_WORLD, SW_SPACE_FRAME] {
                ok(sw_state_positions(state, space, format, buffer.cast(), 0, sheet.n()));
                ok(sw_state_positions_of(state, space, format, vertices.as_ptr(), 2, buffer.cast(), 0));
            }
        }
        let mut count = 0;
        ok(sw_state_amplitudes(state, buffer, buffer.wrapping_add(8), 8, &mut count));
        ok(sw_state_set_amplitudes(state, buffer, buffer.wrapping_add(8), count));
        ok(sw_state_report(state, &mut report));
    }
}

#[test]
fn a_frame_of_a_modal_method_allocates_nothing() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    let mut out = vec![0.0; 4 * sheet.n() as usize];
    for method in [SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_WARP_VIRTUAL_WORK, SW_METHOD_ROTATION_STRAIN] {
        // SAFETY: live handles, buffers of the mesh's size.
        unsafe {
            let state = state_of(model, method);
            (0..3).for_each(|k| play_a_frame(state, &sheet, &mut out, k));
            let counted =
                allocation_counter::measure(|| (3..10).for_each(|k| play_a_frame(state, &sheet, &mut out, k)));
            assert_eq!(counted.count_total, 0, "method {method}");
            sw_state_destroy(state);
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

#[test]
fn a_saved_state_loads_into_its_own_method_alone() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    let mut saved = vec![0u8; 1 << 16];
    for from in METHODS {
        for to in METHODS {
            // SAFETY: live handles.
            unsafe {
                let (source, target) = (state_of(model, from), state_of(model, to));
                sw_state_set_gravity(source, [0.0, 0.0, -0.2].as_ptr());
                assert_eq!(sw_state_step(source, 1e-5), SW_OK);
                let mut size = 0;
                assert_eq!(sw_state_save(source, saved.as_mut_ptr().cast(), saved.len() as u64, &mut size), SW_OK);
                let status = sw_state_load(target, saved.as_ptr().cast(), size);
                if from == to {
                    assert_eq!(status, SW_OK, "method {from}: {}", message());
                } else {
                    assert_eq!(status, SW_ERROR_INVALID_DATA, "from method {from} to {to}");
                    let named = [from, to].iter().all(|m| message().contains(&format!("(method {m})")));
                    assert!(named, "from method {from} to {to}: {}", message());
                }
                sw_state_destroy(source);
                sw_state_destroy(target);
            }
        }
    }
    // SAFETY: a live handle.
    unsafe { sw_model_destroy(model) }
}

#[test]
fn a_saved_state_of_version_1_is_refused_as_it_did_not_say_its_method() {
    let sheet = Sheet::new();
    let model = precomputed(&sheet);
    // SAFETY: live handles.
    unsafe {
        let state = state_of(model, SW_METHOD_WARP);
        let (mut saved, mut size) = (vec![0u8; 1 << 12], 0);
        assert_eq!(sw_state_save(state, saved.as_mut_ptr().cast(), saved.len() as u64, &mut size), SW_OK);
        saved[4..8].copy_from_slice(&1u32.to_le_bytes());
        assert_eq!(sw_state_load(state, saved.as_ptr().cast(), size), SW_ERROR_INVALID_DATA);
        assert!(message().contains("version 1") && message().contains("method"), "{}", message());
        sw_state_destroy(state);
        sw_model_destroy(model);
    }
}

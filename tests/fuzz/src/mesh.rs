//! Mesh, material and supports → check → model → modes → a few steps.

use super::host::*;
use super::input::Input;
use shellwarp::ffi::mesh::*;
use shellwarp::ffi::method::*;
use shellwarp::ffi::model::*;
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ptr::null_mut;

/// A sheet of up to 3 × 2 squares with a few things wrong with it.
fn broken_sheet(input: &mut Input) -> Triangles {
    let mut mesh = Triangles::sheet(1 + input.below(3) as u32, 1 + input.below(2) as u32);
    for _ in 0..input.below(6) {
        let (v, t) = (input.below(mesh.x.len()), input.below(mesh.t.len()));
        match input.below(9) {
            0 => mesh.x[v][2] = input.number(),
            1 => mesh.x[v] = input.numbers(),
            2 => mesh.t[t][input.below(3)] = input.index(mesh.x.len()),
            3 => mesh.t[t].swap(0, 1),
            4 => mesh.t.push(mesh.t[t]),
            5 if mesh.t.len() > 1 => drop(mesh.t.swap_remove(t)),
            6 if mesh.x.len() < 16 => mesh.x.push(input.numbers()),
            7 => mesh.t.push([input.index(mesh.x.len()), v as u32, input.index(mesh.x.len())]),
            8 => {
                let scale = 10f64.powi(i32::from(input.byte().cast_signed()));
                mesh.x.iter_mut().flatten().for_each(|x| *x *= scale);
            }
            _ => {}
        }
    }
    mesh
}

/// Any points and triangles at all.
fn soup(input: &mut Input) -> Triangles {
    let (n, t) = (1 + input.below(10), 1 + input.below(12));
    Triangles {
        x: (0..n).map(|_| input.numbers()).collect(),
        t: (0..t).map(|_| [input.index(n), input.index(n), input.index(n)]).collect(),
    }
}

fn material(input: &mut Input) -> SwMaterialDesc {
    let mut material = SwMaterialDesc::initial();
    if input.one_in(2) {
        (material.k_area, material.k_length) = (input.number(), input.number());
        (material.k_bend, material.area_density) = (input.number(), input.number());
    }
    material
}

/// The size of an element of sw_mesh_check.
const DIAGNOSTIC_SIZE: u32 = size_of::<SwDiagnostic>() as u32;

/// The number of diagnostics of severity error, or none when not even that could be told.
fn errors_of(mesh: &SwMeshDesc) -> Option<usize> {
    let mut count = 0;
    let status = unsafe { sw_mesh_check(mesh, null_mut(), DIAGNOSTIC_SIZE, 0, &mut count) };
    if !ok_or(status, &[SW_ERROR_INVALID_MESH, SW_ERROR_INVALID_ARGUMENT]) {
        return None;
    }
    let mut all: Vec<SwDiagnostic> = Vec::with_capacity(count as usize);
    unsafe {
        ok(sw_mesh_check(mesh, all.as_mut_ptr(), DIAGNOSTIC_SIZE, count, &mut count));
        all.set_len(count as usize);
    }
    Some(all.iter().filter(|d| d.severity == SW_SEVERITY_ERROR).count())
}

/// Whether there are modes, at rest or, if `sags`, where it hangs under some gravity.
fn precompute(model: &Model, sags: bool, input: &mut Input) -> bool {
    let mut options = SwPrecomputeDesc::initial();
    (options.modes, options.precision) = (1 + input.below(8) as u32, input.code(3));
    if sags {
        options.sag_gravity = input.numbers();
    }
    let failures = [SW_ERROR_NUMERICAL, SW_ERROR_INVALID_ARGUMENT];
    ok_or(unsafe { sw_model_precompute(model.0, &options) }, &failures)
}

pub fn check_modes(model: &Model, info: &SwModelInfo) {
    all_finite("certificate", &[info.residual, info.orthonormality, info.inertia_shift]);
    let (mut hertz, mut count) = ([0.0; 8], 0);
    unsafe { ok(sw_model_frequencies(model.0, hertz.as_mut_ptr(), 8, &mut count)) };
    all_finite("frequencies", &hertz);
    assert!(count <= info.n_unknowns && hertz[..count as usize].is_sorted(), "{hertz:?}");
    let mut shape = vec![0.0; 3 * info.n_vertices as usize];
    for mode in 0..count {
        for kind in [SW_SHAPE_DISPLACEMENT, SW_SHAPE_ROTATION] {
            let out = shape.as_mut_ptr().cast();
            unsafe { ok(sw_model_mode_shape(model.0, mode, kind, SW_FORMAT_F64, out, 0, info.n_vertices)) };
            all_finite("mode shape", &shape);
        }
    }
}

/// Methods that every model has, and those of creases that yield.
pub const MODAL: [u32; 3] = [SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_WARP_VIRTUAL_WORK];
pub const YIELDING: [u32; 3] = [SW_METHOD_SHELL_IMPLICIT, SW_METHOD_SHELL_EXPLICIT, SW_METHOD_SHELL_IMPLICIT];

pub fn run_a_little(model: &Model, methods: &[u32; 3], input: &mut Input) {
    let state = model.state(methods[input.below(3)], 0);
    let gravity: [f64; 3] = input.numbers();
    unsafe { ok_or(sw_state_set_gravity(state.handle, gravity.as_ptr()), &[SW_ERROR_INVALID_ARGUMENT]) };
    for _ in 0..3 {
        let h = input.number();
        ok_or(unsafe { sw_state_step(state.handle, h) }, &[SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL]);
        state.check_outputs();
    }
}

pub fn run(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let mesh = if input.one_in(4) { soup(&mut input) } else { broken_sheet(&mut input) };
    let material = material(&mut input);
    let lists: [Vec<u32>; 2] =
        std::array::from_fn(|_| (0..input.below(4)).map(|_| input.index(mesh.x.len())).collect());
    let mut supports = SwSupportDesc::initial();
    (supports.fixed, supports.n_fixed) = (lists[0].as_ptr(), lists[0].len() as u32);
    (supports.clamped, supports.n_clamped) = (lists[1].as_ptr(), lists[1].len() as u32);

    // Out of what is there, so that inputs keep their meaning: clamped vertices are held along axes.
    let along = if lists[0].len() == 3 { lists[1].clone() } else { vec![] };
    let axes: Vec<u8> = along.iter().map(|v| (v % 9) as u8).collect();
    let directions: Vec<f64> = along.iter().flat_map(|v| [0.0, f64::from(v % 2), f64::from(v % 3) - 1.0]).collect();
    if !along.is_empty() {
        supports.n_clamped = 0;
    }
    (supports.axis_vertices, supports.n_axis_vertices) = (along.as_ptr(), along.len() as u32);
    (supports.axes, supports.axis_directions) = (axes.as_ptr(), directions.as_ptr());

    let errors = errors_of(&mesh.desc());
    let mut model = null_mut();
    let status = unsafe { sw_model_create(&mesh.desc(), &material, &supports, &mut model) };
    if !ok_or(status, &[SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH, SW_ERROR_NUMERICAL]) {
        assert!(model.is_null());
        return;
    }
    assert_eq!(errors, Some(0), "a mesh with errors was taken");
    let model = Model(model);
    let info = model.info();
    all_finite("masses", &[info.total_mass, info.total_area, info.size]);
    let sags = input.one_in(8);
    if !precompute(&model, sags, &mut input) {
        return;
    }
    check_modes(&model, &model.info());
    let saved = model.save();
    let loaded = Model::load(&saved).unwrap_or_else(|| panic!("a saved model must load: {}", message()));
    assert!(loaded.save() == saved);
    run_a_little(&loaded, &MODAL, &mut input);
}

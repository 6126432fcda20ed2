//! The built shared library, loaded as a host loads it, moves a shell as the Rust core that it is made of.

#![allow(unsafe_code)] // a host's calls across the interface
use crate::common::*;
use libloading::{Library, Symbol};
use shellwarp::ffi::mesh::SwMeshDesc;
use shellwarp::ffi::method::*;
use shellwarp::ffi::model::{SwModel, SwPrecomputeDesc, SwSupportDesc};
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::state::*;
use shellwarp::ffi::structs::Described;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::sync::Arc;

type Create = unsafe extern "C" fn(*const SwMeshDesc, *const c_void, *const SwSupportDesc, *mut *mut SwModel) -> u32;
type Precompute = unsafe extern "C" fn(*mut SwModel, *const SwPrecomputeDesc) -> u32;
type StateCreate = unsafe extern "C" fn(*const SwModel, *const c_void, *mut *mut SwState) -> u32;
type Gravity = unsafe extern "C" fn(*mut SwState, *const f64) -> u32;
type StateCreateBy = unsafe extern "C" fn(*const SwModel, *const SwStateDesc, *mut *mut SwState) -> u32;
type Step = unsafe extern "C" fn(*mut SwState, f64) -> u32;
type Positions = unsafe extern "C" fn(*const SwState, u32, u32, *mut c_void, u64, u32) -> u32;

const GRAVITY: [f64; 3] = [0.0, 0.5, -0.3];
const FRAMES: usize = 60;

fn fixed(positions: &[Vec3]) -> Vec<u32> {
    (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.11).collect()
}

fn from_the_library(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    // Beside the test program: cargo builds all kinds of the library together.
    let folder = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let path = folder.join(libloading::library_filename("shellwarp"));
    let held = fixed(positions);
    let mut out = vec![Vec3::zeros(); positions.len()];
    // SAFETY: the symbols have these types by the header, and every pointer is valid for its call.
    unsafe {
        let library = Library::new(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut mesh = SwMeshDesc::initial();
        mesh.position_format = SW_FORMAT_F64;
        mesh.positions = positions.as_ptr().cast();
        mesh.triangles = triangles.as_ptr().cast();
        (mesh.n_vertices, mesh.n_triangles) = (positions.len() as u32, triangles.len() as u32);
        let mut supports = SwSupportDesc::initial();
        (supports.fixed, supports.n_fixed) = (held.as_ptr(), held.len() as u32);
        let (mut model, mut state) = (null_mut(), null_mut());
        assert_eq!(library.get::<Create>(b"sw_model_create").unwrap()(&mesh, null(), &supports, &mut model), 0);
        assert_eq!(library.get::<Precompute>(b"sw_model_precompute").unwrap()(model, null()), 0);
        assert_eq!(library.get::<StateCreate>(b"sw_state_create").unwrap()(model, null(), &mut state), 0);
        assert_eq!(library.get::<Gravity>(b"sw_state_set_gravity").unwrap()(state, GRAVITY.as_ptr()), 0);
        let step: Symbol<Step> = library.get(b"sw_state_step").unwrap();
        (0..FRAMES).for_each(|_| assert_eq!(step(state, 1.0 / 30.0), 0));
        let positions: Symbol<Positions> = library.get(b"sw_state_positions").unwrap();
        let n = out.len() as u32;
        assert_eq!(positions(state, 0, SW_FORMAT_F64, out.as_mut_ptr().cast(), 0, n), 0);
        library.get::<unsafe extern "C" fn(*mut SwState)>(b"sw_state_destroy").unwrap()(state);
        library.get::<unsafe extern "C" fn(*mut SwModel)>(b"sw_model_destroy").unwrap()(model);
    }
    out
}

fn from_the_core(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mesh = Mesh::new(positions.to_vec(), triangles).unwrap();
    let supports = Supports { fixed: fixed(positions), ..Default::default() };
    let shell = Arc::new(Shell::new(mesh, Material::default(), &supports).unwrap());
    let model = Arc::new(Model::precompute(shell, &Options::default(), &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model, Method::Warp, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::from(GRAVITY)).unwrap();
    (0..FRAMES).for_each(|_| state.step(1.0 / 30.0).unwrap());
    let mut out = vec![Vec3::zeros(); positions.len()];
    state.positions(Space::World, |v, x| out[v] = x);
    out
}

#[test]
fn the_shared_library_moves_a_shell_as_the_core_does() {
    let (positions, triangles) = equilateral_sheet(20, 6, 0.1);
    let (library, core) = (from_the_library(&positions, &triangles), from_the_core(&positions, &triangles));
    assert!(library.iter().zip(&positions).any(|(x, rest)| (x - rest).norm() > 1e-3), "it has moved");
    // One source, but inlined into two programs, which may differ in a last bit of the f32 basis.
    for (a, b) in library.iter().zip(&core) {
        assert!((a - b).norm() <= 1e-7, "{a:?} {b:?}");
    }
}

/// Its threads may sleep in it, and would wake where there is no code.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_library_stays_loaded() {
    let library = std::env::current_exe().unwrap().parent().unwrap().join(libloading::library_filename("shellwarp"));
    // Under a name of its own: other tests have the library open.
    let copy = std::env::temp_dir().join(format!("libshellwarp_closed_{}.so", std::process::id()));
    std::fs::copy(&library, &copy).unwrap();
    let is_loaded = || std::fs::read_to_string("/proc/self/maps").unwrap().contains(copy.to_str().unwrap());
    assert!(!is_loaded());
    // SAFETY: the library's initializers have no preconditions, and nothing of it is used after it is closed.
    unsafe { Library::new(&copy).unwrap() }.close().unwrap();
    assert!(is_loaded());
    std::fs::remove_file(&copy).unwrap();
}

#[test]
fn every_method_of_the_header_makes_a_state_that_steps() {
    let (positions, triangles) = equilateral_sheet(4, 2, 0.1);
    let path = std::env::current_exe().unwrap().parent().unwrap().join(libloading::library_filename("shellwarp"));
    // SAFETY: the symbols have these types by the header, and every pointer is valid for its call.
    unsafe {
        let library = Library::new(&path).unwrap();
        let mut mesh = SwMeshDesc::initial();
        mesh.position_format = SW_FORMAT_F64;
        mesh.positions = positions.as_ptr().cast();
        mesh.triangles = triangles.as_ptr().cast();
        (mesh.n_vertices, mesh.n_triangles) = (positions.len() as u32, triangles.len() as u32);
        let mut model = null_mut();
        assert_eq!(library.get::<Create>(b"sw_model_create").unwrap()(&mesh, null(), null(), &mut model), 0);
        assert_eq!(library.get::<Precompute>(b"sw_model_precompute").unwrap()(model, null()), 0);
        for method in [
            SW_METHOD_WARP,
            SW_METHOD_LMA,
            SW_METHOD_SHELL_IMPLICIT,
            SW_METHOD_SHELL_EXPLICIT,
            SW_METHOD_WARP_VIRTUAL_WORK,
        ] {
            let mut desc = SwStateDesc::initial();
            desc.method = method;
            let mut state = null_mut();
            let create = library.get::<StateCreateBy>(b"sw_state_create").unwrap();
            assert_eq!(create(model, &desc, &mut state), 0, "method {method}");
            assert_eq!(library.get::<Gravity>(b"sw_state_set_gravity").unwrap()(state, GRAVITY.as_ptr()), 0);
            assert_eq!(library.get::<Step>(b"sw_state_step").unwrap()(state, 1e-4), 0, "method {method}");
            library.get::<unsafe extern "C" fn(*mut SwState)>(b"sw_state_destroy").unwrap()(state);
        }
        library.get::<unsafe extern "C" fn(*mut SwModel)>(b"sw_model_destroy").unwrap()(model);
    }
}

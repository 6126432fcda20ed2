//! A pose given from outside: every method takes it as near as its motions come.

use crate::common::{displacements, equilateral_sheet};
use nalgebra::UnitQuaternion;
use shellwarp::mesh::Mesh;
use shellwarp::method::METHODS;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

/// A sheet held along x = 0, with a vertex that belongs to no triangle.
fn sheet() -> Shell {
    let (mut positions, triangles) = equilateral_sheet(12, 5, 0.1);
    positions.push(Vec3::new(3.0, 4.0, 5.0));
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.06).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

fn model_of(shell: Shell, options: Options) -> Arc<Model> {
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn f64_options() -> Options {
    let reduced = reduced::Options { fields: 20, ..Default::default() };
    Options { modes: 12, precision: Precision::F64, reduced, ..Options::default() }
}

fn state_of(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap()
}

fn turned() -> Pose {
    Pose { origin: Vec3::new(1.0, -2.0, 0.5), rotation: UnitQuaternion::from_scaled_axis(Vec3::new(0.3, -1.1, 0.4)) }
}

/// Moved by gravity for a while, its frame elsewhere and moving.
fn moved(model: &Arc<Model>, method: Method, gravity: f64) -> State {
    let mut state = state_of(model, method);
    state.set_frame(turned(), FrameMotion::Continuous);
    state.set_gravity(Vec3::new(0.3, 0.2, -1.0) * gravity).unwrap();
    let h = if method == Method::ExplicitShell { 1e-5 } else { 0.02 };
    for k in 1..=25 {
        let mut pose = turned();
        pose.origin.x += 0.3 * h * f64::from(k);
        pose.rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.0, 0.5 * h * f64::from(k))) * pose.rotation;
        state.set_frame(pose, FrameMotion::Continuous);
        state.step(h).unwrap();
    }
    state
}

fn positions(state: &State, space: Space) -> Vec<Vec3> {
    let mut x = vec![];
    state.positions(space, |_, p| x.push(p));
    x
}

fn farthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn reach(state: &State) -> f64 {
    displacements(state).iter().map(|u| u.norm()).fold(0.0, f64::max)
}

#[test]
fn a_pose_read_and_set_again_is_the_same_for_every_method() {
    let model = model_of(sheet(), f64_options());
    for method in METHODS.map(|entry| entry.method) {
        let source = moved(&model, method, 2.0);
        let size = reach(&source);
        assert!(size > if method == Method::ExplicitShell { 1e-9 } else { 0.1 }, "{method:?} {size}");
        for space in [Space::World, Space::Frame] {
            let mut state = moved(&model, method, 0.5);
            let (time, pose) = (state.report().time, *state.pose());
            let x: Vec<Vec3> = match space {
                // As the source is, carried to where this state's frame is.
                Space::World => {
                    positions(&source, Space::Frame).iter().map(|x| pose.origin + pose.rotation * x).collect()
                }
                Space::Frame => positions(&source, Space::Frame),
            };
            let missed = state.set_pose(space, &x, None).unwrap();
            // Rounding of positions of size 10 (the stray vertex is no part of it), and of the search.
            let error = farthest(&positions(&state, space), &x);
            println!("{method:?} {space:?}: {:.1e} of {size:.2}, missed {missed:.1e}", error / size);
            assert!(error <= 1e-9 * size.max(1e-5), "{method:?} {space:?}: {error:e} of {size}");
            assert!(missed <= 1e-9 * size.max(1e-5), "{method:?}: {missed:e}");
            assert_eq!((state.report().time, *state.pose()), (time, pose));
            assert_eq!(state.report().kinetic_energy, 0.0);
        }
    }
}

/// A field that the method can move by: the difference of two of its poses.
fn velocity_at(source: &State, model: &Arc<Model>, method: Method) -> Vec<Vec3> {
    let other = positions(&moved(model, method, 2.0 + 1e-6), Space::Frame);
    other.iter().zip(positions(source, Space::Frame)).map(|(a, b)| (a - b) / 1e-6).collect()
}

#[test]
fn velocities_move_the_shell_on() {
    let model = model_of(sheet(), f64_options());
    let h = 1e-7;
    for method in METHODS.map(|entry| entry.method) {
        // The explicit shell takes any motion; its own is slow to come by.
        let maker = if method == Method::ExplicitShell { Method::ImplicitShell } else { method };
        let source = moved(&model, maker, 2.0);
        let (x, velocity) = (positions(&source, Space::Frame), velocity_at(&source, &model, maker));
        let mut state = state_of(&model, method);
        let missed = state.set_pose(Space::Frame, &x, Some(&velocity)).unwrap();
        state.step(h).unwrap();
        let after = positions(&state, Space::Frame);
        let seen: Vec<Vec3> = after.iter().zip(&x).map(|(a, b)| (a - b) / h).collect();
        let speed = velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
        // In that time the elastic forces, of at most 1e5 in units of the shell, change the speed by a hundredth of it.
        assert!(farthest(&seen, &velocity) <= 0.02 * speed, "{method:?}: {} of {speed}", farthest(&seen, &velocity));
        assert!(speed > 0.05 && missed < 1e-9, "{method:?} {speed} {missed}");
    }
}

#[test]
fn velocities_in_the_world_have_the_frames_in_them() {
    let model = model_of(sheet(), f64_options());
    for method in [Method::Warp, Method::ReducedShell, Method::PolynomialShell, Method::ImplicitShell] {
        let source = moved(&model, method, 2.0);
        let velocity = velocity_at(&source, &model, method);
        let mut state = moved(&model, method, 0.5);
        let pose = *state.pose();
        state.set_pose(Space::Frame, &positions(&source, Space::Frame), Some(&velocity)).unwrap();
        let expected = state.report().kinetic_energy;
        // As moved has it.
        let (linear, angular) = (Vec3::new(0.3, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.5));
        let x = positions(&state, Space::World);
        let carried = |(x, v): (&Vec3, &Vec3)| linear + angular.cross(&(x - pose.origin)) + pose.rotation * v;
        let in_world: Vec<Vec3> = x.iter().zip(&velocity).map(carried).collect();
        state.set_pose(Space::World, &x, Some(&in_world)).unwrap();
        // The frame's own rates are differences of poses over 0.02 s, good to 1e-14/0.02.
        let error = (state.report().kinetic_energy - expected).abs() / expected;
        assert!(expected > 0.0 && error < 1e-9, "{method:?}: {error:e} of {expected}");
    }
}

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
}

/// A pose of these modes that turns some vertex by `turn`.
fn bent(model: &Arc<Model>, method: Method, turn: f64, seed: &mut u64) -> State {
    let stiffest = model.modal.eigenvalues.iter().find(|l| **l > 0.0).unwrap();
    let mut q: Vec<f64> = model.modal.eigenvalues.iter().map(|l| random(seed) / l.max(*stiffest).sqrt()).collect();
    let zeros = vec![0.0; q.len()];
    let mut state = state_of(model, method);
    state.set_amplitudes(&q, &zeros).unwrap();
    let scale = turn / state.report().max_rotation;
    q.iter_mut().for_each(|q| *q *= scale);
    state.set_amplitudes(&q, &zeros).unwrap();
    state
}

/// Largest error of a pose read and set again, of its displacement.
fn lost(source: &State) -> f64 {
    let x = positions(source, Space::Frame);
    let mut state = state_of(source.model(), source.method());
    state.set_pose(Space::Frame, &x, None).unwrap();
    farthest(&positions(&state, Space::Frame), &x) / reach(source)
}

#[test]
fn bends_of_two_radians_are_found_from_rest() {
    let model = model_of(sheet(), f64_options());
    let mut seed = 1;
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain, Method::LinearModalAnalysis] {
        for _ in 0..10 {
            let error = lost(&bent(&model, method, 2.0, &mut seed));
            assert!(error < 1e-9, "{method:?}: {error:e}"); // rounding of the search
        }
    }
}

#[test]
fn poses_of_rounded_sagged_and_free_shells_come_back_too() {
    let free = {
        let (positions, triangles) = equilateral_sheet(12, 5, 0.1);
        let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
        Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports::default()).unwrap()
    };
    let sag = Vec3::new(0.0, 0.0, -0.5);
    // The step of the search is computed in the basis's precision, and gains its digits in each round.
    let cases = [
        ("f32", sheet(), Options { precision: Precision::F32, ..f64_options() }),
        ("i16", sheet(), Options { precision: Precision::I16, ..f64_options() }),
        ("sagged", sheet(), Options { sag, modes: 12, precision: Precision::F64, ..Options::default() }),
        ("free", free, Options { modes: 12, precision: Precision::F64, ..Options::default() }),
    ];
    for (name, shell, options) in cases {
        let model = model_of(shell, options);
        let mut seed = 7;
        for method in [Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain, Method::LinearModalAnalysis] {
            let error = lost(&bent(&model, method, 1.2, &mut seed));
            println!("{name} {method:?}: {error:.1e}");
            assert!(error < 1e-6, "{name} {method:?}: {error:e}");
        }
        if model.reduced.is_some() {
            assert!(lost(&moved(&model, Method::ReducedShell, 2.0)) < 1e-6, "{name}");
        }
        assert!(lost(&moved(&model, Method::ImplicitShell, 2.0)) < 1e-9, "{name}");
    }
}

/// The nonlinear shell's pose as a few modes have it: no small change of q is nearer.
#[test]
fn a_pose_that_modes_do_not_have_is_missed_by_the_least() {
    let model = model_of(sheet(), f64_options());
    let x = positions(&moved(&model, Method::ImplicitShell, 3.0), Space::Frame);
    for method in [Method::Warp, Method::RotationStrain] {
        let mut state = state_of(&model, method);
        let missed = state.set_pose(Space::Frame, &x, None).unwrap();
        let distance = |state: &State| {
            let square = |(m, (a, b)): (&f64, (&Vec3, &Vec3))| m * (a - b).norm_squared();
            let now = positions(state, Space::Frame);
            (model.shell.mass.iter().zip(now.iter().zip(&x)).map(square).sum::<f64>() / model.shell.total_mass).sqrt()
        };
        assert!((missed - distance(&state)).abs() <= 1e-12 * missed && missed > 1e-6, "{method:?}: {missed}");
        let q = state.amplitudes().unwrap().0.to_vec();
        for k in 0..q.len() {
            for change in [-1e-4, 1e-4] {
                let mut other = q.clone();
                other[k] += change;
                state.set_amplitudes(&other, &vec![0.0; q.len()]).unwrap();
                assert!(distance(&state) > missed, "{method:?}, mode {k}");
            }
        }
    }
}

#[test]
fn held_and_stray_vertices_stay_where_they_are() {
    let model = model_of(sheet(), f64_options());
    let rest = &model.shell.mesh.positions;
    let x: Vec<Vec3> = rest.iter().map(|x| x + Vec3::new(0.1, 0.0, 0.0)).collect();
    for method in METHODS.map(|entry| entry.method) {
        let mut state = state_of(&model, method);
        state.set_pose(Space::Frame, &x, None).unwrap();
        let u = displacements(&state);
        for v in 0..rest.len() {
            let stays = model.shell.held[v] || model.shell.mass[v] == 0.0;
            assert!(!stays || u[v] == Vec3::zeros(), "{method:?}: vertex {v} moved by {}", u[v]);
        }
    }
}

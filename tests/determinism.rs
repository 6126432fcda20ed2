//! The same inputs give the same bits: on any number of threads, in parts, through saves and clones, and from release to
//! release until a change of results is meant. Many states in one call: tests/threads.rs, and tests/c/states_test.c against one by
//! one.
#![allow(missing_docs)]
mod common;
use common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::Wind;
use shellwarp::model::Model;
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::fmt::Write;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

const METHODS: [Method; 3] = [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis];
const INTEGRATORS: [Integrator; 2] = [Integrator::ImplicitEuler, Integrator::Exact];

/// Models of both precisions that no precompute of this machine has touched.
fn saved_models() -> [Arc<Model>; 2] {
    ["f32", "f64"].map(|precision| {
        let bytes = std::fs::read(data(&format!("saved/model_v1_{precision}.bin"))).unwrap();
        Arc::new(Model::load(&bytes).unwrap())
    })
}

/// A state under every kind of load; `seed` makes it differ from others.
fn loaded(model: &Arc<Model>, method: Method, integrator: Integrator, seed: u32) -> State {
    let mut state = State::new(model.clone(), method, integrator).unwrap();
    let s = f64::from(seed) / 16.0;
    state.set_gravity(Vec3::new(0.1 * s, 0.0, -0.5)).unwrap();
    state
        .set_damping(&Damping {
            mass_coefficient: 0.1,
            stiffness_coefficient: 1e-4,
            ratios: vec![0.01],
            ..Damping::default()
        })
        .unwrap();
    let vertex = model.shell.free[model.shell.free.len() / 2];
    state.set_forces(vec![(vertex, Vec3::new(0.0, 0.0, 0.01 * s))], false).unwrap();
    let velocity = Vec3::new(0.3, 0.1 * s, 0.2);
    let wind = Wind { velocity, density: 0.1, normal_drag: 1.0, tangential_drag: 0.1, local: vec![] };
    state.set_wind(wind).unwrap();
    state
}

/// Steps `from..to` with a frame that moves and turns, and a handle that comes and goes.
fn play(state: &mut State, from: u32, to: u32) {
    let vertex = *state.model().shell.free.last().unwrap();
    let rest = state.model().shell.mesh.positions[vertex as usize];
    for k in from..to {
        let t = f64::from(k) / 30.0;
        let turn = Vec3::new(0.0, 0.0625 * t, 0.125 * t);
        let rotation = UnitQuaternion::from_scaled_axis(turn);
        let pose = Pose { origin: Vec3::x() * (t * t * 0.25), rotation };
        state.set_frame(pose, FrameMotion::Continuous);
        match k % 20 {
            10..20 => {
                let lifted = pose.origin + rotation * rest + Vec3::z() * 0.02;
                let target = Target::Position(lifted);
                state.set_constraint(Constraint { id: 7, vertex, axes: [true; 3], compliance: 1e-3, target }).unwrap();
            }
            0 if k > 0 => state.clear_constraint(7).unwrap(),
            _ => {}
        }
        state.step(if k % 3 == 0 { 1.0 / 24.0 } else { 1.0 / 60.0 }).unwrap();
    }
}

/// Everything that shows. The golden hashes are older than the method in saved states: their numbers are told as format 1 had them.
fn bits(state: &State) -> Vec<u8> {
    let mut out = state.save();
    let body = out.len() - 8;
    out[4..8].copy_from_slice(&1u32.to_le_bytes());
    let sum = xxh3_64(&out[..body]);
    out[body..].copy_from_slice(&sum.to_le_bytes());
    state.positions(Space::World, |_, x| out.extend(x.iter().flat_map(|x| x.to_le_bytes())));
    state.rotations(Space::World, |_, r| out.extend(r.coords.iter().flat_map(|x| x.to_le_bytes()))).unwrap();
    out
}

fn fleet(model: &Arc<Model>) -> Vec<State> {
    let each = |k: u32| loaded(model, METHODS[k as usize % 3], INTEGRATORS[k as usize / 3 % 2], k);
    (0..24).map(each).collect()
}

#[test]
fn any_number_of_threads_gives_the_bits_of_one() {
    let (positions, triangles) = equilateral_sheet(14, 8, 0.1); // nine blocks of vertices
    let supports = Supports { clamped: vec![0, 15, 31], ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    let model = Model::precompute(Arc::new(shell), &Default::default(), &mut |_, _| Ok(())).unwrap();
    let model = Arc::new(model);
    let mut alone = fleet(&model);
    alone.iter_mut().for_each(|state| play(state, 0, 25));
    let expected: Vec<Vec<u8>> = alone.iter().map(bits).collect();
    for threads in 1..=8 {
        let mut states = fleet(&model);
        std::thread::scope(|scope| {
            for part in states.chunks_mut(24usize.div_ceil(threads)) {
                scope.spawn(move || part.iter_mut().for_each(|state| play(state, 0, 25)));
            }
        });
        assert!(states.iter().map(bits).eq(expected.iter().cloned()), "{threads} threads");
    }
}

#[test]
fn a_run_in_parts_through_saves_clones_and_a_loaded_model_is_the_run_in_one() {
    // Under Miri, which takes minutes: the first method, a handle for two steps.
    let ([cut, held, end], combinations) = if cfg!(miri) { ([2, 11, 13], 1) } else { ([5, 30, 60], 6) };
    for model in saved_models() {
        let all = METHODS.into_iter().flat_map(|m| INTEGRATORS.map(|i| (m, i)));
        for (method, integrator) in all.take(combinations) {
            let mut whole = loaded(&model, method, integrator, 3);
            play(&mut whole, 0, end);
            // Cut where no handle holds: constraints are inputs and not saved.
            let mut first = loaded(&model, method, integrator, 3);
            play(&mut first, 0, cut);
            let mut clone = first.try_clone().unwrap();
            play(&mut clone, cut, held); // a handle holds at the cut: a clone has it, too
            let mut clone = clone.try_clone().unwrap();
            play(&mut clone, held, end);
            let other = Arc::new(Model::load(&model.save().unwrap()).unwrap());
            let mut resumed = loaded(&other, method, integrator, 3);
            resumed.load(&first.save()).unwrap();
            play(&mut resumed, cut, end);
            for (what, state) in [("a clone", &clone), ("a save on a loaded model", &resumed)] {
                assert!(bits(state) == bits(&whole), "{what}, {method:?}, {integrator:?}");
            }
        }
    }
}

#[test]
fn nonlinear_shells_run_in_parts_and_on_threads_to_the_same_bits() {
    let [model, _] = saved_models();
    for (method, h) in [(Method::ImplicitShell, 1.0 / 30.0), (Method::ExplicitShell, 1e-6)] {
        let start = || {
            let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(Vec3::new(0.1, 0.0, -0.5)).unwrap();
            state
        };
        let steps = |state: &mut State, n: u32| (0..n).for_each(|_| state.step(h).unwrap());
        let mut first = start();
        steps(&mut first, 3);
        let saved = first.save();
        let mut clone = first.try_clone().unwrap();
        steps(&mut first, 4);
        steps(&mut clone, 4);
        let mut others: Vec<State> = (0..4).map(|_| start()).collect();
        others.iter_mut().for_each(|state| state.load(&saved).unwrap());
        std::thread::scope(|scope| {
            for state in &mut others {
                scope.spawn(move || (0..4).for_each(|_| state.step(h).unwrap()));
            }
        });
        assert!(others.iter().chain([&clone]).all(|state| bits(state) == bits(&first)), "{method:?}");
    }
}

/// Hashes of runs on the golden models, one a line. The models are saved ones, because a precompute rounds as the vector
/// instructions of the processor do. So does a step: the file is that of the class with fused multiply-add, and compared there
/// only. Deterministic states have one class: tests/c/same_bits_test.c.
///
/// A change of results is allowed between minor versions, but must be meant: write the file anew with
/// `UPDATE_HASHES=1 cargo test --release --test determinism` and say so in CHANGELOG.md.
#[test]
fn runs_have_the_bits_of_the_release_before() {
    let mut now = String::new();
    for model in saved_models() {
        for (method, integrator) in METHODS.into_iter().flat_map(|m| INTEGRATORS.map(|i| (m, i))) {
            let mut state = loaded(&model, method, integrator, 5);
            play(&mut state, 0, 60);
            let precision = model.modal.precision();
            writeln!(now, "{:016x} {precision:?} {method:?} {integrator:?}", xxh3_64(&bits(&state))).unwrap();
        }
    }
    let path = data("saved/run_hashes.txt");
    if std::env::var_os("UPDATE_HASHES").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("fma") && std::arch::is_x86_feature_detected!("avx2") {
        assert_eq!(now, std::fs::read_to_string(&path).unwrap());
    }
}

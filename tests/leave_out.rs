//! What a scene does not need is left out, and the result is that of the whole work within the bound stated where it is left
//! out.
#![allow(missing_docs)]
mod common;
use common::*;
use shellwarp::Vec3;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::support::{Motion, Pose, Rates};
use std::sync::Arc;

const MODAL: [Method; 3] = [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp];
const FRAME: f64 = 1.0 / 30.0;

fn model(name: &str, options: Options) -> Arc<Model> {
    Arc::new(Model::precompute(Arc::new(reference(name).0), &options, &mut |_, _| Ok(())).unwrap())
}

fn in_f64(modes: usize) -> Options {
    Options { modes, precision: Precision::F64, ..Options::default() }
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap()
}

/// Gives every vertex a force, mostly zero, so that all work is done.
fn with_all_work(state: &mut State, forces: &[(u32, Vec3)]) {
    let n = state.model().shell.mass.len() as u32;
    state.set_forces((0..n).map(|v| (v, Vec3::zeros())).chain(forces.iter().copied()).collect(), false).unwrap();
}

fn spinning() -> Motion {
    let rates = Rates { angular_velocity: Vec3::new(0.3, -0.2, 0.9), ..Rates::default() };
    Motion::Given(rates)
}

/// Largest difference of amplitudes and of rates between two states, relative to the largest amplitude and rate.
fn difference(a: &State, b: &State) -> f64 {
    let ((qa, va), (qb, vb)) = (a.amplitudes().unwrap(), b.amplitudes().unwrap());
    let relative = |a: &[f64], b: &[f64]| {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        apart / a.iter().fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()))
    };
    relative(qa, qb).max(relative(va, vb))
}

#[test]
fn forces_on_few_vertices_do_what_the_same_forces_among_those_of_all_do() {
    let model = model("v_beam", in_f64(8));
    let forces =
        [(204, Vec3::new(0.02, -0.03, 0.05)), (17, Vec3::new(0.0, 0.1, 0.0)), (204, Vec3::new(0.0, 0.0, 0.04))];
    for method in MODAL {
        for spin in [false, true] {
            let (mut few, mut all) = (state(&model, method), state(&model, method));
            for state in [&mut few, &mut all] {
                state.set_gravity(Vec3::new(0.1, 0.2, -0.8)).unwrap();
            }
            few.set_forces(forces.to_vec(), false).unwrap();
            with_all_work(&mut all, &forces);
            for _ in 0..60 {
                for state in [&mut few, &mut all] {
                    let motion = if spin { spinning() } else { Motion::Continuous };
                    state.set_frame(Pose::identity(), motion);
                    state.step(FRAME).unwrap();
                }
            }
            // Rounding, over 60 steps of sums in another order.
            assert!(difference(&few, &all) < 1e-11, "{method:?}: {:e}", difference(&few, &all));
        }
    }
}

#[test]
fn a_uniform_load_in_linear_modal_analysis_needs_no_vertex() {
    let model = model("v_beam", in_f64(8));
    let (mut short, mut all) = (state(&model, Method::LinearModalAnalysis), state(&model, Method::LinearModalAnalysis));
    for state in [&mut short, &mut all] {
        state.set_gravity(Vec3::new(3.0, 2.0, -5.0)).unwrap();
    }
    with_all_work(&mut all, &[]);
    for _ in 0..60 {
        short.step(FRAME).unwrap();
        all.step(FRAME).unwrap();
    }
    assert!(difference(&short, &all) < 1e-11, "{:e}", difference(&short, &all)); // rounding
}

/// Modal force of gravity at amplitudes that turn vertices by about `turn`, from one step out of rest: q̇ = h f/(1 + h²λ) − ….
fn rates_after_a_step(model: &Arc<Model>, method: Method, turn: f64, whole: bool) -> Vec<f64> {
    let mut state = state(model, method);
    let modes = model.n_modes() as f64;
    let q: Vec<f64> = model.largest_rotation.iter().map(|psi| turn / (modes * psi)).collect();
    state.set_amplitudes(&q, &vec![0.0; q.len()]).unwrap();
    state.set_gravity(Vec3::new(0.3, 0.4, -0.8)).unwrap();
    if whole {
        with_all_work(&mut state, &[]);
    }
    state.step(1e-6).unwrap(); // so short that only the force tells
    state.amplitudes().unwrap().1.to_vec()
}

#[test]
fn gravity_near_the_rest_shape_is_taken_to_first_order_within_a_millionth_of_the_load() {
    let model = model("v_beam", in_f64(8));
    for method in [Method::Warp, Method::VirtualWorkWarp] {
        for (turn, first_order) in [(1.39e-3, true), (7e-4, true), (1.41e-3, false), (0.3, false)] {
            let (short, whole) =
                (rates_after_a_step(&model, method, turn, false), rates_after_a_step(&model, method, turn, true));
            let mut apart = 0.0f64;
            for (k, (a, b)) in short.iter().zip(&whole).enumerate() {
                // |f_k| is at most Σ m |g| |φ_k|.
                let reach: f64 =
                    model.shell.mass.iter().enumerate().map(|(v, m)| m * model.mode_at(k, v).0.norm()).sum();
                apart = apart.max((a - b).abs() / (1e-6 * reach * Vec3::new(0.3, 0.4, -0.8).norm()));
            }
            println!("{method:?}, {turn} rad: {apart:e} of the load");
            if first_order {
                assert!(apart > 1e-12 && apart < 1e-6, "{method:?} at {turn} rad: {apart:e}");
            } else {
                assert!(apart < 1e-13, "{method:?} at {turn} rad: {apart:e}"); // the same sums, in another order at most
            }
        }
    }
}

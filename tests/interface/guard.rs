//! Loads far beyond the warp's range: bounded always, at rest in the end where the load is a dead one, and no trace of the
//! guard on ordinary scenes.

use crate::common::*;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::Vec3;
use shellwarp::load::BodyLoad;
use shellwarp::modal::AnyBasis;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::ForceLaw;
use shellwarp::step::Integrator;
use shellwarp::step::guard::{GUARDED_BEND, Pull};
use shellwarp::step::modal_force::{self, Acting, Scratch};
use shellwarp::support::{Pose, Rates};
use std::sync::Arc;

const LAWS: [Method; 2] = [Method::Warp, Method::VirtualWorkWarp];
const INTEGRATORS: [Integrator; 2] = [Integrator::ImplicitEuler, Integrator::Exact];

fn beam(name: &str) -> Arc<Model> {
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(reference(name).0), &options, &mut |_, _| Ok(())).unwrap())
}

fn loaded(model: &Arc<Model>, method: Method, integrator: Integrator, gravity: Vec3) -> State {
    let mut state = State::new(model.clone(), method, integrator).unwrap();
    state.set_damping(&Damping { ratios: vec![0.2], ..Damping::default() }).unwrap();
    state.set_gravity(gravity).unwrap();
    state
}

#[test]
fn ordinary_scenes_feel_nothing_of_the_guard() {
    // Exactly nothing: amplitudes and damping come back with the same bits, at every frame of a release under the loads of
    // the reference, up to a bend of 92°.
    for (name, gravities) in [("flat_beam", [0.1, 0.4, 0.8]), ("v_beam", [1.0, 3.0, 7.0])] {
        let model = beam(name);
        for (g, method) in gravities.iter().zip(LAWS.iter().cycle()) {
            let mut state = loaded(&model, *method, Integrator::ImplicitEuler, Vec3::z() * -*g);
            for _ in 0..600 {
                state.step(1.0 / 30.0).unwrap();
                let (q, q_dot) = state.amplitudes().unwrap();
                let (mut held, mut rate) = (q.to_vec(), q_dot.to_vec());
                model.modal.guard(true).hold(|_| 0.0, 1.0 / 30.0, &mut held, &mut rate);
                assert!(held == q && rate == q_dot && model.modal.guard(true).energy(q) == 0.0);
                let weight = Pull { body: *g, external: 0.0, reach: reach_of(&model, q) };
                for k in 0..q.len() {
                    assert_eq!(
                        model.modal.guard(true).damping(k, 0.3, &weight, 1.0 / 30.0),
                        0.3,
                        "{name}, g = {g}, mode {k}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_guarded_pose_is_where_load_elasticity_and_guard_balance() {
    // One endless step under a constant force: f = Λq + ∇G(q), with ∇G by differences of G.
    let model = beam("flat_beam");
    let guard = model.modal.guard(true);
    let mut rng = StdRng::seed_from_u64(31);
    for strength in [1.5, 10.0, 1e3, 1e6] {
        let scale: Vec<f64> = model.modal.largest_rotation.iter().map(|r| strength * GUARDED_BEND / r).collect();
        let free: Vec<f64> = scale.iter().map(|s| s * rng.random_range(-1.0..1.0)).collect();
        let (mut q, mut rate) = (free.clone(), vec![0.0; free.len()]);
        guard.hold(|_| 0.0, 1e9, &mut q, &mut rate);
        let bend = q.iter().zip(&model.modal.largest_rotation).map(|(q, r)| (q * r).powi(2)).sum::<f64>().sqrt();
        let room = 1.5 * GUARDED_BEND - bend;
        let load = |k: usize| model.modal.eigenvalues[k] * free[k];
        let largest = (0..q.len()).map(|k| load(k).abs()).fold(0.0, f64::max);
        for k in 0..q.len() {
            let step = 1e-3 * room / model.modal.largest_rotation[k];
            let at = |shift: f64| {
                let mut q = q.clone();
                q[k] += shift * step;
                guard.energy(&q)
            };
            let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
            let force = model.modal.eigenvalues[k] * q[k] + slope;
            // Of the largest load. Differences: (1e-3)⁴ and 1e-16/1e-3; and the rounding of β, 1e-15 a term, over 1e-3 of the room.
            let tolerance = 1e-9 + 1e-10 / room;
            assert_close(&format!("mode {k} at {strength}"), force, load(k), tolerance, largest);
        }
    }
}

#[test]
fn no_load_and_no_step_winds_a_shell_up() {
    let mut rng = StdRng::seed_from_u64(32);
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        for power in 0..9 {
            for (method, integrator) in LAWS.iter().flat_map(|m| INTEGRATORS.map(|i| (*m, i))) {
                let direction = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)).normalize();
                let mut state = loaded(&model, method, integrator, direction * 10f64.powi(power));
                for _ in 0..300 {
                    state.step(10f64.powf(rng.random_range(-6.0..1.0))).unwrap();
                    // |w| ≤ Σ ψ|q| ≤ √m β, and β < 3π/2.
                    let rotation = state.report().max_rotation;
                    assert!(rotation < 8f64.sqrt() * 1.5 * GUARDED_BEND, "{name}, 1e{power}, {method:?}: {rotation}");
                }
            }
        }
    }
}

/// β: Σ (ψ_k q_k)² under the root.
fn bend(state: &State) -> f64 {
    let model = state.model();
    let (q, _) = state.amplitudes().unwrap();
    q.iter().zip(&model.modal.largest_rotation).map(|(q, r)| (q * r).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn point_forces_keep_the_root_sum_square_of_the_modes_turns_below_three_quarters_of_a_turn() {
    let mut rng = StdRng::seed_from_u64(34);
    let mut furthest = 0.0f64;
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        let n = model.shell.mass.len() as u32;
        for power in 0..6 {
            for (method, integrator) in LAWS.iter().flat_map(|m| INTEGRATORS.map(|i| (*m, i))) {
                let mut state = State::new(model.clone(), method, integrator).unwrap();
                for _ in 0..40 {
                    let push = |rng: &mut StdRng| {
                        let force = Vec3::from_fn(|_, _| 10f64.powi(power) * rng.random_range(-1.0..1.0));
                        (rng.random_range(0..n), force)
                    };
                    state.set_forces((0..3).map(|_| push(&mut rng)), false).unwrap();
                    for _ in 0..5 {
                        state.step(10f64.powf(rng.random_range(-4.0..1.0))).unwrap();
                        let (beta, rotation) = (bend(&state), state.report().max_rotation);
                        assert!(beta < 1.5 * GUARDED_BEND, "{name}, 1e{power}, {method:?}: {beta}");
                        // |w| ≤ Σ ψ|q| ≤ √m β.
                        assert!(rotation <= 8f64.sqrt() * beta, "{name}, 1e{power}, {method:?}: {rotation}");
                        furthest = furthest.max(rotation);
                    }
                }
            }
        }
    }
    println!("turned by up to {furthest} rad");
    assert!(furthest > 1.5 * GUARDED_BEND, "no vertex is turned further than the modes: {furthest}");
}

#[test]
fn energy_never_grows_without_a_load_however_far_the_guard_is_felt() {
    let mut rng = StdRng::seed_from_u64(35);
    let mut felt = 0;
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        for trial in 0..200 {
            for integrator in INTEGRATORS {
                let mut state = State::new(model.clone(), Method::VirtualWorkWarp, integrator).unwrap();
                let draw = |k: usize| GUARDED_BEND / model.modal.largest_rotation[k];
                let q: Vec<f64> = (0..8).map(|k| draw(k) * rng.random_range(-1.0..1.0) / (1.0 + k as f64)).collect();
                let speed: Vec<f64> = (0..8)
                    .map(|k| 3.0 * draw(k) * model.modal.eigenvalues[k].sqrt() * rng.random_range(-1.0..1.0))
                    .collect();
                state.set_amplitudes(&q, &speed).unwrap();
                // Phases of the slowest mode from 0.03 to 10, the same in all steps or any.
                let reach = 10f64.powf(rng.random_range(-1.5..1.0)) / model.modal.eigenvalues[0].sqrt();
                let energy = |state: &State| state.report().elastic_energy + state.report().kinetic_energy;
                let mut before = energy(&state);
                for _ in 0..60 {
                    state.step(reach * if trial % 2 == 0 { 1.0 } else { rng.random_range(0.3..3.0) }).unwrap();
                    let now = energy(&state);
                    felt += u32::from(bend(&state) > GUARDED_BEND);
                    // Rounding of the exponentials of 60 steps and of G, a ratio of small numbers.
                    assert!(
                        now <= before * (1.0 + 1e-12),
                        "{name}, {integrator:?}, trial {trial}: {now} after {before}"
                    );
                    before = now;
                }
            }
        }
    }
    assert!(felt > 5000, "the guard was felt in {felt} steps");
}

#[test]
fn a_strip_under_any_weight_comes_to_rest() {
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        for g in [5.0, 30.0, 300.0] {
            for direction in [-Vec3::z(), Vec3::new(0.0, 0.6, -0.8)] {
                let mut state = loaded(&model, Method::VirtualWorkWarp, Integrator::ImplicitEuler, direction * g);
                // The slowest mode's time is 10 s at 20 % damping; after 15 of them nothing moves.
                (0..4500).for_each(|_| state.step(1.0 / 30.0).unwrap());
                let report = state.report();
                assert!(
                    report.kinetic_energy <= 1e-12 * report.elastic_energy,
                    "{name} under {g} along {direction:?}: {report:?}"
                );
                assert!(report.max_rotation < 1.5 * GUARDED_BEND, "{report:?}");
            }
        }
    }
}

#[test]
fn a_shell_let_go_from_the_guard_swings_back() {
    let model = beam("flat_beam");
    let mut state = loaded(&model, Method::VirtualWorkWarp, Integrator::ImplicitEuler, -1e4 * Vec3::z());
    (0..600).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert!(state.report().max_rotation > 3.0);
    state.set_gravity(Vec3::zeros()).unwrap();
    (0..6000).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert!(state.report().max_rotation < 1e-6, "{:?}", state.report());
}

/// Σ |φ_k||q_k|, each at its largest.
fn reach_of(model: &Model, q: &[f64]) -> f64 {
    q.iter().zip(model.modal.participation().reach()).map(|(q, reach)| reach * q.abs()).sum()
}

/// f and how strongly the loads pull, at amplitudes `q`.
fn pulled(model: &Model, law: ForceLaw, load: &BodyLoad, external: &[Vec3], q: &[f64]) -> (Vec<f64>, Pull) {
    let AnyBasis::F64(basis) = &model.modal.basis else { unreachable!("asked for in f64") };
    let (mut force, at_rest) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    let acting = Acting { load, external: Some(external), law, q, q_dot: &at_rest, total_mass: model.shell.total_mass };
    let mut pull = modal_force::project(basis, &acting, &mut Scratch::new(q.len()), &mut force);
    if law == ForceLaw::VirtualWork {
        pull.reach = reach_of(model, q);
    }
    (force, pull)
}

#[test]
fn no_load_is_stiffer_in_a_mode_than_the_guard_takes_it_for() {
    let mut rng = StdRng::seed_from_u64(33);
    let any = |rng: &mut StdRng| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0));
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        let (n, modes) = (model.shell.mass.len(), model.modal.n_modes());
        let guard = model.modal.guard(true);
        let mut tightest = 0.0f64;
        for trial in 0..200 {
            // Body loads, forces on all vertices, on one, or all together; at rest, and up to a turn in each mode.
            let weight = if trial % 4 == 1 { Vec3::zeros() } else { any(&mut rng) };
            let load = BodyLoad::new(weight, &Pose::identity(), &Rates::default());
            let mut external = vec![Vec3::zeros(); n];
            match trial % 4 {
                0 => {}
                1 => external[rng.random_range(0..n)] = any(&mut rng),
                _ => external.iter_mut().for_each(|f| *f = 1e-3 * any(&mut rng)),
            }
            let turned = |reach: f64, rng: &mut StdRng| -> Vec<f64> {
                model.modal.largest_rotation.iter().map(|r| reach * rng.random_range(-1.0..1.0) / r).collect()
            };
            let reach = if trial % 8 < 4 { 0.0 } else { std::f64::consts::TAU };
            for law in [ForceLaw::Rotated, ForceLaw::VirtualWork] {
                let q = turned(reach, &mut rng);
                let (_, pull) = pulled(&model, law, &load, &external, &q);
                for k in 0..modes {
                    let step = 1e-5 / model.modal.largest_rotation[k];
                    let at = |shift: f64| {
                        let mut q = q.clone();
                        q[k] += shift * step;
                        pulled(&model, law, &load, &external, &q).0[k]
                    };
                    let stiffness = ((at(1.0) - at(-1.0)) / (2.0 * step)).abs();
                    let bound = guard.load_stiffness(k, &pull);
                    // Differences: (1e-5)², and rounding of 1e-16 of the terms, some 1e2 of K, over 1e-5.
                    assert!(stiffness <= bound * (1.0 + 1e-8), "{name}, {law:?}, mode {k}: {stiffness:e} > {bound:e}");
                    tightest = tightest.max(stiffness / bound);
                }
            }
        }
        // A bound that anything passes would say nothing.
        assert!(tightest > 0.3, "{name}: at most {tightest} of the bound");
    }
}

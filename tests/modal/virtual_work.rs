//! The force law by virtual work: exact derivatives of the warp, conservative dead loads, better equilibria.

use crate::common::*;
use pulp::Scalar;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::load::BodyLoad;
use shellwarp::modal::AnyBasis;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::modal_force::{self, Acting, Scratch};
use shellwarp::step::{ForceLaw, Integrator};
use shellwarp::support::{Pose, Rates};
use shellwarp::warp::lanes::{Fused, Lanes};
use shellwarp::warp::{Basis, coefficients_and_slopes, doublings};
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

fn model_of(shell: Shell, modes: usize) -> Arc<Model> {
    let options = Options { modes, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn basis(model: &Model) -> &Basis<f64> {
    match &model.modal.basis {
        AnyBasis::F64(basis) => basis,
        _ => unreachable!("asked for in f64"),
    }
}

fn modal_force(model: &Model, law: ForceLaw, loads: &[Vec3], q: &[f64], q_dot: &[f64]) -> Vec<f64> {
    let load = &BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default());
    let acting = Acting { load, external: Some(loads), law, q, q_dot, total_mass: model.shell.total_mass };
    let mut force = vec![0.0; q.len()];
    modal_force::project(basis(model), &acting, &mut Scratch::new(q.len()), &mut force);
    force
}

/// Amplitudes with rotations of up to `reach` rad in each mode.
fn amplitudes(model: &Model, rng: &mut StdRng, reach: f64) -> Vec<f64> {
    model.modal.largest_rotation.iter().map(|r| reach * rng.random_range(-1.0..1.0) / r).collect()
}

#[test]
fn slopes_of_the_coefficients_match_differences_of_closed_forms() {
    // dB/ds = (A/2 − B)/s and dC/ds = (B − 3C)/(2s) hold exactly; they lose 1/s digits to cancellation, so from s = 0.3 on.
    let closed = |s: f64| {
        let t = s.sqrt();
        let (a, b, c) = (t.sin() / t, (1.0 - t.cos()) / s, (t - t.sin()) / (s * t));
        ((0.5 * a - b) / s, (b - 3.0 * c) / (2.0 * s))
    };
    for k in 0..2000 {
        let s = 0.3 + 0.2 * f64::from(k); // up to 20 rad
        let halvings = doublings(s.sqrt());
        let (_, double) = coefficients_and_slopes(Lanes::<f64, Fused<Scalar>, 1>::new(Scalar), [s], halvings);
        let (_, single) = coefficients_and_slopes(Lanes::<f32, Fused<Scalar>, 1>::new(Scalar), [s as f32], halvings);
        let (db, dc) = closed(s);
        let (db, dc) = (2.0 * db, 2.0 * dc);
        assert!((double.b[0] - db).abs() < 1e-14 && (double.c[0] - dc).abs() < 1e-14, "s = {s}");
        assert!((f64::from(single.b[0]) - db).abs() < 1e-7 && (f64::from(single.c[0]) - dc).abs() < 1e-7, "s = {s}");
    }
    // Through zero: the first two terms of the series, whose next is below 1e-17 and 1e-19.
    for s in [0.0, 1e-12, 1e-6] {
        let (_, slopes) = coefficients_and_slopes(Lanes::<f64, Fused<Scalar>, 1>::new(Scalar), [s], 0);
        assert_close("2 dB/ds", slopes.b[0], -1.0 / 12.0 + s / 180.0, 1e-12, 0.0);
        assert_close("2 dC/ds", slopes.c[0], -1.0 / 60.0 + s / 1260.0, 1e-12, 0.0);
    }
}

#[test]
fn the_modal_force_is_the_gradient_of_the_loads_work() {
    let mut rng = StdRng::seed_from_u64(21);
    let model = model_of(reference("v_beam").0, 6);
    let n = model.shell.mass.len();
    let mut state = State::new(model.clone(), Method::VirtualWorkWarp, Integrator::ImplicitEuler).unwrap();
    for reach in [0.0, 1e-3, 0.3, 2.0] {
        let q = amplitudes(&model, &mut rng, reach);
        let loads: Vec<Vec3> = (0..n).map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        let rest = vec![0.0; q.len()];
        let force = modal_force(&model, ForceLaw::VirtualWork, &loads, &q, &rest);
        let mut work = |q: &[f64]| -> f64 {
            state.set_amplitudes(q, &rest).unwrap();
            displacements(&state).iter().zip(&loads).map(|(u, f)| u.dot(f)).sum()
        };
        for k in 0..q.len() {
            let step = 1e-3 / model.modal.largest_rotation[k];
            let mut at = |shift: f64| {
                let mut q = q.clone();
                q[k] += shift * step;
                work(&q)
            };
            let numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
            // Truncation (1e-3)⁴, rounding 1e-16/1e-3, times the sum over 369 vertices.
            assert_close(&format!("mode {k} at {reach}"), force[k], numeric, 1e-9, 1e-9 * force[0].abs());
        }
    }
}

#[test]
fn power_on_the_modes_is_power_on_the_vertices() {
    let mut rng = StdRng::seed_from_u64(22);
    let model = model_of(reference("v_beam").0, 6);
    for law in [ForceLaw::Linear, ForceLaw::Rotated, ForceLaw::VirtualWork] {
        let (q, q_dot) = (amplitudes(&model, &mut rng, 1.5), amplitudes(&model, &mut rng, 3.0));
        let loads: Vec<Vec3> =
            model.shell.mass.iter().map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        let force = modal_force(&model, law, &loads, &q, &q_dot);
        let on_modes: f64 = force.iter().zip(&q_dot).map(|(f, v)| f * v).sum();
        let mut on_vertices = 0.0;
        modal_force::visit_motion(basis(&model), law, (&q, &q_dot), |v, _, rate| on_vertices += rate.dot(&loads[v]));
        assert_close(&format!("{law:?}"), on_modes, on_vertices, 1e-12, 0.0); // sums of some 2000 terms
    }
}

/// (largest energy gain over the run, largest kinetic energy) of a flat beam dropped undamped under `gravity`.
fn energy_gain(method: Method, gravity: Vec3, h: f64) -> (f64, f64) {
    let model = model_of(reference("flat_beam").0, 8);
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(gravity).unwrap();
    let (mut gain, mut kinetic) = (0.0f64, 0.0f64);
    for _ in 0..(40.0 / h) as usize {
        state.step(h).unwrap();
        let weight: f64 = displacements(&state).iter().zip(&model.shell.mass).map(|(u, m)| m * gravity.dot(u)).sum();
        let report = state.report();
        gain = gain.max((report.elastic_energy + report.kinetic_energy - weight).abs());
        kinetic = kinetic.max(report.kinetic_energy);
    }
    (gain, kinetic)
}

#[test]
fn dead_loads_are_conservative_to_the_order_of_the_step() {
    let gravity = Vec3::new(0.0, 0.1, -0.4);
    let [coarse, fine] = [1.0 / 60.0, 1.0 / 240.0].map(|h| energy_gain(Method::VirtualWorkWarp, gravity, h));
    let drift = fine.0 / fine.1;
    assert!(drift < 0.02, "energy strays by {drift} of the largest kinetic energy");
    assert!(fine.0 < 0.5 * coarse.0, "and less with shorter steps: {fine:?} after {coarse:?}");
    let paper = energy_gain(Method::Warp, gravity, 1.0 / 240.0);
    assert!(paper.0 > 3.0 * fine.0, "the paper's law does net work round a loop at any step: {paper:?}");
}

#[test]
fn equilibria_have_the_errors_known_from_an_independent_implementation() {
    // Relative L2 error against the nonlinear shell, 8 modes, to the three digits that are known.
    let oblique = Vec3::new(0.0, 0.6, -0.8);
    let cases = [
        ("flat_beam", -0.1 * Vec3::z(), 0.018),
        ("flat_beam", -0.4 * Vec3::z(), 0.058),
        ("flat_beam", -0.8 * Vec3::z(), 0.077),
        ("v_beam", -3.0 * Vec3::z(), 0.039),
        ("v_beam", 3.0 * oblique, 0.032),
        ("v_beam", 5.0 * oblique, 0.064),
    ];
    for (name, gravity, expected) in cases {
        let model = model_of(reference(name).0, 8);
        let [warp, shell] = [Method::VirtualWorkWarp, Method::ImplicitShell].map(|method| {
            let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(gravity).unwrap();
            state.equilibrium().unwrap();
            displacements(&state)
        });
        let square = |u: Vec3| u.norm_squared();
        let error: f64 = warp.iter().zip(&shell).map(|(a, b)| square(a - b)).sum();
        let error = (error / shell.iter().map(|u| square(*u)).sum::<f64>()).sqrt();
        println!("{name} {gravity:?}: {error:.4}");
        assert!((error - expected).abs() <= 0.0006, "{name}, {gravity:?}: {error} instead of {expected}");
    }
}

#[test]
fn a_free_shell_turns_rigidly_under_either_law() {
    // Zero modes only: a couple on a free sheet spins it up as a rigid body, energy in = work done.
    let (rest, triangles) = equilateral_sheet(8, 6, 0.1);
    let mesh = shellwarp::Mesh::new(rest.clone(), &triangles).unwrap();
    let model = model_of(Shell::new(mesh, Material::default(), &Supports::default()).unwrap(), 6);
    let mut state = State::new(model, Method::VirtualWorkWarp, Integrator::Exact).unwrap();
    state.set_damping(&Damping::default()).unwrap();
    let last = rest.len() as u32 - 1;
    let pull = Vec3::new(0.0, 0.0, 1e-3);
    state.set_forces(vec![(0, pull), (last, -pull)], false).unwrap();
    for _ in 0..2000 {
        state.step(1e-2).unwrap();
    }
    let u = displacements(&state);
    let sides =
        |v: &dyn Fn(usize) -> Vec3| [(0, 1), (0, last as usize), (1, last as usize)].map(|(a, b)| (v(a) - v(b)).norm());
    let (before, after) = (sides(&|v| rest[v]), sides(&|v| rest[v] + u[v]));
    for (a, b) in before.iter().zip(after) {
        assert_close("distance", b, *a, 1e-9, 0.0); // a rigid body keeps all distances
    }
    assert!(state.report().max_rotation > 0.5, "{}", state.report().max_rotation);
}

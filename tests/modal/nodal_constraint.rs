//! Handles on the nonlinear shell: met exactly, with the forces that hold the same shape, and in balance of energy and work.

use crate::common::*;
use nalgebra::{Matrix3, UnitQuaternion};
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::constraint::{Constraint, MET, Outcome, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::{Ring, vertex_rotations};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// The middle of the reference beams' free end.
const TIP: u32 = 204;
const FRAME: f64 = 1.0 / 30.0;

fn model_of(shell: Shell) -> Arc<Model> {
    let options = Options { modes: 4, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn beam(name: &str) -> Arc<Model> {
    model_of(reference(name).0)
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap()
}

fn implicit(model: &Arc<Model>) -> State {
    state(model, Method::ImplicitShell)
}

fn damped(model: &Arc<Model>, xi: f64) -> State {
    let mut state = implicit(model);
    state.set_damping(&Damping { mass_coefficient: xi, ..Damping::default() }).unwrap();
    state
}

fn position(id: u32, vertex: u32, target: Vec3) -> Constraint {
    Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target: Target::Position(target) }
}

fn orientation(id: u32, vertex: u32, target: UnitQuaternion<f64>) -> Constraint {
    Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target: Target::Orientation(target) }
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

fn rotation(state: &State, vertex: u32) -> UnitQuaternion<f64> {
    let mut r = UnitQuaternion::identity();
    state.rotations(Space::World, |v, q| r = if v as u32 == vertex { q } else { r }).unwrap();
    r
}

fn outcome(state: &State, id: u32) -> Outcome {
    *state.constraints().find(|(c, _)| c.id == id).unwrap().1
}

fn rest(model: &Model, v: u32) -> Vec3 {
    model.shell.mesh.positions[v as usize]
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt()
}

fn random(rng: &mut StdRng) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

#[test]
fn a_vertexs_turn_matches_finite_differences() {
    let mut rng = StdRng::seed_from_u64(31);
    let mesh = mesh("v_beam.obj");
    for vertex in [0, 100, TIP] {
        let ring = Ring::of(&mesh, vertex);
        let mut x: Vec<Vec3> = mesh.positions.iter().map(|x| x + 0.02 * random(&mut rng)).collect();
        let turned = UnitQuaternion::from_scaled_axis(2.0 * random(&mut rng));
        x.iter_mut().for_each(|x| *x = turned * *x);
        let (present, by_vertex) = ring.turn(&ring.gather(&x));
        assert!(vertex_rotations(&mesh, &x)[vertex as usize].angle_to(&present) < 1e-12);
        for (v, by) in ring.vertices.iter().zip(&by_vertex) {
            let mut numeric = Matrix3::zeros();
            let h = 1e-5;
            for axis in 0..3 {
                let moved = |by: f64| {
                    let mut y = x.clone();
                    y[*v as usize][axis] += by;
                    (ring.rotation(&ring.gather(&y)) * present.inverse()).scaled_axis()
                };
                numeric.set_column(axis, &((moved(h) - moved(-h)) / (2.0 * h)));
            }
            // Truncation (h/l)² = 1e-8 with edges l of 0.1, of derivatives of 1/l.
            assert!((by - numeric).norm() < 1e-6 * by.norm().max(10.0), "vertex {v}: {by} instead of {numeric}");
        }
    }
}

#[test]
fn a_held_tip_needs_the_force_that_bends_a_beam_as_far() {
    // Small deflections: F = 3 D b d / L³. A strip of one third of its width over the length; D = 6 k_B at Poisson's ratio −1/3
    // is 0.9 of cylindrical bending's D (1 − ν²), so the force of a beam and that of a plate differ by a tenth: hence against
    // the same deflection by a dead force, and against the beam only to 15 %.
    let (nx, ny, edge) = (40, 6, 0.1);
    let (p, t) = equilateral_sheet(nx, ny, edge);
    let clamp = (0..p.len() as u32).filter(|v| p[*v as usize].x < 0.11).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 1.0, area_density: 1.0 };
    let tip = (0..p.len()).find(|v| p[*v].x > 3.999 && (p[*v].y - 3.0 * 0.0866).abs() < 0.01).unwrap() as u32;
    let width = ny as f64 * edge * 3f64.sqrt() / 2.0;
    let shell =
        Shell::new(Mesh::new(p, &t).unwrap(), material, &Supports { fixed: clamp, ..Default::default() }).unwrap();
    let model = model_of(shell);
    for lift in [0.01, 1.0] {
        let mut held = implicit(&model);
        let up = Constraint { axes: [false, false, true], ..position(5, tip, rest(&model, tip) + lift * Vec3::z()) };
        held.set_constraint(up).unwrap();
        held.equilibrium().unwrap();
        let told = outcome(&held, 5);
        assert_close("height", positions(&held)[tip as usize].z, lift, 1e-12, 0.0);
        assert!(told.residual <= 1e-12 && told.iterations > 0);
        assert_eq!((told.force.x, told.force.y), (0.0, 0.0), "axes that are free take no force");
        if lift < 0.1 {
            let bend = 3.0 * 6.0 * (1.0 - 1.0 / 9.0) * width * lift / 3.85f64.powi(3);
            println!("force {}, of a beam {bend}", told.force.z);
            assert_close("closed form", told.force.z, bend, 0.15, 0.0);
        }
        let mut pulled = implicit(&model);
        pulled.set_forces(vec![(tip, told.force)], false).unwrap();
        pulled.equilibrium().unwrap();
        let apart = distance(&positions(&pulled), &positions(&held));
        println!("lift {lift}: force {}, apart {apart:e}", told.force.z);
        // Both to 1e-8 of the force.
        assert!(apart <= 1e-6 * lift * (model.shell.mass.len() as f64).sqrt());
    }
}

#[test]
fn handles_of_any_kind_and_axes_are_met_by_every_step_and_balance_work() {
    for name in ["flat_beam", "v_beam"] {
        let model = beam(name);
        let size = model.shell.mesh.size;
        let mut state = implicit(&model);
        for k in 1..=40 {
            let t = f64::from(k) / 40.0;
            let lift = Vec3::new(-0.3 * t, 0.0, 0.8 * t);
            state.set_constraint(position(1, TIP, rest(&model, TIP) + lift)).unwrap();
            let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.4 * t, -0.3 * t, 0.2 * t));
            state.set_constraint(orientation(2, TIP, turn)).unwrap();
            state.step(FRAME).unwrap();
            let x = positions(&state)[TIP as usize];
            let missing = [(x - rest(&model, TIP) - lift).norm() / size, rotation(&state, TIP).angle_to(&turn)];
            assert!(missing[0] <= 1e-14 && missing[1] <= 1e-9, "{name}, step {k}: {missing:?}");
            let report = state.report();
            let energy = report.elastic_energy + report.kinetic_energy;
            // Backward Euler loses energy in every step but one through a snap, as of the V's section.
            assert!(energy <= report.constraint_work * (1.0 + 1e-6), "{name}, step {k}");
            if k % 10 == 0 {
                println!(
                    "{name} {k}: {} iterations, energy {energy:.4e}, work {:.4e}",
                    outcome(&state, 1).iterations,
                    report.constraint_work
                );
            }
        }
    }
}

#[test]
fn the_work_of_slow_handles_is_the_energy_that_they_leave() {
    // Slowly: the work is a sum with the forces at the ends of the steps, whose excess over the integral goes with the step.
    let model = beam("flat_beam");
    for axes in [[true; 3], [false, false, true]] {
        let excess = |steps: u32| {
            let mut state = implicit(&model);
            for k in 1..=steps {
                let t = f64::from(k) / f64::from(steps);
                let ease = t * t * (3.0 - 2.0 * t);
                let target = rest(&model, TIP) + Vec3::new(-0.02 * ease, 0.0, 0.4 * ease);
                state.set_constraint(Constraint { axes, ..position(1, TIP, target) }).unwrap();
                state.step(200.0 / f64::from(steps)).unwrap();
            }
            let report = state.report();
            report.constraint_work / report.elastic_energy - 1.0
        };
        let [coarse, fine] = [excess(50), excess(100)];
        println!("{axes:?}: work exceeds the energy by {coarse:.2e} and {fine:.2e}");
        assert!(fine > 0.0 && fine < 0.06);
        assert_close("work", 2.0 * fine - coarse, 0.0, 4e-3, 1.0); // of second order
    }
}

#[test]
fn the_torque_of_an_orientation_does_the_work_of_turning() {
    // A free sheet turned about its normal by a vertex: a rigid body whose energy is ½ I ω², reached by the handle's work.
    let (p, t) = equilateral_sheet(12, 8, 0.1);
    let shell = Shell::new(Mesh::new(p, &t).unwrap(), Material::default(), &Supports::default()).unwrap();
    let model = model_of(shell);
    for method in [Method::ImplicitShell, Method::ExplicitShell] {
        let mut state = state(&model, method);
        let (h, steps) = if method == Method::ImplicitShell { (1e-3, 100) } else { (1e-5, 10_000) };
        for k in 1..=steps {
            let t = f64::from(k) * h;
            state
                .set_constraint(orientation(3, 60, UnitQuaternion::from_scaled_axis(Vec3::z() * 0.5 * t * t)))
                .unwrap();
            state.step(h).unwrap();
            assert!(outcome(&state, 3).residual <= MET, "{method:?} step {k}: {:?}", outcome(&state, 3));
        }
        let report = state.report();
        let gained = report.kinetic_energy + report.elastic_energy;
        println!("{method:?}: energy {gained:e}, work {:e}", report.constraint_work);
        assert_close("work", report.constraint_work, gained, 0.03, 0.0);
    }
}

#[test]
fn a_handle_let_go_returns_the_shell_to_rest() {
    let model = beam("v_beam");
    let mut state = damped(&model, 4.0);
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, -0.4, 0.3));
    for k in 1..=30 {
        let t = f64::from(k) / 30.0;
        state.set_constraint(position(1, TIP, rest(&model, TIP) + Vec3::new(0.0, 0.2, 0.4) * t)).unwrap();
        state.set_constraint(orientation(9, 0, turn)).unwrap(); // at a support: it cannot turn
        state.step(FRAME).unwrap();
    }
    assert!(state.report().max_displacement > 0.4);
    assert_eq!(outcome(&state, 9).force, Vec3::zeros());
    assert_close("a support keeps its angle", outcome(&state, 9).residual, 0.5, 1e-6, 0.0);
    state.clear_constraint(1).unwrap();
    state.clear_constraint(9).unwrap();
    for _ in 0..600 {
        state.step(FRAME).unwrap();
    }
    // exp(−ξ t/2) = e⁻⁴⁰ and the slowest mode's own 5 rad/s against ξ: overdamped by none.
    assert!(state.report().max_displacement < 1e-6, "{}", state.report().max_displacement);
}

#[test]
fn contradictory_unreachable_and_far_targets_are_reported_and_break_nothing() {
    let model = beam("flat_beam");
    let size = model.shell.mesh.size;
    let mut state = damped(&model, 1.0);
    let (up, down) = (rest(&model, TIP) + 0.3 * Vec3::z(), rest(&model, TIP) + 0.1 * Vec3::z());
    for (id, target) in [(1, up), (2, down), (3, up)] {
        state.set_constraint(position(id, TIP, target)).unwrap();
    }
    state.set_constraint(position(4, 0, up)).unwrap(); // a support
    state.set_constraint(orientation(5, TIP, UnitQuaternion::from_scaled_axis(-0.3 * Vec3::y()))).unwrap();
    state.set_constraint(orientation(6, TIP, UnitQuaternion::from_scaled_axis(0.3 * Vec3::y()))).unwrap();
    state.step(FRAME).unwrap();
    assert_close("mean", positions(&state)[TIP as usize].z, 0.7 / 3.0, 1e-12, 0.0);
    let told = |id| outcome(&state, id);
    for (id, missing) in [(1, 0.2 / 3.0), (2, 0.4 / 3.0), (4, (up - rest(&model, 0)).norm())] {
        assert_close("residual", told(id).residual, missing, 1e-9, 0.0);
    }
    assert_eq!(told(1).force, told(3).force, "equal wishes bear equal shares");
    assert!(told(5).residual + told(6).residual >= 0.6 - 1e-6, "{:?} {:?}", told(5), told(6));
    state.clear_constraints();

    let mut rng = StdRng::seed_from_u64(32);
    for far in [0.1, 3.0, 1e40, 1e200] {
        state.reset();
        let goal = rest(&model, TIP) + far * size * random(&mut rng).normalize();
        state.set_constraint(position(1, TIP, goal)).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(3.0 * random(&mut rng));
        state.set_constraint(orientation(2, TIP, turn)).unwrap();
        state.step(FRAME).unwrap();
        println!("{far}: {:?} {:?}", outcome(&state, 1), outcome(&state, 2));
        assert!(far < 1.0 || outcome(&state, 1).residual > MET * size);
        state.clear_constraints();
        for _ in 0..2 {
            state.step(FRAME).unwrap();
        }
        assert!(positions(&state).iter().flatten().all(|c| c.is_finite()));
    }
}

#[test]
fn a_state_with_handles_is_cloned_saved_and_reset_like_any() {
    let model = beam("v_beam");
    let target = rest(&model, TIP) + Vec3::new(0.0, 0.1, 0.2);
    for method in [Method::ImplicitShell, Method::ExplicitShell] {
        let h = if method == Method::ImplicitShell { FRAME } else { 1e-4 };
        let mut state = self::state(&model, method);
        let soft = Constraint { compliance: 1e-3, ..position(2, TIP - 20, rest(&model, TIP - 20)) };
        let slow = |k: u32| rest(&model, TIP).lerp(&target, f64::from(k) / 40.0);
        for k in 1..=20 {
            state.set_constraint(position(1, TIP, slow(k))).unwrap();
            state.set_constraint(soft).unwrap();
            state.step(h).unwrap();
        }
        let told = outcome(&state, 2);
        assert_close("a spring's law", told.force.norm() * 1e-3, told.residual, 1e-9, 0.0);
        let (mut clone, bytes) = (state.try_clone().unwrap(), state.save());
        assert_eq!(outcome(&clone, 1), outcome(&state, 1));
        state.set_constraint(position(1, TIP, slow(21))).unwrap();
        clone.set_constraint(position(1, TIP, slow(21))).unwrap();
        state.step(h).unwrap();
        clone.step(h).unwrap();
        let after = state.save();
        assert_eq!(clone.save(), after, "{method:?}: a clone goes on with the same bits");
        assert!(state.report().constraint_work > 0.0);
        clone.load(&bytes).unwrap();
        clone.step(h).unwrap();
        assert_eq!(clone.save(), after, "{method:?}: and so does a loaded state");
        state.reset();
        assert_eq!((state.report().constraint_work, outcome(&state, 1)), (0.0, Outcome::default()));
        assert_eq!(state.constraints().count(), 2, "constraints survive a reset");
        state.clear_constraint(2).unwrap();
        assert!(state.clear_constraint(2).is_err());
        for bad in [
            Constraint { vertex: 369, ..position(1, TIP, target) },
            Constraint { compliance: f64::NAN, ..position(1, TIP, target) },
            Constraint { axes: [false; 3], ..position(1, TIP, target) },
        ] {
            assert!(state.set_constraint(bad).is_err());
        }
    }
}

#[test]
fn targets_and_axes_are_the_worlds_when_the_frame_is_elsewhere() {
    // Frame and handles turned and moved alike: the same shape in the frame, the same forces turned.
    let model = beam("flat_beam");
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
    let run = |pose: Pose, axes: [bool; 3]| {
        let mut state = implicit(&model);
        state.set_frame(pose, FrameMotion::Continuous);
        let bent = UnitQuaternion::from_scaled_axis(Vec3::new(0.1, -0.2, 0.1));
        for k in 1..=5 {
            let local = rest(&model, TIP) + Vec3::new(0.0, 0.02, 0.05) * f64::from(k);
            let world = pose.origin + pose.rotation * local;
            state.set_constraint(Constraint { axes, ..position(1, TIP, world) }).unwrap();
            state.set_constraint(orientation(2, TIP - 3, pose.rotation * bent)).unwrap();
            state.step(FRAME).unwrap();
        }
        let mut x = vec![Vec3::zeros(); model.shell.mass.len()];
        state.positions(Space::Frame, |v, p| x[v] = p);
        (x, [outcome(&state, 1), outcome(&state, 2)])
    };
    let there = Pose { origin: Vec3::new(3.0, -1.0, 2.0), rotation: turn };
    let (x, [held, turned]) = run(Pose::identity(), [true, false, true]);
    let (y, [held_there, turned_there]) = run(there, [false, true, true]); // the frame's x is the world's y
    assert!(distance(&x, &y) <= 1e-7, "{:e}", distance(&x, &y)); // two solves to 1e-9 of the force, through the soft modes
    assert!((turn * held.force - held_there.force).norm() <= 1e-5 * held.force.norm());
    assert!((turn * turned.force - turned_there.force).norm() <= 1e-5 * turned.force.norm());
}

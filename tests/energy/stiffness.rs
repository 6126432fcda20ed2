//! The stiffness factor of a running state: the same motion as a model of that stiffness, in every method and under every load.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::collider::Solid;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::contact::Obstacle;
use shellwarp::load::Wind;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

/// Its root is a power of two: both ways round alike, up to what absolute limits leave.
const FACTOR: f64 = 16.0;

/// A strip held at one end, `stiffer` times as stiff.
pub fn model(stiffer: f64) -> Arc<Model> {
    model_held(stiffer, 8, |x| x.x < 0.12)
}

fn model_held(stiffer: f64, modes: usize, held: impl Fn(&Vec3) -> bool) -> Arc<Model> {
    let (positions, triangles) = equilateral_sheet(14, 4, 0.1);
    let fixed = (0..positions.len() as u32).filter(|v| held(&positions[*v as usize])).collect();
    let material =
        Material { k_area: 2e2 * stiffer, k_length: 2e2 * stiffer, k_bend: 0.02 * stiffer, area_density: 1.0 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let shell = Shell::new(mesh, material, &Supports { fixed, ..Supports::default() }).unwrap();
    let reduced = reduced::Options { fields: 8, poses: 6, ..Default::default() };
    let options = Options { modes, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

pub const METHODS: [Method; 8] = [
    Method::Warp,
    Method::VirtualWorkWarp,
    Method::LinearModalAnalysis,
    Method::RotationStrain,
    Method::ReducedShell,
    Method::PolynomialShell,
    Method::ImplicitShell,
    Method::ExplicitShell,
];

fn state(model: &Arc<Model>, method: Method, factor: f64) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_stiffness(factor).unwrap();
    state
}

fn full(method: Method) -> bool {
    matches!(method, Method::ImplicitShell | Method::ExplicitShell)
}

/// Gravity, a force, wind, damping, a soft handle and a frame that moves.
fn load(state: &mut State) {
    let n = state.model().shell.mass.len() as u32;
    state.set_gravity(Vec3::new(0.0, 0.0, -2.0)).unwrap();
    state.set_forces([(n / 2, Vec3::new(0.0, 0.1, 0.3))], false).unwrap();
    let wind = Wind {
        velocity: Vec3::new(0.5, 2.0, 1.0),
        density: 0.4,
        normal_drag: 1.0,
        tangential_drag: 0.3,
        local: vec![],
    };
    state.set_wind(wind).unwrap();
    let ratios = if full(state.method()) { vec![] } else { vec![0.02] };
    // An explicit step with viscosity would have to be shorter still.
    let stiffness_coefficient = if state.method() == Method::ExplicitShell { 0.0 } else { 1e-3 };
    state.set_damping(&Damping { mass_coefficient: 0.4, stiffness_coefficient, ratios, ..Damping::default() }).unwrap();
    let target = Target::Position(state.model().shell.mesh.positions[n as usize - 1] + Vec3::new(0.0, 0.0, 0.2));
    state.set_constraint(Constraint { id: 3, vertex: n - 1, axes: [true; 3], compliance: 0.05, target }).unwrap();
}

fn lead(state: &mut State, step: u32) {
    let t = f64::from(step + 1) / 60.0;
    let rotation = UnitQuaternion::from_euler_angles(0.0, 0.2 * t, 0.4 * t);
    state.set_frame(Pose { origin: Vec3::new(0.3 * t * t, 0.0, 0.1 * t), rotation }, FrameMotion::Continuous);
}

fn steps(state: &mut State, range: std::ops::Range<u32>) {
    // Short enough for the explicit method, in pieces.
    let parts = if state.method() == Method::ExplicitShell { 1024 } else { 1 };
    for step in range {
        lead(state, step);
        (0..parts).for_each(|_| state.step(1.0 / 60.0 / f64::from(parts)).unwrap());
    }
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut all = vec![];
    state.positions(Space::World, |_, x| all.push(x));
    all
}

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// What a host sees, beside positions: numbers, and vectors that count by their length.
fn measures(state: &State) -> Vec<Vec3> {
    let report = state.report();
    let numbers = [report.time, report.kinetic_energy, report.elastic_energy, report.constraint_work];
    let mut all: Vec<Vec3> = numbers.map(|number| Vec3::new(number, 0.0, 0.0)).into();
    all.extend(state.constraints().map(|(_, outcome)| state.stiffness() * outcome.force));
    all.push(state.to_space(Space::World).velocity(Vec3::x(), Vec3::zeros()));
    all
}

/// Twenty steps by a factor and by a precompute of that stiffness: asserts that they are one motion, and returns both and how far it goes.
fn assert_alike(soft: &Arc<Model>, stiff: &Arc<Model>, method: Method, name: &str) -> ([State; 2], f64) {
    let mut both = [state(soft, method, FACTOR), state(stiff, method, 1.0)];
    for state in &mut both {
        load(state);
        steps(state, 0..20);
    }
    let [by_factor, precomputed] = &both;
    let moved = displacements(precomputed).iter().map(|u| u.norm()).fold(0.0, f64::max);
    let off = furthest(&positions(by_factor), &positions(precomputed)) / moved;
    println!("{name}{method:?}: moves by {moved:.3}, {off:.1e} of it apart");
    // Powers of two lose no bit; searches end at tolerances of 1e-6 of the load and of the size, and a training of another scale chooses alike.
    assert!(moved > 0.02 && off < 1e-5, "{name}{method:?}: {off:e} of {moved}");
    for (a, b) in measures(by_factor).iter().zip(measures(precomputed)) {
        let apart = (a - b).norm() / b.norm().max(1e-4);
        assert!(apart <= 1e-4, "{name}{method:?}: {a:?} instead of {b:?}, {apart:.2e} apart");
    }
    (both, moved)
}

#[test]
fn a_factor_moves_a_shell_as_a_precompute_of_that_stiffness_does() {
    let (soft, stiff) = (model(1.0), model(FACTOR));
    for method in METHODS {
        let (mut both, moved) = assert_alike(&soft, &stiff, method, "");
        let equilibria = both.each_mut().map(|state| {
            state.equilibrium().unwrap();
            positions(state)
        });
        assert!(furthest(&equilibria[0], &equilibria[1]) < 1e-5 * moved.max(1.0), "{method:?}: at rest");
    }
}

/// In a frame that floats; the spin of one that nothing holds is a rate, too.
#[test]
fn a_factor_moves_a_shell_that_floats_as_a_precompute_of_that_stiffness_does() {
    for (name, held) in [("free", false), ("on a hinge", true)] {
        let [soft, stiff] = [1.0, FACTOR].map(|stiffer| model_held(stiffer, 14, |x| held && x.x < 1e-9));
        for method in [Method::ReducedShell, Method::PolynomialShell] {
            assert_alike(&soft, &stiff, method, &format!("{name}, "));
        }
    }
}

#[test]
fn a_factor_that_changes_keeps_shape_and_velocities_and_goes_on_as_a_model_of_that_stiffness() {
    let (soft, stiff) = (model(1.0), model(FACTOR));
    for method in [Method::Warp, Method::RotationStrain] {
        let mut one = state(&soft, method, 1.0);
        load(&mut one);
        steps(&mut one, 0..10);
        let (before, speed) = (positions(&one), one.report().kinetic_energy);
        one.set_stiffness(FACTOR).unwrap();
        assert!(positions(&one) == before);
        assert_close("kinetic energy", one.report().kinetic_energy, speed, 1e-14, 0.0);
        // The model of that stiffness from there, with the frame as it moves.
        let mut other = state(&stiff, method, 1.0);
        load(&mut other);
        steps(&mut other, 0..10);
        let (q, rate) = one.amplitudes().unwrap();
        let rate: Vec<f64> = rate.iter().map(|rate| one.tempo() * rate).collect();
        other.set_amplitudes(q, &rate).unwrap();
        steps(&mut one, 10..20);
        steps(&mut other, 10..20);
        assert!(furthest(&positions(&one), &positions(&other)) < 1e-7, "{method:?}");
    }
    // There and back is nothing but rounding, and a reset keeps the factor.
    let mut there_and_back = state(&soft, Method::ReducedShell, 1.0);
    load(&mut there_and_back);
    let mut plain = there_and_back.try_clone().unwrap();
    for step in 0..10 {
        there_and_back.set_stiffness(3.0).unwrap();
        there_and_back.set_stiffness(1.0).unwrap();
        steps(&mut there_and_back, step..step + 1);
        steps(&mut plain, step..step + 1);
    }
    assert!(furthest(&positions(&there_and_back), &positions(&plain)) < 1e-9);
    there_and_back.set_stiffness(3.0).unwrap();
    there_and_back.reset();
    assert!(there_and_back.stiffness() == 3.0);
}

#[test]
fn contacts_and_given_frames_go_by_the_factor() {
    let (soft, stiff) = (model(1.0), model(FACTOR));
    for method in [Method::Warp, Method::ReducedShell, Method::ImplicitShell] {
        let run = |model: &Arc<Model>, factor: f64| {
            let mut state = state(model, method, factor);
            let floor = Pose { origin: Vec3::new(0.0, 0.0, -0.05), rotation: UnitQuaternion::identity() };
            state.set_obstacles(vec![Obstacle::new(Arc::new(Solid::plane()), floor).with_friction(0.3)]).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -20.0)).unwrap();
            state
                .set_damping(&Damping { mass_coefficient: 2.0, stiffness_coefficient: 0.0, ..Damping::default() })
                .unwrap();
            for _ in 0..40 {
                let rates = Rates { acceleration: Vec3::new(0.0, 0.5, 0.0), ..Rates::default() };
                state.set_frame(Pose::identity(), FrameMotion::Given(rates));
                state.step(1.0 / 60.0).unwrap();
            }
            let force: Vec3 = state.contacts().map(|contact| contact.force).sum();
            (positions(&state), force, state.contact_summary())
        };
        let ((found, force, summary), (exact, expected, other)) = (run(&soft, FACTOR), run(&stiff, 1.0));
        println!("{method:?}: {:.1e}, {force:?} {expected:?}", furthest(&found, &exact));
        assert!(furthest(&found, &exact) < 1e-4, "{method:?}"); // the search for contacts ends at a share of the size
        assert!(expected.norm() > 0.1 && (force - expected).norm() < 1e-2 * expected.norm(), "{method:?}");
        assert!((summary.impulse - other.impulse).norm() < 1e-2 * other.impulse.norm(), "{method:?}");
    }
}

#[test]
fn factors_out_of_range_are_refused_and_saved_states_know_theirs() {
    let soft = model(1.0);
    let mut one = state(&soft, Method::Warp, 0.25);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-10, 1e10] {
        let error = one.set_stiffness(bad).unwrap_err();
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains("factor is"), "{error}");
        assert!(one.stiffness() == 0.25);
    }
    load(&mut one);
    steps(&mut one, 0..5);
    let saved = one.save();
    let mut other = state(&soft, Method::Warp, 1.0);
    assert!(other.load(&saved).unwrap_err().message.contains("stiffness factor"));
    other.set_stiffness(0.25).unwrap();
    load(&mut other);
    other.load(&saved).unwrap();
    let mut clone = one.try_clone().unwrap();
    for state in [&mut one, &mut other, &mut clone] {
        steps(state, 5..10);
    }
    assert!(positions(&one) == positions(&other) && positions(&one) == positions(&clone));
}

//! Static solutions in a frame that turns.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Vec3};
use std::sync::{Arc, OnceLock};

/// The flat beam.
fn model() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let reduced = reduced::Options { fields: 24, poses: 8, ..Default::default() };
        let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
        Arc::new(Model::precompute(Arc::new(reference("flat_beam").0), &options, &mut |_, _| Ok(())).unwrap())
    })
}

fn state(method: Method) -> State {
    State::new(model().clone(), method, Integrator::Exact).unwrap()
}

fn spinning(omega: Vec3) -> FrameMotion {
    FrameMotion::Given(Rates { angular_velocity: omega, ..Rates::default() })
}

fn turned_to(omega: Vec3, time: f64) -> Pose {
    Pose { rotation: UnitQuaternion::from_scaled_axis(omega * time), ..Pose::identity() }
}

/// The slowest mode's.
fn frequency() -> f64 {
    model().modal.eigenvalues[0].sqrt()
}

#[test]
fn the_equilibrium_is_where_damped_motion_in_the_turning_frame_ends() {
    let omega = 1.2 * frequency() * Vec3::z();
    let gravity = Vec3::new(0.0, 0.0, -0.1);
    for method in [
        Method::LinearModalAnalysis,
        Method::Warp,
        Method::VirtualWorkWarp,
        Method::RotationStrain,
        Method::ReducedShell,
        Method::PolynomialShell,
        Method::ImplicitShell,
    ] {
        let mut state = state(method);
        state.set_gravity(gravity).unwrap();
        state.equilibrium().unwrap();
        let unmoved = displacements(&state);
        // Critically damped in the slowest mode, for fifteen of its periods.
        state.set_damping(&Damping { mass_coefficient: 2.0 * frequency(), ..Damping::default() }).unwrap();
        let h = std::f64::consts::TAU / frequency() / 20.0;
        let turn = |k: usize, state: &mut State| {
            state.set_frame(turned_to(omega, k as f64 * h), spinning(omega));
            state.step(h).unwrap();
        };
        (1..=300).for_each(|k| turn(k, &mut state));
        let (settled, pose) = (displacements(&state), *state.pose());
        state.equilibrium().unwrap();
        let found = displacements(&state);
        assert_eq!(*state.pose(), pose);
        let (off, changed) = (error(&found, &settled), error(&found, &unmoved));
        println!("{method:?}: {off:.1e} from where it settles, {changed:.2} from where it hangs without the spin");
        // Fixed points and searches end at 1e-6 of the load; a reduced shell's steps at 1e-5 of its shape.
        assert!(off < 1e-4, "{method:?}: {off:e}");
        assert!(method == Method::LinearModalAnalysis || changed > 0.1, "{method:?}: the spin changes {changed}");
        // The frame goes on: nothing is left that would set the shell in motion.
        turn(301, &mut state);
        let report = state.report();
        assert!(report.kinetic_energy < 1e-6 * report.elastic_energy, "{method:?}: {report:?}");
        // Set with the frame's rates instead, it is the same.
        let mut given = self::state(method);
        given.set_gravity(gravity).unwrap();
        given.set_frame(pose, spinning(omega));
        given.equilibrium().unwrap();
        assert!(error(&displacements(&given), &found) < 1e-5, "{method:?}");
        // A teleport stops it.
        given.set_frame(pose, FrameMotion::Teleport);
        given.equilibrium().unwrap();
        assert!(error(&displacements(&given), &unmoved) < 1e-5, "{method:?}");
    }
}

#[test]
fn the_estimate_of_a_spinning_equilibrium_is_of_the_spinning_shell() {
    let omega = 1.2 * frequency() * Vec3::z();
    let at_rest = |method: Method| {
        let mut state = state(method);
        state.set_gravity(Vec3::new(0.0, 0.0, -0.1)).unwrap();
        state.set_frame(Pose::identity(), spinning(omega));
        state.equilibrium().unwrap();
        state
    };
    let exact = displacements(&at_rest(Method::ImplicitShell));
    for method in [Method::LinearModalAnalysis, Method::Warp, Method::ReducedShell, Method::PolynomialShell] {
        let state = at_rest(method);
        let (told, off) = (state.certify().unwrap().error, mass_error(&model().shell, &displacements(&state), &exact));
        println!("{method:?}: estimated {told:.4}, true {off:.4}");
        // A few Newton steps under forces as at the state's own pose.
        assert_close("estimate", told, off, 0.2, 1e-2);
    }
}

#[test]
fn spin_softens_linear_modes_as_the_closed_form_says_up_to_the_critical_speed() {
    // About the beam's own axis: of a mode that moves across it the force is ω²q, so q = f/(λ − ω²).
    let gravity = Vec3::new(0.0, 0.0, -0.01);
    let amplitude = |share: f64| {
        let mut state = state(Method::LinearModalAnalysis);
        state.set_gravity(gravity).unwrap();
        state.set_frame(Pose::identity(), spinning(share * frequency() * Vec3::x()));
        state.equilibrium().map(|_| state.amplitudes().unwrap().0[0])
    };
    let still = amplitude(0.0).unwrap();
    for share in [0.3, 0.7, 0.9] {
        assert_close("amplitude", amplitude(share).unwrap(), still / (1.0 - share * share), 1e-6, 0.0);
    }
    let error = amplitude(1.3).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Numerical);
    assert!(error.message.contains("no equilibrium"), "{error}");
}

#[test]
fn a_translating_frame_has_the_equilibrium_of_one_at_rest_and_moves_on_without_a_kick() {
    for method in [Method::Warp, Method::ReducedShell, Method::PolynomialShell, Method::ImplicitShell] {
        let mut state = state(method);
        state.set_gravity(Vec3::new(0.0, 0.0, -0.1)).unwrap();
        state.equilibrium().unwrap();
        let still = displacements(&state);
        let at = |k: usize| Pose { origin: 0.1 * k as f64 * Vec3::new(1.0, 0.5, 0.0), ..Pose::identity() };
        let forward = |k: usize, state: &mut State| {
            state.set_frame(at(k), FrameMotion::Continuous);
            state.step(0.05).unwrap();
        };
        (0..5).for_each(|k| forward(k, &mut state));
        state.equilibrium().unwrap();
        assert!(error(&displacements(&state), &still) < 1e-6, "{method:?}");
        forward(5, &mut state);
        assert!(error(&displacements(&state), &still) < 1e-5, "{method:?}");
    }
}

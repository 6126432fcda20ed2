//! Stiffness by look: a frequency or a sag gives the factor, in every method.

use crate::stiffness::{METHODS, model};
use shellwarp::model::Model;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Vec3};
use std::sync::Arc;

const LENGTH: f64 = 1.4;
const GRAVITY: f64 = 2.0;

fn hanging(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -GRAVITY)).unwrap();
    state
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut all = vec![];
    state.positions(Space::World, |_, x| all.push(x));
    all
}

/// A model that was precomputed with the factor swings as fast.
#[test]
fn a_frequency_gives_the_factor_of_a_model_that_swings_so() {
    let soft = model(1.0);
    for method in METHODS {
        let mut state = hanging(&soft, method);
        let factor = state.set_frequency(3.0).unwrap();
        assert!(state.stiffness() == factor);
        // Eigenvalues go with the stiffness; each search is good to 1e-10.
        let swings = model(factor).modal.frequencies().next().unwrap();
        assert!((swings / 3.0 - 1.0).abs() < 1e-9, "{method:?}: {swings}");
    }
}

/// Up to a sixth of the length for all, and two thirds for those that are good for it. A model that was precomputed with the factor hangs there too.
#[test]
fn every_method_hangs_as_far_as_is_asked_for() {
    let soft = model(1.0);
    for method in METHODS {
        let deep = matches!(method, Method::ImplicitShell | Method::ExplicitShell | Method::ReducedShell);
        for share in [0.01, 0.15].into_iter().chain(deep.then_some(0.65)) {
            let (mut state, sag) = (hanging(&soft, method), share * LENGTH);
            let factor = state.set_sag(sag, 1e-4).unwrap();
            assert!(state.stiffness() == factor);
            let found = state.report().max_displacement;
            assert!((found / sag - 1.0).abs() <= 1e-4, "{method:?}, {share}: {found}");
            if method == Method::ImplicitShell {
                let mut other = hanging(&model(factor), method);
                other.equilibrium().unwrap();
                let again = other.report().max_displacement;
                // Both rest to a residual of 1e-6 of the load or less.
                assert!((again / sag - 1.0).abs() <= 1.1e-4, "{share}: {again}");
            }
        }
    }
}

/// Linear modes sag by the inverse of the factor, exactly.
#[test]
fn of_linear_modes_the_factor_is_the_ratio_of_two_sags() {
    let mut state = hanging(&model(1.0), Method::LinearModalAnalysis);
    state.set_gravity(Vec3::new(0.0, 0.0, -1e-2)).unwrap(); // turns by less than half a turn
    state.equilibrium().unwrap();
    let before = state.report().max_displacement;
    let factor = state.set_sag(0.05, 1e-9).unwrap();
    assert!((factor / (before / 0.05) - 1.0).abs() < 2e-9, "{factor}, {}", before / 0.05);
}

/// Where the strip begins does not matter: far too soft to find a rest at first, or far too stiff; nor which way it pulls.
#[test]
fn the_search_comes_from_any_stiffness_and_with_forces_too() {
    let soft = model(1.0);
    let factor = hanging(&soft, Method::ImplicitShell).set_sag(0.3, 1e-4).unwrap();
    for first in [1e-6, 1e6] {
        let mut state = hanging(&soft, Method::ImplicitShell);
        state.set_stiffness(first).unwrap();
        // The sag goes with the factor to a power of no less than 0.2, and two ends of the tolerance lie apart.
        assert!((state.set_sag(0.3, 1e-4).unwrap() / factor - 1.0).abs() < 2e-3);
    }
    let mut pulled = State::new(soft.clone(), Method::ImplicitShell, Integrator::ImplicitEuler).unwrap();
    let n = soft.shell.mass.len() as u32;
    pulled.set_forces([(n - 1, Vec3::new(0.0, 0.0, 0.5))], false).unwrap();
    pulled.set_sag(0.2, 1e-3).unwrap();
    assert!((pulled.report().max_displacement / 0.2 - 1.0).abs() <= 1e-3);
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let soft = model(1.0);
    for method in [Method::Warp, Method::ReducedShell, Method::ImplicitShell] {
        let mut state = hanging(&soft, method);
        state.set_stiffness(4.0).unwrap();
        state.equilibrium().unwrap();
        let before = positions(&state);
        let refused = |error: shellwarp::Error, part: &str| {
            assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains(part), "{method:?}: {error}");
        };
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            refused(state.set_sag(bad, 0.01).unwrap_err(), "length is");
            refused(state.set_frequency(bad).unwrap_err(), "hertz is");
        }
        for bad in [0.0, -1.0, f64::NAN, 1.0] {
            refused(state.set_sag(0.1, bad).unwrap_err(), "tolerance is");
        }
        refused(state.set_frequency(1e9).unwrap_err(), "factor is");
        // No factor in the range stretches it so far: by some methods the last shapes are not found.
        let error = state.set_sag(1e12 * LENGTH, 0.01).unwrap_err();
        let told = error.message.contains("no stiffness was found");
        assert!(told || error.kind == ErrorKind::Numerical, "{method:?}: {error}");
        state.set_gravity(Vec3::zeros()).unwrap();
        refused(state.set_sag(0.1, 0.01).unwrap_err(), "nothing moves");
        assert!(state.stiffness() == 4.0 && positions(&state) == before, "{method:?}");
    }
}

/// The strip hangs straight down from its end at most: a quarter turn, √2 of its length. Half its length further it would have to stretch, by far more at the support.
#[test]
fn a_sag_beyond_what_bending_gives_is_refused() {
    let mut state = hanging(&model(1.0), Method::ImplicitShell);
    let before = positions(&state);
    for share in [2.0, 3.5] {
        let error = state.set_sag(share * LENGTH, 1e-3).unwrap_err();
        let told = error.message.contains("without stretching: an edge would be");
        assert!(error.kind == ErrorKind::InvalidArgument && told, "{share}: {error}");
        assert!(state.stiffness() == 1.0 && positions(&state) == before);
    }
    state.set_sag(LENGTH, 1e-3).unwrap();
}

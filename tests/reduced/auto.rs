//! A method by a budget: what was measured, what was taken, and what states then do.

use crate::common::*;
use shellwarp::auto::{self, Budget};
use shellwarp::model::front::Candidate;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::modes::Demand;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Result, Vec3, reduced};
use std::sync::Arc;

const GRAVITY: Vec3 = Vec3::new(0.0, 3.0, -4.0);

fn options(demand: Demand) -> Options {
    let reduced = reduced::Options { fields: 16, elements: 200, ..Default::default() };
    Options { modes: 6, precision: Precision::F64, reduced, demand: Some(demand), ..Default::default() }
}

fn chosen(error: f64, operations: f64) -> Result<Arc<Model>> {
    let demand = Demand { gravity: GRAVITY, amplification: 1.0, ..Demand::default() };
    let shell = Arc::new(reference("v_beam").0);
    auto::precompute(shell, &options(demand), Budget { error, operations }, &mut |_, _| Ok(())).map(Arc::new)
}

/// The furthest that a vertex is off under gravity and half of it.
fn furthest(model: &Arc<Model>, method: Method) -> f64 {
    let rest = model.shell.sag.as_ref().map_or(&model.shell.mesh.positions, |sag| &sag.rest);
    let mut furthest = 0.0f64;
    for share in [1.0, 0.5] {
        let place = |method: Method| {
            let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(share * GRAVITY).unwrap();
            state.equilibrium().unwrap();
            let mut u = vec![];
            state.positions(Space::Frame, |v, x| u.push(x - rest[v]));
            u
        };
        let (own, exact) = (place(method), place(Method::ImplicitShell));
        furthest = own.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(furthest, f64::max);
    }
    furthest
}

#[test]
fn the_choice_is_the_cheapest_that_meets_the_error_and_does_what_was_measured() {
    let best = chosen(0.0, f64::INFINITY).unwrap();
    let front = best.front.as_ref().unwrap();
    for c in &front.candidates {
        println!("{c:?}");
    }
    let methods: Vec<Method> = front.candidates.iter().map(|c| c.method).collect();
    let at_rest = [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain];
    let sagged = &at_rest[2..];
    assert_eq!(methods, [&at_rest[..], sagged, &[Method::ReducedShell; 2]].concat());
    assert!(front.candidates.iter().all(|c| front.choice().error <= c.error && c.operations > 0.0));
    let linear = &front.candidates[0];
    assert!(front.candidates.iter().all(|c| linear.operations <= c.operations));

    // Between the errors of the methods lie budgets that each of the front's meets as the cheapest.
    let on_front = |c: &&Candidate| {
        front.candidates.iter().all(|other| other == *c || other.error > c.error || other.operations > c.operations)
    };
    let wanted: Vec<&Candidate> = front.candidates.iter().filter(on_front).collect();
    assert!(wanted.len() >= 2, "{wanted:?}");
    for candidate in wanted {
        let model = chosen(1.0001 * candidate.error, f64::INFINITY).unwrap();
        let front = model.front.as_ref().unwrap();
        assert_eq!(front.choice(), candidate); // and the measurements are the same each time
        assert_eq!(model.chosen_method(), candidate.method);
        assert_eq!(model.shell.sag.is_some(), candidate.sagged);
        assert_eq!(model.reduced.is_some(), candidate.method == Method::ReducedShell);
        assert_close("error", furthest(&model, candidate.method), candidate.error, 1e-6, 1e-6 * model.shell.mesh.size);
    }
    // What can be afforded goes before what is wanted.
    let cheap = chosen(0.0, 1.0001 * linear.operations).unwrap();
    assert!(cheap.front.as_ref().unwrap().choice().operations <= 1.0001 * linear.operations);
}

#[test]
fn a_choice_is_saved_with_its_model() {
    let model = chosen(0.0, f64::INFINITY).unwrap();
    let bytes = model.save().unwrap();
    let loaded = Model::load(&bytes).unwrap();
    assert_eq!(loaded.front, model.front);
    assert!(loaded.save().unwrap() == bytes);
    // Another choice than the model can move by is not taken, whatever its checksum.
    let front = model.front.clone().unwrap();
    for chosen in 0..front.candidates.len() {
        let Ok(mut other) = Model::load(&bytes) else { panic!() };
        other.front = Some(shellwarp::model::front::Front { chosen, ..front.clone() });
        let fits = front.candidates[chosen].sagged == model.shell.sag.is_some()
            && (front.candidates[chosen].method != Method::ReducedShell || model.reduced.is_some());
        assert_eq!(Model::load(&other.save().unwrap()).is_ok(), fits, "{chosen}");
    }
}

#[test]
fn pulls_and_accelerations_of_the_scene_are_among_its_loads() {
    let shell = Arc::new(reference("v_beam").0);
    let worst = |demand: Demand| {
        let options = options(demand);
        let budget = Budget { error: f64::INFINITY, operations: f64::INFINITY };
        let options = Options { reduced: reduced::Options { fields: 2, elements: 20, ..options.reduced }, ..options };
        let model = auto::precompute(shell.clone(), &options, budget, &mut |_, _| Ok(())).unwrap();
        model.front.unwrap().candidates[1].error
    };
    let gravity = Demand { gravity: GRAVITY, amplification: 1.0, ..Demand::default() };
    let pulled = Demand { handles: vec![204], distance: 0.2, ..gravity.clone() };
    let shaken = Demand { acceleration: 2.0, ..gravity.clone() };
    let alone = worst(gravity);
    for more in [pulled, shaken] {
        let error = worst(more);
        println!("{error} with more loads, {alone} without");
        assert!(error > alone); // the most of more loads, beyond the gravity
    }
}

#[test]
fn a_choice_without_loads_is_refused() {
    let demand = Demand { amplification: 1.0, ..Demand::default() };
    let shell = Arc::new(reference("v_beam").0);
    let budget = Budget { error: 0.1, operations: f64::INFINITY };
    let error = auto::precompute(shell.clone(), &options(demand), budget, &mut |_, _| Ok(())).err().unwrap();
    assert_eq!(error.kind, ErrorKind::InvalidArgument);
    let plain = Model::precompute(shell, &Options::default(), &mut |_, _| Ok(())).unwrap();
    assert_eq!(plain.chosen_method(), Method::Warp);
}

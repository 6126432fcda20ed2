//! The reduced shell in either form: the one that acts, that nothing jumps where it changes, and that a state goes on by it.

use crate::common::*;
use shellwarp::Vec3;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::reduced::polynomial::{Gate, UNSEEN};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use std::sync::{Arc, OnceLock};

const STEP: f64 = 1.0 / 60.0;

/// Bytes of a trained leaf.
fn trained() -> &'static Vec<u8> {
    static SAVED: OnceLock<Vec<u8>> = OnceLock::new();
    SAVED.get_or_init(|| {
        let reduced = reduced::Options { fields: 10, elements: 300, poses: 8, ..Default::default() };
        let options = Options { modes: 5, precision: Precision::F64, reduced, ..Options::default() };
        Model::precompute(Arc::new(leaf(1)), &options, &mut |_, _| Ok(())).unwrap().save().unwrap()
    })
}

/// With the polynomial as good as the samples up to so large a |q|.
fn model(range: f64) -> Arc<Model> {
    let mut model = Model::load(trained()).unwrap();
    let reduced = model.reduced.as_mut().and_then(Arc::get_mut).unwrap();
    reduced.polynomial.as_mut().unwrap().gate.range = range;
    Arc::new(model)
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::Exact).unwrap()
}

/// Gravity that swings the leaf by about a third of its size, and turns over.
fn load(state: &mut State, k: usize) {
    let side = if k % 80 < 40 { 1.0 } else { -1.0 };
    state.set_gravity(Vec3::new(0.0, 0.1, -0.6) * side).unwrap();
}

/// Every shape on the way, as bits of displacements, and whether the samples act.
fn run(state: &mut State, steps: std::ops::Range<usize>) -> Vec<(Vec<Vec3>, bool)> {
    steps
        .map(|k| {
            load(state, k);
            state.step(STEP).unwrap();
            let plan = state.plan(STEP).unwrap();
            (displacements(state), plan.iter().any(|part| part.reason.contains("the samples act")))
        })
        .collect()
}

fn shapes(run: &[(Vec<Vec3>, bool)]) -> Vec<&Vec<Vec3>> {
    run.iter().map(|(shape, _)| shape).collect()
}

#[test]
fn within_the_range_it_is_the_polynomial_and_without_one_the_samples() {
    let (wide, none) = (model(1e9), model(0.0));
    for (model, form, samples) in [(&wide, Method::PolynomialShell, false), (&none, Method::ReducedShell, true)] {
        let own = run(&mut state(model, Method::AdaptiveShell), 0..60);
        let pure = run(&mut state(model, form), 0..60);
        assert_eq!(shapes(&own), shapes(&pure), "{form}");
        assert!(own.iter().all(|(_, act)| *act == samples));
    }
}

#[test]
fn nothing_jumps_where_the_form_changes_and_it_seldom_does() {
    let far = run(&mut state(&model(0.0), Method::AdaptiveShell), 0..160);
    let size = |shape: &Vec<Vec3>| shape.iter().map(|u| u.norm()).fold(0.0, f64::max);
    let largest = far.iter().map(|(shape, _)| size(shape)).fold(0.0, f64::max);
    // The range is at a third of the largest |q|: the leaf crosses it in every swing.
    let model = model(0.33 * mass_size(&far));
    let mut state = state(&model, Method::AdaptiveShell);
    let run = run(&mut state, 0..160);
    let changes = run.windows(2).filter(|pair| pair[0].1 != pair[1].1).count();
    let way = |run: &[(Vec<Vec3>, bool)]| -> Vec<f64> {
        let apart = |pair: &[(Vec<Vec3>, bool)]| {
            pair[0].0.iter().zip(&pair[1].0).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        };
        run.windows(2).map(apart).collect()
    };
    let (own, pure) = (way(&run), way(&far));
    let [fastest, usual] = [&own, &pure].map(|way| way.iter().copied().fold(0.0, f64::max));
    println!(
        "{changes} changes in 160 steps, largest {largest:.2}, furthest in a step {fastest:.3} and {usual:.3} by the samples alone"
    );
    // Four half swings of 40 steps cross the range a few times each; without a band a form would change in every other step near it.
    assert!((2..=16).contains(&changes), "{changes}");
    // A step moves no vertex further than the samples' own motion does, within what the forms differ by.
    assert!(fastest < 1.5 * usual, "{fastest} {usual}");
    // And at a change no further than the steps beside it allow: second differences stay of the size that they have elsewhere.
    let bend = |way: &[f64]| way.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(bend(&own) < 2.0 * bend(&pure) + 0.01 * usual, "{} {}", bend(&own), bend(&pure));
}

/// |q| of the largest shape, by the leaf's mass.
fn mass_size(run: &[(Vec<Vec3>, bool)]) -> f64 {
    let shell = leaf(1);
    let square = |shape: &Vec<Vec3>| shape.iter().zip(&shell.mass).map(|(u, m)| m * u.norm_squared()).sum::<f64>();
    run.iter().map(|(shape, _)| square(shape).sqrt()).fold(0.0, f64::max)
}

#[test]
fn a_state_goes_on_by_the_form_that_it_had() {
    let far = run(&mut state(&model(0.0), Method::AdaptiveShell), 0..80);
    let model = model(0.33 * mass_size(&far));
    let mut first = state(&model, Method::AdaptiveShell);
    let whole = run(&mut first, 0..80);
    let mut tried = [false; 2];
    for stop in [7, 23, 35, 52, 71] {
        let mut parts = state(&model, Method::AdaptiveShell);
        run(&mut parts, 0..stop);
        let saved = parts.save();
        let mut loaded = state(&model, Method::AdaptiveShell);
        loaded.load(&saved).unwrap();
        assert_eq!(loaded.save(), saved);
        let clone = run(&mut parts.try_clone().unwrap(), stop..80);
        assert_eq!(shapes(&clone), shapes(&whole[stop..]));
        assert_eq!(shapes(&run(&mut loaded, stop..80)), shapes(&whole[stop..]));
        tried[usize::from(whole[stop - 1].1)] = true;
    }
    assert_eq!(tried, [true, true]);
    // A form is one or the other, and a state of one form alone takes no other's.
    let mut other = state(&model, Method::PolynomialShell);
    assert!(other.load(&first.save()).unwrap_err().message.contains("adaptive-shell"));
    first.reset();
    assert_eq!(shapes(&run(&mut first, 0..80)), shapes(&whole));
    first.set_method(Method::Warp).unwrap();
    first.set_method(Method::AdaptiveShell).unwrap();
    run(&mut first, 0..5);
}

#[test]
fn an_equilibrium_is_of_the_form_for_where_it_is() {
    let rest = |model: &Arc<Model>, method: Method| {
        let mut state = state(model, method);
        load(&mut state, 0);
        state.equilibrium().unwrap();
        displacements(&state)
    };
    let (small, wide) = (model(1e-3), model(1e9));
    let sampled = rest(&small, Method::ReducedShell);
    assert!(error(&rest(&small, Method::AdaptiveShell), &sampled) < 1e-5);
    assert_eq!(rest(&wide, Method::AdaptiveShell), rest(&wide, Method::PolynomialShell));
}

#[test]
fn the_range_ends_where_the_polynomial_gets_worse_than_the_samples() {
    let tried = |worse_from: f64| -> Vec<[f64; 3]> {
        let size = |k: i32| f64::from(k) / 10.0;
        (1..=10).map(|k| [size(k), if size(k) > worse_from { 0.5 } else { 0.01 }, 0.01]).collect()
    };
    let all = Gate::of(tried(1.0), UNSEEN);
    assert!(all.holds() && !all.holds_in_part() && all.range == 1.0 && all.reach == 1.0 && all.tried == 10);
    let some = Gate::of(tried(0.55), UNSEEN);
    assert!(!some.holds() && some.holds_in_part() && some.range == 0.5, "{some:?}");
    let none = Gate::of(tried(0.0), UNSEEN);
    assert!(!none.holds() && !none.holds_in_part() && none.range == 0.0);
    assert_eq!(Gate::of(vec![], 0.0), Gate::default());
}

/// Both miss two shapes of ten by more than a tenth: by how much says nothing. One that the polynomial alone misses says much.
#[test]
fn equilibria_that_both_forms_lose_are_no_reason_for_either() {
    let tried = |polynomial: f64, sampled: f64| -> Vec<[f64; 3]> {
        (1..=10)
            .map(|k| [f64::from(k), if k > 8 { polynomial } else { 0.002 }, if k > 8 { sampled } else { 0.002 }])
            .collect()
    };
    assert!(Gate::of(tried(0.6, 0.4), UNSEEN).holds() && Gate::of(tried(0.12, 0.9), UNSEEN).holds());
    assert!(!Gate::of(tried(0.6, 0.05), UNSEEN).holds());
}

#[test]
fn what_moves_the_shell_a_thousandth_as_far_as_the_furthest_tells_nothing() {
    let tried = |least: f64| -> Vec<[f64; 3]> {
        (1..=10).map(|k| if k > 7 { [least, 40.0, 5.0] } else { [f64::from(k), 0.002, 0.002] }).collect()
    };
    let seen = Gate::of(tried(0.0071), UNSEEN);
    assert!(!seen.holds() && seen.tried == 10 && seen.polynomial.most == 40.0, "{seen:?}");
    let unseen = Gate::of(tried(0.0069), UNSEEN);
    assert!(unseen.holds() && unseen.tried == 7 && unseen.polynomial.most == 0.002, "{unseen:?}");
}

/// What is unseen counts where bending carries the loads alone.
#[test]
fn an_error_that_nobody_sees_counts_where_the_membrane_carries_the_loads() {
    let tried: Vec<[f64; 3]> = (1..=10).map(|k| [f64::from(k), 0.008, 0.002]).collect();
    assert!(Gate::of(tried.clone(), UNSEEN).holds());
    let strict = Gate::of(tried, 0.0);
    assert!(!strict.holds() && !strict.holds_in_part() && strict.range == 0.0);
}

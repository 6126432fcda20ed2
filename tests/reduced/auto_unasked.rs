//! A reduced shell that nobody asked for: where a model gets one, where it is left out, and that it is the same each time.

use crate::common::*;
use shellwarp::arithmetic::Arithmetic;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

/// A strip that is curved across, held at one end or by nothing.
fn gutter(is_held: bool) -> Arc<Shell> {
    let (mut positions, triangles) = equilateral_sheet(12, 4, 0.1);
    positions.iter_mut().for_each(|x| x[2] = 1.5 * (x[1] - 0.17).powi(2));
    let fixed = (0..positions.len()).filter(|v| is_held && positions[*v][0] < 0.11).map(|v| v as u32).collect();
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap())
}

fn made(shell: &Arc<Shell>, change: impl Fn(&mut Options)) -> Model {
    let vertices = shell.mass.len();
    let reduced = reduced::Options {
        fields: 12,
        poses: reduced::default_poses(vertices),
        iterations: reduced::affordable_iterations(vertices),
        optional: true,
        ..Default::default()
    };
    let mut options = Options { modes: 6, reduced, ..Default::default() };
    change(&mut options);
    Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap()
}

fn furthest(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

#[test]
fn a_held_shell_gets_one_whose_form_its_gate_chooses_the_same_each_time() {
    let shell = gutter(true);
    let model = made(&shell, |_| ());
    let polynomial = model.reduced.as_ref().unwrap().polynomial.as_ref().unwrap();
    let wanted = match &polynomial.gate {
        gate if gate.holds() => Method::PolynomialShell,
        gate if gate.holds_in_part() => Method::AdaptiveShell,
        _ => Method::ReducedShell,
    };
    assert_eq!(model.chosen_method(), wanted);
    assert!(model.without_reduced.is_none());
    assert_eq!(model.reduced_fingerprint, made(&shell, |_| ()).reduced_fingerprint);
    // It is nearer to the full shell than the warp is, under a load that bends it far.
    let model = Arc::new(model);
    let place = |method| {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 20.0, -30.0)).unwrap();
        state.equilibrium().unwrap();
        displacements(&state)
    };
    let [exact, own, warp] = [Method::ImplicitShell, wanted, Method::Warp].map(place);
    let off = |a: &[Vec3]| mass_error(&shell, a, &exact);
    println!("{wanted}: {:.3e}, the warp {:.3e}, largest {:.3}", off(&own), off(&warp), furthest(&exact));
    assert!(off(&own) < off(&warp));
}

#[test]
fn it_is_left_out_with_the_reason_and_the_choice_is_the_warp() {
    let held = gutter(true);
    let few = |options: &mut Options| options.reduced.poses = 3;
    let large = |options: &mut Options| options.reduced.iterations = reduced::affordable_iterations(30_000);
    let follows = |options: &mut Options| options.support_fields = 4;
    type Change<'a> = &'a dyn Fn(&mut Options);
    let cases: [(Change, &str); 3] = [(&few, "too few"), (&large, "takes too long"), (&follows, "supports that move")];
    for (change, why) in cases {
        let model = made(&held, change);
        assert!(model.reduced.is_none(), "{why}");
        assert!(model.without_reduced.as_ref().unwrap().message.contains(why), "{:?}", model.without_reduced);
        assert_eq!(model.chosen_method(), Method::Warp);
        let error = model.require(Method::PolynomialShell).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Unsupported);
        assert!(error.message.contains(why), "{error}");
    }
    let linear = made(&held, |options| (options.linear, options.reduced.poses) = (true, 3));
    assert_eq!(linear.chosen_method(), Method::LinearModalAnalysis);
}

/// A leaf that one field does not hold.
fn poor(may_be_full: bool) -> Arc<Model> {
    Arc::new(made(&Arc::new(leaf(1)), |options| {
        (options.modes, options.may_be_full) = (3, may_be_full);
        (options.reduced.fields, options.reduced.poses) = (1, 20);
    }))
}

#[test]
fn where_fields_do_not_hold_a_shell_the_choice_may_be_the_full_one() {
    let (fields, full) = (poor(false), poor(true));
    assert!(full.needs_correction(), "{:?}", full.training_errors());
    assert_eq!(full.chosen_method(), Method::ImplicitShell);
    assert_eq!((fields.chosen_method(), full.chosen_form()), (fields.chosen_form(), fields.chosen_form()));
    // A saved model keeps it, and is the same otherwise; a deterministic one keeps to the fields.
    let saved = full.save().unwrap();
    assert_eq!(saved.len(), fields.save().unwrap().len() + 16);
    let loaded = Model::load(&saved).unwrap();
    assert_eq!((loaded.chosen_method(), loaded.save().unwrap()), (Method::ImplicitShell, saved));
    let portable = full.with_arithmetic(Arithmetic::Portable).unwrap();
    assert_eq!(portable.chosen_method(), full.chosen_form());
    // Of a shell that fields hold, or that nothing holds, it is the gate's form, as before.
    let free = made(&gutter(false), |options| {
        (options.modes, options.reduced.fields, options.may_be_full) = (8, 1, true);
    });
    assert!(free.needs_correction() && free.chosen_method() == free.chosen_form(), "{:?}", free.training_errors());
    let good = made(&gutter(true), |options| (options.reduced.fields, options.may_be_full) = (30, true));
    assert!(!good.needs_correction() && good.chosen_method() == good.chosen_form(), "{:?}", good.training_errors());
}

#[test]
fn so_it_may_where_training_finds_next_to_nothing_but_not_where_it_cannot_be_trained() {
    let held = gutter(true);
    let few = made(&held, |options| (options.reduced.poses, options.may_be_full) = (3, true));
    assert!(few.reduced.is_none() && few.chosen_method() == Method::ImplicitShell);
    let loaded = Model::load(&few.save().unwrap()).unwrap();
    assert_eq!(loaded.chosen_method(), Method::ImplicitShell);
    let follows = made(&held, |options| (options.support_fields, options.may_be_full) = (4, true));
    assert_eq!(follows.chosen_method(), Method::Warp);
    // 51 × 51 vertices are more than a step by the full shell takes quickly.
    let (positions, triangles) = equilateral_sheet(50, 50, 0.1);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.11).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let large = Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap());
    assert!(large.mass.len() > 2500);
    let large = made(&large, |options| (options.modes, options.reduced.poses, options.may_be_full) = (2, 3, true));
    assert!(large.without_reduced.is_some() && large.chosen_method() == Method::Warp);
}

#[test]
fn a_state_of_that_choice_moves_as_fields_do_whatever_it_is_asked_by() {
    let model = poor(true);
    let moved = |mut state: State, ratios: Vec<f64>| -> Result<Vec<Vec3>, shellwarp::Error> {
        state.set_gravity(Vec3::new(0.4, 0.5, -0.77) * 0.1)?;
        state.set_damping(&Damping { ratios, ..Default::default() })?;
        (0..10).try_for_each(|_| state.step(1.0 / 30.0))?;
        Ok(displacements(&state))
    };
    let full = |integrator| State::new(model.clone(), Method::ImplicitShell, integrator).unwrap();
    let chosen = |integrator| State::of_choice(model.clone(), integrator).unwrap();
    let by_two_stages = moved(full(Integrator::SecondOrder), vec![]).unwrap();
    assert_ne!(by_two_stages, moved(full(Integrator::ImplicitEuler), vec![]).unwrap());
    for integrator in [Integrator::ImplicitEuler, Integrator::Exact, Integrator::SecondOrder] {
        assert_eq!(moved(chosen(integrator), vec![]).unwrap(), by_two_stages);
        let mut changed = State::new(model.clone(), Method::Warp, integrator).unwrap();
        changed.set_chosen_method().unwrap();
        assert_eq!(moved(changed, vec![]).unwrap(), by_two_stages);
    }
    // A ratio that all modes share damps the slowest swing by it; others are refused, with what there was before.
    let mut state = full(Integrator::SecondOrder);
    let slowest = model.modal.eigenvalues[0].sqrt();
    state.set_gravity(Vec3::new(0.4, 0.5, -0.77) * 0.1).unwrap();
    state.set_damping(&Damping { mass_coefficient: 2.0 * 0.3 * slowest, ..Default::default() }).unwrap();
    (0..10).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert_eq!(moved(chosen(Integrator::Exact), vec![0.3]).unwrap(), displacements(&state));
    assert_eq!(moved(chosen(Integrator::Exact), vec![0.3; 3]).unwrap(), displacements(&state));
    let differ = moved(chosen(Integrator::Exact), vec![0.3, 0.3, 0.2]).unwrap_err();
    assert!(differ.kind == ErrorKind::Unsupported && differ.message.contains("ratios that differ"), "{differ}");
    let count = moved(chosen(Integrator::Exact), vec![0.3; 2]).unwrap_err();
    assert_eq!(count.kind, ErrorKind::InvalidArgument);
}

#[test]
fn a_shell_that_nothing_holds_moves_by_what_it_offers() {
    let model = made(&gutter(false), |_| ());
    model.require(model.chosen_method()).unwrap();
}

#[test]
fn a_training_of_so_many_iterations_takes_no_longer_on_any_machine() {
    let shell = gutter(true);
    shellwarp::threads::set_threads(1); // of several, only the host's own tells of its iterations
    let mut heard = vec![];
    for iterations in [30, 60] {
        let mut calls = 0;
        let reduced = reduced::Options { fields: 8, poses: 52, iterations, ..Default::default() };
        let options = Options { modes: 4, reduced, ..Default::default() };
        Model::precompute(shell.clone(), &options, &mut |_, share| {
            calls += usize::from((0.1..0.5).contains(&share));
            Ok(())
        })
        .unwrap();
        heard.push(calls);
    }
    assert!(heard[1] > heard[0], "{heard:?}"); // progress is told of each
}

//! Motion of the reduced shell under loads and handles that jump between steps.
#![allow(missing_docs)]
mod common;
use common::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Vec3};
use std::sync::{Arc, OnceLock};

fn model(shell: Shell, fields: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, elements: 400, poses: 8, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn beam() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(reference("flat_beam").0, 12))
}

fn a_leaf() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(leaf(1), 12))
}

/// Seconds of the slowest mode's period.
fn period(model: &Model) -> f64 {
    std::f64::consts::TAU / model.modal.eigenvalues[0].sqrt()
}

/// What a host does at times that are multiples of a fortieth of a period, by their number.
type Script = fn(usize, &mut State);

/// Displacements at each of two periods' eighty fortieths, with so many steps for each.
fn motion(model: &Arc<Model>, script: Script, steps: usize) -> Vec<Vec<Vec3>> {
    let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    let h = period(model) / 40.0 / steps as f64;
    let frame = |state: &mut State, k: usize| {
        script(k, state);
        (0..steps).for_each(|_| state.step(h).unwrap());
        displacements(state)
    };
    (0..80).map(|k| frame(&mut state, k)).collect()
}

/// Largest difference of the fields, over the largest displacement.
fn apart(a: &[Vec<Vec3>], b: &[Vec<Vec3>]) -> f64 {
    let largest = |f: &dyn Fn(usize, usize) -> Vec3| {
        (0..b.len()).flat_map(|k| (0..b[k].len()).map(move |v| (k, v))).map(|(k, v)| f(k, v).norm()).fold(0.0, f64::max)
    };
    largest(&|k, v| a[k][v] - b[k][v]) / largest(&|k, v| b[k][v])
}

/// Bends the beam by an eighth of its size, the leaf by less.
const STRENGTH: f64 = 0.05;

fn gravity(state: &mut State, sign: f64) {
    let strength = if state.model().shell.mass.len() > 400 { 4.0 * STRENGTH } else { STRENGTH };
    state.set_gravity(Vec3::new(0.0, 0.0, sign * strength)).unwrap();
}

fn from_the_start(k: usize, state: &mut State) {
    if k == 0 {
        gravity(state, -1.0);
    }
}

fn in_mid_run(k: usize, state: &mut State) {
    match k {
        0 => gravity(state, -1.0),
        13 => gravity(state, 1.0),
        50 => gravity(state, 0.0),
        _ => (),
    }
}

fn damping_is_switched_on(k: usize, state: &mut State) {
    from_the_start(k, state);
    if k == 27 {
        state.set_damping(&Damping { ratios: vec![0.1], ..Damping::default() }).unwrap();
    }
}

/// Largest differences are of the largest displacement. What it costs in longer steps is in the text of the integrator.
#[test]
fn motion_is_of_second_order_wherever_loads_jump() {
    let scripts: [(&str, Script); 3] =
        [("from the start", from_the_start), ("gravity flips", in_mid_run), ("damping", damping_is_switched_on)];
    for (name, model) in [("beam", beam()), ("leaf", a_leaf())] {
        for (what, script) in scripts {
            let fine = motion(model, script, 24);
            let [frame, quarter] = [1, 4].map(|steps| apart(&motion(model, script, steps), &fine));
            println!(
                "{name}, {what}: {:.2} % at a fortieth of a period, {:.2} % at a quarter of it",
                100.0 * frame,
                100.0 * quarter
            );
            // Of two periods, the method's own 0.04 θ² a radian with θ = 0.16, 1.2 %, and what stiffer modes miss.
            assert!(frame < 0.025, "{name}, {what}: {frame}");
            // A sixteenth to second order, a quarter to first; fast modes, which the longer step takes out, blur it.
            assert!(quarter < 0.005 && quarter < 0.3 * frame, "{name}, {what}: {quarter} after {frame}");
        }
    }
}

/// A spring pulls with its whole force in every part of a step: damped, the shell comes to the rest that the static solution has.
#[test]
fn a_shell_on_soft_handles_swings_to_their_equilibrium_and_stops() {
    let model = beam();
    let tip = model.shell.mesh.positions.len() - 1;
    let held = || {
        let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
        gravity(&mut state, -1.0);
        let place = Target::Position(model.shell.mesh.positions[tip] + 0.1 * model.shell.mesh.size * Vec3::z());
        let turn = Target::Orientation(nalgebra::UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.2, 0.0)));
        // About as soft as the beam: 1/(ω² m) of the slowest mode.
        let soft = 1.0 / (model.modal.eigenvalues[0] * model.shell.total_mass);
        let size = model.shell.mesh.size;
        for (id, target, compliance) in [(1, place, soft), (2, turn, soft / (size * size))] {
            state.set_constraint(Constraint { id, vertex: tip as u32, axes: [true; 3], compliance, target }).unwrap();
        }
        state
    };
    let mut still = held();
    still.equilibrium().unwrap();
    let mut moving = held();
    let omega = model.modal.eigenvalues[0].sqrt();
    moving.set_damping(&Damping { mass_coefficient: 2.0 * omega, ..Damping::default() }).unwrap();
    (0..200).for_each(|_| moving.step(0.1 / omega).unwrap());
    let apart = mass_error(&model.shell, &displacements(&moving), &displacements(&still));
    let kinetic = moving.report().kinetic_energy / moving.report().elastic_energy;
    println!("{:.1} % apart, kinetic over elastic energy {kinetic:.1e}", 100.0 * apart);
    // A step ends at 1e-5 of the root of the loads' work: src/state/reduced.rs. e⁻²⁰ of the swing is left.
    assert!(apart < 1e-4 && kinetic < 1e-8, "{apart} apart, kinetic over elastic energy {kinetic}");
}

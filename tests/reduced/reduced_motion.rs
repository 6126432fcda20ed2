//! Motion of the reduced shell under loads and handles that jump between steps.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, Space, State};
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
        let turn = Target::Orientation(UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.2, 0.0)));
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

/// From where gravity bends the full shell: a vertex, its place and its orientation.
fn bent_tip(model: &Arc<Model>) -> (u32, Vec3, UnitQuaternion<f64>) {
    let mut full = State::new(model.clone(), Method::ImplicitShell, Integrator::ImplicitEuler).unwrap();
    gravity(&mut full, -1.0);
    full.equilibrium().unwrap();
    let x = &model.shell.mesh.positions;
    let far = |v: &usize| x[*v].x - 0.1 * x[*v].y.abs();
    let tip = (0..x.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    let mut turned = UnitQuaternion::identity();
    full.rotations(Space::World, |v, turn| {
        if v == tip {
            turned = turn;
        }
    })
    .unwrap();
    (tip as u32, x[tip] + displacements(&full)[tip], turned)
}

/// Held there by that vertex without gravity, and displacements at each of a period's forty fortieths after it is let go.
fn let_go(model: &Arc<Model>, method: Method, steps: usize) -> (Vec<Vec3>, Vec<Vec<Vec3>>) {
    let (vertex, place, turn) = bent_tip(model);
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    for (id, target) in [(1, Target::Position(place)), (2, Target::Orientation(turn))] {
        state.set_constraint(Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target }).unwrap();
    }
    state.equilibrium().unwrap();
    let held = displacements(&state);
    state.clear_constraints();
    let h = period(model) / 40.0 / steps as f64;
    let frame = |_| {
        (0..steps).for_each(|_| state.step(h).unwrap());
        displacements(&state)
    };
    (held, (0..40).map(frame).collect())
}

/// A rim vertex held in place and orientation as a smooth bend has it.
///
/// One turned by itself, by 0.3 to 0.7 rad, is no such scene. The full shell bends the triangles around it, which no field has: the shape held
/// is 10 to 130 % off before anything moves, with 12 fields or 40. And what is let go rings faster than frames: the full shell repeats itself to
/// 5e-5 when it starts 1e-6 aside, but its own steps of h/4 and h/16 are 7 to 110 % apart.
#[test]
fn a_shell_let_go_by_place_and_orientation_swings_as_the_full_shell_to_second_order() {
    for (name, model) in [("beam", beam()), ("leaf", a_leaf())] {
        let [coarse, fine] = [8, 16].map(|steps| let_go(model, Method::ImplicitShell, steps));
        // Backward Euler is of first order: twice the fine one less the coarse one is of second.
        let extrapolate = |(fine, coarse): (&Vec<Vec3>, &Vec<Vec3>)| -> Vec<Vec3> {
            fine.iter().zip(coarse).map(|(fine, coarse)| 2.0 * fine - coarse).collect()
        };
        let full: Vec<Vec<Vec3>> = fine.1.iter().zip(&coarse.1).map(extrapolate).collect();
        let own: Vec<_> = [1, 2, 4, 16].iter().map(|steps| let_go(model, Method::ReducedShell, *steps)).collect();
        let held = mass_error(&model.shell, &own[0].0, &fine.0);
        println!("{name}: held {held:.4}; full shell's h/8 and h/16 {:.4} apart", apart(&coarse.1, &fine.1));
        let off: Vec<f64> = own.iter().map(|own| apart(&own.1, &full)).collect();
        let converged: Vec<f64> = own.iter().map(|o| apart(&o.1, &own[3].1)).collect();
        println!("  against the full shell {off:.4?}, against its own {converged:.4?}");
        // What the fields lack of the shape held, and the full shell's extrapolation: 0.04 of its steps' difference squared, under 0.5 %.
        assert!(held < 0.015 && off.iter().all(|off| *off < 0.025), "{name}: {held}, {off:?}");
        // A quarter of the step leaves a sixteenth to second order, a quarter to first; 0.3 % rings faster than frames.
        assert!(converged[2] < 0.2 * converged[0] + 0.003, "{name}: {converged:?}");
    }
}

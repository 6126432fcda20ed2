//! Searches that are heard of, and stopped: then nothing has changed, and the next one takes the same way.

use crate::common::{equilateral_sheet, leaf, mesh, reference};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::Wind;
use shellwarp::material::ElasticSheet;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Certificate, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Error, ErrorKind, Material, Mesh, Result, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

type Watch<'a> = &'a mut dyn FnMut(f64) -> Result<()>;

fn model(shell: Shell) -> Arc<Model> {
    let options = Options {
        modes: 8,
        reduced: reduced::Options { fields: 12, poses: 8, ..Default::default() },
        ..Options::default()
    };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::Exact).unwrap()
}

/// How often a search asks.
fn calls(search: impl FnOnce(Watch) -> Result<()>) -> usize {
    let mut calls = 0;
    search(&mut |left| {
        assert!(left >= 0.0 && left.is_finite(), "call {calls}: {left}");
        calls += 1;
        Ok(())
    })
    .unwrap();
    calls
}

/// Stops a search the `last` time that it asks.
fn stopped_at(last: usize, search: impl FnOnce(Watch) -> Result<()>) {
    let mut calls = 0;
    let stopped = search(&mut |_| {
        calls += 1;
        if calls == last { Err(Error::new(ErrorKind::Cancelled, "enough")) } else { Ok(()) }
    });
    assert_eq!(stopped.unwrap_err().kind, ErrorKind::Cancelled, "stopped at call {last}");
    assert_eq!(calls, last, "it goes on after a stop");
}

/// Stops it the first times that it asks, the last one, and some between. Each time the state is as it was, and goes on to the same bits.
fn stop_anywhere(name: &str, begun: &State, search: impl Fn(&mut State, Watch) -> Result<()>) {
    let (before, shown) = (begun.save(), shown(begun));
    let mut whole = begun.try_clone().unwrap();
    let n = calls(|watch| search(&mut whole, watch));
    println!("{name}: asks {n} times");
    assert!(n > 0, "{name} never asks");
    for last in [1, 2, 3, n / 3, n / 2, n - 1, n].into_iter().filter(|last| (1..=n).contains(last)) {
        let mut state = begun.try_clone().unwrap();
        stopped_at(last, |watch| search(&mut state, watch));
        assert!(state.method() == begun.method() && state.save() == before, "{name}, {last} of {n}: it has moved");
        assert_eq!(self::shown(&state), shown, "{name}, {last} of {n}");
        search(&mut state, &mut |_| Ok(())).unwrap();
        assert!(state.save() == whole.save(), "{name}, after a stop at {last} of {n}: other bits");
    }
}

/// What is kept of a correction, or the pose.
fn shown(state: &State) -> Vec<Vec3> {
    state.positions_corrected(Space::World, usize::from(state.is_corrected())).unwrap()
}

fn equilibrium(state: &mut State, watch: Watch) -> Result<()> {
    state.equilibrium_watched(watch).map(|_| ())
}

fn lifted(state: &State, v: u32, way: Vec3) -> Constraint {
    let place = state.model().shell.mesh.positions[v as usize];
    Constraint { id: v, vertex: v, axes: [true; 3], target: Target::Position(place + way), compliance: 0.0 }
}

#[test]
fn a_stopped_equilibrium_has_moved_nothing_by_any_method() {
    let leaf = model(leaf(1));
    let size = leaf.shell.mesh.size;
    for method in [
        Method::LinearModalAnalysis,
        Method::Warp,
        Method::ReducedShell,
        Method::PolynomialShell,
        Method::AdaptiveShell,
        Method::ImplicitShell,
    ] {
        let mut state = state(&leaf, method);
        state.set_gravity(Vec3::new(0.0, 2.0, -3.0)).unwrap();
        stop_anywhere(&format!("{method:?}"), &state, equilibrium);
        state.equilibrium().unwrap();
        state.set_constraint(lifted(&state, 471, Vec3::z() * (0.1 * size))).unwrap();
        stop_anywhere(&format!("{method:?} with a handle"), &state, equilibrium);
        state.clear_constraints();
        let wind = Wind { velocity: Vec3::new(0.0, 0.5, 1.0), density: 1.2, normal_drag: 1.0, ..Wind::default() };
        state.set_wind(wind).unwrap();
        stop_anywhere(&format!("{method:?} in wind"), &state, equilibrium);
    }
}

/// The full shell's search from a pose that fields had goes another way.
#[test]
fn a_stopped_equilibrium_beside_the_pose_of_another_method_has_moved_nothing() {
    let mut state = state(&model(leaf(1)), Method::ReducedShell);
    state.set_gravity(Vec3::new(0.0, 2.0, -3.0)).unwrap();
    state.equilibrium().unwrap();
    state.set_method(Method::ImplicitShell).unwrap();
    stop_anywhere("beside a pose", &state, equilibrium);
}

#[test]
fn a_stopped_equilibrium_of_a_shell_that_floats_has_moved_nothing() {
    let (positions, triangles) = equilateral_sheet(10, 8, 0.1);
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 2e-3, volume_density: 500.0 };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), sheet, &Supports::default()).unwrap();
    let mut state = state(&model(shell), Method::ReducedShell);
    for v in [0, 9, 40] {
        state.set_constraint(lifted(&state, v, Vec3::zeros())).unwrap();
    }
    state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
    stop_anywhere("floating", &state, equilibrium);
}

/// A hat that buckles, whose estimates do not decide: then the way from rest is taken, too.
fn buckled_hat() -> State {
    let mesh = mesh("character_hat.obj");
    let height = |v: usize| mesh.positions[v].y;
    let (low, high) =
        (0..mesh.positions.len()).map(height).fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)));
    let held = (0..mesh.positions.len()).filter(|&v| height(v) > high - 0.25 * (high - low));
    let supports = Supports { fixed: held.map(|v| v as u32).collect(), ..Default::default() };
    let material = Material { k_area: 2e5, k_length: 2e5, k_bend: 1400.0, area_density: 0.05 };
    let model = model(Shell::new(mesh, material, &supports).unwrap());
    let mut state = state(&model, Method::ReducedShell);
    state.set_gravity(Vec3::new(0.0, -2e4, 0.0)).unwrap();
    state.equilibrium().unwrap();
    state
}

#[test]
fn a_stopped_fall_back_has_changed_nothing() {
    let fall_back = |state: &mut State, watch: Watch| state.fall_back_watched(watch).map(|_: Certificate| ());
    stop_anywhere("fall back of a hat", &buckled_hat(), fall_back);
    let mut warp = state(&model(reference("v_beam").0), Method::Warp);
    warp.set_gravity(Vec3::new(0.0, 0.0, -0.5)).unwrap();
    warp.equilibrium().unwrap();
    stop_anywhere("fall back of what is the warp", &warp, fall_back);
}

#[test]
fn a_stopped_correction_keeps_what_was_kept_before() {
    let steps = |state: &mut State, watch: Watch| state.correct_watched(2, watch);
    let needed = |state: &mut State, watch: Watch| state.correct_as_needed(watch);
    let mut hat = buckled_hat();
    stop_anywhere("two steps", &hat, steps);
    stop_anywhere("as many as needed", &hat, needed);
    hat.correct(1).unwrap();
    assert!(hat.is_corrected());
    stop_anywhere("two steps more", &hat, steps);
    stop_anywhere("as many as needed beside what is kept", &hat, needed);
}

//! Positions that Newton steps of the full shell bring nearer to it.

use crate::common::{displacements, gravity, leaf, mass_error, reference};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Shell, Vec3, reduced};
use std::sync::Arc;

fn model(shell: Shell, fields: usize, poses: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, poses, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

/// A reduced shell at rest under forces, and where the full one is.
fn resting(model: &Arc<Model>, forces: &[Vec3]) -> (State, Vec<Vec3>) {
    let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    state.set_forces((0u32..).zip(forces.iter().copied()), false).unwrap();
    state.equilibrium().unwrap();
    let (rest, options) = (vec![Vec3::zeros(); forces.len()], EquilibriumOptions::default());
    let mut solver = Solver::new(model.shell.clone()).unwrap();
    (state, solver.equilibrium(&rest, forces, &options, &mut |_| Ok(())).unwrap().displacement)
}

#[test]
fn a_step_leaves_a_part_of_the_error_and_two_next_to_none_near_the_full_shell() {
    let (v_beam, leaf) = (reference("v_beam").0, leaf(1));
    // No training load has these directions; the reduced shells are a few tenths to some percent off.
    for (name, shell, aim) in [("V-beam", v_beam, 0.03), ("leaf", leaf, 0.1)] {
        let model = model(shell, 24, 20);
        let rest = &model.shell.mesh.positions;
        for direction in [[0.4, 0.5, -0.77], [-0.5, -0.5, 0.7], [0.6, -0.75, -0.2]] {
            let (state, exact) = resting(&model, &gravity(&model.shell, direction, aim));
            let errors = [0, 1, 2, 3].map(|steps| {
                let x = state.positions_corrected(Space::Frame, steps).unwrap();
                let u: Vec<Vec3> = x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
                mass_error(&model.shell, &u, &exact)
            });
            println!("{name}, {direction:?}: {errors:?}, {:?}", state.certify().unwrap());
            // Newton's steps converge quadratically: what two of them leave is the square of what one does, or less.
            assert!(errors[1] < errors[0] && errors[2] < 0.1 * errors[0], "{name}: {errors:?}");
            assert!(errors[3] < 0.01 * errors[0].max(1e-4), "{name}: {errors:?}");
            assert!(state.certify().unwrap().factorizations <= 5, "{name}");
        }
    }
}

#[test]
fn no_step_leaves_the_positions_and_steps_leave_the_motion() {
    let model = model(leaf(1), 12, 8);
    let mut state = State::new(model, Method::ReducedShell, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.3, -1.0)).unwrap();
    (0..5).for_each(|_| state.step(1.0 / 30.0).unwrap());
    let (saved, mut own) = (state.save(), vec![Vec3::zeros(); state.model().shell.mass.len()]);
    state.positions(Space::World, |v, x| own[v] = x);
    assert_eq!(state.positions_corrected(Space::World, 0).unwrap(), own);
    let corrected = state.positions_corrected(Space::World, 2).unwrap();
    assert_ne!(corrected, own);
    assert_eq!(state.positions_corrected(Space::World, 2).unwrap(), corrected); // whoever used the solver before
    assert_eq!(state.save(), saved);
    state.set_method(Method::ImplicitShell).unwrap();
    state.positions(Space::World, |v, x| own[v] = x);
    assert_eq!(state.positions_corrected(Space::World, 2).unwrap(), own);
}

/// Frames of a load that grows and turns, evenly, and the share of the last that it has at the first; then frames of that load, which stays.
const FRAMES: usize = 30;
const FIRST: f64 = 0.2;
const STILL: usize = 15;
/// Where the full shell snaps, and half a dozen frames later.
const SNAP: usize = 19;
const LATER: usize = SNAP + 6;

#[test]
fn one_step_a_frame_catches_up_where_a_shell_snaps() {
    let model = model(reference("v_beam").0, 24, 20);
    let (shell, rest) = (&model.shell, &model.shell.mesh.positions);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    let mut exact = vec![Vec3::zeros(); rest.len()];
    let whole = gravity(shell, [0.4, 0.5, -0.77], 0.2);
    let mut errors = vec![];
    for frame in 0..=FRAMES + STILL {
        let t = frame.min(FRAMES) as f64 / FRAMES as f64;
        let turn = nalgebra::Rotation3::from_axis_angle(&Vec3::z_axis(), 0.5 * t);
        let forces: Vec<Vec3> = whole.iter().map(|f| turn * f * (FIRST + (1.0 - FIRST) * t)).collect();
        exact = solver.equilibrium(&exact, &forces, &Default::default(), &mut |_| Ok(())).unwrap().displacement;
        state.set_forces((0u32..).zip(forces), false).unwrap();
        state.equilibrium().unwrap();
        let off = |state: &State, steps: usize| {
            let x = state.positions_corrected(Space::Frame, steps).unwrap();
            let u: Vec<Vec3> = x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
            mass_error(shell, &u, &exact)
        };
        let mut anew = state.try_clone().unwrap();
        anew.correct(0).unwrap();
        let [own, alone] = [0, 1].map(|steps| off(&anew, steps));
        state.correct(1).unwrap();
        errors.push([own, alone, off(&state, 1)]);
    }
    println!("{errors:?}");
    // The reduced shell goes to another branch at the snap. Eight trainings were tried, of 16 to 26 equilibria and 20 to 28 fields. With a step alone
    // all were 40 % off from there on. By steps that go on they were at most 14 % off after the half dozen frames, and at the nearest 1.2 %. One came
    // to rest 12 % off.
    assert!(
        errors[LATER..].iter().all(|[own, alone, on]| *own > 0.2 && *alone > 0.2 && *on < 0.5 * alone),
        "{errors:?}"
    );
    assert!(errors[LATER..].iter().any(|[_, _, on]| *on < 0.03), "{errors:?}");
    assert!(errors[..FRAMES / 2].iter().all(|[_, alone, on]| on <= alone), "{errors:?}");
}

#[test]
fn what_is_kept_is_shown_until_the_next_step_copied_and_saved() {
    let model = model(leaf(1), 12, 8);
    let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.3, -1.0)).unwrap();
    let shown = |state: &State, steps: usize| state.positions_corrected(Space::World, steps).unwrap();
    for _ in 0..3 {
        state.step(1.0 / 30.0).unwrap();
        state.correct(1).unwrap();
    }
    let (own, kept) = (shown(&state, 0), shown(&state, 1));
    assert_ne!(own, kept);
    assert_eq!(shown(&state, 2), kept); // whatever is asked for
    let mut others =
        vec![state.try_clone().unwrap(), State::new(model, Method::ReducedShell, Integrator::Exact).unwrap()];
    others[1].set_gravity(Vec3::new(0.0, 0.3, -1.0)).unwrap();
    let saved = state.save();
    assert_eq!(saved.len(), state.saved_size());
    others[1].load(&saved).unwrap();
    assert_eq!(others[1].save(), saved);
    others.push(state);
    for other in &mut others {
        assert_eq!(shown(other, 1), kept);
        other.step(1.0 / 30.0).unwrap();
        assert_ne!(shown(other, 1), kept);
        other.correct(1).unwrap();
    }
    let next = shown(&others[0], 1);
    assert!(others.iter().all(|other| shown(other, 1) == next));
    // Bytes that are cut or say otherwise are refused, and leave what is there.
    for wrong in [&saved[..saved.len() - 8], &saved[..100]] {
        assert!(others[0].load(wrong).is_err());
        assert_eq!(shown(&others[0], 1), next);
    }
    // Without one, saved states are as before.
    let with = others[0].save();
    others[0].correct(0).unwrap();
    assert_ne!(shown(&others[0], 1), next);
    let without = others[0].save();
    assert!(without.len() < with.len() && without[5] == 0 && with[5] == 1);
    others[1].load(&without).unwrap();
    assert_eq!(others[1].save(), without);
    others[2].reset();
    assert_eq!(others[2].save()[5], 0);
}

#[test]
fn a_hard_handle_stays_and_the_frame_carries_all() {
    let model = model(leaf(1), 12, 8);
    let shell = &model.shell;
    let size = shell.mesh.size;
    let lowest = |a: &u32, b: &u32| shell.mesh.positions[*a as usize].x.total_cmp(&shell.mesh.positions[*b as usize].x);
    let vertex = shell.free.iter().copied().max_by(lowest).unwrap();
    let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    let target = shell.mesh.positions[vertex as usize] + Vec3::new(0.0, 0.0, 0.1 * size);
    let held = Constraint { id: 1, vertex, axes: [true; 3], compliance: 0.0, target: Target::Position(target) };
    state.set_constraint(held).unwrap();
    state.equilibrium().unwrap();
    let [own, corrected] = [0, 2].map(|steps| state.positions_corrected(Space::World, steps).unwrap()[vertex as usize]);
    assert!((corrected - own).norm() <= 1e-12 * size, "{:e}", (corrected - own).norm()); // rounding of sums

    let mut turned = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    let rotation = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.5, 1.1);
    let pose = Pose { origin: Vec3::new(1.0, 2.0, 3.0), rotation };
    let gravity = Vec3::new(0.01, 0.02, -0.05);
    turned.set_frame(pose, FrameMotion::Teleport);
    turned.set_gravity(rotation * gravity).unwrap();
    turned.equilibrium().unwrap();
    let mut still = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    still.set_gravity(gravity).unwrap();
    still.equilibrium().unwrap();
    let (a, b) =
        (turned.positions_corrected(Space::World, 2).unwrap(), still.positions_corrected(Space::World, 2).unwrap());
    let apart = a.iter().zip(&b).map(|(a, b)| (a - pose.origin - rotation * b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-6 * size, "{apart:e}"); // both rest to a tolerance
}

fn offs(state: &State, exact: &[Vec3]) -> [f64; 2] {
    let shell = &state.model().shell;
    [
        state.positions_corrected(Space::Frame, 0).unwrap(),
        state.positions_corrected(Space::Frame, usize::from(state.is_corrected())).unwrap(),
    ]
    .map(|x| {
        let u: Vec<Vec3> = x.iter().zip(&shell.mesh.positions).map(|(x, rest)| x - rest).collect();
        mass_error(shell, &u, exact)
    })
}

#[test]
fn as_many_steps_as_needed_bring_an_equilibrium_to_the_full_shell_where_it_is_far_off() {
    let [poor, good] = [1, 24].map(|fields| model(leaf(1), fields, 20));
    assert!(poor.needs_correction() && !good.needs_correction(), "{:?}", [&poor, &good].map(|m| m.training_errors()));
    // By the pose, not by the training: what the good one misses under the stronger load is 7 %.
    for (model, aim, needed) in [(&poor, 0.1, true), (&good, 0.1, true), (&good, 0.01, false)] {
        let (mut state, exact) = resting(model, &gravity(&model.shell, [0.4, 0.5, -0.77], aim));
        state.correct_as_needed(&mut |_| Ok(())).unwrap();
        let ([own, kept], certificate) = (offs(&state, &exact), state.certify().unwrap());
        println!("{own} without steps, {kept} as needed, {certificate:?}");
        assert!(state.is_corrected() == needed && needed == (own > 0.05), "{own}");
        let [told, _] = certificate.corrected;
        if state.is_corrected() {
            // Both are equilibria to 1e-6 of the force or less; rounding is all that is between them.
            assert!(kept < 1e-4 * own && told < 1e-4 * own);
        } else {
            assert!(kept == own && told == certificate.error);
        }
        // One that moves keeps nothing.
        state.step(1.0 / 30.0).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, 1.0)).unwrap();
        state.step(1.0 / 30.0).unwrap();
        state.correct(1).unwrap();
        state.correct_as_needed(&mut |_| Ok(())).unwrap();
        assert!(!state.is_corrected() && state.save()[5] == 0);
    }
    let mut warp = State::new(poor.clone(), Method::Warp, Integrator::Exact).unwrap();
    warp.correct_as_needed(&mut |_| Ok(())).unwrap();
    assert!(!warp.is_corrected());
}

/// A handle that stretches the leaf: most of the displacement is wrong, and what a certificate leads to is another equilibrium.
#[test]
fn where_most_is_wrong_the_way_from_rest_is_taken() {
    let model = model(leaf(1), 20, 40);
    let (rest, size) = (&model.shell.mesh.positions, model.shell.mesh.size);
    let tip = (0..rest.len()).max_by(|a, b| rest[*a].x.total_cmp(&rest[*b].x)).unwrap();
    let led = |method: Method| {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        let target = Target::Position(rest[tip] + 0.2 * size * Vec3::y());
        state
            .set_constraint(Constraint { id: 1, vertex: tip as u32, axes: [true; 3], compliance: 0.0, target })
            .unwrap();
        state.equilibrium().unwrap();
        state
    };
    let exact = displacements(&led(Method::ImplicitShell));
    let mut state = led(Method::PolynomialShell);
    let certificate = state.certify().unwrap();
    state.correct_as_needed(&mut |_| Ok(())).unwrap();
    let [own, kept] = offs(&state, &exact);
    println!("{own} off, told {}, {kept} as needed", certificate.error);
    assert!(own > 0.5 && certificate.error > 0.5 && kept < 1e-5, "{own} {kept}");
    assert!(state.certify().unwrap().corrected[0] < 1e-5);
}

#[test]
fn a_certificate_tells_the_error_of_what_is_kept() {
    let model = model(leaf(1), 1, 20);
    let (mut state, exact) = resting(&model, &gravity(&model.shell, [0.4, 0.5, -0.77], 0.1));
    for steps in [1, 2] {
        state.correct(steps).unwrap();
        let ([own, kept], certificate) = (offs(&state, &exact), state.certify().unwrap());
        println!("{steps} steps: {kept} of {own}, {certificate:?}");
        // Both estimates find the equilibrium, to its tolerance.
        assert!((certificate.error - own).abs() < 1e-4 * own);
        assert!((certificate.corrected[0] - kept).abs() < 1e-4 * own);
        assert!(certificate.corrected[1] < certificate.max_error);
    }
}

/// Its inertia stands in for the load there: a search that takes it for right would keep the pose that it has, and be told to be right.
#[test]
fn loads_that_a_pose_does_not_balance_are_not_corrected() {
    let model = model(leaf(1), 12, 8);
    let mut state = State::new(model, Method::PolynomialShell, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.3, -1.0)).unwrap();
    state.correct_as_needed(&mut |_| Ok(())).unwrap();
    assert!(!state.is_corrected());
    let told = state.certify().unwrap();
    assert_eq!(told.corrected[0], told.error);
}

//! A rest shape that moves as the host animates it: the frame's results where it is rigid, and what a bent one costs.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::collider::Solid;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::contact::Obstacle;
use shellwarp::load::Wind;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

const CARD: Material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };
const METHODS: [Method; 6] = [
    Method::Warp,
    Method::VirtualWorkWarp,
    Method::LinearModalAnalysis,
    Method::RotationStrain,
    Method::ReducedShell,
    Method::PolynomialShell,
];

fn strip(bend: impl Fn(&Vec3) -> Vec3) -> Arc<Shell> {
    let (positions, triangles) = equilateral_sheet(16, 4, 0.02);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.03).collect();
    let mesh = Mesh::new(positions.iter().map(bend).collect(), &triangles).unwrap();
    Arc::new(Shell::new(mesh, CARD, &Supports { fixed, ..Default::default() }).unwrap())
}

fn model(shell: Arc<Shell>) -> Arc<Model> {
    let reduced = reduced::Options { fields: 6, gravity: 5.0, ..Default::default() };
    let options = Options { modes: 6, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap())
}

pub fn state(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -0.5)).unwrap();
    state
}

pub fn positions(state: &State, space: Space) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(space, |v, p| x[v] = p);
    x
}

pub fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn a_rest_shape_that_is_carried_shows_what_a_carried_frame_does() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    for method in METHODS {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, method));
        let wind = || Wind { velocity: Vec3::new(1.0, 0.5, 2.0), density: 0.2, normal_drag: 1.0, ..Default::default() };
        by_frame.set_wind(wind()).unwrap();
        by_rest.set_wind(wind()).unwrap();
        for k in 0..12 {
            let t = f64::from(k) / 30.0;
            let origin = Vec3::new(0.05 * (6.0 * t).sin(), 0.3 * t * t, 0.02 * t);
            by_frame.set_frame(Pose { origin, rotation: UnitQuaternion::identity() }, FrameMotion::Continuous);
            by_rest.move_rest(|v| rest[v] + origin, false).unwrap();
            by_frame.step(1.0 / 30.0).unwrap();
            by_rest.step(1.0 / 30.0).unwrap();
            let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
            // Sums of mass times acceleration by vertex in place of the modes' factors: rounding, through some steps, and where a reduced
            // shell's search ends.
            let reduced = matches!(method, Method::ReducedShell | Method::PolynomialShell);
            assert!(furthest(&a, &b) < if reduced { 1e-6 } else { 1e-9 }, "{method} at {k}: {:e}", furthest(&a, &b));
        }
        let moved = furthest(&positions(&by_frame, Space::Frame), rest);
        assert!(moved > 1e-3, "{method}: {moved:e}");
    }
}

#[test]
fn a_rest_shape_that_turns_shows_what_a_turning_frame_does() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let off = |h: f64| {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, Method::Warp));
        let mut worst = 0.0f64;
        for k in 1..=(0.4 / h).round() as i32 {
            let t = f64::from(k) * h;
            let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.5, 1.0, 0.3) * (t * t));
            by_frame.set_frame(Pose { origin: Vec3::zeros(), rotation }, FrameMotion::Continuous);
            by_rest.move_rest(|v| rotation * rest[v], false).unwrap();
            by_frame.step(h).unwrap();
            by_rest.step(h).unwrap();
            worst = worst.max(furthest(&positions(&by_frame, Space::World), &positions(&by_rest, Space::World)));
        }
        worst / furthest(&positions(&by_frame, Space::Frame), rest)
    };
    // Accelerations are differences of places here, of turns there: of the first order in the step.
    let [coarse, fine] = [off(1.0 / 60.0), off(1.0 / 240.0)];
    println!("off by {coarse:.3} at 1/60 s, {fine:.3} at 1/240 s");
    assert!(coarse < 0.1 && fine < 0.5 * coarse, "{coarse} {fine}");
}

#[test]
fn at_rest_on_a_turned_shape_the_shell_hangs_as_in_a_turned_frame() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let pose = Pose {
        origin: Vec3::new(1.0, -2.0, 0.5),
        rotation: UnitQuaternion::from_scaled_axis(Vec3::new(0.4, 0.9, -0.3)),
    };
    for method in METHODS {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, method));
        by_frame.set_frame(pose, FrameMotion::Teleport);
        by_rest.move_rest(|v| pose.origin + pose.rotation * rest[v], true).unwrap();
        by_frame.equilibrium().unwrap();
        by_rest.equilibrium().unwrap();
        let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
        assert!(furthest(&a, &b) < 1e-6, "{method}: {:e}", furthest(&a, &b));
        let turn = |state: &State| {
            let mut turns = vec![];
            state.rotations(Space::World, |_, r| turns.push(r)).unwrap();
            turns
        };
        let apart = turn(&by_frame).iter().zip(turn(&by_rest)).map(|(a, b)| a.angle_to(&b)).fold(0.0, f64::max);
        assert!(apart < 1e-4, "{method}: {apart:e}");
    }
}

/// A cylinder's arc of this angle over the strip's length; the same metric.
fn arc(angle: f64) -> impl Fn(&Vec3) -> Vec3 {
    move |x: &Vec3| {
        let radius = 0.32 / angle;
        Vec3::new(radius * (x.x / radius).sin(), x.y, radius * (1.0 - (x.x / radius).cos()))
    }
}

#[test]
fn a_bent_rest_shape_is_off_by_what_its_stiffness_has_changed() {
    let flat = model(strip(|x| *x));
    println!("| turn of the shape, rad | off a model made of it, of the displacement |");
    let mut last = 0.0;
    for (angle, most) in [(0.1, 0.05), (0.3, 0.1), (1.0, 0.5)] {
        let bent = model(strip(arc(angle)));
        let shape = &bent.shell.mesh.positions;
        let [mut exact, mut moved] = [&bent, &flat].map(|model| state(model, Method::Warp));
        moved.move_rest(|v| shape[v], false).unwrap();
        assert!(moved.rest_stretch() < 1e-2, "an arc has the sheet's metric: {}", moved.rest_stretch());
        exact.equilibrium().unwrap();
        moved.equilibrium().unwrap();
        let [exact, moved] = [exact, moved]
            .map(|state| positions(&state, Space::World).iter().zip(shape).map(|(x, y)| x - y).collect::<Vec<Vec3>>());
        for v in (0..shape.len()).filter(|v| flat.shell.held[*v]) {
            assert_eq!(moved[v], Vec3::zeros(), "supports go with the shape");
        }
        let off = error(&moved, &exact);
        println!("| {angle} | {off:.3} |");
        assert!(off < most && off >= last, "{angle}: {off}");
        last = off;
    }
}

fn ball(center: Vec3, radius: f64) -> Obstacle {
    Obstacle::new(
        Arc::new(Solid::sphere(radius).unwrap()),
        Pose { origin: center, rotation: UnitQuaternion::identity() },
    )
}

/// How deep the deepest free vertex is in a ball.
fn depth(state: &State, center: &Vec3, radius: f64) -> f64 {
    let held = &state.model().shell.held;
    let x = positions(state, Space::World);
    let inside = x.iter().enumerate().filter(|(v, _)| !held[*v]).map(|(_, x)| radius - (x - center).norm());
    inside.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_sheet_whose_rest_shape_sinks_onto_a_ball_is_held_up_by_it() {
    let model = model(strip(|x| *x));
    let bent = arc(0.5);
    let shape: Vec<Vec3> = model.shell.mesh.positions.iter().map(bent).collect();
    let size = model.shell.mesh.size;
    let (radius, sunk) = (0.1, 0.03);
    let below = shape.iter().find(|x| x.x > 0.2 && x.y > 0.03).unwrap();
    let center = below - Vec3::z() * (radius + 0.002);
    for method in METHODS {
        let mut alone = state(&model, method);
        let mut held = state(&model, method);
        held.set_obstacles(vec![ball(center, radius)]).unwrap();
        let (mut pushed, mut deepest) = (0.0, 0.0f64);
        for k in 0..24 {
            let down = Vec3::z() * (sunk * f64::from(k.min(12)) / 12.0);
            for state in [&mut alone, &mut held] {
                state.move_rest(|v| shape[v] - down, false).unwrap();
                state.step(1.0 / 60.0).unwrap();
            }
            pushed += held.contact_summary().impulse.z;
            deepest = deepest.max(depth(&held, &center, radius));
        }
        // Six modes or a few fields follow the ball: what they leave is far less than how far the sheet sank.
        println!("{method}: {:.1e} deep, {:.1e} alone", deepest / size, depth(&alone, &center, radius) / size);
        assert!(depth(&alone, &center, radius) > 0.8 * sunk, "{method}: without the ball's force it sinks in");
        assert!(deepest < 0.05 * sunk, "{method}: {deepest:e}");
        assert!(pushed > 0.0, "{method}: {pushed:e}");
        held.equilibrium().unwrap();
        assert!(depth(&held, &center, radius) < 1e-4 * size, "{method}: {:e}", depth(&held, &center, radius));
    }
}

#[test]
fn a_rest_shape_that_is_carried_and_turned_touches_and_is_held_as_a_frame_is() {
    let model = model(strip(|x| *x));
    let (rest, size) = (&model.shell.mesh.positions, model.shell.mesh.size);
    let tip = rest.len() as u32 - 1;
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.4, 0.9, -0.3));
    let pose = Pose { origin: Vec3::new(1.0, -2.0, 0.5), rotation };
    let below = rest.iter().position(|x| x.x > 0.15 && x.y > 0.03).unwrap();
    for method in METHODS {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, method));
        for state in [&mut by_frame, &mut by_rest] {
            let center = pose.place(&(rest[below] - Vec3::z() * 0.095)); // 5 mm within
            state.set_obstacles(vec![ball(center, 0.1)]).unwrap();
        }
        by_frame.set_frame(pose, FrameMotion::Teleport);
        by_rest.move_rest(|v| pose.place(&rest[v]), true).unwrap();
        by_frame.equilibrium().unwrap();
        by_rest.equilibrium().unwrap();
        let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
        // Rounds of contact end within 2e-5 of the size.
        assert!(furthest(&a, &b) < 2e-5 * size, "{method} at rest: {:e}", furthest(&a, &b) / size);
        assert!(by_frame.contacts().count() > 0 && by_rest.contacts().count() > 0, "{method}");
        for state in [&mut by_frame, &mut by_rest] {
            let position = Target::Position(pose.place(&(rest[tip as usize] - Vec3::z() * 0.02)));
            let axes = [true, false, true]; // in world axes, which are not the sheet's
            state.set_constraint(Constraint { id: 1, vertex: tip, axes, compliance: 1.0, target: position }).unwrap();
        }
        for k in 1..=6 {
            let origin = pose.origin + Vec3::new(0.0, 0.0, 0.002 * f64::from(k));
            by_frame.set_frame(Pose { origin, rotation }, FrameMotion::Continuous);
            by_rest.move_rest(|v| origin + rotation * rest[v], false).unwrap();
            by_frame.step(1.0 / 60.0).unwrap();
            by_rest.step(1.0 / 60.0).unwrap();
        }
        let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
        // Six steps, each met to the 2e-5 of a round.
        assert!(furthest(&a, &b) < 2e-4 * size, "{method} moved: {:e}", furthest(&a, &b) / size);
        let force = |state: &State| state.constraints().next().unwrap().1.force;
        let (a, b) = (force(&by_frame), force(&by_rest));
        assert!(a.norm() > 0.0 && (a - b).norm() < 2e-2 * a.norm(), "{method} moved: {a:?} {b:?}");
    }
}

#[test]
fn an_orientation_on_a_turned_rest_shape_is_held_as_in_a_turned_frame() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.4, 0.9, -0.3));
    let pose = Pose { origin: Vec3::new(1.0, -2.0, 0.5), rotation };
    let vertex = rest.len() as u32 - 12;
    let target = Target::Orientation(rotation * UnitQuaternion::from_scaled_axis(Vec3::y() * 0.2));
    for method in METHODS.into_iter().filter(|method| *method != Method::LinearModalAnalysis) {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, method));
        by_frame.set_frame(pose, FrameMotion::Teleport);
        by_rest.move_rest(|v| pose.place(&rest[v]), true).unwrap();
        for state in [&mut by_frame, &mut by_rest] {
            state.set_constraint(Constraint { id: 2, vertex, axes: [true; 3], compliance: 10.0, target }).unwrap();
            for _ in 0..10 {
                state.step(1.0 / 60.0).unwrap();
            }
        }
        let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
        assert!(furthest(&a, &b) < 1e-6, "{method}: {:e}", furthest(&a, &b));
        let outcome = |state: &State| *state.constraints().next().unwrap().1;
        let (a, b) = (outcome(&by_frame), outcome(&by_rest));
        assert!(a.force.norm() > 0.0 && (a.force - b.force).norm() < 1e-4 * a.force.norm(), "{method}: {a:?} {b:?}");
        assert!((a.residual - b.residual).abs() < 1e-5, "{method}: {a:?} {b:?}");
    }
}

#[test]
fn a_handle_on_a_moving_rest_shape_reaches_its_target() {
    let model = model(strip(|x| *x));
    let size = model.shell.mesh.size;
    let (bent, n) = (arc(0.8), model.shell.mesh.positions.len());
    let vertex = n as u32 - 3;
    for method in METHODS {
        let mut state = state(&model, method);
        for k in 0..30 {
            let lift = Vec3::z() * (0.01 * f64::from(k.min(10)));
            let shape = |v: usize| bent(&model.shell.mesh.positions[v]) + lift;
            let at = shape(vertex as usize) + Vec3::new(0.0, 0.0, 0.015 * f64::from(k.min(15)) / 15.0);
            let target = Target::Position(at);
            // Along all axes few modes cannot lead a vertex anywhere: a strip does not get longer.
            let handle = Constraint { id: 7, vertex, axes: [false, false, true], compliance: 0.0, target };
            state.set_constraint(handle).unwrap();
            state.move_rest(shape, false).unwrap();
            state.step(1.0 / 60.0).unwrap();
            let shown = positions(&state, Space::World)[vertex as usize];
            let off = (shown.z - at.z).abs();
            // Of a hard constraint: MET, 1e-6, and a reduced shell's rows are met to rounding.
            assert!(off < 1e-6 * size, "{method} at {k}: {:e}", off / size);
            let (_, outcome) = state.constraints().next().unwrap();
            assert!((outcome.residual - off).abs() < 1e-9 * size, "{method} at {k}: {} {off}", outcome.residual);
        }
        let Some((_, outcome)) = state.constraints().next() else { unreachable!() };
        assert!(outcome.force.z.abs() > 0.0 && outcome.force.xy().norm() == 0.0, "{method}: {:?}", outcome.force);
    }
}

#[test]
fn a_saved_state_on_a_moving_rest_shape_goes_on_with_the_same_bits() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let tip = rest.len() as u32 - 1;
    let set = |state: &mut State| {
        state.set_obstacles(vec![ball(Vec3::new(0.2, 0.04, -0.1), 0.1).with_friction(0.3)]).unwrap();
    };
    let lead = |state: &mut State, k: i32| {
        let t = f64::from(k) / 30.0;
        let at = |v: usize| rest[v] + Vec3::new(0.0, 0.1 * t, -0.1 * t + 0.3 * t * rest[v].x);
        let target = Target::Position(at(tip as usize) + Vec3::z() * 0.01);
        let handle = Constraint { id: 1, vertex: tip, axes: [true; 3], compliance: 1e-2, target };
        state.set_constraint(handle).unwrap();
        state.move_rest(at, false).unwrap();
        state.step(1.0 / 30.0).unwrap();
    };
    for method in METHODS {
        let mut first = state(&model, method);
        set(&mut first);
        (0..7).for_each(|k| lead(&mut first, k));
        let bytes = first.save();
        assert_eq!((bytes[4], bytes.len()), (5, first.saved_size()), "{method}");
        assert!(first.takes_saved_size(bytes.len() as u64), "{method}");
        let mut second = state(&model, method);
        set(&mut second);
        second.load(&bytes).unwrap();
        assert_eq!(second.save(), bytes, "{method}");
        assert_eq!(positions(&first, Space::World), positions(&second, Space::World), "{method}");
        assert!(first.contacts().count() > 0, "{method} touches");
        for k in 7..12 {
            lead(&mut first, k);
            lead(&mut second, k);
            assert_eq!(first.save(), second.save(), "{method} at {k}");
        }
        // What was placed and not stepped since is at rest there, loaded too.
        second.move_rest(|v| rest[v] + Vec3::x(), true).unwrap();
        let placed = second.save();
        let mut third = state(&model, method);
        set(&mut third);
        third.load(&placed).unwrap();
        for state in [&mut second, &mut third] {
            state.clear_constraints();
            state.move_rest(|v| rest[v] + Vec3::x(), false).unwrap();
            state.step(1.0 / 30.0).unwrap();
        }
        assert_eq!(positions(&second, Space::World), positions(&third, Space::World), "{method} placed");
    }
}

#[test]
fn a_saved_rest_shape_out_of_range_is_refused_and_changes_nothing() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let mut moved = state(&model, Method::Warp);
    moved.move_rest(|v| rest[v] + Vec3::y(), false).unwrap();
    moved.step(1.0 / 60.0).unwrap();
    let bytes = moved.save();
    // After the header, 15 numbers and the amplitudes with their rates: vertices, placed, stretch, then 13 numbers a vertex.
    let begin = 24 + 8 * (15 + 2 * model.modal.n_modes());
    let with = |at: usize, x: f64| {
        let mut bytes = bytes.clone();
        bytes[begin + 8 * at..][..8].copy_from_slice(&x.to_le_bytes());
        let body = bytes.len() - 8;
        let sum = xxhash_rust::xxh3::xxh3_64(&bytes[..body]).to_le_bytes();
        bytes[body..].copy_from_slice(&sum);
        bytes
    };
    let mut other = state(&model, Method::Warp);
    let before = other.save();
    for (at, x) in [(0, 3.0), (1, 0.5), (2, -1.0), (3, 1e12), (6, 7.0), (3, f64::NAN)] {
        let error = other.load(&with(at, x)).err().unwrap();
        assert_eq!(error.kind, ErrorKind::InvalidData, "{at}: {}", error.message);
        assert_eq!(other.save(), before, "{at}");
    }
    assert_eq!(other.load(&bytes[..bytes.len() - 8]).err().unwrap().kind, ErrorKind::InvalidData);
    let mut full = state(&model, Method::ImplicitShell);
    assert!(full.load(&bytes).is_err());
    other.load(&bytes).unwrap();
    assert_eq!(positions(&other, Space::World), positions(&moved, Space::World));
}

#[test]
fn what_needs_the_mesh_at_rest_is_refused_by_name() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let unsupported = |result: shellwarp::Result<()>, name: &str| {
        let error = result.err().unwrap();
        assert!(error.kind == ErrorKind::Unsupported && error.message.contains(name), "{}", error.message);
    };
    let mut moved = state(&model, Method::Warp);
    moved.move_rest(|v| rest[v] + Vec3::x(), false).unwrap();
    unsupported(moved.certify().map(|_| ()), "certificate");
    unsupported(moved.set_pose(Space::World, rest, None).map(|_| ()), "pose");
    unsupported(moved.move_supports(|v| rest[v], false), "supports");
    for bad in [f64::NAN, f64::INFINITY, 1e12] {
        let error = moved.move_rest(|v| if v == 7 { Vec3::repeat(bad) } else { rest[v] }, false).err().unwrap();
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains("vertex 7"), "{}", error.message);
    }
    // What is refused has left everything as it was, and the mesh can be the rest shape again.
    moved.step(1.0 / 60.0).unwrap();
    assert!((positions(&moved, Space::World)[0] - rest[0] - Vec3::x()).norm() < 1e-12);
    moved.clear_rest();
    assert_eq!(positions(&moved, Space::World)[0], rest[0]);
}

#[test]
fn clones_and_saved_states_go_on_alike() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let lead = |state: &mut State, k: i32| {
        let t = f64::from(k) / 30.0;
        state.move_rest(|v| rest[v] + Vec3::new(0.0, 0.2 * t, 0.4 * t * rest[v].x), false).unwrap();
        state.step(1.0 / 30.0).unwrap();
    };
    let mut first = state(&model, Method::Warp);
    (0..5).for_each(|k| lead(&mut first, k));
    let mut second = first.try_clone().unwrap();
    (5..9).for_each(|k| lead(&mut first, k));
    (5..9).for_each(|k| lead(&mut second, k));
    assert_eq!(first.save(), second.save());
    assert_eq!(positions(&first, Space::World), positions(&second, Space::World));
    let bytes = first.save();
    lead(&mut second, 20);
    second.load(&bytes).unwrap();
    assert_eq!(second.save(), bytes);
    second.reset();
    assert_eq!(positions(&second, Space::Frame).len(), rest.len());
}

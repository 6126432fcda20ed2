//! A rest shape that moves as the host animates it: the frame's results where it is rigid, and what a bent one costs.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
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

fn state(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -0.5)).unwrap();
    state
}

fn positions(state: &State, space: Space) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(space, |v, p| x[v] = p);
    x
}

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
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

#[test]
fn what_needs_the_mesh_at_rest_is_refused_by_name() {
    let model = model(strip(|x| *x));
    let rest = &model.shell.mesh.positions;
    let unsupported = |result: shellwarp::Result<()>, name: &str| {
        let error = result.err().unwrap();
        assert!(error.kind == ErrorKind::Unsupported && error.message.contains(name), "{}", error.message);
    };
    let mut full = state(&model, Method::ImplicitShell);
    unsupported(full.move_rest(|v| rest[v], false), "full shell");
    let mut moved = state(&model, Method::Warp);
    let target = Target::Position(rest[9]);
    let handle = Constraint { id: 1, vertex: 9, axes: [true; 3], compliance: 0.0, target };
    moved.set_constraint(handle).unwrap();
    unsupported(moved.move_rest(|v| rest[v], false), "handles");
    moved.clear_constraints();
    moved.move_rest(|v| rest[v] + Vec3::x(), false).unwrap();
    unsupported(moved.set_constraint(handle), "constraint");
    unsupported(moved.certify().map(|_| ()), "certificate");
    unsupported(moved.set_method(Method::ImplicitShell), "full shell");
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

//! The full shell on a rest shape that moves: it is the shell of that shape, with the inertia of its motion.

use crate::common::*;
use crate::moving_rest::{furthest, positions, state};
use nalgebra::UnitQuaternion;
use shellwarp::collider::Solid;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::contact::Obstacle;
use shellwarp::load::Wind;
use shellwarp::material::{Crease, ElasticSheet, Elasticity, Fibres};
use shellwarp::methods::Damping;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

const CARD: Material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };
const PAPER: ElasticSheet = ElasticSheet { young: 2e9, poisson: 0.3, thickness: 2e-4, volume_density: 800.0 };
const FULL: [Method; 2] = [Method::ImplicitShell, Method::ExplicitShell];
const STEP: f64 = 1.0 / 60.0;

/// A cylinder's arc of this angle over the strip's length; the same metric.
fn arc(angle: f64) -> impl Fn(&Vec3) -> Vec3 {
    move |x: &Vec3| {
        if angle == 0.0 {
            return *x;
        }
        let radius = 0.32 / angle;
        Vec3::new(radius * (x.x / radius).sin(), x.y, radius * (1.0 - (x.x / radius).cos()))
    }
}

fn made(
    material: impl Into<Elasticity>,
    angle: f64,
    change: impl FnOnce(&mut Make, &mut Supports, &Mesh),
) -> Arc<Shell> {
    let (flat, triangles) = equilateral_sheet(16, 4, 0.02);
    let fixed = (0..flat.len() as u32).filter(|v| flat[*v as usize].x < 0.03).collect();
    let mesh = Mesh::new(flat.iter().map(arc(angle)).collect(), &triangles).unwrap();
    let (mut make, mut supports) = (Make::of(material), Supports { fixed, ..Default::default() });
    change(&mut make, &mut supports, &mesh);
    Arc::new(Shell::made(mesh, make, &supports).unwrap())
}

fn strip(angle: f64) -> Arc<Shell> {
    made(CARD, angle, |_, _, _| ())
}

fn model(shell: Arc<Shell>, modes: usize) -> Arc<Model> {
    let options = Options { modes, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap())
}

/// Steps that the explicit shell can take; the implicit one takes few.
fn step_of(method: Method) -> (f64, i32) {
    if method == Method::ExplicitShell { (5e-6, 400) } else { (STEP, 12) }
}

#[test]
fn a_shape_that_falls_freely_bears_no_weight_and_one_that_rises_bears_more() {
    let model = model(strip(0.0), 4);
    let rest = &model.shell.mesh.positions;
    for method in FULL {
        let (h, steps) = step_of(method);
        let mut falls = state(&model, method);
        let mut rises = state(&model, method);
        let mut heavy = state(&model, method);
        // The first step finds the shape there without having moved.
        for state in [&mut falls, &mut rises, &mut heavy] {
            state.set_gravity(Vec3::zeros()).unwrap();
            state.move_rest(|v| rest[v], false).unwrap();
            state.step(h).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -0.5)).unwrap();
        }
        heavy.clear_rest();
        heavy.set_gravity(Vec3::new(0.0, 0.0, -1.25)).unwrap();
        for k in 1..steps {
            // Places whose second difference over h² is the acceleration from the first step on.
            let way = h * h * f64::from(k * (k + 1) / 2);
            falls.move_rest(|v| rest[v] - Vec3::z() * (0.5 * way), false).unwrap();
            rises.move_rest(|v| rest[v] + Vec3::z() * (0.75 * way), false).unwrap();
            falls.step(h).unwrap();
            rises.step(h).unwrap();
            heavy.step(h).unwrap();
            let fallen: Vec<Vec3> = rest.iter().map(|x| x - Vec3::z() * (0.5 * way)).collect();
            // Differences of places of size 1 by h², times h² again: rounding, some steps of it.
            assert!(furthest(&positions(&falls, Space::World), &fallen) < 1e-10, "{method} at {k}");
            let risen: Vec<Vec3> =
                positions(&rises, Space::World).iter().map(|x| x - Vec3::z() * (0.75 * way)).collect();
            let off = furthest(&risen, &positions(&heavy, Space::World));
            assert!(off < 1e-8, "{method} at {k}: {off:e}"); // where Newton's searches end, 1e-9 of the force
        }
        let moved = furthest(&positions(&heavy, Space::World), rest);
        assert!(moved > 1e-6, "{method}: {moved:e}");
    }
}

#[test]
fn a_shape_that_is_carried_and_turned_is_what_a_frame_is() {
    let model = model(strip(0.0), 4);
    let (rest, size) = (&model.shell.mesh.positions, model.shell.mesh.size);
    let tip = rest.len() as u32 - 3;
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.4, 0.9, -0.3));
    let start = Pose { origin: Vec3::new(1.0, -2.0, 0.5), rotation };
    let turned = Target::Orientation(rotation * UnitQuaternion::from_scaled_axis(Vec3::y() * 0.2));
    let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, Method::ImplicitShell));
    let below = rest.iter().position(|x| x.x > 0.15 && x.y > 0.03).unwrap();
    let ball = Pose { origin: start.place(&(rest[below] - Vec3::z() * 0.095)), rotation }; // 5 mm within
    for state in [&mut by_frame, &mut by_rest] {
        state.set_obstacles(vec![Obstacle::new(Arc::new(Solid::sphere(0.1).unwrap()), ball)]).unwrap();
        let velocity = Vec3::new(1.0, 0.5, 2.0);
        let wind = Wind { velocity, density: 0.2, normal_drag: 1.0, tangential_drag: 0.1, ..Default::default() };
        state.set_wind(wind).unwrap();
        let compliance = 10.0;
        let handle = Constraint { id: 2, vertex: tip - 9, axes: [true; 3], compliance, target: turned };
        state.set_constraint(handle).unwrap();
    }
    by_frame.set_frame(start, FrameMotion::Teleport);
    by_rest.move_rest(|v| start.place(&rest[v]), true).unwrap();
    by_frame.equilibrium().unwrap();
    by_rest.equilibrium().unwrap();
    for k in 1..=6 {
        let origin = start.origin + Vec3::new(0.0, 1e-3, 2e-3) * f64::from(k);
        let at = start.place(&(rest[tip as usize] - Vec3::z() * 0.02));
        let handle =
            Constraint { id: 1, vertex: tip, axes: [true, false, true], compliance: 0.0, target: Target::Position(at) };
        for state in [&mut by_frame, &mut by_rest] {
            state.set_constraint(handle).unwrap();
        }
        by_frame.set_frame(Pose { origin, rotation }, FrameMotion::Continuous);
        by_rest.move_rest(|v| origin + rotation * rest[v], false).unwrap();
        by_frame.step(STEP).unwrap();
        by_rest.step(STEP).unwrap();
        let [a, b] = [&by_frame, &by_rest].map(|state| positions(state, Space::World));
        // Rounds of contact end within 2e-5 of the size, and there are six steps of them.
        assert!(furthest(&a, &b) < 1e-4 * size, "at {k}: {:e}", furthest(&a, &b) / size);
        assert!(((b[tip as usize] - at).x.abs() + (b[tip as usize] - at).z.abs()) < 1e-9 * size);
    }
    let [a, b] = [&by_frame, &by_rest].map(|s| s.constraints().map(|(_, outcome)| *outcome).collect::<Vec<_>>());
    for (a, b) in a.iter().zip(&b) {
        assert!(a.force.norm() > 0.0 && (a.force - b.force).norm() < 2e-2 * a.force.norm(), "{a:?} {b:?}");
        assert!((a.residual - b.residual).abs() < 1e-4, "{a:?} {b:?}");
    }
    let turns = |state: &State| {
        let mut turns = vec![];
        state.rotations(Space::World, |_, r| turns.push(r)).unwrap();
        turns
    };
    let apart = turns(&by_frame).iter().zip(turns(&by_rest)).map(|(a, b)| a.angle_to(&b)).fold(0.0, f64::max);
    assert!(apart < 1e-2, "{apart:e}");
    let [a, b] = [by_frame.report(), by_rest.report()];
    assert!(a.elastic_energy > 0.0 && (a.elastic_energy - b.elastic_energy).abs() < 1e-2 * a.elastic_energy);
    assert!((a.max_rotation - b.max_rotation).abs() < 1e-2 && (a.max_displacement - b.max_displacement).abs() < 1e-4);
}

#[test]
fn a_shape_that_turns_is_what_a_frame_that_turns_is_and_damps_nothing_by_it() {
    let model = model(strip(0.0), 4);
    let rest = &model.shell.mesh.positions;
    let damping = Damping { stiffness_coefficient: 0.02, mass_coefficient: 1.0, ..Default::default() };
    let off = |h: f64| {
        let [mut by_frame, mut by_rest] = [(), ()].map(|()| state(&model, Method::ImplicitShell));
        by_frame.set_damping(&damping).unwrap();
        by_rest.set_damping(&damping).unwrap();
        let mut worst = 0.0f64;
        for k in 1..=(0.4 / h).round() as i32 {
            let t = f64::from(k) * h;
            let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.5, 1.0, 0.3) * (3.0 * t * t));
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
    println!("off by {coarse:.4} at 1/60 s, {fine:.4} at 1/240 s");
    assert!(coarse < 0.1 && fine < 0.5 * coarse, "{coarse} {fine}");
}

/// Where both rest under the same forces: a shell made of the arc, and a flat one whose rest shape is the arc.
fn made_and_moved(shells: [Arc<Shell>; 2]) -> f64 {
    let [bent, flat] = shells.map(|shell| model(shell, 4));
    let shape = &bent.shell.mesh.positions;
    let push = |v: &u32| (*v, Vec3::new(0.0, 2e-5, -1e-4) * (1.0 + shape[*v as usize].y * 20.0));
    let [mut exact, mut moved] = [&bent, &flat].map(|model| {
        let mut state = state(model, Method::ImplicitShell);
        state.set_gravity(Vec3::zeros()).unwrap(); // an arc of chords has a little less mass
        state.set_forces(model.shell.free.iter().map(push), false).unwrap();
        state
    });
    moved.move_rest(|v| shape[v], true).unwrap();
    exact.equilibrium().unwrap();
    moved.equilibrium().unwrap();
    let [a, b] = [&exact, &moved].map(|state| positions(state, Space::World));
    assert!(furthest(&a, shape) > 1e-3, "{:e}", furthest(&a, shape));
    furthest(&a, &b) / furthest(&a, shape)
}

#[test]
fn a_flat_shell_on_a_bent_rest_shape_is_the_shell_made_of_it() {
    for angle in [0.3, 1.0] {
        // Equilibria are found to 1e-9 of the load.
        let off = made_and_moved([angle, 0.0].map(strip));
        println!("{angle} rad: {off:.1e} of the displacement");
        assert!(off < 1e-6, "{angle}: {off:e}");
        let paper = |angle: f64| made(PAPER, angle, |_, _, _| ());
        let off = made_and_moved([angle, 0.0].map(paper));
        assert!(off < 1e-6, "Koiter {angle}: {off:e}");
    }
}

#[test]
fn fibres_and_held_directions_go_with_the_rest_shape() {
    // Along the strip, and so along the arc.
    let grained = |angle: f64| {
        made(PAPER, angle, |make, _, mesh| {
            // The flat strip's x, carried by the sides of each triangle.
            let flat = equilateral_sheet(16, 4, 0.02).0;
            let along = |t: &[u32; 3]| {
                let sides = |x: &[Vec3]| [1, 2].map(|k| x[t[k] as usize] - x[t[0] as usize]);
                let ([p, q], [u, v]) = (sides(&flat), sides(&mesh.positions));
                (u * q.y - v * p.y) / (p.x * q.y - q.x * p.y)
            };
            let directions = mesh.triangles.iter().map(along).collect();
            make.fibres = Some(Fibres { across: 0.2, shear: 0.0, directions });
        })
    };
    let off = made_and_moved([1.0, 0.0].map(grained));
    assert!(off < 1e-6, "{off:e}");
    // A rail that turns with the shape holds in its own direction.
    let shell = made(CARD, 0.0, |_, supports, _| supports.along = vec![(84, Vec3::z())]);
    let model = model(shell, 4);
    let rest = &model.shell.mesh.positions;
    let turn = UnitQuaternion::from_scaled_axis(Vec3::y() * 0.7);
    let mut state = state(&model, Method::ImplicitShell);
    for k in 0..8 {
        state.move_rest(|v| turn * rest[v] + Vec3::x() * (0.01 * f64::from(k)), false).unwrap();
        state.step(STEP).unwrap();
        let (x, y) = (positions(&state, Space::World)[84], turn * rest[84] + Vec3::x() * (0.01 * f64::from(k)));
        assert!((turn * Vec3::z()).dot(&(x - y)).abs() < 1e-12, "at {k}");
    }
    state.equilibrium().unwrap();
    assert!(furthest(&positions(&state, Space::World), &rest.iter().map(|x| turn * x).collect::<Vec<_>>()) > 1e-3);
}

#[test]
fn small_motions_on_a_slightly_bent_shape_are_those_of_the_modes() {
    let model = model(strip(0.0), 40);
    let rest = &model.shell.mesh.positions;
    let off = |bend: f64| {
        let [mut full, mut linear] =
            [Method::ImplicitShell, Method::LinearModalAnalysis].map(|method| state(&model, method));
        let (mut worst, mut moved) = (0.0f64, 0.0f64);
        for k in 0..40 {
            let t = f64::from(k) * STEP;
            let shape = arc(bend * (1.0 + (9.0 * t).sin()));
            let lift = Vec3::z() * (1e-3 * bend * (14.0 * t).sin());
            for state in [&mut full, &mut linear] {
                state.set_gravity(Vec3::new(0.0, 0.0, -0.02 * bend)).unwrap();
                state.move_rest(|v| shape(&rest[v]) + lift, false).unwrap();
                state.step(STEP).unwrap();
            }
            let [a, b] = [&full, &linear].map(|state| positions(state, Space::World));
            let y: Vec<Vec3> = rest.iter().map(|x| shape(x) + lift).collect();
            (worst, moved) = (worst.max(furthest(&a, &b)), moved.max(furthest(&a, &y)));
        }
        worst / moved
    };
    // What modes do not know of the shape falls with its bend; 40 modes leave less than that.
    let [bent, less] = [off(0.1), off(0.01)];
    println!("modes are off by {bent:.4} of what moves on an arc of 0.1 to 0.2 rad, {less:.4} on a tenth of it");
    assert!(bent < 0.1 && less < 0.2 * bent, "{bent} {less}");
}

#[test]
fn states_are_cloned_saved_switched_and_reset_on_a_shape_that_moves() {
    let model = model(strip(0.0), 8);
    let rest = &model.shell.mesh.positions;
    let lead = |state: &mut State, k: i32, h: f64| {
        let t = f64::from(k) * h;
        let bend = arc(0.5 * t);
        state.move_rest(|v| bend(&rest[v]) + Vec3::new(0.0, 0.1 * t, -0.1 * t), false).unwrap();
        state.step(h).unwrap();
    };
    for method in FULL {
        let h = step_of(method).0;
        let mut first = state(&model, method);
        (0..7).for_each(|k| lead(&mut first, k, h));
        let bytes = first.save();
        let mut second = state(&model, method);
        second.load(&bytes).unwrap();
        let mut third = first.try_clone().unwrap();
        assert!(second.save() == bytes, "{method}");
        let energy = |state: &State| state.report().elastic_energy;
        assert!(energy(&first) > 0.0 && energy(&first) == energy(&second) && energy(&first) == energy(&third));
        for k in 7..12 {
            [&mut first, &mut second, &mut third].into_iter().for_each(|state| lead(state, k, h));
            assert!(second.save() == first.save() && third.save() == first.save(), "{method} at {k}");
        }
        // A method that goes on from another's pose.
        let before = positions(&first, Space::World);
        third.set_method(Method::Warp).unwrap();
        third.set_method(method).unwrap();
        lead(&mut third, 12, h);
        second.set_method(Method::Warp).unwrap();
        lead(&mut second, 12, h);
        assert!(furthest(&positions(&second, Space::World), &before) > 0.0);
        first.reset();
        assert!(energy(&first) < 1e-20, "{method}: {:e}", energy(&first));
        first.clear_rest();
        assert_eq!(positions(&first, Space::World), *rest, "{method}");
        assert!(energy(&first) < 1e-20, "{method}: {:e}", energy(&first));
        first.step(h).unwrap();
        assert!(furthest(&positions(&first, Space::World), rest) < 1e-2, "{method}");
    }
}

#[test]
fn what_the_full_shell_cannot_follow_is_refused_and_changes_nothing() {
    let flat = model(strip(0.0), 4);
    let rest = &flat.shell.mesh.positions;
    let mut state_of = state(&flat, Method::ImplicitShell);
    (0..3).for_each(|k| {
        state_of.move_rest(|v| rest[v] + Vec3::x() * f64::from(k), false).unwrap();
        state_of.step(STEP).unwrap();
    });
    let triangle = flat.shell.mesh.triangles[50];
    let collapsed = |v: usize| if triangle.contains(&(v as u32)) { rest[triangle[0] as usize] } else { rest[v] };
    state_of.move_rest(collapsed, false).unwrap();
    let before = state_of.save();
    let error = state_of.step(STEP).err().unwrap();
    assert!(error.kind == ErrorKind::Numerical && error.message.contains("has no area"), "{}", error.message);
    assert!(state_of.save() == before, "a step that is refused changes nothing");
    assert!(state_of.report().elastic_energy.is_finite());
    state_of.move_rest(|v| rest[v] + Vec3::x() * 3.0, false).unwrap();
    state_of.step(STEP).unwrap();

    let creased = |crease: &dyn Fn(&Mesh) -> Crease| made(CARD, 0.0, |make, _, mesh| make.creases = vec![crease(mesh)]);
    let inner = |mesh: &Mesh| {
        mesh.edges.iter().find(|e| e.is_interior() && mesh.positions[e.vertices[0] as usize].x > 0.1).unwrap().vertices
    };
    let yields = creased(&|mesh| Crease { vertices: inner(mesh), factor: 1.0, angle: None, yield_angle: 0.5 });
    let mut folds = state(&model(yields, 4), Method::ImplicitShell);
    let error = folds.move_rest(|v| rest[v], false).err().unwrap();
    assert!(error.kind == ErrorKind::Unsupported && error.message.contains("creases yield"), "{}", error.message);
    let half = made(CARD, 0.0, |_, supports, mesh| {
        let on_plane = |v: &u32| mesh.positions[*v as usize].y == 0.0;
        supports.symmetric = (0..mesh.positions.len() as u32).filter(on_plane).map(|v| (v, Vec3::y())).collect();
    });
    let mut by_modes = state(&model(half, 4), Method::Warp);
    by_modes.move_rest(|v| rest[v], false).unwrap();
    let error = by_modes.set_method(Method::ImplicitShell).err().unwrap();
    assert!(error.kind == ErrorKind::Unsupported && error.message.contains("planes of symmetry"), "{}", error.message);
    assert!(by_modes.method() == Method::Warp);
}

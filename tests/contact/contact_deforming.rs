//! Shells that touch meshes which deform, and the push-out.

use crate::common::{equilateral_sheet, leaf};
use shellwarp::collider::Solid;
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::{Arc, OnceLock};

const H: f64 = 1.0 / 60.0;

fn leaf_model() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        Arc::new(Model::precompute(Arc::new(leaf(1)), &Options::default(), &mut |_, _| Ok(())).unwrap())
    })
}

/// A free sheet of about 1 by 1 by 0.2 kg.
fn sheet_model() -> Arc<Model> {
    let (positions, triangles) = equilateral_sheet(10, 11, 0.1);
    let material = Material { area_density: 0.2, ..Material::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports::default()).unwrap();
    let options = Options { precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn moving_mesh(positions: &[Vec3], triangles: &[[u32; 3]]) -> Arc<Solid> {
    Arc::new(Solid::moving_mesh(positions, positions, triangles).unwrap())
}

fn falling(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
    state
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

fn worst(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn a_mesh_moved_vertex_by_vertex_is_the_mesh_moved_as_a_whole() {
    let (ball, triangles) = crate::collider_meshes::sphere(3);
    let placed: Vec<Vec3> = ball.iter().map(|x| 0.3 * x).collect();
    for (method, friction) in [(Method::Warp, 0.0), (Method::Warp, 0.5), (Method::ImplicitShell, 0.5)] {
        let mut states = [0, 1].map(|_| falling(leaf_model(), method));
        let start = Vec3::new(0.9, 0.0, -0.6);
        for state in &mut states {
            let solid = Obstacle::new(moving_mesh(&placed, &triangles), Pose { origin: start, ..Pose::identity() });
            state.set_obstacles(vec![solid.with_friction(friction)]).unwrap();
        }
        let (mut off, mut touched) = (0.0f64, 0);
        for k in 1..=40 {
            let way = Vec3::new(0.1, 0.3, 1.0) * (0.5 * f64::from(k) * H);
            states[0].move_obstacle(0, Pose { origin: start + way, ..Pose::identity() }, false).unwrap();
            let shifted: Vec<Vec3> = placed.iter().map(|x| x + way).collect();
            states[1].deform_obstacle(0, &shifted, false).unwrap();
            states.iter_mut().for_each(|state| state.step(H).unwrap());
            off = off.max(worst(&positions(&states[0]), &positions(&states[1])));
            touched = touched.max(states[1].contact_summary().count);
        }
        println!("{method:?}, friction {friction}: {touched} contacts, off by {off:.1e}");
        assert!(touched > 0);
        // Nearest points of the shape before are found from the shape after: of second order in the way of a step, 0.009.
        assert!(off < 2e-3, "{method:?} {friction}: {off}");
    }
}

#[test]
fn a_ball_that_swells_lifts_the_leaf_and_none_of_it_is_inside() {
    let (ball, triangles) = crate::collider_meshes::sphere(3);
    let swollen = |radius: f64| ball.iter().map(|x| radius * x).collect::<Vec<_>>();
    let mut state = falling(leaf_model(), Method::Warp);
    let pose = Pose { origin: Vec3::new(0.9, 0.0, -0.4), ..Pose::identity() };
    state.set_obstacles(vec![Obstacle::new(moving_mesh(&swollen(0.2), &triangles), pose)]).unwrap();
    (0..60).for_each(|_| state.step(H).unwrap());
    let low = positions(&state)[400].z;
    let (mut deepest, mut impulse) = (0.0f64, 0.0f64);
    for k in 1..=60 {
        state.deform_obstacle(0, &swollen(0.2 + 0.25 * f64::from(k) / 60.0), false).unwrap();
        state.step(H).unwrap();
        deepest = deepest.max(state.contact_summary().deepest);
        impulse = impulse.max(state.contact_summary().impulse.z);
    }
    let size = state.model().shell.mesh.size;
    println!("swelling: deepest {:.1e} of the size, lifted by {:.2}", deepest / size, positions(&state)[400].z - low);
    assert!(deepest < 1e-3 * size && impulse > 0.0, "{deepest}");
    assert!(positions(&state)[400].z > low + 0.05);
}

/// A sheet lies on a block whose upper side is led sideways, vertex by vertex: friction takes it along.
#[test]
fn what_lies_on_a_skin_goes_with_it() {
    let corners: Vec<Vec3> = (0..8)
        .map(|k| {
            Vec3::new(4.0 * f64::from(k & 1) - 2.0, 4.0 * f64::from(k >> 1 & 1) - 2.0, f64::from(k >> 2 & 1) - 1.0)
        })
        .collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let mut state = falling(&sheet_model(), Method::LinearModalAnalysis);
    let ground = Obstacle::new(moving_mesh(&corners, &triangles), Pose::identity());
    state.set_obstacles(vec![ground.with_friction(0.6)]).unwrap();
    let centre = |state: &State| positions(state).iter().sum::<Vec3>() / state.model().shell.mass.len() as f64;
    (0..30).for_each(|_| state.step(H).unwrap());
    let before = centre(&state);
    for k in 1..=60 {
        let way = 0.4 * f64::from(k) / 60.0; // slow enough not to slide
        let led: Vec<Vec3> = corners.iter().map(|x| x + way * Vec3::x()).collect();
        state.deform_obstacle(0, &led, false).unwrap();
        state.step(H).unwrap();
    }
    let way = centre(&state) - before;
    println!("carried by ({:.4}, {:.4}, {:.5}) of 0.4", way.x, way.y, way.z);
    // It slides until it is as fast as the skin: v²/2μg behind, and as far on when that stops. A step's part of either is 0.0067 / 2.
    let slide = 0.4 * 0.4 / (2.0 * 0.6 * 9.81);
    assert!((way.x - (0.4 - slide)).abs() < 4e-3 && way.z.abs() < 1e-3, "{way:?}, {slide}");
    (0..30).for_each(|_| state.step(H).unwrap());
    let end = centre(&state) - before;
    assert!((end.x - 0.4).abs() < 4e-3, "{end:?}");
}

#[test]
fn a_jump_has_no_velocity_and_what_is_wrong_is_named() {
    let (ball, triangles) = crate::collider_meshes::sphere(2);
    let mut state = falling(leaf_model(), Method::Warp);
    let shared = moving_mesh(&ball, &triangles);
    let far = Pose { origin: Vec3::new(0.0, 0.0, -50.0), ..Pose::identity() };
    state
        .set_obstacles(vec![Obstacle::new(shared.clone(), far), Obstacle::new(Arc::new(Solid::plane()), far)])
        .unwrap();
    let twice: Vec<Vec3> = ball.iter().map(|x| 2.0 * x).collect();
    state.deform_obstacle(0, &twice, true).unwrap();
    assert!(!state.obstacles()[0].solid.deforms(), "it is there at once");
    state.deform_obstacle(0, &ball, false).unwrap();
    state.deform_obstacle(0, &twice, false).unwrap();
    assert!(state.obstacles()[0].solid.deforms());
    state.step(H).unwrap();
    assert!(!state.obstacles()[0].solid.deforms());
    assert!((shared.touch(&Vec3::x()).distance).abs() < 0.05, "the shared mesh is as it was");
    let refused =
        |state: &mut State, index: usize, x: &[Vec3]| state.deform_obstacle(index, x, false).unwrap_err().message;
    assert!(refused(&mut state, 2, &ball).contains("collider 2 of 2"));
    assert!(refused(&mut state, 1, &ball).contains("collider 1: only a moving mesh"));
    assert!(refused(&mut state, 0, &ball[1..]).contains("vertices"));
    let mut bad = ball.clone();
    bad[5].y = f64::NAN;
    assert!(refused(&mut state, 0, &bad).contains("vertex 5"));
    state.step(H).unwrap();
}

#[test]
fn the_push_out_leaves_no_vertex_inside_stays_smooth_and_is_not_fed_back() {
    let model = leaf_model();
    let mut state = falling(model, Method::Warp);
    let place = |x: f64, z: f64| Pose { origin: Vec3::new(x, 0.0, z), ..Pose::identity() };
    let ball = || Arc::new(Solid::sphere(0.12).unwrap());
    // Into the arch of the leaf at rest, 0.12 and 0.11 above the ground there.
    state
        .set_obstacles(vec![Obstacle::new(ball(), place(0.5, 0.04)), Obstacle::new(ball(), place(1.1, 0.03))])
        .unwrap();
    let (plain, size) = (positions(&state), model.shell.mesh.size);
    let solids = state.obstacles().to_vec();
    let deep_at = |p: &Vec3| solids.iter().map(|o| -o.touch(&o.at_end(p)).distance).fold(0.0, f64::max);
    let deep = |x: &[Vec3]| model.shell.free.iter().map(|v| deep_at(&x[*v as usize])).fold(0.0, f64::max);
    let (outside, left) = state.positions_outside(Space::World).unwrap();
    println!("deepest {:.1e} of the size, after the push-out {:.1e}", deep(&plain) / size, deep(&outside) / size);
    assert!(deep(&plain) > 3e-3 * size, "there is something to push out");
    assert!(deep(&outside) <= 1e-12 * size && left <= 1e-12 * size, "{left}");
    assert_eq!(positions(&state), plain);
    // Of an edge, how much its ends are pushed apart beside the largest push.
    let push: Vec<Vec3> = outside.iter().zip(&plain).map(|(a, b)| a - b).collect();
    let most = push.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let free = |v: u32| !model.shell.held[v as usize];
    let torn = model.shell.mesh.edges.iter().map(|e| e.vertices).filter(|[a, b]| free(*a) && free(*b));
    let torn = torn.map(|[a, b]| (push[a as usize].norm() - push[b as usize].norm()).abs()).fold(0.0, f64::max);
    // The same push, of the vertices inside alone.
    let alone = |v: u32| if deep_at(&plain[v as usize]) > 0.0 { push[v as usize].norm() } else { 0.0 };
    let pairs = || model.shell.mesh.edges.iter().map(|e| e.vertices).filter(|[a, b]| free(*a) && free(*b));
    let bare = pairs().map(|[a, b]| (alone(a) - alone(b)).abs()).fold(0.0, f64::max);
    println!("pushed by up to {most:.4}, neighbours apart by up to {torn:.4}, without following by {bare:.4}");
    assert!(torn < 0.8 * bare, "neighbours follow: {torn} {bare}");
    // Where a solid goes next is another matter.
    state.move_obstacle(0, place(0.5, -9.0), false).unwrap();
    assert_eq!(state.positions_outside(Space::World).unwrap().0, outside);
    // Without colliders they are the positions.
    state.set_obstacles(vec![]).unwrap();
    assert_eq!(state.positions_outside(Space::World).unwrap(), (plain, 0.0));
}

#[test]
fn between_plates_without_room_the_push_out_tells_what_is_left() {
    let mut state = falling(leaf_model(), Method::Warp);
    let block = || Arc::new(Solid::cuboid(Vec3::new(3.0, 3.0, 0.5)).unwrap());
    let at = |z: f64| Pose { origin: Vec3::new(0.0, 0.0, z), ..Pose::identity() };
    state.set_obstacles(vec![Obstacle::new(block(), at(0.4)), Obstacle::new(block(), at(-0.4))]).unwrap();
    let (x, left) = state.positions_outside(Space::World).unwrap();
    assert!(left > 0.0 && x.iter().all(|x| x.iter().all(|c| c.is_finite())), "{left}");
}

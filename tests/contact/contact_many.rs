//! Thousands of solids on one state: bounded, finite, deterministic, and refused by the index of what is wrong.

use crate::common::leaf;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::Solid;
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use std::sync::{Arc, OnceLock};

const MANY: usize = 5000;
const H: f64 = 1.0 / 60.0;

/// A leaf of 472 vertices and 1.5 long, held at its stem.
fn model() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let reduced = reduced::Options { fields: 12, poses: 8, ..Default::default() };
        let options = Options { modes: 16, reduced, ..Options::default() };
        Arc::new(Model::precompute(Arc::new(leaf(1)), &options, &mut |_, _| Ok(())).unwrap())
    })
}

/// Balls of four sizes drawn in a box about the leaf: each tenth of them in the height of its rest shape, where they overlap it and
/// each other, the others below.
fn balls() -> Vec<Obstacle> {
    let mut rng = StdRng::seed_from_u64(25);
    let solids: Vec<Arc<Solid>> = [0.02, 0.03, 0.05, 0.08].map(|r| Arc::new(Solid::sphere(r).unwrap())).into();
    let ball = |i: usize| {
        let (x, y) = (rng.random_range(-0.2..1.8), rng.random_range(-0.8..0.8));
        let z = if i.is_multiple_of(10) { rng.random_range(-0.1..0.1) } else { rng.random_range(-1.0..-0.1) };
        let pose = Pose { origin: Vec3::new(x, y, z), ..Pose::identity() };
        Obstacle::new(solids[i % solids.len()].clone(), pose).with_friction(0.4)
    };
    (0..MANY).map(ball).collect()
}

fn state_of(method: Method, obstacles: Vec<Obstacle>) -> State {
    let mut state = State::new(model().clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
    state.set_obstacles(obstacles).unwrap();
    state
}

/// All balls rise, so that none of the lists of what is near holds for long.
fn drive(state: &mut State, step: usize) {
    for i in (step % 7..MANY).step_by(7) {
        let mut pose = state.obstacles()[i].pose;
        pose.origin.z += 0.01;
        state.move_obstacle(i, pose, false).unwrap();
    }
    state.step(H).unwrap();
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

#[test]
fn among_thousands_of_balls_a_leaf_stays_bounded_and_goes_on_with_the_same_bits_when_resumed() {
    let rest = &model().shell.mesh.positions;
    let size = model().shell.mesh.size;
    // Linear modes grow as they turn, and have no bound.
    for method in [Method::Warp, Method::RotationStrain, Method::ReducedShell, Method::PolynomialShell] {
        let mut state = state_of(method, balls());
        let (mut furthest, mut most) = (0.0f64, 0);
        let mut resumed = None;
        for step in 0..6 {
            if step == 3 {
                let mut other = state_of(method, balls());
                other.load(&state.save()).unwrap();
                resumed = Some(other);
            }
            for state in [Some(&mut state), resumed.as_mut()].into_iter().flatten() {
                drive(state, step);
            }
            let x = positions(&state);
            let moved = x.iter().zip(rest).map(|(x, rest)| (x - rest).norm());
            furthest = moved.fold(furthest, |a, b| if b.is_nan() { f64::INFINITY } else { a.max(b) });
            most = most.max(state.contact_summary().count);
            assert!(state.contacts().all(|contact| contact.force.iter().all(|f| f.is_finite())), "{method}");
        }
        println!("{method}: {most} contacts, moved by {:.2} sizes at most", furthest / size);
        // Capacity of a method with few unknowns is 256 contacts; there are more balls than that in the leaf.
        assert!(most > 10 && most <= 256, "{method}: {most} contacts");
        // As in contact.rs: a leaf that is held at its stem and thrown over comes to twice its size, and half as far again where it stretches.
        assert!(furthest <= 3.0 * size, "{method}: {furthest}");
        assert!(positions(&state) == positions(&resumed.unwrap()), "{method}: the resumed run");
    }
}

#[test]
fn the_full_shell_steps_among_thousands_of_balls() {
    let rest = &model().shell.mesh.positions;
    let mut states = [0, 1].map(|_| state_of(Method::ImplicitShell, balls()));
    for state in &mut states {
        (0..2).for_each(|step| drive(state, step));
        let x = positions(state);
        let furthest = x.iter().zip(rest).map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max);
        println!("{} contacts, moved by {furthest:.3}", state.contact_summary().count);
        assert!(state.contact_summary().count > 50, "{}", state.contact_summary().count);
        // What is inside comes out by no more than a size a second, and falls no faster than free.
        assert!(x.iter().all(|x| x.iter().all(|c| c.is_finite())) && furthest <= 0.2, "{furthest}");
    }
    assert!(positions(&states[0]) == positions(&states[1]));
}

#[test]
fn one_of_thousands_is_refused_by_its_index() {
    let mut state = state_of(Method::Warp, balls());
    let refused = state.move_obstacle(MANY, Pose::identity(), false).unwrap_err().message;
    assert!(refused.contains("collider 5000 of 5000"), "{refused}");
    let refused = state.deform_obstacle(3141, &[Vec3::zeros(); 4], false).unwrap_err().message;
    assert!(refused.contains("collider 3141"), "{refused}");
    // It goes on as if nobody had asked.
    let mut other = state_of(Method::Warp, balls());
    for state in [&mut state, &mut other] {
        drive(state, 0);
    }
    assert!(positions(&state) == positions(&other));
}

//! A step places and looks at only what is near a solid: with the same bits as a look at all.

use crate::common::*;
use shellwarp::Vec3;
use shellwarp::collider::Solid;
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use std::sync::Arc;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { origin: Vec3::new(x, y, z), ..Pose::identity() }
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

/// A state whose solids are set anew before each step looks at all.
#[test]
fn what_is_not_near_changes_nothing() {
    let options = Options { modes: 8, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(leaf(3)), &options, &mut |_, _| Ok(())).unwrap());
    assert!(model.shell.mass.len() > 2000, "lists are for many vertices: {}", model.shell.mass.len());
    let [ball, small] = [0.3, 0.05].map(|radius| Arc::new(Solid::sphere(radius).unwrap()));
    let obstacles = vec![
        Obstacle::new(ball, at(1.0, 0.2, -0.4)).with_friction(0.4),
        Obstacle::new(small, at(0.6, -0.1, 0.5)).with_friction(0.4),
    ];
    for method in [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp] {
        let mut states = [(); 2].map(|()| {
            let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
            state.set_damping(&Damping { mass_coefficient: 2.0, ..Damping::default() }).unwrap();
            state.set_obstacles(obstacles.clone()).unwrap();
            state
        });
        let mut touched = 0;
        for i in 0..90 {
            states[1].set_obstacles(obstacles.clone()).unwrap();
            for state in &mut states {
                // It comes down on the leaf, rests, and is elsewhere at once.
                let height = 0.5 - 0.01 * f64::from(i.min(50));
                state.move_obstacle(1, at(if i < 70 { 0.6 } else { 0.9 }, -0.1, height), i == 70).unwrap();
            }
            let counted = allocation_counter::measure(|| states[0].step(1.0 / 60.0).unwrap());
            assert_eq!(counted.count_total, 0, "{method}, step {i}");
            states[1].step(1.0 / 60.0).unwrap();
            touched = touched.max(states[0].contact_summary().count);
            assert!(positions(&states[0]) == positions(&states[1]), "{method}, step {i}");
            assert_eq!(states[0].contact_summary(), states[1].contact_summary(), "{method}, step {i}");
        }
        assert!(touched > 0, "{method} touches nothing");
    }
}

//! A step looks at only what is near a solid, and places it: with the same bits as a look at all.

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

/// No list is made beside a plane that moves, as it has no bound of its way: such a state looks at all. The other has a ball in its place, which moves
/// as little. Both are far away.
#[test]
fn what_is_not_near_changes_nothing() {
    let options = Options { modes: 8, ..Options::default() };
    let [ball, small] = [0.3, 0.05].map(|radius| Arc::new(Solid::sphere(radius).unwrap()));
    for fine in [1, 3] {
        let model = Arc::new(Model::precompute(Arc::new(leaf(fine)), &options, &mut |_, _| Ok(())).unwrap());
        for method in [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp] {
            let mut states = [ball.clone(), Arc::new(Solid::plane())].map(|far| {
                let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
                state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
                state.set_damping(&Damping { mass_coefficient: 2.0, ..Damping::default() }).unwrap();
                let obstacles = vec![
                    Obstacle::new(ball.clone(), at(1.0, 0.2, -0.4)).with_friction(0.4),
                    Obstacle::new(small.clone(), at(0.6, -0.1, 0.5)).with_friction(0.4),
                    Obstacle::new(far, at(0.0, 0.0, -50.0)),
                ];
                state.set_obstacles(obstacles).unwrap();
                state
            });
            let mut touched = 0;
            for i in 0..140 {
                let step = format!("{method}, {} vertices, step {i}", model.shell.mass.len());
                // It sways, so that lists last. The small ball comes down on the leaf, rests, and is elsewhere at once.
                let sway = (0.3 * f64::from(i)).sin();
                let height = 0.5 - 0.01 * f64::from(i.min(50));
                for state in &mut states {
                    state.set_gravity(9.81 * Vec3::new(0.0, 0.2 * sway, -1.0)).unwrap();
                    state.move_obstacle(1, at(if i < 110 { 0.6 } else { 0.9 }, -0.1, height), i == 110).unwrap();
                    state.move_obstacle(2, at(0.0, 0.0, -50.0 - 1e-9 * f64::from(i % 2)), false).unwrap();
                    let counted = allocation_counter::measure(|| state.step(1.0 / 60.0).unwrap());
                    assert_eq!(counted.count_total, 0, "{step}");
                }
                let [near, all] = &states;
                touched = touched.max(near.contact_summary().count);
                assert!(positions(near) == positions(all), "{step}");
                assert_eq!(near.contact_summary(), all.contact_summary(), "{step}");
            }
            assert!(touched > 0, "{method} touches nothing");
        }
    }
}

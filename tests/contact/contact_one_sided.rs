//! Shells that fall on open meshes: grounds of two triangles, waves and bowls.

use crate::collider_meshes::{Mesh, inside_out, sphere};
use crate::common::equilateral_sheet;
use shellwarp::collider::{GridOptions, Solid};
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use shellwarp::{Material, Mesh as ShellMesh, Shell, Supports, Vec3};
use std::sync::{Arc, OnceLock};

const H: f64 = 1.0 / 60.0;
const G: f64 = 9.81;
const METHODS: [Method; 4] = [Method::Warp, Method::LinearModalAnalysis, Method::RotationStrain, Method::ImplicitShell];

/// A free sheet of about 1 by 1 by 0.2 kg.
fn sheet() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = equilateral_sheet(10, 11, 0.1);
        let material = Material { area_density: 0.2, ..Material::default() };
        let shell = Shell::new(ShellMesh::new(positions, &triangles).unwrap(), material, &Supports::default()).unwrap();
        let options = Options { modes: 16, precision: Precision::F64, ..Options::default() };
        Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
    })
}

fn falling(method: Method, obstacle: Obstacle) -> State {
    let mut state = State::new(sheet().clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -G)).unwrap();
    state.set_obstacles(vec![obstacle]).unwrap();
    state
}

fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

/// n × n quads over a square of this half side about the origin.
fn patch(half: f64, n: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let at = |i: u32| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
    let mut mesh = (vec![], vec![]);
    for i in 0..=n {
        for j in 0..=n {
            mesh.0.push(Vec3::new(at(i), at(j), height(at(i), at(j))));
            if i < n && j < n {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| (n + 1) * i + j);
                mesh.1.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

fn moving(mesh: &Mesh, depth: f64) -> Solid {
    Solid::one_sided_moving_mesh(&mesh.0, &mesh.0, &mesh.1, depth).unwrap()
}

fn on_grid(mesh: &Mesh, depth: f64) -> Solid {
    Solid::one_sided_grid(&mesh.0, &mesh.1, depth, &GridOptions::default()).unwrap()
}

/// The sheet's middle, which equilateral_sheet has at (0.5, 0.5).
fn below(z: f64) -> Pose {
    Pose { origin: Vec3::new(0.5, 0.5, z), ..Pose::identity() }
}

fn deepest(state: &State) -> f64 {
    let obstacle = &state.obstacles()[0];
    let depth = |x: &Vec3| -obstacle.solid.touch(&obstacle.at_end(x)).distance;
    positions(state).iter().map(depth).fold(0.0, f64::max)
}

#[test]
fn a_sheet_lies_with_its_weight_on_a_ground_of_two_triangles() {
    let weight = G * sheet().shell.mass.iter().sum::<f64>();
    for method in METHODS {
        for solid in [moving(&patch(3.0, 1, |_, _| 0.0), 0.1), on_grid(&patch(3.0, 1, |_, _| 0.0), 0.3)] {
            let mut state = falling(method, Obstacle::new(Arc::new(solid), below(-0.01)).with_friction(0.4));
            (0..60).for_each(|_| state.step(H).unwrap());
            let force: Vec3 = state.contacts().map(|contact| contact.force).sum();
            println!("{method}: {:.4} of the weight", force.z / weight);
            assert!((force.z / weight - 1.0).abs() < 0.01 && deepest(&state) < 1e-3, "{method}: {force:?}");
        }
    }
}

#[test]
fn a_sheet_that_falls_on_an_open_wave_stays_on_it_and_one_that_is_shot_at_it_too() {
    let wave = |x: f64, y: f64| 0.06 * (5.0 * x).sin() * (4.0 * y).cos();
    let mesh = patch(2.5, 60, wave);
    for (solid, speed) in [(moving(&mesh, 0.2), 0.0), (on_grid(&mesh, 0.4), 0.0), (moving(&mesh, 0.02), 20.0)] {
        for method in METHODS {
            let mut state = falling(method, Obstacle::new(Arc::new(solid.clone()), below(-0.1)).with_friction(0.5));
            let (mut worst, mut touched) = (0.0f64, 0);
            for k in 1..=40 {
                // The wave comes up by up to 20 sizes a second, a third of the sheet's size in a step.
                if speed > 0.0 && k <= 10 {
                    state.move_obstacle(0, below(-0.1 + speed * H * f64::from(k)), false).unwrap();
                }
                state.step(H).unwrap();
                worst = worst.max(deepest(&state));
                touched = touched.max(state.contact_summary().count);
            }
            let lift = state.obstacles()[0].pose.origin.z;
            let lowest = positions(&state).iter().map(|p| p.z - lift - wave(p.x - 0.5, p.y - 0.5)).fold(1.0, f64::min);
            println!("{method}, {speed}: {touched} contacts, deepest {worst:.1e}, {lowest:.1e} above the wave");
            // A facet of 0.083 is e² κ/8 = 1.3e-3 off the wave.
            assert!(touched > 3 && lowest > -5e-3, "{method}, {speed}: {lowest}");
        }
    }
}

#[test]
fn a_sheet_stays_in_an_open_bowl_and_upon_an_open_dome() {
    let half = |up: f64| {
        let (positions, triangles) = sphere(4);
        let positions: Vec<Vec3> = positions.iter().map(|x| 2.0 * x).collect();
        let inside = |t: &[u32; 3]| t.iter().all(|v| up * positions[*v as usize].z > 0.2);
        let kept = triangles.into_iter().filter(inside).collect();
        (positions, kept)
    };
    for (mesh, z, out) in [(inside_out(half(-1.0)), 1.6, -1.0), (half(1.0), -2.02, 1.0)] {
        for solid in [moving(&mesh, 0.3), on_grid(&mesh, 0.3)] {
            for method in METHODS {
                let mut state = falling(method, Obstacle::new(Arc::new(solid.clone()), below(z)).with_friction(0.8));
                let (mut worst, mut touched) = (0.0f64, 0);
                for _ in 0..60 {
                    state.step(H).unwrap();
                    let past = |p: &Vec3| out * (2.0 - (p - Vec3::new(0.5, 0.5, z)).norm());
                    worst = worst.max(positions(&state).iter().map(past).fold(-1.0, f64::max));
                    touched = touched.max(state.contact_summary().count);
                }
                println!("{method}, {out}: {touched} contacts, at most {worst:.1e} past the sphere");
                // Facets are up to 4e-3 of the radius inside of the sphere.
                assert!(touched > 0 && worst < 0.012, "{method}: {worst}");
            }
        }
    }
}

#[test]
fn an_open_sheet_that_waves_carries_what_lies_on_it_and_nothing_passes() {
    let shape = |t: f64| patch(2.5, 30, move |x, y| 0.05 * (4.0 * x + 6.0 * t).sin() * (3.0 * y).cos() + 0.3 * t);
    let (first, triangles) = shape(0.0);
    for method in METHODS {
        let solid = Solid::one_sided_moving_mesh(&first, &first, &triangles, 0.1).unwrap();
        let mut state = falling(method, Obstacle::new(Arc::new(solid), below(-0.08)).with_friction(0.5));
        let (mut worst, mut touched) = (0.0f64, 0);
        for k in 1..=60 {
            state.deform_obstacle(0, &shape(f64::from(k) * H).0, false).unwrap();
            state.step(H).unwrap();
            worst = worst.max(deepest(&state));
            touched = touched.max(state.contact_summary().count);
        }
        let lowest = positions(&state).iter().map(|p| p.z).fold(1.0, f64::min);
        println!("{method}: {touched} contacts, deepest {worst:.1e}, lowest {lowest:.3}");
        // It was lifted by 0.3, and no vertex is behind.
        assert!(touched > 3 && worst < 5e-3 && lowest > 0.3 - 0.08 - 0.06, "{method}: {worst} {lowest}");
    }
}

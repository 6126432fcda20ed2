//! Twelve scenes with what acts in them, as their demand tells and as their steps do: for tests/reduced/demand.rs and tests/bench/demand.rs.
#![allow(dead_code, missing_docs)] // each uses its own part

use super::common::{equilateral_sheet, reference};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::modes::Demand;
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;
use std::time::Instant;

pub const STEP: f64 = 1.0 / 60.0;
/// The modes that are compared with, all 312 of a sheet; and shares of the largest displacement that are asked for.
pub const ALL: usize = 320;
pub const SHARES: [f64; 3] = [0.01, 0.05, 0.2];
const STEPS: usize = 90;

/// Where a handle is at a time.
pub type Way = fn(f64) -> Vec3;

/// What happens in a scene, as its demand tells and as its steps do.
pub struct Scene {
    pub name: &'static str,
    pub shell: Arc<Shell>,
    pub method: Method,
    pub demand: Demand,
    /// Gravity of the state.
    gravity: Vec3,
    /// The frame at a time.
    frame: fn(f64) -> Pose,
    /// A vertex that is dragged along z, in which it gives, and where to by a time, from rest.
    pub drag: Option<(u32, Way)>,
}

/// A square sheet of 10 × 10 rows, held along one side, with z as `height` has it.
fn sheet(k_bend: f64, height: fn(f64, f64) -> f64) -> Arc<Shell> {
    let (mut positions, triangles) = equilateral_sheet(10, 10, 0.1);
    positions.iter_mut().for_each(|x| x.z = height(x.x, x.y));
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.11).collect();
    let material = Material { k_area: 1e3, k_length: 1e3, k_bend, area_density: 1.0 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap())
}

fn still(_: f64) -> Pose {
    Pose::identity()
}

/// Shaken along y with 2 m/s² at 1.1 Hz.
fn shaken(t: f64) -> Pose {
    let omega = std::f64::consts::TAU * 1.1;
    Pose { origin: Vec3::y() * (2.0 / (omega * omega) * (1.0 - (omega * t).cos())), ..Pose::identity() }
}

/// About x with 0.8 rad/s²: at 1.3 m from it, with 1.2 rad/s at the end, no more than 3 m/s² beside gravity.
fn turned(t: f64) -> Pose {
    Pose { rotation: nalgebra::UnitQuaternion::from_scaled_axis(Vec3::x() * 0.4 * t * t), ..Pose::identity() }
}

fn lifted(t: f64) -> Vec3 {
    Vec3::new(0.0, 0.0, 0.08) * (t / 0.5).min(1.0)
}

pub fn scenes() -> Vec<Scene> {
    let beam = |name| Arc::new(reference(name).0);
    let quiet = |name, shell: &Arc<Shell>, method, gravity: Vec3| Scene {
        name,
        shell: shell.clone(),
        method,
        demand: Demand { gravity, amplification: 2.0, ..Demand::default() },
        gravity,
        frame: still,
        drag: None,
    };
    let (flat, v) = (beam("flat_beam"), beam("v_beam"));
    let (plate, arch) = (sheet(4.0, |_, _| 0.0), sheet(4.0, |x, y| 0.3 * y * (0.87 - y) + 0.1 * x * x));
    let drags = |scene: Scene, vertex: u32, speed: f64| Scene {
        demand: Demand { handles: vec![vertex], distance: 0.08, speed, ..scene.demand.clone() },
        drag: Some((vertex, lifted)),
        ..scene
    };
    let moves = |scene: Scene, frame, acceleration, amplification| Scene {
        demand: Demand { acceleration, amplification, ..scene.demand.clone() },
        frame,
        ..scene
    };
    let (warp, work, linear) = (Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis);
    let corner = 120;
    vec![
        quiet("flat beam let go", &flat, warp, Vec3::new(0.0, 0.0, -0.1)),
        quiet("flat beam let go, virtual work", &flat, work, Vec3::new(0.0, 0.0, -0.2)),
        quiet("V-beam let go", &v, warp, Vec3::new(0.0, 0.0, -2.0)),
        quiet("V-beam, gravity aside, linear", &v, linear, Vec3::new(0.0, 2.0, -2.0)),
        quiet("plate let go", &plate, warp, Vec3::new(0.0, 0.0, -3.0)),
        quiet("arch let go", &arch, warp, Vec3::new(0.0, 1.0, -9.8)),
        moves(quiet("shaken plate", &plate, warp, Vec3::new(0.0, 0.0, -1.0)), shaken, 2.0, 4.0),
        moves(quiet("arch on a turning frame", &arch, work, Vec3::zeros()), turned, 8.0, 2.0),
        drags(quiet("plate with a handle", &plate, warp, Vec3::new(0.0, 0.0, -0.5)), corner, 0.0),
        drags(quiet("arch with a handle", &arch, warp, Vec3::new(0.0, 0.0, -1.0)), corner, 0.0),
        drags(quiet("plate with a handle of known speed", &plate, warp, Vec3::new(0.0, 0.0, -0.5)), corner, 0.16),
        drags(quiet("arch with a handle of known speed", &arch, warp, Vec3::new(0.0, 0.0, -1.0)), corner, 0.16),
    ]
}

/// Positions in the frame after each step, and how long that and reading them took.
pub fn run(scene: &Scene, model: &Arc<Model>) -> Vec<(Vec<Vec3>, f64)> {
    let mut state = State::new(model.clone(), scene.method, Integrator::ImplicitEuler).unwrap();
    // The arch's frame turns about x under a gravity of 5 that the demand has in any direction.
    let gravity = if scene.gravity == Vec3::zeros() { Vec3::new(0.0, 0.0, -5.0) } else { scene.gravity };
    state.set_gravity(gravity).unwrap();
    state.set_damping(&Damping { ratios: vec![0.05], ..Damping::default() }).unwrap();
    let step = |k: usize| {
        let t = (k + 1) as f64 * STEP;
        state.set_frame((scene.frame)(t), FrameMotion::Continuous);
        if let Some((vertex, to)) = scene.drag {
            let target = Target::Position(scene.shell.mesh.positions[vertex as usize] + to(t));
            state
                .set_constraint(Constraint { id: 0, vertex, axes: [false, false, true], compliance: 0.0, target })
                .unwrap();
        }
        let mut x = vec![Vec3::zeros(); scene.shell.mass.len()];
        let start = Instant::now();
        state.step(STEP).unwrap();
        state.positions(Space::Frame, |v, position| x[v] = position);
        (x, start.elapsed().as_secs_f64())
    };
    (0..STEPS).map(step).collect()
}

pub fn precomputed(scene: &Scene, modes: usize, demand: Option<Demand>) -> Arc<Model> {
    let linear = scene.method == Method::LinearModalAnalysis;
    let options = Options { modes, precision: Precision::F64, demand, linear, ..Options::default() };
    Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

/// The furthest that a vertex is from where it is in `to`, in any step.
pub fn apart(run: &[(Vec<Vec3>, f64)], to: &[(Vec<Vec3>, f64)]) -> f64 {
    let pairs = run.iter().zip(to).flat_map(|((a, _), (b, _))| a.iter().zip(b));
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// The furthest that a vertex is from rest.
pub fn moved(run: &[(Vec<Vec3>, f64)], scene: &Scene) -> f64 {
    let rest = &scene.shell.mesh.positions;
    let steps = run.iter().flat_map(|(x, _)| x.iter().zip(rest));
    steps.map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max)
}

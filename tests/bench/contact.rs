//! What contact costs a frame of the warp: without colliders, with one far away, and with 1, 10 and 100 contacts; in one run.
//!
//! usage: contact [--docs FILE] [--only VERTICES/COLLIDER] [--once]
//!
//! A leaf lies on a solid, and a sheet on balls side by side, under a gravity that sways, so that they never sleep. A frame is a step and the
//! reading of all positions in 32 bits. With --only one contestant runs, for a profiler, such as --only "472/a ball"; with --once, for one turn.
#![allow(missing_docs)]

#[path = "../collider_meshes/mod.rs"]
mod collider_meshes;
#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;

use common::{equilateral_sheet, leaf};
use shellwarp::collider::{GridOptions, Solid};
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const FRAME: f64 = 1.0 / 60.0;
/// Frames until the leaf lies, frames that are timed, and turns that each contestant takes.
const FALL: usize = 120;
const FRAMES: usize = 120;
const TURNS: usize = 7;

/// One row of the table.
struct Contestant {
    name: String,
    state: State,
    /// Of each frame, the best seconds of a step and of reading the positions: all turns take the same steps.
    seconds: [[f64; 2]; FRAMES],
    /// Mean of contacts with a force, and the deepest penetration over the size.
    contacts: f64,
    deepest: f64,
}

fn contestant(model: &Arc<Model>, name: &str, obstacles: Vec<Obstacle>) -> Contestant {
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    state.set_obstacles(obstacles.into_iter().map(|o| o.with_friction(0.3)).collect()).unwrap();
    Contestant { name: name.to_owned(), state, seconds: [[f64::INFINITY; 2]; FRAMES], contacts: 0.0, deepest: 0.0 }
}

fn step(state: &mut State, frame: usize) {
    let sway = 0.05 * (frame as f64 * 0.3).sin();
    state.set_gravity(9.81 * Vec3::new(0.0, sway, -1.0)).unwrap();
    state.step(FRAME).unwrap();
}

/// One turn: falls, then is timed frame by frame.
fn run(of: &mut Contestant, out: &mut [[f32; 3]]) {
    let state = &mut of.state;
    state.reset();
    (0..FALL).for_each(|frame| step(state, frame));
    let mut contacts = 0;
    for (frame, best) in (FALL..).zip(&mut of.seconds) {
        let start = Instant::now();
        step(state, frame);
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        state.position_rows_f32(Space::World, |v, rows| out[v..v + rows.len()].copy_from_slice(rows));
        black_box(&out);
        best[1] = best[1].min(start.elapsed().as_secs_f64());
        let summary = state.contact_summary();
        contacts += summary.count;
        of.deepest = of.deepest.max(summary.deepest / state.model().shell.mesh.size);
    }
    of.contacts = contacts as f64 / FRAMES as f64;
}

fn ball(radius: f64, as_grid: bool) -> Solid {
    if !as_grid {
        return Solid::sphere(radius).unwrap();
    }
    let (positions, triangles) = collider_meshes::sphere(4);
    let positions: Vec<Vec3> = positions.iter().map(|x| radius * x).collect();
    Solid::grid(&positions, &triangles, &GridOptions::default()).unwrap()
}

fn model_of(shell: Shell) -> Arc<Model> {
    let options = Options { modes: 16, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

/// A leaf on one solid.
fn leaves(fine: usize) -> Vec<Contestant> {
    let model = model_of(leaf(fine));
    let below = |x: f64, radius: f64| Pose { origin: Vec3::new(x, 0.0, -radius - 0.02), ..Pose::identity() };
    let one = |solid: Solid, pose: Pose| vec![Obstacle::new(Arc::new(solid), pose)];
    vec![
        contestant(&model, "none", vec![]),
        contestant(&model, "a ball far away", one(ball(0.3, false), below(0.75, 30.0))),
        contestant(&model, "a small ball", one(ball(0.1, false), below(0.9, 0.1))),
        contestant(&model, "a ball", one(ball(1.0, false), below(0.9, 1.0))),
        contestant(&model, "a ball's grid", one(ball(1.0, true), below(0.9, 1.0))),
        contestant(&model, "a plane", one(Solid::plane(), below(0.0, 0.0))),
    ]
}

/// A square sheet of a metre on balls that touch it at rest. One is held along a side, and its tip would sag by 0.1 m. One is free and has
/// fallen flat, so that every ball carries its share.
fn sheets(cells: usize) -> Vec<Contestant> {
    let model = |held: f64| {
        let (positions, triangles) = equilateral_sheet(cells, cells, 1.0 / cells as f64);
        let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < held).collect();
        let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 5.0, area_density: 1.0 };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        model_of(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap())
    };
    let (held, free) = (model(0.05), model(-1.0));
    const RADIUS: f64 = 0.045;
    let pegs = |[along, across]: [usize; 2], as_grid: bool| {
        let solid = Arc::new(ball(RADIUS, as_grid));
        let place = |i: usize| {
            let [x, y] = [(i / across, along), (i % across, across)].map(|(i, n)| (i as f64 + 0.5) / n as f64);
            Vec3::new(0.1 + 0.88 * x, 0.01 + 0.84 * y, -RADIUS)
        };
        let places = (0..along * across).map(place);
        places.map(|origin| Obstacle::new(solid.clone(), Pose { origin, ..Pose::identity() })).collect::<Vec<_>>()
    };
    let mut all = vec![contestant(&held, "none", vec![])];
    let mut carried = contestant(&held, "held, 10 balls that all carry", carrying(&held, RADIUS));
    carried.state.set_damping(&damped()).unwrap(); // else it bounces for minutes
    all.push(carried);
    for (model, how, counts) in [(&held, "held, ", [1, 1]), (&free, "free, ", [5, 2]), (&free, "free, ", [10, 10])] {
        for (as_grid, what) in [(false, "balls"), (true, "balls' grids")] {
            let name = format!("{how}{} {what}", counts[0] * counts[1]);
            all.push(contestant(model, &name, pegs(counts, as_grid)));
        }
    }
    all
}

/// Ten balls under a held sheet, each where it carries a fourteenth of the weight: below points at which such forces bend it to where it touches.
fn carrying(model: &Arc<Model>, radius: f64) -> Vec<Obstacle> {
    let mesh = &model.shell.mesh;
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    state.set_damping(&damped()).unwrap();
    let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f64;
    let nearest = |i: usize| {
        let [x, y] = [(i / 2) as f64 / 4.0 - 0.5, (i % 2) as f64 - 0.5];
        let to = middle + Vec3::new(0.1 + 0.6 * x, 0.5 * y, 0.0);
        let away = |v: &usize| (mesh.positions[*v] - to).norm();
        (0..mesh.positions.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap() as u32
    };
    let points: Vec<u32> = (0..10).map(nearest).collect();
    let share = 9.81 * model.shell.total_mass / 14.0;
    state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
    state.set_forces(points.iter().map(|v| (*v, Vec3::new(0.0, 0.0, share))), false).unwrap();
    (0..600).for_each(|_| state.step(FRAME).unwrap());
    let mut x = vec![Vec3::zeros(); mesh.positions.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    let ball = Arc::new(ball(radius, false));
    let below = |v: &u32| Pose { origin: x[*v as usize] - radius * Vec3::z(), ..Pose::identity() };
    points.iter().map(|v| Obstacle::new(ball.clone(), below(v))).collect()
}

fn damped() -> Damping {
    Damping { mass_coefficient: 5.0, ..Damping::default() }
}

/// Mean seconds of a step, and of reading the positions.
fn means(of: &Contestant) -> [f64; 2] {
    [0, 1].map(|what| of.seconds.iter().map(|seconds| seconds[what]).sum::<f64>() / FRAMES as f64)
}

/// Rows of the table: all take turns.
fn measure(mut all: Vec<Contestant>, only: Option<&str>, turns: usize) -> String {
    let n = all[0].state.model().shell.mass.len();
    all.retain(|of| only.is_none_or(|only| only == format!("{n}/{}", of.name)));
    let mut out = vec![[0f32; 3]; n];
    for _ in 0..turns {
        all.iter_mut().for_each(|of| run(of, &mut out));
    }
    let free = all.first().map_or(0.0, |of| means(of).iter().sum());
    let row = |of: &Contestant| {
        let times = means(of).iter().sum::<f64>() / free;
        let [step, read] = means(of).map(|seconds| 1e6 * seconds);
        format!(
            "| {n} | {} | {:.0} | {step:.1} | {read:.1} | {times:.1} | {:.0e} |\n",
            of.name, of.contacts, of.deepest
        )
    };
    all.iter().map(row).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |flag: &str| arguments.iter().position(|a| a == flag).map(|at| arguments[at + 1].as_str());
    let head = |what: &str| {
        format!(
            "\n{what}:\n\n\
             | vertices | collider | contacts | step, µs | positions, µs | frame over the free one | deepest, of the size |\n\
             |---|---|---|---|---|---|---|\n"
        )
    };
    let turns = if arguments.iter().any(|a| a == "--once") { 1 } else { TURNS };
    let fits = |n: usize| after("--only").is_none_or(|only| only.starts_with(&format!("{n}/")));
    let mut table = format!(
        "{}, load {}. Warp, 16 modes, steps of 1/60 s; means of 120 frames, each the best of {TURNS} turns.\n",
        docs::machine(),
        docs::load()
    );
    table.push_str(&head("A leaf on one solid"));
    let leaf_sizes = [(1, 472), (6, 15427)].into_iter().filter(|(_, n)| fits(*n));
    leaf_sizes.for_each(|(fine, _)| table.push_str(&measure(leaves(fine), after("--only"), turns)));
    table.push_str(&head("A flat sheet on balls side by side"));
    let sheet_sizes = [(21, 495), (113, 13053)].into_iter().filter(|(_, n)| fits(*n));
    sheet_sizes.for_each(|(cells, _)| table.push_str(&measure(sheets(cells), after("--only"), turns)));
    println!("{table}");
    if let Some(path) = after("--docs") {
        docs::put_section(path, "contact", &table).unwrap();
    }
}

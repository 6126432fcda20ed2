//! What contact costs a frame of the warp: no collider, one far away, and one that is touched at few and many places; in one run.
//!
//! usage: contact [--docs FILE]
//!
//! A leaf lies on a solid under a gravity that sways, so that it never sleeps. A frame is a step and the reading of all positions in 32 bits.
#![allow(missing_docs)]

#[path = "../collider_meshes/mod.rs"]
mod collider_meshes;
#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;

use common::leaf;
use shellwarp::Vec3;
use shellwarp::collider::{GridOptions, Solid};
use shellwarp::contact::Obstacle;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
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
    name: &'static str,
    state: State,
    /// Best seconds of a step, and of reading the positions.
    step: f64,
    read: f64,
    /// Mean of contacts with a force, and the deepest penetration over the size.
    contacts: f64,
    deepest: f64,
}

fn contestant(model: &Arc<Model>, name: &'static str, solid: Option<(Solid, Pose)>) -> Contestant {
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    if let Some((solid, pose)) = solid {
        state.set_obstacles(vec![Obstacle::new(Arc::new(solid), pose).with_friction(0.3)]).unwrap();
    }
    Contestant { name, state, step: f64::INFINITY, read: f64::INFINITY, contacts: 0.0, deepest: 0.0 }
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
    let (mut seconds, mut contacts) = ([0.0; 2], 0);
    for frame in FALL..FALL + FRAMES {
        let start = Instant::now();
        step(state, frame);
        seconds[0] += start.elapsed().as_secs_f64();
        let start = Instant::now();
        state.position_rows_f32(Space::World, |v, rows| out[v..v + rows.len()].copy_from_slice(rows));
        black_box(&out);
        seconds[1] += start.elapsed().as_secs_f64();
        let summary = state.contact_summary();
        contacts += summary.count;
        of.deepest = of.deepest.max(summary.deepest / state.model().shell.mesh.size);
    }
    of.step = of.step.min(seconds[0] / FRAMES as f64);
    of.read = of.read.min(seconds[1] / FRAMES as f64);
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

/// Measures a leaf; rows of the table.
fn measure(fine: usize) -> String {
    let shell = Arc::new(leaf(fine));
    let options = Options { modes: 16, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let below = |x: f64, radius: f64| Pose { origin: Vec3::new(x, 0.0, -radius - 0.02), ..Pose::identity() };
    let mut all = [
        contestant(&model, "none", None),
        contestant(&model, "a ball far away", Some((ball(0.3, false), below(0.75, 30.0)))),
        contestant(&model, "a small ball", Some((ball(0.1, false), below(0.9, 0.1)))),
        contestant(&model, "a ball", Some((ball(1.0, false), below(0.9, 1.0)))),
        contestant(&model, "a ball's grid", Some((ball(1.0, true), below(0.9, 1.0)))),
        contestant(&model, "a plane", Some((Solid::plane(), below(0.0, 0.0)))),
    ];
    let mut out = vec![[0f32; 3]; shell.mass.len()];
    for _ in 0..TURNS {
        all.iter_mut().for_each(|of| run(of, &mut out));
    }
    let free = all[0].step + all[0].read;
    let row = |of: &Contestant| {
        let [step, read] = [of.step, of.read].map(|seconds| 1e6 * seconds);
        let (times, n) = ((of.step + of.read) / free, shell.mass.len());
        format!(
            "| {n} | {} | {:.0} | {step:.1} | {read:.1} | {times:.1} | {:.0e} |\n",
            of.name, of.contacts, of.deepest
        )
    };
    all.iter().map(row).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let mut table = format!(
        "{}, load {}. Warp, 16 modes, steps of 1/60 s; best of {TURNS} turns.\n\n\
         | vertices | collider | contacts | step, µs | positions, µs | frame over the free one | deepest, of the size |\n\
         |---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    [1, 6].iter().for_each(|fine| table.push_str(&measure(*fine)));
    println!("{table}");
    if let Some(at) = arguments.iter().position(|a| a == "--docs") {
        docs::put_section(&arguments[at + 1], "contact", &table).unwrap();
    }
}

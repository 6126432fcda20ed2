//! What portable arithmetic costs: a step and the positions of deterministic states over those of plain ones, in turns of one run.
//!
//! usage: same_bits [--docs FILE]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;

use common::leaf;
use shellwarp::Vec3;
use shellwarp::arithmetic::Arithmetic;
use shellwarp::method::METHODS;
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Space, State};
use shellwarp::step::Integrator;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const FRAME: f64 = 1.0 / 60.0;
const FRAMES: usize = 60;
const TURNS: usize = 15;
const FIELDS: usize = 20;
const KINDS: [Arithmetic; 2] = [Arithmetic::Fastest, Arithmetic::Portable];

/// Mean seconds of a step and of reading the positions under a gravity that sways.
fn run(state: &mut State, out: &mut [[f32; 3]]) -> [f64; 2] {
    state.reset();
    let mut seconds = [0.0; 2];
    for frame in 0..FRAMES {
        let sway = (frame as f64 * 0.3).sin();
        state.set_gravity(Vec3::new(0.0, 0.3 * sway, -1.0)).unwrap();
        let start = Instant::now();
        state.step(FRAME).unwrap();
        let read = Instant::now();
        state.position_rows_f32(Space::World, |v, rows| out[v..v + rows.len()].copy_from_slice(rows));
        black_box(&out);
        seconds[0] += (read - start).as_secs_f64() / FRAMES as f64;
        seconds[1] += read.elapsed().as_secs_f64() / FRAMES as f64;
    }
    seconds
}

/// Rows of the table of a leaf.
fn measure(fine: usize) -> String {
    let shell = Arc::new(leaf(fine));
    let reduced = reduced::Options { fields: FIELDS, poses: 8, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let mut out = vec![[0f32; 3]; shell.mass.len()];
    let mut rows = String::new();
    for method in METHODS.map(|entry| entry.method) {
        let made = |kind: Arithmetic| State::new(model.with_arithmetic(kind).ok()?, method, Integrator::Exact).ok();
        let [Some(plain), Some(portable)] = KINDS.map(made) else { continue };
        let mut states = [plain, portable];
        let mut best = [[f64::INFINITY; 2]; 2];
        for _ in 0..TURNS {
            for (best, state) in best.iter_mut().zip(&mut states) {
                let seconds = run(state, &mut out);
                best.iter_mut().zip(seconds).for_each(|(best, now)| *best = best.min(now));
            }
        }
        let [[step, read], [portable_step, portable_read]] = best.map(|pair| pair.map(|seconds| 1e6 * seconds));
        let (name, n) = (method.entry().name.to_str().unwrap(), shell.mass.len());
        let (times, read_times) = (portable_step / step, portable_read / read);
        rows += &format!(
            "| {n} | {name} | {step:.1} | {portable_step:.1} | {times:.2} | {read:.1} | {portable_read:.1} | {read_times:.2} |\n"
        );
    }
    rows
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let mut table = format!(
        "{}, load {}. 8 modes, {FIELDS} fields more in the reduced shells, steps of 1/60 s; best of {TURNS} turns.\n\n\
         | vertices | method | step, µs | deterministic | times | positions, µs | deterministic | times |\n\
         |---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    [1, 6].iter().for_each(|fine| table.push_str(&measure(*fine)));
    println!("{table}");
    if let Some(at) = arguments.iter().position(|a| a == "--docs") {
        docs::put_section(&arguments[at + 1], "same_bits", &table).unwrap();
    }
}

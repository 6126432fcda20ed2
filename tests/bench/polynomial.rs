//! Steps and positions of the polynomial shell beside the warp's, taking turns on one machine, on leaves of several sizes; and what a
//! step of its length misses of the same motion in much shorter steps.
//!
//! usage: polynomial [--leaf FINE | --leg] [--size SHARE] [--poses COUNT] [--turns COUNT] [--errors] [--sampled] [N ...]
//!
//! N are modes and fields together. The leaf's edges are FINE times as short; --leg has a limp trouser leg in its place. It swings: gravity that bends it by SHARE of its size to first
//! order acts, turns over after a second and is gone after two and a half. How far it moves then is told: it overshoots, and curved shells give more than to first order. COUNT equilibria train it, as many as are usual unless told. A step's time is the mean over
//! all of the least that each few took in COUNT turns. Positions
//! are read in 32 bits and, of the same fields, in 16. Models stay in out/bench.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

use common::{displacements, error, leaf, trouser_leg};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Vec3};
use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Seconds of a step, steps, those that are timed together, and turns that each contestant takes unless told.
const FRAME: f64 = 1.0 / 60.0;
const STEPS: usize = 240;
const TOGETHER: usize = 12;
const TURNS: usize = 25;
const MODES: usize = 8;

/// Precomputed, or as it was saved by an earlier run.
fn model(shell: &Arc<Shell>, n: usize, poses: usize) -> Arc<Model> {
    let file = PathBuf::from(format!("out/bench/shell_{}_{n}_{poses}.swm", shell.mass.len()));
    if let Some(model) = std::fs::read(&file).ok().and_then(|bytes| Model::load(&bytes).ok()) {
        return Arc::new(model);
    }
    let reduced = reduced::Options { fields: n - MODES, poses, ..Default::default() };
    let options = Options { modes: MODES, reduced, ..Options::default() };
    let model = Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).expect("a model");
    std::fs::create_dir_all("out/bench").expect("a folder");
    std::fs::write(file, model.save().expect("bytes")).expect("room");
    Arc::new(model)
}

/// The same, whose positions are read in 16 bits.
fn in_16_bits(model: &Model) -> Arc<Model> {
    let mut same = Model::load(&model.save().expect("bytes")).expect("what was saved");
    let shell = same.shell.clone();
    let reduced = same.reduced.as_mut().and_then(Arc::get_mut).expect("a reduced shell of its own");
    reduced.set_output(&shell, Precision::I16).expect("memory");
    Arc::new(same)
}

/// The gravity that moves the leaf by about `size` of its size, to first order.
fn gravity(model: &Model, size: f64) -> Vec3 {
    let mut state = State::new(
        Arc::new(Model::load(&model.save().unwrap()).unwrap()),
        Method::LinearModalAnalysis,
        Integrator::Exact,
    )
    .unwrap();
    let down = Vec3::new(0.0, 0.0, -1.0);
    state.set_gravity(down).unwrap();
    state.equilibrium().unwrap();
    let largest = displacements(&state).iter().map(|u| u.norm()).fold(0.0, f64::max);
    down * (size * model.shell.mesh.size / largest)
}

fn load(state: &mut State, gravity: Vec3, seconds: f64) {
    let now = if seconds < 1.0 {
        gravity
    } else if seconds < 2.5 {
        -gravity
    } else {
        Vec3::zeros()
    };
    state.set_gravity(now).unwrap();
}

/// Seconds of each few steps that are taken together, the least of all turns.
#[inline(never)]
fn time(state: &mut State, gravity: Vec3, best: &mut [f64]) {
    state.reset();
    for (part, best) in best.iter_mut().enumerate() {
        let start = Instant::now();
        for k in part * TOGETHER..(part + 1) * TOGETHER {
            load(state, gravity, k as f64 * FRAME);
            state.step(FRAME).unwrap();
        }
        *best = best.min(start.elapsed().as_secs_f64());
    }
}

fn run(state: &mut State, gravity: Vec3, parts: usize, mut visit: impl FnMut(&State)) {
    state.reset();
    for k in 0..STEPS {
        load(state, gravity, k as f64 * FRAME);
        (0..parts).for_each(|_| state.step(FRAME / parts as f64).unwrap());
        visit(state);
    }
}

fn path(state: &mut State, gravity: Vec3, parts: usize) -> Vec<Vec3> {
    let mut all = vec![];
    run(state, gravity, parts, |state| all.extend(displacements(state)));
    all
}

fn main() {
    let mut fine = 1;
    let mut sizes: Vec<usize> = vec![];
    let mut strength = 0.4;
    let mut args = std::env::args().skip(1);
    let (mut errors, mut poses, mut turns, mut limp) = (false, None, TURNS, false);
    let mut method = Method::PolynomialShell;
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--leaf" => fine = args.next().unwrap().parse().unwrap(),
            "--size" => strength = args.next().unwrap().parse().unwrap(),
            "--poses" => poses = args.next().unwrap().parse().ok(),
            "--turns" => turns = args.next().unwrap().parse().unwrap(),
            "--errors" => errors = true,
            "--leg" => limp = true,
            "--sampled" => method = Method::ReducedShell,
            n => sizes.push(n.parse().unwrap()),
        }
    }
    if sizes.is_empty() {
        sizes = vec![20, 28, 48];
    }
    let shell = Arc::new(if limp { trouser_leg("left") } else { leaf(fine) });
    let poses = poses.unwrap_or_else(|| reduced::default_poses(shell.mass.len()));
    let models: Vec<_> = sizes.iter().map(|n| model(&shell, *n, poses)).collect();
    let packed: Vec<_> = models.iter().map(|model| in_16_bits(model)).collect();
    let gravity = gravity(&models[0], strength);
    let state = |model: &Arc<Model>, method| State::new(model.clone(), method, Integrator::Exact).unwrap();
    let mut states: Vec<State> = vec![state(&models[0], Method::Warp)];
    states.extend(models.iter().chain(&packed).map(|model| state(model, method)));
    let mut steps = vec![[f64::INFINITY; STEPS / TOGETHER]; states.len()];
    let mut reads = vec![f64::INFINITY; states.len()];
    let mut out = vec![[0f32; 3]; shell.mass.len()];
    for _ in 0..turns {
        for ((state, steps), read) in states.iter_mut().zip(&mut steps).zip(&mut reads) {
            time(state, gravity, steps);
            state.reset();
            load(state, gravity, 0.0);
            (0..30).for_each(|_| state.step(FRAME).unwrap());
            for _ in 0..20 {
                let start = Instant::now();
                state.position_rows_f32(Space::World, |v, rows| out[v..v + rows.len()].copy_from_slice(rows));
                black_box(&out);
                *read = read.min(start.elapsed().as_secs_f64());
            }
        }
    }
    let best: Vec<_> =
        steps.iter().zip(&reads).map(|(steps, read)| [steps.iter().sum::<f64>() / STEPS as f64, *read]).collect();
    let largest = |path: &[Vec3]| path.iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size;
    let moved = largest(&path(&mut states[models.len()], gravity, 1));
    println!(
        "{} vertices, {STEPS} steps of 1/60 s, gravity for {strength} of its size to first order: it moves by {moved:.2}",
        shell.mass.len()
    );
    let mut names = vec!["warp, 8 modes".to_owned()];
    for bits in [32, 16] {
        names.extend(sizes.iter().map(|n| format!("polynomial, r = {n}, {bits} bits")));
    }
    for ((name, own), state) in names.iter().zip(&best).zip(&mut states) {
        let [step, read] = own.map(|seconds| 1e6 * seconds);
        let [a, b] = [own[0] / best[0][0], (own[0] + own[1]) / (best[0][0] + best[0][1])];
        let short = state.report().unconverged_steps;
        print!("{name:<30} step {step:8.2} µs ({a:6.2} x), positions {read:8.2} µs, both {b:6.2} x, {short} short");
        if errors && name.ends_with("32 bits") {
            let exact = path(state, gravity, 64);
            let own = error(&path(state, gravity, 1), &exact);
            let half = error(&path(state, gravity, 2), &exact);
            print!(", off h/64 by {:.3} %, h/2 {:.3} %", 100.0 * own, 100.0 * half);
        }
        println!();
    }
}

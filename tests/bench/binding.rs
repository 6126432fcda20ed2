//! What points that follow a shell cost, over their number, beside reading the positions of a shell with as many vertices; in one run.
//!
//! usage: binding [--docs FILE]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;

use common::leaf;
use shellwarp::binding::{Binding, Points};
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, Shown, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Vec3};
use std::fmt::Write;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const TURNS: usize = 15;
/// The leaf that is simulated has 1,800 vertices or so; those whose vertices follow it are finer by these.
const SIMULATED: usize = 2;
const FINE: [usize; 7] = [0, 1, 2, 5, 8, 15, 46]; // the first: a single point
/// The finest that is simulated itself, for comparison.
const COMPARED: usize = 15;

fn moving(shell: Shell, modes: usize) -> State {
    let options = Options { modes, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model, Method::Warp, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.5, -9.81)).unwrap();
    (0..10).for_each(|_| state.step(1.0 / 60.0).unwrap());
    state
}

fn best(mut work: impl FnMut()) -> f64 {
    let once = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..TURNS).map(|_| once(&mut work)).fold(f64::INFINITY, f64::min)
}

fn single(x: Vec3) -> [f32; 3] {
    [x.x as f32, x.y as f32, x.z as f32]
}

/// Microseconds of reading all points' positions, and these with normals.
fn follow(state: &State, points: &[Vec3]) -> (f64, [f64; 2]) {
    let normals = vec![Vec3::z(); points.len()];
    let shell = &state.model().shell;
    let start = Instant::now();
    let plain = Binding::new(shell, &Points { positions: points, ..Points::default() }).unwrap();
    let bind = start.elapsed().as_secs_f64();
    let turning =
        Binding::new(shell, &Points { positions: points, normals: Some(&normals), ..Points::default() }).unwrap();
    let (mut x, mut n) = (vec![[0f32; 3]; points.len()], vec![[0f32; 3]; points.len()]);
    let positions = best(|| {
        state.bound(&plain, Shown::default(), false).unwrap().positions(0..points.len(), |i, p| x[i] = single(p));
        black_box(&x);
    });
    let both = best(|| {
        let pose = state.bound(&turning, Shown::default(), false).unwrap();
        pose.positions(0..points.len(), |i, p| x[i] = single(p));
        pose.normals(0..points.len(), |i, d| n[i] = single(d));
        black_box((&x, &n));
    });
    (bind, [positions, both].map(|seconds| 1e6 * seconds))
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let state = moving(leaf(SIMULATED), 16);
    let n = state.model().shell.mass.len();
    let mut table = format!(
        "{}, load {}. Warp, 16 modes, {n} vertices, one thread, 32 bits; best of {TURNS}.\n\n\
         | points | bound in, s | positions, µs | with normals, µs | positions, ns a point |\n|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut at_compared = 0.0;
    for fine in FINE {
        let mut points = leaf(fine.max(1)).mesh.positions.clone();
        if fine == 0 {
            points.truncate(1);
        }
        let (bind, [positions, both]) = follow(&state, &points);
        if fine == COMPARED {
            at_compared = positions;
        }
        let each = 1e3 * positions / points.len() as f64;
        writeln!(table, "| {} | {bind:.2} | {positions:.0} | {both:.0} | {each:.1} |", points.len()).unwrap();
    }
    table.push_str("\nReading the positions of a shell with as many vertices, by its modes:\n\n");
    table.push_str("| vertices | modes | positions, µs | following points over it |\n|---|---|---|---|\n");
    for modes in [8, 16, 32] {
        let whole = moving(leaf(COMPARED), modes);
        let n = whole.model().shell.mass.len();
        let mut out = vec![[0f32; 3]; n];
        let read = 1e6
            * best(|| {
                whole.position_rows_f32(Space::World, |v, rows| out[v..v + rows.len()].copy_from_slice(rows));
                black_box(&out);
            });
        writeln!(table, "| {n} | {modes} | {read:.0} | {:.2} |", at_compared / read).unwrap();
    }
    println!("{table}");
    if let Some(at) = arguments.iter().position(|a| a == "--docs") {
        docs::put_section(&arguments[at + 1], "binding", &table).unwrap();
    }
}

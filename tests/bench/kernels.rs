//! Nanoseconds per vertex of every run-time kernel through the C interface, beside floors measured in the same rounds:
//!
//! - `read`: streaming the basis once, as a step must at least;
//! - `read + write`: the same, and writing three floats a vertex, as reading positions must at least;
//! - `naive`: the warp's positions by a plain f64 loop over vertices and modes with nalgebra.
//!
//! Criterion and divan time one function after the other; on a machine with other work to do that makes ratios worthless, so
//! here the contestants take turns and the least time of each counts. Caches are warm: a basis that fits one is read from it.
//!
//! usage: cargo bench --bench kernels [-- LARGEST_N]     (make bench)
#![allow(missing_docs, unsafe_code)] // a host's calls across the interface

mod scene;

use nalgebra::UnitQuaternion;
use pulp::{Arch, Simd, WithSimd};
use scene::FRAME;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::ffi::batch::{sw_set_threads, sw_states_step};
use shellwarp::ffi::pointer::{SW_FORMAT_F32, SW_FORMAT_F64};
use shellwarp::ffi::state::{
    SW_SPACE_WORLD, SwState, SwStateReport, sw_state_positions, sw_state_report, sw_state_report_init, sw_state_step,
};
use shellwarp::model::Precision;
use shellwarp::state::{Method, Space, State};
use shellwarp::support::{Motion, Pose};
use shellwarp::{Model, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Turns of each contestant, and what one turn lasts at least.
const ROUNDS: usize = 25;
const TURN: f64 = 2e-3;

/// A timed thing.
struct Contestant<'a> {
    name: &'static str,
    /// Done before each turn, not timed.
    before: Box<dyn FnMut() + 'a>,
    call: Box<dyn FnMut() + 'a>,
    calls_per_turn: usize,
    /// Least seconds of a call.
    best: f64,
}

impl<'a> Contestant<'a> {
    fn new(name: &'static str, call: impl FnMut() + 'a) -> Self {
        Self { name, before: Box::new(|| ()), call: Box::new(call), calls_per_turn: 1, best: f64::INFINITY }
    }

    /// The first call is not timed: it finds the caches filled by the others.
    fn take_turn(&mut self) {
        (self.before)();
        (self.call)();
        let start = Instant::now();
        (0..self.calls_per_turn).for_each(|_| (self.call)());
        self.best = self.best.min(start.elapsed().as_secs_f64() / self.calls_per_turn as f64);
    }
}

/// Lets all take turns.
fn measure(contestants: &mut [Contestant]) {
    for one in &mut *contestants {
        one.take_turn();
        one.take_turn();
        one.calls_per_turn = ((TURN / one.best).ceil() as usize).max(1);
        one.best = f64::INFINITY;
    }
    for _ in 0..ROUNDS {
        contestants.iter_mut().for_each(Contestant::take_turn);
    }
}

/// Reads `basis` in blocks of `block` floats and, with room for it, writes 48 floats a block: the floors.
struct Stream<'a> {
    basis: &'a [f32],
    block: usize,
    out: Option<&'a mut [f32]>,
}

impl WithSimd for Stream<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { basis, block, mut out } = self;
        let mut total = [simd.splat_f32s(0.0); 8];
        for (b, block) in basis.chunks_exact(block).enumerate() {
            let (registers, _) = S::as_simd_f32s(block);
            let (eights, rest) = registers.as_chunks::<8>();
            let add = |sum: &mut S::f32s, x: &S::f32s| *sum = simd.add_f32s(*sum, *x);
            eights.iter().for_each(|eight| total.iter_mut().zip(eight).for_each(|(sum, x)| add(sum, x)));
            total.iter_mut().zip(rest).for_each(|(sum, x)| add(sum, x));
            if let Some(out) = &mut out {
                let (rows, _) = S::as_mut_simd_f32s(&mut out[48 * b..48 * b + 48]);
                rows.iter_mut().enumerate().for_each(|(i, row)| *row = total[i % 8]);
            }
        }
        black_box(total);
    }
}

/// Φ and Ψ vertex by vertex, mode by mode, as one would first write them.
struct Naive {
    shapes: Vec<(Vec3, Vec3)>,
    rest: Vec<Vec3>,
    modes: usize,
}

impl Naive {
    fn new(model: &Model) -> Self {
        let (n, modes) = (model.shell.mass.len(), model.n_modes());
        let shapes = (0..n).flat_map(|v| (0..modes).map(move |k| (k, v))).map(|(k, v)| model.mode_at(k, v)).collect();
        Self { shapes, rest: model.shell.mesh.positions.clone(), modes }
    }

    fn positions(&self, q: &[f64], out: &mut [[f32; 3]]) {
        for (v, rest) in self.rest.iter().enumerate() {
            let (mut u, mut w) = (Vec3::zeros(), Vec3::zeros());
            for ((phi, psi), q) in self.shapes[v * self.modes..][..self.modes].iter().zip(q) {
                u += phi * *q;
                w += psi * *q;
            }
            let angle = w.norm();
            let (b, c) = if angle > 1e-4 {
                ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
            } else {
                (0.5, 1.0 / 6.0)
            };
            let x = rest + u + w.cross(&u) * b + w.cross(&w.cross(&u)) * c;
            out[v] = [x.x as f32, x.y as f32, x.z as f32];
        }
    }
}

fn handle(state: State) -> SwState {
    state.into()
}

fn step(state: &mut SwState) {
    // SAFETY: a live handle.
    assert_eq!(unsafe { sw_state_step(state, FRAME) }, 0);
}

/// The interface's call for positions into rows of `stride` bytes.
fn write_positions(state: &SwState, n: usize, format: u32, stride: u64, out: &mut [u8]) {
    let row = if format == SW_FORMAT_F32 { 12 } else { 24 };
    assert!(out.len() >= n * row.max(stride as usize));
    // SAFETY: a live handle and a buffer of n rows.
    let status =
        unsafe { sw_state_positions(state, SW_SPACE_WORLD, format, out.as_mut_ptr().cast(), stride, n as u32) };
    assert_eq!(status, 0);
}

fn report(state: &SwState) {
    // SAFETY: a report may be zeroed; a live handle.
    unsafe {
        let mut report: SwStateReport = std::mem::zeroed();
        sw_state_report_init(&mut report);
        assert_eq!(sw_state_report(state, &mut report), 0);
        black_box(report);
    }
}

/// A state whose frame is turned and away from the origin.
fn turned(model: &Arc<Model>) -> State {
    let mut state = scene::moving(model, Method::Warp);
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.3, -0.2, 0.9));
    state.set_frame(Pose { origin: Vec3::new(1.0, 2.0, 3.0), rotation }, Motion::Teleport);
    state.step(FRAME).expect("a step");
    state
}

/// A state held at one vertex.
fn held(model: &Arc<Model>) -> State {
    let mut state = scene::moving(model, Method::Warp);
    let vertex = (model.shell.mass.len() / 2) as u32;
    let mut x = Vec3::zeros();
    state.positions(Space::World, |v, at| {
        if v == vertex as usize {
            x = at
        }
    });
    let target = Target::Position(x);
    state.set_constraint(Constraint { id: 0, vertex, axes: [true; 3], compliance: 0.0, target }).expect("a vertex");
    state
}

/// All kernels on one model: (name, least seconds).
fn race(n: usize, modes: usize) -> Vec<(&'static str, f64)> {
    let model = scene::model(n, modes, Precision::F32);
    let blocks = n.div_ceil(16);
    let floats: Vec<f32> = (0..16 * (4 + 6 * modes) * blocks).map(|k| (k % 7) as f32).collect();
    let (mut out, mut bytes) = (vec![0f32; 48 * blocks], vec![0u8; 32 * n]);
    let (mut bytes64, mut bytes_turned, mut maya) = (bytes.clone(), bytes.clone(), bytes.clone());
    let mut bytes16 = bytes.clone();
    let quantized = scene::model(n, modes, Precision::I16);
    let naive = (n * modes <= 2_000_000).then(|| (Naive::new(&model), vec![[0f32; 3]; n]));
    let (mut lma, mut warp, mut work) = (
        handle(scene::moving(&model, Method::LinearModalAnalysis)),
        handle(scene::moving(&model, Method::Warp)),
        handle(scene::moving(&model, Method::VirtualWorkWarp)),
    );
    let (mut warp16, mut work16) =
        (handle(scene::moving(&quantized, Method::Warp)), handle(scene::moving(&quantized, Method::VirtualWorkWarp)));
    let still16 = handle(scene::moving(&quantized, Method::Warp));
    let still = scene::moving(&model, Method::Warp);
    let q = still.amplitudes().expect("modal").0.to_vec();
    let (still, turned, mut held) = (handle(still), handle(turned(&model)), handle(held(&model)));
    let (arch, block) = (Arch::new(), 16 * (4 + 6 * modes));
    let floats = &floats[..];
    let mut all = vec![
        Contestant::new("read", || arch.dispatch(Stream { basis: black_box(floats), block, out: None })),
        Contestant::new("read + write", || {
            arch.dispatch(Stream { basis: black_box(floats), block, out: Some(&mut out) });
            black_box(&out);
        }),
        Contestant::new("step, LMA", || step(&mut lma)),
        Contestant::new("step, warp", || step(&mut warp)),
        Contestant::new("step, virtual work", || step(&mut work)),
        Contestant::new("step, warp, 1 handle", || step(&mut held)),
        Contestant::new("positions, f32", || write_positions(&still, n, SW_FORMAT_F32, 0, &mut bytes)),
        Contestant::new("positions, f32, turned", || write_positions(&turned, n, SW_FORMAT_F32, 0, &mut bytes_turned)),
        Contestant::new("positions, f64", || write_positions(&still, n, SW_FORMAT_F64, 0, &mut bytes64)),
        Contestant::new("positions, f64, stride 32", || write_positions(&still, n, SW_FORMAT_F64, 32, &mut maya)),
        Contestant::new("step, warp, i16", || step(&mut warp16)),
        Contestant::new("step, virtual work, i16", || step(&mut work16)),
        Contestant::new("positions, f32, i16", || write_positions(&still16, n, SW_FORMAT_F32, 0, &mut bytes16)),
        Contestant::new("report", || report(&still)),
    ];
    if let Some((naive, mut out)) = naive {
        all.push(Contestant::new("naive f64 positions", move || {
            naive.positions(black_box(&q), &mut out);
            black_box(&out);
        }));
    }
    measure(&mut all);
    all.into_iter().map(|one| (one.name, one.best)).collect()
}

/// One table: a row for each kernel, a column for each size; ns per vertex and the ratio to the kernel's floor.
fn table(title: &str, sizes: &[(usize, usize)]) {
    let columns: Vec<_> = sizes.iter().map(|&(n, modes)| (n, race(n, modes))).collect();
    println!("\n{title}\n");
    println!(
        "| ns per vertex (× floor) |{}",
        sizes.iter().map(|(n, m)| format!(" n = {n}, m = {m} |")).collect::<String>()
    );
    println!("| --- |{}", " --- |".repeat(sizes.len()));
    let mut names: Vec<&str> = vec![];
    for (name, _) in columns.iter().flat_map(|(_, row)| row) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    for name in names {
        print!("| {name} |");
        for (n, results) in &columns {
            let of = |name: &str| results.iter().find(|(other, _)| *other == name).map(|(_, seconds)| *seconds);
            let floor = of(if name.contains("positions") { "read + write" } else { "read" });
            match (of(name), floor) {
                (Some(seconds), Some(floor)) => print!(" {:.2} ({:.2}) |", seconds * 1e9 / *n as f64, seconds / floor),
                _ => print!(" |"),
            }
        }
        println!();
    }
    let rate = |(n, row): &(usize, Vec<(&str, f64)>), modes: usize| (n * 4 * (4 + 6 * modes)) as f64 / row[0].1 / 1e9;
    print!("| `read` in GB/s |");
    columns.iter().zip(sizes).for_each(|(column, (_, modes))| print!(" {:.1} |", rate(column, *modes)));
    println!();
}

/// States in one call and one by one. Switching the number of threads ends them; the untimed call makes them anew.
fn step_many(states: &[*mut SwState], threads: u32) {
    // SAFETY: live handles.
    unsafe {
        assert_eq!(sw_set_threads(threads), 0);
        assert_eq!(sw_states_step(states.as_ptr(), states.len() as u32, FRAME, std::ptr::null_mut()), 0);
    }
}

/// A contestant that steps all on so many threads. The threads stay from call to call of one turn.
fn crowd<'a>(name: &'static str, states: &'a [*mut SwState], threads: u32) -> Contestant<'a> {
    let call = move || {
        // SAFETY: live handles.
        let stepped = unsafe { sw_states_step(states.as_ptr(), states.len() as u32, FRAME, std::ptr::null_mut()) };
        assert_eq!(stepped, 0);
    };
    Contestant { before: Box::new(move || step_many(states, threads)), ..Contestant::new(name, call) }
}

/// `count` states of `n` vertices and `modes` modes, on one model or each on its own.
fn many(count: usize, n: usize, modes: usize, shared: bool) {
    let model = scene::model(n, modes, Precision::F32);
    let own = |_| if shared { model.clone() } else { scene::model(n, modes, Precision::F32) };
    let mut states: Vec<SwState> = (0..count).map(own).map(|m| scene::moving(&m, Method::Warp).into()).collect();
    let handles: Vec<*mut SwState> = states.iter_mut().map(std::ptr::from_mut).collect();
    let one_by_one = || {
        for handle in &handles {
            // SAFETY: live handles.
            assert_eq!(unsafe { sw_state_step(*handle, FRAME) }, 0);
        }
    };
    let all = &mut [
        Contestant::new("one by one", one_by_one),
        crowd("one thread", &handles, 1),
        crowd("two threads", &handles, 2),
    ];
    measure(all);
    let [one_by_one, one, two] = all;
    println!(
        "| {count} × {n}, {modes} modes, {} | {:.1} | {:.2} | {:.3} | {:.2} |",
        if shared { "one model" } else { "own models" },
        one.best.recip(),
        one.best * 1e9 / (count * n) as f64,
        one.best / one_by_one.best,
        one.best / two.best,
    );
}

fn many_states(largest: usize) {
    println!("\nMany states by `sw_states_step`, the warp\n");
    println!(
        "| states × vertices | steps/s on one thread | ns per vertex | of the time one by one | faster on two threads |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for count in [1, 2, 8, 32, 64, 128, 1000, 10_000].into_iter().filter(|count| count * 500 <= 5 * largest) {
        many(count, 500, 4, true);
    }
    many(64, 500, 8, true);
    if largest >= 1_000_000 {
        many(10_000, 500, 8, true);
        many(1000, 5000, 4, false);
    }
}

fn main() {
    let largest = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(1_000_000);
    let registers = match Arch::new() {
        Arch::Scalar => "none",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "AVX2",
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "AVX-512",
        _ => "others",
    };
    println!("Registers: {registers}.");
    let sizes = [100, 1000, 13_118, 100_000, 1_000_000];
    table("Over vertices", &sizes.map(|n| (n, 8)).into_iter().filter(|(n, _)| *n <= largest).collect::<Vec<_>>());
    let modes = [1, 2, 4, 8, 16, 50, 100, 200];
    table("Over modes", &modes.map(|m| (13_118.min(largest), m)));
    many_states(largest);
}

//! Nanoseconds per vertex of every run-time kernel through the C interface, beside readings of the basis measured in the same rounds:
//!
//! - `read`: streaming the basis once, as a step must at least;
//! - `read + write`: the same, and writing three floats a vertex, as reading positions must at least;
//! - `naive`: the warp's positions by a plain f64 loop over vertices and modes with nalgebra.
//!
//! And the polynomial shell's energy beside streaming its coefficients once.
//!
//! usage: cargo bench --bench kernels [-- [--docs FILE] [--csv FILE] [LARGEST_N]]     (make bench)
//!
//! Prints its tables; `--docs` puts them in this machine's section of FILE, `--csv` writes every figure.
#![allow(missing_docs, unsafe_code)] // a host's calls across the interface

mod contest;
mod docs;
mod many;
mod polynomial_kernel;
mod scene;

use contest::{Contestant, Naive, Stream, measure};
use nalgebra::UnitQuaternion;
use pulp::Arch;
use scene::FRAME;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::ffi::pointer::{SW_FORMAT_F32, SW_FORMAT_F64};
use shellwarp::ffi::state::{
    SW_SPACE_WORLD, SwState, SwStateReport, sw_state_positions, sw_state_report, sw_state_step,
};
use shellwarp::ffi::structs::Described;
use shellwarp::model::Precision;
use shellwarp::state::{Method, Space, State};
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{Model, Vec3};
use std::fmt::Write;
use std::hint::black_box;
use std::sync::Arc;

fn handle(state: State) -> SwState {
    state.into()
}

/// Lengths of steps, two in turn: a state that a step has left as it was skips further steps of the same length.
#[derive(Default)]
struct Lengths {
    longer: bool,
}

impl Lengths {
    fn next(&mut self) -> f64 {
        self.longer = !self.longer;
        if self.longer { 1.001 * FRAME } else { FRAME }
    }
}

fn step(state: &mut SwState, seconds: f64) {
    // SAFETY: a live handle.
    assert_eq!(unsafe { sw_state_step(state, seconds) }, 0);
}

/// Steps a state of its own.
fn stepping<'a>(name: &'static str, state: State) -> Contestant<'a> {
    let (mut state, mut lengths) = (handle(state), Lengths::default());
    Contestant::new(name, move || step(&mut state, lengths.next()))
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
    let mut report = SwStateReport::initial();
    // SAFETY: a live handle.
    assert_eq!(unsafe { sw_state_report(state, &mut report) }, 0);
    black_box(report);
}

/// A state whose frame is turned and away from the origin.
fn turned(model: &Arc<Model>) -> State {
    let mut state = scene::moving(model, Method::Warp);
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.3, -0.2, 0.9));
    state.set_frame(Pose { origin: Vec3::new(1.0, 2.0, 3.0), rotation }, FrameMotion::Teleport);
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

/// A kernel's time.
struct Time {
    kernel: &'static str,
    vertices: usize,
    modes: usize,
    nanoseconds: f64,
    /// Of its reading of the basis.
    reading: f64,
}

impl Time {
    fn is(&self, kernel: &str, vertices: usize, modes: usize) -> bool {
        (self.kernel, self.vertices, self.modes) == (kernel, vertices, modes)
    }
}

/// All kernels on one model.
fn race(n: usize, modes: usize) -> Vec<Time> {
    let model = |precision| scene::model(n, modes, precision);
    let [single, double, quantized] = [Precision::F32, Precision::F64, Precision::I16].map(model);
    let blocks = n.div_ceil(16);
    let (arch, block) = (Arch::new(), 16 * (4 + 6 * modes));
    let floats: Vec<f32> = (0..block * blocks).map(|k| (k % 7) as f32).collect();
    let floats = &floats[..];
    let mut out = vec![0f32; 48 * blocks];
    let warped = |model: &Arc<Model>| scene::moving(model, Method::Warp);
    let reading = |name, state: State, format, stride| {
        let (state, mut bytes) = (handle(state), vec![0u8; 32 * n]);
        Contestant::new(name, move || write_positions(&state, n, format, stride, &mut bytes))
    };
    let told = handle(warped(&single));
    let mut all = vec![
        Contestant::new("read", || arch.dispatch(Stream { basis: black_box(floats), block, out: None })),
        Contestant::new("read + write", || {
            arch.dispatch(Stream { basis: black_box(floats), block, out: Some(&mut out) });
            black_box(&out);
        }),
        stepping("step, LMA under gravity", scene::moving(&single, Method::LinearModalAnalysis)),
        stepping("step, warp", warped(&single)),
        stepping("step, virtual work", scene::moving(&single, Method::VirtualWorkWarp)),
        stepping("step, warp, 1 handle", held(&single)),
        stepping("step, warp, i16", warped(&quantized)),
        stepping("step, virtual work, i16", scene::moving(&quantized, Method::VirtualWorkWarp)),
        stepping("step, warp, f64 basis", warped(&double)),
        reading("positions, f32", warped(&single), SW_FORMAT_F32, 0),
        reading("positions, f32, turned", turned(&single), SW_FORMAT_F32, 0),
        reading("positions, f64", warped(&single), SW_FORMAT_F64, 0),
        reading("positions, f64, stride 32", warped(&single), SW_FORMAT_F64, 32),
        reading("positions, f32, i16", warped(&quantized), SW_FORMAT_F32, 0),
        reading("positions, f64, f64 basis", warped(&double), SW_FORMAT_F64, 0),
        Contestant::new("report", || report(&told)),
    ];
    if n * modes <= 2_000_000 {
        let (naive, mut out) = (Naive::new(&single), vec![[0f32; 3]; n]);
        let q = warped(&single).amplitudes().expect("modal").0.to_vec();
        all.push(Contestant::new("positions, naive f64", move || {
            naive.positions(black_box(&q), &mut out);
            black_box(&out);
        }));
    }
    measure(&mut all);
    let nanoseconds = |seconds: f64| 1e9 * seconds / n as f64;
    let [read, write] = [0, 1].map(|k: usize| nanoseconds(all[k].best));
    let time = |one: Contestant| Time {
        kernel: one.name,
        vertices: n,
        modes,
        nanoseconds: nanoseconds(one.best),
        reading: if one.name.starts_with("positions") { write } else { read },
    };
    all.into_iter().map(time).collect()
}

/// One table: a row for each kernel, a column for each size; ns per vertex and the ratio to the reading of its basis.
fn table(title: &str, columns: &[Vec<Time>]) -> String {
    let mut text = format!("### {title}\n\n| ns per vertex (× reading) |");
    for column in columns {
        let _ = write!(text, " n = {}, m = {} |", column[0].vertices, column[0].modes);
    }
    let _ = writeln!(text, "\n| --- |{}", " --- |".repeat(columns.len()));
    let longest = columns.iter().max_by_key(|column| column.len()).expect("a column");
    for (k, Time { kernel, .. }) in longest.iter().enumerate() {
        let _ = write!(text, "| {kernel} |");
        for column in columns {
            let cell = |time: &Time| format!(" {:.2} ({:.2}) |", time.nanoseconds, time.nanoseconds / time.reading);
            text += &column.get(k).map_or(" |".to_owned(), cell);
        }
        text += "\n";
    }
    text += "| `read`, GB/s |";
    for Time { modes, nanoseconds, .. } in columns.iter().map(|column| &column[0]) {
        let _ = write!(text, " {:.1} |", (4 * (4 + 6 * modes)) as f64 / nanoseconds);
    }
    text + "\n"
}

/// What was set as a goal for this library, in readings of the basis: on AVX-512, and where that was told on AVX2.
const GOALS: [(&str, usize, usize, &str); 11] = [
    ("positions, f32", 13_118, 4, "1.03; AVX2 1.3–1.4"),
    ("positions, f32", 13_118, 50, "0.9–1.05"),
    ("positions, f32", 1_000_000, 8, "0.95–1.0"),
    ("step, warp", 13_118, 4, "1.4; AVX2 2.0"),
    ("step, warp", 13_118, 50, "1.06; AVX2 1.26"),
    ("step, warp", 1_000_000, 8, "0.9; AVX2 1.15"),
    ("step, virtual work", 13_118, 4, "2.2; AVX2 3.2"),
    ("step, virtual work", 13_118, 50, "1.2; AVX2 1.5"),
    ("step, virtual work", 1_000_000, 8, "1.0"),
    ("positions, f32, i16", 13_118, 4, "1.1"),
    ("positions, f32, i16", 1_000_000, 8, "0.46"),
];

/// The goals beside what was measured now.
fn goals(times: &[Time], batches: &[many::Batch]) -> String {
    let mut text = "### Goals\n\n| what | goal | now |\n| --- | --- | --- |\n".to_owned();
    for (kernel, n, m, goal) in GOALS {
        let found = times.iter().find(|t| t.is(kernel, n, m));
        if let Some(time) = found {
            let now = time.nanoseconds / time.reading;
            let _ = writeln!(text, "| {kernel}, n = {n}, m = {m} | {goal} × reading | {now:.2} |");
        }
    }
    text + &many::goals(batches)
}

fn csv(times: &[Time], batches: &[many::Batch]) -> String {
    let mut text = "kernel,vertices,modes,states,threads,ns_per_vertex,times_reading,goal\n".to_owned();
    for t in times {
        let (ns, ratio) = (t.nanoseconds, t.nanoseconds / t.reading);
        let goal = GOALS.iter().find(|(kernel, n, m, _)| t.is(kernel, *n, *m)).map_or("", |goal| goal.3);
        let _ = writeln!(text, "\"{}\",{},{},1,1,{ns:.4},{ratio:.4},{goal}", t.kernel, t.vertices, t.modes);
    }
    text + &many::csv(batches)
}

struct Options {
    docs: Option<String>,
    csv: Option<String>,
    largest: usize,
}

fn options() -> Options {
    let mut options = Options { docs: None, csv: None, largest: 1_000_000 };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--docs" => options.docs = words.next(),
            "--csv" => options.csv = words.next(),
            word => options.largest = word.parse().unwrap_or(options.largest), // cargo adds --bench
        }
    }
    options
}

fn main() -> std::io::Result<()> {
    let Options { docs, csv: csv_file, largest } = options();
    let before = docs::load();
    let columns = |sizes: &[(usize, usize)]| -> Vec<Vec<Time>> {
        sizes.iter().filter(|size| size.0 <= largest).map(|(n, modes)| race(*n, *modes)).collect()
    };
    let vertices = [100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000];
    let modes = [1, 2, 4, 8, 16, 50, 100, 200];
    let by_vertices = columns(&vertices.map(|n| (n, 8)));
    let by_modes = columns(&modes.map(|m| (13_118.min(largest), m)));
    let batches = many::measure_all(largest);
    let [over_vertices, over_modes] = [table("Over vertices", &by_vertices), table("Over modes", &by_modes)];
    let tables = [over_vertices, over_modes, polynomial_kernel::table(), many::table(&batches)];
    let times: Vec<Time> = by_vertices.into_iter().chain(by_modes).flatten().collect();
    let load = format!("The machine's load was {before} before and {} after; 0 is a quiet one.\n", docs::load());
    let text = format!("## {}\n\n{load}\n{}\n{}", docs::machine(), goals(&times, &batches), tables.join("\n"));
    println!("{text}");
    if let Some(file) = csv_file {
        std::fs::write(file, csv(&times, &batches))?;
    }
    docs.map_or(Ok(()), |file| docs::put_section(&file, &format!("kernels {}", docs::machine()), &text))
}

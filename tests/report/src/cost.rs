//! Where a step's time goes, how it grows, and what precomputing takes. Serial; medians of calls after a warm-up, beside a
//! scale measured in the same run: reading as many bytes as the basis has in a plain loop.

use crate::effort::{Effort, Progress};
use crate::error::quartiles;
use crate::library::{Library, Material, Model, State};
use crate::mesh::Mesh;
use crate::methods::{Family, METHODS, Method, method};
use crate::scenes::FRAME;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use shellwarp::ffi::model::SW_PHASE_COUNT;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// A timed thing: which series, at what size, microseconds, and how many times reading the basis takes.
pub struct Cost {
    pub series: String,
    pub size: usize,
    pub us: f64,
    pub reads: f64,
    /// Vertices times modes times states.
    pub work: usize,
    /// What else there is to say.
    pub note: String,
}

/// The series that is the scale of the others.
pub const READING: &str = "reading the basis";

/// One precompute.
#[derive(Serialize, Deserialize)]
pub struct Precompute {
    pub vertices: usize,
    pub modes: usize,
    /// Of the whole, mesh and model included, seconds.
    pub seconds: f64,
    /// By SW_PHASE_....
    pub phases: Vec<f64>,
    /// MB, estimated by the library.
    pub estimate: f64,
    /// MB that a process of its own grew by at most; none where the system does not tell.
    pub peak: Option<f64>,
    /// Held for the run, MB.
    pub model: f64,
}

/// What the reduced shell costs beside the modes alone.
pub struct Reduced {
    pub vertices: usize,
    pub fields: usize,
    /// Sampled triangles, edges and hinges.
    pub elements: usize,
    /// Of the precompute with the modes alone, and with the fields.
    pub seconds: [f64; 2],
    /// Of a step.
    pub us: f64,
}

/// Names of SW_PHASE_....
pub const PHASES: [&str; 7] = ["assembly", "ordering", "factorization", "modes", "certificate", "rotation", "training"];

const SHEET: Material = Material { area: 1e4, length: 1e4, bend: 1.0, density: 1.0 };

/// A square sheet of about `vertices`.
fn sheet(vertices: usize) -> Mesh {
    let rows = ((vertices as f64).sqrt() * 1.0746).round().max(2.0) as usize; // rows are √3/2 as far apart as columns
    Mesh::strip(1.0, 1.0, rows)
}

/// Median microseconds of a call: at least 30 calls and a tenth of a second, the first tenth for warming up.
fn median_us(mut call: impl FnMut() -> Result<()>) -> Result<f64> {
    let (start, mut seconds) = (Instant::now(), vec![]);
    while seconds.len() < 30 || (start.elapsed().as_secs_f64() < 0.1 && seconds.len() < 20_000) {
        let begin = Instant::now();
        call()?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    Ok(quartiles(&seconds[seconds.len() / 10..])[1] * 1e6)
}

/// Reads an f32 basis of 6 numbers per vertex and mode, as a step has to at least.
fn reading_us(vertices: usize, modes: usize) -> Result<f64> {
    let basis: Vec<f32> = (0..6 * vertices * modes).map(|k| (k % 7) as f32).collect();
    median_us(|| {
        let mut sums = [0f32; 64];
        for chunk in black_box(&basis).chunks_exact(64) {
            (0..64).for_each(|i| sums[i] += chunk[i]);
        }
        black_box(sums);
        Ok(())
    })
}

/// A moving state.
fn moving(model: &Model, key: &str) -> Result<State> {
    let mut state = model.state(method(key).method, method(key).integrator)?;
    state.set_gravity([0.0, 0.0, -1.0])?;
    state.set_mass_damping(1.0)?;
    (0..5).try_for_each(|_| state.step(FRAME))?;
    Ok(state)
}

/// Median microseconds of a call with the length of a step. Lengths alternate: a state that a step has left as it was skips
/// further steps of the same length.
fn median_step_us(mut step: impl FnMut(f64) -> Result<()>) -> Result<f64> {
    let mut lengths = [FRAME, 1.001 * FRAME].into_iter().cycle();
    median_us(|| step(lengths.next().unwrap_or(FRAME)))
}

fn step_us(model: &Model, key: &str) -> Result<f64> {
    let mut state = moving(model, key)?;
    median_step_us(|h| state.step(h))
}

/// The parts of a frame, taken apart from outside: differences of calls that do more and less.
pub fn parts(library: &Library, vertices: usize, modes: usize) -> Result<Vec<Cost>> {
    let mesh = sheet(vertices);
    let n = mesh.positions.len();
    let model = library.model(&mesh, SHEET, &mesh.root(), modes, false)?;
    let tiny = Mesh::strip(4.0, 0.8, 4);
    let few = library.model(&tiny, SHEET, &tiny.root(), modes, false)?;
    let reading = reading_us(n, modes)?;
    let update = step_us(&few, "lma_implicit")?;
    let (lma, warp) = (step_us(&model, "lma_implicit")?, step_us(&model, "warp_implicit")?);
    let state = moving(&model, "warp_implicit")?;
    let (mut points, mut turns) = (vec![[0f32; 3]; n], vec![[0f32; 4]; n]);
    let positions = median_us(|| state.write_f32(&mut points))?;
    let normals = median_us(|| state.write_normals(&mut points))?;
    let rotations = median_us(|| state.write_rotations(&mut turns))?;
    let report = median_us(|| state.report().map(|_| ()))?;
    let copy = {
        let from = vec![[0f32; 3]; n];
        median_us(|| {
            black_box(&mut points).copy_from_slice(black_box(&from));
            Ok(())
        })?
    };
    let end = mesh.vertices_where(|_, p| p[0] > mesh.length() - 1e-9);
    let mut held = moving(&model, "warp_implicit")?;
    held.hold(0, end[end.len() / 2], 4, mesh.positions[end[end.len() / 2] as usize])?;
    let constrained = median_step_us(|h| held.step(h))?;
    let parts = [
        ("modal update (a step of a mesh of 90 vertices)", update),
        ("projection of loads (the step of linear modes, less the update)", lma - update),
        ("modal rotation and turned projection (the warp's step, less that of linear modes)", warp - lma),
        ("reconstruction (positions, less copying them)", positions - copy),
        ("output (copying positions)", copy),
        ("one constraint (a step with it, less one without)", constrained - warp),
        ("normals, where asked for", normals),
        ("vertex rotations, where asked for", rotations),
        ("energy report, where asked for", report),
    ];
    // Differences of times that are too small to tell come out at or below nothing.
    let cost = |(series, us): (&str, f64)| {
        let us = us.max(0.0);
        Cost { series: series.to_owned(), size: n, us, reads: us / reading, work: n * modes, note: String::new() }
    };
    Ok(parts.map(cost).into())
}

/// How a step and reading the positions grow with vertices, modes, constraints and instances.
pub fn growth(library: &Library, effort: Effort, progress: &mut Progress) -> Result<Vec<Cost>> {
    let mut all = vec![];
    let sizes: &[usize] = match effort {
        Effort::Full => &[100, 300, 1000, 3000, 10_000, 30_000, 100_000],
        Effort::Quick => &[100, 1000, 10_000],
        Effort::Smoke => &[100],
    };
    for &size in sizes {
        progress.say(&format!("steps of {size} vertices"));
        let mesh = sheet(size);
        let n = mesh.positions.len();
        let model = library.model(&mesh, SHEET, &mesh.root(), 8, false)?;
        let mut put = |series: &str, us: f64, reading: f64| {
            let series = format!("vertices: {series}");
            all.push(Cost { series, size: n, us, reads: us / reading, work: 8 * n, note: String::new() });
        };
        let reading = reading_us(n, 8)?;
        put("step, linear modes", step_us(&model, "lma_implicit")?, reading);
        put("step, warp", step_us(&model, "warp_implicit")?, reading);
        let (state, mut points) = (moving(&model, "warp_implicit")?, vec![[0f32; 3]; n]);
        put("positions, warp", median_us(|| state.write_f32(&mut points))?, reading);
        put(READING, reading, reading);
    }
    let mesh = sheet(if effort == Effort::Smoke { 300 } else { 3000 });
    if effort != Effort::Smoke {
        over_modes(library, &mesh, progress, &mut all)?;
    }
    let model = library.model(&mesh, SHEET, &mesh.root(), 16, false)?;
    over_constraints(&model, 16, &mesh, &mut all)?;
    over_constraints(&library.model(&mesh, SHEET, &mesh.root(), 32, false)?, 32, &mesh, &mut all)?;
    if effort == Effort::Smoke {
        return Ok(all);
    }
    let reading = reading_us(mesh.positions.len(), 16)?;
    for count in [1, 4, 16, 64] {
        let mut states = (0..count).map(|_| moving(&model, "warp_implicit")).collect::<Result<Vec<_>>>()?;
        let us = median_step_us(|h| states.iter_mut().try_for_each(|s| s.step(h)))?;
        all.push(Cost {
            series: "instances: step of all, warp".to_owned(),
            size: count,
            us,
            reads: us / reading / count as f64,
            work: mesh.positions.len() * 16 * count,
            note: String::new(),
        });
    }
    Ok(all)
}

fn over_modes(library: &Library, mesh: &Mesh, progress: &mut Progress, all: &mut Vec<Cost>) -> Result<()> {
    let n = mesh.positions.len();
    for modes in [1, 2, 4, 8, 16, 32, 64, 128, 200] {
        progress.say(&format!("steps of {modes} modes"));
        let model = library.model(mesh, SHEET, &mesh.root(), modes, false)?;
        let reading = reading_us(n, modes)?;
        let (state, mut points) = (moving(&model, "warp_implicit")?, vec![[0f32; 3]; n]);
        let positions = median_us(|| state.write_f32(&mut points))?;
        for (series, us) in
            [("step, warp", step_us(&model, "warp_implicit")?), ("positions, warp", positions), (READING, reading)]
        {
            let series = format!("modes: {series}");
            all.push(Cost { series, size: modes, us, reads: us / reading, work: n * modes, note: String::new() });
        }
    }
    Ok(())
}

/// Vertices along the free end of a sheet, held in height.
fn over_constraints(model: &Model, modes: usize, mesh: &Mesh, all: &mut Vec<Cost>) -> Result<()> {
    let n = mesh.positions.len();
    let reading = reading_us(n, modes)?;
    let end = mesh.vertices_where(|_, p| p[0] > mesh.length() - 1e-9);
    for count in [0, 1, 2, 4, 8, 16] {
        let mut state = moving(model, "warp_implicit")?;
        for k in 0..count {
            let v = end[k * (end.len() - 1) / count];
            state.hold(k as u32, v, 4, mesh.positions[v as usize])?;
        }
        let us = median_step_us(|h| state.step(h))?;
        let note = match state.constraints_met()? {
            _ if count == 0 => String::new(),
            (true, searches) => format!("met, {searches} linearizations"),
            (false, searches) => format!("not all met, {searches} linearizations"),
        };
        let series = format!("constraints: step, warp of {modes} modes");
        all.push(Cost { series, size: count, us, reads: us / reading, work: n * modes, note });
    }
    Ok(())
}

/// The reduced shells of the table of methods, over vertices.
pub fn reduced(library: &Library, effort: Effort, progress: &mut Progress) -> Result<Vec<Reduced>> {
    let sizes: &[usize] = match effort {
        Effort::Full => &[300, 1000, 3000, 13_000],
        Effort::Quick => &[300, 1000],
        Effort::Smoke => &[100],
    };
    let methods: Vec<&Method> = METHODS.iter().filter(|m| m.family == Family::Reduced).collect();
    let mut all = vec![];
    for (&size, method) in sizes.iter().flat_map(|size| methods.iter().map(move |m| (size, m))) {
        progress.say(&format!("{} on {size} vertices", method.label));
        let mesh = sheet(size);
        let timed = |fields: u32| -> Result<(Model, f64)> {
            let start = Instant::now();
            let model = library.reduced_model(&mesh, SHEET, &mesh.root(), 8, false, fields)?;
            Ok((model, start.elapsed().as_secs_f64()))
        };
        let alone = timed(0)?.1;
        let (model, seconds) = timed(method.fields)?;
        let info = model.info()?;
        all.push(Reduced {
            vertices: mesh.positions.len(),
            fields: info.reduced_fields as usize,
            elements: info.reduced_elements as usize,
            seconds: [alone, seconds],
            us: step_us(&model, method.key)?,
        });
    }
    Ok(all)
}

/// Microseconds of a frame of 1/30 s, one step and reading the positions, of a falling sheet held along one side.
pub fn sheet_frames(library: &Library, vertices: usize) -> Result<Vec<(&'static str, usize, f64)>> {
    let mesh = sheet(vertices);
    let mut all = vec![];
    for key in ["warp_implicit", "virtual_work_implicit", "reduced_40", "shell_implicit"] {
        let m = method(key);
        let model = library.reduced_model(&mesh, SHEET, &mesh.root(), 8, false, m.fields)?;
        let mut state = model.state(m.method, m.integrator)?;
        state.set_gravity([0.0, 0.0, -1.0])?;
        let mut host = vec![[0f32; 3]; mesh.positions.len()];
        let mut seconds = vec![];
        for _ in 0..if m.family == Family::Shell { 5 } else { 100 } {
            let start = Instant::now();
            state.step(FRAME)?;
            state.write_f32(&mut host)?;
            seconds.push(start.elapsed().as_secs_f64());
        }
        all.push((m.label, mesh.positions.len(), quartiles(&seconds)[1] * 1e6));
    }
    Ok(all)
}

/// A line of the process's state, MB; `None` where the system does not tell.
fn memory(what: &str) -> Option<f64> {
    megabytes(&std::fs::read_to_string("/proc/self/status").ok()?, what)
}

fn megabytes(text: &str, what: &str) -> Option<f64> {
    let line = text.lines().find(|l| l.starts_with(what))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

fn available_megabytes() -> f64 {
    std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| megabytes(&text, "MemAvailable")).unwrap_or(0.0)
}

/// Up to 10⁵ vertices, and on by doubling while the next is foreseen to fit half the memory and a minute. Each in a process of its
/// own: what an earlier one has freed would hide the memory that the next one takes.
pub fn precompute(library: &Path, effort: Effort, progress: &mut Progress) -> Result<Vec<Precompute>> {
    let sizes: &[usize] = match effort {
        Effort::Full => &[1000, 3000, 10_000, 30_000, 100_000, 200_000, 400_000, 800_000, 1_600_000],
        Effort::Quick => &[1000, 3000, 10_000],
        Effort::Smoke => &[1000],
    };
    let mut all: Vec<Precompute> = vec![];
    for &size in sizes {
        if let Some(last) = all.last().filter(|_| size > 100_000) {
            // Nested dissection's work and fill grow as n^1.5 and n log n.
            let held = last.peak.unwrap_or(0.0).max(last.estimate);
            if last.seconds * 2.9 > 60.0 || held * 2.4 > 0.5 * available_megabytes() {
                break;
            }
        }
        progress.say(&format!("precomputing {size} vertices"));
        let mut again = Command::new(std::env::current_exe()?);
        again.arg("--library").arg(library).args(["--precompute", &size.to_string()]);
        let done = again.stderr(Stdio::inherit()).output()?;
        all.push(serde_json::from_slice(&done.stdout).with_context(|| format!("precomputing {size} vertices"))?);
    }
    Ok(all)
}

/// One of these, in this process.
pub fn precompute_once(library: &Library, size: usize) -> Result<Precompute> {
    let mesh = sheet(size);
    let root = mesh.root();
    let before = memory("VmRSS");
    let start = Instant::now();
    let model = library.model(&mesh, SHEET, &root, 16, false)?;
    let seconds = start.elapsed().as_secs_f64();
    let info = model.info()?;
    Ok(Precompute {
        vertices: mesh.positions.len(),
        modes: info.modes as usize,
        seconds,
        phases: info.seconds[..SW_PHASE_COUNT].to_vec(),
        estimate: info.bytes_precompute_peak as f64 / 1e6,
        peak: memory("VmHWM").zip(before).map(|(most, before)| most - before),
        model: info.bytes_model as f64 / 1e6,
    })
}

//! Precomputes the dinosaur of tests/scenes and writes what another eigensolver needs to do the same: K and M in Matrix
//! Market form. Prints one line of JSON: seconds of each run, eigenvalues, certificate.
//!
//! With `table` it prints where the time goes on sheets and on the dinosaur instead, the run of least time of each, and with
//! `--docs` puts that in this machine's section of FILE.
//!
//! usage: precompute MODES RUNS OUTPUT_DIRECTORY
//!        precompute table RUNS VERTICES... [--docs FILE]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod docs;

use shellwarp::model::{Model, Options};
use shellwarp::modes::{ScaledStiffness, entries};
use shellwarp::{Material, Mesh, Shell, Supports};
use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The shell of tests/scenes/dinosaur.toml.
fn dinosaur() -> Shell {
    let (positions, triangles) = common::read_obj("dinosaur.obj");
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].y <= 0.02).collect();
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

fn write_matrices(shell: &Shell, directory: &Path) -> std::io::Result<()> {
    let scaled = ScaledStiffness::assemble(shell).unwrap();
    let root = &scaled.root_mass;
    let n = root.len();
    let mut k = BufWriter::new(std::fs::File::create(directory.join("K.mtx"))?);
    writeln!(k, "%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}", scaled.lower.val().len())?;
    for (i, j, a) in entries(&scaled.lower) {
        writeln!(k, "{} {} {:e}", i + 1, j + 1, root[i] * a * root[j])?;
    }
    let mut m = BufWriter::new(std::fs::File::create(directory.join("M.mtx"))?);
    writeln!(m, "%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {n}")?;
    for (i, r) in root.iter().enumerate() {
        writeln!(m, "{} {} {:e}", i + 1, i + 1, r * r)?;
    }
    Ok(())
}

/// A flat sheet of about `n` vertices, held along one end.
fn sheet(n: usize) -> Shell {
    let rows = (n as f64 / 1.5).sqrt().round() as usize;
    let edge = 1.0 / rows as f64;
    let (positions, triangles) = common::equilateral_sheet(n / (rows + 1), rows, edge);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x <= 1.01 * edge).collect();
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// Seconds from positions and triangles to a model, the model, and the longest time without a call for progress.
fn precompute(make: &dyn Fn() -> Shell, modes: usize) -> (f64, Model, f64) {
    let start = Instant::now();
    let shell = Arc::new(make());
    let options = Options { modes, ..Options::default() };
    let (mut last, mut silence) = (Instant::now(), 0.0f64);
    let mut hear = |_, _| {
        silence = silence.max(last.elapsed().as_secs_f64());
        last = Instant::now();
        Ok(())
    };
    let model = Model::precompute(shell, &options, &mut hear).unwrap();
    (start.elapsed().as_secs_f64(), model, silence)
}

/// The most memory that the process has held since [`forget_peak`], MB; 0 where the system does not tell.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<f64>().ok()).unwrap_or(0.0) * 1024e-6
}

fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// A row for each size and number of modes; beyond half a million vertices, where each takes many minutes, for 4 modes alone.
fn table(runs: usize, sizes: &[usize]) -> String {
    let mut text = "| shell | vertices | modes | mesh, ms | assembly | ordering | factorization | modes | certificate | rotation | total, ms \
         | total / factorization | longest silence, ms | peak, MB: foreseen | held |\n"
        .to_owned();
    let _ = writeln!(text, "|{}", " --- |".repeat(15));
    for &n in sizes {
        let is_dinosaur = n == 13_117;
        let make = || if is_dinosaur { dinosaur() } else { sheet(n) };
        let modes = if n > 500_000 { &[4][..] } else { &[4, 8, 32] };
        for &modes in modes {
            forget_peak();
            let all = (0..runs).map(|_| precompute(&make, modes));
            let (seconds, model, silence) = all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let ms = |s: f64| format!("{:.1}", 1e3 * s);
            let phases = model.seconds.map(ms).join(" | ");
            let mesh = ms(seconds - model.seconds.iter().sum::<f64>());
            let name = if is_dinosaur { "dinosaur" } else { "sheet" };
            let (total, ratio) = (ms(seconds), seconds / model.seconds[2]);
            let (vertices, foreseen) = (model.shell.mass.len(), model.peak_bytes as f64 * 1e-6);
            let _ = writeln!(
                text,
                "| {name} | {vertices} | {modes} | {mesh} | {phases} | {total} | {ratio:.1} | {} | {foreseen:.0} | {:.0} |",
                ms(silence),
                peak()
            );
        }
    }
    text
}

fn print_table(runs: usize, words: &[String]) {
    let sizes: Vec<usize> = words.iter().map_while(|word| word.parse().ok()).collect();
    let before = docs::load();
    let table = table(runs, &sizes);
    let (machine, after) = (docs::machine(), docs::load());
    let text = format!("## On {machine}\n\nThe machine's load was {before} before and {after} after.\n\n{table}");
    println!("{text}");
    if let [docs, file] = &words[sizes.len()..]
        && docs == "--docs"
    {
        docs::put_section(file, &format!("precompute {machine}"), &text).unwrap();
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, table, runs, words @ ..] = &arguments[..]
        && table == "table"
    {
        return print_table(runs.parse().unwrap(), words);
    }
    let [_, modes, runs, directory] = &arguments[..] else { panic!("usage: precompute MODES RUNS OUTPUT_DIRECTORY") };
    let options = Options { modes: modes.parse().unwrap(), ..Options::default() };
    let (mut seconds, mut model) = (vec![], None);
    for _ in 0..runs.parse().unwrap() {
        let start = Instant::now();
        let shell = Arc::new(dinosaur());
        model = Some(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap());
        seconds.push(start.elapsed().as_secs_f64());
    }
    let model = model.unwrap();
    write_matrices(&model.shell, Path::new(directory)).unwrap();
    let report = serde_json::json!({
        "seconds": seconds,
        "phases": model.seconds,
        "eigenvalues": model.modal.eigenvalues,
        "unknowns": model.shell.n_unknowns(),
        "machine": docs::machine(),
    });
    println!("{report}");
}

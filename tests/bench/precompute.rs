//! Precomputes the dinosaur of tests/scenes and writes what another eigensolver needs to do the same: K and M in Matrix
//! Market form. Prints one line of JSON: seconds of each run, eigenvalues, certificate.
//!
//! With `table` it prints the table of docs/speed.md instead: where the time goes on sheets and on the dinosaur, the run of least
//! time of each.
//!
//! usage: precompute MODES RUNS OUTPUT_DIRECTORY
//!        precompute table RUNS VERTICES...
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

use shellwarp::model::{Model, Options};
use shellwarp::modes::{ScaledStiffness, entries};
use shellwarp::{Material, Mesh, Shell, Supports};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The shell of tests/scenes/dinosaur.toml.
fn dinosaur() -> Shell {
    let (positions, triangles) = common::read_obj("dinosaur.obj");
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].y <= 0.02).collect();
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, clamped: vec![] }).unwrap()
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
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, clamped: vec![] }).unwrap()
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

fn print_table(runs: usize, sizes: &[usize]) {
    println!(
        "| shell | vertices | modes | mesh, ms | assembly | ordering | factorization | modes | certificate | rotation | total, ms \
         | total / factorization | longest silence, ms | peak, MB |"
    );
    println!("|{}", " --- |".repeat(14));
    for &n in sizes {
        let is_dinosaur = n == 13_117;
        let make = || if is_dinosaur { dinosaur() } else { sheet(n) };
        for modes in [4, 8, 32] {
            let all = (0..runs).map(|_| precompute(&make, modes));
            let (seconds, model, silence) = all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let ms = |s: f64| format!("{:.1}", 1e3 * s);
            let phases = model.seconds.map(ms).join(" | ");
            let mesh = ms(seconds - model.seconds.iter().sum::<f64>());
            let name = if is_dinosaur { "dinosaur" } else { "sheet" };
            let (total, ratio) = (ms(seconds), seconds / model.seconds[2]);
            let (vertices, peak) = (model.shell.mass.len(), model.peak_bytes as f64 * 1e-6);
            println!(
                "| {name} | {vertices} | {modes} | {mesh} | {phases} | {total} | {ratio:.1} | {} | {peak:.0} |",
                ms(silence)
            );
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, table, runs, sizes @ ..] = &arguments[..]
        && table == "table"
    {
        let sizes: Vec<usize> = sizes.iter().map(|n| n.parse().unwrap()).collect();
        return print_table(runs.parse().unwrap(), &sizes);
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
        "eigenvalues": model.eigenvalues,
        "unknowns": model.shell.n_unknowns(),
    });
    println!("{report}");
}

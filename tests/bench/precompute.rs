//! Precomputes the dinosaur of tests/scenes and writes what another eigensolver needs to do the same: K and M in Matrix
//! Market form. Prints one line of JSON: seconds of each run, eigenvalues, certificate.
//!
//! usage: precompute MODES RUNS OUTPUT_DIRECTORY
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

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
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

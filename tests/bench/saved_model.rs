//! Times saving and loading a model against copying its bytes: `cargo run --release --example saved_model [MODES]`.
#![allow(missing_docs)]

use shellwarp::model::{Model, Options, Precision};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

fn read_obj(path: &str) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for line in std::fs::read_to_string(path).expect("the mesh").lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => positions.push(Vec3::from_fn(|i, _| words[i + 1].parse().expect("a number"))),
            Some(&"f") => triangles.push([1, 2, 3].map(|i| words[i].parse::<u32>().expect("an index") - 1)),
            _ => {}
        }
    }
    (positions, triangles)
}

/// The least of some runs, ms.
fn best<T>(mut run: impl FnMut() -> T) -> f64 {
    let time = |_| {
        let start = Instant::now();
        black_box(run());
        1e3 * start.elapsed().as_secs_f64()
    };
    (0..15).map(time).fold(f64::INFINITY, f64::min)
}

fn main() {
    let modes = std::env::args().nth(1).map_or(16, |m| m.parse().expect("a number of modes"));
    let (positions, triangles) = read_obj(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/meshes/dinosaur.obj"));
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].y < 1.0).collect();
    let mesh = Mesh::new(positions.clone(), &triangles).expect("a good mesh");
    let shell = Shell::new(mesh, Material::default(), &Supports { fixed, ..Default::default() }).expect("a good shell");
    let start = Instant::now();
    let options = Options { modes, precision: Precision::F32, ..Options::default() };
    let model = Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).expect("modes");
    let precompute = 1e3 * start.elapsed().as_secs_f64();
    let bytes = model.save().expect("bytes");
    let (copy, save) = (best(|| bytes.clone()), best(|| model.save()));
    let load = best(|| Model::load(&bytes).map(|m| m.fingerprint));
    let mesh = best(|| Mesh::new(positions.clone(), &triangles).map(|m| m.size));
    let size = bytes.len() as f64 / 1048576.0;
    println!("dinosaur, {modes} modes, {size:.1} MiB: precompute {precompute:.0} ms");
    println!(
        "copying the bytes {copy:.2} ms, saving {save:.2} ms, loading {load:.2} ms, of that the mesh {mesh:.2} ms"
    );
}

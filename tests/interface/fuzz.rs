//! The fuzz targets on stable Rust: every input of the kept corpus, then a short random run from a fixed seed. What the targets
//! check is in tests/fuzz/src; `make fuzz` searches on.

#[path = "../fuzz/src/lib.rs"]
mod fuzzed;

use rand::{Rng, SeedableRng, rngs::StdRng};
use std::path::Path;

/// Runs the corpus of `name`, then `random` inputs.
fn replay(name: &str, target: fn(&[u8]), random: usize) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{}: no corpus", folder.display());
    for file in files {
        println!("{}", file.display()); // shown when it fails
        target(&std::fs::read(&file).unwrap());
    }
    let mut random_bytes = StdRng::seed_from_u64(1);
    for k in 0..random {
        let mut bytes = vec![0; random_bytes.random_range(0..400)];
        random_bytes.fill(&mut bytes[..]);
        println!("random input {k}");
        target(&bytes);
    }
}

#[test]
fn no_mesh_material_or_supports_break_the_library() {
    replay("mesh", fuzzed::mesh::run, 3000);
}

#[test]
fn no_asset_breaks_the_proxy() {
    replay("proxy", fuzzed::proxy::run, 1500);
}

#[test]
fn no_maps_creases_and_rest_shapes_break_the_library() {
    replay("material", fuzzed::material::run, 3000);
}

#[test]
fn no_saved_bytes_break_the_library() {
    replay("saved", fuzzed::saved::run, 20000);
}

#[test]
fn no_colliders_and_no_bound_points_break_the_library() {
    replay("contact", fuzzed::contact::run, 800);
}

#[test]
fn no_sequence_of_calls_breaks_the_library() {
    replay("calls", fuzzed::calls::run, 2000);
}

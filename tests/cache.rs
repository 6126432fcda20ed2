//! Saved models: the same bits after loading, old files stay readable, and no bytes do harm.
#![allow(missing_docs)]
mod common;
use common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{Motion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

fn precomputed(shell: Shell, modes: usize, precision: Precision) -> Model {
    Model::precompute(Arc::new(shell), &Options { modes, precision, ..Options::default() }, &mut |_, _| Ok(())).unwrap()
}

/// A small sheet with a turned triangle, a vertex of no triangle, and one clamped corner.
fn small_model(precision: Precision) -> Model {
    let (mut positions, mut triangles) = equilateral_sheet(3, 2, 0.25);
    positions.push(Vec3::new(9.0, 9.0, 9.0));
    triangles[4].swap(0, 1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let supports = Supports { fixed: vec![1], clamped: vec![0] };
    let material = Material { k_bend: 0.5, ..Material::default() };
    precomputed(Shell::new(mesh, material, &supports).unwrap(), 4, precision)
}

/// What a run on the model shows: saved states, positions and reports of every method, with handles, a moving frame and an
/// equilibrium.
fn run(model: &Arc<Model>) -> Vec<Vec<u8>> {
    let mut seen = vec![];
    let methods = [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis, Method::ImplicitShell];
    for method in methods {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.2, -0.5)).unwrap();
        let vertex = model.shell.free[model.shell.free.len() - 1];
        let target = Target::Position(model.shell.mesh.positions[vertex as usize] + Vec3::z() * 0.05);
        let handle = Constraint { id: 1, vertex, axes: [false, false, true], compliance: 0.0, target };
        for k in 0..8 {
            if method != Method::ImplicitShell && k == 4 {
                state.set_constraint(handle).unwrap();
            }
            let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.01, 0.02, 0.0) * f64::from(k));
            state.set_frame(Pose { origin: Vec3::x() * 0.01 * f64::from(k * k), rotation }, Motion::Continuous);
            state.step(0.01).unwrap();
            seen.push(state.save());
        }
        state.constraints().for_each(|(_, outcome)| seen.push(format!("{outcome:?}").into_bytes()));
        state.clear_constraints();
        seen.push(format!("{:?}", state.equilibrium().unwrap()).into_bytes());
        state.positions(Space::World, |_, x| seen.push(x.iter().flat_map(|x| x.to_le_bytes()).collect()));
        seen.push(format!("{:?}", state.report()).into_bytes());
    }
    seen
}

#[test]
fn a_loaded_model_runs_with_the_same_bits() {
    for precision in [Precision::F32, Precision::F64] {
        for original in [small_model(precision), precomputed(reference("v_beam").0, 8, precision)] {
            let bytes = original.save().unwrap();
            assert_eq!(bytes.len(), original.saved_size());
            let loaded = Model::load(&bytes).unwrap();
            assert_eq!(loaded.save().unwrap(), bytes);
            assert_eq!(loaded.fingerprint, original.fingerprint);
            assert_eq!(loaded.shell.mass, original.shell.mass);
            assert_eq!(loaded.shell.free, original.shell.free);
            assert_eq!(format!("{:?}", loaded.shell.mesh), format!("{:?}", original.shell.mesh));
            assert_eq!(loaded.bytes(), original.bytes());
            assert!(run(&Arc::new(loaded)) == run(&Arc::new(original)), "{precision:?}");
        }
    }
}

#[test]
fn a_model_without_modes_comes_back_too() {
    let mesh = Mesh::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()], &[[0, 1, 2]]).unwrap();
    let supports = Supports { fixed: vec![0, 1, 2], clamped: vec![] };
    let model = precomputed(Shell::new(mesh, Material::default(), &supports).unwrap(), 4, Precision::F32);
    assert_eq!(model.n_modes(), 0);
    let bytes = model.save().unwrap();
    assert_eq!(Model::load(&bytes).unwrap().save().unwrap(), bytes);
}

/// Files of earlier versions are never written anew; a new version adds its own. `cargo test --release --test cache --
/// --ignored write_golden` wrote these.
const GOLDEN: [(&str, Precision); 2] =
    [("saved/model_v1_f32.bin", Precision::F32), ("saved/model_v1_f64.bin", Precision::F64)];

#[test]
fn models_saved_by_every_version_still_load() {
    for (name, precision) in GOLDEN {
        let bytes = std::fs::read(data(name)).unwrap();
        let model = Model::load(&bytes).unwrap();
        assert_eq!(model.save().unwrap(), bytes, "{name}: the present version is the file's");
        assert_eq!((model.precision(), model.n_modes(), model.shell.mesh.n_reoriented), (precision, 4, 1), "{name}");
        let fresh = small_model(precision);
        assert_eq!(model.shell.held, fresh.shell.held);
        assert_eq!(model.shell.mesh.positions, fresh.shell.mesh.positions);
        for (old, new) in model.eigenvalues.iter().zip(&fresh.eigenvalues) {
            // A dense problem of condition 1e6 on another machine's arithmetic.
            assert_close(name, *old, *new, 1e-9, 0.0);
        }
    }
}

#[test]
#[ignore = "writes the golden files of a new version"]
fn write_golden() {
    for (name, precision) in GOLDEN {
        if !data(name).exists() {
            let mut model = small_model(precision);
            model.seconds = [0.0; 6]; // the only part that differs from run to run
            std::fs::create_dir_all(data("saved")).unwrap();
            std::fs::write(data(name), model.save().unwrap()).unwrap();
        }
    }
}

#[track_caller]
fn refused(bytes: &[u8], what: &str) -> String {
    let Err(error) = Model::load(bytes) else { panic!("{what} was loaded") };
    assert_eq!(error.kind, ErrorKind::InvalidData, "{what}: {error}");
    error.message
}

/// The bytes with a checksum that is right again.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let body = bytes.len() - 8;
    let sum = xxh3_64(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&sum);
    bytes
}

fn patched(bytes: &[u8], at: usize, patch: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    out[at..at + patch.len()].copy_from_slice(patch);
    sealed(out)
}

#[test]
fn every_truncation_and_every_flipped_bit_is_noticed() {
    for precision in [Precision::F32, Precision::F64] {
        let bytes = small_model(precision).save().unwrap();
        for length in 0..bytes.len() {
            refused(&bytes[..length], "a truncation");
            if length >= 8 {
                refused(&sealed(bytes[..length].to_vec()), "a sealed truncation");
            }
        }
        let mut flipped = bytes.clone();
        for at in 0..bytes.len() {
            for bit in 0..8 {
                flipped[at] ^= 1 << bit;
                refused(&flipped, "a flipped bit");
                flipped[at] ^= 1 << bit;
            }
        }
        for extra in [1, 8, 4096] {
            let longer = [&bytes[..], &vec![0; extra]].concat();
            refused(&longer, "extra bytes");
            refused(&sealed(longer), "sealed extra bytes");
        }
    }
}

#[test]
fn another_version_and_another_byte_order_are_named() {
    let bytes = small_model(Precision::F32).save().unwrap();
    assert!(refused(&patched(&bytes, 4, &3u32.to_le_bytes()), "version 3").contains("version 3"));
    assert!(refused(&patched(&bytes, 4, &0u32.to_le_bytes()), "version 0").contains("version 0"));
    assert!(refused(&patched(&bytes, 8, &[1, 2, 3, 4]), "big-endian").contains("byte-order mark 0x04030201"));
    let mut state = State::new(Arc::new(small_model(Precision::F32)), Method::Warp, Integrator::Exact).unwrap();
    refused(&state.save(), "a saved state");
    assert_eq!(state.load(&bytes).unwrap_err().kind, ErrorKind::InvalidData);
}

/// Where each part of a saved model begins.
struct Layout {
    n: usize,
    t: usize,
    m: usize,
}

impl Layout {
    const FACTS: usize = 40;
    const MATERIAL: usize = Self::FACTS + 24;
    const CERTIFICATE: usize = Self::MATERIAL + 32;
    const POSITIONS: usize = Self::CERTIFICATE + 24 + 48;

    fn of(model: &Model) -> Self {
        Self { n: model.shell.mass.len(), t: model.shell.mesh.triangles.len(), m: model.n_modes() }
    }
    fn triangles(&self) -> usize {
        Self::POSITIONS + 24 * self.n
    }
    fn held(&self) -> usize {
        self.triangles() + 12 * self.t
    }
    fn eigenvalues(&self) -> usize {
        self.held() + self.n
    }
    fn basis(&self) -> usize {
        self.eigenvalues() + 24 * self.m
    }
}

#[test]
fn forged_contents_with_a_right_checksum_are_refused_by_name() {
    let model = small_model(Precision::F64);
    let bytes = model.save().unwrap();
    let layout = Layout::of(&model);
    let f = |x: f64| x.to_le_bytes().to_vec();
    let mut cases: Vec<(&str, usize, Vec<u8>, &str)> = vec![
        ("precision", 12, vec![2], "numbers of 2 bytes"),
        ("energy", 16, vec![9], "energy 9"),
        ("no vertices", 20, vec![0; 4], "0 vertices"),
        ("no triangles", 24, vec![0; 4], "0 triangles"),
        ("too many modes", 28, 1025u32.to_le_bytes().to_vec(), "out of range"),
        ("more zero modes than modes", 32, vec![5], "5 zero modes of 4"),
        ("more turned triangles than there are", 36, vec![200], "out of range"),
        ("zero modes that are not zero", 32, vec![1], "ascend"),
        ("count", Layout::FACTS + 8, 1000u64.to_le_bytes().to_vec(), "1000"),
        ("found", Layout::FACTS + 16, u64::MAX.to_le_bytes().to_vec(), "certificate"),
        ("stiffness", Layout::MATERIAL, f(-1.0), "k_area"),
        ("density", Layout::MATERIAL + 24, f(0.0), "area_density"),
        ("residual", Layout::CERTIFICATE, f(f64::NAN), "certificate"),
        ("shift", Layout::CERTIFICATE + 16, f(f64::INFINITY), "certificate"),
        ("seconds", Layout::CERTIFICATE + 24, f(-1.0), "timing"),
        ("position", Layout::POSITIONS + 8, f(f64::NAN), "vertex 0 has the coordinate NaN"),
        ("flat triangle", Layout::POSITIONS, [f(0.25), f(0.0), f(0.0)].concat(), "zero area"),
        ("index", layout.triangles(), u32::MAX.to_le_bytes().to_vec(), "does not exist"),
        ("held", layout.held(), vec![2], "neither held nor free"),
        ("moving held vertex", layout.held() + 10, vec![1], "held"),
        ("eigenvalue NaN", layout.eigenvalues(), f(f64::NAN), "not finite"),
        ("eigenvalue order", layout.eigenvalues(), f(1e300), "ascend"),
        ("negative eigenvalue", layout.eigenvalues(), f(-1.0), "negative"),
        ("largest rotation", layout.eigenvalues() + 8 * layout.m, f(0.0), "turns further"),
        ("largest swing", layout.eigenvalues() + 16 * layout.m, f(f64::NAN), "not finite"),
        ("shape NaN", layout.basis(), f(f64::NAN), "not finite at vertex 0"),
        ("rotation", layout.basis() + 24, f(1e30), "turns further"),
        ("held shape", layout.basis(), f(1e-30), "moves vertex 0, which is held"),
        ("unreferenced shape", layout.basis() + 48 * (layout.n - 1) * layout.m, f(1.0), "moves vertex"),
    ];
    let moving = model.shell.free[0] as usize;
    cases.push(("norm", layout.basis() + 48 * moving * layout.m, f(3.0), "not normed"));
    let turned = [&bytes[layout.triangles() + 4..][..4], &bytes[layout.triangles()..][..4]].concat();
    cases.push(("turned triangle", layout.triangles(), turned, "not oriented"));
    for (what, at, patch, named) in cases {
        let message = refused(&patched(&bytes, at, &patch), what);
        assert!(message.contains(named), "{what}: {message}");
    }
    let single = small_model(Precision::F32);
    let infinite = patched(&single.save().unwrap(), Layout::of(&single).basis(), &f32::INFINITY.to_le_bytes());
    assert!(refused(&infinite, "infinite f32").contains("not finite"));
}

#[test]
fn forged_counts_allocate_nothing() {
    let bytes = small_model(Precision::F32).save().unwrap();
    for at in [20, 24] {
        for count in [1000u32, 1 << 20, u32::MAX] {
            let forged = patched(&bytes, at, &count.to_le_bytes());
            let used = allocation_counter::measure(|| drop(refused(&forged, "a forged count")));
            assert!(used.bytes_total < 1024, "{} bytes for the message alone", used.bytes_total);
        }
    }
}

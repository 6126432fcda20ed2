//! Saved models: the same bits after loading, old files stay readable, and no bytes do harm.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::material::{Crease, Map, On, Quantity, Tie, TiedTo};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced::{self, Assumed, ReducedShell};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

fn precomputed(shell: Shell, modes: usize, precision: Precision) -> Model {
    Model::precompute(Arc::new(shell), &Options { modes, precision, ..Options::default() }, &mut |_, _| Ok(())).unwrap()
}

/// A small sheet with a turned triangle, a vertex of no triangle, and one clamped corner.
fn small_model(precision: Precision) -> Model {
    small_model_under(Vec3::zeros(), precision)
}

/// The same, linearised where it hangs under gravity.
fn small_sagged_model(precision: Precision) -> Model {
    small_model_under(Vec3::new(0.0, 0.1, -2.0), precision)
}

/// With a reduced shell.
fn small_reduced_model(precision: Precision) -> Model {
    let reduced = reduced::Options { fields: 4, elements: 12, poses: 2, ..Default::default() };
    small_model_with(Options { modes: 4, precision, reduced, ..Options::default() })
}

fn small_model_under(sag: Vec3, precision: Precision) -> Model {
    small_model_with(Options { modes: 4, precision, sag, ..Options::default() })
}

/// Held along an axis and along a slope: the section ROLL.
fn small_rolled_model(precision: Precision) -> Model {
    let along = vec![(3, Vec3::y()), (6, Vec3::new(1.0, 0.0, 2.0))];
    let supports = Supports { along, ..Default::default() };
    small_model_of(Make::of(SPRINGY), supports, Options { modes: 4, precision, ..Options::default() })
}

/// Half of a sheet at a plane of symmetry: the section SYMM.
fn small_half_model(precision: Precision) -> Model {
    let supports = Supports { symmetric: (9..13).map(|v| (v, Vec3::y())).collect(), ..Default::default() };
    small_model_of(Make::of(SPRINGY), supports, Options { modes: 4, precision, ..Options::default() })
}

/// With a stiff tie to a vertex and a soft one to a triangle: the section TIES.
fn small_tied_model(precision: Precision) -> Model {
    let tie = |vertex: u32, to: TiedTo, stiffness: f64| Tie { vertex, to, stiffness };
    let ties = vec![tie(9, TiedTo::Vertex(5), 0.0), tie(10, TiedTo::Triangle(3), 20.0)];
    let make = Make { ties, ..Make::of(SPRINGY) };
    small_model_of(make, Supports::default(), Options { modes: 4, precision, ..Options::default() })
}

/// With one crease that yields and one that does not: the sections CREA and YIEL.
fn small_model_that_yields(precision: Precision) -> Model {
    let crease = |vertices: [u32; 2], yield_angle: f64| Crease { vertices, factor: 0.5, angle: None, yield_angle };
    let creases = vec![crease([5, 6], 0.25), crease([6, 7], f64::INFINITY)];
    let make = Make { creases, ..Make::of(SPRINGY) };
    small_model_of(make, Supports::default(), Options { modes: 4, precision, ..Options::default() })
}

/// Of which every third vertex grew: the section LENG.
fn small_model_that_grew(precision: Precision) -> Model {
    let values = (0..14).map(|v| if v % 3 == 0 { 1.05 } else { 1.0 }).collect();
    let maps = vec![Map { quantity: Quantity::Growth, on: On::Vertices, values }];
    let make = Make { maps, ..Make::of(SPRINGY) };
    small_model_of(make, Supports::default(), Options { modes: 4, precision, ..Options::default() })
}

/// With fields that follow supports: the section SUPP.
fn small_model_that_follows(precision: Precision) -> Model {
    small_model_with(Options { modes: 4, precision, support_fields: 6, ..Options::default() })
}

const SPRINGY: Material = Material { k_bend: 0.5, k_area: 1e3, k_length: 1e3, area_density: 0.2 };

fn small_model_of(make: Make, supports: Supports, options: Options) -> Model {
    let (mut positions, mut triangles) = equilateral_sheet(3, 2, 0.25);
    positions.push(Vec3::new(9.0, 9.0, 9.0));
    triangles[4].swap(0, 1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let supports = Supports { fixed: vec![1], clamped: vec![0], ..supports };
    let shell = Arc::new(Shell::made(mesh, make, &supports).unwrap());
    Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap()
}

fn small_model_with(options: Options) -> Model {
    let (mut positions, mut triangles) = equilateral_sheet(3, 2, 0.25);
    positions.push(Vec3::new(9.0, 9.0, 9.0));
    triangles[4].swap(0, 1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let supports = Supports { fixed: vec![1], clamped: vec![0], ..Default::default() };
    let material = Material { k_bend: 0.5, ..Material::default() };
    let shell = Arc::new(Shell::new(mesh, material, &supports).unwrap());
    Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap()
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
            state.set_frame(Pose { origin: Vec3::x() * 0.01 * f64::from(k * k), rotation }, FrameMotion::Continuous);
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
    for precision in [Precision::F32, Precision::F64, Precision::I16] {
        let v_beam = precomputed(reference("v_beam").0, 8, precision);
        for original in [small_model(precision), small_sagged_model(precision), small_reduced_model(precision), v_beam]
        {
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
    let supports = Supports { fixed: vec![0, 1, 2], ..Default::default() };
    let model = precomputed(Shell::new(mesh, Material::default(), &supports).unwrap(), 4, Precision::F32);
    assert_eq!(model.modal.n_modes(), 0);
    let bytes = model.save().unwrap();
    assert_eq!(Model::load(&bytes).unwrap().save().unwrap(), bytes);
}

/// Files of earlier versions are never written anew; a new version adds its own. `cargo test --release --test interface cache:: --
/// --ignored write_golden` wrote these.
type Makes = fn(Precision) -> Model;
const GOLDEN: [(&str, Precision, Makes); 12] = [
    ("saved/model_v1_f32.bin", Precision::F32, small_model),
    ("saved/model_v1_f64.bin", Precision::F64, small_model),
    ("saved/model_v2_sagged_f32.bin", Precision::F32, small_sagged_model),
    ("saved/model_v2_sagged_f64.bin", Precision::F64, small_sagged_model),
    ("saved/model_v2_i16.bin", Precision::I16, small_model),
    ("saved/model_v2_reduced_f32.bin", Precision::F32, small_reduced_model),
    ("saved/model_v2_rollers_f32.bin", Precision::F32, small_rolled_model),
    ("saved/model_v2_ties_f32.bin", Precision::F32, small_tied_model),
    ("saved/model_v2_supports_f32.bin", Precision::F32, small_model_that_follows),
    ("saved/model_v2_yields_f32.bin", Precision::F32, small_model_that_yields),
    ("saved/model_v2_symmetry_f32.bin", Precision::F32, small_half_model),
    ("saved/model_v2_lengths_f32.bin", Precision::F32, small_model_that_grew),
];

#[test]
fn models_saved_by_every_version_still_load() {
    for (name, precision, make) in GOLDEN {
        let bytes = std::fs::read(data(name)).unwrap();
        let model = Model::load(&bytes).unwrap();
        assert_eq!(model.save().unwrap(), bytes, "{name}: saved again in the version it needs");
        assert_eq!(
            (model.modal.precision(), model.modal.n_modes(), model.shell.mesh.n_reoriented),
            (precision, 4, 1),
            "{name}"
        );
        let fresh = make(precision);
        assert_eq!(model.shell.held, fresh.shell.held);
        let hangs = |model: &Model| model.shell.sag.as_ref().map(|sag| (sag.gravity, sag.rest.clone()));
        assert_eq!(hangs(&model), hangs(&fresh), "{name}");
        assert_eq!((&model.shell.rollers, &model.shell.bonds), (&fresh.shell.rollers, &fresh.shell.bonds), "{name}");
        assert!(model.shell.creases == fresh.shell.creases, "{name}");
        assert_eq!(model.shell.mirrors, fresh.shell.mirrors, "{name}");
        assert_eq!(model.shell.metric, fresh.shell.metric, "{name}");
        let fields = |model: &Model| model.modal.supports.as_ref().map(|fields| fields.n());
        assert_eq!(fields(&model), fields(&fresh), "{name}");
        for (old, new) in model.shell.mesh.positions.iter().zip(&fresh.shell.mesh.positions) {
            // The same bits at rest; hanging or grown, two solves to 1e-8 of the load.
            assert!((old - new).norm() <= if fresh.shell.is_stressed() { 1e-9 } else { 0.0 }, "{name}");
        }
        for (old, new) in model.modal.eigenvalues.iter().zip(&fresh.modal.eigenvalues) {
            // A dense problem of condition 1e6 on another machine's arithmetic; grown, about a shape that is solved to 1e-8 of the forces.
            assert_close(name, *old, *new, if fresh.shell.metric.is_some() { 1e-7 } else { 1e-9 }, 0.0);
        }
    }
}

/// On the oldest model, three steps into the way of a rest shape, by the warp.
const STATE_ON_A_MOVING_REST: &str = "saved/state_v5_rest.bin";

fn on_a_moving_rest() -> State {
    let model = Arc::new(Model::load(&std::fs::read(data("saved/model_v1_f64.bin")).unwrap()).unwrap());
    let rest = model.shell.mesh.positions.clone();
    let mut state = State::new(model, Method::Warp, Integrator::ImplicitEuler).unwrap();
    for k in 0..3 {
        let t = f64::from(k) / 32.0;
        state.move_rest(|v| rest[v] + Vec3::new(0.0, t, t * rest[v].x), false).unwrap();
        state.step(1.0 / 32.0).unwrap();
    }
    state
}

#[test]
fn a_state_saved_on_a_moving_rest_shape_still_loads() {
    let bytes = std::fs::read(data(STATE_ON_A_MOVING_REST)).unwrap();
    assert_eq!(bytes[4], 5);
    let fresh = on_a_moving_rest();
    let mut loaded = State::new(fresh.model().clone(), Method::Warp, Integrator::ImplicitEuler).unwrap();
    loaded.load(&bytes).unwrap();
    assert_eq!(loaded.save(), bytes);
    let [old, new] = [&loaded, &fresh].map(|state| {
        let mut x = vec![];
        state.positions(Space::World, |_, p| x.push(p));
        x
    });
    assert!((old[2] - fresh.model().shell.mesh.positions[2]).norm() > 0.05, "it has moved");
    // Another machine's arithmetic, through three steps.
    old.iter().zip(&new).for_each(|(a, b)| assert!((a - b).norm() < 1e-9));
}

#[test]
fn each_optional_part_of_a_saved_model_has_a_file() {
    let parts = [
        ("rollers", b"ROLL"),
        ("symmetry", b"SYMM"),
        ("ties", b"TIES"),
        ("supports", b"SUPP"),
        ("reduced", b"REDU"),
        ("yields", b"YIEL"),
        ("lengths", b"LENG"),
    ];
    for (name, tag) in parts {
        let bytes = std::fs::read(data(&format!("saved/model_v2_{name}_f32.bin"))).unwrap();
        assert!(bytes.windows(4).any(|word| word == tag), "{name}");
    }
}

#[test]
#[ignore = "writes the golden files of a new version"]
fn write_golden() {
    for (name, precision, make) in GOLDEN {
        if !data(name).exists() {
            let model = make(precision);
            std::fs::create_dir_all(data("saved")).unwrap();
            std::fs::write(data(name), model.save().unwrap()).unwrap();
        }
    }
    if !data(STATE_ON_A_MOVING_REST).exists() {
        std::fs::write(data(STATE_ON_A_MOVING_REST), on_a_moving_rest().save()).unwrap();
    }
}

#[test]
fn two_precomputes_of_the_same_input_save_the_same_bytes() {
    for make in [small_model, small_reduced_model] {
        let (one, other) = (make(Precision::F32), make(Precision::F32));
        assert!(one.seconds != other.seconds && one.seconds.iter().any(|seconds| *seconds > 0.0));
        assert!(one.save().unwrap() == other.save().unwrap());
        assert_eq!(Model::load(&one.save().unwrap()).unwrap().seconds, [0.0; shellwarp::modes::PHASES]);
    }
}

#[track_caller]
fn refused(bytes: &[u8], what: &str) -> String {
    let Err(error) = Model::load(bytes) else { panic!("{what} was loaded") };
    assert_eq!(error.kind, ErrorKind::InvalidData, "{what}: {error}");
    error.message
}

fn patched(bytes: &[u8], at: usize, patch: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    out[at..at + patch.len()].copy_from_slice(patch);
    sealed(out)
}

#[test]
fn every_truncation_and_every_flipped_bit_is_noticed() {
    let small = [small_model(Precision::F32), small_model(Precision::F64)];
    let models = small.into_iter().chain([small_sagged_model(Precision::F32), small_reduced_model(Precision::F32)]);
    for model in models {
        let bytes = model.save().unwrap();
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
    assert!(refused(&patched(&bytes, 4, &2u32.to_le_bytes()), "version 1 called 2").contains("bytes are not the"));
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
        Self { n: model.shell.mass.len(), t: model.shell.mesh.triangles.len(), m: model.modal.n_modes() }
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
        ("precision", 12, vec![3], "numbers of 3 bytes"),
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
    let rounded = small_model(Precision::I16).save().unwrap();
    let units = rounded.len() - 8 - 16 * 4;
    for (unit, named) in
        [(f64::NAN, "unit"), (-1.0, "unit"), (0.0, "unit"), (f64::MAX, "not finite"), (1e3, "not normed")]
    {
        assert!(refused(&patched(&rounded, units, &f(unit)), "a unit of 16 bits").contains(named), "{unit}");
    }
    assert!(refused(&patched(&rounded, 12, &[4]), "16 bits called 32").contains("bytes are not the"));
    let (short, longer) = (units - 8, 8u64.to_le_bytes());
    assert!(refused(&patched(&rounded, short, &longer), "few units").contains("section"));
}

#[test]
fn a_basis_in_16_bits_takes_half_the_memory_and_moves_vertices_as_told() {
    let [exact, rounded] = [Precision::F64, Precision::I16].map(|precision| {
        let model = precomputed(reference("v_beam").0, 8, precision);
        let bytes = model.save().unwrap();
        assert_eq!(bytes.len(), model.saved_size());
        (Arc::new(model), bytes.len())
    });
    assert!(rounded.1 < exact.1 / 2, "{} bytes of {}", rounded.1, exact.1);
    let (exact, rounded) = (exact.0, rounded.0);
    let n = exact.shell.mass.len();
    let largest = |of: &dyn Fn(usize) -> Vec3| (0..n).map(|v| of(v).amax()).fold(0.0, f64::max);
    for seed in 0..20 {
        let q: Vec<f64> = (0..8).map(|k| f64::from((seed * 37 + k * 53) % 17 - 8) / 8.0).collect();
        let q: Vec<f64> = q.iter().zip(&exact.modal.largest_rotation).map(|(q, turn)| 0.4 * q / turn).collect();
        let placed = |model: &Arc<Model>, method| {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_amplitudes(&q, &[0.0; 8]).unwrap();
            let mut x = vec![];
            state.positions(Space::Frame, |_, at| x.push(at));
            x
        };
        let linear = placed(&exact, Method::LinearModalAnalysis);
        let rest = &exact.shell.mesh.positions;
        let reach = linear.iter().zip(rest).map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max);
        let shapes =
            |k: usize| largest(&|v| exact.modal.mode_at(k, v).0) + largest(&|v| exact.modal.mode_at(k, v).1) * reach;
        let bound: f64 =
            (0..8).map(|k| q[k].abs() * shapes(k)).sum::<f64>() * 3f64.sqrt() * rounded.modal.precision().rounding();
        let error = |(a, b): (&Vec3, &Vec3)| (a - b).norm();
        let worst =
            placed(&exact, Method::Warp).iter().zip(&placed(&rounded, Method::Warp)).map(error).fold(0.0, f64::max);
        // Sums in f32 add 1e-6 of the displacement; errors of sixteen signs stay well below their sum, yet are there.
        assert!(worst <= bound + 1e-6 * reach && worst >= 0.01 * bound, "{worst:e} of {bound:e}");
        assert!(worst <= 6e-5 * reach, "{worst:e} of {reach}");
    }
}

#[test]
fn forged_sections_are_refused_by_name() {
    let model = small_sagged_model(Precision::F64);
    let bytes = model.save().unwrap();
    let n = model.shell.mass.len();
    let content = bytes.len() - 8 - (24 + 24 * n);
    let front = content - 16;
    let f = |x: f64| x.to_le_bytes().to_vec();
    let cases: Vec<(&str, usize, Vec<u8>, &str)> = vec![
        ("unknown tag", front, b"SAGX".to_vec(), "does not know its section \"SAGX\""),
        ("unknown kind", front + 4, vec![1], "does not know its section"),
        ("too long", front + 8, u64::MAX.to_le_bytes().to_vec(), "is cut short"),
        ("too short", front + 8, 24u64.to_le_bytes().to_vec(), "does not know its section"),
        ("gravity", content, f(f64::INFINITY), "under the gravity [inf"),
        ("not a number", content + 24, f(f64::NAN), "vertex 0 hangs at [NaN"),
        ("too far", content + 48, f(1e200), "vertex 1 hangs at [1e200"),
    ];
    for (what, at, patch, named) in cases {
        let message = refused(&patched(&bytes, at, &patch), what);
        assert!(message.contains(named), "{what}: {message}");
    }
    let with_sections = |sections: &[u8]| {
        let size = (sections.len() as u64).to_le_bytes();
        sealed([&bytes[..40], &size, &bytes[48..front], sections, &[0; 8]].concat())
    };
    let section = &bytes[front..bytes.len() - 8];
    assert_eq!(with_sections(section), bytes);
    let message = refused(&with_sections(&[section, section].concat()), "twice");
    assert!(message.contains("two sections \"SAGS\""), "{message}");
    let message = refused(&with_sections(&section[..10]), "half a front");
    assert!(message.contains("cut short"), "{message}");
    refused(&with_sections(&[]), "version 2 without sections");
}

#[test]
fn forged_yield_angles_are_refused_by_name() {
    let bytes = small_model_that_yields(Precision::F64).save().unwrap();
    let content = bytes.len() - 8 - 2 * 8;
    assert_eq!(&bytes[content - 16..content - 12], b"YIEL");
    let bad = |x: f64| x.to_le_bytes().to_vec();
    let cases = [
        ("zero", content, bad(0.0), "yield angle of crease 0"),
        ("not a number", content + 8, bad(f64::NAN), "yield angle of crease 1"),
        ("negative", content, bad(-0.1), "yield angle of crease 0"),
    ];
    for (what, at, patch, named) in cases {
        let message = refused(&patched(&bytes, at, &patch), what);
        assert!(message.contains(named), "{what}: {message}");
    }
    // One angle for two creases.
    let sections = u64::from_le_bytes(bytes[40..48].try_into().unwrap()) - 8;
    let fewer = [&bytes[..40], &sections.to_le_bytes(), &bytes[48..content - 8], &8u64.to_le_bytes()].concat();
    let message = refused(&sealed([&fewer[..], &bytes[content..content + 8], &[0; 8]].concat()), "one angle");
    assert!(message.contains("8 bytes are not the yield angles of its 2 creases"), "{message}");
}

#[test]
fn forged_lengths_are_refused_by_name() {
    let model = small_model_that_grew(Precision::F64);
    let bytes = model.save().unwrap();
    let edges = model.shell.mesh.edges.len();
    let at = bytes.windows(4).position(|tag| tag == b"LENG").unwrap() + 16;
    let [a, b] = model.shell.mesh.edges[1].vertices;
    for x in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = refused(&patched(&bytes, at + 8, &x.to_le_bytes()), "length");
        assert!(message.contains(&format!("rest length 1, of the edge {a}-{b}, is {x:?}")), "{message}");
    }
    let message = refused(&patched(&bytes, at, &1e3f64.to_le_bytes()), "long");
    assert!(message.contains("shorter than the other two together"), "{message}");
    // Those of the mesh are none, and then nothing rests elsewhere.
    let x = model.shell.given();
    let given = |ends: [u32; 2]| (x[ends[1] as usize] - x[ends[0] as usize]).norm();
    let plain: Vec<u8> = model.shell.mesh.edges.iter().flat_map(|e| given(e.vertices).to_le_bytes()).collect();
    assert_eq!(plain.len(), 8 * edges);
    let message = refused(&patched(&bytes, at, &plain), "none");
    assert!(message.contains("without a reason"), "{message}");
    let fewer = patched(&bytes, at - 8, &(8 * edges as u64 - 8).to_le_bytes());
    assert!(Model::load(&fewer).is_err());
}

#[test]
fn forged_reduced_shells_are_refused_by_name() {
    let model = small_reduced_model(Precision::F64);
    let bytes = model.save().unwrap();
    let reduced = model.reduced.as_ref().unwrap();
    let (n, samples) = (reduced.n(), reduced.samples.len());
    let content = bytes.len() - 8 - reduced.saved_size(model.shell.mass.len());
    let (elements, weights) = (content + 16, content + 16 + 4 * samples);
    let correction = weights + 8 * samples;
    let stresses = correction + 8 * 16;
    let fields = stresses + 8 * reduced.assumed.stresses.len();
    let held = model.shell.held.iter().position(|held| *held).unwrap();
    let f = |x: f64| x.to_le_bytes().to_vec();
    let u = |x: u32| x.to_le_bytes().to_vec();
    let cases: Vec<(&str, usize, Vec<u8>, &str)> = vec![
        ("fewer fields than modes", content, vec![3, 0], "and 4 modes is out of range"),
        ("too many fields", content, vec![129, 0], "129 fields"),
        ("more samples than bytes", content + 4, u(u32::MAX), "bytes are not those of a reduced shell"),
        ("residual", content + 8, f(-1.0), "not positive"),
        ("no such element", elements + 4 * (samples - 1), u(u32::MAX), "none of its shell's"),
        ("descending", elements + 4, u(0), "do not ascend"),
        ("weight", weights, f(0.0), "not positive"),
        ("not symmetric", correction + 8, f(1e9), "not symmetric"),
        ("not a number", correction, f(f64::NAN), "not symmetric"),
        ("more stresses than bytes", content + 2, vec![127, 0], "bytes are not those of a reduced shell"),
        ("too many stresses", content + 2, vec![142, 0], "142 stresses"),
        ("too much stress", stresses + 8, f(2.0), "not normed"),
        ("stress is no number", stresses, f(f64::NAN), "not normed"),
        ("moves a held vertex", fields + 24 * n * held, f(1.0), "though it is held"),
        ("norm", fields + 24 * n * (model.shell.free[0] as usize), f(1e3), "has the norm"),
    ];
    for (what, at, patch, named) in cases {
        let message = refused(&patched(&bytes, at, &patch), what);
        assert!(message.contains(named), "{what}: {message}");
    }
}

#[test]
fn the_membranes_own_share_is_saved_and_checked() {
    let mut model = small_reduced_model(Precision::F64);
    let (plain, of) = (model.save().unwrap(), model.reduced.take().and_then(Arc::into_inner).unwrap());
    let assumed = Assumed { membrane_share: 0.2, ..of.assumed };
    let fields = (model.modal.n_modes(), of.fields);
    let mut reduced = ReducedShell::assemble(&model.shell, fields, of.samples, assumed).unwrap();
    (reduced.fit, reduced.polynomial) = (of.fit, of.polynomial);
    model.reduced = Some(Arc::new(reduced));
    let bytes = model.save().unwrap();
    assert_eq!(bytes.len(), plain.len() + 8);
    let loaded = Model::load(&bytes).unwrap();
    assert_eq!(loaded.reduced.as_ref().unwrap().assumed, model.reduced.as_ref().unwrap().assumed);
    assert_eq!(loaded.save().unwrap(), bytes);
    for share in [0.0, 1.0, -0.2, f64::NAN] {
        let message = refused(&patched(&bytes, bytes.len() - 16, &share.to_le_bytes()), "share");
        assert!(message.contains("the membrane's own share is"), "{message}");
    }
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

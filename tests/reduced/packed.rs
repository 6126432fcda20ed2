//! Output in 16 bits of a reduced shell: where it puts vertices beside the fields themselves, and what it leaves out.

use crate::common::*;
use pulp::Arch;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced::{self, PackedFields};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::warp::Placement;
use shellwarp::{Vec3, reduced::AnyFields};
use std::sync::Arc;

fn model(precision: Precision) -> Arc<Model> {
    let reduced = reduced::Options { fields: 12, elements: 300, ..Default::default() };
    let options = Options { modes: 5, precision, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(leaf(1)), &options, &mut |_, _| Ok(())).unwrap())
}

fn bent(model: &Arc<Model>) -> State {
    let mut state = State::new(model.clone(), Method::PolynomialShell, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.3, 0.5, -1.0)).unwrap();
    (0..40).for_each(|_| state.step(1.0 / 60.0).unwrap());
    state
}

fn seen(state: &State) -> Vec<[f32; 3]> {
    let mut rows = vec![];
    state.position_rows_f32(Space::World, |_, some| rows.extend_from_slice(some));
    rows
}

/// Of 32-bit rows off 64-bit ones.
fn furthest(rows: &[[f32; 3]], exact: &[Vec3]) -> f64 {
    let off = |(row, x): (&[f32; 3], &Vec3)| (Vec3::from(row.map(f64::from)) - x).norm();
    rows.iter().zip(exact).map(off).fold(0.0, f64::max)
}

const IDENTITY: Placement = Placement { origin: Vec3::new(0.0, 0.0, 0.0), rotation: None };

#[test]
fn positions_are_off_by_no_more_than_the_bound_whatever_is_asked_for() {
    let model = model(Precision::I16);
    let packed = model.reduced.as_ref().unwrap().packed.as_ref().unwrap();
    let state = bent(&model);
    let (rows, mut exact) = (seen(&state), vec![]);
    state.positions(Space::World, |_, x| exact.push(x));
    let largest = displacements(&state).iter().map(|u| u.norm()).fold(0.0, f64::max);
    let off = furthest(&rows, &exact);
    println!("off by {off:.2e}, displaced by {largest:.2e}");
    // 15 bits of each field's largest number, which add up to a few of the displacement; and rounding of 1.5 to 32 bits.
    assert!(largest > 0.05 && off > 0.0 && off < 1e-4 * largest + 1e-6);
    let some: Vec<u32> = (0..exact.len() as u32).rev().step_by(7).collect();
    let mut same = vec![];
    state.positions_of_f32(Space::World, &some, |i, row| same.push((i, row))).unwrap();
    assert!(same.len() == some.len() && same.iter().all(|(i, row)| *row == rows[some[*i] as usize]));
    assert!(packed.bytes() < 3 * model.reduced.as_ref().unwrap().field_bytes() / 4);
    // The same bits after saving and loading, and of a model in 32 bits nothing is packed.
    let loaded = Arc::new(Model::load(&model.save().unwrap()).unwrap());
    assert_eq!(seen(&bent(&loaded)), seen(&bent(&model)));
    let plan = state.plan(1.0 / 60.0).unwrap();
    assert!(plan.iter().any(|part| part.reason.contains("output in 16 bits reads")), "{plan:?}");
}

#[test]
fn fields_of_little_amplitude_are_left_out_within_the_bound() {
    let model = model(Precision::F32);
    let reduced = model.reduced.as_ref().unwrap();
    assert!(reduced.packed.is_none());
    let AnyFields::F32(fields) = &reduced.fields else { panic!("32 bits") };
    let rest = &model.shell.mesh.positions;
    let columns: Vec<Vec<Vec3>> = (0..fields.n).map(|k| (0..rest.len()).map(|v| fields.at(k, v)).collect()).collect();
    let packed = PackedFields::new(rest, &columns).unwrap();
    for (small, all) in [(0.0, false), (1e-8, false), (1e-2, true)] {
        let q: Vec<f64> =
            (0..fields.n).map(|k| if k == 4 { 0.3 } else { small * f64::from(k as u32 + 1).sin() }).collect();
        let mut exact = vec![];
        fields.displacements(&q, |v, u| exact.push(rest[v] + u));
        let rows = rows(&packed, &q);
        let (off, bound) = (furthest(&rows, &exact), packed.bound(&q));
        println!("small {small:e}: {} fields, off {off:.2e}, bound {bound:.2e}", packed.n_used(&q));
        assert!(off <= bound + 4e-7 * 1.5, "{off:e} {bound:e}"); // and positions of 1.5 in f32
        assert_eq!(packed.n_used(&q) == fields.n, all);
        assert!(packed.n_used(&q) > 0);
    }
}

fn rows(packed: &PackedFields, q: &[f64]) -> Vec<[f32; 3]> {
    let mut rows = vec![];
    packed.positions_f32(q, &IDENTITY, |first, some| {
        assert_eq!(first, rows.len());
        rows.extend_from_slice(some);
    });
    rows
}

/// Amplitudes of which one or two are far above the others, or none is; and none at all.
fn amplitudes(n: usize, rng: &mut StdRng) -> Vec<Vec<f64>> {
    let mut any = |size: f64| (0..n).map(|_| size * rng.random_range(-1.0..1.0)).collect::<Vec<f64>>();
    let mut all = vec![any(1.0), any(1e-30), any(1e5), vec![0.0; n], vec![1.0; n], vec![-1.0; n]];
    for (low, few) in [(1e-3, 1), (1e-2, 2), (0.5, 2)] {
        let mut q = any(low);
        q.iter_mut().take(few).for_each(|q| *q = 1.0);
        all.push(q);
    }
    all
}

/// Fields whose largest number is 1, at many vertices with either sign: all of them can add up.
fn full(n: usize, n_vertices: usize, rng: &mut StdRng) -> Vec<Vec<Vec3>> {
    let mut number = || *[-1.0, 1.0, 1.0, rng.random_range(-1.0..1.0)].get(rng.random_range(0..4)).unwrap();
    let mut field = || (0..n_vertices).map(|_| Vec3::from_fn(|_, _| number())).collect::<Vec<_>>();
    let mut columns: Vec<_> = (0..n).map(|_| field()).collect();
    columns.iter_mut().for_each(|column| column[0] = Vec3::repeat(1.0));
    columns
}

/// The bound is what the numbers of fields are rounded by, √3/2 of 1/32767 each, and once more for what may be left out; amplitudes that are
/// rounded to 16 bits and as many as fit again add little. Numbers near the largest that sums can be would show one that runs over.
#[test]
fn exact_sums_of_16_bits_keep_to_the_bound_and_never_run_over() {
    let rng = &mut StdRng::seed_from_u64(5);
    for n in [1, 2, 3, 28, 63, 128] {
        let columns = full(n, 37, rng);
        let packed = PackedFields::new(&vec![Vec3::zeros(); 37], &columns).unwrap();
        for q in amplitudes(n, rng) {
            let sum = |v: usize| (0..n).map(|k| q[k] * columns[k][v]).sum::<Vec3>();
            let exact: Vec<Vec3> = (0..37).map(sum).collect();
            let all: f64 = q.iter().map(|q| q.abs()).sum();
            let (off, bound) = (furthest(&rows(&packed, &q), &exact), packed.bound(&q));
            let of_f32 = 4.0 * 3f64.sqrt() * f64::from(f32::EPSILON) * all; // the sums, two products and their sum are rounded to it
            assert!(off <= bound + of_f32, "{n} fields, {q:?}: {off:e} {bound:e}");
            // Amplitudes to n/2 parts of 2¹⁶ times what fits again, n times: an eighth of the numbers' with 128 fields.
            let numbers = 3f64.sqrt() / 32767.0 * all;
            assert!(bound <= numbers * if n > 64 { 1.125 } else { 1.04 }, "{n}: {bound:e} {numbers:e}");
        }
    }
}

#[test]
fn all_instruction_sets_give_the_same_bits() {
    let mut kinds = vec![Arch::Scalar, Arch::new()];
    #[cfg(target_arch = "x86_64")]
    kinds.extend(pulp::x86::V3::try_new().map(Arch::V3));
    let rng = &mut StdRng::seed_from_u64(6);
    for n in [1, 5, 28, 128] {
        let columns = full(n, 50, rng);
        let rest: Vec<Vec3> = (0..50).map(|v| Vec3::new(f64::from(v).sin(), 0.1, f64::from(v))).collect();
        let mut packed = PackedFields::new(&rest, &columns).unwrap();
        for q in amplitudes(n, rng) {
            let mut of = |arch: &Arch| {
                packed.arch = *arch;
                rows(&packed, &q).iter().map(|row| row.map(f32::to_bits)).collect::<Vec<_>>()
            };
            let all: Vec<_> = kinds.iter().map(&mut of).collect();
            assert!(all.iter().all(|rows| *rows == all[0]), "{n} fields, {q:?}");
        }
    }
}

//! What a tolerance saves on ten scenes, and what a static correction would save beside it, as tables of docs/leave_out.md:
//! tests/bench/leave_out.py starts it.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/demand_scenes.rs"]
mod demand_scenes;

use demand_scenes::*;
use nalgebra::{DMatrix, SymmetricEigen};
use shellwarp::Vec3;
use shellwarp::model::{AnyBasis, Model};
use shellwarp::modes::Demand;
use shellwarp::warp::{Basis, ModalRotation};
use std::sync::Arc;

/// Runs whose least times are taken.
const RUNS: usize = 7;

/// Seconds of all steps with their positions, each the least of some runs.
fn seconds(scene: &Scene, model: &Arc<Model>) -> f64 {
    let runs: Vec<Vec<f64>> =
        (0..RUNS).map(|_| run(scene, model).into_iter().map(|(_, time)| time).collect()).collect();
    (0..runs[0].len()).map(|k| runs.iter().map(|run| run[k]).fold(f64::INFINITY, f64::min)).sum()
}

fn tolerances() {
    println!("| scene | asked | bound | error | modes | time of all modes |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for scene in scenes() {
        let all = precomputed(&scene, ALL, None);
        let whole = run(&scene, &all);
        let (moved, time) = (moved(&whole, &scene), seconds(&scene, &all));
        for share in SHARES {
            let demand = Demand { tolerance: share * moved, ..scene.demand.clone() };
            let model = precomputed(&scene, ALL, Some(demand));
            let [bound, error] = [model.truncation, apart(&run(&scene, &model), &whole)].map(|x| 100.0 * x / moved);
            let saved = 100.0 * seconds(&scene, &model) / time;
            println!(
                "| {} | {:.0} % | {bound:.2} % | {error:.3} % | {} | {saved:.0} % |",
                scene.name,
                100.0 * share,
                model.n_modes()
            );
        }
    }
}

/// What acts in a scene, as modal forces of unit loads: gravity, or an acceleration along each axis, and pulls at handles.
fn loads(scene: &Scene, all: &Model) -> Vec<Vec<f64>> {
    let modes = 0..all.n_modes();
    let uniform = |a: Vec3| -> Vec<f64> { modes.clone().map(|k| all.participation().factors()[k].dot(&a)).collect() };
    let mut loads = vec![];
    if scene.demand.gravity != Vec3::zeros() {
        loads.push(uniform(scene.demand.gravity.normalize()));
    }
    if scene.demand.acceleration > 0.0 {
        loads.extend([Vec3::x(), Vec3::y(), Vec3::z()].map(uniform));
    }
    for v in &scene.demand.handles {
        loads.push(modes.clone().map(|k| all.mode_at(k, *v as usize).0.z).collect()); // the axis along which it is dragged
    }
    loads
}

/// Ritz values and vectors, in the modes `others`, of the static answers to `loads` that these give.
fn ritz(all: &Model, others: &[usize], loads: &[Vec<f64>]) -> (Vec<f64>, DMatrix<f64>) {
    let lambda = |i: usize| all.eigenvalues[others[i]];
    let answers = DMatrix::from_fn(others.len(), loads.len(), |i, j| loads[j][others[i]] / lambda(i));
    let svd = answers.svd(true, false);
    let rank = svd.singular_values.iter().filter(|s| **s > 1e-9 * svd.singular_values.max()).count();
    let basis = svd.u.expect("asked for").columns(0, rank).into_owned();
    let stiffness = basis.transpose() * DMatrix::from_fn(others.len(), rank, |i, j| lambda(i) * basis[(i, j)]);
    let ritz = SymmetricEigen::new(stiffness);
    (ritz.eigenvalues.iter().copied().collect(), basis * ritz.eigenvectors)
}

/// The model of some of `all`'s modes, and with the static answers of the others to `loads` as Ritz vectors: orthonormal in M and in K,
/// each with an eigenvalue of its own.
fn with_ritz_vectors(all: &Model, keep: &[usize], loads: &[Vec<f64>]) -> Arc<Model> {
    let others: Vec<usize> = (0..all.n_modes()).filter(|k| !keep.contains(k)).collect();
    let (lambdas, vectors) = if loads.is_empty() { (vec![], DMatrix::zeros(0, 0)) } else { ritz(all, &others, loads) };
    let n = all.shell.mass.len();
    let shape = |k: usize| -> Vec<Vec3> { (0..n).map(|v| all.mode_at(k, v).0).collect() };
    let mut modes: Vec<(f64, Vec<Vec3>)> = keep.iter().map(|k| (all.eigenvalues[*k], shape(*k))).collect();
    for (j, lambda) in lambdas.iter().enumerate() {
        let sum = |v: usize| others.iter().enumerate().map(|(i, k)| all.mode_at(*k, v).0 * vectors[(i, j)]).sum();
        modes.push((*lambda, (0..n).map(sum).collect()));
    }
    modes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rotation = ModalRotation::new(&all.shell.mesh);
    let mut basis = Basis::new(&all.shell.mesh.positions, &all.shell.mass, modes.len(), all.shell.total_mass).unwrap();
    let (mut largest_rotation, mut largest_swing) = (vec![], vec![]);
    for (k, (_, phi)) in modes.iter().enumerate() {
        let psi = rotation.apply(phi);
        basis.set_mode(k, phi, &psi);
        largest_rotation.push(psi.iter().map(|w| w.norm()).fold(0.0, f64::max));
        largest_swing.push(psi.iter().zip(phi).map(|(w, u)| w.norm() * u.norm()).fold(0.0, f64::max));
    }
    Arc::new(Model {
        shell: all.shell.clone(),
        eigenvalues: modes.iter().map(|mode| mode.0).collect(),
        largest_rotation,
        largest_swing,
        zero_modes: 0,
        certificate: all.certificate,
        basis: AnyBasis::F64(basis),
        participation: Default::default(),
        truncation: 0.0,
        reduced: None,
        seconds: Default::default(),
        peak_bytes: 0,
        fingerprint: 0,
        reduced_fingerprint: 0,
        front: None,
        solvers: Default::default(),
        strain: Default::default(),
    })
}

/// How many fields a scene needs by its true error, the modes that its loads move furthest first, and with Ritz vectors beside them.
fn static_correction() {
    println!("| scene | asked | modes | with Ritz vectors, these included |");
    println!("| --- | --- | --- | --- |");
    for scene in scenes() {
        let all = precomputed(&scene, ALL, None);
        let (whole, loads) = (run(&scene, &all), loads(&scene, &all));
        let largest = |k: usize| (0..all.shell.mass.len()).map(|v| all.mode_at(k, v).0.norm()).fold(0.0, f64::max);
        let moves = |k: usize| loads.iter().map(|f| f[k].abs()).sum::<f64>() * largest(k) / all.eigenvalues[k];
        let mut order: Vec<usize> = (0..all.n_modes()).collect();
        order.sort_by(|a, b| moves(*b).total_cmp(&moves(*a)));
        let errors = |loads: &[Vec<f64>]| -> Vec<(usize, f64)> {
            let counts = (0..12).chain((12..24).step_by(2)).chain((24..all.n_modes()).step_by(8));
            let model = |count: usize| with_ritz_vectors(&all, &order[..count], loads);
            counts
                .map(model)
                .filter(|m| m.n_modes() > 0)
                .map(|m| (m.n_modes(), apart(&run(&scene, &m), &whole)))
                .collect()
        };
        let (plain, ritz, moved) = (errors(&[]), errors(&loads), moved(&whole, &scene));
        for share in SHARES {
            // The fewest after which the error stays below.
            let enough = |errors: &[(usize, f64)]| {
                let last = errors.iter().rposition(|(_, error)| *error > share * moved);
                last.map_or(errors.first(), |last| errors.get(last + 1)).map_or(ALL, |found| found.0)
            };
            println!("| {} | {:.0} % | {} | {} |", scene.name, 100.0 * share, enough(&plain), enough(&ritz));
        }
    }
}

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("--static-correction") => static_correction(),
        None => tolerances(),
        Some(other) => panic!("{other}: usage: demand [--static-correction]"),
    }
}

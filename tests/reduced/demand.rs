//! Models that leave out the modes which a scene does not need: whatever the scene and the tolerance, no vertex is off by more than
//! asked, against the same method with many more modes. tests/bench/demand.rs prints what that saves.

use crate::demand_scenes::*;
use nalgebra::DMatrix;
use shellwarp::modes::Demand;
use shellwarp::{Vec3, model::Model};

#[test]
fn no_vertex_is_off_by_more_than_the_tolerance() {
    for scene in scenes() {
        let whole = run(&scene, &precomputed(&scene, ALL, None));
        let moved = moved(&whole, &scene);
        let mut fewest = usize::MAX;
        for share in SHARES {
            let tolerance = share * moved;
            let model = precomputed(&scene, ALL, Some(Demand { tolerance, ..scene.demand.clone() }));
            let (off, modes, bound) = (apart(&run(&scene, &model), &whole), model.modal.n_modes(), model.truncation);
            println!(
                "{:<32} moves {moved:.3}, asked {tolerance:.1e}, bound {bound:.1e}, off {off:.1e}, {modes} modes",
                scene.name
            );
            assert!(off <= tolerance && modes < ALL, "{}: {off:e} of {tolerance:e}", scene.name);
            assert!(bound <= tolerance, "{}: too few modes", scene.name);
            assert!(modes <= fewest);
            fewest = modes;
        }
    }
}

/// ΦᵀMΦ and ΦᵀKΦ of a model's fields.
fn products(model: &Model) -> [DMatrix<f64>; 2] {
    let (shell, m) = (&model.shell, model.modal.n_modes());
    let shape = |k: usize, v: usize| model.modal.mode_at(k, v).0;
    let mass = DMatrix::from_fn(m, m, |i, j| {
        (0..shell.mass.len()).map(|v| shell.mass[v] * shape(i, v).dot(&shape(j, v))).sum()
    });
    let mut stiffness = DMatrix::zeros(m, m);
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        let strain = |k: usize| -> f64 { vertices.iter().zip(row).map(|(v, b)| b.dot(&shape(k, *v as usize))).sum() };
        let strains = nalgebra::DVector::from_fn(m, |k, _| strain(k));
        stiffness += &strains * strains.transpose();
    });
    [mass, stiffness]
}

/// Static corrections are fields like the modes, orthonormal in M and in K, and hold what a pull at a handle does to first order.
#[test]
fn static_corrections_are_orthonormal_and_answer_to_pulls_as_all_modes_do() {
    let scene = scenes().into_iter().find(|scene| scene.name == "arch with a handle of known speed").unwrap();
    let (corner, beside) = (scene.demand.handles[0], scene.demand.handles[0] - 1);
    // A vertex twice, one beside it, and one that is held and so is no handle.
    let handles = vec![corner, beside, corner, 0];
    let gravity = Vec3::zeros();
    let demand = Demand { tolerance: 1e-3, gravity, handles, distance: 0.02, speed: 0.02, ..scene.demand.clone() };
    let model = precomputed(&scene, ALL, Some(demand));
    let all = precomputed(&scene, ALL, None);
    let n_modes = (0..model.modal.n_modes())
        .filter(|k| all.modal.eigenvalues.iter().any(|l| (l - model.modal.eigenvalues[*k]).abs() <= 1e-9 * l))
        .count();
    assert!((2..=6).contains(&(model.modal.n_modes() - n_modes)), "{} of {} are modes", n_modes, model.modal.n_modes());
    let [mass, stiffness] = products(&model);
    for i in 0..model.modal.n_modes() {
        for j in 0..model.modal.n_modes() {
            let same = if i == j { 1.0 } else { 0.0 };
            // The shift of the statics' factor, 1e-4 of the lowest eigenvalue, is in the corrections.
            let scale = (model.modal.eigenvalues[i] * model.modal.eigenvalues[j]).sqrt();
            assert!((mass[(i, j)] - same).abs() < 1e-6, "mass {i} {j}: {}", mass[(i, j)]);
            assert!(
                (stiffness[(i, j)] / scale - same).abs() < 1e-3,
                "stiffness {i} {j}: {}",
                stiffness[(i, j)] / scale
            );
        }
    }
    for v in [corner, beside] {
        let pulled = |model: &Model, at: usize| -> Vec3 {
            (0..model.modal.n_modes())
                .map(|k| {
                    model.modal.mode_at(k, at).0 * (model.modal.mode_at(k, v as usize).0.z / model.modal.eigenvalues[k])
                })
                .sum()
        };
        let (mut off, mut size) = (0.0f64, 0.0f64);
        for at in 0..model.shell.mass.len() {
            off = off.max((pulled(&model, at) - pulled(&all, at)).norm());
            size = size.max(pulled(&all, at).norm());
        }
        assert!(off < 1e-2 * size, "vertex {v}: {off} of {size}");
    }
}

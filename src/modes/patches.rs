//! Static answers to a push along the normal at chosen vertices, beside the modes: what touches there can be followed.
//!
//!   K u = n at a vertex,   u orthogonal to the modes,   then Ritz vectors: M-orthonormal, and K makes them independent
//!
//! (MacNeal 1971, as `demand.rs` has it for handles.) A modal shell of a few modes gives way to a small solid only as these do. With
//! its own answer there, a push is answered as by all modes together.

use super::{MAX_MODES, Modes, ScaledStiffness};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{DMatrix, SymmetricEigen};

/// Of its length, what an answer must have that others do not give already.
const NEW: f64 = 1e-6;

/// Adds the answers of `patches` to the modes. Fails where one is no vertex or held, and where the shell can move freely.
pub fn add_patches(shell: &Shell, modes: Modes, patches: &[u32]) -> Result<Modes> {
    if patches.is_empty() {
        return Ok(modes);
    }
    if modes.zero_modes > 0 {
        let message = "contact_patches: the shell can move freely, so a push has no static answer: support it";
        return Err(Error::new(ErrorKind::Unsupported, message));
    }
    let pushes = pushes(shell, patches)?;
    let stiffness = ScaledStiffness::assemble(shell)?;
    let n = stiffness.root_mass.len();
    let symbolic = shell.analysis(stiffness.lower.symbolic())?;
    let Some(factor) = symbolic.cholesky(&stiffness.lower)? else {
        return Err(Error::new(ErrorKind::Numerical, "contact_patches: the stiffness is not positive definite"));
    };
    let mut answers = Mat::<f64>::zeros(n, pushes.len());
    for (j, (at, normal)) in pushes.iter().enumerate() {
        (0..3).for_each(|c| answers[(3 * at + c, j)] = normal[c] / stiffness.root_mass[3 * at + c]);
    }
    stiffness.project(shell, answers.as_mut());
    factor.solve_in_place(answers.as_mut())?;
    stiffness.project(shell, answers.as_mut());
    let mut basis: Vec<Vec<f64>> = modes.shapes.iter().map(|shape| scaled(shell, &stiffness, shape)).collect();
    let first = basis.len();
    for j in 0..pushes.len() {
        let answer: Vec<f64> = (0..n).map(|i| answers[(i, j)]).collect();
        if let Some(new) = orthogonal(&basis, answer).filter(|_| basis.len() < MAX_MODES) {
            basis.push(new);
        }
    }
    Ok(joined(shell, &stiffness, modes, &basis[first..]))
}

/// Of each patch its place among the free vertices, and the normal there.
fn pushes(shell: &Shell, patches: &[u32]) -> Result<Vec<(usize, Vec3)>> {
    let normals = shell.mesh.normals(&shell.mesh.positions);
    let place = |(i, v): (usize, &u32)| match shell.free.binary_search(v) {
        Ok(at) => Ok((at, normals[*v as usize])),
        Err(_) => {
            let n = shell.mass.len();
            let why =
                if *v as usize >= n { format!("the mesh has {n} vertices") } else { "it does not move".to_owned() };
            Err(Error::argument(format!("contact_patches[{i}] is vertex {v}: {why}")))
        }
    };
    patches.iter().enumerate().map(place).collect()
}

/// M^½ of a shape's free displacements.
fn scaled(shell: &Shell, stiffness: &ScaledStiffness, shape: &[Vec3]) -> Vec<f64> {
    let free = shell.free.iter().flat_map(|v| shape[*v as usize].data.0[0]);
    free.zip(&stiffness.root_mass).map(|(x, root)| x * root).collect()
}

/// The part of `v` that `basis` does not span, of length 1; none where little is left. Twice, for the digits.
fn orthogonal(basis: &[Vec<f64>], mut v: Vec<f64>) -> Option<Vec<f64>> {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let before = norm(&v);
    for _ in 0..2 {
        for b in basis {
            let along: f64 = b.iter().zip(&v).map(|(a, b)| a * b).sum();
            v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
        }
    }
    let left = norm(&v);
    (left > NEW * before && left.is_finite()).then(|| v.iter().map(|x| x / left).collect())
}

/// The modes with the Ritz vectors of `answers`, which are orthonormal, behind them.
fn joined(shell: &Shell, stiffness: &ScaledStiffness, mut modes: Modes, answers: &[Vec<f64>]) -> Modes {
    let m = answers.len();
    let forces: Vec<Vec<f64>> = answers.iter().map(|a| stiffness.apply(a)).collect();
    let product = |i: usize, j: usize| -> f64 { answers[i].iter().zip(&forces[j]).map(|(a, b)| a * b).sum() };
    let ritz = SymmetricEigen::new(DMatrix::from_fn(m, m, |i, j| 0.5 * (product(i, j) + product(j, i))));
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|a, b| ritz.eigenvalues[*a].total_cmp(&ritz.eigenvalues[*b]));
    for k in order {
        let mut shape = vec![Vec3::zeros(); shell.mass.len()];
        for (at, v) in shell.free.iter().enumerate() {
            let sum = |c: usize| (0..m).map(|j| ritz.eigenvectors[(j, k)] * answers[j][3 * at + c]).sum::<f64>();
            shape[*v as usize] = Vec3::from_fn(|c, _| sum(c) / stiffness.root_mass[3 * at + c]);
        }
        // No less than the last mode's, which it is orthogonal to: rounding apart.
        let last = modes.eigenvalues.last().copied().unwrap_or(0.0);
        modes.eigenvalues.push(ritz.eigenvalues[k].max(last));
        modes.shapes.push(shape);
    }
    modes
}

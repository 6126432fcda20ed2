//! The stress fields that the membrane's strains count along ([`super::energy`]): strains ε = √(2w) s, a number an element, of
//!
//! - the modes, to first order: ε′φ_i,
//! - the modes bent far, to second order: ½ ε″(φ_i, φ_j) + ½ ε′Θ_ij, what the modal derivatives leave of the stretch,
//! - the equilibria that the basis is trained on,
//!
//! compressed by the eigenvectors of their Gram matrix: an inner product of these strains is an energy.

use super::basis;
use crate::{Result, Shell, Vec3};
use faer::Mat;

/// Of displacements, for differences; its error is the square of it, and rounding adds 1e-16 over its square.
const STEP: f64 = 1e-3;

/// The membrane's strains at displacements `u`.
fn strains(shell: &Shell, u: impl Fn(usize) -> Vec3) -> Vec<f64> {
    let x: Vec<Vec3> = shell.mesh.positions.iter().enumerate().map(|(v, x)| x + u(v)).collect();
    let mut strains = Vec::with_capacity(shell.energy.n_elements());
    shell.energy.visit_strains(&x, &mut |_, strain| strains.push(strain));
    strains.truncate(shell.energy.n_membrane());
    strains
}

/// (ε(hu) ± ε(−hu)) over the power of h that makes it ε′u or ½ ε″(u, u).
fn part(shell: &Shell, sign: f64, u: &[Vec3]) -> Vec<f64> {
    let [plus, minus] = [STEP, -STEP].map(|step| strains(shell, |v| step * u[v]));
    let scale = if sign < 0.0 { 0.5 / STEP } else { 0.5 / (STEP * STEP) };
    plus.iter().zip(&minus).map(|(plus, minus)| scale * (plus + sign * minus)).collect()
}

/// At most `wanted` orthonormal stress fields (membrane's elements × stresses). `bent` are the modes at the amplitudes that scenes
/// bend them to, `derivatives` the derivatives' ½ Θ_ij at these (i ≤ j, row by row), `poses` equilibria.
pub fn fields(
    shell: &Shell,
    bent: &[Vec<Vec3>],
    derivatives: &[Vec<Vec3>],
    poses: &[Vec<Vec3>],
    wanted: usize,
) -> Result<Mat<f64>> {
    let mut candidates: Vec<Vec<f64>> = poses.iter().map(|u| strains(shell, |v| u[v])).collect();
    let own: Vec<Vec<f64>> = bent.iter().map(|u| part(shell, 1.0, u)).collect();
    let mut derivatives = derivatives.iter();
    for i in 0..bent.len() {
        candidates.push(part(shell, -1.0, &bent[i]));
        for (j, derivative) in (i..bent.len()).zip(&mut derivatives) {
            let sum: Vec<Vec3> = bent[i].iter().zip(&bent[j]).map(|(a, b)| a + b).collect();
            // ½ ε″(u_i, u_j): for i = j the sum is 2u, whose half is four times it.
            let mixed = part(shell, 1.0, &sum);
            let followed = part(shell, -1.0, derivative);
            let strain = (0..mixed.len()).map(|e| 0.5 * (mixed[e] - own[i][e] - own[j][e]) + followed[e]).collect();
            candidates.push(strain);
        }
    }
    let rows = shell.energy.n_membrane();
    let mut stresses = Mat::zeros(rows, 0);
    basis::extend(&mut stresses, Mat::from_fn(rows, candidates.len(), |e, k| candidates[k][e]), wanted)?;
    Ok(stresses)
}

//! The stress fields that the membrane's strains count along ([`super::energy`]): strains ε = √(2w) s, a number an element, of
//!
//! - the strains ε at rest, of a shell that is under stress there: so all of that stress stays what it is,
//! - the modes, to first order: ε′φ_i, so that the modes keep their rest stiffness,
//! - the rest shape under loads that scenes have, to first order: ε′K⁻¹f, so that what pulls along the sheet meets its stiffness,
//!
//! all of them, and, compressed by the eigenvectors of their Gram matrix (an inner product of these strains is an energy),
//!
//! - the modes bent far, to second order: ½ ε″(φ_i, φ_j) + ½ ε′Θ_ij, what the modal derivatives leave of the stretch,
//! - the equilibria that the basis is trained on.

use super::basis;
use crate::{Result, Shell, Vec3, threads};
use faer::Mat;

/// Of displacements, for differences; its error is the square of it, and rounding adds 1e-16 over its square.
const STEP: f64 = 1e-3;

/// Nanoseconds that an element's strain takes, about.
const STRAIN: u64 = 50;

/// The membrane's strains at displacements `u`.
fn strains(shell: &Shell, u: impl Fn(usize) -> Vec3) -> Vec<f64> {
    let x: Vec<Vec3> = shell.mesh.positions.iter().enumerate().map(|(v, x)| x + u(v)).collect();
    let mut strains = Vec::with_capacity(shell.energy.n_membrane());
    shell.energy.visit_stretch(&x, &mut |strain| strains.push(strain));
    strains
}

/// Of the largest strains of modes, from which strains at rest are no rounding.
const STRAINED: f64 = 1e-6;

/// The strains at rest of a shell that is under stress there.
fn strains_at_rest(shell: &Shell) -> Option<Vec<f64>> {
    shell.is_stressed().then(|| strains(shell, |_| Vec3::zeros()))
}

/// (ε(hu) ± ε(−hu)) over the power of h that makes it ε′u or ½ ε″(u, u).
fn part(shell: &Shell, sign: f64, u: &[Vec3], rest: Option<&[f64]>) -> Vec<f64> {
    let [plus, minus] = [STEP, -STEP].map(|step| strains(shell, |v| step * u[v]));
    let scale = if sign < 0.0 { 0.5 / STEP } else { 0.5 / (STEP * STEP) };
    let mut part: Vec<f64> = plus.iter().zip(&minus).map(|(plus, minus)| scale * (plus + sign * minus)).collect();
    if let Some(rest) = rest.filter(|_| sign > 0.0) {
        part.iter_mut().zip(rest).for_each(|(part, rest)| *part -= 2.0 * scale * rest);
    }
    part
}

/// Orthonormal stress fields (membrane's elements × stresses), at most `wanted` of them compressed ones. `bent` are the modes at the
/// amplitudes that scenes bend them to, `derivatives` the derivatives' ½ Θ_ij at these (i ≤ j, row by row), `responses` K⁻¹f, `poses`
/// equilibria under loads, `led` those that handles lead to.
pub fn fields(
    shell: &Shell,
    bent: &[Vec<Vec3>],
    derivatives: &[Vec<Vec3>],
    responses: &[Vec<Vec3>],
    [poses, led]: [&[&[Vec3]]; 2],
    wanted: usize,
) -> Result<Mat<f64>> {
    let work = |shapes: usize| STRAIN * (shapes * shell.energy.n_elements()) as u64;
    let mut candidates = threads::map(poses, work(poses.len()), |u| strains(shell, |v| u[v]));
    // No led shape counts more than one under a load: a handle that is led where the shell hardly gives stretches it as no other would.
    let most = candidates.iter().map(|strain| norm(strain)).fold(0.0, f64::max);
    candidates.extend(threads::map(led, work(led.len()), |u| {
        let strain = strains(shell, |v| u[v]);
        let share = (most / norm(&strain).max(f64::MIN_POSITIVE)).min(1.0);
        strain.into_iter().map(|s| s * share).collect()
    }));
    let rest = strains_at_rest(shell);
    let part = |sign: f64, u: &[Vec3]| part(shell, sign, u, rest.as_deref());
    let own = threads::map(bent, work(2 * bent.len()), |u| part(1.0, u));
    let responses: Vec<Vec<Vec3>> = responses.iter().map(|u| of_the_size(shell, u)).collect();
    let linear: Vec<&Vec<Vec3>> = bent.iter().chain(&responses).collect();
    let mut first = threads::map(&linear, work(2 * linear.len()), |u| part(-1.0, u));
    let largest = first[..bent.len()].iter().map(|strain| norm(strain)).fold(0.0, f64::max);
    first.extend(rest.clone().filter(|rest| norm(rest) > STRAINED * largest));
    let first: Vec<Vec<f64>> = first.into_iter().map(unit).collect();
    let pairs = (0..bent.len()).flat_map(|i| (i..bent.len()).map(move |j| (i, j)));
    let pairs: Vec<((usize, usize), &Vec<Vec3>)> = pairs.zip(derivatives).collect();
    candidates.extend(threads::map(&pairs, work(4 * pairs.len()), |&((i, j), derivative)| {
        let sum: Vec<Vec3> = bent[i].iter().zip(&bent[j]).map(|(a, b)| a + b).collect();
        // ½ ε″(u_i, u_j): for i = j the sum is 2u, whose half is four times it.
        let mixed = part(1.0, &sum);
        let followed = part(-1.0, derivative);
        (0..mixed.len()).map(|e| 0.5 * (mixed[e] - own[i][e] - own[j][e]) + followed[e]).collect()
    }));
    let rows = shell.energy.n_membrane();
    let columns = |list: &[Vec<f64>]| Mat::from_fn(rows, list.len(), |e, k| list[k][e]);
    let mut stresses = Mat::zeros(rows, 0);
    basis::extend(&mut stresses, columns(&first), first.len())?;
    basis::extend(&mut stresses, columns(&candidates), wanted)?;
    Ok(stresses)
}

/// A displacement at about the size of the shell: its differences are not rounding then, in whatever units its stiffness is.
fn of_the_size(shell: &Shell, u: &[Vec3]) -> Vec<Vec3> {
    let longest = u.iter().map(|u| u.norm()).fold(0.0, f64::max);
    if longest == 0.0 {
        return u.to_vec();
    }
    // A power of two: in units of stiffness that are one from these, the bits are the same.
    let scale = libm::exp2(libm::round(libm::log2(shell.mesh.size / longest)).min(1000.0));
    u.iter().map(|u| scale * u).collect()
}

/// Of length 1, or 0.
fn unit(strain: Vec<f64>) -> Vec<f64> {
    let norm = norm(&strain).max(f64::MIN_POSITIVE);
    strain.iter().map(|s| s / norm).collect()
}

fn norm(strain: &[f64]) -> f64 {
    strain.iter().map(|s| s * s).sum::<f64>().sqrt()
}

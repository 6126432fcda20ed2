//! The fields of a reduced basis: the lowest modes, then what they need to bend without stretching.
//!
//! A mode bent far drags others along. To second order the static response to loads along the modes is
//! u = Σ φ_i q_i + ½ Σ Θ_ij q_i q_j with the modal derivatives (Idelsohn, Cardona 1985; Barbič, James 2005)
//!
//!   Θ_ij = −K⁻¹ E‴(φ_i, φ_j).
//!
//! Under loads of all modes alike q_i is as 1/λ_i, so Θ_ij counts with the weight λ₁²/(λ_i λ_j). The weighted derivatives, and
//! whatever poses the basis is trained on, are compressed to the wanted number by the eigenvectors of their Gram matrix in the mass
//! norm, M-orthogonal to the modes.
//!
//! Everything here is in mass-scaled unknowns y = M^½ u, where M-orthonormal is orthonormal.

use crate::energy::Curvature;
use crate::modes::{ScaledStiffness, symmetric_eigen};
use crate::{Error, ErrorKind, Result, Shell, Vec3, threads};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::prelude::*;
use faer::{Accum, Mat, MatMut, Par};

/// The step of a mode for the difference of Hessians turns no edge by more than this, rad. Its error is the square of it; rounding
/// adds 1e-16 over it.
const DIFFERENCE: f64 = 1e-4;

/// Directions whose part beyond the others is less than this of the largest candidate are rounding.
const LEAST_PART: f64 = 1e-7;

/// A displacement field in mass-scaled unknowns.
pub fn scaled(shell: &Shell, field: &[Vec3]) -> Vec<f64> {
    shell.free.iter().flat_map(|&v| (field[v as usize] * shell.mass[v as usize].sqrt()).data.0[0]).collect()
}

/// The displacement of mass-scaled unknowns.
pub fn unscaled(shell: &Shell, y: ColRef<'_, f64>) -> Vec<Vec3> {
    let mut field = vec![Vec3::zeros(); shell.mass.len()];
    for (i, &v) in shell.free.iter().enumerate() {
        let root = shell.mass[v as usize].sqrt();
        field[v as usize] = Vec3::new(y[3 * i], y[3 * i + 1], y[3 * i + 2]) / root;
    }
    field
}

/// Columns of mass-scaled unknowns.
pub fn columns<F: AsRef<[Vec3]>>(shell: &Shell, fields: &[F]) -> Mat<f64> {
    let scaled: Vec<Vec<f64>> = fields.iter().map(|field| scaled(shell, field.as_ref())).collect();
    Mat::from_fn(shell.n_unknowns(), fields.len(), |i, j| scaled[j][i])
}

/// Of the lowest elastic eigenvalue, what is added to all where a shell can move freely; each round leaves as much of what it takes.
const SHIFT: f64 = 1e-4;
const ROUNDS: usize = 3;

/// Rigid motions that supports leave free (M-orthonormal), and the lowest eigenvalue beside them.
pub type Loose<'a> = (&'a [Vec<Vec3>], f64);

/// A⁻¹ of the mass-scaled stiffness, applied to columns; of a loose shell on what is in balance, inertia taking the rest.
pub fn solve_rest(shell: &Shell, right: &mut Mat<f64>, (rigid, lowest): Loose) -> Result<()> {
    let stiffness = ScaledStiffness::assemble(shell)?;
    let symbolic = shell.analysis(stiffness.lower.symbolic())?;
    let shift = if rigid.is_empty() { 0.0 } else { SHIFT * lowest };
    let factor = match rigid.is_empty() {
        true => symbolic.cholesky(&stiffness.lower)?,
        false => symbolic.cholesky(&stiffness.shifted(-shift))?,
    };
    let Some(factor) = factor else {
        let message = "a reduced basis needs a shell that is held: its stiffness is singular";
        return Err(Error::new(ErrorKind::Unsupported, message));
    };
    stiffness.project(shell, right.as_mut());
    if rigid.is_empty() {
        factor.solve_in_place(right.as_mut())?;
        stiffness.project(shell, right.as_mut());
        return Ok(());
    }
    let rigid = columns(shell, rigid);
    let balance = |y: &mut Mat<f64>| {
        let inside = rigid.transpose() * &*y;
        *y -= &rigid * inside;
    };
    balance(right);
    let mut solution = Mat::zeros(right.nrows(), right.ncols());
    for _ in 0..ROUNDS {
        let mut next = &*right + &solution * faer::Scale(shift);
        factor.solve_in_place(next.as_mut())?;
        balance(&mut next);
        solution = next;
    }
    *right = solution;
    Ok(())
}

/// Θ_ij for i ≤ j, row by row (m(m + 1)/2 fields): differences of exact Hessians at x̄ ± εφ_j give E‴(φ_i, φ_j).
pub fn modal_derivatives(shell: &Shell, shapes: &[Vec<Vec3>], loose: Loose) -> Result<Vec<Vec<Vec3>>> {
    let (n, m) = (shell.mass.len(), shapes.len());
    let mut forces = vec![vec![Vec3::zeros(); n]; m * (m + 1) / 2];
    let at = |i: usize, j: usize| i * m - i * (i + 1) / 2 + j; // i ≤ j
    for j in 0..m {
        let step = DIFFERENCE / steepest(shell, &shapes[j]);
        for sign in [1.0, -1.0] {
            let x: Vec<Vec3> = shell.mesh.positions.iter().zip(&shapes[j]).map(|(x, u)| x + sign * step * u).collect();
            shell.energy.visit_hessian(&x, Curvature::Exact, &mut |(vertices, blocks)| {
                for i in 0..=j {
                    for (p, &v) in vertices.iter().enumerate() {
                        let row = &blocks[p * vertices.len()..];
                        let force: Vec3 =
                            vertices.iter().zip(row).map(|(&w, block)| block * shapes[i][w as usize]).sum();
                        forces[at(i, j)][v as usize] -= force * (0.5 * sign / step);
                    }
                }
            });
        }
    }
    let by_root: Vec<f64> = shell.mass.iter().map(|m| 1.0 / m.sqrt()).collect();
    for force in &mut forces {
        force.iter_mut().zip(&by_root).for_each(|(f, root)| *f *= root * root); // columns() brings M^½
    }
    let mut right = columns(shell, &forces);
    solve_rest(shell, &mut right, loose)?;
    Ok((0..right.ncols()).map(|k| unscaled(shell, right.col(k))).collect())
}

/// The largest rotation or stretch of an edge per unit of `field`.
fn steepest(shell: &Shell, field: &[Vec3]) -> f64 {
    let slope = |e: &crate::mesh::Edge| {
        let [a, b] = e.vertices.map(|v| v as usize);
        (field[b] - field[a]).norm() / (shell.mesh.positions[b] - shell.mesh.positions[a]).norm()
    };
    shell.mesh.edges.iter().map(slope).fold(f64::MIN_POSITIVE, f64::max)
}

/// Rows whose products a thread sums, at least.
const ROWS: usize = 2048;
/// Nanoseconds that a multiplication of a matrix product takes, about.
pub const MULTIPLICATION: f64 = 0.05;

/// sum += left × right, of its lower triangle.
pub fn add_lower(sum: MatMut<'_, f64>, left: MatRef<'_, f64>, right: MatRef<'_, f64>) {
    let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    matmul(sum, lower, Accum::Add, left, whole, right, whole, 1.0, Par::Seq);
}

/// YᵀY.
fn gram(y: &Mat<f64>) -> Mat<f64> {
    let (rows, n) = y.shape();
    let firsts: Vec<usize> = (0..rows).step_by(ROWS).collect();
    let work = 0.5 * MULTIPLICATION * (rows * n * n) as f64;
    let sums = threads::map(&threads::parts(&firsts, 1), work as u64, |part| {
        let mut sum = Mat::zeros(n, n);
        for first in part.iter() {
            let some = y.subrows(*first, ROWS.min(rows - first));
            add_lower(sum.as_mut(), some.transpose(), some);
        }
        sum
    });
    let mut sum = Mat::<f64>::zeros(n, n);
    sums.iter().for_each(|part| sum += part);
    Mat::from_fn(n, n, |i, j| sum[(i.max(j), i.min(j))])
}

/// Yx, by as many rows as [`gram`] takes.
fn product(y: &Mat<f64>, x: &Mat<f64>) -> Mat<f64> {
    let firsts: Vec<usize> = (0..y.nrows()).step_by(ROWS).collect();
    let work = MULTIPLICATION * (y.nrows() * x.nrows() * x.ncols()) as f64;
    let parts = threads::map(&firsts, work as u64, |first| {
        let rows = y.subrows(*first, ROWS.min(y.nrows() - first));
        let mut part = Mat::zeros(rows.nrows(), x.ncols());
        faer::linalg::matmul::matmul(part.as_mut(), Accum::Replace, rows, x, 1.0, Par::Seq);
        part
    });
    let mut out = Mat::zeros(y.nrows(), x.ncols());
    for (first, part) in firsts.into_iter().zip(&parts) {
        out.subrows_mut(first, part.nrows()).copy_from(part);
    }
    out
}

/// Appends to the orthonormal columns `basis` up to `wanted` orthonormal directions that hold most of `candidates`.
pub fn extend(basis: &mut Mat<f64>, candidates: Mat<f64>, wanted: usize) -> Result<()> {
    extend_by(basis, candidates, (wanted, LEAST_PART))
}

/// The same, of directions along which candidates have more than this part of the largest.
pub fn extend_by(basis: &mut Mat<f64>, mut candidates: Mat<f64>, (wanted, least): (usize, f64)) -> Result<()> {
    let largest = (0..candidates.ncols()).map(|k| candidates.col(k).norm_l2()).fold(0.0, f64::max);
    for _ in 0..2 {
        let inside = basis.transpose() * &candidates;
        candidates -= &*basis * inside;
    }
    let (values, vectors) = symmetric_eigen(gram(&candidates).as_ref())?;
    let told = |k: &usize| values[*k] > (least * largest).powi(2);
    let kept: Vec<usize> = (0..values.len()).rev().take(wanted).take_while(told).collect();
    let mixing = Mat::from_fn(values.len(), kept.len(), |i, k| vectors[(i, kept[k])]);
    let directions = product(&candidates, &mixing);
    for k in 0..kept.len() {
        let mut y = directions.col(k).to_owned();
        for _ in 0..2 {
            let inside = basis.transpose() * &y;
            y -= &*basis * inside;
            y = &y * faer::Scale(1.0 / y.norm_l2());
        }
        let last = basis.ncols();
        basis.resize_with(y.nrows(), last + 1, |i, _| y[i]);
    }
    Ok(())
}

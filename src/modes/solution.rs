//! The lowest eigenpairs of one piece.
//!
//! They are counted by inertia. Eigenvalues are the energies of their vectors, which must agree with the factorized stiffness.

use super::search::{self, Pairs, Plan, Search};
use super::{Phase, Progress, ScaledStiffness, sort_columns};
use crate::energy::rest_quadratic_form;
use crate::error::reserve;
use crate::shell::Sag;
use crate::sparse::Symbolic;
use crate::support::{Roller, rigid_motions};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use faer::prelude::*;

/// Without bending or length stiffness the mechanisms are not known beforehand; an eigenvalue below this multiple of ‖A‖ then
/// counts as zero. Summed as squares, a mechanism gives some (1e-15)²‖A‖.
const ZERO_MODE: f64 = 1e-20;

/// The two values of an eigenvalue, from the factorized matrix and from the energy of its vector, may differ by this share, and
/// so much of other modes may be in a vector: the energy's own error is of the second order in it, 1e-4.
const LEAST_AGREEMENT: f64 = 0.01;

/// See the module's text.
pub struct Solution {
    /// All that were found below `shift`, ascending; a zero mode's is exactly 0.
    pub eigenvalues: Vec<f64>,
    /// Mass-scaled, orthonormal (n_unknowns × eigenvalues).
    pub vectors: Mat<f64>,
    /// The shift below which eigenvalues were counted.
    pub shift: f64,
    /// How many there are by inertia.
    pub count: usize,
    /// Largest disagreement between an eigenvalue by the factorized stiffness and by its energy, a share.
    pub disagreement: f64,
    /// Estimate of the most memory held at once, bytes.
    pub peak_bytes: usize,
}

impl Solution {
    /// The `wanted` lowest of a shell in one piece, or as many as there are, to the end of the last one's group.
    pub fn new(shell: &Shell, stiffness: &ScaledStiffness, wanted: usize, progress: &mut Progress) -> Result<Self> {
        let n = shell.n_unknowns();
        let wanted = wanted.min(shell.n_freedoms());
        progress.report(Phase::Ordering, 0.0)?;
        let symbolic = shell.analysis(stiffness.lower.symbolic())?;
        progress.report(Phase::Ordering, 1.0)?;
        let dense = n <= search::dense_limit(wanted);
        let work = if dense { 2 * n * n } else { 2 * n * Plan::of(wanted, n).capacity };
        let peak_bytes = symbolic.factor_bytes() + 8 * work + 3 * 16 * stiffness.lower.val().len();
        drop(reserve::<u8>("the search for modes", peak_bytes)?); // told now, not after minutes
        let rigid = rigid_freedoms(shell);
        if shell.is_stressed() {
            refuse_buckled(shell, &symbolic, stiffness, rigid)?;
        }
        let search = Search { shell, stiffness, symbolic: &symbolic, wanted, rigid };
        let pairs = search.run(progress)?;
        let mut vectors = pairs.vectors.subcols(0, pairs.converged).to_owned();
        stiffness.project(shell, vectors.as_mut());
        let quotient = |j: usize| rayleigh_quotient(shell, stiffness, vectors.col(j));
        let mut eigenvalues: Vec<f64> = (0..pairs.converged).map(quotient).collect();
        sort_columns(&mut eigenvalues, &mut vectors);
        let zero_modes = match search.rigid {
            Some(freedoms) => freedoms.min(eigenvalues.len()),
            None => eigenvalues.iter().filter(|lambda| **lambda < ZERO_MODE * stiffness.norm).count(),
        };
        eigenvalues[..zero_modes].fill(0.0);
        let disagreement = require_digits(&search, &pairs, &eigenvalues, &vectors)?;
        let Pairs { shift, count, .. } = pairs;
        Ok(Self { eigenvalues, vectors, shift, count, disagreement, peak_bytes })
    }
}

/// Of ‖A‖, how far below zero the eigenvalues of free motions may come to lie by rounding, and where stress is balanced to 1e-8.
const ABOUT_ZERO: f64 = 1e-9;

/// Fails where the pose is no minimum of energy: vibration about it has no meaning.
fn refuse_buckled(shell: &Shell, symbolic: &Symbolic, stiffness: &ScaledStiffness, rigid: Option<usize>) -> Result<()> {
    let negative = match rigid {
        Some(0) => symbolic.negative_eigenvalues(&stiffness.lower)?,
        _ => symbolic.negative_eigenvalues(&stiffness.shifted(-ABOUT_ZERO * stiffness.norm))?,
    };
    match negative {
        Some(0) | None => Ok(()),
        Some(count) => {
            let pose = match &shell.sag {
                Some(Sag { gravity: g, .. }) => format!("the pose under the gravity {:?}", [g.x, g.y, g.z]),
                None => "the shape in which the shell rests by its rest shape, growth or angles".into(),
            };
            let message = format!("{pose} is unstable in {count} directions: it is about to buckle");
            Err(Error::new(ErrorKind::Numerical, message))
        }
    }
}

/// The dimension of the null space of K, known from the supports when lengths and angles both resist: the rigid motions that a shell in
/// one piece keeps. `None` when one of them is missing, so that there are further mechanisms.
pub fn rigid_freedoms(shell: &Shell) -> Option<usize> {
    if shell.sag.is_some() {
        return Some(0); // what moves freely does not come to rest under its weight
    }
    if !shell.resists_all() {
        return None;
    }
    let mesh = &shell.mesh;
    let own = shell.free.first().map(|v| mesh.component[*v as usize]);
    let held = (0..mesh.positions.len()).filter(|&v| shell.held[v] && Some(mesh.component[v]) == own);
    if held.clone().any(|v| shell.is_clamped(v)) {
        return Some(0);
    }
    let points = held.map(|v| mesh.positions[v]).collect::<Vec<Vec3>>();
    let rollers = shell.rollers.iter().filter(|roller| Some(mesh.component[roller.vertex as usize]) == own);
    let along = |roller: &Roller| {
        let x = mesh.positions[roller.vertex as usize];
        roller.directions().map(move |n| (x, n)).collect::<Vec<_>>()
    };
    let along: Vec<(Vec3, Vec3)> = rollers.flat_map(along).collect();
    let turns = shell.mirrored_edges().filter(|(v, _)| Some(mesh.component[*v as usize]) == own).map(|(_, n)| n);
    let about: Vec<Vec3> = turns.collect();
    if along.is_empty() && about.is_empty() {
        return Some(freedoms_about(&points));
    }
    let whole = points.iter().flat_map(|x| [Vec3::x(), Vec3::y(), Vec3::z()].map(|n| (*x, n)));
    Some(rigid_motions(&whole.chain(along.iter().copied()).collect::<Vec<_>>(), &about))
}

/// Rigid motions that leave the points in place: 6 without any, 3 about one, 1 about a line, 0 otherwise.
fn freedoms_about(points: &[Vec3]) -> usize {
    let Some(first) = points.first() else { return 6 };
    let longest = points.iter().map(|p| p - first).max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let longest = longest.unwrap_or_default();
    let widest = points.iter().map(|p| (p - first).cross(&longest).norm()).fold(0.0, f64::max);
    // A width of 1e-8 lengths is a line up to the coordinates' own rounding far from the origin.
    match (longest.norm_squared(), widest) {
        (0.0, _) => 3,
        (length, width) if width <= 1e-8 * length => 1,
        _ => 0,
    }
}

/// Fails when rounding of ‖A‖ hides the modes: the search's eigenvalues, those of the matrix as assembled and factorized, are
/// then not the energies of its vectors. Where only the shift swallows the eigenvalue, the vectors are looked at themselves.
/// Returns the largest disagreement.
fn require_digits(search: &Search, pairs: &Pairs, eigenvalues: &[f64], vectors: &Mat<f64>) -> Result<f64> {
    // Of a stressed shell rounding can leave one below zero, which no number of digits makes right.
    let apart = |k: usize| match eigenvalues[k] {
        lambda if lambda > 0.0 => (pairs.eigenvalues[k] - lambda).abs() / lambda,
        _ => f64::INFINITY,
    };
    let elastic = (0..search.wanted.min(eigenvalues.len())).filter(|&k| eigenvalues[k] != 0.0);
    let mut largest = 0.0f64;
    for k in elastic {
        if apart(k) <= LEAST_AGREEMENT {
            largest = largest.max(apart(k));
            continue;
        }
        let lambda = eigenvalues[k];
        let error = match pairs.sigma {
            // The energy's rows are those of the rest pose.
            Some(sigma) if !search.shell.is_stressed() => vector_error(search, sigma, vectors.col(k), lambda)?,
            _ => apart(k),
        };
        if error.is_nan() || error > LEAST_AGREEMENT {
            let norm = search.stiffness.norm;
            let message = format!(
                "mode {k} of {}: its eigenvalue is {:.3e} by the factorized stiffness and {lambda:.3e} by its energy, a \
                 share of {:.1e} of the largest, {norm:.1e}: stiffness or triangle sizes differ too much for 64-bit numbers",
                search.wanted,
                pairs.eigenvalues[k],
                lambda / norm
            );
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        largest = largest.max(error);
    }
    Ok(largest)
}

/// How much of other low modes is in `y`: max(|σ|, λ) |(A − σI)⁻¹ (Ay − λy)|/λ, with Ay from the energy's rows, whose rounding
/// is that of √(‖A‖λ) instead of ‖A‖.
fn vector_error(search: &Search, sigma: f64, y: ColRef<'_, f64>, lambda: f64) -> Result<f64> {
    let Search { shell, stiffness, symbolic, .. } = search;
    let Some(cholesky) = symbolic.cholesky(&stiffness.shifted(sigma))? else { return Ok(f64::INFINITY) };
    let root_mass = &stiffness.root_mass;
    let phi: Vec<f64> = y.iter().zip(root_mass).map(|(y, r)| y / r).collect();
    let field = shell.scatter(&phi);
    let mut image = vec![Vec3::zeros(); field.len()];
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        let strain: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&field[v as usize])).sum();
        vertices.iter().zip(row).for_each(|(&v, b)| image[v as usize] += strain * b);
    });
    let residual =
        |k: usize, _| image[shell.free[k / 3] as usize][k % 3] / root_mass[k] - lambda * phi[k] * root_mass[k];
    let mut residual = Mat::from_fn(root_mass.len(), 1, residual);
    stiffness.project(shell, residual.as_mut());
    cholesky.solve_in_place(residual.as_mut())?;
    Ok(sigma.abs().max(lambda) * residual.norm_l2() / (lambda * y.norm_l2()))
}

/// yᵀAy/yᵀy, at rest as a sum of squares, which keeps small eigenvalues accurate.
fn rayleigh_quotient(shell: &Shell, stiffness: &ScaledStiffness, y: ColRef<'_, f64>) -> f64 {
    if shell.is_stressed() {
        let y: Vec<f64> = y.iter().copied().collect();
        let image = stiffness.apply(&y);
        return image.iter().zip(&y).map(|(a, y)| a * y).sum::<f64>() / y.iter().map(|y| y * y).sum::<f64>();
    }
    let phi: Vec<f64> = y.iter().zip(&stiffness.root_mass).map(|(y, r)| y / r).collect();
    rest_quadratic_form(&*shell.energy, &shell.scatter(&phi)) / y.squared_norm_l2()
}

//! The lowest vibration modes: KΦ = MΦΛ, ΦᵀMΦ = I, with a certificate.
//!
//! Assembly of the mass-scaled stiffness, its factorization, a shift-invert search whose result is counted by matrix inertia,
//! and a stated sign and basis. Components of very different stiffness over mass are solved apart, small stiff shells refined by
//! the energy's rows, and what 64-bit numbers cannot resolve is refused with the numbers.

mod canonical;
mod demand;
mod dense;
mod inverse;
mod jacobi;
mod lanczos;
mod part;
mod search;
mod stiffness;

pub use canonical::{REPEATED, repeated};
pub use demand::Demand;
pub use dense::symmetric_eigen;
pub use stiffness::{ScaledStiffness, entries};

use crate::energy::rest_quadratic_form;
use crate::error::reserve;
use crate::sparse::Symbolic;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use faer::prelude::*;
use part::Part;
use search::{Pairs, Plan, Search};
use std::time::Instant;

/// No more modes than this: the dense work grows with its cube, and no warp needs so many.
pub const MAX_MODES: usize = 1024;

/// Without bending or length stiffness the mechanisms are not known beforehand; an eigenvalue below this multiple of ‖A‖ then
/// counts as zero. Summed as squares, a mechanism gives some (1e-15)²‖A‖.
const ZERO_MODE: f64 = 1e-20;

/// The two values of an eigenvalue, from the factorized matrix and from the energy of its vector, may differ by this share, and
/// so much of other modes may be in a vector: the energy's own error is of the second order in it, 1e-4.
const LEAST_AGREEMENT: f64 = 0.01;

/// Modes that are computed first where a tolerance tells how many are needed.
const FIRST_SEARCH: usize = 16;

/// Parts of a precompute, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Stiffness and masses.
    Assembly,
    /// Fill-reducing ordering and symbolic factorization.
    Ordering,
    /// Numeric factorization.
    Factorization,
    /// Eigenvalue iteration.
    Modes,
    /// Inertia count and residuals.
    Certificate,
    /// Modal rotations, run-time layout, and the reduced shell.
    Rotation,
}

/// Number of [`Phase`]s.
pub const PHASES: usize = 6;

/// Told about each phase's start (0), progress and end (1), and seconds spent; may stop the work with an error.
pub struct Progress<'a> {
    callback: &'a mut dyn FnMut(Phase, f64) -> Result<()>,
    /// Seconds spent in each phase.
    pub seconds: [f64; PHASES],
    since: Instant,
}

impl<'a> Progress<'a> {
    /// Reports to `callback`, whose error stops the work.
    pub fn new(callback: &'a mut dyn FnMut(Phase, f64) -> Result<()>) -> Self {
        Self { callback, seconds: [0.0; PHASES], since: Instant::now() }
    }

    /// Books the time since the last report on `phase` and tells the host.
    pub fn report(&mut self, phase: Phase, fraction: f64) -> Result<()> {
        self.seconds[phase as usize] += self.since.elapsed().as_secs_f64();
        let answer = (self.callback)(phase, fraction);
        self.since = Instant::now();
        answer
    }
}

/// Evidence that the modes are what they claim to be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Certificate {
    /// max ‖Kφ − λMφ‖₂ / (‖K‖₁ ‖φ‖₂).
    pub residual: f64,
    /// max |ΦᵀMΦ − I|.
    pub orthonormality: f64,
    /// The shift τ below which eigenvalues were counted, between the last mode (with its group) and the next.
    pub shift: f64,
    /// Number of eigenvalues below τ by the inertia of K − τM.
    pub count: usize,
    /// Largest share by which a mode's eigenvalue by the factorized stiffness and by the energy of its vector differ: the digits that
    /// rounding has left of it.
    pub disagreement: f64,
    /// Number of modes found below τ; may exceed the modes kept when these end inside a repeated group.
    pub found: usize,
}

/// The lowest modes of a shell.
pub struct Modes {
    /// Eigenvalues λ, ascending; a zero mode's is exactly 0.
    pub eigenvalues: Vec<f64>,
    /// Φ: the displacement of each vertex in each mode (modes × n_vertices), M-orthonormal, zero where held.
    pub shapes: Vec<Vec<Vec3>>,
    /// How many of the eigenvalues are 0.
    pub zero_modes: usize,
    /// Evidence.
    pub certificate: Certificate,
    /// Largest estimate of memory held at once, bytes.
    pub peak_bytes: usize,
}

/// Computes the `wanted` lowest modes, or as many as there are unknowns.
pub fn lowest_modes(shell: &Shell, wanted: usize, progress: &mut Progress) -> Result<Modes> {
    progress.report(Phase::Assembly, 0.0)?;
    let stiffness = ScaledStiffness::assemble(shell)?;
    progress.report(Phase::Assembly, 1.0)?;
    let n = shell.n_unknowns();
    let wanted = wanted.min(n).min(MAX_MODES);
    if wanted == 0 {
        let certificate = Certificate::default();
        return Ok(Modes { eigenvalues: vec![], shapes: vec![], zero_modes: 0, certificate, peak_bytes: 0 });
    }
    let norm = stiffness.unscaled_norm();
    let parts = Part::split(shell, stiffness)?;
    let of_parts: Vec<Modes> =
        parts.iter().map(|part| part_modes(shell, part, (wanted, norm), progress)).collect::<Result<_>>()?;
    Ok(merge(of_parts, wanted))
}

/// The lowest modes of a part, `norm` being ‖K‖₁ of the whole; as many as wanted of the shell.
fn part_modes(shell: &Shell, part: &Part, (wanted, norm): (usize, f64), progress: &mut Progress) -> Result<Modes> {
    let n = part.n_unknowns();
    let wanted = wanted.min(n);
    progress.report(Phase::Ordering, 0.0)?;
    let symbolic = Symbolic::analyse(part.stiffness.lower.symbolic(), &shell.points(&part.free))?;
    progress.report(Phase::Ordering, 1.0)?;
    let dense = n <= search::dense_limit(wanted);
    let work = if dense { 2 * n * n } else { 2 * n * Plan::of(wanted, n).capacity };
    let peak_bytes = symbolic.factor_bytes() + 8 * work + 3 * 16 * part.stiffness.lower.val().len();
    drop(reserve::<u8>("the search for modes", peak_bytes)?); // told now, not after minutes
    if let Some(sag) = &shell.sag {
        refuse_buckled(&symbolic, &part.stiffness, sag.gravity)?;
    }
    let search = Search { shell, part, symbolic: &symbolic, wanted, rigid: rigid_freedoms(shell, part) };
    let pairs = search.run(progress)?;
    let modes = certify(&search, &pairs, norm, progress)?;
    Ok(Modes { peak_bytes, ..modes })
}

/// The modes that meet `demand`, at most `most` and those found on the way to them, with static corrections among them, and a bound on how
/// far a vertex is off without the others; `linear` where nothing turns. Twice as many are searched for until there are enough; where there are not, the bound exceeds the tolerance.
pub fn demanded_modes(
    shell: &Shell,
    demand: &Demand,
    (most, linear): (usize, bool),
    progress: &mut Progress,
) -> Result<(Modes, f64)> {
    let most = most.min(shell.n_unknowns()).min(MAX_MODES);
    let mut wanted = FIRST_SEARCH.min(most);
    loop {
        let mut modes = lowest_modes(shell, wanted, progress)?;
        let choice = demand.choose(shell, &modes, linear)?;
        if choice.bound <= demand.tolerance || wanted == most {
            if !choice.bound.is_finite() {
                let message =
                    format!("no bound on what {most} modes leave out: none of them resists anything; ask for more");
                return Err(Error::new(ErrorKind::Numerical, message));
            }
            let kept = choice.keep.iter().map(|k| (modes.eigenvalues[*k], std::mem::take(&mut modes.shapes[*k])));
            let mut all: Vec<(f64, Vec<Vec3>)> = kept.chain(choice.corrections).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            (modes.eigenvalues, modes.shapes) = all.into_iter().unzip();
            return Ok((modes, choice.bound));
        }
        wanted = (2 * wanted).min(most);
    }
}

/// The lowest of all parts' modes, zero modes part by part. Each part's list is complete up to its own shift, at or above its
/// last wanted mode; so is the whole up to the least of those and the first mode that is left out.
fn merge(mut parts: Vec<Modes>, wanted: usize) -> Modes {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    let kept: usize = parts.iter().map(|p| p.eigenvalues.len()).sum();
    let peak_bytes = parts.iter().map(|p| p.peak_bytes).max().unwrap_or(0);
    let mut certificate = Certificate::default();
    let mut missing = 0;
    let mut shift = f64::INFINITY;
    for c in parts.iter().map(|p| &p.certificate) {
        certificate.residual = certificate.residual.max(c.residual);
        certificate.orthonormality = certificate.orthonormality.max(c.orthonormality);
        certificate.disagreement = certificate.disagreement.max(c.disagreement);
        missing += c.count.saturating_sub(c.found);
        shift = shift.min(c.shift);
    }
    let mut all: Vec<(f64, Vec<Vec3>)> = Vec::with_capacity(kept);
    parts.into_iter().for_each(|p| all.extend(p.eigenvalues.into_iter().zip(p.shapes)));
    all.sort_by(|a, b| a.0.total_cmp(&b.0)); // stable: parts in order
    let last = wanted.min(all.len()) - 1;
    let end =
        (last..all.len()).find(|&i| all.get(i + 1).is_none_or(|next| !repeated(all[i].0, next.0))).unwrap_or(last);
    let above = all.get(end + 1).map_or(shift, |next| all[end].0 + 0.25 * (next.0 - all[end].0));
    certificate.shift = shift.min(above);
    certificate.found = all.iter().filter(|mode| mode.0 < certificate.shift).count();
    certificate.count = certificate.found + missing;
    all.truncate(wanted);
    let zero_modes = all.iter().filter(|mode| mode.0 == 0.0).count();
    let (eigenvalues, shapes) = all.into_iter().unzip();
    Modes { eigenvalues, shapes, zero_modes, certificate, peak_bytes }
}

/// Fails where the pose under `gravity` is no minimum of energy: vibration about it has no meaning.
fn refuse_buckled(symbolic: &Symbolic, stiffness: &ScaledStiffness, gravity: Vec3) -> Result<()> {
    match symbolic.negative_eigenvalues(&stiffness.lower)? {
        Some(0) | None => Ok(()),
        Some(count) => {
            let g = [gravity.x, gravity.y, gravity.z];
            let message =
                format!("the pose under the gravity {g:?} is unstable in {count} directions: it is about to buckle");
            Err(Error::new(ErrorKind::Numerical, message))
        }
    }
}

/// The dimension of the null space of K, known from the supports when lengths and angles both resist: the rigid motions
/// that each component of the part keeps. `None` when one of them is missing, so that there are further mechanisms.
fn rigid_freedoms(shell: &Shell, part: &Part) -> Option<usize> {
    if shell.sag.is_some() {
        return Some(0); // what moves freely does not come to rest under its weight
    }
    if shell.material.k_bend == 0.0 || shell.material.k_length == 0.0 {
        return None;
    }
    let mesh = &shell.mesh;
    let mut held: Vec<Vec<Vec3>> = vec![vec![]; mesh.n_components];
    for v in (0..mesh.positions.len()).filter(|&v| shell.held[v] && mesh.component[v] != crate::mesh::NONE) {
        held[mesh.component[v] as usize].push(mesh.positions[v]);
    }
    let components = held.iter().zip(&part.components).filter(|(_, inside)| **inside);
    Some(components.map(|(points, _)| freedoms_about(points)).sum())
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

/// Exact Rayleigh quotients, stated order and basis, residuals against `norm`, and the wanted modes spread over the vertices.
fn certify(search: &Search, pairs: &Pairs, norm: f64, progress: &mut Progress) -> Result<Modes> {
    let Search { shell, part, .. } = search;
    let root_mass = &part.stiffness.root_mass;
    let mut vectors = pairs.vectors.subcols(0, pairs.converged).to_owned();
    let quotient = |j: usize| rayleigh_quotient(shell, part, vectors.col(j));
    let mut eigenvalues: Vec<f64> = (0..pairs.converged).map(quotient).collect();
    sort_columns(&mut eigenvalues, &mut vectors);
    let zero_modes = match search.rigid {
        Some(freedoms) => freedoms.min(eigenvalues.len()),
        None => eigenvalues.iter().filter(|lambda| **lambda < ZERO_MODE * part.stiffness.norm).count(),
    };
    eigenvalues[..zero_modes].fill(0.0);
    let disagreement = require_digits(search, pairs, &eigenvalues, &vectors)?;
    canonical::canonicalize(shell, &part.free, root_mass, &eigenvalues, &mut vectors);
    eigenvalues.truncate(search.wanted);

    let mut certificate = Certificate {
        orthonormality: orthonormality(&vectors),
        shift: pairs.shift,
        count: pairs.count,
        found: pairs.converged,
        residual: 0.0,
        disagreement,
    };
    let mut shapes = Vec::with_capacity(eigenvalues.len());
    for (j, &lambda) in eigenvalues.iter().enumerate() {
        let y: Vec<f64> = vectors.col(j).iter().copied().collect();
        let phi: Vec<f64> = y.iter().zip(root_mass).map(|(y, r)| y / r).collect();
        let image = part.stiffness.apply(&y);
        let residual = (0..y.len()).map(|i| root_mass[i] * (image[i] - lambda * y[i]));
        let relative = euclidean(residual) / (norm * euclidean(phi.iter().copied()));
        certificate.residual = larger(certificate.residual, relative);
        shapes.push(part.scatter(shell, &phi));
    }
    progress.report(Phase::Certificate, 1.0)?;
    Ok(Modes { zero_modes: zero_modes.min(eigenvalues.len()), eigenvalues, shapes, certificate, peak_bytes: 0 })
}

/// Fails when rounding of ‖A‖ hides the modes: the search's eigenvalues, those of the matrix as assembled and factorized, are
/// then not the energies of its vectors. Where only the shift swallows the eigenvalue, the vectors are looked at themselves.
/// Returns the largest disagreement.
fn require_digits(search: &Search, pairs: &Pairs, eigenvalues: &[f64], vectors: &Mat<f64>) -> Result<f64> {
    let apart = |k: usize| (pairs.eigenvalues[k] - eigenvalues[k]).abs() / eigenvalues[k];
    let elastic = (0..search.wanted.min(eigenvalues.len())).filter(|&k| eigenvalues[k] > 0.0);
    let mut largest = 0.0f64;
    for k in elastic {
        if apart(k) <= LEAST_AGREEMENT {
            largest = largest.max(apart(k));
            continue;
        }
        let lambda = eigenvalues[k];
        let error = match pairs.sigma {
            // The energy's rows are those of the rest pose.
            Some(sigma) if search.shell.sag.is_none() => vector_error(search, sigma, vectors.col(k), lambda)?,
            _ => apart(k),
        };
        if error.is_nan() || error > LEAST_AGREEMENT {
            let norm = search.part.stiffness.norm;
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
    let Search { shell, part, symbolic, .. } = search;
    let Some(cholesky) = symbolic.cholesky(&part.stiffness.shifted(sigma))? else { return Ok(f64::INFINITY) };
    let root_mass = &part.stiffness.root_mass;
    let phi: Vec<f64> = y.iter().zip(root_mass).map(|(y, r)| y / r).collect();
    let field = part.scatter(shell, &phi);
    let mut image = vec![Vec3::zeros(); field.len()];
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        let strain: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&field[v as usize])).sum();
        vertices.iter().zip(row).for_each(|(&v, b)| image[v as usize] += strain * b);
    });
    let residual =
        |k: usize, _| image[part.free[k / 3] as usize][k % 3] / root_mass[k] - lambda * phi[k] * root_mass[k];
    let mut residual = Mat::from_fn(root_mass.len(), 1, residual);
    cholesky.solve_in_place(residual.as_mut())?;
    Ok(sigma.abs().max(lambda) * residual.norm_l2() / (lambda * y.norm_l2()))
}

/// yᵀAy/yᵀy, at rest as a sum of squares, which keeps small eigenvalues accurate.
fn rayleigh_quotient(shell: &Shell, part: &Part, y: ColRef<'_, f64>) -> f64 {
    if shell.sag.is_some() {
        let y: Vec<f64> = y.iter().copied().collect();
        let image = part.stiffness.apply(&y);
        return image.iter().zip(&y).map(|(a, y)| a * y).sum::<f64>() / y.iter().map(|y| y * y).sum::<f64>();
    }
    let phi: Vec<f64> = y.iter().zip(&part.stiffness.root_mass).map(|(y, r)| y / r).collect();
    rest_quadratic_form(&*shell.energy, &part.scatter(shell, &phi)) / y.squared_norm_l2()
}

/// The larger one; infinite where `b` is no number.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

fn euclidean(x: impl Iterator<Item = f64>) -> f64 {
    x.map(|x| x * x).sum::<f64>().sqrt()
}

fn sort_columns(eigenvalues: &mut [f64], vectors: &mut Mat<f64>) {
    let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
    *vectors = Mat::from_fn(vectors.nrows(), order.len(), |i, j| vectors[(i, order[j])]);
    eigenvalues.sort_by(f64::total_cmp);
}

fn orthonormality(vectors: &Mat<f64>) -> f64 {
    let gram = vectors.transpose() * vectors;
    let k = gram.ncols();
    let error = |(i, j): (usize, usize)| (gram[(i, j)] - f64::from(u8::from(i == j))).abs();
    (0..k * k).map(|ij| error((ij / k, ij % k))).fold(0.0, larger)
}

//! The lowest vibration modes: KΦ = MΦΛ, ΦᵀMΦ = I, with a certificate.
//!
//! Shift-invert block Lanczos on the sparse Cholesky factor of A − σI, A = M^−½ K M^−½. σ = 0 when A is safely positive
//! definite; otherwise σ < 0, taken from the size of A first and from the spectrum found when that turns out far off. After
//! convergence the number of eigenvalues below a shift just above the last mode is counted by the inertia of an LBLᵀ
//! factorization; while it exceeds the number found, the search goes on from fresh directions.

mod canonical;
mod dense;
mod factor;
mod lanczos;
mod stiffness;

pub use canonical::{REPEATED, repeated};
pub use stiffness::{ScaledStiffness, entries};

use crate::energy::rest_quadratic_form;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use factor::Symbolic;
use faer::Mat;
use faer::prelude::*;
use lanczos::{BlockLanczos, Ritz};
use std::time::Instant;

/// Restarts before giving up; a sweep or two is usual.
const MAX_SWEEPS: usize = 60;

/// No more modes than this: the dense work grows with its cube, and no warp needs so many.
pub const MAX_MODES: usize = 1024;

/// Converged when ‖Op y − θ y‖ ≤ this · θ. The eigenvalue's relative error is its square; the vector's is this over the
/// relative gap, so gaps of 1e-6 still leave four digits.
const TOLERANCE: f64 = 1e-10;

/// Rounding leaves residuals of about 1e-16 times the largest θ, a hundred times more after many sums: where that is above
/// the tolerance it takes its place, up to a factor of this on θ.
const LOOSEST_TOLERANCE: f64 = 1e-7;
const ROUNDING: f64 = 2e-14;

/// A shift is changed when it spreads the wanted θ over more than this, which costs digits at the small end, or when the
/// wanted eigenvalues are smaller than its own size by this, which hides their differences.
const WORST_SPREAD: f64 = 1e6;

/// Shifts tried before what was found is taken as it is.
const MAX_SHIFTS: usize = 4;

/// An eigenvalue below this multiple of ‖A‖ is a zero mode. Summed as squares, a rigid motion gives (1e-15)²‖A‖ at most; a
/// Cholesky factor cannot resolve anything between that and 1e-16 ‖A‖.
const ZERO_MODE: f64 = 1e-20;

/// The first shift of a singular A, as a multiple of ‖A‖: well above the factor's rounding (1e-16), well below most shells'
/// first mode.
const FIRST_SHIFT: f64 = 1e-10;

/// The smallest shift that still keeps A − σI safely positive definite.
const SMALLEST_SHIFT: f64 = 1e-14;

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
    /// Modal rotations and run-time layout.
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
    progress.report(Phase::Ordering, 0.0)?;
    let symbolic = Symbolic::analyse(stiffness.lower.symbolic())?;
    progress.report(Phase::Ordering, 1.0)?;

    let mut search = Search { shell, stiffness: &stiffness, symbolic: &symbolic, wanted };
    let pairs = if n <= dense_limit(wanted) { search.dense(progress)? } else { search.sparse(progress)? };
    let lanczos_bytes =
        if n <= dense_limit(wanted) { 8 * 2 * n * n } else { 8 * n * (Plan::of(wanted, n).capacity * 2) };
    let peak_bytes = 2 * symbolic.factor_bytes() + lanczos_bytes + 3 * 16 * stiffness.lower.val().len();
    search.certify(pairs, peak_bytes, progress)
}

/// Below this many unknowns the dense eigensolver is both faster and simpler.
fn dense_limit(wanted: usize) -> usize {
    (5 * wanted / 2).max(240)
}

/// Block width and basis size for a number of wanted modes.
struct Plan {
    width: usize,
    capacity: usize,
}

impl Plan {
    fn of(wanted: usize, n: usize) -> Self {
        let width = wanted.clamp(4, 8);
        let capacity = (2 * wanted + 6 * width).min(n - width);
        Self { width, capacity }
    }
}

/// Approximate eigenpairs beyond the wanted ones; the first `converged` are accurate.
struct Pairs {
    eigenvalues: Vec<f64>,
    /// Mass-scaled, orthonormal (n × at least `converged`).
    vectors: Mat<f64>,
    converged: usize,
    count: usize,
    shift: f64,
}

/// What a shift led to.
enum Outcome {
    Found(Pairs),
    /// A better shift, and what this one has found if anything.
    BadShift(f64, Option<Pairs>),
    /// A − σI is not positive definite.
    Indefinite,
    /// All wanted pairs converged, but the spectrum was not seen far enough to count them: a group larger than the basis.
    Crowded(Option<Pairs>),
}

struct Search<'a> {
    shell: &'a Shell,
    stiffness: &'a ScaledStiffness,
    symbolic: &'a Symbolic,
    wanted: usize,
}

impl Search<'_> {
    fn n(&self) -> usize {
        self.shell.n_unknowns()
    }

    /// All eigenpairs of a small A.
    fn dense(&mut self, progress: &mut Progress) -> Result<Pairs> {
        progress.report(Phase::Modes, 0.0)?;
        let n = self.n();
        let mut a = Mat::<f64>::zeros(n, n);
        entries(&self.stiffness.lower).for_each(|(i, j, value)| a[(i, j)] = value);
        let (eigenvalues, vectors) = dense::symmetric_eigen(a.as_ref())?;
        let (found, shift) = self.shift_above(&eigenvalues).unwrap_or((n, 2.0 * self.stiffness.norm));
        progress.report(Phase::Modes, 1.0)?;
        let count = self.count_below(shift, progress)?;
        Ok(Pairs { eigenvalues, vectors, converged: found, count, shift })
    }

    /// Shift-invert Lanczos, again with a better shift while the first turns out far from the spectrum.
    fn sparse(&mut self, progress: &mut Progress) -> Result<Pairs> {
        let norm = self.stiffness.norm;
        let mut sigma = if self.may_be_singular() { -FIRST_SHIFT * norm } else { 0.0 };
        let mut best: Option<Pairs> = None;
        let mut attempt = 0;
        let mut target = self.wanted;
        while attempt < MAX_SHIFTS {
            let may_change = attempt + 1 < MAX_SHIFTS;
            let outcome = self.sparse_with_shift(sigma, target, may_change, progress)?;
            if let Outcome::Crowded(pairs) = outcome {
                best = pairs.or(best);
                target = 2 * target + 8;
                if self.n() <= dense_limit(target) {
                    return self.dense(progress);
                }
                if target > 2 * MAX_MODES {
                    break;
                }
                continue;
            }
            attempt += 1;
            match outcome {
                Outcome::Crowded(_) => unreachable!(),
                Outcome::Indefinite => sigma = (100.0 * sigma).min(-SMALLEST_SHIFT * norm),
                Outcome::BadShift(better, pairs) => {
                    sigma = better;
                    best = pairs.or(best);
                }
                Outcome::Found(pairs) => return Ok(pairs),
            }
        }
        best.ok_or_else(|| Error::new(ErrorKind::Numerical, "no shift makes the stiffness matrix positive definite"))
    }

    /// The geometric mean of the first and the last wanted nonzero eigenvalue, if that serves much better than `sigma`.
    fn better_shift(&self, eigenvalues: &[f64], sigma: f64) -> Option<f64> {
        let floor = SMALLEST_SHIFT * self.stiffness.norm;
        let noise = floor.max(1e-4 * sigma.abs());
        let first =
            eigenvalues.iter().copied().find(|l| *l > noise).or(eigenvalues.iter().copied().find(|l| *l > floor))?;
        let last = eigenvalues.get(self.wanted - 1)?.max(first);
        let spread = (last - sigma) / (eigenvalues[0].max(0.0) - sigma).max(floor);
        let better = -(first * last).sqrt().max(floor);
        let changes = !(0.1..10.0).contains(&(better / sigma));
        let hidden = last < sigma.abs() / WORST_SPREAD.sqrt();
        ((spread > WORST_SPREAD || hidden) && changes).then_some(better)
    }

    /// Whether rigid motions are left free: a component held at fewer than three vertices, or only along a line.
    fn may_be_singular(&self) -> bool {
        let shell = self.shell;
        if shell.material.k_bend == 0.0 || shell.material.k_length == 0.0 {
            return true;
        }
        let mesh = &shell.mesh;
        let mut points: Vec<Vec<Vec3>> = vec![vec![]; mesh.n_components];
        for v in (0..mesh.positions.len()).filter(|&v| shell.held[v] && mesh.component[v] != crate::mesh::NONE) {
            points[mesh.component[v] as usize].push(mesh.positions[v]);
        }
        points.iter().any(|held| spanned_area(held) <= 1e-8 * mesh.size * mesh.size)
    }

    fn sparse_with_shift(
        &mut self,
        sigma: f64,
        target: usize,
        may_change: bool,
        progress: &mut Progress,
    ) -> Result<Outcome> {
        progress.report(Phase::Factorization, 0.0)?;
        let shifted = self.stiffness.shifted(sigma);
        let Some(cholesky) = self.symbolic.cholesky(&shifted)? else {
            return Ok(Outcome::Indefinite);
        };
        drop(shifted);
        progress.report(Phase::Factorization, 1.0)?;

        let plan = Plan::of(target, self.n());
        let mut lanczos = BlockLanczos::new(self.n(), plan.width, plan.capacity)?;
        let mut op = |block: MatMut<'_, f64>| cholesky.solve_in_place(block);
        let mut done = 0.0f64;
        let mut crowded_sweeps = 0;
        let mut last_pairs = None;
        // Each sweep fills the basis once; a sweep multiplies the error by the decay of a Chebyshev polynomial of its degree.
        for sweep in 0..MAX_SWEEPS {
            let mut ritz = None;
            let mut next_check = self.wanted + plan.width;
            while lanczos.room() >= plan.width {
                lanczos.step(&mut op)?;
                // A Ritz solve costs p³: only when it can show something new, and at the end.
                if lanczos.room() >= plan.width && lanczos.processed() < next_check {
                    progress.report(Phase::Modes, 0.99 * done)?;
                    continue;
                }
                next_check = lanczos.processed() + (lanczos.processed() / 6).max(plan.width);
                let found = lanczos.ritz()?;
                let converged = converged(&found);
                done = done.max(converged.min(self.wanted) as f64 / self.wanted as f64);
                progress.report(Phase::Modes, 0.99 * done)?;
                if converged >= self.wanted
                    && let Some(pairs) = self.accept(&lanczos, &found, converged, sigma, sweep, progress)?
                {
                    if pairs.count != pairs.converged {
                        last_pairs = Some(pairs);
                        ritz = Some(found);
                        continue;
                    }
                    progress.report(Phase::Modes, 1.0)?;
                    return Ok(match self.better_shift(&pairs.eigenvalues, sigma) {
                        Some(better) if may_change => Outcome::BadShift(better, Some(pairs)),
                        _ => Outcome::Found(pairs),
                    });
                }
                ritz = Some(found);
            }
            let Some(ritz) = ritz else { break };
            if may_change && let Some(better) = self.better_shift(&eigenvalues(&ritz, sigma), sigma) {
                return Ok(Outcome::BadShift(better, None));
            }
            if converged(&ritz) >= self.wanted {
                crowded_sweeps += 1;
                if crowded_sweeps >= 2 {
                    return Ok(Outcome::Crowded(last_pairs));
                }
            }
            let keep = (target + plan.width).min(plan.capacity - 2 * plan.width);
            let all_kept_converged = converged(&ritz) >= keep;
            lanczos.restart(&ritz, keep);
            if all_kept_converged {
                lanczos.refresh();
            }
        }
        if done >= 1.0 {
            return Ok(Outcome::Crowded(last_pairs));
        }
        Err(Error::new(
            ErrorKind::Numerical,
            format!("only {:.0} % of {} modes converged in {MAX_SWEEPS} sweeps", 100.0 * done, self.wanted),
        ))
    }

    /// Pairs, if the inertia agrees that none is missing; in late sweeps also without a gap to count in.
    fn accept(
        &self,
        lanczos: &BlockLanczos,
        ritz: &Ritz,
        converged: usize,
        sigma: f64,
        sweep: usize,
        progress: &mut Progress,
    ) -> Result<Option<Pairs>> {
        let eigenvalues = eigenvalues(ritz, sigma);
        let _ = sweep;
        let mut tried = None;
        // The nearest gap between converged values first, even below what ‖A‖ lets one trust: agreement of two independent
        // counts is the evidence. Then the first gap that is wide also against ‖A‖.
        let at = |i: usize| eigenvalues[i].max(0.0);
        let near = (self.wanted - 1..converged.min(eigenvalues.len()) - 1)
            .find(|&i| at(i + 1) - at(i) > 1e-4 * at(i + 1) && at(i + 1) > 1e-4 * sigma.abs())
            .map(|i| (i + 1, at(i) + 0.25 * (at(i + 1) - at(i))));
        let safe = self.shift_above(&eigenvalues).filter(|(found, _)| *found <= converged);
        for (found, shift) in near.into_iter().chain(safe) {
            let count = self.count_below(shift, progress)?;
            let agrees = count == found;
            tried = Some((found, shift, count));
            if agrees {
                break;
            }
        }
        let Some((found, shift, count)) = tried else { return Ok(None) };
        let vectors = lanczos.purified_vectors(ritz, found);
        Ok(Some(Pairs { eigenvalues, vectors, converged: found, count, shift }))
    }

    /// How many modes to the end of the last wanted one's group, and a shift in the gap behind it.
    fn shift_above(&self, eigenvalues: &[f64]) -> Option<(usize, f64)> {
        let floor = SMALLEST_SHIFT * self.stiffness.norm;
        let at = |i: usize| eigenvalues[i].max(0.0);
        let wide = |i: usize| at(i + 1) - at(i) > 1e-4 * at(i + 1) + 10.0 * floor;
        let last = (self.wanted - 1..eigenvalues.len().saturating_sub(1)).find(|&i| wide(i))?;
        Some((last + 1, at(last) + 0.25 * (at(last + 1) - at(last))))
    }

    fn count_below(&self, shift: f64, progress: &mut Progress) -> Result<usize> {
        progress.report(Phase::Certificate, 0.0)?;
        let mut shift = shift;
        for _ in 0..4 {
            if let Some(count) = self.symbolic.negative_eigenvalues(&self.stiffness.shifted(shift))? {
                progress.report(Phase::Certificate, 0.5)?;
                return Ok(count);
            }
            shift *= 1.0 + 1e-6; // an exactly zero pivot: any other shift will do
        }
        Err(Error::new(ErrorKind::Numerical, format!("the inertia at the shift {shift:e} is undecided")))
    }

    /// Exact Rayleigh quotients, stated order and basis, residuals, and the wanted modes spread over the vertices.
    fn certify(&self, pairs: Pairs, peak_bytes: usize, progress: &mut Progress) -> Result<Modes> {
        let root_mass = &self.stiffness.root_mass;
        let mut vectors = pairs.vectors.subcols(0, pairs.converged).to_owned();
        let quotient = |j: usize| self.rayleigh_quotient(vectors.col(j));
        let mut eigenvalues: Vec<f64> = (0..pairs.converged).map(quotient).collect();
        sort_columns(&mut eigenvalues, &mut vectors);
        let zero_found = match self.rigid_freedoms() {
            Some(freedoms) => freedoms.min(eigenvalues.len()),
            None => eigenvalues.iter().filter(|l| **l < ZERO_MODE * self.stiffness.norm).count(),
        };
        eigenvalues[..zero_found].fill(0.0);
        canonical::canonicalize(self.shell, root_mass, &eigenvalues, &mut vectors);
        eigenvalues.truncate(self.wanted);

        let mut certificate = Certificate {
            orthonormality: orthonormality(&vectors),
            shift: pairs.shift,
            count: pairs.count,
            found: pairs.converged,
            residual: 0.0,
        };
        let norm = self.stiffness.unscaled_norm();
        let mut shapes = Vec::with_capacity(self.wanted);
        for (j, &lambda) in eigenvalues.iter().enumerate() {
            let y: Vec<f64> = vectors.col(j).iter().copied().collect();
            let phi: Vec<f64> = y.iter().zip(root_mass).map(|(y, r)| y / r).collect();
            let image = self.stiffness.apply(&y);
            let residual = (0..y.len()).map(|i| root_mass[i] * (image[i] - lambda * y[i]));
            certificate.residual =
                certificate.residual.max(euclidean(residual) / (norm * euclidean(phi.iter().copied())));
            shapes.push(self.shell.scatter(&phi));
        }
        progress.report(Phase::Certificate, 1.0)?;
        let zero_modes = zero_found.min(self.wanted);
        Ok(Modes { eigenvalues, shapes, zero_modes, certificate, peak_bytes })
    }

    /// yᵀAy/yᵀy as a sum of squares, which keeps small eigenvalues accurate; zero modes come out as exactly 0.
    fn rayleigh_quotient(&self, y: ColRef<'_, f64>) -> f64 {
        let phi: Vec<f64> = y.iter().zip(&self.stiffness.root_mass).map(|(y, r)| y / r).collect();
        rest_quadratic_form(&*self.shell.energy, &self.shell.scatter(&phi)) / y.squared_norm_l2()
    }

    /// The dimension of the null space of K, known from the supports when lengths and angles both resist: the rigid motions
    /// that each component keeps. `None` when one of them is missing, so that there are further mechanisms.
    fn rigid_freedoms(&self) -> Option<usize> {
        let shell = self.shell;
        if shell.material.k_bend == 0.0 || shell.material.k_length == 0.0 {
            return None;
        }
        let mesh = &shell.mesh;
        let mut held: Vec<Vec<Vec3>> = vec![vec![]; mesh.n_components];
        for v in (0..mesh.positions.len()).filter(|&v| shell.held[v] && mesh.component[v] != crate::mesh::NONE) {
            held[mesh.component[v] as usize].push(mesh.positions[v]);
        }
        Some(
            held.iter()
                .map(|points| match points.as_slice() {
                    [] => 6,
                    [first, ..] => {
                        let far = points.iter().map(|p| (p - first).norm_squared()).fold(0.0, f64::max);
                        if far == 0.0 {
                            3
                        } else if spanned_area(points) <= 1e-8 * far {
                            1
                        } else {
                            0
                        }
                    }
                })
                .sum(),
        )
    }
}

/// λ = σ + 1/θ of the Ritz values, ascending.
fn eigenvalues(ritz: &Ritz, sigma: f64) -> Vec<f64> {
    ritz.values.iter().take_while(|theta| **theta > 0.0).map(|theta| sigma + 1.0 / theta).collect()
}

/// Ritz pairs, counted from the first, whose residual is below the tolerance.
fn converged(ritz: &Ritz) -> usize {
    let rounding = ROUNDING * ritz.values[0];
    let small =
        |theta: f64, residual: f64| residual <= (TOLERANCE * theta).max(rounding.min(LOOSEST_TOLERANCE * theta));
    ritz.values.iter().zip(&ritz.residuals).take_while(|(theta, residual)| small(**theta, **residual)).count()
}

/// Twice the area of the largest triangle that the first points and any third one span.
fn spanned_area(points: &[Vec3]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let far = points.iter().map(|p| p - first).max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let far = far.unwrap_or_default();
    points.iter().map(|p| (p - first).cross(&far).norm()).fold(0.0, f64::max)
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
    (0..k * k).map(|ij| error((ij / k, ij % k))).fold(0.0, f64::max)
}

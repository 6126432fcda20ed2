//! Finds the lowest eigenpairs of A by shift-invert, and counts what lies below them.
//!
//! σ = 0 when A is safely positive definite; otherwise σ < 0, taken from the size of A first and from the spectrum found when
//! that turns out far off. After convergence the eigenvalues below a shift just above the last mode are counted by inertia.
//! While the count exceeds what was found, the search goes on from fresh directions, and when a group of close eigenvalues
//! outgrows the basis, with a larger one.

use super::inverse::Inverse;
use super::lanczos::{BlockLanczos, Ritz};
use super::{Phase, Progress, ScaledStiffness, dense, entries, jacobi, sort_columns};
use crate::limits::MAX_MODES;
use crate::sparse::{Factor, Symbolic};
use crate::{Error, ErrorKind, Result, Shell};
use faer::Mat;

/// Restarts before giving up; a sweep or two is usual.
const MAX_SWEEPS: usize = 60;

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

/// The first shift of a singular A, as a multiple of ‖A‖: well above the factor's rounding (1e-16), well below most shells'
/// first mode.
const FIRST_SHIFT: f64 = 1e-10;

/// The smallest shift that still keeps A − σI safely positive definite.
const SMALLEST_SHIFT: f64 = 1e-14;

/// A dense eigenvalue below this share of ‖A‖ has lost six digits, and the vectors are refined; above this many unknowns
/// that would take longer than everything else, and what is lost is told by the energies.
const FEW_DIGITS: f64 = 1e-10;
const REFINED: usize = 600;

/// Sweeps that may end with all wanted modes converged and the count in disagreement, before the basis grows.
const CROWDED_SWEEPS: usize = 2;

/// Below this many unknowns the dense eigensolver is both faster and simpler.
pub fn dense_limit(wanted: usize) -> usize {
    (5 * wanted / 2).max(240)
}

/// Block width and basis size for a number of wanted modes.
pub struct Plan {
    width: usize,
    /// Columns of the basis.
    pub capacity: usize,
}

impl Plan {
    /// For `wanted` of `n` eigenpairs.
    pub fn of(wanted: usize, n: usize) -> Self {
        let width = wanted.clamp(4, 8);
        let capacity = (2 * wanted + 6 * width).min(n - width);
        Self { width, capacity }
    }
}

/// Approximate eigenpairs, some beyond the wanted ones; the first `converged` are accurate.
pub struct Pairs {
    pub eigenvalues: Vec<f64>,
    /// Mass-scaled, orthonormal (n × at least `converged`).
    pub vectors: Mat<f64>,
    pub converged: usize,
    /// Eigenvalues below `shift` by inertia.
    pub count: usize,
    pub shift: f64,
    /// σ of the search; `None` for a dense one.
    pub sigma: Option<f64>,
}

/// What a shift led to.
enum Outcome {
    Found(Pairs),
    /// A better shift, and what this one has found if anything.
    BadShift(f64, Option<Pairs>),
    /// A − σI is not positive definite.
    Indefinite,
    /// All wanted pairs converged, but more eigenvalues lie below the last than the basis can hold.
    Crowded(Option<Pairs>),
}

/// The eigenvalue problem.
pub struct Search<'a> {
    pub shell: &'a Shell,
    pub stiffness: &'a ScaledStiffness,
    pub symbolic: &'a Symbolic,
    /// Eigenpairs wanted.
    pub wanted: usize,
    /// Dimension of A's null space, where it is known beforehand.
    pub rigid: Option<usize>,
}

impl Search<'_> {
    /// The wanted pairs, to the end of the last one's group.
    pub fn run(&self, progress: &mut Progress) -> Result<Pairs> {
        if self.n() <= dense_limit(self.wanted) { self.dense(progress) } else { self.sparse(progress) }
    }

    fn n(&self) -> usize {
        self.shell.n_unknowns()
    }

    /// All eigenpairs of a small A.
    fn dense(&self, progress: &mut Progress) -> Result<Pairs> {
        progress.report(Phase::Modes, 0.0)?;
        let n = self.n();
        let mut a = Mat::<f64>::zeros(n, n);
        entries(&self.stiffness.lower).for_each(|(i, j, value)| a[(i, j)] = value);
        let (mut eigenvalues, mut vectors) = dense::symmetric_eigen(a.as_ref())?;
        let n = self.shell.n_freedoms(); // what rollers hold lies above
        if n < eigenvalues.len() {
            eigenvalues.truncate(n);
            vectors = vectors.subcols(0, n).to_owned();
        }
        let elastic = eigenvalues.get(self.rigid.unwrap_or(0)).copied().unwrap_or(f64::INFINITY);
        if elastic < FEW_DIGITS * self.stiffness.norm && n <= REFINED && !self.shell.is_stressed() {
            eigenvalues = jacobi::refine(self.shell, &mut vectors);
            sort_columns(&mut eigenvalues, &mut vectors);
        }
        let (found, shift) = self.shift_above(&eigenvalues).unwrap_or((n, 2.0 * self.stiffness.norm));
        progress.report(Phase::Modes, 1.0)?;
        let count = self.count_below(shift, &mut self.symbolic.factor()?, progress)?;
        Ok(Pairs { eigenvalues, vectors, converged: found, count, shift, sigma: None })
    }

    /// Shift-invert Lanczos, again with a better shift while the first turns out far from the spectrum, and with a larger
    /// basis while a group does not fit.
    fn sparse(&self, progress: &mut Progress) -> Result<Pairs> {
        let norm = self.stiffness.norm;
        let mut sigma = if self.rigid != Some(0) { -FIRST_SHIFT * norm } else { 0.0 };
        let mut best = None;
        let (mut shifts, mut target) = (1, self.wanted);
        while shifts <= MAX_SHIFTS && target <= 2 * MAX_MODES {
            let found = match self.with_shift(sigma, target, shifts < MAX_SHIFTS, progress)? {
                Outcome::Found(pairs) => return Ok(pairs),
                Outcome::Crowded(pairs) => {
                    target = 2 * target + 8;
                    if self.n() <= dense_limit(target) {
                        return self.dense(progress);
                    }
                    pairs
                }
                Outcome::BadShift(better, pairs) => {
                    (sigma, shifts) = (better, shifts + 1);
                    pairs
                }
                Outcome::Indefinite => {
                    (sigma, shifts) = ((100.0 * sigma).min(-SMALLEST_SHIFT * norm), shifts + 1);
                    None
                }
            };
            best = found.or(best);
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

    fn with_shift(&self, sigma: f64, target: usize, may_change: bool, progress: &mut Progress) -> Result<Outcome> {
        progress.report(Phase::Factorization, 0.0)?;
        let Some(mut inverse) = Inverse::new(self.symbolic, self.stiffness, sigma)? else {
            return Ok(Outcome::Indefinite);
        };
        progress.report(Phase::Factorization, 1.0)?;

        let plan = Plan::of(target, self.n());
        let mut lanczos = BlockLanczos::new(self.n(), plan.width, plan.capacity)?;
        let (mut crowded, mut disputed, mut done) = (0, None, 0.0f64);
        // Each sweep fills the basis once; a sweep multiplies the error by the decay of a Chebyshev polynomial of its degree.
        for _ in 0..MAX_SWEEPS {
            let ritz = match self.sweep(&mut lanczos, &mut inverse, &plan, sigma, &mut done, progress)? {
                (_, Some(pairs)) if pairs.count == pairs.converged => {
                    progress.report(Phase::Modes, 1.0)?;
                    return Ok(match self.better_shift(&pairs.eigenvalues, sigma) {
                        Some(better) if may_change => Outcome::BadShift(better, Some(pairs)),
                        _ => Outcome::Found(pairs),
                    });
                }
                (ritz, pairs) => {
                    disputed = pairs.or(disputed);
                    ritz
                }
            };
            if may_change && let Some(better) = self.better_shift(&eigenvalues(&ritz, sigma), sigma) {
                return Ok(Outcome::BadShift(better, None));
            }
            crowded += usize::from(converged(&ritz) >= self.wanted);
            if crowded >= CROWDED_SWEEPS {
                return Ok(Outcome::Crowded(disputed));
            }
            let keep = (target + plan.width).min(plan.capacity - 2 * plan.width);
            lanczos.restart(&ritz, keep);
            if converged(&ritz) >= keep {
                lanczos.refresh();
            }
        }
        let diagonal = self.stiffness.diagonal();
        let [least, most] = [f64::INFINITY, 0.0].map(|start| {
            let choose = if start > 0.0 { f64::min } else { f64::max };
            diagonal.iter().copied().fold(start, choose)
        });
        let message = format!(
            "only {:.0} % of {} modes converged: stiffness over mass ranges from {least:.1e} to {most:.1e} 1/s^2 at single \
             vertices and the modes lie far below ({:.1e} is rounding): stiffness or triangle sizes differ too much for \
             64-bit numbers",
            100.0 * done,
            self.wanted,
            f64::EPSILON * self.stiffness.norm
        );
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// Fills the basis. Returns early with pairs on which two counts agree, otherwise the last Ritz pairs and the last
    /// pairs whose count was disputed.
    fn sweep(
        &self,
        lanczos: &mut BlockLanczos,
        inverse: &mut Inverse,
        plan: &Plan,
        sigma: f64,
        done: &mut f64,
        progress: &mut Progress,
    ) -> Result<(Ritz, Option<Pairs>)> {
        let mut disputed = None;
        let mut next_check = self.wanted + plan.width;
        loop {
            lanczos.step(&mut |block| inverse.apply(block))?;
            let full = lanczos.room() < plan.width;
            // A Ritz solve costs p³: only when it can show something new, and at the end.
            if !full && lanczos.processed() < next_check {
                progress.report(Phase::Modes, 0.99 * *done)?;
                continue;
            }
            next_check = lanczos.processed() + (lanczos.processed() / 6).max(plan.width);
            let ritz = lanczos.ritz()?;
            let converged = converged(&ritz);
            *done = done.max(converged.min(self.wanted) as f64 / self.wanted as f64);
            progress.report(Phase::Modes, 0.99 * *done)?;
            if converged >= self.wanted
                && let Some(pairs) = self.accept(lanczos, inverse, (&ritz, converged), sigma, progress)?
            {
                if pairs.count == pairs.converged {
                    return Ok((ritz, Some(pairs)));
                }
                disputed = Some(pairs);
            }
            if full {
                return Ok((ritz, disputed));
            }
        }
    }

    /// Pairs, if the inertia agrees that none is missing; otherwise the disputed ones; `None` without a gap to count in.
    fn accept(
        &self,
        lanczos: &BlockLanczos,
        inverse: &mut Inverse,
        (ritz, converged): (&Ritz, usize),
        sigma: f64,
        progress: &mut Progress,
    ) -> Result<Option<Pairs>> {
        let eigenvalues = eigenvalues(ritz, sigma);
        let mut tried = None;
        // The nearest gap between converged values first, even below what ‖A‖ lets one trust: agreement of two independent
        // counts is the evidence. Then the first gap that is wide also against ‖A‖.
        let at = |i: usize| eigenvalues[i].max(0.0);
        let near = (self.wanted - 1..converged.min(eigenvalues.len()) - 1)
            .find(|&i| at(i + 1) - at(i) > 1e-4 * at(i + 1) && at(i + 1) > 1e-4 * sigma.abs())
            .map(|i| (i + 1, at(i) + 0.25 * (at(i + 1) - at(i))));
        let safe = self.shift_above(&eigenvalues).filter(|(found, _)| *found <= converged);
        for (found, shift) in near.into_iter().chain(safe) {
            let count = self.count_below(shift, inverse.room(), progress)?;
            let agrees = count == found;
            tried = Some((found, shift, count));
            if agrees {
                break;
            }
        }
        let Some((found, shift, count)) = tried else { return Ok(None) };
        let vectors = lanczos.purified_vectors(ritz, found);
        Ok(Some(Pairs { eigenvalues, vectors, converged: found, count, shift, sigma: Some(sigma) }))
    }

    /// How many modes to the end of the last wanted one's group, and a shift in the gap behind it.
    fn shift_above(&self, eigenvalues: &[f64]) -> Option<(usize, f64)> {
        let floor = SMALLEST_SHIFT * self.stiffness.norm;
        let at = |i: usize| eigenvalues[i].max(0.0);
        let wide = |i: usize| at(i + 1) - at(i) > 1e-4 * at(i + 1) + 10.0 * floor;
        let last = (self.wanted - 1..eigenvalues.len().saturating_sub(1)).find(|&i| wide(i))?;
        Some((last + 1, at(last) + 0.25 * (at(last + 1) - at(last))))
    }

    fn count_below(&self, shift: f64, room: &mut Factor, progress: &mut Progress) -> Result<usize> {
        progress.report(Phase::Certificate, 0.0)?;
        let mut shift = shift;
        for _ in 0..4 {
            if let Some(count) = self.symbolic.negative_eigenvalues_in(&self.stiffness.shifted(shift), room)? {
                progress.report(Phase::Certificate, 0.5)?;
                return Ok(count);
            }
            shift *= 1.0 + 1e-6; // an exactly zero pivot: any other shift will do
        }
        Err(Error::new(ErrorKind::Numerical, format!("the inertia at the shift {shift:e} is undecided")))
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

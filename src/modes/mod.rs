//! The lowest vibration modes: KΦ = MΦΛ, ΦᵀMΦ = I, with a certificate.
//!
//! Assembly of the mass-scaled stiffness, its factorization, a shift-invert search whose result is counted by matrix inertia,
//! and a stated sign and basis. Pieces that nothing couples are solved apart, small stiff shells refined by the energy's rows, and what
//! 64-bit numbers cannot resolve is refused with the numbers.

mod canonical;
mod demand;
mod dense;
mod inverse;
mod jacobi;
mod lanczos;
mod merge;
mod patches;
mod pieces;
mod search;
mod solution;
mod stiffness;
mod supports;

pub use canonical::{REPEATED, repeated};
pub use demand::Demand;
pub use dense::symmetric_eigen;
pub use patches::add_patches;
pub use stiffness::{ScaledStiffness, entries};
pub use supports::{Shapes, SupportFields, groups, supported};

use crate::clock::Instant;
use crate::limits::MAX_MODES;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use pieces::Piece;
use solution::{Solution, rigid_freedoms};
use std::ops::Range;

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
    /// Modal rotations and run-time layout.
    Rotation,
    /// Equilibria of the full shell, and the reduced shell that is trained on them.
    Training,
}

/// Number of [`Phase`]s.
pub const PHASES: usize = 7;

/// Told about each phase's start (0), progress and end (1), and seconds spent; may stop the work with an error.
pub struct Progress<'a> {
    callback: &'a mut dyn FnMut(Phase, f64) -> Result<()>,
    /// Seconds spent in each phase.
    pub seconds: [f64; PHASES],
    since: Instant,
    /// The last fraction reported of a search in pieces.
    reported: f64,
}

/// Pieces that are less of the work than this are told of together.
const LEAST_NEWS: f64 = 1e-3;

impl<'a> Progress<'a> {
    /// Reports to `callback`, whose error stops the work.
    pub fn new(callback: &'a mut dyn FnMut(Phase, f64) -> Result<()>) -> Self {
        Self { callback, seconds: [0.0; PHASES], since: Instant::now(), reported: 0.0 }
    }

    /// Books the time since the last report on `phase` and tells the host.
    pub fn report(&mut self, phase: Phase, fraction: f64) -> Result<()> {
        self.seconds[phase as usize] += self.since.elapsed().as_secs_f64();
        let answer = (self.callback)(phase, fraction);
        self.since = Instant::now();
        answer
    }

    /// Tells of `work` on one piece of many, in whatever phases, as the fractions `share` of the search for modes.
    fn within<T>(&mut self, share: Range<f64>, work: impl FnOnce(&mut Progress) -> Result<T>) -> Result<T> {
        let width = share.end - share.start;
        let mut done = 0.0f64;
        let mut tell = |phase, fraction: f64| {
            done = if phase == Phase::Modes { done.max(fraction) } else { done };
            let at = share.start + width * done;
            if width < LEAST_NEWS && at < self.reported + LEAST_NEWS {
                return Ok(());
            }
            self.reported = at;
            (self.callback)(Phase::Modes, at)
        };
        let mut inner = Progress::new(&mut tell);
        let outcome = work(&mut inner);
        let seconds = inner.seconds;
        self.seconds.iter_mut().zip(seconds).for_each(|(sum, more)| *sum += more);
        self.since = Instant::now();
        outcome
    }
}

/// Evidence that the modes are what they claim to be.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpectrumCertificate {
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
    pub certificate: SpectrumCertificate,
    /// Largest estimate of memory held at once, bytes.
    pub peak_bytes: usize,
}

impl Modes {
    /// Those that bend the shell, where others move it freely.
    pub fn elastic(&self) -> Option<Self> {
        let free = self.zero_modes;
        (free > 0).then(|| Self {
            eigenvalues: self.eigenvalues[free..].to_vec(),
            shapes: self.shapes[free..].to_vec(),
            zero_modes: 0,
            ..*self
        })
    }
}

/// Computes the `wanted` lowest modes, or as many as there are unknowns.
pub fn lowest_modes(shell: &Shell, wanted: usize, progress: &mut Progress) -> Result<Modes> {
    progress.report(Phase::Assembly, 0.0)?;
    let stiffness = ScaledStiffness::assemble(shell)?;
    progress.report(Phase::Assembly, 1.0)?;
    let wanted = wanted.min(shell.n_freedoms()).min(MAX_MODES);
    if wanted == 0 {
        let certificate = SpectrumCertificate::default();
        return Ok(Modes { eigenvalues: vec![], shapes: vec![], zero_modes: 0, certificate, peak_bytes: 0 });
    }
    let pieces = Piece::split(shell, &stiffness);
    let solved = match &pieces[..] {
        [_] => vec![Solution::new(shell, &stiffness, wanted, progress)?],
        _ => pieces::solve(shell, &pieces, wanted, progress)?,
    };
    merge::merge(shell, &stiffness, (&pieces, &solved), wanted, progress)
}

/// The modes that meet `demand`, at most `most` and those found on the way to them, with static corrections among them, and a bound on how
/// far a vertex is off without the others; `linear` where nothing turns. Twice as many are searched for until there are enough; where there are not, the bound exceeds the tolerance.
pub fn demanded_modes(
    shell: &Shell,
    demand: &Demand,
    (most, linear): (usize, bool),
    progress: &mut Progress,
) -> Result<(Modes, f64)> {
    let most = most.min(shell.n_freedoms()).min(MAX_MODES);
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

fn sort_columns(eigenvalues: &mut [f64], vectors: &mut Mat<f64>) {
    let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
    *vectors = Mat::from_fn(vectors.nrows(), order.len(), |i, j| vectors[(i, order[j])]);
    eigenvalues.sort_by(f64::total_cmp);
}

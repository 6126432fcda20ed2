//! Newton's method in reduced coordinates for the minimum of
//!
//!   Π(q) = E(x̄ + Bq) + W(x̄ + Bq) + ½ s |q|² + ½ qᵀCq − bᵀq     subject to Jq + γμ = d
//!
//! with the compliance γ of each constraint and its force μ, and an energy W of single points that may join.
//!
//! Where the exact Hessian is not positive definite, the semidefinite one with a shift takes its place. A straight step along
//! bending fields stretches the shell and raises Π, and the next step takes the stretch out again; so steps may raise Π twice in
//! a row as long as it then falls below where it was (the watchdog of Chamberlain et al. 1982, as in [`crate::reference`]). Where no
//! step lowers Π one is taken all the same, and taken back if nothing comes of it: folds of a torn shell wall it in.
//! The line search is on Π + ρ Σ|Jq − d| over hard constraints with ρ above every μ, + Σ (Jq − d)²/2γ over soft ones.
//!
//! As long as steps with the last Hessian gain a factor each, no new one is made (chord iterations): a Hessian costs as much as many
//! gradients.
//!
//! What counts of H is its part along motions that hard constraints leave free: a shell that buckles under a load may be stable
//! where a constraint leads it, and H alone is indefinite there. So H + σJᵀJ takes its place, with the same solution for
//! Jq = d and μ + σ(d − Jq) for μ (the augmented Lagrangian; Nocedal, Wright 2006, 17.3). On the way to an equilibrium the first
//! step goes the whole way to the constraints, whatever it stretches; from there on all steps are along them. In motion it does
//! not: a vertex torn away faster than the shell can follow would load it like a catapult.

mod approach;
mod descend;
mod rows;

pub use rows::Rows;

use super::Joined;
use super::elastic::{Elastic, Scratch};
use super::factor::Factor;
use super::products::{dot_all, sum_of};
use crate::energy::Curvature;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Halvings before a line search gives up.
const TRIALS: usize = 40;
/// Below this residual rounding of Π may hide what a step gains.
const ROUNDING: f64 = 1e-6;
/// Of Π's scale, a slope upward that is none: constraints that are met but for the last bits, and bear much, make up to 1.4e-12.
const FLAT: f64 = 1e-11;
/// Π without E.
pub struct Potential<'a> {
    /// s.
    pub shift: f64,
    /// C.
    pub matrix: Option<&'a DMatrix<f64>>,
    /// More on the diagonal of C.
    pub diagonal: Option<&'a [f64]>,
    /// b.
    pub load: &'a [f64],
    /// Constraints.
    pub constraints: Option<&'a Rows>,
    /// W.
    pub joined: Option<Joined<'a>>,
}

impl<'a> Potential<'a> {
    /// Of a dead load alone.
    pub fn of_load(load: &'a [f64]) -> Self {
        Self { shift: 0.0, matrix: None, diagonal: None, load, constraints: None, joined: None }
    }
}

/// When to stop.
#[derive(Clone, Copy)]
pub struct Stop {
    /// Converged when a Newton step would lower Π by less than the square of this, relative to what Π's terms are made of.
    pub tolerance: f64,
    /// Linear solves at most.
    pub iterations: usize,
    /// The first step goes the whole way to hard constraints, whatever it stretches; else a search may cut it short.
    pub led: bool,
    /// The Hessian of the search before is near enough to begin with.
    pub near: bool,
    /// What Π's terms are taken for where they are less: of a shell that comes to rest without load they all vanish.
    pub least: f64,
}

/// What searches took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Hessians, two or more where the exact one is not positive definite.
    pub hessians: usize,
    /// Gradients, with a linear solve each.
    pub gradients: usize,
    /// Shapes that were looked at.
    pub shapes: usize,
}

/// How it ended.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// To the tolerance.
    pub converged: bool,
    /// Linear solves.
    pub iterations: usize,
    /// √(−∇Π·Δ / scale) of the last direction.
    pub residual: f64,
}

/// Room for the work.
#[derive(Clone)]
pub struct Newton {
    scratch: Scratch,
    gradient: DVector<f64>,
    direction: DVector<f64>,
    trial: Vec<f64>,
    mark: Vec<f64>,
    mark_direction: DVector<f64>,
    /// Where no step lowered Π, if one was taken all the same and is not made up for.
    wall: Vec<f64>,
    leapt: bool,
    work: Work,
    /// An approach's Hessian, and its factor.
    near: Factor,
    /// Δ·HΔ of the last direction by it.
    near_work: f64,
    /// The last Hessian was an approach's.
    approached: bool,
    /// Of the last Hessian; none after one that was not positive definite, whatever was tried.
    factor: Option<Cholesky<f64, Dyn>>,
    /// μ (rows), H⁻¹Jᵀ (n × rows) and the rows' own matrix.
    multipliers: DVector<f64>,
    response: DMatrix<f64>,
    flexibility: Option<DMatrix<f64>>,
    missing: DVector<f64>,
    /// Where constraints can be met: d, or the mean of what contradicts each other.
    goal: DVector<f64>,
    /// σ of each row.
    held: DVector<f64>,
    /// ρ.
    penalty: f64,
    exact: bool,
}

impl Newton {
    /// For evaluations of `energy`.
    pub fn new(energy: &dyn Elastic) -> Self {
        let n = energy.n();
        Self {
            scratch: energy.scratch(),
            gradient: DVector::zeros(n),
            direction: DVector::zeros(n),
            trial: vec![0.0; n],
            mark: vec![0.0; n],
            mark_direction: DVector::zeros(n),
            wall: vec![0.0; n],
            leapt: false,
            work: Work::default(),
            near: Factor::new(n, energy.arch()),
            near_work: 0.0,
            approached: false,
            factor: Cholesky::new(DMatrix::identity(n, n)),
            multipliers: DVector::zeros(0),
            response: DMatrix::zeros(n, 0),
            flexibility: Some(DMatrix::zeros(0, 0)),
            missing: DVector::zeros(0),
            goal: DVector::zeros(0),
            held: DVector::zeros(0),
            penalty: 0.0,
            exact: true,
        }
    }

    /// Makes room for so many rows of constraints.
    pub fn make_room(&mut self, rows: usize) {
        if self.missing.len() != rows {
            self.multipliers = DVector::zeros(rows);
            self.missing = DVector::zeros(rows);
            self.goal = DVector::zeros(rows);
            self.held = DVector::zeros(rows);
            self.response = DMatrix::zeros(self.trial.len(), rows);
            self.flexibility = Some(DMatrix::zeros(rows, rows));
        }
    }

    /// Room for evaluations beside.
    pub fn scratch(&mut self) -> &mut Scratch {
        &mut self.scratch
    }

    /// What was done since it was asked last.
    pub fn take_work(&mut self) -> Work {
        let Work { hessians, gradients, .. } = std::mem::take(&mut self.work);
        Work { hessians, gradients, shapes: self.scratch.take_shapes() }
    }

    /// μ of the constraints at the end of the last search.
    pub fn multipliers(&self) -> &DVector<f64> {
        &self.multipliers
    }

    /// As if no search had been.
    pub fn forget_multipliers(&mut self) {
        self.multipliers.fill(0.0);
    }

    /// What inertia alone, `shift` times 1, answers of what the last Hessian does: x becomes shift H⁻¹x. Without a Hessian it stays.
    pub fn filter(&mut self, shift: f64, x: &mut [f64]) {
        if self.approached {
            self.near.solve(x);
        } else if let Some(factor) = &self.factor {
            self.direction.as_mut_slice().copy_from_slice(x);
            factor.solve_mut(&mut self.direction);
            x.copy_from_slice(self.direction.as_slice());
        } else {
            return;
        }
        x.iter_mut().for_each(|x| *x *= shift);
    }

    /// Whether Π is not larger at `a` than at `b`, hard constraints aside.
    pub fn is_lower(&mut self, energy: &dyn Elastic, potential: &Potential, a: &[f64], b: &[f64]) -> bool {
        self.penalty = 0.0;
        if let Some(rows) = potential.constraints {
            self.goal.copy_from(&rows.target);
        }
        let [at_b, at_a] = [b, a].map(|q| {
            let elastic = energy.near_value(q, &mut self.scratch);
            self.merit_beside(elastic, potential, q)
        });
        at_a <= at_b // a last, as the search begins there most often
    }

    /// Moves `q` to a minimum; where it finds none, not to where Π is larger. Does not allocate.
    pub fn minimize(&mut self, energy: &dyn Elastic, potential: &Potential, q: &mut [f64], stop: Stop) -> End {
        self.leapt = false;
        let end = self.descend(energy, potential, q, stop);
        if !end.converged && !self.has_landed(energy, potential, q) {
            q.copy_from_slice(&self.wall);
        }
        end
    }

    fn step(&mut self, q: &[f64]) {
        for k in 0..q.len() {
            self.trial[k] = q[k] + self.direction[k];
        }
    }

    fn trial_merit(&mut self, energy: &dyn Elastic, potential: &Potential) -> f64 {
        let trial = std::mem::take(&mut self.trial);
        let value = self.merit(energy, potential, &trial);
        self.trial = trial;
        value
    }

    /// Π + ρ Σ|Jq − d|.
    fn merit(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> f64 {
        let elastic = energy.value(q, &mut self.scratch);
        self.merit_beside(elastic, potential, q)
    }

    /// The same, with E.
    fn merit_beside(&self, elastic: f64, potential: &Potential, q: &[f64]) -> f64 {
        let quadratic: f64 = q.iter().zip(potential.load).map(|(q, b)| q * (0.5 * potential.shift * q - b)).sum();
        let along = |c: &[f64]| c.iter().zip(q).map(|(c, q)| c * q * q).sum::<f64>();
        let viscous = potential.matrix.map_or(0.0, |c| 0.5 * self.product(c, q, |k, cq| q[k] * cq))
            + potential.diagonal.map_or(0.0, |c| 0.5 * along(c));
        let strayed = potential.constraints.map_or(0.0, |rows| {
            (0..rows.len()).map(|i| self.price(self.goal[i] - rows.along(i, q), rows.compliance[i])).sum::<f64>()
        });
        let joined = potential.joined.map_or(0.0, |joined| joined.value(q));
        elastic + quadratic + viscous + strayed + joined
    }

    /// Of missing a constraint by so much.
    fn price(&self, missing: f64, compliance: f64) -> f64 {
        if compliance > 0.0 { 0.5 * missing * missing / compliance } else { self.penalty * missing.abs() }
    }

    /// Σ f(k, (Cq)_k).
    fn product(&self, c: &DMatrix<f64>, q: &[f64], mut f: impl FnMut(usize, f64) -> f64) -> f64 {
        (0..q.len()).map(|k| f(k, dot_all(&c.as_slice()[k * q.len()..][..q.len()], q))).sum()
    }

    /// Δ, with the last Hessian or with a new one; returns its slope and the scale of Π, or none without a descent direction.
    fn find_direction(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &[f64],
        near: bool,
    ) -> Option<(f64, f64)> {
        let scale = self.find_gradient(energy, potential, q);
        if !near {
            self.factorize(energy, potential, q);
        }
        let factor = self.factor.take()?;
        let slope = self.solve(&factor, potential, q);
        self.factor = Some(factor);
        (slope <= FLAT * scale).then_some((slope.min(0.0), scale))
    }

    /// ∇Π without constraints; returns the scale of Π.
    fn find_gradient(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> f64 {
        energy.gradient(q, &mut self.scratch, self.gradient.as_mut_slice());
        self.complete_gradient(potential, q)
    }

    /// ∇Π of ∇E; returns the scale of Π.
    fn complete_gradient(&mut self, potential: &Potential, q: &[f64]) -> f64 {
        self.work.gradients += 1;
        let elastic = sum_of(q, self.gradient.as_slice(), |q, g| (q * g).abs());
        let own = self.gradient.as_mut_slice();
        for ((gradient, q), load) in own.iter_mut().zip(q).zip(potential.load) {
            *gradient += potential.shift * q - load;
        }
        if let Some(c) = potential.matrix {
            let columns = c.as_slice().chunks_exact(q.len().max(1));
            own.iter_mut().zip(columns).for_each(|(gradient, column)| *gradient += dot_all(column, q));
        }
        if let Some(c) = potential.diagonal {
            own.iter_mut().zip(c.iter().zip(q)).for_each(|(gradient, (c, q))| *gradient += c * q);
        }
        if let Some(joined) = potential.joined {
            joined.add_gradient(q, self.gradient.as_mut_slice());
        }
        let work = sum_of(q, potential.load, |q, b| (q * b).abs());
        work + elastic + f64::MIN_POSITIVE
    }

    /// The factor of the Hessian at `q`, or of one near it that is positive definite.
    fn factorize(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) {
        let mut shift = 0.0;
        self.approached = false;
        for attempt in 0..TRIALS {
            let curvature = if attempt == 0 { Curvature::Exact } else { Curvature::Semidefinite };
            let mut hessian =
                self.factor.take().map_or_else(|| DMatrix::zeros(q.len(), q.len()), |factor| factor.unpack_dirty());
            energy.hessian(q, curvature, &mut self.scratch, &mut hessian);
            self.work.hessians += 1;
            let diagonal = |k: usize| potential.diagonal.map_or(0.0, |c| c[k]);
            (0..q.len()).for_each(|k| hessian[(k, k)] += potential.shift + shift + diagonal(k));
            if let Some(c) = potential.matrix {
                hessian += c;
            }
            if let Some(joined) = potential.joined {
                joined.add_hessian(q, curvature, &mut hessian);
            }
            let trace = hessian.trace();
            if let Some(rows) = potential.constraints {
                self.hold(rows, &mut hessian);
            }
            self.exact = attempt == 0;
            // What is not positive shows as infinite, so that the matrix is not lost with it.
            self.factor = Cholesky::new_with_substitute(hessian, f64::INFINITY);
            if self.factor.as_ref().is_some_and(|factor| (0..q.len()).all(|k| factor.l_dirty()[(k, k)].is_finite())) {
                return;
            }
            shift = if attempt == 0 { 0.0 } else { (10.0 * shift).max(1e-12 * trace.abs()) };
        }
        self.factor = None;
    }
}

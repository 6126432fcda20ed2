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
//! where a handle leads it, and H alone is indefinite there. So H + σJᵀJ takes its place, with the same solution for
//! Jq = d and μ + σ(d − Jq) for μ (the augmented Lagrangian; Nocedal, Wright 2006, 17.3). On the way to an equilibrium the first
//! step goes the whole way to the constraints, whatever it stretches; from there on all steps are along them. In motion it does
//! not: a vertex torn away faster than the shell can follow would load it like a catapult.

use super::Joined;
use super::elastic::{Elastic, Scratch};
use super::factor::Factor;
use crate::energy::Curvature;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Sufficient decrease, as a share of the slope's promise.
const DECREASE: f64 = 1e-4;
/// Steps in a row that may leave Π above the mark.
const VENTURES: usize = 2;
/// Halvings before a line search gives up.
const TRIALS: usize = 40;
/// Of a residual, what a step with the last Hessian leaves at most; it costs about a tenth of one with a new Hessian.
const CHORD: f64 = 0.2;
/// Of the square of a residual, what a Newton step leaves; and a step with the Hessian before it, of its square over the residual then. An
/// estimate: on shells that swing by their size nearly all leave less, a fifth of it as a rule, and none ten times as much.
const SQUARED: f64 = 10.0;
/// Newton steps on the way there, at most, the residual that the first may have, and what a later one may have of the one before.
const APPROACHES: usize = 4;
const FAR: f64 = 1.0;
const GAINED: f64 = 0.8;
/// Along such a step, Π curves at least this much of what inertia alone does.
const FIRM: f64 = 0.5;
/// Below this residual rounding of Π may hide what a step gains.
const ROUNDING: f64 = 1e-6;
/// ε of J H⁻¹ Jᵀ + ε, relative to each diagonal entry, so that constraints may repeat or conflict.
const LEAST_CONSTRAINT: f64 = 1e-10;
/// Stiffness along a hard constraint that H is given, over H's largest: none of its other directions feels it.
const HELD: f64 = 10.0;

/// Π without E.
pub struct Potential<'a> {
    /// s.
    pub shift: f64,
    /// C.
    pub matrix: Option<&'a DMatrix<f64>>,
    /// b.
    pub load: &'a [f64],
    /// Constraints.
    pub handles: Option<&'a Rows>,
    /// W.
    pub joined: Option<Joined<'a>>,
}

impl<'a> Potential<'a> {
    /// Of a dead load alone.
    pub fn of_load(load: &'a [f64]) -> Self {
        Self { shift: 0.0, matrix: None, load, handles: None, joined: None }
    }
}

/// Linear constraints.
#[derive(Clone)]
pub struct Rows {
    /// J (n × rows).
    pub jacobian: DMatrix<f64>,
    /// d.
    pub target: DVector<f64>,
    /// γ.
    pub compliance: DVector<f64>,
    /// Hard constraints that no q of this norm meets are led only as far as one does.
    pub reach: f64,
}

impl Rows {
    /// So many, on `n` coordinates.
    pub fn new(rows: usize, n: usize) -> Self {
        let zeros = DVector::zeros(rows);
        Self { jacobian: DMatrix::zeros(n, rows), target: zeros.clone(), compliance: zeros, reach: f64::INFINITY }
    }

    /// Their number.
    pub fn len(&self) -> usize {
        self.target.len()
    }

    /// None.
    pub fn is_empty(&self) -> bool {
        self.target.is_empty()
    }

    /// (J v)_i.
    pub fn along(&self, i: usize, v: &[f64]) -> f64 {
        self.jacobian.column(i).iter().zip(v).map(|(j, v)| j * v).sum()
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
    /// The lower triangle of an approach's Hessian, and its factor.
    hessian: DMatrix<f64>,
    near: Factor,
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
            hessian: DMatrix::zeros(n, n),
            near: Factor::new(n),
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

    /// Whether Π is not larger at `a` than at `b`, hard constraints aside.
    pub fn is_lower(&mut self, energy: &dyn Elastic, potential: &Potential, a: &[f64], b: &[f64]) -> bool {
        self.penalty = 0.0;
        if let Some(rows) = potential.handles {
            self.goal.copy_from(&rows.target);
        }
        let at_b = self.merit(energy, potential, b);
        self.merit(energy, potential, a) <= at_b // last, as the search begins there most often
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

    /// Moves `q` by a few Newton steps to where by their residuals at most `tolerance` is left, without looking at Π: without constraints,
    /// where no energy of points acts, and by exact Hessians far from singular. Otherwise it leaves `q` as it is.
    pub fn approach(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &mut [f64],
        tolerance: f64,
    ) -> Option<End> {
        let acts = |q: &[f64]| potential.joined.is_some_and(|joined| joined.value(q) != 0.0);
        if potential.handles.is_some() || acts(q) {
            return None; // of what may jump, residuals say little of what is left
        }
        self.mark.copy_from_slice(q);
        let end = self.approached(energy, potential, q, tolerance).filter(|_| !acts(q));
        if end.is_none() {
            q.copy_from_slice(&self.mark);
        }
        end
    }

    fn approached(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &mut [f64],
        tolerance: f64,
    ) -> Option<End> {
        let mut before = f64::INFINITY;
        for iterations in 1..=APPROACHES {
            let scale = self.find_gradient(energy, potential, q);
            let mut residual = f64::INFINITY;
            if iterations > 1 {
                residual = self.approaching(scale)?;
                if residual > GAINED * before {
                    return None;
                }
            }
            let mut left = SQUARED * residual * residual / before;
            if iterations == 1 || left > tolerance {
                if !self.factorize_near(energy, potential, q) {
                    return None;
                }
                residual = self.approaching(scale)?;
                left = SQUARED * residual * residual;
                let firm = FIRM * potential.shift * self.direction.norm_squared();
                if residual > FAR || -self.gradient.dot(&self.direction) < firm {
                    return None;
                }
            }
            q.iter_mut().zip(self.direction.iter()).for_each(|(q, d)| *q += d);
            if left <= tolerance {
                return Some(End { converged: true, iterations, residual: left });
            }
            before = residual;
        }
        None
    }

    /// The factor of the exact Hessian at `q`; false where it is not positive definite.
    fn factorize_near(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> bool {
        energy.hessian(q, Curvature::Exact, &mut self.scratch, &mut self.hessian);
        self.work.hessians += 1;
        for (k, mut column) in self.hessian.column_iter_mut().enumerate() {
            column[k] += potential.shift;
            if let Some(c) = potential.matrix {
                column.iter_mut().zip(c.column(k).iter()).skip(k).for_each(|(out, c)| *out += c);
            }
        }
        self.near.factorize(&self.hessian)
    }

    /// Δ of an approach, and its residual; none without a descent direction.
    fn approaching(&mut self, scale: f64) -> Option<f64> {
        self.direction.copy_from(&self.gradient);
        self.direction.neg_mut();
        self.near.solve(self.direction.as_mut_slice());
        let slope = self.gradient.dot(&self.direction);
        (slope <= ROUNDING * ROUNDING * scale).then(|| (-slope.min(0.0) / scale).sqrt())
    }

    /// Whether Π is below that at the wall, if there was one.
    fn has_landed(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> bool {
        if self.leapt {
            let wall = std::mem::take(&mut self.wall);
            self.leapt = self.merit(energy, potential, q) > self.merit(energy, potential, &wall);
            self.wall = wall;
        }
        !self.leapt
    }

    fn descend(&mut self, energy: &dyn Elastic, potential: &Potential, q: &mut [f64], stop: Stop) -> End {
        let mut mark = (f64::INFINITY, 0.0, f64::INFINITY);
        let mut ventures = 0;
        let (mut residual, mut near) = (f64::INFINITY, stop.near);
        self.penalty = 0.0;
        let mut penalty = 0.0;
        if let Some(rows) = potential.handles {
            self.find_goal(rows);
        }
        for iterations in 0..stop.iterations {
            let before = residual;
            let mut found = self.find_direction(energy, potential, q, near);
            let of = |(slope, scale): (f64, f64)| (-slope / scale).max(0.0).sqrt();
            if near && found.is_none_or(|found| of(found) > (CHORD * before).max(stop.tolerance)) {
                near = false;
                found = self.find_direction(energy, potential, q, near);
            }
            let Some((slope, scale)) = found else {
                if ventures > 0 {
                    q.copy_from_slice(&self.mark);
                }
                return End { converged: false, iterations, residual };
            };
            residual = of((slope, scale));
            if ventures > 0 && self.penalty > penalty {
                let at_mark = std::mem::take(&mut self.mark);
                mark.0 = self.merit(energy, potential, &at_mark);
                self.mark = at_mark;
            }
            penalty = self.penalty;
            if stop.led && iterations == 0 && self.is_off(potential) {
                self.step(q);
                if self.trial_merit(energy, potential).is_finite() {
                    q.copy_from_slice(&self.trial);
                    continue;
                }
            }
            if residual <= stop.tolerance && (ventures == 0 || self.merit(energy, potential, q) <= mark.0) {
                self.step(q);
                q.copy_from_slice(&self.trial);
                return End { converged: true, iterations: iterations + 1, residual };
            }
            if ventures == 0 {
                mark = (self.merit(energy, potential, q), slope, residual);
                self.mark.copy_from_slice(q);
                self.mark_direction.copy_from(&self.direction);
            }
            self.step(q);
            let value = self.trial_merit(energy, potential);
            if value <= mark.0 + DECREASE * mark.1 {
                near = !stop.led && self.exact && ventures == 0;
                ventures = 0;
            } else if near {
                (near, residual) = (false, before);
                continue;
            } else if self.exact && ventures < VENTURES && value.is_finite() && iterations + 1 < stop.iterations {
                ventures += 1;
            } else {
                q.copy_from_slice(&self.mark);
                ventures = 0;
                if !self.search(energy, potential, q, (mark.0, mark.1)) {
                    let residual = mark.2;
                    let converged = residual <= ROUNDING;
                    if converged || !self.has_landed(energy, potential, q) {
                        return End { converged, iterations: iterations + 1, residual };
                    }
                    self.leapt = true;
                    self.wall.copy_from_slice(q);
                    (0..q.len()).for_each(|k| self.trial[k] = q[k] + self.mark_direction[k]);
                }
            }
            q.copy_from_slice(&self.trial);
        }
        End { converged: false, iterations: stop.iterations, residual }
    }

    /// From the mark at `q` along its direction to a sufficient decrease; false when there is none.
    fn search(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64], (value, slope): (f64, f64)) -> bool {
        let mut alpha = 1.0;
        for _ in 0..TRIALS {
            for k in 0..q.len() {
                self.trial[k] = q[k] + alpha * self.mark_direction[k];
            }
            let change = self.trial_merit(energy, potential) - value;
            if change <= DECREASE * alpha * slope {
                return true;
            }
            let parabola = -0.5 * slope * alpha * alpha / (change - slope * alpha);
            alpha = if parabola.is_finite() { parabola.clamp(0.1 * alpha, 0.5 * alpha) } else { 0.1 * alpha };
        }
        self.trial.copy_from_slice(q);
        false
    }

    /// Whether hard constraints ask for more than rounding.
    fn is_off(&self, potential: &Potential) -> bool {
        let off = |rows: &Rows| {
            let far = self.goal.amax() * ROUNDING;
            (0..rows.len()).any(|i| rows.compliance[i] == 0.0 && self.missing[i].abs() > far)
        };
        potential.handles.is_some_and(off)
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
        let quadratic: f64 = q.iter().zip(potential.load).map(|(q, b)| q * (0.5 * potential.shift * q - b)).sum();
        let viscous = potential.matrix.map_or(0.0, |c| 0.5 * self.product(c, q, |k, cq| q[k] * cq));
        let strayed = potential.handles.map_or(0.0, |rows| {
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
        (0..q.len()).map(|k| f(k, c.column(k).iter().zip(q).map(|(c, q)| c * q).sum())).sum()
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
        (slope <= ROUNDING * ROUNDING * scale).then_some((slope.min(0.0), scale))
    }

    /// ∇Π without constraints; returns the scale of Π.
    fn find_gradient(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> f64 {
        energy.gradient(q, &mut self.scratch, self.gradient.as_mut_slice());
        self.work.gradients += 1;
        let elastic: f64 = q.iter().zip(self.gradient.iter()).map(|(q, g)| (q * g).abs()).sum();
        for k in 0..q.len() {
            self.gradient[k] += potential.shift * q[k] - potential.load[k];
        }
        if let Some(c) = potential.matrix {
            for k in 0..q.len() {
                self.gradient[k] += c.column(k).iter().zip(q).map(|(c, q)| c * q).sum::<f64>();
            }
        }
        if let Some(joined) = potential.joined {
            joined.add_gradient(q, self.gradient.as_mut_slice());
        }
        let work: f64 = q.iter().zip(potential.load).map(|(q, b)| (q * b).abs()).sum();
        work + elastic + f64::MIN_POSITIVE
    }

    /// The factor of the Hessian at `q`, or of one near it that is positive definite.
    fn factorize(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) {
        let mut shift = 0.0;
        for attempt in 0..TRIALS {
            let curvature = if attempt == 0 { Curvature::Exact } else { Curvature::Semidefinite };
            let mut hessian =
                self.factor.take().map_or_else(|| DMatrix::zeros(q.len(), q.len()), |factor| factor.unpack_dirty());
            energy.hessian(q, curvature, &mut self.scratch, &mut hessian);
            self.work.hessians += 1;
            (0..q.len()).for_each(|k| hessian[(k, k)] += potential.shift + shift);
            if let Some(c) = potential.matrix {
                hessian += c;
            }
            if let Some(joined) = potential.joined {
                joined.add_hessian(q, curvature, &mut hessian);
            }
            let trace = hessian.trace();
            if let Some(rows) = potential.handles {
                self.hold(rows, &mut hessian);
            }
            self.exact = attempt == 0;
            self.factor = Cholesky::new(hessian);
            if self.factor.is_some() {
                return;
            }
            shift = if attempt == 0 { 0.0 } else { (10.0 * shift).max(1e-12 * trace.abs()) };
        }
    }

    /// The nearest to d that hard constraints have in common, JJ⁺d, or as far on the way to it as J⁺d is within reach. Two passes
    /// of JJᵀ(JJᵀ + ε)⁻¹ leave ε² of what they can have.
    fn find_goal(&mut self, rows: &Rows) {
        self.goal.copy_from(&rows.target);
        let hard = |i: usize| rows.compliance[i] == 0.0;
        if !(0..rows.len()).any(hard) {
            return;
        }
        let mut gram = self.flexibility.take().unwrap_or_else(|| DMatrix::zeros(rows.len(), rows.len()));
        for i in 0..rows.len() {
            for k in 0..rows.len() {
                let both = hard(i) && hard(k);
                gram[(i, k)] = if both { rows.jacobian.column(i).dot(&rows.jacobian.column(k)) } else { 0.0 };
            }
            gram[(i, i)] = if hard(i) { (1.0 + LEAST_CONSTRAINT) * gram[(i, i)] + f64::MIN_POSITIVE } else { 1.0 };
        }
        let Some(gram) = Cholesky::new(gram) else { return };
        (0..rows.len()).filter(|i| hard(*i)).for_each(|i| self.goal[i] = 0.0);
        self.gradient.fill(0.0);
        for _ in 0..2 {
            self.multipliers.copy_from(&rows.target);
            self.multipliers -= &self.goal;
            gram.solve_mut(&mut self.multipliers);
            self.direction.gemv(1.0, &rows.jacobian, &self.multipliers, 0.0);
            self.gradient += &self.direction;
            for i in (0..rows.len()).filter(|i| hard(*i)) {
                self.goal[i] += rows.along(i, self.direction.as_slice());
            }
        }
        let far = self.gradient.norm();
        if far > rows.reach {
            (0..rows.len()).filter(|i| hard(*i)).for_each(|i| self.goal[i] *= rows.reach / far);
        }
        self.flexibility = Some(gram.unpack_dirty());
    }

    /// H + σJᵀJ over hard constraints.
    fn hold(&mut self, rows: &Rows, hessian: &mut DMatrix<f64>) {
        let largest = (0..hessian.nrows()).map(|k| hessian[(k, k)]).fold(0.0, f64::max);
        for i in 0..rows.len() {
            let along = rows.jacobian.column(i);
            let square = along.norm_squared();
            self.held[i] = if rows.compliance[i] == 0.0 && square > 0.0 { HELD * largest / square } else { 0.0 };
            hessian.ger(self.held[i], &along, &along, 1.0);
        }
    }

    /// Δ with the factorized Hessian, and the slope of the merit along it.
    fn solve(&mut self, factor: &Cholesky<f64, Dyn>, potential: &Potential, q: &[f64]) -> f64 {
        self.direction.copy_from(&self.gradient);
        self.direction.neg_mut();
        factor.solve_mut(&mut self.direction);
        let Some(rows) = potential.handles else { return self.gradient.dot(&self.direction) };
        self.response.copy_from(&rows.jacobian);
        factor.solve_mut(&mut self.response);
        let mut flexibility = self.flexibility.take().unwrap_or_else(|| DMatrix::zeros(rows.len(), rows.len()));
        for i in 0..rows.len() {
            self.missing[i] = self.goal[i] - rows.along(i, q);
            self.multipliers[i] = self.missing[i] - rows.along(i, self.direction.as_slice());
            (0..rows.len()).for_each(|k| flexibility[(i, k)] = rows.along(i, self.response.column(k).as_slice()));
        }
        for i in 0..rows.len() {
            flexibility[(i, i)] *= 1.0 + LEAST_CONSTRAINT;
            flexibility[(i, i)] += rows.compliance[i] + f64::MIN_POSITIVE;
        }
        match Cholesky::new(flexibility) {
            Some(factor) => {
                factor.solve_mut(&mut self.multipliers);
                self.flexibility = Some(factor.unpack_dirty());
            }
            None => self.multipliers.fill(0.0),
        }
        self.direction.gemv(1.0, &self.response, &self.multipliers, 1.0);
        self.multipliers.zip_zip_apply(&self.held, &self.missing, |mu, sigma, missing| *mu -= sigma * missing);
        self.penalty = self.penalty.max(2.0 * self.multipliers.amax());
        // Of hard constraints, what a full step takes out of Σ|Jq − d|: all of it unless they conflict.
        let relief = |i: usize| {
            let (missing, moved) = (self.missing[i], rows.along(i, self.direction.as_slice()));
            match rows.compliance[i] {
                0.0 => self.penalty * (missing.abs() - (missing - moved).abs()),
                compliance => missing * moved / compliance,
            }
        };
        self.gradient.dot(&self.direction) - (0..rows.len()).map(relief).sum::<f64>()
    }
}

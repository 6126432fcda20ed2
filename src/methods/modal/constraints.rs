//! Handles on a shell in modes (paper section 4.4; [2] section 5).
//!
//! With q⁺ = q_free + Γ p, Γ the integrator's (`Oscillator::handle_response`) and p = Jᵀμ, the constraint forces μ make the residual of every handle
//! vanish, ρ = d − g(q⁺) − γμ with the compliance γ (0 = hard). Levenberg–Marquardt steps with the true Jacobian J = ∂g/∂q:
//!
//!   (J Γ Jᵀ + γ + ε) Δμ = ρ + J (q − q_free − Γ Jᵀ μ),     μ' = μ + Δμ,     q' = q_free + Γ Jᵀ μ'
//!
//! ε falls while the residual does and rises when it does not, so that constraints that are out of reach, conflict, repeat
//! or outnumber the modes end at the least residual that can be had; it is reported. The rates change by
//! q̇⁺ = q̇_free + r (q⁺ − q_free), with the integrator's r: 1/h, an impulse, for backward Euler.
//!
//! A handle never drives the elastic modes past a bound on their joint bend: beyond it the warp has no meaning. The bound
//! grows with the distance of the targets from the rest pose: a warped vertex could also reach a near target by turning half round,
//! and the bound prevents that.
//!
//! Rows are dimensionless: lengths are divided by the model's size.

mod work;

use crate::constraint::{Constraint, ConstraintSet, MET, Outcome, Target};
use crate::step::{Bend, Integrator, Oscillator};
use crate::support::Axes;
use crate::warp::{Basis, Entry, warp_with_derivative};
use crate::{Vec3, rotation};
use nalgebra::{Matrix3, UnitQuaternion};
use std::f64::consts::TAU;
use work::Work;

/// The iteration aims two digits below [`MET`].
const GOAL: f64 = 1e-8;

/// Once met, a step may grow the residual up to this for once: moving along a curved constraint needs it.
const TUBE: f64 = 1e-3;

/// Per search; a target near the last takes 3 to 10, a far one several searches.
const MAX_ITERATIONS: u32 = 60;

/// ε relative to the largest diagonal entry: the least, against rounding, and the most, where nothing moves any more.
const LEAST_DAMPING: f64 = 1e-12;
const MOST_DAMPING: f64 = 1e4;

/// The largest change of rotation at a handle in one iteration, rad: the derivative is trusted no further.
const MAX_TURN: f64 = 0.5;

/// Bound on the root sum of squares, over the elastic modes, of the largest rotation that each mode's amplitude makes, rad.
const LARGEST_BEND: f64 = std::f64::consts::PI;

/// The same bound for targets near the rest pose: at rest, and per model size or rad that targets are away from it; and how
/// much more is allowed where that meets them.
const LEAST_BEND: f64 = 0.25;
const BEND_PER_DISTANCE: f64 = 10.0;
const EXTRA_BEND: f64 = 1.0;

/// Stages of a target that is not met at once.
const STAGES: u32 = 8;

/// Rotation that each elastic mode is given, rad, to leave a straight pose by.
const KICK: f64 = 0.1;

/// All constraints of a state with room for the work, so that a step does not allocate.
#[derive(Clone)]
pub struct ModalConstraints {
    set: ConstraintSet,
    /// First row of each constraint, and the end.
    first_row: Vec<usize>,
    work: Work,
}

/// Everything about a step that constraints depend on.
pub struct Step<'a> {
    /// In which vertices are displaced, at its end.
    pub axes: Axes<'a>,
    /// Its length.
    pub h: f64,
    /// How it is taken.
    pub integrator: Integrator,
    /// c and λ of each mode. What support fields have beyond them stays.
    pub modes: (&'a [f64], &'a [f64]),
    /// Rest positions.
    pub rest: &'a [Vec3],
    /// The model's size.
    pub size: f64,
    /// How far a unit of each mode bends the shell.
    pub bend: Bend<'a>,
    /// u = R̃Φq, or u = Φq.
    pub warped: bool,
    /// What moves vertices instead of these.
    pub vertices: Option<&'a dyn VertexMap>,
}

/// How amplitudes move single vertices, frame axes.
pub trait VertexMap {
    /// u of vertex `v`.
    fn displacement(&self, v: usize, q: &[f64]) -> Vec3;
    /// Hands ∂(direction · u_v)/∂q_k of each mode to `visit`.
    fn slopes(&self, at: (usize, &Vec3), q: &[f64], visit: &mut dyn FnMut(usize, f64));
    /// With the fields b_c the same is u = Φq + Σ_c N_c b_c: their number,
    fn n_fields(&self) -> usize;
    /// b_c at a vertex,
    fn field(&self, c: usize, v: usize) -> Vec3;
    /// and N_c at `q`, with `slopes` also each ∂N_c/∂q_k at c modes + k behind them. For many vertices at one q.
    fn share(&self, q: &[f64], slopes: bool, shared: &mut Vec<Matrix3<f64>>);
}

impl Step<'_> {
    /// How far a unit of an elastic mode bends the shell; 0 for a zero mode, which bends nothing.
    fn bend(&self, k: usize) -> f64 {
        if self.modes.1.get(k).is_some_and(|lambda| *lambda > 0.0) { self.bend.of(k) } else { 0.0 }
    }
}

impl ModalConstraints {
    /// None.
    pub fn new(modes: usize) -> Self {
        Self { set: ConstraintSet::default(), first_row: vec![0], work: Work::new(0, 0, modes) }
    }

    /// The constraints with their outcomes.
    pub fn set(&self) -> &ConstraintSet {
        &self.set
    }

    /// Changes the constraints, with room for their work afterwards: moving a target does not allocate.
    pub fn change<T>(&mut self, change: impl FnOnce(&mut ConstraintSet) -> T) -> T {
        let changed = change(&mut self.set);
        self.resize();
        changed
    }

    fn resize(&mut self) {
        let items = self.set.items();
        let rows = |c: &Constraint| c.axes.iter().filter(|held| **held).count();
        let sizes = self.first_row.windows(2).map(|ends| ends[1] - ends[0]);
        if sizes.eq(items.iter().map(rows)) {
            return;
        }
        self.first_row.clear();
        self.first_row.push(0);
        for c in items {
            self.first_row.push(self.first_row[self.first_row.len() - 1] + rows(c));
        }
        self.work = Work::new(items.len(), self.first_row[items.len()], self.work.q_free.len());
    }

    /// Moves q and q̇, the free motion of the step, to where the constraints are met; `q_before` is where the step began.
    /// Returns the work done on the shell by the handles. Does not allocate.
    pub fn project<E: Entry>(
        &mut self,
        basis: &Basis<E>,
        step: &Step,
        q_before: &[f64],
        (q, q_dot): (&mut [f64], &mut [f64]),
    ) -> f64 {
        let (damping, eigenvalues) = step.modes;
        let softest = eigenvalues.iter().copied().find(|lambda| *lambda > 0.0).unwrap_or(1.0);
        let moving = eigenvalues.len();
        for k in 0..moving {
            self.work.flexibility[k] = 1.0 / (eigenvalues[k] + softest);
            let oscillator = Oscillator { damping: damping[k], eigenvalue: eigenvalues[k] };
            (self.work.gamma[k], self.work.rate[k]) = oscillator.handle_response(step.integrator, step.h);
        }
        let flexibility_scale = |weight: &[f64]| {
            let terms = weight[..moving].iter().enumerate().map(|(k, weight)| weight * step.bend.of(k).powi(2));
            terms.fold(f64::MIN_POSITIVE, f64::max)
        };
        self.work.flexibility_scale = [flexibility_scale(&self.work.gamma), flexibility_scale(&self.work.flexibility)];
        self.work.q_free.copy_from_slice(q);
        self.prepare(basis, step, q_before);
        let (iterations, met) = self.solve(basis, step, q_before, q);
        let mut work_done = 0.0;
        for k in 0..moving {
            let change = q[k] - self.work.q_free[k];
            q_dot[k] += match step.integrator {
                Integrator::ImplicitEuler => change / step.h,
                Integrator::Exact | Integrator::SecondOrder => change * self.work.rate[k],
            };
            work_done += change / self.work.gamma[k] * (q[k] - q_before[k]);
        }
        if !met {
            limit_bend(step, self.work.bend_limit, q, q_dot);
        }
        self.record_outcomes(step, iterations, q);
        work_done
    }

    /// Meets the constraints from the free motion, bent as little as it can; when that fails, by moving the targets there in
    /// stages from the pose before the step, and from that pose slightly bent, because a straight shell does not know which
    /// way to buckle. Leaves q with its residuals. Returns the iterations and whether all was met.
    fn solve<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q_before: &[f64], q: &mut [f64]) -> (u32, bool) {
        self.work.deferred.fill(0.0);
        let mut iterations = 0;
        let warranted = self.work.bend_limit;
        for limit in [warranted, (warranted + EXTRA_BEND).min(LARGEST_BEND)] {
            self.work.bend_limit = limit;
            q.copy_from_slice(&self.work.q_free);
            let (more, distance) = self.search(basis, step, q, false);
            iterations += more;
            if distance <= MET {
                return (iterations, true);
            }
            if limit == warranted {
                self.work.first.copy_from_slice(q);
            }
        }
        for bend in [0.0, KICK] {
            for k in 0..step.modes.1.len() {
                q[k] = q_before[k] + if step.bend(k) > 0.0 { bend / step.bend(k) } else { 0.0 };
            }
            let (more, distance) = self.search_in_stages(basis, step, q);
            iterations += more;
            if distance <= MET {
                return (iterations, true);
            }
        }
        q.copy_from_slice(&self.work.first); // out of reach: the answer that follows from the motion, without a jump
        self.work.bend_limit = warranted;
        self.linearize(basis, step, q);
        (iterations, false)
    }

    /// As `search`, with the targets moving from where the handles are at `q` to where they shall be.
    fn search_in_stages<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q: &mut [f64]) -> (u32, f64) {
        self.work.deferred.fill(0.0);
        self.linearize(basis, step, q);
        self.work.start_missing.copy_from(&self.work.missing);
        let (mut iterations, mut distance) = (0, 0.0);
        for stage in 1..=STAGES {
            let left = 1.0 - f64::from(stage) / f64::from(STAGES);
            let Work { deferred, start_missing, .. } = &mut self.work;
            deferred.iter_mut().zip(start_missing.iter()).for_each(|(d, m)| *d = left * m);
            let (more, after) = self.search(basis, step, q, true);
            iterations += more;
            distance = after;
        }
        if distance <= MET {
            self.work.feasible.copy_from_slice(q);
            let (more, after) = self.search(basis, step, q, false);
            iterations += more;
            if after > MET {
                q.copy_from_slice(&self.work.feasible);
                self.linearize(basis, step, q);
            }
        }
        (iterations, distance)
    }

    /// Levenberg–Marquardt from `q`. Returns the iterations and |ρ|; leaves the Jacobian and residuals at q.
    fn search<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q: &mut [f64], restoring: bool) -> (u32, f64) {
        self.work.multipliers.fill(0.0);
        self.linearize(basis, step, q);
        let mut distance = self.work.distance(&self.work.multipliers);
        let (mut damping, mut radius) = (LEAST_DAMPING, MAX_TURN);
        let mut stalled = 0;
        for iteration in 1..=MAX_ITERATIONS {
            if damping > MOST_DAMPING || !self.work.solve(q, damping, restoring) {
                return (iteration, distance);
            }
            let (fraction, turn) = self.shorten(basis, step, q, radius);
            if restoring && fraction < 0.5 && damping < 0.1 {
                damping *= 10.0; // rather do without what this pose can hardly do than run into the limits for it
                continue;
            }
            let moved = self.largest_move(q);
            let trial = std::mem::take(&mut self.work.trial);
            self.linearize(basis, step, &trial);
            self.work.trial = trial;
            let after = self.work.distance(&self.work.trial_multipliers);
            if after < distance || (distance <= MET && after <= TUBE) {
                q.copy_from_slice(&self.work.trial);
                std::mem::swap(&mut self.work.multipliers, &mut self.work.trial_multipliers);
                stalled = if after > 0.999 * distance && after > GOAL { stalled + 1 } else { 0 };
                (distance, damping) = (after, (0.1 * damping).max(LEAST_DAMPING));
                radius = (2.0 * radius).min(MAX_TURN);
                if (after <= GOAL && moved <= GOAL) || stalled > 3 {
                    return (iteration, distance);
                }
            } else {
                damping *= 10.0;
                radius = 0.25 * turn;
                self.linearize(basis, step, q);
            }
        }
        (MAX_ITERATIONS, distance)
    }

    /// Shortens the trial step to one that turns no handle and bends the shell by no more than `radius`, and stays within
    /// what the method can be trusted for. Returns the fraction left and the turn made.
    fn shorten<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q: &[f64], radius: f64) -> (f64, f64) {
        let turn = self.largest_turn(basis, step, q).max(bend(step, |k| self.work.trial[k] - q[k]));
        let fraction = if turn > radius { radius / turn } else { 1.0 };
        let Work { trial, trial_multipliers, multipliers, bend_limit, .. } = &mut self.work;
        for k in 0..q.len() {
            trial[k] = q[k] + fraction * (trial[k] - q[k]);
        }
        for i in 0..multipliers.len() {
            trial_multipliers[i] = multipliers[i] + fraction * (trial_multipliers[i] - multipliers[i]);
        }
        let (bent, limit) = (bend(step, |k| trial[k]), bend_limit.max(bend(step, |k| q[k])));
        if bent > limit {
            (0..q.len()).filter(|k| step.bend(*k) > 0.0).for_each(|k| trial[k] *= limit / bent);
        }
        (fraction, fraction * turn)
    }

    /// Largest change of a mode's share of the handles between `q` and the trial, in model sizes or rad.
    fn largest_move(&self, q: &[f64]) -> f64 {
        let Work { jacobian, trial, .. } = &self.work;
        let share = |k: usize| (trial[k] - q[k]).abs() * jacobian.column(k).amax();
        (0..q.len()).map(share).fold(0.0, f64::max)
    }

    /// Largest rotation that matters at a handle from `q` to the trial, rad.
    fn largest_turn<E: Entry>(&self, basis: &Basis<E>, step: &Step, q: &[f64]) -> f64 {
        let turn = |c: &Constraint| -> f64 {
            let change = |k: usize| (self.work.trial[k] - q[k]) * basis.at(k, c.vertex as usize).1;
            (0..q.len()).map(change).sum::<Vec3>().norm()
        };
        let turns = |c: &&Constraint| step.warped || matches!(c.target, Target::Orientation(_));
        self.set.items().iter().filter(turns).map(turn).fold(0.0, f64::max)
    }

    /// Compliances in rows' units, and the branch of each target rotation that lies nearest to the present one.
    fn prepare<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q: &[f64]) {
        let mut distance = 0.0;
        for (i, c) in self.set.items().iter().enumerate() {
            let axes = step.axes.of(c.vertex);
            let unit = match c.target {
                Target::Position(_) => step.size,
                Target::Orientation(_) => 1.0,
            };
            for row in self.first_row[i]..self.first_row[i + 1] {
                self.work.compliance[row] = c.compliance / (unit * unit);
            }
            if let Target::Orientation(world) = c.target {
                let present: Vec3 = (0..q.len()).map(|k| q[k] * basis.at(k, c.vertex as usize).1).sum();
                self.work.branch[i] = nearest_branch(&(axes.rotation.inverse() * world), &present);
            }
            let away = match c.target {
                Target::Position(world) => {
                    axes.rotation.inverse() * (world - axes.origin) - step.rest[c.vertex as usize]
                }
                Target::Orientation(_) => self.work.branch[i],
            };
            distance += away.norm() / unit;
        }
        self.work.bend_limit = (LEAST_BEND + BEND_PER_DISTANCE * distance).min(LARGEST_BEND);
    }

    /// Residuals and Jacobian at `q`.
    fn linearize<E: Entry>(&mut self, basis: &Basis<E>, step: &Step, q: &[f64]) {
        for (i, c) in self.set.items().iter().enumerate() {
            let (v, axes) = (c.vertex as usize, step.axes.of(c.vertex));
            let shapes = |k: usize| basis.at(k, v);
            let linear: Vec3 = (0..q.len()).map(|k| q[k] * shapes(k).0).sum();
            let w: Vec3 = (0..q.len()).map(|k| q[k] * shapes(k).1).sum();
            let (u, by_linear, by_w) = warp_with_derivative(&w, &linear, step.warped);
            let u = step.vertices.map_or(u, |map| map.displacement(v, q));
            let (missing, scale) = match c.target {
                Target::Position(world) => {
                    let target = axes.rotation.inverse() * (world - axes.origin);
                    (target - step.rest[v] - u, 1.0 / step.size)
                }
                Target::Orientation(_) => (self.work.branch[i] - w, 1.0),
            };
            let held = (0..3).filter(|axis| c.axes[*axis]);
            for (row, axis) in (self.first_row[i]..).zip(held) {
                let mut direction = Vec3::zeros();
                direction[axis] = scale;
                let direction = axes.rotation.inverse() * direction;
                self.work.missing[row] = direction.dot(&missing) - self.work.deferred[row];
                if let (Some(map), Target::Position(_)) = (step.vertices, c.target) {
                    let jacobian = &mut self.work.jacobian;
                    map.slopes((v, &direction), q, &mut |k, slope| jacobian[(row, k)] = slope);
                    continue;
                }
                for k in 0..q.len() {
                    let (phi, psi) = shapes(k);
                    let motion = match c.target {
                        Target::Position(_) => by_linear * phi + by_w * psi,
                        Target::Orientation(_) => psi,
                    };
                    self.work.jacobian[(row, k)] = direction.dot(&motion);
                }
            }
        }
    }

    /// Residuals and forces for the report.
    fn record_outcomes(&mut self, step: &Step, iterations: u32, q: &[f64]) {
        let unit = |c: &Constraint| match c.target {
            Target::Position(_) => step.size,
            Target::Orientation(_) => 1.0,
        };
        for ((c, outcome), rows) in self.set.pending().zip(self.first_row.windows(2)) {
            let squares: f64 = (rows[0]..rows[1]).map(|row| (unit(c) * self.work.missing[row]).powi(2)).sum();
            *outcome = Outcome { residual: squares.sqrt(), force: Vec3::zeros(), iterations };
        }
        self.work.settle_multipliers(q);
        for ((c, outcome), rows) in self.set.pending().zip(self.first_row.windows(2)) {
            for (row, axis) in (rows[0]..rows[1]).zip((0..3).filter(|axis| c.axes[*axis])) {
                outcome.force[axis] = self.work.multipliers[row] / unit(c);
            }
        }
    }
}

/// Root sum of squares of how far the elastic amplitudes bend the shell.
fn bend(step: &Step, amplitude: impl Fn(usize) -> f64) -> f64 {
    (0..step.modes.1.len()).map(|k| (step.bend(k) * amplitude(k)).powi(2)).sum::<f64>().sqrt()
}

/// A handle that pulls at a target out of reach gives no more speed than the next step can stand.
fn limit_bend(step: &Step, limit: f64, q: &[f64], q_dot: &mut [f64]) {
    let limit = limit.max(bend(step, |k| q[k]));
    for _ in 0..60 {
        if bend(step, |k| q[k] + step.h * q_dot[k]) <= limit {
            return;
        }
        (0..q.len()).filter(|k| step.bend(*k) > 0.0).for_each(|k| q_dot[k] *= 0.5);
    }
}

/// The rotation vector of `target`, among all θ + 2πk about its axis, that is nearest to `present`.
fn nearest_branch(target: &UnitQuaternion<f64>, present: &Vec3) -> Vec3 {
    let principal = rotation::vector(target);
    let angle = principal.norm();
    // A full turn has no axis of its own: it keeps the present one.
    let axis = if angle > 1e-9 { principal / angle } else { present.try_normalize(1e-9).unwrap_or_default() };
    let turns = ((axis.dot(present) - angle) / TAU).round();
    axis * (angle + TAU * turns)
}

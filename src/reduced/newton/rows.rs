//! Constraints of a search: where they can be met, and the direction that meets them.

use super::super::products::dot_all;
use super::{Newton, Potential, ROUNDING};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// ε of J H⁻¹ Jᵀ + ε, relative to each diagonal entry, so that constraints may repeat or conflict.
const LEAST_CONSTRAINT: f64 = 1e-10;
/// Stiffness along a hard constraint that H is given, over H's largest: none of its other directions feels it.
const HELD: f64 = 10.0;

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
        let n = self.jacobian.nrows();
        dot_all(&self.jacobian.as_slice()[i * n..][..n], v)
    }
}

impl Newton {
    /// Whether hard constraints ask for more than rounding.
    pub(super) fn is_off(&self, potential: &Potential) -> bool {
        let off = |rows: &Rows| {
            let far = self.goal.amax() * ROUNDING;
            (0..rows.len()).any(|i| rows.compliance[i] == 0.0 && self.missing[i].abs() > far)
        };
        potential.constraints.is_some_and(off)
    }

    /// The nearest to d that hard constraints have in common, JJ⁺d, or as far on the way to it as J⁺d is within reach. Two passes
    /// of JJᵀ(JJᵀ + ε)⁻¹ leave ε² of what they can have.
    pub(super) fn find_goal(&mut self, rows: &Rows) {
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
    pub(super) fn hold(&mut self, rows: &Rows, hessian: &mut DMatrix<f64>) {
        let largest = (0..hessian.nrows()).map(|k| hessian[(k, k)]).fold(0.0, f64::max);
        for i in 0..rows.len() {
            let along = rows.jacobian.column(i);
            let square = along.norm_squared();
            self.held[i] = if rows.compliance[i] == 0.0 && square > 0.0 { HELD * largest / square } else { 0.0 };
            hessian.ger(self.held[i], &along, &along, 1.0);
        }
    }

    /// Δ with the factorized Hessian, and the slope of the merit along it.
    pub(super) fn solve(&mut self, factor: &Cholesky<f64, Dyn>, potential: &Potential, q: &[f64]) -> f64 {
        self.direction.copy_from(&self.gradient);
        self.direction.neg_mut();
        factor.solve_mut(&mut self.direction);
        let Some(rows) = potential.constraints else { return self.gradient.dot(&self.direction) };
        self.response.copy_from(&rows.jacobian);
        factor.solve_mut(&mut self.response);
        let mut flexibility = self.flexibility.take().unwrap_or_else(|| DMatrix::zeros(rows.len(), rows.len()));
        for i in 0..rows.len() {
            self.missing[i] = self.goal[i] - rows.along(i, q);
            self.multipliers[i] = self.missing[i] - rows.along(i, self.direction.as_slice());
            (0..=i).for_each(|k| flexibility[(i, k)] = rows.along(i, self.response.column(k).as_slice()));
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

//! One linear step of the search: J Γ Jᵀ + γ + ε and its solution, with all the room that a search needs.

use super::LARGEST_BEND;
use crate::Vec3;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Of a search.
#[derive(Clone)]
pub(super) struct Work {
    /// J (rows × modes).
    pub(super) jacobian: DMatrix<f64>,
    /// J Γ Jᵀ + γ + ε, then its factor (rows × rows). Taken out while it is factorized.
    pub(super) normal: Option<DMatrix<f64>>,
    /// d − g, less what a later stage asks for (rows).
    pub(super) missing: DVector<f64>,
    pub(super) deferred: DVector<f64>,
    pub(super) start_missing: DVector<f64>,
    /// γ (rows).
    pub(super) compliance: DVector<f64>,
    /// μ and μ' (rows).
    pub(super) multipliers: DVector<f64>,
    pub(super) trial_multipliers: DVector<f64>,
    /// Target rotation vectors on the nearest branch (one a constraint).
    pub(super) branch: Vec<Vec3>,
    /// Γ, r, the static flexibility 1/λ that restoring steps use instead of Γ, q_free and q' (modes).
    pub(super) gamma: Vec<f64>,
    pub(super) rate: Vec<f64>,
    pub(super) flexibility: Vec<f64>,
    pub(super) q_free: Vec<f64>,
    pub(super) trial: Vec<f64>,
    /// Σ Γ|ψ|² and Σ |ψ|²/λ with the largest rotation ψ of each mode: what a row of J Γ Jᵀ is where the pose can move.
    pub(super) flexibility_scale: [f64; 2],
    /// Bound on the bend that the present targets warrant, rad.
    pub(super) bend_limit: f64,
    /// What the search from the free motion found (modes).
    pub(super) first: Vec<f64>,
    /// What a search in stages found before it looks for the nearest to the free motion (modes).
    pub(super) feasible: Vec<f64>,
}

impl Work {
    /// Room for so many.
    pub(super) fn new(constraints: usize, rows: usize, modes: usize) -> Self {
        let (per_row, per_mode) = (DVector::zeros(rows), vec![0.0; modes]);
        Self {
            jacobian: DMatrix::zeros(rows, modes),
            normal: Some(DMatrix::zeros(rows, rows)),
            missing: per_row.clone(),
            deferred: per_row.clone(),
            start_missing: per_row.clone(),
            compliance: per_row.clone(),
            multipliers: per_row.clone(),
            trial_multipliers: per_row,
            branch: vec![Vec3::zeros(); constraints],
            gamma: per_mode.clone(),
            rate: per_mode.clone(),
            flexibility: per_mode.clone(),
            q_free: per_mode.clone(),
            trial: per_mode.clone(),
            flexibility_scale: [f64::MIN_POSITIVE; 2],
            bend_limit: LARGEST_BEND,
            first: per_mode.clone(),
            feasible: per_mode,
        }
    }

    /// |ρ| with the multipliers `mu`.
    pub(super) fn distance(&self, mu: &DVector<f64>) -> f64 {
        let rows = self.missing.iter().zip(self.compliance.iter()).zip(mu.iter());
        rows.map(|((missing, compliance), mu)| (missing - compliance * mu).powi(2)).sum::<f64>().sqrt()
    }

    /// Fills J Γ Jᵀ + γ + ε and factorizes it; `None` when it is not positive definite, as with numbers that are not finite.
    fn factorize(&mut self, damping: f64, restoring: bool) -> Option<Cholesky<f64, Dyn>> {
        let (rows, modes) = self.jacobian.shape();
        let weight = if restoring { &self.flexibility } else { &self.gamma };
        let mut normal = self.normal.take().unwrap_or_else(|| DMatrix::zeros(rows, rows));
        for i in 0..rows {
            for j in 0..=i {
                let product = |k: usize| self.jacobian[(i, k)] * weight[k] * self.jacobian[(j, k)];
                normal[(i, j)] = (0..modes).map(product).sum();
            }
        }
        let largest = (0..rows).map(|i| normal[(i, i)]).fold(self.flexibility_scale[usize::from(restoring)], f64::max);
        (0..rows).for_each(|i| normal[(i, i)] += self.compliance[i] + damping * largest);
        Cholesky::new(normal)
    }

    /// q_free + Γ Jᵀ `mu`, mode `k`.
    fn moved(&self, mu: &DVector<f64>, k: usize) -> f64 {
        self.q_free[k] + self.gamma[k] * self.jacobian.column(k).dot(mu)
    }

    /// Solves for the trial multipliers and amplitudes from `q`; false without a finite answer. A restoring step only
    /// reduces the residual, by the change of q that costs the least elastic energy; otherwise the answer is also the one nearest to the free motion.
    pub(super) fn solve(&mut self, q: &[f64], damping: f64, restoring: bool) -> bool {
        let Some(factor) = self.factorize(damping, restoring) else { return false };
        let mut step = std::mem::take(&mut self.trial_multipliers);
        for i in 0..step.len() {
            let stray = |k: usize| self.jacobian[(i, k)] * (q[k] - self.moved(&self.multipliers, k));
            let stray: f64 = if restoring { 0.0 } else { (0..q.len()).map(stray).sum() };
            step[i] = self.missing[i] - self.compliance[i] * self.multipliers[i] + stray;
        }
        factor.solve_mut(&mut step);
        self.normal = Some(factor.unpack_dirty());
        if restoring {
            for k in 0..q.len() {
                self.trial[k] = q[k] + self.flexibility[k] * self.jacobian.column(k).dot(&step);
            }
            step.fill(0.0);
        } else {
            step += &self.multipliers;
            for k in 0..q.len() {
                self.trial[k] = self.moved(&step, k);
            }
        }
        self.trial_multipliers = step;
        self.trial.iter().all(|q| q.is_finite())
    }

    /// The least multipliers that explain the present q, for the report.
    pub(super) fn settle_multipliers(&mut self, q: &[f64]) {
        self.multipliers.fill(0.0);
        self.missing.fill(0.0);
        self.compliance.fill(0.0);
        if self.solve(q, 1e-9, false) {
            std::mem::swap(&mut self.multipliers, &mut self.trial_multipliers);
        }
    }
}

//! A few Newton steps toward a minimum that is near, without looking at the potential.

use super::super::elastic::Elastic;
use super::super::products::sum_of;
use super::{End, Newton, Potential, ROUNDING};

/// Of the square of a residual, what a Newton step leaves; and a step with the Hessian before it, of its square over the residual then. An
/// estimate: on shells that swing by their size nearly all leave less, a fifth of it as a rule, and none ten times as much.
const SQUARED: f64 = 10.0;
/// Of a residual, what a step with the Hessian of a shape nearby leaves; where this is enough, the shell hardly moves.
const NEARBY: f64 = 3.0;
/// Newton steps on the way there, at most, the residual that the first may have, and what a later one may have of the one before.
const APPROACHES: usize = 4;
const FAR: f64 = 1.0;
const GAINED: f64 = 0.8;
/// Along such a step, Π curves at least this much of what inertia alone does.
const FIRM: f64 = 0.5;

impl Newton {
    /// Moves `q` by a few Newton steps to where by their residuals at most `tolerance` is left, without looking at Π: without constraints,
    /// where no energy of points acts, and by exact Hessians far from singular. Otherwise it leaves `q` as it is. The Hessian of the approach
    /// before may be `near` enough.
    pub fn approach(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &mut [f64],
        (tolerance, near): (f64, bool),
    ) -> Option<End> {
        let acts = |q: &[f64]| potential.joined.is_some_and(|joined| joined.value(q) != 0.0);
        if potential.constraints.is_some() || acts(q) {
            return None; // of what may jump, residuals say little of what is left
        }
        self.mark.copy_from_slice(q);
        let end = self.approached(energy, potential, q, (tolerance, near && self.approached)).filter(|_| !acts(q));
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
        (tolerance, near): (f64, bool),
    ) -> Option<End> {
        let mut before = f64::INFINITY;
        for iterations in 1..=APPROACHES {
            energy.near_gradient(q, &mut self.scratch, self.gradient.as_mut_slice());
            let scale = self.complete_gradient(potential, q);
            let (mut residual, mut left) = (f64::INFINITY, f64::INFINITY);
            if iterations > 1 {
                residual = self.approaching(scale)?;
                if residual > GAINED * before {
                    return None;
                }
                left = SQUARED * residual * residual / before;
            } else if near && self.least_residual(scale) <= tolerance {
                residual = self.approaching(scale)?;
                left = NEARBY * residual;
            }
            let enough = left <= tolerance; // NaN is not
            if !enough {
                if !self.factorize_near(energy, potential, q) {
                    return None;
                }
                residual = self.approaching(scale)?;
                left = SQUARED * residual * residual;
                let [gradient, direction] = [&self.gradient, &self.direction].map(|list| list.as_slice());
                let firm = FIRM * potential.shift * sum_of(direction, direction, |d, e| d * e);
                if residual > FAR || -sum_of(gradient, direction, |g, d| g * d) < firm {
                    return None;
                }
            }
            q.iter_mut().zip(self.direction.as_slice()).for_each(|(q, d)| *q += d);
            if left <= tolerance {
                return Some(End { converged: true, iterations, residual: left });
            }
            before = residual;
        }
        None
    }

    /// The factor of the exact Hessian at `q`; false where it is not positive definite.
    fn factorize_near(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> bool {
        self.approached = false;
        if !energy.near_hessian(q, &mut self.scratch, &mut self.near) {
            return false;
        }
        self.work.hessians += 1;
        self.near.add_diagonal(|k| potential.shift + potential.diagonal.map_or(0.0, |c| c[k]));
        if let Some(matrix) = potential.matrix {
            self.near.add(matrix);
        }
        self.approached = self.near.factorize();
        self.approached
    }

    /// What a step with the last Hessian has as a residual at least, nearly: |g·Δ| is at most √(g·H⁻¹g Δ·HΔ) for any Δ, here the last direction.
    fn least_residual(&self, scale: f64) -> f64 {
        let along = sum_of(self.gradient.as_slice(), self.direction.as_slice(), |g, d| g * d);
        (along.abs() / (self.near_work * scale).sqrt()).max(0.0) // NaN is 0
    }

    /// Δ of an approach, and its residual; none without a descent direction.
    fn approaching(&mut self, scale: f64) -> Option<f64> {
        // nalgebra's own iterators take ten times as long
        let (gradient, direction) = (self.gradient.as_slice(), self.direction.as_mut_slice());
        direction.iter_mut().zip(gradient).for_each(|(d, g)| *d = -g);
        self.near.solve(direction);
        let slope = sum_of(gradient, direction, |g, d| g * d);
        self.near_work = -slope;
        (slope <= ROUNDING * ROUNDING * scale).then(|| (-slope.min(0.0) / scale).sqrt())
    }
}

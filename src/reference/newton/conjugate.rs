//! Conjugate gradients with the factor of an earlier tangent.
//!
//! Near the end of a search the tangent hardly changes any more. With the factor of the last one as a preconditioner a few products take the
//! place of a factorization.

use super::Newton;
use crate::reference::potential::Potential;
use crate::{Result, Vec3};
use faer::MatMut;

/// A search that is slower than this part of an even pace, by the logarithm of what is left, is given up. A product costs as much as an eighth
/// of a factorization, and most that are too slow are so from the first one on.
const SLOWEST: f64 = 0.5;

/// Scratch (n_unknowns each): what is left of −∇Φ, what was found of Δ, the way there and the matrix times that.
#[derive(Default)]
pub(super) struct Conjugate {
    left: Vec<f64>,
    found: Vec<f64>,
    way: Vec<f64>,
    product: Vec<f64>,
}

impl Conjugate {
    /// Numbers held.
    pub(super) fn len(&self) -> usize {
        self.left.len() + self.found.len() + self.way.len() + self.product.len()
    }
}

impl Newton {
    /// Finds Δ to ‖∇Φ + HΔ‖ ≤ `tolerance` ‖∇Φ‖ in at most so many products with the matrix H; false where it would take more, or H turns out
    /// not to be positive definite.
    pub(in crate::reference) fn solve_by_factor(
        &mut self,
        potential: &Potential,
        tolerance: f64,
        most: usize,
    ) -> Result<bool> {
        self.spend()?;
        let n = self.direction.len();
        let Conjugate { mut left, mut found, mut way, mut product } = std::mem::take(&mut self.conjugate);
        left.clear();
        left.extend(potential.free().flat_map(|v| (-self.gradient[v]).data.0[0]));
        for field in [&mut found, &mut way, &mut product] {
            field.clear();
            field.resize(n, 0.0);
        }
        let first = norm(&left);
        let mut room = self.symbolic.solving_room(1)?;
        let (mut last, mut enough) = (0.0, false);
        for product_number in 1..=most {
            self.direction.copy_from_slice(&left);
            let preconditioned = MatMut::from_column_major_slice_mut(&mut self.direction, n, 1);
            self.symbolic.solve_in_room(&self.factor, preconditioned, &mut room);
            let scale = dot(&left, &self.direction);
            let kept = if last > 0.0 { scale / last } else { 0.0 };
            way.iter_mut().zip(&self.direction).for_each(|(p, z)| *p = z + kept * *p);
            self.matrix.times(&way, &mut product);
            let curvature = dot(&way, &product);
            if !(curvature > 0.0 && scale > 0.0 && (scale / curvature).is_finite()) {
                break;
            }
            let alpha = scale / curvature;
            found.iter_mut().zip(&way).for_each(|(x, p)| *x += alpha * p);
            left.iter_mut().zip(&product).for_each(|(r, q)| *r -= alpha * q);
            last = scale;
            let part = norm(&left) / first;
            enough = part <= tolerance;
            let pace = SLOWEST * product_number as f64 / most as f64;
            if enough || part > libm::pow(tolerance, pace) {
                break;
            }
        }
        self.direction.copy_from_slice(&found);
        self.conjugate = Conjugate { left, found, way, product };
        if enough {
            self.balance_momenta(potential);
        }
        let slope = self.slope(potential);
        Ok(enough && slope < 0.0 && slope.is_finite())
    }

    /// Whether `x`, where the last search led from `from`, is nearer to where its first step would have gone than `apart` times the way there, by mass.
    pub(in crate::reference) fn is_foreseen(
        &self,
        potential: &Potential,
        (from, x): (&[Vec3], &[Vec3]),
        apart: f64,
    ) -> bool {
        if self.foreseen.is_empty() {
            return true; // it took no step
        }
        let mass = &potential.shell.mass;
        let squared =
            |of: &dyn Fn(usize) -> Vec3| potential.free().map(|v| mass[v] * of(v).norm_squared()).sum::<f64>();
        let [off, way] = [squared(&|v| x[v] - self.foreseen[v]), squared(&|v| self.foreseen[v] - from[v])];
        off <= apart * apart * way
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

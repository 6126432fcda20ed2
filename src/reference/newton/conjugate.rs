//! Conjugate gradients with a factor that is nearly that of the tangent.
//!
//! Near the end of a search the tangent hardly changes any more. With the factor of the last one as a preconditioner a few products take the
//! place of a factorization. Or the factor is the tangent's own, in single precision ([`super::single`]).

use super::Newton;
use crate::Result;
use crate::reference::potential::Potential;

/// A search that is slower than this part of an even pace, by the logarithm of what is left, is given up. A product costs as much as an eighth
/// of a factorization, and most that are too slow are so from the first one on.
const SLOWEST: f64 = 0.5;

/// Scratch (n_unknowns each): what is left of −∇Φ, what was found of Δ, the way there and the matrix times that, by way of sums.
#[derive(Default)]
pub(super) struct Conjugate {
    left: Vec<f64>,
    found: Vec<f64>,
    way: Vec<f64>,
    product: Vec<f64>,
    sums: Vec<f64>,
}

impl Conjugate {
    /// Numbers held.
    pub(super) fn len(&self) -> usize {
        self.left.len() + self.found.len() + self.way.len() + self.product.len() + self.sums.len()
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
        self.conjugate_gradients(potential, tolerance, (most, Some(SLOWEST)))
    }

    /// The same, and no slower than so many parts of an even pace.
    pub(super) fn conjugate_gradients(
        &mut self,
        potential: &Potential,
        tolerance: f64,
        (most, slowest): (usize, Option<f64>),
    ) -> Result<bool> {
        self.spend()?;
        let n = self.direction.len();
        let Conjugate { mut left, mut found, mut way, mut product, mut sums } = std::mem::take(&mut self.conjugate);
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
            self.precondition(&mut room);
            let scale = dot(&left, &self.direction);
            let kept = if last > 0.0 { scale / last } else { 0.0 };
            way.iter_mut().zip(&self.direction).for_each(|(p, z)| *p = z + kept * *p);
            self.matrix.times(&way, &mut product, &mut sums);
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
            let even = product_number as f64 / most as f64;
            if enough || slowest.is_some_and(|slowest| part > libm::pow(tolerance, slowest * even)) {
                break;
            }
        }
        self.direction.copy_from_slice(&found);
        self.conjugate = Conjugate { left, found, way, product, sums };
        if enough {
            self.balance_momenta(potential);
        }
        let slope = self.slope(potential);
        Ok(enough && slope < 0.0 && slope.is_finite())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

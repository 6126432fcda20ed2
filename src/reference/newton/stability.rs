//! Whether a point without a slope is a minimum, and the way down from one that is none.
//!
//! At a minimum H has no negative eigenvalue. Elsewhere Φ falls to both sides along the vector v of the lowest one by mass, Hv = λMv,
//! λ < 0: inverse iteration with H + σM finds it, σ the first of a ladder that makes this positive definite.

use super::Newton;
use crate::energy::Curvature;
use crate::reference::potential::Potential;
use crate::{Error, ErrorKind, Result, Vec3};
use faer::MatMut;

/// σ, of the mean eigenvalue, at first and over the one before, and how often it grows: from rounding to beyond every eigenvalue.
const FIRST_SHIFT: f64 = 1e-12;
const GROWTH: f64 = 8.0;
const SHIFTS: usize = 20;

/// With σ < 8|λ| a vector is as near after so many solves as the next eigenvalue's distance allows; any along which Φ falls will do.
const SOLVES: usize = 12;

/// Where many eigenvalues are below zero, and many more below σ, it is along none that is for longer.
const MOST_SOLVES: usize = 120;

/// The first step along v and the last, the largest displacement in sizes.
const FIRST_STEP: f64 = 1e-4;
const LAST_STEP: f64 = 1.0;

impl Newton {
    /// Moves `x`, where ∇Φ vanishes, to where Φ is lower if it is no minimum there, on the side of `toward`; whether it was none.
    pub fn leave_saddle(&mut self, potential: &Potential, x: &mut [Vec3], toward: &[Vec3]) -> Result<bool> {
        let Some(way) = self.falling_direction(potential, x)? else { return Ok(false) };
        let shell = potential.shell;
        let longest = way.iter().map(|d| d.norm()).fold(0.0, f64::max);
        let side: f64 = potential.free().map(|v| shell.mass[v] * way[v].dot(&(toward[v] - x[v]))).sum();
        let first = FIRST_STEP * shell.mesh.size / longest;
        let value = |newton: &mut Self, alpha: f64| {
            newton.trial.copy_from_slice(x);
            potential.free().for_each(|v| newton.trial[v] += alpha * way[v]);
            potential.value(&newton.trial).0
        };
        let mut alpha = match side == 0.0 {
            true if value(self, -first) < value(self, first) => -first,
            true => first,
            false => first * side.signum(),
        };
        let (start, mut lowest) = (potential.value(x).0, value(self, alpha));
        if lowest >= start {
            return Ok(false); // by less than the rounding of Φ
        }
        while alpha.abs() * longest < LAST_STEP * shell.mesh.size {
            let further = value(self, 2.0 * alpha);
            if further.is_nan() || further >= lowest {
                break;
            }
            (alpha, lowest) = (2.0 * alpha, further);
        }
        potential.free().for_each(|v| x[v] += alpha * way[v]);
        Ok(true)
    }

    /// v (n_vertices), 1 by mass, or `None` at a minimum, to rounding.
    fn falling_direction(&mut self, potential: &Potential, x: &[Vec3]) -> Result<Option<Vec<Vec3>>> {
        let shell = potential.shell;
        potential.assemble(&mut self.parts, x, Curvature::Exact, &mut self.matrix);
        self.matrix.require_finite()?;
        self.noise.measure(potential, x, &self.matrix);
        let mean = self.matrix.diagonal().map(f64::abs).sum::<f64>() / (3.0 * shell.total_mass);
        if self.refactorize()? {
            return Ok(None);
        }
        if self.stiffen_by_noise(potential, 0.0) && self.refactorize()? {
            return Ok(None);
        }
        let (mut sigma, mut added) = (0.0, FIRST_SHIFT * mean);
        for _ in 0..SHIFTS {
            for (i, v) in potential.free().enumerate() {
                self.matrix.add_diagonal(i, added * shell.mass[v]);
            }
            sigma += added;
            if self.refactorize()? {
                let (way, lambda) = self.lowest(potential, sigma)?;
                return Ok((lambda < 0.0).then_some(way));
            }
            added = (GROWTH - 1.0) * sigma;
        }
        Err(Error::new(ErrorKind::Numerical, format!("no shift up to {sigma:e} makes the Hessian positive definite")))
    }

    /// The lowest pair, by the factor of H + σM.
    fn lowest(&mut self, potential: &Potential, sigma: f64) -> Result<(Vec<Vec3>, f64)> {
        let (shell, n) = (potential.shell, self.direction.len());
        let spread =
            |v: usize| Vec3::new(libm::sin(1.3 * v as f64), libm::cos(0.7 * v as f64 + 1.0), libm::cos(2.1 * v as f64));
        let mut way = vec![Vec3::zeros(); shell.mass.len()];
        potential.free().for_each(|v| way[v] = spread(v));
        let mut lambda = f64::INFINITY;
        for solves in 1..=MOST_SOLVES {
            potential.project(&mut way);
            let squared: f64 = potential.free().map(|v| shell.mass[v] * way[v].norm_squared()).sum();
            way.iter_mut().for_each(|w| *w /= squared.sqrt());
            for (i, v) in potential.free().enumerate() {
                self.direction[3 * i..3 * i + 3].copy_from_slice((shell.mass[v] * way[v]).as_slice());
            }
            let solution = MatMut::from_column_major_slice_mut(&mut self.direction, n, 1);
            self.symbolic.solve_in_place(&self.factor, solution)?;
            let along: f64 =
                potential.free().enumerate().map(|(i, v)| shell.mass[v] * way[v].dot(&self.along(i))).sum();
            lambda = 1.0 / along - sigma;
            potential.free().enumerate().for_each(|(i, v)| way[v] = self.along(i));
            if solves >= SOLVES && lambda < 0.0 {
                break;
            }
        }
        Ok((way, lambda))
    }
}

//! What rounding of the coordinates does to Φ and ∇Φ, and so how far Newton's method can get.
//!
//! Forces are judged vertex by vertex: beside a fine part, whose rounding errors may be far above the load on a coarse one,
//! the coarse part is still to be solved.

use super::potential::Potential;
use crate::sparse::BlockMatrix;
use crate::{Shell, Vec3};

/// A force within this many of its expected rounding errors is as small as it gets.
const WITHIN: f64 = 10.0;

/// Rounding error of the sum Φ, relative to its terms.
const SUM: f64 = 1e-13;

/// With δ the rounding of the coordinates and D the diagonal of H.
#[derive(Clone, Default)]
pub struct Noise {
    /// Of ∇Φ at each free vertex: ten times δ ‖D‖ there. Empty before H is known.
    floor: Vec<f64>,
    /// Of D.
    pub trace: f64,
    /// In Φ, over √Φ: an element of stiffness k and energy e pulls with √(2ke), and Σ √(2ke) δ ≤ δ √(2 trace H Φ).
    root_value: f64,
}

impl Noise {
    /// Measures it about `x`, where the Hessian is `matrix`.
    pub fn measure(&mut self, potential: &Potential, x: &[Vec3], matrix: &BlockMatrix) {
        let furthest = potential.free().map(|v| x[v].amax()).fold(0.0, f64::max);
        let delta = f64::EPSILON * furthest;
        self.floor.clear();
        self.floor.resize(potential.shell.free.len(), 0.0);
        self.trace = 0.0;
        for (k, d) in matrix.diagonal().enumerate() {
            self.trace += d.abs();
            self.floor[k / 3] += d * d;
        }
        self.floor.iter_mut().for_each(|squares| *squares = WITHIN * delta * squares.sqrt());
        self.root_value = delta * f64::sqrt(2.0 * self.trace);
    }

    /// Forgets H.
    pub fn clear(&mut self) {
        self.floor.clear();
        self.root_value = 0.0;
    }

    /// Of a Φ whose terms have this sum of magnitudes.
    pub fn of_value(&self, magnitude: f64) -> f64 {
        SUM * magnitude + self.root_value * magnitude.sqrt()
    }

    /// The i-th free vertex's force, or zero where that is no more than rounding.
    pub fn above_floor(&self, i: usize, force: f64) -> f64 {
        if force <= self.floor[i] { 0.0 } else { force }
    }

    /// Of a force that is rounding at every free vertex, at most; 0 before H is known.
    pub fn norm(&self) -> f64 {
        self.floor.iter().map(|floor| floor * floor).sum::<f64>().sqrt()
    }

    /// Whether H is known and every free vertex's force is no more than rounding.
    pub fn explains(&self, shell: &Shell, gradient: &[Vec3]) -> bool {
        let above = |(i, &v): (usize, &u32)| self.above_floor(i, gradient[v as usize].norm()) > 0.0;
        self.floor.len() == shell.free.len() && !shell.free.iter().enumerate().any(above)
    }

    /// The stiffness that rounding errors of the i-th free vertex's force have over its share of the shell, √(area).
    pub fn stiffness(&self, i: usize, area: f64) -> f64 {
        self.floor[i] / area.sqrt()
    }
}

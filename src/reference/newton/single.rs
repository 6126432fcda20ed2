//! Factors in single precision, for steps in time.
//!
//! A large factor takes six tenths of the time in single precision, to make and to read. With it as a preconditioner a few conjugate gradients solve in double
//! precision. How many depends on the stiffness over what is least of it: in a step in time that is inertia, h⁻²M. Equilibria have none.

use super::Newton;
use crate::Result;
use crate::reference::potential::Potential;
use crate::sparse::{Factor, SolvingRoom, Symbolic};
use faer::MatMut;

/// Stiffness over inertia, traces of both, at most: rounding to single precision is 6 times inertia then. At 8e7 each product leaves a tenth of the
/// force, and at 1e10 half of the searches fail.
const STIFFNESS: f64 = 1e8;

/// Products at most, and of what a direction may leave the part that one by single precision may, and no less: what is left is of soft
/// shapes, in which little force is a long way.
const MOST: usize = 8;
const SOFT: f64 = 1e-2;
const LEAST: f64 = 1e-6;

/// The factor, once there is one, and what it is good for.
#[derive(Default)]
pub(in crate::reference) struct Single {
    factor: Option<Factor<f32>>,
    /// Whether it is the one that solves.
    pub at_hand: bool,
    /// Whether it did not do for the present search.
    pub failed: bool,
}

impl Single {
    /// Bytes held.
    pub fn bytes(&self, symbolic: &Symbolic) -> usize {
        if self.factor.is_some() { symbolic.factor_bytes() / 2 } else { 0 }
    }
}

impl Newton {
    /// Finds Δ to `tolerance` as [`Newton::solve_by_factor`], with a new factor in single precision; false where that does not do, or is not for this matrix.
    pub(in crate::reference) fn solve_by_single(&mut self, potential: &Potential, tolerance: f64) -> Result<bool> {
        if self.single.failed || !self.reusing || !self.is_inert(potential) {
            return Ok(false);
        }
        if self.single.factor.is_none() {
            self.single.factor = self.symbolic.single_factor();
        }
        let Some(factor) = &mut self.single.factor else { return Ok(false) };
        self.factorizations += 1;
        self.made_at = None;
        self.single.at_hand = self.symbolic.refactorize_single(&self.matrix.lower, factor)?;
        let tolerance = (SOFT * tolerance).max(LEAST);
        let found = self.single.at_hand && self.conjugate_gradients(potential, tolerance, (MOST, None))?;
        self.single.failed = !found;
        Ok(found)
    }

    /// Whether inertia is enough of the matrix at hand.
    fn is_inert(&self, potential: &Potential) -> bool {
        let Some(step) = potential.step else { return false };
        let mass = &potential.shell.mass;
        let inertia: f64 = potential.free().map(|v| 3.0 * mass[v] * step.inertia_of_mass(v)).sum();
        self.noise.trace <= STIFFNESS * inertia
    }

    /// Δ ← H⁻¹Δ with the factor at hand.
    pub(super) fn precondition(&mut self, room: &mut SolvingRoom) {
        let n = self.direction.len();
        let x = MatMut::from_column_major_slice_mut(&mut self.direction, n, 1);
        match &self.single.factor {
            Some(factor) if self.single.at_hand => self.symbolic.solve_single_in_room(factor, x, room),
            _ => self.symbolic.solve_in_room(&self.factor, x, room),
        }
    }
}

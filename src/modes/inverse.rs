//! (A − σI)⁻¹ with room for one factor: who counts eigenvalues borrows the room, and the inverse is factorized anew if it is asked
//! for after that. Counts are seldom disputed, and a factor is what large shells need most memory for.

use super::ScaledStiffness;
use crate::sparse::{Factor, Symbolic};
use crate::{Error, ErrorKind, Result};
use faer::MatMut;

/// See the module's text.
pub struct Inverse<'a> {
    symbolic: &'a Symbolic,
    stiffness: &'a ScaledStiffness,
    sigma: f64,
    factor: Factor,
    /// The factor is that of A − σI.
    ready: bool,
}

impl<'a> Inverse<'a> {
    /// `None` when A − σI is not positive definite.
    pub fn new(symbolic: &'a Symbolic, stiffness: &'a ScaledStiffness, sigma: f64) -> Result<Option<Self>> {
        let mut inverse = Self { symbolic, stiffness, sigma, factor: symbolic.factor()?, ready: false };
        Ok(inverse.factorize()?.then_some(inverse))
    }

    fn factorize(&mut self) -> Result<bool> {
        self.ready = self.symbolic.refactorize(&self.stiffness.shifted(self.sigma), &mut self.factor)?;
        Ok(self.ready)
    }

    /// X ← (A − σI)⁻¹X.
    pub fn apply(&mut self, x: MatMut<'_, f64>) -> Result<()> {
        if !self.ready && !self.factorize()? {
            return Err(Error::new(ErrorKind::Numerical, "a matrix that was positive definite no longer is"));
        }
        self.symbolic.solve_in_place(&self.factor, x)
    }

    /// The room, for another factor.
    pub fn room(&mut self) -> &mut Factor {
        self.ready = false;
        &mut self.factor
    }
}

//! Steps to several shares of a load from one shape: their tangent is the same, so that it is made once.

use super::Newton;
use crate::reference::potential::Potential;
use crate::{Result, Vec3};
use faer::MatMut;

/// Where the load leads from a shape.
pub struct Ahead {
    /// What a whole share adds to the load (n_vertices).
    change: Vec<Vec3>,
    /// Whether the shape balances the load that it is gone from, to the last bit.
    balanced: bool,
    /// The share that is gone ahead.
    pub share: f64,
    known: Option<Known>,
}

/// Of a share, Δ, and what Δ gains with it (n_unknowns each).
struct Known {
    share: f64,
    direction: Vec<f64>,
    rate: Vec<f64>,
}

impl Ahead {
    /// Of a change that nothing is known of yet.
    pub fn new(change: Vec<Vec3>, balanced: bool) -> Self {
        Self { change, balanced, share: 1.0, known: None }
    }
}

impl Newton {
    /// Δ ahead; false where it is not known.
    pub(in crate::reference) fn go_ahead(&mut self, ahead: &Ahead) -> bool {
        let Some(Known { share, direction, rate }) = &ahead.known else { return false };
        let further = ahead.share - share;
        let both = direction.iter().zip(rate);
        self.direction.iter_mut().zip(both).for_each(|(own, (first, rate))| *own = first + further * rate);
        true
    }

    /// Takes down Δ ahead, as the factor at hand has just given it.
    pub(in crate::reference) fn look_ahead(&mut self, potential: &Potential, ahead: &mut Ahead) -> Result<()> {
        let direction = self.direction.clone();
        let rate = match ahead.balanced {
            true => direction.iter().map(|x| x / ahead.share).collect(),
            false => {
                let mut change = ahead.change.clone();
                potential.project(&mut change);
                let mut rate: Vec<f64> = potential.free().flat_map(|v| change[v].data.0[0]).collect();
                let column = MatMut::from_column_major_slice_mut(&mut rate, direction.len(), 1);
                self.symbolic.solve_in_place(&self.factor, column)?;
                rate
            }
        };
        ahead.known = Some(Known { share: ahead.share, direction, rate });
        Ok(())
    }
}

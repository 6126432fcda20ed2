//! Steps to several shares of a load from one shape, or to several loads from rest: their tangent is the same, so that it is made once.

use super::Newton;
use crate::energy::Stress;
use crate::reference::noise::Noise;
use crate::reference::potential::Potential;
use crate::sparse::Factor;
use crate::{Result, Vec3};
use faer::MatMut;

/// A search that ends further from where its first step leads than that step is long has leapt over a snap.
pub const LEAP: f64 = 1.0;
/// The same after its second step, which still overshoots: on leaves one came back from 1.12, and none from beyond.
const LEAP_AT_ONCE: f64 = 1.25;

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

/// The tangent where nothing acts, for searches that begin there.
pub struct AtRest {
    factor: Factor,
    noise: Noise,
}

impl Newton {
    /// The tangent at rest, of a `potential` that nothing acts in; none where it is not positive definite.
    pub(in crate::reference) fn tangent_at_rest(&mut self, potential: &Potential) -> Result<Option<AtRest>> {
        let (rest, mut stress) = (&potential.shell.mesh.positions, vec![]);
        self.begin(potential, rest, &mut stress);
        potential.assemble_mixed(&mut self.parts, rest, Stress::whole(&stress), &mut self.matrix);
        let mut noise = Noise::default();
        noise.measure(potential, rest, &self.matrix);
        self.matrix.require_finite()?;
        let mut factor = self.symbolic.factor()?;
        let found = self.symbolic.refactorize(&self.matrix.lower, &mut factor)?;
        Ok(found.then_some(AtRest { factor, noise }))
    }

    /// Finds the first Δ of a search from rest by the tangent there, where ‖∇Φ‖ is `force`; false where it is not known, or not of this search.
    pub(in crate::reference) fn go_from_rest(&mut self, potential: &Potential, x: &[Vec3], force: f64) -> Result<bool> {
        let Some(rest) = &self.at_rest else { return Ok(false) };
        let free = potential.step.is_none() && potential.points.is_none() && potential.constraints.is_empty();
        if self.foreign || !free || *x != potential.shell.mesh.positions[..] {
            return Ok(false);
        }
        self.factor.clone_from(&rest.factor);
        self.single.at_hand = false;
        self.noise.clone_from(&rest.noise);
        self.spend()?;
        self.factorizations += 1; // one of those that a search may take, as if it were its own
        self.made_at = None;
        self.solve_by_gradient(potential)?;
        let slope = self.slope(potential);
        let falls = slope < 0.0 && slope.is_finite();
        self.made_at = falls.then_some(force);
        Ok(falls)
    }

    /// Whether a search that others go ahead by, and that has come to `x` by a step after so many others, is leaping over a snap: it is
    /// given up then, as it would be where it ends.
    pub(in crate::reference) fn is_leaping(&self, potential: &Potential, x: &[Vec3], others: usize) -> bool {
        let apart = if others > 1 { LEAP } else { LEAP_AT_ONCE };
        self.ahead.is_some() && others > 0 && !self.is_foreseen(potential, (potential.origin, x), apart)
    }

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

//! Searches for the equilibria under shares of a load, by tangents that are held.
//!
//! A search goes first where the load leads, and then on by the same tangent as long as each step is much shorter than the last one. Else the
//! tangent is made anew where the search is. Where that is not positive definite the shell is about to snap, and the search is given up. The next
//! one, under a smaller share, begins at the same shape: where the load leads from there, to second order, is kept. An end that no tangent was made
//! on the way to is examined by one, which the next search begins by.

use super::held::{Held, Place, Rows, Way};
use super::{Convergence, Newton, Stop, WORST_RESIDUAL};
use crate::reference::mixed::FACTORIZATIONS;
use crate::reference::noise::Noise;
use crate::reference::potential::Potential;
use crate::reference::{free_norm, mass_norm};
use crate::sparse::Factor;
use crate::{Result, Vec3};

/// A search that ends further from where its first step leads than that step is long has leapt over a snap.
const LEAP: f64 = 1.0;
/// The same before its second tangent, as steps still overshoot: on leaves one came back from 1.12, and none from beyond.
const LEAP_AT_ONCE: f64 = 1.25;

/// Where the load leads from a shape.
pub struct Ahead {
    /// What a whole share adds to the load (n_vertices).
    change: Vec<Vec3>,
    /// Whether the shape balances the load that it is gone from, to the last bit.
    balanced: bool,
    /// The share that is gone ahead.
    pub share: f64,
    /// Whether the last search began by the tangent at the shape itself.
    pub own: bool,
    known: Option<Known>,
}

/// Of a share, the first step and the second, and what the first gains with the share where that is not in proportion.
struct Known {
    share: f64,
    /// ε of the shape.
    strain: Vec<f64>,
    first: Way,
    rate: Option<Way>,
    second: Option<Way>,
}

impl Ahead {
    /// Of a change that nothing is known of yet.
    pub fn new(change: Vec<Vec3>, balanced: bool) -> Self {
        Self { change, balanced, share: 1.0, own: false, known: None }
    }
}

impl Known {
    /// The first step to another share.
    fn first_step(&self, share: f64) -> Way {
        let (more, Self { first, .. }) = (share - self.share, self);
        let Some(rate) = &self.rate else { return first.scaled(share / self.share) };
        Way {
            along: first.along.iter().zip(&rate.along).map(|(first, rate)| first + more * rate).collect(),
            strain: first.strain.iter().zip(&rate.strain).map(|(first, rate)| first + more * rate).collect(),
        }
    }

    /// The second, to second order.
    fn second_step(&self, share: f64) -> Option<Way> {
        self.second.as_ref().map(|second| second.scaled((share / self.share).powi(2)))
    }
}

/// The tangent where nothing acts, for searches that begin there.
pub struct AtRest {
    pub(super) factor: Factor,
    pub(super) rows: Rows,
    noise: Noise,
}

impl Newton {
    /// The tangent at rest, of a `potential` that nothing acts in; none where it is not positive definite.
    pub(in crate::reference) fn tangent_at_rest(&mut self, potential: &Potential) -> Result<Option<AtRest>> {
        let (rest, mut stress) = (&potential.shell.mesh.positions, vec![]);
        self.begin(potential, rest, &mut stress);
        if !self.hold(potential, rest, &stress)? {
            self.matrix.require_finite()?;
            return Ok(None);
        }
        self.held = Held::Nothing;
        let rows = std::mem::take(&mut self.rows);
        Ok(Some(AtRest { factor: self.factor.clone(), rows, noise: self.noise.clone() }))
    }

    /// Moves `x`, in equilibrium under the load that `ahead` is gone from, to that under its share; `None`, and `x` as it was, where a tangent is not
    /// positive definite, the steps do not converge or leap. `watch` hears of the residual before each factorization.
    pub(in crate::reference) fn go_ahead(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        (stop, ahead): (Stop, &mut Ahead),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Option<Convergence>> {
        let from = potential.value(x).0;
        let found = self.steps_ahead(potential, x, (stop, &mut *ahead), watch)?;
        if let Some(end) = found {
            let (value, magnitude) = potential.value(x);
            if value <= from + self.noise.of_value(magnitude) {
                return Ok(Some(end));
            }
        }
        x.copy_from_slice(potential.origin);
        self.held = Held::Nothing;
        if !ahead.own {
            ahead.known = None; // the next one looks again, by the tangent here
        }
        Ok(None)
    }

    fn steps_ahead(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        (stop, ahead): (Stop, &mut Ahead),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Option<Convergence>> {
        let (shell, before) = (potential.shell, self.factorizations);
        if ahead.known.is_none() && !self.look_ahead(potential, x, (stop, &mut *ahead), watch)? {
            return Ok(None);
        }
        let Ahead { share, known: Some(known), .. } = ahead else { return Ok(None) };
        let first = known.first_step(*share);
        let mut at = Place::new(x.len(), known.strain.clone());
        let mut is_second = self.go(potential, x, &mut at, &first);
        let (mut made, mut last) = (0, f64::INFINITY);
        for steps in 1.. {
            let force = self.look_around(potential, x, &mut at);
            let residual = force / stop.scale;
            let stagnates = force > 0.5 * last && self.noise.explains(shell, &self.gradient);
            if residual <= stop.tolerance || stagnates {
                if !is_near(potential, x, &first, LEAP) {
                    break;
                }
                if made == 0 {
                    watch(residual)?;
                    if !self.hold(potential, x, &at.strain)? {
                        break;
                    }
                }
                let harmless = residual <= WORST_RESIDUAL || self.hardly_lacks(potential, x)?;
                let iterations = self.factorizations - before;
                return Ok(Some(Convergence { converged: true, iterations, residual, harmless }));
            }
            last = force;
            let apart = if made > 1 { LEAP } else { LEAP_AT_ONCE };
            if steps > 1 && !is_near(potential, x, &first, apart) {
                break;
            }
            let next = self.next_way(potential, &at)?;
            if is_second && *share == known.share && next.is_some() {
                known.second.clone_from(&next);
            }
            let kept = if is_second { known.second_step(*share) } else { None };
            is_second = false;
            if let Some(way) = next.or(kept).filter(|way| Self::is_shorter(potential, way, &at)) {
                self.go(potential, x, &mut at, &way);
                continue;
            }
            if made == FACTORIZATIONS.min(stop.max_iterations) {
                break;
            }
            watch(residual)?;
            made += 1;
            if !self.hold(potential, x, &at.stress)? {
                break;
            }
            let way = self.way_down(potential)?;
            at.steps = 0;
            self.go(potential, x, &mut at, &way);
        }
        Ok(None)
    }

    /// Takes down where the load leads from `x`; false where the tangent there is not positive definite.
    fn look_ahead(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        (stop, ahead): (Stop, &mut Ahead),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<bool> {
        let mut strain = vec![];
        self.begin(potential, x, &mut strain);
        potential.gradient_in(&mut self.parts, x, &mut self.gradient);
        let is_rest = potential.points.is_none() && *x == potential.shell.mesh.positions[..];
        let rest = self.at_rest.clone().filter(|_| is_rest);
        ahead.own = rest.is_some() || !self.holds();
        if ahead.own {
            watch(free_norm(potential.shell, &self.gradient) / stop.scale)?;
        }
        if let Some(rest) = rest {
            self.noise.clone_from(&rest.noise);
            self.held = Held::AtRest(rest);
            self.factorizations += 1; // as if it were the search's own
        } else if ahead.own && !self.hold(potential, x, &strain)? {
            return Ok(false);
        }
        let first = self.way_down(potential)?;
        let mut rate = None;
        if ahead.own && !ahead.balanced {
            let mut change: Vec<Vec3> = ahead.change.iter().map(|f| -f).collect();
            potential.project(&mut change);
            rate = Some(self.way_against(potential, &change)?);
        }
        ahead.known = Some(Known { share: ahead.share, strain, first, rate, second: None });
        Ok(true)
    }

    /// Whether the force that is left at `x` moves the shell by next to nothing.
    fn hardly_lacks(&mut self, potential: &Potential, x: &[Vec3]) -> Result<bool> {
        if !self.holds() {
            return Ok(false);
        }
        self.way_down(potential)?;
        Ok(self.hardly_moves(potential, x))
    }
}

/// Whether `x` is nearer to where a `first` step would have gone than `apart` times the way there, by mass.
fn is_near(potential: &Potential, x: &[Vec3], first: &Way, apart: f64) -> bool {
    let off = |v: usize| x[v] - (potential.origin[v] + first.along[v]);
    mass_norm(potential.shell, off) <= apart * mass_norm(potential.shell, |v| first.along[v])
}

//! A factor on all stiffness while a state runs, without a precompute.
//!
//! With the factor s, M a + (ξM + ζ s K) v + s ∇E = F. In the time τ = √s t this is the motion of the shell as it was precomputed,
//!
//!   M a' + (ξ/√s M + ζ √s K) v' + ∇E = F/s,      v' = v/√s,
//!
//! so that every method takes it exactly, a step costs as much as before, and ratios of critical damping stay what they are. A state computes in τ and
//! by F/s throughout; the functions that a host calls convert. Air pulls by the square of velocities: its own is divided by √s.

use super::State;
use crate::contact::{Contact, Summary};
use crate::load::Wind;
use crate::methods::Damping;
use crate::support::{FrameMotion, Rates};
use crate::{Error, Result, Vec3};

/// The least and the largest factor.
pub(super) const RANGE: [f64; 2] = [1e-9, 1e9];

/// See the module's text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tempo {
    /// s.
    pub(super) factor: f64,
    /// √s.
    pub(super) root: f64,
}

impl Default for Tempo {
    fn default() -> Self {
        Self { factor: 1.0, root: 1.0 }
    }
}

impl Tempo {
    pub(super) fn is_one(&self) -> bool {
        self.factor == 1.0
    }

    /// Of a frame's rates, from seconds to τ.
    fn rates(&self, rates: Rates) -> Rates {
        Rates {
            velocity: rates.velocity / self.root,
            acceleration: rates.acceleration / self.factor,
            angular_velocity: rates.angular_velocity / self.root,
            angular_acceleration: rates.angular_acceleration / self.factor,
        }
    }

    pub(super) fn frame_motion(&self, motion: FrameMotion) -> FrameMotion {
        match motion {
            FrameMotion::Given(rates) => FrameMotion::Given(self.rates(rates)),
            other => other,
        }
    }

    pub(super) fn wind(&self, mut wind: Wind) -> Wind {
        wind.velocity /= self.root;
        wind.local.iter_mut().for_each(|v| *v /= self.root);
        wind
    }

    pub(super) fn damping(&self, damping: &Damping) -> Damping {
        Damping {
            mass_coefficient: damping.mass_coefficient / self.root,
            stiffness_coefficient: damping.stiffness_coefficient * self.root,
            ratios: damping.ratios.clone(),
            factors: damping.factors.clone(),
        }
    }

    pub(super) fn contact(&self, contact: Contact) -> Contact {
        Contact { force: self.factor * contact.force, ..contact }
    }

    pub(super) fn summary(&self, summary: Summary) -> Summary {
        Summary { impulse: self.root * summary.impulse, ..summary }
    }

    /// A step that was refused counts in τ.
    pub(super) fn told(&self, error: Error) -> Error {
        if self.is_one() {
            return error;
        }
        let message = format!("{}; seconds there are {:?} times those of the step", error.message, self.root);
        Error::new(error.kind, message)
    }

    /// What tells saved states of different factors apart.
    pub(super) fn mark(&self) -> u64 {
        if self.is_one() { 0 } else { self.factor.to_bits().rotate_left(17) }
    }
}

impl State {
    /// What all stiffness is multiplied by, from the next step on; 1 at first. Shape and velocities stay. Stays at a reset.
    pub fn set_stiffness(&mut self, factor: f64) -> Result<()> {
        if !(RANGE[0]..=RANGE[1]).contains(&factor) {
            let [least, most] = RANGE;
            return Err(Error::argument(format!("factor is {factor:?}: it must be from {least:e} to {most:e}")));
        }
        if self.points.is_some() && factor != 1.0 {
            return Err(Error::argument("a state with a point energy keeps its stiffness"));
        }
        let before = self.tempo;
        if factor == before.factor {
            return Ok(());
        }
        self.tempo = Tempo { factor, root: factor.sqrt() };
        if let Err(error) = self.apply_damping(&self.damping.clone()) {
            self.tempo = before;
            return Err(error);
        }
        self.rescale(Tempo { factor: factor / before.factor, root: self.tempo.root / before.root });
        self.rest.wake();
        Ok(())
    }

    /// The factor.
    pub fn stiffness(&self) -> f64 {
        self.tempo.factor
    }

    /// τ per second: what rates of amplitudes are multiplied by to be those of a second.
    pub fn tempo(&self) -> f64 {
        self.tempo.root
    }

    /// From one τ to another, `by` so much faster.
    fn rescale(&mut self, by: Tempo) {
        self.gravity /= by.factor;
        self.loads.scale(1.0 / by.factor);
        self.loads.wind = self.loads.wind.take().map(|wind| by.wind(wind));
        self.frame.velocity /= by.root;
        self.frame.angular_velocity /= by.root;
        self.frame.motion = by.frame_motion(self.frame.motion);
        self.rates = by.rates(self.rates);
        if let Some(supports) = &mut self.supports {
            supports.rates.iter_mut().for_each(|rate: &mut Vec3| *rate /= by.root);
        }
        if let Some(rest) = &mut self.moving_rest {
            rest.rescale(by.root);
        }
        self.motion.change(|set| set.scale_forces(1.0 / by.factor));
        let [unknowns, mut rates] = self.motion.unknowns();
        rates.iter_mut().for_each(|rate| *rate /= by.root);
        self.motion.set_unknowns([&unknowns, &rates]);
        if let Some(contacts) = &mut self.contacts {
            contacts.scale_forces(1.0 / by.factor);
        }
    }
}

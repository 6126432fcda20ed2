//! A shell that nothing holds does not feel its frame: a step is taken where the frame will be, as if it had always been there at rest.
//!
//! With the frame's pose P, x = o + P (pivot + d + R y) stays what it is from one frame to the other, and so does its velocity. What a frame
//! changes of its velocity it changes at once where a step begins, so that the shell stays where it is to rounding, however the frame moves.
//! Damping by mass is relative to the frame, as in every method: the moving frame drags.

use super::Floating;
use crate::load::BodyLoad;
use crate::methods::Acting;
use crate::support::{Passage, Pose};
use crate::{Result, Vec3};

impl Floating {
    /// A step of `h` while the frame moves. Changes nothing on failure.
    pub(super) fn pass_by(&mut self, acting: &Acting, passage: &Passage, h: f64) -> Result<()> {
        let (place, rates) = (&self.place, &self.rates);
        let before = (place.slide, place.turn, rates.slide, rates.spin);
        self.carry(passage, acting.axes.frame);
        let drag = self.damping.mass;
        let load = BodyLoad::dragged(passage, acting.axes.frame, drag);
        match self.step_in_frame(&Acting { load: &load, passage: None, ..*acting }, h) {
            Ok(()) => {
                let [slide, spin] = self.moving_along(acting.axes.frame, &passage.now);
                self.rates.slide -= slide;
                self.rates.spin -= spin;
                Ok(())
            }
            Err(error) => {
                (self.place.slide, self.place.turn, self.rates.slide, self.rates.spin) = before;
                Err(error)
            }
        }
    }

    /// Sets place and rates as seen from the pose `to`, at rest.
    fn carry(&mut self, passage: &Passage, to: &Pose) {
        let [slide, spin] = self.moving_along(&passage.from, &passage.before);
        let between = to.rotation.inverse() * passage.from.rotation;
        let (place, rates, pivot) = (&mut self.place, &mut self.rates, self.rigid.pivot);
        rates.slide = between * (rates.slide + slide);
        rates.spin += spin;
        let shift = to.rotation.inverse() * (passage.from.origin - to.origin);
        place.slide = shift + between * (pivot + place.slide) - pivot;
        place.turn = between * place.turn;
    }

    /// Rates of a shell that goes along with a frame at `pose` that moves so: of the slide in frame axes, of the turn in body axes.
    fn moving_along(&self, pose: &Pose, [velocity, spin]: &[Vec3; 2]) -> [Vec3; 2] {
        let back = pose.rotation.inverse();
        let (velocity, spin) = (back * velocity, back * spin);
        let slide = velocity + spin.cross(&(self.rigid.pivot + self.place.slide));
        [slide, self.place.turn.inverse() * spin]
    }
}

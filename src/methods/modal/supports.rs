//! Amplitudes of support fields: prescribed by where supports go, never free. See [`SupportFields`].

use super::{Map, Modal};
use crate::Vec3;
use crate::methods::Acting;
use crate::modes::SupportFields;
use crate::support::Pose;
use crate::warp::Placement;

/// Where support fields are at the end of a step, and how they get there.
#[derive(Clone)]
pub(super) struct SupportMotion {
    pub(super) amplitudes: Vec<f64>,
    pub(super) rates: Vec<f64>,
    /// Over the step. Differences are taken so that the impulse is exactly the change of the rates.
    pub(super) acceleration: Vec<f64>,
}

impl SupportMotion {
    /// At rest in the frame.
    pub(super) fn new(fields: &SupportFields) -> Self {
        let zeros = vec![0.0; fields.n()];
        Self { amplitudes: zeros.clone(), rates: zeros.clone(), acceleration: zeros }
    }
}

impl<M: Map> Modal<M> {
    /// Finds where support fields go in a step of `h`; nowhere without supports that move.
    pub(super) fn follow_supports(&mut self, acting: &Acting, h: f64) {
        let (warped, modes) = (self.is_warped(), self.damping.len());
        let (Some(motion), Some(fields)) = (&mut self.supports, &self.basis.supports) else { return };
        let (now, rates) = (&self.q[modes..], &self.q_dot[modes..]);
        let SupportMotion { amplitudes, rates: next, acceleration } = &mut **motion;
        match acting.supports {
            Some(to) => {
                fields.amplitudes(&self.basis.shell.mesh.positions, to.displacement, warped, amplitudes);
            }
            None => amplitudes.copy_from_slice(now),
        }
        if acting.supports.is_some_and(|to| to.jump) {
            next.fill(0.0);
            acceleration.fill(0.0);
            return;
        }
        for j in 0..amplitudes.len() {
            next[j] = (amplitudes[j] - now[j]) / h;
            acceleration[j] = (next[j] - rates[j]) / h;
        }
    }

    /// How far any support is, by the map, from its place displaced by `d`.
    pub(super) fn largest_support_miss(&self, d: &[Vec3]) -> f64 {
        let Some(fields) = &self.basis.supports else { return 0.0 };
        let Pose { origin, .. } = Pose::identity();
        let (rest, mut missed) = (&self.basis.shell.mesh.positions, 0.0f64);
        let measure = |i: usize, x: [f64; 3]| {
            let place = rest[fields.held[i] as usize] + d[i];
            missed = missed.max((Vec3::from(x) - place).norm());
        };
        self.map.positions_of((&self.basis, &self.q), &Placement { origin, rotation: None }, &fields.held, measure);
        missed
    }

    /// Puts support fields where supports are, displaced by `d`, at rest.
    pub(super) fn set_supports(&mut self, d: &[Vec3]) {
        let (warped, modes) = (self.is_warped(), self.damping.len());
        if let Some(fields) = &self.basis.supports {
            fields.amplitudes(&self.basis.shell.mesh.positions, d, warped, &mut self.q[modes..]);
            self.q_dot[modes..].fill(0.0);
        }
        if let Some(motion) = &mut self.supports {
            motion.acceleration.fill(0.0);
        }
    }
}

//! Supports that move against each other: the frame goes with them as a whole, and the shell follows what is left.

use super::{Method, State};
use crate::error::{invalid, try_zeroed};
use crate::methods::{Motion, SupportTargets};
use crate::modes::supported;
use crate::support::{FrameMotion, Pose};
use crate::{Error, ErrorKind, Result, Vec3, wide_norm};
use std::sync::Arc;

/// Supports further from where the frame has them than this, in model sizes, are nowhere.
const FURTHEST: f64 = 1e6;

/// Of the model's size, what supports may be off a rigid motion by rounding: of positions in 32 bits, some units from the origin.
const ROUNDING: f64 = 1e-5;

/// Where supports are, off their places in the frame (supported vertices with mass, ascending; frame axes).
#[derive(Clone)]
pub(super) struct MovingSupports {
    pub(super) held: Arc<[u32]>,
    /// At the end of the last step.
    pub(super) now: Vec<Vec3>,
    /// Rates over the last step.
    pub(super) rates: Vec<Vec3>,
    /// At the end of the next step.
    pub(super) target: Vec<Vec3>,
    /// They are at the target without having moved.
    pub(super) jump: bool,
    /// At the end of the part of a step that is being taken.
    pub(super) heading: Vec<Vec3>,
}

impl MovingSupports {
    fn new(held: Arc<[u32]>) -> Result<Self> {
        let n = held.len();
        let room = || try_zeroed("the supports", n);
        Ok(Self { held, now: room()?, rates: room()?, target: room()?, jump: false, heading: room()? })
    }

    /// What the method is told of the present step.
    pub(super) fn targets(&self) -> SupportTargets<'_> {
        SupportTargets { displacement: &self.heading, jump: self.jump }
    }

    /// Heads for a share of the way to the target.
    pub(super) fn head(&mut self, share: f64) {
        for ((heading, now), target) in self.heading.iter_mut().zip(&self.now).zip(&self.target) {
            *heading = if share == 1.0 || self.jump { *target } else { now + share * (target - now) };
        }
    }

    /// Is there, after a step of `h`, or at rest.
    pub(super) fn arrive(&mut self, h: Option<f64>) {
        let h = h.filter(|_| !self.jump);
        self.jump = false;
        for ((rate, now), target) in self.rates.iter_mut().zip(&mut self.now).zip(&self.target) {
            *rate = h.map_or(Vec3::zeros(), |h| (target - *now) / h);
            *now = *target;
        }
    }

    /// Whether the next step does not move them.
    pub(super) fn is_still(&self) -> bool {
        self.now == self.target && self.rates.iter().all(|rate| *rate == Vec3::zeros())
    }
}

impl State {
    /// Where supported vertices are at the end of the next step (world space): `x` gives the place of each, other vertices are not asked
    /// for. The frame is set to the rigid motion nearest to them, by least squares; moved for the first time since creation or reset,
    /// and before any step, or by a teleport, all is simply placed there. Fails, changing nothing, where nothing is supported, a place is not
    /// finite or far beyond the shell, or the supports leave a rigid motion and the state's method or model cannot follow.
    pub fn move_supports(&mut self, x: impl Fn(usize) -> Vec3, teleport: bool) -> Result<()> {
        self.refuse_moving_rest("supports that move by themselves")?;
        let mut next = match &self.supports {
            Some(supports) => supports.clone(),
            None => Box::new(MovingSupports::new(supported(&self.model.shell).into())?),
        };
        if next.held.is_empty() {
            return Err(Error::argument("the shell has no supports to move"));
        }
        let (shell, size) = (&self.model.shell, self.model.shell.mesh.size);
        let rest = &shell.mesh.positions;
        for v in next.held.iter().map(|v| *v as usize) {
            let place = x(v);
            if !place.iter().all(|c| c.is_finite()) {
                return Err(refused(v, &place, "it must be finite"));
            }
        }
        let pairs = || next.held.iter().map(|v| *v as usize).map(|v| (rest[v], x(v)));
        let pose = Pose::between(pairs, &self.frame.pose);
        let back = pose.rotation.inverse();
        let mut off = (0, 0.0);
        for (v, target) in next.held.iter().map(|v| *v as usize).zip(&mut next.target) {
            *target = back * (x(v) - pose.origin) - rest[v];
            let distance = wide_norm(target);
            // A difference that overflows is not within either.
            let near = distance <= FURTHEST * size;
            if !near {
                return Err(refused(v, &x(v), &format!("beyond {FURTHEST:e} sizes of the mesh, {size:?}")));
            }
            off = if distance > off.1 { (v, distance) } else { off };
        }
        if off.1 > ROUNDING * size && !self.motion.follows_supports() {
            return Err(self.cannot_follow(off, self.method()));
        }
        let placed = self.time == 0.0 && !self.placed;
        next.jump = teleport;
        self.set_frame(pose, if teleport { FrameMotion::Teleport } else { FrameMotion::Continuous });
        let changed = self.supports.as_ref().is_none_or(|before| before.target != next.target);
        if placed {
            next.arrive(None);
            next.head(1.0);
            self.motion.place_supports(&next.now);
        }
        self.supports = Some(next);
        self.wake_if(changed || placed || teleport);
        Ok(())
    }

    fn cannot_follow(&self, (v, distance): (usize, f64), method: Method) -> Error {
        let apart = format!("support {v} is {distance:e} off the rigid motion of all supports");
        let why = match self.model.modal.supports {
            None => "the model has no fields for that: precompute with support_fields".to_owned(),
            Some(_) => format!("states of {method} follow rigid motions only"),
        };
        Error::new(ErrorKind::Unsupported, format!("{apart}; {why}"))
    }

    /// Fails where supports are off a rigid motion and `motion` cannot follow.
    pub(super) fn check_supports_of(&self, motion: &dyn Motion) -> Result<()> {
        let Some(supports) = &self.supports else { return Ok(()) };
        let both = supports.now.iter().zip(&supports.target).map(|(now, target)| wide_norm(now).max(wide_norm(target)));
        let furthest = supports.held.iter().map(|v| *v as usize).zip(both).max_by(|a, b| a.1.total_cmp(&b.1));
        match furthest {
            Some(off) if off.1 > ROUNDING * self.model.shell.mesh.size && !motion.follows_supports() => {
                Err(self.cannot_follow(off, motion.method()))
            }
            _ => Ok(()),
        }
    }

    /// How far any support is from where the method's fields have it: by so much the shell is bent beside it. 0 where none moved.
    pub fn supports_missed(&self) -> f64 {
        self.supports.as_ref().map_or(0.0, |supports| self.motion.supports_missed(&supports.now))
    }

    /// How many numbers of a saved state are about supports. Fails unless they are of this shell's.
    pub(super) fn check_saved_supports(&self, numbers: &[f64]) -> Result<usize> {
        let held = supported(&self.model.shell);
        if numbers.first() != Some(&(held.len() as f64)) || numbers.len() < 1 + 6 * held.len() {
            return invalid(format!("the saved state is not of {} supports", held.len()));
        }
        let (places, size) = (&numbers[1..=3 * held.len()], self.model.shell.mesh.size);
        let furthest = places.chunks_exact(3).map(Vec3::from_column_slice).map(|d| wide_norm(&d)).fold(0.0, f64::max);
        if furthest > FURTHEST * size || (furthest > ROUNDING * size && !self.motion.follows_supports()) {
            return invalid(format!(
                "the saved state has a support {furthest:e} off the frame, where this one cannot follow"
            ));
        }
        Ok(1 + 6 * held.len())
    }

    /// Takes what a saved state has of supports, checked: none where none moved.
    pub(super) fn restore_supports(&mut self, numbers: &[f64]) -> Result<()> {
        self.supports = match numbers.split_first() {
            None => None,
            Some((_, numbers)) => {
                let mut supports = MovingSupports::new(supported(&self.model.shell).into())?;
                let (places, rates) = numbers.split_at(3 * supports.held.len());
                let vectors = |x: &[f64]| x.chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>();
                (supports.now, supports.rates) = (vectors(places), vectors(rates));
                (supports.target, supports.heading) = (supports.now.clone(), supports.now.clone());
                Some(Box::new(supports))
            }
        };
        Ok(())
    }

    /// Size of the forces that hold supports where they moved, as the method has them.
    pub(super) fn support_pull(&self) -> f64 {
        let modal = &self.model.modal;
        match (&self.supports, &modal.supports) {
            (Some(_), Some(fields)) if self.motion.follows_supports() => {
                fields.pull(&self.motion.unknowns()[0][modal.n_modes()..])
            }
            _ => 0.0,
        }
    }

    /// The place of vertex `v` (frame axes), if it is a support that moved.
    pub(super) fn support_at(&self, v: usize) -> Option<Vec3> {
        let supports = self.supports.as_ref()?;
        let i = supports.held.binary_search(&(v as u32)).ok()?;
        Some(self.model.shell.mesh.positions[v] + supports.now[i])
    }

    /// Where supports head for in the present step.
    pub(super) fn heading(&self) -> Option<SupportTargets<'_>> {
        self.supports.as_ref().map(|supports| supports.targets())
    }
}

fn refused(v: usize, x: &Vec3, why: &str) -> Error {
    Error::argument(format!("the support {v} is to be at ({:?}, {:?}, {:?}): {why}", x.x, x.y, x.z))
}

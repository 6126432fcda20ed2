//! Positions that Newton steps of the full shell bring nearer to it, for output alone.
//!
//! They go on from frame to frame: the way from the method's pose to where the last steps led, and the stress that the last one foresaw, are kept. Where
//! the method's pose is on another branch than the full shell, as where the shell has buckled, steps from that pose find no way to it; steps from
//! where it was a frame before do.

use super::certify::{BALANCED, Certificate};
use super::{Space, State};
use crate::arithmetic::Arithmetic;
use crate::error::{invalid, try_zeroed, unless_none};
use crate::features::Feature;
use crate::method::Method;
use crate::methods::Watch;
use crate::model::{MOST_FULL, NEAR};
use crate::reference::{Correcting, LOST};
use crate::support::Pose;
use crate::{Error, ErrorKind, Result, Vec3};

/// Steps before an equilibrium is sought: they follow the shell where it has buckled before.
const FIRST: usize = 2;

/// Where steps toward the full shell are.
#[derive(Clone)]
pub struct KeptCorrection {
    steps: Correcting,
    /// Whether the state is where they were made.
    is_current: bool,
}

impl KeptCorrection {
    /// The way that they led from the state's pose (n_vertices, frame axes), where it is still there.
    pub(super) fn way(&self) -> Option<&[Vec3]> {
        self.is_current.then_some(&self.steps.way)
    }

    /// Its numbers: 1 where it is current, the way, the stresses.
    pub fn save(&self, push: &mut impl FnMut(&f64)) {
        push(&f64::from(u8::from(self.is_current)));
        self.steps.way.iter().flatten().chain(&self.steps.stress).for_each(push);
    }
}

impl State {
    /// Takes so many Newton steps of the full shell, and keeps where they lead: [`State::positions_corrected`] shows it until the next step. They begin where the last
    /// call led, or at the method's pose where that leaves far less of the force. The loads are those that are set now, and the inertia is that of the method. The motion does not
    /// know. Each takes a factorization of the full shell's stiffness. No steps forget what is kept. Fails as [`State::certify`], and leaves it.
    pub fn correct(&mut self, steps: usize) -> Result<()> {
        self.correct_watched(steps, &mut |_| Ok(()))
    }

    /// The same, where `watch` hears before each step what is left of the force, relative, and may stop the work with an error: then what was kept before stays.
    pub fn correct_watched(&mut self, steps: usize, watch: &mut Watch) -> Result<()> {
        self.correction = match steps {
            0 => None,
            _ if self.motion.is_full_shell() => None,
            _ => Some(Box::new(KeptCorrection { steps: self.steps_toward(steps, watch)?, is_current: true })),
        };
        Ok(())
    }

    /// The same, on to a stable equilibrium of the full shell, of a state at rest, as after [`State::equilibrium`], that moves by fields: where
    /// a certificate finds more than 5 % of its displacement wrong. It is sought from where two steps lead, or else from the pose, or from rest. Of any other state, and where
    /// none is found, nothing is kept. So it is where loads were set that the pose does not balance: these begin a motion.
    ///
    /// Motion is left out: near a fold the inertia of a method that is far off leads astray.
    pub fn correct_as_needed(&mut self, watch: &mut Watch) -> Result<()> {
        self.correction = match self.may_be_helped()? {
            true => self.way_to_equilibrium(watch)?.map(|steps| Box::new(KeptCorrection { steps, is_current: true })),
            false => None,
        };
        Ok(())
    }

    /// Nothing where the pose is near the full shell, or where no equilibrium is found. Where most of the displacement is wrong, and no frame was
    /// corrected before, what is beside the pose says little of where the load leads: then the way from rest comes first.
    fn way_to_equilibrium(&self, watch: &mut Watch) -> Result<Option<Correcting>> {
        let own = unless_none(self.estimate(None, watch))?;
        let error = own.as_ref().map_or(f64::INFINITY, |(certificate, _)| certificate.error);
        if error <= NEAR {
            return Ok(None);
        }
        let end = if error > LOST && self.correction.is_none() {
            match self.way_from_rest(watch)? {
                None => self.end_beside(own, watch)?,
                end => end,
            }
        } else {
            match self.end_beside(own, watch)? {
                None => self.way_from_rest(watch)?,
                end => end,
            }
        };
        Ok(end.map(|end| self.way_to(&end)))
    }

    /// The equilibrium that two steps lead to, or else the one that the pose's `own` estimate did.
    fn end_beside(&self, own: Option<(Certificate, Vec<Vec3>)>, watch: &mut Watch) -> Result<Option<Vec<Vec3>>> {
        let begun = unless_none(self.steps_toward(FIRST, watch))?;
        let from_there = |begun: Correcting| unless_none(self.estimate(Some(&begun.way), watch));
        let led = begun.map(from_there).transpose()?.flatten();
        let balanced = [led, own].into_iter().flatten().find(|(certificate, _)| certificate.remaining <= BALANCED);
        Ok(balanced.map(|(_, end)| end))
    }

    /// Where the full shell comes to from rest under the loads, of a shell that is small enough for it and is held.
    fn way_from_rest(&self, watch: &mut Watch) -> Result<Option<Vec<Vec3>>> {
        if self.model.shell.mass.len() > MOST_FULL || !self.stays_put() {
            return Ok(None);
        }
        unless_none(self.path_from_rest(watch))
    }

    /// As if steps had led to a pose (n_vertices, frame axes), with the stresses that it has.
    fn way_to(&self, end: &[Vec3]) -> Correcting {
        let shell = &self.model.shell;
        let own = shell.with_rest_angles(&self.motion.rest_angles());
        let mut stress = vec![];
        own.as_ref().unwrap_or(shell).energy.visit_strains(end, &mut |_, strain| stress.push(strain));
        Correcting { way: end.iter().zip(self.in_frame()).map(|(end, x)| end - x).collect(), stress }
    }

    /// Not while its rest shape moves, nor where it has the same bits on every processor, which steps of the full shell have not.
    fn may_be_helped(&self) -> Result<bool> {
        let by_fields = matches!(self.method(), Method::ReducedShell | Method::PolynomialShell | Method::AdaptiveShell);
        let may = self.moving_rest.is_none() && self.model.arithmetic == Arithmetic::Fastest;
        Ok(by_fields && may && self.is_standing() && unless_none(self.is_at_rest())?.unwrap_or(false))
    }

    /// Whether the method's own forces balance the loads, and nothing moves. Else the inertia that it has would stand in for what is not balanced.
    fn is_at_rest(&self) -> Result<bool> {
        let judging = self.judging_points(&mut self.contacts.clone(), None);
        self.with_full_shell(judging.as_ref(), |_, _, load| Ok(load.still))
    }

    /// Whether [`State::correct`] led anywhere since the last step.
    pub fn is_corrected(&self) -> bool {
        self.correction.as_ref().is_some_and(|kept| kept.is_current)
    }

    /// Positions (n_vertices) where [`State::correct`] led since the last step, or else where so many Newton steps of the full shell lead. None leave
    /// them where the method has them.
    pub fn positions_corrected(&self, space: Space, steps: usize) -> Result<Vec<Vec3>> {
        let mut x = try_zeroed("the positions", self.model.shell.mass.len())?;
        if steps == 0 || self.motion.is_full_shell() {
            self.positions(space, |v, place| x[v] = place);
            return Ok(x);
        }
        let kept = self.correction.as_ref().filter(|correction| correction.is_current);
        let made = if kept.is_none() { Some(self.steps_toward(steps, &mut |_| Ok(()))?) } else { None };
        let way = kept.map(|kept| &kept.steps).or(made.as_ref()).map_or(&[][..], |steps| &steps.way);
        self.positions(Space::Frame, |v, place| x[v] = place + way[v]);
        if !x.iter().flatten().all(|x| x.is_finite()) {
            return Err(out_of_range());
        }
        if space == Space::World {
            let Pose { origin, rotation } = self.frame.pose;
            x.iter_mut().for_each(|x| *x = origin + rotation * *x);
        }
        Ok(x)
    }

    /// The state is no longer where the steps were made.
    pub(super) fn leave_correction(&mut self) {
        if let Some(correction) = &mut self.correction {
            correction.is_current = false;
        }
    }

    fn steps_toward(&self, steps: usize, watch: &mut Watch) -> Result<Correcting> {
        Feature::NonlinearShell.require()?;
        self.refuse_moving_rest("a correction")?;
        let judging = self.judging_points(&mut self.contacts.clone(), None);
        let earlier = self.correction.as_ref().map(|correction| &correction.steps);
        let found = self.with_full_shell(judging.as_ref(), |solver, u, load| {
            solver.join(judging.clone());
            let found = solver.step_toward(u, load, (steps, watch), earlier);
            solver.join(None); // others use it next
            found
        })?;
        match found.way.iter().flatten().chain(&found.stress).all(|x| x.is_finite()) {
            true => Ok(found),
            false => Err(out_of_range()),
        }
    }

    /// Numbers of a saved correction.
    pub(super) fn correction_doubles(&self) -> usize {
        1 + 3 * self.model.shell.mass.len() + self.model.shell.energy.n_elements()
    }

    /// Fails where numbers are of no correction.
    pub(super) fn check_saved_correction(&self, numbers: &[f64]) -> Result<()> {
        match numbers.len() == self.correction_doubles() && (numbers[0] == 0.0 || numbers[0] == 1.0) {
            true => Ok(()),
            false => invalid("the saved state holds a correction out of range"),
        }
    }

    /// Takes over what [`KeptCorrection::save`] gave, or nothing.
    pub(super) fn restore_correction(&mut self, numbers: &[f64]) {
        let [is_current, rest @ ..] = numbers else {
            self.correction = None;
            return;
        };
        let (way, stress) = rest.split_at(3 * self.model.shell.mass.len());
        let way = way.chunks_exact(3).map(Vec3::from_column_slice).collect();
        let steps = Correcting { way, stress: stress.to_vec() };
        self.correction = Some(Box::new(KeptCorrection { steps, is_current: *is_current == 1.0 }));
    }
}

fn out_of_range() -> Error {
    Error::new(ErrorKind::Numerical, "the corrected positions leave the range of numbers")
}

//! Another method for a state that moves.

use super::{Method, State};
use crate::error::try_zeroed;
use crate::methods;
use crate::step::Integrator;
use crate::{Result, Vec3};

/// How a method moves that was chosen: the full shell by steps of second order, as the fields that it stands in for.
pub(super) fn chosen_steps(method: Method, asked: Integrator) -> Integrator {
    if method == Method::ImplicitShell { Integrator::SecondOrder } else { asked }
}

impl State {
    /// Goes on by another method from the pose and the velocities nearest to the present ones in the mass norm, with the same time,
    /// frame, loads, damping and constraints. Fails, changing nothing, where the method cannot take these, or the model lacks what it
    /// needs. Allocates.
    pub fn set_method(&mut self, method: Method) -> Result<()> {
        self.model.require_arithmetic(method)?;
        if method == self.method() { Ok(()) } else { self.change_method(method) }
    }

    /// The same by the method of the model's choice.
    pub fn set_chosen_method(&mut self) -> Result<()> {
        let method = self.model.chosen_method();
        if method == self.method() { Ok(()) } else { self.change_to((method, chosen_steps(method, self.integrator))) }
    }

    /// The same, whatever the state's arithmetic is.
    pub(super) fn change_method(&mut self, method: Method) -> Result<()> {
        self.change_to((method, self.integrator))
    }

    fn change_to(&mut self, (method, integrator): (Method, Integrator)) -> Result<()> {
        let mut next = methods::build(&self.model, method, integrator)?;
        if self.moving_rest.is_some() {
            self.check_method_can_move_rest(&*next)?;
        }
        self.constraints().try_for_each(|(constraint, _)| next.check_constraint(constraint))?;
        let n = self.model.shell.mass.len();
        let (mut u, mut rate): (Vec<Vec3>, Vec<Vec3>) = (try_zeroed("the pose", n)?, try_zeroed("the rates", n)?);
        self.motion.visit_visible_motion(&mut |v, x, x_dot| (u[v], rate[v]) = (x, x_dot));
        self.check_supports_of(&*next)?;
        let held = self.supports.as_ref().map(|supports| &supports.now[..]);
        held.iter().for_each(|held| next.place_supports(held));
        next.set_rest_angles(&self.motion.rest_angles());
        next.project_from(&u, &rate)?;
        if !self.motion.is_full_shell() {
            next.come_from_fields();
        }
        held.iter().for_each(|held| next.place_supports(held));
        let set = self.motion.constraints().clone();
        next.change(|own| *own = set);
        let before = std::mem::replace(&mut self.motion, next);
        let changed = self.apply_damping(&self.damping.clone()).and_then(|()| self.make_room());
        match changed {
            Ok(()) => {
                self.correction = None;
                self.carry_motion();
                self.make_room_for_contacts();
            }
            Err(_) => self.motion = before,
        }
        self.rest.wake();
        changed
    }
}

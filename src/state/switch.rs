//! Another method for a state that moves.

use super::{Dynamics, Method, State};
use crate::error::try_zeroed;
use crate::{Result, Vec3};

impl State {
    /// Goes on by another method from the pose and the velocities nearest to the present ones in the mass norm, with the same time,
    /// frame, loads, damping and constraints. Fails, changing nothing, where the method cannot take these, or the model lacks what it
    /// needs. Allocates.
    pub fn set_method(&mut self, method: Method) -> Result<()> {
        if method == self.method() {
            return Ok(());
        }
        let mut next = Dynamics::new(&self.model, method, self.integrator)?;
        self.constraints().try_for_each(|(constraint, _)| next.check_constraint(&self.model, constraint))?;
        let n = self.model.shell.mass.len();
        let (mut u, mut rate): (Vec<Vec3>, Vec<Vec3>) = (try_zeroed("the pose", n)?, try_zeroed("the rates", n)?);
        let place = |v: usize, x: Vec3, x_dot: Vec3| (u[v], rate[v]) = (x, x_dot);
        match &self.dynamics {
            Dynamics::Modal(modal) => modal.visit_visible_motion(&self.model.modal, place),
            others => others.visit_motion(&self.model, place),
        }
        next.follow(&self.model, &u, &rate)?;
        let set = self.dynamics.constraints().clone();
        next.change_constraints(|own| *own = set);
        next.set_constraint_work(self.dynamics.constraint_work());
        let before = std::mem::replace(&mut self.dynamics, next);
        let damped = self.apply_damping(&self.damping.clone());
        if damped.is_err() {
            self.dynamics = before;
        }
        self.rest.wake();
        damped
    }
}

//! The static solution of the full shell.
//!
//! A pose that modes or fields had stretches a thin shell a little everywhere. The force of that is most of what there is, so the way from the
//! load that such a pose balances to the one that acts leads far from it. So the equilibrium that is nearest comes first, as a certificate seeks it.

use super::Nodal;
use crate::methods::{Acting, Watch};
use crate::reference::{CORRECTED, Equilibrium, EquilibriumProgress, Load, SOLVES};
use crate::{Error, ErrorKind, Result, Vec3};

impl Nodal {
    /// As [`crate::methods::Motion::settle`].
    pub(super) fn find_rest(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        self.follow(acting.axes.each)?;
        self.move_supports(acting, None);
        self.set_force(acting)?;
        self.turn_out();
        let found = self.find_equilibrium(acting, watch);
        let found = found.inspect_err(|_| self.turn_in())?;
        self.record_outcomes(found.iterations);
        if !self.constraints.is_finite() || !self.is_within_range(&found.displacement, &[]) {
            self.turn_in();
            return Err(Error::new(ErrorKind::Numerical, "the equilibrium is beyond all range"));
        }
        self.constraints.accept(0.0);
        self.u = found.displacement;
        (self.stepped, self.foreign) = (0.0, false);
        self.velocity.fill(Vec3::zeros());
        self.turn_in();
        self.yield_creases();
        Ok((found.residual, found.iterations))
    }

    /// In the solver's axes. From a foreign pose to the equilibrium beside it, else by the way from rest, else by that from the pose.
    fn find_equilibrium(&mut self, acting: &Acting, watch: &mut Watch) -> Result<Equilibrium> {
        self.solver.join(self.seen_points(acting.points));
        if !self.foreign {
            return self.path_from(acting, self.u.clone(), watch);
        }
        let (near, before) = self.nearest_equilibrium(acting, watch)?.unzip();
        let mut unbent = self.u.clone();
        self.shell.free.iter().for_each(|v| unbent[*v as usize] = Vec3::zeros());
        let more = before.unwrap_or(0);
        for start in near.into_iter().chain([unbent]) {
            match self.path_from(acting, start, watch) {
                Ok(found) => return Ok(Equilibrium { iterations: more + found.iterations, ..found }),
                Err(error) if error.kind != ErrorKind::Numerical => return Err(error),
                Err(_) => (),
            }
        }
        self.path_from(acting, self.u.clone(), watch)
    }

    /// Where the load and the constraints lead from the displacements `start`.
    fn path_from(&mut self, acting: &Acting, start: Vec<Vec3>, watch: &mut Watch) -> Result<Equilibrium> {
        let own = std::mem::replace(&mut self.u, start);
        let mut heard = |progress: EquilibriumProgress| watch(progress.residual);
        let found = self
            .pass_constraints(acting.axes.frame, 1.0)
            .and_then(|()| self.solver.equilibrium(&self.u, &self.force, &Default::default(), &mut heard));
        self.u = own;
        found
    }

    /// Displacements where Newton's steps lead from a foreign pose, and their number; none where they do not get to an equilibrium.
    fn nearest_equilibrium(&mut self, acting: &Acting, watch: &mut Watch) -> Result<Option<(Vec<Vec3>, usize)>> {
        self.pass_constraints(acting.axes.frame, 1.0)?;
        let held = self.held_by();
        let at = |_: &[Vec3]| self.force.clone();
        let load = Load { at: &at, follows: false, held, moving: 0.0, still: true, foreign: true };
        let mut iterations = 0;
        let found = self.solver.correct(&self.u, &load, SOLVES, &mut |residual| {
            iterations += 1;
            watch(residual)
        });
        let found = match found {
            Ok(found) if found.force[1] <= CORRECTED && found.short == 0.0 => found,
            Err(error) if error.kind != ErrorKind::Numerical => return Err(error),
            _ => return Ok(None),
        };
        let end: Vec<Vec3> = self.u.iter().zip(&found.way).map(|(u, way)| u + way).collect();
        Ok(self.is_within_range(&end, &[]).then_some((end, iterations)))
    }

    /// About the force of constraints: as the last step had it, or, of those that were not met yet, no more than what the pose bears. The same where
    /// nothing acts.
    fn held_by(&mut self) -> f64 {
        let known = self.constraints.report().map(|(_, outcome)| outcome.force.norm_squared()).sum::<f64>().sqrt();
        let untold = if self.constraints.is_empty() { self.shell.free_norm(&self.force) == 0.0 } else { known == 0.0 };
        if untold { self.solver.elastic_force(&self.u) } else { known }
    }
}

//! The shapes in which a shell is at rest: without load, and under its own weight.

use super::free_motion::FreeMotions;
use super::potential::Potential;
use super::{EquilibriumOptions, EquilibriumProgress, Solver};
use crate::features::{Feature, NonlinearShell, Proof};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use std::sync::Arc;

/// The same shell with its mesh where it is at rest by its own rest shape and the angles of its creases; the shell itself if it is there. What
/// moves freely stays nearest to where it was. `watch` hears of the share of the work and may stop it with an error.
pub fn settled(shell: &Arc<Shell>, watch: &mut dyn FnMut(f64) -> Result<()>) -> Result<Arc<Shell>> {
    if !shell.must_settle() {
        return Ok(shell.clone());
    }
    let _proof: NonlinearShell = Proof::of(Feature::NonlinearShell)?;
    let none = vec![Vec3::zeros(); shell.mass.len()];
    let mut solver = Solver::new(shell.clone())?;
    let found = solver.stable_equilibrium(&none, &mut |p| watch(p.load)).map_err(|error| match error.kind {
        ErrorKind::Numerical => {
            let message = format!("where the shell rests by its rest shape, growth or angles: {}", error.message);
            Error::new(error.kind, message)
        }
        _ => error,
    })?;
    let mut positions: Vec<Vec3> = shell.mesh.positions.iter().zip(&found).map(|(x, u)| x + u).collect();
    FreeMotions::new(shell, std::iter::empty(), &positions).align(shell, &mut positions, &shell.mesh.positions);
    if let Some(v) = shell.stray(&positions) {
        let message =
            format!("vertex {v} comes to rest at {:?}, beyond all measure of the shell", positions[v].data.0[0]);
        return Err(Error::new(ErrorKind::Numerical, message));
    }
    Ok(Arc::new(shell.settled(positions)))
}

/// How often a shell without load is sent on from where it is in balance, but would leave that.
const SADDLES: usize = 64;

/// Of the energy that it began with, what it must lose by that: less is rounding.
const LOSS: f64 = 1e-9;

impl Solver {
    /// Displacements of a balance without load that it does not leave: a flat disk whose rim grew is in balance, and ruffles. Of one with more energy than
    /// it began with, which no way downhill leads to, the search goes downhill in every step.
    fn stable_equilibrium(
        &mut self,
        none: &[Vec3],
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<Vec<Vec3>> {
        let first = self.shell.energy.value(&self.shell.mesh.positions);
        let mut found = self.equilibrium(none, none, &Default::default(), watch)?.displacement;
        if self.shell.energy.value(&self.x) > (1.0 + LOSS) * first {
            found = self.downhill(none, none, watch)?;
        }
        for _ in 0..SADDLES {
            let balance = self.x.clone();
            let Self { shell, newton, x, constraints, .. } = &mut *self;
            let potential = Potential { shell, origin: &balance, load: none, step: None, constraints, points: None };
            if !newton.leave_saddle(&potential, x, &balance)? {
                break;
            }
            if shell.energy.value(x) > shell.energy.value(&balance) - LOSS * first {
                break;
            }
            let start: Vec<Vec3> = x.iter().zip(&shell.mesh.positions).map(|(x, rest)| x - rest).collect();
            found = self.downhill(&start, none, watch)?;
        }
        Ok(found)
    }

    /// The balance without load that steps lead to which all lower the energy.
    fn downhill(
        &mut self,
        start: &[Vec3],
        none: &[Vec3],
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<Vec<Vec3>> {
        self.set_mixed(false);
        let options = EquilibriumOptions { first_increment: 1.0, ..Default::default() };
        Ok(self.equilibrium(start, none, &options, watch)?.displacement)
    }
}

/// The same shell with its mesh where it hangs at rest under `gravity` (frame axes), found by the nonlinear shell. Its energy
/// is as before, so its stiffness there is that of the sagged shape under its own weight. Fails when nothing holds the shell.
/// `watch` hears of the share of the load and may stop the work with an error.
pub fn sagged(shell: &Arc<Shell>, gravity: Vec3, watch: &mut dyn FnMut(f64) -> Result<()>) -> Result<Shell> {
    let _proof: NonlinearShell = Proof::of(Feature::NonlinearShell)?;
    let weight: Vec<Vec3> = shell.mass.iter().map(|m| *m * gravity).collect();
    let start = vec![Vec3::zeros(); shell.mass.len()];
    let mut solver = Solver::new(shell.clone())?;
    let found = solver.equilibrium(&start, &weight, &Default::default(), &mut |p| watch(p.load))?;
    let positions: Vec<Vec3> = shell.mesh.positions.iter().zip(&found.displacement).map(|(x, u)| x + u).collect();
    if let Some(v) = shell.stray(&positions) {
        let message = format!("vertex {v} hangs at {:?}, beyond all measure of the shell", positions[v].data.0[0]);
        return Err(Error::new(ErrorKind::Numerical, message));
    }
    Ok(shell.hung(gravity, positions))
}

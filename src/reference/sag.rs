//! The shapes in which a shell is at rest: without load, and under its own weight.

use super::Solver;
use super::free_motion::FreeMotions;
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
    let found = solver.equilibrium(&none, &none, &Default::default(), &mut |p| watch(p.load));
    let found = found.map_err(|error| match error.kind {
        ErrorKind::Numerical => {
            let message = format!("where the shell rests by its rest shape or angles: {}", error.message);
            Error::new(error.kind, message)
        }
        _ => error,
    })?;
    let mut positions: Vec<Vec3> = shell.mesh.positions.iter().zip(&found.displacement).map(|(x, u)| x + u).collect();
    FreeMotions::new(shell, std::iter::empty(), &positions).align(shell, &mut positions, &shell.mesh.positions);
    if let Some(v) = shell.stray(&positions) {
        let message =
            format!("vertex {v} comes to rest at {:?}, beyond all measure of the shell", positions[v].data.0[0]);
        return Err(Error::new(ErrorKind::Numerical, message));
    }
    Ok(Arc::new(shell.settled(positions)))
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

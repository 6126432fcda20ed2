//! The shape in which a shell hangs at rest under its own weight.

use super::Solver;
use crate::features::{Feature, NonlinearShell, Proof};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use std::sync::Arc;

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

//! How far a pose is from an equilibrium of the full shell: the way that a few Newton steps take from it.
//!
//! One step is not enough. Poses of few fields stretch a thin shell a little everywhere, and what they leave of the forces is
//! nearly all of this stretch: the first step takes it out, and only the next ones see how the shell then bends. So steps go on until
//! the load is all but balanced, which takes three to a dozen of them, and up to some 50 where the shell bends far without stretching.

use super::newton::Stop;
use super::potential::Potential;
use super::{Solver, free_norm};
use crate::{Result, Vec3};
use std::sync::{Mutex, PoisonError};

/// Of the load; what is left then moves the shell by far less than what it has come.
pub const CORRECTED: f64 = 1e-6;

/// The way to an equilibrium.
#[derive(Clone, Debug)]
pub struct Correction {
    /// To where the steps led (n_vertices).
    pub way: Vec<Vec3>,
    /// ‖F − ∇E‖ over the free vertices, along what handles leave free, at the start and at the end.
    pub force: [f64; 2],
}

impl Solver {
    /// At most `solves` Newton steps from the displacements `start` toward the equilibrium under the dead `forces` (both n_vertices)
    /// and the handles of [`Solver::set_handles`], which are to be where they hold their vertices and do so with a force of about `held`.
    pub fn correct(&mut self, start: &[Vec3], forces: &[Vec3], held: f64, solves: usize) -> Result<Correction> {
        self.check_fields(&[("start", start), ("forces", forces)])?;
        self.place(start);
        self.origin.copy_from_slice(&self.x);
        let Self { shell, newton, origin, x, force, handles, .. } = self;
        let potential = Potential { shell, origin, load: forces, step: None, handles };
        potential.gradient(x, force);
        let before = free_norm(shell, force);
        let scale = free_norm(shell, forces).hypot(held).max(f64::MIN_POSITIVE);
        let end = newton.minimize(
            &potential,
            x,
            Stop { tolerance: CORRECTED, scale, max_iterations: solves },
            &mut |_| Ok(()),
        )?;
        let ahead = if end.converged { None } else { newton.return_to_mark(x) };
        let after = ahead.unwrap_or(end.residual * scale);
        let way = x.iter().zip(&*origin).map(|(x, origin)| x - origin).collect();
        Ok(Correction { way, force: [before, after] })
    }
}

/// Solvers of one shell that are kept from call to call, with their symbolic factorizations: as many as were in use at once.
#[derive(Default)]
pub struct SolverPool(Mutex<Vec<Solver>>);

impl SolverPool {
    /// Runs `body` with a solver that no other thread has; `make` makes one where all are taken.
    pub fn with<T>(
        &self,
        make: impl FnOnce() -> Result<Solver>,
        body: impl FnOnce(&mut Solver) -> Result<T>,
    ) -> Result<T> {
        let kept = self.list().pop();
        let mut solver = kept.map_or_else(make, Ok)?;
        let result = body(&mut solver);
        self.list().push(solver);
        result
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.list().iter().map(Solver::bytes).sum()
    }

    fn list(&self) -> std::sync::MutexGuard<'_, Vec<Solver>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner) // a list of whole solvers, whoever panicked
    }
}

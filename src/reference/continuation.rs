//! Minimizing a potential under its constraints.
//!
//! A vertex that jumps to its place alone would leave its neighbours torn behind. So springs pull it there first, and the shell
//! follows; then the place is prescribed. Orientations take a few rounds of the method of multipliers.

use super::constraints::Constraints;
use super::newton::{Convergence, Newton, Stop};
use super::potential::Potential;
use super::{Solver, free_norm};
use crate::constraint::{Constraint, Outcome};
use crate::{ErrorKind, Result, Vec3};
use nalgebra::Matrix3;

/// Of the force at its start, what pulling may leave; it only finds a start.
const PULLED: f64 = 1e-3;
const PULL_ITERATIONS: usize = 50;

/// An orientation is met below this, rad.
const MET: f64 = 1e-9;
const ROUNDS: usize = 20;

/// A round that leaves more than this part of what an orientation lacks is at the least it can have.
const FALLING: f64 = 0.5;

/// A constraint goes no further in a step, in model sizes.
const FURTHEST: f64 = 100.0;

/// Newton iterations for one try at a share of the constraints' way, and of all tries of a step; the smallest increment.
const TRY_ITERATIONS: usize = 60;
const ALL_ITERATIONS: usize = 300;
const SMALLEST_INCREMENT: f64 = 1e-2;

impl Solver {
    /// Constraints for the calls that follow, along the columns of `axes`, on the shell at displacements `u` (n_vertices). Targets are in
    /// the axes of the rest positions.
    pub fn set_constraints(&mut self, axes: Matrix3<f64>, list: Vec<Constraint>, u: &[Vec3]) -> Result<()> {
        self.place(u);
        (self.outcomes, self.constraint_work) = (vec![], 0.0);
        self.constraints = Constraints::new(&self.shell, axes, list, &self.x);
        let cliques = self.constraints.cliques();
        if !cliques.iter().eq(&self.coupled) {
            self.newton = self.newton.renewed(Newton::new(&self.shell, &cliques)?);
            self.coupled = cliques.into_iter().map(<[u32]>::to_vec).collect();
        }
        Ok(())
    }

    /// What became of the constraints in the last call, in their order and axes, and the work that they did on the shell over it.
    pub fn outcomes(&self) -> (&[Outcome], f64) {
        (&self.outcomes, self.constraint_work)
    }

    /// Records the outcomes of a call that led from `origin` to `x`. `gradient` is the whole of its potential's.
    pub(super) fn record_outcomes(&mut self, gradient: &[Vec3]) {
        self.outcomes = self.constraints.outcomes(&self.x, gradient, &mut self.force);
        let work = |v: &u32| self.force[*v as usize].dot(&(self.x[*v as usize] - self.origin[*v as usize]));
        self.constraint_work = if self.outcomes.is_empty() { 0.0 } else { self.shell.free.iter().map(work).sum() };
    }
}

/// Moves `x` to a minimum of `potential` with these constraints. `stop.scale` is the force without theirs, or 0.
pub(super) fn minimize(
    newton: &mut Newton,
    constraints: &mut Constraints,
    potential: &Potential,
    x: &mut [Vec3],
    mut stop: Stop,
    watch: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<Convergence> {
    let mut iterations = 0;
    if !constraints.is_empty() {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        iterations = pull(newton, constraints, potential, (x, &mut gradient), (stop, &mut *watch))?;
        constraints.place_holds(x);
        Potential { constraints, ..*potential }.whole_gradient(x, &mut gradient);
        stop.scale += free_norm(potential.shell, &gradient);
    }
    if stop.scale == 0.0 {
        stop.scale = 1.0;
    }
    let mut last = f64::INFINITY;
    let mut rounds = 0;
    loop {
        let end = newton.minimize(&Potential { constraints, ..*potential }, x, stop, watch)?;
        iterations += end.iterations;
        rounds += 1;
        let lacking = constraints.update_torques(x);
        if !end.converged || lacking <= MET || lacking > FALLING * last || rounds == ROUNDS {
            return Ok(Convergence { iterations, ..end });
        }
        last = lacking;
    }
}

/// Moves `x`, where a step may end, to where it ends, and the constraints as far on their way as Newton's method gets.
pub(super) fn step(
    newton: &mut Newton,
    constraints: &mut Constraints,
    potential: &Potential,
    x: &mut [Vec3],
    (stop, watch): (Stop, &mut dyn FnMut(f64) -> Result<()>),
) -> Result<Convergence> {
    if constraints.is_empty() {
        return minimize(newton, constraints, potential, x, stop, watch);
    }
    let whole = constraints.share_within(FURTHEST * potential.shell.mesh.size);
    let (mut done, mut increment, mut iterations) = (0.0, whole, 0);
    let (mut from, mut best) = (x.to_vec(), None);
    let brief = Stop { max_iterations: stop.max_iterations.min(TRY_ITERATIONS), ..stop };
    while increment >= SMALLEST_INCREMENT * whole && iterations < ALL_ITERATIONS {
        constraints.set_share(whole.min(done + increment));
        match minimize(newton, constraints, potential, x, brief, watch) {
            Ok(end) if end.converged => {
                iterations += end.iterations;
                (done, increment) = (whole.min(done + increment), 2.0 * increment);
                if done == whole {
                    return Ok(Convergence { iterations, ..end });
                }
                from.copy_from_slice(x);
                best = Some((end, constraints.torques()));
            }
            Err(error) if error.kind != ErrorKind::Numerical => return Err(error),
            _ => {
                iterations += TRY_ITERATIONS;
                increment *= 0.25;
                x.copy_from_slice(&from);
            }
        }
    }
    constraints.set_share(done);
    let end = match best {
        Some((end, torques)) => {
            constraints.set_torques(torques);
            end
        }
        None => minimize(newton, constraints, potential, x, stop, watch)?,
    };
    Ok(Convergence { iterations: iterations + end.iterations, ..end })
}

/// Pulls the shell to near where hard positions are prescribed.
fn pull(
    newton: &mut Newton,
    constraints: &mut Constraints,
    potential: &Potential,
    (x, gradient): (&mut [Vec3], &mut [Vec3]),
    (stop, watch): (Stop, &mut dyn FnMut(f64) -> Result<()>),
) -> Result<usize> {
    if !constraints.is_away(x) {
        return Ok(0);
    }
    constraints.set_pulling(true);
    let pulled = Potential { constraints, ..*potential };
    pulled.gradient(x, gradient);
    let scale = free_norm(potential.shell, gradient);
    if scale == 0.0 {
        constraints.set_pulling(false);
        return Ok(0);
    }
    let stop = Stop { tolerance: PULLED, scale, max_iterations: PULL_ITERATIONS.min(stop.max_iterations) };
    let end = newton.minimize(&pulled, x, stop, watch);
    constraints.set_pulling(false);
    Ok(end?.iterations)
}

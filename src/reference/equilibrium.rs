//! Static equilibrium under dead forces: ∇E(x̄ + u) = F over the free vertices.
//!
//! The load moves from the one the start balances, ∇E at the start (zero at rest), to F. All of it is tried at once first, for as long
//! as the shell stays stable on the way. If it does not, the load goes in increments that shrink where Newton's method does not converge
//! and grow again. So the solution is the one that loading leads to, not just any. Where the shell snaps under a small increment, the
//! search goes on downhill from where it stands.

use super::constraints::Constraints;
use super::mixed::Unstable;
use super::newton::{Ahead, Convergence, Held, Stop};
use super::potential::Potential;
use super::{Solver, continuation, free_norm};
use crate::energy::Curvature;
use crate::error::{require_finite, require_non_negative};
use crate::point_energy::PointEnergy;
use crate::{Error, ErrorKind, Result, Shell, Vec3};

/// Newton iterations for one increment before it is halved.
const ITERATIONS_PER_INCREMENT: usize = 60;

/// On the way the load is only followed, to this part of F.
const LOOSE_TOLERANCE: f64 = 1e-3;

/// The smallest increment.
const SMALLEST_INCREMENT: f64 = 1e-4;

/// Up to this share of the load, an increment that takes too many iterations is not halved: the shell is on its way down.
const SNAPPING: f64 = 0.3;

/// The shortest increment before a snap. The shape within a thirtieth of the load before it is nearly the last one.
const SHORTEST_ALONG: f64 = 0.03;

/// How well and how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquilibriumOptions {
    /// Converged at ‖F − ∇E‖ ≤ tolerance · ‖F‖ over the free vertices, or as near as rounding of the coordinates allows.
    /// Where that is worse than 1e-3, what is left must move the shell by less than a thousandth of its displacement.
    pub tolerance: f64,
    /// The first increment of the load, a share in (0, 1].
    pub first_increment: f64,
    /// Newton iterations at most, of all increments; factorizations where snaps are not followed.
    pub max_iterations: usize,
    /// Whether to go on downhill where the shell snaps, or to fail there, with the last shape before that as what was reached.
    pub follow_snaps: bool,
}

impl Default for EquilibriumOptions {
    fn default() -> Self {
        Self { tolerance: 1e-8, first_increment: 0.25, max_iterations: 2000, follow_snaps: true }
    }
}

impl EquilibriumOptions {
    fn check(&self) -> Result<()> {
        require_non_negative("the tolerance", self.tolerance)?;
        let first = require_finite("the first increment", self.first_increment)?;
        if first > 0.0 && first <= 1.0 {
            return Ok(());
        }
        Err(Error::argument(format!("the first increment is {first:?}: it must be in (0, 1]")))
    }
}

/// Where a solve stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquilibriumProgress {
    /// Share of the load being solved for.
    pub load: f64,
    /// Newton iterations so far, of all increments; factorizations where snaps are not followed.
    pub iterations: usize,
    /// ‖F − ∇E‖/‖F‖ under that share.
    pub residual: f64,
}

/// A solution.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    /// u (n_vertices).
    pub displacement: Vec<Vec3>,
    /// ‖F − ∇E‖/‖F‖; relative to the start's ‖∇E‖ when there is no load.
    pub residual: f64,
    /// Newton iterations, of all increments; factorizations where snaps are not followed.
    pub iterations: usize,
    /// Load increments that converged.
    pub increments: usize,
}

impl Solver {
    /// The equilibrium that leads from the displacements `start` to the dead `forces` (both n_vertices). `watch` hears of
    /// each iteration and may stop the work with an error. Fails with [`ErrorKind::Numerical`] when it does not converge.
    pub fn equilibrium(
        &mut self,
        start: &[Vec3],
        forces: &[Vec3],
        options: &EquilibriumOptions,
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<Equilibrium> {
        self.check_fields(&[("start", start), ("forces", forces)])?;
        options.check()?;
        let ended = self.x.clone();
        self.place(start);
        let rounding = 4.0 * f64::EPSILON * self.shell.mesh.reach;
        if self.x.iter().zip(&ended).any(|(x, ended)| (x - ended).amax() > rounding) {
            self.newton.held = Held::Nothing; // it is of where the last search ended
        }
        let mut path = LoadPath::new(self, forces, options);
        path.advance_at_once(self, forces, options, watch)?;
        while path.done < 1.0 {
            let along = !options.follow_snaps && self.newton.is_mixed() && self.constraints.is_empty();
            let advanced = match along {
                true => path.advance_along(self, forces, options, watch),
                false => path.advance(self, forces, options, watch),
            };
            if let Err(error) = advanced {
                self.x.copy_from_slice(&path.balanced);
                return Err(error);
            }
        }
        if !self.constraints.is_empty() {
            let Self { shell, origin, x, constraints, points, .. } = &*self;
            let mut gradient = vec![Vec3::zeros(); x.len()];
            let points = Self::points(points);
            Potential { shell, origin, load: forces, step: None, constraints, points }.whole_gradient(x, &mut gradient);
            self.record_outcomes(&gradient);
        }
        let mut displacement = start.to_vec();
        self.shell.free.iter().for_each(|&v| displacement[v as usize] = self.displacement(v as usize));
        Ok(Equilibrium {
            displacement,
            residual: path.residual,
            iterations: path.iterations,
            increments: path.increments,
        })
    }

    /// Displacements (n_vertices) where the last [`Solver::equilibrium`] ended: when it failed, under the part of the load that was
    /// balanced.
    pub fn reached(&self) -> Vec<Vec3> {
        (0..self.x.len()).map(|v| self.displacement(v)).collect()
    }

    fn displacement(&self, v: usize) -> Vec3 {
        self.x[v] - self.shell.mesh.positions[v]
    }
}

/// Of what rounding of the coordinates pulls: what a load is taken for where it is less, of a shell that rests by its own angles or shape, and so
/// never quite without force.
const LEAST_LOAD: f64 = 1e4;

fn least_load(shell: &Shell) -> f64 {
    if !shell.must_settle() && shell.settled_from.is_none() && shell.energy.yielding().is_none() {
        return 0.0;
    }
    let mut diagonal = vec![0.0; shell.mass.len()];
    shell.energy.visit_hessian(&shell.mesh.positions, Curvature::Semidefinite, &mut |(vertices, blocks)| {
        let k = vertices.len();
        vertices.iter().enumerate().for_each(|(i, v)| diagonal[*v as usize] += blocks[i * k + i].norm());
    });
    let squares: f64 = shell.free.iter().map(|v| diagonal[*v as usize].powi(2)).sum();
    LEAST_LOAD * f64::EPSILON * shell.mesh.reach * squares.sqrt()
}

/// What the whole of a load adds to the first one.
fn change(first: &[Vec3], forces: &[Vec3]) -> Vec<Vec3> {
    first.iter().zip(forces).map(|(first, last)| last - first).collect()
}

/// The load's way from the start's to the whole.
struct LoadPath {
    /// The load that the start balances (n_vertices).
    first: Vec<Vec3>,
    /// ‖F‖, or the first load's without one, or 0.
    scale: f64,
    /// Share of the load that is in equilibrium, and the positions (n_vertices).
    done: f64,
    balanced: Vec<Vec3>,
    increment: f64,
    /// The share that the last increment failed at, if none went past it since.
    failed: f64,
    /// Where the load leads from there, once an increment of it was tried.
    ahead: Option<Ahead>,
    residual: f64,
    iterations: usize,
    increments: usize,
}

impl LoadPath {
    fn new(solver: &Solver, forces: &[Vec3], options: &EquilibriumOptions) -> Self {
        let shell = &solver.shell;
        let mut first = vec![Vec3::zeros(); forces.len()];
        shell.energy.add_gradient(&solver.x, &mut first);
        if let Some(points) = &solver.points {
            points.add_gradient(&solver.x, &mut first);
        }
        let loads = [free_norm(shell, forces), free_norm(shell, &first)];
        Self {
            scale: loads.into_iter().find(|load| *load > 0.0).unwrap_or(0.0).max(least_load(shell)),
            first,
            done: 0.0,
            balanced: solver.x.clone(),
            increment: options.first_increment.max(SMALLEST_INCREMENT),
            failed: f64::INFINITY,
            ahead: None,
            residual: 0.0,
            iterations: 0,
            increments: 0,
        }
    }

    /// Tries the whole load, if no constraint has a way to go.
    fn advance_at_once(
        &mut self,
        solver: &mut Solver,
        forces: &[Vec3],
        options: &EquilibriumOptions,
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<()> {
        if !solver.newton.is_mixed() || !solver.constraints.is_empty() || self.scale == 0.0 {
            return Ok(());
        }
        solver.origin.copy_from_slice(&solver.x);
        let Solver { shell, newton, origin, x, points, .. } = solver;
        let stop = Stop { tolerance: options.tolerance, scale: self.scale, max_iterations: options.max_iterations };
        let (constraints, points) = (&Constraints::none(), Solver::points(points));
        let potential = Potential { shell, origin, load: forces, step: None, constraints, points };
        let mut iterations = 0;
        let watch = &mut |residual| {
            let heard = watch(EquilibriumProgress { load: 1.0, iterations, residual });
            iterations += 1;
            heard
        };
        let found = match options.follow_snaps {
            true => newton.minimize_mixed(&potential, x, (stop, Unstable::Stop), watch)?,
            false => {
                let ahead = self.ahead.insert(Ahead::new(change(&self.first, forces), true));
                newton.go_ahead(&potential, x, (stop, ahead), watch)?
            }
        };
        self.iterations = iterations;
        if let Some(end) = found.filter(|end| end.harmless) {
            (self.done, self.residual, self.increments) = (1.0, end.residual, 1);
        }
        if self.done == 0.0 {
            x.copy_from_slice(&self.balanced);
        }
        Ok(())
    }

    /// Solves for one more increment by steps that stay stable and lead about where the first one foresees, or halves it: where the
    /// shell snaps, the last shape before that is found.
    fn advance_along(
        &mut self,
        solver: &mut Solver,
        forces: &[Vec3],
        options: &EquilibriumOptions,
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<()> {
        let load = (self.done + self.increment).min(self.failed);
        let load = if load > 0.99 { 1.0 } else { load };
        solver.origin.copy_from_slice(&solver.x);
        let shares = self.first.iter().zip(forces).map(|(first, last)| first.lerp(last, load));
        solver.force.iter_mut().zip(shares).for_each(|(f, share)| *f = share);
        let tolerance = if load < 1.0 { LOOSE_TOLERANCE.max(options.tolerance) } else { options.tolerance };
        let stop = Stop { tolerance, scale: self.scale, max_iterations: options.max_iterations };
        let Solver { shell, newton, origin, x, force, points, .. } = solver;
        let (constraints, points) = (&Constraints::none(), Solver::points(points));
        let potential = Potential { shell, origin, load: force, step: None, constraints, points };
        let (mut iterations, mut residual) = (self.iterations, 0.0);
        let ahead = self.ahead.get_or_insert_with(|| Ahead::new(change(&self.first, forces), false));
        ahead.share = load - self.done;
        let found = newton.go_ahead(&potential, x, (stop, ahead), &mut |left| {
            residual = left;
            let heard = watch(EquilibriumProgress { load, iterations, residual });
            iterations += 1;
            heard
        })?;
        let own = ahead.own;
        self.iterations = iterations;
        if let Some(end) = found.filter(|end| end.harmless || end.residual <= tolerance) {
            (self.done, self.residual) = (load, end.residual);
            self.increments += 1;
            self.increment *= 2.0;
            if load >= self.failed {
                self.failed = f64::INFINITY;
            }
            self.ahead = None;
            self.balanced.copy_from_slice(x);
            return Ok(());
        }
        x.copy_from_slice(&self.balanced);
        self.failed = load;
        self.increment = 0.5 * (load - self.done);
        if self.increment < SHORTEST_ALONG && !own {
            self.increment *= 2.0; // once more by the tangent here
        }
        if self.increment >= SHORTEST_ALONG && self.iterations < options.max_iterations {
            return Ok(());
        }
        Err(self.failure(load, residual))
    }

    /// Solves for one more increment, or halves it.
    fn advance(
        &mut self,
        solver: &mut Solver,
        forces: &[Vec3],
        options: &EquilibriumOptions,
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<()> {
        let load = if self.done + 1.01 * self.increment >= 1.0 { 1.0 } else { self.done + self.increment };
        let outcome = self.solve(solver, forces, load, options, watch)?;
        self.iterations += outcome.iterations;
        if outcome.converged && outcome.harmless {
            self.done = load;
            self.residual = outcome.residual;
            self.increments += 1;
            self.increment *= 2.0;
            self.balanced.copy_from_slice(&solver.x);
            return Ok(());
        }
        let falling = options.follow_snaps && !outcome.converged && outcome.iterations >= ITERATIONS_PER_INCREMENT;
        if falling && load - self.done <= SNAPPING && self.iterations < options.max_iterations {
            return Ok(());
        }
        solver.x.copy_from_slice(&self.balanced);
        self.increment = 0.5 * (load - self.done);
        if self.increment >= SMALLEST_INCREMENT && self.iterations < options.max_iterations {
            return Ok(());
        }
        Err(self.failure(load, outcome.residual))
    }

    fn failure(&self, load: f64, residual: f64) -> Error {
        let message = format!(
            "no equilibrium: after {} iterations {:.2} % of the load are balanced; at {:.2} % the residual is {residual:.2e} of the load",
            self.iterations,
            100.0 * self.done,
            100.0 * load,
        );
        Error::new(ErrorKind::Numerical, message)
    }

    /// From `solver.x` to the equilibrium under a share of the load.
    fn solve(
        &self,
        solver: &mut Solver,
        forces: &[Vec3],
        load: f64,
        options: &EquilibriumOptions,
        watch: &mut dyn FnMut(EquilibriumProgress) -> Result<()>,
    ) -> Result<Convergence> {
        solver.origin.copy_from_slice(&solver.x);
        let between = |(first, last): (&Vec3, &Vec3)| first.lerp(last, load);
        let shares = self.first.iter().zip(forces).map(between);
        solver.force.iter_mut().zip(shares).for_each(|(f, share)| *f = share);
        let tolerance = if load < 1.0 { LOOSE_TOLERANCE.max(options.tolerance) } else { options.tolerance };
        let left = options.max_iterations - self.iterations.min(options.max_iterations);
        let stop = Stop { tolerance, scale: self.scale, max_iterations: left.min(ITERATIONS_PER_INCREMENT) };
        let Solver { shell, newton, origin, x, force, constraints, points, .. } = solver;
        constraints.set_share(load);
        let points = Solver::points(points);
        let potential = Potential { shell, origin, load: force, step: None, constraints: &Constraints::none(), points };
        let mut iterations = self.iterations;
        continuation::minimize(newton, constraints, &potential, x, stop, &mut |residual| {
            let heard = watch(EquilibriumProgress { load, iterations, residual });
            iterations += 1;
            heard
        })
    }
}

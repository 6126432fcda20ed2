//! Implicit (backward) Euler: u⁺ = u + h u̇⁺, M (u̇⁺ − u̇)/h + C(x) u̇⁺ + ∇E(x̄ + u⁺) = F.
//!
//! Solved as the minimum of the incremental potential of [`super::potential`], from x or x + h u̇. Stable for
//! every h. Of first order: it damps what it does not resolve, a mode λ by λh/2 a second, and loses energy in every step but
//! one through a snap, where E is concave along the step by more than M/h².

use super::constraints::Constraints;
use super::newton::{Stop, UNBOUNDED};
use super::potential::{Potential, Step};
use super::{Rayleigh, Solver, check_step, continuation, free_norm};
use crate::{Error, ErrorKind, Result, Vec3};

/// Residual that ends Newton's iteration, relative to ‖F‖ + ‖Mu̇‖/h + ‖∇E‖ at the start of the step.
const TOLERANCE: f64 = 1e-9;

/// And that which may be left where no smaller Φ is found: what a force of this share gains is beyond the digits of Φ. A step's own error is 1e-4 and more.
const STALLED: f64 = 1e-7;

/// A step takes a handful of iterations; a violent one some dozens.
const MAX_ITERATIONS: usize = 500;

/// Linear solves of a step, at most, with all parts and rounds that contact takes it in. A handful is usual. Of the
/// contact cells of docs/evidence/stability.md, but for drops and beds, the longest step took 436.
pub const STEP_SOLVES: usize = 2000;

/// How a step was solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Linear solves.
    pub iterations: usize,
    /// Force left over, relative to ‖F‖ + ‖Mu̇‖/h + ‖∇E‖ at the start of the step.
    pub residual: f64,
}

impl Solver {
    /// Advances displacements and velocities by h > 0 under `forces` (all n_vertices). They are untouched when it fails:
    /// with [`ErrorKind::Numerical`] when Newton's iteration does not converge, or the step takes too many linear solves.
    pub fn implicit_euler(
        &mut self,
        u: &mut [Vec3],
        velocity: &mut [Vec3],
        forces: &[Vec3],
        damping: Rayleigh,
        h: f64,
    ) -> Result<StepReport> {
        if !self.sharing {
            self.newton.spare = STEP_SOLVES;
        }
        let report = self.step_implicitly((u, velocity), forces, damping, h);
        self.newton.coasting = false;
        self.again = false;
        self.keeps_scale = false;
        if !self.sharing {
            self.newton.spare = UNBOUNDED;
        }
        report
    }

    /// Whether the steps that follow are parts or rounds of one, which share its linear solves.
    pub fn share_work(&mut self, sharing: bool) {
        self.sharing = sharing;
        self.newton.spare = if sharing { STEP_SOLVES } else { UNBOUNDED };
    }

    /// The next step is the last one once more, with other forces on it: it is searched for from where that ended.
    pub fn step_again(&mut self) {
        self.again = self.ended.len() == self.x.len();
    }

    /// The next step starts from beyond where the last one ended, and ends near there: it is searched for from there, and its residual is relative
    /// to the last one's forces. Those where it starts are of a shape that is nowhere.
    pub fn second_stage(&mut self) {
        self.step_again();
        self.keeps_scale = self.again;
    }

    /// Whether steps share their work.
    pub fn is_sharing(&self) -> bool {
        self.sharing
    }

    fn step_implicitly(
        &mut self,
        (u, velocity): (&mut [Vec3], &mut [Vec3]),
        forces: &[Vec3],
        damping: Rayleigh,
        h: f64,
    ) -> Result<StepReport> {
        check_step(h, damping)?;
        self.check_fields(&[("u", u), ("velocity", velocity), ("forces", forces)])?;
        self.place(u);
        self.origin.copy_from_slice(&self.x);
        if !self.keeps_scale {
            self.scale = self.force_scale(velocity, forces, h);
        }
        let scale = self.scale;
        let Self { shell, newton, origin, x, constraints, points, damped, drag, again, ended, .. } = &mut *self;
        let step = Some(Step { h, velocity, damping, damped, drag });
        let points = Self::points(points);
        let potential = Potential { shell, origin, load: forces, step, constraints: &Constraints::none(), points };
        if *again {
            potential.free().for_each(|v| x[v] = ended[v]);
        } else {
            potential.free().for_each(|v| x[v] += h * velocity[v]);
            newton.coasting = newton.is_mixed() && constraints.is_empty();
        }
        if !newton.coasting {
            let (there, still) = (potential.value(x).0, potential.value(origin).0);
            if there.is_nan() || there > still {
                x.copy_from_slice(origin);
            }
        }
        let stop = Stop { tolerance: TOLERANCE, scale, max_iterations: MAX_ITERATIONS };
        let end = continuation::step(newton, constraints, &potential, x, (stop, &mut |_| Ok(())))?;
        let stalled = end.residual <= STALLED && constraints.is_empty();
        if !end.converged && !stalled {
            let (n, r) = (end.iterations, end.residual);
            let message =
                format!("the implicit step of {h:?} s did not converge: residual {r:.2e} after {n} iterations");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        if !self.constraints.is_empty() {
            let Self { shell, origin, x, constraints, points, damped, drag, .. } = &*self;
            let step = Some(Step { h, velocity, damping, damped, drag });
            let mut gradient = vec![Vec3::zeros(); x.len()];
            let points = Self::points(points);
            Potential { shell, origin, load: forces, step, constraints, points }.whole_gradient(x, &mut gradient);
            self.record_outcomes(&gradient);
        }
        self.ended.clone_from(&self.x);
        for v in self.shell.free.iter().map(|&v| v as usize) {
            let d = self.x[v] - self.origin[v];
            u[v] += d;
            velocity[v] = d / h;
        }
        Ok(StepReport { iterations: end.iterations, residual: end.residual })
    }

    /// ‖F‖ + ‖Mu̇‖/h + ‖∇E‖ over the free vertices.
    fn force_scale(&mut self, velocity: &[Vec3], forces: &[Vec3], h: f64) -> f64 {
        let shell = &self.shell;
        let momentum = |v: &u32| (shell.mass[*v as usize] * velocity[*v as usize]).norm_squared();
        let inertia = shell.free.iter().map(momentum).sum::<f64>().sqrt() / h;
        if !self.newton.parts.gradient(shell, &self.origin, &mut self.force) {
            self.force.fill(Vec3::zeros());
            shell.energy.add_gradient(&self.origin, &mut self.force);
        }
        free_norm(shell, forces) + inertia + free_norm(shell, &self.force)
    }
}

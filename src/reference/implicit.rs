//! Implicit (backward) Euler: u⁺ = u + h u̇⁺, M (u̇⁺ − u̇)/h + C(x) u̇⁺ + ∇E(x̄ + u⁺) = F.
//!
//! Solved as the minimum of the incremental potential of [`super::potential`], from the better of x and x + h u̇. Stable for
//! every h. Of first order: it damps what it does not resolve, a mode λ by λh/2 a second, and loses energy in every step but
//! one through a snap, where E is concave along the step by more than M/h².

use super::constraints::Constraints;
use super::newton::Stop;
use super::potential::{Potential, Step};
use super::{Rayleigh, Solver, check_step, continuation, free_norm};
use crate::{Error, ErrorKind, Result, Vec3};

/// Residual that ends Newton's iteration, relative to ‖F‖ + ‖Mu̇‖/h + ‖∇E‖ at the start of the step.
const TOLERANCE: f64 = 1e-9;

/// A step takes a handful of iterations; a violent one some dozens.
const MAX_ITERATIONS: usize = 500;

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
    /// with [`ErrorKind::Numerical`] when Newton's iteration does not converge.
    pub fn implicit_euler(
        &mut self,
        u: &mut [Vec3],
        velocity: &mut [Vec3],
        forces: &[Vec3],
        damping: Rayleigh,
        h: f64,
    ) -> Result<StepReport> {
        check_step(h, damping)?;
        self.check_fields(&[("u", u), ("velocity", velocity), ("forces", forces)])?;
        self.place(u);
        self.origin.copy_from_slice(&self.x);
        let scale = self.force_scale(velocity, forces, h);
        let Self { shell, newton, origin, x, constraints, points, damped, drag, .. } = &mut *self;
        let step = Some(Step { h, velocity, damping, damped, drag });
        let points = Self::points(points);
        let potential = Potential { shell, origin, load: forces, step, constraints: &Constraints::none(), points };
        potential.free().for_each(|v| x[v] += h * velocity[v]);
        let (coasting, still) = (potential.value(x).0, potential.value(origin).0);
        if coasting.is_nan() || coasting > still {
            x.copy_from_slice(origin);
        }
        let stop = Stop { tolerance: TOLERANCE, scale, max_iterations: MAX_ITERATIONS };
        let end = continuation::step(newton, constraints, &potential, x, (stop, &mut |_| Ok(())))?;
        if !end.converged {
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
        self.force.fill(Vec3::zeros());
        shell.energy.add_gradient(&self.origin, &mut self.force);
        free_norm(shell, forces) + inertia + free_norm(shell, &self.force)
    }
}

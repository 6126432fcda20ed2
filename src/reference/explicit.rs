//! Symplectic (semi-implicit) Euler: u̇⁺ = u̇ + h M⁻¹(F − ∇E(x̄ + u) − C(x) u̇), u⁺ = u + h u̇⁺. Explicit, no allocation.

use super::{Rayleigh, Solver, add_viscous_force, check_step};
use crate::modes::ScaledStiffness;
use crate::point_energy::PointEnergy;
use crate::{Error, ErrorKind, Result, Vec3};

impl Solver {
    /// Advances displacements and velocities by h > 0 under `forces` (all n_vertices). They are untouched when it fails:
    /// with [`ErrorKind::Numerical`] when a velocity is no longer finite.
    pub fn symplectic_euler(
        &mut self,
        u: &mut [Vec3],
        velocity: &mut [Vec3],
        forces: &[Vec3],
        damping: Rayleigh,
        h: f64,
    ) -> Result<()> {
        check_step(h, damping)?;
        self.check_fields(&[("u", u), ("velocity", velocity), ("forces", forces)])?;
        self.place(u);
        self.origin.copy_from_slice(&self.x);
        let Self { shell, x, force, points, damped, .. } = self;
        force.fill(Vec3::zeros());
        shell.energy.add_gradient(x, force);
        if let Some(points) = points {
            points.add_gradient(x, force);
        }
        if damping.stiffness > 0.0 {
            add_viscous_force(shell, x, |v| velocity[v], damping.stiffness, force);
        }
        let xi = |v: usize| damped.get(v).map_or(damping.mass, |factor| factor * damping.mass);
        for v in shell.free.iter().map(|&v| v as usize) {
            let acceleration = (forces[v] - force[v]) / shell.mass[v] - xi(v) * velocity[v];
            if !(velocity[v] + h * acceleration).iter().all(|c| c.is_finite()) {
                let message = format!("the explicit step of {h:?} s has blown up at vertex {v}: take shorter steps");
                return Err(Error::new(ErrorKind::Numerical, message));
            }
            force[v] = acceleration;
        }
        shell.project(force);
        for v in shell.free.iter().map(|&v| v as usize) {
            velocity[v] += h * force[v];
            u[v] += h * velocity[v];
        }
        if !self.constraints.is_empty() {
            self.lead_to_constraints(u, velocity, h);
        }
        Ok(())
    }

    /// Moves the ends of a step to where constraints have them.
    fn lead_to_constraints(&mut self, u: &mut [Vec3], velocity: &mut [Vec3], h: f64) {
        self.place(u);
        self.constraints.set_share(1.0);
        let Self { shell, constraints, x, force, origin, .. } = self;
        self.outcomes = constraints.lead(x, &shell.mass, h, force);
        self.constraint_work = 0.0;
        for v in shell.free.iter().map(|&v| v as usize) {
            let change = x[v] - (shell.mesh.positions[v] + u[v]);
            u[v] += change;
            velocity[v] += change / h;
            self.constraint_work += force[v].dot(&(x[v] - origin[v]));
        }
    }

    /// The step below which [`Self::symplectic_euler`] is stable near rest: h = 4/(c + √(c² + 4λ)), 2/√λ without damping, with
    /// c = ξ + ζλ and Gershgorin's bound λ = ‖M^−½ K M^−½‖₁ of the largest eigenvalue. A shell that is strongly compressed or
    /// folded is stiffer than at rest: keep some distance.
    pub fn stable_step(&self, damping: Rayleigh) -> Result<f64> {
        let lambda = ScaledStiffness::assemble(&self.shell)?.norm;
        let c = damping.mass + damping.stiffness * lambda;
        Ok(4.0 / (c + (c * c + 4.0 * lambda).sqrt()))
    }
}

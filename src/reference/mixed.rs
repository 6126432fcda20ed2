//! Newton's method with the stress as an unknown of the iteration, on a [`Potential`].
//!
//! With strains ε of unit stiffness, J = ∂ε/∂x and everything but the elastic energy in H₀,
//!
//!   (H₀ + JᵀJ + Σ σ ∂²ε/∂x²) Δ = −∇Φ(x),   σ ← ε(x) + J Δ,   x ← x + Δ
//!
//! after Magisano, Leonetti, Garcea, "How to improve efficiency and robustness of the Newton method in geometrically non-linear
//! structural problem discretized via displacement-based finite elements" (2017). A step that bends a thin shell stretches it, and
//! the stress of this stretch, which the next step takes out, is wrong by orders of magnitude. The stress that the step foresaw is
//! nearly right, and with it so is the tangent. So steps need no search along their lines.
//!
//! Where the tangent is not positive definite the shell is about to snap. There τM is added, more of it until it is, and less in each
//! step after that.

use super::free_norm;
use super::newton::{Convergence, Newton, Stop};
use super::potential::Potential;
use crate::{Result, Vec3};

/// No vertex goes further in a step, in model sizes.
const REACH: f64 = 0.1;

/// Factorizations at most: with a tangent that stays positive definite steps converge in three to ten, or hardly.
const FACTORIZATIONS: usize = 16;

/// The first τ lets the forces that are left move the shell by this part of its size.
const SHIFTED: f64 = 0.03;

/// τ grows by this factor where it does not do, falls by this one in each step, and ends at this part of the first.
const RISE: f64 = 5.0;
const FALL: f64 = 0.3;
const LEAST: f64 = 1e-3;

/// What to do where the tangent is not positive definite.
#[derive(Clone, Copy, PartialEq)]
pub enum Unstable {
    /// Give up.
    Stop,
    /// Go on with τM.
    Shift,
}

/// τ, and the first.
#[derive(Clone, Copy, Default)]
struct Shift {
    tau: f64,
    first: f64,
}

impl Newton {
    /// Moves `x` to a minimum of Φ that is no higher. `None` where the steps do not converge to one, with `x` where Φ was lowest, or as it was
    /// with [`Unstable::Stop`].
    pub(super) fn minimize_mixed(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        (stop, unstable): (Stop, Unstable),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Option<Convergence>> {
        let from = potential.value(x).0;
        self.lowest.copy_from_slice(x);
        let mut stress = std::mem::take(&mut self.stress);
        let found = self.mixed_steps(potential, x, (stop, unstable), (from, &mut stress), watch);
        self.stress = stress;
        if let Ok(Some(end)) = found {
            let (value, magnitude) = potential.value(x);
            if value <= from + self.noise.of_value(magnitude) {
                return Ok(Some(end));
            }
        }
        x.copy_from_slice(&self.lowest);
        found.map(|_| None)
    }

    fn mixed_steps(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        (stop, unstable): (Stop, Unstable),
        (mut lowest, stress): (f64, &mut Vec<f64>),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Option<Convergence>> {
        let shell = potential.shell;
        let most = self.factorizations + FACTORIZATIONS.min(stop.max_iterations);
        let (mut shift, mut stable, mut last) = (Shift::default(), false, f64::INFINITY);
        for iterations in 0.. {
            potential.gradient(x, &mut self.gradient);
            let force = free_norm(shell, &self.gradient);
            let residual = force / stop.scale;
            watch(residual)?;
            let stagnates = force > 0.5 * last && self.noise.explains(shell, &self.gradient);
            if residual <= stop.tolerance || stagnates {
                return Ok(stable.then_some(Convergence { converged: true, iterations, residual }));
            }
            if iterations == 0 {
                foresee(potential, x, x, stress);
            } else if unstable == Unstable::Shift {
                let value = potential.value(x).0;
                if value < lowest {
                    lowest = value;
                    self.lowest.copy_from_slice(x);
                }
            }
            last = force;
            if self.factorizations >= most || !self.mixed_direction(potential, x, stress, (&mut shift, unstable))? {
                break;
            }
            stable = shift.tau == 0.0;
            shift.tau = if shift.tau > LEAST * shift.first { FALL * shift.tau } else { 0.0 };
            let longest = (0..shell.free.len()).map(|i| self.along(i).norm()).fold(0.0, f64::max);
            self.try_step(potential, x, (REACH * shell.mesh.size / longest).min(1.0));
            foresee(potential, x, &self.trial, stress);
            x.copy_from_slice(&self.trial);
        }
        Ok(None)
    }

    /// Finds Δ, with τM as it is or as much more as makes the tangent positive definite; false where it does not come to be.
    fn mixed_direction(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        stress: &[f64],
        (shift, unstable): (&mut Shift, Unstable),
    ) -> Result<bool> {
        let shell = potential.shell;
        for _ in 0..FACTORIZATIONS {
            potential.assemble_mixed(x, stress, &mut self.matrix);
            self.noise.measure(potential, x, &self.matrix);
            for (i, v) in potential.free().enumerate() {
                self.matrix.add_diagonal(i, shift.tau * shell.mass[v]);
            }
            if self.matrix.require_finite().is_err() {
                return Ok(false);
            }
            if self.solve(potential)?.is_some() {
                return Ok(true);
            }
            if unstable == Unstable::Stop {
                return Ok(false);
            }
            if shift.tau > 0.0 {
                shift.tau *= RISE;
                continue;
            }
            let mut force = vec![Vec3::zeros(); x.len()];
            potential.mixed_gradient(x, stress, &mut force);
            let squared: f64 = potential.free().map(|v| force[v].norm_squared() / shell.mass[v]).sum();
            let tau = (squared / shell.total_mass).sqrt() / (SHIFTED * shell.mesh.size);
            *shift = Shift { tau, first: tau };
        }
        Ok(false)
    }
}

/// σ ← ε(x) + J (next − x).
fn foresee(potential: &Potential, x: &[Vec3], next: &[Vec3], stress: &mut Vec<f64>) {
    stress.clear();
    potential.shell.energy.visit_strains(x, &mut |(vertices, row), strain| {
        let change: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&(next[v as usize] - x[v as usize]))).sum();
        stress.push(strain + change);
    });
}

//! Newton's method with a line search on a [`Potential`].
//!
//! The direction is −H⁻¹∇Φ with the exact Hessian H. Where its Cholesky factorization fails, the semidefinite Hessian plus τM
//! takes its place: τ is such that no direction is longer than the shell is large, and vanishes with ∇Φ.

use super::free_norm;
use super::potential::Potential;
use crate::energy::Curvature;
use crate::sparse::{BlockMatrix, Factor, Symbolic};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::MatMut;

/// Sufficient decrease of Φ, as a share of the slope's promise (Armijo).
const DECREASE: f64 = 1e-4;

/// Halvings, at least, before a line search gives up: α falls to 1e-12.
const TRIALS: usize = 40;

/// Differences of Φ below this times its terms are rounding: the slope decides then.
const VALUE_NOISE: f64 = 1e-13;

/// A residual within this many of the expected rounding errors is as small as it gets.
const FORCE_NOISE: f64 = 10.0;

/// When to stop.
#[derive(Clone, Copy)]
pub struct Stop {
    /// Converged at ‖∇Φ‖ ≤ tolerance · scale.
    pub tolerance: f64,
    /// The force that residuals are relative to.
    pub scale: f64,
    /// Iterations at most.
    pub max_iterations: usize,
}

/// How it ended.
#[derive(Clone, Copy, Debug)]
pub struct Convergence {
    /// To the tolerance, or as far as rounding allows.
    pub converged: bool,
    /// Linear solves.
    pub iterations: usize,
    /// ‖∇Φ‖/scale.
    pub residual: f64,
}

/// The sparse solver and scratch.
pub struct Newton {
    matrix: BlockMatrix,
    symbolic: Symbolic,
    factor: Factor,
    /// ∇Φ (n_vertices).
    gradient: Vec<Vec3>,
    /// Δ = −H⁻¹∇Φ (n_unknowns).
    direction: Vec<f64>,
    /// x + αΔ (n_vertices).
    trial: Vec<Vec3>,
    /// Rounding error to expect in ‖∇Φ‖: that of the coordinates times the diagonal of H.
    noise: f64,
}

impl Newton {
    /// Analyses the pattern once.
    pub fn new(shell: &Shell) -> Result<Self> {
        let matrix = BlockMatrix::of(shell);
        let symbolic = Symbolic::analyse(matrix.lower.symbolic())?;
        let factor = symbolic.factor()?;
        let zeros = vec![Vec3::zeros(); shell.mass.len()];
        let direction = vec![0.0; shell.n_unknowns()];
        Ok(Self { matrix, symbolic, factor, gradient: zeros.clone(), direction, trial: zeros, noise: 0.0 })
    }

    /// Moves `x` to a minimum of Φ. `watch` hears of each iterate's residual.
    pub fn minimize(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        stop: Stop,
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Convergence> {
        let mut last = f64::INFINITY;
        self.noise = 0.0;
        for iterations in 0.. {
            potential.gradient(x, &mut self.gradient);
            let force = free_norm(potential.shell, &self.gradient);
            let residual = force / stop.scale;
            watch(residual)?;
            let stagnates = force <= FORCE_NOISE * self.noise && force > 0.5 * last;
            let converged = residual <= stop.tolerance || stagnates;
            if converged || iterations == stop.max_iterations {
                return Ok(Convergence { converged, iterations, residual });
            }
            let slope = self.find_direction(potential, x)?;
            if !self.search_line(potential, x, slope) {
                return Ok(Convergence { converged: force <= FORCE_NOISE * self.noise, iterations, residual });
            }
            last = force;
        }
        unreachable!("the loop ends at the last iteration allowed")
    }

    /// Finds Δ and returns the slope ∇Φ·Δ < 0.
    fn find_direction(&mut self, potential: &Potential, x: &[Vec3]) -> Result<f64> {
        potential.assemble(x, Curvature::Exact, &mut self.matrix);
        self.noise = self.expected_noise(potential, x);
        if let Some(slope) = self.solve(potential)? {
            return Ok(slope);
        }
        potential.assemble(x, Curvature::Semidefinite, &mut self.matrix);
        let mut shift = self.shift(potential);
        for _ in 0..TRIALS {
            for (i, v) in potential.free().enumerate() {
                self.matrix.add_diagonal(i, shift * potential.shell.mass[v]);
            }
            if let Some(slope) = self.solve(potential)? {
                return Ok(slope);
            }
            shift *= 9.0; // added to what is there: ten times in all
        }
        Err(Error::new(ErrorKind::Numerical, format!("no shift up to {shift:e} makes the Hessian positive definite")))
    }

    /// Δ and ∇Φ·Δ, or `None` unless the matrix is positive definite.
    fn solve(&mut self, potential: &Potential) -> Result<Option<f64>> {
        self.matrix.require_finite()?;
        if !self.symbolic.refactorize(&self.matrix.lower, &mut self.factor)? {
            return Ok(None);
        }
        for (i, v) in potential.free().enumerate() {
            self.direction[3 * i..3 * i + 3].copy_from_slice((-self.gradient[v]).as_slice());
        }
        let n = self.direction.len();
        self.symbolic.solve_in_place(&self.factor, MatMut::from_column_major_slice_mut(&mut self.direction, n, 1))?;
        let slope = self.slope(potential);
        Ok((slope < 0.0 && slope.is_finite()).then_some(slope))
    }

    /// ∇Φ·Δ.
    fn slope(&self, potential: &Potential) -> f64 {
        potential.free().enumerate().map(|(i, v)| self.gradient[v].dot(&self.along(i))).sum()
    }

    /// Δ at the i-th free vertex.
    fn along(&self, i: usize) -> Vec3 {
        Vec3::from_column_slice(&self.direction[3 * i..3 * i + 3])
    }

    /// Steps to x + αΔ with a sufficient decrease of Φ; false when there is none.
    fn search_line(&mut self, potential: &Potential, x: &mut [Vec3], slope: f64) -> bool {
        let (start, magnitude) = potential.value(x);
        let noise = VALUE_NOISE * magnitude;
        self.trial.copy_from_slice(x);
        let mut alpha = 1.0;
        for _ in 0..TRIALS {
            for (i, v) in potential.free().enumerate() {
                self.trial[v] = x[v] + alpha * self.along(i);
            }
            let change = potential.value(&self.trial).0 - start;
            if change <= DECREASE * alpha * slope || (change.abs() <= noise && self.flattens(potential, slope)) {
                x.copy_from_slice(&self.trial);
                return true;
            }
            // The minimum of the parabola through Φ, its slope and this trial.
            let parabola = -0.5 * slope * alpha * alpha / (change - slope * alpha);
            alpha = if parabola.is_finite() { parabola.clamp(0.1 * alpha, 0.5 * alpha) } else { 0.1 * alpha };
        }
        false
    }

    /// Whether the slope at the trial is smaller than at the start.
    fn flattens(&mut self, potential: &Potential, slope: f64) -> bool {
        potential.gradient(&self.trial, &mut self.gradient);
        self.slope(potential).abs() <= 0.9 * slope.abs()
    }

    /// τ: with it alone, ‖Δ‖_M = (shell's size)·√(total mass).
    fn shift(&self, potential: &Potential) -> f64 {
        let shell = potential.shell;
        let squared: f64 = potential.free().map(|v| self.gradient[v].norm_squared() / shell.mass[v]).sum();
        (squared / shell.total_mass).sqrt() / shell.mesh.size
    }

    fn expected_noise(&self, potential: &Potential, x: &[Vec3]) -> f64 {
        let furthest = potential.free().map(|v| x[v].amax()).fold(0.0, f64::max);
        let diagonal = self.matrix.diagonal().map(|d| d * d).sum::<f64>().sqrt();
        f64::EPSILON * furthest * diagonal
    }
}

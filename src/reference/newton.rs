//! Newton's method with a line search on a [`Potential`], where the steps of [`super::mixed`] do not get there.
//!
//! The direction is −H⁻¹∇Φ with the exact Hessian H. Where its Cholesky factorization fails, the semidefinite Hessian plus τM
//! takes its place: τ is such that no direction is longer than the shell is large, and vanishes with ∇Φ. What rounding alone
//! makes indefinite, fine parts beside coarse ones, is stiffened vertex by vertex before, and counts for nothing in τ.
//!
//! A thin shell hardly stretches, so a straight step that bends it far enough raises Φ, and a search for less along the line
//! makes many small steps. But the next Newton step takes the stretch out again. So steps may raise Φ a few times in a row as
//! long as Φ then falls below where it was (the watchdog of Chamberlain et al. 1982); if not, back to there and search.

mod ahead;
mod conjugate;
mod held;
mod lowest;
mod single;
mod stability;

use super::free_norm;
use super::implicit::STEP_SOLVES;
use super::mixed::Unstable;
use super::noise::Noise;
use super::parts::Parts;
use super::potential::Potential;
use crate::energy::Curvature;
use crate::mesh::NONE;
use crate::sparse::{BlockMatrix, Factor, Symbolic};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
pub use ahead::{Ahead, AtRest};
use conjugate::Conjugate;
pub(super) use held::Held;
use held::Rows;
use lowest::Lowest;
use single::Single;
use std::sync::Arc;

/// Sufficient decrease of Φ, as a share of the slope's promise (Armijo).
const DECREASE: f64 = 1e-4;

/// Halvings, at least, before a line search gives up: α falls to 1e-12.
const TRIALS: usize = 40;

/// Steps in a row that may leave Φ above the mark.
const VENTURES: usize = 2;

/// Linear solves of a search that is not of a step.
pub(super) const UNBOUNDED: usize = usize::MAX;

/// What rounding leaves of the load is no matter up to the first number: on shells that hang together it leaves 1e-6, and more where one flies away. It
/// is none, either, where Δ is at most this part of the displacement, as under loads that are small beside the stiffness of the sheet.
pub(super) const WORST_RESIDUAL: f64 = 1e-3;
const UNMOVED: f64 = 1e-3;

/// Sizes that a shell moves, root mean square, once nothing holds it: there rounding hides any load.
const FLOWN: f64 = 10.0;

/// The shortest share of Δ to venture.
const SHORTEST_REACH: f64 = 0.05;

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
    /// Whether what is left is small, or is rounding that hardly moves the shell.
    pub harmless: bool,
}

/// The sparse solver and scratch.
pub struct Newton {
    pub(super) matrix: BlockMatrix,
    symbolic: Arc<Symbolic>,
    factor: Factor,
    pub(super) single: Single,
    /// ∇Φ (n_vertices).
    pub(super) gradient: Vec<Vec3>,
    /// Δ = −H⁻¹∇Φ (n_unknowns).
    direction: Vec<f64>,
    /// x + αΔ (n_vertices).
    pub(super) trial: Vec<Vec3>,
    pub(super) noise: Noise,
    /// Whether nothing holds a component, and its momentum and inertia (n_components).
    floats: Vec<bool>,
    momenta: Vec<(Vec3, f64)>,
    /// Whether the last direction is of the exact Hessian.
    exact: bool,
    mark: Mark,
    /// The stress that the last step foresaw (n_elements).
    pub(super) stress: Vec<f64>,
    lowest: Lowest,
    /// Whether steps with the stress as an unknown come first.
    mixed: bool,
    /// Factorizations so far.
    pub(super) factorizations: usize,
    /// ‖∇Φ‖ where the factor was made, if it is that of a tangent of the present search.
    pub(super) made_at: Option<f64>,
    /// Linear solves that the present step may still take.
    pub(super) spare: usize,
    /// The next search with the stress as an unknown is of a step, from where the shell coasts to.
    pub(super) coasting: bool,
    /// A tangent that is held, and J of the last one that was factorized to be held.
    pub(super) held: Held,
    rows: Rows,
    /// For those that begin at rest.
    pub(super) at_rest: Option<Arc<AtRest>>,
    conjugate: Conjugate,
    /// Whether that may be solved by.
    pub(super) reusing: bool,
    /// Whether searches begin at poses of another method, and what they find is examined for its stability.
    pub(super) foreign: bool,
    /// What several threads share.
    pub(super) parts: Parts,
}

/// The last iterate that Φ fell to, and how far it is left behind.
struct Mark {
    x: Vec<Vec3>,
    direction: Vec<f64>,
    value: f64,
    slope: f64,
    /// ‖∇Φ‖.
    force: f64,
    /// Whether that is no more than rounding.
    noisy: bool,
    /// Steps since.
    ventures: usize,
    /// Share of Δ to venture next.
    reach: f64,
}

impl Newton {
    /// Bytes of the matrix, its factor and the fields.
    pub fn bytes(&self) -> usize {
        let entries = self.matrix.lower.val().len() * (size_of::<f64>() + size_of::<usize>());
        let fields = (self.gradient.len() + self.trial.len() + self.lowest.len()) * size_of::<Vec3>()
            + (self.direction.len() + self.conjugate.len()) * size_of::<f64>();
        entries
            + fields
            + self.symbolic.factor_bytes()
            + self.single.bytes(&self.symbolic)
            + self.symbolic.bytes()
            + self.parts.bytes()
            + self.rows.bytes()
    }

    /// Another with the settings of this one.
    pub fn renewed(&self, other: Self) -> Self {
        let Self { mixed, reusing, foreign, factorizations, spare, .. } = *self;
        Self { mixed, reusing, foreign, factorizations, spare, ..other }
    }

    /// Multiplications of a factorization and entries of the factor.
    pub fn operations(&self) -> [f64; 2] {
        [self.symbolic.operations(), (self.symbolic.factor_bytes() / size_of::<f64>()) as f64]
    }

    /// Analyses the pattern once; constraints couple the vertices of `cliques` besides.
    pub fn new(shell: &Shell, cliques: &[&[u32]]) -> Result<Self> {
        let matrix = shell.matrix(cliques);
        let symbolic = match cliques {
            [] => shell.analysis(matrix.lower.symbolic())?,
            _ => Arc::new(Symbolic::analyse(matrix.lower.symbolic(), &shell.points(&shell.free))?),
        };
        let factor = symbolic.factor()?;
        let zeros = vec![Vec3::zeros(); shell.mass.len()];
        let direction = vec![0.0; shell.n_unknowns()];
        let mark = Mark {
            x: zeros.clone(),
            direction: direction.clone(),
            value: 0.0,
            slope: 0.0,
            force: 0.0,
            noisy: false,
            ventures: 0,
            reach: 1.0,
        };
        let (gradient, trial, lowest) = (zeros.clone(), zeros, Lowest::default());
        let mut floats = vec![true; shell.mesh.n_components];
        let held = (0..shell.held.len()).filter(|&v| shell.held[v] && shell.mesh.component[v] != NONE);
        let rollers = shell.rollers.iter().map(|roller| roller.vertex as usize);
        held.chain(rollers).for_each(|v| floats[shell.mesh.component[v] as usize] = false);
        let momenta = vec![(Vec3::zeros(), 0.0); floats.len()];
        let noise = Noise::default();
        Ok(Self {
            matrix,
            symbolic,
            factor,
            single: Single::default(),
            gradient,
            direction,
            trial,
            noise,
            floats,
            momenta,
            exact: true,
            mark,
            stress: Vec::with_capacity(shell.energy.n_elements()),
            lowest,
            mixed: true,
            factorizations: 0,
            made_at: None,
            spare: UNBOUNDED,
            coasting: false,
            held: Held::Nothing,
            rows: Rows::default(),
            at_rest: None,
            conjugate: Conjugate::default(),
            reusing: true,
            foreign: false,
            parts: Parts::default(),
        })
    }

    /// See [`super::Solver::set_mixed`].
    pub(super) fn set_mixed(&mut self, mixed: bool) {
        self.mixed = mixed;
    }

    pub(super) fn is_mixed(&self) -> bool {
        self.mixed
    }

    /// Moves `x` to a minimum of Φ. `watch` hears of each iterate's residual.
    pub fn minimize(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        stop: Stop,
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Convergence> {
        self.noise.clear();
        (self.mark.ventures, self.mark.reach) = (0, 1.0);
        let before = self.factorizations;
        if self.mixed
            && let Some(end) = self.minimize_mixed(potential, x, (stop, Unstable::Shift), watch)?
        {
            return Ok(end);
        }
        let mut last = f64::INFINITY;
        for iterations in self.factorizations - before.. {
            potential.gradient_in(&mut self.parts, x, &mut self.gradient);
            let force = free_norm(potential.shell, &self.gradient);
            let residual = force / stop.scale;
            watch(residual)?;
            let stagnates = force > 0.5 * last && self.noise.explains(potential.shell, &self.gradient);
            let settled = residual <= stop.tolerance || stagnates;
            let converged = settled && self.is_below_mark(potential, x);
            if converged || iterations >= stop.max_iterations {
                let harmless = residual <= WORST_RESIDUAL
                    || (converged && self.exact && self.factorizations > before && self.is_harmless(potential, x)?);
                return Ok(Convergence { converged, iterations, residual, harmless });
            }
            last = force;
            if !settled && self.venture(potential, x, force)? {
                continue;
            }
            if !self.search_from_mark(potential, x) {
                let (residual, converged) = (self.mark.force / stop.scale, self.mark.noisy);
                let harmless =
                    residual <= WORST_RESIDUAL || (converged && self.exact && self.hardly_moves(potential, x));
                return Ok(Convergence { converged, iterations, residual, harmless });
            }
        }
        unreachable!("the loop ends at the last iteration allowed")
    }

    /// Takes `x` of a search that was cut short back to the last iterate that Φ fell to, if it has left that; ‖∇Φ‖ there.
    pub fn return_to_mark(&self, x: &mut [Vec3]) -> Option<f64> {
        (self.mark.ventures > 0).then(|| {
            x.copy_from_slice(&self.mark.x);
            self.mark.force
        })
    }

    /// Whether Φ is no higher than at the mark, to rounding; true at the mark itself.
    fn is_below_mark(&self, potential: &Potential, x: &[Vec3]) -> bool {
        let near = |(value, magnitude): (f64, f64)| value <= self.mark.value + self.noise.of_value(magnitude);
        self.mark.ventures == 0 || near(potential.value(x))
    }

    /// Steps along a new direction, if that lowers Φ below the mark or may yet come to. Then the mark moves along.
    fn venture(&mut self, potential: &Potential, x: &mut [Vec3], force: f64) -> Result<bool> {
        let slope = self.find_direction(potential, x)?;
        let mark = &mut self.mark;
        if mark.ventures == 0 {
            mark.x.copy_from_slice(x);
            mark.direction.copy_from_slice(&self.direction);
            (mark.value, mark.slope, mark.force) = (potential.value(x).0, slope, force);
            mark.noisy = self.noise.explains(potential.shell, &self.gradient);
        }
        let alpha = if mark.ventures == 0 { mark.reach } else { 1.0 };
        self.try_step(potential, x, alpha);
        let value = potential.value(&self.trial).0;
        let mark = &mut self.mark;
        if value <= mark.value + DECREASE * alpha * mark.slope {
            (mark.ventures, mark.reach) = (0, (2.0 * mark.reach).min(1.0));
        } else if self.exact && mark.ventures < VENTURES && value.is_finite() {
            mark.ventures += 1;
        } else {
            return Ok(false);
        }
        x.copy_from_slice(&self.trial);
        Ok(true)
    }

    /// Returns to the mark and steps along its direction to a sufficient decrease of Φ; false when there is none.
    fn search_from_mark(&mut self, potential: &Potential, x: &mut [Vec3]) -> bool {
        let mark = &mut self.mark;
        x.copy_from_slice(&mark.x);
        self.direction.copy_from_slice(&mark.direction);
        (mark.ventures, mark.reach) = (0, (0.25 * mark.reach).max(SHORTEST_REACH));
        let slope = mark.slope;
        self.search_line(potential, x, slope)
    }

    /// Finds Δ and returns the slope ∇Φ·Δ < 0.
    fn find_direction(&mut self, potential: &Potential, x: &[Vec3]) -> Result<f64> {
        potential.assemble(&mut self.parts, x, Curvature::Exact, &mut self.matrix);
        self.noise.measure(potential, x, &self.matrix);
        self.exact = true;
        if let Some(slope) = self.solve(potential)? {
            return Ok(slope);
        }
        let mut shift = self.shift(potential);
        if self.stiffen_by_noise(potential, shift)
            && let Some(slope) = self.solve(potential)?
        {
            return Ok(slope);
        }
        self.exact = false;
        potential.assemble(&mut self.parts, x, Curvature::Semidefinite, &mut self.matrix);
        self.stiffen_by_noise(potential, shift);
        for _ in 0..TRIALS {
            for (i, v) in potential.free().enumerate() {
                self.matrix.add_diagonal(i, shift * potential.shell.mass[v]);
            }
            if let Some(slope) = self.solve(potential)? {
                return Ok(slope);
            }
            shift *= 9.0; // on top of what is there: about ten times as much in all
        }
        Err(Error::new(ErrorKind::Numerical, format!("no shift up to {shift:e} makes the Hessian positive definite")))
    }

    /// Adds the stiffness of rounding errors where it is beyond that of a `shift`, which would have to grow to it for all
    /// vertices; whether there is such a vertex.
    fn stiffen_by_noise(&mut self, potential: &Potential, shift: f64) -> bool {
        let shell = potential.shell;
        let mut any = false;
        for (i, v) in potential.free().enumerate() {
            let stiffness = self.noise.stiffness(i, shell.area_of(v));
            if stiffness > shift * shell.mass[v] {
                self.matrix.add_diagonal(i, stiffness);
                any = true;
            }
        }
        any
    }

    /// Δ and ∇Φ·Δ, or `None` unless the matrix is positive definite.
    pub(super) fn solve(&mut self, potential: &Potential) -> Result<Option<f64>> {
        self.matrix.require_finite()?;
        self.spend()?;
        if !self.refactorize()? {
            return Ok(None);
        }
        self.solve_by_gradient(potential)?;
        let slope = self.slope(potential);
        Ok((slope < 0.0 && slope.is_finite()).then_some(slope))
    }

    /// Whether the matrix is positive definite: then its factor is at hand.
    fn refactorize(&mut self) -> Result<bool> {
        self.factorizations += 1;
        self.made_at = None;
        self.single.at_hand = false;
        self.held = Held::Nothing;
        self.symbolic.refactorize(&self.matrix.lower, &mut self.factor)
    }

    /// Δ with the factor at hand.
    pub(super) fn solve_by_gradient(&mut self, potential: &Potential) -> Result<()> {
        for (i, v) in potential.free().enumerate() {
            self.direction[3 * i..3 * i + 3].copy_from_slice((-self.gradient[v]).as_slice());
        }
        let mut room = self.symbolic.solving_room(1)?;
        self.precondition(&mut room);
        self.balance_momenta(potential);
        Ok(())
    }

    /// Whether what is left of the force at `x`, by the factor at hand, moves the shell by next to nothing.
    pub(super) fn is_harmless(&mut self, potential: &Potential, x: &[Vec3]) -> Result<bool> {
        self.solve_by_gradient(potential)?;
        Ok(self.hardly_moves(potential, x))
    }

    /// Whether Δ is next to nothing beside the displacement, of a shell that did not fly away.
    fn hardly_moves(&self, potential: &Potential, x: &[Vec3]) -> bool {
        let (mass, rest) = (&potential.shell.mass, &potential.shell.mesh.positions);
        let of = |way: &dyn Fn((usize, usize)) -> Vec3| -> f64 {
            potential.free().enumerate().map(|(i, v)| mass[v] * way((i, v)).norm_squared()).sum()
        };
        let gone = of(&|(_, v)| x[v] - rest[v]);
        let is_here = gone <= (FLOWN * potential.shell.mesh.size).powi(2) * potential.shell.total_mass;
        is_here && of(&|(i, _)| self.along(i)) <= UNMOVED * UNMOVED * gone
    }

    /// Takes one of the linear solves that are left to the step.
    pub(super) fn spend(&mut self) -> Result<()> {
        if self.spare == 0 {
            return Err(Error::new(
                ErrorKind::Numerical,
                format!("the step is given up after {STEP_SOLVES} linear solves: take shorter steps"),
            ));
        }
        self.spare -= 1;
        Ok(())
    }

    /// Moves each component that floats, without a constraint or an energy on it, so that Δ gives it the momentum that the forces ask for. Elastic and viscous forces do
    /// not change with translations and cancel in the sum; only inertia resists, and the air where there is wind, which takes what is lost. So this changes nothing but what was lost:
    /// to the shifts above, or to rounding where the stiffness is beyond 1e16 m/h².
    fn balance_momenta(&mut self, potential: &Potential) {
        let Some(step) = potential.step.filter(|step| step.drag.is_empty()) else { return };
        let (shell, sums) = (potential.shell, &mut self.momenta);
        sums.fill((Vec3::zeros(), 0.0));
        let component = |v: usize| shell.mesh.component[v] as usize;
        for (i, v) in potential.free().enumerate() {
            let weight = step.inertia_of_mass(v) * shell.mass[v];
            let delta = Vec3::from_column_slice(&self.direction[3 * i..3 * i + 3]);
            let (force, total) = &mut sums[component(v)];
            *force += self.gradient[v] + weight * delta;
            *total += weight;
        }
        let joined = potential.points.map_or(&[][..], |points| points.points());
        let joined = joined.iter().flat_map(|point| point.vertices().iter().copied());
        for v in potential.constraints.vertices().chain(joined) {
            if let Some(sum) = sums.get_mut(component(v as usize)) {
                *sum = (Vec3::zeros(), 1.0); // a vertex without triangles is of no component
            }
        }
        for (i, v) in potential.free().enumerate() {
            let (force, total) = sums[component(v)];
            if self.floats[component(v)] {
                (0..3).for_each(|c| self.direction[3 * i + c] -= force[c] / total);
            }
        }
    }

    /// ∇Φ·Δ.
    fn slope(&self, potential: &Potential) -> f64 {
        potential.free().enumerate().map(|(i, v)| self.gradient[v].dot(&self.along(i))).sum()
    }

    /// Δ at the i-th free vertex.
    pub(super) fn along(&self, i: usize) -> Vec3 {
        Vec3::from_column_slice(&self.direction[3 * i..3 * i + 3])
    }

    /// Steps to x + αΔ with a sufficient decrease of Φ; false when there is none.
    fn search_line(&mut self, potential: &Potential, x: &mut [Vec3], slope: f64) -> bool {
        let (start, magnitude) = potential.value(x);
        let noise = self.noise.of_value(magnitude);
        let mut alpha = 1.0;
        for _ in 0..TRIALS {
            self.try_step(potential, x, alpha);
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

    /// trial ← x + αΔ.
    pub(super) fn try_step(&mut self, potential: &Potential, x: &[Vec3], alpha: f64) {
        self.trial.copy_from_slice(x);
        for (i, v) in potential.free().enumerate() {
            self.trial[v] = x[v] + alpha * self.along(i);
        }
    }

    /// Whether the slope at the trial is smaller than at the start.
    fn flattens(&mut self, potential: &Potential, slope: f64) -> bool {
        potential.gradient_in(&mut self.parts, &self.trial, &mut self.gradient);
        self.slope(potential).abs() <= 0.9 * slope.abs()
    }

    /// τ: with it alone, ‖Δ‖_M = (shell's size)·√(total mass).
    fn shift(&self, potential: &Potential) -> f64 {
        let shell = potential.shell;
        let force = |(i, v): (usize, usize)| self.noise.above_floor(i, self.gradient[v].norm());
        let squared: f64 = potential.free().enumerate().map(|(i, v)| force((i, v)).powi(2) / shell.mass[v]).sum();
        (squared / shell.total_mass).sqrt() / shell.mesh.size
    }
}

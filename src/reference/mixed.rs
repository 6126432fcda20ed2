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
//! A pose that a method of few fields has is stretched a little everywhere, and the stress of that would spoil the first tangents. So a search
//! from such a pose begins with a membrane that has none, Gauss and Newton's tangent there: its step finds the stress that balances the load.
//!
//! A step in time begins where the shell coasts to or where it is, and with the membrane's stress there where it is: that is nearly what it ends
//! with, while coasting along a straight line stretches a shell that turns. The last step of a search, among rounding errors, is one with the factor at hand.
//!
//! Where the tangent is not positive definite the shell is about to snap. There τM is added, more of it until it is, and less in each
//! step after that. In a step in time inertia holds the shell, and τM would only shorten the way. Without constraints a share of what is not
//! positive semidefinite of σ ∂²ε is left out instead: more of it until the tangent is, less in each step after that. Limp cloth buckles everywhere,
//! and gets there in half the steps that lower the energy along their lines.

use super::free_norm;
use super::newton::{Convergence, Newton, Stop, WORST_RESIDUAL};
use super::parts::Parts;
use super::potential::Potential;
use crate::energy::Stress;
use crate::{Result, Vec3};

/// No vertex goes further in a step, in model sizes.
pub(super) const REACH: f64 = 0.1;

/// Factorizations at most: with a tangent that stays positive definite steps converge in three to ten, or hardly.
pub(super) const FACTORIZATIONS: usize = 16;

/// The first τ lets the forces that are left move the shell by this part of its size.
const SHIFTED: f64 = 0.03;

/// τ grows by this factor where it does not do, falls by this one in each step, and ends at this part of the first.
const RISE: f64 = 5.0;
const FALL: f64 = 0.3;
const LEAST: f64 = 1e-3;

/// The force is this part of what it was where the factor was made, at most, where that is tried again, for so many products: the next step then
/// hardly turns the elements, and about as many products cost as much as a factorization.
const NEAR: f64 = 0.1;
const PRODUCTS: usize = 8;

/// An equilibrium to better than the first has a tangent that is positive definite where the force is this part of the load. One that moves in
/// time needs none, as what is unstable then takes its time.
const LOOSE: f64 = 1e-5;
const TELLING: f64 = 1e-2;

/// Of the force, what a solution by an earlier factor may leave: little enough for the step after it to end the search, or about what the next
/// step leaves anyway, by what the last one left to this power (Eisenstat, Walker 1996); and no less than the last number.
const SOLVED: f64 = 1e-2;
const SUPERLINEAR: f64 = 1.5;
const LEAST_SOLVED: f64 = 1e-6;

/// A step by an earlier factor that leaves more than this part of the force is the last one by it: so each factor ends a search or falls behind
/// within so many steps as halve all digits.
const SLOW: f64 = 0.5;

/// Factorizations of a step in time at most. Cotton of docs/evidence/solver.md takes 30 on average.
const STEP_FACTORIZATIONS: usize = 100;

/// From the share of pushes that counts, the next to try is nearer to all by half the way, and all from here on; where one does not do, half of it, or
/// nothing below the last number.
const NEARLY_ALL: f64 = 0.85;
const LEAST_SHARE: f64 = 0.1;

/// Once a share did not do, more is tried after so many steps.
const PATIENCE: usize = 1;

/// With a share that counts, a step is so many times as long as the last one at most: where the tangent is hardly positive definite it would go far beyond what it is of.
const GROWTH: f64 = 2.0;

/// What to do where the tangent is not positive definite.
#[derive(Clone, Copy, PartialEq)]
pub enum Unstable {
    /// Give up.
    Stop,
    /// Go on with τM, or, in a step in time without constraints, with a share of pushes.
    Shift,
}

/// What a direction is to be found with.
#[derive(Clone, Copy)]
struct Tangent<'a> {
    /// σ.
    stress: &'a [f64],
    /// ‖∇Φ‖.
    force: f64,
    /// Of that, what the direction may leave.
    enough: f64,
    /// Whether the factor of an earlier tangent may do.
    near: bool,
}

/// What makes tangents positive definite.
#[derive(Clone, Copy)]
struct Shift {
    /// τ, and the first.
    tau: f64,
    first: f64,
    /// Of pushes, what counts, and the steps until more is tried.
    share: f64,
    wait: usize,
    /// How far a vertex may go in the next step.
    reach: f64,
}

impl Default for Shift {
    fn default() -> Self {
        Self { tau: 0.0, first: 0.0, share: 1.0, wait: 0, reach: f64::INFINITY }
    }
}

impl Shift {
    /// Whether the tangent is all of it.
    fn is_none(&self) -> bool {
        self.tau == 0.0 && self.share == 1.0
    }

    /// Eases what a step took.
    fn ease(&mut self) {
        self.tau = if self.tau > LEAST * self.first { FALL * self.tau } else { 0.0 };
        self.wait = self.wait.saturating_sub(1);
    }

    /// The share to try after one that did not do, or first.
    fn next_share(&self, tried: Option<f64>) -> Option<f64> {
        match tried {
            None if self.share == 1.0 || self.wait > 0 => Some(self.share),
            None if self.share < NEARLY_ALL => Some(0.5 + 0.5 * self.share),
            None => Some(1.0),
            Some(0.0) => None,
            Some(more) if more > self.share => Some(self.share),
            Some(more) if more < 2.0 * LEAST_SHARE => Some(0.0),
            Some(more) => Some(0.5 * more),
        }
    }
}

/// Whether a share of pushes is left out in place of a shift. With constraints, whose way is taken in parts, τM ends nearer to where the shell is.
fn shares_pushes(potential: &Potential) -> bool {
    potential.step.is_some() && potential.constraints.is_empty()
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
        self.made_at = None;
        self.single.failed = false;
        let mut stress = std::mem::take(&mut self.stress);
        let mut from = potential.value(x).0;
        self.pass_first(x, from);
        if self.coasting {
            let still = potential.value(potential.origin).0;
            if from.is_nan() || from > still {
                from = still;
                self.pass_first(potential.origin, from);
            }
            self.choose_start(potential, x, &mut stress);
        }
        let found = self.mixed_steps(potential, x, (stop, unstable), &mut stress, watch);
        self.stress = stress;
        if let Ok(Some(end)) = found {
            let (value, magnitude) = potential.value(x);
            if value <= from + self.noise.of_value(magnitude) {
                return Ok(Some(end));
            }
        }
        x.copy_from_slice(self.lowest_passed(potential));
        found.map(|_| None)
    }

    fn mixed_steps(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        (stop, unstable): (Stop, Unstable),
        stress: &mut Vec<f64>,
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Option<Convergence>> {
        let shell = potential.shell;
        let most = if shares_pushes(potential) { STEP_FACTORIZATIONS } else { FACTORIZATIONS };
        let most = self.factorizations + most.min(stop.max_iterations);
        let (mut shift, mut stable, mut last) = (Shift::default(), false, f64::INFINITY);
        let mut kept = false;
        for iterations in 0..=stop.max_iterations {
            potential.gradient_in(&mut self.parts, x, &mut self.gradient);
            let force = free_norm(shell, &self.gradient);
            let residual = force / stop.scale;
            watch(residual)?;
            let explained = self.noise.explains(shell, &self.gradient);
            if residual <= stop.tolerance || (explained && force > 0.5 * last) {
                let harmless = self.leaves_little(potential, x, residual)?;
                return Ok(stable.then_some(Convergence { converged: true, iterations, residual, harmless }));
            }
            if explained && stable && potential.step.is_some() && self.made_at.is_some() {
                let residual = self.correct_last(potential, x, force)? / stop.scale;
                return Ok(Some(Convergence { converged: true, iterations: iterations + 1, residual, harmless: true }));
            }
            if iterations == 0 {
                self.begin(potential, x, stress);
            } else if unstable == Unstable::Shift {
                self.pass(potential, x);
            }
            let enough = self.enough(potential, stop, [force, last]);
            let near = !(kept && force > SLOW * last) && self.is_factor_near(potential, force, stop);
            last = force;
            if self.factorizations >= most {
                break;
            }
            let made = self.factorizations;
            let wanted = (&mut *stress, [force, enough], near);
            let Some(bare) = self.next_direction(potential, x, wanted, (&mut shift, unstable))? else { break };
            kept = self.factorizations == made;
            stable = shift.is_none() && !bare && !(self.foreign && iterations == 0);
            shift.ease();
            self.step_in_reach(potential, x, &mut shift);
            foresee(potential, &mut self.parts, [x, &self.trial], stress);
            x.copy_from_slice(&self.trial);
        }
        Ok(None)
    }

    /// The first stress.
    pub(super) fn begin(&mut self, potential: &Potential, x: &[Vec3], stress: &mut Vec<f64>) {
        foresee_strains(potential, &mut self.parts, [x, x], stress);
        potential.constraints.foresee_torques(x, None, stress);
        let membrane = &mut stress[..potential.shell.energy.n_membrane()];
        if self.foreign {
            membrane.fill(0.0);
        } else if self.coasting {
            if self.parts.find_strains(potential.shell, potential.origin, None) {
                return self.parts.read_strains(membrane);
            }
            let mut each = membrane.iter_mut();
            potential.shell.energy.visit_strains(potential.origin, &mut |_, strain| {
                each.next().into_iter().for_each(|stress| *stress = strain);
            });
        }
    }

    /// Takes `x`, where the shell coasts to, back to where it is if that leaves less force, but for what the membrane stretches on the way.
    fn choose_start(&mut self, potential: &Potential, x: &mut [Vec3], stress: &mut Vec<f64>) {
        self.begin(potential, x, stress);
        potential.mixed_gradient(&mut self.parts, x, stress, &mut self.gradient);
        let coasting = free_norm(potential.shell, &self.gradient);
        potential.gradient_in(&mut self.parts, potential.origin, &mut self.gradient);
        let still = free_norm(potential.shell, &self.gradient);
        if coasting.is_nan() || coasting > still {
            x.copy_from_slice(potential.origin);
        }
    }

    /// Whether a residual is small, or the force at `x` that is left of a search hardly moves the shell.
    fn leaves_little(&mut self, potential: &Potential, x: &[Vec3], residual: f64) -> Result<bool> {
        Ok(residual <= WORST_RESIDUAL || (self.made_at.is_some() && self.is_harmless(potential, x)?))
    }

    /// Moves `x`, where rounding explains the force that is left, by one more step of the factor at hand unless that leaves more force. Returns the force.
    fn correct_last(&mut self, potential: &Potential, x: &mut [Vec3], force: f64) -> Result<f64> {
        self.solve_by_gradient(potential)?;
        self.try_step(potential, x, 1.0);
        potential.gradient_in(&mut self.parts, &self.trial, &mut self.gradient);
        let left = free_norm(potential.shell, &self.gradient);
        if left < force {
            x.copy_from_slice(&self.trial);
        }
        Ok(left.min(force))
    }

    /// Finds Δ by the tangent of a stress, for ‖∇Φ‖ and the part of it that Δ may leave, as in [`Tangent`]. In a search from a foreign pose the
    /// membrane has no stress where that is not positive definite. Whether that was so, or `None` where no Δ is found.
    fn next_direction(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        (stress, [force, enough], near): (&mut Vec<f64>, [f64; 2], bool),
        (shift, unstable): (&mut Shift, Unstable),
    ) -> Result<Option<bool>> {
        let tried = if self.foreign { Unstable::Stop } else { unstable };
        if self.mixed_direction(potential, x, Tangent { stress, force, enough, near }, (&mut *shift, tried))? {
            return Ok(Some(false));
        }
        if !self.foreign {
            return Ok(None);
        }
        self.begin(potential, x, stress);
        let bare = Tangent { stress, force, enough, near: false };
        Ok(self.mixed_direction(potential, x, bare, (shift, unstable))?.then_some(true))
    }

    /// Moves `x` by so many steps, wherever they lead, from a `stress` on to the one that the last step foresaw. `watch` hears ‖∇Φ‖ before each.
    pub(super) fn follow_mixed(
        &mut self,
        potential: &Potential,
        x: &mut [Vec3],
        stress: &mut Vec<f64>,
        (steps, watch): (usize, &mut dyn FnMut(f64) -> Result<()>),
    ) -> Result<()> {
        self.made_at = None;
        for _ in 0..steps {
            potential.gradient_in(&mut self.parts, x, &mut self.gradient);
            watch(free_norm(potential.shell, &self.gradient))?;
            let (wanted, mut shift) = ((&mut *stress, [0.0, 0.0], false), Shift::default());
            if self.next_direction(potential, x, wanted, (&mut shift, Unstable::Shift))?.is_none() {
                break;
            }
            self.step_in_reach(potential, x, &mut shift);
            foresee(potential, &mut self.parts, [x, &self.trial], stress);
            x.copy_from_slice(&self.trial);
        }
        self.made_at = None;
        Ok(())
    }

    /// What a stress at `x` leaves of the force.
    pub(super) fn mixed_force(&mut self, potential: &Potential, x: &[Vec3], stress: &[f64]) -> f64 {
        potential.mixed_gradient(&mut self.parts, x, stress, &mut self.gradient);
        free_norm(potential.shell, &self.gradient)
    }

    /// trial ← x + Δ, or as much of Δ as is in reach.
    fn step_in_reach(&mut self, potential: &Potential, x: &[Vec3], shift: &mut Shift) {
        let shell = potential.shell;
        let longest = (0..shell.free.len()).map(|i| self.along(i).norm()).fold(0.0, f64::max);
        let reach = (REACH * shell.mesh.size).min(shift.reach);
        self.try_step(potential, x, (reach / longest).min(1.0));
        if shift.share < 1.0 {
            shift.reach = GROWTH * longest.min(reach);
        }
    }

    /// Whether the tangent has hardly changed since its last factorization, and that spoke for the stability of where the search will end.
    fn is_factor_near(&self, potential: &Potential, force: f64, stop: Stop) -> bool {
        let Some(made_at) = self.made_at else { return false };
        let telling =
            self.foreign || potential.step.is_some() || stop.tolerance >= LOOSE || made_at <= TELLING * stop.scale;
        self.reusing && telling && force <= NEAR * made_at
    }

    /// Of the force that is left after `last`, what a direction may leave. Steps in time end among rounding errors and need no more.
    fn enough(&self, potential: &Potential, stop: Stop, [force, last]: [f64; 2]) -> f64 {
        let (mut goal, mut next) = (stop.tolerance * stop.scale, 0.0);
        if potential.step.is_some() {
            goal = goal.max(self.noise.norm());
            next = libm::pow(force / last, SUPERLINEAR);
        }
        (0.1 * goal / force).max(next).clamp(LEAST_SOLVED, SOLVED)
    }

    /// Finds Δ with the largest share of pushes tried with which the tangent is positive definite; false where it is not with none.
    fn shared_direction(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        Tangent { stress, force, enough, near }: Tangent,
        shift: &mut Shift,
    ) -> Result<bool> {
        let mut tried = None;
        while let Some(share) = shift.next_share(tried) {
            potential.assemble_mixed(&mut self.parts, x, Stress { of: stress, share }, &mut self.matrix);
            self.noise.measure(potential, x, &self.matrix);
            if self.matrix.require_finite().is_err() {
                return Ok(false);
            }
            let all = share == 1.0;
            if all && near && self.solve_by_factor(potential, enough, PRODUCTS)? {
                return Ok(true);
            }
            if self.solve_by_single(potential, enough)? || self.solve(potential)?.is_some() {
                self.made_at = all.then_some(force);
                if tried.is_some() {
                    shift.wait = PATIENCE + 1;
                }
                shift.share = share;
                return Ok(true);
            }
            tried = Some(share);
        }
        Ok(false)
    }

    /// Finds Δ, with τM as it is or as much more as makes the tangent positive definite; false where it does not come to be.
    fn mixed_direction(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        Tangent { stress, force, enough, near }: Tangent,
        (shift, unstable): (&mut Shift, Unstable),
    ) -> Result<bool> {
        let shell = potential.shell;
        if shares_pushes(potential) && unstable == Unstable::Shift {
            return self.shared_direction(potential, x, Tangent { stress, force, enough, near }, shift);
        }
        for _ in 0..FACTORIZATIONS {
            let stress = Stress::whole(stress);
            potential.assemble_mixed(&mut self.parts, x, stress, &mut self.matrix);
            self.noise.measure(potential, x, &self.matrix);
            for (i, v) in potential.free().enumerate() {
                self.matrix.add_diagonal(i, shift.tau * shell.mass[v]);
            }
            if self.matrix.require_finite().is_err() {
                return Ok(false);
            }
            if shift.tau == 0.0 && near && self.solve_by_factor(potential, enough, PRODUCTS)? {
                return Ok(true);
            }
            if self.solve_by_single(potential, enough)? || self.solve(potential)?.is_some() {
                self.made_at = (shift.tau == 0.0).then_some(force);
                return Ok(true);
            }
            if unstable == Unstable::Stop {
                return Ok(false);
            }
            if shift.tau > 0.0 {
                shift.tau *= RISE;
                continue;
            }
            let mut forces = vec![Vec3::zeros(); x.len()];
            potential.mixed_gradient(&mut self.parts, x, stress.of, &mut forces);
            let squared: f64 = potential.free().map(|v| forces[v].norm_squared() / shell.mass[v]).sum();
            let tau = (squared / shell.total_mass).sqrt() / (SHIFTED * shell.mesh.size);
            *shift = Shift { tau, first: tau, ..*shift };
        }
        Ok(false)
    }
}

/// σ ← ε(x) + J (next − x), and after these the torques of orientations.
fn foresee(potential: &Potential, parts: &mut Parts, [x, next]: [&[Vec3]; 2], stress: &mut Vec<f64>) {
    foresee_strains(potential, parts, [x, next], stress);
    potential.constraints.foresee_torques(x, Some(next), stress);
}

fn foresee_strains(potential: &Potential, parts: &mut Parts, [x, next]: [&[Vec3]; 2], stress: &mut Vec<f64>) {
    stress.clear();
    if parts.find_strains(potential.shell, x, Some(next)) {
        stress.resize(potential.shell.energy.n_elements(), 0.0);
        return parts.read_strains(stress);
    }
    potential.shell.energy.visit_strains(x, &mut |(vertices, row), strain| {
        let change: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&(next[v as usize] - x[v as usize]))).sum();
        stress.push(strain + change);
    });
}

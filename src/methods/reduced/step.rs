//! A step of the reduced shell by a diagonally implicit Runge–Kutta method of two stages and second order (Alexander 1977), with
//! γ = 1 − 1/√2 and y' = f(y) of y = (q, q̇):
//!
//!   y₁ = y + γh f(y₁),   y⁺ = y + (1 − γ)h f(y₁) + γh f(y⁺).
//!
//! It is L-stable: of a swing with the phase θ = ωh it takes θ⁴/270 a step, and what the step does not resolve dies at once. A step
//! knows nothing of those before, so that loads and targets may jump between steps: loads are constant over each, targets move evenly.
//!
//! Each stage is a step of backward Euler over γh from a place that is known. Its end is the minimum of a potential, found by Newton's
//! method ([`crate::reduced::Newton`]) from a guess or, where the potential is lower, from the stage's start. Both have the same
//! inertia, and the second begins with the Hessian of the first. A step with a search that ends short is made anew by backward Euler,
//! whose potential is no higher at its end than at q: a step that ends short gains no energy but what loads and constraints put in.
//!
//! A step among contacts, whose force comes and goes at once, is one of backward Euler. Where stiffness relaxes in a stage what the step does not
//! resolve, as when a handle lets a stretched shell go, the second stage would start 1.4 times as far beyond: pressed together there, the
//! shell buckles into a motion of its size. Then that stage stands, and the rest of the step begins anew behind it (Rannacher 1984 takes
//! such steps behind what jumps).
//!
//! Damping is ξI + ζ Bᵀ(Σ b bᵀ)B with the strain rows b of the shape at the start of the step, and 2 ratio √λ on the modes.

use super::rows::Shares;
use super::{At, Coordinates, Reduced};
use crate::load::BodyLoad;
use crate::methods::Acting;
use crate::reduced::{Form, Joined, Potential, ReducedShell, Stop, sum_of};
use crate::step::stages::{GAMMA, NOTHING, ONWARD, RELAXING, RESOLVED, SUDDEN, Stages};
use crate::{Error, ErrorKind, Result};

/// A step moves on at this, an energy of 1e-10 of what the loads do; the Newton step that shows it is still taken.
const STEP: Stop = Stop { tolerance: 1e-5, iterations: 20, led: false, near: false, least: 0.0 };
/// What a stage on a smooth energy may leave where it is not looked at: a part of the error of the step itself.
const QUICK: f64 = 1.5e-4;
/// Of the largest shape that the polynomial was trained on, how near a guess is.
const NEAR: f64 = 0.1;
/// Passes of a step, at most: in a turning frame, whose forces are taken at the end of the step as found last, each gains a factor ωh;
/// orientations are held to first order about the shape that was found last.
const PASSES: usize = 4;
/// Of what a step moves, what a pass may change as the last one: forces of a turning frame feel the rates that it makes.
const ENOUGH: f64 = 1e-5;
/// Of the displacement, what the last pass may still change although it changes more than the first.
const SETTLED: f64 = 1e-3;

/// A step of backward Euler within a step.
#[derive(Clone, Copy)]
struct Stage {
    /// Seconds of the whole step, and of this.
    h: f64,
    tau: f64,
    /// Where constraints are at its end, as a share of their way in the step.
    share: f64,
    /// The Hessian of the search before is near enough to begin with.
    near: bool,
    damped: Damped,
}

/// What resists rates beside ξ.
#[derive(Clone, Copy, PartialEq)]
enum Damped {
    Not,
    /// Modes alone.
    Modes,
    All,
}

impl Reduced {
    /// One step of `h`. Changes nothing on failure.
    pub(super) fn advance_by(&mut self, acting: &Acting, h: f64) -> Result<()> {
        let (shell, reduced) = (self.shell.clone(), self.reduced.clone());
        let at = At::of(&shell, &reduced, acting);
        self.take_places(at);
        self.set_force(acting);
        self.newton.take_work();
        let sudden = at.points.is_some_and(|points| points.is_sudden());
        let (mut converged, mut work) = if sudden { (false, 0.0) } else { self.stages(at, acting.load, h)? };
        if !converged {
            (converged, work) = self.backward_euler(at, acting.load, h)?;
        }
        if at.points.is_some_and(|points| points.is_passive()) && acting.load.spin_rate().is_none() {
            self.gain_nothing(work);
        }
        self.record_outcomes(at);
        let finite = (self.constraints.work + work).is_finite() && self.constraints.is_finite() && !self.overflows;
        if !finite || !self.is_within_range(&self.next, &self.rates) || self.outruns_range(h) {
            let message = format!("the step of {h:?} s does not give finite positions");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        self.motion.q.copy_from_slice(&self.next);
        self.motion.q_dot.copy_from_slice(&self.rates);
        self.unconverged += u64::from(!converged);
        self.work = self.newton.take_work();
        self.constraints.accept(work);
        Ok(())
    }

    /// Slows the next motion down where it has more energy than the work of loads and constraints tells: what stands still gives none.
    fn gain_nothing(&mut self, work: f64) {
        let Coordinates { q, q_dot } = &self.motion;
        let energy = self.reduced.elastic(self.form);
        let kinetic = |rates: &[f64]| 0.5 * rates.iter().map(|rate| rate * rate).sum::<f64>();
        let loads: f64 = (0..q.len()).map(|k| self.force[k] * (self.next[k] - q[k])).sum();
        let scratch = self.newton.scratch();
        let stored = energy.value(&self.next, scratch) - energy.value(q, scratch);
        let (room, moving) = ((kinetic(q_dot) + work + loads - stored).max(0.0), kinetic(&self.rates));
        if moving > room {
            let share = (room / moving).sqrt();
            self.rates.iter_mut().for_each(|rate| *rate *= share);
        }
    }

    /// Sets the next q and its rates. Returns whether the searches converged, and the work of constraints.
    fn stages(&mut self, at: At, load: &BodyLoad, h: f64) -> Result<(bool, f64)> {
        let (mut before, mut left, mut standing) = (0.0, h, 0);
        let end = loop {
            let done = self.two_stages(at, load, left, standing < RELAXING);
            let Ok(Stages { stands: true, work, .. }) = done else { break done };
            if standing == 0 {
                self.begins.copy_from(&self.motion.q, &self.motion.q_dot);
            }
            self.motion.copy_from(&self.next, &self.rates);
            standing += 1;
            before += work;
            left *= 1.0 - GAMMA;
        };
        if standing > 0 {
            self.motion.copy_from(&self.begins.q, &self.begins.q_dot);
        }
        end.map(|end| (end.converged, before + end.work))
    }

    /// The same, or one stage where that stands and `may_stand`.
    fn two_stages(&mut self, at: At, load: &BodyLoad, h: f64, may_stand: bool) -> Result<Stages> {
        let tau = GAMMA * h;
        let damped = self.set_viscosity(at.reduced, tau);
        let first = Stage { h, tau, share: GAMMA, near: false, damped };
        self.begin(at, first);
        if !self.advance(at, load, first)? {
            return Ok(Stages { stands: false, converged: false, work: 0.0 });
        }
        if may_stand && self.relaxes(first) {
            return Ok(Stages { stands: true, converged: true, work: self.work_of_constraints() });
        }
        let work = ONWARD * self.work_of_constraints();
        self.set_rows(at, Shares::of_step(1.0));
        self.start.copy_from_slice(&self.next);
        let Coordinates { q, q_dot } = &self.motion;
        let [places, rates] = &mut self.from;
        let from = places.iter_mut().zip(rates).zip(q).zip(q_dot);
        for ((((place, rate), q), q_dot), (next, ended)) in from.zip(self.next.iter_mut().zip(&self.rates)) {
            let gained = ended - q_dot;
            *place = q + ONWARD * (*next - q);
            *rate = q_dot + ONWARD * gained;
            *next = *place + tau * (*rate + gained); // with the acceleration of the first stage
        }
        let converged = self.advance(at, load, Stage { share: 1.0, near: true, ..first })?;
        let (start, gone, end) = (&self.motion.q_dot, &self.from[1], &self.rates);
        let back = 1.0 / ONWARD;
        let rates = |k: usize| [start[k], start[k] + back * (gone[k] - start[k]), end[k]];
        self.estimate.of_stages(h, (0..end.len()).map(rates));
        Ok(Stages { stands: false, converged, work: work + self.work_of_constraints() })
    }

    /// Whether a stage jumps where stiffness resists, and not inertia.
    fn relaxes(&mut self, stage: Stage) -> bool {
        let Coordinates { q, q_dot } = &self.motion;
        let alpha = stage.tau.recip();
        let coasted = sum_of(q_dot, q_dot, |rate, _| (stage.tau * rate).powi(2));
        let size = sum_of(q, q, |q, _| q * q);
        for (last, (next, (q, q_dot))) in self.last.iter_mut().zip(self.next.iter().zip(q.iter().zip(q_dot))) {
            *last = next - q - stage.tau * q_dot;
        }
        let jump = sum_of(&self.last, &self.last, |d, _| d * d);
        if jump <= SUDDEN * SUDDEN * coasted || jump <= NOTHING * NOTHING * size {
            return false;
        }
        self.newton.filter(alpha * (alpha + self.damping.mass), &mut self.last);
        let places = q.iter().zip(q_dot).zip(&self.next);
        let kept: f64 =
            places.zip(&self.last).map(|(((q, rate), next), kept)| (next - q - stage.tau * rate) * kept).sum();
        kept < RESOLVED * jump
    }

    /// The same by one stage.
    fn backward_euler(&mut self, at: At, load: &BodyLoad, h: f64) -> Result<(bool, f64)> {
        let damped = self.set_viscosity(at.reduced, h);
        let stage = Stage { h, tau: h, share: 1.0, near: false, damped };
        self.begin(at, stage);
        let converged = self.advance(at, load, stage)?;
        let (start, end) = (&self.motion.q_dot, &self.rates);
        self.estimate.of_one(h, start.iter().zip(end).map(|(start, end)| [*start, *end]));
        Ok((converged, self.work_of_constraints()))
    }

    /// A stage starts where the step does.
    fn begin(&mut self, at: At, stage: Stage) {
        let Coordinates { q, q_dot } = &self.motion;
        self.from[0].copy_from_slice(q);
        self.from[1].copy_from_slice(q_dot);
        self.start.copy_from_slice(q);
        self.next.copy_from_slice(q);
        self.set_rows(at, Shares::of_step(stage.share));
        let Coordinates { q, q_dot } = &self.motion;
        let moving = q.iter().zip(q_dot);
        self.next.iter_mut().zip(moving).for_each(|(next, (q, q_dot))| *next = q + stage.tau * q_dot);
    }

    /// Moves the next q from a guess to the end of a stage, and sets its rates. Returns whether the search converged.
    fn advance(&mut self, at: At, load: &BodyLoad, stage: Stage) -> Result<bool> {
        let Stage { h, tau, share, near, damped } = stage;
        let (reduced, alpha, mass) = (at.reduced, tau.recip(), self.damping.mass);
        let shift = alpha * (alpha + mass);
        let energy = reduced.elastic(self.form);
        let turned = self.holds_orientations();
        let passes = if turned || load.spin_rate().is_some() { PASSES } else { 1 };
        let (mut converged, mut gained, mut size) = (true, [0.0; PASSES], 0.0);
        for (pass, gained) in gained[..passes].iter_mut().enumerate() {
            self.last.copy_from_slice(&self.next);
            if turned && pass > 0 {
                self.set_rows(at, Shares::of_step(share));
            }
            self.set_load(reduced, load, stage);
            let constraints = (!self.rows.is_empty()).then_some(&self.rows);
            let matrix = (damped == Damped::All).then_some(&self.viscosity);
            let diagonal = (damped == Damped::Modes).then_some(&self.resistance[..]);
            let joined = at.points.map(|energy| Joined { energy, places: &self.places });
            let potential = Potential { shift, matrix, diagonal, load: &self.load, constraints, joined };
            let smooth = self.form == Form::Polynomial && (share < 1.0 || near);
            let quick = smooth && constraints.is_none();
            let checked = pass == 0 && !(smooth && self.is_near(reduced));
            if checked && !self.newton.is_lower(energy, &potential, &self.next, &self.start) {
                self.next.copy_from_slice(&self.start);
            }
            let near = near || pass > 0;
            let end =
                if quick { self.newton.approach(energy, &potential, &mut self.next, (QUICK, near)) } else { None };
            let end = end.unwrap_or_else(|| {
                let stop = Stop { near: near && !quick, ..STEP };
                self.newton.minimize(energy, &potential, &mut self.next, stop)
            });
            converged = end.converged;
            self.overflows = !converged && !end.residual.is_finite();
            if passes == 1 {
                break;
            }
            *gained = sum_of(&self.next, &self.last, |a, b| (a - b).powi(2));
            size = sum_of(&self.next, &self.next, |q, _| q * q);
            let moved = sum_of(&self.next, &self.start, |next, q| (next - q).powi(2));
            if *gained <= ENOUGH * ENOUGH * moved {
                break;
            }
        }
        // The first pass makes up for the guess; from the second on only the frame's forces change.
        if let Some(rate) = load.spin_rate().filter(|_| gained[PASSES - 1] > gained[1].max(SETTLED * SETTLED * size)) {
            let turn = rate * h;
            let turn = if turn < 1e4 { format!("{turn:.1}") } else { format!("{turn:.1e}") };
            let message = format!("the forces of a frame that turns by {turn} rad in a step of {h:?} s do not settle");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let moved = self.next.iter().zip(&self.from[0]);
        self.rates.iter_mut().zip(moved).for_each(|(rate, (next, from))| *rate = alpha * (next - from));
        Ok(converged)
    }

    /// b of a stage's potential: forces, inertia and damping of where it starts, and a turning frame's forces where the next q is.
    fn set_load(&mut self, reduced: &ReducedShell, load: &BodyLoad, stage: Stage) {
        let Stage { tau, damped, .. } = stage;
        let (alpha, [places, rates]) = (tau.recip(), &self.from);
        let shift = alpha * (alpha + self.damping.mass);
        let (_, spin) = load.parts();
        self.load.copy_from_slice(&self.force);
        if let Some((gradient, coriolis)) = spin {
            (0..places.len()).for_each(|k| self.rates[k] = alpha * (self.next[k] - places[k]));
            reduced.add_spin(gradient, coriolis, (&self.next, &self.rates), &mut self.load);
        }
        for ((load, place), rate) in self.load.iter_mut().zip(places).zip(rates) {
            *load += shift * place + alpha * rate;
        }
        match damped {
            Damped::Not => {}
            Damped::Modes => {
                let both = self.resistance.iter().zip(places);
                self.load.iter_mut().zip(both).for_each(|(load, (c, q))| *load += c * q);
            }
            Damped::All => {
                let along = |column: &[f64]| column.iter().zip(places).map(|(c, q)| c * q).sum::<f64>();
                let columns = self.viscosity.as_slice().chunks_exact(places.len().max(1));
                self.load.iter_mut().zip(columns).for_each(|(load, column)| *load += along(column));
            }
        }
    }

    /// The guess of a stage on a smooth energy needs no comparison with its start: both are near each other beside the shapes of the training.
    fn is_near(&self, reduced: &ReducedShell) -> bool {
        let reach = reduced.polynomial.as_ref().map_or(0.0, |polynomial| polynomial.gate.reach);
        let way = sum_of(&self.next, &self.start, |next, start| (next - start).powi(2));
        way <= (NEAR * reach).powi(2)
    }

    /// Work of constraints in a stage.
    fn work_of_constraints(&self) -> f64 {
        let (rows, force) = (&self.rows, self.newton.multipliers());
        (0..rows.len()).map(|i| force[i] * (rows.along(i, &self.next) - rows.along(i, &self.from[0]))).sum()
    }

    /// The damping beside ξ at the start of the step, over a stage's `tau` seconds.
    fn set_viscosity(&mut self, reduced: &ReducedShell, tau: f64) -> Damped {
        let zeta = self.damping.stiffness;
        let modal = self.modal_damping.iter().any(|c| *c > 0.0);
        if zeta == 0.0 && self.by_vertices.is_none() {
            self.resistance.iter_mut().zip(&self.modal_damping).for_each(|(own, c)| *own = c / tau);
            return if modal { Damped::Modes } else { Damped::Not };
        }
        self.viscosity.fill(0.0);
        if zeta > 0.0 {
            reduced.elastic(self.form).viscosity(&self.motion.q, self.newton.scratch(), &mut self.viscosity);
            self.viscosity *= zeta;
        }
        if let Some(by_vertices) = &self.by_vertices {
            self.viscosity += &**by_vertices;
        }
        self.modal_damping.iter().enumerate().for_each(|(k, c)| self.viscosity[(k, k)] += c);
        self.viscosity /= tau;
        Damped::All
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// y' = λy, of one step.
    fn growth(z: Complex<f64>) -> Complex<f64> {
        let one = Complex::from(1.0);
        let first = one / (one - z * GAMMA);
        (one + (first - one) * ONWARD) / (one - z * GAMMA)
    }

    #[test]
    fn a_step_is_exact_to_second_order_and_takes_little_of_what_it_resolves() {
        for z in [Complex::new(0.0, 1e-2), Complex::new(-1e-2, 0.0), Complex::new(-6e-3, 8e-3)] {
            // By the series of R(z) eᶻ is missed by (1/6 − 3γ² + 2γ³) z³.
            let missed = (growth(z) - z.exp()).norm() / 1e-6;
            assert!((missed - 0.0404).abs() < 1e-3, "{z}: {missed}");
        }
        let theta = 0.1f64;
        let taken = 1.0 - growth(Complex::new(0.0, theta)).norm();
        assert!((taken * 270.0 / theta.powi(4) - 1.0).abs() < 0.02, "{taken}");
    }

    /// With λh along the imaginary axis and the negative real one.
    #[test]
    fn nothing_grows_that_does_not_grow_by_itself_and_what_is_stiff_dies_at_once() {
        for k in -30..=60 {
            let size = 10f64.powf(f64::from(k) / 10.0);
            for z in [Complex::new(0.0, size), Complex::new(-size, 0.0)] {
                assert!(growth(z).norm() <= 1.0 + 1e-15, "{z}");
                assert!(size < 100.0 || growth(z).norm() < 5.0 / size, "{z}"); // R → (1 − 2γ)/(γ²z)
            }
        }
    }
}

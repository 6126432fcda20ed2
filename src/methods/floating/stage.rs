//! A stage of a step of a floating shell: backward Euler from a place and momenta that are known.
//!
//!   q = q* + τq̇,  d = d* + τv,  R = R* exp τω,      π = π* + τ(∂T/∂q − ∇E + f − Cq̇ − ξπ),  L = L* + τ(torque − ξL)
//!
//! with π = q̇ + Hᵀω and L = R(Jω + Hq̇). The end is the minimum of a potential in coordinates about a guess, where the forces of spin, of
//! gravity on the turned body and the like are as at the guess; from its end the next pass takes them anew. In free flight the angular
//! momentum is known before: each pass begins by turning the frame to where it is met, so that it is kept to rounding.

use super::place::Rates;
use super::rows::Shares;
use super::{At, Floating, Room};
use crate::load::BodyLoad;
use crate::reduced::{Form, Joined, Potential, Stop, WithRigid};
use crate::{Vec3, rotation};
use nalgebra::Matrix3;

/// A step moves on at this, an energy of 1e-10 of what the loads do.
const STEP: Stop = Stop { tolerance: 1e-5, iterations: 20, led: false, near: false, least: 0.0 };
/// What a stage on a smooth energy may leave where it is not looked at.
const QUICK: f64 = 1.5e-4;
/// Passes of a stage, at most; and of what a stage moves, what a pass may leave as the last one.
const PASSES: usize = 12;
const ENOUGH: f64 = 1e-5;
/// The same of the root of the mass times the size, where nothing moves.
const NOTHING: f64 = 1e-11;
/// Rounds in which the spin that has a given angular momentum is found, and what one may change at last.
const SPINS: usize = 12;
const SPUN: f64 = 1e-15;
/// Rigid motion counts this much in the scale of a search: its energy says nothing of that of the fields.
const COUNTED: f64 = 1e-3;

/// A step of backward Euler within a step.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    /// Seconds.
    pub tau: f64,
    /// Where constraints are at its end, as a share of their way in the step.
    pub share: f64,
    /// The Hessian of the search before is near enough to begin with.
    pub near: bool,
    pub damped: bool,
}

impl Floating {
    /// Moves the next place from a guess to the end of a stage, and sets its rates. Returns whether the searches converged.
    pub(super) fn advance(&mut self, at: At, load: &BodyLoad, stage: Stage) -> bool {
        let mut converged = true;
        let size = at.shell.mesh.size * at.shell.total_mass.sqrt();
        for pass in 0..PASSES {
            self.take_forces(at, load, stage);
            self.set_guess(at);
            self.set_potential(at, stage);
            self.set_rows(at, Shares { hard: stage.share, soft: 1.0 });
            converged = self.search(at, stage, pass);
            let (bend, turn) = self.follow(at);
            let moved = self.began.q.iter().zip(&self.next.q).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            let change = libm::hypot(bend, turn);
            let spinning = 2.0 * stage.tau * self.next_rates.spin.norm() + 4.0 * change / size;
            let turned = if self.is_flying(at) { 0.0 } else { turn * turn / size };
            let left = f64::min(spinning, 1.0) * change + turned;
            if left <= ENOUGH * moved + NOTHING * size {
                break;
            }
        }
        self.take_forces(at, load, stage);
        converged
    }

    /// No constraint and no point holds it: its momenta are those of the loads alone.
    fn is_flying(&self, at: At) -> bool {
        let joined = at.points.map(|energy| Joined { energy, places: &self.points });
        self.rows.is_empty() && joined.is_none_or(|joined| joined.value(&self.room.z) == 0.0)
    }

    /// Rates from the stage's start to the next place, the moments and the loads there; in free flight the turn follows the angular momentum.
    fn take_forces(&mut self, at: At, load: &BodyLoad, stage: Stage) {
        let (tau, rigid) = (stage.tau, at.rigid);
        let Self { from, next, next_rates: rates, room, .. } = self;
        rates.q.iter_mut().zip(&next.q).zip(&from.q).for_each(|((rate, next), from)| *rate = (next - from) / tau);
        rates.slide = (next.slide - from.slide) / tau;
        rates.spin = rotation::vector(&(from.turn.inverse() * next.turn)) / tau;
        at.reduced.set_moments(rigid, (&next.q, &rates.q), &mut room.moments);
        self.take_pull(at, load);
        if self.is_flying(at) {
            self.fly(at, stage);
            self.take_pull(at, load);
        }
    }

    /// The loads at the next place.
    fn take_pull(&mut self, at: At, load: &BodyLoad) {
        let Room { pull, dead, moments, .. } = &mut self.room;
        pull.copy_from(dead);
        if let Some(spin) = load.parts().1 {
            pull.add_spin(at.rigid, spin, &self.next_rates.flight(&self.next), moments);
        }
    }

    /// Turns and slides the next place to where the loads alone bring the momenta.
    fn fly(&mut self, at: At, stage: Stage) {
        let (tau, rigid, kept) = (stage.tau, at.rigid, 1.0 / (1.0 + self.damping.mass * stage.tau));
        let Self { from, with, next, next_rates: rates, room, .. } = self;
        let turn = next.turn.to_rotation_matrix();
        let torque = -crate::reduced::crossed(&(room.pull.place(&next.q) * turn.matrix().transpose()));
        let momentum = kept * (with.spin + tau * rigid.along_turned(&next.turn, &torque));
        rates.spin = spin_of(at, (&(from.turn.inverse() * momentum), tau), &rates.spin, room);
        next.turn = from.turn;
        next.turn_by(&(tau * rates.spin));
        if rigid.slides {
            rates.slide = kept * (with.slide + (tau / rigid.mass) * room.pull.total);
            next.slide = from.slide + tau * rates.slide;
        }
    }

    /// z of the next place, from which coordinates go on, and of where the step began.
    fn set_guess(&mut self, at: At) {
        let Self { next, began, room, .. } = self;
        let n = next.q.len();
        let (turn, slide) = next.way_from(began);
        room.guess[..n].copy_from_slice(&next.q);
        at.rigid.coordinates(&turn, &slide, &mut room.start[n..]);
        for (guess, way) in room.guess[n..].iter_mut().zip(&mut room.start[n..]) {
            *guess = COUNTED * *way;
            *way = *guess - *way;
        }
        room.start[..n].copy_from_slice(&began.q);
        room.z.copy_from_slice(&room.guess);
    }

    /// The matrix and b of the potential at the guess.
    fn set_potential(&mut self, at: At, stage: Stage) {
        let (alpha, xi, rigid) = (1.0 / stage.tau, self.damping.mass, at.rigid);
        let Self { with, next, next_rates: rates, room, elsewhere, .. } = self;
        let Room { moments, pull, viscosity, matrix, load, guess, .. } = room;
        let (n, shift) = (next.q.len(), alpha * (alpha + xi));
        matrix.fill(0.0);
        if stage.damped {
            matrix.view_mut((0, 0), (n, n)).copy_from(viscosity);
            *matrix *= alpha;
        }
        rigid.add_mass(moments, shift, matrix);
        // Less the residual without ∇E.
        load.fill(0.0);
        let turn = next.turn.to_rotation_matrix();
        pull.add_along(rigid, &turn, &next.q, load);
        elsewhere.set(at, (next, rates), moments);
        for k in 0..n {
            let gained = alpha * (elsewhere.q[k] - with.q[k]) + xi * elsewhere.q[k];
            load[k] += moments.thrust(k, &rates.spin) - gained;
            if stage.damped {
                load[k] -= viscosity.column(k).iter().zip(&rates.q).map(|(c, rate)| c * rate).sum::<f64>();
            }
        }
        let torque = alpha * (elsewhere.spin - with.spin) + xi * elsewhere.spin;
        let force = rigid.mass * (alpha * (rates.slide - with.slide) + xi * rates.slide);
        rigid.add_force(&-(turn.inverse() * torque), &-(turn.inverse() * force), &mut load[n..]);
        for (k, load) in load.iter_mut().enumerate() {
            *load += shift * guess[k] + matrix.column(k).iter().zip(guess.iter()).map(|(a, z)| a * z).sum::<f64>();
        }
    }

    /// Moves z to the minimum of the potential. Returns whether the search converged.
    fn search(&mut self, at: At, stage: Stage, pass: usize) -> bool {
        let energy = WithRigid { energy: at.reduced.elastic(self.form), rigid: at.rigid.n() };
        if let Some(points) = at.points {
            self.body.take(at.shell, at.reduced, points.points());
            self.points.follow(&self.body, at.rigid, &self.next_rates.flight(&self.next), &self.room.guess);
        }
        let alpha = 1.0 / stage.tau;
        let constraints = (!self.rows.is_empty()).then_some(&self.rows);
        let joined = at.points.map(|energy| Joined { energy, places: &self.points });
        let Room { matrix, load, z, start, .. } = &mut self.room;
        let shift = alpha * (alpha + self.damping.mass);
        let potential = Potential { shift, matrix: Some(matrix), diagonal: None, load, constraints, joined };
        if pass == 0 && self.newton.is_lower(&energy, &potential, start, z) {
            z.copy_from_slice(start);
        }
        let quick = self.form == Form::Polynomial && constraints.is_none();
        let end = if quick { self.newton.approach(&energy, &potential, z, (QUICK, false)) } else { None };
        let near = (stage.near || pass > 0) && !quick;
        end.unwrap_or_else(|| self.newton.minimize(&energy, &potential, z, Stop { near, ..STEP })).converged
    }

    /// Moves the next place along z from the guess; how far in the fields and in the turn, normed by mass.
    fn follow(&mut self, at: At) -> (f64, f64) {
        let Self { next, room, .. } = self;
        let (n, rigid) = (next.q.len(), at.rigid);
        let squares = |k: usize| (room.z[k] - room.guess[k]).powi(2);
        let bend = (0..n).map(squares).sum::<f64>().sqrt();
        let turn = (n..n + rigid.axes.len()).map(squares).sum::<f64>().sqrt();
        (n..room.z.len()).for_each(|k| room.start[k] = room.z[k] - room.guess[k]);
        next.q.copy_from_slice(&room.z[..n]);
        next.slide += next.turn * rigid.slide(&room.start[n..]);
        next.turn_by(&rigid.turn(&room.start[n..]));
        (bend, turn)
    }
}

/// ω with Jω + Hq̇ = exp(−τω) l along what is free, l in the axes of the stage's start, by Newton's method from `spin`.
fn spin_of(at: At, (l, tau): (&Vec3, f64), spin: &Vec3, room: &Room) -> Vec3 {
    let (inertia, moments, rigid) = (room.moments.inertia(), &room.moments, at.rigid);
    if rigid.axes.len() == 1 {
        let axis = rigid.axes[0];
        return axis * ((l - moments.carried).dot(&axis) / axis.dot(&(inertia * axis)));
    }
    let mut spin = *spin;
    for _ in 0..SPINS {
        let here = rotation::by(&(-tau * spin)) * l;
        let slope: Matrix3<f64> = inertia - tau * here.cross_matrix();
        let Some(inverse) = slope.try_inverse() else { break };
        let change = inverse * (here - moments.carried - inertia * spin);
        spin += change;
        if change.norm() <= SPUN * spin.norm() {
            break;
        }
    }
    spin
}

impl Rates {
    /// Scales all.
    pub fn scale(&mut self, share: f64) {
        self.q.iter_mut().for_each(|rate| *rate *= share);
        self.slide *= share;
        self.spin *= share;
    }
}

//! The equilibrium of a floating shell: loads and constraints are led in shares, in rounds about the last place.
//!
//! Each round minimizes the potential about where it stands, with the curvature that forces have as the body turns (that of a pendulum), and a
//! pull back that fades from round to round: what nothing decides stays as it is. Where nothing holds the shell, what of the loads would set it
//! in motion is left to inertia, and it balances the rest where it is.

use super::place::Rates;
use super::rows::Shares;
use super::{At, Floating, Room};
use crate::methods::{Acting, Watch};
use crate::reduced::{Joined, Potential, Stop, WithRigid, crossed};
use crate::{Error, ErrorKind, Result, Vec3};
use nalgebra::Matrix3;

const REST: Stop = Stop { tolerance: 1e-7, iterations: 100, led: true, near: false, least: 0.0 };
/// Shares of the load that are added at once, at first and at least.
const FIRST_SHARE: f64 = 0.25;
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Rounds of a share, at most, and of all.
const ROUNDS: usize = 120;
const ALL_ROUNDS: usize = 1000;
/// How the pull back fades and grows, and to what parts of the forces' over the shell's size.
const FADING: f64 = 0.2;
const GROWING: f64 = 10.0;
const FADED: f64 = 1e-6;
const GROWN: f64 = 1e4;
/// Of the size, root mean square: what a round may move as the last one; of all and on the way.
const SETTLED: f64 = 1e-9;
const ROUGH: f64 = 1e-4;
/// A round turns by no more, rad.
const TURN: f64 = 0.5;

impl Floating {
    /// The static solution under the present loads and constraints, from the present place. Returns residual and rounds. Changes nothing on
    /// failure.
    pub(super) fn find_equilibrium(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        let (shell, reduced, rigid) = (self.shell.clone(), self.reduced.clone(), self.rigid.clone());
        let at = At::of(&shell, &reduced, &rigid, acting);
        let rates = Rates::rest(self.n());
        self.reduced.set_moments(&rigid, (&self.place.q, &rates.q), &mut self.room.moments);
        self.room.dead.set(&shell, &reduced, &rigid, acting.load, acting.external);
        if let Some(spin) = acting.load.parts().1 {
            self.room.dead.add_spin(&rigid, spin, &rates.flight(&self.place), &self.room.moments);
        }
        self.next.copy_from(&self.place);
        self.next_rates.copy_from(&rates);
        self.newton.forget_multipliers();
        let mut last = self.place.clone();
        let (mut done, mut way, mut rounds) = (0.0, FIRST_SHARE, 0);
        loop {
            let share = f64::min(done + way, 1.0);
            let (found, residual, more) = self.balance(at, share);
            rounds += more;
            watch(residual)?;
            let found = found && self.is_within_range(&self.next, &rates);
            if found && share == 1.0 {
                self.record_outcomes(at);
                self.place.copy_from(&self.next);
                self.rates.copy_from(&rates);
                self.estimate.forget();
                self.constraints.accept(0.0);
                return Ok((residual, rounds));
            }
            if found {
                last.copy_from(&self.next);
                (done, way) = (share, (2.0 * way).min(FIRST_SHARE));
            } else if way > LEAST_SHARE && rounds < ALL_ROUNDS {
                self.next.copy_from(&last);
                way = 0.5 * (share - done);
            } else {
                let message = format!("no equilibrium: the shell still moves after {rounds} rounds");
                return Err(Error::new(ErrorKind::Numerical, message));
            }
        }
    }

    /// Moves the next place to where this share of the load is balanced. Returns whether it is, the residual, and the rounds.
    fn balance(&mut self, at: At, share: f64) -> (bool, f64, usize) {
        let size = at.shell.mesh.size * at.shell.total_mass.sqrt();
        let enough = size * if share < 1.0 { ROUGH } else { SETTLED };
        let (mut shift, mut residual) = (f64::INFINITY, 0.0);
        for round in 0..ROUNDS {
            let strength = self.set_balance(at, share);
            let least = FADED * strength;
            shift = shift.clamp(least, if round == 0 { strength } else { GROWN * strength });
            let (converged, left, moved) = self.settle_round(at, share, shift);
            residual = left;
            if converged && moved <= enough && shift <= least {
                return (true, residual, round + 1);
            }
            shift *= if converged { FADING } else { GROWING };
        }
        (false, residual, ROUNDS)
    }

    /// Loads and their curvature about the next place, as this share of them; how strongly they pull, as a frequency squared.
    fn set_balance(&mut self, at: At, share: f64) -> f64 {
        let (rigid, n) = (at.rigid, self.next.q.len());
        let lowest = self.basis.eigenvalues[self.basis.zero_modes];
        at.reduced.set_moments(rigid, (&self.next.q, &self.next_rates.q), &mut self.room.moments);
        self.set_static_guess();
        let turn = self.next.turn.to_rotation_matrix();
        let free = rigid.slides && self.rows.is_empty() && at.points.is_none();
        let Self { room, next, rows, constraints, newton, .. } = self;
        let Room { moments, pull, dead, matrix, load, .. } = room;
        pull.copy_from(dead);
        pull.scale(share);
        load.fill(0.0);
        pull.add_along(rigid, &turn, &next.q, load);
        let strength = load.iter().map(|f| f * f).sum::<f64>().sqrt();
        matrix.fill(0.0);
        if free {
            let relief = rigid.relief(moments, &load[n..]);
            (0..n).for_each(|k| load[k] -= relief.dot(&moments.arm(k)));
            load[n..].fill(0.0);
        } else {
            // What pulls the body turns with it.
            let to_frame = at.pose.rotation.inverse();
            let held: Vec<_> = constraints.report().map(|(c, _)| *c).collect();
            let force: Vec<f64> = newton.multipliers().iter().copied().collect();
            for (v, force) in Self::pulls(rows, &held, &force, &to_frame) {
                pull.add_at(at.reduced, (at.shell.mesh.positions[v as usize] - rigid.pivot, v as usize), &force);
            }
            let back = turn.matrix().transpose();
            let placed = back * pull.place(&next.q);
            let curved = Matrix3::identity() * placed.trace() - 0.5 * (placed + placed.transpose());
            let fields = |k: usize| crossed(&(back * pull.fields[k]));
            rigid.add_curvature(&curved, fields, matrix);
        }
        let size = at.shell.mesh.size * at.shell.total_mass.sqrt();
        if strength > 0.0 { strength / size } else { lowest }
    }

    /// z of the next place: of the fields, and 0 of rigid motion.
    fn set_static_guess(&mut self) {
        let n = self.next.q.len();
        let Room { guess, z, .. } = &mut self.room;
        guess[..n].copy_from_slice(&self.next.q);
        guess[n..].fill(0.0);
        z.copy_from_slice(guess);
    }

    /// One round. Returns whether its search converged and all of it was gone, its residual, and how far it moved, normed by mass.
    fn settle_round(&mut self, at: At, share: f64, shift: f64) -> (bool, f64, f64) {
        let (rigid, n) = (at.rigid, self.next.q.len());
        self.set_rows(at, Shares { hard: share, soft: share });
        if let Some(points) = at.points {
            self.body.take(at.shell, at.reduced, points.points());
            self.points.follow(&self.body, rigid, &self.next_rates.flight(&self.next), &self.room.guess);
        }
        let energy = WithRigid { energy: at.reduced.elastic(self.form), rigid: rigid.n() };
        let constraints = (!self.rows.is_empty()).then_some(&self.rows);
        let joined = at.points.map(|energy| Joined { energy, places: &self.points });
        let Room { matrix, load, z, guess, .. } = &mut self.room;
        for (k, load) in load.iter_mut().enumerate() {
            *load += shift * guess[k] + matrix.column(k).iter().zip(guess.iter()).map(|(a, z)| a * z).sum::<f64>();
        }
        let potential = Potential { shift, matrix: Some(matrix), diagonal: None, load, constraints, joined };
        let end = self.newton.minimize(&energy, &potential, z, REST);
        let way: Vec<f64> = z.iter().zip(guess.iter()).map(|(z, guess)| z - guess).collect();
        let moved = way.iter().map(|way| way * way).sum::<f64>().sqrt();
        let turn: Vec3 = rigid.turn(&way[n..]);
        let whole = turn.norm() <= TURN;
        let part = if whole { 1.0 } else { TURN / turn.norm() };
        self.next.q.iter_mut().zip(&way).for_each(|(q, way)| *q += part * way);
        self.next.slide += self.next.turn * (part * rigid.slide(&way[n..]));
        self.next.turn_by(&(part * turn));
        (end.converged && whole, end.residual, moved)
    }
}

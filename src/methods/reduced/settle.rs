//! The equilibrium of the reduced shell: the load and constraints are led in shares, orientations in rounds about the last shape.

use super::rows::Shares;
use super::{At, Reduced};
use crate::methods::{Acting, Watch};
use crate::reduced::{End, Joined, Potential, Stop};
use crate::{Error, ErrorKind, Result};
use nalgebra::DVector;

const REST: Stop = Stop { tolerance: 1e-7, iterations: 200, led: true, near: false, least: 0.0 };
/// Of the way's shapes; and so near to the end a search that has not ended goes on from where it is.
const CLOSE: f64 = 1e-3;
/// Shares of the load that are added at once on the way to an equilibrium, at first and at least.
const FIRST_SHARE: f64 = 0.25;
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Newton steps for all shares; none is tried with a smaller one past them.
const ALL_ITERATIONS: usize = 1000;
/// Of the shell's size: what a shell without load may be off its rest, as its slowest mode. The last step takes most of that.
const UNSEEN: f64 = 1e-9;
/// Rounds about the last shape for the orientations of an equilibrium; they converge quadratically.
const ROUNDS: usize = 30;
/// Of the round before, what a round moves at least where it gains nothing. And of the displacement and in rad, what rounding of the
/// fields' numbers leaves of an equilibrium with orientations: 1e-7 of 32 bits by the size of the shell over that of a triangle and the
/// stiffness of its sheet over that of its bending, at most.
const STALLED: f64 = 0.5;
const ROUNDED: f64 = 1e-4;

/// What the terms of Π are taken for where they are less. Under a load they are those at rest. Without one they all vanish there, and what is left is
/// told by the start, or by the shell's own stiffness.
struct Still {
    least: f64,
    /// By the shell's own stiffness, where nothing loads it; not taken yet.
    own: f64,
}

impl Still {
    /// Of what is set to act, and ∇E at the start.
    fn of(reduced: &Reduced, at: At, start: &[f64]) -> Self {
        if at.points.is_some() || reduced.force.iter().any(|f| *f != 0.0) {
            return Self { least: 0.0, own: 0.0 };
        }
        let basis = &reduced.basis;
        let slowest = basis.eigenvalues.get(basis.zero_modes).copied().unwrap_or(0.0);
        let unseen = UNSEEN * at.shell.mesh.size / REST.tolerance;
        let own = slowest * at.shell.total_mass * unseen * unseen;
        if !reduced.constraints.is_empty() {
            return Self { least: 0.0, own }; // they may be led far, and then Π's terms tell
        }
        let at_start: f64 = reduced.motion.q.iter().zip(start).map(|(q, g)| (q * g).abs()).sum();
        Self { least: own.max(at_start), own: 0.0 }
    }

    /// Whether the shell's own measure was not tried yet; it is taken now.
    fn take_own(&mut self) -> bool {
        self.least = self.own;
        std::mem::take(&mut self.own) > 0.0
    }
}

impl Reduced {
    /// The static solution under the present loads and constraints, from the present shape; what depends on the shape is taken as there.
    /// Returns residual and iterations. Changes nothing on failure.
    pub(super) fn find_equilibrium(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        let (shell, reduced) = (self.shell.clone(), self.reduced.clone());
        let at = At::of(&shell, &reduced, acting);
        self.take_places(at);
        self.set_force(acting);
        if let Some((gradient, coriolis)) = acting.load.parts().1 {
            reduced.add_spin(gradient, coriolis, (&self.motion.q, &self.motion.q_dot), &mut self.force);
        }
        self.next.copy_from_slice(&self.motion.q);
        reduced.elastic(self.form).gradient(&self.motion.q, self.newton.scratch(), &mut self.rates);
        if let Some(energy) = at.points {
            Joined { energy, places: &self.places }.add_gradient(&self.motion.q, &mut self.rates);
        }
        let start = self.rates.clone();
        let mut still = Still::of(self, at, &start);
        self.last.copy_from_slice(&self.next);
        let (mut done, mut way, mut iterations) = (0.0, FIRST_SHARE, 0);
        let mut torque = DVector::zeros(self.rows.len());
        let mut last_torque = torque.clone();
        loop {
            let share = f64::min(done + way, 1.0);
            (0..start.len()).for_each(|k| self.load[k] = start[k] + share * (self.force[k] - start[k]));
            let end = self.balance(at, (share, still.least), &mut torque);
            iterations += end.iterations;
            watch(end.residual)?;
            let within = self.is_within_range(&self.next, &[]);
            let found = end.converged && within;
            if found && share == 1.0 {
                self.record_outcomes(at);
                self.motion.q.copy_from_slice(&self.next);
                self.motion.q_dot.fill(0.0);
                self.estimate.forget();
                self.constraints.accept(0.0);
                return Ok((end.residual, iterations));
            }
            if found {
                self.last.copy_from_slice(&self.next);
                last_torque.copy_from(&torque);
                (done, way) = (share, (2.0 * way).min(FIRST_SHARE));
            } else if within
                && share == 1.0
                && end.residual <= CLOSE
                && iterations < ALL_ITERATIONS
                && end.iterations > 0
            {
                // Along a valley that is nearly flat, as of a shell about to buckle to either side, 200 steps do not do.
            } else if way > LEAST_SHARE && iterations < ALL_ITERATIONS {
                self.next.copy_from_slice(&self.last);
                torque.copy_from(&last_torque);
                way = 0.5 * (share - done);
            } else if still.take_own() {
                self.next.copy_from_slice(&self.last);
                torque.copy_from(&last_torque);
                (iterations, way) = (0, FIRST_SHARE);
            } else {
                let message =
                    format!("no equilibrium: the residual is {:.1e} after {iterations} iterations", end.residual);
                return Err(Error::new(ErrorKind::Numerical, message));
            }
        }
    }

    /// Moves the next q to where the load is balanced, with constraints led by this share of their way: in rounds until orientations
    /// are held. Π's terms are taken for `least` where they are less. `torque` are the forces of constraints at the balance before, and then at this one.
    fn balance(&mut self, at: At, (share, least): (f64, f64), torque: &mut DVector<f64>) -> End {
        let turned = self.holds_orientations();
        let stop = Stop { tolerance: if share < 1.0 { CLOSE } else { REST.tolerance }, least, ..REST };
        let (mut iterations, mut last_moved) = (0, f64::INFINITY);
        let mut end = End { converged: false, iterations: 0, residual: 0.0 };
        for _ in 0..ROUNDS {
            let before = self.next.clone();
            end = self.balance_about(at, Shares::of_load(share), torque, stop);
            iterations += end.iterations;
            let [moved, size] = [Some(&before), None].map(|from| {
                let part = |k: usize| self.next[k] - from.map_or(0.0, |from| from[k]);
                (0..self.next.len()).map(|k| part(k).powi(2)).sum::<f64>().sqrt()
            });
            // Rounding of the fields' numbers ends what rounds gain; one that gains nothing before is taken half the way.
            let stalled = moved > STALLED * last_moved;
            let ended = stalled && moved <= ROUNDED * size && {
                self.set_rows(at, Shares::of_load(share));
                self.missing_turn_of_rows() <= ROUNDED
            };
            let changed = turned && moved > stop.tolerance * size && !ended;
            if !changed || !end.converged {
                return End { iterations, ..end };
            }
            if stalled {
                self.next.iter_mut().zip(&before).for_each(|(next, before)| *next = 0.5 * (*next + before));
            }
            last_moved = moved;
        }
        End { converged: false, iterations, ..end }
    }

    /// One round: orientations to first order about the next q, with their curvature under the last round's torques (Robinson 1972).
    /// Without it a round gains nothing where these are as stiff as the shell.
    fn balance_about(&mut self, at: At, shares: Shares, torque: &mut DVector<f64>, stop: Stop) -> End {
        let turned = self.holds_orientations();
        let mut load = DVector::from_column_slice(&self.load);
        if turned {
            self.set_curvature(at, shares, torque);
            load.gemv(1.0, &self.viscosity, &DVector::from_column_slice(&self.next), 1.0);
        }
        self.set_rows(at, shares);
        let constraints = (!self.rows.is_empty()).then_some(&self.rows);
        let matrix = turned.then_some(&self.viscosity);
        let joined = at.points.map(|energy| Joined { energy, places: &self.places });
        let potential = Potential { constraints, matrix, joined, ..Potential::of_load(load.as_slice()) };
        let end = self.newton.minimize(at.reduced.elastic(self.form), &potential, &mut self.next, stop);
        torque.copy_from(self.newton.multipliers());
        end
    }
}

//! The search for a minimum that need not be near.

use super::super::elastic::Elastic;
use super::{End, Newton, Potential, ROUNDING, Stop, TRIALS};

/// Sufficient decrease, as a share of the slope's promise.
const DECREASE: f64 = 1e-4;
/// Steps in a row that may leave Π above the mark.
const VENTURES: usize = 2;
/// Of a residual, what a step with the last Hessian leaves at most; it costs about a tenth of one with a new Hessian.
const CHORD: f64 = 0.2;

/// Where a search stands.
struct Descent {
    /// Π, its slope and the residual at the mark, the last iterate that Π fell to.
    value: f64,
    slope: f64,
    at_mark: f64,
    /// Steps since.
    ventures: usize,
    residual: f64,
    /// Whether the last Hessian is near enough.
    near: bool,
    /// ρ that Π at the mark goes by.
    penalty: f64,
}

impl Descent {
    fn new(near: bool) -> Self {
        let none = f64::INFINITY;
        Self { value: none, slope: 0.0, at_mark: none, ventures: 0, residual: none, near, penalty: 0.0 }
    }
}

impl Newton {
    /// Moves `q` to a minimum, or as far as steps lower Π.
    pub(super) fn descend(&mut self, energy: &dyn Elastic, potential: &Potential, q: &mut [f64], stop: Stop) -> End {
        let mut way = Descent::new(stop.near);
        self.penalty = 0.0;
        if let Some(rows) = potential.constraints {
            self.find_goal(rows);
        }
        for iterations in 0..stop.iterations {
            let before = way.residual;
            let Some(slope) = self.turn(energy, potential, q, (stop, &mut way)) else {
                if way.ventures > 0 {
                    q.copy_from_slice(&self.mark);
                }
                return End { converged: false, iterations, residual: before };
            };
            self.step(q);
            if stop.led && iterations == 0 && self.is_off(potential) && self.trial_merit(energy, potential).is_finite()
            {
                q.copy_from_slice(&self.trial);
                continue;
            }
            if way.residual <= stop.tolerance && (way.ventures == 0 || self.merit(energy, potential, q) <= way.value) {
                q.copy_from_slice(&self.trial);
                return End { converged: true, iterations: iterations + 1, residual: way.residual };
            }
            if way.ventures == 0 {
                (way.value, way.slope, way.at_mark) = (self.merit(energy, potential, q), slope, way.residual);
                self.mark.copy_from_slice(q);
                self.mark_direction.copy_from(&self.direction);
            }
            let value = self.trial_merit(energy, potential);
            if value <= way.value + DECREASE * way.slope {
                way.near = !stop.led && self.exact && way.ventures == 0;
                way.ventures = 0;
            } else if way.near {
                (way.near, way.residual) = (false, before);
                continue;
            } else if self.exact && way.ventures < VENTURES && value.is_finite() && iterations + 1 < stop.iterations {
                way.ventures += 1;
            } else if let Some(converged) = self.search_from_mark(energy, potential, q, &mut way) {
                return End { converged, iterations: iterations + 1, residual: way.at_mark };
            }
            q.copy_from_slice(&self.trial);
        }
        End { converged: false, iterations: stop.iterations, residual: way.residual }
    }

    /// Finds a direction, with the last Hessian where that gains enough; its slope.
    fn turn(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &[f64],
        (stop, way): (Stop, &mut Descent),
    ) -> Option<f64> {
        let of = |(slope, scale): (f64, f64)| (-slope / scale.max(stop.least)).max(0.0).sqrt();
        let mut found = self.find_direction(energy, potential, q, way.near);
        if way.near && found.is_none_or(|found| of(found) > (CHORD * way.residual).max(stop.tolerance)) {
            way.near = false;
            found = self.find_direction(energy, potential, q, way.near);
        }
        let found = found?;
        way.residual = of(found);
        if way.ventures > 0 && self.penalty > way.penalty {
            let at_mark = std::mem::take(&mut self.mark);
            way.value = self.merit(energy, potential, &at_mark);
            self.mark = at_mark;
        }
        way.penalty = self.penalty;
        Some(found.0)
    }

    /// Takes `q` back to the mark and the trial from there to less Π. Where there is none it ends, converged or not, or goes the whole step
    /// over a wall, if it is not past one.
    fn search_from_mark(
        &mut self,
        energy: &dyn Elastic,
        potential: &Potential,
        q: &mut [f64],
        way: &mut Descent,
    ) -> Option<bool> {
        q.copy_from_slice(&self.mark);
        way.ventures = 0;
        if self.search(energy, potential, q, (way.value, way.slope)) {
            return None;
        }
        let converged = way.at_mark <= ROUNDING;
        if converged || !self.has_landed(energy, potential, q) {
            return Some(converged);
        }
        self.leapt = true;
        self.wall.copy_from_slice(q);
        (0..q.len()).for_each(|k| self.trial[k] = q[k] + self.mark_direction[k]);
        None
    }

    /// From the mark at `q` along its direction to a sufficient decrease; false when there is none.
    fn search(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64], (value, slope): (f64, f64)) -> bool {
        let mut alpha = 1.0;
        for _ in 0..TRIALS {
            for k in 0..q.len() {
                self.trial[k] = q[k] + alpha * self.mark_direction[k];
            }
            let change = self.trial_merit(energy, potential) - value;
            if change <= DECREASE * alpha * slope {
                return true;
            }
            let parabola = -0.5 * slope * alpha * alpha / (change - slope * alpha);
            alpha = if parabola.is_finite() { parabola.clamp(0.1 * alpha, 0.5 * alpha) } else { 0.1 * alpha };
        }
        self.trial.copy_from_slice(q);
        false
    }

    /// Whether Π is below that at the wall, if there was one.
    pub(super) fn has_landed(&mut self, energy: &dyn Elastic, potential: &Potential, q: &[f64]) -> bool {
        if self.leapt {
            let wall = std::mem::take(&mut self.wall);
            self.leapt = self.merit(energy, potential, q) > self.merit(energy, potential, &wall);
            self.wall = wall;
        }
        !self.leapt
    }
}

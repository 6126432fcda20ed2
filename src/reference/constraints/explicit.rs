//! Constraints after an explicit step: positions are set, orientations met by the impulses M⁻¹ Jᵀ h²T of SHAKE (Ryckaert, Ciccotti
//! and Berendsen 1977) on the vertices around, springs taken at the end of the step.

use super::Constraints;
use crate::Vec3;
use crate::constraint::Outcome;
use crate::point_energy::PointEnergy;
use nalgebra::Matrix3;

/// Sweeps over orientations, which share vertices, until all are met to this, rad.
const SWEEPS: usize = 30;
const MET: f64 = 1e-10;

/// The largest turn at once, rad: the derivative is trusted no further.
const MAX_TURN: f64 = 0.5;

impl Constraints {
    /// Moves the free ends `x` of a step of `h` to where the constraints have them, and fills `force` with what that takes (n_vertices
    /// each).
    pub fn lead(&mut self, x: &mut [Vec3], mass: &[f64], h: f64, force: &mut [Vec3]) -> Vec<Outcome> {
        let free = x.to_vec();
        for (s, v) in self.springs.points().iter().map(|point| point.vertices()[0] as usize).enumerate() {
            let pull = self.springs.force(s, &x[v]);
            let matrix = Matrix3::identity() * (mass[v] / (h * h)) + self.springs.list[s].stiffness;
            let left = self.supported(v as u32);
            let matrix = match left == Matrix3::identity() {
                true => matrix,
                false => left * matrix * left + (Matrix3::identity() - left) * (mass[v] / (h * h)),
            };
            x[v] += matrix.try_inverse().unwrap_or_else(Matrix3::zeros) * (left * pull);
        }
        self.place_holds(x);
        for _ in 0..SWEEPS {
            let lacking = (0..self.turns.len()).map(|t| self.turn_once(t, x, mass, h)).fold(0.0, f64::max);
            if lacking <= MET {
                break;
            }
        }
        for v in 0..x.len() {
            force[v] = (x[v] - free[v]) * (mass[v] / (h * h));
        }
        self.list.iter().zip(&self.parts).map(|(constraint, part)| self.outcome(constraint, *part, x, force)).collect()
    }

    /// One Newton step of an orientation; what it lacked before.
    fn turn_once(&mut self, t: usize, x: &mut [Vec3], mass: &[f64], h: f64) -> f64 {
        let turn = &self.turns[t];
        let (missing, by_vertex) = turn.derivative(&turn.ring.gather(x), self.share);
        let lacks = turn.only_held(self.axes.tr_mul(&missing) - turn.compliance * turn.torque);
        let gives = |v: u32| if self.moves[v as usize] { h * h / mass[v as usize] } else { 0.0 };
        let mut response = Matrix3::from_diagonal_element(turn.compliance);
        for (&v, by) in turn.ring.vertices.iter().zip(&by_vertex) {
            let along = self.axes.tr_mul(&(by * self.left_free(v)));
            response += gives(v) * along * along.transpose();
        }
        for a in (0..3).filter(|a| !turn.held[*a]) {
            response.row_mut(a).fill(0.0);
            response.column_mut(a).fill(0.0);
            response[(a, a)] = 1.0;
        }
        let Some(inverse) = response.try_inverse() else { return 0.0 };
        let step = turn.only_held(inverse * lacks) * (MAX_TURN / lacks.norm().max(MAX_TURN));
        if !step.iter().all(|t| t.is_finite()) {
            return 0.0; // supports hold all that it could move
        }
        for (&v, by) in turn.ring.vertices.iter().zip(&by_vertex) {
            x[v as usize] += gives(v) * (self.left_free(v) * by.tr_mul(&(self.axes * step)));
        }
        self.turns[t].torque += step;
        lacks.amax()
    }
}

//! The constraints' part of the potential: its energy, its gradient and its Hessian.

use super::{Constraints, PULL, Turn};
use crate::Vec3;
use crate::energy::{Curvature, ElementHessian};
use crate::point_energy::PointEnergy;
use crate::sparse::{BlockMatrix, Columns};
use nalgebra::Matrix3;

/// Step of differences, in edges: their truncation is its square, their rounding 1e-16 over it.
const DIFFERENCE: f64 = 1e-5;

impl Constraints {
    /// Energy of the constraints at `x`.
    pub fn value(&self, x: &[Vec3]) -> f64 {
        let mut sum = self.springs.value(x);
        for turn in &self.turns {
            let missing = turn.missing(turn.present(x), self.share);
            sum += 0.5 * self.torque(turn, &missing).norm_squared() / self.stiffness(turn);
        }
        for hold in self.holds.iter().filter(|_| self.pulling) {
            let d = self.place(hold) - x[hold.vertex as usize];
            sum += 0.5 * PULL * hold.stiffness * (d - hold.free * d).norm_squared();
        }
        sum
    }

    /// Force of an orientation on its ring at positions `x` of that, by its own torque or one that is given.
    fn pulls(&self, turn: &Turn, x: &[Vec3], given: Option<Vec3>) -> Vec<Vec3> {
        let (missing, by_vertex) = turn.derivative(x, self.share);
        let torque = self.axes * given.unwrap_or_else(|| self.torque(turn, &missing));
        by_vertex.iter().map(|by| by.tr_mul(&torque)).collect()
    }

    /// Adds its gradient.
    pub fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.springs.add_gradient(x, gradient);
        for turn in &self.turns {
            let pulls = self.pulls(turn, &turn.ring.gather(x), None);
            turn.ring.vertices.iter().zip(pulls).for_each(|(v, pull)| gradient[*v as usize] -= pull);
        }
        for hold in self.holds.iter().filter(|_| self.pulling) {
            let d = self.place(hold) - x[hold.vertex as usize];
            gradient[hold.vertex as usize] -= PULL * hold.stiffness * (d - hold.free * d);
        }
    }

    /// Leaves of a gradient what hard positions do not take.
    pub fn project(&self, gradient: &mut [Vec3]) {
        for hold in self.holds.iter().filter(|_| !self.pulling) {
            gradient[hold.vertex as usize] = hold.free * gradient[hold.vertex as usize];
        }
    }

    /// Adds of an element's blocks, row by row, what hard positions do not take.
    #[inline(always)]
    pub fn add_blocks(&self, (vertices, blocks): ElementHessian, columns: &mut Columns) {
        let block = |p: usize, q: usize| &blocks[p * vertices.len() + q];
        match self.holds[..] {
            [] => columns.add_element(vertices, block),
            _ => columns.add_element(vertices, |p, q| self.projected(vertices[p], *block(p, q), vertices[q])),
        }
    }

    /// Leaves of an element's block between vertices `v` and `w` what hard positions do not take.
    pub fn projected(&self, v: u32, block: Matrix3<f64>, w: u32) -> Matrix3<f64> {
        match (self.hold_of(v), self.hold_of(w)) {
            _ if self.pulling => block,
            (None, None) => block,
            (row, column) => {
                let rows = row.map_or(block, |hold| hold.free * block);
                column.map_or(rows, |hold| rows * hold.free)
            }
        }
    }

    /// Adds the second derivative, for a semidefinite one without that of m, and fills what hard positions leave empty. Where `torques` are given, of each
    /// orientation in turn, they take the place of those at `x`.
    pub fn add_hessian(&self, x: &[Vec3], curvature: Curvature, torques: &[f64], matrix: &mut BlockMatrix) {
        self.add_points(&self.springs, x, curvature, matrix);
        let mut given = torques.chunks_exact(3).map(Vec3::from_column_slice);
        for turn in &self.turns {
            let vertices = &turn.ring.vertices;
            let block = self.turn_hessian(turn, turn.ring.gather(x), curvature, given.next());
            matrix.add_element(vertices, |p, q| self.projected(vertices[p], block(p, q), vertices[q]));
        }
        for hold in &self.holds {
            let taken = Matrix3::identity() - hold.free;
            let stiffness = if self.pulling { PULL * hold.stiffness } else { hold.stiffness };
            matrix.add_element(&[hold.vertex], |_, _| stiffness * taken);
        }
    }

    /// Adds the second derivative of an energy of points.
    pub fn add_points(&self, points: &dyn PointEnergy, x: &[Vec3], curvature: Curvature, matrix: &mut BlockMatrix) {
        for (i, point) in points.points().iter().enumerate() {
            let hessian = points.hessian_at(i, &point.place(|v| x[v]), curvature);
            let (vertices, weights) = (point.vertices(), point.weights());
            let block = |p: usize, q: usize| weights[p] * weights[q] * hessian;
            matrix.add_element(vertices, |p, q| self.projected(vertices[p], block(p, q), vertices[q]));
        }
    }

    /// The blocks of an orientation at positions `x` of its ring: k (∂m/∂x)ᵀ ∂m/∂x, and the curvature of m with the torque that is given; or both by
    /// differences of the force.
    fn turn_hessian(
        &self,
        turn: &Turn,
        mut x: Vec<Vec3>,
        curvature: Curvature,
        given: Option<Vec3>,
    ) -> impl Fn(usize, usize) -> Matrix3<f64> {
        let n = x.len();
        let mut blocks = vec![Matrix3::zeros(); n * n];
        if curvature == Curvature::Semidefinite || given.is_some() {
            let held = Matrix3::from_diagonal(&turn.only_held(Vec3::repeat(1.0)));
            let stiffness = self.stiffness(turn) * self.axes * held * self.axes.transpose();
            let by_vertex = turn.derivative(&x, self.share).1;
            (0..n * n).for_each(|k| blocks[k] = by_vertex[k / n].tr_mul(&(stiffness * by_vertex[k % n])));
        }
        if curvature == Curvature::Exact {
            let step = DIFFERENCE * (1..n).map(|i| (x[i] - x[0]).norm()).sum::<f64>() / n as f64;
            for q in 0..n {
                for axis in 0..3 {
                    let place = x[q][axis];
                    x[q][axis] = place + step;
                    let after = self.pulls(turn, &x, given);
                    x[q][axis] = place - step;
                    let before = self.pulls(turn, &x, given);
                    x[q][axis] = place;
                    for p in 0..n {
                        let column = blocks[p * n + q].column(axis) + (before[p] - after[p]) / (2.0 * step);
                        blocks[p * n + q].set_column(axis, &column);
                    }
                }
            }
        }
        move |p, q| 0.5 * (blocks[p * n + q] + blocks[q * n + p].transpose())
    }
}

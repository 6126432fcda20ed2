//! Handles as springs beside an energy of points.

use crate::Vec3;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use nalgebra::Matrix3;

/// A handle as a spring, with the force that it had last on top.
#[derive(Clone, Copy)]
pub struct Spring {
    /// Where its vertex is to be, frame axes.
    pub target: Vec3,
    /// Projects onto the directions that it holds.
    pub held: Matrix3<f64>,
    /// Of the handle, m/N.
    pub compliance: f64,
    /// k.
    pub stiffness: f64,
    /// On the handle.
    pub force: Vec3,
}

impl Spring {
    /// Without a force; `stiffness` decides how fast the handle is met, not where.
    pub fn new(target: Vec3, held: Matrix3<f64>, compliance: f64) -> Self {
        Self { target, held, compliance, stiffness: 0.0, force: Vec3::zeros() }
    }

    /// The stiffness of both springs in a row.
    fn joint_stiffness(&self) -> f64 {
        (self.compliance + self.stiffness.recip()).recip()
    }

    /// The force with the vertex at `p`.
    pub fn pull(&self, p: &Vec3) -> Vec3 {
        self.joint_stiffness() * (self.held * (p - self.target) + self.force / self.stiffness)
    }
}

/// An energy of points and handles as springs in one: the augmented Lagrangian (Hestenes, Powell 1969).
pub struct Joint<'a> {
    pub energy: &'a dyn PointEnergy,
    /// Of the energy and then of the springs.
    pub points: &'a [Point],
    pub springs: &'a [Spring],
}

impl Joint<'_> {
    fn spring(&self, i: usize) -> Option<&Spring> {
        self.springs.get(i.wrapping_sub(self.points.len() - self.springs.len()))
    }
}

impl PointEnergy for Joint<'_> {
    fn points(&self) -> &[Point] {
        self.points
    }

    fn value_at(&self, i: usize, p: &Vec3) -> f64 {
        let value = |spring: &Spring| 0.5 * spring.pull(p).norm_squared() / spring.joint_stiffness();
        self.spring(i).map_or_else(|| self.energy.value_at(i, p), value)
    }

    fn gradient_at(&self, i: usize, p: &Vec3) -> Vec3 {
        self.spring(i).map_or_else(|| self.energy.gradient_at(i, p), |spring| spring.pull(p))
    }

    fn hessian_at(&self, i: usize, p: &Vec3, curvature: Curvature) -> Matrix3<f64> {
        let hessian = |spring: &Spring| spring.joint_stiffness() * spring.held;
        self.spring(i).map_or_else(|| self.energy.hessian_at(i, p, curvature), hessian)
    }
}

//! Soft positions, ½(d − x)ᵀK(d − x): a [`PointEnergy`] like any that joins the shell.

use crate::Vec3;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use nalgebra::Matrix3;

/// One of them.
pub(super) struct Spring {
    /// K: Σ d dᵀ/γ.
    pub(super) stiffness: Matrix3<f64>,
    /// Where to, and where the vertex was at the start.
    pub(super) place: Vec3,
    pub(super) start: Vec3,
}

/// All of them.
pub(super) struct Springs {
    points: Vec<Point>,
    pub(super) list: Vec<Spring>,
    /// How much of the way from the start to the place is asked for.
    pub(super) share: f64,
}

impl Springs {
    /// No springs.
    pub(super) fn none() -> Self {
        Self { points: vec![], list: vec![], share: 1.0 }
    }

    /// Adds one; returns its number.
    pub(super) fn push(&mut self, vertex: u32, spring: Spring) -> usize {
        self.points.push(Point::vertex(vertex));
        self.list.push(spring);
        self.list.len() - 1
    }

    /// d − x.
    fn missing(&self, i: usize, x: &Vec3) -> Vec3 {
        self.list[i].start.lerp(&self.list[i].place, self.share) - x
    }

    /// The force of one on its vertex at `x`.
    pub(super) fn force(&self, i: usize, x: &Vec3) -> Vec3 {
        self.list[i].stiffness * self.missing(i, x)
    }
}

impl PointEnergy for Springs {
    fn points(&self) -> &[Point] {
        &self.points
    }

    fn value_at(&self, i: usize, x: &Vec3) -> f64 {
        let d = self.missing(i, x);
        0.5 * d.dot(&(self.list[i].stiffness * d))
    }

    fn gradient_at(&self, i: usize, x: &Vec3) -> Vec3 {
        -self.force(i, x)
    }

    fn hessian_at(&self, i: usize, _: &Vec3, _: Curvature) -> Matrix3<f64> {
        self.list[i].stiffness
    }
}

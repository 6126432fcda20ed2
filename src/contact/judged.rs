//! Contacts that follow their solids: the energy by which the full shell judges a pose.
//!
//!   W(p) = max(0, λ + k d)²/2k,   d = d₀ − g(p),   d₀ the gap at the pose that is judged where λ > 0, else 0,
//!
//! with the gap g itself in the place of a half-space. Friction is as of [`super::Pressed`].

use super::{Obstacle, Pressed};
use crate::Vec3;
use crate::collider::Touch;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use nalgebra::Matrix3;

/// Of the shell's size, the way by which a normal's change is told.
const ASIDE: f64 = 1e-6;

/// See the module's text.
pub struct Judged {
    pressed: Pressed,
    obstacles: Vec<Obstacle>,
    /// Of each contact.
    gaps: Vec<f64>,
    aside: f64,
}

impl Judged {
    /// Of contacts of a shell of this size, whose solids are where they were to be.
    pub fn new(pressed: Pressed, obstacles: Vec<Obstacle>, size: f64) -> Self {
        // A contact with a force has the gap that it has to keep; one without keeps out.
        let gaps = pressed.list.iter().map(|touch| if touch.force > 0.0 { touch.gap } else { 0.0 }).collect();
        Self { gaps, pressed, obstacles, aside: ASIDE * size }
    }

    fn touch(&self, i: usize, p: &Vec3) -> Touch {
        let obstacle = &self.obstacles[self.pressed.list[i].obstacle as usize];
        let touch = obstacle.touch(&obstacle.at_end(p));
        Touch { normal: obstacle.direction(&touch.normal), ..touch }
    }

    fn pressing(&self, i: usize, gap: f64) -> f64 {
        let touch = &self.pressed.list[i];
        (touch.force + touch.stiffness * (self.gaps[i] - gap)).max(0.0)
    }
}

impl PointEnergy for Judged {
    fn points(&self) -> &[Point] {
        self.pressed.points()
    }

    fn value_at(&self, i: usize, p: &Vec3) -> f64 {
        let pressing = self.pressing(i, self.touch(i, p).distance);
        0.5 * pressing * pressing / self.pressed.list[i].stiffness
            + self.pressed.list[i].rub(p, self.pressed.list[i].cap)
    }

    fn gradient_at(&self, i: usize, p: &Vec3) -> Vec3 {
        let touch = self.touch(i, p);
        self.pressed.list[i].rubbing(p, self.pressed.list[i].cap) - self.pressing(i, touch.distance) * touch.normal
    }

    fn hessian_at(&self, i: usize, p: &Vec3, curvature: Curvature) -> Matrix3<f64> {
        let touch = self.touch(i, p);
        let force = self.pressing(i, touch.distance);
        let mut hessian = self.pressed.list[i].rub_hessian(p, self.pressed.list[i].cap);
        if force == 0.0 {
            return hessian;
        }
        hessian += self.pressed.list[i].stiffness * touch.normal * touch.normal.transpose();
        if curvature == Curvature::Exact {
            let along = |axis: usize, way: f64| self.touch(i, &(p + way * Vec3::ith(axis, 1.0))).normal;
            let turn = |axis: usize| (along(axis, self.aside) - along(axis, -self.aside)) / (2.0 * self.aside);
            let turn = Matrix3::from_columns(&[turn(0), turn(1), turn(2)]);
            hessian -= 0.5 * force * (turn + turn.transpose());
        }
        hessian
    }
}

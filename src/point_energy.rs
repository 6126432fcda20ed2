//! Energies of single vertices that join a shell's own: springs, and what keeps vertices out of an obstacle.
//!
//!   W(x) = Σ_i W_i(x_v(i))
//!
//! The full and the reduced shell minimize their potentials with W in them. A modal step moves its end to where W's force is the one that
//! acts there. So W is met at the end of a step and at an equilibrium, by its value and two derivatives where the vertices are.

use crate::Vec3;
use crate::energy::Curvature;
use crate::support::Pose;
use nalgebra::Matrix3;
use std::sync::Arc;

/// See the module's text. Each W_i is bounded below and has a continuous gradient; its Hessian may jump, as where a vertex meets an obstacle.
pub trait PointEnergy: Send + Sync {
    /// v: the vertices that it acts on.
    fn vertices(&self) -> &[u32];
    /// W_i with the i-th of them at `x`.
    fn value_at(&self, i: usize, x: &Vec3) -> f64;
    /// ∂W_i/∂x.
    fn gradient_at(&self, i: usize, x: &Vec3) -> Vec3;
    /// ∂²W_i/∂x², or of a semidefinite curvature one near it without a negative eigenvalue.
    fn hessian_at(&self, i: usize, x: &Vec3, curvature: Curvature) -> Matrix3<f64>;

    /// W at the positions `x` of all vertices.
    fn value(&self, x: &[Vec3]) -> f64 {
        self.vertices().iter().enumerate().map(|(i, v)| self.value_at(i, &x[*v as usize])).fold(0.0, |sum, w| sum + w)
    }

    /// Adds ∂W/∂x there.
    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for (i, v) in self.vertices().iter().map(|v| *v as usize).enumerate() {
            gradient[v] += self.gradient_at(i, &x[v]);
        }
    }
}

/// An energy in world space, as seen from a frame.
#[derive(Clone)]
pub struct InFrame {
    /// In world space.
    pub energy: Arc<dyn PointEnergy>,
    /// Of the frame.
    pub pose: Pose,
}

impl InFrame {
    fn world(&self, x: &Vec3) -> Vec3 {
        self.pose.origin + self.pose.rotation * x
    }
}

impl PointEnergy for InFrame {
    fn vertices(&self) -> &[u32] {
        self.energy.vertices()
    }

    fn value_at(&self, i: usize, x: &Vec3) -> f64 {
        self.energy.value_at(i, &self.world(x))
    }

    fn gradient_at(&self, i: usize, x: &Vec3) -> Vec3 {
        self.pose.rotation.inverse() * self.energy.gradient_at(i, &self.world(x))
    }

    fn hessian_at(&self, i: usize, x: &Vec3, curvature: Curvature) -> Matrix3<f64> {
        let rotation = self.pose.rotation.to_rotation_matrix();
        rotation.inverse() * self.energy.hessian_at(i, &self.world(x), curvature) * rotation
    }
}

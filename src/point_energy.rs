//! Energies of single points that join a shell's own: springs, and what keeps points out of an obstacle.
//!
//!   W(x) = Σ_i W_i(p_i),   p_i = Σ_c w_ic x_c   a vertex or a point within an edge or a triangle
//!
//! The full and the reduced shell minimize their potentials with W in them. A modal step moves its end to where W's force is the one that
//! acts there. So W is met at the end of a step and at an equilibrium, by its value and two derivatives where the points are.

use crate::Vec3;
use crate::energy::Curvature;
use crate::support::Pose;
use nalgebra::Matrix3;
use std::sync::Arc;

/// A vertex, or a point that is the mean of some by weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    vertices: [u32; 3],
    weights: [f64; 3],
    count: usize,
}

impl Point {
    /// A vertex.
    pub fn vertex(v: u32) -> Self {
        Self { vertices: [v; 3], weights: [1.0, 0.0, 0.0], count: 1 }
    }

    /// A point of a triangle by the barycentric weights of its corners, three different vertices. Weights sum to 1.
    pub fn within(triangle: [u32; 3], weights: [f64; 3]) -> Self {
        Self { vertices: triangle, weights, count: 3 }
    }

    /// A point of an edge: `share` of the way from its first vertex to its second, which differ.
    pub fn between([a, b]: [u32; 2], share: f64) -> Self {
        Self { vertices: [a, b, b], weights: [1.0 - share, share, 0.0], count: 2 }
    }

    /// c, corners in a mesh's triangle or one vertex.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices[..self.count]
    }

    /// w, of each of them.
    pub fn weights(&self) -> &[f64] {
        &self.weights[..self.count]
    }

    /// Both.
    pub fn corners(&self) -> impl Iterator<Item = (usize, f64)> {
        self.vertices().iter().map(|v| *v as usize).zip(self.weights().iter().copied())
    }

    /// p of vertices at `x`.
    #[inline]
    pub fn place(&self, x: impl Fn(usize) -> Vec3) -> Vec3 {
        if self.count == 1 {
            return x(self.vertices[0] as usize);
        }
        self.corners().map(|(v, w)| w * x(v)).fold(Vec3::zeros(), |sum, part| sum + part)
    }
}

/// See the module's text. One that is set on a state has positions in world space. Each W_i is bounded below and has a continuous gradient; its Hessian may jump, as where
/// a point meets an obstacle. All of it stays as it is while a state has it, but for what a search learns: what moves is set anew.
pub trait PointEnergy: Send + Sync {
    /// The points that it acts on.
    fn points(&self) -> &[Point];
    /// W_i with the i-th of them at `p`.
    fn value_at(&self, i: usize, p: &Vec3) -> f64;
    /// ∂W_i/∂p.
    fn gradient_at(&self, i: usize, p: &Vec3) -> Vec3;
    /// ∂²W_i/∂p², or of a semidefinite curvature one near it without a negative eigenvalue.
    fn hessian_at(&self, i: usize, p: &Vec3, curvature: Curvature) -> Matrix3<f64>;

    /// It does no work that it has not stored before: what it acts by stands still.
    fn is_passive(&self) -> bool {
        false
    }

    /// It is nearly the energy of the round before, so that a search for this one's end may begin at that one's.
    fn is_nearly_met(&self) -> bool {
        false
    }

    /// A search for a step's end may leave so much to be gained, as a part of W: the energy is one of rounds, which make up for it.
    fn precision(&self) -> f64 {
        0.0
    }

    /// Takes what it keeps of forces anew, with the i-th of its points at `p`: what a search learns on its way. Whether it is another W now.
    fn learn(&self, _i: usize, _p: &Vec3) -> bool {
        false
    }

    /// Its force comes and goes at once, so that a step is better taken whole than by stages.
    fn is_sudden(&self) -> bool {
        false
    }

    /// W at the positions `x` of all vertices.
    fn value(&self, x: &[Vec3]) -> f64 {
        let values = self.points().iter().enumerate().map(|(i, point)| self.value_at(i, &point.place(|v| x[v])));
        values.fold(0.0, |sum, w| sum + w)
    }

    /// Adds ∂W/∂x there.
    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for (i, point) in self.points().iter().enumerate() {
            let slope = self.gradient_at(i, &point.place(|v| x[v]));
            point.corners().for_each(|(v, w)| gradient[v] += w * slope);
        }
    }
}

/// An energy in world space, as seen from a frame or from the axes of each point.
#[derive(Clone)]
pub struct InFrame {
    /// In world space.
    pub energy: Arc<dyn PointEnergy>,
    /// Of the frame.
    pub pose: Pose,
    /// Instead, of each of its points; none on a shell in the frame alone.
    pub each: Option<Arc<Vec<Pose>>>,
}

impl InFrame {
    /// From a frame.
    pub fn new(energy: Arc<dyn PointEnergy>, pose: Pose) -> Self {
        Self { energy, pose, each: None }
    }

    fn axes(&self, i: usize) -> &Pose {
        self.each.as_ref().map_or(&self.pose, |each| &each[i])
    }
}

impl PointEnergy for InFrame {
    fn points(&self) -> &[Point] {
        self.energy.points()
    }

    fn is_passive(&self) -> bool {
        self.energy.is_passive()
    }

    fn is_nearly_met(&self) -> bool {
        self.energy.is_nearly_met()
    }

    fn precision(&self) -> f64 {
        self.energy.precision()
    }

    fn learn(&self, i: usize, x: &Vec3) -> bool {
        self.energy.learn(i, &self.axes(i).place(x))
    }

    fn is_sudden(&self) -> bool {
        self.energy.is_sudden()
    }

    fn value_at(&self, i: usize, x: &Vec3) -> f64 {
        self.energy.value_at(i, &self.axes(i).place(x))
    }

    fn gradient_at(&self, i: usize, x: &Vec3) -> Vec3 {
        let axes = self.axes(i);
        axes.rotation.inverse() * self.energy.gradient_at(i, &axes.place(x))
    }

    fn hessian_at(&self, i: usize, x: &Vec3, curvature: Curvature) -> Matrix3<f64> {
        let axes = self.axes(i);
        if axes.rotation.imag() == Vec3::zeros() {
            return self.energy.hessian_at(i, &axes.place(x), curvature);
        }
        let rotation = axes.rotation.to_rotation_matrix();
        rotation.inverse() * self.energy.hessian_at(i, &axes.place(x), curvature) * rotation
    }
}

//! Length term: E_L = k_L Σ (l − l̄)²/l̄, ∇l = ± unit edge d, ∂²l/∂b² = (I − ddᵀ)/l.

use super::{Curvature, ElementHessian, Energy, Mat3, RestRow};
use crate::{Mesh, Vec3};

/// The length term over all edges.
pub struct LengthEnergy {
    k: f64,
    edges: Vec<[u32; 2]>,
    rest_length: Vec<f64>,
    rest_direction: Vec<Vec3>,
}

impl LengthEnergy {
    /// Rest lengths from the mesh; `k` is k_L.
    pub fn new(mesh: &Mesh, k: f64) -> Self {
        let edges: Vec<[u32; 2]> = mesh.edges.iter().map(|e| e.vertices).collect();
        let rest = edges.iter().map(|e| length_and_direction(&e.map(|v| mesh.positions[v as usize])));
        let (rest_length, rest_direction) = rest.unzip();
        Self { k, edges, rest_length, rest_direction }
    }
}

/// l and ∂l/∂b = −∂l/∂a; zero where the edge has collapsed and has no direction.
fn length_and_direction([a, b]: &[Vec3; 2]) -> (f64, Vec3) {
    let edge = b - a;
    let length = edge.norm();
    (length, if length > 0.0 { edge / length } else { Vec3::zeros() })
}

impl Energy for LengthEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let term = |(e, rest): (&[u32; 2], &f64)| {
            let (length, _) = length_and_direction(&e.map(|v| x[v as usize]));
            (length - rest).powi(2) / rest
        };
        self.k * self.edges.iter().zip(&self.rest_length).map(term).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for (&[a, b], rest) in self.edges.iter().zip(&self.rest_length) {
            let (length, direction) = length_and_direction(&[x[a as usize], x[b as usize]]);
            let force = (2.0 * self.k * (length - rest) / rest) * direction;
            gradient[a as usize] -= force;
            gradient[b as usize] += force;
        }
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for ((e, rest), direction) in self.edges.iter().zip(&self.rest_length).zip(&self.rest_direction) {
            let row = (2.0 * self.k / rest).sqrt() * direction;
            visit((e, &[-row, row]));
        }
    }

    fn visit_rows(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow)) {
        for (e, rest) in self.edges.iter().zip(&self.rest_length) {
            let (_, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            let row = (2.0 * self.k / rest).sqrt() * direction;
            visit((e, &[-row, row]));
        }
    }

    /// 2k/l̄ (ddᵀ + (1 − l̄/l)(I − ddᵀ)); a compressed edge's second part is negative and left out of the semidefinite one.
    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        for (e, rest) in self.edges.iter().zip(&self.rest_length) {
            let (length, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            let along = direction * direction.transpose();
            let tension = if length > 0.0 { 1.0 - rest / length } else { 0.0 };
            let tension = if curvature == Curvature::Exact { tension } else { tension.max(0.0) };
            let block = (2.0 * self.k / rest) * (along + tension * (Mat3::identity() - along));
            visit((e, &[block, -block, -block, block]));
        }
    }
}

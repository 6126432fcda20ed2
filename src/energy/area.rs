//! Area term: E_A = k_A Σ (A − Ā)²/Ā, ∇A = ½ n̂ × (opposite edge).

use super::{Energy, RestRow};
use crate::{Mesh, Vec3};

/// The area term over all triangles.
pub struct AreaEnergy {
    k: f64,
    triangles: Vec<[u32; 3]>,
    rest_area: Vec<f64>,
    rest_gradient: Vec<[Vec3; 3]>,
}

impl AreaEnergy {
    /// Rest areas from the mesh; `k` is k_A.
    pub fn new(mesh: &Mesh, k: f64) -> Self {
        let rest = mesh.triangles.iter().map(|t| area_and_gradient(&t.map(|v| mesh.positions[v as usize])));
        let (rest_area, rest_gradient) = rest.unzip();
        Self { k, triangles: mesh.triangles.clone(), rest_area, rest_gradient }
    }
}

/// A and ∂A/∂(a, b, c). The gradient is zero where the triangle has collapsed and has no normal.
fn area_and_gradient([a, b, c]: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
    let double = (b - a).cross(&(c - a));
    let norm = double.norm();
    let half_normal = if norm > 0.0 { double * (0.5 / norm) } else { Vec3::zeros() };
    (0.5 * norm, [half_normal.cross(&(c - b)), half_normal.cross(&(a - c)), half_normal.cross(&(b - a))])
}

impl Energy for AreaEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let term = |(t, rest): (&[u32; 3], &f64)| {
            let (area, _) = area_and_gradient(&t.map(|v| x[v as usize]));
            (area - rest).powi(2) / rest
        };
        self.k * self.triangles.iter().zip(&self.rest_area).map(term).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for (t, rest) in self.triangles.iter().zip(&self.rest_area) {
            let (area, d_area) = area_and_gradient(&t.map(|v| x[v as usize]));
            let slope = 2.0 * self.k * (area - rest) / rest;
            t.iter().zip(d_area).for_each(|(&v, d)| gradient[v as usize] += slope * d);
        }
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for ((t, rest), d_area) in self.triangles.iter().zip(&self.rest_area).zip(&self.rest_gradient) {
            let weight = (2.0 * self.k / rest).sqrt();
            visit((t, &d_area.map(|d| weight * d)));
        }
    }
}

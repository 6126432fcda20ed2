//! Length term: E_L = k_L Σ (l − l̄)²/l̄, ∇l = ± unit edge d, ∂²l/∂b² = (I − ddᵀ)/l.

use super::{Curvature, ElementHessian, Energy, Mat3, RestRow, Stress, Term, shared};
use crate::{Mesh, Vec3};

/// The length term over all edges.
pub struct LengthEnergy {
    k: f64,
    edges: Vec<[u32; 2]>,
    rest_length: Vec<f64>,
    /// l̄ over the edge's weight, 1 unless sampled.
    divisor: Vec<f64>,
    rest_direction: Vec<Vec3>,
}

impl LengthEnergy {
    /// Rest lengths from the mesh; `k` is k_L.
    pub fn new(mesh: &Mesh, k: f64) -> Self {
        let edges: Vec<[u32; 2]> = mesh.edges.iter().map(|e| e.vertices).collect();
        let rest = edges.iter().map(|e| length_and_direction(&e.map(|v| mesh.positions[v as usize])));
        let (rest_length, rest_direction): (Vec<f64>, _) = rest.unzip();
        Self { k, edges, divisor: rest_length.clone(), rest_length, rest_direction }
    }

    /// The same with lengths without stress of each edge's own.
    pub(super) fn measured(mut self, lengths: &[f64]) -> Self {
        self.rest_length.copy_from_slice(lengths);
        self.divisor.copy_from_slice(lengths);
        self
    }

    /// The same with a constant of each edge's own, of which that of the term is the largest.
    pub fn with(mut self, values: &[f64]) -> Self {
        self.divisor.iter_mut().zip(values).for_each(|(divisor, k)| *divisor *= self.k / k);
        self
    }

    #[inline(always)]
    fn each_gradient(&self, x: &[Vec3], mut visit: impl FnMut(&[u32; 2], Vec3)) {
        for ((e, rest), divisor) in self.edges.iter().zip(&self.rest_length).zip(&self.divisor) {
            let (length, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            visit(e, (2.0 * self.k * (length - rest) / divisor) * direction);
        }
    }

    /// 2k/l̄ (ddᵀ + t (I − ddᵀ)) of each edge, t its `tension` at a length, 1 − l̄/l; a compressed edge's second part is negative and left out
    /// of the semidefinite one.
    #[inline(always)]
    fn each_hessian(
        &self,
        x: &[Vec3],
        share: f64,
        tension: impl Fn(usize, f64) -> f64,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        for (i, (e, divisor)) in self.edges.iter().zip(&self.divisor).enumerate() {
            let (length, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            let along = direction * direction.transpose();
            let tension = if length > 0.0 { shared(tension(i, length), share) } else { 0.0 };
            let block = (2.0 * self.k / divisor) * (along + tension * (Mat3::identity() - along));
            visit((e, &[block, -block, -block, block]));
        }
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
        let term = |((e, rest), divisor): ((&[u32; 2], &f64), &f64)| {
            let (length, _) = length_and_direction(&e.map(|v| x[v as usize]));
            (length - rest).powi(2) / divisor
        };
        self.k * self.edges.iter().zip(&self.rest_length).zip(&self.divisor).map(term).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.each_gradient(x, |&[a, b], force| {
            gradient[a as usize] -= force;
            gradient[b as usize] += force;
        });
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for ((e, divisor), direction) in self.edges.iter().zip(&self.divisor).zip(&self.rest_direction) {
            let row = (2.0 * self.k / divisor).sqrt() * direction;
            visit((e, &[-row, row]));
        }
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        for ((e, rest), divisor) in self.edges.iter().zip(&self.rest_length).zip(&self.divisor) {
            let (length, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            let root = (2.0 * self.k / divisor).sqrt();
            visit((e, &[-root * direction, root * direction]), root * (length - rest));
        }
    }

    fn visit_stretch(&self, x: &[Vec3], visit: &mut dyn FnMut(f64)) {
        for ((&[a, b], rest), divisor) in self.edges.iter().zip(&self.rest_length).zip(&self.divisor) {
            let length = (x[b as usize] - x[a as usize]).norm();
            visit((2.0 * self.k / divisor).sqrt() * (length - rest));
        }
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        for ((e, divisor), stress) in self.edges.iter().zip(&self.divisor).zip(stress) {
            let (length, direction) = length_and_direction(&e.map(|v| x[v as usize]));
            let tension = if length > 0.0 { (2.0 * self.k / divisor).sqrt() * stress / length } else { 0.0 };
            let tension = shared(tension, curvature.share());
            let block = tension * (Mat3::identity() - direction * direction.transpose());
            visit((e, &[block, -block, -block, block]));
        }
    }

    fn n_membrane(&self) -> usize {
        self.edges.len()
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        let tension = |e: usize, length: f64| 1.0 - self.rest_length[e] / length;
        self.each_hessian(x, curvature.share(), tension, visit);
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let tension = |e: usize, length: f64| stress.of[e] / ((2.0 * self.k / self.divisor[e]).sqrt() * length);
        self.each_hessian(x, stress.share, tension, visit);
    }

    /// l − l̄ = y/(2l̄) − y²/(8l̄³).
    fn visit_terms(&self, _rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        for ((edge, length), divisor) in self.edges.iter().zip(&self.rest_length).zip(&self.divisor) {
            let slope = (2.0 * self.k / divisor).sqrt() / (2.0 * length);
            visit(Term::Stretch(&[(*edge, slope)], &[-slope / (2.0 * length * length)]));
        }
        true
    }

    fn n_elements(&self) -> usize {
        self.edges.len()
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let kept: Vec<usize> = (0..self.edges.len()).filter(|&e| weights[e] != 0.0).collect();
        Box::new(Self {
            k: self.k,
            edges: kept.iter().map(|&e| self.edges[e].map(|v| index[v as usize])).collect(),
            rest_length: kept.iter().map(|&e| self.rest_length[e]).collect(),
            divisor: kept.iter().map(|&e| self.divisor[e] / weights[e]).collect(),
            rest_direction: kept.iter().map(|&e| self.rest_direction[e]).collect(),
        })
    }
}

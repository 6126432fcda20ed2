//! Area term: E_A = k_A Σ (A − Ā)²/Ā, ∇A = ½ n̂ × (opposite edge).
//!
//! With e_i the edge opposite vertex i, ∂²A/∂i∂j = (e_i·e_j)/(4A) n̂n̂ᵀ − ½ s_ij [n̂]×, s_ij = 1 if j follows i, −1 if it
//! precedes. The first part is positive semidefinite. The second has the eigenvalues ±√3/2 and 0 whatever the shape.

use super::{Curvature, ElementHessian, Energy, Mat3, RestRow, Stress, Term, shared};
use crate::{Mesh, Vec3};

/// The area term over all triangles.
pub struct AreaEnergy {
    k: f64,
    triangles: Vec<[u32; 3]>,
    rest_area: Vec<f64>,
    /// Ā over the triangle's weight, 1 unless sampled.
    divisor: Vec<f64>,
    rest_gradient: Vec<[Vec3; 3]>,
}

impl AreaEnergy {
    /// Rest areas from the mesh; `k` is k_A.
    pub fn new(mesh: &Mesh, k: f64) -> Self {
        let rest = mesh.triangles.iter().map(|t| area_and_gradient(&t.map(|v| mesh.positions[v as usize])));
        let (rest_area, rest_gradient): (Vec<f64>, _) = rest.unzip();
        Self { k, triangles: mesh.triangles.clone(), divisor: rest_area.clone(), rest_area, rest_gradient }
    }

    /// The same with areas without stress of each triangle's own.
    pub(super) fn measured(mut self, area: impl Fn(usize) -> f64) -> Self {
        self.rest_area = (0..self.triangles.len()).map(area).collect();
        self.divisor.copy_from_slice(&self.rest_area);
        self
    }

    /// The same with a constant of each triangle's own, of which that of the term is the largest.
    pub fn with(mut self, values: &[f64]) -> Self {
        self.divisor.iter_mut().zip(values).for_each(|(divisor, k)| *divisor *= self.k / k);
        self
    }

    #[inline(always)]
    fn each_gradient(&self, x: &[Vec3], mut visit: impl FnMut(&[u32; 3], [Vec3; 3])) {
        for ((t, rest), divisor) in self.triangles.iter().zip(&self.rest_area).zip(&self.divisor) {
            let (area, d_area) = area_and_gradient(&t.map(|v| x[v as usize]));
            let slope = 2.0 * self.k * (area - rest) / divisor;
            visit(t, d_area.map(|d| slope * d));
        }
    }

    /// ∂²E of each triangle with `strain(t, A − Ā)` for A − Ā where its curvature goes by that.
    #[inline(always)]
    fn each_hessian(
        &self,
        x: &[Vec3],
        share: f64,
        strain: impl Fn(usize, f64) -> f64,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        for (i, ((t, rest), divisor)) in self.triangles.iter().zip(&self.rest_area).zip(&self.divisor).enumerate() {
            let corners = t.map(|v| x[v as usize]);
            let (area, d_area) = area_and_gradient(&corners);
            let mut blocks = area_curvature(&corners, strain(i, area - rest), share);
            for (ij, block) in blocks.iter_mut().enumerate() {
                *block = (2.0 * self.k / divisor) * (*block + d_area[ij / 3] * d_area[ij % 3].transpose());
            }
            visit((t, &blocks));
        }
    }
}

/// A.
fn area([a, b, c]: &[Vec3; 3]) -> f64 {
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// A and ∂A/∂(a, b, c). The gradient is zero where the triangle has collapsed and has no normal.
fn area_and_gradient([a, b, c]: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
    let double = (b - a).cross(&(c - a));
    let norm = double.norm();
    let half_normal = if norm > 0.0 { double * (0.5 / norm) } else { Vec3::zeros() };
    (0.5 * norm, [half_normal.cross(&(c - b)), half_normal.cross(&(a - c)), half_normal.cross(&(b - a))])
}

/// The blocks of σ ∂²A for a share of 1, of a positive semidefinite part of it for 0.
fn area_curvature([a, b, c]: &[Vec3; 3], sigma: f64, share: f64) -> [Mat3; 9] {
    let double = (b - a).cross(&(c - a));
    let norm = double.norm();
    if norm == 0.0 {
        return [Mat3::zeros(); 9];
    }
    let normal = double / norm;
    let across = normal * normal.transpose();
    let turn = (0.5 + 0.5 * share) * (0.5 * sigma * normal.cross_matrix());
    let (out_of_plane, in_plane) = (shared(sigma, share), (1.0 - share) * (0.25 * 3f64.sqrt() * sigma.abs()));
    let edges = [c - b, a - c, b - a];
    std::array::from_fn(|ij| {
        let (i, j) = (ij / 3, ij % 3);
        // Off the translations: I − J/3 with J all ones.
        let apart = if i == j { 2.0 / 3.0 } else { -1.0 / 3.0 };
        let mut block = (out_of_plane * edges[i].dot(&edges[j]) / (2.0 * norm)) * across;
        if share < 1.0 {
            block += (in_plane * apart) * (Mat3::identity() - across);
        }
        match (3 + j - i) % 3 {
            0 => block,
            1 => block - turn,
            _ => block + turn,
        }
    })
}

impl Energy for AreaEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let term = |((t, rest), divisor): ((&[u32; 3], &f64), &f64)| {
            (area(&t.map(|v| x[v as usize])) - rest).powi(2) / divisor
        };
        self.k * self.triangles.iter().zip(&self.rest_area).zip(&self.divisor).map(term).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.each_gradient(x, |t, d| t.iter().zip(d).for_each(|(&v, d)| gradient[v as usize] += d));
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for ((t, divisor), d_area) in self.triangles.iter().zip(&self.divisor).zip(&self.rest_gradient) {
            let weight = (2.0 * self.k / divisor).sqrt();
            visit((t, &d_area.map(|d| weight * d)));
        }
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        for ((t, rest), divisor) in self.triangles.iter().zip(&self.rest_area).zip(&self.divisor) {
            let (area, d_area) = area_and_gradient(&t.map(|v| x[v as usize]));
            let root = (2.0 * self.k / divisor).sqrt();
            visit((t, &d_area.map(|d| root * d)), root * (area - rest));
        }
    }

    fn visit_stretch(&self, x: &[Vec3], visit: &mut dyn FnMut(f64)) {
        for ((t, rest), divisor) in self.triangles.iter().zip(&self.rest_area).zip(&self.divisor) {
            let area = area(&t.map(|v| x[v as usize]));
            visit((2.0 * self.k / divisor).sqrt() * (area - rest));
        }
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        for ((t, divisor), stress) in self.triangles.iter().zip(&self.divisor).zip(stress) {
            let root = (2.0 * self.k / divisor).sqrt();
            visit((t, &area_curvature(&t.map(|v| x[v as usize]), root * stress, curvature.share())));
        }
    }

    fn n_membrane(&self) -> usize {
        self.triangles.len()
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        self.each_hessian(x, curvature.share(), |_, strain| strain, visit);
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let strain = |t: usize, _| stress.of[t] / (2.0 * self.k / self.divisor[t]).sqrt();
        self.each_hessian(x, stress.share, strain, visit);
    }

    /// A − Ā = Σ cot ᾱ y/4 over the sides + ½ Σ c_ij y_i y_j/(16 Ā), to second order. c_ij = 1 − cot ᾱ_i cot ᾱ_j, and c_ii = −1 − cot² ᾱ_i.
    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        for (t, divisor) in self.triangles.iter().zip(&self.divisor) {
            let x = t.map(|v| rest[v as usize]);
            let double = (x[1] - x[0]).cross(&(x[2] - x[0])).norm();
            let root = (2.0 * self.k / divisor).sqrt();
            let after = |i: usize| [(i + 1) % 3, (i + 2) % 3];
            let cotangents = [0, 1, 2].map(|i| after(i).map(|j| x[j] - x[i])).map(|[a, b]| a.dot(&b) / double);
            let side = |i: usize| (after(i).map(|j| t[j]), 0.25 * root * cotangents[i]);
            let both = |i: usize, j: usize| {
                let own = if i == j { -1.0 } else { 1.0 };
                0.125 * root * (own - cotangents[i] * cotangents[j]) / double
            };
            let curvature = [both(0, 0), both(1, 0), both(1, 1), both(2, 0), both(2, 1), both(2, 2)];
            visit(Term::Stretch(&[side(0), side(1), side(2)], &curvature));
        }
        true
    }

    fn n_elements(&self) -> usize {
        self.triangles.len()
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let kept: Vec<usize> = (0..self.triangles.len()).filter(|&t| weights[t] != 0.0).collect();
        Box::new(Self {
            k: self.k,
            triangles: kept.iter().map(|&t| self.triangles[t].map(|v| index[v as usize])).collect(),
            rest_area: kept.iter().map(|&t| self.rest_area[t]).collect(),
            divisor: kept.iter().map(|&t| self.divisor[t] / weights[t]).collect(),
            rest_gradient: kept.iter().map(|&t| self.rest_gradient[t]).collect(),
        })
    }
}

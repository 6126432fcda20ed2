//! Membrane of St. Venant and Kirchhoff: ½ ∫ h EᵀC E, with the Green strain E of each triangle and C of plane stress.
//!
//! With the sides u = b − a and v = c − a, the strains (E₁₁, E₂₂, 2E₁₂) are a linear map of the changes of (u·u, v·v, u·v). So are
//! the three elements of a triangle, √A Lᵀ (E₁₁, E₂₂, 2E₁₂) with LLᵀ = hC: quadratic in the positions, zero at rest to the last bit.

use super::rest::Rest;
use super::{Curvature, ElementHessian, Energy, Mat3, RestRow, Stress, Term};
use crate::{Mesh, Vec3};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// The membrane's term over all triangles.
pub struct MembraneEnergy {
    triangles: Vec<Triangle>,
}

/// A triangle and those of its three elements that count.
#[derive(Clone, Copy)]
struct Triangle {
    corners: [u32; 3],
    /// How many elements.
    kept: usize,
    /// u and v at rest.
    rest: [Vec3; 2],
    /// Of each element, what it is of the changes of (u·u, v·v, u·v).
    rows: [Vector3<f64>; 3],
}

impl MembraneEnergy {
    /// `stiffness` is LLᵀ = hC, force per length, of (E₁₁, E₂₂, 2E₁₂), isotropic.
    pub fn new(mesh: &Mesh, stiffness: &Matrix3<f64>) -> Self {
        Self::uniform(&Rest::of(mesh), stiffness)
    }

    pub(super) fn uniform(rest: &Rest, stiffness: &Matrix3<f64>) -> Self {
        let root = super::patch::upper_root(stiffness);
        Self::rooted(rest, |_| root)
    }

    /// The same with a stiffness of each triangle's own.
    pub(super) fn varying(rest: &Rest, stiffness: impl Fn(usize) -> Matrix3<f64>) -> Self {
        Self::rooted(rest, |t| super::patch::upper_root(&stiffness(t)))
    }

    fn rooted(rest: &Rest, root: impl Fn(usize) -> Matrix3<f64>) -> Self {
        let triangle = |(number, corners): (usize, &[u32; 3])| {
            let [a, b, c] = rest.corners(number);
            let (u, v) = (b - a, c - a);
            let (length, double) = (u.norm(), u.cross(&v).norm());
            // In the frame along u: u = (length, 0), v = (x, y).
            let (x, y) = (v.dot(&u) / length, double / length);
            let (s, t) = (1.0 / length, 1.0 / y);
            let r = -x * s * t; // the inverse of (u v) is (s r; 0 t)
            let to_strain = Matrix3::new(0.5 * s * s, 0.0, 0.0, 0.5 * r * r, 0.5 * t * t, r * t, s * r, 0.0, s * t);
            let map = (0.5 * double).sqrt() * root(number) * to_strain;
            let rows = std::array::from_fn(|i| map.row(i).transpose());
            Triangle { corners: *corners, kept: 3, rest: [u, v], rows }
        };
        Self { triangles: rest.mesh.triangles.iter().enumerate().map(triangle).collect() }
    }
}

impl Triangle {
    fn sides(&self, x: &[Vec3]) -> [Vec3; 2] {
        let [a, b, c] = self.corners.map(|v| x[v as usize]);
        [b - a, c - a]
    }

    /// The changes of (u·u, v·v, u·v), by products of differences and sums, which keep small ones accurate.
    fn changes(&self, [u, v]: &[Vec3; 2]) -> Vector3<f64> {
        let [u0, v0] = self.rest;
        let (du, dv) = (u - u0, v - v0);
        Vector3::new(du.dot(&(u + u0)), dv.dot(&(v + v0)), du.dot(v) + u0.dot(&dv))
    }

    /// ∇ of what is `row` of the changes.
    fn gradient(row: &Vector3<f64>, [u, v]: &[Vec3; 2]) -> [Vec3; 3] {
        let b = 2.0 * row[0] * u + row[2] * v;
        let c = 2.0 * row[1] * v + row[2] * u;
        [-(b + c), b, c]
    }

    /// ∂² of what is `row` of the changes; of what is not positive semidefinite of it a share.
    fn curvature(row: &Vector3<f64>, share: f64) -> [Mat3; 9] {
        let mut of = Matrix2::new(2.0 * row[0], row[2], row[2], 2.0 * row[1]);
        if share < 1.0 {
            let pull = semidefinite(of);
            of = pull + share * (of - pull);
        }
        let (b, c) = (of[(0, 0)] + of[(0, 1)], of[(1, 0)] + of[(1, 1)]);
        let factors = [b + c, -b, -c, -b, of[(0, 0)], of[(0, 1)], -c, of[(1, 0)], of[(1, 1)]];
        factors.map(Mat3::from_diagonal_element)
    }

    fn rows(&self) -> &[Vector3<f64>] {
        &self.rows[..self.kept]
    }

    /// Σ σ row of the next stresses.
    fn pull<'a>(&self, each: &mut impl Iterator<Item = &'a f64>) -> Vector3<f64> {
        self.rows().iter().zip(each).map(|(row, of)| *of * row).sum()
    }

    /// Σ ∇ε∇εᵀ + σ ∂²ε over the elements, with `pull` = Σ σ row.
    fn hessian(&self, sides: &[Vec3; 2], pull: &Vector3<f64>, share: f64) -> [Mat3; 9] {
        let mut blocks = Self::curvature(pull, share);
        for row in self.rows() {
            let gradient = Self::gradient(row, sides);
            for (ij, block) in blocks.iter_mut().enumerate() {
                *block += gradient[ij / 3] * gradient[ij % 3].transpose();
            }
        }
        blocks
    }
}

/// The part of a symmetric matrix along its positive eigenvalues.
fn semidefinite(of: Matrix2<f64>) -> Matrix2<f64> {
    let mean = 0.5 * of.trace();
    let radius = libm::hypot(0.5 * (of[(0, 0)] - of[(1, 1)]), of[(0, 1)]);
    let (high, low) = (mean + radius, mean - radius);
    match () {
        () if low >= 0.0 => of,
        () if high <= 0.0 => Matrix2::zeros(),
        () => (of - Matrix2::from_diagonal_element(low)) * (high / (2.0 * radius)),
    }
}

impl Energy for MembraneEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        for t in &self.triangles {
            let changes = t.changes(&t.sides(x));
            t.rows().iter().for_each(|row| sum += row.dot(&changes).powi(2));
        }
        0.5 * sum
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for t in &self.triangles {
            let sides = t.sides(x);
            let changes = t.changes(&sides);
            let pull: Vector3<f64> = t.rows().iter().map(|row| row.dot(&changes) * row).sum();
            let forces = Triangle::gradient(&pull, &sides);
            t.corners.iter().zip(forces).for_each(|(&v, force)| gradient[v as usize] += force);
        }
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for t in &self.triangles {
            t.rows().iter().for_each(|row| visit((&t.corners, &Triangle::gradient(row, &t.rest))));
        }
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        for t in &self.triangles {
            let sides = t.sides(x);
            let changes = t.changes(&sides);
            let pull: Vector3<f64> = t.rows().iter().map(|row| row.dot(&changes) * row).sum();
            visit((&t.corners, &t.hessian(&sides, &pull, curvature.share())));
        }
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        for t in &self.triangles {
            let sides = t.sides(x);
            let changes = t.changes(&sides);
            for row in t.rows() {
                visit((&t.corners, &Triangle::gradient(row, &sides)), row.dot(&changes));
            }
        }
    }

    fn visit_stress_hessian(
        &self,
        _x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let mut each = stress.iter();
        for t in &self.triangles {
            visit((&t.corners, &Triangle::curvature(&t.pull(&mut each), curvature.share())));
        }
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let mut each = stress.of.iter();
        for t in &self.triangles {
            visit((&t.corners, &t.hessian(&t.sides(x), &t.pull(&mut each), stress.share)));
        }
    }

    fn n_membrane(&self) -> usize {
        self.n_elements()
    }

    /// Exact: u·v changes by half of what the sides u and v gain less what the third does.
    fn visit_terms(&self, _rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        for t in &self.triangles {
            let [a, b, c] = t.corners;
            for row in t.rows() {
                let half = 0.5 * row[2];
                visit(Term::Stretch(&[([a, b], row[0] + half), ([a, c], row[1] + half), ([b, c], -half)], &[]));
            }
        }
        true
    }

    fn n_elements(&self) -> usize {
        self.triangles.iter().map(|t| t.kept).sum()
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let mut weights = weights.iter();
        let mut triangles = vec![];
        for t in &self.triangles {
            let mut sample = Triangle { kept: 0, ..*t };
            for (row, weight) in t.rows().iter().zip(&mut weights).filter(|(_, weight)| **weight != 0.0) {
                sample.rows[sample.kept] = weight.sqrt() * row;
                sample.kept += 1;
            }
            if sample.kept > 0 {
                sample.corners = t.corners.map(|v| index[v as usize]);
                triangles.push(sample);
            }
        }
        Box::new(Self { triangles })
    }
}

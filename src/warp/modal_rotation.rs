//! Modal rotation Ψ = WΦ (paper section 4.2): the infinitesimal rotation of each vertex in each mode.
//!
//! For a triangle with corners p_i about its centroid, the least-squares rotation of displacements u_i is
//! ω = J⁻¹ Σ p_i × u_i,  J = Σ (|p_i|² I − p_i p_iᵀ). A vertex takes the mean over its triangles.

use crate::{Mesh, Vec3};
use nalgebra::Matrix3;

/// The operator W, triangle by triangle.
pub struct ModalRotation {
    triangles: Vec<[u32; 3]>,
    /// J⁻¹ [p_i]× of each corner.
    corners: Vec<[Matrix3<f64>; 3]>,
    /// 1 / number of triangles at the vertex; 0 if unreferenced.
    inverse_valence: Vec<f64>,
}

impl ModalRotation {
    /// Prepares W on the rest positions.
    pub fn new(mesh: &Mesh) -> Self {
        let mut valence = vec![0u32; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&v| valence[v as usize] += 1);
        let corner_maps = |t: &[u32; 3]| rotation_of_corners(&t.map(|v| mesh.positions[v as usize]));
        Self {
            triangles: mesh.triangles.clone(),
            corners: mesh.triangles.iter().map(corner_maps).collect(),
            inverse_valence: valence.iter().map(|&n| if n > 0 { 1.0 / f64::from(n) } else { 0.0 }).collect(),
        }
    }

    /// w = W u for one displacement field (n_vertices).
    pub fn apply(&self, u: &[Vec3]) -> Vec<Vec3> {
        let mut w = vec![Vec3::zeros(); u.len()];
        for (t, maps) in self.triangles.iter().zip(&self.corners) {
            let omega: Vec3 = t.iter().zip(maps).map(|(&v, map)| map * u[v as usize]).sum();
            t.iter().for_each(|&v| w[v as usize] += omega);
        }
        w.iter_mut().zip(&self.inverse_valence).for_each(|(w, share)| *w *= *share);
        w
    }
}

/// J⁻¹ [p_i]× in units of the longest side, so that any model size stays in range.
fn rotation_of_corners(corners: &[Vec3; 3]) -> [Matrix3<f64>; 3] {
    let [a, b, c] = corners;
    // From differences of corners, not from a centroid: exact far from the origin too.
    let thirds = [(a - b) + (a - c), (b - c) + (b - a), (c - a) + (c - b)];
    let longest = thirds.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let p = thirds.map(|p| p / longest);
    let j = inertia(&p);
    // Distinct, non-collinear corners were checked with the mesh, so J is invertible.
    let inverse = j.try_inverse().unwrap_or_else(Matrix3::zeros);
    p.map(|p| inverse * p.cross_matrix() * (3.0 / longest))
}

/// Σ (|p|² I − p pᵀ), entry by entry: rustc 1.95 with optimization turned the matrix expression into a wrong off-diagonal
/// entry for corners in a coordinate plane.
fn inertia(p: &[Vec3; 3]) -> Matrix3<f64> {
    let moment = |i: usize, k: usize| p[0][i] * p[0][k] + p[1][i] * p[1][k] + p[2][i] * p[2][k];
    let (xx, yy, zz) = (moment(0, 0), moment(1, 1), moment(2, 2));
    let (xy, yz, zx) = (moment(0, 1), moment(1, 2), moment(2, 0));
    Matrix3::new(yy + zz, -xy, -zx, -xy, zz + xx, -yz, -zx, -yz, xx + yy)
}

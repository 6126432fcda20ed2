//! Where a sheet is too thick for its curvature: the theory of thin shells leaves out the thickness over the radius of curvature.

use super::hinge::{dihedral_angle, normals};
use crate::material::Creases;
use crate::{Mesh, Vec3};

/// A thickness beyond this part of the radius of curvature, or of the mesh's size, is told of.
pub const THIN: f64 = 0.1;

/// Where a sheet is not thin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thick {
    /// How many triangles.
    pub count: usize,
    /// The worst of them.
    pub triangle: usize,
    /// Its thickness over its radius of curvature.
    pub part: f64,
}

/// Of a sheet without stress at `x` (n_vertices), with the thickness of each triangle. At creases it is not asked.
pub fn thick(mesh: &Mesh, x: &[Vec3], thickness: impl Fn(usize) -> f64, creases: &Creases) -> Option<Thick> {
    let mut found: Option<Thick> = None;
    for triangle in 0..mesh.triangles.len() {
        let part = thickness(triangle) * curvature(mesh, x, triangle, creases);
        if part > THIN {
            let worst = found.filter(|worst| worst.part >= part).unwrap_or(Thick { count: 0, triangle, part });
            found = Some(Thick { count: found.map_or(0, |found| found.count) + 1, ..worst });
        }
    }
    found
}

/// The larger principal curvature of a triangle, by Σ 2θ/(h₁ + h₂) n nᵀ over its edges: their angles θ, the heights h of both triangles over them, their
/// normals n in the triangle.
fn curvature(mesh: &Mesh, x: &[Vec3], triangle: usize, creases: &Creases) -> f64 {
    let corners = mesh.triangles[triangle];
    let [a, b, c] = corners.map(|v| x[v as usize]);
    let along = (b - a).try_normalize(0.0).unwrap_or_default();
    let across = (b - a).cross(&(c - a)).cross(&(b - a)).try_normalize(0.0).unwrap_or_default();
    let (mut mean, mut half, mut shear) = (0.0, 0.0, 0.0);
    for ends in (0..3).map(|k| [corners[k], corners[(k + 1) % 3]]) {
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let edge = mesh.edges.binary_search_by_key(&ordered(ends), |edge| ordered(edge.vertices));
        let Some(edge) = edge.ok().map(|i| mesh.edges[i]).filter(|edge| edge.is_interior()) else { continue };
        if creases.at(ends).is_some() {
            continue;
        }
        let four = [edge.vertices[0], edge.vertices[1], edge.opposite[0], edge.opposite[1]].map(|v| x[v as usize]);
        let (n1, n2) = normals(&four);
        let side = four[1] - four[0];
        let bend = 2.0 * dihedral_angle(&four) * side.norm() / (n1.norm() + n2.norm());
        // The normal is the edge turned by a quarter, whose sign does not matter.
        let normal = side.try_normalize(0.0).unwrap_or_default();
        let (s, t) = (normal.dot(&across), normal.dot(&along));
        mean += 0.5 * bend;
        half += 0.5 * bend * (s * s - t * t);
        shear -= bend * s * t;
    }
    mean.abs() + libm::hypot(half, shear)
}

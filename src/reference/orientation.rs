//! Orientation of a vertex of the deformed shell: the mean rotation of its triangles from rest, and how it turns.
//!
//! With the rotation R_t of a triangle from the frame of its first edge and normal, as quaternion q_t, R = Q/|Q|, Q = Σ ±q_t.
//! A change of the corners turns the triangle by ω_t, and with q_t Q̄ = (a_t, b_t) the vertex by
//!
//!   ω = Σ ± (a_t ω_t + ω_t × b_t) / |Q|²

use crate::{Mesh, Vec3, rotation};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion};

/// Unit axes along the first edge, in the plane, and along the normal; the identity for a collapsed triangle.
fn triangle_frame([a, b, c]: [Vec3; 3]) -> Matrix3<f64> {
    let axes = (b - a).try_normalize(0.0).zip((b - a).cross(&(c - a)).try_normalize(0.0));
    axes.map_or_else(Matrix3::identity, |(x, z)| Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// Rotation of a triangle from its rest corners.
fn triangle_rotation(rest: [Vec3; 3], corners: [Vec3; 3]) -> Quaternion<f64> {
    let turn = Rotation3::from_matrix_unchecked(triangle_frame(corners) * triangle_frame(rest).transpose());
    UnitQuaternion::from_rotation_matrix(&turn).into_inner()
}

/// q or −q, which are one rotation: the one on the side of `sum`.
fn on_side_of(sum: &Quaternion<f64>, q: Quaternion<f64>) -> Quaternion<f64> {
    if sum.dot(&q) >= 0.0 { q } else { -q }
}

fn mean(sum: Quaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::try_new(sum, 1e-12).unwrap_or_else(UnitQuaternion::identity)
}

/// Rotation of every vertex at positions `x` (n_vertices); the identity where no triangle is.
pub fn vertex_rotations(mesh: &Mesh, x: &[Vec3]) -> Vec<UnitQuaternion<f64>> {
    let mut sums = vec![Quaternion::from_parts(0.0, Vec3::zeros()); x.len()];
    for t in &mesh.triangles {
        let corners = t.map(|v| v as usize);
        let q = triangle_rotation(corners.map(|v| mesh.positions[v]), corners.map(|v| x[v]));
        for v in corners {
            let same_side = on_side_of(&sums[v], q);
            sums[v] += same_side;
        }
    }
    sums.into_iter().map(mean).collect()
}

/// The triangles at a vertex.
#[derive(Clone)]
pub struct Ring {
    /// Their vertices (n).
    pub vertices: Vec<u32>,
    /// Corners as indices of `vertices`, and rest positions.
    triangles: Vec<([usize; 3], [Vec3; 3])>,
}

impl Ring {
    /// That of `vertex`; empty where no triangle is.
    pub fn of(mesh: &Mesh, vertex: u32) -> Self {
        let mut vertices: Vec<u32> = vec![];
        let mut place = |v: u32| {
            vertices.iter().position(|w| *w == v).unwrap_or_else(|| {
                vertices.push(v);
                vertices.len() - 1
            })
        };
        let at_vertex = mesh.triangles.iter().filter(|t| t.contains(&vertex));
        let triangles = at_vertex.map(|t| (t.map(&mut place), t.map(|v| mesh.positions[v as usize]))).collect();
        Self { vertices, triangles }
    }

    /// Its share of positions `x` (n_vertices of the mesh).
    pub fn gather(&self, x: &[Vec3]) -> Vec<Vec3> {
        self.vertices.iter().map(|v| x[*v as usize]).collect()
    }

    fn corners(&self, t: usize, x: &[Vec3]) -> [Vec3; 3] {
        self.triangles[t].0.map(|i| x[i])
    }

    fn rotations(&self, x: &[Vec3]) -> (Quaternion<f64>, Vec<Quaternion<f64>>) {
        let mut sum = Quaternion::from_parts(0.0, Vec3::zeros());
        let mut turn = |t: usize| {
            let q = on_side_of(&sum, triangle_rotation(self.triangles[t].1, self.corners(t, x)));
            sum += q;
            q
        };
        let all = (0..self.triangles.len()).map(&mut turn).collect();
        (sum, all)
    }

    /// R at positions `x` of its vertices.
    pub fn rotation(&self, x: &[Vec3]) -> UnitQuaternion<f64> {
        mean(self.rotations(x).0)
    }

    /// R at positions `x` of its vertices, and ∂ω/∂x of each.
    pub fn turn(&self, x: &[Vec3]) -> (UnitQuaternion<f64>, Vec<Matrix3<f64>>) {
        let (sum, all) = self.rotations(x);
        let mut by_vertex = vec![Matrix3::zeros(); self.vertices.len()];
        let square = sum.norm_squared();
        if square < 1e-24 {
            return (mean(sum), by_vertex);
        }
        for (t, q) in all.iter().enumerate() {
            let p = q * sum.conjugate();
            let share = (Matrix3::identity() * p.scalar() - p.vector().into_owned().cross_matrix()) / square;
            let turns = triangle_turn(self.corners(t, x));
            for (i, turn) in self.triangles[t].0.iter().zip(turns) {
                by_vertex[*i] += share * turn;
            }
        }
        (mean(sum), by_vertex)
    }
}

/// The rotation vector m from `present` to `goal`, and J⁻¹(m) = 1 + ½[m]× + c[m]×²: where the vertex turns by ω, m changes by −J⁻¹ω.
pub fn missing_turn(goal: &UnitQuaternion<f64>, present: &UnitQuaternion<f64>) -> (Vec3, Matrix3<f64>) {
    let missing = rotation::vector(&(goal * present.inverse()));
    let angle = missing.norm();
    let c = if angle < 1e-2 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        let (sine, cosine) = libm::sincos(angle);
        1.0 / (angle * angle) - (1.0 + cosine) / (2.0 * angle * sine)
    };
    let cross = missing.cross_matrix();
    (missing, Matrix3::identity() + 0.5 * cross + c * cross * cross)
}

/// The share of the way from `start` to `goal`.
pub fn part_way(start: &UnitQuaternion<f64>, goal: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    match share {
        1.0 => *goal,
        _ => rotation::by(&(share * rotation::vector(&(goal * start.inverse())))) * start,
    }
}

/// ∂ω_t/∂x of the three corners; zero for a collapsed triangle.
fn triangle_turn([a, b, c]: [Vec3; 3]) -> [Matrix3<f64>; 3] {
    let frame = triangle_frame([a, b, c]);
    let [x, y, z] = [0, 1, 2].map(|i| frame.column(i).into_owned());
    let (length, along, height) = ((b - a).dot(&x), (c - a).dot(&x), (c - a).dot(&y));
    if !(length > 0.0 && height > 0.0) {
        return [Matrix3::zeros(); 3];
    }
    let edge = (z * y.transpose() - y * z.transpose()) / length;
    let slope = x * z.transpose() / height;
    let share = along / length;
    [slope * (share - 1.0) - edge, edge - slope * share, slope]
}

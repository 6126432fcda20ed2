//! Curvature of a triangle from the angles at its edges: κ = M(θ − θ̄), strains of the blended shape operator.
//!
//! M blends two operators, as strains. The *consistent* one gives every quadric its curvature: angles of a quadric over the rest triangle with its
//! neighbours unfolded about its edges are Jκ, and M_cons = J⁻¹. The *edge normal* one is κ = Σ θ l α/A n nᵀ, with the edges' outward
//! normals n and the share α of an angle that belongs to this side. The first is too soft on irregular meshes, the second too stiff.

use super::Mirror;
use crate::Vec3;
use nalgebra::{Matrix2, Matrix3, SVD, Vector2, Vector3};

/// Share of the edge-normal operator; 0.3 does as well.
const BLEND: f64 = 0.4;
/// Singular value of J, scaled, below which six points are near a conic and curvature is not told well.
const NEAR_CONIC: f64 = 0.25;

/// What is beyond an edge of a triangle.
#[derive(Clone, Copy, PartialEq)]
pub enum Beyond {
    /// Nothing: no moment.
    Free,
    /// A clamp: the triangle's mirror image.
    Clamp,
    /// A plane of symmetry: the triangle's mirror image, which moves with it.
    Image(Mirror),
    /// The triangle with this other corner.
    Vertex {
        /// The corner.
        corner: u32,
        /// The triangle's number.
        triangle: usize,
    },
}

/// C of plane stress for (ε₁₁, ε₂₂, 2ε₁₂), of a unit thickness.
pub fn plane_stress(young: f64, poisson: f64) -> Matrix3<f64> {
    let shear = 0.5 * (1.0 - poisson);
    Matrix3::new(1.0, poisson, 0.0, poisson, 1.0, 0.0, 0.0, 0.0, shear) * (young / (1.0 - poisson * poisson))
}

/// Lᵀ of LLᵀ = C; no numbers where C is not positive definite.
pub fn upper_root(c: &Matrix3<f64>) -> Matrix3<f64> {
    let nothing = Matrix3::from_element(f64::NAN);
    c.cholesky().map_or(nothing, |root| root.l().transpose())
}

/// One edge of a rest triangle, in the triangle's plane.
struct Side {
    length: f64,
    /// Outward.
    normal: Vector2<f64>,
    /// How much of the angle belongs to the triangle; 0 at a free edge.
    share: f64,
    /// Angle by curvature (κ₁₁, κ₂₂, 2κ₁₂).
    angle: Vector3<f64>,
}

/// The three elements of a triangle's bending: √A Lᵀ M with LLᵀ = C, elements × edges; edge k is opposite to corner k. The column of a free
/// edge is zero. `across` are the ends of each edge and the corner beyond it, as they are in the triangle there. `ratios` are those of the rigidity to that
/// beyond each edge: the stiffer side has less of an angle's share.
pub fn elements(
    corners: &[Vec3; 3],
    (beyond, across): (&[Beyond; 3], &[[Vec3; 3]; 3]),
    (stiffness, ratios): (&Matrix3<f64>, &[f64; 3]),
) -> Matrix3<f64> {
    let side = corners[1] - corners[0];
    let normal = side.cross(&(corners[2] - corners[0]));
    let area = 0.5 * normal.norm();
    let first = side.normalize();
    let second = normal.normalize().cross(&first);
    let flat = corners.map(|x| Vector2::new((x - corners[0]).dot(&first), (x - corners[0]).dot(&second)));
    let sides: [Side; 3] = std::array::from_fn(|k| Side::new(&flat, &across[k], (beyond[k], ratios[k]), k));
    let blend = (1.0 - BLEND) * consistent(&sides, stiffness) + BLEND * edge_normal(&sides, area, stiffness);
    area.sqrt() * upper_root(stiffness) * blend
}

/// ½ of the second moments: the quadric of curvature (κ₁₁, κ₂₂, 2κ₁₂) at a point.
fn quadric(q: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(0.5 * q.x * q.x, 0.5 * q.y * q.y, 0.5 * q.x * q.y)
}

impl Side {
    fn new(
        flat: &[Vector2<f64>; 3],
        [start, end, other]: &[Vec3; 3],
        (beyond, ratio): (Beyond, f64),
        k: usize,
    ) -> Self {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (a, b, c) = (flat[i], flat[j], flat[k]);
        let edge = b - a;
        let length = edge.norm();
        let along = edge / length;
        let normal = Vector2::new(along.y, -along.x);
        let (height, foot) = (-(c - a).dot(&normal), (c - a).dot(&along) / length);
        // The slope of the quadric over the edge towards a point there, per height.
        let slope = |point: Vector2<f64>, height: f64, foot: f64| {
            (quadric(point) - (1.0 - foot) * quadric(a) - foot * quadric(b)) / height
        };
        let axis = (end - start) / length;
        let reach = other - start;
        let foot_beyond = reach.dot(&axis) / length;
        let beyond_height = (reach - foot_beyond * length * axis).norm();
        let unfolded = a + foot_beyond * edge + beyond_height * normal;
        let share = match beyond {
            Beyond::Free => 0.0,
            Beyond::Clamp | Beyond::Image(_) => 0.5,
            Beyond::Vertex { .. } => height / (height + beyond_height * ratio),
        };
        let angle = slope(c, height, foot) + slope(unfolded, beyond_height, foot_beyond);
        Self { length, normal, share, angle }
    }

    fn is_free(&self) -> bool {
        self.share == 0.0
    }
}

/// J⁻¹ of the edges that are not free, the least of the energy where these do not tell the curvature.
fn consistent(sides: &[Side; 3], stiffness: &Matrix3<f64>) -> Matrix3<f64> {
    let nothing = Matrix3::from_element(f64::NAN);
    let root = upper_root(&(stiffness / stiffness.trace()));
    let Some(inverse) = root.try_inverse() else { return nothing };
    let told = |side: &Side| if side.is_free() { Vector3::zeros() } else { side.angle / side.length };
    let scaled = Matrix3::from_rows(&sides.each_ref().map(|side| told(side).transpose())) * inverse;
    if !scaled.iter().all(|x| x.is_finite()) {
        return nothing; // a search for singular values needs numbers
    }
    let SVD { u: Some(u), v_t: Some(v_t), singular_values } = scaled.svd(true, true) else { return nothing };
    let inverted = singular_values.map(|s| if s > NEAR_CONIC { 1.0 / s } else { s / (NEAR_CONIC * NEAR_CONIC) });
    let mut operator = inverse * v_t.transpose() * Matrix3::from_diagonal(&inverted) * u.transpose();
    for (k, side) in sides.iter().enumerate() {
        operator.column_mut(k).scale_mut(1.0 / side.length);
    }
    operator
}

/// Σ θ l α/A n nᵀ; the slopes at free edges are those of the least energy.
fn edge_normal(sides: &[Side; 3], area: f64, stiffness: &Matrix3<f64>) -> Matrix3<f64> {
    let turned = |side: &Side| {
        let n = side.normal;
        Vector3::new(n.x * n.x, n.y * n.y, 2.0 * n.x * n.y)
    };
    let columns = sides.each_ref().map(|side| turned(side) * (side.length * side.share / area));
    let operator = Matrix3::from_columns(&columns);
    let free: Vec<Vector3<f64>> = sides.iter().filter(|side| side.is_free()).map(turned).collect();
    let relaxed = match free[..] {
        [n] => Some(n * (n.transpose() * stiffness * operator) / n.dot(&(stiffness * n))),
        [n, m] => {
            let of = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(stiffness * b));
            let gram = Matrix2::new(of(&n, &n), of(&n, &m), of(&m, &n), of(&m, &m));
            let both = nalgebra::Matrix3x2::from_columns(&[n, m]);
            gram.try_inverse().map(|gram| both * gram * both.transpose() * stiffness * operator)
        }
        _ => None,
    };
    relaxed.map_or(operator, |relaxed| operator - relaxed)
}

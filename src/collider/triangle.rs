//! The nearest point of a triangle, and of the ways along a segment the first that is near to it.

use crate::Vec3;

/// Squared sine between two sides below which areas from products of products of 1e-16 have fewer than four sure digits.
const THIN: f64 = 1e-12;

/// The weights of its corners in the point of a triangle nearest to `p`. They are not negative, sum to 1 within rounding, and are exactly
/// zero for corners that do not matter: one weight at a corner, two on a side. Finite for coordinates within 1e-100 and 1e70 of each other.
#[inline]
pub(super) fn nearest_weights([a, b, c]: &[Vec3; 3], p: &Vec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (b_a, c_a) = (ab.dot(&ap), ac.dot(&ap));
    if b_a <= 0.0 && c_a <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (b_b, c_b) = (ab.dot(&bp), ac.dot(&bp));
    if b_b >= 0.0 && c_b <= b_b {
        return [0.0, 1.0, 0.0];
    }
    let cp = p - c;
    let (b_c, c_c) = (ab.dot(&cp), ac.dot(&cp));
    if c_c >= 0.0 && b_c <= c_c {
        return [0.0, 0.0, 1.0];
    }
    // Twice the areas that p spans with each side, times the triangle's.
    let (on_c, on_b, on_a) = (b_a * c_b - b_b * c_a, b_c * c_a - b_a * c_c, b_b * c_c - b_c * c_b);
    if on_c <= 0.0 && b_a > 0.0 && b_b < 0.0 {
        let v = b_a / (b_a - b_b);
        return [1.0 - v, v, 0.0];
    }
    if on_b <= 0.0 && c_a > 0.0 && c_c < 0.0 {
        let w = c_a / (c_a - c_c);
        return [1.0 - w, 0.0, w];
    }
    if on_a <= 0.0 && c_b > b_b && b_c > c_c {
        let w = (c_b - b_b) / ((c_b - b_b) + (b_c - c_c));
        return [0.0, 1.0 - w, w];
    }
    let sum = on_a + on_b + on_c;
    if on_a >= 0.0 && on_b >= 0.0 && on_c >= 0.0 && sum > THIN * ab.norm_squared() * ac.norm_squared() {
        return [on_a / sum, on_b / sum, on_c / sum];
    }
    nearest_of_thin([a, b, c], p)
}

/// Of a triangle that is hardly more than a line, or is one: the nearest of points that are surely on it.
#[cold]
fn nearest_of_thin(corners: [&Vec3; 3], p: &Vec3) -> [f64; 3] {
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    let mut look_at = |weights: [f64; 3]| {
        let at = weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
        let squared = (p - at).norm_squared();
        if squared < best.1 {
            best = (weights, squared);
        }
    };
    for k in 0..3 {
        let (a, side) = (corners[k], corners[(k + 1) % 3] - corners[k]);
        let share = side.dot(&(p - a)) / side.norm_squared();
        let share = if share > 0.0 { share.min(1.0) } else { 0.0 }; // of no length: its start
        let mut weights = [0.0; 3];
        (weights[k], weights[(k + 1) % 3]) = (1.0 - share, share);
        look_at(weights);
    }
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let parts = [(b, c), (c, a), (a, b)].map(|(s, t)| normal.dot(&(s - p).cross(&(t - p))));
    let sum: f64 = parts.iter().sum();
    if parts.iter().all(|part| *part > 0.0) && sum.is_normal() {
        look_at(parts.map(|part| part / sum));
    }
    best.0
}

/// The point of these weights.
#[inline]
pub(super) fn place([a, b, c]: &[Vec3; 3], weights: &[f64; 3]) -> Vec3 {
    weights[0] * a + weights[1] * b + weights[2] * c
}

//! The warp u = R̃(w) y of one vertex with its derivatives, in f64: ∂u/∂y = R̃ and ∂u/∂w.
//!
//! With R̃ = A I + B [w]× + C wwᵀ, s = |w|² and primes for d/ds,
//!
//!   ∂u/∂w = 2 (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I),
//!   A' = (C − B)/2,   B' = (A/2 − B)/s,   C' = (B − 3C)/(2s),   by series near s = 0.

use super::{LANES, coefficients};
use crate::Vec3;
use nalgebra::Matrix3;

/// Below this s the closed forms of B' and C' lose digits to cancellation and the series takes over.
const SERIES: f64 = 0.5;

/// (u, ∂u/∂y, ∂u/∂w) of u = R̃(w) y, or of u = y without the warp.
pub fn warp_with_derivative(w: &Vec3, y: &Vec3, warped: bool) -> (Vec3, Matrix3<f64>, Matrix3<f64>) {
    if !warped {
        return (*y, Matrix3::identity(), Matrix3::zeros());
    }
    let s = w.norm_squared();
    let all = coefficients(&[s; LANES]);
    let (a, b, c) = (all.a[0], all.b[0], all.c[0]);
    let (db, dc) =
        if s < SERIES { (series(s, 2), series(s, 3)) } else { ((0.5 * a - b) / s, (b - 3.0 * c) / (2.0 * s)) };
    let (cross, along) = (w.cross(y), w.dot(y));
    let warp = Matrix3::identity() * a + w.cross_matrix() * b + w * w.transpose() * c;
    let by_s = 0.5 * (c - b) * y + db * cross + dc * along * w;
    let by_w =
        2.0 * by_s * w.transpose() - y.cross_matrix() * b + (w * y.transpose() + Matrix3::identity() * along) * c;
    (warp * y, warp, by_w)
}

/// d/ds Σ (−s)ᵏ/(2k + n)! = −Σ k (−s)ᵏ⁻¹/(2k + n)!: B' for n = 2, C' for n = 3.
fn series(s: f64, n: u32) -> f64 {
    let mut factorial: f64 = (1..=n).map(f64::from).product();
    let (mut sum, mut power) = (0.0, 1.0);
    for k in 1..12 {
        let top = f64::from(2 * k + n);
        factorial *= top * (top - 1.0);
        sum -= f64::from(k) * power / factorial;
        power *= -s;
    }
    sum
}

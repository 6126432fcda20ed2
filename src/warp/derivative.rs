//! The warp u = R̃(w) y of one vertex with its derivatives, in f64: ∂u/∂y = R̃ and ∂u/∂w.
//!
//! With R̃ = A I + B [w]× + C wwᵀ, s = |w|² and primes for d/ds,
//!
//!   ∂u/∂w = 2 (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I).

use super::coefficients_and_slopes;
use super::lanes::Lanes;
use crate::Vec3;
use nalgebra::Matrix3;
use pulp::Scalar;

/// (u, ∂u/∂y, ∂u/∂w) of u = R̃(w) y, or of u = y without the warp.
pub fn warp_with_derivative(w: &Vec3, y: &Vec3, warped: bool) -> (Vec3, Matrix3<f64>, Matrix3<f64>) {
    if !warped {
        return (*y, Matrix3::identity(), Matrix3::zeros());
    }
    let (all, slopes) = coefficients_and_slopes(Lanes::<f64, _, 1>::new(Scalar), [w.norm_squared()]);
    let ([a], [b], [c]) = (all.a, all.b, all.c);
    let (cross, along) = (w.cross(y), w.dot(y));
    let warp = Matrix3::identity() * a + w.cross_matrix() * b + w * w.transpose() * c;
    let by_s = slopes.a[0] * y + slopes.b[0] * cross + slopes.c[0] * along * w;
    let by_w =
        2.0 * by_s * w.transpose() - y.cross_matrix() * b + (w * y.transpose() + Matrix3::identity() * along) * c;
    (warp * y, warp, by_w)
}

//! The warp u = R̃(w) y of one vertex with its derivatives, in f64: ∂u/∂y = R̃ and ∂u/∂w.
//!
//! With R̃ = A I + B [w]× + C wwᵀ and the slopes of [`super::Slopes`],
//!
//!   ∂u/∂w = (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I).

use super::lanes::{Lanes, Unfused};
use super::{coefficients, coefficients_and_slopes, doublings};
use crate::Vec3;
use nalgebra::Matrix3;
use pulp::Scalar;

/// u = R̃(w) y, or y without the warp.
#[inline]
pub fn warp(w: &Vec3, y: &Vec3, warped: bool) -> Vec3 {
    if !warped {
        return *y;
    }
    let lanes = Lanes::<f64, Unfused<Scalar>, 1>::new(Scalar);
    let all = coefficients(lanes, [w.norm_squared()], doublings(w.norm()));
    let ([a], [b], [c]) = (all.a, all.b, all.c);
    a * y + b * w.cross(y) + c * w.dot(y) * w
}

/// (u, ∂u/∂y, ∂u/∂w) of u = R̃(w) y, or of u = y without the warp.
#[inline]
pub fn warp_with_derivative(w: &Vec3, y: &Vec3, warped: bool) -> (Vec3, Matrix3<f64>, Matrix3<f64>) {
    if !warped {
        return (*y, Matrix3::identity(), Matrix3::zeros());
    }
    let (all, slopes) =
        coefficients_and_slopes(Lanes::<f64, Unfused<Scalar>, 1>::new(Scalar), [w.norm_squared()], doublings(w.norm()));
    let ([a], [b], [c]) = (all.a, all.b, all.c);
    let (cross, along) = (w.cross(y), w.dot(y));
    let warp = Matrix3::identity() * a + w.cross_matrix() * b + w * w.transpose() * c;
    let by_turn = slopes.a[0] * y + slopes.b[0] * cross + slopes.c[0] * along * w;
    let by_w = by_turn * w.transpose() - y.cross_matrix() * b + (w * y.transpose() + Matrix3::identity() * along) * c;
    (warp * y, warp, by_w)
}

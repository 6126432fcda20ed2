//! One triangle: its deformation gradient from that of linear modal analysis, and what is beyond linear in it.
//!
//! With the gradient G of the modal displacement, completed so that the normal stays normal and as long as it was, ω the axial
//! vector of its skew part and S its symmetric part, the triangle is turned by exp \[ω\]× and keeps the strain S:
//!
//!   F = exp\[ω\]× (I + S),     N(G) = F − I − G = O(|G|²).

use crate::Vec3;
use crate::warp::lanes::{Lanes, Unfused};
use crate::warp::{coefficients, doublings};
use nalgebra::Matrix3;
use pulp::Scalar;

/// ω of G.
pub fn axial(g: &Matrix3<f64>) -> Vec3 {
    0.5 * Vec3::new(g[(2, 1)] - g[(1, 2)], g[(0, 2)] - g[(2, 0)], g[(1, 0)] - g[(0, 1)])
}

/// S of G.
fn symmetric(g: &Matrix3<f64>) -> Matrix3<f64> {
    0.5 * (g + g.transpose())
}

/// R = exp [ω]×, and J with which its rate is Ṙ = [J ω̇]× R.
fn rotation(w: &Vec3) -> (Matrix3<f64>, Matrix3<f64>) {
    let lanes = Lanes::<f64, Unfused<Scalar>, 1>::new(Scalar);
    let all = coefficients(lanes, [w.norm_squared()], doublings(w.norm()));
    let ([a], [b], [c]) = (all.a, all.b, all.c);
    let (cross, square) = (w.cross_matrix(), w.cross_matrix() * w.cross_matrix());
    (Matrix3::identity() + cross * a + square * b, Matrix3::identity() + cross * b + square * c)
}

/// N(G).
pub fn remainder(g: &Matrix3<f64>) -> Matrix3<f64> {
    let (r, _) = rotation(&axial(g));
    r * (Matrix3::identity() + symmetric(g)) - Matrix3::identity() - g
}

/// Hands the rate of N where G changes at each of `rates` to `visit`.
pub fn remainder_rates(g: &Matrix3<f64>, rates: &[Matrix3<f64>], mut visit: impl FnMut(Matrix3<f64>)) {
    let (r, j) = rotation(&axial(g));
    let turned = r * (Matrix3::identity() + symmetric(g));
    for rate in rates {
        visit((j * axial(rate)).cross_matrix() * turned + r * symmetric(rate) - rate);
    }
}

/// The rate of N where G changes at the rate `rate`.
pub fn remainder_rate(g: &Matrix3<f64>, rate: &Matrix3<f64>) -> Matrix3<f64> {
    let (r, j) = rotation(&axial(g));
    let turning = (j * axial(rate)).cross_matrix() * r * (Matrix3::identity() + symmetric(g));
    turning + r * symmetric(rate) - rate
}

/// ∂(H : N)/∂G.
pub fn pull_back(g: &Matrix3<f64>, h: &Matrix3<f64>) -> Matrix3<f64> {
    let (r, j) = rotation(&axial(g));
    // H : [v]× R (I + S) = −2 v · axial(R (I + S) Hᵀ), so that Jᵀ of it is what turning by ω does.
    let by_turn = j.tr_mul(&(-2.0 * axial(&(r * (Matrix3::identity() + symmetric(g)) * h.transpose()))));
    0.5 * by_turn.cross_matrix() + symmetric(&r.tr_mul(h)) - h
}

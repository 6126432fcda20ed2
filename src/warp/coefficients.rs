//! The three functions of s = |w|² that rotation and warp need, and the slopes that their derivatives need, without branch,
//! division, square root or library call:
//!
//!   A = sin θ/θ,   B = (1 − cos θ)/θ²,   C = (θ − sin θ)/θ³,   θ = √s
//!
//! so that R(w) = (1 − sB) I + A [w]× + B wwᵀ and R̃(w) = A I + B [w]× + C wwᵀ. Taylor series give B and C on x = s/4ʲ ≤ π²
//! (smooth through 0, no cancellation); j angle doublings, one j for all lanes, lead back:
//!
//!   C ← (C + AB)/4,   B ← A²/2,   A ← A (1 − xB),   x ← 4x     (old values on the right),
//!
//! and, with primes for d/ds and A' = (C − B)/2, by differentiating these: C' ← (C' + A'B + AB')/16, B' ← AA'/4.

use super::lanes::{Group, Lanes};
use crate::real::Real;
use pulp::Simd;

/// A, B, C of a group of vertices.
#[derive(Clone, Copy)]
pub struct Coefficients<G> {
    /// sin θ/θ.
    pub a: G,
    /// (1 − cos θ)/θ².
    pub b: G,
    /// (θ − sin θ)/θ³.
    pub c: G,
}

/// dA/ds, dB/ds and dC/ds of a group of vertices.
#[derive(Clone, Copy)]
pub struct Slopes<G> {
    /// dA/ds = (C − B)/2.
    pub a: G,
    /// dB/ds.
    pub b: G,
    /// dC/ds.
    pub c: G,
}

/// The series hold up to here, a little beyond π².
const REACH: f64 = 10.0;

/// |w| beyond 2³⁰ has no meaning left as an angle; the doubling stops there.
const MAX_DOUBLINGS: u32 = 30;

/// A, B, C at the squared angles `s` ≥ 0.
#[inline(always)]
pub fn coefficients<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
) -> Coefficients<Group<T, S, N>> {
    let (mut at, mut x, doublings) = reduced(lanes, s);
    for _ in 0..doublings {
        double(lanes, &mut at, &mut x);
    }
    at
}

/// As [`coefficients`], with the slopes.
#[inline(always)]
#[allow(clippy::type_complexity)]
pub fn coefficients_and_slopes<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
) -> (Coefficients<Group<T, S, N>>, Slopes<Group<T, S, N>>) {
    let (mut at, mut x, doublings) = reduced(lanes, s);
    let (mut db, mut dc) = (series_slope(lanes, x, 0), series_slope(lanes, x, 1));
    let slope_of_a = |at: &Coefficients<_>| lanes.mul(lanes.splat(0.5), lanes.sub(at.c, at.b));
    for _ in 0..doublings {
        let da = slope_of_a(&at);
        let sum = lanes.mul_add(da, at.b, lanes.mul_add(at.a, db, dc));
        dc = lanes.mul(sum, lanes.splat(1.0 / 16.0));
        db = lanes.mul(lanes.mul(at.a, da), lanes.splat(0.25));
        double(lanes, &mut at, &mut x);
    }
    (at, Slopes { a: slope_of_a(&at), b: db, c: dc })
}

/// A, B, C at x = s/4ʲ within reach for all lanes, with x and the number j of doublings.
#[inline(always)]
fn reduced<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
) -> (Coefficients<Group<T, S, N>>, Group<T, S, N>, u32) {
    let largest = lanes.largest(s);
    let (mut doublings, mut shrink) = (0, 1.0);
    while doublings < MAX_DOUBLINGS && largest * shrink > REACH {
        shrink *= 0.25;
        doublings += 1;
    }
    let x = lanes.mul(s, lanes.splat(shrink));
    let (b, c) = (series(lanes, x, 0), series(lanes, x, 1));
    let a = lanes.sub(lanes.splat(1.0), lanes.mul(x, c));
    (Coefficients { a, b, c }, x, doublings)
}

/// From x to 4x.
#[inline(always)]
fn double<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    at: &mut Coefficients<Group<T, S, N>>,
    x: &mut Group<T, S, N>,
) {
    let Coefficients { a, b, c } = *at;
    at.c = lanes.mul(lanes.mul_add(a, b, c), lanes.splat(0.25));
    at.b = lanes.mul(lanes.mul(a, a), lanes.splat(0.5));
    at.a = lanes.mul(a, lanes.sub(lanes.splat(1.0), lanes.mul(*x, b)));
    *x = lanes.mul(*x, lanes.splat(4.0));
}

/// Σ (−x)ᵏ/(2k + 2 + odd)! by Horner's rule: B for `odd` = 0, C for `odd` = 1.
#[inline(always)]
fn series<T: Real, S: Simd, const N: usize>(lanes: Lanes<T, S, N>, x: Group<T, S, N>, odd: usize) -> Group<T, S, N> {
    let mut term = [0.0; 16];
    term[0] = if odd == 0 { 0.5 } else { 1.0 / 6.0 };
    for k in 1..T::SERIES_TERMS {
        let n = (2 * k + 1 + odd) as f64;
        term[k] = -term[k - 1] / (n * (n + 1.0));
    }
    horner(lanes, x, &term)
}

/// d/dx of [`series`].
#[inline(always)]
fn series_slope<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    x: Group<T, S, N>,
    odd: usize,
) -> Group<T, S, N> {
    let mut term = [0.0; 16];
    term[0] = if odd == 0 { -1.0 / 24.0 } else { -1.0 / 120.0 };
    for k in 1..T::SERIES_TERMS {
        let (n, below) = ((2 * k + 3 + odd) as f64, k as f64);
        term[k] = -term[k - 1] * (below + 1.0) / (below * n * (n + 1.0));
    }
    horner(lanes, x, &term)
}

#[inline(always)]
fn horner<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    x: Group<T, S, N>,
    terms: &[f64; 16],
) -> Group<T, S, N> {
    let mut sum = lanes.splat(terms[T::SERIES_TERMS - 1]);
    for k in (0..T::SERIES_TERMS - 1).rev() {
        sum = lanes.mul_add(x, sum, lanes.splat(terms[k]));
    }
    sum
}

//! The three functions of s = |w|² that rotation and warp need, and the slopes that their derivatives need, without branch,
//! division, square root or library call:
//!
//!   A = sin θ/θ,   B = (1 − cos θ)/θ²,   C = (θ − sin θ)/θ³ = (1 − A)/s,   θ = √s
//!
//! so that R(w) v = v + w × (A v + B w × v) and R̃(w) y = y + w × (B y + C w × y). Polynomials give B and C on x = s/4ʲ ≤ π²,
//! smooth through 0; j angle doublings, one j for all vertices of a sweep, lead back:
//!
//!   C ← (C + AB)/4,   B ← A²/2,   A ← A (1 − xB),   x ← 4x     (old values on the right).
//!
//! The slope of a function f is 2 df/ds, which makes ∇f = slope w. That of A is C − B; by differentiating the above,
//! C' ← (C' + A'B + AB')/16, B' ← AA'/4.

use super::lanes::{Group, Kind, Lanes};
use crate::real::Real;

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

/// 2 dA/ds, 2 dB/ds and 2 dC/ds of a group of vertices.
#[derive(Clone, Copy)]
pub struct Slopes<G> {
    /// C − B.
    pub a: G,
    /// 2 dB/ds.
    pub b: G,
    /// 2 dC/ds.
    pub c: G,
}

/// Ascending coefficients on [0, π²]: in f32 with relative errors of at most 2.2e-8, in f64 of 6.6e-17
/// (tests/bench/coefficients.py).
struct Polynomial {
    single: [f64; 6],
    double: [f64; 10],
}

const B: Polynomial = Polynomial {
    single: [0.499999995, -0.0416666333, 0.00138884929, -2.47843616e-05, 2.72166734e-07, -1.77299531e-09],
    double: [
        0.5,
        -0.041666666666666394,
        0.0013888888888879665,
        -2.480158730038983e-05,
        2.7557319145013735e-07,
        -2.0876753994442452e-09,
        1.1470676451017689e-11,
        -4.778487015538529e-14,
        1.5533195180450534e-16,
        -3.693119514036686e-19,
    ],
};

const C: Polynomial = Polynomial {
    single: [0.166666666, -0.00833333107, 0.000198410021, -2.75456802e-06, 2.48222729e-08, -1.39423447e-10],
    double: [
        0.16666666666666666,
        -0.008333333333333321,
        0.00019841269841265803,
        -2.755731922346156e-06,
        2.5052108350866163e-08,
        -1.6059042526461696e-10,
        7.647133470817639e-13,
        -2.811024030605762e-15,
        8.183034366062202e-18,
        -1.775165055612406e-20,
    ],
};

const SLOPE_B: Polynomial = Polynomial {
    single: [-0.0833333331, 0.00555555358, -0.000148807185, 2.20356875e-06, -2.0675939e-08, 1.19147615e-10],
    double: [
        -0.08333333333333333,
        0.0055555555555555445,
        -0.0001488095238094868,
        2.2045855378708346e-06,
        -2.087675695619162e-08,
        1.3764893516769978e-10,
        -6.691240540707708e-13,
        2.4986761896762847e-15,
        -7.364119393848188e-18,
        1.612461331848537e-20,
    ],
};

const SLOPE_C: Polynomial = Polynomial {
    single: [-0.0166666667, 0.000793650676, -1.65342524e-05, 2.0035641e-07, -1.5939776e-09, 8.08045301e-12],
    double: [
        -0.016666666666666666,
        0.0007936507936507932,
        -1.6534391534390045e-05,
        2.0041686708160062e-07,
        -1.6059043824075206e-09,
        9.176595995177641e-12,
        -3.936029003900467e-14,
        1.315142031586179e-16,
        -3.5092838739131685e-19,
        7.066420545117593e-22,
    ],
};

/// |w| beyond 2³⁰ has no meaning left as an angle; the doubling stops there.
const MAX_DOUBLINGS: u32 = 30;

/// How often angles up to `largest`, rad, must be halved to come below π.
pub fn doublings(largest: f64) -> u32 {
    let (mut count, mut angle) = (0, largest);
    while count < MAX_DOUBLINGS && angle > std::f64::consts::PI {
        angle *= 0.5;
        count += 1;
    }
    count
}

/// A, B, C at the squared angles `s` ≥ 0, given the [`doublings`] of the largest.
#[inline(always)]
pub fn coefficients<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
    doublings: u32,
) -> Coefficients<Group<T, S, N>> {
    let mut x = reduced(lanes, s, doublings);
    let mut at = within_reach(lanes, x);
    for _ in 0..doublings {
        double(lanes, &mut at, &mut x);
    }
    at
}

/// As [`coefficients`], with the slopes.
#[inline(always)]
#[allow(clippy::type_complexity)]
pub fn coefficients_and_slopes<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
    doublings: u32,
) -> (Coefficients<Group<T, S, N>>, Slopes<Group<T, S, N>>) {
    let mut x = reduced(lanes, s, doublings);
    let mut at = within_reach(lanes, x);
    let (mut db, mut dc) = (horner(lanes, x, &SLOPE_B), horner(lanes, x, &SLOPE_C));
    for _ in 0..doublings {
        let da = lanes.sub(at.c, at.b);
        let sum = lanes.mul_add(da, at.b, lanes.mul_add(at.a, db, dc));
        dc = lanes.mul(sum, lanes.splat(1.0 / 16.0));
        db = lanes.mul(lanes.mul(at.a, da), lanes.splat(0.25));
        double(lanes, &mut at, &mut x);
    }
    (at, Slopes { a: lanes.sub(at.c, at.b), b: db, c: dc })
}

/// s/4ʲ.
#[inline(always)]
fn reduced<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    s: Group<T, S, N>,
    doublings: u32,
) -> Group<T, S, N> {
    (0..doublings).fold(s, |x, _| lanes.mul(x, lanes.splat(0.25)))
}

/// A, B, C at x ≤ π².
#[inline(always)]
fn within_reach<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    x: Group<T, S, N>,
) -> Coefficients<Group<T, S, N>> {
    let (b, c) = (horner(lanes, x, &B), horner(lanes, x, &C));
    Coefficients { a: lanes.negate_mul_add(x, c, lanes.splat(1.0)), b, c }
}

/// From x to 4x.
#[inline(always)]
fn double<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    at: &mut Coefficients<Group<T, S, N>>,
    x: &mut Group<T, S, N>,
) {
    let Coefficients { a, b, c } = *at;
    at.c = lanes.mul(lanes.mul_add(a, b, c), lanes.splat(0.25));
    at.b = lanes.mul(lanes.mul(a, a), lanes.splat(0.5));
    at.a = lanes.mul(a, lanes.negate_mul_add(*x, b, lanes.splat(1.0)));
    *x = lanes.mul(*x, lanes.splat(4.0));
}

/// The polynomial at `x`, by Horner's rule.
#[inline(always)]
fn horner<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    x: Group<T, S, N>,
    polynomial: &Polynomial,
) -> Group<T, S, N> {
    let terms: &[f64] = if T::BYTES == 4 { &polynomial.single } else { &polynomial.double };
    let (last, lower) = (terms[terms.len() - 1], &terms[..terms.len() - 1]);
    lower.iter().rev().fold(lanes.splat(last), |sum, term| lanes.mul_add(x, sum, lanes.splat(*term)))
}

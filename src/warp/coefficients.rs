//! The three functions of s = |w|² that rotation and warp need, for a block of vertices, without branch, division, square
//! root or library call:
//!
//!   A = sin θ/θ,   B = (1 − cos θ)/θ²,   C = (θ − sin θ)/θ³,   θ = √s
//!
//! so that R(w) = (1 − sB) I + A [w]× + B wwᵀ and R̃(w) = A I + B [w]× + C wwᵀ. A Taylor series gives B and C on x = s/4ʲ ≤ 1
//! (smooth through 0, no cancellation); j angle doublings lead back:
//!
//!   C ← (C + AB)/4,   B ← A²/2,   A ← A (1 − xB),   x ← 4x     (old values on the right).

use super::LANES;
use crate::real::Real;

/// A, B, C of one block.
pub struct Coefficients<T> {
    /// sin θ/θ.
    pub a: [T; LANES],
    /// (1 − cos θ)/θ².
    pub b: [T; LANES],
    /// (θ − sin θ)/θ³.
    pub c: [T; LANES],
}

/// |w| beyond 2³⁰ has no meaning left as an angle; the doubling stops there.
const MAX_DOUBLINGS: u32 = 30;

/// Evaluates the three functions at the squared angles `s` ≥ 0.
pub fn coefficients<T: Real>(s: &[T; LANES]) -> Coefficients<T> {
    let largest = s.iter().fold(0.0f64, |m, x| m.max(x.to_f64()));
    let mut doublings = 0;
    let mut shrink = 1.0;
    while doublings < MAX_DOUBLINGS && largest * shrink > 1.0 {
        shrink *= 0.25;
        doublings += 1;
    }
    let shrink = T::of(shrink);
    let mut x = s.map(|s| s * shrink);
    let mut b = x.map(|x| series(x, 0));
    let mut c = x.map(|x| series(x, 1));
    let mut a = [T::default(); LANES];
    let (one, quarter, half, four) = (T::of(1.0), T::of(0.25), T::of(0.5), T::of(4.0));
    for i in 0..LANES {
        a[i] = one - x[i] * c[i];
    }
    for _ in 0..doublings {
        for i in 0..LANES {
            c[i] = (c[i] + a[i] * b[i]) * quarter;
            let cosine = one - x[i] * b[i];
            b[i] = a[i] * a[i] * half;
            a[i] = a[i] * cosine;
            x[i] = x[i] * four;
        }
    }
    Coefficients { a, b, c }
}

/// Σ (−x)ᵏ/(2k + 2 + odd)! by Horner's rule: B for `odd` = 0, C for `odd` = 1.
fn series<T: Real>(x: T, odd: usize) -> T {
    let mut sum = T::of(1.0);
    for k in (1..T::SERIES_TERMS).rev() {
        let n = (2 * k + 1 + odd) as f64;
        sum = T::of(1.0) - x * T::of(1.0 / (n * (n + 1.0))) * sum;
    }
    sum * T::of(if odd == 0 { 0.5 } else { 1.0 / 6.0 })
}

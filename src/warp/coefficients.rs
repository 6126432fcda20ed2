//! The three functions of s = |w|² that rotation and warp need, and the slopes that their derivatives need, for a block of
//! vertices, without branch, division, square root or library call:
//!
//!   A = sin θ/θ,   B = (1 − cos θ)/θ²,   C = (θ − sin θ)/θ³,   θ = √s
//!
//! so that R(w) = (1 − sB) I + A [w]× + B wwᵀ and R̃(w) = A I + B [w]× + C wwᵀ. A Taylor series gives B and C on x = s/4ʲ ≤ 1
//! (smooth through 0, no cancellation); j angle doublings lead back:
//!
//!   C ← (C + AB)/4,   B ← A²/2,   A ← A (1 − xB),   x ← 4x     (old values on the right),
//!
//! and, with primes for d/ds and A' = (C − B)/2, by differentiating these: C' ← (C' + A'B + AB')/16, B' ← AA'/4.

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

/// dB/ds and dC/ds of one block; dA/ds is (C − B)/2.
pub struct Slopes<T> {
    /// dB/ds.
    pub b: [T; LANES],
    /// dC/ds.
    pub c: [T; LANES],
}

impl<T: Real> Coefficients<T> {
    /// dA/ds.
    pub fn slope_of_a(&self) -> [T; LANES] {
        std::array::from_fn(|i| T::of(0.5) * (self.c[i] - self.b[i]))
    }

    /// At x = s/4ʲ ≤ 1 for all lanes, with the number j of doublings.
    fn reduced(s: &[T; LANES]) -> (Self, [T; LANES], u32) {
        let largest = s.iter().fold(0.0f64, |m, x| m.max(x.to_f64()));
        let (mut doublings, mut shrink) = (0, 1.0);
        while doublings < MAX_DOUBLINGS && largest * shrink > 1.0 {
            shrink *= 0.25;
            doublings += 1;
        }
        let x = s.map(|s| s * T::of(shrink));
        let (b, c) = (x.map(|x| series(x, 0)), x.map(|x| series(x, 1)));
        let a = std::array::from_fn(|i| T::of(1.0) - x[i] * c[i]);
        (Self { a, b, c }, x, doublings)
    }

    /// From x to 4x.
    fn double(&mut self, x: &mut [T; LANES]) {
        let Self { a, b, c } = self;
        for i in 0..LANES {
            c[i] = (c[i] + a[i] * b[i]) * T::of(0.25);
            let cosine = T::of(1.0) - x[i] * b[i];
            b[i] = a[i] * a[i] * T::of(0.5);
            a[i] = a[i] * cosine;
            x[i] = x[i] * T::of(4.0);
        }
    }
}

/// Evaluates the three functions at the squared angles `s` ≥ 0.
pub fn coefficients<T: Real>(s: &[T; LANES]) -> Coefficients<T> {
    let (mut at, mut x, doublings) = Coefficients::reduced(s);
    (0..doublings).for_each(|_| at.double(&mut x));
    at
}

/// As [`coefficients`], with the slopes.
pub fn coefficients_and_slopes<T: Real>(s: &[T; LANES]) -> (Coefficients<T>, Slopes<T>) {
    let (mut at, mut x, doublings) = Coefficients::reduced(s);
    let (mut db, mut dc) = (x.map(|x| series_slope(x, 0)), x.map(|x| series_slope(x, 1)));
    for _ in 0..doublings {
        let da = at.slope_of_a();
        for i in 0..LANES {
            dc[i] = (dc[i] + da[i] * at.b[i] + at.a[i] * db[i]) * T::of(1.0 / 16.0);
            db[i] = at.a[i] * da[i] * T::of(0.25);
        }
        at.double(&mut x);
    }
    (at, Slopes { b: db, c: dc })
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

/// d/dx of [`series`].
fn series_slope<T: Real>(x: T, odd: usize) -> T {
    let mut sum = T::of(1.0);
    for k in (1..T::SERIES_TERMS).rev() {
        let (n, k) = ((2 * k + 3 + odd) as f64, k as f64);
        sum = T::of(1.0) - x * T::of((k + 1.0) / (k * n * (n + 1.0))) * sum;
    }
    sum * T::of(if odd == 0 { -1.0 / 24.0 } else { -1.0 / 120.0 })
}

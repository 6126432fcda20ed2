//! Angles of edges that are folded over.
//!
//! θ − θ̄ jumps from π to −π where an edge folds through itself, and an energy of several angles would jump with it. So f(θ − θ̄) stands for θ − θ̄:
//! that itself up to 2π/3, which no edge of a resolved shape reaches, and from there on less and less, to zero at π, with two continuous derivatives.

use std::f64::consts::PI;

/// Where f leaves the angle, and how far that is from π.
const LEAVES: f64 = 2.0 / 3.0 * PI;
const LEFT: f64 = PI - LEAVES;

/// f and its first two derivatives, of an angle in (−π, π].
#[inline(always)]
pub(super) fn fold_over(d: f64) -> [f64; 3] {
    if d.abs() <= LEAVES { [d, 1.0, 0.0] } else { folded(d) }
}

/// f = d w(s), s = (|d| − 2π/3)/(π/3), w = 1 − 10 s³ + 15 s⁴ − 6 s⁵.
#[cold]
fn folded(d: f64) -> [f64; 3] {
    let (size, s) = (d.abs(), (d.abs() - LEAVES) / LEFT);
    let (cube, rest) = (s * s * s, 1.0 - s);
    let w = 1.0 - cube * (10.0 + s * (6.0 * s - 15.0));
    let slope = -30.0 * s * s * rest * rest / LEFT;
    let bow = -60.0 * s * rest * (1.0 - 2.0 * s) / (LEFT * LEFT);
    [d * w, w + size * slope, (2.0 * slope + size * bow) * d.signum()]
}

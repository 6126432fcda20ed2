//! A single mode against the closed form of the damped oscillator, and the integrators' contracts.

use crate::common::*;
use shellwarp::step::{Integrator, Oscillator};

/// exp of the 3 × 3 generator of (q, q̇, 1) by scaling and squaring of a Taylor series in double-double would be one way;
/// the closed form by complex roots is another: q = q* + α e^{r₁t} + β e^{r₂t}, r = −c/2 ± √(c²/4 − λ), and its limits.
fn closed_form(c: f64, lambda: f64, (q, v, f): (f64, f64, f64), t: f64) -> (f64, f64) {
    let a = c / 2.0;
    let d = a * a - lambda;
    if lambda == 0.0 && c == 0.0 {
        return (q + v * t + 0.5 * f * t * t, v + f * t);
    }
    if lambda == 0.0 {
        let e = (-c * t).exp();
        let settled = v - f / c;
        return (q + f / c * t + settled * (1.0 - e) / c, f / c + settled * e);
    }
    let y = q - f / lambda;
    let e = (-a * t).exp();
    if d == 0.0 {
        let b = v + a * y;
        return (f / lambda + e * (y + b * t), e * (b - a * (y + b * t)));
    }
    if d < 0.0 {
        let w = (-d).sqrt();
        let (s, k) = (w * t).sin_cos();
        let b = (v + a * y) / w;
        return (f / lambda + e * (y * k + b * s), e * ((b * w - a * y) * k - (y * w + a * b) * s));
    }
    let s = d.sqrt();
    let (r1, r2) = (-lambda / (a + s), -(a + s));
    let alpha = (v - r2 * y) / (r1 - r2);
    let beta = y - alpha;
    let (e1, e2) = ((r1 * t).exp(), (r2 * t).exp());
    (f / lambda + alpha * e1 + beta * e2, alpha * r1 * e1 + beta * r2 * e2)
}

#[test]
fn the_exact_integrator_is_exact_in_every_regime() {
    let cases = [
        ("undamped", 0.0, 25.0),
        ("lightly damped", 0.3, 25.0),
        ("damped", 6.0, 25.0),
        ("critical", 10.0, 25.0),
        ("overdamped", 40.0, 25.0),
        ("zero mode", 0.0, 0.0),
        ("damped zero mode", 3.0, 0.0),
    ];
    for (name, c, lambda) in cases {
        for h in [1.0 / 30.0, 0.2, 0.41, 1.0] {
            let (mut q, mut v) = (0.7, -1.3);
            let oscillator = Oscillator { damping: c, eigenvalue: lambda };
            for step in 1..=20 {
                (q, v) = oscillator.advance(Integrator::Exact, q, v, 2.0, h);
                let (q_exact, v_exact) = closed_form(c, lambda, (0.7, -1.3, 2.0), f64::from(step) * h);
                // 20 steps of rounding, on values of order 1 (of order t² in a zero mode).
                assert_close(&format!("{name}, q after {step} steps of {h}"), q, q_exact, 1e-12, 1.0);
                assert_close(&format!("{name}, q̇ after {step} steps of {h}"), v, v_exact, 1e-12, 5.0);
            }
        }
    }
}

#[test]
fn the_exact_integrator_passes_smoothly_between_regimes() {
    // One long step equals two half steps, whatever branch each of them takes: a scan across all thresholds.
    for k in 0..60 {
        for j in 0..60 {
            let (c, lambda) = (10f64.powf(f64::from(k) * 0.2 - 6.0), 10f64.powf(f64::from(j) * 0.2 - 6.0));
            let o = Oscillator { damping: c, eigenvalue: lambda };
            let (q, v) = o.advance(Integrator::Exact, 0.7, -1.3, 2.0, 1.0);
            let (qh, vh) = o.advance(Integrator::Exact, 0.7, -1.3, 2.0, 0.5);
            let (q2, v2) = o.advance(Integrator::Exact, qh, vh, 2.0, 0.5);
            let rate = 1.0 + lambda.sqrt(); // phase rounding: 1e-16 times the angle √λ
            assert_close(&format!("q at c = {c:e}, λ = {lambda:e}"), q2, q, 1e-13 * rate, 1.0);
            assert_close(&format!("q̇ at c = {c:e}, λ = {lambda:e}"), v2, v, 1e-13 * rate, rate);
        }
    }
}

#[test]
fn near_critical_damping_is_continuous() {
    for offset in [1e-15, 1e-12, 1e-9, 1e-6] {
        for sign in [-1.0, 1.0] {
            let at = |lambda: f64| {
                Oscillator { damping: 10.0, eigenvalue: lambda }.advance(Integrator::Exact, 1.0, 0.5, 2.0, 1.0)
            };
            let ((q, v), (q0, v0)) = (at(25.0 * (1.0 + sign * offset)), at(25.0));
            // The solution's own slope in λ is below 1 here.
            assert!((q - q0).abs() < 1e-13 + 25.0 * offset && (v - v0).abs() < 1e-13 + 25.0 * offset);
        }
    }
}

#[test]
fn an_undamped_mode_keeps_its_energy() {
    let o = Oscillator { damping: 0.0, eigenvalue: 40.0 };
    let (mut q, mut v) = (1.0, 0.0);
    for _ in 0..100_000 {
        (q, v) = o.advance(Integrator::Exact, q, v, 0.0, 1.0 / 30.0);
    }
    // A random walk of 1e5 roundings of 1e-16, or at worst their sum.
    assert_close("energy", v * v + 40.0 * q * q, 40.0, 1e-11, 0.0);
}

#[test]
fn implicit_euler_converges_at_first_order() {
    let o = Oscillator { damping: 0.5, eigenvalue: 9.0 };
    let error = |n: u32| {
        let (mut q, mut v) = (1.0, 0.0);
        for _ in 0..n {
            (q, v) = o.advance(Integrator::ImplicitEuler, q, v, 0.3, 1.0 / f64::from(n));
        }
        let (exact, _) = closed_form(0.5, 9.0, (1.0, 0.0, 0.3), 1.0);
        assert!(v.is_finite());
        (q - exact).abs()
    };
    let order = (error(2000) / error(4000)).log2();
    // First order; at h = 1/2000 the next term is a thousandth.
    assert!((order - 1.0).abs() < 0.01, "{order}");
}

#[test]
fn both_integrators_are_stable_for_any_step() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
        for h in [1e-9, 1e-3, 1.0, 1e3, 1e9] {
            for (c, lambda) in [(0.0, 1e-6), (0.0, 1e12), (1e9, 1.0), (1e-9, 1e6), (1e6, 1e12)] {
                let o = Oscillator { damping: c, eigenvalue: lambda };
                let (mut q, mut v) = (1.0, 0.0);
                for _ in 0..1000 {
                    (q, v) = o.advance(integrator, q, v, 0.0, h);
                }
                let energy = 0.5 * (v * v + lambda * q * q);
                // Unforced, so never above the start; a thousand roundings.
                assert!(energy <= 0.5 * lambda * (1.0 + 1e-10), "{integrator:?} h {h} c {c} λ {lambda}: {energy}");
            }
        }
    }
}

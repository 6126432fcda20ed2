//! A single mode over one step: q̈ + c q̇ + λ q = f with f constant.

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Backward Euler (\[2\] eq. 16): first order, stable for every h, damps what it does not resolve.
    ImplicitEuler,
    /// The closed-form solution for constant f: exact for every h and damping.
    Exact,
    /// Of second order at least: the exact one for modes, two stages for the full shell. Reduced shells have it always.
    SecondOrder,
}

/// The rate that a handle's change of q gives, in units of (1/h² + λ)^½: at 2, modes of a thousandth of critical damping begin to
/// gain; the larger, the faster a mode is thrown that the step cannot see.
const LARGEST_RATE: f64 = 4.0;

/// Coefficients of one mode: c ≥ 0 and λ ≥ 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Oscillator {
    /// Damping coefficient c, 1/s.
    pub damping: f64,
    /// Eigenvalue λ, 1/s².
    pub eigenvalue: f64,
}

impl Oscillator {
    /// (q, q̇) after a step of `h` > 0 under the force `f`.
    pub fn advance(&self, integrator: Integrator, q: f64, velocity: f64, f: f64, h: f64) -> (f64, f64) {
        match integrator {
            Integrator::ImplicitEuler => self.implicit_euler(q, velocity, f, h),
            Integrator::Exact | Integrator::SecondOrder => self.exact(q, velocity, f, h),
        }
    }

    /// How a handle moves the mode by a step of `h`: (Γ, r) such that the modal force p adds Γp to q and rΓp to q̇.
    ///
    /// At rest under forces f and p the mode must be at (f + p)/λ. For the propagator that leaves Γ = (G(1 − V) + S²)/(1 − V + rS)
    /// with any r. r = V/S is an impulse at the step's start: a mode that is held whole then stops at once, and several modes
    /// under one handle never gain energy. Where S is near zero no impulse moves the mode; r is bounded there, and the gain that
    /// this brings, between modes of less than 1e-4 of critical damping, is below rounding in all steps tried.
    pub fn handle_response(&self, integrator: Integrator, h: f64) -> (f64, f64) {
        let euler = h * h / (1.0 + h * self.damping + h * h * self.eigenvalue);
        if integrator == Integrator::ImplicitEuler {
            return (euler, h.recip());
        }
        let Propagator { s, v, g, .. } = self.propagator(h);
        let bound = LARGEST_RATE * libm::hypot(h.recip(), self.eigenvalue.sqrt());
        let r = if v == 0.0 { 0.0 } else { (v / s).clamp(-bound, bound) };
        let gamma = (g * (1.0 - v) + s * s) / (1.0 - v + r * s);
        if gamma.is_finite() && gamma > 0.0 { (gamma, r) } else { (euler, 0.0) }
    }

    /// d = 1 + hc + h²λ,  q̇⁺ = (q̇ + h (f − λq))/d,  q⁺ = q + h q̇⁺.
    fn implicit_euler(&self, q: f64, velocity: f64, f: f64, h: f64) -> (f64, f64) {
        let d = 1.0 + h * self.damping + h * h * self.eigenvalue;
        let velocity = (velocity + h * (f - self.eigenvalue * q)) / d;
        (q + h * velocity, velocity)
    }

    /// q⁺ = P q + S q̇ + G f,  q̇⁺ = −λS q + V q̇ + S f.
    fn exact(&self, q: f64, velocity: f64, f: f64, h: f64) -> (f64, f64) {
        let Propagator { p, s, v, g } = self.propagator(h);
        (p * q + s * velocity + g * f, -self.eigenvalue * s * q + v * velocity + s * f)
    }

    /// With a = c/2 and δ = √|a² − λ|: S = e^(−ah) sinh(δh)/δ or sin(δh)/δ, P and V = e^(−ah) cosh(δh) ± aS, G = ∫₀ʰ S.
    /// Each regime is written so that no two nearly equal numbers are subtracted.
    fn propagator(&self, h: f64) -> Propagator {
        let (a, lambda) = (0.5 * self.damping, self.eigenvalue);
        if self.damping * h <= 2.0 && lambda * h * h <= 1.0 {
            return self.series_propagator(h);
        }
        let discriminant = a * a - lambda;
        let delta = discriminant.abs().sqrt();
        let (p, s, v) = if discriminant < 0.0 {
            let decay = libm::exp(-a * h);
            let (sine, cosine) = libm::sincos(delta * h);
            let s = if delta > 0.0 { decay * sine / delta } else { decay * h };
            (decay * cosine + a * s, s, decay * cosine - a * s)
        } else {
            overdamped(a, delta, lambda, h)
        };
        let g = if discriminant <= 0.0 || (lambda * h * h > 0.25 && delta < 0.5 * a) {
            (1.0 - p) / lambda
        } else {
            // Clearly overdamped here: G = (φ(r₁h) − φ(r₂h)) h/(r₂ − r₁) with φ(z) = (1 − e⁻ᶻ)/z.
            let (slow, fast) = (lambda / (a + delta), a + delta);
            h * (relaxation(slow * h) - relaxation(fast * h)) / (fast - slow)
        };
        Propagator { p, s, v, g }
    }

    /// Taylor series in h of S and G for small ch and λh²; P = 1 − λG and V = 1 − cS − λG follow.
    fn series_propagator(&self, h: f64) -> Propagator {
        let (c, lambda) = (self.damping * h, self.eigenvalue * h * h);
        // Unit force from rest in unit time: y'' = 1 − c y' − λ y, y = Σ y_k.
        let (mut previous, mut term) = (0.0, 0.5);
        let (mut g, mut s) = (term, 1.0);
        for k in 1..40 {
            let k = f64::from(k);
            let next = (-c * (k + 1.0) * term - lambda * previous) / ((k + 1.0) * (k + 2.0));
            s += (k + 2.0) * next;
            g += next;
            (previous, term) = (term, next);
        }
        Propagator { p: 1.0 - lambda * g, s: s * h, v: 1.0 - c * s - lambda * g, g: g * h * h }
    }
}

struct Propagator {
    p: f64,
    s: f64,
    v: f64,
    g: f64,
}

/// P, S, V for rates r₁ = λ/(a + δ) ≤ r₂ = a + δ.
fn overdamped(a: f64, delta: f64, lambda: f64, h: f64) -> (f64, f64, f64) {
    let (slow, fast) = (lambda / (a + delta), a + delta);
    let (e_slow, e_fast) = (libm::exp(-slow * h), libm::exp(-fast * h));
    let s = e_slow * h * relaxation(2.0 * delta * h);
    let mean = 0.5 * (e_slow + e_fast);
    let v = if delta * h > 0.5 { (fast * e_fast - slow * e_slow) / (2.0 * delta) } else { mean - a * s };
    (mean + a * s, s, v)
}

/// (1 − e⁻ᶻ)/z.
fn relaxation(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { -libm::expm1(-z) / z }
}

//! What a step gets wrong, from its own stages.
//!
//! With θ = ωh a step misses (1/6 − 3γ² + 2γ³) θ³ of a swing, and a stage of backward Euler ½ θ². With rates q̇₀, q̇₁ and q̇⁺ at the start, after
//! the first stage and at the end, (q̇⁺ − q̇₁)/(1 − γ) − (q̇₁ − q̇₀)/γ is γ h² q⃛. All three lie on one side of what jumps between
//! steps. What is stiff has died in them and says nothing of its error, so the estimate is taken through shift H⁻¹, as inertia alone would answer
//! (Hosea, Shampine 1996).

use crate::reduced::Newton;
use crate::step::stages::{GAMMA, MISSED};

/// Of the last step; none before one.
#[derive(Clone)]
pub struct Estimate {
    /// Of each coordinate, before the filter.
    missed: Vec<f64>,
    /// 1/τ² of the last stage; 0 without an estimate.
    shift: f64,
}

impl Estimate {
    /// None, for so many coordinates.
    pub fn none(n: usize) -> Self {
        Self { missed: vec![0.0; n], shift: 0.0 }
    }

    /// The shell is elsewhere.
    pub fn forget(&mut self) {
        self.shift = 0.0;
    }

    /// Of a step of two stages, by each coordinate's rates at the start, after the first stage and at the end.
    pub fn of_stages(&mut self, h: f64, rates: impl Iterator<Item = [f64; 3]>) {
        let (late, early) = (MISSED * h / (1.0 - GAMMA), MISSED * h / GAMMA);
        for (missed, [start, first, end]) in self.missed.iter_mut().zip(rates) {
            *missed = late * (end - first) - early * (first - start);
        }
        self.shift = 1.0 / (GAMMA * h * GAMMA * h);
    }

    /// Of a step of backward Euler, by the rates at the start and at the end.
    pub fn of_one(&mut self, h: f64, rates: impl Iterator<Item = [f64; 2]>) {
        self.missed.iter_mut().zip(rates).for_each(|(missed, [start, end])| *missed = 0.5 * h * (end - start));
        self.shift = 1.0 / (h * h);
    }

    /// The root mean square displacement, by mass, that the last step got wrong.
    pub fn length(&self, newton: &Newton, total_mass: f64) -> f64 {
        if self.shift == 0.0 {
            return 0.0;
        }
        let mut missed = self.missed.clone();
        newton.clone().filter(self.shift, &mut missed);
        // What the filter cannot solve is told without it, which is more; beyond all numbers, the largest.
        let lengths = [&missed, &self.missed].map(|missed| root_mean_square(missed, total_mass));
        lengths.into_iter().find(|length| length.is_finite()).unwrap_or(f64::MAX)
    }
}

/// |x|/√m, without an overflow on the way.
fn root_mean_square(x: &[f64], mass: f64) -> f64 {
    let largest = x.iter().fold(0.0f64, |most, x| if x.is_finite() { most.max(x.abs()) } else { f64::INFINITY });
    if largest == 0.0 {
        return 0.0;
    }
    largest * (x.iter().map(|x| (x / largest).powi(2)).sum::<f64>() / mass).sqrt()
}

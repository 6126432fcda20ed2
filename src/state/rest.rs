//! Rest: a state that no longer moves skips its steps until something changes.
//!
//! A step is a function of the state and of its length h alone. When one leaves every bit as it was, so will the next of the
//! same h: skipping it changes nothing. With a tolerance ε a modal state rests earlier, once what is left of its swing about the
//! equilibrium of the present forces f can move no vertex by more than ε:
//!
//!   Σ_k max_v |φ_k| √((q_k − f_k/λ_k)² + q̇_k²/λ_k) ≤ ε.

/// Whether steps are skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Sleep {
    #[default]
    Awake,
    /// A step of this length changes no bit.
    Fixed(f64),
    /// What is left of the motion is within the tolerance.
    Within,
}

/// See the module's text.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rest {
    /// ε, length; 0: only when no bit changes.
    pub tolerance: f64,
    sleep: Sleep,
}

impl Rest {
    /// Something has changed.
    pub fn wake(&mut self) {
        self.sleep = Sleep::Awake;
    }

    /// Steps of some length are skipped.
    pub fn asleep(&self) -> bool {
        self.sleep != Sleep::Awake
    }

    /// A step of `h` may be skipped.
    pub fn skips(&self, h: f64) -> bool {
        match self.sleep {
            Sleep::Awake => false,
            Sleep::Fixed(length) => length == h,
            Sleep::Within => true,
        }
    }

    /// Hears of a step of `h`: whether it left every bit as it was, and how far a vertex can still move where that is known.
    /// Returns whether what is left of the motion is to be dropped.
    pub fn after_step(&mut self, h: f64, unchanged: bool, left: impl FnOnce() -> Option<f64>) -> bool {
        let within = self.tolerance > 0.0 && left().is_some_and(|left| left <= self.tolerance);
        self.sleep = match (unchanged, within) {
            (_, true) => Sleep::Within,
            (true, false) => Sleep::Fixed(h),
            _ => Sleep::Awake,
        };
        within
    }
}

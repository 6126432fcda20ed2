//! The diagonally implicit Runge–Kutta method of two stages and second order (Alexander 1977), in numbers.
//!
//! y₁ = y + γh f(y₁),   y⁺ = y + (1 − γ)h f(y₁) + γh f(y⁺),   y' = f(y) of y = (q, q̇).

/// γ, the share of the step that each stage takes.
pub const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// (1 − γ)/γ: how far past the first stage's end the second starts.
pub const ONWARD: f64 = 1.0 + std::f64::consts::SQRT_2;
/// (1/6 − 3γ² + 2γ³)/γ: what a step misses, over γh³ and the third derivative.
pub const MISSED: f64 = (1.0 / 6.0 - 3.0 * GAMMA * GAMMA + 2.0 * GAMMA * GAMMA * GAMMA) / GAMMA;

/// What a stage moves beside coasting, over the coasting, where it may be a jump.
pub const SUDDEN: f64 = 0.3;
/// The same over the shape, where it is none.
pub const NOTHING: f64 = 1e-3;
/// Of a jump, what inertia keeps of it at least where the step resolves it.
pub const RESOLVED: f64 = 0.5;
/// Stages in a row that stand, at most.
pub const RELAXING: usize = 4;

/// What became of the two stages of a reduced shell's step.
pub struct Stages {
    /// The first relaxed and stands, and there is no second.
    pub stands: bool,
    /// Whether the searches converged.
    pub converged: bool,
    /// Work of the constraints.
    pub work: f64,
}

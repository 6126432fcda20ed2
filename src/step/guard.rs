//! What keeps a step sensible under loads far beyond what a warp can show. On ordinary scenes the first part is exactly inactive,
//! the second on nearly all: `make check-guard` compares their motion with that of a library built without, `--cfg unguarded`.
//!
//! **Bend.** With β² = Σ (ψ_k q_k)² over the elastic modes, ψ_k the largest rotation of a mode per unit amplitude, or under linear
//! modal analysis, which has no rotations, its largest displacement in model sizes, a potential
//!
//!   G(β) = E x³/(1 − x),   x = (β − β₀)/(β₁ − β₀) > 0,   E = ½ min (λ_k/ψ_k²) β₀²,
//!
//! holds β below β₁ under any load; it is zero up to β₀, half a turn, twice the range in which the warp's shape is good. Its force
//! is taken at the step's end: q⁺ = q* − Γ ∇G(q⁺), Γ = h²/(1 + hc + h²λ), one monotonic equation for β⁺. So β < β₁ at the end of every
//! step, one mode alone turns no vertex by β₁, and m of them together none by √m β₁: |w| ≤ Σ ψ_k|q_k| ≤ √m β.
//!
//! **Energy.** G is convex, and by implicit Euler H = ½|q̇|² + ½qᵀΛq − fᵀq + G never grows in a step. The exact propagator does not feel
//! G on its way, and where it swings far in a step it comes back with more than it left with: [`Guard::limit`] takes that from q̇, and
//! from the way where there is not enough. Without a load, energies as reported never grow.
//!
//! **Swing.** Loads act as at the step's start, which overshoots where the load's own stiffness |∂f_k/∂q_k| ≤ Σ |F||φ_k||ψ_k|, that
//! of a pendulum, is beyond λ + 1/h²: a damping h (K − λ − 1/h²) stands in for the implicit treatment of the difference. With body
//! loads m a and external forces F, by Cauchy and Schwarz,
//!
//!   K_k = √(Σ m|a|²) √(Σ m |φ_k|²|ψ_k|²) + Σ|F| max |φ_k||ψ_k|.
//!
//! It bounds the stiffness of Φᵀ RᵀF. Virtual work has ∂²u/∂q_k² in its place, where R̃(w) Φq adds up to |ψ_k|²|Φq|/3: the same again
//! with Y|ψ_k|/3 for |φ_k|, Y ≥ |Φq|. Under linear modal analysis forces do not swing: K = 0.

/// β₀ and β₁, rad.
pub const GUARDED_BEND: f64 = std::f64::consts::PI;
const LARGEST_BEND: f64 = 1.5 * std::f64::consts::PI;

/// Halvings of an interval within which two numbers of 53 bits meet.
const HALVINGS: u32 = 60;

/// How strongly loads pull.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pull {
    /// √(Σ m|a|²/M): the root mean square of the body loads' acceleration.
    pub body: f64,
    /// Σ|F| of external forces.
    pub external: f64,
    /// Y by virtual work, else 0.
    pub reach: f64,
}

/// How far a unit of each mode bends a shell: by its largest rotation, rad, or by its largest displacement in model sizes.
#[derive(Clone, Copy)]
pub struct Bend<'a> {
    /// In `unit`s.
    pub of_modes: &'a [f64],
    /// A rad, or the model's size.
    pub unit: f64,
}

impl Bend<'_> {
    /// ψ of mode `k`.
    pub fn of(&self, k: usize) -> f64 {
        self.of_modes[k] / self.unit
    }

    /// Σ |ψ_k q_k|: no vertex is turned further, or moved by more model sizes.
    pub fn largest(&self, q: &[f64]) -> f64 {
        q.iter().enumerate().map(|(k, q)| (q * self.of(k)).abs()).sum()
    }
}

/// The modes of a model as the guard sees them.
#[derive(Clone, Copy)]
pub struct Guard<'a> {
    /// λ of each mode.
    pub eigenvalues: &'a [f64],
    /// ψ of each mode.
    pub bend: Bend<'a>,
    /// √(M Σ m |φ|²|ψ|²) of each mode.
    pub swing: &'a [f64],
    /// √(M Σ m |ψ|⁴) of each mode.
    pub turn: &'a [f64],
    /// max |φ||ψ| of each mode.
    pub largest_swing: &'a [f64],
}

impl Guard<'_> {
    /// K of mode `k`.
    pub fn load_stiffness(&self, k: usize, pull: &Pull) -> f64 {
        let third = pull.reach / 3.0;
        pull.body * (self.swing[k] + third * self.turn[k])
            + pull.external * (self.largest_swing[k] + third * self.bend.of(k).powi(2))
    }

    /// c of mode `k` for a step of `h`, with what swinging loads ask in addition to `damping`.
    pub fn damping(&self, k: usize, damping: f64, pull: &Pull, h: f64) -> f64 {
        if cfg!(unguarded) {
            return damping;
        }
        let excess = self.load_stiffness(k, pull) - self.eigenvalues[k] - (h * h).recip();
        if excess > 0.0 { damping + h * excess } else { damping }
    }

    fn rotation(&self, k: usize) -> f64 {
        if self.eigenvalues[k] > 0.0 { self.bend.of(k) } else { 0.0 }
    }

    /// β² at amplitudes given by `q`.
    fn square(&self, q: impl Fn(usize) -> f64) -> f64 {
        (0..self.eigenvalues.len()).map(|k| (self.rotation(k) * q(k)).powi(2)).sum()
    }

    /// E.
    fn scale(&self) -> f64 {
        let ratio = |k: usize| self.eigenvalues[k] / self.rotation(k).powi(2);
        let elastic = (0..self.eigenvalues.len()).filter(|k| self.rotation(*k) > 0.0);
        0.5 * elastic.map(ratio).fold(f64::INFINITY, f64::min) * GUARDED_BEND * GUARDED_BEND
    }

    /// G at amplitudes `q`.
    pub fn energy(&self, q: &[f64]) -> f64 {
        let x = (self.square(|k| q[k]).sqrt() - GUARDED_BEND) / (LARGEST_BEND - GUARDED_BEND);
        if x > 0.0 { self.scale() * x.powi(3) / (1.0 - x).max(f64::EPSILON) } else { 0.0 }
    }

    /// Adds −∇G at amplitudes `q` to `force`.
    pub fn add_force(&self, q: &[f64], force: &mut [f64]) {
        let x = (self.square(|k| q[k]).sqrt() - GUARDED_BEND) / (LARGEST_BEND - GUARDED_BEND);
        if cfg!(unguarded) || x <= 0.0 {
            return;
        }
        let s = slope(self.scale(), x.min(1.0 - f64::EPSILON));
        (0..q.len()).for_each(|k| force[k] -= self.rotation(k).powi(2) * s * q[k]);
    }

    /// ½|q̇|², and ½qᵀΛq − fᵀq + G, of the elastic modes.
    fn energies(&self, force: &[f64], q: &[f64], q_dot: &[f64]) -> (f64, f64) {
        let elastic = || (0..q.len()).filter(|k| self.eigenvalues[*k] > 0.0);
        let potential: f64 = elastic().map(|k| q[k] * (0.5 * self.eigenvalues[k] * q[k] - force[k])).sum();
        (0.5 * elastic().map(|k| q_dot[k] * q_dot[k]).sum::<f64>(), potential + self.energy(q))
    }

    /// Takes from (q, q̇) at the end of a step under `force` what H is larger than it was `before`, first from q̇.
    pub fn limit(&self, force: &[f64], before: (&[f64], &[f64]), q: &mut [f64], q_dot: &mut [f64]) {
        let (kinetic, potential) = self.energies(force, before.0, before.1);
        let most = kinetic + potential;
        let (kinetic, potential) = self.energies(force, q, q_dot);
        if kinetic + potential <= most {
            return;
        }
        let left = ((most - potential) / kinetic).max(0.0).sqrt();
        let elastic = |k: usize| self.eigenvalues[k] > 0.0;
        (0..q.len()).filter(|k| elastic(*k)).for_each(|k| q_dot[k] *= left);
        if potential <= most {
            return;
        }
        // The potential is convex, and where the step began it was no larger than H: halfway back until it is.
        for _ in 0..HALVINGS {
            (0..q.len()).filter(|k| elastic(*k)).for_each(|k| q[k] = 0.5 * (q[k] + before.0[k]));
            if self.energies(force, q, q_dot).1 <= most {
                break;
            }
        }
    }

    /// Moves the free (q, q̇) at the end of a step of `h` to where the guard lets it be; `damping` is c of each mode. Returns whether it
    /// moved them.
    pub fn hold(&self, damping: impl Fn(usize) -> f64, h: f64, q: &mut [f64], q_dot: &mut [f64]) -> bool {
        if cfg!(unguarded) || self.square(|k| q[k]) <= GUARDED_BEND * GUARDED_BEND {
            return false;
        }
        let gamma = |k: usize| h * h / (1.0 + h * damping(k) + h * h * self.eigenvalues[k]);
        let (scale, room) = (self.scale(), LARGEST_BEND - GUARDED_BEND);
        // q_k at the end if G'(β)/β were `s` there.
        let slope = |x: f64| slope(scale, x);
        let held = |q: &[f64], k: usize, s: f64| q[k] / (1.0 + gamma(k) * self.rotation(k).powi(2) * s);
        let (mut low, mut high) = (0.0, 1.0 - f64::EPSILON);
        for _ in 0..HALVINGS {
            let x = 0.5 * (low + high);
            let beta = self.square(|k| held(q, k, slope(x))).sqrt();
            if beta > GUARDED_BEND + room * x { low = x } else { high = x }
        }
        for k in 0..q.len() {
            let moved = held(q, k, slope(high));
            q_dot[k] += (moved - q[k]) / h;
            q[k] = moved;
        }
        true
    }
}

/// G'(β)/β, with E for `scale`.
fn slope(scale: f64, x: f64) -> f64 {
    let room = LARGEST_BEND - GUARDED_BEND;
    let by_x = scale * x * x * (3.0 - 2.0 * x) / (1.0 - x).powi(2);
    by_x / (room * (GUARDED_BEND + room * x))
}

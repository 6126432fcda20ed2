//! Forces that depend on the shape, such as wind, at an equilibrium: taken anew on the shape found until they no longer change.
//!
//! Where a soft shell answers them by more than they were, it goes to and fro between two shapes. Once a round misses by more than half of what the last
//! one did, only a share of the change is taken: the one that the last two rounds foresee the end by (Aitken's Δ² for vectors; Irons, Tuck 1969).

use crate::Vec3;

/// They have settled where they change by less than this part of themselves. A basis of 32 bits leaves seven digits.
const SETTLED: f64 = 1e-6;
/// A round that misses by more than this part of the last one's is relaxed.
const FALLING: f64 = 0.5;
/// The least share of a change that is taken.
const LEAST_SHARE: f64 = 0.02;

/// Between two rounds.
pub(crate) struct Following {
    /// What the last round had, and by how much that was off what the shape before had (n_vertices each; none before a round).
    taken: Vec<Vec3>,
    missed: Vec<Vec3>,
    share: f64,
}

impl Following {
    /// Before the first round.
    pub fn new() -> Self {
        Self { taken: vec![], missed: vec![], share: 1.0 }
    }

    /// Whether the forces on the shape that the last round found (n_vertices) are those that it had.
    pub fn has_settled(&self, force: &[Vec3]) -> bool {
        let change: f64 = force.iter().zip(&self.taken).map(|(a, b)| (a - b).norm_squared()).sum();
        let size: f64 = force.iter().map(|f| f.norm_squared()).sum();
        !self.taken.is_empty() && change <= SETTLED * SETTLED * size
    }

    /// The next round has these.
    pub fn take(&mut self, force: Vec<Vec3>) {
        self.taken = force;
    }

    /// The next round has these, or, where rounds do not converge by themselves, a share of the way there.
    pub fn take_share(&mut self, force: &mut [Vec3]) {
        if self.taken.is_empty() {
            return self.take(force.to_vec());
        }
        let missed: Vec<Vec3> = force.iter().zip(&self.taken).map(|(f, taken)| f - taken).collect();
        let turned: Vec<Vec3> = missed.iter().zip(&self.missed).map(|(now, last)| now - last).collect();
        if square(&missed) > FALLING * FALLING * square(&self.missed) && !self.missed.is_empty() {
            let along: f64 = self.missed.iter().zip(&turned).map(|(last, turned)| last.dot(turned)).sum();
            let foreseen = -self.share * along / square(&turned);
            self.share = if foreseen.is_finite() { foreseen.clamp(LEAST_SHARE, 1.0) } else { 1.0 };
        }
        if self.share < 1.0 {
            let parts = force.iter_mut().zip(&self.taken).zip(&missed);
            parts.for_each(|((force, taken), missed)| *force = taken + self.share * missed);
        }
        self.taken.copy_from_slice(force);
        self.missed = missed;
    }

    /// Of the last change that a round found, what was taken.
    pub fn share(&self) -> f64 {
        self.share
    }
}

fn square(forces: &[Vec3]) -> f64 {
    forces.iter().map(|f| f.norm_squared()).sum()
}

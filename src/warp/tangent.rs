//! The tangent ∂x/∂q of the warp in blocks, applied to rates and, transposed, to forces (the principle of virtual work):
//!
//!   ẋ = R̃ ẏ + D ẇ,     f = Φᵀ R̃ᵀF + Ψᵀ DᵀF,     y = Φq,  w = Ψq,
//!   D = ∂(R̃(w) y)/∂w = 2 (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I).
//!
//! f is the gradient of the load's work F·x(q), so a dead load is conservative, and a force that does no work on ẋ does none
//! on the modes.

use super::{Basis, Coefficients, LANES, Lanes3, Slopes, coefficients_and_slopes, dot, rotate_like};
use crate::real::Real;

/// One block of the warp with its tangent.
pub struct Tangent<T> {
    /// y = Φq.
    y: Lanes3<T>,
    /// w = Ψq.
    w: Lanes3<T>,
    at: Coefficients<T>,
    slopes: Slopes<T>,
}

fn cross<T: Real>(a: &Lanes3<T>, b: &Lanes3<T>, i: usize) -> [T; 3] {
    let component = |d: usize, e: usize| a[d][i] * b[e][i] - a[e][i] * b[d][i];
    [component(1, 2), component(2, 0), component(0, 1)]
}

impl<T: Real> Tangent<T> {
    /// Evaluates one block of `basis` at amplitudes `q`.
    pub fn new(basis: &Basis<T>, block: usize, q: &[f64]) -> Self {
        let (y, w) = basis.combine(block, q);
        let (at, slopes) = coefficients_and_slopes(&std::array::from_fn(|i| dot(&w, &w, i)));
        Self { y, w, at, slopes }
    }

    /// u = R̃(w) y.
    pub fn displacement(&self) -> Lanes3<T> {
        rotate_like(&self.w, &self.y, &self.at.a, &self.at.b, &self.at.c)
    }

    /// 2 (A' y + B' w × y + C' (w·y) w), lane `i`.
    fn by_square(&self, i: usize) -> [T; 3] {
        let Self { y, w, at, slopes } = self;
        let (turned, along) = (cross(w, y, i), dot(w, y, i));
        let (da, db, dc) = (at.slope_of_a()[i], slopes.b[i], slopes.c[i]);
        std::array::from_fn(|c| T::of(2.0) * (da * y[c][i] + db * turned[c] + dc * along * w[c][i]))
    }

    /// ẋ from (ẏ, ẇ) = (Φq̇, Ψq̇).
    pub fn rate(&self, (y_rate, w_rate): &(Lanes3<T>, Lanes3<T>)) -> Lanes3<T> {
        let Self { y, w, at, .. } = self;
        let mut rate = rotate_like(w, y_rate, &at.a, &at.b, &at.c);
        for i in 0..LANES {
            let (by_square, turned) = (self.by_square(i), cross(y, w_rate, i));
            let (spin, pull, along) = (dot(w, w_rate, i), dot(y, w_rate, i), dot(w, y, i));
            for c in 0..3 {
                let stretch = at.c[i] * (pull * w[c][i] + along * w_rate[c][i]);
                rate[c][i] += by_square[c] * spin - at.b[i] * turned[c] + stretch;
            }
        }
        rate
    }

    /// (R̃ᵀF, DᵀF).
    pub fn pull_back(&self, force: &Lanes3<T>) -> (Lanes3<T>, Lanes3<T>) {
        let Self { y, w, at, .. } = self;
        let on_y = rotate_like(w, force, &at.a, &at.b.map(|b| -b), &at.c);
        let mut on_w = [[T::default(); LANES]; 3];
        for i in 0..LANES {
            let (by_square, turned) = (self.by_square(i), cross(y, force, i));
            let (pull, along) = (dot(w, force, i), dot(w, y, i));
            let work = by_square[0] * force[0][i] + by_square[1] * force[1][i] + by_square[2] * force[2][i];
            for c in 0..3 {
                let stretch = at.c[i] * (pull * y[c][i] + along * force[c][i]);
                on_w[c][i] = work * w[c][i] + at.b[i] * turned[c] + stretch;
            }
        }
        (on_y, on_w)
    }
}

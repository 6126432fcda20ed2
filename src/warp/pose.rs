//! The warp of a group of vertices: y = Φq, w = Ψq and the rotation coefficients; the displacement, the rotation, and the
//! tangent ∂x/∂q applied to rates and, transposed, to forces (the principle of virtual work):
//!
//!   ẋ = R̃ ẏ + D ẇ,     f = Φᵀ R̃ᵀF + Ψᵀ DᵀF,
//!   D = ∂(R̃(w) y)/∂w = 2 (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I).

use super::coefficients::{Coefficients, Slopes, coefficients, coefficients_and_slopes};
use super::lanes::{Group, Lanes, Vectors};
use crate::real::Real;
use pulp::Simd;

/// See the module's text.
pub struct Pose<T: Real, S: Simd, const N: usize> {
    lanes: Lanes<T, S, N>,
    /// y = Φq: the displacement of linear modal analysis.
    pub linear: Vectors<T, S, N>,
    /// w = Ψq: the modal rotation.
    pub turn: Vectors<T, S, N>,
    at: Coefficients<Group<T, S, N>>,
}

impl<T: Real, S: Simd, const N: usize> Pose<T, S, N> {
    /// Of (Φq, Ψq).
    #[inline(always)]
    pub fn new(lanes: Lanes<T, S, N>, (linear, turn): (Vectors<T, S, N>, Vectors<T, S, N>)) -> Self {
        Self { lanes, linear, turn, at: coefficients(lanes, lanes.dot(&turn, &turn)) }
    }

    /// u = R̃(w) y.
    #[inline(always)]
    pub fn displacement(&self) -> Vectors<T, S, N> {
        let Coefficients { a, b, c } = self.at;
        rotate_like(self.lanes, &self.turn, &self.linear, a, b, c)
    }

    #[inline(always)]
    fn cosine(&self) -> Group<T, S, N> {
        let square = self.lanes.dot(&self.turn, &self.turn);
        self.lanes.sub(self.lanes.splat(1.0), self.lanes.mul(square, self.at.b))
    }

    /// R(w) v.
    #[inline(always)]
    pub fn rotate(&self, v: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        rotate_like(self.lanes, &self.turn, v, self.cosine(), self.at.a, self.at.b)
    }

    /// R(w)ᵀ v.
    #[inline(always)]
    pub fn rotate_back(&self, v: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        let sine = self.lanes.sub(self.lanes.splat(0.0), self.at.a);
        rotate_like(self.lanes, &self.turn, v, self.cosine(), sine, self.at.b)
    }
}

/// alpha v + beta w × v + gamma (w·v) w.
#[inline(always)]
fn rotate_like<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    w: &Vectors<T, S, N>,
    v: &Vectors<T, S, N>,
    alpha: Group<T, S, N>,
    beta: Group<T, S, N>,
    gamma: Group<T, S, N>,
) -> Vectors<T, S, N> {
    let along = lanes.scale(lanes.mul(gamma, lanes.dot(w, v)), w);
    lanes.scale_add(alpha, v, &lanes.scale_add(beta, &lanes.cross(w, v), &along))
}

/// The tangent at a pose.
pub struct Tangent<T: Real, S: Simd, const N: usize> {
    pose: Pose<T, S, N>,
    slopes: Slopes<Group<T, S, N>>,
}

impl<T: Real, S: Simd, const N: usize> Tangent<T, S, N> {
    /// At (Φq, Ψq).
    #[inline(always)]
    pub fn new(lanes: Lanes<T, S, N>, (linear, turn): (Vectors<T, S, N>, Vectors<T, S, N>)) -> Self {
        let (at, slopes) = coefficients_and_slopes(lanes, lanes.dot(&turn, &turn));
        Self { pose: Pose { lanes, linear, turn, at }, slopes }
    }

    /// u = R̃(w) y.
    #[inline(always)]
    pub fn displacement(&self) -> Vectors<T, S, N> {
        self.pose.displacement()
    }

    /// 2 (A' y + B' w × y + C' (w·y) w), and w·y.
    #[inline(always)]
    fn by_square(&self) -> (Vectors<T, S, N>, Group<T, S, N>) {
        let Self { pose: Pose { lanes, linear, turn, .. }, slopes } = self;
        let (lanes, two) = (*lanes, lanes.splat(2.0));
        let along = lanes.dot(turn, linear);
        let on_turn = lanes.scale(lanes.mul(two, lanes.mul(slopes.c, along)), turn);
        let crossed = lanes.scale_add(lanes.mul(two, slopes.b), &lanes.cross(turn, linear), &on_turn);
        (lanes.scale_add(lanes.mul(two, slopes.a), linear, &crossed), along)
    }

    /// ẋ from (ẏ, ẇ) = (Φq̇, Ψq̇).
    #[inline(always)]
    pub fn rate(&self, (linear_rate, turn_rate): &(Vectors<T, S, N>, Vectors<T, S, N>)) -> Vectors<T, S, N> {
        let Pose { lanes, linear, turn, at } = &self.pose;
        let (lanes, (by_square, along)) = (*lanes, self.by_square());
        let rotated = rotate_like(lanes, turn, linear_rate, at.a, at.b, at.c);
        let stretch = lanes.scale_add(lanes.mul(at.c, lanes.dot(linear, turn_rate)), turn, &rotated);
        let stretch = lanes.scale_add(lanes.mul(at.c, along), turn_rate, &stretch);
        let crossed = lanes.scale_add(at.b, &lanes.cross(turn_rate, linear), &stretch);
        lanes.scale_add(lanes.dot(turn, turn_rate), &by_square, &crossed)
    }

    /// (R̃ᵀF, DᵀF).
    #[inline(always)]
    pub fn pull_back(&self, force: &Vectors<T, S, N>) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        let Pose { lanes, linear, turn, at } = &self.pose;
        let (lanes, (by_square, along)) = (*lanes, self.by_square());
        let back = lanes.sub(lanes.splat(0.0), at.b);
        let on_linear = rotate_like(lanes, turn, force, at.a, back, at.c);
        let stretch = lanes.scale(lanes.mul(at.c, along), force);
        let stretch = lanes.scale_add(lanes.mul(at.c, lanes.dot(turn, force)), linear, &stretch);
        let crossed = lanes.scale_add(at.b, &lanes.cross(linear, force), &stretch);
        (on_linear, lanes.scale_add(lanes.dot(&by_square, force), turn, &crossed))
    }
}

//! The warp of a group of vertices: y = Φq, w = Ψq and the rotation coefficients; the displacement, the rotation, and the
//! tangent ∂x/∂q applied to rates and, transposed, to forces (the principle of virtual work):
//!
//!   ẋ = R̃ ẏ + D ẇ,     f = Φᵀ R̃ᵀF + Ψᵀ DᵀF,
//!   D = ∂(R̃(w) y)/∂w = (A' y + B' w × y + C' (w·y) w) wᵀ − B [y]× + C (w yᵀ + (w·y) I),
//!
//! with the slopes A', B', C' of [`super::Slopes`].

use super::coefficients::{Coefficients, Slopes, coefficients, coefficients_and_slopes};
use super::lanes::{Group, Kind, Lanes, Vectors};
use crate::real::Real;

/// See the module's text.
pub struct WarpPose<T: Real, S: Kind, const N: usize> {
    lanes: Lanes<T, S, N>,
    /// y = Φq: the displacement of linear modal analysis.
    pub linear: Vectors<T, S, N>,
    /// w = Ψq: the modal rotation.
    pub turn: Vectors<T, S, N>,
    at: Coefficients<Group<T, S, N>>,
}

impl<T: Real, S: Kind, const N: usize> WarpPose<T, S, N> {
    /// Of (Φq, Ψq), given the [`super::doublings`] of all vertices.
    #[inline(always)]
    pub fn new(lanes: Lanes<T, S, N>, (linear, turn): (Vectors<T, S, N>, Vectors<T, S, N>), doublings: u32) -> Self {
        Self { lanes, linear, turn, at: coefficients(lanes, lanes.dot(&turn, &turn), doublings) }
    }

    /// u = R̃(w) y.
    #[inline(always)]
    pub fn displacement(&self) -> Vectors<T, S, N> {
        turned(self.lanes, &self.turn, &self.linear, (self.at.b, self.at.c))
    }

    /// R(w) v.
    #[inline(always)]
    pub fn rotate(&self, v: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        turned(self.lanes, &self.turn, v, (self.at.a, self.at.b))
    }

    /// R(w)ᵀ v.
    #[inline(always)]
    pub fn rotate_back(&self, v: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        turned_back(self.lanes, &self.turn, v, (self.at.a, self.at.b))
    }
}

/// v + w × (f v + g w × v).
#[inline(always)]
fn turned<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    w: &Vectors<T, S, N>,
    v: &Vectors<T, S, N>,
    (f, g): (Group<T, S, N>, Group<T, S, N>),
) -> Vectors<T, S, N> {
    lanes.cross_add(w, &lanes.scale_add(g, &lanes.cross(w, v), &lanes.scale(f, v)), v)
}

/// v + w × (g w × v − f v): the transpose of [`turned`].
#[inline(always)]
fn turned_back<T: Real, S: Kind, const N: usize>(
    lanes: Lanes<T, S, N>,
    w: &Vectors<T, S, N>,
    v: &Vectors<T, S, N>,
    (f, g): (Group<T, S, N>, Group<T, S, N>),
) -> Vectors<T, S, N> {
    let minus = |c: usize, ahead: Group<T, S, N>| lanes.negate_mul_add(f, v[c], ahead);
    let [x, y, z] = lanes.scale(g, &lanes.cross(w, v));
    lanes.cross_add(w, &[minus(0, x), minus(1, y), minus(2, z)], v)
}

/// The tangent at a pose.
pub struct Tangent<T: Real, S: Kind, const N: usize> {
    pose: WarpPose<T, S, N>,
    slopes: Slopes<Group<T, S, N>>,
}

impl<T: Real, S: Kind, const N: usize> Tangent<T, S, N> {
    /// At (Φq, Ψq), given the [`super::doublings`] of all vertices.
    #[inline(always)]
    pub fn new(lanes: Lanes<T, S, N>, (linear, turn): (Vectors<T, S, N>, Vectors<T, S, N>), doublings: u32) -> Self {
        let (at, slopes) = coefficients_and_slopes(lanes, lanes.dot(&turn, &turn), doublings);
        Self { pose: WarpPose { lanes, linear, turn, at }, slopes }
    }

    /// u = R̃(w) y.
    #[inline(always)]
    pub fn displacement(&self) -> Vectors<T, S, N> {
        self.pose.displacement()
    }

    /// ẋ from (ẏ, ẇ) = (Φq̇, Ψq̇).
    #[inline(always)]
    pub fn rate(&self, (linear_rate, turn_rate): &(Vectors<T, S, N>, Vectors<T, S, N>)) -> Vectors<T, S, N> {
        let Self { pose: WarpPose { lanes, linear, turn, at }, slopes } = self;
        let (lanes, along) = (*lanes, lanes.dot(turn, linear));
        let on_turn = lanes.scale(lanes.mul(slopes.c, along), turn);
        let by_turn = lanes.scale_add(slopes.b, &lanes.cross(turn, linear), &on_turn);
        let by_turn = lanes.scale_add(slopes.a, linear, &by_turn);
        let rotated = turned(lanes, turn, linear_rate, (at.b, at.c));
        let stretch = lanes.scale_add(lanes.mul(at.c, lanes.dot(linear, turn_rate)), turn, &rotated);
        let stretch = lanes.scale_add(lanes.mul(at.c, along), turn_rate, &stretch);
        let crossed = lanes.scale_add(at.b, &lanes.cross(turn_rate, linear), &stretch);
        lanes.scale_add(lanes.dot(turn, turn_rate), &by_turn, &crossed)
    }

    /// (R̃ᵀF, DᵀF), where DᵀF = (A' y·F + B' w·(y × F) + C' (w·y)(w·F)) w + B y × F + C ((w·F) y + (w·y) F).
    #[inline(always)]
    pub fn pull_back(&self, force: &Vectors<T, S, N>) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        let Self { pose: WarpPose { lanes, linear, turn, at }, slopes } = self;
        let lanes = *lanes;
        let on_linear = turned_back(lanes, turn, force, (at.b, at.c));
        let crossed = lanes.cross(linear, force);
        let (along, along_force) = (lanes.dot(turn, linear), lanes.dot(turn, force));
        let by_turn = lanes.mul(slopes.c, lanes.mul(along, along_force));
        let by_turn = lanes.mul_add(slopes.b, lanes.dot(turn, &crossed), by_turn);
        let by_turn = lanes.mul_add(slopes.a, lanes.dot(linear, force), by_turn);
        let stretch = lanes.scale_add(lanes.mul(at.c, along), force, &lanes.scale(by_turn, turn));
        let stretch = lanes.scale_add(lanes.mul(at.c, along_force), linear, &stretch);
        (on_linear, lanes.scale_add(at.b, &crossed, &stretch))
    }
}

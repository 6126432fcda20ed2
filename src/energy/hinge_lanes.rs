//! Hinges side by side in the processor's registers, each by the formulas of [`super::hinge`], operation by operation: to the same bits.

use super::Mat3;
use crate::Vec3;
use pulp::{Arch, Simd, WithSimd};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Hinges that are computed at once.
pub const LANES: usize = 8;
/// A number of each.
pub type Lanes = [f64; LANES];

/// x, y and z of each corner in turn.
pub struct Corners([Lanes; 12]);

/// What corners tell of their angles.
pub struct Slopes {
    /// ∂θ by the corners, and them.
    pub(super) gradient: [Lanes; 12],
    /// |N|² of both triangles.
    pub squared: [Lanes; 2],
    /// The sine and the cosine of θ, but for a factor.
    pub angle: [Lanes; 2],
}

/// What is made of ∂²θ and ∇θ.
pub enum Blocks {
    /// w (∇θ∇θᵀ + t ∂²θ) of t and w.
    Both(Lanes, Lanes),
    /// w ∇θ∇θᵀ of w.
    Rows(Lanes),
    /// m ∂²θ of m.
    Curved(Lanes),
}

/// The blocks by their columns, side by side.
pub type Room = [Lanes; 16 * 9];

impl Corners {
    /// Of up to [`LANES`] hinges; what is left of the lanes has the last one again.
    pub fn of(hinges: impl Iterator<Item = [Vec3; 4]>) -> Self {
        let mut corners = Self::new();
        corners.set(hinges);
        corners
    }

    /// Zeros.
    pub fn new() -> Self {
        Self([[0.0; LANES]; 12])
    }

    /// To those of such hinges.
    #[inline(always)]
    pub fn set(&mut self, hinges: impl Iterator<Item = [Vec3; 4]>) {
        let (Self(lanes), mut count) = (self, 0);
        for corners in hinges {
            for (own, x) in lanes.chunks_exact_mut(3).zip(corners) {
                (0..3).for_each(|c| own[c][count] = x[c]);
            }
            count += 1;
        }
        for own in lanes {
            let last = own[count - 1];
            own[count..].fill(last);
        }
    }

    /// What they tell of their angles.
    pub fn slopes(&self, arch: Arch) -> Slopes {
        let mut slopes = Slopes::new();
        self.find_slopes(arch, &mut slopes);
        slopes
    }

    /// The same.
    pub fn find_slopes(&self, arch: Arch, slopes: &mut Slopes) {
        arch.dispatch(FindSlopes { corners: self, slopes });
    }

    /// What is made of them where no triangle has collapsed.
    pub fn blocks(&self, arch: Arch, slopes: &Slopes, blocks: &Blocks, room: &mut Room) {
        arch.dispatch(FindBlocks { corners: self, slopes, blocks, room });
    }
}

impl Slopes {
    /// Zeros.
    pub fn new() -> Self {
        let none = [0.0; LANES];
        Self { gradient: [none; 12], squared: [none; 2], angle: [none; 2] }
    }

    /// ∂θ of one.
    #[inline(always)]
    pub fn gradient(&self, lane: usize) -> [Vec3; 4] {
        let [x, y, z] = [0, 1, 2].map(|c| [0, 3, 6, 9].map(|k| self.gradient[k + c][lane]));
        std::array::from_fn(|k| Vec3::new(x[k], y[k], z[k]))
    }
}

/// The blocks of one.
#[inline(always)]
pub fn read(room: &Room, lane: usize) -> [Mat3; 16] {
    std::array::from_fn(|ij| {
        let [a, b, c, d, e, f, g, h, i] = std::array::from_fn(|k| room[9 * ij + k][lane]);
        Mat3::new(a, d, g, b, e, h, c, f, i)
    })
}

/// A register of numbers.
#[derive(Clone, Copy)]
pub(super) struct Number<S: Simd>(S, S::f64s);
/// As many vectors.
pub(super) type Vector<S> = [Number<S>; 3];
/// As many matrices, column by column.
pub(super) type Matrix<S> = [Number<S>; 9];

/// An operator by the register's own.
macro_rules! operator {
    ($name:ident, $method:ident, $own:ident) => {
        impl<S: Simd> $name for Number<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0, self.0.$own(self.1, other.1))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Number<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}

impl<S: Simd> Number<S> {
    #[inline(always)]
    pub(super) fn of(simd: S, number: f64) -> Self {
        Self(simd, simd.splat_f64s(number))
    }

    /// The r-th register of lanes.
    #[inline(always)]
    pub(super) fn at(simd: S, lanes: &Lanes, r: usize) -> Self {
        Self(simd, S::as_simd_f64s(lanes).0[r])
    }

    #[inline(always)]
    pub(super) fn put(self, lanes: &mut Lanes, r: usize) {
        S::as_mut_simd_f64s(lanes).0[r] = self.1;
    }

    #[inline(always)]
    fn root(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }
}

// Loops in place of closures: these would not be compiled for the registers.

#[inline(always)]
fn less<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn times<S: Simd>(a: Vector<S>, by: Number<S>) -> Vector<S> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
fn over<S: Simd>(a: Vector<S>, by: Number<S>) -> Vector<S> {
    [a[0] / by, a[1] / by, a[2] / by]
}

#[inline(always)]
fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> Number<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<S: Simd>([ax, ay, az]: Vector<S>, [bx, by, bz]: Vector<S>) -> Vector<S> {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

/// The matrix times [v]×, as [`super::hinge`] has it.
#[inline(always)]
fn across<S: Simd>(matrix: &Matrix<S>, [vx, vy, vz]: Vector<S>) -> Matrix<S> {
    let mut out = *matrix;
    for r in 0..3 {
        let [x, y, z] = [matrix[r], matrix[3 + r], matrix[6 + r]];
        out[r] = y * vz - z * vy;
        out[3 + r] = z * vx - x * vz;
        out[6 + r] = x * vy - y * vx;
    }
    out
}

/// Registers that lanes fill.
pub(super) fn registers<S: Simd>() -> usize {
    LANES * size_of::<f64>() / size_of::<S::f64s>()
}

/// The k-th corner.
#[inline(always)]
pub(super) fn corner<S: Simd>(simd: S, Corners(lanes): &Corners, k: usize, r: usize) -> Vector<S> {
    let [x, y, z] = [&lanes[3 * k], &lanes[3 * k + 1], &lanes[3 * k + 2]];
    [Number::at(simd, x, r), Number::at(simd, y, r), Number::at(simd, z, r)]
}

struct FindSlopes<'a> {
    corners: &'a Corners,
    slopes: &'a mut Slopes,
}

impl WithSimd for FindSlopes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Slopes { gradient, squared, angle } = self.slopes;
        let one = Number::of(simd, 1.0);
        for r in 0..registers::<S>() {
            let (a, b) = (corner(simd, self.corners, 0, r), corner(simd, self.corners, 1, r));
            let (c, d) = (corner(simd, self.corners, 2, r), corner(simd, self.corners, 3, r));
            let edge = less(b, a);
            let (n1, n2) = (cross(edge, less(c, a)), cross(less(d, a), edge));
            let length = dot(edge, edge).root();
            let (s1, s2) = (dot(n1, n1), dot(n2, n2));
            let (g1, g2) = (times(n1, length / s1), times(n2, length / s2));
            let (t1, t2) = (dot(less(c, a), edge) / (length * length), dot(less(d, a), edge) / (length * length));
            for c in 0..3 {
                ((one - t1) * g1[c] + (one - t2) * g2[c]).put(&mut gradient[c], r);
                (t1 * g1[c] + t2 * g2[c]).put(&mut gradient[3 + c], r);
                (-g1[c]).put(&mut gradient[6 + c], r);
                (-g2[c]).put(&mut gradient[9 + c], r);
            }
            s1.put(&mut squared[0], r);
            s2.put(&mut squared[1], r);
            dot(cross(n1, n2), over(edge, length)).put(&mut angle[0], r);
            dot(n1, n2).put(&mut angle[1], r);
        }
    }
}

/// Adds what one triangle has of ∂²θ, as [`super::hinge`].
#[inline(always)]
pub(super) fn add_curvature_share<S: Simd>(
    simd: S,
    blocks: &mut [Matrix<S>; 16],
    [p, q, r]: [Vector<S>; 3],
    slots: [usize; 3],
) {
    let (one, two) = (Number::of(simd, 1.0), Number::of(simd, 2.0));
    let (edge, way) = (less(q, p), less(r, p));
    let (squared, normal) = (dot(edge, edge), cross(edge, way));
    let double_area = dot(normal, normal).root();
    let (length, unit) = (squared.root(), over(normal, double_area));
    let g = times([-unit[0], -unit[1], -unit[2]], length / double_area);
    let t = dot(way, edge) / squared;
    let (along, away) = (over(edge, squared), over(way, squared));
    let d_t = [less(times(along, two * t - one), away), less(away, times(along, two * t)), along];
    let factor = length / (double_area * double_area);
    let (mut mirror, mut stretch) = ([one; 9], [one; 9]);
    for e in 0..9 {
        let outer = two * unit[e % 3] * unit[e / 3];
        mirror[e] = (if e % 4 == 0 { outer - one } else { outer }) * factor;
        stretch[e] = g[e % 3] * along[e / 3];
    }
    let mut d_g = [across(&mirror, less(r, q)), across(&mirror, less(p, r)), across(&mirror, edge)];
    for e in 0..9 {
        d_g[0][e] = d_g[0][e] - stretch[e];
        d_g[1][e] = d_g[1][e] + stretch[e];
    }
    let (before, behind) = (t - one, -t);
    for k in 0..3 {
        let [a, b, c] = [4 * slots[0] + slots[k], 4 * slots[1] + slots[k], 4 * slots[2] + slots[k]];
        for e in 0..9 {
            let turn = g[e % 3] * d_t[k][e / 3];
            blocks[a][e] = blocks[a][e] + (before * d_g[k][e] + turn);
            blocks[b][e] = blocks[b][e] + (behind * d_g[k][e] - turn);
            blocks[c][e] = blocks[c][e] + d_g[k][e];
        }
    }
}

struct FindBlocks<'a> {
    corners: &'a Corners,
    slopes: &'a Slopes,
    blocks: &'a Blocks,
    room: &'a mut Room,
}

impl WithSimd for FindBlocks<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { slopes: Slopes { gradient, .. }, room, .. } = self;
        let zero = Number::of(simd, 0.0);
        for r in 0..registers::<S>() {
            let mut blocks = [[zero; 9]; 16];
            if !matches!(self.blocks, Blocks::Rows(_)) {
                let (a, b) = (corner(simd, self.corners, 0, r), corner(simd, self.corners, 1, r));
                let (c, d) = (corner(simd, self.corners, 2, r), corner(simd, self.corners, 3, r));
                add_curvature_share(simd, &mut blocks, [a, b, c], [0, 1, 2]);
                add_curvature_share(simd, &mut blocks, [b, a, d], [1, 0, 3]);
            }
            let (turn, weight) = match self.blocks {
                Blocks::Curved(moment) => {
                    let moment = Number::at(simd, moment, r);
                    for ij in 0..16 {
                        for e in 0..9 {
                            (moment * blocks[ij][e]).put(&mut room[9 * ij + e], r);
                        }
                    }
                    continue;
                }
                Blocks::Both(turn, weight) => (Number::at(simd, turn, r), Number::at(simd, weight, r)),
                Blocks::Rows(weight) => (zero, Number::at(simd, weight, r)),
            };
            for i in 0..4 {
                for j in 0..4 {
                    for e in 0..9 {
                        let [row, column] = [3 * i + e % 3, 3 * j + e / 3];
                        let outer = Number::at(simd, &gradient[row], r) * Number::at(simd, &gradient[column], r);
                        let ij = 4 * i + j;
                        (weight * (blocks[ij][e] * turn + outer)).put(&mut room[9 * ij + e], r);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hinge::{angle_curvature, angle_gradient, normals};
    use super::*;

    /// Bent in all ways, of sizes from 1e-3 to 1e3.
    fn hinges(count: usize) -> Vec<[Vec3; 4]> {
        let number = |k: usize| libm::sin(1.0 + (k * k) as f64);
        let corner = |k: usize| libm::pow(10.0, 3.0 * number(7 * k)) * Vec3::from_fn(|c, _| number(3 * k + c));
        (0..count).map(|h| std::array::from_fn(|i| corner(4 * h + i))).collect()
    }

    /// Of every entry that is not zero, all bits.
    fn same(a: &[Mat3; 16], b: &[Mat3; 16]) -> bool {
        a.iter().zip(b).all(|(a, b)| a == b)
    }

    #[test]
    fn hinges_side_by_side_have_the_bits_of_each_alone() {
        for (count, arch) in [(1, Arch::new()), (5, Arch::Scalar), (LANES, Arch::new()), (LANES, Arch::Scalar)] {
            let hinges = hinges(count);
            let corners = Corners::of(hinges.iter().copied());
            let slopes = corners.slopes(arch);
            let [turn, weight]: [Lanes; 2] = [1.0, 2.0].map(|k| std::array::from_fn(|l| libm::cos(k + l as f64)));
            let mut rooms = [[[0.0; LANES]; 144]; 3];
            let kinds = [Blocks::Both(turn, weight), Blocks::Rows(weight), Blocks::Curved(weight)];
            kinds.iter().zip(&mut rooms).for_each(|(kind, room)| corners.blocks(arch, &slopes, kind, room));
            for (lane, hinge) in hinges.iter().enumerate() {
                let (gradient, curvature) = (angle_gradient(hinge), angle_curvature(hinge));
                assert_eq!(slopes.gradient(lane), gradient);
                let (n1, n2) = normals(hinge);
                assert_eq!(slopes.squared.map(|s| s[lane]), [n1.norm_squared(), n2.norm_squared()]);
                let unit = (hinge[1] - hinge[0]).normalize();
                assert_eq!(slopes.angle.map(|s| s[lane]), [n1.cross(&n2).dot(&unit), n1.dot(&n2)]);
                let outer: [Mat3; 16] = std::array::from_fn(|ij| gradient[ij / 4] * gradient[ij % 4].transpose());
                let both = std::array::from_fn(|ij| weight[lane] * (curvature[ij] * turn[lane] + outer[ij]));
                assert!(same(&read(&rooms[0], lane), &both));
                assert!(same(&read(&rooms[1], lane), &outer.map(|block| weight[lane] * block)));
                assert!(same(&read(&rooms[2], lane), &curvature.map(|block| weight[lane] * block)));
            }
        }
    }
}

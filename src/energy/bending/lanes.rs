//! Patches side by side in the processor's registers, each by the formulas of [`super::triangle`], operation by operation: to the same bits.

use super::super::Mat3;
use super::super::hinge_lanes::{Corners, LANES, Lanes, Number, Slopes, add_curvature_share, corner, registers};
use crate::Vec3;
use pulp::{Arch, Simd, WithSimd};

/// Vertices of a patch: its corners, and what is beyond each edge.
pub const SLOTS: usize = 6;
/// Elements of a patch.
const ELEMENTS: usize = 3;

/// Those of the k-th edge's ends, of the corner opposite to it, and of what is beyond.
pub const fn slots_of(k: usize) -> [usize; 4] {
    [(k + 1) % 3, (k + 2) % 3, k, 3 + k]
}

/// Edges of patches, by their number in the patch.
pub struct Bends {
    pub corners: [Corners; 3],
    pub slopes: [Slopes; 3],
    /// 1, or 2 at a clamp.
    pub factors: [Lanes; 3],
}

/// Each element's angles at the edges, by element and edge; zeros for an element that does not count.
pub type Rows = [[Lanes; 3]; ELEMENTS];

/// x, y and z of each element's gradient by each slot.
pub struct Gradients([[Lanes; 3 * SLOTS]; ELEMENTS]);

/// The blocks by their columns.
pub struct Room([Lanes; 9 * SLOTS * SLOTS]);

impl Bends {
    /// ∇ε of the elements.
    pub fn gradients(&self, arch: Arch, rows: &Rows, out: &mut Gradients) {
        arch.dispatch(FindGradients { bends: self, rows, out });
    }

    /// Σ ∇ε∇εᵀ over the elements, if their gradients are given, and Σ m ∂²θ over the edges, if moments m are. No triangle may have collapsed.
    pub fn blocks(&self, arch: Arch, moments: Option<&[Lanes; 3]>, gradients: Option<&Gradients>, out: &mut Room) {
        arch.dispatch(FindBlocks { bends: self, moments, gradients, out });
    }
}

impl Gradients {
    /// Zeros.
    pub fn new() -> Self {
        Self([[[0.0; LANES]; 3 * SLOTS]; ELEMENTS])
    }

    /// Of an element of one by a slot.
    #[inline(always)]
    pub fn read(&self, lane: usize, element: usize, slot: usize) -> Vec3 {
        let at = |c: usize| self.0[element][3 * slot + c][lane];
        Vec3::new(at(0), at(1), at(2))
    }
}

impl Room {
    /// Zeros.
    pub fn new() -> Self {
        Self([[0.0; LANES]; 9 * SLOTS * SLOTS])
    }

    /// A block of one, by its slots.
    #[inline(always)]
    pub fn read(&self, lane: usize, [i, j]: [usize; 2]) -> Mat3 {
        let first = 9 * (SLOTS * i + j);
        let at = |k: usize| self.0[first + k][lane];
        Mat3::new(at(0), at(3), at(6), at(1), at(4), at(7), at(2), at(5), at(8))
    }
}

struct FindGradients<'a> {
    bends: &'a Bends,
    rows: &'a Rows,
    out: &'a mut Gradients,
}

impl WithSimd for FindGradients<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { bends: Bends { slopes, factors, .. }, rows, out: Gradients(out) } = self;
        let zero = Number::of(simd, 0.0);
        for r in 0..registers::<S>() {
            for i in 0..ELEMENTS {
                let mut sums = [zero; 3 * SLOTS];
                for k in 0..3 {
                    let (row, factor) = (Number::at(simd, &rows[i][k], r), Number::at(simd, &factors[k], r));
                    let slots = slots_of(k);
                    for p in 0..4 {
                        for c in 0..3 {
                            let slope = factor * Number::at(simd, &slopes[k].gradient[3 * p + c], r);
                            let at = 3 * slots[p] + c;
                            sums[at] = sums[at] + row * slope;
                        }
                    }
                }
                for c in 0..3 * SLOTS {
                    sums[c].put(&mut out[i][c], r);
                }
            }
        }
    }
}

struct FindBlocks<'a> {
    bends: &'a Bends,
    moments: Option<&'a [Lanes; 3]>,
    gradients: Option<&'a Gradients>,
    out: &'a mut Room,
}

impl WithSimd for FindBlocks<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { bends: Bends { corners, .. }, moments, gradients, out: Room(out) } = self;
        let zero = Number::of(simd, 0.0);
        out.fill([0.0; LANES]);
        for r in 0..registers::<S>() {
            if let Some(moments) = moments {
                for k in 0..3 {
                    let [a, b, c, d] = std::array::from_fn(|p| corner(simd, &corners[k], p, r));
                    let mut curvature = [[zero; 9]; 16];
                    add_curvature_share(simd, &mut curvature, [a, b, c], [0, 1, 2]);
                    add_curvature_share(simd, &mut curvature, [b, a, d], [1, 0, 3]);
                    let (moment, slots) = (Number::at(simd, &moments[k], r), slots_of(k));
                    for ij in 0..16 {
                        let first = 9 * (SLOTS * slots[ij / 4] + slots[ij % 4]);
                        for e in 0..9 {
                            let sum = Number::at(simd, &out[first + e], r) + moment * curvature[ij][e];
                            sum.put(&mut out[first + e], r);
                        }
                    }
                }
            }
            let Some(Gradients(gradients)) = gradients else { continue };
            for ij in 0..SLOTS * SLOTS {
                let (row, column) = (3 * (ij / SLOTS), 3 * (ij % SLOTS));
                for e in 0..9 {
                    let mut sum = Number::at(simd, &out[9 * ij + e], r);
                    for i in 0..ELEMENTS {
                        let left = Number::at(simd, &gradients[i][row + e % 3], r);
                        sum = sum + left * Number::at(simd, &gradients[i][column + e / 3], r);
                    }
                    sum.put(&mut out[9 * ij + e], r);
                }
            }
        }
    }
}

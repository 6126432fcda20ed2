//! What points follow: sums over three corners of a triangle, some points at once.

use super::frames::Followed;
use super::{Row, Turning};
use pulp::{Arch, Simd, WithSimd};

/// Points whose sums lie ready before they are taken.
const BLOCK: usize = 64;

/// N rows of factors with the same corners.
pub(super) trait Rows<const N: usize> {
    fn factors(&self) -> [&[[f32; 4]; 3]; N];
    fn corners(&self) -> &[u32; 3];
}

impl Rows<1> for Row {
    fn factors(&self) -> [&[[f32; 4]; 3]; 1] {
        [&self.factors]
    }

    fn corners(&self) -> &[u32; 3] {
        &self.corners
    }
}

impl Rows<2> for Turning {
    fn factors(&self) -> [&[[f32; 4]; 3]; 2] {
        let [t, s] = &self.factors;
        [t, s]
    }

    fn corners(&self) -> &[u32; 3] {
        &self.corners
    }
}

/// The sums of one point, in the mesh's size.
#[inline(always)]
pub(super) fn applied<const N: usize>(rows: &impl Rows<N>, followed: &[Followed]) -> [[f32; 4]; N] {
    let (factors, mut sums) = (rows.factors(), [[0f32; 4]; N]);
    for (i, corner) in rows.corners().iter().enumerate() {
        let corner = &followed[*corner as usize];
        for (k, part) in corner.iter().enumerate() {
            for (sum, row) in sums.iter_mut().zip(factors) {
                for lane in 0..4 {
                    sum[lane] += row[i][k] * part[lane];
                }
            }
        }
    }
    sums
}

/// Those of a block. All four lanes go to memory, so that they stay one register each.
struct Block<'a, R, const N: usize> {
    rows: &'a [R],
    followed: &'a [Followed],
    out: &'a mut [[[f32; 4]; N]],
}

impl<R: Rows<N>, const N: usize> WithSimd for Block<'_, R, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (out, rows) in self.out.iter_mut().zip(self.rows) {
            *out = applied(rows, self.followed);
        }
    }
}

/// Hands the sums of each of `rows` to `take`, in order. They are the same by all instructions: nothing is summed across registers, or multiplied and added in one.
pub(super) fn sums<R: Rows<N>, const N: usize>(
    arch: Arch,
    rows: &[R],
    followed: &[Followed],
    mut take: impl FnMut(usize, [[f32; 4]; N]),
) {
    let mut out = [[[0f32; 4]; N]; BLOCK];
    for (b, rows) in rows.chunks(BLOCK).enumerate() {
        arch.dispatch(Block { rows, followed, out: &mut out });
        out[..rows.len()].iter().enumerate().for_each(|(i, sums)| take(b * BLOCK + i, *sums));
    }
}

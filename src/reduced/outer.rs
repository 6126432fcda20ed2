//! Sums of outer products on top of a few rows of a matrix: what factors and Hessians are made of.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::sums::Sums;
use pulp::Simd;

/// Rows that are made at once.
pub const ROWS: usize = 4;

/// own_r += Σ_j left_j[k + r] right_j over rows j, in columns from the k-th on at the latest. `own` are [`ROWS`] rows of `stride` numbers.
///
/// Loops stand where closures would do: those that reach a function of the standard library lose the processor's wide registers.
#[inline(always)]
pub fn add_outer<S: Simd, T: Sums<S>>(
    simd: S,
    sides: (&[T::Number], &[T::Number]),
    own: &mut [T::Number],
    (k, stride): (usize, usize),
) {
    let columns = stride / T::LANES;
    let widest = size_of::<S::f64s>() == 64;
    let mut a = k / T::LANES;
    // The widest registers are twice as many, too.
    while widest && a + 4 <= columns {
        add_tile::<S, T, 4>(simd, sides, own, (k, stride), a);
        a += 4;
    }
    if widest && a + 3 == columns {
        return add_tile::<S, T, 3>(simd, sides, own, (k, stride), a);
    }
    while a + 2 <= columns {
        add_tile::<S, T, 2>(simd, sides, own, (k, stride), a);
        a += 2;
    }
    if a < columns {
        add_tile::<S, T, 1>(simd, sides, own, (k, stride), a);
    }
}

/// In C registers of each row, from the a-th on.
#[inline(always)]
fn add_tile<S: Simd, T: Sums<S>, const C: usize>(
    simd: S,
    (left, right): (&[T::Number], &[T::Number]),
    own: &mut [T::Number],
    (k, stride): (usize, usize),
    a: usize,
) {
    let columns = stride / T::LANES;
    let (right, own) = (T::view(right), T::registers(own));
    let mut sums = [[T::splat(simd, T::Number::default()); C]; ROWS];
    for (r, sums) in sums.iter_mut().enumerate() {
        sums.copy_from_slice(&own[r * columns + a..][..C]);
    }
    for (left, right) in left.chunks_exact(stride).zip(right.chunks_exact(columns)) {
        let factors = &left.as_chunks::<ROWS>().0[k / ROWS];
        let Some(right) = right[a..].first_chunk::<C>() else { return };
        for r in 0..ROWS {
            let factor = T::splat(simd, factors[r]);
            for c in 0..C {
                sums[r][c] = T::multiply_add(simd, right[c], factor, sums[r][c]);
            }
        }
    }
    for (r, sums) in sums.iter().enumerate() {
        own[r * columns + a..][..C].copy_from_slice(sums);
    }
}

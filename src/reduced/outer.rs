//! Sums of outer products on top of a few rows of a matrix: what factors and Hessians are made of.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use pulp::Simd;

/// Rows that are made at once.
pub const ROWS: usize = 4;

/// own_r += Σ_j left_j[k + r] right_j over rows j, in columns from the k-th on at the latest. `own` are [`ROWS`] rows of `stride` numbers.
///
/// Loops stand where closures would do: those that reach a function of the standard library lose the processor's wide registers.
#[inline(always)]
pub fn add_outer<S: Simd>(simd: S, sides: (&[f64], &[f64]), own: &mut [f64], (k, stride): (usize, usize)) {
    let lanes = size_of::<S::f64s>() / size_of::<f64>();
    let columns = stride / lanes;
    let mut a = k / lanes;
    // The widest registers are twice as many, too.
    while lanes == 8 && a + 4 <= columns {
        add_tile::<S, 4>(simd, sides, own, (k, stride), a);
        a += 4;
    }
    if lanes == 8 && a + 3 == columns {
        return add_tile::<S, 3>(simd, sides, own, (k, stride), a);
    }
    while a + 2 <= columns {
        add_tile::<S, 2>(simd, sides, own, (k, stride), a);
        a += 2;
    }
    if a < columns {
        add_tile::<S, 1>(simd, sides, own, (k, stride), a);
    }
}

/// In C registers of each row, from the a-th on.
#[inline(always)]
fn add_tile<S: Simd, const C: usize>(
    simd: S,
    (left, right): (&[f64], &[f64]),
    own: &mut [f64],
    (k, stride): (usize, usize),
    a: usize,
) {
    let columns = stride * size_of::<f64>() / size_of::<S::f64s>();
    let (right, own) = (S::as_simd_f64s(right).0, S::as_mut_simd_f64s(own).0);
    let mut sums = [[simd.splat_f64s(0.0); C]; ROWS];
    for (r, sums) in sums.iter_mut().enumerate() {
        sums.copy_from_slice(&own[r * columns + a..][..C]);
    }
    for (left, right) in left.chunks_exact(stride).zip(right.chunks_exact(columns)) {
        let factors = &left.as_chunks::<ROWS>().0[k / ROWS];
        let Some(right) = right[a..].first_chunk::<C>() else { return };
        for r in 0..ROWS {
            let factor = simd.splat_f64s(factors[r]);
            for c in 0..C {
                sums[r][c] = simd.mul_add_e_f64s(right[c], factor, sums[r][c]);
            }
        }
    }
    for (r, sums) in sums.iter().enumerate() {
        own[r * columns + a..][..C].copy_from_slice(sums);
    }
}

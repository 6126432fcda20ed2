//! Sums that a Newton step in motion is made of: what is linear in q has 64 bits, Qq has 32. Rows of a form lie as a factor's rows do
//! ([`factor::row`](super::super::factor::row)).
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::super::factor::SIDE;
use super::super::sums::{Double, Single, Sums};
use super::kernel::{self, ROWS};
use pulp::{Simd, bytemuck};

/// Of the forms that fill no side, how many have their Q by rows: less is multiplied than with a side for them.
pub const LAST: usize = SIDE / 2;

/// Of so many forms, how many lie side by side; the others are at most [`LAST`].
pub fn beside(count: usize) -> usize {
    let last = count % SIDE;
    if last <= LAST { count - last } else { count }
}

/// Registers of 64 bits for one of 32: 1 where each holds one number.
#[inline(always)]
fn halves<S: Simd>() -> usize {
    <Single as Sums<S>>::LANES / <Double as Sums<S>>::LANES
}

/// s = A·q + ½ q·Qq, on `q`'s fields: the linear part in 64 bits, Qq as [`turn`] gives it in 32.
#[inline(always)]
pub fn strains<S: Simd>(simd: S, (q, narrow): (&[f64], &[f32]), linear: &[f64], turned: &[f32], s: &mut [f64]) {
    let (side, halves) = (SIDE / <Single as Sums<S>>::LANES, halves::<S>());
    let (linear, turned) = (S::as_simd_f64s(linear).0, S::as_simd_f32s(turned).0);
    let blocks = linear.chunks_exact(halves * side * q.len()).zip(turned.chunks_exact(side * q.len()));
    for ((linear, turned), s) in blocks.zip(s.chunks_exact_mut(SIDE)) {
        for part in 0..side {
            let mut sums = [[simd.splat_f64s(0.0); 2]; ROWS]; // in turn, for one waits for the one before
            let mut seconds = [simd.splat_f32s(0.0); ROWS];
            for (i, (q, narrow)) in q.as_chunks::<ROWS>().0.iter().zip(narrow.as_chunks::<ROWS>().0).enumerate() {
                for r in 0..ROWS {
                    let at = (i * ROWS + r) * side + part;
                    let own = simd.splat_f64s(q[r]);
                    for half in 0..halves {
                        sums[r][half] = simd.mul_add_e_f64s(linear[halves * at + half], own, sums[r][half]);
                    }
                    seconds[r] = simd.mul_add_e_f32s(turned[at], simd.splat_f32s(narrow[r]), seconds[r]);
                }
            }
            let mut second = [simd.splat_f32s(0.0)];
            second[0] = simd.add_f32s(simd.add_f32s(seconds[0], seconds[1]), simd.add_f32s(seconds[2], seconds[3]));
            let mut first = [simd.splat_f64s(0.0); 2];
            for half in 0..halves {
                let [a, b, c, d] = sums;
                first[half] = simd.add_f64s(simd.add_f64s(a[half], b[half]), simd.add_f64s(c[half], d[half]));
            }
            let first = bytemuck::cast_slice::<S::f64s, f64>(&first);
            let second = bytemuck::cast_slice::<S::f32s, f32>(&second);
            let own = &mut s[part * second.len()..][..second.len()];
            for ((s, first), second) in own.iter_mut().zip(first).zip(second) {
                *s = first + 0.5 * f64::from(*second);
            }
        }
    }
}

/// out = Σ c_k r_k over rows, in the registers from that with the number `first` on.
#[inline(always)]
pub fn sum_rows<S: Simd, T: Sums<S>>(
    simd: S,
    rows: &[T::Number],
    factors: &[T::Number],
    (stride, first): (usize, usize),
    out: &mut [T::Number],
) {
    let columns = stride / T::LANES;
    let mut a = first / T::LANES;
    while a + 4 <= columns {
        sum_tile::<S, T, 4>(simd, rows, factors, (columns, a), out);
        a += 4;
    }
    if a + 3 == columns {
        return sum_tile::<S, T, 3>(simd, rows, factors, (columns, a), out);
    }
    while a + 2 <= columns {
        sum_tile::<S, T, 2>(simd, rows, factors, (columns, a), out);
        a += 2;
    }
    if a < columns {
        sum_tile::<S, T, 1>(simd, rows, factors, (columns, a), out);
    }
}

/// In C registers from the a-th on.
#[inline(always)]
fn sum_tile<S: Simd, T: Sums<S>, const C: usize>(
    simd: S,
    rows: &[T::Number],
    factors: &[T::Number],
    (columns, a): (usize, usize),
    out: &mut [T::Number],
) {
    let mut sums = [[T::splat(simd, T::Number::default()); C]; 2]; // in turn, for one waits for the one before
    let mut rows = T::view(rows).chunks_exact(columns);
    let (pairs, last) = factors.as_chunks::<2>();
    for pair in pairs {
        for k in 0..2 {
            let Some(row) = rows.next().and_then(|row| row[a..].first_chunk::<C>()) else { return };
            let factor = T::splat(simd, pair[k]);
            for c in 0..C {
                sums[k][c] = T::multiply_add(simd, row[c], factor, sums[k][c]);
            }
        }
    }
    if let ([factor], Some(row)) = (last, rows.next().and_then(|row| row[a..].first_chunk::<C>())) {
        let factor = T::splat(simd, *factor);
        for c in 0..C {
            sums[0][c] = T::multiply_add(simd, row[c], factor, sums[0][c]);
        }
    }
    for (c, out) in T::registers(out)[a..a + C].iter_mut().enumerate() {
        *out = T::add(simd, sums[0][c], sums[1][c]);
    }
}

/// Qq and s of the last forms, whose Q, and A, are by rows; with q placed as rows are.
#[inline(always)]
pub fn last_strains<S: Simd>(
    simd: S,
    (wide, q): (&[f64], &[f32]),
    (linear, squares): (&[f64], &[f32]),
    first: usize,
    (rows, s): (&mut [f32], &mut [f64]),
) {
    let stride = q.len();
    let own = &q[first..];
    let forms = linear.chunks_exact(stride).zip(squares.chunks_exact(own.len().max(1) * stride));
    for (((linear, square), row), s) in forms.zip(rows.chunks_exact_mut(stride)).zip(s) {
        sum_rows::<S, Single>(simd, square, own, (stride, first), row);
        let mut sum = simd.splat_f64s(0.0);
        for (a, q) in S::as_simd_f64s(linear).0.iter().zip(S::as_simd_f64s(wide).0) {
            sum = simd.mul_add_e_f64s(*a, *q, sum);
        }
        let mut second = simd.splat_f32s(0.0);
        for (turned, q) in S::as_simd_f32s(row).0.iter().zip(S::as_simd_f32s(q).0) {
            second = simd.mul_add_e_f32s(*turned, *q, second);
        }
        *s = simd.reduce_sum_f64s(sum) + 0.5 * f64::from(simd.reduce_sum_f32s(second));
    }
}

/// out += Σ c_k r_k, of what lies by fields, of forms side by side, on a multiple of [`ROWS`] fields.
#[inline(always)]
pub fn add_forms<S: Simd>(simd: S, fields: &[f32], factors: &[f32], out: &mut [f32]) {
    let (lanes, n) = (<Single as Sums<S>>::LANES, out.len());
    let (fields, factors, side) = (S::as_simd_f32s(fields).0, S::as_simd_f32s(factors).0, SIDE / lanes);
    for (c, out) in out.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
        let mut sums = [simd.splat_f32s(0.0); ROWS];
        for (fields, factors) in fields.chunks_exact(side * n).zip(factors.chunks_exact(side)) {
            for (part, factor) in factors.iter().enumerate() {
                for r in 0..ROWS {
                    sums[r] = simd.mul_add_e_f32s(fields[(c * ROWS + r) * side + part], *factor, sums[r]);
                }
            }
        }
        if lanes < ROWS {
            for r in 0..ROWS {
                out[r] += simd.reduce_sum_f32s(sums[r]);
            }
            continue;
        }
        // Columns for rows in each quarter, which is then what all forms of a number in it have.
        let [a, b, c, d] = simd.interleave_shfl_f32s(sums);
        let sum = [simd.add_f32s(simd.add_f32s(a, b), simd.add_f32s(c, d))];
        for quarter in bytemuck::cast_slice::<S::f32s, [f32; ROWS]>(&sum) {
            (0..ROWS).for_each(|r| out[r] += quarter[r]);
        }
    }
}

/// What lies by fields, of forms side by side, by rows of a form, as [`kernel::by_forms`] gives it.
#[inline(always)]
pub fn by_forms<S: Simd>(simd: S, fields: &[f32], (m, stride, first): (usize, usize, usize), rows: &mut [f32]) {
    let lanes = <Single as Sums<S>>::LANES;
    if lanes < ROWS {
        return kernel::by_forms(fields, (m, stride, first), rows);
    }
    let (parts, quarters, columns) = (SIDE / lanes, lanes / ROWS, stride / ROWS);
    let blocks = S::as_simd_f32s(fields).0.chunks_exact(m * parts);
    for (block, rows) in blocks.zip(rows.as_chunks_mut::<ROWS>().0.chunks_exact_mut(SIDE * columns)) {
        for (c, fields) in block.chunks_exact(ROWS * parts).enumerate() {
            for part in 0..parts {
                let own = [fields[part], fields[parts + part], fields[2 * parts + part], fields[3 * parts + part]];
                // Columns for rows in each quarter: register r has the forms r, r + 4 and so on.
                let own = simd.interleave_shfl_f32s(own);
                for (j, x) in bytemuck::cast_slice::<S::f32s, [f32; ROWS]>(&own).iter().enumerate() {
                    let form = part * lanes + j % quarters * ROWS + j / quarters;
                    rows[form * columns + first / ROWS + c] = *x;
                }
            }
        }
    }
}

/// J = A + Qq of Qq by rows of a form, and each row times its factor.
#[inline(always)]
pub fn join<S: Simd>(
    simd: S,
    linear: &[f32],
    factors: &[f32],
    stride: usize,
    (rows, scaled): (&mut [f32], &mut [f32]),
) {
    let columns = stride / <Single as Sums<S>>::LANES;
    let (linear, rows) = (S::as_simd_f32s(linear).0, S::as_mut_simd_f32s(rows).0);
    let both = linear.chunks_exact(columns).zip(rows.chunks_exact_mut(columns)).zip(factors);
    for (((linear, rows), factor), scaled) in both.zip(S::as_mut_simd_f32s(scaled).0.chunks_exact_mut(columns)) {
        let factor = simd.splat_f32s(*factor);
        for c in 0..columns {
            rows[c] = simd.add_f32s(linear[c], rows[c]);
            scaled[c] = simd.mul_f32s(rows[c], factor);
        }
    }
}

//! UᵀD⁻¹U of small positive definite matrices in registers of any width, D the diagonal of U: those of reduced Hessians.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::outer::{ROWS, add_outer};
use super::products::WIDTH;
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Room for a matrix, and its factor.
#[derive(Clone)]
pub struct Factor {
    n: usize,
    stride: usize,
    /// U and −D⁻¹U by rows, a multiple of [`ROWS`] of them, the last of the identity; what is before the diagonal has no meaning.
    rows: Vec<f64>,
    scaled: Vec<f64>,
    /// 1/D.
    inverse: Vec<f64>,
    /// Of a solution: what is left of the right-hand side, and what is found.
    x: Vec<f64>,
    arch: Arch,
}

impl Factor {
    /// Of the identity, computed in the registers `arch`.
    pub fn new(n: usize, arch: Arch) -> Self {
        let (stride, count) = (n.max(1).next_multiple_of(WIDTH), n.next_multiple_of(ROWS));
        let mut rows = vec![0.0; count * stride];
        (0..count).for_each(|k| rows[k * stride + k] = 1.0);
        let scaled = rows.iter().map(|x| -x).collect();
        Self { n, stride, rows, scaled, inverse: vec![1.0; count], x: vec![0.0; 2 * stride], arch }
    }

    /// Factorizes; of the matrix, the lower triangle counts. False where it is not positive definite, and then there is no factor.
    pub fn factorize(&mut self, matrix: &DMatrix<f64>) -> bool {
        self.rows.fill(0.0); // before the diagonal and beyond the rows there may be no numbers from another matrix
        for (k, (row, column)) in self.rows.chunks_exact_mut(self.stride).zip(matrix.column_iter()).enumerate() {
            row[k..self.n].copy_from_slice(&column.as_slice()[k..]);
        }
        for k in self.n..self.inverse.len() {
            self.rows[k * self.stride + k] = 1.0;
        }
        let Self { stride, rows, scaled, inverse, arch, .. } = self;
        arch.dispatch(Factorize { stride: *stride, rows, scaled, inverse })
    }

    /// x becomes H⁻¹x.
    pub fn solve(&mut self, x: &mut [f64]) {
        let Self { stride, rows, inverse, x: room, arch, .. } = self;
        arch.dispatch(Solve { stride: *stride, rows, inverse, room, x });
    }
}

struct Factorize<'a> {
    stride: usize,
    rows: &'a mut [f64],
    scaled: &'a mut [f64],
    inverse: &'a mut [f64],
}

impl WithSimd for Factorize<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { stride, rows, scaled, inverse } = self;
        let lanes = size_of::<S::f64s>() / size_of::<f64>();
        for (block, inverse) in inverse.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
            let k = ROWS * block;
            let (above, rest) = rows.split_at_mut(k * stride);
            let (scaled_above, scaled) = scaled.split_at_mut(k * stride);
            let own = &mut rest[..ROWS * stride];
            add_outer::<S>(simd, (scaled_above, above), own, (k, stride));
            let Some((below, pivots)) = corner(own, (k, stride)) else { return false };
            *inverse = pivots;
            eliminate::<S>(simd, (own, &mut scaled[..ROWS * stride]), (&below, &pivots), (k / lanes, stride / lanes));
        }
        true
    }
}

/// Of a block's rows: how much of those before it each has, and 1/D; none where one is not positive.
#[inline(always)]
fn corner(own: &[f64], (k, stride): (usize, usize)) -> Option<([[f64; ROWS]; ROWS], [f64; ROWS])> {
    let mut a: [[f64; ROWS]; ROWS] = std::array::from_fn(|r| std::array::from_fn(|c| own[r * stride + k + c]));
    let (mut below, mut inverse) = ([[0.0; ROWS]; ROWS], [0.0; ROWS]);
    let mut positive = true;
    for p in 0..ROWS {
        positive &= a[p][p] > 0.0 && a[p][p] < f64::INFINITY;
        inverse[p] = a[p][p].recip();
        for r in p + 1..ROWS {
            below[r][p] = a[p][r] * inverse[p];
            for c in r..ROWS {
                a[r][c] -= below[r][p] * a[p][c];
            }
        }
    }
    positive.then_some((below, inverse))
}

/// Takes off each row of a block what it has of those before it.
#[inline(always)]
fn eliminate<S: Simd>(
    simd: S,
    (own, scaled): (&mut [f64], &mut [f64]),
    (below, inverse): (&[[f64; ROWS]; ROWS], &[f64; ROWS]),
    (from, columns): (usize, usize),
) {
    let [(own, _), (scaled, _)] = [own, scaled].map(|x| S::as_mut_simd_f64s(x));
    for c in from..columns {
        let mut x: [S::f64s; ROWS] = std::array::from_fn(|r| own[r * columns + c]);
        for r in 0..ROWS {
            for p in 0..r {
                x[r] = simd.negate_mul_add_e_f64s(x[p], simd.splat_f64s(below[r][p]), x[r]);
            }
            own[r * columns + c] = x[r];
            scaled[r * columns + c] = simd.mul_f64s(x[r], simd.splat_f64s(-inverse[r]));
        }
    }
}

struct Solve<'a> {
    stride: usize,
    rows: &'a [f64],
    inverse: &'a [f64],
    room: &'a mut [f64],
    x: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { stride, rows, inverse, room, x } = self;
        let lanes = size_of::<S::f64s>() / size_of::<f64>();
        let columns = stride / lanes;
        let n = x.len();
        let (left, solved) = room.split_at_mut(stride);
        left[..x.len()].copy_from_slice(x);
        left[x.len()..].fill(0.0);
        solved.fill(0.0);
        let blocks = || rows.chunks_exact(ROWS * stride).zip(inverse.as_chunks::<ROWS>().0).enumerate();
        for (block, (rows, inverse)) in blocks() {
            let k = ROWS * block;
            let mut own: [f64; ROWS] = std::array::from_fn(|r| left[k + r]);
            for r in 0..ROWS {
                own[r] *= inverse[r];
                (r + 1..ROWS).for_each(|c| own[c] -= own[r] * rows[r * stride + k + c]);
            }
            let (rows, wide) = (S::as_simd_f64s(rows).0, S::as_mut_simd_f64s(left).0);
            let mut factors = [simd.splat_f64s(0.0); ROWS];
            for r in 0..ROWS {
                factors[r] = simd.splat_f64s(own[r]);
            }
            for c in k / lanes..columns {
                let mut y = wide[c];
                for r in 0..ROWS {
                    y = simd.negate_mul_add_e_f64s(rows[r * columns + c], factors[r], y);
                }
                wide[c] = y;
            }
            x[k..(k + ROWS).min(n)].iter_mut().zip(own).for_each(|(x, own)| *x = own);
        }
        for (block, (rows, inverse)) in blocks().rev() {
            let k = ROWS * block;
            let mut sums = [simd.splat_f64s(0.0); ROWS];
            let wide = (S::as_simd_f64s(rows).0, S::as_simd_f64s(solved).0);
            for c in k / lanes..columns {
                for r in 0..ROWS {
                    sums[r] = simd.mul_add_e_f64s(wide.0[r * columns + c], wide.1[c], sums[r]);
                }
            }
            let before: [f64; ROWS] = std::array::from_fn(|r| x.get(k + r).copied().unwrap_or(0.0));
            let mut own = [0.0; ROWS];
            for r in 0..ROWS {
                own[r] = simd.reduce_sum_f64s(sums[r]);
            }
            for r in (0..ROWS).rev() {
                let beside: f64 = (r + 1..ROWS).map(|c| rows[r * stride + k + c] * own[c]).sum();
                own[r] = before[r] - (own[r] + beside) * inverse[r];
            }
            solved[k..k + ROWS].copy_from_slice(&own);
        }
        x.copy_from_slice(&solved[..n]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Of sizes that fill registers and blocks of rows, and that do not.
    #[test]
    fn a_factor_solves_and_what_is_not_positive_definite_has_none() {
        for n in 0..=21 {
            let root = DMatrix::from_fn(n, n, |i, j| (1.3 * (i * n + j) as f64).sin());
            let mut matrix = &root * root.transpose() + DMatrix::identity(n, n);
            let wanted = DVector::from_fn(n, |i, _| 1.0 + (i as f64).cos());
            let mut x = &matrix * &wanted;
            let mut factor = Factor::new(n, Arch::new());
            assert!(factor.factorize(&matrix));
            factor.solve(x.as_mut_slice());
            let off = (&x - &wanted).amax();
            assert!(off < 1e-12 * (n + 1) as f64, "{n}: {off}"); // rounding times a condition of about 10 n
            if n > 0 {
                for bad in [-1e-9, f64::NAN, f64::INFINITY] {
                    let last = matrix[(n - 1, n - 1)];
                    matrix[(n - 1, n - 1)] = bad;
                    assert!(!factor.factorize(&matrix), "{n}: {bad}");
                    matrix[(n - 1, n - 1)] = last;
                }
                assert!(factor.factorize(&matrix));
            }
        }
    }
}

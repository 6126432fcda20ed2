//! UᵀU of small positive definite matrices in registers of any width: those of reduced Hessians.

use super::products::WIDTH;
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Rows that are made at once.
const ROWS: usize = 4;

/// Room for a matrix, and its factor.
#[derive(Clone)]
pub struct Factor {
    n: usize,
    stride: usize,
    /// U by rows; what is before the diagonal has no meaning.
    rows: Vec<f64>,
    /// 1/U_kk.
    inverse: Vec<f64>,
    x: Vec<f64>,
    arch: Arch,
}

impl Factor {
    /// Of the identity, computed in the registers `arch`.
    pub fn new(n: usize, arch: Arch) -> Self {
        let stride = n.max(1).next_multiple_of(WIDTH);
        let mut rows = vec![0.0; n * stride];
        (0..n).for_each(|k| rows[k * stride + k] = 1.0);
        Self { n, stride, rows, inverse: vec![1.0; n], x: vec![0.0; stride], arch }
    }

    /// Factorizes; of the matrix, the lower triangle counts. False where it is not positive definite, and then there is no factor.
    pub fn factorize(&mut self, matrix: &DMatrix<f64>) -> bool {
        for (k, (row, column)) in self.rows.chunks_exact_mut(self.stride).zip(matrix.column_iter()).enumerate() {
            row[..k].fill(0.0);
            row[k..self.n].copy_from_slice(&column.as_slice()[k..]);
        }
        let Self { n, stride, rows, inverse, arch, .. } = self;
        arch.dispatch(Factorize { size: (*n, *stride), rows, inverse })
    }

    /// x becomes H⁻¹x.
    pub fn solve(&mut self, x: &mut [f64]) {
        let Self { n, stride, rows, inverse, x: room, arch } = self;
        arch.dispatch(Solve { size: (*n, *stride), rows, inverse, room, x });
    }
}

struct Factorize<'a> {
    size: (usize, usize),
    rows: &'a mut [f64],
    inverse: &'a mut [f64],
}

impl WithSimd for Factorize<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { size: (n, stride), rows, inverse } = self;
        let columns = stride * size_of::<f64>() / size_of::<S::f64s>();
        let lanes = stride / columns;
        for k in (0..n).step_by(ROWS) {
            let (above, rest) = rows.split_at_mut(k * stride);
            let own = &mut rest[..ROWS.min(n - k) * stride];
            subtract::<S>(simd, above, own, (k, columns), n.div_ceil(lanes));
            for r in 0..own.len() / stride {
                let (before, row) = own.split_at_mut(r * stride);
                let row = &mut row[..stride];
                for other in before.chunks_exact(stride) {
                    let factor = simd.splat_f64s(other[k + r]);
                    let (other, row) = (S::as_simd_f64s(other).0, S::as_mut_simd_f64s(row).0);
                    for (x, other) in row[k / lanes..].iter_mut().zip(&other[k / lanes..]) {
                        *x = simd.negate_mul_add_e_f64s(*other, factor, *x);
                    }
                }
                let pivot = row[k + r];
                if !(pivot > 0.0 && pivot < f64::INFINITY) {
                    return false;
                }
                let scale = pivot.sqrt().recip();
                inverse[k + r] = scale;
                let scale = simd.splat_f64s(scale);
                for x in &mut S::as_mut_simd_f64s(row).0[k / lanes..] {
                    *x = simd.mul_f64s(*x, scale);
                }
            }
        }
        true
    }
}

/// own −= what the rows above have to do with it.
#[inline(always)]
fn subtract<S: Simd>(simd: S, above: &[f64], own: &mut [f64], (k, columns): (usize, usize), used: usize) {
    let count = own.len() / (columns * size_of::<S::f64s>() / size_of::<f64>());
    let stride = own.len() / count;
    let lanes = stride / columns;
    let own = S::as_mut_simd_f64s(own).0;
    for a in (k / lanes..used).step_by(2) {
        let two = usize::from(a + 1 < used);
        let mut sums = [[simd.splat_f64s(0.0); 2]; ROWS];
        for (r, row) in own.chunks_exact(columns).enumerate() {
            sums[r] = [row[a], row[a + two]];
        }
        for row in above.chunks_exact(stride) {
            // Of the last rows there may be fewer than ROWS: numbers of the padding stand for theirs.
            let (factors, row) = (&row.as_chunks::<ROWS>().0[k / ROWS], S::as_simd_f64s(row).0);
            let right = [row[a], row[a + two]];
            for (sums, factor) in sums.iter_mut().zip(factors) {
                let factor = simd.splat_f64s(*factor);
                sums[0] = simd.negate_mul_add_e_f64s(right[0], factor, sums[0]);
                sums[1] = simd.negate_mul_add_e_f64s(right[1], factor, sums[1]);
            }
        }
        for (row, sums) in own.chunks_exact_mut(columns).zip(&sums) {
            row[a] = sums[0];
            if two == 1 {
                row[a + 1] = sums[1];
            }
        }
    }
}

struct Solve<'a> {
    size: (usize, usize),
    rows: &'a [f64],
    inverse: &'a [f64],
    room: &'a mut [f64],
    x: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { size: (n, stride), rows, inverse, room, x } = self;
        let lanes = size_of::<S::f64s>() / size_of::<f64>();
        room[..n].copy_from_slice(x);
        room[n..].fill(0.0);
        for (k, row) in rows.chunks_exact(stride).enumerate() {
            x[k] = room[k] * inverse[k];
            let factor = simd.splat_f64s(x[k]);
            let (row, room) = (S::as_simd_f64s(row).0, S::as_mut_simd_f64s(room).0);
            for (y, u) in room[k / lanes..].iter_mut().zip(&row[k / lanes..]) {
                *y = simd.negate_mul_add_e_f64s(*u, factor, *y);
            }
        }
        room.fill(0.0);
        for (k, row) in rows.chunks_exact(stride).enumerate().rev() {
            let mut sum = simd.splat_f64s(0.0);
            let row = S::as_simd_f64s(row).0;
            for (y, u) in S::as_simd_f64s(room).0[k / lanes..].iter().zip(&row[k / lanes..]) {
                sum = simd.mul_add_e_f64s(*u, *y, sum);
            }
            x[k] = (x[k] - simd.reduce_sum_f64s(sum)) * inverse[k];
            room[k] = x[k];
        }
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

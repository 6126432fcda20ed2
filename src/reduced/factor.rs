//! UᵀD⁻¹U of small positive definite matrices in registers of any width, D the diagonal of U, in 32 bits: of Hessians that Newton steps take.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::aligned::Aligned;
use super::outer::{ROWS, add_outer};
use super::sums::Single;
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Numbers in the widest register; rows are padded to it.
pub const SIDE: usize = 16;
/// Of a diagonal entry, what is left of it at least when the rows before are taken off: what 32 bits miss is a few hundredths of a percent of that.
const LEAST: f32 = 1e-4;

/// Room for a matrix, and its factor.
#[derive(Clone)]
pub struct Factor {
    n: usize,
    stride: usize,
    /// U and −D⁻¹U by rows, a multiple of [`ROWS`] of them, the last of the identity. They end with the registers, as most is there.
    rows: Aligned<f32>,
    scaled: Aligned<f32>,
    /// The matrix's diagonal, and what solutions take of the corners.
    diagonal: Vec<f32>,
    corners: Vec<Corner>,
    /// Of a solution: what is left of the right-hand side, what is half solved, and what is found.
    x: Aligned<f32>,
    arch: Arch,
}

/// A matrix that is yet to be factorized, by rows from the diagonal on, with zeros behind the last column. What is before the diagonal has no
/// meaning.
pub struct Rows<'a> {
    /// Numbers in a row.
    pub stride: usize,
    /// Of which the matrix's first is this.
    pub first: usize,
    /// The rows.
    pub rows: &'a mut [f32],
}

/// Numbers in a row of a matrix of so many rows, and the place of its first one: a multiple of [`ROWS`] of them are the last of the row.
pub fn row(n: usize) -> (usize, usize) {
    let stride = n.max(1).next_multiple_of(SIDE);
    (stride, stride - n.next_multiple_of(ROWS))
}

/// Of a block of U at the diagonal: its inverse, by rows, and D.
#[derive(Clone, Copy)]
struct Corner {
    inverse: [[f32; ROWS]; ROWS],
    pivots: [f32; ROWS],
}

impl Factor {
    /// Of the identity, computed in the registers `arch`.
    pub fn new(n: usize, arch: Arch) -> Self {
        let ((stride, first), count) = (row(n), n.next_multiple_of(ROWS));
        let mut rows = Aligned::zeros(count * stride);
        (0..count).for_each(|k| rows[k * (stride + 1) + first] = 1.0);
        let scaled = rows.iter().map(|x| -x).collect::<Vec<f32>>().into();
        let inverse = std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }));
        let corners = vec![Corner { inverse, pivots: [1.0; ROWS] }; count / ROWS];
        Self { n, stride, rows, scaled, diagonal: vec![1.0; count], corners, x: Aligned::zeros(3 * stride), arch }
    }

    /// The place of the first number in a row.
    fn first(&self) -> usize {
        self.stride - self.diagonal.len()
    }

    /// Where a matrix is written to.
    pub fn rows(&mut self) -> Rows<'_> {
        Rows { stride: self.stride, first: self.first(), rows: &mut self.rows }
    }

    /// Takes a matrix, of which the lower triangle counts.
    pub fn set(&mut self, matrix: &DMatrix<f64>) {
        let (first, end) = (self.first(), self.first() + self.n);
        for (k, (row, column)) in self.rows.chunks_exact_mut(self.stride).zip(matrix.column_iter()).enumerate() {
            row[first + k..end].iter_mut().zip(&column.as_slice()[k..]).for_each(|(out, x)| *out = *x as f32);
            row[end..].fill(0.0);
        }
    }

    /// Takes a smaller matrix, and zeros behind it.
    pub fn take(&mut self, other: &Self) {
        let (n, first, others) = (other.n, self.first(), other.first());
        for (k, row) in self.rows.chunks_exact_mut(self.stride).enumerate() {
            row.fill(0.0);
            if k < n {
                row[first + k..first + n].copy_from_slice(&other.rows[k * other.stride + others..][k..n]);
            }
        }
    }

    /// Adds another one to the matrix.
    pub fn add(&mut self, matrix: &DMatrix<f64>) {
        let (first, end) = (self.first(), self.first() + self.n);
        for (k, (row, column)) in self.rows.chunks_exact_mut(self.stride).zip(matrix.column_iter()).enumerate() {
            row[first + k..end].iter_mut().zip(&column.as_slice()[k..]).for_each(|(out, x)| *out += *x as f32);
        }
    }

    /// Adds to the matrix's diagonal.
    pub fn add_diagonal(&mut self, of: impl Fn(usize) -> f64) {
        let first = self.first();
        (0..self.n).for_each(|k| self.rows[k * (self.stride + 1) + first] += of(k) as f32);
    }

    /// Entry (i, j), i ≤ j, of the matrix.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        f64::from(self.rows[i * self.stride + self.first() + j])
    }

    /// Factorizes what was written. False where it is not positive definite, or so near to singular that 32 bits do not tell, and then there
    /// is no factor.
    pub fn factorize(&mut self) -> bool {
        let first = self.first();
        let Self { n, stride, rows, scaled, diagonal, corners, arch, .. } = self;
        for k in *n..diagonal.len() {
            rows[k * *stride + first + k..(k + 1) * *stride].fill(0.0);
            rows[k * (*stride + 1) + first] = 1.0;
        }
        diagonal.iter_mut().enumerate().for_each(|(k, own)| *own = rows[k * (*stride + 1) + first]);
        arch.dispatch(Factorize { stride: *stride, first, rows, scaled, diagonal, corners })
    }

    /// x becomes H⁻¹x.
    pub fn solve(&mut self, x: &mut [f64]) {
        let first = self.first();
        let Self { stride, rows, corners, x: room, arch, .. } = self;
        let mut most = [0.0f64; ROWS]; // of some in turn, for one waits for the one before
        let (blocks, rest) = x.as_chunks::<ROWS>();
        for x in blocks {
            (0..ROWS).for_each(|r| most[r] = most[r].max(x[r].abs()));
        }
        let largest = rest.iter().chain(&most).fold(0.0f64, |most, x| most.max(x.abs()));
        if largest > 0.0 {
            arch.dispatch(Solve { stride: *stride, first, rows, corners, room, x, largest });
        }
    }
}

struct Factorize<'a> {
    stride: usize,
    first: usize,
    rows: &'a mut [f32],
    scaled: &'a mut [f32],
    diagonal: &'a [f32],
    corners: &'a mut [Corner],
}

impl WithSimd for Factorize<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { stride, first, rows, scaled, diagonal, corners } = self;
        let lanes = lanes::<S>();
        for (block, (own_corner, diagonal)) in corners.iter_mut().zip(diagonal.as_chunks::<ROWS>().0).enumerate() {
            let k = first + ROWS * block;
            let (above, rest) = rows.split_at_mut(ROWS * block * stride);
            let (scaled_above, scaled) = scaled.split_at_mut(ROWS * block * stride);
            let own = &mut rest[..ROWS * stride];
            add_outer::<S, Single>(simd, (scaled_above, above), own, (k, stride));
            let Some((below, inverse)) = corner(own, diagonal, (k, stride)) else { return false };
            eliminate::<S>(simd, (own, &mut scaled[..ROWS * stride]), (&below, &inverse), (k / lanes, stride / lanes));
            *own_corner = inverted(own, &inverse, (k, stride));
            clear(own, (k, stride));
        }
        true
    }
}

/// Numbers of a register.
#[inline(always)]
fn lanes<S: Simd>() -> usize {
    size_of::<S::f32s>() / size_of::<f32>()
}

/// Of a block's rows: how much of those before it each has, and 1/D; none where one is not positive.
#[inline(always)]
fn corner(
    own: &[f32],
    diagonal: &[f32; ROWS],
    (k, stride): (usize, usize),
) -> Option<([[f32; ROWS]; ROWS], [f32; ROWS])> {
    let mut a = [[0.0; ROWS]; ROWS];
    for r in 0..ROWS {
        a[r] = own[r * stride..].as_chunks::<ROWS>().0[k / ROWS];
    }
    let (mut below, mut inverse) = ([[0.0; ROWS]; ROWS], [0.0; ROWS]);
    let mut positive = true;
    for p in 0..ROWS {
        positive &= a[p][p] > LEAST * diagonal[p] && a[p][p] > 0.0 && a[p][p] < f32::INFINITY;
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

/// A block's corner U of rows that are done, with 1/D.
#[inline(always)]
fn inverted(own: &[f32], inverse: &[f32; ROWS], (k, stride): (usize, usize)) -> Corner {
    let mut corner = Corner { inverse: [[0.0; ROWS]; ROWS], pivots: [0.0; ROWS] };
    for c in 0..ROWS {
        for r in 0..c {
            let mut sum = 0.0;
            for p in r..c {
                sum += corner.inverse[r][p] * own[p * stride + k + c];
            }
            corner.inverse[r][c] = -sum * inverse[c];
        }
        corner.inverse[c][c] = inverse[c];
        corner.pivots[c] = own[c * stride + k + c];
    }
    corner
}

/// Takes off each row of a block what it has of those before it.
#[inline(always)]
fn eliminate<S: Simd>(
    simd: S,
    (own, scaled): (&mut [f32], &mut [f32]),
    (below, inverse): (&[[f32; ROWS]; ROWS], &[f32; ROWS]),
    (from, columns): (usize, usize),
) {
    let [(own, _), (scaled, _)] = [own, scaled].map(|x| S::as_mut_simd_f32s(x));
    for c in from..columns {
        let mut x = [simd.splat_f32s(0.0); ROWS];
        for r in 0..ROWS {
            x[r] = own[r * columns + c];
        }
        for r in 0..ROWS {
            for p in 0..r {
                x[r] = simd.negate_mul_add_e_f32s(x[p], simd.splat_f32s(below[r][p]), x[r]);
            }
            own[r * columns + c] = x[r];
            scaled[r * columns + c] = simd.mul_f32s(x[r], simd.splat_f32s(-inverse[r]));
        }
    }
}

/// Zeros before the diagonal, as far as the widest register that has a part of a block's rows goes: solutions are multiplied by them.
#[inline(always)]
fn clear(own: &mut [f32], (k, stride): (usize, usize)) {
    for r in 0..ROWS {
        let row = &mut own[r * stride..][..stride];
        row.as_chunks_mut::<ROWS>().0[k / SIDE * SIDE / ROWS..k / ROWS].iter_mut().for_each(|x| *x = [0.0; ROWS]);
        (0..r).for_each(|c| row[k + c] = 0.0);
    }
}

struct Solve<'a> {
    stride: usize,
    first: usize,
    rows: &'a [f32],
    corners: &'a [Corner],
    room: &'a mut [f32],
    x: &'a mut [f64],
    /// Of the right-hand side: 1 in 32 bits.
    largest: f64,
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { stride, first, rows, corners, room, x, largest } = self;
        let lanes = lanes::<S>();
        let columns = stride / lanes;
        let (left, others) = room.split_at_mut(stride);
        let (half, solved) = others.split_at_mut(stride);
        left.fill(0.0);
        for (left, x) in left[first..].iter_mut().zip(&*x) {
            *left = (*x / largest) as f32;
        }
        solved.fill(0.0);
        let blocks = || rows.chunks_exact(ROWS * stride).zip(corners).enumerate();
        for (block, (rows, corner)) in blocks() {
            let k = first + ROWS * block;
            let before = left.as_chunks::<ROWS>().0[k / ROWS];
            let mut own = [0.0; ROWS];
            for r in 0..ROWS {
                for c in r..ROWS {
                    own[c] += before[r] * corner.inverse[r][c];
                }
            }
            let (rows, wide) = (S::as_simd_f32s(rows).0, S::as_mut_simd_f32s(left).0);
            let mut factors = [simd.splat_f32s(0.0); ROWS];
            for r in 0..ROWS {
                factors[r] = simd.splat_f32s(own[r]);
            }
            for c in k / lanes..columns {
                let mut y = wide[c];
                for r in 0..ROWS {
                    y = simd.negate_mul_add_e_f32s(rows[r * columns + c], factors[r], y);
                }
                wide[c] = y;
            }
            half.as_chunks_mut::<ROWS>().0[k / ROWS] = own;
        }
        for (block, (rows, corner)) in blocks().rev() {
            let k = first + ROWS * block;
            let mut sums = [simd.splat_f32s(0.0); ROWS];
            let wide = (S::as_simd_f32s(rows).0, S::as_simd_f32s(solved).0);
            for c in k / lanes..columns {
                for r in 0..ROWS {
                    sums[r] = simd.mul_add_e_f32s(wide.0[r * columns + c], wide.1[c], sums[r]);
                }
            }
            let before = half.as_chunks::<ROWS>().0[k / ROWS];
            let (mut left, mut own) = ([0.0; ROWS], [0.0; ROWS]);
            for r in 0..ROWS {
                left[r] = corner.pivots[r] * before[r] - simd.reduce_sum_f32s(sums[r]);
            }
            for r in 0..ROWS {
                for c in r..ROWS {
                    own[r] += corner.inverse[r][c] * left[c];
                }
            }
            solved.as_chunks_mut::<ROWS>().0[k / ROWS] = own;
        }
        for (x, solved) in x.iter_mut().zip(&solved[first..]) {
            *x = f64::from(*solved) * largest;
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
        for n in 0..=37 {
            let root = DMatrix::from_fn(n, n, |i, j| (1.3 * (i * n + j) as f64).sin());
            let mut matrix = &root * root.transpose() + DMatrix::identity(n, n);
            let wanted = DVector::from_fn(n, |i, _| 1.0 + (i as f64).cos());
            let mut factor = Factor::new(n, Arch::new());
            // Rounding to 32 bits times a condition of about n²/2, thrice.
            let enough = 2e-7 * (n * n + 10) as f64;
            let is_factorized = |factor: &mut Factor, matrix: &DMatrix<f64>| {
                factor.set(matrix);
                factor.factorize()
            };
            assert!(is_factorized(&mut factor, &matrix));
            // A right-hand side that 32 bits cannot hold is held by its largest number.
            for size in [1.0, 1e-60, 1e60] {
                let mut x = size * &matrix * &wanted;
                factor.solve(x.as_mut_slice());
                let off = (&x / size - &wanted).amax();
                assert!(off < enough, "{n}: {off}");
            }
            if n > 0 {
                // What is left of the last diagonal entry, when the others are taken off, is all that tells it from singular.
                let last = matrix[(n - 1, n - 1)];
                let left = 1.0 / matrix.clone().try_inverse().expect("positive definite")[(n - 1, n - 1)];
                for bad in [-1e-9, last - left * (1.0 + 1e-3), f64::NAN, f64::INFINITY] {
                    matrix[(n - 1, n - 1)] = bad;
                    assert!(!is_factorized(&mut factor, &matrix), "{n}: {bad}");
                    matrix[(n - 1, n - 1)] = last;
                }
                assert!(is_factorized(&mut factor, &matrix));
                let mut x = &matrix * &wanted;
                factor.solve(x.as_mut_slice());
                assert!((&x - &wanted).amax() < enough, "{n}: what has no factor leaves no trace");
            }
        }
    }
}

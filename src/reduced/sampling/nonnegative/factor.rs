//! LDLᵀ of the products of the active columns, and solutions that know what of them did not change.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::{self, factor::LdltRegularization};
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::{Mat, Par, Spec};
use pulp::{Arch, Simd, WithSimd};

/// See the module's text.
pub(super) struct Factor {
    /// L below the diagonal, and D.
    matrix: Mat<f64>,
    size: usize,
    /// L⁻¹ of the right side, and how much of it is that of the present factor.
    half: Vec<f64>,
    known: usize,
    arch: Arch,
}

impl Factor {
    /// Of no column, with room for so many.
    pub fn new(most: usize) -> Self {
        Self { matrix: Mat::zeros(most, most), size: 0, half: vec![], known: 0, arch: Arch::new() }
    }

    /// Columns that it has room for.
    pub fn most(&self) -> usize {
        self.matrix.ncols()
    }

    /// Of more columns: `across` are their products with those before, `own` with each other. False, and nothing is changed, unless the whole is
    /// positive definite.
    pub fn append(&mut self, mut across: Mat<f64>, mut own: Mat<f64>) -> bool {
        let (size, count) = across.shape();
        let factor = self.matrix.submatrix(0, 0, size, size);
        solve_unit_lower_triangular_in_place(factor, across.as_mut(), Par::Seq);
        let scaled = Mat::from_fn(size, count, |i, k| across[(i, k)] / factor[(i, i)]);
        own -= across.transpose() * &scaled;
        let mut room = MemBuffer::new(ldlt::factor::cholesky_in_place_scratch::<f64>(count, Par::Seq, Spec::default()));
        let (stack, plain) = (MemStack::new(&mut room), LdltRegularization::default());
        let done = ldlt::factor::cholesky_in_place(own.as_mut(), plain, Par::Seq, stack, Spec::default());
        if done.is_err() || (0..count).any(|i| own[(i, i)].is_nan() || own[(i, i)] <= 0.0) {
            return false;
        }
        self.size = size + count;
        self.matrix.submatrix_mut(size, 0, count, size).copy_from(scaled.transpose());
        self.matrix.submatrix_mut(size, size, count, count).copy_from(own);
        true
    }

    /// Solves for a right side that is the same as before for columns that were there.
    pub fn solve(&mut self, right: impl Iterator<Item = f64>) -> Vec<f64> {
        self.half.truncate(self.known);
        self.half.extend(right.skip(self.known));
        let mut z = vec![0.0; self.size];
        let Self { matrix, size, half, known, arch } = self;
        let columns = matrix.as_ref().subcols(0, *size);
        let columns: Vec<&[f64]> =
            columns.col_iter().filter_map(|column| Some(&column.try_as_col_major()?.as_slice()[..*size])).collect();
        arch.dispatch(Solve { columns: &columns, half, known: *known, z: &mut z });
        self.known = self.size;
        z
    }

    /// Takes columns out: what L has of each goes to those behind it.
    pub fn remove(&mut self, list: &mut [usize]) {
        self.known = list.iter().copied().fold(self.known, usize::min);
        let of = ldlt::update::delete_rows_and_cols_clobber_scratch::<f64>(self.size, list.len());
        let mut room = MemBuffer::new(of);
        let factor = self.matrix.submatrix_mut(0, 0, self.size, self.size);
        ldlt::update::delete_rows_and_cols_clobber(factor, list, Par::Seq, MemStack::new(&mut room));
        self.size -= list.len();
    }
}

/// z ← L⁻ᵀD⁻¹L⁻¹b by columns of D and L below it, where the first `known` of L⁻¹b are in the place of those of b.
struct Solve<'a> {
    columns: &'a [&'a [f64]],
    half: &'a mut [f64],
    known: usize,
    z: &'a mut [f64],
}

/// Numbers that are summed side by side.
const SIDE_BY_SIDE: usize = 32;

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { columns, half, known, z } = self;
        for (j, column) in columns.iter().enumerate() {
            let next = (j + 1).max(known);
            let own = half[j];
            for (x, l) in half[next..].iter_mut().zip(&column[next..]) {
                *x -= own * l;
            }
        }
        for (j, column) in columns.iter().enumerate().rev() {
            let (l, x) = (&column[j + 1..], &z[j + 1..]);
            let mut sums = [0.0; SIDE_BY_SIDE];
            let ((l, last), (x, of_last)) = (l.as_chunks::<SIDE_BY_SIDE>(), x.as_chunks::<SIDE_BY_SIDE>());
            for (l, x) in l.iter().zip(x) {
                for k in 0..SIDE_BY_SIDE {
                    sums[k] += l[k] * x[k];
                }
            }
            for ((sum, l), x) in sums.iter_mut().zip(last).zip(of_last) {
                *sum += l * x;
            }
            let mut sum = 0.0;
            for own in sums {
                sum += own;
            }
            z[j] = half[j] / column[j] - sum;
        }
    }
}

//! Solutions of one right side by a panel of a factor, some columns of it at a time.
//!
//! A large factor is read from memory. That is fastest in its order, while several columns at a time are as many streams: so lines are asked for
//! in order before columns are worked on.

use super::panels::Panel;
use faer::traits::RealField;
use pulp::{Simd, WithSimd};
use std::array::from_fn;
use std::hint::black_box;

/// A factor's entry: a double, or a single to precondition with. Sums of solutions are doubles.
pub trait Scalar: RealField + Copy + Default + Send + Sync {
    /// The nearest to a double.
    fn of(value: f64) -> Self;
    /// As a double.
    fn double(self) -> f64;
}

impl Scalar for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn double(self) -> f64 {
        self
    }
}

impl Scalar for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as f32
    }

    #[inline(always)]
    fn double(self) -> f64 {
        f64::from(self)
    }
}

/// Columns at a time, and those of what is left of a panel.
const TOGETHER: usize = 8;
const SOME: usize = 4;

/// Columns that are asked for at once where they are worked on from the last one back.
const STRIP: usize = 32;

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Doubles that a processor adds at once, at most.
const LANES: usize = 8;

/// The rows of L's columns in a panel, from its own first one on.
#[derive(Clone, Copy)]
pub struct Lower<'a, T> {
    values: &'a [T],
    rows: usize,
    inside: usize,
    width: usize,
}

impl<'a, T: Scalar> Lower<'a, T> {
    /// Of a panel among a factor's values.
    pub fn of(panel: &Panel, values: &'a [T]) -> Self {
        let values = &values[panel.values..panel.values + panel.rows * panel.width];
        Self { values, rows: panel.rows, inside: panel.inside, width: panel.width }
    }

    /// So many columns from j on, each from row j on.
    #[inline(always)]
    fn columns<const N: usize>(&self, j: usize) -> [&'a [T]; N] {
        from_fn(|k| &self.values[(j + k) * self.rows + self.inside + j..(j + k + 1) * self.rows])
    }

    /// Brings columns into the cache.
    #[inline(always)]
    fn fetch(&self, first: usize, end: usize) {
        for line in self.values[first * self.rows..end * self.rows].chunks(LINE / size_of::<T>()) {
            black_box(line[0]);
        }
    }
}

/// x ← L⁻¹x in the panel. Rows are its own, then sums below, from which its columns times x are taken.
pub struct SolveUp<'a, T> {
    pub lower: Lower<'a, T>,
    pub rows: &'a mut [f64],
}

impl<T: Scalar> WithSimd for SolveUp<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { lower, rows } = self;
        let (width, mut j) = (lower.width, 0);
        while width - j >= TOGETHER {
            lower.fetch(j, j + TOGETHER);
            up(simd, lower.columns::<TOGETHER>(j), &mut rows[j..]);
            j += TOGETHER;
        }
        if width - j >= SOME {
            up(simd, lower.columns::<SOME>(j), &mut rows[j..]);
            j += SOME;
        }
        while j < width {
            up(simd, lower.columns::<1>(j), &mut rows[j..]);
            j += 1;
        }
    }
}

/// x ← L⁻ᵀx in the panel. Rows are its own, then those below, which are known.
pub struct SolveDown<'a, T> {
    pub lower: Lower<'a, T>,
    pub rows: &'a mut [f64],
}

impl<T: Scalar> WithSimd for SolveDown<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { lower, rows } = self;
        let mut j = lower.width;
        while j > 0 {
            let first = (j - 1) / STRIP * STRIP;
            lower.fetch(first, j);
            while j % SOME > 0 {
                j -= 1;
                down(simd, lower.columns::<1>(j), &mut rows[j..]);
            }
            if j % TOGETHER > 0 {
                j -= SOME;
                down(simd, lower.columns::<SOME>(j), &mut rows[j..]);
            }
            while j > first {
                j -= TOGETHER;
                down(simd, lower.columns::<TOGETHER>(j), &mut rows[j..]);
            }
        }
    }
}

/// Entries as doubles, as many as are added at once.
#[inline(always)]
fn load<T: Scalar, S: Simd>(_: S, values: &[T]) -> S::f64s {
    let mut wide = [0.0; LANES];
    let wide = &mut wide[..S::F64_LANES];
    wide.iter_mut().zip(values).for_each(|(wide, value)| *wide = value.double());
    S::as_simd_f64s(wide).0[0]
}

/// Solves for the first rows, and takes these columns times them from the others.
#[inline(always)]
fn up<const N: usize, T: Scalar, S: Simd>(simd: S, columns: [&[T]; N], rows: &mut [f64]) {
    let (own, others) = rows.split_at_mut(N);
    let inverse = inverses(&columns);
    let mut x: [f64; N] = from_fn(|k| own[k]);
    for k in 0..N {
        x[k] *= inverse[k];
        for i in k + 1..N {
            x[i] -= columns[k][i].double() * x[k];
        }
    }
    own.copy_from_slice(&x);
    let minus = x.map(|x| simd.splat_f64s(-x));
    let below = columns.map(|column| &column[N..][..others.len()]);
    let (sums, rest) = S::as_mut_simd_f64s(others);
    let summed = sums.len() * S::F64_LANES;
    for (i, sum) in sums.iter_mut().enumerate() {
        let at = i * S::F64_LANES;
        for k in 0..N {
            *sum = simd.mul_add_e_f64s(load(simd, &below[k][at..at + S::F64_LANES]), minus[k], *sum);
        }
    }
    for (i, sum) in rest.iter_mut().enumerate() {
        for k in 0..N {
            *sum -= below[k][summed + i].double() * x[k];
        }
    }
}

/// Solves for the first rows with what is known of the others.
#[inline(always)]
fn down<const N: usize, T: Scalar, S: Simd>(simd: S, columns: [&[T]; N], rows: &mut [f64]) {
    let (own, others) = rows.split_at_mut(N);
    let below = columns.map(|column| &column[N..][..others.len()]);
    let (known, rest) = S::as_simd_f64s(others);
    let summed = known.len() * S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); N];
    for (i, known) in known.iter().enumerate() {
        let at = i * S::F64_LANES;
        for k in 0..N {
            sums[k] = simd.mul_add_e_f64s(load(simd, &below[k][at..at + S::F64_LANES]), *known, sums[k]);
        }
    }
    let mut x: [f64; N] = from_fn(|k| own[k] - simd.reduce_sum_f64s(sums[k]));
    for (i, known) in rest.iter().enumerate() {
        for k in 0..N {
            x[k] -= below[k][summed + i].double() * known;
        }
    }
    let inverse = inverses(&columns);
    for k in (0..N).rev() {
        x[k] *= inverse[k];
        for i in 0..k {
            x[i] -= columns[i][k].double() * x[k];
        }
    }
    own.copy_from_slice(&x);
}

/// Of the diagonal.
#[inline(always)]
fn inverses<const N: usize, T: Scalar>(columns: &[&[T]; N]) -> [f64; N] {
    from_fn(|k| 1.0 / columns[k][k].double())
}

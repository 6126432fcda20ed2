//! Columns in 16 bits, and between what bounds their gains are by these.

use faer::MatRef;
use pulp::{Arch, Simd, WithSimd};

/// Some columns, over their norms, in 16 bits, the upper half of an f32.
pub(super) struct Strip {
    first: usize,
    pub norms: Vec<f64>,
    /// Their products with b.
    pub right: Vec<f64>,
    entries: Vec<u16>,
    /// Of each, the norm of what its entries miss.
    missed: Vec<f64>,
}

/// Numbers that are summed side by side.
const SIDE_BY_SIDE: usize = 32;
/// Above what a sum of squares may lack for its rounding.
const ROUNDED: f64 = 1.0 + 1e-9;

impl Strip {
    /// Of the columns from the `first` on.
    pub fn new(first: usize, a: MatRef<'_, f32>, b: &[f64]) -> Self {
        let (arch, mut missed) = (Arch::new(), Vec::with_capacity(a.ncols()));
        let columns = || (0..a.ncols()).map(|j| column(a, j));
        let norms: Vec<f64> = columns().map(|column| arch.dispatch(Squares(column)).sqrt()).collect();
        let right = columns().map(|column| arch.dispatch(Dot(column, b))).collect();
        let mut entries = vec![0; a.nrows() * a.ncols()];
        for ((out, column), norm) in entries.chunks_exact_mut(a.nrows().max(1)).zip(columns()).zip(&norms) {
            let unit = if *norm > 0.0 { 1.0 / norm } else { 0.0 };
            let squares = arch.dispatch(Halve(column, unit, out));
            missed.push(ROUNDED * squares.sqrt());
        }
        Self { first, norms, right, entries, missed }
    }

    /// Of each `open` column, a number that its gain, aᵀr/|a|, is surely not below, and one that it is not above; of r, its direction.
    pub fn gains(&self, arch: Arch, (r, whole): (&[f32], f64), open: impl Fn(usize) -> bool) -> Vec<Option<[f64; 2]>> {
        // Of sums of f32, each of rows/32 terms, and of what they are made of.
        let rounding = (r.len() as f64 / SIDE_BY_SIDE as f64 + 64.0) * f64::from(f32::EPSILON);
        let columns = self.entries.chunks_exact(r.len().max(1)).zip(&self.missed).enumerate();
        let gain = |(j, (entries, missed)): (usize, (&[u16], &f64))| {
            open(self.first + j).then(|| {
                let (middle, off) = (f64::from(arch.dispatch(RoughDot(entries, r))), missed + rounding);
                [whole * (middle - off), whole * (middle + off)]
            })
        };
        columns.map(gain).collect()
    }
}

/// The numbers of a column.
pub(super) fn column(a: MatRef<'_, f32>, j: usize) -> &[f32] {
    a.col(j).try_as_col_major().map_or(&[], |column| column.as_slice())
}

/// a·b, in 64 bits.
pub(super) struct Dot<'a>(pub &'a [f32], pub &'a [f64]);

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sums = [0.0; SIDE_BY_SIDE];
        let ((a, last), (b, of_last)) = (self.0.as_chunks::<SIDE_BY_SIDE>(), self.1.as_chunks::<SIDE_BY_SIDE>());
        for (a, b) in a.iter().zip(b) {
            for k in 0..SIDE_BY_SIDE {
                sums[k] += f64::from(a[k]) * b[k];
            }
        }
        sums.iter_mut().zip(last.iter().zip(of_last)).for_each(|(sum, (a, b))| *sum += f64::from(*a) * b);
        sums.iter().sum()
    }
}

/// The sum of the squares.
struct Squares<'a>(&'a [f32]);

impl WithSimd for Squares<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sums = [0.0; SIDE_BY_SIDE];
        let (numbers, last) = self.0.as_chunks::<SIDE_BY_SIDE>();
        for numbers in numbers {
            for k in 0..SIDE_BY_SIDE {
                sums[k] += f64::from(numbers[k]) * f64::from(numbers[k]);
            }
        }
        sums.iter_mut().zip(last).for_each(|(sum, x)| *sum += f64::from(*x) * f64::from(*x));
        sums.iter().sum()
    }
}

/// Writes numbers times a unit, at most 1, in their upper halves, to the nearest; Σ of the squares of what that misses, but for rounding.
struct Halve<'a>(&'a [f32], f64, &'a mut [u16]);

impl WithSimd for Halve<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self(numbers, unit, out) = self;
        let mut sums = [0.0; SIDE_BY_SIDE];
        let ((numbers, last), (out, of_last)) =
            (numbers.as_chunks::<SIDE_BY_SIDE>(), out.as_chunks_mut::<SIDE_BY_SIDE>());
        for (numbers, out) in numbers.iter().zip(out) {
            for k in 0..SIDE_BY_SIDE {
                sums[k] += halve(f64::from(numbers[k]) * unit, &mut out[k]);
            }
        }
        for ((x, out), sum) in last.iter().zip(of_last).zip(&mut sums) {
            *sum += halve(f64::from(*x) * unit, out);
        }
        sums.iter().sum()
    }
}

#[inline(always)]
fn halve(x: f64, out: &mut u16) -> f64 {
    *out = (((x as f32).to_bits() + 0x8000) >> 16) as u16;
    let missed = x - f64::from(wide(*out));
    missed * missed
}

/// Of its upper half.
#[inline(always)]
fn wide(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

/// a·b of upper halves and numbers.
struct RoughDot<'a>(&'a [u16], &'a [f32]);

impl WithSimd for RoughDot<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        let mut sums = [0.0f32; SIDE_BY_SIDE];
        let ((a, last), (b, of_last)) = (self.0.as_chunks::<SIDE_BY_SIDE>(), self.1.as_chunks::<SIDE_BY_SIDE>());
        for (a, b) in a.iter().zip(b) {
            for k in 0..SIDE_BY_SIDE {
                sums[k] += wide(a[k]) * b[k];
            }
        }
        let mut sum = 0.0;
        for (a, b) in last.iter().zip(of_last) {
            sum += wide(*a) * b;
        }
        for own in sums {
            sum += own;
        }
        sum
    }
}

//! Solutions of one right side by a panel of a factor, a column of it at a time.

use super::panels::Panel;
use pulp::{Simd, WithSimd};

/// Numbers that are summed side by side.
const SIDE_BY_SIDE: usize = 16;
/// Columns whose multiples are summed together.
const TOGETHER: usize = 4;

/// The rows of L's columns in a panel, from its own first one on.
#[derive(Clone, Copy)]
pub struct Lower<'a> {
    values: &'a [f64],
    rows: usize,
    inside: usize,
    width: usize,
}

impl<'a> Lower<'a> {
    /// Of a panel among a factor's values.
    pub fn of(panel: &Panel, values: &'a [f64]) -> Self {
        let values = &values[panel.values..panel.values + panel.rows * panel.width];
        Self { values, rows: panel.rows, inside: panel.inside, width: panel.width }
    }

    #[inline(always)]
    fn column(&self, j: usize) -> &'a [f64] {
        &self.values[j * self.rows + self.inside..(j + 1) * self.rows]
    }
}

/// x ← L⁻¹x in the panel, and what its columns times x are below it.
pub struct SolveUp<'a> {
    pub lower: Lower<'a>,
    pub x: &'a mut [f64],
    pub product: &'a mut [f64],
}

impl WithSimd for SolveUp<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { lower, x, product } = self;
        let width = lower.width;
        for j in 0..width {
            let column = lower.column(j);
            let own = x[j] / column[j];
            x[j] = own;
            for (x, l) in x[j + 1..].iter_mut().zip(&column[j + 1..width]) {
                *x -= own * l;
            }
        }
        let below = product.len();
        product.fill(0.0);
        let some = width / TOGETHER * TOGETHER;
        for j in (0..some).step_by(TOGETHER) {
            let (a, b) = (&lower.column(j)[width..][..below], &lower.column(j + 1)[width..][..below]);
            let (c, d) = (&lower.column(j + 2)[width..][..below], &lower.column(j + 3)[width..][..below]);
            for i in 0..below {
                product[i] += (a[i] * x[j] + b[i] * x[j + 1]) + (c[i] * x[j + 2] + d[i] * x[j + 3]);
            }
        }
        for j in some..width {
            let own = x[j];
            for (sum, l) in product.iter_mut().zip(&lower.column(j)[width..]) {
                *sum += own * l;
            }
        }
    }
}

/// x ← L⁻ᵀx in the panel, with what is known below it.
pub struct SolveDown<'a> {
    pub lower: Lower<'a>,
    pub x: &'a mut [f64],
    pub below: &'a [f64],
}

impl WithSimd for SolveDown<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { lower, x, below } = self;
        let width = lower.width;
        for j in (0..width).rev() {
            let column = lower.column(j);
            let sum = dot(&column[width..], below) + dot(&column[j + 1..width], &x[j + 1..]);
            x[j] = (x[j] - sum) / column[j];
        }
    }
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; SIDE_BY_SIDE];
    let ((a, last), (b, of_last)) = (a.as_chunks::<SIDE_BY_SIDE>(), b.as_chunks::<SIDE_BY_SIDE>());
    for (a, b) in a.iter().zip(b) {
        for k in 0..SIDE_BY_SIDE {
            sums[k] += a[k] * b[k];
        }
    }
    let mut sum = 0.0;
    for (a, b) in last.iter().zip(of_last) {
        sum += a * b;
    }
    for own in sums {
        sum += own;
    }
    sum
}

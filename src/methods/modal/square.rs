//! A symmetric positive matrix D + Σ J H Jᵀ with D diagonal, H 3 × 3: its sum, and its solutions by Cholesky's factors.
//!
//! Columns are padded to whole lines. All sums are in one order, whatever the processor's registers, so that all have the same bits.

use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

/// Numbers of a line.
pub const LINE: usize = 4;

/// Rounded up to whole lines, at least one.
pub fn padded(n: usize) -> usize {
    n.max(1).next_multiple_of(LINE)
}

/// Lines of a row of whole ones.
#[inline(always)]
fn lines(row: &[f64]) -> &[[f64; LINE]] {
    row.as_chunks().0
}

/// Subtracts a x from `out`, both as long.
#[inline(always)]
fn subtract(out: &mut [f64], a: f64, x: &[f64]) {
    for (out, x) in out.as_chunks_mut::<LINE>().0.iter_mut().zip(lines(x)) {
        for i in 0..LINE {
            out[i] -= a * x[i];
        }
    }
}

/// Σ aᵢ bᵢ over the shorter one, in lines.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (lines_a, rest_a) = a[..n].as_chunks::<LINE>();
    let (lines_b, rest_b) = b[..n].as_chunks::<LINE>();
    let mut sums = [0.0; LINE];
    for (a, b) in lines_a.iter().zip(lines_b) {
        for i in 0..LINE {
            sums[i] += a[i] * b[i];
        }
    }
    let mut rest = 0.0;
    for (a, b) in rest_a.iter().zip(rest_b) {
        rest += a * b;
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// Adds a x + b y + c z to `out`, all as long.
#[inline(always)]
pub fn add_three(out: &mut [f64], [a, b, c]: [f64; 3], [x, y, z]: [&[f64]; 3]) {
    let rows = lines(x).iter().zip(lines(y)).zip(lines(z));
    for (out, ((x, y), z)) in out.as_chunks_mut::<LINE>().0.iter_mut().zip(rows) {
        for i in 0..LINE {
            out[i] += a * x[i] + b * y[i] + c * z[i];
        }
    }
}

/// The three rows of a matrix for x, y and z.
#[inline(always)]
pub fn rows(of: &[f64], stride: usize) -> [&[f64]; 3] {
    let (x, rest) = of.split_at(stride);
    let (y, z) = rest.split_at(stride);
    [x, y, &z[..stride]]
}

/// See the module's text.
#[derive(Clone)]
pub struct Square {
    stride: usize,
    /// Of each column what is on and below the diagonal, or of its factor what is below. Nothing is below the last row.
    columns: Vec<f64>,
    /// Once factorized, one over the factor's diagonal.
    inverse: Vec<f64>,
    /// J H of one term, or room for a solution.
    turned: Vec<f64>,
    arch: Arch,
}

impl Square {
    /// Of n rows.
    pub fn new(n: usize) -> Self {
        let stride = padded(n);
        let arch = Arch::new(); // all sums have one order
        Self { stride, columns: vec![0.0; n * stride], inverse: vec![0.0; n], turned: vec![0.0; 3 * stride], arch }
    }

    /// Becomes a diagonal.
    pub fn set_diagonal(&mut self, diagonal: &[f64]) {
        self.columns.fill(0.0);
        for (k, d) in diagonal.iter().enumerate().take(self.inverse.len()) {
            self.columns[k * self.stride + k] = *d;
        }
    }

    /// Adds J H Jᵀ. J has a padded row for each of x, y and z.
    pub fn add(&mut self, jacobian: &[f64], h: &Matrix3<f64>) {
        let Self { stride, columns, turned, arch, .. } = self;
        arch.dispatch(Add { stride: *stride, jacobian, h: h.data.0, columns, turned });
    }

    /// Becomes its factor and replaces b by the solution; whether it is positive.
    pub fn solve(&mut self, b: &mut [f64]) -> bool {
        let Self { stride, columns, inverse, turned, arch } = self;
        let (room, rest) = turned.split_at_mut(*stride);
        room[..b.len()].copy_from_slice(b);
        room[b.len()..].fill(0.0);
        let solution = &mut rest[..*stride];
        let positive = arch.dispatch(Solve { stride: *stride, columns, inverse, b: room, solution });
        b.copy_from_slice(&solution[..b.len()]);
        positive
    }
}

struct Add<'a> {
    stride: usize,
    jacobian: &'a [f64],
    /// Columns of H.
    h: [[f64; 3]; 3],
    columns: &'a mut [f64],
    turned: &'a mut [f64],
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { stride, jacobian, h, columns, turned } = self;
        let j = rows(jacobian, stride);
        turned.fill(0.0);
        for (out, h) in turned.chunks_exact_mut(stride).zip(h) {
            add_three(out, h, j);
        }
        let [x, y, z] = rows(turned, stride);
        for (k, column) in columns.chunks_exact_mut(stride).enumerate() {
            let at = k & !(LINE - 1);
            add_three(&mut column[at..], [j[0][k], j[1][k], j[2][k]], [&x[at..], &y[at..], &z[at..]]);
        }
    }
}

struct Solve<'a> {
    stride: usize,
    columns: &'a mut [f64],
    inverse: &'a mut [f64],
    /// Padded, and used up.
    b: &'a mut [f64],
    solution: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { stride, columns, inverse, b, solution } = self;
        solution.fill(0.0);
        if !factorize(columns, stride, inverse) {
            return false;
        }
        for (j, column) in columns.chunks_exact(stride).enumerate() {
            let at = j & !(LINE - 1);
            solution[j] = b[j] * inverse[j];
            subtract(&mut b[at..], solution[j], &column[at..]);
        }
        for (j, column) in columns.chunks_exact(stride).enumerate().rev() {
            let at = j & !(LINE - 1);
            solution[j] = (solution[j] - dot(&column[at..], &solution[at..])) * inverse[j];
        }
        true
    }
}

#[inline(always)]
fn factorize(columns: &mut [f64], stride: usize, inverse: &mut [f64]) -> bool {
    for (j, inverse) in inverse.iter_mut().enumerate() {
        let at = j & !(LINE - 1);
        let (done, rest) = columns.split_at_mut(j * stride);
        let column = &mut rest[..stride];
        for before in done.chunks_exact(stride) {
            subtract(&mut column[at..], before[j], &before[at..]);
        }
        let pivot = column[j];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        *inverse = pivot.sqrt().recip();
        column[at..=j].fill(0.0);
        for x in column[at..].as_chunks_mut::<LINE>().0 {
            for i in 0..LINE {
                x[i] *= *inverse;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Beside nalgebra's factors, for sizes with and without a rest of a line.
    #[test]
    fn solves_as_another_library_does() {
        for n in [1, 3, 4, 7, 16, 21] {
            let stride = padded(n);
            let number = |i: usize| ((i * 7919 + 13) % 101) as f64 / 50.0 - 1.0;
            let mut jacobian = vec![0.0; 3 * stride];
            let dense = DMatrix::from_fn(n, 3, |k, axis| number(3 * k + axis));
            (0..n).for_each(|k| (0..3).for_each(|axis| jacobian[axis * stride + k] = dense[(k, axis)]));
            let h = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0);
            let diagonal: Vec<f64> = (0..n).map(|k| 1.0 + k as f64).collect();
            let mut square = Square::new(n);
            square.set_diagonal(&diagonal);
            square.add(&jacobian, &h);
            let mut whole = DMatrix::from_diagonal(&DVector::from_vec(diagonal));
            whole += &dense * h * dense.transpose();
            let right = DVector::from_fn(n, |k, _| number(k + 50));
            let expected = whole.cholesky().unwrap().solve(&right);
            let mut b: Vec<f64> = right.iter().copied().collect();
            assert!(square.solve(&mut b));
            // The condition number is below 100: 14 digits are left.
            assert!(b.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-13), "{n}: {b:?} {expected}");
            square.set_diagonal(&vec![-1.0; n]);
            assert!(!square.solve(&mut b));
        }
    }
}

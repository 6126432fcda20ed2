//! A symmetric positive matrix D + Σ J H Jᵀ with D diagonal, H 3 × 3: its sum, and its solutions by factors L D Lᵀ. Beside it Σ J f.
//!
//! It is held in blocks of four rows and columns. All sums are in one order, whatever the processor's registers, so that all have the same bits.

use crate::Vec3;
use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

/// Numbers of a line.
const LINE: usize = 4;
pub type Line = [f64; LINE];
/// Columns of four rows.
type Block = [Line; LINE];

/// Rounded up to whole lines, at least one.
pub fn padded(n: usize) -> usize {
    n.max(1).next_multiple_of(LINE)
}

/// Lines of a row of whole ones.
#[inline(always)]
pub fn lines(row: &[f64]) -> &[Line] {
    row.as_chunks().0
}

/// The same to write to.
#[inline(always)]
pub fn lines_mut(row: &mut [f64]) -> &mut [Line] {
    row.as_chunks_mut().0
}

/// out + a x.
#[inline(always)]
pub fn plus(out: Line, a: f64, x: Line) -> Line {
    [out[0] + a * x[0], out[1] + a * x[1], out[2] + a * x[2], out[3] + a * x[3]]
}

/// out − a x.
#[inline(always)]
fn minus(out: Line, a: f64, x: Line) -> Line {
    [out[0] - a * x[0], out[1] - a * x[1], out[2] - a * x[2], out[3] - a * x[3]]
}

/// a x.
#[inline(always)]
fn times(a: f64, x: Line) -> Line {
    [a * x[0], a * x[1], a * x[2], a * x[3]]
}

/// Σ xᵢ.
#[inline(always)]
pub fn sum(x: &Line) -> f64 {
    (x[0] + x[2]) + (x[1] + x[3])
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
    sum(&sums) + rest
}

/// The three rows of a matrix for x, y and z.
#[inline(always)]
pub fn rows(of: &[f64], stride: usize) -> [&[f64]; 3] {
    let (x, rest) = of.split_at(stride);
    let (y, z) = rest.split_at(stride);
    [x, y, &z[..stride]]
}

/// Where the blocks of a block column begin, of so many.
#[inline(always)]
fn first(p: usize, blocks: usize) -> usize {
    p * (2 * blocks + 1 - p) / 2
}

/// See the module's text.
#[derive(Clone)]
pub struct Square {
    /// Block columns from the diagonal down. Once factorized L D; what is above the diagonal is of no meaning.
    blocks: Vec<Block>,
    /// One over D.
    inverse: Vec<Line>,
    /// Σ J f.
    along: Vec<Line>,
    /// Of one block row L.
    row: Vec<Block>,
    solution: Vec<Line>,
    arch: Arch,
}

impl Square {
    /// Of n rows.
    pub fn new(n: usize) -> Self {
        let blocks = padded(n) / LINE;
        Self {
            blocks: vec![Block::default(); first(blocks, blocks)],
            inverse: vec![Line::default(); blocks],
            along: vec![Line::default(); blocks],
            row: vec![Block::default(); blocks],
            solution: vec![Line::default(); blocks],
            arch: Arch::new(), // all sums have one order
        }
    }

    /// Becomes a diagonal, and ones follow it in the last block. The sum beside it becomes zero.
    pub fn set_diagonal(&mut self, diagonal: &[f64]) {
        self.blocks.fill(Block::default());
        self.along.fill(Line::default());
        let n = self.inverse.len();
        for p in 0..n {
            let block = &mut self.blocks[first(p, n)];
            for i in 0..LINE {
                block[i][i] = diagonal.get(p * LINE + i).copied().unwrap_or(1.0);
            }
        }
    }

    /// Adds J H Jᵀ, and J f beside it. J has a padded row for each of x, y and z.
    pub fn add(&mut self, jacobian: &[f64], h: &Matrix3<f64>, f: &Vec3) {
        let Self { blocks, along, arch, .. } = self;
        arch.dispatch(Add { jacobian, h: h.data.0, f: f.data.0[0], blocks, along });
    }

    /// Σ J f.
    pub fn along(&self) -> &[f64] {
        self.along.as_flattened()
    }

    /// Becomes its factors and replaces b by the solution; whether it is positive.
    pub fn solve(&mut self, b: &mut [f64]) -> bool {
        let Self { blocks, inverse, row, solution, arch, .. } = self;
        arch.dispatch(Solve { blocks, inverse, row, solution, b })
    }
}

struct Add<'a> {
    jacobian: &'a [f64],
    /// Columns of H.
    h: [[f64; 3]; 3],
    f: [f64; 3],
    blocks: &'a mut [Block],
    along: &'a mut [Line],
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { jacobian, h, f, mut blocks, along } = self;
        let [x, y, z] = rows(jacobian, jacobian.len() / 3).map(lines);
        for (p, along) in along.iter_mut().enumerate() {
            *along = plus(plus(plus(*along, f[0], x[p]), f[1], y[p]), f[2], z[p]);
            let (column, rest) = std::mem::take(&mut blocks).split_at_mut(x.len() - p);
            blocks = rest;
            let mut turned = [Line::default(); 3]; // of H J
            for (turned, h) in turned.iter_mut().zip(&h) {
                *turned = plus(plus(plus(*turned, h[0], x[p]), h[1], y[p]), h[2], z[p]);
            }
            for (block, ((x, y), z)) in column.iter_mut().zip(x[p..].iter().zip(&y[p..]).zip(&z[p..])) {
                let (x, y, z, mut sums) = (*x, *y, *z, *block);
                for c in 0..LINE {
                    sums[c] = plus(sums[c], turned[0][c], x);
                    sums[c] = plus(sums[c], turned[1][c], y);
                    sums[c] = plus(sums[c], turned[2][c], z);
                }
                *block = sums;
            }
        }
    }
}

struct Solve<'a> {
    blocks: &'a mut [Block],
    inverse: &'a mut [Line],
    row: &'a mut [Block],
    solution: &'a mut [Line],
    b: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { blocks, inverse, row, solution, b } = self;
        let n = inverse.len();
        for (p, line) in solution.iter_mut().enumerate() {
            *line = std::array::from_fn(|i| b.get(p * LINE + i).copied().unwrap_or(0.0));
        }
        if !eliminate(blocks, inverse, row, solution) {
            return false;
        }
        for p in (0..n).rev() {
            let column = &blocks[first(p, n)..first(p + 1, n)];
            let (here, below) = solution[p..].split_at_mut(1);
            let here = &mut here[0];
            let mut sums = Block::default();
            for (block, line) in column[1..].iter().zip(&*below) {
                for c in 0..LINE {
                    for i in 0..LINE {
                        sums[c][i] += block[c][i] * line[i];
                    }
                }
            }
            for c in (0..LINE).rev() {
                let mut rest = sum(&sums[c]);
                for i in c + 1..LINE {
                    rest += column[0][c][i] * here[i];
                }
                here[c] -= inverse[p][c] * rest;
            }
        }
        b.iter_mut().zip(solution.as_flattened()).for_each(|(b, x)| *b = *x);
        true
    }
}

/// Factorizes, and takes b to D⁻¹L⁻¹b.
#[inline(always)]
fn eliminate(blocks: &mut [Block], inverse: &mut [Line], row: &mut [Block], b: &mut [Line]) -> bool {
    let n = inverse.len();
    for p in 0..n {
        let (before, rest) = blocks.split_at_mut(first(p, n));
        let column = &mut rest[..n - p];
        let (done, here) = b.split_at_mut(p);
        let mut here = here[0];
        for (q, row) in row[..p].iter_mut().enumerate() {
            let block = before[first(q, n) + p - q];
            for k in 0..LINE {
                here = minus(here, done[q][k], block[k]);
                row[k] = times(inverse[q][k], block[k]);
            }
        }
        for (l, block) in column.iter_mut().enumerate() {
            let mut sums = *block;
            for (q, row) in row[..p].iter().enumerate() {
                let left = before[first(q, n) + p - q + l];
                for c in 0..LINE {
                    for k in 0..LINE {
                        sums[c] = minus(sums[c], row[k][c], left[k]);
                    }
                }
            }
            *block = sums;
        }
        let (mut top, mut scaled) = (column[0], Block::default());
        for k in 0..LINE {
            let pivot = top[k][k];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let inverse_pivot = pivot.recip();
            inverse[p][k] = inverse_pivot;
            here[k] *= inverse_pivot;
            for c in k + 1..LINE {
                scaled[k][c] = top[k][c] * inverse_pivot;
                here[c] -= here[k] * top[k][c];
                top[c] = minus(top[c], scaled[k][c], top[k]);
            }
        }
        column[0] = top;
        b[p] = here;
        for block in &mut column[1..] {
            let mut sums = *block;
            for c in 1..LINE {
                for k in 0..c {
                    sums[c] = minus(sums[c], scaled[k][c], sums[k]);
                }
            }
            *block = sums;
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
            let force = Vec3::new(1.0, -2.0, 0.5);
            square.add(&jacobian, &h, &force);
            square.add(&jacobian, &Matrix3::zeros(), &force);
            // Sums of six products of numbers up to 2 lose some of 16 digits.
            let along = 2.0 * &dense * force;
            assert!(square.along().iter().zip(&along).all(|(a, b)| (a - b).abs() < 1e-14), "{n}");
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

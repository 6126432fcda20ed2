//! A symmetric positive matrix D + Σ J H Jᵀ with D diagonal, H 3 × 3: its sum, and its solutions by Cholesky's factors.
//!
//! It is held in blocks of four rows and columns. All sums are in one order, whatever the processor's registers, so that all have the same bits.

use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

/// Numbers of a line.
pub const LINE: usize = 4;
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

/// out + (a x + b y + c z).
#[inline(always)]
pub fn plus_three(out: Line, [a, b, c]: [f64; 3], x: Line, y: Line, z: Line) -> Line {
    [
        out[0] + (a * x[0] + b * y[0] + c * z[0]),
        out[1] + (a * x[1] + b * y[1] + c * z[1]),
        out[2] + (a * x[2] + b * y[2] + c * z[2]),
        out[3] + (a * x[3] + b * y[3] + c * z[3]),
    ]
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
    /// Block columns from the diagonal down, or those of the factor; what is on its diagonal and above is of no meaning.
    blocks: Vec<Block>,
    /// One over the factor's diagonal.
    inverse: Vec<Line>,
    solution: Vec<Line>,
    /// J H of one term.
    turned: Vec<[Line; 3]>,
    arch: Arch,
}

impl Square {
    /// Of n rows.
    pub fn new(n: usize) -> Self {
        let blocks = padded(n) / LINE;
        Self {
            blocks: vec![Block::default(); first(blocks, blocks)],
            inverse: vec![Line::default(); blocks],
            solution: vec![Line::default(); blocks],
            turned: vec![[Line::default(); 3]; blocks],
            arch: Arch::new(), // all sums have one order
        }
    }

    /// Becomes a diagonal, and ones follow it in the last block.
    pub fn set_diagonal(&mut self, diagonal: &[f64]) {
        self.blocks.fill(Block::default());
        let n = self.inverse.len();
        for p in 0..n {
            let block = &mut self.blocks[first(p, n)];
            for i in 0..LINE {
                block[i][i] = diagonal.get(p * LINE + i).copied().unwrap_or(1.0);
            }
        }
    }

    /// Adds J H Jᵀ. J has a padded row for each of x, y and z.
    pub fn add(&mut self, jacobian: &[f64], h: &Matrix3<f64>) {
        let Self { blocks, turned, arch, .. } = self;
        arch.dispatch(Add { jacobian, h: h.data.0, blocks, turned });
    }

    /// Becomes its factor and replaces b by the solution; whether it is positive.
    pub fn solve(&mut self, b: &mut [f64]) -> bool {
        let Self { blocks, inverse, solution, arch, .. } = self;
        arch.dispatch(Solve { blocks, inverse, solution, b })
    }
}

struct Add<'a> {
    jacobian: &'a [f64],
    /// Columns of H.
    h: [[f64; 3]; 3],
    blocks: &'a mut [Block],
    turned: &'a mut [[Line; 3]],
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { jacobian, h, mut blocks, turned } = self;
        let [x, y, z] = rows(jacobian, jacobian.len() / 3).map(lines);
        for (l, turned) in turned.iter_mut().enumerate() {
            for (turned, h) in turned.iter_mut().zip(h) {
                *turned = plus_three(Line::default(), h, x[l], y[l], z[l]);
            }
        }
        for p in 0..x.len() {
            let (column, rest) = std::mem::take(&mut blocks).split_at_mut(x.len() - p);
            blocks = rest;
            for (l, block) in column.iter_mut().enumerate() {
                let (u, v, w, mut sums) = (turned[p + l][0], turned[p + l][1], turned[p + l][2], *block);
                for c in 0..LINE {
                    sums[c] = plus_three(sums[c], [x[p][c], y[p][c], z[p][c]], u, v, w);
                }
                *block = sums;
            }
        }
    }
}

struct Solve<'a> {
    blocks: &'a mut [Block],
    inverse: &'a mut [Line],
    solution: &'a mut [Line],
    b: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { blocks, inverse, solution, b } = self;
        let n = inverse.len();
        for (p, line) in solution.iter_mut().enumerate() {
            *line = std::array::from_fn(|i| b.get(p * LINE + i).copied().unwrap_or(0.0));
        }
        if !eliminate(blocks, inverse, solution) {
            return false;
        }
        for p in (0..n).rev() {
            let column = &blocks[first(p, n)..first(p + 1, n)];
            let (here, below) = solution[p..].split_at_mut(1);
            let here = &mut here[0];
            for c in (0..LINE).rev() {
                let mut sums = Line::default();
                for i in c + 1..LINE {
                    sums[i] += column[0][c][i] * here[i];
                }
                for (block, line) in column[1..].iter().zip(&*below) {
                    let x = block[c];
                    sums = std::array::from_fn(|i| sums[i] + x[i] * line[i]);
                }
                here[c] = (here[c] - sum(&sums)) * inverse[p][c];
            }
        }
        b.iter_mut().zip(solution.as_flattened()).for_each(|(b, x)| *b = *x);
        true
    }
}

/// Factorizes to L, and takes b to L⁻¹b.
#[inline(always)]
fn eliminate(blocks: &mut [Block], inverse: &mut [Line], b: &mut [Line]) -> bool {
    let n = inverse.len();
    for p in 0..n {
        let (before, rest) = blocks.split_at_mut(first(p, n));
        let column = &mut rest[..n - p];
        let (done, here) = b.split_at_mut(p);
        let mut here = here[0];
        for (q, done) in done.iter().enumerate() {
            let row = before[first(q, n) + p - q];
            for k in 0..LINE {
                here = minus(here, done[k], row[k]);
            }
        }
        for (l, block) in column.iter_mut().enumerate() {
            let mut sums = *block;
            for q in 0..p {
                let at = first(q, n) + p - q;
                let (row, left) = (&before[at], before[at + l]);
                for c in 0..LINE {
                    for k in 0..LINE {
                        sums[c] = minus(sums[c], row[k][c], left[k]);
                    }
                }
            }
            *block = sums;
        }
        let mut top = column[0];
        for k in 0..LINE {
            let pivot = top[k][k];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            inverse[p][k] = pivot.sqrt().recip();
            top[k] = times(inverse[p][k], top[k]);
            here[k] *= inverse[p][k];
            for c in k + 1..LINE {
                here[c] -= here[k] * top[k][c];
                top[c] = minus(top[c], top[k][c], top[k]);
            }
        }
        column[0] = top;
        b[p] = here;
        for block in &mut column[1..] {
            let mut sums = *block;
            for c in 0..LINE {
                for k in 0..c {
                    sums[c] = minus(sums[c], top[k][c], sums[k]);
                }
                sums[c] = times(inverse[p][c], sums[c]);
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

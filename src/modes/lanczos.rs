//! Block Lanczos with full reorthogonalization and thick restart, for the largest eigenvalues θ of a symmetric operator
//! that can only be applied: here (A − σI)⁻¹, whose largest θ = 1/(λ − σ) are the lowest modes.
//!
//! After each step  Op V = V T + Q R Eᵀ  holds for the processed columns V (orthonormal), the pending block Q and the last
//! block's unit columns E, so ‖Op y − θ y‖ = ‖R s_last‖ for the Ritz pair y = V s, T s = θ s. A block as wide as a repeated
//! eigenvalue's multiplicity finds all its vectors at once; fresh random columns find those beyond.

use crate::{Error, ErrorKind, Result};
use faer::linalg::matmul::matmul;
use faer::prelude::*;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// A new direction is kept only if this much of the operator's result is left after removing the old ones; what remains
/// below is rounding.
const DEFLATION: f64 = 1e-13;

/// The growing basis and its projected operator.
pub struct BlockLanczos {
    /// Columns 0..processed are V, the next `pending` ones are Q.
    basis: Mat<f64>,
    processed: usize,
    pending: usize,
    width: usize,
    /// T (processed × processed in the top left corner).
    projected: Mat<f64>,
    /// R of the last step.
    coupling: Mat<f64>,
    random: SplitMix64,
}

/// Ritz pairs in descending order of θ: values, residuals ‖Op y − θ y‖ and coefficients in V.
pub struct Ritz {
    pub values: Vec<f64>,
    pub residuals: Vec<f64>,
    coefficients: Mat<f64>,
}

impl BlockLanczos {
    /// Starts from a deterministic pseudo-random block. `capacity` ≥ 3 `width` columns are kept at most, `n` of them or fewer.
    pub fn new(n: usize, width: usize, capacity: usize) -> Result<Self> {
        crate::error::try_zeroed::<f64>("the Lanczos basis", n * (capacity + width))?;
        let mut this = Self {
            basis: Mat::zeros(n, capacity + width),
            processed: 0,
            pending: 0,
            width,
            projected: Mat::zeros(capacity, capacity),
            coupling: Mat::zeros(width, width),
            random: SplitMix64(0x5eed),
        };
        (0..width).for_each(|_| this.push_random());
        Ok(this)
    }

    /// Columns that can still be processed before a restart is due.
    pub fn room(&self) -> usize {
        self.projected.ncols() - self.processed
    }

    /// Columns processed so far.
    pub fn processed(&self) -> usize {
        self.processed
    }

    /// Applies the operator to the pending block and orthogonalizes the result into a new pending block.
    pub fn step(&mut self, op: &mut dyn FnMut(MatMut<'_, f64>) -> Result<()>) -> Result<()> {
        let first = self.processed;
        let width = self.pending;
        let mut block = self.basis.subcols(first, width).to_owned();
        op(block.as_mut())?;
        if !block.norm_max().is_finite() {
            return Err(Error::new(ErrorKind::Numerical, "the shifted stiffness could not be inverted accurately"));
        }
        let scale = block.norm_l2();
        self.processed += width;
        self.pending = 0;

        let overlap = self.remove_processed(block.as_mut());
        for j in 0..width {
            for i in 0..self.processed {
                // Inside the new diagonal block both triangles were computed; their mean is symmetric.
                let twin = if i >= first { overlap[(first + j, i - first)] } else { overlap[(i, j)] };
                let value = 0.5 * (overlap[(i, j)] + twin);
                self.projected[(i, first + j)] = value;
                self.projected[(first + j, i)] = value;
            }
        }
        self.coupling = Mat::zeros(width, width);
        for j in 0..width {
            self.accept(block.col(j), j, DEFLATION * scale);
        }
        Ok(())
    }

    /// Solves the projected problem.
    pub fn ritz(&self) -> Result<Ritz> {
        let p = self.processed;
        let (values, vectors) = super::dense::symmetric_eigen(self.projected.submatrix(0, 0, p, p))?;
        let coefficients = Mat::from_fn(p, p, |i, j| vectors[(i, p - 1 - j)]);
        let width = self.coupling.ncols();
        let tail = &self.coupling * coefficients.subrows(p - width, width);
        Ok(Ritz {
            values: values.into_iter().rev().collect(),
            residuals: (0..p).map(|j| tail.col(j).norm_l2()).collect(),
            coefficients,
        })
    }

    /// The first `count` Ritz vectors (n × count), orthonormal.
    pub fn vectors(&self, ritz: &Ritz, count: usize) -> Mat<f64> {
        self.basis.subcols(0, self.processed) * ritz.coefficients.subcols(0, count)
    }

    /// The first `count` Ritz vectors after one more application of the operator, which comes for free: Op y = θ y + Q R s.
    /// It removes what ‖A‖ would blow up, so ‖Ay − λy‖ falls from ‖A‖ to λ times the relative residual.
    pub fn purified_vectors(&self, ritz: &Ritz, count: usize) -> Mat<f64> {
        let width = self.coupling.ncols();
        let tail = ritz.coefficients.submatrix(self.processed - width, 0, width, count);
        let mut correction = &self.coupling * tail;
        for j in 0..count {
            correction.as_mut().col_mut(j).iter_mut().for_each(|x| *x /= ritz.values[j]);
        }
        self.vectors(ritz, count) + self.basis.subcols(self.processed, width) * correction
    }

    /// Keeps the first `keep` Ritz vectors and the pending block.
    pub fn restart(&mut self, ritz: &Ritz, keep: usize) {
        let kept = self.vectors(ritz, keep);
        let pending = self.basis.subcols(self.processed, self.pending).to_owned();
        self.basis.as_mut().subcols_mut(0, keep).copy_from(&kept);
        self.basis.as_mut().subcols_mut(keep, self.pending).copy_from(&pending);
        self.processed = keep;
        for j in 0..keep {
            for i in 0..keep {
                self.projected[(i, j)] = if i == j { ritz.values[j] } else { 0.0 };
            }
        }
    }

    /// Replaces the pending block by random directions, to look for what the present Krylov space cannot contain.
    pub fn refresh(&mut self) {
        self.pending = 0;
        (0..self.width).for_each(|_| self.push_random());
    }

    /// Removes the processed directions from `block`, twice for full accuracy; returns Vᵀ block.
    fn remove_processed(&self, mut block: MatMut<'_, f64>) -> Mat<f64> {
        let v = self.basis.subcols(0, self.processed);
        let mut overlap = Mat::zeros(self.processed, block.ncols());
        for _ in 0..2 {
            let part = v.transpose() * block.rb();
            subtract_product(block.rb_mut(), v, part.as_ref());
            overlap += part;
        }
        overlap
    }

    /// Orthogonalizes one column against the pending ones and appends it, or a random direction when nothing is left.
    fn accept(&mut self, column: ColRef<'_, f64>, j: usize, threshold: f64) {
        let mut candidate = column.to_owned();
        for _ in 0..2 {
            for k in 0..self.pending {
                let q = self.basis.col(self.processed + k);
                let along = q.transpose() * &candidate;
                candidate -= q * Scale(along);
                self.coupling[(k, j)] += along;
            }
        }
        let norm = candidate.norm_l2();
        if norm > threshold {
            self.coupling[(self.pending, j)] = norm;
            self.push(&(candidate * Scale(1.0 / norm)));
        } else {
            self.push_random();
        }
    }

    fn push(&mut self, column: &Col<f64>) {
        self.basis.as_mut().col_mut(self.processed + self.pending).copy_from(column);
        self.pending += 1;
    }

    /// Appends a unit vector orthogonal to everything, made from the generator.
    fn push_random(&mut self) {
        let n = self.basis.nrows();
        let mut column = Mat::from_fn(n, 1, |_, _| self.random.symmetric());
        for _ in 0..3 {
            let used = self.basis.subcols(0, self.processed + self.pending);
            let part = used.transpose() * &column;
            subtract_product(column.as_mut(), used, part.as_ref());
            let norm = column.norm_l2();
            column *= Scale(1.0 / norm);
        }
        self.push(&column.col(0).to_owned());
    }
}

/// block ← block − v part.
fn subtract_product(block: MatMut<'_, f64>, v: MatRef<'_, f64>, part: MatRef<'_, f64>) {
    matmul(block, Accum::Add, v, part, -1.0, Par::Seq);
}

/// Steele, Lea, Flood: a small generator with a fixed sequence, so that results are reproducible everywhere.
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Uniform in [−1, 1).
    pub fn symmetric(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }
}

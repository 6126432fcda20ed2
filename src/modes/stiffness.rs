//! The mass-scaled rest stiffness A = M^−½ K M^−½ on the free unknowns, as a sparse symmetric matrix.
//!
//! A has the eigenvalues of Kφ = λMφ and the eigenvectors y = M^½ φ, is symmetric, and does not change when the unit of
//! mass and stiffness does. K is a sum of outer products over elements of 2 to 4 vertices, so A consists of 3 × 3 blocks.

use crate::mesh::NONE;
use crate::{Error, ErrorKind, Result, Shell};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};

/// The lower triangle of A, and M^½ per unknown.
pub struct ScaledStiffness {
    /// Lower triangle of A, columns sorted (n_unknowns × n_unknowns).
    pub lower: SparseColMat<usize, f64>,
    /// M^½ (n_unknowns).
    pub root_mass: Vec<f64>,
    /// ‖A‖₁, a bound on the largest eigenvalue.
    pub norm: f64,
}

/// For each free vertex, the free vertices not before it that share an element with it; the first is itself.
struct BlockPattern {
    start: Vec<usize>,
    rows: Vec<u32>,
}

impl BlockPattern {
    fn column(&self, j: usize) -> &[u32] {
        &self.rows[self.start[j]..self.start[j + 1]]
    }

    fn of(shell: &Shell, index: &[u32]) -> Self {
        let n = shell.free.len();
        let mut columns: Vec<Vec<u32>> = (0..n as u32).map(|j| vec![j]).collect();
        shell.energy.visit_rest_rows(&mut |(vertices, _)| {
            for &v in vertices {
                for &w in vertices {
                    let (j, i) = (index[v as usize], index[w as usize]);
                    if j < i && i != NONE && !columns[j as usize].contains(&i) {
                        columns[j as usize].push(i);
                    }
                }
            }
        });
        let mut start = vec![0];
        let mut rows = Vec::new();
        for column in &mut columns {
            column.sort_unstable();
            rows.extend_from_slice(column);
            start.push(rows.len());
        }
        Self { start, rows }
    }

    /// Expands blocks into the scalar lower triangle.
    fn scalar_pattern(&self) -> SymbolicSparseColMat<usize> {
        let n = self.start.len() - 1;
        let mut col_ptr = vec![0];
        let mut row_idx = Vec::with_capacity(9 * self.rows.len());
        for j in 0..n {
            for c in 0..3 {
                let scalars = self.column(j).iter().flat_map(|&i| (0..3).map(move |d| 3 * i as usize + d));
                row_idx.extend(scalars.skip(c));
                col_ptr.push(row_idx.len());
            }
        }
        SymbolicSparseColMat::new_checked(3 * n, 3 * n, col_ptr, None, row_idx)
    }
}

impl ScaledStiffness {
    /// Assembles A. Fails when an entry is not finite.
    pub fn assemble(shell: &Shell) -> Result<Self> {
        let mut index = vec![NONE; shell.mass.len()];
        shell.free.iter().enumerate().for_each(|(i, &v)| index[v as usize] = i as u32);
        let inverse_root: Vec<f64> = shell.mass.iter().map(|m| 1.0 / m.sqrt()).collect();

        let pattern = BlockPattern::of(shell, &index);
        let scalar = pattern.scalar_pattern();
        let mut values = vec![0.0; scalar.row_idx().len()];
        shell.energy.visit_rest_rows(&mut |(vertices, row)| {
            for (&v, b) in vertices.iter().zip(row).filter(|(v, _)| index[**v as usize] != NONE) {
                let j = index[v as usize];
                let column = pattern.column(j as usize);
                for (&w, a) in vertices.iter().zip(row) {
                    let i = index[w as usize];
                    if i == NONE || i < j {
                        continue;
                    }
                    let block = column.binary_search(&i).expect("the pattern holds every pair of an element");
                    let scale = inverse_root[v as usize] * inverse_root[w as usize];
                    for c in 0..3 {
                        for d in (if i == j { c } else { 0 })..3 {
                            values[scalar.col_ptr()[3 * j as usize + c] + 3 * block + d - c] += scale * b[c] * a[d];
                        }
                    }
                }
            }
        });
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            let message = format!("the stiffness matrix has the entry {bad}: stiffness, density or size out of range");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let lower = SparseColMat::new(scalar, values);
        let root_mass = shell.free.iter().flat_map(|&v| [shell.mass[v as usize].sqrt(); 3]).collect();
        let norm = one_norm(&lower, |_| 1.0);
        Ok(Self { lower, root_mass, norm })
    }

    /// ‖K‖₁ of the unscaled stiffness.
    pub fn unscaled_norm(&self) -> f64 {
        one_norm(&self.lower, |i| self.root_mass[i])
    }

    /// The lower triangle of A − shift·I.
    pub fn shifted(&self, shift: f64) -> SparseColMat<usize, f64> {
        let mut shifted = self.lower.clone();
        let diagonal: Vec<usize> = shifted.symbolic().col_ptr()[..self.root_mass.len()].to_vec();
        let values = shifted.val_mut();
        diagonal.iter().for_each(|&first| values[first] -= shift);
        shifted
    }

    /// y ← A x.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for (i, j, a) in entries(&self.lower) {
            y[i] += a * x[j];
            if i != j {
                y[j] += a * x[i];
            }
        }
        y
    }
}

/// (row, column, value) of every stored entry.
pub fn entries(lower: &SparseColMat<usize, f64>) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    let (pattern, values) = (lower.symbolic(), lower.val());
    (0..lower.ncols()).flat_map(move |j| {
        let range = pattern.col_ptr()[j]..pattern.col_ptr()[j + 1];
        range.map(move |k| (pattern.row_idx()[k], j, values[k]))
    })
}

/// ‖D A D‖₁ with a diagonal D.
fn one_norm(lower: &SparseColMat<usize, f64>, scale: impl Fn(usize) -> f64) -> f64 {
    let mut sums = vec![0.0; lower.ncols()];
    for (i, j, a) in entries(lower) {
        let magnitude = (scale(i) * a * scale(j)).abs();
        sums[j] += magnitude;
        if i != j {
            sums[i] += magnitude;
        }
    }
    sums.into_iter().fold(0.0, f64::max)
}

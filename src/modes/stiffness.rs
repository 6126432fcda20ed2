//! The mass-scaled stiffness A = M^−½ K M^−½, K at rest or where the shell carries its weight, on the free unknowns, as a sparse symmetric matrix.
//!
//! A has the eigenvalues of Kφ = λMφ and the eigenvectors y = M^½ φ, is symmetric, and does not change when the unit of
//! mass and stiffness does. K is a sum of outer products over elements of 2 to 4 vertices, so A consists of 3 × 3 blocks.

use crate::energy::Curvature;
pub use crate::sparse::entries;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::MatMut;
use faer::sparse::SparseColMat;

/// What rollers hold has this eigenvalue, in ‖A‖₁: above all that moves and the shifts that these are counted below.
pub const ABOVE_ALL: f64 = 4.0;

/// The lower triangle of A, and M^½ per unknown.
pub struct ScaledStiffness {
    /// Lower triangle of A, columns sorted (n_unknowns × n_unknowns).
    pub lower: SparseColMat<usize, f64>,
    /// M^½ (n_unknowns).
    pub root_mass: Vec<f64>,
    /// ‖A‖₁ of what moves, a bound on the largest eigenvalue there.
    pub norm: f64,
}

impl ScaledStiffness {
    /// Assembles A. Fails when an entry is not finite.
    pub fn assemble(shell: &Shell) -> Result<Self> {
        let inverse_root: Vec<f64> = shell.mass.iter().map(|m| 1.0 / m.sqrt()).collect();
        let mut matrix = shell.matrix(&[]);
        let mut finite = true; // at held vertices too, which have no entries
        let scale = |a: u32, b: u32| inverse_root[a as usize] * inverse_root[b as usize];
        if shell.is_stressed() {
            shell.energy.visit_hessian(&shell.mesh.positions, Curvature::Exact, &mut |(vertices, blocks)| {
                let block = |p: usize, q: usize| blocks[p * vertices.len() + q] * scale(vertices[p], vertices[q]);
                matrix.add_element(vertices, block);
            });
        } else {
            shell.energy.visit_rest_rows(&mut |(vertices, row)| {
                finite &= row.iter().all(|b| b.iter().all(|x| x.is_finite()));
                let block = |p: usize, q: usize| row[p] * (scale(vertices[p], vertices[q]) * row[q]).transpose();
                matrix.add_element(vertices, block);
            });
        }
        matrix.require_finite()?;
        if !finite {
            let message = "the stiffness at a held vertex is not finite: stiffness, density or size out of range";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let norm = one_norm(&matrix.lower, |_| 1.0);
        matrix.fill_rollers(|_| ABOVE_ALL * if norm > 0.0 { norm } else { 1.0 });
        let lower = matrix.lower;
        let root_mass = shell.free.iter().flat_map(|&v| [shell.mass[v as usize].sqrt(); 3]).collect();
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

    /// The diagonal of A.
    pub fn diagonal(&self) -> Vec<f64> {
        let first = &self.lower.symbolic().col_ptr()[..self.root_mass.len()];
        first.iter().map(|&k| self.lower.val()[k]).collect()
    }

    /// Takes from columns of unknowns what rollers hold.
    pub fn project(&self, shell: &Shell, mut columns: MatMut<'_, f64>) {
        for roller in shell.rollers.iter() {
            let Ok(i) = shell.free.binary_search(&roller.vertex) else { continue };
            for j in 0..columns.ncols() {
                let x = roller.free * Vec3::from_fn(|c, _| columns[(3 * i + c, j)]);
                (0..3).for_each(|c| columns[(3 * i + c, j)] = x[c]);
            }
        }
    }

    /// y ← A x.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        let (pattern, values) = (self.lower.symbolic(), self.lower.val());
        for (j, bounds) in pattern.col_ptr().windows(2).enumerate() {
            let (rows, values) = (&pattern.row_idx()[bounds[0]..bounds[1]], &values[bounds[0]..bounds[1]]);
            // The diagonal entry comes first.
            let mut sum = values[0] * x[j];
            for (&i, a) in rows.iter().zip(values).skip(1) {
                y[i] += a * x[j];
                sum += a * x[i];
            }
            y[j] += sum;
        }
        y
    }
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

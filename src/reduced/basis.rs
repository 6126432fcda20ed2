//! The fields of a reduced basis: the lowest modes, then what they need to bend without stretching.
//!
//! A mode bent far drags others along. To second order the static response to loads along the modes is
//! u = Σ φ_i q_i + ½ Σ Θ_ij q_i q_j with the modal derivatives (Idelsohn, Cardona 1985; Barbič, James 2005)
//!
//!   Θ_ij = −K⁻¹ E‴(φ_i, φ_j).
//!
//! Under loads of all modes alike q_i is as 1/λ_i, so Θ_ij counts with the weight λ₁²/(λ_i λ_j). The weighted derivatives, and
//! whatever poses the basis is trained on, are compressed to the wanted number by the eigenvectors of their Gram matrix in the mass
//! norm, M-orthogonal to the modes.
//!
//! Everything here is in mass-scaled unknowns y = M^½ u, where M-orthonormal is orthonormal.

use crate::energy::{Curvature, Mat3};
use crate::modes::{ScaledStiffness, symmetric_eigen};
use crate::sparse::{Factor, Symbolic};
use crate::{Error, ErrorKind, Result, Shell, Vec3, threads};
use faer::linalg::matmul::{matmul, triangular};
use faer::prelude::*;
use faer::{Accum, ColMut, Mat, MatMut, Par};
use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;

/// The step of a mode for the difference of Hessians turns no edge by more than this, rad. Its error is the square of it; rounding
/// adds 1e-16 over it.
const DIFFERENCE: f64 = 1e-4;

/// Directions whose part beyond the others is less than this of the largest candidate are rounding.
const LEAST_PART: f64 = 1e-7;

/// A displacement field in mass-scaled unknowns.
pub fn scaled(shell: &Shell, field: &[Vec3]) -> Vec<f64> {
    shell.free.iter().flat_map(|&v| (field[v as usize] * shell.mass[v as usize].sqrt()).data.0[0]).collect()
}

/// The displacement of mass-scaled unknowns.
pub fn unscaled(shell: &Shell, y: ColRef<'_, f64>) -> Vec<Vec3> {
    let mut field = vec![Vec3::zeros(); shell.mass.len()];
    for (i, &v) in shell.free.iter().enumerate() {
        let root = shell.mass[v as usize].sqrt();
        field[v as usize] = Vec3::new(y[3 * i], y[3 * i + 1], y[3 * i + 2]) / root;
    }
    field
}

/// Columns of mass-scaled unknowns.
pub fn columns<F: AsRef<[Vec3]>>(shell: &Shell, fields: &[F]) -> Mat<f64> {
    let scaled: Vec<Vec<f64>> = fields.iter().map(|field| scaled(shell, field.as_ref())).collect();
    Mat::from_fn(shell.n_unknowns(), fields.len(), |i, j| scaled[j][i])
}

/// Of the lowest elastic eigenvalue, what is added to all where a shell can move freely; each round leaves as much of what it takes.
const SHIFT: f64 = 1e-4;
const ROUNDS: usize = 3;
/// Of a load, what counts as nothing where inertia takes the rest.
const ROUNDED: f64 = 1e-12;

/// Rigid motions that supports leave free (M-orthonormal), and the lowest eigenvalue beside them.
pub type Loose<'a> = (&'a [Vec<Vec3>], f64);

/// The mass-scaled stiffness A at rest, factorized.
pub struct RestSolver<'a> {
    shell: &'a Shell,
    stiffness: ScaledStiffness,
    symbolic: Arc<Symbolic>,
    factor: Factor,
    /// Columns of what moves freely, and what is added to A for it.
    rigid: Mat<f64>,
    shift: f64,
}

impl<'a> RestSolver<'a> {
    /// Of a shell that is held, or of one with these motions.
    pub fn new(shell: &'a Shell, (rigid, lowest): Loose) -> Result<Self> {
        let stiffness = ScaledStiffness::assemble(shell)?;
        let symbolic = shell.analysis(stiffness.lower.symbolic())?;
        let (shift, mut factor) = (if rigid.is_empty() { 0.0 } else { SHIFT * lowest }, symbolic.factor()?);
        let positive = match rigid.is_empty() {
            true => symbolic.refactorize(&stiffness.lower, &mut factor)?,
            false => symbolic.refactorize(&stiffness.shifted(-shift), &mut factor)?,
        };
        if !positive {
            let message = "a reduced basis needs a shell that is held: its stiffness is singular";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        Ok(Self { shell, stiffness, symbolic, factor, rigid: columns(shell, rigid), shift })
    }

    /// Multiplications of the factorization, and entries of the factor.
    pub fn operations(&self) -> [f64; 2] {
        [self.symbolic.operations(), (self.symbolic.factor_bytes() / size_of::<f64>()) as f64]
    }

    /// Whether it is of one with motions.
    pub fn is_loose(&self) -> bool {
        self.rigid.ncols() > 0
    }

    /// Applies A⁻¹ to columns; of a loose shell on what is in balance, inertia taking the rest.
    pub fn solve(&self, right: &mut Mat<f64>) -> Result<()> {
        self.stiffness.project(self.shell, right.as_mut());
        if !self.is_loose() {
            self.apply(right)?;
            self.stiffness.project(self.shell, right.as_mut());
            return Ok(());
        }
        let balance = |y: &mut Mat<f64>| {
            let inside = self.rigid.transpose() * &*y;
            *y -= &self.rigid * inside;
        };
        let whole: Vec<f64> = right.col_iter().map(|y| y.norm_l2()).collect();
        balance(right);
        for (mut y, whole) in right.col_iter_mut().zip(whole) {
            if y.norm_l2() <= ROUNDED * whole {
                y.fill(0.0);
            }
        }
        let mut solution = Mat::zeros(right.nrows(), right.ncols());
        for _ in 0..ROUNDS {
            let mut next = &*right + &solution * faer::Scale(self.shift);
            self.apply(&mut next)?;
            balance(&mut next);
            solution = next;
        }
        *right = solution;
        Ok(())
    }

    /// Solves by the factor, some columns at a time.
    fn apply(&self, right: &mut Mat<f64>) -> Result<()> {
        let entries = self.symbolic.factor_bytes() / size_of::<f64>();
        let work = 4.0 * MULTIPLICATION * (entries * right.ncols()) as f64;
        let mut parts: Vec<_> = strips(right, SOLVED).into_iter().map(|(_, strip)| (strip, Ok(()))).collect();
        threads::share_items(&mut parts, work as u64, |(strip, solved)| {
            *solved = self.symbolic.solve_in_place(&self.factor, strip.as_mut());
        });
        parts.into_iter().try_for_each(|(_, solved)| solved)
    }
}

/// Nanoseconds of an element's exact Hessian, and of a 3 × 3 block of it times a vector, about.
const ELEMENT: f64 = 500.0;
const BLOCK: f64 = 2.0;

/// Fields whose forces are summed side by side.
const BESIDE: usize = 8;

/// Θ_ij for i ≤ j, row by row (m(m + 1)/2 fields): differences of exact Hessians at x̄ ± εφ_j give E‴(φ_i, φ_j).
pub fn modal_derivatives(rest: &RestSolver, shapes: &[Vec<Vec3>]) -> Result<Vec<Vec<Vec3>>> {
    let (shell, m) = (rest.shell, shapes.len());
    let mut shapes_of = vec![[[0.0; BESIDE]; 3]; shell.mass.len() * m.div_ceil(BESIDE)];
    for (k, shape) in shapes.iter().enumerate() {
        for (some, u) in shapes_of.iter_mut().skip(k / BESIDE).step_by(m.div_ceil(BESIDE)).zip(shape) {
            (0..3).for_each(|c| some[c][k % BESIDE] = u[c]);
        }
    }
    let work = 2.0 * (shell.energy.n_elements() * m) as f64 * (ELEMENT + 16.0 * BLOCK * m as f64);
    let backward: Vec<usize> = (0..m).rev().collect(); // the longest first
    let by_j = threads::map(&backward, work as u64, |j| forces_beside(shell, (shapes, &shapes_of), *j));
    let pairs = (0..m).flat_map(|i| (i..m).map(move |j| (i, j)));
    let force = |i: usize, j: usize| {
        let of_i = by_j[m - 1 - j].iter().skip(i / BESIDE).step_by(j / BESIDE + 1);
        of_i.map(|some| Vec3::from(some.map(|lanes| lanes[i % BESIDE]))).collect()
    };
    let mut forces: Vec<Vec<Vec3>> = pairs.map(|(i, j)| force(i, j)).collect();
    let by_root: Vec<f64> = shell.mass.iter().map(|m| 1.0 / m.sqrt()).collect();
    for force in &mut forces {
        force.iter_mut().zip(&by_root).for_each(|(f, root)| *f *= root * root); // columns() brings M^½
    }
    let mut right = columns(shell, &forces);
    rest.solve(&mut right)?;
    Ok((0..right.ncols()).map(|k| unscaled(shell, right.col(k))).collect())
}

/// x, y and z of some fields at a vertex.
type Beside = [[f64; BESIDE]; 3];

/// −E‴(φ_i, φ_j) for i ≤ j, vertex by vertex, and of what further fields their registers have.
fn forces_beside(shell: &Shell, (shapes, shapes_of): (&[Vec<Vec3>], &[Beside]), j: usize) -> Vec<Beside> {
    let (all, count) = (shapes.len().div_ceil(BESIDE), j / BESIDE + 1);
    let mut forces = vec![[[0.0; BESIDE]; 3]; count * shell.mass.len()];
    let (step, arch) = (DIFFERENCE / steepest(shell, &shapes[j]), Arch::new());
    for sign in [1.0, -1.0] {
        let x: Vec<Vec3> = shell.mesh.positions.iter().zip(&shapes[j]).map(|(x, u)| x + sign * step * u).collect();
        let scale = 0.5 * sign / step;
        shell.energy.visit_hessian(&x, Curvature::Exact, &mut |(vertices, blocks)| {
            for (&v, row) in vertices.iter().zip(blocks.chunks_exact(vertices.len())) {
                let sums = &mut forces[count * v as usize..][..count];
                arch.dispatch(TakeForces { element: (vertices, row), shapes: (shapes_of, all), scale, sums });
            }
        });
    }
    forces
}

/// Takes from a vertex' sums its row of an element's blocks times shapes, scaled.
struct TakeForces<'a> {
    element: (&'a [u32], &'a [Mat3]),
    /// And so many for each vertex.
    shapes: (&'a [Beside], usize),
    scale: f64,
    sums: &'a mut [Beside],
}

impl WithSimd for TakeForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ((vertices, row), (shapes, all)) = (self.element, self.shapes);
        for (k, sum) in self.sums.iter_mut().enumerate() {
            let mut force = [[0.0; BESIDE]; 3];
            for (w, block) in vertices.iter().zip(row) {
                let ([x, y, z], block) = (&shapes[all * *w as usize + k], block.as_slice());
                for c in 0..3 {
                    for i in 0..BESIDE {
                        force[c][i] += block[c] * x[i] + block[3 + c] * y[i] + block[6 + c] * z[i];
                    }
                }
            }
            for c in 0..3 {
                for i in 0..BESIDE {
                    sum[c][i] -= force[c][i] * self.scale;
                }
            }
        }
    }
}

/// The largest rotation or stretch of an edge per unit of `field`.
fn steepest(shell: &Shell, field: &[Vec3]) -> f64 {
    let slope = |e: &crate::mesh::Edge| {
        let [a, b] = e.vertices.map(|v| v as usize);
        (field[b] - field[a]).norm() / (shell.mesh.positions[b] - shell.mesh.positions[a]).norm()
    };
    shell.mesh.edges.iter().map(slope).fold(f64::MIN_POSITIVE, f64::max)
}

/// Rows whose products a thread sums, at least.
const ROWS: usize = 2048;
/// Nanoseconds that a multiplication of a matrix product takes, about.
pub const MULTIPLICATION: f64 = 0.05;

/// sum += left × right, of its lower triangle.
pub fn add_lower(sum: MatMut<'_, f64>, left: MatRef<'_, f64>, right: MatRef<'_, f64>) {
    let (lower, whole) = (triangular::BlockStructure::TriangularLower, triangular::BlockStructure::Rectangular);
    triangular::matmul(sum, lower, Accum::Add, left, whole, right, whole, 1.0, Par::Seq);
}

/// YᵀY.
fn gram(y: &Mat<f64>) -> Mat<f64> {
    let (rows, n) = y.shape();
    let firsts: Vec<usize> = (0..rows).step_by(ROWS).collect();
    let work = 0.5 * MULTIPLICATION * (rows * n * n) as f64;
    let sums = threads::map(&threads::parts(&firsts, 1), work as u64, |part| {
        let mut sum = Mat::zeros(n, n);
        for first in part.iter() {
            let some = y.subrows(*first, ROWS.min(rows - first));
            add_lower(sum.as_mut(), some.transpose(), some);
        }
        sum
    });
    let mut sum = Mat::<f64>::zeros(n, n);
    sums.iter().for_each(|part| sum += part);
    Mat::from_fn(n, n, |i, j| sum[(i.max(j), i.min(j))])
}

/// Yx, by as many rows as [`gram`] takes.
fn product(y: &Mat<f64>, x: &Mat<f64>) -> Mat<f64> {
    let firsts: Vec<usize> = (0..y.nrows()).step_by(ROWS).collect();
    let work = MULTIPLICATION * (y.nrows() * x.nrows() * x.ncols()) as f64;
    let parts = threads::map(&firsts, work as u64, |first| {
        let rows = y.subrows(*first, ROWS.min(y.nrows() - first));
        let mut part = Mat::zeros(rows.nrows(), x.ncols());
        matmul(part.as_mut(), Accum::Replace, rows, x, 1.0, Par::Seq);
        part
    });
    let mut out = Mat::zeros(y.nrows(), x.ncols());
    for (first, part) in firsts.into_iter().zip(&parts) {
        out.subrows_mut(first, part.nrows()).copy_from(part);
    }
    out
}

/// Columns that a thread takes at once.
pub const STRIP: usize = 16;
/// Directions that are made orthonormal together.
const TOGETHER: usize = 8;
/// Columns that a thread solves for at once.
const SOLVED: usize = 4;

/// Some columns at a time of a matrix, and the first one's number.
pub fn strips(matrix: &mut Mat<f64>, width: usize) -> Vec<(usize, MatMut<'_, f64>)> {
    let (n, mut strips) = (matrix.ncols(), vec![]);
    let mut rest = matrix.as_mut();
    for first in (0..n).step_by(width) {
        let (strip, others) = rest.split_at_col_mut(width.min(n - first));
        strips.push((first, strip));
        rest = others;
    }
    strips
}

/// Takes off columns what the orthonormal columns of `basis` hold of them, twice for the rounding of the first time.
fn clear_of(basis: MatRef<'_, f64>, mut columns: MatMut<'_, f64>) {
    let (rows, n) = columns.shape();
    let firsts: Vec<usize> = (0..rows).step_by(ROWS).collect();
    let some = |first: usize| (first, ROWS.min(rows - first));
    let work = MULTIPLICATION * (rows * basis.ncols() * n) as f64;
    for _ in 0..2 {
        let held = threads::map(&threads::parts(&firsts, 1), work as u64, |part| {
            let mut sum = Mat::zeros(basis.ncols(), n);
            for (first, count) in part.iter().map(|first| some(*first)) {
                let (basis, columns) = (basis.subrows(first, count), columns.as_ref().subrows(first, count));
                matmul(sum.as_mut(), Accum::Add, basis.transpose(), columns, 1.0, Par::Seq);
            }
            sum
        });
        let mut inside = Mat::<f64>::zeros(basis.ncols(), n);
        held.iter().for_each(|part| inside += part);
        let mut rest = columns.as_mut();
        let mut parts = vec![];
        for (first, count) in firsts.iter().map(|first| some(*first)) {
            let (part, others) = rest.split_at_row_mut(count);
            parts.push((basis.subrows(first, count), part));
            rest = others;
        }
        threads::share_items(&mut parts, work as u64, |(basis, part)| {
            matmul(part.as_mut(), Accum::Add, *basis, &inside, -1.0, Par::Seq);
        });
    }
}

/// Appends to the orthonormal columns `basis` up to `wanted` orthonormal directions that hold most of `candidates`.
pub fn extend(basis: &mut Mat<f64>, candidates: Mat<f64>, wanted: usize) -> Result<()> {
    extend_by(basis, candidates, (wanted, LEAST_PART))
}

/// The same, of directions along which candidates have more than this part of the largest.
pub fn extend_by(basis: &mut Mat<f64>, mut candidates: Mat<f64>, (wanted, least): (usize, f64)) -> Result<()> {
    let largest = (0..candidates.ncols()).map(|k| candidates.col(k).norm_l2()).fold(0.0, f64::max);
    clear_of(basis.as_ref(), candidates.as_mut());
    let (values, vectors) = symmetric_eigen(gram(&candidates).as_ref())?;
    let told = |k: &usize| values[*k] > (least * largest).powi(2);
    let kept: Vec<usize> = (0..values.len()).rev().take(wanted).take_while(told).collect();
    let mixing = Mat::from_fn(values.len(), kept.len(), |i, k| vectors[(i, kept[k])]);
    let directions = product(&candidates, &mixing);
    let (rows, old) = basis.shape();
    let mut all = Mat::zeros(rows, old + kept.len());
    all.subcols_mut(0, old).copy_from(&basis);
    // What rounding left in small directions grows as these are made as long as any.
    for first in (0..kept.len()).step_by(TOGETHER) {
        let (done, mut rest) = all.as_mut().split_at_col_mut(old + first);
        let mut own = rest.as_mut().subcols_mut(0, TOGETHER.min(kept.len() - first));
        own.copy_from(directions.subcols(first, own.ncols()));
        own.as_mut().col_iter_mut().for_each(normalize);
        clear_of(done.as_ref(), own.as_mut());
        for k in 0..own.ncols() {
            let (before, mut rest) = own.as_mut().split_at_col_mut(k);
            let mut y = rest.as_mut().col_mut(0);
            for _ in 0..2 {
                let inside = before.as_ref().transpose() * &y;
                y -= before.as_ref() * inside;
                normalize(y.as_mut());
            }
        }
    }
    *basis = all;
    Ok(())
}

fn normalize(y: ColMut<'_, f64>) {
    let scale = 1.0 / y.norm_l2();
    zip!(y).for_each(|unzip!(y)| *y *= scale);
}

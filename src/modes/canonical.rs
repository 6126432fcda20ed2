//! A stated choice of sign and of basis for repeated eigenvalues, so that results are reproducible.
//!
//! Within a group of equal eigenvalues only the spanned space is determined. Reference fields are projected onto it in a
//! fixed order – translations along x, y, z, infinitesimal rotations about x, y, z through the centre of mass, then a fixed
//! pseudo-random sequence – and orthonormalized; a field that has (almost) no part in what is left of the space is passed
//! over. A single mode is a group of one: its sign is the one that agrees with the first reference field that sees it.

use super::lanczos::SplitMix64;
use crate::{Shell, Vec3};
use faer::Mat;
use faer::prelude::*;

/// Eigenvalues closer than this, relative to the larger, count as repeated. Mesh symmetry makes pairs equal to rounding;
/// modes that differ by less than this cannot be told apart by eye or by any tolerance that hosts use.
pub const REPEATED: f64 = 1e-9;

/// A field whose unit projection onto the space is shorter than this is passed over: by symmetry many are zero, and rounding
/// must not decide.
const VISIBLE: f64 = 1e-3;

/// Whether two neighbouring eigenvalues, ascending and not negative, belong to one group.
pub fn repeated(lower: f64, upper: f64) -> bool {
    upper - lower <= REPEATED * upper
}

/// Replaces the columns of `modes` (mass-scaled, orthonormal, eigenvalues ascending), on the unknowns of the vertices `free`,
/// by the stated basis of each group.
pub fn canonicalize(shell: &Shell, free: &[u32], root_mass: &[f64], eigenvalues: &[f64], modes: &mut Mat<f64>) {
    let fields = rigid_fields(shell, free, root_mass);
    let mut first = 0;
    for group in eigenvalues.chunk_by(|a, b| repeated(*a, *b)) {
        let span = modes.subcols(first, group.len()).to_owned();
        let basis = stated_basis(&span, &fields);
        modes.as_mut().subcols_mut(first, group.len()).copy_from(&basis);
        first += group.len();
    }
}

/// Orthonormal coordinates (k × k) of projected reference fields, applied to the k columns of `span`.
fn stated_basis(span: &Mat<f64>, fields: &[Col<f64>]) -> Mat<f64> {
    let (n, k) = (span.nrows(), span.ncols());
    let mut random = SplitMix64(0xba515);
    let mut rotation = Mat::<f64>::zeros(k, k);
    let mut chosen = 0;
    let mut next = 0;
    while chosen < k && next < fields.len() + 100 * k {
        let field = fields.get(next).cloned().unwrap_or_else(|| unit(Col::from_fn(n, |_| random.symmetric())));
        // A random unit field sees a k-dimensional space with about √(k/n); past the rigid fields only rounding is refused.
        let visible = if next < fields.len() { VISIBLE } else { VISIBLE / (n as f64).sqrt() };
        next += 1;
        let mut part = span.transpose() * &field;
        for _ in 0..2 {
            for j in 0..chosen {
                let along = rotation.col(j).transpose() * &part;
                part -= rotation.col(j) * Scale(along);
            }
        }
        let norm = part.norm_l2();
        if norm > visible {
            rotation.as_mut().col_mut(chosen).copy_from(&(part * Scale(1.0 / norm)));
            chosen += 1;
        }
    }
    if chosen == k { span * rotation } else { span.clone() } // numbers that are not finite have no stated basis
}

/// The six mass-scaled unit rigid fields on the vertices `free`; those that vanish are left out.
fn rigid_fields(shell: &Shell, free: &[u32], root_mass: &[f64]) -> Vec<Col<f64>> {
    let x = |i: usize| shell.mesh.positions[free[i] as usize];
    let total: f64 = free.iter().map(|&v| shell.mass[v as usize]).sum();
    let weighted = |i: usize| shell.mass[free[i] as usize] / total * x(i);
    let centre: Vec3 = (0..free.len()).map(weighted).sum();
    let mut fields = Vec::new();
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        fields.push(Col::from_fn(root_mass.len(), |k| root_mass[k] * axis[k % 3]));
    }
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        fields.push(Col::from_fn(root_mass.len(), |k| root_mass[k] * axis.cross(&(x(k / 3) - centre))[k % 3]));
    }
    fields.into_iter().filter(|f| f.norm_l2() > 0.0).map(unit).collect()
}

fn unit(field: Col<f64>) -> Col<f64> {
    let norm = field.norm_l2();
    field * Scale(1.0 / norm)
}

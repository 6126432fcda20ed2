//! A stated choice of sign and of basis for repeated eigenvalues, so that results are reproducible.
//!
//! Within a group of equal eigenvalues only the spanned space is determined. Reference fields are projected onto it in a
//! fixed order – translations along x, y, z, infinitesimal rotations about x, y, z through the centre of mass, then a fixed
//! pseudo-random sequence – and orthonormalized; a field that has (almost) no part in what is left of the space is passed
//! over. A single mode is a group of one: its sign is the one that agrees with the first reference field that sees it.
//!
//! Of a group that is larger than the modes asked for, as the rigid motions of a thousand pieces are, the first of this basis are given.
//! What an acceleration that is the same everywhere does to the group is then in them, and what a turning frame does nearly.

use super::lanczos::SplitMix64;
use crate::{Shell, Vec3};
use faer::prelude::*;
use faer::{Col, Mat, MatMut};

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

/// The space of a group of equal eigenvalues: orthonormal vectors, each of one piece and zero elsewhere.
pub struct Span<'a> {
    /// Unknowns of the whole.
    pub n: usize,
    /// Of each piece, its free vertices, ascending, and vectors on them.
    pub pieces: Vec<(&'a [u32], Mat<f64>)>,
}

impl Span<'_> {
    /// Dimension.
    fn len(&self) -> usize {
        self.pieces.iter().map(|(_, vectors)| vectors.ncols()).sum()
    }

    /// The vectors' parts of `field` (n).
    fn coordinates(&self, field: &Col<f64>) -> Col<f64> {
        let mut all = Col::zeros(self.len());
        let mut first = 0;
        for (free, vectors) in &self.pieces {
            let own = Col::from_fn(vectors.nrows(), |i| field[unknown(free, i)]);
            let k = vectors.ncols();
            all.as_mut().subrows_mut(first, k).copy_from(vectors.transpose() * &own);
            first += k;
        }
        all
    }

    /// Writes the fields with these coordinates to `fields` (n × columns), zero before.
    fn combine(&self, coordinates: &Mat<f64>, mut fields: MatMut<'_, f64>) {
        let mut first = 0;
        for (free, vectors) in &self.pieces {
            let own = vectors * coordinates.subrows(first, vectors.ncols());
            for j in 0..own.ncols() {
                (0..own.nrows()).for_each(|i| fields[(unknown(free, i), j)] = own[(i, j)]);
            }
            first += vectors.ncols();
        }
    }
}

/// The whole's unknown that is the i-th of a piece's.
fn unknown(free: &[u32], i: usize) -> usize {
    3 * free[i / 3] as usize + i % 3
}

/// Writes as many fields of the stated basis of `span` as there are columns in `fields`; `rigid` are the [`rigid_fields`].
pub fn state_basis(span: &Span, rigid: &[Col<f64>], fields: MatMut<'_, f64>) {
    let (n, k, wanted) = (span.n, span.len(), fields.ncols());
    let mut random = SplitMix64(0xba515);
    let mut rotation = Mat::<f64>::zeros(k, wanted);
    let mut chosen = 0;
    let mut next = 0;
    while chosen < wanted && next < rigid.len() + 100 * wanted {
        let field = rigid.get(next).cloned().unwrap_or_else(|| unit(Col::from_fn(n, |_| random.symmetric())));
        // A random unit field sees a k-dimensional space with about √(k/n); past the rigid fields only rounding is refused.
        let visible = if next < rigid.len() { VISIBLE } else { VISIBLE / (n as f64).sqrt() };
        next += 1;
        let mut part = span.coordinates(&field);
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
    if chosen < wanted {
        rotation = Mat::identity(k, wanted); // numbers that are not finite have no stated basis
    }
    span.combine(&rotation, fields);
}

/// The six mass-scaled unit rigid fields; those that vanish are left out.
pub fn rigid_fields(shell: &Shell, root_mass: &[f64]) -> Vec<Col<f64>> {
    let free = &shell.free;
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

//! Which elements stand for all, and with what weight: nonnegative least squares (Lawson, Hanson 1974) on the elements' reduced
//! forces, after Farhat et al. 2014 (energy-conserving sampling and weighting). Weights of one sign keep the reduced energy an energy.
//!
//! With the reduced rest stiffness K = LLᵀ and poses q_s, the columns of the system are the elements' whitened forces L⁻¹ Bᵀ∇E_e(q_s),
//! each pose scaled to a total of 1, and, for the rest stiffness, L⁻¹ K_e L⁻ᵀ ξ for a few fixed random vectors ξ, and L⁻¹ K_e e_k/√λ_k for
//! each mode and each field of the weight; the right-hand side is the sum over all elements. Likewise the parts S_e ε_e of the strains along the
//! stress fields, which the samples' forces follow from. Modes and the weight's fields count more than the rest. What the samples still leave of their stiffness stays left out: a
//! constant matrix that makes up for it at rest is wrong where the shell is bent far, and if negative buckles it.
//!
//! Creases that yield, the last elements, all stand for themselves, and the rest of the elements for the rest: rest angles of their own are known at each.
//!
//! Of a shell that is under stress at rest, forces and strains count by what they differ from those at rest, and its stiffness by differences
//! of forces, since stress is a part of it.

mod nonnegative;

use super::effort::Effort;
use super::elastic::Scratch;
use super::energy::{Forces, ReducedEnergy};
use crate::{Error, ErrorKind, Result, Shell, Vec3, threads};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, MatRef, Par};
use nalgebra::{Cholesky, DMatrix, DVector};
use nonnegative::nonnegative;

/// How much more the rest stiffness of a mode, or of what the weight does to first order, counts than a pose.
const MODE: f64 = 5.0;
/// Of the shell's width, how far differences move it: their error is about the square of what that turns, rounding 1e-16 over it.
const STEP: f64 = 1e-6;

/// Elements that a thread takes at once.
const PART: usize = 512;
/// Nanoseconds that an element's force takes, about, and its strain and stress before that.
const FORCE: u64 = 800;
const PLACED: u64 = 100;
/// Poses that are placed at once.
const AT_ONCE: usize = 8;

/// Weights of all elements (in the order of the rest rows), at most `wanted` of them not 0, that reproduce the forces of `all` at
/// `poses` and its rest stiffness as well as can be, or to `tolerance`; and what they leave of these, relative. `stiffness` is that at
/// rest; the first `modes` fields are modes and what the weight does to first order.
pub fn sample(
    shell: &Shell,
    all: &ReducedEnergy,
    (stiffness, modes): (&DMatrix<f64>, usize),
    (poses, effort): (&[Vec<f64>], &Effort),
    (wanted, tolerance): (usize, f64),
    watch: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<(Vec<f64>, f64)> {
    let n_elements = all.n_elements() - all.n_yielding();
    let singular = || Error::new(ErrorKind::Numerical, "the reduced rest stiffness is not positive definite");
    let lower = Cholesky::new(stiffness.clone()).ok_or_else(singular)?.l();
    let blocks = poses.len() + effort.probes + modes;
    let rows = (all.n() + all.n_stresses()) * blocks;
    let candidates = n_elements.min(effort.entries / rows);
    let picked: Vec<usize> = (0..candidates).map(|k| k * n_elements / candidates).collect();
    let mut column = vec![usize::MAX; all.n_elements()];
    picked.iter().enumerate().for_each(|(c, &e)| column[e] = c);
    let lower = Mat::from_fn(all.n(), all.n(), |i, j| lower[(i, j)]);
    let (a, b, scales) = (vec![0.0; rows * picked.len()], DVector::zeros(rows), vec![1.0; blocks]);
    let mut system = System { all, n_elements, lower, column, a, b, scales };
    system.add_poses(poses);
    let probes = system.probes(stiffness, [effort.probes, modes]);
    match all.is_stressed() {
        true => system.add_stressed_probes(&probes, poses.len()),
        false => system.add_probes(shell, &probes, poses.len()),
    }
    system.scale();
    // Every pose, random vector and mode alike.
    let heavy = system.block() * (poses.len() + effort.probes);
    let left = |residual: &DVector<f64>| {
        let (own, modes) = (residual.rows(0, heavy), residual.rows(heavy, rows - heavy));
        (own.norm_squared() + modes.norm_squared() / (MODE * MODE)).sqrt()
    };
    let whole = left(&system.b).max(f64::MIN_POSITIVE);
    let a = MatRef::from_column_major_slice(&system.a, rows, picked.len());
    let mut told = 0.0f64;
    let (solution, residual) = nonnegative(a, &system.b, wanted, |residual, share| {
        told = told.max(share); // columns are thrown out, too
        watch(told)?;
        Ok(left(residual) <= tolerance * whole)
    })?;
    let mut weights = vec![0.0; n_elements];
    weights.resize(all.n_elements(), 1.0);
    picked.iter().zip(&solution).for_each(|(&e, w)| weights[e] = *w);
    shell.energy.even(&mut weights);
    Ok((weights, left(&residual) / whole))
}

/// Ax = b, whose rows are in blocks of L⁻¹ forces and then strains along the stress fields.
struct System<'a> {
    all: &'a ReducedEnergy,
    /// Those that samples stand for, the first.
    n_elements: usize,
    /// L.
    lower: Mat<f64>,
    /// Of each element in A, if any.
    column: Vec<usize>,
    /// Columns of A, one behind the other.
    a: Vec<f64>,
    b: DVector<f64>,
    /// What each block is yet to be multiplied by.
    scales: Vec<f64>,
}

/// Some elements, their columns of A, and what they add to a block of b.
struct Part<'a> {
    first: usize,
    last: usize,
    columns: &'a mut [f64],
    sum: Vec<f64>,
}

impl System<'_> {
    fn block(&self) -> usize {
        self.all.n() + self.all.n_stresses()
    }

    /// Fills the `k`-th block with the elements' forces, which `force` writes (n, and zeros up to the stride), and strains, which it gives back.
    fn add(&mut self, k: usize, force: impl Fn(usize, &mut [f64]) -> f64 + Sync) {
        let (all, n, block, rows) = (self.all, self.all.n(), self.block(), self.b.len());
        let Self { lower, column, n_elements, .. } = self;
        let (lower, column): (&Mat<f64>, &[usize]) = (lower, column);
        let (mut parts, mut rest) = (vec![], &mut self.a[..]);
        for first in (0..*n_elements).step_by(PART) {
            let last = (first + PART).min(*n_elements);
            let count = column[first..last].iter().filter(|column| **column != usize::MAX).count();
            let (columns, others) = std::mem::take(&mut rest).split_at_mut(count * rows);
            rest = others;
            parts.push(Part { first, last, columns, sum: vec![0.0; block] });
        }
        threads::share_items(&mut parts, FORCE * *n_elements as u64, |part| {
            let (mut row, mut own) = (vec![0.0; all.stride()], vec![0.0; block]);
            let mut columns = part.columns.chunks_exact_mut(rows);
            for e in part.first..part.last {
                let strain = force(e, &mut row);
                own[..n].copy_from_slice(&row[..n]);
                let along = if e < all.n_membrane() { all.stress_row(e) } else { &[] };
                own[n..].fill(0.0);
                own[n..].iter_mut().zip(along).for_each(|(out, s)| *out = s * strain);
                part.sum.iter_mut().zip(&own).for_each(|(sum, x)| *sum += x);
                if column[e] != usize::MAX {
                    let Some(out) = columns.next() else { return };
                    out[k * block..][..block].copy_from_slice(&own);
                }
            }
            let count = part.columns.len() / rows;
            let columns = MatMut::from_column_major_slice_mut(part.columns, rows, count);
            solve_lower_triangular_in_place(lower.as_ref(), columns.submatrix_mut(k * block, 0, n, count), Par::Seq);
        });
        let own = &mut self.b.as_mut_slice()[k * block..][..block];
        parts.iter().for_each(|part| own.iter_mut().zip(&part.sum).for_each(|(sum, x)| *sum += x));
        let forces = MatMut::from_column_major_slice_mut(&mut own[..n], n, 1);
        solve_lower_triangular_in_place(self.lower.as_ref(), forces, Par::Seq);
    }

    /// Fills the first blocks with the forces at poses, each scaled to a total of 1. Where the shell rests under stress, by what they differ from those.
    fn add_poses(&mut self, poses: &[Vec<f64>]) {
        let (all, n) = (self.all, self.all.n());
        let mut at_rest = all.scratch();
        let rest = all.is_stressed().then(|| all.forces(&vec![0.0; n], &mut at_rest));
        let mut rooms: Vec<Scratch> = (0..AT_ONCE.min(poses.len())).map(|_| all.scratch()).collect();
        for (c, some) in poses.chunks(AT_ONCE).enumerate() {
            let mut placed: Vec<(&Vec<f64>, &mut Scratch)> = some.iter().zip(&mut rooms).collect();
            threads::share_items(&mut placed, PLACED * (some.len() * all.n_elements()) as u64, |(pose, scratch)| {
                all.forces(pose, scratch);
            });
            for (k, (pose, scratch)) in placed.into_iter().enumerate() {
                let (k, forces) = (c * AT_ONCE + k, all.forces(pose, scratch)); // as placed
                self.add(k, |e, out| {
                    let strain = forces.of(e, out);
                    rest.as_ref().map_or(strain, |rest| strain - less(rest, e, out))
                });
                let total = self.b.rows(k * self.block(), n).norm();
                self.scales[k] = 1.0 / total.max(f64::MIN_POSITIVE);
            }
        }
    }

    /// Multiplies every block by its scale.
    fn scale(&mut self) {
        let (block, rows, scales) = (self.block(), self.b.len(), &self.scales);
        let scaled = |column: &mut [f64]| {
            for (numbers, scale) in column.chunks_exact_mut(block).zip(scales).filter(|(_, scale)| **scale != 1.0) {
                numbers.iter_mut().for_each(|x| *x *= scale);
            }
        };
        let work = self.a.len() as u64 / 3;
        let mut parts: Vec<&mut [f64]> = self.a.chunks_mut((PART * rows).max(1)).collect();
        threads::share_items(&mut parts, work, |part| part.chunks_exact_mut(rows).for_each(scaled));
        scaled(self.b.as_mut_slice());
    }

    /// Random vectors, and modes.
    fn probes(&self, stiffness: &DMatrix<f64>, [count, modes]: [usize; 2]) -> Vec<DVector<f64>> {
        let n = self.all.n();
        let mut random = Random::new();
        let scale = (1.0 / n as f64).sqrt();
        let mut probes: Vec<DVector<f64>> = (0..count)
            .map(|_| DVector::from_fn(n, |_, _| scale * random.next()))
            .map(|probe| self.transposed(probe))
            .collect();
        probes.extend((0..modes).map(|k| {
            let amplitude = MODE / stiffness[(k, k)].sqrt();
            DVector::from_fn(n, |i, _| if i == k { amplitude } else { 0.0 })
        }));
        probes
    }

    /// L⁻ᵀx.
    fn transposed(&self, mut x: DVector<f64>) -> DVector<f64> {
        let n = x.len();
        let column = MatMut::from_column_major_slice_mut(x.as_mut_slice(), n, 1);
        solve_upper_triangular_in_place(self.lower.transpose(), column, Par::Seq);
        x
    }

    /// Fills the blocks from the `first` on with the forces of rest stiffness on the probes, by differences.
    fn add_stressed_probes(&mut self, probes: &[DVector<f64>], first: usize) {
        let all = self.all;
        let [mut above, mut below] = [all.scratch(), all.scratch()];
        for (p, probe) in probes.iter().enumerate() {
            let step = all.length(STEP) / all.reach(probe.as_slice()).max(f64::MIN_POSITIVE);
            let plus = all.forces((step * probe).as_slice(), &mut above);
            let minus = all.forces((-step * probe).as_slice(), &mut below);
            self.add(first + p, |e, out| {
                let strained = plus.of(e, out);
                let relieved = less(&minus, e, out);
                out.iter_mut().for_each(|out| *out /= 2.0 * step);
                (strained - relieved) / (2.0 * step)
            });
        }
    }

    /// Fills the blocks from the `first` on with the forces of rest stiffness on the probes.
    fn add_probes(&mut self, shell: &Shell, probes: &[DVector<f64>], first: usize) {
        let (all, n) = (self.all, self.all.n());
        let mut rest_rows = Vec::with_capacity(n * all.n_elements());
        all.visit_rest_rows(shell, |_, row| rest_rows.extend_from_slice(row));
        let rest_rows: Vec<&[f64]> = rest_rows.chunks_exact(n).collect();
        let work = PLACED * (probes.len() * all.n_elements()) as u64;
        let strained = threads::map(probes, work, |probe| {
            let dot = |row: &&[f64]| row.iter().zip(probe.iter()).map(|(a, b)| a * b).sum();
            let strain: Vec<f64> = rest_rows.iter().map(dot).collect();
            (all.stress_of(&strain), strain)
        });
        for (p, (stress, strain)) in strained.iter().enumerate() {
            self.add(first + p, |e, out| {
                out.iter_mut().zip(rest_rows[e]).for_each(|(out, x)| *out = stress[e] * x);
                strain[e]
            });
        }
    }
}

/// Takes the force of an element from `force`; its strain.
fn less(forces: &Forces, element: usize, force: &mut [f64]) -> f64 {
    let mut own = vec![0.0; force.len()];
    let strain = forces.of(element, &mut own);
    force.iter_mut().zip(&own).for_each(|(force, own)| *force -= own);
    strain
}

/// Reproducible numbers in (−1, 1).
pub(super) struct Random(u64);

impl Random {
    /// From the start.
    pub fn new() -> Self {
        Self(1)
    }

    /// The next one.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Bᵀv of a field of forces.
pub fn project(fields: &[Vec<Vec3>], forces: &[Vec3]) -> Vec<f64> {
    fields.iter().map(|b| b.iter().zip(forces).map(|(b, f)| b.dot(f)).sum()).collect()
}

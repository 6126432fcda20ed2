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

mod even;
mod nonnegative;

use super::Assumed;
use super::effort::Effort;
use super::elastic::Scratch;
use super::energy::{Forces, ReducedEnergy};
use crate::energy::Curvature;
use crate::{Error, ErrorKind, Result, Shell, Vec3, threads};
pub(super) use even::even_choice;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, MatRef, Par};
use nalgebra::{Cholesky, DMatrix, DVector};
use nonnegative::nonnegative;
use std::ops::Range;

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

/// What samples stand for.
pub struct Whole {
    /// On all elements.
    pub energy: ReducedEnergy,
    /// At rest.
    pub stiffness: DMatrix<f64>,
    /// ∂(Sᵀε)/∂q at rest (stresses × stride).
    pub coupling: Vec<f64>,
}

impl Whole {
    /// Of the shell on the fields.
    pub fn new(shell: &Shell, columns: &[Vec<Vec3>], assumed: &Assumed) -> Self {
        let weights = vec![1.0; shell.energy.n_elements()];
        let mut energy = ReducedEnergy::new(shell, columns, &weights);
        assumed.set(&mut energy, &weights, |e| e);
        let (mut scratch, mut stiffness) = (energy.scratch(), DMatrix::zeros(energy.n(), energy.n()));
        energy.hessian(&vec![0.0; energy.n()], Curvature::Exact, &mut scratch, &mut stiffness);
        let coupling = energy.coupling(&mut scratch);
        Self { energy, stiffness, coupling }
    }
}

/// Weights of all elements (in the order of the rest rows), at most `wanted` of them not 0, and what they leave, relative. They reproduce the forces
/// of the whole at `poses` and its rest stiffness as well as can be, or to `tolerance`. The first `modes` fields are modes and what the weight does
/// to first order.
pub fn sample(
    (shell, whole, modes): (&Shell, &Whole, usize),
    (poses, effort): (&[Vec<f64>], &Effort),
    (wanted, tolerance): (usize, f64),
    watch: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<(Vec<f64>, f64)> {
    let Whole { energy: all, stiffness, .. } = whole;
    let n_elements = all.n_elements() - all.n_yielding();
    let singular = || Error::new(ErrorKind::Numerical, "the reduced rest stiffness is not positive definite");
    let lower = Cholesky::new(stiffness.clone()).ok_or_else(singular)?.l();
    let blocks = poses.len() + effort.probes + modes;
    let rows = (all.n() + all.n_stresses()) * blocks;
    let picked = even_choice(n_elements, effort.entries / rows);
    let mut column = vec![usize::MAX; all.n_elements()];
    picked.iter().enumerate().for_each(|(c, &e)| column[e] = c);
    let lower = Mat::from_fn(all.n(), all.n(), |i, j| lower[(i, j)]);
    let (a, b, scales) = (vec![0.0f32; rows * picked.len()], DVector::zeros(rows), vec![1.0; blocks]);
    let by_totals = effort.by_totals && !all.is_stressed() && all.n_yielding() == 0;
    let mut system = System { whole, all, n_elements, by_totals, lower, column, a, b, scales };
    system.add_poses(poses);
    let probes = system.probes(stiffness, [effort.probes, modes]);
    match all.is_stressed() {
        true => system.add_stressed_probes(&probes, poses.len()),
        false => system.add_probes(shell, &probes, poses.len()),
    }
    // Every pose, random vector and mode alike.
    let heavy = system.block() * (poses.len() + effort.probes);
    let left = |residual: &DVector<f64>| {
        let (own, modes) = (residual.rows(0, heavy), residual.rows(heavy, rows - heavy));
        (own.norm_squared() + modes.norm_squared() / (MODE * MODE)).sqrt()
    };
    let size = left(&system.b).max(f64::MIN_POSITIVE);
    let a = MatRef::from_column_major_slice(&system.a, rows, picked.len());
    let mut told = 0.0f64;
    let (solution, residual) = nonnegative(a, &system.b, wanted, |residual, share| {
        told = told.max(share); // columns are thrown out, too
        watch(told)?;
        Ok(left(residual) <= tolerance * size)
    })?;
    let mut weights = vec![0.0; n_elements];
    weights.resize(all.n_elements(), 1.0);
    picked.iter().zip(&solution).for_each(|(&e, w)| weights[e] = *w);
    shell.energy.even(&mut weights);
    Ok((weights, left(&residual) / size))
}

/// Ax = b, whose rows are in blocks of L⁻¹ forces and then strains along the stress fields.
struct System<'a> {
    whole: &'a Whole,
    all: &'a ReducedEnergy,
    /// Those that samples stand for, the first.
    n_elements: usize,
    /// b is made of the whole's forces at once, and no element without a column is looked at; else of the sum over all elements.
    by_totals: bool,
    /// L.
    lower: Mat<f64>,
    /// Of each element in A, if any.
    column: Vec<usize>,
    /// Columns of A, one behind the other: in 32 bits, as it is large and weights are fitted to a thousandth at best.
    a: Vec<f32>,
    b: DVector<f64>,
    /// What each block is multiplied by.
    scales: Vec<f64>,
}

/// Of some elements one block of their columns of A, and what they add to that of b.
struct Part<'a> {
    block: usize,
    elements: Range<usize>,
    columns: MatMut<'a, f32>,
    sum: Vec<f64>,
}

impl System<'_> {
    fn block(&self) -> usize {
        self.all.n() + self.all.n_stresses()
    }

    /// Fills some blocks with the elements' forces, which `force` writes (n, and zeros up to the stride), and strains, which it gives back; of `totals`, one
    /// for each block, where b is made of those.
    fn add(
        &mut self,
        blocks: Range<usize>,
        force: impl Fn(usize, usize, &mut [f64]) -> f64 + Sync,
        totals: &[Vec<f64>],
    ) {
        let (all, n, block, rows, by_totals) = (self.all, self.all.n(), self.block(), self.b.len(), self.by_totals);
        let Self { lower, column, n_elements, scales, .. } = self;
        let (lower, column, scales): (&Mat<f64>, &[usize], &[f64]) = (lower, column, scales);
        let (mut parts, picked) = (vec![], self.a.len() / rows.max(1));
        let all_blocks = MatMut::from_column_major_slice_mut(&mut self.a, rows, picked);
        let mut rest = all_blocks.subrows_mut(blocks.start * block, blocks.len() * block);
        for first in (0..*n_elements).step_by(PART) {
            let elements = first..(first + PART).min(*n_elements);
            let count = column[elements.clone()].iter().filter(|column| **column != usize::MAX).count();
            let (mut columns, others) = rest.split_at_col_mut(count);
            rest = others;
            for k in blocks.clone() {
                let (own, below) = columns.split_at_row_mut(block);
                columns = below;
                parts.push(Part { block: k, elements: elements.clone(), columns: own, sum: vec![0.0; block] });
            }
        }
        let looked_at = if by_totals { picked } else { *n_elements };
        threads::share_items(&mut parts, FORCE * (looked_at * blocks.len()) as u64, |part| {
            let (mut row, mut own) = (vec![0.0; all.stride()], vec![0.0; block]);
            let mut made = Vec::with_capacity(part.columns.ncols() * block);
            for e in part.elements.clone().filter(|e| !by_totals || column[*e] != usize::MAX) {
                let strain = force(part.block, e, &mut row);
                own[..n].copy_from_slice(&row[..n]);
                let along = if e < all.n_membrane() { all.stress_row(e) } else { &[] };
                own[n..].fill(0.0);
                own[n..].iter_mut().zip(along).for_each(|(out, s)| *out = s * strain);
                part.sum.iter_mut().zip(&own).for_each(|(sum, x)| *sum += x);
                if column[e] != usize::MAX {
                    made.extend_from_slice(&own);
                }
            }
            let columns = MatMut::from_column_major_slice_mut(&mut made, block, part.columns.ncols());
            solve_lower_triangular_in_place(lower.as_ref(), columns.subrows_mut(0, n), Par::Seq);
            for (column, own) in part.columns.as_mut().col_iter_mut().zip(made.chunks_exact(block)) {
                let Some(out) = column.try_as_col_major_mut() else { return };
                out.as_slice_mut().iter_mut().zip(own).for_each(|(out, x)| *out = (scales[part.block] * x) as f32);
            }
        });
        let totals = totals.iter().zip(blocks.clone()).map(|(total, k)| (k, total));
        let sums = parts.iter().filter(|_| !by_totals).map(|part| (part.block, &part.sum));
        for (k, sum) in sums.chain(totals) {
            let own = &mut self.b.as_mut_slice()[k * block..][..block];
            own.iter_mut().zip(sum).for_each(|(sum, x)| *sum += x);
        }
        for (k, own) in self.b.as_mut_slice().chunks_exact_mut(block).enumerate().take(blocks.end).skip(blocks.start) {
            whiten(self.lower.as_ref(), &mut own[..n]);
            own.iter_mut().for_each(|x| *x *= self.scales[k]);
        }
    }

    /// Fills the first blocks with the forces at poses, each scaled to a total of 1. Where the shell rests under stress, by what they differ from those.
    fn add_poses(&mut self, poses: &[Vec<f64>]) {
        let (all, n) = (self.all, self.all.n());
        let mut at_rest = all.placing();
        let rest = all.is_stressed().then(|| all.forces(&vec![0.0; n], &mut at_rest));
        let of_rest = rest.as_ref().map_or(vec![], Forces::sum);
        let mut rooms: Vec<Scratch> = (0..AT_ONCE.min(poses.len())).map(|_| all.placing()).collect();
        for (c, some) in poses.chunks(AT_ONCE).enumerate() {
            let (first, lower) = (c * AT_ONCE, self.lower.as_ref());
            let mut placed: Vec<_> =
                some.iter().zip(&mut rooms).map(|(pose, scratch)| (pose, scratch, vec![], 0.0)).collect();
            let work = PLACED * (some.len() * all.n_elements()) as u64;
            threads::share_items(&mut placed, work, |(pose, scratch, total, size)| {
                *total = all.forces(pose, scratch).sum();
                total.iter_mut().zip(&of_rest).for_each(|(total, rest)| *total -= rest);
                let mut own = DVector::from_column_slice(&total[..n]);
                whiten(lower, own.as_mut_slice());
                *size = own.norm();
            });
            for (scale, (.., size)) in self.scales[first..].iter_mut().zip(&placed) {
                *scale = if *size >= f64::MIN_POSITIVE { 1.0 / *size } else { 0.0 };
            }
            let totals: Vec<Vec<f64>> = match self.by_totals {
                true => placed.iter_mut().map(|(_, _, total, _)| std::mem::take(total)).collect(),
                false => vec![],
            };
            let of_pose = |(pose, scratch, ..): (&Vec<f64>, _, _, _)| all.forces(pose, scratch); // as placed
            let forces: Vec<Forces> = placed.into_iter().map(of_pose).collect();
            let force = |k: usize, e: usize, out: &mut [f64]| {
                let strain = forces[k - first].of(e, out);
                rest.as_ref().map_or(strain, |rest| strain - less(rest, e, out))
            };
            self.add(first..first + some.len(), force, &totals);
        }
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
        let [mut above, mut below] = [all.placing(), all.placing()];
        for (p, probe) in probes.iter().enumerate() {
            let step = all.length(STEP) / all.reach(probe.as_slice()).max(f64::MIN_POSITIVE);
            let plus = all.forces((step * probe).as_slice(), &mut above);
            let minus = all.forces((-step * probe).as_slice(), &mut below);
            let force = |_, e: usize, out: &mut [f64]| {
                let strained = plus.of(e, out);
                let relieved = less(&minus, e, out);
                out.iter_mut().for_each(|out| *out /= 2.0 * step);
                (strained - relieved) / (2.0 * step)
            };
            self.add(first + p..first + p + 1, force, &[]);
        }
    }

    /// Fills the blocks from the `first` on with the forces of rest stiffness on the probes.
    fn add_probes(&mut self, shell: &Shell, probes: &[DVector<f64>], first: usize) {
        let (all, n, blocks) = (self.all, self.all.n(), first..first + probes.len());
        let dot = |row: &[f64], probe: &DVector<f64>| row.iter().zip(probe.iter()).map(|(a, b)| a * b).sum::<f64>();
        let mut rest_rows = vec![];
        if self.by_totals {
            let column = self.column.clone();
            all.visit_rest_rows(shell, |e| column[e] != usize::MAX, |row| rest_rows.extend_from_slice(row));
            let rows: Vec<&[f64]> = self.whole.coupling.chunks_exact(all.stride()).collect();
            let along = |probe| rows.iter().map(|row| dot(row, probe)).collect();
            let along: Vec<Vec<f64>> = probes.iter().map(along).collect();
            let forces = probes.iter().map(|probe| &self.whole.stiffness * probe);
            let totals =
                forces.zip(&along).map(|(force, along)| [force.as_slice(), along].concat()).collect::<Vec<_>>();
            let force = |k: usize, e: usize, out: &mut [f64]| {
                let row = &rest_rows[column[e] * n..][..n];
                let strain = dot(row, &probes[k - first]);
                let stress = all.stress_along(e, strain, &along[k - first]);
                out.iter_mut().zip(row).for_each(|(out, x)| *out = stress * x);
                strain
            };
            return self.add(blocks, force, &totals);
        }
        rest_rows.reserve(n * all.n_elements());
        all.visit_rest_rows(shell, |_| true, |row| rest_rows.extend_from_slice(row));
        let rest_rows: Vec<&[f64]> = rest_rows.chunks_exact(n).collect();
        let work = PLACED * (probes.len() * all.n_elements()) as u64;
        let strained = threads::map(probes, work, |probe| {
            let strain: Vec<f64> = rest_rows.iter().map(|row| dot(row, probe)).collect();
            (all.stress_of(&strain), strain)
        });
        let force = |k: usize, e: usize, out: &mut [f64]| {
            let (stress, strain) = &strained[k - first];
            out.iter_mut().zip(rest_rows[e]).for_each(|(out, x)| *out = stress[e] * x);
            strain[e]
        };
        self.add(blocks, force, &[]);
    }
}

/// f ← L⁻¹f.
fn whiten(lower: MatRef<'_, f64>, forces: &mut [f64]) {
    let n = forces.len();
    solve_lower_triangular_in_place(lower, MatMut::from_column_major_slice_mut(forces, n, 1), Par::Seq);
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

#[cfg(test)]
mod tests {
    use super::super::effort::LOOK;
    use super::*;
    use crate::{Material, Mesh, Supports};

    /// A bumpy card that is held by a side, and some fields that its vertices move along.
    fn card() -> (Shell, Vec<Vec<Vec3>>) {
        let at = |i: usize, j: usize| (0.1 * i as f64, 0.1 * j as f64 + 0.003 * (i * i) as f64);
        let places: Vec<(f64, f64)> = (0..8).flat_map(|i| (0..6).map(move |j| at(i, j))).collect();
        let positions = places.iter().map(|(x, y)| Vec3::new(*x, *y, 0.1 * x * y - 0.05 * y * y)).collect();
        let corners = (0..7u32).flat_map(|i| (0..5u32).map(move |j| 6 * i + j));
        let triangles: Vec<[u32; 3]> = corners.flat_map(|v| [[v, v + 6, v + 7], [v, v + 7, v + 1]]).collect();
        let material = Material { k_area: 1e3, k_length: 1e3, k_bend: 1.0, area_density: 1.0 };
        let supports = Supports { fixed: (0..6).collect(), ..Default::default() };
        let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap();
        let field = |k: i32| places.iter().map(|(x, y)| Vec3::new(y * x * x, x.powi(k), x * (x + y).powi(k))).collect();
        (shell, (1..6).map(field).collect())
    }

    /// What elements that no sample is chosen among add to the forces is told by the whole: by other sums, to rounding.
    #[test]
    fn samples_stand_for_all_elements_by_whichever_sums() {
        let (shell, columns) = card();
        let n = shell.energy.n_membrane();
        let stresses = DMatrix::from_fn(3, n, |k, e| libm::cos((k * e) as f64) / (n as f64).sqrt());
        let whole = Whole::new(&shell, &columns, &Assumed { stresses, membrane_share: 0.1 });
        let poses: Vec<Vec<f64>> =
            (0..4).map(|p| (0..5).map(|k| 0.2 * libm::sin(1.0 + (5 * p + k) as f64)).collect()).collect();
        let chosen = |by_totals: bool, entries: usize| {
            let effort = Effort { by_totals, entries, ..LOOK };
            sample((&shell, &whole, 2), (&poses, &effort), (24, 0.0), &mut |_| Ok(())).unwrap()
        };
        for entries in [usize::MAX, 13 * (4 + 6 + 2) * 100] {
            let [(weights, left), (by_sums, left_by_sums)] = [true, false].map(|by_totals| chosen(by_totals, entries));
            assert!(left < 0.2 && (left - left_by_sums).abs() < 1e-9, "{left} {left_by_sums}");
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 * (1.0 + a); // a condition of 1e3, squared
            assert!(weights.iter().zip(&by_sums).all(near), "{weights:?} {by_sums:?}");
            let sum: f64 = weights.iter().sum();
            assert!(weights.iter().filter(|w| **w > 0.0).count() <= 24 && sum > 24.0, "{sum}");
        }
    }
}

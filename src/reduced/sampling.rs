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

use super::energy::ReducedEnergy;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::linalg::solvers::Solve;
use faer::{Col, ColRef, Mat, Side};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::cmp::Ordering;

/// Entries of the system at most: of the elements of a large mesh, an even choice is looked at. All of them have an exact solution, the
/// weights 1; two thirds of the hat's 8,920 leave 15 % at least.
const ENTRIES: usize = 80_000_000;
/// Random vectors that the rest stiffness is tried on.
const PROBES: usize = 12;
/// How much more the rest stiffness of a mode, or of what the weight does to first order, counts than a pose.
const MODE: f64 = 5.0;
/// Elements whose forces are smaller than this part of the mean are left out: those of elements that are held all around are rounding,
/// which a weight makes into noise that no search gets through.
const LEAST_FORCE: f64 = 1e-3;
/// Elements taken up at once, as a part of those wanted.
const BATCH: f64 = 0.03;
/// Of the shell's width, how far differences move it: their error is about the square of what that turns, rounding 1e-16 over it.
const STEP: f64 = 1e-6;

/// Of an element, Bᵀ∇E_e and its strain.
type Forced = (DVector<f64>, f64);

/// Of every element of `all` at `q`.
fn forces_at(all: &ReducedEnergy, q: &[f64]) -> Vec<Forced> {
    let mut forces = Vec::with_capacity(all.n_elements());
    all.visit_forces(q, &mut all.scratch(), |_, force, strain| {
        forces.push((DVector::from_column_slice(force), strain));
    });
    forces
}

/// Weights of all elements (in the order of the rest rows), at most `wanted` of them not 0, that reproduce the forces of `all` at
/// `poses` and its rest stiffness as well as can be, or to `tolerance`; and what they leave of these, relative. `stiffness` is that at
/// rest; the first `modes` fields are modes and what the weight does to first order.
pub fn sample(
    shell: &Shell,
    all: &ReducedEnergy,
    (stiffness, modes): (&DMatrix<f64>, usize),
    (poses, wanted, tolerance): (&[Vec<f64>], usize, f64),
    watch: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<(Vec<f64>, f64)> {
    let n_elements = all.n_elements() - all.n_yielding();
    let singular = || Error::new(ErrorKind::Numerical, "the reduced rest stiffness is not positive definite");
    let lower = Cholesky::new(stiffness.clone()).ok_or_else(singular)?.l();
    let rows = (all.n() + all.n_stresses()) * (poses.len() + PROBES + modes);
    let candidates = n_elements.min(ENTRIES / rows);
    let picked: Vec<usize> = (0..candidates).map(|k| k * n_elements / candidates).collect();
    let mut column = vec![usize::MAX; all.n_elements()];
    picked.iter().enumerate().for_each(|(c, &e)| column[e] = c);
    let (a, b) = (Mat::zeros(rows, picked.len()), DVector::zeros(rows));
    let rest = if all.is_stressed() { forces_at(all, &vec![0.0; all.n()]) } else { vec![] };
    let mut system = System { all, n_elements, rest, lower, column, a, b };
    poses.iter().enumerate().for_each(|(k, pose)| system.add_pose(k, pose));
    let probes = system.probes(stiffness, modes);
    match all.is_stressed() {
        true => system.add_stressed_probes(&probes, poses.len()),
        false => system.add_probes(shell, &probes, poses.len()),
    }
    // Every pose, random vector and mode alike.
    let heavy = system.block() * (poses.len() + PROBES);
    let left = |residual: &DVector<f64>| {
        let (own, modes) = (residual.rows(0, heavy), residual.rows(heavy, rows - heavy));
        (own.norm_squared() + modes.norm_squared() / (MODE * MODE)).sqrt()
    };
    let whole = left(&system.b).max(f64::MIN_POSITIVE);
    let (solution, residual) = nonnegative(&system.a, &system.b, wanted, |residual, share| {
        watch(share)?;
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
    /// Force and strain of each element where the shell rests under stress, else none.
    rest: Vec<Forced>,
    lower: DMatrix<f64>,
    /// Of each element in A, if any.
    column: Vec<usize>,
    a: Mat<f64>,
    b: DVector<f64>,
}

impl System<'_> {
    fn block(&self) -> usize {
        self.all.n() + self.all.n_stresses()
    }

    /// Puts numbers of element `e` in A from `row` on.
    fn put(&mut self, row: usize, e: usize, numbers: impl Iterator<Item = f64>) {
        let column = self.column[e];
        if column != usize::MAX {
            numbers.enumerate().for_each(|(k, x)| self.a[(row + k, column)] = x);
        }
    }

    /// Adds S_e ε_e from `row` on.
    fn add_along(&mut self, row: usize, e: usize, strain: f64) {
        let all = self.all;
        if e < all.n_membrane() {
            all.stress_row(e).iter().enumerate().for_each(|(k, s)| self.b[row + k] += s * strain);
            self.put(row, e, all.stress_row(e).iter().map(|s| s * strain));
        }
    }

    /// Fills the `k`-th block with the forces at a pose, scaled to a total of 1.
    fn add_pose(&mut self, k: usize, pose: &[f64]) {
        let (all, n, block) = (self.all, self.all.n(), self.block());
        let first = k * block;
        let mut sum = DVector::<f64>::zeros(n);
        all.visit_forces(pose, &mut all.scratch(), |e, force, strain| {
            if e >= self.n_elements {
                return;
            }
            let mut force = DVector::from_column_slice(force);
            let mut strain = strain;
            if let Some((rest, at_rest)) = self.rest.get(e) {
                force -= rest;
                strain -= at_rest;
            }
            sum += &force;
            self.add_along(first + n, e, strain);
            if self.column[e] != usize::MAX {
                let white = self.lower.solve_lower_triangular(&force).unwrap_or_default();
                self.put(first, e, white.iter().copied());
            }
        });
        let white = self.lower.solve_lower_triangular(&sum).unwrap_or_default();
        let scale = 1.0 / white.norm().max(f64::MIN_POSITIVE);
        self.b.rows_mut(first, n).copy_from(&white);
        self.b.rows_mut(first, block).scale_mut(scale);
        for c in 0..self.a.ncols() {
            (first..first + block).for_each(|row| self.a[(row, c)] *= scale);
        }
    }

    /// Random vectors, and modes.
    fn probes(&self, stiffness: &DMatrix<f64>, modes: usize) -> Vec<DVector<f64>> {
        let n = self.all.n();
        let mut random = Random::new();
        let scale = (1.0 / n as f64).sqrt();
        let mut probes: Vec<DVector<f64>> = (0..PROBES)
            .map(|_| DVector::from_fn(n, |_, _| scale * random.next()))
            .map(|probe| self.lower.tr_solve_lower_triangular(&probe).unwrap_or_default())
            .collect();
        probes.extend((0..modes).map(|k| {
            let amplitude = MODE / stiffness[(k, k)].sqrt();
            DVector::from_fn(n, |i, _| if i == k { amplitude } else { 0.0 })
        }));
        probes
    }

    /// Fills the blocks from the `first` on with the forces of rest stiffness on the probes, by differences.
    fn add_stressed_probes(&mut self, probes: &[DVector<f64>], first: usize) {
        let (all, n, block) = (self.all, self.all.n(), self.block());
        for (p, probe) in probes.iter().enumerate() {
            let row = (first + p) * block;
            let step = all.length(STEP) / all.reach(probe.as_slice()).max(f64::MIN_POSITIVE);
            let [plus, minus] = [step, -step].map(|step| forces_at(all, (step * probe).as_slice()));
            for (e, ((plus, strained), (minus, relieved))) in
                plus.into_iter().zip(minus).enumerate().take(self.n_elements)
            {
                let force = (plus - minus) / (2.0 * step);
                let white = self.lower.solve_lower_triangular(&force).unwrap_or_default();
                (0..n).for_each(|k| self.b[row + k] += white[k]);
                self.put(row, e, white.iter().copied());
                self.add_along(row + n, e, (strained - relieved) / (2.0 * step));
            }
        }
    }

    /// Fills the blocks from the `first` on with the forces of rest stiffness on the probes.
    fn add_probes(&mut self, shell: &Shell, probes: &[DVector<f64>], first: usize) {
        let (all, n, block) = (self.all, self.all.n(), self.block());
        let mut strains = vec![vec![0.0; all.n_elements()]; probes.len()];
        all.visit_rest_rows(shell, |e, row| {
            let row = DVector::from_column_slice(row);
            strains.iter_mut().zip(probes).for_each(|(strain, probe)| strain[e] = row.dot(probe));
        });
        let stresses: Vec<Vec<f64>> = strains.iter().map(|strain| all.stress_of(strain)).collect();
        all.visit_rest_rows(shell, |e, row| {
            if e >= self.n_elements {
                return;
            }
            let white = self.lower.solve_lower_triangular(&DVector::from_column_slice(row)).unwrap_or_default();
            for (p, (stress, strain)) in stresses.iter().zip(&strains).enumerate() {
                let row = (first + p) * block;
                (0..n).for_each(|k| self.b[row + k] += stress[e] * white[k]);
                self.put(row, e, white.iter().map(|white| stress[e] * white));
                self.add_along(row + n, e, strain[e]);
            }
        });
    }
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

/// min |Ax − b| over x ≥ 0 with at most `wanted` nonzero entries, or until `suffices` of the residual b − Ax and the share of the work
/// done; returns x and the residual.
fn nonnegative(
    a: &Mat<f64>,
    b: &DVector<f64>,
    wanted: usize,
    mut suffices: impl FnMut(&DVector<f64>, f64) -> Result<bool>,
) -> Result<(Vec<f64>, DVector<f64>)> {
    let mut set = ActiveSet::new(a, b);
    let mut residual = b.clone();
    let batch = ((BATCH * wanted as f64) as usize).max(1);
    while !suffices(&residual, set.active.len() as f64 / wanted as f64)? && set.active.len() < wanted {
        let best = set.best(&residual, 1e-12 * b.norm(), batch.min(wanted - set.active.len()));
        if best.is_empty() {
            break;
        }
        set.add(&best);
        set.solve();
        let before = residual.norm();
        residual = set.residual(b);
        if residual.norm() > before * (1.0 - 1e-9) {
            best.iter().for_each(|&j| set.barred[j] = true); // thrown out as soon as taken in
        }
    }
    Ok((set.x, residual))
}

/// x ≥ 0, and the columns along which it may be positive.
struct ActiveSet<'a> {
    a: &'a Mat<f64>,
    norms: Vec<f64>,
    /// Aᵀb.
    right: Col<f64>,
    x: Vec<f64>,
    active: Vec<usize>,
    /// Of the active columns.
    gram: Mat<f64>,
    /// Columns that are never taken in.
    barred: Vec<bool>,
}

impl<'a> ActiveSet<'a> {
    /// None active.
    fn new(a: &'a Mat<f64>, b: &DVector<f64>) -> Self {
        let n = a.ncols();
        let norms: Vec<f64> = (0..n).map(|j| a.col(j).norm_l2()).collect();
        let least = LEAST_FORCE * norms.iter().sum::<f64>() / n as f64;
        let barred = norms.iter().map(|norm| *norm <= least).collect();
        let right = a.transpose() * ColRef::from_slice(b.as_slice());
        Self { a, norms, right, x: vec![0.0; n], active: vec![], gram: Mat::zeros(0, 0), barred }
    }

    /// Columns along which the residual falls fastest, by more than `least`, at most so many.
    fn best(&self, residual: &DVector<f64>, least: f64, most: usize) -> Vec<usize> {
        let slopes = self.a.transpose() * ColRef::from_slice(residual.as_slice());
        let mut gains: Vec<(f64, usize)> = (0..self.x.len())
            .filter(|&j| self.x[j] == 0.0 && !self.barred[j])
            .map(|j| (slopes[j] / self.norms[j], j))
            .filter(|(gain, _)| *gain > least)
            .collect();
        gains.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)));
        gains.into_iter().take(most).map(|(_, j)| j).collect()
    }

    fn columns(&self, list: &[usize]) -> Mat<f64> {
        let mut taken = Mat::zeros(self.a.nrows(), list.len());
        list.iter().enumerate().for_each(|(k, &j)| taken.col_mut(k).copy_from(self.a.col(j)));
        taken
    }

    /// Takes columns in.
    fn add(&mut self, list: &[usize]) {
        let old = self.active.len();
        self.active.extend(list);
        let count = self.active.len();
        let products = self.columns(&self.active).transpose() * self.columns(list);
        self.gram.resize_with(count, count, |i, k| match i.cmp(&k) {
            Ordering::Equal => products[(i, i - old)] * (1.0 + 1e-12),
            Ordering::Greater => products[(k, i - old)],
            Ordering::Less => products[(i, k - old)],
        });
    }

    /// Moves x to the least squares over the active columns; columns whose entry reaches 0 on the way are thrown out.
    fn solve(&mut self) {
        while let Ok(factor) = self.gram.llt(Side::Lower) {
            let z = factor.solve(Col::from_fn(self.active.len(), |i| self.right[self.active[i]]));
            if z.iter().all(|z| *z > 0.0) {
                self.active.iter().zip(z.iter()).for_each(|(&j, z)| self.x[j] = *z);
                return;
            }
            self.approach(&z);
        }
    }

    /// Moves x towards `z` as far as it stays nonnegative, and throws out columns whose entry is 0 there.
    fn approach(&mut self, z: &Col<f64>) {
        let Self { norms, x, active, gram, .. } = self;
        let mut alpha = 1.0f64;
        for (i, &j) in active.iter().enumerate().filter(|(i, _)| z[*i] <= 0.0) {
            alpha = alpha.min(x[j] / (x[j] - z[i]));
        }
        active.iter().zip(z.iter()).for_each(|(&j, z)| x[j] += alpha * (z - x[j]));
        let largest = active.iter().map(|&j| x[j] * norms[j]).fold(0.0, f64::max);
        let stays = |i: &usize| !(z[*i] <= 0.0 && x[active[*i]] * norms[active[*i]] <= 1e-12 * largest);
        let (left, out): (Vec<usize>, Vec<usize>) = (0..active.len()).partition(stays);
        out.iter().for_each(|&i| x[active[i]] = 0.0);
        *gram = Mat::from_fn(left.len(), left.len(), |i, j| gram[(left[i], left[j])]);
        *active = left.iter().map(|&i| active[i]).collect();
    }

    /// b − Ax.
    fn residual(&self, b: &DVector<f64>) -> DVector<f64> {
        let taken = self.columns(&self.active) * Col::from_fn(self.active.len(), |k| self.x[self.active[k]]);
        DVector::from_fn(b.len(), |i, _| b[i] - taken[i])
    }
}

/// Bᵀv of a field of forces.
pub fn project(fields: &[Vec<Vec3>], forces: &[Vec3]) -> Vec<f64> {
    fields.iter().map(|b| b.iter().zip(forces).map(|(b, f)| b.dot(f)).sum()).collect()
}

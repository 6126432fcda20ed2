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

use super::energy::ReducedEnergy;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{Cholesky, DMatrix, DVector};
use nonnegative::nonnegative;

/// Entries of the system at most: of the elements of a large mesh, an even choice is looked at. All of them have an exact solution, the
/// weights 1; two thirds of the hat's 8,920 leave 15 % at least.
const ENTRIES: usize = 80_000_000;
/// Random vectors that the rest stiffness is tried on.
const PROBES: usize = 12;
/// How much more the rest stiffness of a mode, or of what the weight does to first order, counts than a pose.
const MODE: f64 = 5.0;
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

/// Bᵀv of a field of forces.
pub fn project(fields: &[Vec<Vec3>], forces: &[Vec3]) -> Vec<f64> {
    fields.iter().map(|b| b.iter().zip(forces).map(|(b, f)| b.dot(f)).sum()).collect()
}

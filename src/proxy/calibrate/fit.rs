//! Factors by which a shell's answers are those of a finer one: Gauss–Newton, held back toward 1.

use super::{Answers, Calibration, Load, Patches, Sources, Static, loose};
use crate::material::Factors;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{DMatrix, DVector};

/// The largest factor, and one over the least.
pub const LARGEST: f64 = 4.0;
/// What a mean square of logarithms of factors costs, in squares of relative differences: what loads do not tell stays near 1.
const HELD_BACK: f64 = 1e-3;
/// A relative difference from which a load counts half.
const FAR: f64 = 0.2;
const ROUNDS: usize = 6;
/// Steps of one round that are tried, each held back ten times as much as the one before.
const TRIES: usize = 4;
/// A round that gains less ends the search.
const GAIN: f64 = 1e-3;
/// The longest step of a logarithm.
const STEP: f64 = 1.0;

/// What is fitted, and to what.
pub struct Fit<'a> {
    /// As it was given.
    given: &'a Shell,
    /// The same with the finer one's masses.
    weighed: &'a Shell,
    patches: &'a Patches,
    loads: Vec<Load>,
    /// The finer one's answers at its vertices, and one over their length.
    targets: Vec<(Vec<Vec3>, f64)>,
    /// What each load counts, of sum 1.
    weights: Vec<f64>,
}

/// A shell of factors exp θ, and its answers.
struct Trial {
    theta: Vec<f64>,
    shell: Shell,
    answers: Vec<Vec<Vec3>>,
    /// Mean square of relative differences by weight, with what factors cost.
    cost: f64,
}

/// A rest row with the patches' shares in it.
struct Row {
    vertices: Vec<u32>,
    row: Vec<Vec3>,
    shares: Vec<(u32, f64)>,
}

impl<'a> Fit<'a> {
    pub fn new(
        given: &'a Shell,
        weighed: &'a Shell,
        patches: &'a Patches,
        answers: &Answers,
        [sources, onto]: [&Sources; 2],
    ) -> Result<Self> {
        let mut fit = Self { given, weighed, patches, loads: vec![], targets: vec![], weights: vec![] };
        for (load, u) in &answers.of {
            let target = sources.sampled(u);
            let length = fit.length(&target);
            if length > 0.0 && length.is_finite() {
                fit.loads.push(match load {
                    Load::Gravity(g) => Load::Gravity(*g),
                    Load::Forces(forces) => Load::Forces(onto.gathered(forces, given.mass.len())),
                });
                fit.targets.push((target, 1.0 / length));
            }
        }
        match fit.loads.is_empty() {
            true => Err(Error::argument("the finer shell does not move where the shell does")),
            false => Ok(fit),
        }
    }

    /// By mass, over the vertices that move.
    fn length(&self, u: &[Vec3]) -> f64 {
        let mass = &self.weighed.mass;
        self.weighed.free.iter().map(|v| mass[*v as usize] * u[*v as usize].norm_squared()).sum::<f64>().sqrt()
    }

    /// Stretching first, then bending.
    fn factors(&self, theta: &[f64]) -> Vec<Factors> {
        let (stretching, bending) = theta.split_at(self.patches.len());
        let of = |t: &[u32; 3]| {
            let [stretching, bending] = [stretching, bending].map(|part| libm::exp(self.patches.on(t, part)));
            Factors { stretching, bending, mass: 1.0 }
        };
        self.weighed.mesh.triangles.iter().map(of).collect()
    }

    /// None where the shell moves freely.
    fn trial(&self, theta: Vec<f64>) -> Result<Option<Trial>> {
        let shell = self.weighed.stiffened(&self.factors(&theta))?;
        let forces: Vec<Vec<Vec3>> = self.loads.iter().map(|load| load.on(self.weighed)).collect();
        let Some(solver) = Static::new(&shell)? else { return Ok(None) };
        let answers = solver.solve(&forces)?;
        let factors = HELD_BACK * theta.iter().map(|t| t * t).sum::<f64>() / self.patches.len() as f64;
        let cost = self.squares(&answers).iter().zip(&self.weights).map(|(e, w)| w * e).sum::<f64>() + factors;
        Ok(cost.is_finite().then_some(Trial { theta, shell, answers, cost }))
    }

    /// Of relative differences, by load.
    fn squares(&self, answers: &[Vec<Vec3>]) -> Vec<f64> {
        let of = |(u, (target, scale)): (&Vec<Vec3>, &(Vec<Vec3>, f64))| {
            let off: Vec<Vec3> = u.iter().zip(target).map(|(u, target)| u - target).collect();
            (scale * self.length(&off)).powi(2)
        };
        answers.iter().zip(&self.targets).map(of).collect()
    }

    /// The root mean square under gravity.
    fn difference(&self, squares: &[f64]) -> f64 {
        let is_gravity = |load: &Load| matches!(load, Load::Gravity(_));
        let of: Vec<f64> = self.loads.iter().zip(squares).filter(|(l, _)| is_gravity(l)).map(|(_, e)| *e).collect();
        (of.iter().sum::<f64>() / of.len().max(1) as f64).sqrt()
    }

    /// Gravity counts fully. Other loads count less where the coarse mesh cannot answer as the fine one does, as it lacks the vertices.
    fn weigh(&mut self, squares: &[f64]) {
        let weight = |(load, square): (&Load, &f64)| match load {
            Load::Gravity(_) => 1.0,
            Load::Forces(_) => 1.0 / (1.0 + square / (FAR * FAR)),
        };
        let weights: Vec<f64> = self.loads.iter().zip(squares).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        self.weights = weights.iter().map(|w| w / sum).collect();
    }

    /// Squares of differences as it was given, under its own mass.
    fn before(&self) -> Result<Vec<f64>> {
        let forces: Vec<Vec<Vec3>> = self.loads.iter().map(|load| load.on(self.given)).collect();
        let solver = Static::new(self.given)?.ok_or_else(|| loose("the shell"))?;
        Ok(self.squares(&solver.solve(&forces)?))
    }

    pub fn run(&mut self, heard: &mut dyn FnMut(f64) -> Result<()>) -> Result<(Vec<Factors>, Calibration)> {
        let n = self.patches.len();
        let before = self.before()?;
        self.weigh(&before);
        let mut best = self.trial(vec![0.0; 2 * n])?.ok_or_else(|| loose("the shell"))?;
        for round in 0..ROUNDS {
            heard(round as f64 / ROUNDS as f64)?;
            let (normal, slope) = self.normal_equations(&best)?;
            let Some(next) = self.step(&best, &normal, &slope)? else { break };
            let gain = 1.0 - next.cost / best.cost;
            best = next;
            if gain < GAIN {
                break;
            }
        }
        let range = |part: &[f64]| {
            let factors = self.weighed.mesh.triangles.iter().map(|t| libm::exp(self.patches.on(t, part)));
            factors.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], x| [low.min(x), high.max(x)])
        };
        let (stretching, bending) = best.theta.split_at(n);
        let found = Calibration {
            n_patches: n,
            n_loads: self.loads.len(),
            difference: [self.difference(&before), self.difference(&self.squares(&best.answers))],
            stretching: range(stretching),
            bending: range(bending),
            ..Calibration::default()
        };
        Ok((self.factors(&best.theta), found))
    }

    /// The first of ever shorter steps that costs less.
    fn step(&self, from: &Trial, normal: &DMatrix<f64>, slope: &DVector<f64>) -> Result<Option<Trial>> {
        let (n, bound) = (self.patches.len() as f64, libm::log(LARGEST));
        let theta = DVector::from_column_slice(&from.theta);
        let mut damping = 0.0;
        for _ in 0..TRIES {
            let matrix = normal + DMatrix::identity(theta.len(), theta.len()) * ((HELD_BACK + damping) / n);
            let Some(factor) = matrix.cholesky() else {
                return Err(Error::new(ErrorKind::Numerical, "the calibration's equations are not positive definite"));
            };
            let step = factor.solve(&-(slope + HELD_BACK / n * &theta));
            let next = from.theta.iter().zip(step.iter());
            let next = next.map(|(t, step)| (t + step.clamp(-STEP, STEP)).clamp(-bound, bound)).collect();
            if let Some(trial) = self.trial(next)?.filter(|trial| trial.cost < from.cost) {
                return Ok(Some(trial));
            }
            damping = if damping == 0.0 { 10.0 * HELD_BACK } else { 10.0 * damping };
        }
        Ok(None)
    }

    /// The mean over loads, by weight, of JᵀJ and of Jᵀ times the differences. Of answers u, ∂u/∂θ = −K⁻¹ ∂K/∂θ u, row by row.
    fn normal_equations(&self, at: &Trial) -> Result<(DMatrix<f64>, DVector<f64>)> {
        let (shell, n) = (&at.shell, 2 * self.patches.len());
        let solver = Static::new(shell)?.ok_or_else(|| loose("the shell"))?;
        let rows = self.rows(shell);
        let mut index = vec![usize::MAX; shell.mass.len()];
        shell.free.iter().enumerate().for_each(|(i, v)| index[*v as usize] = 3 * i);
        let root: Vec<f64> = shell.free.iter().flat_map(|v| [shell.mass[*v as usize].sqrt(); 3]).collect();
        let (mut normal, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let mut change = Mat::<f64>::zeros(root.len(), n);
        for ((u, (target, scale)), weight) in at.answers.iter().zip(&self.targets).zip(&self.weights) {
            change.fill(0.0);
            for Row { vertices, row, shares } in &rows {
                let strain: f64 = vertices.iter().zip(row).map(|(v, b)| b.dot(&u[*v as usize])).sum();
                for (v, b) in vertices.iter().zip(row) {
                    let first = index[*v as usize];
                    if first == usize::MAX {
                        continue;
                    }
                    for (p, share) in shares {
                        (0..3).for_each(|c| change[(first + c, *p as usize)] -= share * strain * b[c]);
                    }
                }
            }
            solver.solve_in_place(&mut change)?;
            for p in 0..n {
                change.col_as_slice_mut(p).iter_mut().zip(&root).for_each(|(x, root)| *x *= root * scale);
            }
            let off = |i: usize| {
                let v = shell.free[i / 3] as usize;
                root[i] * scale * (u[v][i % 3] - target[v][i % 3])
            };
            let off: Vec<f64> = (0..root.len()).map(off).collect();
            let dot = |a: &[f64], b: &[f64]| weight * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for p in 0..n {
                let column = change.col_as_slice(p);
                slope[p] += dot(column, &off);
                for q in 0..=p {
                    let product = dot(column, change.col_as_slice(q));
                    normal[(p, q)] += product;
                    if p != q {
                        normal[(q, p)] += product;
                    }
                }
            }
        }
        Ok((normal, slope))
    }

    /// Rows of elements begin with the triangle's corners.
    fn rows(&self, shell: &Shell) -> Vec<Row> {
        let (n_membrane, n) = (shell.energy.n_membrane(), self.patches.len() as u32);
        let mut rows: Vec<Row> = vec![];
        shell.energy.visit_rest_rows(&mut |(vertices, row)| {
            let first = if rows.len() < n_membrane { 0 } else { n };
            let corners = &vertices[..vertices.len().min(3)];
            let mut shares: Vec<(u32, f64)> = vec![];
            for v in corners {
                for (i, phi) in self.patches.at(*v as usize) {
                    let (p, phi) = (first + i, phi / corners.len() as f64);
                    match shares.iter_mut().find(|(q, _)| *q == p) {
                        Some((_, share)) => *share += phi,
                        None => shares.push((p, phi)),
                    }
                }
            }
            rows.push(Row { vertices: vertices.to_vec(), row: row.to_vec(), shares });
        });
        rows
    }
}

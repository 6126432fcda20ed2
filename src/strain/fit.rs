//! A few triangles whose N stands for that of all: N_t(q) ≈ Σ_c w_tc N_c(q), with weights that do not depend on q, fitted to poses.
//!
//! Triangles are taken one after the other, each the one that those before explain worst (Gram–Schmidt with pivoting), until what is
//! left is small. Where a shell can move rigidly, Σ_c w_tc = 1 over the samples of each component, so that it does so exactly.

use super::poisson::Poisson;
use super::sample::{axial, remainder};
use crate::modal::ModalBasis;
use nalgebra::Matrix3;

/// Largest rotation of a triangle in the poses, rad: half a turn, where the guard begins.
pub const REACH: f64 = std::f64::consts::PI;

/// Poses, from hardly bent to [`REACH`].
const POSES: usize = 48;

/// What may be left of N, root mean square over triangles and poses: docs/evidence/rotation_strain.md shows what less would bring.
pub const TOLERANCE: f64 = 0.05;

/// Samples at most.
pub const MOST_SAMPLES: usize = 32;

/// Triangles among which samples are looked for, at most about.
const CANDIDATES: usize = 2000;

/// Weight of Σ_c w_tc = 1 among N's entries, which are of the order 1.
const RIGID: f64 = 1e4;

/// See the module's text.
pub struct Fit {
    /// The samples' triangles.
    pub samples: Vec<usize>,
    /// What they leave of N, relative.
    pub left: f64,
    poses: Vec<Vec<f64>>,
    /// Orthonormal columns and the triangle R with which the samples' columns are QR (samples).
    q: Vec<Vec<f64>>,
    r: Vec<Vec<f64>>,
    /// Where the shell can move rigidly, the components that have samples, in the order of their first.
    sampled: Vec<u32>,
}

impl Fit {
    /// Looks for samples that leave no more than `tolerance`.
    pub fn new(modal: &ModalBasis, poisson: &Poisson, tolerance: f64) -> Self {
        let n = poisson.faces.len();
        let candidates: Vec<usize> = (0..n).step_by(n.div_ceil(CANDIDATES)).collect();
        let gradients: Vec<_> = candidates.iter().map(|t| modal_gradients(modal, poisson, *t)).collect();
        let poses = poses(modal, &gradients);
        let mut fit = Self { samples: vec![], left: 1.0, poses, q: vec![], r: vec![], sampled: vec![] };
        let mut columns: Vec<Vec<f64>> =
            candidates.iter().zip(&gradients).map(|(t, g)| fit.column(modal, *t, g)).collect();
        let area = |i: usize| poisson.faces[candidates[i]].area;
        let norm = |column: &[f64]| column.iter().map(|x| x * x).sum::<f64>();
        let all: f64 = columns.iter().enumerate().map(|(i, column)| area(i) * norm(&column[..9 * POSES])).sum();
        let mut rest = columns.clone();
        while fit.samples.len() < MOST_SAMPLES {
            let own = |i: usize| if fit.is_apart(modal, candidates[i]) { RIGID * RIGID } else { 0.0 };
            let squares: Vec<f64> =
                rest.iter().enumerate().map(|(i, column)| area(i) * (norm(column) + own(i))).collect();
            let of_remainders = |(i, column): (usize, &Vec<f64>)| area(i) * norm(&column[..9 * POSES]);
            fit.left = (rest.iter().enumerate().map(of_remainders).sum::<f64>() / all).sqrt();
            let left = (squares.iter().sum::<f64>() / all).sqrt(); // with rigid motions that have no samples yet
            let worst = (0..squares.len()).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
            if left.is_nan() || left <= tolerance {
                break;
            }
            if fit.is_apart(modal, candidates[worst]) {
                fit.sampled.push(component(modal, candidates[worst]));
                let rigid = |i: usize| fit.rigid(modal, candidates[i]).last();
                let entries: Vec<f64> = (0..rest.len()).filter_map(rigid).collect();
                for all in [&mut rest, &mut columns] {
                    all.iter_mut().zip(&entries).for_each(|(column, entry)| column.push(*entry));
                }
            }
            let length = norm(&rest[worst]).sqrt();
            let direction: Vec<f64> = rest[worst].iter().map(|x| x / length).collect();
            for column in &mut rest {
                let along = dot(&direction, column);
                column.iter_mut().zip(&direction).for_each(|(x, d)| *x -= along * d);
            }
            fit.samples.push(candidates[worst]);
            fit.q.push(direction);
            let entries = fit.q.iter().map(|q| dot(q, &columns[worst])).collect();
            fit.r.push(entries);
        }
        fit
    }

    /// The weights of triangle `t` (samples), by least squares over the poses.
    pub fn weights(&self, modal: &ModalBasis, poisson: &Poisson, t: usize, weights: &mut [f64]) {
        let column = self.column(modal, t, &modal_gradients(modal, poisson, t));
        for (weight, q) in weights.iter_mut().zip(&self.q) {
            *weight = dot(q, &column);
        }
        for i in (0..weights.len()).rev() {
            let known: f64 = (i + 1..weights.len()).map(|j| self.r[j][i] * weights[j]).sum();
            weights[i] = (weights[i] - known) / self.r[i][i];
        }
    }

    /// N of a triangle in all poses, then, where the shell can move rigidly, which of the sampled components it belongs to.
    fn column(&self, modal: &ModalBasis, t: usize, gradients: &[Matrix3<f64>]) -> Vec<f64> {
        let mut column = Vec::with_capacity(9 * POSES + self.sampled.len());
        for q in &self.poses {
            column.extend(remainder(&combined(gradients, q)).iter());
        }
        column.extend(self.rigid(modal, t));
        column
    }

    /// Entries for the sampled components.
    fn rigid(&self, modal: &ModalBasis, t: usize) -> impl Iterator<Item = f64> {
        let own = component(modal, t);
        self.sampled.iter().map(move |c| if *c == own { RIGID } else { 0.0 })
    }

    /// Whether a triangle's component moves rigidly and has no samples yet: an entry for it would be orthogonal to all samples.
    fn is_apart(&self, modal: &ModalBasis, t: usize) -> bool {
        modal.zero_modes > 0 && !self.sampled.contains(&component(modal, t))
    }
}

/// The component of a triangle.
fn component(modal: &ModalBasis, t: usize) -> u32 {
    let mesh = &modal.shell.mesh;
    mesh.component[mesh.triangles[t][0] as usize]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// G of a triangle in each mode.
pub fn modal_gradients(modal: &ModalBasis, poisson: &Poisson, t: usize) -> Vec<Matrix3<f64>> {
    let corners = modal.shell.mesh.triangles[t];
    let of = |k: usize| poisson.faces[t].gradient(corners.map(|v| modal.mode_at(k, v as usize).0));
    (0..modal.n_amplitudes()).map(of).collect()
}

/// Σ q_k G_k.
pub fn combined(gradients: &[Matrix3<f64>], q: &[f64]) -> Matrix3<f64> {
    gradients.iter().zip(q).map(|(g, q)| g * *q).sum()
}

/// Amplitudes of like energy in all modes, zero modes as the softest elastic one, each pose scaled to its rotation.
fn poses(modal: &ModalBasis, gradients: &[Vec<Matrix3<f64>>]) -> Vec<Vec<f64>> {
    let softest = modal.eigenvalues.iter().copied().find(|lambda| *lambda > 0.0).unwrap_or(1.0);
    let mut random = 0x9e37_79b9_7f4a_7c15u64; // xorshift64: the same on every machine
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut pose = |i: usize| -> Vec<f64> {
        let q: Vec<f64> = modal.eigenvalues.iter().map(|lambda| next() / lambda.max(softest).sqrt()).collect();
        let turn = gradients.iter().map(|g| axial(&combined(g, &q)).norm()).fold(f64::MIN_POSITIVE, f64::max);
        let scale = REACH * (i + 1) as f64 / POSES as f64 / turn;
        q.into_iter().map(|q| q * scale).collect()
    };
    (0..POSES).map(&mut pose).collect()
}

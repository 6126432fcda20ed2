//! The modal force of an acceleration that acts everywhere alike, from sums over the vertices that are taken once. A step
//! then visits no vertex.
//!
//! Linear modal analysis: f = Pᵀa with the participation factors P_k = Σ m φ_k, exactly. The warp, to first order in the
//! rotations w = Ψq (F the force on a vertex, m a):
//!
//!   (RᵀF)·φ_j ≈ F·(φ_j + w × φ_j)                        f_j = (P_j + Σ_k q_k T_jk)·a,   T_jk = Σ m ψ_k × φ_j
//!   (∂u/∂q_j)·F ≈ F·(φ_j + ½ (w × φ_j + ψ_j × Φq))       f_j = (P_j + ½ Σ_k q_k (T_jk + T_kj))·a

use super::ForceLaw;
use crate::Vec3;
use crate::warp::{Basis, Entry};

/// Beyond, the tables of T would take longer to make than a step saves.
const MOST_MODES: usize = 16;

/// Rotation, rad, below which the first order is the force to one part in 10⁶ of the load, about what a basis of 32 bits
/// gives: what is left out of R is at most w²/2.
const SMALL_TURN: f64 = 1.4e-3;

/// See the module's text.
pub struct Participation {
    /// P_k.
    uniform: Vec<Vec3>,
    /// T_jk at j modes + k; empty where it was left out.
    turning: Vec<Vec3>,
    /// Largest |φ_k|.
    reach: Vec<f64>,
    /// √(M Σ m |φ_k|²|ψ_k|²).
    swing: Vec<f64>,
    /// √(M Σ m |ψ_k|⁴).
    turn: Vec<f64>,
}

impl Participation {
    /// Of a basis whose vertices have the masses `mass`.
    pub fn new<E: Entry>(basis: &Basis<E>, mass: &[f64]) -> Self {
        let modes = basis.modes;
        let turns = !basis.is_linear() && modes <= MOST_MODES;
        let mut uniform = vec![Vec3::zeros(); modes];
        let [mut reach, mut swing, mut turn_squares] = [(); 3].map(|()| vec![0.0f64; modes]);
        let mut turning = vec![Vec3::zeros(); if turns { modes * modes } else { 0 }];
        let [mut pulls, mut spins] = [(); 2].map(|()| vec![Vec3::zeros(); modes]);
        for (v, mass) in mass.iter().enumerate() {
            for k in 0..modes {
                let (shape, turn) = basis.at(k, v);
                (pulls[k], spins[k]) = (*mass * shape, turn);
                uniform[k] += pulls[k];
                reach[k] = reach[k].max(shape.norm());
                swing[k] += mass * shape.norm_squared() * turn.norm_squared();
                turn_squares[k] += mass * turn.norm_squared().powi(2);
            }
            // Plain sums: those of a library of matrices have other bits on other processors.
            for (row, pull) in turning.chunks_exact_mut(modes.max(1)).zip(&pulls) {
                row.iter_mut().zip(&spins).for_each(|(t, spin)| *t += spin.cross(pull));
            }
        }
        for square in swing.iter_mut().chain(&mut turn_squares) {
            *square = basis.root_mass() * square.sqrt();
        }
        Self { uniform, turning, reach, swing, turn: turn_squares }
    }

    /// P_k of each mode: √mass.
    pub fn factors(&self) -> &[Vec3] {
        &self.uniform
    }

    /// No vertex is further from rest at amplitudes `q` without the warp.
    pub fn largest_displacement(&self, q: &[f64]) -> f64 {
        q.iter().zip(&self.reach).map(|(q, reach)| reach * q.abs()).sum()
    }

    /// Largest displacement of a vertex per unit amplitude, of each mode.
    pub fn reach(&self) -> &[f64] {
        &self.reach
    }

    /// √(M Σ m |φ|²|ψ|²) of each mode: how body loads swing with the shell.
    pub fn swing(&self) -> &[f64] {
        &self.swing
    }

    /// √(M Σ m |ψ|⁴) of each mode.
    pub fn turn(&self) -> &[f64] {
        &self.turn
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        (self.uniform.len() + self.turning.len()) * size_of::<Vec3>() + 3 * self.reach.len() * size_of::<f64>()
    }

    /// Whether [`Participation::force`] stands for the sum over vertices, to one part in 10⁶, where no vertex turns further
    /// than `turn`.
    pub fn suffices(&self, law: ForceLaw, turn: impl FnOnce() -> f64) -> bool {
        !law.warped() || (!self.turning.is_empty() && turn() <= SMALL_TURN)
    }

    /// Sets `force` (modes) to the modal force of the acceleration `a` (frame axes) at amplitudes `q`.
    pub fn force(&self, law: ForceLaw, a: &Vec3, q: &[f64], force: &mut [f64]) {
        let modes = q.len();
        let turning = |j: usize, k: usize| match law {
            ForceLaw::Linear => 0.0,
            ForceLaw::Rotated => self.turning[j * modes + k].dot(a),
            ForceLaw::VirtualWork => 0.5 * (self.turning[j * modes + k] + self.turning[k * modes + j]).dot(a),
        };
        for (j, force) in force.iter_mut().enumerate() {
            *force = self.uniform[j].dot(a);
            if law.warped() {
                *force += (0..modes).map(|k| q[k] * turning(j, k)).sum::<f64>();
            }
        }
    }
}

//! The modal motion nearest to a given one, in the mass norm.
//!
//! The pose is a nonlinear least-squares problem, min ½ Σ m |u − u(q)|², solved by Gauss and Newton: each step d minimises
//! ½ Σ m |u − u(q) − Jd|² by conjugate gradients (CGLS; Björck, Numerical Methods for Least Squares Problems, 1996, section 7.4),
//! which need J and Jᵀ only as products. JᵀMJ is near the unit matrix, so they take few rounds. The rates are the linear problem
//! min ½ Σ m |u̇ − Jq̇|² at that pose.

use super::{Map, Modal};
use crate::Vec3;
use crate::modal::ModalBasis;
use crate::support::Pose;
use crate::warp::Placement;

/// Steps of Gauss and Newton, at most; they end where one moves q by less than this share.
const STEPS: usize = 60;
const SETTLED: f64 = 1e-12;
/// Of a step, the least part that is tried.
const LEAST_SHARE: f64 = 1.0 / 1024.0;
/// Rounds of conjugate gradients, at most; they end where the gradient has fallen by this factor.
const ROUNDS: usize = 100;
const FALL: f64 = 1e-10;

/// What is missed at the vertices, and Σ m of its squares.
struct Miss {
    at: Vec<Vec3>,
    square: f64,
}

/// A map from q to displacements, and its derivative J.
struct Fit<'a, M> {
    map: &'a M,
    basis: &'a ModalBasis,
}

impl<M: Map> Fit<'_, M> {
    fn miss(&self, u: &[Vec3], q: &[f64]) -> Miss {
        let Pose { origin, .. } = Pose::identity();
        let (rest, mass) = (&self.basis.shell.mesh.positions, &self.basis.shell.mass);
        let mut miss = Miss { at: u.to_vec(), square: 0.0 };
        self.map.positions((self.basis, q), &Placement { origin, rotation: None }, |first, rows| {
            for (i, x) in rows.iter().enumerate() {
                let v = first + i;
                miss.at[v] -= Vec3::from(*x) - rest[v];
                miss.square += mass[v] * miss.at[v].norm_squared();
            }
        });
        miss
    }

    /// Jp at q.
    fn along(&self, q: &[f64], p: &[f64], out: &mut [Vec3]) {
        self.map.visit_visible_motion(self.basis, (q, p), |v, _, rate| out[v] = rate);
    }

    /// JᵀM of a field at q.
    fn pull_back(&self, q: &[f64], field: &[Vec3]) -> Vec<f64> {
        let weighted = (0u32..).zip(field.iter().zip(&self.basis.shell.mass)).map(|(v, (f, m))| (v, f * *m));
        let weighted: Vec<_> = weighted.collect();
        let mut along = vec![0.0; q.len()];
        self.map.pull_back((self.basis, q), &weighted, &mut along);
        along[self.basis.n_modes()..].fill(0.0); // support fields stay
        along
    }

    /// d of the least Σ m |miss − Jd|² at q.
    fn solve(&self, q: &[f64], mut miss: Vec<Vec3>) -> Vec<f64> {
        let mut d = vec![0.0; q.len()];
        let mut down = self.pull_back(q, &miss);
        let mut p = down.clone();
        let mut square = norm_squared(&down);
        let enough = FALL * FALL * square;
        let mut moved = vec![Vec3::zeros(); miss.len()];
        for _ in 0..ROUNDS {
            self.along(q, &p, &mut moved);
            let work: f64 = moved.iter().zip(&self.basis.shell.mass).map(|(x, m)| m * x.norm_squared()).sum();
            if !(square > enough && work > 0.0) {
                break;
            }
            let share = square / work;
            d.iter_mut().zip(&p).for_each(|(d, p)| *d += share * p);
            miss.iter_mut().zip(&moved).for_each(|(miss, moved)| *miss -= share * moved);
            down = self.pull_back(q, &miss);
            let next = norm_squared(&down);
            p.iter_mut().zip(&down).for_each(|(p, down)| *p = down + next / square * *p);
            square = next;
        }
        d
    }

    /// q of the least Σ m |u − u(q)|², from the rest pose with support fields as in `own`.
    fn nearest(&self, u: &[Vec3], own: &[f64]) -> Vec<f64> {
        let mut q = own.to_vec();
        q[..self.basis.n_modes()].fill(0.0);
        let mut miss = self.miss(u, &q);
        for _ in 0..STEPS {
            let step = self.solve(&q, miss.at.clone());
            let mut share = 1.0;
            let (trial, next) = loop {
                let trial: Vec<f64> = q.iter().zip(&step).map(|(q, d)| q + share * d).collect();
                let next = self.miss(u, &trial);
                if next.square < miss.square {
                    break (trial, next);
                }
                share *= 0.5;
                if share < LEAST_SHARE {
                    return q;
                }
            };
            let settled = norm_squared(&step) <= SETTLED * SETTLED * norm_squared(&trial);
            (q, miss) = (trial, next);
            if settled {
                break;
            }
        }
        q
    }
}

fn norm_squared(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

impl<M: Map> Modal<M> {
    /// The pose nearest to displacements `u` in the mass norm, and the rates that move it most nearly as `rate` (n_vertices).
    pub fn nearest(&self, u: &[Vec3], rate: &[Vec3]) -> (Vec<f64>, Vec<f64>) {
        let fit = Fit { map: &self.map, basis: &self.basis };
        let q = fit.nearest(u, &self.q);
        let modes = self.damping.len();
        let mut following = self.q_dot.clone();
        following[..modes].fill(0.0);
        let mut carried = vec![Vec3::zeros(); rate.len()];
        fit.along(&q, &following, &mut carried);
        let own = rate.iter().zip(carried).map(|(rate, carried)| rate - carried).collect();
        let mut q_dot = fit.solve(&q, own);
        q_dot[modes..].copy_from_slice(&following[modes..]);
        (q, q_dot)
    }
}

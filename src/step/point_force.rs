//! The modal force of forces on a few vertices: only these are visited.

use super::ForceLaw;
use crate::warp::{Basis, Entry, warp_with_derivative};
use crate::{Vec3, rotation};

/// Adds to `force` (modes) what the forces (frame axes) on `points` do to the modes at amplitudes `q`; returns Σ|F|.
pub fn add<E: Entry>(
    basis: &Basis<E>,
    law: ForceLaw,
    q: &[f64],
    points: impl Iterator<Item = (u32, Vec3)>,
    force: &mut [f64],
) -> f64 {
    let mut total = 0.0;
    for (v, on_vertex) in points {
        let shape = |k: usize| basis.at(k, v as usize);
        let (on_linear, on_turn) = pull_back(law, &on_vertex, || {
            let add = |(y, w): (Vec3, Vec3), k: usize| (y + q[k] * shape(k).0, w + q[k] * shape(k).1);
            (0..q.len()).fold((Vec3::zeros(), Vec3::zeros()), add)
        });
        for (k, force) in force.iter_mut().enumerate() {
            let (phi, psi) = shape(k);
            *force += phi.dot(&on_linear) + psi.dot(&on_turn);
        }
        total += on_vertex.norm();
    }
    total
}

/// (∂u/∂y)ᵀF and (∂u/∂w)ᵀF as the law has them; `combined` is (y, w) = (Φq, Ψq) of the vertex.
fn pull_back(law: ForceLaw, force: &Vec3, combined: impl FnOnce() -> (Vec3, Vec3)) -> (Vec3, Vec3) {
    match law {
        ForceLaw::Linear => (*force, Vec3::zeros()),
        ForceLaw::Rotated => (rotation::by(&combined().1).inverse_transform_vector(force), Vec3::zeros()),
        ForceLaw::VirtualWork => {
            let (y, w) = combined();
            let (_, by_y, by_w) = warp_with_derivative(&w, &y, true);
            (by_y.tr_mul(force), by_w.tr_mul(force))
        }
    }
}

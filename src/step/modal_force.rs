//! The modal force f = Φᵀ Rᵀ F of body loads (paper eq. 12): gravity and the inertia of the moving support frame.
//!
//! In the frame each vertex feels F = m [g − a − α × r − ω × (ω × r) − 2 ω × ṙ], all in frame axes, with its deformed
//! position r and velocity ṙ = R Φ q̇. Linear modal analysis takes R = I.

use crate::Vec3;
use crate::real::Real;
use crate::shell::Shell;
use crate::support::{Pose, Rates};
use crate::warp::{Basis, LANES, Lanes3, WarpedBlock, lane};
use nalgebra::Matrix3;

/// Body loads in frame axes, constant over a step.
pub struct BodyLoad {
    /// g − a: the acceleration that acts everywhere alike.
    uniform: Vec3,
    /// Rotation of the frame, when there is any.
    spin: Option<Spin>,
}

struct Spin {
    /// [α]× + [ω]×².
    gradient: Matrix3<f64>,
    /// 2 ω.
    coriolis: Vec3,
}

impl BodyLoad {
    /// Gravity (world axes) and frame rates (world axes) seen from `pose`.
    pub fn new(gravity: Vec3, pose: &Pose, rates: &Rates) -> Self {
        let to_frame = |v: Vec3| pose.rotation.inverse() * v;
        let (omega, alpha) = (to_frame(rates.angular_velocity), to_frame(rates.angular_acceleration));
        let turning = omega != Vec3::zeros() || alpha != Vec3::zeros();
        let (wx, ax) = (omega.cross_matrix(), alpha.cross_matrix());
        let spin = turning.then(|| Spin { gradient: ax + wx * wx, coriolis: 2.0 * omega });
        Self { uniform: to_frame(gravity - rates.acceleration), spin }
    }

    /// |ω| of the frame, when the load depends on position and velocity.
    pub fn spin_rate(&self) -> Option<f64> {
        self.spin.as_ref().map(|spin| 0.5 * spin.coriolis.norm())
    }

    /// Nothing acts.
    pub fn is_zero(&self) -> bool {
        self.uniform == Vec3::zeros() && self.spin.is_none()
    }

    /// Force on vertex mass `m` at `r` moving with `velocity`.
    pub fn at(&self, m: f64, r: Vec3, velocity: Vec3) -> Vec3 {
        match &self.spin {
            None => m * self.uniform,
            Some(spin) => m * (self.uniform - spin.gradient * r - spin.coriolis.cross(&velocity)),
        }
    }
}

/// Sets `force` (modes) to the modal force of `load` and of `external` forces (frame axes, n_vertices) at amplitudes `q` and velocities `q_dot`.
pub fn project<T: Real>(
    basis: &Basis<T>,
    shell: &Shell,
    load: &BodyLoad,
    external: Option<&[Vec3]>,
    warped: bool,
    (q, q_dot): (&[f64], &[f64]),
    force: &mut [f64],
) {
    force.fill(0.0);
    if load.is_zero() && external.is_none() {
        return;
    }
    for block in 0..basis.n_blocks() {
        let state = WarpedBlock::new(basis, block, q);
        let moving = load.spin.is_some().then(|| {
            let rate = basis.combine(block, q_dot).0;
            if warped { (state.displacement(), state.rotate(&rate)) } else { (*state.linear(), rate) }
        });
        let mut f: Lanes3<T> = [[T::default(); LANES]; 3];
        for i in 0..LANES.min(basis.n_vertices - block * LANES) {
            let v = block * LANES + i;
            let (u, velocity) = moving.as_ref().map_or_else(Default::default, |(u, rate)| (lane(u, i), lane(rate, i)));
            let body = load.at(shell.mass[v], shell.mesh.positions[v] + u, velocity);
            let total = body + external.map_or(Vec3::zeros(), |f| f[v]);
            (0..3).for_each(|c| f[c][i] = T::of(total[c] / shell.total_mass));
        }
        let f = if warped { state.rotate_back(&f) } else { f };
        basis.project(block, &f, force);
    }
    force.iter_mut().for_each(|f| *f *= shell.total_mass);
}

//! The modal force of body loads, gravity and the inertia of the moving support frame, and of external forces:
//! f = Φᵀ RᵀF (paper eq. 12), or the exact f = (∂x/∂q)ᵀF by virtual work, or ΦᵀF of linear modal analysis.
//!
//! In the frame each vertex feels F = m [g − a − α × r − ω × (ω × r) − 2 ω × ṙ], all in frame axes, with its deformed
//! position r and velocity ṙ = R Φ q̇, or (∂x/∂q) q̇, or Φ q̇.

use crate::Vec3;
use crate::real::Real;
use crate::shell::Shell;
use crate::support::{Pose, Rates};
use crate::warp::{Basis, LANES, Lanes3, Tangent, WarpedBlock, lane};
use nalgebra::Matrix3;

/// How a force on a vertex becomes a force on the modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceLaw {
    /// ΦᵀF, for u = Φq.
    Linear,
    /// Φᵀ RᵀF, for the warp (the paper).
    Rotated,
    /// (∂x/∂q)ᵀF, for the warp.
    VirtualWork,
}

impl ForceLaw {
    /// Whether positions are warped.
    pub fn warped(self) -> bool {
        self != Self::Linear
    }
}

/// One block of the shell at amplitudes q, as the law sees it.
enum Block<T> {
    Warped(WarpedBlock<T>),
    Tangent(Tangent<T>),
}

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

impl<T: Real> Block<T> {
    fn new(law: ForceLaw, basis: &Basis<T>, block: usize, q: &[f64]) -> Self {
        match law {
            ForceLaw::VirtualWork => Self::Tangent(Tangent::new(basis, block, q)),
            ForceLaw::Linear | ForceLaw::Rotated => Self::Warped(WarpedBlock::new(basis, block, q)),
        }
    }

    /// Displacement and its rate from (Φq̇, Ψq̇).
    fn motion(&self, law: ForceLaw, rates: &(Lanes3<T>, Lanes3<T>)) -> (Lanes3<T>, Lanes3<T>) {
        match self {
            Self::Tangent(block) => (block.displacement(), block.rate(rates)),
            Self::Warped(block) if law.warped() => (block.displacement(), block.rotate(&rates.0)),
            Self::Warped(block) => (*block.linear(), rates.0),
        }
    }

    /// What Φᵀ and Ψᵀ are applied to.
    fn pull_back(&self, law: ForceLaw, f: &Lanes3<T>) -> (Lanes3<T>, Option<Lanes3<T>>) {
        match self {
            Self::Tangent(block) => {
                let (on_y, on_w) = block.pull_back(f);
                (on_y, Some(on_w))
            }
            Self::Warped(block) if law.warped() => (block.rotate_back(f), None),
            Self::Warped(_) => (*f, None),
        }
    }
}

/// Displacement u and its rate u̇ (frame axes) of every vertex at amplitudes `q` and velocities `q_dot`, in order.
pub fn visit_motion<T: Real>(
    basis: &Basis<T>,
    law: ForceLaw,
    (q, q_dot): (&[f64], &[f64]),
    mut visit: impl FnMut(usize, Vec3, Vec3),
) {
    for block in 0..basis.n_blocks() {
        let (u, rate) = Block::new(law, basis, block, q).motion(law, &basis.combine(block, q_dot));
        let first = block * LANES;
        for i in 0..LANES.min(basis.n_vertices - first) {
            visit(first + i, lane(&u, i), lane(&rate, i));
        }
    }
}

/// Sets `force` (modes) to the modal force of `load` and of `external` forces (frame axes, n_vertices) at amplitudes `q` and
/// velocities `q_dot`. Returns Σ|F| over the vertices.
pub fn project<T: Real>(
    basis: &Basis<T>,
    shell: &Shell,
    load: &BodyLoad,
    external: Option<&[Vec3]>,
    law: ForceLaw,
    (q, q_dot): (&[f64], &[f64]),
    force: &mut [f64],
) -> f64 {
    force.fill(0.0);
    if load.is_zero() && external.is_none() {
        return 0.0;
    }
    let everywhere_alike = load.spin.is_none() && external.is_none();
    let mut sum = if everywhere_alike { shell.total_mass * load.uniform.norm() } else { 0.0 };
    for block in 0..basis.n_blocks() {
        let state = Block::new(law, basis, block, q);
        let moving = load.spin.is_some().then(|| state.motion(law, &basis.combine(block, q_dot)));
        let mut f: Lanes3<T> = [[T::default(); LANES]; 3];
        for i in 0..LANES.min(basis.n_vertices - block * LANES) {
            let v = block * LANES + i;
            let (u, velocity) = moving.as_ref().map_or_else(Default::default, |(u, rate)| (lane(u, i), lane(rate, i)));
            let body = load.at(shell.mass[v], shell.mesh.positions[v] + u, velocity);
            let total = body + external.map_or(Vec3::zeros(), |f| f[v]);
            sum += if everywhere_alike { 0.0 } else { total.norm() };
            (0..3).for_each(|c| f[c][i] = T::of(total[c] / shell.total_mass));
        }
        let (on_y, on_w) = state.pull_back(law, &f);
        basis.project(block, &on_y, on_w.as_ref(), force);
    }
    force.iter_mut().for_each(|f| *f *= shell.total_mass);
    sum
}

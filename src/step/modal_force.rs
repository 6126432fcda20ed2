//! The modal force of body loads, gravity and the inertia of the moving support frame, and of external forces:
//! f = Φᵀ RᵀF (paper eq. 12), or the exact f = (∂x/∂q)ᵀF by virtual work, or ΦᵀF of linear modal analysis.
//!
//! In the frame each vertex feels F = m [g − a − α × r − ω × (ω × r) − 2 ω × ṙ], all in frame axes, with its deformed
//! position r and velocity ṙ = R Φ q̇, or (∂x/∂q) q̇, or Φ q̇.

use crate::Vec3;
use crate::real::Real;
use crate::support::{Pose, Rates};
use crate::warp::lanes::{Group, Lanes, Vectors};
use crate::warp::{Basis, Block, Line, Pose as Warp, Sweep, Tangent, scatter, sweep};
use nalgebra::Matrix3;
use pulp::Simd;

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

    /// Without the weight that the shell carries where it is linearised, under `gravity` (frame axes).
    pub fn less(mut self, gravity: Vec3) -> Self {
        self.uniform -= gravity;
        self
    }

    /// g − a, and the [α]× + [ω]×² and 2ω of a frame that turns.
    pub fn parts(&self) -> (Vec3, Option<(&Matrix3<f64>, &Vec3)>) {
        (self.uniform, self.spin.as_ref().map(|spin| (&spin.gradient, &spin.coriolis)))
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

    /// Force per mass on a group of vertices; `motion` gives their r and ṙ, and is asked only where the load depends on them.
    #[inline(always)]
    fn on_group<T: Real, S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        motion: impl FnOnce() -> (Vectors<T, S, N>, Vectors<T, S, N>),
    ) -> Vectors<T, S, N> {
        let splat = |v: Vec3| [lanes.splat(v.x), lanes.splat(v.y), lanes.splat(v.z)];
        let uniform = splat(self.uniform);
        let Some(spin) = &self.spin else { return uniform };
        let (r, velocity) = motion();
        let mut force = lanes.cross(&velocity, &splat(spin.coriolis));
        for c in 0..3 {
            force = lanes.scale_add(r[c], &splat(-spin.gradient.column(c)), &force);
        }
        lanes.add_vectors(&uniform, &force)
    }
}

/// One group of vertices at amplitudes q, as a law sees it.
enum Shape<T: Real, S: Simd, const N: usize> {
    Linear(Vectors<T, S, N>),
    Warped(Warp<T, S, N>),
    Tangent(Tangent<T, S, N>),
}

impl<T: Real, S: Simd, const N: usize> Shape<T, S, N> {
    #[inline(always)]
    fn new(law: ForceLaw, lanes: Lanes<T, S, N>, combined: (Vectors<T, S, N>, Vectors<T, S, N>)) -> Self {
        match law {
            ForceLaw::Linear => Self::Linear(combined.0),
            ForceLaw::Rotated => Self::Warped(Warp::new(lanes, combined)),
            ForceLaw::VirtualWork => Self::Tangent(Tangent::new(lanes, combined)),
        }
    }

    /// Displacement and its rate from (Φq̇, Ψq̇).
    #[inline(always)]
    fn motion(&self, rates: &(Vectors<T, S, N>, Vectors<T, S, N>)) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        match self {
            Self::Linear(u) => (*u, rates.0),
            Self::Warped(warp) => (warp.displacement(), warp.rotate(&rates.0)),
            Self::Tangent(tangent) => (tangent.displacement(), tangent.rate(rates)),
        }
    }
}

/// Displacement u and its rate u̇ (frame axes) of every vertex at amplitudes `q` and velocities `q_dot`, in order.
pub fn visit_motion<T: Real>(
    basis: &Basis<T>,
    law: ForceLaw,
    (q, q_dot): (&[f64], &[f64]),
    visit: impl FnMut(usize, Vec3, Vec3),
) {
    struct Motion<'a, F> {
        n_vertices: usize,
        law: ForceLaw,
        q: &'a [f64],
        q_dot: &'a [f64],
        visit: F,
    }

    impl<T: Real, F: FnMut(usize, Vec3, Vec3)> Sweep<T> for Motion<'_, F> {
        #[inline(always)]
        fn visit<S: Simd, const N: usize>(&mut self, lanes: Lanes<T, S, N>, block: Block<T>, first: usize, at: usize) {
            let shape = Shape::new(self.law, lanes, block.combine(lanes, at, self.q));
            let (u, rate) = shape.motion(&block.combine(lanes, at, self.q_dot));
            scatter(lanes, self.n_vertices, first, (&u, &rate), &mut self.visit);
        }
    }

    sweep(basis, &mut Motion { n_vertices: basis.n_vertices, law, q, q_dot, visit });
}

/// Lanes are summed in the basis's precision over so many blocks, then in f64.
const BLOCKS_PER_SUM: usize = 64;

/// Room for the sums, so that a step does not allocate.
#[derive(Clone)]
pub struct Scratch<T> {
    /// A line for each mode, and one for |F|.
    sums: Vec<Line<T>>,
}

impl<T: Real> Scratch<T> {
    /// For `modes` modes.
    pub fn new(modes: usize) -> Self {
        Self { sums: vec![Line::default(); modes + 1] }
    }
}

/// What acts on the vertices, and at which amplitudes.
pub struct Acting<'a> {
    /// Body loads.
    pub load: &'a BodyLoad,
    /// Forces (frame axes, n_vertices), if any.
    pub external: Option<&'a [Vec3]>,
    /// How they act on the modes.
    pub law: ForceLaw,
    /// Amplitudes.
    pub q: &'a [f64],
    /// Their rates.
    pub q_dot: &'a [f64],
    /// M.
    pub total_mass: f64,
}

impl Acting<'_> {
    /// The force per mass is the same on every vertex.
    fn uniform(&self) -> bool {
        self.load.spin.is_none() && self.external.is_none()
    }
}

/// Sets `force` (modes) to the modal force. Returns Σ|F| over the vertices. Does not allocate.
pub fn project<T: Real>(basis: &Basis<T>, acting: &Acting, scratch: &mut Scratch<T>, force: &mut [f64]) -> f64 {
    force.fill(0.0);
    if acting.load.is_zero() && acting.external.is_none() {
        return 0.0;
    }
    scratch.sums.fill(Line::default());
    let mut projection = Projection { acting, sums: &mut scratch.sums, force, total: 0.0, blocks: 0 };
    sweep(basis, &mut projection);
    projection.gather();
    let total = if acting.uniform() { acting.load.uniform.norm() } else { projection.total };
    force.iter_mut().for_each(|f| *f *= acting.total_mass / basis.root_mass());
    acting.total_mass * total
}

struct Projection<'a, T> {
    acting: &'a Acting<'a>,
    sums: &'a mut [Line<T>],
    force: &'a mut [f64],
    /// Σ|F|/M, where it is not uniform.
    total: f64,
    /// Since sums were gathered.
    blocks: usize,
}

impl<T: Real> Projection<'_, T> {
    fn gather(&mut self) {
        let sum = |line: &Line<T>| line.0.iter().map(|x| x.to_f64()).sum::<f64>();
        let (forces, total) = self.sums.split_at(self.force.len());
        self.force.iter_mut().zip(forces).for_each(|(force, line)| *force += sum(line));
        self.total += total.iter().map(sum).sum::<f64>();
        self.sums.fill(Line::default());
        self.blocks = 0;
    }

    /// F/M of the group's vertices.
    #[inline(always)]
    fn forces<S: Simd, const N: usize>(
        &mut self,
        lanes: Lanes<T, S, N>,
        (block, first, at): (&Block<T>, usize, usize),
        shape: &Shape<T, S, N>,
    ) -> Vectors<T, S, N> {
        let acting = self.acting;
        let per_mass = acting.load.on_group(lanes, || {
            let (u, velocity) = shape.motion(&block.combine(lanes, at, acting.q_dot));
            (lanes.add_vectors(&block.rest(lanes, at), &u), velocity)
        });
        let mut force = lanes.scale(block.mass(lanes, at), &per_mass);
        if let Some(external) = acting.external {
            force = lanes.add_vectors(&force, &gather_vectors(lanes, external, first, 1.0 / acting.total_mass));
        }
        if !acting.uniform() {
            let norm: Group<T, S, N> = lanes.sqrt(lanes.dot(&force, &force));
            let line = &mut self.sums[self.force.len()].0;
            lanes.store(lanes.add(lanes.load(line, at), norm), line, at);
        }
        force
    }
}

/// `scale` times the vectors of the vertices from `first` on; zero past the end.
#[inline(always)]
fn gather_vectors<T: Real, S: Simd, const N: usize>(
    lanes: Lanes<T, S, N>,
    vectors: &[Vec3],
    first: usize,
    scale: f64,
) -> Vectors<T, S, N> {
    let mut lines = [Line::<T>::default(); 3];
    for (i, vector) in vectors.iter().skip(first).take(lanes.width()).enumerate() {
        (0..3).for_each(|c| lines[c].0[i] = T::of(vector[c] * scale));
    }
    [lanes.load(&lines[0].0, 0), lanes.load(&lines[1].0, 0), lanes.load(&lines[2].0, 0)]
}

impl<T: Real> Sweep<T> for Projection<'_, T> {
    #[inline(always)]
    fn visit<S: Simd, const N: usize>(&mut self, lanes: Lanes<T, S, N>, block: Block<T>, first: usize, at: usize) {
        let shape = Shape::new(self.acting.law, lanes, block.combine(lanes, at, self.acting.q));
        let force = self.forces(lanes, (&block, first, at), &shape);
        match shape {
            Shape::Linear(_) => block.project(lanes, at, &force, self.sums),
            Shape::Warped(warp) => block.project(lanes, at, &warp.rotate_back(&force), self.sums),
            Shape::Tangent(tangent) => {
                let (on_linear, on_turn) = tangent.pull_back(&force);
                block.project_both(lanes, at, (&on_linear, &on_turn), self.sums);
            }
        }
    }

    fn end_block(&mut self) {
        self.blocks += 1;
        if self.blocks == BLOCKS_PER_SUM {
            self.gather();
        }
    }
}

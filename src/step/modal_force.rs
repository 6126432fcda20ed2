//! The modal force of body loads, gravity and the inertia of the moving support frame, and of external forces:
//! f = Φᵀ RᵀF (paper eq. 12), or the exact f = (∂x/∂q)ᵀF by virtual work, or ΦᵀF of linear modal analysis.
//!
//! In the frame each vertex feels F = m [g − a − α × r − ω × (ω × r) − 2 ω × ṙ], all in frame axes, with its deformed
//! position r and velocity ṙ = R Φ q̇, or (∂x/∂q) q̇, or Φ q̇.

use super::guard::Pull;
use crate::Vec3;
use crate::load::BodyLoad;
use crate::real::Real;
use crate::warp::lanes::{Group, Kind, Lanes, Vectors};
use crate::warp::{Basis, Block, Entry, Line, Sweep, Tangent, WarpPose as Warp, Weights, scatter, sweep, with_weights};

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

/// Force per mass of a body load on a group of vertices. `uniform` is what acts everywhere alike; `motion` gives their r and ṙ, and is
/// asked only where the load depends on them.
#[inline(always)]
fn load_on_group<T: Real, S: Kind, const N: usize>(
    load: &BodyLoad,
    lanes: Lanes<T, S, N>,
    uniform: [T; 3],
    motion: impl FnOnce() -> (Vectors<T, S, N>, Vectors<T, S, N>),
) -> Vectors<T, S, N> {
    let splat = |v: Vec3| [lanes.splat(v.x), lanes.splat(v.y), lanes.splat(v.z)];
    let uniform = uniform.map(|x| lanes.repeat(x));
    let Some(spin) = &load.spin else { return uniform };
    let (r, velocity) = motion();
    let mut force = lanes.cross(&velocity, &splat(spin.coriolis));
    for c in 0..3 {
        force = lanes.scale_add(r[c], &splat(-spin.gradient.column(c)), &force);
    }
    lanes.add_vectors(&uniform, &force)
}

/// One group of vertices at amplitudes q, as a force law sees it.
trait Shape<T: Real, S: Kind, const N: usize> {
    /// Displacement and its rate where amplitudes change at the rates of `rates`.
    fn motion<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        at: (&Block<E>, usize),
        rates: Weights<T>,
    ) -> (Vectors<T, S, N>, Vectors<T, S, N>);

    /// Adds the modal force of the vertices' forces to the sums.
    fn project<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        at: (&Block<E>, usize),
        force: &Vectors<T, S, N>,
        sums: &mut [[Line<T>; 2]],
    );
}

/// u = Φq.
struct Linear<T: Real, S: Kind, const N: usize>(Vectors<T, S, N>);

impl<T: Real, S: Kind, const N: usize> Shape<T, S, N> for Linear<T, S, N> {
    #[inline(always)]
    fn motion<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        rates: Weights<T>,
    ) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        (self.0, block.combine_linear(lanes, at, rates))
    }

    #[inline(always)]
    fn project<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        force: &Vectors<T, S, N>,
        sums: &mut [[Line<T>; 2]],
    ) {
        block.project_linear(lanes, at, force, sums);
    }
}

impl<T: Real, S: Kind, const N: usize> Shape<T, S, N> for Warp<T, S, N> {
    #[inline(always)]
    fn motion<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        rates: Weights<T>,
    ) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        (self.displacement(), self.rotate(&block.combine_linear(lanes, at, rates)))
    }

    #[inline(always)]
    fn project<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        force: &Vectors<T, S, N>,
        sums: &mut [[Line<T>; 2]],
    ) {
        block.project(lanes, at, &self.rotate_back(force), sums);
    }
}

impl<T: Real, S: Kind, const N: usize> Shape<T, S, N> for Tangent<T, S, N> {
    #[inline(always)]
    fn motion<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        rates: Weights<T>,
    ) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        (self.displacement(), self.rate(&block.combine(lanes, at, rates)))
    }

    #[inline(always)]
    fn project<E: Entry<Real = T>>(
        &self,
        lanes: Lanes<T, S, N>,
        (block, at): (&Block<E>, usize),
        force: &Vectors<T, S, N>,
        sums: &mut [[Line<T>; 2]],
    ) {
        let (on_linear, on_turn) = self.pull_back(force);
        block.project_both(lanes, at, (&on_linear, &on_turn), sums);
    }
}

/// Displacement u and its rate u̇ (frame axes) of every vertex at amplitudes `q` and velocities `q_dot`, in order.
pub fn visit_motion<E: Entry>(
    basis: &Basis<E>,
    law: ForceLaw,
    (q, q_dot): (&[f64], &[f64]),
    visit: impl FnMut(usize, Vec3, Vec3),
) {
    struct Rates<'a, T, F> {
        n_vertices: usize,
        law: ForceLaw,
        weights: Weights<'a, T>,
        rates: Weights<'a, T>,
        visit: F,
    }

    impl<E: Entry, F: FnMut(usize, Vec3, Vec3)> Sweep<E> for Rates<'_, E::Real, F> {
        #[inline(always)]
        fn visit<S: Kind, const N: usize>(
            &mut self,
            lanes: Lanes<E::Real, S, N>,
            block: Block<E>,
            first: usize,
            at: usize,
        ) {
            let Self { weights, rates, .. } = *self;
            let (place, combined) = ((&block, at), || block.combine(lanes, at, weights));
            let (u, rate) = match self.law {
                ForceLaw::Linear => Linear(block.combine_linear(lanes, at, weights)).motion(lanes, place, rates),
                ForceLaw::Rotated => Warp::new(lanes, combined(), weights.doublings).motion(lanes, place, rates),
                ForceLaw::VirtualWork => Tangent::new(lanes, combined(), weights.doublings).motion(lanes, place, rates),
            };
            scatter(lanes, self.n_vertices, first, [&u, &rate], &mut |v, [u, rate]| (self.visit)(v, u, rate));
        }
    }

    with_weights(basis, q, |weights| {
        with_weights(basis, q_dot, |rates| {
            sweep(basis, &mut Rates { n_vertices: basis.n_vertices, law, weights, rates, visit });
        });
    });
}

/// Lanes are summed in the basis's precision over so many blocks, then in f64.
const BLOCKS_PER_SUM: usize = 64;

/// A step of up to so many modes has its sums on the stack: those of thousands of states would push each other from the cache.
const FEW: usize = 8;

/// Room for sums and weights of a step, so that it does not allocate.
#[derive(Clone)]
pub struct Scratch<T> {
    /// Two lines for each mode; empty for [`FEW`].
    sums: Vec<[Line<T>; 2]>,
    /// Of q and of q̇ (modes, or empty).
    weights: [Vec<[T; 2]>; 2],
}

impl<T: Real> Scratch<T> {
    /// For `modes` modes.
    pub fn new(modes: usize) -> Self {
        let modes = if modes <= FEW { 0 } else { modes };
        let weights = vec![[T::default(); 2]; modes];
        Self { sums: vec![Default::default(); modes], weights: [weights.clone(), weights] }
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

/// Sets `force` (modes) to the modal force. Returns how strongly the loads pull. Does not allocate.
pub fn project<E: Entry>(basis: &Basis<E>, acting: &Acting, scratch: &mut Scratch<E::Real>, force: &mut [f64]) -> Pull {
    force.fill(0.0);
    if acting.load.is_zero() && acting.external.is_none() {
        return Pull::default();
    }
    let (mut few_sums, mut few_weights);
    let (sums, weights, rates): (&mut [_], &mut [_], &mut [_]) = if basis.modes <= FEW {
        few_sums = [Default::default(); FEW];
        few_weights = [[Default::default(); 2]; 2 * FEW];
        let (weights, rates) = few_weights.split_at_mut(FEW);
        (&mut few_sums[..basis.modes], weights, rates)
    } else {
        let Scratch { sums, weights: [weights, rates] } = scratch;
        sums.fill(Default::default());
        (sums, weights, rates)
    };
    let pulls = &mut <[Line<E::Real>; 2]>::default();
    let weights = basis.weights(acting.q, weights);
    // Velocities matter in a spinning frame alone.
    let rates = if acting.load.spin.is_some() { basis.weights(acting.q_dot, rates) } else { weights };
    let uniform = <[f64; 3]>::from(acting.load.uniform).map(<E::Real as Real>::of);
    let mut projection =
        Projection { basis, acting, uniform, weights, rates, sums, pulls, force, totals: [0.0; 2], blocks: 0 };
    sweep(basis, &mut projection);
    projection.gather();
    let [square, external] = projection.totals;
    let body = if acting.load.spin.is_some() { square.sqrt() } else { acting.load.uniform.norm() };
    force.iter_mut().for_each(|f| *f *= acting.total_mass / basis.root_mass());
    Pull { body, external: acting.total_mass * external, reach: 0.0 }
}

struct Projection<'a, E: Entry> {
    basis: &'a Basis<E>,
    acting: &'a Acting<'a>,
    /// Force per mass that acts everywhere alike.
    uniform: [E::Real; 3],
    weights: Weights<'a, E::Real>,
    rates: Weights<'a, E::Real>,
    sums: &'a mut [[Line<E::Real>; 2]],
    /// m|a|²/M, where it depends on the vertex, and |F|/M of external forces.
    pulls: &'a mut [Line<E::Real>; 2],
    force: &'a mut [f64],
    /// Their sums.
    totals: [f64; 2],
    /// Since sums were gathered.
    blocks: usize,
}

impl<E: Entry> Projection<'_, E> {
    #[inline(never)]
    fn gather(&mut self) {
        let sum = |line: &Line<E::Real>| line.0.iter().map(|x| x.to_f64()).sum::<f64>();
        for ((force, [line, turn_line]), [unit, turn_unit]) in
            self.force.iter_mut().zip(&*self.sums).zip(self.basis.units())
        {
            *force += sum(line) * unit;
            if E::SCALED {
                *force += sum(turn_line) * turn_unit;
            }
        }
        self.totals.iter_mut().zip(&*self.pulls).for_each(|(total, line)| *total += sum(line));
        self.sums.fill(Default::default());
        *self.pulls = Default::default();
        self.blocks = 0;
    }

    /// Adds the modal force of one group.
    #[inline(always)]
    fn act<S: Kind, const N: usize>(
        &mut self,
        lanes: Lanes<E::Real, S, N>,
        (block, first, at): (&Block<E>, usize, usize),
        shape: &impl Shape<E::Real, S, N>,
    ) {
        let acting = self.acting;
        let per_mass = load_on_group(acting.load, lanes, self.uniform, || {
            let (u, velocity) = shape.motion(lanes, (block, at), self.rates);
            (lanes.add_vectors(&block.rest(lanes, at), &u), velocity)
        });
        let mut force = lanes.scale(block.mass(lanes, at), &per_mass);
        let [square, norms] = &mut *self.pulls;
        if acting.load.spin.is_some() {
            lanes.add_dot(&force, &per_mass, square, at);
        }
        if let Some(external) = acting.external {
            let external = gather_vectors(lanes, external, first, 1.0 / acting.total_mass);
            let norm: Group<E::Real, S, N> = lanes.sqrt(lanes.dot(&external, &external));
            lanes.store(lanes.add(lanes.load(&norms.0, at), norm), &mut norms.0, at);
            force = lanes.add_vectors(&force, &external);
        }
        shape.project(lanes, (block, at), &force, self.sums);
    }
}

/// `scale` times the vectors of the vertices from `first` on; zero past the end.
#[inline(always)]
fn gather_vectors<T: Real, S: Kind, const N: usize>(
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

impl<E: Entry> Sweep<E> for Projection<'_, E> {
    #[inline(always)]
    fn visit<S: Kind, const N: usize>(
        &mut self,
        lanes: Lanes<E::Real, S, N>,
        block: Block<E>,
        first: usize,
        at: usize,
    ) {
        let (weights, place) = (self.weights, (&block, first, at));
        let combined = || block.combine(lanes, at, weights);
        match self.acting.law {
            ForceLaw::Linear => self.act(lanes, place, &Linear(block.combine_linear(lanes, at, weights))),
            ForceLaw::Rotated => self.act(lanes, place, &Warp::new(lanes, combined(), weights.doublings)),
            ForceLaw::VirtualWork => self.act(lanes, place, &Tangent::new(lanes, combined(), weights.doublings)),
        }
    }

    fn end_block(&mut self) {
        self.blocks += 1;
        if self.blocks == BLOCKS_PER_SUM {
            self.gather();
        }
    }
}

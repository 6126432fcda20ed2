//! Modal warping: displacements u_i = R̃(w_i) (Φq)_i with w = Ψq, the path integral of rotated rates when q and w grow
//! together from zero (paper section 4.2; \[2\] section 4).

mod basis;
mod coefficients;
mod derivative;
mod entry;
pub mod lanes;
mod modal_rotation;
mod output;
mod pose;

pub use basis::{Basis, Block, Line, Weights};
pub use coefficients::{Coefficients, Slopes, coefficients, coefficients_and_slopes, doublings};
pub use derivative::{warp, warp_with_derivative};
pub use entry::{Entry, I16};
pub use modal_rotation::ModalRotation;
pub use output::{
    Amplitudes, Extent, Placement, extent, visit_positions_f32, visit_positions_f64, visit_positions_of_f32,
    visit_positions_of_f64, visit_runs,
};
pub use pose::{Tangent, WarpPose};

use crate::Vec3;
use crate::limits::MAX_MODES;
use crate::real::Real;
use lanes::{Fused, Kind, Lanes, Unfused, Vectors};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Vertices per block.
pub const LANES: usize = 16;

/// Work on every group of vertices of every block, in registers of any width.
pub trait Sweep<E: Entry> {
    /// `first` is the vertex of the group's first lane; `at` its first register in a line.
    fn visit<S: Kind, const N: usize>(&mut self, lanes: Lanes<E::Real, S, N>, block: Block<E>, first: usize, at: usize);
    /// After each block.
    fn end_block(&mut self) {}
}

/// Runs `sweep` over `basis`, in its kind of registers.
pub fn sweep<E: Entry>(basis: &Basis<E>, sweep: &mut impl Sweep<E>) {
    sweep_blocks(basis, 0..basis.n_blocks(), sweep);
}

/// Runs `sweep` over some blocks of `basis`, in its kind of registers.
pub fn sweep_blocks<E: Entry>(basis: &Basis<E>, blocks: Range<usize>, sweep: &mut impl Sweep<E>) {
    struct Dispatch<'a, E: Entry, W> {
        basis: &'a Basis<E>,
        blocks: Range<usize>,
        sweep: &'a mut W,
    }

    impl<E: Entry, W: Sweep<E>> WithSimd for Dispatch<'_, E, W> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            // Two registers at a time where a line has as many: one chain of additions alone would wait for itself.
            let Self { basis, blocks, sweep } = self;
            let whole = size_of::<<E::Real as Real>::Register<S>>() == size_of::<Line<E::Real>>();
            match (whole, basis.fused) {
                (true, true) => groups::<E, Fused<S>, 1>(simd, basis, blocks, sweep),
                (false, true) => groups::<E, Fused<S>, 2>(simd, basis, blocks, sweep),
                (true, false) => groups::<E, Unfused<S>, 1>(simd, basis, blocks, sweep),
                (false, false) => groups::<E, Unfused<S>, 2>(simd, basis, blocks, sweep),
            }
        }
    }

    #[inline(always)]
    fn groups<E: Entry, S: Kind, const N: usize>(
        simd: S::Simd,
        basis: &Basis<E>,
        blocks: Range<usize>,
        sweep: &mut impl Sweep<E>,
    ) {
        let lanes = Lanes::<E::Real, S, N>::new(simd);
        for (b, block) in blocks.clone().zip(basis.blocks(blocks)) {
            for group in 0..LANES / lanes.width() {
                sweep.visit(lanes, block, b * LANES + group * lanes.width(), group * N);
            }
            sweep.end_block();
        }
    }

    basis.arch.dispatch(Dispatch { basis, blocks, sweep });
}

/// Calls `work` with the weights of amplitudes `q`, held on the stack.
pub fn with_weights<E: Entry, R>(basis: &Basis<E>, q: &[f64], work: impl FnOnce(Weights<E::Real>) -> R) -> R {
    const FEW: usize = 16;
    let zero = [E::Real::default(); 2];
    let (mut few, mut all);
    let room: &mut [_] = if basis.modes <= FEW {
        few = [zero; FEW];
        &mut few
    } else {
        all = [zero; MAX_MODES];
        &mut all
    };
    work(basis.weights(q, room))
}

/// Hands `M` vectors of each lane to `visit` as those of vertices `first`, `first` + 1, …
#[inline(always)]
pub fn scatter<T: Real, S: Kind, const N: usize, const M: usize>(
    lanes: Lanes<T, S, N>,
    n_vertices: usize,
    first: usize,
    vectors: [&Vectors<T, S, N>; M],
    visit: &mut impl FnMut(usize, [Vec3; M]),
) {
    let mut lines = [[Line([T::default(); LANES]); 3]; M];
    for (lines, vector) in lines.iter_mut().zip(vectors) {
        (0..3).for_each(|c| lanes.store(vector[c], &mut lines[c].0, 0));
    }
    for i in 0..lanes.width().min(n_vertices.saturating_sub(first)) {
        visit(first + i, lines.map(|lines| Vec3::from_fn(|c, _| lines[c].0[i].to_f64())));
    }
}

/// Hands the rotation vector w = Ψq (frame axes) of every vertex to `visit`, in order.
pub fn visit_turns<E: Entry>(basis: &Basis<E>, q: &[f64], visit: impl FnMut(usize, Vec3)) {
    struct Turns<'a, T, F> {
        n_vertices: usize,
        weights: Weights<'a, T>,
        visit: F,
    }

    impl<E: Entry, F: FnMut(usize, Vec3)> Sweep<E> for Turns<'_, E::Real, F> {
        #[inline(always)]
        fn visit<S: Kind, const N: usize>(
            &mut self,
            lanes: Lanes<E::Real, S, N>,
            block: Block<E>,
            first: usize,
            at: usize,
        ) {
            let (_, turn) = block.combine(lanes, at, self.weights);
            scatter(lanes, self.n_vertices, first, [&turn], &mut |v, [w]| (self.visit)(v, w));
        }
    }

    with_weights(basis, q, |weights| sweep(basis, &mut Turns { n_vertices: basis.n_vertices, weights, visit }));
}

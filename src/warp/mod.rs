//! Modal warping: displacements u_i = R̃(w_i) (Φq)_i with w = Ψq, the path integral of rotated rates when q and w grow
//! together from zero (paper section 4.2; [2] section 4).

mod basis;
mod coefficients;
mod derivative;
pub mod lanes;
mod modal_rotation;
mod output;
mod pose;

pub use basis::{Basis, Block, Line};
pub use coefficients::{Coefficients, Slopes, coefficients, coefficients_and_slopes};
pub use derivative::warp_with_derivative;
pub use modal_rotation::ModalRotation;
pub use output::{
    Amplitudes, Extent, Placement, extent, visit_positions_f32, visit_positions_f64, visit_positions_of_f32,
    visit_positions_of_f64,
};
pub use pose::{Pose, Tangent};

use crate::Vec3;
use crate::real::Real;
use lanes::{Lanes, Vectors};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Vertices per block.
pub const LANES: usize = 16;

/// Work on every group of vertices of every block, in registers of any width.
pub trait Sweep<T: Real> {
    /// `first` is the vertex of the group's first lane; `at` its first register in a line.
    fn visit<S: Simd, const N: usize>(&mut self, lanes: Lanes<T, S, N>, block: Block<T>, first: usize, at: usize);
    /// After each block.
    fn end_block(&mut self) {}
}

/// Runs `sweep` over `basis`, in its kind of registers.
pub fn sweep<T: Real>(basis: &Basis<T>, sweep: &mut impl Sweep<T>) {
    sweep_blocks(basis, 0..basis.n_blocks(), sweep);
}

/// Runs `sweep` over some blocks of `basis`, in its kind of registers.
pub fn sweep_blocks<T: Real>(basis: &Basis<T>, blocks: Range<usize>, sweep: &mut impl Sweep<T>) {
    struct Dispatch<'a, T, W> {
        basis: &'a Basis<T>,
        blocks: Range<usize>,
        sweep: &'a mut W,
    }

    impl<T: Real, W: Sweep<T>> WithSimd for Dispatch<'_, T, W> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            // Two registers at a time where a line has as many: one chain of additions alone would wait for itself.
            if size_of::<T::Register<S>>() == size_of::<Line<T>>() {
                groups::<T, S, 1>(simd, self.basis, self.blocks, self.sweep);
            } else {
                groups::<T, S, 2>(simd, self.basis, self.blocks, self.sweep);
            }
        }
    }

    #[inline(always)]
    fn groups<T: Real, S: Simd, const N: usize>(
        simd: S,
        basis: &Basis<T>,
        blocks: Range<usize>,
        sweep: &mut impl Sweep<T>,
    ) {
        let lanes = Lanes::<T, S, N>::new(simd);
        for (b, block) in blocks.clone().zip(basis.blocks(blocks)) {
            for group in 0..LANES / lanes.width() {
                sweep.visit(lanes, block, b * LANES + group * lanes.width(), group * N);
            }
            sweep.end_block();
        }
    }

    basis.arch.dispatch(Dispatch { basis, blocks, sweep });
}

/// Hands `M` vectors of each lane to `visit` as those of vertices `first`, `first` + 1, …
#[inline(always)]
pub fn scatter<T: Real, S: Simd, const N: usize, const M: usize>(
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
pub fn visit_turns<T: Real>(basis: &Basis<T>, q: &[f64], visit: impl FnMut(usize, Vec3)) {
    struct Turns<'a, F> {
        n_vertices: usize,
        q: &'a [f64],
        visit: F,
    }

    impl<T: Real, F: FnMut(usize, Vec3)> Sweep<T> for Turns<'_, F> {
        #[inline(always)]
        fn visit<S: Simd, const N: usize>(&mut self, lanes: Lanes<T, S, N>, block: Block<T>, first: usize, at: usize) {
            let (_, turn) = block.combine(lanes, at, self.q);
            scatter(lanes, self.n_vertices, first, [&turn], &mut |v, [w]| (self.visit)(v, w));
        }
    }

    sweep(basis, &mut Turns { n_vertices: basis.n_vertices, q, visit });
}

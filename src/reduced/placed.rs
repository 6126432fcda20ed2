//! Rows x y z of a block of vertices from what a sweep over fields finds, to the same bits by all instructions.

use crate::real::Real;
use crate::warp::lanes::{Lanes, Unfused, Vectors};
use crate::warp::{LANES, Line, Placement};
use pulp::Simd;
use std::ops::Range;

/// Takes what a sweep finds of each block: its first vertex, u and the rest positions.
pub(super) trait Visit<T> {
    /// In registers of `simd`, as the sweep is.
    fn visit<S: Simd>(&mut self, simd: S, first: usize, u: &[Line<T>; 3], rest: &[Line<T>]);
}

/// What does not care for the registers.
impl<T, F: FnMut(usize, &[Line<T>; 3], &[Line<T>])> Visit<T> for F {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, _: S, first: usize, u: &[Line<T>; 3], rest: &[Line<T>]) {
        self(first, u, rest);
    }
}

/// Hands positions to `write`: the first vertex, and rows.
pub(super) struct Rows<T, W> {
    pub n_vertices: usize,
    pub placed: Placed<T>,
    pub write: W,
}

impl<T: Real, W: FnMut(usize, &[[f32; 3]])> Visit<T> for Rows<T, W> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, first: usize, u: &[Line<T>; 3], rest: &[Line<T>]) {
        let rows = self.placed.rows(simd, u, rest);
        if first + LANES <= self.n_vertices {
            (self.write)(first, &rows); // of a length known when compiling
        } else {
            (self.write)(first, &rows[..self.n_vertices - first]);
        }
    }
}

/// Keeps the rows of one block.
pub(super) struct Kept<T> {
    placed: Placed<T>,
    rows: [[f32; 3]; LANES],
}

impl<T: Real> Kept<T> {
    /// As `sweep` over the block finds them.
    pub fn of(placement: &Placement, sweep: impl FnOnce(&mut Self)) -> [[f32; 3]; LANES] {
        let mut kept = Self { placed: Placed::by(placement), rows: [[0.0; 3]; LANES] };
        sweep(&mut kept);
        kept.rows
    }
}

impl<T: Real> Visit<T> for Kept<T> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, _: usize, u: &[Line<T>; 3], rest: &[Line<T>]) {
        self.rows = self.placed.rows(simd, u, rest);
    }
}

/// A [`Placement`] in the precision of a sweep.
#[derive(Clone, Copy)]
pub(super) struct Placed<T> {
    origin: [T; 3],
    turn: Option<[[T; 3]; 3]>,
}

impl<T: Real> Placed<T> {
    pub fn by(placement: &Placement) -> Self {
        let matrix = |r: nalgebra::Matrix3<f64>| std::array::from_fn(|c| std::array::from_fn(|d| T::of(r[(c, d)])));
        Self { origin: std::array::from_fn(|c| T::of(placement.origin[c])), turn: placement.rotation.map(matrix) }
    }

    #[inline(always)]
    fn rows<S: Simd>(&self, simd: S, u: &[Line<T>; 3], rest: &[Line<T>]) -> [[f32; 3]; LANES] {
        let lanes = Lanes::<T, Unfused<S>, 1>::new(simd);
        let mut placed = [Line([T::default(); LANES]); 3];
        for at in 0..LANES / lanes.width() {
            let mut x: Vectors<T, Unfused<S>, 1> = [lanes.repeat(T::default()); 3];
            for c in 0..3 {
                x[c] = lanes.add(lanes.load(&rest[c].0, at), lanes.load(&u[c].0, at));
            }
            if let Some(turn) = &self.turn {
                let local = x;
                for (x, [a, b, c]) in x.iter_mut().zip(turn) {
                    let ab = lanes.mul_add(lanes.repeat(*b), local[1], lanes.mul(lanes.repeat(*a), local[0]));
                    *x = lanes.mul_add(lanes.repeat(*c), local[2], ab);
                }
            }
            for c in 0..3 {
                lanes.store(lanes.add(lanes.repeat(self.origin[c]), x[c]), &mut placed[c].0, at);
            }
        }
        let mut rows = [[0f32; 3]; LANES];
        for i in 0..LANES {
            rows[i] = [placed[0].0[i].to_f32(), placed[1].0[i].to_f32(), placed[2].0[i].to_f32()];
        }
        rows
    }
}

/// Hands a row of each of `vertices` to `write`, with its place in the list; `rows` makes those of a block.
pub(super) fn rows_of<R: Copy>(
    vertices: &[u32],
    rows: impl Fn(Range<usize>) -> [R; LANES],
    mut write: impl FnMut(usize, R),
) {
    let mut last = None;
    for (i, v) in vertices.iter().map(|v| *v as usize).enumerate() {
        let block = v / LANES;
        let of_block = match last {
            Some((held, rows)) if held == block => rows,
            _ => rows(block..block + 1),
        };
        last = Some((block, of_block));
        write(i, of_block[v % LANES]);
    }
}

//! The samples' fields b_c in blocks of [`LANES`] vertices, three lines a field, beside the run-time basis: a sweep over both gives
//! u = Φq + Σ N_c b_c, or ΦᵀF and Σ F bᵀ.

use super::fit::MOST_SAMPLES;
use crate::Vec3;
use crate::error::{Result, try_zeroed};
use crate::real::Real;
use crate::warp::lanes::{Kind, Lanes};
use crate::warp::{Basis, Block, Entry, LANES, Line, Sweep, Weights, sweep_blocks, with_weights};
use nalgebra::Matrix3;
use std::ops::Range;

/// Lines of a field.
const SHAPES: usize = 3;

/// See the module's text.
pub struct Fields<T> {
    /// Number of fields.
    pub n: usize,
    lines: Vec<Line<T>>,
}

/// Three numbers of each vertex of a block.
pub type Rows<T> = [Line<T>; 3];

/// Lanes' sums: ΦᵀF for each mode as [`Block::project_linear`] takes them, and the nine of Σ F bᵀ for each field, row by row.
#[derive(Clone)]
pub struct Sums<T> {
    /// Modes.
    pub modes: Vec<[Line<T>; 2]>,
    /// Fields.
    pub fields: Vec<[[Line<T>; 3]; 3]>,
}

impl<T: Real> Sums<T> {
    /// Zeros.
    pub fn new(modes: usize, fields: usize) -> Self {
        Self { modes: vec![Default::default(); modes], fields: vec![Default::default(); fields] }
    }
}

impl<T: Real> Fields<T> {
    /// From fields over the vertices (n_vertices each).
    pub fn new(fields: &[Vec<Vec3>], n_vertices: usize) -> Result<Self> {
        let n = fields.len();
        let mut lines: Vec<Line<T>> =
            try_zeroed("the rotation-strain fields", n_vertices.div_ceil(LANES) * SHAPES * n)?;
        for (k, field) in fields.iter().enumerate() {
            for (v, b) in field.iter().enumerate() {
                let first = (v / LANES * n + k) * SHAPES;
                (0..3).for_each(|c| lines[first + c].0[v % LANES] = T::of(b[c]));
            }
        }
        Ok(Self { n, lines })
    }

    /// Field `k` at a vertex.
    pub fn at(&self, k: usize, v: usize) -> Vec3 {
        let first = (v / LANES * self.n + k) * SHAPES;
        Vec3::from_fn(|c, _| self.lines[first + c].0[v % LANES].to_f64())
    }

    /// Whether all of it are numbers.
    pub fn is_finite(&self) -> bool {
        self.lines.iter().all(|line| line.0.iter().all(|x| x.to_f64().is_finite()))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line<T>>()
    }

    /// Hands the first vertex of each of `blocks`, u and the rest positions to `visit`; `factors` are N of each field.
    pub fn displacements<E: Entry<Real = T>>(
        &self,
        basis: &Basis<E>,
        blocks: Range<usize>,
        (q, factors): (&[f64], &[Matrix3<f64>]),
        visit: impl FnMut(usize, &Rows<T>, &Rows<T>),
    ) {
        let mut room = [[[T::default(); 3]; 3]; MOST_SAMPLES];
        for (to, from) in room.iter_mut().zip(factors) {
            *to = std::array::from_fn(|c| std::array::from_fn(|d| T::of(from[(c, d)])));
        }
        let factors = &room[..self.n];
        with_weights(basis, q, |weights| {
            let rows = [Line::default(); 3];
            let mut all = Displacements { fields: self, weights, factors, first: 0, u: rows, rest: rows, visit };
            sweep_blocks(basis, blocks, &mut all);
        });
    }

    /// Adds the forces on the vertices of block `b` to the sums.
    pub fn project<E: Entry<Real = T>>(&self, basis: &Basis<E>, b: usize, force: &Rows<T>, sums: &mut Sums<T>) {
        sweep_blocks(basis, b..b + 1, &mut Projection { fields: self, force, sums });
    }

    #[inline(always)]
    fn block(&self, first: usize) -> &[Line<T>] {
        &self.lines[first / LANES * SHAPES * self.n..][..SHAPES * self.n]
    }
}

struct Displacements<'a, T: Real, V> {
    fields: &'a Fields<T>,
    weights: Weights<'a, T>,
    factors: &'a [[[T; 3]; 3]],
    first: usize,
    u: Rows<T>,
    rest: Rows<T>,
    visit: V,
}

impl<E: Entry, V: FnMut(usize, &Rows<E::Real>, &Rows<E::Real>)> Sweep<E> for Displacements<'_, E::Real, V> {
    #[inline(always)]
    fn visit<S: Kind, const N: usize>(
        &mut self,
        lanes: Lanes<E::Real, S, N>,
        block: Block<E>,
        first: usize,
        at: usize,
    ) {
        let mut u = block.combine_linear(lanes, at, self.weights);
        for (lines, factors) in self.fields.block(first).chunks_exact(SHAPES).zip(self.factors) {
            for d in 0..3 {
                let b = lanes.load(&lines[d].0, at);
                for c in 0..3 {
                    u[c] = lanes.mul_add(lanes.repeat(factors[c][d]), b, u[c]);
                }
            }
        }
        let rest = block.rest(lanes, at);
        for c in 0..3 {
            lanes.store(u[c], &mut self.u[c].0, at);
            lanes.store(rest[c], &mut self.rest[c].0, at);
        }
        self.first = first / LANES * LANES;
    }

    fn end_block(&mut self) {
        (self.visit)(self.first, &self.u, &self.rest);
    }
}

struct Projection<'a, T: Real> {
    fields: &'a Fields<T>,
    force: &'a Rows<T>,
    sums: &'a mut Sums<T>,
}

impl<E: Entry> Sweep<E> for Projection<'_, E::Real> {
    #[inline(always)]
    fn visit<S: Kind, const N: usize>(
        &mut self,
        lanes: Lanes<E::Real, S, N>,
        block: Block<E>,
        first: usize,
        at: usize,
    ) {
        let Self { fields, force, sums } = self;
        let f = [lanes.load(&force[0].0, at), lanes.load(&force[1].0, at), lanes.load(&force[2].0, at)];
        block.project_linear(lanes, at, &f, &mut sums.modes);
        for (lines, sums) in fields.block(first).chunks_exact(SHAPES).zip(&mut sums.fields) {
            for d in 0..3 {
                let b = lanes.load(&lines[d].0, at);
                for c in 0..3 {
                    let sum = lanes.mul_add(f[c], b, lanes.load(&sums[c][d].0, at));
                    lanes.store(sum, &mut sums[c][d].0, at);
                }
            }
        }
    }
}

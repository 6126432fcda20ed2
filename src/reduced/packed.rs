//! The fields in 16 bits of a unit that each has, for output alone: positions pass over half the memory. Loads, constraints and energies go
//! by [`Fields`](super::Fields), so that what is rounded here is only seen.
//!
//! A block of [`LANES`] vertices has the rest positions x y z and three lines for two fields, as Φ and Ψ of a mode are packed
//! ([`Entry`] of [`I16`]). A pass leaves out pairs of fields whose part in the shape is less than its rounding.

use super::fields::{HEADER, placed_rows};
use crate::Vec3;
use crate::arithmetic::Arithmetic;
use crate::error::{Result, try_zeroed};
use crate::real::Real;
use crate::warp::lanes::{Fused, Kind, Lanes, Unfused, Vectors};
use crate::warp::{Entry, I16, LANES, Line, Placement};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Lines of two fields.
const PAIR: usize = I16::LINES;
/// Pairs at most.
const MAX_PAIRS: usize = super::MAX_FIELDS.div_ceil(2);

/// See the module's text.
#[derive(Clone)]
pub struct PackedFields {
    n: usize,
    n_vertices: usize,
    arch: Arch,
    fused: bool,
    /// Shared by copies of other arithmetic.
    lines: Arc<Vec<Line<f32>>>,
    /// Of each field, what an entry of one stands for, and the furthest that one unit of it moves a vertex.
    units: Vec<f64>,
    reach: Vec<f64>,
}

/// Pairs that a pass visits: where their lines begin in a block, and their amplitudes in units.
struct Pass {
    pairs: [(usize, [f64; 2]); MAX_PAIRS],
    used: usize,
}

impl PackedFields {
    /// Of fields (fields × n_vertices) on vertices at `rest`.
    pub fn new(rest: &[Vec3], columns: &[Vec<Vec3>]) -> Result<Self> {
        let (n, n_vertices) = (columns.len(), rest.len());
        let size = HEADER + PAIR * n.div_ceil(2);
        let mut lines: Vec<Line<f32>> = try_zeroed("the reduced basis in 16 bits", n_vertices.div_ceil(LANES) * size)?;
        let of_largest = |column: &Vec<Vec3>| I16::unit(column.iter().map(Vec3::amax).fold(0.0, f64::max));
        let units: Vec<f64> = columns.iter().map(of_largest).collect();
        let reach = columns.iter().map(|column| column.iter().map(|u| u.norm()).fold(0.0, f64::max)).collect();
        for (v, x) in rest.iter().enumerate() {
            let (block, lane) = (&mut lines[v / LANES * size..][..size], v % LANES);
            (0..3).for_each(|c| block[c].0[lane] = x[c] as f32);
            for (pair, lines) in block[HEADER..].chunks_exact_mut(PAIR).enumerate() {
                let entry = |k: usize, c: usize| columns.get(k).map_or(0.0, |column| column[v][c] / units[k]);
                let entries = std::array::from_fn(|i| I16::encode(entry(2 * pair + i / 3, i % 3)));
                I16::set_entries(lines, lane, entries);
            }
        }
        let lines = Arc::new(lines);
        Ok(Self { n, n_vertices, arch: Arch::new(), fused: true, lines, units, reach })
    }

    /// The same numbers in the same memory, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, arithmetic: Arithmetic) -> Self {
        let (lines, units, reach) = (self.lines.clone(), self.units.clone(), self.reach.clone());
        Self { fused: arithmetic.fused(), lines, units, reach, ..*self }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line<f32>>() + 16 * self.n
    }

    /// The furthest that any vertex is from where the fields themselves put it, but for rounding of f32: each entry is rounded by half a step,
    /// and what is left out is as much at most.
    pub fn bound(&self, q: &[f64]) -> f64 {
        2.0 * self.rounding(q)
    }

    /// Fields that a pass visits.
    pub fn n_used(&self, q: &[f64]) -> usize {
        (2 * self.pass(q).used).min(self.n)
    }

    fn rounding(&self, q: &[f64]) -> f64 {
        let half = 3f64.sqrt() * 0.5 / 65536.0;
        q.iter().zip(&self.units).map(|(q, unit)| q.abs() * unit * half).sum()
    }

    /// The pairs that count.
    fn pass(&self, q: &[f64]) -> Pass {
        let part = |k: usize| q.get(k).map_or(0.0, |q| q.abs() * self.reach[k]);
        let mut parts = [(0.0, 0); MAX_PAIRS];
        let count = self.n.div_ceil(2);
        for (pair, of) in parts[..count].iter_mut().enumerate() {
            *of = (part(2 * pair) + part(2 * pair + 1), pair);
        }
        let mut order = parts;
        order[..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut left, mut used) = (self.rounding(q), [true; MAX_PAIRS]);
        for (part, pair) in &order[..count] {
            left -= part;
            if left < 0.0 {
                break;
            }
            used[*pair] = false;
        }
        let mut pass = Pass { pairs: [(0, [0.0; 2]); MAX_PAIRS], used: 0 };
        let amplitude = |k: usize| q.get(k).map_or(0.0, |q| q * self.units.get(k).copied().unwrap_or(0.0));
        for pair in (0..count).filter(|pair| used[*pair]) {
            pass.pairs[pass.used] = (HEADER + PAIR * pair, [amplitude(2 * pair), amplitude(2 * pair + 1)]);
            pass.used += 1;
        }
        pass
    }

    /// As [`super::Fields::positions_f32`].
    pub fn positions_f32(&self, q: &[f64], placement: &Placement, mut write: impl FnMut(usize, &[[f32; 3]])) {
        let rows = placed_rows(placement);
        let (pass, blocks) = (self.pass(q), 0..self.n_vertices.div_ceil(LANES));
        self.sweep(&pass, blocks, &mut |first, u: &[Line<f32>; 3], rest: &[Line<f32>]| {
            write(first, &rows(u, rest)[..LANES.min(self.n_vertices - first)]);
        });
    }

    /// As [`super::Fields::positions_of_f32`].
    pub fn positions_of_f32(
        &self,
        q: &[f64],
        placement: &Placement,
        vertices: &[u32],
        mut write: impl FnMut(usize, [f32; 3]),
    ) {
        let (rows, pass) = (placed_rows(placement), self.pass(q));
        let mut last: Option<(usize, [[f32; 3]; LANES])> = None;
        for (i, v) in vertices.iter().map(|v| *v as usize).enumerate() {
            let block = v / LANES;
            if last.is_none_or(|(held, _)| held != block) {
                self.sweep(&pass, block..block + 1, &mut |_, u: &[Line<f32>; 3], rest: &[Line<f32>]| {
                    last = Some((block, rows(u, rest)));
                });
            }
            if let Some((_, rows)) = &last {
                write(i, rows[v % LANES]);
            }
        }
    }

    /// Hands the first vertex of each of `blocks`, u and the rest positions to `visit`.
    fn sweep(&self, pass: &Pass, blocks: Range<usize>, visit: &mut impl FnMut(usize, &[Line<f32>; 3], &[Line<f32>])) {
        self.arch.dispatch(Sweep { fields: self, pairs: &pass.pairs[..pass.used], blocks, visit });
    }
}

struct Sweep<'a, V> {
    fields: &'a PackedFields,
    pairs: &'a [(usize, [f64; 2])],
    blocks: Range<usize>,
    visit: &'a mut V,
}

impl<V: FnMut(usize, &[Line<f32>; 3], &[Line<f32>])> WithSimd for Sweep<'_, V> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.fields.fused {
            true => self.by::<Fused<S>>(simd),
            false => self.by::<Unfused<S>>(simd),
        }
    }
}

impl<V: FnMut(usize, &[Line<f32>; 3], &[Line<f32>])> Sweep<'_, V> {
    #[inline(always)]
    fn by<S: Kind>(self, simd: S::Simd) {
        match size_of::<Line<f32>>() / size_of::<<f32 as Real>::Register<S::Simd>>() {
            2 => self.run::<S, 2>(simd),
            4 => self.run::<S, 4>(simd),
            _ => self.run::<S, 1>(simd), // one register at a time
        }
    }

    #[inline(always)]
    fn run<S: Kind, const N: usize>(self, simd: S::Simd) {
        let lanes = Lanes::<f32, S, N>::new(simd);
        let Self { fields, pairs, blocks, visit } = self;
        let mut u = [Line::default(); 3];
        let size = HEADER + PAIR * fields.n.div_ceil(2);
        for b in blocks {
            let lines = &fields.lines[b * size..(b + 1) * size];
            for at in (0..LANES / lanes.width()).map(|group| group * N) {
                let mut sum: Vectors<f32, S, N> = [lanes.splat(0.0); 3];
                for (first, [own, other]) in pairs {
                    let two = &lines[*first..*first + PAIR];
                    let (own, other) = (lanes.splat(*own), lanes.splat(*other));
                    let (field, next) = (I16::phi(lanes, two, at), I16::psi(lanes, two, at));
                    sum = lanes.scale_add(other, &next, &lanes.scale_add(own, &field, &sum));
                }
                (0..3).for_each(|c| lanes.store(sum[c], &mut u[c].0, at));
            }
            visit(b * LANES, &u, &lines[..HEADER]);
        }
    }
}

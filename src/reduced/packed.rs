//! The fields in 16 bits of a unit that each has, for output alone: positions pass over half the memory. Loads, constraints and energies go
//! by [`Fields`](super::Fields), so that what is rounded here is only seen.
//!
//! A block of [`LANES`] vertices has three lines for two fields: a word for x, y and z of each vertex, which holds both. Amplitudes are
//! rounded to 16 bits as well, and what that leaves, finer, to 16 bits more, each so that sums of all products fit in 32 bits. So sums are
//! exact, and the same by all instructions. A pass leaves out pairs of fields whose part in the shape is less than its rounding.

use super::pair_sums::{Plain, Products, word};
use super::placed::{Kept, Placed, Rows, Visit, rows_of};
use crate::Vec3;
use crate::error::{Result, try_zeroed};
use crate::warp::{LANES, Line, Placement};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Lines of the rest positions and of two fields.
const SHAPES: usize = 3;
/// Pairs at most.
const MAX_PAIRS: usize = super::MAX_FIELDS.div_ceil(2);
/// A field's largest number as it is stored.
const FULL: f64 = i16::MAX as f64;
/// Magnitudes of all amplitudes together, at most: as many times FULL fit in 32 bits with their sign.
const ALL: f64 = 65536.0;
/// The finest that an amplitude is told in, in units of its whole part: halves of it fit in 16 bits.
const FINEST: f64 = 32768.0;

/// See the module's text.
#[derive(Clone)]
pub struct PackedFields {
    /// The registers that sweeps run in: the processor's widest unless set. All give the same bits.
    pub arch: Arch,
    n: usize,
    n_vertices: usize,
    /// Shared by copies.
    rest: Arc<Vec<Line<f32>>>,
    words: Arc<Vec<Line<u32>>>,
    /// The largest number of each field, and the furthest that one unit of it moves a vertex.
    largest: Vec<f64>,
    reach: Vec<f64>,
}

/// Pairs that a pass visits.
struct Pass {
    /// Where their lines begin in a block, and the words of the whole and of the fine parts of their amplitudes.
    pairs: [(usize, [u32; 2]); MAX_PAIRS],
    used: usize,
    /// What a sum of one stands for, of whole and of fine parts.
    scales: [f64; 2],
    /// The furthest that any vertex is off for the rounding of amplitudes.
    off: f64,
}

impl PackedFields {
    /// Of fields (fields × n_vertices) on vertices at `rest`.
    pub fn new(rest: &[Vec3], columns: &[Vec<Vec3>]) -> Result<Self> {
        let (n, n_vertices) = (columns.len(), rest.len());
        let (blocks, size) = (n_vertices.div_ceil(LANES), SHAPES * n.div_ceil(2));
        let mut places: Vec<Line<f32>> = try_zeroed("the rest positions", blocks * SHAPES)?;
        let mut words: Vec<Line<u32>> = try_zeroed("the reduced basis in 16 bits", blocks * size)?;
        let largest: Vec<f64> =
            columns.iter().map(|column| column.iter().map(Vec3::amax).fold(0.0, f64::max)).collect();
        let reach = columns.iter().map(|column| column.iter().map(|u| u.norm()).fold(0.0, f64::max)).collect();
        let number = |k: usize, v: usize, c: usize| match largest.get(k) {
            Some(largest) if *largest > 0.0 => (columns[k][v][c] / largest * FULL).round() as i16,
            _ => 0,
        };
        for (v, x) in rest.iter().enumerate() {
            let (block, lane) = (v / LANES, v % LANES);
            for (i, line) in words[block * size..][..size].iter_mut().enumerate() {
                let (first, c) = (2 * (i / SHAPES), i % SHAPES);
                line.0[lane] = word([number(first, v, c), number(first + 1, v, c)]);
            }
            (0..SHAPES).for_each(|c| places[block * SHAPES + c].0[lane] = x[c] as f32);
        }
        let (rest, words) = (Arc::new(places), Arc::new(words));
        Ok(Self { arch: Arch::new(), n, n_vertices, rest, words, largest, reach })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of::<Line<u32>>() * (self.rest.len() + self.words.len()) + 16 * self.n
    }

    /// The furthest that any vertex is from where the fields themselves put it, but for rounding of f32: each number of a field is rounded by half
    /// a step, what is left out is as much at most, and amplitudes are rounded.
    pub fn bound(&self, q: &[f64]) -> f64 {
        2.0 * self.rounding(q) + self.pass(q).off
    }

    /// Fields that a pass visits.
    pub fn n_used(&self, q: &[f64]) -> usize {
        (2 * self.pass(q).used).min(self.n)
    }

    fn rounding(&self, q: &[f64]) -> f64 {
        let half = 3f64.sqrt() * 0.5 / FULL;
        q.iter().zip(&self.largest).map(|(q, largest)| q.abs() * largest * half).sum()
    }

    /// The pairs that count, with their amplitudes.
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
        self.rounded(q, |pair| used[pair])
    }

    /// A pass over some pairs.
    fn rounded(&self, q: &[f64], used: impl Fn(usize) -> bool) -> Pass {
        let mut pass = Pass { pairs: [(0, [0; 2]); MAX_PAIRS], used: 0, scales: [0.0; 2], off: 0.0 };
        let amplitude = |k: usize| q.get(k).map_or(0.0, |q| q * self.largest[k]);
        let (mut most, mut sum) = (0f64, 0.0);
        for pair in (0..self.n.div_ceil(2)).filter(|pair| used(*pair)) {
            pass.pairs[pass.used].0 = pair;
            pass.used += 1;
            for size in [amplitude(2 * pair).abs(), amplitude(2 * pair + 1).abs()] {
                most = most.max(size);
                sum += size;
            }
        }
        // Rounding adds half to each whole part at most.
        let numbers = 2.0 * pass.used as f64;
        let unit = (most / FULL).max(sum / (ALL - 0.5 * numbers));
        if unit < f64::MIN_POSITIVE {
            pass.used = 0; // too little to see
            return pass;
        }
        let finer = (0..16).map(|bits| FINEST / f64::from(1 << bits)).find(|finer| numbers * finer <= 2.0 * ALL);
        let finer = finer.unwrap_or(1.0);
        pass.scales = [unit / FULL, unit / (FULL * finer)];
        for (first, words) in &mut pass.pairs[..pass.used] {
            let two = [0, 1].map(|i| {
                let k = 2 * *first + i;
                let exact = amplitude(k) / unit;
                let whole = exact.round();
                let fine = ((exact - whole) * finer).round();
                pass.off += (exact - whole - fine / finer).abs() * unit * 3f64.sqrt();
                [whole as i16, fine as i16]
            });
            *words = [word([two[0][0], two[1][0]]), word([two[0][1], two[1][1]])];
            *first *= SHAPES;
        }
        pass
    }

    /// As [`super::Fields::positions_f32`].
    pub fn positions_f32(&self, q: &[f64], placement: &Placement, write: impl FnMut(usize, &[[f32; 3]])) {
        let blocks = 0..self.n_vertices.div_ceil(LANES);
        let rows = &mut Rows { n_vertices: self.n_vertices, placed: Placed::by(placement), write };
        self.sweep(&self.pass(q), blocks, rows);
    }

    /// As [`super::Fields::positions_of_f32`].
    pub fn positions_of_f32(
        &self,
        q: &[f64],
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        let pass = self.pass(q);
        rows_of(vertices, |block| Kept::of(placement, |kept| self.sweep(&pass, block, kept)), write);
    }

    /// Hands the first vertex of each of `blocks`, u and the rest positions to `visit`.
    fn sweep(&self, pass: &Pass, blocks: Range<usize>, visit: &mut impl Visit<f32>) {
        let sweep = Sweep { fields: self, pass, blocks, visit };
        match self.arch {
            #[cfg(target_arch = "x86_64")]
            Arch::V4(simd) => simd.vectorize(On(simd, sweep)),
            #[cfg(target_arch = "x86_64")]
            Arch::V3(simd) => simd.vectorize(On(simd, sweep)),
            arch => arch.dispatch(sweep),
        }
    }
}

struct Sweep<'a, V> {
    fields: &'a PackedFields,
    pass: &'a Pass,
    blocks: Range<usize>,
    visit: &'a mut V,
}

/// On an instruction set that has such products.
#[cfg(target_arch = "x86_64")]
struct On<S, W>(S, W);

#[cfg(target_arch = "x86_64")]
impl<S: Simd + Products, V: Visit<f32>> pulp::NullaryFnOnce for On<S, Sweep<'_, V>> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.1.run(self.0, self.0);
    }
}

impl<V: Visit<f32>> WithSimd for Sweep<'_, V> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.run(simd, Plain);
    }
}

impl<V: Visit<f32>> Sweep<'_, V> {
    #[inline(always)]
    fn run<S: Simd, P: Products>(self, simd: S, products: P) {
        let Self { fields, pass, blocks, visit } = self;
        let pairs = &pass.pairs[..pass.used];
        let scales = pass.scales.map(|scale| scale as f32);
        let size = SHAPES * fields.n.div_ceil(2);
        let mut u = [Line::default(); 3];
        for b in blocks {
            let lines = &fields.words[b * size..][..size];
            let mut sums = [[products.zero(); 2]; 3];
            for (first, [by, finer]) in pairs {
                let two = &lines[*first..*first + SHAPES];
                let (by, finer) = (products.factor(*by), products.factor(*finer));
                for c in 0..3 {
                    sums[c][0] = products.add(sums[c][0], &two[c], by);
                    sums[c][1] = products.add(sums[c][1], &two[c], finer);
                }
            }
            for c in 0..3 {
                products.scaled(sums[c], scales, &mut u[c]);
            }
            visit.visit(simd, b * LANES, &u, &fields.rest[b * SHAPES..][..SHAPES]);
        }
    }
}

//! The run-time fields B in blocks of [`LANES`] vertices: a header, the rest positions x y z, and three lines for each field.
//! u = Bq is one pass from front to back. As in [`crate::warp::Basis`], stored values are B √M, with M the total mass.

use super::placed::{Kept, Placed, Rows, Visit, rows_of};
use crate::Vec3;
use crate::arithmetic::Arithmetic;
use crate::error::{Result, try_zeroed};
use crate::real::Real;
use crate::warp::lanes::{Fused, Kind, Lanes, Unfused, Vectors};
use crate::warp::{LANES, Line, Placement};
use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Lines before the fields, and of a field.
const HEADER: usize = 3;
const SHAPES: usize = 3;

/// Modes and further fields together, at most: the dense work of a step grows with the square.
pub const MAX_FIELDS: usize = 128;

/// See the module's text.
#[derive(Clone)]
pub struct Fields<T> {
    /// Number of fields.
    pub n: usize,
    n_vertices: usize,
    root_mass: f64,
    arch: Arch,
    /// As of [`crate::warp::Basis`].
    fused: bool,
    /// Shared by copies of other arithmetic.
    lines: Arc<Vec<Line<T>>>,
}

impl<T: Real> Fields<T> {
    /// `n` fields that are zero, on vertices at `rest`.
    pub fn new(rest: &[Vec3], n: usize, total_mass: f64) -> Result<Self> {
        let n_vertices = rest.len();
        let lines = try_zeroed("the reduced basis", n_vertices.div_ceil(LANES) * (HEADER + SHAPES * n))?;
        let (arch, lines) = (Arch::new(), Arc::new(lines));
        let mut fields = Self { n, n_vertices, root_mass: total_mass.sqrt(), arch, fused: true, lines };
        for (v, x) in rest.iter().enumerate() {
            let first = fields.first_line(v);
            let lines = fields.lines_mut();
            (0..3).for_each(|c| lines[first + c].0[v % LANES] = T::of(x[c]));
        }
        Ok(fields)
    }

    /// The same numbers in the same memory, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, arithmetic: Arithmetic) -> Self {
        Self { fused: arithmetic.fused(), lines: self.lines.clone(), ..*self }
    }

    /// While nothing shares them.
    fn lines_mut(&mut self) -> &mut [Line<T>] {
        Arc::get_mut(&mut self.lines).expect("fields are filled before they are shared")
    }

    fn first_line(&self, v: usize) -> usize {
        v / LANES * (HEADER + SHAPES * self.n)
    }

    /// Stores one field (n_vertices).
    pub fn set(&mut self, k: usize, field: &[Vec3]) {
        for (v, u) in field.iter().enumerate() {
            self.set_stored(k, v, (u * self.root_mass).data.0[0].map(T::of));
        }
    }

    /// Field `k` at a vertex.
    pub fn at(&self, k: usize, v: usize) -> Vec3 {
        Vec3::from(self.stored(k, v).map(|x| x.to_f64() / self.root_mass))
    }

    /// B √M as it is stored.
    pub fn stored(&self, k: usize, v: usize) -> [T; 3] {
        let first = self.first_line(v) + HEADER + SHAPES * k;
        std::array::from_fn(|c| self.lines[first + c].0[v % LANES])
    }

    /// Stores what [`Fields::stored`] gave.
    pub fn set_stored(&mut self, k: usize, v: usize, numbers: [T; 3]) {
        let first = self.first_line(v) + HEADER + SHAPES * k;
        let lines = self.lines_mut();
        (0..3).for_each(|c| lines[first + c].0[v % LANES] = numbers[c]);
    }

    /// Whether all of it are numbers.
    pub fn is_finite(&self) -> bool {
        self.lines.iter().all(|line| line.0.iter().all(|x| x.to_f64().is_finite()))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line<T>>()
    }

    /// Hands the displacements u = Bq of all vertices to `visit`, in order.
    pub fn displacements(&self, q: &[f64], mut visit: impl FnMut(usize, Vec3)) {
        self.sweep(q, self.blocks(), &mut |first, u: &[Line<T>; 3], _: &[Line<T>]| {
            let rows = wide_rows(u);
            (0..LANES.min(self.n_vertices - first)).for_each(|i| visit(first + i, rows[i]));
        });
    }

    /// As [`Fields::displacements`], of `vertices` alone: the place in the list, and u.
    pub fn displacements_of(&self, q: &[f64], vertices: &[u32], visit: impl FnMut(usize, Vec3)) {
        let rows = |block: Range<usize>| {
            let mut rows = [Vec3::zeros(); LANES];
            self.sweep(q, block, &mut |_, u: &[Line<T>; 3], _: &[Line<T>]| rows = wide_rows(u));
            rows
        };
        rows_of(vertices, rows, visit);
    }

    /// As [`Fields::displacements`], with those of `q_dot` beside.
    pub fn motion(&self, q: &[f64], q_dot: &[f64], visit: &mut impl FnMut(usize, Vec3, Vec3)) {
        for v in 0..self.n_vertices {
            let mut sums = [Vec3::zeros(); 2];
            for k in 0..self.n {
                let field = self.at(k, v);
                sums[0] += q[k] * field;
                sums[1] += q_dot[k] * field;
            }
            visit(v, sums[0], sums[1]);
        }
    }

    /// Hands the positions of all vertices to `write` as f32, some rows at a time, computed in T throughout.
    pub fn positions_f32(&self, q: &[f64], placement: &Placement, write: impl FnMut(usize, &[[f32; 3]])) {
        self.sweep(q, self.blocks(), &mut Rows { n_vertices: self.n_vertices, placed: Placed::by(placement), write });
    }

    /// As [`Fields::positions_f32`], of `vertices` alone: the place in the list, and the row.
    pub fn positions_of_f32(
        &self,
        q: &[f64],
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        rows_of(vertices, |block| Kept::of(placement, |kept| self.sweep(q, block, kept)), write);
    }

    /// Adds Bᵀf √M to `out`, in f64.
    pub fn project(&self, forces: &[Vec3], out: &mut [f64]) {
        let block = HEADER + SHAPES * self.n;
        for (forces, lines) in forces.chunks(LANES).zip(self.lines.chunks_exact(block)) {
            for (out, lines) in out.iter_mut().zip(lines[HEADER..].chunks_exact(SHAPES)) {
                let mut sum = 0.0;
                for (i, f) in forces.iter().enumerate() {
                    (0..3).for_each(|c| sum += lines[c].0[i].to_f64() * f[c]);
                }
                *out += sum / self.root_mass;
            }
        }
    }

    /// Adds Σ f bᵀ of every field to `out`, in f64.
    pub fn project_moments(&self, forces: &[Vec3], out: &mut [Matrix3<f64>]) {
        let block = HEADER + SHAPES * self.n;
        for (forces, lines) in forces.chunks(LANES).zip(self.lines.chunks_exact(block)) {
            for (out, lines) in out.iter_mut().zip(lines[HEADER..].chunks_exact(SHAPES)) {
                for (c, line) in lines.iter().enumerate() {
                    let along = |sum: Vec3, (i, f): (usize, &Vec3)| sum + line.0[i].to_f64() * f;
                    let sum = forces.iter().enumerate().fold(Vec3::zeros(), along) / self.root_mass;
                    (0..3).for_each(|a| out[(a, c)] += sum[a]);
                }
            }
        }
    }

    fn blocks(&self) -> Range<usize> {
        0..self.n_vertices.div_ceil(LANES)
    }

    /// Hands the first vertex of each of `blocks`, u and the rest positions to `visit`.
    fn sweep(&self, q: &[f64], blocks: Range<usize>, visit: &mut impl Visit<T>) {
        self.arch.dispatch(Sweep { fields: self, q, blocks, visit });
    }
}

fn wide_rows<T: Real>(u: &[Line<T>; 3]) -> [Vec3; LANES] {
    std::array::from_fn(|i| Vec3::from_fn(|c, _| u[c].0[i].to_f64()))
}

struct Sweep<'a, T, V> {
    fields: &'a Fields<T>,
    q: &'a [f64],
    blocks: Range<usize>,
    visit: &'a mut V,
}

impl<T: Real, V: Visit<T>> WithSimd for Sweep<'_, T, V> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.fields.fused {
            true => self.by::<Fused<S>>(simd),
            false => self.by::<Unfused<S>>(simd),
        }
    }
}

impl<T: Real, V: Visit<T>> Sweep<'_, T, V> {
    #[inline(always)]
    fn by<S: Kind>(self, simd: S::Simd) {
        // As many registers as a line has: so many independent sums.
        match size_of::<Line<T>>() / size_of::<T::Register<S::Simd>>() {
            1 => self.run::<S, 1>(simd),
            2 => self.run::<S, 2>(simd),
            4 => self.run::<S, 4>(simd),
            _ => self.run_narrow::<S>(simd),
        }
    }

    #[inline(always)]
    fn run<S: Kind, const N: usize>(self, simd: S::Simd) {
        let lanes = Lanes::<T, S, N>::new(simd);
        self.combined(simd, |shapes, q, u: &mut [Line<T>; 3]| {
            let mut sum: Vectors<T, S, N> = [lanes.splat(0.0); 3];
            for (lines, q) in shapes.chunks_exact(SHAPES).zip(q) {
                let q = lanes.splat(*q);
                (0..3).for_each(|c| sum[c] = lanes.mul_add(q, lanes.load(&lines[c].0, 0), sum[c]));
            }
            (0..3).for_each(|c| lanes.store(sum[c], &mut u[c].0, 0));
        });
    }

    /// One register at a time, where a line has very many.
    #[inline(always)]
    fn run_narrow<S: Kind>(self, simd: S::Simd) {
        let lanes = Lanes::<T, S, 1>::new(simd);
        self.combined(simd, |shapes, q, u: &mut [Line<T>; 3]| {
            for at in 0..LANES / lanes.width() {
                let mut sum: Vectors<T, S, 1> = [lanes.splat(0.0); 3];
                for (lines, q) in shapes.chunks_exact(SHAPES).zip(q) {
                    let q = lanes.splat(*q);
                    (0..3).for_each(|c| sum[c] = lanes.mul_add(q, lanes.load(&lines[c].0, at), sum[c]));
                }
                (0..3).for_each(|c| lanes.store(sum[c], &mut u[c].0, at));
            }
        });
    }

    #[inline(always)]
    fn combined<S: Simd>(self, simd: S, combine: impl Fn(&[Line<T>], &[f64], &mut [Line<T>; 3])) {
        let Self { fields, q, blocks, visit } = self;
        let mut u = [Line::default(); 3];
        let mut scaled = [0.0; MAX_FIELDS];
        scaled.iter_mut().zip(q).for_each(|(s, q)| *s = q / fields.root_mass);
        let size = HEADER + SHAPES * fields.n;
        for b in blocks {
            let lines = &fields.lines[b * size..(b + 1) * size];
            combine(&lines[HEADER..], &scaled, &mut u);
            visit.visit(simd, b * LANES, &u, &lines[..HEADER]);
        }
    }
}

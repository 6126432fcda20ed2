//! The run-time basis: Φ and Ψ in blocks of [`LANES`] vertices. A block is a header, the share of the mass and the rest
//! position, and per mode six lines Φx Φy Φz Ψx Ψy Ψz, a lane for each vertex, so that a step reads memory once from front to
//! back, in registers of any width. A basis for linear modal analysis alone leaves out the lines of Ψ.
//!
//! Stored values are dimensionless, Φ √M and Ψ √M with M the total mass, and amplitudes are divided by √M when they meet
//! the basis: any unit of mass stays within the range of f32.

use super::LANES;
use super::lanes::{Group, Lanes, Vectors};
use crate::Vec3;
use crate::error::{Result, try_zeroed};
use crate::real::Real;
use pulp::{Arch, Simd};
use std::ops::Range;

/// One number for each vertex of a block, on a cache line of its own.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Line<T>(pub [T; LANES]);

/// Lines before the modes: m/M, then x, y, z of the rest position.
const HEADER: usize = 4;
/// Lines of a mode with Φ and Ψ, and with Φ alone.
const SHAPES: usize = 6;
const LINEAR_SHAPES: usize = 3;

/// Φ and Ψ of all vertices, with what loads need to know of them.
pub struct Basis<T> {
    /// Number of modes.
    pub modes: usize,
    /// Number of vertices; the last block is padded with zeros.
    pub n_vertices: usize,
    /// The registers that sweeps run in: the processor's widest unless set. Each kind gives its own bits, the same every time;
    /// between kinds the last bits differ.
    pub arch: Arch,
    root_mass: f64,
    /// Lines of a mode.
    shapes: usize,
    lines: Vec<Line<T>>,
}

/// One block.
#[derive(Clone, Copy)]
pub struct Block<'a, T> {
    header: &'a [Line<T>],
    shapes: &'a [Line<T>],
    /// Of a mode.
    lines: usize,
    root_mass: f64,
}

impl<T: Real> Basis<T> {
    /// Without shapes yet, of vertices at `rest` that have the shares `mass` of the mass `total_mass`.
    pub fn new(rest: &[Vec3], mass: &[f64], modes: usize, total_mass: f64) -> Result<Self> {
        Self::with_shapes(rest, mass, (modes, SHAPES), total_mass)
    }

    /// As [`Basis::new`], with room for Φ alone.
    pub fn linear(rest: &[Vec3], mass: &[f64], modes: usize, total_mass: f64) -> Result<Self> {
        Self::with_shapes(rest, mass, (modes, LINEAR_SHAPES), total_mass)
    }

    fn with_shapes(rest: &[Vec3], mass: &[f64], (modes, shapes): (usize, usize), total_mass: f64) -> Result<Self> {
        let n_vertices = rest.len();
        let lines = try_zeroed("the run-time basis", n_vertices.div_ceil(LANES) * (HEADER + shapes * modes))?;
        let mut basis = Self { modes, n_vertices, arch: Arch::new(), root_mass: total_mass.sqrt(), shapes, lines };
        for (v, (x, m)) in rest.iter().zip(mass).enumerate() {
            let (line, lane) = basis.place(v);
            let header = [m / total_mass, x.x, x.y, x.z];
            header.iter().enumerate().for_each(|(c, value)| basis.lines[line + c].0[lane] = T::of(*value));
        }
        Ok(basis)
    }

    /// Whether it has Φ alone.
    pub fn is_linear(&self) -> bool {
        self.shapes == LINEAR_SHAPES
    }

    /// First line of the block of vertex `v`, and its lane.
    fn place(&self, v: usize) -> (usize, usize) {
        (v / LANES * (HEADER + self.shapes * self.modes), v % LANES)
    }

    /// First line of one mode in the block of vertex `v`, and its lane.
    fn place_in(&self, mode: usize, v: usize) -> (usize, usize) {
        let (line, lane) = self.place(v);
        (line + HEADER + self.shapes * mode, lane)
    }

    /// Stores Φ and, unless left out, Ψ (n_vertices each) of one mode.
    pub fn set_mode(&mut self, mode: usize, phi: &[Vec3], psi: &[Vec3]) {
        let fields = [phi, psi];
        for v in 0..self.n_vertices {
            let (line, lane) = self.place_in(mode, v);
            for c in 0..self.shapes {
                self.lines[line + c].0[lane] = T::of(fields[c / 3][v][c % 3] * self.root_mass);
            }
        }
    }

    /// Φ and Ψ of one vertex in one mode; a Ψ that was left out is zero.
    pub fn at(&self, mode: usize, v: usize) -> (Vec3, Vec3) {
        let (line, lane) = self.place_in(mode, v);
        let read = |c: usize| self.lines[line + c].0[lane].to_f64() / self.root_mass;
        let vector =
            |c: usize| if c < self.shapes { Vec3::new(read(c), read(c + 1), read(c + 2)) } else { Vec3::zeros() };
        (vector(0), vector(3))
    }

    /// Numbers of a vertex in a mode: six with Ψ, three without.
    pub fn shapes(&self) -> usize {
        self.shapes
    }

    /// Φ√M and Ψ√M of one vertex in one mode, x y z each, as they are stored; zeros for a Ψ that was left out.
    pub fn stored(&self, mode: usize, v: usize) -> [T; SHAPES] {
        let (line, lane) = self.place_in(mode, v);
        std::array::from_fn(|c| if c < self.shapes { self.lines[line + c].0[lane] } else { T::default() })
    }

    /// Stores what [`Basis::stored`] gave.
    pub fn set_stored(&mut self, mode: usize, v: usize, numbers: [T; SHAPES]) {
        let (line, lane) = self.place_in(mode, v);
        (0..self.shapes).for_each(|c| self.lines[line + c].0[lane] = numbers[c]);
    }

    /// Whether all of it are numbers.
    pub fn is_finite(&self) -> bool {
        self.lines.iter().all(|line| line.0.iter().all(|x| x.to_f64().is_finite()))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line<T>>()
    }

    /// √M.
    pub fn root_mass(&self) -> f64 {
        self.root_mass
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> usize {
        self.n_vertices.div_ceil(LANES)
    }

    /// Some blocks, in order.
    #[inline(always)]
    pub fn blocks(&self, blocks: Range<usize>) -> impl Iterator<Item = Block<'_, T>> {
        let (root_mass, shapes_per_mode) = (self.root_mass, self.shapes);
        let size = HEADER + self.shapes * self.modes;
        self.lines[blocks.start * size..blocks.end * size].chunks_exact(size).map(move |lines| {
            let (header, shapes) = lines.split_at(HEADER);
            Block { header, shapes, lines: shapes_per_mode, root_mass }
        })
    }
}

impl<T: Real> Block<'_, T> {
    /// m/M of the vertices from register `at` on.
    #[inline(always)]
    pub fn mass<S: Simd, const N: usize>(&self, lanes: Lanes<T, S, N>, at: usize) -> Group<T, S, N> {
        lanes.load(&self.header[0].0, at)
    }

    /// Rest positions.
    #[inline(always)]
    pub fn rest<S: Simd, const N: usize>(&self, lanes: Lanes<T, S, N>, at: usize) -> Vectors<T, S, N> {
        let load = |c: usize| lanes.load(&self.header[c].0, at);
        [load(1), load(2), load(3)]
    }

    /// Φq and Ψq.
    #[inline(always)]
    pub fn combine<S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        at: usize,
        q: &[f64],
    ) -> (Vectors<T, S, N>, Vectors<T, S, N>) {
        let scale = 1.0 / self.root_mass;
        let zero = [lanes.splat(0.0); 3];
        let (mut linear, mut turn) = (zero, zero);
        for (shapes, q) in self.shapes.chunks_exact(SHAPES).zip(q) {
            let q = lanes.splat(q * scale);
            for c in 0..3 {
                linear[c] = lanes.mul_add(q, lanes.load(&shapes[c].0, at), linear[c]);
                turn[c] = lanes.mul_add(q, lanes.load(&shapes[3 + c].0, at), turn[c]);
            }
        }
        (linear, turn)
    }

    /// Φq.
    #[inline(always)]
    pub fn combine_linear<S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        at: usize,
        q: &[f64],
    ) -> Vectors<T, S, N> {
        let scale = 1.0 / self.root_mass;
        let mut linear = [lanes.splat(0.0); 3];
        for (phi, q) in self.displacements().zip(q) {
            let q = lanes.splat(q * scale);
            for c in 0..3 {
                linear[c] = lanes.mul_add(q, lanes.load(&phi[c].0, at), linear[c]);
            }
        }
        linear
    }

    /// Φx Φy Φz of each mode, whether Ψ lies between them or not.
    #[inline(always)]
    fn displacements(&self) -> impl Iterator<Item = &[Line<T>; LINEAR_SHAPES]> {
        self.shapes.chunks_exact(self.lines).map(|mode| mode.first_chunk().expect("three lines or six"))
    }

    /// Adds Φᵀg √M, lane by lane, to a line for each mode.
    #[inline(always)]
    pub fn project_linear<S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        at: usize,
        g: &Vectors<T, S, N>,
        sums: &mut [Line<T>],
    ) {
        for (phi, sum) in self.displacements().zip(sums) {
            let mut total = lanes.load(&sum.0, at);
            for c in 0..3 {
                total = lanes.mul_add(lanes.load(&phi[c].0, at), g[c], total);
            }
            lanes.store(total, &mut sum.0, at);
        }
    }

    /// As [`Block::project_linear`], where Ψ lies between.
    #[inline(always)]
    pub fn project<S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        at: usize,
        g: &Vectors<T, S, N>,
        sums: &mut [Line<T>],
    ) {
        for (shapes, sum) in self.shapes.chunks_exact(SHAPES).zip(sums) {
            let mut total = lanes.load(&sum.0, at);
            for c in 0..3 {
                total = lanes.mul_add(lanes.load(&shapes[c].0, at), g[c], total);
            }
            lanes.store(total, &mut sum.0, at);
        }
    }

    /// Adds (Φᵀg + Ψᵀg') √M, lane by lane, to a line for each mode.
    #[inline(always)]
    pub fn project_both<S: Simd, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        at: usize,
        (g, couple): (&Vectors<T, S, N>, &Vectors<T, S, N>),
        sums: &mut [Line<T>],
    ) {
        for (shapes, sum) in self.shapes.chunks_exact(SHAPES).zip(sums) {
            let mut total = lanes.load(&sum.0, at);
            for c in 0..3 {
                total = lanes.mul_add(lanes.load(&shapes[c].0, at), g[c], total);
                total = lanes.mul_add(lanes.load(&shapes[3 + c].0, at), couple[c], total);
            }
            lanes.store(total, &mut sum.0, at);
        }
    }
}

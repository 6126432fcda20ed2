//! The run-time basis: Φ and Ψ in blocks of [`LANES`] vertices. A block is a header, the share of the mass and the rest
//! position, and per mode the lines of Φx Φy Φz Ψx Ψy Ψz, a lane for each vertex, so that a step reads memory once from front to
//! back, in registers of any width.
//!
//! Stored values are dimensionless, Φ √M and Ψ √M with M the total mass, and amplitudes are divided by √M when they meet
//! the basis: any unit of mass stays within the range of f32.

use super::entry::{Entry, SHAPES};
use super::lanes::{Group, Kind, Lanes, Vectors};
use super::{LANES, doublings};
use crate::arithmetic::Arithmetic;
use crate::error::{Result, try_zeroed};
use crate::real::Real;
use crate::{Vec3, wide_norm};
use pulp::Arch;
use std::ops::Range;
use std::sync::Arc;

/// One number for each vertex of a block, on a cache line of its own.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Line<T>(pub [T; LANES]);

/// Lines before the modes: m/M, then x, y, z of the rest position.
const HEADER: usize = 4;

/// Φ and Ψ of all vertices, with what loads need to know of them.
pub struct Basis<E: Entry> {
    /// Number of modes.
    pub modes: usize,
    /// Number of vertices; the last block is padded with zeros.
    pub n_vertices: usize,
    /// The registers that sweeps run in: the processor's widest unless set.
    pub arch: Arch,
    /// Whether they multiply and add in one rounding where they can: then kinds of registers differ in the last bits.
    pub fused: bool,
    root_mass: f64,
    /// Lines of a mode.
    shapes: usize,
    /// Shared by copies of other arithmetic.
    lines: Arc<Vec<Line<E::Real>>>,
    /// What an entry of one stands for, of Φ√M and of Ψ√M (modes).
    units: Vec<[f64; 2]>,
    /// Largest |Ψ|√M (modes).
    largest_turn: Vec<f64>,
}

/// One block.
#[derive(Clone, Copy)]
pub struct Block<'a, E: Entry> {
    header: &'a [Line<E::Real>],
    shapes: &'a [Line<E::Real>],
    /// Of a mode.
    lines: usize,
}

/// Amplitudes as they meet a basis, and the [`doublings`] that its largest rotation at them needs.
#[derive(Clone, Copy)]
pub struct Weights<'a, T> {
    /// What Φ's and Ψ's entries are multiplied by (modes).
    factors: &'a [[T; 2]],
    /// See [`doublings`].
    pub doublings: u32,
}

impl<E: Entry> Basis<E> {
    /// Without shapes yet, of vertices at `rest` with masses `mass`, `total_mass` in sum.
    pub fn new(rest: &[Vec3], mass: &[f64], modes: usize, total_mass: f64) -> Result<Self> {
        Self::with_shapes(rest, mass, (modes, E::LINES), total_mass)
    }

    /// As [`Basis::new`], with room for Φ alone.
    pub fn linear(rest: &[Vec3], mass: &[f64], modes: usize, total_mass: f64) -> Result<Self> {
        Self::with_shapes(rest, mass, (modes, E::LINEAR_LINES), total_mass)
    }

    fn with_shapes(rest: &[Vec3], mass: &[f64], (modes, shapes): (usize, usize), total_mass: f64) -> Result<Self> {
        let n_vertices = rest.len();
        let lines = try_zeroed("the run-time basis", n_vertices.div_ceil(LANES) * (HEADER + shapes * modes))?;
        let (units, largest_turn) = (vec![[1.0; 2]; modes], vec![0.0; modes]);
        let root_mass = total_mass.sqrt();
        let (arch, lines) = (Arch::new(), Arc::new(lines));
        let mut basis = Self { modes, n_vertices, arch, fused: true, root_mass, shapes, lines, units, largest_turn };
        for (v, (x, m)) in rest.iter().zip(mass).enumerate() {
            let (line, lane) = basis.place(v);
            let header = [m / total_mass, x.x, x.y, x.z];
            let lines = basis.lines_mut();
            header.iter().enumerate().for_each(|(c, value)| lines[line + c].0[lane] = E::Real::of(*value));
        }
        Ok(basis)
    }

    /// The same numbers in the same memory, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, arithmetic: Arithmetic) -> Self {
        let (units, largest_turn) = (self.units.clone(), self.largest_turn.clone());
        Self { fused: arithmetic.fused(), lines: self.lines.clone(), units, largest_turn, ..*self }
    }

    /// While nothing shares them.
    fn lines_mut(&mut self) -> &mut [Line<E::Real>] {
        Arc::get_mut(&mut self.lines).expect("a basis is filled before it is shared")
    }

    /// Whether it has Φ alone.
    pub fn is_linear(&self) -> bool {
        self.shapes == E::LINEAR_LINES
    }

    /// First line of the block of vertex `v`, and its lane.
    fn place(&self, v: usize) -> (usize, usize) {
        (v / LANES * (HEADER + self.shapes * self.modes), v % LANES)
    }

    /// The lines of one mode of the block of vertex `v`, and its lane.
    fn range(&self, mode: usize, v: usize) -> (std::ops::Range<usize>, usize) {
        let (line, lane) = self.place(v);
        let first = line + HEADER + self.shapes * mode;
        (first..first + self.shapes, lane)
    }

    /// Stores Φ and, unless left out, Ψ (n_vertices each) of one mode.
    pub fn set_mode(&mut self, mode: usize, phi: &[Vec3], psi: &[Vec3]) {
        let root_mass = self.root_mass;
        let largest = |field: &[Vec3]| field.iter().map(|x| x.amax()).fold(0.0, f64::max) * root_mass;
        self.units[mode] = [E::unit(largest(phi)), E::unit(largest(psi))];
        self.largest_turn[mode] = psi.iter().map(wide_norm).fold(0.0, f64::max) * root_mass;
        let [unit, turn_unit] = self.units[mode];
        for v in 0..self.n_vertices {
            let psi = if self.is_linear() { Vec3::zeros() } else { psi[v] };
            let (phi, psi) = (phi[v] * (root_mass / unit), psi * (root_mass / turn_unit));
            let (lines, lane) = self.range(mode, v);
            let entries = [phi.x, phi.y, phi.z, psi.x, psi.y, psi.z].map(E::encode);
            E::set_entries(&mut self.lines_mut()[lines], lane, entries);
        }
    }

    /// Φ and Ψ of one vertex in one mode; a Ψ that was left out is zero.
    #[inline(always)]
    pub fn at(&self, mode: usize, v: usize) -> (Vec3, Vec3) {
        let [x, y, z, rx, ry, rz] = self.stored(mode, v).map(E::decode);
        let [unit, turn_unit] = self.units[mode].map(|unit| unit / self.root_mass);
        (Vec3::new(x, y, z) * unit, Vec3::new(rx, ry, rz) * turn_unit)
    }

    /// Numbers of a vertex in a mode: six with Ψ, three without.
    pub fn shapes(&self) -> usize {
        if self.is_linear() { SHAPES / 2 } else { SHAPES }
    }

    /// The entries of one vertex in one mode, x y z of Φ and of Ψ, as they are stored; zeros for a Ψ that was left out.
    pub fn stored(&self, mode: usize, v: usize) -> [E; SHAPES] {
        let (lines, lane) = self.range(mode, v);
        E::entries(&self.lines[lines], lane)
    }

    /// Stores what [`Basis::stored`] gave of one vertex in all modes.
    pub fn set_stored(&mut self, v: usize, modes: impl Iterator<Item = [E; SHAPES]>) {
        let ((line, lane), shapes, all) = (self.place(v), self.shapes, self.shapes * self.modes);
        let lines = self.lines_mut()[line + HEADER..][..all].chunks_exact_mut(shapes);
        lines.zip(modes).for_each(|(lines, entries)| E::set_entries(lines, lane, entries));
    }

    /// What an entry of one stands for, of Φ√M and of Ψ√M (modes).
    pub fn units(&self) -> &[[f64; 2]] {
        &self.units
    }

    /// What goes with [`Basis::set_stored`]: the units, and the largest |Ψ|√M as [`Basis::set_mode`] found it.
    pub fn set_scale(&mut self, mode: usize, units: [f64; 2], largest_turn: f64) {
        self.units[mode] = units;
        self.largest_turn[mode] = largest_turn;
    }

    /// Whether all of it are numbers.
    pub fn is_finite(&self) -> bool {
        // Without a way out within a line, which would keep it out of the registers.
        let finite = |line: &Line<E::Real>| line.0.iter().fold(true, |all, x| all & x.to_f64().is_finite());
        let read = if E::SCALED { HEADER } else { HEADER + self.shapes * self.modes };
        self.lines.chunks_exact(HEADER + self.shapes * self.modes).all(|block| block[..read].iter().all(finite))
            && self.units.iter().flatten().all(|unit| E::Real::of(*unit).to_f64().is_finite())
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line<E::Real>>()
    }

    /// Bytes of Φ and of Ψ.
    pub fn shape_bytes(&self) -> [usize; 2] {
        let all = self.n_blocks() * self.modes * self.shapes * size_of::<Line<E::Real>>();
        if self.is_linear() { [all, 0] } else { [all / 2, all / 2] }
    }

    /// √M.
    pub fn root_mass(&self) -> f64 {
        self.root_mass
    }

    /// Amplitudes q made ready, in `room` (at least as many as there are modes).
    pub fn weights<'a>(&self, q: &[f64], room: &'a mut [[E::Real; 2]]) -> Weights<'a, E::Real> {
        let mut turn = 0.0;
        for (((factors, q), units), largest) in room.iter_mut().zip(q).zip(&self.units).zip(&self.largest_turn) {
            let q = q / self.root_mass;
            *factors = units.map(|unit| E::Real::of(q * unit));
            turn += (q * largest).abs();
        }
        Weights { factors: &room[..self.modes], doublings: doublings(turn) }
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> usize {
        self.n_vertices.div_ceil(LANES)
    }

    /// Some blocks, in order.
    #[inline(always)]
    pub fn blocks(&self, blocks: Range<usize>) -> impl Iterator<Item = Block<'_, E>> {
        let size = HEADER + self.shapes * self.modes;
        self.lines[blocks.start * size..blocks.end * size].chunks_exact(size).map(|lines| {
            let (header, shapes) = lines.split_at(HEADER);
            Block { header, shapes, lines: self.shapes }
        })
    }
}

impl<E: Entry> Block<'_, E> {
    /// m/M of the vertices from register `at` on.
    #[inline(always)]
    pub fn mass<S: Kind, const N: usize>(&self, lanes: Lanes<E::Real, S, N>, at: usize) -> Group<E::Real, S, N> {
        lanes.load(&self.header[0].0, at)
    }

    /// Rest positions.
    #[inline(always)]
    pub fn rest<S: Kind, const N: usize>(&self, lanes: Lanes<E::Real, S, N>, at: usize) -> Vectors<E::Real, S, N> {
        let load = |c: usize| lanes.load(&self.header[c].0, at);
        [load(1), load(2), load(3)]
    }

    /// Φq and Ψq.
    #[inline(always)]
    pub fn combine<S: Kind, const N: usize>(
        &self,
        lanes: Lanes<E::Real, S, N>,
        at: usize,
        weights: Weights<E::Real>,
    ) -> (Vectors<E::Real, S, N>, Vectors<E::Real, S, N>) {
        let zero = [lanes.splat(0.0); 3];
        let (mut linear, mut turn) = (zero, zero);
        for (shapes, factors) in self.shapes.chunks_exact(E::LINES).zip(weights.factors) {
            let q = lanes.repeat(factors[0]);
            linear = lanes.scale_add(q, &E::phi(lanes, shapes, at), &linear);
            let q = if E::SCALED { lanes.repeat(factors[1]) } else { q };
            turn = lanes.scale_add(q, &E::psi(lanes, shapes, at), &turn);
        }
        (linear, turn)
    }

    /// Φq.
    #[inline(always)]
    pub fn combine_linear<S: Kind, const N: usize>(
        &self,
        lanes: Lanes<E::Real, S, N>,
        at: usize,
        weights: Weights<E::Real>,
    ) -> Vectors<E::Real, S, N> {
        let mut linear = [lanes.splat(0.0); 3];
        // No closure: one that is not inlined would be compiled for the narrowest registers.
        for (shapes, factors) in self.shapes.chunks_exact(self.lines).zip(weights.factors) {
            linear = lanes.scale_add(lanes.repeat(factors[0]), &E::phi(lanes, shapes, at), &linear);
        }
        linear
    }

    /// Adds Φᵀg, in entries of the mode, lane by lane, to the first of the lines for each mode.
    #[inline(always)]
    pub fn project_linear<S: Kind, const N: usize>(
        &self,
        lanes: Lanes<E::Real, S, N>,
        at: usize,
        g: &Vectors<E::Real, S, N>,
        sums: &mut [[Line<E::Real>; 2]],
    ) {
        for (shapes, [sum, _]) in self.shapes.chunks_exact(self.lines).zip(sums) {
            lanes.add_dot(&E::phi(lanes, shapes, at), g, sum, at);
        }
    }

    /// As [`Block::project_linear`], where Ψ lies between.
    #[inline(always)]
    pub fn project<S: Kind, const N: usize>(
        &self,
        lanes: Lanes<E::Real, S, N>,
        at: usize,
        g: &Vectors<E::Real, S, N>,
        sums: &mut [[Line<E::Real>; 2]],
    ) {
        for (shapes, [sum, _]) in self.shapes.chunks_exact(E::LINES).zip(sums) {
            lanes.add_dot(&E::phi(lanes, shapes, at), g, sum, at);
        }
    }

    /// As [`Block::project`], and adds Ψᵀg' to the second line, or to the first where all entries have the unit 1.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    pub fn project_both<S: Kind, const N: usize>(
        &self,
        lanes: Lanes<E::Real, S, N>,
        at: usize,
        (g, couple): (&Vectors<E::Real, S, N>, &Vectors<E::Real, S, N>),
        sums: &mut [[Line<E::Real>; 2]],
    ) {
        for (shapes, [sum, turn_sum]) in self.shapes.chunks_exact(E::LINES).zip(sums) {
            lanes.add_dot(&E::phi(lanes, shapes, at), g, sum, at);
            lanes.add_dot(&E::psi(lanes, shapes, at), couple, if E::SCALED { turn_sum } else { sum }, at);
        }
    }
}

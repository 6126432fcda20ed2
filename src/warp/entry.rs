//! How a number of Φ or Ψ is stored in the lines of a block: as it is, or as 16 bits of a unit that its mode has.

use super::Line;
use super::lanes::{Lanes, Vectors};
use crate::real::Real;
use pulp::Simd;

/// Numbers of a vertex in a mode: Φ and Ψ.
pub const SHAPES: usize = 6;

/// An entry of the basis.
pub trait Entry: Copy + Send + Sync + 'static {
    /// What is computed with.
    type Real: Real;
    /// Lines of a mode.
    const LINES: usize;
    /// Units differ from 1.
    const SCALED: bool;
    /// Bytes saved.
    const BYTES: usize;

    /// What an entry of one stands for where `largest` is the largest number.
    fn unit(largest: f64) -> f64;
    /// Rounds.
    fn encode(x: f64) -> Self;
    /// Exact.
    fn decode(self) -> f64;
    /// Appends it, little-endian.
    fn append(self, out: &mut Vec<u8>);
    /// From [`Entry::BYTES`] bytes, little-endian.
    fn restore(bytes: &[u8]) -> Self;
    /// A vertex's entries in the lines of a mode.
    fn entries(lines: &[Line<Self::Real>], lane: usize) -> [Self; SHAPES];
    /// As [`Entry::entries`], the other way.
    fn set_entries(lines: &mut [Line<Self::Real>], lane: usize, entries: [Self; SHAPES]);
    /// Φ of a group of vertices, in entries.
    fn phi<S: Simd, const N: usize>(
        lanes: Lanes<Self::Real, S, N>,
        lines: &[Line<Self::Real>],
        at: usize,
    ) -> Vectors<Self::Real, S, N>;
    /// Ψ of a group of vertices, in entries.
    fn psi<S: Simd, const N: usize>(
        lanes: Lanes<Self::Real, S, N>,
        lines: &[Line<Self::Real>],
        at: usize,
    ) -> Vectors<Self::Real, S, N>;
}

impl<T: Real> Entry for T {
    type Real = T;
    const LINES: usize = SHAPES;
    const SCALED: bool = false;
    const BYTES: usize = size_of::<T>();

    fn unit(_: f64) -> f64 {
        1.0
    }

    fn encode(x: f64) -> Self {
        Real::of(x)
    }

    fn decode(self) -> f64 {
        Real::to_f64(self)
    }

    fn append(self, out: &mut Vec<u8>) {
        Real::put(self, out);
    }

    fn restore(bytes: &[u8]) -> Self {
        Real::get(bytes)
    }

    fn entries(lines: &[Line<T>], lane: usize) -> [T; SHAPES] {
        std::array::from_fn(|c| lines[c].0[lane])
    }

    fn set_entries(lines: &mut [Line<T>], lane: usize, entries: [T; SHAPES]) {
        lines.iter_mut().zip(entries).for_each(|(line, entry)| line.0[lane] = entry);
    }

    #[inline(always)]
    fn phi<S: Simd, const N: usize>(lanes: Lanes<T, S, N>, lines: &[Line<T>], at: usize) -> Vectors<T, S, N> {
        [lanes.load(&lines[0].0, at), lanes.load(&lines[1].0, at), lanes.load(&lines[2].0, at)]
    }

    #[inline(always)]
    fn psi<S: Simd, const N: usize>(lanes: Lanes<T, S, N>, lines: &[Line<T>], at: usize) -> Vectors<T, S, N> {
        [lanes.load(&lines[3].0, at), lanes.load(&lines[4].0, at), lanes.load(&lines[5].0, at)]
    }
}

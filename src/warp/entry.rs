//! How a number of Φ or Ψ is stored in the lines of a block: as it is, or as 16 bits of a unit that its mode has.

use super::Line;
use super::lanes::{Kind, Lanes, Vectors};
use crate::real::Real;

/// Numbers of a vertex in a mode: Φ and Ψ.
pub const SHAPES: usize = 6;

/// An entry of the basis.
pub trait Entry: Copy + Default + Send + Sync + 'static {
    /// What is computed with.
    type Real: Real;
    /// Lines of a mode with Φ and Ψ, and with Φ alone.
    const LINES: usize;
    /// See [`Entry::LINES`].
    const LINEAR_LINES: usize;
    /// Units differ from 1.
    const SCALED: bool;
    /// Bytes saved.
    const BYTES: usize;
    /// Largest error of an entry, relative to the largest number of its mode.
    const ROUNDING: f64;

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
    fn phi<S: Kind, const N: usize>(
        lanes: Lanes<Self::Real, S, N>,
        lines: &[Line<Self::Real>],
        at: usize,
    ) -> Vectors<Self::Real, S, N>;
    /// Ψ of a group of vertices, in entries.
    fn psi<S: Kind, const N: usize>(
        lanes: Lanes<Self::Real, S, N>,
        lines: &[Line<Self::Real>],
        at: usize,
    ) -> Vectors<Self::Real, S, N>;
}

impl<T: Real> Entry for T {
    type Real = T;
    const LINES: usize = SHAPES;
    const LINEAR_LINES: usize = SHAPES / 2;
    const SCALED: bool = false;
    const BYTES: usize = size_of::<T>();
    const ROUNDING: f64 = if size_of::<T>() == 4 { f32::EPSILON as f64 / 2.0 } else { f64::EPSILON / 2.0 };

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
        std::array::from_fn(|c| lines.get(c).map_or_else(T::default, |line| line.0[lane]))
    }

    fn set_entries(lines: &mut [Line<T>], lane: usize, entries: [T; SHAPES]) {
        lines.iter_mut().zip(entries).for_each(|(line, entry)| line.0[lane] = entry);
    }

    #[inline(always)]
    fn phi<S: Kind, const N: usize>(lanes: Lanes<T, S, N>, lines: &[Line<T>], at: usize) -> Vectors<T, S, N> {
        [lanes.load(&lines[0].0, at), lanes.load(&lines[1].0, at), lanes.load(&lines[2].0, at)]
    }

    #[inline(always)]
    fn psi<S: Kind, const N: usize>(lanes: Lanes<T, S, N>, lines: &[Line<T>], at: usize) -> Vectors<T, S, N> {
        [lanes.load(&lines[3].0, at), lanes.load(&lines[4].0, at), lanes.load(&lines[5].0, at)]
    }
}

/// A 16-bit integer, in units of 2⁻¹⁶: half the memory of f32. Two share a word of a line, Φx Φy, Φz Ψx, Ψy Ψz.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct I16(i16);

/// 2¹⁶.
const STEPS: f64 = 65536.0;

impl Entry for I16 {
    type Real = f32;
    const LINES: usize = SHAPES / 2;
    const LINEAR_LINES: usize = 2;
    const SCALED: bool = true;
    const BYTES: usize = 2;
    const ROUNDING: f64 = 0.5 / i16::MAX as f64;

    fn unit(largest: f64) -> f64 {
        if largest > 0.0 { largest * STEPS / f64::from(i16::MAX) } else { 1.0 }
    }

    fn encode(x: f64) -> Self {
        Self((x * STEPS).round() as i16)
    }

    fn decode(self) -> f64 {
        f64::from(self.0) / STEPS
    }

    fn append(self, out: &mut Vec<u8>) {
        out.extend(self.0.to_le_bytes());
    }

    fn restore(bytes: &[u8]) -> Self {
        Self(i16::from_le_bytes([bytes[0], bytes[1]]))
    }

    fn entries(lines: &[Line<f32>], lane: usize) -> [Self; SHAPES] {
        let word = |c: usize| lines.get(c / 2).map_or(0, |line| line.0[lane].to_bits());
        std::array::from_fn(|c| Self((word(c) >> (16 * (c % 2))) as i16))
    }

    fn set_entries(lines: &mut [Line<f32>], lane: usize, entries: [Self; SHAPES]) {
        for (line, two) in lines.iter_mut().zip(entries.chunks_exact(2)) {
            let [low, high] = [two[0].0, two[1].0].map(|half| u32::from(half as u16));
            line.0[lane] = f32::from_bits(low | high << 16);
        }
    }

    #[inline(always)]
    fn phi<S: Kind, const N: usize>(lanes: Lanes<f32, S, N>, lines: &[Line<f32>], at: usize) -> Vectors<f32, S, N> {
        let [x, y] = lanes.halves(lanes.load(&lines[0].0, at));
        [x, y, lanes.halves(lanes.load(&lines[1].0, at))[0]]
    }

    #[inline(always)]
    fn psi<S: Kind, const N: usize>(lanes: Lanes<f32, S, N>, lines: &[Line<f32>], at: usize) -> Vectors<f32, S, N> {
        let [y, z] = lanes.halves(lanes.load(&lines[2].0, at));
        [lanes.halves(lanes.load(&lines[1].0, at))[1], y, z]
    }
}

//! The run-time basis: Φ and Ψ in blocks of [`LANES`] vertices. Per block and mode six vectors Φx Φy Φz Ψx Ψy Ψz lie one
//! after another, so that a step reads memory once from front to back.
//!
//! Stored values are dimensionless, Φ √M and Ψ √M with M the total mass, and amplitudes are divided by √M when they meet
//! the basis: any unit of mass stays within the range of f32.

use super::LANES;
use crate::Vec3;
use crate::error::{Result, try_zeroed};
use crate::real::Real;

/// Numbers per block and mode.
const STRIDE: usize = 6 * LANES;

/// A 3-vector per lane: x of all lanes, then y, then z.
pub type Lanes3<T> = [[T; LANES]; 3];

/// Φ and Ψ of all vertices (n_blocks × modes × 6 × LANES).
pub struct Basis<T> {
    /// Number of modes.
    pub modes: usize,
    /// Number of vertices; the last block is padded with zeros.
    pub n_vertices: usize,
    root_mass: f64,
    data: Vec<T>,
}

impl<T: Real> Basis<T> {
    /// All zero.
    pub fn zeros(n_vertices: usize, modes: usize, total_mass: f64) -> Result<Self> {
        let n_blocks = n_vertices.div_ceil(LANES);
        let data = try_zeroed("the run-time basis", n_blocks * modes * STRIDE)?;
        Ok(Self { modes, n_vertices, root_mass: total_mass.sqrt(), data })
    }

    /// Stores Φ and Ψ (n_vertices each) of one mode.
    pub fn set_mode(&mut self, mode: usize, phi: &[Vec3], psi: &[Vec3]) {
        for v in 0..self.n_vertices {
            let base = (v / LANES * self.modes + mode) * STRIDE + v % LANES;
            for c in 0..3 {
                self.data[base + c * LANES] = T::of(phi[v][c] * self.root_mass);
                self.data[base + (3 + c) * LANES] = T::of(psi[v][c] * self.root_mass);
            }
        }
    }

    /// Φ and Ψ of one vertex in one mode.
    pub fn at(&self, mode: usize, v: usize) -> (Vec3, Vec3) {
        let base = (v / LANES * self.modes + mode) * STRIDE + v % LANES;
        let read = |c: usize| self.data[base + c * LANES].to_f64() / self.root_mass;
        (Vec3::new(read(0), read(1), read(2)), Vec3::new(read(3), read(4), read(5)))
    }

    /// Φ√M and Ψ√M of one vertex in one mode, x y z each, as they are stored.
    pub fn stored(&self, mode: usize, v: usize) -> [T; 6] {
        let base = (v / LANES * self.modes + mode) * STRIDE + v % LANES;
        std::array::from_fn(|c| self.data[base + c * LANES])
    }

    /// Stores what [`Basis::stored`] gave.
    pub fn set_stored(&mut self, mode: usize, v: usize, numbers: [T; 6]) {
        let base = (v / LANES * self.modes + mode) * STRIDE + v % LANES;
        (0..6).for_each(|c| self.data[base + c * LANES] = numbers[c]);
    }

    /// Whether all of it are numbers.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|x| x.to_f64().is_finite())
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> usize {
        self.n_vertices.div_ceil(LANES)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.data.len() * size_of::<T>()
    }

    fn mode_chunks(&self, block: usize) -> impl Iterator<Item = &[T]> {
        self.data[block * self.modes * STRIDE..][..self.modes * STRIDE].chunks_exact(STRIDE)
    }

    /// Φq and Ψq of one block.
    pub fn combine(&self, block: usize, q: &[f64]) -> (Lanes3<T>, Lanes3<T>) {
        let mut sum = [T::default(); STRIDE];
        for (chunk, q) in self.mode_chunks(block).zip(q) {
            let q = T::of(q / self.root_mass);
            for (sum, x) in sum.iter_mut().zip(chunk) {
                *sum += q * *x;
            }
        }
        let lanes = |c: usize| -> [T; LANES] { std::array::from_fn(|i| sum[c * LANES + i]) };
        ([lanes(0), lanes(1), lanes(2)], [lanes(3), lanes(4), lanes(5)])
    }

    /// Adds Φᵀg, and Ψᵀg' where a second vector is given, of one block to `force` (modes).
    pub fn project(&self, block: usize, g: &Lanes3<T>, couple: Option<&Lanes3<T>>, force: &mut [f64]) {
        for (chunk, force) in self.mode_chunks(block).zip(force) {
            let mut sum = [T::default(); LANES];
            let mut add = |shapes: &[T], g: &Lanes3<T>| {
                for c in 0..3 {
                    for i in 0..LANES {
                        sum[i] += shapes[c * LANES + i] * g[c][i];
                    }
                }
            };
            let (phi, psi) = chunk.split_at(3 * LANES);
            add(phi, g);
            if let Some(couple) = couple {
                add(psi, couple);
            }
            *force += sum.iter().fold(T::default(), |total, x| total + *x).to_f64() / self.root_mass;
        }
    }
}

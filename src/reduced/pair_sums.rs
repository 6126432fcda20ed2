//! Sums of products of 16-bit integers, two at once: exact in 32 bits, so the same by all instructions.
//!
//! A word is two numbers, each of a field, and a factor their amplitudes. One instruction of AVX2 or AVX-512 multiplies both and adds them.

use crate::warp::{LANES, Line};
#[cfg(target_arch = "x86_64")]
use pulp::{Simd, bytemuck};

/// Two numbers in one word.
pub(super) fn word([low, high]: [i16; 2]) -> u32 {
    u32::from(low as u16) | u32::from(high as u16) << 16
}

/// The products of an instruction set.
pub(super) trait Products: Copy {
    /// Sums of the vertices of a block.
    type Sums: Copy;
    /// Two amplitudes.
    type Factor: Copy;

    fn zero(self) -> Self::Sums;
    fn factor(self, word: u32) -> Self::Factor;
    /// Adds both products of each word.
    fn add(self, sums: Self::Sums, words: &Line<u32>, by: Self::Factor) -> Self::Sums;
    /// Two sums, each times its scale.
    fn scaled(self, sums: [Self::Sums; 2], scales: [f32; 2], out: &mut Line<f32>);
}

/// As any compiler makes them.
#[derive(Clone, Copy)]
pub(super) struct Plain;

impl Products for Plain {
    type Sums = [i32; LANES];
    type Factor = [i32; 2];

    #[inline(always)]
    fn zero(self) -> Self::Sums {
        [0; LANES]
    }

    #[inline(always)]
    fn factor(self, word: u32) -> [i32; 2] {
        halves(word)
    }

    #[inline(always)]
    fn add(self, mut sums: Self::Sums, words: &Line<u32>, [a, b]: [i32; 2]) -> Self::Sums {
        for i in 0..LANES {
            let [low, high] = halves(words.0[i]);
            sums[i] = sums[i].wrapping_add(low.wrapping_mul(a).wrapping_add(high.wrapping_mul(b)));
        }
        sums
    }

    #[inline(always)]
    fn scaled(self, [a, b]: [Self::Sums; 2], scales: [f32; 2], out: &mut Line<f32>) {
        for i in 0..LANES {
            out.0[i] = a[i] as f32 * scales[0] + b[i] as f32 * scales[1];
        }
    }
}

#[inline(always)]
fn halves(word: u32) -> [i32; 2] {
    [i32::from(word as i16), word as i32 >> 16]
}

#[cfg(target_arch = "x86_64")]
impl Products for pulp::x86::V3 {
    type Sums = [pulp::u32x8; 2];
    type Factor = pulp::i16x16;

    #[inline(always)]
    fn zero(self) -> Self::Sums {
        [self.splat_u32s(0); 2]
    }

    #[inline(always)]
    fn factor(self, word: u32) -> Self::Factor {
        bytemuck::cast(self.splat_u32s(word))
    }

    #[inline(always)]
    fn add(self, sums: Self::Sums, words: &Line<u32>, by: Self::Factor) -> Self::Sums {
        let words = Self::as_simd_u32s(&words.0).0;
        let product = |n: usize| self.multiply_wrapping_add_adjacent_i16x16(bytemuck::cast(words[n]), by);
        [self.add_u32s(sums[0], bytemuck::cast(product(0))), self.add_u32s(sums[1], bytemuck::cast(product(1)))]
    }

    #[inline(always)]
    fn scaled(self, [a, b]: [Self::Sums; 2], scales: [f32; 2], out: &mut Line<f32>) {
        let scales = scales.map(|scale| self.splat_f32s(scale));
        for (n, out) in Self::as_mut_simd_f32s(&mut out.0).0.iter_mut().enumerate() {
            let [a, b] = [a[n], b[n]].map(|sums| self.convert_i32x8_to_f32x8(bytemuck::cast(sums)));
            *out = self.add_f32s(self.mul_f32s(a, scales[0]), self.mul_f32s(b, scales[1]));
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl Products for pulp::x86::V4 {
    type Sums = pulp::u32x16;
    type Factor = pulp::i16x32;

    #[inline(always)]
    fn zero(self) -> Self::Sums {
        self.splat_u32s(0)
    }

    #[inline(always)]
    fn factor(self, word: u32) -> Self::Factor {
        bytemuck::cast(self.splat_u32s(word))
    }

    #[inline(always)]
    fn add(self, sums: Self::Sums, words: &Line<u32>, by: Self::Factor) -> Self::Sums {
        let words = bytemuck::cast(Self::as_simd_u32s(&words.0).0[0]);
        self.add_u32s(sums, bytemuck::cast(self.multiply_wrapping_add_adjacent_i16x32(words, by)))
    }

    #[inline(always)]
    fn scaled(self, sums: [Self::Sums; 2], scales: [f32; 2], out: &mut Line<f32>) {
        let [a, b] = sums.map(|sums| self.convert_i32x16_to_f32x16(bytemuck::cast(sums)));
        let scales = scales.map(|scale| self.splat_f32s(scale));
        let sum = self.add_f32s(self.mul_f32s(a, scales[0]), self.mul_f32s(b, scales[1]));
        Self::as_mut_simd_f32s(&mut out.0).0[0] = sum;
    }
}

//! In how many bits sums are made, in registers of any width.

use pulp::{Simd, bytemuck};

/// Sums of numbers of 32 bits, and of those that sums have.
pub trait Sums<S: Simd> {
    /// A sum, and as many as a register holds.
    type Number: Copy + Default + PartialEq;
    type Register: Copy;
    /// Numbers in a register.
    const LANES: usize;
    fn view(numbers: &[Self::Number]) -> &[Self::Register];
    fn registers(numbers: &mut [Self::Number]) -> &mut [Self::Register];
    fn splat(simd: S, x: Self::Number) -> Self::Register;
    /// As many numbers as a register holds.
    fn read(simd: S, numbers: &[f32]) -> Self::Register;
    /// ab + c, ab and a + b.
    fn multiply_add(simd: S, a: Self::Register, b: Self::Register, c: Self::Register) -> Self::Register;
    fn multiply(simd: S, a: Self::Register, b: Self::Register) -> Self::Register;
    fn add(simd: S, a: Self::Register, b: Self::Register) -> Self::Register;
    /// Of two.
    fn sum(both: [Self::Number; 2]) -> Self::Number;
}

/// 64 bits.
pub struct Double;
/// 32 bits: half the time.
pub struct Single;

impl<S: Simd> Sums<S> for Double {
    type Number = f64;
    type Register = S::f64s;
    const LANES: usize = size_of::<S::f64s>() / size_of::<f64>();

    #[inline(always)]
    fn view(numbers: &[f64]) -> &[S::f64s] {
        S::as_simd_f64s(numbers).0
    }

    #[inline(always)]
    fn registers(numbers: &mut [f64]) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(numbers).0
    }

    #[inline(always)]
    fn splat(simd: S, x: f64) -> S::f64s {
        simd.splat_f64s(x)
    }

    #[inline(always)]
    fn read(simd: S, numbers: &[f32]) -> S::f64s {
        let mut wide = [simd.splat_f64s(0.0)];
        for (wide, x) in bytemuck::cast_slice_mut::<S::f64s, f64>(&mut wide).iter_mut().zip(numbers) {
            *wide = f64::from(*x);
        }
        wide[0]
    }

    #[inline(always)]
    fn multiply_add(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        simd.mul_add_e_f64s(a, b, c)
    }

    #[inline(always)]
    fn multiply(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.mul_f64s(a, b)
    }

    #[inline(always)]
    fn add(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.add_f64s(a, b)
    }

    #[inline(always)]
    fn sum([a, b]: [f64; 2]) -> f64 {
        a + b
    }
}

impl<S: Simd> Sums<S> for Single {
    type Number = f32;
    type Register = S::f32s;
    const LANES: usize = size_of::<S::f32s>() / size_of::<f32>();

    #[inline(always)]
    fn view(numbers: &[f32]) -> &[S::f32s] {
        S::as_simd_f32s(numbers).0
    }

    #[inline(always)]
    fn registers(numbers: &mut [f32]) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(numbers).0
    }

    #[inline(always)]
    fn splat(simd: S, x: f32) -> S::f32s {
        simd.splat_f32s(x)
    }

    #[inline(always)]
    fn read(_: S, numbers: &[f32]) -> S::f32s {
        S::as_simd_f32s(numbers).0[0]
    }

    #[inline(always)]
    fn multiply_add(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        simd.mul_add_e_f32s(a, b, c)
    }

    #[inline(always)]
    fn multiply(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.mul_f32s(a, b)
    }

    #[inline(always)]
    fn add(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.add_f32s(a, b)
    }

    #[inline(always)]
    fn sum([a, b]: [f32; 2]) -> f32 {
        a + b
    }
}

//! Arithmetic on a group of vertices at once, a lane for each: `N` registers of the instruction set `S`.

use super::Line;
use crate::real::Real;
use pulp::Simd;
use std::marker::PhantomData;

/// Registers, and how they multiply and add.
pub trait Kind: Copy {
    /// The instruction set.
    type Simd: Simd;
    /// a b + c in one rounding where the instruction set can; else in two everywhere.
    const FUSED: bool;
}

/// As fast as the instruction set does it.
#[derive(Clone, Copy)]
pub struct Fused<S>(PhantomData<S>);

/// With the same bits in every instruction set.
#[derive(Clone, Copy)]
pub struct Unfused<S>(PhantomData<S>);

impl<S: Simd> Kind for Fused<S> {
    type Simd = S;
    const FUSED: bool = true;
}

impl<S: Simd> Kind for Unfused<S> {
    type Simd = S;
    const FUSED: bool = false;
}

/// One number for each vertex of the group.
pub type Group<T, S, const N: usize> = [<T as Real>::Register<<S as Kind>::Simd>; N];

/// A 3-vector for each vertex of the group.
pub type Vectors<T, S, const N: usize> = [Group<T, S, N>; 3];

/// The operations.
#[derive(Clone, Copy)]
pub struct Lanes<T, S: Kind, const N: usize> {
    simd: S::Simd,
    of: PhantomData<T>,
}

impl<T: Real, S: Kind, const N: usize> Lanes<T, S, N> {
    /// On an instruction set that is known to be there.
    #[inline(always)]
    pub fn new(simd: S::Simd) -> Self {
        Self { simd, of: PhantomData }
    }

    /// Vertices in a group.
    #[inline(always)]
    pub fn width(self) -> usize {
        N * size_of::<T::Register<S::Simd>>() / size_of::<T>()
    }

    /// The same number for every vertex.
    #[inline(always)]
    pub fn splat(self, x: f64) -> Group<T, S, N> {
        self.repeat(T::of(x))
    }

    /// As [`Lanes::splat`], of a number in the lanes' precision.
    #[inline(always)]
    pub fn repeat(self, x: T) -> Group<T, S, N> {
        [T::splat(self.simd, x); N]
    }

    /// a + b.
    #[inline(always)]
    pub fn add(self, mut a: Group<T, S, N>, b: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            a[n] = T::sum(self.simd, a[n], b[n]);
        }
        a
    }

    /// a − b.
    #[inline(always)]
    pub fn sub(self, mut a: Group<T, S, N>, b: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            a[n] = T::difference(self.simd, a[n], b[n]);
        }
        a
    }

    /// a b.
    #[inline(always)]
    pub fn mul(self, mut a: Group<T, S, N>, b: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            a[n] = T::product(self.simd, a[n], b[n]);
        }
        a
    }

    /// a b + c.
    #[inline(always)]
    pub fn mul_add(self, a: Group<T, S, N>, b: Group<T, S, N>, mut c: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            c[n] = match S::FUSED {
                true => T::mul_add(self.simd, a[n], b[n], c[n]),
                false => T::sum(self.simd, T::product(self.simd, a[n], b[n]), c[n]),
            };
        }
        c
    }

    /// c − a b.
    #[inline(always)]
    pub fn negate_mul_add(self, a: Group<T, S, N>, b: Group<T, S, N>, mut c: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            c[n] = match S::FUSED {
                true => T::negate_mul_add(self.simd, a[n], b[n], c[n]),
                false => T::difference(self.simd, c[n], T::product(self.simd, a[n], b[n])),
            };
        }
        c
    }

    /// √a.
    #[inline(always)]
    pub fn sqrt(self, mut a: Group<T, S, N>) -> Group<T, S, N> {
        for n in 0..N {
            a[n] = T::sqrt(self.simd, a[n]);
        }
        a
    }

    /// a·b.
    #[inline(always)]
    pub fn dot(self, a: &Vectors<T, S, N>, b: &Vectors<T, S, N>) -> Group<T, S, N> {
        self.mul_add(a[0], b[0], self.mul_add(a[1], b[1], self.mul(a[2], b[2])))
    }

    /// Adds a·b to a line, from register `at` on.
    #[inline(always)]
    pub fn add_dot(self, a: &Vectors<T, S, N>, b: &Vectors<T, S, N>, sum: &mut Line<T>, at: usize) {
        let mut total = self.load(&sum.0, at);
        for c in 0..3 {
            total = self.mul_add(a[c], b[c], total);
        }
        self.store(total, &mut sum.0, at);
    }

    /// a × b.
    #[inline(always)]
    pub fn cross(self, a: &Vectors<T, S, N>, b: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        let of = |c: usize, d: usize| self.negate_mul_add(a[d], b[c], self.mul(a[c], b[d]));
        [of(1, 2), of(2, 0), of(0, 1)]
    }

    /// a × b + c.
    #[inline(always)]
    pub fn cross_add(self, a: &Vectors<T, S, N>, b: &Vectors<T, S, N>, c: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        let of = |e: usize, c: Group<T, S, N>, d: usize| self.negate_mul_add(a[d], b[e], self.mul_add(a[e], b[d], c));
        [of(1, c[0], 2), of(2, c[1], 0), of(0, c[2], 1)]
    }

    /// a v + b.
    #[inline(always)]
    pub fn scale_add(self, a: Group<T, S, N>, v: &Vectors<T, S, N>, b: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        [self.mul_add(a, v[0], b[0]), self.mul_add(a, v[1], b[1]), self.mul_add(a, v[2], b[2])]
    }

    /// a + b.
    #[inline(always)]
    pub fn add_vectors(self, a: &Vectors<T, S, N>, b: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        [self.add(a[0], b[0]), self.add(a[1], b[1]), self.add(a[2], b[2])]
    }

    /// a v.
    #[inline(always)]
    pub fn scale(self, a: Group<T, S, N>, v: &Vectors<T, S, N>) -> Vectors<T, S, N> {
        [self.mul(a, v[0]), self.mul(a, v[1]), self.mul(a, v[2])]
    }

    /// The group's numbers in a line of a block, from register `at` on.
    #[inline(always)]
    pub fn load(self, line: &[T], at: usize) -> Group<T, S, N> {
        let registers = T::registers::<S::Simd>(line);
        let mut group = [registers[at]; N];
        group.copy_from_slice(&registers[at..at + N]);
        group
    }

    /// As [`Lanes::load`], the other way.
    #[inline(always)]
    pub fn store(self, group: Group<T, S, N>, line: &mut [T], at: usize) {
        let registers = T::registers_mut::<S::Simd>(line);
        registers[at..at + N].copy_from_slice(&group);
    }
}

impl<S: Kind, const N: usize> Lanes<f32, S, N> {
    /// Two 16-bit integers a lane, those of the lower halves and of the upper, in units of 2⁻¹⁶.
    ///
    /// Without conversion: 1.5 has the bits 0x3fc00000, and an integer added to its mantissa's upper 16 bits is added to it in
    /// that unit; the exclusive or does so with the integer in two's complement.
    #[inline(always)]
    pub fn halves(self, words: Group<f32, S, N>) -> [Group<f32, S, N>; 2] {
        let simd = self.simd;
        let of = |word: u32| simd.splat_u32s(word);
        let (mut low, mut high) = (words, words);
        for n in 0..N {
            let word = simd.transmute_u32s_f32s(words[n]);
            let [up, down] = [simd.wrapping_dyn_shl_u32s(word, of(7)), simd.wrapping_dyn_shr_u32s(word, of(9))];
            for (half, shifted) in [(&mut low, up), (&mut high, down)] {
                let mantissa = simd.and_u32s(shifted, of(0x007f_ff80));
                let number = simd.transmute_f32s_u32s(simd.xor_u32s(mantissa, of(0x3fc0_0000)));
                half[n] = simd.sub_f32s(number, simd.splat_f32s(1.5));
            }
        }
        [low, high]
    }
}

//! What a state computes with: the fastest that its processor has, or what gives the same bits on all of them.
//!
//! The portable kind multiplies and adds in two roundings, never in one, and sums in one order: kernels that sum across registers then
//! take no wide ones.
//! Exponentials, sines and angles of a step come from `libm`, in both kinds: a platform's own differ in the last bit.

use pulp::Arch;

/// See the module's text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// The processor's widest registers, with fused multiply-add where it has that.
    #[default]
    Fastest,
    /// The same bits on every processor.
    Portable,
}

impl Arithmetic {
    /// Whether kernels may multiply and add in one rounding.
    pub fn fused(self) -> bool {
        self == Self::Fastest
    }

    /// The registers of kernels that sum across them, and so in an order that their width decides.
    pub fn arch(self) -> Arch {
        match self {
            Self::Fastest => Arch::new(),
            Self::Portable => Arch::Scalar,
        }
    }
}

//! The number types in which a model keeps its run-time fields.

use crate::Result;
use crate::features::Feature;
use crate::warp::{Entry, I16};

/// Floating-point type of the run-time basis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Half the memory; positions good to about 1e-6 of the displacement.
    #[default]
    F32,
    /// For reference and for sums of very many modes.
    F64,
    /// A quarter of F64's memory: Φ and Ψ in 16 bits of a unit for each mode, computed with in 32 bits.
    I16,
}

impl Precision {
    /// Fails where this build has no such basis.
    #[inline(always)]
    pub fn require(self) -> Result<()> {
        match self {
            Self::F32 => Ok(()),
            Self::F64 => Feature::F64Basis.require(),
            Self::I16 => Feature::I16Basis.require(),
        }
    }

    /// Bytes of a number.
    pub fn number_bytes(self) -> usize {
        match self {
            Self::F32 => <f32 as Entry>::BYTES,
            Self::F64 => <f64 as Entry>::BYTES,
            Self::I16 => I16::BYTES,
        }
    }

    /// Largest error of a stored number, relative to the largest component of its mode's Φ or Ψ.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F32 => f32::ROUNDING,
            Self::F64 => f64::ROUNDING,
            Self::I16 => I16::ROUNDING,
        }
    }
}

//! Sparse symmetric matrices of 3 × 3 blocks over the free vertices of a shell, and their factorizations.

mod blocks;
mod factor;
mod ordering;

pub use blocks::{BlockMatrix, entries};
pub use factor::{Cholesky, Factor, Symbolic};

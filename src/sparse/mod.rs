//! Sparse symmetric matrices of 3 × 3 blocks over the free vertices of a shell, and their factorizations.

mod analysis;
mod blocks;
mod branches;
mod columns;
mod factor;
mod fronts;
mod ordering;
mod panels;
mod product;

pub use analysis::{Analyses, Kept};
pub use blocks::{BlockMatrix, Columns, VisitElements, entries};
pub use factor::{Cholesky, Factor, SolvingRoom, Symbolic};

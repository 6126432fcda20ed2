//! The factorizations of A − σI that the eigenvalue search needs.

pub use crate::sparse::Symbolic;

//! Real-time thin shells by modal warping, after Choi, Woo and Ko, "Real-Time Simulation of Thin Shells" (2007).
//!
//! The pipeline: [`mesh`] → [`energy`] → [`modes`] → [`model`] → [`state`] → [`step`] → [`warp`].
#![doc = ""]

pub mod energy;
pub mod error;
pub mod material;
pub mod mesh;
pub mod modes;
pub mod shell;
pub mod support;

pub use error::{Error, ErrorKind, Result};
pub use material::Material;
pub use mesh::Mesh;
pub use shell::Shell;
pub use support::Supports;

/// A point, displacement or direction.
pub type Vec3 = nalgebra::Vector3<f64>;

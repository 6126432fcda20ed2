//! Real-time thin shells by modal warping, after Choi, Woo and Ko, "Real-Time Simulation of Thin Shells" (Eurographics
//! 2007; "the paper") and Choi and Ko, "Modal Warping" (TVCG 2005; "\[2\]").
//!
//! The pipeline reads from top to bottom: [`mesh`] → [`energy`] → [`modes`] → [`model`] → [`state`] → [`step`] → [`warp`].
//! Hosts use the C ABI (`include/shellwarp.h`, made from `src/ffi`); this Rust interface serves the tests and may change.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod arithmetic;
pub mod auto;
pub mod binding;
pub mod clock;
pub mod collider;
pub mod constraint;
pub mod contact;
pub mod energy;
pub mod error;
pub mod features;
pub mod ffi;
pub mod limits;
pub mod load;
pub mod material;
pub mod mesh;
pub mod method;
pub mod methods;
pub mod modal;
pub mod model;
pub mod modes;
pub mod point_energy;
pub mod precision;
pub mod proxy;
pub mod real;
pub mod reduced;
pub mod reference;
pub mod rotation;
pub mod shell;
pub mod sparse;
pub mod state;
pub mod step;
pub mod strain;
pub mod support;
pub mod threads;
pub mod warp;

pub use error::{Error, ErrorKind, Result};
pub use material::Material;
pub use mesh::Mesh;
pub use model::Model;
pub use shell::Shell;
pub use state::State;
pub use support::Supports;

/// A point, displacement or direction.
pub type Vec3 = nalgebra::Vector3<f64>;

/// |v|, also where its square leaves the floating-point range.
pub(crate) fn wide_norm(v: &Vec3) -> f64 {
    let (norm, largest) = (v.norm(), v.amax());
    let ordinary = norm.is_finite() && norm > 1e-150; // the square is normal
    if ordinary || largest == 0.0 { norm } else { (v / largest).norm() * largest }
}

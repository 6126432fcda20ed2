//! The C ABI: convert, check, one core call, convert back. `include/shellwarp.h` is made from this folder by cbindgen.
//!
//! One file per C object; the mechanics – status and messages, panic boundary, pointers – in files of their own.

// Every function's contract on its pointers is stated once, at the top of the header, and checked as far as C allows.
#![allow(unsafe_code, clippy::missing_safety_doc)]

pub mod batch;
pub mod binding;
pub mod certify;
pub mod collider;
pub mod constraint;
mod floats;
pub mod guard;
pub mod info;
pub mod load;
pub mod log;
pub mod material;
#[cfg(all(target_family = "wasm", target_os = "unknown"))]
pub mod memory;
pub mod mesh;
pub mod method;
pub mod model;
pub mod output;
pub mod plan;
pub mod pointer;
pub mod precompute;
pub mod preset;
pub mod proxy;
pub mod state;
pub mod status;
pub mod structs;
pub mod supports;

#[cfg(test)]
mod tests;

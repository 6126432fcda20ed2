//! What holds for the library as a whole: hosts, saved data, bad input, layers.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

mod cache;
mod fuzz;
mod guard;
mod host_calls;
mod imports;
mod kernel_paths;
mod leave_out;
mod library;
mod robustness;

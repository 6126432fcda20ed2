//! Meshes, supports, ties, proxies and bound points.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code)] // each room uses its part
#[path = "../common/plates.rs"]
mod plates;

mod axis_supports;
mod binding;
mod calibrate;
mod mesh;
mod moving_rest;
mod moving_rest_full;
mod moving_supports;
mod nasty_meshes;
mod pieces;
mod proxy;
mod symmetry;
mod ties;

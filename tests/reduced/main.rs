//! Reduced and polynomial shells, held or free, and what auto takes.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/demand_scenes.rs"]
mod demand_scenes;
#[allow(dead_code)] // each room uses its part
#[path = "../common/plates.rs"]
mod plates;

mod auto;
mod auto_handles;
mod auto_unasked;
mod demand;
mod floating;
mod floating_held;
mod led;
mod many_elements;
mod near;
mod packed;
mod polynomial;
mod reduced;
mod reduced_handles;
mod reduced_motion;
mod reduced_stressed;
mod step_error;
mod units;
mod unloaded;
mod weight;
mod yielding;

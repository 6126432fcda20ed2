//! Modes, the paper's warp, and what acts on a state.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

mod constraint;
mod load;
mod modes;
mod more_fields;
mod nodal_constraint;
mod pose;
mod sag;
mod spin;
mod state;
mod step;
mod virtual_work;
mod warp;

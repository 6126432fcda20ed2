//! Colliders, and shells that touch them.
#![allow(missing_docs)]

#[path = "../collider_meshes/mod.rs"]
mod collider_meshes;
#[path = "../common/mod.rs"]
mod common;

mod collider;
mod collider_fit;
mod collider_grid;
mod collider_hull;
mod collider_moving;
mod collider_one_sided;
mod collider_saved;
mod collider_wild;
mod contact;
mod contact_deforming;
mod contact_fast;
mod contact_held;
mod contact_many;
mod contact_near;
mod contact_one_sided;
mod contact_theory;

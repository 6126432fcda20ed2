//! Energies, materials and stiffness against closed forms and finite differences.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code)] // each room uses its part
#[path = "../common/plates.rs"]
mod plates;
mod saved;

mod creases;
mod damping;
mod energy;
mod koiter;
mod lengths;
mod look;
mod maps;
mod mechanisms;
mod obstacles;
mod orthotropy;
mod point_energy;
mod sparse;
mod stiff;
mod stiffness;
mod strain;
mod thin;
mod yielding;

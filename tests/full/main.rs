//! The full nonlinear shell, what it judges, and certificates.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code)] // the bench uses more of it
#[path = "../bench/front/scenes.rs"]
mod scenes;

mod adaptive;
mod certificate;
mod certificate_stability;
mod certificate_supports;
mod comparison;
mod correction;
mod handover;
mod mixed;
mod reference;
mod second_order;
mod step_error;
mod watched;
mod wind;

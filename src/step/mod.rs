//! One step: modal force from the loads, then each mode on its own.

pub mod guard;
pub mod integrator;
pub mod modal_force;
pub mod participation;
pub mod point_force;
pub mod stages;

pub use guard::{Bend, Guard};
pub use integrator::{Integrator, Oscillator};
pub use modal_force::ForceLaw;
pub use participation::Participation;

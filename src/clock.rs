//! The time, for reports and time limits, on systems that have a clock.

/// A point in time.
#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
pub use std::time::Instant;

/// Stands for a point in time where there is no clock: in a bare WebAssembly module, whose calls to a clock would trap. No time passes.
#[cfg(all(target_family = "wasm", target_os = "unknown"))]
#[derive(Clone, Copy, Debug)]
pub struct Instant;

#[cfg(all(target_family = "wasm", target_os = "unknown"))]
impl Instant {
    /// The only one.
    pub fn now() -> Self {
        Self
    }

    /// Nothing.
    pub fn elapsed(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }
}

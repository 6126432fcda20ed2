//! Friction's caps that a search may set, though it shares the energy: one search at a time does.

use std::sync::atomic::{AtomicU64, Ordering};

/// Of each contact one, or none at all.
#[derive(Default)]
pub struct Caps(Vec<AtomicU64>);

impl Caps {
    pub fn reserve(&mut self, n: usize) {
        self.0.reserve(n);
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes these instead.
    pub fn take(&mut self, caps: impl Iterator<Item = f64>) {
        self.0.clear();
        self.0.extend(caps.map(|cap| AtomicU64::new(cap.to_bits())));
    }

    pub fn all(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(read)
    }

    pub fn get(&self, i: usize) -> Option<f64> {
        self.0.get(i).map(read)
    }

    /// Sets one that there is.
    pub fn set(&self, i: usize, cap: f64) {
        self.0[i].store(cap.to_bits(), Ordering::Relaxed);
    }
}

fn read(cap: &AtomicU64) -> f64 {
    f64::from_bits(cap.load(Ordering::Relaxed))
}

impl Clone for Caps {
    fn clone(&self) -> Self {
        let mut caps = Self(Vec::with_capacity(self.0.capacity()));
        caps.take(self.all());
        caps
    }
}

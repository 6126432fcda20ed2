//! One symbolic analysis for all who factorize matrices of the same pattern at the same time.

use super::Symbolic;
use crate::{Result, Vec3};
use faer::sparse::SymbolicSparseColMatRef;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// The analysis of one pattern, for as long as somebody uses it or keeps it.
#[derive(Default)]
pub struct Analyses(Mutex<Slot>);

#[derive(Default)]
struct Slot {
    used: Weak<Symbolic>,
    kept: Option<Arc<Symbolic>>,
    keepers: usize,
}

/// Keeps an analysis from the first use to the end of its own life.
pub struct Kept<'a>(&'a Analyses);

impl Analyses {
    /// That of `lower`, whose blocks lie at the points: always the same pattern.
    pub fn of(
        &self,
        lower: SymbolicSparseColMatRef<'_, usize>,
        points: impl FnOnce() -> Vec<Vec3>,
    ) -> Result<Arc<Symbolic>> {
        let mut slot = self.slot();
        if let Some(made) = slot.used.upgrade() {
            return Ok(made);
        }
        let made = Arc::new(Symbolic::analyse(lower, &points())?);
        slot.used = Arc::downgrade(&made);
        slot.kept = (slot.keepers > 0).then(|| made.clone());
        Ok(made)
    }

    /// Keeps it from its first use on.
    pub fn keep(&self) -> Kept<'_> {
        self.slot().keepers += 1;
        Kept(self)
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner) // whole at any time
    }
}

impl Drop for Kept<'_> {
    fn drop(&mut self) {
        let mut slot = self.0.slot();
        slot.keepers -= 1;
        if slot.keepers == 0 {
            slot.kept = None;
        }
    }
}

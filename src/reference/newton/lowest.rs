//! The lowest of the shapes that a search comes by.
//!
//! A search that ends well does not ask for it. So Φ is not computed before that is asked for, or shapes become too many to keep.

use super::Newton;
use crate::Vec3;
use crate::reference::potential::Potential;

/// Shapes kept without their Φ.
const KEPT: usize = 8;

/// Φ and the shape (n_vertices) of the lowest so far, and those not yet compared with it: so many of these.
#[derive(Default)]
pub(super) struct Lowest {
    value: f64,
    x: Vec<Vec3>,
    others: Vec<Vec<Vec3>>,
    kept: usize,
}

impl Lowest {
    /// Vectors held.
    pub(super) fn len(&self) -> usize {
        self.x.len() + self.others.iter().map(Vec::len).sum::<usize>()
    }
}

impl Newton {
    /// A search begins at `x`, where Φ has this value.
    pub(in crate::reference) fn pass_first(&mut self, x: &[Vec3], value: f64) {
        let Lowest { value: lowest, x: own, kept, .. } = &mut self.lowest;
        (*lowest, *kept) = (value, 0);
        own.clear();
        own.extend_from_slice(x);
    }

    /// It comes by `x`.
    pub(in crate::reference) fn pass(&mut self, potential: &Potential, x: &[Vec3]) {
        if self.lowest.kept == KEPT {
            self.compare(potential);
        }
        let Lowest { others, kept, .. } = &mut self.lowest;
        match others.get_mut(*kept) {
            Some(other) => other.copy_from_slice(x),
            None => others.push(x.to_vec()),
        }
        *kept += 1;
    }

    /// The lowest shape of all.
    pub(in crate::reference) fn lowest_passed(&mut self, potential: &Potential) -> &[Vec3] {
        self.compare(potential);
        &self.lowest.x
    }

    fn compare(&mut self, potential: &Potential) {
        let Lowest { value, x, others, kept } = &mut self.lowest;
        for other in &mut others[..std::mem::take(kept)] {
            let of_other = potential.value(other).0;
            if of_other < *value {
                *value = of_other;
                std::mem::swap(x, other);
            }
        }
    }
}

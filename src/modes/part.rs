//! The problem in parts: components whose stiffness over mass differs beyond measure are solved each by itself.
//!
//! A block-diagonal A has the modes of its blocks. Solved whole, everything is measured by the largest ‖A‖, so that a shell
//! beside one a ten thousandth of its size loses all digits; solved in parts, each block is measured by its own. Components
//! of like norms stay together, so that the repeated modes of equal shells are found and based as one group.

use super::{ScaledStiffness, entries};
use crate::mesh::NONE;
use crate::{Result, Shell, Vec3};

/// Components whose ‖A‖ differ by more than this are solved apart: it leaves 1e-12 of the larger norm to the smaller.
const LIKE: f64 = 1e4;

/// The free vertices of some components and their block of A.
pub struct Part {
    /// Vertices, ascending.
    pub free: Vec<u32>,
    /// The components they belong to (n_components).
    pub components: Vec<bool>,
    pub stiffness: ScaledStiffness,
}

impl Part {
    /// The parts of the shell, those of the smallest norm first.
    pub fn split(shell: &Shell, whole: ScaledStiffness) -> Result<Vec<Self>> {
        let norms = component_norms(shell, &whole);
        let mut order: Vec<usize> = (0..norms.len()).filter(|&c| norms[c].is_some()).collect();
        let norm = |c: usize| norms[c].unwrap_or_default();
        order.sort_by(|&a, &b| norm(a).total_cmp(&norm(b)));
        let mut groups: Vec<Vec<usize>> = vec![];
        for c in order {
            match groups.last_mut() {
                Some(group) if norm(c) <= LIKE * norm(group[0]) => group.push(c),
                _ => groups.push(vec![c]),
            }
        }
        if groups.len() <= 1 {
            let components = vec![true; norms.len()];
            return Ok(vec![Self { free: shell.free.clone(), components, stiffness: whole }]);
        }
        groups.iter().map(|group| Self::of(shell, &whole, group)).collect()
    }

    fn of(shell: &Shell, whole: &ScaledStiffness, group: &[usize]) -> Result<Self> {
        let mut components = vec![false; shell.mesh.n_components];
        group.iter().for_each(|&c| components[c] = true);
        let inside = |v: u32| components[shell.mesh.component[v as usize] as usize];
        let unknowns: Vec<usize> = (0..shell.n_unknowns()).filter(|k| inside(shell.free[k / 3])).collect();
        let stiffness = whole.restricted(&unknowns)?;
        let free = shell.free.iter().copied().filter(|v| inside(*v)).collect();
        Ok(Self { free, components, stiffness })
    }

    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// Spreads values at the part's unknowns over all vertices; zero elsewhere.
    pub fn scatter(&self, shell: &Shell, unknowns: &[f64]) -> Vec<Vec3> {
        let mut field = vec![Vec3::zeros(); shell.mass.len()];
        for (&v, u) in self.free.iter().zip(unknowns.chunks_exact(3)) {
            field[v as usize] = Vec3::new(u[0], u[1], u[2]);
        }
        field
    }
}

/// ‖A‖₁ of each component's block; `None` where nothing moves.
fn component_norms(shell: &Shell, whole: &ScaledStiffness) -> Vec<Option<f64>> {
    let mut sums = vec![0.0; shell.n_unknowns()];
    for (i, j, a) in entries(&whole.lower) {
        sums[j] += a.abs();
        if i != j {
            sums[i] += a.abs();
        }
    }
    let mut norms = vec![None; shell.mesh.n_components];
    for (k, sum) in sums.into_iter().enumerate() {
        let component = shell.mesh.component[shell.free[k / 3] as usize];
        debug_assert_ne!(component, NONE, "a free vertex has a triangle");
        let norm: &mut Option<f64> = &mut norms[component as usize];
        *norm = Some(norm.unwrap_or_default().max(sum));
    }
    norms
}

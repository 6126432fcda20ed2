//! A tangent that is held while several steps go by it.
//!
//! With the stress σ as an unknown, and K₀ and J₀ = ∂ε/∂x of an earlier shape,
//!
//!   K₀ Δ = −(∇Φ with σ for ε, + J₀ᵀ(ε(x) − σ)),   σ ← ε(x) + J₀ Δ,   x ← x + Δ
//!
//! is the modified Newton method, on (x, σ). On x alone an earlier tangent gains little: a step that is wrong by a small turn stretches the membrane.

use super::Newton;
use super::ahead::AtRest;
use crate::energy::Stress;
use crate::reference::mixed::REACH;
use crate::reference::potential::Potential;
use crate::reference::{free_norm, mass_norm};
use crate::sparse::Factor;
use crate::{Result, Shell, Vec3};
use faer::MatMut;
use std::sync::Arc;

/// Of the last step's length, what the next one by the same tangent may have, and how many go by it. A step takes a fourth to a seventh of the time of a new
/// tangent. With four there are more tangents, with eight no fewer.
const SHORTER: f64 = 0.5;
const MOST: usize = 6;

/// J at a shape: the rows of the elements, one behind the other, with their vertices and where each ends.
#[derive(Default)]
pub(super) struct Rows {
    ends: Vec<u32>,
    vertices: Vec<u32>,
    rows: Vec<Vec3>,
}

impl Rows {
    /// Takes those at `x`.
    pub(super) fn take(&mut self, shell: &Shell, x: &[Vec3]) {
        let Self { ends, vertices, rows } = self;
        ends.clear();
        vertices.clear();
        rows.clear();
        shell.energy.visit_rows(x, &mut |(of, row)| {
            vertices.extend_from_slice(of);
            rows.extend_from_slice(row);
            ends.push(rows.len() as u32);
        });
    }

    /// Hands the vertices and the row of each element to `visit`.
    fn visit(&self, mut visit: impl FnMut(&[u32], &[Vec3])) {
        let mut first = 0;
        for end in self.ends.iter().map(|end| *end as usize) {
            visit(&self.vertices[first..end], &self.rows[first..end]);
            first = end;
        }
    }

    /// J `way`, of n_vertices.
    fn times(&self, way: &[Vec3]) -> Vec<f64> {
        let mut strain = Vec::with_capacity(self.ends.len());
        self.visit(|vertices, row| strain.push(vertices.iter().zip(row).map(|(v, b)| b.dot(&way[*v as usize])).sum()));
        strain
    }

    /// Jᵀ of a number for each element, by vertex of n.
    fn transposed_times(&self, mut numbers: impl Iterator<Item = f64>, n: usize) -> Vec<Vec3> {
        let mut field = vec![Vec3::zeros(); n];
        self.visit(|vertices, row| {
            let number = numbers.next().unwrap_or(0.0);
            vertices.iter().zip(row).for_each(|(v, b)| field[*v as usize] += number * b);
        });
        field
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        4 * (self.ends.capacity() + self.vertices.capacity()) + size_of::<Vec3>() * self.rows.capacity()
    }
}

/// The tangent that is held.
#[derive(Default)]
pub(in crate::reference) enum Held {
    /// None.
    #[default]
    Nothing,
    /// The last one that was factorized, with the rows at hand.
    Own,
    /// That at rest, which solvers share.
    AtRest(Arc<AtRest>),
}

/// A way (n_vertices), and what it stretches the elements by along the rows of its tangent.
#[derive(Clone)]
pub(super) struct Way {
    pub along: Vec<Vec3>,
    pub strain: Vec<f64>,
}

impl Way {
    /// So much of it.
    pub(super) fn scaled(&self, part: f64) -> Self {
        Self {
            along: self.along.iter().map(|along| part * along).collect(),
            strain: self.strain.iter().map(|strain| part * strain).collect(),
        }
    }
}

/// Where a search is.
pub(super) struct Place {
    /// σ and ε (n_elements).
    pub stress: Vec<f64>,
    pub strain: Vec<f64>,
    /// ∇Φ with σ for ε (n_vertices).
    force: Vec<Vec3>,
    /// The length of the last step by the tangent that is held, by mass, and how many went by that.
    last: f64,
    pub steps: usize,
}

impl Place {
    /// At a shape of n vertices with these strains.
    pub(super) fn new(n: usize, strain: Vec<f64>) -> Self {
        Self { stress: strain.clone(), strain, force: vec![Vec3::zeros(); n], last: f64::INFINITY, steps: 0 }
    }
}

impl Newton {
    /// Makes and holds the tangent at `x` of a `stress`; false, and none is held, where it is not positive definite.
    pub(super) fn hold(&mut self, potential: &Potential, x: &[Vec3], stress: &[f64]) -> Result<bool> {
        potential.assemble_mixed(&mut self.parts, x, Stress::whole(stress), &mut self.matrix);
        self.noise.measure(potential, x, &self.matrix);
        if self.matrix.require_finite().is_err() || !self.refactorize()? {
            return Ok(false);
        }
        self.rows.take(potential.shell, x);
        self.held = Held::Own;
        Ok(true)
    }

    /// Whether there is one.
    pub(super) fn holds(&self) -> bool {
        !matches!(self.held, Held::Nothing)
    }

    /// Its factor and rows.
    fn held_tangent(&self) -> (&Factor, &Rows) {
        match &self.held {
            Held::AtRest(rest) => (&rest.factor, &rest.rows),
            _ => (&self.factor, &self.rows),
        }
    }

    /// The way that the tangent held goes against a `force` (n_vertices).
    pub(super) fn way_against(&mut self, potential: &Potential, force: &[Vec3]) -> Result<Way> {
        let mut direction = std::mem::take(&mut self.direction);
        direction.clear();
        direction.extend(potential.free().flat_map(|v| (-force[v]).data.0[0]));
        let n = direction.len();
        let (factor, rows) = self.held_tangent();
        let solved = self.symbolic.solve_in_place(factor, MatMut::from_column_major_slice_mut(&mut direction, n, 1));
        let mut along = vec![Vec3::zeros(); force.len()];
        potential.free().zip(direction.chunks_exact(3)).for_each(|(v, d)| along[v] = Vec3::from_column_slice(d));
        let strain = rows.times(&along);
        self.direction = direction;
        solved.map(|()| Way { strain, along })
    }

    /// The way that it goes against ∇Φ.
    pub(super) fn way_down(&mut self, potential: &Potential) -> Result<Way> {
        let gradient = std::mem::take(&mut self.gradient);
        let way = self.way_against(potential, &gradient);
        self.gradient = gradient;
        way
    }

    /// Finds the forces at `x`. Returns ‖∇Φ‖.
    pub(super) fn look_around(&mut self, potential: &Potential, x: &[Vec3], at: &mut Place) -> f64 {
        let Place { stress, strain, force, .. } = at;
        potential.both_gradients(&mut self.parts, x, (stress, strain), [&mut self.gradient, force]);
        free_norm(potential.shell, &self.gradient)
    }

    /// One more way by the tangent that is held, unless enough went by it.
    pub(super) fn next_way(&mut self, potential: &Potential, at: &Place) -> Result<Option<Way>> {
        if at.steps >= MOST || !self.holds() {
            return Ok(None);
        }
        let (_, rows) = self.held_tangent();
        let lacking = at.strain.iter().zip(&at.stress).map(|(strain, stress)| strain - stress);
        let mut force = rows.transposed_times(lacking, at.force.len());
        potential.project(&mut force);
        force.iter_mut().zip(&at.force).for_each(|(sum, force)| *sum += force);
        self.way_against(potential, &force).map(Some)
    }

    /// Whether a way is enough shorter than the last step.
    pub(super) fn is_shorter(potential: &Potential, way: &Way, at: &Place) -> bool {
        mass_norm(potential.shell, |v| way.along[v]) <= SHORTER * at.last
    }

    /// Goes a way, or as much of it as is in reach; whether all of it is.
    pub(super) fn go(&mut self, potential: &Potential, x: &mut [Vec3], at: &mut Place, way: &Way) -> bool {
        let shell = potential.shell;
        let Way { along, strain } = way;
        let longest = potential.free().map(|v| along[v].norm()).fold(0.0, f64::max);
        let part = (REACH * shell.mesh.size / longest).min(1.0);
        potential.free().for_each(|v| x[v] += part * along[v]);
        at.stress.clear();
        at.stress.extend(at.strain.iter().zip(strain).map(|(own, more)| own + part * more));
        at.last = part * mass_norm(shell, |v| along[v]);
        at.steps += 1;
        part == 1.0
    }
}

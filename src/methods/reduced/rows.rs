//! Constraints of the reduced shell as rows that are linear in q, and what became of them.

use super::{At, Reduced};
use crate::constraint::{Outcome, Target};
use crate::reduced::with_fields;
use crate::reference::orientation::{Ring, missing_turn, part_way};
use crate::{Shell, Vec3, rotation, wide_norm};
use nalgebra::DVector;

/// Displacement, in units of the model's size, over which the curvature of orientations is found by differences.
const DIFFERENCE: f64 = 1e-5;
/// Root mean square displacement, in units of the model's size, up to which constraints are followed. No shell reaches it unless it is
/// stretched three times over or its few fields know no smaller way; far beyond, a fold of no area catches the energy.
const REACH: f64 = 2.0;

/// How much of their way from q constraints are led. A spring that a step finds stretched acts whole in all of it.
#[derive(Clone, Copy)]
pub(super) struct Shares {
    hard: f64,
    soft: f64,
}

impl Shares {
    /// Of the way in a step.
    pub fn of_step(share: f64) -> Self {
        Self { hard: share, soft: 1.0 }
    }

    /// Of the way to an equilibrium.
    pub fn of_load(share: f64) -> Self {
        Self { hard: share, soft: share }
    }
}

/// The triangles at a vertex, from those made before or anew.
pub(super) fn ring_of<'a>(rings: &'a mut Vec<(u32, Ring)>, shell: &Shell, vertex: u32) -> &'a Ring {
    let at = rings.iter().position(|(v, _)| *v == vertex).unwrap_or_else(|| {
        rings.push((vertex, Ring::of(&shell.mesh, vertex)));
        rings.len() - 1
    });
    &rings[at].1
}

/// The ring's vertices at x̄ + Bq.
pub(super) fn places(at: At, ring: &Ring, q: &[f64]) -> Vec<Vec3> {
    let mut x = ring.gather(&at.shell.mesh.positions);
    let place = |i: usize, u: Vec3| x[i] += u;
    with_fields!(&at.reduced.fields, fields => fields.displacements_of(q, &ring.vertices, place));
    x
}

impl Reduced {
    pub(super) fn holds_orientations(&self) -> bool {
        self.constraints.report().any(|(c, _)| matches!(c.target, Target::Orientation(_)))
    }

    /// The constraints' rows about the next q: world axes of each vertex, and where they shall be at this share of the way from q; of
    /// an orientation its rotation vector to the target, to first order.
    pub(super) fn set_rows(&mut self, at: At, shares: Shares) {
        let At { shell, reduced, axes, .. } = at;
        let mut row = 0;
        for (c, _) in self.constraints.report() {
            let pose = axes.of(c.vertex);
            let to_frame = pose.rotation.inverse();
            let share = if c.compliance > 0.0 { shares.soft } else { shares.hard };
            let turn = match c.target {
                Target::Position(_) => None,
                Target::Orientation(world) => {
                    let ring = ring_of(&mut self.rings, shell, c.vertex);
                    let start = ring.rotation(&places(at, ring, &self.motion.q));
                    let (present, by_vertex) = ring.turn(&places(at, ring, &self.next));
                    let (missing, inverse) = missing_turn(&part_way(&start, &(to_frame * world), share), &present);
                    Some((missing, inverse, by_vertex, ring))
                }
            };
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                let direction = to_frame * Vec3::ith(axis, 1.0);
                self.rows.compliance[row] = c.compliance;
                for k in 0..self.next.len() {
                    let field = |v: u32| with_fields!(&reduced.fields, fields => fields.at(k, v as usize));
                    self.rows.jacobian[(k, row)] = match &turn {
                        None => field(c.vertex).dot(&direction),
                        Some((_, inverse, by_vertex, ring)) => {
                            let turned: Vec3 = by_vertex.iter().zip(&ring.vertices).map(|(by, v)| by * field(*v)).sum();
                            (inverse * turned).dot(&direction)
                        }
                    };
                }
                self.rows.target[row] = match (&turn, c.target) {
                    (None, Target::Position(world)) => {
                        let rest = shell.mesh.positions[c.vertex as usize];
                        let goal = direction.dot(&(to_frame * (world - pose.origin) - rest));
                        let held = self.rows.along(row, &self.motion.q);
                        if share == 1.0 { goal } else { held + share * (goal - held) }
                    }
                    (Some((missing, ..)), _) => direction.dot(missing) + self.rows.along(row, &self.next),
                    _ => continue,
                };
                row += 1;
            }
        }
        self.rows.reach = REACH * shell.mesh.size * shell.total_mass.sqrt();
    }

    /// The largest component of a turn that hard orientations still miss, by the rows as set about the next q, rad.
    pub(super) fn missing_turn_of_rows(&self) -> f64 {
        let (mut row, mut largest) = (0, 0.0f64);
        for (c, _) in self.constraints.report() {
            for _ in c.axes.iter().filter(|held| **held) {
                if matches!(c.target, Target::Orientation(_)) && c.compliance == 0.0 {
                    largest = largest.max((self.rows.target[row] - self.rows.along(row, &self.next)).abs());
                }
                row += 1;
            }
        }
        largest
    }

    /// Sets −Σ μ ∂²c/∂q², c the left sides of the constraints about the next q, by differences: their part of the Hessian under
    /// forces μ. In the room of the viscosity, which a step makes anew.
    pub(super) fn set_curvature(&mut self, at: At, shares: Shares, force: &DVector<f64>) {
        let shell = at.shell;
        let step = DIFFERENCE * shell.mesh.size * shell.total_mass.sqrt();
        self.viscosity.fill(0.0);
        for k in 0..self.next.len() {
            let here = self.next[k];
            for side in [step, -step] {
                self.next[k] = here + side;
                self.set_rows(at, shares);
                self.viscosity.column_mut(k).gemv(-0.5 / side, &self.rows.jacobian, force, 1.0);
            }
            self.next[k] = here;
        }
        let transpose = self.viscosity.transpose();
        self.viscosity += transpose;
        self.viscosity *= 0.5;
    }

    /// Takes down how constraints were met.
    pub(super) fn record_outcomes(&mut self, at: At) {
        let Self { rows, rings, newton, constraints, next, .. } = self;
        let force = newton.multipliers();
        let mut row = 0;
        for (c, outcome) in constraints.pending() {
            let turn = match c.target {
                Target::Position(_) => None,
                Target::Orientation(world) => {
                    let ring = ring_of(rings, at.shell, c.vertex);
                    let present = at.axes.of(c.vertex).rotation * ring.rotation(&places(at, ring, next));
                    Some(rotation::vector(&(world * present.inverse())))
                }
            };
            *outcome = Outcome { iterations: 1, ..Outcome::default() };
            let mut missing = Vec3::zeros();
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                outcome.force[axis] = force[row];
                missing[axis] = turn.map_or_else(|| rows.target[row] - rows.along(row, next), |turn| turn[axis]);
                row += 1;
            }
            outcome.residual = wide_norm(&missing);
        }
    }
}

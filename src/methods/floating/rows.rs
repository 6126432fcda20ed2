//! Constraints of a floating shell as rows that are linear in its coordinates about the guess, and what became of them.

use super::place::Place;
use super::{At, Floating};
use crate::constraint::{Constraint, Outcome, Target};
use crate::reduced::{Rows, with_fields};
use crate::reference::orientation::{Ring, missing_turn, part_way};
use crate::{Shell, Vec3, rotation, wide_norm};
use nalgebra::UnitQuaternion;

/// Root mean square displacement of the fields, in units of the model's size, up to which constraints are followed.
const REACH: f64 = 2.0;

/// How much of their way constraints are led. A spring that a step finds stretched acts whole in all of it.
#[derive(Clone, Copy)]
pub(super) struct Shares {
    pub hard: f64,
    pub soft: f64,
}

/// The triangles at a vertex, from those made before or anew.
pub(super) fn ring_of<'a>(rings: &'a mut Vec<(u32, Ring)>, shell: &Shell, vertex: u32) -> &'a Ring {
    let at = rings.iter().position(|(v, _)| *v == vertex).unwrap_or_else(|| {
        rings.push((vertex, Ring::of(&shell.mesh, vertex)));
        rings.len() - 1
    });
    &rings[at].1
}

/// y of a vertex, body axes.
fn arm(at: At, v: u32, place: &Place) -> Vec3 {
    let mut y = at.shell.mesh.positions[v as usize] - at.rigid.pivot;
    with_fields!(&at.reduced.fields, fields => {
        place.q.iter().enumerate().for_each(|(k, q)| y += *q * fields.at(k, v as usize));
    });
    y
}

/// Where a vertex is in the frame.
pub(super) fn position(at: At, v: u32, place: &Place) -> Vec3 {
    at.rigid.pivot + place.slide + place.turn * arm(at, v, place)
}

/// The ring's vertices in the frame.
pub(super) fn places(at: At, ring: &Ring, place: &Place) -> Vec<Vec3> {
    ring.vertices.iter().map(|v| position(at, *v, place)).collect()
}

/// Adds to a row what the coordinates move vertex `v` along a vector in the frame's axes.
fn add_along(at: At, (v, place): (u32, &Place), direction: &Vec3, row: &mut [f64]) {
    let along = place.turn.inverse() * direction;
    let (fields_row, rigid_row) = row.split_at_mut(at.reduced.n());
    with_fields!(&at.reduced.fields, fields => {
        fields_row.iter_mut().enumerate().for_each(|(k, out)| *out += fields.at(k, v as usize).dot(&along));
    });
    at.rigid.add_force(&arm(at, v, place).cross(&along), &along, rigid_row);
}

impl Floating {
    /// The rows about the next place, whose coordinates are the guess's, at this share of the way from where the step began.
    pub(super) fn set_rows(&mut self, at: At, shares: Shares) {
        let Self { rows, rings, constraints, next, place, room, .. } = self;
        let to_frame = at.pose.rotation.inverse();
        let (mut row, mut far) = (0, 0.0f64);
        for (c, _) in constraints.report() {
            let share = if c.compliance > 0.0 { shares.soft } else { shares.hard };
            let missing = match c.target {
                Target::Position(world) => {
                    let goal = to_frame * (world - at.pose.origin);
                    let (from, here) = (position(at, c.vertex, place), position(at, c.vertex, next));
                    far = far.max((goal - here).norm());
                    if share == 1.0 { goal - here } else { from + share * (goal - from) - here }
                }
                Target::Orientation(world) => {
                    let ring = ring_of(rings, at.shell, c.vertex);
                    let start = ring.rotation(&places(at, ring, place));
                    let present = ring.rotation(&places(at, ring, next));
                    missing_turn(&part_way(&start, &(to_frame * world), share), &present).0
                }
            };
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                let direction = to_frame * Vec3::ith(axis, 1.0);
                rows.compliance[row] = c.compliance;
                let mut column = rows.jacobian.column_mut(row);
                column.fill(0.0);
                set_row(at, (c, rings), (next, place, share), &direction, column.as_mut_slice());
                rows.target[row] = direction.dot(&missing) + rows.along(row, &room.guess);
                row += 1;
            }
        }
        // Rigid motion follows any distance; the fields only some.
        let size = at.shell.mesh.size;
        rows.reach =
            at.shell.total_mass.sqrt() * (REACH * size + 2.0 * far) + room.guess.iter().map(|z| z.abs()).sum::<f64>();
    }

    /// Power of the constraints at rates of the fields and the frame, by the rows and forces of the last search.
    pub(super) fn power_of_constraints(&mut self) -> f64 {
        let Self { rows, newton, next_rates, next, room, rigid, .. } = self;
        if rows.is_empty() {
            return 0.0;
        }
        let n = next_rates.q.len();
        room.z[..n].copy_from_slice(&next_rates.q);
        rigid.coordinates(&next_rates.spin, &(next.turn.inverse() * next_rates.slide), &mut room.z[n..]);
        (0..rows.len()).map(|i| newton.multipliers()[i] * rows.along(i, &room.z)).sum()
    }

    /// Takes down how constraints were met at the next place.
    pub(super) fn record_outcomes(&mut self, at: At) {
        let Self { rings, newton, constraints, next, .. } = self;
        let force = newton.multipliers();
        let mut row = 0;
        for (c, outcome) in constraints.pending() {
            let missing = match c.target {
                Target::Position(world) => world - (at.pose.origin + at.pose.rotation * position(at, c.vertex, next)),
                Target::Orientation(world) => {
                    let ring = ring_of(rings, at.shell, c.vertex);
                    let present = at.pose.rotation * ring.rotation(&places(at, ring, next));
                    rotation::vector(&(world * present.inverse()))
                }
            };
            *outcome = Outcome { iterations: 1, ..Outcome::default() };
            let mut held = Vec3::zeros();
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                outcome.force[axis] = force[row];
                held[axis] = missing[axis];
                row += 1;
            }
            outcome.residual = wide_norm(&held);
        }
    }

    /// The rows of the constraints as forces on vertices (frame axes), by the forces of the last search: position rows alone.
    pub(super) fn pulls(
        rows: &Rows,
        constraints: &[Constraint],
        force: &[f64],
        to_frame: &UnitQuaternion<f64>,
    ) -> Vec<(u32, Vec3)> {
        let mut row = 0;
        let mut found = vec![];
        for c in constraints {
            let mut pull = Vec3::zeros();
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                if row < rows.len() {
                    pull += force[row] * (to_frame * Vec3::ith(axis, 1.0));
                }
                row += 1;
            }
            if matches!(c.target, Target::Position(_)) {
                found.push((c.vertex, pull));
            }
        }
        found
    }
}

/// The row of a constraint along a direction of the frame.
fn set_row(
    at: At,
    (c, rings): (&Constraint, &mut Vec<(u32, Ring)>),
    (next, place, share): (&Place, &Place, f64),
    direction: &Vec3,
    row: &mut [f64],
) {
    let Target::Orientation(world) = c.target else {
        return add_along(at, (c.vertex, next), direction, row);
    };
    let to_frame = at.pose.rotation.inverse();
    let ring = ring_of(rings, at.shell, c.vertex);
    let start = ring.rotation(&places(at, ring, place));
    let (present, by_vertex) = ring.turn(&places(at, ring, next));
    let (_, inverse) = missing_turn(&part_way(&start, &(to_frame * world), share), &present);
    for (by, v) in by_vertex.iter().zip(&ring.vertices) {
        add_along(at, (*v, next), &(inverse * by).tr_mul(direction), row);
    }
}

//! Which part each constraint plays, told from its shell: prescribed, a spring, or a turn.

use super::springs::Spring;
use super::{Constraints, Hold, Part, Turn};
use crate::constraint::{Constraint, Target};
use crate::mesh::NONE;
use crate::reference::orientation::Ring;
use crate::{Shell, Vec3};
use nalgebra::{Matrix3, UnitQuaternion};

/// A spring stiffer than this many times its vertex is hard: it gives way by less than a millionth of what the shell does.
const HARD: f64 = 1e6;

impl Constraints {
    /// `list` along `axes` on a shell that starts at positions `x`.
    pub fn new(shell: &Shell, axes: Matrix3<f64>, list: Vec<Constraint>, x: &[Vec3]) -> Self {
        if list.is_empty() {
            return Self::none();
        }
        let stiffness = vertex_stiffness(shell);
        let hold_at = vec![NONE; x.len()];
        let mut moves = vec![false; x.len()];
        shell.free.iter().for_each(|v| moves[*v as usize] = true);
        let mut constraints = Self { axes, hold_at, moves, rollers: shell.rollers.clone(), ..Self::none() };
        for constraint in &list {
            let part = match constraint.target {
                Target::Position(_) if !constraints.moves[constraint.vertex as usize] => Part::Idle,
                Target::Position(place) => constraints.add_position(constraint, place, &stiffness, x),
                Target::Orientation(target) => {
                    let ring = Ring::of(&shell.mesh, constraint.vertex);
                    let idle = !ring.vertices.iter().any(|v| constraints.moves[*v as usize]);
                    if idle {
                        Part::Idle
                    } else {
                        constraints.add_turn(constraint, target, ring, (shell, &stiffness), x)
                    }
                }
            };
            constraints.parts.push(part);
        }
        constraints.list = list;
        constraints.average_holds();
        constraints
    }

    fn add_position(&mut self, constraint: &Constraint, place: Vec3, stiffness: &[f64], x: &[Vec3]) -> Part {
        let v = constraint.vertex as usize;
        if constraint.compliance * HARD * stiffness[v] > 1.0 {
            let along = (0..3).filter(|a| constraint.axes[*a]).map(|a| self.axes.column(a).into_owned());
            let sum: Matrix3<f64> = along.map(|d| d * d.transpose() / constraint.compliance).sum();
            return Part::Spring(self.springs.push(constraint.vertex, Spring { stiffness: sum, place, start: x[v] }));
        }
        if self.hold_at[v] == NONE {
            self.hold_at[v] = self.holds.len() as u32;
            let (free, stiffness) = (Matrix3::identity(), stiffness[v]);
            let [place, start] = [x[v]; 2];
            self.holds.push(Hold { vertex: constraint.vertex, held: [false; 3], free, place, start, stiffness });
        }
        Part::Hold(self.hold_at[v] as usize)
    }

    fn add_turn(
        &mut self,
        constraint: &Constraint,
        target: UnitQuaternion<f64>,
        ring: Ring,
        (shell, stiffness): (&Shell, &[f64]),
        x: &[Vec3],
    ) -> Part {
        let turns = ring.turn(&ring.gather(&shell.mesh.positions)).1;
        let (mut resists, mut turned) = (0.0, 0.0);
        for (v, turn) in ring.vertices.iter().zip(&turns) {
            resists += stiffness[*v as usize];
            turned += turn.norm_squared();
        }
        let resists = resists / turned.max(f64::MIN_POSITIVE);
        let start = ring.rotation(&ring.gather(x));
        let Constraint { axes: held, compliance, .. } = *constraint;
        self.turns.push(Turn { ring, held, compliance, resists, torque: Vec3::zeros(), target, start });
        Part::Turn(self.turns.len() - 1)
    }

    /// The same from positions `x`, without pins; orientations keep their torques.
    pub fn renew(&mut self, shell: &Shell, x: &[Vec3]) {
        let torques = self.torques();
        *self = Self::new(shell, self.axes, std::mem::take(&mut self.list), x);
        self.set_torques(torques);
    }

    /// Holds vertices of the shell at `x` along unit directions besides, until the next constraints.
    pub fn pin(&mut self, pins: &[(u32, Vec3)], x: &[Vec3]) {
        self.hold_at.resize(x.len(), NONE);
        for &(vertex, direction) in pins {
            let at = &mut self.hold_at[vertex as usize];
            if *at == NONE {
                *at = self.holds.len() as u32;
                let [place, start] = [x[vertex as usize]; 2];
                let (held, free) = ([false; 3], Matrix3::identity());
                self.holds.push(Hold { vertex, held, free, place, start, stiffness: 1.0 });
            }
            take(&mut self.holds[*at as usize].free, direction);
        }
    }

    /// Several constraints on one axis of a vertex: the mean, which is the nearest to all.
    fn average_holds(&mut self) {
        for h in 0..self.holds.len() {
            let left = self.supported(self.holds[h].vertex);
            let hold = &mut self.holds[h];
            let mut place = self.axes.tr_mul(&hold.place);
            for axis in 0..3 {
                let targets = self.list.iter().zip(&self.parts).filter_map(|(constraint, part)| {
                    match (part, constraint.target) {
                        (Part::Hold(at), Target::Position(target)) if *at == h && constraint.axes[axis] => Some(target),
                        _ => None,
                    }
                });
                let (count, sum) = targets
                    .fold((0.0, 0.0), |(count, sum), target| (count + 1.0, sum + self.axes.column(axis).dot(&target)));
                if count > 0.0 {
                    (hold.held[axis], place[axis]) = (true, sum / count);
                    match left == Matrix3::identity() {
                        true => hold.free -= self.axes.column(axis) * self.axes.column(axis).transpose(),
                        false => take(&mut hold.free, left * self.axes.column(axis)),
                    }
                }
            }
            hold.place = self.axes * place;
        }
    }
}

/// Takes a direction from P; of what is held along already, nothing.
fn take(free: &mut Matrix3<f64>, direction: Vec3) {
    if let Some(n) = (*free * direction).try_normalize(1e-6) {
        *free -= n * n.transpose();
    }
}

/// Mean of the diagonal entries of the rest stiffness at each vertex (n_vertices).
pub fn vertex_stiffness(shell: &Shell) -> Vec<f64> {
    let mut stiffness = vec![0.0; shell.mass.len()];
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        vertices.iter().zip(row).for_each(|(&v, b)| stiffness[v as usize] += b.norm_squared() / 3.0);
    });
    stiffness
}

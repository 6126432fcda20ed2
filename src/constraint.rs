//! Constraints: what holds a vertex's position or orientation at a target, for all methods.

use crate::support::Pose;
use crate::{Error, Result, Vec3};
use nalgebra::UnitQuaternion;

/// What a constraint holds, and where: in world space, or [`Target::in_frame`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// The vertex's position.
    Position(Vec3),
    /// The orientation of the vertex's frame, which at rest is the support frame's.
    Orientation(UnitQuaternion<f64>),
}

impl Target {
    /// A target in world space, as seen from a frame.
    pub fn in_frame(self, pose: &Pose) -> Self {
        let to_frame = pose.rotation.inverse();
        match self {
            Self::Position(world) => Self::Position(to_frame * (world - pose.origin)),
            Self::Orientation(world) => Self::Orientation(to_frame * world),
        }
    }
}

/// What holds one vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constraint {
    /// The host's number for it; setting a number again replaces.
    pub id: u32,
    /// Vertex held.
    pub vertex: u32,
    /// World axes along (position) or about (orientation) which it holds.
    pub axes: [bool; 3],
    /// Displacement per force, or rotation per torque; 0 = hard.
    pub compliance: f64,
    /// Where to.
    pub target: Target,
}

/// How well a constraint was met in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// What is missing along the held axes: length or rad.
    pub residual: f64,
    /// Force (world axes) or torque on the shell over the step.
    pub force: Vec3,
    /// Linearizations that the whole set took.
    pub iterations: u32,
}

/// A hard constraint is met below this, in model sizes or rad.
pub const MET: f64 = 1e-6;

/// The constraints of a state, by ascending id, with what the last step made of each.
#[derive(Clone, Default)]
pub struct ConstraintSet {
    items: Vec<Constraint>,
    outcomes: Vec<Outcome>,
    /// Of a step that is not known to be good yet.
    pending: Vec<Outcome>,
    /// Work done on the shell since rest.
    pub work: f64,
}

impl ConstraintSet {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// The constraints in order of their ids.
    pub fn items(&self) -> &[Constraint] {
        &self.items
    }

    /// The same with their outcomes.
    pub fn report(&self) -> impl ExactSizeIterator<Item = (&Constraint, &Outcome)> {
        self.items.iter().zip(&self.outcomes)
    }

    /// Adds a constraint, or replaces the one with its id. Returns whether anything changed.
    pub fn set(&mut self, constraint: Constraint, n_vertices: usize) -> Result<bool> {
        let Constraint { id, vertex, axes, compliance, .. } = constraint;
        if vertex as usize >= n_vertices {
            return Err(Error::argument(format!("constraint {id} is at vertex {vertex} of {n_vertices}")));
        }
        if !(compliance.is_finite() && compliance >= 0.0) {
            return Err(Error::argument(format!("constraint {id} has the compliance {compliance:?}")));
        }
        if axes == [false; 3] {
            return Err(Error::argument(format!("constraint {id} holds no axis")));
        }
        match self.items.binary_search_by_key(&id, |c| c.id) {
            Ok(at) if self.items[at] == constraint => return Ok(false),
            Ok(at) => self.items[at] = constraint,
            Err(at) => {
                self.items.insert(at, constraint);
                self.outcomes.insert(at, Outcome::default());
                self.pending.insert(at, Outcome::default());
            }
        }
        Ok(true)
    }

    /// Multiplies all forces and the work by `factor`, and divides compliances, as the shell's stiffness changes.
    pub fn scale_forces(&mut self, factor: f64) {
        self.items.iter_mut().for_each(|constraint| constraint.compliance /= factor);
        for outcome in self.outcomes.iter_mut().chain(&mut self.pending) {
            outcome.force *= factor;
        }
        self.work *= factor;
    }

    /// Removes the constraint with this id; false if there is none.
    pub fn clear(&mut self, id: u32) -> bool {
        let found = self.items.binary_search_by_key(&id, |c| c.id);
        if let Ok(at) = found {
            self.items.remove(at);
            self.outcomes.remove(at);
            self.pending.remove(at);
        }
        found.is_ok()
    }

    /// Removes all; the work that they did stays.
    pub fn clear_all(&mut self) {
        *self = Self { work: self.work, ..Self::default() };
    }

    /// Moves the target of the constraint with this id, for a part of a step.
    pub fn lead(&mut self, id: u32, target: Target) {
        if let Ok(at) = self.items.binary_search_by_key(&id, |c| c.id) {
            self.items[at].target = target;
        }
    }

    /// Replaces the forces that the last step reports, by ascending id.
    pub fn report_forces(&mut self, forces: &[Vec3]) {
        self.outcomes.iter_mut().zip(forces).for_each(|(outcome, force)| outcome.force = *force);
    }

    /// For a step to say what it makes of each.
    pub fn pending(&mut self) -> impl Iterator<Item = (&Constraint, &mut Outcome)> {
        self.items.iter().zip(&mut self.pending)
    }

    /// Whether the pending outcomes are numbers.
    pub fn is_finite(&self) -> bool {
        self.pending.iter().all(|o| o.residual.is_finite() && o.force.iter().all(|f| f.is_finite()))
    }

    /// Whether the pending outcomes are those of the last step.
    pub fn is_unchanged(&self) -> bool {
        self.pending == self.outcomes
    }

    /// Makes the pending outcomes the report, and adds the `work` of the step: it is good.
    pub fn accept(&mut self, work: f64) {
        self.outcomes.copy_from_slice(&self.pending);
        self.work += work;
    }

    /// Forgets what steps made of them.
    pub fn reset(&mut self) {
        self.outcomes.fill(Outcome::default());
        self.work = 0.0;
    }
}

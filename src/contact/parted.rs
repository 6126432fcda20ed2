//! What a step that is taken in parts goes back to, and between what it leads.

use super::{Contacts, Obstacle, Touching};
use crate::Vec3;
use crate::constraint::{Constraint, ConstraintSet, Target};

/// Room for all of it, so that a step does not allocate.
#[derive(Clone, Default)]
pub struct Parted {
    touching: Vec<Touching>,
    obstacles: Vec<Obstacle>,
    /// Unknowns and rates when the step began.
    unknowns: [Vec<f64>; 2],
    /// Hard constraints of positions, with where their vertices were (world space).
    led: Vec<(Constraint, Vec3)>,
    /// Of each constraint, its force so far by shares of the step.
    forces: Vec<Vec3>,
}

impl Parted {
    /// For so many contacts and solids.
    pub fn reserve(&mut self, contacts: usize, obstacles: usize) {
        self.touching.reserve(contacts);
        self.obstacles.reserve(obstacles);
    }

    /// The step has ended: nothing else may hold on to a mesh that deforms.
    pub fn end(&mut self) {
        self.obstacles.clear();
    }

    /// For so many constraints.
    pub fn expect_constraints(&mut self, n: usize) {
        self.led.reserve(n.saturating_sub(self.led.len()));
        self.forces.reserve(n.saturating_sub(self.forces.len()));
    }
}

impl Contacts {
    /// Notes where a step in parts begins: from these unknowns, with the end positions set, led by these constraints.
    pub fn part(&mut self, constraints: &ConstraintSet) {
        let Self { parted, pressed, obstacles, unknowns, end, .. } = self;
        parted.touching.clone_from(&pressed.list);
        parted.obstacles.clone_from(obstacles);
        parted.unknowns.clone_from(unknowns);
        parted.led.clear();
        let hard = |c: &&Constraint| c.compliance == 0.0 && matches!(c.target, Target::Position(_));
        parted.led.extend(constraints.items().iter().filter(hard).map(|c| (*c, end[c.vertex as usize])));
        parted.forces.clear();
        parted.forces.resize(constraints.items().len(), Vec3::zeros());
    }

    /// Sets where solids and constraints are to be after this share of the step.
    pub fn lead(&mut self, share: f64, constraints: &mut ConstraintSet) {
        for (obstacle, begun) in self.obstacles.iter_mut().zip(&self.parted.obstacles) {
            obstacle.target = if share == 1.0 { begun.target } else { begun.pose.toward(&begun.target, share) };
        }
        for (constraint, from) in &self.parted.led {
            let Target::Position(to) = constraint.target else { continue };
            let at = if share == 1.0 { to } else { from + share * (to - from) };
            constraints.lead(constraint.id, Target::Position(at));
        }
    }

    /// Adds the forces of constraints in a part that is this share of the step.
    pub fn count(&mut self, share: f64, constraints: &ConstraintSet) {
        for (sum, (_, outcome)) in self.parted.forces.iter_mut().zip(constraints.report()) {
            *sum += share * outcome.force;
        }
    }

    /// The forces over the whole step.
    pub fn mean_forces(&self) -> &[Vec3] {
        &self.parted.forces
    }

    /// Puts back contacts and solids as they were; returns the unknowns then.
    pub fn part_in_vain(&mut self) -> [&[f64]; 2] {
        self.obstacles.clone_from(&self.parted.obstacles);
        std::mem::swap(&mut self.before, &mut self.parted.touching);
        self.undo();
        self.came_at = None;
        self.parted.obstacles.clear();
        [&self.parted.unknowns[0], &self.parted.unknowns[1]]
    }
}

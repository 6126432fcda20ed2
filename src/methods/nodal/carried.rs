//! The full shell on a rest shape that moves.
//!
//! Its unknowns are those of every method there: a vertex is at x = a + Q (r + u), and y = a + Qr is where it rests. What it solves is the shell of
//! that shape, E(x; y) with the masses of the mesh, from x − y = Qu and the rate Qu̇, under forces turned by Q. So a shape that is bent
//! has its own stiffness here, and what damps is the motion on the shape.

use super::Nodal;
use crate::constraint::{Constraint, Target};
use crate::energy::Mat3;
use crate::point_energy::InFrame;
use crate::support::Pose;
use crate::{Result, Shell, Vec3};
use std::sync::Arc;

/// The axes of the vertices, and the shell that rests there once it is needed.
#[derive(Clone)]
pub(super) struct Carried {
    pub(super) axes: Arc<[Pose]>,
    shell: Option<Arc<Shell>>,
}

impl Carried {
    /// Where a vertex is that is at `z` in its axes.
    pub(super) fn place(&self, v: usize, z: &Vec3) -> Vec3 {
        self.axes[v].place(z)
    }

    /// The shell that rests there.
    pub(super) fn shell(&self, of: &Shell) -> Result<Arc<Shell>> {
        self.shell.clone().map_or_else(|| of.carried(&self.axes).map(Arc::new), Ok)
    }

    /// A constraint as the solver takes it: orientations are from the rest shape.
    fn seen(&self, constraint: &Constraint) -> Constraint {
        let turn = self.axes[constraint.vertex as usize].rotation;
        match constraint.target {
            Target::Position(_) => *constraint,
            Target::Orientation(to) => Constraint { target: Target::Orientation(to * turn.inverse()), ..*constraint },
        }
    }
}

impl Nodal {
    /// Takes the axes of the vertices; `None` where the mesh is where the shell rests.
    pub(super) fn take_axes(&mut self, axes: Option<&[Pose]>) {
        let same = match (&self.carried, axes) {
            (Some(carried), Some(axes)) => *carried.axes == *axes,
            (None, None) => true,
            _ => false,
        };
        if !same {
            self.carried = axes.map(|axes| Carried { axes: axes.into(), shell: None });
        }
    }

    /// Gives the solver the shell of the shape.
    pub(super) fn follow(&mut self, axes: Option<&[Pose]>) -> Result<()> {
        self.take_axes(axes);
        let shell = match &mut self.carried {
            Some(carried) => {
                let shell = carried.shell(&self.shell)?;
                carried.shell.get_or_insert(shell).clone()
            }
            None => self.shell.clone(),
        };
        if Arc::ptr_eq(self.solver.shell(), &shell) { Ok(()) } else { self.solver.follow(shell) }
    }

    /// Turns displacements, rates and forces to the solver's axes.
    pub(super) fn turn_out(&mut self) {
        let Some(carried) = &self.carried else { return };
        for field in [&mut self.u, &mut self.velocity, &mut self.force] {
            field.iter_mut().zip(&*carried.axes).for_each(|(x, axes)| *x = axes.rotation * *x);
        }
    }

    /// Turns displacements and rates back.
    pub(super) fn turn_in(&mut self) {
        let Some(carried) = &self.carried else { return };
        for field in [&mut self.u, &mut self.velocity] {
            field.iter_mut().zip(&*carried.axes).for_each(|(x, axes)| *x = axes.rotation.inverse() * *x);
        }
    }

    /// The constraints as the solver takes them, seen from a frame or on the rest shape.
    pub(super) fn seen_constraints(&self, pose: &Pose) -> Vec<Constraint> {
        let seen = |constraint: &Constraint| match &self.carried {
            Some(carried) => carried.seen(constraint),
            None => Constraint { target: constraint.target.in_frame(pose), ..*constraint },
        };
        self.constraints.items().iter().map(seen).collect()
    }

    /// Hands what loads lose by velocities to the solver.
    pub(super) fn resist(&mut self, drag: &[Mat3]) {
        let Some(carried) = &self.carried else { return self.solver.resist(drag) };
        let turned = |(drag, axes): (&Mat3, &Pose)| {
            let turn = axes.rotation.to_rotation_matrix();
            turn.matrix() * drag * turn.matrix().transpose()
        };
        let turned: Vec<Mat3> = drag.iter().zip(&*carried.axes).map(turned).collect();
        self.solver.resist(&turned);
    }

    /// Energies that join, as the solver takes them.
    pub(super) fn seen_points(&self, points: Option<&InFrame>) -> Option<InFrame> {
        match &self.carried {
            Some(_) => points.map(|points| InFrame::new(points.energy.clone(), Pose::identity())),
            None => points.cloned(),
        }
    }

    /// Positions by which it is bent (n_vertices).
    pub(super) fn bent(&self) -> Vec<Vec3> {
        let z = self.shell.mesh.positions.iter().zip(&self.u).map(|(r, u)| r + u);
        match &self.carried {
            Some(carried) => z.enumerate().map(|(v, z)| carried.place(v, &z)).collect(),
            None => z.collect(),
        }
    }
}

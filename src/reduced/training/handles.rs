//! What a training does for the handles that it is told of: the shell's answers to pulls and turns there join the fields, and the full shell
//! is led by each, as hosts lead it, where the others hold it at rest.
//!
//! A pull of a known force says little of where a handle can go: it moves a flap far, and the middle of a tube hardly. So a lead is a
//! displacement, by the handle's compliance: far along the direction in which it gives most, less across, and turns in place.

use super::AXES;
use super::basis::{self, RestSolver};
use crate::constraint::{Constraint, Target};
use crate::{Error, Result, Shell, Vec3};
use nalgebra::{Matrix3, UnitQuaternion};
use std::iter::once;

/// How far handles are led along the direction in which they give most, and along the two across it, in model sizes; and how they are turned, rad.
const FAR: f64 = 0.2;
const ACROSS: f64 = 0.06;
const TURN: f64 = 0.5;

/// Fields that leads are for, at least: fewer are wanted for what loads do. With 20, a saddle that falls was 45 % off in place of 6.
const LEAST_FIELDS: usize = 24;

/// The handles of a training, and what follows from them.
#[derive(Default)]
pub(super) struct Handles {
    /// Their vertices.
    pub(super) vertices: Vec<usize>,
    /// Whether fields know the turns there, too.
    pub(super) turning: bool,
    /// The displacements to first order under a pull at each along each axis, and under a couple of its triangles' corners about each. Where nothing
    /// holds the shell, inertia takes the rest: inertia-relief attachment modes (Craig 1987). Of a norm each.
    pub(super) answers: Vec<Vec<Vec3>>,
    /// Where they go; nowhere below [`LEAST_FIELDS`], where creases yield, or where the shell floats.
    pub(super) leads: Vec<Lead>,
    /// Fields that there will be.
    fields: usize,
}

/// How one handle is led, the others held at rest.
pub(super) struct Lead {
    handle: usize,
    way: Vec3,
    turn: Vec3,
}

impl Handles {
    /// Those that fields are spent on, three for the pulls at each, and three more for its turns where there is room. Half of the fields are left.
    pub(super) fn new(shell: &Shell, told: &[u32], fields: usize) -> Result<Self> {
        let (mut vertices, n): (Vec<usize>, usize) = (vec![], shell.mass.len());
        for (i, v) in told.iter().map(|v| *v as usize).enumerate() {
            if v >= n {
                return Err(Error::argument(format!("handles[{i}] is vertex {v}: the mesh has {n} vertices")));
            }
            if shell.free.binary_search(&(v as u32)).is_ok() && !vertices.contains(&v) {
                vertices.push(v);
            }
        }
        vertices.truncate(fields / 6);
        let turning = 12 * vertices.len() <= fields;
        Ok(Self { vertices, turning, fields, ..Self::default() })
    }

    /// Finds the answers, and at most so many leads.
    pub(super) fn prepare(&mut self, shell: &Shell, rest: &RestSolver, most: usize) -> Result<()> {
        if self.vertices.is_empty() {
            return Ok(());
        }
        let accelerations: Vec<_> = self.forces(shell).into_iter().map(|forces| acceleration(shell, forces)).collect();
        let mut right = basis::columns(shell, &accelerations);
        rest.solve(&mut right)?;
        let unit = |k: usize| right.col(k) * faer::Scale(1.0 / right.col(k).norm_l2().max(f64::MIN_POSITIVE));
        self.answers = (0..right.ncols()).map(|k| basis::unscaled(shell, unit(k).as_ref())).collect();
        // A fold that stays is held by what far points pull: a card folded to a radian rested 31 % off with leads, 15 without. Of a shell that floats
        // leads take four times the search, and nothing tells that they help.
        let suits = shell.energy.yielding().is_none() && !rest.is_loose();
        if self.fields >= LEAST_FIELDS && suits {
            let column = |k: usize, v: usize| basis::unscaled(shell, right.col(k))[v];
            let compliance = |(i, &v): (usize, &usize)| Matrix3::from_columns(&[0, 1, 2].map(|a| column(3 * i + a, v)));
            let compliances: Vec<Matrix3<f64>> = self.vertices.iter().enumerate().map(compliance).collect();
            self.leads = self.ways(&compliances, shell.mesh.size);
            self.leads.truncate(most);
        }
        Ok(())
    }

    /// Pulls, and couples, of unit size.
    fn forces(&self, shell: &Shell) -> Vec<Vec<(usize, Vec3)>> {
        let rest = &shell.mesh.positions;
        let mut forces = vec![];
        for &v in &self.vertices {
            forces.extend(AXES.map(|axis| vec![(v, axis)]));
        }
        for &v in self.vertices.iter().filter(|_| self.turning) {
            let own = shell.mesh.triangles.iter().filter(|corners| corners.contains(&(v as u32)));
            let mut around: Vec<usize> = own.flatten().map(|w| *w as usize).collect();
            around.sort_unstable();
            around.dedup();
            let couple = |axis: Vec3| around.iter().map(|&w| (w, axis.cross(&(rest[w] - rest[v])))).collect();
            forces.extend(AXES.map(couple));
        }
        forces
    }

    /// To and fro, the most telling first, one handle after the other: along the two directions in which it gives most, turned, and along the third.
    fn ways(&self, compliances: &[Matrix3<f64>], size: f64) -> Vec<Lead> {
        let directions: Vec<[Vec3; 3]> = compliances.iter().map(|c| by_compliance(c).map(|(way, _)| way)).collect();
        let mut leads = vec![];
        for k in [0, 1, 3, 4, 5, 2].into_iter().filter(|k| *k < 3 || self.turning) {
            for (handle, directions) in directions.iter().enumerate() {
                let (way, turn) = match k {
                    0 => (FAR * size * directions[0], Vec3::zeros()),
                    1 | 2 => (ACROSS * size * directions[k], Vec3::zeros()),
                    _ => (Vec3::zeros(), TURN * AXES[k - 3]),
                };
                leads.extend([1.0, -1.0].map(|sign| Lead { handle, way: sign * way, turn: sign * turn }));
            }
        }
        leads
    }

    /// The constraints of a share of a lead, in the axes of the rest positions.
    pub(super) fn led(&self, shell: &Shell, lead: &Lead, share: f64) -> Vec<Constraint> {
        let hold = |id: usize, vertex: usize, target: Target| {
            let (id, vertex) = (id as u32, vertex as u32);
            Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target }
        };
        let place = |(i, &v): (usize, &usize)| {
            let way = if i == lead.handle { share * lead.way } else { Vec3::zeros() };
            hold(i, v, Target::Position(shell.mesh.positions[v] + way))
        };
        let turn = Target::Orientation(UnitQuaternion::from_scaled_axis(share * lead.turn));
        let turned = once(hold(self.vertices.len(), self.vertices[lead.handle], turn));
        let places = self.vertices.iter().enumerate().map(place);
        places.chain(turned.filter(|_| lead.turn != Vec3::zeros())).collect()
    }
}

/// The directions of a vertex by how far a pull of unit size moves it, and how far; the most first.
pub(super) fn by_compliance(compliance: &Matrix3<f64>) -> [(Vec3, f64); 3] {
    let eigen = (0.5 * (compliance + compliance.transpose())).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order.map(|k| (Vec3::from(eigen.eigenvectors.column(k)), eigen.eigenvalues[k]))
}

/// The accelerations that forces are in the place of, for [`basis::columns`] brings M^½.
pub(super) fn acceleration(shell: &Shell, forces: impl IntoIterator<Item = (usize, Vec3)>) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); shell.mass.len()];
    forces.into_iter().for_each(|(v, force)| out[v] = force / shell.mass[v]);
    out
}

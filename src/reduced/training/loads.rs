//! The loads that a reduced shell is trained on, in their order.

use super::basis::{self, RestSolver};
use super::handles::{self, Handles, Lead};
use super::{AXES, BEND, Options, TrainingLoads};
use crate::modes::Modes;
use crate::reference::FreeMotions;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use nalgebra::Matrix3;

/// Share of the weight that pulls at a point along the axes.
const PULL: f64 = 0.05;
const POINTS: usize = 3;
/// What handles lead to, at most, and how many of these stand for a point.
pub(super) const MOST_LEADS: usize = 18;
const LEADS: usize = MOST_LEADS / POINTS;
/// Gravity to train under, at most, of that which bends the shell by [`BEND`] to first order: a metre of thin silk is at 1e7.
const MOST_GRAVITY: f64 = 1e12;

/// What acts on the shell.
#[derive(Clone, Copy)]
pub(super) enum Load {
    /// The weight along a direction.
    Gravity(Vec3),
    /// Along this times the normals, a force on each vertex as large as its weight.
    Pressure(f64),
    /// Nothing but a handle, of a number.
    Lead(usize),
    /// A weak force at a vertex, whose half tells no more.
    WeakPull(usize, Vec3),
    /// One that bends the shell far.
    StrongPull(usize, Vec3),
}

impl Load {
    pub(super) fn is_distributed(&self) -> bool {
        matches!(self, Self::Gravity(_) | Self::Pressure(_))
    }

    /// Whether an equilibrium under it takes long as a rule.
    pub(super) fn is_long(&self) -> bool {
        matches!(self, Self::StrongPull(..))
    }
}

impl TrainingLoads {
    /// Fails where gravity is beyond all that bends the shell.
    pub(in crate::reduced) fn new(
        shell: &Shell,
        modes: &Modes,
        (options, handles): (&Options, &[u32]),
        free: Option<FreeMotions>,
    ) -> Result<Self> {
        let largest = |field: &[Vec3]| field.iter().map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max);
        let amplitude = BEND * shell.mesh.size / modes.shapes.first().map_or(1.0, |shape| largest(shape));
        let (points, floats) = (far_points(shell, POINTS), free.as_ref().is_some_and(|free| free.count() == 6));
        let handles = Handles::new(shell, handles, options.fields)?;
        let bearers = if handles.vertices.is_empty() { &points } else { &handles.vertices };
        // λ q = g Φᵀ M 1 with the most effective direction; of a shell that floats, held at the points.
        let effective = |(shape, lambda): (&Vec<Vec3>, &f64)| {
            let mut sum: Vec3 = shape.iter().zip(&shell.mass).map(|(u, m)| u * *m).sum();
            if floats {
                sum -= bearers.iter().map(|v| shape[*v]).sum::<Vec3>() * (shell.total_mass / bearers.len() as f64);
            }
            sum.norm() * largest(shape) / lambda
        };
        let softest = modes.shapes.iter().zip(&modes.eigenvalues).map(effective).fold(f64::MIN_POSITIVE, f64::max);
        let bending = BEND * shell.mesh.size / softest;
        let gravity = if options.gravity > 0.0 { options.gravity } else { bending };
        if !(gravity <= MOST_GRAVITY * bending && amplitude.is_finite() && gravity.is_finite()) {
            let message = format!(
                "reduced_gravity is {gravity:e}, but {bending:e} bends the shell by a quarter of its size already: at most {:e}",
                MOST_GRAVITY * bending
            );
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let strength = gravity / bending;
        let (list, halved, responses) = (vec![], vec![], vec![]);
        Ok(Self { gravity, strength, amplitude, points, list, halved, responses, handles, free })
    }

    /// Finds what handles do, the loads, and the rest shape's displacements to first order under accelerations that are uniform, the first
    /// three, or linear in the place, as of any frame.
    pub(in crate::reduced) fn prepare(&mut self, shell: &Shell, solver: &RestSolver) -> Result<()> {
        self.handles.prepare(shell, solver, MOST_LEADS)?;
        self.points.truncate(POINTS - self.handles.leads.len().div_ceil(LEADS));
        let rest = &shell.mesh.positions;
        let centre = rest.iter().fold(Vec3::zeros(), |sum, x| sum + x) / rest.len() as f64;
        let mut accelerations = vec![];
        accelerations.extend(AXES.map(|axis| vec![axis; rest.len()]));
        for axis in AXES {
            accelerations.extend((0..3).map(|b| rest.iter().map(|x| axis * (x - centre)[b]).collect::<Vec<_>>()));
        }
        let of_frames = accelerations.len();
        // Of a shell that moves freely, a pull at a point says little of how far this can go.
        let pulled = if solver.is_loose() { &[] } else { &self.points[..] };
        for &point in pulled {
            accelerations.extend(AXES.map(|axis| handles::acceleration(shell, [(point, axis)])));
        }
        let mut right = basis::columns(shell, &accelerations);
        solver.solve(&mut right)?;
        let mut responses: Vec<Vec<Vec3>> = (0..right.ncols()).map(|k| basis::unscaled(shell, right.col(k))).collect();
        let far = pulled.iter().zip(responses[of_frames..].chunks_exact(3)).map(|(&point, answers)| {
            let compliance = Matrix3::from_fn(|i, j| answers[j][point][i]);
            let (way, most) = handles::by_compliance(&compliance)[0];
            (point, way * (self.strength * BEND * shell.mesh.size / most.max(f64::MIN_POSITIVE)))
        });
        self.list = self.listed(shell, &far.collect::<Vec<_>>());
        self.halved = (0..self.list.len()).filter(|k| !matches!(self.list[*k], Load::WeakPull(..))).collect();
        responses.truncate(of_frames);
        self.responses = responses;
        Ok(())
    }

    /// In this order:
    ///
    /// - gravity along ± the axes, and pressure to either side,
    /// - what handles lead to, in the place of pulls at as many points,
    /// - weak pulls along ± the axes,
    /// - gravity along the diagonals between the axes,
    /// - strong pulls to and fro where the points give most, that would bend the shell by [`BEND`] to first order.
    fn listed(&self, shell: &Shell, far: &[(usize, Vec3)]) -> Vec<Load> {
        let weight = self.weight(shell);
        let axes = AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let sign = |k: usize, axis: usize| if k >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let diagonals = (0..8).map(|k| Vec3::from_fn(|axis, _| sign(k, axis)).normalize());
        let mut list: Vec<Load> = axes.clone().map(Load::Gravity).collect();
        list.extend([1.0, -1.0].map(Load::Pressure));
        list.extend((0..self.handles.leads.len()).map(Load::Lead));
        for &point in &self.points {
            list.extend(axes.clone().map(|axis| Load::WeakPull(point, PULL * weight * axis)));
        }
        list.extend(diagonals.map(Load::Gravity));
        list.extend(
            far.iter().flat_map(|(point, force)| [1.0, -1.0].map(|sign| Load::StrongPull(*point, sign * force))),
        );
        list
    }

    /// Of what is free to move, under gravity at full strength.
    fn weight(&self, shell: &Shell) -> f64 {
        shell.free.iter().map(|&v| shell.mass[v as usize]).sum::<f64>() * self.gravity
    }

    /// The forces of the list at full strength, and of those that are taken at half of it. Of a shell that floats, gravity is borne by the handles,
    /// or by the points.
    pub(super) fn loads(&self, shell: &Shell) -> Vec<Vec<Vec3>> {
        let normals = shell.mesh.normals(&shell.mesh.positions);
        let weight = self.weight(shell);
        let floats = self.free.as_ref().is_some_and(|free| free.count() == 6);
        let bearers = if self.handles.vertices.is_empty() { &self.points } else { &self.handles.vertices };
        let forces = |load: &Load, strength: f64| {
            let g = strength * self.gravity;
            let mut force = vec![Vec3::zeros(); shell.mass.len()];
            match *load {
                Load::Gravity(direction) => {
                    force.iter_mut().zip(&shell.mass).for_each(|(f, m)| *f = *m * g * direction);
                    if floats {
                        let borne = strength * weight / bearers.len() as f64;
                        bearers.iter().for_each(|v| force[*v] -= borne * direction);
                    }
                }
                Load::Pressure(sign) => {
                    let weights = normals.iter().zip(&shell.mass).map(|(n, m)| n * (sign * g * m));
                    force.iter_mut().zip(weights).for_each(|(f, weight)| *f = weight);
                }
                Load::Lead(_) => {}
                Load::WeakPull(point, pull) | Load::StrongPull(point, pull) => force[point] = pull * strength,
            }
            force
        };
        let halves = self.halved.iter().map(|k| forces(&self.list[*k], 0.5));
        self.list.iter().map(|load| forces(load, 1.0)).chain(halves).collect()
    }

    /// What is behind the number of one of [`Self::loads`].
    pub(super) fn load(&self, number: usize) -> &Load {
        &self.list[self.whole_of(number)]
    }

    /// The number of the same load at full strength.
    pub(super) fn whole_of(&self, number: usize) -> usize {
        number.checked_sub(self.list.len()).map_or(number, |k| self.halved[k])
    }

    /// What a handle does there.
    pub(super) fn lead(&self, number: usize) -> Option<&Lead> {
        match *self.load(number) {
            Load::Lead(k) => self.handles.leads.get(k),
            _ => None,
        }
    }
}

/// Vertices that are far from the held ones and from each other.
fn far_points(shell: &Shell, count: usize) -> Vec<usize> {
    let x = &shell.mesh.positions;
    let mut distance = vec![f64::INFINITY; x.len()];
    let nearer = |to: usize, distance: &mut Vec<f64>| {
        distance.iter_mut().zip(x).for_each(|(d, p)| *d = d.min((p - x[to]).norm_squared()));
    };
    (0..x.len()).filter(|&v| shell.held[v]).for_each(|v| nearer(v, &mut distance));
    let mut points = vec![];
    if !shell.held.contains(&true) {
        let centre = x.iter().sum::<Vec3>() / x.len() as f64;
        let out = |v: &u32| (x[*v as usize] - centre).norm_squared();
        points.extend(shell.free.iter().max_by(|a, b| out(a).total_cmp(&out(b))).map(|v| *v as usize));
        points.iter().for_each(|v| nearer(*v, &mut distance));
    }
    for _ in points.len()..count {
        let free = shell.free.iter().map(|&v| v as usize);
        let Some(furthest) = free.max_by(|&a, &b| distance[a].total_cmp(&distance[b])) else { break };
        points.push(furthest);
        nearer(furthest, &mut distance);
    }
    points
}

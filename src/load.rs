//! Loads: gravity with the inertia of the support frame, forces on vertices, and wind on triangles.
//!
//! In the frame each vertex feels m [g − a − α × r − ω × (ω × r) − 2 ω × ṙ] ([`BodyLoad`]).
//!
//! Wind acts on each deformed triangle of area A and unit normal n̂ that moves with velocity v in air of velocity a, with
//! s = a − v split into s_n = (s·n̂) n̂ and the rest s_t:
//!
//!   F = ½ ρ A (C_n |s_n| s_n + C_t |s_t| s_t),   a third on each corner.
//!
//! It turns with the shell because n̂ is the deformed normal.

mod following;

use crate::energy::Mat3;
use crate::error::{Result, require_finite, require_non_negative};
use crate::features::Feature;
use crate::support::{Passage, Pose, Rates};
use crate::{Error, Mesh, Vec3};
pub(crate) use following::Following;
use nalgebra::{Matrix3, UnitQuaternion};

/// Body loads in frame axes, constant over a step.
pub struct BodyLoad {
    /// g − a: the acceleration that acts everywhere alike.
    pub(crate) uniform: Vec3,
    /// Rotation of the frame, when there is any.
    pub(crate) spin: Option<Spin>,
}

pub(crate) struct Spin {
    /// [α]× + [ω]×².
    pub(crate) gradient: Matrix3<f64>,
    /// 2 ω.
    pub(crate) coriolis: Vec3,
}

impl BodyLoad {
    /// Gravity (world axes) and frame rates (world axes) seen from `pose`.
    pub fn new(gravity: Vec3, pose: &Pose, rates: &Rates) -> Self {
        let to_frame = |v: Vec3| pose.rotation.inverse() * v;
        let (omega, alpha) = (to_frame(rates.angular_velocity), to_frame(rates.angular_acceleration));
        let turning = omega != Vec3::zeros() || alpha != Vec3::zeros();
        let (wx, ax) = (omega.cross_matrix(), alpha.cross_matrix());
        let spin = turning.then(|| Spin { gradient: ax + wx * wx, coriolis: 2.0 * omega });
        Self { uniform: to_frame(gravity - rates.acceleration), spin }
    }

    /// Of what the frame does not hold, at rest where it will be: gravity, and a `drag` 1/s by a frame that passes.
    pub fn dragged(passage: &Passage, pose: &Pose, drag: f64) -> Self {
        let to_frame = |v: &Vec3| pose.rotation.inverse() * v;
        let [velocity, omega] = passage.now.each_ref().map(to_frame);
        let turning = drag != 0.0 && omega != Vec3::zeros();
        let gradient = -drag * omega.cross_matrix();
        let spin = turning.then(|| Spin { gradient, coriolis: Vec3::zeros() });
        Self { uniform: to_frame(&passage.gravity) + drag * velocity, spin }
    }

    /// Without the weight that the shell carries where it is linearised, under `gravity` (frame axes).
    pub fn without_sag_weight(mut self, gravity: Vec3) -> Self {
        self.uniform -= gravity;
        self
    }

    /// g − a, and the \[α\]× + \[ω\]×² and 2ω of a frame that turns.
    pub fn parts(&self) -> (Vec3, Option<(&Matrix3<f64>, &Vec3)>) {
        (self.uniform, self.spin.as_ref().map(|spin| (&spin.gradient, &spin.coriolis)))
    }

    /// |ω| of the frame, when the load depends on position and velocity.
    pub fn spin_rate(&self) -> Option<f64> {
        self.spin.as_ref().map(|spin| 0.5 * spin.coriolis.norm())
    }

    /// The acceleration that acts everywhere alike, where the load is nothing else.
    pub fn everywhere_alike(&self) -> Option<&Vec3> {
        self.spin.is_none().then_some(&self.uniform)
    }

    /// Nothing acts.
    pub fn is_zero(&self) -> bool {
        self.uniform == Vec3::zeros() && self.spin.is_none()
    }

    /// Force on vertex mass `m` at `r` moving with `velocity`.
    pub fn at(&self, m: f64, r: Vec3, velocity: Vec3) -> Vec3 {
        match &self.spin {
            None => m * self.uniform,
            Some(spin) => m * (self.uniform - spin.gradient * r - spin.coriolis.cross(&velocity)),
        }
    }
}

/// Air around the shell. World axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wind {
    /// Velocity everywhere.
    pub velocity: Vec3,
    /// ρ, mass per volume.
    pub density: f64,
    /// C_n, against the face.
    pub normal_drag: f64,
    /// C_t, along the face.
    pub tangential_drag: f64,
    /// Velocity at each vertex, beside the one everywhere; empty for none.
    pub local: Vec<Vec3>,
}

/// Forces and wind on one state.
#[derive(Clone, Default)]
pub struct Loads {
    /// World force on a vertex; a vertex may come more than once.
    pub(crate) forces: Vec<(u32, Vec3)>,
    /// Those before: forces that are set in every step need no new room.
    before: Vec<(u32, Vec3)>,
    pub(crate) wind: Option<Wind>,
}

/// The external forces of one step.
#[derive(Clone, Copy)]
pub enum External<'a> {
    /// Forces (world axes) on some vertices, perhaps none, and the rotation into frame axes.
    OnSome(&'a [(u32, Vec3)], UnitQuaternion<f64>),
    /// A force on every vertex (n_vertices, frame axes), and its [`Wind`]'s drag, if that is wanted.
    OnAll(&'a [Vec3], &'a [Mat3]),
}

impl<'a> External<'a> {
    /// The forces on all vertices, when that is how they are given.
    pub fn on_all(self) -> Option<&'a [Vec3]> {
        match self {
            Self::OnSome(..) => None,
            Self::OnAll(forces, _) => Some(forces),
        }
    }

    /// What the force on each vertex loses by a unit of its velocity; empty where there is none.
    pub fn drag(self) -> &'a [Mat3] {
        match self {
            Self::OnSome(..) => &[],
            Self::OnAll(_, drag) => drag,
        }
    }

    /// The forces on some vertices, frame axes, when that is how they are given.
    pub fn point_forces(self) -> impl Iterator<Item = (u32, Vec3)> + 'a {
        let (forces, rotation) = match self {
            Self::OnSome(forces, rotation) => (forces, rotation),
            Self::OnAll(..) => (&[][..], UnitQuaternion::identity()),
        };
        forces.iter().map(move |(v, force)| (*v, rotation * force))
    }
}

/// A moving configuration: positions and velocities per vertex, world axes.
pub struct Moving<'a> {
    /// Deformed positions (n_vertices).
    pub x: &'a [Vec3],
    /// Velocities (n_vertices).
    pub v: &'a [Vec3],
}

/// A vertex alone costs about as much as so many together.
const VISITS_PER_POINT: usize = 16;

impl Loads {
    /// Replaces all forces; [`Loads::undo_forces`] brings those before back. Returns whether anything changed. Fails on a vertex
    /// that does not exist and on numbers that are not finite.
    pub fn set_forces(&mut self, forces: impl IntoIterator<Item = (u32, Vec3)>, n_vertices: usize) -> Result<bool> {
        self.before.clear();
        self.before.extend(forces);
        for (i, (v, f)) in self.before.iter().enumerate() {
            if *v as usize >= n_vertices {
                return Err(Error::argument(format!("force {i} is on vertex {v} of {n_vertices}")));
            }
            for c in f.iter() {
                require_finite(format_args!("force {i} on vertex {v}"), *c)?;
            }
        }
        self.undo_forces();
        Ok(self.forces != self.before)
    }

    /// Back to the forces before [`Loads::set_forces`].
    pub fn undo_forces(&mut self) {
        std::mem::swap(&mut self.forces, &mut self.before);
    }

    /// Replaces the wind and returns the one before; a density of 0 is no wind.
    pub fn set_wind(&mut self, wind: Wind, n_vertices: usize) -> Result<Option<Wind>> {
        if wind.density > 0.0 {
            Feature::Wind.require()?;
        }
        require_non_negative("density", wind.density)?;
        require_non_negative("normal_drag", wind.normal_drag)?;
        require_non_negative("tangential_drag", wind.tangential_drag)?;
        if !wind.local.is_empty() && wind.local.len() != n_vertices {
            return Err(Error::argument(format!("{} local velocities for {n_vertices} vertices", wind.local.len())));
        }
        for c in wind.velocity.iter() {
            require_finite("the wind velocity", *c)?;
        }
        for (v, velocity) in wind.local.iter().enumerate() {
            for c in velocity.iter() {
                require_finite(format_args!("the wind velocity at vertex {v}"), *c)?;
            }
        }
        Ok(std::mem::replace(&mut self.wind, (wind.density > 0.0).then_some(wind)))
    }

    /// Multiplies all forces by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.forces.iter_mut().for_each(|(_, force)| *force *= factor);
    }

    /// Removes all forces.
    pub fn clear_forces(&mut self) {
        self.forces.clear();
    }

    /// No force and no wind.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty() && self.wind.is_none()
    }

    /// Forces on some vertices: as many as these are visited, when it is less work than to visit all.
    pub fn point_forces(&self, n_vertices: usize) -> Option<&[(u32, Vec3)]> {
        let few = self.forces.len() * VISITS_PER_POINT <= n_vertices;
        (self.wind.is_none() && few).then_some(&self.forces)
    }

    /// Wind needs the deformed positions and velocities.
    pub fn needs_motion(&self) -> bool {
        Feature::Wind.is_built_in() && self.wind.is_some()
    }

    /// Sets `out` (n_vertices, world axes) to what the wind's force on each vertex loses by a unit of its velocity.
    pub fn evaluate_drag(&self, mesh: &Mesh, moving: &Moving, out: &mut [Mat3]) {
        out.fill(Mat3::zeros());
        if let (true, Some(wind)) = (Feature::Wind.is_built_in(), &self.wind) {
            mesh.triangles.iter().for_each(|t| wind.resist(t, moving, out));
        }
    }

    /// Sets `out` (n_vertices, world axes) to the forces on the configuration.
    pub fn evaluate(&self, mesh: &Mesh, moving: &Moving, out: &mut [Vec3]) {
        out.fill(Vec3::zeros());
        for (v, force) in &self.forces {
            out[*v as usize] += force;
        }
        if let (true, Some(wind)) = (Feature::Wind.is_built_in(), &self.wind) {
            mesh.triangles.iter().for_each(|t| wind.press(t, moving, out));
        }
    }
}

impl Wind {
    /// Adds the force on one triangle.
    fn press(&self, t: &[u32; 3], moving: &Moving, out: &mut [Vec3]) {
        let Some(Stream { corners, area, across, along, .. }) = self.stream(t, moving) else { return };
        let drag = self.normal_drag * across.norm() * across + self.tangential_drag * along.norm() * along;
        let share = drag * (0.5 * self.density * area / 3.0);
        corners.iter().for_each(|v| out[*v] += share);
    }

    /// Adds what the force on one triangle loses by a unit of its velocity, a third at each corner.
    fn resist(&self, t: &[u32; 3], moving: &Moving, out: &mut [Mat3]) {
        let Some(Stream { corners, area, normal, across, along }) = self.stream(t, moving) else { return };
        let (out_of_plane, speed) = (normal * normal.transpose(), along.norm());
        let stretched = if speed > 0.0 { along * along.transpose() / speed } else { Mat3::zeros() };
        let drag = 2.0 * self.normal_drag * across.norm() * out_of_plane
            + self.tangential_drag * (speed * (Mat3::identity() - out_of_plane) + stretched);
        let share = drag * (0.5 * self.density * area / 3.0);
        corners.iter().for_each(|v| out[*v] += share);
    }

    /// The air past a triangle; none past one without area.
    fn stream(&self, t: &[u32; 3], moving: &Moving) -> Option<Stream> {
        let corners = t.map(|v| v as usize);
        let [a, b, c] = corners.map(|v| moving.x[v]);
        let double_area = (b - a).cross(&(c - a));
        let area = 0.5 * double_area.norm();
        let normal = double_area.try_normalize(0.0)?;
        let mean = |field: &[Vec3]| corners.iter().map(|v| field[*v]).sum::<Vec3>() / 3.0;
        let local = if self.local.is_empty() { Vec3::zeros() } else { mean(&self.local) };
        let relative = self.velocity + local - mean(moving.v);
        let across = normal * relative.dot(&normal);
        Some(Stream { corners, area, normal, across, along: relative - across })
    }
}

/// The air's velocity past a triangle, across it and along it.
struct Stream {
    corners: [usize; 3],
    area: f64,
    normal: Vec3,
    across: Vec3,
    along: Vec3,
}

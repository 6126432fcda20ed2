//! Supports: which vertices are held, and the rigid motion T(t) of the frame that holds them.

mod roller;
mod symmetry;

pub use roller::{Roller, rigid_motions};

use crate::{Error, Mesh, Result, Vec3, rotation};
use nalgebra::{Matrix3, Rotation3, SVD, UnitQuaternion};

/// Vertices held in the support frame.
#[derive(Clone, Debug, Default)]
pub struct Supports {
    /// Lose their three unknowns. A straight row of fixed vertices is a hinge: nothing resists turning about it.
    pub fixed: Vec<u32>,
    /// Fixed together with all their edge neighbours, which holds the slope as well: a clamp.
    pub clamped: Vec<u32>,
    /// Held along a direction of the frame only: a vertex and the direction, of any length; several of a vertex add up.
    pub along: Vec<(u32, Vec3)>,
    /// On planes of symmetry, by a vertex and the normal there: held along it, and so is the slope at boundary edges between two on the same plane, as
    /// by the mirror image of the shell.
    pub symmetric: Vec<(u32, Vec3)>,
}

impl Supports {
    /// Per vertex of `mesh`, whether it is held. Fails on a vertex that does not exist.
    pub fn held(&self, mesh: &Mesh) -> Result<Vec<bool>> {
        let n = mesh.positions.len();
        let mut held = vec![false; n];
        let mut clamped = vec![false; n];
        for (list, name, mark) in [(&self.fixed, "fixed", &mut held), (&self.clamped, "clamped", &mut clamped)] {
            for (i, &v) in list.iter().enumerate() {
                let slot = mark.get_mut(v as usize).ok_or_else(|| {
                    Error::argument(format!("{name}[{i}] is vertex {v}, but the mesh has {n} vertices"))
                })?;
                *slot = true;
            }
        }
        for e in &mesh.edges {
            let [a, b] = e.vertices.map(|v| v as usize);
            held[a] |= clamped[a] || clamped[b];
            held[b] |= clamped[a] || clamped[b];
        }
        for v in 0..n {
            held[v] |= clamped[v];
        }
        Ok(held)
    }

    /// As [`Supports::held`], but clamped vertices on an edge between two of them hold the slope there, without their neighbours; the others
    /// still need these. And which vertices are on such an edge (n_vertices, or none).
    pub fn held_exactly(&self, mesh: &Mesh) -> Result<(Vec<bool>, Vec<bool>)> {
        let alone = Self { clamped: self.clamped.clone(), ..Self::default() };
        alone.held(mesh)?; // checks the list
        let mut marked = vec![false; mesh.positions.len()];
        self.clamped.iter().for_each(|&v| marked[v as usize] = true);
        let mut clamped = vec![false; mesh.positions.len()];
        for [a, b] in
            mesh.edges.iter().map(|e| e.vertices.map(|v| v as usize)).filter(|[a, b]| marked[*a] && marked[*b])
        {
            (clamped[a], clamped[b]) = (true, true);
        }
        let (on_edges, single) = self.clamped.iter().partition::<Vec<u32>, _>(|v| clamped[**v as usize]);
        let fixed = self.fixed.iter().chain(&on_edges).copied().collect();
        let held = Self { fixed, clamped: single, ..Self::default() }.held(mesh)?;
        Ok((held, if on_edges.is_empty() { vec![] } else { clamped }))
    }
}

/// Pose of the support frame: world = origin + rotation · local.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// World position of the frame's origin.
    pub origin: Vec3,
    /// Turns frame axes into world axes.
    pub rotation: UnitQuaternion<f64>,
}

impl Pose {
    /// The world frame itself.
    pub fn identity() -> Self {
        Self { origin: Vec3::zeros(), rotation: UnitQuaternion::identity() }
    }

    /// The rigid motion that brings points nearest to where others are, by least squares (Kabsch 1976), in pairs (from, to). What points on a
    /// line leave open stays as it is `before`.
    pub fn between<I: Iterator<Item = (Vec3, Vec3)>>(pairs: impl Fn() -> I, before: &Self) -> Self {
        let back = before.rotation.inverse();
        let turn = turn_between(|| pairs().map(|(from, to)| (from, back * to)));
        let rotation = before.rotation * turn;
        let n = pairs().count().max(1) as f64;
        let (from, to) = pairs().fold((Vec3::zeros(), Vec3::zeros()), |(a, b), (from, to)| (a + from, b + to));
        Self { origin: to / n - rotation * (from / n), rotation }
    }

    /// Where `x` of its axes is in the world.
    pub fn place(&self, x: &Vec3) -> Vec3 {
        self.origin + self.rotation * x
    }

    /// Where it is after a share of the way to `goal`, 0 to 1, moving and turning evenly.
    pub fn toward(&self, goal: &Self, share: f64) -> Self {
        let turn = rotation::vector(&(goal.rotation * self.rotation.inverse()));
        Self {
            origin: self.origin + share * (goal.origin - self.origin),
            rotation: rotation::by(&(share * turn)) * self.rotation,
        }
    }
}

/// The axes in which a method has vertices displaced: those of the frame, or on a rest shape that moves each vertex's own.
#[derive(Clone, Copy)]
pub struct Axes<'a> {
    /// Of the frame.
    pub frame: &'a Pose,
    /// From where a vertex is on the mesh to world space (n_vertices), on a rest shape that moves.
    pub each: Option<&'a [Pose]>,
}

impl<'a> Axes<'a> {
    /// Those of a vertex.
    pub fn of(&self, vertex: u32) -> &'a Pose {
        self.each.map_or(self.frame, |each| &each[vertex as usize])
    }
}

impl<'a> From<&'a Pose> for Axes<'a> {
    fn from(frame: &'a Pose) -> Self {
        Self { frame, each: None }
    }
}

/// Points are on a line when they are off it by less than this share of their length.
const LINE: f64 = 1e-8;

/// The rotation about their means that brings points nearest to where others are, in pairs (from, to): of those on a line the least, none
/// of a single one.
pub fn turn_between<I: Iterator<Item = (Vec3, Vec3)>>(pairs: impl Fn() -> I) -> UnitQuaternion<f64> {
    let n = pairs().count().max(1) as f64;
    let (from, to) = pairs().fold((Vec3::zeros(), Vec3::zeros()), |(a, b), (from, to)| (a + from / n, b + to / n));
    let spread = |x: f64, (a, b): (Vec3, Vec3)| x.max((a - from).amax()).max((b - to).amax());
    let size = pairs().fold(0.0, spread);
    if !(size > 0.0 && size.is_finite()) {
        return UnitQuaternion::identity();
    }
    let moments =
        pairs().fold(Matrix3::zeros(), |sum, (a, b)| sum + ((b - to) / size) * ((a - from) / size).transpose());
    let SVD { u: Some(u), v_t: Some(v_t), singular_values } = moments.svd(true, true) else {
        return UnitQuaternion::identity();
    };
    if singular_values[1] <= LINE * singular_values[0] {
        let (there, here) = (u.column(0).into_owned(), v_t.row(0).transpose());
        return rotation::shortest(&here, &there);
    }
    let sign = (u.determinant() * v_t.determinant()).signum();
    let turn = u * Matrix3::from_diagonal(&Vec3::new(1.0, 1.0, sign)) * v_t;
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn))
}

/// First and second derivatives of a [`Pose`], all in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Velocity of the origin.
    pub velocity: Vec3,
    /// Acceleration a of the origin.
    pub acceleration: Vec3,
    /// Angular velocity ω.
    pub angular_velocity: Vec3,
    /// Angular acceleration α.
    pub angular_acceleration: Vec3,
}

impl Rates {
    /// All numbers.
    pub fn is_finite(&self) -> bool {
        let linear = self.velocity.iter().chain(self.acceleration.iter());
        linear.chain(self.angular_velocity.iter()).chain(self.angular_acceleration.iter()).all(|x| x.is_finite())
    }
}

/// How the host says the frame moves into its next pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameMotion {
    /// Rates follow from the poses of successive steps.
    Continuous,
    /// The frame jumps there and is then at rest: no inertial load.
    Teleport,
    /// The host knows the rates.
    Given(Rates),
}

/// How a frame passes through a step: from where, and its velocities before and in it (of the origin, and angular).
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// Where it begins.
    pub from: Pose,
    /// Over the step before.
    pub before: [Vec3; 2],
    /// Over this one.
    pub now: [Vec3; 2],
    /// Acceleration (world axes) that acts on what the frame does not hold.
    pub gravity: Vec3,
}

/// The frame at the end of the last step, and where it goes in the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Pose at the end of the last step.
    pub pose: Pose,
    /// Velocity of the origin over the last step.
    pub velocity: Vec3,
    /// Angular velocity over the last step.
    pub angular_velocity: Vec3,
    /// Pose at the end of the next step.
    pub target: Pose,
    /// How it gets there.
    pub motion: FrameMotion,
}

impl Frame {
    /// At rest in the world frame.
    pub fn at_rest(pose: Pose) -> Self {
        let zero = Vec3::zeros();
        Self { pose, velocity: zero, angular_velocity: zero, target: pose, motion: FrameMotion::Continuous }
    }

    /// Moves to the target in a step of `h` and returns the rates the shell feels over it. Differences are taken so that
    /// the impulse a·h is exactly the change of velocity, whatever the sequence of steps.
    pub fn advance(&mut self, h: f64) -> Rates {
        let rates = match self.motion {
            FrameMotion::Teleport => Rates::default(),
            FrameMotion::Given(rates) => rates,
            FrameMotion::Continuous => self.differences(h),
        };
        self.pose = self.target;
        self.velocity = rates.velocity;
        self.angular_velocity = rates.angular_velocity;
        self.motion = FrameMotion::Continuous;
        rates
    }

    /// How it gets to where it is `next`; none where it stays, jumps with all that is in it, or has rates that the host gave.
    pub fn passage(&self, next: &Self, gravity: Vec3) -> Option<Passage> {
        let velocities = |frame: &Self| [frame.velocity, frame.angular_velocity];
        let [before, now] = [self, next].map(velocities);
        let moves = self.pose != next.pose || [before, now] != [[Vec3::zeros(); 2]; 2];
        let told = self.motion == FrameMotion::Continuous;
        (moves && told).then_some(Passage { from: self.pose, before, now, gravity })
    }

    /// The rates at which it goes on from its target: those given, none after a teleport, else those over the last step, kept in its own
    /// axes.
    pub fn steady_rates(&self) -> Rates {
        let (velocity, angular_velocity) = (self.velocity, self.angular_velocity);
        match self.motion {
            FrameMotion::Teleport => Rates::default(),
            FrameMotion::Given(rates) => rates,
            FrameMotion::Continuous => {
                let acceleration = angular_velocity.cross(&velocity);
                Rates { velocity, acceleration, angular_velocity, ..Rates::default() }
            }
        }
    }

    /// At its target, with these rates.
    pub fn moving_at(&self, rates: &Rates) -> Self {
        let (velocity, angular_velocity) = (rates.velocity, rates.angular_velocity);
        Self { velocity, angular_velocity, ..Self::at_rest(self.target) }
    }

    fn differences(&self, h: f64) -> Rates {
        let velocity = (self.target.origin - self.pose.origin) / h;
        let angular_velocity = rotation::vector(&(self.target.rotation * self.pose.rotation.inverse())) / h;
        Rates {
            velocity,
            acceleration: (velocity - self.velocity) / h,
            angular_velocity,
            angular_acceleration: (angular_velocity - self.angular_velocity) / h,
        }
    }
}

//! A rest shape that moves, as the host animates it: blend shapes, skinned cloth.
//!
//! A vertex is at x = y + Q u, with its place y in the shape that the host sends, the mean rotation Q of its triangles from the mesh to there,
//! and the displacement u that the method has found on the mesh. So in its own axes it feels
//!
//!   f = Qᵀ (F + m [g − ÿ − α × Qu − ω × (ω × Qu) − 2 ω × Q u̇]),
//!
//! ω and α of Q. No matrix is made anew: a shape that is bent or stretched far from the mesh has another stiffness, which the modes do not know.

use super::{LoadScratch, Space, State};
use crate::error::try_zeroed;
use crate::load::{BodyLoad, External, Moving};
use crate::methods::Acting;
use crate::reference::vertex_rotations;
use crate::support::{Pose, Rates};
use crate::{Error, ErrorKind, Mesh, Result, Vec3, rotation, wide_norm};
use nalgebra::UnitQuaternion;

/// A place further from the world's origin than this, in model sizes, is nowhere.
const FURTHEST: f64 = 1e9;

/// A shape, world space (n_vertices each).
#[derive(Clone, Default)]
struct Shape {
    x: Vec<Vec3>,
    turn: Vec<UnitQuaternion<f64>>,
}

/// Velocities of a shape and of its turns, world axes (n_vertices each).
#[derive(Clone, Default)]
struct Speed {
    place: Vec<Vec3>,
    turn: Vec<Vec3>,
}

/// See the module's text.
#[derive(Clone)]
pub(super) struct MovingRest {
    /// At the ends of the last step and of the next.
    now: Shape,
    next: Shape,
    /// Over the last step and, while it is taken, the next.
    speed: Speed,
    coming: Speed,
    /// It is at the next without having moved.
    jump: bool,
    /// Inertia and gravity in the step that is being taken (n_vertices, world axes).
    force: Vec<Vec3>,
    /// Largest change of an edge's length from the mesh, a share.
    stretch: f64,
}

impl Speed {
    fn none(n: usize) -> Result<Self> {
        let room = || try_zeroed("the rest shape", n);
        Ok(Self { place: room()?, turn: room()? })
    }

    fn stop(&mut self) {
        self.place.iter_mut().chain(&mut self.turn).for_each(|v| *v = Vec3::zeros());
    }
}

impl MovingRest {
    fn at(shape: Shape, stretch: f64) -> Result<Self> {
        let n = shape.x.len();
        let (speed, coming, force) = (Speed::none(n)?, Speed::none(n)?, try_zeroed("the rest shape", n)?);
        Ok(Self { now: shape.clone(), next: shape, speed, coming, jump: true, force, stretch })
    }

    /// Fills the velocities over a step of `h`.
    fn head(&mut self, h: f64) {
        let Self { now, next, coming, jump, .. } = self;
        if *jump {
            return coming.stop();
        }
        for v in 0..now.x.len() {
            coming.place[v] = (next.x[v] - now.x[v]) / h;
            coming.turn[v] = rotation::vector(&(next.turn[v] * now.turn[v].inverse())) / h;
        }
    }

    /// Is there, with the velocities that it came with.
    fn arrive(&mut self) {
        self.jump = false;
        std::mem::swap(&mut self.speed, &mut self.coming);
        self.now.x.copy_from_slice(&self.next.x);
        self.now.turn.copy_from_slice(&self.next.turn);
    }

    /// Is there, at rest.
    pub(super) fn stop(&mut self) {
        self.coming.stop();
        self.arrive();
    }

    /// Velocities in a time that goes so much faster.
    pub(super) fn rescale(&mut self, by: f64) {
        self.speed.place.iter_mut().chain(&mut self.speed.turn).for_each(|v| *v /= by);
    }

    /// Whether the next step does not move it, as the last did not.
    fn is_still(&self) -> bool {
        let zero = |speed: &Speed| speed.place.iter().chain(&speed.turn).all(|v| *v == Vec3::zeros());
        !self.jump && self.now.x == self.next.x && zero(&self.speed)
    }

    /// Where a vertex is that is at `local` on the mesh, whose rest is there at `rest`; world space.
    fn place(&self, v: usize, local: Vec3, rest: &Vec3) -> Vec3 {
        self.now.x[v] + self.now.turn[v] * (local - rest)
    }
}

/// Largest change of an edge's length from the mesh to `x`, a share.
fn largest_stretch(mesh: &Mesh, x: &[Vec3]) -> f64 {
    let stretch = |[a, b]: [usize; 2]| {
        let rest = (mesh.positions[b] - mesh.positions[a]).norm();
        ((x[b] - x[a]).norm() / rest - 1.0).abs()
    };
    mesh.edges.iter().map(|e| stretch(e.vertices.map(|v| v as usize))).fold(0.0, f64::max)
}

impl State {
    /// Where the rest shape is at the end of the next step: `x` gives the place of each vertex (world space). The first call, and a teleport, place it
    /// there at rest. Fails, changing nothing, on a place that is not finite or beyond all measure, and where something acts that needs the
    /// mesh to be at rest: the full shell, a sagged model, one that moves freely, handles, colliders, supports that move.
    pub fn move_rest(&mut self, x: impl Fn(usize) -> Vec3, teleport: bool) -> Result<()> {
        self.check_can_move_rest()?;
        let mesh = &self.model.shell.mesh;
        let mut places: Vec<Vec3> = try_zeroed("the rest shape", mesh.positions.len())?;
        for (v, place) in places.iter_mut().enumerate() {
            *place = x(v);
            // What overflows is not within either.
            let near = wide_norm(place) <= FURTHEST * mesh.size;
            if !near {
                let [x, y, z] = place.data.0[0];
                let message = format!(
                    "the rest shape has vertex {v} at ({x:?}, {y:?}, {z:?}): it must be within {FURTHEST:e} sizes of the mesh, {:?}",
                    mesh.size
                );
                return Err(Error::argument(message));
            }
        }
        let stretch = largest_stretch(mesh, &places);
        let shape = Shape { turn: vertex_rotations(mesh, &places), x: places };
        let Some(rest) = &mut self.moving_rest else {
            self.moving_rest = Some(Box::new(MovingRest::at(shape, stretch)?));
            if let Err(error) = self.make_room() {
                self.moving_rest = None;
                return Err(error);
            }
            self.rest.wake();
            return Ok(());
        };
        (rest.next, rest.stretch) = (shape, stretch);
        rest.jump |= teleport;
        if teleport {
            rest.speed.stop();
        }
        let moves = !rest.is_still();
        self.wake_if(moves);
        Ok(())
    }

    /// The mesh is where the shell rests again.
    pub fn clear_rest(&mut self) {
        self.moving_rest = None;
        self.rest.wake();
    }

    /// Largest change of an edge's length from the mesh to the rest shape, a share; 0 where that does not move.
    pub fn rest_stretch(&self) -> f64 {
        self.moving_rest.as_ref().map_or(0.0, |rest| rest.stretch)
    }

    fn check_can_move_rest(&self) -> Result<()> {
        let bars = [
            (
                self.motion.is_full_shell(),
                "the full shell, whose energy is of one rest shape: switch to another method",
            ),
            (self.model.modal.zero_modes > 0, "a shell that can move freely away from it: support it"),
            (self.model.shell.sag.is_some(), "a model with sag_gravity, whose stiffness is of one pose"),
            (self.constraints().next().is_some(), "handles: clear the constraints"),
            (self.contacts.is_some() || self.points.is_some(), "colliders: remove them"),
            (self.supports.is_some(), "supports that moved by themselves: they go with the rest shape"),
        ];
        match bars.into_iter().find(|(bars, _)| *bars) {
            None => Ok(()),
            Some((_, what)) => {
                Err(Error::new(ErrorKind::Unsupported, format!("the rest shape cannot move with {what}")))
            }
        }
    }

    /// Fails where the rest shape moves.
    pub(super) fn refuse_moving_rest(&self, what: &str) -> Result<()> {
        match self.moving_rest {
            None => Ok(()),
            Some(_) => {
                let message = format!("{what}: not while the rest shape moves (sw_state_move_rest)");
                Err(Error::new(ErrorKind::Unsupported, message))
            }
        }
    }

    /// A step on a rest shape that moves, as [`State::advance`]. The frame moves along for output alone.
    pub(super) fn step_on_moving_rest(&mut self, seconds: f64, h: f64) -> Result<()> {
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let Some(rest) = &mut self.moving_rest else { return Ok(()) };
        let still = rest.is_still() && frame == self.frame && rates == Rates::default() && !self.forces_once;
        rest.head(h);
        let over = if rest.jump { f64::INFINITY } else { h };
        self.fill_on_moving_rest(over);
        self.act_on_moving_rest(|motion, acting| motion.step(acting, h))?;
        if let Some(rest) = &mut self.moving_rest {
            rest.arrive();
        }
        (self.frame, self.rates) = (frame, rates);
        self.time += seconds;
        self.forget_forces();
        self.rest_after_step(h, still);
        Ok(())
    }

    /// The equilibrium on the rest shape where it is sent, at rest there.
    pub(super) fn settle_on_moving_rest(&mut self) -> Result<(f64, usize)> {
        if let Some(rest) = &mut self.moving_rest {
            rest.coming.stop();
        }
        self.fill_on_moving_rest(f64::INFINITY);
        self.act_on_moving_rest(|motion, acting| motion.settle(acting))
    }

    fn act_on_moving_rest<T>(
        &mut self,
        act: impl FnOnce(&mut dyn crate::methods::Motion, &Acting) -> Result<T>,
    ) -> Result<T> {
        let (load, pose) = (BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default()), Pose::identity());
        let external = External::OnAll(&self.scratch.force);
        let acting =
            Acting { load: &load, external, points: None, supports: None, pose: &pose, passage: None, again: false };
        act(&mut *self.motion, &acting)
    }

    /// Fills the scratch with all forces in the vertices' own axes, over a step of `h`; infinite where what moves does not accelerate.
    fn fill_on_moving_rest(&mut self, h: f64) {
        let Self { motion, moving_rest, scratch, gravity, loads, model, .. } = self;
        let Some(rest) = moving_rest else { return };
        let MovingRest { next, speed, coming, force, .. } = &mut **rest;
        let LoadScratch { x, v: rate_of, force: out } = scratch;
        let mass = &model.shell.mass;
        motion.visit_motion(&mut |v, u, rate| {
            let (arm, rate) = (next.turn[v] * u, next.turn[v] * rate);
            let omega = coming.turn[v];
            x[v] = next.x[v] + arm;
            rate_of[v] = coming.place[v] + omega.cross(&arm) + rate;
            let [a, alpha] = match h.is_finite() {
                true => [(coming.place[v] - speed.place[v]) / h, (omega - speed.turn[v]) / h],
                false => [Vec3::zeros(); 2],
            };
            let turning = alpha.cross(&arm) + omega.cross(&omega.cross(&arm)) + 2.0 * omega.cross(&rate);
            force[v] = mass[v] * (*gravity - a - turning);
        });
        loads.evaluate(&model.shell.mesh, &Moving { x, v: rate_of }, out);
        for (v, out) in out.iter_mut().enumerate() {
            *out = next.turn[v].inverse() * (*out + force[v]);
        }
    }

    /// From where the method has vertices on the mesh to where they are on a rest shape that moves, if it does.
    pub(super) fn on_moving_rest(&self, space: Space) -> Option<impl Fn(usize, Vec3) -> Vec3> {
        let rest = self.moving_rest.as_deref()?;
        let mesh = &self.model.shell.mesh;
        let pose = self.frame.pose;
        let back = pose.rotation.inverse();
        Some(move |v: usize, local: Vec3| {
            let world = rest.place(v, local, &mesh.positions[v]);
            if space == Space::World { world } else { back * (world - pose.origin) }
        })
    }

    /// The rotation of a vertex of the rest shape, world space.
    pub(super) fn rest_turn(&self, v: usize) -> Option<UnitQuaternion<f64>> {
        self.moving_rest.as_ref().map(|rest| rest.now.turn[v])
    }

    /// The velocity of a vertex that the method has displaced by `u` and moves by `rate`, as one in the frame; on a rest shape that moves.
    pub(super) fn rate_on_moving_rest(&self, v: usize, u: Vec3, rate: Vec3) -> Option<Vec3> {
        let rest = self.moving_rest.as_deref()?;
        let arm = rest.now.turn[v] * u;
        let velocity = rest.speed.place[v] + rest.speed.turn[v].cross(&arm) + rest.now.turn[v] * rate;
        let Pose { origin, rotation } = self.frame.pose;
        let from_origin = rest.now.x[v] + arm - origin;
        let carried = self.rates.velocity + self.rates.angular_velocity.cross(&from_origin);
        Some(rotation.inverse() * (velocity - carried))
    }
}

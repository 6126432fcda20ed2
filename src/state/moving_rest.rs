//! A rest shape that moves, as the host animates it: blend shapes, skinned cloth.
//!
//! A vertex is at x = y + Q u, with its place y in the shape that the host sends, the mean rotation Q of its triangles from the mesh to there,
//! and the displacement u that the method has found on the mesh. So in its own axes it feels
//!
//!   f = Qᵀ (F + m [g − ÿ − α × Qu − ω × (ω × Qu) − 2 ω × Q u̇]),
//!
//! ω and α of Q. No matrix is made anew: a shape that is bent or stretched far from the mesh has another stiffness, which the modes do not know. The full shell
//! does (`methods/nodal/carried.rs`).
//!
//! Each vertex thus has axes of its own, x = (y − Qr) + Q (r + u), r its place on the mesh. Handles and contacts act on x by these. A point between
//! vertices is shown at Σ wᵢxᵢ. A round of contact sees it in the mean axes of its corners, about where the round before left it: so rounds end
//! at gaps that are exact.

use super::{LoadScratch, Motion, Space, State};
use crate::contact::Obstacle;
use crate::error::{invalid, try_zeroed};
use crate::load::{BodyLoad, External, Moving};
use crate::methods::{Acting, Watch};
use crate::point_energy::Point;
use crate::reference::vertex_rotations;
use crate::support::{Axes, Pose, Rates};
use crate::warp::Placement;
use crate::{Error, ErrorKind, Mesh, Result, Vec3, rotation, wide_norm};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};
use std::sync::Arc;

/// A place further from the world's origin than this, in model sizes, is nowhere.
const FURTHEST: f64 = 1e9;

/// Numbers of a vertex in saved states.
pub(super) const VERTEX_DOUBLES: usize = 13;

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
    /// The vertices' axes where the step that is being taken, or a part of it, begins and ends.
    from: Vec<Pose>,
    to: Vec<Pose>,
    /// Where the method last had vertices on the mesh.
    local: Vec<Vec3>,
    /// The axes of points that touch.
    points: Arc<Vec<Pose>>,
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
        let room = || try_zeroed("the rest shape", n);
        let (from, to) = (vec![Pose::identity(); n], vec![Pose::identity(); n]);
        Ok(Self {
            now: shape.clone(),
            next: shape,
            speed: Speed::none(n)?,
            coming: Speed::none(n)?,
            jump: true,
            force: room()?,
            stretch,
            from,
            to,
            local: room()?,
            points: Arc::default(),
        })
    }

    /// Whether the next step finds it elsewhere at once.
    pub(super) fn jumps(&self) -> bool {
        self.jump
    }

    /// The axes of a vertex that rests at `rest` on the mesh, after a share of the way in the next step.
    fn axes_at(&self, v: usize, rest: &Vec3, share: f64) -> Pose {
        let at = |shape: &Shape| Pose { origin: shape.x[v], rotation: shape.turn[v] };
        let Pose { origin, rotation } = match share {
            0.0 if !self.jump => at(&self.now),
            share if share == 1.0 || self.jump => at(&self.next),
            share => at(&self.now).toward(&at(&self.next), share),
        };
        Pose { origin: origin - rotation * rest, rotation }
    }

    /// The vertices' axes where it is now; `rest` are the mesh's positions.
    fn axes_now(&self, rest: &[Vec3]) -> Vec<Pose> {
        let axes = |(v, rest): (usize, &Vec3)| {
            let rotation = self.now.turn[v];
            Pose { origin: self.now.x[v] - rotation * rest, rotation }
        };
        rest.iter().enumerate().map(axes).collect()
    }

    /// Takes the part of the next step between two shares of it; `rest` are the mesh's positions.
    pub(super) fn lead(&mut self, rest: &[Vec3], from: f64, to: f64) {
        for (v, rest) in rest.iter().enumerate() {
            (self.from[v], self.to[v]) = (self.axes_at(v, rest, from), self.axes_at(v, rest, to));
        }
    }

    /// The vertices' axes where that part ends.
    pub(super) fn axes(&self) -> &[Pose] {
        &self.to
    }

    /// Reads where vertices are shown when that part begins, or else ends.
    pub(super) fn read(&mut self, motion: &dyn Motion, begins: bool, x: &mut [Vec3]) {
        let Self { local, from, to, .. } = self;
        motion.positions(&Placement { origin: Vec3::zeros(), rotation: None }, &mut |first, rows| {
            local[first..].iter_mut().zip(rows).for_each(|(x, row)| *x = Vec3::from(*row));
        });
        let axes = if begins { from } else { to };
        x.iter_mut().zip(axes.iter().zip(&*local)).for_each(|(x, (axes, local))| *x = axes.place(local));
    }

    /// The axes of points where that part ends, about where the method last had them.
    pub(super) fn axes_of(&mut self, points: &[Point]) -> Arc<Vec<Pose>> {
        let mut seen = std::mem::take(&mut self.points);
        let list = Arc::make_mut(&mut seen);
        list.clear();
        list.extend(points.iter().map(|point| self.axes_of_point(point)));
        self.points = seen.clone();
        seen
    }

    fn axes_of_point(&self, point: &Point) -> Pose {
        let first = self.to[point.vertices()[0] as usize];
        if point.vertices().len() == 1 {
            return first;
        }
        let add = |sum: Vector4<f64>, (v, w): (usize, f64)| {
            let turn = self.to[v].rotation.coords;
            sum + w * turn.dot(&first.rotation.coords).signum() * turn
        };
        let mean = Quaternion::from(point.corners().fold(Vector4::zeros(), add));
        let rotation = UnitQuaternion::try_new(mean, 0.0).unwrap_or(first.rotation);
        let shown = point.place(|v| self.to[v].place(&self.local[v]));
        Pose { origin: shown - rotation * point.place(|v| self.local[v]), rotation }
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

    /// Hands out the numbers of where it is and how it came there, but for where it goes next.
    pub(super) fn save(&self, push: &mut dyn FnMut(&f64)) {
        [f64::from(u8::from(self.jump)), self.stretch].iter().for_each(&mut *push);
        for v in 0..self.now.x.len() {
            let (place, turn) = (&self.now.x[v], &self.now.turn[v].coords);
            let rates = self.speed.place[v].iter().chain(self.speed.turn[v].iter());
            place.iter().chain(turn.iter()).chain(rates).for_each(&mut *push);
        }
    }

    /// Fails unless these numbers, all finite, are what [`MovingRest::save`] hands out for a mesh of this size.
    pub(super) fn check_saved(numbers: &[f64], size: f64) -> Result<()> {
        let good = |vertex: &[f64]| {
            let near = wide_norm(&Vec3::from_column_slice(vertex)) <= FURTHEST * size;
            near && (Vector4::from_column_slice(&vertex[3..]).norm() - 1.0).abs() <= 1e-9
        };
        let (head, vertices) = numbers.split_at(2);
        if [0.0, 1.0].contains(&head[0]) && head[1] >= 0.0 && vertices.chunks_exact(VERTEX_DOUBLES).all(good) {
            return Ok(());
        }
        invalid("the saved state's rest shape is out of range")
    }

    /// As [`MovingRest::save`] handed it out, and staying there.
    pub(super) fn saved(numbers: &[f64]) -> Result<Self> {
        let (head, vertices) = numbers.split_at(2);
        let vertices = || vertices.chunks_exact(VERTEX_DOUBLES);
        let part = |at: usize| vertices().map(move |vertex| Vec3::from_column_slice(&vertex[at..])).collect();
        // Not renormalized: the same bits must come back.
        let turn = |vertex: &[f64]| UnitQuaternion::new_unchecked(Vector4::from_column_slice(&vertex[3..]).into());
        let shape = Shape { x: part(0), turn: vertices().map(turn).collect() };
        let speed = Speed { place: part(7), turn: part(10) };
        Ok(Self { speed, jump: head[0] != 0.0, ..Self::at(shape, head[1])? })
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

fn cannot_move(with: &str) -> Result<()> {
    Err(Error::new(ErrorKind::Unsupported, format!("the rest shape cannot move with {with}")))
}

impl State {
    /// Where the rest shape is at the end of the next step: `x` gives the place of each vertex (world space). The first call, and a teleport, place it
    /// there at rest. Fails, changing nothing, on a place that is not finite or beyond all measure, and where something acts that needs the
    /// mesh to be at rest: a sagged model, one that moves freely, a point energy, supports that move.
    pub fn move_rest(&mut self, x: impl Fn(usize) -> Vec3, teleport: bool) -> Result<()> {
        self.check_can_move_rest()?;
        if self.supports.is_some() {
            return cannot_move("supports that moved by themselves: they go with the rest shape");
        }
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
            self.carry_motion();
            self.forget_past();
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
        if self.moving_rest.take().is_some() {
            self.carry_motion();
            self.forget_past();
        }
        self.rest.wake();
    }

    /// Tells the method where the rest shape is.
    pub(super) fn carry_motion(&mut self) {
        let Self { motion, moving_rest, model, .. } = self;
        if motion.is_full_shell() {
            let axes = moving_rest.as_ref().map(|rest| rest.axes_now(&model.shell.mesh.positions));
            motion.carry(axes.as_deref());
        }
    }

    /// Largest change of an edge's length from the mesh to the rest shape, a share; 0 where that does not move.
    pub fn rest_stretch(&self) -> f64 {
        self.moving_rest.as_ref().map_or(0.0, |rest| rest.stretch)
    }

    pub(super) fn check_can_move_rest(&self) -> Result<()> {
        self.check_method_can_move_rest(&*self.motion)?;
        let bars = [
            (self.model.modal.zero_modes > 0, "a shell that can move freely away from it: support it"),
            (self.model.shell.sag.is_some(), "a model with sag_gravity, whose stiffness is of one pose"),
            (self.points.is_some(), "a point energy: remove it"),
        ];
        bars.into_iter().find(|(bars, _)| *bars).map_or(Ok(()), |(_, what)| cannot_move(what))
    }

    /// Fails where the rest shape cannot move by a method. The full shell takes its lengths and angles at rest from the shape.
    pub(super) fn check_method_can_move_rest(&self, motion: &dyn Motion) -> Result<()> {
        if !motion.is_full_shell() {
            return Ok(());
        }
        let shell = &self.model.shell;
        let bars = [
            (
                shell.is_stressed() || shell.rest_shape.is_some() || shell.metric.is_some(),
                "a full shell that has a shape, growth or angles without stress of its own: switch to another method",
            ),
            (shell.energy.yielding().is_some(), "a full shell whose creases yield: switch to another method"),
            (!shell.mirrors.is_empty(), "a full shell on planes of symmetry, which stay: switch to another method"),
        ];
        bars.into_iter().find(|(bars, _)| *bars).map_or(Ok(()), |(_, what)| cannot_move(what))
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
        let stepped = self.try_step_on_moving_rest(seconds, h);
        stepped.inspect_err(|_| self.carry_motion())
    }

    fn try_step_on_moving_rest(&mut self, seconds: f64, h: f64) -> Result<()> {
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let Some(rest) = &mut self.moving_rest else { return Ok(()) };
        let around = self.contacts.as_ref().is_some_and(|contacts| contacts.obstacles.iter().any(Obstacle::moves));
        let still = rest.is_still() && frame == self.frame && rates == Rates::default() && !self.forces_once && !around;
        rest.head(h);
        let over = if rest.jump { f64::INFINITY } else { h };
        self.fill_on_moving_rest(over);
        self.lead_rest(0.0, 1.0);
        let (load, pose) = (BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default()), Pose::identity());
        if self.contacts.is_some() {
            self.step_touching(&load, (&pose, None), h)?;
        } else {
            let Self { motion, moving_rest, scratch, .. } = self;
            let axes = Axes { frame: &pose, each: moving_rest.as_ref().map(|rest| rest.axes()) };
            let external = External::OnAll(&scratch.force, &scratch.drag);
            let acting =
                Acting { load: &load, external, points: None, supports: None, axes, passage: None, again: false };
            motion.step(&acting, h)?;
        }
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
    pub(super) fn settle_on_moving_rest(&mut self, watch: &mut Watch) -> Result<(f64, usize)> {
        if let Some(rest) = &mut self.moving_rest {
            rest.coming.stop();
        }
        self.fill_on_moving_rest(f64::INFINITY);
        self.lead_rest(1.0, 1.0);
        let pose = Pose::identity();
        self.settle_touching(&BodyLoad::new(Vec3::zeros(), &pose, &Rates::default()), &pose, watch)
    }

    /// Takes the part of the next step between two shares of it, where the rest shape moves.
    pub(super) fn lead_rest(&mut self, from: f64, to: f64) {
        if let Some(rest) = &mut self.moving_rest {
            rest.lead(&self.model.shell.mesh.positions, from, to);
        }
    }

    /// Fills the scratch with all forces in the vertices' own axes, over a step of `h`; infinite where what moves does not accelerate.
    fn fill_on_moving_rest(&mut self, h: f64) {
        let Self { motion, moving_rest, scratch, gravity, loads, model, .. } = self;
        let Some(rest) = moving_rest else { return };
        let MovingRest { next, speed, coming, force, .. } = &mut **rest;
        let LoadScratch { x, v: rate_of, force: out, drag } = scratch;
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
        let moving = Moving { x, v: rate_of };
        loads.evaluate(&model.shell.mesh, &moving, out);
        if !drag.is_empty() {
            loads.evaluate_drag(&model.shell.mesh, &moving, drag);
            for (v, drag) in drag.iter_mut().enumerate() {
                let turn = next.turn[v].to_rotation_matrix();
                *drag = turn.matrix().transpose() * *drag * turn.matrix();
            }
        }
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

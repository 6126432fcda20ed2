//! A moving shell: its motion over a shared [`Model`], and the loads on it.

mod certify;
mod contact;
mod correct;
mod look;
mod moving_rest;
mod output;
mod plan;
mod pose;
mod rest;
mod saved;
mod stiffness;
mod supports;
mod switch;

use crate::constraint::{Constraint, ConstraintSet, Outcome};
use crate::contact::{Contacts, Obstacle};
use crate::energy::Mat3;
use crate::error::{require_finite, require_non_negative};
use crate::load::{BodyLoad, External, Following, Loads, Moving, Wind};
pub use crate::methods::plan::{Part, PartKind};
use crate::methods::{self, Acting, Motion, Watch};
pub use crate::methods::{Damping, Method, ROTATION_RANGE};
use crate::point_energy::{InFrame, PointEnergy};
use crate::step::Integrator;
use crate::support::{Axes, Frame, FrameMotion, Passage, Pose, Rates};
use crate::{Error, ErrorKind, Model, Result, Vec3};
pub use certify::{Certificate, LARGEST_ERROR};
pub use contact::{MOST_OBSTACLES, Outside};
use correct::KeptCorrection;
use moving_rest::MovingRest;
pub use output::{Outward, Report, Shown};
use rest::Rest;
pub use saved::HEADER as SAVED_HEADER;
use std::sync::Arc;
use stiffness::Tempo;
use supports::MovingSupports;

/// Axes in which output is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// World axes and origin.
    World,
    /// The support frame's.
    Frame,
}

/// Room for loads on all vertices: positions and velocities for wind, forces first in world, then in frame axes (n_vertices each,
/// or empty). The full shell alone has the wind's drag.
#[derive(Clone, Default)]
struct LoadScratch {
    x: Vec<Vec3>,
    v: Vec<Vec3>,
    force: Vec<Vec3>,
    drag: Vec<Mat3>,
}

/// See the module's text.
pub struct State {
    model: Arc<Model>,
    motion: Box<dyn Motion>,
    gravity: Vec3,
    loads: Loads,
    /// World space.
    points: Option<Arc<dyn PointEnergy>>,
    contacts: Option<Box<Contacts>>,
    /// Forces act in the next step only.
    forces_once: bool,
    scratch: LoadScratch,
    frame: Frame,
    /// None until they move.
    supports: Option<Box<MovingSupports>>,
    /// None until it moves.
    moving_rest: Option<Box<MovingRest>>,
    /// Of the frame over the last step.
    rates: Rates,
    /// The frame was set since creation or reset.
    placed: bool,
    time: f64,
    rest: Rest,
    /// Loads and rates here are by it.
    tempo: Tempo,
    /// As they were asked for, for another method.
    damping: Damping,
    integrator: Integrator,
    /// What the next one goes on from.
    correction: Option<Box<KeptCorrection>>,
}

/// Forces that depend on the shape are taken anew at an equilibrium in so many rounds at most.
const FOLLOWING_ROUNDS: usize = 100;
/// Iterations of all these rounds at most: a full shell that flutters takes hundreds in each.
const FOLLOWING_ITERATIONS: usize = 2000;

/// The forces that [`State::evaluate_loads`] left in the scratch, or those on few vertices as they are, for vertices in these axes.
fn external<'a>(loads: &'a Loads, scratch: &'a LoadScratch, model: &Model, axes: &Axes) -> External<'a> {
    match loads.point_forces(model.shell.mass.len()) {
        Some(forces) if axes.each.is_none() => External::OnSome(forces, axes.frame.rotation.inverse()),
        _ => External::OnAll(&scratch.force, &scratch.drag),
    }
}

impl State {
    /// At rest, without loads, undamped, the frame at the world's origin. `integrator` is for modal methods and the full shell. Fails when
    /// memory does not suffice for a nonlinear shell's factorization.
    pub fn new(model: Arc<Model>, method: Method, integrator: Integrator) -> Result<Self> {
        model.require_arithmetic(method)?;
        Ok(Self {
            motion: methods::build(&model, method, integrator)?,
            gravity: Vec3::zeros(),
            loads: Loads::default(),
            points: None,
            contacts: None,
            forces_once: false,
            scratch: LoadScratch::default(),
            frame: Frame::at_rest(Pose::identity()),
            supports: None,
            moving_rest: None,
            rates: Rates::default(),
            placed: false,
            time: 0.0,
            rest: Rest::default(),
            tempo: Tempo::default(),
            damping: Damping::default(),
            integrator,
            correction: None,
            model,
        })
    }

    /// The same by the method of the model's choice. The full shell then moves by steps of second order.
    pub fn of_choice(model: Arc<Model>, integrator: Integrator) -> Result<Self> {
        let method = model.chosen_method();
        let chosen = Self::new(model, method, switch::chosen_steps(method, integrator))?;
        Ok(Self { integrator, ..chosen })
    }

    /// An independent copy.
    pub fn try_clone(&self) -> Result<Self> {
        let mut copy = Self {
            model: self.model.clone(),
            motion: self.motion.try_clone()?,
            gravity: self.gravity,
            loads: self.loads.clone(),
            points: self.points.clone(),
            contacts: self.contacts.clone(),
            forces_once: self.forces_once,
            scratch: self.scratch.clone(),
            frame: self.frame,
            supports: self.supports.clone(),
            moving_rest: self.moving_rest.clone(),
            rates: self.rates,
            placed: self.placed,
            time: self.time,
            rest: self.rest,
            tempo: self.tempo,
            damping: self.damping.clone(),
            integrator: self.integrator,
            correction: self.correction.clone(),
        };
        copy.make_room_for_contacts();
        Ok(copy)
    }

    /// How it moves.
    pub fn method(&self) -> Method {
        self.motion.method()
    }

    /// The model it moves on.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Modal amplitudes q and their rates q̇, over [`State::tempo`].
    pub fn amplitudes(&self) -> Result<(&[f64], &[f64])> {
        self.motion.amplitudes()
    }

    /// Pose of the support frame at the end of the last step.
    pub fn pose(&self) -> &Pose {
        &self.frame.pose
    }

    /// Bytes of a modal state of `n_modes` modes.
    pub fn bytes_for(n_modes: usize) -> usize {
        size_of::<Self>() + 8 * size_of::<f64>() * n_modes
    }

    /// Back to rest and time 0. Loads, damping and constraints stay; the frame stays where it was last set, at rest.
    pub fn reset(&mut self) {
        self.motion.reset();
        if let Some(supports) = &mut self.supports {
            supports.arrive(None);
            self.motion.place_supports(&supports.now);
        }
        if let Some(rest) = &mut self.moving_rest {
            rest.stop();
            self.carry_motion();
        }
        self.forget_past();
        self.time = 0.0;
        self.frame = Frame::at_rest(self.frame.target);
        self.rates = Rates::default();
        self.placed = false;
        self.rest.wake();
    }

    /// Sets when the state rests, and skips its steps until something changes: when what is left of its motion can move no
    /// vertex by more than `tolerance`, or for 0, as at first, when a step changes no bit. See `Rest`'s text.
    pub fn set_rest_tolerance(&mut self, tolerance: f64) -> Result<()> {
        let tolerance = require_non_negative("tolerance", tolerance)?;
        self.wake_if(tolerance != self.rest.tolerance);
        self.rest.tolerance = tolerance;
        Ok(())
    }

    /// Whether steps are skipped now.
    pub fn is_asleep(&self) -> bool {
        self.rest.asleep()
    }

    fn wake_if(&mut self, changed: bool) {
        if changed {
            self.rest.wake();
        }
    }

    /// World axes, acceleration.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<()> {
        for (c, name) in gravity.iter().zip(["gravity[0]", "gravity[1]", "gravity[2]"]) {
            require_finite(name, *c)?;
        }
        let gravity = gravity / self.tempo.factor;
        self.wake_if(gravity != self.gravity);
        self.gravity = gravity;
        Ok(())
    }

    /// Replaces the forces on vertices (world axes), for good or for the next step only. As many as before need no new room.
    pub fn set_forces(&mut self, forces: impl IntoIterator<Item = (u32, Vec3)>, once: bool) -> Result<()> {
        let factor = self.tempo.factor;
        let forces = forces.into_iter().map(|(v, force)| (v, force / factor));
        let changed = self.loads.set_forces(forces, self.model.shell.mass.len())?;
        if let Err(error) = self.make_room() {
            self.loads.undo_forces();
            return Err(error);
        }
        self.wake_if(once || self.forces_once || changed);
        self.forces_once = once;
        Ok(())
    }

    /// Replaces the wind.
    pub fn set_wind(&mut self, wind: Wind) -> Result<()> {
        let wind = self.tempo.wind(wind);
        let before = self.loads.set_wind(wind, self.model.shell.mass.len())?;
        if let Err(error) = self.make_room() {
            self.loads.wind = before;
            return Err(error);
        }
        self.wake_if(self.loads.wind != before);
        Ok(())
    }

    /// Replaces the energy of single points that joins the shell's own (world space). It stays as it is while it is set, and is not saved.
    pub fn set_point_energy(&mut self, energy: Option<Arc<dyn PointEnergy>>) -> Result<()> {
        let n_vertices = self.model.shell.mass.len();
        let points = energy.as_ref().map_or(&[][..], |energy| energy.points());
        let mut vertices = points.iter().flat_map(|point| point.vertices());
        if let Some(v) = vertices.find(|v| **v as usize >= n_vertices) {
            return Err(Error::argument(format!("an energy acts on vertex {v} of {n_vertices}")));
        }
        if energy.is_some() && !self.tempo.is_one() {
            return Err(Error::argument("a state of another stiffness factor than 1 takes no point energy"));
        }
        self.refuse_moving_rest("a point energy")?;
        if self.contacts.is_some() && energy.is_some() {
            return Err(Error::argument("a state has colliders or a point energy, not both"));
        }
        self.points = energy;
        self.rest.wake();
        Ok(())
    }

    /// Room for what the present loads need.
    fn make_room(&mut self) -> Result<()> {
        let n = self.model.shell.mass.len();
        let on_all = if self.moving_rest.is_some() || self.loads.point_forces(n).is_none() { n } else { 0 };
        let moving = if self.moving_rest.is_some() || self.loads.needs_motion() { n } else { 0 };
        let resisting = self.motion.is_full_shell() && self.loads.needs_motion();
        let resisting = if resisting { n } else { 0 };
        let LoadScratch { x, force, drag, .. } = &self.scratch;
        if (force.len(), x.len(), drag.len()) != (on_all, moving, resisting) {
            let room = |n: usize| crate::error::try_zeroed::<Vec3>("the loads", n);
            let drag = crate::error::try_zeroed::<Mat3>("the wind's drag", resisting)?;
            self.scratch = LoadScratch { x: room(moving)?, v: room(moving)?, force: room(on_all)?, drag };
        }
        Ok(())
    }

    /// Replaces all damping. The nonlinear shell takes no ratios.
    pub fn set_damping(&mut self, damping: &Damping) -> Result<()> {
        self.apply_damping(damping)?;
        self.damping.clone_from(damping);
        Ok(())
    }

    fn apply_damping(&mut self, damping: &Damping) -> Result<()> {
        require_non_negative("mass_coefficient", damping.mass_coefficient)?;
        require_non_negative("stiffness_coefficient", damping.stiffness_coefficient)?;
        for (k, ratio) in damping.ratios.iter().enumerate() {
            require_non_negative(format_args!("ratios[{k}]"), *ratio)?;
        }
        let (given, vertices) = (damping.factors.len(), self.model.shell.mass.len());
        if given != 0 && given != vertices {
            return Err(Error::argument(format!(
                "{given} damping factors for {vertices} vertices: give none or {vertices}"
            )));
        }
        for (v, factor) in damping.factors.iter().enumerate() {
            require_non_negative(format_args!("factors[{v}]"), *factor)?;
        }
        let changed = match self.tempo.is_one() {
            true => self.motion.set_damping(damping)?,
            false => self.motion.set_damping(&self.tempo.damping(damping))?,
        };
        self.wake_if(changed);
        Ok(())
    }

    /// Adds a constraint, or replaces the one with its id.
    pub fn set_constraint(&mut self, mut constraint: Constraint) -> Result<()> {
        constraint.compliance *= self.tempo.factor;
        self.motion.check_constraint(&constraint)?;
        let n_vertices = self.model.shell.mass.len();
        let changed = self.motion.change(|set| set.set(constraint, n_vertices))?;
        if let Some(contacts) = &mut self.contacts {
            contacts.parted.expect_constraints(self.motion.constraints().items().len());
        }
        self.wake_if(changed);
        Ok(())
    }

    /// Removes a constraint. Fails if there is none with this id.
    pub fn clear_constraint(&mut self, id: u32) -> Result<()> {
        let found = self.motion.change(|set| set.clear(id));
        self.wake_if(found);
        if found { Ok(()) } else { Err(Error::argument(format!("there is no constraint {id}"))) }
    }

    /// Removes all constraints.
    pub fn clear_constraints(&mut self) {
        self.motion.change(ConstraintSet::clear_all);
        self.rest.wake();
    }

    /// The constraints, by ascending id, with what the last step made of them: forces, and the inverse of compliances, over [`State::stiffness`].
    pub fn constraints(&self) -> impl Iterator<Item = (&Constraint, &Outcome)> {
        self.motion.constraints().report()
    }

    /// Where the support frame is at the end of the next step. Set for the first time since creation or reset, and before any
    /// step, it is simply placed there.
    pub fn set_frame(&mut self, target: Pose, motion: FrameMotion) {
        let before = self.frame;
        if self.time == 0.0 && !self.placed {
            self.frame = Frame::at_rest(target);
        }
        self.placed = true;
        self.frame.target = target;
        self.frame.motion = self.tempo.frame_motion(motion);
        self.wake_if(self.frame != before);
    }

    /// Replaces q and q̇ (modes each), of a second.
    pub fn set_amplitudes(&mut self, q: &[f64], q_dot: &[f64]) -> Result<()> {
        match self.tempo.is_one() {
            true => self.motion.set_amplitudes(q, q_dot)?,
            false => {
                let q_dot: Vec<f64> = q_dot.iter().map(|rate| rate / self.tempo.root).collect();
                self.motion.set_amplitudes(q, &q_dot)?;
            }
        }
        self.forget_past();
        self.rest.wake();
        Ok(())
    }

    /// Advances by `h` > 0 seconds. The modal force is taken at the shape at the start of the step (paper eq. 12), or in the middle of it in
    /// a spinning frame. Fails, and leaves everything as it was, when the result would not be finite. Modal
    /// methods do not allocate. A state that rests only lets the time pass.
    pub fn step(&mut self, h: f64) -> Result<()> {
        self.check_step(h)?;
        let tempo = self.tempo;
        self.advance(h, h * tempo.root).map_err(|error| tempo.told(error))?;
        self.leave_correction();
        Ok(())
    }

    /// By so many seconds, of which `h` is the time that the loads and rates are by.
    fn advance(&mut self, seconds: f64, h: f64) -> Result<()> {
        if self.rest.skips(h) {
            self.time += seconds;
            return Ok(());
        }
        if self.moving_rest.is_some() {
            return self.step_on_moving_rest(seconds, h);
        }
        let mut frame = self.frame;
        let rates = frame.advance(h);
        if !rates.is_finite() {
            let message = format!("the frame moves too far in a step of {h:?} s: its rates are not finite");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let passage = if self.motion.is_held() { None } else { self.frame.passage(&frame, self.gravity) };
        match passage {
            Some(Passage { from, before: [velocity, angular_velocity], .. }) => {
                let before = Rates { velocity, angular_velocity, ..Rates::default() };
                self.evaluate_loads((&from, &before), &frame.pose);
            }
            None => self.evaluate_loads((&frame.pose, &rates), &frame.pose),
        }
        let load = self.body_load(&frame.pose, &rates);
        let around = self.contacts.as_ref().is_some_and(|contacts| contacts.obstacles.iter().any(Obstacle::moves));
        let held = self.supports.as_ref().is_none_or(|supports| supports.is_still());
        let still = frame == self.frame && rates == Rates::default() && !self.forces_once && !around && held;
        if let Some(supports) = &mut self.supports {
            supports.head(1.0);
        }
        if self.contacts.is_some() {
            self.step_touching(&load, (&frame.pose, passage), h)?;
        } else {
            let points = self.points_at(&frame.pose);
            let Self { model, motion, loads, scratch, supports, .. } = self;
            let axes = Axes::from(&frame.pose);
            let external = external(loads, scratch, model, &axes);
            let (points, supports) = (points.as_ref(), supports.as_ref().map(|supports| supports.targets()));
            motion.step(&Acting { load: &load, external, points, supports, axes, passage, again: false }, h)?;
        }
        (self.frame, self.rates) = (frame, rates);
        if let Some(supports) = &mut self.supports {
            supports.arrive(Some(h));
        }
        self.time += seconds;
        self.forget_forces();
        self.rest_after_step(h, still);
        Ok(())
    }

    fn check_step(&self, h: f64) -> Result<()> {
        if h.is_finite() && h > 0.0 && (self.time + h).is_finite() {
            return Ok(());
        }
        Err(Error::argument(format!("the step is {h:?} s: it must be positive and finite")))
    }

    /// Falls asleep when the last step has shown that nothing moves; nothing around the shell did when it was `still`.
    fn rest_after_step(&mut self, h: f64, still: bool) {
        let Self { motion, rest, points, contacts, .. } = self;
        let left = || motion.motion_left().filter(|_| points.is_none() && contacts.is_none());
        if !still {
            rest.wake();
        } else if rest.after_step(h, motion.is_unchanged(), left) {
            motion.stop();
        }
    }

    /// About how long a step takes without forces and wind, for sharing out work: measured on one machine, and only good to a
    /// small factor.
    pub fn step_nanoseconds(&self) -> u64 {
        self.motion.step_nanoseconds()
    }

    /// Gravity and inertia as the unknowns feel them.
    fn body_load(&self, pose: &Pose, rates: &Rates) -> BodyLoad {
        let load = BodyLoad::new(self.gravity, pose, rates);
        match &self.model.shell.sag {
            Some(sag) if self.motion.is_about_sag() => load.without_sag_weight(sag.gravity),
            _ => load,
        }
    }

    fn points_at(&self, pose: &Pose) -> Option<InFrame> {
        self.points.as_ref().map(|energy| InFrame::new(energy.clone(), *pose))
    }

    fn forget_forces(&mut self) {
        if self.forces_once {
            self.loads.clear_forces();
            self.forces_once = false;
        }
    }

    /// Fills the scratch with the external forces, in the axes of the frame at `pose`, on the shell in a frame that is `placed` and moves so.
    fn evaluate_loads(&mut self, placed: (&Pose, &Rates), pose: &Pose) {
        if self.loads.point_forces(self.model.shell.mass.len()).is_some() {
            return;
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        self.fill_loads(placed, pose, &mut scratch);
        self.scratch = scratch;
    }

    /// As [`State::evaluate_loads`], into any scratch with the state's room.
    fn fill_loads(&self, (from, rates): (&Pose, &Rates), pose: &Pose, scratch: &mut LoadScratch) {
        if self.loads.needs_motion() {
            let mut place = self.placing(from, rates, scratch);
            self.motion.visit_motion(&mut place);
        }
        self.press(pose, scratch);
    }

    /// Puts the displacement and the rate of a vertex (frame axes) into the scratch, for wind.
    fn placing(&self, pose: &Pose, rates: &Rates, scratch: &mut LoadScratch) -> impl FnMut(usize, Vec3, Vec3) {
        let (rotation, rest) = (pose.rotation.to_rotation_matrix(), &self.model.shell.mesh.positions);
        move |v: usize, u: Vec3, rate: Vec3| {
            let arm = rotation * (rest[v] + u);
            scratch.x[v] = pose.origin + arm;
            scratch.v[v] = rates.velocity + rates.angular_velocity.cross(&arm) + rotation * rate;
        }
    }

    /// Fills the scratch's forces, for what is placed there.
    fn press(&self, pose: &Pose, scratch: &mut LoadScratch) {
        let rotation = pose.rotation.to_rotation_matrix();
        let moving = Moving { x: &scratch.x, v: &scratch.v };
        self.loads.evaluate(&self.model.shell.mesh, &moving, &mut scratch.force);
        scratch.force.iter_mut().for_each(|f| *f = rotation.inverse() * *f);
        if !scratch.drag.is_empty() {
            self.loads.evaluate_drag(&self.model.shell.mesh, &moving, &mut scratch.drag);
            scratch.drag.iter_mut().for_each(|d| *d = rotation.inverse() * *d * rotation);
        }
    }

    /// Moves to the static solution under the present loads and constraints, at rest in the frame where it is set to be and as it moves
    /// there ([`Frame::steady_rates`]); time does not pass. Returns the residual relative to the load, and the iterations. Fails,
    /// changing nothing, when none is found.
    pub fn equilibrium(&mut self) -> Result<(f64, usize)> {
        self.equilibrium_watched(&mut |_| Ok(()))
    }

    /// The same, where `watch` hears now and then what is left of the force, relative, and may stop the work with an error: after each iteration of the
    /// full shell and of the warp, and each share of the load of a reduced shell.
    pub fn equilibrium_watched(&mut self, watch: &mut Watch) -> Result<(f64, usize)> {
        let (before, from_fields) = (self.motion.unknowns(), self.motion.comes_from_fields());
        let constraints = self.motion.constraints().clone(); // with what the last step made of them
        let contacts = self.contacts.clone();
        let (pose, rates) = (self.frame.target, self.frame.steady_rates());
        let found = self.settle(&pose, &rates, watch);
        if found.is_err() {
            self.motion.set_unknowns([&before[0], &before[1]]);
            if from_fields {
                self.motion.come_from_fields();
            }
            self.motion.change(|set| *set = constraints);
            self.contacts = contacts;
            self.carry_motion();
            return found;
        }
        self.leave_correction();
        self.frame = self.frame.moving_at(&rates);
        self.rates = rates;
        if let Some(rest) = &mut self.moving_rest {
            rest.stop();
        }
        if let Some(supports) = &mut self.supports {
            supports.arrive(None);
        }
        self.rest.wake();
        self.forget_forces();
        found
    }

    /// As [`State::equilibrium`], leaving the frame. Wind turns with the shell, and the forces of a frame that turns depend on where it
    /// is: they are taken anew on the shape found until they no longer change.
    fn settle(&mut self, pose: &Pose, rates: &Rates, watch: &mut Watch) -> Result<(f64, usize)> {
        let load = self.body_load(pose, rates);
        if let Some(supports) = &mut self.supports {
            supports.head(1.0);
        }
        let (mut following, mut iterations, mut rounds) = (Following::new(), 0, 0);
        while rounds < FOLLOWING_ROUNDS && iterations <= FOLLOWING_ITERATIONS {
            rounds += 1;
            self.motion.stop();
            if self.moving_rest.is_some() {
                let (residual, more) = self.settle_on_moving_rest(watch)?;
                let force = if self.loads.needs_motion() { self.scratch.force.clone() } else { vec![] };
                iterations += more;
                if force.is_empty() || following.has_settled(&force) {
                    return Ok((residual, iterations));
                }
                following.take(force);
                continue;
            }
            self.evaluate_loads((pose, rates), pose);
            let force = self.following_forces(&load);
            let still = force.is_empty();
            let settled = following.has_settled(&force);
            if self.loads.needs_motion() && load.spin_rate().is_none() {
                following.take_share(&mut self.scratch.force);
            } else {
                following.take(force);
            }
            let (residual, more) = self.settle_touching(&load, pose, watch)?;
            iterations += more;
            if still || settled {
                return Ok((residual, iterations));
            }
        }
        let message = format!(
            "no equilibrium: forces that depend on the shape, such as wind, still change after {rounds} rounds of {iterations} \
             iterations; where there is one, steps with damping come to it"
        );
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// The motion's equilibrium under loads as they are, and where `touching` has its force.
    fn settle_alone(
        &mut self,
        load: &BodyLoad,
        pose: &Pose,
        touching: Option<&InFrame>,
        watch: &mut Watch,
    ) -> Result<(f64, usize)> {
        let own = self.points_at(pose);
        let Self { model, motion, loads, scratch, supports, moving_rest, .. } = self;
        let axes = Axes { frame: pose, each: moving_rest.as_ref().map(|rest| rest.axes()) };
        let external = external(loads, scratch, model, &axes);
        let (points, supports) = (touching.or(own.as_ref()), supports.as_ref().map(|supports| supports.targets()));
        motion.settle(&Acting { load, external, points, supports, axes, passage: None, again: false }, watch)
    }

    /// Forces that depend on the shape in ways that the method's own search leaves to rounds: wind, and of a frame that turns (n_vertices,
    /// frame axes; none where neither acts).
    fn following_forces(&self, load: &BodyLoad) -> Vec<Vec3> {
        let (mesh, mass) = (&self.model.shell.mesh, &self.model.shell.mass);
        let mut force = if self.loads.needs_motion() { self.scratch.force.clone() } else { vec![] };
        if load.spin_rate().is_some() && !self.motion.settles_spin() {
            force.resize(mass.len(), Vec3::zeros());
            let place = |v: usize, u: Vec3, _| force[v] += load.at(mass[v], mesh.positions[v] + u, Vec3::zeros());
            self.motion.visit_motion(&mut { place });
        }
        force
    }
}

//! Steps and equilibria of a shell among solids: rounds of the method's own, as [`crate::contact`] has it.

use super::{Space, State, external};
use crate::contact::{Contact, Contacts, Obstacle, ROUNDS, Round, STATIC_ROUNDS, Summary, push_out};
use crate::features::{Contact as Built, Feature, Proof};
use crate::load::BodyLoad;
use crate::methods::plan::{Part, PartKind};
use crate::methods::{Acting, Motion};
use crate::point_energy::InFrame;
use crate::support::Pose;
use crate::warp::Placement;
use crate::{Error, ErrorKind, Result, Vec3};

/// Of a vertex that is placed, of a probe that is looked at in a round, and of a contact for each pair of unknowns.
const LOOK_VERTEX: f64 = 60.0;
const LOOK_PROBE: f64 = 20.0;
const PRESS: f64 = 2.0;
/// Solids of a state, at most.
pub const MOST_OBSTACLES: usize = 65_536;

fn placement(pose: &Pose) -> Placement {
    Placement { origin: pose.origin, rotation: Some(*pose.rotation.to_rotation_matrix().matrix()) }
}

fn read(motion: &dyn Motion, pose: &Pose, x: &mut [Vec3]) {
    motion.positions(&placement(pose), &mut |first, rows| {
        x[first..].iter_mut().zip(rows).for_each(|(x, row)| *x = Vec3::from(*row));
    });
}

impl State {
    /// Replaces the solids that the shell touches; none for no contact. Those that are the same as before in their place go on being
    /// touched. Their poses are where they are now.
    pub fn set_obstacles(&mut self, obstacles: Vec<Obstacle>) -> Result<()> {
        let _proof: Built = Proof::of(Feature::Contact)?;
        self.refuse_moving_rest("colliders")?;
        if obstacles.len() > MOST_OBSTACLES {
            return Err(Error::argument(format!("{} colliders: at most {MOST_OBSTACLES}", obstacles.len())));
        }
        if self.points.is_some() && !obstacles.is_empty() {
            return Err(Error::argument("a state has colliders or a point energy, not both"));
        }
        self.rest.wake();
        match &mut self.contacts {
            _ if obstacles.is_empty() => self.contacts = None,
            Some(contacts) => contacts.replace(&self.model.shell, obstacles),
            none => {
                let all = self.motion.is_full_shell();
                *none = Some(Box::new(Contacts::new(&self.model.shell, obstacles, all)));
            }
        }
        self.make_room_for_contacts();
        Ok(())
    }

    /// Now: a step does not allocate.
    pub(super) fn make_room_for_contacts(&mut self) {
        if let Some(contacts) = &mut self.contacts {
            contacts.serve(self.motion.is_full_shell());
            self.motion.expect_points(contacts.capacity());
            self.motion.copy_unknowns(&mut contacts.unknowns);
            self.motion.copy_unknowns(&mut contacts.came_to);
            contacts.came_at = None; // only the room was wanted
        }
    }

    /// The solids, with where they are and go.
    pub fn obstacles(&self) -> &[Obstacle] {
        self.contacts.as_ref().map_or(&[], |contacts| &contacts.obstacles)
    }

    /// Where a solid is at the end of the next step. `jump`, and the first time: it is there at once,
    /// without a velocity.
    pub fn move_obstacle(&mut self, index: usize, target: Pose, jump: bool) -> Result<()> {
        let n = self.obstacles().len();
        let obstacle = self.contacts.as_mut().and_then(|contacts| contacts.obstacles.get_mut(index));
        let Some(obstacle) = obstacle else {
            return Err(Error::argument(format!("collider {index} of {n}: there is none")));
        };
        let jump = jump || !obstacle.placed;
        let changed = obstacle.target != target || (jump && obstacle.pose != target);
        (obstacle.target, obstacle.placed) = (target, true);
        if jump {
            obstacle.pose = target;
        }
        self.wake_if(changed);
        Ok(())
    }

    /// The shape that a mesh that deforms has at the end of the next step (its vertices, in its axes). `jump`: it has it at once. The first
    /// time the state takes a copy of the mesh for its own.
    pub fn deform_obstacle(&mut self, index: usize, positions: &[Vec3], jump: bool) -> Result<()> {
        let n = self.obstacles().len();
        let obstacle = self.contacts.as_mut().and_then(|contacts| contacts.obstacles.get_mut(index));
        let Some(obstacle) = obstacle else {
            return Err(Error::argument(format!("collider {index} of {n}: there is none")));
        };
        obstacle
            .deform(positions, jump)
            .map_err(|error| Error::new(error.kind, format!("collider {index}: {error}")))?;
        self.rest.wake();
        Ok(())
    }

    /// Nothing touches: the shell is elsewhere.
    pub(super) fn forget_contacts(&mut self) {
        if let Some(contacts) = &mut self.contacts {
            contacts.forget();
        }
    }

    /// Where the shell touched at the end of the last step, by ascending vertex and solid.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> {
        self.contacts.iter().flat_map(|contacts| contacts.shown()).map(|contact| self.tempo.contact(contact))
    }

    /// Positions (n_vertices) for the eye: what is inside a solid is pushed out of it, smoothly. The motion does not know. Returns how deep the
    /// deepest vertex still is, between solids that leave no room. Held vertices stay. Allocates.
    pub fn positions_outside(&self, space: Space) -> Result<(Vec<Vec3>, f64)> {
        let shell = &self.model.shell;
        let mut x = crate::error::try_zeroed("the positions", shell.mass.len())?;
        if self.obstacles().is_empty() {
            self.positions(space, |v, p| x[v] = p);
            return Ok((x, 0.0));
        }
        self.positions(Space::World, |v, p| x[v] = p);
        // Where they are, not where they go in the next step.
        let solids: Vec<Obstacle> = self.obstacles().iter().map(Obstacle::now).collect();
        let deepest = push_out(&solids, &shell.mesh.edges, &shell.held, &mut x)?;
        if space == Space::Frame {
            let Pose { origin, rotation } = self.frame.pose;
            x.iter_mut().for_each(|x| *x = rotation.inverse() * (*x - origin));
        }
        Ok((x, deepest))
    }

    /// What touched in the last step.
    pub fn contact_summary(&self) -> Summary {
        self.tempo.summary(self.contacts.as_ref().map_or_else(Summary::default, |contacts| contacts.summary))
    }

    /// What contact does in a step.
    pub(super) fn plan_contact(&self) -> Part {
        let Some(contacts) = &self.contacts else { return Part::absent(PartKind::Contact, "no collider is set") };
        let (touching, [probes, rounds]) = (contacts.touching().len(), contacts.work());
        let (n, unknowns) = (self.model.shell.mass.len() as f64, self.motion.n_unknowns() as f64);
        let look = (1 + rounds) as f64 * (LOOK_VERTEX * n + LOOK_PROBE * probes as f64);
        let unknowns = if self.motion.is_full_shell() { 1.0 } else { unknowns };
        let solve = touching as f64 * rounds as f64 * PRESS * unknowns * unknowns;
        Part {
            kind: PartKind::Contact,
            active: true,
            bytes: contacts.bytes(),
            operations: look + solve,
            reason: format!("{touching} contacts, {probes} probes, {rounds} rounds as in the last step"),
        }
    }

    /// The slowest eigenvalue that is not zero, and the mass.
    fn scale_of_contact(&self) -> (f64, f64) {
        let (shell, modal) = (&self.model.shell, &self.model.modal);
        (shell.total_mass, modal.eigenvalues.get(modal.zero_modes).copied().unwrap_or(0.0))
    }

    /// A step of the motion among the solids, with loads evaluated for the frame's next `pose`. Changes nothing on failure.
    pub(super) fn step_touching(&mut self, load: &BodyLoad, pose: &Pose, h: f64) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else { return Ok(()) };
        // Constraints go all their way in the first part of a step: a step with any has one part.
        let parts = if self.motion.constraints().is_empty() { contacts.parts() } else { 1 };
        let outcome = if parts == 1 {
            self.take_rounds(&mut contacts, load, (&{ self.frame.pose }, pose), h)
        } else {
            self.take_parts(&mut contacts, load, pose, h, parts)
        };
        self.contacts = Some(contacts);
        outcome
    }

    /// As [`State::step_touching`], with solids and frame led in as many parts.
    fn take_parts(
        &mut self,
        contacts: &mut Box<Contacts>,
        load: &BodyLoad,
        pose: &Pose,
        h: f64,
        n: usize,
    ) -> Result<()> {
        let (begun, start) = (contacts.clone(), self.motion.unknowns());
        let frame = self.frame.pose;
        let (mut from, mut impulse, mut count) = (frame, Vec3::zeros(), 0);
        for part in 1..=n {
            let share = part as f64 / n as f64;
            let to = if part == n { *pose } else { frame.toward(pose, share) };
            for (obstacle, begun) in contacts.obstacles.iter_mut().zip(&begun.obstacles) {
                obstacle.target = if part == n { begun.target } else { begun.pose.toward(&begun.target, share) };
            }
            if let Some(supports) = &mut self.supports {
                supports.head(share);
            }
            if let Err(error) = self.take_rounds(contacts, load, (&from, &to), h / n as f64) {
                self.motion.set_unknowns([&start[0], &start[1]]);
                *contacts = begun;
                return Err(error);
            }
            impulse += contacts.summary.impulse;
            count = count.max(contacts.summary.count);
            from = to;
        }
        (contacts.summary.impulse, contacts.summary.count) = (impulse, count);
        Ok(())
    }

    fn take_rounds(
        &mut self,
        contacts: &mut Contacts,
        load: &BodyLoad,
        (from, pose): (&Pose, &Pose),
        h: f64,
    ) -> Result<()> {
        let scale = self.scale_of_contact();
        let Self { model, motion, loads, scratch, supports, .. } = self;
        let supports = supports.as_ref().map(|supports| supports.targets());
        let round = Round { h: Some(h), feels_start: motion.feels_start() };
        motion.copy_unknowns(&mut contacts.unknowns);
        let work = motion.constraints().work;
        if !contacts.goes_on(from) {
            read(&**motion, from, &mut contacts.start);
            contacts.measure_start();
        }
        contacts.begin(scale, round);
        if round.feels_start {
            contacts.end.clone_from(&contacts.start);
            contacts.update(round);
        }
        for turn in 0..ROUNDS {
            if turn > 0 {
                motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
                motion.change(|set| set.work = work);
            }
            let points = contacts.energy().map(|energy| InFrame { energy, pose: *pose });
            let external = external(loads, scratch, model, pose);
            let again = turn > 0;
            let step = motion.step(&Acting { load, external, points: points.as_ref(), supports, pose, again }, h);
            drop(points);
            if let Err(error) = step {
                motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
                motion.change(|set| set.work = work);
                contacts.undo();
                return Err(error);
            }
            read(&**motion, pose, &mut contacts.end);
            if contacts.update(round) || round.feels_start {
                break;
            }
        }
        contacts.accept(round);
        if !contacts.serves_all() {
            motion.copy_unknowns(&mut contacts.came_to);
            contacts.came_at = Some(*pose);
        }
        Ok(())
    }

    /// The motion's equilibrium among the solids where they are to be, without friction.
    pub(super) fn settle_touching(&mut self, load: &BodyLoad, pose: &Pose) -> Result<(f64, usize)> {
        let Some(mut contacts) = self.contacts.take() else { return self.settle_alone(load, pose, None) };
        let outcome = self.settle_rounds(&mut contacts, load, pose);
        self.contacts = Some(contacts);
        outcome
    }

    fn settle_rounds(&mut self, contacts: &mut Contacts, load: &BodyLoad, pose: &Pose) -> Result<(f64, usize)> {
        let round = Round { h: None, feels_start: false };
        contacts.obstacles.iter_mut().for_each(Obstacle::arrive);
        contacts.came_at = None;
        read(&*self.motion, pose, &mut contacts.start);
        contacts.end.clone_from(&contacts.start);
        contacts.measure_start();
        contacts.begin(self.scale_of_contact(), round);
        contacts.expect(round);
        let mut iterations = 0;
        for _ in 0..STATIC_ROUNDS {
            let points = contacts.energy().map(|energy| InFrame { energy, pose: *pose });
            let found = self.settle_alone(load, pose, points.as_ref())?;
            drop(points);
            iterations += found.1;
            read(&*self.motion, pose, &mut contacts.end);
            if contacts.update(round) {
                contacts.accept(round);
                return Ok((found.0, iterations));
            }
        }
        let message = format!("no equilibrium: contacts are {:.1e} off after {STATIC_ROUNDS} rounds", contacts.left());
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// The contacts as a shell that goes on from here has to balance them; after the first time with those of where it came to (n_vertices,
    /// frame axes) besides. None where that adds nothing.
    pub(super) fn judging_points(&self, judges: &mut Option<Box<Contacts>>, came: Option<&[Vec3]>) -> Option<InFrame> {
        let pose = self.frame.pose;
        let Some(contacts) = judges else { return self.points_at(&pose).filter(|_| came.is_none()) };
        if let Some(came) = came {
            let world: Vec<Vec3> = came.iter().map(|x| pose.origin + pose.rotation * x).collect();
            if !contacts.add_within(&world) {
                return None;
            }
        }
        if contacts.touching().is_empty() {
            return None;
        }
        let mut x = vec![Vec3::zeros(); self.model.shell.mass.len()];
        read(&*self.motion, &pose, &mut x);
        Some(InFrame { energy: std::sync::Arc::new(contacts.judged(&x)), pose })
    }
}

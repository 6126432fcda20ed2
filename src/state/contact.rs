//! Steps and equilibria of a shell among solids: rounds of the method's own, as [`crate::contact`] has it.

use super::moving_rest::MovingRest;
use super::{Space, State, external};
use crate::contact::{
    CUTS, Contact, Contacts, Obstacle, ROUNDS, Round, STATIC_ROUNDS, Summary, depth, push_out, way_out,
};
use crate::features::{Contact as Built, Feature, Proof};
use crate::load::BodyLoad;
use crate::methods::plan::{Part, PartKind};
use crate::methods::{Acting, Motion, Watch};
use crate::point_energy::{InFrame, PointEnergy};
use crate::support::{Axes, FrameMotion, Passage, Pose};
use crate::warp::Placement;
use crate::{Error, ErrorKind, Result, Vec3};

/// Of a vertex that is placed, of a probe that is looked at in a round, and of a contact for each pair of unknowns.
const LOOK_VERTEX: f64 = 60.0;
const LOOK_PROBE: f64 = 20.0;
const PRESS: f64 = 2.0;
/// Solids of a state, at most.
pub const MOST_OBSTACLES: usize = 65_536;

/// Where the frame is at the end of a step, and how it gets there.
type Way<'a> = (&'a Pose, Option<Passage>);

fn placement(pose: &Pose) -> Placement {
    Placement { origin: pose.origin, rotation: Some(*pose.rotation.to_rotation_matrix().matrix()) }
}

/// Where vertices are shown: by the frame's pose, or on a rest shape that moves where the step or a part of it begins, or else ends.
type Shown<'a> = (Option<&'a mut MovingRest>, bool);

fn read(motion: &dyn Motion, shown: Shown, pose: &Pose, x: &mut [Vec3]) {
    if let (Some(rest), begins) = shown {
        return rest.read(motion, begins, x);
    }
    motion.positions(&placement(pose), &mut |first, rows| {
        x[first..].iter_mut().zip(rows).for_each(|(x, row)| *x = Vec3::from(*row));
    });
}

/// Reads the positions at the end of a round: those of vertices that may touch where that is known, else all.
fn read_round(
    motion: &mut dyn Motion,
    rest: Option<&mut MovingRest>,
    contacts: &mut Contacts,
    (from, pose): (&Pose, &Pose),
) {
    let stays = from == pose && rest.is_none();
    let change = |from: &[f64]| if stays { motion.largest_change(from) } else { f64::INFINITY };
    contacts.expect_way(change(&contacts.unknowns[0]));
    let listed = contacts.near.holds() && contacts.looks_near(change(contacts.near.at()));
    if !listed {
        if !contacts.has_whole_start() {
            motion.copy_unknowns(&mut contacts.came_to); // room
            motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
            read(motion, (None, true), from, &mut contacts.start);
            motion.set_unknowns([&contacts.came_to[0], &contacts.came_to[1]]);
        }
        if !contacts.has_whole_start() || !contacts.has_measured_start() {
            contacts.measure_start();
        }
        if contacts.way.is_finite() && contacts.near.may_pay() {
            contacts.survey();
            contacts.looks_near(contacts.way);
        }
    }
    if contacts.vertices_to_place().is_some() {
        let Contacts { near, end, .. } = contacts;
        let vertices = near.vertices().unwrap_or_default();
        let mut write = |i: usize, x: [f64; 3]| end[vertices[i] as usize] = Vec3::from(x);
        motion.positions_of(&placement(pose), vertices, &mut write);
    } else {
        read(motion, (rest, false), pose, &mut contacts.end);
    }
}

/// The contacts' energy as the method sees it.
fn seen(contacts: &Contacts, rest: Option<&mut MovingRest>, pose: &Pose) -> Option<InFrame> {
    let energy = contacts.energy()?;
    let each = rest.map(|rest| rest.axes_of(energy.points()));
    Some(InFrame { energy, pose: *pose, each })
}

/// Solids as points in the frame see them, for the eye.
pub struct Outside {
    solids: Vec<Obstacle>,
    pose: Pose,
}

impl Outside {
    /// Where a point of the frame goes that is inside, if it is, and how deep it still is there: 0 but between solids that leave no room.
    pub fn of(&self, x: &Vec3) -> Option<(Vec3, f64)> {
        let world = self.pose.place(x);
        let way = way_out(&self.solids, &world);
        let out = world + way;
        let back = || self.pose.rotation.inverse() * (out - self.pose.origin);
        (way != Vec3::zeros()).then(|| (back(), depth(&self.solids, &out)))
    }
}

impl State {
    /// The solids where they stand, to push points out of; none where there are none.
    pub fn outside(&self) -> Option<Outside> {
        // Where they are, not where they go in the next step.
        let solids: Vec<Obstacle> = self.obstacles().iter().map(Obstacle::now).collect();
        (!solids.is_empty()).then_some(Outside { solids, pose: self.frame.pose })
    }

    /// Replaces the solids that the shell touches; none for no contact. Those that are the same as before in their place go on being
    /// touched. Their poses are where they are now.
    pub fn set_obstacles(&mut self, obstacles: Vec<Obstacle>) -> Result<()> {
        let _proof: Built = Proof::of(Feature::Contact)?;
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
            self.motion.copy_unknowns(&mut contacts.unknowns);
            self.motion.copy_unknowns(&mut contacts.came_to);
            contacts.serve(self.motion.is_full_shell());
            contacts.parted.expect_constraints(self.motion.constraints().items().len());
            self.motion.expect_points(contacts.capacity());
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
        let Some(contacts) = self.contacts.as_mut().filter(|_| index < n) else {
            return Err(Error::argument(format!("collider {index} of {n}: there is none")));
        };
        let obstacle = &mut contacts.obstacles[index];
        let jump = jump || !obstacle.placed;
        let changed = obstacle.target != target || (jump && obstacle.pose != target);
        (obstacle.target, obstacle.placed) = (target, true);
        if jump && obstacle.pose != target {
            obstacle.pose = target;
            contacts.forget_of(index);
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

    /// Nothing touches and corrections begin anew: the shell is elsewhere.
    pub(super) fn forget_past(&mut self) {
        self.correction = None;
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
    pub(super) fn step_touching(&mut self, load: &BodyLoad, way: Way, h: f64) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else { return Ok(()) };
        let parts = contacts.parts();
        self.motion.share_work(true);
        let outcome = self.take_parts(&mut contacts, load, way, (h, parts));
        self.motion.share_work(false);
        self.contacts = Some(contacts);
        outcome
    }

    /// As [`State::step_touching`], with solids, frame and hard constraints led in as many parts; a part in which something comes through a
    /// solid is cut in two.
    fn take_parts(
        &mut self,
        contacts: &mut Contacts,
        load: &BodyLoad,
        (pose, mut passage): Way,
        (h, n): (f64, usize),
    ) -> Result<()> {
        let teleported = match &self.moving_rest {
            Some(rest) => rest.jumps(),
            None => self.frame.motion == FrameMotion::Teleport && self.frame.pose != *pose,
        };
        if teleported {
            contacts.forget(); // it did not come here along a way
        }
        let frame = if teleported || self.moving_rest.is_some() { *pose } else { self.frame.pose };
        let work = self.motion.constraints().work;
        let (all, mut part, mut done, mut begun) = (n * CUTS, CUTS, 0, false);
        let mut tries = CUTS;
        let (mut from, mut sum) = (frame, Summary::default());
        while done < all {
            if part < all && !begun {
                self.begin_parts(contacts, &frame);
                begun = true;
            }
            let share = (done + part) as f64 / all as f64;
            let to = if done + part == all { *pose } else { frame.toward(pose, share) };
            if begun {
                self.motion.change(|set| contacts.lead(share, set));
                if let Some(supports) = &mut self.supports {
                    supports.head(share);
                }
                self.lead_rest(done as f64 / all as f64, share);
            }
            let span = if part == all { h } else { h * part as f64 / all as f64 };
            match self.take_rounds(contacts, load, ((&from, &to), passage), (span, part > 1 && tries > 0)) {
                Ok(true) => {}
                Ok(false) => {
                    (part, tries) = (part / 2, tries - 1);
                    continue;
                }
                Err(error) => {
                    if begun {
                        self.motion.change(|set| (contacts.lead(1.0, set), set.work = work));
                        self.motion.set_unknowns(contacts.part_in_vain());
                    }
                    return Err(error);
                }
            }
            if part == 1 && contacts.has_passed() {
                tries = 0; // shorter parts do not help
            }
            sum.impulse += contacts.summary.impulse;
            sum.count = sum.count.max(contacts.summary.count);
            sum.passed += contacts.summary.passed;
            sum.parts += 1;
            if begun {
                contacts.count(part as f64 / all as f64, self.motion.constraints());
            }
            (from, done) = (to, done + part);
            passage = passage.map(|passage| Passage { from, before: passage.now, ..passage });
            while part < CUTS && done % (2 * part) == 0 {
                part *= 2;
            }
        }
        if begun {
            self.motion.change(|set| set.report_forces(contacts.mean_forces()));
            contacts.parted.end();
        }
        contacts.summary = Summary { deepest: contacts.summary.deepest, ..sum };
        Ok(())
    }

    /// Notes where a step in parts begins.
    fn begin_parts(&mut self, contacts: &mut Contacts, frame: &Pose) {
        self.motion.copy_unknowns(&mut contacts.unknowns);
        let elsewhere = contacts.came_at.is_none_or(|at| at != *frame) || contacts.came_to != contacts.unknowns;
        if elsewhere || !contacts.has_whole_end() {
            read(&*self.motion, (self.moving_rest.as_deref_mut(), true), frame, &mut contacts.end);
            contacts.came_at = None;
        }
        contacts.part(self.motion.constraints());
    }

    /// A step or a part of one. Where something came through a solid and it may be cut, nothing has happened, and it returns false.
    fn take_rounds(
        &mut self,
        contacts: &mut Contacts,
        load: &BodyLoad,
        ((from, pose), passage): ((&Pose, &Pose), Option<Passage>),
        (h, may_cut): (f64, bool),
    ) -> Result<bool> {
        let scale = self.scale_of_contact();
        let Self { model, motion, loads, scratch, supports, moving_rest, .. } = self;
        let mut rest = moving_rest.as_deref_mut();
        let supports = supports.as_ref().map(|supports| supports.targets());
        let round = Round { h: Some(h), feels_start: motion.feels_start() };
        motion.copy_unknowns(&mut contacts.unknowns);
        let work = motion.constraints().work;
        if !contacts.goes_on(from) {
            read(&**motion, (rest.as_deref_mut(), true), from, &mut contacts.start);
            contacts.measure_start();
        }
        contacts.begin(scale, round);
        if round.feels_start {
            contacts.way = 0.0;
            contacts.end.clone_from(&contacts.start);
            contacts.update(round);
        }
        for turn in 0..ROUNDS {
            if turn > 0 {
                motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
                motion.change(|set| set.work = work);
            }
            let points = seen(contacts, rest.as_deref_mut(), pose);
            let axes = Axes { frame: pose, each: rest.as_deref().map(|rest| rest.axes()) };
            let external = external(loads, scratch, model, &axes);
            let again = turn > 0;
            let acting = Acting { load, external, points: points.as_ref(), supports, axes, passage, again };
            let step = motion.step(&acting, h);
            drop(points);
            if let Err(error) = step {
                motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
                motion.change(|set| set.work = work);
                contacts.undo();
                return Err(error);
            }
            read_round(&mut **motion, rest.as_deref_mut(), contacts, (from, pose));
            if contacts.update(round) || round.feels_start {
                break;
            }
        }
        if may_cut && contacts.has_passed() && !round.feels_start {
            motion.set_unknowns([&contacts.unknowns[0], &contacts.unknowns[1]]);
            motion.change(|set| set.work = work);
            contacts.undo();
            return Ok(false);
        }
        contacts.accept(round);
        if !contacts.serves_all() {
            motion.copy_unknowns(&mut contacts.came_to);
            contacts.came_at = Some(*pose);
        }
        Ok(true)
    }

    /// The motion's equilibrium among the solids where they are to be, without friction.
    pub(super) fn settle_touching(&mut self, load: &BodyLoad, pose: &Pose, watch: &mut Watch) -> Result<(f64, usize)> {
        let Some(mut contacts) = self.contacts.take() else { return self.settle_alone(load, pose, None, watch) };
        let outcome = self.settle_rounds(&mut contacts, (load, pose), watch);
        self.contacts = Some(contacts);
        outcome
    }

    fn settle_rounds(
        &mut self,
        contacts: &mut Contacts,
        (load, pose): (&BodyLoad, &Pose),
        watch: &mut Watch,
    ) -> Result<(f64, usize)> {
        let round = Round { h: None, feels_start: false };
        contacts.obstacles.iter_mut().for_each(Obstacle::arrive);
        contacts.came_at = None;
        contacts.near.forget();
        contacts.way = f64::INFINITY;
        read(&*self.motion, (self.moving_rest.as_deref_mut(), false), pose, &mut contacts.start);
        contacts.end.clone_from(&contacts.start);
        contacts.measure_start();
        contacts.begin(self.scale_of_contact(), round);
        contacts.expect(round);
        let mut iterations = 0;
        for _ in 0..STATIC_ROUNDS {
            let points = seen(contacts, self.moving_rest.as_deref_mut(), pose);
            let found = self.settle_alone(load, pose, points.as_ref(), watch)?;
            drop(points);
            iterations += found.1;
            read(&*self.motion, (self.moving_rest.as_deref_mut(), false), pose, &mut contacts.end);
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
        read(&*self.motion, (None, false), &pose, &mut x);
        Some(InFrame::new(std::sync::Arc::new(contacts.judged(&x)), pose))
    }
}

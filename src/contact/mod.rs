//! Contact of a shell with solids that move as they are told: one-sided, with Coulomb friction.
//!
//! Points of the shell, its probes, stay out of a solid at their gap g and with the force λ along the solid's normal:
//!
//!   g ≥ 0,   λ ≥ 0,   λ g = 0;   |f| ≤ μλ across it, and against the slip where it slips.
//!
//! A step is taken in rounds. In each, every contact is a half-space with the energy ([`energy::Pressed`])
//!
//!   max(0, λ + k d)²/2k,   d = −g to first order,
//!
//! which joins the method's own. Then λ becomes max(0, λ + k d), and half-spaces are taken anew where the probes came to: the augmented
//! Lagrangian method (Hestenes, Powell 1969). k decides how many rounds it takes, not where they end. Contacts keep λ from step to step.

mod caps;
mod energy;
mod judged;
mod near;
mod obstacle;
mod parted;
mod patches;
mod probes;
mod push_out;
mod saved;
mod search;

pub use energy::{Pressed, Touching};
pub use judged::Judged;
pub use near::Near;
pub use obstacle::{Around, Obstacle};
pub use parted::Parted;
pub use patches::patches_near;
pub use probes::{Probes, Reach};
pub use push_out::{depth, push_out, way_out};
pub use saved::{CONTACT_DOUBLES, OBSTACLE_DOUBLES};

use crate::support::Pose;
use crate::{Shell, Vec3};
use std::sync::Arc;

/// Rounds of a step, at most.
pub const ROUNDS: usize = 12;
/// The same of an equilibrium.
pub const STATIC_ROUNDS: usize = 60;
/// Rounds end where every gap of a contact with a force, and every penetration, is within this part of the shell's size.
pub const MET: f64 = 2e-5;
/// k, in masses of the shell over the square of the step.
const HARDNESS: f64 = 100.0;
/// Where a round of an equilibrium leaves more than this part of what the last one left, k grows by the second number, in all by the third.
const SLOW: f64 = 0.25;
const HARDER: f64 = 10.0;
const HARDEST: f64 = 1e5;
/// Of masses over the square of the step, k of a probe whose force is that of where the step starts: four times this is unstable.
const HARDNESS_AT_START: f64 = 0.25;
/// A probe that is within a solid when a step starts comes out by no more than so many sizes a second.
const WAY_OUT: f64 = 1.0;
/// Those of an equilibrium while a normal turns by more than this, rad.
const TURNED: f64 = 1e-4;
/// Rounds that leave more than this part of what was left before gain nothing; after the second number of them there is no other.
const STUCK: f64 = 0.8;
const PATIENCE: usize = 4;
/// Rounds also go on while friction is of other normal forces than there are, by more than this part of all of them.
const FRICTION_MET: f64 = 0.02;
/// A round of a step ends where the next step of its search would gain less than this part of the contacts' energy: forces are then good to its
/// root, which that step squares.
const PRECISION: f64 = 1e-4;
/// λ/k in a step is at most what the first round leaves to be closed, or this part of the shell's size: what few modes cannot follow is not
/// forced.
const FURTHEST: f64 = 0.01;
/// A penetration of so many times what rounds should leave cannot be closed.
const LOST: f64 = 500.0;
/// Of the shell's size, how far a solid goes in a part of a step, but for the most parts.
const PART: f64 = 0.1;
const PARTS: usize = 16;
/// Into so many a part is cut at most, while probes come through a solid in it; and as often in a step.
pub const CUTS: usize = 8;
/// Solids that patches have room to find contacts with in one round.
const MANY: usize = 8;
/// Contacts of a method with few unknowns, at most.
const CAPACITY: usize = 256;

/// What touched in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Contacts with a force.
    pub count: usize,
    /// Of any probe, by how far it is within a solid's surface and its thickness; 0 of none.
    pub deepest: f64,
    /// Of the solids on the shell over the step (world space).
    pub impulse: Vec3,
    /// Probes that came through a solid in it.
    pub passed: usize,
    /// The parts that it was taken in.
    pub parts: usize,
}

/// One contact, as it is shown.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Corners of the probe's triangle or edge, or one vertex.
    pub vertices: [u32; 3],
    /// Of each corner; they sum to 1.
    pub weights: [f64; 3],
    /// Which of the solids.
    pub obstacle: u32,
    /// Where the probe is, world space.
    pub point: Vec3,
    /// Of the solid, outward.
    pub normal: Vec3,
    /// Between the probe and the surface with its thickness; negative inside.
    pub gap: f64,
    /// On the shell, friction included.
    pub force: Vec3,
}

/// When and how a round is taken.
#[derive(Clone, Copy)]
pub struct Round {
    /// Seconds of the step; none at an equilibrium, which has no friction.
    pub h: Option<f64>,
    /// A force is that of where the step starts.
    pub feels_start: bool,
}

/// Of the smallest solid, how far probes may be apart.
fn spacing(obstacles: &[Obstacle]) -> f64 {
    obstacles.iter().map(|o| o.solid.inner_radius() + o.thickness).fold(f64::INFINITY, f64::min)
}

/// The solids around a shell and what touches them.
#[derive(Clone)]
pub struct Contacts {
    /// The solids.
    pub obstacles: Vec<Obstacle>,
    probes: Arc<Probes>,
    /// The contacts' energy; a solver may hold on to the last one.
    pressed: Arc<Pressed>,
    /// Contacts when the step began.
    before: Vec<Touching>,
    /// Found in a round.
    found: Vec<Touching>,
    /// Largest k that rounds of this step have come to, and what the last one left.
    stiffness: f64,
    hardest: f64,
    left: f64,
    /// λ of a step, at most.
    strongest: f64,
    rounds: usize,
    stuck: usize,
    /// Positions of all vertices when the step began (world space).
    pub start: Vec<Vec3>,
    /// The same at its end.
    pub end: Vec<Vec3>,
    /// Of the probes.
    starts: Vec<Reach>,
    ends: Vec<Reach>,
    /// What may touch, where it is known without a look at all.
    pub near: Near,
    /// Whether the start and end positions are of all vertices, not of those alone that are near, and those of the patches were measured.
    whole: [bool; 2],
    measured: [bool; 2],
    /// No vertex went farther in the round; infinite where that is not known.
    pub way: f64,
    /// Unknowns and rates when the step began.
    pub unknowns: [Vec<f64>; 2],
    /// Unknowns and rates where the last step ended.
    pub came_to: [Vec<f64>; 2],
    /// The frame then, where the end positions are those of that step.
    pub came_at: Option<Pose>,
    /// What touched in the last step.
    pub summary: Summary,
    /// Room for a step that is taken in parts.
    pub parted: Parted,
    /// Every probe may touch at once, else one of a patch in each round.
    all: bool,
}

impl Contacts {
    /// Of a shell and solids that stand still. `all`: the method has an unknown for each vertex.
    pub fn new(shell: &Shell, obstacles: Vec<Obstacle>, all: bool) -> Self {
        let probes = Arc::new(Probes::new(shell, spacing(&obstacles)));
        let n = shell.mass.len();
        let reach = vec![Reach::default(); probes.patches()];
        let mut new = Self {
            obstacles,
            pressed: Arc::default(),
            before: vec![],
            found: vec![],
            stiffness: 0.0,
            hardest: 0.0,
            strongest: f64::INFINITY,
            left: f64::INFINITY,
            rounds: 0,
            stuck: 0,
            start: vec![Vec3::zeros(); n],
            end: vec![Vec3::zeros(); n],
            starts: reach.clone(),
            ends: reach,
            near: Near::default(),
            whole: [true; 2],
            measured: [false; 2],
            way: f64::INFINITY,
            unknowns: [vec![], vec![]],
            came_to: [vec![], vec![]],
            came_at: None,
            summary: Summary::default(),
            parted: Parted::default(),
            probes,
            all,
        };
        new.serve(all);
        new
    }

    /// Most contacts of a method with few unknowns.
    pub fn capacity(&self) -> usize {
        if self.all { self.probes.points.len() } else { CAPACITY }
    }

    /// Contacts now.
    pub fn touching(&self) -> &[Touching] {
        &self.pressed.list
    }

    /// The energy of the contacts; none where nothing touches.
    pub fn energy(&self) -> Option<Arc<Pressed>> {
        (!self.pressed.list.is_empty()).then(|| self.pressed.clone())
    }

    /// Nothing touches.
    pub fn forget(&mut self) {
        Arc::make_mut(&mut self.pressed).clear();
        self.summary = Summary::default();
        self.came_at = None;
    }

    /// Multiplies all forces by `factor`, as the shell's stiffness changes. What a step begins with is read anew.
    pub fn scale_forces(&mut self, factor: f64) {
        for touch in &mut Arc::make_mut(&mut self.pressed).list {
            for force in [&mut touch.force, &mut touch.carried, &mut touch.stiffness, &mut touch.cap] {
                *force *= factor;
            }
            touch.pull *= factor;
        }
        self.came_at = None;
    }

    /// Nothing touches one solid, which is elsewhere at once.
    pub fn forget_of(&mut self, obstacle: usize) {
        self.near.forget();
        Arc::make_mut(&mut self.pressed).keep(|touch| touch.obstacle as usize != obstacle);
    }

    /// Replaces the solids of a shell: contacts with those that stay in their place go on, unless the probes lie too far apart for the new.
    pub fn replace(&mut self, shell: &Shell, mut obstacles: Vec<Obstacle>) {
        if self.probes.spacing != spacing(&obstacles) {
            *self = Self::new(shell, obstacles, self.all);
            return;
        }
        for (new, old) in obstacles.iter_mut().zip(&self.obstacles).filter(|(a, b)| Arc::ptr_eq(&a.solid, &b.solid)) {
            (new.pose, new.target, new.placed) = (old.pose, old.target, old.placed);
        }
        let same = |touch: &Touching| {
            let at = touch.obstacle as usize;
            obstacles.get(at).is_some_and(|new| Arc::ptr_eq(&new.solid, &self.obstacles[at].solid))
        };
        Arc::make_mut(&mut self.pressed).keep(same);
        self.obstacles = obstacles;
    }

    /// Whether a step from `unknowns` in this frame begins where the last one ended; then the start positions are set.
    pub fn goes_on(&mut self, from: &Pose) -> bool {
        let goes_on = self.came_at.take().is_some_and(|at| at == *from) && self.came_to == self.unknowns;
        if goes_on {
            std::mem::swap(&mut self.start, &mut self.end);
            std::mem::swap(&mut self.starts, &mut self.ends);
            self.whole.swap(0, 1);
            self.measured.swap(0, 1);
        } else {
            self.near.forget();
        }
        goes_on
    }

    /// Measures the patches at the start positions, which are of all vertices.
    pub fn measure_start(&mut self) {
        (self.whole[0], self.measured[0]) = (true, true);
        self.probes.measure(&self.start, &mut self.starts);
    }

    /// Whether the start positions are of all vertices.
    pub fn has_whole_start(&self) -> bool {
        self.whole[0]
    }

    /// Whether the patches are measured there.
    pub fn has_measured_start(&self) -> bool {
        self.measured[0]
    }

    /// Whether the end positions are.
    pub fn has_whole_end(&self) -> bool {
        self.whole[1]
    }

    /// Notes that no vertex goes farther in the round than `way`.
    pub fn expect_way(&mut self, way: f64) {
        self.way = way + near::ROUNDING * self.probes.size;
    }

    /// Whether this round, which ends with vertices no farther than `change` from where lists were made, looks at what is near alone.
    pub fn looks_near(&mut self, change: f64) -> bool {
        let led = self.obstacles.iter().map(Obstacle::longest_way).fold(0.0, f64::max);
        self.near.keeps(change, (self.way, led), self.probes.size)
    }

    /// The vertices whose positions this round needs; none where it needs all.
    pub fn vertices_to_place(&mut self) -> Option<&[u32]> {
        let some = if self.near.holds() { self.near.vertices() } else { None };
        self.whole[1] = some.is_none();
        some
    }

    /// Lists what is near for the next rounds, with all start positions set and measured.
    pub fn survey(&mut self) {
        let Self { near, probes, starts, start, obstacles, pressed, unknowns, way, .. } = self;
        let led = obstacles.iter().map(Obstacle::longest_way).fold(0.0, f64::max);
        let touching = pressed.list.iter().map(|touch| touch.probe);
        near.survey((probes, starts, start), obstacles, touching, (&unknowns[0], *way + led));
    }

    /// Whether the method has an unknown for each vertex.
    pub fn serves_all(&self) -> bool {
        self.all
    }

    /// Begins a step or an equilibrium of a shell of this mass and slowest eigenvalue, with the start positions set.
    pub fn begin(&mut self, shell: (f64, f64), round: Round) {
        self.before.clone_from(&self.pressed.list);
        (self.left, self.rounds, self.stuck) = (f64::INFINITY, 0, 0);
        Arc::make_mut(&mut self.pressed).nearly_met = false;
        let (mass, eigenvalue) = shell;
        self.stiffness = HARDNESS * mass * (round.h.map_or(0.0, |h| (h * h).recip()) + eigenvalue);
        self.hardest = HARDEST * self.stiffness;
        self.strongest = f64::INFINITY;
        let Self { obstacles, probes, pressed, start, .. } = self;
        for touch in &mut Arc::make_mut(pressed).list {
            let obstacle = &obstacles[touch.obstacle as usize];
            let place = probes.points[touch.probe as usize].place(|v| start[v]);
            touch.anchor = obstacle.carried(&touch.anchor);
            touch.begin(obstacle, &obstacle.at_start(&place), probes.size, round);
        }
        self.meet(round);
    }

    /// Goes on with the method that this is for: `all` as in [`Contacts::new`].
    pub fn serve(&mut self, all: bool) {
        self.all = all;
        let room = self.capacity();
        self.before.reserve(room);
        self.found.reserve(if all { 0 } else { self.probes.patches() * self.obstacles.len().min(MANY) });
        Arc::make_mut(&mut self.pressed).reserve(room);
        self.parted.reserve(room, self.obstacles.len());
        if !all {
            self.near.reserve(&self.probes, self.start.len(), self.obstacles.len(), &self.unknowns[0]);
        }
    }

    /// Into how many parts a step is to be cut, so that no solid goes further in one than this part of the shell's size.
    pub fn parts(&self) -> usize {
        let reach = |o: &Obstacle| o.solid.bounds().map_or(0.0, |ball| ball.center.norm() + ball.radius);
        let longest = self.obstacles.iter().map(|o| o.way(reach(o))).fold(0.0, f64::max);
        (longest / (PART * self.probes.size)).ceil().clamp(1.0, PARTS as f64) as usize
    }

    /// Puts back what was there when the step began.
    pub fn undo(&mut self) {
        let Self { pressed, before, probes, .. } = self;
        Arc::make_mut(pressed).take(before, probes);
    }

    /// After a round, with the end positions set: forces, new contacts and half-spaces where the probes are now. Returns whether more rounds
    /// would change little.
    pub fn update(&mut self, round: Round) -> bool {
        self.measure_end();
        self.summary.passed = 0;
        let (mut left, settled) = self.press(round);
        left = left.max(self.find(round));
        if round.h.is_some() && self.rounds == 0 {
            self.strongest = self.stiffness * left.max(FURTHEST * self.probes.size);
        }
        if round.h.is_none() && left > SLOW * self.left {
            self.stiffness = (HARDER * self.stiffness).min(self.hardest);
        }
        self.stuck += usize::from(round.h.is_some() && left > STUCK * self.left);
        self.left = left;
        self.rounds += 1;
        let nearly_met = left <= MET * self.probes.size && self.found.is_empty();
        let pressed = Arc::make_mut(&mut self.pressed);
        pressed.nearly_met = nearly_met;
        pressed.add(&self.found, &self.probes);
        self.meet(round);
        (left <= MET * self.probes.size && settled) || self.stuck >= PATIENCE
    }

    fn measure_end(&mut self) {
        let Self { near, probes, end, starts, ends, measured, .. } = self;
        measured[1] = !near.holds();
        if measured[1] {
            (0..probes.patches()).for_each(|patch| ends[patch] = probes.reach_after(patch, end, &starts[patch]));
        }
    }

    /// Whether a probe came through a solid in the last round.
    pub fn has_passed(&self) -> bool {
        self.summary.passed > 0
    }

    /// What the last round left, in lengths: of what touches its gap, of the others how deep they are.
    pub fn left(&self) -> f64 {
        self.left
    }

    /// Readies the contacts for the next round.
    fn meet(&mut self, round: Round) {
        let Self { obstacles, pressed, stiffness, .. } = self;
        let pressed = Arc::make_mut(pressed);
        for touch in &mut pressed.list {
            touch.meet(&obstacles[touch.obstacle as usize], *stiffness, round);
        }
        let still = pressed.list.iter().all(|touch| touch.allowed == 0.0);
        pressed.passive = still && !obstacles.iter().any(Obstacle::moves);
        pressed.precision = if round.h.is_some() { PRECISION } else { 0.0 };
        if round.h.is_some() && !round.feels_start {
            pressed.teach();
        }
    }

    /// Takes the forces of the round that ended, and half-spaces anew. Returns what is left, and whether friction was that
    /// of these forces and normals stand.
    fn press(&mut self, round: Round) -> (f64, bool) {
        let Self { obstacles, probes, pressed, start, end, strongest, summary, .. } = self;
        let (mut left, mut missed, mut rubbing, mut turned) = (0.0f64, 0.0, 0.0, false);
        let pressed = Arc::make_mut(pressed);
        pressed.take_caps();
        for touch in &mut pressed.list {
            let obstacle = &obstacles[touch.obstacle as usize];
            let point = &probes.points[touch.probe as usize];
            let (from, to) = (point.place(|v| start[v]), point.place(|v| end[v]));
            touch.settle(&to, *strongest);
            if round.h.is_some() {
                let friction = obstacle.friction * touch.force;
                rubbing += friction;
                missed += (friction - touch.cap).abs();
            }
            let before = touch.normal;
            let gap = touch.plane(obstacle, (&from, &to), probes.size, round);
            turned |= round.h.is_none() && touch.force > 0.0 && (touch.normal - before).norm() > TURNED;
            summary.passed += usize::from(touch.passed);
            left = left.max(if touch.force > 0.0 { gap.abs() } else { -gap });
        }
        (left, missed <= FRICTION_MET * rubbing && !turned)
    }

    /// The step has ended: contacts without a force are forgotten, the others keep where they stick; the solids are where they were to be.
    pub fn accept(&mut self, round: Round) {
        let Self { obstacles, probes, pressed, end, summary, left, .. } = self;
        let pressed = Arc::make_mut(pressed);
        let mut impulse = Vec3::zeros();
        let lost = *left > LOST * MET * probes.size;
        for touch in &mut pressed.list {
            let place = probes.points[touch.probe as usize].place(|v| end[v]);
            touch.stick(&obstacles[touch.obstacle as usize], &place, probes.size);
            impulse += touch.pull * round.h.unwrap_or(0.0);
            if lost && touch.gap < -LOST * MET * probes.size {
                touch.force = f64::MIN_POSITIVE; // it grows without end: not carried on
            } else if touch.force == 0.0 && touch.gap < 0.0 && (touch.passed || touch.caught) {
                touch.force = f64::MIN_POSITIVE; // it is to come back
            }
        }
        pressed.keep(|touch| touch.force > 0.0);
        summary.count = pressed.list.iter().filter(|touch| touch.force > 0.0).count();
        summary.impulse = impulse;
        obstacles.iter_mut().for_each(Obstacle::arrive);
        self.near.accept();
    }

    /// The contacts of a shell at these positions, for one that goes on from there.
    pub fn judged(&mut self, x: &[Vec3]) -> Judged {
        self.start.copy_from_slice(x);
        Judged::new(self.pressed.as_pressed(x), self.obstacles.clone(), self.probes.size)
    }

    /// Adds the probes that would be within a solid with the vertices at `x`, or have come through one; whether there are any.
    pub fn add_within(&mut self, x: &[Vec3]) -> bool {
        self.end.copy_from_slice(x);
        (self.all, self.came_at) = (true, None);
        self.near.forget();
        self.way = f64::INFINITY;
        self.probes.measure(&self.start, &mut self.starts);
        self.measure_end();
        self.find(Round { h: None, feels_start: false });
        let size = self.probes.size;
        self.found.retain(|touch| touch.gap < -MET * size);
        let stiffness = self.pressed.list.iter().map(|touch| touch.stiffness).fold(self.stiffness, f64::max);
        self.found.iter_mut().for_each(|touch| touch.stiffness = stiffness);
        Arc::make_mut(&mut self.pressed).add(&self.found, &self.probes);
        !self.found.is_empty()
    }

    /// Where the shell touches, with the end positions set.
    pub fn shown(&self) -> impl Iterator<Item = Contact> {
        self.pressed.list.iter().filter(|touch| touch.force > 0.0).map(|touch| {
            let point = &self.probes.points[touch.probe as usize];
            let (mut vertices, mut weights) = ([point.vertices()[0]; 3], [0.0; 3]);
            vertices.iter_mut().zip(point.vertices()).for_each(|(to, from)| *to = *from);
            weights.iter_mut().zip(point.weights()).for_each(|(to, from)| *to = *from);
            Contact {
                vertices,
                weights,
                obstacle: touch.obstacle,
                point: point.place(|v| self.end[v]),
                normal: touch.normal,
                gap: touch.gap,
                force: touch.pull,
            }
        })
    }

    /// Probes, and the rounds of the last step.
    pub fn work(&self) -> [usize; 2] {
        [self.probes.points.len(), self.rounds]
    }

    /// Memory that it takes beside the solids.
    pub fn bytes(&self) -> usize {
        let lists = self.pressed.list.capacity() + self.before.capacity() + self.found.capacity();
        lists * size_of::<Touching>()
            + 2 * (self.start.len() * size_of::<Vec3>() + self.starts.len() * size_of::<Reach>())
            + self.probes.bytes()
            + self.near.bytes()
    }
}

//! Handles on the nonlinear shell, as terms of its potential: hard positions are prescribed, all else is an energy.
//!
//! A hard position takes its directions out of the unknowns: with the projector P onto what is left of a vertex, the gradient
//! is Pg and the Hessian PHP + k(1 − P), and the force of the handle is (1 − P)g. A soft one is a spring ½|d − x|²/γ.
//!
//! An orientation is a condition m = γT on the rotation vector m from the present orientation to the target, along each held
//! axis, met by the method of multipliers: the energy ½k(m + T/ρ)², k = 1/(γ + 1/ρ), is minimized and T ← k(m + T/ρ). Any ρ
//! will do; a large one needs fewer rounds.

mod explicit;

use super::free_motion::Held;
use super::orientation::{Ring, missing_turn, part_way};
use crate::energy::Curvature;
use crate::mesh::NONE;
use crate::sparse::BlockMatrix;
use crate::{Shell, Vec3};
use nalgebra::{Matrix3, UnitQuaternion};

/// Where a handle wants its vertex.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// There, in the axes of the rest positions.
    Position(Vec3),
    /// So turned from rest.
    Orientation(UnitQuaternion<f64>),
}

/// One handle.
#[derive(Clone, Copy, Debug)]
pub struct Handle {
    /// Vertex held.
    pub vertex: u32,
    /// Which of the handles' axes it holds along, or about.
    pub held: [bool; 3],
    /// Displacement per force, or rotation per torque; 0 = hard.
    pub compliance: f64,
    /// Where to.
    pub goal: Goal,
}

/// What became of a handle, in the handles' axes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grip {
    /// From where it is to the goal: length or rad; zero along axes not held.
    pub missing: Vec3,
    /// Force or torque on the shell.
    pub force: Vec3,
}

/// A spring stiffer than this many times its vertex is hard: it gives way by less than a millionth of what the shell does.
const HARD: f64 = 1e6;

/// ρ over the stiffness of the vertices around: each round leaves about this part of m.
const PENALTY: f64 = 1e3;

/// Step of differences, in edges: their truncation is its square, their rounding 1e-16 over it.
const DIFFERENCE: f64 = 1e-5;

/// As much stiffer than their vertices are the springs that pull the shell to where hard positions and orientations then take over.
const PULL: f64 = 10.0;

struct Hold {
    vertex: u32,
    held: [bool; 3],
    /// P.
    free: Matrix3<f64>,
    /// Mean of the goals, and where the vertex was at the start.
    place: Vec3,
    start: Vec3,
    stiffness: f64,
}

struct Spring {
    vertex: u32,
    /// Σ d dᵀ/γ.
    stiffness: Matrix3<f64>,
    place: Vec3,
    start: Vec3,
}

struct Turn {
    ring: Ring,
    held: [bool; 3],
    compliance: f64,
    /// Stiffness of the vertices around, as a rotation feels it.
    resists: f64,
    /// T along each of the handles' axes.
    torque: Vec3,
    goal: UnitQuaternion<f64>,
    start: UnitQuaternion<f64>,
}

/// How a handle acts.
#[derive(Clone, Copy)]
enum Part {
    Hold(usize),
    Spring(usize),
    Turn(usize),
    /// Supports hold all that it could move.
    Idle,
}

/// All handles on a shell.
pub struct Handles {
    /// Columns: the axes that handles hold along, in those of the rest positions.
    axes: Matrix3<f64>,
    list: Vec<Handle>,
    parts: Vec<Part>,
    holds: Vec<Hold>,
    springs: Vec<Spring>,
    turns: Vec<Turn>,
    /// Hold of each vertex, or [`NONE`] (n_vertices, or nothing without handles).
    hold_at: Vec<u32>,
    /// Not held by supports, and with mass (n_vertices, or nothing without handles).
    moves: Vec<bool>,
    /// How much of the way from the start to the goals is asked for.
    share: f64,
    /// Hard positions are springs for now.
    pulling: bool,
}

impl Handles {
    /// No handles.
    pub fn none() -> Self {
        Self {
            axes: Matrix3::identity(),
            list: vec![],
            parts: vec![],
            holds: vec![],
            springs: vec![],
            turns: vec![],
            hold_at: vec![],
            moves: vec![],
            share: 1.0,
            pulling: false,
        }
    }

    /// `list` along `axes` on a shell that starts at positions `x`.
    pub fn new(shell: &Shell, axes: Matrix3<f64>, list: Vec<Handle>, x: &[Vec3]) -> Self {
        if list.is_empty() {
            return Self::none();
        }
        let stiffness = vertex_stiffness(shell);
        let hold_at = vec![NONE; x.len()];
        let mut moves = vec![false; x.len()];
        shell.free.iter().for_each(|v| moves[*v as usize] = true);
        let mut handles = Self { axes, hold_at, moves, ..Self::none() };
        for handle in &list {
            let part = match handle.goal {
                Goal::Position(_) if !handles.moves[handle.vertex as usize] => Part::Idle,
                Goal::Position(place) => handles.add_position(handle, place, &stiffness, x),
                Goal::Orientation(goal) => {
                    let ring = Ring::of(&shell.mesh, handle.vertex);
                    let idle = !ring.vertices.iter().any(|v| handles.moves[*v as usize]);
                    if idle { Part::Idle } else { handles.add_turn(handle, goal, ring, (shell, &stiffness), x) }
                }
            };
            handles.parts.push(part);
        }
        handles.list = list;
        handles.average_holds();
        handles
    }

    fn add_position(&mut self, handle: &Handle, place: Vec3, stiffness: &[f64], x: &[Vec3]) -> Part {
        let v = handle.vertex as usize;
        if handle.compliance * HARD * stiffness[v] > 1.0 {
            let along = (0..3).filter(|a| handle.held[*a]).map(|a| self.axes.column(a).into_owned());
            let sum: Matrix3<f64> = along.map(|d| d * d.transpose() / handle.compliance).sum();
            self.springs.push(Spring { vertex: handle.vertex, stiffness: sum, place, start: x[v] });
            return Part::Spring(self.springs.len() - 1);
        }
        if self.hold_at[v] == NONE {
            self.hold_at[v] = self.holds.len() as u32;
            let (free, stiffness) = (Matrix3::identity(), stiffness[v]);
            let [place, start] = [x[v]; 2];
            self.holds.push(Hold { vertex: handle.vertex, held: [false; 3], free, place, start, stiffness });
        }
        Part::Hold(self.hold_at[v] as usize)
    }

    fn add_turn(
        &mut self,
        handle: &Handle,
        goal: UnitQuaternion<f64>,
        ring: Ring,
        (shell, stiffness): (&Shell, &[f64]),
        x: &[Vec3],
    ) -> Part {
        let turns = ring.turn(&ring.gather(&shell.mesh.positions)).1;
        let (mut resists, mut turned) = (0.0, 0.0);
        for (v, turn) in ring.vertices.iter().zip(&turns) {
            resists += stiffness[*v as usize];
            turned += turn.norm_squared();
        }
        let resists = resists / turned.max(f64::MIN_POSITIVE);
        let start = ring.rotation(&ring.gather(x));
        let Handle { held, compliance, .. } = *handle;
        self.turns.push(Turn { ring, held, compliance, resists, torque: Vec3::zeros(), goal, start });
        Part::Turn(self.turns.len() - 1)
    }

    /// The same from positions `x`, without pins; orientations keep their torques.
    pub fn renew(&mut self, shell: &Shell, x: &[Vec3]) {
        let torques = self.torques();
        *self = Self::new(shell, self.axes, std::mem::take(&mut self.list), x);
        self.set_torques(torques);
    }

    /// What they hold of vertices, softly or not.
    pub fn held(&self) -> impl Iterator<Item = (u32, Held)> + '_ {
        let acting = self.list.iter().zip(&self.parts).filter(|(_, part)| !matches!(part, Part::Idle));
        acting.flat_map(|(handle, _)| {
            let along = |a: usize| -> Vec3 { self.axes.column(a).into() };
            (0..3).filter(|a| handle.held[*a]).map(move |a| match handle.goal {
                Goal::Position(_) => (handle.vertex, Held::Along(along(a))),
                Goal::Orientation(_) => (handle.vertex, Held::About(along(a))),
            })
        })
    }

    /// Holds vertices of the shell at `x` along unit directions besides, until the next handles.
    pub fn pin(&mut self, pins: &[(u32, Vec3)], x: &[Vec3]) {
        self.hold_at.resize(x.len(), NONE);
        for &(vertex, direction) in pins {
            let at = &mut self.hold_at[vertex as usize];
            if *at == NONE {
                *at = self.holds.len() as u32;
                let [place, start] = [x[vertex as usize]; 2];
                let (held, free) = ([false; 3], Matrix3::identity());
                self.holds.push(Hold { vertex, held, free, place, start, stiffness: 1.0 });
            }
            let hold = &mut self.holds[*at as usize];
            let left = hold.free * direction; // of what is held along already, nothing
            if let Some(n) = left.try_normalize(1e-6) {
                hold.free -= n * n.transpose();
            }
        }
    }

    /// Several handles on one axis of a vertex: the mean, which is the nearest to all.
    fn average_holds(&mut self) {
        for (h, hold) in self.holds.iter_mut().enumerate() {
            let mut place = self.axes.tr_mul(&hold.place);
            for axis in 0..3 {
                let goals = self.list.iter().zip(&self.parts).filter_map(|(handle, part)| match (part, handle.goal) {
                    (Part::Hold(at), Goal::Position(goal)) if *at == h && handle.held[axis] => Some(goal),
                    _ => None,
                });
                let (count, sum) =
                    goals.fold((0.0, 0.0), |(count, sum), goal| (count + 1.0, sum + self.axes.column(axis).dot(&goal)));
                if count > 0.0 {
                    (hold.held[axis], place[axis]) = (true, sum / count);
                    hold.free -= self.axes.column(axis) * self.axes.column(axis).transpose();
                }
            }
            hold.place = self.axes * place;
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Vertices that they hold.
    pub fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.list.iter().map(|handle| handle.vertex)
    }

    /// Vertices that an orientation couples.
    pub fn cliques(&self) -> Vec<&[u32]> {
        self.turns.iter().map(|turn| &turn.ring.vertices[..]).collect()
    }

    /// Asks for this share of the way from the start to the goals, of orientations without a torque yet.
    pub fn set_share(&mut self, share: f64) {
        self.share = share;
        self.turns.iter_mut().for_each(|turn| turn.torque = Vec3::zeros());
    }

    /// The share of their way that is asked for.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The share of their way on which no handle goes further than `furthest`.
    pub fn share_within(&self, furthest: f64) -> f64 {
        let holds = self.holds.iter().map(|hold| hold.place - hold.start);
        let ways = holds.chain(self.springs.iter().map(|spring| spring.place - spring.start));
        furthest / ways.map(|way| way.amax()).fold(furthest, f64::max)
    }

    /// Lets springs pull where hard positions are prescribed, or no longer.
    pub fn set_pulling(&mut self, pulling: bool) {
        self.pulling = pulling;
    }

    /// Torques of the orientations.
    pub fn torques(&self) -> Vec<Vec3> {
        self.turns.iter().map(|turn| turn.torque).collect()
    }

    /// What [`Handles::torques`] gave.
    pub fn set_torques(&mut self, torques: Vec<Vec3>) {
        self.turns.iter_mut().zip(torques).for_each(|(turn, torque)| turn.torque = torque);
    }

    /// Whether some hard position or orientation is elsewhere.
    pub fn is_away(&self, x: &[Vec3]) -> bool {
        let away = |hold: &Hold| {
            (Matrix3::identity() - hold.free) * (self.place(hold) - x[hold.vertex as usize]) != Vec3::zeros()
        };
        !self.turns.is_empty() || self.holds.iter().any(away)
    }

    /// Puts the hard positions where they belong.
    pub fn place_holds(&self, x: &mut [Vec3]) {
        for hold in &self.holds {
            let x = &mut x[hold.vertex as usize];
            *x = hold.free * *x + (Matrix3::identity() - hold.free) * self.place(hold);
        }
    }

    fn place(&self, hold: &Hold) -> Vec3 {
        hold.start.lerp(&hold.place, self.share)
    }

    fn spring(&self, spring: &Spring, x: &[Vec3]) -> Vec3 {
        spring.start.lerp(&spring.place, self.share) - x[spring.vertex as usize]
    }

    fn rho(&self, turn: &Turn) -> f64 {
        turn.resists * if self.pulling { PULL } else { PENALTY }
    }

    /// k.
    fn stiffness(&self, turn: &Turn) -> f64 {
        1.0 / (turn.compliance + 1.0 / self.rho(turn))
    }

    /// T along the held axes for a rotation that lacks `missing`.
    fn torque(&self, turn: &Turn, missing: &Vec3) -> Vec3 {
        let along = self.axes.tr_mul(missing);
        let torque = |a: usize| self.stiffness(turn) * (along[a] + turn.torque[a] / self.rho(turn));
        turn.only_held(Vec3::from_fn(|a, _| torque(a)))
    }

    /// Energy of the handles at `x`.
    pub fn value(&self, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        for spring in &self.springs {
            let d = self.spring(spring, x);
            sum += 0.5 * d.dot(&(spring.stiffness * d));
        }
        for turn in &self.turns {
            let missing = turn.missing(turn.present(x), self.share);
            sum += 0.5 * self.torque(turn, &missing).norm_squared() / self.stiffness(turn);
        }
        for hold in self.holds.iter().filter(|_| self.pulling) {
            let d = self.place(hold) - x[hold.vertex as usize];
            sum += 0.5 * PULL * hold.stiffness * (d - hold.free * d).norm_squared();
        }
        sum
    }

    /// Force of an orientation on its ring at positions `x` of that.
    fn pulls(&self, turn: &Turn, x: &[Vec3]) -> Vec<Vec3> {
        let (missing, by_vertex) = turn.derivative(x, self.share);
        let torque = self.axes * self.torque(turn, &missing);
        by_vertex.iter().map(|by| by.tr_mul(&torque)).collect()
    }

    /// Adds its gradient.
    pub fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for spring in &self.springs {
            gradient[spring.vertex as usize] -= spring.stiffness * self.spring(spring, x);
        }
        for turn in &self.turns {
            let pulls = self.pulls(turn, &turn.ring.gather(x));
            turn.ring.vertices.iter().zip(pulls).for_each(|(v, pull)| gradient[*v as usize] -= pull);
        }
        for hold in self.holds.iter().filter(|_| self.pulling) {
            let d = self.place(hold) - x[hold.vertex as usize];
            gradient[hold.vertex as usize] -= PULL * hold.stiffness * (d - hold.free * d);
        }
    }

    /// Leaves of a gradient what hard positions do not take.
    pub fn project(&self, gradient: &mut [Vec3]) {
        for hold in self.holds.iter().filter(|_| !self.pulling) {
            gradient[hold.vertex as usize] = hold.free * gradient[hold.vertex as usize];
        }
    }

    /// Leaves of an element's block between vertices `v` and `w` what hard positions do not take.
    pub fn projected(&self, v: u32, block: Matrix3<f64>, w: u32) -> Matrix3<f64> {
        match (self.hold_of(v), self.hold_of(w)) {
            _ if self.pulling => block,
            (None, None) => block,
            (row, column) => {
                let rows = row.map_or(block, |hold| hold.free * block);
                column.map_or(rows, |hold| rows * hold.free)
            }
        }
    }

    fn hold_of(&self, v: u32) -> Option<&Hold> {
        self.hold_at.get(v as usize).filter(|at| **at != NONE).map(|at| &self.holds[*at as usize])
    }

    /// P of a vertex.
    fn left_free(&self, v: u32) -> Matrix3<f64> {
        self.hold_of(v).map_or_else(Matrix3::identity, |hold| hold.free)
    }

    /// Adds the second derivative, for a semidefinite one without that of m, and fills what hard positions leave empty.
    pub fn add_hessian(&self, x: &[Vec3], curvature: Curvature, matrix: &mut BlockMatrix) {
        for spring in &self.springs {
            let v = spring.vertex;
            matrix.add_element(&[v], |_, _| self.projected(v, spring.stiffness, v));
        }
        for turn in &self.turns {
            let vertices = &turn.ring.vertices;
            let block = self.turn_hessian(turn, turn.ring.gather(x), curvature);
            matrix.add_element(vertices, |p, q| self.projected(vertices[p], block(p, q), vertices[q]));
        }
        for hold in &self.holds {
            let taken = Matrix3::identity() - hold.free;
            let stiffness = if self.pulling { PULL * hold.stiffness } else { hold.stiffness };
            matrix.add_element(&[hold.vertex], |_, _| stiffness * taken);
        }
    }

    /// The blocks of an orientation at positions `x` of its ring: k (∂m/∂x)ᵀ ∂m/∂x, or with the curvature of m, by differences of
    /// the force.
    fn turn_hessian(
        &self,
        turn: &Turn,
        mut x: Vec<Vec3>,
        curvature: Curvature,
    ) -> impl Fn(usize, usize) -> Matrix3<f64> {
        let n = x.len();
        let mut blocks = vec![Matrix3::zeros(); n * n];
        if curvature == Curvature::Semidefinite {
            let held = Matrix3::from_diagonal(&turn.only_held(Vec3::repeat(1.0)));
            let stiffness = self.stiffness(turn) * self.axes * held * self.axes.transpose();
            let by_vertex = turn.derivative(&x, self.share).1;
            (0..n * n).for_each(|k| blocks[k] = by_vertex[k / n].tr_mul(&(stiffness * by_vertex[k % n])));
        } else {
            let step = DIFFERENCE * (1..n).map(|i| (x[i] - x[0]).norm()).sum::<f64>() / n as f64;
            for q in 0..n {
                for axis in 0..3 {
                    let place = x[q][axis];
                    x[q][axis] = place + step;
                    let after = self.pulls(turn, &x);
                    x[q][axis] = place - step;
                    let before = self.pulls(turn, &x);
                    x[q][axis] = place;
                    for p in 0..n {
                        blocks[p * n + q].set_column(axis, &((before[p] - after[p]) / (2.0 * step)));
                    }
                }
            }
        }
        move |p, q| 0.5 * (blocks[p * n + q] + blocks[q * n + p].transpose())
    }

    /// Next multipliers; the largest |m − γT| before, rad, of orientations.
    pub fn update_torques(&mut self, x: &[Vec3]) -> f64 {
        let mut worst: f64 = 0.0;
        for k in 0..self.turns.len() {
            let turn = &self.turns[k];
            let missing = turn.missing(turn.present(x), self.share);
            let torque = self.torque(turn, &missing);
            let along = self.axes.tr_mul(&missing);
            let lacks = |a: usize| if turn.held[a] { along[a] - turn.compliance * torque[a] } else { 0.0 };
            worst = (0..3).map(|a| lacks(a).abs()).fold(worst, f64::max);
            self.turns[k].torque = torque;
        }
        worst
    }

    /// What became of each at `x`, with the gradient of the whole potential before [`Handles::project`], and the force of all on
    /// each vertex in `force`.
    pub fn conclude(&self, x: &[Vec3], gradient: &[Vec3], force: &mut [Vec3]) -> Vec<Grip> {
        force.iter_mut().for_each(|f| *f = Vec3::zeros());
        self.add_gradient(x, force);
        force.iter_mut().for_each(|f| *f = -*f);
        for hold in &self.holds {
            let v = hold.vertex as usize;
            force[v] += gradient[v] - hold.free * gradient[v];
        }
        self.list.iter().zip(&self.parts).map(|(handle, part)| self.grip(handle, *part, x, gradient)).collect()
    }

    fn grip(&self, handle: &Handle, part: Part, x: &[Vec3], gradient: &[Vec3]) -> Grip {
        let v = handle.vertex as usize;
        let only_held = |vector: Vec3| Vec3::from_fn(|a, _| if handle.held[a] { vector[a] } else { 0.0 });
        let along = |vector: Vec3| only_held(self.axes.tr_mul(&vector));
        let missing = match handle.goal {
            Goal::Position(place) => along(place - x[v]),
            Goal::Orientation(goal) => match part {
                Part::Turn(t) => along((goal * self.turns[t].present(x).inverse()).scaled_axis()),
                _ => along(goal.scaled_axis()),
            },
        };
        let force = match part {
            Part::Hold(h) => {
                let sharing = |axis: usize| {
                    let shares =
                        |other: &(&Handle, &Part)| matches!(other.1, Part::Hold(at) if *at == h) && other.0.held[axis];
                    self.list.iter().zip(&self.parts).filter(shares).count().max(1) as f64
                };
                let whole = along(gradient[v]);
                Vec3::from_fn(|a, _| whole[a] / sharing(a))
            }
            Part::Spring(s) => along(self.springs[s].stiffness * self.spring(&self.springs[s], x)),
            Part::Turn(t) => self.turns[t].torque,
            Part::Idle => Vec3::zeros(),
        };
        Grip { missing, force }
    }
}

impl Turn {
    fn only_held(&self, vector: Vec3) -> Vec3 {
        Vec3::from_fn(|a, _| if self.held[a] { vector[a] } else { 0.0 })
    }

    /// R at positions `x` (n_vertices).
    fn present(&self, x: &[Vec3]) -> UnitQuaternion<f64> {
        self.ring.rotation(&self.ring.gather(x))
    }

    /// m from `present`.
    fn missing(&self, present: UnitQuaternion<f64>, share: f64) -> Vec3 {
        missing_turn(&part_way(&self.start, &self.goal, share), &present).0
    }

    /// m at positions `x` of the ring, and −∂m/∂x of each vertex.
    fn derivative(&self, x: &[Vec3], share: f64) -> (Vec3, Vec<Matrix3<f64>>) {
        let (present, mut by_vertex) = self.ring.turn(x);
        let (missing, inverse) = missing_turn(&part_way(&self.start, &self.goal, share), &present);
        by_vertex.iter_mut().for_each(|by| *by = inverse * *by);
        (missing, by_vertex)
    }
}

/// Mean of the diagonal entries of the rest stiffness at each vertex (n_vertices).
pub fn vertex_stiffness(shell: &Shell) -> Vec<f64> {
    let mut stiffness = vec![0.0; shell.mass.len()];
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        vertices.iter().zip(row).for_each(|(&v, b)| stiffness[v as usize] += b.norm_squared() / 3.0);
    });
    stiffness
}

//! Constraints of the nonlinear shell, as terms of its potential: hard positions are prescribed, all else is an energy.
//!
//! A hard position takes its directions out of the unknowns: with the projector P onto what is left of a vertex, the gradient
//! is Pg and the Hessian PHP + k(1 − P), and the force of the constraint is (1 − P)g. A soft one is a spring ½|d − x|²/γ.
//!
//! An orientation is a condition m = γT on the rotation vector m from the present orientation to the target, along each held
//! axis, met by the method of multipliers: the energy ½k(m + T/ρ)², k = 1/(γ + 1/ρ), is minimized and T ← k(m + T/ρ). Any ρ
//! will do; a large one needs fewer rounds.

mod energy;
mod explicit;
mod setup;
mod springs;

use super::free_motion::Held;
use super::orientation::{Ring, missing_turn, part_way};
use crate::constraint::{Constraint, Outcome, Target};
use crate::mesh::NONE;
use crate::support::Roller;
use crate::{Vec3, rotation, wide_norm};
use nalgebra::{Matrix3, UnitQuaternion};
pub use setup::vertex_stiffness;
use springs::Springs;
use std::sync::Arc;

/// ρ over the stiffness of the vertices around: each round leaves about this part of m.
const PENALTY: f64 = 1e3;

/// As much stiffer than their vertices are the springs that pull the shell to where hard positions and orientations then take over.
const PULL: f64 = 10.0;

struct Hold {
    vertex: u32,
    held: [bool; 3],
    /// P.
    free: Matrix3<f64>,
    /// Mean of the targets, and where the vertex was at the start.
    place: Vec3,
    start: Vec3,
    stiffness: f64,
}

struct Turn {
    ring: Ring,
    held: [bool; 3],
    compliance: f64,
    /// Stiffness of the vertices around, as a rotation feels it.
    resists: f64,
    /// T along each of the constraints' axes.
    torque: Vec3,
    target: UnitQuaternion<f64>,
    start: UnitQuaternion<f64>,
}

/// How a constraint acts.
#[derive(Clone, Copy)]
enum Part {
    Hold(usize),
    Spring(usize),
    Turn(usize),
    /// Supports hold all that it could move.
    Idle,
}

/// All constraints of a shell, with targets in the axes of the rest positions.
pub struct Constraints {
    /// Columns: the axes that they hold along, in those of the rest positions.
    axes: Matrix3<f64>,
    list: Vec<Constraint>,
    parts: Vec<Part>,
    holds: Vec<Hold>,
    springs: Springs,
    turns: Vec<Turn>,
    /// Hold of each vertex, or [`NONE`] (n_vertices, or nothing without constraints).
    hold_at: Vec<u32>,
    /// Not held by supports, and with mass (n_vertices, or nothing without constraints).
    moves: Vec<bool>,
    /// What supports hold of those that are.
    rollers: Arc<[Roller]>,
    /// How much of the way from the start to the targets is asked for.
    share: f64,
    /// Hard positions are springs for now.
    pulling: bool,
}

impl Constraints {
    /// No constraints.
    pub fn none() -> Self {
        Self {
            axes: Matrix3::identity(),
            list: vec![],
            parts: vec![],
            holds: vec![],
            springs: Springs::none(),
            turns: vec![],
            hold_at: vec![],
            moves: vec![],
            rollers: Arc::default(),
            share: 1.0,
            pulling: false,
        }
    }

    /// What they hold of vertices, softly or not.
    pub fn held(&self) -> impl Iterator<Item = (u32, Held)> + '_ {
        let acting = self.list.iter().zip(&self.parts).filter(|(_, part)| !matches!(part, Part::Idle));
        acting.flat_map(|(constraint, _)| {
            let along = |a: usize| -> Vec3 { self.axes.column(a).into() };
            (0..3).filter(|a| constraint.axes[*a]).map(move |a| match constraint.target {
                Target::Position(_) => (constraint.vertex, Held::Along(along(a))),
                Target::Orientation(_) => (constraint.vertex, Held::About(along(a))),
            })
        })
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Vertices that they hold.
    pub fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.list.iter().map(|constraint| constraint.vertex)
    }

    /// Vertices that an orientation couples.
    pub fn cliques(&self) -> Vec<&[u32]> {
        self.turns.iter().map(|turn| &turn.ring.vertices[..]).collect()
    }

    /// Asks for this share of the way from the start to the targets, of orientations without a torque yet.
    pub fn set_share(&mut self, share: f64) {
        (self.share, self.springs.share) = (share, share);
        self.turns.iter_mut().for_each(|turn| turn.torque = Vec3::zeros());
    }

    /// The share of their way that is asked for.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The share of their way on which no constraint goes further than `furthest`.
    pub fn share_within(&self, furthest: f64) -> f64 {
        let holds = self.holds.iter().map(|hold| hold.place - hold.start);
        let ways = holds.chain(self.springs.list.iter().map(|spring| spring.place - spring.start));
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

    /// Numbers that tell the torques of all orientations.
    pub fn n_torques(&self) -> usize {
        3 * self.turns.len()
    }

    /// Adds the torques of all orientations at `x`, with what m changes to first order on the way to `next`; without one, their multipliers T.
    pub fn foresee_torques(&self, x: &[Vec3], next: Option<&[Vec3]>, torques: &mut Vec<f64>) {
        for turn in &self.turns {
            let torque = next.map_or(turn.torque, |next| {
                let (missing, by_vertex) = turn.derivative(&turn.ring.gather(x), self.share);
                let ways = turn.ring.vertices.iter().map(|v| next[*v as usize] - x[*v as usize]);
                let gained = by_vertex.iter().zip(ways).map(|(by, way)| by * way);
                self.torque(turn, &(missing - gained.fold(Vec3::zeros(), |sum, turn| sum + turn)))
            });
            torques.extend_from_slice(torque.as_slice());
        }
    }

    /// What [`Constraints::torques`] gave.
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

    fn hold_of(&self, v: u32) -> Option<&Hold> {
        self.hold_at.get(v as usize).filter(|at| **at != NONE).map(|at| &self.holds[*at as usize])
    }

    /// P of a vertex.
    fn left_free(&self, v: u32) -> Matrix3<f64> {
        let free = self.hold_of(v).map_or_else(Matrix3::identity, |hold| hold.free);
        if self.rollers.is_empty() { free } else { free * self.supported(v) }
    }

    /// P of its supports alone.
    fn supported(&self, v: u32) -> Matrix3<f64> {
        let at = self.rollers.binary_search_by_key(&v, |roller| roller.vertex);
        at.map_or_else(|_| Matrix3::identity(), |at| self.rollers[at].free)
    }

    fn place(&self, hold: &Hold) -> Vec3 {
        hold.start.lerp(&hold.place, self.share)
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

    /// What became of each at `x`, with the gradient of the whole potential before [`Constraints::project`], and the force of all on
    /// each vertex in `force`.
    pub fn outcomes(&self, x: &[Vec3], gradient: &[Vec3], force: &mut [Vec3]) -> Vec<Outcome> {
        force.iter_mut().for_each(|f| *f = Vec3::zeros());
        self.add_gradient(x, force);
        force.iter_mut().for_each(|f| *f = -*f);
        for hold in &self.holds {
            let v = hold.vertex as usize;
            force[v] += gradient[v] - hold.free * gradient[v];
        }
        self.list
            .iter()
            .zip(&self.parts)
            .map(|(constraint, part)| self.outcome(constraint, *part, x, gradient))
            .collect()
    }

    fn outcome(&self, constraint: &Constraint, part: Part, x: &[Vec3], gradient: &[Vec3]) -> Outcome {
        let v = constraint.vertex as usize;
        let only_held = |vector: Vec3| Vec3::from_fn(|a, _| if constraint.axes[a] { vector[a] } else { 0.0 });
        let along = |vector: Vec3| only_held(self.axes.tr_mul(&vector));
        let missing = match constraint.target {
            Target::Position(place) => along(place - x[v]),
            Target::Orientation(target) => match part {
                Part::Turn(t) => along(rotation::vector(&(target * self.turns[t].present(x).inverse()))),
                _ => along(rotation::vector(&target)),
            },
        };
        let force = match part {
            Part::Hold(h) => {
                let sharing = |axis: usize| {
                    let shares = |other: &(&Constraint, &Part)| {
                        matches!(other.1, Part::Hold(at) if *at == h) && other.0.axes[axis]
                    };
                    self.list.iter().zip(&self.parts).filter(shares).count().max(1) as f64
                };
                let whole = along(gradient[v]);
                Vec3::from_fn(|a, _| whole[a] / sharing(a))
            }
            Part::Spring(s) => along(self.springs.force(s, &x[v])),
            Part::Turn(t) => self.turns[t].torque,
            Part::Idle => Vec3::zeros(),
        };
        Outcome { residual: wide_norm(&missing), force, iterations: 0 }
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
        missing_turn(&part_way(&self.start, &self.target, share), &present).0
    }

    /// m at positions `x` of the ring, and −∂m/∂x of each vertex.
    fn derivative(&self, x: &[Vec3], share: f64) -> (Vec3, Vec<Matrix3<f64>>) {
        let (present, mut by_vertex) = self.ring.turn(x);
        let (missing, inverse) = missing_turn(&part_way(&self.start, &self.target, share), &present);
        by_vertex.iter_mut().for_each(|by| *by = inverse * *by);
        (missing, by_vertex)
    }
}

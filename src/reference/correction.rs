//! How far a pose is from an equilibrium of the full shell: the way that a few Newton steps take from it.
//!
//! One step is not enough. Poses of few fields stretch a thin shell a little everywhere, and what they leave of the forces is
//! nearly all of this stretch: the first step takes it out, and only the next ones see how the shell then bends. So steps go on until
//! the load is all but balanced, which takes three to a dozen of them, and up to some 50 where the shell bends far without stretching.

use super::constraints::{Constraints, vertex_stiffness};
use super::free_motion::FreeMotions;
use super::newton::Stop;
use super::potential::Potential;
use super::{Solver, continuation, free_norm, mass_norm};
use crate::load::Following;
use crate::{Result, Shell, Vec3};
use std::sync::{Mutex, PoisonError};

/// Of the load; what is left then moves the shell by far less than what it has come.
pub const CORRECTED: f64 = 1e-6;

/// Newton steps in a round, at most. `cargo test --release --test full certificate:: -- --nocapture` shows what estimates they give.
pub const SOLVES: usize = 60;

/// Where this share of a displacement is wrong, the equilibrium beside a pose says little of the way that the load or a handle took. And a state that misses
/// more than this share of a hard handle's way is where no equilibrium with the handle was found: then the paper's method goes on if it comes nearer to the handle.
pub const LOST: f64 = 0.5;

/// Rounds at most of a load that follows the shape, and the part of the whole way that the last one may go.
const ROUNDS: usize = 20;
const SETTLED: f64 = 0.01;

/// Balances that are no minimum, on the way to one, at most.
const FALLS: usize = 8;

/// A way shorter than this, in sizes, is none.
const NOWHERE: f64 = 1e-12;

/// Of what rounding pulls by [`rounding`], the least load that there is: that of one rounding of the size. A shell that nothing loads, at rest, is right.
const LEAST: f64 = f64::EPSILON / NOWHERE;

/// Steps begin anew where going on leaves so many times as much of the force. What begins anew leaves about the load. Just after a snap what goes on leaves dozens of
/// times that, and gets there all the same.
const DROPPED: f64 = 1e3;

/// What a correction is under.
pub struct Load<'a> {
    /// The forces at displacements (n_vertices each).
    pub at: &'a dyn Fn(&[Vec3]) -> Vec<Vec3>,
    /// Whether they differ from pose to pose.
    pub follows: bool,
    /// About the force of the constraints.
    pub held: f64,
    /// About the forces that set in motion what nothing holds.
    pub moving: f64,
    /// Whether the shell stands still: then only a stable equilibrium will do. A moving one may pass others.
    pub still: bool,
    /// Whether the start is a pose of another method than the full shell, which is stretched a little everywhere.
    pub foreign: bool,
}

/// The way to an equilibrium.
#[derive(Clone, Debug)]
pub struct Correction {
    /// To where the steps led (n_vertices), without what moves freely.
    pub way: Vec<Vec3>,
    /// ‖F − ∇E‖ over the free vertices, along what constraints leave free, at the start and at the end, relative to F and the constraints' forces.
    pub force: [f64; 2],
    /// The share of their way that constraints were not led, or of the whole that the last round still went.
    pub short: f64,
    /// Factorizations that it took.
    pub factorizations: usize,
}

/// Where steps toward an equilibrium are.
#[derive(Clone, Debug)]
pub struct Correcting {
    /// From the pose that they are of (n_vertices).
    pub way: Vec<Vec3>,
    /// The stress of each element that the last one foresaw (n_elements).
    pub stress: Vec<f64>,
}

/// Steps, in a round at most, and who hears of them.
type Watched<'a> = (usize, &'a mut dyn FnMut(f64) -> Result<()>);

impl Solver {
    /// Whether supports and constraints leave rigid motions free at the displacements `u` (n_vertices).
    pub fn moves_freely(&self, u: &[Vec3]) -> bool {
        let x: Vec<Vec3> = self.shell.mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
        !FreeMotions::new(&self.shell, self.constraints.held(), &x).is_empty()
    }

    /// Newton steps from the displacements `start` (n_vertices) toward the equilibrium under a load and the constraints of
    /// [`Solver::set_constraints`], at most `solves` in a round, more where constraints have a way to go. A load that follows the shape is taken
    /// anew until this settles. What moves freely stays where it is, by mass, as in `free_motion`. `watch` hears what each iterate leaves of the
    /// force, relative, and may stop the work with an error.
    pub fn correct(
        &mut self,
        start: &[Vec3],
        load: &Load,
        solves: usize,
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Correction> {
        self.newton.foreign = load.foreign;
        let found = self.correct_in_rounds(start, load, (solves, watch));
        self.newton.foreign = false; // others use it next
        found
    }

    /// So many Newton steps from the displacements `start` of another method toward the same equilibrium, wherever they lead: the way there
    /// (n_vertices). They go on from where `earlier` ones led unless that leaves far more of the force. What hard constraints hold stays where it is.
    /// `watch` hears before each step what is left of the force, relative, and may stop the work with an error.
    pub fn step_toward(
        &mut self,
        start: &[Vec3],
        load: &Load,
        (steps, watch): Watched,
        earlier: Option<&Correcting>,
    ) -> Result<Correcting> {
        self.check_fields(&[("start", start)])?;
        self.place(start);
        let (shell, first) = (self.shell.clone(), self.x.clone());
        let free = FreeMotions::new(&shell, self.constraints.held(), &self.x);
        let mut forces = (load.at)(start);
        let scale = scale_of(&shell, load, (&forces, &free)).max(f64::MIN_POSITIVE);
        free.balance(&shell, &self.x, &mut forces);
        self.constraints.pin(&free.pins(&self.x), &self.x);
        self.origin.copy_from_slice(&self.x);
        let Self { newton, origin, x, constraints, points, .. } = self;
        let points = Self::points(points);
        let potential = Potential { shell: &shell, origin, load: &forces, step: None, constraints, points };
        newton.foreign = true;
        let mut stress = vec![];
        newton.begin(&potential, x, &mut stress);
        if let Some(Correcting { way, stress: foreseen }) = earlier {
            let mut way = way.clone();
            constraints.project(&mut way);
            let there: Vec<Vec3> = first.iter().zip(&way).map(|(x, way)| x + way).collect();
            let here = newton.mixed_force(&potential, &first, &stress);
            if newton.mixed_force(&potential, &there, foreseen) < DROPPED * here {
                x.copy_from_slice(&there);
                stress.clone_from(foreseen);
            }
        }
        let followed = newton.follow_mixed(&potential, x, &mut stress, (steps, &mut |force| watch(force / scale)));
        stress.truncate(shell.energy.n_elements()); // without torques: handles may be others in the next frame
        newton.foreign = false; // others use it next
        followed?;
        free.align(&shell, &mut self.x, &first);
        Ok(Correcting { way: self.x.iter().zip(&first).map(|(x, first)| x - first).collect(), stress })
    }

    fn correct_in_rounds(&mut self, start: &[Vec3], load: &Load, (solves, watch): Watched) -> Result<Correction> {
        self.check_fields(&[("start", start)])?;
        let earlier = self.factorizations();
        self.place(start);
        let first = self.x.clone();
        let shell = self.shell.clone();
        let mut found = Correction { way: vec![], force: [0.0; 2], short: 0.0, factorizations: 0 };
        let mut following = Following::new();
        for round in 0..ROUNDS {
            let rest = &shell.mesh.positions;
            let displacement: Vec<Vec3> = self.x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
            let before = self.x.clone();
            let free = FreeMotions::new(&shell, self.constraints.held(), &self.x);
            let mut forces = (load.at)(if round == 0 { start } else { &displacement });
            if load.follows {
                following.take_share(&mut forces);
            }
            let scale = scale_of(&shell, load, (&forces, &free));
            if round > 0 {
                self.constraints.renew(&shell, &self.x);
            }
            free.balance(&shell, &self.x, &mut forces);
            self.constraints.pin(&free.pins(&self.x), &self.x);
            let [from, to] = self.approach((&forces, scale), (solves, watch), load.still.then_some(&first))?;
            free.align(&shell, &mut self.x, &first);
            found.force = [if round == 0 { from } else { found.force[0] }, to];
            let gone = mass_norm(&shell, |v| self.x[v] - before[v]);
            let whole = mass_norm(&shell, |v| self.x[v] - first[v]);
            found.short = 1.0 - self.constraints.share();
            let again = found.short == 0.0 && (load.follows || !free.is_empty());
            if !again || gone <= NOWHERE * shell.mesh.size * shell.total_mass.sqrt() {
                break;
            }
            found.short = gone / (following.share() * whole);
            if round > 0 && found.short <= SETTLED {
                found.short = 0.0;
                break;
            }
            if to > CORRECTED && self.factorizations() - earlier >= 2 * solves {
                break; // rounds that find no end lead to none
            }
        }
        found.factorizations = self.factorizations() - earlier;
        found.way = self.x.iter().zip(&first).map(|(x, first)| x - first).collect();
        Ok(found)
    }

    /// From `self.x` to the equilibrium under dead forces; what is left of them at the start and at the end, relative to `scale`. From a
    /// balance that is no minimum it goes on to one, on the side of `from`, if given.
    fn approach(
        &mut self,
        (forces, scale): (&[Vec3], f64),
        (solves, watch): Watched,
        from: Option<&Vec<Vec3>>,
    ) -> Result<[f64; 2]> {
        self.origin.copy_from_slice(&self.x);
        let Self { shell, newton, origin, x, force, constraints, points, .. } = self;
        let scale = scale.max(f64::MIN_POSITIVE);
        let stop = Stop { tolerance: CORRECTED, scale, max_iterations: solves };
        let points = Self::points(points);
        let plain = Potential { shell, origin, load: forces, step: None, constraints: &Constraints::none(), points };
        let left = |constraints: &Constraints, x: &[Vec3], force: &mut [Vec3]| {
            Potential { constraints, ..plain }.gradient(x, force);
            free_norm(shell, force)
        };
        let before = left(constraints, x, force) / scale;
        for _ in 0..=FALLS {
            let (after, scale) = if constraints.is_away(x) {
                continuation::step(newton, constraints, &plain, x, (stop, watch))?;
                let held = left(&Constraints::none(), x, force);
                (left(constraints, x, force), libm::hypot(scale, held))
            } else {
                let end = newton.minimize(&Potential { constraints, ..plain }, x, stop, watch)?;
                let ahead = if end.converged { None } else { newton.return_to_mark(x) };
                (ahead.unwrap_or(end.residual * scale), scale)
            };
            let ends = |_: &&Vec<Vec3>| after <= CORRECTED * scale && constraints.share() == 1.0;
            let potential = Potential { constraints, ..plain };
            match from.filter(ends) {
                Some(from) if newton.leave_saddle(&potential, x, from)? => continue,
                _ => return Ok([before, after / scale]),
            }
        }
        Ok([before, 1.0])
    }
}

/// The force that what is left of `forces` is relative to.
fn scale_of(shell: &Shell, load: &Load, (forces, free): (&[Vec3], &FreeMotions)) -> f64 {
    let moving = if free.is_empty() { 0.0 } else { libm::hypot(load.moving, rounding(shell)) };
    libm::hypot(libm::hypot(free_norm(shell, forces), load.held), moving).max(LEAST * rounding(shell))
}

/// The force of rounding, where there may be no other.
fn rounding(shell: &Shell) -> f64 {
    let stiffness = vertex_stiffness(shell);
    NOWHERE * shell.mesh.size * stiffness.iter().map(|k| k * k).sum::<f64>().sqrt()
}

/// Solvers of one shell that are kept from call to call, with their symbolic factorizations: as many as were in use at once.
#[derive(Default)]
pub struct SolverPool(Mutex<Vec<Solver>>);

impl SolverPool {
    /// Runs `body` with a solver that no other thread has; `make` makes one where all are taken.
    pub fn with<T>(
        &self,
        make: impl FnOnce() -> Result<Solver>,
        body: impl FnOnce(&mut Solver) -> Result<T>,
    ) -> Result<T> {
        let kept = self.list().pop();
        let mut solver = kept.map_or_else(make, Ok)?;
        let result = body(&mut solver);
        self.list().push(solver);
        result
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.list().iter().map(Solver::bytes).sum()
    }

    fn list(&self) -> std::sync::MutexGuard<'_, Vec<Solver>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner) // a list of whole solvers, whoever panicked
    }
}

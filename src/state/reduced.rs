//! Motion of the reduced discrete shell by a diagonally implicit Runge–Kutta method of two stages and second order (Alexander 1977), with
//! γ = 1 − 1/√2 and y' = f(y) of y = (q, q̇):
//!
//!   y₁ = y + γh f(y₁),   y⁺ = y + (1 − γ)h f(y₁) + γh f(y⁺).
//!
//! It is L-stable: of a swing with the phase θ = ωh it takes θ⁴/270 a step, and what the step does not resolve dies at once. A step
//! knows nothing of those before, so that loads and handles may jump between steps: they are constant over each, handles move evenly.
//!
//! Each stage is a step of backward Euler over γh from a place that is known. Its end is the minimum of a potential, found by Newton's
//! method ([`crate::reduced::Newton`]) from a guess or, where the potential is lower, from the stage's start. Both have the same
//! inertia, and the second begins with the Hessian of the first. A step with a search that ends short is made anew by backward Euler,
//! whose potential is no higher at its end than at q: a step that ends short gains no energy but what loads and handles put in.
//!
//! Damping is ξI + ζ Bᵀ(Σ b bᵀ)B with the strain rows b of the shape at the start of the step, and 2 ratio √λ on the modes.

use super::nodal;
use crate::constraint::{ConstraintSet, Outcome, Target};
use crate::load::BodyLoad;
use crate::load::External;
use crate::reduced::{End, Newton, Potential, ReducedShell, Rows, Stop, Work, with_fields};
use crate::reference::orientation::{Ring, missing_turn, part_way};
use crate::support::Pose;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Model, Result, Vec3, wide_norm};
use nalgebra::{DMatrix, DVector, UnitQuaternion};

/// γ, and (1 − γ)/γ: how far past the first stage's end the second starts.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
const ONWARD: f64 = 1.0 + std::f64::consts::SQRT_2;
/// A step moves on at this, an energy of 1e-10 of what the loads do; the Newton step that shows it is still taken.
const STEP: Stop = Stop { tolerance: 1e-5, iterations: 20, led: false, near: false };
const REST: Stop = Stop { tolerance: 1e-7, iterations: 200, led: true, near: false };
/// Shares of the load that are added at once on the way to an equilibrium, at first and at least.
const FIRST_SHARE: f64 = 0.25;
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Newton steps for all shares; none is tried with a smaller one past them.
const ALL_ITERATIONS: usize = 1000;
/// Passes of a step, at most: in a turning frame, whose forces are taken at the end of the step as found last, each gains a factor ωh;
/// orientations are held to first order about the shape that was found last.
const PASSES: usize = 4;
/// Rounds about the last shape for the orientations of an equilibrium; they converge quadratically.
const ROUNDS: usize = 30;
/// Of the round before, what a round moves at least where it gains nothing. And of the displacement and in rad, what rounding of the
/// fields' numbers leaves of an equilibrium with orientations: 1e-7 of 32 bits by the size of the shell over that of a triangle and the
/// stiffness of its sheet over that of its bending, at most.
const STALLED: f64 = 0.5;
const ROUNDED: f64 = 1e-4;
/// Displacement, in units of the model's size, over which the curvature of orientations is found by differences.
const DIFFERENCE: f64 = 1e-5;
/// Of what a step moves, what a pass may change as the last one: forces of a turning frame feel the rates that it makes.
const ENOUGH: f64 = 1e-5;
/// Of the displacement, what the last pass may still change although it changes more than the first.
const SETTLED: f64 = 1e-3;
/// Root mean square displacement, in units of the model's size, up to which handles are followed. No shell reaches it unless it is
/// stretched three times over or its few fields know no smaller way; far beyond, a fold of no area catches the energy.
const REACH: f64 = 2.0;
/// Of what is left, when a pose is taken: each gains the digits of B, at least four.
const PROJECTIONS: usize = 4;
/// Past this displacement, in units of the model's size, an amplitude has no meaning left.
pub const LARGEST_DISPLACEMENT: f64 = 1e6;

/// q and its rates.
#[derive(Clone)]
pub struct Motion {
    pub q: Vec<f64>,
    pub q_dot: Vec<f64>,
}

impl Motion {
    fn rest(n: usize) -> Self {
        Self { q: vec![0.0; n], q_dot: vec![0.0; n] }
    }
}

/// Amplitudes and what acts on them.
#[derive(Clone)]
pub struct Reduced {
    pub motion: Motion,
    /// ξ and ζ.
    pub damping: crate::reference::Rayleigh,
    /// 2 ratio √λ of each mode.
    pub modal_damping: Vec<f64>,
    pub constraints: ConstraintSet,
    pub constraint_work: f64,
    /// Steps whose search ended short of its tolerance.
    pub unconverged: u64,
    /// Of the last step; none before one.
    pub work: Work,
    newton: Newton,
    rows: Rows,
    /// The triangles at each vertex whose orientation is held, made when a step first needs them.
    rings: Vec<(u32, Ring)>,
    /// Next q and that of the last pass, b of the potential, the load without inertia, and rates for forces of a turning frame.
    next: Vec<f64>,
    last: Vec<f64>,
    load: Vec<f64>,
    force: Vec<f64>,
    rates: Vec<f64>,
    /// Where a stage starts: q and q̇ of its backward Euler; and a q that the shell can be at.
    from: [Vec<f64>; 2],
    start: Vec<f64>,
    viscosity: DMatrix<f64>,
}

/// Of a model that has one.
pub fn of(model: &Model) -> Result<&ReducedShell> {
    model.reduced.as_ref().ok_or_else(|| {
        let message = "the model has no reduced shell: precompute with reduced_fields, 40 for a start";
        Error::new(ErrorKind::Unsupported, message)
    })
}

/// The triangles at a vertex, from those made before or anew.
fn ring_of<'a>(rings: &'a mut Vec<(u32, Ring)>, model: &Model, vertex: u32) -> &'a Ring {
    let at = rings.iter().position(|(v, _)| *v == vertex).unwrap_or_else(|| {
        rings.push((vertex, Ring::of(&model.shell.mesh, vertex)));
        rings.len() - 1
    });
    &rings[at].1
}

/// The ring's vertices at x̄ + Bq.
fn places(model: &Model, reduced: &ReducedShell, ring: &Ring, q: &[f64]) -> Vec<Vec3> {
    let mut x = ring.gather(&model.shell.mesh.positions);
    let place = |i: usize, u: Vec3| x[i] += u;
    with_fields!(&reduced.fields, fields => fields.displacements_of(q, &ring.vertices, place));
    x
}

fn placed(Placement { origin, rotation }: &Placement, local: Vec3) -> Vec3 {
    origin + rotation.map_or(local, |rotation| rotation * local)
}

/// A step of backward Euler within a step.
#[derive(Clone, Copy)]
struct Stage {
    /// Seconds of the whole step, and of this.
    h: f64,
    tau: f64,
    /// Where handles are at its end, as a share of their way in the step.
    share: f64,
    /// The Hessian of the search before is near enough to begin with.
    near: bool,
    damped: bool,
}

impl Reduced {
    /// At rest, undamped.
    pub fn new(model: &Model) -> Result<Self> {
        let reduced = of(model)?;
        let n = reduced.n();
        let zeros = vec![0.0; n];
        Ok(Self {
            motion: Motion::rest(n),
            damping: Default::default(),
            modal_damping: vec![0.0; model.modal.n_modes()],
            constraints: ConstraintSet::default(),
            constraint_work: 0.0,
            unconverged: 0,
            work: Work::default(),
            newton: Newton::new(&reduced.energy),
            rows: Rows::new(0, n),
            rings: vec![],
            next: zeros.clone(),
            last: zeros.clone(),
            load: zeros.clone(),
            force: zeros.clone(),
            rates: zeros.clone(),
            from: [zeros.clone(), zeros.clone()],
            start: zeros,
            viscosity: DMatrix::zeros(n, n),
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.motion = Motion::rest(self.next.len());
        self.constraints.reset();
        self.constraint_work = 0.0;
        self.unconverged = 0;
        self.work = Work::default();
    }

    /// No speed.
    pub fn stop(&mut self) {
        self.motion.q_dot.fill(0.0);
    }

    /// Changes the constraints, with room for their work afterwards: moving a target does not allocate.
    pub fn change_constraints<T>(&mut self, change: impl FnOnce(&mut ConstraintSet) -> T) -> T {
        let changed = change(&mut self.constraints);
        let rows = self.constraints.report().map(|(c, _)| c.axes.iter().filter(|held| **held).count()).sum();
        if self.rows.len() != rows {
            self.rows = Rows::new(rows, self.next.len());
            self.newton.make_room(rows);
        }
        changed
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let (n, rows) = (self.next.len(), self.rows.len());
        8 * (2 * n * n + 16 * n + rows * (2 * n + rows + 4))
    }

    /// Whether positions and energies are numbers that can be told.
    pub fn has_meaning(model: &Model, q: &[f64], q_dot: &[f64]) -> bool {
        let largest = LARGEST_DISPLACEMENT * model.shell.mesh.size * model.shell.total_mass.sqrt();
        let kinetic: f64 = q_dot.iter().map(|v| v * v).sum();
        kinetic.is_finite() && q.iter().all(|q| q.abs() <= largest)
    }

    /// One step of `h` under `load` and `external` forces (frame axes, n_vertices, or none). Changes nothing on failure.
    pub fn step(&mut self, model: &Model, load: &BodyLoad, external: External, pose: &Pose, h: f64) -> Result<()> {
        let reduced = of(model)?;
        let at = (model, reduced, pose);
        self.set_force(reduced, load, external);
        self.newton.take_work();
        let (mut converged, mut work) = self.two_stages(at, load, h)?;
        if !converged {
            (converged, work) = self.backward_euler(at, load, h)?;
        }
        self.conclude(at);
        let told = (self.constraint_work + work).is_finite() && self.constraints.is_finite();
        if !told || !Self::has_meaning(model, &self.next, &self.rates) {
            let message = format!("the step of {h:?} s does not give finite positions");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        self.motion.q.copy_from_slice(&self.next);
        self.motion.q_dot.copy_from_slice(&self.rates);
        self.constraint_work += work;
        self.unconverged += u64::from(!converged);
        self.work = self.newton.take_work();
        self.constraints.accept();
        Ok(())
    }

    /// Sets the next q and its rates. Returns whether the searches converged, and the work of constraints.
    fn two_stages(&mut self, at: (&Model, &ReducedShell, &Pose), load: &BodyLoad, h: f64) -> Result<(bool, f64)> {
        let tau = GAMMA * h;
        let damped = self.set_viscosity(at.1, tau);
        let first = Stage { h, tau, share: GAMMA, near: false, damped };
        self.begin(at, first);
        if !self.advance(at, load, first)? {
            return Ok((false, 0.0));
        }
        let work = ONWARD * self.work_of_constraints();
        self.set_rows(at, 1.0);
        self.start.copy_from_slice(&self.next);
        let Motion { q, q_dot } = &self.motion;
        let [places, rates] = &mut self.from;
        for k in 0..q.len() {
            let gained = self.rates[k] - q_dot[k];
            places[k] = q[k] + ONWARD * (self.next[k] - q[k]);
            rates[k] = q_dot[k] + ONWARD * gained;
            self.next[k] = places[k] + tau * (rates[k] + gained); // with the acceleration of the first stage
        }
        let converged = self.advance(at, load, Stage { share: 1.0, near: true, ..first })?;
        Ok((converged, work + self.work_of_constraints()))
    }

    /// The same by one stage.
    fn backward_euler(&mut self, at: (&Model, &ReducedShell, &Pose), load: &BodyLoad, h: f64) -> Result<(bool, f64)> {
        let damped = self.set_viscosity(at.1, h);
        let stage = Stage { h, tau: h, share: 1.0, near: false, damped };
        self.begin(at, stage);
        let converged = self.advance(at, load, stage)?;
        Ok((converged, self.work_of_constraints()))
    }

    /// A stage starts where the step does.
    fn begin(&mut self, at: (&Model, &ReducedShell, &Pose), stage: Stage) {
        let Motion { q, q_dot } = &self.motion;
        self.from[0].copy_from_slice(q);
        self.from[1].copy_from_slice(q_dot);
        self.start.copy_from_slice(q);
        self.next.copy_from_slice(q);
        self.set_rows(at, stage.share);
        let Motion { q, q_dot } = &self.motion;
        (0..q.len()).for_each(|k| self.next[k] = q[k] + stage.tau * q_dot[k]);
    }

    /// Moves the next q from a guess to the end of a stage, and sets its rates. Returns whether the search converged.
    fn advance(&mut self, at: (&Model, &ReducedShell, &Pose), load: &BodyLoad, stage: Stage) -> Result<bool> {
        let Stage { h, tau, share, near, damped } = stage;
        let (reduced, alpha, mass) = (at.1, tau.recip(), self.damping.mass);
        let shift = alpha * (alpha + mass);
        let turned = self.holds_orientations();
        let passes = if turned || load.spin_rate().is_some() { PASSES } else { 1 };
        let (mut converged, mut gained, mut size) = (true, [0.0; PASSES], 0.0);
        for (pass, gained) in gained[..passes].iter_mut().enumerate() {
            self.last.copy_from_slice(&self.next);
            if turned && pass > 0 {
                self.set_rows(at, share);
            }
            let [places, rates] = &self.from;
            let (_, spin) = load.parts();
            self.load.copy_from_slice(&self.force);
            if let Some((gradient, coriolis)) = spin {
                (0..places.len()).for_each(|k| self.rates[k] = alpha * (self.next[k] - places[k]));
                reduced.add_spin(gradient, coriolis, (&self.next, &self.rates), &mut self.load);
            }
            for k in 0..places.len() {
                self.load[k] += shift * places[k] + alpha * rates[k];
                if damped {
                    self.load[k] += self.viscosity.column(k).iter().zip(places).map(|(c, q)| c * q).sum::<f64>();
                }
            }
            let handles = (!self.rows.is_empty()).then_some(&self.rows);
            let matrix = damped.then_some(&self.viscosity);
            let potential = Potential { shift, matrix, load: &self.load, handles };
            if pass == 0 && !self.newton.is_lower(&reduced.energy, &potential, &self.next, &self.start) {
                self.next.copy_from_slice(&self.start);
            }
            let stop = Stop { near: near || pass > 0, ..STEP };
            converged = self.newton.minimize(&reduced.energy, &potential, &mut self.next, stop).converged;
            *gained = self.next.iter().zip(&self.last).map(|(a, b)| (a - b).powi(2)).sum();
            size = self.next.iter().map(|q| q * q).sum();
            let moved: f64 = self.next.iter().zip(&self.start).map(|(next, q)| (next - q).powi(2)).sum();
            if *gained <= ENOUGH * ENOUGH * moved {
                break;
            }
        }
        // The first pass makes up for the guess; from the second on only the frame's forces change.
        if let Some(rate) = load.spin_rate().filter(|_| gained[PASSES - 1] > gained[1].max(SETTLED * SETTLED * size)) {
            let turn = rate * h;
            let turn = if turn < 1e4 { format!("{turn:.1}") } else { format!("{turn:.1e}") };
            let message = format!("the forces of a frame that turns by {turn} rad in a step of {h:?} s do not settle");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        (0..self.next.len()).for_each(|k| self.rates[k] = alpha * (self.next[k] - self.from[0][k]));
        Ok(converged)
    }

    /// Work of constraints in a stage.
    fn work_of_constraints(&self) -> f64 {
        let (rows, force) = (&self.rows, self.newton.multipliers());
        (0..rows.len()).map(|i| force[i] * (rows.along(i, &self.next) - rows.along(i, &self.from[0]))).sum()
    }

    /// The damping beside ξ at the start of the step, over a stage's `tau` seconds; false if there is none.
    fn set_viscosity(&mut self, reduced: &ReducedShell, tau: f64) -> bool {
        let zeta = self.damping.stiffness;
        let modal = self.modal_damping.iter().any(|c| *c > 0.0);
        if zeta > 0.0 {
            reduced.energy.viscosity(&self.motion.q, self.newton.scratch(), &mut self.viscosity);
            self.viscosity *= zeta;
        } else if modal {
            self.viscosity.fill(0.0);
        }
        self.modal_damping.iter().enumerate().for_each(|(k, c)| self.viscosity[(k, k)] += c);
        let damped = zeta > 0.0 || modal;
        if damped {
            self.viscosity /= tau;
        }
        damped
    }

    /// BᵀF without the turning frame's.
    fn set_force(&mut self, reduced: &ReducedShell, load: &BodyLoad, external: External) {
        self.force.fill(0.0);
        reduced.add_uniform(&load.parts().0, &mut self.force);
        if let Some(forces) = external.on_all() {
            with_fields!(&reduced.fields, fields => fields.project(forces, &mut self.force));
        }
        for (v, force) in external.on_some() {
            for (k, sum) in self.force.iter_mut().enumerate() {
                *sum += with_fields!(&reduced.fields, fields => fields.at(k, v as usize)).dot(&force);
            }
        }
    }

    fn holds_orientations(&self) -> bool {
        self.constraints.report().any(|(c, _)| matches!(c.target, Target::Orientation(_)))
    }

    /// The constraints' rows about the next q: world axes of each vertex, and where they shall be at this share of the way from q; of
    /// an orientation its rotation vector to the target, to first order.
    fn set_rows(&mut self, (model, reduced, pose): (&Model, &ReducedShell, &Pose), share: f64) {
        let to_frame = pose.rotation.inverse();
        let mut row = 0;
        for (c, _) in self.constraints.report() {
            let turn = match c.target {
                Target::Position(_) => None,
                Target::Orientation(world) => {
                    let ring = ring_of(&mut self.rings, model, c.vertex);
                    let start = ring.rotation(&places(model, reduced, ring, &self.motion.q));
                    let (present, by_vertex) = ring.turn(&places(model, reduced, ring, &self.next));
                    let (missing, inverse) = missing_turn(&part_way(&start, &(to_frame * world), share), &present);
                    Some((missing, inverse, by_vertex, ring))
                }
            };
            for axis in (0..3).filter(|axis| c.axes[*axis]) {
                let direction = to_frame * Vec3::ith(axis, 1.0);
                self.rows.compliance[row] = c.compliance;
                for k in 0..self.next.len() {
                    let at = |v: u32| with_fields!(&reduced.fields, fields => fields.at(k, v as usize));
                    self.rows.jacobian[(k, row)] = match &turn {
                        None => at(c.vertex).dot(&direction),
                        Some((_, inverse, by_vertex, ring)) => {
                            let turned: Vec3 = by_vertex.iter().zip(&ring.vertices).map(|(by, v)| by * at(*v)).sum();
                            (inverse * turned).dot(&direction)
                        }
                    };
                }
                self.rows.target[row] = match (&turn, c.target) {
                    (None, Target::Position(world)) => {
                        let rest = model.shell.mesh.positions[c.vertex as usize];
                        let goal = direction.dot(&(to_frame * (world - pose.origin) - rest));
                        let held = self.rows.along(row, &self.motion.q);
                        if share == 1.0 { goal } else { held + share * (goal - held) }
                    }
                    (Some((missing, ..)), _) => direction.dot(missing) + self.rows.along(row, &self.next),
                    _ => continue,
                };
                row += 1;
            }
        }
        self.rows.reach = REACH * model.shell.mesh.size * model.shell.total_mass.sqrt();
    }

    /// The largest component of a turn that hard orientations still miss, by the rows as set about the next q, rad.
    fn missing_turn_of_rows(&self) -> f64 {
        let (mut row, mut largest) = (0, 0.0f64);
        for (c, _) in self.constraints.report() {
            for _ in c.axes.iter().filter(|held| **held) {
                if matches!(c.target, Target::Orientation(_)) && c.compliance == 0.0 {
                    largest = largest.max((self.rows.target[row] - self.rows.along(row, &self.next)).abs());
                }
                row += 1;
            }
        }
        largest
    }

    /// Sets −Σ μ ∂²c/∂q², c the left sides of the constraints about the next q, by differences: their part of the Hessian under
    /// forces μ. In the room of the viscosity, which a step makes anew.
    fn set_curvature(&mut self, at: (&Model, &ReducedShell, &Pose), share: f64, force: &DVector<f64>) {
        let shell = &at.0.shell;
        let step = DIFFERENCE * shell.mesh.size * shell.total_mass.sqrt();
        self.viscosity.fill(0.0);
        for k in 0..self.next.len() {
            let here = self.next[k];
            for side in [step, -step] {
                self.next[k] = here + side;
                self.set_rows(at, share);
                self.viscosity.column_mut(k).gemv(-0.5 / side, &self.rows.jacobian, force, 1.0);
            }
            self.next[k] = here;
        }
        let transpose = self.viscosity.transpose();
        self.viscosity += transpose;
        self.viscosity *= 0.5;
    }

    /// Takes down how constraints were met.
    fn conclude(&mut self, (model, reduced, pose): (&Model, &ReducedShell, &Pose)) {
        let Self { rows, rings, newton, constraints, next, .. } = self;
        let force = newton.multipliers();
        let mut row = 0;
        for at in 0.. {
            let Some((c, _)) = constraints.report().nth(at) else { break };
            let axes = c.axes;
            let turn = match c.target {
                Target::Position(_) => None,
                Target::Orientation(world) => {
                    let ring = ring_of(rings, model, c.vertex);
                    let present = pose.rotation * ring.rotation(&places(model, reduced, ring, next));
                    Some((world * present.inverse()).scaled_axis())
                }
            };
            let mut outcome = Outcome { iterations: 1, ..Outcome::default() };
            let mut missing = Vec3::zeros();
            for axis in (0..3).filter(|axis| axes[*axis]) {
                outcome.force[axis] = force[row];
                missing[axis] = turn.map_or_else(|| rows.target[row] - rows.along(row, next), |turn| turn[axis]);
                row += 1;
            }
            outcome.residual = wide_norm(&missing);
            constraints.conclude(at, outcome);
        }
    }

    /// The static solution under the present loads and constraints, from the present shape; what depends on the shape is taken as there.
    /// Returns residual and iterations. Changes nothing on failure.
    pub fn settle(&mut self, model: &Model, load: &BodyLoad, external: External, pose: &Pose) -> Result<(f64, usize)> {
        let reduced = of(model)?;
        self.set_force(reduced, load, external);
        if let Some((gradient, coriolis)) = load.parts().1 {
            reduced.add_spin(gradient, coriolis, (&self.motion.q, &self.motion.q_dot), &mut self.force);
        }
        self.next.copy_from_slice(&self.motion.q);
        reduced.energy.gradient(&self.motion.q, self.newton.scratch(), &mut self.rates);
        let start = self.rates.clone();
        self.last.copy_from_slice(&self.next);
        let turned = self.holds_orientations();
        let (mut done, mut way, mut iterations) = (0.0, FIRST_SHARE, 0);
        let mut torque = DVector::zeros(self.rows.len());
        let mut last_torque = torque.clone();
        loop {
            let share = f64::min(done + way, 1.0);
            (0..start.len()).for_each(|k| self.load[k] = start[k] + share * (self.force[k] - start[k]));
            let stop = if share < 1.0 { Stop { tolerance: 1e-3, ..REST } } else { REST };
            let (mut rounds, mut changed, mut last_moved) = (0, true, f64::INFINITY);
            let mut end = End { converged: true, iterations: 0, residual: 0.0 };
            // Orientations are held to first order about the last round's shape, and their curvature counts under the last round's
            // torques (Robinson 1972): without it a round gains nothing where these are as stiff as the shell.
            while changed && end.converged && rounds < ROUNDS {
                let before = self.next.clone();
                let mut load = DVector::from_column_slice(&self.load);
                if turned {
                    self.set_curvature((model, reduced, pose), share, &torque);
                    load.gemv(1.0, &self.viscosity, &DVector::from_column_slice(&before), 1.0);
                }
                self.set_rows((model, reduced, pose), share);
                let handles = (!self.rows.is_empty()).then_some(&self.rows);
                let matrix = turned.then_some(&self.viscosity);
                let potential = Potential { handles, matrix, ..Potential::of_load(load.as_slice()) };
                end = self.newton.minimize(&reduced.energy, &potential, &mut self.next, stop);
                iterations += end.iterations;
                torque.copy_from(self.newton.multipliers());
                let [moved, size] = [Some(&before), None].map(|from| {
                    let part = |k: usize| self.next[k] - from.map_or(0.0, |from| from[k]);
                    (0..self.next.len()).map(|k| part(k).powi(2)).sum::<f64>().sqrt()
                });
                // Rounding of the fields' numbers ends what rounds gain; one that gains nothing before is taken half the way.
                let stalled = moved > STALLED * last_moved;
                let ended = stalled && moved <= ROUNDED * size && {
                    self.set_rows((model, reduced, pose), share);
                    self.missing_turn_of_rows() <= ROUNDED
                };
                changed = turned && moved > stop.tolerance * size && !ended;
                if changed && stalled {
                    self.next.iter_mut().zip(&before).for_each(|(next, before)| *next = 0.5 * (*next + before));
                }
                last_moved = moved;
                rounds += 1;
            }
            let found = end.converged && !changed && Self::has_meaning(model, &self.next, &[]);
            if found && share == 1.0 {
                self.conclude((model, reduced, pose));
                self.motion.q.copy_from_slice(&self.next);
                self.stop();
                self.constraints.accept();
                return Ok((end.residual, iterations));
            }
            if found {
                self.last.copy_from_slice(&self.next);
                last_torque.copy_from(&torque);
                (done, way) = (share, (2.0 * way).min(FIRST_SHARE));
            } else if way > LEAST_SHARE && iterations < ALL_ITERATIONS {
                self.next.copy_from_slice(&self.last);
                torque.copy_from(&last_torque);
                way = 0.5 * (share - done);
            } else {
                let message =
                    format!("no equilibrium: the residual is {:.1e} after {iterations} iterations", end.residual);
                return Err(Error::new(ErrorKind::Numerical, message));
            }
        }
    }

    /// Hands J g of every vertex to `visit`, in order: see the text of `certify`. `grips` are the forces of constraints.
    pub fn visit_acceleration(
        &self,
        model: &Model,
        load: &BodyLoad,
        external: External,
        grips: &[(u32, [Vec3; 2])],
        visit: impl FnMut(usize, Vec3),
    ) {
        let Some(reduced) = &model.reduced else { return };
        let Motion { q, q_dot, .. } = &self.motion;
        let mut probe = self.clone();
        probe.set_force(reduced, load, external);
        if let Some((gradient, coriolis)) = load.parts().1 {
            reduced.add_spin(gradient, coriolis, (q, q_dot), &mut probe.force);
        }
        reduced.energy.gradient(q, probe.newton.scratch(), &mut probe.rates);
        for (k, g) in probe.force.iter_mut().enumerate() {
            let at = |v: u32| with_fields!(&reduced.fields, fields => fields.at(k, v as usize));
            let held = |(v, [force, torque]): &(u32, [Vec3; 2])| {
                let mut work = at(*v).dot(force);
                if *torque != Vec3::zeros() {
                    let ring = ring_of(&mut probe.rings, model, *v);
                    let by_vertex = ring.turn(&places(model, reduced, ring, q)).1;
                    work += by_vertex.iter().zip(&ring.vertices).map(|(by, v)| torque.dot(&(by * at(*v)))).sum::<f64>();
                }
                work
            };
            *g += grips.iter().map(held).sum::<f64>() - probe.rates[k];
        }
        self.visit(model, &probe.force, visit);
    }

    /// Takes the pose and the rates nearest to `u` and `rate` (n_vertices) in the mass norm: BᵀMu and BᵀMu̇, and again of what is left,
    /// because B is rounded.
    pub fn follow(&mut self, model: &Model, u: &[Vec3], rate: &[Vec3]) -> Result<()> {
        let reduced = of(model)?;
        let mut motion = Motion::rest(reduced.n());
        for _ in 0..PROJECTIONS {
            let mut left = [u.to_vec(), rate.to_vec()];
            let take = |v: usize, x: Vec3, x_dot: Vec3| {
                left[0][v] = (left[0][v] - x) * model.shell.mass[v];
                left[1][v] = (left[1][v] - x_dot) * model.shell.mass[v];
            };
            with_fields!(&reduced.fields, fields => fields.motion(&motion.q, &motion.q_dot, &mut { take }));
            with_fields!(&reduced.fields, fields => fields.project(&left[0], &mut motion.q));
            with_fields!(&reduced.fields, fields => fields.project(&left[1], &mut motion.q_dot));
        }
        if !Self::has_meaning(model, &motion.q, &motion.q_dot) {
            return Err(Error::new(ErrorKind::Numerical, "the pose is beyond what the fields can tell"));
        }
        self.motion = motion;
        Ok(())
    }

    /// ½ q̇ᵀq̇ and E.
    pub fn energies(&self, model: &Model) -> (f64, f64) {
        let elastic = |reduced: &ReducedShell| reduced.energy.value(&self.motion.q, &mut reduced.energy.scratch());
        let kinetic: f64 = self.motion.q_dot.iter().map(|v| v * v).sum();
        (model.reduced.as_ref().map_or(0.0, elastic), 0.5 * kinetic)
    }

    /// u of every vertex.
    pub fn displacements(&self, model: &Model) -> Vec<Vec3> {
        let mut u = vec![Vec3::zeros(); model.shell.mass.len()];
        self.visit(model, &self.motion.q, |v, displacement| u[v] = displacement);
        u
    }

    fn visit(&self, model: &Model, q: &[f64], visit: impl FnMut(usize, Vec3)) {
        if let Some(reduced) = &model.reduced {
            with_fields!(&reduced.fields, fields => fields.displacements(q, visit));
        }
    }

    /// Hands displacement u and its rate (frame axes) of every vertex to `place`, in order.
    pub fn visit_motion(&self, model: &Model, mut place: impl FnMut(usize, Vec3, Vec3)) {
        let Some(reduced) = &model.reduced else { return };
        with_fields!(&reduced.fields, fields => fields.motion(&self.motion.q, &self.motion.q_dot, &mut place));
    }

    /// Hands the position of every vertex to `write`, in order.
    pub fn positions(&self, model: &Model, placement: &Placement, mut write: impl FnMut(usize, Vec3)) {
        let rest = &model.shell.mesh.positions;
        self.visit(model, &self.motion.q, |v, u| write(v, placed(placement, rest[v] + u)));
    }

    /// Hands the positions of `vertices` alone to `write`: the place in the list, and the row.
    pub fn positions_of(
        &self,
        model: &Model,
        placement: &Placement,
        vertices: &[u32],
        mut write: impl FnMut(usize, [f64; 3]),
    ) {
        let Some(reduced) = &model.reduced else { return };
        let rest = |i: usize| model.shell.mesh.positions[vertices[i] as usize];
        let place = |i: usize, u: Vec3| write(i, placed(placement, rest(i) + u).into());
        with_fields!(&reduced.fields, fields => fields.displacements_of(&self.motion.q, vertices, place));
    }

    /// As [`Reduced::positions_of`], for [`Reduced::positions_f32`].
    pub fn positions_of_f32(
        &self,
        model: &Model,
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        let Some(reduced) = &model.reduced else { return };
        with_fields!(&reduced.fields, fields => fields.positions_of_f32(&self.motion.q, placement, vertices, write));
    }

    /// As [`Reduced::positions`], in the fields' precision and rounded to f32, some rows at a time.
    pub fn positions_f32(&self, model: &Model, placement: &Placement, write: impl FnMut(usize, &[[f32; 3]])) {
        if let Some(reduced) = &model.reduced {
            with_fields!(&reduced.fields, fields => fields.positions_f32(&self.motion.q, placement, write));
        }
    }

    /// How far it is bent; `limit` is an angle.
    pub fn extent(&self, model: &Model, limit: f64) -> Extent {
        nodal::extent(&model.shell.mesh, &self.displacements(model), limit)
    }

    /// Rotation of each vertex from rest.
    pub fn rotations(&self, model: &Model) -> Vec<UnitQuaternion<f64>> {
        nodal::rotations(&model.shell.mesh, &self.displacements(model))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// y' = λy, of one step.
    fn growth(z: Complex<f64>) -> Complex<f64> {
        let one = Complex::from(1.0);
        let first = one / (one - z * GAMMA);
        (one + (first - one) * ONWARD) / (one - z * GAMMA)
    }

    #[test]
    fn a_step_is_exact_to_second_order_and_takes_little_of_what_it_resolves() {
        for z in [Complex::new(0.0, 1e-2), Complex::new(-1e-2, 0.0), Complex::new(-6e-3, 8e-3)] {
            // By the series of R(z) eᶻ is missed by (1/6 − 3γ² + 2γ³) z³.
            let missed = (growth(z) - z.exp()).norm() / 1e-6;
            assert!((missed - 0.0404).abs() < 1e-3, "{z}: {missed}");
        }
        let theta = 0.1f64;
        let taken = 1.0 - growth(Complex::new(0.0, theta)).norm();
        assert!((taken * 270.0 / theta.powi(4) - 1.0).abs() < 0.02, "{taken}");
    }

    /// With λh along the imaginary axis and the negative real one.
    #[test]
    fn nothing_grows_that_does_not_grow_by_itself_and_what_is_stiff_dies_at_once() {
        for k in -30..=60 {
            let size = 10f64.powf(f64::from(k) / 10.0);
            for z in [Complex::new(0.0, size), Complex::new(-size, 0.0)] {
                assert!(growth(z).norm() <= 1.0 + 1e-15, "{z}");
                assert!(size < 100.0 || growth(z).norm() < 5.0 / size, "{z}"); // R → (1 − 2γ)/(γ²z)
            }
        }
    }
}

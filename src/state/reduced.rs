//! Motion of the reduced discrete shell by backward differences (Curtiss, Hirschfelder 1952): q̇⁺ is the slope at the end of the step of
//! the polynomial through q⁺ and what was before, and q̈⁺ the same of q̇. Of steps that are alike it is 0.52 of the parabola's, BDF2, and 0.48
//! of the cubic's, BDF3 (BDF2opt of Vatsa, Carpenter, Lockard 2010): still stable for all that does not grow by itself, with half of BDF2's
//! error and a twenty-fifth of its damping of slow swings; what the step does not resolve is damped. Where the last two steps were not alike
//! it is BDF2; the first step, and one that is more than twice the last, is backward Euler's.
//!
//! The end of a step is the minimum of a potential, found by Newton's method ([`crate::reduced::Newton`]) from q + h q̇ or, where the
//! potential is lower, q. A search that ends short of it is made anew for backward Euler's potential: that is no higher at its end than at
//! q, so a step that ends short gains no energy but what loads and handles put in.
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
use nalgebra::{DMatrix, UnitQuaternion};

/// BDF2 is stable for steps up to 1 + √2 times the last.
const LARGEST_RATIO: f64 = 2.0;
/// Steps are alike within this share of the earlier one; and the share of BDF3 then.
const ALIKE: f64 = 0.1;
const CUBIC: f64 = 0.48;
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
/// Rounds about the last shape for the orientations of an equilibrium.
const ROUNDS: usize = 30;
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
    /// Those before the last step, and before the one before it; how many seconds these took, 0 if there were none.
    pub before: [[Vec<f64>; 2]; 2],
    pub last_steps: [f64; 2],
}

impl Motion {
    fn rest(n: usize) -> Self {
        let none = || [vec![0.0; n], vec![0.0; n]];
        let [q, q_dot] = none();
        Self { q, q_dot, before: [none(), none()], last_steps: [0.0; 2] }
    }

    /// What comes next does not follow from what was before.
    fn stop(&mut self) {
        self.q_dot.fill(0.0);
        self.last_steps = [0.0; 2];
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
    /// What q⁺ does not change of q̇⁺ and q̈⁺.
    constant: [Vec<f64>; 2],
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

/// What q⁺, q, q₋₁ and q₋₂ count in q̇⁺.
type Slope = [f64; 4];

fn backward_euler(h: f64) -> Slope {
    [1.0 / h, -1.0 / h, 0.0, 0.0]
}

/// For a step of `h` after steps of these lengths, the last one first.
fn slope_after(h: f64, [last, earlier]: [f64; 2]) -> Slope {
    if !(last > 0.0 && h <= LARGEST_RATIO * last) {
        return backward_euler(h);
    }
    let parabola = slope_of([h, h + last]);
    let alike = |a: f64, b: f64| (a - b).abs() <= ALIKE * b;
    if !(alike(h, last) && alike(last, earlier)) {
        return parabola;
    }
    let cubic = slope_of([h, h + last, h + last + earlier]);
    std::array::from_fn(|k| parabola[k] + CUBIC * (cubic[k] - parabola[k]))
}

/// Of the polynomial through the end and points at these times before it, the slope at the end.
fn slope_of<const N: usize>(back: [f64; N]) -> Slope {
    let mut slope = [0.0; 4];
    slope[0] = back.iter().map(|t| 1.0 / t).sum();
    for (j, t) in back.iter().enumerate() {
        let others = (0..N).filter(|m| *m != j).map(|m| back[m] / (back[m] - t));
        slope[j + 1] = -others.product::<f64>() / t;
    }
    slope
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
            constant: [zeros.clone(), zeros],
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

    /// No speed, and no step before.
    pub fn stop(&mut self) {
        self.motion.stop();
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
        8 * (2 * n * n + 17 * n + rows * (2 * n + rows + 4))
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
        self.set_force(reduced, load, external);
        self.next.copy_from_slice(&self.motion.q);
        self.set_rows((model, reduced, pose), 1.0);
        let slope = slope_after(h, self.motion.last_steps);
        self.newton.take_work();
        let mut converged = self.advance((model, reduced, pose), load, h, slope)?;
        if !converged && slope != backward_euler(h) {
            converged = self.advance((model, reduced, pose), load, h, backward_euler(h))?;
        }
        let work = self.conclude((model, reduced, pose));
        let told = (self.constraint_work + work).is_finite() && self.constraints.is_finite();
        if !told || !Self::has_meaning(model, &self.next, &self.rates) {
            return Err(Error::new(
                ErrorKind::Numerical,
                format!("the step of {h:?} s does not give finite positions"),
            ));
        }
        let Motion { q, q_dot, before, last_steps } = &mut self.motion;
        before.swap(0, 1);
        for (now, (before, next)) in [q, q_dot].into_iter().zip(before[0].iter_mut().zip([&self.next, &self.rates])) {
            before.copy_from_slice(now);
            now.copy_from_slice(next);
        }
        *last_steps = [h, last_steps[0]];
        self.constraint_work += work;
        self.unconverged += u64::from(!converged);
        self.work = self.newton.take_work();
        self.constraints.accept();
        Ok(())
    }

    /// Sets the next q and its rates for a step of `h` with this slope. Returns whether the search converged.
    fn advance(&mut self, at: (&Model, &ReducedShell, &Pose), load: &BodyLoad, h: f64, slope: Slope) -> Result<bool> {
        let reduced = at.1;
        let alpha = self.set_constants(slope);
        let shift = alpha * (alpha + self.damping.mass);
        let damped = self.set_viscosity(reduced);
        let Motion { q, q_dot, .. } = &self.motion;
        (0..q.len()).for_each(|k| self.next[k] = q[k] + h * q_dot[k]);
        let turned = self.holds_orientations();
        let passes = if turned || load.spin_rate().is_some() { PASSES } else { 1 };
        if damped {
            self.viscosity *= alpha;
        }
        let (mut converged, mut gained, mut size) = (true, [0.0; PASSES], 0.0);
        for (pass, gained) in gained[..passes].iter_mut().enumerate() {
            self.last.copy_from_slice(&self.next);
            if turned && pass > 0 {
                self.set_rows(at, 1.0);
            }
            let Motion { q, .. } = &self.motion;
            let [by_rate, by_acceleration] = &self.constant;
            let (_, spin) = load.parts();
            self.load.copy_from_slice(&self.force);
            if let Some((gradient, coriolis)) = spin {
                (0..q.len()).for_each(|k| self.rates[k] = alpha * self.next[k] + by_rate[k]);
                reduced.add_spin(gradient, coriolis, (&self.next, &self.rates), &mut self.load);
            }
            for k in 0..q.len() {
                self.load[k] -= by_acceleration[k] + (alpha + self.damping.mass) * by_rate[k];
                if damped {
                    let viscous: f64 = self.viscosity.column(k).iter().zip(by_rate).map(|(c, v)| c * v).sum();
                    self.load[k] -= viscous / alpha;
                }
            }
            let handles = (!self.rows.is_empty()).then_some(&self.rows);
            let matrix = damped.then_some(&self.viscosity);
            let potential = Potential { shift, matrix, load: &self.load, handles };
            if pass == 0 && !self.newton.is_lower(&reduced.energy, &potential, &self.next, q) {
                self.next.copy_from_slice(q);
            }
            let stop = Stop { near: pass > 0, ..STEP };
            converged = self.newton.minimize(&reduced.energy, &potential, &mut self.next, stop).converged;
            *gained = self.next.iter().zip(&self.last).map(|(a, b)| (a - b).powi(2)).sum();
            size = self.next.iter().map(|q| q * q).sum();
            let moved: f64 = self.next.iter().zip(q).map(|(next, q)| (next - q).powi(2)).sum();
            if *gained <= ENOUGH * ENOUGH * moved {
                break;
            }
        }
        // The first pass makes up for the guess; from the second on only the frame's forces change.
        if let Some(rate) = load.spin_rate().filter(|_| gained[PASSES - 1] > gained[1].max(SETTLED * SETTLED * size)) {
            let turn = rate * h;
            let message =
                format!("the forces of a frame that turns by {turn:.1e} rad in a step of {h:?} s do not settle");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        (0..self.next.len()).for_each(|k| self.rates[k] = alpha * self.next[k] + self.constant[0][k]);
        Ok(converged)
    }

    /// Sets c of q̇⁺ = α q⁺ + c and q̈⁺ = α q̇⁺ + c; returns α.
    fn set_constants(&mut self, [alpha, now, last, earlier]: Slope) -> f64 {
        let Motion { q, q_dot, before: [b, c], .. } = &self.motion;
        for (constant, (a, (b, c))) in self.constant.iter_mut().zip([q, q_dot].into_iter().zip(b.iter().zip(c))) {
            (0..a.len()).for_each(|k| constant[k] = now * a[k] + last * b[k] + earlier * c[k]);
        }
        alpha
    }

    /// The damping beside ξ, at the start of the step; false if there is none.
    fn set_viscosity(&mut self, reduced: &ReducedShell) -> bool {
        let zeta = self.damping.stiffness;
        let modal = self.modal_damping.iter().any(|c| *c > 0.0);
        if zeta > 0.0 {
            reduced.energy.viscosity(&self.motion.q, self.newton.scratch(), &mut self.viscosity);
            self.viscosity *= zeta;
        } else if modal {
            self.viscosity.fill(0.0);
        }
        self.modal_damping.iter().enumerate().for_each(|(k, c)| self.viscosity[(k, k)] += c);
        zeta > 0.0 || modal
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

    /// Takes down how constraints were met; returns the work done.
    fn conclude(&mut self, (model, reduced, pose): (&Model, &ReducedShell, &Pose)) -> f64 {
        let Self { rows, rings, newton, constraints, next, motion, .. } = self;
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
        (0..rows.len()).map(|i| force[i] * (rows.along(i, next) - rows.along(i, &motion.q))).sum()
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
        loop {
            let share = f64::min(done + way, 1.0);
            (0..start.len()).for_each(|k| self.load[k] = start[k] + share * (self.force[k] - start[k]));
            let stop = if share < 1.0 { Stop { tolerance: 1e-3, ..REST } } else { REST };
            let (mut rounds, mut changed) = (0, true);
            let mut end = End { converged: true, iterations: 0, residual: 0.0 };
            // Orientations are held to first order about the last round's shape.
            while changed && end.converged && rounds < ROUNDS {
                self.set_rows((model, reduced, pose), share);
                let handles = (!self.rows.is_empty()).then_some(&self.rows);
                let potential = Potential { handles, ..Potential::of_load(&self.load) };
                let before = self.next.clone();
                end = self.newton.minimize(&reduced.energy, &potential, &mut self.next, stop);
                iterations += end.iterations;
                let [moved, size] = [Some(&before), None].map(|from| {
                    let part = |k: usize| self.next[k] - from.map_or(0.0, |from| from[k]);
                    (0..self.next.len()).map(|k| part(k).powi(2)).sum::<f64>().sqrt()
                });
                changed = turned && moved > stop.tolerance * size;
                rounds += 1;
            }
            let found = end.converged && !changed && Self::has_meaning(model, &self.next, &[]);
            if found && share == 1.0 {
                self.conclude((model, reduced, pose));
                self.motion.q.copy_from_slice(&self.next);
                self.motion.stop();
                self.constraints.accept();
                return Ok((end.residual, iterations));
            }
            if found {
                self.last.copy_from_slice(&self.next);
                (done, way) = (share, (2.0 * way).min(FIRST_SHARE));
            } else if way > LEAST_SHARE && iterations < ALL_ITERATIONS {
                self.next.copy_from_slice(&self.last);
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

    /// Of t, t² and t³ before and at the end of a step that begins at 1.
    #[test]
    fn slopes_are_exact_to_second_order_with_half_of_the_error_of_bdf2() {
        for (h, last, earlier) in [(0.1, 0.1, 0.1), (0.1, 0.093, 0.1), (0.1, 0.07, 0.1), (0.1, 0.1, 0.0)] {
            let t = [1.0 + h, 1.0, 1.0 - last, 1.0 - last - earlier];
            let slope = slope_after(h, [last, earlier]);
            let of = |n: i32| (0..4).map(|k| slope[k] * t[k].powi(n)).sum::<f64>();
            assert!((of(0)).abs() < 1e-12 && (of(1) - 1.0).abs() < 1e-12 && (of(2) - 2.0 * t[0]).abs() < 1e-12);
            let bdf2 = slope_of([h, h + last]);
            let error = |slope: Slope| (0..4).map(|k| slope[k] * t[k].powi(3)).sum::<f64>() - 3.0 * t[0] * t[0];
            let share = if earlier == 0.1 && last > 0.09 { 1.0 - CUBIC } else { 1.0 };
            assert!((error(slope) / error(bdf2) - share).abs() < 1e-9);
        }
    }

    /// y' = λy with λh along the imaginary axis and the negative real one, and steps that change by as much as is alike.
    #[test]
    fn nothing_grows_that_does_not_grow_by_itself() {
        for k in -30..=30 {
            let size = 10f64.powf(f64::from(k) / 10.0);
            for lambda in [Complex::new(0.0, size), Complex::new(-size, 0.0)] {
                for uneven in [0.0, 0.04] {
                    let step = |n: usize| if n.is_multiple_of(2) { 1.0 + uneven } else { 1.0 - uneven };
                    let mut y = [Complex::new(1.0, 0.0); 3];
                    for n in 2..4000 {
                        let [a, b, c, d] = slope_after(step(n), [step(n - 1), step(n - 2)]);
                        y = [-(y[0] * b + y[1] * c + y[2] * d) / (Complex::from(a) - lambda), y[0], y[1]];
                        assert!(y[0].norm() < 1.5, "{lambda}, {uneven}, step {n}: {}", y[0].norm());
                    }
                }
            }
        }
    }
}

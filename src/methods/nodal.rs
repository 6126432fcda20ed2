//! Motion vertex by vertex: the nonlinear discrete shell, the baseline that modal methods are measured against.

mod carried;
mod rest;
mod stages;

use super::plan::{AS_BEFORE, Around, BEFORE_ANY, FORCE_VERTEX, ITERATIONS, Part, PartKind};
use super::{Acting, Damping, Motion, ROTATION_RANGE, Reaction, Watch, WriteRotation, unsupported, write_rotations};
use crate::constraint::{ConstraintSet, Outcome};
use crate::features::{Feature, NonlinearShell, Proof};
use crate::method::Method;
use crate::modal::ModalBasis;
use crate::modes::supported;
use crate::reference::{Rayleigh, Solver, vertex_rotations};
use crate::step::Integrator;
use crate::support::Pose;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Mesh, Model, Result, Shell, Vec3};
use carried::Carried;
use nalgebra::UnitQuaternion;
use std::sync::Arc;

/// Past this displacement, in units of the model's size, a shell has no meaning left; its energy has room for the fourth power.
const LARGEST_DISPLACEMENT: f64 = 1e30;
/// Of an element of the nonlinear shell in an explicit step.
const EXPLICIT_ELEMENT: f64 = 275.0;
/// Of an iteration of its implicit step: of an element, a multiplication of the factorization, an entry of the factor.
const IMPLICIT_STEP: [f64; 3] = [4300.0, 2.0, 4.0];

/// Displacements and velocities in frame axes, with the solver and its scratch.
struct Nodal {
    shell: Arc<Shell>,
    fingerprint: u64,
    solver: Solver,
    explicit: bool,
    /// Implicit steps have two stages where they can.
    second_order: bool,
    damping: Rayleigh,
    /// Whose slowest swing has the damping ratio.
    modal: Arc<ModalBasis>,
    /// What ξ is multiplied by at each vertex, or none.
    factors: Arc<[f64]>,
    constraints: ConstraintSet,
    /// Supported vertices with mass, ascending.
    supported: Arc<[u32]>,
    /// On a rest shape that moves.
    carried: Option<Carried>,
    u: Vec<Vec3>,
    velocity: Vec<Vec3>,
    /// Linear solves of the last step; 0 before one.
    iterations: usize,
    force: Vec<Vec3>,
    /// u and the velocity before the step.
    before: [Vec<Vec3>; 2],
    /// Of the step that led from `before` to u; 0 where none did.
    stepped: f64,
    /// What that step got wrong, where it had two stages.
    missed: Option<f64>,
    /// Whether u is a pose that modes or fields had.
    foreign: bool,
}

/// At rest, undamped. Fails when memory does not suffice for the factorization's analysis.
pub fn build(model: &Model, method: Method, integrator: Integrator) -> Result<Box<dyn Motion>> {
    let _proof: NonlinearShell = Proof::of(Feature::NonlinearShell)?;
    let zeros = vec![Vec3::zeros(); model.shell.mass.len()];
    Ok(Box::new(Nodal {
        shell: model.shell.clone(),
        fingerprint: model.fingerprint,
        solver: Solver::new(model.shell.clone())?,
        explicit: method == Method::ExplicitShell,
        second_order: method == Method::ImplicitShell && integrator == Integrator::SecondOrder,
        damping: Rayleigh::default(),
        modal: model.modal.clone(),
        factors: Arc::default(),
        constraints: ConstraintSet::default(),
        supported: supported(&model.shell).into(),
        carried: None,
        iterations: 0,
        u: zeros.clone(),
        velocity: zeros.clone(),
        force: zeros.clone(),
        before: [zeros.clone(), zeros],
        stepped: 0.0,
        missed: None,
        foreign: false,
    }))
}

impl Nodal {
    fn set_force(&mut self, Acting { load, external, .. }: &Acting) -> Result<()> {
        let shell = &self.shell;
        for v in 0..self.force.len() {
            let r = shell.mesh.positions[v] + self.u[v];
            self.force[v] = load.at(shell.mass[v], r, self.velocity[v]);
            if let Some(forces) = external.on_all() {
                self.force[v] += forces[v];
            }
        }
        external.point_forces().for_each(|(v, force)| self.force[v as usize] += force);
        for (v, force) in self.force.iter().enumerate() {
            if !force.iter().all(|c| c.is_finite()) {
                return Err(Error::new(ErrorKind::Numerical, format!("the load on vertex {v} is not finite")));
            }
        }
        Ok(())
    }

    /// Gives the solver the constraints, in frame axes, with hard targets at a share of their way in the step.
    fn pass_constraints(&mut self, pose: &Pose, share: f64) -> Result<()> {
        let mut constraints = self.seen_constraints(pose);
        if share < 1.0 {
            constraints.iter_mut().filter(|c| c.compliance == 0.0).for_each(|c| self.lead_part_way(c, share));
        }
        self.solver.set_constraints(*pose.rotation.inverse().to_rotation_matrix().matrix(), constraints, &self.u)
    }

    /// As [`Motion::step`]; what changed when it fails is in `before`.
    fn try_step(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.follow(acting.axes.each)?;
        self.set_force(acting)?;
        self.solver.share_damping(&self.factors);
        self.resist(acting.external.drag());
        self.missed = None;
        if self.takes_stages(acting)
            && let Some(stages) = self.stages(acting, h)?
        {
            self.missed = Some(stages.missed);
            return self.end_step((stages.iterations, stages.work), h);
        }
        self.move_supports(acting, Some(h));
        self.turn_out();
        self.solver.join(self.seen_points(acting.points));
        self.pass_constraints(acting.axes.frame, 1.0)?;
        let Self { solver, explicit, damping, u, velocity, force, .. } = self;
        let iterations = if *explicit {
            solver.symplectic_euler(u, velocity, force, *damping, h)?;
            1
        } else {
            if acting.again {
                solver.step_again();
            }
            solver.implicit_euler(u, velocity, force, *damping, h)?.iterations
        };
        self.turn_in();
        let work = self.record_outcomes(iterations);
        self.end_step((iterations, work), h)
    }

    /// Takes a step down, with the work of constraints.
    fn end_step(&mut self, (iterations, work): (usize, f64), h: f64) -> Result<()> {
        let finite = (self.constraints.work + work).is_finite() && self.constraints.is_finite();
        if finite && self.is_within_range(&self.u, &self.velocity) {
            self.constraints.accept(work);
            self.iterations = iterations;
            return Ok(());
        }
        let advice = if self.explicit { ": take shorter steps" } else { "" };
        let message = format!("the step of {h:?} s moves the shell beyond all range{advice}");
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// Puts supports where they go, in a step of `h` or at rest.
    fn move_supports(&mut self, acting: &Acting, h: Option<f64>) {
        let Some(to) = acting.supports else { return };
        let h = h.filter(|_| !to.jump);
        for (v, d) in self.supported.iter().map(|v| *v as usize).zip(to.displacement) {
            self.velocity[v] = h.map_or(Vec3::zeros(), |h| (d - self.u[v]) / h);
            self.u[v] = *d;
        }
    }

    /// Takes down what the solver made of the constraints; returns the work done by them.
    fn record_outcomes(&mut self, iterations: usize) -> f64 {
        let (outcomes, work) = self.solver.outcomes();
        let iterations = iterations.max(1) as u32;
        for ((_, pending), outcome) in self.constraints.pending().zip(outcomes) {
            *pending = Outcome { iterations, ..*outcome };
        }
        work
    }

    /// Whether positions and energies are numbers.
    fn is_within_range(&self, u: &[Vec3], velocity: &[Vec3]) -> bool {
        let largest = LARGEST_DISPLACEMENT * self.shell.mesh.size;
        let kinetic: f64 = self.shell.mass.iter().zip(velocity).map(|(m, v)| m * v.norm_squared()).sum();
        kinetic.is_finite() && u.iter().flatten().all(|c| c.abs() <= largest)
    }

    /// Creases that are bent beyond their yield angle rest at another one from here on.
    fn yield_creases(&mut self) {
        let place = |v: u32| self.shell.mesh.positions[v as usize] + self.u[v as usize];
        if let Some(angles) = self.shell.energy.yielding().and_then(|energy| energy.yielded(place)) {
            self.set_rest_angles(&angles);
        }
    }

    fn n_rest_angles(&self) -> usize {
        self.shell.energy.yielding().map_or(0, |energy| energy.rest_angles().len())
    }

    fn position(&self, placement: &Placement, v: usize) -> Vec3 {
        placement.place(self.shell.mesh.positions[v] + self.u[v])
    }
}

impl Motion for Nodal {
    fn method(&self) -> Method {
        if self.explicit { Method::ExplicitShell } else { Method::ImplicitShell }
    }

    /// With a solver of its own.
    fn try_clone(&self) -> Result<Box<dyn Motion>> {
        Ok(Box::new(Self {
            shell: self.shell.clone(),
            fingerprint: self.fingerprint,
            solver: Solver::new(self.shell.clone())?,
            explicit: self.explicit,
            second_order: self.second_order,
            damping: self.damping,
            modal: self.modal.clone(),
            factors: self.factors.clone(),
            constraints: self.constraints.clone(),
            supported: self.supported.clone(),
            carried: self.carried.clone(),
            iterations: self.iterations,
            u: self.u.clone(),
            velocity: self.velocity.clone(),
            force: self.force.clone(),
            before: self.before.clone(),
            stepped: self.stepped,
            missed: self.missed,
            foreign: self.foreign,
        }))
    }

    fn reset(&mut self) {
        self.u.fill(Vec3::zeros());
        self.velocity.fill(Vec3::zeros());
        self.constraints.reset();
        self.iterations = 0;
        self.stepped = 0.0;
        self.foreign = false;
        if let Some(made) = self.shell.energy.yielding().map(|energy| energy.made().clone()) {
            self.set_rest_angles(&made);
        }
    }

    fn stop(&mut self) {
        self.stepped = 0.0;
        self.velocity.fill(Vec3::zeros());
    }

    fn step(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.before[0].copy_from_slice(&self.u);
        self.before[1].copy_from_slice(&self.velocity);
        let stepped = self.try_step(acting, h);
        if stepped.is_err() {
            self.u.copy_from_slice(&self.before[0]);
            self.velocity.copy_from_slice(&self.before[1]);
            self.stepped = 0.0;
        } else {
            self.stepped = h;
            self.foreign = false;
            self.yield_creases();
        }
        stepped
    }

    fn settle(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        self.find_rest(acting, watch)
    }

    fn carry(&mut self, axes: Option<&[Pose]>) {
        self.take_axes(axes);
    }

    /// Of the vertices that move; supports stay.
    fn project_from(&mut self, u: &[Vec3], rate: &[Vec3]) -> Result<()> {
        if !self.is_within_range(u, rate) {
            return Err(Error::new(ErrorKind::Numerical, "the pose is beyond all range"));
        }
        self.stepped = 0.0;
        for v in self.shell.free.iter().map(|v| *v as usize) {
            (self.u[v], self.velocity[v]) = (u[v], rate[v]);
        }
        self.shell.project(&mut self.u);
        self.shell.project(&mut self.velocity);
        self.foreign = false;
        Ok(())
    }

    fn comes_from_fields(&self) -> bool {
        self.foreign
    }

    fn come_from_fields(&mut self) {
        self.foreign = self.shell.free.iter().any(|v| self.u[*v as usize] != Vec3::zeros());
    }

    fn step_nanoseconds(&self) -> u64 {
        self.u.len() as u64 * if self.explicit { 300 } else { 20_000 }
    }

    fn feels_start(&self) -> bool {
        self.explicit
    }

    fn share_work(&mut self, sharing: bool) {
        self.solver.share_work(sharing);
    }

    fn follows_supports(&self) -> bool {
        true
    }

    fn place_supports(&mut self, displacement: &[Vec3]) {
        for (v, d) in self.supported.iter().map(|v| *v as usize).zip(displacement) {
            (self.u[v], self.velocity[v]) = (*d, Vec3::zeros());
        }
    }

    fn is_full_shell(&self) -> bool {
        true
    }

    /// Behind the displacements come the rest angles of creases that yield, with zeros for rates.
    fn unknowns(&self) -> [Vec<f64>; 2] {
        let mut unknowns = [vec![], vec![]];
        self.copy_unknowns(&mut unknowns);
        unknowns
    }

    fn copy_unknowns(&self, into: &mut [Vec<f64>; 2]) {
        for (to, from) in into.iter_mut().zip([&self.u, &self.velocity]) {
            to.clear();
            to.extend(from.iter().flatten());
        }
        if let Some(energy) = self.shell.energy.yielding() {
            into[0].extend(energy.rest_angles());
            into[1].resize(self.n_unknowns(), 0.0);
        }
    }

    fn set_unknowns(&mut self, unknowns: [&[f64]; 2]) {
        self.stepped = 0.0;
        self.foreign = false;
        for (field, numbers) in [&mut self.u, &mut self.velocity].into_iter().zip(unknowns) {
            field.iter_mut().zip(numbers.chunks_exact(3)).for_each(|(to, from)| to.copy_from_slice(from));
        }
        self.set_rest_angles(&unknowns[0][3 * self.u.len()..]);
    }

    fn n_unknowns(&self) -> usize {
        3 * self.u.len() + self.n_rest_angles()
    }

    fn rest_angles(&self) -> Vec<f64> {
        self.shell.energy.yielding().map_or(vec![], |energy| energy.rest_angles().to_vec())
    }

    fn set_rest_angles(&mut self, angles: &[f64]) {
        if self.shell.energy.yielding().is_none_or(|energy| energy.rest_angles() == angles) {
            return;
        }
        if let Some(shell) = self.shell.with_rest_angles(angles).map(Arc::new) {
            self.solver.set_shell(shell.clone());
            self.shell = shell;
        }
    }

    fn is_representable(&self, unknowns: [&[f64]; 2]) -> bool {
        let n = 3 * self.u.len();
        let [u, velocity] =
            unknowns.map(|numbers| numbers[..n].chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>());
        self.is_within_range(&u, &velocity) && are_angles(&unknowns[0][n..])
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn set_damping(&mut self, damping: &Damping) -> Result<bool> {
        if damping.ratios.windows(2).any(|two| two[0] != two[1]) {
            return unsupported("damping ratios that differ");
        }
        let by_ratio = damping.uniform_by_ratio(&self.modal.eigenvalues)?;
        let slowest = by_ratio.iter().zip(&self.modal.eigenvalues).find(|(_, lambda)| **lambda > 0.0);
        let mass = damping.mass_coefficient + slowest.map_or(0.0, |(by_ratio, _)| *by_ratio);
        self.damping = Rayleigh { mass, stiffness: damping.stiffness_coefficient };
        self.factors = damping.factors.clone();
        Ok(true)
    }

    fn constraints(&self) -> &ConstraintSet {
        &self.constraints
    }

    fn change_constraints(&mut self, change: &mut dyn FnMut(&mut ConstraintSet)) {
        change(&mut self.constraints);
    }

    fn positions(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f64; 3]])) {
        (0..self.u.len()).for_each(|v| write(v, &[self.position(placement, v).into()]));
    }

    fn positions_f32(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f32; 3]])) {
        (0..self.u.len()).for_each(|v| write(v, &[self.position(placement, v).map(|c| c as f32).into()]));
    }

    fn positions_of(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f64; 3])) {
        let place = |(i, v): (usize, &u32)| write(i, self.position(placement, *v as usize).into());
        vertices.iter().enumerate().for_each(place);
    }

    fn positions_of_f32(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f32; 3])) {
        let place = |(i, v): (usize, &u32)| write(i, self.position(placement, *v as usize).map(|c| c as f32).into());
        vertices.iter().enumerate().for_each(place);
    }

    /// The mean rotation of the vertex's triangles.
    fn rotations(&self, frame: UnitQuaternion<f64>, write: &mut WriteRotation) -> Result<()> {
        let mut turns = vertex_rotations(&self.shell.mesh, &self.bent());
        if let Some(carried) = &self.carried {
            turns.iter_mut().zip(&*carried.axes).for_each(|(turn, axes)| *turn = axes.rotation.inverse() * *turn);
        }
        write_rotations(turns, frame, write)
    }

    fn visit_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        (0..self.u.len()).for_each(|v| visit(v, self.u[v], self.velocity[v]));
    }

    /// None: it is what others are measured by.
    fn visit_acceleration(&self, _: &Acting, _: &[Reaction], _: &mut dyn FnMut(usize, Vec3)) {}

    fn largest_displacement(&self) -> f64 {
        self.u.iter().map(|u| u.amax()).fold(0.0, f64::max)
    }

    fn extent(&self) -> Extent {
        let Some(carried) = &self.carried else { return extent(&self.shell.mesh, &self.u) };
        let turns = vertex_rotations(&self.shell.mesh, &self.bent());
        extent_of(&self.u, turns.iter().zip(&*carried.axes).map(|(turn, axes)| axes.rotation.angle_to(turn)).collect())
    }

    fn energies(&self) -> (f64, f64) {
        let elastic = match self.carried.as_ref().map(|carried| carried.shell(&self.shell)) {
            Some(shell) => shell.map_or(f64::NAN, |shell| shell.energy.value(&self.bent())),
            None => self.shell.energy.value(&self.bent()),
        };
        (elastic, self.solver.kinetic_energy(&self.velocity))
    }

    /// Two stages tell by themselves. Both of Euler's methods move by h² ü where h²/2 ü is right, and the velocity has changed by h ü. Beyond the range of numbers it is the
    /// largest of them.
    fn step_error(&self) -> f64 {
        if self.stepped == 0.0 {
            return 0.0;
        }
        if let Some(missed) = self.missed {
            return missed;
        }
        let changes: Vec<Vec3> = self.velocity.iter().zip(&self.before[1]).map(|(now, before)| now - before).collect();
        let squares = 2.0 * self.solver.kinetic_energy(&changes);
        (0.5 * self.stepped * (squares / self.shell.total_mass).sqrt()).min(f64::MAX)
    }

    fn plan(&self, around: &Around) -> Vec<Part> {
        let mesh = &self.shell.mesh;
        let elements = (mesh.triangles.len() + 2 * mesh.edges.len()) as f64;
        let (operations, reason) = if self.explicit {
            (elements * EXPLICIT_ELEMENT, format!("{elements} elements"))
        } else {
            let [factorization, entries] = self.solver.operations();
            let (iterations, whence) = match self.iterations {
                0 => (ITERATIONS as f64, BEFORE_ANY),
                last => (last as f64, AS_BEFORE),
            };
            let [element, multiplication, entry] = IMPLICIT_STEP;
            let once = elements * element + factorization * multiplication + entries * entry;
            (iterations * once, format!("{elements} elements, {iterations} iterations {whence}"))
        };
        let bytes = 5 * self.u.len() * size_of::<Vec3>() + self.solver.bytes();
        let unused = "the nonlinear shell has no use for modes; the model holds them";
        let loads = around.cheap_loads(["added to each vertex", "added to each vertex while the frame turns"]);
        let own = [
            Part::absent(PartKind::Modes, "the nonlinear shell moves vertex by vertex"),
            around.constraints(&self.constraints, 0),
            Part { kind: PartKind::NonlinearShell, active: true, bytes, operations, reason },
        ];
        let modes = around.unused_modes([unused, unused]);
        let forces = around.forces_and_wind(FORCE_VERTEX, 0.0);
        around.with_the_rest(own.into_iter().chain(modes).chain(loads).chain(forces))
    }
}

/// Whether creases can rest at these angles.
pub(super) fn are_angles(angles: &[f64]) -> bool {
    angles.iter().all(|angle| angle.abs() <= std::f64::consts::PI)
}

/// Rotation of each vertex from rest to the displacements `u`.
pub fn rotations(mesh: &Mesh, u: &[Vec3]) -> Vec<UnitQuaternion<f64>> {
    let x: Vec<Vec3> = mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
    vertex_rotations(mesh, &x)
}

/// How far displacements `u` bend a shell.
pub fn extent(mesh: &Mesh, u: &[Vec3]) -> Extent {
    extent_of(u, rotations(mesh, u).iter().map(|r| r.angle()).collect())
}

/// The same of vertices that turn by `angles`.
fn extent_of(u: &[Vec3], angles: Vec<f64>) -> Extent {
    let displacement = u.iter().map(|u| u.norm_squared()).fold(0.0, f64::max);
    let rotation = angles.iter().fold(0.0, |largest: f64, angle| largest.max(angle * angle));
    Extent { displacement, rotation, beyond: angles.iter().filter(|angle| **angle > ROTATION_RANGE).count() }
}

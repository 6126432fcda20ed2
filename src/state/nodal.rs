//! Motion vertex by vertex: the nonlinear discrete shell, the baseline that modal methods are measured against.

use crate::constraint::{Constraint, ConstraintSet, Outcome, Target};
use crate::load::BodyLoad;
use crate::load::External;
use crate::reference::{self, Handle, Rayleigh, Solver, vertex_rotations};
use crate::support::Pose;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Mesh, Model, Result, Vec3, wide_norm};
use nalgebra::UnitQuaternion;

/// Past this displacement, in units of the model's size, a shell has no meaning left; its energy has room for the fourth power.
const LARGEST_DISPLACEMENT: f64 = 1e30;

/// Displacements and velocities in frame axes, with the solver and its scratch.
pub struct Nodal {
    solver: Solver,
    explicit: bool,
    pub damping: Rayleigh,
    pub constraints: ConstraintSet,
    pub constraint_work: f64,
    pub u: Vec<Vec3>,
    pub velocity: Vec<Vec3>,
    /// Linear solves of the last step; 0 before one.
    iterations: usize,
    force: Vec<Vec3>,
    /// u and the velocity before the step.
    before: [Vec<Vec3>; 2],
}

impl Nodal {
    /// At rest, undamped. Fails when memory does not suffice for the factorization's analysis.
    pub fn new(model: &Model, explicit: bool) -> Result<Self> {
        let zeros = vec![Vec3::zeros(); model.shell.mass.len()];
        Ok(Self {
            solver: Solver::new(model.shell.clone())?,
            explicit,
            damping: Rayleigh::default(),
            constraints: ConstraintSet::default(),
            constraint_work: 0.0,
            iterations: 0,
            u: zeros.clone(),
            velocity: zeros.clone(),
            force: zeros.clone(),
            before: [zeros.clone(), zeros],
        })
    }

    /// The same motion with a solver of its own.
    pub fn try_clone(&self) -> Result<Self> {
        Ok(Self {
            solver: Solver::new(self.solver.shell().clone())?,
            explicit: self.explicit,
            damping: self.damping,
            constraints: self.constraints.clone(),
            constraint_work: self.constraint_work,
            iterations: self.iterations,
            u: self.u.clone(),
            velocity: self.velocity.clone(),
            force: self.force.clone(),
            before: self.before.clone(),
        })
    }

    /// Bytes held, the factorization's included.
    pub fn bytes(&self) -> usize {
        let fields = self.u.len() * size_of::<Vec3>();
        5 * fields + self.solver.bytes()
    }

    /// Linear solves of the last step, or 0; multiplications of a factorization and entries of the factor.
    pub fn operations(&self) -> (usize, [f64; 2]) {
        (self.iterations, self.solver.operations())
    }

    /// Symplectic Euler.
    pub fn is_explicit(&self) -> bool {
        self.explicit
    }

    /// Takes displacements and velocities (n_vertices) of the vertices that move.
    pub fn follow(&mut self, model: &Model, u: &[Vec3], velocity: &[Vec3]) -> Result<()> {
        if !Self::has_meaning(model, u, velocity) {
            return Err(Error::new(ErrorKind::Numerical, "the pose is beyond all range"));
        }
        self.u.fill(Vec3::zeros());
        self.velocity.fill(Vec3::zeros());
        for v in model.shell.free.iter().map(|v| *v as usize) {
            (self.u[v], self.velocity[v]) = (u[v], velocity[v]);
        }
        Ok(())
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.u.fill(Vec3::zeros());
        self.velocity.fill(Vec3::zeros());
        self.constraints.reset();
        self.constraint_work = 0.0;
        self.iterations = 0;
    }

    fn set_force(&mut self, model: &Model, load: &BodyLoad, external: External) -> Result<()> {
        let shell = &model.shell;
        for v in 0..self.force.len() {
            let r = shell.mesh.positions[v] + self.u[v];
            self.force[v] = load.at(shell.mass[v], r, self.velocity[v]);
            if let Some(forces) = external.on_all() {
                self.force[v] += forces[v];
            }
        }
        external.on_some().for_each(|(v, force)| self.force[v as usize] += force);
        for (v, force) in self.force.iter().enumerate() {
            if !force.iter().all(|c| c.is_finite()) {
                return Err(Error::new(ErrorKind::Numerical, format!("the load on vertex {v} is not finite")));
            }
        }
        Ok(())
    }

    /// One step of `h` that ends with the frame at `pose`. Changes nothing on failure.
    pub fn step(&mut self, model: &Model, load: &BodyLoad, external: External, pose: &Pose, h: f64) -> Result<()> {
        self.set_force(model, load, external)?;
        self.take_handles(pose)?;
        let Self { solver, explicit, damping, u, velocity, force, before, .. } = self;
        before[0].copy_from_slice(u);
        before[1].copy_from_slice(velocity);
        let iterations = if *explicit {
            solver.symplectic_euler(u, velocity, force, *damping, h)?;
            1
        } else {
            solver.implicit_euler(u, velocity, force, *damping, h)?.iterations
        };
        let work = self.conclude(iterations);
        let told = (self.constraint_work + work).is_finite() && self.constraints.is_finite();
        if told && Self::has_meaning(model, &self.u, &self.velocity) {
            self.constraint_work += work;
            self.constraints.accept();
            self.iterations = iterations;
            return Ok(());
        }
        self.u.copy_from_slice(&self.before[0]);
        self.velocity.copy_from_slice(&self.before[1]);
        let advice = if self.explicit { ": take shorter steps" } else { "" };
        let message = format!("the step of {h:?} s moves the shell beyond all range{advice}");
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// Gives the solver the constraints, in frame axes.
    fn take_handles(&mut self, pose: &Pose) -> Result<()> {
        let to_frame = pose.rotation.inverse();
        let handle = |c: &Constraint| {
            let target = match c.target {
                Target::Position(world) => reference::Target::Position(to_frame * (world - pose.origin)),
                Target::Orientation(world) => reference::Target::Orientation(to_frame * world),
            };
            Handle { vertex: c.vertex, held: c.axes, compliance: c.compliance, target }
        };
        let handles = self.constraints.report().map(|(c, _)| handle(c)).collect();
        self.solver.set_handles(*to_frame.to_rotation_matrix().matrix(), handles, &self.u)
    }

    /// What the solver made of the constraints; returns the work done by them.
    fn conclude(&mut self, iterations: usize) -> f64 {
        let (reactions, work) = self.solver.reactions();
        let iterations = iterations.max(1) as u32;
        for (k, reaction) in reactions.iter().enumerate() {
            self.constraints
                .conclude(k, Outcome { residual: wide_norm(&reaction.missing), force: reaction.force, iterations });
        }
        work
    }

    /// Whether positions and energies are numbers that can be told.
    pub fn has_meaning(model: &Model, u: &[Vec3], velocity: &[Vec3]) -> bool {
        let largest = LARGEST_DISPLACEMENT * model.shell.mesh.size;
        let kinetic: f64 = model.shell.mass.iter().zip(velocity).map(|(m, v)| m * v.norm_squared()).sum();
        kinetic.is_finite() && u.iter().flatten().all(|c| c.abs() <= largest)
    }

    /// The static solution under the present loads and constraints, from the present shape. Returns residual and iterations. Changes nothing
    /// on failure.
    pub fn settle(&mut self, model: &Model, load: &BodyLoad, external: External, pose: &Pose) -> Result<(f64, usize)> {
        self.set_force(model, load, external)?;
        self.take_handles(pose)?;
        let found = self.solver.equilibrium(&self.u, &self.force, &Default::default(), &mut |_| Ok(()))?;
        self.conclude(found.iterations);
        if !self.constraints.is_finite() || !Self::has_meaning(model, &found.displacement, &[]) {
            return Err(Error::new(ErrorKind::Numerical, "the equilibrium is beyond all range"));
        }
        self.constraints.accept();
        self.u = found.displacement;
        self.velocity.fill(Vec3::zeros());
        Ok((found.residual, found.iterations))
    }

    /// Hands the position of every vertex to `visit`, in order.
    pub fn positions(&self, model: &Model, placement: &Placement, mut visit: impl FnMut(usize, Vec3)) {
        (0..self.u.len()).for_each(|v| visit(v, self.position(model, placement, v)));
    }

    /// Position of vertex `v`.
    pub fn position(&self, model: &Model, placement: &Placement, v: usize) -> Vec3 {
        let local = model.shell.mesh.positions[v] + self.u[v];
        placement.origin + placement.rotation.map_or(local, |rotation| rotation * local)
    }

    /// How far it is bent; `limit` is an angle.
    pub fn extent(&self, model: &Model, limit: f64) -> Extent {
        extent(&model.shell.mesh, &self.u, limit)
    }

    /// Elastic and kinetic energy.
    pub fn energies(&self, model: &Model) -> (f64, f64) {
        let x: Vec<Vec3> = model.shell.mesh.positions.iter().zip(&self.u).map(|(x, u)| x + u).collect();
        (model.shell.energy.value(&x), self.solver.kinetic_energy(&self.velocity))
    }

    /// Rotation of each vertex from rest.
    pub fn rotations(&self, model: &Model) -> Vec<UnitQuaternion<f64>> {
        rotations(&model.shell.mesh, &self.u)
    }
}

/// Rotation of each vertex from rest to the displacements `u`.
pub fn rotations(mesh: &Mesh, u: &[Vec3]) -> Vec<UnitQuaternion<f64>> {
    let x: Vec<Vec3> = mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
    vertex_rotations(mesh, &x)
}

/// How far displacements `u` bend a shell; `limit` is an angle.
pub fn extent(mesh: &Mesh, u: &[Vec3], limit: f64) -> Extent {
    let displacement = u.iter().map(|u| u.norm_squared()).fold(0.0, f64::max);
    let angles: Vec<f64> = rotations(mesh, u).iter().map(|r| r.angle()).collect();
    let rotation = angles.iter().fold(0.0, |largest: f64, angle| largest.max(angle * angle));
    Extent { displacement, rotation, beyond: angles.iter().filter(|angle| **angle > limit).count() }
}

//! Motion vertex by vertex: the nonlinear discrete shell, the baseline that modal methods are measured against.

use crate::reference::{Rayleigh, Solver};
use crate::step::modal_force::BodyLoad;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Mesh, Model, Result, Vec3};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Past this displacement, in units of the model's size, a shell has no meaning left; its energy has room for the fourth power.
const LARGEST_DISPLACEMENT: f64 = 1e30;

/// Displacements and velocities in frame axes, with the solver and its scratch.
pub struct Nodal {
    solver: Solver,
    explicit: bool,
    pub damping: Rayleigh,
    pub u: Vec<Vec3>,
    pub velocity: Vec<Vec3>,
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
            u: self.u.clone(),
            velocity: self.velocity.clone(),
            force: self.force.clone(),
            before: self.before.clone(),
        })
    }

    /// Symplectic Euler.
    pub fn is_explicit(&self) -> bool {
        self.explicit
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.u.fill(Vec3::zeros());
        self.velocity.fill(Vec3::zeros());
    }

    fn set_force(&mut self, model: &Model, load: &BodyLoad, external: Option<&[Vec3]>) -> Result<()> {
        let shell = &model.shell;
        for v in 0..self.force.len() {
            let r = shell.mesh.positions[v] + self.u[v];
            self.force[v] = load.at(shell.mass[v], r, self.velocity[v]) + external.map_or(Vec3::zeros(), |f| f[v]);
            if !self.force[v].iter().all(|c| c.is_finite()) {
                return Err(Error::new(ErrorKind::Numerical, format!("the load on vertex {v} is not finite")));
            }
        }
        Ok(())
    }

    /// One step of `h`. Changes nothing on failure.
    pub fn step(&mut self, model: &Model, load: &BodyLoad, external: Option<&[Vec3]>, h: f64) -> Result<()> {
        self.set_force(model, load, external)?;
        let Self { solver, explicit, damping, u, velocity, force, before } = self;
        before[0].copy_from_slice(u);
        before[1].copy_from_slice(velocity);
        if *explicit {
            solver.symplectic_euler(u, velocity, force, *damping, h)?;
        } else {
            solver.implicit_euler(u, velocity, force, *damping, h)?;
        }
        if Self::has_meaning(model, u, velocity) {
            return Ok(());
        }
        u.copy_from_slice(&before[0]);
        velocity.copy_from_slice(&before[1]);
        Err(Error::new(ErrorKind::Numerical, format!("the step of {h} s moves the shell beyond all range")))
    }

    /// Whether positions and energies are numbers that can be told.
    pub fn has_meaning(model: &Model, u: &[Vec3], velocity: &[Vec3]) -> bool {
        let largest = LARGEST_DISPLACEMENT * model.shell.mesh.size;
        let kinetic: f64 = model.shell.mass.iter().zip(velocity).map(|(m, v)| m * v.norm_squared()).sum();
        kinetic.is_finite() && u.iter().flatten().all(|c| c.abs() <= largest)
    }

    /// The static solution under the present loads, from the present shape. Returns residual and iterations. Changes nothing
    /// on failure.
    pub fn settle(&mut self, model: &Model, load: &BodyLoad, external: Option<&[Vec3]>) -> Result<(f64, usize)> {
        self.set_force(model, load, external)?;
        let found = self.solver.equilibrium(&self.u, &self.force, &Default::default(), &mut |_| Ok(()))?;
        if !Self::has_meaning(model, &found.displacement, &[]) {
            return Err(Error::new(ErrorKind::Numerical, "the equilibrium is beyond all range"));
        }
        self.u = found.displacement;
        self.velocity.fill(Vec3::zeros());
        Ok((found.residual, found.iterations))
    }

    /// Hands the position of every vertex to `visit`, in order.
    pub fn positions(&self, model: &Model, placement: &Placement, mut visit: impl FnMut(usize, Vec3)) {
        let Placement { origin, rotation } = placement;
        for (v, (rest, u)) in model.shell.mesh.positions.iter().zip(&self.u).enumerate() {
            let local = rest + u;
            visit(v, origin + rotation.map_or(local, |rotation| rotation * local));
        }
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

    /// Rotation of each vertex from rest: the mean of its triangles', each from the frame of its first edge and normal.
    pub fn rotations(&self, model: &Model) -> Vec<UnitQuaternion<f64>> {
        rotations(&model.shell.mesh, &self.u)
    }
}

/// Rotation of each vertex from rest to the displacements `u`: the mean of its triangles', each from the frame of its first edge and
/// normal.
pub fn rotations(mesh: &Mesh, u: &[Vec3]) -> Vec<UnitQuaternion<f64>> {
    let mut sums = vec![nalgebra::Quaternion::from_parts(0.0, Vec3::zeros()); u.len()];
    for t in &mesh.triangles {
        let corners = t.map(|v| v as usize);
        let turned = triangle_frame(corners.map(|v| mesh.positions[v] + u[v]));
        let rest = triangle_frame(corners.map(|v| mesh.positions[v]));
        let turn = Rotation3::from_matrix_unchecked(turned * rest.transpose());
        let q = UnitQuaternion::from_rotation_matrix(&turn).into_inner();
        for v in corners {
            let same_side = sums[v].dot(&q) >= 0.0; // q and −q are one rotation
            sums[v] += if same_side { q } else { -q };
        }
    }
    sums.into_iter().map(|q| UnitQuaternion::try_new(q, 1e-12).unwrap_or_else(UnitQuaternion::identity)).collect()
}

/// How far displacements `u` bend a shell; `limit` is an angle.
pub fn extent(mesh: &Mesh, u: &[Vec3], limit: f64) -> Extent {
    let displacement = u.iter().map(|u| u.norm_squared()).fold(0.0, f64::max);
    let angles: Vec<f64> = rotations(mesh, u).iter().map(|r| r.angle()).collect();
    let rotation = angles.iter().fold(0.0, |largest: f64, angle| largest.max(angle * angle));
    Extent { displacement, rotation, beyond: angles.iter().filter(|angle| **angle > limit).count() }
}

/// Unit axes along the first edge, in the plane, and along the normal; the identity for a collapsed triangle.
fn triangle_frame([a, b, c]: [Vec3; 3]) -> Matrix3<f64> {
    let axes = (b - a).try_normalize(0.0).zip((b - a).cross(&(c - a)).try_normalize(0.0));
    axes.map_or_else(Matrix3::identity, |(x, z)| Matrix3::from_columns(&[x, z.cross(&x), z]))
}

//! The full nonlinear shell, without modes: the ground truth that modal methods are measured against.
//!
//! M ü + C u̇ + ∇E(x̄ + u) = F over the free vertices, with the shell's own energy E at whatever deformation, lumped masses
//! M, and forces F (n_vertices) that the caller sets for every call. State is two arrays, displacements u and velocities u̇
//! per vertex in the axes of the rest positions; vertices that are not free keep what they have there, zero by rights.
//!
//! Damping is Rayleigh's with the stiffness of the present shape: C = ξM + ζ Σ b bᵀ, b the rows √(2w) ∇s(x) of the strains.
//! At rest that is ξM + ζK. Unlike the rest stiffness it leaves rigid motion of the bent shell alone, so angular momentum is
//! kept; unlike the exact tangent it is never indefinite, so damping only ever takes energy.

mod constraints;
mod continuation;
mod correction;
mod equilibrium;
mod explicit;
mod free_motion;
mod implicit;
mod mixed;
mod newton;
mod noise;
pub(crate) mod orientation;
mod parts;
mod potential;
mod sag;

pub use correction::{CORRECTED, Correcting, Correction, LOST, Load, SOLVES, SolverPool};
pub use equilibrium::{Equilibrium, EquilibriumOptions, EquilibriumProgress};
pub use free_motion::{FreeMotions, Held};
pub use implicit::{STEP_SOLVES, StepReport};
pub use orientation::{Ring, part_way, vertex_rotations};
pub use sag::{sagged, settled};

use crate::constraint::Outcome;
use crate::energy::Mat3;
use crate::error::{require_finite, require_non_negative};
use crate::point_energy::{InFrame, PointEnergy};
use crate::{Error, Result, Shell, Vec3};
use constraints::Constraints;
pub use newton::AtRest;
use newton::Newton;
use potential::Potential;
use std::sync::Arc;

/// C = ξM + ζ Σ b bᵀ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rayleigh {
    /// ξ ≥ 0, 1/s.
    pub mass: f64,
    /// ζ ≥ 0, s.
    pub stiffness: f64,
}

/// Solves one shell; holds the symbolic factorization and all scratch, so that steps allocate nothing of their own.
pub struct Solver {
    shell: Arc<Shell>,
    newton: Newton,
    /// What constraints hold in the present call.
    constraints: Constraints,
    /// Energies of points that join.
    points: Option<InFrame>,
    /// What ξ is multiplied by at each vertex, or none.
    damped: Arc<[f64]>,
    /// What loads lose by a unit of a vertex' velocity, or none.
    drag: Vec<Mat3>,
    /// Groups of vertices that the newton's pattern couples for orientations.
    coupled: Vec<Vec<u32>>,
    /// What became of them, and their work.
    outcomes: Vec<Outcome>,
    constraint_work: f64,
    /// Whether steps share the linear solves of one, and whether the next one is the last one again.
    sharing: bool,
    again: bool,
    /// The force that the last step's residual is relative to, and whether the next one's is, too.
    scale: f64,
    keeps_scale: bool,
    /// Positions where the last implicit step ended (n_vertices), or none.
    ended: Vec<Vec3>,
    /// Positions the call starts from (n_vertices).
    origin: Vec<Vec3>,
    /// Positions being found (n_vertices).
    x: Vec<Vec3>,
    /// Forces per vertex (n_vertices).
    force: Vec<Vec3>,
}

impl Solver {
    /// Analyses the pattern of the shell's stiffness. Fails when memory does not suffice.
    pub fn new(shell: Arc<Shell>) -> Result<Self> {
        let zeros = vec![Vec3::zeros(); shell.mass.len()];
        let newton = Newton::new(&shell, &[])?;
        let (constraints, coupled, outcomes) = (Constraints::none(), vec![], vec![]);
        let (origin, x, force) = (zeros.clone(), zeros.clone(), zeros);
        Ok(Self {
            shell,
            newton,
            constraints,
            points: None,
            damped: Arc::default(),
            drag: vec![],
            coupled,
            outcomes,
            constraint_work: 0.0,
            sharing: false,
            again: false,
            scale: 0.0,
            keeps_scale: false,
            ended: vec![],
            origin,
            x,
            force,
        })
    }

    /// Bytes of the matrix, its factor and the fields.
    pub fn bytes(&self) -> usize {
        3 * self.x.len() * size_of::<Vec3>() + self.newton.bytes()
    }

    /// Whether searches begin with the stress as an unknown, as they do unless told otherwise. They end in minima either way.
    pub fn set_mixed(&mut self, mixed: bool) {
        self.newton.set_mixed(mixed);
    }

    /// Whether conjugate gradients may find directions, as they do unless told otherwise: near a search's end by the factor of an earlier tangent, in
    /// steps in time by factors in single precision.
    pub fn set_reusing(&mut self, reusing: bool) {
        self.newton.reusing = reusing;
    }

    /// The tangent at rest where nothing acts, for [`Solver::begin_by`] of this and other solvers of the shell; none where it is not positive definite.
    pub fn tangent_at_rest(&mut self) -> Result<Option<Arc<AtRest>>> {
        let Self { shell, newton, origin, force, .. } = self;
        origin.copy_from_slice(&shell.mesh.positions);
        force.fill(Vec3::zeros());
        let potential =
            Potential { shell, origin, load: force, step: None, constraints: &Constraints::none(), points: None };
        Ok(newton.tangent_at_rest(&potential)?.map(Arc::new))
    }

    /// Equilibria that are sought from rest go by this tangent.
    pub fn begin_by(&mut self, at_rest: Option<Arc<AtRest>>) {
        self.newton.at_rest = at_rest;
    }

    /// Factorizations since it was made.
    pub fn factorizations(&self) -> usize {
        self.newton.factorizations
    }

    /// Multiplications of a factorization and entries of the factor.
    pub fn operations(&self) -> [f64; 2] {
        self.newton.operations()
    }

    /// The shell it was built for.
    pub fn shell(&self) -> &Arc<Shell> {
        &self.shell
    }

    /// Goes on with the same shell, but for rest angles of creases.
    pub fn set_shell(&mut self, shell: Arc<Shell>) {
        self.shell = shell;
    }

    /// Goes on with the same shell on another rest shape: `Shell::carried`. What held directions take from the matrix is made anew where they
    /// turned. Fails when memory does not suffice.
    pub fn follow(&mut self, shell: Arc<Shell>) -> Result<()> {
        if shell.rollers != self.shell.rollers {
            let cliques: Vec<&[u32]> = self.coupled.iter().map(|vertices| &vertices[..]).collect();
            self.newton = self.newton.renewed(Newton::new(&shell, &cliques)?);
        }
        self.shell = shell;
        Ok(())
    }

    /// E(x̄ + u).
    pub fn elastic_energy(&mut self, u: &[Vec3]) -> f64 {
        self.place(u);
        self.shell.energy.value(&self.x)
    }

    /// ‖∇E(x̄ + u)‖ over the free vertices.
    pub fn elastic_force(&mut self, u: &[Vec3]) -> f64 {
        self.place(u);
        let mut gradient = vec![Vec3::zeros(); u.len()];
        self.shell.energy.add_gradient(&self.x, &mut gradient);
        free_norm(&self.shell, &gradient)
    }

    /// Energies that join in the calls that follow, if any.
    pub fn join(&mut self, points: Option<InFrame>) {
        self.points = points;
    }

    /// What ξ is multiplied by at each vertex in the steps that follow; none for 1.
    pub fn share_damping(&mut self, factors: &Arc<[f64]>) {
        self.damped.clone_from(factors);
    }

    /// What the loads of the next steps lose by a unit of each vertex' velocity (n_vertices, frame axes); none for nothing.
    pub fn resist(&mut self, drag: &[Mat3]) {
        self.drag.clear();
        self.drag.extend_from_slice(drag);
    }

    fn points(points: &Option<InFrame>) -> Option<&dyn PointEnergy> {
        points.as_ref().map(|points| points as &dyn PointEnergy)
    }

    /// ½ u̇ᵀMu̇.
    pub fn kinetic_energy(&self, velocity: &[Vec3]) -> f64 {
        self.shell.mass.iter().zip(velocity).map(|(m, v)| 0.5 * m * v.norm_squared()).sum()
    }

    /// x ← x̄ + u.
    fn place(&mut self, u: &[Vec3]) {
        let rest = &self.shell.mesh.positions;
        self.x.iter_mut().zip(rest).zip(u).for_each(|((x, rest), u)| *x = rest + u);
    }

    /// Fails unless every field has a finite vector per vertex.
    fn check_fields(&self, fields: &[(&str, &[Vec3])]) -> Result<()> {
        let n = self.shell.mass.len();
        for (name, field) in fields {
            if field.len() != n {
                return Err(Error::argument(format!("{name} has {} vectors for {n} vertices", field.len())));
            }
            if let Some(v) = field.iter().position(|f| !f.iter().all(|c| c.is_finite())) {
                return Err(Error::argument(format!("{name}[{v}] is {:?}: it must be finite", field[v].data.0[0])));
            }
        }
        Ok(())
    }
}

/// Fails unless h > 0 and both coefficients are finite and not negative.
fn check_step(h: f64, damping: Rayleigh) -> Result<()> {
    require_non_negative("the mass damping", damping.mass)?;
    require_non_negative("the stiffness damping", damping.stiffness)?;
    if require_finite("the step h", h)? > 0.0 {
        Ok(())
    } else {
        Err(Error::argument(format!("the step h is {h:?}: it must be positive")))
    }
}

/// Adds ζ Σ b (b·rate) with the rows at `x` to `force`.
fn add_viscous_force(shell: &Shell, x: &[Vec3], rate: impl Fn(usize) -> Vec3, zeta: f64, force: &mut [Vec3]) {
    shell.energy.visit_rows(x, &mut |(vertices, row)| {
        let strain_rate: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&rate(v as usize))).sum();
        vertices.iter().zip(row).for_each(|(&v, b)| force[v as usize] += (zeta * strain_rate) * b);
    });
}

/// How many rigid motions of components the supports leave free.
pub fn rigid_motions(shell: &Shell) -> usize {
    free_motion::FreeMotions::new(shell, std::iter::empty(), &shell.mesh.positions).count()
}

/// ‖f‖_M over the free vertices.
pub(crate) fn mass_norm(shell: &Shell, f: impl Fn(usize) -> Vec3) -> f64 {
    shell.free.iter().map(|&v| shell.mass[v as usize] * f(v as usize).norm_squared()).sum::<f64>().sqrt()
}

/// ‖f‖ over the free vertices.
fn free_norm(shell: &Shell, f: &[Vec3]) -> f64 {
    shell.free_norm(f)
}

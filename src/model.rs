//! The precomputed model: everything a state needs, immutable, shared by any number of states on any threads.

use crate::auto::{self, Budget, Front};
use crate::features::Feature;
use crate::modes::{Certificate, Demand, PHASES, Phase, Progress, demanded_modes, lowest_modes};
use crate::reduced::{self, ReducedShell};
use crate::reference::SolverPool;
use crate::state::Method;
use crate::step::{Bend, Guard, Participation};
use crate::strain::RotationStrain;
use crate::warp::{Basis, Entry, I16, ModalRotation};
use crate::{Error, ErrorKind, Result, Shell, Vec3, wide_norm};
use std::sync::{Arc, OnceLock};
use xxhash_rust::xxh3::xxh3_64;

/// Floating-point type of the run-time basis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Half the memory; positions good to about 1e-6 of the displacement.
    #[default]
    F32,
    /// For reference and for sums of very many modes.
    F64,
    /// A quarter of F64's memory: Φ and Ψ in 16 bits of a unit for each mode, computed with in 32 bits.
    I16,
}

impl Precision {
    /// Fails where this build has no such basis.
    #[inline(always)]
    pub fn require(self) -> Result<()> {
        match self {
            Self::F32 => Ok(()),
            Self::F64 => Feature::F64Basis.require(),
            Self::I16 => Feature::I16Basis.require(),
        }
    }

    /// Bytes of a number.
    pub fn number_bytes(self) -> usize {
        match self {
            Self::F32 => f32::BYTES,
            Self::F64 => f64::BYTES,
            Self::I16 => I16::BYTES,
        }
    }

    /// Largest error of a stored number, relative to the largest component of its mode's Φ or Ψ.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F32 => f32::ROUNDING,
            Self::F64 => f64::ROUNDING,
            Self::I16 => I16::ROUNDING,
        }
    }
}

/// What to precompute.
#[derive(Clone, Debug)]
pub struct Options {
    /// Modes wanted; at most as many as there are unknowns are given. With a demand, the most.
    pub modes: usize,
    /// Of the run-time basis; modes are always computed in f64.
    pub precision: Precision,
    /// Gravity (frame axes) under which the shell hangs at rest where it is linearised; zero = the rest shape.
    pub sag: Vec3,
    /// For linear modal analysis alone: no modal rotations, neither stored nor computed, and half the basis.
    pub linear: bool,
    /// Leaves out the modes that a scene does not need.
    pub demand: Option<Demand>,
    /// The reduced discrete shell beside the warp.
    pub reduced: reduced::Options,
    /// Chooses the method for the scene of the demand, and makes the model for it.
    pub auto: Option<Budget>,
}

impl Default for Options {
    fn default() -> Self {
        let reduced = reduced::Options::default();
        Self {
            modes: 16,
            precision: Precision::F32,
            sag: Vec3::zeros(),
            linear: false,
            demand: None,
            reduced,
            auto: None,
        }
    }
}

/// Φ and Ψ in the precision asked for.
pub enum AnyBasis {
    /// [`Precision::F32`].
    F32(Basis<f32>),
    /// [`Precision::F64`].
    F64(Basis<f64>),
    /// [`Precision::I16`].
    I16(Basis<I16>),
}

/// Calls the same code on the basis of either precision.
macro_rules! with_basis {
    ($any:expr, $basis:ident => $body:expr) => {
        match $any {
            $crate::model::AnyBasis::F32($basis) => $body,
            $crate::model::AnyBasis::F64($basis) if $crate::features::Feature::F64Basis.is_built_in() => $body,
            $crate::model::AnyBasis::I16($basis) if $crate::features::Feature::I16Basis.is_built_in() => $body,
            _ => unreachable!("no model has a basis that its build lacks"),
        }
    };
}
pub(crate) use with_basis;

/// See the module's text.
pub struct Model {
    /// The physical problem.
    pub shell: Arc<Shell>,
    /// λ of each mode, 1/s², ascending; zero modes exactly 0.
    pub eigenvalues: Vec<f64>,
    /// Largest |Ψ| of each mode: rotation per unit amplitude. Empty where there is no Ψ.
    pub largest_rotation: Vec<f64>,
    /// Largest |Φ||Ψ| of a vertex of each mode: how a force swings with the shell. Empty where there is no Ψ.
    pub largest_swing: Vec<f64>,
    /// Number of zero modes among them.
    pub zero_modes: usize,
    /// Evidence for the modes.
    pub certificate: Certificate,
    /// Φ and Ψ.
    pub basis: AnyBasis,
    /// Made when the first state with modes is.
    pub participation: OnceLock<Participation>,
    /// Made when the first state of rotation–strain reconstruction is.
    pub strain: OnceLock<Arc<RotationStrain>>,
    /// By the demand it was made for, no vertex is off by more for want of modes; 0 without one.
    pub truncation: f64,
    /// The reduced discrete shell, if it was asked for.
    pub reduced: Option<ReducedShell>,
    /// What a choice of the method went by, where there was one.
    pub front: Option<Front>,
    /// The full shell, for estimates of what the other methods get wrong; made when first asked for.
    pub solvers: SolverPool,
    /// Seconds by [`Phase`].
    pub seconds: [f64; PHASES],
    /// Estimate of the most memory held at once during precompute, bytes.
    pub peak_bytes: usize,
    /// Tells models apart that cannot share saved states of modes and of the full shell.
    pub fingerprint: u64,
    /// And those of the reduced shell.
    pub reduced_fingerprint: u64,
}

impl Model {
    /// Computes modes and, unless for linear modal analysis, modal rotations. `callback` hears of progress and may stop the work with an error.
    pub fn precompute(
        shell: Arc<Shell>,
        options: &Options,
        callback: &mut dyn FnMut(Phase, f64) -> Result<()>,
    ) -> Result<Self> {
        options.precision.require()?;
        if let Some(budget) = options.auto {
            return auto::precompute(shell, options, budget, callback);
        }
        let mut progress = Progress::new(callback);
        let shell = if options.sag == Vec3::zeros() { shell } else { sagged(&shell, options.sag, &mut progress)? };
        let (modes, truncation) = match &options.demand {
            None => (lowest_modes(&shell, options.modes, &mut progress)?, 0.0),
            Some(demand) => {
                let demand = demand.clone().validated(&shell)?;
                demanded_modes(&shell, &demand, (options.modes, options.linear), &mut progress)?
            }
        };
        let linear = options.linear;
        let (basis, largest_rotation, largest_swing) = match options.precision {
            Precision::F32 => run_time_basis(&shell, &modes.shapes, linear, &mut progress, AnyBasis::F32)?,
            Precision::F64 if Feature::F64Basis.is_built_in() => {
                run_time_basis(&shell, &modes.shapes, linear, &mut progress, AnyBasis::F64)?
            }
            Precision::I16 if Feature::I16Basis.is_built_in() => {
                run_time_basis(&shell, &modes.shapes, linear, &mut progress, AnyBasis::I16)?
            }
            _ => unreachable!("refused above"),
        };
        let shapes_fit = with_basis!(&basis, basis => basis.is_finite());
        let Certificate { residual, orthonormality, .. } = modes.certificate;
        let told = largest_rotation.iter().chain(&largest_swing).chain(&modes.eigenvalues);
        if !shapes_fit || told.chain([&residual, &orthonormality]).any(|x| !x.is_finite()) {
            let message = "the mode shapes leave the floating-point range: choose other units, or 64-bit precision";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let reduced = match options.reduced.fields {
            0 => None,
            _ => Some(ReducedShell::precompute(&shell, &modes, &options.reduced, options.precision, &mut progress)?),
        };
        let fingerprint = fingerprint(&shell, &modes.eigenvalues, options.precision);
        let reduced_fingerprint = reduced_fingerprint(fingerprint, &shell, reduced.as_ref());
        Ok(Self {
            reduced,
            shell,
            eigenvalues: modes.eigenvalues,
            largest_rotation,
            largest_swing,
            zero_modes: modes.zero_modes,
            certificate: modes.certificate,
            basis,
            participation: OnceLock::new(),
            front: None,
            solvers: SolverPool::default(),
            strain: OnceLock::new(),
            truncation,
            seconds: progress.seconds,
            peak_bytes: modes.peak_bytes,
            fingerprint,
            reduced_fingerprint,
        })
    }

    /// The method that was chosen for its scene.
    pub fn chosen_method(&self) -> Result<Method> {
        self.front.as_ref().map(|front| front.choice().method).ok_or_else(|| {
            let message = "the model has no choice of a method: precompute with auto_error or auto_operations";
            Error::new(ErrorKind::Unsupported, message)
        })
    }

    /// Whether it is for linear modal analysis alone.
    pub fn is_linear(&self) -> bool {
        with_basis!(&self.basis, basis => basis.is_linear())
    }

    /// What the guard needs to know of it, for shells that are `warped` or are not.
    pub fn guard(&self, warped: bool) -> Guard<'_> {
        let participation = self.participation();
        let (swing, turn) = (participation.swing(), participation.turn());
        Guard {
            eigenvalues: &self.eigenvalues,
            bend: self.bend(warped),
            swing,
            turn,
            largest_swing: &self.largest_swing,
        }
    }

    /// How far a unit of each mode bends the shell.
    pub fn bend(&self, warped: bool) -> Bend<'_> {
        match warped {
            true => Bend { of_modes: &self.largest_rotation, unit: 1.0 },
            false => Bend { of_modes: self.participation().reach(), unit: self.shell.mesh.size },
        }
    }

    /// The share of the mass that moves which the modes carry along each axis, Σ P_k²/Σ m: near 1 unless modes are missing for loads
    /// along it.
    pub fn effective_mass(&self) -> Vec3 {
        Vec3::from([Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| self.effective_mass_along(&axis)))
    }

    /// The same along the unit vector `along`.
    pub fn effective_mass_along(&self, along: &Vec3) -> f64 {
        let moving: f64 = self.shell.free.iter().map(|v| self.shell.mass[*v as usize]).sum();
        let carried: f64 = self.participation().factors().iter().map(|p| p.dot(along).powi(2)).sum();
        if moving > 0.0 { carried / moving } else { 0.0 }
    }

    /// What an acceleration that acts everywhere alike does to the modes. Made at the first call.
    pub fn participation(&self) -> &Participation {
        self.participation
            .get_or_init(|| with_basis!(&self.basis, basis => Participation::new(basis, &self.shell.mass)))
    }

    /// The map of rotation–strain reconstruction. Made at the first call.
    pub fn rotation_strain(&self) -> Result<Arc<RotationStrain>> {
        if let Some(made) = self.strain.get() {
            return Ok(made.clone());
        }
        let made = Arc::new(RotationStrain::new(self)?); // of two callers at once both make the same
        Ok(self.strain.get_or_init(|| made).clone())
    }

    /// Bytes of that map, where it was made.
    pub fn strain_bytes(&self) -> usize {
        self.strain.get().map_or(0, |strain| strain.bytes())
    }

    /// Number of modes.
    pub fn n_modes(&self) -> usize {
        self.eigenvalues.len()
    }

    /// √λ/2π of each mode.
    pub fn frequencies(&self) -> impl Iterator<Item = f64> + '_ {
        self.eigenvalues.iter().map(|l| l.sqrt() / std::f64::consts::TAU)
    }

    /// Φ and Ψ of one vertex in one mode, as the run-time basis holds them.
    pub fn mode_at(&self, mode: usize, vertex: usize) -> (Vec3, Vec3) {
        with_basis!(&self.basis, basis => basis.at(mode, vertex))
    }

    /// Precision of the run-time basis.
    pub fn precision(&self) -> Precision {
        match self.basis {
            AnyBasis::F32(_) => Precision::F32,
            AnyBasis::F64(_) => Precision::F64,
            AnyBasis::I16(_) => Precision::I16,
        }
    }

    /// Bytes that stay for the run: basis, mesh, masses.
    pub fn bytes(&self) -> usize {
        let mesh = &self.shell.mesh;
        let vertices = mesh.positions.len() * (size_of::<Vec3>() + size_of::<f64>() + size_of::<u32>() + 1);
        let connectivity = mesh.triangles.len() * 12 + mesh.edges.len() * 16;
        let beside = self.participation.get().map_or(0, Participation::bytes)
            + self.reduced.as_ref().map_or(0, ReducedShell::bytes)
            + self.solvers.bytes()
            + self.strain_bytes();
        let of_modes = 8 * (self.n_modes() + self.largest_rotation.len() + self.largest_swing.len());
        with_basis!(&self.basis, basis => basis.bytes()) + vertices + connectivity + beside + of_modes
    }
}

fn sagged(shell: &Arc<Shell>, gravity: Vec3, progress: &mut Progress) -> Result<Arc<Shell>> {
    let mut watch = |share: f64| progress.report(Phase::Assembly, 0.9 * share);
    Ok(Arc::new(shell.sagged(gravity, &mut watch)?))
}

/// The basis, and of each mode the largest |Ψ| and |Φ||Ψ|; none of these without Ψ.
fn run_time_basis<E: Entry>(
    shell: &Shell,
    shapes: &[Vec<Vec3>],
    linear: bool,
    progress: &mut Progress,
    any: impl Fn(Basis<E>) -> AnyBasis,
) -> Result<(AnyBasis, Vec<f64>, Vec<f64>)> {
    progress.report(Phase::Rotation, 0.0)?;
    let Shell { mesh, mass, total_mass, .. } = shell;
    let empty = if linear { Basis::linear } else { Basis::new };
    let mut basis = empty(&mesh.positions, mass, shapes.len(), *total_mass)?;
    let rotation = (!linear).then(|| ModalRotation::new(mesh));
    let (mut largest_rotation, mut largest_swing) = (vec![], vec![]);
    for (k, phi) in shapes.iter().enumerate() {
        let psi = rotation.as_ref().map_or(vec![], |rotation| rotation.apply(phi));
        if !linear {
            largest_rotation.push(psi.iter().map(wide_norm).fold(0.0, f64::max));
            let swings = psi.iter().zip(phi).map(|(w, u)| wide_norm(w) * wide_norm(u));
            largest_swing.push(swings.fold(0.0, f64::max));
        }
        basis.set_mode(k, phi, &psi);
        progress.report(Phase::Rotation, (k + 1) as f64 / shapes.len() as f64)?;
    }
    Ok((any(basis), largest_rotation, largest_swing))
}

/// Hash of everything that amplitudes mean something by: mesh, supports, eigenvalues, precision.
pub(crate) fn fingerprint(shell: &Shell, eigenvalues: &[f64], precision: Precision) -> u64 {
    let mut bytes: Vec<u8> = vec![];
    shell.mesh.positions.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
    shell.mesh.triangles.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes.extend(shell.held.iter().map(|held| u8::from(*held)));
    eigenvalues.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.push(precision as u8);
    xxh3_64(&bytes)
}

/// Hash of what else the amplitudes of a reduced shell mean something by: its fields, samples and stress fields.
pub(crate) fn reduced_fingerprint(fingerprint: u64, shell: &Shell, reduced: Option<&ReducedShell>) -> u64 {
    let mut bytes = fingerprint.to_le_bytes().to_vec();
    reduced.iter().for_each(|reduced| reduced.save(shell.mass.len(), &mut bytes));
    xxh3_64(&bytes)
}

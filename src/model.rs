//! The precomputed model: everything a state needs, immutable, shared by any number of states on any threads.

use crate::modes::{Certificate, Modes, PHASES, Phase, Progress, lowest_modes};
use crate::real::Real;
use crate::reduced::{self, ReducedShell};
use crate::step::Guard;
use crate::warp::{Basis, ModalRotation};
use crate::{Error, ErrorKind, Result, Shell, Vec3, wide_norm};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// Floating-point type of the run-time basis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Half the memory; positions good to about 1e-6 of the displacement.
    #[default]
    F32,
    /// For reference and for sums of very many modes.
    F64,
}

impl Precision {
    /// Bytes of a number.
    pub fn number_bytes(self) -> usize {
        match self {
            Self::F32 => size_of::<f32>(),
            Self::F64 => size_of::<f64>(),
        }
    }
}

/// What to precompute.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Modes wanted; at most as many as there are unknowns are given.
    pub modes: usize,
    /// Of the run-time basis; modes are always computed in f64.
    pub precision: Precision,
    /// Gravity (frame axes) under which the shell hangs at rest where it is linearised; zero = the rest shape.
    pub sag: Vec3,
    /// The reduced discrete shell beside the warp.
    pub reduced: reduced::Options,
}

impl Default for Options {
    fn default() -> Self {
        Self { modes: 16, precision: Precision::F32, sag: Vec3::zeros(), reduced: reduced::Options::default() }
    }
}

/// Φ and Ψ in the precision asked for.
pub enum AnyBasis {
    /// [`Precision::F32`].
    F32(Basis<f32>),
    /// [`Precision::F64`].
    F64(Basis<f64>),
}

/// Calls the same code on the basis of either precision.
macro_rules! with_basis {
    ($any:expr, $basis:ident => $body:expr) => {
        match $any {
            $crate::model::AnyBasis::F32($basis) => $body,
            $crate::model::AnyBasis::F64($basis) => $body,
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
    /// Largest |Ψ| of each mode: rotation per unit amplitude.
    pub largest_rotation: Vec<f64>,
    /// Largest |Φ||Ψ| of a vertex of each mode: how a force swings with the shell.
    pub largest_swing: Vec<f64>,
    /// Number of zero modes among them.
    pub zero_modes: usize,
    /// Evidence for the modes.
    pub certificate: Certificate,
    /// Φ and Ψ.
    pub basis: AnyBasis,
    /// The reduced discrete shell, if it was asked for.
    pub reduced: Option<ReducedShell>,
    /// Seconds by [`Phase`].
    pub seconds: [f64; PHASES],
    /// Estimate of the most memory held at once during precompute, bytes.
    pub peak_bytes: usize,
    /// Tells models apart that cannot share saved states.
    pub fingerprint: u64,
}

impl Model {
    /// Computes modes and modal rotations. `callback` hears of progress and may stop the work with an error.
    pub fn precompute(
        shell: Arc<Shell>,
        options: &Options,
        callback: &mut dyn FnMut(Phase, f64) -> Result<()>,
    ) -> Result<Self> {
        let mut progress = Progress::new(callback);
        let shell = if options.sag == Vec3::zeros() { shell } else { sagged(&shell, options.sag, &mut progress)? };
        let modes = lowest_modes(&shell, options.modes, &mut progress)?;
        let basis = match options.precision {
            Precision::F32 => AnyBasis::F32(run_time_basis(&shell, &modes.shapes, &mut progress)?),
            Precision::F64 => AnyBasis::F64(run_time_basis(&shell, &modes.shapes, &mut progress)?),
        };
        let (largest_rotation, largest_swing) = largest_rotation_and_swing(&shell, &modes);
        let shapes_fit = with_basis!(&basis, basis => basis.is_finite());
        let Certificate { residual, orthonormality, .. } = modes.certificate;
        let told = largest_rotation.iter().chain(&largest_swing).chain([&residual, &orthonormality]);
        if !shapes_fit || told.into_iter().any(|x| !x.is_finite()) {
            let message = "the mode shapes leave the floating-point range: choose other units, or 64-bit precision";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let reduced = match options.reduced.fields {
            0 => None,
            _ => Some(ReducedShell::precompute(&shell, &modes, &options.reduced, options.precision, &mut progress)?),
        };
        let fingerprint = fingerprint(&shell, &modes.eigenvalues, options.precision);
        Ok(Self {
            reduced,
            shell,
            eigenvalues: modes.eigenvalues,
            largest_rotation,
            largest_swing,
            zero_modes: modes.zero_modes,
            certificate: modes.certificate,
            basis,
            seconds: progress.seconds,
            peak_bytes: modes.peak_bytes,
            fingerprint,
        })
    }

    /// What the guard needs to know of it.
    pub fn guard(&self) -> Guard<'_> {
        let Self { eigenvalues, largest_rotation, largest_swing, .. } = self;
        Guard { eigenvalues, largest_rotation, largest_swing }
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
        }
    }

    /// Bytes that stay for the run: basis, mesh, masses.
    pub fn bytes(&self) -> usize {
        let mesh = &self.shell.mesh;
        let vertices = mesh.positions.len() * (size_of::<Vec3>() + size_of::<f64>() + size_of::<u32>() + 1);
        let connectivity = mesh.triangles.len() * 12 + mesh.edges.len() * 16;
        let reduced = self.reduced.as_ref().map_or(0, ReducedShell::bytes);
        with_basis!(&self.basis, basis => basis.bytes()) + vertices + connectivity + 8 * self.n_modes() + reduced
    }
}

fn sagged(shell: &Arc<Shell>, gravity: Vec3, progress: &mut Progress) -> Result<Arc<Shell>> {
    let mut watch = |share: f64| progress.report(Phase::Assembly, 0.9 * share);
    Ok(Arc::new(shell.sagged(gravity, &mut watch)?))
}

fn run_time_basis<T: Real>(shell: &Shell, shapes: &[Vec<Vec3>], progress: &mut Progress) -> Result<Basis<T>> {
    progress.report(Phase::Rotation, 0.0)?;
    let rotation = ModalRotation::new(&shell.mesh);
    let mut basis = Basis::new(&shell.mesh.positions, &shell.mass, shapes.len(), shell.total_mass)?;
    for (k, phi) in shapes.iter().enumerate() {
        basis.set_mode(k, phi, &rotation.apply(phi));
        progress.report(Phase::Rotation, (k + 1) as f64 / shapes.len() as f64)?;
    }
    Ok(basis)
}

fn largest_rotation_and_swing(shell: &Shell, modes: &Modes) -> (Vec<f64>, Vec<f64>) {
    let rotation = ModalRotation::new(&shell.mesh);
    let largest = |phi: &Vec<Vec3>| {
        let psi = rotation.apply(phi);
        let swings = psi.iter().zip(phi).map(|(w, u)| wide_norm(w) * wide_norm(u));
        (psi.iter().map(wide_norm).fold(0.0, f64::max), swings.fold(0.0, f64::max))
    };
    modes.shapes.iter().map(largest).unzip()
}

/// Hash of everything that amplitudes mean something by: mesh, supports, eigenvalues, precision.
pub(crate) fn fingerprint(shell: &Shell, eigenvalues: &[f64], precision: Precision) -> u64 {
    let mut hash = Xxh3::new();
    shell.mesh.positions.iter().flatten().for_each(|x| hash.update(&x.to_le_bytes()));
    shell.mesh.triangles.iter().flatten().for_each(|v| hash.update(&v.to_le_bytes()));
    shell.held.iter().for_each(|held| hash.update(&[u8::from(*held)]));
    eigenvalues.iter().for_each(|x| hash.update(&x.to_le_bytes()));
    hash.update(&[precision as u8]);
    hash.digest()
}

//! The modal basis of a shell: its lowest modes as the run-time methods read them. Immutable.

use crate::arithmetic::Arithmetic;
use crate::features::Feature;
use crate::modes::{Modes, Phase, Progress, Shapes, SupportFields};
use crate::precision::Precision;
use crate::step::{Bend, Guard, Participation};
use crate::support::Roller;
use crate::warp::{Basis, Entry, I16, ModalRotation};
use crate::{Result, Shell, Vec3, wide_norm};
use std::sync::{Arc, OnceLock};

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
            $crate::modal::AnyBasis::F32($basis) => $body,
            $crate::modal::AnyBasis::F64($basis) if $crate::features::Feature::F64Basis.is_built_in() => $body,
            $crate::modal::AnyBasis::I16($basis) if $crate::features::Feature::I16Basis.is_built_in() => $body,
            _ => unreachable!("no model has a basis that its build lacks"),
        }
    };
}
pub(crate) use with_basis;

/// Eigenvalues, mode shapes Φ and modal rotations Ψ of one shell.
pub struct ModalBasis {
    /// The shell whose modes these are.
    pub shell: Arc<Shell>,
    /// λ of each mode, 1/s², ascending; zero modes exactly 0.
    pub eigenvalues: Vec<f64>,
    /// Largest |Ψ| of each mode and support field: rotation per unit amplitude. Empty where there is no Ψ.
    pub largest_rotation: Vec<f64>,
    /// Largest |Φ||Ψ| of a vertex of each: how a force swings with the shell. Empty where there is no Ψ.
    pub largest_swing: Vec<f64>,
    /// Number of zero modes among them.
    pub zero_modes: usize,
    /// Fields that follow moving supports, whose shapes come after the modes' in `basis`.
    pub supports: Option<SupportFields>,
    /// Φ and Ψ.
    pub basis: AnyBasis,
    /// Made when the first state with modes is.
    pub participation: OnceLock<Participation>,
}

impl ModalBasis {
    /// Stores `modes` and support fields in `precision`, with their modal rotations unless `linear`.
    pub fn new(
        shell: &Arc<Shell>,
        (modes, supports): (&Modes, Option<(SupportFields, Shapes)>),
        precision: Precision,
        linear: bool,
        progress: &mut Progress,
    ) -> Result<Self> {
        let (supports, following) = supports.unzip();
        let shapes: Vec<&[Vec3]> = modes.shapes.iter().chain(following.iter().flatten()).map(|x| &x[..]).collect();
        let shapes = &shapes[..];
        let (basis, largest_rotation, largest_swing) = match precision {
            Precision::F32 => run_time_basis(shell, shapes, linear, progress, AnyBasis::F32)?,
            Precision::F64 if Feature::F64Basis.is_built_in() => {
                run_time_basis(shell, shapes, linear, progress, AnyBasis::F64)?
            }
            Precision::I16 if Feature::I16Basis.is_built_in() => {
                run_time_basis(shell, shapes, linear, progress, AnyBasis::I16)?
            }
            _ => unreachable!("refused by Precision::require"),
        };
        Ok(Self {
            shell: shell.clone(),
            eigenvalues: modes.eigenvalues.clone(),
            largest_rotation,
            largest_swing,
            zero_modes: modes.zero_modes,
            supports,
            basis,
            participation: OnceLock::new(),
        })
    }

    /// The same modes, in the same memory, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, arithmetic: Arithmetic) -> Self {
        Self {
            shell: self.shell.clone(),
            eigenvalues: self.eigenvalues.clone(),
            largest_rotation: self.largest_rotation.clone(),
            largest_swing: self.largest_swing.clone(),
            zero_modes: self.zero_modes,
            supports: self.supports.clone(),
            basis: match &self.basis {
                AnyBasis::F32(basis) => AnyBasis::F32(basis.with_arithmetic(arithmetic)),
                AnyBasis::F64(basis) => AnyBasis::F64(basis.with_arithmetic(arithmetic)),
                AnyBasis::I16(basis) => AnyBasis::I16(basis.with_arithmetic(arithmetic)),
            },
            participation: OnceLock::new(),
        }
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        let per_mode = self.largest_rotation.iter().chain(&self.largest_swing).chain(&self.eigenvalues);
        let supports = self.supports.as_ref().is_none_or(SupportFields::is_finite);
        supports && with_basis!(&self.basis, basis => basis.is_finite()) && per_mode.into_iter().all(|x| x.is_finite())
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
        let shell = &self.shell;
        let held = |roller: &Roller| shell.mass[roller.vertex as usize] * (along - roller.free * along).norm_squared();
        let moving = shell.free.iter().map(|v| shell.mass[*v as usize]).sum::<f64>()
            - shell.rollers.iter().map(held).sum::<f64>();
        let factors = &self.participation().factors()[..self.n_modes()];
        let carried: f64 = factors.iter().map(|p| p.dot(along).powi(2)).sum();
        if moving > 0.0 { carried / moving } else { 0.0 }
    }

    /// Σ m f |φ|²/Σ m |φ|² of each mode, for factors f of the vertices: the mean over what moves in it.
    pub fn means(&self, factors: &[f64]) -> Vec<f64> {
        let mass = &self.shell.mass;
        let mean = |k: usize| {
            let (mut sum, mut whole) = (0.0, 0.0);
            for (v, (mass, factor)) in mass.iter().zip(factors).enumerate() {
                let part = mass * self.mode_at(k, v).0.norm_squared();
                (sum, whole) = (sum + factor * part, whole + part);
            }
            if whole > 0.0 { sum / whole } else { 1.0 }
        };
        (0..self.n_modes()).map(mean).collect()
    }

    /// What an acceleration that acts everywhere alike does to the modes. Made at the first call.
    pub fn participation(&self) -> &Participation {
        self.participation
            .get_or_init(|| with_basis!(&self.basis, basis => Participation::new(basis, &self.shell.mass)))
    }

    /// Number of modes.
    pub fn n_modes(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Number of modes and support fields.
    pub fn n_amplitudes(&self) -> usize {
        self.n_modes() + self.supports.as_ref().map_or(0, SupportFields::n)
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

    /// Bytes held for the run.
    pub fn bytes(&self) -> usize {
        let per_mode = 8 * (self.n_modes() + self.largest_rotation.len() + self.largest_swing.len());
        let participation = self.participation.get().map_or(0, Participation::bytes);
        let supports = self.supports.as_ref().map_or(0, SupportFields::bytes);
        with_basis!(&self.basis, basis => basis.bytes()) + per_mode + participation + supports
    }
}

/// Leaves of rotations (n_vertices) at rollers those that do not turn a displacement out of where it may be. Of a symmetry plane that is the
/// mean with the mirrored side.
fn turn_along_rollers(shell: &Shell, psi: &mut [Vec3]) {
    for roller in shell.rollers.iter() {
        let w = &mut psi[roller.vertex as usize];
        *w = roller.turns() * *w;
    }
}

/// The basis, and of each mode the largest |Ψ| and |Φ||Ψ|; none of these without Ψ.
fn run_time_basis<E: Entry>(
    shell: &Shell,
    shapes: &[&[Vec3]],
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
        let mut psi = rotation.as_ref().map_or(vec![], |rotation| rotation.apply(phi));
        if !linear {
            turn_along_rollers(shell, &mut psi);
            largest_rotation.push(psi.iter().map(wide_norm).fold(0.0, f64::max));
            let swings = psi.iter().zip(*phi).map(|(w, u)| wide_norm(w) * wide_norm(u));
            largest_swing.push(swings.fold(0.0, f64::max));
        }
        basis.set_mode(k, phi, &psi);
        progress.report(Phase::Rotation, (k + 1) as f64 / shapes.len() as f64)?;
    }
    Ok((any(basis), largest_rotation, largest_swing))
}

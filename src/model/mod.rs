//! The precomputed model: everything a state needs, immutable, shared by any number of states on any threads.

pub mod file;
pub mod front;
pub mod weight;

use crate::arithmetic::Arithmetic;
use crate::features::Feature;
use crate::method::{Method, Needs};
use crate::modal::ModalBasis;
use crate::modes::{
    Demand, Modes, PHASES, Phase, Progress, SpectrumCertificate, SupportFields, add_patches, demanded_modes,
    lowest_modes,
};
pub use crate::precision::Precision;
use crate::reduced::polynomial::Errors;
use crate::reduced::{self, ReducedShell};
use crate::reference::{self, SolverPool};
use crate::strain::RotationStrain;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use front::Front;
use std::sync::{Arc, OnceLock};
use xxhash_rust::xxh3::xxh3_64;

/// A relative error of displacements that few see.
pub(crate) const NEAR: f64 = 0.05;

/// Vertices up to which the full shell is taken in place of fields that do not hold the shell. A step of limp cloth then takes about a second on two cores, one of a hat
/// that buckles a tenth of that (`make bench-auto-steps`).
pub(crate) const MOST_FULL: usize = 2500;

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
    /// Vertices whose static answers to a push along the normal join the modes.
    pub contact_patches: Vec<u32>,
    /// Vertices that handles will hold, whose answers to pulls and turns join the fields of a reduced shell.
    pub handles: Vec<u32>,
    /// Fields that follow supports which move against each other.
    pub support_fields: usize,
    /// Whether the choice of a method may be the full shell, where fields do not hold the shell.
    pub may_be_full: bool,
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
            contact_patches: vec![],
            handles: vec![],
            support_fields: 0,
            may_be_full: false,
        }
    }
}

/// See the module's text.
pub struct Model {
    /// The physical problem.
    pub shell: Arc<Shell>,
    /// Its modes.
    pub modal: Arc<ModalBasis>,
    /// Evidence for the modes.
    pub certificate: SpectrumCertificate,
    /// How its states compute.
    pub arithmetic: Arithmetic,
    /// The same model with the other arithmetic, made when a state first asks for it.
    pub other: OnceLock<Arc<Model>>,
    /// Made when the first state of rotation–strain reconstruction is.
    pub strain: OnceLock<Arc<RotationStrain>>,
    /// By the demand it was made for, no vertex is off by more because modes were truncated; 0 without one.
    pub truncation: f64,
    /// The reduced discrete shell, if it was asked for.
    pub reduced: Option<Arc<ReducedShell>>,
    /// Why an optional reduced shell was left out; not saved.
    pub without_reduced: Option<Error>,
    /// Its choice is the full shell: fields do not hold the shell, or none were found.
    pub takes_full_shell: bool,
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
    /// Computes modes, their rotations unless for linear modal analysis, and the reduced shell if asked for. `callback` hears of progress and may stop the work with an error.
    pub fn precompute(
        shell: Arc<Shell>,
        options: &Options,
        callback: &mut dyn FnMut(Phase, f64) -> Result<()>,
    ) -> Result<Self> {
        options.precision.require()?;
        let mut progress = Progress::new(callback);
        let shell = reference::settled(&shell, &mut |share| progress.report(Phase::Assembly, 0.5 * share))?;
        let shell = if options.sag == Vec3::zeros() { shell } else { sagged(&shell, options.sag, &mut progress)? };
        let analysed = shell.clone();
        let _kept = analysed.analyses.keep(); // for all that factorize
        let (modes, truncation) = match &options.demand {
            None => (lowest_modes(&shell, options.modes, &mut progress)?, 0.0),
            Some(demand) => {
                let demand = demand.clone().validated(&shell)?;
                demanded_modes(&shell, &demand, (options.modes, options.linear), &mut progress)?
            }
        };
        let modes = add_patches(&shell, modes, &options.contact_patches)?;
        let supports = match options.support_fields {
            0 => None,
            wanted => Some(SupportFields::new(&shell, &modes, wanted)?),
        };
        let modal = ModalBasis::new(&shell, (&modes, supports), options.precision, options.linear, &mut progress)?;
        let SpectrumCertificate { residual, orthonormality, .. } = modes.certificate;
        if !(modal.is_finite() && residual.is_finite() && orthonormality.is_finite()) {
            let message = "the mode shapes leave the floating-point range: choose other units, or 64-bit precision";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        // Of a stressed shell; without stress the search finds none.
        if let Some(k) = modes.eigenvalues.iter().position(|lambda| *lambda < 0.0) {
            let message = format!(
                "mode {k} has the eigenvalue {:e} below zero: rounding hides what the stressed shell does there",
                modes.eigenvalues[k]
            );
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let (reduced, without_reduced) = match options.reduced.fields {
            0 => (None, None),
            _ => reduced_shell((&shell, &modes), options, &mut progress)?,
        };
        let training = reduced.as_ref().map_or(0, |reduced| reduced.training_bytes(shell.energy.n_elements()));
        let peak_bytes = modes.peak_bytes.max(training);
        let fingerprint = fingerprint(&shell, &modal, options.precision);
        let reduced_fingerprint = reduced_fingerprint(fingerprint, &shell, reduced.as_deref());
        let model = Self {
            reduced,
            without_reduced,
            takes_full_shell: false,
            shell,
            modal: Arc::new(modal),
            certificate: modes.certificate,
            front: None,
            arithmetic: Arithmetic::default(),
            other: OnceLock::new(),
            solvers: SolverPool::default(),
            strain: OnceLock::new(),
            truncation,
            seconds: progress.seconds,
            peak_bytes,
            fingerprint,
            reduced_fingerprint,
        };
        Ok(Self { takes_full_shell: options.may_be_full && model.suits_full_shell(), ..model })
    }

    /// Whether a training showed that fields do not hold the shell, and its mesh is small enough for the full shell. A shell that can move freely stays with fields: several handles
    /// that lead one make a step of the full shell ten times as long, and its training pulls it further than they do.
    fn suits_full_shell(&self) -> bool {
        let came_to_nothing = self.without_reduced.as_ref().is_some_and(|why| why.kind == ErrorKind::Numerical);
        let can = self.shell.mass.len() <= MOST_FULL && Feature::NonlinearShell.is_built_in();
        let is_missed = self.needs_correction() && self.modal.zero_modes == 0;
        can && (came_to_nothing || is_missed)
    }

    /// The method that was chosen for its scene. Without a choice by budget it is the full shell, where that was allowed and suits; else that of [`Model::chosen_form`].
    pub fn chosen_method(&self) -> Method {
        match &self.front {
            Some(front) => front.choice().method,
            None if self.may_move_fully() => Method::ImplicitShell,
            None => self.chosen_form(),
        }
    }

    fn may_move_fully(&self) -> bool {
        let can = self.arithmetic == Arithmetic::Fastest && Feature::NonlinearShell.is_built_in();
        self.takes_full_shell && can
    }

    /// That form of its reduced shell which the training's gate chose; without a reduced shell the warp, and where there are no rotations linear modes.
    pub fn chosen_form(&self) -> Method {
        match &self.reduced {
            Some(reduced) => match &reduced.polynomial {
                Some(polynomial) if polynomial.gate.holds() => Method::PolynomialShell,
                Some(polynomial) if polynomial.gate.holds_in_part() && reduced.rigid.is_none() => Method::AdaptiveShell,
                _ => Method::ReducedShell,
            },
            None if self.modal.is_linear() => Method::LinearModalAnalysis,
            None => Method::Warp,
        }
    }

    /// Of the equilibria that its reduced shell was trained on, what the form that the gate chose misses when it is solved for them; none of a
    /// choice by budget, or without a training.
    pub fn training_errors(&self) -> Option<Errors> {
        let gate = &self.reduced.as_ref()?.polynomial.as_ref()?.gate;
        let by_gate = self.front.is_none() && gate.tried > 0;
        let errors = if self.chosen_form() == Method::PolynomialShell { gate.polynomial } else { gate.sampled };
        by_gate.then_some(errors)
    }

    /// Whether the fields do not hold the shell: what the gate chose misses half of its training's equilibria by more than 5 %.
    pub fn needs_correction(&self) -> bool {
        let misses = self.training_errors().is_some_and(|errors| errors.median > NEAR);
        misses && Feature::NonlinearShell.require().is_ok()
    }

    /// Fails unless states of the method can be made on this model, in this build.
    pub fn require(&self, method: Method) -> Result<()> {
        match method {
            Method::ImplicitShell | Method::ExplicitShell => Feature::NonlinearShell.require()?,
            Method::ReducedShell | Method::PolynomialShell | Method::AdaptiveShell => {
                Feature::ReducedShell.require()?
            }
            _ => (),
        }
        if method == Method::RotationStrain && !self.shell.bonds.is_empty() {
            let message = "rotation-strain does not know ties: use the warp, a reduced shell or the full shell";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        let yields = self.shell.creases.yield_somewhere();
        let can_yield = matches!(method, Method::ReducedShell | Method::ImplicitShell | Method::ExplicitShell);
        if yields && !can_yield {
            let message = format!(
                "{method} keeps to one rest shape, so that creases cannot yield: use the reduced shell or the full shell, or make them elastic"
            );
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        if method == Method::RotationStrain && !self.shell.rollers.is_empty() {
            let message = "rotation-strain cannot hold vertices along some axes only: use the warp, a reduced shell or the full shell";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        if let (Needs::ReducedFields, None, Some(why)) = (method.entry().needs, &self.reduced, &self.without_reduced) {
            return Err(Error::new(ErrorKind::Unsupported, format!("the model has no reduced shell: {}", why.message)));
        }
        method.entry().needs.require(!self.modal.is_linear(), self.reduced.is_some())?;
        let by_polynomial = matches!(method, Method::PolynomialShell | Method::AdaptiveShell);
        if method == Method::AdaptiveShell && self.reduced.iter().any(|reduced| reduced.rigid.is_some()) {
            let message = "a shell that moves freely does not change its form in motion: take the polynomial or the reduced shell";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        let lacks = by_polynomial && self.reduced.iter().any(|reduced| reduced.polynomial.is_none());
        if lacks {
            let message = match () {
                () if !self.shell.bonds.is_empty() => {
                    "the energy of a shell with ties has no polynomial form: use the reduced shell"
                }
                () if self.shell.is_stressed() => {
                    "the energy of a shell with a rest shape, growth or rest angles of its own has no polynomial form: use the reduced shell"
                }
                () => "the model's reduced shell has no polynomial energy: precompute it anew",
            };
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        Ok(())
    }

    /// Fails unless a state that moves by the method computes as this model asks for.
    pub fn require_arithmetic(&self, method: Method) -> Result<()> {
        let full = matches!(method, Method::ImplicitShell | Method::ExplicitShell);
        if self.arithmetic == Arithmetic::Fastest || !full {
            return Ok(());
        }
        let message = "a deterministic state does not move by the full shell, whose sparse factors have other bits on other processors";
        Err(Error::new(ErrorKind::Unsupported, message))
    }

    /// The reduced shell. Fails where there is none.
    pub fn require_reduced(&self) -> Result<&Arc<ReducedShell>> {
        self.reduced.as_ref().ok_or_else(|| Needs::ReducedFields.unmet())
    }

    /// The model for states that compute by `arithmetic`. Both share modes and fields; the other one is made at the first call.
    pub fn with_arithmetic(self: &Arc<Self>, arithmetic: Arithmetic) -> Result<Arc<Self>> {
        if arithmetic == self.arithmetic {
            return Ok(self.clone());
        }
        if let Some(made) = self.other.get() {
            return Ok(made.clone());
        }
        let reduced = self.reduced.as_ref().map(|reduced| reduced.with_arithmetic(&self.shell, arithmetic));
        let made = Arc::new(Self {
            shell: self.shell.clone(),
            modal: Arc::new(self.modal.with_arithmetic(arithmetic)),
            certificate: self.certificate,
            strain: OnceLock::new(),
            truncation: self.truncation,
            reduced: reduced.transpose()?.map(Arc::new),
            without_reduced: self.without_reduced.clone(),
            takes_full_shell: self.takes_full_shell,
            front: self.front.clone(),
            arithmetic,
            other: OnceLock::new(),
            solvers: SolverPool::default(),
            seconds: self.seconds,
            peak_bytes: self.peak_bytes,
            fingerprint: self.fingerprint,
            reduced_fingerprint: self.reduced_fingerprint,
        });
        Ok(self.other.get_or_init(|| made).clone()) // of two callers at once both make the same
    }

    /// The map of rotation–strain reconstruction. Made at the first call.
    pub fn rotation_strain(&self) -> Result<Arc<RotationStrain>> {
        if let Some(made) = self.strain.get() {
            return Ok(made.clone());
        }
        let made = Arc::new(RotationStrain::new(&self.modal)?); // of two callers at once both make the same
        Ok(self.strain.get_or_init(|| made).clone())
    }

    /// Bytes of that map, where it was made.
    pub fn strain_bytes(&self) -> usize {
        self.strain.get().map_or(0, |strain| strain.bytes())
    }

    /// Bytes of what it does not share with the model that it was made of.
    fn own_bytes(&self) -> usize {
        let reduced = self.reduced.as_deref().map_or(0, |reduced| reduced.bytes() - reduced.field_bytes());
        reduced + self.solvers.bytes() + self.strain_bytes()
    }

    /// Bytes that stay for the run: basis, mesh, masses.
    pub fn bytes(&self) -> usize {
        let mesh = &self.shell.mesh;
        let vertices = mesh.positions.len() * (size_of::<Vec3>() + size_of::<f64>() + size_of::<u32>() + 1);
        let connectivity = mesh.triangles.len() * 12 + mesh.edges.len() * 16;
        let reduced = self.reduced.as_deref().map_or(0, ReducedShell::bytes);
        let other = self.other.get().map_or(0, |other| other.own_bytes());
        self.modal.bytes() + vertices + connectivity + reduced + self.solvers.bytes() + self.strain_bytes() + other
    }
}

/// The reduced shell, or why an optional one is left out.
fn reduced_shell(
    (shell, modes): (&Arc<Shell>, &Modes),
    options: &Options,
    progress: &mut Progress,
) -> Result<(Option<Arc<ReducedShell>>, Option<Error>)> {
    let optional = options.reduced.optional;
    if optional && options.support_fields > 0 {
        let message = "it would not follow supports that move against each other";
        return Ok((None, Some(Error::new(ErrorKind::Unsupported, message))));
    }
    let asked = (&options.reduced, &options.handles[..], options.precision);
    match ReducedShell::precompute(shell, modes, asked, progress) {
        Ok(reduced) => Ok((Some(Arc::new(reduced)), None)),
        Err(error) if optional && matches!(error.kind, ErrorKind::Unsupported | ErrorKind::Numerical) => {
            Ok((None, Some(error)))
        }
        Err(error) => Err(error),
    }
}

fn sagged(shell: &Arc<Shell>, gravity: Vec3, progress: &mut Progress) -> Result<Arc<Shell>> {
    let mut watch = |share: f64| progress.report(Phase::Assembly, 0.9 * share);
    Ok(Arc::new(reference::sagged(shell, gravity, &mut watch)?))
}

/// Hash of everything that amplitudes mean something by: mesh, supports, eigenvalues, precision.
pub(crate) fn fingerprint(shell: &Shell, modal: &ModalBasis, precision: Precision) -> u64 {
    let mut bytes: Vec<u8> = vec![];
    shell.mesh.positions.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
    shell.mesh.triangles.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes.extend(shell.held.iter().map(|held| u8::from(*held)));
    for roller in shell.rollers.iter() {
        bytes.extend(roller.vertex.to_le_bytes());
        roller.free.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    for mirror in shell.mirrors.iter() {
        mirror.ends.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        mirror.normal.iter().chain([&mirror.offset]).for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    for bond in shell.bonds.iter() {
        std::iter::once(bond.vertex).chain(bond.corners).for_each(|v| bytes.extend(v.to_le_bytes()));
        let numbers = bond.weights.into_iter().chain([bond.height, bond.stiffness]);
        numbers.for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    modal.eigenvalues.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.push(precision as u8);
    let stiffness = modal.supports.iter().flat_map(|supports| &supports.stiffness);
    stiffness.for_each(|x| bytes.extend(x.to_le_bytes()));
    xxh3_64(&bytes)
}

/// Hash of what else the amplitudes of a reduced shell mean something by: its fields, samples and stress fields.
pub(crate) fn reduced_fingerprint(fingerprint: u64, shell: &Shell, reduced: Option<&ReducedShell>) -> u64 {
    let mut bytes = fingerprint.to_le_bytes().to_vec();
    reduced.iter().for_each(|reduced| reduced.save(shell.mass.len(), &mut bytes));
    xxh3_64(&bytes)
}

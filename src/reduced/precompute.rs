//! What the precompute of a reduced shell does, in order: loads, equilibria to train on, basis and stress fields, samples, the polynomial and
//! its gate.

use super::basis::RestSolver;
use super::effort::{Budget, Effort, Size};
use super::training::{BasisInputs, TrainingLoads, TrainingPose};
use super::{AnyFields, Assumed, Fields, MAX_FIELDS, Options, ReducedShell, free_motions};
use super::{basis, polynomial, sampling, unpacked, with_fields};
use crate::features::{self, Feature, Proof};
use crate::modes::{Modes, Phase, Progress};
use crate::precision::Precision;
use crate::reference::FreeMotions;
use crate::threads::{self, Watch};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use polynomial::PolynomialEnergy;
use sampling::Whole;
use std::sync::Arc;

/// Of an optional reduced shell: iterations of its training and equilibria that it finds, at least.
const LEAST_ITERATIONS: usize = 80;
const LEAST_JUDGED: usize = 4;

/// Bytes that a training holds at most: for each pair of fields and element, of so many elements at most, and for each field and element. By what the
/// processes of nine trainings grew by, of 160 to 13,117 vertices and 28 to 50 fields (docs/evidence/training.md).
const PAIR_BYTES: f64 = 16.0;
const PAIRED_ELEMENTS: usize = 25_000;
const FIELD_BYTES: f64 = 150.0;

/// Elements by the number of their rest rows, with their weights.
type Samples = Vec<(u32, f64)>;

impl ReducedShell {
    /// On `modes` of `shell`, with the vertices that handles will hold.
    pub fn precompute(
        shell: &Arc<Shell>,
        modes: &Modes,
        (options, handles, precision): (&Options, &[u32], Precision),
        progress: &mut Progress,
    ) -> Result<Self> {
        let _proof: features::ReducedShell = Proof::of(Feature::ReducedShell)?;
        let options = &within_reach(shell, modes, options)?;
        let free = require_support(shell, modes, options)?;
        let all = modes;
        let elastic = modes.elastic();
        let modes = elastic.as_ref().unwrap_or(all);
        let searches: f64 = progress.seconds.iter().sum();
        let budget = Budget::new(options.seconds.min(options.mode_searches * searches));
        let mut report = |share: f64| progress.report(Phase::Training, share);
        report(0.0)?;
        let mut loads = TrainingLoads::new(shell, modes, (options, handles), free)?;
        let rigid = &all.shapes[..all.zero_modes];
        let rest = RestSolver::new(shell, (rigid, modes.eigenvalues[0]))?;
        loads.prepare(shell, &rest)?;
        let inputs = loads.inputs(shell, modes, (rigid, &rest))?;
        let size = Size::new(shell, &rest, modes.shapes.len(), options.fields);
        drop(rest);
        let before = budget.spent();
        let limits = (options.poses, budget.for_equilibria(&size), options.iterations);
        let trained = loads.train(shell, limits, &mut |share| report(0.1 + 0.4 * share))?;
        require_training(options, &trained)?;
        let effort = &budget.effort(&size, before);
        let mut watch = |share| report(0.5 + 0.1 * share);
        let (basis, known, assumed) =
            basis_and_stresses((&loads, &inputs, &trained), (options.fields, effort), &mut watch)?;
        report(0.6)?;
        let fields = stored(shell, &basis, precision)?;
        let columns = unpacked(shell, &fields);
        let (columns, assumed) = (&columns[..], &assumed);
        let whole = Whole::new(shell, columns, assumed);
        let ((samples, fit), polynomial) = threads::both(
            |watch| {
                let trained = (&loads, assumed, &trained[..]);
                sampled((shell, columns), (&whole, known), trained, (options, effort), watch)
            },
            |watch| {
                let (shapes, stiffness) = (&loads.shapes(shell, columns, (modes, &trained))[..], &whole.stiffness);
                let (modes, gains) = (modes.shapes.len(), effort.gains);
                let sources = polynomial::Sources { shell, columns, modes, assumed, shapes, gains, stiffness };
                polynomial::make(&sources, watch)
            },
            &mut |share| report(0.6 + 0.37 * share),
        )?;
        let assumed = assumed.at(&samples);
        let mut reduced = Self::assemble(shell, (modes.shapes.len(), fields), samples, assumed)?;
        reduced.fit = fit;
        reduced.let_go(shell, all.zero_modes)?;
        reduced.set_output(shell, precision)?;
        if let Some(mut polynomial) = polynomial {
            let mut watch = |share| report(0.97 + 0.03 * share);
            polynomial.gate = loads.gate((shell, columns, &trained), (&polynomial, &reduced.energy), &mut watch)?;
            reduced.polynomial = Some(polynomial).filter(PolynomialEnergy::is_finite);
        }
        if !reduced.is_finite() {
            let message = format!("training under reduced_gravity {:e} leaves the range of numbers", loads.gravity);
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        report(1.0)?;
        Ok(reduced)
    }
}

impl ReducedShell {
    /// About the most bytes that the training held at once, of a shell of so many elements.
    pub fn training_bytes(&self, n_elements: usize) -> usize {
        let n = self.energy.n() as f64;
        let pairs = PAIR_BYTES * n * n * n_elements.min(PAIRED_ELEMENTS) as f64;
        (pairs + FIELD_BYTES * n * n_elements as f64) as usize
    }
}

/// An optional reduced shell has no more fields than there is room for beside the modes. Fails where its training would find next to nothing.
fn within_reach(shell: &Shell, modes: &Modes, options: &Options) -> Result<Options> {
    if !options.optional {
        return Ok(*options);
    }
    if options.iterations < LEAST_ITERATIONS {
        let message = format!(
            "training on {} vertices takes too long to begin with it unasked: ask for reduced_poses",
            shell.mass.len()
        );
        return Err(Error::new(ErrorKind::Unsupported, message));
    }
    let fields = options.fields.min(MAX_FIELDS.saturating_sub(modes.shapes.len() - modes.zero_modes));
    if fields == 0 {
        let message = format!("{} modes leave no room for fields, of {MAX_FIELDS}", modes.shapes.len());
        return Err(Error::new(ErrorKind::Unsupported, message));
    }
    Ok(Options { fields, ..*options })
}

/// Fails where an optional reduced shell has too few equilibria to be judged by.
fn require_training(options: &Options, trained: &[TrainingPose]) -> Result<()> {
    let whole = trained.iter().filter(|pose| pose.whole && !pose.led).count();
    if !options.optional || whole >= LEAST_JUDGED {
        return Ok(());
    }
    let message = format!("training found {whole} equilibria within its limits, too few to judge a reduced shell by");
    Err(Error::new(ErrorKind::Numerical, message))
}

/// Fails for a shell that no reduced one is made of; what can move freely, if anything.
fn require_support(shell: &Shell, modes: &Modes, options: &Options) -> Result<Option<FreeMotions>> {
    let wanted = modes.shapes.len() - modes.zero_modes + options.fields;
    if wanted > MAX_FIELDS {
        let message = format!("{wanted} modes and fields: a reduced shell has at most {MAX_FIELDS}");
        return Err(Error::argument(message));
    }
    let unsupported = |message: &str| Err(Error::new(ErrorKind::Unsupported, message));
    if shell.settled_from.is_some() && modes.zero_modes > 0 {
        return unsupported(
            "a reduced shell that moves freely cannot have a rest shape, growth or rest angles of its own",
        );
    }
    if shell.sag.is_some() {
        return unsupported("a reduced shell must not be linearised where it hangs: sag_gravity");
    }
    if modes.shapes.is_empty() {
        return unsupported("a reduced shell needs vertices that no support holds");
    }
    if modes.zero_modes == modes.shapes.len() {
        let free = modes.zero_modes;
        let message = format!("a reduced shell needs modes that bend it: all {free} move it freely, ask for more");
        return Err(Error::new(ErrorKind::Unsupported, message));
    }
    free_motions(shell, modes.zero_modes)
}

/// B√M, how many of the fields are the modes and the weight's, and how the membrane counts on them.
fn basis_and_stresses(
    (loads, inputs, trained): (&TrainingLoads, &BasisInputs, &[TrainingPose]),
    (fields, effort): (usize, &Effort),
    watch: Watch,
) -> Result<(Mat<f64>, usize, Assumed)> {
    watch(0.0)?;
    let poses: Vec<&[Vec3]> = trained.iter().map(|pose| &pose.displacement[..]).collect();
    let (basis, known) = inputs.basis(&poses, fields)?;
    let found = basis.ncols() - inputs.modes.shapes.len(); // all else goes by these: who asks for more than there are gets the same
    let assumed = loads.assumed(inputs, (trained, found, effort), watch)?;
    Ok((basis, known, assumed))
}

/// Samples by the number of their rest rows, with their weights, and what these leave of the forces of all; the first `known` of the fields are modes
/// and what the weight does to first order.
fn sampled(
    (shell, columns): (&Shell, &[Vec<Vec3>]),
    (whole, known): (&Whole, usize),
    (loads, assumed, trained): (&TrainingLoads, &Assumed, &[TrainingPose]),
    (options, effort): (&Options, &Effort),
    watch: Watch,
) -> Result<(Samples, f64)> {
    let n_elements = whole.energy.n_elements();
    if options.elements >= n_elements {
        return Ok(((0u32..).zip(vec![1.0; n_elements]).collect(), 0.0));
    }
    let count = if options.elements > 0 { options.elements } else { effort.most * columns.len() };
    let tolerance = if options.elements > 0 { 0.0 } else { effort.tolerance };
    let poses = loads.poses((shell, assumed, effort), columns, trained, &mut |share| watch(0.3 * share))?;
    let mut watch = |share| watch(0.3 + 0.7 * share);
    let (weights, fit) = sampling::sample((shell, whole, known), (&poses, effort), (count, tolerance), &mut watch)?;
    Ok(((0u32..).zip(weights).filter(|(_, w)| *w > 0.0).collect(), fit))
}

/// The basis rounded to its run-time precision, which everything else follows from.
fn stored(shell: &Shell, basis: &Mat<f64>, precision: Precision) -> Result<AnyFields> {
    fn of<T: crate::real::Real>(shell: &Shell, basis: &Mat<f64>) -> Result<Fields<T>> {
        let mut fields = Fields::new(&shell.mesh.positions, basis.ncols(), shell.total_mass)?;
        (0..basis.ncols()).for_each(|k| fields.set(k, &basis::unscaled(shell, basis.col(k))));
        Ok(fields)
    }
    let fields = match precision {
        Precision::F64 if Feature::F64Basis.is_built_in() => AnyFields::F64(of(shell, basis)?),
        _ => AnyFields::F32(of(shell, basis)?),
    };
    if with_fields!(&fields, fields => fields.is_finite()) {
        return Ok(fields);
    }
    Err(Error::new(ErrorKind::Numerical, "the reduced basis leaves the floating-point range: choose other units"))
}

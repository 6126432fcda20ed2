//! What a reduced shell is trained on: loads and the equilibria of the full shell under them, the fields and stress fields that are
//! made of these, and the membrane's share α that suits them.

mod equilibria;
mod handles;
mod loads;

use super::basis::RestSolver;
use super::effort::Effort;
use super::polynomial::{Gate, PolynomialEnergy};
use super::{Assumed, Elastic, LEAST_SHARE, Newton, Options, Potential, ReducedEnergy, Stop, basis, sampling, stress};
use crate::modes::Modes;
use crate::reference::FreeMotions;
use crate::threads::{self, for_each_long};
use crate::{Result, Shell, Vec3};
pub(super) use equilibria::TrainingPose;
use faer::Mat;
use handles::Handles;
use loads::{Load, MOST_LEADS};
use nalgebra::DMatrix;
use std::borrow::Cow;

/// Training loads that there are, at most: those of `TrainingLoads::listed` where handles are led, at full and at half strength.
pub const MAX_POSES: usize = 2 * (8 + MOST_LEADS + 8);
/// A training's size, vertices times equilibria, unless asked otherwise.
const TRAINED: usize = 208_000;
/// The most where none is told: all there are where no handle is led.
const POSES: usize = 62;

/// Equilibria to train on unless told how many, fewer on larger meshes, so that the cost grows little.
pub fn default_poses(n_vertices: usize) -> usize {
    (TRAINED / n_vertices.max(1)).min(POSES)
}

/// Of a training that nobody asked for, iterations times vertices to the power 1.5, as which a sparse factorization grows: half a minute on a
/// processor of 2020.
const UNASKED: f64 = 8e7;

/// Iterations of a training that nobody asked for.
pub fn affordable_iterations(n_vertices: usize) -> usize {
    let n = n_vertices.max(1) as f64;
    (UNASKED / (n * n.sqrt())) as usize
}

/// Stress fields of modes bent far and of poses, as a share of the fields found: by the validation loads of docs/evidence/front.md. With
/// more the membrane locks; with fewer, what no other stress field holds is soft.
const STRESSES: f64 = 0.3;
/// What α is chosen between, where bending carries the loads and where the membrane does; by docs/evidence/front.md's validation loads and dinosaur.
const MEMBRANE_SHARES: [f64; 2] = [LEAST_SHARE, 0.2];
/// Fields are spent on what the weight does to first order beyond the modes, where that is more than this part of the most that it does.
const LEAST_WEIGHT: f64 = 0.01;
/// Equilibria that the choice takes, at least; and of the displacement, an error there that is none.
const LEAST_TRIED: usize = 5;
const LEAST_ERROR: f64 = 1e-4;
/// Every second equilibrium decides where the sums of the errors' logarithms are this far apart: a factor of 2.7 in each of four.
const CLEAR: f64 = 4.0;

/// What fields and stress fields are made of, beside poses.
pub(super) struct BasisInputs<'a> {
    pub(super) shell: &'a Shell,
    pub(super) modes: &'a Modes,
    /// Rigid motions that supports leave free; fields are orthogonal to them.
    pub(super) rigid: &'a [Vec<Vec3>],
    /// See [`TrainingLoads`] of these.
    pub(super) derivatives: Vec<Vec<Vec3>>,
    pub(super) responses: Vec<Vec<Vec3>>,
    pub(super) bent: Vec<Vec<Vec3>>,
    /// To pulls at the handles that will hold it.
    pub(super) answers: Vec<Vec<Vec3>>,
}

impl BasisInputs<'_> {
    /// The modes and `wanted` fields, in mass-scaled unknowns; and how many of them, the first, are modes or what the weight does to first order.
    pub(super) fn basis(&self, poses: &[&[Vec3]], wanted: usize) -> Result<(Mat<f64>, usize)> {
        let derivatives = self.derivatives.iter().map(Vec::as_slice);
        let candidates: Vec<&[Vec3]> = derivatives.chain(poses.iter().copied()).collect();
        let rigid = self.rigid.len();
        let first: Vec<&[Vec3]> = self.rigid.iter().chain(&self.modes.shapes).map(Vec::as_slice).collect();
        let mut basis = basis::columns(self.shell, &first);
        let whole = basis.ncols() + wanted;
        let weights = basis::columns(self.shell, &self.responses[..3]);
        basis::extend_by(&mut basis, weights, (wanted, LEAST_WEIGHT))?;
        let known = basis.ncols() - rigid;
        for more in [basis::columns(self.shell, &self.answers), basis::columns(self.shell, &candidates)] {
            let room = whole - basis.ncols();
            basis::extend(&mut basis, more, room)?;
        }
        if rigid == 0 {
            return Ok((basis, known));
        }
        Ok((basis.subcols(rigid, basis.ncols() - rigid).to_owned(), known))
    }

    /// S (stresses × the membrane's elements) beside so many fields.
    pub(super) fn stresses(&self, trained: &[&TrainingPose], fields: usize) -> Result<DMatrix<f64>> {
        let wanted = (STRESSES * fields as f64) as usize;
        let of = |led: bool| -> Vec<&[Vec3]> {
            trained.iter().filter(|pose| pose.led == led).map(|pose| &pose.displacement[..]).collect()
        };
        let poses = [&of(false)[..], &of(true)];
        let fields = stress::fields(self.shell, &self.bent, &self.derivatives, &self.responses, poses, wanted)?;
        Ok(DMatrix::from_fn(fields.ncols(), fields.nrows(), |k, e| fields[(e, k)]))
    }
}

/// The loads that fields and samples are chosen for.
pub(super) struct TrainingLoads {
    /// Strength of gravity, and how many times that which bends the shell by [`BEND`].
    pub(super) gravity: f64,
    strength: f64,
    /// Amplitude of the first mode that bends the shell by a quarter of its size.
    amplitude: f64,
    /// Far from the supports and each other.
    points: Vec<usize>,
    /// All at full strength, and the numbers of those that are taken at half strength, too.
    list: Vec<Load>,
    halved: Vec<usize>,
    /// To accelerations of frames: see [`Self::prepare`].
    responses: Vec<Vec<Vec3>>,
    /// The handles that will hold it.
    handles: Handles,
    /// What moves freely at rest; then the part of a load that would set it in motion is left out.
    free: Option<FreeMotions>,
}

/// What directions are made of.
const AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
/// When a search for them ends; and one from the shape that is to be found.
const POSE: Stop = Stop { tolerance: 1e-2, iterations: 40, led: false, near: false, least: 0.0 };
const TRIED: Stop = Stop { iterations: 12, ..POSE };
/// When one ends that an energy is judged by.
const JUDGED: Stop = Stop { tolerance: 1e-4, ..POSE };
/// Searches at once.
const MOST_SEARCHES: usize = 16;
/// Largest displacement of the first mode, in model sizes.
const BEND: f64 = 0.25;

impl TrainingLoads {
    /// ½ Θ_ij q_i q_j with q_i = a λ₁/λ_i.
    pub(super) fn weighted_derivatives(&self, modes: &Modes, rest: &RestSolver) -> Result<Vec<Vec<Vec3>>> {
        let mut derivatives = basis::modal_derivatives(rest, &modes.shapes)?;
        let l = &modes.eigenvalues;
        let pairs = (0..l.len()).flat_map(|i| (i..l.len()).map(move |j| (i, j)));
        for (field, (i, j)) in derivatives.iter_mut().zip(pairs) {
            let weight = 0.5 * self.amplitude * self.amplitude * l[0] * l[0] / (l[i] * l[j]);
            field.iter_mut().for_each(|u| *u *= weight);
        }
        Ok(derivatives)
    }

    /// What the basis and the stress fields are made of.
    pub(super) fn inputs<'a>(
        &self,
        shell: &'a Shell,
        modes: &'a Modes,
        (rigid, rest): (&'a [Vec<Vec3>], &RestSolver),
    ) -> Result<BasisInputs<'a>> {
        let derivatives = self.weighted_derivatives(modes, rest)?;
        let answers = self.handles.answers.clone();
        let responses = self.responses.iter().chain(&answers).cloned().collect();
        Ok(BasisInputs { shell, modes, rigid, derivatives, responses, bent: self.bent(modes), answers })
    }

    /// The modes at the amplitudes q_i.
    pub(super) fn bent(&self, modes: &Modes) -> Vec<Vec<Vec3>> {
        let l = &modes.eigenvalues;
        let scaled =
            |(shape, lambda): (&Vec<Vec3>, &f64)| shape.iter().map(|u| u * (self.amplitude * l[0] / lambda)).collect();
        modes.shapes.iter().zip(l).map(scaled).collect()
    }

    /// Shapes q that the shell is likely to take: the equilibria, and the modes at their amplitudes to either side.
    pub(super) fn shapes(
        &self,
        shell: &Shell,
        columns: &[Vec<Vec3>],
        (modes, trained): (&Modes, &[TrainingPose]),
    ) -> Vec<Vec<f64>> {
        let mut shapes: Vec<Vec<f64>> =
            trained.iter().map(|pose| projected(shell, columns, &pose.displacement)).collect();
        for (k, lambda) in modes.eigenvalues.iter().enumerate() {
            for side in [1.0, -1.0] {
                let amplitude = side * self.amplitude * modes.eigenvalues[0] / lambda;
                shapes.push((0..columns.len()).map(|j| if j == k { amplitude } else { 0.0 }).collect());
            }
        }
        shapes
    }

    /// How the membrane counts beside so many fields. Of α, of [`MEMBRANE_SHARES`], that is taken with which fields and stress fields of pulls alone come
    /// nearest, by the geometric mean, to equilibria under gravity and pressure, which they only nearly hold. Where bending carries the loads the membrane locks unless its
    /// share is least; where the membrane does, as in a closed trouser leg, stress fields alone are soft. Of a shell that buckles few are found whole: then
    /// halves and parts count, too. The least where there are too few equilibria to tell.
    pub(super) fn assumed(
        &self,
        inputs: &BasisInputs,
        (trained, fields, effort): (&[TrainingPose], usize, &Effort),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Assumed> {
        let shell = inputs.shell;
        let stresses = || inputs.stresses(&trained.iter().collect::<Vec<_>>(), fields);
        let (mut tried, of): (Vec<&TrainingPose>, Vec<&TrainingPose>) =
            trained.iter().partition(|pose| self.load(pose.load).is_distributed());
        let is_whole = |pose: &TrainingPose| pose.whole && pose.load < self.list.len();
        if tried.iter().filter(|pose| is_whole(pose)).count() >= LEAST_TRIED {
            tried.retain(|pose| is_whole(pose));
        }
        if tried.len() < LEAST_TRIED || of.len() < LEAST_TRIED {
            return Ok(Assumed { stresses: stresses()?, membrane_share: LEAST_SHARE });
        }
        let some = tried.len().min(effort.tried);
        let tried: Vec<&TrainingPose> = (0..some).map(|k| tried[k * tried.len() / some]).collect();
        let shapes: Vec<&[Vec3]> = of.iter().map(|pose| &pose.displacement[..]).collect();
        let pulled = || Ok((inputs.basis(&shapes, fields)?.0, inputs.stresses(&of, fields)?));
        let ((basis, pulled), stresses) = threads::both(|_| pulled(), |_| stresses(), &mut |_| watch(0.0))?;
        let columns: Vec<Vec<Vec3>> = (0..basis.ncols()).map(|k| basis::unscaled(shell, basis.col(k))).collect();
        let membrane_share = self.best_share((shell, &columns, pulled), (&tried, effort), watch)?;
        Ok(Assumed { stresses, membrane_share })
    }

    /// That of [`MEMBRANE_SHARES`] which comes nearest on the fields and stress fields. Every second equilibrium is tried first, and the others only where
    /// those leave it open.
    fn best_share(
        &self,
        (shell, columns, stresses): (&Shell, &[Vec<Vec3>], DMatrix<f64>),
        (tried, effort): (&[&TrainingPose], &Effort),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<f64> {
        let loads = self.loads(shell);
        let mut assumed = Assumed { stresses, membrane_share: LEAST_SHARE };
        let size = |q: &[f64]| norm_squared(q).sqrt();
        let energies = MEMBRANE_SHARES.map(|membrane_share| {
            assumed.membrane_share = membrane_share;
            thinned(shell, columns, &assumed, effort.tried_elements)
        });
        let mut sums = MEMBRANE_SHARES.map(|_| 0.0);
        for half in 0..2 {
            let some = || tried.iter().skip(half).step_by(2);
            let all: Vec<_> = (0..energies.len()).flat_map(|s| some().map(move |pose| (s, *pose))).collect();
            let errors = each(
                &all,
                &mut |share| watch(0.5 * (half as f64 + share)),
                || energies.each_ref().map(|_| None),
                |newtons, (s, pose)| {
                    let energy = &energies[*s];
                    let newton = newtons[*s].get_or_insert_with(|| Newton::new(energy));
                    let exact = projected(shell, columns, &pose.displacement);
                    let (mut q, force) = (exact.clone(), sampling::project(columns, &self.borne(shell, &loads, pose)));
                    newton.minimize(energy, &Potential::of_load(&force), &mut q, TRIED);
                    let way: Vec<f64> = q.iter().zip(&exact).map(|(q, exact)| q - exact).collect();
                    size(&way) / size(&exact).max(f64::MIN_POSITIVE)
                },
            )?;
            for (sum, errors) in sums.iter_mut().zip(errors.chunks_exact(some().len().max(1))) {
                *sum += errors.iter().map(|error| libm::log(error.clamp(LEAST_ERROR, f64::INFINITY))).sum::<f64>();
            }
            if (sums[0] - sums[1]).abs() > CLEAR {
                break;
            }
        }
        let best = sums.iter().zip(MEMBRANE_SHARES).filter(|(sum, _)| sum.is_finite());
        Ok(best.min_by(|a, b| a.0.total_cmp(b.0)).map_or(LEAST_SHARE, |(_, share)| share))
    }

    /// How near either energy comes to the equilibria that were found whole, each sought from where it is.
    pub(super) fn gate(
        &self,
        (shell, columns, trained): (&Shell, &[Vec<Vec3>], &[TrainingPose]),
        (polynomial, sampled): (&PolynomialEnergy, &ReducedEnergy),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Gate> {
        let loads = self.loads(shell);
        let under_load: Vec<&TrainingPose> = trained.iter().filter(|pose| pose.whole && !pose.led).collect();
        let room = || ([Newton::new(polynomial), Newton::new(sampled)], polynomial.scratch());
        let tried = each(&under_load, watch, room, |(newtons, scratch), pose| {
            let exact = projected(shell, columns, &pose.displacement);
            let force = sampling::project(columns, &self.borne(shell, &loads, pose));
            let energies: [&dyn Elastic; 2] = [polynomial, sampled];
            let size = norm_squared(&exact).sqrt();
            let mut one = [size, 0.0, 0.0];
            for ((energy, newton), error) in energies.into_iter().zip(newtons).zip(&mut one[1..]) {
                let mut q = exact.clone();
                newton.minimize(energy, &Potential::of_load(&force), &mut q, JUDGED);
                let way: f64 = q.iter().zip(&exact).map(|(q, exact)| (q - exact).powi(2)).sum();
                *error = way.sqrt() / size.max(f64::MIN_POSITIVE);
            }
            (one, polynomial.membrane(&exact, scratch).sqrt())
        })?;
        let strain = tried.iter().map(|(_, strain)| *strain).fold(0.0, f64::max);
        let tried = tried.into_iter().map(|(one, _)| one).collect();
        Ok(Gate { strain, ..Gate::of(tried, polynomial.unseen()) })
    }

    /// The load that a pose balances: of a shell that moves freely, with what its pins bear; a part of it, where the search ended there.
    fn borne<'a>(&self, shell: &Shell, loads: &'a [Vec<Vec3>], pose: &TrainingPose) -> Cow<'a, [Vec3]> {
        if self.free.is_none() && pose.whole {
            return Cow::from(&loads[pose.load][..]);
        }
        let mut force = vec![Vec3::zeros(); shell.mass.len()];
        shell.energy.add_gradient(&added(&shell.mesh.positions, &pose.displacement), &mut force);
        Cow::from(force)
    }

    /// Reduced equilibria for sampling to look at, sought from those of the full shell under the load or a part of it, and those that handles lead to.
    pub(super) fn poses(
        &self,
        (shell, assumed, effort): (&Shell, &Assumed, &Effort),
        columns: &[Vec<Vec3>],
        trained: &[TrainingPose],
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Vec<Vec<f64>>> {
        let all = &thinned(shell, columns, assumed, effort.pose_elements);
        let loads = self.loads(shell);
        let full_strength: Vec<usize> = (0..self.list.len().min(effort.sampled)).collect();
        let poses = each(
            &full_strength,
            watch,
            || Newton::new(all),
            |newton, k| {
                if self.lead(*k).is_some() {
                    let led = trained.iter().filter(|pose| pose.load == *k);
                    return led.map(|pose| projected(shell, columns, &pose.displacement)).collect();
                }
                let pose = trained.iter().rfind(|pose| self.whole_of(pose.load) == *k);
                let mut load = pose.map_or(Cow::from(&loads[*k]), |pose| self.borne(shell, &loads, pose));
                if let Some(free) = self.free.as_ref().filter(|_| pose.is_none()) {
                    free.balance(shell, &shell.mesh.positions, load.to_mut());
                }
                let load = sampling::project(columns, &load);
                let mut q =
                    pose.map_or_else(|| vec![0.0; all.n()], |pose| projected(shell, columns, &pose.displacement));
                newton.minimize(all, &Potential::of_load(&load), &mut q, if pose.is_some() { TRIED } else { POSE });
                vec![q]
            },
        )?;
        Ok(poses.into_iter().flatten().collect())
    }
}

/// What `find` makes of each item, in their order, on several threads, each with room of its own. `watch` hears the share that is done.
fn each<T: Sync, R: Send, W>(
    items: &[T],
    watch: &mut dyn FnMut(f64) -> Result<()>,
    room: impl Fn() -> W + Sync,
    find: impl Fn(&mut W, &T) -> R + Sync,
) -> Result<Vec<R>> {
    let mut made: Vec<(&T, Option<R>)> = items.iter().map(|item| (item, None)).collect();
    for_each_long(
        &mut made,
        MOST_SEARCHES,
        || Ok(room()),
        |room, (item, made), go_on| {
            go_on()?;
            *made = Some(find(room, item));
            Ok(())
        },
        &mut |done| watch(done as f64 / items.len() as f64),
    )?;
    Ok(made.into_iter().filter_map(|(_, made)| made).collect())
}

fn added(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn norm_squared(q: &[f64]) -> f64 {
    q.iter().map(|q| q * q).sum()
}

/// The q nearest to displacements `u` in the mass norm, BᵀMu.
pub(super) fn projected(shell: &Shell, columns: &[Vec<Vec3>], u: &[Vec3]) -> Vec<f64> {
    let momentum: Vec<Vec3> = u.iter().zip(&shell.mass).map(|(u, m)| u * *m).collect();
    sampling::project(columns, &momentum)
}

/// The energy on at most so many elements, evenly chosen: what is found with it need not be exact.
fn thinned(shell: &Shell, columns: &[Vec<Vec3>], assumed: &Assumed, most: usize) -> ReducedEnergy {
    let n_elements = shell.energy.n_elements();
    let kept = sampling::even_choice(n_elements, most);
    let weight = n_elements as f64 / kept.len().max(1) as f64;
    let mut weights = vec![0.0; n_elements];
    kept.iter().for_each(|e| weights[*e] = weight);
    let mut all = ReducedEnergy::new(shell, columns, &weights);
    let weights = vec![weight; all.n_elements()];
    assumed.set(&mut all, &weights, |e| kept[e]);
    all
}

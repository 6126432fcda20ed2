//! Reduced discrete shells: the full nonlinear energy of the discrete shell on a few displacement fields, u = Bq.
//!
//!   q̈ + C q̇ + Bᵀ∇E(x̄ + Bq) = BᵀF,    BᵀMB = I
//!
//! B holds the lowest modes and the fields that these need to bend without stretching ([`basis`]). ∇E is evaluated on some hundred
//! elements with nonnegative weights ([`sampling`]), so that a step's cost does not grow with the mesh; output is one pass over B. Loads
//! are linear in B: gravity has one number a field, the inertia of a moving frame r × r ones,
//!
//!   −Bᵀ M (G r + c × ṙ) = −Σ_ab G_ab (P_ab + S_ab q) − Σ_ab \[c\]×_ab S_ab q̇,
//!
//! with P_ab = Σ m b_a x̄_b and S_ab = Σ m b_a b_bᵀ, b_a being the fields' a-components at a vertex.

pub mod basis;
mod energy;
mod fields;
mod newton;
mod products;
pub mod sampling;
mod saved;
mod stress;

pub use energy::{ReducedEnergy, Scratch};
pub use fields::{Fields, MAX_FIELDS};
pub use newton::{End, Newton, Potential, Rows, Stop, Work};

use crate::energy::Curvature;
use crate::features::{self, Feature, Proof};
use crate::modes::{Modes, Phase, Progress};
use crate::precision::Precision;
use crate::reference::{EquilibriumOptions, Solver};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{DMatrix, Matrix3};
use std::sync::Arc;
use std::time::Instant;

/// What to precompute beyond the modes.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Fields beyond the modes; 0 for no reduced shell.
    pub fields: usize,
    /// Elements that the energy is evaluated on; 0 for as many as [`TOLERANCE`] asks for.
    pub elements: usize,
    /// Equilibria of the full shell that the fields are trained on, at most.
    pub poses: usize,
    /// The strength of the gravity that scenes will have; 0 for what bends the shell by a quarter of its size to first order.
    pub gravity: f64,
    /// Seconds that finding the equilibria may take; those that it does not find in time are left out.
    pub seconds: f64,
    /// The same as a multiple of the time that the modes took.
    pub mode_searches: f64,
}

/// Training loads that there are: `Scene::loads`.
pub const MAX_POSES: usize = 2 * (DISTRIBUTED + 6 * POINTS);
/// A training's size, vertices times equilibria, unless asked otherwise.
const TRAINED: usize = 208_000;

/// Equilibria to train on unless told how many: all up to 4,000 vertices, fewer on larger meshes, so that the cost grows little.
pub fn default_poses(n_vertices: usize) -> usize {
    (TRAINED / n_vertices.max(1)).min(MAX_POSES)
}

impl Default for Options {
    fn default() -> Self {
        Self { fields: 0, elements: 0, poses: 0, gravity: 0.0, seconds: f64::INFINITY, mode_searches: f64::INFINITY }
    }
}

/// Of the forces of the poses that sampling looks at, what samples may leave out when their number is not given.
pub const TOLERANCE: f64 = 0.01;
/// And their largest number then, as a multiple of the fields.
const MOST_ELEMENTS: usize = 16;
/// Stress fields of modes bent far and of poses, as a share of the fields found: by the validation loads of docs/evidence/front.md. With
/// more the membrane locks; with fewer, what no other stress field holds is soft.
const STRESSES: f64 = 0.3;
/// What α is chosen between, where bending carries the loads and where the membrane does; by docs/evidence/front.md's validation loads and dinosaur.
const OWN_SHARES: [f64; 2] = [LEAST_SHARE, 0.2];
const LEAST_SHARE: f64 = 0.003;
/// Equilibria that the choice takes, at least.
const LEAST_TRIED: usize = 5;
/// Loads of any frame that stress fields are whole for, and with them the most stress fields: those of the modes and these beside others.
const FRAME_LOADS: usize = 12;
const MAX_STRESSES: usize = MAX_FIELDS + FRAME_LOADS;

/// The run-time fields in the precision asked for.
pub enum AnyFields {
    /// [`Precision::F32`], and beside modes in 16 bits.
    F32(Fields<f32>),
    /// [`Precision::F64`].
    F64(Fields<f64>),
}

/// Calls the same code on the fields of either precision.
macro_rules! with_fields {
    ($any:expr, $fields:ident => $body:expr) => {
        match $any {
            $crate::reduced::AnyFields::F32($fields) => $body,
            $crate::reduced::AnyFields::F64($fields) if $crate::features::Feature::F64Basis.is_built_in() => $body,
            _ => unreachable!("no model has fields that its build lacks"),
        }
    };
}
pub(crate) use with_fields;

/// Everything that reduced states share.
pub struct ReducedShell {
    /// B.
    pub fields: AnyFields,
    /// E.
    pub energy: ReducedEnergy,
    /// Weights of the sampled elements, by their number among the rest rows.
    pub samples: Vec<(u32, f64)>,
    /// S at the samples of the membrane, and α.
    pub assumed: Assumed,
    /// Σ m b: the force of a uniform acceleration, a number a field.
    weight: [Vec<f64>; 3],
    /// P_ab, b by a.
    moment: [[Vec<f64>; 3]; 3],
    /// S_ab, b by a.
    inertia: [[DMatrix<f64>; 3]; 3],
    /// What the samples leave of the forces and the stiffness that they were chosen by, relative.
    pub fit: f64,
    /// Without the feature there is none.
    _proof: features::ReducedShell,
}

impl ReducedShell {
    /// On `modes` of `shell`.
    pub fn precompute(
        shell: &Arc<Shell>,
        modes: &Modes,
        options: &Options,
        precision: Precision,
        progress: &mut Progress,
    ) -> Result<Self> {
        let _proof: features::ReducedShell = Proof::of(Feature::ReducedShell)?;
        let wanted = modes.shapes.len() + options.fields;
        if wanted > MAX_FIELDS {
            return Err(Error::argument(format!(
                "{wanted} modes and fields: a reduced shell has at most {MAX_FIELDS}"
            )));
        }
        if modes.zero_modes > 0 || shell.sag.is_some() {
            let message =
                "a reduced shell must be held so that nothing moves freely, and not be linearised where it hangs";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        if modes.shapes.is_empty() {
            return Err(Error::new(ErrorKind::Unsupported, "a reduced shell needs vertices that no support holds"));
        }
        let report = |progress: &mut Progress, share: f64| progress.report(Phase::Rotation, share);
        report(progress, 0.0)?;
        let scene = Scene::new(shell, modes, options)?;
        let derivatives = scene.weighted_derivatives(shell, modes)?;
        let searches: f64 = progress.seconds.iter().sum();
        let time = options.seconds.min(options.mode_searches * searches);
        let trained = scene.train(shell, (options.poses, time), &mut |share| report(progress, 0.1 + 0.4 * share))?;
        let made = Made { shell, modes, derivatives, responses: scene.responses(shell)?, bent: scene.bent(modes) };
        let poses: Vec<&[Vec3]> = trained.iter().map(|pose| &pose.displacement[..]).collect();
        let mut watch = |share| report(progress, 0.5 + 0.1 * share);
        let basis = made.basis(&poses, options.fields)?;
        let found = basis.ncols() - modes.shapes.len(); // all else goes by these: who asks for more than there are gets the same
        let own_share = scene.own_share(&made, &trained, found, &mut watch)?;
        let assumed = Assumed { stresses: made.stresses(&poses, found)?, own_share };
        let fields = stored(shell, &basis, precision)?;
        let columns = unpacked(shell, &fields);
        let whole = vec![1.0; shell.energy.n_elements()];
        let mut all = ReducedEnergy::new(shell, &columns, &whole);
        assumed.set(&mut all, &whole, 1);
        let mut stiffness = DMatrix::zeros(all.n(), all.n());
        all.hessian(&vec![0.0; all.n()], Curvature::Exact, &mut all.scratch(), &mut stiffness);
        report(progress, 0.6)?;
        let (weights, residual) = if options.elements >= all.n_elements() {
            (vec![1.0; all.n_elements()], 0.0)
        } else {
            let count = if options.elements > 0 { options.elements } else { MOST_ELEMENTS * columns.len() };
            let tolerance = if options.elements > 0 { 0.0 } else { TOLERANCE };
            let poses = scene.poses(shell, &assumed, &columns, &mut |share| report(progress, 0.6 + 0.1 * share))?;
            let mut watch = |share| report(progress, 0.7 + 0.2 * share);
            sampling::sample(shell, &all, (&stiffness, modes.shapes.len()), (&poses, count, tolerance), &mut watch)?
        };
        let samples: Vec<(u32, f64)> = (0u32..).zip(weights).filter(|(_, w)| *w > 0.0).collect();
        let m = modes.shapes.len();
        let assumed = assumed.at(&samples);
        let mut reduced = Self::assemble(shell, fields, samples, assumed, DMatrix::zeros(m, m))?;
        reduced.fit = residual;
        if !reduced.is_finite() {
            let message = format!("training under reduced_gravity {:e} leaves the range of numbers", scene.gravity);
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        report(progress, 1.0)?;
        Ok(reduced)
    }

    /// From what is saved; everything else follows.
    pub fn assemble(
        shell: &Shell,
        fields: AnyFields,
        samples: Vec<(u32, f64)>,
        assumed: Assumed,
        correction: DMatrix<f64>,
    ) -> Result<Self> {
        let proof = Proof::of(Feature::ReducedShell)?;
        let columns = unpacked(shell, &fields);
        let mut weights = vec![0.0; shell.energy.n_elements()];
        samples.iter().for_each(|&(e, w)| weights[e as usize] = w);
        let mut energy = ReducedEnergy::new(shell, &columns, &weights);
        let sampled: Vec<f64> = samples.iter().map(|s| s.1).collect();
        assumed.set(&mut energy, &sampled, 1);
        energy.correct(correction);
        let n = columns.len();
        let (mass, rest) = (&shell.mass, &shell.mesh.positions);
        let sum = |f: &dyn Fn(usize) -> f64| -> f64 { (0..mass.len()).map(|v| mass[v] * f(v)).sum() };
        let weight = std::array::from_fn(|a| (0..n).map(|k| sum(&|v| columns[k][v][a])).collect());
        let moment = std::array::from_fn(|b| {
            std::array::from_fn(|a| (0..n).map(|k| sum(&|v| columns[k][v][a] * rest[v][b])).collect())
        });
        let component = |a: usize| Mat::from_fn(mass.len(), n, |v, k| columns[k][v][a] * mass[v].sqrt());
        let components: [Mat<f64>; 3] = std::array::from_fn(component);
        let inertia = std::array::from_fn(|b| {
            std::array::from_fn(|a| {
                let product = components[a].transpose() * &components[b];
                DMatrix::from_fn(n, n, |i, j| product[(i, j)])
            })
        });
        Ok(Self { fields, energy, samples, assumed, weight, moment, inertia, fit: 0.0, _proof: proof })
    }

    /// What is told of it and saved are numbers.
    fn is_finite(&self) -> bool {
        let weights = self.samples.iter().map(|(_, weight)| weight);
        weights.chain(self.assumed.stresses.iter()).chain([&self.fit]).all(|x| x.is_finite())
    }

    /// Modes and further fields.
    pub fn n(&self) -> usize {
        self.energy.n()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let tensors = 72 * self.n() * self.n();
        with_fields!(&self.fields, fields => fields.bytes()) + self.energy.bytes() + 12 * self.samples.len() + tensors
    }

    /// About how long a step takes, for sharing out work: a Hessian and some gradients, as measured on one machine.
    pub fn step_nanoseconds(&self) -> u64 {
        let (elements, n) = (self.samples.len() as u64, self.n() as u64);
        elements * n * (n + 30) / 2
    }

    /// Adds the force of the acceleration `a` everywhere.
    pub fn add_uniform(&self, a: &Vec3, out: &mut [f64]) {
        for (c, weight) in self.weight.iter().enumerate() {
            out.iter_mut().zip(weight).for_each(|(out, w)| *out += a[c] * w);
        }
    }

    /// Adds −Bᵀ M (G r + c × ṙ) at amplitudes `q` and rates `q_dot`.
    pub fn add_spin(&self, gradient: &Matrix3<f64>, coriolis: &Vec3, (q, q_dot): (&[f64], &[f64]), out: &mut [f64]) {
        let turning = coriolis.cross_matrix();
        for b in 0..3 {
            for a in 0..3 {
                let (g, c, s) = (gradient[(a, b)], turning[(a, b)], &self.inertia[b][a]);
                for k in 0..q.len() {
                    let along: f64 = (0..q.len()).map(|j| s[(k, j)] * (g * q[j] + c * q_dot[j])).sum();
                    out[k] -= g * self.moment[b][a][k] + along;
                }
            }
        }
    }
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

/// The columns of B (fields × n_vertices).
fn unpacked(shell: &Shell, fields: &AnyFields) -> Vec<Vec<Vec3>> {
    let n = shell.mass.len();
    with_fields!(fields, fields => (0..fields.n).map(|k| (0..n).map(|v| fields.at(k, v)).collect()).collect())
}

/// How the membrane counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Assumed {
    /// S (stresses × elements); none for the plain energy.
    pub stresses: DMatrix<f64>,
    /// α.
    pub own_share: f64,
}

impl Assumed {
    /// The membrane's own energy.
    pub fn none() -> Self {
        Self { stresses: DMatrix::zeros(0, 0), own_share: 1.0 }
    }

    /// To an energy on every so many-th of these elements, of these weights.
    fn set(&self, energy: &mut ReducedEnergy, weights: &[f64], every: usize) {
        let (t, numbers) = (self.stresses.nrows(), self.stresses.as_slice());
        if t > 0 {
            energy.assume(weights, |e| &numbers[e * every * t..][..t], self.own_share);
        }
    }

    /// On the samples among the membrane's elements.
    fn at(&self, samples: &[(u32, f64)]) -> Self {
        let elements: Vec<usize> = samples.iter().map(|s| s.0 as usize).collect();
        let sampled: Vec<usize> = elements.into_iter().filter(|e| *e < self.stresses.ncols()).collect();
        Self { stresses: self.stresses.select_columns(&sampled), ..*self }
    }
}

/// What fields and stress fields are made of, beside poses.
struct Made<'a> {
    shell: &'a Shell,
    modes: &'a Modes,
    /// See [`Scene`] of these.
    derivatives: Vec<Vec<Vec3>>,
    responses: Vec<Vec<Vec3>>,
    bent: Vec<Vec<Vec3>>,
}

impl Made<'_> {
    /// The modes and `wanted` fields, in mass-scaled unknowns.
    fn basis(&self, poses: &[&[Vec3]], wanted: usize) -> Result<Mat<f64>> {
        let derivatives = self.derivatives.iter().map(Vec::as_slice);
        let candidates: Vec<&[Vec3]> = derivatives.chain(poses.iter().copied()).collect();
        let mut basis = basis::columns(self.shell, &self.modes.shapes);
        basis::extend(&mut basis, basis::columns(self.shell, &candidates), wanted)?;
        Ok(basis)
    }

    /// S (stresses × the membrane's elements) beside so many fields.
    fn stresses(&self, poses: &[&[Vec3]], fields: usize) -> Result<DMatrix<f64>> {
        let wanted = (STRESSES * fields as f64) as usize;
        let fields = stress::fields(self.shell, &self.bent, &self.derivatives, &self.responses, poses, wanted)?;
        Ok(DMatrix::from_fn(fields.ncols(), fields.nrows(), |k, e| fields[(e, k)]))
    }
}

/// An equilibrium of the full shell to train on.
struct Pose {
    /// The number of its load.
    load: usize,
    /// Whether all of the load is balanced, or the part that was before the search grew long.
    whole: bool,
    displacement: Vec<Vec3>,
}

/// The loads that fields and samples are chosen for.
struct Scene {
    /// Strength of gravity.
    gravity: f64,
    /// Amplitude of the first mode that bends the shell by a quarter of its size.
    amplitude: f64,
    /// Far from the supports and each other.
    points: Vec<usize>,
}

/// Share of the weight that pulls at a point.
const PULL: f64 = 0.05;
const POINTS: usize = 3;
/// Loads on all of the shell, before those at points.
const DISTRIBUTED: usize = 8;
/// Fields are compressed to far less than this tolerance. Most equilibria take 5 to 20 iterations, those of a shell that buckles some 100s.
/// They are worth it (a leaf under its own weight), but take most of the time on large meshes: there the last shape before has to do.
const TRAINING: EquilibriumOptions = EquilibriumOptions { tolerance: 1e-5, first_increment: 0.5, max_iterations: 400 };
/// Iterations times vertices, at most, but no less than [`LEAST_ITERATIONS`].
const ITERATED: usize = 800_000;
const LEAST_ITERATIONS: usize = 100;
/// Poses that are nearer than this, in model sizes, are the same.
const SAME: f64 = 1e-6;
/// Elements that the poses are found with, at most.
const POSE_ELEMENTS: usize = 6000;
/// When a search for them ends; and one from the shape that is to be found.
const POSE: Stop = Stop { tolerance: 1e-2, iterations: 40, led: false, near: false };
const TRIED: Stop = Stop { iterations: 12, ..POSE };
/// Gravity to train under, at most, of that which bends the shell by [`BEND`] to first order: a metre of thin silk is at 1e7.
const MOST_GRAVITY: f64 = 1e12;
/// Largest displacement of the first mode, in model sizes.
const BEND: f64 = 0.25;

impl Scene {
    /// Fails where gravity is beyond all that bends the shell.
    fn new(shell: &Shell, modes: &Modes, options: &Options) -> Result<Self> {
        let largest = |field: &[Vec3]| field.iter().map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max);
        let amplitude = BEND * shell.mesh.size / modes.shapes.first().map_or(1.0, |shape| largest(shape));
        // λ q = g Φᵀ M 1 with the most effective direction.
        let effective = |(shape, lambda): (&Vec<Vec3>, &f64)| {
            let sum: Vec3 = shape.iter().zip(&shell.mass).map(|(u, m)| u * *m).sum();
            sum.norm() * largest(shape) / lambda
        };
        let softest = modes.shapes.iter().zip(&modes.eigenvalues).map(effective).fold(f64::MIN_POSITIVE, f64::max);
        let bending = BEND * shell.mesh.size / softest;
        let gravity = if options.gravity > 0.0 { options.gravity } else { bending };
        if !(gravity <= MOST_GRAVITY * bending && amplitude.is_finite() && gravity.is_finite()) {
            let message = format!(
                "reduced_gravity is {gravity:e}, but {bending:e} bends the shell by a quarter of its size already: at most {:e}",
                MOST_GRAVITY * bending
            );
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        Ok(Self { gravity, amplitude, points: far_points(shell, POINTS) })
    }

    /// ½ Θ_ij q_i q_j with q_i = a λ₁/λ_i.
    fn weighted_derivatives(&self, shell: &Shell, modes: &Modes) -> Result<Vec<Vec<Vec3>>> {
        let mut derivatives = basis::modal_derivatives(shell, &modes.shapes)?;
        let l = &modes.eigenvalues;
        let pairs = (0..l.len()).flat_map(|i| (i..l.len()).map(move |j| (i, j)));
        for (field, (i, j)) in derivatives.iter_mut().zip(pairs) {
            let weight = 0.5 * self.amplitude * self.amplitude * l[0] * l[0] / (l[i] * l[j]);
            field.iter_mut().for_each(|u| *u *= weight);
        }
        Ok(derivatives)
    }

    /// The rest shape's displacements to first order under accelerations that are uniform or linear in the place, as of any
    /// frame.
    fn responses(&self, shell: &Shell) -> Result<Vec<Vec<Vec3>>> {
        let rest = &shell.mesh.positions;
        let centre = rest.iter().fold(Vec3::zeros(), |sum, x| sum + x) / rest.len() as f64;
        let mut accelerations = vec![];
        for axis in (0..3).map(|a| Vec3::ith(a, 1.0)) {
            accelerations.push(vec![axis; rest.len()]);
            accelerations.extend((0..3).map(|b| rest.iter().map(|x| axis * (x - centre)[b]).collect::<Vec<_>>()));
        }
        let mut right = basis::columns(shell, &accelerations);
        basis::solve_rest(shell, &mut right)?;
        Ok((0..right.ncols()).map(|k| basis::unscaled(shell, right.col(k))).collect())
    }

    /// The modes at the amplitudes q_i.
    fn bent(&self, modes: &Modes) -> Vec<Vec<Vec3>> {
        let l = &modes.eigenvalues;
        let scaled =
            |(shape, lambda): (&Vec<Vec3>, &f64)| shape.iter().map(|u| u * (self.amplitude * l[0] / lambda)).collect();
        modes.shapes.iter().zip(l).map(scaled).collect()
    }

    /// Loads, the most telling first: gravity along ± the axes, pressure, pulls at points; all at full and at half strength.
    fn loads(&self, shell: &Shell) -> Vec<Vec<Vec3>> {
        let axes: Vec<Vec3> =
            (0..6).map(|k| if k % 2 == 0 { Vec3::ith(k / 2, 1.0) } else { Vec3::ith(k / 2, -1.0) }).collect();
        let normals = shell.mesh.normals(&shell.mesh.positions);
        let total: f64 = shell.free.iter().map(|&v| shell.mass[v as usize]).sum::<f64>() * self.gravity;
        let mut loads = vec![];
        for strength in [1.0, 0.5] {
            let g = strength * self.gravity;
            loads.extend(axes.iter().map(|axis| shell.mass.iter().map(|m| *m * g * axis).collect::<Vec<_>>()));
            for sign in [1.0, -1.0] {
                loads.push(normals.iter().zip(&shell.mass).map(|(n, m)| n * (sign * g * m)).collect());
            }
            for &point in &self.points {
                loads.extend(axes.iter().map(|axis| {
                    let mut load = vec![Vec3::zeros(); shell.mass.len()];
                    load[point] = axis * (PULL * strength * total);
                    load
                }));
            }
        }
        loads
    }

    /// Equilibria of the full shell under at most `count` loads, or under a part of those that are not found whole; those that are not found
    /// within the `time` are left out.
    fn train(
        &self,
        shell: &Arc<Shell>,
        (count, time): (usize, f64),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Vec<Pose>> {
        let mut found: Vec<Pose> = vec![];
        if count == 0 || time == 0.0 {
            return Ok(found);
        }
        let started = Instant::now();
        let in_time = || match started.elapsed().as_secs_f64() < time {
            true => Ok(()),
            false => Err(Error::new(ErrorKind::Numerical, "no time is left")),
        };
        let mut solver = Solver::new(shell.clone())?;
        let loads = self.loads(shell);
        let full_strength = loads.len() / 2;
        let wanted = count.min(loads.len());
        let max_iterations = (ITERATED / shell.mass.len()).clamp(LEAST_ITERATIONS, TRAINING.max_iterations);
        for first in 0..full_strength {
            let mut pose = vec![Vec3::zeros(); shell.mass.len()];
            // From half a load to the whole, where the half is wanted, and in quarters of it at first.
            let halves = first + full_strength < wanted;
            let first_increment = if halves { 0.5 } else { 0.25 };
            let training = EquilibriumOptions { first_increment, max_iterations, ..TRAINING };
            for k in [first + full_strength, first].into_iter().filter(|k| *k < wanted) {
                let share = found.len() as f64 / wanted as f64;
                watch(share)?;
                if in_time().is_err() {
                    return Ok(found);
                }
                let watch = &mut |_| watch(share).and_then(|()| in_time());
                let whole = match solver.equilibrium(&pose, &loads[k], &training, watch) {
                    Ok(_) => true,
                    Err(error) if error.kind == ErrorKind::Numerical => false,
                    Err(error) => return Err(error),
                };
                let displacement = solver.reached();
                let way = displacement.iter().zip(&pose).map(|(u, last)| (u - last).norm()).fold(0.0, f64::max);
                if way <= SAME * shell.mesh.size {
                    break;
                }
                pose.clone_from(&displacement);
                found.push(Pose { load: k, whole, displacement });
                if !whole {
                    break;
                }
            }
        }
        Ok(found)
    }

    /// α, of [`OWN_SHARES`]: that with which fields and stress fields of pulls alone come nearest to the equilibria under gravity and
    /// pressure, which they only nearly hold. Where bending carries the loads the membrane locks unless its share is least; where the
    /// membrane does, as in a closed trouser leg, stress fields alone are soft. The least where there are too few equilibria to tell.
    fn own_share(
        &self,
        made: &Made,
        trained: &[Pose],
        fields: usize,
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<f64> {
        let (shell, loads) = (made.shell, self.loads(made.shell));
        let full_strength = loads.len() / 2;
        let (tried, of): (Vec<&Pose>, Vec<&Pose>) =
            trained.iter().partition(|pose| pose.load % full_strength < DISTRIBUTED);
        let tried: Vec<&Pose> = tried.into_iter().filter(|pose| pose.whole && pose.load < full_strength).collect();
        if tried.len() < LEAST_TRIED || of.len() < LEAST_TRIED {
            return Ok(LEAST_SHARE);
        }
        let of: Vec<&[Vec3]> = of.into_iter().map(|pose| &pose.displacement[..]).collect();
        let basis = made.basis(&of, fields)?;
        let columns: Vec<Vec<Vec3>> = (0..basis.ncols()).map(|k| basis::unscaled(shell, basis.col(k))).collect();
        let mut assumed = Assumed { stresses: made.stresses(&of, fields)?, own_share: LEAST_SHARE };
        let size = |q: &[f64]| q.iter().map(|q| q * q).sum::<f64>().sqrt();
        let mut best = (f64::INFINITY, LEAST_SHARE);
        for (s, own_share) in OWN_SHARES.into_iter().enumerate() {
            assumed.own_share = own_share;
            let energy = thinned(shell, &columns, &assumed);
            let mut newton = Newton::new(&energy);
            let mut errors = vec![];
            for (k, Pose { load, displacement: u, .. }) in tried.iter().enumerate() {
                watch((s as f64 + k as f64 / tried.len() as f64) / OWN_SHARES.len() as f64)?;
                let momentum: Vec<Vec3> = u.iter().zip(&shell.mass).map(|(u, m)| u * *m).collect();
                let exact = sampling::project(&columns, &momentum);
                let (mut q, force) = (exact.clone(), sampling::project(&columns, &loads[*load]));
                newton.minimize(&energy, &Potential::of_load(&force), &mut q, TRIED);
                let way: Vec<f64> = q.iter().zip(&exact).map(|(q, exact)| q - exact).collect();
                errors.push(size(&way) / size(&exact).max(f64::MIN_POSITIVE));
            }
            errors.sort_by(f64::total_cmp);
            let median = errors[errors.len() / 2];
            if median < best.0 {
                best = (median, own_share);
            }
        }
        Ok(best.1)
    }

    /// Reduced equilibria for sampling to look at.
    fn poses(
        &self,
        shell: &Shell,
        assumed: &Assumed,
        columns: &[Vec<Vec3>],
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Vec<Vec<f64>>> {
        let all = &thinned(shell, columns, assumed);
        let loads = self.loads(shell);
        let full_strength = loads.len() / 2;
        let mut newton = Newton::new(all);
        let mut poses = vec![];
        for (k, load) in loads[..full_strength].iter().enumerate() {
            watch(k as f64 / full_strength as f64)?;
            let load = sampling::project(columns, load);
            let mut q = vec![0.0; all.n()];
            newton.minimize(all, &Potential::of_load(&load), &mut q, POSE);
            poses.push(q);
        }
        Ok(poses)
    }
}

/// The energy on all elements, of a large mesh on an even choice: what is found with it need not be exact.
fn thinned(shell: &Shell, columns: &[Vec<Vec3>], assumed: &Assumed) -> ReducedEnergy {
    let n_elements = shell.energy.n_elements();
    let every = n_elements.div_ceil(POSE_ELEMENTS);
    let weights: Vec<f64> = (0..n_elements).map(|e| if e % every == 0 { every as f64 } else { 0.0 }).collect();
    let mut all = ReducedEnergy::new(shell, columns, &weights);
    let weights = vec![every as f64; all.n_elements()];
    assumed.set(&mut all, &weights, every);
    all
}

/// Vertices that are far from the held ones and from each other.
fn far_points(shell: &Shell, count: usize) -> Vec<usize> {
    let x = &shell.mesh.positions;
    let mut distance = vec![f64::INFINITY; x.len()];
    let nearer = |to: usize, distance: &mut Vec<f64>| {
        distance.iter_mut().zip(x).for_each(|(d, p)| *d = d.min((p - x[to]).norm_squared()));
    };
    (0..x.len()).filter(|&v| shell.held[v]).for_each(|v| nearer(v, &mut distance));
    let mut points = vec![];
    for _ in 0..count {
        let free = shell.free.iter().map(|&v| v as usize);
        let Some(furthest) = free.max_by(|&a, &b| distance[a].total_cmp(&distance[b])) else { break };
        points.push(furthest);
        nearer(furthest, &mut distance);
    }
    points
}

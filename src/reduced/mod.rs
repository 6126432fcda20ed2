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

mod aligned;
pub mod basis;
mod effort;
mod elastic;
mod energy;
mod factor;
mod fields;
mod joined;
mod newton;
mod outer;
mod packed;
mod pair_sums;
mod placed;
pub mod polynomial;
mod precompute;
mod products;
mod pull;
mod rigid;
pub mod sampling;
mod saved;
mod stress;
mod sums;
mod training;

pub use elastic::{Elastic, Form, Scratch};
pub use energy::ReducedEnergy;
pub use factor::Factor;
pub use fields::{Fields, MAX_FIELDS};
pub use joined::{Joined, Places};
pub use newton::{End, Newton, Potential, Rows, Stop, Work};
pub use packed::PackedFields;
pub use products::sum_of;
pub use pull::{Flight, Pull};
pub use rigid::{Moments, Rigid, WithRigid, crossed, free_motions};
pub use training::{MAX_POSES, affordable_iterations, default_poses};

use crate::arithmetic::Arithmetic;
use crate::features::{self, Feature, Proof};
use crate::precision::Precision;
use crate::{Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{DMatrix, Matrix3};
use polynomial::PolynomialEnergy;
use std::sync::Arc;

/// What to precompute beyond the modes.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Fields beyond the modes; 0 for no reduced shell.
    pub fields: usize,
    /// Elements that the energy is evaluated on; 0 for as many as [`TOLERANCE`] asks for.
    pub elements: usize,
    /// Equilibria of the full shell that the fields are trained on, at most; 0 for no training.
    pub poses: usize,
    /// The strength of the gravity that scenes will have; 0 for what bends the shell by a quarter of its size to first order.
    pub gravity: f64,
    /// Seconds that all of the training may take, about: equilibria that are not found in time for the rest are left out (`effort`).
    pub seconds: f64,
    /// The same as a multiple of the time that the modes took.
    pub mode_searches: f64,
    /// Iterations that finding the equilibria may take in all: a limit that is the same on every machine.
    pub iterations: usize,
    /// The model is left without where the shell can have no reduced shell, or where its training finds too little to judge one by.
    pub optional: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fields: 0,
            elements: 0,
            poses: 0,
            gravity: 0.0,
            seconds: f64::INFINITY,
            mode_searches: f64::INFINITY,
            iterations: usize::MAX,
            optional: false,
        }
    }
}

/// Fields of a choice of the method unless others are asked for.
pub const FIELDS: usize = 40;
/// The same where handles of a shell that is held are known.
pub const FIELDS_WITH_HANDLES: usize = 64;
/// Of the forces of the poses that sampling looks at, what samples may leave out when their number is not given.
pub const TOLERANCE: f64 = 0.01;
/// The least α that a training chooses.
const LEAST_SHARE: f64 = 0.003;
/// Loads of any frame that stress fields are whole for, and with them the most stress fields: those of the modes, these and that of rest beside others.
const FRAME_LOADS: usize = 12;
const MAX_STRESSES: usize = MAX_FIELDS + FRAME_LOADS + 1;

/// Shapes that a step of the polynomial looks at, Hessians, and multiplications in a nanosecond, as measured on leaves that swing.
const SHAPES: f64 = 3.5;
const HESSIANS: f64 = 3.0;
const MULTIPLICATIONS: f64 = 7.0;

/// The run-time fields in the precision asked for.
#[derive(Clone)]
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
    /// How many of the fields, the first, are the modes.
    modes: usize,
    /// B.
    pub fields: AnyFields,
    /// B in 16 bits for output, where the model's basis is.
    pub packed: Option<PackedFields>,
    /// E.
    pub energy: ReducedEnergy,
    /// E as a polynomial, of models that were trained with one.
    pub polynomial: Option<PolynomialEnergy>,
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
    /// Of a shell that supports leave free.
    pub rigid: Option<Rigid>,
    /// What the samples leave of the forces and the stiffness that they were chosen by, relative.
    pub fit: f64,
    /// Without the feature there is none.
    _proof: features::ReducedShell,
}

impl ReducedShell {
    /// From what is saved; everything else follows. Of the fields, the first `modes` are the modes.
    pub fn assemble(
        shell: &Shell,
        (modes, fields): (usize, AnyFields),
        samples: Vec<(u32, f64)>,
        assumed: Assumed,
    ) -> Result<Self> {
        Self::assemble_by(Arithmetic::default(), shell, (modes, fields), samples, assumed)
    }

    fn assemble_by(
        arithmetic: Arithmetic,
        shell: &Shell,
        (modes, fields): (usize, AnyFields),
        samples: Vec<(u32, f64)>,
        assumed: Assumed,
    ) -> Result<Self> {
        let proof = Proof::of(Feature::ReducedShell)?;
        let columns = unpacked(shell, &fields);
        let mut weights = vec![0.0; shell.energy.n_elements()];
        samples.iter().for_each(|&(e, w)| weights[e as usize] = w);
        let mut energy = ReducedEnergy::new(shell, &columns, &weights);
        energy.arch = arithmetic.arch();
        let sampled: Vec<f64> = samples.iter().map(|s| s.1).collect();
        assumed.set(&mut energy, &sampled, |e| e);
        let n = columns.len();
        let (mass, rest) = (&shell.mass, &shell.mesh.positions);
        let sum = |f: &dyn Fn(usize) -> f64| -> f64 { (0..mass.len()).map(|v| mass[v] * f(v)).sum() };
        let weight = std::array::from_fn(|a| (0..n).map(|k| sum(&|v| columns[k][v][a])).collect());
        let moment = std::array::from_fn(|b| {
            std::array::from_fn(|a| (0..n).map(|k| sum(&|v| columns[k][v][a] * rest[v][b])).collect())
        });
        let component = |a: usize| Mat::from_fn(mass.len(), n, |v, k| columns[k][v][a] * mass[v].sqrt());
        let components: [Mat<f64>; 3] = std::array::from_fn(component);
        let inertia =
            std::array::from_fn(|b| std::array::from_fn(|a| product(arithmetic, &components[a], &components[b])));
        Ok(Self {
            modes,
            fields,
            packed: None,
            energy,
            polynomial: None,
            samples,
            assumed,
            weight,
            moment,
            inertia,
            rigid: None,
            fit: 0.0,
            _proof: proof,
        })
    }

    /// The same fields, in the same memory, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, shell: &Shell, arithmetic: Arithmetic) -> Result<Self> {
        let fields = match &self.fields {
            AnyFields::F32(fields) => AnyFields::F32(fields.with_arithmetic(arithmetic)),
            AnyFields::F64(fields) => AnyFields::F64(fields.with_arithmetic(arithmetic)),
        };
        let (samples, assumed) = (self.samples.clone(), self.assumed.clone());
        let mut made = Self::assemble_by(arithmetic, shell, (self.modes, fields), samples, assumed)?;
        if let Some(correction) = self.energy.correction() {
            made.energy.set_correction(correction.clone());
        }
        let polynomial = self.polynomial.as_ref().map(|polynomial| polynomial.with_arithmetic(arithmetic));
        Ok(Self { polynomial, packed: self.packed.clone(), fit: self.fit, rigid: self.rigid.clone(), ..made })
    }

    /// Takes rest angles of creases that yield, in a copy of its own if others share it; false where they are those already.
    pub fn set_rest_angles(shared: &mut Arc<Self>, angles: &[f64]) -> bool {
        if shared.energy.yielding().is_none_or(|yielding| yielding.rest_angles() == angles) {
            return false;
        }
        if Arc::get_mut(shared).is_none()
            && let Some(own) = shared.own()
        {
            *shared = Arc::new(own);
        }
        if let Some(own) = Arc::get_mut(shared) {
            own.energy.set_rest_angles(angles);
        }
        true
    }

    /// A copy with an energy of its own, of a shell with creases that yield. The fields are in the same memory.
    fn own(&self) -> Option<Self> {
        Some(Self {
            modes: self.modes,
            fields: self.fields.clone(),
            packed: self.packed.clone(),
            energy: self.energy.own()?,
            polynomial: None,
            samples: self.samples.clone(),
            assumed: self.assumed.clone(),
            weight: self.weight.clone(),
            moment: self.moment.clone(),
            inertia: self.inertia.clone(),
            rigid: self.rigid.clone(),
            fit: self.fit,
            _proof: Proof::of(Feature::ReducedShell).ok()?,
        })
    }

    /// Output in the precision of the model's basis.
    pub fn set_output(&mut self, shell: &Shell, precision: Precision) -> Result<()> {
        if precision == Precision::I16 {
            self.packed = Some(PackedFields::new(&shell.mesh.positions, &unpacked(shell, &self.fields))?);
        }
        Ok(())
    }

    /// Lets it move by what supports leave free, on a model of so many zero modes.
    pub fn let_go(&mut self, shell: &Shell, zero_modes: usize) -> Result<()> {
        self.rigid = match free_motions(shell, zero_modes)? {
            None => None,
            Some(free) => Some(Rigid::new(shell, &free, &unpacked(shell, &self.fields))?),
        };
        Ok(())
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

    /// Fields beyond the modes.
    pub fn n_trained(&self) -> usize {
        self.n() - self.modes
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let tensors = 72 * self.n() * self.n();
        self.field_bytes()
            + self.energy.bytes()
            + self.polynomial.as_ref().map_or(0, PolynomialEnergy::bytes)
            + 12 * self.samples.len()
            + tensors
    }

    /// Bytes of the run-time fields alone.
    pub fn field_bytes(&self) -> usize {
        with_fields!(&self.fields, fields => fields.bytes()) + self.packed.as_ref().map_or(0, PackedFields::bytes)
    }

    /// E in one form; the polynomial of models that have one.
    pub fn elastic(&self, form: Form) -> &dyn Elastic {
        match (form, &self.polynomial) {
            (Form::Polynomial, Some(polynomial)) => polynomial,
            _ => &self.energy,
        }
    }

    /// About how long a step takes, for sharing out work: a Hessian and some gradients, as measured on one machine.
    pub fn step_nanoseconds(&self, form: Form) -> u64 {
        if let (Form::Polynomial, Some(polynomial)) = (form, &self.polynomial) {
            let [shape, hessian] = polynomial.operations();
            return ((SHAPES * shape + HESSIANS * hessian) / MULTIPLICATIONS) as u64;
        }
        let (elements, n) = (self.samples.len() as u64, self.n() as u64);
        elements * n * (n + 30) / 2
    }

    /// Bᵀ M f B with factors f of the vertices. By plain sums, whose bits are the same on every processor.
    pub fn mass_by(&self, shell: &Shell, factors: &[f64]) -> DMatrix<f64> {
        let columns = unpacked(shell, &self.fields);
        let weighed: Vec<f64> = shell.mass.iter().zip(factors).map(|(mass, factor)| mass * factor).collect();
        let product =
            |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).zip(&weighed).map(|((a, b), m)| m * a.dot(b)).sum::<f64>();
        let mut out = DMatrix::zeros(columns.len(), columns.len());
        for i in 0..columns.len() {
            for j in 0..=i {
                let entry = product(&columns[i], &columns[j]);
                (out[(i, j)], out[(j, i)]) = (entry, entry);
            }
        }
        out
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

/// AᵀB. The portable one has plain sums, vertex after vertex.
fn product(arithmetic: Arithmetic, a: &Mat<f64>, b: &Mat<f64>) -> DMatrix<f64> {
    match arithmetic {
        Arithmetic::Fastest => {
            let product = a.transpose() * b;
            DMatrix::from_fn(product.nrows(), product.ncols(), |i, j| product[(i, j)])
        }
        Arithmetic::Portable => DMatrix::from_fn(a.ncols(), b.ncols(), |i, j| {
            a.col(i).iter().zip(b.col(j).iter()).map(|(a, b)| a * b).sum()
        }),
    }
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
    pub membrane_share: f64,
}

impl Assumed {
    /// The membrane's own energy.
    pub fn none() -> Self {
        Self { stresses: DMatrix::zeros(0, 0), membrane_share: 1.0 }
    }

    /// To an energy on some of these elements, of these weights; which is told by `number`.
    fn set(&self, energy: &mut ReducedEnergy, weights: &[f64], number: impl Fn(usize) -> usize) {
        let (t, numbers) = (self.stresses.nrows(), self.stresses.as_slice());
        if t > 0 {
            energy.assume(weights, |e| &numbers[number(e) * t..][..t], self.membrane_share);
        }
        energy.balance();
    }

    /// On the samples among the membrane's elements.
    fn at(&self, samples: &[(u32, f64)]) -> Self {
        let elements: Vec<usize> = samples.iter().map(|s| s.0 as usize).collect();
        let sampled: Vec<usize> = elements.into_iter().filter(|e| *e < self.stresses.ncols()).collect();
        Self { stresses: self.stresses.select_columns(&sampled), ..*self }
    }
}

//! Rotation–strain reconstruction (Huang, Tong, Zhou, Bao, "Interactive shape interpolation through controllable dynamic
//! deformation", TVCG 2011): each triangle is turned by the rotation of its modal displacement and keeps its linear strain
//! ([`sample`]), and positions are those whose triangles come nearest to that ([`poisson`]). What bends without stretching stays
//! as long as it is, which the warp's vertices, turned one by one, do not.
//!
//! A state does not solve for positions. What is beyond linear in the triangles' gradients, N, is that of a few of them with constant
//! weights (`fit`), so that the Poisson solve is done once for each of these, ahead:
//!
//!   u(q) = Φq + Σ_c N(Σ_k q_k G_ck) b_c,      f_k = Φ_kᵀF + Σ_c (∂N_c/∂q_k) : Σ_i F_i b_ciᵀ.
//!
//! f is the exact gradient of the loads' work. Where a load is the same everywhere the sums over vertices are known ahead, and a
//! step visits none.

mod fields;
mod fit;
mod force;
mod output;
pub mod poisson;
pub mod sample;

pub use fit::{MOST_SAMPLES, REACH, TOLERANCE};
pub use force::Scratch;

use crate::modal::{AnyBasis, ModalBasis};
use crate::precision::Precision;
use crate::{Error, ErrorKind, Result, Vec3};
use fields::Fields;
use fit::{Fit, combined, modal_gradients};
use nalgebra::Matrix3;
use poisson::Poisson;

/// In the precision that the basis is computed with.
enum AnyFields {
    F32(Fields<f32>),
    F64(Fields<f64>),
}

/// The map from amplitudes to positions of one modal. See the module's text.
pub struct RotationStrain {
    /// G_ck at c modes + k.
    gradients: Vec<Matrix3<f64>>,
    /// Σ m b_c of each sample.
    weighted: Vec<Vec3>,
    fields: AnyFields,
    /// Part of N that the samples leave, root mean square over triangles and the poses they were fitted to.
    pub left: f64,
}

/// Calls the same code on the basis and the fields of either precision.
macro_rules! with_fields {
    ($modal:expr, $strain:expr, $basis:ident, $fields:ident => $body:expr) => {
        match (&$modal.basis, &$strain.fields) {
            (AnyBasis::F32($basis), AnyFields::F32($fields)) => $body,
            (AnyBasis::I16($basis), AnyFields::F32($fields)) if Feature::I16Basis.is_built_in() => $body,
            (AnyBasis::F64($basis), AnyFields::F64($fields)) if Feature::F64Basis.is_built_in() => $body,
            _ => unreachable!("the fields have the basis's precision"),
        }
    };
}
use with_fields;

impl RotationStrain {
    /// Chooses samples that leave no more than [`TOLERANCE`] of N, and solves for their fields.
    pub fn new(modal: &ModalBasis) -> Result<Self> {
        Self::with_tolerance(modal, TOLERANCE)
    }

    /// As [`RotationStrain::new`] with another tolerance; never more than [`MOST_SAMPLES`].
    pub fn with_tolerance(modal: &ModalBasis, tolerance: f64) -> Result<Self> {
        let shell = &modal.shell;
        let poisson = Poisson::new(shell)?;
        let fit = Fit::new(modal, &poisson, tolerance);
        let n = fit.samples.len();
        let fields = poisson.solve(shell, n, |t, weights| fit.weights(modal, &poisson, t, weights))?;
        let gradients = fit.samples.iter().flat_map(|t| modal_gradients(modal, &poisson, *t)).collect();
        let fields = match modal.precision() {
            Precision::F64 => AnyFields::F64(Fields::new(&fields, shell.mass.len())?),
            Precision::F32 | Precision::I16 => AnyFields::F32(Fields::new(&fields, shell.mass.len())?),
        };
        let mut made = Self { gradients, weighted: vec![], fields, left: fit.left };
        let weighted = |c: usize| shell.mass.iter().enumerate().map(|(v, m)| *m * made.field(c, v)).sum();
        made.weighted = (0..n).map(weighted).collect();
        let finite = match &made.fields {
            AnyFields::F32(fields) => fields.is_finite(),
            AnyFields::F64(fields) => fields.is_finite(),
        };
        if !finite || made.weighted.iter().flatten().any(|x| !x.is_finite()) {
            let message = "the rotation-strain fields leave the floating-point range: choose other units";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        Ok(made)
    }

    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.weighted.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let fields = match &self.fields {
            AnyFields::F32(fields) => fields.bytes(),
            AnyFields::F64(fields) => fields.bytes(),
        };
        fields + self.gradients.len() * size_of::<Matrix3<f64>>() + self.weighted.len() * size_of::<Vec3>()
    }

    /// b_c at a vertex.
    pub fn field(&self, c: usize, v: usize) -> Vec3 {
        match &self.fields {
            AnyFields::F32(fields) => fields.at(c, v),
            AnyFields::F64(fields) => fields.at(c, v),
        }
    }

    /// G_ck of sample `c`, by mode.
    fn of_sample(&self, c: usize) -> &[Matrix3<f64>] {
        let modes = self.gradients.len() / self.n_samples();
        &self.gradients[c * modes..(c + 1) * modes]
    }

    /// What `make` gives of each sample, in the room for as many.
    fn each<'a>(
        &self,
        room: &'a mut [Matrix3<f64>; MOST_SAMPLES],
        make: impl Fn(&[Matrix3<f64>]) -> Matrix3<f64>,
    ) -> &'a [Matrix3<f64>] {
        (0..self.n_samples()).for_each(|c| room[c] = make(self.of_sample(c)));
        &room[..self.n_samples()]
    }

    /// N_c at amplitudes `q`.
    fn remainders<'a>(&self, room: &'a mut [Matrix3<f64>; MOST_SAMPLES], q: &[f64]) -> &'a [Matrix3<f64>] {
        self.each(room, |gradients| sample::remainder(&combined(gradients, q)))
    }

    /// u at a vertex.
    pub fn displacement(&self, modal: &ModalBasis, v: usize, q: &[f64]) -> Vec3 {
        let linear: Vec3 = (0..q.len()).map(|k| q[k] * modal.mode_at(k, v).0).sum();
        let beyond = |c: usize| sample::remainder(&combined(self.of_sample(c), q)) * self.field(c, v);
        linear + (0..self.n_samples()).map(beyond).sum::<Vec3>()
    }

    /// Hands the slope ∂(direction · u_v)/∂q_k of each mode to `visit`.
    pub fn slopes(
        &self,
        modal: &ModalBasis,
        (v, direction): (usize, &Vec3),
        q: &[f64],
        mut visit: impl FnMut(usize, f64),
    ) {
        let mut room = [Matrix3::zeros(); MOST_SAMPLES];
        for c in 0..self.n_samples() {
            let on_sample = direction * self.field(c, v).transpose();
            room[c] = sample::pull_back(&combined(self.of_sample(c), q), &on_sample);
        }
        for k in 0..q.len() {
            let beyond = (0..self.n_samples()).map(|c| room[c].dot(&self.of_sample(c)[k])).sum::<f64>();
            visit(k, direction.dot(&modal.mode_at(k, v).0) + beyond);
        }
    }

    /// Sets what all vertices share at `q`: N_c of each sample, and with `slopes` each ∂N_c/∂q_k at c modes + k behind them.
    pub fn share(&self, q: &[f64], slopes: bool, shared: &mut Vec<Matrix3<f64>>) {
        shared.clear();
        shared.extend((0..self.n_samples()).map(|c| sample::remainder(&combined(self.of_sample(c), q))));
        for c in (0..self.n_samples()).filter(|_| slopes) {
            let gradients = self.of_sample(c);
            sample::remainder_rates(&combined(gradients, q), gradients, |rate| shared.push(rate));
        }
    }
}

//! The direction of a search where a map moves vertices, by nalgebra's matrices.
//!
//! Rotation–strain between a thin plate and a hard handle turns on the last digits: draws of `contact_fast` rest on this order of sums.

use super::shapes::{At, Placing, Shapes};
use super::square::rows;
use crate::Vec3;
use crate::energy::Curvature;
use crate::point_energy::PointEnergy;
use crate::warp::Entry;
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, MatrixXx3};

/// Room for it.
#[derive(Clone)]
pub struct Mapped {
    gradient: DVector<f64>,
    direction: DVector<f64>,
    /// Taken out while it is factorized.
    hessian: Option<DMatrix<f64>>,
    jacobian: MatrixXx3<f64>,
    /// J H.
    turned: MatrixXx3<f64>,
}

impl Mapped {
    /// For so many modes.
    pub fn new(modes: usize) -> Self {
        Self {
            gradient: DVector::zeros(modes),
            direction: DVector::zeros(modes),
            hessian: Some(DMatrix::zeros(modes, modes)),
            jacobian: MatrixXx3::zeros(modes),
            turned: MatrixXx3::zeros(modes),
        }
    }

    /// Sets Δ; returns the slope along it, or none without a finite one. `padded` is room for J.
    pub fn find_direction<E: Entry>(
        &mut self,
        (placing, energy, shapes): (&Placing<E>, &dyn PointEnergy, &Shapes),
        (gamma, center, at): (&[f64], &[f64], At),
        (padded, way): (&mut [f64], &mut [f64]),
    ) -> Option<f64> {
        let n = gamma.len();
        let Self { gradient, direction, jacobian, turned, .. } = self;
        let mut hessian = self.hessian.take().unwrap_or_else(|| DMatrix::zeros(n, n));
        hessian.fill(0.0);
        for k in 0..n {
            gradient[k] = (at.q[k] - center[k]) / gamma[k];
            hessian[(k, k)] = gamma[k].recip();
        }
        for (i, point) in energy.points().iter().enumerate() {
            let x = placing.place_point(point, shapes, i, at);
            placing.derive_point(point, shapes, i, at, (n, padded));
            for (axis, row) in rows(padded, padded.len() / 3).into_iter().enumerate() {
                jacobian.column_mut(axis).copy_from_slice(&row[..n]);
            }
            let (force, stiffness) = (energy.gradient_at(i, &x), energy.hessian_at(i, &x, Curvature::Semidefinite));
            if stiffness != Matrix3::zeros() {
                turned.gemm(1.0, jacobian, &stiffness, 0.0);
                add_lower(turned, jacobian, &mut hessian);
            }
            if force != Vec3::zeros() {
                gradient.gemv(1.0, jacobian, &force, 1.0);
            }
        }
        let factor = Cholesky::new(hessian)?; // reads the lower half
        direction.copy_from(gradient);
        direction.neg_mut();
        factor.solve_mut(direction);
        self.hessian = Some(factor.unpack_dirty());
        way.copy_from_slice(direction.as_slice());
        let slope = gradient.dot(direction);
        slope.is_finite().then_some(slope)
    }
}

/// Adds the lower half of A Bᵀ, which is symmetric.
fn add_lower(a: &MatrixXx3<f64>, b: &MatrixXx3<f64>, out: &mut DMatrix<f64>) {
    let n = a.nrows();
    let [x, y, z] = [0, 1, 2].map(|c| &a.as_slice()[c * n..][..n]);
    for (k, column) in out.as_mut_slice().chunks_exact_mut(n).enumerate() {
        let (s, t, u) = (b[(k, 0)], b[(k, 1)], b[(k, 2)]);
        for (((sum, x), y), z) in column[k..].iter_mut().zip(&x[k..]).zip(&y[k..]).zip(&z[k..]) {
            *sum += s * x + t * y + u * z;
        }
    }
}

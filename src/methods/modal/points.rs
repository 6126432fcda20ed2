//! The end of a modal step under an energy W of single points ([`crate::point_energy`]).
//!
//! With c the end of the step without W and Γ the integrator's (`Oscillator::handle_response`), q⁺ = c − ΓJᵀ∇W(x(q⁺)), as constraints have
//! it. That is the minimum of
//!
//!   ½ (q − c)ᵀ Γ⁻¹ (q − c) + W(x(q)),
//!
//! found by Newton's method with JᵀHJ for the Hessian of W, H semidefinite: a descent direction whatever the shape, and a line search.

use super::constraints::VertexMap;
use crate::Vec3;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use crate::warp::{Basis, Entry, warp_with_derivative};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, MatrixXx3};

/// Newton steps and halvings of one, at most.
const STEPS: usize = 60;
const HALVINGS: usize = 40;
/// Sufficient decrease, as a share of the slope's promise.
const DECREASE: f64 = 1e-4;
/// Converged when a step would gain this part of the terms' size: of q, its root.
const GAIN: f64 = 1e-22;
/// Of these terms, what rounding may hide.
const ROUNDING: f64 = 1e-15;

/// How amplitudes place vertices, frame axes.
pub struct Placing<'a, E: Entry> {
    pub basis: &'a Basis<E>,
    /// u = R̃Φq, or u = Φq.
    pub warped: bool,
    pub rest: &'a [Vec3],
    /// What moves vertices instead.
    pub vertices: Option<&'a dyn VertexMap>,
}

impl<E: Entry> Placing<'_, E> {
    /// x of vertex `v`, with u and its parts as [`warp_with_derivative`] has them.
    fn place(&self, v: usize, q: &[f64]) -> (Vec3, [Matrix3<f64>; 2]) {
        let (mut linear, mut w) = (Vec3::zeros(), Vec3::zeros());
        for (k, q) in q.iter().enumerate() {
            let (phi, psi) = self.basis.at(k, v);
            linear += *q * phi;
            w += *q * psi;
        }
        let (u, by_linear, by_w) = warp_with_derivative(&w, &linear, self.warped);
        let u = self.vertices.map_or(u, |map| map.displacement(v, q));
        (self.rest[v] + u, [by_linear, by_w])
    }

    /// x of vertex `v`; adds w ∂x/∂q to J (modes × 3).
    fn derivative(&self, (v, w): (usize, f64), q: &[f64], jacobian: &mut MatrixXx3<f64>) -> Vec3 {
        let (x, [by_linear, by_w]) = self.place(v, q);
        if let Some(map) = self.vertices {
            for axis in 0..3 {
                map.slopes((v, &Vec3::ith(axis, 1.0)), q, &mut |k, slope| jacobian[(k, axis)] += w * slope);
            }
            return x;
        }
        for k in 0..q.len() {
            let (phi, psi) = self.basis.at(k, v);
            let motion = w * (by_linear * phi + by_w * psi);
            (0..3).for_each(|axis| jacobian[(k, axis)] += motion[axis]);
        }
        x
    }
}

/// Room for the search; none before the first.
#[derive(Clone)]
pub struct PointSearch {
    /// Γ and r of each mode.
    pub gamma: Vec<f64>,
    pub rate: Vec<f64>,
    /// q and q̇ at the end of the step without constraints and W.
    pub free: [Vec<f64>; 2],
    /// c, and q⁺.
    pub center: Vec<f64>,
    pub moved: Vec<f64>,
    gradient: DVector<f64>,
    /// Δ.
    direction: DVector<f64>,
    /// Taken out while it is factorized.
    hessian: Option<DMatrix<f64>>,
    jacobian: MatrixXx3<f64>,
    trial: Vec<f64>,
}

impl PointSearch {
    /// For so many modes.
    pub fn new(modes: usize) -> Self {
        Self {
            gamma: vec![0.0; modes],
            rate: vec![0.0; modes],
            free: [vec![0.0; modes], vec![0.0; modes]],
            center: vec![0.0; modes],
            moved: vec![0.0; modes],
            gradient: DVector::zeros(modes),
            direction: DVector::zeros(modes),
            hessian: Some(DMatrix::zeros(modes, modes)),
            jacobian: MatrixXx3::zeros(modes),
            trial: vec![0.0; modes],
        }
    }

    /// Moves q⁺ from any guess to the minimum about c.
    pub fn minimize<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy) {
        let (center, mut q) = (std::mem::take(&mut self.center), std::mem::take(&mut self.moved));
        self.descend(placing, energy, &center, &mut q);
        (self.center, self.moved) = (center, q);
    }

    fn descend<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64], q: &mut [f64]) {
        for _ in 0..STEPS {
            let Some(slope) = self.find_direction(placing, energy, center, q) else { return };
            let (value, size) = self.value(placing, energy, center, q);
            if -slope <= GAIN * size {
                return;
            }
            let mut share = 1.0;
            for halving in 0..=HALVINGS {
                if halving == HALVINGS {
                    return; // as near as rounding lets it
                }
                (0..q.len()).for_each(|k| self.trial[k] = q[k] + share * self.direction[k]);
                let change = self.value(placing, energy, center, &self.trial).0 - value;
                if change <= DECREASE * share * slope + ROUNDING * size {
                    break;
                }
                share *= 0.5;
            }
            q.copy_from_slice(&self.trial);
        }
    }

    /// What is minimized, and the size of its terms.
    fn value<E: Entry>(&self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64], q: &[f64]) -> (f64, f64) {
        let (mut value, mut size) = (0.0, f64::MIN_POSITIVE);
        for k in 0..q.len() {
            value += 0.5 * (q[k] - center[k]).powi(2) / self.gamma[k];
            size += (q[k] * q[k] + center[k] * center[k]) / self.gamma[k];
        }
        let joined = |(i, point): (usize, &Point)| energy.value_at(i, &point.place(|v| placing.place(v, q).0));
        (value + energy.points().iter().enumerate().map(joined).sum::<f64>(), size)
    }

    /// Sets Δ; returns the slope along it, or none without a finite one.
    fn find_direction<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        q: &[f64],
    ) -> Option<f64> {
        let Self { gamma, gradient, direction, jacobian, .. } = self;
        let mut hessian = self.hessian.take().unwrap_or_else(|| DMatrix::zeros(q.len(), q.len()));
        hessian.fill(0.0);
        for k in 0..q.len() {
            gradient[k] = (q[k] - center[k]) / gamma[k];
            hessian[(k, k)] = gamma[k].recip();
        }
        for (i, point) in energy.points().iter().enumerate() {
            jacobian.fill(0.0);
            let x = point.corners().map(|(v, w)| w * placing.derivative((v, w), q, jacobian)).sum();
            let (force, stiffness) = (energy.gradient_at(i, &x), energy.hessian_at(i, &x, Curvature::Semidefinite));
            for (a, b) in (0..9).map(|ab| (ab / 3, ab % 3)).filter(|ab| stiffness[*ab] != 0.0) {
                hessian.ger(stiffness[(a, b)], &jacobian.column(a), &jacobian.column(b), 1.0);
            }
            if force != Vec3::zeros() {
                gradient.gemv(1.0, jacobian, &force, 1.0);
            }
        }
        let factor = Cholesky::new(hessian)?;
        direction.copy_from(gradient);
        direction.neg_mut();
        factor.solve_mut(direction);
        self.hessian = Some(factor.unpack_dirty());
        let slope = gradient.dot(direction);
        slope.is_finite().then_some(slope)
    }
}

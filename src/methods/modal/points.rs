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
    /// x of vertex `v` with these shapes, with the parts of u as [`warp_with_derivative`] has them.
    fn place(&self, v: usize, shapes: &[f64], q: &[f64]) -> (Vec3, [Matrix3<f64>; 2]) {
        if let Some(map) = self.vertices {
            return (self.rest[v] + map.displacement(v, q), [Matrix3::zeros(); 2]);
        }
        let mut sums = [0.0; 6];
        for (row, q) in shapes.chunks_exact(6).zip(q) {
            sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += q * x);
        }
        let (linear, w) = (Vec3::from_column_slice(&sums[..3]), Vec3::from_column_slice(&sums[3..]));
        let (u, by_linear, by_w) = warp_with_derivative(&w, &linear, self.warped);
        (self.rest[v] + u, [by_linear, by_w])
    }

    /// x of vertex `v`; adds w ∂x/∂q to J (modes × 3).
    fn derivative(&self, (v, w): (usize, f64), shapes: &[f64], q: &[f64], jacobian: &mut MatrixXx3<f64>) -> Vec3 {
        let (x, [by_linear, by_w]) = self.place(v, shapes, q);
        if let Some(map) = self.vertices {
            for axis in 0..3 {
                map.slopes((v, &Vec3::ith(axis, 1.0)), q, &mut |k, slope| {
                    if k < jacobian.nrows() {
                        jacobian[(k, axis)] += w * slope;
                    }
                });
            }
            return x;
        }
        for (k, row) in shapes.chunks_exact(6).enumerate().take(jacobian.nrows()) {
            let (phi, psi) = (Vec3::from_column_slice(&row[..3]), Vec3::from_column_slice(&row[3..]));
            let motion = w * (by_linear * phi + by_w * psi);
            (0..3).for_each(|axis| jacobian[(k, axis)] += motion[axis]);
        }
        x
    }
}

/// Φ and Ψ of the corners of the points: n × 3 numbers each, by modes.
#[derive(Clone, Default)]
struct Shapes {
    points: Vec<Point>,
    /// φ and ψ of one corner after the other, 6 numbers a mode.
    rows: Vec<f64>,
    /// The first row of each point, by corners.
    first: Vec<usize>,
}

impl Shapes {
    fn expect(&mut self, points: usize, modes: usize) {
        self.points.reserve(points);
        self.first.reserve(points);
        self.rows.reserve(2 * 6 * modes * points); // a vertex or two
    }

    /// Of these points; costs nothing where they are those from before.
    fn take<E: Entry>(&mut self, points: &[Point], basis: &Basis<E>, modes: usize) {
        if self.points == points {
            return;
        }
        self.points.clear();
        self.points.extend_from_slice(points);
        self.first.clear();
        self.rows.clear();
        for point in points {
            self.first.push(self.rows.len() / (6 * modes));
            for &v in point.vertices() {
                for k in 0..modes {
                    let (phi, psi) = basis.at(k, v as usize);
                    self.rows.extend(phi.iter().chain(psi.iter()));
                }
            }
        }
    }

    fn corner(&self, i: usize, c: usize, modes: usize) -> &[f64] {
        &self.rows[(self.first[i] + c) * 6 * modes..][..6 * modes]
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
    /// Where the step began.
    pub start: Vec<f64>,
    gradient: DVector<f64>,
    /// Δ.
    direction: DVector<f64>,
    /// Taken out while it is factorized.
    hessian: Option<DMatrix<f64>>,
    jacobian: MatrixXx3<f64>,
    /// J H.
    turned: MatrixXx3<f64>,
    trial: Vec<f64>,
    shapes: Shapes,
}

impl PointSearch {
    /// For so many modes, and with support fields so many amplitudes; these fields stay as they are.
    pub fn new(modes: usize, amplitudes: usize) -> Self {
        Self {
            gamma: vec![0.0; modes],
            rate: vec![0.0; modes],
            free: [vec![0.0; amplitudes], vec![0.0; amplitudes]],
            center: vec![0.0; amplitudes],
            moved: vec![0.0; amplitudes],
            start: vec![0.0; amplitudes],
            gradient: DVector::zeros(modes),
            direction: DVector::zeros(modes),
            hessian: Some(DMatrix::zeros(modes, modes)),
            jacobian: MatrixXx3::zeros(modes),
            turned: MatrixXx3::zeros(modes),
            trial: vec![0.0; amplitudes],
            shapes: Shapes::default(),
        }
    }

    /// Makes room for so many points.
    pub fn expect(&mut self, points: usize) {
        self.shapes.expect(points, self.moved.len());
    }

    /// Moves q⁺ from any guess to the minimum about c.
    pub fn minimize<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy) {
        let (center, mut q) = (std::mem::take(&mut self.center), std::mem::take(&mut self.moved));
        self.shapes.take(energy.points(), placing.basis, q.len());
        self.descend(placing, energy, &center, &mut q);
        (self.center, self.moved) = (center, q);
    }

    fn descend<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64], q: &mut [f64]) {
        let (mut value, mut size) = self.value(placing, energy, center, q);
        self.trial.copy_from_slice(q);
        let begun = self.value(placing, energy, center, &self.start);
        if begun.0 < value {
            (value, size) = begun;
            q.copy_from_slice(&self.start);
        }
        for _ in 0..STEPS {
            let Some(slope) = self.find_direction(placing, energy, center, q) else { return };
            if -slope <= GAIN * size {
                return;
            }
            let mut share = 1.0;
            for halving in 0..=HALVINGS {
                if halving == HALVINGS {
                    return; // as near as rounding lets it
                }
                (0..self.gamma.len()).for_each(|k| self.trial[k] = q[k] + share * self.direction[k]);
                let (there, size_there) = self.value(placing, energy, center, &self.trial);
                if there - value <= DECREASE * share * slope + ROUNDING * size {
                    (value, size) = (there, size_there);
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
        for k in 0..self.gamma.len() {
            value += 0.5 * (q[k] - center[k]).powi(2) / self.gamma[k];
            size += (q[k] * q[k] + center[k] * center[k]) / self.gamma[k];
        }
        let joined = |(i, point): (usize, &Point)| {
            let corners = point.corners().enumerate();
            let place = |(c, (v, w))| w * placing.place(v, self.shapes.corner(i, c, q.len()), q).0;
            energy.value_at(i, &corners.map(place).fold(Vec3::zeros(), |sum, part| sum + part))
        };
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
        let n = self.gamma.len();
        let amplitudes = q.len();
        let Self { gamma, gradient, direction, jacobian, turned, shapes, .. } = self;
        let mut hessian = self.hessian.take().unwrap_or_else(|| DMatrix::zeros(n, n));
        hessian.fill(0.0);
        for k in 0..n {
            gradient[k] = (q[k] - center[k]) / gamma[k];
            hessian[(k, k)] = gamma[k].recip();
        }
        for (i, point) in energy.points().iter().enumerate() {
            jacobian.fill(0.0);
            let mut x = Vec3::zeros();
            for (c, (v, w)) in point.corners().enumerate() {
                x += w * placing.derivative((v, w), shapes.corner(i, c, amplitudes), q, jacobian);
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

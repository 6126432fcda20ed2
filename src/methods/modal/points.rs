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

/// k of a handle as a spring, in what the modes give way by; how often its force is taken along, at most, and what is then missed, of the
/// shell's size.
const HARD: f64 = 1e3;
const MEETINGS: usize = 30;
const NEAR: f64 = 1e-11;

/// q, and what vertices share there ([`VertexMap::share`]).
type At<'a> = (&'a [f64], &'a [Matrix3<f64>]);

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
    /// Sets what vertices share at `q`.
    fn share(&self, q: &[f64], slopes: bool, shared: &mut Vec<Matrix3<f64>>) {
        if let Some(map) = self.vertices {
            map.share(q, slopes, shared);
        }
    }

    /// x of vertex `v` with these shapes, with the parts of u as [`warp_with_derivative`] has them.
    fn place(&self, v: usize, shapes: &[f64], q: &[f64]) -> (Vec3, [Matrix3<f64>; 2]) {
        let mut sums = [0.0; 6];
        for (row, q) in shapes.chunks_exact(6).zip(q) {
            sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += q * x);
        }
        let (linear, w) = (Vec3::from_column_slice(&sums[..3]), Vec3::from_column_slice(&sums[3..]));
        let (u, by_linear, by_w) = warp_with_derivative(&w, &linear, self.warped);
        (self.rest[v] + u, [by_linear, by_w])
    }

    /// p of a point with these shapes of its corners, or of itself where a map moves it.
    fn place_point(&self, point: &Point, shapes: &[f64], (q, shared): At) -> Vec3 {
        if self.vertices.is_some() {
            let rest = point.place(|v| self.rest[v]);
            let (modes, fields) = shapes.split_at(3 * q.len());
            let linear = modes.chunks_exact(3).zip(q).map(|(row, q)| *q * Vec3::from_column_slice(row));
            let beyond = fields.chunks_exact(3).zip(shared).map(|(row, n)| n * Vec3::from_column_slice(row));
            return linear.chain(beyond).fold(rest, |sum, part| sum + part);
        }
        let corners = point.corners().zip(shapes.chunks_exact(6 * q.len()));
        corners.map(|((v, w), shapes)| w * self.place(v, shapes, q).0).fold(Vec3::zeros(), |sum, part| sum + part)
    }

    /// The same; sets J to ∂p/∂q (modes × 3).
    fn point_derivative(&self, point: &Point, shapes: &[f64], (q, shared): At, jacobian: &mut MatrixXx3<f64>) -> Vec3 {
        jacobian.fill(0.0);
        if self.vertices.is_some() {
            let (modes, fields) = shapes.split_at(3 * q.len());
            let slopes = &shared[fields.len() / 3..];
            for (k, row) in modes.chunks_exact(3).enumerate().take(jacobian.nrows()) {
                let turned = fields.chunks_exact(3).zip(slopes.iter().skip(k).step_by(jacobian.nrows()));
                let beyond = turned.map(|(row, slope)| slope * Vec3::from_column_slice(row));
                let motion = beyond.fold(Vec3::from_column_slice(row), |sum, part| sum + part);
                (0..3).for_each(|axis| jacobian[(k, axis)] = motion[axis]);
            }
            return self.place_point(point, shapes, (q, shared));
        }
        let mut x = Vec3::zeros();
        for ((v, w), shapes) in point.corners().zip(shapes.chunks_exact(6 * q.len())) {
            let (place, [by_linear, by_w]) = self.place(v, shapes, q);
            x += w * place;
            for (k, row) in shapes.chunks_exact(6).enumerate().take(jacobian.nrows()) {
                let (phi, psi) = (Vec3::from_column_slice(&row[..3]), Vec3::from_column_slice(&row[3..]));
                let motion = w * (by_linear * phi + by_w * psi);
                (0..3).for_each(|axis| jacobian[(k, axis)] += motion[axis]);
            }
        }
        x
    }
}

/// What amplitudes move points by.
#[derive(Clone, Default)]
struct Shapes {
    points: Vec<Point>,
    /// Of one corner after the other φ and ψ of each mode. Where a map moves vertices, of each point φ of each mode and each b_c, by the
    /// weights of its corners.
    rows: Vec<f64>,
    /// Where those of each point begin.
    first: Vec<usize>,
}

impl Shapes {
    fn expect(&mut self, points: usize, modes: usize, fields: usize) {
        self.points.reserve(points);
        self.first.reserve(points + 1);
        self.rows.reserve((12 * modes).max(3 * (modes + fields)) * points); // a vertex or two
    }

    /// Of these points; costs nothing where they are those from before.
    fn take<E: Entry>(&mut self, points: &[Point], placing: &Placing<E>, modes: usize) {
        if self.points == points {
            return;
        }
        let Self { points: taken, rows, first } = self;
        taken.clear();
        taken.extend_from_slice(points);
        first.clear();
        rows.clear();
        for point in points {
            first.push(rows.len());
            if let Some(map) = placing.vertices {
                let mean = |of: &dyn Fn(usize) -> Vec3| point.place(of);
                (0..modes).for_each(|k| rows.extend(mean(&|v| placing.basis.at(k, v).0).iter()));
                (0..map.n_fields()).for_each(|c| rows.extend(mean(&|v| map.field(c, v)).iter()));
                continue;
            }
            for &v in point.vertices() {
                for k in 0..modes {
                    let (phi, psi) = placing.basis.at(k, v as usize);
                    rows.extend(phi.iter().chain(psi.iter()));
                }
            }
        }
        first.push(rows.len());
    }

    fn of(&self, i: usize) -> &[f64] {
        &self.rows[self.first[i]..self.first[i + 1]]
    }
}

/// A handle as a spring, with the force that it had last on top.
#[derive(Clone, Copy)]
pub struct Spring {
    /// Where its vertex is to be, frame axes.
    pub target: Vec3,
    /// Projects onto the directions that it holds.
    pub held: Matrix3<f64>,
    /// Of the handle, m/N.
    pub compliance: f64,
    /// k.
    stiffness: f64,
    /// On the handle.
    force: Vec3,
}

impl Spring {
    /// Without a force; `stiffness` decides how fast the handle is met, not where.
    pub fn new(target: Vec3, held: Matrix3<f64>, compliance: f64) -> Self {
        Self { target, held, compliance, stiffness: 0.0, force: Vec3::zeros() }
    }

    /// The stiffness of both springs in a row.
    fn joint_stiffness(&self) -> f64 {
        (self.compliance + self.stiffness.recip()).recip()
    }

    /// The force with the vertex at `p`.
    fn pull(&self, p: &Vec3) -> Vec3 {
        self.joint_stiffness() * (self.held * (p - self.target) + self.force / self.stiffness)
    }
}

/// An energy of points and handles as springs in one: the augmented Lagrangian (Hestenes, Powell 1969).
struct Joint<'a> {
    energy: &'a dyn PointEnergy,
    /// Of the energy and then of the springs.
    points: &'a [Point],
    springs: &'a [Spring],
}

impl Joint<'_> {
    fn spring(&self, i: usize) -> Option<&Spring> {
        self.springs.get(i.wrapping_sub(self.points.len() - self.springs.len()))
    }
}

impl PointEnergy for Joint<'_> {
    fn points(&self) -> &[Point] {
        self.points
    }

    fn value_at(&self, i: usize, p: &Vec3) -> f64 {
        let value = |spring: &Spring| 0.5 * spring.pull(p).norm_squared() / spring.joint_stiffness();
        self.spring(i).map_or_else(|| self.energy.value_at(i, p), value)
    }

    fn gradient_at(&self, i: usize, p: &Vec3) -> Vec3 {
        self.spring(i).map_or_else(|| self.energy.gradient_at(i, p), |spring| spring.pull(p))
    }

    fn hessian_at(&self, i: usize, p: &Vec3, curvature: Curvature) -> Matrix3<f64> {
        let hessian = |spring: &Spring| spring.joint_stiffness() * spring.held;
        self.spring(i).map_or_else(|| self.energy.hessian_at(i, p, curvature), hessian)
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
    /// What vertices share at some q.
    shared: Vec<Matrix3<f64>>,
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
            shared: vec![],
        }
    }

    /// Makes room for so many points, and fields of a map.
    pub fn expect(&mut self, points: usize, fields: usize) {
        let amplitudes = self.moved.len();
        self.shapes.expect(points, amplitudes, fields);
        self.shared.reserve((fields * (1 + amplitudes)).saturating_sub(self.shared.len()));
    }

    /// Moves q⁺ from any guess to the minimum about c.
    pub fn minimize<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy) {
        let (center, mut q) = (std::mem::take(&mut self.center), std::mem::take(&mut self.moved));
        self.shapes.take(energy.points(), placing, q.len());
        self.descend(placing, energy, &center, &mut q);
        (self.center, self.moved) = (center, q);
    }

    /// Moves q⁺ to the minimum about the free end with these handles met, and c to where their forces put it. Allocates.
    pub fn meet<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        handles: impl Iterator<Item = (u32, Spring)>,
        size: f64,
    ) {
        let (mut points, mut springs) = (energy.points().to_vec(), vec![]);
        for (v, spring) in handles {
            let give = |k: usize| self.gamma[k] * placing.basis.at(k, v as usize).0.norm_squared();
            let stiffness = HARD / (0..self.gamma.len()).map(give).sum::<f64>();
            if stiffness.is_finite() {
                springs.push(Spring { stiffness, ..spring });
                points.push(Point::vertex(v));
            } // else no mode moves it
        }
        let first = energy.points().len();
        let (free, mut q) = (std::mem::take(&mut self.free[0]), std::mem::take(&mut self.moved));
        self.shapes.take(&points, placing, q.len());
        for _ in 0..MEETINGS {
            self.descend(placing, &Joint { energy, points: &points, springs: &springs }, &free, &mut q);
            placing.share(&q, false, &mut self.shared);
            let mut missed = 0.0f64;
            for (i, spring) in springs.iter_mut().enumerate() {
                let p = placing.place_point(&points[first + i], self.shapes.of(first + i), (&q, &self.shared));
                let force = spring.pull(&p);
                missed = missed.max((force - spring.force).norm() / spring.stiffness);
                spring.force = force;
            }
            if missed <= NEAR * size {
                break;
            }
        }
        self.center.copy_from_slice(&free);
        placing.share(&q, true, &mut self.shared);
        for (i, spring) in springs.iter().enumerate() {
            let (point, shapes) = (&points[first + i], self.shapes.of(first + i));
            placing.point_derivative(point, shapes, (&q, &self.shared), &mut self.jacobian);
            self.gradient.gemv(1.0, &self.jacobian, &spring.force, 0.0);
            let along = self.center.iter_mut().zip(&self.gamma).zip(self.gradient.iter());
            along.for_each(|((center, gamma), along)| *center -= gamma * along);
        }
        (self.free[0], self.moved) = (free, q);
    }

    fn descend<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64], q: &mut [f64]) {
        let (mut value, mut size) = self.value(placing, energy, center, q);
        self.trial.copy_from_slice(&self.start);
        let begun = self.trial_value(placing, energy, center);
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
                let (there, size_there) = self.trial_value(placing, energy, center);
                if there - value <= DECREASE * share * slope + ROUNDING * size {
                    (value, size) = (there, size_there);
                    break;
                }
                share *= 0.5;
            }
            q.copy_from_slice(&self.trial);
        }
    }

    fn trial_value<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64]) -> (f64, f64) {
        let trial = std::mem::take(&mut self.trial);
        let value = self.value(placing, energy, center, &trial);
        self.trial = trial;
        value
    }

    /// What is minimized, and the size of its terms.
    fn value<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        q: &[f64],
    ) -> (f64, f64) {
        placing.share(q, false, &mut self.shared);
        let (mut value, mut size) = (0.0, f64::MIN_POSITIVE);
        for k in 0..self.gamma.len() {
            value += 0.5 * (q[k] - center[k]).powi(2) / self.gamma[k];
            size += (q[k] * q[k] + center[k] * center[k]) / self.gamma[k];
        }
        let joined = |(i, point): (usize, &Point)| {
            energy.value_at(i, &placing.place_point(point, self.shapes.of(i), (q, &self.shared)))
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
        placing.share(q, true, &mut self.shared);
        let Self { gamma, gradient, direction, jacobian, turned, shapes, shared, .. } = self;
        let mut hessian = self.hessian.take().unwrap_or_else(|| DMatrix::zeros(n, n));
        hessian.fill(0.0);
        for k in 0..n {
            gradient[k] = (q[k] - center[k]) / gamma[k];
            hessian[(k, k)] = gamma[k].recip();
        }
        for (i, point) in energy.points().iter().enumerate() {
            let x = placing.point_derivative(point, shapes.of(i), (q, shared), jacobian);
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

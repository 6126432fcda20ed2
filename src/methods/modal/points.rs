//! The end of a modal step under an energy W of single points ([`crate::point_energy`]).
//!
//! With c the end of the step without W and Γ the integrator's (`Oscillator::handle_response`), q⁺ = c − ΓJᵀ∇W(x(q⁺)), as constraints have
//! it. That is the minimum of
//!
//!   ½ (q − c)ᵀ Γ⁻¹ (q − c) + W(x(q)),
//!
//! found by Newton's method with JᵀHJ for the Hessian of W, H semidefinite: a descent direction whatever the shape, and a line search.

use super::joint::{Joint, Spring};
use super::mapped::Mapped;
use super::shapes::{At, Placing, Shapes};
use super::square::{Square, dot, padded, rows};
use crate::Vec3;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use crate::step::{Integrator, Oscillator};
use crate::warp::Entry;
use nalgebra::Matrix3;

/// Newton steps and halvings of one, at most.
const STEPS: usize = 60;
const HALVINGS: usize = 40;
/// Sufficient decrease, as a share of the slope's promise.
const DECREASE: f64 = 1e-4;
/// Converged when a step would gain this part of the terms' size: of q, its root.
const GAIN: f64 = 1e-22;
/// A step that would gain less than this part, or than W's own ([`PointEnergy::precision`]), and than the second number beside the step
/// before it, is the last.
const LITTLE: f64 = 1e-15;
const FALL: f64 = 0.1;
/// How often W may learn in a search, and where: after a step that gained less than this part of W, so that forces are good to a third.
const LEARNINGS: usize = 8;
const LEARNS: f64 = 0.1;
/// Of these terms, what rounding may hide.
const ROUNDING: f64 = 1e-15;

/// k of a handle as a spring, in what the modes give way by; how often its force is taken along, at most, and what is then missed, of the
/// shell's size.
const HARD: f64 = 1e3;
const MEETINGS: usize = 30;
const NEAR: f64 = 1e-11;

/// What is minimized.
#[derive(Clone, Copy)]
struct Value {
    all: f64,
    /// W's part of it.
    joined: f64,
    /// Of its terms.
    size: f64,
}

/// Room for the search; none before the first.
#[derive(Clone)]
pub struct PointSearch {
    /// Γ and r of each mode.
    pub gamma: Vec<f64>,
    pub rate: Vec<f64>,
    /// What they were made for.
    made_for: (f64, Option<Integrator>, Vec<Oscillator>),
    /// They are of this step, and q⁺ is the end of its last round.
    pub goes_on: bool,
    /// q and q̇ at the end of the step without constraints and W.
    pub free: [Vec<f64>; 2],
    /// c, and q⁺.
    pub center: Vec<f64>,
    pub moved: Vec<f64>,
    /// Where the step began.
    pub start: Vec<f64>,
    /// No step is taken on trust: other conditions are met in turns with this one.
    pub exact: bool,
    /// q⁺ is the end of the last round, else a guess.
    pub continues: bool,
    /// Γ⁻¹.
    stiff: Vec<f64>,
    gradient: Vec<f64>,
    /// Δ.
    direction: Vec<f64>,
    hessian: Square,
    /// Instead, where a map moves vertices.
    mapped: Option<Box<Mapped>>,
    /// A row for each axis.
    jacobian: Vec<f64>,
    trial: Vec<f64>,
    shapes: Shapes,
    /// What vertices share at some q.
    shared: Vec<Matrix3<f64>>,
    /// Where points are at the last value that was taken.
    places: Vec<Vec3>,
    /// What corners move by at q, along Δ, and at the trial.
    sums: [Vec<[f64; 6]>; 3],
}

impl PointSearch {
    /// For so many modes, and with support fields so many amplitudes; these fields stay as they are.
    pub fn new(modes: usize, amplitudes: usize) -> Self {
        Self {
            gamma: vec![0.0; modes],
            rate: vec![0.0; modes],
            made_for: (0.0, None, vec![Oscillator::default(); modes]),
            goes_on: false,
            free: [vec![0.0; amplitudes], vec![0.0; amplitudes]],
            center: vec![0.0; amplitudes],
            moved: vec![0.0; amplitudes],
            start: vec![0.0; amplitudes],
            exact: false,
            continues: false,
            stiff: vec![0.0; modes],
            gradient: vec![0.0; modes],
            direction: vec![0.0; modes],
            hessian: Square::new(modes),
            mapped: None,
            jacobian: vec![0.0; 3 * padded(modes)],
            trial: vec![0.0; amplitudes],
            shapes: Shapes::default(),
            shared: vec![],
            places: vec![],
            sums: Default::default(),
        }
    }

    /// Makes room for so many points, and fields of a map.
    pub fn expect(&mut self, points: usize, fields: usize) {
        let amplitudes = self.moved.len();
        self.shapes.expect(points, amplitudes, fields);
        if fields > 0 {
            self.mapped.get_or_insert_with(|| Box::new(Mapped::new(self.gamma.len())));
        }
        self.shared.reserve((fields * (1 + amplitudes)).saturating_sub(self.shared.len()));
        self.places.reserve(points.saturating_sub(self.places.len()));
        self.sums.iter_mut().for_each(|sums| sums.reserve((2 * points).saturating_sub(sums.len())));
    }

    /// Sets Γ and r of modes with these eigenvalues, each with its damping.
    pub fn respond(&mut self, (h, integrator): (f64, Integrator), eigenvalues: &[f64], damping: impl Fn(usize) -> f64) {
        let Self { made_for, gamma, rate, .. } = self;
        let same = made_for.0 == h && made_for.1 == Some(integrator);
        (made_for.0, made_for.1) = (h, Some(integrator));
        for k in 0..gamma.len() {
            let oscillator = Oscillator { damping: damping(k), eigenvalue: eigenvalues[k] };
            if !same || oscillator != made_for.2[k] {
                made_for.2[k] = oscillator;
                (gamma[k], rate[k]) = oscillator.handle_response(integrator, h);
            }
        }
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
            self.shapes.combine(&q, &mut self.sums[0]);
            let at = At { q: &q, shared: &self.shared, sums: &self.sums[0] };
            let mut missed = 0.0f64;
            for (i, spring) in springs.iter_mut().enumerate() {
                let p = placing.place_point(&points[first + i], &self.shapes, first + i, at);
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
        let at = At { q: &q, shared: &self.shared, sums: &self.sums[0] };
        for (i, spring) in springs.iter().enumerate() {
            let jacobian = (self.gamma.len(), &mut *self.jacobian);
            placing.derive_point(&points[first + i], &self.shapes, first + i, at, jacobian);
            self.gradient.fill(0.0);
            add_along(&self.jacobian, &spring.force, &mut self.gradient);
            let along = self.center.iter_mut().zip(&self.gamma).zip(self.gradient.iter());
            along.for_each(|((center, gamma), along)| *center -= gamma * along);
        }
        (self.free[0], self.moved) = (free, q);
    }

    fn descend<E: Entry>(&mut self, placing: &Placing<E>, energy: &dyn PointEnergy, center: &[f64], q: &mut [f64]) {
        let [mut sums, mut along, mut there] = std::mem::take(&mut self.sums);
        self.descend_with(placing, energy, (center, q), [&mut sums, &mut along, &mut there]);
        self.sums = [sums, along, there];
    }

    fn descend_with<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        (center, q): (&[f64], &mut [f64]),
        [sums, along, there]: [&mut Vec<[f64; 6]>; 3],
    ) {
        self.stiff.iter_mut().zip(&self.gamma).for_each(|(stiff, gamma)| *stiff = gamma.recip());
        let mut now = self.begin(placing, energy, center, (q, sums, there));
        let precision = if self.exact { 0.0 } else { energy.precision() };
        let (mut last, mut learned) = (0.0, 0);
        for _ in 0..STEPS {
            let Some(slope) = self.find_direction(placing, energy, center, (q, sums)) else { return };
            if -slope <= GAIN * now.size {
                return;
            }
            let little = (LITTLE * now.size).max(precision * now.joined);
            if !self.exact && -slope <= little && -slope <= FALL * last {
                q.iter_mut().zip(&self.direction).for_each(|(q, way)| *q += way);
                return;
            }
            last = -slope;
            self.shapes.combine(&self.direction, along);
            let mut share = 1.0;
            for halving in 0..=HALVINGS {
                if halving == HALVINGS {
                    return; // as near as rounding lets it
                }
                (0..self.gamma.len()).for_each(|k| self.trial[k] = q[k] + share * self.direction[k]);
                there.clear();
                let both = sums.iter().zip(&*along);
                there.extend(both.map(|(sums, along)| std::array::from_fn(|c| sums[c] + share * along[c])));
                let end = self.trial_value(placing, energy, center, there);
                if end.all - now.all <= DECREASE * share * slope + ROUNDING * now.size {
                    now = end;
                    break;
                }
                share *= 0.5;
            }
            q.copy_from_slice(&self.trial);
            std::mem::swap(sums, there);
            if learned < LEARNINGS && last <= LEARNS * now.joined && self.learn(energy) {
                learned += 1;
                let joined = self.places.iter().enumerate().map(|(i, p)| energy.value_at(i, p)).sum::<f64>();
                now = Value { all: now.all + (joined - now.joined), joined, ..now };
            }
        }
    }

    /// Begins at q⁺, or where the step did if that is nearer to the end.
    fn begin<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        (q, sums, there): (&mut [f64], &mut Vec<[f64; 6]>, &mut Vec<[f64; 6]>),
    ) -> Value {
        self.shapes.combine(q, sums);
        let now = self.value(placing, energy, center, (q, sums));
        if self.continues {
            return now;
        }
        self.trial.copy_from_slice(&self.start);
        self.shapes.combine(&self.start, there);
        let begun = self.trial_value(placing, energy, center, there);
        if begun.all < now.all || now.all.is_nan() {
            q.copy_from_slice(&self.start);
            std::mem::swap(sums, there);
            return begun;
        }
        if placing.vertices.is_none() {
            self.value(placing, energy, center, (q, sums)); // for the places
        }
        now
    }

    /// Lets W learn from where the last value was taken; whether it is another now.
    fn learn(&self, energy: &dyn PointEnergy) -> bool {
        if self.exact {
            return false;
        }
        self.places.iter().enumerate().fold(false, |another, (i, p)| energy.learn(i, p) | another)
    }

    fn trial_value<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        sums: &[[f64; 6]],
    ) -> Value {
        let trial = std::mem::take(&mut self.trial);
        let value = self.value(placing, energy, center, (&trial, sums));
        self.trial = trial;
        value
    }

    fn value<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        (q, sums): (&[f64], &[[f64; 6]]),
    ) -> Value {
        placing.share(q, false, &mut self.shared);
        let (mut value, mut size) = (0.0, f64::MIN_POSITIVE);
        if placing.vertices.is_some() {
            for (k, gamma) in self.gamma.iter().enumerate() {
                value += 0.5 * (q[k] - center[k]).powi(2) / gamma;
                size += (q[k] * q[k] + center[k] * center[k]) / gamma;
            }
        } else {
            for (k, stiff) in self.stiff.iter().enumerate() {
                value += 0.5 * stiff * (q[k] - center[k]).powi(2);
                size += stiff * (q[k] * q[k] + center[k] * center[k]);
            }
        }
        let at = At { q, shared: &self.shared, sums };
        let Self { places, shapes, .. } = self;
        places.clear();
        places.extend(energy.points().iter().enumerate().map(|(i, point)| placing.place_point(point, shapes, i, at)));
        let joined = places.iter().enumerate().map(|(i, p)| energy.value_at(i, p)).sum::<f64>();
        Value { all: value + joined, joined, size }
    }

    /// Sets Δ; returns the slope along it, or none without a finite one.
    fn find_direction<E: Entry>(
        &mut self,
        placing: &Placing<E>,
        energy: &dyn PointEnergy,
        center: &[f64],
        (q, sums): (&[f64], &[[f64; 6]]),
    ) -> Option<f64> {
        placing.share(q, true, &mut self.shared);
        let Self { stiff, gamma, gradient, direction, hessian, mapped, jacobian, shapes, shared, places, .. } = self;
        let at = At { q, shared, sums };
        if placing.vertices.is_some() {
            let mapped = mapped.get_or_insert_with(|| Box::new(Mapped::new(gamma.len())));
            return mapped.find_direction((placing, energy, shapes), (gamma, center, at), (jacobian, direction));
        }
        hessian.set_diagonal(stiff);
        for (i, point) in energy.points().iter().enumerate() {
            let (force, stiffness) =
                (energy.gradient_at(i, &places[i]), energy.hessian_at(i, &places[i], Curvature::Semidefinite));
            if stiffness != Matrix3::zeros() || force != Vec3::zeros() {
                placing.derive_point(point, shapes, i, at, (stiff.len(), jacobian));
                hessian.add(jacobian, &stiffness, &force);
            }
        }
        for (k, (gradient, along)) in gradient.iter_mut().zip(hessian.along()).enumerate() {
            *gradient = stiff[k] * (q[k] - center[k]) + along;
        }
        direction.iter_mut().zip(&*gradient).for_each(|(way, slope)| *way = -slope);
        if !hessian.solve(direction) {
            return None;
        }
        let slope = dot(gradient, direction);
        slope.is_finite().then_some(slope)
    }
}

/// Adds Jᵀ of a force.
#[inline(always)]
fn add_along(jacobian: &[f64], force: &Vec3, sum: &mut [f64]) {
    let [x, y, z] = rows(jacobian, padded(sum.len()));
    for (((sum, x), y), z) in sum.iter_mut().zip(x).zip(y).zip(z) {
        *sum += force.x * x + force.y * y + force.z * z;
    }
}

//! Creases that yield: elastic up to an angle y from where they rest, and perfectly plastic beyond it.
//!
//! Within y a hinge has ½ k e², with e = θ − θ̄ and k = 2w. Beyond it a step has the least over the plastic angle p of what is then stored and
//! what flowing there takes, the incremental potential of backward Euler (Simo, Hughes, Computational Inelasticity, 1998):
//!
//!   min ½ k (e − p)² + k y |p| = k y (|e| − ½ y),
//!
//! so that its moment stays k y. After the step the rest angle follows by p, to where e is ±y ([`Yielding::yielded`], the return mapping). Then
//! ½ k y² is stored: less by the heat, k y (|e| − y) ≥ 0. So no round of folding gives energy, whatever the step. As strains, E = ½ ε² with
//! ε = √k φ(e): φ = e within y, ±√(2y|e| − y²) beyond.
//!
//! The rest angles are a state's own: it has a copy of this energy, which shares all that is elastic.

use super::hinge::{Bend, angle_curvature, wrapped_difference};
use super::{Curvature, ElementHessian, Energy, HingeEnergy, Mat3, RestRow, Stress, Term};
use crate::Vec3;
use std::sync::Arc;

/// Beyond the yield angle by this part of it is rounding.
const ROUNDING: f64 = 1e-12;

/// An elastic energy with creases that yield.
#[derive(Clone)]
pub struct Yielding {
    elastic: Arc<dyn Energy>,
    creases: HingeEnergy,
    /// y of each crease.
    limits: Arc<[f64]>,
    /// Rest angles before anything yielded.
    made: Arc<[f64]>,
}

/// φ of one crease, and its first two derivatives.
struct Flow([f64; 3]);

impl Flow {
    fn of(e: f64, limit: f64) -> Self {
        if e.abs() <= limit {
            return Self([e, 1.0, 0.0]);
        }
        let root = (limit * (2.0 * e.abs() - limit)).sqrt();
        Self([root.copysign(e), limit / root, -(limit * limit / root.powi(3)).copysign(e)])
    }
}

impl Yielding {
    /// `limits` are the yield angles of the `creases`.
    pub(super) fn new(elastic: Box<dyn Energy>, creases: HingeEnergy, limits: Vec<f64>) -> Self {
        let made = creases.rest_angle[..].into();
        Self { elastic: elastic.into(), creases, limits: limits.into(), made }
    }

    /// Rest angles of the creases that yield, in their order.
    pub fn rest_angles(&self) -> &[f64] {
        &self.creases.rest_angle
    }

    /// The same before anything yielded.
    pub fn made(&self) -> &Arc<[f64]> {
        &self.made
    }

    /// With rest angles of its own (as many as there are).
    pub fn set_rest_angles(&mut self, angles: &[f64]) {
        self.creases.rest_angle.copy_from_slice(angles);
    }

    /// The rest angles after what yields has yielded; none where nothing does.
    pub fn yielded(&self, x: impl Fn(u32) -> Vec3) -> Option<Vec<f64>> {
        let mut angles = None;
        for (i, limit) in self.limits.iter().enumerate() {
            let Bend { share, turn, .. } = self.creases.bend_of(i, self.creases.hinges[i].map(&x));
            if (share * turn).abs() > limit * (1.0 + ROUNDING) {
                let angles = angles.get_or_insert_with(|| self.creases.rest_angle.clone());
                angles[i] = wrapped_difference(angles[i] + turn - (limit / share).copysign(turn), 0.0);
            }
        }
        angles
    }

    fn flow(&self, i: usize, bend: &Bend) -> Flow {
        Flow::of(bend.share * bend.turn, self.limits[i])
    }

    /// Elements, the last ones, that are creases.
    fn n_creases(&self) -> usize {
        self.limits.len()
    }

    /// Hands Σ aᵢ ∇e∇eᵀ + bᵢ ∂²θ of each crease to `visit`, with a and b by `factors` of it, over 2w.
    fn each_hessian(
        &self,
        x: &[Vec3],
        factors: impl Fn(usize, &Bend, Flow) -> [f64; 2],
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        for (i, (h, weight)) in self.creases.hinges.iter().zip(&self.creases.weight).enumerate() {
            let bend = self.creases.bend(i, x);
            let [along, turning] = factors(i, &bend, self.flow(i, &bend)).map(|factor| 2.0 * weight * factor);
            let d_angle = self.creases.gradient(i, &bend);
            let mut blocks = [Mat3::zeros(); 16];
            if turning != 0.0 {
                blocks = angle_curvature(&bend.corners).map(|block| turning * block);
            }
            for (ij, block) in blocks.iter_mut().enumerate() {
                *block += along * d_angle[ij / 4] * d_angle[ij % 4].transpose();
            }
            visit((h, &blocks));
        }
    }
}

impl Energy for Yielding {
    fn value(&self, x: &[Vec3]) -> f64 {
        let of = |i: usize| {
            let Flow([phi, ..]) = self.flow(i, &self.creases.bend(i, x));
            self.creases.weight[i] * phi * phi
        };
        self.elastic.value(x) + (0..self.n_creases()).map(of).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.elastic.add_gradient(x, gradient);
        for (i, (h, weight)) in self.creases.hinges.iter().zip(&self.creases.weight).enumerate() {
            let bend = self.creases.bend(i, x);
            let Flow([phi, slope, _]) = self.flow(i, &bend);
            let moment = 2.0 * weight * phi * slope;
            let pulls = self.creases.gradient(i, &bend);
            h.iter().zip(pulls).for_each(|(&v, pull)| gradient[v as usize] += moment * pull);
        }
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        self.elastic.visit_rest_rows(visit);
        self.creases.visit_rest_rows(visit);
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        self.elastic.visit_hessian(x, curvature, visit);
        // A crease that yields has a moment that does not change: φ′² + φφ″ is 0 there.
        let factors = |_, bend: &Bend, Flow([phi, slope, bent]): Flow| match curvature {
            Curvature::Exact => [if bent == 0.0 { 1.0 } else { 0.0 }, bend.share * phi * slope],
            Curvature::Semidefinite => [slope * slope, 0.0],
        };
        self.each_hessian(x, factors, visit);
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        self.elastic.visit_strains(x, visit);
        for (i, (h, weight)) in self.creases.hinges.iter().zip(&self.creases.weight).enumerate() {
            let (bend, root) = (self.creases.bend(i, x), (2.0 * weight).sqrt());
            let Flow([phi, slope, _]) = self.flow(i, &bend);
            visit((h, &self.creases.gradient(i, &bend).map(|d| root * slope * d)), root * phi);
        }
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let (others, own) = stress.split_at(self.elastic.n_elements());
        self.elastic.visit_stress_hessian(x, others, curvature, visit);
        let factors = |i: usize, bend: &Bend, Flow([_, slope, bent]): Flow| match curvature {
            Curvature::Exact => {
                let stress = own[i] / (2.0 * self.creases.weight[i]).sqrt();
                [stress * bent, stress * bend.share * slope]
            }
            Curvature::Semidefinite => [0.0; 2],
        };
        self.each_hessian(x, factors, visit);
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let (others, own) = stress.of.split_at(self.elastic.n_elements());
        self.elastic.visit_mixed_hessian(x, Stress { of: others, ..stress }, visit);
        let factors = |i: usize, bend: &Bend, Flow([_, slope, bent]): Flow| {
            let stress = stress.share * own[i] / (2.0 * self.creases.weight[i]).sqrt();
            [slope * slope + stress * bent, stress * bend.share * slope]
        };
        self.each_hessian(x, factors, visit);
    }

    fn n_membrane(&self) -> usize {
        self.elastic.n_membrane()
    }

    fn visit_stretch(&self, x: &[Vec3], visit: &mut dyn FnMut(f64)) {
        self.elastic.visit_stretch(x, visit);
    }

    fn n_elements(&self) -> usize {
        self.elastic.n_elements() + self.n_creases()
    }

    /// A polynomial does not know what yields.
    fn visit_terms(&self, _: &[Vec3], _: &mut dyn FnMut(Term)) -> bool {
        false
    }

    fn even(&self, weights: &mut [f64]) {
        self.elastic.even(&mut weights[..self.elastic.n_elements()]);
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let (others, own) = weights.split_at(self.elastic.n_elements());
        let kept = |values: &[f64]| -> Arc<[f64]> {
            values.iter().zip(own).filter(|(_, w)| **w != 0.0).map(|(value, _)| *value).collect()
        };
        Box::new(Self {
            elastic: self.elastic.sampled(others, index).into(),
            creases: self.creases.sample(own, index),
            limits: kept(&self.limits),
            made: kept(&self.made),
        })
    }

    fn yielding(&self) -> Option<&Yielding> {
        Some(self)
    }

    fn yielding_mut(&mut self) -> Option<&mut Yielding> {
        Some(self)
    }
}

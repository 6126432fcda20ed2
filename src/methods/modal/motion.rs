//! A modal method as a [`Motion`].

use super::points::PointSearch;
use super::{Map, Modal, VertexMap, midpoint_passes};
use crate::constraint::{Constraint, ConstraintSet, Target};
use crate::error::require_finite;
use crate::method::Method;
use crate::methods::plan::{Around, Part};
use crate::methods::{Acting, Damping, Motion, Reaction, Watch, WriteRotation};
use crate::modal::with_basis;
use crate::warp::{Extent, Placement, visit_turns};
use crate::{Error, ErrorKind, Result, Vec3, rotation};
use nalgebra::UnitQuaternion;

impl<M: Map> Motion for Modal<M> {
    fn method(&self) -> Method {
        self.map.method()
    }

    fn try_clone(&self) -> Result<Box<dyn Motion>> {
        Ok(Box::new(self.clone()))
    }

    fn reset(&mut self) {
        let modes = self.damping.len();
        self.q[..modes].fill(0.0);
        self.q_dot.fill(0.0);
        self.constraints.change(ConstraintSet::reset);
    }

    fn stop(&mut self) {
        self.q_dot.fill(0.0);
    }

    fn step(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.advance(acting, h)
    }

    fn settle(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        self.find_equilibrium(acting, watch)
    }

    fn project_from(&mut self, u: &[Vec3], rate: &[Vec3]) -> Result<()> {
        let (q, q_dot) = self.nearest(u, rate);
        self.take_amplitudes(&q, &q_dot)
    }

    fn is_unchanged(&self) -> bool {
        self.unchanged
    }

    /// Σ max_v |φ_k| √((q_k − f_k/λ_k)² + q̇_k²/λ_k): to first order, what is left of the swing about the equilibrium of the present forces f.
    /// `None` where constraints act, infinite for a shell that drifts.
    fn motion_left(&self) -> Option<f64> {
        let modal = &self.basis;
        let left = |(k, lambda): (usize, &f64)| {
            let swing = if *lambda > 0.0 {
                libm::hypot(self.q[k] - self.force[k] / lambda, self.q_dot[k] / lambda.sqrt())
            } else if self.q_dot[k] == 0.0 && self.force[k] == 0.0 {
                0.0
            } else {
                f64::INFINITY
            };
            swing * modal.participation().reach()[k]
        };
        self.constraints.set().is_empty().then(|| modal.eigenvalues.iter().enumerate().map(left).sum())
    }

    fn step_nanoseconds(&self) -> u64 {
        self.map.step_nanoseconds(&self.basis)
    }

    fn follows_supports(&self) -> bool {
        self.supports.is_some() && self.map.follows_supports()
    }

    fn place_supports(&mut self, displacement: &[Vec3]) {
        self.set_supports(displacement);
    }

    fn supports_missed(&self, displacement: &[Vec3]) -> f64 {
        self.largest_support_miss(displacement)
    }

    fn is_about_sag(&self) -> bool {
        true
    }

    fn settles_spin(&self) -> bool {
        true
    }

    fn unknowns(&self) -> [Vec<f64>; 2] {
        [self.q.clone(), self.q_dot.clone()]
    }

    fn copy_unknowns(&self, into: &mut [Vec<f64>; 2]) {
        into[0].clone_from(&self.q);
        into[1].clone_from(&self.q_dot);
    }

    fn expect_points(&mut self, n: usize) {
        let (modes, amplitudes) = (self.damping.len(), self.q.len());
        let fields = self.map.vertices().map_or(0, VertexMap::n_fields);
        self.search.get_or_insert_with(|| PointSearch::new(modes, amplitudes)).expect(n, fields);
    }

    fn set_unknowns(&mut self, [q, q_dot]: [&[f64]; 2]) {
        self.q.copy_from_slice(q);
        self.q_dot.copy_from_slice(q_dot);
        if let Some(supports) = &mut self.supports {
            supports.acceleration.fill(0.0); // of another motion
        }
    }

    fn n_unknowns(&self) -> usize {
        self.q.len()
    }

    fn is_representable(&self, [q, q_dot]: [&[f64]; 2]) -> bool {
        self.is_representable_at(q, q_dot)
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn amplitudes(&self) -> Result<(&[f64], &[f64])> {
        let modes = self.damping.len();
        Ok((&self.q[..modes], &self.q_dot[..modes]))
    }

    fn set_amplitudes(&mut self, q: &[f64], q_dot: &[f64]) -> Result<()> {
        for (name, given) in [("amplitudes", q), ("velocities", q_dot)] {
            if given.len() != self.damping.len() {
                return Err(Error::argument(format!("{} {name} for {} modes", given.len(), self.damping.len())));
            }
            for (k, x) in given.iter().enumerate() {
                require_finite(format_args!("{name}[{k}]"), *x)?;
            }
        }
        self.take_amplitudes(q, q_dot)
    }

    fn set_damping(&mut self, damping: &Damping) -> Result<bool> {
        let eigenvalues = &self.basis.eigenvalues;
        let Damping { mass_coefficient: xi, stiffness_coefficient: zeta, .. } = damping;
        let by_ratio = damping.by_ratio(&self.basis)?;
        let means =
            if damping.factors.is_empty() { vec![1.0; by_ratio.len()] } else { self.basis.means(&damping.factors) };
        let both = eigenvalues.iter().zip(by_ratio).zip(means);
        let coefficients = both.map(|((lambda, by_ratio), mean)| xi * mean + zeta * lambda + by_ratio);
        let before = std::mem::replace(&mut self.damping, coefficients.collect());
        Ok(self.damping != before)
    }

    fn constraints(&self) -> &ConstraintSet {
        self.constraints.set()
    }

    fn change_constraints(&mut self, change: &mut dyn FnMut(&mut ConstraintSet)) {
        self.constraints.change(change);
    }

    fn check_constraint(&self, constraint: &Constraint) -> Result<()> {
        match constraint.target {
            Target::Orientation(_) if self.basis.is_linear() => without_rotations("a constraint on an orientation"),
            _ => Ok(()),
        }
    }

    fn largest_change(&self, from: &[f64]) -> f64 {
        if self.supports.is_some() { f64::INFINITY } else { self.map.largest_change(&self.basis, from, &self.q) }
    }

    fn positions(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f64; 3]])) {
        self.map.positions((&self.basis, &self.q), placement, write);
    }

    fn positions_f32(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f32; 3]])) {
        self.map.positions_f32((&self.basis, &self.q), placement, write);
    }

    fn positions_of(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f64; 3])) {
        self.map.positions_of((&self.basis, &self.q), placement, vertices, write);
    }

    fn positions_of_f32(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f32; 3])) {
        self.map.positions_of_f32((&self.basis, &self.q), placement, vertices, write);
    }

    /// exp \[w\]× with the modal rotation w.
    fn rotations(&self, frame: UnitQuaternion<f64>, write: &mut WriteRotation) -> Result<()> {
        if self.basis.is_linear() {
            return without_rotations("rotations");
        }
        let turn = |v: usize, w: Vec3| write(v, frame * rotation::by(&w));
        with_basis!(&self.basis.basis, basis => visit_turns(basis, &self.q, turn));
        Ok(())
    }

    fn visit_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        self.map.visit_motion(&self.basis, (&self.q, &self.q_dot), visit);
    }

    fn visit_visible_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        self.map.visit_visible_motion(&self.basis, (&self.q, &self.q_dot), visit);
    }

    fn visit_acceleration(&self, acting: &Acting, reactions: &[Reaction], visit: &mut dyn FnMut(usize, Vec3)) {
        let g = self.unbalanced(acting, reactions);
        self.map.visit_motion(&self.basis, (&self.q, &g), |v, _, a| visit(v, a));
    }

    fn largest_displacement(&self) -> f64 {
        self.basis.participation().largest_displacement(&self.q)
    }

    fn extent(&self) -> Extent {
        self.map.extent((&self.basis, &self.q))
    }

    fn rotation_range(&self) -> Option<f64> {
        Some(self.map.rotation_range())
    }

    fn energies(&self) -> (f64, f64) {
        self.energies_at(&self.q, &self.q_dot)
    }

    fn plan(&self, around: &Around) -> Vec<Part> {
        let passes = 1.0 + midpoint_passes(&around.load, around.h) as f64;
        self.plan_step(around, passes)
    }
}

fn without_rotations<T>(what: &str) -> Result<T> {
    let message = format!("{what}: the model was precomputed for linear modal analysis and has no rotations");
    Err(Error::new(ErrorKind::Unsupported, message))
}

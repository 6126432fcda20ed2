//! The potential whose minimum is an equilibrium, or the end of an implicit step from x₀ (d = x − x₀, ‖d‖²_M = dᵀMd):
//!
//! Φ(x) = E(x) − F·d + ‖d − h u̇‖²_M/(2h²) + ‖d − h u̇‖²_D/(2h) + ξ ‖d‖²_M/(2h) + ζ Σ (b(x₀)·d)²/(2h)
//!
//! D is the wind's: F − D (d/h − u̇) is its force at the step's end, to first order. Without it a light sheet in a strong wind overshoots in every
//! step. And the energies of the [`Constraints`] and of what joins besides. Its gradient is zero where M (u̇⁺ − u̇)/h + D (u̇⁺ − u̇) + C(x₀) u̇⁺ + ∇E(x) = F with u̇⁺ = d/h. An equilibrium has the first two terms.

use super::constraints::Constraints;
use super::parts::{ElasticHessian, Parts, add_both};
use super::{Rayleigh, add_viscous_force};
use crate::energy::{Curvature, ElementHessian, Mat3, Stress};
use crate::point_energy::PointEnergy;
use crate::sparse::BlockMatrix;
use crate::{Shell, Vec3};

/// Φ, with all fields of n_vertices.
#[derive(Clone, Copy)]
pub struct Potential<'a> {
    pub shell: &'a Shell,
    /// x₀.
    pub origin: &'a [Vec3],
    /// F.
    pub load: &'a [Vec3],
    /// The terms of a step; `None` for an equilibrium.
    pub step: Option<Step<'a>>,
    /// What is prescribed besides.
    pub constraints: &'a Constraints,
    /// Energies of points that join.
    pub points: Option<&'a dyn PointEnergy>,
}

/// What makes a step of Φ.
#[derive(Clone, Copy)]
pub struct Step<'a> {
    pub h: f64,
    /// u̇ at the start.
    pub velocity: &'a [Vec3],
    /// ξ and ζ.
    pub damping: Rayleigh,
    /// What ξ is multiplied by at each vertex, or none.
    pub damped: &'a [f64],
    /// D: what F loses by a unit of each vertex' velocity, or none.
    pub drag: &'a [Mat3],
}

impl Potential<'_> {
    /// Φ(x), and the sum of its terms' magnitudes that its rounding error grows with.
    pub fn value(&self, x: &[Vec3]) -> (f64, f64) {
        let elastic = self.shell.energy.value(x);
        let (mut value, mut magnitude) = (elastic, elastic);
        for v in self.free() {
            let d = x[v] - self.origin[v];
            let work = self.load[v].dot(&d);
            let inertia = self.step.map_or(0.0, |s| s.inertia((v, self.shell.mass[v]), &d));
            value += inertia - work;
            magnitude += inertia + work.abs();
        }
        if let Some(s) = self.step.filter(|s| s.damping.stiffness > 0.0) {
            let loss = 0.5 * s.damping.stiffness / s.h * self.squared_strains(x);
            value += loss;
            magnitude += loss;
        }
        let held = self.constraints.value(x);
        let joined = self.points.map_or(0.0, |points| points.value(x));
        (value + held + joined, magnitude + held + joined.abs())
    }

    /// ∇Φ(x) along what constraints leave free; meaningless at vertices that are not free.
    pub fn gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.whole_gradient(x, gradient);
        self.constraints.project(gradient);
    }

    /// The same, on several threads where that pays.
    pub fn gradient_in(&self, parts: &mut Parts, x: &[Vec3], gradient: &mut [Vec3]) {
        if parts.gradient(self.shell, x, gradient) {
            self.add_other_forces(x, gradient);
            self.constraints.project(gradient);
        } else {
            self.gradient(x, gradient);
        }
    }

    /// ∇Φ(x) along all directions that supports leave; meaningless at vertices that are not free.
    pub fn whole_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        gradient.fill(Vec3::zeros());
        self.shell.energy.add_gradient(x, gradient);
        self.add_other_forces(x, gradient);
    }

    /// Adds the gradient of all but the elastic energy.
    fn add_other_forces(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for v in self.free() {
            gradient[v] -= self.load[v];
            if let Some(s) = self.step {
                let rate = (x[v] - self.origin[v]) / s.h;
                gradient[v] += self.shell.mass[v] * ((rate - s.velocity[v]) / s.h + s.xi(v) * rate);
                if let Some(drag) = s.drag.get(v) {
                    gradient[v] += drag * (rate - s.velocity[v]);
                }
            }
        }
        if let Some(s) = self.step.filter(|s| s.damping.stiffness > 0.0) {
            let rate = |v: usize| (x[v] - self.origin[v]) / s.h;
            add_viscous_force(self.shell, self.origin, rate, s.damping.stiffness, gradient);
        }
        self.constraints.add_gradient(x, gradient);
        if let Some(points) = self.points {
            points.add_gradient(x, gradient);
        }
        self.shell.project(gradient);
    }

    /// Leaves of a field what supports and hard positions do not take.
    pub fn project(&self, field: &mut [Vec3]) {
        self.shell.project(field);
        self.constraints.project(field);
    }

    /// ∂²Φ/∂x² over the free vertices.
    pub fn assemble(&self, parts: &mut Parts, x: &[Vec3], curvature: Curvature, matrix: &mut BlockMatrix) {
        if parts.add_hessian(self, x, ElasticHessian::Own(curvature), matrix) {
            return self.add_others(x, curvature, &[], matrix);
        }
        let mut columns = matrix.all();
        columns.clear();
        let add = &mut |element: ElementHessian| self.constraints.add_blocks(element, &mut columns);
        self.shell.energy.visit_hessian(x, curvature, add);
        self.add_others(x, curvature, &[], matrix);
    }

    /// ∇Φ(x) along what constraints leave free, with these `stress`es of the elements in the place of their strains.
    pub fn mixed_gradient(&self, parts: &mut Parts, x: &[Vec3], stress: &[f64], gradient: &mut [Vec3]) {
        if !parts.mixed_gradient(self.shell, x, stress, gradient) {
            gradient.fill(Vec3::zeros());
            let mut each = stress.iter();
            self.shell.energy.visit_rows(x, &mut |(vertices, row)| {
                let stress = each.next().copied().unwrap_or(0.0);
                vertices.iter().zip(row).for_each(|(&v, b)| gradient[v as usize] += stress * b);
            });
        }
        self.add_other_forces(x, gradient);
        self.constraints.project(gradient);
    }

    /// ∇Φ(x), and the same with these `stress`es in the place of the elements' strains, both along what constraints leave free; and the strains.
    pub fn both_gradients(
        &self,
        parts: &mut Parts,
        x: &[Vec3],
        (stress, strains): (&[f64], &mut Vec<f64>),
        [own, mixed]: [&mut [Vec3]; 2],
    ) {
        if parts.both_gradients(self.shell, x, stress, [&mut *own, &mut *mixed]) {
            strains.resize(stress.len(), 0.0);
            parts.read_strains(strains);
        } else {
            own.fill(Vec3::zeros());
            mixed.fill(Vec3::zeros());
            strains.clear();
            let mut each = stress.iter();
            self.shell.energy.visit_strains(x, &mut |row, strain| {
                strains.push(strain);
                add_both(row, [strain, each.next().copied().unwrap_or(0.0)], [&mut *own, &mut *mixed]);
            });
        }
        for gradient in [own, mixed] {
            self.add_other_forces(x, gradient);
            self.constraints.project(gradient);
        }
    }

    /// ∂²Φ/∂x² over the free vertices with these `stress`es of the elements in the place of their strains, and torques of orientations after them. What
    /// other terms have that is not positive semidefinite counts as with [`Curvature::Exact`] for a share of 1, else not.
    pub fn assemble_mixed(&self, parts: &mut Parts, x: &[Vec3], stress: Stress, matrix: &mut BlockMatrix) {
        let others = if stress.share == 1.0 { Curvature::Exact } else { Curvature::Semidefinite };
        let (of, torques) = stress.of.split_at(self.shell.energy.n_elements());
        let stress = Stress { of, ..stress };
        let torques = if torques.len() == self.constraints.n_torques() { torques } else { &[] }; // a kept stress has none
        if parts.add_hessian(self, x, ElasticHessian::Mixed(stress), matrix) {
            return self.add_others(x, others, torques, matrix);
        }
        let mut columns = matrix.all();
        columns.clear();
        let add = &mut |element: ElementHessian| self.constraints.add_blocks(element, &mut columns);
        self.shell.energy.visit_mixed_hessian(x, stress, add);
        self.add_others(x, others, torques, matrix);
    }

    /// Adds the second derivatives of all but the elastic energy.
    fn add_others(&self, x: &[Vec3], curvature: Curvature, torques: &[f64], matrix: &mut BlockMatrix) {
        matrix.fill_rollers(|stiffness| stiffness);
        self.constraints.add_hessian(x, curvature, torques, matrix);
        if let Some(points) = self.points {
            self.constraints.add_points(points, x, curvature, matrix);
        }
        let Some(s) = self.step else { return };
        for (i, v) in self.free().enumerate() {
            matrix.add_diagonal(i, self.shell.mass[v] * s.inertia_of_mass(v));
        }
        if !s.drag.is_empty() {
            for v in self.shell.free.iter().copied() {
                let block = s.drag[v as usize] / s.h;
                matrix.add_element(&[v], |_, _| self.constraints.projected(v, block, v));
            }
        }
        if s.damping.stiffness > 0.0 {
            let weight = s.damping.stiffness / s.h;
            self.shell.energy.visit_rows(self.origin, &mut |(vertices, row)| {
                let block = |p: usize, q: usize| row[p] * (weight * row[q]).transpose();
                matrix.add_element(vertices, |p, q| self.constraints.projected(vertices[p], block(p, q), vertices[q]));
            });
        }
    }

    /// The vertices that move.
    pub fn free(&self) -> impl Iterator<Item = usize> {
        self.shell.free.iter().map(|&v| v as usize)
    }

    /// Σ (b(x₀)·d)².
    fn squared_strains(&self, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        self.shell.energy.visit_rows(self.origin, &mut |(vertices, row)| {
            let d = |v: u32| x[v as usize] - self.origin[v as usize];
            let strain: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&d(v))).sum();
            sum += strain * strain;
        });
        sum
    }
}

impl Step<'_> {
    /// ξ of a vertex.
    fn xi(&self, v: usize) -> f64 {
        self.damped.get(v).map_or(self.damping.mass, |factor| factor * self.damping.mass)
    }

    /// What the mass of a vertex adds to ∂²Φ/∂x², over the mass.
    pub fn inertia_of_mass(&self, v: usize) -> f64 {
        (1.0 / self.h + self.xi(v)) / self.h
    }

    /// The inertia and mass damping of one vertex.
    fn inertia(&self, (v, mass): (usize, f64), d: &Vec3) -> f64 {
        let h = self.h;
        let change = d / h - self.velocity[v];
        let resisted = self.drag.get(v).map_or(0.0, |drag| 0.5 * h * change.dot(&(drag * change)));
        0.5 * mass * (change.norm_squared() + self.xi(v) * d.norm_squared() / h) + resisted
    }
}

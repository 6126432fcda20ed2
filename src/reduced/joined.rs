//! An energy of single vertices on reduced coordinates: W(x̄ + Bq), its gradient Bᵀ∇W and its Hessian BᵀHB.

use super::{ReducedShell, with_fields};
use crate::energy::Curvature;
use crate::point_energy::PointEnergy;
use crate::{Shell, Vec3};
use nalgebra::{DMatrix, Matrix3};

/// Rest positions of some vertices, and B at them.
#[derive(Clone)]
pub struct Places {
    vertices: Vec<u32>,
    rest: Vec<Vec3>,
    /// n × 3 numbers a vertex.
    fields: DMatrix<f64>,
}

impl Places {
    /// Of no vertex.
    pub fn none() -> Self {
        Self { vertices: vec![], rest: vec![], fields: DMatrix::zeros(0, 0) }
    }

    /// Takes other vertices; costs nothing where they are those from before.
    pub fn take(&mut self, shell: &Shell, reduced: &ReducedShell, vertices: &[u32]) {
        if self.vertices == vertices {
            return;
        }
        self.vertices = vertices.to_vec();
        self.rest = vertices.iter().map(|v| shell.mesh.positions[*v as usize]).collect();
        self.fields = with_fields!(&reduced.fields, fields => {
            DMatrix::from_fn(reduced.n(), 3 * vertices.len(), |k, c| fields.at(k, vertices[c / 3] as usize)[c % 3])
        });
    }

    /// x̄ + Bq of the i-th.
    fn at(&self, i: usize, q: &[f64]) -> Vec3 {
        let along = |c: usize| self.fields.column(3 * i + c).iter().zip(q).map(|(b, q)| b * q).sum::<f64>();
        self.rest[i] + Vec3::new(along(0), along(1), along(2))
    }
}

/// See the module's text.
#[derive(Clone, Copy)]
pub struct Joined<'a> {
    /// W in frame axes.
    pub energy: &'a dyn PointEnergy,
    /// Of its vertices.
    pub places: &'a Places,
}

impl Joined<'_> {
    /// W.
    pub fn value(&self, q: &[f64]) -> f64 {
        (0..self.places.rest.len()).map(|i| self.energy.value_at(i, &self.places.at(i, q))).sum()
    }

    /// Adds Bᵀ∇W.
    pub fn add_gradient(&self, q: &[f64], out: &mut [f64]) {
        for i in 0..self.places.rest.len() {
            let gradient = self.energy.gradient_at(i, &self.places.at(i, q));
            for (c, g) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
                out.iter_mut().zip(self.places.fields.column(3 * i + c).iter()).for_each(|(out, b)| *out += g * b);
            }
        }
    }

    /// Adds BᵀHB.
    pub fn add_hessian(&self, q: &[f64], curvature: Curvature, out: &mut DMatrix<f64>) {
        let fields = &self.places.fields;
        for i in 0..self.places.rest.len() {
            let hessian: Matrix3<f64> = self.energy.hessian_at(i, &self.places.at(i, q), curvature);
            for (a, b) in (0..9).map(|ab| (ab / 3, ab % 3)).filter(|ab| hessian[*ab] != 0.0) {
                out.ger(hessian[(a, b)], &fields.column(3 * i + a), &fields.column(3 * i + b), 1.0);
            }
        }
    }
}

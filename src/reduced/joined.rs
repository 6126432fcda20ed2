//! An energy of single points on reduced coordinates: W(x̄ + Bq), its gradient Bᵀ∇W and its Hessian BᵀHB.

use super::{ReducedShell, with_fields};
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use crate::{Shell, Vec3};
use nalgebra::{DMatrix, Matrix3};

/// Rest positions of some points, and B at them.
#[derive(Clone)]
pub struct Places {
    points: Vec<Point>,
    rest: Vec<Vec3>,
    /// n × 3 numbers a point.
    fields: DMatrix<f64>,
}

impl Places {
    /// Of no point.
    pub fn none() -> Self {
        Self { points: vec![], rest: vec![], fields: DMatrix::zeros(0, 0) }
    }

    /// Takes other points; costs nothing where they are those from before.
    pub fn take(&mut self, shell: &Shell, reduced: &ReducedShell, points: &[Point]) {
        if self.points == points {
            return;
        }
        self.points = points.to_vec();
        self.rest = points.iter().map(|point| point.place(|v| shell.mesh.positions[v])).collect();
        self.fields = with_fields!(&reduced.fields, fields => {
            DMatrix::from_fn(reduced.n(), 3 * points.len(), |k, c| points[c / 3].place(|v| fields.at(k, v))[c % 3])
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
    /// Of its points.
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

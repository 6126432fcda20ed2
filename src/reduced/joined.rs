//! An energy of single points on reduced coordinates: W(x̄ + Bq), its gradient Bᵀ∇W and its Hessian BᵀHB.

use super::{Flight, ReducedShell, Rigid, with_fields};
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use crate::{Shell, Vec3};
use nalgebra::{DMatrix, DVectorView, Matrix3};

/// Rest positions of some points, and B at them.
#[derive(Clone)]
pub struct Places {
    points: Vec<Point>,
    rest: Vec<Vec3>,
    /// n × 3 numbers a point, those along x first.
    fields: Vec<f64>,
    n: usize,
}

impl Places {
    /// Of no point.
    pub fn none() -> Self {
        Self { points: vec![], rest: vec![], fields: vec![], n: 0 }
    }

    /// Makes room for so many.
    pub fn expect(&mut self, coordinates: usize, n: usize) {
        self.points.reserve(n);
        self.rest.reserve(n);
        self.fields.reserve(3 * n * coordinates);
    }

    /// Follows the points of a body to first order about the place `at`, where its coordinates, those of rigid motion behind the fields', are `z`.
    pub fn follow(&mut self, body: &Self, rigid: &Rigid, at: &Flight, z: &[f64]) {
        let (turn, n) = (at.turn.matrix(), z.len());
        self.n = n;
        self.rest.clear();
        self.fields.clear();
        self.fields.resize(3 * n * body.rest.len(), 0.0);
        for i in 0..body.rest.len() {
            let y = body.at(i, at.q) - rigid.pivot;
            let rows = &mut self.fields[3 * n * i..3 * n * (i + 1)];
            for c in 0..3 {
                let row = &mut rows[n * c..n * (c + 1)];
                for a in 0..3 {
                    row.iter_mut().zip(body.along(i, a)).for_each(|(out, b)| *out += turn[(c, a)] * b);
                }
                let direction = turn.row(c).transpose();
                rigid.add_force(&y.cross(&direction), &direction, &mut row[body.n..]);
            }
            let along = Vec3::from_fn(|c, _| rows[n * c..n * (c + 1)].iter().zip(z).map(|(b, z)| b * z).sum());
            self.rest.push(rigid.pivot + at.slide + turn * y - along);
        }
    }

    /// Where the i-th is at `q`.
    pub fn place(&self, i: usize, q: &[f64]) -> Vec3 {
        self.at(i, q)
    }

    /// Takes other points; costs nothing where they are those from before, and needs no new room for as many.
    pub fn take(&mut self, shell: &Shell, reduced: &ReducedShell, points: &[Point]) {
        if self.points == points {
            return;
        }
        self.points.clear();
        self.points.extend_from_slice(points);
        self.rest.clear();
        self.rest.extend(points.iter().map(|point| point.place(|v| shell.mesh.positions[v])));
        self.n = reduced.n();
        self.fields.resize(3 * self.n * points.len(), 0.0);
        for (point, rows) in points.iter().zip(self.fields.chunks_exact_mut(3 * self.n)) {
            for k in 0..self.n {
                let field = with_fields!(&reduced.fields, fields => point.place(|v| fields.at(k, v)));
                (0..3).for_each(|c| rows[c * self.n + k] = field[c]);
            }
        }
    }

    /// B of the i-th along an axis.
    fn along(&self, i: usize, axis: usize) -> &[f64] {
        &self.fields[(3 * i + axis) * self.n..][..self.n]
    }

    /// x̄ + Bq of the i-th.
    fn at(&self, i: usize, q: &[f64]) -> Vec3 {
        let along = |c: usize| self.along(i, c).iter().zip(q).map(|(b, q)| b * q).sum::<f64>();
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
                out.iter_mut().zip(self.places.along(i, c)).for_each(|(out, b)| *out += g * b);
            }
        }
    }

    /// Adds BᵀHB.
    pub fn add_hessian(&self, q: &[f64], curvature: Curvature, out: &mut DMatrix<f64>) {
        let n = self.places.n;
        for i in 0..self.places.rest.len() {
            let hessian: Matrix3<f64> = self.energy.hessian_at(i, &self.places.at(i, q), curvature);
            for (a, b) in (0..9).map(|ab| (ab / 3, ab % 3)).filter(|ab| hessian[*ab] != 0.0) {
                let [along, across] = [a, b].map(|axis| DVectorView::from_slice(self.places.along(i, axis), n));
                out.ger(hessian[(a, b)], &along, &across, 1.0);
            }
        }
    }
}

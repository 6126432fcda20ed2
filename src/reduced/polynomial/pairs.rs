//! Pairs of vertices, and what their squared distances gain: y = |x_b − x_a|² − |x̄_b − x̄_a|² = 2ē·Dq + |Dq|² with D = B_b − B_a.

use super::Form;
use crate::Vec3;
use crate::energy::Mirror;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::DMatrix;

/// Pairs whose products are summed at once.
const CHUNK: usize = 256;

/// B by vertex, three rows of fields each.
pub struct Rows {
    pub n: usize,
    numbers: Vec<f64>,
}

impl Rows {
    /// From the columns of B, with what further vertices are the images of.
    pub fn new(columns: &[Vec<Vec3>], images: &[(u32, Mirror)]) -> Self {
        let (n, vertices) = (columns.len(), columns.first().map_or(0, Vec::len));
        let mut numbers = vec![0.0; 3 * n * (vertices + images.len())];
        for (k, column) in columns.iter().enumerate() {
            let turned = images.iter().map(|(v, plane)| plane.turn() * column[*v as usize]);
            for (v, u) in column.iter().copied().chain(turned).enumerate() {
                (0..3).for_each(|c| numbers[(3 * v + c) * n + k] = u[c]);
            }
        }
        Self { n, numbers }
    }

    /// All of them (3 n_vertices × fields).
    pub fn matrix(&self) -> MatRef<'_, f64> {
        MatRef::from_row_major_slice(&self.numbers, self.numbers.len() / self.n.max(1), self.n)
    }

    /// The three rows at a vertex.
    pub fn at(&self, v: u32) -> &[f64] {
        &self.numbers[3 * v as usize * self.n..][..3 * self.n]
    }

    /// D of a pair.
    pub fn difference(&self, [a, b]: [u32; 2], out: &mut [f64]) {
        out.iter_mut().zip(self.at(a)).zip(self.at(b)).for_each(|((out, a), b)| *out = b - a);
    }
}

/// y of every pair (pairs × shapes), of vertices that rest at `x`.
pub fn gains(x: &[Vec3], pairs: &[[u32; 2]], rows: &Rows, shapes: &[Vec<f64>]) -> Mat<f64> {
    let coordinates = Mat::from_fn(rows.n, shapes.len(), |k, s| shapes[s][k]);
    let moved = rows.matrix() * coordinates;
    Mat::from_fn(pairs.len(), shapes.len(), |e, s| {
        let [a, b] = pairs[e].map(|v| v as usize);
        let by = Vec3::from_fn(|c, _| moved[(3 * b + c, s)] - moved[(3 * a + c, s)]);
        by.dot(&(2.0 * (x[b] - x[a]) + by))
    })
}

/// The forms Σ p y of the columns of p (pairs × forms), of weight 1, of vertices that rest at `x`.
pub fn forms(x: &[Vec3], pairs: &[[u32; 2]], rows: &Rows, p: MatRef<'_, f64>) -> Vec<Form> {
    let (n, count) = (rows.n, p.ncols());
    let mut linear = vec![vec![0.0; n]; count];
    let mut quadratic = vec![Mat::<f64>::zeros(n, n); count];
    let [mut apart, mut scaled] = [vec![0.0; 3 * CHUNK * n], vec![0.0; 3 * CHUNK * n]];
    for first in (0..pairs.len()).step_by(CHUNK) {
        let some = &pairs[first..pairs.len().min(first + CHUNK)];
        let size = 3 * some.len() * n;
        some.iter().zip(apart.chunks_exact_mut(3 * n)).for_each(|(pair, out)| rows.difference(*pair, out));
        for (k, (linear, quadratic)) in linear.iter_mut().zip(&mut quadratic).enumerate() {
            for (e, (pair, (apart, scaled))) in
                some.iter().zip(apart.chunks_exact(3 * n).zip(scaled.chunks_exact_mut(3 * n))).enumerate()
            {
                let factor = 2.0 * p[(first + e, k)];
                let [a, b] = pair.map(|v| x[v as usize]);
                scaled.iter_mut().zip(apart).for_each(|(out, x)| *out = factor * x);
                for (row, edge) in scaled.chunks_exact(n).zip((b - a).iter()) {
                    linear.iter_mut().zip(row).for_each(|(sum, x)| *sum += edge * x);
                }
            }
            let [left, right] = [&apart, &scaled].map(|rows| MatRef::from_row_major_slice(&rows[..size], size / n, n));
            let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
            let left = left.transpose();
            matmul(quadratic.as_mut(), lower, Accum::Add, left, whole, right, whole, 1.0, Par::Seq);
        }
    }
    let form = |(linear, quadratic): (Vec<f64>, Mat<f64>)| Form {
        weight: 1.0,
        bound: 0.0,
        linear,
        quadratic: symmetric(quadratic.as_ref()),
    };
    linear.into_iter().zip(quadratic).map(form).collect()
}

/// Both triangles from the lower one.
pub fn symmetric(lower: MatRef<'_, f64>) -> DMatrix<f64> {
    DMatrix::from_fn(lower.nrows(), lower.ncols(), |i, j| lower[(i.max(j), i.min(j))])
}

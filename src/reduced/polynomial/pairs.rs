//! Pairs of vertices, and what their squared distances gain: y = |x_b − x_a|² − |x̄_b − x̄_a|² = 2ē·Dq + |Dq|² with D = B_b − B_a.

use super::Form;
use crate::energy::Mirror;
use crate::reduced::basis::MULTIPLICATION;
use crate::{Vec3, threads};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

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

    /// Where coordinates (shapes × fields) move: of one axis of a vertex after the other.
    fn moved(&self, coordinates: &Mat<f64>) -> Vec<f64> {
        let (rows, shapes) = (self.matrix(), coordinates.nrows());
        let mut moved = vec![0.0; rows.nrows() * shapes];
        let work = MULTIPLICATION * (moved.len() * self.n) as f64;
        let chunks = moved.chunks_mut((CHUNK * shapes).max(1)).enumerate();
        threads::share_items(&mut chunks.collect::<Vec<_>>(), work as u64, |(k, chunk)| {
            let count = chunk.len() / shapes.max(1);
            let some = rows.subrows(*k * CHUNK, count).transpose();
            let out = MatMut::from_column_major_slice_mut(chunk, shapes, count);
            matmul(out, Accum::Replace, coordinates, some, 1.0, Par::Seq);
        });
        moved
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

/// y of every pair at some shapes.
pub struct Gains {
    pub shapes: usize,
    /// Of one pair after the other.
    numbers: Vec<f64>,
}

impl Gains {
    /// Of vertices that rest at `x`.
    pub fn new(x: &[Vec3], pairs: &[[u32; 2]], rows: &Rows, shapes: &[Vec<f64>]) -> Self {
        let count = shapes.len();
        let coordinates = Mat::from_fn(count, rows.n, |s, k| shapes[s][k]);
        let moved = rows.moved(&coordinates);
        let at = |v: usize, c: usize| &moved[(3 * v + c) * count..][..count];
        let mut numbers = vec![0.0; pairs.len() * count];
        let chunks = numbers.chunks_mut((CHUNK * count).max(1)).zip(pairs.chunks(CHUNK));
        let work = 20.0 * MULTIPLICATION * (pairs.len() * count) as f64;
        threads::share_items(&mut chunks.collect::<Vec<_>>(), work as u64, |(numbers, pairs)| {
            let ends = pairs.iter().map(|pair| pair.map(|v| v as usize));
            for (out, [a, b]) in numbers.chunks_exact_mut(count.max(1)).zip(ends) {
                for c in 0..3 {
                    let twice = 2.0 * (x[b] - x[a])[c];
                    for ((y, to), from) in out.iter_mut().zip(at(b, c)).zip(at(a, c)) {
                        let by = to - from;
                        *y += by * (twice + by);
                    }
                }
            }
        });
        Self { shapes: count, numbers }
    }

    /// What they gain at rest along the first so many fields, to first order.
    pub fn slopes(x: &[Vec3], pairs: &[[u32; 2]], rows: &Rows, most: usize) -> Self {
        let (shapes, mut apart) = (most.min(rows.n), vec![0.0; 3 * rows.n]);
        let mut numbers = Vec::with_capacity(pairs.len() * shapes);
        for pair in pairs {
            rows.difference(*pair, &mut apart);
            let edge = x[pair[1] as usize] - x[pair[0] as usize];
            numbers.extend((0..shapes).map(|k| 2.0 * (0..3).map(|c| edge[c] * apart[c * rows.n + k]).sum::<f64>()));
        }
        Self { shapes, numbers }
    }

    /// Of one pair.
    pub fn of(&self, pair: usize) -> &[f64] {
        &self.numbers[pair * self.shapes..][..self.shapes]
    }

    /// All (shapes × pairs).
    pub fn matrix(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.numbers, self.shapes, self.numbers.len() / self.shapes.max(1))
    }
}

/// Pairs whose products of two fields are made at once: some hundred kilobytes of 48 fields.
const SOME: usize = 64;

/// The forms Σ p y of the columns of p (pairs × forms), of weight 1, of vertices that rest at `x`.
pub fn forms(x: &[Vec3], pairs: &[[u32; 2]], rows: &Rows, p: MatRef<'_, f64>) -> Vec<Form> {
    let (n, count, arch) = (rows.n, p.ncols(), Arch::new());
    let triangle = n * (n + 1) / 2;
    let numbered: Vec<(usize, [u32; 2])> = pairs.iter().copied().enumerate().collect();
    let work = MULTIPLICATION * (pairs.len() * (count + 10) * triangle) as f64;
    let parts = threads::map(&threads::parts(&numbered, SOME), work as u64, |part| {
        let (mut quadratic, mut linear) = (Mat::<f64>::zeros(count, triangle), Mat::<f64>::zeros(count, n));
        let (mut products, mut slopes) = (vec![0.0; SOME * triangle], vec![0.0; SOME * n]);
        let mut apart = vec![0.0; 3 * n];
        for some in part.chunks(SOME) {
            let outs = products.chunks_exact_mut(triangle.max(1)).zip(slopes.chunks_exact_mut(n.max(1)));
            for ((_, pair), (products, slopes)) in some.iter().zip(outs) {
                rows.difference(*pair, &mut apart);
                let [a, b] = pair.map(|v| x[v as usize]);
                arch.dispatch(Gain { apart: &apart, edge: b - a, products, slopes });
            }
            let factors = p.subrows(some[0].0, some.len()).transpose();
            let products = MatRef::from_row_major_slice(&products[..some.len() * triangle], some.len(), triangle);
            let slopes = MatRef::from_row_major_slice(&slopes[..some.len() * n], some.len(), n);
            matmul(quadratic.as_mut(), Accum::Add, factors, products, 1.0, Par::Seq);
            matmul(linear.as_mut(), Accum::Add, factors, slopes, 1.0, Par::Seq);
        }
        (quadratic, linear)
    });
    let (mut quadratic, mut linear) = (Mat::<f64>::zeros(count, triangle), Mat::<f64>::zeros(count, n));
    for (quadratic_part, linear_part) in &parts {
        quadratic += quadratic_part;
        linear += linear_part;
    }
    let entry = |k: usize, i: usize, j: usize| quadratic[(k, i * (i + 1) / 2 + j)];
    let form = |k: usize| Form {
        weight: 1.0,
        bound: 0.0,
        linear: (0..n).map(|i| linear[(k, i)]).collect(),
        quadratic: DMatrix::from_fn(n, n, |i, j| entry(k, i.max(j), i.min(j))),
    };
    (0..count).map(form).collect()
}

/// What y of a pair has of two fields, 2 D_k·D_l for l ≤ k, and of one, 2 ē·D_k.
struct Gain<'a> {
    apart: &'a [f64],
    edge: Vec3,
    products: &'a mut [f64],
    slopes: &'a mut [f64],
}

impl WithSimd for Gain<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { apart, edge, products, slopes } = self;
        let n = slopes.len();
        let (x, yz) = apart.split_at(n);
        let (y, z) = yz.split_at(n);
        for k in 0..n {
            let [a, b, c] = [2.0 * x[k], 2.0 * y[k], 2.0 * z[k]];
            slopes[k] = edge[0] * a + edge[1] * b + edge[2] * c;
            let products = &mut products[k * (k + 1) / 2..][..k + 1];
            for l in 0..=k {
                products[l] = a * x[l] + b * y[l] + c * z[l];
            }
        }
    }
}

/// Both triangles from the lower one.
pub fn symmetric(lower: MatRef<'_, f64>) -> DMatrix<f64> {
    DMatrix::from_fn(lower.nrows(), lower.ncols(), |i, j| lower[(i.max(j), i.min(j))])
}

//! The products that reduced energies are made of, in the processor's widest registers. Matrices are rows of `stride` numbers, a
//! multiple of [`WIDTH`].

use crate::Vec3;
use crate::energy::{MAX_ELEMENT, Mat3};
use pulp::{Simd, WithSimd};

/// Numbers in the widest register; rows are padded to it.
pub const WIDTH: usize = 8;
/// Rows whose products are summed in registers before they are added to what is in memory; with as many numbers a row they stay in the
/// first-level cache.
const DEPTH: usize = 64;

/// x = x̄ + Bq.
pub struct Place<'a> {
    /// B: x, y, z of each vertex in turn.
    pub rows: &'a [f64],
    /// x̄.
    pub rest: &'a [Vec3],
    /// A row.
    pub q: &'a [f64],
    /// Where to.
    pub x: &'a mut [Vec3],
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (rows, q) = (S::as_simd_f64s(self.rows).0, S::as_simd_f64s(self.q).0);
        for ((x, rest), rows) in self.x.iter_mut().zip(self.rest).zip(rows.chunks_exact(3 * q.len())) {
            let (of_x, others) = rows.split_at(q.len());
            let (of_y, of_z) = others.split_at(q.len());
            let mut sums = [simd.splat_f64s(0.0); 3];
            for (((q, a), b), c) in q.iter().zip(of_x).zip(of_y).zip(of_z) {
                sums[0] = simd.mul_add_e_f64s(*a, *q, sums[0]);
                sums[1] = simd.mul_add_e_f64s(*b, *q, sums[1]);
                sums[2] = simd.mul_add_e_f64s(*c, *q, sums[2]);
            }
            for c in 0..3 {
                x[c] = rest[c] + simd.reduce_sum_f64s(sums[c]);
            }
        }
    }
}

/// The product HB of a sum H of elements' blocks.
pub struct Multiply<'a> {
    /// B: x, y, z of each vertex in turn.
    pub rows: &'a [f64],
    /// Of a row.
    pub stride: usize,
    /// Vertices, and how many.
    pub elements: &'a [([u32; MAX_ELEMENT], usize)],
    /// k × k of each element.
    pub blocks: &'a [Mat3],
    /// As the rows.
    pub out: &'a mut [f64],
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rows = (S::as_simd_f64s(self.rows).0, registers::<S>(self.stride));
        let out = S::as_mut_simd_f64s(self.out).0;
        out.fill(simd.splat_f64s(0.0));
        let mut blocks = self.blocks;
        for (vertices, k) in self.elements {
            let (own, others) = blocks.split_at(k * k);
            blocks = others;
            match k {
                2 => multiply::<S, 2>(simd, rows, vertices, own, out),
                3 => multiply::<S, 3>(simd, rows, vertices, own, out),
                4 => multiply::<S, 4>(simd, rows, vertices, own, out),
                5 => multiply::<S, 5>(simd, rows, vertices, own, out),
                _ => multiply::<S, MAX_ELEMENT>(simd, rows, vertices, own, out),
            }
        }
    }
}

/// That so many numbers fill.
fn registers<S: Simd>(numbers: usize) -> usize {
    numbers * size_of::<f64>() / size_of::<S::f64s>()
}

/// For one element of K vertices.
#[inline(always)]
fn multiply<S: Simd, const K: usize>(
    simd: S,
    (rows, stride): (&[S::f64s], usize),
    vertices: &[u32; MAX_ELEMENT],
    blocks: &[Mat3],
    out: &mut [S::f64s],
) {
    let first: [usize; K] = std::array::from_fn(|p| 3 * vertices[p] as usize * stride);
    let own = first.map(|first| &rows[first..first + 3 * stride]);
    for j in 0..stride {
        let mut b = [[simd.splat_f64s(0.0); 3]; K];
        for q in 0..K {
            for d in 0..3 {
                b[q][d] = own[q][d * stride + j];
            }
        }
        for p in 0..K {
            let out = &mut out[first[p]..first[p] + 3 * stride];
            for c in 0..3 {
                let mut sum = out[c * stride + j];
                for q in 0..K {
                    let block = &blocks[K * p + q];
                    for d in 0..3 {
                        sum = simd.mul_add_e_f64s(simd.splat_f64s(block[(c, d)]), b[q][d], sum);
                    }
                }
                out[c * stride + j] = sum;
            }
        }
    }
}

/// LᵀR.
pub struct AddProducts<'a> {
    /// Rows, and numbers in each.
    pub left: (&'a [f64], usize),
    /// As many rows.
    pub right: (&'a [f64], usize),
    /// Only the lower triangle is needed; some of what is above it is added to as well.
    pub lower: bool,
    /// A row for each column of L; added to.
    pub out: &'a mut [f64],
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let ((left, tall), (right, wide)) = (self.left, self.right);
        let out = S::as_mut_simd_f64s(self.out).0;
        let stride = registers::<S>(wide);
        for (left, right) in left.chunks(DEPTH * tall).zip(right.chunks(DEPTH * wide)) {
            let right = S::as_simd_f64s(right).0;
            for i in (0..tall).step_by(WIDTH) {
                let end = if self.lower { registers::<S>(i + WIDTH) } else { stride };
                for j in 0..end {
                    let mut sums = [simd.splat_f64s(0.0); WIDTH];
                    for (left, right) in left.chunks_exact(tall).zip(right.chunks_exact(stride)) {
                        let (own, right) = (&left[i..i + WIDTH], right[j]);
                        for n in 0..WIDTH {
                            sums[n] = simd.mul_add_e_f64s(simd.splat_f64s(own[n]), right, sums[n]);
                        }
                    }
                    for n in 0..WIDTH {
                        let out = &mut out[(i + n) * stride + j];
                        *out = simd.add_f64s(*out, sums[n]);
                    }
                }
            }
        }
    }
}

/// sum += Bᵀg.
#[inline(always)]
pub fn project(rows: &[f64], g: &[Vec3], sum: &mut [f64]) {
    let stride = sum.len();
    for (g, rows) in g.iter().zip(rows.chunks_exact(3 * stride)) {
        let (x, yz) = rows.split_at(stride);
        let (y, z) = yz.split_at(stride);
        for k in 0..stride {
            sum[k] += x[k] * g[0] + y[k] * g[1] + z[k] * g[2];
        }
    }
}

/// sum = Bᵀb for one element's row b.
#[inline(always)]
pub fn project_row(rows: &[f64], (vertices, row): (&[u32; MAX_ELEMENT], &[Vec3]), sum: &mut [f64]) {
    sum.fill(0.0);
    let size = 3 * sum.len();
    for (&v, g) in vertices.iter().zip(row) {
        project(&rows[v as usize * size..][..size], std::slice::from_ref(g), sum);
    }
}

/// [`project`] in the widest registers.
pub struct Project<'a> {
    /// B: x, y, z of each vertex in turn.
    pub rows: &'a [f64],
    /// A vector for each vertex.
    pub of: &'a [Vec3],
    /// Added to.
    pub sum: &'a mut [f64],
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        project(self.rows, self.of, self.sum);
    }
}

/// [`project_row`] of elements' rows times their factors, or as they are, in the widest registers.
pub struct ProjectRows<'a> {
    /// B: x, y, z of each vertex in turn.
    pub rows: &'a [f64],
    /// Vertices, and how many.
    pub elements: &'a [([u32; MAX_ELEMENT], usize)],
    /// b of each element.
    pub strain_rows: &'a [[Vec3; MAX_ELEMENT]],
    /// Of each element, if any.
    pub factors: &'a [f64],
    /// Numbers in a line, and a line for each element.
    pub out: (usize, &'a mut [f64]),
}

impl WithSimd for ProjectRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (stride, lines) = self.out;
        for (e, ((vertices, k), row)) in self.elements.iter().zip(self.strain_rows).enumerate() {
            let line = &mut lines[e * stride..][..stride];
            project_row(self.rows, (vertices, &row[..*k]), line);
            if let Some(factor) = self.factors.get(e) {
                for x in line {
                    *x *= factor;
                }
            }
        }
    }
}

/// The stress of the membrane's strains ε, own ε + (1 − own) S(r + Sᵀε), and r + Sᵀε, in the widest registers.
pub struct Resist<'a> {
    /// S, a row of as many as r for each element.
    pub stresses: &'a [f64],
    /// ε.
    pub strain: &'a [f64],
    /// ε at first.
    pub stress: &'a mut [f64],
    /// r at first.
    pub resultants: &'a mut [f64],
    /// The share of its own.
    pub own: f64,
}

impl WithSimd for Resist<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { stresses, strain, stress, resultants, own } = self;
        for (row, strain) in stresses.chunks_exact(resultants.len().max(1)).zip(strain) {
            for (sum, s) in resultants.iter_mut().zip(row) {
                *sum += s * strain;
            }
        }
        for (row, stress) in stresses.chunks_exact(resultants.len().max(1)).zip(stress) {
            *stress = own * *stress + (1.0 - own) * dot(row, resultants);
        }
    }
}

/// a·b of any length.
pub fn dot_all(a: &[f64], b: &[f64]) -> f64 {
    let whole = a.len() / WIDTH * WIDTH;
    dot(a, b) + a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum::<f64>()
}

/// Σ f(aᵢ, bᵢ), some in turn, for one sum waits for the one before.
#[inline(always)]
pub fn sum_of(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> f64 {
    let mut sums = [0.0; WIDTH];
    let ((a, last), (b, others)) = (a.as_chunks::<WIDTH>(), b.as_chunks::<WIDTH>());
    for (a, b) in a.iter().zip(b) {
        (0..WIDTH).for_each(|i| sums[i] += f(a[i], b[i]));
    }
    for ((sum, a), b) in sums.iter_mut().zip(last).zip(others) {
        *sum += f(*a, *b);
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// a·b of rows.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; WIDTH];
    for (a, b) in a.as_chunks::<WIDTH>().0.iter().zip(b.as_chunks::<WIDTH>().0) {
        for i in 0..WIDTH {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum()
}

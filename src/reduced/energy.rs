//! The discrete shell's energy in reduced coordinates, E(x̄ + Bq), its gradient Bᵀ∇E and its Hessian BᵀHB, on some of the
//! elements with nonnegative weights. Only the vertices of those elements are ever placed.
//!
//! Fields that hold a bent shape to a thousandth still stretch it a little, and on a thin shell that little costs more than the bend:
//! the minimum of E on few fields bends far too little (membrane locking). So the membrane's strains ε = √(2w) s (a number an element)
//! count by their part along a few *stress fields* S (elements × stresses, SᵀS = I) that equilibria of the shell are known to have, as in
//! mixed methods with assumed stress (Pian 1964):
//!
//!   E_membrane = ½ (1 − α) |Sᵀε|² + ½ α |ε|²,
//!
//! with a small α against motions that no stress field resists. On samples of weight w, Sᵀε is Σ w S_e ε_e.
//!
//! Models saved before samples were weighed by the modes' rest stiffness add ½ qᵀDq on the modes, what their samples left of it; D = 0
//! since: where the shell is bent far a constant matrix is not what was left out, and if negative it buckles the shell.

use crate::energy::{Curvature, Energy, Mat3};
use crate::{Shell, Vec3};
use nalgebra::DMatrix;
use pulp::Arch;

/// See the module's text.
pub struct ReducedEnergy {
    energy: Box<dyn Energy>,
    /// Rest positions of the vertices that the elements touch.
    rest: Vec<Vec3>,
    /// B at them: x, y, z of each vertex in turn, a row of `stride` numbers each.
    rows: Vec<f64>,
    /// Vertices of each element.
    elements: Vec<([u32; 4], usize)>,
    n_blocks: usize,
    /// How many of them, the first, are the membrane's.
    membrane: usize,
    /// √w S at these, a row of `n_stresses` each (a multiple of [`WIDTH`]; none: the plain energy).
    stresses: Vec<f64>,
    n_stresses: usize,
    /// Coordinates, and numbers in a row.
    n: usize,
    stride: usize,
    /// D (modes × modes).
    correction: DMatrix<f64>,
    arch: Arch,
}

/// Room, so that evaluation does not allocate.
#[derive(Clone)]
pub struct Scratch {
    x: Vec<Vec3>,
    gradient: Vec<Vec3>,
    /// q, padded.
    q: Vec<f64>,
    sum: Vec<f64>,
    blocks: Vec<Mat3>,
    /// √w ε of each element and its gradient, σ = ∂E/∂(√w ε), Sᵀε, and its gradient by q (as the rows).
    strain: Vec<f64>,
    strain_rows: Vec<[Vec3; 4]>,
    stress: Vec<f64>,
    resultants: Vec<f64>,
    coupling: Vec<f64>,
    /// H B (as the rows).
    product: Vec<f64>,
    square: Vec<f64>,
}

/// Numbers in the widest register; rows are padded to it.
const WIDTH: usize = 8;

/// α, by the validation loads of docs/front.md.
const LEAST_MEMBRANE: f64 = 0.003;

impl ReducedEnergy {
    /// On the elements with a weight other than 0 (in the order of the shell's rest rows); `fields` are the columns of B.
    pub fn new(shell: &Shell, fields: &[Vec<Vec3>], weights: &[f64]) -> Self {
        let mut index = vec![u32::MAX; shell.mass.len()];
        let (mut touched, mut elements, mut n_blocks) = (vec![], vec![], 0);
        let mut weight = weights.iter();
        shell.energy.visit_rest_rows(&mut |(vertices, _)| {
            if weight.next().is_none_or(|w| *w == 0.0) {
                return;
            }
            let mut own = [0; 4];
            for (slot, &v) in own.iter_mut().zip(vertices) {
                if index[v as usize] == u32::MAX {
                    index[v as usize] = touched.len() as u32;
                    touched.push(v as usize);
                }
                *slot = index[v as usize];
            }
            n_blocks += vertices.len() * vertices.len();
            elements.push((own, vertices.len()));
        });
        let membrane = weights[..shell.energy.n_membrane()].iter().filter(|w| **w != 0.0).count();
        let n = fields.len();
        let stride = n.next_multiple_of(WIDTH);
        let mut rows = vec![0.0; 3 * touched.len() * stride];
        for (row, (v, c)) in
            rows.chunks_exact_mut(stride).zip(touched.iter().flat_map(|v| (0..3).map(move |c| (*v, c))))
        {
            row.iter_mut().zip(fields).for_each(|(x, field)| *x = field[v][c]);
        }
        Self {
            energy: shell.energy.sampled(weights, &index),
            rest: touched.iter().map(|&v| shell.mesh.positions[v]).collect(),
            rows,
            elements,
            n_blocks,
            membrane,
            stresses: vec![],
            n_stresses: 0,
            n,
            stride,
            correction: DMatrix::zeros(0, 0),
            arch: Arch::new(),
        }
    }

    /// Sets D (modes × modes).
    pub fn correct(&mut self, correction: DMatrix<f64>) {
        self.correction = correction;
    }

    /// D.
    pub fn correction(&self) -> &DMatrix<f64> {
        &self.correction
    }

    /// Sets S, of which `of(e)` is the row of the membrane's element that is e-th among the elements here, of weight `weights[e]`.
    pub fn assume<'a>(&mut self, weights: &[f64], of: impl Fn(usize) -> &'a [f64]) {
        self.n_stresses = if self.membrane == 0 { 0 } else { of(0).len().next_multiple_of(WIDTH) };
        self.stresses = vec![0.0; self.membrane * self.n_stresses];
        for (e, row) in self.stresses.chunks_exact_mut(self.n_stresses.max(1)).enumerate() {
            row.iter_mut().zip(of(e)).for_each(|(out, s)| *out = weights[e].sqrt() * s);
        }
    }

    /// Elements of the membrane.
    pub fn n_membrane(&self) -> usize {
        self.membrane
    }

    /// Stress fields, and zeros up to a multiple of the widest register's numbers.
    pub fn n_stresses(&self) -> usize {
        self.n_stresses
    }

    /// α, or 1 without stress fields.
    fn own_share(&self) -> f64 {
        if self.n_stresses == 0 { 1.0 } else { LEAST_MEMBRANE }
    }

    /// √w S at an element of the membrane.
    pub fn stress_row(&self, e: usize) -> &[f64] {
        &self.stresses[e * self.n_stresses..(e + 1) * self.n_stresses]
    }

    /// Strains, their gradients, Sᵀε and σ at the shape in the scratch; returns E without D.
    fn measure(&self, scratch: &mut Scratch) -> f64 {
        let Scratch { x, strain, strain_rows, stress, resultants, .. } = scratch;
        let mut e = 0;
        self.energy.visit_strains(x, &mut |(_, row), value| {
            strain_rows[e][..row.len()].copy_from_slice(row);
            strain[e] = value;
            e += 1;
        });
        self.resist(strain, stress, resultants)
    }

    /// σ and Sᵀε of strains; returns their energy.
    fn resist(&self, strain: &[f64], stress: &mut [f64], resultants: &mut [f64]) -> f64 {
        let own = self.own_share();
        resultants.fill(0.0);
        for e in 0..if self.n_stresses > 0 { self.membrane } else { 0 } {
            resultants.iter_mut().zip(self.stress_row(e)).for_each(|(c, s)| *c += s * strain[e]);
        }
        for (e, (stress, strain)) in stress.iter_mut().zip(strain).enumerate() {
            *stress = *strain;
            if e < self.membrane && self.n_stresses > 0 {
                let along: f64 = resultants.iter().zip(self.stress_row(e)).map(|(c, s)| c * s).sum();
                *stress = own * strain + (1.0 - own) * along;
            }
        }
        0.5 * strain.iter().zip(&*stress).map(|(strain, stress)| strain * stress).sum::<f64>()
    }

    /// Coordinates.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Elements evaluated.
    pub fn n_elements(&self) -> usize {
        self.elements.len()
    }

    /// Of a Hessian, by what grows alike: elements; multiplications of their blocks with B; of products of B's rows and of stress fields;
    /// of strains along stress fields.
    pub fn operations(&self) -> [f64; 4] {
        let (stride, stresses) = (self.stride as f64, self.n_stresses as f64);
        let blocks: usize = self.elements.iter().map(|(_, k)| 9 * k * k).sum();
        let squares = (self.rows.len() as f64 / stride + stresses) * stride * stride / 2.0;
        [self.elements.len() as f64, blocks as f64 * stride, squares, self.membrane as f64 * stresses * stride]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.rows.len() + self.stresses.len()) + size_of::<Vec3>() * self.rest.len() + 150 * self.elements.len()
    }

    /// Room for one evaluation at a time.
    pub fn scratch(&self) -> Scratch {
        let zeros = vec![Vec3::zeros(); self.rest.len()];
        Scratch {
            x: zeros.clone(),
            gradient: zeros,
            q: vec![0.0; self.stride],
            sum: vec![0.0; self.stride],
            blocks: vec![Mat3::zeros(); self.n_blocks],
            strain: vec![0.0; self.elements.len()],
            strain_rows: vec![[Vec3::zeros(); 4]; self.elements.len()],
            stress: vec![0.0; self.elements.len()],
            resultants: vec![0.0; self.n_stresses],
            coupling: vec![0.0; self.n_stresses * self.stride],
            product: vec![0.0; self.rows.len()],
            square: vec![0.0; self.stride * self.stride],
        }
    }

    fn place(&self, q: &[f64], scratch: &mut Scratch) {
        scratch.q[..self.n].copy_from_slice(q);
        let Scratch { x, q, .. } = scratch;
        self.arch.dispatch(|| place(&self.rows, &self.rest, q, x));
    }

    /// E(x̄ + Bq).
    pub fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        self.place(q, scratch);
        self.measure(scratch) + 0.5 * self.corrected(q, |k, d| q[k] * d)
    }

    /// Σ f(k, (Dq)_k).
    fn corrected(&self, q: &[f64], mut f: impl FnMut(usize, f64) -> f64) -> f64 {
        let m = self.correction.nrows();
        (0..m).map(|k| f(k, (0..m).map(|j| self.correction[(k, j)] * q[j]).sum())).sum()
    }

    /// Bᵀ∇E at x̄ + Bq.
    pub fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        self.place(q, scratch);
        self.measure(scratch);
        let Scratch { gradient, strain_rows, stress, sum, .. } = scratch;
        gradient.fill(Vec3::zeros());
        for (((vertices, k), row), stress) in self.elements.iter().zip(&*strain_rows).zip(&*stress) {
            vertices[..*k].iter().zip(row).for_each(|(&v, row)| gradient[v as usize] += *stress * row);
        }
        sum.fill(0.0);
        self.arch.dispatch(|| project(&self.rows, gradient, sum));
        out.copy_from_slice(&sum[..self.n]);
        self.corrected(q, |k, d| {
            out[k] += d;
            0.0
        });
    }

    /// BᵀHB at x̄ + Bq (n × n, both triangles).
    pub fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        self.place(q, scratch);
        self.measure(scratch);
        let Scratch { x, blocks, strain_rows, stress, product, square, sum, coupling, .. } = scratch;
        let (mut at, mut e) = (0, 0);
        let own = self.own_share();
        self.energy.visit_stress_hessian(x, stress, curvature, &mut |(vertices, element)| {
            let (k, row) = (vertices.len(), &strain_rows[e]);
            let share = if e < self.membrane { own } else { 1.0 };
            for (ij, block) in element.iter().enumerate() {
                blocks[at + ij] = block + share * row[ij / k] * row[ij % k].transpose();
            }
            at += element.len();
            e += 1;
        });
        product.fill(0.0);
        square.fill(0.0);
        self.arch.dispatch(|| {
            let mut blocks = &blocks[..];
            for (vertices, k) in &self.elements {
                let (own, others) = blocks.split_at(k * k);
                blocks = others;
                match k {
                    2 => multiply::<2>(&self.rows, self.stride, vertices, own, product),
                    3 => multiply::<3>(&self.rows, self.stride, vertices, own, product),
                    _ => multiply::<4>(&self.rows, self.stride, vertices, own, product),
                }
            }
            square_up(&self.rows, product, self.stride, square);
            self.add_coupling(strain_rows, sum, coupling, square);
        });
        self.unpack(square, out);
        let m = self.correction.nrows();
        out.view_mut((0, 0), (m, m)).add_assign(&self.correction);
    }

    /// Bᵀ(Σ b bᵀ)B with the rows √(2w) ∇s at x̄ + Bq: the viscosity of [`crate::reference`].
    pub fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        self.place(q, scratch);
        self.measure(scratch);
        let Scratch { strain_rows, sum, square, coupling, .. } = scratch;
        square.fill(0.0);
        let own = self.own_share();
        self.arch.dispatch(|| {
            for (e, ((vertices, k), row)) in self.elements.iter().zip(&*strain_rows).enumerate() {
                let share = if e < self.membrane { own } else { 1.0 };
                add_square(&self.rows, self.stride, share, (vertices, &row[..*k]), sum, square);
            }
            self.add_coupling(strain_rows, sum, coupling, square);
        });
        self.unpack(square, out);
    }

    /// square += (1 − α) CᵀC, with C = ∂(Sᵀε)/∂q.
    #[inline(always)]
    fn add_coupling(&self, strain_rows: &[[Vec3; 4]], sum: &mut [f64], coupling: &mut [f64], square: &mut [f64]) {
        if self.n_stresses == 0 {
            return;
        }
        coupling.fill(0.0);
        for (e, ((vertices, k), row)) in self.elements[..self.membrane].iter().zip(strain_rows).enumerate() {
            project_row(&self.rows, self.stride, (vertices, &row[..*k]), sum);
            for (out, s) in coupling.chunks_exact_mut(self.stride).zip(self.stress_row(e)) {
                out.iter_mut().zip(&*sum).for_each(|(out, b)| *out += s * b);
            }
        }
        let root = (1.0 - self.own_share()).sqrt();
        coupling.iter_mut().for_each(|c| *c *= root);
        for rows in coupling.chunks_exact(WIDTH * self.stride) {
            add_products::<WIDTH>(rows, rows, self.stride, square);
        }
    }

    /// Both triangles from the lower one.
    fn unpack(&self, square: &[f64], out: &mut DMatrix<f64>) {
        for i in 0..self.n {
            for j in 0..=i {
                let value = square[i * self.stride + j];
                (out[(i, j)], out[(j, i)]) = (value, value);
            }
        }
    }

    /// Hands Bᵀb of each element's rest row b to `visit`, in order. Of an energy on all elements of the shell.
    pub fn visit_rest_rows(&self, shell: &Shell, mut visit: impl FnMut(usize, &[f64])) {
        let mut sum = vec![0.0; self.stride];
        let mut e = 0;
        shell.energy.visit_rest_rows(&mut |(_, row)| {
            sum.fill(0.0);
            for (&v, g) in self.elements[e].0.iter().zip(row) {
                project(
                    &self.rows[3 * v as usize * self.stride..][..3 * self.stride],
                    std::slice::from_ref(g),
                    &mut sum,
                );
            }
            visit(e, &sum[..self.n]);
            e += 1;
        });
    }

    /// Hands Bᵀ∇E of each element at x̄ + Bq and its strain to `visit`, in order.
    pub fn visit_forces(&self, q: &[f64], scratch: &mut Scratch, mut visit: impl FnMut(usize, &[f64], f64)) {
        self.place(q, scratch);
        self.measure(scratch);
        let Scratch { strain, strain_rows, stress, sum, .. } = scratch;
        for (e, ((vertices, k), row)) in self.elements.iter().zip(&*strain_rows).enumerate() {
            project_row(&self.rows, self.stride, (vertices, &row[..*k]), sum);
            sum.iter_mut().for_each(|sum| *sum *= stress[e]);
            visit(e, &sum[..self.n], strain[e]);
        }
    }

    /// σ of each element for strains that are given.
    pub fn stress_of(&self, strain: &[f64]) -> Vec<f64> {
        let (mut stress, mut resultants) = (vec![0.0; strain.len()], vec![0.0; self.n_stresses]);
        self.resist(strain, &mut stress, &mut resultants);
        stress
    }
}

use std::ops::AddAssign;

/// x = x̄ + Bq.
#[inline(always)]
fn place(rows: &[f64], rest: &[Vec3], q: &[f64], x: &mut [Vec3]) {
    let stride = q.len();
    for ((x, rest), rows) in x.iter_mut().zip(rest).zip(rows.chunks_exact(3 * stride)) {
        for c in 0..3 {
            let row = &rows[c * stride..(c + 1) * stride];
            let mut sums = [0.0; WIDTH];
            for (b, q) in row.chunks_exact(WIDTH).zip(q.chunks_exact(WIDTH)) {
                (0..WIDTH).for_each(|i| sums[i] += b[i] * q[i]);
            }
            x[c] = rest[c] + sums.iter().sum::<f64>();
        }
    }
}

/// sum += Bᵀg.
#[inline(always)]
fn project(rows: &[f64], g: &[Vec3], sum: &mut [f64]) {
    let stride = sum.len();
    for (g, rows) in g.iter().zip(rows.chunks_exact(3 * stride)) {
        let (x, yz) = rows.split_at(stride);
        let (y, z) = yz.split_at(stride);
        for k in 0..stride {
            sum[k] += x[k] * g[0] + y[k] * g[1] + z[k] * g[2];
        }
    }
}

/// product += HB for one element of K vertices.
#[inline(always)]
fn multiply<const K: usize>(rows: &[f64], stride: usize, vertices: &[u32; 4], blocks: &[Mat3], product: &mut [f64]) {
    let own: [&[f64]; K] = std::array::from_fn(|q| &rows[3 * vertices[q] as usize * stride..][..3 * stride]);
    for p in 0..K {
        let out = &mut product[3 * vertices[p] as usize * stride..][..3 * stride];
        let (x, yz) = out.split_at_mut(stride);
        let (y, z) = yz.split_at_mut(stride);
        for q in 0..K {
            let block = &blocks[K * p + q];
            let (bx, byz) = own[q].split_at(stride);
            let (by, bz) = byz.split_at(stride);
            for k in 0..stride {
                x[k] += block[(0, 0)] * bx[k] + block[(0, 1)] * by[k] + block[(0, 2)] * bz[k];
                y[k] += block[(1, 0)] * bx[k] + block[(1, 1)] * by[k] + block[(1, 2)] * bz[k];
                z[k] += block[(2, 0)] * bx[k] + block[(2, 1)] * by[k] + block[(2, 2)] * bz[k];
            }
        }
    }
}

/// The lower triangle of BᵀP, and some of what is above it.
#[inline(always)]
fn square_up(rows: &[f64], product: &[f64], stride: usize, square: &mut [f64]) {
    const DEPTH: usize = 6;
    let (mut b, mut p) = (rows, product);
    while b.len() >= DEPTH * stride {
        add_products::<DEPTH>(b, p, stride, square);
        (b, p) = (&b[DEPTH * stride..], &p[DEPTH * stride..]);
    }
    while b.len() >= 3 * stride {
        add_products::<3>(b, p, stride, square);
        (b, p) = (&b[3 * stride..], &p[3 * stride..]);
    }
}

/// square += Σ b pᵀ over N rows.
#[inline(always)]
fn add_products<const N: usize>(b: &[f64], p: &[f64], stride: usize, square: &mut [f64]) {
    let p: [&[f64]; N] = std::array::from_fn(|n| &p[n * stride..(n + 1) * stride]);
    for (i, out) in square.chunks_exact_mut(stride).enumerate() {
        let b: [f64; N] = std::array::from_fn(|n| b[n * stride + i]);
        let end = (i + 1).next_multiple_of(WIDTH);
        let p = p.map(|row| &row[..end]);
        let out = &mut out[..end];
        for j in 0..end {
            let mut sum = out[j];
            for n in 0..N {
                sum += b[n] * p[n][j];
            }
            out[j] = sum;
        }
    }
}

/// sum = Bᵀb for one element's row b.
#[inline(always)]
fn project_row(rows: &[f64], stride: usize, (vertices, row): (&[u32; 4], &[Vec3]), sum: &mut [f64]) {
    sum.fill(0.0);
    for (&v, g) in vertices.iter().zip(row) {
        project(&rows[3 * v as usize * stride..][..3 * stride], std::slice::from_ref(g), sum);
    }
}

/// square += share (Bᵀb)(Bᵀb)ᵀ, lower triangle, for one element's row b.
#[inline(always)]
fn add_square(
    rows: &[f64],
    stride: usize,
    share: f64,
    element: (&[u32; 4], &[Vec3]),
    sum: &mut [f64],
    square: &mut [f64],
) {
    project_row(rows, stride, element, sum);
    for (i, out) in square.chunks_exact_mut(stride).enumerate() {
        let scale = share * sum[i];
        out[..=i].iter_mut().zip(&*sum).for_each(|(out, s)| *out += scale * s);
    }
}

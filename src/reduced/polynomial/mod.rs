//! The shell's energy on a few fields as a polynomial of q, whose cost does not depend on the mesh:
//!
//!   E(q) = ½ Σ w_k φ(s_k) + ½ qᵀC₂q + ⅙ C₃(q, q, q),      s_k(q) = A_k·q + ½ qᵀQ_k q.
//!
//! A *form* s_k is a sum Σ p y over pairs of vertices of what their squared distances gained, y = l² − l̄²: exactly quadratic in q. The
//! membrane's stress fields and what poses leave beside them are such sums (`forms`). Bending is cubic where lengths hold
//! (Garg, Grinspun, Wardetzky, Zorin, *Cubic Shells*, 2007), and forms of weights of either sign correct it where they do not
//! (`hinges`). φ(s) = s²/(1 + s²/S²), bounded, where the weight is negative, else s².
//!
//! Every term keeps its value when all that it joins turns.

mod forms;
mod gate;
mod hinges;
mod kernel;
mod pairs;
mod saved;

pub use forms::{Sources, make};
pub use gate::{Errors, Gate};

use super::elastic::Scratch;
use super::products::WIDTH;
use crate::energy::Curvature;
use nalgebra::{DMatrix, SymmetricEigen};
use pulp::{Arch, Simd, WithSimd};

/// Of any coefficient: the root of the largest number.
const LARGEST: f64 = 1e154;

/// A form s and how it counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// w.
    pub weight: f64,
    /// 1/S²; 0 for φ(s) = s².
    pub bound: f64,
    /// A.
    pub linear: Vec<f64>,
    /// Q.
    pub quadratic: DMatrix<f64>,
}

/// What the energy is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// The membrane's forms, whose weights are positive, and then those that correct bending.
    pub forms: Vec<Form>,
    /// How many of the forms are the membrane's.
    pub membrane: usize,
    /// C₂.
    pub bending: DMatrix<f64>,
    /// Bending's rest Hessian Σ b bᵀ, which C₂ and the corrections come near to.
    pub stiffness: DMatrix<f64>,
    /// C₃, a symmetric matrix for each field.
    pub cubic: Vec<DMatrix<f64>>,
}

/// See the module's text.
pub struct PolynomialEnergy {
    n: usize,
    /// Numbers in a row of fields, and forms; multiples of [`WIDTH`].
    stride: usize,
    forms: usize,
    membrane: usize,
    /// w and 1/S² of each form.
    weights: Vec<f64>,
    bounds: Vec<f64>,
    /// A, of 8 forms side by side the fields.
    linear: Vec<f64>,
    /// Q, lower triangles, 8 forms side by side: all that is needed of them for s and its gradient.
    lanes: Vec<f64>,
    /// Q again, packed ([`kernel`]), for sums over forms. And likewise C₃, C₂ and bending's rest Hessian.
    quadratic: Vec<f64>,
    cubic: Vec<f64>,
    bending: Vec<f64>,
    stiffness: Vec<f64>,
    /// Above both C₂ and bending's rest Hessian, as symmetric matrices are.
    convex: Vec<f64>,
    /// How near it is to the shell, as far as that was tried.
    pub gate: Gate,
    /// The registers that it is evaluated in.
    pub arch: Arch,
}

/// Room, so that evaluation does not allocate, and what is known of the last q.
#[derive(Clone)]
pub struct Room {
    /// q, padded; no numbers before the first. And how many there were.
    q: Vec<f64>,
    shapes: usize,
    /// Of it: E, its gradient, s, dE/ds and d²E/ds², ∂s/∂q by field, and C₂ + C₃q.
    value: f64,
    gradient: Vec<f64>,
    s: Vec<f64>,
    stress: Vec<f64>,
    curvature: Vec<f64>,
    jacobian: Vec<f64>,
    bending: Vec<f64>,
    /// C₂q and (C₂ + C₃q)q; ∂s/∂q by form, and with each row's factor; the Hessian.
    bent: [Vec<f64>; 2],
    rows: [Vec<f64>; 2],
    packed: Vec<f64>,
}

impl Room {
    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        std::mem::take(&mut self.shapes)
    }
}

impl PolynomialEnergy {
    /// From its coefficients.
    pub fn new(coefficients: &Coefficients) -> Self {
        let Coefficients { forms: list, membrane, bending, stiffness, cubic } = coefficients;
        let n = bending.nrows();
        let (stride, forms) = (n.next_multiple_of(WIDTH), list.len().next_multiple_of(WIDTH));
        let size = kernel::start(n, stride);
        let pack = |matrix: &DMatrix<f64>, out: &mut [f64]| {
            for i in 0..n {
                (i..n).for_each(|j| out[kernel::at(i, j, stride)] = 0.5 * (matrix[(i, j)] + matrix[(j, i)]));
            }
        };
        let packed = |matrices: &mut dyn Iterator<Item = &DMatrix<f64>>, count: usize| {
            let mut out = vec![0.0; count * size];
            out.chunks_exact_mut(size.max(1)).zip(matrices).for_each(|(out, matrix)| pack(matrix, out));
            out
        };
        let triangle = n * (n + 1) / 2;
        let (mut linear, mut lanes) = (vec![0.0; n * forms], vec![0.0; triangle * forms]);
        let (mut weights, mut bounds) = (vec![0.0; forms], vec![0.0; forms]);
        for (k, form) in list.iter().enumerate() {
            (weights[k], bounds[k]) = (form.weight, form.bound);
            for i in 0..n {
                linear[beside(k, i, n)] = form.linear[i];
                for j in 0..=i {
                    let entry = k / WIDTH * triangle + i * (i + 1) / 2 + j;
                    lanes[entry * WIDTH + k % WIDTH] = 0.5 * (form.quadratic[(i, j)] + form.quadratic[(j, i)]);
                }
            }
        }
        Self {
            n,
            stride,
            forms,
            membrane: *membrane,
            weights,
            bounds,
            linear,
            lanes,
            quadratic: packed(&mut list.iter().map(|form| &form.quadratic), forms),
            cubic: packed(&mut cubic.iter(), n),
            bending: packed(&mut [bending].into_iter(), 1),
            stiffness: packed(&mut [stiffness].into_iter(), 1),
            convex: packed(&mut [&above(stiffness, bending)].into_iter(), 1),
            gate: Gate::default(),
            arch: Arch::new(),
        }
    }

    /// What it was made of.
    pub fn coefficients(&self) -> Coefficients {
        let Self { n, stride, .. } = *self;
        let size = kernel::start(n, stride).max(1);
        let matrix = |packed: &[f64]| DMatrix::from_fn(n, n, |i, j| packed[kernel::at(i.min(j), i.max(j), stride)]);
        let form = |(k, packed): (usize, &[f64])| Form {
            weight: self.weights[k],
            bound: self.bounds[k],
            linear: (0..n).map(|i| self.linear[beside(k, i, n)]).collect(),
            quadratic: matrix(packed),
        };
        Coefficients {
            forms: self.quadratic.chunks_exact(size).take(self.n_saved()).enumerate().map(form).collect(),
            membrane: self.membrane,
            bending: matrix(&self.bending),
            stiffness: matrix(&self.stiffness),
            cubic: self.cubic.chunks_exact(size).map(matrix).collect(),
        }
    }

    /// Coordinates.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Forms, and zeros up to a multiple of the widest register's numbers.
    pub fn n_forms(&self) -> usize {
        self.forms
    }

    /// Whether all of it are numbers whose squares are.
    pub fn is_finite(&self) -> bool {
        let lists = [&self.weights, &self.bounds, &self.linear, &self.quadratic, &self.cubic, &self.bending];
        let Gate { polynomial, sampled, reach, strain, .. } = self.gate;
        let told = [polynomial.median, polynomial.most, sampled.median, sampled.most, reach, strain];
        lists.into_iter().flatten().chain(&self.stiffness).chain(&told).all(|x| x.abs() <= LARGEST)
    }

    /// Forms up to the last that counts.
    fn n_saved(&self) -> usize {
        self.weights.iter().rposition(|w| *w != 0.0).map_or(0, |last| last + 1)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let forms =
            self.weights.len() + self.bounds.len() + self.linear.len() + self.lanes.len() + self.quadratic.len();
        8 * (forms + self.cubic.len() + 3 * self.bending.len())
    }

    /// Multiplications of a shape with its gradient, and of a Hessian beside.
    pub fn operations(&self) -> [f64; 2] {
        let [lanes, cubic, quadratic] = [&self.lanes, &self.cubic, &self.quadratic].map(|list| list.len() as f64);
        [2.0 * lanes + cubic, 2.0 * quadratic]
    }

    /// Room for one evaluation at a time.
    pub fn scratch(&self) -> Scratch {
        let (fields, forms) = (vec![0.0; self.stride], vec![0.0; self.forms]);
        Scratch::Polynomial(Room {
            q: (0..self.stride).map(|k| if k < self.n { f64::NAN } else { 0.0 }).collect(),
            shapes: 0,
            value: 0.0,
            gradient: fields.clone(),
            s: forms.clone(),
            stress: forms.clone(),
            curvature: forms,
            jacobian: vec![0.0; self.n * self.forms],
            bending: vec![0.0; self.bending.len()],
            bent: [fields.clone(), fields],
            rows: [vec![0.0; self.forms * self.stride], vec![0.0; self.forms * self.stride]],
            packed: vec![0.0; self.bending.len()],
        })
    }

    /// Everything that the room knows of a q.
    fn place(&self, q: &[f64], room: &mut Room) {
        if room.q[..self.n] == *q {
            return;
        }
        room.q[..self.n].copy_from_slice(q);
        room.shapes += 1;
        self.arch.dispatch(Place { energy: self, room });
    }

    /// E(q).
    pub fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.polynomial();
        self.place(q, room);
        room.value
    }

    /// ∂E/∂q.
    pub fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let room = scratch.polynomial();
        self.place(q, room);
        out.copy_from_slice(&room.gradient[..self.n]);
    }

    /// ∂²E/∂q² (n × n, both triangles). The semidefinite one is Σ w ∇s∇sᵀ over the membrane's forms and what is above both C₂ and
    /// bending's rest Hessian.
    pub fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        if curvature == Curvature::Semidefinite {
            return self.resist(q, &self.convex, scratch, out);
        }
        let room = scratch.polynomial();
        self.place(q, room);
        self.arch.dispatch(Hessian { energy: self, room });
        self.unpack(&room.packed, out);
    }

    /// Σ w ∇s∇sᵀ over the membrane's forms at q, and bending's rest Hessian: what resists the rates of strains and of angles. A shell that
    /// is flat at rest meets no resistance where it turns.
    pub fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        self.resist(q, &self.stiffness, scratch, out);
    }

    fn resist(&self, q: &[f64], bending: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let room = scratch.polynomial();
        self.place(q, room);
        self.arch.dispatch(Resistance { energy: self, bending, room });
        self.unpack(&room.packed, out);
    }

    /// Energy of the membrane's forms at `q`.
    pub fn membrane(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.polynomial();
        self.place(q, room);
        (0..self.membrane).map(|k| resist(self.weights[k], self.bounds[k], room.s[k])[0]).sum()
    }

    fn unpack(&self, packed: &[f64], out: &mut DMatrix<f64>) {
        for j in 0..self.n {
            let row = &packed[kernel::at(j, j, self.stride)..];
            for i in j..self.n {
                (out[(i, j)], out[(j, i)]) = (row[i - j], row[i - j]);
            }
        }
    }
}

/// A + (B − A)⁺: above both.
fn above(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let gap = b - a;
    if !gap.iter().all(|x| x.is_finite()) {
        return gap; // no search for eigenvalues among what is no number
    }
    let gap = SymmetricEigen::new(gap);
    let raised = DMatrix::from_diagonal(&gap.eigenvalues.map(|x| x.max(0.0)));
    a + &gap.eigenvectors * raised * gap.eigenvectors.transpose()
}

/// Where field `i` of form `k` is in A and J.
#[inline(always)]
fn beside(k: usize, i: usize, n: usize) -> usize {
    (k / WIDTH * n + i) * WIDTH + k % WIDTH
}

/// φ-weighted: E, dE/ds and d²E/ds² of ½ w φ(s), with 1/S² given.
#[inline(always)]
fn resist(weight: f64, bound: f64, s: f64) -> [f64; 3] {
    let ratio = bound * s * s;
    let share = 1.0 / (1.0 + ratio);
    let force = weight * s * share;
    [0.5 * s * force, force * share, weight * (1.0 - 3.0 * ratio) * share * share * share]
}

struct Place<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { q, value, gradient, s, stress, curvature, jacobian, bending, bent: [rest, here], .. } = room;
        let n = energy.n;
        kernel::strains(simd, &q[..n], &energy.lanes, &energy.linear, jacobian, s);
        *value = 0.0;
        for k in 0..energy.forms {
            let of = resist(energy.weights[k], energy.bounds[k], s[k]);
            *value += of[0];
            (stress[k], curvature[k]) = (of[1], of[2]);
        }
        bending.copy_from_slice(&energy.bending);
        kernel::combine(simd, &energy.cubic, &q[..n], bending);
        // ½ qᵀC₂q + ⅙ C₃(q, q, q) and its gradient, from C₂q and (C₂ + C₃q)q.
        *value += kernel::multiply(simd, &energy.bending, n, q, rest) / 3.0;
        *value += kernel::multiply(simd, bending, n, q, here) / 6.0;
        (0..n).for_each(|i| gradient[i] = 0.5 * (rest[i] + here[i]));
        kernel::add_transposed(simd, jacobian, stress, n, gradient);
    }
}

/// The rows of `count` forms, and these with their factors, from those by field.
#[inline(always)]
fn set_rows(energy: &PolynomialEnergy, jacobian: &[f64], factors: &[f64], [plain, scaled]: &mut [Vec<f64>; 2]) {
    let (n, stride) = (energy.n, energy.stride);
    let blocks = jacobian.chunks_exact((n * WIDTH).max(1)).zip(factors.chunks(WIDTH));
    let outs = plain.chunks_exact_mut(WIDTH * stride).zip(scaled.chunks_exact_mut(WIDTH * stride));
    for ((block, factors), (plain, scaled)) in blocks.zip(outs) {
        for (i, fields) in block.as_chunks::<WIDTH>().0.iter().enumerate() {
            for (k, factor) in factors.iter().enumerate() {
                plain[k * stride + i] = fields[k];
                scaled[k * stride + i] = factor * fields[k];
            }
        }
    }
}

struct Hessian<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Hessian<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { stress, curvature, jacobian, bending, rows, packed, .. } = room;
        packed.copy_from_slice(bending);
        kernel::combine(simd, &energy.quadratic, stress, packed);
        set_rows(energy, jacobian, curvature, rows);
        kernel::add_products(simd, &rows[1], &rows[0], (energy.n, energy.stride), packed);
    }
}

struct Resistance<'a> {
    energy: &'a PolynomialEnergy,
    bending: &'a [f64],
    room: &'a mut Room,
}

impl WithSimd for Resistance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, bending, room } = self;
        let Room { jacobian, rows, packed, .. } = room;
        packed.copy_from_slice(bending);
        let count = energy.membrane;
        set_rows(energy, jacobian, &energy.weights[..count], rows);
        let [plain, scaled] = [&rows[0], &rows[1]].map(|rows| &rows[..count * energy.stride]);
        kernel::add_products(simd, scaled, plain, (energy.n, energy.stride), packed);
    }
}

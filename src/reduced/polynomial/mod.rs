//! The shell's energy on a few fields as a polynomial of q, whose cost does not depend on the mesh:
//!
//!   E(q) = ½ Σ w_k φ(s_k) + ½ qᵀC₂q + ⅙ C₃(q, q, q),      s_k(q) = A_k·q + ½ qᵀQ_k q.
//!
//! A *form* s_k is a sum Σ p y over pairs of vertices of what their squared distances gained, y = l² − l̄²: exactly quadratic in q. The
//! membrane's stress fields and what poses leave beside them are such sums (`forms`). Bending is cubic where lengths hold
//! (Garg, Grinspun, Wardetzky, Zorin, *Cubic Shells*, 2007), and forms of weights of either sign correct it where they do not
//! (`bends`). φ(s) = s²/(1 + s²/S²), bounded, where the weight is negative, else s². Where the membrane carries the loads, the first forms
//! count by their engineering strains ŝ(s) in place of s (`engineering`), and the energy is no polynomial any more.
//!
//! Every term keeps its value when all that it joins turns.

mod bends;
mod corrections;
mod engineering;
mod evaluate;
mod forms;
mod gate;
mod kernel;
mod near;
mod pairs;
mod saved;

pub use engineering::{Engineering, LEADING};
pub use evaluate::Room;
pub use forms::{Sources, make};
pub use gate::{Errors, Gate, UNSEEN};

use super::aligned::Aligned;
use super::elastic::Scratch;
use super::factor::{Factor, SIDE, row};
use super::products::WIDTH;
use crate::arithmetic::Arithmetic;
use crate::energy::Curvature;
use nalgebra::{DMatrix, SymmetricEigen};
use pulp::Arch;

/// Of any coefficient: the root of the largest number.
const LARGEST: f64 = 1e154;
/// α from which the membrane carries loads.
const CARRYING: f64 = 0.05;

/// [`Gate::unseen`] by the weights of the membrane's forms, 1 or α.
fn unseen(mut weights: impl Iterator<Item = f64>) -> f64 {
    let carries = |weight: f64| (CARRYING..1.0).contains(&weight);
    if weights.any(carries) { 0.0 } else { UNSEEN }
}

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
    /// How the first forms count, if not by s.
    pub engineering: Option<Engineering>,
}

/// See the module's text. Q and C₃ are rounded to 32 bits once: both copies of Q and all of C₃ are of one polynomial, whose value, gradient and
/// Hessian these are.
pub struct PolynomialEnergy {
    n: usize,
    /// Numbers in a row of fields, a multiple of [`WIDTH`]; forms, and those with the ones that fill [`SIDE`]; fields of forms.
    stride: usize,
    count: usize,
    forms: usize,
    padded: usize,
    membrane: usize,
    /// w and 1/S² of each form.
    weights: Aligned<f64>,
    bounds: Aligned<f64>,
    /// A, of [`SIDE`] forms side by side the fields.
    linear: Aligned<f64>,
    /// Q, lower triangles, as many forms side by side ([`kernel::entry`]): all that is needed of them for s and its gradient.
    lanes: Aligned<f32>,
    /// Q again, and C₃, in tiles ([`kernel::tiled`]) for sums of an even number of matrices.
    quadratic: Aligned<f32>,
    cubic: Aligned<f32>,
    /// C₂ and bending's rest Hessian ([`kernel::at`]).
    bending: Aligned<f64>,
    stiffness: Aligned<f64>,
    /// Above both C₂ and bending's rest Hessian, as symmetric matrices are.
    convex: Aligned<f64>,
    engineering: Option<Box<Engineering>>,
    narrow: Narrow,
    /// How near it is to the shell, as far as that was tried.
    pub gate: Gate,
    /// The registers that it is evaluated in.
    pub arch: Arch,
}

/// What Hessians of 32 bits are made of beside.
struct Narrow {
    /// Numbers in a row of fields, and the place of the first ([`row`]).
    stride: usize,
    first: usize,
    /// A by rows of a form, in 64 bits as well, and Q of the forms that are not side by side ([`near::beside`]).
    linear: Aligned<f32>,
    straight: Aligned<f64>,
    squares: Aligned<f32>,
    /// C₂, and by rows of [`PolynomialEnergy::stride`] numbers.
    bending: Aligned<f32>,
    square: Aligned<f64>,
    /// Q once more, in 16 bits, two forms at a time ([`kernel::paired`]): they are half as long on the way here.
    quadratic: Aligned<u32>,
}

impl Narrow {
    fn of(list: &[Form], bending: &DMatrix<f64>) -> Self {
        let n = bending.nrows();
        let ((stride, first), padded) = (row(n), n.next_multiple_of(kernel::ROWS));
        let mean = |matrix: &DMatrix<f64>, i: usize, j: usize| 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
        let mut straight = vec![0.0; list.len() * stride];
        for (row, form) in straight.chunks_exact_mut(stride).zip(list) {
            row[first..first + n].copy_from_slice(&form.linear);
        }
        let last = &list[near::beside(list.len())..];
        let mut squares = vec![0.0; last.len() * padded * stride];
        for (rows, form) in squares.chunks_exact_mut((padded * stride).max(1)).zip(last) {
            (0..n * n).for_each(|e| rows[e / n * stride + first + e % n] = mean(&form.quadratic, e / n, e % n) as f32);
        }
        let wide = n.next_multiple_of(WIDTH);
        let mut square = vec![0.0; n * wide];
        (0..n * n).for_each(|e| square[e / n * wide + e % n] = mean(bending, e / n, e % n));
        let (pairs, none) = (even(list.len()) / 2, DMatrix::zeros(n, n));
        let mut quadratic = vec![0; pairs * kernel::size(n)];
        for k in 0..pairs {
            let [one, other] = [2 * k, 2 * k + 1].map(|k| list.get(k).map_or(&none, |form| &form.quadratic));
            for (i, j) in entries(n) {
                let [a, b] = [one, other].map(|q| mean(q, i, j) as f32);
                quadratic[kernel::tiled(k, kernel::at(i, j, n), pairs)] = kernel::paired(a, b);
            }
        }
        let linear = straight.iter().map(|x| *x as f32).collect::<Vec<f32>>();
        let bending = blocks_of(bending).iter().map(|x| *x as f32).collect::<Vec<f32>>();
        let [linear, squares, bending] = [linear, squares, bending].map(Aligned::from);
        let [straight, square] = [straight, square].map(Aligned::from);
        Self { stride, first, linear, straight, squares, bending, square, quadratic: quadratic.into() }
    }
}

impl PolynomialEnergy {
    /// From its coefficients.
    pub fn new(coefficients: &Coefficients) -> Self {
        let Coefficients { forms: list, membrane, bending, stiffness, cubic, engineering } = coefficients;
        let n = bending.nrows();
        let (stride, forms) = (n.next_multiple_of(WIDTH), list.len().max(1).next_multiple_of(SIDE));
        let padded = n.next_multiple_of(kernel::ROWS);
        let mean = |matrix: &DMatrix<f64>, i: usize, j: usize| 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
        let triangle = padded * (padded + 1) / 2;
        let (mut linear, mut lanes) = (vec![0.0; padded * forms], vec![0.0; triangle * forms]);
        let (mut weights, mut bounds) = (vec![0.0; forms], vec![0.0; forms]);
        for (k, form) in list.iter().enumerate() {
            (weights[k], bounds[k]) = (form.weight, form.bound);
            for i in 0..n {
                linear[beside(k, i, padded)] = form.linear[i];
                (0..=i)
                    .for_each(|j| lanes[beside(k, kernel::entry(i, j), triangle)] = mean(&form.quadratic, i, j) as f32);
            }
        }
        Self {
            n,
            stride,
            count: list.len(),
            forms,
            padded,
            membrane: *membrane,
            weights: weights.into(),
            bounds: bounds.into(),
            linear: linear.into(),
            lanes: lanes.into(),
            quadratic: tiles(n, list.len(), |k, i, j| mean(&list[k].quadratic, i, j)).into(),
            cubic: tiles(n, n, |k, i, j| cubic[j.max(k)][if k > j { (j, i) } else { (i.max(k), i.min(k)) }]).into(),
            bending: blocks_of(bending).into(),
            stiffness: blocks_of(stiffness).into(),
            convex: blocks_of(&above(stiffness, bending)).into(),
            engineering: engineering.clone().map(Box::new),
            narrow: Narrow::of(list, bending),
            gate: Gate::default(),
            arch: Arithmetic::default().arch(),
        }
    }

    /// The same, computed with by `arithmetic`.
    pub fn with_arithmetic(&self, arithmetic: Arithmetic) -> Self {
        Self { arch: arithmetic.arch(), gate: self.gate, ..Self::new(&self.coefficients()) }
    }

    /// What it was made of.
    pub fn coefficients(&self) -> Coefficients {
        let n = self.n;
        let matrix = |entry: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(n, n, |i, j| entry(i.min(j), i.max(j)));
        let tiled = |tiles: &[f32], k: usize, count: usize| {
            let count = even(count);
            matrix(&|i, j| f64::from(tiles[kernel::tiled(k, kernel::at(i, j, n), count)]))
        };
        let form = |k: usize| Form {
            weight: self.weights[k],
            bound: self.bounds[k],
            linear: (0..n).map(|i| self.linear[beside(k, i, self.padded)]).collect(),
            quadratic: tiled(&self.quadratic, k, self.count),
        };
        Coefficients {
            forms: (0..self.n_saved()).map(form).collect(),
            membrane: self.membrane,
            bending: matrix(&|i, j| self.bending[kernel::at(i, j, n)]),
            stiffness: matrix(&|i, j| self.stiffness[kernel::at(i, j, n)]),
            cubic: (0..n).map(|k| tiled(&self.cubic, k, n)).collect(),
            engineering: self.engineering.as_deref().cloned(),
        }
    }

    /// What its gate counts as unseen.
    pub fn unseen(&self) -> f64 {
        unseen(self.weights[..self.membrane].iter().copied())
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
        let lists = [&self.weights, &self.bounds, &self.linear, &self.bending, &self.stiffness];
        let Gate { polynomial, sampled, reach, strain, range, .. } = self.gate;
        let told = [polynomial.median, polynomial.most, sampled.median, sampled.most, reach, strain, range];
        let bent = self.engineering.iter().flat_map(|engineering| engineering.0.iter().flatten());
        lists.into_iter().flatten().chain(&told).chain(bent).all(|x| x.abs() <= LARGEST)
            && self.quadratic.iter().chain(&self.cubic).all(|x| x.is_finite())
    }

    /// Forms up to the last that counts.
    fn n_saved(&self) -> usize {
        self.weights.iter().rposition(|w| *w != 0.0).map_or(0, |last| last + 1)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let Narrow { linear, straight, squares, bending, square, quadratic, .. } = &self.narrow;
        let lists = [&self.lanes, &self.quadratic, &self.cubic, linear, squares, bending];
        let narrow = quadratic.len() + lists.iter().map(|list| list.len()).sum::<usize>();
        let wide = [&self.weights, &self.bounds, &self.linear, &self.bending, &self.stiffness, &self.convex];
        4 * narrow + 8 * wide.iter().chain(&[straight, square]).map(|list| list.len()).sum::<usize>()
    }

    /// Multiplications of a shape with its gradient, and of a Hessian beside.
    pub fn operations(&self) -> [f64; 2] {
        let [lanes, cubic, quadratic] = [&self.lanes, &self.cubic, &self.quadratic].map(|list| list.len() as f64);
        [2.0 * lanes + cubic, 2.0 * quadratic]
    }

    /// Room for one evaluation at a time.
    pub fn scratch(&self) -> Scratch {
        Scratch::Polynomial(Box::new(Room::of(self)))
    }

    /// E(q).
    pub fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.polynomial();
        room.place(self, q, false);
        room.value(self)
    }

    /// ∂E/∂q.
    pub fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let room = scratch.polynomial();
        room.place(self, q, false);
        out.copy_from_slice(room.gradient(self.n));
    }

    /// E by sums of 32 bits, or better: which of two places is the lower one.
    pub fn near_value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.polynomial();
        room.place(self, q, true);
        room.value(self)
    }

    /// ∂E/∂q alike: a Newton step to where more than their rounding is left.
    pub fn near_gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let room = scratch.polynomial();
        room.place(self, q, true);
        out.copy_from_slice(room.gradient(self.n));
    }

    /// ∂²E/∂q² by sums of 32 bits, as a matrix to be factorized.
    pub fn near_hessian(&self, q: &[f64], scratch: &mut Scratch, out: &mut Factor) {
        let room = scratch.polynomial();
        room.place(self, q, true);
        room.near_hessian(self, out.rows());
    }

    /// ∂²E/∂q² (n × n, both triangles). The semidefinite one is Σ w ∇s∇sᵀ over the membrane's forms and what is above both C₂ and
    /// bending's rest Hessian.
    pub fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        self.lower_hessian(q, curvature, scratch, out);
        mirror(out);
    }

    /// The lower triangle of the same.
    pub fn lower_hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let room = scratch.polynomial();
        room.place(self, q, false);
        let square = match curvature {
            Curvature::Exact => room.hessian(self),
            Curvature::Semidefinite => room.resistance(self, &self.convex),
        };
        self.unpack(square, out);
    }

    /// Σ w ∇s∇sᵀ over the membrane's forms at q, and bending's rest Hessian: what resists the rates of strains and of angles. A shell that
    /// is flat at rest meets no resistance where it turns.
    pub fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let room = scratch.polynomial();
        room.place(self, q, false);
        self.unpack(room.resistance(self, &self.stiffness), out);
        mirror(out);
    }

    /// Energy of the membrane's forms at `q`.
    pub fn membrane(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.polynomial();
        room.place(self, q, false);
        room.resisted(self, self.membrane)
    }

    /// The lower triangle from a square.
    fn unpack(&self, square: &[f64], out: &mut DMatrix<f64>) {
        let n = self.n;
        for (i, row) in square.chunks_exact(self.stride).enumerate().take(n) {
            out.column_mut(i).as_mut_slice()[i..].copy_from_slice(&row[i..n]);
        }
    }
}

/// The upper triangle from the lower one.
fn mirror(out: &mut DMatrix<f64>) {
    for i in 0..out.nrows() {
        (0..i).for_each(|j| out[(j, i)] = out[(i, j)]);
    }
}

/// A + (B − A)⁺: above both. By plain sums, whose bits are the same on every processor.
fn above(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let gap = b - a;
    if !gap.iter().all(|x| x.is_finite()) {
        return gap; // no search for eigenvalues among what is no number
    }
    let gap = SymmetricEigen::new(gap);
    let mut sum = a.clone();
    for (value, vector) in gap.eigenvalues.iter().zip(gap.eigenvectors.column_iter()).filter(|(value, _)| **value > 0.0)
    {
        sum.ger(*value, &vector, &vector, 1.0);
    }
    sum
}

/// The tiles of symmetric matrices k with the entries (i, j), i ≤ j, in 32 bits, and of zeros where they are not [`even`].
fn tiles(n: usize, matrices: usize, of: impl Fn(usize, usize, usize) -> f64) -> Vec<f32> {
    let count = even(matrices);
    let mut out = vec![0.0; count * kernel::size(n)];
    for k in 0..matrices {
        entries(n)
            .for_each(|(i, j)| out[kernel::tiled(k, kernel::at(i, j, n), count)] = of(k, i.min(j), i.max(j)) as f32);
    }
    out
}

/// How many matrices there are tiles of: an even number, and some.
fn even(count: usize) -> usize {
    count.max(1).next_multiple_of(2)
}

/// Entries of the blocks of a symmetric matrix.
fn entries(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |i| (i / kernel::ROWS * kernel::ROWS..n).map(move |j| (i, j)))
}

/// The blocks of a symmetric matrix.
fn blocks_of(matrix: &DMatrix<f64>) -> Vec<f64> {
    let n = matrix.nrows();
    let mut out = vec![0.0; kernel::size(n)];
    entries(n).for_each(|(i, j)| out[kernel::at(i, j, n)] = 0.5 * (matrix[(i, j)] + matrix[(j, i)]));
    out
}

/// Where entry `i` of form `k` is where forms are side by side, of so many entries each.
#[inline(always)]
fn beside(k: usize, i: usize, entries: usize) -> usize {
    (k / SIDE * entries + i) * SIDE + k % SIDE
}

//! Bending as a cubic. The strains of a triangle, or of a single hinge, are Σ r (θ − θ̄) over its edges; with G = Σ rrᵀ,
//!
//!   ½ Σ G_kl (θ_k − θ̄_k)(θ_l − θ̄_l).
//!
//! An edge is e = b − a of length L, with p = c − a and s = d − a. At rest c and d have the heights h, h′ and the feet t, t′ on it. Where lengths
//! hold,
//!
//!   c = ((t − 1)/h + (t′ − 1)/h′) x_a − (t/h + t′/h′) x_b + x_c/h + x_d/h′,   |c|² = 2 − 2 cos θ,   sin θ = −det(e, p, s)/(L h h′)
//!
//! Of two edges of a triangle, with γ the cosine between its heights on them,
//!
//!   c_k·c_l = sin θ_k sin θ_l + γ (1 − cos θ_k)(1 − cos θ_l).
//!
//! So what follows is cubic in the positions, and near isometries the above up to third order in θ − θ̄:
//!
//!   k = l:   ½ G (2 − 2 cos(θ − θ̄)) = ½ G (2 − 2 cos θ̄ + cos θ̄ |c|² − 2 sin θ̄ sin θ)
//!   k ≠ l:   W [c_k·c_l − ½γ ((1 − cos θ̄_l)|c_k|² + (1 − cos θ̄_k)|c_l|²) − sin θ̄_k sin θ_l − sin θ̄_l sin θ_k + …],
//!            W = G/(cos θ̄_k cos θ̄_l + γ sin θ̄_k sin θ̄_l)
//!
//! What its gradient is at rest, Σ μ ∇y over pairs of corners that edges join, is taken off as Σ μ y, which keeps it invariant where a
//! constant would not. Its Hessian H at rest misses that of the angles, Σ bbᵀ; ½ yᵀDy with D = N⁺ (Σ bbᵀ − H) N⁺ᵀ makes up for it, where
//! the columns of N are ∇y of the edges, and of the diagonal c–d where an edge is folded.

use super::pairs::{Rows, symmetric};
use crate::energy::{Fold, angle_gradient, dihedral_angle};
use crate::mesh::NONE;
use crate::{Mesh, Vec3};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Rest angle, rad, from which the diagonal counts; below, its ∇y is nearly that of the edges.
const FOLDED: f64 = 0.2;
/// Least divisor of W: two edges that are folded further do not act on each other.
const TOGETHER: f64 = 0.5;
/// What bends, at once, whose products are summed.
const CHUNK: usize = 64;
/// Of the norm of N, below which a singular value is rounding.
const RANK: f64 = 1e-10;

/// Pairs of vertices by number: the mesh's edges, and others as they are asked for.
pub struct Pairs {
    /// All of them.
    pub list: Vec<[u32; 2]>,
    numbers: HashMap<[u32; 2], usize>,
}

impl Pairs {
    /// The mesh's edges.
    pub fn new(mesh: &Mesh) -> Self {
        let list: Vec<[u32; 2]> = mesh.edges.iter().map(|e| e.vertices).collect();
        let numbers = list.iter().enumerate().map(|(k, pair)| (sorted(*pair), k)).collect();
        Self { list, numbers }
    }

    /// Of a pair.
    pub fn number(&mut self, pair: [u32; 2]) -> usize {
        *self.numbers.entry(sorted(pair)).or_insert_with(|| {
            self.list.push(pair);
            self.list.len() - 1
        })
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A hinge, or a triangle with what is beyond its edges, and what its energy is made of. Matrices are by corner, three rows each, and by pair.
pub struct Bend {
    /// [`NONE`] for one that stays.
    vertices: Vec<u32>,
    /// Numbers of its pairs; none of those with a corner that stays, which gain nothing.
    pub pairs: Vec<Option<usize>>,
    /// b of each strain.
    rows: Vec<DVector<f64>>,
    /// H.
    hessian: DMatrix<f64>,
    /// By edge, its corners among the vertices and what det(e, p, s) counts.
    turning: Vec<([usize; 4], f64)>,
    /// D; may hold what is no number.
    pub correction: DMatrix<f64>,
}

/// One edge of it.
struct Side {
    /// Which of the corners.
    places: [usize; 4],
    x: [Vec3; 4],
    /// The factors of x in c.
    across: [f64; 4],
    /// c.
    arm: Vec3,
    /// Along the triangle's height on it.
    height: Vec3,
    /// L h h′.
    volume: f64,
    sine: f64,
    cosine: f64,
    angle: f64,
}

impl Side {
    fn new(places: [usize; 4], x: [Vec3; 4]) -> Self {
        let [a, b, c, d] = x;
        let (e, p, s) = (b - a, c - a, d - a);
        let length = e.norm();
        let [h, k] = [e.cross(&p).norm(), s.cross(&e).norm()].map(|double| double / length);
        let [t, r] = [p, s].map(|of| of.dot(&e) / (length * length));
        let across = [-(1.0 - t) / h - (1.0 - r) / k, -t / h - r / k, 1.0 / h, 1.0 / k];
        let angle = dihedral_angle(&x);
        let (sine, cosine) = libm::sincos(angle);
        let arm = across.iter().zip(&x).map(|(k, x)| *k * x).sum();
        Self { places, x, across, arm, height: (p - t * e) / h, volume: length * h * k, sine, cosine, angle }
    }
}

impl Bend {
    /// Of edges of one triangle and rows of its strains, the first numbers of which are theirs.
    pub fn new(folds: &[Fold], strains: &[[f64; 3]], pairs: &mut Pairs) -> Self {
        let (mut vertices, mut x): (Vec<u32>, Vec<Vec3>) = (vec![], vec![]);
        let mut place = |v: u32, at: Vec3| {
            let known = vertices.iter().position(|other| v != NONE && *other == v);
            known.unwrap_or_else(|| {
                vertices.push(v);
                x.push(at);
                x.len() - 1
            })
        };
        let mut side = |fold: &Fold| {
            let places = std::array::from_fn(|i| place(fold.vertices[i], fold.corners[i]));
            Side::new(places, fold.corners)
        };
        let sides: Vec<Side> = folds.iter().map(&mut side).collect();
        let ends = ends(&sides);
        let number = |[i, j]: &[usize; 2]| {
            let pair = [vertices[*i], vertices[*j]];
            pair.iter().all(|v| *v != NONE).then(|| pairs.number(pair))
        };
        let numbers = ends.iter().map(number).collect();
        let rows: Vec<DVector<f64>> = strains.iter().map(|row| slope(&sides, row, 3 * x.len())).collect();
        let (arms, turns) = weights(&sides, strains);
        let (gradient, mut hessian) = derivatives(&sides, &arms, &turns, 3 * x.len());
        let normals = normals(&x, &ends);
        let normals_norm = normals.norm();
        let told = normals.norm_squared().is_finite(); // a search for singular values needs numbers
        let none = || DMatrix::zeros(ends.len(), 3 * x.len());
        let inverse =
            if told { normals.pseudo_inverse(RANK * normals_norm).unwrap_or_else(|_| none()) } else { none() };
        let forces = &inverse * gradient;
        for (force, [i, j]) in forces.iter().zip(&ends) {
            for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                (0..3).for_each(|c| hessian[(3 * row + c, 3 * column + c)] -= 2.0 * sign * force);
            }
        }
        let mut missing = -&hessian;
        rows.iter().for_each(|row| missing.ger(1.0, row, row, 1.0));
        let correction = &inverse * missing * inverse.transpose();
        let correction = 0.5 * (&correction + correction.transpose());
        let turning = sides.iter().zip(turns).map(|(side, turn)| (side.places, turn)).collect();
        Self { vertices, pairs: numbers, rows, hessian, turning, correction }
    }
}

/// The corners that pairs join: those of edges, and of diagonals of edges that are folded.
fn ends(sides: &[Side]) -> Vec<[usize; 2]> {
    let mut ends: Vec<[usize; 2]> = vec![];
    let mut add = |[i, j]: [usize; 2]| {
        if !ends.iter().any(|[k, l]| [*k, *l] == [i, j] || [*k, *l] == [j, i]) {
            ends.push([i, j]);
        }
    };
    for [a, b, c, d] in sides.iter().map(|side| side.places) {
        [[a, b], [a, c], [b, c], [a, d], [b, d]].into_iter().for_each(&mut add);
    }
    for side in sides.iter().filter(|side| side.angle.abs() >= FOLDED) {
        add([side.places[2], side.places[3]]);
    }
    ends
}

/// b = Σ r ∇θ.
fn slope(sides: &[Side], row: &[f64; 3], size: usize) -> DVector<f64> {
    let mut out = DVector::zeros(size);
    for (side, factor) in sides.iter().zip(row) {
        let slopes = angle_gradient(&side.x);
        side.places.iter().zip(slopes).for_each(|(place, slope)| add(&mut out, *place, *factor * slope));
    }
    out
}

/// The factors of c_k·c_l, and those of det(e, p, s) by edge.
fn weights(sides: &[Side], strains: &[[f64; 3]]) -> ([[f64; 3]; 3], [f64; 3]) {
    let (mut arms, mut sines) = ([[0.0; 3]; 3], [0.0; 3]);
    for (k, own) in sides.iter().enumerate() {
        let stiffness = |l: usize| strains.iter().map(|row| row[k] * row[l]).sum::<f64>();
        arms[k][k] += 0.5 * stiffness(k) * own.cosine;
        sines[k] -= stiffness(k) * own.sine;
        for (l, other) in sides.iter().enumerate().skip(k + 1) {
            let across = own.height.dot(&other.height);
            let together = own.cosine * other.cosine + across * own.sine * other.sine;
            if together < TOGETHER {
                continue;
            }
            let weight = stiffness(l) / together;
            arms[k][l] += 0.5 * weight;
            arms[l][k] += 0.5 * weight;
            arms[k][k] -= 0.5 * weight * across * (1.0 - other.cosine);
            arms[l][l] -= 0.5 * weight * across * (1.0 - own.cosine);
            sines[k] -= weight * other.sine;
            sines[l] -= weight * own.sine;
        }
    }
    let turns = std::array::from_fn(|k| sides.get(k).map_or(0.0, |side| -sines[k] / side.volume));
    (arms, turns)
}

/// ∇ and H of Σ arms c·c + Σ turns det(e, p, s), without what is constant.
fn derivatives(sides: &[Side], arms: &[[f64; 3]; 3], turns: &[f64; 3], size: usize) -> (DVector<f64>, DMatrix<f64>) {
    let (mut gradient, mut hessian) = (DVector::zeros(size), DMatrix::zeros(size, size));
    for (k, own) in sides.iter().enumerate() {
        for (l, other) in sides.iter().enumerate().filter(|(l, _)| arms[k][*l] != 0.0) {
            let weight = 2.0 * arms[k][l];
            for i in 0..4 {
                add(&mut gradient, own.places[i], weight * own.across[i] * other.arm);
                for j in 0..4 {
                    let factor = weight * own.across[i] * other.across[j];
                    (0..3).for_each(|c| hessian[(3 * own.places[i] + c, 3 * other.places[j] + c)] += factor);
                }
            }
        }
        if turns[k] == 0.0 {
            continue;
        }
        let [a, b, c, d] = own.x;
        let (e, p, s) = (b - a, c - a, d - a);
        let at = own.places;
        for (corner, slope) in [(1, p.cross(&s)), (2, s.cross(&e)), (3, e.cross(&p))] {
            add(&mut gradient, at[corner], turns[k] * slope);
            add(&mut gradient, at[0], -turns[k] * slope);
        }
        for (i, j, axis) in [(1, 2, -s), (1, 3, p), (2, 3, -e)] {
            let block = turns[k] * axis.cross_matrix();
            for (row, column, sign) in [(i, j, 1.0), (0, j, -1.0), (i, 0, -1.0), (0, 0, 1.0)] {
                let (row, column) = (3 * at[row], 3 * at[column]);
                for (c, d) in (0..9).map(|c| (c / 3, c % 3)) {
                    hessian[(row + c, column + d)] += sign * block[(c, d)];
                    hessian[(column + d, row + c)] += sign * block[(c, d)];
                }
            }
        }
    }
    (gradient, hessian)
}

fn add(to: &mut DVector<f64>, corner: usize, by: Vec3) {
    (0..3).for_each(|c| to[3 * corner + c] += by[c]);
}

/// N.
fn normals(x: &[Vec3], ends: &[[usize; 2]]) -> DMatrix<f64> {
    let mut normals = DMatrix::zeros(3 * x.len(), ends.len());
    for (m, [i, j]) in ends.iter().enumerate() {
        for c in 0..3 {
            let slope = 2.0 * (x[*j] - x[*i])[c];
            (normals[(3 * j + c, m)], normals[(3 * i + c, m)]) = (slope, -slope);
        }
    }
    normals
}

/// Σ BᵀHB, and the rest Hessian Σ Bᵀbbᵀ B.
pub fn hessians(bends: &[Bend], rows: &Rows) -> [DMatrix<f64>; 2] {
    let n = rows.n;
    let basis = rows.matrix();
    let mut product = vec![0.0; basis.nrows() * n];
    let mut stiffness = Mat::<f64>::zeros(n, n);
    let mut along = vec![];
    for some in bends.chunks(CHUNK) {
        along.clear();
        for bend in some {
            let moves = || bend.vertices.iter().enumerate().filter(|(_, v)| **v != NONE);
            let first = along.len();
            along.resize(first + bend.rows.len() * n, 0.0);
            for (j, v) in moves() {
                for axis in 0..3 {
                    let (q, own) = (3 * j + axis, &rows.at(*v)[axis * n..][..n]);
                    for (row, along) in bend.rows.iter().zip(along[first..].chunks_exact_mut(n)) {
                        along.iter_mut().zip(own).for_each(|(sum, x)| *sum += row[q] * x);
                    }
                    for (i, other) in moves() {
                        for c in 0..3 {
                            let factor = bend.hessian[(3 * i + c, q)];
                            let out = &mut product[(3 * *other as usize + c) * n..][..n];
                            out.iter_mut().zip(own).for_each(|(sum, x)| *sum += factor * x);
                        }
                    }
                }
            }
        }
        let along = MatRef::from_row_major_slice(&along, along.len() / n, n);
        matmul(stiffness.as_mut(), Accum::Add, along.transpose(), along, 1.0, Par::Seq);
    }
    let product = MatRef::from_row_major_slice(&product, basis.nrows(), n);
    let mut bending = Mat::<f64>::zeros(n, n);
    matmul(bending.as_mut(), Accum::Add, basis.transpose(), product, 1.0, Par::Seq);
    [symmetric(bending.as_ref()), symmetric(stiffness.as_ref())]
}

/// C₃: what det(e, p, s) counts, times its polar form.
pub fn cubic(bends: &[Bend], rows: &Rows) -> Vec<DMatrix<f64>> {
    let n = rows.n;
    let triangle = n * (n + 1) / 2;
    let mut sums = Mat::<f64>::zeros(n, triangle);
    let [mut e, mut p, mut s] = [vec![0.0; 3 * CHUNK * n], vec![0.0; 3 * n], vec![0.0; 3 * n]];
    let mut crossed = vec![0.0; 3 * CHUNK * triangle];
    let told = |bend: &Bend, places: &[usize; 4]| places.map(|place| bend.vertices[place]);
    let of = |bend: &Bend| bend.turning.iter().map(|(at, turn)| (told(bend, at), *turn)).collect::<Vec<_>>();
    // An edge at a clamp does not move.
    let counts = |(vertices, turn): &([u32; 4], f64)| *turn != 0.0 && !vertices.contains(&NONE);
    let turning: Vec<([u32; 4], f64)> = bends.iter().flat_map(of).filter(counts).collect();
    for some in turning.chunks(CHUNK) {
        let outs = e.chunks_exact_mut(3 * n).zip(crossed.chunks_exact_mut(3 * triangle));
        for (([a, b, c, d], turn), (e, crossed)) in some.iter().zip(outs) {
            rows.difference([*a, *b], e);
            rows.difference([*a, *c], &mut p);
            rows.difference([*a, *d], &mut s);
            e.iter_mut().for_each(|e| *e *= turn);
            for (axis, out) in crossed.chunks_exact_mut(triangle).enumerate() {
                let [i, j] = [(axis + 1) % 3 * n, (axis + 2) % 3 * n];
                let (pi, pj, si, sj) = (&p[i..i + n], &p[j..j + n], &s[i..i + n], &s[j..j + n]);
                for k in 0..n {
                    let out = &mut out[k * (k + 1) / 2..][..k + 1];
                    for l in 0..=k {
                        out[l] = pi[k] * sj[l] - pj[k] * si[l] + pi[l] * sj[k] - pj[l] * si[k];
                    }
                }
            }
        }
        let lines = 3 * some.len();
        let e = MatRef::from_row_major_slice(&e[..lines * n], lines, n);
        let crossed = MatRef::from_row_major_slice(&crossed[..lines * triangle], lines, triangle);
        matmul(sums.as_mut(), Accum::Add, e.transpose(), crossed, 1.0, Par::Seq);
    }
    let at = |i: usize, j: usize, k: usize| sums[(i, j * (j + 1) / 2 + k)];
    let entry = |mut index: [usize; 3]| {
        index.sort_unstable();
        let [k, j, i] = index;
        at(i, j, k) + at(j, i, k) + at(k, i, j)
    };
    (0..n).map(|k| DMatrix::from_fn(n, n, |i, j| entry([i, j, k]))).collect()
}

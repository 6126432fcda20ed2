//! Bending as a cubic. For a hinge with the edge e = b − a, p = c − a and s = d − a, the heights h₁, h₂ and feet t₁, t₂ of c, d at rest,
//! K = (−(1 − t₁)/h₁ − (1 − t₂)/h₂, −t₁/h₁ − t₂/h₂, 1/h₁, 1/h₂) and the weight w = 3 k_B l̄/h̄,
//!
//!   w (2 − 2 cos(θ − θ̄)) = w (2 − 2 cos θ̄ + cos θ̄ |Kx|² + 2 sin θ̄ det(e, p, s)/(L h₁h₂))
//!
//! as long as lengths hold. What its gradient is at rest, Σ μ ∇y over the hinge's five edges, is taken off as Σ μ y, which keeps it
//! invariant where a constant would not. Its Hessian H at rest misses that of the angle, bbᵀ; ½ yᵀDy with D = N⁺ (bbᵀ − H) N⁺ᵀ makes up
//! for it, where the columns of N are ∇y of the edges, and of the diagonal c–d where the hinge is folded.

use super::pairs::{Rows, symmetric};
use crate::energy::dihedral_angle;
use crate::material::Quantity;
use crate::{Shell, Vec3};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::{DMatrix, SMatrix};

/// Rest angle, rad, from which the diagonal counts; below, its ∇y is nearly that of the edges.
const FOLDED: f64 = 0.2;
/// Hinges whose products are summed at once.
const CHUNK: usize = 64;
/// Ends of the pairs, by corner: the edges and the diagonal.
const ENDS: [[usize; 2]; 6] = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]];

/// Of the norm of N, below which a singular value is rounding.
const RANK: f64 = 1e-10;

type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SMatrix<f64, 12, 1>;
/// A matrix on the six pairs.
pub type Matrix6 = SMatrix<f64, 6, 6>;

/// A hinge and what its energy is made of.
pub struct Hinge {
    corners: [u32; 4],
    /// Numbers of its pairs; none for the diagonal of one that is nearly flat.
    pub pairs: [Option<usize>; 6],
    /// b.
    row: Vector12,
    /// H, and 2 w sin θ̄/(L h₁h₂).
    hessian: Matrix12,
    turning: f64,
    /// D; may hold what is no number.
    pub correction: Matrix6,
}

/// All hinges that resist bending by k_B; `pairs` are the mesh's edges, and diagonals of folded hinges are added to them.
pub fn hinges(shell: &Shell, k_bend: f64, pairs: &mut Vec<[u32; 2]>) -> Vec<Hinge> {
    let mut rows = vec![];
    let membrane = shell.energy.n_membrane();
    let mut e = 0;
    shell.energy.visit_rest_rows(&mut |(_, row)| {
        if e >= membrane {
            rows.push(Vector12::from_fn(|i, _| row[i / 3][i % 3]));
        }
        e += 1;
    });
    let edges: Vec<[u32; 2]> = pairs.clone();
    let number = |a: u32, b: u32| edges.binary_search_by_key(&sorted([a, b]), |pair| sorted(*pair)).ok();
    let varying = shell.maps.by_edge(Quantity::KBend, &shell.mesh);
    let resists = |edge: &crate::mesh::Edge| edge.is_interior() && shell.creases.factor(edge.vertices) != 0.0;
    let interior = shell.mesh.edges.iter().enumerate().filter(|(_, edge)| resists(edge));
    let hinge = |((e, edge), row): ((usize, &crate::mesh::Edge), Vector12)| {
        let corners = [edge.vertices[0], edge.vertices[1], edge.opposite[0], edge.opposite[1]];
        let mut own: [Option<usize>; 6] = std::array::from_fn(|k| number(corners[ENDS[k][0]], corners[ENDS[k][1]]));
        let x = corners.map(|v| shell.mesh.positions[v as usize]);
        own[5] = (dihedral_angle(&x).abs() >= FOLDED).then(|| {
            pairs.push([corners[2], corners[3]]);
            pairs.len() - 1
        });
        let k_bend = shell.creases.factor(edge.vertices) * varying.as_ref().map_or(k_bend, |k| k[e]);
        Hinge::new(corners, own, &x, k_bend, row)
    };
    interior.zip(rows).map(hinge).collect()
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Hinge {
    fn new(corners: [u32; 4], pairs: [Option<usize>; 6], x: &[Vec3; 4], k_bend: f64, row: Vector12) -> Self {
        let [a, b, c, d] = x;
        let (e, p, s) = (b - a, c - a, d - a);
        let (length, doubles) = (e.norm(), [e.cross(&p).norm(), s.cross(&e).norm()]);
        let weight = 6.0 * k_bend * length * length / (doubles[0] + doubles[1]);
        let [h, k] = doubles.map(|double| double / length);
        let [t, r] = [p, s].map(|of| of.dot(&e) / (length * length));
        let across = [-(1.0 - t) / h - (1.0 - r) / k, -t / h - r / k, 1.0 / h, 1.0 / k];
        let (sine, cosine) = libm::sincos(dihedral_angle(x));
        let turning = 2.0 * weight * sine / (length * h * k);
        let arm: Vec3 = across.iter().zip(x).map(|(k, x)| *k * x).sum();
        let mut gradient = Vector12::zeros();
        let mut hessian = Matrix12::zeros();
        for i in 0..4 {
            add(&mut gradient, i, 2.0 * weight * cosine * across[i] * arm);
            for j in 0..4 {
                let factor = 2.0 * weight * cosine * across[i] * across[j];
                (0..3).for_each(|c| hessian[(3 * i + c, 3 * j + c)] += factor);
            }
        }
        for (corner, slope) in [(1, p.cross(&s)), (2, s.cross(&e)), (3, e.cross(&p))] {
            add(&mut gradient, corner, turning * slope);
            add(&mut gradient, 0, -turning * slope);
        }
        for (i, j, axis) in [(1, 2, -s), (1, 3, p), (2, 3, -e)] {
            let block = turning * axis.cross_matrix();
            for (row, column, sign) in [(i, j, 1.0), (0, j, -1.0), (i, 0, -1.0), (0, 0, 1.0)] {
                for c in 0..9 {
                    let (c, d) = (c / 3, c % 3);
                    hessian[(3 * row + c, 3 * column + d)] += sign * block[(c, d)];
                    hessian[(3 * column + d, 3 * row + c)] += sign * block[(c, d)];
                }
            }
        }
        let normals = normals(x, &pairs);
        let told = normals.norm_squared().is_finite(); // a search for singular values needs numbers
        let inverse =
            if told { normals.pseudo_inverse(RANK * normals.norm()).unwrap_or_default() } else { SMatrix::zeros() };
        let forces = inverse * gradient;
        for (m, [i, j]) in ENDS.into_iter().enumerate() {
            for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                (0..3).for_each(|c| hessian[(3 * row + c, 3 * column + c)] -= 2.0 * sign * forces[m]);
            }
        }
        let correction = inverse * (row * row.transpose() - hessian) * inverse.transpose();
        let correction = 0.5 * (correction + correction.transpose());
        Self { corners, pairs, row, hessian, turning, correction }
    }
}

fn add(to: &mut Vector12, corner: usize, by: Vec3) {
    (0..3).for_each(|c| to[3 * corner + c] += by[c]);
}

/// N; a pair that does not count has the column 0.
fn normals(x: &[Vec3; 4], pairs: &[Option<usize>; 6]) -> SMatrix<f64, 12, 6> {
    let mut normals = SMatrix::zeros();
    for (m, [i, j]) in ENDS.into_iter().enumerate().filter(|(m, _)| pairs[*m].is_some()) {
        for c in 0..3 {
            let slope = 2.0 * (x[j] - x[i])[c];
            (normals[(3 * j + c, m)], normals[(3 * i + c, m)]) = (slope, -slope);
        }
    }
    normals
}

/// Σ BᵀHB, and the rest Hessian Σ Bᵀbbᵀ B.
pub fn hessians(hinges: &[Hinge], rows: &Rows) -> [DMatrix<f64>; 2] {
    let n = rows.n;
    let basis = rows.matrix();
    let mut product = vec![0.0; basis.nrows() * n];
    let mut stiffness = Mat::<f64>::zeros(n, n);
    let mut along = vec![0.0; CHUNK * n];
    for some in hinges.chunks(CHUNK) {
        along.fill(0.0);
        for (hinge, along) in some.iter().zip(along.chunks_exact_mut(n)) {
            for q in 0..12 {
                let own = &rows.at(hinge.corners[q / 3])[q % 3 * n..][..n];
                along.iter_mut().zip(own).for_each(|(sum, x)| *sum += hinge.row[q] * x);
                for p in 0..12 {
                    let factor = hinge.hessian[(p, q)];
                    let out = &mut product[(3 * hinge.corners[p / 3] as usize + p % 3) * n..][..n];
                    out.iter_mut().zip(own).for_each(|(sum, x)| *sum += factor * x);
                }
            }
        }
        let along = MatRef::from_row_major_slice(&along[..some.len() * n], some.len(), n);
        matmul(stiffness.as_mut(), Accum::Add, along.transpose(), along, 1.0, Par::Seq);
    }
    let product = MatRef::from_row_major_slice(&product, basis.nrows(), n);
    let mut bending = Mat::<f64>::zeros(n, n);
    matmul(bending.as_mut(), Accum::Add, basis.transpose(), product, 1.0, Par::Seq);
    [symmetric(bending.as_ref()), symmetric(stiffness.as_ref())]
}

/// C₃ = Σ 2 w sin θ̄/(L h₁h₂) of the polar form of det(e, p, s).
pub fn cubic(hinges: &[Hinge], rows: &Rows) -> Vec<DMatrix<f64>> {
    let n = rows.n;
    let triangle = n * (n + 1) / 2;
    let mut sums = Mat::<f64>::zeros(n, triangle);
    let [mut e, mut p, mut s] = [vec![0.0; 3 * CHUNK * n], vec![0.0; 3 * n], vec![0.0; 3 * n]];
    let mut crossed = vec![0.0; 3 * CHUNK * triangle];
    let turning: Vec<&Hinge> = hinges.iter().filter(|hinge| hinge.turning != 0.0).collect();
    for some in turning.chunks(CHUNK) {
        let outs = e.chunks_exact_mut(3 * n).zip(crossed.chunks_exact_mut(3 * triangle));
        for (hinge, (e, crossed)) in some.iter().zip(outs) {
            let [a, b, c, d] = hinge.corners;
            rows.difference([a, b], e);
            rows.difference([a, c], &mut p);
            rows.difference([a, d], &mut s);
            e.iter_mut().for_each(|e| *e *= hinge.turning);
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

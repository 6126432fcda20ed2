//! Ties: ½ k |r|², r = x_v − Σ w x − h n, with the triangle's unit normal n where the tie has a height h.
//!
//! An element for each component of r along the axes. Without a height the energy is quadratic in positions. It does not change with rigid
//! motions; its dashpot resists all motion of the two points against each other.

use super::{Curvature, ElementHessian, Energy, Mat3, RestRow, Stress, Term};
use crate::material::Bond;
use crate::{Mesh, Vec3};

/// A stiff tie is as many times as stiff as the shell at the stiffer end, and so gives by no more than one part of it.
const STIFF: f64 = 1e3;

/// Vertices of a tie: the corners and the vertex.
const MOST: usize = 4;

/// All ties.
pub struct TieEnergy(Vec<Part>);

/// A tie with those of its elements that count.
#[derive(Clone, Copy)]
struct Part {
    /// Corners, then the vertex.
    vertices: [u32; MOST],
    size: usize,
    /// Of the corners.
    weights: [f64; 3],
    height: f64,
    /// √k of each component; 0 where it does not count.
    roots: [f64; 3],
    /// ∇r at rest, by vertex.
    rest: [Mat3; MOST],
}

/// The triangle in a shape: b − a, c − a, 1/|N| and n; zeros where it has collapsed, or there is none.
#[derive(Clone, Copy, Default)]
struct Facet {
    along: [Vec3; 2],
    inverse: f64,
    normal: Vec3,
}

impl TieEnergy {
    /// `terms` are the shell's other energies, which tell how stiff it is.
    pub fn new(mesh: &Mesh, bonds: &[Bond], terms: &[Box<dyn Energy>]) -> Self {
        let mut stiffness = vec![0.0; mesh.positions.len()];
        for term in terms {
            term.visit_rest_rows(&mut |(vertices, row)| {
                vertices.iter().zip(row).for_each(|(&v, b)| stiffness[v as usize] += b.norm_squared() / 3.0);
            });
        }
        let part = |bond: &Bond| {
            let own = bond.vertices().map(|v| stiffness[v as usize]).fold(0.0, f64::max);
            Part::new(bond, if bond.stiffness > 0.0 { bond.stiffness } else { STIFF * own }, &mesh.positions)
        };
        Self(bonds.iter().map(part).collect())
    }
}

impl Part {
    fn new(bond: &Bond, k: f64, x: &[Vec3]) -> Self {
        let Bond { vertex, corners: [a, b, c], weights, height, .. } = *bond;
        let (vertices, size) = if bond.joins_points() { ([a, vertex, a, a], 2) } else { ([a, b, c, vertex], MOST) };
        let mut part = Self { vertices, size, weights, height, roots: [k.sqrt(); 3], rest: [Mat3::zeros(); MOST] };
        part.rest = part.gradient(&part.facet(x));
        part
    }

    fn vertices(&self) -> &[u32] {
        &self.vertices[..self.size]
    }

    fn facet(&self, x: &[Vec3]) -> Facet {
        if self.height == 0.0 {
            return Facet::default();
        }
        let [a, b, c] = [0, 1, 2].map(|i| x[self.vertices[i] as usize]);
        let normal = (b - a).cross(&(c - a));
        let inverse = 1.0 / normal.norm();
        if !inverse.is_finite() {
            return Facet::default();
        }
        Facet { along: [b - a, c - a], inverse, normal: inverse * normal }
    }

    /// r.
    fn missing(&self, facet: &Facet, x: &[Vec3]) -> Vec3 {
        let at = |i: usize| x[self.vertices[i] as usize];
        let foot = if self.size == 2 { at(0) } else { (0..3).map(|i| self.weights[i] * at(i)).sum() };
        at(self.size - 1) - foot - self.height * facet.normal
    }

    /// ∂r by vertex.
    fn gradient(&self, facet: &Facet) -> [Mat3; MOST] {
        let one = Mat3::identity();
        if self.size == 2 {
            return [-one, one, Mat3::zeros(), Mat3::zeros()];
        }
        let mut by = [-self.weights[0] * one, -self.weights[1] * one, -self.weights[2] * one, one];
        if self.height != 0.0 {
            let turned = facet.turned();
            let flat = self.height * facet.inverse * (one - facet.normal * facet.normal.transpose());
            let [of_b, of_c] = turned.map(|d| flat * d);
            by[0] += of_b + of_c;
            by[1] -= of_b;
            by[2] -= of_c;
        }
        by
    }

    /// blocks −= h ∂²(g·n).
    fn add_curvature(&self, facet: &Facet, g: Vec3, blocks: &mut [Mat3]) {
        if self.height == 0.0 || g == Vec3::zeros() {
            return;
        }
        let (n, over) = (facet.normal, facet.inverse);
        let flat = Mat3::identity() - n * n.transpose();
        let (beside, d) = (flat * g, facet.turned());
        let [on_n, on_g] = [n, beside].map(|v| d.map(|d| d.tr_mul(&v)));
        let mut second = [[Mat3::zeros(); 2]; 2];
        for (i, row) in second.iter_mut().enumerate() {
            for (j, block) in row.iter_mut().enumerate() {
                let both = on_n[i] * on_g[j].transpose() + on_g[i] * on_n[j].transpose();
                *block = -over * over * (both + g.dot(&n) * d[i].tr_mul(&(flat * d[j])));
            }
        }
        second[0][1] -= over * beside.cross_matrix();
        second[1][0] += over * beside.cross_matrix();
        // By a, b, c in place of b − a, c − a.
        let by = |p: usize, q: usize| -> Mat3 {
            let sides = |p: usize| if p == 0 { vec![(0, -1.0), (1, -1.0)] } else { vec![(p - 1, 1.0)] };
            let pairs = sides(p).into_iter().flat_map(|a| sides(q).into_iter().map(move |b| (a, b)));
            pairs.map(|((i, s), (j, t))| s * t * second[i][j]).sum()
        };
        for (p, q) in (0..3).flat_map(|p| (0..3).map(move |q| (p, q))) {
            blocks[p * MOST + q] -= self.height * by(p, q);
        }
    }

    /// Elements that count.
    fn kept(&self) -> impl Iterator<Item = usize> + use<> {
        let roots = self.roots;
        (0..3).filter(move |c| roots[*c] > 0.0)
    }

    /// √k ∇r along an axis.
    fn row(&self, gradient: &[Mat3; MOST], c: usize) -> [Vec3; MOST] {
        gradient.map(|by| self.roots[c] * by.row(c).transpose())
    }

    /// The Hessian of what counts, with the stress of each component.
    fn visit_hessian(&self, facet: &Facet, stress: Option<Vec3>, visit: &mut dyn FnMut(ElementHessian)) {
        let gradient = self.gradient(facet);
        let stiffness = Mat3::from_diagonal(&Vec3::from_fn(|c, _| self.roots[c] * self.roots[c]));
        let mut blocks = [Mat3::zeros(); MOST * MOST];
        for (pq, block) in blocks[..self.size * self.size].iter_mut().enumerate() {
            *block = gradient[pq / self.size].tr_mul(&(stiffness * gradient[pq % self.size]));
        }
        if let Some(stress) = stress {
            self.add_curvature(facet, Vec3::from_fn(|c, _| self.roots[c] * stress[c]), &mut blocks);
        }
        visit((self.vertices(), &blocks[..self.size * self.size]));
    }
}

impl Facet {
    /// ∂N by b − a and by c − a.
    fn turned(&self) -> [Mat3; 2] {
        let [b, c] = self.along;
        [-c.cross_matrix(), b.cross_matrix()]
    }
}

impl Energy for TieEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let of = |part: &Part| {
            let r = part.missing(&part.facet(x), x);
            (0..3).map(|c| (part.roots[c] * r[c]).powi(2)).sum::<f64>()
        };
        0.5 * self.0.iter().map(of).sum::<f64>()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        for part in &self.0 {
            let facet = part.facet(x);
            let r = part.missing(&facet, x);
            let pull = Vec3::from_fn(|c, _| part.roots[c] * part.roots[c] * r[c]);
            let by = part.gradient(&facet);
            part.vertices().iter().zip(&by).for_each(|(v, by)| gradient[*v as usize] += by.tr_mul(&pull));
        }
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for part in &self.0 {
            part.kept().for_each(|c| visit((part.vertices(), &part.row(&part.rest, c)[..part.size])));
        }
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        for part in &self.0 {
            let facet = part.facet(x);
            let (r, gradient) = (part.missing(&facet, x), part.gradient(&facet));
            for c in part.kept() {
                visit((part.vertices(), &part.row(&gradient, c)[..part.size]), part.roots[c] * r[c]);
            }
        }
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        for part in &self.0 {
            let facet = part.facet(x);
            let r = part.missing(&facet, x);
            let stress = (curvature == Curvature::Exact).then(|| Vec3::from_fn(|c, _| part.roots[c] * r[c]));
            part.visit_hessian(&facet, stress, visit);
        }
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let mut stress = stress.iter();
        for part in &self.0 {
            let facet = part.facet(x);
            for (c, stress) in part.kept().zip(&mut stress) {
                let mut blocks = [Mat3::zeros(); MOST * MOST];
                if curvature == Curvature::Exact {
                    part.add_curvature(&facet, Vec3::ith(c, part.roots[c] * stress), &mut blocks);
                }
                visit((part.vertices(), &blocks[..part.size * part.size]));
            }
        }
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let mut each = stress.of.iter();
        for part in &self.0 {
            let mut own = Vec3::zeros();
            part.kept().zip(&mut each).for_each(|(c, of)| own[c] = stress.share * of);
            part.visit_hessian(&part.facet(x), Some(own), visit);
        }
    }

    fn n_membrane(&self) -> usize {
        0
    }

    fn visit_terms(&self, _rest: &[Vec3], _visit: &mut dyn FnMut(Term)) -> bool {
        false
    }

    fn n_elements(&self) -> usize {
        self.0.iter().map(|part| part.kept().count()).sum()
    }

    fn even(&self, weights: &mut [f64]) {
        let mut rest = weights;
        for part in &self.0 {
            let (own, others) = rest.split_at_mut(part.kept().count());
            rest = others;
            let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
            own.fill(mean);
        }
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let mut weights = weights.iter();
        let mut parts = vec![];
        for part in &self.0 {
            let mut sample = *part;
            part.kept().zip(&mut weights).for_each(|(c, weight)| sample.roots[c] *= weight.sqrt());
            if sample.kept().next().is_some() {
                let size = sample.size;
                sample.vertices[..size].iter_mut().for_each(|v| *v = index[*v as usize]);
                parts.push(sample);
            }
        }
        Box::new(Self(parts))
    }
}

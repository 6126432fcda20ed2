//! Bending term: E_B = k_B Σ 3 (θ − θ̄)² l̄/h̄ over interior edges, h̄ the mean rest height of the two triangles.
//!
//! The signed dihedral angle θ is the turn from the normal of the first triangle (a, b, c) to that of the second (b, a, d)
//! about the edge a → b; it is zero when flat. Differences are wrapped to (−π, π], so a fold through 180° stays finite.
//!
//! θ jumps where a triangle passes through no area, and its gradient grows beyond all bounds on the way: a wall that a torn shell
//! is caught behind. So a triangle on less than a hundredth of its rest area Ā lets go of its hinges: for θ − θ̄ stands φ₁φ₂ (θ − θ̄), with
//! φ = r (2 − r), r = (100 A/Ā)² below r = 1 and φ = 1 from there on. The Hessian goes without the derivatives of φ.

use super::hinge_lanes::{Blocks, Corners, LANES, Lanes, Slopes, read};
use super::rest::Rest;
use super::{Curvature, ElementHessian, Energy, Fold, Mat3, RestRow, Stress, Term};
use crate::mesh::Edge;
use crate::{Mesh, Vec3};
use pulp::Arch;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// The bending term over all interior edges.
#[derive(Clone)]
pub struct HingeEnergy {
    /// a, b, c, d of each interior edge: its ends, then the two opposite vertices.
    pub(super) hinges: Vec<[u32; 4]>,
    pub(super) rest_angle: Vec<f64>,
    /// 3 k_B l̄/h̄.
    pub(super) weight: Vec<f64>,
    rest_gradient: Vec<[Vec3; 4]>,
    /// (2 Ā/100)² of the two triangles.
    small: Vec<[f64; 2]>,
}

/// Of the rest area, below which a triangle lets go of its hinges.
const COLLAPSED: f64 = 0.01;

/// One hinge in a shape.
pub(super) struct Bend {
    pub(super) corners: [Vec3; 4],
    /// φ₁φ₂.
    pub(super) share: f64,
    /// θ − θ̄.
    pub(super) turn: f64,
}

impl HingeEnergy {
    /// Rest angles and weights from the mesh; `k` is k_B.
    pub fn new(mesh: &Mesh, k: f64) -> Self {
        Self::of(mesh, |_, _| Some((k, None)))
    }

    /// The same with a constant of each edge's own (n_edges).
    pub fn varying(mesh: &Mesh, values: &[f64]) -> Self {
        Self::of(mesh, |edge, _| Some((values[edge], None)))
    }

    /// Over the interior edges that have a constant by `k`, of an edge's number and the edge, with an angle at rest if not the mesh's.
    pub(super) fn of(mesh: &Mesh, k: impl Fn(usize, &Edge) -> Option<(f64, Option<f64>)>) -> Self {
        let interior = mesh.edges.iter().enumerate().filter(|(_, e)| e.is_interior());
        let corner_and_constant = |(i, e): (usize, &Edge)| {
            let corners = [e.vertices[0], e.vertices[1], e.opposite[0], e.opposite[1]];
            k(i, e).map(|constant| (corners, constant))
        };
        let (hinges, constants): (Vec<[u32; 4]>, Vec<_>) = interior.filter_map(corner_and_constant).unzip();
        let (k, angles): (Vec<f64>, Vec<Option<f64>>) = constants.into_iter().unzip();
        let corners = |h: &[u32; 4]| h.map(|v| mesh.positions[v as usize]);
        let angle = |(h, own): (&[u32; 4], Option<f64>)| own.unwrap_or_else(|| dihedral_angle(&corners(h)));
        Self {
            rest_angle: hinges.iter().zip(angles).map(angle).collect(),
            weight: hinges.iter().zip(k).map(|(h, k)| 3.0 * k * length_over_height(&corners(h))).collect(),
            rest_gradient: hinges.iter().map(|h| angle_gradient(&corners(h))).collect(),
            small: hinges.iter().map(|h| small(&corners(h))).collect(),
            hinges,
        }
    }

    /// The same with lengths and areas of a shape that has the same angles.
    pub(super) fn measured(mut self, rest: &Rest) -> Self {
        if rest.metric.is_none() {
            return self;
        }
        for (i, hinge) in self.hinges.iter().enumerate() {
            let before = hinge.map(|v| rest.mesh.positions[v as usize]);
            let after = rest.hinge(hinge);
            self.weight[i] *= length_over_height(&after) / length_over_height(&before);
            self.small[i] = small(&after);
        }
        self
    }

    /// As [`Energy::sampled`].
    pub(super) fn sample(&self, weights: &[f64], index: &[u32]) -> Self {
        let kept: Vec<usize> = (0..self.hinges.len()).filter(|&h| weights[h] != 0.0).collect();
        Self {
            hinges: kept.iter().map(|&h| self.hinges[h].map(|v| index[v as usize])).collect(),
            rest_angle: kept.iter().map(|&h| self.rest_angle[h]).collect(),
            weight: kept.iter().map(|&h| self.weight[h] * weights[h]).collect(),
            rest_gradient: kept.iter().map(|&h| self.rest_gradient[h]).collect(),
            small: kept.iter().map(|&h| self.small[h]).collect(),
        }
    }

    pub(super) fn bend(&self, i: usize, x: &[Vec3]) -> Bend {
        self.bend_of(i, self.hinges[i].map(|v| x[v as usize]))
    }

    #[inline(always)]
    pub(super) fn bend_of(&self, i: usize, corners: [Vec3; 4]) -> Bend {
        Bend { corners, share: self.share_of(i, &corners), turn: self.turn_of(i, &corners) }
    }

    #[inline(always)]
    fn turn_of(&self, i: usize, corners: &[Vec3; 4]) -> f64 {
        wrapped_difference(dihedral_angle(corners), self.rest_angle[i])
    }

    #[inline(always)]
    fn share_of(&self, i: usize, corners: &[Vec3; 4]) -> f64 {
        let (n1, n2) = normals(corners);
        [n1, n2].iter().zip(&self.small[i]).map(|(n, small)| presence(n.norm_squared() / small)).product()
    }

    /// ∂(φ₁φ₂ (θ − θ̄))/∂(a, b, c, d).
    pub(super) fn gradient(&self, i: usize, bend: &Bend) -> [Vec3; 4] {
        let mut gradient = angle_gradient(&bend.corners);
        if bend.share < 1.0 {
            gradient.iter_mut().for_each(|g| *g *= bend.share);
            add_letting_go(&bend.corners, &self.small[i], bend.turn, &mut gradient);
        }
        gradient
    }

    /// The hinges some at a time, with their corners and slopes; without where one lets go.
    #[inline(always)]
    fn side_by_side(&self, x: &[Vec3], mut visit: impl FnMut(Range<usize>, Option<(&Corners, &Slopes)>)) {
        let (arch, n) = (Arch::new(), self.hinges.len());
        for first in (0..n).step_by(LANES) {
            let some = first..n.min(first + LANES);
            let corners = Corners::of(self.hinges[some.clone()].iter().map(|h| h.map(|v| x[v as usize])));
            let slopes = corners.slopes(arch);
            let own = self.small[some.clone()].iter().enumerate();
            let whole = own.fold(true, |all, (lane, small)| {
                all & (0..2).fold(true, |all, k| all & (slopes.squared[k][lane] / small[k] >= 1.0))
            });
            visit(some, whole.then_some((&corners, &slopes)));
        }
    }

    /// θ − θ̄ of the i-th, which does not let go.
    #[inline(always)]
    fn turn_in(&self, slopes: &Slopes, lane: usize, i: usize) -> f64 {
        let [sine, cosine] = slopes.angle.map(|angle| angle[lane]);
        wrapped_difference(libm::atan2(sine, cosine), self.rest_angle[i])
    }

    /// Hands the number of each hinge to `visit`, with its vertices, φ₁φ₂ and θ − θ̄, and the gradient of their product.
    #[inline(always)]
    fn each(&self, x: &[Vec3], mut visit: impl FnMut(usize, &[u32; 4], [f64; 2], [Vec3; 4])) {
        self.side_by_side(x, |some, whole| {
            for (lane, i) in some.enumerate() {
                let (bent, gradient) = match whole {
                    Some((_, slopes)) => ([1.0, self.turn_in(slopes, lane, i)], slopes.gradient(lane)),
                    None => {
                        let bend = self.bend(i, x);
                        ([bend.share, bend.turn], self.gradient(i, &bend))
                    }
                };
                visit(i, &self.hinges[i], bent, gradient);
            }
        });
    }

    /// 2w (∇θ∇θᵀ + t ∂²θ) of each hinge, where t is made of its φ₁φ₂ and θ − θ̄ if that is asked for; without the second part where there is no t: the
    /// semidefinite one is Gauss–Newton's.
    #[inline(always)]
    fn each_hessian(
        &self,
        x: &[Vec3],
        turned: Option<impl Fn(usize, f64, &dyn Fn() -> f64) -> f64>,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let arch = Arch::new();
        let mut room = [[0.0; LANES]; 144];
        self.side_by_side(x, |some, whole| {
            let Some((corners, slopes)) = whole else {
                return some.for_each(|i| self.alone(i, x, turned.as_ref(), visit));
            };
            let weights = self.lanes(&some, |_, i| 2.0 * self.weight[i]);
            let blocks = match &turned {
                None => Blocks::Rows(weights),
                Some(turned) => {
                    let turn = |lane, i| turned(i, 1.0, &|| self.turn_in(slopes, lane, i));
                    Blocks::Both(self.lanes(&some, turn), weights)
                }
            };
            corners.blocks(arch, slopes, &blocks, &mut room);
            some.enumerate().for_each(|(lane, i)| visit((&self.hinges[i], &read(&room, lane))));
        });
    }

    /// The same of one, which may let go.
    fn alone(
        &self,
        i: usize,
        x: &[Vec3],
        turned: Option<&impl Fn(usize, f64, &dyn Fn() -> f64) -> f64>,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let (bend, weight) = (self.bend(i, x), self.weight[i]);
        let d_angle = self.gradient(i, &bend);
        let mut blocks = [Mat3::zeros(); 16];
        if let Some(turned) = turned {
            let turn = turned(i, bend.share, &|| bend.turn);
            blocks = angle_curvature(&bend.corners);
            blocks.iter_mut().for_each(|block| *block *= turn);
        }
        for (ij, block) in blocks.iter_mut().enumerate() {
            *block = (2.0 * weight) * (*block + d_angle[ij / 4] * d_angle[ij % 4].transpose());
        }
        visit((&self.hinges[i], &blocks));
    }

    /// A number of each of some, by lane and hinge.
    #[inline(always)]
    fn lanes(&self, some: &Range<usize>, of: impl Fn(usize, usize) -> f64) -> Lanes {
        let mut lanes = [0.0; LANES];
        some.clone().zip(&mut lanes).enumerate().for_each(|(lane, (i, number))| *number = of(lane, i));
        lanes
    }
}

/// (2 Ā/100)² of the two triangles.
pub(super) fn small(corners: &[Vec3; 4]) -> [f64; 2] {
    <[Vec3; 2]>::from(normals(corners)).map(|n| small_of(n.norm()))
}

/// Of twice an area.
pub(super) fn small_of(doubled: f64) -> f64 {
    (COLLAPSED * doubled).powi(2)
}

/// += (θ − θ̄) ∂(φ₁φ₂).
#[cold]
pub(super) fn add_letting_go([a, b, c, d]: &[Vec3; 4], small: &[f64; 2], turn: f64, gradient: &mut [Vec3; 4]) {
    let triangles = [([a, b, c], [0, 1, 2]), ([b, a, d], [1, 0, 3])];
    let normal = |[p, q, r]: [&Vec3; 3]| (q - p).cross(&(r - p));
    let ratio = |k: usize| normal(triangles[k].0).norm_squared() / small[k];
    for (k, ([p, q, r], slots)) in triangles.into_iter().enumerate() {
        // ∂|N|² = 2 N × (opposite edge) at each corner.
        let n = normal([p, q, r]) * (2.0 / small[k]);
        let slope = turn * 2.0 * (1.0 - ratio(k)).max(0.0) * presence(ratio(1 - k));
        for (slot, opposite) in slots.into_iter().zip([r - q, p - r, q - p]) {
            gradient[slot] += slope * n.cross(&opposite);
        }
    }
}

/// Twice-area normals of the two triangles.
pub(super) fn normals([a, b, c, d]: &[Vec3; 4]) -> (Vec3, Vec3) {
    let e = b - a;
    (e.cross(&(c - a)), (d - a).cross(&e))
}

/// θ in (−π, π] of the corners a, b, c, d; the edge is a–b. Zero where the edge has collapsed.
pub fn dihedral_angle(corners: &[Vec3; 4]) -> f64 {
    let (n1, n2) = normals(corners);
    let edge = (corners[1] - corners[0]).try_normalize(0.0).unwrap_or_default();
    libm::atan2(n1.cross(&n2).dot(&edge), n1.dot(&n2))
}

/// l/h with h the mean of the two heights over the edge: l² / (A₁ + A₂).
fn length_over_height(corners: &[Vec3; 4]) -> f64 {
    let (n1, n2) = normals(corners);
    2.0 * (corners[1] - corners[0]).norm_squared() / (n1.norm() + n2.norm())
}

/// ∂θ/∂(a, b, c, d): −n̂/height at the opposite vertices, shared out to the edge by where their feet lie.
/// A collapsed triangle has no normal and contributes nothing.
pub fn angle_gradient(corners: &[Vec3; 4]) -> [Vec3; 4] {
    let [a, b, c, d] = corners;
    let (n1, n2) = normals(corners);
    let edge = b - a;
    let length = edge.norm();
    let over_height = |n: &Vec3| {
        let squared = n.norm_squared();
        if squared > 0.0 { n * (length / squared) } else { Vec3::zeros() }
    };
    let (g1, g2) = (over_height(&n1), over_height(&n2));
    let foot = |p: &Vec3| if length > 0.0 { (p - a).dot(&edge) / (length * length) } else { 0.0 };
    let (t1, t2) = (foot(c), foot(d));
    [(1.0 - t1) * g1 + (1.0 - t2) * g2, t1 * g1 + t2 * g2, -g1, -g2]
}

/// Adds the derivative of one triangle's share of ∇θ, [−(1 − t) g, −t g, g] of (p, q, r) with the hinge p–q, by (p, q, r), to the blocks of these slots.
/// g = −N l/|N|² and t the foot of r along the hinge. Nothing for a collapsed triangle.
#[inline(always)]
fn add_curvature_share(blocks: &mut [Mat3; 16], [p, q, r]: [&Vec3; 3], slots: [usize; 3]) {
    let edge = q - p;
    let (squared, normal) = (edge.norm_squared(), edge.cross(&(r - p)));
    let double_area = normal.norm();
    if double_area == 0.0 {
        return;
    }
    let (length, unit) = (squared.sqrt(), normal / double_area);
    let g = -unit * (length / double_area);
    let t = (r - p).dot(&edge) / squared;
    let along = edge / squared;
    let d_t = [(2.0 * t - 1.0) * along - (r - p) / squared, (r - p) / squared - 2.0 * t * along, along];
    // dg = g dl/l − (l/|N|²)(I − 2n̂n̂ᵀ) dN with dN = Σ (opposite edge) × d(vertex).
    let mirror = (2.0 * unit * unit.transpose() - Mat3::identity()) * (length / (double_area * double_area));
    let stretch = g * along.transpose();
    let d_g = [across(&mirror, r - q) - stretch, across(&mirror, p - r) + stretch, across(&mirror, edge)];
    for ((d_g, d_t), j) in d_g.iter().zip(&d_t).zip(slots) {
        let turn = g * d_t.transpose();
        blocks[4 * slots[0] + j] += (t - 1.0) * d_g + turn;
        blocks[4 * slots[1] + j] += -t * d_g - turn;
        blocks[4 * slots[2] + j] += d_g;
    }
}

/// The matrix times [v]×.
#[inline(always)]
fn across(matrix: &Mat3, v: Vec3) -> Mat3 {
    let [x, y, z] = [0, 1, 2].map(|c| matrix.column(c));
    Mat3::from_columns(&[y * v.z - z * v.y, z * v.x - x * v.z, x * v.y - y * v.x])
}

/// The blocks of ∂²θ. The two shares are unsymmetric in (a, b), by opposite amounts; their sum is symmetric.
pub(super) fn angle_curvature([a, b, c, d]: &[Vec3; 4]) -> [Mat3; 16] {
    let mut blocks = [Mat3::zeros(); 16];
    add_curvature_share(&mut blocks, [a, b, c], [0, 1, 2]);
    add_curvature_share(&mut blocks, [b, a, d], [1, 0, 3]);
    blocks
}

/// φ of r.
pub(super) fn presence(r: f64) -> f64 {
    if r < 1.0 { r * (2.0 - r) } else { 1.0 }
}

/// θ − θ̄ on the branch (−π, π].
pub(super) fn wrapped_difference(angle: f64, rest: f64) -> f64 {
    let d = angle - rest;
    if d > PI {
        d - TAU
    } else if d <= -PI {
        d + TAU
    } else {
        d
    }
}

impl Energy for HingeEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let term = |(i, weight): (usize, &f64)| {
            let Bend { share, turn, .. } = self.bend(i, x);
            weight * (share * turn).powi(2)
        };
        self.weight.iter().enumerate().map(term).sum()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.each(x, |i, h, [share, turn], d_angle| {
            let moment = 2.0 * self.weight[i] * share * turn;
            h.iter().zip(d_angle).for_each(|(&v, d)| gradient[v as usize] += moment * d);
        });
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for ((h, weight), d_angle) in self.hinges.iter().zip(&self.weight).zip(&self.rest_gradient) {
            let scale = (2.0 * weight).sqrt();
            visit((h, &d_angle.map(|d| scale * d)));
        }
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        self.each(x, |i, h, [share, turn], d_angle| {
            let root = (2.0 * self.weight[i]).sqrt();
            visit((h, &d_angle.map(|d| root * d)), root * (share * turn));
        });
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        if curvature == Curvature::Semidefinite {
            return self.hinges.iter().for_each(|h| visit((h, &[Mat3::zeros(); 16])));
        }
        let arch = Arch::new();
        let mut room = [[0.0; LANES]; 144];
        let moment = |i: usize, share: f64| (2.0 * self.weight[i]).sqrt() * stress[i] * share;
        self.side_by_side(x, |some, whole| {
            if let Some((corners, slopes)) = whole {
                let blocks = Blocks::Curved(self.lanes(&some, |_, i| moment(i, 1.0)));
                corners.blocks(arch, slopes, &blocks, &mut room);
                return some.enumerate().for_each(|(lane, i)| visit((&self.hinges[i], &read(&room, lane))));
            }
            for i in some {
                let bend = self.bend(i, x);
                let moment = moment(i, bend.share);
                visit((&self.hinges[i], &angle_curvature(&bend.corners).map(|block| moment * block)));
            }
        });
    }

    fn n_membrane(&self) -> usize {
        0
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        let turned = |_, share: f64, turn: &dyn Fn() -> f64| share * share * turn();
        self.each_hessian(x, (curvature == Curvature::Exact).then_some(turned), visit);
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let turned = |h: usize, share: f64, _: &dyn Fn() -> f64| {
            share * stress.share * stress.of[h] / (2.0 * self.weight[h]).sqrt()
        };
        self.each_hessian(x, Some(turned), visit);
    }

    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        for (vertices, weight) in self.hinges.iter().zip(&self.weight) {
            let fold = Fold { vertices: *vertices, corners: vertices.map(|v| rest[v as usize]) };
            visit(Term::Bend(&[fold], &[[(2.0 * weight).sqrt(), 0.0, 0.0]]));
        }
        true
    }

    fn n_elements(&self) -> usize {
        self.hinges.len()
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        Box::new(self.sample(weights, index))
    }
}

//! Bending of plates: ½ ∫ κᵀC κ, with the curvature κ of each triangle and C = h³/12 of plane stress.
//!
//! A triangle has three elements ε = √A Lᵀ M f(θ − θ̄), linear in the angles at its edges ([`super::patch`]), which are those of
//! [`super::hinge`], with f of [`super::fold_over`]. They touch its corners and those beyond its edges. A triangle on less than a hundredth of its area lets go of its angles, as there.
//! At a clamp the fourth corner stays where the rest triangle goes on, and the angle counts twice.

mod lanes;
mod side_by_side;
mod triangle;

use super::law::Law;
use super::mirror::{Mirror, MirroredEnergy};
use super::patch::{self, Beyond};
use super::rest::Rest;
use super::{Curvature, ElementHessian, Energy, Fold, MAX_ELEMENT as MOST, RestRow, Stress, Term, flips};
use crate::material::Creases;
use crate::mesh::NONE;
use crate::{Mesh, Vec3};
use nalgebra::{Matrix3, Vector3};
use side_by_side::{Rooms, each_few};
use triangle::{CLAMP, Edge, Patch};

/// What a triangle's bending stiffness is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// E.
    pub young: f64,
    /// The mean of h³.
    pub cube: f64,
    /// The direction of E of a sheet that has one, a unit vector; else zero.
    pub along: Vec3,
}

impl Default for Plate {
    fn default() -> Self {
        Self { young: 1.0, cube: 1.0, along: Vec3::zeros() }
    }
}

impl Plate {
    pub(super) fn rigidity(&self) -> f64 {
        self.young * self.cube
    }

    /// Two triangles' plates as one of the same rigidity.
    pub(super) fn together(plates: [Self; 2], areas: [f64; 2]) -> Self {
        let [a, b] = plates;
        let mean = |p: f64, q: f64| if p == q { p } else { (areas[0] * p + areas[1] * q) / (areas[0] + areas[1]) };
        let young = mean(a.young, b.young);
        let cube = if a == b { a.cube } else { mean(a.rigidity(), b.rigidity()) / young };
        let same = if a.along.dot(&b.along) < 0.0 { -b.along } else { b.along };
        let along = match a.along == b.along {
            true => a.along,
            false => (areas[0] * a.along + areas[1] * same).normalize(),
        };
        Self { young, cube, along }
    }

    /// Whether two triangles' directions are too far apart for triangles that lie in both.
    pub(super) fn turns(&self, other: &Self) -> bool {
        self.along != other.along && self.along.dot(&other.along).abs() < TURN
    }
}

/// What is told of the edges of a mesh.
pub(super) struct Edges<'a> {
    /// Both ends of an edge whose slope is kept (n_vertices, or none).
    pub(super) clamped: &'a [bool],
    /// Those that fold: of another stiffness they are left out here, as [`super::HingeEnergy`] has them.
    pub(super) creases: &'a Creases,
    /// The shape in which slopes are kept (n_vertices).
    pub(super) given: &'a [Vec3],
    /// Those on planes of symmetry, ascending.
    pub(super) mirrors: &'a [Mirror],
    /// The shape whose flat edges are flipped (n_vertices).
    pub(super) flat: &'a [Vec3],
}

/// The bending term over all triangles.
pub struct BendingEnergy {
    patches: Vec<Patch>,
    /// The elements' gradients at rest.
    rest: Vec<[[Vec3; MOST]; 3]>,
}

/// Where the corners of the triangles are without stress.
struct Shape<'a> {
    x: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    /// Corners of each by lengths of its own.
    laid: Option<&'a [[Vec3; 3]]>,
}

impl Shape<'_> {
    fn corners(&self, t: usize) -> [Vec3; 3] {
        self.laid.map_or_else(|| self.triangles[t].map(|v| self.x[v as usize]), |laid| laid[t])
    }

    /// The ends of edge k and the corner beyond it, in the triangle there; at a mirror the triangle's own.
    fn across(&self, t: usize, k: usize, beyond: &Beyond) -> [Vec3; 3] {
        let corners = self.corners(t);
        let own = [corners[(k + 1) % 3], corners[(k + 2) % 3], corners[k]];
        let Beyond::Vertex { corner, triangle } = *beyond else { return own };
        let ends = [self.triangles[t][(k + 1) % 3], self.triangles[t][(k + 2) % 3]];
        let (there, places) = (self.triangles[triangle], self.corners(triangle));
        let place = |v: u32| there.iter().position(|w| *w == v).map_or(own[2], |i| places[i]);
        [place(ends[0]), place(ends[1]), place(corner)]
    }
}

/// Twice the areas of the two triangles at each edge.
type Doubled = [[f64; 2]; 3];

/// Twice the area.
fn doubled([a, b, c]: &[Vec3; 3]) -> f64 {
    (b - a).cross(&(c - a)).norm()
}

/// Cosine of two directions between which an edge stays: a seam stays where it is.
const TURN: f64 = 0.9;

impl BendingEnergy {
    /// `stiffness` is LLᵀ = C, moment, of (κ₁₁, κ₂₂, 2κ₁₂), isotropic. Edges of the mesh whose ends both are `clamped` (n_vertices, or
    /// none) keep their slope.
    pub fn new(mesh: &Mesh, stiffness: &Matrix3<f64>, clamped: &[bool]) -> Self {
        let none = Creases::default();
        let edges = Edges { clamped, creases: &none, given: &mesh.positions, mirrors: &[], flat: &mesh.positions };
        Self::of_plates(&Rest::of(mesh), &mut [], |_, _| *stiffness, |_, _| 1.0, &edges).0
    }

    /// The same with other edges; what reaches across planes of symmetry is a term of its own.
    pub(super) fn creased(rest: &Rest, stiffness: &Matrix3<f64>, edges: &Edges) -> Vec<Box<dyn Energy>> {
        let (all, images) = Self::of_plates(rest, &mut [], |_, _| *stiffness, |_, _| 1.0, edges);
        MirroredEnergy::part(all, rest.mesh.positions.len(), &images)
    }

    /// The same with a plate of each triangle's own.
    pub(super) fn varying(rest: &Rest, mut plates: Vec<Plate>, law: &Law, edges: &Edges) -> Vec<Box<dyn Energy>> {
        let stiffness =
            |plate: Plate, corners: &[Vec3; 3]| plate.cube / 12.0 * law.stress(plate.young, &plate.along, corners);
        let about = |plate: Plate, edge: &Vec3| match plate.along == Vec3::zeros() {
            true => plate.rigidity(),
            false => plate.cube * law.about(&plate, edge),
        };
        let (all, images) = Self::of_plates(rest, &mut plates, stiffness, about, edges);
        MirroredEnergy::part(all, rest.mesh.positions.len(), &images)
    }

    /// `about`: what resists bending about an edge, in any unit. With what vertices from n_vertices on are the images of.
    fn of_plates(
        rest: &Rest,
        plates: &mut [Plate],
        stiffness: impl Fn(Plate, &[Vec3; 3]) -> Matrix3<f64>,
        about: impl Fn(Plate, &Vec3) -> f64,
        edges: &Edges,
    ) -> (Self, Vec<(u32, Mirror)>) {
        let mesh = rest.mesh;
        let (triangles, laid) = flips::bending_triangles(rest, edges, plates);
        let shape = Shape { x: &mesh.positions, triangles: &triangles, laid: laid.as_deref() };
        let beyond = flips::beyond(mesh, &triangles, edges);
        let plate = |t: usize| plates.get(t).copied().unwrap_or_default();
        let mut images = vec![];
        let of = |t: usize| {
            let corners = shape.corners(t);
            let across: [[Vec3; 3]; 3] = std::array::from_fn(|k| shape.across(t, k, &beyond[t][k]));
            let ratio = std::array::from_fn(|k| match beyond[t][k] {
                Beyond::Vertex { triangle, .. } => {
                    let edge = corners[(k + 2) % 3] - corners[(k + 1) % 3];
                    about(plate(t), &edge) / about(plate(triangle), &(across[k][1] - across[k][0]))
                }
                _ => 1.0,
            });
            let stiffness = stiffness(plate(t), &corners);
            let elements = patch::elements(&corners, (&beyond[t], &across), (&stiffness, &ratio));
            let areas = laid.as_ref().map(|_| across.map(|other| [doubled(&corners), doubled(&other)]));
            Patch::new(mesh, edges, (&triangles[t], &beyond[t], areas), &elements, &mut images)
        };
        let held = |t: &usize| beyond[*t].iter().any(|edge| *edge != Beyond::Free);
        let patches: Vec<Patch> = (0..triangles.len()).filter(held).map(of).collect();
        let at_rest = |x: &[Vec3]| patches.iter().map(|patch| patch.gradients(&patch.bends(x))).collect();
        let rest = match images.is_empty() {
            true => at_rest(&mesh.positions),
            false => {
                let image = |(v, plane): &(u32, Mirror)| plane.image(&mesh.positions[*v as usize]);
                at_rest(&mesh.positions.iter().copied().chain(images.iter().map(image)).collect::<Vec<_>>())
            }
        };
        // The plane is where the mesh was given, wherever that of the rest shape is.
        images.iter_mut().for_each(|(_, plane)| {
            *plane = super::mirror_at(edges.mirrors, plane.ends).copied().unwrap_or(*plane);
        });
        (Self { patches, rest }, images)
    }

    /// The triangles without vertices from `n` on, the others on vertices of their own, and what these are.
    pub(super) fn part(self, n: u32) -> (Self, Self, Vec<u32>) {
        let (mut own, mut across) = ((vec![], vec![]), (vec![], vec![]));
        for (patch, rest) in self.patches.into_iter().zip(self.rest) {
            let side = if patch.vertices().iter().any(|v| *v >= n) { &mut across } else { &mut own };
            side.0.push(patch);
            side.1.push(rest);
        }
        let mut vertices: Vec<u32> = across.0.iter().flat_map(|patch: &Patch| patch.vertices()).copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        for v in across.0.iter_mut().flat_map(|patch| &mut patch.vertices[..patch.size]) {
            *v = vertices.partition_point(|other| other < v) as u32;
        }
        let of = |(patches, rest)| Self { patches, rest };
        (of(own), of(across), vertices)
    }

    /// As [`Energy::sampled`].
    fn sample(&self, weights: &[f64], index: &[u32]) -> Self {
        let mut weights = weights.iter();
        let (mut patches, mut rest) = (vec![], vec![]);
        for (patch, gradients) in self.patches.iter().zip(&self.rest) {
            let (mut sample, mut at_rest) = (Patch { kept: 0, ..*patch }, *gradients);
            let own = patch.rows().iter().zip(gradients);
            for ((row, gradient), weight) in own.zip(&mut weights).filter(|(_, weight)| **weight != 0.0) {
                sample.rows[sample.kept] = weight.sqrt() * row;
                at_rest[sample.kept] = gradient.map(|g| weight.sqrt() * g);
                sample.kept += 1;
            }
            if sample.kept > 0 {
                sample.vertices[..patch.size].iter_mut().for_each(|v| *v = index[*v as usize]);
                patches.push(sample);
                rest.push(at_rest);
            }
        }
        Self { patches, rest }
    }
}

impl Energy for BendingEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        let mut add = |strains: [f64; 3]| sum += strains.iter().map(|strain| strain * strain).sum::<f64>();
        each_few(&self.patches, x, |few| few.strains(&mut add));
        0.5 * sum
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        let mut add = |patch: &Patch, turns: &Vector3<f64>, slopes: [[Vec3; 4]; 3]| {
            let moments = patch.moments(patch.strains(turns));
            for (k, edge) in patch.edges.iter().enumerate() {
                let Some(edge) = edge else { continue };
                for (place, slope) in edge.places.iter().zip(slopes[k]).filter(|(place, _)| **place != CLAMP) {
                    gradient[patch.vertices[*place as usize] as usize] += moments[k] * slope;
                }
            }
        };
        each_few(&self.patches, x, |few| few.slopes(&mut add));
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        for (patch, rest) in self.patches.iter().zip(&self.rest) {
            rest[..patch.kept].iter().for_each(|row| visit((patch.vertices(), &row[..patch.size])));
        }
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        let mut rooms = Rooms::new();
        let own = |_: &Patch, strains: &dyn Fn() -> [f64; 3]| strains();
        let stress = (curvature == Curvature::Exact).then_some(own);
        each_few(&self.patches, x, |few| few.hessians(&mut rooms, stress, visit));
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        let mut rooms = Rooms::new();
        let mut each = |patch: &Patch, strains: [f64; 3], gradients: &[[Vec3; MOST]; 3]| {
            for (gradient, strain) in gradients.iter().zip(strains).take(patch.kept) {
                visit((patch.vertices(), &gradient[..patch.size]), strain);
            }
        };
        each_few(&self.patches, x, |few| few.gradients(&mut rooms, &mut each));
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let (mut rooms, mut each) = (Rooms::new(), stress.iter());
        let exact = curvature == Curvature::Exact;
        let mut next = |patch: &Patch| patch.next_stress(&mut each).map(|of| if exact { of } else { 0.0 });
        each_few(&self.patches, x, |few| few.curvatures(&mut rooms, &mut next, visit));
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let (mut rooms, mut each) = (Rooms::new(), stress.of.iter());
        let mut given =
            |patch: &Patch, _: &dyn Fn() -> [f64; 3]| patch.next_stress(&mut each).map(|of| stress.share * of);
        each_few(&self.patches, x, |few| few.hessians(&mut rooms, Some(&mut given), visit));
    }

    fn n_membrane(&self) -> usize {
        0
    }

    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        for patch in &self.patches {
            let vertex = |place: u8| if place == CLAMP { NONE } else { patch.vertices[place as usize] };
            let fold = |edge: &Edge| {
                let vertices = edge.places.map(vertex);
                Fold { vertices, corners: vertices.map(|v| rest.get(v as usize).copied().unwrap_or(edge.stays)) }
            };
            let edges = || patch.edges.iter().enumerate().filter_map(|(k, edge)| Some((k, edge.as_ref()?)));
            let folds: Vec<Fold> = edges().map(|(_, edge)| fold(edge)).collect();
            let row = |row: &Vector3<f64>| {
                let mut out = [0.0; 3];
                out.iter_mut().zip(edges()).for_each(|(out, (k, edge))| *out = edge.factor * row[k]);
                out
            };
            let rows: Vec<[f64; 3]> = patch.rows().iter().map(row).collect();
            visit(Term::Bend(&folds, &rows));
        }
        true
    }

    fn n_elements(&self) -> usize {
        self.patches.iter().map(|patch| patch.kept).sum()
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        Box::new(self.sample(weights, index))
    }
}

//! Planes of symmetry: what an element has beyond such a plane is the mirror image of what is on this side.
//!
//! An element that reaches across is made of points of its own, of which some are images x′ = x − 2 (n·x − c) n of a vertex. With H = 1 − 2nnᵀ what
//! it has at an image goes to the vertex: a gradient g as Hg, a block B of the Hessian as HB or BH, and as HBH between two images.

use super::bending::BendingEnergy;
use super::hinge::HingeEnergy;
use super::{Curvature, ElementHessian, Energy, MAX_ELEMENT, Mat3, RestRow, Source, Stress, Term};
use crate::material::{lay_out, sides};
use crate::mesh::{Edge, NONE};
use crate::{Mesh, Vec3};

/// An edge of one triangle on a plane of symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Its ends, ascending.
    pub ends: [u32; 2],
    /// Of the plane: of length 1.
    pub normal: Vec3,
    /// Where the plane is: normal · x of its points.
    pub offset: f64,
}

impl Mirror {
    /// The same plane moved to where this edge is in another shape.
    pub fn at(&self, x: &[Vec3], given: &[Vec3]) -> Self {
        let [a, b] = self.ends.map(|v| v as usize);
        match [x[a], x[b]] == [given[a], given[b]] {
            true => *self,
            false => Self { offset: self.normal.dot(&(0.5 * (x[a] + x[b]))), ..*self },
        }
    }

    /// Of a point.
    pub fn image(&self, x: &Vec3) -> Vec3 {
        x - 2.0 * (self.normal.dot(x) - self.offset) * self.normal
    }

    /// H.
    pub fn turn(&self) -> Mat3 {
        Mat3::identity() - 2.0 * self.normal * self.normal.transpose()
    }
}

/// Of an edge with these ends; `mirrors` ascend by theirs.
pub fn mirror_at(mirrors: &[Mirror], [a, b]: [u32; 2]) -> Option<&Mirror> {
    let ends = [a.min(b), a.max(b)];
    mirrors.binary_search_by_key(&ends, |mirror| mirror.ends).ok().map(|at| &mirrors[at])
}

/// A vertex, or its image.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) vertex: u32,
    pub(super) plane: Option<Mirror>,
}

impl Point {
    fn place(&self, x: &[Vec3]) -> Vec3 {
        let own = &x[self.vertex as usize];
        self.plane.map_or(*own, |plane| plane.image(own))
    }

    /// What is at it as the vertex has it.
    fn back(&self, slope: &Vec3) -> Vec3 {
        self.plane.map_or(*slope, |plane| slope - 2.0 * plane.normal.dot(slope) * plane.normal)
    }
}

/// What an edge on a plane has of l̄/h̄ by its lengths without stress, over that of the mesh: l²/A.
fn grown(source: &Source, edge: &Edge) -> f64 {
    let Some(metric) = source.metric else { return 1.0 };
    let ([a, b], c) = (edge.vertices, edge.opposite[0]);
    let mesh = source.mesh;
    let corners = [a, b, c].map(|v| mesh.positions[v as usize]);
    let lengths = sides(&[a, b, c]).map(|ends| metric.length(mesh, ends));
    let share = |[a, b, c]: [Vec3; 3]| (b - a).norm_squared() / (b - a).cross(&(c - a)).norm();
    share(lay_out(corners, lengths)) / share(corners)
}

/// Elements that reach across planes of symmetry.
pub struct MirroredEnergy {
    /// On points in place of vertices.
    inner: Box<dyn Energy>,
    points: Vec<Point>,
}

impl MirroredEnergy {
    pub(super) fn new(inner: Box<dyn Energy>, points: Vec<Point>) -> Self {
        Self { inner, points }
    }

    /// Half of the paper's hinge over each edge on a plane: the other half is the image's. `k` is the constant of an edge, by number.
    pub(super) fn hinges(source: &Source, k: impl Fn(usize) -> f64) -> Self {
        let mesh = source.mesh;
        let (mut points, mut places, mut edges, mut constants) = (vec![], vec![], vec![], vec![]);
        for (e, edge) in mesh.edges.iter().enumerate().filter(|(_, edge)| !edge.is_interior()) {
            let Some(plane) = mirror_at(source.mirrors, edge.vertices) else { continue };
            let ([a, b], c) = (edge.vertices, edge.opposite[0]);
            let first = points.len() as u32;
            points.extend([a, b, c].map(|vertex| Point { vertex, plane: None }));
            points.push(Point { vertex: c, plane: Some(*plane) });
            places.extend([a, b, c].map(|v| mesh.positions[v as usize]));
            places.push(plane.at(&mesh.positions, source.given).image(&mesh.positions[c as usize]));
            edges.push(Edge { vertices: [first, first + 1], opposite: [first + 2, first + 3] });
            constants.push(0.5 * grown(source, edge) * k(e));
        }
        let apart = Mesh { positions: places, triangles: vec![], edges, component: vec![], ..Mesh::clone(mesh) };
        Self::new(Box::new(HingeEnergy::varying(&apart, &constants)), points)
    }

    /// Parts the triangles of `bending` that have images, which are its vertices from `n_vertices` on, from the others.
    pub(super) fn part(bending: BendingEnergy, n_vertices: usize, images: &[(u32, Mirror)]) -> Vec<Box<dyn Energy>> {
        if images.is_empty() {
            return vec![Box::new(bending)];
        }
        let (others, across, vertices) = bending.part(n_vertices as u32);
        let point = |v: u32| match (v as usize).checked_sub(n_vertices) {
            None => Point { vertex: v, plane: None },
            Some(k) => Point { vertex: images[k].0, plane: Some(images[k].1) },
        };
        vec![Box::new(others), Box::new(Self::new(Box::new(across), vertices.into_iter().map(point).collect()))]
    }

    fn places(&self, x: &[Vec3]) -> Vec<Vec3> {
        self.points.iter().map(|point| point.place(x)).collect()
    }

    /// The vertices of an element, each once, and which of them each of its points is.
    fn vertices(&self, of: &[u32]) -> ([u32; MAX_ELEMENT], usize, [usize; MAX_ELEMENT]) {
        let (mut vertices, mut slots, mut size) = ([NONE; MAX_ELEMENT], [0; MAX_ELEMENT], 0);
        for (slot, point) in slots.iter_mut().zip(of) {
            let vertex = self.points[*point as usize].vertex;
            *slot = vertices[..size].iter().position(|v| *v == vertex).unwrap_or(size);
            vertices[*slot] = vertex;
            size = size.max(*slot + 1);
        }
        (vertices, size, slots)
    }

    fn row(&self, (of, row): RestRow, visit: &mut dyn FnMut(RestRow)) {
        let (vertices, size, slots) = self.vertices(of);
        let mut out = [Vec3::zeros(); MAX_ELEMENT];
        for ((slot, point), slope) in slots.iter().zip(of).zip(row) {
            out[*slot] += self.points[*point as usize].back(slope);
        }
        visit((&vertices[..size], &out[..size]));
    }

    fn blocks(&self, (of, blocks): ElementHessian, visit: &mut dyn FnMut(ElementHessian)) {
        let (vertices, size, slots) = self.vertices(of);
        let mut out = [Mat3::zeros(); MAX_ELEMENT * MAX_ELEMENT];
        let turn = |point: u32| self.points[point as usize].plane.map(|plane| plane.turn());
        for (ij, block) in blocks.iter().enumerate() {
            let (i, j) = (ij / of.len(), ij % of.len());
            let left = turn(of[i]).map_or(*block, |turn| turn * block);
            out[slots[i] * size + slots[j]] += turn(of[j]).map_or(left, |turn| left * turn);
        }
        visit((&vertices[..size], &out[..size * size]));
    }
}

impl Energy for MirroredEnergy {
    fn value(&self, x: &[Vec3]) -> f64 {
        self.inner.value(&self.places(x))
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        let mut own = vec![Vec3::zeros(); self.points.len()];
        self.inner.add_gradient(&self.places(x), &mut own);
        self.points.iter().zip(&own).for_each(|(point, g)| gradient[point.vertex as usize] += point.back(g));
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        self.inner.visit_rest_rows(&mut |row| self.row(row, visit));
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        self.inner.visit_hessian(&self.places(x), curvature, &mut |element| self.blocks(element, visit));
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        let places = self.places(x);
        self.inner.visit_strains(&places, &mut |row, strain| self.row(row, &mut |row| visit(row, strain)));
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let places = self.places(x);
        self.inner.visit_stress_hessian(&places, stress, curvature, &mut |element| self.blocks(element, visit));
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        self.inner.visit_mixed_hessian(&self.places(x), stress, &mut |element| self.blocks(element, visit));
    }

    fn n_membrane(&self) -> usize {
        self.inner.n_membrane()
    }

    fn n_elements(&self) -> usize {
        self.inner.n_elements()
    }

    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        let places = self.places(rest);
        let mut number: Vec<u32> = vec![];
        let mut images = rest.len() as u32;
        for point in &self.points {
            number.push(match &point.plane {
                None => point.vertex,
                Some(plane) => {
                    visit(Term::Image(point.vertex, plane));
                    images += 1;
                    images - 1
                }
            });
        }
        self.inner.visit_terms(&places, &mut |term| match term {
            Term::Bend(folds, rows) => {
                let named = |v: u32| number.get(v as usize).copied().unwrap_or(NONE);
                let folds: Vec<_> =
                    folds.iter().map(|fold| super::Fold { vertices: fold.vertices.map(named), ..*fold }).collect();
                visit(Term::Bend(&folds, rows));
            }
            other => visit(other),
        })
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let mut used = vec![false; self.points.len()];
        let mut weight = weights.iter();
        self.inner.visit_rest_rows(&mut |(points, _)| {
            if weight.next().is_some_and(|weight| *weight != 0.0) {
                points.iter().for_each(|point| used[*point as usize] = true);
            }
        });
        let mut numbers = vec![NONE; used.len()];
        let mut points = vec![];
        for (k, point) in self.points.iter().enumerate().filter(|(k, _)| used[*k]) {
            numbers[k] = points.len() as u32;
            points.push(Point { vertex: index[point.vertex as usize], ..*point });
        }
        Box::new(Self::new(self.inner.sampled(weights, &numbers), points))
    }
}

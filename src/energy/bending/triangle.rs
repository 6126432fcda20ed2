//! A triangle that bends, with what is beyond its edges: its strains and their derivatives, one at a time.

use super::super::fold_over::fold_over;
use super::super::hinge::{
    add_letting_go, angle_curvature, angle_gradient, dihedral_angle, normals, presence, small, small_of,
    wrapped_difference,
};
use super::super::mirror::Mirror;
use super::super::patch::Beyond;
use super::super::{ElementHessian, MAX_ELEMENT as MOST, Mat3};
use super::lanes::SLOTS;
use super::{Doubled, Edges};
use crate::mesh::NONE;
use crate::{Mesh, Vec3};
use nalgebra::{Matrix3, Vector3};

pub const CLAMP: u8 = u8::MAX;

/// A triangle with what is beyond its edges, and those of its elements that count.
#[derive(Clone, Copy)]
pub struct Patch {
    pub vertices: [u32; MOST],
    /// How many vertices, and elements.
    pub size: usize,
    pub kept: usize,
    pub edges: [Option<Edge>; 3],
    /// Each element by the angles at the edges.
    pub rows: [Vector3<f64>; 3],
    /// Of the corners, and of what is beyond each edge, where that is among the vertices, or [`CLAMP`]; none where two edges have the same beyond.
    pub slots: Option<[u8; SLOTS]>,
}

/// An edge of a patch.
#[derive(Clone, Copy)]
pub struct Edge {
    /// Where in the patch its ends and the opposite corners are; [`CLAMP`] for a corner that stays.
    pub places: [u8; 4],
    pub rest_angle: f64,
    /// (2 Ā/100)² of the two triangles.
    pub small: [f64; 2],
    /// The corner that stays, of a clamp.
    pub stays: Vec3,
    /// 2 at a clamp.
    pub factor: f64,
}

/// An edge in a shape.
#[derive(Clone, Copy, Default)]
pub struct Bend {
    pub corners: [Vec3; 4],
    /// φ₁φ₂, by the factor.
    pub share: f64,
    /// f(θ − θ̄), and its first two derivatives.
    pub turn: [f64; 3],
}

impl Patch {
    /// Adds the images beyond planes of symmetry to `images`. `areas` are twice those of the triangles at each edge, if not those of the mesh.
    pub fn new(
        mesh: &Mesh,
        of: &Edges,
        (triangle, beyond, areas): (&[u32; 3], &[Beyond; 3], Option<Doubled>),
        elements: &Matrix3<f64>,
        images: &mut Vec<(u32, Mirror)>,
    ) -> Self {
        let mut vertices = [NONE; MOST];
        vertices[..3].copy_from_slice(triangle);
        let mut size = 3;
        let mut place = |v: u32| {
            let known = vertices[..size].iter().position(|other| *other == v);
            known.unwrap_or_else(|| {
                vertices[size] = v;
                size += 1;
                size - 1
            }) as u8
        };
        let edges: [Option<Edge>; 3] = std::array::from_fn(|k| {
            let places = [(k + 1) % 3, (k + 2) % 3, k].map(|place| place as u8);
            let corners_in = |x: &[Vec3]| places.map(|place| x[triangle[place as usize] as usize]);
            let (last, [a, b, c], d) = match beyond[k] {
                Beyond::Free => return None,
                Beyond::Clamp => (CLAMP, corners_in(of.given), mirrored(corners_in(of.given))),
                Beyond::Vertex { corner: v, .. } => (place(v), corners_in(&mesh.positions), mesh.positions[v as usize]),
                Beyond::Image(plane) => {
                    let (plane, corners) = (plane.at(&mesh.positions, of.given), corners_in(&mesh.positions));
                    images.push((triangle[k], plane));
                    (place((mesh.positions.len() + images.len() - 1) as u32), corners, plane.image(&corners[2]))
                }
            };
            let corners = [a, b, c, d];
            let crease = of.creases.at([places[0], places[1]].map(|place| triangle[place as usize]));
            let own = crease.filter(|_| last != CLAMP).and_then(|crease| crease.angle);
            Some(Edge {
                places: [places[0], places[1], places[2], last],
                rest_angle: own.unwrap_or_else(|| dihedral_angle(&corners)),
                small: areas.map_or_else(|| small(&corners), |of| of[k].map(small_of)),
                stays: d,
                factor: if last == CLAMP { 2.0 } else { 1.0 },
            })
        });
        let rows = std::array::from_fn(|i| elements.row(i).transpose());
        let beyond = edges.each_ref().map(|edge| edge.as_ref().map_or(CLAMP, |edge| edge.places[3]));
        let [a, b, c] = beyond;
        let same = |p: u8, q: u8| p == q && p != CLAMP;
        let slots = [0, 1, 2, a, b, c];
        let slots = (!same(a, b) && !same(b, c) && !same(c, a)).then_some(slots);
        Self { vertices, size, kept: 3, edges, rows, slots }
    }

    pub fn vertices(&self) -> &[u32] {
        &self.vertices[..self.size]
    }

    pub fn rows(&self) -> &[Vector3<f64>] {
        &self.rows[..self.kept]
    }

    /// Of an edge.
    #[inline(always)]
    pub fn corners(&self, edge: &Edge, x: &[Vec3]) -> [Vec3; 4] {
        let of = |place: u8| x[self.vertices[place as usize] as usize];
        let [a, b, c, d] = edge.places;
        [of(a), of(b), of(c), if d == CLAMP { edge.stays } else { of(d) }]
    }

    /// Of the elements that count, the next ones.
    pub fn next_stress<'a>(&self, each: &mut impl Iterator<Item = &'a f64>) -> [f64; 3] {
        let mut own = [0.0; 3];
        own.iter_mut().take(self.kept).zip(each).for_each(|(own, of)| *own = *of);
        own
    }

    /// At the three edges; none of a free one.
    pub fn bends(&self, x: &[Vec3]) -> [Bend; 3] {
        self.edges.each_ref().map(|edge| {
            let Some(edge) = edge else { return Bend::default() };
            let corners = self.corners(edge, x);
            let turn = fold_over(wrapped_difference(dihedral_angle(&corners), edge.rest_angle));
            let (n1, n2) = normals(&corners);
            let there = |n: Vec3, small: f64| presence(n.norm_squared() / small);
            Bend { corners, share: edge.factor * there(n1, edge.small[0]) * there(n2, edge.small[1]), turn }
        })
    }

    /// ε of the elements that count, and 0, of what the edges turn.
    pub fn strains(&self, turns: &Vector3<f64>) -> [f64; 3] {
        std::array::from_fn(|i| if i < self.kept { self.rows[i].dot(turns) } else { 0.0 })
    }

    /// What stresses of the elements that count do at the edges.
    pub fn moments(&self, stress: [f64; 3]) -> Vector3<f64> {
        self.rows().iter().zip(stress).map(|(row, stress)| stress * row).sum()
    }

    /// ∂(φ₁φ₂ f) of an edge by its corners, by the factor.
    pub fn slope(edge: &Edge, bend: &Bend) -> [Vec3; 4] {
        let mut gradient = angle_gradient(&bend.corners);
        let share = bend.share / edge.factor;
        if share < 1.0 || bend.turn[1] != 1.0 {
            gradient.iter_mut().for_each(|g| *g *= share * bend.turn[1]);
            add_letting_go(&bend.corners, &edge.small, bend.turn[0], &mut gradient);
        }
        gradient.map(|g| edge.factor * g)
    }

    /// ∇ε of the elements, by vertex.
    pub fn gradients(&self, bends: &[Bend; 3]) -> [[Vec3; MOST]; 3] {
        let mut gradients = [[Vec3::zeros(); MOST]; 3];
        for (k, (edge, bend)) in self.edges.iter().zip(bends).enumerate() {
            let Some(edge) = edge else { continue };
            for (place, slope) in edge.places.iter().zip(Self::slope(edge, bend)).filter(|(place, _)| **place != CLAMP)
            {
                for (gradient, row) in gradients.iter_mut().zip(self.rows()) {
                    gradient[*place as usize] += row[k] * slope;
                }
            }
        }
        gradients
    }

    /// ∂²f at the edges; 0 at a free one.
    pub fn curvatures(&self, bends: &[Bend; 3]) -> [[Mat3; 16]; 3] {
        std::array::from_fn(|k| match self.edges[k] {
            Some(_) => {
                let (mut blocks, [_, rate, bow]) = (angle_curvature(&bends[k].corners), bends[k].turn);
                if rate != 1.0 {
                    let gradient = angle_gradient(&bends[k].corners);
                    for (ij, block) in blocks.iter_mut().enumerate() {
                        *block = rate * *block + bow * gradient[ij / 4] * gradient[ij % 4].transpose();
                    }
                }
                blocks
            }
            None => [Mat3::zeros(); 16],
        })
    }

    /// blocks += Σ m ∂²f over the edges, of moments m.
    pub fn add_curvature(
        &self,
        bends: &[Bend; 3],
        curvatures: &[[Mat3; 16]; 3],
        moments: &Vector3<f64>,
        blocks: &mut [Mat3],
    ) {
        for (k, (edge, bend)) in self.edges.iter().zip(bends).enumerate() {
            let Some(edge) = edge else { continue };
            let moment = moments[k] * bend.share;
            for (ij, block) in curvatures[k].iter().enumerate() {
                let (i, j) = (edge.places[ij / 4], edge.places[ij % 4]);
                if i != CLAMP && j != CLAMP {
                    blocks[i as usize * self.size + j as usize] += moment * block;
                }
            }
        }
    }

    /// Hands Σ ∇ε∇εᵀ + σ ∂²ε over the elements to `visit`; without σ the first part.
    pub fn visit_hessian(&self, bends: &[Bend; 3], stress: Option<[f64; 3]>, visit: &mut dyn FnMut(ElementHessian)) {
        let mut room = [Mat3::zeros(); MOST * MOST];
        let blocks = &mut room[..self.size * self.size];
        if let Some(stress) = stress {
            self.add_curvature(bends, &self.curvatures(bends), &self.moments(stress), blocks);
        }
        for gradient in &self.gradients(bends)[..self.kept] {
            for (ij, block) in blocks.iter_mut().enumerate() {
                *block += gradient[ij / self.size] * gradient[ij % self.size].transpose();
            }
        }
        visit((self.vertices(), blocks));
    }

    /// Hands Σ σ ∂²ε over the elements to `visit`.
    pub fn visit_curvature(&self, bends: &[Bend; 3], stress: [f64; 3], visit: &mut dyn FnMut(ElementHessian)) {
        let mut room = [Mat3::zeros(); MOST * MOST];
        let blocks = &mut room[..self.size * self.size];
        self.add_curvature(bends, &self.curvatures(bends), &self.moments(stress), blocks);
        visit((self.vertices(), blocks));
    }
}

/// The third corner of a triangle mirrored in its plane at the first two.
fn mirrored([a, b, c]: [Vec3; 3]) -> Vec3 {
    let edge = b - a;
    let foot = a + edge * ((c - a).dot(&edge) / edge.norm_squared());
    2.0 * foot - c
}

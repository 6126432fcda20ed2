//! Lengths without stress that no positions need to have: of a leaf whose rim grew, of a strip that was heated.
//!
//! Each triangle is laid out flat by its three lengths. Angles between triangles are told by the mesh or by creases.

use super::Map;
use crate::error::{Error, Result};
use crate::mesh::ZERO_AREA;
use crate::{Mesh, Vec3};
use nalgebra::Vector2;
use std::collections::HashMap;

/// How long an edge is without stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestLength {
    /// Ends of the edge, in either order.
    pub vertices: [u32; 2],
    /// Positive.
    pub length: f64,
}

/// Lengths of all edges without stress, where they are not those of the mesh or the rest shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Metric {
    /// By the mesh's edges.
    pub lengths: Vec<f64>,
    /// Corners of each triangle laid out by its lengths, near where it is (n_triangles).
    pub corners: Vec<[Vec3; 3]>,
}

impl Metric {
    /// Of a mesh whose positions are those of the shape without stress. Edges have their length there times the `growth` of their ends or triangles;
    /// those named in `lengths` have that. `None` where no length is another.
    pub fn new(mesh: &Mesh, growth: Option<&Map>, lengths: &[RestLength]) -> Result<Option<Self>> {
        if growth.is_none() && lengths.is_empty() {
            return Ok(None);
        }
        let before: Vec<f64> = mesh.edges.iter().map(|e| distance(mesh, e.vertices)).collect();
        let mut after = before.clone();
        if let Some(map) = growth {
            after.iter_mut().zip(map.by_edge(mesh)).for_each(|(length, factor)| *length *= factor);
        }
        let mut named: HashMap<usize, usize> = HashMap::new();
        for (i, RestLength { vertices: [a, b], length }) in lengths.iter().enumerate() {
            let Some(edge) = edge_at(mesh, [*a, *b]) else {
                let message = format!("rest length {i} is of the edge {a}-{b}, which the mesh does not have");
                return Err(Error::argument(message));
            };
            if !(length.is_finite() && *length > 0.0) {
                let message = format!("rest length {i}, of the edge {a}-{b}, is {length:?}: it must be positive");
                return Err(Error::argument(message));
            }
            if let Some(other) = named.insert(edge, i) {
                return Err(Error::argument(format!("rest lengths {other} and {i} are of the same edge {a}-{b}")));
            }
            after[edge] = *length;
        }
        if after == before {
            return Ok(None);
        }
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let sides = sides(triangle).map(|ends| edge_at(mesh, ends).map_or(f64::NAN, |e| after[e]));
            if !is_triangle(sides) {
                let ([a, b, c], [x, y, z]) = (*triangle, sides);
                let message = format!(
                    "triangle {t} has the lengths {x:e} of {a}-{b}, {y:e} of {b}-{c} and {z:e} of {c}-{a} without stress: \
                    each must be shorter than the other two together"
                );
                return Err(Error::argument(message));
            }
            corners.push(lay_out(triangle.map(|v| mesh.positions[v as usize]), sides));
        }
        Ok(Some(Self { lengths: after, corners }))
    }

    /// Length of an edge of the mesh.
    pub fn length(&self, mesh: &Mesh, ends: [u32; 2]) -> f64 {
        edge_at(mesh, ends).map_or(f64::NAN, |e| self.lengths[e])
    }

    /// Of a triangle.
    pub fn area(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners[t];
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// That of the `part` of a mesh with these vertices and triangles (ascending), which are numbered anew in their order.
    pub fn part(&self, mesh: &Mesh, (vertices, triangles): (&[u32], &[u32]), part: &Mesh) -> Self {
        let lengths = part.edges.iter().map(|e| self.length(mesh, e.vertices.map(|v| vertices[v as usize])));
        Self { lengths: lengths.collect(), corners: triangles.iter().map(|t| self.corners[*t as usize]).collect() }
    }
}

fn distance(mesh: &Mesh, [a, b]: [u32; 2]) -> f64 {
    (mesh.positions[b as usize] - mesh.positions[a as usize]).norm()
}

fn edge_at(mesh: &Mesh, [a, b]: [u32; 2]) -> Option<usize> {
    let ends = [a.min(b), a.max(b)];
    let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    mesh.edges.binary_search_by_key(&ends, |edge| ordered(edge.vertices)).ok()
}

/// Ends of a triangle's sides: from the first to the second corner, and so on.
pub fn sides([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

/// Twice the area of a triangle with sides of these lengths, over the square of the longest; not above 0 where there is none.
/// By Kahan's form of Heron's formula, which is exact to rounding for slivers, too.
fn shape(sides: [f64; 3]) -> f64 {
    let longest = sides.into_iter().fold(0.0, f64::max);
    let mut units = sides.map(|side| side / longest);
    units.sort_by(|a, b| b.total_cmp(a));
    let [a, b, c] = units;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.5 * product.max(0.0).sqrt()
}

/// Whether there is a triangle that is as good as one of a mesh must be.
fn is_triangle(sides: [f64; 3]) -> bool {
    0.5 * shape(sides) > ZERO_AREA
}

/// A triangle with sides of these lengths ([`sides`]) in the plane of the one with these corners, placed and turned as near to it as can be; that itself where
/// it has these lengths.
pub fn lay_out(corners: [Vec3; 3], lengths: [f64; 3]) -> [Vec3; 3] {
    let [a, b, c] = corners;
    if [b - a, c - b, a - c].map(|side| side.norm()) == lengths {
        return corners;
    }
    let (first, normal) = ((b - a).normalize(), (b - a).cross(&(c - a)).normalize());
    let second = normal.cross(&first);
    let middle = (a + b + c) / 3.0;
    let there = corners.map(|x| Vector2::new((x - middle).dot(&first), (x - middle).dot(&second)));
    let flat = flat(lengths);
    let mean = (flat[0] + flat[1] + flat[2]) / 3.0;
    let own = flat.map(|x| x - mean);
    // The turn of the least squares.
    let (mut along, mut across) = (0.0, 0.0);
    for (p, q) in own.iter().zip(&there) {
        along += p.dot(q);
        across += p.x * q.y - p.y * q.x;
    }
    let size = libm::hypot(along, across);
    let (cos, sin) = (along / size, across / size);
    own.map(|p| middle + (cos * p.x - sin * p.y) * first + (sin * p.x + cos * p.y) * second)
}

/// A triangle with sides of these lengths in the plane, counter-clockwise, the first along x from the origin.
fn flat(lengths: [f64; 3]) -> [Vector2<f64>; 3] {
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let [first, across, back] = lengths.map(|length| length / longest);
    let x = 0.5 * (first + (back - across) * (back + across) / first);
    let y = shape(lengths) / first;
    [Vector2::zeros(), Vector2::new(longest * first, 0.0), longest * Vector2::new(x, y)]
}

/// Two triangles on an edge, unfolded into the plane: the ends, the corner above and the one below, by the lengths of the edge, of the sides from its first end to
/// these corners, and of those from its second.
pub fn unfolded(edge: f64, [first, second]: [[f64; 2]; 2]) -> [Vec3; 4] {
    let above = flat([edge, second[0], first[0]])[2];
    let below = flat([edge, second[1], first[1]])[2];
    let lift = |p: Vector2<f64>| Vec3::new(p.x, p.y, 0.0);
    [Vec3::zeros(), Vec3::new(edge, 0.0, 0.0), lift(above), lift(Vector2::new(below.x, -below.y))]
}

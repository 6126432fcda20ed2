//! Ties: vertices held together with others, or with points of triangles: seams, straps, buttons.
//!
//! Each holds a vertex where it is beside a triangle in the mesh that was given: at a point of its plane, by weights of its corners, and at a
//! height over it. So an offset turns with the triangle. Two vertices at one place are held together as points.

use crate::error::{Error, Result};
use crate::mesh::{NONE, UnionFind};
use crate::{Mesh, Vec3};
use std::collections::HashMap;

/// Vertices nearer than this, in sizes of the mesh, are at one place.
const TOGETHER: f64 = 1e-9;

/// What a vertex is tied to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TiedTo {
    /// A vertex: where it is elsewhere, the first triangle at it carries the offset.
    Vertex(u32),
    /// A triangle, by its number.
    Triangle(u32),
}

/// Holds a vertex where it is beside another, or beside a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The vertex.
    pub vertex: u32,
    /// What it is tied to.
    pub to: TiedTo,
    /// Force per length; 0 is stiff: a thousand times the shell's own at the stiffer end.
    pub stiffness: f64,
}

/// A tie in numbers: x_v − Σ w x − h n keeps at zero, n the triangle's unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bond {
    /// v.
    pub vertex: u32,
    /// The triangle's, or thrice the one vertex.
    pub corners: [u32; 3],
    /// w, of sum 1.
    pub weights: [f64; 3],
    /// h.
    pub height: f64,
    /// Force per length, or 0.
    pub stiffness: f64,
}

impl Bond {
    /// Whether it joins two points, with no triangle to carry an offset.
    pub fn joins_points(&self) -> bool {
        self.corners[0] == self.corners[1]
    }

    /// Whether it is one of a mesh.
    pub fn is_sound(&self, mesh: &Mesh) -> bool {
        let used = |v: u32| mesh.component.get(v as usize).is_some_and(|c| *c != NONE);
        let [a, b, c] = self.corners;
        let distinct = a != b && b != c && c != a && self.corners.iter().all(|v| *v != self.vertex);
        let points = a == b && b == c && a != self.vertex && self.height == 0.0 && self.weights == [1.0, 0.0, 0.0];
        let sum: f64 = self.weights.iter().sum();
        let numbers = [self.height, self.stiffness].iter().all(|x| x.is_finite()) && self.stiffness >= 0.0;
        self.vertices().all(used)
            && (distinct || points)
            && numbers
            && (sum - 1.0).abs() <= 1e-6 * (1.0 + self.weights[1].abs())
    }

    /// Its vertices.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        let corners = self.corners;
        std::iter::once(self.vertex).chain(corners.into_iter().take(if self.joins_points() { 1 } else { 3 }))
    }
}

/// The ties in numbers, checked for a mesh.
pub fn bonds(ties: &[Tie], mesh: &Mesh) -> Result<Vec<Bond>> {
    let first = first_triangles(ties, mesh);
    ties.iter().enumerate().map(|(i, tie)| bond(i, tie, mesh, &first)).collect()
}

/// The first triangle at each vertex that is tied to.
fn first_triangles(ties: &[Tie], mesh: &Mesh) -> HashMap<u32, u32> {
    let mut first = HashMap::new();
    if ties.iter().any(|tie| matches!(tie.to, TiedTo::Vertex(_))) {
        for (t, corners) in mesh.triangles.iter().enumerate() {
            corners.iter().for_each(|v| {
                first.entry(*v).or_insert(t as u32);
            });
        }
    }
    first
}

fn bond(i: usize, tie: &Tie, mesh: &Mesh, first: &HashMap<u32, u32>) -> Result<Bond> {
    let Tie { vertex, to, stiffness } = *tie;
    let (n, t) = (mesh.positions.len(), mesh.triangles.len());
    let refused = |what: String| Err(Error::argument(format!("tie {i} of vertex {vertex} {what}")));
    let used = |v: u32| mesh.component.get(v as usize).is_some_and(|c| *c != NONE);
    if vertex as usize >= n {
        return refused(format!("is of none: the mesh has {n} vertices"));
    }
    if !used(vertex) {
        return refused("is of one that no triangle uses".into());
    }
    if !(stiffness.is_finite() && stiffness >= 0.0) {
        return refused(format!("has the stiffness {stiffness:?}: it must be finite and not negative"));
    }
    let x = mesh.positions[vertex as usize];
    let triangle = match to {
        TiedTo::Vertex(v) if v as usize >= n => return refused(format!("is to vertex {v}, but the mesh has {n}")),
        TiedTo::Vertex(v) if v == vertex => return refused("is to itself".into()),
        TiedTo::Vertex(v) if !used(v) => return refused(format!("is to vertex {v}, which no triangle uses")),
        TiedTo::Vertex(v) if (mesh.positions[v as usize] - x).norm() <= TOGETHER * mesh.size => {
            return Ok(Bond { vertex, corners: [v; 3], weights: [1.0, 0.0, 0.0], height: 0.0, stiffness });
        }
        TiedTo::Vertex(v) => first[&v],
        TiedTo::Triangle(k) if k as usize >= t => {
            return refused(format!("is to triangle {k}, but the mesh has {t} triangles"));
        }
        TiedTo::Triangle(k) => k,
    };
    let corners = mesh.triangles[triangle as usize];
    if corners.contains(&vertex) {
        return refused(format!("is to triangle {triangle}, of which it is a corner"));
    }
    let (weights, height) = beside(&corners.map(|v| mesh.positions[v as usize]), x);
    if !weights.iter().chain([&height]).all(|x| x.is_finite()) {
        return refused(format!("is too far from triangle {triangle}"));
    }
    Ok(Bond { vertex, corners, weights, height, stiffness })
}

/// Weights of the corners at the foot of `x` on a triangle's plane, and its height over that.
fn beside([a, b, c]: &[Vec3; 3], x: Vec3) -> ([f64; 3], f64) {
    let normal = (b - a).cross(&(c - a));
    let square = normal.norm_squared();
    let of_b = (x - a).cross(&(c - a)).dot(&normal) / square;
    let of_c = (b - a).cross(&(x - a)).dot(&normal) / square;
    ([1.0 - of_b - of_c, of_b, of_c], (x - a).dot(&normal) / square.sqrt())
}

/// The mesh with components that are tied as one.
pub fn joined(mesh: Mesh, bonds: &[Bond]) -> Mesh {
    let mut sets = UnionFind::new(mesh.n_components);
    let of = |v: u32| mesh.component[v as usize];
    bonds.iter().for_each(|bond| bond.vertices().for_each(|v| sets.join(of(bond.vertex), of(v))));
    let mut number = vec![NONE; mesh.n_components];
    let mut count = 0;
    let renumbered = (0..mesh.n_components as u32).map(|c| {
        let root = sets.find(c) as usize;
        if number[root] == NONE {
            number[root] = count;
            count += 1;
        }
        number[root]
    });
    let renumbered: Vec<u32> = renumbered.collect();
    let component = mesh.component.iter().map(|c| renumbered.get(*c as usize).copied().unwrap_or(NONE)).collect();
    Mesh { component, n_components: count as usize, ..mesh }
}

/// Ties of what touches: of two components within `distance` of each other, the vertices of the one that has more of them so near are tied to
/// the nearest triangles of the other.
pub fn touching(mesh: &Mesh, distance: f64) -> Result<Vec<Tie>> {
    if !(distance.is_finite() && distance >= 0.0) {
        return Err(Error::argument(format!("tie_distance is {distance:?}: it must be finite and not negative")));
    }
    if distance == 0.0 || mesh.n_components < 2 {
        return Ok(vec![]);
    }
    let grid = Grid::new(mesh, distance);
    // By pair of components, from the one to the other.
    let mut near: HashMap<[u32; 2], Vec<Tie>> = HashMap::new();
    for v in (0..mesh.positions.len() as u32).filter(|v| mesh.component[*v as usize] != NONE) {
        let own = mesh.component[v as usize];
        let mut nearest: HashMap<u32, (f64, u32)> = HashMap::new();
        grid.visit(mesh.positions[v as usize], |t| {
            let corners = mesh.triangles[t as usize];
            let other = mesh.component[corners[0] as usize];
            let away = distance_to(&corners.map(|v| mesh.positions[v as usize]), mesh.positions[v as usize]);
            if other != own && away <= distance {
                let best = nearest.entry(other).or_insert((f64::INFINITY, 0));
                *best = if (away, t) < *best { (away, t) } else { *best };
            }
        });
        for (other, (_, t)) in nearest {
            near.entry([own, other]).or_default().push(Tie { vertex: v, to: TiedTo::Triangle(t), stiffness: 0.0 });
        }
    }
    let count = |from: u32, to: u32| near.get(&[from, to]).map_or(0, Vec::len);
    let tied =
        |[from, to]: [u32; 2]| count(from, to) > count(to, from) || (count(from, to) == count(to, from) && from > to);
    let mut ties: Vec<Tie> = near.iter().filter(|(pair, _)| tied(**pair)).flat_map(|(_, ties)| ties.clone()).collect();
    ties.sort_by_key(|tie| (tie.vertex, tie.number_tied_to()));
    Ok(ties)
}

impl Tie {
    fn number_tied_to(&self) -> u32 {
        match self.to {
            TiedTo::Vertex(v) | TiedTo::Triangle(v) => v,
        }
    }
}

/// Distance of `x` to a triangle.
fn distance_to(corners: &[Vec3; 3], x: Vec3) -> f64 {
    let (weights, height) = beside(corners, x);
    if weights.iter().all(|w| *w >= 0.0) {
        return height.abs();
    }
    let to_edge = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let along = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (x - a - along * (b - a)).norm()
    };
    (0..3).map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Triangles by the cells that they may be near.
struct Grid {
    low: Vec3,
    width: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

/// Cells across the mesh at most, so that a small distance does not cut large triangles into millions.
const FINEST: f64 = 64.0;

impl Grid {
    fn new(mesh: &Mesh, distance: f64) -> Self {
        let used = || mesh.triangles.iter().flatten().map(|v| mesh.positions[*v as usize]);
        let low = used().fold(Vec3::repeat(f64::INFINITY), |low, x| low.inf(&x));
        let extent: f64 = (0..mesh.triangles.len()).map(|t| mesh.area(t).sqrt()).sum::<f64>();
        let width = distance.max(extent / mesh.triangles.len() as f64).max(mesh.size / FINEST);
        let mut grid = Self { low, width, cells: HashMap::new() };
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let x = corners.map(|v| mesh.positions[v as usize]);
            let reach = Vec3::repeat(distance);
            let [first, last] =
                [x[0].inf(&x[1]).inf(&x[2]) - reach, x[0].sup(&x[1]).sup(&x[2]) + reach].map(|x| grid.cell(x));
            for i in first[0]..=last[0] {
                for j in first[1]..=last[1] {
                    (first[2]..=last[2]).for_each(|k| grid.cells.entry([i, j, k]).or_default().push(t as u32));
                }
            }
        }
        grid
    }

    fn cell(&self, x: Vec3) -> [i64; 3] {
        std::array::from_fn(|c| ((x[c] - self.low[c]) / self.width).floor() as i64)
    }

    fn visit(&self, x: Vec3, visit: impl FnMut(u32)) {
        self.cells.get(&self.cell(x)).into_iter().flatten().copied().for_each(visit);
    }
}

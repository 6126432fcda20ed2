//! What a proxy lies on: the asset's surface, for its nearest points.

use super::link::Manifold;
use crate::collider::{Nearest, Tree};
use crate::{Result, Vec3};

/// A manifold with its triangles' normals and a tree over them.
pub struct Ground<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub normals: Vec<Vec3>,
    pub areas: Vec<f64>,
    tree: Tree,
}

/// A point of the ground.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    pub triangle: u32,
    pub weights: [f64; 3],
    pub place: Vec3,
    pub squared: f64,
}

impl<'a> Ground<'a> {
    pub fn new(manifold: &'a Manifold) -> Result<Self> {
        Self::over(&manifold.positions, &manifold.triangles)
    }

    /// Over triangles of which near ones lie next to each other.
    pub fn over(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Result<Self> {
        let tree = Tree::new(positions, triangles)?;
        let spans = |tri: &[u32; 3]| {
            let [a, b, c] = tri.map(|v| positions[v as usize]);
            (b - a).cross(&(c - a))
        };
        let normals = triangles.iter().map(|t| spans(t).try_normalize(0.0).unwrap_or_default()).collect();
        let areas = triangles.iter().map(|t| 0.5 * spans(t).norm()).collect();
        Ok(Self { positions, triangles, normals, areas, tree })
    }

    /// The nearest point of the triangles that `accept` takes, closer than `limit`.
    pub fn nearest(&self, p: &Vec3, limit: f64, accept: impl Fn(usize) -> bool) -> Option<Foot> {
        self.nearest_from(p, Nearest::within(limit), accept)
    }

    /// The nearest point; where another within `reach` more faces `normal` and this does not, that. `near` is a triangle close by.
    pub fn facing(&self, p: &Vec3, normal: &Vec3, near: u32, reach: f64) -> Option<Foot> {
        let faces = |t: usize| self.normals[t].dot(normal) > FACES;
        let mut start = Nearest::within(f64::INFINITY);
        start.look_at(self.positions, self.triangles, p, near as usize);
        let first = self.nearest_from(p, start, |_| true)?;
        if faces(first.triangle as usize) {
            return Some(first);
        }
        self.nearest(p, first.squared.sqrt() + reach, faces).or(Some(first))
    }

    fn nearest_from(&self, p: &Vec3, start: Nearest, accept: impl Fn(usize) -> bool) -> Option<Foot> {
        let found = self.tree.nearest_where(self.positions, self.triangles, p, start, accept);
        if found.triangle == usize::MAX {
            return None;
        }
        let place = found.foot(self.positions, self.triangles);
        Some(Foot { triangle: found.triangle as u32, weights: found.weights, place, squared: found.squared })
    }

    pub fn centroid(&self, t: usize) -> Vec3 {
        self.triangles[t].iter().map(|v| self.positions[*v as usize]).sum::<Vec3>() / 3.0
    }

    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }
}

/// Cosine above which two normals face the same way.
const FACES: f64 = 0.2;

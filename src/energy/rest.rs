//! The shape without stress as elements take it: that of a mesh, or with lengths that no positions need to have.

use crate::material::{Metric, lay_out, sides, unfolded};
use crate::{Mesh, Vec3};
use std::collections::HashMap;

/// Angles are those of the mesh, lengths and areas those of the metric where there is one.
#[derive(Clone, Copy)]
pub(super) struct Rest<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) metric: Option<&'a Metric>,
}

impl<'a> Rest<'a> {
    /// Of a mesh that is without stress.
    pub(super) fn of(mesh: &'a Mesh) -> Self {
        Self { mesh, metric: None }
    }

    /// Of a triangle, flat.
    pub(super) fn corners(&self, t: usize) -> [Vec3; 3] {
        match self.metric {
            None => self.mesh.triangles[t].map(|v| self.mesh.positions[v as usize]),
            Some(metric) => metric.corners[t],
        }
    }

    pub(super) fn area(&self, t: usize) -> f64 {
        self.metric.map_or_else(|| self.mesh.area(t), |metric| metric.area(t))
    }

    /// The vector along an edge of a triangle, from its first end.
    pub(super) fn side(&self, t: usize, ends: [u32; 2]) -> Vec3 {
        let at = |v: u32| match self.metric {
            None => self.mesh.positions[v as usize],
            Some(metric) => {
                let place = self.mesh.triangles[t].iter().position(|w| *w == v);
                place.map_or_else(Vec3::zeros, |k| metric.corners[t][k])
            }
        };
        at(ends[1]) - at(ends[0])
    }

    /// Two triangles on an edge: its ends and their other corners. With a metric they are unfolded.
    pub(super) fn hinge(&self, hinge: &[u32; 4]) -> [Vec3; 4] {
        let Some(metric) = self.metric else { return hinge.map(|v| self.mesh.positions[v as usize]) };
        let [a, b, c, d] = *hinge;
        let length = |ends: [u32; 2]| metric.length(self.mesh, ends);
        unfolded(length([a, b]), [[length([a, c]), length([a, d])], [length([b, c]), length([b, d])]])
    }
}

/// Lengths by ends, of triangles whose edges are flipped.
pub(super) struct Intrinsic<'a> {
    mesh: &'a Mesh,
    lengths: HashMap<[u32; 2], f64>,
}

impl<'a> Intrinsic<'a> {
    /// Of a shape with a metric.
    pub(super) fn new(rest: &Rest<'a>) -> Option<Self> {
        let lengths = rest.metric?.lengths.iter();
        let lengths = rest.mesh.edges.iter().zip(lengths).map(|(edge, length)| (key(edge.vertices), *length));
        Some(Self { mesh: rest.mesh, lengths: lengths.collect() })
    }

    /// The quad of an edge a–b with the corners c and d, unfolded.
    pub(super) fn quad(&self, quad: &[u32; 4]) -> [Vec3; 4] {
        quad_of(quad, |ends| self.length(ends))
    }

    /// Flips a–b to c–d. As in a mesh that is bent, where the new edge is a chord, it is as much longer than that as the unfolded quad grew along it.
    pub(super) fn flip(&mut self, quad: &[u32; 4]) {
        let [.., c, d] = *quad;
        let across = |[.., c, d]: [Vec3; 4]| (d - c).norm();
        let grown = across(self.quad(quad)) / across(quad_of(quad, |ends| self.chord(ends)));
        self.lengths.insert(key([c, d]), self.chord([c, d]) * grown);
    }

    /// Corners of a triangle, flat.
    pub(super) fn corners(&self, triangle: &[u32; 3]) -> [Vec3; 3] {
        let lengths = sides(triangle).map(|ends| self.length(ends));
        lay_out(triangle.map(|v| self.mesh.positions[v as usize]), lengths)
    }

    fn length(&self, ends: [u32; 2]) -> f64 {
        self.lengths.get(&key(ends)).copied().unwrap_or(f64::NAN)
    }

    fn chord(&self, [a, b]: [u32; 2]) -> f64 {
        (self.mesh.positions[b as usize] - self.mesh.positions[a as usize]).norm()
    }
}

fn quad_of([a, b, c, d]: &[u32; 4], length: impl Fn([u32; 2]) -> f64) -> [Vec3; 4] {
    let from = |end: u32| [length([end, *c]), length([end, *d])];
    unfolded(length([*a, *b]), [from(*a), from(*b)])
}

fn key([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

//! An oriented 2-manifold triangle mesh, with or without boundary, of any number of components.

mod check;
mod topology;

pub(crate) use check::ZERO_AREA;
pub use check::{Diagnostic, Findings, Kind, NONE, Severity, check};
pub use topology::Orientation;
pub(crate) use topology::UnionFind;

use crate::{Error, ErrorKind, Result, Vec3};
use topology::SharedEdges;

/// An edge with its one or two triangles. `vertices` run along the first triangle's direction.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// End points; the first triangle runs from the first to the second, the second triangle back.
    pub vertices: [u32; 2],
    /// The vertex of each triangle that is not on the edge; the second is [`NONE`] on the boundary.
    pub opposite: [u32; 2],
}

impl Edge {
    /// Two triangles meet here.
    pub fn is_interior(&self) -> bool {
        self.opposite[1] != NONE
    }
}

/// A validated mesh. Immutable; all lengths are in the host's unit.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Rest positions x̄, or where a shell with sag hangs (n_vertices).
    pub positions: Vec<Vec3>,
    /// Consistently oriented (n_triangles).
    pub triangles: Vec<[u32; 3]>,
    /// In order of (lower, higher) vertex (n_edges).
    pub edges: Vec<Edge>,
    /// Connected component of each vertex, [`NONE`] for an unreferenced one (n_vertices).
    pub component: Vec<u32>,
    /// Number of connected components.
    pub n_components: usize,
    /// Triangles that were turned over to agree with their neighbours.
    pub n_reoriented: usize,
    /// Vertices that no triangle uses.
    pub n_unreferenced: usize,
    /// Diagonal of the bounding box of the referenced vertices.
    pub size: f64,
    /// Largest coordinate of all vertices.
    pub reach: f64,
}

impl Mesh {
    /// Validates and orients. Fails with the first error of [`check`] and the number of errors.
    pub fn new(positions: Vec<Vec3>, triangles: &[[u32; 3]]) -> Result<Self> {
        if positions.is_empty() || triangles.is_empty() {
            let (n, t) = (positions.len(), triangles.len());
            return Err(Error::new(ErrorKind::InvalidMesh, format!("the mesh has {n} vertices and {t} triangles")));
        }
        let (findings, shared) = check::check_errors(&positions, triangles);
        if let Some(first) = findings.first_error() {
            let errors = findings.diagnostics.iter().filter(|d| d.kind.severity() == Severity::Error).count();
            let more = if errors > 1 { format!(" (and {} more errors)", errors - 1) } else { String::new() };
            return Err(Error::new(ErrorKind::InvalidMesh, format!("{first}{more}")));
        }
        let n_reoriented = findings.orientation.flipped.iter().filter(|f| **f).count();
        let triangles = findings.orientation.apply(triangles);
        let shared = if n_reoriented > 0 { SharedEdges::of(&triangles, &vec![true; triangles.len()]) } else { shared };
        let edges = edges_of(&triangles, &shared);
        let (component, n_components) = components(positions.len(), &triangles);
        let size = bounding_diagonal(&positions, &component);
        let reach = positions.iter().map(|x| x.amax()).fold(0.0, f64::max);
        Ok(Self {
            n_reoriented,
            n_unreferenced: component.iter().filter(|c| **c == NONE).count(),
            positions,
            triangles,
            edges,
            component,
            n_components,
            size,
            reach,
        })
    }

    /// Edges with two triangles.
    pub fn n_interior_edges(&self) -> usize {
        self.edges.iter().filter(|e| e.is_interior()).count()
    }

    /// The rest area of triangle `t`.
    pub fn area(&self, t: usize) -> f64 {
        let [a, b, c] = self.triangles[t].map(|v| self.positions[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// Area-weighted unit normals at the vertices of any configuration `x` (n_vertices); zero where no triangle is.
    pub fn normals(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut normals = vec![Vec3::zeros(); x.len()];
        for tri in &self.triangles {
            let [a, b, c] = tri.map(|v| x[v as usize]);
            let n = (b - a).cross(&(c - a));
            tri.iter().for_each(|&v| normals[v as usize] += n);
        }
        normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or_default());
        normals
    }
}

/// The edges of an oriented manifold triangle list.
fn edges_of(triangles: &[[u32; 3]], shared: &SharedEdges) -> Vec<Edge> {
    let corner = |side: &topology::Side, k: usize| triangles[side.triangle as usize][(side.corner as usize + k) % 3];
    let edge = |sides: &[topology::Side]| Edge {
        vertices: [corner(&sides[0], 0), corner(&sides[0], 1)],
        opposite: [corner(&sides[0], 2), sides.get(1).map_or(NONE, |s| corner(s, 2))],
    };
    shared.iter().map(edge).collect()
}

/// Numbers connected components by their lowest vertex.
fn components(n: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(n);
    let mut used = vec![false; n];
    for &[a, b, c] in triangles {
        sets.join(a, b);
        sets.join(b, c);
        [a, b, c].iter().for_each(|&v| used[v as usize] = true);
    }
    let mut component = vec![NONE; n];
    let mut count = 0;
    for v in (0..n).filter(|&v| used[v]) {
        let root = sets.find(v as u32) as usize;
        if component[root] == NONE {
            component[root] = count;
            count += 1;
        }
        component[v] = component[root];
    }
    (component, count as usize)
}

fn bounding_diagonal(positions: &[Vec3], component: &[u32]) -> f64 {
    let used = || positions.iter().zip(component).filter(|(_, c)| **c != NONE).map(|(p, _)| p);
    let low = used().fold(Vec3::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = used().fold(Vec3::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    crate::wide_norm(&(high - low))
}

//! Every problem of a triangle list, located: which element, which vertices, which numbers.
//!
//! Errors make a mesh unusable. Warnings are handled: inconsistent but orientable triangles are re-oriented, unreferenced
//! vertices are carried along without mass, coincident vertices and slivers are simulated as they are.

use super::topology::{Orientation, SharedEdges, fan_roots, orient};
use crate::Vec3;
use std::fmt;

/// Marks an unused vertex slot, an absent triangle or an absent opposite vertex.
pub const NONE: u32 = u32::MAX;

/// A triangle is degenerate when its area is below this multiple of its longest edge squared. Edge differences carry a
/// relative rounding error of 1e-16, so a height of 1e-12 edges is the last one with four sure digits.
pub const ZERO_AREA: f64 = 1e-12;

/// Quality 4√3 A / Σl² is 1 for an equilateral triangle; below this (aspect about 100) a triangle is called a sliver.
const SLIVER: f64 = 0.02;

/// How bad a problem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Handled; simulation goes on.
    Warning,
    /// The mesh is refused.
    Error,
}

/// The kinds of problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Error. A triangle names a vertex that does not exist. `element`: triangle; `value[0]`: the index.
    IndexOutOfRange,
    /// Error. A triangle names a vertex twice. `element`: triangle.
    RepeatedVertex,
    /// Error. A coordinate is NaN or infinite. `element`: vertex; `value[0]`: the coordinate.
    NonFiniteCoordinate,
    /// Error. `element`: triangle; `value`: area, longest edge.
    ZeroArea,
    /// Error. Two triangles with the same three vertices. `element`: the second; `value[0]`: the first.
    DuplicateTriangle,
    /// Error. More than two triangles on an edge. `element`: the edge's first triangle; `value[0]`: how many.
    NonManifoldEdge,
    /// Error. The triangles around a vertex form several fans. `element`: vertex; `value[0]`: how many fans.
    NonManifoldVertex,
    /// Error. No consistent orientation exists, as on a Möbius strip. `element`: a triangle on the closing edge.
    NotOrientable,
    /// Warning. The triangle is turned against its neighbours; it is re-oriented internally. `element`: triangle.
    InconsistentOrientation,
    /// Warning. No triangle uses the vertex; it is carried along with the support frame. `element`: vertex.
    UnreferencedVertex,
    /// Warning. Two vertices at the same place, perhaps an unwelded seam. `element`: the second; `value[0]`: the first.
    CoincidentVertices,
    /// Warning. `element`: triangle; `value[0]`: quality 4√3 A / Σl².
    Sliver,
}

impl Kind {
    /// Whether the kind makes a mesh unusable.
    pub fn severity(self) -> Severity {
        if self < Kind::InconsistentOrientation { Severity::Error } else { Severity::Warning }
    }
}

/// One located problem.
#[derive(Clone, Copy, Debug)]
pub struct Diagnostic {
    /// What it is.
    pub kind: Kind,
    /// Triangle or vertex, as [`Kind`] says.
    pub element: u32,
    /// The vertices concerned, [`NONE`] where unused.
    pub vertices: [u32; 4],
    /// Numbers, as [`Kind`] says.
    pub value: [f64; 2],
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diagnostic { element: e, vertices: [a, b, c, _], value: [x, y], .. } = *self;
        match self.kind {
            Kind::IndexOutOfRange => write!(f, "triangle {e} names vertex {x}, which does not exist"),
            Kind::RepeatedVertex => write!(f, "triangle {e} names a vertex twice: vertices {a}, {b}, {c}"),
            Kind::NonFiniteCoordinate => write!(f, "vertex {e} has the coordinate {x}"),
            Kind::ZeroArea => {
                write!(f, "triangle {e} has zero area: vertices {a}, {b}, {c}, area {x:.3e}, longest edge {y:.3e}")
            }
            Kind::DuplicateTriangle => write!(f, "triangle {e} repeats triangle {x}: vertices {a}, {b}, {c}"),
            Kind::NonManifoldEdge => write!(f, "edge {a}-{b} has {x} triangles, the first is triangle {e}"),
            Kind::NonManifoldVertex => write!(f, "vertex {e} joins {x} separate fans of triangles"),
            Kind::NotOrientable => {
                write!(
                    f,
                    "triangle {e} (vertices {a}, {b}, {c}) closes a one-sided strip: no consistent orientation exists"
                )
            }
            Kind::InconsistentOrientation => {
                write!(f, "triangle {e} is turned against its neighbours: vertices {a}, {b}, {c}")
            }
            Kind::UnreferencedVertex => write!(f, "vertex {e} is used by no triangle"),
            Kind::CoincidentVertices => write!(f, "vertex {e} lies at the same place as vertex {x}"),
            Kind::Sliver => write!(f, "triangle {e} is a sliver of quality {x:.2e}: vertices {a}, {b}, {c}"),
        }
    }
}

/// What [`check`] found: the problems by kind and element, and the orientation when one exists.
pub struct Findings {
    /// Sorted by kind, then element.
    pub diagnostics: Vec<Diagnostic>,
    /// Meaningful only without errors.
    pub orientation: Orientation,
}

impl Findings {
    /// The first problem of severity error.
    pub fn first_error(&self) -> Option<&Diagnostic> {
        self.diagnostics.iter().find(|d| d.kind.severity() == Severity::Error)
    }
}

/// Finds every problem of the triangle list. Triangles that cannot be used are left out of the later checks, so one bad
/// index does not hide the rest. O(n log n).
pub fn check(positions: &[Vec3], triangles: &[[u32; 3]]) -> Findings {
    let (mut findings, _) = check_errors(positions, triangles);
    let out = &mut findings.diagnostics;
    check_coincident(positions, out);
    check_unreferenced(positions.len(), triangles, out);
    out.sort_by_key(|d| (d.kind, d.element));
    findings
}

/// As [`check`], with every error but not every warning; and the edges of the usable triangles.
pub(super) fn check_errors(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Findings, SharedEdges) {
    let mut out = Vec::new();
    check_coordinates(positions, &mut out);
    let usable = check_triangles(positions, triangles, &mut out);
    let edges = SharedEdges::of(triangles, &usable);
    if edges.may_repeat(triangles) {
        check_duplicates(triangles, &usable, &mut out);
    }
    check_edges(triangles, &edges, &mut out);
    let orientation = orient(triangles, &edges);
    check_orientation(triangles, &orientation, &mut out);
    check_fans(positions.len(), triangles, &usable, &edges, &mut out);
    out.sort_by_key(|d| (d.kind, d.element));
    (Findings { diagnostics: out, orientation }, edges)
}

fn at_vertex(kind: Kind, v: usize, value: f64) -> Diagnostic {
    Diagnostic { kind, element: v as u32, vertices: [v as u32, NONE, NONE, NONE], value: [value, 0.0] }
}

fn at_triangle(kind: Kind, t: usize, [a, b, c]: [u32; 3], value: [f64; 2]) -> Diagnostic {
    Diagnostic { kind, element: t as u32, vertices: [a, b, c, NONE], value }
}

fn check_coordinates(positions: &[Vec3], out: &mut Vec<Diagnostic>) {
    for (v, p) in positions.iter().enumerate() {
        if let Some(&bad) = p.iter().find(|c| !c.is_finite()) {
            out.push(at_vertex(Kind::NonFiniteCoordinate, v, bad));
        }
    }
}

fn check_coincident(positions: &[Vec3], out: &mut Vec<Diagnostic>) {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let key = |v: u32| positions[v as usize].map(|c| c + 0.0); // −0 counts as 0
    let compare = |a: &u32, b: &u32| {
        let (p, q) = (key(*a), key(*b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)).then(a.cmp(b))
    };
    order.sort_unstable_by(compare);
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        let first = f64::from(run[0]);
        out.extend(run[1..].iter().map(|&v| at_vertex(Kind::CoincidentVertices, v as usize, first)));
    }
}

/// Reports each triangle's own faults and returns which triangles have three distinct, existing vertices.
fn check_triangles(positions: &[Vec3], triangles: &[[u32; 3]], out: &mut Vec<Diagnostic>) -> Vec<bool> {
    let usable = |(t, &tri): (usize, &[u32; 3])| {
        if let Some(&v) = tri.iter().find(|&&v| v as usize >= positions.len()) {
            out.push(at_triangle(Kind::IndexOutOfRange, t, tri, [f64::from(v), 0.0]));
            return false;
        }
        let [a, b, c] = tri;
        if a == b || b == c || c == a {
            out.push(at_triangle(Kind::RepeatedVertex, t, tri, [0.0; 2]));
            return false;
        }
        out.extend(shape_fault(positions, t, tri));
        true
    };
    triangles.iter().enumerate().map(usable).collect()
}

fn shape_fault(positions: &[Vec3], t: usize, tri: [u32; 3]) -> Option<Diagnostic> {
    let [a, b, c] = tri.map(|v| positions[v as usize]);
    let sides = [b - a, c - b, a - c];
    let longest = sides.iter().map(|s| s.norm()).fold(0.0, f64::max);
    if !longest.is_finite() {
        return None; // the coordinate itself is reported
    }
    // In units of the longest edge, so that neither tiny nor huge models leave the floating-point range.
    let scale = if longest > 0.0 { 1.0 / longest } else { 0.0 };
    let unit = sides.map(|s| s * scale);
    let area = 0.5 * unit[0].cross(&unit[2]).norm();
    let quality = 4.0 * 3f64.sqrt() * area / unit.iter().map(|s| s.norm_squared()).sum::<f64>();
    if longest == 0.0 || area <= ZERO_AREA {
        Some(at_triangle(Kind::ZeroArea, t, tri, [area * longest * longest, longest]))
    } else if quality < SLIVER {
        Some(at_triangle(Kind::Sliver, t, tri, [quality, 0.0]))
    } else {
        None
    }
}

fn check_duplicates(triangles: &[[u32; 3]], usable: &[bool], out: &mut Vec<Diagnostic>) {
    let mut sorted: Vec<([u32; 3], u32)> = (0..triangles.len())
        .filter(|&t| usable[t])
        .map(|t| {
            let mut key = triangles[t];
            key.sort_unstable();
            (key, t as u32)
        })
        .collect();
    sorted.sort_unstable();
    for run in sorted.chunk_by(|x, y| x.0 == y.0) {
        let first = f64::from(run[0].1);
        let repeat =
            |&(_, t): &(_, u32)| at_triangle(Kind::DuplicateTriangle, t as usize, triangles[t as usize], [first, 0.0]);
        out.extend(run[1..].iter().map(repeat));
    }
}

fn check_edges(triangles: &[[u32; 3]], edges: &SharedEdges, out: &mut Vec<Diagnostic>) {
    for sides in edges.iter().filter(|sides| sides.len() > 2) {
        let [a, b] = sides[0].vertices();
        let opposite = triangles[sides[0].triangle as usize][(sides[0].corner as usize + 2) % 3];
        out.push(Diagnostic {
            kind: Kind::NonManifoldEdge,
            element: sides[0].triangle,
            vertices: [a, b, opposite, NONE],
            value: [sides.len() as f64, 0.0],
        });
    }
}

fn check_orientation(triangles: &[[u32; 3]], orientation: &Orientation, out: &mut Vec<Diagnostic>) {
    for &t in &orientation.conflicts {
        out.push(at_triangle(Kind::NotOrientable, t as usize, triangles[t as usize], [0.0; 2]));
    }
    for (t, _) in orientation.flipped.iter().enumerate().filter(|(_, flipped)| **flipped) {
        out.push(at_triangle(Kind::InconsistentOrientation, t, triangles[t], [0.0; 2]));
    }
}

fn check_fans(n: usize, triangles: &[[u32; 3]], usable: &[bool], edges: &SharedEdges, out: &mut Vec<Diagnostic>) {
    let roots = fan_roots(triangles, edges);
    let mut fans = vec![0u32; n];
    for (t, tri) in triangles.iter().enumerate().filter(|(t, _)| usable[*t]) {
        (0..3).filter(|k| roots[3 * t + k] as usize == 3 * t + k).for_each(|k| fans[tri[k] as usize] += 1);
    }
    let several = fans.iter().enumerate().filter(|(_, fans)| **fans > 1);
    out.extend(several.map(|(v, fans)| at_vertex(Kind::NonManifoldVertex, v, f64::from(*fans))));
}

fn check_unreferenced(n: usize, triangles: &[[u32; 3]], out: &mut Vec<Diagnostic>) {
    let mut used = vec![false; n];
    for &v in triangles.iter().flatten().filter(|&&v| (v as usize) < n) {
        used[v as usize] = true;
    }
    out.extend((0..n).filter(|&v| !used[v]).map(|v| at_vertex(Kind::UnreferencedVertex, v, 0.0)));
}

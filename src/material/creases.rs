//! Creases: edges that bend by another stiffness than the sheet's, or rest at another angle than the mesh has there.

use crate::Mesh;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// What is different at one edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crease {
    /// Ends of an edge between two triangles, in either order.
    pub vertices: [u32; 2],
    /// Of the sheet's own stiffness against bending at this edge; 0 is a hinge that turns freely.
    pub factor: f64,
    /// Rest angle in rad from −π to π: 0 is flat, above 0 is convex on the side of the triangles' normals. `None`: as the mesh.
    pub angle: Option<f64>,
    /// How far, in rad, its angle comes from the rest angle elastically, positive: beyond it the rest angle of a state follows. Infinite: elastic.
    pub yield_angle: f64,
}

impl Crease {
    /// Whether it yields.
    pub fn yields(&self) -> bool {
        self.yield_angle < f64::INFINITY
    }

    /// Whether it has a hinge of its own between triangles that the sheet does not bend across it.
    pub fn is_apart(&self) -> bool {
        self.factor != 1.0 || self.yields()
    }
}

/// The creases of a mesh, in order of (lower, higher) vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Creases(Vec<Crease>);

impl Creases {
    /// Checks them for a mesh. Those that change nothing are left out.
    pub fn new(creases: &[Crease], mesh: &Mesh) -> Result<Self> {
        let mut all = vec![];
        for (i, crease) in creases.iter().enumerate() {
            all.push((checked(i, crease, mesh)?, i));
        }
        all.sort_by_key(|(crease, i)| (crease.vertices, *i));
        if let Some(same) = all.windows(2).find(|pair| pair[0].0.vertices == pair[1].0.vertices) {
            let (i, k, [a, b]) = (same[0].1, same[1].1, same[0].0.vertices);
            return Err(Error::argument(format!("creases {i} and {k} are at the same edge {a}-{b}")));
        }
        let counts = |crease: &Crease| crease.is_apart() || crease.angle.is_some();
        Ok(Self(all.into_iter().map(|(crease, _)| crease).filter(counts).collect()))
    }

    /// None that changes anything.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All that change something.
    pub fn all(&self) -> &[Crease] {
        &self.0
    }

    /// That of an edge with these ends, in either order.
    pub fn at(&self, [a, b]: [u32; 2]) -> Option<&Crease> {
        let ends = [a.min(b), a.max(b)];
        self.0.binary_search_by_key(&ends, |crease| crease.vertices).ok().map(|i| &self.0[i])
    }

    /// Whether any rests at an angle of its own.
    pub fn have_angles(&self) -> bool {
        self.0.iter().any(|crease| crease.angle.is_some())
    }

    /// Whether any yields.
    pub fn yield_somewhere(&self) -> bool {
        self.0.iter().any(Crease::yields)
    }

    /// Whether any turns freely.
    pub fn have_hinges(&self) -> bool {
        self.0.iter().any(|crease| crease.factor == 0.0)
    }

    /// Those between these vertices (ascending), which are numbered anew in their order.
    pub fn part(&self, vertices: &[u32]) -> Self {
        let new = |v: u32| vertices.binary_search(&v).ok().map(|i| i as u32);
        let part = |crease: &Crease| {
            let [a, b] = crease.vertices.map(new);
            Some(Crease { vertices: [a?, b?], ..*crease })
        };
        Self(self.0.iter().filter_map(part).collect())
    }
}

/// The i-th, with its ends in order.
fn checked(i: usize, crease: &Crease, mesh: &Mesh) -> Result<Crease> {
    let Crease { vertices: [a, b], factor, angle, yield_angle } = *crease;
    let n = mesh.positions.len();
    let refused = |what: String| Err(Error::argument(format!("crease {i} is at the edge {a}-{b}, {what}")));
    if a as usize >= n || b as usize >= n {
        return refused(format!("but the mesh has {n} vertices"));
    }
    let vertices = [a.min(b), a.max(b)];
    let edge = mesh.edges.binary_search_by_key(&vertices, |edge| {
        let [a, b] = edge.vertices;
        [a.min(b), a.max(b)]
    });
    match edge {
        Err(_) => return refused("which the mesh does not have".into()),
        Ok(e) if !mesh.edges[e].is_interior() => {
            return refused("which has only one triangle: nothing folds there".into());
        }
        Ok(_) => (),
    }
    if !(factor.is_finite() && factor >= 0.0) {
        let message = format!("the factor of crease {i}, {a}-{b}, is {factor:?}: it must be finite and not negative");
        return Err(Error::argument(message));
    }
    if let Some(angle) = angle.filter(|angle| angle.is_nan() || angle.abs() > PI) {
        let message = format!("the rest angle of crease {i}, {a}-{b}, is {angle:?}: it must be from -pi to pi");
        return Err(Error::argument(message));
    }
    if yield_angle.is_nan() || yield_angle <= 0.0 {
        let message = format!("the yield angle of crease {i}, {a}-{b}, is {yield_angle:?}: it must be positive");
        return Err(Error::argument(message));
    }
    let yield_angle = if factor == 0.0 { f64::INFINITY } else { yield_angle }; // no moment, nothing to yield
    Ok(Crease { vertices, factor, angle, yield_angle })
}

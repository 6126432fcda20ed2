//! Planes of symmetry: which edges lie on them, so that the shell's slope there is that of a whole whose other half is its image.

use super::Supports;
use super::roller::unit;
use crate::energy::Mirror;
use crate::{Error, Mesh, Result, Vec3};

/// Directions are of one plane when they are off each other by less than this, rad.
const PARALLEL: f64 = 1e-6;
/// An edge is on a plane when its ends are at the same height over it, to this share of its length and of the largest coordinate: rows of f32
/// coordinates are even to 1e-7 of that.
const EVEN: [f64; 2] = [1e-5, 1e-6];
/// The shell rises from a plane by more than this share of a triangle's height.
const RISE: f64 = 1e-3;

impl Supports {
    /// The edges on planes of symmetry, ascending. Fails where a vertex of such a plane is on no such edge.
    pub fn mirrors(&self, mesh: &Mesh) -> Result<Vec<Mirror>> {
        let n = mesh.positions.len();
        let mut planes: Vec<Vec<(usize, Vec3)>> = if self.symmetric.is_empty() { vec![] } else { vec![vec![]; n] };
        for (i, (v, direction)) in self.symmetric.iter().enumerate() {
            if *v as usize >= n {
                let message = format!("vertex {v} is on a plane of symmetry, but the mesh has {n} vertices");
                return Err(Error::argument(message));
            }
            let Some(direction) = unit(direction) else {
                let d = direction.data.0[0];
                let message =
                    format!("the plane of symmetry at vertex {v} has the normal {d:?}: it must be a direction");
                return Err(Error::argument(message));
            };
            planes[*v as usize].push((i, direction));
        }
        let (mut mirrors, mut told) = (vec![], vec![false; self.symmetric.len()]);
        let boundary = mesh.edges.iter().filter(|edge| !edge.is_interior() && !planes.is_empty());
        for edge in boundary {
            let [a, b] = edge.vertices;
            for ((i, own), (j, other)) in
                planes[a as usize].iter().flat_map(|one| planes[b as usize].iter().map(move |other| (one, other)))
            {
                if own.cross(other).norm() > PARALLEL || !is_even(mesh, edge.vertices, own) {
                    continue;
                }
                (told[*i], told[*j]) = (true, true);
                let ends = [a.min(b), a.max(b)];
                let offset = own.dot(&(0.5 * (mesh.positions[a as usize] + mesh.positions[b as usize])));
                let mirror = Mirror { ends, normal: *own, offset };
                rises(mesh, &mirror, edge.opposite[0])?;
                mirrors.push(mirror);
            }
        }
        mirrors.sort_by_key(|mirror: &Mirror| mirror.ends);
        mirrors.dedup_by_key(|mirror| mirror.ends);
        match told.iter().position(|told| !told) {
            None => Ok(mirrors),
            Some(i) => Err(self.lonely(mesh, i, &planes)),
        }
    }

    /// Why the vertex of an entry is on no edge of its plane.
    fn lonely(&self, mesh: &Mesh, i: usize, planes: &[Vec<(usize, Vec3)>]) -> Error {
        let v = self.symmetric[i].0;
        let normal = unit(&self.symmetric[i].1).unwrap_or_default();
        let edges = || mesh.edges.iter().filter(|edge| !edge.is_interior() && edge.vertices.contains(&v));
        let other = |[a, b]: [u32; 2]| if a == v { b } else { a };
        if edges().next().is_none() {
            let message = format!("vertex {v} is to be on a plane of symmetry, but it is not on the mesh's boundary");
            return Error::argument(message);
        }
        let parallel = |w: &u32| planes[*w as usize].iter().any(|(_, n)| n.cross(&normal).norm() <= PARALLEL);
        match edges().map(|edge| other(edge.vertices)).find(parallel) {
            Some(w) => {
                let off = normal.dot(&(mesh.positions[v as usize] - mesh.positions[w as usize])).abs();
                let message = format!(
                    "vertex {v} is off the plane of symmetry of its neighbour, vertex {w}, by {off:e}: move it there, or take the normal that fits"
                );
                Error::argument(message)
            }
            None => Error::argument(format!(
                "vertex {v} is to be on a plane of symmetry, but no boundary edge leads from it to another vertex of that plane"
            )),
        }
    }
}

impl Mirror {
    /// Whether it is an edge of one triangle of `mesh`, and on its plane.
    pub fn is_sound(&self, mesh: &Mesh) -> bool {
        let normal = self.normal.iter().all(|x| x.is_finite()) && (self.normal.norm() - 1.0).abs() <= PARALLEL;
        let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        // Edges ascend by these.
        let at = mesh.edges.binary_search_by_key(&self.ends, |edge| sorted(edge.vertices));
        let Some(edge) = at.ok().map(|at| &mesh.edges[at]).filter(|edge| !edge.is_interior() && normal) else {
            return false;
        };
        let off = |v: u32| self.normal.dot(&mesh.positions[v as usize]) - self.offset;
        let [a, b] = self.ends.map(|v| off(v).abs());
        let length = length(mesh, self.ends);
        a.max(b) <= EVEN[0] * length + EVEN[1] * mesh.reach && rises(mesh, self, edge.opposite[0]).is_ok()
    }
}

fn length(mesh: &Mesh, [a, b]: [u32; 2]) -> f64 {
    (mesh.positions[b as usize] - mesh.positions[a as usize]).norm()
}

fn is_even(mesh: &Mesh, ends: [u32; 2], normal: &Vec3) -> bool {
    let [a, b] = ends.map(|v| normal.dot(&mesh.positions[v as usize]));
    (b - a).abs() <= EVEN[0] * length(mesh, ends) + EVEN[1] * mesh.reach
}

/// Fails where a triangle on an edge of a plane, with this other corner, lies in the plane.
fn rises(mesh: &Mesh, mirror: &Mirror, corner: u32) -> Result<()> {
    let [a, b] = mirror.ends.map(|v| mesh.positions[v as usize]);
    let x = mesh.positions[corner as usize];
    let height = (b - a).cross(&(x - a)).norm() / (b - a).norm();
    let rise = (mirror.normal.dot(&x) - mirror.offset).abs();
    if rise > RISE * height {
        return Ok(());
    }
    let [a, b] = mirror.ends;
    let message = format!(
        "the triangle of the vertices {a}, {b} and {corner} lies in the plane of symmetry that {a} and {b} are on: the shell must leave it"
    );
    Err(Error::argument(message))
}

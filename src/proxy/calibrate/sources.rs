//! Where the points of one mesh are on another.

use super::super::ground::Ground;
use crate::error::reserve;
use crate::material::{Fibres, Map, On, Orthotropy};
use crate::{Error, Result, Shell, Vec3};
use std::collections::HashMap;

/// Points of the finer mesh nearest to vertices.
pub struct Sources {
    /// Of each vertex, three of the finer mesh and their weights.
    pub of: Vec<([u32; 3], [f64; 3])>,
    /// And the triangle's number there.
    triangles: Vec<usize>,
}

impl Sources {
    /// Fails on a vertex that is further off than one of the same thing can be.
    pub fn new(points: &[Vec3], used: impl Fn(usize) -> bool, fine: &Shell, limit: f64) -> Result<Self> {
        let (size, center) = (fine.mesh.size, fine.mesh.positions[fine.mesh.triangles[0][0] as usize]);
        let inward = |x: &Vec3| (x - center) / size;
        let positions: Vec<Vec3> = fine.mesh.positions.iter().map(inward).collect();
        let mut triangles = fine.mesh.triangles.clone();
        crate::collider::sort_triangles(&positions, &mut triangles);
        let number: HashMap<[u32; 3], usize> =
            fine.mesh.triangles.iter().enumerate().map(|(t, tri)| (*tri, t)).collect();
        let ground = Ground::over(&positions, &triangles)?;
        let mut of = reserve("the vertices' places", points.len())?;
        let mut numbers = reserve("the vertices' places", points.len())?;
        for (v, x) in points.iter().enumerate() {
            if !used(v) {
                of.push(([0; 3], [0.0; 3]));
                numbers.push(0);
                continue;
            }
            let Some(foot) = ground.nearest(&inward(x), limit, |_| true) else {
                let [x, y, z] = x.data.0[0];
                return Err(Error::argument(format!(
                    "vertex {v} at ({x:.6}, {y:.6}, {z:.6}) is further than {:.3e} from the asset",
                    limit * size
                )));
            };
            let corners = triangles[foot.triangle as usize];
            of.push((corners, foot.weights));
            numbers.push(number[&corners]);
        }
        Ok(Self { of, triangles: numbers })
    }

    /// A field of the finer mesh there.
    pub fn sampled(&self, field: &[Vec3]) -> Vec<Vec3> {
        let at = |(vertices, weights): &([u32; 3], [f64; 3])| {
            vertices.iter().zip(weights).map(|(v, w)| *w * field[*v as usize]).sum()
        };
        self.of.iter().map(at).collect()
    }

    /// The corner nearest to a point.
    pub fn corner(&self, point: usize) -> u32 {
        let (vertices, weights) = &self.of[point];
        let nearest = (0..3).max_by(|i, j| weights[*i].total_cmp(&weights[*j]).then(j.cmp(i)));
        vertices[nearest.unwrap_or(0)]
    }

    /// The triangle of the mesh that the first corner of one of the points' is on.
    fn triangle(&self, corners: &[u32; 3]) -> usize {
        self.triangles[corners[0] as usize]
    }

    /// A map at the points, which have triangles.
    pub fn map(&self, map: &Map, triangles: &[[u32; 3]]) -> Map {
        let at = |(vertices, weights): &([u32; 3], [f64; 3])| {
            vertices.iter().zip(weights).map(|(v, w)| w * map.values[*v as usize]).sum()
        };
        let values = match map.on {
            On::Vertices => self.of.iter().map(at).collect(),
            On::Triangles => triangles.iter().map(|t| map.values[self.triangle(t)]).collect(),
        };
        Map { values, ..*map }
    }

    pub fn fibres(&self, fibres: &Orthotropy, triangles: &[[u32; 3]]) -> Fibres {
        let given = fibres.fibres();
        let directions = match given.directions.len() {
            1 => given.directions,
            _ => triangles.iter().map(|t| given.directions[self.triangle(t)]).collect(),
        };
        Fibres { directions, ..given }
    }

    /// Forces at the points on so many vertices of the finer mesh, of the same work.
    pub fn gathered(&self, forces: &[Vec3], n_vertices: usize) -> Vec<Vec3> {
        let mut gathered = vec![Vec3::zeros(); n_vertices];
        for ((vertices, weights), force) in self.of.iter().zip(forces) {
            vertices.iter().zip(weights).for_each(|(v, w)| gathered[*v as usize] += *w * force);
        }
        gathered
    }
}

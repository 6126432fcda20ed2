//! Meshes: plain OBJ files, and strips of near-equilateral triangles at any resolution.

use anyhow::{Context, Result};
use std::path::Path;

pub type P3 = [f64; 3];

pub fn sub(a: P3, b: P3) -> P3 {
    std::array::from_fn(|c| a[c] - b[c])
}

pub fn dot(a: P3, b: P3) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

fn cross(a: P3, b: P3) -> P3 {
    std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

/// A triangle mesh with a place of each vertex on the flat sheet it was made of, by which meshes of one shape are compared.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub positions: Vec<P3>,
    pub triangles: Vec<[u32; 3]>,
    pub place: Vec<[f64; 2]>,
}

/// Three vertices and their weights.
pub type Sample = [(usize, f64); 3];

impl Mesh {
    /// Vertices and triangles of a plain OBJ file; places are x and y.
    pub fn read_obj(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
        let (mut positions, mut triangles) = (vec![], vec![]);
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["v", x, y, z] => positions.push([x.parse()?, y.parse()?, z.parse()?]),
                ["f", a, b, c] => {
                    let index = |w: &str| -> Result<u32> { Ok(w.split('/').next().unwrap_or(w).parse::<u32>()? - 1) };
                    triangles.push([index(a)?, index(b)?, index(c)?]);
                }
                _ => {}
            }
        }
        let place = positions.iter().map(|p: &P3| [p[0], p[1]]).collect();
        Ok(Self { positions, triangles, place })
    }

    /// A strip in the plane z = 0 of equilateral triangles, cut straight at the ends, with `rows` of them across
    /// −width/2 ≤ y ≤ width/2, from x = −edge/2 to about `length`: to a whole number of half edges.
    ///
    /// Two columns of vertices fixed at x ≤ edge/2 clamp it at x = 0: the curvature of the first row of hinges that can bend
    /// belongs to half an edge on either side of it.
    pub fn strip(length: f64, width: f64, rows: usize) -> Self {
        let height = width / rows as f64;
        let edge = 2.0 * height / 3f64.sqrt();
        let halves = (2.0 * length / edge).round() as usize + 1;
        let (mut place, mut lines): (Vec<[f64; 2]>, Vec<Vec<u32>>) = (vec![], vec![]);
        for j in 0..=rows {
            // In half edges: even lines 0, 2, 4 …, odd ones 0, 1, 3, 5 …, both up to the end.
            let inner = (j % 2..halves).step_by(2).filter(|k| *k > 0);
            let xs: Vec<usize> = std::iter::once(0).chain(inner).chain([halves]).collect();
            lines.push((place.len() as u32..(place.len() + xs.len()) as u32).collect());
            place.extend(xs.iter().map(|k| [0.5 * (*k as f64 - 1.0) * edge, j as f64 * height - 0.5 * width]));
        }
        let mut triangles = vec![];
        for pair in lines.windows(2) {
            fill_between(&pair[0], &pair[1], &place, &mut triangles);
        }
        let positions = place.iter().map(|p| [p[0], p[1], 0.0]).collect();
        Self { positions, triangles, place }
    }

    /// Where the strip ends.
    pub fn length(&self) -> f64 {
        self.place.iter().map(|p| p[0]).fold(0.0, f64::max)
    }

    /// The same sheet in another shape.
    pub fn shaped(mut self, shape: impl Fn([f64; 2]) -> P3) -> Self {
        self.positions = self.place.iter().map(|&p| shape(p)).collect();
        self
    }

    /// Two columns of a strip at its root.
    pub fn root(&self) -> Vec<u32> {
        let first = self.place.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
        self.vertices_where(|_, place| place[0] < -1.02 * first)
    }

    pub fn vertices_where(&self, keep: impl Fn(P3, [f64; 2]) -> bool) -> Vec<u32> {
        (0..self.positions.len()).filter(|&v| keep(self.positions[v], self.place[v])).map(|v| v as u32).collect()
    }

    /// The vertex nearest to a place.
    pub fn nearest(&self, place: [f64; 2]) -> usize {
        let distance = |v: &usize| {
            let p = self.place[*v];
            (p[0] - place[0]).hypot(p[1] - place[1])
        };
        (0..self.place.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// Area of a triangle with its corners at `x`.
    pub fn triangle_area(x: &[P3], t: &[u32; 3]) -> f64 {
        let [a, b, c] = t.map(|v| x[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        0.5 * dot(n, n).sqrt()
    }

    pub fn area(&self, x: &[P3]) -> f64 {
        self.triangles.iter().map(|t| Self::triangle_area(x, t)).sum()
    }

    /// A third of each triangle's rest area at its corners (n).
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for t in &self.triangles {
            t.iter().for_each(|&v| areas[v as usize] += Self::triangle_area(&self.positions, t) / 3.0);
        }
        areas
    }

    /// Where a place lies on the sheet, by weights of a triangle's corners; just outside, the nearest triangle's are used.
    pub fn sample(&self, place: [f64; 2]) -> Sample {
        let weights = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.place[v as usize]);
            let turn =
                |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            let whole = turn(a, b, c);
            [turn(place, b, c) / whole, turn(a, place, c) / whole, turn(a, b, place) / whole]
        };
        let inside = |t: &&[u32; 3]| weights(t).into_iter().fold(f64::INFINITY, f64::min);
        let best = self.triangles.iter().max_by(|a, b| inside(a).total_cmp(&inside(b))).expect("a mesh has triangles");
        let w = weights(best);
        std::array::from_fn(|k| (best[k] as usize, w[k]))
    }
}

/// Triangles between two lines of vertices that begin and end at the same x, counterclockwise.
fn fill_between(lower: &[u32], upper: &[u32], place: &[[f64; 2]], triangles: &mut Vec<[u32; 3]>) {
    let x = |v: u32| place[v as usize][0];
    let (mut i, mut j) = (0, 0);
    while i + 1 < lower.len() || j + 1 < upper.len() {
        let next = |line: &[u32], k: usize| line.get(k + 1).map_or(f64::INFINITY, |&v| x(v));
        let (low, high) = (next(lower, i), next(upper, j));
        // At the end, where both lines end together, the longer edge first.
        let tie = (low - high).abs() < 1e-9 && x(lower[i]) < x(upper[j]);
        if low < high - 1e-9 || tie {
            triangles.push([lower[i], lower[i + 1], upper[j]]);
            i += 1;
        } else {
            triangles.push([lower[i], upper[j + 1], upper[j]]);
            j += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_has_its_area_and_turns_one_way() {
        for rows in [2, 5, 8] {
            let mesh = Mesh::strip(4.0, 0.8, rows);
            let first = mesh.place.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
            // Sums of some hundred products of numbers near 1.
            assert!((mesh.area(&mesh.positions) - (mesh.length() - first) * 0.8).abs() < 1e-12);
            assert!(mesh.triangles.iter().all(|t| {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                cross(sub(b, a), sub(c, a))[2] > 0.0
            }));
            // x = 0 on even lines is followed by edge, on odd ones by half an edge: both within the root.
            assert_eq!(mesh.root().len(), 2 * (rows + 1), "two columns");
        }
    }

    #[test]
    fn a_strip_is_equilateral_but_for_its_ends_and_as_long_at_every_resolution() {
        for rows in [4, 8, 16] {
            let mesh = Mesh::strip(7.0 / 3f64.sqrt(), 0.8, rows);
            assert!((mesh.length() - 7.0 / 3f64.sqrt()).abs() < 1e-12, "17.5 edges of the coarsest");
            let edge = 1.6 / (rows as f64 * 3f64.sqrt());
            let whole = 0.25 * 3f64.sqrt() * edge * edge;
            let areas = mesh.triangles.iter().map(|t| Mesh::triangle_area(&mesh.positions, t));
            // Halves at both ends of each row.
            let halves = areas.filter(|a| (a / whole - 1.0).abs() > 1e-9).collect::<Vec<_>>();
            assert_eq!(halves.len(), 2 * rows);
            assert!(halves.iter().all(|a| (a / whole - 0.5).abs() < 1e-9));
        }
    }

    #[test]
    fn a_sample_reproduces_linear_fields() {
        let mesh = Mesh::strip(4.0, 0.8, 4);
        for place in [[0.01, 0.0], [1.3, 0.21], [3.9, -0.39]] {
            let value: f64 =
                mesh.sample(place).iter().map(|&(v, w)| w * (2.0 * mesh.place[v][0] - mesh.place[v][1])).sum();
            assert!((value - (2.0 * place[0] - place[1])).abs() < 1e-12, "exact but for rounding");
        }
    }
}

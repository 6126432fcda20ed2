//! Tangents and normals at the vertices of a deformed shell, from the positions of their neighbours.
//!
//!   t_a = Σ c_ja (x_j − x_i),  n = t₁ × t₂ / |t₁ × t₂|,  F = Σ t_a ⊗ T^a + n ⊗ N
//!
//! The c are those of a least-squares fit of a quadratic function to the neighbours, so that t is the gradient of quadratic motions exactly.
//! T, N are the same at rest, T^a their dual basis: F is the identity at rest and the rotation under a rigid motion.

use crate::Vec3;
use crate::error::{Result, reserve, try_zeroed};
use crate::mesh::Mesh;
use nalgebra::{Matrix3, SMatrix, SVector};

/// What follows from a vertex: its displacement and the changes of t₁, t₂ and n since rest, each padded to a register.
pub type Followed = [[f32; 4]; 4];

/// Fewer neighbours than this hardly tell the five terms of a quadratic function.
const ENOUGH: usize = 6;
/// Share of the squares' sum that holds second derivatives back where neighbours do not tell them.
const RIDGE: f64 = 1e-6;
/// A fit is dropped where its tangents span less than this area, or its factors times the distances sum to more than that.
const LEAST_AREA: f64 = 0.2;
const LARGEST_FACTORS: f64 = 20.0;

/// How tangents follow from positions, at every vertex.
pub struct Frames {
    /// Of each vertex's neighbours; one more than there are vertices.
    starts: Vec<u32>,
    neighbours: Vec<(u32, [f64; 2])>,
    /// t₁, t₂, n at rest.
    rest: Vec<[Vec3; 3]>,
}

/// The vertices of the triangles at each vertex, ascending; twice around where these are few.
fn rings(n: usize, triangles: &[[u32; 3]]) -> Result<Vec<Vec<u32>>> {
    let mut rings: Vec<Vec<u32>> = try_zeroed("the vertices' neighbours", n)?;
    for tri in triangles {
        for k in 0..3 {
            rings[tri[k] as usize].extend([tri[(k + 1) % 3], tri[(k + 2) % 3]]);
        }
    }
    rings.iter_mut().for_each(|ring| {
        ring.sort_unstable();
        ring.dedup();
    });
    let wide = |v: usize| -> Vec<u32> {
        let mut ring: Vec<u32> = rings[v].iter().flat_map(|j| &rings[*j as usize]).chain(&rings[v]).copied().collect();
        ring.sort_unstable();
        ring.dedup();
        ring.retain(|j| *j as usize != v);
        ring
    };
    Ok((0..n).map(|v| if rings[v].len() < ENOUGH { wide(v) } else { rings[v].clone() }).collect())
}

/// The factors of the neighbours in the gradient at `x` of the quadratic function nearest to their values.
fn fit(x: &Vec3, normal: &Vec3, neighbours: &[Vec3]) -> Option<Vec<[f64; 2]>> {
    let first = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).try_normalize(0.0)?;
    let second = normal.cross(&first);
    let reach = neighbours.iter().map(|y| (y - x).norm()).fold(0.0, f64::max);
    let row = |y: &Vec3| -> Option<(SVector<f64, 5>, f64)> {
        let (e, flat) = (y - x, [first.dot(&(y - x)), second.dot(&(y - x))]);
        let (length, seen) = (e.norm(), libm::hypot(flat[0], flat[1]));
        let [a, b] = flat.map(|c| c * length / (seen * reach)); // as far as it is, where it is seen
        let known = seen > 1e-3 * length;
        known.then(|| (SVector::from([a, b, 0.5 * a * a, a * b, 0.5 * b * b]), (reach / length).powi(2)))
    };
    let rows = neighbours.iter().map(row).collect::<Option<Vec<_>>>()?;
    let mut squares: SMatrix<f64, 5, 5> = rows.iter().map(|(r, weight)| *weight * r * r.transpose()).sum();
    let ridge = RIDGE * squares.trace();
    (2..5).for_each(|k| squares[(k, k)] += ridge);
    let inverse = squares.cholesky()?;
    Some(rows.iter().map(|(r, weight)| inverse.solve(r) * (*weight / reach)).map(|c| [c[0], c[1]]).collect())
}

/// Tangents by the factors.
fn tangents(x: &Vec3, neighbours: &[Vec3], factors: &[[f64; 2]]) -> [Vec3; 2] {
    [0, 1].map(|a| neighbours.iter().zip(factors).map(|(y, c)| c[a] * (y - x)).sum())
}

fn is_sound(x: &Vec3, neighbours: &[Vec3], factors: &[[f64; 2]]) -> bool {
    let [t, s] = tangents(x, neighbours, factors);
    let reach: f64 = neighbours.iter().zip(factors).map(|(y, c)| (y - x).norm() * (c[0].abs() + c[1].abs())).sum();
    t.cross(&s).norm() > LEAST_AREA && reach < LARGEST_FACTORS
}

/// Along two sides of the best triangle at the vertex: always sound, but of first order.
fn by_triangle(v: u32, positions: &[Vec3], around: &[[u32; 3]]) -> Vec<(u32, [f64; 2])> {
    let sides = |tri: &[u32; 3]| {
        let k = tri.iter().position(|w| *w == v).unwrap_or(0);
        [tri[(k + 1) % 3], tri[(k + 2) % 3]].map(|j| (j, positions[j as usize] - positions[v as usize]))
    };
    let sine = |tri: &[u32; 3]| {
        let [(_, a), (_, b)] = sides(tri);
        a.cross(&b).norm() / (a.norm() * b.norm())
    };
    let best = around.iter().max_by(|s, t| sine(s).total_cmp(&sine(t)));
    best.map_or(vec![], |tri| {
        let [(j, a), (k, b)] = sides(tri);
        vec![(j, [1.0 / a.norm(), 0.0]), (k, [0.0, 1.0 / b.norm()])]
    })
}

/// The unit normal, or zero where the tangents span nothing.
fn normal([t, s]: &[Vec3; 2]) -> Vec3 {
    t.cross(s).try_normalize(0.0).unwrap_or_default()
}

impl Frames {
    /// Of a mesh whose positions are these.
    pub fn new(mesh: &Mesh, positions: &[Vec3]) -> Result<Self> {
        let n = positions.len();
        let normals = mesh.normals(positions);
        let rings = rings(n, &mesh.triangles)?;
        let mut around: Vec<Vec<u32>> = try_zeroed("the vertices' triangles", n)?;
        mesh.triangles
            .iter()
            .enumerate()
            .for_each(|(t, tri)| tri.iter().for_each(|v| around[*v as usize].push(t as u32)));
        let mut frames = Self {
            starts: reserve("the vertices' neighbours", n + 1)?,
            neighbours: reserve("the vertices' neighbours", rings.iter().map(Vec::len).sum())?,
            rest: reserve("the vertices' frames", n)?,
        };
        for v in 0..n {
            frames.starts.push(frames.neighbours.len() as u32);
            let places: Vec<Vec3> = rings[v].iter().map(|j| positions[*j as usize]).collect();
            let fitted = fit(&positions[v], &normals[v], &places).filter(|c| is_sound(&positions[v], &places, c));
            match fitted {
                Some(factors) => frames.neighbours.extend(rings[v].iter().copied().zip(factors)),
                None => {
                    let around: Vec<[u32; 3]> = around[v].iter().map(|t| mesh.triangles[*t as usize]).collect();
                    frames.neighbours.extend(by_triangle(v as u32, positions, &around));
                }
            }
            let own = &frames.neighbours[frames.starts[v] as usize..];
            let rest = [0, 1].map(|a| own.iter().map(|(j, c)| c[a] * (positions[*j as usize] - positions[v])).sum());
            frames.rest.push([rest[0], rest[1], normal(&rest)]);
        }
        frames.starts.push(frames.neighbours.len() as u32);
        Ok(frames)
    }

    /// The unit normal at rest; zero where no triangle is.
    pub fn normal(&self, v: u32) -> Vec3 {
        self.rest[v as usize][2]
    }

    /// The components by which F takes a direction to t₁, t₂ and n.
    pub fn components(&self, v: u32, direction: &Vec3) -> Vec3 {
        let frame = Matrix3::from_columns(&self.rest[v as usize]);
        frame.try_inverse().map_or(Vec3::zeros(), |inverse| inverse * direction)
    }

    /// The changes of both tangents under displacements, or their rates.
    fn change(&self, v: usize, u: &[Vec3]) -> [Vec3; 2] {
        let own = &self.neighbours[self.starts[v] as usize..self.starts[v + 1] as usize];
        let mut change = [Vec3::zeros(); 2];
        for (j, c) in own {
            let step = u[*j as usize] - u[v];
            change[0] += c[0] * step;
            change[1] += c[1] * step;
        }
        change
    }

    /// What the points follow, of displacements `u` (n_vertices), both in the mesh's size.
    pub fn follow(&self, u: &[Vec3]) -> Result<Vec<Followed>> {
        let mut out = reserve("the vertices' frames", u.len())?;
        for (v, rest) in self.rest.iter().enumerate() {
            let [t, s] = self.change(v, u);
            let turned = normal(&[rest[0] + t, rest[1] + s]);
            out.push([u[v], t, s, turned - rest[2]].map(padded));
        }
        Ok(out)
    }

    /// The same of the rates, where the shell is displaced by `u` and moves by `rate`.
    pub fn follow_rates(&self, u: &[Vec3], rate: &[Vec3]) -> Result<Vec<Followed>> {
        let mut out = reserve("the vertices' rates", u.len())?;
        for (v, rest) in self.rest.iter().enumerate() {
            let ([t, s], [t_dot, s_dot]) = (self.change(v, u), self.change(v, rate));
            let (t, s) = (rest[0] + t, rest[1] + s);
            let (n, area) = (normal(&[t, s]), t.cross(&s).norm());
            let span = t_dot.cross(&s) + t.cross(&s_dot);
            let turn = if area > 0.0 { (span - n * n.dot(&span)) / area } else { Vec3::zeros() };
            out.push([rate[v], t_dot, s_dot, turn].map(padded));
        }
        Ok(out)
    }

    pub fn bytes(&self) -> usize {
        self.neighbours.capacity() * size_of::<(u32, [f64; 2])>()
            + self.rest.capacity() * size_of::<[Vec3; 3]>()
            + self.starts.capacity() * size_of::<u32>()
    }
}

fn padded(v: Vec3) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, 0.0]
}

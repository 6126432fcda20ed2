//! Closed meshes, and distances to them by the longest way.
#![allow(missing_docs, dead_code, clippy::needless_range_loop)]

use rand::Rng;
use rand::rngs::StdRng;
use shellwarp::Vec3;

pub type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

pub fn random_point(rng: &mut StdRng, reach: f64) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-reach..reach))
}

/// A box about the origin in twelve triangles.
pub fn box_mesh(half: Vec3) -> Mesh {
    let corner = |i: usize| Vec3::from_fn(|a, _| if i >> a & 1 == 1 { half[a] } else { -half[a] });
    let mut triangles = vec![];
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    ((0..8).map(corner).collect(), triangles)
}

/// A torus about z in m × n quads.
pub fn torus(ring: f64, tube: f64, m: usize, n: usize) -> Mesh {
    let turn = |i: usize, n: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let mut positions = vec![];
    let mut triangles = vec![];
    for i in 0..m {
        for j in 0..n {
            let (u, v) = (turn(i, m), turn(j, n));
            let out = ring + tube * v.cos();
            positions.push(Vec3::new(out * u.cos(), out * u.sin(), tube * v.sin()));
            let at = |i: usize, j: usize| (i % m * n + j % n) as u32;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, triangles)
}

/// A sphere of radius 1: an octahedron whose triangles are split `levels` times.
pub fn sphere(levels: usize) -> Mesh {
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
    let mut positions: Vec<Vec3> = axes.iter().flat_map(|a| [*a, -a]).collect();
    let mut triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let mut finer = vec![];
        for [a, b, c] in triangles {
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        triangles = finer;
    }
    (positions, triangles)
}

pub fn moved((positions, triangles): Mesh, by: Vec3) -> Mesh {
    (positions.into_iter().map(|x| x + by).collect(), triangles)
}

/// One after the other.
pub fn joined((mut positions, mut triangles): Mesh, (more, others): Mesh) -> Mesh {
    let n = positions.len() as u32;
    positions.extend(more);
    triangles.extend(others.into_iter().map(|t| t.map(|v| v + n)));
    (positions, triangles)
}

pub fn inside_out((positions, triangles): Mesh) -> Mesh {
    (positions, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

pub fn to_segment(p: &Vec3, a: &Vec3, b: &Vec3) -> f64 {
    let side = b - a;
    let share = (side.dot(&(p - a)) / side.norm_squared()).clamp(0.0, 1.0);
    (p - (a + share * side)).norm()
}

/// Over the plane where its foot is within, over the sides else.
pub fn to_triangle(p: &Vec3, [a, b, c]: [&Vec3; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a)).normalize();
    let within = [(a, b), (b, c), (c, a)].iter().all(|(s, t)| normal.cross(&(*t - *s)).dot(&(p - *s)) > 0.0);
    let sides = to_segment(p, a, b).min(to_segment(p, b, c)).min(to_segment(p, c, a));
    if within { normal.dot(&(p - a)).abs().min(sides) } else { sides }
}

/// How often the mesh winds about p: the sum of the solid angles of its triangles (Van Oosterom and Strackee, 1983) over 4π.
pub fn winding(p: &Vec3, (positions, triangles): &Mesh) -> f64 {
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize] - p);
        let [x, y, z] = [a.norm(), b.norm(), c.norm()];
        2.0 * a.dot(&b.cross(&c)).atan2(x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Negative inside.
pub fn exact_distance(p: &Vec3, mesh: &Mesh) -> f64 {
    let (positions, triangles) = mesh;
    let far = triangles.iter().map(|t| to_triangle(p, t.map(|v| &positions[v as usize]))).fold(f64::INFINITY, f64::min);
    if winding(p, mesh) > 0.5 { -far } else { far }
}

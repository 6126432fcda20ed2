//! Flat rectangles of four mesh families, and closed forms of plates.

use super::common::equilateral_sheet;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::Vec3;
use std::collections::HashMap;

pub type Sheet = (Vec<Vec3>, Vec<[u32; 3]>);

/// How a rectangle is cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Family {
    /// Rows of near-equilateral triangles.
    Equilateral,
    /// Squares, all cut along the same diagonal.
    Diagonal,
    /// Squares, cut along the two diagonals by turns.
    UnionJack,
    /// Delaunay's triangles of a jittered equilateral mesh.
    Irregular,
}

pub const FAMILIES: [Family; 4] = [Family::Equilateral, Family::Diagonal, Family::UnionJack, Family::Irregular];

/// The rectangle from the origin to (`width`, `height`), with `n` cells along x.
pub fn rectangle(family: Family, n: usize, width: f64, height: f64) -> Sheet {
    let rows = ((n as f64 * height / width).round() as usize).max(1);
    match family {
        Family::Equilateral => stretched(n, width, height),
        Family::Diagonal => squares(n, rows, width, height, |_, _| true),
        Family::UnionJack => squares(n, rows, width, height, |i, j| (i + j) % 2 == 0),
        Family::Irregular => jittered(n, width, height, 0.25),
    }
}

fn stretched(n: usize, width: f64, height: f64) -> Sheet {
    let edge = width / n as f64;
    let rows = (2 * (height / (edge * 3f64.sqrt())).round() as usize).max(2);
    let (mut positions, triangles) = equilateral_sheet(n, rows, edge);
    let top = rows as f64 * edge * 3f64.sqrt() / 2.0;
    positions.iter_mut().for_each(|x| x.y *= height / top);
    (positions, triangles)
}

fn squares(nx: usize, ny: usize, width: f64, height: f64, rising: impl Fn(usize, usize) -> bool) -> Sheet {
    let mut positions = vec![];
    for j in 0..=ny {
        let y = height * j as f64 / ny as f64;
        positions.extend((0..=nx).map(|i| Vec3::new(width * i as f64 / nx as f64, y, 0.0)));
    }
    let at = |i: usize, j: usize| (j * (nx + 1) + i) as u32;
    let mut triangles = vec![];
    for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend(if rising(i, j) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
    }
    (positions, triangles)
}

/// Merges the vertices at x = `width` with those at 0.
pub fn closed((positions, triangles): Sheet, width: f64) -> Sheet {
    let mut known: HashMap<[i64; 2], u32> = HashMap::new();
    let (mut kept, mut index) = (vec![], vec![]);
    for x in positions {
        let at = Vec3::new(if x.x > width * (1.0 - 1e-9) { 0.0 } else { x.x }, x.y, 0.0);
        let key = [at.x, at.y].map(|c| (c / width * 1e7).round() as i64);
        index.push(*known.entry(key).or_insert_with(|| {
            kept.push(at);
            kept.len() as u32 - 1
        }));
    }
    let triangles = triangles.iter().map(|t| t.map(|v| index[v as usize])).collect();
    (kept, triangles)
}

/// Inner vertices moved by up to `jitter` edges along x and y, then flipped until every edge is Delaunay's.
pub fn jittered(n: usize, width: f64, height: f64, jitter: f64) -> Sheet {
    let (mut positions, mut triangles) = stretched(n, width, height);
    let mut random = StdRng::seed_from_u64(1);
    let edge = width / n as f64;
    let inside = |x: f64, end: f64| x > 0.6 * edge && x < end - 0.6 * edge;
    for x in positions.iter_mut().filter(|x| inside(x.x, width) && inside(x.y, height)) {
        x.x += jitter * edge * random.random_range(-1.0..1.0);
        x.y += jitter * edge * random.random_range(-1.0..1.0);
    }
    while flip_one_round(&positions, &mut triangles) {}
    (positions, triangles)
}

/// Flips edges that are not locally Delaunay's, each triangle once; whether there were any.
fn flip_one_round(x: &[Vec3], triangles: &mut [[u32; 3]]) -> bool {
    let mut half: HashMap<[u32; 2], (usize, u32)> = HashMap::new();
    for (t, [a, b, c]) in triangles.iter().enumerate() {
        [([*a, *b], *c), ([*b, *c], *a), ([*c, *a], *b)].iter().for_each(|(edge, far)| {
            half.insert(*edge, (t, *far));
        });
    }
    let mut edges: Vec<[u32; 2]> = half.keys().copied().filter(|[a, b]| a < b).collect();
    edges.sort_unstable();
    let (mut used, mut any) = (vec![false; triangles.len()], false);
    for [a, b] in edges {
        let (Some(&(t, c)), Some(&(s, d))) = (half.get(&[a, b]), half.get(&[b, a])) else { continue };
        let angle = |at: u32| {
            let (p, q) = (x[a as usize] - x[at as usize], x[b as usize] - x[at as usize]);
            p.cross(&q).norm().atan2(p.dot(&q))
        };
        if !used[t] && !used[s] && angle(c) + angle(d) > std::f64::consts::PI + 1e-9 {
            (triangles[t], triangles[s]) = ([c, a, d], [d, b, c]);
            (used[t], used[s], any) = (true, true, true);
        }
    }
    any
}

/// Rayleigh and Ritz with 14 Legendre polynomials each way, good to the digits given; Leissa's (1973) are up to 0.7 % higher.
/// ν, then the square clamped on one side, then the free one.
pub const SQUARES: [(f64, [f64; 5], [f64; 6]); 3] = [
    (0.0, [3.5160, 9.6757, 22.0345, 28.3466, 33.7026], [15.8226, 22.3733, 22.3733, 38.6943, 38.6943, 61.6728]),
    (0.3, [3.4710, 8.5067, 21.2850, 27.1989, 30.9563], [13.4682, 19.5961, 24.2702, 34.8009, 34.8009, 61.0932]),
    (0.49, [3.3805, 7.5622, 19.7674, 26.3371, 28.2522], [11.5992, 17.2085, 24.9355, 31.0239, 31.0239, 57.7034]),
];

/// The square supported on all sides, π² (i² + j²), whatever ν.
pub const SUPPORTED: [f64; 4] = [19.7392, 49.3480, 49.3480, 78.9568];

/// The square clamped on all sides, whatever ν; Leissa's (1973) are up to 0.05 % higher.
pub const CLAMPED: [f64; 4] = [35.9852, 73.3938, 73.3938, 108.2165];

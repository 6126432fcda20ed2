//! Which triangles hang together at which sides: at most two at a side, all turned the same way.

use super::soup::{Soup, low_high};
use crate::collider::sort_triangles;
use crate::mesh::{NONE, UnionFind};
use crate::{Error, ErrorKind, Result, Vec3};
use std::collections::VecDeque;

/// A manifold: half-edge 3t + k runs from corner k of triangle t to the next.
pub struct Manifold {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The half-edge that runs back, [`NONE`] on the boundary.
    pub twins: Vec<u32>,
    /// Of each vertex here, the vertex of the soup.
    pub soup: Vec<u32>,
    /// Edges of more than two triangles, vertices where sheets met in a point, and edges that close a one-sided strip.
    pub n_cut: usize,
}

/// Two triangles go on across an edge where they lie this flat, by the cosine between their ways from it.
const GOES_ON: f64 = -0.3;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    edge: [u32; 2],
    half: u32,
    forward: bool,
}

/// The half-edges of each edge together.
fn sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let of = |half: usize| {
        let (tri, k) = (triangles[half / 3], half % 3);
        let (a, b) = (tri[k], tri[(k + 1) % 3]);
        Side { edge: low_high(a, b), half: half as u32, forward: a < b }
    };
    let mut sides: Vec<Side> = (0..3 * triangles.len()).map(of).collect();
    sides.sort_unstable();
    sides
}

/// From an edge into the triangle, across it.
fn way(soup: &Soup, side: &Side) -> Vec3 {
    let [a, b] = side.edge.map(|v| soup.positions[v as usize]);
    let half = side.half as usize;
    let c = soup.positions[soup.triangles[half / 3][(half + 2) % 3] as usize];
    let along = (b - a).normalize();
    let across = (c - a) - along * (c - a).dot(&along);
    across.try_normalize(0.0).unwrap_or_default()
}

/// Which pairs of many sides go on into each other, the flattest first.
fn flattest_pairs(soup: &Soup, at: &[Side]) -> Vec<[u32; 2]> {
    const MOST: usize = 64; // of a fan at one edge, so that the search is short
    let at = &at[..at.len().min(MOST)];
    let ways: Vec<Vec3> = at.iter().map(|side| way(soup, side)).collect();
    let mut pairs: Vec<(f64, usize, usize)> = vec![];
    for i in 0..at.len() {
        pairs.extend((i + 1..at.len()).map(|j| (ways[i].dot(&ways[j]), i, j)).filter(|(dot, ..)| *dot < GOES_ON));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut taken = vec![false; at.len()];
    let mut out = vec![];
    for (_, i, j) in pairs {
        if !taken[i] && !taken[j] {
            (taken[i], taken[j]) = (true, true);
            out.push([at[i].half, at[j].half]);
        }
    }
    out
}

fn refused(message: String) -> Error {
    Error::new(ErrorKind::InvalidMesh, message)
}

impl Manifold {
    /// Of a soup. Without `cut` it fails where a sheet cannot be a manifold, naming the place.
    pub fn new(soup: &Soup, cut: bool) -> Result<Self> {
        let mut neighbours = vec![NONE; 3 * soup.triangles.len()];
        let mut n_cut = 0;
        let sides = sides(&soup.triangles);
        let mut many = sides.chunk_by(|a, b| a.edge == b.edge).filter(|at| at.len() > 2);
        if let (false, Some(first)) = (cut, many.next()) {
            let [a, b] = first[0].edge.map(|v| soup.place(v));
            let (n, more) = (first.len(), many.count());
            return Err(refused(format!(
                "{n} triangles meet at the edge from {a} to {b}, and more than two at {more} other edges: delete what \
                 hangs there, or let the proxy be cut"
            )));
        }
        for at in sides.chunk_by(|a, b| a.edge == b.edge) {
            let pairs = match at {
                [one, other] => vec![[one.half, other.half]],
                [_] => vec![],
                _ => flattest_pairs(soup, at),
            };
            n_cut += usize::from(at.len() > 2);
            for [h, g] in pairs {
                (neighbours[h as usize], neighbours[g as usize]) = (g, h);
            }
        }
        let turned = orient(soup, &mut neighbours, cut, &mut n_cut)?;
        loop {
            let made = Self::split(soup, &neighbours, &turned, cut, n_cut)?;
            // A fan that comes by the same edge twice is parted there, and with it the edge.
            let mut parted = false;
            for at in self::sides(&made.triangles).chunk_by(|a, b| a.edge == b.edge).filter(|at| at.len() > 2) {
                for side in at {
                    let (t, k) = (side.half / 3, side.half % 3);
                    let half = 3 * t + if turned[t as usize] { 2 - k } else { k };
                    let other = std::mem::replace(&mut neighbours[half as usize], NONE);
                    if other != NONE {
                        neighbours[other as usize] = NONE;
                        parted = true;
                    }
                }
            }
            if !parted {
                return Ok(made);
            }
            n_cut += 1;
        }
    }

    /// A vertex for each fan of triangles, and triangles turned as they are to be.
    fn split(soup: &Soup, neighbours: &[u32], turned: &[bool], cut: bool, mut n_cut: usize) -> Result<Self> {
        let corner = |half: u32, v: u32| {
            let tri = soup.triangles[half as usize / 3];
            half / 3 * 3 + (0..3u32).find(|k| tri[*k as usize] == v).unwrap_or(0)
        };
        let mut fans = UnionFind::new(neighbours.len());
        for (half, &other) in neighbours.iter().enumerate().filter(|(_, other)| **other != NONE) {
            let half = half as u32;
            let tri = soup.triangles[half as usize / 3];
            for v in [tri[half as usize % 3], tri[(half as usize + 1) % 3]] {
                fans.join(corner(half, v), corner(other, v));
            }
        }
        let (mut fan_vertex, mut first) = (vec![NONE; neighbours.len()], vec![NONE; soup.positions.len()]);
        let mut made = Self { positions: vec![], triangles: vec![], twins: vec![], soup: vec![], n_cut: 0 };
        for (t, tri) in soup.triangles.iter().enumerate() {
            let corners = [0, 1, 2].map(|k| {
                let root = fans.find((3 * t + k) as u32) as usize;
                let v = tri[k] as usize;
                if fan_vertex[root] == NONE {
                    fan_vertex[root] = made.positions.len() as u32;
                    made.positions.push(soup.positions[v]);
                    made.soup.push(tri[k]);
                    if first[v] == NONE {
                        first[v] = fan_vertex[root];
                    }
                }
                fan_vertex[root]
            });
            let [a, b, c] = corners;
            made.triangles.push(if turned[t] { [a, c, b] } else { corners });
        }
        let apart = made.positions.len() - first.iter().filter(|v| **v != NONE).count();
        let lone = (0..made.soup.len()).find(|v| first[made.soup[*v] as usize] != *v as u32);
        if let (false, Some(v)) = (cut, lone) {
            let place = soup.place(made.soup[v]);
            let others = if apart > 1 { format!(", and at {} others", apart - 1) } else { String::new() };
            return Err(refused(format!(
                "sheets touch in a point at {place}{others}: join or part them there, or let the proxy be cut"
            )));
        }
        n_cut += if n_cut == 0 { apart } else { 0 };
        made.n_cut = n_cut;
        made.link();
        Ok(made)
    }

    /// Twins from the triangles.
    fn link(&mut self) {
        self.twins = vec![NONE; 3 * self.triangles.len()];
        for at in sides(&self.triangles).chunk_by(|a, b| a.edge == b.edge) {
            if let [one, other] = at
                && one.forward != other.forward
            {
                (self.twins[one.half as usize], self.twins[other.half as usize]) = (other.half, one.half);
            }
        }
    }

    /// The number of each vertex's piece, and how many there are.
    pub fn pieces(&self) -> (Vec<u32>, usize) {
        let mut sets = UnionFind::new(self.positions.len());
        for [a, b, c] in &self.triangles {
            sets.join(*a, *b);
            sets.join(*b, *c);
        }
        let mut number = vec![NONE; self.positions.len()];
        let mut count = 0;
        for v in 0..number.len() {
            let root = sets.find(v as u32) as usize;
            if number[root] == NONE {
                number[root] = count;
                count += 1;
            }
            number[v] = number[root];
        }
        (number, count as usize)
    }

    /// Only the triangles wanted, with the vertices that they need.
    pub fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        let mut number = vec![NONE; self.positions.len()];
        let (positions, soup) = (std::mem::take(&mut self.positions), std::mem::take(&mut self.soup));
        let triangles = std::mem::take(&mut self.triangles);
        for (_, tri) in triangles.into_iter().enumerate().filter(|(t, _)| wanted(*t)) {
            self.triangles.push(tri.map(|v| {
                if number[v as usize] == NONE {
                    number[v as usize] = self.positions.len() as u32;
                    self.positions.push(positions[v as usize]);
                    self.soup.push(soup[v as usize]);
                }
                number[v as usize]
            }));
        }
        self.link();
    }
}

/// Closes holes that are less than three edges of the proxy around, by a fan about their middle; how many these are. A piece's longest boundary stays.
pub fn close_holes(manifold: &mut Manifold, edge: impl Fn(&Manifold) -> Result<f64>) -> Result<usize> {
    const AROUND: f64 = 3.0;
    let loops = boundaries(manifold);
    if loops.is_empty() {
        return Ok(0);
    }
    let (piece, n_pieces) = manifold.pieces();
    let around = |l: &Vec<u32>| -> f64 {
        let at = |i: usize| manifold.positions[l[i % l.len()] as usize];
        (0..l.len()).map(|i| (at(i + 1) - at(i)).norm()).sum()
    };
    let lengths: Vec<f64> = loops.iter().map(around).collect();
    let mut longest = vec![0.0; n_pieces];
    for (l, length) in loops.iter().zip(&lengths) {
        let of = &mut longest[piece[l[0] as usize] as usize];
        *of = f64::max(*of, *length);
    }
    let limit = AROUND * edge(manifold)?;
    let mut closed = 0;
    for (l, length) in loops.iter().zip(&lengths) {
        if *length >= limit || *length >= longest[piece[l[0] as usize] as usize] {
            continue;
        }
        closed += 1;
        let middle = manifold.positions.len() as u32;
        manifold.positions.push(l.iter().map(|v| manifold.positions[*v as usize]).sum::<Vec3>() / l.len() as f64);
        manifold.soup.push(manifold.soup[l[0] as usize]);
        manifold.triangles.extend((0..l.len()).map(|i| [l[(i + 1) % l.len()], l[i], middle]));
    }
    if closed > 0 {
        sort_triangles(&manifold.positions, &mut manifold.triangles);
        manifold.link();
    }
    Ok(closed)
}

/// The vertices of each boundary in turn, along its half-edges.
fn boundaries(manifold: &Manifold) -> Vec<Vec<u32>> {
    let ends = |h: usize| [h, (h + 1) % 3 + h / 3 * 3].map(|c| manifold.triangles[c / 3][c % 3]);
    let mut onward = vec![NONE; manifold.positions.len()];
    for h in (0..manifold.twins.len()).filter(|h| manifold.twins[*h] == NONE) {
        let [a, b] = ends(h);
        onward[a as usize] = b;
    }
    let mut loops = vec![];
    for start in 0..onward.len() {
        let (mut at, mut found) = (start as u32, vec![]);
        while onward[at as usize] != NONE {
            found.push(at);
            at = std::mem::replace(&mut onward[at as usize], NONE);
        }
        if found.len() > 2 && at as usize == start {
            loops.push(found);
        }
    }
    loops
}

/// Which triangles to turn so that neighbours run along their edge in opposite directions. Neighbours that cannot are parted, with `cut`.
fn orient(soup: &Soup, neighbours: &mut [u32], cut: bool, n_cut: &mut usize) -> Result<Vec<bool>> {
    let n = soup.triangles.len();
    let runs = |half: u32| {
        let tri = soup.triangles[half as usize / 3];
        tri[half as usize % 3] < tri[(half as usize + 1) % 3]
    };
    let mut turned: Vec<Option<bool>> = vec![None; n];
    let mut open = VecDeque::new();
    for seed in 0..n {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        open.push_back(seed as u32);
        while let Some(t) = open.pop_front() {
            let own = turned[t as usize] == Some(true);
            for half in 3 * t..3 * t + 3 {
                let other = neighbours[half as usize];
                if other == NONE {
                    continue;
                }
                let wanted = own ^ (runs(half) == runs(other));
                match turned[other as usize / 3] {
                    None => {
                        turned[other as usize / 3] = Some(wanted);
                        open.push_back(other / 3);
                    }
                    Some(has) if has != wanted => {
                        if !cut {
                            let [a, b] = [half % 3, (half + 1) % 3].map(|k| soup.triangles[t as usize][k as usize]);
                            return Err(refused(format!(
                                "a strip with one side closes at the edge from {} to {}: cut it across, or let the proxy be cut",
                                soup.place(a),
                                soup.place(b)
                            )));
                        }
                        (neighbours[half as usize], neighbours[other as usize]) = (NONE, NONE);
                        *n_cut += 1;
                    }
                    Some(_) => {}
                }
            }
        }
    }
    Ok(turned.into_iter().map(|t| t == Some(true)).collect())
}

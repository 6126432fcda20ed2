//! Lines that a proxy keeps: boundaries, creases that are sharp at the proxy's own scale, and the outline of what supports hold.

use super::edit::Place;
use super::ground::Ground;
use super::link::Manifold;
use super::soup::low_high;
use crate::collider::{Nearest, Tree, sort_triangles};
use crate::mesh::{NONE, UnionFind};
use crate::{Result, Vec3};
use std::collections::HashMap;

/// Cosines below which an edge is a crease, at the asset's scale and at the proxy's.
const CREASED: [f64; 2] = [0.71, 0.77];
/// A crease shorter than so many edges of the proxy is none.
const SHORTEST_CREASE: f64 = 2.0;
/// Cosine of the turn, over half an edge of the proxy to each side, that makes a corner of a line.
const CORNER: f64 = 0.71;
/// Loops shorter than so many edges have no corners.
const SMALL_LOOP: f64 = 4.0;
/// What is held is narrow where it is not so many edges of the proxy wide: its outline would lie too near another line.
const NARROW: f64 = 0.4;
/// Of the mean of directions to all around: a cone of 45 degrees to its axis has the cosine of that.
const POINTED: f64 = 0.71;

/// Which lines there are beside boundaries.
#[derive(Clone, Copy)]
pub struct Kept<'a> {
    /// Where there are more, the surface is rough at this scale, and none is kept.
    pub most_tips: usize,
    pub creases: bool,
    /// Vertices whose outline is one (n_vertices, or none).
    pub held: &'a [bool],
}

/// The lines of a manifold.
pub struct Lines {
    /// Of each half-edge, its line, or [`NONE`].
    pub of_half: Vec<u32>,
    pub places: Vec<Place>,
    /// A segment a-b as the triangle a b b.
    segments: Vec<[u32; 3]>,
    line_of: Vec<u32>,
    tree: Option<Tree>,
    /// Whether there are others among them than boundaries.
    pub any_inner: bool,
}

/// Vertices of a line in turn.
struct Chain {
    vertices: Vec<u32>,
    closed: bool,
}

impl Lines {
    /// At the scale of edges of length `edge`.
    pub fn new(manifold: &Manifold, ground: &Ground, edge: f64, kept: Kept) -> Result<Self> {
        let mut edges: Vec<u32> = vec![];
        let length = |h: u32| {
            let [a, b] = ends(manifold, h).map(|v| manifold.positions[v as usize]);
            (b - a).norm()
        };
        for h in (0..manifold.twins.len() as u32).filter(|h| manifold.twins[*h as usize] == NONE) {
            edges.push(h);
        }
        let mut inner = if kept.creases { creases(manifold, ground, edge, length) } else { vec![] };
        if !kept.held.is_empty() {
            inner.extend(outline(manifold, kept.held, edge, length));
            inner.sort_unstable();
            inner.dedup();
        }
        let any_inner = !inner.is_empty();
        edges.extend(inner);
        let mut lines = Self {
            of_half: vec![NONE; manifold.twins.len()],
            places: vec![Place::Free; manifold.positions.len()],
            segments: vec![],
            line_of: vec![],
            tree: None,
            any_inner,
        };
        lines.trace(manifold, &edges, edge);
        if !kept.held.is_empty() {
            lines.ends_of_held(manifold, kept.held, edge);
        }
        for v in if kept.most_tips > 0 { tips(manifold, edge, kept.most_tips) } else { vec![] } {
            if lines.places[v as usize] == Place::Free {
                lines.places[v as usize] = Place::Corner;
                lines.any_inner = true;
            }
        }
        lines.plant(manifold, &edges)?;
        Ok(lines)
    }

    /// The nearest point of a line.
    pub fn nearest(&self, positions: &[Vec3], p: &Vec3, line: u32) -> Option<Vec3> {
        let tree = self.tree.as_ref()?;
        let accept = |s: usize| self.line_of[s] == line;
        let found = tree.nearest_where(positions, &self.segments, p, Nearest::within(f64::INFINITY), accept);
        (found.triangle != usize::MAX).then(|| found.foot(positions, &self.segments))
    }

    /// Numbers the lines, and finds the corners between and on them.
    fn trace(&mut self, manifold: &Manifold, edges: &[u32], edge: f64) {
        let mut at: Vec<(u32, u32)> = vec![]; // vertex and half-edge
        for &h in edges {
            let [a, b] = ends(manifold, h);
            at.extend([(a, h), (b, h)]);
        }
        at.sort_unstable();
        let range = |v: u32| at.partition_point(|(w, _)| *w < v)..at.partition_point(|(w, _)| *w <= v);
        let mut count = 0;
        let mut starts: Vec<u32> = at.chunk_by(|a, b| a.0 == b.0).filter(|c| c.len() != 2).map(|c| c[0].0).collect();
        let n_ends = starts.len();
        starts.extend(at.chunk_by(|a, b| a.0 == b.0).filter(|c| c.len() == 2).map(|c| c[0].0));
        at.iter().for_each(|(v, _)| self.places[*v as usize] = Place::Line);
        starts[..n_ends].iter().for_each(|v| self.places[*v as usize] = Place::Corner);
        for (k, &start) in starts.iter().enumerate() {
            for i in range(start) {
                let mut h = at[i].1;
                if self.of_half[h as usize] != NONE {
                    continue;
                }
                let mut chain = Chain { vertices: vec![start], closed: k >= n_ends };
                let mut v = start;
                loop {
                    self.of_half[h as usize] = count;
                    if manifold.twins[h as usize] != NONE {
                        self.of_half[manifold.twins[h as usize] as usize] = count;
                    }
                    let [a, b] = ends(manifold, h);
                    v = if a == v { b } else { a };
                    let on = &at[range(v)];
                    let onward = on.iter().find(|(_, g)| self.of_half[*g as usize] == NONE);
                    if v == start && chain.closed {
                        break;
                    }
                    chain.vertices.push(v);
                    match onward {
                        Some((_, g)) if on.len() == 2 => h = *g,
                        _ => break,
                    }
                }
                self.corners(manifold, &chain, edge);
                count += 1;
            }
        }
    }

    /// Marks where a line turns sharply, the sharpest first.
    fn corners(&mut self, manifold: &Manifold, chain: &Chain, edge: f64) {
        let n = chain.vertices.len();
        let x = |i: usize| manifold.positions[chain.vertices[i % n] as usize];
        let segments = if chain.closed { n } else { n - 1 };
        let total: f64 = (0..segments).map(|i| (x(i + 1) - x(i)).norm()).sum();
        if n < 3 || (chain.closed && total < SMALL_LOOP * edge) {
            return;
        }
        let reach = 0.5 * edge;
        // The place so far along the line, forward or backward, and how many vertices lie before it.
        let walk = |from: usize, forward: bool| {
            let (mut left, mut i, mut passed) = (reach, from, 0);
            loop {
                let stop = !chain.closed && if forward { i + 1 == n } else { i == 0 };
                if stop || passed == n {
                    return (x(i), passed);
                }
                let next = if forward { (i + 1) % n } else { (i + n - 1) % n };
                let step = x(next) - x(i);
                let length = step.norm();
                if length >= left {
                    return (x(i) + step * (left / length), passed);
                }
                left -= length;
                i = next;
                passed += 1;
            }
        };
        let inner = if chain.closed { 0..n } else { 1..n - 1 };
        let mut sharp: Vec<(f64, usize)> = inner
            .filter_map(|i| {
                let (before, after) = (x(i) - walk(i, false).0, walk(i, true).0 - x(i));
                let cosine = before.dot(&after) / (before.norm() * after.norm());
                (cosine < CORNER).then_some((cosine, i))
            })
            .collect();
        sharp.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut blocked = vec![false; n];
        for (_, i) in sharp {
            if blocked[i] {
                continue;
            }
            self.places[chain.vertices[i] as usize] = Place::Corner;
            for forward in [false, true] {
                for k in 0..=walk(i, forward).1 {
                    blocked[if forward { (i + k) % n } else { (i + n - k % n) % n }] = true;
                }
            }
        }
    }

    /// Corners where what is held begins and ends along a boundary, if it goes on for as long as an edge of the proxy.
    fn ends_of_held(&mut self, manifold: &Manifold, held: &[bool], edge: f64) {
        let n = manifold.positions.len();
        let mut around = vec![[NONE; 2]; n];
        for h in (0..manifold.twins.len() as u32).filter(|h| manifold.twins[*h as usize] == NONE) {
            let [a, b] = ends(manifold, h);
            (around[a as usize][1], around[b as usize][0]) = (b, a);
        }
        let is_held = |v: u32| v != NONE && held[v as usize];
        let goes_on = |first: u32, way: usize| {
            let (mut v, mut length) = (first, 0.0);
            for _ in 0..n {
                let next = around[v as usize][way];
                if !is_held(next) || length >= edge {
                    break;
                }
                length += (manifold.positions[next as usize] - manifold.positions[v as usize]).norm();
                v = next;
            }
            length >= edge
        };
        for v in (0..n as u32).filter(|v| held[*v as usize] && around[*v as usize] != [NONE; 2]) {
            let [before, after] = around[v as usize].map(is_held);
            if before != after && goes_on(v, usize::from(after)) {
                self.places[v as usize] = Place::Corner;
            }
        }
    }

    fn plant(&mut self, manifold: &Manifold, edges: &[u32]) -> Result<()> {
        if edges.is_empty() {
            return Ok(());
        }
        let mut lines = HashMap::new();
        for &h in edges {
            let [a, b] = ends(manifold, h);
            lines.insert(low_high(a, b), self.of_half[h as usize]);
            self.segments.push([a, b, b]);
        }
        sort_triangles(&manifold.positions, &mut self.segments);
        self.line_of = self.segments.iter().map(|[a, b, _]| lines[&low_high(*a, *b)]).collect();
        self.tree = Some(Tree::new(&manifold.positions, &self.segments)?);
        Ok(())
    }
}

fn ends(manifold: &Manifold, h: u32) -> [u32; 2] {
    let (tri, k) = (manifold.triangles[h as usize / 3], h as usize % 3);
    [tri[k], tri[(k + 1) % 3]]
}

/// Edges between vertices that are held, but for those inside what is held, of regions that are neither small nor narrow.
fn outline(manifold: &Manifold, held: &[bool], edge: f64, length: impl Fn(u32) -> f64) -> Vec<u32> {
    let whole = |t: usize| manifold.triangles[t].iter().all(|v| held[*v as usize]);
    let on_outline = |h: &u32| {
        let g = manifold.twins[*h as usize];
        let both = ends(manifold, *h).iter().all(|v| held[*v as usize]);
        g != NONE && *h < g && both && !(whole(*h as usize / 3) && whole(g as usize / 3))
    };
    let mut found: Vec<u32> = (0..manifold.twins.len() as u32).filter(on_outline).collect();
    let mut sets = UnionFind::new(manifold.positions.len());
    let inside: Vec<usize> = (0..manifold.triangles.len()).filter(|t| whole(*t)).collect();
    found.iter().map(|h| ends(manifold, *h)).for_each(|[a, b]| sets.join(a, b));
    for [a, b, c] in inside.iter().map(|t| manifold.triangles[*t]) {
        sets.join(a, b);
        sets.join(b, c);
    }
    let mut sizes: HashMap<u32, (f64, f64)> = HashMap::new(); // length and area
    for &h in &found {
        sizes.entry(sets.find(ends(manifold, h)[0])).or_default().0 += length(h);
    }
    for &t in &inside {
        let [a, b, c] = manifold.triangles[t].map(|v| manifold.positions[v as usize]);
        sizes.entry(sets.find(manifold.triangles[t][0])).or_default().1 += 0.5 * (b - a).cross(&(c - a)).norm();
    }
    found.retain(|h| {
        let (length, area) = sizes[&sets.find(ends(manifold, *h)[0])];
        length >= SHORTEST_CREASE * edge && (area == 0.0 || area >= NARROW * edge * length)
    });
    found
}

/// The ends of what is pointed at the scale of `edge`, such as a hat's or a tail's: vertices around which all within an edge lies to one side, the most
/// pointed first and no two within an edge. A proxy without them is shorter.
fn tips(manifold: &Manifold, edge: f64, most: usize) -> Vec<u32> {
    let n = manifold.positions.len();
    let mut around: Vec<Vec<u32>> = vec![vec![]; n];
    let mut open = vec![false; n];
    for h in 0..manifold.twins.len() as u32 {
        let [a, b] = self::ends(manifold, h);
        around[a as usize].push(b);
        around[b as usize].push(a);
        if manifold.twins[h as usize] == NONE {
            (open[a as usize], open[b as usize]) = (true, true);
        }
    }
    let mut seen = vec![NONE; n];
    let mut ball = vec![];
    let mut pointed: Vec<(f64, u32)> = vec![];
    for v in (0..n).filter(|v| !open[*v]) {
        let x = manifold.positions[v];
        ball.clear();
        ball.push(v as u32);
        seen[v] = v as u32;
        let (mut sum, mut count, mut at, mut ends) = (Vec3::zeros(), 0.0, 0, false);
        while at < ball.len() && !ends {
            for &w in &around[ball[at] as usize] {
                ends |= open[w as usize];
                if std::mem::replace(&mut seen[w as usize], v as u32) == v as u32 {
                    continue;
                }
                let way = manifold.positions[w as usize] - x;
                let away = way.norm();
                if away > 0.5 * edge {
                    // Beyond the ball and the ring around it nothing is looked at.
                    sum += way / away;
                    count += 1.0;
                }
                if away <= edge {
                    ball.push(w);
                }
            }
            at += 1;
        }
        let sharpness = sum.norm() / f64::max(count, 1.0);
        if sharpness > POINTED && !ends {
            pointed.push((sharpness, v as u32));
        }
    }
    pointed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut found: Vec<u32> = vec![];
    for (_, v) in pointed {
        let x = manifold.positions[v as usize];
        if found.iter().all(|w| (manifold.positions[*w as usize] - x).norm() > edge) {
            found.push(v);
        }
    }
    if found.len() <= most { found } else { vec![] }
}

/// Edges between triangles at an angle that is there, too, half an edge of the proxy away from them.
fn creases(manifold: &Manifold, ground: &Ground, edge: f64, length: impl Fn(u32) -> f64) -> Vec<u32> {
    let mut found = vec![];
    for h in 0..manifold.twins.len() as u32 {
        let g = manifold.twins[h as usize];
        if g == NONE || g < h {
            continue;
        }
        let [t, s] = [h as usize / 3, g as usize / 3];
        if ground.normals[t].dot(&ground.normals[s]) >= CREASED[0] {
            continue;
        }
        let [a, b] = ends(manifold, h).map(|v| manifold.positions[v as usize]);
        let middle = 0.5 * (a + b);
        let beside = |triangle: usize| {
            let n = ground.normals[triangle];
            let inward = n.cross(&(b - a)).try_normalize(0.0)?;
            let inward = if inward.dot(&(ground.centroid(triangle) - middle)) < 0.0 { -inward } else { inward };
            let there = ground.facing(&(middle + 0.5 * edge * inward), &n, triangle as u32, edge)?;
            Some(ground.normals[there.triangle as usize])
        };
        if let (Some(n), Some(m)) = (beside(t), beside(s))
            && n.dot(&m) < CREASED[1]
        {
            found.push(h);
        }
    }
    let mut sets = UnionFind::new(manifold.positions.len());
    found.iter().map(|h| ends(manifold, *h)).for_each(|[a, b]| sets.join(a, b));
    let mut lengths: HashMap<u32, f64> = HashMap::new();
    for &h in &found {
        *lengths.entry(sets.find(ends(manifold, h)[0])).or_default() += length(h);
    }
    found.retain(|h| lengths[&sets.find(ends(manifold, *h)[0])] >= SHORTEST_CREASE * edge);
    found
}

//! A triangle manifold whose edges are split, collapsed and flipped.
//!
//! Half-edge 3t + k runs from corner k of triangle t to the next; its twin runs back. A dead triangle has [`NONE`] for corners.

use super::link::Manifold;
use crate::Vec3;
use crate::mesh::NONE;

/// Of a vertex: it goes anywhere on the surface, along its line, or nowhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    Free,
    Line,
    Corner,
}

#[derive(Clone)]
pub struct Edit {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub twins: Vec<u32>,
    /// A half-edge that begins at each vertex; [`NONE`] at dead ones.
    outs: Vec<u32>,
    /// Of each half-edge, the line that it is on: boundaries and creases. [`NONE`] for most.
    pub lines: Vec<u32>,
    pub places: Vec<Place>,
    /// Of each vertex, a triangle of the ground that it is near.
    pub near: Vec<u32>,
    marks: Vec<u32>,
    mark: u32,
    pub n_alive: usize,
}

/// The most triangles at a vertex that is changed.
pub const WIDEST: usize = 256;

#[inline]
pub fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

#[inline]
pub fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

pub fn span(a: &Vec3, b: &Vec3, c: &Vec3) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// 4√3 A / Σl², 1 for equilateral triangles.
pub fn quality(a: &Vec3, b: &Vec3, c: &Vec3) -> f64 {
    let sides = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
    if sides > 0.0 { 2.0 * 3f64.sqrt() * span(a, b, c).norm() / sides } else { 0.0 }
}

impl Edit {
    /// `near` has a triangle of the ground for each vertex.
    pub fn new(manifold: &Manifold, near: Vec<u32>) -> Self {
        let n = manifold.positions.len();
        let mut outs = vec![NONE; n];
        for h in 0..3 * manifold.triangles.len() {
            outs[manifold.triangles[h / 3][h % 3] as usize] = h as u32;
        }
        Self {
            positions: manifold.positions.clone(),
            triangles: manifold.triangles.clone(),
            twins: manifold.twins.clone(),
            outs,
            lines: vec![NONE; manifold.twins.len()],
            places: vec![Place::Free; n],
            near,
            marks: vec![0; n],
            mark: 0,
            n_alive: n,
        }
    }

    pub fn is_alive(&self, h: u32) -> bool {
        self.triangles[h as usize / 3][0] != NONE
    }

    #[inline]
    pub fn from(&self, h: u32) -> u32 {
        self.triangles[h as usize / 3][h as usize % 3]
    }

    #[inline]
    pub fn to(&self, h: u32) -> u32 {
        self.from(next(h))
    }

    /// The corner across.
    #[inline]
    pub fn apex(&self, h: u32) -> u32 {
        self.from(previous(h))
    }

    #[inline]
    pub fn at(&self, v: u32) -> &Vec3 {
        &self.positions[v as usize]
    }

    pub fn squared(&self, h: u32) -> f64 {
        (self.at(self.to(h)) - self.at(self.from(h))).norm_squared()
    }

    /// Of the two half-edges of an edge, the one that stands for it.
    pub fn stands(&self, h: u32) -> bool {
        let twin = self.twins[h as usize];
        self.is_alive(h) && (twin == NONE || h < twin)
    }

    /// The half-edges that begin at a vertex, in turn; of one on the boundary from side to side. Whether it is on the boundary. None for more than [`WIDEST`]: what is
    /// done at such a vertex would take too long, and its neighbours are changed instead.
    pub fn fan(&self, v: u32, out: &mut Vec<u32>) -> Option<bool> {
        out.clear();
        let start = self.outs[v as usize];
        if start == NONE {
            return None;
        }
        // Back to the side where nothing comes before.
        let (mut first, mut open) = (start, false);
        for passed in 0.. {
            let twin = self.twins[first as usize];
            if twin == NONE {
                open = true;
                break;
            }
            first = next(twin);
            if first == start {
                break;
            }
            if passed == WIDEST {
                return None;
            }
        }
        let mut h = first;
        loop {
            out.push(h);
            let twin = self.twins[previous(h) as usize];
            if twin == NONE || twin == first {
                return Some(open);
            }
            if out.len() == WIDEST {
                return None;
            }
            h = twin;
        }
    }

    /// The vertices around one, of its fan.
    pub fn ring<'a>(&'a self, fan: &'a [u32], open: bool) -> impl Iterator<Item = u32> + 'a {
        let last = if open { fan.last().map(|h| self.apex(*h)) } else { None };
        fan.iter().map(|h| self.to(*h)).chain(last)
    }

    fn pair(&mut self, h: u32, g: u32) {
        if h != NONE {
            self.twins[h as usize] = g;
        }
        if g != NONE {
            self.twins[g as usize] = h;
        }
    }

    fn new_triangle(&mut self, corners: [u32; 3]) -> u32 {
        let h = self.twins.len() as u32;
        self.triangles.push(corners);
        self.twins.extend([NONE; 3]);
        self.lines.extend([NONE; 3]);
        h
    }

    /// A new vertex in the middle of an edge.
    pub fn split(&mut self, h: u32) -> u32 {
        let (a, b) = (self.from(h), self.to(h));
        let m = self.positions.len() as u32;
        self.positions.push(0.5 * (self.at(a) + self.at(b)));
        self.places.push(if self.lines[h as usize] == NONE { Place::Free } else { Place::Line });
        self.near.push(self.near[a as usize]);
        self.marks.push(0);
        self.outs.push(NONE);
        self.n_alive += 1;
        let twin = self.twins[h as usize];
        let second = self.split_triangle(h, m);
        if twin == NONE {
            self.outs[b as usize] = next(second); // what began at b may have been in the old triangle
        } else {
            let other = self.split_triangle(twin, m);
            // h runs a–m, second m–b; twin b–m, other m–a.
            self.pair(h, other);
            self.pair(second, twin);
        }
        m
    }

    /// One of the two triangles: (a b c) becomes (a m c), and (m b c) is new. The half-edge m–b.
    fn split_triangle(&mut self, h: u32, m: u32) -> u32 {
        let (b, c) = (self.to(h), self.apex(h));
        let line = self.lines[h as usize];
        let (side, side_line) = (self.twins[next(h) as usize], self.lines[next(h) as usize]);
        let second = self.new_triangle([m, b, c]);
        self.triangles[h as usize / 3][next(h) as usize % 3] = m;
        self.pair(next(second), side);
        self.pair(next(h), previous(second));
        self.lines[second as usize] = line;
        self.lines[next(second) as usize] = side_line;
        self.lines[next(h) as usize] = NONE;
        self.outs[m as usize] = second;
        self.outs[b as usize] = next(second);
        self.outs[c as usize] = previous(second);
        second
    }

    /// The edge between the two corners across becomes the edge.
    pub fn flip(&mut self, h: u32) {
        let g = self.twins[h as usize];
        let (a, b, c, d) = (self.from(h), self.to(h), self.apex(h), self.apex(g));
        let sides = [next(h), previous(h), next(g), previous(g)]; // b–c, c–a, a–d, d–b
        let (twins, lines) = (sides.map(|s| self.twins[s as usize]), sides.map(|s| self.lines[s as usize]));
        let (t, s) = (h / 3, g / 3);
        self.triangles[t as usize] = [d, c, a];
        self.triangles[s as usize] = [c, d, b];
        let (p, q) = (3 * t, 3 * s);
        self.pair(p, q);
        // p+1: c–a, p+2: a–d, q+1: d–b, q+2: b–c.
        for (half, k) in [(p + 1, 1), (p + 2, 2), (q + 1, 3), (q + 2, 0)] {
            self.twins[half as usize] = twins[k];
            if twins[k] != NONE {
                self.twins[twins[k] as usize] = half;
            }
            self.lines[half as usize] = lines[k];
        }
        (self.lines[p as usize], self.lines[q as usize]) = (NONE, NONE);
        for (v, half) in [(a, p + 2), (b, q + 2), (c, p + 1), (d, q + 1)] {
            self.outs[v as usize] = half;
        }
    }

    /// Whether the mesh stays a manifold when `h`'s two ends become one: they have no neighbours in common but the corners across.
    pub fn may_collapse(&mut self, h: u32, fan_a: &[u32], open_a: bool, fan_b: &[u32], open_b: bool) -> bool {
        let twin = self.twins[h as usize];
        if open_a && open_b && twin != NONE {
            return false;
        }
        let across = [self.apex(h), if twin == NONE { NONE } else { self.apex(twin) }];
        self.mark += 1;
        for k in 0..fan_a.len() {
            let v = self.to(fan_a[k]);
            self.marks[v as usize] = self.mark;
        }
        if let (true, Some(last)) = (open_a, fan_a.last()) {
            let v = self.apex(*last);
            self.marks[v as usize] = self.mark;
        }
        if self.ring(fan_b, open_b).any(|v| self.marks[v as usize] == self.mark && !across.contains(&v)) {
            return false;
        }
        let mut fan = vec![];
        across.into_iter().filter(|v| *v != NONE).all(|v| match self.fan(v, &mut fan) {
            Some(open) => fan.len() > if open { 1 } else { 3 },
            None => true,
        })
    }

    /// The vertex that `h` begins at becomes the one where it ends.
    pub fn collapse(&mut self, h: u32, fan: &[u32]) {
        let (a, b) = (self.from(h), self.to(h));
        for &out in fan {
            self.triangles[out as usize / 3][out as usize % 3] = b;
        }
        let twin = self.twins[h as usize];
        self.close(h, b);
        if twin != NONE {
            self.close(twin, b);
        }
        self.outs[a as usize] = NONE;
        self.n_alive -= 1;
    }

    /// Takes out a triangle whose edge `h` has no length any more.
    fn close(&mut self, h: u32, b: u32) {
        let (one, other) = (next(h), previous(h));
        let c = self.from(other);
        let (p, q) = (self.twins[one as usize], self.twins[other as usize]);
        let line = if self.lines[one as usize] == NONE { self.lines[other as usize] } else { self.lines[one as usize] };
        self.triangles[h as usize / 3] = [NONE; 3];
        self.pair(p, q);
        for half in [p, q].into_iter().filter(|half| *half != NONE) {
            self.lines[half as usize] = line;
            let (from, onward) = (self.from(half), self.from(next(half)));
            debug_assert!([from, onward].iter().all(|v| *v == b || *v == c));
            self.outs[from as usize] = half;
            self.outs[onward as usize] = next(half);
        }
    }

    /// Whether two vertices have an edge, or may have.
    pub fn joined(&self, a: u32, b: u32, fan: &mut Vec<u32>) -> bool {
        match self.fan(a, fan) {
            Some(open) => self.ring(fan, open).any(|v| v == b),
            None => true,
        }
    }

    /// Live triangles over live vertices, and of each vertex its old number.
    pub fn packed(&self) -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<u32>) {
        let mut number = vec![NONE; self.positions.len()];
        let (mut positions, mut old) = (vec![], vec![]);
        for v in 0..number.len() {
            if self.outs[v] != NONE {
                number[v] = positions.len() as u32;
                positions.push(self.positions[v]);
                old.push(v as u32);
            }
        }
        let alive = self.triangles.iter().filter(|t| t[0] != NONE);
        (positions, alive.map(|t| t.map(|v| number[v as usize])).collect(), old)
    }

    pub fn is_vertex(&self, v: u32) -> bool {
        self.outs[v as usize] != NONE
    }
}

//! A tree of boxes about triangles, for the nearest of them to a point.

use super::triangle::{nearest_weights, place};
use crate::Vec3;
use crate::error::{Result, reserve};

/// Triangles in a leaf: a box costs about as much as half a triangle.
const LEAF: usize = 4;
/// Halving 2³² triangles leaves one in each part after so many levels.
const DEPTH: usize = 34;

/// Coordinates beyond, in sizes of the mesh, leave no sure squares.
pub(super) const FAR_OFF: f64 = 1e120;

/// Of the triangles in their order: node and halves, depth first, so that a node's left half is the node after it.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Its first triangle; of an inner node, its right half.
    first: u32,
    /// Its triangles; 0 of an inner node.
    count: u32,
}

/// A triangle, the weights of its corners at its nearest point, and the distance there squared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub triangle: usize,
    pub weights: [f64; 3],
    pub squared: f64,
}

#[inline]
pub(super) fn corners(positions: &[Vec3], triangle: &[u32; 3]) -> [Vec3; 3] {
    triangle.map(|v| positions[v as usize])
}

/// Puts near triangles next to each other, as a [`Tree`] wants them.
pub(crate) fn sort(positions: &[Vec3], triangles: &mut [[u32; 3]]) {
    if triangles.len() <= LEAF {
        return;
    }
    let center = |triangle: &[u32; 3]| corners(positions, triangle).iter().sum::<Vec3>();
    let (low, high) = triangles
        .iter()
        .map(center)
        .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)), |(low, high), c| {
            (low.inf(&c), high.sup(&c))
        });
    let axis = (high - low).imax();
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |s, t| center(s)[axis].total_cmp(&center(t)[axis]).then_with(|| s.cmp(t)));
    let (left, right) = triangles.split_at_mut(half);
    sort(positions, left);
    sort(positions, right);
}

impl Tree {
    /// Over triangles that are [sorted](sort), at least one.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let mut tree = Self { nodes: reserve("the tree of triangles", triangles.len())? };
        tree.grow(0, triangles.len());
        tree.refit(positions, triangles);
        Ok(tree)
    }

    fn grow(&mut self, first: usize, count: usize) {
        let at = self.nodes.len();
        let empty = Node { low: Vec3::zeros(), high: Vec3::zeros(), first: first as u32, count: count as u32 };
        self.nodes.push(empty);
        if count > LEAF {
            let half = count / 2;
            self.grow(first, half);
            self.nodes[at] = Node { first: self.nodes.len() as u32, count: 0, ..empty };
            self.grow(first + half, count - half);
        }
    }

    /// The boxes anew, of triangles that moved.
    pub fn refit(&mut self, positions: &[Vec3], triangles: &[[u32; 3]]) {
        for at in (0..self.nodes.len()).rev() {
            let Node { first, count, .. } = self.nodes[at];
            let (low, high) = if count == 0 {
                let (left, right) = (&self.nodes[at + 1], &self.nodes[first as usize]);
                (left.low.inf(&right.low), left.high.sup(&right.high))
            } else {
                let own = &triangles[first as usize..][..count as usize];
                own.iter()
                    .flatten()
                    .map(|v| &positions[*v as usize])
                    .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)), |(low, high), x| {
                        (low.inf(x), high.sup(x))
                    })
            };
            (self.nodes[at].low, self.nodes[at].high) = (low, high);
        }
    }

    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }

    /// From the box about all triangles.
    #[inline]
    pub fn box_distance(&self, p: &Vec3) -> f64 {
        crate::wide_norm(&self.nodes[0].off(p))
    }

    /// The triangle nearest to `p`, if nearer than `best`.
    #[inline]
    pub fn nearest(&self, positions: &[Vec3], triangles: &[[u32; 3]], p: &Vec3, best: Nearest) -> Nearest {
        self.nearest_where(positions, triangles, p, best, |_| true)
    }

    /// The same among the triangles that `accept` takes.
    #[inline]
    pub fn nearest_where(
        &self,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        p: &Vec3,
        mut best: Nearest,
        accept: impl Fn(usize) -> bool,
    ) -> Nearest {
        let mut open = [(0u32, 0.0f64); DEPTH];
        let (mut depth, mut at) = (0, 0usize);
        let mut squared = self.nodes[0].squared(p);
        loop {
            if squared < best.squared {
                let Node { first, count, .. } = self.nodes[at];
                if count == 0 {
                    let (left, right) = (at + 1, first as usize);
                    let (near, far) = (self.nodes[left].squared(p), self.nodes[right].squared(p));
                    if near <= far {
                        open[depth] = (right as u32, far);
                        (at, squared) = (left, near);
                    } else {
                        open[depth] = (left as u32, near);
                        (at, squared) = (right, far);
                    }
                    depth += 1;
                    continue;
                }
                let own = (first as usize..(first + count) as usize).filter(|t| accept(*t));
                own.for_each(|t| best.look_at(positions, triangles, p, t));
            }
            if depth == 0 {
                return best;
            }
            depth -= 1;
            (at, squared) = (open[depth].0 as usize, open[depth].1);
        }
    }
}

impl Tree {
    /// Leaves whose boxes come within `margin` of the way from `from` along `way`, up to the share of it that `look` last returned.
    pub fn visit_way(&self, from: &Vec3, way: &Vec3, margin: f64, mut look: impl FnMut(std::ops::Range<usize>) -> f64) {
        let mut open = [0u32; DEPTH];
        let (mut depth, mut at, mut reach) = (0, 0usize, 1.0);
        loop {
            if self.nodes[at].is_met(from, way, margin, reach) {
                let Node { first, count, .. } = self.nodes[at];
                if count == 0 {
                    open[depth] = first;
                    depth += 1;
                    at += 1;
                    continue;
                }
                reach = look(first as usize..(first + count) as usize);
            }
            if depth == 0 {
                return;
            }
            depth -= 1;
            at = open[depth] as usize;
        }
    }
}

impl Node {
    /// By the way's shares between two planes along each axis.
    fn is_met(&self, from: &Vec3, way: &Vec3, margin: f64, reach: f64) -> bool {
        let (mut enter, mut leave) = (0.0f64, reach);
        for a in 0..3 {
            // A rounding more, as the way's points have it.
            let more = margin + 1e-12 * (from[a].abs() + way[a].abs() + margin);
            let (low, high) = (self.low[a] - more - from[a], self.high[a] + more - from[a]);
            if way[a] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
            } else {
                let (s, t) = (low / way[a], high / way[a]);
                enter = enter.max(s.min(t));
                leave = leave.min(s.max(t));
            }
        }
        enter <= leave
    }

    /// From the box.
    #[inline]
    fn squared(&self, p: &Vec3) -> f64 {
        self.off(p).norm_squared()
    }

    /// To the box, along each axis.
    #[inline]
    fn off(&self, p: &Vec3) -> Vec3 {
        (self.low - p).sup(&(p - self.high)).sup(&Vec3::zeros())
    }
}

impl Nearest {
    #[inline]
    pub fn foot(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec3 {
        place(&corners(positions, &triangles[self.triangle]), &self.weights)
    }

    /// None yet, nearer than this.
    pub fn within(distance: f64) -> Self {
        Self { triangle: usize::MAX, weights: [0.0; 3], squared: distance * distance }
    }

    #[inline]
    pub fn look_at(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], p: &Vec3, t: usize) {
        let corners = corners(positions, &triangles[t]);
        let weights = nearest_weights(&corners, p);
        let squared = (p - place(&corners, &weights)).norm_squared();
        if squared < self.squared {
            *self = Self { triangle: t, weights, squared };
        }
    }
}

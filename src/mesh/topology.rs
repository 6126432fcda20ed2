//! Connectivity of a triangle list: which triangles share an edge, a consistent orientation, fans around a vertex,
//! connected components.

/// One triangle's side: the edge between its corners `corner` and `corner + 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    low: u32,
    high: u32,
    pub triangle: u32,
    pub corner: u8,
    /// The triangle runs along the edge from its lower to its higher vertex.
    pub forward: bool,
}

impl Side {
    pub fn vertices(&self) -> [u32; 2] {
        [self.low, self.high]
    }
}

/// All sides of all usable triangles, sorted so that the sides of one edge are neighbours.
pub(super) struct SharedEdges {
    sides: Vec<Side>,
}

impl SharedEdges {
    pub fn of(triangles: &[[u32; 3]], usable: &[bool]) -> Self {
        let mut sides = Vec::with_capacity(3 * triangles.len());
        for (t, tri) in triangles.iter().enumerate().filter(|(t, _)| usable[*t]) {
            for k in 0..3 {
                let (a, b) = (tri[k], tri[(k + 1) % 3]);
                let (low, high) = (a.min(b), a.max(b));
                sides.push(Side { low, high, triangle: t as u32, corner: k as u8, forward: a < b });
            }
        }
        Self { sides: sorted(sides) }
    }

    /// Whether triangles may repeat: two have an edge and the third vertex in common, or more than two an edge.
    pub fn may_repeat(&self, triangles: &[[u32; 3]]) -> bool {
        let third = |s: &Side| triangles[s.triangle as usize][(s.corner as usize + 2) % 3];
        self.iter().any(|sides| sides.len() > 2 || sides.windows(2).any(|two| third(&two[0]) == third(&two[1])))
    }

    /// The sides of each edge, edges in order of (lower, higher) vertex.
    pub fn iter(&self) -> impl Iterator<Item = &[Side]> {
        self.sides.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
    }

    /// The two sides of each edge that has exactly two.
    fn pairs(&self) -> impl Iterator<Item = (&Side, &Side)> {
        self.iter().filter_map(|sides| if let [a, b] = sides { Some((a, b)) } else { None })
    }
}

/// Sorts by the lower vertex in linear time, then the few sides of each.
fn sorted(sides: Vec<Side>) -> Vec<Side> {
    let Some(last) = sides.iter().map(|s| s.low as usize).max() else { return sides };
    let mut next = vec![0usize; last + 2];
    sides.iter().for_each(|s| next[s.low as usize + 1] += 1);
    (0..=last).for_each(|v| next[v + 1] += next[v]);
    let mut out = sides.clone();
    for side in sides {
        let at = &mut next[side.low as usize];
        out[*at] = side;
        *at += 1;
    }
    out.chunk_by_mut(|a, b| a.low == b.low).for_each(|same| same.sort_unstable());
    out
}

/// A consistent orientation, or where none exists.
pub struct Orientation {
    /// Triangles to turn over, per triangle; in each connected piece the smaller party is turned.
    pub flipped: Vec<bool>,
    /// Triangles at which the flood fill met a contradiction.
    pub conflicts: Vec<u32>,
}

impl Orientation {
    /// The triangles with the flips applied.
    pub fn apply(&self, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let turn = |(&[a, b, c], &flip): (&[u32; 3], &bool)| if flip { [a, c, b] } else { [a, b, c] };
        triangles.iter().zip(&self.flipped).map(turn).collect()
    }
}

/// Flood-fills a relative orientation over manifold edges.
pub(super) fn orient(triangles: &[[u32; 3]], edges: &SharedEdges) -> Orientation {
    let n = triangles.len();
    let mut neighbours = vec![[(u32::MAX, false); 3]; n];
    for (a, b) in edges.pairs() {
        let opposed = a.forward == b.forward; // two neighbours must run along their edge in opposite directions
        neighbours[a.triangle as usize][a.corner as usize] = (b.triangle, opposed);
        neighbours[b.triangle as usize][b.corner as usize] = (a.triangle, opposed);
    }
    let mut flipped = vec![None; n];
    let mut conflicts = Vec::new();
    for seed in 0..n {
        if flipped[seed].is_none() {
            flood(seed, &neighbours, &mut flipped, &mut conflicts);
        }
    }
    Orientation { flipped: flipped.into_iter().map(|f| f.unwrap_or(false)).collect(), conflicts }
}

fn flood(seed: usize, neighbours: &[[(u32, bool); 3]], flipped: &mut [Option<bool>], conflicts: &mut Vec<u32>) {
    flipped[seed] = Some(false);
    let mut piece = vec![seed];
    let mut conflict = None;
    let mut next = 0;
    while next < piece.len() {
        let t = piece[next];
        next += 1;
        let own = flipped[t].unwrap_or(false);
        for &(other, opposed) in neighbours[t].iter().filter(|(other, _)| *other != u32::MAX) {
            let other = other as usize;
            match flipped[other] {
                None => {
                    flipped[other] = Some(own ^ opposed);
                    piece.push(other);
                }
                Some(f) if f != own ^ opposed => conflict = conflict.or(Some(other as u32)),
                Some(_) => {}
            }
        }
    }
    let turned = piece.iter().filter(|&&t| flipped[t] == Some(true)).count();
    if conflict.is_some() || 2 * turned > piece.len() {
        for &t in &piece {
            flipped[t] = flipped[t].map(|f| conflict.is_none() && !f);
        }
    }
    conflicts.extend(conflict);
}

/// Disjoint sets with path halving.
pub(crate) struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins two sets; the lower root stays, so that roots do not depend on the order of calls.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

/// For each triangle corner (3t + k) a representative of the fan of triangles it belongs to around its vertex.
pub(super) fn fan_roots(triangles: &[[u32; 3]], edges: &SharedEdges) -> Vec<u32> {
    let mut sets = UnionFind::new(3 * triangles.len());
    let corner_at = |side: &Side, vertex: u32| {
        let tri = triangles[side.triangle as usize];
        3 * side.triangle + tri.iter().position(|&v| v == vertex).expect("a side's vertices are its triangle's") as u32
    };
    for sides in edges.iter() {
        for pair in sides.windows(2) {
            for v in pair[0].vertices() {
                sets.join(corner_at(&pair[0], v), corner_at(&pair[1], v));
            }
        }
    }
    (0..3 * triangles.len() as u32).map(|c| sets.find(c)).collect()
}

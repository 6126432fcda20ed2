//! The triangles on which bending is told: the mesh's, with edges flipped towards six triangles a vertex.
//!
//! Where four and eight triangles meet by turns, as in a union jack, the patch of a triangle has its points near a conic and tells
//! curvature badly. So edges of nearly flat convex quads are flipped, for bending alone: the membrane keeps the mesh. No sharp edge is, none
//! that is clamped, and none of a triangle beside a crease.

use super::bending::{Edges, Plate};
use super::mirror_at;
use super::patch::Beyond;
use super::rest::{Intrinsic, Rest};
use crate::material::Crease;
use crate::{Mesh, Vec3};
use std::collections::{HashSet, VecDeque};

/// Angle between two triangles that counts as nearly flat, rad.
const FLAT: f64 = 0.6;
/// A flip must leave this share of the worse triangle's shape.
const SHAPE: f64 = 0.6;
const PASSES: usize = 6;
/// Ratio of two rigidities beyond which the edge between them stays: a step in thickness stays where it is.
const JUMP: f64 = 2.0;
/// Cosine of two edges at a vertex that go straight on.
const STRAIGHT: f64 = -0.8;

/// An edge of a triangle list with the triangles on both sides: number, and which corner is opposite.
struct Shared {
    ends: [u32; 2],
    sides: [Option<(usize, usize)>; 2],
}

/// All edges, in order of their ends. Of the first side, ends run along the triangle.
fn edges(triangles: &[[u32; 3]]) -> Vec<Shared> {
    let half = |(t, tri): (usize, &[u32; 3])| {
        let tri = *tri;
        (0..3).map(move |k| {
            let (a, b) = (tri[(k + 1) % 3], tri[(k + 2) % 3]);
            (a.min(b), a.max(b), a > b, t, k)
        })
    };
    let mut halves: Vec<_> = triangles.iter().enumerate().flat_map(half).collect();
    halves.sort_unstable();
    let together = |pair: &[(u32, u32, bool, usize, usize)]| {
        let (low, high, back, t, k) = pair[0];
        let ends = if back { [high, low] } else { [low, high] };
        Shared { ends, sides: [Some((t, k)), pair.get(1).map(|&(_, _, _, t, k)| (t, k))] }
    };
    halves.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)).map(together).collect()
}

/// What is beyond each edge of each triangle (edge k opposite to corner k), with clamps at the edges of the `mesh` whose ends both are
/// `clamped`, and images at planes of symmetry. Of a crease with another stiffness nothing: it has a term of its own.
pub fn beyond(mesh: &Mesh, triangles: &[[u32; 3]], of: &Edges) -> Vec<[Beyond; 3]> {
    let Edges { clamped, creases, mirrors, .. } = *of;
    let mut beyond = vec![[Beyond::Free; 3]; triangles.len()];
    let is_clamp = |[a, b]: [u32; 2]| clamped.get(a as usize) == Some(&true) && clamped.get(b as usize) == Some(&true);
    let clamps: HashSet<[u32; 2]> =
        mesh.edges.iter().map(|e| e.vertices).filter(|ends| is_clamp(*ends)).map(sorted).collect();
    for Shared { ends, sides } in edges(triangles) {
        let clamp = clamps.contains(&sorted(ends));
        for (own, other) in [(sides[0], sides[1]), (sides[1], sides[0])] {
            let Some((t, k)) = own else { continue };
            beyond[t][k] = match other {
                _ if clamp => Beyond::Clamp,
                _ if creases.at(ends).is_some_and(Crease::is_apart) => Beyond::Free,
                Some((t, k)) => Beyond::Vertex { corner: triangles[t][k], triangle: t },
                None => mirror_at(mirrors, ends).map_or(Beyond::Free, |plane| Beyond::Image(*plane)),
            };
        }
    }
    beyond
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The mesh's triangles after the flips; those beside creases stay. `plates` are theirs (n_triangles, or none where all are equal), and afterwards those of what comes out.
/// And their corners, of a shape with lengths of its own.
pub(super) fn bending_triangles(
    rest: &Rest,
    edges: &Edges,
    plates: &mut [Plate],
) -> (Vec<[u32; 3]>, Option<Vec<[Vec3; 3]>>) {
    let Edges { clamped, creases, flat, .. } = *edges;
    let mut triangles = rest.mesh.triangles.clone();
    let mut intrinsic = Intrinsic::new(rest);
    let creased = |t: &[u32; 3]| (0..3).any(|k| creases.at([t[k], t[(k + 1) % 3]]).is_some());
    let stay: Vec<bool> = match creases.is_empty() {
        true => vec![],
        false => triangles.iter().map(creased).collect(),
    };
    for _ in 0..PASSES {
        if !flip(flat, (clamped, &stay), &mut triangles, (plates, &mut intrinsic)) {
            break;
        }
    }
    let laid = intrinsic.map(|lengths| triangles.iter().map(|triangle| lengths.corners(triangle)).collect());
    (triangles, laid)
}

/// How many triangles meet at each vertex, and should.
struct Valence {
    have: Vec<i64>,
    want: Vec<i64>,
}

impl Valence {
    fn of(n: usize, triangles: &[[u32; 3]], edges: &[Shared]) -> Self {
        let mut have = vec![0; n];
        triangles.iter().flatten().for_each(|&v| have[v as usize] += 1);
        let mut want = vec![6; n];
        let boundary = edges.iter().filter(|e| e.sides[1].is_none());
        boundary.flat_map(|e| e.ends).for_each(|v| want[v as usize] = 3);
        Self { have, want }
    }

    /// What the sum of squared differences loses by a flip of a–b to c–d.
    fn gain(&self, [a, b, c, d]: [u32; 4]) -> i64 {
        let off = |v: u32, change: i64| (self.have[v as usize] + change - self.want[v as usize]).pow(2);
        let (before, after) = ([a, b, c, d].map(|v| off(v, 0)), [off(a, -1), off(b, -1), off(c, 1), off(d, 1)]);
        before.iter().sum::<i64>() - after.iter().sum::<i64>()
    }

    fn flip(&mut self, [a, b, c, d]: [u32; 4]) {
        [(a, -1), (b, -1), (c, 1), (d, 1)].iter().for_each(|&(v, change)| self.have[v as usize] += change);
    }
}

/// An edge a–b whose flip to c–d would gain, and its triangles.
struct Candidate {
    quad: [u32; 4],
    triangles: [usize; 2],
}

/// The candidates by vertex, and which were looked at.
struct Fronts<'a> {
    x: &'a [Vec3],
    candidates: &'a [Candidate],
    /// (vertex, candidate), ascending.
    at: Vec<(u32, usize)>,
}

impl Fronts<'_> {
    /// Candidates that go straight on from candidate `i`: along the edge that goes, or along the one that comes. Where squares are cut along both diagonals,
    /// these together leave one direction of diagonals.
    fn straight_on(&self, i: usize, mut visit: impl FnMut(usize)) {
        let direction = |from: u32, to: u32| (self.x[to as usize] - self.x[from as usize]).normalize();
        let other =
            |quad: &[u32; 4], v: u32| quad.iter().position(|w| *w == v).map(|place| (place / 2, quad[place ^ 1]));
        let own = &self.candidates[i].quad;
        for v in *own {
            let Some((kind, end)) = other(own, v) else { continue };
            let first = self.at.partition_point(|(w, _)| *w < v);
            for &(_, j) in self.at[first..].iter().take_while(|(w, _)| *w == v) {
                let Some((its_kind, its_end)) = other(&self.candidates[j].quad, v) else { continue };
                if its_kind == kind && direction(v, end).dot(&direction(v, its_end)) < STRAIGHT {
                    visit(j);
                }
            }
        }
    }
}

/// One pass over all edges, those of the largest gain first and from each straight on; whether anything was flipped.
fn flip(
    x: &[Vec3],
    (clamped, stay): (&[bool], &[bool]),
    triangles: &mut [[u32; 3]],
    (plates, intrinsic): (&mut [Plate], &mut Option<Intrinsic>),
) -> bool {
    let edges = edges(triangles);
    let mut valence = Valence::of(x.len(), triangles, &edges);
    let mut taken: HashSet<[u32; 2]> = edges.iter().map(|e| sorted(e.ends)).collect();
    let mut used = if stay.is_empty() { vec![false; triangles.len()] } else { stay.to_vec() };
    let both = |v: u32, w: u32| clamped.get(v as usize) == Some(&true) && clamped.get(w as usize) == Some(&true);
    let candidates = candidates(&edges, triangles, &valence);
    let mut at: Vec<(u32, usize)> = candidates.iter().enumerate().flat_map(|(i, c)| c.quad.map(|v| (v, i))).collect();
    at.sort_unstable();
    let fronts = Fronts { x, candidates: &candidates, at };
    let mut any = false;
    let mut seen = vec![false; candidates.len()];
    let mut queue = VecDeque::new();
    for seed in 0..candidates.len() {
        queue.push_back(seed);
        while let Some(i) = queue.pop_front() {
            let Candidate { quad: quad @ [a, b, c, d], triangles: [t, s] } = candidates[i];
            let barred = seen[i] || used[t] || used[s] || taken.contains(&sorted([c, d])) || both(a, b) || both(c, d);
            let barred = barred || jumps(plates, t, s);
            seen[i] = true;
            if barred || valence.gain(quad) <= 0 || !may_flip(quad.map(|v| x[v as usize])) {
                continue;
            }
            if let Some(lengths) = intrinsic {
                if !may_flip(lengths.quad(&quad)) {
                    continue;
                }
                lengths.flip(&quad);
            }
            if !plates.is_empty() {
                let area = |t: usize| {
                    let [p, q, r] = triangles[t].map(|v| x[v as usize]);
                    0.5 * (q - p).cross(&(r - p)).norm()
                };
                let one = Plate::together([plates[t], plates[s]], [area(t), area(s)]);
                (plates[t], plates[s]) = (one, one);
            }
            (triangles[t], triangles[s]) = ([c, a, d], [d, b, c]);
            (used[t], used[s], any) = (true, true, true);
            taken.insert(sorted([c, d]));
            valence.flip(quad);
            fronts.straight_on(i, |j| queue.push_back(j));
        }
    }
    any
}

/// Whether the plates of two triangles differ too much for triangles that lie in both.
fn jumps(plates: &[Plate], t: usize, s: usize) -> bool {
    let ratio = |a: &Plate, b: &Plate| a.rigidity() / b.rigidity();
    !plates.is_empty()
        && (ratio(&plates[t], &plates[s]).max(ratio(&plates[s], &plates[t])) > JUMP || plates[t].turns(&plates[s]))
}

/// Edges whose flip would gain, those of the largest gain first.
fn candidates(edges: &[Shared], triangles: &[[u32; 3]], valence: &Valence) -> Vec<Candidate> {
    let mut all = vec![];
    for Shared { ends: [a, b], sides } in edges {
        let [Some((t, k)), Some((s, l))] = *sides else { continue };
        let quad = [*a, *b, triangles[t][k], triangles[s][l]];
        let gain = valence.gain(quad);
        if gain > 0 {
            all.push((-gain, quad, [t, s]));
        }
    }
    all.sort_unstable();
    all.into_iter().map(|(_, quad, triangles)| Candidate { quad, triangles }).collect()
}

/// Whether the quad is convex and nearly flat, and the flip keeps the shape of its triangles.
fn may_flip([a, b, c, d]: [Vec3; 4]) -> bool {
    let normal = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(&(r - p));
    let flat = |m: Vec3, n: Vec3| m.dot(&n) > libm::cos(FLAT) * m.norm() * n.norm();
    let (old, other_old) = (normal(a, b, c), normal(b, a, d));
    let (new, other_new) = (normal(c, a, d), normal(d, b, c));
    let shape = |p: Vec3, q: Vec3, r: Vec3| {
        let squares = (q - p).norm_squared() + (r - q).norm_squared() + (p - r).norm_squared();
        normal(p, q, r).norm() / squares
    };
    let convex = new.dot(&old) > 0.0 && other_new.dot(&old) > 0.0;
    let kept = shape(c, a, d).min(shape(d, b, c)) >= SHAPE * shape(a, b, c).min(shape(b, a, d));
    convex && flat(old, other_old) && flat(new, other_new) && kept
}

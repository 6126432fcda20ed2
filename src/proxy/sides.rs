//! Two sides of a sheet with thickness, and the sheet in their middle.
//!
//! A triangle's other side is the nearest triangle behind it that faces away from it. Sides spread from the triangles that face their other side best, and
//! stop at the rim; what is opposite to one side is the other. One is kept and moved halfway to the other.

use super::ground::Ground;
use super::link::Manifold;
use super::soup::Soup;
use crate::mesh::{NONE, UnionFind};
use crate::{Error, ErrorKind, Result, Vec3};
use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Found by itself is what is no thicker than these shares of the asset's and the piece's size.
const THINNEST: [f64; 2] = [0.05, 0.1];
/// Cosine below which two triangles face away from each other.
const AWAY: f64 = -0.5;
/// Cosine above which a side goes on from triangle to triangle, and from the last that has another side into the rim.
const SAME_SIDE: [f64; 2] = [0.5, 0.7];
/// A piece has two sides where so much of its area has another side, and one where so little has.
const SHARES: [f64; 2] = [0.25, 0.75];
/// The two sides' areas may differ so much, and area over rim must be so many thicknesses: else it is a rod and not a sheet.
const BALANCE: f64 = 0.6;
const WIDTH: f64 = 1.2;
/// A thickness beyond so many times the usual one is none.
const THICKEST: f64 = 2.5;
/// Triangles looked at, to find out whether there is anything to look for.
const PROBES: usize = 4000;

/// And looks at them, and at each triangle after that.
const LOOKS: (usize, usize) = (10_000_000, 300);

/// What is left of a mesh with sides.
pub struct Sheet {
    /// Of each triangle, whether it stays.
    pub kept: Vec<bool>,
    /// Where each vertex is then.
    pub moved: Vec<Vec3>,
    /// The usual one of the largest group of pieces.
    pub thickness: f64,
    pub n_dropped: usize,
}

/// The other side of a triangle.
#[derive(Clone, Copy)]
struct Other {
    triangle: u32,
    distance: f64,
    cosine: f64,
}

struct Search<'a> {
    manifold: &'a Manifold,
    ground: Ground<'a>,
    piece: Vec<u32>,
    n_pieces: usize,
    /// How far another side may be, of each piece.
    limits: Vec<f64>,
    /// −1 for pieces whose normals point inward.
    outward: Vec<f64>,
    /// Triangles looked at.
    looks: Cell<usize>,
}

/// Finds the sheets in the middle, or none. With `thickness` (0: find it) sides that cannot be told apart are an error.
pub fn middle(soup: &Soup, manifold: &Manifold, thickness: f64) -> Result<Option<Sheet>> {
    let search = Search::new(manifold, thickness)?;
    if thickness == 0.0 && !search.any() {
        return Ok(None);
    }
    let Some(others) = search.others() else {
        if thickness == 0.0 {
            return Ok(None);
        }
        let message = "two sides cannot be told apart: very many triangles lie within the thickness of each other: give a smaller one";
        return Err(Error::new(ErrorKind::InvalidMesh, message));
    };
    let double = search.double(soup, &others, thickness > 0.0)?;
    if !double.contains(&true) {
        return Ok(None);
    }
    let groups = search.groups(&others, &double);
    let usual = search.usual(&others, &groups);
    let others: Vec<Option<Other>> = (0..others.len())
        .map(|t| {
            let group = groups[search.piece[t] as usize];
            others[t].filter(|o| group != NONE && o.distance <= THICKEST * usual[group as usize])
        })
        .collect();
    let labels = search.spread(&others, &groups);
    search.sheet(soup, &labels, &groups, &usual, thickness > 0.0)
}

impl<'a> Search<'a> {
    fn new(manifold: &'a Manifold, thickness: f64) -> Result<Self> {
        let ground = Ground::new(manifold)?;
        let (of_vertex, n_pieces) = manifold.pieces();
        let piece: Vec<u32> = manifold.triangles.iter().map(|t| of_vertex[t[0] as usize]).collect();
        let mut boxes = vec![(Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)); n_pieces];
        for (v, x) in manifold.positions.iter().enumerate() {
            let (low, high) = &mut boxes[of_vertex[v] as usize];
            (*low, *high) = (low.inf(x), high.sup(x));
        }
        let own = |(low, high): &(Vec3, Vec3)| (high - low).norm();
        let limits = boxes
            .iter()
            .map(|b| if thickness > 0.0 { thickness } else { THINNEST[0].min(THINNEST[1] * own(b)) })
            .collect();
        let mut volume = vec![0.0; n_pieces];
        let mut open = vec![false; n_pieces];
        for (t, tri) in manifold.triangles.iter().enumerate() {
            let [a, b, c] = tri.map(|v| manifold.positions[v as usize]);
            volume[piece[t] as usize] += a.dot(&b.cross(&c));
            open[piece[t] as usize] |= manifold.twins[3 * t..3 * t + 3].contains(&NONE);
        }
        let mut search =
            Self { manifold, ground, piece, n_pieces, limits, outward: vec![1.0; n_pieces], looks: Cell::new(0) };
        for p in 0..n_pieces {
            search.outward[p] = if !open[p] && volume[p] < 0.0 { -1.0 } else { 1.0 };
        }
        // Whether the normals of open pieces point away from their other side is found out by both.
        let outside = search.outward.clone();
        let inside: Vec<f64> = (0..n_pieces).map(|p| if open[p] { -outside[p] } else { outside[p] }).collect();
        let share = search.probed();
        search.outward = inside;
        if search.probed() <= share {
            search.outward = outside;
        }
        Ok(search)
    }

    /// Of the area probed, what has another side.
    fn probed(&self) -> f64 {
        let n = self.ground.triangles.len();
        let (mut all, mut paired) = (0.0, 0.0);
        for t in (0..n).step_by(n.div_ceil(PROBES).max(1)) {
            if self.looks.get() > LOOKS.0 {
                break;
            }
            all += self.ground.areas[t];
            paired += if self.other(t).is_some() { self.ground.areas[t] } else { 0.0 };
        }
        if all > 0.0 { paired / all } else { 0.0 }
    }

    fn any(&self) -> bool {
        self.probed() > 0.05
    }

    fn other(&self, t: usize) -> Option<Other> {
        let (ground, piece) = (&self.ground, self.piece[t] as usize);
        let facing = self.outward[piece];
        let (p, n) = (ground.centroid(t), ground.normals[t] * facing);
        let accept = |s: usize| {
            let other = self.piece[s] as usize;
            self.looks.set(self.looks.get() + 1);
            s != t && ground.normals[s].dot(&n) * self.outward[other] < AWAY && (ground.centroid(s) - p).dot(&n) <= 1e-9
        };
        let foot = ground.nearest(&p, self.limits[piece], accept)?;
        let cosine =
            n.dot(&ground.normals[foot.triangle as usize]) * self.outward[self.piece[foot.triangle as usize] as usize];
        Some(Other { triangle: foot.triangle, distance: foot.squared.sqrt(), cosine })
    }

    /// None where so many triangles lie within the thickness of each other that there are no two sides.
    fn others(&self) -> Option<Vec<Option<Other>>> {
        let n = self.ground.triangles.len();
        (0..n).map(|t| (self.looks.get() <= LOOKS.0 + LOOKS.1 * n).then(|| self.other(t))).collect()
    }

    /// Which pieces have two sides. Fails where they half have, if a thickness was given.
    fn double(&self, soup: &Soup, others: &[Option<Other>], given: bool) -> Result<Vec<bool>> {
        let (mut all, mut paired, mut first) =
            (vec![0.0; self.n_pieces], vec![0.0; self.n_pieces], vec![NONE; self.n_pieces]);
        for (t, other) in others.iter().enumerate() {
            let (p, area) = (self.piece[t] as usize, self.ground.areas[t]);
            all[p] += area;
            match other {
                Some(_) => paired[p] += area,
                None if first[p] == NONE => first[p] = t as u32,
                None => {}
            }
        }
        for p in 0..self.n_pieces {
            let share: f64 = paired[p] / all[p];
            if given && share > SHARES[0] && share < SHARES[1] {
                let lone = self.manifold.triangles[first[p] as usize][0];
                let place = soup.place(self.manifold.soup[lone as usize]);
                return Err(Error::new(
                    ErrorKind::InvalidMesh,
                    format!(
                        "two sides cannot be told apart: {:.0} % of a piece's area has another side within the thickness, and none \
                         is near {place}: give another thickness",
                        100.0 * share
                    ),
                ));
            }
        }
        Ok((0..self.n_pieces).map(|p| paired[p] >= SHARES[1] * all[p]).collect())
    }

    /// Of each piece with two sides, the group of pieces that it forms these with.
    fn groups(&self, others: &[Option<Other>], double: &[bool]) -> Vec<u32> {
        let mut sets = UnionFind::new(self.n_pieces);
        for (t, other) in others.iter().enumerate() {
            if let Some(o) = other {
                let (p, q) = (self.piece[t], self.piece[o.triangle as usize]);
                if double[p as usize] && double[q as usize] {
                    sets.join(p, q);
                }
            }
        }
        (0..self.n_pieces as u32).map(|p| if double[p as usize] { sets.find(p) } else { NONE }).collect()
    }

    /// The median thickness of each group by area, numbered by pieces.
    fn usual(&self, others: &[Option<Other>], groups: &[u32]) -> Vec<f64> {
        let mut found: Vec<Vec<(f64, f64)>> = vec![vec![]; self.n_pieces];
        for (t, other) in others.iter().enumerate() {
            let group = groups[self.piece[t] as usize];
            if let (Some(o), true) = (other, group != NONE) {
                found[group as usize].push((o.distance, self.ground.areas[t]));
            }
        }
        let median = |mut of: Vec<(f64, f64)>| {
            of.sort_by(|a, b| a.0.total_cmp(&b.0));
            let half = 0.5 * of.iter().map(|(_, area)| area).sum::<f64>();
            let mut sum = 0.0;
            let at = of.iter().find(|(_, area)| {
                sum += area;
                sum >= half
            });
            at.map_or(0.0, |(distance, _)| distance.max(1e-9))
        };
        found.into_iter().map(median).collect()
    }

    /// 1 and 2 for the two sides, 0 for the rim and what has one side.
    fn spread(&self, others: &[Option<Other>], groups: &[u32]) -> Vec<u8> {
        let ground = &self.ground;
        let quality = |t: usize| others[t].map_or(2.0, |o| 1.0 + o.cosine).max(0.0);
        let inside = |t: usize| groups[self.piece[t] as usize] != NONE;
        let mut seeds: Vec<(u64, u32)> = (0..others.len())
            .filter(|t| inside(*t) && others[*t].is_some())
            .map(|t| (quality(t).to_bits(), t as u32))
            .collect();
        seeds.sort_unstable();
        let mut labels = vec![0u8; others.len()];
        let mut open = BinaryHeap::new();
        for (_, seed) in seeds {
            if labels[seed as usize] != 0 {
                continue;
            }
            open.push(Reverse((0u64, seed, 1u8, seed)));
            while let Some(Reverse((_, t, label, anchor))) = open.pop() {
                let at = t as usize;
                if labels[at] != 0 || others[at].is_some_and(|o| labels[o.triangle as usize] == label) {
                    continue;
                }
                labels[at] = label;
                if let Some(o) = others[at] {
                    open.push(Reverse((quality(o.triangle as usize).to_bits(), o.triangle, 3 - label, o.triangle)));
                }
                for half in 3 * at..3 * at + 3 {
                    let twin = self.manifold.twins[half];
                    if twin == NONE {
                        continue;
                    }
                    let next = twin as usize / 3;
                    let paired = others[next].is_some();
                    let anchor = if paired { next as u32 } else { anchor };
                    let goes_on = ground.normals[at].dot(&ground.normals[next]) > SAME_SIDE[0]
                        && ground.normals[anchor as usize].dot(&ground.normals[next]) > SAME_SIDE[1];
                    if labels[next] == 0 && goes_on && inside(next) {
                        open.push(Reverse((quality(next).to_bits(), next as u32, label, anchor)));
                    }
                }
            }
        }
        labels
    }

    /// Whether a group is a sheet: two sides of about the same area, wide for their thickness.
    fn is_sheet(&self, labels: &[u8], groups: &[u32], group: u32, thickness: f64) -> bool {
        let (mut areas, mut rim) = ([0.0; 3], 0.0);
        for (t, tri) in self.manifold.triangles.iter().enumerate() {
            if groups[self.piece[t] as usize] != group {
                continue;
            }
            areas[labels[t] as usize] += self.ground.areas[t];
            for k in (0..3).filter(|_| labels[t] == 1) {
                let twin = self.manifold.twins[3 * t + k];
                if twin == NONE || labels[twin as usize / 3] != 1 {
                    let [a, b] = [tri[k], tri[(k + 1) % 3]].map(|v| self.manifold.positions[v as usize]);
                    rim += (b - a).norm();
                }
            }
        }
        let [_, one, two] = areas;
        f64::min(one, two) >= BALANCE * f64::max(one, two) && one >= WIDTH * thickness * rim
    }

    fn sheet(&self, soup: &Soup, labels: &[u8], groups: &[u32], usual: &[f64], given: bool) -> Result<Option<Sheet>> {
        let mut told = vec![false; self.n_pieces];
        for group in (0..self.n_pieces as u32).filter(|p| groups[*p as usize] == *p) {
            told[group as usize] = self.is_sheet(labels, groups, group, usual[group as usize]);
            if given && !told[group as usize] {
                let t = (0..labels.len()).find(|t| groups[self.piece[*t] as usize] == group).unwrap_or(0);
                let place = soup.place(self.manifold.soup[self.manifold.triangles[t][0] as usize]);
                return Err(Error::new(
                    ErrorKind::InvalidMesh,
                    format!(
                        "two sides cannot be told apart: the piece with {place} is as thick as it is wide, or its sides differ: \
                         give another thickness, or none"
                    ),
                ));
            }
        }
        let is_told = |t: usize| {
            let group = groups[self.piece[t] as usize];
            group != NONE && told[group as usize]
        };
        let mut moved = self.manifold.positions.clone();
        let mut done = vec![false; moved.len()];
        let mut largest: (f64, f64) = (0.0, 0.0);
        for t in (0..labels.len()).filter(|t| labels[*t] == 1 && is_told(*t)) {
            let group = groups[self.piece[t] as usize];
            largest =
                if self.ground.areas[t] > largest.0 { (self.ground.areas[t], usual[group as usize]) } else { largest };
            for v in self.manifold.triangles[t]
                .map(|v| v as usize)
                .into_iter()
                .filter(|v| !std::mem::replace(&mut done[*v], true))
            {
                let x = self.manifold.positions[v];
                let accept = |s: usize| labels[s] == 2 && groups[self.piece[s] as usize] == group;
                if let Some(foot) = self.ground.nearest(&x, THICKEST * usual[group as usize], accept) {
                    moved[v] = 0.5 * (x + foot.place);
                }
            }
        }
        let kept: Vec<bool> = (0..labels.len()).map(|t| !is_told(t) || labels[t] == 1).collect();
        let n_dropped = kept.iter().filter(|k| !**k).count();
        Ok((n_dropped > 0).then_some(Sheet { kept, moved, thickness: largest.1, n_dropped }))
    }
}

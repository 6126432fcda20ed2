//! An isotropic remesh, after Botsch and Kobbelt ("A Remeshing Approach to Multiresolution Modeling", 2004): long edges are split, short ones collapsed,
//! edges flipped for six neighbours at a vertex, and vertices slide to the middle of these along the surface.

use super::edit::{Edit, Place, WIDEST, previous, quality, span};
use super::ground::Ground;
use super::lines::Lines;
use super::link::Manifold;
use crate::mesh::NONE;
use crate::{Result, Vec3};

/// Edges shorter than the first share of the wanted length collapse; edges longer than the second are split.
const SHORT: f64 = 0.8;
const LONG: f64 = 4.0 / 3.0;
/// From length to length of the edges that are split.
const LEVEL: f64 = 0.7;
/// Passes over all edges: at the first length, at each of the next, and for the triangles' shapes at the end.
const PASSES: usize = 6;
const MORE_PASSES: usize = 3;
const LAST_PASSES: usize = 4;
/// Lengths tried for the wanted number of vertices, and how near is near enough.
const LENGTHS: usize = 6;
const NEAR: f64 = 0.02;
/// A long edge may grow by this share, squared, where a short one collapses beside it.
const LONGER: f64 = 1.1;
/// The least quality of a triangle that is made.
const LEAST: f64 = 1e-9;
/// Cosine by which a triangle may turn when a vertex moves.
const TURN: f64 = 0.35;

/// The length of edges by which equilateral triangles over this area, with this boundary and Euler number, have so many vertices.
pub fn edge_length(area: f64, perimeter: f64, euler: f64, n: f64) -> f64 {
    // n = (2/√3) A/l² + P/(2l) + χ
    let (a, b, c) = (2.0 / 3f64.sqrt() * area, 0.5 * perimeter, (euler - n).min(-1.0));
    2.0 * a / (-b + (b * b - 4.0 * a * c).sqrt()).max(f64::MIN_POSITIVE)
}

pub struct Remesh<'a> {
    mesh: Edit,
    ground: &'a Ground<'a>,
    lines: &'a Lines,
    wanted: usize,
    /// No pass makes more vertices.
    most: usize,
    edge: f64,
    fan: Vec<u32>,
    other_fan: Vec<u32>,
}

/// Hears how much is done, and says whether to go on.
pub type Heard<'a> = dyn FnMut(f64) -> Result<()> + 'a;

/// A mesh of about `wanted` vertices, and the length of its edges.
pub fn remesh(
    manifold: &Manifold,
    ground: &Ground,
    lines: &Lines,
    wanted: usize,
    edge: f64,
    heard: &mut Heard,
) -> Result<(Edit, f64)> {
    let mut near = vec![0; manifold.positions.len()];
    for (t, tri) in manifold.triangles.iter().enumerate() {
        tri.iter().for_each(|v| near[*v as usize] = t as u32);
    }
    let mut mesh = Edit::new(manifold, near);
    mesh.lines.copy_from_slice(&lines.of_half);
    mesh.places.copy_from_slice(&lines.places);
    let most = (4 * wanted).max(2 * manifold.positions.len()) + 1000;
    let mut work = Remesh { mesh, ground, lines, wanted, most, edge, fan: vec![], other_fan: vec![] };
    work.coarsen(heard)?;
    for round in 0..LENGTHS {
        for pass in 0..if round == 0 { PASSES } else { MORE_PASSES } {
            heard((round as f64 + pass as f64 / PASSES as f64) / LENGTHS as f64 * 0.6 + 0.3)?;
            work.pass();
        }
        let ratio = work.mesh.n_alive as f64 / work.wanted as f64;
        if (ratio - 1.0).abs() <= NEAR || round + 1 == LENGTHS {
            break;
        }
        work.edge *= ratio.sqrt().clamp(0.5, 2.0);
    }
    for _ in 0..LAST_PASSES {
        heard(0.95)?;
        work.flip(true);
        work.smooth();
    }
    work.flip(true);
    Ok((work.mesh, work.edge))
}

impl Remesh<'_> {
    fn pass(&mut self) {
        self.split();
        self.collapse(SHORT * self.edge);
        self.flip(false);
        self.smooth();
    }

    /// Of a fine mesh first the shortest edges, then twice as long ones, and so on, so that no vertex takes in all around it.
    fn coarsen(&mut self, heard: &mut Heard) -> Result<()> {
        let stands = (0..self.mesh.twins.len() as u32).filter(|h| self.mesh.stands(*h));
        let mut lengths: Vec<f64> = stands.map(|h| self.mesh.squared(h).sqrt()).collect();
        let short = lengths.len() / 20;
        let short = *lengths.select_nth_unstable_by(short, f64::total_cmp).1;
        let levels = libm::log2(SHORT * self.edge / short.max(1e-9)).ceil().clamp(1.0, 16.0) as i32;
        for level in (0..levels).rev() {
            heard(0.3 * f64::from(levels - 1 - level) / f64::from(levels))?;
            self.collapse(SHORT * self.edge * 0.5f64.powi(level));
        }
        Ok(())
    }

    /// The longest first, so that long triangles are halved and not peeled.
    fn split(&mut self) {
        let least = LONG * self.edge;
        let stands = (0..self.mesh.twins.len() as u32).filter(|h| self.mesh.stands(*h));
        let mut limit = LEVEL * stands.map(|h| self.mesh.squared(h)).fold(0.0, f64::max).sqrt();
        loop {
            limit = limit.max(least);
            let mut h = 0;
            while h < self.mesh.twins.len() as u32 && self.mesh.n_alive < self.most {
                if self.mesh.stands(h) && self.mesh.squared(h) > limit * limit {
                    self.mesh.split(h);
                }
                h += 1;
            }
            if limit == least {
                return;
            }
            self.flip(true);
            limit *= LEVEL;
        }
    }

    fn collapse(&mut self, short: f64) {
        for h in 0..self.mesh.twins.len() as u32 {
            if self.mesh.stands(h) && self.mesh.squared(h) < short * short {
                let twin = self.mesh.twins[h as usize];
                if !self.collapse_toward(h) && twin != NONE {
                    self.collapse_toward(twin);
                }
            }
        }
    }

    /// Moves the vertex that `h` begins at to where it ends, where that is allowed. The boundary has one half-edge: of it the end may go, too.
    fn collapse_toward(&mut self, h: u32) -> bool {
        let ends = [self.mesh.from(h), self.mesh.to(h)];
        let on_line = self.mesh.lines[h as usize] != NONE;
        let may_go = |v: u32| match self.mesh.places[v as usize] {
            Place::Free => true,
            Place::Line => on_line,
            Place::Corner => false,
        };
        if self.mesh.n_alive <= 3 {
            return false;
        }
        if may_go(ends[0]) {
            return self.collapse_one(h, ends[0], ends[1]);
        }
        self.mesh.twins[h as usize] == NONE && may_go(ends[1]) && self.collapse_one(h, ends[1], ends[0])
    }

    /// The edge `h` vanishes, and of its ends `stays` stays where it is.
    fn collapse_one(&mut self, h: u32, goes: u32, stays: u32) -> bool {
        let (mut fan, mut other) = (std::mem::take(&mut self.fan), std::mem::take(&mut self.other_fan));
        let open = (self.mesh.fan(goes, &mut fan), self.mesh.fan(stays, &mut other));
        let fits = match open {
            (Some(open), Some(other_open)) => {
                self.fits(goes, *self.mesh.at(stays), &fan, open, stays)
                    && self.mesh.may_collapse(h, &fan, open, &other, other_open)
            }
            _ => false,
        };
        if fits {
            let last = self.mesh.to(h); // which is what is left
            if last != stays {
                self.mesh.positions[last as usize] = *self.mesh.at(stays);
                self.mesh.places[last as usize] = self.mesh.places[stays as usize];
                self.mesh.near[last as usize] = self.mesh.near[stays as usize];
            }
            self.mesh.collapse(h, if last == stays { &fan } else { &other });
        }
        (self.fan, self.other_fan) = (fan, other);
        fits
    }

    /// Whether the triangles around `a` are still good when it is at `x`, where those with `gone` vanish.
    fn fits(&self, a: u32, x: Vec3, fan: &[u32], open: bool, gone: u32) -> bool {
        let limit = (LONG * self.edge).powi(2);
        let here = *self.mesh.at(a);
        let too_long = |v: u32| {
            let (was, is) = ((self.mesh.at(v) - here).norm_squared(), (self.mesh.at(v) - x).norm_squared());
            is > limit && (was <= limit || is > LONGER * was)
        };
        if self.mesh.ring(fan, open).any(|v| v != gone && too_long(v)) {
            return false;
        }
        let sum: Vec3 =
            fan.iter().map(|h| span(&here, self.mesh.at(self.mesh.to(*h)), self.mesh.at(self.mesh.apex(*h)))).sum();
        fan.iter().all(|h| {
            let (b, c) = (self.mesh.to(*h), self.mesh.apex(*h));
            if b == gone || c == gone {
                return true;
            }
            let (p, q) = (self.mesh.at(b), self.mesh.at(c));
            let (before, after) = (span(&here, p, q), span(&x, p, q));
            let (was, is) = (quality(&here, p, q), quality(&x, p, q));
            let reference = if was > 0.1 { before } else { sum };
            let turned = after.dot(&reference) <= TURN * after.norm() * reference.norm();
            is > LEAST && is > (0.3 * was).min(0.1) && !turned
        })
    }

    fn valences(&mut self) -> Vec<i32> {
        let mut fan = std::mem::take(&mut self.fan);
        let wanted = |v: u32, fan: &mut Vec<u32>| {
            // How many more than it should have.
            match self.mesh.fan(v, fan) {
                Some(true) => fan.len() as i32 + 1 - 4,
                Some(false) => fan.len() as i32 - 6,
                None if self.mesh.is_vertex(v) => WIDEST as i32,
                None => 0,
            }
        };
        let out = (0..self.mesh.positions.len() as u32).map(|v| wanted(v, &mut fan)).collect();
        self.fan = fan;
        out
    }

    /// For even numbers of neighbours, or for the triangles' shapes.
    fn flip(&mut self, by_shape: bool) {
        let mut excess = self.valences();
        for h in 0..self.mesh.twins.len() as u32 {
            let g = self.mesh.twins[h as usize];
            if !self.mesh.stands(h) || g == NONE || self.mesh.lines[h as usize] != NONE {
                continue;
            }
            let corners = [self.mesh.from(h), self.mesh.to(h), self.mesh.apex(h), self.mesh.apex(g)];
            let [a, b, c, d] = corners.map(|v| *self.mesh.at(v));
            let (first, second) = (span(&a, &b, &c), span(&b, &a, &d));
            let (was, is) =
                (quality(&a, &b, &c).min(quality(&b, &a, &d)), quality(&d, &c, &a).min(quality(&c, &d, &b)));
            let better = if by_shape {
                is > was + 1e-3
            } else {
                let of = |change: [i32; 4]| -> i32 {
                    (0..4).map(|k| (excess[corners[k] as usize] + change[k]).pow(2)).sum()
                };
                of([-1, -1, 1, 1]) < of([0; 4]) && is > (0.5 * was).min(0.3)
            };
            if !better || is < LEAST {
                continue;
            }
            let up = first + second;
            let flat = was < 0.05 || first.dot(&second) > 0.5 * first.norm() * second.norm();
            let upright = [span(&d, &c, &a), span(&c, &d, &b)].iter().all(|n| n.dot(&up) > TURN * n.norm() * up.norm());
            let mut fan = std::mem::take(&mut self.fan);
            let narrow = if excess[corners[2] as usize] < excess[corners[3] as usize] { [2, 3] } else { [3, 2] };
            if flat && upright && !self.mesh.joined(corners[narrow[0]], corners[narrow[1]], &mut fan) {
                self.mesh.flip(h);
                (0..4).for_each(|k| excess[corners[k] as usize] += [-1, -1, 1, 1][k]);
            }
            self.fan = fan;
        }
    }

    /// Each vertex toward the middle of its neighbours, along the surface or its line.
    fn smooth(&mut self) {
        let mut fan = std::mem::take(&mut self.fan);
        for v in 0..self.mesh.positions.len() as u32 {
            if !self.mesh.is_vertex(v) || self.mesh.places[v as usize] == Place::Corner {
                continue;
            }
            let Some(open) = self.mesh.fan(v, &mut fan) else { continue };
            let moved = match self.mesh.places[v as usize] {
                Place::Line => self.along_line(v, &fan),
                _ => self.along_surface(v, &fan, open),
            };
            let Some((x, near)) = moved else { continue };
            if self.stays_good(v, &x, &fan) {
                self.mesh.positions[v as usize] = x;
                self.mesh.near[v as usize] = near;
            }
        }
        self.fan = fan;
    }

    fn along_surface(&self, v: u32, fan: &[u32], open: bool) -> Option<(Vec3, u32)> {
        let x = *self.mesh.at(v);
        let (mut middle, mut count) = (Vec3::zeros(), 0.0);
        for w in self.mesh.ring(fan, open) {
            middle += self.mesh.at(w);
            count += 1.0;
        }
        let up: Vec3 =
            fan.iter().map(|h| span(&x, self.mesh.at(self.mesh.to(*h)), self.mesh.at(self.mesh.apex(*h)))).sum();
        let up = up.try_normalize(0.0)?;
        let step = middle / count - x;
        let aim = x + step - up * step.dot(&up);
        let foot = self.ground.facing(&aim, &up, self.mesh.near[v as usize], self.edge)?;
        Some((foot.place, foot.triangle))
    }

    fn along_line(&self, v: u32, fan: &[u32]) -> Option<(Vec3, u32)> {
        let (mut middle, mut line, mut count) = (Vec3::zeros(), NONE, 0);
        for &h in fan {
            let onward = self.mesh.lines[h as usize];
            if onward != NONE {
                (middle, line, count) = (middle + self.mesh.at(self.mesh.to(h)), onward, count + 1);
            }
            let back = previous(h);
            if self.mesh.lines[back as usize] != NONE && self.mesh.twins[back as usize] == NONE {
                (middle, line, count) =
                    (middle + self.mesh.at(self.mesh.from(back)), self.mesh.lines[back as usize], count + 1);
            }
        }
        if count != 2 {
            return None;
        }
        let place = self.lines.nearest(self.ground.positions, &(0.5 * middle), line)?;
        Some((place, self.mesh.near[v as usize]))
    }

    fn stays_good(&self, v: u32, x: &Vec3, fan: &[u32]) -> bool {
        let here = self.mesh.at(v);
        let corners = |h: &u32| (self.mesh.at(self.mesh.to(*h)), self.mesh.at(self.mesh.apex(*h)));
        let sum: Vec3 = fan.iter().map(corners).map(|(p, q)| span(here, p, q)).sum();
        fan.iter().map(corners).all(|(p, q)| {
            let (before, after) = (span(here, p, q), span(x, p, q));
            let (was, is) = (quality(here, p, q), quality(x, p, q));
            let reference = if was > 0.05 { before } else { sum };
            after.dot(&reference) > TURN * after.norm() * reference.norm() && is > (0.7 * was).min(0.3)
        })
    }
}

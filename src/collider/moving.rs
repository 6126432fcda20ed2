//! A closed mesh that moves: the exact distance to its triangles, by a tree of boxes that is fitted to each shape anew.
//!
//! The sign is that of the normal at the nearest point: a triangle's, the sum of two at a side, the sum by angles at a corner (Bærentzen and
//! Aanæs, 2005).

use super::surface::{Surface, ball_about, check_sides};
use super::tree::{FAR_OFF, Nearest, Tree, corners};
use super::{Ball, Touch, sweep};
use crate::Vec3;
use crate::error::{Error, Result, invalid, reserve, try_zeroed};

/// Coordinates in sizes of the first shape: more would be an accident.
const MOST_MOVED: f64 = 1e30;
/// Of the size: nearer than this the way to the surface has no sure direction.
pub(super) const ON_SURFACE: f64 = 1e-12;
/// Two sides of a wedge of 67°: as a grid's thin parts.
const FACING: f64 = 0.55;
/// Triangles of which the thickness is looked at, and a way in sizes that comes through everything.
const LOOKS: usize = 20_000;
const ACROSS: f64 = 4.0;
/// Of the size: how near a margin inside is met, and steps to it.
const CLOSE: f64 = 1e-6;
const STEPS: usize = 10_000;
/// In sizes: the square of a square of a longer way is no number.
pub(super) const FARTHEST_WAY: f64 = 1e60;

#[derive(Clone, Debug)]
pub(super) struct Moving {
    /// Now and before, in units of `unit`; as many as the host's.
    pub positions: Vec<Vec3>,
    pub before: Vec<Vec3>,
    /// In the order of the tree.
    pub triangles: Vec<[u32; 3]>,
    pub unit: f64,
    /// The shape before is another one.
    pub moved: bool,
    /// Of the shape that it was made with.
    pub inner_radius: f64,
    pub ball: Ball,
    pub tree: Tree,
    /// Per triangle, those beyond the sides from each corner to the next; itself at the rim of an open one.
    pub across: Vec<[u32; 3]>,
    /// The triangles at vertex v are `fans[first_of_fan[v]..first_of_fan[v + 1]]`.
    first_of_fan: Vec<u32>,
    fans: Vec<u32>,
}

/// Whether every side needs a triangle beyond it.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Rim {
    None,
    Allowed,
}

impl Moving {
    pub fn of(before: &[Vec3], after: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let surface = Surface::closed(after, triangles)?;
        let unit = surface.unit;
        let mut moving = Self::new(surface.positions.clone(), surface.positions, surface.triangles, unit, Rim::None)?;
        let (least, most) = moving.thickness();
        moving.inner_radius = unit * if least.is_finite() { least } else { most };
        moving.begin(before)?;
        Ok(moving)
    }

    /// With that shape before.
    pub fn begin(&mut self, before: &[Vec3]) -> Result<()> {
        self.check(before)?;
        self.before.iter_mut().zip(before).for_each(|(own, x)| *own = x / self.unit);
        self.moved = self.before != self.positions;
        Ok(())
    }

    /// Of triangles in the order of a tree. Its inner radius is to be set.
    pub fn new(positions: Vec<Vec3>, before: Vec<Vec3>, triangles: Vec<[u32; 3]>, unit: f64, rim: Rim) -> Result<Self> {
        let n = positions.len();
        let known = |x: &Vec3| x.iter().all(|c| c.abs() <= MOST_MOVED); // no NaN is
        let fits = triangles.iter().flatten().all(|v| (*v as usize) < n) && before.len() == n;
        if !fits || !positions.iter().chain(&before).all(known) {
            return invalid("the moving mesh names vertices that are not there, or that are too far away");
        }
        check_sides(&triangles, rim)?;
        let tree = Tree::new(&positions, &triangles)?;
        let ball = ball_about(&positions, &triangles, unit);
        let (first_of_fan, fans) = fans(n, &triangles)?;
        let mut across = reserve("the sides of the mesh", triangles.len())?;
        for t in 0..triangles.len() {
            let beyond = |k: usize| {
                let (from, to) = (triangles[t][k], triangles[t][(k + 1) % 3]);
                let fan = &fans[first_of_fan[to as usize] as usize..first_of_fan[to as usize + 1] as usize];
                let runs_back = |s: &&u32| {
                    (0..3).any(|k| triangles[**s as usize][k] == to && triangles[**s as usize][(k + 1) % 3] == from)
                };
                fan.iter().find(runs_back).copied().unwrap_or(t as u32)
            };
            across.push([beyond(0), beyond(1), beyond(2)]);
        }
        let moved = positions != before;
        Ok(Self {
            positions,
            before,
            triangles,
            unit,
            moved,
            inner_radius: unit,
            ball,
            tree,
            across,
            first_of_fan,
            fans,
        })
    }

    fn check(&self, positions: &[Vec3]) -> Result<()> {
        let (n, given) = (self.positions.len(), positions.len());
        if given != n {
            return Err(Error::argument(format!("the moving mesh has {n} vertices; {given} positions were given")));
        }
        let limit = MOST_MOVED * self.unit;
        match positions
            .iter()
            .enumerate()
            .find_map(|(v, x)| x.iter().find(|c| c.is_nan() || c.abs() > limit).map(|c| (v, *c)))
        {
            Some((v, bad)) => Err(Error::argument(format!(
                "vertex {v} of the moving mesh has the coordinate {bad:?}: the limit is {limit:e}"
            ))),
            None => Ok(()),
        }
    }

    /// What was the shape is the one before. Allocates nothing; a failure changes nothing.
    pub fn update(&mut self, positions: &[Vec3]) -> Result<()> {
        self.check(positions)?;
        std::mem::swap(&mut self.before, &mut self.positions);
        self.positions.iter_mut().zip(positions).for_each(|(own, x)| *own = x / self.unit);
        self.moved = true;
        self.refit();
        Ok(())
    }

    /// Another shape in the place of this one: the one before stays.
    pub fn replace(&mut self, positions: &[Vec3]) -> Result<()> {
        if !self.moved {
            return self.update(positions);
        }
        self.check(positions)?;
        self.positions.iter_mut().zip(positions).for_each(|(own, x)| *own = x / self.unit);
        self.refit();
        Ok(())
    }

    /// From now on the shape before is this one.
    pub fn arrive(&mut self) {
        self.before.copy_from_slice(&self.positions);
        self.moved = false;
    }

    fn refit(&mut self) {
        self.tree.refit(&self.positions, &self.triangles);
        self.ball = ball_about(&self.positions, &self.triangles, self.unit);
    }

    #[inline]
    fn nearest(&self, p: &Vec3) -> Nearest {
        self.nearest_from(p, 0)
    }

    /// The same, faster where triangle `likely` is near.
    #[inline]
    pub fn nearest_from(&self, p: &Vec3, likely: usize) -> Nearest {
        let near = p.map(|c| c.clamp(-FAR_OFF, FAR_OFF)); // its square is a number
        let mut nearest = Nearest::within(f64::INFINITY);
        nearest.look_at(&self.positions, &self.triangles, &near, likely);
        self.tree.nearest(&self.positions, &self.triangles, &near, nearest)
    }

    pub fn touch(&self, p: &Vec3) -> Touch {
        let p = p / self.unit;
        let nearest = self.nearest(&p);
        let way = p - nearest.foot(&self.positions, &self.triangles);
        let normal = self.normal(&nearest);
        let distance = crate::wide_norm(&way);
        let sign = if normal.dot(&way) < 0.0 { -1.0 } else { 1.0 };
        let own = normal.try_normalize(1e-100).unwrap_or_else(Vec3::x); // x where all triangles around have no area
        let normal = if distance > ON_SURFACE { way * (sign / distance) } else { own };
        Touch { distance: sign * distance * self.unit, normal }
    }

    /// None where the distance is surely more than `reach`, by the box about all.
    #[inline]
    pub fn touch_within(&self, p: &Vec3, reach: f64) -> Option<Touch> {
        (self.tree.box_distance(&(p / self.unit)) * self.unit <= reach.max(0.0)).then(|| self.touch(p))
    }

    /// How far the point of the surface next to `p` came.
    pub fn slip(&self, p: &Vec3) -> Vec3 {
        let Nearest { triangle, weights, .. } = self.nearest(&(p / self.unit));
        let [a, b, c] = self.triangles[triangle].map(|v| self.positions[v as usize] - self.before[v as usize]);
        (weights[0] * a + weights[1] * b + weights[2] * c) * self.unit
    }

    pub fn face_normal(&self, t: usize) -> Vec3 {
        let [a, b, c] = corners(&self.positions, &self.triangles[t]);
        (b - a).cross(&(c - a)).try_normalize(1e-100).unwrap_or_default()
    }

    /// Of any length: on its side of the surface is the outside.
    pub fn normal(&self, nearest: &Nearest) -> Vec3 {
        let (t, on) = (nearest.triangle, nearest.weights.map(|w| w != 0.0));
        match on {
            [true, true, true] => self.face_normal(t),
            [true, true, false] => self.face_normal(t) + self.face_normal(self.across[t][0] as usize),
            [false, true, true] => self.face_normal(t) + self.face_normal(self.across[t][1] as usize),
            [true, false, true] => self.face_normal(t) + self.face_normal(self.across[t][2] as usize),
            _ => {
                let v = self.triangles[t][on.iter().position(|on| *on).unwrap_or(0)] as usize;
                self.fan(v as u32).iter().map(|t| self.angle(*t as usize, v) * self.face_normal(*t as usize)).sum()
            }
        }
    }

    /// The triangles at a vertex.
    pub fn fan(&self, v: u32) -> &[u32] {
        &self.fans[self.first_of_fan[v as usize] as usize..self.first_of_fan[v as usize + 1] as usize]
    }

    /// Of triangle `t` at its vertex `v`.
    fn angle(&self, t: usize, v: usize) -> f64 {
        let triangle = self.triangles[t];
        let k = triangle.iter().position(|w| *w as usize == v).unwrap_or(0);
        let at = |k: usize| self.positions[triangle[k % 3] as usize];
        let (a, b) = (at(k + 1) - at(k), at(k + 2) - at(k));
        libm::atan2(a.cross(&b).norm(), a.dot(&b))
    }

    /// Half the least way straight through, from the middle of a triangle to a side that faces it, infinite where none does; and half the longest of any.
    pub fn thickness(&self) -> (f64, f64) {
        let (mut least, mut most) = (f64::INFINITY, ON_SURFACE);
        for t in (0..self.triangles.len()).step_by(self.triangles.len().div_ceil(LOOKS)) {
            let [a, b, c] = corners(&self.positions, &self.triangles[t]);
            let (middle, normal) = ((a + b + c) / 3.0, self.face_normal(t));
            let Some((through, other)) = self.way_through(t, &middle, &(-ACROSS * normal)) else { continue };
            let half = 0.5 * ACROSS * through;
            most = most.max(half);
            if 0.5 * (normal + self.face_normal(other)).norm() <= FACING {
                least = least.min(half);
            }
        }
        (least, most)
    }

    /// The share of a way from triangle `t` where it comes through another one, and which.
    fn way_through(&self, t: usize, from: &Vec3, way: &Vec3) -> Option<(f64, usize)> {
        let mut first: Option<(f64, usize)> = None;
        self.tree.visit_way(from, way, 0.0, |triangles| {
            for other in triangles.filter(|other| *other != t) {
                let [a, b, c] = corners(&self.positions, &self.triangles[other]).map(|x| x - from);
                let sides = [way.dot(&b.cross(&c)), way.dot(&c.cross(&a)), way.dot(&a.cross(&b))];
                let normal = (b - a).cross(&(c - a));
                let share = normal.dot(&a) / normal.dot(way);
                let outwards = sides.iter().all(|side| *side >= 0.0) && share > ON_SURFACE; // no NaN is
                if outwards && first.is_none_or(|(least, _)| share < least) {
                    first = Some((share, other));
                }
            }
            first.map_or(1.0, |(share, _)| share)
        });
        first
    }

    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.tree.bytes()
            + (self.positions.capacity() + self.before.capacity()) * size_of::<Vec3>()
            + (self.triangles.capacity() + self.across.capacity()) * size_of::<[u32; 3]>()
            + (self.first_of_fan.capacity() + self.fans.capacity()) * size_of::<u32>()
    }

    /// From a margin outside on, that of the first triangle: the distance to a triangle is convex. To one inside by steps of the distance.
    pub fn first_touch(&self, from: &Vec3, to: &Vec3, margin: f64) -> Option<(f64, Touch)> {
        if self.touch(from).distance <= margin {
            return None;
        }
        if from.amax().max(to.amax()) > FARTHEST_WAY * self.unit {
            return None;
        }
        if margin < 0.0 {
            return advance(|p| self.touch(p), (from, to), margin, self.unit);
        }
        let ends = [from, to].map(|p| p / self.unit);
        let share = sweep_triangles(&self.tree, (&self.positions, &self.triangles), &ends, margin / self.unit)?;
        Some((share, self.touch(&(from + share * (to - from)))))
    }
}

/// The share of a way, from a place farther off than `margin` from all triangles, where it first comes as near to one. In units of the mesh.
pub(super) fn sweep_triangles(
    tree: &Tree,
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    [start, end]: &[Vec3; 2],
    margin: f64,
) -> Option<f64> {
    let mut first: Option<f64> = None;
    tree.visit_way(start, &(end - start), margin, |range| {
        for t in range {
            let corners = corners(positions, &triangles[t]);
            let end = start + first.unwrap_or(1.0) * (end - start);
            let way = |p: &Vec3| {
                let foot = super::triangle::place(&corners, &super::triangle::nearest_weights(&corners, p));
                let distance = (p - foot).norm();
                Touch { distance, normal: (p - foot).try_normalize(0.0).unwrap_or_else(Vec3::x) }
            };
            // One that is within the margin at the start would have been within it as a whole.
            if let Some((share, _)) = sweep::convex(way, start, &end, margin) {
                first = Some(share * first.unwrap_or(1.0));
            }
        }
        first.unwrap_or(1.0)
    });
    first
}

/// By steps of the distance, from a place that is outside of the margin.
pub(super) fn advance(
    touch_at: impl Fn(&Vec3) -> Touch,
    (from, to): (&Vec3, &Vec3),
    margin: f64,
    unit: f64,
) -> Option<(f64, Touch)> {
    let length = crate::wide_norm(&(to - from));
    let (mut share, mut last) = (0.0, None);
    for _ in 0..STEPS {
        let touch = touch_at(&(from + share * (to - from)));
        let gap = touch.distance - margin;
        if gap <= CLOSE * unit {
            return Some((share, touch));
        }
        if share >= 1.0 || length == 0.0 {
            return None;
        }
        last = Some((share, touch));
        share = (share + gap / length).min(1.0);
    }
    last
}

/// The triangles at each vertex.
fn fans(n: usize, triangles: &[[u32; 3]]) -> Result<(Vec<u32>, Vec<u32>)> {
    let mut first: Vec<u32> = try_zeroed("the fans of the mesh", n + 2)?;
    triangles.iter().flatten().for_each(|v| first[*v as usize + 2] += 1);
    (2..n + 2).for_each(|v| first[v] += first[v - 1]);
    let mut fans = try_zeroed("the fans of the mesh", 3 * triangles.len())?;
    for (t, triangle) in triangles.iter().enumerate() {
        for v in triangle {
            let at = &mut first[*v as usize + 1];
            fans[*at as usize] = t as u32;
            *at += 1;
        }
    }
    first.pop();
    Ok((first, fans))
}

//! A mesh that may be open, solid behind its triangles by a depth. It may move.
//!
//! A place is within it where its nearest point of the sheet is in front of it, no farther than the depth, and not on the rim. So the back is the surface
//! at that depth, the walls stand on the rim along the normals, and neither folds, however sharp the sheet is bent or thin it is:
//!
//!   d = s in front,   −min(s, depth − s, w) within,   min(|s − depth|, w) behind
//!
//! with s from the sheet and w from the walls. Where a back meets the front of another part, the front is right: there d jumps within the solid.

use super::moving::{FARTHEST_WAY, Moving, ON_SURFACE, Rim, advance, sweep_triangles};
use super::surface::Surface;
use super::tree::{self, FAR_OFF, Nearest, Tree};
use super::{Ball, Touch};
use crate::error::{Error, Result, invalid, reserve, try_zeroed};
use crate::{Vec3, wide_norm};

/// Of the mesh's longest side, where none is given: four cells of a grid of 64.
const DEPTH: f64 = 1.0 / 16.0;
/// Depths in longest sides of the mesh.
const DEPTHS: std::ops::RangeInclusive<f64> = 1e-6..=100.0;
/// Of a distance squared: what rounding takes of it; and how often the end of a wall is halved.
const NEAREST: f64 = 1e-9;
const HALVINGS: usize = 12;
/// Of the depth: what the rounding of a sweep leaves.
const ROUNDING: f64 = 1e-9;
/// Sine of a bend that is none, and the most that a wall gets narrower.
const FLAT: f64 = 1e-9;
const STEEPEST: f64 = 1e6;
/// Of the depth, or the side: near to a vertex.
const BESIDE: f64 = 0.05;

#[derive(Clone, Debug)]
pub(super) struct Sheet {
    pub mesh: Moving,
    /// In units of the mesh.
    pub depth: f64,
    /// Of vertices.
    on_rim: Vec<bool>,
    /// Triangles and their sides at the rim.
    sides: Vec<(u32, u8)>,
    /// Two triangles and a side of the first between them that ends at the rim, and whether its end does.
    hinges: Vec<(u32, u32, u8, bool)>,
    /// Four a side and four a hinge.
    corners: Vec<Vec3>,
    /// Two triangles each.
    walls: Vec<[u32; 3]>,
    /// Of the walls; none where the mesh has no rim.
    tree: Option<Tree>,
    pub ball: Ball,
}

impl Sheet {
    pub fn of(before: &[Vec3], after: &[Vec3], triangles: &[[u32; 3]], depth: f64) -> Result<Self> {
        let surface = Surface::open(after, triangles)?;
        let (unit, longest) = (surface.unit, surface.longest());
        let depth = depth_of(depth, longest * unit)? / unit;
        let mesh = Moving::new(surface.positions.clone(), surface.positions, surface.triangles, unit, Rim::Allowed)?;
        let mut sheet = Self::new(mesh, depth)?;
        sheet.mesh.inner_radius = sheet.mesh.thickness().0.min(0.5 * sheet.depth) * unit;
        sheet.mesh.begin(before)?;
        Ok(sheet)
    }

    /// Of a mesh that may have a rim. Its inner radius is to be set.
    pub fn new(mesh: Moving, depth: f64) -> Result<Self> {
        if !(depth > 0.0 && depth <= 2.0 * DEPTHS.end()) {
            return invalid(format!("its depth is {depth:?} of its size"));
        }
        let (mut on_rim, n) = (try_zeroed("the rim of the mesh", mesh.positions.len())?, mesh.triangles.len());
        let all = || (0..n as u32).flat_map(|t| (0..3u8).map(move |k| (t, k)));
        let beyond = |(t, k): (u32, u8)| mesh.across[t as usize][usize::from(k)];
        let end = |(t, k): (u32, u8)| mesh.triangles[t as usize][usize::from(k) % 3] as usize;
        let sides: Vec<(u32, u8)> = all().filter(|side| beyond(*side) == side.0).collect();
        for (t, k) in &sides {
            on_rim[end((*t, *k))] = true;
            on_rim[end((*t, k + 1))] = true;
        }
        let mut hinges = vec![];
        for (t, k) in all().filter(|side| beyond(*side) > side.0) {
            for far in [false, true] {
                if on_rim[end((t, k + u8::from(far)))] {
                    hinges.push((t, beyond((t, k)), k, far));
                }
            }
        }
        let pieces = sides.len() + hinges.len();
        let corners = try_zeroed("the walls of the mesh", 4 * pieces)?;
        let mut walls = reserve("the walls of the mesh", 2 * pieces)?;
        for piece in 0..pieces as u32 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| 4 * piece + k);
            let first = [a, c, b];
            walls.extend(if (piece as usize) < sides.len() { [first, [b, c, d]] } else { [first, [a, d, c]] });
        }
        let ball = mesh.ball;
        let mut sheet = Self { mesh, depth, on_rim, sides, hinges, corners, walls, tree: None, ball };
        sheet.build();
        if !sheet.walls.is_empty() {
            // They are as near to each other as the triangles, which are sorted.
            sheet.tree = Some(Tree::new(&sheet.corners, &sheet.walls)?);
        }
        Ok(sheet)
    }

    /// The walls where the mesh is now, and what is about all.
    fn build(&mut self) {
        let mesh = &self.mesh;
        self.ball = Ball { radius: mesh.ball.radius + self.depth * mesh.unit, ..mesh.ball };
        let vertex = |t: u32, k: u8| mesh.triangles[t as usize][usize::from(k % 3)];
        let mut corners = std::mem::take(&mut self.corners);
        let (sides, hinges) = corners.split_at_mut(4 * self.sides.len());
        for ((t, k), wall) in self.sides.iter().zip(sides.chunks_exact_mut(4)) {
            let (normal, ends) = (mesh.face_normal(*t as usize), [vertex(*t, *k), vertex(*t, k + 1)]);
            let [from, to] = ends.map(|v| mesh.positions[v as usize]);
            let (length, along) = (wide_norm(&(to - from)), (to - from).try_normalize(1e-100).unwrap_or_default());
            let in_by = [self.slant(ends[0], &normal, &(to - from)), self.slant(ends[1], &normal, &(from - to))];
            let most = (length / (in_by[0] + in_by[1])).min(self.depth); // there they meet
            let back = |x: Vec3, way: Vec3| x + self.reach(&x, &way, most) * way;
            let ends = [back(from, in_by[0] * along - normal), back(to, -in_by[1] * along - normal)];
            wall.copy_from_slice(&[from, to, ends[0], ends[1]]);
        }
        for ((t, other, k, far), wall) in self.hinges.iter().zip(hinges.chunks_exact_mut(4)) {
            let v = vertex(*t, k + u8::from(*far));
            let x = mesh.positions[v as usize];
            let [own, beyond] = [*t, *other].map(|t| mesh.face_normal(t as usize));
            let side = mesh.positions[vertex(*t, k + 1) as usize] - mesh.positions[vertex(*t, *k) as usize];
            wall.fill(x);
            // Hollow in front: the places behind that are next to the end of the hinge fill a wedge between the normals.
            if own.cross(&beyond).dot(&side) < 0.0 {
                let middle = (own + beyond).try_normalize(1e-6).unwrap_or(own);
                let [a, b, c] = [own, middle, beyond].map(|n| x - self.reach(&x, &-n, self.depth) * n);
                wall[1..].copy_from_slice(&if *far { [a, b, c] } else { [c, b, a] });
            }
        }
        self.corners = corners;
    }

    /// How far a wall goes from a place on the rim, by this way for each length of depth: no further than it is the nearest place of the mesh.
    fn reach(&self, x: &Vec3, way: &Vec3, most: f64) -> f64 {
        let is_nearest = |t: f64| self.is_nearest(&(x + t * way), t);
        if is_nearest(most) {
            return most;
        }
        let (mut near, mut far) = (0.0, most);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if is_nearest(middle) {
                near = middle;
            } else {
                far = middle;
            }
        }
        near
    }

    /// How much narrower a wall gets with its depth at vertex `v`, along a side of the rim from there: the least by which that is the nearest place of the
    /// mesh still, of those that lead between two of the triangles at `v`.
    fn slant(&self, v: u32, normal: &Vec3, side: &Vec3) -> f64 {
        let (x, length) = (self.mesh.positions[v as usize], wide_norm(side));
        let along = side.try_normalize(1e-100).unwrap_or_default();
        let of = |t: &u32| {
            let other = self.mesh.face_normal(*t as usize);
            let towards = -along.dot(&other);
            let slant = if towards > FLAT { (1.0 - normal.dot(&other)).max(0.0) / towards } else { 0.0 };
            slant.min(STEEPEST)
        };
        let is_right = |slant: &f64| {
            let t = BESIDE * self.depth.min(length / (1.0 + slant));
            self.is_nearest(&(x + t * (*slant * along - normal)), t)
        };
        let fan = self.mesh.fan(v);
        let right = fan.iter().map(of).chain([0.0]).filter(is_right).min_by(f64::total_cmp);
        right.unwrap_or_else(|| fan.iter().map(of).fold(0.0, f64::max))
    }

    /// Nothing of the mesh is nearer than so far, but for a rounding.
    fn is_nearest(&self, p: &Vec3, distance: f64) -> bool {
        self.mesh.nearest_from(p, 0).squared >= distance * distance * (1.0 - NEAREST)
    }

    fn refit(&mut self) {
        self.build();
        if let Some(tree) = &mut self.tree {
            tree.refit(&self.corners, &self.walls);
        }
    }

    /// As of [`Moving`].
    pub fn update(&mut self, positions: &[Vec3]) -> Result<()> {
        self.mesh.update(positions)?;
        self.refit();
        Ok(())
    }

    /// As of [`Moving`].
    pub fn replace(&mut self, positions: &[Vec3]) -> Result<()> {
        self.mesh.replace(positions)?;
        self.refit();
        Ok(())
    }

    fn is_on_rim(&self, Nearest { triangle, weights, .. }: &Nearest) -> bool {
        let at = |k: usize| weights[k] != 0.0;
        let ends = self.mesh.triangles[*triangle];
        match (0..3).filter(|k| at(*k)).count() {
            3 => false,
            2 => (0..3).any(|k| at(k) && at((k + 1) % 3) && self.mesh.across[*triangle][k] as usize == *triangle),
            _ => (0..3).any(|k| at(k) && self.on_rim[ends[k] as usize]),
        }
    }

    pub fn touch(&self, p: &Vec3) -> Touch {
        let p = p / self.mesh.unit;
        let touch = self.touch_at(&p, &self.mesh.nearest_from(&p, 0));
        Touch { distance: touch.distance * self.mesh.unit, ..touch }
    }

    /// Of the nearest place of the mesh, in its units.
    pub fn touch_at(&self, p: &Vec3, nearest: &Nearest) -> Touch {
        let Self { mesh, depth, .. } = self;
        let way = p - nearest.foot(&mesh.positions, &mesh.triangles);
        let (front, off) = (mesh.normal(nearest), wide_norm(&way));
        let behind = front.dot(&way) < 0.0 && !self.is_on_rim(nearest);
        let own = front.try_normalize(1e-100).unwrap_or_else(Vec3::x); // x where all triangles around have no area
        let away = if off > ON_SURFACE {
            way / off
        } else if behind {
            -own
        } else {
            own
        };
        let (mut distance, mut normal) = match behind {
            false => (off, away),
            true if 2.0 * off < *depth => (-off, -away),
            true => (off - depth, away),
        };
        let within = behind && off < *depth;
        if let Some((wall, way)) = self.wall(p, distance.abs()) {
            let off = wide_norm(&way);
            let sign = if within { -1.0 } else { 1.0 };
            let [a, b, c] = tree::corners(&self.corners, &self.walls[wall]);
            let own = (b - a).cross(&(c - a)).try_normalize(1e-100).unwrap_or(normal);
            (distance, normal) = (sign * off, if off > ON_SURFACE { way * (sign / off) } else { own });
        }
        Touch { distance, normal }
    }

    /// The wall that is nearer than that, and the way from it.
    fn wall(&self, p: &Vec3, nearer: f64) -> Option<(usize, Vec3)> {
        let near = p.map(|c| c.clamp(-FAR_OFF, FAR_OFF));
        let best = Nearest::within(nearer.min(FAR_OFF));
        let nearest = self.tree.as_ref()?.nearest(&self.corners, &self.walls, &near, best);
        let found = nearest.triangle != usize::MAX;
        found.then(|| (nearest.triangle, p - nearest.foot(&self.corners, &self.walls)))
    }

    /// None where the distance is surely more than `reach`, by the box about the mesh.
    #[inline]
    pub fn touch_within(&self, p: &Vec3, reach: f64) -> Option<Touch> {
        let Self { mesh, depth, .. } = self;
        let far = (mesh.tree.box_distance(&(p / mesh.unit)) - depth) * mesh.unit > reach.max(0.0);
        (!far).then(|| self.touch(p))
    }

    /// Triangles and walls are swept against, the back where a way begins behind it. What comes round the rim to the back is followed by steps.
    pub fn first_touch(&self, from: &Vec3, to: &Vec3, margin: f64) -> Option<(f64, Touch)> {
        let Self { mesh, depth, .. } = self;
        if self.touch(from).distance <= margin || from.amax().max(to.amax()) > FARTHEST_WAY * mesh.unit {
            return None;
        }
        let by_steps = || advance(|p| self.touch(p), (from, to), margin, mesh.unit);
        if margin < 0.0 {
            return by_steps();
        }
        let ends = [from, to].map(|p| p / mesh.unit);
        let off = margin / mesh.unit;
        let first = mesh.nearest_from(&ends[0], 0);
        let way = ends[0] - first.foot(&mesh.positions, &mesh.triangles);
        let behind = mesh.normal(&first).dot(&way) < 0.0 && !self.is_on_rim(&first);
        let reach = if behind { off + depth } else { off };
        let mut share = sweep_triangles(&mesh.tree, (&mesh.positions, &mesh.triangles), &ends, reach);
        if let Some(tree) = &self.tree {
            let last = ends[0] + share.unwrap_or(1.0) * (ends[1] - ends[0]);
            let wall = sweep_triangles(tree, (&self.corners, &self.walls), &[ends[0], last], off);
            share = wall.map(|wall| wall * share.unwrap_or(1.0)).or(share);
        }
        let touch = self.touch(&(from + share.unwrap_or(1.0) * (to - from)));
        let off = (touch.distance - margin) / (depth * mesh.unit);
        match share {
            // Past a back that is nearer, or from within: it came in before.
            Some(_) if off.abs() > ROUNDING || touch.normal.dot(&(to - from)) > 0.0 => by_steps(),
            None if off < ROUNDING => by_steps(),
            _ => share.map(|share| (share, touch)),
        }
    }

    /// The box about all of it, in units of the mesh; a tenth of the depth may stick out where the sheet is hollow in front.
    pub fn box_about(&self) -> (Vec3, Vec3) {
        let Self { mesh, depth, .. } = self;
        let (mut low, mut high) = super::surface::box_about(&mesh.positions, &mesh.triangles);
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let own = mesh.face_normal(t);
            let middles = mesh.across[t].map(|other| own + mesh.face_normal(other as usize));
            for normal in middles.iter().chain([&own]).filter_map(|n| n.try_normalize(1e-6)) {
                for x in tree::corners(&mesh.positions, triangle) {
                    let back = x - *depth * normal;
                    (low, high) = (low.inf(&back), high.sup(&back));
                }
            }
        }
        (low, high)
    }

    pub fn bytes(&self) -> usize {
        self.mesh.bytes()
            + size_of::<Self>()
            + self.tree.as_ref().map_or(0, Tree::bytes)
            + self.corners.capacity() * size_of::<Vec3>()
            + self.walls.capacity() * size_of::<[u32; 3]>()
            + self.on_rim.capacity()
            + self.sides.capacity() * size_of::<(u32, u8)>()
            + self.hinges.capacity() * size_of::<(u32, u32, u8, bool)>()
    }
}

/// In lengths: that given, or the usual share of the mesh's longest side for 0.
pub(super) fn depth_of(depth: f64, longest: f64) -> Result<f64> {
    if depth == 0.0 {
        return Ok(DEPTH * longest);
    }
    if DEPTHS.contains(&(depth / longest)) {
        return Ok(depth);
    }
    let (least, most) = (DEPTHS.start(), DEPTHS.end());
    Err(Error::argument(format!(
        "the depth of the one-sided mesh is {depth:?}: it must be 0, or {least:e} to {most} times its longest side of {longest:e}"
    )))
}

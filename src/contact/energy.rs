//! The energy of contacts that are known: half-spaces and friction.
//!
//! Across the normal n the energy of the slip s = (I − nnᵀ)(p − a) from the anchor a is Huber's with the cap c = μλ:
//!
//!   ½ k s²  for  k|s| ≤ c,   c|s| − c²/2k  beyond.
//!
//! The anchor is where the probe stuck to the solid, and moves with it.

use super::caps::Caps;
use super::{HARDNESS_AT_START, MET, Obstacle, Probes, Round, WAY_OUT};
use crate::Vec3;
use crate::collider::Touch;
use crate::energy::Curvature;
use crate::point_energy::{Point, PointEnergy};
use nalgebra::Matrix3;

/// A way across the solid that ends on a side turned by more than this from where it enters went through (cosine).
const SAME_SIDE: f64 = 0.5;
/// Deeper than so many times what rounds should leave, an anchor stays where it was.
const SUNK: f64 = 10.0;
/// Of a solid's radius, the least way from an anchor to behind the solid.
const BEHIND: f64 = 0.5;
/// Of the cap, the friction of what slips; and its spring's length beside that where it would stick.
const SLIPS: f64 = 0.999;
const FAR: f64 = 1e6;
/// So much harder is what is taken in one round, for there is none that makes up for what gives way.
const FIRM: f64 = 30.0;

/// One contact. World space at the end of the step where nothing else is said.
#[derive(Clone, Copy, Debug)]
pub struct Touching {
    /// Which of the probes.
    pub probe: u32,
    /// Which of the solids.
    pub obstacle: u32,
    /// Of the solid, outward.
    pub normal: Vec3,
    /// n·p of the half-space's border.
    pub border: f64,
    /// λ, not negative.
    pub force: f64,
    /// The λ that the next round begins with.
    pub carried: f64,
    /// k.
    pub stiffness: f64,
    /// Of the probe, kg; k of steps that feel the start goes by it.
    pub mass: f64,
    /// a, in the solid's axes.
    pub anchor: Vec3,
    /// a, where it is as the step ends.
    pub held_at: Vec3,
    /// μ.
    pub friction: f64,
    /// c.
    pub cap: f64,
    /// As last seen, by distance and not by the half-space.
    pub gap: f64,
    /// How deep the probe may still be at the end of the step.
    pub allowed: f64,
    /// The step began behind the solid, seen from the anchor.
    pub caught: bool,
    /// The round ended behind it, seen from where the step began.
    pub passed: bool,
    /// On the shell in the last round, friction included.
    pub pull: Vec3,
}

impl Touching {
    /// Of a probe, without a force. `from` is where it was when the step began, in the solid's axes.
    pub fn new(probe: u32, obstacle: u32, mass: f64, from: Vec3) -> Self {
        let zero = Vec3::zeros();
        Self {
            probe,
            obstacle,
            normal: Vec3::z(),
            border: 0.0,
            force: 0.0,
            carried: 0.0,
            stiffness: 0.0,
            mass,
            anchor: from,
            held_at: zero,
            friction: 0.0,
            cap: 0.0,
            gap: 0.0,
            allowed: 0.0,
            caught: false,
            passed: false,
            pull: zero,
        }
    }

    /// Takes the half-space at a place in the solid's axes; returns the gap there.
    pub fn plane_of(&mut self, obstacle: &Obstacle, local: &Vec3) -> f64 {
        let touch = obstacle.touch(local);
        self.plane_at(obstacle, local, &touch);
        touch.distance
    }

    fn plane_at(&mut self, obstacle: &Obstacle, local: &Vec3, touch: &Touch) {
        self.normal = obstacle.direction(&touch.normal);
        self.border = self.normal.dot(&obstacle.place(local)) - touch.distance;
        self.gap = touch.distance;
    }

    /// Takes the half-space for the start of a step, with the probe at `a` in the solid's axes. One that few modes left behind the solid goes
    /// back to the side of its anchor.
    pub fn begin(&mut self, obstacle: &Obstacle, a: &Vec3, size: f64, round: Round) {
        let touch = obstacle.touch(a);
        let far = (a - self.anchor).norm() > least_behind(obstacle);
        let behind = if far && round.h.is_some() { crossing(obstacle, &self.anchor, a, &touch) } else { None };
        self.caught = behind.is_some();
        let gap = if let Some((place, first)) = behind {
            self.plane_at(obstacle, &place, &first);
            first.normal.dot(&(a - place))
        } else {
            self.plane_at(obstacle, a, &touch);
            touch.distance
        };
        self.give_way(gap, size, round);
    }

    /// Lets a probe that begins the step inside stay in for a while: else it would be shot out.
    pub fn give_way(&mut self, gap: f64, size: f64, round: Round) {
        self.allowed = round.h.map_or(0.0, |h| (-gap - WAY_OUT * size * h).max(0.0));
    }

    /// Takes the half-space for a way of the probe from the step's start to `to`; returns the gap that rounds are to close.
    pub fn plane(&mut self, obstacle: &Obstacle, (from, to): (&Vec3, &Vec3), size: f64, round: Round) -> f64 {
        let (now, b) = (obstacle.at_start(from), obstacle.at_end(to));
        let a = if self.caught { self.anchor } else { now };
        let (begin, end) = (obstacle.touch(&a), obstacle.touch(&b));
        (self.allowed, self.passed) = (0.0, false);
        if begin.distance < 0.0 {
            self.give_way(begin.distance, size, round);
        }
        if let Some((place, first)) = way_in(obstacle, (&a, &begin), (&b, &end), size) {
            self.plane_at(obstacle, &place, &first);
            let along = |x: &Vec3| first.normal.dot(&(x - place));
            if self.caught {
                self.give_way(along(&now), size, round);
            }
            self.gap = end.distance.min(along(&b));
            self.passed = !self.caught && self.gap < -self.allowed - MET * size;
            return self.wanting();
        }
        self.plane_at(obstacle, &b, &end);
        self.wanting()
    }

    /// The gap that rounds are to close.
    fn wanting(&self) -> f64 {
        if self.allowed > 0.0 { (self.gap + self.allowed).min(0.0) } else { self.gap }
    }

    /// What the next round needs: k, the cap, and where it sticks to.
    pub fn meet(&mut self, obstacle: &Obstacle, hardest: f64, round: Round) {
        self.stiffness = match round {
            Round { feels_start: true, h: Some(h) } => HARDNESS_AT_START * self.mass / (h * h),
            _ => hardest,
        };
        let pressing = self.stiffness * -self.gap.min(0.0);
        self.friction = if round.h.is_some() { obstacle.friction } else { 0.0 };
        if round.feels_start {
            (self.carried, self.allowed, self.cap) = (0.0, 0.0, self.friction * pressing);
        } else {
            (self.carried, self.cap) = (self.force, self.friction * self.force);
        }
        self.held_at = obstacle.place(&self.anchor);
    }

    /// λ + k d where the probe is at `p`.
    fn pressing(&self, p: &Vec3) -> f64 {
        self.carried + self.stiffness * (self.border - self.allowed - self.normal.dot(p))
    }

    fn slip(&self, p: &Vec3) -> Vec3 {
        let way = p - self.held_at;
        way - self.normal.dot(&way) * self.normal
    }

    /// Friction's energy.
    pub fn rub(&self, p: &Vec3, cap: f64) -> f64 {
        if cap == 0.0 {
            return 0.0;
        }
        let (k, slip) = (self.stiffness, self.slip(p).norm());
        if k * slip <= cap { 0.5 * k * slip * slip } else { cap * (slip - 0.5 * cap / k) }
    }

    /// Its second derivative.
    pub fn rub_hessian(&self, p: &Vec3, cap: f64) -> Matrix3<f64> {
        if cap == 0.0 {
            return Matrix3::zeros();
        }
        let across = Matrix3::identity() - self.normal * self.normal.transpose();
        let slip = self.slip(p);
        let length = slip.norm();
        if self.stiffness * length <= cap {
            return self.stiffness * across;
        }
        let along = slip / length;
        cap / length * (across - along * along.transpose())
    }

    /// The slope of friction's energy.
    pub fn rubbing(&self, p: &Vec3, cap: f64) -> Vec3 {
        if cap == 0.0 {
            return Vec3::zeros();
        }
        let slip = self.slip(p);
        let length = slip.norm();
        if self.stiffness * length <= cap { self.stiffness * slip } else { cap / length * slip }
    }

    /// λ of the round that ended with the probe at `p`, of which no more than `strongest` is carried on.
    pub fn settle(&mut self, p: &Vec3, strongest: f64) {
        let force = self.pressing(p).max(0.0);
        self.pull = force * self.normal - self.rubbing(p, self.cap);
        self.force = force.min(strongest);
    }

    /// Moves the anchor along where it slipped, to where friction is at its cap, and no deeper than the surface. That of a probe that is far
    /// inside stays outside, where it came from.
    pub fn stick(&mut self, obstacle: &Obstacle, p: &Vec3, size: f64) {
        if self.gap < -SUNK * MET * size {
            return;
        }
        let slip = self.slip(p);
        let (length, cap) = (slip.norm(), obstacle.friction * self.force);
        let share = if self.stiffness * length > cap { cap / (self.stiffness * length) } else { 1.0 };
        let lift = (MET * size - self.gap).max(0.0);
        self.anchor = obstacle.at_end(&(p - share * slip + lift * self.normal));
    }
}

/// The least way that can lead from one side of a solid to another.
fn least_behind(obstacle: &Obstacle) -> f64 {
    BEHIND * (obstacle.solid.inner_radius() + obstacle.thickness)
}

/// As [`crossing`], of a way that may begin inside: then from the surface next to there. Rounds leave half of what touches a little inside.
pub fn way_in(
    obstacle: &Obstacle,
    (a, begin): (&Vec3, &Touch),
    (b, end): (&Vec3, &Touch),
    size: f64,
) -> Option<(Vec3, Touch)> {
    if begin.distance >= 0.0 {
        return crossing(obstacle, a, b, end);
    }
    if (b - a).norm() <= least_behind(obstacle) {
        return None;
    }
    crossing(obstacle, &(a + (MET * size - begin.distance) * begin.normal), b, end)
}

/// Where a way enters the solid, if it then goes through or beyond the middle. `end` is the touch at `b`.
fn crossing(obstacle: &Obstacle, a: &Vec3, b: &Vec3, end: &Touch) -> Option<(Vec3, Touch)> {
    if end.distance > (b - a).norm() {
        return None;
    }
    let (place, first) = obstacle.first_touch(a, b)?;
    (first.normal.dot(&end.normal) < SAME_SIDE).then_some((place, first))
}

/// All contacts as one energy.
#[derive(Clone, Default)]
pub struct Pressed {
    /// By probe and obstacle, ascending.
    pub list: Vec<Touching>,
    /// Of each.
    points: Vec<Point>,
    /// The solids stand still, and nothing is on its way out of one.
    pub passive: bool,
    /// The last round closed all gaps: what it left is friction's.
    pub nearly_met: bool,
    /// [`PointEnergy::precision`].
    pub precision: f64,
    /// Friction's caps as a search takes them on its way; without any, those of the list count.
    learned: Caps,
}

impl Pressed {
    /// Makes room for so many.
    pub fn reserve(&mut self, n: usize) {
        self.list.reserve(n);
        self.points.reserve(n);
        self.learned.reserve(n);
    }

    /// Readies the caps for a search.
    pub fn teach(&mut self) {
        self.learned.take(self.list.iter().map(|touch| touch.cap));
    }

    /// Takes the caps that were learned.
    pub fn take_caps(&mut self) {
        self.list.iter_mut().zip(self.learned.all()).for_each(|(touch, cap)| touch.cap = cap);
        self.learned.clear();
    }

    fn cap(&self, i: usize) -> f64 {
        self.learned.get(i).unwrap_or(self.list[i].cap)
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.learned.clear();
        self.list.clear();
        self.points.clear();
    }

    /// Takes these instead.
    pub fn take(&mut self, list: &[Touching], probes: &Probes) {
        self.learned.clear();
        self.list.clear();
        self.list.extend_from_slice(list);
        self.name(probes);
    }

    /// Takes these as well: others than there are.
    pub fn add(&mut self, more: &[Touching], probes: &Probes) {
        if !more.is_empty() {
            self.learned.clear();
            self.list.extend_from_slice(more);
            self.list.sort_unstable_by_key(|touch| (touch.probe, touch.obstacle));
            self.name(probes);
        }
    }

    /// Forgets the others.
    pub fn keep(&mut self, kept: impl Fn(&Touching) -> bool) {
        self.learned.clear();
        let mut each = self.list.iter();
        self.points.retain(|_| each.next().is_some_and(&kept));
        self.list.retain(kept);
    }

    fn name(&mut self, probes: &Probes) {
        self.points.clear();
        self.points.extend(self.list.iter().map(|touch| probes.points[touch.probe as usize]));
    }

    /// Firm, and with friction as it acts at these positions: for a shell that goes on from there.
    pub fn as_pressed(&self, x: &[Vec3]) -> Self {
        let mut pressed = self.clone();
        pressed.learned.clear();
        for (touch, point) in pressed.list.iter_mut().zip(&self.points) {
            let p = point.place(|v| x[v]);
            touch.stiffness *= FIRM;
            // Friction acts on as it did: what sticks by its spring, and what slips by the same force, from far away.
            let pull = touch.pull - touch.normal.dot(&touch.pull) * touch.normal;
            let (length, slips) = (pull.norm(), pull.norm() >= SLIPS * touch.cap);
            (touch.cap, touch.held_at) = match length {
                0.0 => (0.0, p),
                _ if slips => (length, p + FAR / touch.stiffness * pull),
                _ => (f64::INFINITY, p + pull / touch.stiffness),
            };
        }
        pressed
    }
}

impl PointEnergy for Pressed {
    fn points(&self) -> &[Point] {
        &self.points
    }

    fn is_passive(&self) -> bool {
        self.passive
    }

    fn is_nearly_met(&self) -> bool {
        self.nearly_met
    }

    fn precision(&self) -> f64 {
        self.precision
    }

    /// Friction's cap goes by the force that there is. What had no force has no friction in its first round: which of two ways it then takes is
    /// not for a search on its way to say.
    fn learn(&self, i: usize, p: &Vec3) -> bool {
        let touch = &self.list[i];
        let Some(before) = self.learned.get(i).filter(|_| touch.cap > 0.0) else { return false };
        let now = touch.friction * touch.pressing(p).max(0.0);
        self.learned.set(i, now);
        now != before
    }

    fn is_sudden(&self) -> bool {
        true
    }

    fn value_at(&self, i: usize, p: &Vec3) -> f64 {
        let touch = &self.list[i];
        let pressing = touch.pressing(p).max(0.0);
        0.5 * pressing * pressing / touch.stiffness + touch.rub(p, self.cap(i))
    }

    fn gradient_at(&self, i: usize, p: &Vec3) -> Vec3 {
        let touch = &self.list[i];
        touch.rubbing(p, self.cap(i)) - touch.pressing(p).max(0.0) * touch.normal
    }

    fn hessian_at(&self, i: usize, p: &Vec3, _: Curvature) -> Matrix3<f64> {
        let touch = &self.list[i];
        let normal = touch.normal * touch.normal.transpose();
        let pressed = if touch.pressing(p) > 0.0 { touch.stiffness * normal } else { Matrix3::zeros() };
        pressed + touch.rub_hessian(p, self.cap(i))
    }
}

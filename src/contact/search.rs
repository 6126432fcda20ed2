//! What touches and is not known yet.

use super::energy::way_in;
use super::near::Pair;
use super::{Around, Contacts, MET, Obstacle, Reach, Round, Touching};
use crate::Vec3;
use std::sync::Arc;

impl Contacts {
    /// Sets the contacts that are found: of each patch the deepest probe in each solid, or all. Returns how deep the deepest is of the probes
    /// that are no contacts yet. Notes how deep any probe is.
    pub(super) fn find(&mut self, round: Round) -> f64 {
        self.found.clear();
        let (mut left, mut deepest) = (0.0f64, 0.0f64);
        let near = std::mem::take(&mut self.near);
        let mut note = |(short, deep): (f64, f64)| (left, deepest) = (left.max(short), deepest.max(deep));
        for o in 0..self.obstacles.len() {
            let around = self.obstacles[o].around();
            if near.holds() {
                let reach = near.reach(&self.obstacles[o]);
                for patch in near.of(o).chunk_by(|a: &Pair, b: &Pair| a.patch == b.patch) {
                    let within = patch.iter().filter(|pair| pair.distance <= reach);
                    note(self.find_in((o, around), within.map(|pair| pair.probe as usize), round));
                }
                continue;
            }
            for patch in 0..self.probes.patches() {
                let (start, end) = (&self.starts[patch], &self.ends[patch]);
                if around.is_some_and(|around| around.is_far(&end.center, end.from))
                    || self.is_far(&self.obstacles[o], start, end)
                {
                    continue;
                }
                note(self.find_in((o, around), self.probes.patch(patch), round));
            }
        }
        self.near = near;
        self.summary.deepest = deepest;
        left
    }

    /// No way from ball to ball comes near the solid.
    fn is_far(&self, obstacle: &Obstacle, start: &Reach, end: &Reach) -> bool {
        let (a, b) = (obstacle.at_start(&start.center), obstacle.at_end(&end.center));
        let reach = (b - a).norm() + start.radius.max(end.radius) + obstacle.solid.surface_error();
        obstacle.touch_within(&b, reach).is_none()
    }

    /// As [`Contacts::find`], of probes of one patch and a solid.
    fn find_in(
        &mut self,
        (o, around): (usize, Option<Around>),
        looked_at: impl Iterator<Item = usize>,
        round: Round,
    ) -> (f64, f64) {
        let Self { obstacles, probes, pressed, start, end, found, all, summary, way, .. } = self;
        let (obstacle, way) = (&obstacles[o], *way);
        let (mut left, mut deepest) = (0.0f64, 0.0f64);
        let mut worst: Option<(f64, Touching)> = None;
        for p in looked_at {
            let point = &probes.points[p];
            let to = point.place(|v| end[v]);
            if around.is_some_and(|around| around.is_far(&to, way)) {
                continue;
            }
            let from = point.place(|v| start[v]);
            let b = obstacle.at_end(&to);
            let touch = if let Some(around) = around {
                let way = (to - from).norm();
                if around.is_far(&to, way) {
                    continue;
                }
                match obstacle.touch_within(&b, way + around.led) {
                    Some(touch) if touch.distance < way + around.led => touch,
                    _ => continue,
                }
            } else {
                obstacle.touch(&b)
            };
            deepest = deepest.max(-touch.distance);
            let a = obstacle.at_start(&from);
            let through = touch.distance < (b - a).norm();
            let passed = || way_in(obstacle, (&a, &obstacle.touch(&a)), (&b, &touch), probes.size).is_some();
            if touch.distance >= 0.0 && !(through && passed()) {
                continue;
            }
            let key = (p as u32, o as u32);
            if pressed.list.binary_search_by_key(&key, |touch| (touch.probe, touch.obstacle)).is_ok() {
                continue;
            }
            let mut new = Touching::new(key.0, key.1, probes.mass[p], a);
            let gap = new.plane(obstacle, (&from, &to), probes.size, round);
            left = left.max(-gap);
            summary.passed += usize::from(new.passed);
            if *all {
                found.push(new);
            } else if worst.as_ref().is_none_or(|(worst, _)| gap < *worst) {
                worst = Some((gap, new));
            }
        }
        if let Some((_, new)) = worst.filter(|(gap, _)| *gap < -0.1 * MET * probes.size)
            && pressed.list.len() + found.len() < super::CAPACITY
        {
            found.push(new);
        }
        (left, deepest)
    }

    /// Takes the nearest probe of every patch as a candidate to each solid: where a shell comes to rest that touches nothing yet.
    pub fn expect(&mut self, round: Round) {
        self.found.clear();
        let (mut found, limit) = (std::mem::take(&mut self.found), self.capacity());
        for (o, obstacle) in self.obstacles.iter().enumerate() {
            for patch in 0..self.probes.patches() {
                let place = |p: usize| self.probes.points[p].place(|v| self.end[v]);
                let gap = |p: &usize| obstacle.touch(&obstacle.at_end(&place(*p))).distance;
                let nearest = self.probes.patch(patch).min_by(|a, b| gap(a).total_cmp(&gap(b)));
                let Some(p) = nearest.filter(|_| found.len() + self.touching().len() < limit) else { continue };
                let key = (p as u32, o as u32);
                if self.touching().iter().all(|touch| (touch.probe, touch.obstacle) != key) {
                    let local: Vec3 = obstacle.at_end(&place(p));
                    let mut new = Touching::new(key.0, key.1, self.probes.mass[p], local);
                    new.plane_of(obstacle, &local);
                    found.push(new);
                }
            }
        }
        Arc::make_mut(&mut self.pressed).add(&found, &self.probes);
        self.found = found;
        self.meet(round);
    }
}

//! A shell among solids: one run by one method, and what was seen of it from outside the library.

use super::cases::common;
use super::trial::{Cell, End, Judge, Problem, Told, judged};
use crate::library::{Library, Solid, State};
use crate::mesh::P3;
use crate::methods::{Family, Method};
use crate::table::percent;
use anyhow::Result;
use std::cell::RefCell;

/// Of the shell's size: what may be inside a solid.
pub(super) const DEEPEST: f64 = 1e-3;

/// A solid on its way.
pub(super) struct Collider<'a> {
    pub(super) solid: Solid,
    pub(super) friction: f64,
    /// A plane that is above.
    pub(super) over: bool,
    /// Its origin after so many steps.
    pub(super) place: Box<dyn Fn(usize) -> P3 + 'a>,
}

impl<'a> Collider<'a> {
    pub(super) fn still(solid: Solid, origin: P3) -> Self {
        Self { solid, friction: 0.0, over: false, place: Box::new(move |_| origin) }
    }

    pub(super) fn led(solid: Solid, place: impl Fn(usize) -> P3 + 'a) -> Self {
        Self { solid, friction: 0.0, over: false, place: Box::new(place) }
    }

    /// Signed distance of a point from the surface, by closed form.
    fn distance(&self, x: P3, origin: P3) -> f64 {
        let [x, y, z]: P3 = std::array::from_fn(|c| x[c] - origin[c]);
        match self.solid {
            Solid::Plane if self.over => -z,
            Solid::Plane => z,
            Solid::Ball(radius) => (x * x + y * y + z * z).sqrt() - radius,
            Solid::Rod(radius, half) => x.hypot(z).hypot((y.abs() - half).max(0.0)) - radius,
            Solid::Box(half) => {
                let out = [x.abs() - half[0], y.abs() - half[1], z.abs() - half[2]];
                let beyond = out.map(|d| d.max(0.0).powi(2)).iter().sum::<f64>().sqrt();
                beyond + out[0].max(out[1]).max(out[2]).min(0.0)
            }
        }
    }
}

/// What a run did at the ends of its steps, seen from outside the library.
#[derive(Default)]
pub(super) struct Seen {
    /// How far a vertex that nothing holds was inside a solid.
    pub(super) deepest: f64,
    /// As the library told it.
    told: f64,
    /// Where the vertices are.
    pub(super) before: Vec<P3>,
    /// How often a vertex crossed a ball between two steps, within half its radius of the middle.
    through: usize,
    /// After each step: the vertices' mean, and what pushed the shell in it.
    pub(super) middle: Vec<P3>,
    pub(super) impulse: Vec<P3>,
    /// Steps that ended with a contact.
    touching: usize,
}

/// A problem among colliders.
pub(super) struct Scene<'a> {
    pub(super) case: String,
    pub(super) problem: Problem,
    pub(super) colliders: Vec<Collider<'a>>,
    /// Whether a vertex is looked at.
    pub(super) looked_at: Box<dyn Fn(&P3) -> bool + 'a>,
    /// Only the end counts, not the way there.
    pub(super) at_end: bool,
    /// Why it can be inside, where the methods' limits are not the reason.
    pub(super) why: Option<&'static str>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(case: impl Into<String>, problem: Problem, colliders: Vec<Collider<'a>>) -> Self {
        Self { case: case.into(), problem, colliders, looked_at: Box::new(|_| true), at_end: false, why: None }
    }

    /// After a step.
    fn look(&self, seen: &mut Seen, steps: usize, x: Vec<P3>, told: &Told) {
        let rest = &self.problem.mesh.positions;
        let free = |v: &usize| !self.problem.fixed.contains(&(*v as u32)) && (self.looked_at)(&rest[*v]);
        if self.at_end {
            (seen.deepest, seen.told) = (0.0, 0.0);
        }
        seen.told = seen.told.max(told.penetration);
        seen.touching += usize::from(told.contacts > 0);
        seen.impulse.push(told.impulse);
        for collider in &self.colliders {
            let origin = (collider.place)(steps);
            for v in (0..x.len()).filter(free) {
                seen.deepest = seen.deepest.max(-collider.distance(x[v], origin));
                if let (Solid::Ball(radius), Some(before)) = (collider.solid, seen.before.get(v)) {
                    let was = (collider.place)(steps - 1);
                    let [a, b] = [(before, was), (&x[v], origin)].map(|(x, o)| std::array::from_fn(|c| x[c] - o[c]));
                    seen.through += usize::from(crosses(a, b, 0.5 * radius));
                }
            }
        }
        let mean = |c: usize| x.iter().map(|x| x[c]).sum::<f64>() / x.len() as f64;
        seen.middle.push(std::array::from_fn(mean));
        seen.before = x;
    }

    /// Runs it by a method and asks `error` of what was seen.
    pub(super) fn judged(
        &self,
        library: &Library,
        m: &'static Method,
        (name, tolerance): (&'static str, f64),
        error: &dyn Fn(&Seen, &End) -> f64,
    ) -> Cell {
        let seen = RefCell::new(Seen { before: self.problem.mesh.positions.clone(), ..Seen::default() });
        let place = |steps: usize, state: &mut State| {
            self.colliders.iter().enumerate().try_for_each(|(i, collider)| {
                state.move_collider(i as u32, collider.solid, collider.over, (collider.place)(steps))
            })
        };
        let drive = |k: usize, state: &mut State| -> Result<()> {
            if k == 0 {
                let solids: Vec<(Solid, f64)> = self.colliders.iter().map(|c| (c.solid, c.friction)).collect();
                state.set_colliders(&solids)?;
                place(0, state)?;
            } else {
                self.look(&mut seen.borrow_mut(), k, state.positions()?, &Told::of(&state.report()?));
            }
            place(k + 1, state)
        };
        let asked = |end: &End| {
            let mut seen = seen.borrow_mut();
            self.look(&mut seen, self.problem.steps.len(), end.positions.clone(), &end.contact);

            Ok(error(&seen, end))
        };
        let reason = |m: &Method, _: &End| self.reason(m, &seen.borrow());
        let judge = Judge { name, tolerance, error: &asked, reason: &reason, bound: 1e4 * self.problem.size() };
        judged(library, ("contact", self.case.clone()), m, &self.problem, &drive, &judge)
    }

    fn reason(&self, m: &Method, seen: &Seen) -> String {
        if let Some(why) = self.why {
            return why.to_owned();
        }
        let through = if seen.through > 0 {
            format!(
                "{} times a vertex was before the ball at one step and straight behind it at the next; ",
                seen.through
            )
        } else {
            String::new()
        };
        let what = match m.family {
            Family::Shell => "what the rounds of a step leave",
            Family::Reduced => "what its modes and fields cannot follow",
            _ => "what its modes cannot follow",
        };
        let told = percent(seen.told / self.problem.size());
        format!("{through}{what}; the report tells {told} of its size")
    }

    /// By all methods: nothing is inside, and nothing went through.
    pub(super) fn stays_out(&self, library: &Library) -> Vec<Cell> {
        let size = self.problem.size();
        let error = |seen: &Seen, _: &End| {
            let balls = self.colliders.iter().filter_map(|c| if let Solid::Ball(r) = c.solid { Some(r) } else { None });
            let crossed = if seen.through > 0 { balls.fold(0.0, f64::max) } else { 0.0 };
            // A run without contact shows nothing.
            if seen.touching == 0 { f64::INFINITY } else { seen.deepest.max(crossed) / size }
        };
        common().map(|m| self.judged(library, m, ("no vertex inside, of the size", DEEPEST), &error)).collect()
    }
}

/// Whether the way from a to b passes the origin within so much.
fn crosses(a: P3, b: P3, within: f64) -> bool {
    let along: P3 = std::array::from_fn(|c| b[c] - a[c]);
    let length: f64 = along.iter().map(|d| d * d).sum();
    let t = -(0..3).map(|c| a[c] * along[c]).sum::<f64>() / length.max(f64::MIN_POSITIVE);
    let near = (0..3).map(|c| (a[c] + t * along[c]).powi(2)).sum::<f64>().sqrt();
    t > 0.0 && t < 1.0 && near < within
}

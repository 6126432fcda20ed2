//! Which probes may touch which solids until the shell or a solid has moved by a skin (Verlet's lists, 1967).
//!
//! Rounds then look at these alone, and only their vertices are placed. All others stay out of the solids, so that a step comes to the same
//! bits.

use super::{Obstacle, Probes, Reach};

/// The skin, in ways of the round that the lists are made in.
const WAYS: f64 = 8.5;
/// Doublings of it, at most. It is doubled where lists of few probes did not last for so many steps.
const DOUBLINGS: u32 = 6;
const LASTING: u32 = 16;
/// Lists of more than this part of the vertices are not widened, but made anew where steps that are so much shorter have come for as long.
const FEW: f64 = 0.1;
const SHORTER: f64 = 0.5;
/// Of the shell's size, the least skin, and what rounding may add to a way.
const THINNEST: f64 = 2e-3;
pub const ROUNDING: f64 = 1e-6;
/// Solids that a probe has room to be near, on average.
const SOLIDS: usize = 2;
/// Where more than this part of the vertices is to be placed, all are.
const MOST: f64 = 0.4;
/// Steps after lists that did not pay, in which none are made.
const PAUSE: u32 = 16;

/// A probe of a patch.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    pub patch: u32,
    pub probe: u32,
    /// How far it was from the solid where the lists were made.
    pub distance: f64,
}

/// How far from a solid what may have come nearer by `way` can be from its surface.
fn reach(obstacle: &Obstacle, way: f64) -> f64 {
    obstacle.solid.slope() * (obstacle.solid.surface_error() + way)
}

/// See the module's text.
#[derive(Clone, Default)]
pub struct Near {
    /// Probes by solid, ascending, and where those of each solid begin.
    pairs: Vec<Pair>,
    first: Vec<usize>,
    /// Vertices of these and of what touches, ascending.
    vertices: Vec<u32>,
    marks: Vec<bool>,
    /// Unknowns where the lists were made.
    at: Vec<f64>,
    skin: f64,
    thinnest: f64,
    /// How far any solid may have come since: up to this step, and in it.
    moved: f64,
    way: f64,
    /// How much nearer shell and solids may have come by the end of this round.
    came: f64,
    /// The longest way of a step of late.
    longest: f64,
    /// Steps since, and how often the skin is to be doubled.
    age: u32,
    doublings: u32,
    valid: bool,
    pause: u32,
}

impl Near {
    /// Makes room for a shell of so many vertices that moves as `unknowns`, so that steps do not allocate.
    pub fn reserve(&mut self, probes: &Probes, vertices: usize, obstacles: usize, unknowns: &[f64]) {
        let pairs = probes.points.len() * obstacles.min(SOLIDS);
        self.pairs.reserve(pairs.saturating_sub(self.pairs.len()));
        self.first.reserve((obstacles + 1).saturating_sub(self.first.len()));
        self.vertices.reserve(vertices.saturating_sub(self.vertices.len()));
        self.marks.reserve(vertices.saturating_sub(self.marks.len()));
        self.at.reserve(unknowns.len().saturating_sub(self.at.len()));
    }

    /// The lists are of another place.
    pub fn forget(&mut self) {
        self.valid = false;
    }

    /// They hold.
    pub fn holds(&self) -> bool {
        self.valid
    }

    /// The unknowns where they were made.
    pub fn at(&self) -> &[f64] {
        &self.at
    }

    /// Whether they hold in a round. It ends with vertices no farther than `change` from where the lists were made. It moves vertices by no
    /// more than `way`, and solids by no more than `led`.
    pub fn keeps(&mut self, change: f64, (way, led): (f64, f64), size: f64) -> bool {
        if self.valid {
            self.way = led;
            self.longest = self.longest.max(way + led);
            self.came = self.moved + led + change + ROUNDING * size;
            self.valid = self.came <= self.skin; // NaN does not
            if !self.valid {
                self.wear_out();
            }
        }
        self.valid
    }

    /// Learns from how long the lists held.
    fn wear_out(&mut self) {
        match self.age {
            0 => self.pause = PAUSE,
            age if age < LASTING && self.is_short() => self.doublings = (self.doublings + 1).min(DOUBLINGS),
            _ => {}
        }
    }

    fn widened(&self) -> f64 {
        f64::from(1 << self.doublings)
    }

    fn is_short(&self) -> bool {
        self.pairs.len() as f64 <= FEW * self.marks.len() as f64
    }

    /// The step has ended.
    pub fn accept(&mut self) {
        self.moved += self.way;
        self.age = self.age.saturating_add(1);
        if self.age.is_multiple_of(LASTING) {
            let needed = self.widened() * WAYS * self.longest;
            self.valid &= self.is_short() || needed.max(self.thinnest) > SHORTER * self.skin;
            self.longest = 0.0;
        }
        self.pause = self.pause.saturating_sub(1);
    }

    /// Whether lists are worth a try.
    pub fn may_pay(&self) -> bool {
        self.pause == 0
    }

    /// Probes near a solid, by patches.
    pub fn of(&self, obstacle: usize) -> &[Pair] {
        &self.pairs[self.first[obstacle]..self.first[obstacle + 1]]
    }

    /// A probe that is no farther than this where the lists were made may touch the solid in this round.
    pub fn reach(&self, obstacle: &Obstacle) -> f64 {
        reach(obstacle, self.came)
    }

    /// The vertices that rounds are to place, ascending; none where these are nearly all.
    pub fn vertices(&self) -> Option<&[u32]> {
        (self.vertices.len() as f64 <= MOST * self.marks.len() as f64).then_some(&self.vertices)
    }

    /// Makes the lists from where the step began, with these unknowns, for a round that moved vertices and solids by no more than `way`;
    /// `touching` are probes. There are none where they have no room.
    pub fn survey(
        &mut self,
        (probes, starts, start): (&Probes, &[Reach], &[crate::Vec3]),
        obstacles: &[Obstacle],
        touching: impl Iterator<Item = u32>,
        (unknowns, way): (&[f64], f64),
    ) {
        (self.valid, self.pause) = (false, PAUSE);
        self.thinnest = THINNEST * probes.size;
        let skin = self.widened() * (WAYS * way.max(self.longest)).max(self.thinnest);
        self.longest = 0.0;
        if !skin.is_finite() {
            return;
        }
        let room = self.pairs.capacity();
        self.pairs.clear();
        self.first.clear();
        self.first.push(0);
        for obstacle in obstacles {
            let reach = reach(obstacle, skin);
            let begin = obstacle.begins();
            for (patch, ball) in starts.iter().enumerate() {
                let around = reach + obstacle.solid.slope() * ball.radius;
                if begin.is_some_and(|begin| begin.is_far(&ball.center, around))
                    || obstacle.touch_within(&obstacle.at_start(&ball.center), around).is_none()
                {
                    continue;
                }
                for probe in probes.patch(patch) {
                    let place = probes.points[probe].place(|v| start[v]);
                    if begin.is_some_and(|begin| begin.is_far(&place, reach)) {
                        continue;
                    }
                    let Some(touch) = obstacle.touch_within(&obstacle.at_start(&place), reach) else { continue };
                    if self.pairs.len() == room {
                        self.doublings = 0;
                        return;
                    }
                    self.pairs.push(Pair { patch: patch as u32, probe: probe as u32, distance: touch.distance });
                }
            }
            self.first.push(self.pairs.len());
        }
        self.list_vertices(probes, start.len(), touching);
        self.at.clear();
        self.at.extend_from_slice(unknowns);
        (self.skin, self.moved, self.way, self.age) = (skin, 0.0, 0.0, 0);
        (self.valid, self.pause) = (true, 0);
        if !self.is_short() {
            self.doublings = self.doublings.saturating_sub(1);
        }
    }

    fn list_vertices(&mut self, probes: &Probes, n: usize, touching: impl Iterator<Item = u32>) {
        let Self { pairs, vertices, marks, .. } = self;
        marks.clear();
        marks.resize(n, false);
        for probe in pairs.iter().map(|pair| pair.probe).chain(touching) {
            probes.points[probe as usize].vertices().iter().for_each(|v| marks[*v as usize] = true);
        }
        vertices.clear();
        vertices.extend((0..n as u32).filter(|v| marks[*v as usize]));
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Pair>() * self.pairs.capacity()
            + 4 * self.vertices.capacity()
            + self.marks.capacity()
            + 8 * (self.first.capacity() + self.at.capacity())
    }
}

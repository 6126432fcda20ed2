//! Which patches may touch which solids until the shell has moved by a skin (Verlet's lists, 1967).
//!
//! Rounds then look at these alone, and only their vertices are placed. All others stay out of the solids, so that a step comes to the same
//! bits.

use super::{Obstacle, Probes, Reach};

/// The skin, in ways of the round that the lists are made in: they then last for seven such steps.
const WAYS: f64 = 8.5;
/// Of the shell's size, the least skin, and what rounding may add to a way.
const THINNEST: f64 = 2e-3;
const ROUNDING: f64 = 1e-6;
/// A grid's distance changes by up to 1.4 times the way.
const SLOPE: f64 = 1.5;
/// Solids that a patch has room to be near, on average.
const SOLIDS: usize = 8;
/// Where more than this part of the vertices is to be placed, all are.
const MOST: f64 = 0.4;
/// Steps after lists that did not pay, in which none are made.
const PAUSE: u32 = 16;
/// Vertices of a shell that is looked at as fast without lists.
const FEW: usize = 2000;

/// See the module's text.
#[derive(Clone, Default)]
pub struct Near {
    /// Patches by solid, ascending, and where those of each solid begin.
    pairs: Vec<u32>,
    first: Vec<usize>,
    /// All of them, and the patches of what touches.
    patches: Vec<u32>,
    /// Their vertices, ascending.
    vertices: Vec<u32>,
    marks: Vec<bool>,
    skin: f64,
    /// How far any vertex may have come since, relative to any solid: up to this step, and in its last round.
    moved: f64,
    way: f64,
    valid: bool,
    pause: u32,
}

impl Near {
    /// Makes room for a shell of so many vertices, so that steps do not allocate.
    pub fn reserve(&mut self, probes: &Probes, vertices: usize, obstacles: usize) {
        let patches = probes.patches();
        self.pairs.reserve((patches * obstacles.min(SOLIDS)).saturating_sub(self.pairs.len()));
        self.first.reserve((obstacles + 1).saturating_sub(self.first.len()));
        self.patches.reserve(patches.saturating_sub(self.patches.len()));
        self.vertices.reserve(vertices.saturating_sub(self.vertices.len()));
        self.marks.reserve(vertices.max(patches).saturating_sub(self.marks.len()));
    }

    /// The lists are of another place.
    pub fn forget(&mut self) {
        self.valid = false;
    }

    /// They hold.
    pub fn holds(&self) -> bool {
        self.valid
    }

    /// Whether they hold in a round that moved vertices by no more than this from where the step began.
    pub fn keeps(&mut self, way: f64, size: f64) -> bool {
        self.way = way + ROUNDING * size;
        self.valid &= self.moved + 2.0 * self.way <= self.skin;
        self.valid
    }

    /// The step has ended.
    pub fn accept(&mut self) {
        self.moved += self.way;
        self.pause = self.pause.saturating_sub(1);
    }

    /// Whether lists are worth a try.
    pub fn may_pay(&self) -> bool {
        self.pause == 0
    }

    /// Patches that may touch a solid.
    pub fn of(&self, obstacle: usize) -> std::ops::Range<usize> {
        self.first[obstacle]..self.first[obstacle + 1]
    }

    /// The patch at a place of [`Near::of`].
    pub fn patch(&self, at: usize) -> usize {
        self.pairs[at] as usize
    }

    /// All that may touch, ascending.
    pub fn patches(&self) -> &[u32] {
        &self.patches
    }

    /// Their vertices, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Makes the lists from where the step began, for a round that moved vertices by no more than `way`; `touching` are probes. There are none
    /// where they would not last or hold most of the shell.
    pub fn survey(
        &mut self,
        (probes, starts, vertices): (&Probes, &[Reach], usize),
        obstacles: &[Obstacle],
        touching: impl Iterator<Item = u32>,
        way: f64,
    ) {
        (self.valid, self.pause) = (false, PAUSE);
        if vertices < FEW {
            return;
        }
        let skin = (WAYS * way).max(THINNEST * probes.size);
        let room = self.pairs.capacity();
        self.pairs.clear();
        self.first.clear();
        self.first.push(0);
        for obstacle in obstacles {
            for (patch, reach) in starts.iter().enumerate() {
                let distance = obstacle.touch(&obstacle.at_start(&reach.center)).distance;
                if distance <= SLOPE * (reach.radius + obstacle.solid.surface_error() + skin) {
                    if self.pairs.len() == room {
                        return;
                    }
                    self.pairs.push(patch as u32);
                }
            }
            self.first.push(self.pairs.len());
        }
        self.list_patches(probes, touching);
        self.list_vertices(probes, vertices);
        (self.skin, self.moved, self.way) = (skin, 0.0, way);
        self.valid = (self.vertices.len() as f64) <= MOST * vertices as f64;
        self.pause = if self.valid { 0 } else { PAUSE };
    }

    fn list_patches(&mut self, probes: &Probes, touching: impl Iterator<Item = u32>) {
        let Self { pairs, patches, marks, .. } = self;
        marks.clear();
        marks.resize(probes.patches(), false);
        pairs.iter().for_each(|patch| marks[*patch as usize] = true);
        touching.for_each(|probe| marks[probes.patch_of(probe as usize)] = true);
        patches.clear();
        patches.extend((0..marks.len() as u32).filter(|patch| marks[*patch as usize]));
    }

    fn list_vertices(&mut self, probes: &Probes, n: usize) {
        let Self { patches, vertices, marks, .. } = self;
        marks.clear();
        marks.resize(n, false);
        let points = patches.iter().flat_map(|patch| &probes.points[probes.patch(*patch as usize)]);
        points.flat_map(|point| point.vertices()).for_each(|v| marks[*v as usize] = true);
        vertices.clear();
        vertices.extend((0..n as u32).filter(|v| marks[*v as usize]));
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        let numbers = self.pairs.capacity() + self.patches.capacity() + self.vertices.capacity();
        4 * numbers + self.marks.capacity() + self.first.capacity() * size_of::<usize>()
    }
}

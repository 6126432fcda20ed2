//! How a training keeps within the seconds that it may take: what equilibria may take of them, and how thorough the rest is.
//!
//! What comes before the equilibria is timed, and what comes after them is estimated: by its operations, at the pace of what was timed. So the
//! estimate knows the machine, its load, and about how many threads there are. Where the rest would leave the equilibria too little, the training is
//! a look: of all that is chosen by examples it has a quarter or less.

use super::TOLERANCE;
use super::basis::RestSolver;
use crate::Shell;
use crate::clock::Instant;

/// How much is looked at where examples decide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Loads whose shapes samples are chosen for, the first of the list.
    pub sampled: usize,
    /// Elements that these shapes are found with, at most.
    pub pose_elements: usize,
    /// Equilibria that α is chosen by, and elements that either energy has there, at most. On a quarter of a sheet's elements the worse α seems to be better.
    pub tried: usize,
    pub tried_elements: usize,
    /// Entries of the system that samples are chosen by, at most: of the elements of a large mesh, an even choice is looked at. All of them have an
    /// exact solution, the weights 1; two thirds of the hat's 8,920 leave 15 % at least.
    pub entries: usize,
    /// Pairs times shapes that the polynomial is fitted to, at most, beyond the shapes that are given.
    pub gains: usize,
    /// Of the elements that samples are chosen among alone forces are computed, and the sum over all is that of the whole; else it is a sum of each's.
    pub by_totals: bool,
    /// Random vectors that the rest stiffness is tried on.
    pub probes: usize,
    /// The most samples where their number is not given, as a multiple of the fields; and what they may leave out of the forces that they are chosen by.
    pub most: usize,
    pub tolerance: f64,
}

/// Of a training that may take as long as it takes.
pub const FULL: Effort = Effort {
    sampled: 26,
    pose_elements: 6000,
    tried: 8,
    tried_elements: 24_000,
    entries: 80_000_000,
    gains: 10_000_000,
    by_totals: false,
    probes: 12,
    most: 16,
    tolerance: TOLERANCE,
};
/// Of a look: samples are chosen for gravity along the axes and pressure.
pub const LOOK: Effort = Effort {
    sampled: 8,
    pose_elements: 1500,
    tried: 5,
    tried_elements: 6_000,
    entries: 10_000_000,
    gains: 600_000,
    by_totals: true,
    probes: 6,
    most: 10,
    tolerance: 3.0 * TOLERANCE,
};

/// Of the seconds that are asked for, what is aimed at: on slow cores that others use, too, the end was up to an eighth late.
const AIM: f64 = 0.85;
/// Equilibria are sought where they may take at least this multiple of what came before them: none of a large mesh is found sooner.
const LEAST: f64 = 1.0;
/// Of what is left after the derivatives, what the rest may take before the training is a look.
const MOST: f64 = 0.5;
/// Equilibria end up to an iteration late: how much more than what is left the rest may take before it is that of a look after all.
const LATE: f64 = 1.2;

/// What threads share less well than what is timed, and what many equilibria add: the estimate by this factor. By a V-beam, a hat, a saddle, leaves and the
/// dinosaur on two cores.
const SHARED_LESS: f64 = 1.6;

/// The seconds of a training, from when it begins.
pub struct Budget {
    started: Instant,
    seconds: f64,
}

impl Budget {
    /// Begins now.
    pub fn new(seconds: f64) -> Self {
        Self { started: Instant::now(), seconds: AIM * seconds }
    }

    /// Seconds so far.
    pub fn spent(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Seconds from now that equilibria may take, where what was done so far is what comes before them.
    pub fn for_equilibria(&self, size: &Size) -> f64 {
        let spent = self.spent();
        equilibria_end(self.seconds, spent, size.rest(spent)) - spent
    }

    /// How thorough the rest is, where `before` were the seconds before the equilibria.
    pub fn effort(&self, size: &Size, before: f64) -> Effort {
        effort(self.seconds - self.spent(), size.rest(before)[0])
    }
}

/// When the search for equilibria is to end, in seconds from the start of a training that may take `seconds` and has taken `spent`; `rest` is what
/// follows them, in full and of a look.
fn equilibria_end(seconds: f64, spent: f64, [full, look]: [f64; 2]) -> f64 {
    let rest = if full <= MOST * (seconds - spent) { full } else { look };
    let end = seconds - rest;
    if end - spent < LEAST * spent { spent } else { end }
}

/// What is done of the rest with so many seconds left, where all of it takes `full`.
fn effort(left: f64, full: f64) -> Effort {
    if full <= LATE * left { FULL } else { LOOK }
}

/// What decides how long the parts of a training take.
#[derive(Clone, Copy)]
pub struct Size {
    elements: f64,
    vertices: f64,
    modes: f64,
    /// Beside the modes, too.
    fields: f64,
    /// Entries of a factor of the stiffness, and multiplications to make it.
    entries: f64,
    multiplications: f64,
}

impl Size {
    /// Of a shell with so many modes, and fields beside them.
    pub fn new(shell: &Shell, rest: &RestSolver, modes: usize, fields: usize) -> Self {
        let [multiplications, entries] = rest.operations();
        Self {
            elements: shell.energy.n_elements() as f64,
            vertices: shell.mass.len() as f64,
            modes: modes as f64,
            fields: (modes + fields) as f64,
            entries,
            multiplications,
        }
    }

    /// Seconds of what follows the equilibria, in full and of a look, where what comes before them took so many.
    fn rest(&self, before: f64) -> [f64; 2] {
        [FULL, LOOK].map(|effort| SHARED_LESS * before * self.after(&effort) / self.before().max(1.0))
    }

    /// Nanoseconds by one thread of what comes before equilibria: the factor of the rest stiffness, solutions with it, and differences of Hessians.
    fn before(&self) -> f64 {
        let Self { elements, modes, entries, multiplications, .. } = *self;
        let columns = 0.5 * modes * (modes + 1.0) + 21.0; // as many as derivatives, loads of frames and pulls
        elements * (2.0 * modes + 1.0) * (300.0 + 20.0 * modes) + 0.06 * multiplications + 0.2 * columns * entries
    }

    /// Nanoseconds by one thread of what comes after them, about; fitted to leaves of 472 to 6,925 vertices and the dinosaur.
    fn after(&self, effort: &Effort) -> f64 {
        let Self { elements, vertices, modes, fields, .. } = *self;
        let (sampled, probes, squared) = (effort.sampled as f64, effort.probes as f64 + 3.0 + modes, fields * fields);
        let rows = 1.6 * fields * (sampled + probes);
        let entries = (elements * rows).min(effort.entries as f64);
        let shapes = 2.0 * modes + (effort.gains as f64 / (3.0 * vertices)).min(200.0);
        let basis = elements * (squared + 40.0 * modes * modes);
        let shapes_of = |count: f64, most: usize| count * elements.min(most as f64);
        let searches = squared
            * (1.7 * shapes_of(sampled, effort.pose_elements)
                + 1.2 * shapes_of(effort.tried as f64, effort.tried_elements)
                + 0.5 * elements);
        let of_each = |count: f64| count * (400.0 * sampled + 320.0 * probes);
        let of_whole = 150.0 * elements * sampled;
        let system =
            if effort.by_totals { of_whole + of_each(entries / rows) } else { of_each(elements) } + 8.0 * entries;
        let choice = 20.0 * entries + 10.0 * rows * squared;
        let polynomial = vertices * (62.0 * squared + 340.0 * shapes);
        basis + searches + system + choice + polynomial
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equilibria_have_what_the_rest_leaves_of_the_seconds() {
        assert_eq!(equilibria_end(10.0, 1.0, [4.0, 2.0]), 6.0); // all of the rest takes less than half of nine
        assert_eq!(equilibria_end(10.0, 1.0, [5.0, 2.0]), 8.0); // so a look it is
        assert_eq!(equilibria_end(4.0, 1.0, [8.0, 2.0]), 2.0);
        assert_eq!(equilibria_end(3.9, 1.0, [8.0, 2.0]), 1.0); // none is found within what is left
        assert_eq!(equilibria_end(3.0, 5.0, [8.0, 2.0]), 5.0);
        assert_eq!(equilibria_end(f64::INFINITY, 1.0, [4.0, 2.0]), f64::INFINITY);
    }

    #[test]
    fn all_is_done_where_there_is_time_for_it() {
        assert_eq!(effort(f64::INFINITY, 1e9), FULL);
        assert_eq!(effort(3.9, 4.0), FULL); // an iteration late
        assert_eq!(effort(2.0, 4.0), LOOK);
        assert_eq!(effort(-1.0, 4.0), LOOK);
        // Equilibria that ended when they should leave the time that the rest is to have.
        for (seconds, spent, rest) in [(10.0, 1.0, [4.0, 2.0]), (10.0, 1.0, [5.0, 2.0]), (100.0, 3.0, [8.0, 2.0])] {
            let left = seconds - equilibria_end(seconds, spent, rest);
            let taken = if effort(left, rest[0]) == FULL { rest[0] } else { rest[1] };
            assert!((left - taken).abs() < 1e-9, "{seconds} {spent} {rest:?}");
        }
    }

    #[test]
    fn without_a_clock_nothing_is_cut() {
        let size =
            Size { elements: 7000.0, vertices: 1000.0, modes: 8.0, fields: 48.0, entries: 3e5, multiplications: 3e7 };
        let rest = size.rest(0.0);
        assert_eq!((rest, effort(0.0, rest[0])), ([0.0; 2], FULL));
        let [full, look] = size.rest(0.1);
        assert!(look > 0.0 && look < 0.7 * full, "{full} {look}");
        let twice = size.rest(0.2);
        assert!((twice[0] - 2.0 * full).abs() < 1e-9 * full); // by a machine half as fast
    }
}

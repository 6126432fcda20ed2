//! Many states in one call of `sw_states_step`, on one thread and on two, and one by one.

use super::contest::{Contestant, measure};
use super::{Lengths, scene, step};
use shellwarp::ffi::batch::{sw_set_threads, sw_states_step};
use shellwarp::ffi::state::SwState;
use shellwarp::model::Precision;
use shellwarp::state::Method;
use std::cell::RefCell;
use std::fmt::Write;

/// States that step together, and the least seconds that a step of all of them takes.
pub struct Batch {
    states: usize,
    /// Of each state.
    vertices: usize,
    modes: usize,
    /// On one model, else each on its own.
    shared: bool,
    one_by_one: f64,
    /// On one thread and on two.
    together: [f64; 2],
}

/// All states in one call.
fn step_all(states: &[*mut SwState], seconds: f64) {
    // SAFETY: live handles.
    let stepped = unsafe { sw_states_step(states.as_ptr(), states.len() as u32, seconds, std::ptr::null_mut()) };
    assert_eq!(stepped, 0);
}

impl Batch {
    fn measured(states: usize, vertices: usize, modes: usize, shared: bool) -> Self {
        let model = scene::model(vertices, modes, Precision::F32);
        let own = |_| if shared { model.clone() } else { scene::model(vertices, modes, Precision::F32) };
        let mut all: Vec<SwState> = (0..states).map(own).map(|m| scene::moving(&m, Method::Warp).into()).collect();
        let handles: Vec<*mut SwState> = all.iter_mut().map(std::ptr::from_mut).collect();
        let lengths = RefCell::new(Lengths::default());
        let one_by_one = || {
            let seconds = lengths.borrow_mut().next();
            // SAFETY: live handles, used by nobody else.
            handles.iter().for_each(|handle| step(unsafe { &mut **handle }, seconds));
        };
        // Switching the number of threads ends them; the call that is not timed makes them anew, and they stay for a turn.
        let together = |name, threads| {
            let threads_for_turn = move || {
                // SAFETY: no other thread is in the library.
                assert_eq!(unsafe { sw_set_threads(threads) }, 0);
            };
            let call = || step_all(&handles, lengths.borrow_mut().next());
            Contestant::new(name, call).after(threads_for_turn)
        };
        let mut contest =
            [Contestant::new("one by one", one_by_one), together("one thread", 1), together("two threads", 2)];
        measure(&mut contest);
        let [one_by_one, one, two] = contest.map(|one| one.best);
        Self { states, vertices, modes, shared, one_by_one, together: [one, two] }
    }

    fn is(&self, states: usize, vertices: usize, modes: usize) -> bool {
        self.shared && (self.states, self.vertices, self.modes) == (states, vertices, modes)
    }

    fn speedup(&self) -> f64 {
        self.together[0] / self.together[1]
    }

    fn nanoseconds(&self, seconds: f64) -> f64 {
        1e9 * seconds / (self.states * self.vertices) as f64
    }
}

/// From a single leaf to ten thousand.
pub fn measure_all(largest: usize) -> Vec<Batch> {
    let counts = [1, 2, 8, 32, 64, 128, 1000, 10_000].into_iter().filter(|count| count * 500 <= 5 * largest);
    let mut all: Vec<Batch> = counts.map(|count| Batch::measured(count, 500, 4, true)).collect();
    all.push(Batch::measured(64, 500, 8, true));
    if largest >= 1_000_000 {
        all.push(Batch::measured(10_000, 500, 8, true));
        all.push(Batch::measured(200, 5000, 4, false));
    }
    all
}

pub fn table(batches: &[Batch]) -> String {
    let mut text =
        "### Many states by `sw_states_step`, the warp\n\n| states × vertices | steps/s on one thread | ns per vertex \
        | of the time one by one | two threads are faster |\n| --- | --- | --- | --- | --- |\n"
            .to_owned();
    for b in batches {
        let model = if b.shared { "one model" } else { "own models" };
        let _ = write!(text, "| {} × {}, {} modes, {model} |", b.states, b.vertices, b.modes);
        let [one, _] = b.together;
        let _ = writeln!(
            text,
            " {:.1} | {:.2} | {:.3} | {:.2} |",
            one.recip(),
            b.nanoseconds(one),
            one / b.one_by_one,
            b.speedup()
        );
    }
    text
}

/// Rows of the table of goals.
pub fn goals(batches: &[Batch]) -> String {
    let mut text = String::new();
    let large = batches.iter().find(|b| b.is(10_000, 500, 4));
    if let Some(b) = large {
        let [one, _] = b.together;
        let _ = writeln!(text, "| 10,000 × 500 vertices, m = 4, one thread | 100 steps/s | {:.0} |", one.recip());
        let _ = writeln!(text, "| the same on two threads | 1.7 × faster | {:.2} |", b.speedup());
    }
    let small = batches.iter().filter(|b| b.shared && b.states <= 64);
    if let Some(slowest) = small.map(Batch::speedup).min_by(f64::total_cmp) {
        let _ = writeln!(text, "| up to 64 × 500 on two threads, the least | 1.0 × faster | {slowest:.2} |");
    }
    text
}

pub fn csv(batches: &[Batch]) -> String {
    let mut text = String::new();
    for b in batches {
        for (threads, seconds) in (1..).zip(b.together) {
            let kernel = if b.shared { "step of all, one model" } else { "step of all, own models" };
            let ns = b.nanoseconds(seconds);
            let _ = writeln!(text, "\"{kernel}\",{},{},{},{threads},{ns:.4},,", b.vertices, b.modes, b.states);
        }
    }
    text
}

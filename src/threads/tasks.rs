//! Tasks that wait for one another, on several threads.

use super::share;
use std::collections::BinaryHeap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Looks at a task that is at work before a thread sleeps until it is done: for some microseconds.
const LOOKS: usize = 1000;

/// Which tasks wait for which. They are numbered such that none waits for a later one.
#[derive(Default)]
pub struct Tasks {
    /// Those that wait for each: start and list.
    start: Vec<u32>,
    dependents: Vec<u32>,
    /// How many each waits for.
    waits_for: Vec<u32>,
    /// The larger, the sooner of those that are ready.
    urgency: Vec<u64>,
}

/// What is to be done still.
struct Board {
    ready: BinaryHeap<(u64, u32)>,
    waits_for: Vec<u32>,
    left: usize,
    /// One failed: none begins any more.
    failed: bool,
}

struct Boarded {
    board: Mutex<Board>,
    changed: Condvar,
}

/// Waits inside a task for what an earlier one leaves, which has begun before.
pub struct WaitFor<'a>(Option<&'a Boarded>);

impl Boarded {
    fn lock(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next task, or `None` when none is left.
    fn take(&self) -> Option<u32> {
        let mut board = self.lock();
        loop {
            if board.failed || board.left == 0 {
                return None;
            }
            if let Some((_, task)) = board.ready.pop() {
                return Some(task);
            }
            board = self.changed.wait(board).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn fail(&self) {
        self.lock().failed = true;
        self.changed.notify_all();
    }

    fn end(&self, dependents: &[u32], urgency: &[u64]) {
        let mut board = self.lock();
        board.left -= 1;
        for &task in dependents {
            board.waits_for[task as usize] -= 1;
            if board.waits_for[task as usize] == 0 {
                board.ready.push((urgency[task as usize], !task));
            }
        }
        drop(board);
        self.changed.notify_all();
    }
}

impl WaitFor<'_> {
    /// What `get` finds once it is there; `None` when a task failed.
    pub fn found<T>(&self, get: impl Fn() -> Option<T>) -> Option<T> {
        let Some(boarded) = self.0 else { return get() };
        for _ in 0..LOOKS {
            if let Some(found) = get() {
                return Some(found);
            }
            std::hint::spin_loop();
        }
        let mut board = boarded.lock();
        loop {
            if let Some(found) = get() {
                return Some(found);
            }
            if board.failed {
                return None;
            }
            board = boarded.changed.wait(board).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Ends all when a task panics, so that nobody waits for it.
struct Fallen<'a>(&'a Boarded);

impl Drop for Fallen<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.fail();
        }
    }
}

/// The seconds of pairs by their firsts, which are below `n`, in the order of the pairs: where those of each begin, and all.
pub fn lists(n: usize, pairs: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0; n + 1];
    pairs.iter().for_each(|[first, _]| start[*first as usize + 1] += 1);
    (0..n).for_each(|k| start[k + 1] += start[k]);
    let (mut next, mut seconds) = (start.clone(), vec![0; pairs.len()]);
    for &[first, second] in pairs {
        seconds[next[first as usize] as usize] = second;
        next[first as usize] += 1;
    }
    (start, seconds)
}

impl Tasks {
    /// Of so many tasks, in pairs of one and one that waits for it, each pair once.
    pub fn new(n: usize, pairs: &[[u32; 2]], urgency: Vec<u64>) -> Self {
        let mut waits_for = vec![0; n];
        for &[first, second] in pairs {
            assert!(first < second && (second as usize) < n, "a task waits for an earlier one");
            waits_for[second as usize] += 1;
        }
        let (start, dependents) = lists(n, pairs);
        Self { start, dependents, waits_for, urgency }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.waits_for.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (self.start.len() + self.dependents.len() + self.waits_for.len()) + 8 * self.urgency.len()
    }

    /// Calls `body` on every task, on as many threads as pays for work of so many nanoseconds in all, each with what `make` makes for it. An
    /// error ends all, and the answer is one of those. One thread takes them by number.
    pub fn run<W, E: Send>(
        &self,
        nanoseconds: u64,
        make: impl Fn() -> Result<W, E> + Sync,
        body: impl Fn(&mut W, usize, WaitFor) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        let ready = |task: &usize| self.waits_for[*task] == 0;
        let ready = (0..self.count()).filter(ready).map(|task| (self.urgency[task], !(task as u32))).collect();
        let ready = Board { ready, waits_for: self.waits_for.clone(), left: self.count(), failed: false };
        let boarded = Boarded { board: Mutex::new(ready), changed: Condvar::new() };
        let error = Mutex::new(None);
        let alone = || -> Result<(), E> {
            let mut own = make()?;
            (0..self.count()).try_for_each(|task| body(&mut own, task, WaitFor(None)))
        };
        let among_others = || -> Result<(), E> {
            let mut own = None;
            while let Some(turned) = boarded.take() {
                let task = !turned as usize;
                let _fallen = Fallen(&boarded);
                let own = match &mut own {
                    Some(own) => own,
                    none => none.insert(make()?),
                };
                body(own, task, WaitFor(Some(&boarded)))?;
                let after = self.start[task] as usize..self.start[task + 1] as usize;
                boarded.end(&self.dependents[after], &self.urgency);
            }
            Ok(())
        };
        share(nanoseconds, |threads| {
            let worked = if threads == 1 { alone() } else { among_others() };
            if let Err(wrong) = worked {
                error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(wrong);
                boarded.fail();
            }
        });
        error.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }
}

//! Threads for work on many states at once and for large work on one: a pool of this library's own, so that the host's is left alone. No
//! thread exists before the first call with enough work for two; then they wait for the next one, and sleep.
//!
//! The caller works with them: items are handed out in shares of about equal work to whoever is free. Work on one state shares only where
//! nobody else does: inside work on many, or beside another call's, the thread that asks does all of it. Of long items, the last share with threads
//! that are done, each with as many.

mod items;
mod tasks;

pub use items::{Watch, both, map, parts, share_items};
pub use tasks::{Tasks, WaitFor, lists};

use crate::{Error, ErrorKind, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Nanoseconds of work below which waking another thread costs more than it brings.
const WORTHWHILE: u64 = 100_000;
/// Shares per thread, so that unequal threads end together, and the least work in one, against the cost of taking it.
const SHARES: u64 = 8;
const LEAST_SHARE: u64 = 10_000;

/// Between two looks at threads that still work.
const BREATH: Duration = Duration::from_millis(2);

/// False in a bare WebAssembly module, where asking for a thread, or for the process, would trap.
const HAS_THREADS: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));

/// More would be a mistake.
pub const MOST_THREADS: usize = 1024;

/// The pool's threads besides the caller, and the process that they belong to: a fork has none of them.
struct Pool {
    pool: Option<ThreadPool>,
    workers: Vec<JoinHandle<()>>,
    process: u32,
}

struct Threads {
    /// The caller included; 0 for as many as the process may use.
    wanted: usize,
    pool: Option<Pool>,
}

/// As many as the process may use, asked once as the system is slow to tell, and as the environment allows, as farms set it that run a process
/// for each core.
static POSSIBLE: LazyLock<usize> = LazyLock::new(|| {
    let bound = std::env::var("RAYON_NUM_THREADS").ok().and_then(|bound| bound.trim().parse().ok());
    let bound = bound.filter(|bound| *bound > 0).unwrap_or(MOST_THREADS);
    std::thread::available_parallelism().map_or(1, usize::from).min(bound)
});

static THREADS: RwLock<Threads> = RwLock::new(Threads { wanted: 0, pool: None });

fn process() -> u32 {
    if HAS_THREADS { std::process::id() } else { 0 }
}

impl Pool {
    /// None where the system gives no threads.
    fn new(workers: usize) -> Option<Self> {
        let handles = Arc::new(Mutex::new(vec![]));
        let spawned = handles.clone();
        let built = ThreadPoolBuilder::new().num_threads(workers).spawn_handler(move |thread| {
            let name = format!("shellwarp-{}", thread.index() + 1);
            let handle = std::thread::Builder::new().name(name).spawn(|| thread.run())?;
            spawned.lock().unwrap_or_else(PoisonError::into_inner).push(handle);
            Ok(())
        });
        let pool = built.build().ok();
        let workers = std::mem::take(&mut *handles.lock().unwrap_or_else(PoisonError::into_inner));
        let pool = Self { pool, workers, process: process() };
        pool.pool.is_some().then_some(pool)
    }
}

impl Drop for Pool {
    /// Returns when the threads have ended, so that the library may be unloaded.
    fn drop(&mut self) {
        drop(self.pool.take());
        if self.process == process() {
            self.workers.drain(..).for_each(|worker| drop(worker.join()));
        }
    }
}

impl Threads {
    fn count(&self) -> usize {
        match self.wanted {
            _ if !HAS_THREADS => 1,
            0 => *POSSIBLE,
            wanted => wanted,
        }
    }

    fn is_ready(&self) -> bool {
        self.count() == 1 || self.pool.as_ref().is_some_and(|pool| pool.process == process())
    }

    fn prepare(&mut self) {
        if !self.is_ready() {
            // A forked process's pool has no threads left that its end could wait for.
            std::mem::forget(self.pool.take());
            self.pool = Pool::new(self.count() - 1);
        }
    }
}

/// Sets how many threads work at once, the caller included; 0 for as many as the process may use (the default). Ends the
/// pool's present threads. False, and nothing is changed, while a call uses them.
pub fn set_threads(count: usize) -> bool {
    let Ok(mut threads) = THREADS.try_write() else { return false };
    threads.pool = None;
    threads.wanted = count;
    true
}

fn threads() -> RwLockReadGuard<'static, Threads> {
    let read = || THREADS.read().unwrap_or_else(PoisonError::into_inner);
    if !read().is_ready() {
        THREADS.write().unwrap_or_else(PoisonError::into_inner).prepare();
    }
    read()
}

/// Items that nobody has taken yet.
struct Queue<'a, T, W> {
    rest: &'a mut [T],
    nanoseconds: W,
    share: u64,
}

impl<'a, T, W: Fn(&T) -> u64> Queue<'a, T, W> {
    /// The next items of about one share of work.
    fn take(&mut self) -> &'a mut [T] {
        let (mut work, mut count) = (0, 0);
        while count < self.rest.len() && work < self.share {
            work += (self.nanoseconds)(&self.rest[count]);
            count += 1;
        }
        let (taken, rest) = std::mem::take(&mut self.rest).split_at_mut(count);
        self.rest = rest;
        taken
    }
}

/// Whether a thread has a part in work that is shared already.
enum Part {
    None,
    /// And has nothing to share itself.
    One,
    /// One of so many that still work: what the others leave idle once they are done, these share alike.
    Among(Arc<AtomicUsize>),
}

thread_local! {
    static PART: RefCell<Part> = const { RefCell::new(Part::None) };
}

/// This thread has a part as long as this lives.
struct Busy(Part);

impl Busy {
    fn new(part: Part) -> Self {
        Self(PART.replace(part))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        if let Part::Among(crew) = PART.replace(std::mem::replace(&mut self.0, Part::None)) {
            crew.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// How many threads this one may share its work with, itself included.
fn idle() -> usize {
    let count = || THREADS.read().unwrap_or_else(PoisonError::into_inner).count();
    PART.with_borrow(|part| match part {
        Part::None => count(),
        Part::One => 1,
        Part::Among(crew) => {
            let working = crew.load(Ordering::SeqCst).max(1);
            1 + count().saturating_sub(working) / working
        }
    })
}

/// Held by the call whose work on one state the pool shares, and together by those of a crew.
static SHARED: RwLock<()> = RwLock::new(());

/// What is held of [`SHARED`] as long as this lives.
enum Held {
    Whole { _guard: RwLockWriteGuard<'static, ()> },
    Part { _guard: RwLockReadGuard<'static, ()> },
}

impl Held {
    /// None where another call has it.
    fn new() -> Option<Self> {
        fn any<G>(tried: std::result::Result<G, TryLockError<G>>) -> Option<G> {
            match tried {
                Ok(held) => Some(held),
                Err(TryLockError::Poisoned(held)) => Some(held.into_inner()),
                Err(TryLockError::WouldBlock) => None,
            }
        }
        match PART.with_borrow(|part| matches!(part, Part::Among(_))) {
            true => any(SHARED.try_read()).map(|guard| Self::Part { _guard: guard }),
            false => any(SHARED.try_write()).map(|guard| Self::Whole { _guard: guard }),
        }
    }
}

/// How the names of the library's own threads begin.
pub const NAMED: &str = "shellwarp";

thread_local! {
    /// The text of this thread's last panic, where somebody keeps it.
    pub static PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Asks whether to go on; from the caller's thread, the host.
pub type GoOn<'a> = &'a mut dyn FnMut() -> Result<()>;

/// A panic and its text.
type Fall = (Box<dyn Any + Send>, Option<String>);

/// What was wrong first, and so ended all.
#[derive(Default)]
struct Outcome {
    failed: AtomicBool,
    done: AtomicUsize,
    error: Mutex<Option<Error>>,
    panic: Mutex<Option<Fall>>,
}

impl Outcome {
    fn fail(&self, error: Error) {
        if !self.failed.swap(true, Ordering::SeqCst) {
            *self.error.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
    }

    /// Keeps the first panic of another thread, with its text, for the caller's.
    fn fall(&self, payload: Box<dyn Any + Send>) {
        let text = PANIC.take();
        self.panic.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert((payload, text));
        self.fail(Error::new(ErrorKind::Cancelled, "a thread panicked"));
    }

    /// Goes on with the panic of another thread, if there was one.
    fn raise(&self) {
        if let Some((payload, text)) = self.panic.lock().unwrap_or_else(PoisonError::into_inner).take() {
            PANIC.set(text);
            resume_unwind(payload);
        }
    }

    fn go_on(&self) -> Result<()> {
        match self.failed.load(Ordering::SeqCst) {
            true => Err(Error::new(ErrorKind::Cancelled, "other work failed or was cancelled")),
            false => Ok(()),
        }
    }
}

/// Ends all when the caller's thread panics, so that nobody waits for its item.
struct Fallen<'a>(&'a Outcome);

impl Drop for Fallen<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.fail(Error::new(ErrorKind::Cancelled, "a thread panicked"));
        }
    }
}

/// Calls `body` once on every item, each long work, on at most so many threads. Each thread has what `make` makes for it. None is of the
/// pool, which steps of other states must find free; the last items may share what they do with threads that are done. `watch` hears on the caller's thread how many items are done, and may stop all with
/// an error. A panic on any of the threads ends all, and is the caller's.
pub fn for_each_long<T: Send, W>(
    items: &mut [T],
    most: usize,
    make: impl Fn() -> Result<W> + Sync,
    body: impl Fn(&mut W, &mut T, GoOn) -> Result<()> + Sync,
    watch: &mut dyn FnMut(usize) -> Result<()>,
) -> Result<()> {
    let (n_items, outcome) = (items.len(), Outcome::default());
    let queue = Mutex::new(items.iter_mut());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = |go_on: GoOn| -> Result<()> {
        let mut own = make()?;
        while let Some(item) = next() {
            body(&mut own, item, go_on)?;
            outcome.done.fetch_add(1, Ordering::SeqCst);
        }
        Ok(())
    };
    let workers = idle().min(most).min(n_items).max(1) - 1;
    let crew = Arc::new(AtomicUsize::new(workers + 1));
    std::thread::scope(|scope| {
        for k in 0..workers {
            let alone = || {
                let _busy = Busy::new(Part::Among(crew.clone()));
                let worked = catch_unwind(AssertUnwindSafe(|| work(&mut || outcome.go_on())));
                match worked {
                    Ok(worked) => worked.unwrap_or_else(|error| outcome.fail(error)),
                    Err(payload) => outcome.fall(payload),
                }
            };
            let spawned = std::thread::Builder::new().name(format!("{NAMED}+{}", k + 1)).spawn_scoped(scope, alone);
            if spawned.is_err() {
                break; // the others do its work
            }
        }
        let _fallen = Fallen(&outcome);
        let mut hear = || outcome.go_on().and_then(|()| watch(outcome.done.load(Ordering::SeqCst)));
        let busy = Busy::new(Part::Among(crew.clone()));
        let mut worked = work(&mut hear);
        drop(busy);
        while worked.is_ok() && outcome.done.load(Ordering::SeqCst) < n_items {
            std::thread::sleep(BREATH);
            worked = hear();
        }
        worked.unwrap_or_else(|error| outcome.fail(error));
    });
    outcome.raise();
    outcome.error.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
}

/// Calls `body` once on every item, on several threads where `nanoseconds`, an estimate of an item's work, says that this pays.
/// `body` must not panic.
pub fn for_each<T: Send>(items: &mut [T], nanoseconds: impl Fn(&T) -> u64 + Send, body: impl Fn(&mut T) + Sync) {
    let total: u64 = items.iter().map(&nanoseconds).sum();
    if items.len() < 2 || total < WORTHWHILE {
        return items.iter_mut().for_each(body);
    }
    let threads = threads();
    let Some(pool) = threads.pool.as_ref().and_then(|pool| pool.pool.as_ref()) else {
        drop(threads); // what is called may ask for it again
        return items.iter_mut().for_each(body);
    };
    let workers = pool.current_num_threads().min(items.len() - 1);
    let share = (total / (SHARES * (workers as u64 + 1))).max(LEAST_SHARE);
    let queue = Mutex::new(Queue { rest: items, nanoseconds, share });
    let work = || {
        let _busy = Busy::new(Part::One);
        loop {
            let taken = queue.lock().unwrap_or_else(PoisonError::into_inner).take();
            if taken.is_empty() {
                return;
            }
            taken.iter_mut().for_each(&body);
        }
    };
    pool.in_place_scope(|scope| {
        (0..workers).for_each(|_| scope.spawn(|_| work()));
        work();
    });
}

/// How many threads would share work of so many nanoseconds now, the caller included.
pub fn sharers(nanoseconds: u64) -> usize {
    let pays = usize::try_from(nanoseconds / WORTHWHILE).unwrap_or(usize::MAX);
    if !HAS_THREADS || pays < 2 { 1 } else { idle().min(pays).max(1) }
}

/// Calls `body` on this thread and on as many others as pays for work of so many nanoseconds, at once, and returns when all have. Each is told how many
/// there are at most. Where other work is shared already, or no thread is there, it is called here alone, with 1. Who takes part and when is chance: `body`
/// takes tasks until none is left, and must end when one of its calls panics ([`Tasks`] does). That panic is the caller's.
pub fn share(nanoseconds: u64, body: impl Fn(usize) + Sync) {
    let most = sharers(nanoseconds);
    if most < 2 {
        return body(1);
    }
    let Some(shared) = Held::new() else { return body(1) };
    let threads = threads();
    let Some(pool) = threads.pool.as_ref().and_then(|pool| pool.pool.as_ref()) else {
        drop(threads); // what is called may ask for it again
        return body(1);
    };
    let workers = pool.current_num_threads().min(most - 1);
    let outcome = Outcome::default();
    pool.in_place_scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|_| {
                let _busy = Busy::new(Part::One);
                catch_unwind(AssertUnwindSafe(|| body(workers + 1))).unwrap_or_else(|payload| outcome.fall(payload));
            });
        }
        let _busy = Busy::new(Part::One);
        body(workers + 1);
    });
    drop(shared);
    outcome.raise();
}

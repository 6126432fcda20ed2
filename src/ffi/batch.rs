//! Many states in one call, and the threads that share the work.

use super::guard::{contained, guard, write};
use super::pointer::{object, read_array};
use super::state::SwState;
use super::status::{Fault, SW_ERROR_BUSY, SW_OK, SwStatus};
use crate::threads::{MOST_THREADS, for_each, set_threads};
use std::sync::atomic::{AtomicU64, Ordering};

/// A state on its way through a step.
struct Job<'a> {
    handle: &'a SwState,
    fault: Option<Fault>,
}

/// Numbers the calls, from 1.
static BATCHES: AtomicU64 = AtomicU64::new(1);

/// Advances `count` states by `seconds` each, as sw_state_step would one by one and to the same bits, whatever the number of
/// threads: states of any models and methods, in any order. A state that fails has not moved; the others have.
///
/// `statuses` (count, or NULL) receives the status of each. The result is SW_OK, or the status of the first that failed, with
/// its index in the message. A state that is in use is SW_ERROR_BUSY, and so is one that comes twice, at its later places.
///
/// Little work is done on the calling thread alone. More is shared with threads of this library, made by the first call that
/// needs them: one fewer than the processors that the process may use, see sw_set_threads. Allocates some bytes for each state. May run on several threads at once, on different states.
/// Errors: SW_ERROR_INVALID_ARGUMENT when `states` or one of them is NULL: nothing has moved, and statuses is untouched. Else
/// those of sw_state_step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_states_step(
    states: *const *mut SwState,
    count: u32,
    seconds: f64,
    statuses: *mut SwStatus,
) -> SwStatus {
    guard(|| {
        // SAFETY: the host passes `count` live handles.
        let handles = unsafe { read_array("states", states, count.into())? };
        let place = |i: usize, fault: Fault| Fault::new(fault.status, format!("states[{i}]: {}", fault.message));
        let job = |(i, handle): (usize, &*mut SwState)| {
            // SAFETY: a live handle, or NULL.
            let handle = unsafe { object("state", handle.cast_const()) };
            handle.map(|handle| Job { handle, fault: None }).map_err(|fault| place(i, fault))
        };
        let mut jobs = handles.iter().enumerate().map(job).collect::<Result<Vec<_>, _>>()?;
        step_all(&mut jobs, seconds);
        for (i, job) in jobs.iter().enumerate().filter(|_| !statuses.is_null()) {
            let status = job.fault.as_ref().map_or(SW_OK, |fault| fault.status);
            // SAFETY: the host's buffer has `count` places.
            unsafe { statuses.wrapping_add(i).write_unaligned(status) };
        }
        match jobs.into_iter().enumerate().find_map(|(i, job)| job.fault.map(|fault| place(i, fault))) {
            None => Ok(()),
            Some(first) => Err(first),
        }
    })
}

/// Steps each state that can be had, once.
fn step_all(jobs: &mut [Job], seconds: f64) {
    let batch = BATCHES.fetch_add(1, Ordering::Relaxed);
    for_each(
        jobs,
        |job| job.handle.step_nanoseconds.load(Ordering::Relaxed),
        |job| job.fault = contained(|| step_one(job.handle, batch, seconds)).err(),
    );
    if jobs.iter().any(|job| job.fault.as_ref().is_some_and(|fault| fault.status == SW_ERROR_BUSY)) {
        put_the_first_of_each_first(jobs);
    }
}

/// Everything that a state needs happens here at once, while it is in the cache.
fn step_one(handle: &SwState, batch: u64, seconds: f64) -> Result<(), Fault> {
    let mut state = write("state", &handle.state)?;
    if handle.batch.swap(batch, Ordering::Relaxed) == batch {
        return Err(Fault::new(SW_ERROR_BUSY, "the state has come before in this call"));
    }
    #[cfg(test)]
    super::tests::panic_if_asked(super::tests::Point::Step);
    Ok(state.step(seconds)?)
}

/// Of a state that comes several times, whichever was reached first has moved or failed, by chance: tells it at its first
/// place, and SW_ERROR_BUSY at the others.
fn put_the_first_of_each_first(jobs: &mut [Job]) {
    let handles: Vec<_> = jobs.iter().map(|job| std::ptr::from_ref(job.handle)).collect();
    let mut order: Vec<usize> = (0..jobs.len()).collect();
    order.sort_by_key(|&i| (handles[i], i));
    for same in order.chunk_by(|&i, &k| handles[i] == handles[k]) {
        let busy = |i: &usize| jobs[*i].fault.as_ref().is_some_and(|fault| fault.status == SW_ERROR_BUSY);
        let done = same.iter().copied().find(|i| !busy(i));
        if let Some(done) = done.filter(|done| *done != same[0]) {
            let [first, done] = jobs.get_disjoint_mut([same[0], done]).expect("two places");
            std::mem::swap(&mut first.fault, &mut done.fault);
        }
    }
}

/// Sets how many threads the library may use in this process, the calling one included: 1 for the calling one alone, 0 for
/// as many as the process may use (the default), and no more than RAYON_NUM_THREADS of the environment where that is set.
/// Threads share the states of sw_states_step, many bound points, and the work of steps, equilibria, certificates and
/// precomputes on full shells of some thousand vertices, to the same bits on any number. Calls on several threads do not share
/// among the same ones: the second works on its own. The library's threads end before this returns, and new ones are made when
/// they are needed. Call it with 1 before unloading the library where that takes its code away: on Windows and macOS. Elsewhere a closed
/// library stays loaded.
/// Errors: SW_ERROR_INVALID_ARGUMENT beyond 1024, SW_ERROR_BUSY while a call on another thread uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_set_threads(count: u32) -> SwStatus {
    guard(|| {
        if count as usize > MOST_THREADS {
            return Err(Fault::argument(format!("{count} threads: at most {MOST_THREADS}")));
        }
        if !set_threads(count as usize) {
            return Err(Fault::new(SW_ERROR_BUSY, "the threads are in use by a call on another thread"));
        }
        Ok(())
    })
}

//! Many states in one call, and the threads that share the work.

use super::guard::{contained, guard, poison, write};
use super::pointer::{object, read_array};
use super::state::SwState;
use super::status::{Fault, SW_ERROR_BUSY, SW_ERROR_INTERNAL, SW_OK, SwStatus};
use crate::State;
use crate::threads::{MOST_THREADS, for_each, set_threads};

/// A state on its way through a step.
struct Job<'a> {
    state: &'a mut State,
    fault: Option<Fault>,
}

/// Advances `count` states by `seconds` each, as sw_state_step would one by one and to the same bits, whatever the number of
/// threads: states of any models and methods, in any order. A state that fails has not moved; the others have.
///
/// `statuses` (count, or NULL) receives the status of each. The result is SW_OK, or the status of the first that failed, with
/// its index in the message; a state that is in use, or that comes twice, is SW_ERROR_BUSY from its second place on.
///
/// Little work is done on the calling thread alone. More is shared with threads of this library, made by the first call that
/// needs them: one fewer than the processors that the process may use, see sw_set_threads. They have the system's default
/// floating-point modes: a host that flushes denormal numbers on its own threads may see other last bits. Allocates some
/// bytes for each state. May run on several threads at once, on different states.
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
        let handle = |(i, handle): (usize, &*mut SwState)| {
            // SAFETY: a live handle, or NULL.
            unsafe { object("state", handle.cast_const()) }.map_err(|fault| place(i, fault))
        };
        let handles: Vec<&SwState> = handles.iter().enumerate().map(handle).collect::<Result<_, _>>()?;
        let faults = step_all(&handles, seconds);
        for (i, fault) in faults.iter().enumerate().filter(|_| !statuses.is_null()) {
            let status = fault.as_ref().map_or(SW_OK, |fault| fault.status);
            // SAFETY: the host's buffer has `count` places.
            unsafe { statuses.wrapping_add(i).write_unaligned(status) };
        }
        match faults.into_iter().enumerate().find_map(|(i, fault)| fault.map(|fault| place(i, fault))) {
            None => Ok(()),
            Some(first) => Err(first),
        }
    })
}

/// Steps each state that can be had; returns what went wrong, state by state.
fn step_all(handles: &[&SwState], seconds: f64) -> Vec<Option<Fault>> {
    // All locks are taken here and in order, so that a state that comes twice fails alike on any number of threads.
    let mut held: Vec<_> = handles.iter().map(|handle| write("state", &handle.0)).collect();
    let available = held.iter_mut().filter_map(|held| held.as_mut().ok());
    let mut jobs: Vec<Job> = available.map(|state| Job { state: &mut *state, fault: None }).collect();
    for_each(
        &mut jobs,
        |job| job.state.step_nanoseconds(),
        |job| {
            let step = || {
                #[cfg(test)]
                super::tests::panic_if_asked(super::tests::Point::Step);
                Ok(job.state.step(seconds)?)
            };
            job.fault = contained(step).err();
        },
    );
    let mut outcomes = jobs.into_iter().map(|job| job.fault).collect::<Vec<_>>().into_iter();
    let outcome = |held| match held {
        Err(fault) => Some(fault),
        Ok(state) => {
            let fault = outcomes.next().expect("one for each state held");
            if fault.as_ref().is_some_and(|fault| fault.status == SW_ERROR_INTERNAL) {
                poison(state);
            }
            fault
        }
    };
    held.into_iter().map(outcome).collect()
}

/// Sets how many threads sw_states_step may use in this process, the calling one included: 1 for the calling one alone, 0 for
/// as many as the process may use (the default). The library's threads end before this returns, and new ones are made when
/// they are needed: call it with 1 before unloading the library, if sw_states_step has been used.
/// Errors: SW_ERROR_INVALID_ARGUMENT beyond 1024, SW_ERROR_BUSY while another thread is inside sw_states_step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_set_threads(count: u32) -> SwStatus {
    guard(|| {
        if count as usize > MOST_THREADS {
            return Err(Fault::argument(format!("{count} threads: at most {MOST_THREADS}")));
        }
        if !set_threads(count as usize) {
            return Err(Fault::new(SW_ERROR_BUSY, "the threads are in use by sw_states_step on another thread"));
        }
        Ok(())
    })
}

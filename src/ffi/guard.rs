//! The panic boundary: whatever happens inside, the host gets a status code and nothing is printed.

use super::floats::Inside;
use super::status::{Fault, SW_ERROR_INTERNAL, SW_OK, SwStatus, remember};
use crate::threads::{NAMED, PANIC};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Once, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

thread_local! {
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Keeps a panic's text for [`guard`] instead of printing it, on threads that are inside a call and the library's own; others go on as before.
fn silence_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let previous = take_hook();
        set_hook(Box::new(move |info| {
            if INSIDE.get() || std::thread::current().name().is_some_and(|name| name.starts_with(NAMED)) {
                PANIC.set(Some(info.to_string().replace('\n', ": ")));
            } else {
                previous(info);
            }
        }));
    });
}

/// Runs `body` in the default floating-point modes; a panic becomes SW_ERROR_INTERNAL with its text.
pub(super) fn contained<T>(body: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    silence_panics();
    let outer = INSIDE.replace(true); // a callback may call back into the library
    let modes = Inside::enter();
    let outcome = catch_unwind(AssertUnwindSafe(|| called(body)));
    drop(modes);
    INSIDE.set(outer);
    outcome.unwrap_or_else(|payload| {
        std::mem::forget(payload); // its destructor could panic again
        let text = PANIC.take().unwrap_or_default();
        Err(Fault::new(SW_ERROR_INTERNAL, format!("internal error, please report: {text}")))
    })
}

/// Not inlined, so that none of its arithmetic can be moved to where the host's floating-point modes are still set.
#[inline(never)]
fn called<T>(body: impl FnOnce() -> T) -> T {
    body()
}

/// Runs one exported function's body.
pub(super) fn guard(body: impl FnOnce() -> Result<(), Fault>) -> SwStatus {
    let outcome = contained(|| {
        #[cfg(test)]
        super::tests::panic_if_asked(super::tests::Point::Guard);
        body()
    });
    match outcome {
        Ok(()) => SW_OK,
        Err(fault) => {
            remember(&fault.message);
            fault.status
        }
    }
}

fn refuse<G>(what: &str, error: TryLockError<G>) -> Fault {
    match error {
        TryLockError::Poisoned(PoisonError { .. }) => {
            Fault::new(SW_ERROR_INTERNAL, format!("the {what} is poisoned by an earlier internal error"))
        }
        TryLockError::WouldBlock => Fault::new(
            super::status::SW_ERROR_BUSY,
            format!("the {what} is in use by another thread or an enclosing call"),
        ),
    }
}

/// Shared use of a handle's content; never waits.
pub(super) fn read<'a, T>(what: &str, lock: &'a RwLock<T>) -> Result<RwLockReadGuard<'a, T>, Fault> {
    lock.try_read().map_err(|e| refuse(what, e))
}

/// Exclusive use of a handle's content; never waits. A panic while it is held poisons the handle.
pub(super) fn write<'a, T>(what: &str, lock: &'a RwLock<T>) -> Result<RwLockWriteGuard<'a, T>, Fault> {
    let held = lock.try_write().map_err(|e| refuse(what, e))?;
    #[cfg(test)]
    super::tests::panic_if_asked(super::tests::Point::Exclusive);
    Ok(held)
}

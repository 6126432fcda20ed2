//! Work on the items of a list, on as many threads as pays.

use super::{for_each_long, share};
use crate::Result;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// Calls `body` once on every item, on as many threads as pays for work of so many nanoseconds in all.
pub fn share_items<T: Send>(items: &mut [T], nanoseconds: u64, body: impl Fn(&mut T) + Sync) {
    let queue = Mutex::new(items.iter_mut());
    share(nanoseconds, |_| {
        loop {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some(item) = next else { return };
            body(item);
        }
    });
}

/// What `body` makes of each item, in their order, on as many threads as pays for work of so many nanoseconds in all.
pub fn map<T: Sync, R: Send>(items: &[T], nanoseconds: u64, body: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let mut made: Vec<(&T, Option<R>)> = items.iter().map(|item| (item, None)).collect();
    share_items(&mut made, nanoseconds, |(item, made)| *made = Some(body(item)));
    made.into_iter().filter_map(|(_, made)| made).collect()
}

/// Parts of a list whose sums are added in their order: the same whatever the number of threads.
const PARTS: usize = 32;

/// The list in at most so many parts, none of fewer items but the last.
pub fn parts<T>(items: &[T], least: usize) -> Vec<&[T]> {
    items.chunks(items.len().div_ceil(PARTS).max(least)).collect()
}

/// Hears of the share of a work that is done, and may stop it with an error.
pub type Watch<'a> = &'a mut dyn FnMut(f64) -> Result<()>;

/// Steps that shares are told in.
const STEPS: f64 = 1e6;

/// What two long works make, one beside the other where a second thread is there; each may share what others leave idle. `watch` hears the mean of both
/// shares, on the caller's thread.
pub fn both<A: Send, B: Send>(
    first: impl FnOnce(Watch) -> Result<A> + Send,
    second: impl FnOnce(Watch) -> Result<B> + Send,
    watch: Watch,
) -> Result<(A, B)> {
    type Work<'a> = Box<dyn FnOnce(Watch) -> Result<()> + Send + 'a>;
    let (mut made, shares) = ((None, None), [AtomicU32::new(0), AtomicU32::new(0)]);
    let (a, b) = (&mut made.0, &mut made.1);
    let first: Work = Box::new(|watch| first(watch).map(|made| *a = Some(made)));
    let second: Work = Box::new(|watch| second(watch).map(|made| *b = Some(made)));
    let mut works = [(&shares[0], Some(first)), (&shares[1], Some(second))];
    for_each_long(
        &mut works,
        2,
        || Ok(()),
        |(), (told, work), go_on| {
            let mut hear = |share: f64| {
                told.store((share * STEPS) as u32, Ordering::Relaxed);
                go_on()
            };
            work.take().map_or(Ok(()), |work| work(&mut hear))?;
            told.store(STEPS as u32, Ordering::Relaxed);
            Ok(())
        },
        &mut |_| watch(shares.iter().map(|share| 0.5 / STEPS * f64::from(share.load(Ordering::Relaxed))).sum()),
    )?;
    drop(works);
    match made {
        (Some(a), Some(b)) => Ok((a, b)),
        _ => unreachable!("works that did not fail were done"),
    }
}

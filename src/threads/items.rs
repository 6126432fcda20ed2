//! Work on the items of a list, on as many threads as pays.

use super::{ledger, share};
use std::sync::{Mutex, PoisonError};

/// Calls `body` once on every item, on as many threads as pays for work of so many nanoseconds in all.
pub fn share_items<T: Send>(items: &mut [T], nanoseconds: u64, body: impl Fn(&mut T) + Sync) {
    if ledger::each(items, &body) {
        return;
    }
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

//! What of a work several threads can share, measured by one: an estimate of what more of them bring, where there are none.

use crate::clock::Instant;
use std::cell::Cell;

/// Seconds in lists of items that threads share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shared {
    /// By one thread.
    pub seconds: f64,
    /// By several that are all free, at least: of each list an equal part, or its longest item.
    pub least: f64,
}

#[derive(Clone, Copy)]
struct Ledger {
    threads: usize,
    shared: Shared,
    /// In an item, whose own lists are a part of it.
    within: bool,
}

thread_local! {
    static LEDGER: Cell<Option<Ledger>> = const { Cell::new(None) };
}

/// From now on this thread does by itself what so many could share, and measures it.
pub fn open(threads: usize) {
    LEDGER.set(Some(Ledger { threads: threads.max(1), shared: Shared::default(), within: false }));
}

/// What there was since, but for a list that is not done.
pub fn read() -> Shared {
    LEDGER.get().map(|ledger| ledger.shared).unwrap_or_default()
}

/// Ends it.
pub fn close() {
    LEDGER.set(None);
}

pub(super) fn is_open() -> bool {
    LEDGER.get().is_some()
}

/// Calls `body` on every item, and measures that; false, and nothing is done, unless this is measured.
pub(super) fn each<T>(items: &mut [T], mut body: impl FnMut(&mut T)) -> bool {
    let Some(ledger) = LEDGER.get() else { return false };
    if ledger.within {
        items.iter_mut().for_each(body);
        return true;
    }
    LEDGER.set(Some(Ledger { within: true, ..ledger }));
    let (mut sum, mut longest) = (0.0, 0.0f64);
    for item in items {
        let start = Instant::now();
        body(item);
        let seconds = start.elapsed().as_secs_f64();
        (sum, longest) = (sum + seconds, longest.max(seconds));
    }
    let Ledger { threads, shared, .. } = ledger;
    let least = shared.least + longest.max(sum / threads as f64);
    LEDGER.set(Some(Ledger { shared: Shared { seconds: shared.seconds + sum, least }, ..ledger }));
    true
}

#[cfg(test)]
mod tests {
    use super::super::share_items;
    use super::*;

    #[test]
    fn items_are_done_in_their_order_and_lists_within_them_are_counted_once() {
        open(4);
        let (mut items, count) = (vec![0; 8], Cell::new(0));
        each(&mut items, |item| {
            let before = read();
            let mut own = [1, 2, 3];
            share_items(&mut own, u64::MAX, |x| *x *= 2);
            assert_eq!(read(), before);
            count.set(count.get() + 1);
            *item = count.get() * own.iter().sum::<usize>();
        });
        let shared = read();
        close();
        assert_eq!(items, [12, 24, 36, 48, 60, 72, 84, 96]);
        assert!(shared.least <= shared.seconds);
        assert_eq!(read(), Shared::default());
        assert!(!each(&mut items, |item| *item = 0) && items[0] == 12);
    }
}

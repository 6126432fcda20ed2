//! A panic forced inside every exported function becomes SW_ERROR_INTERNAL, prints nothing and poisons the handle.

use std::cell::Cell;

/// Where a panic can be forced.
#[derive(Clone, Copy, PartialEq)]
pub enum Point {
    Guard,
    Exclusive,
}

thread_local! {
    static ASKED: Cell<Option<Point>> = const { Cell::new(None) };
}

pub fn panic_if_asked(point: Point) {
    if ASKED.get() == Some(point) {
        ASKED.set(None);
        panic!("forced by the test");
    }
}

//! Memory for the buffers of a page: a bare WebAssembly module has no malloc that it could call. Not in the C header.

use std::alloc::{Layout, alloc, dealloc};
use std::ptr::null_mut;

/// What buffers are aligned to.
const ALIGNMENT: usize = 16;

fn layout(size: usize) -> Option<Layout> {
    Layout::from_size_align(size.max(1), ALIGNMENT).ok()
}

/// `size` bytes aligned to 16, or null. Not initialised.
/// cbindgen:ignore
#[unsafe(no_mangle)]
pub extern "C" fn sw_alloc(size: usize) -> *mut u8 {
    // SAFETY: `layout` makes no size 0.
    layout(size).map_or(null_mut(), |layout| unsafe { alloc(layout) })
}

/// Gives back what `sw_alloc` gave for the same size; null is passed over.
/// cbindgen:ignore
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_free(bytes: *mut u8, size: usize) {
    if let Some(layout) = layout(size).filter(|_| !bytes.is_null()) {
        // SAFETY: the caller has `bytes` from `sw_alloc(size)`, which took the same layout.
        unsafe { dealloc(bytes, layout) }
    }
}

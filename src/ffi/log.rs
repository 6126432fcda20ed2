//! The log callback: the only global state, and the only way the library speaks unasked.

use super::floats::as_the_host;
use super::guard::guard;
use super::status::SwStatus;
use std::ffi::{CString, c_char, c_void};
use std::sync::Mutex;

/// Something a curious user may want to know.
pub const SW_LOG_INFO: u32 = 1;
/// Something was handled that the user should know of.
pub const SW_LOG_WARNING: u32 = 2;

/// Receives a message. Called on the thread that makes the call concerned; must not throw or long-jump.
pub type SwLogFn = Option<unsafe extern "C" fn(user: *mut c_void, level: u32, message: *const c_char)>;

struct Sink {
    callback: unsafe extern "C" fn(*mut c_void, u32, *const c_char),
    user: usize,
}

static SINK: Mutex<Option<Sink>> = Mutex::new(None);

/// Sets the receiver of log messages for the whole process, NULL for none (the default). The library never prints. When
/// this returns, calls under way on other threads may still use the old callback once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_set_log_callback(callback: SwLogFn, user: *mut c_void) -> SwStatus {
    guard(|| {
        let sink = callback.map(|callback| Sink { callback, user: user as usize });
        *SINK.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = sink;
        Ok(())
    })
}

/// Sends a message to the host, if it listens. The lock is not held during the call.
pub(super) fn log(level: u32, message: &str) {
    let sink = SINK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let Some((callback, user)) = sink.as_ref().map(|s| (s.callback, s.user)) else { return };
    drop(sink);
    if let Ok(text) = CString::new(message) {
        // SAFETY: the host set this callback with this user pointer.
        as_the_host(|| unsafe { callback(user as *mut c_void, level, text.as_ptr()) });
    }
}

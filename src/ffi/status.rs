//! Status codes, their strings, and the per-thread message.

use crate::ErrorKind;
use crate::features::Feature;
use std::cell::Cell;
use std::ffi::{CStr, c_char};

/// Result of a call: SW_OK or one of SW_ERROR_.... The message is in sw_last_error_message().
pub type SwStatus = u32;

/// Done.
pub const SW_OK: SwStatus = 0;
/// A pointer is NULL, a value is not finite or out of its range, an enumerant or a flag is unknown.
pub const SW_ERROR_INVALID_ARGUMENT: SwStatus = 1;
/// A struct_size or an element_size cannot be the host's sizeof: call the struct's sw_..._init first.
pub const SW_ERROR_INVALID_DESC: SwStatus = 2;
/// The mesh has a problem of severity error; sw_mesh_check lists them all.
pub const SW_ERROR_INVALID_MESH: SwStatus = 3;
/// The model has no modes yet: call sw_model_precompute first.
pub const SW_ERROR_NOT_PRECOMPUTED: SwStatus = 4;
/// The progress callback returned SW_PROGRESS_CANCEL.
pub const SW_ERROR_CANCELLED: SwStatus = 5;
/// The memory could not be had.
pub const SW_ERROR_OUT_OF_MEMORY: SwStatus = 6;
/// A factorization or iteration failed, or a result would not be finite.
pub const SW_ERROR_NUMERICAL: SwStatus = 7;
/// A buffer is too small; the message says what is needed.
pub const SW_ERROR_BUFFER_SIZE: SwStatus = 8;
/// Saved bytes are damaged, of another version, or belong to another model.
pub const SW_ERROR_INVALID_DATA: SwStatus = 9;
/// The object is in use by another thread.
pub const SW_ERROR_BUSY: SwStatus = 10;
/// This build or this version does not offer what was asked for, as a field that it does not know.
pub const SW_ERROR_UNSUPPORTED: SwStatus = 11;
/// A defect of the library was caught. The object concerned is poisoned: all but its destruction fails from now on.
pub const SW_ERROR_INTERNAL: SwStatus = 12;

/// A status with its message, on the way to the host.
#[derive(Debug)]
pub struct Fault {
    /// What kind.
    pub status: SwStatus,
    /// Names the item and the numbers.
    pub message: String,
}

impl Fault {
    /// From parts.
    pub fn new(status: SwStatus, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    /// SW_ERROR_INVALID_ARGUMENT.
    pub fn argument(message: impl Into<String>) -> Self {
        Self::new(SW_ERROR_INVALID_ARGUMENT, message)
    }
}

impl From<crate::Error> for Fault {
    fn from(error: crate::Error) -> Self {
        let status = match error.kind {
            ErrorKind::InvalidArgument => SW_ERROR_INVALID_ARGUMENT,
            ErrorKind::InvalidMesh => SW_ERROR_INVALID_MESH,
            ErrorKind::Cancelled => SW_ERROR_CANCELLED,
            ErrorKind::OutOfMemory => SW_ERROR_OUT_OF_MEMORY,
            ErrorKind::Numerical => SW_ERROR_NUMERICAL,
            ErrorKind::InvalidData => SW_ERROR_INVALID_DATA,
            ErrorKind::Unsupported => SW_ERROR_UNSUPPORTED,
        };
        Self::new(status, error.message)
    }
}

/// Longest message kept, the closing NUL included.
const CAPACITY: usize = 1024;

thread_local! {
    // A plain array: nothing to destroy when a thread ends after the library was unloaded.
    static LAST_MESSAGE: Cell<[u8; CAPACITY]> = const { Cell::new([0; CAPACITY]) };
}

/// Copies `text` into `buffer`, cut at a character boundary, and closes it with NUL.
pub(super) fn copy_text(text: &str, buffer: &mut [u8]) {
    let mut end = text.len().min(buffer.len() - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    buffer.fill(0);
    buffer[..end].copy_from_slice(&text.as_bytes()[..end]);
}

/// Keeps the message for sw_last_error_message().
pub(super) fn remember(message: &str) {
    let mut bytes = [0; CAPACITY];
    copy_text(message, &mut bytes);
    LAST_MESSAGE.set(bytes);
}

/// The message of the last failed call on this thread, "" if none failed. Never NULL. The text names the item and the
/// numbers. The pointer stays valid until the next failed call on this thread or its end.
#[unsafe(no_mangle)]
pub extern "C" fn sw_last_error_message() -> *const c_char {
    LAST_MESSAGE.with(|message| message.as_ptr().cast_const().cast())
}

/// A short constant description of a status code; "unknown status" for any other number. Never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn sw_status_string(status: SwStatus) -> *const c_char {
    let text: &CStr = match status {
        SW_OK => c"ok",
        SW_ERROR_INVALID_ARGUMENT => c"invalid argument",
        SW_ERROR_INVALID_DESC => c"descriptor not initialised",
        SW_ERROR_INVALID_MESH => c"invalid mesh",
        SW_ERROR_NOT_PRECOMPUTED => c"model not precomputed",
        SW_ERROR_CANCELLED => c"cancelled",
        SW_ERROR_OUT_OF_MEMORY => c"out of memory",
        SW_ERROR_NUMERICAL => c"numerical failure",
        SW_ERROR_BUFFER_SIZE => c"buffer too small",
        SW_ERROR_INVALID_DATA => c"invalid saved data",
        SW_ERROR_BUSY => c"handle in use by another thread",
        SW_ERROR_UNSUPPORTED => c"not supported",
        SW_ERROR_INTERNAL => c"internal error",
        _ => c"unknown status",
    };
    text.as_ptr()
}

/// Version of the interface. It grows when functions, fields or constants are added. A host works, without being compiled anew, with
/// every library whose sw_abi_version() is at least the SW_ABI_VERSION that it was compiled with, as long as the number in the
/// library's file name (SONAME) is the same. With an older library it works as far as told under Growth at the top.
pub const SW_ABI_VERSION: u32 = 1;

/// SW_ABI_VERSION of the header that belongs to the library.
#[unsafe(no_mangle)]
pub extern "C" fn sw_abi_version() -> u32 {
    SW_ABI_VERSION
}

/// The nonlinear shell: SW_METHOD_SHELL_..., sag_gravity.
pub const SW_FEATURE_NONLINEAR_SHELL: u32 = 1;
/// Wind: sw_state_set_wind with a density.
pub const SW_FEATURE_WIND: u32 = 2;
/// Saved models: sw_model_save, sw_model_load.
pub const SW_FEATURE_SAVED_MODELS: u32 = 4;
/// SW_PRECISION_F64.
pub const SW_FEATURE_F64_BASIS: u32 = 8;
/// SW_PRECISION_I16.
pub const SW_FEATURE_I16_BASIS: u32 = 16;
/// SW_METHOD_REDUCED_SHELL and reduced_fields.
pub const SW_FEATURE_REDUCED_SHELL: u32 = 32;
/// Colliders: sw_state_set_colliders.
pub const SW_FEATURE_CONTACT: u32 = 64;

/// The SW_FEATURE_... that the library was built with; usually all. Every function is there in any build; what asks for a missing
/// feature returns SW_ERROR_UNSUPPORTED, and the message names it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_features() -> u32 {
    let bit = |feature: &Feature| match feature {
        Feature::NonlinearShell => SW_FEATURE_NONLINEAR_SHELL,
        Feature::Wind => SW_FEATURE_WIND,
        Feature::SavedModels => SW_FEATURE_SAVED_MODELS,
        Feature::F64Basis => SW_FEATURE_F64_BASIS,
        Feature::I16Basis => SW_FEATURE_I16_BASIS,
        Feature::ReducedShell => SW_FEATURE_REDUCED_SHELL,
        Feature::Contact => SW_FEATURE_CONTACT,
    };
    Feature::ALL.iter().filter(|feature| feature.is_built_in()).map(bit).sum()
}

/// Version of the library, such as "0.1.0". Never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn sw_version_string() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("the version has no NUL inside"),
    };
    VERSION.as_ptr()
}

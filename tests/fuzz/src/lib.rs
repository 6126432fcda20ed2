//! What the fuzz targets do with any bytes. Each `run` plays a host that hands the C interface the worst that the bytes say, and
//! panics when the library breaks a promise: an internal error, a number that is not finite in an output, a failed call that
//! changed something.
#![allow(missing_docs, dead_code, unsafe_code, clippy::undocumented_unsafe_blocks)] // a host's calls, all pointers valid

pub mod calls;
pub mod contact;
pub mod host;
pub mod input;
pub mod material;
pub mod mesh;
pub mod proxy;
pub mod saved;

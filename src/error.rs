//! The one error type of the core: what kind of failure, and a message that names the item and the numbers.

use std::fmt;

/// What went wrong, coarse enough for a host to branch on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// A value outside its stated range, or not finite.
    InvalidArgument,
    /// The mesh has at least one problem of severity error.
    InvalidMesh,
    /// The host's progress callback asked to stop.
    Cancelled,
    /// An allocation would not fit.
    OutOfMemory,
    /// A factorization or eigenvalue iteration failed.
    Numerical,
    /// Saved bytes are damaged or belong to another model.
    InvalidData,
    /// The method chosen has no such thing.
    Unsupported,
}

/// An [`ErrorKind`] with its message.
#[derive(Clone, Debug)]
pub struct Error {
    /// Coarse kind.
    pub kind: ErrorKind,
    /// Names the item and the numbers, e.g. "triangle 17 has zero area: vertices 4, 9, 12".
    pub message: String,
}

impl Error {
    /// Builds an error from its parts.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// Shorthand for [`ErrorKind::InvalidArgument`].
    pub fn argument(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::InvalidArgument, message)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// Result with the core's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Fails with the name and value unless `value` is finite. The name is written then only: `format_args!` costs nothing before.
pub(crate) fn require_finite(name: impl fmt::Display, value: f64) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(Error::argument(format!("{name} is {value:?}: it must be finite"))) }
}

/// Fails with the name and value unless `value` is finite and not negative.
pub(crate) fn require_non_negative(name: impl fmt::Display, value: f64) -> Result<f64> {
    if require_finite(&name, value)? >= 0.0 {
        Ok(value)
    } else {
        Err(Error::argument(format!("{name} is {value:?}: it must not be negative")))
    }
}

/// Fails with [`ErrorKind::InvalidData`]: bytes that were not saved by this library, or were damaged.
pub(crate) fn invalid<T>(message: impl Into<String>) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidData, message))
}

/// An empty vector with room for `len` elements, or [`ErrorKind::OutOfMemory`] naming what it was for.
pub(crate) fn reserve<T>(what: &str, len: usize) -> Result<Vec<T>> {
    let mut v = Vec::new();
    v.try_reserve_exact(len).map_err(|_| {
        let bytes = len as f64 * size_of::<T>() as f64;
        Error::new(ErrorKind::OutOfMemory, format!("{what} needs {:.1} MiB, which could not be had", bytes / 1048576.0))
    })?;
    Ok(v)
}

/// A zeroed vector of `len` elements, or [`ErrorKind::OutOfMemory`] naming what it was for.
pub(crate) fn try_zeroed<T: Clone + Default>(what: &str, len: usize) -> Result<Vec<T>> {
    let mut v = reserve(what, len)?;
    v.resize(len, T::default());
    Ok(v)
}

/// A result, or the error that says why numbers, this shell or this build have none. Fails by any other error: memory does not suffice, or the work was stopped.
pub(crate) fn none_or_found<T>(found: Result<T>) -> Result<Result<T>> {
    match found {
        Err(error) if !matches!(error.kind, ErrorKind::Numerical | ErrorKind::Unsupported) => Err(error),
        found => Ok(found),
    }
}

/// Nothing where numbers, this shell or this build have none.
pub(crate) fn unless_none<T>(found: Result<T>) -> Result<Option<T>> {
    Ok(none_or_found(found)?.ok())
}

//! What this build of the library contains: Cargo features leave out what a host never uses.
//!
//! Their constants are known when compiling, so that what lies behind them is not built in. What a feature alone makes takes a
//! [`Proof`] of it: other builds have no value of that type, so that their compiler leaves out what comes after.

use crate::{Error, ErrorKind, Result};

/// Parts that a build may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The nonlinear shell, and with it `sag_gravity`.
    NonlinearShell,
    /// Wind.
    Wind,
    /// Saved models.
    SavedModels,
    /// Run-time bases in 64 bits.
    F64Basis,
    /// Run-time bases in 16 bits.
    I16Basis,
    /// The reduced nonlinear shell, which needs [`Feature::NonlinearShell`].
    ReducedShell,
    /// Colliders.
    Contact,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::NonlinearShell,
        Self::Wind,
        Self::SavedModels,
        Self::F64Basis,
        Self::I16Basis,
        Self::ReducedShell,
        Self::Contact,
    ];

    /// Whether this build has it.
    #[inline(always)]
    pub const fn is_built_in(self) -> bool {
        match self {
            Self::NonlinearShell => cfg!(feature = "nonlinear-shell"),
            Self::Wind => cfg!(feature = "wind"),
            Self::SavedModels => cfg!(feature = "saved-models"),
            Self::F64Basis => cfg!(feature = "f64-basis"),
            Self::I16Basis => cfg!(feature = "i16-basis"),
            Self::ReducedShell => cfg!(feature = "reduced-shell"),
            Self::Contact => cfg!(feature = "contact"),
        }
    }

    /// Its name in Cargo.toml.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NonlinearShell => "nonlinear-shell",
            Self::Wind => "wind",
            Self::SavedModels => "saved-models",
            Self::F64Basis => "f64-basis",
            Self::I16Basis => "i16-basis",
            Self::ReducedShell => "reduced-shell",
            Self::Contact => "contact",
        }
    }

    /// Fails unless this build has it. What is to be left out behind it takes a [`Proof`].
    #[inline(always)]
    pub fn require(self) -> Result<()> {
        if self.is_built_in() { Ok(()) } else { Err(self.missing()) }
    }

    #[cold]
    fn missing(self) -> Error {
        let message = format!("this build of the library was made without the Cargo feature {:?}", self.name());
        Error::new(ErrorKind::Unsupported, message)
    }
}

/// That a build has a feature.
pub trait Proof: Copy {
    /// Fails where it has not.
    fn of(feature: Feature) -> Result<Self>;
}

/// The proof where the feature is there.
#[derive(Clone, Copy, Debug)]
pub struct Present;

/// The proof where it is not: there is none.
#[derive(Clone, Copy, Debug)]
pub enum Absent {}

impl Proof for Present {
    fn of(feature: Feature) -> Result<Self> {
        feature.require().map(|()| Self)
    }
}

impl Proof for Absent {
    fn of(feature: Feature) -> Result<Self> {
        Err(feature.missing())
    }
}

/// Of [`Feature::NonlinearShell`].
#[cfg(feature = "nonlinear-shell")]
pub type NonlinearShell = Present;
/// Of [`Feature::NonlinearShell`].
#[cfg(not(feature = "nonlinear-shell"))]
pub type NonlinearShell = Absent;

/// Of [`Feature::ReducedShell`].
#[cfg(feature = "reduced-shell")]
pub type ReducedShell = Present;
/// Of [`Feature::ReducedShell`].
#[cfg(not(feature = "reduced-shell"))]
pub type ReducedShell = Absent;

/// Of [`Feature::SavedModels`].
#[cfg(feature = "saved-models")]
pub type SavedModels = Present;
/// Of [`Feature::SavedModels`].
#[cfg(not(feature = "saved-models"))]
pub type SavedModels = Absent;

/// Of [`Feature::Contact`].
#[cfg(feature = "contact")]
pub type Contact = Present;
/// Of [`Feature::Contact`].
#[cfg(not(feature = "contact"))]
pub type Contact = Absent;

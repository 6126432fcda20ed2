//! What this build of the library contains: Cargo features leave out what a host never uses. Their constants are known when
//! compiling, so that what lies behind them is not built in.

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
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::NonlinearShell, Self::Wind, Self::SavedModels, Self::F64Basis, Self::I16Basis, Self::ReducedShell];

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
        }
    }

    /// Fails unless this build has it. Inlined, so that what follows a failure is known never to run.
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

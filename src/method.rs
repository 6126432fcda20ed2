//! The names and numbers of the methods by which a shell can move.

use std::fmt;

/// How a shell moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Modal warping: u = R̃(Ψq) Φq, f = Φᵀ RᵀF (the paper).
    Warp,
    /// Modal warping with the exact force of its own positions: u = R̃(Ψq) Φq, f = (∂u/∂q)ᵀF.
    VirtualWorkWarp,
    /// Linear modal analysis: u = Φq, f = ΦᵀF.
    LinearModalAnalysis,
    /// The full nonlinear shell by backward Euler.
    ImplicitShell,
    /// The full nonlinear shell by symplectic Euler; steps must be short.
    ExplicitShell,
    /// The reduced nonlinear shell, u = Bq, by BDF2opt ([`crate::reduced`]).
    ReducedShell,
    /// Rotation–strain reconstruction from the modes, with the exact force of its own positions ([`crate::strain`]).
    RotationStrain,
}

impl Method {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::Warp,
        Self::LinearModalAnalysis,
        Self::ImplicitShell,
        Self::ExplicitShell,
        Self::VirtualWorkWarp,
        Self::ReducedShell,
        Self::RotationStrain,
    ];

    /// Its number in the interface and in saved models; 7 stands for a choice among them.
    pub const fn number(self) -> u32 {
        match self {
            Self::Warp => 1,
            Self::LinearModalAnalysis => 2,
            Self::ImplicitShell => 3,
            Self::ExplicitShell => 4,
            Self::VirtualWorkWarp => 5,
            Self::ReducedShell => 6,
            Self::RotationStrain => 8,
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Warp => "the warp",
            Self::LinearModalAnalysis => "linear modal analysis",
            Self::ImplicitShell => "the implicit shell",
            Self::ExplicitShell => "the explicit shell",
            Self::VirtualWorkWarp => "the warp by virtual work",
            Self::ReducedShell => "the reduced shell",
            Self::RotationStrain => "rotation-strain reconstruction",
        };
        write!(f, "{name} (method {})", self.number())
    }
}

//! The methods by which a shell can move: numbers, names and needs, in one table.

use crate::{Error, ErrorKind, Result};
use std::ffi::CStr;
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
    /// The reduced nonlinear shell, u = Bq, by a Runge–Kutta method of second order ([`crate::reduced`]).
    ReducedShell,
    /// The same with its energy as a polynomial of q ([`crate::reduced::polynomial`]).
    PolynomialShell,
    /// Either form of it: the polynomial in the range where it is as good as the samples, these beyond.
    AdaptiveShell,
    /// Rotation–strain reconstruction from the modes, with the exact force of its own positions ([`crate::strain`]).
    RotationStrain,
}

/// What a model must have for a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// A precompute of any kind.
    Modes,
    /// Modal rotations: no precompute for linear modal analysis alone.
    Rotations,
    /// Fields of a reduced shell.
    ReducedFields,
}

impl Needs {
    /// Fails unless a model with or without `rotations` and reduced `fields` has what is needed.
    pub fn require(self, rotations: bool, fields: bool) -> Result<()> {
        let met = match self {
            Self::Modes => true,
            Self::Rotations => rotations,
            Self::ReducedFields => fields,
        };
        if met { Ok(()) } else { Err(self.unmet()) }
    }

    /// What is told where a model lacks it.
    pub fn unmet(self) -> Error {
        let missing = match self {
            Self::Modes => "the model has no modes: precompute it",
            Self::Rotations => "the model was precomputed for linear modal analysis: it has no rotations to warp by",
            Self::ReducedFields => "the model has no reduced shell: precompute with reduced_fields, 40 for a start",
        };
        Error::new(ErrorKind::Unsupported, missing)
    }
}

/// A line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The method.
    pub method: Method,
    /// Its number in the interface and in saved data, for good.
    pub number: u32,
    /// Its name in files and scripts.
    pub name: &'static CStr,
    /// Its name in menus.
    pub label: &'static CStr,
    /// What a model must have for it.
    pub needs: Needs,
}

/// The number that stands for the method which a model's precompute has chosen.
pub const AUTO: u32 = 7;

const fn entry(method: Method, number: u32, name: &'static CStr, label: &'static CStr, needs: Needs) -> Entry {
    Entry { method, number, name, label, needs }
}

/// All methods, in the order in which hosts show them.
pub const METHODS: [Entry; 9] = [
    entry(Method::Warp, 1, c"warp", c"Warp", Needs::Rotations),
    entry(Method::VirtualWorkWarp, 5, c"warp-virtual-work", c"Warp by virtual work", Needs::Rotations),
    entry(Method::RotationStrain, 8, c"rotation-strain", c"Rotation-strain", Needs::Rotations),
    entry(Method::ReducedShell, 6, c"reduced-shell", c"Reduced shell", Needs::ReducedFields),
    entry(Method::PolynomialShell, 9, c"polynomial-shell", c"Polynomial shell", Needs::ReducedFields),
    entry(Method::AdaptiveShell, 10, c"adaptive-shell", c"Adaptive shell", Needs::ReducedFields),
    entry(Method::ImplicitShell, 3, c"shell-implicit", c"Full shell, implicit", Needs::Modes),
    entry(Method::ExplicitShell, 4, c"shell-explicit", c"Full shell, explicit", Needs::Modes),
    entry(Method::LinearModalAnalysis, 2, c"lma", c"Linear modes", Needs::Modes),
];

impl Method {
    /// Its line of the table.
    pub fn entry(self) -> &'static Entry {
        METHODS.iter().find(|entry| entry.method == self).expect("every method is in the table")
    }

    /// Its number in the interface and in saved data.
    pub fn number(self) -> u32 {
        self.entry().number
    }

    /// The method of that number, if there is one.
    pub fn of_number(number: u32) -> Option<Self> {
        METHODS.iter().find(|entry| entry.number == number).map(|entry| entry.method)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (method {})", self.entry().name.to_string_lossy(), self.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_belong_to_one_method_each_and_none_is_that_of_a_choice() {
        for (i, a) in METHODS.iter().enumerate() {
            assert_eq!(Method::of_number(a.number), Some(a.method));
            assert!(a.number > 0 && a.number != AUTO && !a.name.is_empty() && !a.label.is_empty());
            for b in &METHODS[..i] {
                assert!(a.method != b.method && a.number != b.number && a.name != b.name && a.label != b.label);
            }
        }
    }
}

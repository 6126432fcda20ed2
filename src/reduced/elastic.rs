//! What a search for equilibria asks of an energy on reduced coordinates.

use super::energy::{self, ReducedEnergy};
use super::factor::Factor;
use super::polynomial::{self, PolynomialEnergy};
use super::rigid::RigidRoom;
use crate::energy::Curvature;
use nalgebra::DMatrix;
use pulp::Arch;

/// In which form a reduced shell has its energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// On sampled elements.
    Sampled,
    /// As a polynomial of q.
    Polynomial,
}

/// An energy E(q) with two derivatives.
pub trait Elastic: Send + Sync {
    /// Coordinates.
    fn n(&self) -> usize;
    /// The registers that it is evaluated in.
    fn arch(&self) -> Arch;
    /// Room for one evaluation at a time.
    fn scratch(&self) -> Scratch;
    /// E.
    fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64;
    /// ∂E/∂q.
    fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]);
    /// ∂²E/∂q² (n × n); at least the lower triangle.
    fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>);
    /// What damping in proportion to stiffness multiplies the rates by.
    fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>);
    /// E as nearly as a choice between two guesses needs it.
    fn near_value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        self.value(q, scratch)
    }
    /// ∂E/∂q as nearly as a Newton step needs it that leaves 1e-5 and more.
    fn near_gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        self.gradient(q, scratch, out);
    }
    /// ∂²E/∂q² beside it in 32 bits; false where there is none.
    fn near_hessian(&self, _q: &[f64], _scratch: &mut Scratch, _out: &mut Factor) -> bool {
        false
    }
}

/// Room for the evaluation of the energy that made it.
#[derive(Clone)]
pub enum Scratch {
    /// Of a [`ReducedEnergy`].
    Sampled(Box<energy::Room>),
    /// Of a [`PolynomialEnergy`].
    Polynomial(Box<polynomial::Room>),
    /// Of a [`super::WithRigid`].
    Rigid(Box<RigidRoom>),
}

impl Scratch {
    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        match self {
            Self::Sampled(room) => room.take_shapes(),
            Self::Polynomial(room) => room.take_shapes(),
            Self::Rigid(room) => room.take_shapes(),
        }
    }

    /// As if no energy on samples had been evaluated: its rest angles are others now.
    pub fn forget(&mut self) {
        match self {
            Self::Sampled(room) => room.forget(),
            Self::Polynomial(_) => (),
            Self::Rigid(room) => room.own().forget(),
        }
    }

    /// That of a [`ReducedEnergy`].
    #[inline(always)]
    pub(super) fn sampled(&mut self) -> &mut energy::Room {
        match self {
            Self::Sampled(room) => room,
            _ => unreachable!("an energy is evaluated in room that it made"),
        }
    }

    /// That of the fields alone.
    pub fn own(&mut self) -> &mut Scratch {
        match self {
            Self::Rigid(room) => room.own(),
            own => own,
        }
    }

    /// That of a [`super::WithRigid`].
    pub(super) fn rigid(&mut self) -> &mut RigidRoom {
        match self {
            Self::Rigid(room) => room,
            _ => unreachable!("an energy is evaluated in room that it made"),
        }
    }

    /// That of a [`PolynomialEnergy`].
    #[inline(always)]
    pub(super) fn polynomial(&mut self) -> &mut polynomial::Room {
        match self {
            Self::Polynomial(room) => room,
            _ => unreachable!("an energy is evaluated in room that it made"),
        }
    }
}

/// By the methods of these names.
macro_rules! elastic {
    ($energy:ident, $hessian:ident $(, $more:item)*) => {
        impl Elastic for $energy {
            fn n(&self) -> usize {
                self.n()
            }
            fn arch(&self) -> Arch {
                self.arch
            }
            fn scratch(&self) -> Scratch {
                self.scratch()
            }
            fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
                self.value(q, scratch)
            }
            fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
                self.gradient(q, scratch, out);
            }
            fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
                self.$hessian(q, curvature, scratch, out);
            }
            fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
                self.viscosity(q, scratch, out);
            }
            $($more)*
        }
    };
}

elastic!(ReducedEnergy, hessian);
elastic!(
    PolynomialEnergy,
    lower_hessian,
    fn near_value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        self.near_value(q, scratch)
    },
    fn near_gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        self.near_gradient(q, scratch, out);
    },
    fn near_hessian(&self, q: &[f64], scratch: &mut Scratch, out: &mut Factor) -> bool {
        self.near_hessian(q, scratch, out);
        true
    }
);

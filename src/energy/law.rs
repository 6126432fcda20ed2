//! The law of a sheet: plane stress by strain, the same in all directions or of its own along one and across it.

use super::bending::Plate;
use super::patch::plane_stress;
use crate::Vec3;
use crate::material::{ElasticSheet, Orthotropy};
use nalgebra::Matrix3;

/// Of a unit E₁ along the fibres.
#[derive(Clone, Copy)]
pub(super) struct Law {
    poisson: f64,
    /// E₂/E₁ and G₁₂/E₁.
    fibres: Option<[f64; 2]>,
}

impl Law {
    pub(super) fn new(sheet: &ElasticSheet, orthotropy: Option<&Orthotropy>) -> Self {
        Self { poisson: sheet.poisson, fibres: orthotropy.map(|fibres| [fibres.across, fibres.shear]) }
    }

    /// C of a unit thickness for (ε₁₁, ε₂₂, 2ε₁₂), with the first axis along the triangle's first side. `along` is the direction of E₁.
    pub(super) fn stress(&self, young: f64, along: &Vec3, [a, b, c]: &[Vec3; 3]) -> Matrix3<f64> {
        let Some(fibres) = self.fibres else { return plane_stress(young, self.poisson) };
        let first = (b - a).normalize();
        let second = (b - a).cross(&(c - a)).normalize().cross(&first);
        turned(&self.along(young, fibres), along.dot(&first), along.dot(&second))
    }

    /// What resists bending about an edge alone, per h³/12.
    pub(super) fn about(&self, plate: &Plate, edge: &Vec3) -> f64 {
        let Some(fibres) = self.fibres else { return plate.young / (1.0 - self.poisson * self.poisson) };
        let sine = plate.along.dot(edge) / edge.norm();
        turned(&self.along(plate.young, fibres), (1.0 - sine * sine).max(0.0).sqrt(), sine)[(0, 0)]
    }

    /// C with the first axis along the fibres.
    fn along(&self, young: f64, [across, shear]: [f64; 2]) -> Matrix3<f64> {
        let left = 1.0 - self.poisson * self.poisson * across;
        let coupling = self.poisson * across;
        Matrix3::new(1.0, coupling, 0.0, coupling, across, 0.0, 0.0, 0.0, shear * left) * (young / left)
    }
}

/// C in axes of which the first has the fibres at the angle of this cosine and sine.
fn turned(c: &Matrix3<f64>, cos: f64, sin: f64) -> Matrix3<f64> {
    let norm = libm::hypot(cos, sin);
    let (cos, sin) = (cos / norm, sin / norm);
    let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
    let strain = Matrix3::new(cc, ss, cs, ss, cc, -cs, -2.0 * cs, 2.0 * cs, cc - ss);
    let turned = strain.transpose() * c * strain;
    0.5 * (turned + turned.transpose())
}

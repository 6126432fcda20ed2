//! What a shell's own weight does to it to first order, by which lengths in a wrong unit show.
//!
//! A sheet of the rigidity D and the weight w an area bends within the length ℓ = (D/w)^⅓: a strip of the length L that is clamped at one end
//! turns there by L³/(6 ℓ³) to first order. Films of 10 to 20 µm have an ℓ of about a centimetre, cloth 1 to 4 cm, card 20 cm.

use super::Model;
use crate::Vec3;
use crate::material::Elasticity;

/// Of the Earth, m/s².
pub const EARTH: f64 = 9.80665;
/// Of the size: a shell that moves less under its own weight is stiffer than anything thin, or in another unit than was told.
const UNMOVED: f64 = 1e-5;
/// Radians to first order from which a shell counts as limp, and the length in metres within which no film bends by its weight.
const LIMP: f64 = 6.0;
const SOFTEST: f64 = 3e-3;

/// The most that weight along x, y or z does to first order, as far as the modes tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnWeight {
    /// Metres in the mesh's unit of length.
    pub metres_per_unit: f64,
    /// The Earth's gravity in that unit.
    pub gravity: f64,
    /// Of any vertex, in sizes of the mesh.
    pub moves: f64,
    /// Of any vertex, rad; 0 of a model for linear modes alone.
    pub turns: f64,
    /// Of the mesh, metres.
    size: f64,
    /// It falls or swings freely, so that it bends by its weight in part or not at all.
    freely: bool,
    /// It is of engineering units, so that a modulus or a density may be in a wrong one, too.
    sheet: bool,
}

impl OwnWeight {
    /// On a model whose unit has a length that is positive.
    pub fn of(model: &Model, metres_per_unit: f64) -> Self {
        let modal = &model.modal;
        let gravity = EARTH / metres_per_unit;
        let factors = modal.participation().factors();
        let (mut moves, mut turns) = (0.0f64, 0.0f64);
        for axis in 0..3 {
            let swings = modal.zero_modes..modal.n_modes();
            let q: Vec<(usize, f64)> = swings.map(|k| (k, gravity * factors[k][axis] / modal.eigenvalues[k])).collect();
            for v in &model.shell.free {
                let (mut u, mut w) = (Vec3::zeros(), Vec3::zeros());
                for (k, q) in &q {
                    let (phi, psi) = modal.mode_at(*k, *v as usize);
                    u += *q * phi;
                    w += *q * psi;
                }
                (moves, turns) = (moves.max(u.norm()), turns.max(w.norm()));
            }
        }
        let told = |x: f64| x.min(f64::MAX);
        let (moves, size) = (told(moves / model.shell.mesh.size), model.shell.mesh.size * metres_per_unit);
        Self {
            metres_per_unit,
            gravity,
            moves,
            turns: if modal.is_linear() { 0.0 } else { told(turns) },
            size,
            freely: modal.zero_modes > 0,
            sheet: matches!(model.shell.material, Elasticity::Koiter(_)),
        }
    }

    /// What it says against the unit, if anything.
    pub fn doubt(&self) -> Option<String> {
        let Self { metres_per_unit, moves, turns, size, freely, .. } = *self;
        let within = size / libm::cbrt(6.0 * turns);
        let unit =
            format!("the mesh is {size:.2e} m wide by metres_per_unit {metres_per_unit:?}{}", self.units_of_a_sheet());
        if moves > 0.0 && moves < UNMOVED && !freely {
            return Some(format!(
                "its own weight moves the shell by {moves:.1e} of its size at most: are lengths in metres? {unit}"
            ));
        }
        (turns > LIMP && within < SOFTEST).then(|| {
            format!("its own weight turns the shell by {turns:.1e} rad to first order, so that it bends within {within:.1e} m: softer than a film. {unit}")
        })
    }

    fn units_of_a_sheet(&self) -> &'static str {
        match (self.sheet, self.metres_per_unit == 1.0) {
            (false, _) => "",
            (true, true) => "; young is in Pa and volume_density in kg/m^3",
            (true, false) => "; young is in Pa times metres_per_unit, volume_density in kg/m^3 times its cube",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubt(size: f64, moves: f64, turns: f64) -> Option<String> {
        OwnWeight { metres_per_unit: 1.0, gravity: EARTH, moves, turns, size, freely: false, sheet: false }.doubt()
    }

    /// Turns by L³/(6 ℓ³) of a metre of cloth (ℓ = 2 cm), of a plastic bag (1 cm) and of a leaf of 10 cm that is 10 m wide by a mistake.
    #[test]
    fn what_is_soft_for_its_size_is_told_from_what_nothing_is_as_soft_as() {
        let turns = |size: f64, within: f64| (size / within).powi(3) / 6.0;
        assert_eq!(doubt(1.0, 0.5, turns(1.0, 0.02)), None);
        assert_eq!(doubt(1.0, 0.5, turns(1.0, 0.01)), None);
        assert!(doubt(1.0, 0.5, turns(1.0, 0.002)).unwrap().contains("softer than a film"));
        assert!(doubt(0.1, 8e-6, 1e-5).unwrap().contains("are lengths in metres"));
        assert_eq!(doubt(0.1, 2e-5, 1e-5), None);
        assert_eq!(doubt(0.1, 0.0, 0.0), None, "nothing swings: nothing is known");
        let falling = OwnWeight {
            metres_per_unit: 1.0,
            gravity: EARTH,
            moves: 1e-12,
            turns: 0.0,
            size: 0.1,
            freely: true,
            sheet: true,
        };
        assert_eq!(falling.doubt(), None, "what falls is not bent");
        let stiff = OwnWeight { freely: false, ..falling };
        assert!(stiff.doubt().unwrap().ends_with("; young is in Pa and volume_density in kg/m^3"));
        assert!(OwnWeight { metres_per_unit: 0.01, ..stiff }.doubt().unwrap().contains("Pa times metres_per_unit"));
        assert!(!OwnWeight { sheet: false, ..stiff }.doubt().unwrap().contains("young"));
    }
}

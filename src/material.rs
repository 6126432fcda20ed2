//! Material constants of the discrete-shell energies.

use crate::error::{Error, Result, require_non_negative};

/// Stiffnesses and density, uniform over a shell.
///
/// The membrane terms weigh *per length of edge* and *per area*, as in the paper, so their continuum stiffness depends on
/// the mesh: a near-equilateral mesh of edge length l has the membrane stiffness E·h ≈ 4 k_length / (√3 l). Bending does
/// not: its plate rigidity is D = 6 k_bend with an effective Poisson ratio of −1/3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// k_A of E_A = Σ (A − Ā)²/Ā, energy per area.
    pub k_area: f64,
    /// k_L of E_L = Σ (l − l̄)²/l̄, energy per length.
    pub k_length: f64,
    /// k_B of E_B = Σ 3 (θ − θ̄)² l̄/h̄, energy.
    pub k_bend: f64,
    /// Mass per area.
    pub area_density: f64,
}

impl Default for Material {
    /// The constants of the reference beams.
    fn default() -> Self {
        Self { k_area: 1e4, k_length: 1e4, k_bend: 1.0, area_density: 1.0 }
    }
}

impl Material {
    /// Every stiffness finite and not negative, density finite and positive.
    pub fn validated(self) -> Result<Self> {
        require_non_negative("k_area", self.k_area)?;
        require_non_negative("k_length", self.k_length)?;
        require_non_negative("k_bend", self.k_bend)?;
        require_non_negative("area_density", self.area_density)?;
        if self.k_area == 0.0 && self.k_length == 0.0 && self.k_bend == 0.0 {
            return Err(Error::argument("k_area, k_length and k_bend are all 0: nothing would resist anything"));
        }
        if self.area_density < f64::MIN_POSITIVE {
            return Err(Error::argument(format!("area_density is {:?}: it must be positive", self.area_density)));
        }
        Ok(self)
    }
}

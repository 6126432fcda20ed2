//! Material constants: of the paper's energy, and of Koiter's in engineering units.

mod creases;
mod maps;
mod metric;
mod orthotropy;
mod presets;
mod ties;

pub use creases::{Crease, Creases};
pub use maps::{Factors, Map, Maps, On, Quantity, mean, mean_cube};
pub use metric::{Metric, RestLength, lay_out, sides, unfolded};
pub use orthotropy::{Fibres, Orthotropy};
pub use presets::{PRESETS, Preset};
pub use ties::{Bond, Tie, TiedTo, bonds, joined, touching};

use crate::error::{Error, Result, require_finite, require_non_negative};

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

/// An isotropic elastic sheet in engineering units, uniform over a shell. The same on every mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticSheet {
    /// Young's modulus E, force per area.
    pub young: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Thickness h, length.
    pub thickness: f64,
    /// Mass per volume ρ.
    pub volume_density: f64,
}

impl ElasticSheet {
    /// Modulus, thickness and density positive, −1 < ν ≤ 0.5, and what follows from them within the floating-point range.
    pub fn validated(self) -> Result<Self> {
        let Self { young, poisson, thickness, volume_density } = self;
        for (name, value) in [("young", young), ("thickness", thickness), ("volume_density", volume_density)] {
            if require_non_negative(name, value)? == 0.0 {
                return Err(Error::argument(format!("{name} is {value:?}: it must be positive")));
            }
        }
        if !(require_finite("poisson", poisson)? > -1.0 && poisson <= 0.5) {
            return Err(Error::argument(format!("poisson is {poisson:?}: it must be above -1 and at most 0.5")));
        }
        let [membrane, bending] = self.stiffness();
        for (name, value) in [("stretching", membrane), ("bending", bending), ("mass per area", self.area_density())] {
            if !value.is_normal() {
                let message = format!(
                    "the {name} of young {young:?}, poisson {poisson:?}, thickness {thickness:?} and volume_density {volume_density:?} is {value:?}: outside the floating-point range"
                );
                return Err(Error::argument(message));
            }
        }
        Ok(self)
    }

    /// E h/(1 − ν²), force per length, and the plate rigidity E h³/(12 (1 − ν²)), moment.
    pub fn stiffness(&self) -> [f64; 2] {
        let Self { young, poisson, thickness, .. } = *self;
        let membrane = young * thickness / ((1.0 - poisson) * (1.0 + poisson));
        [membrane, membrane * thickness * thickness / 12.0]
    }

    /// Mass per area.
    pub fn area_density(&self) -> f64 {
        self.volume_density * self.thickness
    }
}

/// What a shell is made of, and with it the energy of its deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Elasticity {
    /// The paper's energy.
    DiscreteShells(Material),
    /// Koiter's energy.
    Koiter(ElasticSheet),
}

impl Elasticity {
    /// Fails with the constant that is out of range.
    pub fn validated(self) -> Result<Self> {
        Ok(match self {
            Self::DiscreteShells(material) => Self::DiscreteShells(material.validated()?),
            Self::Koiter(sheet) => Self::Koiter(sheet.validated()?),
        })
    }

    /// Mass per area.
    pub fn area_density(&self) -> f64 {
        match self {
            Self::DiscreteShells(material) => material.area_density,
            Self::Koiter(sheet) => sheet.area_density(),
        }
    }

    /// Whether stretching and bending both are resisted, so that no motion but a rigid one is free.
    pub fn resists_all(&self) -> bool {
        match self {
            Self::DiscreteShells(material) => material.k_bend != 0.0 && material.k_length != 0.0,
            Self::Koiter(_) => true,
        }
    }

    /// Whether an edge and its triangles tell every element that moves a vertex of theirs.
    pub fn is_told_by_pieces(&self) -> bool {
        matches!(self, Self::DiscreteShells(_))
    }

    /// Constants of the paper's energy, if it is that.
    pub fn discrete_shells(&self) -> Option<&Material> {
        match self {
            Self::DiscreteShells(material) => Some(material),
            Self::Koiter(_) => None,
        }
    }
}

impl From<Material> for Elasticity {
    fn from(material: Material) -> Self {
        Self::DiscreteShells(material)
    }
}

impl From<ElasticSheet> for Elasticity {
    fn from(sheet: ElasticSheet) -> Self {
        Self::Koiter(sheet)
    }
}

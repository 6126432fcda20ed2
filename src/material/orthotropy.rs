//! Orthotropy: sheets that are stiffer along a direction than across it, such as paper, weaves and wood.

use super::{ElasticSheet, Metric};
use crate::error::{Error, Result, require_finite};
use crate::{Mesh, Vec3};

/// The least share of a direction that must lie in its triangle.
const IN_PLANE: f64 = 1e-3;

/// The largest ratio of two moduli.
const MOST: f64 = 1e8;
/// What must be left of 1 − ν₁₂² E₂/E₁.
const LEAST: f64 = 1e-6;

/// What a host says of it.
#[derive(Clone, Debug)]
pub struct Fibres {
    /// E₂/E₁: E₁ is the sheet's, along the direction, and its Poisson's ratio is ν₁₂, what stretching along takes away across.
    pub across: f64,
    /// G₁₂/E₁; 0 is Huber's estimate √(E₂/E₁)/(2 (1 + ν₁₂ √(E₂/E₁))).
    pub shear: f64,
    /// The direction of E₁, any length and either sign, at the mesh: one for all triangles, or one each.
    pub directions: Vec<Vec3>,
}

/// The same, checked for a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Orthotropy {
    /// E₂/E₁.
    pub across: f64,
    /// G₁₂/E₁.
    pub shear: f64,
    /// As given.
    pub given: Vec<Vec3>,
    /// Unit vectors in the triangles of the shape without stress (n_triangles).
    pub along: Vec<Vec3>,
}

impl Fibres {
    /// What is wrong with the moduli, if anything is: the law must resist every strain.
    pub fn check(&self, sheet: &ElasticSheet) -> Result<()> {
        let Self { across, shear, .. } = *self;
        for (name, value) in [("young_across", across), ("shear", shear)] {
            let estimated = name == "shear" && value == 0.0;
            if !(estimated || (1.0 / MOST..=MOST).contains(&value)) {
                let message =
                    format!("{name} is {value:?} of young: it must be from {:e} to {MOST:e} of it", 1.0 / MOST);
                return Err(Error::argument(message));
            }
        }
        let poisson = require_finite("poisson", sheet.poisson)?;
        let most = (1.0 / across.sqrt()).min(1.0);
        if poisson.abs() >= most || poisson * poisson * across > 1.0 - LEAST {
            let message = format!(
                "poisson is {poisson:?}, but with young_across {across:?} of young it must be between -{most:?} and {most:?}: \
                beyond, the sheet would stretch by itself, or its direction should be the other one"
            );
            return Err(Error::argument(message));
        }
        Ok(())
    }

    /// By the triangles of `mesh`, which without stress are those of `unstressed`; none where it is an isotropic sheet.
    pub fn checked(
        self,
        sheet: &ElasticSheet,
        mesh: &Mesh,
        (unstressed, metric): (&Mesh, Option<&Metric>),
    ) -> Result<Option<Orthotropy>> {
        let Self { across, shear, directions: given } = self;
        let (n, root) = (mesh.triangles.len(), across.sqrt());
        if given.len() != 1 && given.len() != n {
            let message =
                format!("there are {} directions: give one, or one for each of the {n} triangles", given.len());
            return Err(Error::argument(message));
        }
        let shape = |t: usize| metric.map_or_else(|| corners(unstressed, t), |metric| metric.corners[t]);
        let of = |t: usize| carried(t, *given.get(t).unwrap_or(&given[0]), corners(mesh, t), shape(t));
        let along = (0..n).map(of).collect::<Result<Vec<Vec3>>>()?;
        let isotropic = 0.5 / (1.0 + sheet.poisson);
        let shear = if shear == 0.0 { 0.5 * root / (1.0 + sheet.poisson * root) } else { shear };
        // A modulus over another is rounded.
        if across == 1.0 && (shear / isotropic - 1.0).abs() <= 4.0 * f64::EPSILON {
            return Ok(None);
        }
        Ok(Some(Orthotropy { across, shear, given, along }))
    }
}

impl Orthotropy {
    /// What a host would say of it.
    pub fn fibres(&self) -> Fibres {
        Fibres { across: self.across, shear: self.shear, directions: self.given.clone() }
    }

    /// The same with directions carried from the triangles of `mesh` to those of `shape`.
    pub fn carried(&self, mesh: &Mesh, shape: &Mesh) -> Result<Self> {
        let along =
            self.along.iter().enumerate().map(|(t, along)| carried(t, *along, corners(mesh, t), corners(shape, t)));
        Ok(Self { given: self.given.clone(), along: along.collect::<Result<_>>()?, ..*self })
    }

    /// That of some triangles alone.
    pub fn part(&self, triangles: &[u32]) -> Self {
        let along: Vec<Vec3> = triangles.iter().map(|t| self.along[*t as usize]).collect();
        Self { given: along.clone(), along, ..*self }
    }
}

fn corners(mesh: &Mesh, t: usize) -> [Vec3; 3] {
    mesh.triangles[t].map(|v| mesh.positions[v as usize])
}

/// The direction at triangle `t`, in the triangle, and carried with its sides to the shape without stress.
fn carried(t: usize, direction: Vec3, there: [Vec3; 3], unstressed: [Vec3; 3]) -> Result<Vec3> {
    let sides = |[a, b, c]: [Vec3; 3]| [b - a, c - a];
    let refused = |what: &str| {
        let [x, y, z] = direction.data.0[0];
        Err(Error::argument(format!("the direction ({x}, {y}, {z}) at triangle {t} {what}")))
    };
    let largest = direction.amax();
    if !(largest.is_finite() && largest > 0.0) {
        return refused("is none: it must be finite and not zero");
    }
    let direction = (direction / largest).normalize();
    let [u, v] = sides(there);
    let normal = u.cross(&v);
    let (d, area) = (direction - normal * (direction.dot(&normal) / normal.norm_squared()), normal.norm_squared());
    if d.norm().is_nan() || d.norm() < IN_PLANE {
        return refused("is across the triangle: it must lie in it");
    }
    let (along_u, along_v) = (d.cross(&v).dot(&normal) / area, u.cross(&d).dot(&normal) / area);
    let [u, v] = sides(unstressed);
    let carried = (along_u * u + along_v * v).normalize();
    if carried.iter().all(|x| x.is_finite()) { Ok(carried) } else { refused("leaves the floating-point range") }
}

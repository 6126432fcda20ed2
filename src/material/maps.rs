//! What varies over a shell: a constant's values per vertex or per triangle, in place of the uniform one.
//!
//! A triangle has the mean of its vertices' values, and an edge that of its ends or its triangles; equal values stay the same bits. Bending goes by the mean of h³
//! over the triangle, of an h that is linear there.

use super::Elasticity;
use crate::Mesh;
use crate::error::{Error, Result};
use std::collections::HashMap;

/// A constant of a material. The numbers are those of the interface and of saved models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Quantity {
    /// k_A.
    KArea = 1,
    /// k_L.
    KLength = 2,
    /// k_B.
    KBend = 3,
    /// Mass per area.
    AreaDensity = 4,
    /// E.
    Young = 5,
    /// h.
    Thickness = 6,
    /// ρ.
    VolumeDensity = 7,
    /// Length without stress over that of the mesh or the rest shape: of no energy's constants, see [`super::Metric`].
    Growth = 8,
}

impl Quantity {
    /// All, by number.
    pub const ALL: [Self; 8] = [
        Self::KArea,
        Self::KLength,
        Self::KBend,
        Self::AreaDensity,
        Self::Young,
        Self::Thickness,
        Self::VolumeDensity,
        Self::Growth,
    ];

    /// Its field's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::KArea => "k_area",
            Self::KLength => "k_length",
            Self::KBend => "k_bend",
            Self::AreaDensity => "area_density",
            Self::Young => "young",
            Self::Thickness => "thickness",
            Self::VolumeDensity => "volume_density",
            Self::Growth => "growth",
        }
    }

    /// The constant in a material; none of the other energy's.
    pub fn of(self, material: &mut Elasticity) -> Option<&mut f64> {
        match (material, self) {
            (Elasticity::DiscreteShells(m), Self::KArea) => Some(&mut m.k_area),
            (Elasticity::DiscreteShells(m), Self::KLength) => Some(&mut m.k_length),
            (Elasticity::DiscreteShells(m), Self::KBend) => Some(&mut m.k_bend),
            (Elasticity::DiscreteShells(m), Self::AreaDensity) => Some(&mut m.area_density),
            (Elasticity::Koiter(m), Self::Young) => Some(&mut m.young),
            (Elasticity::Koiter(m), Self::Thickness) => Some(&mut m.thickness),
            (Elasticity::Koiter(m), Self::VolumeDensity) => Some(&mut m.volume_density),
            _ => None,
        }
    }
}

/// What the values of a map belong to. The numbers are those of the interface and of saved models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum On {
    /// One value a vertex.
    Vertices = 1,
    /// One value a triangle.
    Triangles = 2,
}

/// What a triangle's stiffness and mass are multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Of the stiffness against stretching.
    pub stretching: f64,
    /// Of the stiffness against bending.
    pub bending: f64,
    /// Of the mass.
    pub mass: f64,
}

impl Factors {
    /// None.
    pub const ONE: Self = Self { stretching: 1.0, bending: 1.0, mass: 1.0 };
}

/// Values of one constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Which constant.
    pub quantity: Quantity,
    /// What the values belong to.
    pub on: On,
    /// As many as there are of these.
    pub values: Vec<f64>,
}

impl Map {
    /// Fails unless there are as many values as the mesh has vertices or triangles, each finite and positive.
    pub fn check(&self, mesh: &Mesh) -> Result<()> {
        let Self { quantity, on, values } = self;
        let name = quantity.name();
        let (wanted, kind) = match on {
            On::Vertices => (mesh.positions.len(), "vertices"),
            On::Triangles => (mesh.triangles.len(), "triangles"),
        };
        if values.len() != wanted {
            let message = format!("the map of {name} has {} values, but the mesh has {wanted} {kind}", values.len());
            return Err(Error::argument(message));
        }
        if let Some(i) = values.iter().position(|x| !(x.is_finite() && *x > 0.0)) {
            let message = format!("value {i} of the map of {name} is {:?}: it must be positive", values[i]);
            return Err(Error::argument(message));
        }
        Ok(())
    }

    /// Values by edge.
    pub fn by_edge(&self, mesh: &Mesh) -> Vec<f64> {
        if self.on == On::Vertices {
            return mesh.edges.iter().map(|e| mean(e.vertices.map(|v| self.values[v as usize]))).collect();
        }
        let mut sides: HashMap<[u32; 2], Vec<f64>> = HashMap::new();
        for (t, value) in mesh.triangles.iter().zip(&self.values) {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                sides.entry([a.min(b), a.max(b)]).or_default().push(*value);
            }
        }
        let of = |[a, b]: [u32; 2]| match sides[&[a.min(b), a.max(b)]][..] {
            [one] => one,
            [one, other, ..] => mean([one, other]),
            [] => f64::NAN,
        };
        mesh.edges.iter().map(|e| of(e.vertices)).collect()
    }
}

/// The maps of a material, at most one a constant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Maps(Vec<Map>);

impl Maps {
    /// Checks them for a mesh and a material: lengths, and every value finite and positive. With the material whose mapped constants are
    /// the largest values.
    pub fn new(maps: Vec<Map>, mesh: &Mesh, mut material: Elasticity) -> Result<(Self, Elasticity)> {
        let mut smallest = material;
        for (k, Map { quantity, values, .. }) in maps.iter().enumerate() {
            let name = quantity.name();
            if maps[..k].iter().any(|other| other.quantity == *quantity) {
                return Err(Error::argument(format!("there are two maps of {name}")));
            }
            maps[k].check(mesh)?;
            let of_the_other = || Error::argument(format!("there is a map of {name}, which the energy does not have"));
            let (low, high) = values.iter().fold((f64::MAX, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
            *quantity.of(&mut material).ok_or_else(of_the_other)? = high;
            *quantity.of(&mut smallest).ok_or_else(of_the_other)? = low;
        }
        if !maps.is_empty() {
            smallest.validated()?;
        }
        Ok((Self(maps), material))
    }

    /// None at all.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All, in their order.
    pub fn all(&self) -> &[Map] {
        &self.0
    }

    /// A constant's map.
    pub fn of(&self, quantity: Quantity) -> Option<&Map> {
        self.0.iter().find(|map| map.quantity == quantity)
    }

    /// Values of a constant by triangle; none where it is uniform.
    pub fn by_triangle(&self, quantity: Quantity, mesh: &Mesh) -> Option<Vec<f64>> {
        self.of(quantity).map(|map| match map.on {
            On::Triangles => map.values.clone(),
            On::Vertices => mesh.triangles.iter().map(|t| mean(t.map(|v| map.values[v as usize]))).collect(),
        })
    }

    /// Values of a constant by edge; none where it is uniform.
    pub fn by_edge(&self, quantity: Quantity, mesh: &Mesh) -> Option<Vec<f64>> {
        self.of(quantity).map(|map| map.by_edge(mesh))
    }

    /// Mass per area of each triangle; none where it is uniform.
    pub fn area_density(&self, mesh: &Mesh, material: &Elasticity) -> Option<Vec<f64>> {
        match material {
            Elasticity::DiscreteShells(_) => self.by_triangle(Quantity::AreaDensity, mesh),
            Elasticity::Koiter(sheet) => {
                let [density, thickness] =
                    [Quantity::VolumeDensity, Quantity::Thickness].map(|quantity| self.by_triangle(quantity, mesh));
                if density.is_none() && thickness.is_none() {
                    return None;
                }
                let of = |values: &Option<Vec<f64>>, t: usize, uniform| values.as_ref().map_or(uniform, |v| v[t]);
                let product = |t| of(&density, t, sheet.volume_density) * of(&thickness, t, sheet.thickness);
                Some((0..mesh.triangles.len()).map(product).collect())
            }
        }
    }

    /// The same with stiffnesses and masses of the triangles multiplied, all by maps of triangles. A sheet that resists bending more and stretching as
    /// before is a thicker one of a lower modulus and density.
    pub fn times(&self, factors: &[Factors], mesh: &Mesh, material: Elasticity) -> Result<(Self, Elasticity)> {
        let triangles = 0..mesh.triangles.len();
        let on_triangles = |quantity, values| Map { quantity, on: On::Triangles, values };
        let value = |quantity: Quantity| -> Box<dyn Fn(usize) -> f64> {
            let uniform = quantity.of(&mut { material }).map_or(0.0, |constant| *constant);
            match self.by_triangle(quantity, mesh) {
                Some(values) => Box::new(move |t| values[t]),
                None => Box::new(move |_| uniform),
            }
        };
        let maps = if let Elasticity::Koiter(sheet) = material {
            let [young, density] = [Quantity::Young, Quantity::VolumeDensity].map(value);
            let heights = |t: usize| match self.of(Quantity::Thickness) {
                None => [sheet.thickness; 3],
                Some(map) if map.on == On::Triangles => [map.values[t]; 3],
                Some(map) => mesh.triangles[t].map(|v| map.values[v as usize]),
            };
            // E h and E h³ are what they were, times their factors.
            let made = |t: usize| {
                let (h, Factors { stretching, bending, mass }) = (heights(t), factors[t]);
                let thickness = (mean_cube(h) / mean(h) * bending / stretching).sqrt();
                let share = mean(h) / thickness;
                [young(t) * share * stretching, thickness, density(t) * share * mass]
            };
            let made: Vec<[f64; 3]> = triangles.map(made).collect();
            let quantities = [Quantity::Young, Quantity::Thickness, Quantity::VolumeDensity];
            let map = |(i, quantity)| on_triangles(quantity, made.iter().map(|values| values[i]).collect());
            quantities.into_iter().enumerate().map(map).collect()
        } else {
            let map = |quantity: Quantity, factor: fn(&Factors) -> f64| {
                let old = value(quantity);
                on_triangles(quantity, triangles.clone().map(|t| old(t) * factor(&factors[t])).collect())
            };
            let mut maps = vec![
                map(Quantity::KArea, |f| f.stretching),
                map(Quantity::KLength, |f| f.stretching),
                map(Quantity::KBend, |f| f.bending),
                map(Quantity::AreaDensity, |f| f.mass),
            ];
            maps.retain(|map| map.values.iter().any(|x| *x != 0.0)); // what is not resisted has no map
            maps
        };
        Self::new(maps, mesh, material)
    }

    /// Those of some vertices and triangles alone.
    pub fn part(&self, vertices: &[u32], triangles: &[u32]) -> Self {
        let part = |map: &Map| {
            let some = match map.on {
                On::Vertices => vertices,
                On::Triangles => triangles,
            };
            Map { values: some.iter().map(|i| map.values[*i as usize]).collect(), ..*map }
        };
        Self(self.0.iter().map(part).collect())
    }
}

/// The mean; of equal values the value itself.
pub fn mean<const N: usize>(values: [f64; N]) -> f64 {
    match values.iter().all(|x| *x == values[0]) {
        true => values[0],
        false => values.iter().sum::<f64>() / N as f64,
    }
}

/// The mean of h³ over a triangle of a linear h; of equal values the cube itself.
pub fn mean_cube(h: [f64; 3]) -> f64 {
    let [a, b, c] = h;
    match a == b && b == c {
        true => a.powi(3),
        false => {
            let squares = a * a + b * b + c * c;
            (a * b * c + (a + b + c) * squares) / 10.0
        }
    }
}

//! The physical problem: a mesh of a material, held at its supports.

use crate::energy::{Energy, of_material};
use crate::material::{Elasticity, Map, Maps};
use crate::{Error, ErrorKind, Mesh, Result, Supports, Vec3};
use std::ops::Deref;
use std::sync::{Arc, LazyLock};

/// An energy that is made when it is first asked for: of a loaded model whose states all move by modes, never.
#[derive(Clone)]
pub struct LazyEnergy(Arc<LazyLock<Box<dyn Energy>, MakeEnergy>>);

type MakeEnergy = Box<dyn FnOnce() -> Box<dyn Energy> + Send + Sync>;

impl LazyEnergy {
    fn new(make: impl FnOnce() -> Box<dyn Energy> + Send + Sync + 'static) -> Self {
        Self(Arc::new(LazyLock::new(Box::new(make))))
    }
}

impl Deref for LazyEnergy {
    type Target = dyn Energy;

    fn deref(&self) -> &Self::Target {
        &***self.0
    }
}

/// No shell hangs further from its rest shape than this, in model sizes; squares and energies of it are finite.
const FURTHEST_SAG: f64 = 1e30;

/// Mesh, material and supports with what follows from them directly. Immutable.
pub struct Shell {
    /// Rest geometry; with `sag`, the shape that hangs.
    pub mesh: Arc<Mesh>,
    /// Constants, and which energy.
    pub material: Elasticity,
    /// What varies over the shell; the material has the largest values of it.
    pub maps: Arc<Maps>,
    /// The deformation energy.
    pub energy: LazyEnergy,
    /// How it hangs at the mesh's positions; `None` where these are the shape of no energy.
    pub sag: Option<Sag>,
    /// Lumped area where mass per area varies (n_vertices), or none.
    areas: Arc<[f64]>,
    /// Lumped mass: a third of each incident triangle's rest area times the density; 0 if unreferenced (n_vertices).
    pub mass: Vec<f64>,
    /// Held by a support (n_vertices).
    pub held: Vec<bool>,
    /// Ends of edges whose slope is held (n_vertices); empty where no edge's is.
    pub clamped: Arc<[bool]>,
    /// The vertices that move, ascending: referenced and not held. Each has three unknowns.
    pub free: Vec<u32>,
    /// Sum of the triangles' rest areas.
    pub total_area: f64,
    /// Σ m over all vertices, held ones included.
    pub total_mass: f64,
}

/// A shell whose mesh is where it hangs at rest.
pub struct Sag {
    /// Gravity (frame axes) whose weight the elastic forces balance there.
    pub gravity: Vec3,
    /// The shape of no energy (n_vertices).
    pub rest: Vec<Vec3>,
}

impl Shell {
    /// Checks everything and assembles masses. Fails when a mass or an area leaves the floating-point range.
    pub fn new(mesh: Mesh, material: impl Into<Elasticity>, supports: &Supports) -> Result<Self> {
        Self::mapped(mesh, material, vec![], supports)
    }

    /// The same with maps in place of some constants of the material.
    pub fn mapped(mesh: Mesh, material: impl Into<Elasticity>, maps: Vec<Map>, supports: &Supports) -> Result<Self> {
        let (maps, material) = Maps::new(maps, &mesh, material.into())?;
        let (maps, material) = (Arc::new(maps), material.validated()?);
        let (held, clamped) = match material {
            Elasticity::DiscreteShells(_) => (supports.held(&mesh)?, vec![]),
            Elasticity::Koiter(_) => supports.held_exactly(&mesh)?,
        };
        if !mesh.size.is_finite() {
            return Err(Error::new(
                ErrorKind::Numerical,
                "the mesh is wider than the floating-point range: choose other units",
            ));
        }
        let densities = maps.area_density(&mesh, &material);
        let uniform = material.area_density();
        let (mass, total_area) = lumped_mass(&mesh, |t| densities.as_ref().map_or(uniform, |of| of[t]))?;
        let areas = if densities.is_some() { lumped_mass(&mesh, |_| 1.0)?.0 } else { vec![] };
        let free = (0..mass.len() as u32).filter(|&v| mass[v as usize] > 0.0 && !held[v as usize]).collect();
        let mesh = Arc::new(mesh);
        let clamped: Arc<[bool]> = clamped.into();
        let energy = energy_of(&mesh, material, &maps, &clamped);
        let areas = areas.into();
        let total_mass: f64 = mass.iter().sum();
        if !(total_mass.is_finite() && total_area.is_finite()) {
            return Err(Error::new(ErrorKind::Numerical, "the shell's mass or area is not finite: choose other units"));
        }
        let sag = None;
        Ok(Self { mesh, material, maps, energy, sag, areas, mass, held, clamped, free, total_area, total_mass })
    }

    /// A vertex's share of the area at rest.
    pub fn area_of(&self, v: usize) -> f64 {
        match self.areas.get(v) {
            Some(area) => *area,
            None => self.mass[v] / self.material.area_density(),
        }
    }

    /// Whether an edge and its triangles tell every element that moves a vertex of theirs.
    pub(crate) fn is_told_by_pieces(&self) -> bool {
        self.material.is_told_by_pieces() && self.maps.is_empty()
    }

    /// The first vertex that would hang further from rest than any shell hangs, or at no number.
    pub(crate) fn stray(&self, positions: &[Vec3]) -> Option<usize> {
        let furthest = FURTHEST_SAG * self.mesh.size;
        let stray = |(x, rest): (&Vec3, &Vec3)| !(x - rest).iter().all(|d| d.abs() <= furthest);
        positions.iter().zip(&self.mesh.positions).position(stray)
    }

    /// The same shell with its mesh at `positions` (n_vertices), where the elastic forces balance its weight under `gravity`.
    pub(crate) fn hung(&self, gravity: Vec3, positions: Vec<Vec3>) -> Self {
        let mut mesh = Mesh::clone(&self.mesh);
        let rest = std::mem::replace(&mut mesh.positions, positions);
        Self {
            mesh: Arc::new(mesh),
            material: self.material,
            maps: self.maps.clone(),
            areas: self.areas.clone(),
            energy: self.energy.clone(),
            sag: Some(Sag { gravity, rest }),
            mass: self.mass.clone(),
            held: self.held.clone(),
            clamped: self.clamped.clone(),
            free: self.free.clone(),
            ..*self
        }
    }

    /// The shell of these `vertices` and `triangles` alone, numbered anew in their order, with the triangles and edges of `mesh`, where they are at
    /// rest. Those that `free` does not name are held.
    pub(crate) fn part(&self, (vertices, triangles): (&[u32], &[u32]), mesh: Mesh, free: Vec<u32>) -> Self {
        let mut held = vec![true; vertices.len()];
        free.iter().for_each(|v| held[*v as usize] = false);
        let mesh = Arc::new(mesh);
        let clamped: Arc<[bool]> = match self.clamped.is_empty() {
            true => self.clamped.clone(),
            false => vertices.iter().map(|v| self.clamped[*v as usize]).collect(),
        };
        let maps = Arc::new(self.maps.part(vertices, triangles));
        let some = |v: &u32| self.areas.get(*v as usize).copied();
        let part = Self {
            energy: energy_of(&mesh, self.material, &maps, &clamped),
            mesh,
            maps,
            areas: vertices.iter().filter_map(some).collect(),
            clamped,
            sag: None,
            mass: vertices.iter().map(|v| self.mass[*v as usize]).collect(),
            held,
            free,
            ..*self
        };
        match &self.sag {
            Some(sag) => part.hung(sag.gravity, self.points(vertices)),
            None => part,
        }
    }

    /// Whether the slope is held at an edge of vertex `v`.
    pub fn is_clamped(&self, v: usize) -> bool {
        self.clamped.get(v) == Some(&true)
    }

    /// Number of unknowns: three per free vertex.
    pub fn n_unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// Where these vertices lie.
    pub fn points(&self, vertices: &[u32]) -> Vec<Vec3> {
        vertices.iter().map(|&v| self.mesh.positions[v as usize]).collect()
    }

    /// Spreads values at the free vertices, x y z by turns (n_unknowns), over all vertices; zero elsewhere.
    pub fn scatter(&self, unknowns: &[f64]) -> Vec<Vec3> {
        let mut field = vec![Vec3::zeros(); self.mass.len()];
        for (i, &v) in self.free.iter().enumerate() {
            field[v as usize] = Vec3::new(unknowns[3 * i], unknowns[3 * i + 1], unknowns[3 * i + 2]);
        }
        field
    }
}

fn energy_of(mesh: &Arc<Mesh>, material: Elasticity, maps: &Arc<Maps>, clamped: &Arc<[bool]>) -> LazyEnergy {
    let (rest, maps, clamped) = (mesh.clone(), maps.clone(), clamped.clone());
    LazyEnergy::new(move || Box::new(of_material(&rest, &material, &maps, &clamped)))
}

fn lumped_mass(mesh: &Mesh, density: impl Fn(usize) -> f64) -> Result<(Vec<f64>, f64)> {
    let mut mass = vec![0.0; mesh.positions.len()];
    let mut total_area = 0.0;
    for (t, tri) in mesh.triangles.iter().enumerate() {
        let area = mesh.area(t);
        let share = density(t) * area / 3.0;
        if !(share.is_normal() && area.is_normal()) {
            let message = format!(
                "triangle {t} has area {area:e} and mass {:e}: outside the floating-point range; choose other units",
                3.0 * share
            );
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        total_area += area;
        tri.iter().for_each(|&v| mass[v as usize] += share);
    }
    Ok((mass, total_area))
}

//! The physical problem: a mesh of a material, held at its supports.

use crate::energy::{Energy, Mirror, Source, THIN, Thick, TieEnergy, Yielding, of_material, thick, with_yielding};
use crate::material::{
    Bond, Crease, Creases, ElasticSheet, Elasticity, Factors, Fibres, Map, Maps, Metric, Orthotropy, Quantity,
    RestLength, Tie, bonds, joined, touching,
};
use crate::mesh::NONE;
use crate::sparse::{Analyses, BlockMatrix, Symbolic};
use crate::support::{Pose, Roller};
use crate::{Error, ErrorKind, Mesh, Result, Supports, Vec3};
use faer::sparse::SymbolicSparseColMatRef;
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

/// What a shell is made of beside its mesh.
#[derive(Clone, Debug)]
pub struct Make {
    /// Constants, and which energy.
    pub material: Elasticity,
    /// In place of some of them; and how much edges grew.
    pub maps: Vec<Map>,
    /// Edges of another stiffness or angle.
    pub creases: Vec<Crease>,
    /// The shape without stress (n_vertices), if it is not the mesh's.
    pub rest_shape: Option<Vec<Vec3>>,
    /// Lengths without stress of edges that are not of that shape, or of the mesh.
    pub rest_lengths: Vec<RestLength>,
    /// A direction along which it is of another stiffness.
    pub fibres: Option<Fibres>,
    /// Vertices held together with others.
    pub ties: Vec<Tie>,
    /// What of components touches within this is tied, besides.
    pub tie_distance: f64,
    /// Ties in numbers, besides.
    pub bonds: Vec<Bond>,
    /// Edges on planes of symmetry in numbers, besides.
    pub mirrors: Vec<Mirror>,
}

impl Make {
    /// Of these constants everywhere.
    pub fn of(material: impl Into<Elasticity>) -> Self {
        Self {
            material: material.into(),
            maps: vec![],
            creases: vec![],
            rest_shape: None,
            rest_lengths: vec![],
            fibres: None,
            ties: vec![],
            tie_distance: 0.0,
            bonds: vec![],
            mirrors: vec![],
        }
    }
}

/// Mesh, material and supports with what follows from them directly. Immutable.
pub struct Shell {
    /// Where it rests; with `sag`, the shape that hangs.
    pub mesh: Arc<Mesh>,
    /// Constants, and which energy.
    pub material: Elasticity,
    /// What varies over the shell; the material has the largest values of it.
    pub maps: Arc<Maps>,
    /// Those that change something.
    pub creases: Arc<Creases>,
    /// Of a sheet that is not the same in all directions.
    pub orthotropy: Option<Arc<Orthotropy>>,
    /// What is held together; components that are count as one.
    pub bonds: Arc<[Bond]>,
    /// The shape without stress (n_vertices), if it is not the mesh that was given.
    pub rest_shape: Option<Arc<[Vec3]>>,
    /// Lengths without stress, if they are not those of that shape.
    pub metric: Option<Arc<Metric>>,
    /// The mesh that was given (n_vertices), where that is not at rest and `mesh` was found to be.
    pub settled_from: Option<Arc<[Vec3]>>,
    /// The deformation energy.
    pub energy: LazyEnergy,
    /// How it hangs at the mesh's positions; `None` where it rests there without load.
    pub sag: Option<Sag>,
    /// Lumped area where mass per area varies (n_vertices), or none.
    areas: Arc<[f64]>,
    /// Lumped mass: a third of each incident triangle's rest area times the density; 0 if unreferenced (n_vertices).
    pub mass: Vec<f64>,
    /// Held by a support in all directions (n_vertices).
    pub held: Vec<bool>,
    /// Those of the free vertices that are held along some directions, ascending.
    pub rollers: Arc<[Roller]>,
    /// Ends of edges whose slope is held (n_vertices); empty where no edge's is.
    pub clamped: Arc<[bool]>,
    /// Edges on planes of symmetry, ascending.
    pub mirrors: Arc<[Mirror]>,
    /// The vertices that move, ascending: referenced and not held. Each has three unknowns.
    pub free: Vec<u32>,
    /// Sum of the triangles' rest areas.
    pub total_area: f64,
    /// Σ m over all vertices, held ones included.
    pub total_mass: f64,
    /// Of the stiffness' pattern.
    pub analyses: Arc<Analyses>,
}

/// A shell whose mesh is where it hangs at rest.
pub struct Sag {
    /// Gravity (frame axes) whose weight the elastic forces balance there.
    pub gravity: Vec3,
    /// Where it rests without load (n_vertices).
    pub rest: Vec<Vec3>,
}

impl Shell {
    /// Checks everything and assembles masses. Fails when a mass or an area leaves the floating-point range.
    pub fn new(mesh: Mesh, material: impl Into<Elasticity>, supports: &Supports) -> Result<Self> {
        Self::mapped(mesh, material, vec![], supports)
    }

    /// The same with maps in place of some constants of the material.
    pub fn mapped(mesh: Mesh, material: impl Into<Elasticity>, maps: Vec<Map>, supports: &Supports) -> Result<Self> {
        Self::made(mesh, Make { maps, ..Make::of(material) }, supports)
    }

    /// The same of all that a shell can be made of. One with angles or a rest shape of its own is not at rest yet: see
    /// [`Shell::must_settle`].
    pub fn made(mesh: Mesh, make: Make, supports: &Supports) -> Result<Self> {
        let (poisson, material) = own_poisson(make.material, make.fibres.as_ref())?;
        let (maps, growth) = without_growth(make.maps, &mesh)?;
        let (maps, material) = Maps::new(maps, &mesh, material)?;
        let (maps, material) = (Arc::new(maps), with_poisson(material.validated()?, poisson));
        let creases = Arc::new(Creases::new(&make.creases, &mesh)?);
        let mut ties = make.ties;
        ties.extend(touching(&mesh, make.tie_distance)?);
        let bonds: Arc<[Bond]> = make.bonds.into_iter().chain(bonds(&ties, &mesh)?).collect();
        let mesh = if bonds.is_empty() { mesh } else { joined(mesh, &bonds) };
        let rest_mesh = make.rest_shape.map(|shape| rest_mesh(&mesh, shape)).transpose()?;
        let (mut held, clamped) = match material {
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
        let unstressed = rest_mesh.as_ref().unwrap_or(&mesh);
        let metric = Metric::new(unstressed, growth.as_ref(), &make.rest_lengths)?.map(Arc::new);
        let area = |t: usize| area_of(unstressed, &metric, t);
        let (mass, total_area) = lumped_mass(&mesh, area, |t| densities.as_ref().map_or(uniform, |of| of[t]))?;
        let mirrors: Arc<[Mirror]> = supports.mirrors(&mesh)?.into_iter().chain(make.mirrors).collect();
        if let Some(rest) = &rest_mesh {
            check_mirrors(&mirrors, rest, &mesh)?;
        }
        let mut rollers = supports.rollers(&mesh, &mut held)?;
        rollers.retain(|roller| mass[roller.vertex as usize] > 0.0);
        let areas = if densities.is_some() { lumped_mass(&mesh, area, |_| 1.0)?.0 } else { vec![] };
        let free = (0..mass.len() as u32).filter(|&v| mass[v as usize] > 0.0 && !held[v as usize]).collect();
        let mesh = Arc::new(mesh);
        let clamped: Arc<[bool]> = clamped.into();
        let rest_shape = rest_mesh.as_ref().map(|mesh| Arc::from(&mesh.positions[..]));
        let unstressed = rest_mesh.map_or_else(|| mesh.clone(), Arc::new);
        let orthotropy = match (make.fibres, &material) {
            (Some(fibres), Elasticity::Koiter(sheet)) => {
                fibres.checked(sheet, &mesh, (&unstressed, metric.as_deref()))?.map(Arc::new)
            }
            _ => None,
        };
        let made_of = (material, &maps, &creases, &orthotropy, &bonds);
        let energy = energy_of((unstressed, &metric), made_of, (&clamped, &mirrors, &mesh), None);
        let areas = areas.into();
        let total_mass: f64 = mass.iter().sum();
        if !(total_mass.is_finite() && total_area.is_finite()) {
            return Err(Error::new(ErrorKind::Numerical, "the shell's mass or area is not finite: choose other units"));
        }
        Ok(Self {
            mesh,
            material,
            maps,
            creases,
            orthotropy,
            bonds,
            rest_shape,
            metric,
            settled_from: None,
            energy,
            sag: None,
            areas,
            mass,
            held,
            rollers: rollers.into(),
            clamped,
            mirrors,
            free,
            total_area,
            total_mass,
            analyses: Arc::default(),
        })
    }

    /// Whether its energy pulls at the mesh that was given, and where it rests was not found yet.
    pub fn must_settle(&self) -> bool {
        let own = self.rest_shape.is_some() || self.metric.is_some() || self.creases.have_angles();
        self.settled_from.is_none() && own
    }

    /// Whether it may be under stress at the mesh's positions.
    pub fn is_stressed(&self) -> bool {
        self.settled_from.is_some() || self.sag.is_some()
    }

    /// Where it rests without load (n_vertices).
    pub fn unloaded(&self) -> &[Vec3] {
        self.sag.as_ref().map_or(&self.mesh.positions, |sag| &sag.rest)
    }

    /// The mesh that was given (n_vertices).
    pub fn given(&self) -> &[Vec3] {
        self.settled_from.as_ref().map_or(self.unloaded(), |given| given)
    }

    /// Whether no motion but a rigid one is free of energy, as far as the material tells.
    pub fn resists_all(&self) -> bool {
        self.material.resists_all() && !self.creases.have_hinges() && self.bonds.is_empty()
    }

    /// Where its thickness is beyond a tenth of its radius of curvature without stress. Only a sheet of Koiter's energy has a thickness.
    pub fn thick(&self) -> Option<Thick> {
        let Elasticity::Koiter(sheet) = self.material else { return None };
        let values = self.maps.by_triangle(Quantity::Thickness, &self.mesh);
        let thickness = |t: usize| values.as_ref().map_or(sheet.thickness, |values| values[t]);
        let x = self.rest_shape.as_deref().unwrap_or(self.given());
        thick(&self.mesh, x, thickness, &self.creases)
    }

    /// The largest thickness of a sheet, where that is beyond a tenth of the mesh's size.
    pub fn as_thick_as_wide(&self) -> Option<f64> {
        let Elasticity::Koiter(sheet) = self.material else { return None };
        let most = match self.maps.by_triangle(Quantity::Thickness, &self.mesh) {
            Some(values) => values.iter().copied().fold(0.0, f64::max),
            None => sheet.thickness,
        };
        (most > THIN * self.mesh.size).then_some(most)
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
        self.material.is_told_by_pieces()
            && self.maps.is_empty()
            && self.creases.is_empty()
            && self.bonds.is_empty()
            && self.rest_shape.is_none()
            && self.metric.is_none()
    }

    /// The first vertex that would hang further from rest than any shell hangs, or at no number.
    pub(crate) fn stray(&self, positions: &[Vec3]) -> Option<usize> {
        let furthest = FURTHEST_SAG * self.mesh.size;
        let stray = |(x, rest): (&Vec3, &Vec3)| !(x - rest).iter().all(|d| d.abs() <= furthest);
        positions.iter().zip(&self.mesh.positions).position(stray)
    }

    /// The same shell with its mesh at `positions` (n_vertices), where the elastic forces balance its weight under `gravity`.
    pub(crate) fn hung(&self, gravity: Vec3, positions: Vec<Vec3>) -> Self {
        let (mesh, rest) = self.moved(positions);
        Self { mesh, sag: Some(Sag { gravity, rest }), ..self.copy() }
    }

    /// The same shell with its mesh at `positions` (n_vertices), where the elastic forces balance each other.
    pub(crate) fn settled(&self, positions: Vec<Vec3>) -> Self {
        let (mesh, given) = self.moved(positions);
        Self { mesh, settled_from: Some(given.into()), ..self.copy() }
    }

    /// The same shell with rest angles of its own where creases yield, where it has such.
    pub(crate) fn with_rest_angles(&self, angles: &[f64]) -> Option<Self> {
        let mut energy: Yielding = self.energy.yielding()?.clone();
        energy.set_rest_angles(angles);
        let sag = self.sag.as_ref().map(|sag| Sag { gravity: sag.gravity, rest: sag.rest.clone() });
        let (energy, analyses) = (LazyEnergy::new(move || Box::new(energy)), self.analyses.clone());
        Some(Self { energy, sag, analyses, ..self.copy() })
    }

    /// The same matter with the shape that `axes` (n_vertices) carry the mesh to for its rest shape. Its elements are on the same vertices.
    /// Fails where a triangle of it has no area.
    pub(crate) fn carried(&self, axes: &[Pose]) -> Result<Self> {
        let positions = axes.iter().zip(&self.mesh.positions).map(|(axes, x)| axes.place(x)).collect();
        let mesh = self.moved(positions).0;
        if let Some(t) = (0..mesh.triangles.len()).find(|t| !mesh.area(*t).is_normal()) {
            let message = format!("the rest shape: its triangle {t} has no area, and the full shell cannot rest there");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let turned = |roller: &Roller| roller.turned(&axes[roller.vertex as usize].rotation);
        let rollers = self.rollers.iter().map(turned).collect();
        let orthotropy = match &self.orthotropy {
            Some(fibres) => Some(Arc::new(fibres.carried(&self.mesh, &mesh)?)),
            None => None,
        };
        let made_of = (self.material, &self.maps, &self.creases, &orthotropy, &self.bonds);
        let shape = (mesh.clone(), &None);
        let energy = energy_of(shape, made_of, (&self.clamped, &self.mirrors, &mesh), Some(self.mesh.clone()));
        let analyses = self.analyses.clone(); // the elements are the same, and so is a good order of elimination
        Ok(Self { mesh, energy, rollers, orthotropy, analyses, ..self.copy() })
    }

    /// The same with triangles' stiffnesses and masses multiplied, of a shell that did not settle or sag yet.
    pub(crate) fn stiffened(&self, factors: &[Factors]) -> Result<Self> {
        let poisson = match (self.material, &self.orthotropy) {
            (Elasticity::Koiter(sheet), Some(_)) => Some(sheet.poisson),
            _ => None,
        };
        let isotropic = with_poisson(self.material, poisson.map(|_| 0.0)); // whose range is another
        let (maps, material) = self.maps.times(factors, &self.mesh, isotropic)?;
        let (maps, material) = (Arc::new(maps), with_poisson(material, poisson));
        let unstressed = match &self.rest_shape {
            Some(shape) => Arc::new(Mesh { positions: shape.to_vec(), ..Mesh::clone(&self.mesh) }),
            None => self.mesh.clone(),
        };
        let densities = maps.area_density(&self.mesh, &material);
        let uniform = material.area_density();
        let area = |t: usize| area_of(&unstressed, &self.metric, t);
        let (mass, _) = lumped_mass(&self.mesh, area, |t| densities.as_ref().map_or(uniform, |of| of[t]))?;
        let areas: Arc<[f64]> = lumped_mass(&self.mesh, area, |_| 1.0)?.0.into();
        let made_of = (material, &maps, &self.creases, &self.orthotropy, &self.bonds);
        let shape = (unstressed, &self.metric);
        let energy = energy_of(shape, made_of, (&self.clamped, &self.mirrors, &self.mesh), None);
        let (total_mass, analyses) = (mass.iter().sum(), self.analyses.clone());
        Ok(Self { maps, material, mass, areas, total_mass, energy, analyses, ..self.copy() })
    }

    /// The mesh at `positions`, and where it was.
    fn moved(&self, positions: Vec<Vec3>) -> (Arc<Mesh>, Vec<Vec3>) {
        let mut mesh = Mesh::clone(&self.mesh);
        let before = std::mem::replace(&mut mesh.positions, positions);
        (Arc::new(mesh), before)
    }

    /// The same that does not hang.
    fn copy(&self) -> Self {
        Self {
            mesh: self.mesh.clone(),
            maps: self.maps.clone(),
            creases: self.creases.clone(),
            orthotropy: self.orthotropy.clone(),
            bonds: self.bonds.clone(),
            rest_shape: self.rest_shape.clone(),
            metric: self.metric.clone(),
            settled_from: self.settled_from.clone(),
            areas: self.areas.clone(),
            energy: self.energy.clone(),
            sag: None,
            mass: self.mass.clone(),
            held: self.held.clone(),
            rollers: self.rollers.clone(),
            clamped: self.clamped.clone(),
            mirrors: self.mirrors.clone(),
            free: self.free.clone(),
            analyses: Arc::default(), // its points are elsewhere, and so may be the order of elimination
            ..*self
        }
    }

    /// The same shell, with vertices held along directions besides.
    pub(crate) fn pinned(&self, pins: Vec<(u32, Vec3)>) -> Result<Self> {
        let own = self.rollers.iter().flat_map(|roller| roller.directions().map(|n| (roller.vertex, n)));
        let supports = Supports { along: own.chain(pins).collect(), ..Supports::default() };
        let mut held = self.held.clone();
        let rollers = supports.rollers(&self.mesh, &mut held)?.into();
        let free = self.free.iter().copied().filter(|&v| !held[v as usize]).collect();
        Ok(Self { held, rollers, free, ..self.copy() })
    }

    /// The shell of these `vertices` and `triangles` alone, numbered anew in their order, with the triangles and edges of `mesh`, where they
    /// were given. Those that `free` does not name are held.
    pub(crate) fn part(&self, (vertices, triangles): (&[u32], &[u32]), mesh: Mesh, free: Vec<u32>) -> Self {
        let mut held = vec![true; vertices.len()];
        free.iter().for_each(|v| held[*v as usize] = false);
        let mesh = Arc::new(mesh);
        let clamped: Arc<[bool]> = match self.clamped.is_empty() {
            true => self.clamped.clone(),
            false => vertices.iter().map(|v| self.clamped[*v as usize]).collect(),
        };
        let (maps, creases) = (Arc::new(self.maps.part(vertices, triangles)), Arc::new(self.creases.part(vertices)));
        let new = |v: u32| vertices.binary_search(&v).map_or(NONE, |i| i as u32);
        let bond = |bond: &Bond| Bond { vertex: new(bond.vertex), corners: bond.corners.map(new), ..*bond };
        let bonds: Arc<[Bond]> =
            self.bonds.iter().map(bond).filter(|bond| bond.vertices().all(|v| v != NONE)).collect();
        let mirrored = |mirror: &Mirror| Mirror { ends: mirror.ends.map(new), ..*mirror };
        let mirrors: Arc<[Mirror]> =
            self.mirrors.iter().map(mirrored).filter(|mirror| mirror.ends.iter().all(|v| *v != NONE)).collect();
        let some = |v: &u32| self.areas.get(*v as usize).copied();
        let points = |x: &[Vec3]| vertices.iter().map(|v| x[*v as usize]).collect::<Vec<_>>();
        let rest_shape: Option<Arc<[Vec3]>> = self.rest_shape.as_ref().map(|shape| points(shape).into());
        let unstressed = match &rest_shape {
            Some(shape) => Arc::new(Mesh { positions: shape.to_vec(), ..Mesh::clone(&mesh) }),
            None => mesh.clone(),
        };
        let metric = self.metric.as_ref().map(|of| Arc::new(of.part(&self.mesh, (vertices, triangles), &mesh)));
        let orthotropy = self.orthotropy.as_ref().map(|fibres| Arc::new(fibres.part(triangles)));
        let mut rollers: Vec<Roller> = vec![];
        for (i, v) in vertices.iter().enumerate().filter(|(i, _)| !held[*i]) {
            rollers.extend(self.roller_of(*v).map(|roller| Roller { vertex: i as u32, ..*roller }));
        }
        let part = Self {
            energy: energy_of(
                (unstressed, &metric),
                (self.material, &maps, &creases, &orthotropy, &bonds),
                (&clamped, &mirrors, &mesh),
                None,
            ),
            mesh,
            maps,
            creases,
            orthotropy,
            bonds,
            rest_shape,
            metric,
            settled_from: None,
            areas: vertices.iter().filter_map(some).collect(),
            clamped,
            mirrors,
            sag: None,
            mass: vertices.iter().map(|v| self.mass[*v as usize]).collect(),
            held,
            rollers: rollers.into(),
            free,
            analyses: Arc::default(),
            ..*self
        };
        let part = if self.settled_from.is_some() { part.settled(points(self.unloaded())) } else { part };
        match &self.sag {
            Some(sag) => part.hung(sag.gravity, points(&self.mesh.positions)),
            None => part,
        }
    }

    /// Whether the slope is held at an edge of vertex `v`.
    pub fn is_clamped(&self, v: usize) -> bool {
        self.clamped.get(v) == Some(&true)
    }

    /// What it does not turn about freely where it is on planes of symmetry: a vertex and the direction of an edge.
    pub fn mirrored_edges(&self) -> impl Iterator<Item = (u32, Vec3)> {
        let along = |[a, b]: [u32; 2]| (self.mesh.positions[b as usize] - self.mesh.positions[a as usize]).normalize();
        self.mirrors.iter().map(move |mirror| (mirror.ends[0], along(mirror.ends)))
    }

    /// Number of unknowns: three per free vertex, those of its held directions among them.
    pub fn n_unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// Number of those that move.
    pub fn n_freedoms(&self) -> usize {
        self.n_unknowns() - self.rollers.iter().map(|roller| roller.held as usize).sum::<usize>()
    }

    /// What is held of a free vertex, if anything is.
    pub fn roller_of(&self, v: u32) -> Option<&Roller> {
        self.rollers.binary_search_by_key(&v, |roller| roller.vertex).ok().map(|at| &self.rollers[at])
    }

    /// Whether a vertex does not move along a direction of length 1, as far as rounding tells.
    pub fn holds(&self, v: u32, direction: &Vec3) -> bool {
        let free = |roller: &Roller| (roller.free * direction).norm() <= 1e-5;
        self.held[v as usize] || self.mass[v as usize] == 0.0 || self.roller_of(v).is_some_and(free)
    }

    /// ‖f‖ over the free vertices, along what rollers leave.
    pub fn free_norm(&self, f: &[Vec3]) -> f64 {
        let square = |v: &u32| match self.rollers.is_empty() {
            true => f[*v as usize].norm_squared(),
            false => self.roller_of(*v).map_or(f[*v as usize], |roller| roller.free * f[*v as usize]).norm_squared(),
        };
        self.free.iter().map(square).sum::<f64>().sqrt()
    }

    /// Takes from a field (n_vertices) what rollers hold.
    pub fn project(&self, field: &mut [Vec3]) {
        for roller in self.rollers.iter() {
            let x = &mut field[roller.vertex as usize];
            *x = roller.free * *x;
        }
    }

    /// The zero matrix of the stiffness' pattern, with room also for elements of these vertices.
    pub fn matrix(&self, cliques: &[&[u32]]) -> BlockMatrix {
        BlockMatrix::new(self.mass.len(), &self.free, &mut |join| {
            self.energy.visit_rest_rows(&mut |(vertices, _)| join(vertices));
            cliques.iter().for_each(|vertices| join(vertices));
        })
        .rolling(&self.rollers, |stiffness| {
            self.energy.visit_rest_rows(&mut |(vertices, row)| {
                vertices.iter().zip(row).for_each(|(&v, b)| stiffness[v as usize] += b.norm_squared() / 3.0);
            })
        })
    }

    /// The analysis of that pattern, `lower`, which all share that factorize it.
    pub fn analysis(&self, lower: SymbolicSparseColMatRef<'_, usize>) -> Result<Arc<Symbolic>> {
        self.analyses.of(lower, || self.points(&self.free))
    }

    /// Where these vertices lie.
    pub fn points(&self, vertices: &[u32]) -> Vec<Vec3> {
        vertices.iter().map(|&v| self.mesh.positions[v as usize]).collect()
    }

    /// Spreads values at the free vertices, x y z by turns (n_unknowns), over all vertices; zero elsewhere and where rollers hold.
    pub fn scatter(&self, unknowns: &[f64]) -> Vec<Vec3> {
        let mut field = vec![Vec3::zeros(); self.mass.len()];
        for (i, &v) in self.free.iter().enumerate() {
            field[v as usize] = Vec3::new(unknowns[3 * i], unknowns[3 * i + 1], unknowns[3 * i + 2]);
        }
        self.project(&mut field);
        field
    }
}

/// Poisson's ratio of a sheet with fibres, whose range is its own, and the material without it.
fn own_poisson(material: Elasticity, fibres: Option<&Fibres>) -> Result<(Option<f64>, Elasticity)> {
    match (material, fibres) {
        (material, None) => Ok((None, material)),
        (Elasticity::Koiter(sheet), Some(fibres)) => {
            fibres.check(&sheet)?;
            Ok((Some(sheet.poisson), ElasticSheet { poisson: 0.0, ..sheet }.into()))
        }
        (Elasticity::DiscreteShells(_), Some(_)) => Err(Error::argument(
            "the paper's energy takes no directions: use Koiter's, of a sheet in engineering units",
        )),
    }
}

/// The material with this ratio, if there is one.
fn with_poisson(material: Elasticity, poisson: Option<f64>) -> Elasticity {
    match (material, poisson) {
        (Elasticity::Koiter(sheet), Some(poisson)) => ElasticSheet { poisson, ..sheet }.into(),
        _ => material,
    }
}

/// Constants, and what stands in place of some or joins.
type MadeOf<'a> = (Elasticity, &'a Arc<Maps>, &'a Arc<Creases>, &'a Option<Arc<Orthotropy>>, &'a Arc<[Bond]>);

/// Of the shape without stress, with slopes kept where the mesh was `given`. Bending flips edges that are flat there, or in a shape `flat`.
fn energy_of(
    (unstressed, metric): (Arc<Mesh>, &Option<Arc<Metric>>),
    (material, maps, creases, orthotropy, bonds): MadeOf,
    (clamped, mirrors, given): (&Arc<[bool]>, &Arc<[Mirror]>, &Arc<Mesh>),
    flat: Option<Arc<Mesh>>,
) -> LazyEnergy {
    let (maps, creases, clamped, given) = (maps.clone(), creases.clone(), clamped.clone(), given.clone());
    let (orthotropy, bonds, mirrors, metric) = (orthotropy.clone(), bonds.clone(), mirrors.clone(), metric.clone());
    LazyEnergy::new(move || {
        let (mesh, given_mesh) = (&*unstressed, &*given);
        let given = &given_mesh.positions[..];
        let (maps, creases, orthotropy, clamped) = (&*maps, &*creases, orthotropy.as_deref(), &*clamped);
        let (mirrors, flat) = (&*mirrors, &flat.as_ref().unwrap_or(&unstressed).positions[..]);
        let metric = metric.as_deref();
        let source = Source { mesh, metric, material, maps, creases, orthotropy, clamped, given, mirrors, flat };
        let mut terms = of_material(&source);
        if !bonds.is_empty() {
            terms.push(Box::new(TieEnergy::new(given_mesh, &bonds, &terms)));
        }
        with_yielding(Box::new(terms), &source)
    })
}

/// The mesh in the shape that is without stress.
fn rest_mesh(mesh: &Mesh, shape: Vec<Vec3>) -> Result<Mesh> {
    let n = mesh.positions.len();
    if shape.len() != n {
        let message = format!("the rest shape has {} positions, but the mesh has {n} vertices", shape.len());
        return Err(Error::argument(message));
    }
    let n_reoriented = mesh.n_reoriented;
    let checked = Mesh::new(shape, &mesh.triangles)
        .map_err(|error| Error::new(error.kind, format!("the rest shape: {}", error.message)))?;
    let (component, n_components) = (mesh.component.clone(), mesh.n_components);
    Ok(Mesh { n_reoriented, component, n_components, ..checked })
}

/// Fails where an edge on a plane of symmetry is on none of the same normal without stress.
fn check_mirrors(mirrors: &[Mirror], rest: &Mesh, mesh: &Mesh) -> Result<()> {
    match mirrors.iter().find(|mirror| !mirror.at(&rest.positions, &mesh.positions).is_sound(rest)) {
        None => Ok(()),
        Some(Mirror { ends: [a, b], normal, .. }) => Err(Error::argument(format!(
            "the rest shape: the edge of the vertices {a} and {b} is on a plane of symmetry of the normal {:?}, but not without stress",
            normal.data.0[0]
        ))),
    }
}

/// The map of growth, and the others.
fn without_growth(maps: Vec<Map>, mesh: &Mesh) -> Result<(Vec<Map>, Option<Map>)> {
    let (mut growth, others): (Vec<Map>, Vec<Map>) = maps.into_iter().partition(|map| map.quantity == Quantity::Growth);
    growth.iter().try_for_each(|map| map.check(mesh))?;
    match growth.len() {
        0 | 1 => Ok((others, growth.pop())),
        _ => Err(Error::argument("there are two maps of growth")),
    }
}

/// A triangle's area without stress.
fn area_of(unstressed: &Mesh, metric: &Option<Arc<Metric>>, t: usize) -> f64 {
    metric.as_ref().map_or_else(|| unstressed.area(t), |metric| metric.area(t))
}

fn lumped_mass(mesh: &Mesh, area: impl Fn(usize) -> f64, density: impl Fn(usize) -> f64) -> Result<(Vec<f64>, f64)> {
    let mut mass = vec![0.0; mesh.positions.len()];
    let mut total_area = 0.0;
    for (t, tri) in mesh.triangles.iter().enumerate() {
        let area = area(t);
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

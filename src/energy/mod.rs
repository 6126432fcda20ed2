//! Deformation energies of thin shells behind one trait. The paper's, after Grinspun et al., "Discrete Shells" (SCA 2003):
//!
//! E = k_A Σ (A − Ā)²/Ā + k_L Σ (l − l̄)²/l̄ + k_B Σ 3 (θ − θ̄)² l̄/h̄
//!
//! over triangles, edges and interior edges. And Koiter's, of a sheet in engineering units ([`koiter`]): see `membrane.rs` and `bending.rs`.
//! All residuals vanish at rest, so the rest Hessian is exactly the Gauss–Newton
//! sum K = Σ b bᵀ of outer products, and an energy hands out its rows b.

mod area;
mod bending;
mod flips;
mod fold_over;
mod hinge;
mod hinge_lanes;
mod law;
mod length;
mod membrane;
mod mirror;
mod patch;
mod rest;
mod thin;
mod tie;
mod yielding;

pub use area::AreaEnergy;
pub use bending::{BendingEnergy, Plate};
pub use hinge::{HingeEnergy, angle_gradient, dihedral_angle};
pub use length::LengthEnergy;
pub use membrane::MembraneEnergy;
pub use mirror::{Mirror, MirroredEnergy, mirror_at};
pub use patch::plane_stress;
pub use thin::{THIN, Thick, thick};
pub use tie::TieEnergy;
pub use yielding::Yielding;

use crate::material::{
    Creases, ElasticSheet, Elasticity, Map, Maps, Metric, On, Orthotropy, Quantity, mean, mean_cube,
};
use crate::{Material, Mesh, Vec3};
use law::Law;
use rest::Rest;
use std::collections::HashMap;

/// A 3 × 3 block.
pub type Mat3 = nalgebra::Matrix3<f64>;

/// Vertices of an element, at most.
pub const MAX_ELEMENT: usize = 6;

/// One row b of a sum Σ b bᵀ, of K at rest: the vertices it touches (2 to [`MAX_ELEMENT`]) and a 3-vector at each.
pub type RestRow<'a> = (&'a [u32], &'a [Vec3]);

/// The Hessian of an element, or of several on the same vertices: its k vertices and its k × k blocks, row by row.
pub type ElementHessian<'a> = (&'a [u32], &'a [Mat3]);

/// Which second derivative. With a strain s of weight w, E = Σ w s², it is Σ 2w (∇s∇sᵀ + s ∇²s).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// All of it; indefinite where the shell is about to buckle.
    Exact,
    /// Each element's s ∇²s is replaced by a positive semidefinite part of it, or left out.
    Semidefinite,
}

/// Stresses σ of elements in the place of their strains.
#[derive(Clone, Copy)]
pub struct Stress<'a> {
    /// σ of each element.
    pub of: &'a [f64],
    /// Of the part of σ ∂²ε that [`Curvature::Semidefinite`] leaves out, what counts: 1 is all of it, 0 nothing.
    pub share: f64,
}

impl<'a> Stress<'a> {
    /// All of it counts.
    pub fn whole(of: &'a [f64]) -> Self {
        Self { of, share: 1.0 }
    }
}

impl Curvature {
    /// As [`Stress::share`].
    fn share(self) -> f64 {
        f64::from(u8::from(self == Self::Exact))
    }
}

/// A pull, or the share that counts of a push.
fn shared(pull: f64, share: f64) -> f64 {
    if pull < 0.0 { share * pull } else { pull }
}

/// A deformation energy that is zero, with zero gradient, at the rest positions, unless creases have angles of their own.
///
/// `x` holds the deformed positions of all vertices.
pub trait Energy: Send + Sync {
    /// E(x).
    fn value(&self, x: &[Vec3]) -> f64;

    /// Adds ∂E/∂x to `gradient` (n_vertices).
    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]);

    /// Hands every row b of the rest Hessian ∂²E/∂x² = Σ b bᵀ to `visit`, always in the same order.
    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow));

    /// Hands the rows √(2w) ∇s of the configuration `x` to `visit`, in the order of the rest rows, which they are at rest.
    /// They vanish on every rigid motion of `x`, so Σ b bᵀ is a viscosity that damps deformation alone.
    fn visit_rows(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow)) {
        self.visit_strains(x, &mut |row, _| visit(row));
    }

    /// Hands ∂²E/∂x² to `visit` in the order of the rest rows, whose Σ b bᵀ it is at rest. Elements on the same vertices may come as one.
    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian));

    /// As [`Energy::visit_rows`], with the strain √(2w) s of each element: E = Σ (√(2w) s)²/2.
    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64));

    /// Hands σ ∂²(√(2w) s)/∂x² of the elements, with the stresses σ given, to `visit`, in the order of the rest rows; by
    /// [`Curvature::Semidefinite`] a positive semidefinite part of it. Elements on the same vertices may come as one, their sum.
    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    );

    /// As [`Energy::visit_hessian`] with these stresses of the elements for their own where strains curve: with ε the strains √(2w) s,
    /// Σ ∇ε∇εᵀ + σ ∂²ε, or of what is not positive semidefinite of it a share.
    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian));

    /// How many elements, the first ones, resist stretching. The others resist bending.
    fn n_membrane(&self) -> usize;

    /// Hands the strains of these to `visit`, as [`Energy::visit_strains`] has them.
    fn visit_stretch(&self, x: &[Vec3], visit: &mut dyn FnMut(f64)) {
        if self.n_membrane() > 0 {
            self.visit_strains(x, &mut |_, strain| visit(strain));
        }
    }

    /// Elements, as many as rest rows.
    fn n_elements(&self) -> usize;

    /// Hands its elements to `visit` as they are near isometries of the `rest` shape, in the order of the rest rows; false where it cannot say.
    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool;

    /// Gives elements that stand or fall together, as the components of a tie, the same weight each: their mean.
    fn even(&self, _weights: &mut [f64]) {}

    /// Itself, where it has creases that yield: its last elements.
    fn yielding(&self) -> Option<&Yielding> {
        None
    }

    /// The same, to change.
    fn yielding_mut(&mut self) -> Option<&mut Yielding> {
        None
    }

    /// Σ w E of the elements that have a weight w other than 0 (`weights` in the order of the rest rows), on vertices that
    /// are numbered anew by `index` (n_vertices).
    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy>;
}

/// Elements as they are where lengths nearly hold.
pub enum Term<'a> {
    /// The strain of one of the membrane, as the sum of factor times y over pairs of vertices, to first order in y, which is what their squared
    /// distance gains; and its second derivative by these y, the lower triangle by rows, or nothing where the sum is exact.
    Stretch(&'a [([u32; 2], f64)], &'a [f64]),
    /// The strains of bending Σ row (θ − θ̄) over the edges of one triangle, the first ones of a row.
    Bend(&'a [Fold], &'a [[f64; 3]]),
    /// What follows may have the image of this vertex as a vertex: the first is n_vertices, and each further one the next.
    Image(u32, &'a Mirror),
}

/// An edge with a triangle at either side, at rest.
#[derive(Clone, Copy, Debug)]
pub struct Fold {
    /// The edge's ends, the triangle's other corner and that beyond the edge; [`crate::mesh::NONE`] for one that stays where it is.
    pub vertices: [u32; 4],
    /// Where they are.
    pub corners: [Vec3; 4],
}

/// A sum of energies is an energy.
impl Energy for Vec<Box<dyn Energy>> {
    fn value(&self, x: &[Vec3]) -> f64 {
        self.iter().map(|e| e.value(x)).sum()
    }

    fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        self.iter().for_each(|e| e.add_gradient(x, gradient));
    }

    fn visit_rest_rows(&self, visit: &mut dyn FnMut(RestRow)) {
        self.iter().for_each(|e| e.visit_rest_rows(visit));
    }

    fn visit_strains(&self, x: &[Vec3], visit: &mut dyn FnMut(RestRow, f64)) {
        self.iter().for_each(|e| e.visit_strains(x, visit));
    }

    fn visit_stress_hessian(
        &self,
        x: &[Vec3],
        stress: &[f64],
        curvature: Curvature,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let mut rest = stress;
        for e in self {
            let (own, others) = rest.split_at(e.n_elements());
            rest = others;
            e.visit_stress_hessian(x, own, curvature, visit);
        }
    }

    fn visit_mixed_hessian(&self, x: &[Vec3], stress: Stress, visit: &mut dyn FnMut(ElementHessian)) {
        let mut rest = stress.of;
        for e in self {
            let (own, others) = rest.split_at(e.n_elements());
            rest = others;
            e.visit_mixed_hessian(x, Stress { of: own, ..stress }, visit);
        }
    }

    fn n_membrane(&self) -> usize {
        self.iter().map(|e| e.n_membrane()).sum()
    }

    fn visit_stretch(&self, x: &[Vec3], visit: &mut dyn FnMut(f64)) {
        self.iter().for_each(|e| e.visit_stretch(x, visit));
    }

    fn visit_hessian(&self, x: &[Vec3], curvature: Curvature, visit: &mut dyn FnMut(ElementHessian)) {
        self.iter().for_each(|e| e.visit_hessian(x, curvature, visit));
    }

    fn n_elements(&self) -> usize {
        self.iter().map(|e| e.n_elements()).sum()
    }

    fn visit_terms(&self, rest: &[Vec3], visit: &mut dyn FnMut(Term)) -> bool {
        self.iter().all(|e| e.visit_terms(rest, visit))
    }

    fn even(&self, weights: &mut [f64]) {
        let mut rest = weights;
        for e in self {
            let (own, others) = rest.split_at_mut(e.n_elements());
            rest = others;
            e.even(own);
        }
    }

    fn sampled(&self, weights: &[f64], index: &[u32]) -> Box<dyn Energy> {
        let mut rest = weights;
        let mut part = |e: &dyn Energy| {
            let (own, others) = rest.split_at(e.n_elements());
            rest = others;
            e.sampled(own, index)
        };
        Box::new(self.iter().map(|e| part(&**e)).collect::<Vec<_>>())
    }
}

/// Number of [`discrete_shell`] in saved models.
pub const DISCRETE_SHELLS: u32 = 1;
/// Number of [`koiter`] in saved models.
pub const KOITER: u32 = 2;

/// What an energy is made of.
pub struct Source<'a> {
    /// The shape that has no energy but for creases with an angle of their own.
    pub mesh: &'a Mesh,
    /// Lengths that it has without stress, if they are not those of this shape; its angles are.
    pub metric: Option<&'a Metric>,
    /// Constants, and which energy.
    pub material: Elasticity,
    /// What varies.
    pub maps: &'a Maps,
    /// Edges that fold.
    pub creases: &'a Creases,
    /// A direction along which it is of another stiffness.
    pub orthotropy: Option<&'a Orthotropy>,
    /// Ends of edges whose slope is kept (n_vertices, or none): see [`BendingEnergy`].
    pub clamped: &'a [bool],
    /// The shape in which it is kept, and in which planes of symmetry are where they are (n_vertices).
    pub given: &'a [Vec3],
    /// Edges on planes of symmetry, ascending.
    pub mirrors: &'a [Mirror],
    /// The shape whose flat edges bending flips (n_vertices).
    pub flat: &'a [Vec3],
}

/// The energy of what a shell is made of, without creases that yield.
pub fn of_material(source: &Source) -> Vec<Box<dyn Energy>> {
    match source.material {
        Elasticity::DiscreteShells(material) => creased_discrete_shell(source, &material),
        Elasticity::Koiter(sheet) => creased_koiter(source, &sheet),
    }
}

/// With the creases that yield, if any do.
pub fn with_yielding(elastic: Box<dyn Energy>, source: &Source) -> Box<dyn Energy> {
    if !source.creases.yield_somewhere() {
        return elastic;
    }
    let creases = match source.material {
        Elasticity::DiscreteShells(material) if material.k_bend == 0.0 => return elastic,
        Elasticity::DiscreteShells(material) => hinges(source, &material, true),
        Elasticity::Koiter(sheet) => KoiterParts::new(source, &sheet).springs(source, true),
    };
    if creases.hinges.is_empty() {
        return elastic;
    }
    let limit = |[a, b, ..]: &[u32; 4]| source.creases.at([*a, *b]).map_or(f64::INFINITY, |crease| crease.yield_angle);
    let limits = creases.hinges.iter().map(limit).collect();
    Box::new(Yielding::new(elastic, creases, limits))
}

/// What a sheet's energy is made of, triangle by triangle.
struct KoiterParts<'a> {
    mesh: &'a Mesh,
    sheet: &'a ElasticSheet,
    young: Option<Vec<f64>>,
    thickness: Option<&'a Map>,
    orthotropy: Option<&'a Orthotropy>,
    law: Law,
}

impl<'a> KoiterParts<'a> {
    fn new(source: &Source<'a>, sheet: &'a ElasticSheet) -> Self {
        let Source { mesh, maps, orthotropy, .. } = *source;
        let (young, thickness) = (maps.by_triangle(Quantity::Young, mesh), maps.of(Quantity::Thickness));
        Self { mesh, sheet, young, thickness, orthotropy, law: Law::new(sheet, orthotropy) }
    }

    fn heights(&self, t: usize) -> [f64; 3] {
        match self.thickness {
            None => [self.sheet.thickness; 3],
            Some(map) if map.on == On::Triangles => [map.values[t]; 3],
            Some(map) => self.mesh.triangles[t].map(|v| map.values[v as usize]),
        }
    }

    fn young(&self, t: usize) -> f64 {
        self.young.as_ref().map_or(self.sheet.young, |young| young[t])
    }

    fn plate(&self, t: usize) -> Plate {
        let along = self.orthotropy.map_or_else(Vec3::zeros, |fibres| fibres.along[t]);
        Plate { young: self.young(t), cube: mean_cube(self.heights(t)), along }
    }

    /// The springs of creases that yield, or of the others.
    fn springs(&self, source: &Source, yielding: bool) -> HingeEnergy {
        let Source { mesh, metric, creases, clamped, given, mirrors, flat, .. } = *source;
        let poisson = self.sheet.poisson;
        let rigidity = |t: usize, edge: &Vec3| match self.orthotropy {
            None => self.plate(t).rigidity() / (12.0 * (1.0 - poisson * poisson)),
            Some(_) => self.plate(t).cube / 12.0 * self.law.about(&self.plate(t), edge),
        };
        let rest = Rest { mesh, metric };
        springs(&rest, &bending::Edges { clamped, creases, given, mirrors, flat }, yielding, rigidity)
    }
}

fn creased_koiter(source: &Source, sheet: &ElasticSheet) -> Vec<Box<dyn Energy>> {
    let Source { mesh, metric, creases, clamped, given, mirrors, flat, .. } = *source;
    let rest = Rest { mesh, metric };
    let edges = bending::Edges { clamped, creases, given, mirrors, flat };
    let parts = KoiterParts::new(source, sheet);
    let KoiterParts { young, thickness, orthotropy, law, .. } = &parts;
    let mut terms = if young.is_none() && thickness.is_none() && orthotropy.is_none() {
        uniform_koiter(&rest, sheet, &edges)
    } else {
        let plates: Vec<Plate> = (0..mesh.triangles.len()).map(|t| parts.plate(t)).collect();
        let along: Vec<Vec3> = plates.iter().map(|plate| plate.along).collect();
        let stretching = |t| mean(parts.heights(t)) * law.stress(parts.young(t), &along[t], &rest.corners(t));
        let mut terms = vec![Box::new(MembraneEnergy::varying(&rest, stretching)) as Box<dyn Energy>];
        terms.extend(BendingEnergy::varying(&rest, plates, law, &edges));
        terms
    };
    if !creases.is_empty() {
        terms.push(Box::new(parts.springs(source, false)));
    }
    terms
}

/// The creases of another stiffness as springs, each of the plate's own stiffness over the mean height of its triangles, by its factor.
/// Those that yield, or the others.
fn springs(rest: &Rest, edges: &bending::Edges, yielding: bool, rigidity: impl Fn(usize, &Vec3) -> f64) -> HingeEnergy {
    let mesh = rest.mesh;
    let mut sides: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for ends in (0..3).map(|k| [corners[k], corners[(k + 1) % 3]]) {
            if let Some(crease) = edges.creases.at(ends) {
                sides.entry(crease.vertices).or_default().push(t);
            }
        }
    }
    let kept = |v: u32| edges.clamped.get(v as usize) == Some(&true);
    HingeEnergy::of(mesh, |_, edge| {
        let crease = edges.creases.at(edge.vertices).filter(|crease| crease.is_apart() && crease.factor != 0.0)?;
        if crease.yields() != yielding {
            return None;
        }
        if edge.vertices.iter().all(|v| kept(*v)) {
            return None;
        }
        // One behind the other: what gives is the sum, by heights, which go as the areas.
        let (areas, gives) = sides[&crease.vertices].iter().fold((0.0, 0.0), |(areas, gives), t| {
            let area = rest.area(*t);
            (areas + area, gives + area / rigidity(*t, &rest.side(*t, edge.vertices)))
        });
        Some((crease.factor * areas / gives / 6.0, crease.angle))
    })
    .measured(rest)
}

/// Koiter's energy of a thin sheet (1966): the membrane's and the plate's of plane stress. Bending by the blended shape operator.
pub fn koiter(mesh: &Mesh, sheet: &ElasticSheet, clamped: &[bool]) -> Vec<Box<dyn Energy>> {
    let (creases, given) = (&Creases::default(), &mesh.positions[..]);
    uniform_koiter(&Rest::of(mesh), sheet, &bending::Edges { clamped, creases, given, mirrors: &[], flat: given })
}

fn uniform_koiter(rest: &Rest, sheet: &ElasticSheet, edges: &bending::Edges) -> Vec<Box<dyn Energy>> {
    let stress = plane_stress(sheet.young, sheet.poisson);
    let thickness = sheet.thickness;
    let mut terms: Vec<Box<dyn Energy>> = vec![Box::new(MembraneEnergy::uniform(rest, &(thickness * stress)))];
    terms.extend(BendingEnergy::creased(rest, &(thickness.powi(3) / 12.0 * stress), edges));
    terms
}

/// The paper's energy: area, length and hinge terms with the material's constants. A term of zero stiffness is left out.
pub fn discrete_shell(mesh: &Mesh, material: &Material) -> Vec<Box<dyn Energy>> {
    let (maps, creases) = (&Maps::default(), &Creases::default());
    let given = &mesh.positions;
    creased_discrete_shell(
        &Source {
            mesh,
            metric: None,
            material: (*material).into(),
            maps,
            creases,
            orthotropy: None,
            clamped: &[],
            given,
            mirrors: &[],
            flat: given,
        },
        material,
    )
}

fn creased_discrete_shell(source: &Source, material: &Material) -> Vec<Box<dyn Energy>> {
    let Source { mesh, metric, maps, .. } = *source;
    let mut terms: Vec<Box<dyn Energy>> = Vec::new();
    if material.k_area > 0.0 {
        let term = AreaEnergy::new(mesh, material.k_area);
        let term = match metric {
            Some(metric) => term.measured(|t| metric.area(t)),
            None => term,
        };
        terms.push(Box::new(match maps.by_triangle(Quantity::KArea, mesh) {
            Some(values) => term.with(&values),
            None => term,
        }));
    }
    if material.k_length > 0.0 {
        let term = LengthEnergy::new(mesh, material.k_length);
        let term = match metric {
            Some(metric) => term.measured(&metric.lengths),
            None => term,
        };
        terms.push(Box::new(match edge_lengths(source, material.k_length) {
            Some(values) => term.with(&values),
            None => term,
        }));
    }
    if material.k_bend > 0.0 {
        terms.push(Box::new(hinges(source, material, false)));
        if !source.mirrors.is_empty() {
            terms.push(Box::new(MirroredEnergy::hinges(source, bend_constants(source, material))));
        }
    }
    terms
}

/// k_B of each edge, by number.
fn bend_constants(source: &Source, material: &Material) -> impl Fn(usize) -> f64 {
    let (values, uniform) = (source.maps.by_edge(Quantity::KBend, source.mesh), material.k_bend);
    move |edge| values.as_ref().map_or(uniform, |values| values[edge])
}

/// The hinges that yield, or the others.
fn hinges(source: &Source, material: &Material, yielding: bool) -> HingeEnergy {
    let Source { mesh, metric, creases, .. } = *source;
    let k = bend_constants(source, material);
    HingeEnergy::of(mesh, |e, edge| match creases.at(edge.vertices) {
        None => (!yielding).then(|| (k(e), None)),
        Some(crease) if crease.factor == 0.0 || crease.yields() != yielding => None,
        Some(crease) => Some((crease.factor * k(e), crease.angle)),
    })
    .measured(&Rest { mesh, metric })
}

/// k_L of each edge, where they differ: of one on a plane of symmetry half is the image's.
fn edge_lengths(source: &Source, k: f64) -> Option<Vec<f64>> {
    let Source { mesh, maps, mirrors, .. } = *source;
    let mapped = maps.by_edge(Quantity::KLength, mesh);
    if mirrors.is_empty() {
        return mapped;
    }
    let mut values = mapped.unwrap_or_else(|| vec![k; mesh.edges.len()]);
    for (value, edge) in values.iter_mut().zip(&mesh.edges) {
        *value *= if mirror_at(mirrors, edge.vertices).is_some() { 0.5 } else { 1.0 };
    }
    Some(values)
}

/// The K-seminorm squared uᵀKu = Σ (b·u)², each term a square: no cancellation, so a rigid motion gives rounding squared.
pub fn rest_quadratic_form(energy: &dyn Energy, u: &[Vec3]) -> f64 {
    let mut sum = 0.0;
    energy.visit_rest_rows(&mut |(vertices, row)| {
        let strain: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&u[v as usize])).sum();
        sum += strain * strain;
    });
    sum
}

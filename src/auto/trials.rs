//! What a choice tries methods with: accelerations, and handles led to where scenes may move them.
//!
//! A handle is led as hosts lead it. Its vertex is held along the demand's axes, hard, and goes in equal parts from where it hangs to a
//! place at the demand's distance from rest. The full shell and every method are led alike, each part from the equilibrium of the one
//! before, and all vertices are judged after each part. Ways are straight ones along the directions in which the vertex gives, either way; those
//! on which the full shell's vertex goes by itself where only that direction is held, as along the arc of a card that is lifted; and straight
//! ones between the directions.
//!
//! The full shell goes each part in smaller ones, from where the last two point: a vertex that jumps ahead of its neighbours may fold the shell.

use crate::constraint::{Constraint, Target};
use crate::modes::Demand;
use crate::reference::{EquilibriumOptions, Solver};
use crate::{ErrorKind, Model, Result, Vec3};
use nalgebra::Matrix3;

/// Handles that are led, at most; ways of all together, at most, but of each so many.
const MOST_HANDLES: usize = 6;
const MOST_WAYS: usize = 16;
const LEAST_WAYS: usize = 4;
/// A direction in which a vertex gives by less than this part of its softest is not one to lead it in: the shell stretches there, or folds.
const STIFF: f64 = 0.1;
/// Places on a way that are judged, and equilibria of the full shell for each.
const PARTS: usize = 4;
const FINER: usize = 2;
/// Of errors on ways that are tried, what ways between them may err.
const BETWEEN: f64 = 1.25;
/// As near as methods are judged by; a part is followed at once where that works.
const FOLLOWED: EquilibriumOptions =
    EquilibriumOptions { tolerance: 1e-7, first_increment: 1.0, max_iterations: 200, follow_snaps: true };

type Watch<'a> = &'a mut dyn FnMut() -> Result<()>;

/// An acceleration, or a handle that is led under gravity, and what the full shell does.
pub struct Trial {
    /// Everywhere.
    pub gravity: Vec3,
    handle: Option<(u32, [bool; 3])>,
    /// Displacements of the handle's vertex, in order.
    places: Vec<Vec3>,
    /// The full shell's displacements at each place, or under the acceleration, up to where it has no equilibrium.
    pub truths: Vec<Vec<Vec3>>,
}

impl Trial {
    /// What an error in this trial counts.
    pub fn weight(&self) -> f64 {
        if self.handle.is_some() { BETWEEN } else { 1.0 }
    }

    /// Whether the handle takes over from where the shell hangs.
    pub fn hangs_first(&self) -> bool {
        self.handle.is_some() && self.gravity != Vec3::zeros()
    }

    /// What to set for each truth, on vertices that rest at `rest`.
    pub fn parts(&self, rest: &[Vec3]) -> impl Iterator<Item = (Option<Constraint>, &[Vec3])> {
        self.truths.iter().enumerate().map(|(k, truth)| {
            let constraint = self.handle.map(|(vertex, axes)| {
                let target = Target::Position(rest[vertex as usize] + self.places[k]);
                Constraint { id: 0, vertex, axes, compliance: 0.0, target }
            });
            (constraint, &truth[..])
        })
    }
}

/// Gravity and half of it, and gravity with an acceleration along each axis either way.
pub fn accelerations(solver: &mut Solver, demand: &Demand, watch: Watch) -> Result<Vec<Trial>> {
    let mut of = vec![];
    if demand.gravity != Vec3::zeros() {
        of.extend([1.0, 0.5].map(|share| share * demand.gravity));
    }
    if demand.acceleration > 0.0 {
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            of.extend([1.0, -1.0].map(|sign| demand.gravity + sign * demand.acceleration * axis));
        }
    }
    let mut trials = vec![];
    for gravity in of {
        let force: Vec<Vec3> = solver.shell().mass.iter().map(|m| *m * gravity).collect();
        let start = vec![Vec3::zeros(); force.len()];
        let found = solver.equilibrium(&start, &force, &Default::default(), &mut |_| watch());
        let truths = unless_none(found.map(|found| found.displacement))?.into_iter().collect();
        trials.push(Trial { gravity, handle: None, places: vec![], truths });
    }
    Ok(trials)
}

fn unless_none<T>(found: Result<T>) -> Result<Option<T>> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind == ErrorKind::Numerical => Ok(None),
        Err(error) => Err(error),
    }
}

/// Each handle of the demand on its ways, from where the full shell hangs at the displacements `hanging`.
pub fn handles(
    solver: &mut Solver,
    model: &Model,
    demand: &Demand,
    hanging: &[Vec3],
    watch: Watch,
) -> Result<Vec<Trial>> {
    let led = demand.handles.iter().filter(|v| demand.distance > 0.0 && !model.shell.held[**v as usize]);
    let led: Vec<u32> = led.copied().take(MOST_HANDLES).collect();
    let each = (MOST_WAYS / led.len().max(1)).max(LEAST_WAYS);
    let force: Vec<Vec3> = model.shell.mass.iter().map(|m| *m * demand.gravity).collect();
    let mut trials = vec![];
    for vertex in led {
        let from = hanging[vertex as usize];
        for (way, alone) in ways(model, vertex, demand.held()).into_iter().take(each) {
            // Alone, the way's direction is the first axis.
            let axes = if alone { frame_along(way) } else { Matrix3::identity() };
            let held = if alone { [true, false, false] } else { demand.held() };
            let mut path = Path { solver: &mut *solver, force: &force, axes, u: hanging.to_vec(), before: None };
            let (mut places, mut truths) = (vec![], vec![]);
            for k in 1..=PARTS {
                let place = from.lerp(&(demand.distance * way), k as f64 / PARTS as f64);
                if unless_none(path.lead((vertex, held), place, watch))?.is_none() {
                    break;
                }
                places.push(path.u[vertex as usize]);
                truths.push(path.u.clone());
            }
            trials.push(Trial { gravity: demand.gravity, handle: Some((vertex, demand.held())), places, truths });
        }
    }
    Ok(trials)
}

/// Columns: `way`, and two directions across it.
fn frame_along(way: Vec3) -> Matrix3<f64> {
    let across = way.cross(&Vec3::ith(way.iamin(), 1.0)).normalize();
    Matrix3::from_columns(&[way, across, way.cross(&across)])
}

/// Where a handle on vertex `v` is led if it holds some axes, the most telling first, and whether that direction alone is held there.
fn ways(model: &Model, v: u32, held: [bool; 3]) -> Vec<(Vec3, bool)> {
    let main = soft_directions(model, v, held);
    let both = || main.iter().flat_map(|way| [*way, -way]);
    let mut ways: Vec<(Vec3, bool)> = both().map(|way| (way, false)).collect();
    if held.iter().filter(|held| **held).count() > 1 {
        ways.extend(both().map(|way| (way, true)));
    }
    if main.len() > 1 {
        let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let between = |corner: usize| -> Vec3 { main.iter().enumerate().map(|(a, way)| sign(corner, a) * way).sum() };
        ways.extend((0..1 << main.len()).map(|corner| (between(corner).normalize(), false)));
    }
    ways
}

/// Orthogonal directions among the held axes in which vertex `v` gives to first order in the modes, the softest first.
fn soft_directions(model: &Model, v: u32, held: [bool; 3]) -> Vec<Vec3> {
    let of_mode = |k: usize| {
        let phi = model.modal.mode_at(k, v as usize).0;
        let along = Vec3::from_fn(|a, _| if held[a] { phi[a] } else { 0.0 });
        along * along.transpose() / model.modal.eigenvalues[k]
    };
    let compliance: Matrix3<f64> = (model.modal.zero_modes..model.modal.n_modes()).map(of_mode).sum();
    let gives = compliance.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| gives.eigenvalues[*b].total_cmp(&gives.eigenvalues[*a]));
    let softest = gives.eigenvalues[order[0]];
    let soft = order.into_iter().filter(|k| softest > 0.0 && gives.eigenvalues[*k] >= STIFF * softest);
    soft.map(|k| gives.eigenvectors.column(k).into_owned()).collect()
}

/// The full shell on its way.
struct Path<'a> {
    solver: &'a mut Solver,
    force: &'a [Vec3],
    axes: Matrix3<f64>,
    /// Displacements now, and before the last small part.
    u: Vec<Vec3>,
    before: Option<Vec<Vec3>>,
}

impl Path<'_> {
    /// To the equilibrium with a vertex at a displacement, as far as axes are held.
    fn lead(&mut self, (vertex, held): (u32, [bool; 3]), place: Vec3, watch: Watch) -> Result<()> {
        let from = self.u[vertex as usize];
        let rest = self.solver.shell().mesh.positions[vertex as usize];
        for k in 1..=FINER {
            let target = Target::Position(rest + from.lerp(&place, k as f64 / FINER as f64));
            let hold = Constraint { id: 0, vertex, axes: held, compliance: 0.0, target };
            let mut to = |start: &[Vec3], options: &EquilibriumOptions| {
                self.solver.set_constraints(self.axes, vec![hold], start)?;
                self.solver.equilibrium(start, self.force, options, &mut |_| watch())
            };
            let ahead = self
                .before
                .as_ref()
                .map(|before| -> Vec<Vec3> { self.u.iter().zip(before).map(|(u, before)| 2.0 * u - before).collect() });
            let followed = ahead.map(|start| unless_none(to(&start, &FOLLOWED))).transpose()?.flatten();
            let found = match followed {
                Some(found) => found,
                None => to(&self.u, &EquilibriumOptions { first_increment: 0.25, ..FOLLOWED })?,
            };
            self.before = Some(std::mem::replace(&mut self.u, found.displacement));
        }
        Ok(())
    }
}

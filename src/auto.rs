//! The choice of a method by a budget: what each would get wrong and cost in a scene is measured at precompute.
//!
//! The scene is what its demand declares ([`Demand`]): gravity, accelerations in any direction, pulls of handles. Under each of these
//! loads, alone and with gravity, the full shell's equilibrium is set against that of every candidate: linear analysis, the warp and rotation–strain
//! reconstruction on the modes asked for, the last two on modes of the shape that hangs under the gravity, and reduced shells of some sizes. A candidate's
//! error is the furthest that any vertex is off under any load; its cost the operations of a step as the plan counts them, so that the
//! choice does not depend on the machine.

mod saved;

use crate::features::Feature;
use crate::modes::{Demand, Phase};
use crate::reduced::{self, MAX_FIELDS};
use crate::reference::Solver;
use crate::state::{Method, State};
use crate::step::Integrator;
use crate::{Error, ErrorKind, Model, Result, Shell, Vec3, model};
use std::sync::Arc;

/// What a method may get wrong and may cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Length; 0: as little as there is.
    pub error: f64,
    /// Operations of a step; infinite: as many as it takes.
    pub operations: f64,
}

/// A method on a model of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// How it moves.
    pub method: Method,
    /// On modes of the shape that hangs under the demand's gravity.
    pub sagged: bool,
    /// Fields beyond the modes, and elements that stand for all, of a reduced shell.
    pub fields: usize,
    /// See there.
    pub elements: usize,
    /// Of a step.
    pub operations: f64,
    /// The furthest that a vertex is off, length; infinite where it finds no equilibrium.
    pub error: f64,
}

/// The candidates and which of them was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// In the order in which they were tried.
    pub candidates: Vec<Candidate>,
    /// Its number.
    pub chosen: usize,
}

impl Front {
    /// The one that was taken.
    pub fn choice(&self) -> &Candidate {
        &self.candidates[self.chosen]
    }
}

/// Fields of a reduced shell unless others are asked for.
const FIELDS: usize = 40;
/// Handles that are pulled at, at most.
const MOST_HANDLES: usize = 6;
/// Length of the step whose operations are counted, s; only a turning frame's depend on it.
const STEP: f64 = 1.0 / 30.0;

const WITHOUT_LOADS: &str = "a choice by budget needs the scene's gravity, accelerations or handles that move";

/// One of the scene's loads, dead.
struct Load {
    gravity: Vec3,
    pull: Option<(u32, Vec3)>,
}

/// The model with the method for a scene: see the module's text. `options` have a budget and a demand.
pub fn precompute(
    shell: Arc<Shell>,
    options: &model::Options,
    budget: Budget,
    callback: &mut dyn FnMut(Phase, f64) -> Result<()>,
) -> Result<Model> {
    Feature::NonlinearShell.require()?;
    let Some(demand) = options.demand.clone() else {
        return Err(Error::argument(WITHOUT_LOADS));
    };
    let demand = demand.validated(&shell)?;
    let moves = demand.distance > 0.0 && !demand.handles.is_empty();
    if demand.gravity == Vec3::zeros() && demand.acceleration == 0.0 && !moves {
        return Err(Error::argument(WITHOUT_LOADS));
    }
    let fewer_modes = Some(demand.clone()).filter(|demand| demand.tolerance > 0.0);
    let plain = model::Options { demand: fewer_modes, auto: None, reduced: Default::default(), ..options.clone() };
    let base = Arc::new(Model::precompute(shell.clone(), &plain, callback)?);
    let loads = loads(&base, &demand);
    let truths = truths(&shell, &loads, callback)?;
    let mut trials: Vec<(Arc<Model>, Candidate)> = vec![];
    let mut measure = |model: &Arc<Model>, methods: &[Method]| -> Result<()> {
        for method in methods {
            trials.push((model.clone(), candidate(model, *method, &loads, &truths)?));
        }
        Ok(())
    };
    let warps = [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain];
    measure(&base, if options.linear { &warps[..1] } else { &warps })?;
    if demand.gravity != Vec3::zeros() && !options.linear {
        let sagged = model::Options { sag: demand.gravity, ..plain.clone() };
        if let Some(model) = unless_refused(Model::precompute(shell.clone(), &sagged, callback))? {
            measure(&model, &warps[2..])?;
        }
    }
    for fields in field_counts(options, base.n_modes()) {
        let gravity = if options.reduced.gravity > 0.0 { options.reduced.gravity } else { demand.gravity.norm() };
        let reduced = reduced::Options { fields, gravity, ..options.reduced };
        let with_fields = model::Options { reduced, ..plain.clone() };
        if let Some(model) = unless_refused(Model::precompute(shell.clone(), &with_fields, callback))? {
            measure(&model, &[Method::ReducedShell])?;
        }
    }
    let candidates: Vec<Candidate> = trials.iter().map(|(_, candidate)| *candidate).collect();
    let chosen = choose(&candidates, budget);
    let (model, _) = trials.swap_remove(chosen);
    drop((trials, base));
    let model = Arc::into_inner(model).ok_or_else(|| Error::new(ErrorKind::Numerical, "a trial still holds its model"));
    Ok(Model { front: Some(Front { candidates, chosen }), ..model? })
}

/// Fields of the reduced shells to try: those asked for, and half as many.
fn field_counts(options: &model::Options, modes: usize) -> Vec<usize> {
    let asked = if options.reduced.fields > 0 { options.reduced.fields } else { FIELDS };
    let most = asked.min(MAX_FIELDS.saturating_sub(modes));
    [most / 2, most].into_iter().filter(|fields| *fields > 0).collect()
}

/// Nothing where this shell, or this build, has no such model.
fn unless_refused(model: Result<Model>) -> Result<Option<Arc<Model>>> {
    match model {
        Ok(model) => Ok(Some(Arc::new(model))),
        Err(error) if matches!(error.kind, ErrorKind::Unsupported | ErrorKind::Numerical) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Of those within the budget of operations, or the cheapest: the cheapest within the budget of errors, or the most accurate.
fn choose(candidates: &[Candidate], budget: Budget) -> usize {
    let first_by = |among: &[usize], of: &dyn Fn(&Candidate) -> f64| {
        among.iter().copied().min_by(|a, b| of(&candidates[*a]).total_cmp(&of(&candidates[*b]))).unwrap_or(0)
    };
    let within = |among: &[usize], good: &dyn Fn(&Candidate) -> bool| -> Vec<usize> {
        among.iter().copied().filter(|k| good(&candidates[*k])).collect()
    };
    let all: Vec<usize> = (0..candidates.len()).collect();
    let cost = |c: &Candidate| c.operations;
    let mut affordable = within(&all, &|c| c.operations <= budget.operations);
    if affordable.is_empty() {
        affordable.push(first_by(&all, &cost));
    }
    match within(&affordable, &|c| c.error <= budget.error) {
        good if good.is_empty() => first_by(&affordable, &|c| c.error),
        good => first_by(&good, &cost),
    }
}

/// Gravity and half of it, gravity with an acceleration along each axis either way, and with a pull at each handle.
fn loads(model: &Model, demand: &Demand) -> Vec<Load> {
    let mut loads = vec![];
    if demand.gravity != Vec3::zeros() {
        loads.extend([1.0, 0.5].map(|share| Load { gravity: share * demand.gravity, pull: None }));
    }
    if demand.acceleration > 0.0 {
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            let both = [1.0, -1.0].map(|sign| demand.gravity + sign * demand.acceleration * axis);
            loads.extend(both.map(|gravity| Load { gravity, pull: None }));
        }
    }
    if demand.distance > 0.0 {
        for &v in demand.handles.iter().take(MOST_HANDLES) {
            let pull = softest_pull(model, v, demand.distance);
            let both = pull.iter().flat_map(|force| [*force, -force]);
            loads.extend(both.map(|force| Load { gravity: demand.gravity, pull: Some((v, force)) }));
        }
    }
    loads
}

/// The force on vertex `v` that moves it by `distance` in the direction in which it gives most, to first order in the modes.
fn softest_pull(model: &Model, v: u32, distance: f64) -> Option<Vec3> {
    let elastic = model.zero_modes..model.n_modes();
    let compliance: nalgebra::Matrix3<f64> = elastic
        .map(|k| {
            let phi = model.mode_at(k, v as usize).0;
            phi * phi.transpose() / model.eigenvalues[k]
        })
        .sum();
    let gives = compliance.symmetric_eigen();
    let softest = gives.eigenvalues.imax();
    let give = gives.eigenvalues[softest];
    (give > 0.0).then(|| gives.eigenvectors.column(softest) * (distance / give))
}

/// Displacements of the full shell under each load, where it has an equilibrium.
fn truths(
    shell: &Arc<Shell>,
    loads: &[Load],
    callback: &mut dyn FnMut(Phase, f64) -> Result<()>,
) -> Result<Vec<Option<Vec<Vec3>>>> {
    let mut solver = Solver::new(shell.clone())?;
    let start = vec![Vec3::zeros(); shell.mass.len()];
    let mut found = vec![];
    for (k, load) in loads.iter().enumerate() {
        let mut force: Vec<Vec3> = shell.mass.iter().map(|m| *m * load.gravity).collect();
        load.pull.iter().for_each(|(v, pull)| force[*v as usize] += pull);
        let share = k as f64 / loads.len() as f64;
        let truth = solver.equilibrium(&start, &force, &Default::default(), &mut |_| callback(Phase::Rotation, share));
        match truth {
            Ok(truth) => found.push(Some(truth.displacement)),
            Err(error) if error.kind == ErrorKind::Numerical => found.push(None),
            Err(error) => return Err(error),
        }
    }
    if found.iter().all(Option::is_none) {
        let message = format!("the full shell comes to rest under none of the scene's {} loads", loads.len());
        return Err(Error::new(ErrorKind::Numerical, message));
    }
    Ok(found)
}

fn candidate(model: &Arc<Model>, method: Method, loads: &[Load], truths: &[Option<Vec<Vec3>>]) -> Result<Candidate> {
    let shell = &model.shell;
    let rest = shell.sag.as_ref().map_or(&shell.mesh.positions, |sag| &sag.rest);
    let (mut error, mut operations) = (0.0f64, 0.0f64);
    for (load, truth) in loads.iter().zip(truths) {
        let Some(truth) = truth else { continue };
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler)?;
        state.set_gravity(load.gravity)?;
        state.set_forces(load.pull.into_iter().collect(), false)?;
        match state.equilibrium() {
            Ok(_) => {
                let off = |v: usize, x: Vec3| (x - rest[v] - truth[v]).norm();
                state.positions(crate::state::Space::Frame, |v, x| error = error.max(off(v, x)));
            }
            Err(failure) if failure.kind == ErrorKind::Numerical => error = f64::INFINITY,
            Err(failure) => return Err(failure),
        }
        let cost: f64 = state.plan(STEP)?.iter().map(|part| part.operations).sum();
        operations = operations.max(cost);
    }
    let reduced = model.reduced.as_ref().filter(|_| method == Method::ReducedShell);
    let (fields, elements) = reduced.map_or((0, 0), |r| (r.n() - model.n_modes(), r.samples.len()));
    Ok(Candidate { method, sagged: shell.sag.is_some(), fields, elements, operations, error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choice_is_the_cheapest_within_the_error_of_what_can_be_afforded() {
        let of = |operations: f64, error: f64| Candidate {
            method: Method::Warp,
            sagged: false,
            fields: 0,
            elements: 0,
            operations,
            error,
        };
        let front = [of(1.0, 0.5), of(10.0, 0.1), of(20.0, 0.12), of(100.0, 0.01), of(50.0, f64::INFINITY)];
        let pick = |error: f64, operations: f64| choose(&front, Budget { error, operations });
        assert_eq!(pick(0.6, f64::INFINITY), 0);
        assert_eq!(pick(0.2, f64::INFINITY), 1);
        assert_eq!(pick(0.05, f64::INFINITY), 3);
        assert_eq!(pick(0.0, f64::INFINITY), 3); // as accurate as there is
        assert_eq!(pick(0.05, 60.0), 1); // the most accurate that can be afforded
        assert_eq!(pick(0.0, 0.5), 0); // nothing can: the cheapest
    }
}

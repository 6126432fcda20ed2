//! The choice of a method by a budget: what each would get wrong and cost in a scene is measured at precompute.
//!
//! The scene is what its demand declares ([`Demand`]): gravity, accelerations in any direction, handles that are led (`trials`). In each of
//! these trials the full shell's equilibria are set against those of every candidate: linear analysis, the warp and rotation–strain
//! reconstruction on the modes asked for, the last two on modes of the shape that hangs under the gravity, and reduced shells of some sizes. A
//! candidate's error is the furthest that any vertex is off in any trial, and a quarter more where handles are led, as scenes lead them to
//! places between those that are tried; its cost the operations of a step as the plan counts them, so that the choice does not depend on the machine.

mod trials;

use crate::error::unless_none;
use crate::features::Feature;
use crate::method::Method;
use crate::model::front::{Candidate, Front};
use crate::modes::{Demand, Phase};
use crate::reduced::{self, FIELDS, MAX_FIELDS};
use crate::reference::Solver;
use crate::state::State;
use crate::step::Integrator;
use crate::{Error, ErrorKind, Model, Result, Shell, Vec3, model};
use std::sync::Arc;
use trials::Trial;

/// What a method may get wrong and may cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Length; 0: as little as there is.
    pub error: f64,
    /// Operations of a step; infinite: as many as it takes.
    pub operations: f64,
}

/// Length of the step whose operations are counted, s; only a turning frame's depend on it.
const STEP: f64 = 1.0 / 30.0;

const WITHOUT_LOADS: &str = "a choice by budget needs the scene's gravity, accelerations or handles that move";

type Watch<'a> = &'a mut dyn FnMut(Phase, f64) -> Result<()>;

/// The model with the method for a scene: see the module's text. `options` have a demand.
pub fn precompute(shell: Arc<Shell>, options: &model::Options, budget: Budget, callback: Watch) -> Result<Model> {
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
    let plain = model::Options { demand: fewer_modes, reduced: Default::default(), ..options.clone() };
    let base = Arc::new(Model::precompute(shell.clone(), &plain, callback)?);
    let mut judge = Judge { trials: trials(&shell, &base, &demand, callback)?, judged: vec![] };
    let warps = [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain];
    judge.measure(&base, if options.linear { &warps[..1] } else { &warps }, callback)?;
    if demand.gravity != Vec3::zeros() && !options.linear {
        let sagged = model::Options { sag: demand.gravity, ..plain.clone() };
        if let Some(model) = unless_none(Model::precompute(shell.clone(), &sagged, callback))? {
            judge.measure(&Arc::new(model), &warps[2..], callback)?;
        }
    }
    for fields in field_counts(options, base.modal.n_modes()) {
        let gravity = if options.reduced.gravity > 0.0 { options.reduced.gravity } else { demand.gravity.norm() };
        let reduced = reduced::Options { fields, gravity, ..options.reduced };
        let with_fields = model::Options { reduced, ..plain.clone() };
        if let Some(model) = unless_none(Model::precompute(shell.clone(), &with_fields, callback))? {
            judge.measure(&Arc::new(model), &[Method::ReducedShell], callback)?;
        }
    }
    drop(base);
    judge.take(budget)
}

/// All trials, and what they told of methods so far.
struct Judge {
    trials: Vec<Trial>,
    judged: Vec<(Arc<Model>, Candidate)>,
}

impl Judge {
    fn measure(&mut self, model: &Arc<Model>, methods: &[Method], callback: Watch) -> Result<()> {
        for method in methods.iter().filter(|method| model.require(**method).is_ok()) {
            let (mut error, mut operations) = (0.0f64, 0.0f64);
            for (k, trial) in self.trials.iter().enumerate() {
                callback(Phase::Training, k as f64 / self.trials.len() as f64)?;
                let (off, cost) = tried(model, *method, trial)?;
                (error, operations) = (error.max(off), operations.max(cost));
                if off == f64::INFINITY {
                    break;
                }
            }
            let reduced = model.reduced.as_ref().filter(|_| *method == Method::ReducedShell);
            let (fields, elements) = reduced.map_or((0, 0), |r| (r.n_trained(), r.samples.len()));
            let sagged = model.shell.sag.is_some();
            let candidate = Candidate { method: *method, sagged, fields, elements, operations, error };
            self.judged.push((model.clone(), candidate));
        }
        Ok(())
    }

    /// The model of the choice, with what it went by.
    fn take(mut self, budget: Budget) -> Result<Model> {
        let candidates: Vec<Candidate> = self.judged.iter().map(|(_, candidate)| *candidate).collect();
        if candidates.is_empty() {
            let message =
                "no method of a choice takes creases that yield but a reduced shell, and there is none of this one";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        let chosen = choose(&candidates, budget);
        let (model, _) = self.judged.swap_remove(chosen);
        drop(self.judged);
        let model = Arc::into_inner(model);
        let model = model.ok_or_else(|| Error::new(ErrorKind::Numerical, "a trial still holds its model"))?;
        Ok(Model { front: Some(Front { candidates, chosen }), ..model })
    }
}

/// Fields of the reduced shells to try: those asked for, and half as many.
fn field_counts(options: &model::Options, modes: usize) -> Vec<usize> {
    let asked = if options.reduced.fields > 0 { options.reduced.fields } else { FIELDS };
    let most = asked.min(MAX_FIELDS.saturating_sub(modes));
    [most / 2, most].into_iter().filter(|fields| *fields > 0).collect()
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

/// What the full shell does in the scene.
fn trials(shell: &Arc<Shell>, model: &Model, demand: &Demand, callback: Watch) -> Result<Vec<Trial>> {
    let mut watch = || callback(Phase::Training, 0.0);
    let mut solver = Solver::new(shell.clone())?;
    let mut trials = trials::accelerations(&mut solver, demand, &mut watch)?;
    let at_rest = vec![Vec3::zeros(); shell.mass.len()];
    let hanging = if demand.gravity == Vec3::zeros() { Some(&at_rest) } else { trials[0].truths.first() };
    if let Some(hanging) = hanging {
        let led = trials::handles(&mut solver, model, demand, hanging, &mut watch)?;
        trials.extend(led);
    }
    if trials.iter().all(|trial| trial.truths.is_empty()) {
        let message = format!("the full shell comes to rest in none of the scene's {} trials", trials.len());
        return Err(Error::new(ErrorKind::Numerical, message));
    }
    trials.retain(|trial| !trial.truths.is_empty());
    Ok(trials)
}

/// How far a method is off in a trial, infinitely where it finds no equilibrium, and the operations of a step there.
fn tried(model: &Arc<Model>, method: Method, trial: &Trial) -> Result<(f64, f64)> {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler)?;
    state.set_gravity(trial.gravity)?;
    let error = match led(&mut state, trial) {
        Ok(error) => trial.weight() * error,
        Err(failure) if failure.kind == ErrorKind::Numerical => f64::INFINITY,
        Err(failure) => return Err(failure),
    };
    let operations = state.plan(STEP)?.iter().map(|part| part.operations).sum();
    Ok((error, operations))
}

/// Takes the state through a trial; the furthest that a vertex is off.
fn led(state: &mut State, trial: &Trial) -> Result<f64> {
    let shell = state.model().shell.clone();
    let rest = shell.unloaded();
    let mut error = 0.0f64;
    if trial.hangs_first() {
        state.equilibrium()?;
    }
    for (constraint, truth) in trial.parts(rest) {
        constraint.map_or(Ok(()), |constraint| state.set_constraint(constraint))?;
        state.equilibrium()?;
        let off = |v: usize, x: Vec3| (x - rest[v] - truth[v]).norm();
        state.positions(crate::state::Space::Frame, |v, x| error = error.max(off(v, x)));
    }
    Ok(error)
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

//! What Newton steps of the full shell in each frame make of the loads at a fifth of the size, as they go on from frame to frame.

use crate::cases::{self, Case};
use crate::scenes::{Part, Scene};
use crate::{AT, NEARLY, corrected};
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::State;
use std::sync::Arc;

/// Frames of the way from one strength to the next.
const FRAMES: usize = 24;
const MODES: usize = 8;

/// The table's head.
pub const HEADER: &str = "| shell | fields | form | at most 5 % off | median, % | with a step a frame | median, % | with two | median, % | as needed | median, % | at once | median, % | auto | median, % | at once | median, % |\n\
     |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

fn cell(errors: &mut [f64]) -> String {
    errors.sort_by(f64::total_cmp);
    let near = errors.iter().filter(|error| **error <= NEARLY).count();
    let median = errors.get(errors.len() / 2).map_or(f64::NAN, |error| 100.0 * error);
    format!("{near} of {} | {median:.2}", errors.len())
}

/// The row of a scene by what its gate takes with so many fields; of the loads that nothing was chosen by.
pub fn row(scene: &Scene, fields: usize) -> String {
    let reduced = reduced::Options { fields, poses: reduced::MAX_POSES, ..Default::default() };
    let options = Options { modes: MODES, reduced, may_be_full: true, ..Options::default() };
    let model = Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap();
    let (method, auto, model) = (model.chosen_form(), model.chosen_method(), Arc::new(model));
    let counts =
        |case: &Case| case.part != Part::Validation && case.is_confirmed() && case.aim == AT && case.came_near();
    let (mut errors, mut needed, mut chosen) = ([vec![], vec![], vec![]], [vec![], vec![]], [vec![], vec![]]);
    for case in cases::find(scene).iter().filter(|case| counts(case)) {
        for (steps, errors) in errors.iter_mut().enumerate() {
            let state = cases::led(scene, (&model, method), case, FRAMES, &mut |state| {
                let _ = state.correct(steps); // the next frame goes on from what there is
            });
            let error = state.and_then(|state| corrected(scene, &state, steps, case));
            errors.push(error.unwrap_or(f64::INFINITY));
        }
        for (frames, errors) in [FRAMES, 1].into_iter().zip(&mut needed) {
            let mut correct = |state: &mut State| state.correct_as_needed(&mut |_| Ok(())).unwrap();
            let state = cases::led(scene, (&model, method), case, frames, &mut correct);
            let kept = state.and_then(|state| corrected(scene, &state, usize::from(state.is_corrected()), case));
            errors.push(kept.unwrap_or(f64::INFINITY));
        }
        for (frames, errors) in [FRAMES, 1].into_iter().zip(&mut chosen) {
            let state = cases::led(scene, (&model, auto), case, frames, &mut |_| ());
            errors.push(state.and_then(|state| corrected(scene, &state, 0, case)).unwrap_or(f64::INFINITY));
        }
    }
    let cells: Vec<String> =
        errors.iter_mut().chain(&mut needed).chain(&mut chosen).map(|errors| cell(errors)).collect();
    format!("| {} | {fields} | {method:?} | {} |\n", scene.key, cells.join(" | "))
}

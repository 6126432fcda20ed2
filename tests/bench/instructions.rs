//! One run-time or precompute kernel to be counted, instruction by instruction, by valgrind's callgrind, which
//! tests/bench/instructions.py starts. Only what `measured` does is counted.
//!
//! usage: instructions CASE, or no argument for the list of cases
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod scene;

use scene::FRAME;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, Space, State};
use std::hint::black_box;
use std::sync::Arc;

/// The function that callgrind counts in; never inlined, so that it has a name.
#[inline(never)]
fn measured(work: &mut dyn FnMut()) {
    work();
}

fn step(method: Method, double: bool) {
    let mut state = scene::moving(&scene::model(1000, 8, double), method);
    measured(&mut || state.step(FRAME).expect("a step"));
    black_box(state.save());
}

/// The compiler must take this for used.
fn consume<T: ?Sized>(result: &T) {
    black_box(result);
}

fn read(work: impl Fn(&State)) {
    let state = scene::moving(&scene::model(1000, 8, false), Method::Warp);
    measured(&mut || work(&state));
}

fn constraint_step() {
    let mut state = scene::moving(&scene::model(1000, 8, false), Method::Warp);
    let mut place = [0.0; 3];
    state.positions(Space::World, |v, x| {
        if v == 999 {
            place = x.into();
        }
    });
    let target = Target::Position(place.into());
    let handle = Constraint { id: 0, vertex: 999, axes: [true; 3], compliance: 0.0, target };
    state.set_constraint(handle).expect("a vertex");
    measured(&mut || state.step(FRAME).expect("a step"));
}

fn precompute() {
    let shell = Arc::new(common::reference("v_beam").0);
    let options = Options { modes: 8, ..Options::default() };
    measured(&mut || consume(&Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).expect("modes")));
}

const CASES: [(&str, fn()); 10] = [
    ("step, LMA", || step(Method::LinearModalAnalysis, false)),
    ("step, warp", || step(Method::Warp, false)),
    ("step, virtual work", || step(Method::VirtualWorkWarp, false)),
    ("step, warp, f64 basis", || step(Method::Warp, true)),
    ("step, warp, 1 handle", constraint_step),
    ("positions, f32", || read(|state| state.position_rows_f32(Space::World, |_, rows| consume(rows)))),
    ("positions, f64", || read(|state| state.position_rows(Space::World, |_, rows| consume(rows)))),
    ("rotations", || read(|state| state.rotations(Space::World, |_, rotation| consume(&rotation)).expect("rotations"))),
    ("report", || read(|state| consume(&state.report()))),
    ("precompute, V-beam", precompute),
];

fn main() {
    match std::env::args().nth(1) {
        None => CASES.iter().for_each(|(name, _)| println!("{name}")),
        Some(wanted) => {
            let case = CASES.iter().find(|(name, _)| *name == wanted);
            let (_, run) = case.unwrap_or_else(|| panic!("there is no case {wanted:?}"));
            run();
        }
    }
}

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
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use std::hint::black_box;
use std::sync::Arc;

/// The function that callgrind counts in; never inlined, so that it has a name.
#[inline(never)]
fn measured(work: &mut dyn FnMut()) {
    work();
}

fn step(method: Method, precision: Precision) {
    let mut state = scene::moving(&scene::model(1000, 8, precision), method);
    measured(&mut || state.step(FRAME).expect("a step"));
    black_box(state.save());
}

/// The compiler must take this for used.
fn consume<T: ?Sized>(result: &T) {
    black_box(result);
}

fn read(work: impl Fn(&State)) {
    let state = scene::moving(&scene::model(1000, 8, Precision::F32), Method::Warp);
    measured(&mut || work(&state));
}

fn constraint_step() {
    let mut state = scene::moving(&scene::model(1000, 8, Precision::F32), Method::Warp);
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

/// Of a strip of 200 vertices: a step of the polynomial shell does not know the mesh.
fn polynomial_step(n: usize) {
    let mut state = scene::moving(&scene::clamped_model(200, n - 8), Method::PolynomialShell);
    measured(&mut || state.step(FRAME).expect("a step"));
    black_box(state.save());
}

/// Of the same strip as a sheet in engineering units.
fn sheet_step(method: Method, n: usize) {
    let mut state = scene::moving(&scene::clamped_sheet_model(200, n - 8), method);
    measured(&mut || state.step(FRAME).expect("a step"));
    black_box(state.save());
}

fn reduced_step(n: usize) {
    let mut state = scene::moving(&scene::clamped_model(200, n - 8), Method::ReducedShell);
    measured(&mut || state.step(FRAME).expect("a step"));
    black_box(state.save());
}

/// Of the same strip, from fields in 32 bits or in 16.
fn fields_read(precision: Precision) {
    let mut model = Model::load(&scene::clamped_model(200, 20).save().expect("bytes")).expect("what was saved");
    let shell = model.shell.clone();
    let reduced = model.reduced.as_mut().and_then(Arc::get_mut).expect("a reduced shell of its own");
    reduced.set_output(&shell, precision).expect("memory");
    let state = scene::moving(&Arc::new(model), Method::PolynomialShell);
    measured(&mut || state.position_rows_f32(Space::World, |_, rows| consume(rows)));
}

fn precompute() {
    let shell = Arc::new(common::reference("v_beam").0);
    let options = Options { modes: 8, ..Options::default() };
    measured(&mut || consume(&Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).expect("modes")));
}

const CASES: [(&str, fn()); 18] = [
    ("step, LMA", || step(Method::LinearModalAnalysis, Precision::F32)),
    ("step, warp", || step(Method::Warp, Precision::F32)),
    ("step, virtual work", || step(Method::VirtualWorkWarp, Precision::F32)),
    ("step, warp, f64 basis", || step(Method::Warp, Precision::F64)),
    ("step, warp, i16 basis", || step(Method::Warp, Precision::I16)),
    ("step, warp, 1 handle", constraint_step),
    ("step, polynomial, 20", || polynomial_step(20)),
    ("step, polynomial, 28", || polynomial_step(28)),
    ("step, polynomial, sheet", || sheet_step(Method::PolynomialShell, 20)),
    ("step, reduced, 20", || reduced_step(20)),
    ("step, reduced, sheet", || sheet_step(Method::ReducedShell, 20)),
    ("positions, f32", || read(|state| state.position_rows_f32(Space::World, |_, rows| consume(rows)))),
    ("positions, f64", || read(|state| state.position_rows(Space::World, |_, rows| consume(rows)))),
    ("positions, 28 fields", || fields_read(Precision::F32)),
    ("positions, 28 fields, i16", || fields_read(Precision::I16)),
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

//! A scene for callgrind to count a step of, and what the plan of that step says: tests/bench/leave_out.py starts it.
//!
//! usage: leave_out CASE | leave_out --plan CASE | leave_out --cases
#![allow(missing_docs)]

mod scene;

use scene::{FRAME, frame};
use shellwarp::Vec3;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::Wind;
use shellwarp::model::Precision;
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use std::hint::black_box;

/// The function that callgrind counts in; never inlined, so that it has a name.
#[inline(never)]
fn measured(state: &mut State, h: f64) {
    state.step(h).expect("a step");
}

/// What acts on the scene beside gravity.
#[derive(Clone, Copy, Default)]
struct Acts {
    forces: u32,
    wind: bool,
    spin: bool,
    handles: u32,
    /// All of it was there for a step and was taken away again.
    gone: bool,
    /// The model has Φ alone.
    linear: bool,
    exact: bool,
    asleep: bool,
    /// A clamped strip, with so many fields of the reduced shell.
    fields: Option<usize>,
}

struct Case {
    name: &'static str,
    vertices: usize,
    modes: usize,
    method: Method,
    acts: Acts,
}

const NOTHING: Acts = Acts {
    forces: 0,
    wind: false,
    spin: false,
    handles: 0,
    gone: false,
    linear: false,
    exact: false,
    asleep: false,
    fields: None,
};

const fn case(name: &'static str, vertices: usize, modes: usize, method: Method, acts: Acts) -> Case {
    Case { name, vertices, modes, method, acts }
}

const CASES: [Case; 44] = [
    case("warp", 1000, 8, Method::Warp, NOTHING),
    case("warp, 4 modes", 1000, 4, Method::Warp, NOTHING),
    case("warp, 16 modes", 1000, 16, Method::Warp, NOTHING),
    case("warp, 50 modes", 1000, 50, Method::Warp, NOTHING),
    case("warp, 200 vertices", 200, 8, Method::Warp, NOTHING),
    case("warp, 5000 vertices", 5000, 8, Method::Warp, NOTHING),
    case("warp, exact propagator", 1000, 8, Method::Warp, Acts { exact: true, ..NOTHING }),
    case("virtual work", 1000, 8, Method::VirtualWorkWarp, NOTHING),
    case("virtual work, 4 modes", 1000, 4, Method::VirtualWorkWarp, NOTHING),
    case("virtual work, 16 modes", 1000, 16, Method::VirtualWorkWarp, NOTHING),
    case("linear", 1000, 8, Method::LinearModalAnalysis, NOTHING),
    case("linear, no rotations stored", 1000, 8, Method::LinearModalAnalysis, Acts { linear: true, ..NOTHING }),
    case("linear, force on each vertex", 1000, 8, Method::LinearModalAnalysis, Acts { forces: 1000, ..NOTHING }),
    case("linear, 3 forces", 1000, 8, Method::LinearModalAnalysis, Acts { forces: 3, ..NOTHING }),
    case("linear, turning frame", 1000, 8, Method::LinearModalAnalysis, Acts { spin: true, ..NOTHING }),
    case("warp, 3 forces", 1000, 8, Method::Warp, Acts { forces: 3, ..NOTHING }),
    case("warp, 30 forces", 1000, 8, Method::Warp, Acts { forces: 30, ..NOTHING }),
    case("warp, force on each vertex", 1000, 8, Method::Warp, Acts { forces: 1000, ..NOTHING }),
    case("warp, wind", 1000, 8, Method::Warp, Acts { wind: true, ..NOTHING }),
    case("warp, turning frame", 1000, 8, Method::Warp, Acts { spin: true, ..NOTHING }),
    case("virtual work, turning frame", 1000, 8, Method::VirtualWorkWarp, Acts { spin: true, ..NOTHING }),
    case("warp, 1 handle", 1000, 8, Method::Warp, Acts { handles: 1, ..NOTHING }),
    case("warp, 1 handle, 16 modes", 1000, 16, Method::Warp, Acts { handles: 1, ..NOTHING }),
    case("warp, 2 handles, 16 modes", 1000, 16, Method::Warp, Acts { handles: 2, ..NOTHING }),
    case("linear, 16 modes", 1000, 16, Method::LinearModalAnalysis, NOTHING),
    case("linear, turning frame, 16 modes", 1000, 16, Method::LinearModalAnalysis, Acts { spin: true, ..NOTHING }),
    case("warp, 3 forces, 16 modes", 1000, 16, Method::Warp, Acts { forces: 3, ..NOTHING }),
    case("warp, turning frame, 16 modes", 1000, 16, Method::Warp, Acts { spin: true, ..NOTHING }),
    case("virtual work, 3 forces", 1000, 8, Method::VirtualWorkWarp, Acts { forces: 3, ..NOTHING }),
    case(
        "warp, all of it once and gone",
        1000,
        8,
        Method::Warp,
        Acts { forces: 30, wind: true, spin: true, handles: 1, gone: true, ..NOTHING },
    ),
    case("rotation-strain", 1000, 8, Method::RotationStrain, NOTHING),
    case("rotation-strain, 4 modes", 1000, 4, Method::RotationStrain, NOTHING),
    case("rotation-strain, 16 modes", 1000, 16, Method::RotationStrain, NOTHING),
    case("rotation-strain, 3 forces", 1000, 8, Method::RotationStrain, Acts { forces: 3, ..NOTHING }),
    case("rotation-strain, force on each vertex", 1000, 8, Method::RotationStrain, Acts { forces: 1000, ..NOTHING }),
    case("rotation-strain, turning frame", 1000, 8, Method::RotationStrain, Acts { spin: true, ..NOTHING }),
    case("implicit shell, 200 vertices", 200, 8, Method::ImplicitShell, Acts { fields: Some(0), ..NOTHING }),
    case("implicit shell, 1000 vertices", 1000, 8, Method::ImplicitShell, Acts { fields: Some(0), ..NOTHING }),
    case("implicit shell, 3000 vertices", 3000, 8, Method::ImplicitShell, Acts { fields: Some(0), ..NOTHING }),
    case("explicit shell", 200, 8, Method::ExplicitShell, Acts { fields: Some(0), ..NOTHING }),
    case("reduced shell, 12 fields", 400, 8, Method::ReducedShell, Acts { fields: Some(12), ..NOTHING }),
    case("reduced shell, 40 fields", 400, 8, Method::ReducedShell, Acts { fields: Some(40), ..NOTHING }),
    case(
        "reduced shell, 24 fields, 1000 vertices",
        1000,
        8,
        Method::ReducedShell,
        Acts { fields: Some(24), ..NOTHING },
    ),
    case("warp, at rest", 1000, 8, Method::Warp, Acts { asleep: true, ..NOTHING }),
];

fn act(state: &mut State, acts: &Acts) {
    let n = state.model().shell.mass.len() as u32;
    if acts.forces > 0 {
        let force = |i: u32| (i * (n / acts.forces) % n, Vec3::new(1e-5, 2e-5, -1e-5));
        state.set_forces((0..acts.forces).map(force), false).expect("vertices");
    }
    if acts.wind {
        let wind = Wind { velocity: Vec3::new(0.1, 0.2, 0.3), density: 1e-3, normal_drag: 1.0, ..Wind::default() };
        state.set_wind(wind).expect("a build with wind");
    }
    for id in 0..acts.handles {
        let vertex = n / (id + 2);
        let mut place = Vec3::zeros();
        state.positions(Space::World, |v, x| place = if v as u32 == vertex { x } else { place });
        let target = Target::Position(place);
        let handle = Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target };
        state.set_constraint(handle).expect("a vertex");
    }
    if acts.spin {
        // So slow that the load is taken once more in the middle of the step.
        let rates = Rates { angular_velocity: Vec3::new(0.0, 0.0, 0.3), ..Rates::default() };
        state.set_frame(Pose::identity(), FrameMotion::Given(rates));
    }
}

fn prepare(case: &Case) -> State {
    let Case { vertices, modes, method, acts, .. } = *case;
    let model = match acts.fields {
        Some(fields) => scene::clamped_model(vertices, fields),
        None if acts.linear => scene::linear_model(vertices, modes),
        None => scene::model(vertices, modes, Precision::F32),
    };
    let mut state = scene::moving(&model, method);
    if acts.exact {
        let mut exact = State::new(model, method, Integrator::Exact).expect("a modal state");
        let (q, q_dot) = state.amplitudes().expect("a modal state");
        exact.set_amplitudes(q, q_dot).expect("in range");
        exact.set_gravity(Vec3::new(0.0, 0.2, -0.8)).expect("finite");
        exact.set_damping(&Damping { mass_coefficient: 1.0, ..Damping::default() }).expect("finite");
        state = exact;
    }
    act(&mut state, &acts);
    if acts.gone {
        state.step(FRAME).expect("a step");
        state.set_forces(vec![], false).expect("none");
        state.set_wind(Wind::default()).expect("none");
        state.clear_constraints();
        state.step(FRAME).expect("a step: the frame comes to rest");
    }
    if acts.handles > 0 && !acts.gone {
        state.step(FRAME).expect("a step"); // whose iterations the plan goes by
        act(&mut state, &acts);
    }
    if acts.asleep {
        state.set_rest_tolerance(1e6).expect("a length");
        state.step(FRAME).expect("a step");
        assert!(state.is_asleep());
    }
    state
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let find = |name: &str| CASES.iter().find(|case| case.name == name).unwrap_or_else(|| panic!("no case {name:?}"));
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--cases"] => CASES.iter().for_each(|case| println!("{}", case.name)),
        ["--plan", name] => {
            let case = find(name);
            let parts = prepare(case).plan(frame(case.method)).expect("a plan");
            let operations: f64 = parts.iter().map(|part| part.operations).sum();
            let bytes: usize = parts.iter().map(|part| part.bytes).sum();
            println!("{operations:.0} {bytes}");
        }
        [name] => {
            let held = allocation_counter::measure(|| {
                let case = find(name);
                let mut state = prepare(case);
                measured(&mut state, frame(case.method));
                black_box(state.save());
            });
            println!("bytes held: {}", held.bytes_max);
        }
        _ => panic!("usage: leave_out CASE | --plan CASE | --cases"),
    }
}

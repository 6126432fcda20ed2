//! What a scene does not need is left out, and the result is that of the whole work within the bound stated where it is left
//! out.

use crate::common::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::Wind;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::modes::Demand;
use shellwarp::state::{Damping, Method, PartKind, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Shell, Supports, Vec3};
use std::sync::Arc;

const MODAL: [Method; 3] = [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp];
const FRAME: f64 = 1.0 / 30.0;

fn model(name: &str, options: Options) -> Arc<Model> {
    Arc::new(Model::precompute(Arc::new(reference(name).0), &options, &mut |_, _| Ok(())).unwrap())
}

fn in_f64(modes: usize) -> Options {
    Options { modes, precision: Precision::F64, ..Options::default() }
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap()
}

/// Gives every vertex a force, mostly zero, so that all work is done.
fn with_all_work(state: &mut State, forces: &[(u32, Vec3)]) {
    let n = state.model().shell.mass.len() as u32;
    state.set_forces((0..n).map(|v| (v, Vec3::zeros())).chain(forces.iter().copied()), false).unwrap();
}

fn spinning() -> FrameMotion {
    let rates = Rates { angular_velocity: Vec3::new(0.3, -0.2, 0.9), ..Rates::default() };
    FrameMotion::Given(rates)
}

/// Largest difference of amplitudes and of rates between two states, relative to the largest amplitude and rate.
fn difference(a: &State, b: &State) -> f64 {
    let ((qa, va), (qb, vb)) = (a.amplitudes().unwrap(), b.amplitudes().unwrap());
    let relative = |a: &[f64], b: &[f64]| {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        apart / a.iter().fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()))
    };
    relative(qa, qb).max(relative(va, vb))
}

#[test]
fn forces_on_few_vertices_do_what_the_same_forces_among_those_of_all_do() {
    let model = model("v_beam", in_f64(8));
    let forces =
        [(204, Vec3::new(0.02, -0.03, 0.05)), (17, Vec3::new(0.0, 0.1, 0.0)), (204, Vec3::new(0.0, 0.0, 0.04))];
    for method in MODAL {
        for spin in [false, true] {
            let (mut few, mut all) = (state(&model, method), state(&model, method));
            for state in [&mut few, &mut all] {
                state.set_gravity(Vec3::new(0.1, 0.2, -0.8)).unwrap();
            }
            few.set_forces(forces.to_vec(), false).unwrap();
            with_all_work(&mut all, &forces);
            for _ in 0..60 {
                for state in [&mut few, &mut all] {
                    let motion = if spin { spinning() } else { FrameMotion::Continuous };
                    state.set_frame(Pose::identity(), motion);
                    state.step(FRAME).unwrap();
                }
            }
            // Rounding, over 60 steps of sums in another order.
            assert!(difference(&few, &all) < 1e-11, "{method:?}: {:e}", difference(&few, &all));
        }
    }
}

#[test]
fn a_uniform_load_in_linear_modal_analysis_needs_no_vertex() {
    let model = model("v_beam", in_f64(8));
    let (mut short, mut all) = (state(&model, Method::LinearModalAnalysis), state(&model, Method::LinearModalAnalysis));
    for state in [&mut short, &mut all] {
        state.set_gravity(Vec3::new(3.0, 2.0, -5.0)).unwrap();
    }
    with_all_work(&mut all, &[]);
    for _ in 0..60 {
        short.step(FRAME).unwrap();
        all.step(FRAME).unwrap();
    }
    assert!(difference(&short, &all) < 1e-11, "{:e}", difference(&short, &all)); // rounding
}

/// Modal force of gravity at amplitudes that turn vertices by about `turn`, from one step out of rest: q̇ = h f/(1 + h²λ) − ….
fn rates_after_a_step(model: &Arc<Model>, method: Method, turn: f64, whole: bool) -> Vec<f64> {
    let mut state = state(model, method);
    let modes = model.modal.n_modes() as f64;
    let q: Vec<f64> = model.modal.largest_rotation.iter().map(|psi| turn / (modes * psi)).collect();
    state.set_amplitudes(&q, &vec![0.0; q.len()]).unwrap();
    state.set_gravity(Vec3::new(0.3, 0.4, -0.8)).unwrap();
    if whole {
        with_all_work(&mut state, &[]);
    }
    state.step(1e-6).unwrap(); // so short that only the force tells
    state.amplitudes().unwrap().1.to_vec()
}

#[test]
fn gravity_near_the_rest_shape_is_taken_to_first_order_within_a_millionth_of_the_load() {
    let model = model("v_beam", in_f64(8));
    for method in [Method::Warp, Method::VirtualWorkWarp] {
        for (turn, first_order) in [(1.39e-3, true), (7e-4, true), (1.41e-3, false), (0.3, false)] {
            let (short, whole) =
                (rates_after_a_step(&model, method, turn, false), rates_after_a_step(&model, method, turn, true));
            let mut apart = 0.0f64;
            for (k, (a, b)) in short.iter().zip(&whole).enumerate() {
                // |f_k| is at most Σ m |g| |φ_k|.
                let reach: f64 =
                    model.shell.mass.iter().enumerate().map(|(v, m)| m * model.modal.mode_at(k, v).0.norm()).sum();
                apart = apart.max((a - b).abs() / (1e-6 * reach * Vec3::new(0.3, 0.4, -0.8).norm()));
            }
            println!("{method:?}, {turn} rad: {apart:e} of the load");
            if first_order {
                assert!(apart > 1e-12 && apart < 1e-6, "{method:?} at {turn} rad: {apart:e}");
            } else {
                assert!(apart < 1e-13, "{method:?} at {turn} rad: {apart:e}"); // the same sums, in another order at most
            }
        }
    }
}

/// Deformed positions in frame axes.
fn positions(state: &State) -> Vec<Vec3> {
    let mut x = vec![];
    state.positions(Space::Frame, |_, position| x.push(position));
    x
}

#[test]
fn a_model_for_linear_modal_analysis_alone_moves_to_the_same_bits_in_half_the_memory() {
    let (whole, linear) = (
        model("v_beam", Options { modes: 8, ..Options::default() }),
        model("v_beam", Options { modes: 8, linear: true, ..Options::default() }),
    );
    let (mut a, mut b) = (state(&whole, Method::LinearModalAnalysis), state(&linear, Method::LinearModalAnalysis));
    for state in [&mut a, &mut b] {
        state.set_gravity(Vec3::new(0.0, 0.4, -0.8)).unwrap();
        state.set_frame(Pose::identity(), spinning());
        for _ in 0..30 {
            state.step(FRAME).unwrap();
        }
    }
    assert_eq!(positions(&a), positions(&b));
    let (shown, bound) = (a.report(), b.report());
    assert_eq!((shown.max_displacement, shown.elastic_energy), (bound.max_displacement, bound.elastic_energy));
    // Ψq by way of Φq, whose f32 rounding is a share of 6e-8 of displacements ten and more times an edge's.
    assert_close("rotation", bound.max_rotation, shown.max_rotation, 1e-5, shown.max_rotation);
    // Three lines a mode instead of six, of 16 numbers of 4 bytes for each block of 16 vertices.
    let blocks = whole.shell.mass.len().div_ceil(16);
    assert_eq!(whole.bytes() - linear.bytes(), blocks * 3 * 8 * 64 + 8 * 8 * size_of::<Vec3>() + 2 * 8 * 8);

    // Saved likewise, and loaded to the same.
    let bytes = linear.save().unwrap();
    assert_eq!(whole.save().unwrap().len() - bytes.len(), whole.shell.mass.len() * 3 * 8 * 4);
    let loaded = Arc::new(Model::load(&bytes).unwrap());
    assert!(loaded.modal.is_linear() && loaded.save().unwrap() == bytes);
    let mut c = state(&loaded, Method::LinearModalAnalysis);
    c.load(&b.save()).unwrap();
    assert_eq!(positions(&b), positions(&c));

    for method in [Method::Warp, Method::VirtualWorkWarp] {
        let refused = State::new(linear.clone(), method, Integrator::ImplicitEuler).err().expect("no rotations");
        assert_eq!(refused.kind, ErrorKind::Unsupported);
    }
    assert_eq!(b.rotations(Space::Frame, |_, _| ()).unwrap_err().kind, ErrorKind::Unsupported);
    let target = Target::Orientation(nalgebra::UnitQuaternion::identity());
    let handle = Constraint { id: 0, vertex: 204, axes: [true; 3], compliance: 0.0, target };
    assert_eq!(b.set_constraint(handle).unwrap_err().kind, ErrorKind::Unsupported);
}

#[test]
fn a_model_for_linear_modal_analysis_alone_computes_no_modal_rotations() {
    let shell = Arc::new(reference("v_beam").0);
    let demand = Demand { tolerance: 1e-4, gravity: Vec3::z(), amplification: 1.0, ..Demand::default() };
    for demand in [None, Some(demand)] {
        let made = |linear: bool| {
            let options = Options { modes: 8, linear, demand: demand.clone(), ..Options::default() };
            let mut model = None;
            let counted = allocation_counter::measure(|| {
                model = Some(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
            });
            (model.unwrap(), counted.bytes_total)
        };
        let ((whole, all), (linear, fewer)) = (made(false), made(true));
        assert!(
            linear.modal.largest_rotation.is_empty()
                && linear.modal.largest_swing.is_empty()
                && linear.modal.mode_at(0, 7).1 == Vec3::zeros()
        );
        assert_eq!(whole.modal.mode_at(0, 7).0, linear.modal.mode_at(0, 7).0);
        // The operator W has three matrices and the corners of each triangle; Ψ a vector for each vertex and mode.
        let (n, triangles) = (shell.mass.len(), shell.mesh.triangles.len());
        let operator = (3 * 72 + 12) * triangles + 8 * n;
        let stored = whole.bytes() - linear.bytes();
        assert!(all >= fewer + (operator + 24 * n * linear.modal.n_modes() + stored) as u64, "{all} and {fewer} bytes");
    }
}

/// Far beyond half a turn, held by a handle that is out of reach, in a frame that spins faster than the shell's own frequency.
#[test]
fn without_rotations_guards_and_handles_of_linear_modal_analysis_give_the_same_bits() {
    for precision in [Precision::F32, Precision::F64, Precision::I16] {
        let options = Options { modes: 8, precision, ..Options::default() };
        let (whole, linear) = (model("v_beam", options.clone()), model("v_beam", Options { linear: true, ..options }));
        let (mut a, mut b) = (state(&whole, Method::LinearModalAnalysis), state(&linear, Method::LinearModalAnalysis));
        for state in [&mut a, &mut b] {
            state.set_gravity(Vec3::new(0.0, 40.0, -80.0)).unwrap();
            state.set_frame(Pose::identity(), spinning());
            let target = Target::Position(Vec3::new(0.2, 3.0, 2.0));
            let handle = Constraint { id: 0, vertex: 204, axes: [true; 3], compliance: 0.0, target };
            for k in 0..90 {
                match k {
                    30 => state.set_constraint(handle).unwrap(),
                    60 => state.clear_constraint(0).unwrap(),
                    _ => (),
                }
                state.step(FRAME).unwrap();
            }
        }
        assert_eq!(positions(&a), positions(&b));
        assert_eq!(a.save(), b.save());
        assert_eq!(a.report().elastic_energy, b.report().elastic_energy);
        // Ten times the load of half a turn bends it by no more than the guard lets it, 3π/2 model sizes in the eight modes together.
        let (far, size) = (a.report().max_displacement, whole.shell.mesh.size);
        assert!(far > 0.1 * size && far < 8f64.sqrt() * 1.5 * std::f64::consts::PI * size, "{far} of {size}");
    }
}

#[test]
fn a_plan_says_where_modes_are_missing() {
    // The first mode of a cantilever carries 61.3 % of its mass across (Euler–Bernoulli; the coarse mesh 62.5 %), none along.
    let model = model("flat_beam", Options { modes: 1, ..Options::default() });
    let mut state = state(&model, Method::Warp);
    for (gravity, missing) in [(Vec3::new(0.0, 0.0, -1.0), false), (Vec3::new(1.0, 0.0, 0.0), true)] {
        state.set_gravity(gravity).unwrap();
        let parts = state.plan(FRAME).unwrap();
        let modes = parts.iter().find(|part| part.kind == PartKind::Modes).unwrap();
        assert_eq!(modes.reason.contains("missing"), missing, "{}", modes.reason);
    }
    assert_close("first mode across", model.modal.effective_mass().z, 0.613, 0.05, 0.0);
}

#[test]
fn a_nonlinear_shell_is_planned_by_its_last_step_and_without_unknowns() {
    let model = model("v_beam", in_f64(4));
    let mut state = state(&model, Method::ImplicitShell);
    state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
    let shell_part = |state: &State| {
        let parts = state.plan(1.0 / 60.0).unwrap();
        let part = parts.into_iter().find(|part| part.kind == PartKind::NonlinearShell).unwrap();
        (part.operations, part.reason)
    };
    assert!(shell_part(&state).1.ends_with("before any step"));
    state.step(1.0 / 60.0).unwrap();
    let (operations, reason) = shell_part(&state);
    assert!(operations > 0.0 && reason.ends_with("as in the last step"), "{reason}");

    let (shell, _) = reference("v_beam");
    let fixed = (0..shell.mass.len() as u32).collect();
    let held = Shell::new((*shell.mesh).clone(), shell.material, &Supports { fixed, ..Default::default() }).unwrap();
    let held = Arc::new(Model::precompute(Arc::new(held), &in_f64(0), &mut |_, _| Ok(())).unwrap());
    shell_part(&State::new(held, Method::ImplicitShell, Integrator::Exact).unwrap());
}

#[test]
fn the_positions_of_some_vertices_are_those_among_all() {
    let model = model("v_beam", Options::default());
    let n = model.shell.mass.len() as u32;
    for method in [Method::LinearModalAnalysis, Method::Warp, Method::ImplicitShell] {
        let mut state = state(&model, method);
        state.set_gravity(Vec3::new(0.0, 0.4, -0.8)).unwrap();
        state.set_frame(Pose { origin: Vec3::new(1.0, 2.0, 3.0), ..Pose::identity() }, FrameMotion::Teleport);
        (0..5).for_each(|_| state.step(FRAME).unwrap());
        let (mut wide, mut narrow) = (vec![], vec![]);
        state.position_rows(Space::World, |_, rows| wide.extend_from_slice(rows));
        state.position_rows_f32(Space::World, |_, rows| narrow.extend_from_slice(rows));
        // None, one, the last, a block and the next's first, repeats and a disorder.
        for list in [vec![], vec![7], vec![n - 1], (16..33).collect(), vec![40, 3, 3, 41, n - 2, 0]] {
            let mut place = 0;
            state
                .positions_of(Space::World, &list, |i, x| {
                    assert_eq!((i, x), (place, wide[list[i] as usize]), "{method:?} {list:?}");
                    place += 1;
                })
                .unwrap();
            assert_eq!(place, list.len());
            let same = |i: usize, x: [f32; 3]| assert_eq!(x, narrow[list[i] as usize], "{method:?} {list:?}");
            state.positions_of_f32(Space::World, &list, same).unwrap();
        }
        let refused = state.positions_of(Space::World, &[0, n], |_, _| panic!("nothing is written")).unwrap_err();
        assert_eq!(
            (refused.kind, refused.message),
            (ErrorKind::InvalidArgument, format!("vertices[1] is vertex {n} of {n}"))
        );
    }
}

/// A state that is let go and comes to rest.
fn settling(model: &Arc<Model>, method: Method) -> State {
    let mut state = state(model, method);
    state.set_gravity(Vec3::new(0.0, 0.1, -0.3)).unwrap();
    state.set_damping(&Damping { ratios: vec![0.5], ..Damping::default() }).unwrap();
    state
}

#[test]
fn a_state_that_no_step_changes_sleeps_and_wakes_to_the_bits_of_one_that_never_slept() {
    let model = model("v_beam", in_f64(8));
    for method in MODAL {
        let mut sleeper = settling(&model, method);
        let mut steps = 0;
        while !sleeper.is_asleep() {
            sleeper.step(FRAME).unwrap();
            steps += 1;
            assert!(steps < 20_000, "{method:?} never rests");
        }
        let mut waker = sleeper.try_clone().unwrap();
        for _ in 0..10 {
            sleeper.step(FRAME).unwrap();
            waker.step(FRAME).unwrap();
            // A set of the same wakes nobody; a change and the change back do, and every step is then taken.
            sleeper.set_gravity(Vec3::new(0.0, 0.1, -0.3)).unwrap();
            assert!(sleeper.is_asleep());
            waker.set_gravity(Vec3::zeros()).unwrap();
            waker.set_gravity(Vec3::new(0.0, 0.1, -0.3)).unwrap();
            assert!(!waker.is_asleep());
        }
        println!("{method:?} rests after {steps} steps");
        assert_eq!(sleeper.save(), waker.save());
        sleeper.step(0.5 * FRAME).unwrap(); // another length is another function
        waker.step(0.5 * FRAME).unwrap();
        assert_eq!(sleeper.save(), waker.save());
    }
}

#[test]
fn everything_that_could_move_a_shell_wakes_it() {
    let model = model("v_beam", in_f64(8));
    let mut rested = settling(&model, Method::Warp);
    while !rested.is_asleep() {
        rested.step(FRAME).unwrap();
    }
    let handle = Constraint {
        id: 3,
        vertex: 204,
        axes: [true; 3],
        compliance: 0.0,
        target: Target::Position(Vec3::new(0.1, 0.2, 0.3)),
    };
    let wind = Wind { velocity: Vec3::x(), density: 1.0, normal_drag: 1.0, ..Wind::default() };
    let q = rested.amplitudes().unwrap().0.to_vec();
    let saved = rested.save();
    type Change<'a> = (&'a str, &'a dyn Fn(&mut State));
    let changes: [Change; 11] = [
        ("reset", &|s| s.reset()),
        ("gravity", &|s| s.set_gravity(Vec3::zeros()).unwrap()),
        ("forces", &|s| s.set_forces(vec![(5, Vec3::x())], false).unwrap()),
        ("forces for a step", &|s| s.set_forces(vec![(5, Vec3::x())], true).unwrap()),
        ("wind", &|s| s.set_wind(wind.clone()).unwrap()),
        ("damping", &|s| s.set_damping(&Damping::default()).unwrap()),
        ("frame", &|s| s.set_frame(Pose { origin: Vec3::x(), ..Pose::identity() }, FrameMotion::Continuous)),
        ("handle", &|s| s.set_constraint(handle).unwrap()),
        ("amplitudes", &|s| s.set_amplitudes(&q, &[1.0; 8]).unwrap()),
        ("equilibrium", &|s| _ = s.equilibrium().unwrap()),
        ("load", &|s| s.load(&saved).unwrap()),
    ];
    for (name, change) in changes {
        let mut state = rested.try_clone().unwrap();
        assert!(state.is_asleep());
        change(&mut state);
        assert!(!state.is_asleep(), "{name} does not wake");
        state.step(FRAME).unwrap();
    }
}

#[test]
fn a_tolerance_rests_sooner_and_stays_that_close_to_where_it_would_have_come_to_rest() {
    let model = model("v_beam", Options { modes: 8, ..Options::default() });
    for method in MODAL {
        let mut rested = settling(&model, method);
        rested.equilibrium().unwrap();
        let goal = positions(&rested);
        let mut last_steps = usize::MAX;
        for tolerance in [1e-5, 1e-3, 1e-2] {
            let mut state = settling(&model, method);
            state.set_rest_tolerance(tolerance).unwrap();
            let mut steps = 0;
            while !state.is_asleep() {
                state.step(FRAME).unwrap();
                steps += 1;
                assert!(steps < 20_000, "{method:?} never rests");
            }
            let apart = positions(&state).iter().zip(&goal).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            println!("{method:?}, {tolerance}: {steps} steps, {apart:e} from rest");
            // The bound is of first order in what is left: the load's own change with the turn is not in it.
            assert!(apart <= 1.1 * tolerance && steps <= last_steps);
            assert_eq!(state.report().kinetic_energy, 0.0);
            last_steps = steps;
        }
    }
    assert!(state(&model, Method::Warp).set_rest_tolerance(-1.0).is_err());
    assert!(state(&model, Method::Warp).set_rest_tolerance(f64::NAN).is_err());
}

//! Rotation–strain reconstruction: its force, what it keeps, and its errors against the full shell.

use crate::common::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::BodyLoad;
use shellwarp::load::{External, Wind};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, PartKind, Space, State};
use shellwarp::step::Integrator;
use shellwarp::strain::{MOST_SAMPLES, poisson::Poisson};
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::{Arc, OnceLock};

fn model(shell: Shell, precision: Precision) -> Arc<Model> {
    let options = Options { modes: 8, precision, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn flat() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(reference("flat_beam").0, Precision::F64))
}

fn vee() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(reference("v_beam").0, Precision::F64))
}

fn free_sheet() -> Shell {
    let (rest, triangles) = equilateral_sheet(8, 6, 0.1);
    Shell::new(Mesh::new(rest, &triangles).unwrap(), Material::default(), &Supports::default()).unwrap()
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::Exact).unwrap()
}

fn at_rest(model: &Arc<Model>, method: Method, gravity: Vec3) -> Vec<Vec3> {
    let mut state = state(model, method);
    state.set_gravity(gravity).unwrap();
    state.equilibrium().unwrap();
    displacements(&state)
}

/// Amplitudes whose rotations add up to `reach`, with shares as equal energies give.
fn amplitudes(model: &Model, rng: &mut StdRng, reach: f64) -> Vec<f64> {
    let softest = model.modal.eigenvalues.iter().copied().find(|lambda| *lambda > 0.0).unwrap();
    let q: Vec<f64> =
        model.modal.eigenvalues.iter().map(|lambda| rng.random_range(-1.0..1.0) / lambda.max(softest).sqrt()).collect();
    let turn: f64 = q.iter().zip(&model.modal.largest_rotation).map(|(q, r)| (q * r).abs()).sum();
    q.iter().map(|q| q * reach / turn).collect()
}

fn no_load() -> BodyLoad {
    BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default())
}

fn modal_force(model: &Model, load: &BodyLoad, external: External, q: &[f64], q_dot: &[f64]) -> Vec<f64> {
    let map = model.rotation_strain().unwrap();
    let mut force = vec![0.0; q.len()];
    map.project(&model.modal, (load, external), (q, q_dot), &mut map.scratch(&model.modal), &mut force);
    force
}

fn assert_same(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    let scale = b.iter().map(|x| x.abs()).fold(0.0, f64::max);
    a.iter().zip(b).for_each(|(a, b)| assert_close(what, *a, *b, tolerance, tolerance * scale));
}

const DOWN: Vec3 = Vec3::new(0.0, 0.0, -1.0);
const OBLIQUE: Vec3 = Vec3::new(0.0, 0.6, -0.8);

#[test]
fn the_modal_force_is_the_gradient_of_the_loads_work() {
    let mut rng = StdRng::seed_from_u64(31);
    let model = vee();
    let mut state = state(model, Method::RotationStrain);
    for reach in [0.0, 1e-3, 0.3, 3.0] {
        let q = amplitudes(model, &mut rng, reach);
        let loads: Vec<Vec3> =
            model.shell.mass.iter().map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        let rest = vec![0.0; q.len()];
        let force = modal_force(model, &no_load(), External::OnAll(&loads, &[]), &q, &rest);
        let largest = force.iter().map(|f| f.abs()).fold(0.0, f64::max);
        let mut work = |q: &[f64]| -> f64 {
            state.set_amplitudes(q, &rest).unwrap();
            displacements(&state).iter().zip(&loads).map(|(u, f)| u.dot(f)).sum()
        };
        for k in 0..q.len() {
            let step = 1e-3 / model.modal.largest_rotation[k];
            let mut at = |shift: f64| {
                let mut q = q.clone();
                q[k] += shift * step;
                work(&q)
            };
            let numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
            // Truncation (1e-3)⁴, rounding 1e-16/1e-3, times the sum over 369 vertices.
            assert_close(&format!("mode {k} at {reach}"), force[k], numeric, 1e-9, 1e-9 * largest);
        }
    }
}

#[test]
fn sums_taken_ahead_those_over_few_vertices_and_those_over_all_are_the_same() {
    let mut rng = StdRng::seed_from_u64(32);
    let model = vee();
    let (q, q_dot) = (amplitudes(model, &mut rng, 2.0), amplitudes(model, &mut rng, 3.0));
    let gravity = Vec3::new(0.3, 1.0, -2.0);
    let load = BodyLoad::new(gravity, &Pose::identity(), &Rates::default());
    let weight: Vec<Vec3> = model.shell.mass.iter().map(|m| *m * gravity).collect();
    let each: Vec<(u32, Vec3)> = (0..).zip(weight.iter().copied()).collect();
    let none = External::OnSome(&[], Default::default());
    let ahead = modal_force(model, &load, none, &q, &q_dot);
    let over_all = modal_force(model, &no_load(), External::OnAll(&weight, &[]), &q, &q_dot);
    let over_some = modal_force(model, &no_load(), External::OnSome(&each, Default::default()), &q, &q_dot);
    assert_same("ahead", &ahead, &over_all, 1e-12); // sums of 369 terms
    assert_same("some", &over_some, &over_all, 1e-12);
}

#[test]
fn loads_of_a_turning_frame_are_those_on_every_vertex_and_do_the_power_of_its_rates() {
    let mut rng = StdRng::seed_from_u64(33);
    let model = vee();
    let (q, q_dot) = (amplitudes(model, &mut rng, 1.0), amplitudes(model, &mut rng, 2.0));
    let rates = Rates {
        acceleration: Vec3::new(0.3, 0.1, -0.2),
        angular_velocity: Vec3::new(0.5, -1.0, 2.0),
        angular_acceleration: Vec3::new(0.1, 0.7, -0.4),
        ..Rates::default()
    };
    let load = BodyLoad::new(Vec3::new(0.0, 1.0, -9.0), &Pose::identity(), &rates);
    let (rest, n) = (&model.shell.mesh.positions, model.shell.mass.len());
    let (mut on_vertices, mut power) = (vec![Vec3::zeros(); n], 0.0);
    model.rotation_strain().unwrap().visit_motion(&model.modal, (&q, &q_dot), |v, u, rate| {
        on_vertices[v] = load.at(model.shell.mass[v], rest[v] + u, rate);
        power += on_vertices[v].dot(&rate);
    });
    let none = External::OnSome(&[], Default::default());
    let force = modal_force(model, &load, none, &q, &q_dot);
    assert_same("spin", &force, &modal_force(model, &no_load(), External::OnAll(&on_vertices, &[]), &q, &q_dot), 1e-12);
    let on_modes: f64 = force.iter().zip(&q_dot).map(|(f, v)| f * v).sum();
    assert_close("power", on_modes, power, 1e-11, 0.0);
}

#[test]
fn equilibria_have_the_errors_known_from_an_independent_implementation() {
    // Relative L2 error against the nonlinear shell, 8 modes, to the three digits that are known.
    let cases = [
        (flat(), 0.1 * DOWN, 0.005),
        (flat(), 0.4 * DOWN, 0.010),
        (flat(), 0.8 * DOWN, 0.008),
        (vee(), 3.0 * DOWN, 0.038),
        (vee(), 5.0 * DOWN, 0.086),
        (vee(), 3.0 * OBLIQUE, 0.031),
        (vee(), 5.0 * OBLIQUE, 0.062),
    ];
    for (model, gravity, expected) in cases {
        let exact = at_rest(model, Method::ImplicitShell, gravity);
        let own = at_rest(model, Method::RotationStrain, gravity);
        let (paper, own) = (error(&at_rest(model, Method::Warp, gravity), &exact), error(&own, &exact));
        println!("{gravity:?}: {own:.4} known {expected}, paper {paper:.4}");
        // Half a unit of the last digit, and what the samples leave.
        assert!((own - expected).abs() <= 0.0015, "{gravity:?}: {own} instead of {expected}");
        assert!(own < paper);
    }
}

#[test]
fn what_bends_without_stretching_keeps_its_area_and_the_samples_keep_to_the_poisson_solve() {
    let mut rng = StdRng::seed_from_u64(34);
    let model = flat();
    let shell = &model.shell;
    let area = |u: &[Vec3]| {
        let moved: Vec<Vec3> = shell.mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| moved[v as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        shell.mesh.triangles.iter().map(of).sum::<f64>() / shell.total_area - 1.0
    };
    let [own, warp] =
        [Method::RotationStrain, Method::VirtualWorkWarp].map(|method| area(&at_rest(model, method, 0.8 * DOWN)).abs());
    println!("area change {own:.1e}, the warp's {warp:.1e}");
    assert!(own < 2e-3 && own < 0.1 * warp);
    let (map, poisson) = (model.rotation_strain().unwrap(), Poisson::new(shell).unwrap());
    assert!(map.n_samples() <= MOST_SAMPLES && map.left <= 0.05, "{} leave {}", map.n_samples(), map.left);
    for reach in [0.3, 1.0, 2.0, 3.0] {
        let q = amplitudes(model, &mut rng, reach);
        let mut state = state(model, Method::RotationStrain);
        state.set_amplitudes(&q, &[0.0; 8]).unwrap();
        let n = shell.mass.len();
        let linear: Vec<Vec3> = (0..n).map(|v| (0..8).map(|k| q[k] * model.modal.mode_at(k, v).0).sum()).collect();
        let solved = poisson.reconstruct(shell, &linear).unwrap();
        let apart = error(&displacements(&state), &solved);
        println!("{reach} rad: {apart:.1e} from the solve, its area change {:.1e}", area(&solved));
        // The solve itself turns neighbours by less than 0.1 rad from one another: they stretch by the square of it.
        assert!(apart < 0.02 && area(&solved).abs() < 5e-3);
    }
}

#[test]
fn a_free_shell_turns_rigidly() {
    let model = model(free_sheet(), Precision::F64);
    let rest = model.shell.mesh.positions.clone();
    let mut state = state(&model, Method::RotationStrain);
    let last = rest.len() as u32 - 1;
    let turn = model.rotation_strain().unwrap();
    println!("{} samples leave {:.1e}", turn.n_samples(), turn.left);
    // The first six amplitudes are rigid.
    let mut q = vec![0.0; 8];
    for k in 0..6 {
        q[k] = 0.4 * (1.0 + k as f64);
    }
    state.set_amplitudes(&q, &[0.0; 8]).unwrap();
    let u = displacements(&state);
    assert!(state.report().max_rotation > 1.0, "{:?}", state.report());
    for (a, b) in [(0, last as usize), (3, 20), (last as usize, 1)] {
        let (before, after) = ((rest[a] - rest[b]).norm(), (rest[a] + u[a] - rest[b] - u[b]).norm());
        assert_close("distance", after, before, 1e-6, 0.0); // the samples' weights sum to 1 so far
    }
    // And its centre of mass goes where it is pulled.
    state.reset();
    state.set_gravity(DOWN).unwrap();
    (0..30).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert_close("fall", displacements(&state)[7].z, -0.5, 1e-3, 0.0);
}

#[test]
fn dead_loads_are_conservative_to_the_order_of_the_step() {
    let gravity = Vec3::new(0.0, 0.1, -0.4);
    let drift = |h: f64| {
        let model = flat();
        let mut state = state(model, Method::RotationStrain);
        state.set_gravity(gravity).unwrap();
        let (mut gain, mut kinetic) = (0.0f64, 0.0f64);
        for _ in 0..(40.0 / h) as usize {
            state.step(h).unwrap();
            let weight: f64 =
                displacements(&state).iter().zip(&model.shell.mass).map(|(u, m)| m * gravity.dot(u)).sum();
            let report = state.report();
            gain = gain.max((report.elastic_energy + report.kinetic_energy - weight).abs());
            kinetic = kinetic.max(report.kinetic_energy);
        }
        gain / kinetic
    };
    let [coarse, fine] = [1.0 / 60.0, 1.0 / 240.0].map(drift);
    println!("energy strays by {coarse:.1e}, {fine:.1e} of the largest kinetic energy");
    assert!(fine < 0.02 && fine < 0.5 * coarse, "{fine} after {coarse}");
}

#[test]
fn ten_and_a_hundred_times_the_load_stay_bounded() {
    for (model, g) in [(flat(), 4.0), (flat(), 40.0), (vee(), 30.0), (vee(), 300.0)] {
        let mut state = State::new(model.clone(), Method::RotationStrain, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(g * OBLIQUE).unwrap();
        for _ in 0..600 {
            state.step(1.0 / 30.0).unwrap();
            let report = state.report();
            assert!(report.max_displacement < 3.0 * model.shell.mesh.size, "{g}: {report:?}");
            assert_eq!(state.turn_in_range(&report), report.max_rotation <= shellwarp::strain::REACH);
        }
        println!("{g}: {:?}", state.report());
    }
}

#[test]
fn a_released_beam_swings_as_the_full_shell() {
    let tip = |state: &State| displacements(state)[204].norm();
    let swing = |method: Method, h: f64| {
        let mut state = state(flat(), method);
        state.set_gravity(0.3 * DOWN).unwrap();
        let mut far = [0.0; 3];
        let mut time = 0.0;
        loop {
            state.step(h).unwrap();
            (far, time) = ([far[1], far[2], tip(&state)], time + h);
            if far[2] < far[1] {
                return (time - h, far[1]);
            }
        }
    };
    // Backward Euler of the full shell loses and lags in proportion to its step.
    let [coarse, fine] = [200.0, 400.0].map(|rate| swing(Method::ImplicitShell, 1.0 / rate));
    let exact = (2.0 * fine.0 - coarse.0, 2.0 * fine.1 - coarse.1);
    let [own, warp] = [Method::RotationStrain, Method::Warp].map(|method| swing(method, 1.0 / 120.0));
    println!("{own:?}, full shell {exact:?}, paper {warp:?}");
    assert_close("half a period", own.0, exact.0, 0.03, 0.0);
    assert_close("amplitude", own.1, exact.1, 0.03, 0.0);
}

/// With forces and the tip's middle led.
fn busy(model: &Arc<Model>) -> State {
    let mut state = state(model, Method::RotationStrain);
    state.set_gravity(0.2 * OBLIQUE).unwrap();
    state.set_forces(vec![(40, Vec3::new(0.0, 0.0, 0.01)), (200, Vec3::new(0.0, 0.02, 0.0))], false).unwrap();
    state.set_damping(&Damping { ratios: vec![0.05], ..Damping::default() }).unwrap();
    // In its plane the strip, which does not stretch, goes as it must.
    let target = Target::Position(model.shell.mesh.positions[204] + Vec3::new(0.0, 0.0, 0.8));
    let axes = [false, false, true];
    state.set_constraint(Constraint { id: 3, vertex: 204, axes, compliance: 0.0, target }).unwrap();
    state
}

#[test]
fn a_handle_is_where_it_is_put_by_the_force_that_is_reported() {
    let mut held = busy(flat());
    held.equilibrium().unwrap();
    let (_, outcome) = held.constraints().next().unwrap();
    let (force, size) = (outcome.force, flat().shell.mesh.size);
    assert!(outcome.residual < 1e-6 * size, "{outcome:?}");
    let mut free = busy(flat());
    free.clear_constraint(3).unwrap();
    let mut forces = vec![(40, Vec3::new(0.0, 0.0, 0.01)), (200, Vec3::new(0.0, 0.02, 0.0))];
    forces.push((204, force));
    free.set_forces(forces, false).unwrap();
    free.equilibrium().unwrap();
    let apart = error(&displacements(&free), &displacements(&held));
    assert!(apart < 1e-4, "{apart}: the force {force:?} holds another pose");
    let mut state = busy(flat());
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -0.4);
    let target = Target::Orientation(turn);
    let axes = [false, true, false];
    state.set_constraint(Constraint { id: 4, vertex: 204, axes, compliance: 0.0, target }).unwrap();
    (0..30).for_each(|_| state.step(1.0 / 30.0).unwrap());
    state.constraints().for_each(|(c, outcome)| assert!(outcome.residual < 1e-5 * size, "{}: {outcome:?}", c.id));
}

#[test]
fn saved_loaded_and_cloned_states_and_models_go_on_with_the_same_bits() {
    for precision in [Precision::F32, Precision::F64, Precision::I16] {
        let made = model(reference("flat_beam").0, precision);
        let loaded = Arc::new(Model::load(&made.save().unwrap()).unwrap());
        let play = |state: &mut State| -> Vec<u8> {
            let mut seen = vec![];
            for k in 0..6 {
                state.step(if k == 3 { 0.02 } else { 0.03 }).unwrap();
                seen.extend(state.save());
                state.positions(Space::World, |_, x| seen.extend(x.iter().flat_map(|x| x.to_le_bytes())));
            }
            seen
        };
        let start = |model: &Arc<Model>| {
            let mut state = busy(model);
            state.set_wind(Wind { velocity: Vec3::new(0.0, 2.0, 1.0), density: 0.1, ..Wind::default() }).unwrap();
            (0..4).for_each(|_| state.step(1.0 / 30.0).unwrap());
            state
        };
        let mut state = start(&made);
        let (saved, mut clone, mut other) = (state.save(), state.try_clone().unwrap(), start(&loaded));
        let expected = play(&mut state);
        assert!(play(&mut clone) == expected, "the clone");
        assert!(play(&mut other) == expected, "the loaded model");
        state.load(&saved).unwrap();
        assert!(play(&mut state) == expected, "the loaded state");
    }
}

#[test]
fn each_precision_gives_the_positions_of_the_widest_and_of_some_vertices_those_among_all() {
    let exact = at_rest(flat(), Method::RotationStrain, 0.4 * DOWN);
    for (precision, tolerance) in [(Precision::F32, 1e-5), (Precision::I16, 2e-3)] {
        let model = model(reference("flat_beam").0, precision);
        let apart = error(&at_rest(&model, Method::RotationStrain, 0.4 * DOWN), &exact);
        println!("{precision:?}: {apart:.1e}");
        assert!(apart < tolerance, "{precision:?}: {apart}"); // of 16 bits the samples' gradients lose three digits
        let mut state = busy(&model);
        state.set_frame(Pose { origin: Vec3::x(), ..Pose::identity() }, FrameMotion::Continuous);
        (0..3).for_each(|_| state.step(0.02).unwrap());
        let list = [204, 3, 5, 204, 17, 16];
        let (mut wide, mut narrow) = (vec![], vec![]);
        state.positions(Space::World, |_, x| wide.push(x));
        state.position_rows_f32(Space::World, |_, rows| narrow.extend_from_slice(rows));
        assert_eq!((wide.len(), narrow.len()), (369, 369));
        let at = |i: usize| list[i] as usize;
        state.positions_of(Space::World, &list, |i, x| assert_eq!(Vec3::from(x), wide[at(i)], "{i}")).unwrap();
        state.positions_of_f32(Space::World, &list, |i, x| assert_eq!(x, narrow[at(i)], "{i}")).unwrap();
        for (wide, narrow) in wide.iter().zip(&narrow) {
            (0..3).for_each(|c| assert!((wide[c] - f64::from(narrow[c])).abs() < 1e-5)); // of 5 in f32
        }
    }
}

#[test]
fn a_step_does_not_allocate() {
    let mut state = busy(&model(reference("flat_beam").0, Precision::F32));
    state.set_wind(Wind { velocity: Vec3::new(0.0, 2.0, 1.0), density: 0.1, ..Wind::default() }).unwrap();
    let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), 0.01);
    state.step(0.01).unwrap();
    state.set_frame(Pose { origin: Vec3::zeros(), rotation: turned }, FrameMotion::Continuous);
    let used = allocation_counter::measure(|| state.step(0.01).unwrap());
    assert_eq!(used.count_total, 0);
}

#[test]
fn the_plan_tells_of_the_samples_and_linear_models_are_refused_by_name() {
    let mut state = state(flat(), Method::RotationStrain);
    state.set_gravity(DOWN).unwrap();
    let parts = state.plan(0.01).unwrap();
    let turns = parts.iter().find(|part| part.kind == PartKind::Rotations).unwrap();
    assert!(turns.active && turns.reason.contains("sampled triangles"), "{turns:?}");
    assert!(turns.bytes > flat().strain_bytes() && flat().strain_bytes() > 0 && turns.operations > 0.0);
    let held: usize = parts.iter().map(|part| part.bytes).sum();
    assert!(held >= flat().bytes());
    let options = Options { modes: 4, linear: true, ..Options::default() };
    let shell = Arc::new(reference("flat_beam").0);
    let linear = Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap());
    let error = State::new(linear, Method::RotationStrain, Integrator::Exact).err().unwrap();
    assert_eq!(error.kind, ErrorKind::Unsupported);
}

#[test]
fn where_it_hangs_nothing_moves_a_sagged_shell() {
    let options = Options { modes: 8, precision: Precision::F64, sag: 0.4 * DOWN, ..Options::default() };
    let shell = Arc::new(reference("flat_beam").0);
    let model = Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap());
    let mut state = state(&model, Method::RotationStrain);
    state.set_gravity(0.4 * DOWN).unwrap();
    (0..100).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert_eq!(state.report().max_displacement, 0.0);
    // And under four fifths of it, it is nearer to the full shell than the warp from the same shape.
    let gravity = 0.32 * DOWN;
    let exact = at_rest(flat(), Method::ImplicitShell, gravity);
    let [own, warp] = [Method::RotationStrain, Method::Warp].map(|method| {
        let rest = &flat().shell.mesh.positions;
        let moved: Vec<Vec3> = at_rest(&model, method, gravity)
            .iter()
            .zip(model.shell.mesh.positions.iter().zip(rest))
            .map(|(u, (sagged, rest))| u + sagged - rest)
            .collect();
        error(&moved, &exact)
    });
    println!("sagged: {own:.4}, warp {warp:.4}");
    assert!(own < 0.01);
}

#[test]
fn supports_in_pieces_and_pieces_afloat_have_their_place() {
    // Two sheets, one held at an edge, one free.
    let (mut positions, mut triangles) = equilateral_sheet(6, 4, 0.1);
    let n = positions.len() as u32;
    let copy: Vec<Vec3> = positions.iter().map(|x| x + 2.0 * Vec3::y()).collect();
    positions.extend(copy);
    let more: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| v + n)).collect();
    triangles.extend(more);
    let clamped = (0..n).filter(|v| positions[*v as usize].x < 0.01).collect();
    let supports = Supports { clamped, ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    let model = model(shell, Precision::F64);
    assert_eq!(model.modal.zero_modes, 6);
    let mut state = state(&model, Method::RotationStrain);
    state.set_gravity(DOWN).unwrap();
    (0..30).for_each(|_| state.step(1.0 / 30.0).unwrap());
    let u = displacements(&state);
    assert_eq!(u[0], Vec3::zeros());
    assert_close("fall", u[n as usize].z, -0.5, 1e-3, 0.0);
}

/// More floating pieces than samples: what the samples leave of the turns is a share, whatever holds rigid motions exact.
#[test]
fn the_plan_of_many_floating_pieces_tells_a_share_of_what_all_triangles_would_do() {
    let pieces = MOST_SAMPLES as u32 + 8;
    let (mut positions, mut triangles) = (vec![], vec![]);
    for k in 0..pieces {
        let corner = |x: f64, y: f64| Vec3::new(x + 2.0 * f64::from(k), y, 0.0);
        positions.extend([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.1, 1.0), corner(0.0, 1.0)]);
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v: u32| v + 4 * k)));
    }
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let shell = Shell::new(mesh, Material::default(), &Supports::default()).unwrap();
    let options = Options { modes: 6 * pieces as usize + 8, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let map = model.rotation_strain().unwrap();
    println!("{} samples for {pieces} pieces leave {}", map.n_samples(), map.left);
    // Eight pieces of forty have no sample, and what turns all of those that have one is not theirs.
    assert!(map.n_samples() == MOST_SAMPLES && (0.1..1.0).contains(&map.left), "{}", map.left);
}

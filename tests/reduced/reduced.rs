//! Reduced discrete shells: fields, samples, statics and motion against the full shell.

use crate::common::*;
use nalgebra::{DMatrix, UnitQuaternion};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::energy::Curvature;
use shellwarp::load::BodyLoad;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced::{self, AnyFields, Newton, Potential, ReducedEnergy, ReducedShell, Stop, basis};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::state::{Damping, Method, PartKind, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::{Arc, OnceLock};

fn model(shell: &Arc<Shell>, fields: usize, elements: usize, poses: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, elements, poses, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
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

const DOWN: Vec3 = Vec3::new(0.0, 0.0, -1.0);
const OBLIQUE: Vec3 = Vec3::new(0.0, 0.6, -0.8);

#[test]
fn modal_derivatives_are_the_second_order_static_response() {
    let shell = Arc::new(reference("v_beam").0);
    let modes = modes_of(&shell, 3);
    let derivatives =
        basis::modal_derivatives(&basis::RestSolver::new(&shell, (&[], 0.0)).unwrap(), &modes.shapes).unwrap();
    let mut solver = Solver::new(shell.clone()).unwrap();
    // u(s) = s φ + ½ s² Θ + O(s³) under s K φ: what is even in s.
    for (i, k) in [(0, 0), (1, 3), (2, 5)] {
        let step = 2e-3;
        let half = |sign: f64| {
            let scale = sign * step * modes.eigenvalues[i];
            let load: Vec<Vec3> = modes.shapes[i].iter().zip(&shell.mass).map(|(u, m)| u * (m * scale)).collect();
            let options = EquilibriumOptions { tolerance: 1e-11, ..Default::default() };
            solver.equilibrium(&vec![Vec3::zeros(); load.len()], &load, &options, &mut |_| Ok(())).unwrap().displacement
        };
        let (plus, minus) = {
            let mut half = half;
            (half(1.0), half(-1.0))
        };
        let even: Vec<Vec3> = plus.iter().zip(&minus).map(|(a, b)| (a + b) / (step * step)).collect();
        let error = error(&derivatives[k], &even);
        println!("mode {i}: {error:.1e}");
        // The next even term is of the relative order s².
        assert!(error < 1e-3, "mode {i}: {error}");
    }
}

/// By the plain energy, without stress fields, on all elements.
fn plainly_at_rest(model: &Arc<Model>, gravity: Vec3) -> Vec<Vec3> {
    let AnyFields::F64(fields) = &reduced_of(model).fields else { panic!("asked for 64 bits") };
    let shell = &model.shell;
    let columns: Vec<Vec<Vec3>> =
        (0..fields.n).map(|k| (0..shell.mass.len()).map(|v| fields.at(k, v)).collect()).collect();
    let energy = ReducedEnergy::new(shell, &columns, &vec![1.0; shell.energy.n_elements()]);
    let (mut q, mut newton) = (vec![0.0; fields.n], Newton::new(&energy));
    for share in [0.25, 0.5, 0.75, 1.0] {
        let forces: Vec<Vec3> = shell.mass.iter().map(|m| *m * share * gravity).collect();
        let mut load = vec![0.0; fields.n];
        fields.project(&forces, &mut load);
        let stop = Stop { tolerance: 1e-7, iterations: 200, led: false, near: false, least: 0.0 };
        newton.minimize(&energy, &Potential::of_load(&load), &mut q, stop);
    }
    let mut u = vec![Vec3::zeros(); shell.mass.len()];
    fields.displacements(&q, |v, x| u[v] = x);
    u
}

/// Relative errors of MD44 known from an independent implementation, to the digits that are known.
const KNOWN: [(&str, Vec3, f64, f64); 9] = [
    ("flat_beam", DOWN, 0.1, 0.002),
    ("flat_beam", DOWN, 0.4, 0.033),
    ("flat_beam", DOWN, 0.8, 0.046),
    ("v_beam", DOWN, 3.0, 0.003),
    ("v_beam", DOWN, 5.0, 0.021),
    ("v_beam", DOWN, 7.0, 0.073),
    ("v_beam", OBLIQUE, 3.0, 0.002),
    ("v_beam", OBLIQUE, 5.0, 0.009),
    ("v_beam", OBLIQUE, 7.0, 0.032),
];

#[test]
fn modes_and_derivatives_have_the_errors_known_from_an_independent_implementation() {
    for name in ["flat_beam", "v_beam"] {
        let shell = Arc::new(reference(name).0);
        let plain = model(&shell, 0, 0, 0);
        let (all, some) = (model(&shell, 36, usize::MAX, 0), model(&shell, 36, 400, 0));
        for (_, direction, g, known) in KNOWN.iter().filter(|row| row.0 == name) {
            let exact = at_rest(&plain, Method::ImplicitShell, *g * direction);
            let of = |model: &Arc<Model>, method: Method| error(&at_rest(model, method, *g * direction), &exact);
            let (all, some) = (error(&plainly_at_rest(&all, *g * direction), &exact), of(&some, Method::ReducedShell));
            let paper = of(&plain, Method::Warp);
            println!("{name} g {g} {direction:?}: all {all:.4} known {known}, 400 samples {some:.4}, paper {paper:.4}");
            // Half a unit of the last digit, and which of the flat beam's dependent derivatives are kept.
            assert!((all - known).abs() <= 0.0006 + 0.06 * known, "{name} g {g}: {all} instead of {known}");
            // With assumed stress fields, on samples.
            assert!(some < paper, "{name} g {g}: {some} with samples, {paper} the paper's");
        }
    }
}

/// The V-beam with trained fields on sampled elements.
fn trained() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(&Arc::new(reference("v_beam").0), 40, 0, 20))
}

/// The flat beam likewise.
fn trained_flat() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(&Arc::new(reference("flat_beam").0), 40, 0, 20))
}

fn reduced_of(model: &Model) -> &ReducedShell {
    model.reduced.as_ref().unwrap()
}

#[test]
fn samples_are_few_and_reproduce_the_rest_stiffness_of_the_modes() {
    let model = trained();
    let reduced = reduced_of(model);
    let (samples, all) = (reduced.samples.len(), model.shell.energy.n_elements());
    println!("{samples} of {all} elements leave {:.1e}", reduced.fit);
    assert!(samples < all / 2 && reduced.samples.iter().all(|(_, weight)| *weight > 0.0));
    let mut newton = Newton::new(&reduced.energy);
    for k in 0..8 {
        let mut load = vec![0.0; reduced.n()];
        load[k] = 1e-6 * model.modal.eigenvalues[k];
        let mut q = vec![0.0; reduced.n()];
        newton.minimize(
            &reduced.energy,
            &Potential::of_load(&load),
            &mut q,
            Stop { tolerance: 1e-10, iterations: 20, led: false, near: false, least: 0.0 },
        );
        // Modes count five times as much as the poses that the samples leave 1 % of.
        assert_close("amplitude", q[k], 1e-6, 0.005, 0.0);
    }
}

#[test]
fn samples_neither_buckle_nor_weigh_rounding() {
    // The fields hold this shape to 0.1 %; samples with an indefinite correction of the rest stiffness led to another one, 200 % off.
    let gravity = 0.8 * DOWN;
    let exact = at_rest(trained_flat(), Method::ImplicitShell, gravity);
    let found = error(&at_rest(trained_flat(), Method::ReducedShell, gravity), &exact);
    println!("bent far: {found:.4}");
    assert!(found < 0.01, "{found}");
    // Elements next to the support feel nothing but rounding, of which a weight of 1e21 made so much that no line search saw a descent.
    let few = model(&Arc::new(reference("v_beam").0), 16, 200, 0);
    let largest = reduced_of(&few).samples.iter().map(|s| s.1).fold(0.0, f64::max);
    // None has less than a thousandth of the mean force, and the force of one can stand for that of all.
    let most = 1e3 * few.shell.energy.n_elements() as f64;
    println!("weights up to {largest:.0}, at most {most}");
    assert!(largest < most, "one element stands for {largest}");
    at_rest(&few, Method::ReducedShell, 5.0 * OBLIQUE);
}

#[test]
fn gradient_and_hessian_are_those_of_the_energy() {
    let reduced = reduced_of(trained());
    let (energy, n) = (&reduced.energy, reduced.n());
    let mut scratch = energy.scratch();
    let q: Vec<f64> = (0..n).map(|k| 0.1 * (1.7 * k as f64).sin() / (1.0 + k as f64)).collect();
    let (mut plus, mut minus) = (vec![0.0; n], vec![0.0; n]);
    let mut hessian = DMatrix::zeros(n, n);
    energy.hessian(&q, Curvature::Exact, &mut scratch, &mut hessian);
    for k in [0, 3, 7, 8, n - 1] {
        let h = 1e-6;
        let at = |sign: f64| (0..n).map(|j| q[j] + if j == k { sign * h } else { 0.0 }).collect::<Vec<_>>();
        let slope = (energy.value(&at(1.0), &mut scratch) - energy.value(&at(-1.0), &mut scratch)) / (2.0 * h);
        energy.gradient(&at(1.0), &mut scratch, &mut plus);
        energy.gradient(&at(-1.0), &mut scratch, &mut minus);
        let mut here = vec![0.0; n];
        energy.gradient(&q, &mut scratch, &mut here);
        let scale = here.iter().map(|g| g.abs()).fold(0.0, f64::max);
        assert_close("slope", here[k], slope, 1e-5, scale); // rounding of E over the step
        let largest = hessian.amax();
        for j in 0..n {
            assert_close("curvature", hessian[(j, k)], (plus[j] - minus[j]) / (2.0 * h), 1e-6, largest);
        }
    }
}

#[test]
fn loads_of_a_turning_frame_are_those_on_every_vertex() {
    let model = trained();
    let (reduced, shell) = (reduced_of(model), &model.shell);
    let n = reduced.n();
    let (q, q_dot): (Vec<f64>, Vec<f64>) =
        (0..n).map(|k| ((k as f64).sin() * 0.1, (2.0 * k as f64).cos() * 0.2)).unzip();
    let rates = Rates {
        acceleration: Vec3::new(0.3, 0.1, -0.2),
        angular_velocity: Vec3::new(0.5, -1.0, 2.0),
        angular_acceleration: Vec3::new(0.1, 0.7, -0.4),
        ..Rates::default()
    };
    let load = BodyLoad::new(Vec3::new(0.0, 1.0, -9.0), &Pose::identity(), &rates);
    let (uniform, spin) = load.parts();
    let (gradient, coriolis) = spin.unwrap();
    let mut force = vec![0.0; n];
    reduced.add_uniform(&uniform, &mut force);
    reduced.add_spin(gradient, coriolis, (&q, &q_dot), &mut force);
    let AnyFields::F64(fields) = &reduced.fields else { panic!("asked for 64 bits") };
    let mut on_vertices = vec![Vec3::zeros(); shell.mass.len()];
    fields.motion(&q, &q_dot, &mut |v, u, rate| {
        on_vertices[v] = load.at(shell.mass[v], shell.mesh.positions[v] + u, rate);
    });
    let mut expected = vec![0.0; n];
    fields.project(&on_vertices, &mut expected);
    let scale = expected.iter().map(|f| f.abs()).fold(0.0, f64::max);
    (0..n).for_each(|k| assert_close("modal force", force[k], expected[k], 1e-12, scale));
}

/// A plain strip, held at one end, folded along its middle by so many degrees.
fn strip(fold: f64) -> Arc<Shell> {
    let (mut positions, triangles) = equilateral_sheet(17, 4, 0.24);
    let (sin, cos) = (0.5 * fold).to_radians().sin_cos();
    let middle = 0.5 * positions.iter().map(|x| x.y).fold(0.0, f64::max);
    for x in &mut positions {
        *x = Vec3::new(x.x, (x.y - middle) * cos, (x.y - middle).abs() * sin);
    }
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.13).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 1.0, area_density: 1.0 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap())
}

#[test]
fn untrained_fields_resist_what_pulls_along_the_sheet() {
    // Nothing but stress fields resists stretch; without that of a pull along the strip it gave way 300 times too far.
    let shell = strip(0.0);
    let model = model(&shell, 12, 0, 0);
    let length = shell.mesh.size;
    let spun = |method: Method| {
        let mut state = state(&model, method);
        state.set_damping(&Damping { mass_coefficient: 1.0, ..Damping::default() }).unwrap();
        for k in 1..=60 {
            let omega = 0.2 * std::f64::consts::PI;
            let rotation = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), omega * f64::from(k) / 60.0);
            let rates = Rates { angular_velocity: omega * Vec3::z(), ..Rates::default() };
            state.set_frame(Pose { rotation, ..Pose::identity() }, shellwarp::support::FrameMotion::Given(rates));
            state.set_gravity(0.05 * DOWN).unwrap();
            state.step(1.0 / 60.0).unwrap();
        }
        displacements(&state)
    };
    let (found, exact) = (spun(Method::ReducedShell), spun(Method::ImplicitShell));
    let off = found.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    println!("spun at a tenth of a turn a second: off by {off:.2e} of {length}");
    assert!(off < 1e-3 * length, "{off:e}: the reduced and the full shell are 1e-4 apart");
}

#[test]
fn a_sharp_rest_fold_keeps_the_modes_stiffness() {
    for fold in [0.0, 135.0, 179.9] {
        let model = model(&strip(fold), 12, 0, 0);
        let [exact, found, linear] = [Method::ImplicitShell, Method::ReducedShell, Method::LinearModalAnalysis]
            .map(|method| at_rest(&model, method, 1e-3 * DOWN));
        let (found, linear) = (error(&found, &exact), error(&linear, &exact));
        println!("fold of {fold}: {found:.4}, eight modes {linear:.4}");
        assert!(found < linear + 0.01, "{fold}: {found}; samples leave 1 % of the forces");
    }
}

/// What a host does before a step: where vertices are led to, and whom it lets go.
type Drive<'a> = &'a dyn Fn(usize, &mut State);

fn lead(state: &mut State, id: u32, vertex: usize, place: Vec3) {
    let target = Target::Position(place);
    state.set_constraint(Constraint { id, vertex: vertex as u32, axes: [true; 3], compliance: 0.0, target }).unwrap();
}

/// Handles at the tip and at the vertex next to the supports; a minute and more later nothing moves, and nearly always all is as it was
/// before. Where triangles were turned over, there are other shapes to be at rest in, and rounding decides.
#[test]
fn a_shell_torn_by_its_handles_and_let_go_comes_back() {
    let shell = strip(0.0);
    let model = model(&shell, 12, 0, 0);
    let (length, at) = (shell.mesh.size, |v: usize| shell.mesh.positions[v]);
    let free = (0..shell.mass.len()).filter(|&v| at(v).x >= 0.13); // as `strip` holds it
    let by_x = |a: &usize, b: &usize| at(*a).x.total_cmp(&at(*b).x);
    let (near, tip) = (free.clone().min_by(by_x).unwrap(), free.max_by(by_x).unwrap());
    let rest = at_rest(&model, Method::ReducedShell, 0.05 * DOWN);
    let (mut runs, mut back) = (0, 0);
    for share in [0.8, 0.9, 1.0, 1.1] {
        let up = |distance: f64| Vec3::new(0.0, 0.0, share * distance * length);
        let torn = |v: usize, k: usize, state: &mut State| match k {
            1..=12 => lead(state, 1, v, at(v) + up(100.0 * k as f64 / 60.0)),
            13 => state.clear_constraint(1).unwrap(),
            _ => (),
        };
        let led = |k: usize, state: &mut State| match k {
            1 => {
                lead(state, 1, tip, at(tip) + up(0.07));
                lead(state, 2, tip, at(tip) - up(0.13));
            }
            30 => lead(state, 2, near, at(tip) + up(0.07)),
            60 => (1..=2).for_each(|id| state.clear_constraint(id).unwrap()),
            _ => (),
        };
        let drives: [(&str, Drive); 3] = [
            ("the tip torn away at 100 lengths/s", &|k, state| torn(tip, k, state)),
            ("a vertex next to supports torn away", &|k, state| torn(near, k, state)),
            ("one vertex to two places, two vertices to one", &led),
        ];
        for (name, drive) in drives {
            let mut state = state(&model, Method::ReducedShell);
            state.set_gravity(0.05 * DOWN).unwrap();
            state.set_damping(&Damping { mass_coefficient: 1.0, ..Damping::default() }).unwrap();
            let mut largest = 0.0;
            for k in 0..1900 {
                drive(k, &mut state);
                state.step(if k < 70 { 1.0 / 60.0 } else { 1.0 / 30.0 }).unwrap();
                largest = f64::max(largest, state.report().max_displacement);
                // Handles are 22 lengths away at most, and up to there amplitudes may go.
                assert!(largest < 100.0 * length, "{name}, step {k}: {largest}");
            }
            let (off, report) = (error(&displacements(&state), &rest), state.report());
            println!("{name}, {share}: by {:.1} lengths, a minute later off its rest by {off:.2e}", largest / length);
            assert!(report.kinetic_energy < 1e-4 * report.elastic_energy, "{name}: {report:?}");
            runs += 1;
            back += usize::from(off < 1e-3);
        }
    }
    println!("{back} of {runs} are back");
    assert!(10 * back > 8 * runs, "{back} of {runs}");
}

#[test]
fn a_frame_that_turns_too_fast_is_refused_and_nothing_moves() {
    let mut state = state(trained(), Method::ReducedShell);
    let mut refused = None;
    for k in 1..60 {
        let omega = 200.0 * std::f64::consts::PI;
        let rotation = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), omega * f64::from(k) / 60.0);
        let rates = Rates { angular_velocity: omega * Vec3::z(), ..Rates::default() };
        state.set_frame(Pose { rotation, ..Pose::identity() }, shellwarp::support::FrameMotion::Given(rates));
        let before = displacements(&state);
        if let Err(error) = state.step(1.0 / 60.0) {
            assert!(displacements(&state) == before);
            refused = Some(error.message);
            break;
        }
        assert!(state.report().max_displacement < 10.0 * trained().shell.mesh.size, "{:?}", state.report());
    }
    let message = refused.unwrap();
    assert!(message.contains("10.5 rad") && message.contains("do not settle"), "{message}");
}

#[test]
fn ten_and_a_hundred_times_the_load_stay_bounded() {
    let model = trained();
    let size = model.shell.mesh.size;
    for factor in [10.0, 100.0] {
        let mut state = state(model, Method::ReducedShell);
        let g = 3.0 * factor;
        state.set_gravity(g * OBLIQUE).unwrap();
        for _ in 0..150 {
            state.step(1.0 / 30.0).unwrap();
            let report = state.report();
            // Released from rest, a shell has no more energy than gravity gave it on the way.
            let work = model.shell.total_mass * g * report.max_displacement;
            assert!(report.kinetic_energy + report.elastic_energy <= 1.01 * work, "{factor} times: {report:?}");
            assert!(report.max_displacement < 2.0 * size, "{factor} times: {report:?}");
        }
        println!("{factor} times: {} of 150 steps unconverged", state.report().unconverged_steps);
    }
}

/// Time of the first turning point of the tip and how far it is there.
fn first_peak(state: &mut State, vertex: usize, h: f64) -> (f64, f64) {
    let rest = state.model().shell.mesh.positions[vertex];
    let far = |state: &State| {
        let mut x = rest;
        state.positions(Space::Frame, |v, p| {
            if v == vertex {
                x = p
            }
        });
        (x - rest).norm()
    };
    let mut at = [0.0; 3];
    let mut time = 0.0;
    loop {
        state.step(h).unwrap();
        time += h;
        at = [at[1], at[2], far(state)];
        if at[2] < at[1] {
            let (a, b) = (0.5 * (at[0] - 2.0 * at[1] + at[2]), 0.5 * (at[2] - at[0]));
            return (time - h - h * 0.5 * b / a, at[1] - 0.25 * b * b / a);
        }
    }
}

#[test]
fn released_beams_swing_as_the_full_shell_at_small_steps() {
    for (name, model, g) in [("flat_beam", trained_flat(), 0.2), ("v_beam", trained(), 2.0)] {
        let swing = |method: Method, h: f64| {
            let mut state = state(model, method);
            state.set_gravity(g * DOWN).unwrap();
            first_peak(&mut state, 204, h)
        };
        // Backward Euler of the full shell loses and lags in proportion to its step.
        let [coarse, fine] = [400.0, 800.0].map(|rate| swing(Method::ImplicitShell, 1.0 / rate));
        let exact = (2.0 * fine.0 - coarse.0, 2.0 * fine.1 - coarse.1);
        let (reduced, warp) = (swing(Method::ReducedShell, 1.0 / 30.0), swing(Method::Warp, 1.0 / 30.0));
        println!("{name}: {reduced:?}, full shell {exact:?}, paper {warp:?}");
        assert_close("half a period", reduced.0, exact.0, 0.03, 0.0);
        assert_close("amplitude", reduced.1, exact.1, 0.03, 0.0);
    }
}

#[test]
fn stiffness_and_mass_damping_take_energy_and_leave_the_equilibrium() {
    let model = trained();
    let gravity = 3.0 * OBLIQUE;
    let exact = at_rest(model, Method::ReducedShell, gravity);
    for damping in [
        Damping { mass_coefficient: 6.0, ..Damping::default() },
        Damping { stiffness_coefficient: 0.1, ..Damping::default() },
        Damping { ratios: vec![0.5], ..Damping::default() },
    ] {
        let mut state = state(model, Method::ReducedShell);
        state.set_gravity(gravity).unwrap();
        state.set_damping(&damping).unwrap();
        (0..300).for_each(|_| state.step(1.0 / 30.0).unwrap());
        let error = error(&displacements(&state), &exact);
        assert!(error < 1e-3, "{damping:?}: {error} from rest after 10 s");
    }
}

/// With the tip's middle held where gravity would bring it.
fn pulled(model: &Arc<Model>) -> (State, Constraint) {
    let there = at_rest(model, Method::ReducedShell, 2.0 * OBLIQUE)[204];
    let mut state = state(model, Method::ReducedShell);
    let target = Target::Position(model.shell.mesh.positions[204] + there);
    let handle = Constraint { id: 3, vertex: 204, axes: [true; 3], compliance: 0.0, target };
    state.set_constraint(handle).unwrap();
    (state, handle)
}

#[test]
fn a_handle_is_where_it_is_put_by_the_force_that_is_reported() {
    let (mut held, _) = pulled(trained());
    held.equilibrium().unwrap();
    let (_, outcome) = held.constraints().next().unwrap();
    let (force, size) = (outcome.force, trained().shell.mesh.size);
    assert!(outcome.residual < 1e-6 * size, "{outcome:?}");
    let mut free = state(trained(), Method::ReducedShell);
    free.set_forces(vec![(204, force)], false).unwrap();
    free.equilibrium().unwrap();
    let apart = error(&displacements(&free), &displacements(&held));
    assert!(apart < 1e-4, "{apart}: the force {force:?} holds another pose");
    // And in motion.
    let (mut state, _) = pulled(trained());
    for _ in 0..30 {
        state.step(1.0 / 30.0).unwrap();
        let (_, outcome) = state.constraints().next().unwrap();
        assert!(outcome.residual < 1e-5 * size, "{outcome:?}");
    }
    assert!(state.report().constraint_work > 0.0);
    state.clear_constraint(3).unwrap();
    state.step(1.0 / 30.0).unwrap();
}

fn rotation(state: &State, vertex: u32) -> UnitQuaternion<f64> {
    let mut found = UnitQuaternion::identity();
    state.rotations(Space::World, |v, r| found = if v as u32 == vertex { r } else { found }).unwrap();
    found
}

fn tip(model: &Model) -> u32 {
    let x = &model.shell.mesh.positions;
    (0..x.len()).max_by(|a, b| x[*a].x.total_cmp(&x[*b].x)).unwrap() as u32
}

/// The flat beam's end is held as it hangs under thrice its gravity, in a frame that is turned itself; beside the full shell.
#[test]
fn an_orientation_is_held_as_the_full_shell_holds_it() {
    let (model, end) = (trained_flat(), tip(trained_flat()));
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.3, -0.2, 0.9));
    let hanging = |method: Method, strength: f64, held: Option<Constraint>| {
        let mut state = state(model, method);
        state.set_frame(Pose { origin: Vec3::new(1.0, 2.0, 3.0), rotation: turn }, FrameMotion::Teleport);
        state.set_gravity(turn * Vec3::new(0.0, 0.0, -strength)).unwrap();
        held.into_iter().for_each(|handle| state.set_constraint(handle).unwrap());
        state.equilibrium().unwrap();
        state
    };
    let goal = rotation(&hanging(Method::ImplicitShell, 0.3, None), end);
    for (axes, compliance) in [([true; 3], 0.0), ([true, true, false], 0.0), ([true; 3], 20.0)] {
        let handle = Constraint { id: 1, vertex: end, axes, compliance, target: Target::Orientation(goal) };
        let at_rest = |method: Method| hanging(method, 0.1, Some(handle));
        let [own, exact] = [Method::ReducedShell, Method::ImplicitShell].map(at_rest);
        let apart = error(&displacements(&own), &displacements(&exact));
        let outcomes = [&own, &exact].map(|state| *state.constraints().next().unwrap().1);
        println!("{axes:?}, {compliance}: {apart:.4} off, {outcomes:?}");
        // What 44 fields do not hold of the bend about one vertex.
        assert!(apart < 0.1, "{apart} off");
        let missing = (goal * rotation(&own, end).inverse()).scaled_axis();
        let held = Vec3::from_fn(|a, _| if axes[a] { missing[a] } else { 0.0 });
        let given_way = compliance * outcomes[0].force;
        assert!((held - given_way).norm() < 1e-5, "{held:?} is missing, {given_way:?} given way");
        assert!((outcomes[0].residual - held.norm()).abs() < 1e-9);
        // The estimate counts the torque: what it tells is how far the fields are off.
        assert_close("estimate", own.certify().unwrap().error, apart, 0.1, 1e-3);
    }
}

/// ∂E/∂θ of the energy with an orientation held at θ, by differences.
#[test]
fn the_torque_of_an_orientation_is_the_derivative_of_the_energy() {
    let (model, end) = (trained_flat(), tip(trained_flat()));
    let held = |by: Vec3| {
        let mut state = state(model, Method::ReducedShell);
        let goal = UnitQuaternion::from_scaled_axis(by) * UnitQuaternion::from_scaled_axis(Vec3::new(0.2, 0.3, -0.1));
        let target = Target::Orientation(goal);
        state.set_constraint(Constraint { id: 1, vertex: end, axes: [true; 3], compliance: 0.0, target }).unwrap();
        state.equilibrium().unwrap();
        (state.report().elastic_energy, state.constraints().next().unwrap().1.force)
    };
    let (_, torque) = held(Vec3::zeros());
    for axis in 0..3 {
        let step = 1e-4;
        let [more, less] = [step, -step].map(|h| held(Vec3::ith(axis, h)).0);
        // Equilibria are found to a residual of 1e-7 of an energy of the order of the torque.
        assert_close("torque", torque[axis], (more - less) / (2.0 * step), 1e-4, 1e-5 * torque.norm());
    }
}

/// Turned by 4° a frame about the beam's axis, to 80°, and let go.
#[test]
fn an_orientation_is_followed_in_motion() {
    let (model, end) = (trained_flat(), tip(trained_flat()));
    let mut state = state(model, Method::ReducedShell);
    state.set_damping(&Damping { mass_coefficient: 2.0, ..Damping::default() }).unwrap();
    for k in 1..=20 {
        let goal = UnitQuaternion::from_scaled_axis(Vec3::x() * (4.0 * k as f64).to_radians());
        let target = Target::Orientation(goal);
        state.set_constraint(Constraint { id: 1, vertex: end, axes: [true; 3], compliance: 0.0, target }).unwrap();
        state.step(1.0 / 30.0).unwrap();
        let missing = (goal * rotation(&state, end).inverse()).angle();
        assert!(missing < 1e-3, "frame {k}: {missing} rad are missing");
    }
    assert_eq!(state.report().unconverged_steps, 0);
    let bent = state.report().elastic_energy;
    state.clear_constraints();
    (0..300).for_each(|_| state.step(1.0 / 30.0).unwrap());
    assert!(state.report().elastic_energy < 1e-3 * bent, "it does not come back");
}

#[test]
fn a_handle_leads_a_shell_to_where_its_load_alone_would_buckle_it() {
    // The Hessian is indefinite there, and positive definite among motions that leave the handle where it is.
    let model = trained_flat();
    let (size, rest) = (model.shell.mesh.size, &model.shell.mesh.positions);
    for share in [0.2, 0.5] {
        let [exact, found] = [Method::ImplicitShell, Method::ReducedShell].map(|method| {
            let mut state = state(model, method);
            let target = Target::Position(rest[204] + share * size * Vec3::z());
            let axes = [false, false, true];
            state.set_constraint(Constraint { id: 1, vertex: 204, axes, compliance: 0.0, target }).unwrap();
            state.equilibrium().unwrap();
            displacements(&state)
        });
        let off = error(&found, &exact);
        println!("led by {share} of its size: {off:.5}");
        assert!(off < 0.01, "{share}: {off}");
    }
}

#[test]
fn handles_that_repeat_or_contradict_each_other_are_met_at_their_mean() {
    let model = trained();
    let rest = model.shell.mesh.positions[204];
    for (apart, soft) in [(0.0, 0.0), (0.02, 0.0), (0.02, 1e-3)] {
        let mut state = state(model, Method::ReducedShell);
        for (id, sign) in [(1, -1.0), (2, 1.0)] {
            let target = Target::Position(rest + Vec3::new(0.0, 0.0, -0.1 + sign * apart));
            let constraint = Constraint { id, vertex: 204, axes: [true; 3], compliance: soft, target };
            state.set_constraint(constraint).unwrap();
        }
        state.equilibrium().unwrap();
        let mean = displacements(&state)[204].z;
        for (_, outcome) in state.constraints() {
            println!("{apart} apart, compliance {soft}: at {mean}, {outcome:?}");
            let expected = if soft > 0.0 { outcome.residual } else { apart };
            assert_close("what each misses", outcome.residual, expected, 1e-6, 0.1);
            assert!(soft > 0.0 || (mean + 0.1).abs() < 1e-6, "{mean}");
        }
        (0..10).for_each(|_| state.step(1.0 / 30.0).unwrap());
        assert_eq!(state.report().unconverged_steps, 0);
    }
}

#[test]
fn saved_loaded_and_cloned_states_and_models_go_on_with_the_same_bits() {
    let loaded = Arc::new(Model::load(&trained().save().unwrap()).unwrap());
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
        let (mut state, _) = pulled(model);
        state.set_gravity(OBLIQUE).unwrap();
        state.set_damping(&Damping { stiffness_coefficient: 0.01, ..Damping::default() }).unwrap();
        (0..4).for_each(|_| state.step(1.0 / 30.0).unwrap());
        state
    };
    let mut state = start(trained());
    let (saved, mut clone, mut other) = (state.save(), state.try_clone().unwrap(), start(&loaded));
    let expected = play(&mut state);
    assert!(play(&mut clone) == expected, "the clone");
    assert!(play(&mut other) == expected, "the loaded model");
    state.load(&saved).unwrap();
    assert!(play(&mut state) == expected, "the loaded state");
    assert_eq!(trained().save().unwrap(), loaded.save().unwrap());
}

#[test]
fn every_plan_lists_the_reduced_shell_and_its_own_alone_uses_it() {
    for method in [Method::ReducedShell, Method::Warp, Method::ImplicitShell] {
        let parts = state(trained(), method).plan(0.01).unwrap();
        assert_eq!(parts.len(), 12);
        let [own, last] = [PartKind::NonlinearShell, PartKind::ReducedShell].map(|kind| {
            let part = parts.iter().find(|part| part.kind == kind).unwrap();
            assert_eq!(part.active, part.operations > 0.0, "{part:?}");
            part
        });
        assert_eq!((own.active, last.active), (method == Method::ImplicitShell, method == Method::ReducedShell));
        assert!(last.bytes >= reduced_of(trained()).bytes());
    }
}

#[test]
fn the_positions_of_some_vertices_are_those_among_all() {
    let (mut state, _) = pulled(trained());
    state.set_frame(Pose { origin: Vec3::x(), ..Pose::identity() }, shellwarp::support::FrameMotion::Continuous);
    (0..3).for_each(|_| state.step(0.02).unwrap());
    let list = [204, 3, 5, 204, 17, 16];
    let (mut wide, mut narrow) = (vec![], vec![]);
    state.positions(Space::World, |_, x| wide.push(x));
    state.position_rows_f32(Space::World, |_, rows| narrow.extend_from_slice(rows));
    let mut seen = 0;
    let at = |i: usize| list[i] as usize;
    state.positions_of(Space::World, &list, |i, x| assert_eq!(Vec3::from(x), wide[at(i)], "{i}")).unwrap();
    let visit = |i: usize, x: [f32; 3]| {
        seen += 1;
        assert_eq!(x, narrow[at(i)], "{i}");
    };
    state.positions_of_f32(Space::World, &list, visit).unwrap();
    assert_eq!(seen, list.len());
}

#[test]
fn a_step_does_not_allocate() {
    let (mut state, _) = pulled(trained());
    state.set_damping(&Damping { stiffness_coefficient: 0.01, ..Damping::default() }).unwrap();
    state.set_gravity(OBLIQUE).unwrap();
    state.step(0.01).unwrap();
    let used = allocation_counter::measure(|| state.step(0.01).unwrap());
    assert_eq!(used.count_total, 0);
}

/// Whatever the machine's speed: no time is enough for none, an hour and a million searches for all. What is chosen by examples has fewer of them where
/// there is no time, trained or not.
#[test]
fn training_ends_in_time() {
    let shell = Arc::new(reference("v_beam").0);
    let fields = |seconds: f64, mode_searches: f64, poses: usize| {
        let reduced =
            reduced::Options { fields: 40, elements: 60, poses, seconds, mode_searches, ..Default::default() };
        let options = Options { modes: 4, reduced, ..Options::default() };
        Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap().reduced_fingerprint
    };
    let (any, all) = (f64::INFINITY, fields(3600.0, 1e6, 3));
    assert_eq!(fields(any, any, 3), all);
    let [untrained, at_once] = [any, 1e-9].map(|seconds| fields(seconds, any, 0));
    assert!(untrained != all && at_once != all && at_once != untrained);
    assert_eq!([fields(1e-9, any, 3), fields(any, 1e-9, 3)], [at_once; 2]);
}

#[test]
fn what_it_cannot_do_is_refused_by_name() {
    let shell = Arc::new(reference("flat_beam").0);
    let plain = model(&shell, 0, 0, 0);
    let error = State::new(plain, Method::ReducedShell, Integrator::Exact).err().unwrap();
    assert_eq!(error.kind, ErrorKind::Unsupported);
    assert!(error.message.contains("reduced_fields"), "{error}");
    let (positions, triangles) = equilateral_sheet(6, 4, 0.1);
    let options = |fields| Options { reduced: reduced::Options { fields, ..Default::default() }, ..Options::default() };
    let sagged = Options { sag: Vec3::new(0.0, 0.0, -0.01), ..options(8) };
    let error = Model::precompute(shell.clone(), &sagged, &mut |_, _| Ok(())).err().unwrap();
    assert!(error.message.contains("sag_gravity"), "{error}");
    let error = Model::precompute(shell, &options(1000), &mut |_, _| Ok(())).err().unwrap();
    assert!(error.message.contains("at most 128"), "{error}");
    let fixed = (0..positions.len() as u32).collect();
    let supports = Supports { fixed, ..Default::default() };
    let held = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    let error = Model::precompute(Arc::new(held), &options(8), &mut |_, _| Ok(())).err().unwrap();
    assert_eq!(error.kind, ErrorKind::Unsupported);
    assert!(error.message.contains("no support holds"), "{error}");
}

#[test]
fn on_a_curved_leaf_it_is_nowhere_worse_than_the_paper_on_loads_it_was_not_trained_on() {
    // Training knows gravity along the axes, pressure and pulls along the axes at three points. Here: tilted gravity, tilted pulls at
    // other points, wind, and their sums. These loads were drawn up in an
    // experiment before the training code was finished, and seen by those who finished it.
    let shell = Arc::new(leaf(1));
    let reduced = reduced::Options { fields: 40, elements: 400, poses: 52, gravity: 0.6, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let membrane_share = model.reduced.as_ref().unwrap().assumed.membrane_share;
    assert_eq!(membrane_share, 0.003, "the membrane's own energy locks on a leaf");
    let weight = |g: Vec3| shell.mass.iter().map(|m| *m * g).collect::<Vec<_>>();
    let pull = |v: usize, f: Vec3| {
        let mut load = vec![Vec3::zeros(); shell.mass.len()];
        load[v] = f;
        load
    };
    let add = |a: Vec<Vec3>, b: Vec<Vec3>| a.iter().zip(&b).map(|(a, b)| a + b).collect::<Vec<_>>();
    let wind = Vec3::new(0.6, 0.3, 0.74);
    let normals = shell.mesh.normals(&shell.mesh.positions);
    let pressed: Vec<Vec3> = normals.iter().zip(&shell.mass).map(|(n, m)| n * (n.dot(&wind) * 0.6 * m)).collect();
    let total = 0.6 * shell.total_mass;
    let (a, b) = (Vec3::new(0.6, 0.5, -0.62), Vec3::new(-0.3, -0.8, 0.5));
    let mut loads = vec![
        ("tilted 1", weight(0.6 * Vec3::new(0.5, -0.6, -0.62))),
        ("tilted 2", weight(0.6 * Vec3::new(-0.5, -0.5, 0.7))),
        ("tilted 3", weight(0.6 * Vec3::new(0.3, 0.8, 0.5))),
        ("gravity and pull", add(weight(0.6 * DOWN), pull(200, 0.05 * total * Vec3::new(0.8, 0.6, 0.0)))),
        ("gravity and wind", add(weight(0.6 * DOWN), pressed)),
    ];
    for vertex in [120, 250, 350] {
        loads
            .extend([("pull of 2 %", pull(vertex, 0.02 * total * a)), ("pull of 10 %", pull(vertex, 0.1 * total * b))]);
    }
    let mut ratios = vec![];
    for (name, load) in &loads {
        let of = |method: Method| {
            let mut state = state(&model, method);
            state.set_forces((0u32..).zip(load.iter().copied()), false).unwrap();
            state.equilibrium().map(|_| displacements(&state))
        };
        let exact = of(Method::ImplicitShell).unwrap();
        let (paper, own) =
            (error(&of(Method::Warp).unwrap(), &exact), error(&of(Method::ReducedShell).unwrap(), &exact));
        let size = exact.iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size;
        println!("{name}: moves by {size:.3} of the size; paper {paper:.4}, reduced {own:.4}");
        assert!(own <= paper && own < 0.05, "{name}: {own}, paper {paper}");
        ratios.push(own / paper);
    }
    ratios.sort_by(f64::total_cmp);
    println!("ratios {ratios:.3?}");
    assert!(ratios[ratios.len() / 2] <= 0.2);
}

#[test]
fn a_trouser_leg_whose_membrane_carries_the_loads_keeps_more_of_its_own_energy() {
    let shell = Arc::new(trouser_leg("left"));
    let model = model(&shell, 32, 400, reduced::MAX_POSES);
    assert_eq!(model.reduced.as_ref().unwrap().assumed.membrane_share, 0.2);
    // Down the leg, which stretches it, and obliquely: no direction is a training load's but the first.
    for (direction, share) in [(-Vec3::y(), 0.1), (Vec3::new(0.4, -0.8, 0.45), 0.1)] {
        let at_rest = |method: Method, gravity: Vec3| at_rest(&model, method, gravity);
        let moved = |u: &[Vec3]| u.iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size;
        let gravity = direction * (share / moved(&at_rest(Method::LinearModalAnalysis, direction)));
        let [exact, paper, own] =
            [Method::ImplicitShell, Method::Warp, Method::ReducedShell].map(|method| at_rest(method, gravity));
        let (paper, own) = (error(&paper, &exact), error(&own, &exact));
        println!("{direction:.2?}: moves by {:.3} of the size; paper {paper:.4}, reduced {own:.4}", moved(&exact));
        assert!(own < 0.05 && own < 0.2 * paper, "{own}, paper {paper}");
    }
}

/// Where it was torn matters little: it comes to rest, if not always in the shape it had.
#[test]
fn a_torn_shell_settles_wherever_it_was_torn() {
    let shell = strip(0.0);
    let model = model(&shell, 12, 0, 0);
    let (length, at) = (shell.mesh.size, |v: usize| shell.mesh.positions[v]);
    let rest = at_rest(&model, Method::ReducedShell, 0.05 * DOWN);
    let free: Vec<usize> = (0..shell.mass.len()).filter(|&v| at(v).x >= 0.13).collect();
    let (mut runs, mut back) = (0, 0);
    for &v in free.iter().step_by(free.len() / 8) {
        for direction in [Vec3::z(), Vec3::new(-1.0, 0.3, 0.0)] {
            for speed in [10.0, 100.0] {
                let mut state = state(&model, Method::ReducedShell);
                state.set_gravity(0.05 * DOWN).unwrap();
                state.set_damping(&Damping { mass_coefficient: 1.0, ..Damping::default() }).unwrap();
                for k in 1..=12 {
                    lead(&mut state, 1, v, at(v) + direction * (speed * length * f64::from(k) / 60.0));
                    state.step(1.0 / 30.0).unwrap();
                }
                state.clear_constraint(1).unwrap();
                (0..700).for_each(|_| state.step(1.0 / 30.0).unwrap());
                let report = state.report();
                let name = format!("vertex {v} along {direction:?} at {speed} lengths/s");
                println!(
                    "{name}: {} steps short, {:.1} lengths away",
                    report.unconverged_steps,
                    report.max_displacement / length
                );
                // The slowest mode, overdamped, still creeps after 23 seconds: 2e-6 of the energy.
                assert!(report.kinetic_energy < 1e-4 * report.elastic_energy, "{name}: {report:?}");
                assert!(report.max_displacement < 2.0 * length, "{name}: {report:?}");
                runs += 1;
                back += usize::from(error(&displacements(&state), &rest) < 1e-2);
            }
        }
    }
    println!("{back} of {runs} are back");
    assert!(10 * back > 8 * runs, "{back} of {runs}");
}

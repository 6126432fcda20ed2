//! States against independent numbers, physics and the contract: equilibria, rigid motion, moving frames, save, clone.

use crate::common::*;
use nalgebra::{Rotation3, UnitQuaternion};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

fn model_of(shell: Shell, modes: usize, precision: Precision) -> Arc<Model> {
    let options = Options { modes, precision, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn beam(name: &str) -> Arc<Model> {
    model_of(reference(name).0, 8, Precision::F64)
}

fn free_sheet() -> Arc<Model> {
    let (positions, triangles) = equilateral_sheet(10, 6, 0.1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    model_of(Shell::new(mesh, Material::default(), &Supports::default()).unwrap(), 10, Precision::F64)
}

fn positions(state: &State, space: Space) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(space, |v, p| x[v] = p);
    x
}

fn displacements(state: &State) -> Vec<Vec3> {
    positions(state, Space::Frame).iter().zip(&state.model().shell.mesh.positions).map(|(x, rest)| x - rest).collect()
}

/// A step of 1e9 s of implicit Euler gives q⁺ = Λ⁻¹ f(q) to 1e-16; halfway there each time, the static equilibrium.
fn equilibrium(model: &Arc<Model>, method: Method, gravity: Vec3) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(gravity).unwrap();
    let still = vec![0.0; model.modal.n_modes()];
    for _ in 0..100 {
        let before = state.amplitudes().unwrap().0.to_vec();
        state.step(1e9).unwrap();
        let halfway: Vec<f64> = before.iter().zip(state.amplitudes().unwrap().0).map(|(a, b)| 0.5 * (a + b)).collect();
        state.set_amplitudes(&halfway, &still).unwrap();
    }
    state
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn equilibria_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (_, json) = reference(name);
        let model = beam(name);
        for case in json["equilibria"].as_array().unwrap() {
            let gravity = Vec3::from_vec(numbers(&case["gravity"]));
            for (method, key) in [(Method::LinearModalAnalysis, "lma"), (Method::Warp, "mwts")] {
                let u = displacements(&equilibrium(&model, method, gravity));
                let what = format!("{name}, {key}, gravity {gravity:?}");
                let l2 = u.iter().map(|u| u.norm_squared()).sum::<f64>().sqrt();
                assert_close(&what, l2, case[format!("{key}_l2")].as_f64().unwrap(), 1e-5, 0.0);
                let probes = case["probe_vertices"].as_array().unwrap();
                for (probe, expected) in probes.iter().zip(case[format!("{key}_probe")].as_array().unwrap()) {
                    let error = u[probe.as_u64().unwrap() as usize] - Vec3::from_vec(numbers(expected));
                    assert!(error.norm() <= 1e-5 * l2, "{what}: probe {probe} is off by {error:?}");
                }
            }
        }
    }
}

#[test]
fn the_f32_basis_agrees_with_f64() {
    let (single, double) = (model_of(reference("v_beam").0, 8, Precision::F32), beam("v_beam"));
    let gravity = Vec3::new(0.0, 0.6, -0.8) * 5.0;
    let solve = |model| displacements(&equilibrium(model, Method::Warp, gravity));
    let (a, b) = (solve(&single), solve(&double));
    let largest = b.iter().map(|u| u.norm()).fold(0.0, f64::max);
    for (a, b) in a.iter().zip(&b) {
        // 8 modes of 6e-8 each, and the coefficients' 2e-7.
        assert!((a - b).norm() <= 2e-6 * largest, "{:e}", (a - b).norm() / largest);
    }
}

#[test]
fn at_rest_the_positions_are_the_hosts_to_the_last_bit() {
    for precision in [Precision::F32, Precision::F64] {
        let model = model_of(reference("v_beam").0, 8, precision);
        let state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
        let rest = &model.shell.mesh.positions;
        assert_eq!(&positions(&state, Space::World), rest);
        state.position_rows_f32(Space::World, |first, rows| {
            for (row, x) in rows.iter().zip(&rest[first..]) {
                assert_eq!(*row, [x.x as f32, x.y as f32, x.z as f32]);
            }
        });
    }
}

#[test]
fn a_free_shell_in_its_rigid_modes_moves_rigidly_over_several_turns() {
    let model = free_sheet();
    assert_eq!(model.modal.zero_modes, 6);
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    let mut spin = vec![0.0; model.modal.n_modes()];
    spin[..6].copy_from_slice(&[0.05, -0.02, 0.03, 0.2, -0.25, 0.15]);
    state.set_amplitudes(&vec![0.0; model.modal.n_modes()], &spin).unwrap();
    let rest = &model.shell.mesh.positions;
    let mut turned = 0.0;
    for _ in 0..600 {
        state.step(1.0 / 30.0).unwrap();
        let x = positions(&state, Space::World);
        for edge in &model.shell.mesh.edges {
            let [a, b] = edge.vertices.map(|v| v as usize);
            assert_close("edge length", (x[a] - x[b]).norm(), (rest[a] - rest[b]).norm(), 1e-10, 0.0);
        }
        turned = state.report().max_rotation;
    }
    assert!(turned > 3.0 * std::f64::consts::TAU, "only {turned} rad");
}

#[test]
fn frequencies_of_motion_are_those_of_the_modes() {
    let model = beam("flat_beam");
    let mut state = State::new(model.clone(), Method::LinearModalAnalysis, Integrator::Exact).unwrap();
    for k in 0..8 {
        let mut q = vec![0.0; 8];
        q[k] = 0.01;
        state.set_amplitudes(&q, &[0.0; 8]).unwrap();
        let period = std::f64::consts::TAU / model.modal.eigenvalues[k].sqrt();
        (0..7).for_each(|_| state.step(period / 7.0).unwrap());
        // Seven steps of rounding.
        assert_close(&format!("mode {k}"), state.amplitudes().unwrap().0[k], 0.01, 1e-13, 0.0);
    }
}

#[test]
fn damping_ratio_and_rayleigh_damping_decay_as_stated() {
    let model = beam("v_beam");
    let (xi, zeta, ratio) = (0.4, 1e-3, 0.02);
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    let damping =
        Damping { mass_coefficient: xi, stiffness_coefficient: zeta, ratios: vec![ratio], ..Damping::default() };
    state.set_damping(&damping).unwrap();
    state.set_amplitudes(&[0.01; 8], &[0.0; 8]).unwrap();
    let h = 0.05;
    state.step(h).unwrap();
    for k in 0..8 {
        let lambda = model.modal.eigenvalues[k];
        let c = xi + zeta * lambda + 2.0 * ratio * lambda.sqrt();
        let (a, w) = (c / 2.0, (lambda - c * c / 4.0).sqrt());
        let exact = 0.01 * (-a * h).exp() * ((w * h).cos() + a / w * (w * h).sin());
        // c itself is the same few operations; rounding of the phase √λ h ≤ 3.
        assert_close(&format!("mode {k}"), state.amplitudes().unwrap().0[k], exact, 1e-12, 0.01);
    }
    assert_eq!(
        state.set_damping(&Damping { ratios: vec![0.1; 3], ..damping.clone() }).unwrap_err().kind,
        ErrorKind::InvalidArgument
    );
    assert!(state.set_damping(&Damping { ratios: vec![-0.1], ..damping }).is_err());
}

/// Φᵀ Rᵀ F from the definition, vertex by vertex in f64, for a body load given as a function of (mass, position, velocity).
fn modal_force(state: &State, load: impl Fn(f64, Vec3, Vec3) -> Vec3) -> Vec<f64> {
    let model = state.model();
    let (q, q_dot) = state.amplitudes().unwrap();
    let mut f = vec![0.0; q.len()];
    for v in 0..model.shell.mass.len() {
        let shapes: Vec<(Vec3, Vec3)> = (0..q.len()).map(|k| model.modal.mode_at(k, v)).collect();
        let sum = |a: &[f64], pick: fn(&(Vec3, Vec3)) -> Vec3| -> Vec3 {
            shapes.iter().zip(a).map(|(s, a)| pick(s) * *a).sum()
        };
        let (w, rate) = (sum(q, |s| s.1), sum(q_dot, |s| s.0));
        let r = Rotation3::from_scaled_axis(w);
        let x = model.shell.mesh.positions[v] + displacements_at(state, v);
        let force = r.inverse() * load(model.shell.mass[v], x, r * rate);
        shapes.iter().zip(&mut f).for_each(|(s, f)| *f += s.0.dot(&force));
    }
    f
}

fn displacements_at(state: &State, v: usize) -> Vec3 {
    displacements(state)[v]
}

#[test]
fn gravity_and_all_four_inertial_terms_act_as_defined() {
    let model = beam("v_beam");
    let gravity = Vec3::new(0.3, -0.2, -1.0);
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.4, -0.7, 1.1));
    let none = Rates::default();
    let cases = [
        ("gravity", none),
        ("acceleration", Rates { acceleration: Vec3::new(1.0, -2.0, 0.5), ..none }),
        ("Euler", Rates { angular_acceleration: Vec3::new(-0.5, 1.0, 2.0), ..none }),
        ("centrifugal and Coriolis", Rates { angular_velocity: Vec3::new(1.5, 0.5, -1.0), ..none }),
    ];
    let q = [0.5, -0.2, 0.1, 0.05, 0.02, -0.03, 0.01, 0.02];
    let q_dot = [1.0, 2.0, -1.5, 0.5, 0.3, -0.7, 0.2, 0.1];
    let h = 1e-3;
    let mut earlier: Vec<Vec<f64>> = vec![];
    for (name, rates) in cases {
        let mut state = State::new(model.clone(), Method::Warp, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(gravity).unwrap();
        state.set_amplitudes(&q, &q_dot).unwrap();
        let pose = Pose { origin: Vec3::new(5.0, 6.0, 7.0), rotation: turn };
        state.set_frame(pose, FrameMotion::Given(rates));
        let back = |v: Vec3| turn.inverse() * v;
        let (w, a) = (back(rates.angular_velocity), back(rates.angular_acceleration));
        let before = state.try_clone().unwrap();
        state.step(h).unwrap();
        // In a spinning frame the load is that of the middle of the step.
        let mut middle = before;
        // A frame that hardly turns in a step, as by this angular acceleration alone, does not spin.
        let spinning = w != Vec3::zeros();
        if spinning {
            let (q_after, rate_after) = state.amplitudes().unwrap();
            let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>();
            middle.set_amplitudes(&mean(&q, q_after), &mean(&q_dot, rate_after)).unwrap();
        }
        let expected = modal_force(&middle, |m, r, velocity| {
            m * (back(gravity - rates.acceleration) - a.cross(&r) - w.cross(&w.cross(&r)) - 2.0 * w.cross(&velocity))
        });
        for k in 0..8 {
            // Implicit Euler solved for the force it was given.
            let lambda = model.modal.eigenvalues[k];
            let f = ((1.0 + h * h * lambda) * state.amplitudes().unwrap().1[k] - q_dot[k]) / h + lambda * q[k];
            // The difference above loses 1e-16 q̇/h, some 1e-12. In a spinning frame the one pass to the middle of the step
            // leaves a share ωh = 2e-3 of what the force changes by in half a step, here a thousandth.
            let tolerance = if spinning { 1e-5 } else { 1e-10 };
            assert_close(&format!("{name}, mode {k}"), f, expected[k], tolerance, 1.0);
        }
        assert!(!earlier.contains(&expected), "{name} must make a difference");
        earlier.push(expected);
    }
}

#[test]
fn a_free_shell_stays_behind_when_its_frame_moves_away() {
    {
        let model = free_sheet();
        let mut state = State::new(model.clone(), Method::Warp, Integrator::ImplicitEuler).unwrap();
        state.step(0.01).unwrap();
        let before = positions(&state, Space::World);
        for k in 1..=50 {
            let t = f64::from(k) * 0.02;
            let origin = Vec3::new((3.0 * t).sin(), t * t, 1.0 - (2.0 * t).cos());
            state.set_frame(Pose { origin, rotation: UnitQuaternion::identity() }, FrameMotion::Continuous);
            state.step(if k % 3 == 0 { 0.01 } else { 0.03 }).unwrap();
            for (x, start) in positions(&state, Space::World).iter().zip(&before) {
                // Nothing pushes it in world space, and impulses are exact. What is left is the translations' mixture
                // with the first elastic mode, 1e-16 ‖A‖/λ, some 1e-11, on paths of order 1.
                assert!((x - start).norm() < 1e-10, "step {k}: {:e}", (x - start).norm());
            }
        }
    }
}

#[test]
fn a_teleport_pushes_nothing_and_a_held_frame_carries_rigidly() {
    let model = beam("v_beam");
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    state.step(0.01).unwrap();
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 2.0, 0.3));
    let origin = Vec3::new(100.0, -50.0, 3.0);
    state.set_frame(Pose { origin, rotation }, FrameMotion::Teleport);
    state.step(0.01).unwrap();
    assert_eq!(state.report().kinetic_energy, 0.0);
    for (x, rest) in positions(&state, Space::World).iter().zip(&model.shell.mesh.positions) {
        // Rounding of coordinates of order 100.
        assert!((x - (origin + rotation * rest)).norm() < 1e-12);
    }
    state.step(0.01).unwrap();
    assert_eq!(state.report().kinetic_energy, 0.0, "the frame is at rest after a teleport");
}

#[test]
fn a_frame_that_turns_steadily_pulls_outwards() {
    // Three revolutions, well past every branch of the rotation's logarithm.
    let model = beam("flat_beam");
    let mut state = State::new(model.clone(), Method::Warp, Integrator::ImplicitEuler).unwrap();
    state.set_damping(&Damping { ratios: vec![1.0], ..Damping::default() }).unwrap();
    let (rate, h) = (1.5, 1.0 / 60.0);
    for k in 1..=750 {
        let rotation = UnitQuaternion::from_scaled_axis(Vec3::z() * (rate * h * f64::from(k)));
        state.set_frame(Pose { origin: Vec3::zeros(), rotation }, FrameMotion::Continuous);
        state.step(h).unwrap();
    }
    // The beam lies along x, the axis through its clamp: static force −m ω × (ω × r) = m ω² (x, y, 0).
    let expected = modal_force(&state, |m, r, _| m * rate * rate * Vec3::new(r.x, r.y, 0.0));
    let q = state.amplitudes().unwrap().0;
    for k in 0..8 {
        assert_close(&format!("mode {k}"), model.modal.eigenvalues[k] * q[k], expected[k], 1e-6, 1e-3);
    }
}

/// A state in the middle of everything: gravity, damping, a moving frame.
fn busy_state(model: &Arc<Model>) -> State {
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.5, -2.0)).unwrap();
    state.set_damping(&Damping { mass_coefficient: 0.1, ..Damping::default() }).unwrap();
    state
}

fn shake(state: &mut State, from: u32, to: u32) {
    for k in from..to {
        let t = f64::from(k) / 30.0;
        let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.2 * t.sin(), 0.1 * (2.0 * t).sin()));
        state.set_frame(Pose { origin: Vec3::new((3.0 * t).sin(), 0.0, 0.0), rotation }, FrameMotion::Continuous);
        state.step(1.0 / 30.0).unwrap();
    }
}

#[test]
fn a_clone_and_a_restored_state_go_on_with_the_same_bits() {
    let model = model_of(reference("v_beam").0, 8, Precision::F32);
    let mut one = busy_state(&model);
    shake(&mut one, 0, 40);
    let saved = one.save();
    let mut clone = one.try_clone().unwrap();
    let mut restored = busy_state(&model);
    restored.load(&saved).unwrap();
    for state in [&mut one, &mut clone, &mut restored] {
        shake(state, 40, 90);
    }
    assert_eq!(one.save(), clone.save());
    assert_eq!(one.save(), restored.save());
    assert_eq!(positions(&one, Space::World), positions(&restored, Space::World));
}

#[test]
fn a_saved_state_is_under_a_kilobyte_at_50_modes() {
    let model = model_of(reference("flat_beam").0, 50, Precision::F32);
    let state = State::new(model, Method::Warp, Integrator::Exact).unwrap();
    assert_eq!(state.save().len(), state.saved_size());
    assert_eq!(state.saved_size(), 952);
}

#[test]
fn damaged_or_foreign_bytes_are_refused_and_change_nothing() {
    let model = beam("v_beam");
    let mut state = busy_state(&model);
    shake(&mut state, 0, 5);
    let saved = state.save();
    for length in 0..saved.len() {
        assert_eq!(state.load(&saved[..length]).unwrap_err().kind, ErrorKind::InvalidData, "length {length}");
    }
    for at in 0..saved.len() {
        for bit in 0..8 {
            let mut flipped = saved.clone();
            flipped[at] ^= 1 << bit;
            assert!(state.load(&flipped).is_err(), "byte {at}, bit {bit}");
        }
    }
    let other = busy_state(&beam("flat_beam")).save();
    assert!(state.load(&other).unwrap_err().message.contains("another model"));
    assert_eq!(state.save(), saved);
}

#[test]
fn reset_gives_the_run_from_the_start_again() {
    let model = beam("v_beam");
    let mut state = busy_state(&model);
    shake(&mut state, 0, 30);
    let first = state.save();
    state.reset();
    shake(&mut state, 0, 30);
    assert_eq!(state.save(), first);
}

#[test]
fn a_step_that_would_not_be_finite_is_refused_and_changes_nothing() {
    let mut state = busy_state(&model_of(reference("v_beam").0, 8, Precision::F32));
    shake(&mut state, 0, 3);
    let saved = state.save();
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(state.step(h).unwrap_err().kind, ErrorKind::InvalidArgument);
    }
    state.set_gravity(Vec3::repeat(1e300)).unwrap(); // beyond f32
    assert_eq!(state.step(1e-3).unwrap_err().kind, ErrorKind::Numerical);
    assert_eq!(state.save(), saved);
}

#[test]
fn a_step_does_not_allocate() {
    for precision in [Precision::F32, Precision::F64] {
        let model = model_of(reference("v_beam").0, 8, precision);
        for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
            let mut state = State::new(model.clone(), Method::Warp, integrator).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.5, -2.0)).unwrap();
            let mut out = vec![Vec3::zeros(); 369];
            let counted = allocation_counter::measure(|| {
                shake(&mut state, 0, 10);
                state.positions(Space::World, |v, x| out[v] = x);
                state.position_rows_f32(Space::World, |first, rows| out[first].x += f64::from(rows[0][0]));
                out[0].y += state.report().max_rotation;
            });
            assert_eq!(counted.count_total, 0);
        }
    }
}

#[test]
fn normals_and_rotations_of_a_turned_shell_turn_with_it() {
    let model = free_sheet();
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    let mut q_dot = vec![0.0; model.modal.n_modes()];
    q_dot[3..6].copy_from_slice(&[0.1, 0.2, -0.1]);
    state.set_amplitudes(&vec![0.0; model.modal.n_modes()], &q_dot).unwrap();
    state.step(1.0).unwrap();
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.5, 0.2, 0.1));
    state.set_frame(Pose { origin: Vec3::zeros(), rotation }, FrameMotion::Teleport);
    state.step(1e-9).unwrap();
    let mut turns = vec![UnitQuaternion::identity(); model.shell.mass.len()];
    state.rotations(Space::World, |v, r| turns[v] = r).unwrap();
    state
        .normals(Space::World, |v, n| {
            // The sheet's rest normal is +z; a rigid motion turns it exactly, up to rounding of thin corner triangles.
            assert!((n - turns[v] * Vec3::z()).norm() < 1e-10, "vertex {v}");
        })
        .unwrap();
}

#[test]
fn whirling_in_a_spinning_frame_keeps_its_energy_bounded() {
    // A square tube clamped at one end: its first two modes are a pair that the Coriolis force couples. Below the critical
    // speed it whirls for ever; taken at the step's start the force fed it 1e10-fold in 30 s.
    let (rings, side) = (24, 4);
    let mut positions = vec![];
    for i in 0..=rings {
        for k in 0..4 * side {
            let (edge, t) = (k / side, (k % side) as f64 / side as f64 - 0.5);
            let (y, z) = [(t, -0.5), (0.5, t), (-t, 0.5), (-0.5, -t)][edge];
            positions.push(Vec3::new(i as f64 * 0.25, y, z));
        }
    }
    let at = |i: usize, k: usize| (i * 4 * side + k % (4 * side)) as u32;
    let quads = (0..rings).flat_map(|i| (0..4 * side).map(move |k| (i, k)));
    let triangles: Vec<[u32; 3]> = quads
        .flat_map(|(i, k)| {
            let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            [[a, c, b], [a, d, c]]
        })
        .collect();
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.3).collect();
    let material = Material { k_area: 1e3, k_length: 1e3, k_bend: 10.0, area_density: 1.0 };
    let supports = Supports { fixed, ..Default::default() };
    let model = model_of(
        Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap(),
        4,
        Precision::F64,
    );
    let rate = 0.5 * model.modal.eigenvalues[0].sqrt(); // half the critical speed
    for (method, integrator) in [(Method::LinearModalAnalysis, Integrator::Exact), (Method::Warp, Integrator::Exact)] {
        let mut state = State::new(model.clone(), method, integrator).unwrap();
        let h = 0.1 / model.modal.eigenvalues[0].sqrt();
        let mut q = vec![0.0; 4];
        q[0] = 0.05;
        state.set_amplitudes(&q, &[0.0; 4]).unwrap();
        let energy = |state: &State| state.report().elastic_energy + state.report().kinetic_energy;
        let start = energy(&state);
        let mut highest = 0.0f64;
        for k in 1..=3000 {
            let rotation = UnitQuaternion::from_scaled_axis(Vec3::x() * (rate * h * f64::from(k)));
            let rates = Rates { angular_velocity: Vec3::x() * rate, ..Rates::default() };
            state.set_frame(Pose { origin: Vec3::zeros(), rotation }, FrameMotion::Given(rates));
            state.step(h).unwrap();
            highest = highest.max(energy(&state));
        }
        // In the turning frame the two senses of whirling exchange energy, at half the critical speed by a factor of a few.
        assert!(highest < 5.0 * start, "{method:?}: {highest:e} from {start:e}");
    }
}

#[test]
fn an_equilibrium_is_found_on_a_basis_of_either_precision() {
    for (method, gravity) in [(Method::Warp, 0.4), (Method::LinearModalAnalysis, 0.4), (Method::Warp, 0.8)] {
        let [single, double] = [Precision::F32, Precision::F64].map(|precision| {
            let model = model_of(reference("flat_beam").0, 32, precision);
            let mut state = State::new(model, method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -gravity)).unwrap();
            state.equilibrium().unwrap();
            displacements(&state)
        });
        let apart: f64 = single.iter().zip(&double).map(|(a, b)| (a - b).norm_squared()).sum();
        let size: f64 = double.iter().map(|u| u.norm_squared()).sum();
        // 1e-6 where it stops, and as much again from rounding of the basis, over 1 - contraction.
        assert!((apart / size).sqrt() <= 1e-5, "{method:?}, g = {gravity}: {:e}", (apart / size).sqrt());
    }
}

#[test]
fn motion_that_dies_away_ends_at_zero_and_not_among_subnormal_numbers() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
        let mut state = State::new(beam("v_beam"), Method::LinearModalAnalysis, integrator).unwrap();
        state.set_damping(&Damping { mass_coefficient: 300.0, ..Damping::default() }).unwrap();
        let modes = state.amplitudes().unwrap().0.len();
        state.set_amplitudes(&vec![1e-3; modes], &vec![0.0; modes]).unwrap();
        let mut steps = 0;
        while state.amplitudes().unwrap().0.iter().any(|q| *q != 0.0) {
            state.step(1.0).unwrap();
            let (q, q_dot) = state.amplitudes().unwrap();
            assert!(!q.iter().chain(q_dot).any(|x| x.is_subnormal()));
            steps += 1;
            assert!(steps < 5000, "{integrator:?}: {q:?}");
        }
    }
}

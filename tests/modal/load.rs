//! Forces, wind, and equilibria of every method behind one state.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::load::{Loads, Moving, Wind};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

fn model_of(shell: Shell, modes: usize) -> Arc<Model> {
    let options = Options { modes, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap()
}

const METHODS: [Method; 3] = [Method::LinearModalAnalysis, Method::Warp, Method::ImplicitShell];

#[test]
fn equilibria_of_every_method_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let model = model_of(shell, 8);
        for case in json["equilibria"].as_array().unwrap() {
            let gravity: Vec<f64> = case["gravity"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            for (method, key) in METHODS.iter().zip(["lma_l2", "mwts_l2", "ds_l2"]) {
                let mut state = state(&model, *method);
                state.set_gravity(Vec3::from_vec(gravity.clone())).unwrap();
                let (residual, iterations) = state.equilibrium().unwrap();
                let l2 = displacements(&state).iter().map(|u| u.norm_squared()).sum::<f64>().sqrt();
                println!("{name} {gravity:?} {key}: {l2}, residual {residual:.1e}, {iterations} iterations");
                assert_close(&format!("{name} {gravity:?} {key}"), l2, case[key].as_f64().unwrap(), 1e-5, 0.0);
            }
        }
    }
}

#[test]
fn forces_of_the_weight_do_what_gravity_does() {
    let model = model_of(reference("v_beam").0, 8);
    let gravity = Vec3::new(0.0, 0.6, -0.8);
    for method in METHODS {
        let (mut by_gravity, mut by_force) = (state(&model, method), state(&model, method));
        by_gravity.set_gravity(gravity).unwrap();
        let weights = model.shell.mass.iter().enumerate().map(|(v, m)| (v as u32, *m * gravity)).collect::<Vec<_>>();
        by_force.set_forces(weights, false).unwrap();
        for _ in 0..10 {
            by_gravity.step(1.0 / 30.0).unwrap();
            by_force.step(1.0 / 30.0).unwrap();
        }
        for (a, b) in displacements(&by_gravity).iter().zip(displacements(&by_force)) {
            // Newton's stopping residual, 1e-8 of the load or better; rounding for the modal methods.
            assert!((a - b).norm() < 1e-7, "{method:?}");
        }
    }
}

#[test]
fn forces_for_one_step_are_forgotten_after_it() {
    let model = model_of(reference("v_beam").0, 8);
    let mut state = state(&model, Method::Warp);
    state.set_forces(vec![(204, Vec3::z()), (204, Vec3::z())], true).unwrap();
    state.step(0.01).unwrap();
    let pushed = state.amplitudes().unwrap().1.to_vec();
    assert!(pushed.iter().any(|v| v.abs() > 1e-6));
    let mut free = state.try_clone().unwrap();
    free.set_forces(vec![], false).unwrap();
    free.step(0.01).unwrap();
    state.step(0.01).unwrap();
    assert_eq!(state.amplitudes().unwrap(), free.amplitudes().unwrap());
}

#[test]
fn forces_are_in_world_axes_whatever_the_frame() {
    let model = model_of(reference("v_beam").0, 8);
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vec3::new(0.3, 1.2, -0.4));
    let (mut turned, mut plain) = (state(&model, Method::Warp), state(&model, Method::Warp));
    let force = Vec3::new(0.1, -0.2, 0.3);
    plain.set_forces(vec![(204, force)], false).unwrap();
    turned.set_frame(Pose { origin: Vec3::zeros(), rotation: turn }, FrameMotion::Teleport);
    turned.set_forces(vec![(204, turn * force)], false).unwrap();
    for state in [&mut turned, &mut plain] {
        state.equilibrium().unwrap();
    }
    for (a, b) in displacements(&turned).iter().zip(displacements(&plain)) {
        // Rounding of the rotation, there and back.
        assert!((a - b).norm() < 1e-10);
    }
}

/// A clamped square sheet in the plane z = 0.
fn sheet() -> Arc<Model> {
    let (positions, triangles) = equilateral_sheet(12, 12, 0.1);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.11).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 20.0, area_density: 1.0 };
    model_of(
        Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() })
            .unwrap(),
        12,
    )
}

#[test]
fn wind_presses_with_half_rho_c_a_v_squared() {
    let model = sheet();
    let (mut blown, mut pressed) =
        (state(&model, Method::LinearModalAnalysis), state(&model, Method::LinearModalAnalysis));
    let (speed, density, drag) = (2.0, 1.2, 1.3);
    let wind = Wind { velocity: Vec3::z() * speed, density, normal_drag: drag, ..Wind::default() };
    blown.set_wind(wind).unwrap();
    let pressure = 0.5 * density * drag * speed * speed;
    let mut forces = vec![];
    for (t, corners) in model.shell.mesh.triangles.iter().enumerate() {
        let share = Vec3::z() * (pressure * model.shell.mesh.area(t) / 3.0);
        forces.extend(corners.map(|v| (v, share)));
    }
    pressed.set_forces(forces, true).unwrap();
    for state in [&mut blown, &mut pressed] {
        state.step(1e-3).unwrap(); // from rest and flat
    }
    let (a, b) = (blown.amplitudes().unwrap().0, pressed.amplitudes().unwrap().0);
    for k in 0..12 {
        assert_close(&format!("mode {k}"), a[k], b[k], 1e-12, b[0].abs());
    }
}

/// By finite differences, of corners that move alike: the sum over them is the derivative of the whole force.
#[test]
fn drag_is_what_the_winds_force_loses_by_the_velocity() {
    let (positions, triangles) = equilateral_sheet(1, 1, 0.1);
    let mesh = Mesh::new(positions.clone(), &triangles).unwrap();
    let turned = UnitQuaternion::from_euler_angles(0.3, -0.7, 0.2);
    let x: Vec<Vec3> = positions.iter().map(|x| turned * x).collect();
    let n = x.len();
    for tangential_drag in [0.0, 0.4] {
        let mut loads = Loads::default();
        let velocity = Vec3::new(1.0, -2.0, 5.0);
        loads
            .set_wind(Wind { velocity, density: 1.2, normal_drag: 1.1, tangential_drag, ..Wind::default() }, n)
            .unwrap();
        let total = |v: Vec3| {
            let mut force = vec![Vec3::zeros(); n];
            loads.evaluate(&mesh, &Moving { x: &x, v: &vec![v; n] }, &mut force);
            force.iter().sum::<Vec3>()
        };
        let at = Vec3::new(0.2, 0.1, -0.3);
        let mut drag = vec![nalgebra::Matrix3::zeros(); n];
        loads.evaluate_drag(&mesh, &Moving { x: &x, v: &vec![at; n] }, &mut drag);
        let drag = drag.iter().sum::<nalgebra::Matrix3<f64>>();
        for axis in 0..3 {
            let mut step = Vec3::zeros();
            step[axis] = 1e-6;
            let slope = (total(at - step) - total(at + step)) / 2e-6;
            let off = (slope - drag.column(axis)).norm() / drag.norm();
            assert!(off < 1e-8, "axis {axis}, along the face {tangential_drag}: {off}"); // rounding of 1e-16 over 1e-6, twice
        }
    }
}

#[test]
fn a_sheet_that_moves_with_the_air_feels_none_and_still_air_damps() {
    let model = sheet();
    let mut state = state(&model, Method::Warp);
    state.set_wind(Wind { density: 1.2, normal_drag: 1.0, tangential_drag: 0.1, ..Wind::default() }).unwrap();
    let mut q = vec![0.0; 12];
    q[0] = 0.2;
    state.set_amplitudes(&q, &[0.0; 12]).unwrap();
    let mut free = state.try_clone().unwrap();
    free.set_wind(Wind::default()).unwrap();
    for _ in 0..300 {
        state.step(1e-3).unwrap();
        free.step(1e-3).unwrap();
    }
    let energy = |s: &State| s.report().elastic_energy + s.report().kinetic_energy;
    assert!(energy(&state) < 0.98 * energy(&free), "{} {}", energy(&state), energy(&free));

    let drift = Vec3::new(0.3, -0.1, 0.7);
    let mut carried = self::state(&model, Method::Warp);
    carried
        .set_wind(Wind { velocity: drift, density: 1.2, normal_drag: 1.0, tangential_drag: 0.1, local: vec![] })
        .unwrap();
    let mut origin = Vec3::zeros();
    for frame in 0..100 {
        origin += drift * 0.01;
        let motion = if frame == 0 {
            FrameMotion::Given(shellwarp::support::Rates { velocity: drift, ..Default::default() })
        } else {
            FrameMotion::Continuous
        };
        carried.set_frame(Pose { origin, rotation: nalgebra::UnitQuaternion::identity() }, motion);
        carried.step(0.01).unwrap();
    }
    // Relative velocity is rounding, 1e-16, and its square acts.
    assert!(carried.report().max_displacement < 1e-12, "{:?}", carried.report());
}

#[test]
fn an_equilibrium_without_load_is_the_rest_shape_from_wherever_it_starts() {
    // At zero a relative residual has nothing to be relative to but what rounding leaves of the start.
    let model = model_of(reference("v_beam").0, 8);
    for method in [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp, Method::ImplicitShell] {
        let mut state = state(&model, method);
        for pull in 1..=40 {
            state.set_gravity(0.1 * f64::from(pull) * Vec3::new(0.1, 0.3, -1.0)).unwrap();
            state.equilibrium().unwrap();
            let loaded = state.report().max_displacement;
            state.set_gravity(Vec3::zeros()).unwrap();
            state.equilibrium().unwrap_or_else(|e| panic!("{method:?}, pull {pull}: {e}"));
            let left = state.report().max_displacement;
            // The nonlinear shell stops at 1e-10 of the forces of its elements.
            assert!(loaded > 1e-3 && left < 1e-9 * loaded, "{method:?}, pull {pull}: {left:e} of {loaded:e}");
        }
    }
}

#[test]
fn an_equilibrium_in_wind_is_where_the_blown_shell_comes_to_rest() {
    // Strong enough to turn the sheet away from the wind, so that the force at the start is far from the one at the end.
    for method in METHODS {
        let model = sheet();
        let wind = Wind { velocity: Vec3::new(1.2, 0.0, 8.0), density: 1.2, normal_drag: 1.0, ..Wind::default() };
        let (mut found, mut blown) = (state(&model, method), state(&model, method));
        for state in [&mut found, &mut blown] {
            state.set_wind(wind.clone()).unwrap();
            state.set_damping(&Damping { mass_coefficient: 30.0, ..Damping::default() }).unwrap();
        }
        found.equilibrium().unwrap();
        let steps = if method == Method::ImplicitShell { 600 } else { 6000 };
        (0..steps).for_each(|_| blown.step(0.1).unwrap());
        let (a, b) = (displacements(&found), displacements(&blown));
        let largest = b.iter().map(|u| u.norm()).fold(0.0, f64::max);
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        println!("{method:?}: {largest}, off by {worst:e}");
        assert!(largest > 0.05, "{largest}");
        // The force is settled to 1e-6 of itself.
        assert!(worst <= 1e-5 * largest, "{method:?}: {worst:e} of {largest}");
    }
}

#[test]
fn local_velocities_add_to_the_wind() {
    let model = sheet();
    let n = model.shell.mass.len();
    let (mut a, mut b) = (state(&model, Method::Warp), state(&model, Method::Warp));
    let wind = |velocity: Vec3, local: Vec<Vec3>| Wind {
        velocity,
        density: 1.0,
        normal_drag: 1.0,
        tangential_drag: 0.1,
        local,
    };
    a.set_wind(wind(Vec3::new(1.0, 0.5, 2.0), vec![])).unwrap();
    b.set_wind(wind(Vec3::new(1.0, 0.0, 0.0), vec![Vec3::new(0.0, 0.5, 2.0); n])).unwrap();
    for state in [&mut a, &mut b] {
        (0..30).for_each(|_| state.step(0.01).unwrap());
    }
    for (a, b) in a.amplitudes().unwrap().0.iter().zip(b.amplitudes().unwrap().0) {
        assert_close("amplitude", *a, *b, 1e-12, 1e-3);
    }
}

#[test]
fn no_modal_step_allocates_whatever_acts() {
    let model = sheet();
    let n = model.shell.mass.len();
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis] {
        for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
            let mut state = State::new(model.clone(), method, integrator).unwrap();
            state.set_gravity(-0.1 * Vec3::z()).unwrap();
            state.set_forces(vec![(5, Vec3::x()), (6, Vec3::y())], false).unwrap();
            let local = vec![Vec3::x() * 0.1; n];
            let wind = Wind { velocity: Vec3::z(), density: 1.0, normal_drag: 1.0, tangential_drag: 0.1, local };
            state.set_wind(wind).unwrap();
            let target = Target::Orientation(UnitQuaternion::identity());
            let free = model.shell.free[model.shell.free.len() - 1];
            let turn = Constraint { id: 1, vertex: free, axes: [true; 3], compliance: 0.0, target };
            state.set_constraint(turn).unwrap();
            let counted = allocation_counter::measure(|| {
                for k in 1..=10 {
                    let rotation = UnitQuaternion::from_scaled_axis(Vec3::z() * 0.05 * f64::from(k));
                    state.set_frame(Pose { origin: Vec3::x() * 0.01, rotation }, FrameMotion::Continuous);
                    state.step(0.01).unwrap();
                }
            });
            assert_eq!(counted.count_total, 0, "{method:?}, {integrator:?}");
        }
    }
}

#[test]
fn the_nonlinear_shell_swings_like_the_warp_when_little_bent() {
    let model = sheet();
    let run = |method| {
        let mut state = state(&model, method);
        state
            .set_damping(&Damping { mass_coefficient: 0.5, stiffness_coefficient: 1e-4, ..Damping::default() })
            .unwrap();
        state.set_gravity(-0.2 * Vec3::z()).unwrap();
        (0..200).for_each(|_| state.step(1.0 / 100.0).unwrap());
        displacements(&state)
    };
    let (warp, shell) = (run(Method::Warp), run(Method::ImplicitShell));
    let norm = |u: &mut dyn Iterator<Item = Vec3>| u.map(|u| u.norm_squared()).sum::<f64>().sqrt();
    let error = norm(&mut warp.iter().zip(&shell).map(|(a, b)| a - b)) / norm(&mut shell.iter().copied());
    // A sag of some per cent: the modes left out and the nonlinearity of the same order.
    assert!(error < 0.02, "{error}");
}

#[test]
fn a_nonlinear_state_saves_restores_and_says_what_it_does_not_offer() {
    let model = sheet();
    let mut one = state(&model, Method::ImplicitShell);
    one.set_gravity(-Vec3::z()).unwrap();
    (0..3).for_each(|_| one.step(0.02).unwrap());
    let mut other = state(&model, Method::ImplicitShell);
    other.set_gravity(-Vec3::z()).unwrap();
    other.load(&one.save()).unwrap();
    let mut clone = one.try_clone().unwrap();
    for state in [&mut one, &mut other, &mut clone] {
        state.step(0.02).unwrap();
    }
    assert_eq!(one.save(), other.save());
    assert_eq!(one.save(), clone.save());
    assert_eq!(one.amplitudes().unwrap_err().kind, ErrorKind::Unsupported);
    let mut ratios = vec![0.1; one.model().modal.n_modes()];
    ratios[0] = 0.2;
    let differ = one.set_damping(&Damping { ratios, ..Damping::default() }).unwrap_err();
    assert_eq!(differ.kind, ErrorKind::Unsupported);
    assert!(one.turn_in_range(&one.report()) && one.report().elastic_energy > 0.0);
}

#[test]
fn a_shell_that_nothing_holds_has_no_equilibrium_under_gravity() {
    let (positions, triangles) = equilateral_sheet(12, 8, 0.1);
    let shell =
        Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &Supports::default()).unwrap();
    let model = model_of(shell, 8);
    for method in METHODS {
        let mut state = state(&model, method);
        state.set_gravity(-Vec3::z()).unwrap();
        assert_eq!(state.equilibrium().unwrap_err().kind, ErrorKind::Numerical, "{method:?}");
        assert_eq!(state.report().max_displacement, 0.0, "nothing has moved");
    }
}

#[test]
fn wrong_loads_are_named() {
    let mut state = state(&sheet(), Method::Warp);
    let message = |e: shellwarp::Result<()>| e.unwrap_err().message;
    assert!(message(state.set_forces(vec![(100_000, Vec3::x())], false)).contains("vertex 100000"));
    assert!(message(state.set_forces(vec![(1, Vec3::repeat(f64::NAN))], false)).contains("NaN"));
    assert!(message(state.set_wind(Wind { density: -1.0, ..Wind::default() })).contains("density"));
    assert!(
        message(state.set_wind(Wind { density: 1.0, local: vec![Vec3::x()], ..Wind::default() })).contains("1 local")
    );
}

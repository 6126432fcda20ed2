//! What fuzzing found, each as a test with its smallest case: numbers at the end of their range and what failed calls leave.

use crate::common::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose, Rates};
use shellwarp::{Error, ErrorKind, Material, Mesh, Result, Shell, Supports, Vec3};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

const ALL: [Method; 5] =
    [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis, Method::ImplicitShell, Method::ExplicitShell];

/// A sheet of edge length `edge`, held at one end.
fn sheet(edge: f64, precision: Precision) -> Result<Arc<Model>> {
    let (positions, triangles) = equilateral_sheet(3, 2, edge);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.1 * edge).collect();
    // The membrane grows with the bending on tiny sheets: modes 1e86 below the largest are refused as lost.
    let mesh = Mesh::new(positions, &triangles)?;
    let shell = Shell::new(
        mesh,
        Material { k_area: 1e4f64.max(edge.powi(-2)), k_length: 1e4f64.max(1.0 / edge), ..Material::default() },
        &Supports { fixed, ..Default::default() },
    )?;
    Ok(Arc::new(Model::precompute(
        Arc::new(shell),
        &Options { modes: 4, precision, ..Options::default() },
        &mut |_, _| Ok(()),
    )?))
}

fn state(method: Method) -> State {
    State::new(sheet(0.25, Precision::F32).unwrap(), method, Integrator::Exact).unwrap()
}

#[track_caller]
fn is_numerical<T>(outcome: Result<T>) -> Error {
    let Err(error) = outcome else { panic!("this must fail") };
    assert_eq!(error.kind, ErrorKind::Numerical, "{error}");
    error
}

#[test]
fn mode_shapes_that_32_bits_cannot_hold_are_refused_and_64_bits_hold_them() {
    // Rotations per amplitude go as 1/length.
    let Err(error) = sheet(1e-45, Precision::F32) else { panic!("f32 ends at 3e38") };
    assert!(error.message.contains("64-bit"), "{error}");
    is_numerical(Err::<(), _>(error));
    let model = sheet(1e-45, Precision::F64).unwrap();
    assert!((0..4).all(|k| (0..model.shell.mass.len()).all(|v| model.modal.mode_at(k, v).1.norm().is_finite())));
}

#[test]
fn a_residual_that_overflows_is_refused() {
    // Rounding of 1e-16 in forces of 1e200, squared. Elsewhere the same shell has modes.
    let precompute = |stiffness: f64| {
        let (positions, triangles) = equilateral_sheet(3, 2, 0.25);
        let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.025).collect();
        let material =
            Material { k_area: 1e4 * stiffness, k_length: 1e4 * stiffness, k_bend: stiffness, area_density: 1.0 };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        let shell = Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap();
        Model::precompute(Arc::new(shell), &Options { modes: 4, ..Options::default() }, &mut |_, _| Ok(()))
    };
    assert!(precompute(1e140).unwrap().certificate.residual < 1e-14);
    is_numerical(precompute(1e200));
}

#[test]
fn rotations_of_a_very_heavy_shell_do_not_underflow() {
    // Amplitudes go as the root of the mass, so shapes per amplitude are of order 1e-150 here and their squares vanish.
    let (positions, triangles) = equilateral_sheet(3, 2, 1e17);
    let material = Material { k_bend: 1e34, area_density: 1e256, ..Material::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports::default()).unwrap();
    let options = Options { modes: 8, precision: Precision::F32, ..Options::default() };
    let model = Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap();
    assert!(
        model.modal.largest_rotation[3..].iter().all(|rotation| *rotation > 0.0),
        "{:?}",
        model.modal.largest_rotation
    );
    Model::load(&model.save().unwrap()).unwrap();
}

#[test]
fn a_mass_that_is_finite_by_triangles_but_not_in_sum_is_refused() {
    let (positions, triangles) = equilateral_sheet(3, 2, 1.0);
    let material = Material { area_density: 1e308, ..Material::default() };
    is_numerical(Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports::default()));
}

#[test]
fn a_held_vertex_out_of_all_reach_is_refused() {
    // The free vertices share no stiff element with it, so their entries are finite; the energy's rows beyond are not.
    let l = 2.5e-43;
    let mut positions: Vec<Vec3> = (0..6).map(|k| l * Vec3::new(f64::from(k / 3), f64::from(k % 3), 0.0)).collect();
    positions[0].z = -1e193;
    let triangles = [[0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2]];
    let supports = Supports { fixed: vec![0], clamped: vec![0, 4], ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    let outcome = Model::precompute(Arc::new(shell), &Options { modes: 3, ..Options::default() }, &mut |_, _| Ok(()));
    assert!(is_numerical(outcome).message.contains("held vertex"));
}

#[test]
fn a_shell_that_sags_beyond_all_measure_is_refused_before_it_is_saved() {
    // A triangle pulled along its plane: stretched by m g l/k, a third of 1e32 of its size.
    let mesh = Mesh::new(vec![Vec3::zeros(), Vec3::y(), Vec3::x()], &[[0, 2, 1]]).unwrap();
    let material = Material { k_area: 1e-32, k_length: 1e-32, ..Material::default() };
    let shell = Shell::new(mesh, material, &Supports { fixed: vec![0, 1], ..Default::default() }).unwrap();
    let options = Options { modes: 3, sag: Vec3::x(), ..Options::default() };
    let outcome = Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(()));
    assert!(is_numerical(outcome).message.contains("beyond all measure"));
}

#[test]
fn a_load_that_overflows_is_a_numerical_failure_of_the_step() {
    for method in ALL {
        let mut state = state(method);
        state.set_gravity(Vec3::z() * 1e308).unwrap();
        let far = Rates { acceleration: Vec3::z() * -1.7e308, ..Rates::default() };
        state.set_frame(Pose::identity(), FrameMotion::Given(far));
        is_numerical(state.step(0.01));
    }
}

/// The guard against loads beyond range took one whose square overflows for none, and the shell stayed where it was.
#[test]
fn a_gravity_whose_square_overflows_is_refused_by_steps_and_equilibria() {
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis, Method::RotationStrain] {
        for gravity in [1e155, 1e200, 1e300] {
            let mut state = state(method);
            state.set_gravity(Vec3::z() * gravity).unwrap();
            is_numerical(state.step(0.01));
            is_numerical(state.equilibrium());
        }
    }
}

#[test]
fn a_reduced_shell_whose_energy_overflows_is_refused_by_steps() {
    let reduced = shellwarp::reduced::Options { fields: 6, poses: 8, ..Default::default() };
    let options = Options { modes: 4, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(leaf(1)), &options, &mut |_, _| Ok(())).unwrap());
    for method in [Method::PolynomialShell, Method::ReducedShell] {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        for gravity in [1e100, 1e160, 1e300] {
            state.set_gravity(Vec3::z() * gravity).unwrap();
            let saved = state.save();
            is_numerical(state.step(0.02));
            assert_eq!(state.save(), saved, "{method:?}");
        }
    }
}

#[test]
fn the_vertex_of_a_wind_that_is_no_number_is_named() {
    let mut state = state(Method::Warp);
    let mut local = vec![Vec3::zeros(); state.model().shell.mass.len()];
    local[5].y = f64::NAN;
    let error = state.set_wind(shellwarp::load::Wind { density: 1.0, local, ..Default::default() }).unwrap_err();
    assert_eq!(error.message, "the wind velocity at vertex 5 is NaN: it must be finite");
}

#[test]
fn the_size_of_a_mesh_is_finite_or_the_mesh_refused() {
    let triangle = |x: f64, y: f64| Mesh::new(vec![Vec3::zeros(), Vec3::x() * x, Vec3::y() * y], &[[0, 1, 2]]).unwrap();
    let size = triangle(1e160, 1e149).size; // whose square is not finite
    assert_close("size", size, 1e160, 1e-15, 0.0);
    let wide = Mesh::new(vec![Vec3::x() * -1.5e308, Vec3::x() * 1.5e308, Vec3::y()], &[[0, 1, 2]]);
    if let Ok(wide) = wide {
        is_numerical(Shell::new(wide, Material::default(), &Supports::default()));
    }
}

#[test]
fn a_failed_step_leaves_the_constraints_reports() {
    let mut state = state(Method::Warp);
    let vertex = state.model().shell.free[3];
    let target = Target::Position(state.model().shell.mesh.positions[vertex as usize] + Vec3::z() * 0.02);
    state.set_constraint(Constraint { id: 1, vertex, axes: [false, false, true], compliance: 0.0, target }).unwrap();
    state.step(0.1).unwrap();
    let outcome = |state: &State| *state.constraints().next().unwrap().1;
    let (before, saved) = (outcome(&state), state.save());
    assert!(before.force != Vec3::zeros());
    state.set_gravity(Vec3::repeat(1e300)).unwrap();
    is_numerical(state.step(100.0));
    assert_eq!(outcome(&state), before);
    is_numerical(state.equilibrium());
    assert_eq!((outcome(&state), state.save()), (before, saved));
}

#[test]
fn an_equilibrium_that_fails_after_good_iterations_leaves_the_constraints_reports() {
    let mut state = state(Method::VirtualWorkWarp);
    let vertex = state.model().shell.free[3];
    let target = Target::Position(state.model().shell.mesh.positions[vertex as usize] + Vec3::z() * 0.02);
    state.set_constraint(Constraint { id: 1, vertex, axes: [false, false, true], compliance: 0.0, target }).unwrap();
    state.step(0.1).unwrap();
    let outcome = |state: &State| *state.constraints().next().unwrap().1;
    let (before, saved) = (outcome(&state), state.save());
    state.set_gravity(Vec3::new(300.0, 200.0, -1000.0)).unwrap(); // beyond the guard, where the fixed point goes in circles
    assert!(is_numerical(state.equilibrium()).message.contains("after 1000 iterations"));
    assert_eq!((outcome(&state), state.save()), (before, saved));
}

#[test]
fn velocities_whose_energy_overflows_are_refused() {
    let mut state = state(Method::Warp);
    is_numerical(state.set_amplitudes(&[0.0; 4], &[1e200, 0.0, 0.0, 0.0]));
    assert_eq!(state.report().kinetic_energy, 0.0);
}

/// A saved state with the double at `at` replaced, and a right checksum.
fn forged(saved: &[u8], at: usize, value: f64) -> Vec<u8> {
    let mut bytes = saved.to_vec();
    let at = 24 + 8 * at;
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
    let body = bytes.len() - 8;
    let sum = xxh3_64(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&sum);
    bytes
}

#[test]
fn saved_states_beyond_all_range_are_refused() {
    for method in ALL {
        let mut state = state(method);
        state.set_gravity(Vec3::z()).unwrap();
        state.step(1e-5).unwrap();
        let saved = state.save();
        let unknowns = (saved.len() - 24 - 8 * 15 - 8) / 16;
        for at in [15, 15 + unknowns - 1, 15 + unknowns, 15 + 2 * unknowns - 1] {
            let error = state.load(&forged(&saved, at, 1e200)).unwrap_err();
            assert_eq!(error.kind, ErrorKind::InvalidData, "{method:?}, number {at}: {error}");
        }
        assert_eq!(state.save(), saved);
        assert!(state.load(&forged(&saved, 14, f64::INFINITY)).is_err(), "{method:?}: constraint work without bound");
        state.load(&saved).unwrap();
    }
}

#[test]
fn a_failed_equilibrium_of_a_nonlinear_shell_leaves_its_velocities() {
    let mut state = state(Method::ImplicitShell);
    state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
    state.step(0.01).unwrap();
    let saved = state.save();
    state.set_gravity(Vec3::repeat(1e200)).unwrap();
    state.equilibrium().unwrap_err();
    assert_eq!(state.save(), saved);
    assert!(state.report().kinetic_energy > 0.0);
}

#[test]
fn a_shell_that_would_leave_all_range_in_a_step_stays() {
    for method in ALL {
        let mut state = state(method);
        state.set_gravity(Vec3::z() * 1e100).unwrap();
        let saved = state.save();
        for h in [1e-3, 1e60, 1e150] {
            // It may be that the guard, or Newton's iteration, finds a pose.
            if let Err(error) = state.step(h) {
                assert!(matches!(error.kind, ErrorKind::Numerical | ErrorKind::InvalidArgument), "{method:?}: {error}");
                assert_eq!(state.save(), saved, "{method:?}");
            }
            let report = state.report();
            assert!(
                (report.elastic_energy + report.kinetic_energy + report.max_displacement).is_finite(),
                "{method:?}"
            );
            state.load(&saved).unwrap();
        }
    }
}

#[test]
fn a_frame_that_moves_beyond_all_speed_is_refused() {
    for method in ALL {
        let mut state = state(method);
        state.step(1e-3).unwrap();
        let saved = state.save();
        let far = Pose { origin: Vec3::x() * 1e300, ..Pose::identity() };
        state.set_frame(far, FrameMotion::Continuous);
        assert!(is_numerical(state.step(1e-100)).message.contains("frame"));
        assert_eq!(state.save(), saved);
        state.set_frame(far, FrameMotion::Teleport);
        state.step(1e-3).unwrap();
        let saved = state.save();
        state.load(&saved).unwrap();
    }
}

#[test]
fn many_triangles_on_one_edge_are_checked_in_time() {
    // Pair by pair this would take days.
    let n = 300_000u32;
    let mut positions = vec![Vec3::zeros(), Vec3::x()];
    positions.extend((0..n).map(|k| Vec3::new(0.5, f64::from(k).cos(), f64::from(k).sin())));
    let triangles: Vec<[u32; 3]> = (0..n).map(|k| [0, 1, 2 + k]).collect();
    let found = shellwarp::mesh::check(&positions, &triangles);
    assert!(found.first_error().unwrap().to_string().contains("300000 triangles"));
}

//! Newton's method with the stress as an unknown ends where the energy's does, sooner.

use crate::common::{equilateral_sheet, gravity, leaf, mass_error, reference};
use nalgebra::{DMatrix, Matrix3, UnitQuaternion};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::energy::{Curvature, Mat3, Stress};
use shellwarp::material::PRESETS;
use shellwarp::reference::{EquilibriumOptions, Rayleigh, STEP_SOLVES, Solver};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// Where the load leads from rest, and the factorizations.
fn equilibrium(shell: &Arc<Shell>, forces: &[Vec3], mixed: bool) -> (Vec<Vec3>, usize) {
    let mut solver = Solver::new(shell.clone()).unwrap();
    solver.set_mixed(mixed);
    let rest = vec![Vec3::zeros(); forces.len()];
    let found = solver.equilibrium(&rest, forces, &EquilibriumOptions::default(), &mut |_| Ok(())).unwrap();
    assert!(found.residual <= 1e-6, "{:e}", found.residual); // rounding of the coordinates leaves so much
    (found.displacement, solver.factorizations())
}

#[test]
fn a_stable_way_takes_less_than_half_the_factorizations_and_ends_at_the_same_place() {
    let shell = Arc::new(leaf(1));
    for direction in [[-0.5, -0.5, 0.7], [0.3, 0.8, 0.5], [-0.1, 0.15, 0.95]] {
        let forces = gravity(&shell, direction, 0.1);
        let (plain, many) = equilibrium(&shell, &forces, false);
        let (mixed, few) = equilibrium(&shell, &forces, true);
        // Residuals of 1e-8 on a leaf whose stiffnesses are five decades apart.
        let apart = mass_error(&shell, &mixed, &plain);
        assert!(apart < 1e-6, "{direction:?}: {apart:e}");
        assert!(2 * few < many, "{direction:?}: {few} and {many}");
    }
}

#[test]
fn a_leaf_that_snaps_on_the_way_is_followed_down_to_where_it_comes_to_rest() {
    let shell = Arc::new(leaf(1));
    for mixed in [false, true] {
        let mut solver = Solver::new(shell.clone()).unwrap();
        let forces = gravity(&shell, [-0.5, -0.5, 0.7], 0.3);
        let (u, _) = equilibrium(&shell, &forces, mixed);
        let work: f64 = u.iter().zip(&forces).map(|(u, f)| u.dot(f)).sum();
        assert!(solver.elastic_energy(&u) < work, "the potential fell from rest");
        let largest = u.iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size;
        assert!(largest > 0.3, "{largest}: it went further than to first order");
    }
}

#[test]
fn the_hessian_with_given_stresses_is_the_hessian_where_they_are_the_shape_s_own() {
    let shell = leaf(1);
    let wave = |x: &Vec3| x + 0.05 * Vec3::new((3.0 * x.y).sin(), (4.0 * x.x).cos(), (5.0 * x.x).sin());
    let x: Vec<Vec3> = shell.mesh.positions.iter().map(wave).collect();
    let mut stress = vec![];
    shell.energy.visit_strains(&x, &mut |_, strain| stress.push(strain));
    let mut own: Vec<Mat3> = vec![];
    shell.energy.visit_hessian(&x, Curvature::Exact, &mut |(_, blocks)| own.extend(blocks));
    let mut given: Vec<Mat3> = vec![];
    shell.energy.visit_mixed_hessian(&x, Stress::whole(&stress), &mut |(_, blocks)| given.extend(blocks));
    assert_eq!(own.len(), given.len());
    let scale = own.iter().map(|block| block.amax()).fold(0.0, f64::max);
    for (k, (own, given)) in own.iter().zip(&given).enumerate() {
        assert!((own - given).amax() <= 1e-13 * scale, "block {k}: {own} {given}"); // roundings of √(2w)
    }
    // Without stress what is left is Σ b bᵀ, and with them the rest is what `visit_stress_hessian` hands out.
    let mut both: Vec<Mat3> = vec![];
    shell.energy.visit_stress_hessian(&x, &stress, Curvature::Exact, &mut |(_, blocks)| both.extend(blocks));
    let mut bare: Vec<Mat3> = vec![];
    shell
        .energy
        .visit_mixed_hessian(&x, Stress::whole(&vec![0.0; stress.len()]), &mut |(_, blocks)| bare.extend(blocks));
    for (k, ((bare, by_stress), own)) in bare.iter().zip(&both).zip(&own).enumerate() {
        assert!((bare + by_stress - own).amax() <= 1e-13 * scale, "block {k}");
    }
}

/// A leaf that falls and swings for two seconds, by frames of 1/30 s: where it ends, the iterations and the factorizations.
fn swing(shell: &Arc<Shell>, mixed: bool) -> (Vec<Vec3>, usize, usize) {
    let mut solver = Solver::new(shell.clone()).unwrap();
    solver.set_mixed(mixed);
    let still = vec![Vec3::zeros(); shell.mass.len()];
    let (mut u, mut velocity, mut iterations) = (still.clone(), still, 0);
    let weight: Vec<Vec3> = shell.mass.iter().map(|m| *m * Vec3::new(3.0, -2.0, -9.0)).collect();
    for _ in 0..60 {
        let step =
            solver.implicit_euler(&mut u, &mut velocity, &weight, Rayleigh { mass: 0.5, stiffness: 0.0 }, 1.0 / 30.0);
        iterations += step.unwrap().iterations;
    }
    (u, iterations, solver.factorizations())
}

#[test]
fn steps_by_the_factor_of_an_earlier_tangent_end_where_newton_s_steps_end() {
    let shell = Arc::new(leaf(1));
    let (plain, _, _) = swing(&shell, false); // each direction by a factor of its own
    let (mixed, iterations, factorizations) = swing(&shell, true);
    // 60 steps to 1e-9 of the forces each.
    let apart = mass_error(&shell, &mixed, &plain);
    assert!(apart < 1e-8, "{apart:e}");
    assert!(3 * factorizations < 2 * iterations, "{factorizations} factorizations for {iterations} iterations");
}

#[test]
fn large_steps_are_solved_by_factors_in_single_precision_where_inertia_is_within_their_digits() {
    for (stiffness, single) in [(1.0, true), (1e6, false)] {
        let (positions, triangles) = equilateral_sheet(44, 44, 1.0 / 44.0);
        let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.02).collect();
        let [k, k_bend] = [1e3, 1e-3].map(|k| k * stiffness);
        let material = Material { k_area: k, k_length: k, k_bend, area_density: 0.2 };
        let supports = Supports { fixed, ..Supports::default() };
        let shell = Arc::new(Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap());
        let weight: Vec<Vec3> = shell.mass.iter().map(|m| *m * Vec3::new(3.0, -2.0, -9.0)).collect();
        let ends = [false, true].map(|reusing| {
            let mut solver = Solver::new(shell.clone()).unwrap();
            solver.set_reusing(reusing); // without, each direction is by a factor of its own in double precision
            let still = vec![Vec3::zeros(); shell.mass.len()];
            let (mut u, mut velocity) = (still.clone(), still);
            let none = Rayleigh { mass: 0.0, stiffness: 0.0 };
            for _ in 0..8 {
                solver.implicit_euler(&mut u, &mut velocity, &weight, none, 1.0 / 30.0).unwrap();
            }
            (u, solver.bytes() as f64)
        });
        let [(plain, by_double), (mixed, by_single)] = ends;
        // 8 steps to 1e-9 of the forces each.
        let apart = mass_error(&shell, &mixed, &plain);
        assert!(apart < 1e-8, "{stiffness:e}: {apart:e}");
        let [_, entries] = Solver::new(shell.clone()).unwrap().operations();
        assert_eq!(by_single - by_double > 4.0 * entries, single, "{by_single} and {by_double} bytes");
    }
}

#[test]
fn a_search_that_does_not_follow_snaps_ends_at_the_last_shape_before() {
    let shell = Arc::new(leaf(1));
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let forces = gravity(&shell, [-0.5, -0.5, 0.7], 0.3);
    let (fallen, _) = equilibrium(&shell, &forces, true);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let options = EquilibriumOptions { follow_snaps: false, ..Default::default() };
    let error = solver.equilibrium(&rest, &forces, &options, &mut |_| Ok(())).unwrap_err();
    assert_eq!(error.kind, shellwarp::ErrorKind::Numerical, "{error}");
    // Tries that halve from the whole to a thirtieth of the load, of a few iterations each.
    assert!(solver.factorizations() < 100, "{}", solver.factorizations());
    let reached = solver.reached();
    let size = |u: &[Vec3]| u.iter().map(|u| u.norm()).fold(0.0, f64::max);
    assert!(size(&reached) > 0.0 && size(&reached) < 0.75 * size(&fallen), "{} of {}", size(&reached), size(&fallen));
}

#[test]
fn an_increment_that_is_halved_goes_by_what_the_longer_one_found() {
    let shell = Arc::new(leaf(1));
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let mut solver = Solver::new(shell.clone()).unwrap();
    let (options, mut seen) = (EquilibriumOptions { follow_snaps: false, ..Default::default() }, vec![]);
    let forces = gravity(&shell, [-0.5, -0.5, 0.7], 2.0);
    let mut watch = |progress: shellwarp::reference::EquilibriumProgress| {
        seen.push((progress.load, progress.residual));
        Ok(())
    };
    solver.equilibrium(&rest, &forces, &options, &mut watch).unwrap_err();
    assert_eq!(solver.factorizations(), seen.len());
    // At rest all of the share is left to balance.
    let at_rest: Vec<&(f64, f64)> = seen.iter().filter(|(load, residual)| (load - residual).abs() < 1e-9).collect();
    assert!(at_rest.len() == 1 && seen.iter().any(|(load, _)| 4.0 * load <= at_rest[0].0), "{seen:?}");
}

#[test]
fn steps_by_a_tangent_that_is_held_end_where_newton_s_end_with_fewer_factorizations() {
    for (shell, size) in [(leaf(1), 0.1), (reference("flat_beam").0, 0.5), (reference("v_beam").0, 0.05)] {
        let shell = Arc::new(shell);
        let rest = vec![Vec3::zeros(); shell.mass.len()];
        let (mut held, mut newton) = (Solver::new(shell.clone()).unwrap(), Solver::new(shell.clone()).unwrap());
        for direction in [[0.1, 0.2, -1.0], [0.3, 0.8, 0.5], [-0.2, -0.4, 0.6]] {
            let forces = gravity(&shell, direction, size);
            let along = EquilibriumOptions { follow_snaps: false, ..Default::default() };
            let found = held.equilibrium(&rest, &forces, &along, &mut |_| Ok(())).unwrap();
            let exact = newton.equilibrium(&rest, &forces, &Default::default(), &mut |_| Ok(())).unwrap();
            // Residuals are 1e-8 of the load, on shells whose softest shape gives way as much as the load moves them.
            let apart = mass_error(&shell, &found.displacement, &exact.displacement);
            assert!(apart < 1e-6, "{direction:?}: {apart:e}");
        }
        let [few, many] = [&held, &newton].map(Solver::factorizations);
        assert!(5 * few <= 4 * many, "{few} and {many}");
    }
}

/// A flat strip that is pushed along itself stays flat, and what it balances grows by the load. Past its buckling that is no stable shape.
#[test]
fn a_strip_that_is_pushed_along_itself_is_not_followed_past_its_buckling() {
    let shell = Arc::new(reference("flat_beam").0);
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let options = EquilibriumOptions { follow_snaps: false, ..Default::default() };
    let ends = [1e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 1e-3].map(|size| {
        let forces = gravity(&shell, [-1.0, 0.0, 0.0], size);
        let mut solver = Solver::new(shell.clone()).unwrap();
        let whole = solver.equilibrium(&rest, &forces, &options, &mut |_| Ok(())).is_ok();
        (whole, is_stable(&shell, &solver.reached()))
    });
    println!("{ends:?}");
    assert!(ends.iter().all(|(_, stable)| *stable), "{ends:?}");
    assert!(ends[0].0 && !ends[6].0, "{ends:?}");
}

/// Whether the Hessian of the energy is positive definite at displacements.
fn is_stable(shell: &Shell, u: &[Vec3]) -> bool {
    let x: Vec<Vec3> = shell.mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
    let mut place = vec![usize::MAX; x.len()];
    shell.free.iter().enumerate().for_each(|(i, v)| place[*v as usize] = i);
    let n = 3 * shell.free.len();
    let mut matrix = DMatrix::zeros(n, n);
    shell.energy.visit_hessian(&x, Curvature::Exact, &mut |(vertices, blocks)| {
        for (k, block) in blocks.iter().enumerate() {
            let [i, j] = [k / vertices.len(), k % vertices.len()].map(|i| place[vertices[i] as usize]);
            if i < usize::MAX && j < usize::MAX {
                let mut part = matrix.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                part += block;
            }
        }
    });
    matrix.cholesky().is_some()
}

#[test]
fn searches_from_rest_go_by_one_tangent_to_the_same_bits() {
    let shell = Arc::new(leaf(1));
    let (rest, x) = (vec![Vec3::zeros(); shell.mass.len()], &shell.mesh.positions);
    let fixed = (0..x.len() as u32).filter(|v| shell.held[*v as usize]).collect();
    let material = Material { k_area: 2e4, k_length: 2e4, k_bend: 0.2, area_density: 1.0 };
    let stiffer = Shell::new((*shell.mesh).clone(), material, &Supports { fixed, ..Supports::default() }).unwrap();
    let tangent = |shell: &Arc<Shell>| Solver::new(shell.clone()).unwrap().tangent_at_rest().unwrap();
    let tangents = [None, tangent(&shell), tangent(&Arc::new(stiffer))];
    let options = EquilibriumOptions { follow_snaps: false, ..Default::default() };
    for direction in [[-0.5, -0.5, 0.7], [0.3, 0.8, 0.5]] {
        let forces = gravity(&shell, direction, 0.3);
        let [alone, given, wrong] = tangents.clone().map(|tangent| {
            let mut solver = Solver::new(shell.clone()).unwrap();
            solver.begin_by(tangent);
            let whole = solver.equilibrium(&rest, &forces, &options, &mut |_| Ok(())).is_ok();
            (whole, solver.reached(), solver.factorizations())
        });
        assert_eq!(alone, given);
        assert_ne!(alone, wrong); // so it is what is gone by
    }
}

/// A strip of 4 by 0.8 whose tip is led up and turned, key by key: where each ends, and the factorizations of all.
fn led_and_turned(mixed: bool) -> (Arc<Shell>, Vec<Vec<Vec3>>, usize) {
    let shell = Arc::new(reference("flat_beam").0);
    let mut solver = Solver::new(shell.clone()).unwrap();
    solver.set_mixed(mixed);
    let x = &shell.mesh.positions;
    let tip = (0..x.len()).max_by(|a, b| (x[*a].x - x[*a].y.abs()).total_cmp(&(x[*b].x - x[*b].y.abs()))).unwrap();
    let none = vec![Vec3::zeros(); x.len()];
    let (mut u, mut ends) = (none.clone(), vec![]);
    for (height, turn) in [(1.4, [0.0; 3]), (1.5, [0.9, 0.0, 0.0]), (0.6, [0.0, -1.0, 0.0])] {
        let hold = |id, axes, target| Constraint { id, vertex: tip as u32, axes, compliance: 0.0, target };
        let list = vec![
            hold(1, [false, false, true], Target::Position(x[tip] + height * Vec3::z())),
            hold(2, [true; 3], Target::Orientation(UnitQuaternion::from_scaled_axis(Vec3::from(turn)))),
        ];
        solver.set_constraints(Matrix3::identity(), list, &u).unwrap();
        u = solver.equilibrium(&u, &none, &EquilibriumOptions::default(), &mut |_| Ok(())).unwrap().displacement;
        ends.push(u.clone());
    }
    (shell, ends, solver.factorizations())
}

#[test]
fn an_orientation_s_torque_is_an_unknown_of_the_search_too() {
    let (shell, plain, many) = led_and_turned(false);
    let (_, mixed, few) = led_and_turned(true);
    for (key, (plain, mixed)) in plain.iter().zip(&mixed).enumerate() {
        // Orientations are met to 1e-9 rad, and residuals are 1e-8 of forces on a strip whose stiffnesses are four decades apart.
        let apart = mass_error(&shell, mixed, plain);
        assert!(apart < 1e-5, "key {key}: {apart:e}");
    }
    // By its torque at the pose alone the search takes four times as many as by the energy.
    assert!(few < many, "{few} and {many}");
}

/// A flat card of 0.3 x 0.2 m and 0.3 mm, held at its left rim.
fn card() -> Arc<Shell> {
    let (positions, triangles) = equilateral_sheet(18, 12, 0.3 / 18.0);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.01).collect();
    let material = Material { k_area: 5e5, k_length: 5e5, k_bend: 4e-3, area_density: 0.25 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Supports::default() }).unwrap())
}

#[test]
fn shear_along_the_rim_of_a_card_is_found_or_refused_within_so_many_factorizations() {
    let shell = card();
    let far = shell.mesh.positions.iter().map(|x| x.x).fold(0.0, f64::max) - 0.01;
    let rim: Vec<usize> = (0..shell.mass.len()).filter(|v| shell.mesh.positions[*v].x > far).collect();
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    // In its plane, and a thousandth out of it, which tells the card to which side it buckles.
    for newtons in [0.1, 1.0, 10.0, 100.0] {
        for aside in [0.0, 1e-3] {
            let mut forces = rest.clone();
            rim.iter().for_each(|v| forces[*v] = Vec3::new(0.0, 1.0, aside) * (newtons / rim.len() as f64));
            let mut solver = Solver::new(shell.clone()).unwrap();
            let found = solver.equilibrium(&rest, &forces, &EquilibriumOptions::default(), &mut |_| Ok(()));
            let factorizations = solver.factorizations();
            println!(
                "{newtons} N, {aside}: {factorizations} factorizations, {:?}",
                found.as_ref().map(|found| found.residual)
            );
            // Where the tangent is not positive definite an iteration tries more than one.
            assert!(
                factorizations <= 2 * EquilibriumOptions::default().max_iterations,
                "{newtons} N: {factorizations}"
            );
            match found {
                Ok(found) => assert!(found.residual <= 1e-3, "{newtons} N: {:e}", found.residual),
                Err(error) => assert_eq!(error.kind, shellwarp::ErrorKind::Numerical, "{newtons} N: {error}"),
            }
        }
    }
}

/// A sheet of 72 vertices that hangs from one side.
fn hanging() -> (Arc<Shell>, Vec<Vec3>) {
    let (positions, triangles) = equilateral_sheet(8, 8, 0.125);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.1).collect();
    let supports = Supports { fixed, ..Supports::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    let forces = shell.mass.iter().map(|m| Vec3::new(0.2, 0.1, -1.0) * (9.8 * m)).collect();
    (Arc::new(shell), forces)
}

#[test]
fn steps_that_share_their_work_end_with_an_error_that_moves_nothing() {
    let (shell, forces) = hanging();
    let mut solver = Solver::new(shell.clone()).unwrap();
    let mut u = vec![Vec3::zeros(); forces.len()];
    let mut velocity = u.clone();
    solver.share_work(true);
    let mut taken = 0;
    let mut failed = None;
    // A load that turns round in each step, so that each takes some solves.
    for k in 0..STEP_SOLVES {
        let before = (u.clone(), velocity.clone());
        let turned: Vec<Vec3> = forces.iter().map(|f| if k % 2 == 0 { *f } else { -f }).collect();
        match solver.implicit_euler(&mut u, &mut velocity, &turned, Rayleigh::default(), 1.0 / 30.0) {
            Ok(report) => taken += report.iterations,
            Err(error) => {
                failed = Some((before, error));
                break;
            }
        }
    }
    let (before, error) = failed.expect("so many steps take more");
    assert_eq!(error.kind, shellwarp::ErrorKind::Numerical, "{error}");
    assert!(error.to_string().contains("2000 linear solves"), "{error}");
    assert!((u, velocity) == before, "a step that fails moves nothing");
    // A step also counts its last correction, and what it tries in vain is no iteration.
    assert!(taken > STEP_SOLVES / 2 && taken < 2 * STEP_SOLVES, "{taken}");
    let (mut u, mut velocity) = before;
    solver.share_work(false);
    solver.implicit_euler(&mut u, &mut velocity, &forces, Rayleigh::default(), 1.0 / 30.0).unwrap();
    assert!(solver.equilibrium(&u, &forces, &EquilibriumOptions::default(), &mut |_| Ok(())).is_ok());
}

#[test]
fn a_step_again_from_its_end_ends_there_at_once() {
    let (shell, forces) = hanging();
    let mut solver = Solver::new(shell.clone()).unwrap();
    let still = vec![Vec3::zeros(); forces.len()];
    let mut ends = vec![];
    for again in [false, true] {
        let (mut u, mut velocity) = (still.clone(), still.clone());
        if again {
            solver.step_again();
        }
        let step = solver.implicit_euler(&mut u, &mut velocity, &forces, Rayleigh::default(), 1.0 / 30.0).unwrap();
        ends.push((u, step.iterations));
    }
    let [(first, many), (second, few)] = &ends[..] else { unreachable!() };
    assert!(*few <= 2 && few < many, "{few} and {many}");
    // To ten times the tolerance of a step.
    let apart = mass_error(&shell, second, first);
    assert!(apart < 1e-9, "{apart:e}");
}

#[test]
fn limp_cloth_takes_fewer_iterations_than_by_the_energy_alone() {
    let (positions, triangles) = equilateral_sheet(16, 16, 0.6 / 16.0);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.02).collect();
    let cotton = PRESETS.iter().find(|preset| preset.name == c"cotton").unwrap().sheet;
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let shell = Arc::new(Shell::new(mesh, cotton, &Supports { fixed, ..Supports::default() }).unwrap());
    let damping = Rayleigh { mass: 0.5, stiffness: 0.0 };
    let mut solver = Solver::new(shell.clone()).unwrap();
    let still = vec![Vec3::zeros(); shell.mass.len()];
    let (mut u, mut velocity) = (still.clone(), still);
    let mut totals = [0; 2];
    for frame in 0..30 {
        let gust = 6.0 * (0.2 * f64::from(frame)).sin();
        let load: Vec<Vec3> = shell.mass.iter().map(|m| *m * Vec3::new(0.3 * gust, gust, -9.8)).collect();
        let ends = [false, true].map(|mixed| {
            solver.set_mixed(mixed);
            let mut end = (u.clone(), velocity.clone());
            (solver.implicit_euler(&mut end.0, &mut end.1, &load, damping, 1.0 / 30.0).unwrap(), end)
        });
        for (total, (report, _)) in totals.iter_mut().zip(&ends) {
            *total += report.iterations;
            assert!(report.residual <= 1e-7, "{:e}", report.residual); // that of a step that only rounding keeps from its tolerance
        }
        [_, (_, (u, velocity))] = ends;
    }
    // 661 and 431. Where a fold falls to the other side the numbers of a step change, their sums over 30 by less than a tenth.
    assert!(5 * totals[1] < 4 * totals[0], "{totals:?}");
}

/// Rounding of the coordinates, times the stiffness of the sheet, is more than such a load; it moves the shell by next to nothing.
#[test]
fn a_load_that_is_small_beside_rounding_of_the_sheet_is_borne_as_by_linear_analysis() {
    let shell = Arc::new(leaf(1));
    let forces = gravity(&shell, [0.4, 0.5, -0.77], 0.1);
    let under = |share: f64| {
        let forces: Vec<Vec3> = forces.iter().map(|f| share * f).collect();
        let mut solver = Solver::new(shell.clone()).unwrap();
        let rest = vec![Vec3::zeros(); forces.len()];
        let found = solver.equilibrium(&rest, &forces, &EquilibriumOptions::default(), &mut |_| Ok(())).unwrap();
        (found.displacement.iter().map(|u| u / share).collect::<Vec<_>>(), found.residual)
    };
    let ((linear, _), (small, residual)) = (under(1e-4), under(1e-9));
    let apart = mass_error(&shell, &small, &linear);
    println!("residual {residual:.1e}, {apart:.1e} from linear");
    assert!(residual > 1e-3, "{residual:e}: the load is not small enough to tell");
    // Of second order in 1e-4 of a load that bends the shell by a tenth of its size, and what rounding may move.
    assert!(apart < 2e-3, "{apart:e}");
}

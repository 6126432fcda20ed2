//! Newton's method with the stress as an unknown ends where the energy's does, sooner.

mod common;

use common::{leaf, mass_error};
use shellwarp::energy::{Curvature, Mat3};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::{Shell, Vec3};
use std::sync::Arc;

/// Gravity along `direction` that moves the shell by `aim` sizes to first order.
fn gravity(shell: &Arc<Shell>, direction: [f64; 3], aim: f64) -> Vec<Vec3> {
    let forces = |g: f64| shell.mass.iter().map(|m| Vec3::from(direction) * (g * m)).collect::<Vec<_>>();
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let g = 1e-4; // moves the leaf by 1e-5 of its size: linear to that part
    let linear = Solver::new(shell.clone())
        .unwrap()
        .equilibrium(&rest, &forces(g), &Default::default(), &mut |_| Ok(()))
        .unwrap();
    let largest = linear.displacement.iter().map(|u| u.norm()).fold(0.0, f64::max);
    forces(g * aim * shell.mesh.size / largest)
}

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
    shell.energy.visit_mixed_hessian(&x, &stress, &mut |(_, blocks)| given.extend(blocks));
    assert_eq!(own.len(), given.len());
    let scale = own.iter().map(|block| block.amax()).fold(0.0, f64::max);
    for (k, (own, given)) in own.iter().zip(&given).enumerate() {
        assert!((own - given).amax() <= 1e-13 * scale, "block {k}: {own} {given}"); // roundings of √(2w)
    }
    // Without stress what is left is Σ b bᵀ, and with them the rest is what `visit_stress_hessian` hands out.
    let mut both: Vec<Mat3> = vec![];
    shell.energy.visit_stress_hessian(&x, &stress, Curvature::Exact, &mut |(_, blocks)| both.extend(blocks));
    let mut bare: Vec<Mat3> = vec![];
    shell.energy.visit_mixed_hessian(&x, &vec![0.0; stress.len()], &mut |(_, blocks)| bare.extend(blocks));
    for (k, ((bare, by_stress), own)) in bare.iter().zip(&both).zip(&own).enumerate() {
        assert!((bare + by_stress - own).amax() <= 1e-13 * scale, "block {k}");
    }
}

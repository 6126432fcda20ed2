//! Reduced shells are the same in other units of stiffness.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// A leaf-like sheet held at its stem, its stiffness in units that are `unit` times as small.
fn leaf_in(unit: f64) -> Arc<Model> {
    let (mut positions, triangles) = equilateral_sheet(20, 6, 0.05);
    positions.iter_mut().for_each(|x| x.z = 0.3 * x.x * (1.0 - x.x) + 0.5 * x.y * x.y);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.06).collect();
    let material = Material { k_area: 1e4 * unit, k_length: 1e4 * unit, k_bend: unit, area_density: 1.0 };
    let supports = Supports { fixed, ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap();
    let reduced = reduced::Options { fields: 12, poses: reduced::MAX_POSES, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn at_rest(model: &Arc<Model>, method: Method, unit: f64) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.6, -0.8) * (20.0 * unit)).unwrap();
    state.equilibrium().unwrap();
    displacements(&state)
}

#[test]
fn a_unit_of_stiffness_changes_nothing() {
    let model = leaf_in(1.0);
    // Powers of two round nothing: what differs then is not rounding of the numbers given.
    for unit in [4.0, 2f64.powi(20), 2f64.powi(-20), 2f64.powi(30)] {
        let other = leaf_in(unit);
        for (method, most) in [(Method::ReducedShell, 0.0), (Method::PolynomialShell, 1e-11)] {
            let (found, expected) = (at_rest(&other, method, unit), at_rest(&model, method, 1.0));
            let moved = expected.iter().map(|u| u.norm()).fold(0.0, f64::max);
            let apart = error(&found, &expected);
            println!("stiffness × {unit:.1e}, {method:?}: {apart:.1e} apart, moved {moved:.2}");
            assert!(moved > 0.05, "{method:?} hardly moved");
            // The polynomial's fit is solved in units of force, whose solver rounds.
            assert!(apart <= most, "stiffness × {unit:.1e}, {method:?}: {apart:.1e}");
        }
    }
}

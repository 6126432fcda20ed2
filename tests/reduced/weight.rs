//! What a shell's weight does to first order is among the fields: a load that is small beside those of the training is met, too.

use crate::common::{displacements, mass_error};
use crate::plates::*;
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A lampshade: it bulges and dents under loads of the training, long before it leans as it does under its weight.
const SHADE: Material = Material { k_area: 273.0, k_length: 5.2, k_bend: 3.0e-5, area_density: 1.0 };

/// Closed, 0.3 high, of radius 0.08 at the bottom, where it is held, and 0.05 at the top.
fn lampshade() -> Arc<Model> {
    let around = 0.5;
    let (mut positions, triangles) = closed(rectangle(Family::Diagonal, 24, around, 0.3), around);
    for x in &mut positions {
        let (angle, radius) = (TAU * x.x / around, 0.08 - 0.1 * x.y);
        *x = Vec3::new(radius * angle.cos(), radius * angle.sin(), x.y);
    }
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].z < 1e-9).collect();
    let supports = Supports { clamped: fixed, ..Supports::default() };
    let shell = Arc::new(Shell::new(Mesh::new(positions, &triangles).unwrap(), SHADE, &supports).unwrap());
    let reduced = reduced::Options { fields: 20, poses: 16, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap())
}

#[test]
fn a_lampshade_answers_a_small_weight_along_every_axis() {
    let model = lampshade();
    let hung = |method, gravity: Vec3| {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(gravity).unwrap();
        state.equilibrium().unwrap();
        displacements(&state)
    };
    for axis in 0..3 {
        let gravity = 0.04 * Vec3::ith(axis, 1.0);
        let exact = hung(Method::ImplicitShell, gravity);
        let off = |method| mass_error(&model.shell, &hung(method, gravity), &exact);
        let (polynomial, samples) = (off(Method::PolynomialShell), off(Method::ReducedShell));
        println!("axis {axis}: polynomial {polynomial:.2e}, samples {samples:.2e}");
        // Of the polynomial's forms, and of what samples may leave of forces (TOLERANCE, where that many elements suffice).
        assert!(polynomial < 0.01 && samples < 0.1, "axis {axis}: {polynomial} {samples}");
    }
}

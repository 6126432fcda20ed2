//! Handles that the precompute was told of: its training leads the full shell by them.

use crate::common::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// An arched sheet that is held along an edge.
fn arch() -> Shell {
    let (mut positions, triangles) = equilateral_sheet(12, 6, 0.1);
    positions.iter_mut().for_each(|x| x.z = 0.3 * x.x * (1.2 - x.x) - 0.4 * (x.y - 0.26).powi(2));
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.11).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.5, area_density: 1.0 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

fn model(shell: &Arc<Shell>, handles: &[usize]) -> Arc<Model> {
    let reduced = reduced::Options { fields: 24, poses: reduced::MAX_POSES, ..Default::default() };
    let handles = handles.iter().map(|v| *v as u32).collect();
    let options = Options { modes: 8, reduced, handles, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn corner(shell: &Shell) -> usize {
    let x = &shell.mesh.positions;
    (0..x.len()).max_by(|&a, &b| (x[a].x + x[a].y).total_cmp(&(x[b].x + x[b].y))).unwrap()
}

/// At rest where vertices are led to, in sizes, and turned.
fn led(model: &Arc<Model>, method: Method, to: &[(usize, Vec3)], turn: Vec3) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    let (rest, size) = (&model.shell.mesh.positions, model.shell.mesh.size);
    for k in 1..=4 {
        let share = 0.25 * f64::from(k);
        for (id, &(v, way)) in (0..).zip(to) {
            let mut hold = |id, target| {
                let constraint = Constraint { id, vertex: v as u32, axes: [true; 3], compliance: 0.0, target };
                state.set_constraint(constraint).unwrap();
            };
            hold(2 * id, Target::Position(rest[v] + share * size * way));
            if turn != Vec3::zeros() {
                hold(2 * id + 1, Target::Orientation(UnitQuaternion::from_scaled_axis(share * turn)));
            }
        }
        state.equilibrium().unwrap();
    }
    displacements(&state)
}

/// Errors of samples and polynomial with handles told and not.
fn errors(to: &[(usize, Vec3)], turn: Vec3) -> [[f64; 2]; 2] {
    let shell = Arc::new(arch());
    let told: Vec<usize> = to.iter().map(|(v, _)| *v).collect();
    [&told[..], &[]].map(|handles| {
        let model = model(&shell, handles);
        let exact = led(&model, Method::ImplicitShell, to, turn);
        [Method::ReducedShell, Method::PolynomialShell]
            .map(|method| mass_error(&shell, &led(&model, method, to, turn), &exact))
    })
}

/// The ways are none that the training takes.
#[test]
fn a_shell_follows_a_handle_that_was_told() {
    let corner = corner(&arch());
    for (way, turn) in [
        (Vec3::new(-0.05, 0.02, 0.12), Vec3::zeros()),
        (Vec3::new(-0.08, 0.0, 0.02), Vec3::zeros()),
        (Vec3::new(-0.02, 0.0, 0.06), Vec3::new(0.3, 0.2, 0.0)),
    ] {
        let [told, untold] = errors(&[(corner, way)], turn);
        println!("{way:?} {turn:?}: told {told:.4?}, not told {untold:.4?}");
        for (told, untold) in told.into_iter().zip(untold) {
            // A fifth to a third was measured where it is led, and 0.59 where it is turned, too.
            assert!(told < 0.65 * untold, "{way:?} {turn:?}: {told} where a shell that was not told has {untold}");
        }
    }
}

#[test]
fn two_handles_are_led_each_where_the_other_holds() {
    let shell = arch();
    let x = &shell.mesh.positions;
    let other = (0..x.len()).max_by(|&a, &b| (x[a].x - x[a].y).total_cmp(&(x[b].x - x[b].y))).unwrap();
    let ways = [(corner(&shell), Vec3::new(-0.03, 0.0, 0.06)), (other, Vec3::new(-0.02, 0.0, 0.02))];
    let [told, untold] = errors(&ways, Vec3::zeros());
    println!("told {told:.4?}, not told {untold:.4?}");
    for (told, untold) in told.into_iter().zip(untold) {
        // Two fifths were measured: six fields of 24 are left to each.
        assert!(told < 0.5 * untold, "{told} where a shell that was not told has {untold}");
    }
}

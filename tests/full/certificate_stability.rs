//! Estimates where a state rests on a balance from which the full shell falls.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// A strip that stands on its clamped end along x, its free length, and the critical gravity of a column under its own weight:
/// g ρ L³ = 7.837 EI (Greenhill 1881), with EI from the slowest bending wave, ω² ρ L⁴ = 12.36 EI.
fn column() -> (Arc<Model>, f64, f64) {
    let (positions, triangles) = equilateral_sheet(24, 3, 0.1);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.11).collect();
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let shell = Shell::new(mesh, Material::default(), &Supports { fixed, ..Default::default() }).unwrap();
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let (length, slowest) = (2.3, model.modal.eigenvalues[0]);
    (model, length, 7.837 / 12.36 * slowest * length)
}

fn state(model: &Arc<Model>, method: Method, gravity: f64) -> State {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(-gravity, 0.0, 0.0)).unwrap();
    state
}

/// At rest, as linear modes have it: upright but for rounding. From there a warp's own search would leave the balance that it cannot keep, as soon
/// as rounding bends it.
fn upright(model: &Arc<Model>, method: Method, gravity: f64) -> State {
    let mut linear = state(model, Method::LinearModalAnalysis, gravity);
    linear.equilibrium().unwrap();
    let (amplitudes, rest) = (linear.amplitudes().unwrap().0.to_vec(), vec![0.0; model.modal.eigenvalues.len()]);
    let mut state = state(model, method, gravity);
    state.set_amplitudes(&amplitudes, &rest).unwrap();
    state
}

/// The full shell at rest from where it is bent a little to this side.
fn bent(model: &Arc<Model>, gravity: f64, side: f64) -> Vec<Vec3> {
    let mut state = state(model, Method::ImplicitShell, gravity);
    let bend = |x: &Vec3| x + Vec3::new(0.0, 0.0, side * 0.02 * (x.x - 0.1).max(0.0).powi(2));
    let shape: Vec<Vec3> = model.shell.mesh.positions.iter().map(bend).collect();
    state.set_pose(Space::Frame, &shape, None).unwrap();
    state.equilibrium().unwrap();
    displacements(&state)
}

#[test]
fn a_column_past_its_critical_weight_is_told_how_far_it_falls() {
    let (model, length, critical) = column();
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis] {
        for (share, falls) in [(0.8, false), (1.5, true)] {
            let straight = upright(&model, method, share * critical);
            let found = straight.certify().unwrap();
            println!("{method:?} at {share} of the critical weight: {found:?}");
            assert!(found.remaining < 1e-6, "{found:?}");
            if falls {
                // It stands straight by symmetry, which the shell cannot.
                let exact = [-1.0, 1.0].map(|side| bent(&model, share * critical, side));
                let off = exact.map(|exact| mass_error(&model.shell, &displacements(&straight), &exact));
                let nearest = off[0].min(off[1]);
                assert_close("error of what falls", found.error, nearest, 0.01, 0.0); // two searches of one equilibrium
                assert!(found.max_error > 0.3 * length && found.out_of_range(), "{found:?}");
            } else {
                assert!(found.max_error < 1e-3 * length, "{found:?}");
            }
        }
    }
}

/// A moving shell may pass a balance that is none to rest on: its inertia holds it there.
#[test]
fn a_column_that_moves_through_an_unstable_balance_is_set_against_that() {
    let (model, length, critical) = column();
    let mut moving = upright(&model, Method::VirtualWorkWarp, 1.5 * critical);
    let slowest = model.modal.eigenvalues[0].sqrt();
    let rates: Vec<f64> = (0..8).map(|k| if k == 0 { 1e-2 * slowest * length } else { 0.0 }).collect();
    let still: Vec<Vec3> = model.shell.mesh.positions.iter().zip(displacements(&moving)).map(|(x, u)| x + u).collect();
    let swing: Vec<Vec3> = (0..still.len()).map(|v| rates[0] * model.modal.mode_at(0, v).0).collect();
    moving.set_pose(Space::Frame, &still, Some(&swing)).unwrap();
    let found = moving.certify().unwrap();
    println!("{found:?}");
    assert!(found.max_error < 1e-3 * length, "{found:?}");
}

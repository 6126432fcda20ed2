//! The full shell in a wind that a step does not resolve.

use crate::common::*;
use shellwarp::load::Wind;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// Printer paper, 24 cm long, held at one end.
fn paper() -> Arc<Model> {
    let (positions, triangles) = equilateral_sheet(12, 4, 0.02);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.021).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 1e-3, area_density: 0.08 };
    let shell =
        Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() });
    Arc::new(
        Model::precompute(Arc::new(shell.unwrap()), &Options { modes: 4, ..Options::default() }, &mut |_, _| Ok(()))
            .unwrap(),
    )
}

/// In air of 8 m/s it loses its velocity a hundred times a second: a step of 1/30 s that feels the air of its start alone swings to and fro for
/// ever, by a tenth of the sheet.
#[test]
fn paper_in_a_strong_wind_comes_to_rest_in_long_steps() {
    let model = paper();
    let size = model.shell.mesh.size;
    let run = |h: f64| {
        let mut state = State::new(model.clone(), Method::ImplicitShell, Integrator::ImplicitEuler).unwrap();
        state.set_damping(&Damping { mass_coefficient: 1.0, ..Default::default() }).unwrap();
        state
            .set_wind(Wind { velocity: Vec3::new(0.0, 1.0, 8.0), density: 1.2, normal_drag: 1.0, ..Wind::default() })
            .unwrap();
        let mut before = vec![];
        for _ in 0..(2.0 / h) as usize {
            before = displacements(&state);
            state.step(h).unwrap();
        }
        let end = displacements(&state);
        let moved = end.iter().zip(&before).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        (end, moved)
    };
    let [(long, moved), (short, _)] = [1.0 / 30.0, 1.0 / 480.0].map(run);
    let apart = long.iter().zip(&short).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let most = short.iter().map(Vec3::norm).fold(0.0, f64::max);
    println!(
        "moves by {most:.3}, in the last long step {moved:.1e}, ends {apart:.1e} from short steps; {size:.3} long"
    );
    assert!(most > 0.3 * size, "it bends far: {most}");
    assert!(moved < 1e-4 * size, "it is at rest: {moved}");
    assert!(apart < 1e-3 * size, "the steps' length does not change where: {apart}");
}

/// A sheet that turns into the wind bears less of it: each shape found under the last one's wind overshoots, to and fro without end, unless only a share of
/// the change is taken. So it is with the rounds of a certificate.
#[test]
fn a_sheet_in_a_steady_wind_has_an_equilibrium_and_a_certificate() {
    let model = paper();
    let size = model.shell.mesh.size;
    let in_wind = |method: Method| {
        let integrator = if method == Method::Warp { Integrator::Exact } else { Integrator::ImplicitEuler };
        let mut state = State::new(model.clone(), method, integrator).unwrap();
        state.set_gravity(Vec3::new(9.8, 0.0, 0.0)).unwrap();
        state
            .set_wind(Wind { velocity: Vec3::new(0.0, 0.2, 3.0), density: 1.2, normal_drag: 1.0, ..Wind::default() })
            .unwrap();
        state
    };
    let mut settled = in_wind(Method::ImplicitShell);
    settled.set_damping(&Damping { mass_coefficient: 5.0, ..Default::default() }).unwrap();
    (0..400).for_each(|_| settled.step(0.02).unwrap());
    let mut found = in_wind(Method::ImplicitShell);
    let (residual, iterations) = found.equilibrium().unwrap();
    let [found, settled] = [&found, &settled].map(displacements);
    let apart = found.iter().zip(&settled).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let most = found.iter().map(Vec3::norm).fold(0.0, f64::max);
    println!("moves by {most:.3}, {apart:.1e} from damped steps, residual {residual:.1e}, {iterations} iterations");
    assert!(most > 0.1 * size, "it bends far: {most}");
    assert!(apart < 1e-5 * size, "it is where damped steps settle, to what these leave: {apart:e}");
    let mut warp = in_wind(Method::Warp);
    warp.equilibrium().unwrap();
    let (told, truth) = (warp.certify().unwrap(), mass_error(&model.shell, &displacements(&warp), &found));
    println!("the warp is {truth:.4} off, told {told:?}");
    // The estimate's rounds of the wind end where they change a hundredth.
    assert_close("the warp's error", told.error, truth, 0.05, 0.01);
    assert!(told.remaining < 1e-3);
}

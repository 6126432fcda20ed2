//! The paper's comparison (its figure 6): linear modal analysis and the warp against the nonlinear shell, over gravity.
//! `cargo test --release --test full comparison:: -- --nocapture` prints the tables.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

fn beam(name: &str, membrane: f64, bending: f64) -> Arc<Model> {
    let (_, json) = reference(name);
    let fixed = json["fixed_vertices"].as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as u32).collect();
    let material = Material { k_area: membrane, k_length: membrane, k_bend: bending, area_density: 1.0 };
    let supports = Supports { fixed, ..Default::default() };
    let shell = Shell::new(mesh(&format!("{name}.obj")), material, &supports).unwrap();
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn sagged(model: &Arc<Model>, method: Method, gravity: Vec3) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(gravity).unwrap();
    state.equilibrium().unwrap();
    let rest = &model.shell.mesh.positions;
    let mut u = vec![Vec3::zeros(); rest.len()];
    state.positions(Space::Frame, |v, x| u[v] = x - rest[v]);
    u
}

fn norm(u: impl Iterator<Item = Vec3>) -> f64 {
    u.map(|u| u.norm_squared()).sum::<f64>().sqrt()
}

/// ΣA/ΣĀ − 1.
fn area_change(model: &Model, u: &[Vec3]) -> f64 {
    let mesh = &model.shell.mesh;
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize] + u[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    mesh.triangles.iter().map(area).sum::<f64>() / model.shell.total_area - 1.0
}

/// Errors and area changes under one gravity: linear modal analysis, warp; then the nonlinear shell's area change.
struct Row {
    error: [f64; 2],
    area: [f64; 3],
}

fn compare(name: &str, model: &Arc<Model>, gravity: Vec3) -> Row {
    let [lma, warp, shell] =
        [Method::LinearModalAnalysis, Method::Warp, Method::ImplicitShell].map(|m| sagged(model, m, gravity));
    let error = [&lma, &warp].map(|u| norm(u.iter().zip(&shell).map(|(a, b)| a - b)) / norm(shell.iter().copied()));
    let area = [&lma, &warp, &shell].map(|u| area_change(model, u));
    let g: Vec<f64> = gravity.iter().copied().collect();
    println!(
        "{name} {g:6.3?}: error {:.4} {:.4}, area {:+.5} {:+.5} {:+.5}",
        error[0], error[1], area[0], area[1], area[2]
    );
    Row { error, area }
}

#[test]
fn the_warp_beats_linear_modes_where_rotation_governs() {
    // A V-beam whose membrane is soft enough that its section keeps its shape, and the flat beam, bent by up to 45°.
    for (name, membrane, gravities) in
        [("v_beam", 1e2, [0.02, 0.05, 0.1, 0.2, 0.3]), ("flat_beam", 1e4, [0.03, 0.1, 0.2, 0.4, 0.8])]
    {
        let model = beam(name, membrane, 1.0);
        let rows: Vec<Row> = gravities.iter().map(|g| compare(name, &model, Vec3::new(0.0, 0.0, -g))).collect();
        for row in &rows {
            assert!(row.error[1] < 0.5 * row.error[0], "the warp's error is less than half");
            let strange = |m: usize| (row.area[m] - row.area[2]).abs();
            assert!(strange(1) < 0.3 * strange(0), "and its change of area is close to the shell's own");
            assert!(row.area[2].abs() < 1e-3, "the shell itself hardly stretches");
        }
        for pair in rows.windows(2) {
            assert!((0..2).all(|m| pair[0].error[m] < pair[1].error[m]), "both errors grow with gravity");
            assert!(pair[0].area[0] < pair[1].area[0], "linear modes stretch the more the further they go");
        }
    }
}

#[test]
fn a_stiff_v_beam_flattens_and_no_linear_stiffness_follows() {
    let down = |g: f64| Vec3::new(0.0, 0.0, -g);
    let soft = compare("v_beam", &beam("v_beam", 1e4, 1.0), down(5.0));
    assert!(soft.error[1] > 0.9 * soft.error[0], "straight down the section flattens, and the warp gains nothing");
    let oblique = compare("v_beam", &beam("v_beam", 1e4, 1.0), Vec3::new(0.0, 3.0, -4.0));
    assert!(oblique.error[1] > oblique.error[0], "pulled aside, the paper's force law is worse than no warp");
}

#[test]
fn stiffer_beams_differ_less() {
    // The paper's beams: bending stiffness 1, 10, 100 under one gravity.
    for name in ["flat_beam", "v_beam"] {
        let gravity = Vec3::new(0.0, 0.0, if name == "flat_beam" { -0.4 } else { -3.0 });
        let rows = [1.0, 10.0, 100.0].map(|k| compare(&format!("{name}, k_bend × {k}"), &beam(name, 1e4, k), gravity));
        for pair in rows.windows(2) {
            assert!((0..2).all(|m| pair[1].error[m] < pair[0].error[m]));
        }
    }
}

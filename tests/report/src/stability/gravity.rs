//! Gravity × 1 … × 1e4 on a flat and a V-beam, released and held by the tip: where each law and integrator ends.

use super::trial::{Cell, Problem, Verdict, distance};
use crate::library::{Library, Material};
use crate::mesh::Mesh;
use crate::methods::{Family, METHODS, Method};
use crate::table::{Table, percent};
use anyhow::Result;
use shellwarp::ffi::state::SW_METHOD_SHELL_IMPLICIT;
use std::path::Path;

/// Of the elastic energy; below it the shell rests.
const STILL: f64 = 1e-8;

/// How a run ended.
struct Ended {
    /// Mean over the last tenth of kinetic over elastic energy.
    swing: f64,
    rotation: f64,
    positions: Vec<[f64; 3]>,
}

fn play(library: &Library, m: &Method, problem: &Problem, held: bool) -> Result<Ended> {
    let model = problem.model(library)?;
    let mut state = model.state(m.method, m.integrator)?;
    state.set_gravity(problem.gravity)?;
    state.set_mass_damping(problem.damping)?;
    if held {
        let tip = problem.mesh.nearest([4.0, 0.0]);
        state.hold(1, tip as u32, 7, problem.mesh.positions[tip])?;
    }
    let (mut kinetic, mut elastic, mut rotation) = (0.0, 0.0, 0.0f64);
    let frames = 9000;
    for k in 0..frames {
        state.step(1.0 / 30.0)?;
        if k >= frames - frames / 10 {
            let report = state.report()?;
            (kinetic, elastic) = (kinetic + report.kinetic_energy, elastic + report.elastic_energy);
            rotation = rotation.max(report.max_rotation);
        }
    }
    Ok(Ended { swing: kinetic / f64::max(elastic, f64::MIN_POSITIVE), rotation, positions: state.positions()? })
}

/// In words, and as a cell's verdict.
fn verdict(m: &Method, ended: &Ended, error: f64, held: bool) -> (Verdict, String) {
    let turn = ended.rotation.to_degrees();
    if ended.swing > STILL && !held {
        let kind = if ended.rotation > std::f64::consts::PI { Verdict::Guarded } else { Verdict::Inaccurate };
        return (
            kind,
            format!(
                "keeps swinging: kinetic energy {:.0e} of the elastic after 300 s; turned by {turn:.0}°",
                ended.swing
            ),
        );
    }
    match error {
        e if e <= 0.05 => (Verdict::Accurate, String::new()),
        _ if m.family == Family::Warp && ended.rotation > std::f64::consts::PI => {
            (Verdict::Guarded, format!("rests, turned by {turn:.0}°: beyond half a turn the guard holds it"))
        }
        e if e.is_nan() => {
            (Verdict::Inaccurate, format!("rests, turned by {turn:.0}°; nothing outside to judge it by"))
        }
        _ => (Verdict::Inaccurate, format!("rests, turned by {turn:.0}°: linear modes at large turns")),
    }
}

/// Cells, and a table of where each ends: rows cases, columns methods.
pub fn all(library: &Library, data: &Path) -> Result<(Vec<Cell>, Table)> {
    let modal: Vec<&'static Method> = METHODS.iter().filter(|m| m.family != Family::Shell).collect();
    let mut header = vec!["beam", "gravity"];
    header.extend(modal.iter().map(|m| m.label));
    let mut table = Table::new("gravity", &header);
    let mut cells = vec![];
    for (name, base, omega) in [("flat beam", 0.1, 0.5), ("V-beam", 1.0, 5.3)] {
        let file = if name == "flat beam" { "flat_beam.obj" } else { "v_beam.obj" };
        let mesh = Mesh::read_obj(&data.join("meshes").join(file))?;
        let fixed = mesh.vertices_where(|p, _| p[0] < 0.11);
        let material = Material { area: 1e4, length: 1e4, bend: 1.0, density: 1.0 };
        for held in [false, true] {
            for factor in [1.0, 10.0, 100.0, 1e3, 1e4] {
                let g = base * factor;
                let gravity = [0.0, 0.0, -g];
                // A fifth of the slowest mode's critical damping.
                let (mesh, fixed) = (mesh.clone(), fixed.clone());
                let problem = Problem { mesh, material, fixed, modes: 8, gravity, damping: 0.4 * omega, steps: vec![] };
                let shell = (!held).then(|| problem.at_rest(library, SW_METHOD_SHELL_IMPLICIT).ok()).flatten();
                let case = format!("{name}, g = {g}, {}", if held { "held by the tip" } else { "released" });
                let mut row = vec![format!("{name}, {}", if held { "held" } else { "released" }), g.to_string()];
                for m in &modal {
                    let (cell, text) = match play(library, m, &problem, held) {
                        Ok(ended) => {
                            let apart = |s: &Vec<_>| distance(&ended.positions, s, &problem.mesh.positions, 1e-6);
                            let error = shell.as_ref().map_or(f64::NAN, apart);
                            let (verdict, note) = verdict(m, &ended, error, held);
                            let moves = if ended.swing > STILL {
                                format!("swings {:.0e}", ended.swing)
                            } else {
                                "rests".into()
                            };
                            let text = format!("{moves}, {:.0}°, {}", ended.rotation.to_degrees(), percent(error));
                            (cell(&case, m, verdict, error, note), text)
                        }
                        Err(e) => (cell(&case, m, Verdict::Refused, f64::NAN, e.to_string()), e.to_string()),
                    };
                    cells.push(cell);
                    row.push(text);
                }
                table.push(row);
            }
        }
    }
    Ok((cells, table))
}

fn cell(case: &str, m: &'static Method, verdict: Verdict, error: f64, note: String) -> Cell {
    Cell {
        group: "gravity",
        case: case.to_owned(),
        method: m.label,
        verdict,
        error,
        judge: "nonlinear shell at rest",
        note,
    }
}

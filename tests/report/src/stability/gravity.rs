//! Gravity × 1 … × 1e4 on a flat and a V-beam, released and held by the tip: where each law and integrator ends.

use super::methods;
use super::trial::{Cell, Problem, Verdict, distance};
use crate::library::{Library, Material};
use crate::mesh::Mesh;
use crate::methods::{Family, Method, method};
use crate::table::{Table, percent};
use anyhow::Result;
use std::path::Path;

/// Of the displacement; a shell that moves by less over a second and a half rests. Velocities do not tell: under a handle the
/// exact propagator's are those of an impulse at the step's start.
const STILL: f64 = 1e-4;

/// How a run ended.
struct Ended {
    /// Largest distance between shapes of the last 30 s and the last one, of its displacement.
    swing: f64,
    rotation: f64,
    positions: Vec<[f64; 3]>,
}

fn play(library: &Library, m: &Method, problem: &Problem, held: bool) -> Result<Ended> {
    let model = problem.model(library, m)?;
    let mut state = model.state(m.method, m.integrator)?;
    state.set_gravity(problem.gravity)?;
    state.set_mass_damping(problem.damping)?;
    if held {
        let tip = problem.mesh.nearest([4.0, 0.0]);
        state.hold(1, tip as u32, 7, problem.mesh.positions[tip])?;
    }
    let mut rotation = 0.0f64;
    let mut shapes = vec![];
    let frames = 9000;
    for k in 0..frames {
        state.step(1.0 / 30.0)?;
        // Every 7th frame: no period that a swing is likely to have.
        if k >= frames - frames / 10 && k % 7 == 0 {
            rotation = rotation.max(state.report()?.max_rotation);
            shapes.push(state.positions()?);
        }
    }
    let positions = state.positions()?;
    let apart = |s: &Vec<_>| distance(s, &positions, &problem.mesh.positions, 1e-6);
    let swing = shapes.iter().map(apart).fold(0.0, f64::max);
    Ok(Ended { swing, rotation, positions })
}

/// In words, and as a cell's verdict.
fn verdict(m: &Method, ended: &Ended, error: f64, held: Option<&str>) -> (Verdict, String) {
    let turn = format!("turned by {:.0}°", ended.rotation.to_degrees());
    let reduced = m.family == Family::Reduced;
    let guarded = ended.rotation > std::f64::consts::PI && !reduced;
    let beyond = if guarded { Verdict::Guarded } else { Verdict::Inaccurate };
    if ended.swing > STILL {
        return (beyond, format!("still swings by {} of its displacement after 300 s, {turn}", percent(ended.swing)));
    }
    match held {
        _ if error <= 0.05 => (Verdict::Accurate, String::new()),
        _ if guarded => (beyond, format!("rests, {turn}: beyond half a turn the guard holds it")),
        _ if reduced => (beyond, format!("rests, {turn}: beyond what its fields can take on")),
        // Both are shown by the rows of small loads and of 64 modes.
        Some("flat beam") => {
            let why = "held at both ends it can sag only by stretching, which linear modes do not resist";
            (beyond, format!("rests, {turn}: {why}"))
        }
        Some(_) if ended.rotation < 0.3 => {
            (beyond, format!("rests, {turn}: too few modes to hold a folded strip at one point"))
        }
        _ => (beyond, format!("rests, {turn}: linear modes at large turns, or a section that gives way")),
    }
}

/// Cells, and a table of where each ends: rows cases, columns methods.
pub fn all(library: &Library, data: &Path) -> Result<(Vec<Cell>, Table)> {
    let modal: Vec<&'static Method> = methods().filter(|m| m.family != Family::Shell).collect();
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
            // Loads so small that all is linear, and more modes, tell apart what a held point lacks.
            let small: &[(f64, usize)] = if held { &[(1e-3, 8), (1e-3, 64), (1.0, 64)] } else { &[] };
            let sweep = [1.0, 10.0, 100.0, 1e3, 1e4].map(|factor| (factor, 8));
            for &(factor, modes) in small.iter().chain(&sweep) {
                let g = base * factor;
                let gravity = [0.0, 0.0, -g];
                // A fifth of the slowest mode's critical damping.
                let (mesh, fixed) = (mesh.clone(), fixed.clone());
                let problem =
                    Problem { mesh, material, sheet: None, fixed, modes, gravity, damping: 0.4 * omega, steps: vec![] };
                // Its tip fixed where the handle holds it.
                let mut known = problem.clone();
                known.fixed.extend(held.then(|| problem.mesh.nearest([4.0, 0.0]) as u32));
                let shell = known.at_rest(library, method("shell_implicit")).ok();
                let case =
                    format!("{name}, g = {g}, {}, {modes} modes", if held { "held by the tip" } else { "released" });
                let how = if held { "held" } else { "released" };
                eprintln!("stability: {case}");
                let mut row = vec![format!("{name}, {how}, {modes} modes"), g.to_string()];
                for m in &modal {
                    let (cell, text) = match play(library, m, &problem, held) {
                        Ok(ended) => {
                            let apart = |s: &Vec<_>| distance(&ended.positions, s, &problem.mesh.positions, 1e-6);
                            let error = shell.as_ref().map_or(f64::NAN, apart);
                            let (verdict, note) = verdict(m, &ended, error, held.then_some(name));
                            let moves = if ended.swing > STILL {
                                format!("swings {}", percent(ended.swing))
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

//! How far Newton steps of the full shell take the poses of a reduced shell, and what they cost.
//!
//! Loads are those of `front/scenes.rs` that were never trained on. Each is balanced by the full shell, by the reduced one, and by so many steps from
//! there.
//!
//! And how far so many steps a frame take frames of a load that changes slowly, from the reduced shell's pose and from where the last frame's led.
//!
//! And what they make of shells in motion: correction/motion.rs.
//!
//! usage: correction [--docs FILE] [frames | motion] [SHELL ...]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod docs;
#[path = "correction/motion.rs"]
mod motion;
#[path = "front/scenes.rs"]
#[allow(dead_code)] // the front's own
mod scenes;

use common::{displacements, mass_error};
use scenes::{Action, List, Scene};
use shellwarp::Vec3;
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use std::sync::Arc;
use std::time::Instant;

/// Largest displacements to first order, in model sizes.
const AIMS: [f64; 3] = [0.03, 0.1, 0.2];
/// Of the weight, a force that leaves the shell linear.
const LITTLE: f64 = 1e-3;
const STEPS: [usize; 4] = [1, 2, 3, 5];

/// A pose of the reduced shell, and where the full one is.
struct Pose {
    state: State,
    exact: Vec<Vec3>,
    aim: f64,
    /// Seconds that the reduced and the full search took.
    seconds: [f64; 2],
}

fn largest(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

/// Median, 90th percentile and worst.
fn spread(mut list: Vec<f64>, scale: f64) -> String {
    list.sort_by(f64::total_cmp);
    let at = |part: f64| scale * list[((list.len() - 1) as f64 * part).round() as usize];
    let short = |x: f64| if x >= 1.0 { format!("{x:.1}") } else { format!("{x:.2}") };
    format!("{} / {} / {}", short(at(0.5)), short(at(0.9)), short(at(1.0)))
}

fn model_of(scene: &Scene) -> Arc<Model> {
    let shell = &scene.shell;
    let reduced =
        reduced::Options { fields: 40, poses: reduced::default_poses(shell.mass.len()), ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn poses(scene: &Scene) -> Vec<Pose> {
    let shell = &scene.shell;
    let n = shell.mass.len();
    let rest = vec![Vec3::zeros(); n];
    let model = model_of(scene);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let search = EquilibriumOptions { max_iterations: 300, ..Default::default() };
    let mut poses = vec![];
    for load in scene.loads(List::First) {
        let Action::Forces(forces) = &load.action else { continue };
        let little: Vec<Vec3> = forces.iter().map(|f| f * (LITTLE * shell.total_mass)).collect();
        let Ok(linear) = solver.equilibrium(&rest, &little, &search, &mut |_| Ok(())) else { continue };
        let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
        for aim in AIMS {
            let scale = aim * shell.mesh.size / largest(&linear.displacement);
            let forces: Vec<Vec3> = little.iter().map(|f| f * scale).collect();
            let started = Instant::now();
            let Ok(exact) = solver.equilibrium(&rest, &forces, &search, &mut |_| Ok(())) else { continue };
            let full = started.elapsed().as_secs_f64();
            state.set_forces((0u32..).zip(forces).filter(|(_, f)| *f != Vec3::zeros()), false).unwrap();
            let started = Instant::now();
            if state.equilibrium().is_ok() {
                let seconds = [started.elapsed().as_secs_f64(), full];
                poses.push(Pose { state: state.try_clone().unwrap(), exact: exact.displacement, aim, seconds });
            }
        }
    }
    poses
}

fn row(scene: &Scene, aim: f64, poses: &[&Pose]) -> String {
    let (shell, rest) = (&scene.shell, &scene.shell.mesh.positions);
    let mean =
        |seconds: &dyn Fn(&Pose) -> f64| 1e3 * poses.iter().map(|p| seconds(p)).sum::<f64>() / poses.len() as f64;
    let start = poses.iter().map(|p| mass_error(shell, &displacements(&p.state), &p.exact)).collect();
    let mut cells = vec![spread(start, 100.0)];
    let mut times = vec![];
    for steps in STEPS {
        let mut errors = vec![];
        let started = Instant::now();
        for pose in poses {
            let x = pose.state.positions_corrected(Space::Frame, steps).unwrap();
            let u: Vec<Vec3> = x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
            errors.push(mass_error(shell, &u, &pose.exact));
        }
        times.push(format!("{:.0}", 1e3 * started.elapsed().as_secs_f64() / poses.len() as f64));
        cells.push(spread(errors, 100.0));
    }
    let factorizations = poses.iter().filter_map(|p| p.state.certify().ok()).map(|c| c.factorizations as f64).collect();
    let (reduced, full) = (mean(&|p| p.seconds[0]), mean(&|p| p.seconds[1]));
    format!(
        "| {} | {aim} | {} | {} | {reduced:.1} | {} | {full:.0} | {} |\n",
        scene.key,
        poses.len(),
        cells.join(" | "),
        times.join(", "),
        spread(factorizations, 1.0)
    )
}

/// Frames of a load that grows from a fifth and turns to both sides by so many radians.
const FRAMES: usize = 60;
const TURN: f64 = 0.35;
const PATH_AIMS: [f64; 3] = [0.05, 0.1, 0.2];

/// What is shown of a frame: the reduced shell's own pose, so many steps from there, or from where the last frame's led.
const WAYS: [(usize, bool); 5] = [(0, false), (1, false), (1, true), (2, true), (3, true)];

fn path_rows(scene: &Scene, table: &mut String) {
    let shell = &scene.shell;
    let (model, rest) = (model_of(scene), vec![Vec3::zeros(); shell.mass.len()]);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let search = EquilibriumOptions { max_iterations: 300, ..Default::default() };
    for aim in PATH_AIMS {
        let (mut errors, mut seconds) = (WAYS.map(|_| vec![]), [0.0; WAYS.len()]);
        let mut moves = vec![];
        for load in scene.loads(List::First) {
            let Action::Forces(forces) = &load.action else { continue };
            let little: Vec<Vec3> = forces.iter().map(|f| f * (LITTLE * shell.total_mass)).collect();
            let Ok(linear) = solver.equilibrium(&rest, &little, &search, &mut |_| Ok(())) else { continue };
            let whole = aim * shell.mesh.size / largest(&linear.displacement);
            let mut states = WAYS.map(|_| State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap());
            let mut exact = rest.clone();
            for frame in 0..=FRAMES {
                let t = frame as f64 / FRAMES as f64 * std::f64::consts::PI;
                let (sin, cos) = (TURN * (2.0 * t).sin()).sin_cos();
                let factor = whole * (0.6 - 0.4 * t.cos());
                let turned = |f: &Vec3| factor * Vec3::new(cos * f.x - sin * f.y, sin * f.x + cos * f.y, f.z);
                let forces: Vec<Vec3> = little.iter().map(turned).collect();
                let Ok(found) = solver.equilibrium(&exact, &forces, &search, &mut |_| Ok(())) else { break };
                moves.push(mass_error(shell, &exact, &found.displacement));
                exact = found.displacement;
                for (((steps, goes_on), state), way) in WAYS.iter().zip(&mut states).zip(0..) {
                    state.set_forces((0u32..).zip(forces.clone()).filter(|(_, f)| *f != Vec3::zeros()), false).unwrap();
                    if state.equilibrium().is_err() {
                        continue;
                    }
                    let started = Instant::now();
                    if *goes_on {
                        state.correct(*steps).unwrap();
                    }
                    let x = state.positions_corrected(Space::Frame, *steps).unwrap();
                    seconds[way] += started.elapsed().as_secs_f64();
                    let u: Vec<Vec3> = x.iter().zip(&shell.mesh.positions).map(|(x, rest)| x - rest).collect();
                    errors[way].push(mass_error(shell, &u, &exact));
                }
            }
        }
        let frames = moves.len();
        let cells = errors.map(|list| spread(list, 100.0)).join(" | ");
        let times =
            seconds[1..].iter().map(|s| format!("{:.0}", 1e3 * s / frames as f64)).collect::<Vec<_>>().join(", ");
        let row = format!("| {} | {aim} | {frames} | {} | {cells} | {times} |\n", scene.key, spread(moves, 100.0));
        print!("{row}");
        table.push_str(&row);
    }
}

fn paths(shells: &[String], docs: Option<&String>) {
    let mut table = format!(
        "Error in % by mass: median / 90th percentile / worst frame. Loads grow from a fifth over {FRAMES} frames and turn by {TURN} rad to both sides. The judge is the full shell's equilibrium, which \
         goes on from frame to frame. `make bench-correction` on {} (load {}).\n\n\
         | shell | aim | frames | a frame's own way | reduced | 1 step | 1 a frame | 2 a frame | 3 a frame | ms a frame |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let wanted = |scene: &&Scene| shells.is_empty() || shells.iter().any(|key| key == scene.key);
    scenes::all().iter().filter(wanted).for_each(|scene| path_rows(scene, &mut table));
    if let Some(file) = docs {
        docs::put_section(file, "frames", &table).unwrap();
    }
}

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let docs = arguments.iter().position(|a| a == "--docs").map(|i| arguments.drain(i..i + 2).nth(1).expect("a file"));
    if arguments.first().is_some_and(|a| a == "frames") {
        return paths(&arguments[1..], docs.as_ref());
    }
    if arguments.first().is_some_and(|a| a == "motion") {
        return motion::table(&arguments[1..], docs.as_ref());
    }
    let mut table = format!(
        "Error in % by mass, median / 90th percentile / worst of poses at rest, against the full shell's equilibrium from rest; `make bench-correction` on \
         {} (load {}). Aims: displacements to first order, in sizes. The reduced shell has 40 fields beside 8 modes.\n\n\
         | shell | aim | poses | reduced | 1 step | 2 | 3 | 5 | reduced, ms | steps, ms | full, ms | certificate's factorizations |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    for scene in scenes::all().iter().filter(|s| arguments.is_empty() || arguments.iter().any(|a| a == s.key)) {
        let poses = poses(scene);
        for aim in AIMS {
            let of: Vec<&Pose> = poses.iter().filter(|p| p.aim == aim).collect();
            if !of.is_empty() {
                let row = row(scene, aim, &of);
                print!("{row}");
                table += &row;
            }
        }
    }
    if let Some(file) = docs {
        docs::put_section(&file, "correction", &table).unwrap();
    }
}

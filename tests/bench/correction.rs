//! How far Newton steps of the full shell take the poses of a reduced shell, and what they cost.
//!
//! Loads are those of `front/scenes.rs` that were never trained on. Each is balanced by the full shell, by the reduced one, and by so many steps from
//! there.
//!
//! usage: correction [--docs FILE] [SHELL ...]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod docs;
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

fn poses(scene: &Scene) -> Vec<Pose> {
    let shell = &scene.shell;
    let n = shell.mass.len();
    let rest = vec![Vec3::zeros(); n];
    let reduced = reduced::Options { fields: 40, poses: reduced::default_poses(n), ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
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

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let docs = arguments.iter().position(|a| a == "--docs").map(|i| arguments.drain(i..i + 2).nth(1).expect("a file"));
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

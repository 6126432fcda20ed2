//! What the training of a reduced shell costs beside the modes, over the number of vertices up to the dinosaur's 13,117, and what it
//! gains under a gravity that no field was trained on.
//!
//! usage: training [--costs | --looks] [--seconds BOUND] [--threads COUNT] [--docs FILE] [VERTICES ...]
//!
//! With --costs, what parts of the training take, and no errors; of a leaf of about 1,000 vertices, too. With --looks, the same of trainings that are
//! bounded by `reduced_seconds`, or by the one that --seconds tells. --threads takes more than there are cores, too.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod docs;

use common::{displacements, leaf, leaf_of, mass_error, mesh};
use shellwarp::material::ElasticSheet;
use shellwarp::model::{Model, Options};
use shellwarp::modes::Phase;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::threads::set_threads;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;
use std::time::Instant;

const FIELDS: usize = 40;

/// That of tests/scenes/dinosaur.toml.
fn dinosaur() -> Shell {
    let mesh = mesh("dinosaur.obj");
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    let fixed = (0..mesh.positions.len() as u32).filter(|&v| mesh.positions[v as usize].y < 0.02).collect();
    Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// Where a point of a flat sheet goes.
type Place<'a> = &'a dyn Fn(f64, f64) -> Vec3;

/// Sheets of some 1,000 vertices, as a tool makes them: of felt and of paper, held by an end.
fn sheets() -> Vec<(&'static str, Arc<Shell>)> {
    let felt = ElasticSheet { young: 5e6, poisson: 0.3, thickness: 1.2e-3, volume_density: 300.0 };
    let paper = ElasticSheet { young: 3e9, poisson: 0.3, thickness: 2e-4, volume_density: 800.0 };
    let card = |a: f64, b: f64| Vec3::new(a, b, 0.0);
    let arch = |a: f64, b: f64| Vec3::new(a, 0.1 * (b / 0.1).sin(), 0.1 * (b / 0.1).cos());
    let saddle = |a: f64, b: f64| Vec3::new(a, b, 2.0 * (a * a - b * b));
    let dome = |a: f64, b: f64| Vec3::new(a, b, -2.0 * ((a - 0.12).powi(2) + b * b));
    let sheet = |place: Place, material: ElasticSheet| {
        let positions = (0..25).flat_map(|j| (0..40).map(move |i| (i as f64 / 162.5, j as f64 / 160.0 - 0.075)));
        let triangles = (0..24u32).flat_map(|j| (0..39).map(move |i| (40 * j + i, (i + j) % 2 == 1)));
        let triangles: Vec<[u32; 3]> = triangles
            .flat_map(|(a, turned)| match turned {
                true => [[a, a + 1, a + 41], [a, a + 41, a + 40]],
                false => [[a, a + 1, a + 40], [a + 1, a + 41, a + 40]],
            })
            .collect();
        let mesh = Mesh::new(positions.map(|(a, b)| place(a, b)).collect(), &triangles).unwrap();
        let fixed = (0..25).flat_map(|j| [40 * j, 40 * j + 1]).collect();
        Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap())
    };
    let shapes: [(&str, &str, Place); 4] = [
        ("card of felt", "card of paper", &card),
        ("arch of felt", "arch of paper", &arch),
        ("saddle of felt", "saddle of paper", &saddle),
        ("dome of felt", "dome of paper", &dome),
    ];
    shapes
        .iter()
        .flat_map(|(of_felt, of_paper, at)| [(*of_felt, sheet(at, felt)), (*of_paper, sheet(at, paper))])
        .collect()
}

/// Seconds of modes, of the modes' derivatives, of training, of what else the fields take, and of the samples.
#[derive(Default)]
struct Seconds([f64; 5]);

/// The model; `spent` is told each time of which part the work has been.
fn precompute_told(shell: &Arc<Shell>, (poses, bound): (usize, f64), spent: &mut dyn FnMut(usize)) -> Arc<Model> {
    let reduced = reduced::Options { fields: FIELDS, poses, seconds: bound, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    let mut part = 0;
    let model = Model::precompute(shell.clone(), &options, &mut |phase, share| {
        let ends = [0.0, 0.1, 0.5, 0.6];
        let next = if phase == Phase::Training { 1 + ends[1..].iter().filter(|end| share >= **end).count() } else { 0 };
        if next != part {
            spent(part);
            part = next;
        }
        Ok(())
    });
    spent(part);
    Arc::new(model.unwrap())
}

/// The model, and where the time went by the shares of work that the precompute reports.
fn precompute(shell: &Arc<Shell>, poses: usize) -> (Arc<Model>, Seconds) {
    precompute_within(shell, (poses, f64::INFINITY))
}

/// The same, in so many seconds.
fn precompute_within(shell: &Arc<Shell>, limits: (usize, f64)) -> (Arc<Model>, Seconds) {
    let (mut seconds, mut last) = (Seconds::default(), Instant::now());
    let model = precompute_told(shell, limits, &mut |part| {
        seconds.0[part] += last.elapsed().as_secs_f64();
        last = Instant::now();
    });
    (model, seconds)
}

/// At rest under `gravity`, if it gets there.
fn at_rest(model: &Arc<Model>, method: Method, gravity: Vec3) -> Option<Vec<Vec3>> {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(gravity).unwrap();
    state.equilibrium().ok().map(|_| displacements(&state))
}

/// The gravity along `direction` that moves the full shell by a fifth of its size, more or less, and the shape; none where it does not
/// come to rest.
fn fifth(model: &Arc<Model>, direction: Vec3) -> Option<(Vec3, Vec<Vec3>)> {
    let aim = 0.2 * model.shell.mesh.size;
    let moved = |u: &[Vec3]| u.iter().map(|u| u.norm()).fold(0.0, f64::max);
    let linear = at_rest(model, Method::LinearModalAnalysis, direction)?;
    let mut strength = aim / moved(&linear);
    for _ in 0..4 {
        let u = at_rest(model, Method::ImplicitShell, strength * direction)?;
        let ratio = aim / moved(&u);
        if (0.8..1.25).contains(&ratio) {
            return Some((strength * direction, u));
        }
        strength *= ratio;
    }
    at_rest(model, Method::ImplicitShell, strength * direction).map(|u| (strength * direction, u))
}

fn percent(error: Option<f64>) -> String {
    error.map_or("none found".to_owned(), |error| format!("{:.2} %", 100.0 * error))
}

/// A number that two models share if all their bits do (FNV-1a of what is saved).
fn bits(model: &Model) -> u64 {
    let next = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    model.save().unwrap().iter().fold(0xcbf2_9ce4_8422_2325, next)
}

/// Prints the seconds of derivatives, equilibria, fields, samples with the polynomial, and of all of them.
fn print_costs(shells: &[(&str, Arc<Shell>)]) {
    println!(
        "| shell | vertices | derivatives | equilibria | fields | samples, polynomial | all | bits |\n|---|---|---|---|---|---|---|---|"
    );
    for (name, shell) in shells {
        let (model, Seconds([_, parts @ ..])) = precompute(shell, reduced::default_poses(shell.mass.len()));
        let all: f64 = parts.iter().sum();
        let cells: String = parts.iter().chain([&all]).map(|seconds| format!(" {seconds:.2} s |")).collect();
        println!("| {name} | {} |{cells} {:016x} |", shell.mass.len(), bits(&model));
    }
}

/// Bounds by `reduced_seconds` that are tried.
const BOUNDS: [f64; 4] = [1.0, 3.0, 10.0, 30.0];

/// Prints the same seconds of trainings that are bounded, and how many equilibria they have for the gate.
fn print_looks(shells: &[(&str, Arc<Shell>)], bounds: &[f64]) {
    println!(
        "| shell | vertices | reduced_seconds | derivatives | equilibria | fields | samples, polynomial | all | judged by |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    for (name, shell) in shells {
        let poses = reduced::default_poses(shell.mass.len());
        for &bound in bounds {
            let (model, Seconds([_, parts @ ..])) = precompute_within(shell, (poses, bound));
            let all: f64 = parts.iter().sum();
            let cells: String = parts.iter().chain([&all]).map(|seconds| format!(" {seconds:.2} s |")).collect();
            let judged = model
                .reduced
                .as_ref()
                .and_then(|reduced| reduced.polynomial.as_ref())
                .map_or(0, |form| form.gate.tried);
            println!("| {name} | {} | {bound} |{cells} {judged} |", shell.mass.len());
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let mut table = format!(
        "{FIELDS} fields beside 8 modes, on as many equilibria as is the default; `make bench-training` on {} (load {}). *Training* is all \
         that follows the modes. Errors by the paper's warp, by modes and their derivatives alone, and trained, by samples and by the \
         polynomial.\n\n\
         | shell | vertices | modes | derivatives | equilibria | fields | samples, polynomial | training | number of equilibria | \
         the paper | untrained | samples | polynomial |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let oblique = Vec3::new(0.35, -0.6, -0.72).normalize();
    let mut shells: Vec<(&str, Arc<Shell>)> = [1, 2, 3, 4].map(|fine| ("leaf", Arc::new(leaf(fine)))).to_vec();
    shells.push(("dinosaur", Arc::new(dinosaur())));
    let asked = |option: &str| arguments.iter().any(|a| a == option);
    let (costs_only, looks_only) = (asked("--costs"), asked("--looks"));
    if costs_only || looks_only {
        shells.insert(1, ("leaf", Arc::new(leaf_of(44, 21))));
        shells.extend(sheets());
    }
    let told =
        |option: &str| arguments.iter().position(|a| a == option).map(|at| at + 1).filter(|at| *at < arguments.len());
    let (threads, seconds) = (told("--threads"), told("--seconds"));
    assert!(set_threads(threads.map_or(0, |at| arguments[at].parse().unwrap())));
    let bounds = seconds.map_or(BOUNDS.to_vec(), |at| vec![arguments[at].parse().unwrap()]);
    let numbers = arguments.iter().enumerate().filter(|(at, _)| ![threads, seconds].contains(&Some(*at)));
    let only: Vec<usize> = numbers.filter_map(|(_, a)| a.parse().ok()).collect();
    shells.retain(|(_, shell)| only.is_empty() || only.contains(&shell.mass.len()));
    if costs_only {
        return print_costs(&shells);
    }
    if looks_only {
        return print_looks(&shells, &bounds);
    }
    for (name, shell) in &shells {
        let poses = reduced::default_poses(shell.mass.len());
        let (model, seconds) = precompute(shell, poses);
        let exact = fifth(&model, oblique);
        let of = |model: &Arc<Model>, method: Method| {
            let Some((gravity, exact)) = &exact else { return "no reference".to_owned() };
            percent(at_rest(model, method, *gravity).map(|u| mass_error(shell, &u, exact)))
        };
        let Seconds([modes, parts @ ..]) = seconds;
        let parts: String =
            parts.iter().chain([&parts.iter().sum()]).map(|seconds| format!(" {seconds:.2} s |")).collect();
        let row = format!(
            "| {name} | {} | {modes:.2} s |{parts} {poses} | {} | {} | {} | {} |\n",
            shell.mass.len(),
            of(&model, Method::Warp),
            of(&precompute(shell, 0).0, Method::ReducedShell),
            of(&model, Method::ReducedShell),
            of(&model, Method::PolynomialShell)
        );
        print!("{row}");
        table += &row;
    }
    if let Some(file) = arguments.iter().position(|a| a == "--docs").and_then(|i| arguments.get(i + 1)) {
        docs::put_section(file, "training", &table).unwrap();
    }
}

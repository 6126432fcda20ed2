//! Factorizations and seconds that equilibria of the full shell take from rest.
//!
//! Each search is made by the energy alone and with the stress as an unknown, over the forces of the lists in `front/scenes.rs`.
//!
//! And of steps of 1/30 s of shells that fall from rest and swing, with a factor for each direction and with earlier ones.
//!
//! And of cotton that hangs limp and is blown on.
//!
//! The same steps on several numbers of threads, with the bits of where they end compared.
//!
//! usage: solver [--docs FILE] [steps [SHELL ...] | limp [SHELL ...] | threads [COUNT ...] [SHELL ...] | SHELL ...]
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod docs;
#[path = "front/scenes.rs"]
#[allow(dead_code)] // the front's own
mod scenes;

use common::{equilateral_sheet, leaf, mass_error, mesh};
use faer::MatMut;
use scenes::{Action, Scene};
use shellwarp::material::PRESETS;
use shellwarp::reference::{EquilibriumOptions, Rayleigh, Solver};
use shellwarp::threads::set_threads;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Largest displacements to first order, in model sizes.
const AIMS: [f64; 3] = [0.1, 0.3, 1.0];
/// Of the weight, a force that leaves the shell linear.
const LITTLE: f64 = 1e-3;
/// Ends further apart than this, relative, are not the same.
const APART: f64 = 1e-3;

/// Searches for a list of loads.
#[derive(Default)]
struct Total {
    factorizations: usize,
    seconds: f64,
    found: usize,
}

impl Total {
    fn search(&mut self, solver: &mut Solver, forces: &[Vec3]) -> Option<Vec<Vec3>> {
        let (before, started) = (solver.factorizations(), Instant::now());
        let start = vec![Vec3::zeros(); forces.len()];
        let end = solver.equilibrium(&start, forces, &EquilibriumOptions::default(), &mut |_| Ok(())).ok();
        self.factorizations += solver.factorizations() - before;
        self.seconds += started.elapsed().as_secs_f64();
        self.found += usize::from(end.is_some());
        end.map(|end| end.displacement)
    }
}

fn largest(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

/// Those of a scene, each at the strengths of [`AIMS`].
fn forces(scene: &Scene, solver: &mut Solver) -> Vec<Vec<Vec3>> {
    let shell: &Shell = &scene.shell;
    let mut list = vec![];
    for load in scene.lists.iter().flat_map(|list| scene.loads(*list)) {
        let Action::Forces(forces) = &load.action else { continue };
        let little: Vec<Vec3> = forces.iter().map(|f| f * (LITTLE * shell.total_mass)).collect();
        let Some(linear) = Total::default().search(solver, &little) else { continue };
        let scaled = |aim: f64| little.iter().map(|f| f * (aim * shell.mesh.size / largest(&linear))).collect();
        list.extend(AIMS.map(scaled));
    }
    list
}

/// A shell that falls from rest and swings.
struct Swing {
    solver: Solver,
    u: Vec<Vec3>,
    velocity: Vec<Vec3>,
    iterations: usize,
    seconds: f64,
}

impl Swing {
    fn new(shell: &Arc<Shell>, reusing: bool) -> Self {
        let mut solver = Solver::new(shell.clone()).unwrap();
        solver.set_reusing(reusing);
        let still = vec![Vec3::zeros(); shell.mass.len()];
        Self { solver, u: still.clone(), velocity: still, iterations: 0, seconds: 0.0 }
    }

    fn step(&mut self, weight: &[Vec3]) {
        let damping = Rayleigh { mass: 0.5, stiffness: 0.0 };
        let started = Instant::now();
        let step = self.solver.implicit_euler(&mut self.u, &mut self.velocity, weight, damping, 1.0 / 30.0);
        self.iterations += step.unwrap().iterations;
        self.seconds += started.elapsed().as_secs_f64();
    }

    /// Iterations, factorizations and seconds.
    fn per_frame(&self, frames: usize) -> [f64; 3] {
        [self.iterations as f64, self.solver.factorizations() as f64, self.seconds].map(|x| x / frames as f64)
    }
}

/// `frames` steps of 1/30 s from rest under gravity, with a factor for each direction and with earlier ones. They take turns, so that
/// other work on the machine slows both.
fn swing(shell: &Arc<Shell>, (gravity, frames): (f64, usize)) -> [Swing; 2] {
    let direction = Vec3::new(0.3, -0.2, -1.0);
    let weight: Vec<Vec3> = shell.mass.iter().map(|m| direction * (m * gravity)).collect();
    let mut swings = [false, true].map(|reusing| Swing::new(shell, reusing));
    for _ in 0..frames {
        swings.iter_mut().for_each(|swing| swing.step(&weight));
    }
    swings
}

fn frames(only: &[String]) -> String {
    let mut table = format!(
        "Steps of 1/30 s from rest under 9.8 m/s²; `make bench-solver` on {} (load {}). With a factor for each direction → with earlier ones. \
         Apart: where they end, relative, by mass.\n\n\
         | shell | vertices | steps | iterations a step | factorizations | ms | apart |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let shells = [
        ("leaf", leaf(1), 60),
        ("leaf", leaf(2), 30),
        ("leaf", leaf(4), 6),
        ("dinosaur", dinosaur(), 6),
        ("sheet", sheet(), 6),
    ];
    for (name, shell, frames) in
        shells.into_iter().filter(|(name, ..)| only.is_empty() || only.iter().any(|o| o == name))
    {
        let shell = Arc::new(shell);
        let swings = swing(&shell, (9.8, frames));
        let [[a, b, c], [_, d, e]] = [0, 1].map(|k: usize| swings[k].per_frame(frames));
        let row = format!(
            "| {name} | {} | {frames} | {a:.1} | {b:.1} → {d:.1} | {:.0} → {:.0} | {:.0e} |\n",
            shell.mass.len(),
            1e3 * c,
            1e3 * e,
            mass_error(&shell, &swings[1].u, &swings[0].u)
        );
        print!("{row}");
        table += &row;
    }
    table
}

/// Best of so many runs, as other work on the machine only adds.
const RUNS: usize = 3;

/// Milliseconds of a matrix' factorization and of a solution, both at best.
fn factor_times(shell: &Shell) -> [f64; 2] {
    let mut matrix = shell.matrix(&[]);
    shell
        .energy
        .visit_rest_rows(&mut |(vertices, row)| matrix.add_element(vertices, |p, q| row[p] * row[q].transpose()));
    shell.free.iter().enumerate().for_each(|(i, v)| matrix.add_diagonal(i, 900.0 * shell.mass[*v as usize]));
    let symbolic = shell.analysis(matrix.lower.symbolic()).unwrap();
    let mut factor = symbolic.factor().unwrap();
    let mut room = symbolic.solving_room(1).unwrap();
    let mut x = vec![1.0; matrix.lower.ncols()];
    let mut best = [f64::INFINITY; 2];
    for _ in 0..3 * RUNS {
        let started = Instant::now();
        assert!(symbolic.refactorize(&matrix.lower, &mut factor).unwrap());
        let made = Instant::now();
        let n = x.len();
        symbolic.solve_in_room(&factor, MatMut::from_column_major_slice_mut(&mut x, n, 1), &mut room);
        let times = [made - started, made.elapsed()].map(|time| 1e3 * time.as_secs_f64());
        (0..2).for_each(|k| best[k] = best[k].min(times[k]));
    }
    best
}

fn by_threads(counts: &[usize], only: &[String]) -> String {
    let mut table = format!(
        "Steps of 1/30 s from rest under 9.8 m/s², the first six, on {} (load {}), best of {RUNS} runs; \
         `target/release/examples/solver threads 1 2 4`. Every number of threads ends with the same bits.\n\n\
         | shell | vertices | threads | ms a step | of one thread | a factorization | a solution |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    for (name, shell) in [("leaf", leaf(2)), ("leaf", leaf(4)), ("dinosaur", dinosaur()), ("sheet", sheet())] {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let shell = Arc::new(shell);
        let weight: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.3, -0.2, -1.0) * (m * 9.8)).collect();
        let (mut alone, mut end) = (f64::NAN, None);
        for &count in counts {
            assert!(set_threads(count));
            let mut best = f64::INFINITY;
            for _ in 0..RUNS {
                let mut swing = Swing::new(&shell, true);
                (0..6).for_each(|_| swing.step(&weight));
                best = best.min(1e3 * swing.seconds / 6.0);
                let bits: Vec<u64> = swing.u.iter().flat_map(|u| u.data.0[0].map(f64::to_bits)).collect();
                assert!(end.get_or_insert_with(|| bits.clone()) == &bits, "other bits with {count} threads");
            }
            alone = if alone.is_nan() { best } else { alone };
            let [factorization, solution] = factor_times(&shell);
            let row = format!(
                "| {name} | {} | {count} | {best:.0} | {:.2} | {factorization:.1} | {solution:.1} |\n",
                shell.mass.len(),
                best / alone
            );
            print!("{row}");
            table += &row;
        }
    }
    table
}

/// That of tests/scenes/dinosaur.toml.
fn dinosaur() -> Shell {
    let mesh = mesh("dinosaur.obj");
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    let fixed = (0..mesh.positions.len() as u32).filter(|&v| mesh.positions[v as usize].y < 0.02).collect();
    Shell::new(mesh, material, &Supports { fixed, ..Supports::default() }).unwrap()
}

/// A metre of cloth held along one side.
fn sheet() -> Shell {
    let (positions, triangles) = equilateral_sheet(116, 116, 1.0 / 116.0);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.02).collect();
    let material = Material { k_area: 1e3, k_length: 1e3, k_bend: 1e-3, area_density: 0.2 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Supports::default() }).unwrap()
}

/// Frames of cotton that hangs and is blown on.
const LIMP_FRAMES: usize = 60;

/// Cotton by its preset: a flag held by one side, a cloth by two corners, a skirt by its waist, of two sizes.
fn cottons() -> impl Iterator<Item = (&'static str, Shell)> {
    let preset = PRESETS.iter().find(|preset| preset.name == c"cotton").unwrap();
    let made = move |(positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>), held: &dyn Fn(&Vec3) -> bool| {
        let fixed = (0..positions.len() as u32).filter(|v| held(&positions[*v as usize])).collect();
        let mesh = Mesh::new(positions, &triangles).unwrap();
        Shell::new(mesh, preset.sheet, &Supports { fixed, ..Supports::default() }).unwrap()
    };
    [24, 48].into_iter().flat_map(move |n| {
        let sheet = || equilateral_sheet(n, n, 0.6 / n as f64);
        let top = sheet().0.iter().map(|p| p.y).fold(0.0, f64::max);
        let corner = move |p: &Vec3| p.y > top - 0.03 && (p.x < 0.04 || p.x > 0.56);
        [
            ("flag", made(sheet(), &|p| p.x < 0.015)),
            ("cloth", made(sheet(), &corner)),
            ("skirt", made(skirt(n * 7 / 12), &|p| p.z == 0.0)),
        ]
    })
}

/// 60 cm long, 12 cm in radius above and 30 below.
fn skirt(rows: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let around = 4 * rows;
    let at = |row: usize, k: usize| (row * around + k % around) as u32;
    let place = |row: usize, k: usize| {
        let down = row as f64 / rows as f64;
        let angle = std::f64::consts::TAU * (k as f64 + 0.5 * (row % 2) as f64) / around as f64;
        let radius = 0.12 + 0.18 * down;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), -0.6 * down)
    };
    let positions = (0..=rows).flat_map(|row| (0..around).map(move |k| place(row, k))).collect();
    let pair = |row: usize, k: usize| {
        let [a, b, c, d] = [at(row, k), at(row, k + 1), at(row + 1, k), at(row + 1, k + 1)];
        if row.is_multiple_of(2) { [[a, c, b], [b, c, d]] } else { [[a, c, d], [a, d, b]] }
    };
    (positions, (0..rows).flat_map(|row| (0..around).flat_map(move |k| pair(row, k))).collect())
}

fn limp(only: &[String]) {
    println!(
        "| shell | vertices | steps | iterations a step | most | factorizations | ms |\n|---|---|---|---|---|---|---|"
    );
    for (name, shell) in cottons().filter(|(name, _)| only.is_empty() || only.iter().any(|o| o == name)) {
        let shell = Arc::new(shell);
        let (mut swing, mut most) = (Swing::new(&shell, true), 0);
        for frame in 0..LIMP_FRAMES {
            let gust = 6.0 * (0.2 * frame as f64).sin();
            let weight: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.3 * gust, gust, -9.8) * *m).collect();
            let before = swing.iterations;
            swing.step(&weight);
            most = most.max(swing.iterations - before);
        }
        let [a, b, c] = swing.per_frame(LIMP_FRAMES);
        println!("| {name} | {} | {LIMP_FRAMES} | {a:.1} | {most} | {b:.1} | {:.0} |", shell.mass.len(), 1e3 * c);
    }
}

fn equilibria(only: &[String]) -> String {
    let mut table = format!(
        "From rest to 1e-8 of the load, forces that move the shell by 0.1, 0.3 and 1 of its size to first order; `make bench-solver` on {} \
         (load {}). By the energy alone → with the stress as an unknown. Elsewhere: ends that differ by more than {APART}, and where the \
         potential is lower with the stress as an unknown.\n\n\
         | shell | loads | factorizations | seconds | found | elsewhere | lower |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    for scene in scenes::all().iter().filter(|s| only.is_empty() || only.iter().any(|o| o == s.key)) {
        let mut solver = Solver::new(scene.shell.clone()).unwrap();
        let mut totals = [Total::default(), Total::default()];
        let (mut elsewhere, mut lower) = (0, 0);
        let list = forces(scene, &mut solver);
        for forces in &list {
            let mut ends = vec![];
            for (mixed, total) in [false, true].into_iter().zip(&mut totals) {
                solver.set_mixed(mixed);
                ends.push(total.search(&mut solver, forces));
            }
            let [Some(plain), Some(mixed)] = &ends[..] else { continue };
            if mass_error(&scene.shell, mixed, plain) > APART {
                let work = |u: &[Vec3]| u.iter().zip(forces).map(|(u, f)| u.dot(f)).sum::<f64>();
                let [a, b] = [plain, mixed].map(|u| solver.elastic_energy(u) - work(u));
                elsewhere += 1;
                lower += usize::from(b < a);
            }
        }
        let [a, b] = totals;
        let row = format!(
            "| {} | {} | {} → {} | {:.1} → {:.1} | {} → {} | {elsewhere} | {lower} |\n",
            scene.key,
            list.len(),
            a.factorizations,
            b.factorizations,
            a.seconds,
            b.seconds,
            a.found,
            b.found
        );
        print!("{row}");
        table += &row;
    }
    table
}

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let docs = arguments.iter().position(|a| a == "--docs").map(|i| arguments.drain(i..i + 2).nth(1).expect("a file"));
    if arguments.iter().any(|a| a == "steps") {
        let only: Vec<String> = arguments.into_iter().filter(|a| a != "steps").collect();
        let table = frames(&only);
        docs.iter().for_each(|file| docs::put_section(file, "steps", &table).unwrap());
        return;
    }
    if arguments.iter().any(|a| a == "limp") {
        let only: Vec<String> = arguments.into_iter().filter(|a| a != "limp").collect();
        limp(&only);
        return;
    }
    if arguments.iter().any(|a| a == "threads") {
        let (counts, only): (Vec<_>, Vec<_>) =
            arguments.into_iter().filter(|a| a != "threads").partition(|a| a.parse::<usize>().is_ok());
        let counts: Vec<usize> = counts.iter().map(|count| count.parse().unwrap()).collect();
        let table = by_threads(if counts.is_empty() { &[1, 2] } else { &counts }, &only);
        docs.iter().for_each(|file| docs::put_section(file, "threads", &table).unwrap());
        return;
    }
    let table = equilibria(&arguments);
    if let Some(file) = docs {
        docs::put_section(&file, "solver", &table).unwrap();
        docs::put_section(&file, "steps", &frames(&[])).unwrap();
    } else if arguments.is_empty() {
        frames(&[]);
    }
}

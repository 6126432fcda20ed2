//! Koiter's energy against closed forms and benchmarks on four kinds of meshes. Prints docs/evidence/koiter.md:
//!
//!     cargo run --release --example koiter > docs/evidence/koiter.md
//!
//! With `--step` only what a step costs, with `--training` only what a precompute with a reduced shell does.

#[path = "../common/mod.rs"]
mod common;
#[path = "koiter_obstacles.rs"]
mod obstacles;
#[path = "../common/plates.rs"]
mod plates;
#[path = "koiter_shapes.rs"]
mod shapes;
#[path = "koiter_sheets.rs"]
mod sheets;

use common::modes_of;
use plates::{CLAMPED, FAMILIES, Family, SQUARES, SUPPORTED, Sheet, rectangle};
use shellwarp::material::{ElasticSheet, Elasticity};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

const CELLS: [usize; 3] = [8, 16, 32];

/// The paper's energy with a plate rigidity of 1 and a membrane that hardly stretches.
const PAPER: Material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1.0 / 6.0, area_density: 1.0 };

fn shell(sheet: Sheet, material: impl Into<Elasticity>, clamped: impl Fn(&Vec3) -> bool) -> Shell {
    let clamped = (0..sheet.0.len() as u32).filter(|v| clamped(&sheet.0[*v as usize])).collect();
    held(sheet, material, Supports { clamped, ..Default::default() })
}

fn held((positions, triangles): Sheet, material: impl Into<Elasticity>, supports: Supports) -> Shell {
    let mesh = Mesh::new(positions, &triangles).expect("the sheets are manifolds");
    Shell::new(mesh, material, &supports).expect("the sheets have mass")
}

/// ω a² √(mass per area/D) of the elastic modes, a = 1.
fn frequencies(shell: &Shell, rigidity: f64, wanted: usize) -> Vec<f64> {
    let unit = (shell.material.area_density() / rigidity).sqrt();
    let modes = modes_of(shell, wanted);
    modes.eigenvalues.iter().filter(|lambda| **lambda > 0.0).map(|lambda| lambda.sqrt() * unit).collect()
}

fn percent(found: &[f64], exact: &[f64]) -> String {
    let off = found.iter().zip(exact).map(|(found, exact)| format!("{:.1}", 100.0 * (found / exact - 1.0)));
    off.collect::<Vec<_>>().join(" ")
}

fn name(family: Family) -> &'static str {
    match family {
        Family::Equilateral => "equilateral",
        Family::Diagonal => "one diagonal",
        Family::UnionJack => "union jack",
        Family::Irregular => "irregular",
    }
}

fn plates() {
    println!("## Square plates\n");
    println!(
        "Errors in percent of the lowest frequencies of thin square plates, clamped on one side (CFFF) and free (FFFF). The reference is"
    );
    println!(
        "Rayleigh's and Ritz's method with 14 Legendre polynomials each way; Leissa's (1973) values are up to 0.7 % above it.\n"
    );
    for (poisson, cantilever, free) in SQUARES {
        println!("ν = {poisson}:\n");
        println!("| mesh | cells | CFFF, modes 1–5 | FFFF, modes 1–6 |\n|---|---|---|---|");
        for (family, n) in FAMILIES.into_iter().flat_map(|family| CELLS.map(|n| (family, n))) {
            let sheet = ElasticSheet { young: 1.0, poisson, thickness: 1e-3, volume_density: 1.0 };
            let square = || rectangle(family, n, 1.0, 1.0);
            let rigidity = sheet.stiffness()[1];
            let held = frequencies(&shell(square(), sheet, |x| x.x < 1e-9), rigidity, 5);
            let loose = frequencies(&shell(square(), sheet, |_| false), rigidity, 12);
            println!("| {} | {n} | {} | {} |", name(family), percent(&held, &cantilever), percent(&loose, &free));
        }
        println!();
    }
}

/// Square plates held on all four sides, whose frequencies do not depend on ν: so the paper's energy has a reference here too.
fn held_plates() {
    println!("## Square plates held on all sides\n");
    println!(
        "Errors in percent of the four lowest frequencies, simply supported (SSSS: `fixed` vertices) and clamped (CCCC). They do not depend on ν, so the"
    );
    println!(
        "paper's energy has the same reference, with its D of 6 k_bend. It clamps by holding the neighbours of clamped vertices, so its clamped plate is"
    );
    println!("smaller by a row of cells on each side. Koiter's is of ν = 0.3.\n");
    println!(
        "| mesh | cells | SSSS, Koiter's | SSSS, the paper's | CCCC, Koiter's | CCCC, the paper's |\n|---|---|---|---|---|---|"
    );
    let sheet = ElasticSheet { young: 1.0, poisson: 0.3, thickness: 1e-3, volume_density: 1.0 };
    let koiter = (Elasticity::from(sheet), sheet.stiffness()[1]);
    let paper = (Elasticity::from(PAPER), 1.0);
    for (family, n) in FAMILIES.into_iter().flat_map(|family| CELLS.map(|n| (family, n))) {
        let errors = |(material, rigidity): (Elasticity, f64), is_clamped: bool| {
            let square = rectangle(family, n, 1.0, 1.0);
            let at_edge = |x: &Vec3| x.x.min(x.y).min(1.0 - x.x).min(1.0 - x.y) < 1e-9;
            let edge = (0..square.0.len() as u32).filter(|v| at_edge(&square.0[*v as usize])).collect();
            let (fixed, clamped) = if is_clamped { (vec![], edge) } else { (edge, vec![]) };
            let plate = held(square, material, Supports { fixed, clamped, ..Default::default() });
            percent(&frequencies(&plate, rigidity, 4), if is_clamped { &CLAMPED } else { &SUPPORTED })
        };
        let [a, b, c, d] = [(koiter, false), (paper, false), (koiter, true), (paper, true)].map(|(m, c)| errors(m, c));
        println!("| {} | {n} | {a} | {b} | {c} | {d} |", name(family));
    }
    println!();
}

/// The paper's plate has D = 6 k_B and ν = −1/3 on near-equilateral meshes: how far it is from itself elsewhere.
fn paper() {
    println!("## The paper's energy beside it\n");
    println!(
        "Its constants have no Poisson's ratio to choose. So here is how far its frequencies of the free square are from its own on the"
    );
    println!("equilateral mesh of 32 cells, in percent, modes 1–6; and Koiter's, ν = 0.3.\n");
    println!("| mesh | cells | the paper's | Koiter's |\n|---|---|---|---|");
    let of = |family: Family, n: usize, material: Elasticity| {
        frequencies(&shell(rectangle(family, n, 1.0, 1.0), material, |_| false), 1.0, 12)
    };
    let paper = Elasticity::from(PAPER);
    let koiter = Elasticity::from(ElasticSheet { young: 1.0, poisson: 0.3, thickness: 1e-3, volume_density: 1.0 });
    let own = [paper, koiter].map(|material| of(Family::Equilateral, 32, material));
    for (family, n) in FAMILIES.into_iter().flat_map(|family| CELLS.map(|n| (family, n))) {
        let row = [paper, koiter].map(|material| of(family, n, material));
        println!("| {} | {n} | {} | {} |", name(family), percent(&row[0], &own[0]), percent(&row[1], &own[1]));
    }
    println!();
}

fn arch() {
    println!("## One object meshed four ways\n");
    println!(
        "A sheet of 1 by 0.6, arched along and across, clamped at one end: the lowest ten frequencies, and how far apart they are.\n"
    );
    let sheet = ElasticSheet { young: 1e5, poisson: 0.3, thickness: 0.02, volume_density: 10.0 };
    let curved = |x: &Vec3| Vec3::new(x.x, x.y, 0.5 * x.x * (1.0 - x.x) + 0.3 * (x.y - 0.3).powi(2));
    let all = FAMILIES.map(|family| {
        let (positions, triangles) = rectangle(family, 32, 1.0, 0.6);
        let arched = shell((positions.iter().map(curved).collect(), triangles), sheet, |x| x.x < 1e-9);
        frequencies(&arched, sheet.area_density(), 10)
    });
    println!("| mode | {} | apart, % |\n|---|---|---|---|---|---|", FAMILIES.map(name).join(" | "));
    for k in 0..10 {
        let of = all.each_ref().map(|all| all[k]);
        let (low, high) = (of.iter().copied().fold(f64::MAX, f64::min), of.iter().copied().fold(0.0, f64::max));
        println!("| {} | {} | {:.2} |", k + 1, of.map(|f| format!("{f:.3}")).join(" | "), 100.0 * (high / low - 1.0));
    }
    println!();
}

/// Mean displacement of the end under P = 4, along the beam and across.
fn far_bent(family: Family, n: usize, material: Elasticity) -> [f64; 2] {
    let shell = Arc::new(shell(rectangle(family, n, 10.0, 1.0), material, |x| x.x < 1e-9));
    let x = &shell.mesh.positions;
    let at_end = |v: usize| x[v].x > 10.0 - 1e-9;
    let mut load = vec![Vec3::zeros(); x.len()];
    for [a, b] in shell.mesh.edges.iter().map(|e| e.vertices.map(|v| v as usize)) {
        let share = if at_end(a) && at_end(b) { 2.0 * (x[a] - x[b]).norm() } else { 0.0 };
        [a, b].iter().for_each(|v| load[*v].z += share);
    }
    let mut solver = Solver::new(shell.clone()).expect("the beam is held");
    let start = vec![Vec3::zeros(); x.len()];
    let found = solver.equilibrium(&start, &load, &EquilibriumOptions::default(), &mut |_| Ok(()));
    let u = found.expect("the beam comes to rest").displacement;
    let end: Vec<Vec3> = (0..x.len()).filter(|v| at_end(*v)).map(|v| u[v]).collect();
    let mean = end.iter().sum::<Vec3>() / end.len() as f64;
    [mean.x, mean.z]
}

fn cantilever() {
    println!("## A cantilever under an end force, far bent\n");
    println!(
        "Sze, Liu, Lo (2004), *Popular benchmark problems for geometric nonlinear analysis of shells*, 3.1: 10 by 1 by 0.1, E = 1.2e6, ν = 0, P = 4. The"
    );
    println!(
        "reference's end moves by -3.286 along the beam and 6.698 across. The paper's k_bend of 18.75 gives a beam of equilateral triangles the same E·I,"
    );
    println!(
        "and its k_length of √3 l/4 · E h, l the edge, resists stretching as E h does on such a mesh. k_area is E h/4.\n"
    );
    println!("| mesh | cells | along | across | the paper's along | across |\n|---|---|---|---|---|---|");
    let sheet = ElasticSheet { young: 1.2e6, poisson: 0.0, thickness: 0.1, volume_density: 1.0 };
    for (family, n) in FAMILIES.into_iter().flat_map(|family| [20, 40, 80].map(|n| (family, n))) {
        let [[a, b], [c, d]] =
            [sheet.into(), paper_of_beam(10.0 / n as f64, &sheet).into()].map(|material| far_bent(family, n, material));
        println!("| {} | {n} | {a:.3} | {b:.3} | {c:.3} | {d:.3} |", name(family));
    }
    println!();
}

/// The paper's constants of the beam of width 1 in cells of a length.
fn paper_of_beam(cell: f64, sheet: &ElasticSheet) -> Material {
    let stretch = sheet.young * sheet.thickness;
    let k_length = 0.25 * 3f64.sqrt() * cell * stretch;
    Material { k_area: 0.25 * stretch, k_length, k_bend: 18.75, area_density: 0.1 }
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("--step") {
        return sheets::cost_of_a_step();
    }
    if std::env::args().nth(1).as_deref() == Some("--training") {
        return sheets::cost_of_training();
    }
    println!("# Koiter's energy on four kinds of meshes\n");
    println!(
        "Made by `cargo run --release --example koiter > docs/evidence/koiter.md`. Meshes: rows of near-equilateral triangles; squares cut along one"
    );
    println!(
        "diagonal; squares cut along both diagonals by turns (union jack); Delaunay's triangles of an equilateral mesh whose vertices are moved by up to"
    );
    println!(
        "a quarter of an edge. Supports clamp the edge exactly. `tests/energy/koiter.rs` asserts what is said of Koiter's here.\n"
    );
    plates();
    held_plates();
    paper();
    arch();
    obstacles::print();
    shapes::print();
    cantilever();
    sheets::print();
}

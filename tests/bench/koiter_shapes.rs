//! Sheets that are bent to a cylinder or twisted, and tubes that are bent or twisted by their ends: against closed forms.

use super::obstacles::{Problem, paper, solved};
use super::plates::{FAMILIES, Family, closed, rectangle};
use super::{CELLS, Material, Mesh, Vec3, name};
use shellwarp::energy::{Energy, discrete_shell, koiter};
use shellwarp::material::ElasticSheet;
use std::f64::consts::PI;

/// Of the square of side 1.
const CURVATURE: f64 = 0.2;

/// Rolled to a cylinder whose lines are at an angle to y; without a stretch.
fn rolled(x: &Vec3, angle: f64) -> Vec3 {
    let (across, along) = (Vec3::new(angle.cos(), angle.sin(), 0.0), Vec3::new(-angle.sin(), angle.cos(), 0.0));
    let turn = CURVATURE * x.dot(&across);
    (across * turn.sin() + Vec3::z() * (1.0 - turn.cos())) / CURVATURE + along * x.dot(&along)
}

/// Twisted; of small slopes.
fn twisted(x: &Vec3) -> Vec3 {
    let twist = 1e-3;
    Vec3::new(x.x, x.y, twist * x.x * x.y)
}

/// Bending energy of the three shapes over that of a plate of rigidity 1 and Poisson's ratio ν: κ²/2, and (1 − ν) τ².
fn energies(rest: &[Vec3], bending: &[Box<dyn Energy>], poisson: f64) -> [f64; 3] {
    let value = |shape: &dyn Fn(&Vec3) -> Vec3| -> f64 {
        let x: Vec<Vec3> = rest.iter().map(shape).collect();
        bending.iter().map(|term| term.value(&x)).sum()
    };
    let bent = 0.5 * CURVATURE * CURVATURE;
    [
        value(&|x| rolled(x, 0.0)) / bent,
        value(&|x| rolled(x, PI / 6.0)) / bent,
        value(&twisted) / ((1.0 - poisson) * 1e-6),
    ]
}

fn shapes() {
    println!("## Bent to a cylinder, and twisted\n");
    println!(
        "Bending energy of a square of side 1. It is put on a cylinder of radius 5, whose lines are along y or turned by 30 degrees, or is twisted to z = 0.001 x y. Numbers are"
    );
    println!(
        "over D κ²/2 and D (1 − ν) τ² a unit of area. Koiter's is of ν = 0.3. The paper's D is 6 k_bend, and its ν on equilateral triangles −1/3.\n"
    );
    println!(
        "| mesh | cells | cylinder | at 30° | twist | the paper's cylinder | at 30° | twist |\n|---|---|---|---|---|---|---|---|"
    );
    let sheet = ElasticSheet { young: 1.0, poisson: 0.3, thickness: 1e-2, volume_density: 1.0 };
    let hinges = Material { k_area: 0.0, k_length: 0.0, k_bend: 1.0 / 6.0, area_density: 1.0 };
    for (family, n) in FAMILIES.into_iter().flat_map(|family| CELLS.map(|n| (family, n))) {
        let (flat, triangles) = rectangle(family, n, 1.0, 1.0);
        let mesh = Mesh::new(flat, &triangles).expect("it is a manifold");
        let rigidity = sheet.stiffness()[1];
        let own = energies(&mesh.positions, &koiter(&mesh, &sheet, &[])[1..], sheet.poisson).map(|x| x / rigidity);
        let of_paper = energies(&mesh.positions, &discrete_shell(&mesh, &hinges), -1.0 / 3.0);
        let row = own.iter().chain(&of_paper).map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" | ");
        println!("| {} | {n} | {row} |", name(family));
    }
    println!(
        "\nA triangle at a free edge knows its bend in part, so that a cylinder lacks what halves with the cells. Its frequencies and deflections do not: the plates above.\n"
    );
}

const LENGTH: f64 = 4.0;

/// A tube of radius 1, held at one end and pulled at the other: `pull` is the force a length there, `seen` what is looked at, by the angle.
fn tube(family: Family, n: usize, pull: impl Fn(f64) -> Vec3, seen: impl Fn(f64) -> Vec3) -> Problem {
    let (flat, triangles) = closed(rectangle(family, 4 * n, 2.0 * PI, LENGTH), 2.0 * PI);
    let positions: Vec<Vec3> = flat.iter().map(|x| Vec3::new(x.x.sin(), x.y, x.x.cos())).collect();
    let ends = |v: &usize, at: f64| (flat[*v].y - at).abs() < 1e-9;
    let stays = (0..flat.len()).filter(|v| ends(v, 0.0)).flat_map(|v| [3 * v, 3 * v + 1, 3 * v + 2]).collect();
    let rim: Vec<usize> = (0..flat.len()).filter(|v| ends(v, LENGTH)).collect();
    let share = 2.0 * PI / rim.len() as f64; // a family's rims are even
    let mut load = vec![Vec3::zeros(); flat.len()];
    rim.iter().for_each(|v| load[*v] = share * pull(flat[*v].x));
    let seen = rim.iter().map(|v| (*v, seen(flat[*v].x) / rim.len() as f64)).collect();
    Problem { sheet: (positions, triangles), load, stays, seen }
}

fn tubes() {
    println!("## A tube that is bent and twisted\n");
    println!(
        "Displacement of the end of a tube over the closed form's, linear: radius 1, 4 long, 0.01 thick, held at the other end. Bent by an end moment M of axial forces that go as the"
    );
    println!(
        "height, ν = 0: M L²/(2 E I), I = π r³ h; twisted by a torque T, ν = 0.3: the turn T L/(G J), J = 2 π r³ h. Cells are along a quarter of the circle. The paper's constants are as in"
    );
    println!("the obstacle course.\n");
    println!("| mesh | cells | bent | twisted | the paper's bent | twisted |\n|---|---|---|---|---|---|");
    let sheet = |poisson: f64| ElasticSheet { young: 1.0, poisson, thickness: 0.01, volume_density: 1.0 };
    for (family, n) in FAMILIES.into_iter().flat_map(|family| [4, 8, 16].map(|n| (family, n))) {
        // Axial forces cos θ have the moment π about x, and lift the end along −z; tangential forces 1 the torque 2π about y.
        let tangent = |angle: f64| Vec3::new(angle.cos(), 0.0, -angle.sin());
        let bent = tube(family, n, |angle| angle.cos() * Vec3::y(), |_| -Vec3::z());
        let turned = tube(family, n, tangent, tangent);
        let closed_forms = [LENGTH * LENGTH / (2.0 * 0.01), LENGTH / (0.01 / 2.6)];
        let mut row = [vec![], vec![]];
        for (problem, sheet, exact) in [(bent, sheet(0.0), closed_forms[0]), (turned, sheet(0.3), closed_forms[1])] {
            let mesh = Mesh::new(problem.sheet.0.clone(), &problem.sheet.1).expect("it is a manifold");
            let energies = [koiter(&mesh, &sheet, &[]), discrete_shell(&mesh, &paper(&mesh, &sheet))];
            for (cells, energy) in row.iter_mut().zip(&energies) {
                cells.push(format!("{:.3}", solved(&problem, energy) / exact));
            }
        }
        println!("| {} | {n} | {} | {} |", name(family), row[0].join(" | "), row[1].join(" | "));
    }
    println!();
}

/// Prints the sections.
pub fn print() {
    shapes();
    tubes();
}

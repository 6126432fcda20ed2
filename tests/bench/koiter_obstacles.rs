//! The linear obstacle course: a roof, a pinched hemisphere and a pinched cylinder, solved by the energies' rest Hessian.
//!
//! Belytschko and others, "Stress projection for membrane and shear locking in shell finite elements" (1985), put these three together.
//! Here diaphragms and what holds a body without a force are single coordinates that stay.

use super::plates::{FAMILIES, Family, Sheet, closed, rectangle};
use super::{Material, Mesh, Vec3, name};
use faer::prelude::*;
use faer::sparse::{SparseColMat, Triplet};
use shellwarp::energy::{Curvature, Energy, discrete_shell, koiter};
use shellwarp::material::ElasticSheet;
use std::f64::consts::PI;

/// A shell, its loads (n_vertices), the coordinates that stay, and where it is looked at along which direction.
pub struct Problem {
    pub sheet: Sheet,
    pub load: Vec<Vec3>,
    pub stays: Vec<usize>,
    pub seen: Vec<(usize, Vec3)>,
}

fn nearest(x: &[Vec3], to: Vec3) -> usize {
    (0..x.len()).min_by(|i, j| (x[*i] - to).norm().total_cmp(&(x[*j] - to).norm())).expect("there are vertices")
}

/// Scordelis and Lo: 50 long, radius 25, 80 degrees, on diaphragms, under 90 an area. The middle of a free edge sinks by 0.3024.
pub fn roof(family: Family, n: usize) -> Problem {
    let (radius, length, half) = (25.0, 50.0, 40.0 * PI / 180.0);
    let (flat, triangles) = rectangle(family, n, 2.0 * half * radius, length);
    let lift = |x: &Vec3| {
        let angle = x.x / radius - half;
        Vec3::new(radius * angle.sin(), x.y, radius * angle.cos())
    };
    let positions: Vec<Vec3> = flat.iter().map(lift).collect();
    let mesh = Mesh::new(positions.clone(), &triangles).expect("it is a manifold");
    let mut load = vec![Vec3::zeros(); flat.len()];
    for (t, corners) in triangles.iter().enumerate() {
        corners.iter().for_each(|v| load[*v as usize].z -= 90.0 / 3.0 * mesh.area(t));
    }
    let at_end = |v: &usize| flat[*v].y < 1e-9 || flat[*v].y > length - 1e-9;
    let mut stays: Vec<usize> = (0..flat.len()).filter(at_end).flat_map(|v| [3 * v, 3 * v + 2]).collect();
    stays.push(3 * nearest(&flat, Vec3::new(half * radius, 0.5 * length, 0.0)) + 1);
    let edges = [0.0, 2.0 * half * radius].map(|x| nearest(&flat, Vec3::new(x, 0.5 * length, 0.0)));
    Problem { sheet: (positions, triangles), load, stays, seen: edges.map(|v| (v, -0.5 * Vec3::z())).to_vec() }
}

/// Radius 10, a hole of 18 degrees, pulled out by 2 and pushed in by 2 at four points: each moves by 0.0924.
pub fn hemisphere(family: Family, n: usize) -> Problem {
    let radius = 10.0;
    let (flat, triangles) = closed(rectangle(family, 4 * n, 2.0 * PI, 72.0 * PI / 180.0), 2.0 * PI);
    let place = |x: &Vec3| radius * Vec3::new(x.y.cos() * x.x.cos(), x.y.cos() * x.x.sin(), x.y.sin());
    let positions: Vec<Vec3> = flat.iter().map(place).collect();
    let mut load = vec![Vec3::zeros(); flat.len()];
    let mut seen = vec![];
    for (k, sign) in [1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
        let direction = [Vec3::x(), Vec3::y(), -Vec3::x(), -Vec3::y()][k];
        let v = nearest(&positions, radius * direction);
        load[v] = 2.0 * sign * direction;
        seen.push((v, 0.25 * sign * direction));
    }
    let [a, b, c] = [seen[0].0, seen[1].0, seen[2].0];
    Problem {
        sheet: (positions, triangles),
        load,
        stays: vec![3 * a + 1, 3 * c + 1, 3 * b, 3 * a + 2, 3 * b + 2, 3 * c + 2],
        seen,
    }
}

/// Radius 100, 200 long, on diaphragms, pinched by 1 at two points: E h w = 164.24.
pub fn cylinder(family: Family, n: usize) -> Problem {
    let (radius, length) = (100.0, 200.0);
    let around = 2.0 * PI * radius;
    let (flat, triangles) = closed(rectangle(family, 4 * n, around, length), around);
    let place = |x: &Vec3| Vec3::new(radius * (x.x / radius).sin(), x.y, radius * (x.x / radius).cos());
    let positions: Vec<Vec3> = flat.iter().map(place).collect();
    let mut load = vec![Vec3::zeros(); flat.len()];
    let ends =
        [1.0, -1.0].map(|side| (nearest(&positions, Vec3::new(0.0, 0.5 * length, side * radius)), -side * Vec3::z()));
    ends.iter().for_each(|(v, force)| load[*v] = *force);
    let at_end = |v: &usize| flat[*v].y < 1e-9 || flat[*v].y > length - 1e-9;
    let mut stays: Vec<usize> = (0..flat.len()).filter(at_end).flat_map(|v| [3 * v, 3 * v + 2]).collect();
    stays.push(3 * ends[1].0 + 1);
    Problem { sheet: (positions, triangles), load, stays, seen: ends.map(|(v, force)| (v, 0.5 * force)).to_vec() }
}

/// Displacement along what is looked at.
pub fn solved(problem: &Problem, terms: &Vec<Box<dyn Energy>>) -> f64 {
    let n = 3 * problem.load.len();
    let mut number = vec![usize::MAX; n];
    let mut free = 0;
    for (i, number) in number.iter_mut().enumerate() {
        if problem.stays.contains(&i) {
            continue;
        }
        (*number, free) = (free, free + 1);
    }
    let mut triplets = vec![];
    terms.visit_hessian(&problem.sheet.0, Curvature::Exact, &mut |(vertices, blocks)| {
        for (ij, block) in blocks.iter().enumerate() {
            let [i, j] = [ij / vertices.len(), ij % vertices.len()].map(|k| 3 * vertices[k] as usize);
            let entries = (0..9).map(|c| (number[i + c / 3], number[j + c % 3], block[(c / 3, c % 3)]));
            let free = entries.filter(|(i, j, _)| *i != usize::MAX && *j != usize::MAX);
            triplets.extend(free.map(|(i, j, x)| Triplet::new(i, j, x)));
        }
    });
    let matrix = SparseColMat::try_new_from_triplets(free, free, &triplets).expect("indices are in range");
    let mut right = Mat::<f64>::zeros(free, 1);
    for (i, k) in number.iter().enumerate().filter(|(_, k)| **k != usize::MAX) {
        right[(*k, 0)] = problem.load[i / 3][i % 3];
    }
    let found = matrix.sp_cholesky(faer::Side::Lower).map(|factors| factors.solve(&right));
    let Ok(found) = found else { return f64::NAN };
    let at = |i: usize| if number[i] == usize::MAX { 0.0 } else { found[(number[i], 0)] };
    problem.seen.iter().map(|(v, along)| (0..3).map(|c| along[c] * at(3 * v + c)).sum::<f64>()).sum()
}

/// The paper's constants that on equilateral triangles of the mesh's mean edge are this sheet's, but for Poisson's ratio.
pub fn paper(mesh: &Mesh, sheet: &ElasticSheet) -> Material {
    let length = |e: &shellwarp::mesh::Edge| {
        (mesh.positions[e.vertices[0] as usize] - mesh.positions[e.vertices[1] as usize]).norm()
    };
    let mean = mesh.edges.iter().map(length).sum::<f64>() / mesh.edges.len() as f64;
    let [stretch, bend] = sheet.stiffness();
    Material {
        k_area: 0.25 * stretch,
        k_length: 0.25 * 3f64.sqrt() * mean * stretch,
        k_bend: bend / 6.0,
        area_density: 1.0,
    }
}

/// Prints the section.
pub fn print() {
    println!("## The obstacle course\n");
    println!(
        "Displacement over the reference's, linear: Scordelis' and Lo's roof (0.3024), the hemisphere with a hole of 18 degrees, pinched at four points (0.0924), and the"
    );
    println!(
        "cylinder on diaphragms, pinched at two (164.24 over E h). Cells are along the roof's arc, and along a quarter of the others' circles. The paper's constants are"
    );
    println!(
        "of the cantilever below, by the mesh's mean edge; what they lack is the membrane of a mesh that is not equilateral, and Poisson's ratio.\n"
    );
    println!(
        "| mesh | cells | roof | hemisphere | cylinder | the paper's roof | hemisphere | cylinder |\n|---|---|---|---|---|---|---|---|"
    );
    type Make = fn(Family, usize) -> Problem;
    let problems: [(Make, ElasticSheet, f64); 3] = [
        (roof, ElasticSheet { young: 4.32e8, poisson: 0.0, thickness: 0.25, volume_density: 1.0 }, 0.3024),
        (hemisphere, ElasticSheet { young: 6.825e7, poisson: 0.3, thickness: 0.04, volume_density: 1.0 }, 0.0924),
        (cylinder, ElasticSheet { young: 3e4, poisson: 0.3, thickness: 1.0, volume_density: 1.0 }, 164.24 / 3e4),
    ];
    for (family, n) in FAMILIES.into_iter().flat_map(|family| [8, 16, 32].map(|n| (family, n))) {
        let mut row = [vec![], vec![]];
        for (make, sheet, reference) in problems {
            let problem = make(family, n);
            let mesh = Mesh::new(problem.sheet.0.clone(), &problem.sheet.1).expect("it is a manifold");
            let energies = [koiter(&mesh, &sheet, &[]), discrete_shell(&mesh, &paper(&mesh, &sheet))];
            for (cells, energy) in row.iter_mut().zip(&energies) {
                cells.push(format!("{:.3}", solved(&problem, energy) / reference));
            }
        }
        println!("| {} | {n} | {} | {} |", name(family), row[0].join(" | "), row[1].join(" | "));
    }
    println!();
}

//! Meshes, reference files and the one tolerance helper that the tests share.
#![allow(dead_code, missing_docs)] // each test file uses its own part

use shellwarp::mesh::Mesh;
use shellwarp::modes::{Modes, Progress, lowest_modes};
use shellwarp::reference::Solver;
use shellwarp::state::{Space, State};
use shellwarp::{Material, Shell, Supports, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

pub fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Vertices and triangles of a plain OBJ file.
pub fn read_obj(name: &str) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let text = std::fs::read_to_string(data("meshes").join(name)).unwrap();
    let mut positions = vec![];
    let mut triangles = vec![];
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let c: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
                positions.push(Vec3::new(c[0], c[1], c[2]));
            }
            Some("f") => {
                let v: Vec<u32> = words.map(|w| w.split('/').next().unwrap().parse::<u32>().unwrap() - 1).collect();
                triangles.push([v[0], v[1], v[2]]);
            }
            _ => {}
        }
    }
    (positions, triangles)
}

pub fn mesh(name: &str) -> Mesh {
    let (positions, triangles) = read_obj(name);
    Mesh::new(positions, &triangles).unwrap()
}

/// A reference case: shell and the numbers beside it.
pub fn reference(name: &str) -> (Shell, serde_json::Value) {
    let text = std::fs::read_to_string(data("reference").join(format!("{name}.json"))).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |key: &str| json[key].as_f64().unwrap();
    let material = Material {
        k_area: number("k_area"),
        k_length: number("k_length"),
        k_bend: number("k_bend"),
        area_density: number("area_density"),
    };
    let fixed = json["fixed_vertices"].as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as u32).collect();
    let supports = Supports { fixed, ..Default::default() };
    let shell = Shell::new(mesh(&format!("{name}.obj")), material, &supports).unwrap();
    (shell, json)
}

/// Rows of numbers of a reference CSV, comment and header lines skipped.
pub fn csv(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(data("reference").join(name)).unwrap();
    let lines = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    lines.map(|l| l.split(',').map(|w| w.parse().unwrap()).collect()).collect()
}

pub fn modes_of(shell: &Shell, wanted: usize) -> Modes {
    lowest_modes(shell, wanted, &mut Progress::new(&mut |_, _| Ok(()))).unwrap()
}

/// A flat near-equilateral sheet in the plane z = 0: `nx` columns of edge length `edge` along x, `ny` rows along y, rows
/// offset by half an edge and the ends cut straight (half triangles there).
pub fn equilateral_sheet(nx: usize, ny: usize, edge: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let height = edge * 3f64.sqrt() / 2.0;
    let mut positions = vec![];
    let mut rows: Vec<Vec<u32>> = vec![];
    for j in 0..=ny {
        let xs: Vec<f64> = if j % 2 == 0 {
            (0..=nx).map(|i| i as f64).collect()
        } else {
            std::iter::once(0.0).chain((0..nx).map(|i| i as f64 + 0.5)).chain(std::iter::once(nx as f64)).collect()
        };
        rows.push((0..xs.len()).map(|i| (positions.len() + i) as u32).collect());
        positions.extend(xs.iter().map(|x| Vec3::new(x * edge, j as f64 * height, 0.0)));
    }
    let mut triangles = vec![];
    for j in 0..ny {
        let (even, odd) = if j % 2 == 0 { (&rows[j], &rows[j + 1]) } else { (&rows[j + 1], &rows[j]) };
        let mut strip = vec![];
        for i in 0..=nx {
            strip.push([even[i], odd[i + 1], odd[i]]);
            if i < nx {
                strip.push([even[i], even[i + 1], odd[i + 1]]);
            }
        }
        let turn = |t: [u32; 3]| if j % 2 == 0 { t } else { [t[0], t[2], t[1]] };
        triangles.extend(strip.into_iter().map(turn));
    }
    (positions, triangles)
}

/// The `left` or `right` trouser leg of tests/scenes/character.toml, held at the waist: limp, so that its membrane carries the loads.
pub fn trouser_leg(side: &str) -> Shell {
    let mesh = mesh(&format!("character_leg_{side}.obj"));
    let fixed = (0..mesh.positions.len() as u32).filter(|v| mesh.positions[*v as usize].y > 86.0).collect();
    let material = Material { k_area: 1e5, k_length: 1e5, k_bend: 8000.0, area_density: 0.04 };
    Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// A pointed leaf, arched along and across, held at its stem: 472 vertices, or edges `fine` times as short.
pub fn leaf(fine: usize) -> Shell {
    leaf_of(30 * fine, 14 * fine)
}

/// The same of so many edges along and across it, about 15 to 7.
pub fn leaf_of(along: usize, across: usize) -> Shell {
    let (mut positions, triangles) = equilateral_sheet(along, across, 1.5 / along as f64);
    for x in &mut positions {
        let (s, width) = (x.x, 0.35 + 0.65 * (std::f64::consts::PI * x.x / 1.5).sin().max(0.0));
        let y = width * (x.y - 0.303);
        *x = Vec3::new(s, y, 0.25 * s * (1.5 - s) + 0.8 * y * y);
    }
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.06).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// ‖u − exact‖/‖exact‖, every vertex alike.
pub fn error(u: &[Vec3], exact: &[Vec3]) -> f64 {
    let square = |u: &mut dyn Iterator<Item = Vec3>| u.map(|u| u.norm_squared()).sum::<f64>();
    (square(&mut u.iter().zip(exact).map(|(u, v)| u - v)) / square(&mut exact.iter().copied())).sqrt()
}

/// ‖u − v‖_M/‖v‖_M.
pub fn mass_error(shell: &Shell, u: &[Vec3], v: &[Vec3]) -> f64 {
    let norm = |f: &dyn Fn(usize) -> Vec3| -> f64 {
        shell.mass.iter().enumerate().map(|(i, m)| m * f(i).norm_squared()).sum::<f64>().sqrt()
    };
    norm(&|i| u[i] - v[i]) / norm(&|i| v[i])
}

/// The tolerance helper: |actual − expected| ≤ relative · max(|expected|, scale).
#[track_caller]
pub fn assert_close(what: &str, actual: f64, expected: f64, relative: f64, scale: f64) {
    let error = (actual - expected).abs() / expected.abs().max(scale);
    assert!(
        error <= relative,
        "{what}: {actual:e} instead of {expected:e}, relative error {error:.2e} > {relative:.0e}"
    );
}

/// u of every vertex, in the frame.
pub fn displacements(state: &State) -> Vec<Vec3> {
    let rest = &state.model().shell.mesh.positions;
    let mut u = vec![Vec3::zeros(); rest.len()];
    state.positions(Space::Frame, |v, x| u[v] = x - rest[v]);
    u
}

/// Gravity along `direction` that moves the shell by `aim` sizes to first order.
pub fn gravity(shell: &Arc<Shell>, direction: [f64; 3], aim: f64) -> Vec<Vec3> {
    let forces = |g: f64| shell.mass.iter().map(|m| Vec3::from(direction) * (g * m)).collect::<Vec<_>>();
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let g = 1e-4; // moves the leaf by 1e-5 of its size: linear to that part
    let linear = Solver::new(shell.clone())
        .unwrap()
        .equilibrium(&rest, &forces(g), &Default::default(), &mut |_| Ok(()))
        .unwrap();
    let largest = linear.displacement.iter().map(|u| u.norm()).fold(0.0, f64::max);
    forces(g * aim * shell.mesh.size / largest)
}

/// The bytes with a checksum that is right again.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let body = bytes.len() - 8;
    let sum = xxhash_rust::xxh3::xxh3_64(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&sum);
    bytes
}

//! Meshes as careless exports and broken tools write them, each built here: refused with the fault named, or taken and moved.

use crate::common::*;
use shellwarp::mesh::{Kind, Mesh, Severity, check};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

/// Errors by kind, in order.
fn errors((positions, triangles): &Soup) -> Vec<Kind> {
    let found = check(positions, triangles).diagnostics;
    assert_eq!(
        found.iter().any(|d| d.kind.severity() == Severity::Error),
        Mesh::new(positions.clone(), triangles).is_err()
    );
    found.iter().map(|d| d.kind).filter(|kind| kind.severity() == Severity::Error).collect()
}

fn warnings((positions, triangles): &Soup) -> Vec<Kind> {
    let found = check(positions, triangles).diagnostics;
    found.iter().map(|d| d.kind).filter(|kind| kind.severity() == Severity::Warning).collect()
}

/// Rings of `around` vertices between two poles; a ball.
fn ball(rings: usize, around: usize) -> Soup {
    let mut positions = vec![Vec3::z()];
    for i in 1..=rings {
        let polar = std::f64::consts::PI * i as f64 / (rings + 1) as f64;
        for k in 0..around {
            let turn = std::f64::consts::TAU * k as f64 / around as f64;
            positions.push(Vec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()));
        }
    }
    positions.push(-Vec3::z());
    let at = |i: usize, k: usize| (1 + i * around + k % around) as u32;
    let mut triangles = vec![];
    for k in 0..around {
        triangles.push([0, at(0, k), at(0, k + 1)]);
        for i in 0..rings - 1 {
            triangles.push([at(i, k), at(i + 1, k), at(i + 1, k + 1)]);
            triangles.push([at(i, k), at(i + 1, k + 1), at(i, k + 1)]);
        }
        triangles.push([at(rings - 1, k), positions.len() as u32 - 1, at(rings - 1, k + 1)]);
    }
    (positions, triangles)
}

/// Positions after some frames of falling, held at the first vertices.
fn moved((positions, triangles): Soup) -> Vec<Vec3> {
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let supports = Supports { fixed: vec![0, 1, 2], ..Default::default() };
    let shell = Shell::new(mesh, Material::default(), &supports).unwrap();
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model, Method::Warp, Integrator::Exact).unwrap();
    state.set_gravity(-Vec3::y()).unwrap();
    (0..20).for_each(|_| state.step(1.0 / 30.0).unwrap());
    let mut x = vec![];
    state.positions(Space::World, |_, p| x.push(p));
    x
}

#[test]
fn a_closed_mesh_of_shuffled_orientation_moves_as_the_tidy_one() {
    let tidy = ball(6, 12);
    assert!(errors(&tidy).is_empty() && warnings(&tidy).is_empty());
    let mut shuffled = tidy.clone();
    (0..shuffled.1.len()).filter(|t| t * t % 7 < 3).for_each(|t| shuffled.1[t].swap(1, 2));
    assert!(errors(&shuffled).is_empty());
    assert!(warnings(&shuffled).iter().all(|kind| *kind == Kind::InconsistentOrientation));
    assert!(!warnings(&shuffled).is_empty());
    for (a, b) in moved(tidy).iter().zip(&moved(shuffled)) {
        // The same problem with its sums in another order: modes to 1e-10 of each other.
        assert!((a - b).norm() < 1e-8, "{a} {b}");
    }
}

#[test]
fn an_hourglass_is_refused_at_its_waist() {
    let (mut positions, mut triangles) = ball(3, 8);
    let n = positions.len() as u32 - 1; // the lower pole is the upper ball's
    let upper = positions.clone();
    positions.extend(upper[1..].iter().map(|p| p - 2.0 * Vec3::z()));
    let lowered = |v: u32| if v == 0 { n } else { n + v };
    triangles.extend(triangles.clone().into_iter().map(|t| t.map(lowered)));
    let found = check(&positions, &triangles);
    assert_eq!(errors(&(positions, triangles)), [Kind::NonManifoldVertex]);
    assert_eq!(found.first_error().unwrap().element, n);
}

#[test]
fn three_sheets_on_a_row_of_edges_are_refused_edge_by_edge() {
    let (mut positions, mut triangles) = equilateral_sheet(5, 2, 1.0);
    let spine: Vec<u32> = (0..6).collect(); // the first row
    let first = positions.len() as u32;
    for (sheet, direction) in [-Vec3::y(), Vec3::z()].into_iter().enumerate() {
        positions.extend(spine.iter().map(|v| positions[*v as usize] + direction).collect::<Vec<_>>());
        let at = |i: u32| first + 6 * sheet as u32 + i;
        triangles.extend(
            (0..5).flat_map(|i| [[spine[i as usize], spine[i as usize + 1], at(i)], [i + 1, at(i + 1), at(i)]]),
        );
    }
    assert_eq!(errors(&(positions, triangles)), [Kind::NonManifoldEdge; 5]);
}

#[test]
fn a_capsule_with_collapsed_poles_and_an_open_seam_is_located() {
    // As lathes write them: each pole a row of equal vertices, first and last column apart.
    let (rows, columns) = (5u32, 9u32);
    let mut soup: Soup = (vec![], vec![]);
    for i in 0..rows {
        for k in 0..columns {
            let polar = std::f64::consts::PI * f64::from(i) / f64::from(rows - 1);
            let turn = std::f64::consts::TAU * f64::from(k % (columns - 1)) / f64::from(columns - 1);
            let radius = if i == 0 || i == rows - 1 { 0.0 } else { polar.sin() };
            soup.0.push(Vec3::new(radius * turn.cos(), radius * turn.sin(), polar.cos()));
        }
    }
    for i in 0..rows - 1 {
        for k in 0..columns - 1 {
            let a = i * columns + k;
            soup.1.extend([[a, a + columns, a + columns + 1], [a, a + columns + 1, a + 1]]);
        }
    }
    assert_eq!(errors(&soup), vec![Kind::ZeroArea; 2 * 8]);
    assert_eq!(warnings(&soup), vec![Kind::CoincidentVertices; 2 * 8 + 3]);
}

#[test]
fn degenerate_triangles_are_named_for_what_they_are() {
    let corners = vec![Vec3::zeros(), Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0)];
    assert_eq!(errors(&(corners.clone(), vec![[0, 2, 3], [0, 0, 3]])), [Kind::RepeatedVertex]);
    assert_eq!(errors(&(corners.clone(), vec![[0, 2, 3], [0, 1, 3]])), [Kind::ZeroArea], "an edge of no length");
    assert_eq!(errors(&(corners.clone(), vec![[0, 2, 3], [2, 0, 6]])), [Kind::IndexOutOfRange]);
    let line = vec![Vec3::zeros(), Vec3::x(), Vec3::x() * 2.7];
    assert_eq!(errors(&(line, vec![[1, 0, 2]])), [Kind::ZeroArea]);
    assert_eq!(errors(&(corners, vec![[0, 2, 3], [3, 2, 0]])), [Kind::DuplicateTriangle]);
}

#[test]
fn two_sides_on_vertices_of_their_own_are_two_shells() {
    let (mut positions, mut triangles) = equilateral_sheet(3, 2, 0.5);
    let n = positions.len() as u32;
    positions.extend(positions.clone());
    triangles.extend(triangles.clone().into_iter().map(|[a, b, c]| [n + a, n + c, n + b]));
    let both = (positions, triangles);
    assert!(errors(&both).is_empty());
    assert_eq!(warnings(&both), vec![Kind::CoincidentVertices; n as usize]);
    let x = moved(both);
    assert!(x.iter().all(|p| p.iter().all(|c| c.is_finite())));
    let fall = x[n as usize] - x[0];
    assert!(fall.y < -0.1, "the second side is held by nothing and falls: {fall}");
}

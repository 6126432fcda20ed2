//! Every kind of mesh problem is found where it is, and what is only a warning is handled.

use crate::common::*;
use shellwarp::mesh::{Diagnostic, Kind, Mesh, Severity, check};
use shellwarp::{Material, Shell, Supports, Vec3};

fn points(coordinates: &[[f64; 3]]) -> Vec<Vec3> {
    coordinates.iter().map(|c| Vec3::from(*c)).collect()
}

fn square() -> Vec<Vec3> {
    points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 1.0]])
}

/// The only problem of a kind that the mesh must have.
#[track_caller]
fn only(positions: &[Vec3], triangles: &[[u32; 3]], kind: Kind) -> Diagnostic {
    let found = check(positions, triangles).diagnostics;
    let of_kind: Vec<_> = found.iter().filter(|d| d.kind == kind).collect();
    assert_eq!(of_kind.len(), 1, "{found:?}");
    let refused = Mesh::new(positions.to_vec(), triangles);
    assert_eq!(refused.is_err(), found.iter().any(|d| d.kind.severity() == Severity::Error));
    *of_kind[0]
}

#[test]
fn index_out_of_range_is_located() {
    let d = only(&square(), &[[0, 1, 2], [0, 2, 9]], Kind::IndexOutOfRange);
    assert_eq!((d.element, d.value[0]), (1, 9.0));
    assert_eq!(d.to_string(), "triangle 1 names vertex 9, which does not exist");
}

#[test]
fn repeated_vertex_is_located() {
    let d = only(&square(), &[[0, 1, 2], [0, 2, 2]], Kind::RepeatedVertex);
    assert_eq!((d.element, d.vertices[..3].to_vec()), (1, vec![0, 2, 2]));
}

#[test]
fn non_finite_coordinates_are_located() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut p = square();
        p[2].y = bad;
        assert_eq!(only(&p, &[[0, 1, 2], [0, 2, 3]], Kind::NonFiniteCoordinate).element, 2);
    }
}

#[test]
fn zero_area_is_found_at_any_size_and_place() {
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1e-160, 0.0), (1e150, 0.0), (1.0, 1e6)] {
        let line = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        let p: Vec<Vec3> = line.iter().map(|p| p * scale + Vec3::repeat(offset)).collect();
        let d = only(&p, &[[0, 1, 2], [2, 1, 3]], Kind::ZeroArea);
        assert_eq!(d.element, 0, "scale {scale}, offset {offset}");
    }
}

#[test]
fn needles_of_aspect_a_million_are_slivers_and_not_errors() {
    let p = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1e-6, 0.0]]);
    let d = only(&p, &[[0, 1, 2]], Kind::Sliver);
    // 4√3 · 0.5e-6 / (1 + 0.25 + 0.25)
    assert_close("quality", d.value[0], 4.0 * 3f64.sqrt() * 0.5e-6 / 1.5, 1e-9, 0.0);
}

#[test]
fn duplicate_triangles_are_found_in_any_rotation_and_orientation() {
    for repeat in [[1, 2, 0], [0, 2, 1]] {
        let d = only(&square(), &[[0, 1, 2], [0, 2, 3], repeat], Kind::DuplicateTriangle);
        assert_eq!((d.element, d.value[0]), (2, 0.0));
    }
}

#[test]
fn three_triangles_on_an_edge_are_found() {
    let d = only(&square(), &[[0, 1, 2], [0, 2, 3], [2, 0, 4]], Kind::NonManifoldEdge);
    assert_eq!((d.vertices[0], d.vertices[1], d.value[0]), (0, 2, 3.0));
}

#[test]
fn two_fans_on_a_vertex_are_found() {
    let p = points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    let d = only(&p, &[[0, 1, 2], [0, 3, 4]], Kind::NonManifoldVertex);
    assert_eq!((d.element, d.value[0]), (0, 2.0));
}

#[test]
fn a_moebius_strip_is_refused() {
    let n = 12;
    let p: Vec<Vec3> = (0..2 * n)
        .map(|i| {
            let angle = std::f64::consts::TAU * (i / 2) as f64 / n as f64;
            let side = if i % 2 == 0 { 0.3 } else { -0.3 };
            let radius = 1.0 + side * (angle / 2.0).cos();
            Vec3::new(radius * angle.cos(), radius * angle.sin(), side * (angle / 2.0).sin())
        })
        .collect();
    let mut triangles = vec![];
    for i in 0..n as u32 {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 == n as u32 { (1, 0) } else { (2 * i + 2, 2 * i + 3) };
        triangles.extend([[a, c, b], [b, c, d]]);
    }
    only(&p, &triangles, Kind::NotOrientable);
}

#[test]
fn the_smaller_party_is_turned_over() {
    let (p, mut t) = equilateral_sheet(6, 4, 1.0);
    let straight = Mesh::new(p.clone(), &t).unwrap();
    for k in [3, 11, 12] {
        t[k].swap(1, 2);
    }
    let found = check(&p, &t).diagnostics;
    let turned: Vec<u32> =
        found.iter().filter(|d| d.kind == Kind::InconsistentOrientation).map(|d| d.element).collect();
    assert_eq!(turned, [3, 11, 12]);
    let mesh = Mesh::new(p, &t).unwrap();
    assert_eq!(mesh.n_reoriented, 3);
    assert_eq!(mesh.triangles, straight.triangles);
}

#[test]
fn unreferenced_and_coincident_vertices_are_warnings() {
    let mut p = square();
    p.push(p[1]);
    let triangles = [[0, 1, 2], [0, 2, 3]];
    let found = check(&p, &triangles).diagnostics;
    let unreferenced: Vec<u32> =
        found.iter().filter(|d| d.kind == Kind::UnreferencedVertex).map(|d| d.element).collect();
    assert_eq!(unreferenced, [4, 5]);
    let twin = only(&p, &triangles, Kind::CoincidentVertices);
    assert_eq!((twin.element, twin.value[0]), (5, 1.0));
    let mesh = Mesh::new(p, &triangles).unwrap();
    assert_eq!((mesh.n_unreferenced, mesh.n_components), (2, 1));
}

#[test]
fn one_fault_does_not_hide_another() {
    let triangles = [[0, 1, 2], [0, 2, 9], [0, 2, 3], [1, 1, 2]];
    let found = check(&square(), &triangles).diagnostics;
    let kinds: Vec<Kind> = found.iter().map(|d| d.kind).collect();
    assert_eq!(kinds, [Kind::IndexOutOfRange, Kind::RepeatedVertex, Kind::UnreferencedVertex]);
}

#[test]
fn the_dinosaur_has_the_papers_counts() {
    let mesh = mesh("dinosaur.obj");
    assert_eq!((mesh.positions.len(), mesh.edges.len(), mesh.triangles.len()), (13_117, 38_948, 25_830));
    assert_eq!((mesh.edges.len() - mesh.n_interior_edges(), mesh.n_components), (406, 1));
}

#[test]
fn mass_and_area_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        // To rounding of a sum of 640 terms.
        assert_close("mass", shell.total_mass, json["total_mass"].as_f64().unwrap(), 1e-12, 0.0);
        assert_close("area", shell.total_area, json["rest_area"].as_f64().unwrap(), 1e-12, 0.0);
        assert_eq!(shell.mesh.edges.len(), 1008);
        assert_eq!(shell.mesh.n_interior_edges(), 912);
    }
}

#[test]
fn a_clamp_holds_the_neighbours_too() {
    let (p, t) = equilateral_sheet(6, 4, 1.0);
    let clamped = (0..p.len() as u32).filter(|&v| p[v as usize].x == 0.0).collect();
    let shell = Shell::new(Mesh::new(p, &t).unwrap(), Material::default(), &Supports { clamped, ..Default::default() })
        .unwrap();
    for (v, held) in shell.held.iter().enumerate() {
        assert_eq!(*held, shell.mesh.positions[v].x <= 1.0, "vertex {v} at {:?}", shell.mesh.positions[v]);
    }
}

#[test]
fn a_support_that_does_not_exist_is_named() {
    let mesh = Mesh::new(square(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let error = Supports { fixed: vec![1, 7], ..Default::default() }.held(&mesh).unwrap_err();
    assert_eq!(error.message, "fixed[1] is vertex 7, but the mesh has 5 vertices");
}

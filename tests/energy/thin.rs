//! Where a sheet is too thick for its curvature: cylinders and spheres, whose radius is known.

use crate::plates::*;
use shellwarp::energy::Thick;
use shellwarp::material::{Crease, ElasticSheet, Map, On, Quantity};
use shellwarp::shell::Make;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};

const RADIUS: f64 = 0.5;

fn sheet(thickness: f64) -> ElasticSheet {
    ElasticSheet { young: 1e6, poisson: 0.3, thickness, volume_density: 20.0 }
}

/// A metre wide, rolled about y.
fn rolled(family: Family) -> Sheet {
    let (mut positions, triangles) = rectangle(family, 24, 1.0, 0.6);
    positions.iter_mut().for_each(|x| {
        let (sin, cos) = (x.x / RADIUS).sin_cos();
        *x = Vec3::new(RADIUS * sin, x.y, RADIUS * (1.0 - cos));
    });
    (positions, triangles)
}

fn flat(family: Family) -> Sheet {
    rectangle(family, 24, 1.0, 0.6)
}

fn found(sheet: &Sheet, make: Make) -> Option<Thick> {
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
    Shell::made(mesh, make, &Supports::default()).unwrap().thick()
}

#[test]
fn a_cylinder_is_thick_from_a_tenth_of_its_radius_on() {
    for family in [Family::Equilateral, Family::Diagonal, Family::UnionJack] {
        let rolled = rolled(family);
        let all = rolled.1.len();
        // Angles of a polygon of 48 sides are larger than arcs by a thousandth; what is within is exact on regular meshes.
        assert_eq!(found(&rolled, Make::of(sheet(0.098 * RADIUS))), None, "{family:?}");
        let told = found(&rolled, Make::of(sheet(0.2 * RADIUS))).unwrap();
        println!("{family:?}: {told:?} of {all}");
        assert!((told.part / 0.2 - 1.0).abs() < 0.01, "{family:?}: {told:?}");
        assert!(told.count > all * 3 / 4, "{family:?}: {told:?} of {all}");
        assert_eq!(found(&flat(family), Make::of(sheet(1.0))), None, "{family:?}");
        assert_eq!(found(&rolled, Make::of(Material::default())), None, "the paper's material has no thickness");
    }
}

/// Seen: irregular triangles are up to a half off.
#[test]
fn an_irregular_cylinder_and_a_sphere_are_told_within_a_half() {
    let (mut positions, triangles) = jittered(24, 1.0, 0.6, 0.25);
    positions.iter_mut().for_each(|x| {
        let (sin, cos) = (x.x / RADIUS).sin_cos();
        *x = Vec3::new(RADIUS * sin, x.y, RADIUS * (1.0 - cos));
    });
    let ball = sphere(3);
    for (name, shape) in [("jittered", &(positions, triangles)), ("sphere", &ball)] {
        assert_eq!(found(shape, Make::of(sheet(0.065 * RADIUS))), None, "{name}");
        let told = found(shape, Make::of(sheet(0.2 * RADIUS))).unwrap();
        println!("{name}: {told:?}");
        assert!(told.part > 0.19 && told.part < 0.3, "{name}: {told:?}");
    }
}

/// An octahedron, cut finer and finer.
fn sphere(levels: usize) -> Sheet {
    let mut x: Vec<Vec3> = [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y(), Vec3::z(), -Vec3::z()].into();
    let mut t = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                x.push((x[a as usize] + x[b as usize]).normalize());
                x.len() as u32 - 1
            })
        };
        t = t
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (x.into_iter().map(|x| RADIUS * x).collect(), t)
}

#[test]
fn maps_creases_and_the_rest_shape_count() {
    let rolled = rolled(Family::Diagonal);
    let flat = flat(Family::Diagonal);
    // Thick at three triangles only.
    let values: Vec<f64> =
        (0..rolled.1.len()).map(|t| if [300, 301, 302].contains(&t) { 0.15 } else { 0.01 } * RADIUS).collect();
    let map = Map { quantity: Quantity::Thickness, on: On::Triangles, values };
    let told = found(&rolled, Make { maps: vec![map], ..Make::of(sheet(0.01)) }).unwrap();
    assert!(
        told.count == 3 && (300..303).contains(&told.triangle) && (told.part / 0.15 - 1.0).abs() < 0.01,
        "{told:?}"
    );
    // A flat sheet that rests rolled, and a rolled one that rests flat.
    let thick = sheet(0.2 * RADIUS);
    let to = |shape: &Sheet| Make { rest_shape: Some(shape.0.clone()), ..Make::of(thick) };
    assert_eq!(found(&flat, to(&rolled)), found(&rolled, Make::of(thick)));
    assert_eq!(found(&rolled, to(&flat)), None);
    // A sharp fold along the middle: of no radius, but as a crease it is none of the sheet's bending.
    let mut folded = flat.clone();
    folded.0.iter_mut().filter(|x| x.x > 0.5).for_each(|x| *x = Vec3::new(0.5, x.y, x.x - 0.5));
    let mesh = Mesh::new(folded.0.clone(), &folded.1).unwrap();
    let on = |v: &u32| (folded.0[*v as usize] - Vec3::new(0.5, folded.0[*v as usize].y, 0.0)).norm() < 1e-9;
    let edges = mesh.edges.iter().map(|edge| edge.vertices).filter(|ends| ends.iter().all(on));
    let creases: Vec<Crease> =
        edges.map(|vertices| Crease { vertices, factor: 0.5, angle: None, yield_angle: f64::INFINITY }).collect();
    let told = found(&folded, Make::of(sheet(0.01))).unwrap();
    assert_eq!(told.count, 2 * creases.len());
    assert_eq!(found(&folded, Make { creases, ..Make::of(sheet(0.01)) }), None);
}

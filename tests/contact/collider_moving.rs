//! Meshes that move as solids: exact distances, how far the surface came, and sweeps.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::collider::Solid;
use shellwarp::{ErrorKind, Vec3};

type Map = Box<dyn Fn(&Vec3) -> Vec3>;

fn still(mesh: &Mesh) -> Solid {
    Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap()
}

/// Spikes and dents in a sphere: edges and corners as sharp as they come.
fn star(rng: &mut StdRng) -> Mesh {
    let (positions, triangles) = sphere(2);
    (positions.iter().map(|x| x * rng.random_range(0.2..1.2)).collect(), triangles)
}

#[test]
fn distances_are_exact_and_signs_right_also_at_sharp_edges_and_in_dents() {
    let mut rng = StdRng::seed_from_u64(1);
    let shapes = [torus(0.7, 0.25, 32, 16), star(&mut rng), star(&mut rng), box_mesh(Vec3::new(0.8, 0.2, 0.5))];
    for mesh in shapes {
        let solid = still(&mesh);
        let mut inside = 0;
        for _ in 0..3000 {
            let p = random_point(&mut rng, 1.2);
            let (found, expected) = (solid.touch(&p).distance, exact_distance(&p, &mesh));
            assert!((found - expected).abs() < 1e-14, "{found} {expected} at {p:?}");
            inside += usize::from(found < 0.0);
        }
        assert!(inside > 50, "{inside}");
    }
}

#[test]
fn a_moving_box_is_the_box_at_all_sizes() {
    let half = Vec3::new(0.8, 0.2, 0.5);
    let (positions, triangles) = box_mesh(half);
    let mut rng = StdRng::seed_from_u64(2);
    for scale in [1.0, 1e-95, 1e95] {
        let solid = still(&(positions.iter().map(|x| x * scale).collect(), triangles.clone()));
        let exact = Solid::cuboid(half * scale).unwrap();
        for _ in 0..3000 {
            let p = random_point(&mut rng, 1.5) * scale;
            let (found, expected) = (solid.touch(&p), exact.touch(&p));
            assert!((found.distance - expected.distance).abs() < 1e-14 * scale, "{found:?} {expected:?} at {p:?}");
            let digits = 1e-14 / (expected.distance / scale).abs();
            assert!(
                expected.distance < 0.0 || (found.normal - expected.normal).norm() < digits,
                "{found:?} {expected:?}"
            );
        }
        assert!((solid.inner_radius() / scale - 0.2).abs() < 1e-14, "{}", solid.inner_radius());
        // On a side, an edge and a corner.
        for (p, normal) in [
            (Vec3::new(0.1, 0.2, 0.3), Vec3::y()),
            (Vec3::new(0.8, 0.2, 0.1), Vec3::new(1.0, 1.0, 0.0).normalize()),
            (half, Vec3::repeat(1.0).normalize()),
        ] {
            let touch = solid.touch(&(p * scale));
            assert!(
                touch.distance.abs() < 1e-15 * scale && (touch.normal - normal).norm() < 1e-12,
                "{touch:?} {normal:?}"
            );
        }
    }
}

#[test]
fn thickness_is_that_between_sides_that_face_each_other() {
    let radius = |mesh: Mesh| still(&mesh).inner_radius();
    // Facets cut a tube to 0.25 cos(π/32) cos(π/64) and less, a sphere by 3e-3 with sides of 0.15.
    let tube = radius(torus(0.7, 0.25, 64, 32));
    assert!(tube > 0.24 && tube < 0.2501, "{tube}");
    assert!((radius(sphere(4)) - 1.0).abs() < 5e-3);
    let spread = joined(sphere(2), moved(box_mesh(Vec3::new(1.0, 0.01, 1.0)), Vec3::new(0.0, 2.0, 0.0)));
    assert!((radius(spread) - 0.01).abs() < 1e-6);
}

#[test]
fn moving_distances_are_1_lipschitz_with_gradients_as_normals() {
    let mut rng = StdRng::seed_from_u64(3);
    let solid = still(&star(&mut rng));
    let mut off = 0;
    for _ in 0..10_000 {
        let p = random_point(&mut rng, 1.5);
        let q = p + random_point(&mut rng, 1.0) * 10f64.powi(-rng.random_range(0..6));
        let (a, b) = (solid.touch(&p), solid.touch(&q));
        assert!((a.distance - b.distance).abs() <= (p - q).norm() + 1e-14);
        assert!((a.normal.norm() - 1.0).abs() < 1e-12);
        let step = 1e-6;
        let along = |axis: usize, h: f64| solid.touch(&(p + h * Vec3::ith(axis, 1.0))).distance;
        let slope = Vec3::from_fn(|i, _| (along(i, step) - along(i, -step)) / (2.0 * step));
        // Curvature of 1/d next to an edge.
        off += usize::from(a.distance.abs() > 1e-3 && (slope - a.normal).norm() > 1e-5);
    }
    // Within 1e-6 of a place that is as near to two of 320 triangles: expected once in a thousand.
    assert!(off < 30, "{off}");
}

#[test]
fn the_slip_is_how_far_the_nearest_matter_came() {
    let mesh = torus(0.7, 0.25, 32, 16);
    let mut rng = StdRng::seed_from_u64(4);
    let turn = nalgebra::Rotation3::new(Vec3::new(0.1, -0.2, 0.3));
    let moves: [Map; 3] = [
        Box::new(|x| x + Vec3::new(0.1, 0.2, -0.3)),
        Box::new(move |x| turn * x),
        Box::new(|x| Vec3::new(1.2 * x.x + 0.1 * x.y, 0.9 * x.y, 1.1 * x.z - 0.2 * x.x)),
    ];
    for to in moves {
        let after: Vec<Vec3> = mesh.0.iter().map(&to).collect();
        let solid = Solid::moving_mesh(&mesh.0, &after, &mesh.1).unwrap();
        let mut updated = still(&mesh);
        updated.update(&after).unwrap();
        for _ in 0..1000 {
            let source = random_point(&mut rng, 1.0);
            let p = to(&source);
            let touch = solid.touch(&p);
            // The map is linear on a triangle: what is now at the foot was where its inverse has it.
            let foot = p - touch.distance * touch.normal;
            let slip = solid.slip(&p);
            assert!((to(&(foot - slip)) - foot).norm() < 1e-13, "{slip:?} at {foot:?}");
            assert!(
                (updated.slip(&p) - slip).norm() < 1e-14 && (updated.touch(&p).distance - touch.distance).abs() < 1e-15
            );
        }
        updated.update(&after).unwrap();
        assert!(updated.slip(&Vec3::x()).norm() == 0.0, "two equal shapes");
    }
}

#[test]
fn updates_and_touches_allocate_nothing_and_a_refused_update_changes_nothing() {
    let mesh = torus(0.7, 0.25, 32, 16);
    let mut solid = still(&mesh);
    let mut rng = StdRng::seed_from_u64(5);
    let bent: Vec<Vec3> = mesh.0.iter().map(|x| x + 0.2 * Vec3::new((3.0 * x.y).sin(), 0.0, x.x * x.x)).collect();
    let points: Vec<Vec3> = (0..300).map(|_| random_point(&mut rng, 1.0)).collect();
    let bent_mesh = (bent.clone(), mesh.1.clone());
    let exact: Vec<f64> = points.iter().map(|p| exact_distance(p, &bent_mesh)).collect();
    let allocated = allocation_counter::measure(|| {
        solid.update(&bent).unwrap();
        for (p, exact) in points.iter().zip(&exact) {
            assert!((solid.touch(p).distance - exact).abs() < 1e-14);
            let _ = (solid.slip(p), solid.first_touch(p, &-p, 0.02), solid.first_touch(p, &-p, -0.02));
        }
    });
    assert_eq!(allocated.count_total, 0);
    let ball = solid.bounds().unwrap();
    assert!(bent.iter().all(|x| (x - ball.center).norm() <= ball.radius));
    let before: Vec<_> = points.iter().map(|p| (solid.touch(p), solid.slip(p))).collect();
    let mut bad = mesh.0.clone();
    bad[7].y = f64::NAN;
    let message = solid.update(&bad).unwrap_err().message;
    assert!(message.contains("vertex 7") && message.contains("NaN"), "{message}");
    bad[7].y = 1e40;
    assert!(solid.update(&bad).unwrap_err().message.contains("1e40"));
    let message = solid.update(&bad[1..]).unwrap_err().message;
    assert!(message.contains("has 512 vertices; 511 positions"), "{message}");
    assert!(points.iter().zip(&before).all(|(p, before)| (solid.touch(p), solid.slip(p)) == *before));
    assert_eq!(Solid::plane().update(&mesh.0).unwrap_err().kind, ErrorKind::Unsupported);
    assert!(Solid::moving_mesh(&bad, &mesh.0, &mesh.1).unwrap_err().message.contains("1e40"));
}

#[test]
fn meshes_that_collapse_stay_finite() {
    let mesh = torus(0.7, 0.25, 16, 8);
    let mut solid = still(&mesh);
    let values = [0.0, -0.0, 1e-320, -1e-200, 0.3, -1e120, 1e150, f64::MAX, f64::INFINITY, f64::NAN];
    let shapes: [Map; 4] = [
        Box::new(|x| *x),
        Box::new(|x| Vec3::new(x.x, x.y, 0.0)),
        Box::new(|x| Vec3::new(x.x, 0.0, 0.0)),
        Box::new(|_| Vec3::zeros()),
    ];
    for shape in shapes {
        let now: Vec<Vec3> = mesh.0.iter().map(shape).collect();
        solid.update(&now).unwrap();
        for (x, y, z) in values.iter().flat_map(|x| values.iter().flat_map(move |y| values.map(|z| (*x, *y, z)))) {
            let p = Vec3::new(x, y, z);
            let touch = solid.touch(&p);
            assert!(touch.distance.is_finite() && (touch.normal.norm() - 1.0).abs() < 1e-12, "{touch:?} at {p:?}");
            assert!(solid.slip(&p).iter().all(|c| c.is_finite()));
            let _ = solid.first_touch(&p, &Vec3::zeros(), 0.1);
        }
    }
}

#[test]
fn a_sweep_meets_a_moving_mesh_first_where_samples_do_and_leaps_over_nothing() {
    let mut rng = StdRng::seed_from_u64(6);
    for mesh in [torus(0.7, 0.25, 32, 16), star(&mut rng)] {
        let solid = still(&mesh);
        let (mut met, mut missed) = (0, 0);
        for _ in 0..600 {
            let (from, to) = (random_point(&mut rng, 1.6), random_point(&mut rng, 1.6));
            let margin = rng.random_range(-0.1..0.2f64).max(if rng.random() { 0.0 } else { -1.0 });
            let gap = |share: f64| solid.touch(&(from + share * (to - from))).distance - margin;
            let first = (0..=2000).map(|i| i as f64 / 2000.0).find(|share| gap(*share) <= 0.0);
            // Exact outside; a margin inside counts as met within a millionth.
            let close = if margin < 0.0 { 4.1e-6 } else { 1e-13 };
            match solid.first_touch(&from, &to, margin) {
                None => {
                    missed += 1;
                    assert!(first.is_none_or(|share| share == 0.0), "{from:?} {to:?} {margin}: {first:?}");
                }
                Some((share, _)) => {
                    met += 1;
                    assert!(gap(share).abs() <= close, "{} at margin {margin}", gap(share));
                    assert!(first.is_none_or(|first| first > 0.0 && share <= first), "{share} {first:?}");
                    let before = (0..500).map(|i| gap(share * 0.999 * i as f64 / 500.0)).fold(f64::INFINITY, f64::min);
                    assert!(before > 0.0, "{from:?} {to:?}: {before} before {share}");
                }
            }
        }
        assert!(met > 100 && missed > 100, "{met} {missed}");
    }
    let wall = still(&box_mesh(Vec3::new(1.0, 1.0, 1e-7)));
    for length in [1.0, 1e3, 1e6] {
        let (from, to) = (Vec3::new(0.3, 0.2, 0.25 * length), Vec3::new(0.3, 0.2, -0.75 * length));
        let (share, _) = wall.first_touch(&from, &to, 0.0).unwrap();
        assert!((share - (0.25 - 1e-7 / length)).abs() < 1e-14, "{share}");
    }
}

#[test]
fn open_and_inverted_meshes_are_refused_and_hollows_are_not() {
    let refused = |mesh: Mesh| Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap_err().message;
    let (positions, triangles) = sphere(1);
    assert!(refused((positions.clone(), triangles[1..].to_vec())).contains("the mesh is open"));
    let whole = (positions, triangles);
    assert!(refused(inside_out(whole.clone())).contains("the mesh is inside out"));
    let apart = joined(whole.clone(), moved(inside_out(box_mesh(Vec3::repeat(0.2))), Vec3::repeat(2.0)));
    assert!(refused(apart).contains("a piece of the mesh is inside out"));
    let hollow = still(&joined(whole, inside_out(box_mesh(Vec3::repeat(0.2)))));
    assert!(
        (hollow.touch(&Vec3::zeros()).distance - 0.2).abs() < 1e-15 && hollow.touch(&Vec3::repeat(0.25)).distance < 0.0
    );
}

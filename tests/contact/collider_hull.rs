//! Convex hulls, against closed forms and distances by brute force.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::Solid;

fn random_ball(count: usize, rng: &mut StdRng) -> Vec<Vec3> {
    (0..).map(|_| random_point(rng, 1.0)).filter(|p| p.norm() < 1.0).take(count).collect()
}

/// By all planes through three of the points with no point beyond, all these triangles and no structure: the oracle.
fn brute_force(points: &[Vec3], p: &Vec3) -> f64 {
    let (mut over, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            for k in j + 1..points.len() {
                let [a, b, c] = [points[i], points[j], points[k]];
                let normal = (b - a).cross(&(c - a)).normalize();
                let heights = || points.iter().map(|q| normal.dot(&(q - a)));
                for normal in [normal, -normal] {
                    let highest = heights().map(|h| if normal.dot(&(b - a).cross(&(c - a))) > 0.0 { h } else { -h });
                    if highest.fold(f64::NEG_INFINITY, f64::max) < 1e-12 {
                        over = over.max(normal.dot(&(p - a)));
                        far = far.min(to_triangle(p, [&a, &b, &c]));
                    }
                }
            }
        }
    }
    if over <= 0.0 { over } else { far }
}

#[test]
fn the_hull_of_a_boxs_corners_and_points_on_its_sides_is_the_box() {
    let half = Vec3::new(0.8, 0.2, 0.5);
    let mut points = box_mesh(half).0;
    let mut rng = StdRng::seed_from_u64(1);
    for i in 0..300 {
        let mut p = random_point(&mut rng, 1.0).component_mul(&half);
        if i % 3 > 0 {
            let axis = rng.random_range(0..3);
            p[axis] = half[axis].copysign(p[axis]); // on a side; others are inside
        }
        points.push(p);
    }
    for scale in [1.0, 1e-90, 1e90] {
        let scaled: Vec<Vec3> = points.iter().map(|p| p * scale).collect();
        let (hull, exact) = (Solid::hull(&scaled).unwrap(), Solid::cuboid(half * scale).unwrap());
        for _ in 0..3000 {
            let p = random_point(&mut rng, 1.5) * scale;
            let (found, expected) = (hull.touch(&p), exact.touch(&p));
            assert!((found.distance - expected.distance).abs() < 1e-14 * scale, "{found:?} {expected:?} at {p:?}");
            // Distances of 1e-6 have ten digits; where two sides are as near, either may be taken.
            let two = expected.distance < 0.0 && (found.normal - expected.normal).norm() > 0.5;
            assert!(two || expected.distance.abs() < 1e-6 * scale || (found.normal - expected.normal).norm() < 1e-8);
        }
        // Its search ends within a part in a hundred.
        assert!((hull.inner_radius() / scale - 0.2).abs() < 2e-3, "{}", hull.inner_radius());
        let ball = hull.bounds().unwrap();
        assert!((ball.radius / (half.norm() * scale) - 1.0).abs() < 1e-12 && ball.center.norm() < 1e-12 * scale);
    }
}

#[test]
fn a_tetrahedrons_distances_are_those_of_its_faces_edges_and_corners() {
    let points = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
    let hull = Solid::hull(&points).unwrap();
    let d = |x: f64, y: f64, z: f64| hull.touch(&Vec3::new(x, y, z)).distance;
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}");
    close(d(-0.3, 0.2, 0.2), 0.3);
    close(d(-0.3, -0.4, 0.2), 0.5); // of the edge along z
    close(d(-0.1, -0.2, -0.2), 0.3); // of the corner
    close(d(0.6, 0.6, 0.6), 0.8 / 3f64.sqrt()); // of the slanted face
    close(d(0.1, 0.2, 0.3), -0.1);
    let radius = 1.0 / (3.0 + 3f64.sqrt()); // of the ball within
    assert!((hull.inner_radius() / radius - 1.0).abs() < 1e-2, "{} {radius}", hull.inner_radius());
}

#[test]
fn hulls_of_random_points_agree_with_brute_force_and_hold_all_points() {
    let mut rng = StdRng::seed_from_u64(2);
    for count in [4, 5, 8, 15, 25] {
        let points = random_ball(count, &mut rng);
        let hull = Solid::hull(&points).unwrap();
        for p in &points {
            assert!(hull.touch(p).distance < 1e-14, "{p:?} is outside");
        }
        for _ in 0..200 {
            let p = random_point(&mut rng, 1.5);
            let (found, expected) = (hull.touch(&p).distance, brute_force(&points, &p));
            assert!((found - expected).abs() < 1e-13, "{count}: {found} {expected} at {p:?}");
        }
    }
}

#[test]
fn hulls_are_convex_and_their_distances_1_lipschitz_with_gradients_as_normals() {
    let mut rng = StdRng::seed_from_u64(3);
    let hull = Solid::hull(&random_ball(150, &mut rng)).unwrap();
    let mut off = 0;
    for _ in 0..10_000 {
        let p = random_point(&mut rng, 1.6);
        let q = p + random_point(&mut rng, 1.0) * 10f64.powi(-rng.random_range(0..6));
        let (a, b) = (hull.touch(&p), hull.touch(&q));
        let way = q - p;
        assert!((a.distance - b.distance).abs() <= way.norm() + 1e-14);
        // Convex: above its tangent.
        assert!(b.distance >= a.distance + a.normal.dot(&way) - 1e-13, "{a:?} {b:?} {p:?} {q:?}");
        assert!((a.normal.norm() - 1.0).abs() < 1e-12);
        let step = 1e-6;
        let along = |axis: usize, h: f64| hull.touch(&(p + h * Vec3::ith(axis, 1.0))).distance;
        let slope = Vec3::from_fn(|i, _| (along(i, step) - along(i, -step)) / (2.0 * step));
        off += usize::from((slope - a.normal).norm() > 1e-5);
    }
    // Within 1e-6 of a plane between two faces' regions: a share of 1e-6 times the number of such planes, about 400.
    assert!(off < 20, "{off}");
}

#[test]
fn a_swept_point_meets_a_hull_first_where_samples_do() {
    let mut rng = StdRng::seed_from_u64(4);
    let hull = Solid::hull(&random_ball(60, &mut rng)).unwrap();
    let mut met = 0;
    for _ in 0..500 {
        let (from, to) = (random_point(&mut rng, 2.0), random_point(&mut rng, 2.0));
        let margin = rng.random_range(-0.1..0.1);
        let gap = |share: f64| hull.touch(&(from + share * (to - from))).distance - margin;
        let first = (0..=1000).map(|i| i as f64 / 1000.0).find(|share| gap(*share) <= 0.0);
        match hull.first_touch(&from, &to, margin) {
            None => assert!(first.is_none_or(|share| share == 0.0)),
            Some((share, _)) => {
                met += 1;
                assert!(gap(share).abs() < 1e-12 && first.is_none_or(|first| share <= first && first > 0.0));
            }
        }
    }
    assert!(met > 100, "{met}");
}

#[test]
fn points_without_a_body_and_too_many_are_refused_with_the_numbers() {
    let refused = |points: &[Vec3]| Solid::hull(points).unwrap_err().message;
    let mut rng = StdRng::seed_from_u64(5);
    assert!(refused(&[]).contains("0 points"));
    assert!(refused(&[Vec3::x(); 7]).contains("7 points is 0e0 large"), "{}", refused(&[Vec3::x(); 7]));
    let line: Vec<Vec3> = (0..9).map(|i| Vec3::new(1.0, 2.0, -0.5) * i as f64).collect();
    assert!(refused(&line).contains("on a line"), "{}", refused(&line));
    let (u, v) = (Vec3::new(1.0, 0.3, 0.2), Vec3::new(-0.2, 0.7, 0.4));
    let plane: Vec<Vec3> = (0..50).map(|_| rng.random_range(-1.0..1.0) * u + rng.random_range(-1.0..1.0) * v).collect();
    assert!(refused(&plane).contains("in a plane"), "{}", refused(&plane));
    let mut bad = random_ball(10, &mut rng);
    bad[3].z = f64::NAN;
    assert!(refused(&bad).contains("point 3 of the hull has the coordinate NaN"));
    bad[3].z = 1e101;
    assert!(refused(&bad).contains("1e101"));
    let round: Vec<Vec3> = random_ball(2000, &mut rng).iter().map(|p| p.normalize()).collect();
    assert!(refused(&round).contains("the limit is 512"), "{}", refused(&round));
}

#[test]
fn nearly_flat_and_nearly_coplanar_points_make_hulls_that_hold_them() {
    let mut rng = StdRng::seed_from_u64(6);
    for thickness in [1e-3, 1e-5, 1e-7] {
        // A plate whose points are off two planes by up to a thousandth of its thickness.
        let points: Vec<Vec3> = (0..100)
            .map(|i| {
                let height = thickness * (if i % 2 == 0 { 1.0 } else { -1.0 } + rng.random_range(-1e-3..1e-3));
                Vec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), height)
            })
            .collect();
        let hull = Solid::hull(&points).unwrap();
        for p in &points {
            assert!(hull.touch(p).distance <= 1e-11, "{thickness}: {}", hull.touch(p).distance);
        }
        let radius = hull.inner_radius();
        assert!(radius > 0.8 * thickness && radius < 1.001 * thickness, "{radius} of {thickness}");
    }
}

#[test]
fn touches_of_hulls_are_finite_whatever_the_point_and_allocate_nothing() {
    let values = [0.0, -0.0, 1e-320, -1e-200, 0.3, -1e120, 1e150, f64::MAX, f64::INFINITY, f64::NAN];
    let mut rng = StdRng::seed_from_u64(7);
    let points = random_ball(40, &mut rng);
    for scale in [1e-100, 1.0, 1e99] {
        let scaled: Vec<Vec3> = points.iter().map(|p| p * scale).collect();
        let (hull, again) = (Solid::hull(&scaled).unwrap(), Solid::hull(&scaled).unwrap());
        let allocated = allocation_counter::measure(|| {
            for (x, y, z) in values.iter().flat_map(|x| values.iter().flat_map(move |y| values.map(|z| (*x, *y, z)))) {
                let p = Vec3::new(x, y * scale, z);
                let touch = hull.touch(&p);
                assert!(touch.distance.is_finite() && (touch.normal.norm() - 1.0).abs() < 1e-12, "{touch:?} at {p:?}");
                assert_eq!(touch, again.touch(&p));
            }
        });
        assert_eq!(allocated.count_total, 0);
        let far = hull.touch(&Vec3::new(0.0, 0.0, 1e150)).distance;
        assert!((far / 1e150 - 1.0).abs() < 1e-12, "{far}");
    }
}

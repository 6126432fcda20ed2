//! Solids that shells touch: distances against closed forms, normals against differences, and swept points.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::Solid;

fn random_point(rng: &mut StdRng, reach: f64) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-reach..reach))
}

/// Each with a name, all about one unit large.
fn primitives() -> Vec<(&'static str, Solid)> {
    vec![
        ("plane", Solid::plane()),
        ("sphere", Solid::sphere(0.7).unwrap()),
        ("capsule", Solid::capsule(0.6, 0.3).unwrap()),
        ("capsule of no length", Solid::capsule(0.0, 0.5).unwrap()),
        ("box", Solid::cuboid(Vec3::new(0.8, 0.2, 0.5)).unwrap()),
    ]
}

/// Largest difference of the distance from the values at two random points of many, per length between them.
fn assert_lipschitz(name: &str, solid: &Solid, constant: f64, reach: f64, rng: &mut StdRng) {
    for _ in 0..20_000 {
        let p = random_point(rng, reach);
        let q = p + random_point(rng, 1.0) * 10f64.powi(-rng.random_range(0..6));
        let (a, b) = (solid.touch(&p).distance, solid.touch(&q).distance);
        let most = constant * (p - q).norm() + 1e-14; // rounding of distances about 1
        assert!((a - b).abs() <= most, "{name}: {a} at {p:?}, {b} at {q:?}");
    }
}

/// Normals of length 1 that are the distance's gradient; at all but `share` of random points, as there are edges where it jumps.
fn assert_gradient(name: &str, solid: &Solid, reach: f64, share: f64, rng: &mut StdRng) {
    const COUNT: usize = 4000;
    let step = 1e-6;
    let mut off = 0;
    for _ in 0..COUNT {
        let p = random_point(rng, reach);
        let touch = solid.touch(&p);
        assert!((touch.normal.norm() - 1.0).abs() < 1e-12, "{name}: {:?}", touch.normal);
        let along = |axis: usize, h: f64| solid.touch(&(p + h * Vec3::ith(axis, 1.0))).distance;
        let slope = Vec3::from_fn(|i, _| (along(i, step) - along(i, -step)) / (2.0 * step));
        // Rounding 1e-16 / 1e-6 and curvature times 1e-12 leave nine digits.
        off += usize::from((slope - touch.normal).norm() > 1e-6);
    }
    assert!(off as f64 <= share * COUNT as f64, "{name}: {off} of {COUNT} normals are not the gradient");
}

#[test]
fn distances_of_primitives_are_those_of_their_closed_forms() {
    let [plane, sphere, capsule, point, cuboid] = primitives().try_into().unwrap_or_else(|_| panic!());
    let d = |solid: &(&str, Solid), x: f64, y: f64, z: f64| solid.1.touch(&Vec3::new(x, y, z)).distance;
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}"); // one rounding of numbers below 1
    close(d(&plane, 3.0, -2.0, 0.25), 0.25);
    close(d(&sphere, 0.0, 0.6, 0.8), 0.3);
    close(d(&sphere, 0.0, 0.0, 0.0), -0.7);
    close(d(&capsule, 0.3, 0.4, 0.5), 0.2);
    close(d(&capsule, 0.0, 0.3, 1.0), 0.2);
    close(d(&capsule, 0.0, 0.0, 0.2), -0.3);
    close(d(&point, 0.0, 0.6, 0.8), 0.5);
    close(d(&cuboid, 1.1, 0.6, 0.1), 0.5); // from an edge: 0.3, 0.4
    close(d(&cuboid, 0.9, 0.4, 0.7), 0.3); // from a corner: 0.1, 0.2, 0.2
    close(d(&cuboid, 0.1, -0.15, 0.2), -0.05);
}

#[test]
fn a_box_is_as_near_as_its_nearest_sampled_point() {
    let half = Vec3::new(0.8, 0.2, 0.5);
    let solid = Solid::cuboid(half).unwrap();
    let mut rng = StdRng::seed_from_u64(1);
    for _ in 0..200 {
        let p = random_point(&mut rng, 1.5);
        let touch = solid.touch(&p);
        let foot = p - touch.distance * touch.normal;
        let on_surface = (foot.abs() - half).max().abs(); // of a point within the slabs
        assert!(on_surface < 1e-15, "{p:?}: its foot is {on_surface} off the surface");
        for _ in 0..50 {
            let mut q = random_point(&mut rng, 1.0).component_mul(&half);
            let axis = rng.random_range(0..3);
            q[axis] = half[axis].copysign(q[axis]);
            assert!((p - q).norm() >= touch.distance.abs() - 1e-15);
        }
    }
}

#[test]
fn normals_are_gradients_and_distances_change_by_no_more_than_the_way() {
    let mut rng = StdRng::seed_from_u64(2);
    for (name, solid) in primitives() {
        assert_lipschitz(name, &solid, 1.0, 2.0, &mut rng);
        // Within 1e-6 of an edge's bisector the difference sees both sides: a share of about 1e-6 of all points, so that none is met.
        assert_gradient(name, &solid, 2.0, 0.0, &mut rng);
    }
}

#[test]
fn touches_are_finite_whatever_the_point() {
    let values = [0.0, -0.0, 1e-320, -1e-200, 1.0, -1e150, f64::MAX, f64::MIN, f64::INFINITY, f64::NAN];
    for (name, solid) in primitives() {
        for x in values {
            for y in values {
                for z in values {
                    let touch = solid.touch(&Vec3::new(x, y, z));
                    assert!(touch.distance.is_finite(), "{name} at {x} {y} {z}: {touch:?}");
                    assert!((touch.normal.norm() - 1.0).abs() < 1e-12, "{name} at {x} {y} {z}: {touch:?}");
                }
            }
        }
    }
}

#[test]
fn all_of_a_solid_is_within_its_bounds() {
    let mut rng = StdRng::seed_from_u64(3);
    for (name, solid) in primitives() {
        let Some(ball) = solid.bounds() else {
            assert_eq!(name, "plane");
            continue;
        };
        let inside = (0..5000).map(|_| random_point(&mut rng, 1.2)).filter(|p| solid.touch(p).distance <= 0.0);
        let farthest = inside.map(|p| (p - ball.center).norm()).fold(0.0, f64::max);
        assert!(farthest > 0.5 * ball.radius && farthest <= ball.radius, "{name}: {farthest} of {}", ball.radius);
    }
}

#[test]
fn sizes_out_of_range_are_refused_by_name_and_number() {
    for bad in [0.0, -1.0, 1e-101, 1e101, f64::INFINITY, f64::NAN] {
        let number = format!("{bad:?}");
        let refused = |made: shellwarp::Result<Solid>, name: &str| {
            let message = made.unwrap_err().message;
            assert!(message.contains(name) && message.contains(&number), "{message}");
        };
        refused(Solid::sphere(bad), "the sphere's radius");
        refused(Solid::capsule(1.0, bad), "the capsule's radius");
        refused(Solid::cuboid(Vec3::new(1.0, bad, 1.0)), "half extent along y");
        if bad != 0.0 {
            refused(Solid::capsule(bad, 1.0), "the capsule's half length");
        }
    }
}

#[test]
fn a_swept_point_meets_a_thin_box_and_a_small_sphere_however_fast() {
    let wall = Solid::cuboid(Vec3::new(1.0, 1.0, 1e-7)).unwrap();
    let ball = Solid::sphere(1e-6).unwrap();
    for length in [1.0, 1e3, 1e6] {
        let (from, to) = (Vec3::new(0.3, 0.2, 0.25 * length), Vec3::new(0.3, 0.2, -0.75 * length));
        let (share, touch) = wall.first_touch(&from, &to, 0.0).unwrap();
        // Rounding of coordinates as large as the way.
        assert!((share - (0.25 - 1e-7 / length)).abs() < 1e-14 && touch.normal == Vec3::z(), "{share} {touch:?}");
        let (from, to) = (Vec3::new(-0.25 * length, 0.0, 0.0), Vec3::new(0.75 * length, 0.0, 0.0));
        let (share, touch) = ball.first_touch(&from, &to, 0.0).unwrap();
        assert!((share - (0.25 - 1e-6 / length)).abs() < 1e-14 && touch.normal == -Vec3::x(), "{share} {touch:?}");
    }
}

#[test]
fn a_swept_point_meets_a_sphere_where_the_quadratic_equation_says() {
    let mut rng = StdRng::seed_from_u64(4);
    let (radius, margin) = (0.7, 0.05);
    let ball = Solid::sphere(radius).unwrap();
    let mut met = 0;
    for _ in 0..10_000 {
        let (from, to) = (random_point(&mut rng, 2.0), random_point(&mut rng, 2.0));
        let way = to - from;
        // |from + t way|² = (radius + margin)²
        let (a, b) = (way.norm_squared(), from.dot(&way));
        let c = from.norm_squared() - (radius + margin) * (radius + margin);
        let root = (b * b - a * c).sqrt(); // NaN where it passes by
        let first = (-b - root) / a;
        let expected = (c > 0.0 && (0.0..=1.0).contains(&first)).then_some(first);
        let found = ball.first_touch(&from, &to, margin);
        assert_eq!(found.is_some(), expected.is_some(), "{from:?} {to:?}");
        if let (Some((share, touch)), Some(expected)) = (found, expected) {
            met += 1;
            // Where the way grazes, a distance within rounding is reached as far before as its root: 1e-7.
            assert!((share - expected).abs() < 1e-7, "{share} {expected}");
            assert!((touch.distance - margin).abs() < 1e-13);
        }
    }
    assert!(met > 500, "{met}");
}

#[test]
fn a_sweep_finds_the_first_place_that_samples_find() {
    let mut rng = StdRng::seed_from_u64(5);
    for (name, solid) in primitives() {
        let mut met = 0;
        for _ in 0..300 {
            let (from, to) = (random_point(&mut rng, 2.0), random_point(&mut rng, 2.0));
            let margin = rng.random_range(-0.1..0.1);
            let gap = |share: f64| solid.touch(&(from + share * (to - from))).distance - margin;
            let first = (0..=2000).map(|i| i as f64 / 2000.0).find(|share| gap(*share) <= 0.0);
            match (solid.first_touch(&from, &to, margin), first) {
                (None, found) => assert!(found.is_none_or(|share| share == 0.0), "{name}: {from:?} {to:?} {found:?}"),
                (Some((share, touch)), first) => {
                    met += 1;
                    assert!(gap(share).abs() < 1e-12 && touch.distance.is_finite(), "{name}: {}", gap(share));
                    // A way that touches less than a sample's length is not seen by samples.
                    assert!(first.is_none_or(|first| share <= first && first != 0.0), "{name}: {share} {first:?}");
                }
            }
        }
        assert!(met > 20, "{name}: {met}");
    }
}

#[test]
fn a_sweep_that_starts_within_or_leaves_or_is_not_finite_meets_nothing() {
    let ball = Solid::sphere(1.0).unwrap();
    let meets = |from: Vec3, to: Vec3, margin: f64| ball.first_touch(&from, &to, margin).is_some();
    let (x, zero) = (Vec3::x(), Vec3::zeros());
    assert!(meets(3.0 * x, zero, 0.1));
    assert!(!meets(3.0 * x, 2.0 * x, 0.1) && !meets(2.0 * x, 3.0 * x, 0.1) && !meets(2.0 * x, 2.0 * x, 0.1));
    assert!(!meets(zero, 3.0 * x, 0.0) && !meets(1.05 * x, zero, 0.1));
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        assert!(!meets(bad * x, zero, 0.0) && !meets(2.0 * x, bad * -x, 0.0) && !meets(3.0 * x, zero, -bad));
    }
}

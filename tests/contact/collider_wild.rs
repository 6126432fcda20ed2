//! Whatever points and triangles are given: an error, or a solid whose answers are finite.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::{GridOptions, Resolution, Solid, fit_capsule};

fn assert_finite(solid: &Solid, rng: &mut StdRng) {
    for scale in [1e-12, 0.1, 1.0, 3.0, 1e5] {
        let (p, q) = (random_point(rng, 1.0) * scale, random_point(rng, 1.0) * scale);
        let touch = solid.touch(&p);
        assert!(touch.distance.is_finite() && (touch.normal.norm() - 1.0).abs() < 1e-12, "{touch:?} at {p:?}");
        assert!(solid.slip(&p).iter().all(|c| c.is_finite()));
        if let Some((share, touch)) = solid.first_touch(&p, &q, 0.01 * scale) {
            assert!((0.0..=1.0).contains(&share) && touch.distance <= 0.011 * scale + 1e-3, "{share} {touch:?}");
        }
    }
    assert!(solid.inner_radius() > 0.0 && solid.bounds().is_some_and(|ball| ball.radius.is_finite()));
}

/// A closed mesh with some vertices moved, put together, or made numbers that are none, and triangles lost, doubled and turned.
fn spoilt(rng: &mut StdRng) -> Mesh {
    let mut mesh = match rng.random_range(0..3) {
        0 => box_mesh(Vec3::new(0.8, 0.2, 0.5)),
        1 => sphere(1),
        _ => torus(0.7, 0.25, 8, 6),
    };
    let (n, t) = (mesh.0.len(), mesh.1.len());
    for _ in 0..rng.random_range(0..6) {
        let (i, j) = (rng.random_range(0..n), rng.random_range(0..n));
        match rng.random_range(0..6) {
            0 => mesh.0[i] = mesh.0[j],
            1 => mesh.0[i] = random_point(rng, 1.0),
            2 => mesh.0[i] *= 10f64.powi(rng.random_range(-12..3)),
            3 => mesh.0[i].x = mesh.0[j].x,
            4 => mesh.0.iter_mut().for_each(|x| x.z = 0.25 * (4.0 * x.z).round()),
            _ => mesh.0[i] += 1e-9 * random_point(rng, 1.0),
        }
    }
    if rng.random_range(0..4) == 0 {
        let at = rng.random_range(0..t);
        match rng.random_range(0..5) {
            0 => mesh.0[rng.random_range(0..n)].y = [f64::NAN, f64::INFINITY, 1e300, 1e101][rng.random_range(0..4)],
            1 => drop(mesh.1.remove(at)),
            2 => mesh.1.push(mesh.1[at]),
            3 => mesh.1[at].swap(0, 1),
            _ => mesh.1[at][0] = rng.random_range(0..n as u32 + 1),
        }
    }
    mesh
}

#[test]
fn spoilt_meshes_are_refused_or_make_finite_solids() {
    let mut rng = StdRng::seed_from_u64(1);
    let options = GridOptions { resolution: Resolution::Cells(10), ..GridOptions::default() };
    let (mut made, mut refused) = (0, 0);
    for _ in 0..600 {
        let mesh = spoilt(&mut rng);
        let depth = [0.0, 1e-3, 0.5, 10.0][rng.random_range(0..4)];
        for solid in [
            Solid::grid(&mesh.0, &mesh.1, &options),
            Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1),
            Solid::one_sided_moving_mesh(&mesh.0, &mesh.0, &mesh.1, depth),
            Solid::one_sided_moving_mesh(&mesh.0, &mesh.0, &mesh.1[..mesh.1.len() / 2], depth),
            Solid::one_sided_grid(&mesh.0, &mesh.1[..mesh.1.len() / 2], depth.min(0.5), &options),
        ] {
            match solid {
                Ok(solid) => {
                    assert_finite(&solid, &mut rng);
                    made += 1;
                }
                Err(error) => {
                    assert!(error.message.len() > 20, "{}", error.message);
                    refused += 1;
                }
            }
        }
    }
    assert!(made > 400 && refused > 100, "{made} {refused}");
}

#[test]
fn thousands_of_bubbles_in_a_box_are_hollows() {
    let mut mesh = box_mesh(Vec3::repeat(1.0));
    let bubble = inside_out(box_mesh(Vec3::repeat(0.02)));
    let place =
        |i: usize| Vec3::new((i % 13) as f64, (i / 13 % 13) as f64, (i / 169) as f64) * 0.14 - Vec3::repeat(0.84);
    for i in 0..13 * 13 * 13 {
        mesh = joined(mesh, moved(bubble.clone(), place(i)));
    }
    let solid = Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap();
    let at = |offset: f64| solid.touch(&(place(1000) + Vec3::repeat(offset))).distance;
    assert!((at(0.0) - 0.02).abs() < 1e-14 && at(0.05) < 0.0, "{} {}", at(0.0), at(0.05));
    mesh.1.drain(..12); // the box
    assert!(Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap_err().message.contains("inside out"));
}

#[test]
fn any_points_are_refused_or_have_a_finite_hull_that_holds_them_and_a_capsule() {
    let mut rng = StdRng::seed_from_u64(2);
    let mut made = 0;
    for _ in 0..1200 {
        let count = rng.random_range(0..25);
        let stretch = Vec3::from_fn(|_, _| 10f64.powi(rng.random_range(-13..2)));
        // On a coarse lattice many are at one place, on a line or in a plane.
        let lattice = rng.random::<bool>();
        let points: Vec<Vec3> = (0..count)
            .map(|_| random_point(&mut rng, 2.0).map(|c| if lattice { c.round() } else { c }).component_mul(&stretch))
            .collect();
        let size = points.iter().map(|p| p.amax()).fold(0.0, f64::max);
        if let Ok(hull) = Solid::hull(&points) {
            made += 1;
            assert_finite(&hull, &mut rng);
            for p in &points {
                let out = hull.touch(p).distance;
                assert!(out <= 2e-5 * size, "{out} of {size}: {points:?}");
            }
        }
        if let Ok((pose, half_length, radius)) = fit_capsule(&points) {
            let capsule = Solid::capsule(half_length, radius).unwrap();
            for p in &points {
                let out = capsule.touch(&(pose.rotation.inverse() * (p - pose.origin))).distance;
                assert!(out <= 0.0, "{out} of {size}: {points:?}");
            }
        }
    }
    assert!(made > 300, "{made}");
}

#[test]
fn touches_within_a_reach_are_the_touches_that_are_within_it() {
    let mut rng = StdRng::seed_from_u64(3);
    let mesh = torus(0.7, 0.25, 24, 12);
    let points: Vec<Vec3> = (0..40).map(|_| random_point(&mut rng, 1.0)).collect();
    let solids = [
        Solid::plane(),
        Solid::sphere(0.6).unwrap(),
        Solid::hull(&points).unwrap(),
        Solid::grid(&mesh.0, &mesh.1, &GridOptions::default()).unwrap(),
        Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap(),
        Solid::one_sided_moving_mesh(&mesh.0, &mesh.0, &mesh.1[..300], 0.1).unwrap(),
        Solid::one_sided_grid(&mesh.0, &mesh.1[..300], 0.1, &GridOptions::default()).unwrap(),
    ];
    for solid in &solids {
        for _ in 0..2000 {
            let p = random_point(&mut rng, 1.0) * [1.0, 2.0, 1e9][rng.random_range(0..3)];
            let reach = rng.random_range(-0.2..0.5);
            let touch = solid.touch(&p);
            assert_eq!(solid.touch_within(&p, reach), (touch.distance <= reach).then_some(touch));
        }
    }
}

//! Saved solids: the same bits come back, and no bytes do harm.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::collider::{GridOptions, Resolution, Solid};
use shellwarp::{ErrorKind, Vec3};
use xxhash_rust::xxh3::xxh3_64;

/// One of each kind.
fn solids() -> Vec<Solid> {
    let mut rng = StdRng::seed_from_u64(1);
    let points: Vec<Vec3> = (0..30).map(|_| random_point(&mut rng, 1.0)).collect();
    let (positions, triangles) = torus(0.7, 0.25, 12, 8);
    let options = GridOptions { resolution: Resolution::Cells(8), ..GridOptions::default() };
    let shape = |t: f64| positions.iter().map(|x| x + t * Vec3::new(x.y * x.y, 0.1, x.x)).collect::<Vec<_>>();
    let mut moving = Solid::moving_mesh(&shape(0.0), &shape(0.1), &triangles).unwrap();
    moving.update(&shape(0.3)).unwrap();
    let half = &triangles[..triangles.len() / 2];
    let mut sheet = Solid::one_sided_moving_mesh(&shape(0.0), &shape(0.1), half, 0.1).unwrap();
    sheet.update(&shape(0.3)).unwrap();
    vec![
        Solid::plane(),
        Solid::sphere(0.7).unwrap(),
        Solid::capsule(0.0, 0.3).unwrap(),
        Solid::cuboid(Vec3::new(0.8, 0.2, 0.5)).unwrap(),
        Solid::hull(&points).unwrap(),
        Solid::grid(&positions, &triangles, &options).unwrap(),
        moving,
        sheet,
    ]
}

fn bits(x: &Vec3) -> [u64; 3] {
    x.map(f64::to_bits).into()
}

#[test]
fn every_kind_comes_back_to_the_same_bits() {
    let mut rng = StdRng::seed_from_u64(2);
    for solid in solids() {
        let saved = solid.save();
        let loaded = Solid::load(&saved).unwrap();
        assert_eq!(loaded.save(), saved);
        assert_eq!(loaded.bounds(), solid.bounds());
        assert_eq!(loaded.inner_radius().to_bits(), solid.inner_radius().to_bits());
        assert_eq!(loaded.surface_error().to_bits(), solid.surface_error().to_bits());
        for _ in 0..2000 {
            let (p, q) = (random_point(&mut rng, 1.3), random_point(&mut rng, 1.3));
            let (a, b) = (solid.touch(&p), loaded.touch(&p));
            assert!(a.distance.to_bits() == b.distance.to_bits() && bits(&a.normal) == bits(&b.normal), "{a:?} {b:?}");
            assert_eq!(bits(&solid.slip(&p)), bits(&loaded.slip(&p)));
            assert_eq!(solid.first_touch(&p, &q, 0.05), loaded.first_touch(&p, &q, 0.05));
        }
    }
}

#[test]
fn the_form_is_the_one_that_was_written_down() {
    // Magic, version 1, kind 3, half length and radius.
    let mut expected = b"SWSO\x01\0\x03\0".to_vec();
    expected.extend([0.5f64, 0.25].into_iter().flat_map(f64::to_le_bytes));
    expected.extend(xxh3_64(&expected).to_le_bytes());
    assert_eq!(Solid::capsule(0.5, 0.25).unwrap().save(), expected);
    // Plane, sphere, capsule, box, hull, grid, moving mesh, one that is one-sided.
    let kinds: Vec<u8> = solids().iter().map(|solid| solid.save()[6]).collect();
    assert_eq!(kinds, [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn a_loaded_mesh_moves_on_as_the_saved_one() {
    for mut solid in solids().into_iter().rev().take(2) {
        let mut loaded = Solid::load(&solid.save()).unwrap();
        let next: Vec<Vec3> = torus(0.6, 0.2, 12, 8).0;
        solid.update(&next).unwrap();
        loaded.update(&next).unwrap();
        let mut rng = StdRng::seed_from_u64(3);
        for _ in 0..500 {
            let p = random_point(&mut rng, 1.0);
            assert_eq!((solid.touch(&p), bits(&solid.slip(&p))), (loaded.touch(&p), bits(&loaded.slip(&p))));
        }
    }
}

#[test]
fn damaged_bytes_are_refused_and_foreign_ones_named() {
    let mut rng = StdRng::seed_from_u64(4);
    for solid in solids() {
        let saved = solid.save();
        let all = 8 * saved.len();
        // All bits of small ones, and many of large ones.
        for i in 0..all.min(4000) {
            let bit = if all <= 4000 { i } else { rng.random_range(0..all) };
            let mut damaged = saved.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Solid::load(&damaged).unwrap_err().kind, ErrorKind::InvalidData, "bit {bit}");
        }
        for _ in 0..200 {
            let damaged = &saved[..rng.random_range(0..saved.len())];
            assert_eq!(Solid::load(damaged).unwrap_err().kind, ErrorKind::InvalidData, "{} bytes", damaged.len());
        }
        let mut longer = saved.clone();
        longer.push(0);
        assert!(Solid::load(&longer).unwrap_err().message.contains("checksum"));
    }
    let told = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = Solid::sphere(1.0).unwrap().save();
        bytes.truncate(bytes.len() - 8);
        change(&mut bytes);
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        Solid::load(&bytes).unwrap_err().message
    };
    assert!(told(&|b| b[0] = b'X').contains("24 bytes are not a saved solid"));
    assert!(told(&|b| b[4] = 9).contains("version 9; this library reads 1"));
    assert!(told(&|b| b[6] = 99).contains("kind is 99"));
    assert!(told(&|b| b.push(1)).contains("mean nothing"));
    assert!(told(&|b| b.truncate(12)).contains("end too early"));
    assert!(told(&|b| b[8..].copy_from_slice(&f64::NAN.to_le_bytes())).contains("the sphere's radius is NaN"));
}

#[test]
fn forged_bytes_with_a_right_checksum_are_refused_or_stay_finite() {
    let mut rng = StdRng::seed_from_u64(5);
    let odd = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300, -1e300, 1e-300, 1e150, 1e101, 1e-104, 5.0];
    let (mut loaded, mut refused) = (0, 0);
    for solid in solids() {
        let saved = solid.save();
        for _ in 0..1500 {
            let mut forged = saved[..saved.len() - 8].to_vec();
            for _ in 0..rng.random_range(1..4) {
                if forged.len() <= 8 {
                    break;
                }
                // Bytes anywhere, at the front where sizes are, or whole numbers.
                let end = if rng.random() { forged.len() } else { forged.len().min(120) };
                let at = rng.random_range(8..end);
                if rng.random() {
                    forged[at] = rng.random();
                } else {
                    let number = odd[rng.random_range(0..odd.len())];
                    let whole = at.min(forged.len() - 8) / 4 * 4;
                    forged[whole..whole + 8].copy_from_slice(&number.to_le_bytes());
                }
            }
            forged.extend(xxh3_64(&forged).to_le_bytes());
            let Ok(found) = Solid::load(&forged) else {
                refused += 1;
                continue;
            };
            loaded += 1;
            let ball = found.bounds();
            assert!(
                ball.is_none_or(|ball| ball.center.norm().is_finite() && ball.radius.is_finite() && ball.radius >= 0.0)
            );
            assert!(found.inner_radius() > 0.0 && found.surface_error() >= 0.0);
            for scale in [1e-110, 1e-3, 1.0, 1e40, 1e150, f64::INFINITY] {
                let (p, q) = (random_point(&mut rng, 1.0) * scale, random_point(&mut rng, 1.0) * scale);
                let touch = found.touch(&p);
                assert!(touch.distance.is_finite(), "{touch:?} at {p:?} of {found:?}");
                assert!((touch.normal.norm() - 1.0).abs() < 1e-9, "{touch:?} at {p:?}");
                assert!(found.slip(&p).iter().all(|c| c.is_finite()));
                if let Some((share, touch)) = found.first_touch(&p, &q, 0.01) {
                    assert!((0.0..=1.0).contains(&share) && touch.distance.is_finite());
                }
            }
        }
    }
    assert!(loaded > 1000 && refused > 1000, "{loaded} {refused}");
}

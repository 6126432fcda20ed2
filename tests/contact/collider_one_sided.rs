//! Open meshes as solids behind their triangles: against boxes and balls, where the front is, and what comes round the rim.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::{GridOptions, Resolution, Solid};

/// Blender's plane: two triangles that look up.
fn quad() -> Mesh {
    let corner = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    (vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], vec![[0, 1, 2], [0, 2, 3]])
}

fn still(mesh: &Mesh, depth: f64) -> Solid {
    Solid::one_sided_moving_mesh(&mesh.0, &mesh.0, &mesh.1, depth).unwrap()
}

fn on_grid(mesh: &Mesh, depth: f64, cells: usize) -> Solid {
    let options = GridOptions { resolution: Resolution::Cells(cells), ..GridOptions::default() };
    Solid::one_sided_grid(&mesh.0, &mesh.1, depth, &options).unwrap()
}

/// Without the triangles of which all corners are so.
fn without((positions, triangles): Mesh, gone: impl Fn(&Vec3) -> bool) -> Mesh {
    let kept = triangles.into_iter().filter(|t| !t.iter().all(|v| gone(&positions[*v as usize]))).collect();
    (positions, kept)
}

/// A strip along y with a bend at x = 0 between wings of length 1 that rise or fall at this angle.
fn bent(angle: f64) -> Mesh {
    let (c, s) = (angle.cos(), angle.sin());
    let mut positions = vec![];
    for y in [-1.0, 1.0] {
        positions.extend([Vec3::new(-c, y, s), Vec3::new(0.0, y, 0.0), Vec3::new(c, y, s)]);
    }
    (positions, vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
}

#[test]
fn a_quad_of_two_triangles_is_the_box_under_it_at_all_sizes() {
    let mut rng = StdRng::seed_from_u64(1);
    for scale in [1.0, 1e-95, 1e95] {
        let depth = 0.3;
        let exact = Solid::cuboid(Vec3::new(1.0, 1.0, 0.5 * depth) * scale).unwrap();
        let up = Vec3::new(0.0, 0.0, 0.5 * depth) * scale;
        let (positions, triangles) = quad();
        let sheet = still(&(positions.iter().map(|x| scale * x).collect(), triangles), depth * scale);
        let (mut met, mut within) = (0, 0);
        for _ in 0..4000 {
            let p = random_point(&mut rng, 1.5).component_mul(&Vec3::new(1.0, 1.0, 0.5)) * scale;
            let (found, expected) = (sheet.touch(&p), exact.touch(&(p + up)));
            assert!((found.distance - expected.distance).abs() < 1e-14 * scale, "{found:?} {expected:?} at {p:?}");
            let digits = 1e-14 / (expected.distance / scale).abs();
            assert!(expected.distance < 0.0 || (found.normal - expected.normal).norm() < digits, "{p:?}");
            within += usize::from(found.distance < 0.0);
            // Also from behind, from beside, and round the rim.
            let q = random_point(&mut rng, 1.5) * scale;
            let margin = [0.0, 0.05, 0.5][rng.random_range(0..3)] * scale;
            let share = |touch: Option<(f64, _)>| touch.map(|(share, _)| share);
            let (found, expected) =
                (share(sheet.first_touch(&p, &q, margin)), share(exact.first_touch(&(p + up), &(q + up), margin)));
            met += usize::from(found.is_some());
            // A way that just grazes may count as there by 1e-6 of the size.
            let grazes = exact.first_touch(&(p + up), &(q + up), margin + 2e-6 * scale).is_some();
            match (found, expected) {
                (Some(a), Some(b)) => assert!((a - b).abs() < 1e-4, "{a} {b}: {p:?} {q:?} {margin}"),
                (None, None) => (),
                _ => assert!(grazes && expected.is_none(), "{found:?} {expected:?}: {p:?} {q:?} {margin}"),
            }
        }
        assert!(met > 500 && within > 300, "{met} {within}");
        assert!((sheet.inner_radius() / scale - 0.5 * depth).abs() < 1e-14);
    }
}

#[test]
fn a_box_that_lacks_a_side_is_the_whole_box_where_the_depth_fills_it() {
    let half = Vec3::new(0.8, 0.4, 0.5);
    let exact = Solid::cuboid(half).unwrap();
    let mut rng = StdRng::seed_from_u64(2);
    for (axis, sign) in [(0, 1.0), (1, -1.0), (2, -1.0)] {
        let solid = still(&without(box_mesh(half), |x| x[axis] * sign > 0.0), 2.0);
        for _ in 0..4000 {
            let p = random_point(&mut rng, 1.2);
            let (found, expected) = (solid.touch(&p).distance, exact.touch(&p).distance);
            assert!((found - expected).abs() < 1e-14, "{found} {expected} at {p:?}, {axis}");
        }
    }
}

#[test]
fn a_bowl_is_solid_on_the_side_that_its_triangles_turn_their_backs_to() {
    let bowl = without(sphere(4), |x| x.z > -1e-9);
    let mut rng = StdRng::seed_from_u64(3);
    // Facets of a sphere of 2048 triangles are up to 4e-3 inside of it. A grid rounds the crease in the middle by up to a fifth of a cell.
    let solids = [
        (still(&bowl, 0.2), 1.0, 4e-3),
        (on_grid(&bowl, 0.2, 64), 1.0, 4e-3 + 0.2 * 2.0 / 64.0),
        (still(&inside_out(bowl.clone()), 0.2), -1.0, 4e-3),
    ];
    for (solid, out, off) in &solids {
        let mut counts = [0; 3];
        for _ in 0..4000 {
            let p = random_point(&mut rng, 1.1);
            let (r, polar) = (p.norm(), p.z / p.norm());
            if polar > -0.4 {
                continue;
            }
            let front = out * (r - 1.0);
            let expected = if front > -0.1 { front } else { -0.2 - front };
            let found = solid.touch(&p).distance;
            // The rim is farther than what is expected.
            assert!((found - expected).abs() < *off, "{found} {expected} at {p:?}");
            counts[if found < 0.0 { 0 } else { 1 + usize::from(front < 0.0) }] += 1;
        }
        assert!(counts.iter().all(|n| *n > 50), "{counts:?}");
    }
}

#[test]
fn the_front_is_free_and_exact_however_sharp_a_sheet_is_bent() {
    let mut rng = StdRng::seed_from_u64(4);
    for angle in [-1.45, -1.2, -0.7, -0.1, 0.0, 0.1, 0.7, 1.2, 1.45] {
        let mesh = bent(angle);
        for (solid, off) in [(still(&mesh, 0.5), 1e-14), (on_grid(&mesh, 0.5, 32), 0.6 * 2.0 / 32.0)] {
            for _ in 0..2000 {
                let p = random_point(&mut rng, 0.9).component_mul(&Vec3::new(0.5, 1.0, 1.0));
                // In front of both wings where these rise, of one where they fall.
                let above = [-1.0, 1.0].map(|side| p.z * angle.cos() - side * p.x * angle.sin() > 0.0);
                let front = if angle > 0.0 { above == [true; 2] } else { above != [false; 2] };
                let to = |t: &[u32; 3]| to_triangle(&p, t.map(|v| &mesh.0[v as usize]));
                let expected = mesh.1.iter().map(to).fold(f64::INFINITY, f64::min);
                let found = solid.touch(&p).distance;
                if front && (off < 1e-9 || expected < 0.2) {
                    assert!(found > -off && (found - expected).abs() < off + 1e-9, "{found} {expected} {p:?} {angle}");
                } else if !front && expected < 0.2 {
                    assert!(found < off, "{found} at {p:?}, {angle}");
                }
            }
        }
    }
}

#[test]
fn distances_are_1_lipschitz_across_backs_and_nearly_so_across_bent_walls() {
    let mut rng = StdRng::seed_from_u64(5);
    let (bumpy, triangles) = sphere(3);
    let bumpy = bumpy.iter().map(|x| x * (1.0 + 0.2 * (5.0 * x.x).sin() * (4.0 * x.y).cos())).collect();
    let holed = without((bumpy, triangles), |x| x.z > 0.5);
    let wave = |x: f64, y: f64| Vec3::new(x, y, 0.15 * (4.0 * x).sin() * (3.0 * y).cos());
    let mut wavy = (vec![], vec![]);
    for i in 0..13u32 {
        for j in 0..13u32 {
            wavy.0.push(wave(f64::from(i) / 6.0 - 1.0, f64::from(j) / 6.0 - 1.0));
            if i < 12 && j < 12 {
                let [a, b, c, d] = [13 * i + j, 13 * (i + 1) + j, 13 * (i + 1) + j + 1, 13 * i + j + 1];
                wavy.1.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    // A wall has straight edges where the back is round: at a bend of 80° they are 6 % of the depth off. Of curved rims walls are cut off along straight
    // lines, too.
    let cases =
        [(quad(), 0.3, 0.0), (bent(-0.7), 0.4, 0.0), (bent(0.7), 0.4, 0.062), (holed, 0.12, 0.062), (wavy, 0.2, 0.062)];
    for (mesh, depth, share) in cases {
        let solid = still(&mesh, depth);
        let (mut worst, mut within) = (0.0f64, 0);
        for _ in 0..30_000 {
            let p = random_point(&mut rng, 1.3);
            let q = p + random_point(&mut rng, 1.0) * 10f64.powi(-rng.random_range(0..6));
            let (a, b) = (solid.touch(&p), solid.touch(&q));
            let steep = (a.distance - b.distance).abs() - (p - q).norm();
            worst = worst.max(steep);
            assert!((a.normal.norm() - 1.0).abs() < 1e-12);
            within += usize::from(a.distance < 0.0);
        }
        println!("{} triangles: {within} within, {worst:.1e} too steep", mesh.1.len());
        assert!(within > 100);
        assert!(worst < share * depth + 1e-13, "{worst}");
    }
}

#[test]
fn a_sheet_that_moves_is_the_sheet_where_it_is_and_takes_what_lies_on_it_along() {
    let mesh = bent(0.3);
    let turn = nalgebra::Rotation3::new(Vec3::new(0.1, -0.2, 0.3));
    let after: Vec<Vec3> = mesh.0.iter().map(|x| turn * x + Vec3::new(0.1, 0.2, 0.0)).collect();
    let mut moving = still(&mesh, 0.2);
    moving.update(&after).unwrap();
    assert!(moving.deforms());
    let there = still(&(after.clone(), mesh.1.clone()), 0.2);
    let mut rng = StdRng::seed_from_u64(6);
    for _ in 0..2000 {
        let p = random_point(&mut rng, 1.3);
        assert_eq!(moving.touch(&p), there.touch(&p));
        let source = Vec3::new(rng.random_range(-0.9..0.9), rng.random_range(-0.9..0.9), 0.0);
        let source = Vec3::new(source.x, source.y, source.x.abs() * 0.3f64.tan());
        let to = turn * source + Vec3::new(0.1, 0.2, 0.0);
        assert!((moving.slip(&to) - (to - source)).norm() < 1e-12);
    }
    moving.arrive();
    assert!(!moving.deforms() && moving.slip(&after[1]) == Vec3::zeros());
    let allocated = allocation_counter::measure(|| moving.update(&mesh.0).unwrap());
    assert_eq!(allocated.count_total, 0);
    let refused = moving.update(&mesh.0[1..]).unwrap_err().message;
    assert!(refused.contains("the moving mesh has 6 vertices; 5 positions were given"), "{refused}");
}

#[test]
fn a_closed_mesh_is_what_it_is_without_and_a_room_is_solid_about_it() {
    let mut rng = StdRng::seed_from_u64(7);
    let mesh = torus(0.7, 0.25, 24, 12);
    let grid = GridOptions { resolution: Resolution::Cells(24), ..GridOptions::default() };
    assert_eq!(still(&mesh, 0.01).save(), Solid::moving_mesh(&mesh.0, &mesh.0, &mesh.1).unwrap().save());
    assert_eq!(on_grid(&mesh, 0.0, 24).save(), Solid::grid(&mesh.0, &mesh.1, &grid).unwrap().save());
    let room = still(&inside_out(box_mesh(Vec3::repeat(1.0))), 0.5);
    for _ in 0..1000 {
        let p = random_point(&mut rng, 1.6);
        let out = p.map(|c| (c.abs() - 1.0).max(0.0)).norm();
        let expected = if out == 0.0 {
            1.0 - p.amax()
        } else if out < 0.25 {
            -out
        } else {
            out - 0.5
        };
        assert!((room.touch(&p).distance - expected).abs() < 1e-14);
    }
}

#[test]
fn seams_are_closed_and_triangles_that_are_turned_take_the_side_of_most() {
    // Two triangles that share no vertex, and a third that looks down.
    let (mut positions, _) = quad();
    positions.extend([positions[0], positions[2], Vec3::new(3.0, 0.0, 0.0)]);
    let mesh = (positions, vec![[0, 1, 2], [4, 5, 3], [1, 2, 6]]);
    let solid = still(&mesh, 0.2);
    for (x, y) in [(0.5, -0.5), (-0.5, 0.5), (1.5, 0.0), (0.0, 0.0)] {
        assert_eq!(solid.touch(&Vec3::new(x, y, 0.1)).distance, 0.1);
        assert!((solid.touch(&Vec3::new(x, y, -0.05)).distance + 0.05).abs() < 1e-15, "{x} {y}");
    }
}

#[test]
fn what_has_no_front_or_no_depth_is_refused_with_the_numbers() {
    let refused = |(positions, triangles): &Mesh, depth: f64| {
        Solid::one_sided_moving_mesh(positions, positions, triangles, depth).unwrap_err().message
    };
    let (mut positions, mut triangles) = quad();
    for depth in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(&quad(), depth).contains(&format!("the depth of the one-sided mesh is {depth:?}")));
    }
    assert!(refused(&quad(), 1e-9).contains("1e-9: it must be 0, or 1e-6 to 100 times its longest side of 2e0"));
    let grid = GridOptions { resolution: Resolution::Cells(10), ..GridOptions::default() };
    let thin = Solid::one_sided_grid(&positions, &triangles, 0.3, &grid).unwrap_err().message;
    assert!(
        thin.contains("the depth of the one-sided mesh is 0.3, and a cell of its grid 2e-1: take 2 cells"),
        "{thin}"
    );
    // A wall on the diagonal.
    positions.push(Vec3::new(0.0, 0.0, 1.0));
    triangles.push([0, 2, 4]);
    let (mesh, told) = ((positions, triangles), "3 triangles");
    assert!(refused(&mesh, 0.0).contains(told), "{}", refused(&mesh, 0.0));
}

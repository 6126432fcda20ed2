//! Meshes as grids of distances, against exact distances and closed forms.

use crate::collider_meshes::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::Vec3;
use shellwarp::collider::{GridOptions, Resolution, Solid};

fn grid(mesh: &Mesh, cells: usize) -> shellwarp::Result<Solid> {
    let options = GridOptions { resolution: Resolution::Cells(cells), ..GridOptions::default() };
    Solid::grid(&mesh.0, &mesh.1, &options)
}

const HALF: Vec3 = Vec3::new(0.8, 0.2, 0.5);
/// Of a box that long, in cells along it.
fn cell(cells: usize) -> f64 {
    2.0 * HALF.x / cells as f64
}

/// Random points of the mesh's box and two and a half cells around: where no value of the grid's outside is met.
fn points_about(mesh: &Mesh, h: f64, count: usize, rng: &mut StdRng) -> Vec<Vec3> {
    let reach = mesh.0.iter().fold(Vec3::zeros(), |most, x| most.sup(&x.abs())) + Vec3::repeat(2.5 * h);
    (0..count).map(|_| random_point(rng, 1.0).component_mul(&reach)).collect()
}

fn largest_error(solid: &Solid, points: &[Vec3], exact: impl Fn(&Vec3) -> f64) -> f64 {
    points.iter().map(|p| (solid.touch(p).distance - exact(p)).abs()).fold(0.0, f64::max)
}

#[test]
fn distances_of_a_torus_have_the_right_sign_and_are_off_by_a_small_share_of_a_cell() {
    let mesh = torus(0.7, 0.25, 48, 24);
    let mut rng = StdRng::seed_from_u64(1);
    for cells in [20, 50] {
        let (solid, h) = (grid(&mesh, cells).unwrap(), 1.9 / cells as f64);
        let mut inside = 0;
        for p in points_about(&mesh, h, 2000, &mut rng) {
            let (found, exact) = (solid.touch(&p).distance, exact_distance(&p, &mesh));
            inside += usize::from(exact < 0.0);
            // Means of values within 1.5 √3 cells, and 3/8 of second differences of at most 2: below 1.75 cells for any distance. At the circle in
            // the tube and the axis, the only deep creases, half of that in one or two of three axes.
            assert!((found - exact).abs() < 0.7 * h, "{found} for {exact} at {p:?}");
            if exact.abs() < 0.1 {
                // Within 0.15 of a surface whose least radius is 0.25, facets aside, there is no crease.
                assert!((found - exact).abs() < 0.06 * h, "{found} for {exact} at {p:?}");
            }
        }
        assert!(inside > 200 && inside < 1800, "{inside}");
        // Facets of 2π/24 and 2π/48 cut the tube to 0.25 cos(π/24) = 0.248 and less; the middle is found within a small share of a cell.
        let radius = solid.inner_radius();
        assert!((radius - 0.248).abs() < 0.15 * h, "{radius} in cells of {h}");
    }
}

#[test]
fn a_boxs_error_is_of_third_order_where_smooth_and_of_first_at_its_edges() {
    let (mesh, exact) = (box_mesh(HALF), Solid::cuboid(HALF).unwrap());
    let mut rng = StdRng::seed_from_u64(2);
    let (mut smooth, mut all) = (vec![], vec![]);
    for cells in [30, 60] {
        let h = cell(cells);
        let options = GridOptions { resolution: Resolution::Cells(cells), margin: 0.6, ..GridOptions::default() };
        let solid = Solid::grid(&mesh.0, &mesh.1, &options).unwrap();
        // Nearest to a corner: the distance to it is smooth, with a radius of curvature of 0.43 to 0.8.
        let points: Vec<Vec3> = (0..3000)
            .map(|_| {
                let off = Vec3::from_fn(|_, _| rng.random_range(0.25..0.45));
                (HALF + off).zip_map(&random_point(&mut rng, 1.0), f64::copysign)
            })
            .collect();
        smooth.push(largest_error(&solid, &points, |p| exact.touch(p).distance));
        let points = points_about(&mesh, h, 20_000, &mut rng);
        all.push(largest_error(&solid, &points, |p| exact.touch(p).distance) / h);
        // At a corner three right angles meet.
        assert!(solid.surface_error() < 0.4 * h, "{}", solid.surface_error() / h);
    }
    assert!((6.0..10.5).contains(&(smooth[0] / smooth[1])), "{smooth:?}"); // 2³, by random points
    assert!(all.iter().all(|error| (0.1..0.5).contains(error)), "{all:?}"); // in cells
}

#[test]
fn a_fine_spheres_grid_is_the_sphere() {
    let (solid, exact) = (grid(&sphere(5), 32).unwrap(), Solid::sphere(1.0).unwrap());
    let mut rng = StdRng::seed_from_u64(3);
    for _ in 0..5000 {
        let p = random_point(&mut rng, 1.1);
        let (found, expected) = (solid.touch(&p), exact.touch(&p));
        // A triangle of sides 0.07 and less is 8e-4 below the sphere at its middle. Farther than three cells, the triangle that is nearest to a
        // node around may be taken. At the centre there is a crease.
        let (tolerance, turn) = match expected.distance {
            d if d.abs() < 0.15 => (1e-3, 0.04),
            d if d > -0.7 => (0.05 / 16.0, 0.15),
            _ => (0.4 / 16.0, 2.0),
        };
        assert!((found.distance - expected.distance).abs() < tolerance, "{found:?} {expected:?}");
        assert!((found.normal - expected.normal).norm() < turn, "{found:?} {expected:?}");
    }
    let ball = solid.bounds().unwrap();
    assert!(ball.center.norm() < 1e-12 && (ball.radius - 1.0).abs() < 1e-12, "{ball:?}");
    assert!((solid.inner_radius() - 1.0).abs() < 0.3 / 16.0, "{}", solid.inner_radius());
}

#[test]
fn grids_have_continuous_values_and_gradients_and_a_bounded_slope() {
    let mut rng = StdRng::seed_from_u64(4);
    for (name, mesh) in [("box", box_mesh(HALF)), ("torus", torus(0.7, 0.25, 48, 24))] {
        let solid = grid(&mesh, 32).unwrap();
        let mut off = 0;
        for _ in 0..20_000 {
            let p = random_point(&mut rng, 1.6);
            let q = p + random_point(&mut rng, 1.0) * 10f64.powi(-rng.random_range(0..7));
            let (a, b) = (solid.touch(&p), solid.touch(&q));
            let way = (p - q).norm();
            assert!((a.distance - b.distance).abs() <= 1.4 * way + 1e-14, "{name}: {a:?} {b:?} {p:?} {q:?}");
            let step = 1e-6;
            let along = |axis: usize, h: f64| solid.touch(&(p + h * Vec3::ith(axis, 1.0))).distance;
            let slope = Vec3::from_fn(|i, _| (along(i, step) - along(i, -step)) / (2.0 * step));
            // A second derivative of up to 4/h = 80 jumps at most once within a step; deep inside gradients vanish.
            off += usize::from(slope.norm() > 0.1 && (slope.normalize() - a.normal).norm() > 2e-3);
            // The gradient turns no faster than the second derivative lets it: within the grid, where it is not small.
            let within = p.abs().max() < 0.6 * mesh.0[0].amax() && way < 1e-3 && slope.norm() > 0.5;
            assert!(!within || (a.normal - b.normal).norm() < 400.0 * way + 1e-12, "{name}: {a:?} {b:?} {way}");
        }
        // Steps across the grid's border, where the normal may jump: 1e-6 of 0.1, but for the box's flat sides.
        assert!(off <= 2, "{name}: {off} normals are not the gradient");
    }
}

#[test]
fn beyond_the_grid_the_distance_is_a_continuous_lower_bound() {
    let mesh = torus(0.7, 0.25, 48, 24);
    let solid = grid(&mesh, 24).unwrap();
    let h = 1.9 / 24.0;
    let mut rng = StdRng::seed_from_u64(5);
    for _ in 0..400 {
        let p = random_point(&mut rng, 1.0).normalize() * rng.random_range(1.5..30.0);
        let (found, exact) = (solid.touch(&p).distance, exact_distance(&p, &mesh));
        assert!(found <= exact + 0.1 * h && found > 0.7 * exact, "{found} {exact} at {p:?}");
        let mut last = solid.touch(&p).distance;
        for i in 1..=1000 {
            let next = solid.touch(&(p * (1.0 - 1e-3 * i as f64))).distance;
            assert!((next - last).abs() <= 2e-3 * p.norm(), "a jump from {last} to {next}");
            last = next;
        }
    }
}

#[test]
fn touches_of_grids_are_finite_whatever_the_point_and_size() {
    let values = [0.0, -0.0, 1e-320, -1e-200, 0.3, 1.0, -1e150, f64::MAX, f64::INFINITY, f64::NAN];
    for scale in [1e-100, 1e-30, 1.0, 1e99] {
        let (positions, triangles) = box_mesh(HALF);
        let mesh: Mesh = (positions.iter().map(|x| x * scale).collect(), triangles);
        let solid = grid(&mesh, 16).unwrap();
        let found = solid.touch(&(scale * Vec3::new(0.1, 0.35, 0.1))).distance / scale;
        assert!((found - 0.15).abs() < 0.01, "{scale}: {found}");
        for x in values {
            for y in values {
                for z in values.iter().flat_map(|z| [*z, z * scale]) {
                    let touch = solid.touch(&Vec3::new(x * scale, y, z));
                    assert!(touch.distance.is_finite() && (touch.normal.norm() - 1.0).abs() < 1e-12, "{touch:?}");
                }
            }
        }
    }
}

/// Rows of nodes run along x: one goes through a vertex, where three triangles of a side meet, and one along an edge.
#[test]
fn rows_of_nodes_through_vertices_and_along_edges_find_the_inside() {
    let half = Vec3::new(0.5, 0.3, 0.4);
    let (mut positions, mut triangles) = box_mesh(half);
    let cells = 16;
    let h = 1.0 / cells as f64;
    // As the grid places its nodes: the first is 5.618 cells from the box.
    let node = |low: f64, i: usize| (low - (4.618 + 1.0) * h) + h * i as f64;
    let (y, z) = (node(-half.y, 9), node(-half.z, 10));
    let right: Vec<[u32; 3]> = triangles.extract_if(.., |t| t.iter().all(|v| v & 1 == 1)).collect();
    positions.push(Vec3::new(half.x, y, z));
    let sides: Vec<[u32; 2]> = right.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
    let rim = sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a]));
    triangles.extend(rim.map(|[a, b]| [*a, *b, 8]));
    let solid = grid(&(positions, triangles), cells).unwrap();
    let exact = Solid::cuboid(half).unwrap();
    for i in 0..40 {
        for p in [Vec3::new(-0.7 + 0.035 * i as f64, y, z), Vec3::new(0.6, -0.4 + 0.02 * i as f64, z)] {
            let (found, expected) = (solid.touch(&p).distance, exact.touch(&p).distance);
            assert!((found - expected).abs() < 0.5 * h, "{found} {expected} at {p:?}");
        }
    }
}

fn refusal(mesh: &Mesh) -> String {
    grid(mesh, 16).unwrap_err().message
}

#[test]
fn meshes_without_an_inside_are_refused_with_the_place() {
    let (positions, triangles) = box_mesh(HALF);
    let open = (positions.clone(), triangles[1..].to_vec());
    let message = refusal(&open);
    assert!(message.contains("open") && message.contains("edge 0-4") && message.contains("3 such"), "{message}");
    let whole = (positions.clone(), triangles.clone());
    let message = refusal(&inside_out(whole.clone()));
    assert!(message.contains("inside out") && message.contains("-6.4"), "{message}"); // 1.6 · 0.4 · 1
    let message = refusal(&joined(whole.clone(), moved(inside_out(sphere(1)), Vec3::new(0.0, 1.9, 0.0))));
    assert!(message.contains("inside out"), "{message}");
    let mut three = whole.clone();
    three.0.push(Vec3::new(2.0, 0.0, 0.0));
    three.1.push([0, 4, 8]);
    assert!(refusal(&three).contains("edge 0-4 has 3 triangles"), "{}", refusal(&three));
    let flat = (positions[..4].to_vec(), vec![[0, 1, 2], [0, 2, 1]]);
    assert!(refusal(&flat).contains("triangle 1 repeats triangle 0"), "{}", refusal(&flat));
    let pressed = (positions.iter().map(|x| Vec3::new(x.x, x.y, 0.0)).collect(), triangles.clone());
    assert!(refusal(&pressed).contains("no inside: its volume is"), "{}", refusal(&pressed));
    let mut bad = whole.clone();
    bad.0[3].y = f64::NAN;
    assert!(refusal(&bad).contains("vertex 3 has the coordinate NaN"));
    bad.0[3].y = 1e101;
    assert!(refusal(&bad).contains("1e101 from the origin"), "{}", refusal(&bad));
    bad.1[5][1] = 99;
    assert!(refusal(&bad).contains("triangle 5 names vertex 99"));
    assert!(refusal(&moved(whole, Vec3::repeat(1e13))).contains("from the origin"));
    assert!(refusal(&(vec![], vec![])).contains("0 vertices and 0 triangles"));
}

#[test]
fn unwelded_turned_flat_and_hollow_meshes_are_taken_as_they_are_meant() {
    let whole = box_mesh(HALF);
    let expected = grid(&whole, 20).unwrap();
    let mut rng = StdRng::seed_from_u64(6);
    let points = points_about(&whole, cell(20), 500, &mut rng);
    let same = |name: &str, mesh: &Mesh| {
        let found = grid(mesh, 20).unwrap();
        for p in &points {
            let (a, b) = (found.touch(p).distance, expected.touch(p).distance);
            assert!((a - b).abs() < 1e-6 * cell(20), "{name}: {a} {b} at {p:?}"); // values have 24 bits
        }
    };
    let (positions, triangles) = &whole;
    let loose = triangles.iter().flatten().map(|v| positions[*v as usize]).collect();
    same("no shared vertex", &(loose, (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()));
    let mut turned = whole.clone();
    turned.1[4].swap(0, 1);
    same("a triangle turned", &turned);
    let mut repeated = whole.clone();
    repeated.1.push([5, 5, 2]);
    same("a triangle with a vertex twice", &repeated);
    // A vertex in the middle of the edge from 0 to 4, which one side does not know: a triangle without an area closes it.
    let mut flat = whole.clone();
    flat.0.push(0.5 * (positions[0] + positions[4]));
    let at = flat.1.iter().position(|t| t.contains(&0) && t.contains(&4)).unwrap();
    let [a, b, c] = flat.1.remove(at);
    let k = [[a, b], [b, c], [c, a]].iter().position(|[s, t]| s + t == 4 && (*s == 0 || *t == 0)).unwrap();
    let [s, t, far] = [[a, b, c], [b, c, a], [c, a, b]][k];
    flat.1.extend([[s, 8, far], [8, t, far], [s, t, 8]]);
    same("a triangle without an area", &flat);
    let hollow = joined(whole.clone(), inside_out(box_mesh(0.5 * HALF)));
    let solid = grid(&hollow, 32).unwrap();
    assert!((solid.touch(&Vec3::zeros()).distance - 0.1).abs() < 0.7 * cell(32));
    assert!((solid.inner_radius() - 0.05).abs() < 0.1 * cell(32), "{}", solid.inner_radius());
    let overlapping = joined(whole, moved(box_mesh(HALF), Vec3::new(0.5, 0.05, 0.1)));
    assert!(grid(&overlapping, 20).unwrap().touch(&Vec3::new(0.2, 0.0, 0.0)).distance < 0.0);
}

#[test]
fn memory_is_told_and_a_grid_beyond_its_limit_is_refused_with_the_numbers() {
    let mesh = box_mesh(HALF);
    let solid = grid(&mesh, 64).unwrap();
    // 64 cells of 1/40 along x, 16 along y, 40 along z, with 4.6 to either side and the last node, of four bytes.
    let expected = 4 * (75 * 27 * 51);
    let more = solid.bytes() - expected;
    assert!(more < 1000, "{} bytes for values of {expected}", solid.bytes());
    let refused = |options: GridOptions| Solid::grid(&mesh.0, &mesh.1, &options).unwrap_err().message;
    let normal = GridOptions::default();
    let message = refused(GridOptions { most_bytes: 400_000, ..normal });
    assert!(message.contains("75 × 27 × 51") && message.contains("0.4 MiB; the limit is 0.4 MiB"), "{message}");
    for (resolution, told) in [
        (Resolution::Cells(3), "has 3.0 cells"),
        (Resolution::Cells(5000), "has 5000.0 cells"),
        (Resolution::Length(0.0), "inf cells"),
        (Resolution::Length(-1.0), "has -1.6 cells"),
        (Resolution::Length(f64::NAN), "NaN cells"),
    ] {
        let message = refused(GridOptions { resolution, ..normal });
        assert!(message.contains(told), "{message}");
    }
    assert!(refused(GridOptions { margin: -1.0, ..normal }).contains("margin is -1.0"));
    assert!(refused(GridOptions { margin: 1e9, ..normal }).contains("the limit is 64.0 MiB"));
    let thin = box_mesh(Vec3::new(1.0, 1e-6, 1.0));
    assert!(refusal(&thin).contains("thinner than the grid's cells"), "{}", refusal(&thin));
}

#[test]
fn the_same_mesh_gives_the_same_bits_and_touches_allocate_nothing() {
    let mesh = torus(0.7, 0.25, 24, 12);
    let (a, b) = (grid(&mesh, 20).unwrap(), grid(&mesh, 20).unwrap());
    let mut rng = StdRng::seed_from_u64(7);
    let points = points_about(&mesh, 0.1, 1000, &mut rng);
    let allocated = allocation_counter::measure(|| {
        for p in &points {
            let (s, t) = (a.touch(p), b.touch(p));
            assert!(
                s.distance.to_bits() == t.distance.to_bits()
                    && s.normal.map(f64::to_bits) == t.normal.map(f64::to_bits)
            );
            let _ = a.first_touch(p, &-p, 0.01);
        }
    });
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn a_sweep_through_a_torus_finds_the_first_place_that_samples_find() {
    let mesh = torus(0.7, 0.25, 48, 24);
    let solid = grid(&mesh, 40).unwrap();
    let close = 1.01e-4 * 1.9 / 40.0; // as near as it looks
    let mut rng = StdRng::seed_from_u64(8);
    let (mut met, mut missed) = (0, 0);
    for _ in 0..1500 {
        let (from, to) = (random_point(&mut rng, 1.6), random_point(&mut rng, 1.6));
        let margin = rng.random_range(-0.1..0.2);
        let gap = |share: f64| solid.touch(&(from + share * (to - from))).distance - margin;
        let first = (0..=4000).map(|i| i as f64 / 4000.0).find(|share| gap(*share) <= 0.0);
        match solid.first_touch(&from, &to, margin) {
            None => {
                missed += 1;
                assert!(first.is_none_or(|share| share == 0.0), "{from:?} {to:?} {margin}: {first:?}");
            }
            Some((share, touch)) => {
                met += 1;
                assert!(gap(share) <= close && touch.distance - margin == gap(share), "{}", gap(share));
                assert!(first.is_none_or(|first| first > 0.0 && share <= first), "{share} {first:?}");
                let before = (0..1000).map(|i| gap(share * i as f64 / 1000.0)).fold(f64::INFINITY, f64::min);
                assert!(before > 0.0, "{from:?} {to:?}: {before} before {share}");
            }
        }
    }
    assert!(met > 300 && missed > 300, "{met} {missed}");
    // Through the hole, along the axis.
    assert!(solid.first_touch(&Vec3::new(0.0, 0.0, 1e6), &Vec3::new(0.0, 0.0, -1e6), 0.1).is_none());
    let (share, touch) = solid.first_touch(&Vec3::new(0.7, 0.0, 100.0), &Vec3::new(0.7, 0.0, -300.0), 0.0).unwrap();
    assert!((share - 99.75 / 400.0).abs() < 1e-4 && touch.normal.z > 0.99, "{share} {touch:?}");
}

#[test]
fn a_sweep_along_a_side_ends_and_one_from_within_meets_nothing() {
    let mesh = box_mesh(HALF);
    let solid = grid(&mesh, 32).unwrap();
    for gap in [1e-9, 1e-6, 1e-4, 1e-3] {
        let (from, to) = (Vec3::new(-3.0, HALF.y + gap, 0.0), Vec3::new(3.0, HALF.y + gap, 0.0));
        let found = solid.first_touch(&from, &to, 0.0);
        assert!(found.is_none_or(|(share, touch)| (0.3..0.7).contains(&share) && touch.distance < 2e-5), "{found:?}");
    }
    let out = Vec3::new(0.0, 1.0, 0.0);
    assert!(solid.first_touch(&Vec3::zeros(), &out, 0.0).is_none());
    assert!(solid.first_touch(&out, &out, 0.0).is_none());
    assert!(solid.first_touch(&out, &(2.0 * out), 0.0).is_none());
    assert!(solid.first_touch(&out, &Vec3::repeat(f64::NAN), 0.0).is_none());
    // On the margin and away from it; on it and down.
    let on = Vec3::new(0.1, 0.3, 0.1);
    let margin = solid.touch(&on).distance;
    assert!(solid.first_touch(&on, &out, margin - 1e-9).is_none());
    let (share, _) = solid.first_touch(&on, &-out, margin - 1e-9).unwrap();
    assert!(share < 1e-5, "{share}");
}

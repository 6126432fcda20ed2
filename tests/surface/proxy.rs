//! A mesh to simulate in another's place: of every kind of asset, a manifold with even triangles, or the place and what to do.

use crate::common::{leaf, modes_of, read_obj};
use nalgebra::Rotation3;
use shellwarp::material::ElasticSheet;
use shellwarp::proxy::{Options, Proxy, Sides};
use shellwarp::{Error, ErrorKind, Mesh, Result, Shell, Supports, Vec3};
use std::f64::consts::PI;

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

const PLAIN: Options = Options { n_vertices: 300, weld: 0.0, sides: Sides::Find, cut: false, keep_pieces: false };

fn proxy(soup: &Soup, options: &Options) -> Result<Proxy> {
    Proxy::new(&soup.0, &soup.1, options, &mut |_| Ok(()))
}

/// A grid of quads over the unit square, bent by `place`, each cut in two.
fn grid(n: usize, m: usize, place: impl Fn(f64, f64) -> Vec3) -> Soup {
    let at = |i: usize, j: usize| (i * (m + 1) + j) as u32;
    let mut soup = (vec![], vec![]);
    for i in 0..=n {
        soup.0.extend((0..=m).map(|j| place(i as f64 / n as f64, j as f64 / m as f64)));
    }
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        soup.1.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        soup.1.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    soup
}

fn joined(parts: &[Soup]) -> Soup {
    let mut all: Soup = (vec![], vec![]);
    for (positions, triangles) in parts {
        let first = all.0.len() as u32;
        all.0.extend(positions);
        all.1.extend(triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

fn turned((positions, triangles): Soup) -> Soup {
    (positions, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

/// Triangles that share nothing.
fn torn((positions, triangles): &Soup) -> Soup {
    let torn = triangles.iter().flatten().map(|v| positions[*v as usize]).collect();
    (torn, (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

fn flat(x: f64, y: f64) -> Vec3 {
    Vec3::new(x, y, 0.0)
}

/// A leaf's outline, arched.
fn leafy(x: f64, y: f64) -> Vec3 {
    let half = 0.02 + 0.25 * (PI * (0.98 * x + 0.01)).sin();
    Vec3::new(x, half * (2.0 * y - 1.0), 0.3 * x * x)
}

/// Two sheets a thickness apart and the rim between them.
fn slab(n: usize, m: usize, thickness: f64, place: impl Fn(f64, f64) -> Vec3) -> Soup {
    let lifted = |by: f64| grid(n, m, |x, y| place(x, y) + Vec3::new(0.0, 0.0, by));
    let mut soup = joined(&[lifted(0.5 * thickness), turned(lifted(-0.5 * thickness))]);
    let (at, below) = (|i: usize, j: usize| (i * (m + 1) + j) as u32, ((n + 1) * (m + 1)) as u32);
    let mut rim: Vec<u32> = (0..n).map(|i| at(i, 0)).chain((0..m).map(|j| at(n, j))).collect();
    rim.extend((1..=n).rev().map(|i| at(i, m)).chain((1..=m).rev().map(|j| at(0, j))));
    for k in 0..rim.len() {
        let (a, b) = (rim[k], rim[(k + 1) % rim.len()]);
        soup.1.extend([[b, a, a + below], [b, a + below, b + below]]);
    }
    soup
}

fn ring(turns: f64) -> Soup {
    let (n, m) = (60, 6);
    let mut soup = grid(n, m, |x, y| {
        let (along, across, half) = (2.0 * PI * x, 0.4 * (y - 0.5), PI * x * turns);
        let r = 1.0 + across * half.cos();
        Vec3::new(r * along.cos(), r * along.sin(), across * half.sin())
    });
    let last = (n * (m + 1)) as u32;
    let back = |v: u32| match v {
        v if v < last => v,
        v if turns == 1.0 => m as u32 - (v - last),
        v => v - last,
    };
    soup.1.iter_mut().flatten().for_each(|v| *v = back(*v));
    soup.0.truncate(last as usize);
    soup
}

fn sphere(n: usize) -> Soup {
    let ball = |x: f64, y: f64| {
        let (u, v) = (2.0 * PI * x, PI * y);
        Vec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos())
    };
    let (positions, triangles) = grid(2 * n, n, ball);
    let (m, n) = (n as u32 + 1, 2 * n as u32);
    let same = |v: u32| match (v / m, v % m) {
        (_, 0) => 0,
        (_, j) if j == m - 1 => m - 1,
        (i, j) => i % n * m + j,
    };
    let triangles = triangles.into_iter().map(|t| t.map(same)).filter(|[a, b, c]| a != b && b != c && c != a);
    (positions, triangles.collect())
}

/// Three quarters of a cross: sheets that meet at the edge x = 0.
fn three_sheets() -> Soup {
    let sheet = |angle: f64| grid(10, 10, move |x, y| Vec3::new(x * angle.cos(), y, x * angle.sin()));
    joined(&[sheet(0.0), sheet(PI), sheet(1.4)])
}

fn area(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let span = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    triangles.iter().map(span).sum()
}

/// Of a proxy that a shell can be made of, as even as it is to be.
fn judged(what: &str, made: &Proxy, wanted: usize, worst: f64) -> Mesh {
    let mesh = Mesh::new(made.positions.clone(), &made.triangles).unwrap_or_else(|e| panic!("{what}: {e}"));
    assert_eq!((mesh.n_reoriented, mesh.n_unreferenced), (0, 0), "{what}");
    let n = made.positions.len() as f64;
    assert!((n / wanted as f64 - 1.0).abs() < 0.12, "{what}: {n} vertices for {wanted}");
    assert!(made.info.worst_quality > worst, "{what}: {:?}", made.info);
    assert!(made.info.mean_quality > 0.93, "{what}: {:?}", made.info);
    mesh
}

fn refused(what: &str, soup: &Soup, options: &Options, words: &[&str]) {
    let error = proxy(soup, options).expect_err(what);
    assert_eq!(error.kind, ErrorKind::InvalidMesh, "{what}: {error}");
    words.iter().for_each(|word| assert!(error.message.contains(word), "{what}: {error}"));
}

/// A quality of 0.3 has no angle under 18 degrees by 4√3 A / Σl² of isosceles triangles; isotropic remeshes have 0.5 and more.
#[test]
fn every_kind_of_asset_becomes_an_even_manifold() {
    let kinds: [(&str, Soup); 9] = [
        ("a flat sheet", grid(40, 40, flat)),
        ("a stretched sheet", grid(200, 4, |x, y| Vec3::new(x, 0.3 * y, 0.0))),
        ("a leaf", grid(60, 24, leafy)),
        ("torn triangles", torn(&grid(40, 40, flat))),
        ("a sphere", sphere(30)),
        ("a ring", ring(0.0)),
        ("a ring turned by two halves", ring(2.0)),
        ("a sheet turned here and there", {
            let (positions, triangles) = grid(40, 40, flat);
            let turn = |(t, [a, b, c]): (usize, [u32; 3])| if t % 3 == 0 { [a, c, b] } else { [a, b, c] };
            (positions, triangles.into_iter().enumerate().map(turn).collect())
        }),
        ("two triangles", grid(1, 1, flat)),
    ];
    for (what, soup) in kinds {
        for wanted in [100, 1000] {
            let made = proxy(&soup, &Options { n_vertices: wanted, ..PLAIN }).unwrap_or_else(|e| panic!("{what}: {e}"));
            let mesh = judged(what, &made, wanted, 0.3);
            assert_eq!(mesh.n_components, 1, "{what}");
            assert!(made.info.furthest.0 < made.info.edge_length, "{what}: {:?}", made.info);
        }
    }
}

#[test]
fn meshes_of_the_tests_become_even_manifolds() {
    for name in ["character_hat", "character_leg_left", "shirt", "dinosaur", "v_beam", "flat_beam"] {
        let soup = read_obj(&format!("{name}.obj"));
        for wanted in [100, 700, 3000] {
            let made = proxy(&soup, &Options { n_vertices: wanted, ..PLAIN }).unwrap_or_else(|e| panic!("{name}: {e}"));
            judged(name, &made, wanted, 0.25);
        }
    }
}

/// A square's boundary is straight between its corners, so that nothing of the area is lost; a V's ridge likewise.
#[test]
fn boundaries_corners_and_creases_stay() {
    let made = proxy(&grid(37, 23, flat), &PLAIN).unwrap();
    assert!((area(&made.positions, &made.triangles) - 1.0).abs() < 1e-12);
    for corner in [flat(0.0, 0.0), flat(1.0, 0.0), flat(0.0, 1.0), flat(1.0, 1.0)] {
        assert!(made.positions.iter().any(|x| (x - corner).norm() < 1e-12), "{corner}");
    }
    let bent = grid(40, 40, |x, y| Vec3::new(x, y, (x - 0.5).abs()));
    let made = proxy(&bent, &PLAIN).unwrap();
    assert!(made.info.furthest.0 < 1e-12, "{:?}", made.info);
    assert!((area(&made.positions, &made.triangles) / 2f64.sqrt() - 1.0).abs() < 1e-12);
}

/// The middle of a slab is known. Its rim is half a thickness further out than the sheet's, which the sheet keeps.
#[test]
fn a_sheet_with_thickness_becomes_the_sheet_in_its_middle() {
    for (what, soup) in [
        ("flat", slab(40, 30, 0.02, flat)),
        ("turned inside out", turned(slab(40, 30, 0.02, flat))),
        ("torn", torn(&slab(40, 30, 0.02, flat))),
        (
            "as two sheets",
            joined(&[
                grid(40, 30, |x, y| flat(x, y) + Vec3::z() * 0.01),
                turned(grid(23, 17, |x, y| flat(x, y) - Vec3::z() * 0.01)),
            ]),
        ),
    ] {
        for sides in [Sides::Find, Sides::Within(0.03)] {
            let made = proxy(&soup, &Options { sides, ..PLAIN }).unwrap_or_else(|e| panic!("{what}: {e}"));
            let mesh = judged(what, &made, 300, 0.4);
            assert_eq!(mesh.n_components, 1, "{what}");
            assert!((made.info.thickness - 0.02).abs() < 1e-9, "{what}: {:?}", made.info);
            let off = made.positions.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "{what}: {off:e} from the middle");
            assert!((area(&made.positions, &made.triangles) - 1.0).abs() < 1e-6, "{what}");
        }
        let both = proxy(&soup, &Options { sides: Sides::Keep, ..PLAIN }).unwrap();
        assert!(area(&both.positions, &both.triangles) > 1.9, "{what}");
    }
}

#[test]
fn leaves_with_two_sides_become_one() {
    let pillow = |x: f64, y: f64, side: f64| leafy(x, y) + Vec3::z() * (side * 0.01 * (PI * y).sin() * (PI * x).sin());
    let kinds = [
        ("a thick leaf", slab(60, 24, 0.01, leafy)),
        ("twice the same", joined(&[grid(60, 24, leafy), turned(grid(60, 24, leafy))])),
        ("two of other triangles", joined(&[grid(60, 24, leafy), turned(grid(43, 19, leafy))])),
        (
            "thin at the rim",
            joined(&[grid(60, 24, |x, y| pillow(x, y, 1.0)), turned(grid(60, 24, |x, y| pillow(x, y, -1.0)))]),
        ),
    ];
    let one = proxy(&grid(60, 24, leafy), &PLAIN).unwrap();
    let whole = area(&one.positions, &one.triangles);
    for (what, soup) in kinds {
        let made = proxy(&soup, &PLAIN).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(judged(what, &made, 300, 0.3).n_components, 1, "{what}");
        // The rim of a slab is met to its thickness; flat triangles between 300 vertices lose as much.
        let share = area(&made.positions, &made.triangles) / whole;
        assert!((share - 1.0).abs() < 0.03, "{what}: {share} of the area");
    }
}

#[test]
fn a_tube_is_no_sheet_and_a_thickness_that_makes_it_one_is_refused() {
    let round = |x: f64, y: f64| Vec3::new(x, 0.02 * (2.0 * PI * y).cos(), 0.02 * (2.0 * PI * y).sin());
    let tube = grid(100, 16, round);
    let options = Options { weld: 1e-9, ..PLAIN };
    let made = proxy(&tube, &options).unwrap();
    assert_eq!(made.info.n_sides_joined, 0);
    judged("a tube", &made, 300, 0.3);
    refused(
        "a tube",
        &tube,
        &Options { sides: Sides::Within(0.05), ..options },
        &["two sides cannot be told apart", "thickness"],
    );
    let half = joined(&[grid(30, 30, flat), turned(grid(15, 30, |x, y| Vec3::new(0.5 * x, y, -0.01)))]);
    let options = Options { sides: Sides::Within(0.02), ..PLAIN };
    refused("half a lining", &half, &options, &["two sides cannot be told apart", "vertex"]);
}

#[test]
fn what_is_no_manifold_is_refused_with_the_place_or_cut() {
    let moebius = ring(1.0);
    let points = joined(&[grid(10, 10, flat), grid(10, 10, |x, y| flat(-x, -y))]);
    for (what, soup, words, pieces) in [
        ("a Moebius band", moebius, "a strip with one side closes at the edge from vertex", 1),
        ("three sheets", three_sheets(), "3 triangles meet at the edge from vertex", 2),
        ("sheets that touch", points, "sheets touch in a point at vertex 0 at (0.000000, 0.000000, 0.000000)", 2),
    ] {
        refused(what, &soup, &PLAIN, &[words, "let the proxy be cut"]);
        let made = proxy(&soup, &Options { cut: true, ..PLAIN }).unwrap_or_else(|e| panic!("{what}: {e}"));
        let mesh = judged(what, &made, 300, 0.3);
        assert_eq!(mesh.n_components, pieces, "{what}");
        assert!(made.info.n_cut > 0, "{what}");
        assert!((area(&made.positions, &made.triangles) / area(&soup.0, &soup.1) - 1.0).abs() < 0.02, "{what}");
    }
}

#[test]
fn pieces_that_touch_are_welded_and_small_ones_left_out() {
    let halves = joined(&[grid(20, 20, |x, y| flat(0.5 * x, y)), grid(20, 20, |x, y| flat(0.5 + 0.5 * x + 1e-4, y))]);
    assert_eq!(proxy(&halves, &PLAIN).unwrap().info.n_pieces, 2);
    let made = proxy(&halves, &Options { weld: 2e-4, ..PLAIN }).unwrap();
    assert_eq!((made.info.n_pieces, made.info.n_welded), (1, 21));

    let button = |k: f64| grid(4, 4, move |x, y| Vec3::new(0.2 * k + 0.05 * x, 0.5 + 0.05 * y, 0.01));
    let shirt = joined(&[grid(40, 40, flat), button(1.0), button(2.0), button(3.0)]);
    let made = proxy(&shirt, &PLAIN).unwrap();
    assert_eq!((made.info.n_pieces, made.info.n_left_out), (1, 3));
    let made = proxy(&shirt, &Options { keep_pieces: true, ..PLAIN }).unwrap();
    assert_eq!((made.info.n_pieces, made.info.n_left_out), (4, 0));
}

/// 5,000 triangles about one vertex, 4,000 across a strip, 2,500 holes: what collapses is judged by all that it moves, and takes bounded time.
#[test]
fn slivers_and_lace_become_even_sheets_of_the_same_area() {
    let n = 5000;
    let rim = (0..n).map(|k| 2.0 * PI * f64::from(k) / f64::from(n)).map(|a| flat(a.cos(), a.sin()));
    let disc: Soup = (
        std::iter::once(flat(0.0, 0.0)).chain(rim).collect(),
        (0..n as u32).map(|k| [0, 1 + k, 1 + (k + 1) % n as u32]).collect(),
    );
    let (positions, mut lace) = grid(100, 100, flat);
    let mut square = 0;
    lace.retain(|_| {
        square += 1;
        let (i, j) = ((square - 1) / 2 / 100, (square - 1) / 2 % 100);
        i % 4 != 1 || j % 4 != 1
    });
    for (what, soup, whole) in [
        ("a disc", disc, PI),
        ("a strip", grid(1, 2000, |x, y| flat(x, 0.2 * y)), 0.2),
        ("lace", (positions, lace), 1.0),
    ] {
        let made = proxy(&soup, &PLAIN).unwrap_or_else(|e| panic!("{what}: {e}"));
        judged(what, &made, 300, 0.3);
        let area = area(&made.positions, &made.triangles);
        assert!((area / whole - 1.0).abs() < 0.01, "{what}: {area} of {whole}");
        assert_eq!(made.info.n_holes_closed, if what == "lace" { 625 } else { 0 }, "{what}");
    }
}

/// A corner in the middle of a neighbour's side, as booleans leave it, with a triangle without height between.
#[test]
fn triangles_without_height_leave_no_slit() {
    let positions = vec![flat(0.0, 0.0), flat(1.0, 0.0), flat(1.0, 1.0), flat(0.0, 1.0), flat(0.5, 0.5)];
    let triangles = vec![[0, 1, 4], [1, 2, 4], [0, 4, 2], [0, 2, 3]];
    let made = proxy(&(positions, triangles), &PLAIN).unwrap();
    let mesh = judged("a square", &made, 300, 0.4);
    let rim: f64 = mesh
        .edges
        .iter()
        .filter(|e| !e.is_interior())
        .map(|e| {
            let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
            (b - a).norm()
        })
        .sum();
    assert!((rim - 4.0).abs() < 1e-9, "the boundary is {rim} long");
}

#[test]
fn bad_input_is_named() {
    let square = grid(2, 2, flat);
    let mut out_of_range = square.clone();
    out_of_range.1[3][1] = 77;
    refused("an index", &out_of_range, &PLAIN, &["triangle 3 names vertex 77, which does not exist"]);
    for bad in [f64::NAN, f64::INFINITY] {
        let mut not_finite = square.clone();
        not_finite.0[4].y = bad;
        refused("a number", &not_finite, &PLAIN, &["vertex 4 is (0.5, ", "it must be finite"]);
    }
    refused(
        "lines",
        &(vec![flat(0.0, 0.0), flat(1.0, 0.0), flat(2.0, 0.0)], vec![[0, 1, 2]]),
        &PLAIN,
        &["no triangle has an area"],
    );
    refused("a point", &(vec![flat(1.0, 2.0); 3], vec![[0, 1, 2]]), &PLAIN, &["no extent"]);
    for (options, word) in [
        (Options { n_vertices: 3, ..PLAIN }, "n_vertices is 3"),
        (Options { n_vertices: usize::MAX, ..PLAIN }, "n_vertices is"),
        (Options { weld: -1.0, ..PLAIN }, "weld is -1.0"),
        (Options { weld: f64::NAN, ..PLAIN }, "weld is NaN"),
        (Options { sides: Sides::Within(f64::INFINITY), ..PLAIN }, "thickness is inf"),
    ] {
        let error = proxy(&square, &options).expect_err(word);
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains(word), "{error}");
    }
}

/// By powers of two nothing rounds but what is compared with 16 digits of coordinates.
#[test]
fn the_unit_of_length_and_the_place_do_not_matter_and_the_same_input_gives_the_same_bits() {
    let (positions, triangles) = grid(30, 12, leafy);
    let first = proxy(&(positions.clone(), triangles.clone()), &PLAIN).unwrap();
    for scale in [2f64.powi(-300), 2f64.powi(300)] {
        let scaled = (positions.iter().map(|x| x * scale).collect(), triangles.clone());
        let made = proxy(&scaled, &PLAIN).unwrap();
        assert_eq!(made.triangles, first.triangles);
        assert!(made.positions.iter().zip(&first.positions).all(|(a, b)| (a / scale - b).norm() < 1e-12));
    }
    let turn = Rotation3::from_scaled_axis(Vec3::new(0.3, -1.0, 2.0));
    let away = (positions.iter().map(|x| turn * x + Vec3::new(100.0, 50.0, -30.0)).collect(), triangles.clone());
    judged("far off", &proxy(&away, &PLAIN).unwrap(), 300, 0.3);
    let again = proxy(&(positions, triangles), &PLAIN).unwrap();
    assert_eq!((again.positions, again.triangles, again.nearest), (first.positions, first.triangles, first.nearest));
}

/// A vertex of one side lies where its source says, so that maps and groups come along.
#[test]
fn sources_and_nearest_lead_from_one_mesh_to_the_other() {
    let asset = grid(60, 24, leafy);
    let made = proxy(&asset, &PLAIN).unwrap();
    for (x, source) in made.positions.iter().zip(&made.sources) {
        let sum: f64 = source.weights.iter().sum();
        let at: Vec3 = (0..3).map(|k| source.weights[k] * asset.0[source.vertices[k] as usize]).sum();
        assert!((sum - 1.0).abs() < 1e-12 && (at - x).norm() < 1e-9, "{x} {at}");
    }
    for (x, v) in asset.0.iter().zip(&made.nearest) {
        let distance = (made.positions[*v as usize] - x).norm();
        assert!(distance < 1.2 * made.info.edge_length, "{distance} of {}", made.info.edge_length);
    }
}

#[test]
fn it_can_be_cancelled_at_every_word() {
    let asset = grid(60, 24, leafy);
    let mut shares = vec![];
    Proxy::new(&asset.0, &asset.1, &PLAIN, &mut |share| {
        shares.push(share);
        Ok(())
    })
    .unwrap();
    assert!(shares.len() > 10 && shares.is_sorted() && shares.last() == Some(&1.0), "{shares:?}");
    for stop in 0..shares.len() {
        let mut heard = 0;
        let outcome = Proxy::new(&asset.0, &asset.1, &PLAIN, &mut |_| {
            heard += 1;
            if heard > stop { Err(Error::new(ErrorKind::Cancelled, "enough")) } else { Ok(()) }
        });
        assert_eq!(outcome.expect_err("cancelled").kind, ErrorKind::Cancelled);
    }
}

/// Of the triangles whose corners are all held.
fn held_area(positions: &[Vec3], triangles: &[[u32; 3]], held: &[bool]) -> f64 {
    let area = |[a, b, c]: [Vec3; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
    let inside = triangles.iter().filter(|t| t.iter().all(|v| held[*v as usize]));
    inside.map(|t| area(t.map(|v| positions[v as usize]))).sum()
}

#[test]
fn what_supports_hold_keeps_its_outline() {
    let shell = leaf(3);
    let asset = (shell.mesh.positions.clone(), shell.mesh.triangles.clone());
    let options = Options { n_vertices: asset.0.len() / 10, ..PLAIN };
    // The stem; a patch in the middle; a part of the rim.
    let stem = |x: &Vec3| x.x < 0.06;
    let patch = |x: &Vec3| (x.x - 0.75).abs() < 0.2 && x.y.abs() < 0.12;
    let rim = |x: &Vec3| x.y < -0.25 && x.x > 0.4 && x.x < 0.9;
    for (name, is_held) in [("stem", &stem as &dyn Fn(&Vec3) -> bool), ("patch", &patch), ("rim", &rim)] {
        let held: Vec<u32> = (0..asset.0.len() as u32).filter(|v| is_held(&asset.0[*v as usize])).collect();
        let made = Proxy::holding(&asset.0, &asset.1, &held, &options, &mut |_| Ok(())).unwrap();
        let of_asset: Vec<bool> = asset.0.iter().map(is_held).collect();
        let mut of_proxy = vec![false; made.positions.len()];
        held.iter().for_each(|v| of_proxy[made.nearest[*v as usize] as usize] = true);
        let exact = held_area(&asset.0, &asset.1, &of_asset);
        let off = held_area(&made.positions, &made.triangles, &of_proxy) / exact - 1.0;
        println!(
            "{name}: {} held of {}, area off by {off:+.3}, quality {:.2}",
            held.len(),
            made.positions.len(),
            made.info.worst_quality
        );
        // Outlines have steps of a third of the proxy's edge, which it cuts off.
        assert!(off.abs() < 0.15, "{name}: {off}");
        // The stem is as wide as an edge of the proxy: its outline is kept down to a quality of 0.2.
        assert!(made.info.worst_quality > 0.2, "{name}: {}", made.info.worst_quality);
    }
}

#[test]
fn a_proxy_that_keeps_what_is_held_has_frequencies_nearer_to_its_assets() {
    let fine = leaf(3);
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.0085, volume_density: 1000.0 };
    let first = |positions: Vec<Vec3>, triangles: &[[u32; 3]], fixed: Vec<u32>| {
        let supports = Supports { fixed, ..Default::default() };
        let shell = Shell::new(Mesh::new(positions, triangles).unwrap(), sheet, &supports).unwrap();
        modes_of(&shell, 5).eigenvalues[..5].iter().map(|lambda| lambda.sqrt()).collect::<Vec<f64>>()
    };
    let (positions, triangles) = (&fine.mesh.positions, &fine.mesh.triangles);
    let held: Vec<u32> = (0..positions.len() as u32).filter(|v| fine.held[*v as usize]).collect();
    let own = first(positions.clone(), triangles, held.clone());
    let options = Options { n_vertices: positions.len() / 10, ..PLAIN };
    let worst = |kept: &[u32]| {
        let made = Proxy::holding(positions, triangles, kept, &options, &mut |_| Ok(())).unwrap();
        let mut fixed: Vec<u32> = held.iter().map(|v| made.nearest[*v as usize]).collect();
        fixed.sort_unstable();
        fixed.dedup();
        let found = first(made.positions, &made.triangles, fixed);
        let off: Vec<f64> = found.iter().zip(&own).map(|(f, e)| 100.0 * (f / e - 1.0)).collect();
        println!("{} kept: {off:+.2?} %", kept.len());
        off.iter().map(|off| off.abs()).fold(0.0, f64::max)
    };
    // Free, both have the same to 1.5 %; where the outline is not kept, its place is off by up to half of an edge, a thirtieth of the length.
    let (with, without) = (worst(&held), worst(&[]));
    // It is 7.5 %; kept, the stem's rim still is a polygon of fewer sides.
    assert!(with < 5.0 && with < 0.6 * without, "{with} {without}");
}

struct Chance(u64);

impl Chance {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }

    fn share(&mut self) -> f64 {
        self.below(1 << 20) as f64 / f64::from(1 << 20)
    }
}

/// Triangles between random points: nothing is a sheet. What comes out is a manifold or an error, in bounded time.
#[test]
fn random_soups_come_to_an_end() {
    let mut chance = Chance(5);
    let mut made = 0;
    for round in 0..300 {
        let n = 4 + chance.below(60);
        let lattice = round % 2 == 0; // many at the same place, in lines and in planes
        let mut point = || Vec3::from_fn(|_, _| if lattice { chance.below(3) as f64 } else { chance.share() });
        let positions: Vec<Vec3> = (0..n).map(|_| point()).collect();
        let triangles = (0..1 + chance.below(3 * n)).map(|_| [0; 3].map(|_: u32| chance.below(n) as u32)).collect();
        let sides = [Sides::Find, Sides::Keep, Sides::Within(0.1)][chance.below(3) as usize];
        let options = Options {
            n_vertices: 4 + chance.below(200) as usize,
            weld: if round % 3 == 0 { 0.1 } else { 0.0 },
            sides,
            cut: round % 5 != 0,
            keep_pieces: round % 7 == 0,
        };
        if let Ok(proxy) = proxy(&(positions, triangles), &options) {
            made += 1;
            Mesh::new(proxy.positions, &proxy.triangles).unwrap();
        }
    }
    assert!(made > 100, "{made} of 300");
}

/// The leaf of the scenes, whose fine mesh has about 16 times as many vertices as the coarse one.
#[test]
fn a_proxy_of_a_scenes_leaf_has_its_outline() {
    let fine = leaf(4).mesh;
    let soup = (fine.positions.clone(), fine.triangles.clone());
    let made = proxy(&soup, &Options { n_vertices: fine.positions.len() / 10, ..PLAIN }).unwrap();
    judged("the leaf", &made, fine.positions.len() / 10, 0.3);
    let share = area(&made.positions, &made.triangles) / area(&soup.0, &soup.1);
    assert!((share - 1.0).abs() < 0.01, "{share}");
}

//! Modes against independent numbers, closed forms and published tables, and the certificate on shells of every kind.

use crate::common::*;
use shellwarp::modes::{Modes, Progress, ScaledStiffness, entries, lowest_modes, repeated};
use shellwarp::{Error, ErrorKind, Material, Mesh, Shell, Supports, Vec3};

fn shell_of(
    (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>),
    material: Material,
    held: impl Fn(&Vec3) -> bool,
) -> Shell {
    let fixed = (0..positions.len() as u32).filter(|&v| held(&positions[v as usize])).collect();
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// What every result must show, recomputed here from the modes themselves where it can be.
#[track_caller]
fn assert_certified(name: &str, shell: &Shell, modes: &Modes) {
    let c = &modes.certificate;
    println!("{name}: {c:?}, zero modes {}", modes.zero_modes);
    assert!(c.residual <= 1e-8, "{name}: residual {}", c.residual);
    assert!(c.orthonormality <= 1e-10, "{name}: orthonormality {}", c.orthonormality);
    assert_eq!(c.count, c.found, "{name}: a mode is missing");
    assert!(modes.eigenvalues.is_sorted());
    for (i, a) in modes.shapes.iter().enumerate() {
        for (j, b) in modes.shapes.iter().enumerate().skip(i) {
            let product: f64 = (0..a.len()).map(|v| shell.mass[v] * a[v].dot(&b[v])).sum();
            assert!((product - f64::from(u8::from(i == j))).abs() <= 1e-10, "{name}: ΦᵀMΦ at {i}, {j} is {product}");
        }
    }
    // ‖Kφ − λMφ‖ from the assembled matrix, K = M^½ A M^½.
    let stiffness = ScaledStiffness::assemble(shell).unwrap();
    let norm = stiffness.unscaled_norm();
    for (phi, lambda) in modes.shapes.iter().zip(&modes.eigenvalues) {
        let y: Vec<f64> =
            shell.free.iter().flat_map(|&v| (phi[v as usize] * shell.mass[v as usize].sqrt()).data.0[0]).collect();
        let image = stiffness.apply(&y);
        let residual: f64 =
            (0..y.len()).map(|i| (stiffness.root_mass[i] * (image[i] - lambda * y[i])).powi(2)).sum::<f64>().sqrt();
        let size: f64 = (0..y.len()).map(|i| (y[i] / stiffness.root_mass[i]).powi(2)).sum::<f64>().sqrt();
        assert!(residual <= 1e-8 * norm * size, "{name}: λ = {lambda}");
    }
}

#[test]
fn eigenvalues_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let modes = modes_of(&shell, 8);
        assert_certified(name, &shell, &modes);
        for (k, expected) in json["eigenvalues"].as_array().unwrap().iter().enumerate() {
            let expected = expected.as_f64().unwrap();
            assert_close(&format!("{name} eigenvalue {k}"), modes.eigenvalues[k], expected, 1e-7, 0.0);
        }
    }
}

#[test]
fn dense_and_sparse_solvers_agree() {
    let shell = shell_of(equilateral_sheet(20, 6, 1.0), Material::default(), |p| p.x <= 1.0);
    // Dense up to four unknowns a mode, so 8 modes go the sparse way and 120 the dense one.
    assert!((241..480).contains(&shell.n_unknowns()));
    let (few, many) = (modes_of(&shell, 8), modes_of(&shell, 120));
    assert_certified("sparse", &shell, &few);
    assert_certified("dense", &shell, &many);
    for k in 0..8 {
        assert_close("eigenvalue", few.eigenvalues[k], many.eigenvalues[k], 1e-9, 0.0);
        let product: f64 =
            (0..shell.mass.len()).map(|v| shell.mass[v] * few.shapes[k][v].dot(&many.shapes[k][v])).sum();
        // Simple modes, so the stated sign makes the shapes equal too: cosine 1 to the square of the vectors' error.
        assert_close("cosine", product, 1.0, 1e-9, 0.0);
    }
}

/// A square plate whose mesh has the symmetry of the square: diagonals alternate (union jack).
fn square_plate(n: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    let positions =
        (0..(n + 1) * (n + 1)).map(|k| Vec3::new((k % (n + 1)) as f64, (k / (n + 1)) as f64, 0.0) / n as f64).collect();
    let mut triangles = vec![];
    for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
    }
    (positions, triangles)
}

#[test]
fn a_free_square_plate_has_six_zero_modes_and_complete_pairs() {
    let shell = shell_of(square_plate(16), Material::default(), |_| false);
    let modes = modes_of(&shell, 20);
    assert_certified("free square plate", &shell, &modes);
    assert_eq!(modes.zero_modes, 6);
    // A free square plate has a degenerate pair as its fourth and fifth elastic mode (34.8009 twice in the table's head).
    assert!(repeated(modes.eigenvalues[9], modes.eigenvalues[10]), "{:?}", &modes.eigenvalues[6..12]);
    assert!(!repeated(modes.eigenvalues[8], modes.eigenvalues[9]));
}

#[test]
fn modes_cut_inside_a_repeated_pair_are_the_first_of_the_stated_basis() {
    let shell = shell_of(square_plate(16), Material::default(), |_| false);
    let (cut, whole) = (modes_of(&shell, 10), modes_of(&shell, 20));
    assert_certified("cut pair", &shell, &cut);
    assert_eq!(cut.certificate.found, 11);
    let product: f64 = (0..shell.mass.len()).map(|v| shell.mass[v] * cut.shapes[9][v].dot(&whole.shapes[9][v])).sum();
    // The stated basis does not depend on how many modes were asked for, to the vectors' accuracy squared.
    assert_close("cosine", product, 1.0, 1e-9, 0.0);
}

/// An icosahedron refined `levels` times onto the unit sphere.
fn icosphere(levels: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<Vec3> = vec![];
    for (s, t) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        points.extend([Vec3::new(0.0, s, t), Vec3::new(s, t, 0.0), Vec3::new(t, 0.0, s)]);
    }
    let near = |a: usize, b: usize| (points[a] - points[b]).norm() < 2.1;
    let mut triangles: Vec<[u32; 3]> = vec![];
    for (a, b, c) in (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| (a, b, c)))) {
        if near(a, b) && near(b, c) && near(c, a) {
            triangles.push([a as u32, b as u32, c as u32]);
        }
    }
    for _ in 0..levels {
        let mut middle = std::collections::HashMap::new();
        let mut between = |a: u32, b: u32, points: &mut Vec<Vec3>| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]) / 2.0);
                points.len() as u32 - 1
            })
        };
        let refined = triangles.iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [between(a, b, &mut points), between(b, c, &mut points), between(c, a, &mut points)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        triangles = refined.collect();
    }
    (points.into_iter().map(|p| p.normalize()).collect(), triangles)
}

#[test]
fn a_closed_sphere_is_certified() {
    let shell = shell_of(icosphere(3), Material::default(), |_| false);
    let modes = modes_of(&shell, 24);
    assert_certified("sphere", &shell, &modes);
    assert_eq!(modes.zero_modes, 6);
    // The lowest elastic deformation of a sphere is the spheroidal l = 2 quintuple; the icosahedral group keeps it whole.
    let group = modes.eigenvalues[6..].iter().take_while(|l| repeated(modes.eigenvalues[6], **l)).count();
    assert_eq!(group, 5, "{:?}", &modes.eigenvalues[6..14]);
}

#[test]
fn two_disconnected_shells_have_everything_twice() {
    let (mut positions, mut triangles) = equilateral_sheet(12, 8, 1.0);
    let n = positions.len();
    positions.extend(positions.clone().iter().map(|p| p + 5.0 * Vec3::z()));
    triangles.extend(triangles.clone().iter().map(|t| t.map(|v| v + n as u32)));
    let shell = shell_of((positions, triangles), Material::default(), |_| false);
    let modes = modes_of(&shell, 20);
    assert_certified("two shells", &shell, &modes);
    assert_eq!((shell.mesh.n_components, modes.zero_modes), (2, 12));
    for k in [12, 14, 16] {
        assert!(repeated(modes.eigenvalues[k], modes.eigenvalues[k + 1]), "{:?}", &modes.eigenvalues[12..]);
    }
}

#[test]
fn zero_modes_count_what_supports_leave_free() {
    let sheet = || equilateral_sheet(12, 8, 1.0);
    type Held = fn(&Vec3) -> bool;
    let cases: [(&str, usize, Held); 4] = [
        ("free", 6, |_| false),
        ("one vertex", 3, |p| p.norm() < 0.1),
        ("hinge along a row", 1, |p| p.x == 0.0),
        ("clamped", 0, |p| p.x <= 1.0),
    ];
    for (name, expected, held) in cases {
        let shell = shell_of(sheet(), Material::default(), held);
        let modes = modes_of(&shell, 8);
        assert_certified(name, &shell, &modes);
        assert_eq!(modes.zero_modes, expected, "{name}: {:?}", modes.eigenvalues);
        assert!(modes.eigenvalues[expected] > 1e-3, "{name}: {:?}", modes.eigenvalues);
    }
}

#[test]
fn the_dinosaur_is_certified_with_4_and_64_modes() {
    let (positions, triangles) = read_obj("dinosaur.obj");
    let shell = shell_of((positions, triangles), Material::default(), |p| p.y < 0.05);
    for wanted in [4, 64] {
        let modes = modes_of(&shell, wanted);
        assert_certified(&format!("dinosaur, {wanted} modes"), &shell, &modes);
        assert_eq!((modes.eigenvalues.len(), modes.zero_modes), (wanted, 0));
    }
}

#[test]
fn tiny_shells_and_too_many_modes_give_what_there_is() {
    let triangle = || (vec![Vec3::zeros(), Vec3::x(), Vec3::y()], vec![[0u32, 1, 2]]);
    let free = shell_of(triangle(), Material::default(), |_| false);
    let modes = modes_of(&free, 1_000_000);
    assert_certified("one triangle", &free, &modes);
    assert_eq!((modes.eigenvalues.len(), modes.zero_modes), (9, 6));
    let held = shell_of(triangle(), Material::default(), |_| true);
    assert_eq!(modes_of(&held, 5).eigenvalues.len(), 0);
}

#[test]
fn eigenvalues_scale_exactly_with_stiffness_and_mass() {
    let solve = |stiffness: f64, density: f64| {
        let material =
            Material { k_area: 1e4 * stiffness, k_length: 1e4 * stiffness, k_bend: stiffness, area_density: density };
        let shell = shell_of(equilateral_sheet(16, 6, 1.0), material, |p| p.x <= 1.0);
        let modes = modes_of(&shell, 6);
        assert_certified(&format!("stiffness {stiffness:e}, density {density:e}"), &shell, &modes);
        modes.eigenvalues
    };
    let base = solve(1.0, 1.0);
    for (stiffness, density) in [(1e12, 1.0), (1e-12, 1.0), (1.0, 1e12), (1.0, 1e-12), (1e12, 1e-12)] {
        for (scaled, base) in solve(stiffness, density).iter().zip(&base) {
            // Only rounding differs.
            assert_close("eigenvalue", scaled * density / stiffness, *base, 1e-9, 0.0);
        }
    }
}

#[test]
fn stiff_membranes_do_not_disturb_bending_modes() {
    // ‖A‖/λ₁ reaches 1e15, and the lowest modes are pure bending.
    let solve = |k: f64| {
        let material = Material { k_area: k, k_length: k, k_bend: 1.0, area_density: 1.0 };
        let edge = 1.0 / 40.0;
        let shell = shell_of(equilateral_sheet(40, 10, edge), material, |p| p.x < 1.01 * edge);
        let modes = modes_of(&shell, 3);
        assert_certified(&format!("k = {k:e}"), &shell, &modes);
        modes.eigenvalues
    };
    let base = solve(1e6);
    for k in [1e8, 1e10] {
        for (stiff, base) in solve(k).iter().zip(&base) {
            // Flat sheets do not couple bending and stretching at rest, so only rounding differs.
            assert_close(&format!("k = {k:e}"), *stiff, *base, 1e-8, 0.0);
        }
    }
}

/// Natural frequencies √λ L²/√(EI/ρA) of a narrow cantilever strip of 1/`slenderness` width, `rows` rows of triangles.
fn strip_frequencies(slenderness: f64, rows: usize) -> Vec<f64> {
    let edge = 2.0 / (slenderness * rows as f64 * 3f64.sqrt());
    let columns = (1.0 / edge).round() as usize + 1;
    let material = Material { k_area: 1e5, k_length: 1e5, k_bend: 1.0, area_density: 1.0 };
    let shell = shell_of(equilateral_sheet(columns, rows, edge), material, |p| p.x < 1.01 * edge);
    let modes = modes_of(&shell, 6);
    assert_certified(&format!("strip 1:{slenderness}, {rows} rows"), &shell, &modes);
    // The curvature of the first hinge row belongs to half an edge on either side: the clamp lies half an edge in.
    let length = columns as f64 * edge - 0.5 * edge;
    // A free-edged strip of the plate D = 6 k_B, ν = −1/3 has EI = D (1 − ν²) b.
    let rigidity = 6.0 * (1.0 - 1.0 / 9.0);
    let out_of_plane = |k: &usize| {
        let all: f64 = modes.shapes[*k].iter().map(|u| u.norm_squared()).sum();
        modes.shapes[*k].iter().map(|u| u.z * u.z).sum::<f64>() > 0.5 * all
    };
    (0..6).filter(out_of_plane).map(|k| modes.eigenvalues[k].sqrt() * length * length / f64::sqrt(rigidity)).collect()
}

#[test]
fn strip_frequencies_converge_to_euler_bernoulli() {
    let roots: Vec<f64> = csv("euler_bernoulli_roots.csv").iter().map(|row| row[2]).collect();
    // A beam is the limit of a plate strip that grows narrow and fine together.
    let widths = [(10.0, 4), (20.0, 8), (40.0, 16)];
    let e = widths.map(|(slenderness, rows)| strip_frequencies(slenderness, rows)[0] / roots[0] - 1.0);
    let orders = [(e[0] / e[1]).log2(), (e[1] / e[2]).log2()];
    println!("errors {e:?}, orders {orders:?}");
    // First order, from the free edges and the clamp's zone of hindered lateral curvature.
    assert!(orders.iter().all(|o| (0.8..1.4).contains(o)), "{orders:?}");
    let narrow = strip_frequencies(40.0, 16);
    for k in 0..4 {
        // The clamp's zone still adds a third of a percent at 1:40.
        assert_close(&format!("mode {k} at 1:40"), narrow[k], roots[k], 0.005, 0.0);
    }
}

#[test]
fn cantilever_plate_frequency_ratios_match_the_kirchhoff_table() {
    let table = csv("plate_kirchhoff_CFFF_ritz.csv");
    for (aspect, rows) in [(1.0, 48usize), (2.0, 32), (5.0, 24)] {
        let row = table.iter().find(|r| r[0] == aspect && (r[1] + 1.0 / 3.0).abs() < 1e-5).unwrap();
        let edge = 2.0 / (aspect * rows as f64 * 3f64.sqrt());
        let columns = (1.0 / edge + 0.5).round() as usize;
        let material = Material { k_area: 1e5, k_length: 1e5, k_bend: 1.0, area_density: 1.0 };
        let shell = shell_of(equilateral_sheet(columns, rows, edge), material, |p| p.x < 1.01 * edge);
        let modes = modes_of(&shell, 8);
        assert_certified(&format!("plate {aspect}"), &shell, &modes);
        for k in 1..8 {
            let ratio = (modes.eigenvalues[k] / modes.eigenvalues[0]).sqrt();
            println!("a/b = {aspect}, mode {k}: {ratio:.4}, table {:.4}", row[2 + k] / row[2]);
            // The bound; the mesh error is first order in 1/rows.
            assert_close(&format!("a/b = {aspect}, mode {k}"), ratio, row[2 + k] / row[2], 0.02, 0.0);
        }
    }
}

#[test]
fn progress_is_monotonic_and_can_stop_the_work() {
    let shell = shell_of(equilateral_sheet(20, 10, 1.0), Material::default(), |p| p.x <= 1.0);
    let mut calls = vec![];
    let mut record = |phase, fraction| {
        calls.push((phase, fraction));
        Ok(())
    };
    lowest_modes(&shell, 8, &mut Progress::new(&mut record)).unwrap();
    assert!(calls.iter().all(|(_, f)| (0.0..=1.0).contains(f)));
    for pair in calls.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        assert!(pair[0].1 <= pair[1].1, "{pair:?}");
    }
    for stop in 0..calls.len() {
        let mut count = 0;
        let mut cancel = |_, _| {
            count += 1;
            if count > stop { Err(Error::new(ErrorKind::Cancelled, "stop")) } else { Ok(()) }
        };
        let outcome = lowest_modes(&shell, 8, &mut Progress::new(&mut cancel));
        assert_eq!(outcome.err().map(|e| e.kind), Some(ErrorKind::Cancelled), "call {stop}");
    }
}

#[test]
fn modes_are_the_same_bits_every_time() {
    let (shell, _) = reference("v_beam");
    let (a, b) = (modes_of(&shell, 8), modes_of(&shell, 8));
    assert_eq!(a.eigenvalues, b.eigenvalues);
    assert_eq!(a.shapes, b.shapes);
}

#[test]
fn the_assembled_matrix_is_the_energys() {
    let (shell, _) = reference("v_beam");
    let stiffness = ScaledStiffness::assemble(&shell).unwrap();
    let per_row = 2 * entries(&stiffness.lower).count() / shell.n_unknowns();
    assert!((25..60).contains(&per_row), "{per_row} nonzeros a row");
    let y: Vec<f64> = (0..shell.n_unknowns()).map(|i| (i as f64 * 0.37).sin()).collect();
    let quadratic: f64 = stiffness.apply(&y).iter().zip(&y).map(|(a, y)| a * y).sum();
    let phi: Vec<f64> = y.iter().zip(&stiffness.root_mass).map(|(y, r)| y / r).collect();
    let direct = shellwarp::energy::rest_quadratic_form(&*shell.energy, &shell.scatter(&phi));
    // Two sums of the same few thousand terms.
    assert_close("yᵀAy", quadratic, direct, 1e-12, 0.0);
}

/// `count` copies of a sheet above one another.
fn stacked(count: usize, (one, faces): (Vec<Vec3>, Vec<[u32; 3]>)) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let copies = 0..count;
    let positions = copies.clone().flat_map(|k| one.iter().map(move |p| p + 5.0 * k as f64 * Vec3::z())).collect();
    let shift = |k: usize| (k * one.len()) as u32;
    let triangles = copies.flat_map(|k| faces.iter().map(move |t| t.map(|v| v + shift(k)))).collect();
    (positions, triangles)
}

#[test]
fn a_group_of_eigenvalues_larger_than_the_basis_is_found_whole() {
    // Thirty identical clamped sheets: each eigenvalue thirty times, more than the basis for 40 modes keeps.
    let shell = shell_of(stacked(30, equilateral_sheet(8, 4, 1.0)), Material::default(), |p| p.x <= 1.0);
    let modes = modes_of(&shell, 40);
    assert_certified("thirty sheets", &shell, &modes);
    assert_eq!(modes.certificate.found, 60);
    for k in 1..30 {
        assert!(repeated(modes.eigenvalues[0], modes.eigenvalues[k]), "{:?}", modes.eigenvalues);
    }
    assert!(!repeated(modes.eigenvalues[29], modes.eigenvalues[30]));
}

#[test]
fn zero_modes_are_counted_on_very_stiff_free_shells() {
    // 1e10 stiffer in the plane: rounding of ‖A‖ is larger than the first elastic modes, yet six modes are rigid.
    for columns in [25, 80] {
        let material = Material { k_area: 1e10, k_length: 1e10, k_bend: 1.0, area_density: 1.0 };
        let shell = shell_of(equilateral_sheet(columns, 2, 0.1), material, |_| false);
        let modes = modes_of(&shell, 8);
        assert_eq!(modes.zero_modes, 6, "{:?}", modes.eigenvalues);
        assert!(modes.eigenvalues[6] > 0.0);
    }
}

#[test]
fn a_strip_of_four_thousand_columns_is_certified() {
    // λ₁/‖A‖ = 3e-19.
    let shell = shell_of(equilateral_sheet(4000, 2, 1.0), Material::default(), |p| p.x <= 1.0);
    assert_certified("long strip", &shell, &modes_of(&shell, 8));
}

//! Energies and their derivatives against independent numbers and finite differences.

use crate::common::*;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{
    AreaEnergy, BendingEnergy, Curvature, Energy, HingeEnergy, LengthEnergy, Mat3, MembraneEnergy, Stress,
    dihedral_angle, plane_stress, rest_quadratic_form,
};
use shellwarp::{Mesh, Vec3};
use std::f64::consts::PI;

fn random_field(rng: &mut StdRng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect()
}

fn along(x: &[Vec3], d: &[Vec3], h: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + h * d).collect()
}

fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn gradient(energy: &dyn Energy, x: &[Vec3]) -> Vec<Vec3> {
    let mut g = vec![Vec3::zeros(); x.len()];
    energy.add_gradient(x, &mut g);
    g
}

/// Central difference with two Richardson steps: truncation h⁶, rounding 1e-16 E/h. With h = 1e-3 of an edge both stay
/// below 1e-10 of a typical slope.
fn directional_derivative(energy: &dyn Energy, x: &[Vec3], d: &[Vec3], h: f64) -> f64 {
    let central = |h: f64| (energy.value(&along(x, d, h)) - energy.value(&along(x, d, -h))) / (2.0 * h);
    let (a, b, c) = (central(h), central(h / 2.0), central(h / 4.0));
    let (ab, bc) = ((4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0);
    (16.0 * bc - ab) / 15.0
}

/// (∂²E/∂x²) d.
fn hessian_times(energy: &dyn Energy, x: &[Vec3], curvature: Curvature, d: &[Vec3]) -> Vec<Vec3> {
    let mut image = vec![Vec3::zeros(); x.len()];
    energy.visit_hessian(x, curvature, &mut |(vertices, blocks)| {
        for (ij, block) in blocks.iter().enumerate() {
            let (i, j) = (vertices[ij / vertices.len()], vertices[ij % vertices.len()]);
            image[i as usize] += block * d[j as usize];
        }
    });
    image
}

/// The derivative of the gradient along d, by the differences of [`directional_derivative`].
fn gradient_derivative(energy: &dyn Energy, x: &[Vec3], d: &[Vec3], h: f64) -> Vec<Vec3> {
    let slope = |h: f64| {
        let (ahead, behind) = (gradient(energy, &along(x, d, h)), gradient(energy, &along(x, d, -h)));
        along(&ahead, &behind, -1.0).iter().map(|g| g / (2.0 * h)).collect::<Vec<_>>()
    };
    let (a, b, c) = (slope(h), slope(h / 2.0), slope(h / 4.0));
    let extrapolated = |i: usize| (64.0 * c[i] - 20.0 * b[i] + a[i]) / 45.0;
    (0..x.len()).map(extrapolated).collect()
}

#[track_caller]
fn assert_same_field(what: &str, actual: &[Vec3], expected: &[Vec3], relative: f64, scale: f64) {
    let error = along(actual, expected, -1.0);
    let error = inner(&error, &error).sqrt() / inner(expected, expected).sqrt().max(scale);
    assert!(error <= relative, "{what}: relative error {error:.2e} > {relative:.0e}");
}

#[test]
fn energies_and_gradient_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let (m, probe) = (shell.material.discrete_shells().unwrap(), &json["probe"]);
        let amp = probe["amp"].as_f64().unwrap();
        let displaced = |(i, p): (usize, &Vec3)| {
            let k = (i + 1) as f64;
            p + amp * Vec3::new((0.7 * k + 0.1).sin(), (1.3 * k + 0.2).sin(), (2.1 * k + 0.3).sin())
        };
        let x: Vec<Vec3> = shell.mesh.positions.iter().enumerate().map(displaced).collect();
        let number = |key: &str| probe[key].as_f64().unwrap();
        // Both sides are f64 sums of about a thousand terms.
        assert_close("area", AreaEnergy::new(&shell.mesh, m.k_area).value(&x), number("E_area"), 1e-10, 0.0);
        assert_close("length", LengthEnergy::new(&shell.mesh, m.k_length).value(&x), number("E_length"), 1e-10, 0.0);
        assert_close("bend", HingeEnergy::new(&shell.mesh, m.k_bend).value(&x), number("E_bend"), 1e-10, 0.0);
        let g = gradient(&*shell.energy, &x);
        assert_close("gradient norm", inner(&g, &g).sqrt(), number("grad_norm"), 1e-10, 0.0);
        for v in 0..3 {
            for c in 0..3 {
                let expected = probe["grad_first3"][v][c].as_f64().unwrap();
                assert_close(&format!("gradient {v} {c}"), g[v][c], expected, 1e-10, 1e4);
            }
        }
    }
}

#[test]
fn gradients_match_finite_differences_on_random_configurations() {
    let mut rng = StdRng::seed_from_u64(1);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    let bumpy = mesh.positions;
    for trial in 0..20 {
        let x = along(&bumpy, &random_field(&mut rng, bumpy.len()), 0.02 * f64::from(trial));
        let d = random_field(&mut rng, bumpy.len());
        for (name, energy) in &terms {
            let g = gradient(&**energy, &x);
            let scale = inner(&g, &g).sqrt().max(1.0) * inner(&d, &d).sqrt();
            // Randomly thin triangles have large higher derivatives; 1e-8 of |g||d| leaves room for their truncation.
            let numeric = directional_derivative(&**energy, &x, &d, 1e-4);
            assert_close(&format!("{name}, trial {trial}"), inner(&g, &d), numeric, 1e-8, scale);
        }
    }
}

type NamedTerms = [(&'static str, Box<dyn Energy>); 5];

/// A bumpy sheet and its terms, of the paper's energy and of Koiter's.
fn bumpy_sheet(rng: &mut StdRng) -> (Mesh, NamedTerms) {
    let (rest, triangles) = equilateral_sheet(5, 4, 1.0);
    let mesh = Mesh::new(along(&rest, &random_field(rng, rest.len()), 0.15), &triangles).unwrap();
    let stress = plane_stress(9.0, 0.3);
    let terms: NamedTerms = [
        ("area", Box::new(AreaEnergy::new(&mesh, 3.0))),
        ("length", Box::new(LengthEnergy::new(&mesh, 5.0))),
        ("hinge", Box::new(HingeEnergy::new(&mesh, 7.0))),
        ("membrane", Box::new(MembraneEnergy::new(&mesh, &stress))),
        ("bending", Box::new(BendingEnergy::new(&mesh, &stress, &[]))),
    ];
    (mesh, terms)
}

#[test]
fn hessians_match_finite_differences_on_random_configurations() {
    let mut rng = StdRng::seed_from_u64(5);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    let n = mesh.positions.len();
    for trial in 0..20 {
        let x = along(&mesh.positions, &random_field(&mut rng, n), 0.02 * f64::from(trial));
        let d = random_field(&mut rng, n);
        for (name, energy) in &terms {
            let exact = hessian_times(&**energy, &x, Curvature::Exact, &d);
            // As for the gradients: room for the large higher derivatives of randomly thin triangles.
            let numeric = gradient_derivative(&**energy, &x, &d, 1e-4);
            assert_same_field(&format!("{name}, trial {trial}"), &exact, &numeric, 1e-8, 1.0);
            let e = random_field(&mut rng, n);
            let other = hessian_times(&**energy, &x, Curvature::Exact, &e);
            // Both orders sum the same few hundred products.
            assert_close("symmetry", inner(&exact, &e), inner(&other, &d), 1e-12, inner(&exact, &exact).sqrt());
        }
    }
}

#[test]
fn hessians_at_rest_are_the_sum_of_the_rest_rows() {
    let mut rng = StdRng::seed_from_u64(6);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    let d = random_field(&mut rng, mesh.positions.len());
    for (name, energy) in &terms {
        let mut rows = vec![Vec3::zeros(); d.len()];
        energy.visit_rest_rows(&mut |(vertices, row)| {
            let strain: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&d[v as usize])).sum();
            vertices.iter().zip(row).for_each(|(&v, b)| rows[v as usize] += strain * b);
        });
        for curvature in [Curvature::Exact, Curvature::Semidefinite] {
            let image = hessian_times(&**energy, &mesh.positions, curvature, &d);
            // The same outer products; strains at rest are rounding.
            assert_same_field(name, &image, &rows, 1e-13, 0.0);
        }
    }
}

#[test]
fn semidefinite_hessians_are_so_and_bound_the_exact_ones_of_membranes() {
    let mut rng = StdRng::seed_from_u64(7);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    for trial in 0..20 {
        let x = along(&mesh.positions, &random_field(&mut rng, mesh.positions.len()), 0.02 * f64::from(trial));
        for (name, energy) in &terms {
            let mut exact: Vec<Vec<Mat3>> = vec![];
            energy.visit_hessian(&x, Curvature::Exact, &mut |(_, blocks)| exact.push(blocks.to_vec()));
            let mut exact = exact.into_iter();
            energy.visit_hessian(&x, Curvature::Semidefinite, &mut |(vertices, blocks)| {
                let difference: Vec<Mat3> = blocks.iter().zip(exact.next().unwrap()).map(|(s, e)| s - e).collect();
                let largest = dense(blocks, vertices.len()).norm();
                // Eigenvalues carry the matrix's rounding.
                assert!(lowest_eigenvalue(blocks, vertices.len()) >= -1e-14 * largest, "{name}");
                let excess = lowest_eigenvalue(&difference, vertices.len());
                assert!(
                    ["hinge", "bending"].contains(name) || excess >= -1e-13 * largest,
                    "{name}: {excess:e} of {largest:e}"
                );
            });
        }
    }
}

#[test]
fn hessians_with_stresses_go_from_the_semidefinite_ones_to_the_exact_ones_by_their_share() {
    let mut rng = StdRng::seed_from_u64(17);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    for trial in 0..10 {
        let x = along(&mesh.positions, &random_field(&mut rng, mesh.positions.len()), 0.04 * f64::from(trial));
        for (name, energy) in &terms {
            let mut strains = vec![];
            energy.visit_strains(&x, &mut |_, strain| strains.push(strain));
            let own = |curvature| {
                let mut all: Vec<Mat3> = vec![];
                energy.visit_hessian(&x, curvature, &mut |(_, blocks)| all.extend(blocks));
                all
            };
            let with = |share| {
                let mut all: Vec<Mat3> = vec![];
                energy.visit_mixed_hessian(&x, Stress { of: &strains, share }, &mut |(_, blocks)| all.extend(blocks));
                all
            };
            let [least, most] = [Curvature::Semidefinite, Curvature::Exact].map(own);
            let scale = most.iter().map(|block| block.amax()).fold(0.0, f64::max);
            for share in [0.0, 0.3, 1.0] {
                for ((block, least), most) in with(share).iter().zip(&least).zip(&most) {
                    let error = (block - (least + share * (most - least))).amax();
                    assert!(error <= 1e-13 * scale, "{name}, {share}: {error:e}"); // roundings of √(2w)
                }
            }
        }
    }
}

fn dense(blocks: &[Mat3], k: usize) -> nalgebra::DMatrix<f64> {
    nalgebra::DMatrix::from_fn(3 * k, 3 * k, |r, c| blocks[(r / 3) * k + c / 3][(r % 3, c % 3)])
}

fn lowest_eigenvalue(blocks: &[Mat3], k: usize) -> f64 {
    dense(blocks, k).symmetric_eigenvalues().min()
}

#[test]
fn rows_vanish_on_rigid_motions_of_any_configuration() {
    let mut rng = StdRng::seed_from_u64(8);
    let (mesh, terms) = bumpy_sheet(&mut rng);
    let x = along(&mesh.positions, &random_field(&mut rng, mesh.positions.len()), 0.2);
    let (shift, spin) = (Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, 0.7));
    for (name, energy) in &terms {
        energy.visit_rows(&x, &mut |(vertices, row)| {
            let rate: f64 = vertices.iter().zip(row).map(|(&v, b)| b.dot(&(shift + spin.cross(&x[v as usize])))).sum();
            let size: f64 = row.iter().map(|b| b.norm()).sum();
            // Rounding of lengths up to 6 edges.
            assert!(rate.abs() <= 1e-13 * size, "{name}: {rate:e} of {size:e}");
        });
    }
}

fn hinge(fold: f64) -> Vec<Vec3> {
    let (s, c) = fold.sin_cos();
    vec![Vec3::zeros(), Vec3::x(), Vec3::new(0.3, 0.9, 0.0), Vec3::new(0.6, -1.1 * c, -1.1 * s)]
}

#[test]
fn hinge_gradient_holds_past_a_right_angle_and_near_a_half_turn() {
    let mut rng = StdRng::seed_from_u64(2);
    let triangles = [[0, 1, 2], [1, 0, 3]];
    for rest in [0.0, 1.0, -1.5, 3.1] {
        let mesh = Mesh::new(hinge(rest), &triangles).unwrap();
        let energy = HingeEnergy::new(&mesh, 2.0);
        for degrees in [0.0f64, 1e-3, 30.0, 89.0, 91.0, 135.0, 170.0, 179.0, 179.9, -45.0, -120.0, -179.0] {
            let x = hinge(degrees.to_radians());
            let corners = [x[0], x[1], x[2], x[3]];
            // 1e-15 from atan2, times the conditioning of the normals: a few units in the last place.
            assert_close("angle", dihedral_angle(&corners).abs(), degrees.to_radians().abs(), 1e-14, 1.0);
            for _ in 0..5 {
                let d = random_field(&mut rng, 4);
                let g = gradient(&energy, &x);
                let scale = inner(&g, &g).sqrt().max(1.0) * inner(&d, &d).sqrt();
                // h = 2e-4 keeps 179.9° (1.7e-3 rad from the wrap at 180°) on its branch; rounding is then 1e-16 E/h.
                let numeric = directional_derivative(&energy, &x, &d, 2e-4);
                assert_close(&format!("rest {rest}, fold {degrees}"), inner(&g, &d), numeric, 2e-10, scale);
            }
        }
    }
}

/// A triangle and its neighbours, one folded so far about their edge and the others by so much.
fn neighbours(fold: f64, others: f64) -> Vec<Vec3> {
    let mut x = hinge(fold);
    x.extend([Vec3::new(1.1, 0.8, others), Vec3::new(-0.6, 0.5, -0.7 * others)]);
    x
}

#[test]
fn bending_is_smooth_where_an_edge_folds_through_itself() {
    let mut rng = StdRng::seed_from_u64(10);
    let triangles = [[0, 1, 2], [1, 0, 3], [2, 1, 4], [0, 2, 5]];
    for rest in [0.0, 0.4, -1.5] {
        let mesh = Mesh::new(neighbours(rest, 0.1), &triangles).unwrap();
        let energy = BendingEnergy::new(&mesh, &plane_stress(9.0, 0.3), &[]);
        // Steps of 1e-6 rad take the value of a smooth energy by some 1e-6 of itself, and its slope by some 1e-5.
        let (before, after) = (neighbours(rest + PI - 1e-6, 0.6), neighbours(rest + PI + 1e-6, 0.6));
        assert_close("value", energy.value(&after), energy.value(&before), 1e-5, 0.0);
        assert_same_field("slope", &gradient(&energy, &after), &gradient(&energy, &before), 1e-4, 0.0);
        assert!(energy.value(&before) > 1e-3, "the other edges stay bent");
        for degrees in [60.0f64, 119.9, 121.0, 135.0, 150.0, 175.0, 179.99, 180.0, -179.99, -150.0, -121.0] {
            let x = neighbours(rest + degrees.to_radians(), 0.6);
            let d = random_field(&mut rng, x.len());
            let numeric = directional_derivative(&energy, &x, &d, 2e-4);
            let slope = gradient(&energy, &x);
            let scale = inner(&slope, &slope).sqrt().max(1.0) * inner(&d, &d).sqrt();
            // Third derivatives jump at 120 degrees and at 180: 1e-7 of a typical slope and 1e-5 of a typical curvature within h of them.
            assert_close(&format!("rest {rest}, fold {degrees}"), inner(&slope, &d), numeric, 1e-7, scale);
            let exact = hessian_times(&energy, &x, Curvature::Exact, &d);
            let numeric = gradient_derivative(&energy, &x, &d, 2e-4);
            assert_same_field(&format!("rest {rest}, fold {degrees}"), &exact, &numeric, 1e-5, 1.0);
        }
    }
}

#[test]
fn hinge_hessian_holds_past_a_right_angle_and_near_a_half_turn() {
    let mut rng = StdRng::seed_from_u64(9);
    for rest in [0.0, 1.0, -1.5, 3.1] {
        let energy = HingeEnergy::new(&Mesh::new(hinge(rest), &[[0, 1, 2], [1, 0, 3]]).unwrap(), 2.0);
        for degrees in [0.0f64, 1e-3, 30.0, 89.0, 91.0, 135.0, 170.0, 179.0, 179.9, -45.0, -120.0, -179.0] {
            let x = hinge(degrees.to_radians());
            for _ in 0..5 {
                let d = random_field(&mut rng, 4);
                let exact = hessian_times(&energy, &x, Curvature::Exact, &d);
                // As for the gradient, h keeps 179.9° on its branch.
                let numeric = gradient_derivative(&energy, &x, &d, 2e-4);
                assert_same_field(&format!("rest {rest}, fold {degrees}"), &exact, &numeric, 1e-9, 1.0);
            }
        }
    }
}

#[test]
fn a_fold_through_a_half_turn_stays_finite() {
    let mesh = Mesh::new(hinge(0.0), &[[0, 1, 2], [1, 0, 3]]).unwrap();
    let energy = HingeEnergy::new(&mesh, 1.0);
    let highest = energy.value(&hinge(std::f64::consts::PI - 1e-9));
    for degrees in 0..=360 {
        let x = hinge(f64::from(degrees).to_radians());
        assert!(energy.value(&x) <= highest * (1.0 + 1e-8), "{degrees}°");
        assert!(gradient(&energy, &x).iter().all(|g| g.iter().all(|c| c.is_finite())));
    }
}

/// The hinge's first triangle, upright at 1, flat at 0 and turned over below.
fn passing(height: f64) -> Vec<Vec3> {
    let mut x = hinge(0.7);
    x[2].y *= height;
    x
}

#[test]
fn a_triangle_that_passes_through_no_area_lets_go_of_its_hinge() {
    let energy = HingeEnergy::new(&Mesh::new(hinge(0.2), &[[0, 1, 2], [1, 0, 3]]).unwrap(), 2.0);
    let mut rng = StdRng::seed_from_u64(4);
    let mut steepest: f64 = 0.0;
    for k in -120i32..=120 {
        let x = passing(f64::from(k) * 1e-4 + 5e-5);
        let g = gradient(&energy, &x);
        steepest = steepest.max(inner(&g, &g).sqrt());
        let d = random_field(&mut rng, 4);
        let numeric = directional_derivative(&energy, &x, &d, 1e-7);
        let scale = (1.0 + inner(&g, &g).sqrt()) * inner(&d, &d).sqrt();
        // Fourth order with h = 1e-7, on heights of 5e-5 and more: rounding of E over h. Where φ bends, at a hundredth, h decides.
        let tolerance = if k.abs() == 100 { 1e-4 } else { 1e-7 };
        assert_close(&format!("height {k}"), inner(&g, &d), numeric, tolerance, scale);
    }
    let jump = energy.value(&passing(1e-9)) - energy.value(&passing(-1e-9));
    assert!(jump.abs() < 1e-12, "{jump:e}: φ is 1e-14 on both sides");
    // θ turns by at most π over a height of a hundredth; without φ it had jumped, behind a gradient of 1e9.
    println!("steepest {steepest:.1}");
    assert!(steepest < 1e5, "{steepest:e}");
    let whole = 6.0 * (dihedral_angle(&<[Vec3; 4]>::try_from(passing(0.011)).unwrap()) - 0.2).powi(2);
    let weight = 2.0 / (0.9 + 1.1);
    assert_close("untouched from a hundredth on", energy.value(&passing(0.011)), whole * weight, 1e-13, 1.0);
}

#[test]
fn collapsed_triangles_give_finite_energy_and_force() {
    let mesh = Mesh::new(hinge(0.5), &[[0, 1, 2], [1, 0, 3]]).unwrap();
    let collapsed = vec![Vec3::zeros(); 4];
    let line: Vec<Vec3> = (0..4).map(|i| Vec3::x() * f64::from(i)).collect();
    let stress = plane_stress(1.0, 0.3);
    let terms: [Box<dyn Energy>; 5] = [
        Box::new(AreaEnergy::new(&mesh, 1.0)),
        Box::new(LengthEnergy::new(&mesh, 1.0)),
        Box::new(HingeEnergy::new(&mesh, 1.0)),
        Box::new(MembraneEnergy::new(&mesh, &stress)),
        Box::new(BendingEnergy::new(&mesh, &stress, &[])),
    ];
    for (x, energy) in terms.iter().flat_map(|e| [(&collapsed, e), (&line, e)]) {
        assert!(energy.value(x).is_finite());
        assert!(gradient(&**energy, x).iter().all(|g| g.iter().all(|c| c.is_finite())));
        for curvature in [Curvature::Exact, Curvature::Semidefinite] {
            let image = hessian_times(&**energy, x, curvature, &line);
            assert!(image.iter().all(|g| g.iter().all(|c| c.is_finite())));
        }
    }
}

#[test]
fn rest_rows_are_the_second_derivative_at_rest() {
    let mut rng = StdRng::seed_from_u64(3);
    for name in ["flat_beam", "v_beam"] {
        let (shell, _) = reference(name);
        let rest = &shell.mesh.positions;
        for _ in 0..5 {
            let u = random_field(&mut rng, rest.len());
            let h = 1e-5;
            let ahead = inner(&gradient(&*shell.energy, &along(rest, &u, h)), &u);
            let behind = inner(&gradient(&*shell.energy, &along(rest, &u, -h)), &u);
            // Central difference: truncation (h/edge)² = 1e-8.
            assert_close(name, rest_quadratic_form(&*shell.energy, &u), (ahead - behind) / (2.0 * h), 1e-6, 0.0);
        }
    }
}

#[test]
fn rigid_motions_at_rest_cost_nothing() {
    let (shell, _) = reference("v_beam");
    let stiff = rest_quadratic_form(&*shell.energy, &random_field(&mut StdRng::seed_from_u64(4), 369));
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        let turn: Vec<Vec3> = shell.mesh.positions.iter().map(|p| axis.cross(p)).collect();
        for field in [vec![axis; 369], turn] {
            // Squares of rounding: (1e-15)² of a generic field's value.
            assert!(rest_quadratic_form(&*shell.energy, &field) < 1e-28 * stiff);
        }
    }
}

#[test]
fn cylindrical_bending_has_the_plate_rigidity_six_k() {
    // Vertices on w = κx²/2: energy density ½ D κ² with D = 6 k_B (reference/hinge_continuum_limit.csv, C11 = 3 k_B).
    let kappa = 1e-4;
    for rows in [20, 40] {
        let (flat, triangles) = equilateral_sheet(2 * rows, rows, 1.0);
        let mesh = Mesh::new(flat.clone(), &triangles).unwrap();
        let bent: Vec<Vec3> = flat.iter().map(|p| p + Vec3::z() * (0.5 * kappa * p.x * p.x)).collect();
        let area: f64 = (0..mesh.triangles.len()).map(|t| mesh.area(t)).sum();
        let density = HingeEnergy::new(&mesh, 1.0).value(&bent) / (area * kappa * kappa);
        // Boundary edges carry no hinge: a share of the order of 1/rows is missing.
        assert_close(&format!("{rows} rows"), density, 3.0, 1.0 / rows as f64, 0.0);
    }
}

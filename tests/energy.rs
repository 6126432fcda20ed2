//! Energies and their derivatives against independent numbers and finite differences.
#![allow(missing_docs)]
mod common;
use common::*;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{AreaEnergy, Energy, HingeEnergy, LengthEnergy, dihedral_angle, rest_quadratic_form};
use shellwarp::{Mesh, Vec3};

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

#[test]
fn energies_and_gradient_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let (m, probe) = (shell.material, &json["probe"]);
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
    let (rest, triangles) = equilateral_sheet(5, 4, 1.0);
    let bumpy = along(&rest, &random_field(&mut rng, rest.len()), 0.15);
    let mesh = Mesh::new(bumpy.clone(), &triangles).unwrap();
    let terms: [(&str, Box<dyn Energy>); 3] = [
        ("area", Box::new(AreaEnergy::new(&mesh, 3.0))),
        ("length", Box::new(LengthEnergy::new(&mesh, 5.0))),
        ("hinge", Box::new(HingeEnergy::new(&mesh, 7.0))),
    ];
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

#[test]
fn collapsed_triangles_give_finite_energy_and_force() {
    let mesh = Mesh::new(hinge(0.5), &[[0, 1, 2], [1, 0, 3]]).unwrap();
    let collapsed = vec![Vec3::zeros(); 4];
    let line: Vec<Vec3> = (0..4).map(|i| Vec3::x() * f64::from(i)).collect();
    let terms: [Box<dyn Energy>; 3] = [
        Box::new(AreaEnergy::new(&mesh, 1.0)),
        Box::new(LengthEnergy::new(&mesh, 1.0)),
        Box::new(HingeEnergy::new(&mesh, 1.0)),
    ];
    for (x, energy) in terms.iter().flat_map(|e| [(&collapsed, e), (&line, e)]) {
        assert!(energy.value(x).is_finite());
        assert!(gradient(&**energy, x).iter().all(|g| g.iter().all(|c| c.is_finite())));
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

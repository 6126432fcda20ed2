//! Modal rotation, rotation coefficients and the warp against closed forms.

use crate::common::*;
use nalgebra::{Matrix3, Rotation3};
use pulp::{Arch, Scalar, Simd, WithSimd};
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::real::Real;
use shellwarp::step::ForceLaw;
use shellwarp::step::modal_force::visit_motion;
use shellwarp::warp::lanes::{Fused, Lanes};
use shellwarp::warp::{Basis, LANES, ModalRotation, coefficients, doublings};
use shellwarp::{Mesh, Vec3};

#[test]
fn a_rigid_field_has_its_own_rotation_at_every_vertex() {
    let mut rng = StdRng::seed_from_u64(5);
    for name in ["flat_beam.obj", "v_beam.obj", "dinosaur.obj"] {
        let mesh = mesh(name);
        let rotation = ModalRotation::new(&mesh);
        for _ in 0..3 {
            let [omega, shift] = [0; 2].map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
            let u: Vec<Vec3> = mesh.positions.iter().map(|p| omega.cross(p) + shift).collect();
            for (v, w) in rotation.apply(&u).iter().enumerate() {
                // The dinosaur spans 250 of its edges: rounding of u relative to an edge is some 1e-13.
                assert!((w - omega).norm() <= 1e-12, "{name}, vertex {v}: off by {:e}", (w - omega).norm());
            }
        }
    }
}

#[test]
fn a_single_triangle_has_its_own_rotation_in_every_plane() {
    let mut rng = StdRng::seed_from_u64(8);
    for trial in 0..3000 {
        let mut corners: Vec<Vec3> = (0..3).map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        if trial % 4 < 3 {
            corners.iter_mut().for_each(|p| p[trial % 4] = 0.0); // in a coordinate plane
        }
        let mesh = Mesh::new(corners.clone(), &[[0, 1, 2]]).unwrap();
        let omega = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        let u: Vec<Vec3> = corners.iter().map(|p| omega.cross(p)).collect();
        let [a, b] = [corners[1] - corners[0], corners[2] - corners[0]];
        let longest = a.norm_squared().max(b.norm_squared()).max((b - a).norm_squared());
        let thinness = longest / a.cross(&b).norm();
        for w in ModalRotation::new(&mesh).apply(&u) {
            // Rounding, times the square of the triangle's thinness (the condition of its inertia).
            assert!((w - omega).norm() <= 1e-13 * thinness * thinness, "{corners:?}: {w:?} instead of {omega:?}");
        }
    }
}

/// sin θ/θ, (1 − cos θ)/θ², (θ − sin θ)/θ³ without cancellation: half-angle form, and a long series below 1.
fn closed_forms(theta: f64) -> [f64; 3] {
    if theta > 1.0 {
        let half = (theta / 2.0).sin() / theta;
        return [theta.sin() / theta, 2.0 * half * half, (theta - theta.sin()) / theta.powi(3)];
    }
    let series = |first: f64| {
        let mut term = 1.0 / (1..=first as u32).map(f64::from).product::<f64>();
        let mut sum = term;
        for k in 1..15 {
            term *= -theta * theta / ((first + f64::from(2 * k) - 1.0) * (first + f64::from(2 * k)));
            sum += term;
        }
        sum
    };
    [series(1.0), series(2.0), series(3.0)]
}

fn doublings_of<T: Real>(s: &[T; LANES]) -> u32 {
    doublings(s.iter().map(|s| s.to_f64().sqrt()).fold(0.0, f64::max))
}

/// [A, B, C] of each angle, in the widest registers that there are.
fn wide_coefficients<T: Real>(s: &[T; LANES]) -> [[T; LANES]; 3] {
    struct Wide<'a, T>(&'a [T; LANES]);
    impl<T: Real> WithSimd for Wide<'_, T> {
        type Output = [[T; LANES]; 3];
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let mut out = [[T::default(); LANES]; 3];
            for at in 0..T::registers::<S>(self.0).len() {
                let lanes = Lanes::<T, Fused<S>, 1>::new(simd);
                let c = coefficients(lanes, lanes.load(self.0, at), doublings_of(self.0));
                lanes.store(c.a, &mut out[0], at);
                lanes.store(c.b, &mut out[1], at);
                lanes.store(c.c, &mut out[2], at);
            }
            out
        }
    }
    Arch::new().dispatch(Wide(s))
}

/// As [`wide_coefficients`], one number at a time.
fn narrow_coefficients<T: Real>(s: &[T; LANES]) -> [[T; LANES]; 3] {
    let mut out = [[T::default(); LANES]; 3];
    for at in 0..LANES {
        let lanes = Lanes::<T, Fused<Scalar>, 1>::new(Scalar);
        let c = coefficients(lanes, lanes.load(s, at), doublings_of(s));
        lanes.store(c.a, &mut out[0], at);
        lanes.store(c.b, &mut out[1], at);
        lanes.store(c.c, &mut out[2], at);
    }
    out
}

fn worst_coefficient_error<T: Real>(largest: f64) -> f64 {
    let mut worst = 0.0f64;
    for k in 0..4000 {
        let theta = largest * f64::from(k) / 4000.0;
        let s = T::of(theta * theta);
        let exact = closed_forms(s.to_f64().sqrt());
        for coefficients in [wide_coefficients(&[s; LANES]), narrow_coefficients(&[s; LANES])] {
            for (values, exact) in coefficients.iter().zip(exact) {
                worst = worst.max((values[0].to_f64() - exact).abs());
            }
        }
    }
    worst
}

#[test]
fn rotation_coefficients_match_closed_forms_at_every_angle() {
    // Some roundings of 6e-8 or 1.1e-16, and about one more with each angle doubling, of which 20 rad takes three.
    for (largest, single, double) in [(0.1, 1e-7, 5e-16), (1.0, 1e-7, 5e-16), (6.5, 3e-7, 1e-15), (20.0, 5e-7, 2e-15)] {
        let (f32_error, f64_error) = (worst_coefficient_error::<f32>(largest), worst_coefficient_error::<f64>(largest));
        println!("up to {largest} rad: f32 {f32_error:.1e}, f64 {f64_error:.1e}");
        assert!(f32_error <= single && f64_error <= double, "{largest} rad: {f32_error:e}, {f64_error:e}");
    }
}

#[test]
fn mixed_angles_in_a_block_do_not_disturb_each_other() {
    let mut s = [0.0f64; LANES];
    s[3] = 400.0;
    s[7] = 1e-12;
    let c = wide_coefficients(&s);
    for i in [0, 3, 7] {
        let exact = closed_forms(s[i].sqrt());
        for (values, exact) in c.iter().zip(exact) {
            let value = &values[i];
            // Three doublings from x = s/4³.
            assert_close("coefficient", *value, exact, 1e-13, 1.0);
        }
    }
}

#[test]
fn coefficients_of_nonsense_do_not_hang() {
    for s in [f64::INFINITY, f64::NAN, 1e300] {
        wide_coefficients(&[s; LANES]);
        wide_coefficients(&[s as f32; LANES]);
    }
}

/// One vertex with Φ and Ψ in its first mode, and three modes that move it along the axes.
fn one_vertex(phi: Vec3, psi: Vec3) -> Basis<f64> {
    let mut basis = Basis::<f64>::new(&[Vec3::zeros()], &[1.0], 4, 1.0).unwrap();
    basis.set_mode(0, &[phi], &[psi]);
    (1..4).for_each(|k| basis.set_mode(k, &[Vec3::ith(k - 1, 1.0)], &[Vec3::zeros()]));
    basis
}

/// Displacement at amplitude 1 of the first mode, and R v as the rate that v along the axes makes.
fn warp_and_rotate(basis: &Basis<f64>, v: Vec3) -> (Vec3, Vec3) {
    let mut found = (Vec3::zeros(), Vec3::zeros());
    let (q, q_dot) = ([1.0, 0.0, 0.0, 0.0], [0.0, v.x, v.y, v.z]);
    visit_motion(basis, ForceLaw::Rotated, (&q, &q_dot), |_, u, rate| found = (u, rate));
    found
}

#[test]
fn rotation_and_warp_match_the_matrix_exponential_and_its_integral() {
    let mut rng = StdRng::seed_from_u64(6);
    for scale in [0.0, 1e-9, 1e-3, 0.5, 2.0, 3.2, 6.3, 15.0] {
        let [w, u] = [0; 2].map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
        let w = w.normalize() * scale;
        let basis = one_vertex(u, w);
        let exact = Rotation3::from_scaled_axis(w).into_inner();
        // ∫₀¹ exp(t [w]×) dt by Gauss–Legendre on many panels.
        let panels = 200;
        let node = 0.5 / 3f64.sqrt();
        let integral: Matrix3<f64> = (0..panels)
            .flat_map(|k| [0.5 - node, 0.5 + node].map(|t| (f64::from(k) + t) / f64::from(panels)))
            .map(|t| Rotation3::from_scaled_axis(w * t).into_inner() / (2.0 * f64::from(panels)))
            .sum();
        let v = Vec3::new(0.3, -0.7, 0.2);
        let (displacement, rotated) = warp_and_rotate(&basis, v);
        assert!((rotated - exact * v).norm() < 1e-13, "R at {scale}"); // Rᵀ: tests/modal/virtual_work.rs, by powers
        // Two-point Gauss on 200 panels: (|w|/200)⁴/4320 ≤ 1e-8 at 15 rad, far less below.
        assert!((displacement - integral * u).norm() < 1e-8, "R̃ at {scale}");
    }
}

#[test]
fn warped_rigid_rotations_are_exact() {
    let mut rng = StdRng::seed_from_u64(7);
    for angle in [1e-6, 0.3, 2.0, 7.0, 20.0] {
        let [axis, x] = [0; 2].map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
        let w = axis.normalize() * angle;
        let (displacement, _) = warp_and_rotate(&one_vertex(w.cross(&x), w), Vec3::zeros());
        let exact = Rotation3::from_scaled_axis(w) * x - x;
        // R̃(w)(w × x) = (R(w) − I) x; rounding of w·C doubled five times at 20 rad.
        assert!((displacement - exact).norm() < 1e-13 * (1.0 + angle), "{angle} rad");
    }
}

#[test]
fn a_strip_bent_to_an_arc_has_the_closed_forms_warp_error() {
    // Linear shape w = κs²/2 with slope θ at s = 1; the strip runs past both ends so that every vertex used is interior,
    // where the mean over a symmetric star of triangles gives a quadratic's slope exactly.
    let segments = 400;
    let edge = 1.0 / segments as f64;
    let margin = 4;
    let (flat, triangles) = equilateral_sheet(segments + 2 * margin, 4, edge);
    let positions: Vec<Vec3> = flat.iter().map(|p| p - Vec3::x() * (margin as f64 * edge)).collect();
    let mesh = Mesh::new(positions.clone(), &triangles).unwrap();
    let row = 2.0 * edge * 3f64.sqrt() / 2.0;
    let mut centre: Vec<usize> = (0..positions.len()).filter(|&v| (positions[v].y - row).abs() < 1e-9).collect();
    centre.retain(|&v| (-1e-9..1.0 + 1e-9).contains(&positions[v].x));
    centre.sort_by(|&a, &b| positions[a].x.total_cmp(&positions[b].x));
    assert_eq!(centre.len(), segments + 1);

    let unit: Vec<Vec3> = positions.iter().map(|p| -0.5 * p.x * p.x * Vec3::z()).collect();
    let rotation = ModalRotation::new(&mesh).apply(&unit);
    let mut basis = Basis::<f64>::new(&positions, &vec![0.0; positions.len()], 1, 1.0).unwrap();
    basis.set_mode(0, &unit, &rotation);
    let mut x = positions.clone();
    for row in csv("modal_warping_arc_error.csv") {
        let theta = row[0].to_radians();
        visit_motion(&basis, ForceLaw::Rotated, (&[theta], &[0.0]), |v, u, _| x[v] = positions[v] + u);
        let tip = x[centre[segments]];
        let (drop, shortening) = (-tip.z, 1.0 - tip.x);
        let (exact_drop, exact_shortening) = ((1.0 - theta.cos()) / theta, 1.0 - theta.sin() / theta);
        let points: Vec<Vec3> = centre.iter().map(|&v| x[v]).collect();
        let polyline =
            |step: usize| -> f64 { points.windows(step + 1).step_by(step).map(|p| (p[step] - p[0]).norm()).sum() };
        let length = (4.0 * polyline(1) - polyline(2)) / 3.0; // chords fall short at second order
        let error = (drop - exact_drop).hypot(shortening - exact_shortening);
        // Half a unit of the table's last digit: 8 decimals, then 5 for the three derived columns.
        for (what, value, column, half_digit) in [
            ("exact drop", exact_drop, 1, 5.1e-9),
            ("exact shortening", exact_shortening, 2, 5.1e-9),
            ("drop", drop, 3, 5.1e-9),
            ("shortening", shortening, 4, 5.1e-9),
            ("relative error of the drop", drop / exact_drop - 1.0, 5, 5.1e-6),
            ("position error", error, 6, 5.1e-6),
            ("arc length − 1", length - 1.0, 7, 5.1e-6),
        ] {
            assert!((value - row[column]).abs() <= half_digit, "{what} at {}°: {value}, table {}", row[0], row[column]);
        }
    }
}
